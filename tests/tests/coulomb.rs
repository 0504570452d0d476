//! Contact with friction against the rolling contact, where both have to be the same.

use blindgrasp::body::dynamics::JointVector;
use blindgrasp::body::{MAX_FINGERS, MAX_JOINTS, Posture};
use blindgrasp::model::Scene;
use blindgrasp::plant::Motion;
use blindgrasp::plant::coulomb::{self, Friction, World};
use blindgrasp::plant::integrator::Plant;
use blindgrasp::sim;
use blindgrasp_shared::control::{Held, Latch, Laws, Stance};

const SCENES: [&str; 3] = ["cube-ideal", "prism-ideal", "hand-arm"];

/// A scene with its law in the precision of the plant, evaluated at every sub-step.
struct Loop {
    scene: Scene,
    laws: Laws<f64, MAX_JOINTS>,
    latch: Latch<f64, MAX_JOINTS, MAX_FINGERS>,
    start: Motion,
}

impl Loop {
    fn new(name: &str) -> Self {
        let scene = Scene::load(name, &[]).expect("built in");
        let plant = sim::plant(&scene).expect("it can be simulated");
        let start = *plant.motion();
        let latch = Latch::of(&scene.hand, plant.posture(), &start.angles_rad);
        Self { laws: sim::laws(&scene).expect("good gains"), latch, start, scene }
    }

    fn torques(&self, posture: &Posture, motion: &Motion) -> JointVector {
        let Motion { angles_rad, speeds_rad_s, .. } = motion;
        let held = Held::nothing();
        let stance = Stance { hand: &self.scene.hand, posture, angles_rad, speeds_rad_s, held: &held };
        self.laws.torques(&stance, Some(&self.laws.grip(&self.latch))).0
    }

    /// So much friction that nothing slips.
    fn with_friction(&self, substep_s: f64, torsion_m: f64) -> coulomb::Plant {
        let friction = Friction { sliding: 10.0, torsion_m };
        let world = World {
            fingertip_friction: vec![friction; self.scene.hand.fingertip_count()],
            ..World::default()
        };
        coulomb::Plant::new(sim::model(&self.scene), world, self.start, substep_s).expect("a convex object")
    }
}

/// Numbers of a motion and normal forces, each in units of its own.
fn numbers(motion: &Motion, normal_n: impl Iterator<Item = f64>) -> Vec<f64> {
    let Motion { angles_rad, speeds_rad_s, position_m, velocity_m_s, spin_rad_s, .. } = motion;
    let joints = angles_rad.iter().chain(speeds_rad_s);
    let vectors = [position_m, velocity_m_s, spin_rad_s];
    joints.chain(vectors.into_iter().flatten()).copied().chain(normal_n).collect()
}

/// Normal force frozen at the step, torsion viscous: the same as the rolling contact, step by step.
///
/// Tolerance: 1e-9 of one radian, metre and newton (which all numbers are near to), over a quarter of a second in which a
/// difference of one step is taken along by the motion.
#[test]
fn frozen_and_viscous_it_is_the_rolling_contact() {
    const SUBSTEP_S: f64 = 1e-4;
    for name in SCENES {
        let control = Loop::new(name);
        let mut rolling = Plant::new(sim::model(&control.scene), control.start, SUBSTEP_S).unwrap();
        let mut coulomb = control.with_friction(SUBSTEP_S, 0.0).compare_with_rolling();
        let (mut off, mut moved) = (0.0f64, 0.0f64);
        for _ in 0..2500 {
            rolling.solve(&control.torques(rolling.posture(), rolling.motion())).unwrap();
            coulomb.solve(&control.torques(coulomb.posture(), coulomb.motion())).unwrap();
            let expected = numbers(rolling.motion(), rolling.forces().iter().map(|force| force.normal_n));
            let touching = coulomb.contacts().iter().filter(|contact| contact.sticks);
            let got = numbers(coulomb.motion(), touching.map(|contact| contact.normal_n));
            assert_eq!(expected.len(), got.len(), "{name}");
            off = expected.iter().zip(&got).fold(off, |off, (a, b)| off.max((a - b).abs()));
            moved = moved.max((rolling.motion().position_m - control.start.position_m).norm());
            rolling.advance();
            coulomb.advance();
        }
        println!("{name}: off by {off:.1e}, after a way of {moved:.1e} m");
        assert!(off < 1e-9);
    }
}
