//! The held object is moved, beside each law (Sec. 1, advantages 4 and 6).

use super::earlier::row;
use crate::claim::{Claim, Figure, Row, Verdict, number};
use crate::earlier::{Comparison, Moved, Off, SHARES, Stop};
use crate::laws::Law::{self, Attitudes, Integral, NormalOnly};

/// Distance and angle from what was asked for that count as nothing.
const THERE: Off = Off { way_m: 1e-4, turn_rad: 5e-3 };
/// The same of the object.
const NEAR: Off = Off { way_m: 1e-2, turn_rad: 2.5e-2 };
/// Part of the frame's moment that a joint of the arm may feel where it can do no more.
const UNFELT: f64 = 0.1;
/// Part of itself by which a torque may change that stays.
const UNCHANGED: f64 = 1e-6;
/// Difference of two shortfalls that are the same, as a part of them.
const SAME: f64 = 0.05;

impl Off {
    fn is_within(&self, tolerance: &Self) -> bool {
        self.way_m < tolerance.way_m && self.turn_rad < tolerance.turn_rad
    }

    fn words(&self) -> String {
        format!("{} mm and {} degrees", number(1e3 * self.way_m), number(self.turn_rad.to_degrees()))
    }

    fn figures(&self, [way, turn]: [&'static str; 2]) -> [Figure; 2] {
        [Figure::new(way, self.way_m, "m"), Figure::new(turn, self.turn_rad, "rad")]
    }
}

/// The end of a part of the way under a law.
fn stop<'a>(moved: &'a [Moved], run: &str, law: Law, share: f64) -> Option<(&'a Moved, &'a Stop)> {
    let moved = moved.iter().find(|moved| moved.run == run && moved.law == law)?;
    moved.stops.iter().find(|stop| stop.share == share).map(|stop| (moved, stop))
}

fn nothing(run: &str) -> Row {
    row(run, "lost, or not run".to_owned(), Verdict::NotReproduced)
}

pub(super) fn converges(comparison: &Comparison) -> Claim {
    let moved = &comparison.moved;
    let shares = SHARES.iter().map(|&share| share_row(moved, share));
    Claim {
        key: "manipulation",
        words: "With a position and attitude controller for the object beside it, the law does not disturb the motion, and the object \
                converges to what is asked for precisely; the earlier law's integral disturbs",
        place: "Sec. 1, advantages 2 and 4; ref. 17",
        criterion: "of the hand-arm, asked for parts of 200 mm and 30 degrees one after the other, 20 s each: under u_s + u_st the frame of the \
                    fingertips' centres is there, and nearer than under u_s + u_I; the torques of u_s + u_st stay when the arm alone moves, and \
                    those of u_I do not; the object is there too; and the same with fingers alone",
        tolerance: "0.1 mm and 5 mrad (0.3 degrees), a hundredth of the turn, which still creeps after 20 s; 10 mm and 25 mrad for the object, a twentieth of what is asked \
                    for; 1e-6 for torques that stay.",
        rows: shares.chain([torques_row(moved), object_row(moved), fingers_row(moved)]).collect(),
    }
}

/// The frame of the hand-arm after a part of the way.
pub(super) fn share_row(moved: &[Moved], share: f64) -> Row {
    let run = format!("hand-arm, {:.0} %", 100.0 * share);
    let stops = [Attitudes, Integral].map(|law| stop(moved, "hand-arm", law, share));
    let [Some((_, paper)), Some((_, earlier))] = stops else { return nothing(&run) };
    let is_there = paper.frame.is_within(&THERE);
    let is_nearer = paper.frame.turn_rad < earlier.frame.turn_rad;
    let explained = paper.frame.way_m < NEAR.way_m && paper.arm_pull_nm < UNFELT * paper.moment_nm;
    let measured = format!(
        "the frame is off by {} under u_s + u_st, by {} under u_s + u_I",
        paper.frame.words(),
        earlier.frame.words()
    );
    let mut row = row(&run, measured, Verdict::of(is_there && is_nearer, explained));
    row.figures.extend(paper.frame.figures(["way_off_under_u_st", "turn_off_under_u_st"]));
    row.figures.extend(earlier.frame.figures(["way_off_under_u_i", "turn_off_under_u_i"]));
    if !is_there {
        row.remark = format!(
            "an arm with five joints leaves one of six freedoms to the fingers, which creep: the error is where the arm can do nothing, for of the \
             frame's {} N m none of its joints feels more than {}",
            number(paper.moment_nm),
            number(paper.arm_pull_nm)
        );
    }
    row
}

/// The torques of the laws when the arm alone moves as it did.
pub(super) fn torques_row(moved: &[Moved]) -> Row {
    let run = "hand-arm, torques";
    let whole = [Attitudes, Integral].map(|law| stop(moved, "hand-arm", law, 1.0));
    let [Some((paper, _)), Some((earlier, _))] = whole else { return nothing(run) };
    let measured = format!(
        "the arm's motion changes u_s + u_st by {:.1e} of the largest torque, u_s + u_I by {:.1e}",
        paper.changed, earlier.changed
    );
    let holds = paper.changed < UNCHANGED && earlier.changed > UNCHANGED;
    let mut row = row(run, measured, Verdict::holds(holds));
    row.figures = vec![
        Figure::new("change_of_u_st", paper.changed, ""),
        Figure::new("change_of_u_i", earlier.changed, ""),
    ];
    row
}

/// The object in the hand-arm after the whole way.
pub(super) fn object_row(moved: &[Moved]) -> Row {
    let run = "hand-arm, object";
    let at = |law, share| stop(moved, "hand-arm", law, share);
    let all = [at(Attitudes, 0.0), at(Attitudes, 1.0), at(Integral, 1.0)];
    let [Some((_, before)), Some((paper, whole)), Some((_, earlier))] = all else { return nothing(run) };
    let measured = format!(
        "the object is off by {} under u_s + u_st ({} before it was moved), by {} under u_s + u_I",
        whole.object.words(),
        before.object.words(),
        earlier.object.words()
    );
    let precise = whole.object.is_within(&THERE);
    let explained = whole.object.is_within(&NEAR) && paper.rolled_m > whole.object.way_m;
    let mut row = row(run, measured, Verdict::of(precise, explained));
    row.figures.extend(whole.object.figures(["object_way_off_under_u_st", "object_turn_off_under_u_st"]));
    row.figures.extend(earlier.object.figures(["object_way_off_under_u_i", "object_turn_off_under_u_i"]));
    if !precise {
        row.remark = format!(
            "the hand knows its fingertips only, and these roll on the object, by up to {} mm since the grasp began",
            number(1e3 * paper.rolled_m)
        );
    }
    row
}

/// The frame of a hand without an arm after the whole way.
pub(super) fn fingers_row(moved: &[Moved]) -> Row {
    let run = "prism-ideal";
    let whole = [Attitudes, Integral, NormalOnly].map(|law| stop(moved, run, law, 1.0));
    let [Some((paper, own)), Some((_, earlier)), Some((_, without))] = whole else { return nothing(run) };
    let measured = format!(
        "asked for {}, the frame is off by {} under u_s + u_st, by {} under u_s + u_I, by {} under u_s alone; the object by {}, {} and {}",
        paper.asked.words(),
        own.frame.words(),
        earlier.frame.words(),
        without.frame.words(),
        own.object.words(),
        earlier.object.words(),
        without.object.words()
    );
    let is_there = own.frame.is_within(&THERE);
    // Then it is not `u_st` that disturbs.
    let apart = (own.frame.turn_rad - without.frame.turn_rad).abs();
    let mut row = row(run, measured, Verdict::of(is_there, apart < SAME * without.frame.turn_rad));
    row.figures.extend(own.frame.figures(["way_off_under_u_st", "turn_off_under_u_st"]));
    row.figures.extend(earlier.frame.figures(["way_off_under_u_i", "turn_off_under_u_i"]));
    row.figures.extend(without.frame.figures(["way_off_under_u_s", "turn_off_under_u_s"]));
    if !is_there {
        row.remark = "fingers with four joints can't turn their tips along with the object: these roll, which turns the object further than \
                      the frame, and the pull of u_s resists that. u_st changes little, nor does u_I: the paper asks for a sufficient number of \
                      degrees of freedom"
            .to_owned();
    }
    row
}

pub(super) fn arm(comparison: &Comparison) -> Claim {
    Claim {
        key: "arm-takes-part",
        words: "One controller moves arm and fingers together",
        place: "Sec. 1, advantage 6",
        criterion: "of the hand-arm under u_s + u_st, asked for 200 mm and 30 degrees: the frame is there, the object nearly, and what the \
                    joints of the arm, and those of the fingers, make of the motion is more than a tenth of it",
        tolerance: "0.1 mm and 5 mrad for the frame; 10 mm and 25 mrad for the object, on which the fingertips roll.",
        rows: vec![arm_row(&comparison.moved)],
    }
}

pub(super) fn arm_row(moved: &[Moved]) -> Row {
    let run = "hand-arm";
    let Some((moved, whole)) = stop(moved, run, Attitudes, 1.0) else { return nothing(run) };
    let takes_part =
        |part: &Off| part.way_m > 0.1 * moved.asked.way_m && part.turn_rad > 0.1 * moved.asked.turn_rad;
    let holds = whole.frame.is_within(&THERE)
        && whole.object.is_within(&NEAR)
        && takes_part(&moved.by_arm)
        && takes_part(&moved.by_fingers);
    let measured = format!(
        "asked for {}, the frame is off by {}, the object by {}; the arm's joints move the frame by {}, the fingers' by {}",
        moved.asked.words(),
        whole.frame.words(),
        whole.object.words(),
        moved.by_arm.words(),
        moved.by_fingers.words()
    );
    let mut row = row(run, measured, Verdict::holds(holds));
    row.figures.extend(whole.frame.figures(["frame_way_off", "frame_turn_off"]));
    row.figures.extend(whole.object.figures(["object_way_off", "object_turn_off"]));
    row.figures.extend(moved.by_arm.figures(["way_by_arm", "turn_by_arm"]));
    row.figures.extend(moved.by_fingers.figures(["way_by_fingers", "turn_by_fingers"]));
    row
}
