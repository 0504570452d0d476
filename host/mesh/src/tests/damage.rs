//! Files that are damaged, hostile, or as large as they may be.

use super::*;
use blindgrasp_meshes::{Numbers, grid_box};
use std::time::Instant;

/// Bytes that mean something in one of the formats.
const ODD: &[u8] = b"0123456789-.eE /\n\r\\nvf\0\xff";

/// On a busy machine, and not optimised.
const SLOWEST_S: f64 = 30.0;

/// Random bytes in random places: no panic, no control characters, whatever comes out.
#[test]
fn damaged_files_never_panic() {
    let mut numbers = Numbers(60);
    let files = [("b.stl", binary(&plate())), ("a.stl", ascii(&plate())), ("o.obj", wavefront(&plate()))];
    let (mut read_anyway, mut refused) = (0, 0);
    for round in 0..6000 {
        let (name, bytes) = &files[round % 3];
        let mut bytes = bytes.clone();
        for _ in 0..=numbers.below(4) {
            let at = numbers.below(bytes.len());
            match numbers.below(7) {
                0 => bytes.truncate(at + 1),
                1 => bytes[at] ^= 1 << numbers.below(8),
                2 => bytes[at] = ODD[numbers.below(ODD.len())],
                3 => drop(bytes.drain(at..(at + numbers.below(60)).min(bytes.len()))),
                4 => {
                    let copy = bytes[at..(at + numbers.below(200)).min(bytes.len())].to_vec();
                    let to = numbers.below(bytes.len());
                    bytes.splice(to..to, copy);
                }
                5 => bytes.insert(at, (numbers.unit() * 256.0) as u8),
                _ => {
                    let other = numbers.below(bytes.len().min(200));
                    bytes.swap(at, other);
                }
            }
            if bytes.is_empty() {
                break;
            }
        }
        match read(name, &bytes) {
            Ok(repaired) => {
                read_anyway += 1;
                // What it is after that, a body or a refusal, is no panic either.
                let _ = faces(&repaired);
            }
            Err(Problem { what, remedy }) => {
                refused += 1;
                assert!(!what.is_empty() && !remedy.is_empty());
            }
        }
    }
    println!("{read_anyway} of 6000 damaged files were read, {refused} refused");
    assert!(read_anyway > 100 && refused > 2000);
}

/// The largest that is read, and the worst that we know of for each step. The bound is not the time that they take, which is
/// printed, but one that nothing quadratic stays below.
#[test]
fn the_largest_files_are_read_in_time() {
    let ball = {
        // 98,304 triangles twice over: more than an icosphere of 81,920.
        let (vertices, triangles) = grid_box([0.1; 3], 129);
        let round = vertices.iter().map(|v| v.normalize() * 0.05).collect();
        (round, triangles)
    };
    assert!(ball.1.len() > 199_000 && ball.1.len() <= limits::MAX_TRIANGLES);
    let noisy = {
        let mut numbers = Numbers(61);
        let (vertices, triangles) = grid_box([0.1; 3], 129);
        (vertices.iter().map(|v| v + numbers.vector() * 1e-4).collect::<Vec<_>>(), triangles)
    };
    // Every triangle for itself, all vertices within one cube of the weld's grid, or all on one line.
    let heap: Mesh = {
        let mut numbers = Numbers(62);
        let vertices = (0..600_000).map(|_| numbers.vector() * 0.05).collect();
        (vertices, (0..200_000).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect())
    };
    let near: Mesh = {
        let mut numbers = Numbers(63);
        let vertices =
            (0..600_000).map(|k| if k == 0 { Vector3::x() } else { numbers.vector() * 2e-6 }).collect();
        (vertices, heap.1.clone())
    };
    let fan: Mesh = {
        // A cone over 99,999 corners: one vertex in half of the triangles, and a flat bottom with as many.
        let count = 99_999;
        let mut vertices: Vec<Vector3<f64>> = (0..count)
            .map(|k| {
                let angle = f64::from(k) / f64::from(count) * std::f64::consts::TAU;
                let (sine, cosine) = blindgrasp_shared::math::Real::sine_cosine(angle);
                Vector3::new(cosine, sine, 0.0) * 0.05
            })
            .collect();
        vertices.extend([Vector3::z() * 0.05, Vector3::zeros()]);
        let count = count as usize;
        let triangles =
            (0..count).flat_map(|k| [[k, (k + 1) % count, count], [(k + 1) % count, k, count + 1]]).collect();
        (vertices, triangles)
    };
    for (name, mesh) in [("ball", ball), ("noisy box", noisy), ("heap", heap), ("near", near), ("fan", fan)] {
        for (format, bytes) in
            [("b.stl", binary(&mesh)), ("a.stl", ascii(&mesh)), ("o.obj", wavefront(&mesh))]
        {
            let start = Instant::now();
            let read = read(format, &bytes);
            let reading = start.elapsed().as_secs_f64();
            let outcome = match &read {
                Ok(repaired) => match faces(repaired) {
                    Ok(body) => format!("{} faces", body.faces.len()),
                    Err(error) => error.to_string(),
                },
                Err(problem) => problem.what.clone(),
            };
            let whole = start.elapsed().as_secs_f64();
            println!(
                "{name}, {format}, {} MiB: {reading:.2} s, {whole:.2} s in all: {outcome}",
                bytes.len() >> 20
            );
            assert!(whole < SLOWEST_S, "{name} {format}: {whole} s");
        }
    }
    // Polygons that wind: what is worst for cutting them.
    let mut comb = String::new();
    for k in 0..1000 {
        comb += &format!("v {} {} 0\n", k / 2, if k % 2 == 0 { 0.0 } else { 1000.0 - f64::from(k) });
    }
    comb += &("f".to_owned() + &(1..=1000).map(|k| format!(" {k}")).collect::<String>() + "\n").repeat(200);
    let start = Instant::now();
    let outcome = read("c.obj", comb.as_bytes()).expect_err("it is not a body").what;
    println!("comb: {:.2} s: {outcome}", start.elapsed().as_secs_f64());
    assert!(start.elapsed().as_secs_f64() < SLOWEST_S);
}
