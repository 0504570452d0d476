//! Random polyhedra in the paper's own model, a part of those that `blindgrasp paper` grasps: no panic, and what the paper
//! claims in its weakest form.

use blindgrasp::paper::polyhedra::grasped;

#[test]
fn random_polyhedra_are_grasped() {
    let polyhedra = grasped(40, 17, &|_| {}).expect("the built-in scene");
    let [with, without] = polyhedra.held();
    println!(
        "of {} graspable polyhedra of {}: {with} with u_st, {without} without",
        polyhedra.outcomes.len(),
        polyhedra.drawn
    );
    assert_eq!(polyhedra.outcomes.len(), 40);
    for outcome in &polyhedra.outcomes {
        for why in outcome.with.iter().chain(&outcome.without) {
            assert!(!why.contains("diverged") && !why.contains("dependent"), "{why}");
        }
    }
    // u_st is there to hold what the normal forces alone do not.
    assert!(with > without, "{with} with u_st, {without} without");
}
