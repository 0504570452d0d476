//! The paper's objections to the law before it (Secs. 1 and 3), whose `u_I` integrates each joint's velocity.

use super::largest;
use crate::claim::{Claim, Figure, Row, Verdict, number, percent};
use crate::earlier::{Carried, Comparison, Final};
use crate::laws::Law::{self, Attitudes, Integral};
use crate::laws::{Case, GAINS, Grasped};
use crate::polyhedra::Polyhedra;

/// Part by which a normal force may differ from Eq. 57 and still be foretold by it.
const FORETOLD: f64 = 1e-3;
/// Part of the largest torque on the fingers that an arm may feel and still be left alone.
const LEFT_ALONE: f64 = 1e-9;
/// Relative poses that differ by less are the same, m.
const SAME_M: f64 = 1e-4;

pub(super) fn row(run: &str, measured: String, verdict: Verdict) -> Row {
    Row { run: run.to_owned(), measured, figures: Vec::new(), verdict, remark: String::new() }
}

pub(super) fn effective(comparison: &Comparison, polyhedra: &Polyhedra) -> Claim {
    Claim {
        key: "earlier-effective",
        words: "The earlier law, with a time integral of each joint's velocity, is effective too, for any polyhedron",
        place: "Secs. 1 and 3, of refs. 14 and 15",
        criterion: "with every K_I of the table: the cube, which u_s alone loses, is held; and of the random polyhedra more than by u_s \
                    alone",
        tolerance: "None: held or lost, in the paper's model, with the law at 1 kHz; what is lost there is tried again at 10 kHz.",
        rows: vec![effective_on_the_cube(comparison), effective_on_polyhedra(polyhedra)],
    }
}

/// The earlier law with its gains.
fn earlier() -> [Case; 2] {
    GAINS.map(|gain| Case { law: Integral, gain })
}

pub(super) fn effective_on_the_cube(comparison: &Comparison) -> Row {
    let cube = comparison.objects.iter().find(|object| object.name == "cube");
    let held = |case| cube.and_then(|cube| cube.under(case)).map(Grasped::held);
    let words = |case: Case| {
        let outcome = match held(case) {
            Some(true) => "held",
            Some(false) => "lost",
            None => "not run",
        };
        format!("{outcome} by {}", case.words())
    };
    let all = [earlier()[0], earlier()[1], Case::NORMAL_ONLY];
    let holds =
        earlier().iter().all(|&case| held(case) == Some(true)) && held(Case::NORMAL_ONLY) == Some(false);
    row("cube", all.map(words).join("; "), Verdict::holds(holds))
}

pub(super) fn effective_on_polyhedra(polyhedra: &Polyhedra) -> Row {
    let all = [earlier()[0], earlier()[1], Case::NORMAL_ONLY];
    let words = all.map(|case| format!("{} by {}", words(polyhedra, case), case.words()));
    let without = polyhedra.held(Case::NORMAL_ONLY);
    let holds = earlier().iter().all(|&case| polyhedra.held(case) > without);
    row("polyhedra", words.join("; "), Verdict::holds(holds))
}

/// Returns the number of polyhedra that a law holds, in words.
fn words(polyhedra: &Polyhedra, case: Case) -> String {
    let (held, often) = (polyhedra.held(case), polyhedra.held_at_10_khz(case));
    let more = if often == held { String::new() } else { format!("; at 10 kHz {often}") };
    format!("{held} of {} ({}{more})", polyhedra.outcomes.len(), percent(polyhedra.share(held)))
}

pub(super) fn expanded(polyhedra: &Polyhedra) -> Claim {
    Claim {
        key: "earlier-expanded",
        words: "Compared with the earlier law, the shapes that can be grasped are expanded",
        place: "Sec. 1, advantage 1",
        criterion: "with the same number for both gains, u_s + u_st holds more of the random polyhedra than u_s + u_I",
        tolerance: "None. The paper prints no K_I; K_st = 0.005 N m is that of Table VII.",
        rows: GAINS.iter().map(|&gain| expanded_row(polyhedra, gain)).collect(),
    }
}

pub(super) fn expanded_row(polyhedra: &Polyhedra, gain: f64) -> Row {
    let [paper, earlier] = [Attitudes, Integral].map(|law| Case { law, gain });
    let only = |held: Case, lost: Case| {
        polyhedra.outcomes.iter().filter(|outcome| outcome.held(held) && !outcome.held(lost)).count()
    };
    let (attitudes, integral) = (polyhedra.held(paper), polyhedra.held(earlier));
    let measured = format!(
        "{} by u_s + u_st, {} by u_s + u_I; {} only by the first, {} only by the second",
        words(polyhedra, paper),
        words(polyhedra, earlier),
        only(paper, earlier),
        only(earlier, paper)
    );
    let mut row = row(&of_gain(gain), measured, Verdict::holds(attitudes > integral));
    row.figures = vec![
        Figure::new("held_by_u_st", polyhedra.share(attitudes), ""),
        Figure::new("held_by_u_i", polyhedra.share(integral), ""),
    ];
    row.remark =
        "more of either gain holds more, by either law: four times the gain does more than the change of law"
            .to_owned();
    row
}

/// The name of a row of both laws with one gain.
fn of_gain(gain: f64) -> String {
    format!("gain {gain}")
}

pub(super) fn force(comparison: &Comparison) -> Claim {
    Claim {
        key: "earlier-force",
        words: "The final force of the integral can't be told in advance; with u_st the normal forces are those of Eq. 57",
        place: "Sec. 1; Eqs. 55 to 57",
        criterion: "of the cube, pushed on different ways, over decades of the gains: with u_st every normal force comes to rest \
                    within 0.1 % of Eq. 57, with u_I one at least does not",
        tolerance: "0.1 %: near enough to rest is a fastest joint below 0.01 rad/s, whose damping of at most 4e-3 N m s/rad is \
                    1.3 mN at a fingertip 30 mm away, 0.05 % of the least normal force, 2.2 N.",
        rows: [Attitudes, Integral].map(|law| force_row(comparison, law)).to_vec(),
    }
}

/// The ways on which a law brought the grasp to rest, and how many there are in all.
fn at_rest(comparison: &Comparison, law: Law) -> (Vec<&Final>, usize) {
    let all = || comparison.paths.iter().filter(move |end| end.law == law);
    (all().filter(|end| end.rests()).collect(), all().count())
}

pub(super) fn force_row(comparison: &Comparison, law: Law) -> Row {
    let (ends, all) = at_rest(comparison, law);
    let off =
        |gain: f64| largest(ends.iter().filter(|end| end.gain == gain).map(|end| end.off_equation_57()));
    let worst = largest(ends.iter().map(|end| end.off_equation_57()));
    let (known, foretold) = (!ends.is_empty() && worst.is_finite(), worst < FORETOLD);
    let measured = format!(
        "at most {} off Eq. 57 where it came to rest, on {} of {all} ways and gains; at most {} with a gain of {}",
        percent(worst),
        ends.len(),
        percent(off(GAINS[1])),
        GAINS[1]
    );
    let mut row = row(law.words(), measured, Verdict::holds(known && foretold == (law == Attitudes)));
    row.figures = vec![Figure::new("largest_error", worst, "")];
    if law == Integral && !foretold {
        row.remark = "a spring at each joint presses a fingertip into its face as well as along it; but no joint turns far, because u_I \
                      holds it, and so it is little"
            .to_owned();
    }
    row
}

pub(super) fn pose(comparison: &Comparison) -> Claim {
    Claim {
        key: "earlier-pose",
        words: "The final pose can't be determined in advance with the earlier law, since the integral depends on the total movement \
                of each joint (the first problem)",
        place: "Sec. 3",
        criterion: "of the cube, pushed on different ways, with the same number for both gains: the final positions under \
                    u_s + u_I lie farther apart than those under u_s + u_st",
        tolerance: "0.1 mm, the size of what is left of the swing.",
        rows: GAINS.iter().map(|&gain| pose_row(comparison, gain)).collect(),
    }
}

/// The largest distance between two final positions, m, of those that came to rest with a gain; none with fewer than two.
fn spread_m(comparison: &Comparison, law: Law, gain: f64) -> Option<f64> {
    let ends: Vec<&Final> = comparison.ends(law, gain).filter(|end| end.rests()).collect();
    let apart = |a: &Final, b: &Final| {
        let squares = a.moved_m.iter().zip(&b.moved_m).map(|(a, b)| (a - b) * (a - b));
        blindgrasp_shared::math::Real::square_root(squares.sum::<f64>())
    };
    let pairs = ends.iter().enumerate().flat_map(|(k, a)| ends[..k].iter().map(move |b| apart(a, b)));
    (ends.len() > 1).then(|| largest(pairs))
}

pub(super) fn pose_row(comparison: &Comparison, gain: f64) -> Row {
    let spreads = [Attitudes, Integral].map(|law| spread_m(comparison, law, gain));
    let far = |law: Law| largest(comparison.ends(law, gain).filter(|end| end.rests()).map(Final::distance_m));
    let millimetres = |m: f64| format!("{} mm", number(1e3 * m));
    let words = |spread: Option<f64>| spread.map_or("not known how far".to_owned(), millimetres);
    let measured = format!(
        "final positions lie {} apart under u_s + u_st, and up to {} from the start; {} and {} under u_s + u_I",
        words(spreads[0]),
        millimetres(far(Attitudes)),
        words(spreads[1]),
        millimetres(far(Integral))
    );
    let holds = matches!(spreads, [Some(attitudes), Some(integral)] if integral > attitudes + SAME_M);
    let mut row = row(&of_gain(gain), measured, Verdict::holds(holds));
    row.figures = vec![
        Figure::new("spread_under_u_st", spreads[0].unwrap_or(f64::NAN), "m"),
        Figure::new("spread_under_u_i", spreads[1].unwrap_or(f64::NAN), "m"),
        Figure::new("farthest_under_u_st", far(Attitudes), "m"),
        Figure::new("farthest_under_u_i", far(Integral), "m"),
    ];
    if !holds {
        row.remark = "the integral of a joint's velocity is the joint's turn, whatever the way: u_I pulls every joint back to where it \
                      grasped, and with it the object. u_st knows of attitudes against each other only, and the fingers may carry them \
                      anywhere: it is the paper's own law whose final pose depends on the way"
            .to_owned();
    }
    row
}

pub(super) fn disturbs(comparison: &Comparison) -> Claim {
    Claim {
        key: "earlier-disturbs",
        words: "The integral disturbs whoever moves the object (the second problem); u_st does not",
        place: "Secs. 1 and 3; advantages 2 and 4",
        criterion: "of the hand-arm, whose object is pushed with 0.2 N for 3 s: what u_s + u_st puts on the arm's joints besides damping \
                    and weight stays below 1e-9 of what it puts on the fingers', and what u_s + u_I puts there does not",
        tolerance: "Rounding: 1e-16 over the some hundred operations of a chain of eight joints, whose levers are up to 2.5 m.",
        rows: comparison.arm.iter().map(disturbs_row).collect(),
    }
}

pub(super) fn disturbs_row(carried: &Carried) -> Row {
    let left_alone = carried.felt() < LEFT_ALONE;
    let milliradians = |rad: f64| number(1e3 * rad);
    let measured = format!(
        "up to {} N m on a joint of the arm, {} N m on one of the fingers; the arm had turned by {} mrad when the push ended, and by {} \
         mrad 15 s later{}",
        number(carried.arm_torque_nm),
        number(carried.finger_torque_nm),
        milliradians(carried.turned_by_push_rad),
        milliradians(carried.turned_at_end_rad),
        carried
            .lost
            .as_ref()
            .map_or(String::new(), |lost| format!("; LOST at {:.2} s: {}", lost.at_s, lost.why))
    );
    let holds = left_alone == (carried.law == Attitudes) && carried.arm_torque_nm.is_finite();
    let mut row = row(carried.law.words(), measured, Verdict::holds(holds));
    row.figures = vec![
        Figure::new("arm_torque", carried.arm_torque_nm, "N m"),
        Figure::new("finger_torque", carried.finger_torque_nm, "N m"),
        Figure::new("turned_by_push", carried.turned_by_push_rad, "rad"),
        Figure::new("turned_at_end", carried.turned_at_end_rad, "rad"),
    ];
    row
}
