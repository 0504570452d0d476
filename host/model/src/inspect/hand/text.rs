//! A check for people: the tree, tables, and the findings.

use super::rules::length;
use super::{HandCheck, JointFacts, MeetingFacts};
use crate::one_line;
use std::fmt::Write as _;

/// All of it.
pub(super) fn describe(check: &HandCheck) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{}  {}", check.name, check.description);
    text += "\n";
    tree(check, &mut text);
    text += "\n";
    text += &joints(check);
    text += "\n";
    text += &fingertips(check);
    text += "\n";
    totals(check, &mut text);
    text += "\n";
    for line in check.findings.lines() {
        text = text + &line + "\n";
    }
    let _ = writeln!(text, "{}", check.findings.summary());
    // Names come from files, and may contain what would steer a terminal.
    text.lines().map(|line| one_line(line) + "\n").collect()
}

/// Writes the tree of joints.
fn tree(check: &HandCheck, text: &mut String) {
    text.push_str("base\n");
    branch(check, None, "", text);
}

fn branch(check: &HandCheck, joint: Option<usize>, indent: &str, text: &mut String) {
    // A parent that is not there, or comes later, is none.
    let parent = |k: usize| {
        let name = check.joints[k].parent.as_ref()?;
        check.joints[..k].iter().position(|joint| joint.name == *name)
    };
    let carried: Vec<usize> = (0..check.joints.len()).filter(|&k| parent(k) == joint).collect();
    let name = joint.map(|k| check.joints[k].name.as_str());
    let tips: Vec<_> = check.fingertips.iter().filter(|tip| Some(tip.link.as_str()) == name).collect();
    let capsules: Vec<_> = check.capsules.iter().filter(|capsule| capsule.link.as_deref() == name).collect();
    let count = carried.len() + tips.len() + capsules.len();
    let mut shown = 0;
    let mut line = |text: &mut String, words: String| {
        shown += 1;
        let (elbow, below) = if shown < count { ("├─ ", "│  ") } else { ("└─ ", "   ") };
        let _ = writeln!(text, "{indent}{elbow}{words}");
        below
    };
    for tip in tips {
        line(text, format!("fingertip {}, radius {}", tip.name, length(tip.radius_m)));
    }
    for capsule in capsules {
        let (length_m, radius_m) = (length(capsule.length_m), length(capsule.radius_m));
        line(text, format!("capsule {}, length {length_m}, radius {radius_m}", capsule.number));
    }
    for k in carried {
        let below = line(text, check.joints[k].name.clone());
        branch(check, Some(k), &format!("{indent}{below}"), text);
    }
}

fn joints(check: &HandCheck) -> String {
    let header =
        ["", "joint", "axis", "limits, rad", "nominal", "closing", "N m", "rad/s", "counts", "moves"];
    let row = |joint: &JointFacts| {
        let [lower, upper] = joint.limits_rad;
        vec![
            joint.number.to_string(),
            joint.name.clone(),
            joint.axis_in_base.map_or_else(|| "?".into(), axis),
            format!("{} .. {}", figures(lower), figures(upper)),
            figures(joint.nominal_rad),
            joint.closing.map_or_else(String::new, |closing| format!("{closing:+.2}")),
            figures(joint.torque_limit_nm),
            figures(joint.speed_limit_rad_s),
            figures(joint.encoder_counts_per_turn),
            moves(check, joint),
        ]
    };
    let rows = check.joints.iter().map(row).collect();
    table(&header, rows, "rllrrrrrrl")
        + "axis: in the base frame, all joints at zero; closing: +1 closes the hand at the nominal posture, -1 opens it\n"
}

fn moves(check: &HandCheck, joint: &JointFacts) -> String {
    match joint.moves.len() {
        0 => "?".into(),
        1 => joint.moves[0].clone(),
        count if count == check.fingertips.len() => "all (trunk)".into(),
        _ => format!("{} (trunk)", joint.moves.join(", ")),
    }
}

fn fingertips(check: &HandCheck) -> String {
    let header = [
        "",
        "fingertip",
        "joints",
        "from its finger, mm",
        "from the base, mm",
        "finger, g",
        "grasps with, N",
        "at least, N",
    ];
    let row = |i: usize| {
        let tip = &check.fingertips[i];
        let joints = match tip.shared_joints {
            0 => tip.own_joints.to_string(),
            shared => format!("{} + {shared}", tip.own_joints),
        };
        let mut row = vec![tip.number.to_string(), tip.name.clone(), joints];
        row.extend(match check.reach.get(i) {
            Some(reach) => [
                span(reach.from_finger_least_m, reach.from_finger_most_m, reach.finger_length_m),
                span(reach.from_base_least_m, reach.from_base_most_m, reach.bones_m),
            ],
            None => ["?".into(), "?".into()],
        });
        row.push(
            check.masses.as_ref().map_or_else(|| "?".into(), |masses| figures(masses.fingers_kg[i] * 1e3)),
        );
        row.push(match (&tip.limited_by, tip.grasping_force_n) {
            (Some(joint), Some(force)) => format!("{} ({joint})", figures(force)),
            _ => "-".into(),
        });
        row.push(tip.least_force_n.map_or_else(|| "-".into(), figures));
        row
    };
    let rows = (0..check.fingertips.len()).map(row).collect();
    table(&header, rows, "rlrllrlr")
        + "from .. to, and the sum of the bones; forces at the nominal posture: towards the others (limited by), in the weakest direction\n"
}

fn span(least: f64, most: f64, bones: f64) -> String {
    format!("{:.0} .. {:.0} of {:.0}", least * 1e3, most * 1e3, bones * 1e3)
}

fn totals(check: &HandCheck, text: &mut String) {
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<10}{value}");
    };
    if let Some(masses) = &check.masses {
        let fingers: f64 = masses.fingers_kg.iter().sum();
        let centre =
            masses.centre_m.map_or_else(String::new, |centre| format!("; centre at {}", point(&centre)));
        line(
            "mass",
            format!(
                "{} g: fingers {}, trunk {}{centre}",
                figures(masses.total_kg * 1e3),
                figures(fingers * 1e3),
                figures(masses.trunk_kg * 1e3)
            ),
        );
    }
    if check.masses.is_none() {
        line(
            "unknown",
            "reach, masses, forces and where the fingertips meet: correct the errors first".into(),
        );
    }
    if let Some(meeting) = &check.meeting {
        let everyone = check.fingertips.len();
        let who = |meeting: &MeetingFacts| match meeting.fingertips.len() {
            count if count == everyone => format!("all {everyone}"),
            _ => meeting.fingertips.join(", "),
        };
        let tell = |meeting: &MeetingFacts| {
            format!(
                "{} around a ball of {} radius at {}",
                who(meeting),
                length(meeting.ball_radius_m),
                point(&meeting.centre_m)
            )
        };
        match (&meeting.small, &meeting.all) {
            (Some(small), all) => {
                line("meeting", tell(small));
                if let Some(all) = all.as_ref().filter(|all| *all != small) {
                    line("", tell(all));
                }
            }
            (None, Some(all)) => line("meeting", tell(all)),
            (None, None) => line("meeting", "none".into()),
        }
    }
    for (k, posture) in check.postures.iter().enumerate() {
        let [nearest, farthest] = posture.from_middle_m.map(|m| m * 1e3);
        let (name, middle) = (&posture.name, point(&posture.middle_m));
        let words =
            format!("{name}: fingertips {nearest:.0} .. {farthest:.0} mm from their middle at {middle}");
        line(if k == 0 { "postures" } else { "" }, words);
    }
    if let Some(closing) = &check.closing {
        let words = format!(
            "presses with {} N, at most {} N as it meets something; `{}` moves from {} N on ({})",
            figures(closing.force_n),
            figures(closing.most_force_n),
            closing.stiffest,
            figures(closing.moving_force_n),
            closing.posture
        );
        line("closing", words);
        let (lag, width) = (length(closing.lag_m), length(2.0 * closing.least_half_width_m));
        line("", format!("is behind its reference by {lag} then: for objects of {width} and more"));
    }
}

/// Three digits or more.
fn figures(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if size < 1e-3 => format!("{value:.2e}"),
        size if size < 0.1 => format!("{value:.4}"),
        size if size < 10.0 => format!("{value:.2}"),
        size if size < 100.0 => format!("{value:.1}"),
        size if size < 1e7 => format!("{value:.0}"),
        _ => format!("{value:.2e}"),
    }
}

fn point(m: &[f64; 3]) -> String {
    // Without a negative zero.
    let [x, y, z] = m.map(|v| (v * 1e3).round() + 0.0);
    format!("({x}, {y}, {z}) mm")
}

/// A direction: the name of an axis where it is one.
fn axis(direction: [f64; 3]) -> String {
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        if direction[k].abs() > 1.0 - 1e-6 {
            return format!("{}{name}", if direction[k] > 0.0 { "+" } else { "-" });
        }
    }
    let [x, y, z] = direction.map(|v| (v * 100.0).round() / 100.0 + 0.0);
    format!("({x:.2}, {y:.2}, {z:.2})")
}

/// Columns as wide as their widest cell; `r` sets one to the right.
fn table(header: &[&str], rows: Vec<Vec<String>>, sides: &str) -> String {
    let all: Vec<Vec<String>> =
        std::iter::once(header.iter().map(|&word| word.to_owned()).collect()).chain(rows).collect();
    let width = |column: usize| all.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let mut text = String::new();
    for row in &all {
        let cells = row.iter().zip(&widths).zip(sides.chars()).map(|((cell, &width), side)| match side {
            'r' => format!("{cell:>width$}"),
            _ => format!("{cell:<width$}"),
        });
        let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join("  ").trim_end());
    }
    text
}
