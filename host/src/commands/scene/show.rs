//! Placements, and why there is none, as text and as JSON.

use blindgrasp::model::file::SceneFile;
use blindgrasp::place::{Placement, Refusal};
use blindgrasp::sim::summary::Summary;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// The best placement in full, and one line for each of the others.
pub(super) fn text(placements: &[Placement], outcome: &str) -> String {
    let mut text = String::new();
    if let Some(best) = placements.first() {
        describe(&mut text, best, outcome);
    }
    if placements.len() > 1 {
        let _ = write!(
            text,
            "\n  #  score  chance  room, rad  friction  turn, rad  margin, mm  position, mm              faces\n"
        );
        for (k, placement) in placements.iter().enumerate() {
            let quality = &placement.quality;
            let most = |value: fn(&blindgrasp::place::FingertipQuality) -> f64| {
                quality.fingertips.iter().map(value).fold(0.0, f64::max)
            };
            let margin_m = quality.fingertips.iter().map(|tip| tip.margin_m).fold(f64::INFINITY, f64::min);
            let [x, y, z] = <[f64; 3]>::from(placement.scene.start.position_m).map(|v| v * 1e3);
            let faces: Vec<String> =
                placement.scene.contacts.iter().map(|contact| contact.face.to_string()).collect();
            let _ = writeln!(
                text,
                "{:>3}  {:>5.3}  {:>6.3}  {:>9.2}  {:>8.2}  {:>9.2}  {:>10.1}  {x:>7.1} {y:>7.1} {z:>7.1}   {}",
                k + 1,
                quality.score,
                quality.chance,
                quality.room_rad,
                most(|tip| tip.friction),
                most(|tip| tip.turn_rad),
                margin_m * 1e3,
                faces.join(" "),
            );
        }
    }
    text
}

fn describe(text: &mut String, placement: &Placement, outcome: &str) {
    let (scene, quality) = (&placement.scene, &placement.quality);
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<22}{value}");
    };
    line("scene", format!("{}: {}", scene.name, scene.description));
    line("simulated", outcome.to_owned());
    line("score", format!("{:.3}", quality.score));
    line(
        "chance to hold",
        format!("{:.3}     (5 s in the paper's model, from where the law comes to rest)", quality.chance),
    );
    line(
        "room",
        format!(
            "{:.2} rad  (before an end stop, least at joint {})",
            quality.room_rad, quality.tightest_joint
        ),
    );
    line("unbalanced moment", format!("{:.4} N m", quality.unbalanced_moment_nm));
    let position = scene.start.position_m * 1e3;
    line("object at, mm", format!("{:.2} {:.2} {:.2}", position.x, position.y, position.z));
    let [roll, pitch, yaw] = <[f64; 3]>::from(scene.start.attitude.euler_angles()).map(f64::to_degrees);
    line("roll, pitch, yaw, deg", format!("{:.2} {:.2} {:.2}", roll + 0.0, pitch + 0.0, yaw + 0.0));
    let width = scene.file.hand.fingertips.iter().map(|tip| tip.name.len() + 2).fold(10, usize::max);
    let mut row = |name: &str, values: Vec<String>| {
        let cells = values.iter().fold(String::new(), |cells, value| cells + &format!("{value:>width$}"));
        let _ = writeln!(text, "{name:<22}{cells}");
    };
    let numbers = |values: &mut dyn Iterator<Item = f64>, digits: usize| -> Vec<String> {
        values.map(|value| format!("{:.digits$}", value + 0.0)).collect()
    };
    row("", scene.file.hand.fingertips.iter().map(|tip| tip.name.clone()).collect());
    row("face", scene.contacts.iter().map(|contact| contact.face.to_string()).collect());
    for (axis, name) in ["point x, mm", "      y, mm", "      z, mm"].into_iter().enumerate() {
        row(name, numbers(&mut scene.start.points_m.iter().map(|point| point[axis] * 1e3), 2));
    }
    let tips = &quality.fingertips;
    row("normal force, N", numbers(&mut tips.iter().map(|tip| tip.normal_force_n), 3));
    row("tangential force, N", numbers(&mut tips.iter().map(|tip| tip.tangential_force_n), 3));
    row("friction", numbers(&mut tips.iter().map(|tip| tip.friction), 3));
    row("turn, rad", numbers(&mut tips.iter().map(|tip| tip.turn_rad), 3));
    row("rolls, mm", numbers(&mut tips.iter().map(|tip| tip.rolled_m * 1e3), 2));
    row("from the edge, mm", numbers(&mut tips.iter().map(|tip| tip.margin_m * 1e3), 2));
    row("indentation, mm", numbers(&mut tips.iter().map(|tip| tip.indentation_m * 1e3), 3));
    row("  at the start, mm", numbers(&mut scene.start.indentations_m.iter().map(|dr| dr * 1e3), 3));
    row("conditioning", numbers(&mut tips.iter().map(|tip| tip.conditioning), 3));
}

/// All of it, for programs.
pub(super) fn json(
    placements: &[Placement],
    path: &Path,
    summary: &Summary,
    outcome: &str,
) -> anyhow::Result<String> {
    let all: Vec<Value> = placements
        .iter()
        .map(|placement| {
            let start = &placement.scene.start;
            let q = start.attitude.quaternion();
            let points: Vec<[f64; 3]> = start.points_m.iter().map(|point| (*point).into()).collect();
            json!({
                "faces": placement.scene.contacts.iter().map(|contact| contact.face).collect::<Vec<_>>(),
                "points_m": points,
                "position_m": <[f64; 3]>::from(start.position_m),
                "quaternion_wxyz": [q.w, q.i, q.j, q.k],
                "angles_rad": start.angles_rad,
                "indentations_m": start.indentations_m,
                "quality": placement.quality,
            })
        })
        .collect();
    let whole = json!({
        "placed": true,
        "scene": path.display().to_string(),
        "simulated": { "outcome": summary.outcome, "held": summary.grasp_held, "words": outcome },
        "placements": all,
    });
    Ok(serde_json::to_string(&whole)? + "\n")
}

/// Returns the words of a refusal.
pub(super) fn refusal(refusal: &Refusal, like: &SceneFile) -> String {
    format!("no placement of {} in {}: {refusal}\n", like.object.name, like.hand.name)
}

/// The same, for programs.
pub(super) fn refusal_json(refusal: &Refusal) -> anyhow::Result<String> {
    let whole = json!({ "placed": false, "reason": refusal.reason, "tests": refusal.tests });
    Ok(serde_json::to_string(&whole)? + "\n")
}
