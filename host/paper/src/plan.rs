//! The runs: which scene, with which settings, and what for.

/// A run to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planned {
    /// Its name.
    pub name: &'static str,
    /// A built-in scene.
    pub scene: &'static str,
    /// Settings `KEY=VALUE`.
    pub settings: &'static [&'static str],
    /// Its scene, and its purpose.
    pub what: &'static str,
}

const fn run(
    name: &'static str,
    scene: &'static str,
    settings: &'static [&'static str],
    what: &'static str,
) -> Planned {
    Planned { name, scene, settings, what }
}

/// The law at 10 kHz, at every step of the integrator: as near to the continuous time of the theory as the tick goes.
const CONTINUOUS: &str = "control.period_s=1e-4";

/// The step of the integrator of the paper's own scenes: what is left of the energy balance grows with its square.
const FINE: &str = "plant.substep_s=1e-4";

/// All runs, the long ones first, so that the cores are busy to the end.
pub const PLAN: &[Planned] = &[
    run(
        "hand-arm-continuous",
        "hand-arm",
        &[CONTINUOUS, "duration_s=90"],
        "Sec. 5 with the law at 10 kHz: what the sampling of the controller changes",
    ),
    run(
        "hand-arm",
        "hand-arm",
        &["duration_s=90"],
        "Sec. 5: hand-arm and cuboid, the numbers of Tables I to III as printed",
    ),
    run(
        "hand-arm-stiff",
        "hand-arm",
        &["control.attitude_stiffness_nm=0.3", "duration_s=60"],
        "Sec. 5 with K_st = 0.3 N m instead of 0.05238",
    ),
    run(
        "hand-arm-half-angle",
        "hand-arm",
        &["control.attitude_error=half-angle", "duration_s=90"],
        "Sec. 5 as printed, but with the attitude error 4 sin(a/2) instead of 2 sin a",
    ),
    run(
        "hand-arm-consistent",
        "hand-arm-consistent",
        &["duration_s=90"],
        "Sec. 5 with the object's mass and inertia from its geometry",
    ),
    run(
        "cube-continuous",
        "cube-ideal",
        &[CONTINUOUS, "duration_s=40"],
        "the cube in the paper's model with the law at 10 kHz: the continuous time of the theory",
    ),
    run(
        "prism-ideal-minute",
        "prism-ideal",
        &["duration_s=60"],
        "the prism in the paper's model, with the law at the 1 kHz of the experiments, for a minute",
    ),
    run(
        "prism-continuous",
        "prism-ideal",
        &[CONTINUOUS, "duration_s=20"],
        "the prism in the paper's model with the law at 10 kHz: the continuous time of the theory",
    ),
    run(
        "cube-above-bound",
        "cube-ideal",
        &[CONTINUOUS, "control.attitude_stiffness_nm=0.1", "duration_s=10"],
        "the cube in the paper's model with a K_st above the bound of Eq. 49",
    ),
    run("cube-ideal", "cube-ideal", &[], "the cube in the paper's model, with the law at 1 kHz"),
    run(
        "cube",
        "cube",
        &[FINE],
        "Sec. 6: the cube, with encoders, motor limits, a tick of delay and joint friction",
    ),
    run("prism", "prism", &[FINE], "Sec. 6: the prism, with the same"),
    run(
        "prism-normal-only",
        "prism-normal-only",
        &[CONTINUOUS, "duration_s=20"],
        "the prism in the paper's model without u_st",
    ),
    run(
        "cube-normal-only",
        "cube-normal-only",
        &[CONTINUOUS, "duration_s=20"],
        "the cube in the paper's model without u_st",
    ),
    run(
        "cube-normal-only-friction",
        "cube",
        &[FINE, "control.attitude_stiffness_nm=0"],
        "Sec. 6: the cube without u_st, but with the friction of the joints",
    ),
    run("hand-arm-normal-only", "hand-arm-normal-only", &["duration_s=90"], "Sec. 5 without u_st"),
    run(
        "cube-weight",
        "cube",
        &[FINE, "plant.gravity_on_object=true"],
        "Sec. 6: the cube with its weight, which the paper neglects",
    ),
    run(
        "prism-half-step",
        "prism-ideal",
        &["plant.substep_s=5e-5"],
        "half the integrator's step, against `prism-whole-step`: the order of what is left of the energy balance",
    ),
    run("prism-whole-step", "prism-ideal", &[], "the integrator's step as it is, beside `prism-half-step`"),
    run(
        "cube-half-step",
        "cube-ideal",
        &["plant.substep_s=5e-5", "duration_s=5"],
        "half the integrator's step, against `cube-whole-step`",
    ),
    run(
        "cube-whole-step",
        "cube-ideal",
        &["duration_s=5"],
        "the integrator's step as it is, beside `cube-half-step`",
    ),
    run(
        "hand-arm-half-step",
        "hand-arm",
        &["plant.substep_s=5e-5", "duration_s=5"],
        "half the integrator's step, against `hand-arm-whole-step`",
    ),
    run(
        "hand-arm-whole-step",
        "hand-arm",
        &["duration_s=5"],
        "the integrator's step as it is, beside `hand-arm-half-step`",
    ),
];
