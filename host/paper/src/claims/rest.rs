//! Contacts stay, and everything comes to rest (assumptions 2 and 3, Eqs. 50 and 58, Figs. 7 and 12).

use super::{largest, lost, row, runs};
use crate::claim::{Claim, Figure, Row, Verdict, number, percent};
use crate::evidence::{Done, Evidence, EvidenceError};
use blindgrasp_sim::sample::Sample;
use blindgrasp_sim::summary::at_rest;

/// Time for which everything has to have been at rest in between, s, for a run that is not at its end to count as
/// explained.
const RESTED_S: f64 = 5.0;
/// Part of their peak that speeds have to have fallen to, to count as falling.
const FALLEN: f64 = 0.05;
/// Time for which the transient is watched, s.
const TRANSIENT_S: f64 = 20.0;

pub(super) fn contact(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let names = ["hand-arm", "hand-arm-consistent", "hand-arm-continuous", "hand-arm-stiff", "prism", "cube"];
    Ok(Claim {
        key: "contact",
        words: "Fingertips neither slip off nor leave the surfaces that they touch",
        place: "Sec. 2, assumptions 2 and 3; Sec. 5",
        criterion: "every indentation is positive, and every contact within its face, to the end of the run",
        tolerance: "None: it is what the model stands on. The simulation ends where it fails.",
        rows: runs(evidence, &names)?.into_iter().map(contact_row).collect(),
    })
}

pub(super) fn contact_row(done: &Done) -> Row {
    let samples = &done.run.samples;
    let least_m = samples
        .iter()
        .flat_map(|sample| &sample.contacts)
        .map(|contact| contact.indentation_m)
        .fold(f64::INFINITY, |least, value| if value < least || value.is_nan() { value } else { least });
    let held = done.summary().grasp_held && least_m > 0.0;
    let length = done.summary().duration_s;
    let mut row = match lost(done) {
        Some(words) => row(done, words, Verdict::NotReproduced),
        None => row(
            done,
            format!("kept for {length:.0} s; least indentation {} mm", number(1e3 * least_m)),
            Verdict::holds(held),
        ),
    };
    if !held && done.name.starts_with("hand-arm") {
        let k_st = done.scene.control.attitude_stiffness_nm();
        row.remark = format!(
            "K_st = {} N m is small against what rolls the fingertips (tangential force times radius, about 0.4 N m): the \
             grasp creeps, held back by the torsional viscosity of the fingertips alone, until it snaps through",
            number(k_st)
        );
    }
    row.figures = vec![Figure::new("least_indentation", least_m, "m"), Figure::new("held_for", length, "s")];
    row
}

pub(super) fn rest(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let names = [
        "prism",
        "cube",
        "prism-continuous",
        "cube-continuous",
        "prism-ideal-minute",
        "cube-ideal",
        "hand-arm",
        "hand-arm-continuous",
        "hand-arm-consistent",
        "hand-arm-stiff",
    ];
    Ok(Claim {
        key: "rest",
        words: "All velocities of hand and object converge to zero",
        place: "Eq. 58, Figs. 7 and 12",
        criterion: "from some time on to the end of the run every joint is slower than 1e-3 rad/s, the object than 1e-4 m/s \
                    and 1e-3 rad/s",
        tolerance: "At these speeds a joint takes a quarter of an hour for a radian; the peaks are a thousand times as high.",
        rows: runs(evidence, &names)?.into_iter().map(rest_row).collect(),
    })
}

pub(super) fn rest_row(done: &Done) -> Row {
    let samples = &done.run.samples;
    let (summary, peak) = (done.summary(), peak(samples));
    let last = summary.last.joint_speed_max_rad_s;
    let calmest = samples
        .iter()
        .filter(|sample| sample.t_s >= 1.0)
        .map(|sample| (fastest(sample), sample.t_s))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or((f64::NAN, f64::NAN));
    let (rested_s, rested_to_s) = longest_rest(samples);
    let falling = summary.grasp_held && last < FALLEN * peak;
    let (measured, verdict, remark) = match (summary.settle_time_s, lost(done)) {
        (Some(t_s), _) => (
            format!("at rest from {t_s:.2} s on; peak {} rad/s", number(peak)),
            Verdict::Reproduced,
            String::new(),
        ),
        (None, Some(words)) => (
            format!(
                "peak {} rad/s, slowest {} rad/s at {:.1} s; {words}",
                number(peak),
                number(calmest.0),
                calmest.1
            ),
            Verdict::NotReproduced,
            "speeds fall at first, but the fingertips leave their faces before anything has come to rest"
                .to_owned(),
        ),
        (None, None) if rested_s >= RESTED_S => (
            format!("at rest for {rested_s:.1} s, then swings up to {} rad/s", number(last)),
            Verdict::Differs,
            format!(
                "torques that are held for a millisecond feed energy in, and without friction the gains of Table VII take \
                 less out: it leaves its rest at {rested_to_s:.0} s. With the law at 10 kHz it stays"
            ),
        ),
        (None, None) => (
            format!("peak {} rad/s, {} rad/s after {:.0} s", number(peak), number(last), summary.duration_s),
            Verdict::of(false, falling),
            if falling {
                format!("still falling at the end of the run: {} of the peak is left", percent(last / peak))
            } else {
                "it does not come to rest".to_owned()
            },
        ),
    };
    let mut row = row(done, measured, verdict);
    row.remark = remark;
    row.figures = vec![
        Figure::new("peak_joint_speed", peak, "rad/s"),
        Figure::new("last_joint_speed", last, "rad/s"),
        Figure::new("calmest_joint_speed", calmest.0, "rad/s"),
    ];
    row.figures.extend(summary.settle_time_s.map(|t_s| Figure::new("at_rest_from", t_s, "s")));
    row.figures.extend(summary.lost_at_s.map(|t_s| Figure::new("lost_at", t_s, "s")));
    row
}

pub(super) fn transient(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let names = ["hand-arm", "hand-arm-consistent", "hand-arm-stiff"];
    Ok(Claim {
        key: "transient",
        words: "In the simulation the velocities fall (the transient that Fig. 7 shows)",
        place: "Sec. 5, Fig. 7",
        criterion: "the largest speeds of the joints, of the object and of its rotation are lower in each quarter of the first 20 s \
                    than in the quarter before",
        tolerance: "None: falling is falling. The time axis of the figure is not in the text; after 20 s the object has swung a \
                    dozen times.",
        rows: runs(evidence, &names)?.into_iter().map(transient_row).collect(),
    })
}

pub(super) fn transient_row(done: &Done) -> Row {
    let samples = &done.run.samples;
    type Quantity = fn(&Sample) -> f64;
    let quantities: [(&str, Quantity); 3] = [
        ("joints", fastest),
        ("object", |sample| sample.velocity_m_s.norm()),
        ("rotation", |sample| sample.spin_rad_s.norm()),
    ];
    let quarter = |k: usize, of: Quantity| {
        let (from_s, to_s) = (TRANSIENT_S * k as f64 / 4.0, TRANSIENT_S * (k + 1) as f64 / 4.0);
        largest(samples.iter().filter(|s| s.t_s >= from_s && s.t_s < to_s).map(of))
    };
    let peaks = quantities.map(|(_, of)| [0, 1, 2, 3].map(|k| quarter(k, of)));
    let reached = samples.last().is_some_and(|sample| sample.t_s >= TRANSIENT_S);
    let fallen = reached && peaks.iter().all(|peaks| peaks.windows(2).all(|pair| pair[1] < pair[0]));
    let shares = peaks.map(|peaks| peaks[3] / peaks[0]);
    let words: Vec<String> = quantities
        .iter()
        .zip(shares)
        .map(|((name, _), share)| format!("{name} {}", percent(share)))
        .collect();
    let words = format!("in the last quarter, of the peak in the first: {}", words.join(", "));
    let mut row = row(done, words, Verdict::holds(fallen));
    row.figures = vec![
        Figure::new("joints_left", shares[0], ""),
        Figure::new("object_left", shares[1], ""),
        Figure::new("rotation_left", shares[2], ""),
    ];
    row
}

fn fastest(sample: &Sample) -> f64 {
    largest(sample.speeds_rad_s.iter().map(|speed| speed.abs()))
}

fn peak(samples: &[Sample]) -> f64 {
    largest(samples.iter().map(fastest))
}

/// The longest time at rest, and when it ended, s.
fn longest_rest(samples: &[Sample]) -> (f64, f64) {
    let (mut longest, mut since): ((f64, f64), Option<f64>) = ((0.0, 0.0), None);
    // The run begins at rest, which counts for nothing.
    for sample in samples.iter().skip_while(|sample| at_rest(sample)) {
        since = at_rest(sample).then(|| since.unwrap_or(sample.t_s));
        if let Some(rested_s) = since.map(|since| sample.t_s - since).filter(|rested_s| *rested_s > longest.0)
        {
            longest = (rested_s, sample.t_s);
        }
    }
    longest
}
