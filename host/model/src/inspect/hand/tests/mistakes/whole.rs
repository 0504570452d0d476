//! Mistakes that show in the hand as a whole: ranges, motors, gains, the tree, fingers that can't meet.

use super::{Case, THREE, TWO};

pub(super) const CASES: &[Case] = &[
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
