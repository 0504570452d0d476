//! The paper's title: an *arbitrary* polyhedral object. Random polyhedra, and meshes with noise, placed in the paper's hand and
//! grasped in the paper's own model for 5 s, with `u_st` and without.

use blindgrasp::scene::ObjectFile;
use blindgrasp_tests::polyhedra::{EXTENT_M, FACES, RandomPolyhedron, noisy_stl, polyhedron};
use blindgrasp_tests::random::Draw;
use blindgrasp_tests::study::{DENSITY_KG_M3, Outcome, Specimen, Study, simulate, spread};
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

/// So many objects, with numbers of faces that take turns.
fn random(draw: &mut Draw, count: usize) -> Vec<RandomPolyhedron> {
    FACES.cycle_over(count).map(|faces| polyhedron(draw, faces)).collect()
}

trait Cycle {
    fn cycle_over(self, count: usize) -> impl Iterator<Item = usize>;
}

impl Cycle for std::ops::RangeInclusive<usize> {
    /// Its numbers in turn.
    fn cycle_over(self, count: usize) -> impl Iterator<Item = usize> {
        self.cycle().take(count)
    }
}

fn hulls(study: &Study, bodies: &[RandomPolyhedron]) -> Vec<Specimen> {
    let specimen = |body: &RandomPolyhedron| Specimen {
        object: study.hull(body.corners_m.clone()),
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
    let all = outcomes.len();
    let share = |of: usize| 100.0 * of as f64 / all.max(1) as f64;
    let count =
        |test: &dyn Fn(&Outcome) -> bool| outcomes.iter().filter(|(_, outcome)| test(outcome)).count();
    let held = |outcome: &Outcome| outcome.runs.as_ref().is_some_and(|(with, _)| with.grasp_held);
    let held_without =
        |outcome: &Outcome| outcome.runs.as_ref().is_some_and(|(_, without)| without.grasp_held);
    let mut settled: Vec<f64> = outcomes
        .iter()
        .filter_map(|(_, outcome)| outcome.runs.as_ref().and_then(|(with, _)| with.settle_time_s))
        .collect();
    settled.sort_by(f64::total_cmp);
    let median = settled.get(settled.len() / 2).map_or("-".to_owned(), |t| format!("{t:.2}"));
    let placed = count(&|outcome| outcome.placed.is_ok());
    let chances =
        outcomes.iter().filter_map(|(_, outcome)| outcome.placed.as_ref().ok()).map(|p| p.quality.chance);
    let _ = writeln!(
        text,
        "{name:<22}{all:>6}{:>9.1}{:>9.1}{:>9.1}{:>9.1}{:>10.1}{:>10.1}{median:>9}",
        share(placed),
        100.0 * chances.sum::<f64>() / all.max(1) as f64,
        share(count(&held)),
        share(count(&held_without)),
        share(count(&|outcome| held_without(outcome) && !held(outcome))),
        share(settled.len()),
    );
}

/// The table that the README quotes, and what went wrong.
fn table(hulls: &[(Specimen, Outcome)], meshes: &[(Specimen, Outcome)]) -> String {
    let all: Vec<(&Specimen, &Outcome)> = hulls.iter().map(|(s, o)| (s, o)).collect();
    let mut text = format!(
        "{:<22}{:>6}{:>9}{:>9}{:>9}{:>9}{:>10}{:>10}{:>9}\n",
        "share in %", "count", "placed", "expected", "held", "without", "only w/o", "at rest", "at s"
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
                let first = why.lines().next().unwrap_or_default();
                let words =
                    first.split(|c: char| c.is_ascii_digit() || "`:,;".contains(c)).next().unwrap_or(first);
                reason(format!("not placed: {}", words.trim()));
            }
            (Ok(_), Some((with, _))) => {
                if let Some(why) = &with.lost_reason {
                    reason(format!(
                        "lost: {}",
                        why.trim_start_matches(|c: char| !c.is_whitespace())
                            .trim_start()
                            .trim_start_matches(|c: char| c.is_ascii_digit())
                            .trim_start()
                    ));
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
    let mut draw = Draw::new(17);
    let hulls = hulls(&study, &random(&mut draw, count));
    let bodies = random(&mut draw, mesh_count);
    let meshes = meshes(&mut draw, &bodies);
    let run = |specimens: Vec<Specimen>| {
        let outcomes = study.run_all(&specimens);
        specimens.into_iter().zip(outcomes).collect::<Vec<_>>()
    };
    let (hulls, meshes) = (run(hulls), run(meshes));
    for (s, o) in &meshes {
        eprintln!(s.faces, s.extent_m, o.placed.as_ref().map(|p| p.quality.chance));
    }
    for (s, o) in &hulls {
        if let Err(e) = &o.placed {}
    }
    println!(
        "objects of styrene foam, rotated anywhere, in the paper's hand and model for 5 s (gains of Table VII):"
    );
    println!("{}", table(&hulls, &meshes));
    assert_eq!((hulls.len(), meshes.len()), (count, mesh_count));
    hulls.into_iter().chain(meshes).collect()
}

/// Nothing panics, nothing is not a number; and what the paper claims, in its weakest form: `u_st` is there to hold what the
/// normal forces alone do not.
fn check(outcomes: &[(Specimen, Outcome)]) {
    let held = |which: fn(&Outcome) -> bool| outcomes.iter().filter(|(_, outcome)| which(outcome)).count();
    let with = held(|outcome| outcome.runs.as_ref().is_some_and(|(with, _)| with.grasp_held));
    let without = held(|outcome| outcome.runs.as_ref().is_some_and(|(_, without)| without.grasp_held));
    assert!(with > without, "{with} with u_st, {without} without");
}

#[test]
fn random_polyhedra_are_grasped() {
    check(&study(95, 5));
}

/// The whole table: `cargo test --release -p blindgrasp-tests --test polyhedra whole -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes; prints the table of the README"]
fn the_whole_table() {
    check(&study(1000, 50));
}

/// What the terms of the quality say about the outcome: of placements that are not all the best.
/// `cargo test --release -p blindgrasp-tests --test polyhedra terms -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes; prints the evidence for the ranking"]
fn terms_of_the_quality_predict_the_outcome() {
    let study = Study::default();
    let mut draw = Draw::new(21);
    let picks: Vec<(RandomPolyhedron, f64)> =
        random(&mut draw, 400).into_iter().map(|body| (body, draw.within(0.0, 1.0))).collect();
    let runs = spread(&picks, |(body, pick)| {
        let all = study.place(study.hull(body.corners_m.clone()), 40).ok()?;
        let placement = &all[((all.len() as f64 * pick) as usize).min(all.len() - 1)];
        Some((placement.quality.clone(), simulate(&placement.scene).grasp_held))
    });
    let runs: Vec<_> = runs.into_iter().flatten().collect();
    let held = runs.iter().filter(|(_, held)| *held).count();
    println!("{} placements, one of up to 40 of each object; {held} held", runs.len());
    type Term = (&'static str, fn(&blindgrasp::placement::Quality) -> f64);
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
fn area(
    runs: &[(blindgrasp::placement::Quality, bool)],
    term: fn(&blindgrasp::placement::Quality) -> f64,
) -> f64 {
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
