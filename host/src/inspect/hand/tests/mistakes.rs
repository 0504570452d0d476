//! One mistake, or several, in a hand that was right: the whole line that is said of each, with its place.

use super::super::HandCheck;

/// A hand with mistakes.
struct Case {
    hand: &'static str,
    /// What is replaced, by what, and how often.
    edits: &'static [(&'static str, &'static str, usize)],
    /// What is found: severity, line, and the rest. The line is the first one with these words in it; the second after
    /// `2|`, the one before after `^`; nowhere without words.
    found: &'static [(&'static str, &'static str, &'static str)],
}

const THREE: &str = "three-finger";
const TWO: &str = "two-finger";

const CASES: &[Case] = &[
    // axis length
    Case {
        hand: THREE,
        edits: &[("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 2.0, 0.0]", 1)],
        found: &[(
            "error",
            "axis = [0.0, 2.0, 0.0]",
            "joint `finger-1-flex-1`: its axis [0.0, 2.0, 0.0] has length 2.0, not 1; write [0.0, 1.0, 0.0]",
        )],
    },
    // axis none
    Case {
        hand: THREE,
        edits: &[("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 0.0, 0.0]", 1)],
        found: &[(
            "error",
            "axis = [0.0, 0.0, 0.0]",
            "joint `finger-1-flex-1`: its axis [0.0, 0.0, 0.0] has no direction; give a unit vector",
        )],
    },
    // limits deg
    Case {
        hand: THREE,
        edits: &[("limits_rad = [-0.6, 0.6]", "limits_rad = [-34.0, 34.0]", 1)],
        found: &[(
            "warning",
            "limits_rad = [-34.0, 34.0]",
            "joint `finger-1-abduct`: limits_rad of [-34.0, 34.0] goes beyond a whole turn; write radians: if these are degrees, [-0.5934, 0.5934]",
        )],
    },
    // limits deg all
    Case {
        hand: THREE,
        edits: &[
            ("limits_rad = [-0.6, 0.6]", "limits_rad = [-34, 34]", 9),
            ("limits_rad = [-1.2, 1.6]", "limits_rad = [-69, 92]", 9),
            ("limits_rad = [-0.2, 1.9]", "limits_rad = [-11, 109]", 9),
        ],
        found: &[
            (
                "error",
                "limits_rad = [-11, 109]",
                "joint `finger-1-flex-2` and 5 others: limits_rad of [-11.0, 109.0] goes beyond a whole turn; write radians: if these are degrees, [-0.192, 1.9024]",
            ),
            (
                "warning",
                "limits_rad = [-34, 34]",
                "joint `finger-1-abduct` and 5 others: limits_rad of [-34.0, 34.0] goes beyond a whole turn; write radians: if these are degrees, [-0.5934, 0.5934]",
            ),
        ],
    },
    // limits deg >100
    Case {
        hand: THREE,
        edits: &[("limits_rad = [-0.6, 0.6]", "limits_rad = [-180.0, 180.0]", 1)],
        found: &[(
            "error",
            "limits_rad = [-180.0, 180.0]",
            "joint `finger-1-abduct`: limits_rad of [-180.0, 180.0] goes beyond a whole turn; write radians: if these are degrees, [-3.1416, 3.1416]",
        )],
    },
    // nominal deg
    Case {
        hand: THREE,
        edits: &[("nominal_rad = -0.45", "nominal_rad = -26", 1)],
        found: &[(
            "error",
            "nominal_rad = -26",
            "joint `finger-1-flex-1`: nominal_rad of -26 goes beyond a whole turn; write radians: if these are degrees, -0.4538",
        )],
    },
    // rot deg
    Case {
        hand: THREE,
        edits: &[("1.5707963267948966", "90.0", 1)],
        found: &[(
            "warning",
            "rotation_rpy_rad = [0.0, 0.0, 90.0]",
            "joint `finger-1-abduct`: rotation_rpy_rad of [0.0, 0.0, 90.0] goes beyond a whole turn; write radians: if these are degrees, [0.0, 0.0, 1.5708]",
        )],
    },
    // limits reversed
    Case {
        hand: THREE,
        edits: &[("limits_rad = [-0.6, 0.6]", "limits_rad = [0.6, -0.6]", 1)],
        found: &[(
            "error",
            "limits_rad = [0.6, -0.6]",
            "joint `finger-1-abduct`: limits have to be finite, the lower below the upper; write [lower, upper]",
        )],
    },
    // nominal out
    Case {
        hand: THREE,
        edits: &[("nominal_rad = 0.75", "nominal_rad = 2.0", 1)],
        found: &[(
            "error",
            "nominal_rad = 2.0",
            "joint `finger-1-flex-2`: nominal_rad: 2.0 is outside the limits; has to be between -0.2 and 1.9",
        )],
    },
    // bone mm
    Case {
        hand: THREE,
        edits: &[("offset_m = [0.0, 0.0, 0.064]", "offset_m = [0.0, 0.0, 64.0]", 1)],
        found: &[(
            "error",
            "offset_m = [0.0, 0.0, 64.0]",
            "joint `finger-1-flex-2`: its bone is 64.000 m long; write metres: in millimetres this is 64.0 mm",
        )],
    },
    // bone cm
    Case {
        hand: THREE,
        edits: &[("offset_m = [0.0, 0.0, 0.064]", "offset_m = [0.0, 0.0, 6.4]", 1)],
        found: &[(
            "warning",
            "offset_m = [0.0, 0.0, 6.4]",
            "joint `finger-1-flex-2`: its bone is 6.400 m long; write metres: in centimetres this is 64.0 mm",
        )],
    },
    // bones mm all
    Case {
        hand: THREE,
        edits: &[
            ("0.064]", "64.0]", 9),
            ("0.030]", "30.0]", 1),
            ("-0.035", "-35.0", 1),
            ("0.03031088913245536", "30.31088913245536", 2),
            ("0.0175", "17.5", 2),
        ],
        found: &[(
            "error",
            "offset_m = [0.0, 0.0, 30.0]           # the end of link 3",
            "fingertip `finger-1` and 11 others: its bone is 30.000 m long; write metres: in millimetres this is 30.0 mm",
        )],
    },
    // bones cm all
    Case {
        hand: THREE,
        edits: &[
            ("0.064]", "6.4]", 9),
            ("0.030]", "3.0]", 1),
            ("-0.035", "-3.5", 1),
            ("0.03031088913245536", "3.031088913245536", 2),
            ("0.0175", "1.75", 2),
        ],
        found: &[(
            "warning",
            "offset_m = [0.0, -3.5, 0.0]",
            "joint `finger-1-abduct` and 8 others: its bone is 3.500 m long; write metres: in centimetres this is 35.0 mm",
        )],
    },
    // radius mm
    Case {
        hand: THREE,
        edits: &[("radius_m = 0.015", "radius_m = 15", 1)],
        found: &[(
            "error",
            "radius_m = 15",
            "fingertip `finger-1` and 2 others: its radius of 15.000 m is more than the longest bone's 64.0 mm; write metres: in millimetres this is 15.0 mm",
        )],
    },
    // radius cm
    Case {
        hand: THREE,
        edits: &[("radius_m = 0.015", "radius_m = 0.15", 1)],
        found: &[(
            "warning",
            "radius_m = 0.15",
            "fingertip `finger-1` and 2 others: its radius of 150 mm is more than the longest bone's 64.0 mm; write metres",
        )],
    },
    // radius tiny
    Case {
        hand: THREE,
        edits: &[("radius_m = 0.015", "radius_m = 0.000015", 1)],
        found: &[(
            "warning",
            "radius_m = 0.000015",
            "fingertip `finger-1` and 2 others: its radius of 0.015 mm is nothing beside bones of 64.0 mm; write metres",
        )],
    },
    // mass g
    Case {
        hand: THREE,
        edits: &[("mass_kg = 0.038", "mass_kg = 38", 1)],
        found: &[(
            "warning",
            "mass_kg = 38",
            "joint `finger-1-flex-1`: its mass of 38 kg is more than a finger of 158 mm can have; write kilograms: 38 g are 0.038 kg",
        )],
    },
    // mass g all
    Case {
        hand: THREE,
        edits: &[
            ("mass_kg = 0.038", "mass_kg = 38", 9),
            ("mass_kg = 0.024", "mass_kg = 24", 9),
            ("mass_kg = 0.054", "mass_kg = 54", 9),
        ],
        found: &[(
            "warning",
            "mass_kg = 38",
            "joint `finger-1-flex-1` and 8 others: its mass of 38 kg is more than a finger of 158 mm can have; write kilograms: 38 g are 0.038 kg",
        )],
    },
    // mass centre mm
    Case {
        hand: THREE,
        edits: &[("mass_centre_m = [0.0, 0.0, 0.023]", "mass_centre_m = [0.0, 0.0, 2.3]", 1)],
        found: &[(
            "warning",
            "mass_centre_m = [0.0, 0.0, 2.3]",
            "joint `finger-1-flex-1`: its mass centre is 2.300 m from the joint, on a link of 64.0 mm; give mass_centre_m in metres, in the link frame",
        )],
    },
    // no inertia
    Case {
        hand: THREE,
        edits: &[("inertia_kg_m2 = [1.39207e-05, 1.39207e-05, 1.9e-06]\n", "", 1)],
        found: &[(
            "warning",
            "^name = \"finger-1-flex-1\"",
            "joint `finger-1-flex-1`: has a mass of 0.038 kg and no inertia; give inertia_kg_m2 about the mass centre, in the axes of the link frame",
        )],
    },
    // no mass
    Case {
        hand: THREE,
        edits: &[("mass_kg = 0.038\n", "", 1)],
        found: &[(
            "warning",
            "inertia_kg_m2 = [1.39207e-05, 1.39207e-05, 1.9e-06]",
            "joint `finger-1-flex-1`: has an inertia and no mass; give mass_kg",
        )],
    },
    // triangle
    Case {
        hand: THREE,
        edits: &[("[1.39207e-05, 1.39207e-05, 1.9e-06]", "[1.39207e-05, 1.39207e-06, 1.9e-06]", 1)],
        found: &[(
            "error",
            "inertia_kg_m2 = [1.39207e-05, 1.39207e-06, 1.9e-06]",
            "joint `finger-1-flex-1`: its inertia is that of no body: of its principal moments 1.39e-6, 1.90e-6, 1.39e-5, the largest is more than the sum of the others; give inertia_kg_m2 about the mass centre, in the axes of the link frame",
        )],
    },
    // negative
    Case {
        hand: THREE,
        edits: &[("[1.39207e-05, 1.39207e-05, 1.9e-06]", "[1.39207e-05, -1.39207e-06, 1.9e-06]", 1)],
        found: &[(
            "error",
            "inertia_kg_m2 = [1.39207e-05, -1.39207e-06, 1.9e-06]",
            "joint `finger-1-flex-1`: inertia has to be symmetric and positive semidefinite; give the inertia about the mass centre as [xx, yy, zz, xy, xz, yz]",
        )],
    },
    // flat
    Case {
        hand: THREE,
        edits: &[("[1.39207e-05, 1.39207e-05, 1.9e-06]", "[1.39207e-05, 1.39207e-05, 0]", 1)],
        found: &[(
            "warning",
            "inertia_kg_m2 = [1.39207e-05, 1.39207e-05, 0]",
            "joint `finger-1-flex-1`: its inertia is that of a body without thickness: 0.00e0, 1.39e-5, 1.39e-5; give all three moments",
        )],
    },
    // g cm2
    Case {
        hand: THREE,
        edits: &[("[1.39207e-05, 1.39207e-05, 1.9e-06]", "[139, 139, 19]", 1)],
        found: &[(
            "error",
            "inertia_kg_m2 = [139, 139, 19]",
            "joint `finger-1-flex-1`: its inertia of 1.39e2 kg m^2 needs its 0.038 kg 60.481 m from the mass centre, on a link of 64.0 mm; write kg m^2: 1 g cm^2 is 1e-7 kg m^2",
        )],
    },
    // 10x
    Case {
        hand: THREE,
        edits: &[("[1.39207e-05, 1.39207e-05, 1.9e-06]", "[13.9e-4, 13.9e-4, 1.9e-4]", 1)],
        found: &[(
            "warning",
            "inertia_kg_m2 = [13.9e-4, 13.9e-4, 1.9e-4]",
            "joint `finger-1-flex-1`: its inertia of 1.39e-3 kg m^2 needs its 0.038 kg 191 mm from the mass centre, on a link of 64.0 mm; write kg m^2, about the mass centre",
        )],
    },
    // tiny
    Case {
        hand: THREE,
        edits: &[("[1.39207e-05, 1.39207e-05, 1.9e-06]", "[1.4e-09, 1.4e-09, 1.9e-9]", 1)],
        found: &[(
            "warning",
            "inertia_kg_m2 = [1.4e-09, 1.4e-09, 1.9e-9]",
            "joint `finger-1-flex-1`: its inertia of 1.90e-9 kg m^2 is that of a body of 0.224 mm, on a link of 64.0 mm; give inertia_kg_m2 in kg m^2, about the mass centre",
        )],
    },
    // zero out
    Case {
        hand: THREE,
        edits: &[("limits_rad = [-0.2, 1.9]", "limits_rad = [0.1, 1.9]", 1)],
        found: &[(
            "notice",
            "limits_rad = [0.1, 1.9]",
            "joint `finger-1-flex-2`: its limits [0.1, 1.9] leave out zero, where its counter is set; if it was meant, set the counter at an angle of this joint that is known",
        )],
    },
    // narrow
    Case {
        hand: THREE,
        edits: &[("limits_rad = [-0.6, 0.6]", "limits_rad = [-0.006, 0.006]", 1)],
        found: &[(
            "warning",
            "limits_rad = [-0.006, 0.006]",
            "joint `finger-1-abduct`: turns by 1.20e-2 rad only; write radians; leave out a joint that does not turn, and add its link to its parent's",
        )],
    },
    // mirrored
    Case {
        hand: THREE,
        edits: &[(
            "limits_rad = [-0.2, 1.9]\nnominal_rad = 0.75",
            "limits_rad = [-1.9, 0.2]\nnominal_rad = -0.75",
            1,
        )],
        found: &[(
            "warning",
            "2|axis = [0.0, 1.0, 0.0]",
            "joint `finger-1-flex-2`: the larger side of its range, to -1.9 rad, opens the hand; write axis = [0.0, -1.0, 0.0]; or, if its sense is right, limits_rad = [-0.2, 1.9]",
        )],
    },
    // inertialess finger
    Case {
        hand: THREE,
        edits: &[(
            "mass_kg = 0.054\nmass_centre_m = [0.0, 0.0, 0.01]\ninertia_kg_m2 = [5.4e-06, 5.4e-06, 2.7e-06]\n",
            "",
            1,
        )],
        found: &[(
            "error",
            "^name = \"finger-1-flex-3\"",
            "joint `finger-1-flex-3`: moves no mass: the hand can't be simulated; give its link, or one that it carries, a mass and an inertia",
        )],
    },
    // torque small
    Case {
        hand: THREE,
        edits: &[(
            "damping_gain_nm_s_rad = 4e-4",
            "damping_gain_nm_s_rad = 4e-4\ntorque_limit_nm = 0.001",
            2,
        )],
        found: &[
            (
                "warning",
                "2|torque_limit_nm = 0.001",
                "joint `finger-1-flex-1`: its torque limit of 0.001 N m can't hold what it carries at the nominal posture: 0.008 N m; give it in newton metres at the joint, gear included; check the masses",
            ),
            (
                "notice",
                "torque_limit_nm = 0.001",
                "joint `finger-1-abduct`: its torque limit of 0.001 N m can't hold what it carries in every posture: up to 0.054 N m; keep it away from there, or give it a stronger motor",
            ),
        ],
    },
    // torque somewhat small
    Case {
        hand: THREE,
        edits: &[("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 1.0, 0.0]\ntorque_limit_nm = 0.05", 1)],
        found: &[
            (
                "warning",
                "force_n = 5.0                          # f_d, Table VII",
                "[control]: f_d of 5 N asks joint `finger-1-flex-1` for 0.274 N m at the nominal posture, of 0.05 N m; give a smaller f_d; it grows with the object (Eq. 57)",
            ),
            (
                "notice",
                "torque_limit_nm = 0.05",
                "joint `finger-1-flex-1`: its torque limit of 0.05 N m can't hold what it carries in every posture: up to 0.104 N m; keep it away from there, or give it a stronger motor",
            ),
        ],
    },
    // torque mNm
    Case {
        hand: THREE,
        edits: &[("torque_limit_nm = 1.3878", "torque_limit_nm = 1387.8", 1)],
        found: &[(
            "warning",
            "torque_limit_nm = 1387.8               # 0.257 * 5.4",
            "joint `finger-1-abduct` and 11 others: its torque limit of 1387.8 N m is 13335 times what its finger weighs on a joint; write newton metres: 1387.8 mN m are 1.3878 N m",
        )],
    },
    // speed rpm
    Case {
        hand: THREE,
        edits: &[("speed_limit_rad_s = 185.2", "speed_limit_rad_s = 1768", 1)],
        found: &[(
            "warning",
            "speed_limit_rad_s = 1768              # 9550 * 2 pi / 60 / 5.4",
            "joint `finger-1-abduct` and 11 others: its speed limit of 1768 rad/s is that of no joint; write rad/s at the joint, gear included: 1768 turns a minute are 185.1 rad/s",
        )],
    },
    // speed slow
    Case {
        hand: THREE,
        edits: &[("speed_limit_rad_s = 185.2", "speed_limit_rad_s = 0.01", 1)],
        found: &[(
            "warning",
            "speed_limit_rad_s = 0.01              # 9550 * 2 pi / 60 / 5.4",
            "joint `finger-1-abduct` and 11 others: its speed limit of 0.01 rad/s is that of no joint; write rad/s at the joint",
        )],
    },
    // coarse
    Case {
        hand: THREE,
        edits: &[("encoder_counts_per_turn = 21600", "encoder_counts_per_turn = 500", 1)],
        found: &[(
            "warning",
            "encoder_counts_per_turn = 500        # 4000 * 5.4",
            "joint `finger-1-abduct` and 8 others: one of its 500 counts a turn moves fingertip `finger-1` by 1.68 mm; count a turn of the joint, gear included, and all edges",
        )],
    },
    // undamped one
    Case {
        hand: THREE,
        edits: &[("damping_gain_nm_s_rad = 3e-4", "damping_gain_nm_s_rad = 0", 1)],
        found: &[(
            "warning",
            "damping_gain_nm_s_rad = 0",
            "joint `finger-1-flex-2`: has no damping gain; give damping_gain_nm_s_rad, N m s/rad: without it, only friction takes energy out of the grasp",
        )],
    },
    // scale 0
    Case {
        hand: THREE,
        edits: &[("period_s = 1e-3", "period_s = 1e-3\ndamping_scale = 0", 1)],
        found: &[(
            "warning",
            "damping_scale = 0",
            "[control]: a factor of 0 takes all joints' damping away; give a positive factor",
        )],
    },
    // f_d
    Case {
        hand: THREE,
        edits: &[("force_n = 5.0", "force_n = 50.0", 1)],
        found: &[(
            "warning",
            "force_n = 50.0                          # f_d, Table VII",
            "[control]: f_d of 50 N asks joint `finger-3-flex-1` for 2.667 N m at the nominal posture, of 1.3878 N m; give a smaller f_d; it grows with the object (Eq. 57)",
        )],
    },
    // f_d neg
    Case {
        hand: THREE,
        edits: &[("force_n = 5.0", "force_n = -5.0", 1)],
        found: &[(
            "error",
            "force_n = -5.0                          # f_d, Table VII",
            "[control]: force_n: -5.0 is out of range; has to be between 1e-6 and 10000.0",
        )],
    },
    // K_st
    Case {
        hand: THREE,
        edits: &[("attitude_stiffness_nm = 5e-3", "attitude_stiffness_nm = 5e-2", 1)],
        found: &[(
            "notice",
            "attitude_stiffness_nm = 5e-2           # K_st, Table VII",
            "[control]: K_st of 0.05 N m is more than the 5.93e-3 N m that Eq. 49 allows with this f_d at the nominal posture; if it was not meant, less K_st or more f_d: Eq. 49 is a sizing rule",
        )],
    },
    // parent
    Case {
        hand: THREE,
        edits: &[("parent = \"finger-1-flex-1\"", "parent = \"finger-1-flex\"", 1)],
        found: &[(
            "error",
            "parent = \"finger-1-flex\"",
            "joint `finger-1-flex-2`: parent: there is no joint `finger-1-flex`; did you mean `finger-1-flex-3`?",
        )],
    },
    // parent later
    Case {
        hand: THREE,
        edits: &[("parent = \"finger-1-flex-1\"", "parent = \"finger-2-flex-1\"", 1)],
        found: &[(
            "error",
            "parent = \"finger-2-flex-1\"",
            "joint `finger-1-flex-2`: parent: joint `finger-2-flex-1` does not come before this one; move it up",
        )],
    },
    // dup name
    Case {
        hand: THREE,
        edits: &[("name = \"finger-1-flex-2\"", "name = \"finger-1-flex-1\"", 1)],
        found: &[
            (
                "error",
                "2|name = \"finger-1-flex-1\"",
                "joint `finger-1-flex-1`: name: `finger-1-flex-1` is there twice; rename one of them",
            ),
            (
                "error",
                "parent = \"finger-1-flex-2\"",
                "joint `finger-1-flex-3`: parent: there is no joint `finger-1-flex-2`; did you mean `finger-3-flex-2`?",
            ),
        ],
    },
    // link
    Case {
        hand: THREE,
        edits: &[("link = \"finger-1-flex-3\"", "link = \"finger-1-flex-4\"", 1)],
        found: &[(
            "error",
            "link = \"finger-1-flex-4\"",
            "fingertip `finger-1`: link: there is no joint `finger-1-flex-4`; did you mean `finger-1-flex-3`?",
        )],
    },
    // short finger
    Case {
        hand: TWO,
        edits: &[("link = \"finger-2-flex-3\"", "link = \"finger-2-flex-1\"", 1)],
        found: &[
            (
                "error",
                "name = \"finger-2-flex-2\"",
                "joint `finger-2-flex-2`: moves no fingertip; leave it out and add its mass to its parent",
            ),
            (
                "notice",
                "link = \"finger-2-flex-1\"",
                "fingertip `finger-2`: has 2 joints of its own: its centre stays on a surface; if it was meant, contact points have to be where it gets",
            ),
        ],
    },
    // apart
    Case {
        hand: TWO,
        edits: &[("offset_m = [0.0, -0.035, 0.0]", "offset_m = [0.0, -1.035, 0.0]", 1)],
        found: &[
            (
                "warning",
                "",
                "the fingertips come no nearer to each other than around a ball of 384 mm radius; check axes, limits and where the fingers start",
            ),
            (
                "warning",
                "force_n = 5.0                          # f_d, Table VII",
                "[control]: f_d of 5 N asks joint `finger-2-flex-1` for 11.548 N m at the nominal posture, of 1.3878 N m; give a smaller f_d; it grows with the object (Eq. 57)",
            ),
        ],
    },
    // somewhat apart
    Case {
        hand: TWO,
        edits: &[("offset_m = [0.0, -0.035, 0.0]", "offset_m = [0.0, -0.30, 0.0]", 1)],
        found: &[(
            "warning",
            "force_n = 5.0                          # f_d, Table VII",
            "[control]: f_d of 5 N asks joint `finger-1-flex-1` for 3.359 N m at the nominal posture, of 1.3878 N m; give a smaller f_d; it grows with the object (Eq. 57)",
        )],
    },
    // one apart
    Case {
        hand: THREE,
        edits: &[("offset_m = [0.0, -0.035, 0.0]", "offset_m = [0.0, -1.035, 0.0]", 1)],
        found: &[
            (
                "warning",
                "",
                "no posture was found in which fingertip `finger-1` can meet the others around any ball; check axes, limits and where the fingers start",
            ),
            (
                "warning",
                "force_n = 5.0                          # f_d, Table VII",
                "[control]: f_d of 5 N asks joint `finger-1-flex-1` for 10.177 N m at the nominal posture, of 1.3878 N m; give a smaller f_d; it grows with the object (Eq. 57)",
            ),
        ],
    },
    // overlap
    Case {
        hand: TWO,
        edits: &[("nominal_rad = -0.45", "nominal_rad = 0.0", 2)],
        found: &[(
            "warning",
            "name = \"finger-2\"",
            "fingertip `finger-2`: its finger crosses that of fingertip `finger-1` at the nominal posture; change nominal_rad, or where the fingers start",
        )],
    },
    // schema
    Case {
        hand: THREE,
        edits: &[("schema = 1", "schema = 3", 1)],
        found: &[(
            "error",
            "schema = 3",
            "schema: 3 is a format that this program does not know; write it as format 1",
        )],
    },
    // many
    Case {
        hand: THREE,
        edits: &[
            ("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 2.0, 0.0]", 1),
            ("mass_kg = 0.024", "mass_kg = -1", 1),
            ("force_n = 5.0", "force_n = -5.0", 1),
            ("parent = \"finger-2-flex-2\"", "parent = \"finger-2-flx-2\"", 1),
            ("radius_m = 0.015", "radius_m = 2", 1),
            ("stiffness_n_m2 = 2.39e6", "stiffness_n_m2 = 0", 1),
        ],
        found: &[
            (
                "error",
                "force_n = -5.0                          # f_d, Table VII",
                "[control]: force_n: -5.0 is out of range; has to be between 1e-6 and 10000.0",
            ),
            (
                "error",
                "radius_m = 2",
                "fingertip `finger-1` and 2 others: its radius of 2.000 m is more than the longest bone's 64.0 mm; write metres: in centimetres this is 20.0 mm",
            ),
            (
                "error",
                "stiffness_n_m2 = 0",
                "fingertip `finger-1` and 2 others: stiffness_n_m2: 0.0 is out of range; has to be between 1.0 and 10000000000000.0",
            ),
            (
                "error",
                "axis = [0.0, 2.0, 0.0]",
                "joint `finger-1-flex-1`: its axis [0.0, 2.0, 0.0] has length 2.0, not 1; write [0.0, 1.0, 0.0]",
            ),
            (
                "error",
                "mass_kg = -1",
                "joint `finger-1-flex-2`: mass_kg: -1.0 is out of range; has to be between 0.0 and 10000.0",
            ),
            (
                "error",
                "parent = \"finger-2-flx-2\"",
                "joint `finger-2-flex-3`: parent: there is no joint `finger-2-flx-2`; did you mean `finger-2-flex-2`?",
            ),
        ],
    },
];

fn line(text: &str, words: &str) -> usize {
    let (before, words) = words.strip_prefix('^').map_or((0, words), |words| (1, words));
    let (skipped, words) = words.strip_prefix("2|").map_or((0, words), |words| (1, words));
    let lines = text.lines().enumerate().filter(|(_, line)| line.contains(words));
    let (index, _) = lines.skip(skipped).next().unwrap_or_else(|| panic!("no line has `{words}`"));
    1 + index - before
}

#[test]
fn every_mistake_is_found_with_its_line() {
    for case in CASES {
        let mut text = super::text(case.hand).to_owned();
        for (from, to, times) in case.edits {
            assert!(text.contains(from), "{from}");
            text = text.replacen(from, to, *times);
        }
        let check = HandCheck::parse(&text, "hand.toml").unwrap_or_else(|error| panic!("{error}"));
        let expected = case.found.iter().map(|(severity, words, rest)| match *words {
            "" => format!("{severity}: hand.toml: {rest}"),
            words => format!("{severity}: hand.toml:{}: {rest}", line(&text, words)),
        });
        assert_eq!(check.findings.lines(), expected.collect::<Vec<_>>(), "{:?}", case.edits);
    }
}
