//! Numbers that are damaged at random: never a panic, and a hand without errors is one that loads.

use super::*;
use crate::{HandModel, still_joints};

const VALUES: [f64; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-300,
    5e-324,
    -1e-12,
    1e-6,
    64.0,
    -57.3,
    180.0,
    1e4,
    1e9,
    -1e300,
    1e300,
    f64::MAX,
];

/// All numbers of a hand's file.
fn numbers(file: &mut HandFile) -> Vec<&mut f64> {
    let mut all = Vec::new();
    if let Some(control) = &mut file.control {
        all.extend(control.gains.grasp.iter_mut().chain([&mut control.damping_scale]));
        all.extend([&mut control.period_s, &mut control.soft_start_s, &mut control.estimator_bandwidth_hz]);
    }
    all.extend([
        &mut file.safety.slew_s,
        &mut file.safety.stop_margin_rad,
        &mut file.safety.stop_torque_share,
    ]);
    for joint in &mut file.joints {
        all.extend(joint.offset_m.iter_mut().chain(&mut joint.rotation_rpy_rad).chain(&mut joint.axis));
        all.extend(
            joint.limits_rad.iter_mut().chain(&mut joint.mass_centre_m).chain(&mut joint.inertia_kg_m2.0),
        );
        all.extend([&mut joint.nominal_rad, &mut joint.mass_kg, &mut joint.damping_gain_nm_s_rad]);
        all.extend([
            &mut joint.torque_limit_nm,
            &mut joint.speed_limit_rad_s,
            &mut joint.encoder_counts_per_turn,
            &mut joint.torque_per_volt_nm_v,
        ]);
        all.extend([
            &mut joint.viscous_friction_nm_s_rad,
            &mut joint.coulomb_friction_nm,
            &mut joint.presliding_rad,
        ]);
        all.push(&mut joint.presliding_damping_nm_s_rad);
    }
    for tip in &mut file.fingertips {
        all.extend(&mut tip.offset_m);
        all.extend([&mut tip.radius_m, &mut tip.stiffness_n_m2, &mut tip.damping_n_s_m_per_m2]);
        all.push(&mut tip.torsional_damping_nm_s_rad_per_m2);
    }
    all
}

#[test]
fn damaged_numbers_never_panic_and_no_error_is_missed() {
    let mut random = fastrand::Rng::with_seed(11);
    let (mut usable, mut broken) = (0, 0);
    for round in 0..300 {
        let mut file = HandFile::load(PAPER_S[round % 2]).unwrap();
        let hits = 1 + round % 5;
        let mut all = numbers(&mut file);
        for _ in 0..hits {
            let at = random.usize(..all.len());
            *all[at] = match random.usize(..4) {
                0 => *all[at] * 10_f64.powi(random.i32(-9..10)),
                _ => VALUES[random.usize(..VALUES.len())],
            };
        }
        let check = check(&file);
        let text = check.text();
        assert!(!text.contains("NaN") && !text.contains("inf "), "{text}");
        let has_masses = |hand: &Hand| {
            let nominal: Vec<f64> = file.joints.iter().map(|joint| joint.nominal_rad).collect();
            still_joints(hand, &nominal).is_empty()
        };
        let loads = HandModel::build(&file).is_ok_and(|model| has_masses(&model.hand));
        if check.counts.errors == 0 {
            assert!(loads, "{file:?}");
            usable += 1;
        } else {
            broken += 1;
        }
        // What loads has no error but those of inertias that no body has, and fingertips that never meet.
        let allowed = ["its inertia", "no two fingertips"];
        let errors = check.findings.iter().filter(|finding| finding.severity == Severity::Error);
        for error in errors {
            assert!(!loads || allowed.iter().any(|words| error.what.starts_with(words)), "{error}");
        }
    }
    println!("of 300 damaged hands, {usable} are usable and {broken} broken");
    assert!(usable > 30 && broken > 30);
}

/// Trees at random: names that are swapped, lost, repeated.
#[test]
fn damaged_trees_never_panic() {
    let mut random = fastrand::Rng::with_seed(12);
    for round in 0..300 {
        let mut file = HandFile::load(PAPER_S[round % 2]).unwrap();
        for _ in 0..1 + round % 4 {
            let (a, b) = (random.usize(..file.joints.len()), random.usize(..file.joints.len()));
            match random.usize(..7) {
                0 => file.joints[a].parent = Some(file.joints[b].name.clone()),
                1 => file.joints[a].parent = None,
                2 => file.joints[a].name = file.joints[b].name.clone(),
                3 => file.joints.swap(a, b),
                4 => file.joints[a].name = String::new(),
                5 => file.fingertips[0].link = file.joints[b].name.clone(),
                _ if file.joints.len() > 1 => drop(file.joints.remove(a)),
                _ => {}
            }
        }
        let check = check(&file);
        let loads = HandModel::build(&file).is_ok();
        assert!(check.counts.errors > 0 || loads, "{}", check.text());
        assert!(check.counts.errors == 0 || !loads || check.nominal.is_some(), "{}", check.text());
    }
}
