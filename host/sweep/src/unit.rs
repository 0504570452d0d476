//! The unit of a key, which stands at its end.

/// Ends of keys and their units; longer ends before those that they end in.
const UNITS: [(&str, &str); 18] = [
    ("_nm_s_rad_per_m2", "(N m s/rad)/m^2"),
    ("_n_s_m_per_m2", "(N s/m)/m^2"),
    ("_nm_s_rad", "N m s/rad"),
    ("_n_m2", "N/m^2"),
    ("_kg_m2", "kg m^2"),
    ("_kg_m3", "kg/m^3"),
    ("_rad_s", "rad/s"),
    ("_nm_s", "N m/s"),
    ("_m_s2", "m/s^2"),
    ("_nm", "N m"),
    ("_n", "N"),
    ("_s", "s"),
    ("_m", "m"),
    ("_kg", "kg"),
    ("_rad", "rad"),
    ("_hz", "Hz"),
    ("_counts", "counts"),
    ("_ticks", "ticks"),
];

/// The unit of a key of the configuration, or of an item below it; empty for what has none.
pub(super) fn of(key: &str) -> &'static str {
    let of_name = |name: &str| UNITS.iter().find(|(end, _)| name.ends_with(end)).map(|(_, unit)| *unit);
    key.rsplit('.').find_map(of_name).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::of;

    #[test]
    fn a_key_carries_its_unit() {
        for (key, unit) in [
            ("control.force_n", "N"),
            ("control.attitude_stiffness_nm", "N m"),
            ("actuators.slew_limit_nm_s", "N m/s"),
            ("hand.fingertip.*.torsional_damping_nm_s_rad_per_m2", "(N m s/rad)/m^2"),
            ("hand.joint.*.damping_gain_nm_s_rad", "N m s/rad"),
            ("hand.joint.2.speed_limit_rad_s", "rad/s"),
            ("plant.gravity_m_s2.3", "m/s^2"),
            ("start.trunk_rad.elbow", "rad"),
            ("object.inertia_kg_m2", "kg m^2"),
            ("friction.scale", ""),
            ("seed", ""),
        ] {
            assert_eq!(of(key), unit, "{key}");
        }
    }
}
