//! The paper's title: an *arbitrary* polyhedral object. Random polyhedra, and meshes with noise, placed in the paper's hand and
//! grasped in the paper's own model for 5 s, with `u_st` and without.

use blindgrasp::model::file::{CapsuleFile, FingertipFile};
use blindgrasp::model::{HandFile, ObjectFile, Parts};
use blindgrasp::place::population::{
    DENSITY_KG_M3, Draw, EXTENT_M, RandomPolyhedron, SEED, polyhedra, polyhedron,
};
use blindgrasp::place::{Reach, Request, place, template};
use blindgrasp_shared::math::Real;
use blindgrasp_tests::cases::K_I_NM_RAD;
use blindgrasp_tests::noise::noisy_stl;
use blindgrasp_tests::study::{Outcome, Runs, Specimen, Study, simulate, spread};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;

fn hulls(study: &Study, bodies: &[RandomPolyhedron]) -> Vec<Specimen> {
    let specimen = |body: &RandomPolyhedron| Specimen {
        object: study.hand.hull(body.corners_m.clone()),
        faces: body.faces,
        extent_m: body.extent_m,
    };
    bodies.iter().map(specimen).collect()
}

/// A folder that goes with the test.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Meshes with noise, read as a user's are.
fn meshes(draw: &mut Draw, bodies: &[RandomPolyhedron]) -> Vec<Specimen> {
    let folder = Folder(std::env::temp_dir().join(format!("blindgrasp-meshes-{}", std::process::id())));
    fs::create_dir_all(&folder.0).expect("a folder");
    let text = format!(
        "schema = 1\nname = \"mesh\"\ndensity_kg_m3 = {DENSITY_KG_M3:?}\n[shape.mesh]\nfile = \"noise.stl\"\nunit = \"mm\"\n"
    );
    let specimen = |body: &RandomPolyhedron| {
        fs::write(folder.0.join("noise.stl"), noisy_stl(draw, body)).expect("a file");
        let object =
            ObjectFile::parse(&text, "mesh.toml", &folder.0).unwrap_or_else(|error| panic!("{error}"));
        let shape = object.body(&mut Vec::new()).unwrap_or_else(|error| panic!("{error}")).shape;
        Specimen { object, faces: shape.faces.len(), extent_m: body.extent_m }
    };
    bodies.iter().map(specimen).collect()
}

/// One line of the table.
fn line(text: &mut String, name: &str, outcomes: &[(&Specimen, &Outcome)]) {
    let all = outcomes.len().max(1) as f64;
    let runs: Vec<&Runs> = outcomes.iter().filter_map(|(_, outcome)| outcome.runs.as_ref()).collect();
    let share =
        |test: &dyn Fn(&Runs) -> bool| 100.0 * runs.iter().filter(|runs| test(runs)).count() as f64 / all;
    let placements = outcomes.iter().filter_map(|(_, outcome)| outcome.placed.as_ref().ok());
    let real = |runs: &Runs| runs.real.as_ref().is_some_and(|real| real.grasp_held);
    let mut settled: Vec<f64> =
        runs.iter().filter_map(|runs| runs.real.as_ref().and_then(|real| real.settle_time_s)).collect();
    settled.sort_by(f64::total_cmp);
    let median = settled.get(settled.len() / 2).map_or("-".to_owned(), |t| format!("{t:.2}"));
    let _ = writeln!(
        text,
        "{name:<20}{:>6}{:>8.1}{:>10.1}{:>7.1}{:>12.1}{:>9.1}{:>10.1}{:>9.1}  {:>7.1}{:>9.1}{median:>8}",
        outcomes.len(),
        100.0 * runs.len() as f64 / all,
        100.0 * placements.map(|placement| placement.quality.chance).sum::<f64>() / all,
        share(&|runs| runs.with.grasp_held),
        share(&|runs| runs.half_angle.grasp_held),
        share(&|runs| runs.without.grasp_held),
        share(&|runs| runs.without.grasp_held && !runs.with.grasp_held),
        share(&|runs| runs.with.settled),
        share(&real),
        100.0 * settled.len() as f64 / all,
    );
}

/// The table that the README quotes, and what went wrong.
fn table(hulls: &[(Specimen, Outcome)], meshes: &[(Specimen, Outcome)]) -> String {
    let all: Vec<(&Specimen, &Outcome)> = hulls.iter().map(|(s, o)| (s, o)).collect();
    let mut text = format!(
        "{:<20}{:>6}{:>8}{:>10}{:>7}{:>12}{:>9}{:>10}{:>9}  {:>7}{:>9}{:>8}\n",
        "share in %",
        "count",
        "placed",
        "expected",
        "held",
        "half-angle",
        "without",
        "only w/o",
        "at rest",
        "real",
        "at rest",
        "from s"
    );
    line(&mut text, "convex polyhedra", &all);
    for (low, high) in [(4, 6), (7, 10), (11, 15), (16, 20), (21, 30)] {
        let some: Vec<_> = all.iter().filter(|(s, _)| (low..=high).contains(&s.faces)).copied().collect();
        line(&mut text, &format!("  {low} to {high} faces"), &some);
    }
    let step = (EXTENT_M[1] / EXTENT_M[0]).powf(0.2);
    for class in 0..5 {
        let [low, high] = [class, class + 1].map(|k| EXTENT_M[0] * step.powi(k));
        let some: Vec<_> =
            all.iter().filter(|(s, _)| s.extent_m >= low && s.extent_m < high).copied().collect();
        line(&mut text, &format!("  {:.0} to {:.0} mm", low * 1e3, high * 1e3), &some);
    }
    let meshes: Vec<(&Specimen, &Outcome)> = meshes.iter().map(|(s, o)| (s, o)).collect();
    line(&mut text, "meshes with noise", &meshes);
    let both: Vec<_> = all.iter().chain(&meshes).map(|(_, outcome)| *outcome).collect();
    let mut reasons: Vec<(String, usize)> = Vec::new();
    let mut reason = |what: String| match reasons.iter_mut().find(|(known, _)| *known == what) {
        Some((_, count)) => *count += 1,
        None => reasons.push((what, 1)),
    };
    for outcome in &both {
        match (&outcome.placed, &outcome.runs) {
            (Err(why), _) => {
                let words = why.split([':', ';', '`', '\n']).next().unwrap_or_default();
                reason(format!("not placed: {}", words.trim()));
            }
            (Ok(_), Some(runs)) => {
                if let Some(why) = &runs.with.lost_reason {
                    let what =
                        why.split_once(|c: char| c.is_ascii_digit()).map_or(why.as_str(), |(_, what)| what);
                    reason(format!("lost: a finger {}", what.trim()));
                }
            }
            (Ok(_), None) => {}
        }
    }
    reasons.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
    for (what, count) in reasons {
        let _ = writeln!(text, "{count:>5}  {what}");
    }
    let mut searches: Vec<f64> = both.iter().map(|outcome| outcome.search_s).collect();
    searches.sort_by(f64::total_cmp);
    let at = |share: f64| 1e3 * searches[((searches.len() - 1) as f64 * share) as usize];
    let _ = writeln!(
        text,
        "search: median {:.0} ms, 95 % below {:.0} ms, longest {:.0} ms",
        at(0.5),
        at(0.95),
        at(1.0)
    );
    text
}

fn study(count: usize, mesh_count: usize) -> Vec<(Specimen, Outcome)> {
    let study = Study::default();
    let mut draw = Draw::new(SEED);
    let hulls = hulls(&study, &polyhedra(&mut draw, count));
    let bodies = polyhedra(&mut draw, mesh_count);
    let meshes = meshes(&mut draw, &bodies);
    let run = |specimens: Vec<Specimen>| {
        let outcomes = study.run_all(&specimens);
        specimens.into_iter().zip(outcomes).collect::<Vec<_>>()
    };
    let (hulls, meshes) = (run(hulls), run(meshes));
    println!(
        "objects of styrene foam, rotated anywhere, in the paper's hand for 5 s (gains of Table VII): in the paper's model, \
         and (`real`) with encoders, delay, limits and joint friction"
    );
    println!("{}", table(&hulls, &meshes));
    assert_eq!((hulls.len(), meshes.len()), (count, mesh_count));
    hulls.into_iter().chain(meshes).collect()
}

/// Nothing panics, nothing is not a number; and what the paper claims, in its weakest form: `u_st` is there to hold what the
/// normal forces alone do not.
fn check(outcomes: &[(Specimen, Outcome)]) {
    let held = |which: fn(&Runs) -> bool| {
        outcomes.iter().filter(|(_, outcome)| outcome.runs.as_ref().is_some_and(which)).count()
    };
    let (with, without) = (held(|runs| runs.with.grasp_held), held(|runs| runs.without.grasp_held));
    assert!(with > without, "{with} with u_st, {without} without");
}

#[test]
fn random_polyhedra_are_grasped() {
    check(&study(24, 2));
}

#[test]
#[ignore = "the large form, for tests/run all"]
fn at_large_random_polyhedra_are_grasped() {
    check(&study(95, 5));
}

/// The whole table: `cargo test --release -p blindgrasp-tests --test science polyhedra::whole -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes; prints the table of the README"]
fn the_whole_table() {
    check(&study(1000, 50));
}

/// With weight, friction and a table that goes away: what the paper leaves out.
fn with_weight(count: usize) {
    /// Of plastic with air in it, kg/m^3.
    const DENSITY: f64 = 100.0;
    let study = Study::default();
    let bodies = polyhedra(&mut Draw::new(SEED), count);
    let outcomes = spread(&bodies, |body| {
        let object = ObjectFile { density_kg_m3: Some(DENSITY), ..study.hand.hull(body.corners_m.clone()) };
        study.on_a_table(&object, K_I_NM_RAD)
    });
    let placed: Vec<_> = outcomes.iter().flatten().collect();
    println!(
        "{} of {count} placed; on a table that goes away, {DENSITY} kg/m^3, friction 0.6:",
        placed.len()
    );
    let mut held = [0; 4];
    for (law, name) in
        ["with u_st", "with u_st, half-angle", "without", "with the earlier law"].into_iter().enumerate()
    {
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        for summary in placed.iter().map(|runs| &runs[law]) {
            held[law] += usize::from(summary.grasp_held);
            let how = match (&summary.lost_reason, &summary.fault) {
                (_, Some(fault)) => format!("fault: {}", fault.split(": ").last().unwrap_or_default()),
                (Some(reason), None) => format!("lost: {reason}"),
                (None, None) => format!("{:?}", summary.outcome).to_lowercase(),
            };
            *counts.entry(how).or_default() += 1;
        }
        println!("{name}: in the hand {:.1} % of all", 100.0 * held[law] as f64 / count as f64);
        counts.iter().for_each(|(how, number)| println!("{number:>5}  {how}"));
    }
    // What `u_st` is needed for in the paper's model the friction of joints and contacts does here too.
    assert!(held.iter().all(|held| 2 * held > count), "{held:?}");
}

#[test]
fn random_polyhedra_with_weight_are_grasped_on_a_table() {
    with_weight(20);
}

#[test]
#[ignore = "takes minutes: tests/run studies"]
fn the_whole_table_with_weight() {
    with_weight(1000);
}

/// So many fingers of the paper's hand, evenly around the palm.
fn ring(fingers: usize) -> HandFile {
    let paper = HandFile::load("three-finger").expect("built in");
    let (first, tip) = (&paper.joints[..4], &paper.fingertips[0]);
    let mut hand = HandFile {
        joints: Vec::new(),
        fingertips: Vec::new(),
        capsules: Vec::new(),
        postures: Vec::new(),
        ..paper.clone()
    };
    let of_first = |capsule: &&CapsuleFile| {
        let is_below_it = capsule.to_m[1] == first[0].offset_m[1];
        capsule.link.as_ref().map_or(is_below_it, |link| link.starts_with("finger-1"))
    };
    for finger in 1..=fingers {
        let named = |name: &str| name.replace("finger-1", &format!("finger-{finger}"));
        let turn = (finger - 1) as f64 * std::f64::consts::TAU / fingers as f64;
        let (sine, cosine) = turn.sine_cosine();
        // The first finger stands at -90 degrees.
        let base_m = [0.035 * sine, -0.035 * cosine, 0.0];
        for joint in first {
            let mut joint = joint.clone();
            joint.name = named(&joint.name);
            joint.parent = joint.parent.as_deref().map(named);
            if joint.parent.is_none() {
                joint.offset_m = base_m;
                joint.rotation_rpy_rad[2] += turn;
            }
            hand.joints.push(joint);
        }
        hand.fingertips.push(FingertipFile { name: named(&tip.name), link: named(&tip.link), ..tip.clone() });
        hand.capsules.extend(paper.capsules.iter().filter(of_first).map(|capsule| match &capsule.link {
            Some(link) => CapsuleFile { link: Some(named(link)), ..capsule.clone() },
            None => CapsuleFile { to_m: base_m, ..capsule.clone() },
        }));
    }
    hand
}

/// Up to five fingers, thirty faces: how long the search takes. Prints it; what is found is sound.
#[test]
fn thirty_faces_are_searched_for_two_to_five_fingers() {
    let mut draw = Draw::new(5);
    let mut body = polyhedron(&mut draw, 30);
    let scale = 0.07 / body.extent_m;
    body.corners_m.iter_mut().flatten().for_each(|v| *v *= scale);
    let object = Study::default().hand.hull(body.corners_m);
    for fingers in 2..=5 {
        let like = template(ring(fingers), object.clone(), true).expect("a hand with gains");
        let parts = Parts::of(&like).expect("a hand");
        let begun = Instant::now();
        let reach = Reach::of_scene(&like, &parts).expect("no trunk");
        let mapped_s = begun.elapsed().as_secs_f64();
        let request =
            Request { like: &like, parts: &parts, reach: &reach, any_position: true, any_attitude: false };
        let begun = Instant::now();
        let placed = place(&request, 1);
        let searched_s = begun.elapsed().as_secs_f64();
        let chance = placed.as_ref().map(|placed| placed[0].quality.chance);
        println!(
            "{fingers} fingers, 30 faces: map of the reach {mapped_s:.2} s, search {searched_s:.2} s, chance {:.3}",
            chance.unwrap_or(0.0)
        );
        let placed = placed.unwrap_or_else(|none| panic!("{fingers} fingers: {none}"));
        assert!(placed[0].quality.fingertips.len() == fingers && placed[0].quality.room_rad > 0.0);
    }
}

/// The terms of the quality against the outcome: of placements that are not all the best. `cargo test --release -p
/// blindgrasp-tests --test science polyhedra::terms -- --ignored --nocapture`
#[test]
#[ignore = "takes a minute; prints the evidence for the ranking"]
fn terms_of_the_quality_predict_the_outcome() {
    let study = Study::default();
    let mut draw = Draw::new(21);
    let picks: Vec<(RandomPolyhedron, f64)> =
        polyhedra(&mut draw, 300).into_iter().map(|body| (body, draw.within(0.0, 1.0))).collect();
    let runs = spread(&picks, |(body, pick)| {
        let all = study.hand.place(study.hand.hull(body.corners_m.clone()), 12).ok()?;
        let placement = &all[((all.len() as f64 * pick) as usize).min(all.len() - 1)];
        Some((placement.quality.clone(), simulate(&placement.scene).grasp_held))
    });
    let runs: Vec<_> = runs.into_iter().flatten().collect();
    let held = runs.iter().filter(|(_, held)| *held).count();
    println!("{} placements, one of up to 12 of each object; {held} held", runs.len());
    type Term = (&'static str, fn(&blindgrasp::place::Quality) -> f64);
    let terms: [Term; 8] = [
        ("chance", |q| q.chance),
        ("mean square turn", |q| -q.fingertips.iter().map(|tip| tip.turn_rad * tip.turn_rad).sum::<f64>()),
        ("largest friction", |q| -q.fingertips.iter().map(|tip| tip.friction).fold(0.0, f64::max)),
        ("unbalanced moment", |q| -q.unbalanced_moment_nm),
        ("least margin over roll", |q| {
            q.fingertips.iter().map(|tip| tip.margin_m / (tip.rolled_m + 5e-4)).fold(f64::INFINITY, f64::min)
        }),
        ("least margin", |q| q.fingertips.iter().map(|tip| tip.margin_m).fold(f64::INFINITY, f64::min)),
        ("room of the joints", |q| q.room_rad),
        ("least conditioning", |q| {
            q.fingertips.iter().map(|tip| tip.conditioning).fold(f64::INFINITY, f64::min)
        }),
    ];
    for (name, term) in terms {
        println!("  {name:<24} area under the ROC curve {:.3}", area(&runs, term));
    }
    assert!(area(&runs, |q| q.chance) > 0.8);
}

/// The probability that a placement that held has more of something than one that was lost.
fn area(runs: &[(blindgrasp::place::Quality, bool)], term: fn(&blindgrasp::place::Quality) -> f64) -> f64 {
    let (mut wins, mut pairs) = (0.0, 0.0);
    for (held, _) in runs.iter().filter(|(_, held)| *held) {
        for (lost, _) in runs.iter().filter(|(_, held)| !held) {
            let (a, b) = (term(held), term(lost));
            wins += if a > b {
                1.0
            } else if a == b {
                0.5
            } else {
                0.0
            };
            pairs += 1.0;
        }
    }
    wins / pairs
}
