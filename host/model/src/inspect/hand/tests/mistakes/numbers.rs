//! Mistakes in single numbers: axes, angles, lengths, masses, inertias.

use super::{Case, THREE};

pub(super) const CASES: &[Case] = &[
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
];
