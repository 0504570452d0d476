//! An arbitrary polyhedral object (the title, and advantage 1 of Sec. 1).

use crate::paper::claim::{Claim, Figure, Row, Verdict, percent};
use crate::paper::polyhedra::{Outcome, Polyhedra};

pub(super) fn arbitrary(polyhedra: &Polyhedra) -> Claim {
    Claim {
        key: "arbitrary",
        words: "Stable grasping of an arbitrary polyhedral object: u_st expands what can be grasped",
        place: "Title; Sec. 1, advantages 1 and 2",
        criterion: "taken at its word: every random convex polyhedron that has three faces which the hand can reach, and which ask \
                    for a tangential force of at most half the normal one at the start, is held for 5 s in the paper's model; and, \
                    as an enhancement: more of them than without u_st",
        tolerance: "None. Polyhedra of foam, 16 to 34 mm, contacts in the middle of the faces, the gains of Table VII; the same \
                    seed each time.",
        rows: vec![every(polyhedra), more(polyhedra)],
    }
}

pub(super) fn every(polyhedra: &Polyhedra) -> Row {
    let [with, without] = polyhedra.held();
    let count = polyhedra.outcomes.len();
    let lost = |outcome: &&Outcome| outcome.with.is_some();
    let rolled = polyhedra
        .outcomes
        .iter()
        .filter(|outcome| outcome.with.as_ref().is_some_and(|why| why.contains("rolled off")));
    let (rolled, lost) = (rolled.count(), polyhedra.outcomes.iter().filter(lost).count());
    Row {
        run: "every".to_owned(),
        measured: format!("{} of {count} are held", percent(with)),
        figures: vec![Figure::new("held_with_u_st", with, ""), Figure::new("held_without", without, "")],
        verdict: Verdict::holds(count > 0 && lost == 0),
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
    let [with, without] = polyhedra.held();
    let only_without = polyhedra.outcomes.iter().filter(|o| o.with.is_some() && o.without.is_none()).count();
    Row {
        run: "more".to_owned(),
        measured: format!(
            "{} with u_st, {} without; {only_without} are held only without",
            percent(with),
            percent(without)
        ),
        figures: Vec::new(),
        verdict: Verdict::holds(with > without),
        remark: String::new(),
    }
}
