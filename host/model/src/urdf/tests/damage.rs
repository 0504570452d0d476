//! Files that are damaged: an error or a hand, never a panic, and soon.

use super::*;
use blindgrasp_meshes::Numbers;
use std::time::{Duration, Instant};

/// Time that reading may take on a machine that does other things too; a reader whose time grows with the square of the length
/// takes minutes.
const PATIENCE: Duration = Duration::from_secs(10);

/// Replacements for a piece of a URDF.
const PIECES: [&str; 24] = [
    "", "<", ">", "/", "\"", "=", " ", "&", "&lt;", "<!--", "-->", "0", "-", "1e400", "nan", "-inf", "1e308",
    "link", "joint", "name", "left-1", "palm", "revolute", "\u{feff}",
];

#[test]
fn damaged_urdfs_are_refused_or_read_in_bounded_time() {
    let mut numbers = Numbers(5);
    let (mut read, mut refused, mut slowest) = (0, 0, Duration::ZERO);
    for _ in 0..1500 {
        let mut urdf = GRIPPER.to_owned();
        for _ in 0..=numbers.below(3) {
            let floor = |mut at: usize, text: &str| {
                while !text.is_char_boundary(at) {
                    at -= 1;
                }
                at
            };
            let from = floor(numbers.below(urdf.len() + 1), &urdf);
            let to = floor((from + numbers.below(12)).min(urdf.len()), &urdf);
            match numbers.below(6) {
                // A part is gone, is there twice, or stands somewhere else.
                0 => {
                    let end = floor((from + numbers.below(900)).min(urdf.len()), &urdf);
                    urdf.replace_range(from..end, "");
                }
                1 => {
                    let end = floor((from + numbers.below(900)).min(urdf.len()), &urdf);
                    let part = urdf[from..end].to_owned();
                    let at = floor(numbers.below(urdf.len() + 1), &urdf);
                    urdf.insert_str(at, &part);
                }
                2 => urdf.truncate(from),
                _ => urdf.replace_range(from..to.max(from), PIECES[numbers.below(PIECES.len())]),
            }
        }
        let start = Instant::now();
        match load(HAND, &urdf) {
            Ok(_) => read += 1,
            Err(error) => {
                assert!(!error.contains('\n') && error.len() < 1000, "{error}");
                assert!(error.contains("hand.toml") || error.contains("gripper.urdf"), "no place: {error}");
                refused += 1;
            }
        }
        slowest = slowest.max(start.elapsed());
    }
    println!("{read} read, {refused} refused, the slowest in {slowest:?}");
    assert!(read > 25 && refused > 1000);
    assert!(slowest < PATIENCE);
}

/// Files that are made to take long, each of the largest size that is read.
#[test]
fn hostile_urdfs_take_no_time() {
    let repeated = |piece: &dyn Fn(usize) -> String| {
        let mut text = String::from("<robot name=\"r\">");
        for k in 0.. {
            let piece = piece(k);
            if text.len() + piece.len() > (4 << 20) - 100 {
                break;
            }
            text += &piece;
        }
        text
    };
    let chain = |k: usize| {
        format!(
            "<link name=\"{k}\"/><joint name=\"{k}\" type=\"fixed\"><parent link=\"{}\"/><child link=\"{k}\"/></joint>",
            k.saturating_sub(1)
        )
    };
    let mut attributes = String::from("<robot");
    for k in 0..300_000 {
        attributes += &format!(" a{k}=\"\"");
    }
    let cases = [
        ("nested elements", repeated(&|_| "<x>".into()), "has more than 200000 elements; is this a URDF?"),
        ("elements", repeated(&|_| "<x/>".into()) + "</robot>", "has more than 200000 elements; is this a URDF?"),
        ("attributes", attributes, "a tag with more than 100 attributes; is this a URDF?"),
        (
            "nested namespaces",
            repeated(&|k| format!("<x xmlns:a{k}=\"{k}\">")),
            "more than 200 namespaces; is this a URDF?",
        ),
        ("links", repeated(&chain) + "</robot>", "has more than 2000 links; cut out the part with the hand"),
        (
            "entities",
            "<!DOCTYPE r [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;\">]><robot>&b;</robot>".into(),
            "has a DTD; remove <!DOCTYPE ...>: a URDF needs none",
        ),
        ("blanks", repeated(&|_| "                                        ".into()) + "</robot>", "has no <link>; is this a URDF?"),
        ("a long number", repeated(&|k| if k == 0 { "<link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/><origin xyz=\"".into() } else { "9999999999".into() }) + " 0 0\"/></joint></robot>", "is not finite"),
    ];
    for (what, urdf, expected) in cases {
        assert!(urdf.len() <= 4 << 20, "{what}: {}", urdf.len());
        let start = Instant::now();
        let error = load(HAND, &urdf).expect_err(what);
        assert!(error.contains(expected), "{what}: {error}");
        let elapsed = start.elapsed();
        println!("{what}: {:.1} MiB in {elapsed:?}", urdf.len() as f64 / 1048576.0);
        assert!(elapsed < PATIENCE, "{what}: {elapsed:?}");
    }
}

/// Two thousand links in one chain: as many as there may be.
#[test]
fn the_longest_chain_is_read() {
    let mut urdf = String::from("<robot name=\"r\"><link name=\"0\"/>");
    for k in 1..2000 {
        let kind = if k == 3 || k == 1500 { "revolute" } else { "fixed" };
        urdf += &format!(
            "<link name=\"{k}\"><inertial><mass value=\"0.001\"/><inertia ixx=\"1e-6\" iyy=\"1e-6\" izz=\"1e-6\"/></inertial></link>\
             <joint name=\"{k}\" type=\"{kind}\"><parent link=\"{}\"/><child link=\"{k}\"/><origin xyz=\"0 0 0.0005\"/>\
             <limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>",
            k - 1
        );
    }
    urdf += "</robot>";
    let toml = changed(HAND, "base = \"palm\"\n", "");
    let toml = toml.replace("left-tip", "1999").replace("right-tip", "1000");
    let start = Instant::now();
    let (file, _, _) = load(&toml, &urdf).unwrap();
    println!("2000 links in {:?}", start.elapsed());
    assert_eq!(file.joints.len(), 2);
    assert!((file.joints[0].mass_kg - 1.497).abs() < 1e-12 && (file.joints[1].mass_kg - 0.5).abs() < 1e-12);
    assert!(start.elapsed() < PATIENCE);
}
