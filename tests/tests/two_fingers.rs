//! Another hand: two opposed fingers of four joints hold a hexagonal prism.

use blindgrasp_tests::shipped::run;

/// As shipped, turned, off the middle, and with the weight of the object.
#[test]
fn two_fingers_hold_a_prism_and_come_to_rest() {
    for settings in [
        &[][..],
        &["pose.rotation_rpy_rad=[0.1, 0.05, 0.05]"],
        &["pose.position_m.1=0.005"],
        &["plant.gravity_on_object=true"],
    ] {
        let summary = run("two-finger-prism", settings).summary;
        println!("{settings:?}: at rest from {:?} s, {:?}", summary.settle_time_s, summary.last);
        assert!(summary.grasp_held && summary.fault.is_none(), "{summary:?}");
        assert!(summary.settle_time_s.is_some_and(|t_s| t_s < 1.0), "{summary:?}");
        let last = &summary.last;
        for (force, desired) in last.normal_force_n.iter().zip(&last.desired_normal_force_n) {
            assert!((force / desired - 1.0).abs() < 0.02, "{force} N, Eq. 57 says {desired} N");
        }
        // One presses as hard as the other, but for the small weight.
        assert!((last.normal_force_n[0] - last.normal_force_n[1]).abs() < 0.02);
    }
}
