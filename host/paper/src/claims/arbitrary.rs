//! An arbitrary polyhedral object (the title, and advantage 1 of Sec. 1).

use crate::claim::{Claim, Figure, Row, Verdict, percent};
use crate::laws::Case;
use crate::polyhedra::{Outcome, Polyhedra};

pub(super) fn arbitrary(polyhedra: &Polyhedra) -> Claim {
    Claim {
        key: "arbitrary",
        words: "Stable grasping of an arbitrary polyhedral object: u_st expands what can be grasped",
        place: "Title; Sec. 1, advantages 1 and 2",
        criterion: "taken at its word: every random convex polyhedron that the hand can be placed on is held for 5 s in the paper's \
                    model; and, as an enhancement: more of them than without u_st",
        tolerance: "None. Polyhedra of foam with 4 to 30 faces, 20 to 200 mm across, in any attitude, placed by the search of \
                    `scene new`; the gains of Table VII; the same seed each time.",
        rows: vec![every(polyhedra), more(polyhedra)],
    }
}

/// The share that a law holds, in words and as a number.
fn share(polyhedra: &Polyhedra, held: usize) -> (f64, String) {
    let share = polyhedra.share(held);
    (share, format!("{held} of {} ({})", polyhedra.outcomes.len(), percent(share)))
}

pub(super) fn every(polyhedra: &Polyhedra) -> Row {
    let (with, words) = share(polyhedra, polyhedra.held(Case::PAPER));
    let whys = || polyhedra.outcomes.iter().filter_map(|o| Some(&o.under(Case::PAPER)?.lost.as_ref()?.why));
    let (rolled, lost) = (whys().filter(|why| why.contains("rolled off")).count(), whys().count());
    Row {
        run: "every".to_owned(),
        measured: format!("{words} are held; {} were drawn", polyhedra.drawn),
        figures: vec![
            Figure::new("held_with_u_st", with, ""),
            Figure::new("held_without", share(polyhedra, polyhedra.held(Case::NORMAL_ONLY)).0, ""),
        ],
        verdict: Verdict::holds(!polyhedra.outcomes.is_empty() && lost == 0),
        remark: if lost == 0 {
            String::new()
        } else {
            format!(
                "of the {lost} others {rolled} are lost because a fingertip rolls off its face: assumption 3 does not hold"
            )
        },
    }
}

pub(super) fn more(polyhedra: &Polyhedra) -> Row {
    let held = |case| share(polyhedra, polyhedra.held(case));
    let ((with, with_words), (without, without_words)) = (held(Case::PAPER), held(Case::NORMAL_ONLY));
    let only_without = |outcome: &&Outcome| outcome.held(Case::NORMAL_ONLY) && !outcome.held(Case::PAPER);
    let only_without = polyhedra.outcomes.iter().filter(only_without).count();
    Row {
        run: "more".to_owned(),
        measured: format!(
            "{with_words} with u_st, {without_words} without; {only_without} are held only without"
        ),
        figures: Vec::new(),
        verdict: Verdict::holds(with > without),
        remark: String::new(),
    }
}
