//! The results of a right implementation of the paper: the shipped scenes, run as `blindgrasp sim` runs them.

use blindgrasp::sim::summary::Summary;
use blindgrasp_tests::shipped::{as_shipped, run};

/// Largest relative difference of the normal forces from Eq. 57.
fn normal_error(summary: &Summary) -> f64 {
    let last = &summary.last;
    let pairs = last.normal_force_n.iter().zip(&last.desired_normal_force_n);
    pairs.map(|(force, desired)| (force / desired - 1.0).abs()).fold(0.0, f64::max)
}

/// Largest ratio of tangential to normal force at the end.
fn tangential_share(summary: &Summary) -> f64 {
    let last = &summary.last;
    let pairs = last.tangential_force_n.iter().zip(&last.normal_force_n);
    pairs.map(|(tangential, normal)| tangential / normal).fold(0.0, f64::max)
}

fn tell(summary: &Summary) {
    println!(
        "{}: held {}, at rest from {:?} s, normal force within {:.2e} of Eq. 57, tangential/normal {:.2e}, energy {:?}",
        summary.scene,
        summary.grasp_held,
        summary.settle_time_s,
        normal_error(summary),
        tangential_share(summary),
        summary.energy
    );
}

#[test]
fn prism_settles_with_the_forces_of_equation_57() {
    for (scene, ideal) in [("prism", false), ("prism-ideal", true)] {
        let run = as_shipped(scene);
        let summary = &run.summary;
        tell(summary);
        assert!(summary.grasp_held && summary.settle_time_s.is_some_and(|t_s| t_s < 3.0), "{summary:?}");
        assert!(normal_error(summary) < 0.01);
        if ideal {
            assert!(tangential_share(summary) < 0.01);
            // At 1 kHz the hold feeds energy in: less than a thousandth of what there was.
            assert!(summary.energy.increase_max_j < 1e-3 * summary.energy.initial_j);
            // Eq. 57 is what k dr^2 comes to rest at, and residuals vanish (Eq. 52). 1e-3 N is what is left of the swing.
            assert!(summary.last.force_residual_n < 1e-3 && summary.last.moment_residual_nm < 1e-5);
        }
    }
}

#[test]
fn cube_is_held_and_comes_to_rest() {
    let run = as_shipped("cube");
    let summary = &run.summary;
    tell(summary);
    assert!(summary.grasp_held && summary.settled);
    assert!(summary.fault.is_none());
}

#[test]
fn ideal_cube_is_held_with_falling_energy() {
    let run = as_shipped("cube-ideal");
    tell(&run.summary);
    // Staying on its face is part of being held.
    assert!(run.summary.grasp_held && run.summary.duration_s >= 20.0);
    // Energy over whole tenths of a second: the control at 1 kHz may feed a little in between.
    let tenths: Vec<f64> = run.samples.iter().step_by(100).map(|sample| sample.energy_j).collect();
    assert!(tenths.windows(2).all(|pair| pair[1] < pair[0]), "energy falls");
    // At 1 kHz the hold feeds energy in: less than a thousandth of what there was.
    let energy = run.summary.energy;
    assert!(energy.increase_max_j < 1e-3 * energy.initial_j, "{energy:?}");
    // What is missing for a grasp by normal forces is there: tangential force, held by u_st.
    assert!(tangential_share(&run.summary) > 0.1);
}

#[test]
fn cube_is_lost_by_normal_forces_alone() {
    let run = as_shipped("cube-normal-only");
    let summary = &run.summary;
    println!("{:?}: {:?}", summary.lost_at_s, summary.lost_reason);
    assert!(!summary.grasp_held && summary.lost_at_s.is_some_and(|t_s| t_s < 5.0), "{summary:?}");
}

/// Half the sub-step changes settle times by less than 1 %, and the final force on each finger, normal and tangential, by
/// less than 1 % of that force (a tangential force that vanishes has no per cent of its own).
#[test]
fn half_the_substep_changes_nothing() {
    for scene in ["prism-ideal", "prism", "cube", "cube-ideal"] {
        let whole = &as_shipped(scene).summary;
        let half = &run(scene, &["plant.substep_s=5e-5"]).summary;
        match (whole.settle_time_s, half.settle_time_s) {
            (Some(whole), Some(half)) => {
                assert!((half / whole - 1.0).abs() < 0.01, "{scene}: {whole} {half}")
            }
            (whole, half) => assert_eq!(whole, half, "{scene}"),
        }
        for finger in 0..3 {
            let force = |summary: &Summary| {
                let last = &summary.last;
                [last.normal_force_n[finger], last.tangential_force_n[finger]]
            };
            let ([normal, tangential], [half_normal, half_tangential]) = (force(whole), force(half));
            let change = (half_normal - normal).abs().max((half_tangential - tangential).abs());
            assert!(change < 0.01 * normal.hypot(tangential), "{scene}, finger {finger}: {change} N");
        }
    }
}

/// The very samples, bit for bit, on two runs; and other ones with another seed where there is noise.
#[test]
fn runs_are_reproducible() {
    let trace = |settings: &[&str]| {
        let mut bytes = Vec::new();
        blindgrasp::sim::csv::write(&mut bytes, &run("cube", settings).samples).expect("memory");
        bytes
    };
    assert!(trace(&[]) == trace(&[]), "the trace of cube");
    let noisy = ["sensors.noise_counts=0.5", "duration_s=0.5"];
    assert!(trace(&noisy) == trace(&noisy), "with noise");
    assert!(trace(&noisy) != trace(&[noisy[0], noisy[1], "seed=2"]), "another seed");
}
