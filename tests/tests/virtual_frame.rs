//! The virtual frame `u_p + u_o`: against its potential, its wrench, its power, and the law that it is added to.

use blindgrasp_shared::control::frame::{Latch, SIGNALS};
use blindgrasp_shared::control::{Effect, FrameConfig, Held, Laws, LawsConfig, PerGain, Pose, Stance};
use blindgrasp_shared::hand::{Hand, Posture, Turn};
use blindgrasp_tests::cases::{Case, FINGERS, JOINTS, Torques, cases};
use blindgrasp_tests::numeric::{Errors, derivative};
use nalgebra::Vector3;

const GAINS: [f64; 2] = [300.0, 0.3];
const STILL: Torques = [0.0; JOINTS];

/// The frame's law on a random hand of three to five fingers that has moved a little since its latch, with a target.
struct Frames {
    case: Case,
    laws: Laws<f64, JOINTS>,
    latch: Latch<f64, JOINTS, FINGERS>,
    target: Pose<f64>,
}

/// So many of them. Fingertips of random hands that are nearly on a line are left out: about it nothing is turned.
fn frames(seed: u64, count: usize) -> impl Iterator<Item = Frames> {
    cases(seed, 4 * count)
        .filter(|case| case.hand.fingertip_count() >= 3)
        .map(Frames::of)
        .filter(Frames::is_wide)
        .take(count)
}

impl Frames {
    fn of(mut case: Case) -> Self {
        for (angle, latched) in case.angles.iter_mut().zip(&case.latched) {
            *angle = latched + 0.15 * (*angle - latched);
        }
        let config = LawsConfig {
            gains: PerGain { frame: GAINS, ..PerGain::all(0.0) },
            frame: FrameConfig { damping_s: 0.027, turn_damping_s: 0.01, reach_m: 0.015 },
            ..*case.law.config()
        };
        let laws = config.prepare(&case.hand).expect("good gains");
        let latch = case.latch().frame;
        let target = Pose { way_m: case.draw.vector(0.02), turn: Turn::by(&case.draw.vector(0.5)) };
        Self { case, laws, latch, target }
    }

    fn is_wide(&self) -> bool {
        let posture = self.case.posture(&self.case.latched);
        let count = self.case.hand.fingertip_count();
        let centres = &posture.centres_m[..count];
        let mean = centres.iter().sum::<Vector3<f64>>() / count as f64;
        let spread = centres
            .iter()
            .map(|centre| (centre - mean) * (centre - mean).transpose())
            .sum::<nalgebra::Matrix3<f64>>();
        let mut sizes = spread.symmetric_eigenvalues();
        sizes.as_mut_slice().sort_by(f64::total_cmp);
        sizes[1] > 0.05 * sizes[2]
    }

    fn held(&self, posture: &Posture<f64, JOINTS, FINGERS>) -> Held<f64, FINGERS> {
        Held {
            target: self.target,
            target_before: self.target,
            ..Held::at_latch(&self.case.hand, posture, &self.latch)
        }
    }

    /// The forces at the fingertips at some speeds, N, and the law's account.
    fn forces_n(
        &self,
        angles: &Torques,
        speeds: &Torques,
    ) -> (Vec<Vector3<f64>>, Effect<f64, 2, { SIGNALS.len() }>, Posture<f64, JOINTS, FINGERS>) {
        let (hand, posture) = (&self.case.hand, self.case.posture(angles));
        let held = self.held(&posture);
        let stance =
            Stance { hand, posture: &posture, angles_rad: angles, speeds_rad_s: speeds, held: &held };
        let (forces_n, effect) = self.laws.frame.forces_n(&stance, &GAINS);
        (forces_n[..hand.fingertip_count()].to_vec(), effect, posture)
    }

    fn torques(&self, forces_n: &[Vector3<f64>], posture: &Posture<f64, JOINTS, FINGERS>) -> Torques {
        let mut wrenches = [blindgrasp_shared::hand::Wrench::zero(); FINGERS];
        wrenches.iter_mut().zip(forces_n).for_each(|(wrench, force_n)| wrench.force_n = *force_n);
        self.case.hand.fingertip_torques(posture, &wrenches)
    }
}

/// Net force and moment about the mean of the fingertips' centres.
fn net(forces_n: &[Vector3<f64>], posture: &Posture<f64, JOINTS, FINGERS>) -> (Vector3<f64>, Vector3<f64>) {
    let centres = &posture.centres_m[..forces_n.len()];
    let mean = centres.iter().sum::<Vector3<f64>>() / forces_n.len() as f64;
    let moment = centres.iter().zip(forces_n).map(|(centre, force)| (centre - mean).cross(force)).sum();
    (forces_n.iter().sum(), moment)
}

/// Without speeds, the torques are the negative gradient of the two potentials, also where the fingertips have moved against each other.
/// Tolerance: central differences to fourth order of steps of 1e-4 rad, from potentials of a joule or so: rounding alone, 1e-11.
#[test]
fn it_is_the_negative_gradient_of_its_potentials() {
    let mut errors = Errors::new();
    for frames in frames(100, 200) {
        let angles = frames.case.angles;
        let (forces_n, _, posture) = frames.forces_n(&angles, &STILL);
        let torques = frames.torques(&forces_n, &posture);
        let scale = GAINS[0] * 0.015 * 0.2 + GAINS[1];
        for k in 0..frames.case.hand.joint_count() {
            let potential = |by: f64| {
                let mut angles = angles;
                angles[k] += by;
                frames.forces_n(&angles, &STILL).1.potentials_j.iter().sum::<f64>()
            };
            errors.add((torques[k] + derivative(1e-4, potential)) / scale);
        }
    }
    println!("u_p + u_o against the gradient of their potentials: {errors}");
    assert!(errors.largest() < 1e-9);
}

/// The forces sum to the pull, and have exactly the moment that turns the frame to its target; in the precision of the tick too.
/// Tolerances: the frame's rotation is sought to 1e-12 rad. In single precision, twenty roundings of forces of the same size, 6e-8
/// each, and some more where fingertips are nearly on a line.
#[test]
fn its_wrench_is_exact() {
    let (mut forces, mut moments, mut across) = (Errors::new(), Errors::new(), Errors::new());
    for frames in frames(200, 300) {
        let (forces_n, _, posture) = frames.forces_n(&frames.case.angles, &STILL);
        let (force, moment) = net(&forces_n, &posture);
        let pose = frames.held(&posture).frame.pose;
        let off = frames.target.way_m - pose.way_m;
        let pull = off * (GAINS[0] * (0.015 / off.norm()).min(1.0));
        let turn = pose.turn.inverse().then(&frames.target.turn).shorter().v * (2.0 * GAINS[1]);
        forces.add((force - pull).norm() / (GAINS[0] * 0.015));
        moments.add((moment - turn).norm() / GAINS[1]);
        // In single precision: alone the turn, so that the net force is to be zero.
        let hand: Hand<f32, JOINTS, FINGERS> = frames.case.hand.cast();
        let angles: [f32; JOINTS] = frames.case.angles.map(|angle| angle as f32);
        let latched: [f32; JOINTS] = frames.case.latched.map(|angle| angle as f32);
        let (mut posture, mut first) = (Posture::at_base(), Posture::at_base());
        hand.forward_kinematics(&angles, &mut posture);
        hand.forward_kinematics(&latched, &mut first);
        let laws = frames.laws.config();
        let config = LawsConfig {
            gains: laws.gains.map(|&gain| gain as f32),
            chosen: laws.chosen,
            attitude_error: laws.attitude_error,
            frame: FrameConfig { damping_s: 0.027, turn_damping_s: 0.01, reach_m: 0.015 },
            hold: blindgrasp_shared::control::Hold { damping_nm_s: [0.0; JOINTS], gravity_m_s2: None },
        };
        let laws = config.prepare(&hand).expect("good gains");
        let latch = blindgrasp_shared::control::Latch::of(&hand, &first, &latched).frame;
        let mut held = Held::at_latch(&hand, &posture, &latch);
        held.target.turn = Turn { w: frames.target.turn.w as f32, v: frames.target.turn.v.map(|v| v as f32) };
        let speeds_rad_s = &[0.0; JOINTS];
        let stance =
            Stance { hand: &hand, posture: &posture, angles_rad: &angles, speeds_rad_s, held: &held };
        let (forces_n, _) = laws.frame.forces_n(&stance, &[0.0, GAINS[1] as f32]);
        let forces_n: Vec<Vector3<f64>> =
            forces_n[..hand.fingertip_count()].iter().map(|f| f.map(f64::from)).collect();
        let mut exact = Posture::at_base();
        posture.centres_m.iter().zip(&mut exact.centres_m).for_each(|(from, to)| *to = from.map(f64::from));
        let (force, moment) = net(&forces_n, &exact);
        let along =
            held.frame.pose.turn.inverse().then(&held.target.turn).shorter().v.map(f64::from).normalize();
        let most = forces_n.iter().map(|force| force.norm()).fold(0.0, f64::max);
        across.add(force.norm() / most);
        across.add((moment - along * moment.dot(&along)).norm() / moment.norm());
    }
    println!("net force {forces}, moment {moments}; in f32 {across}");
    assert!(forces.largest() < 1e-14 && moments.largest() < 1e-11);
    assert!(across.largest() < 3e-6 && across.rms() < 1e-6);
}

/// What its damping takes is never negative, and is the power of the torques that speeds add.
#[test]
fn its_damping_takes_power() {
    let mut errors = Errors::new();
    for frames in frames(300, 200) {
        let (angles, speeds) = (frames.case.angles, frames.case.speeds);
        let (with, effect, posture) = frames.forces_n(&angles, &speeds);
        let (without, _, _) = frames.forces_n(&angles, &STILL);
        let added: Vec<Vector3<f64>> =
            with.iter().zip(&without).map(|(with, without)| with - without).collect();
        let power: f64 =
            frames.torques(&added, &posture).iter().zip(&speeds).map(|(torque, speed)| torque * speed).sum();
        assert!(effect.damping_w >= 0.0);
        errors.add((power + effect.damping_w) / (1.0 + effect.damping_w));
    }
    println!("power of the damping: {errors}");
    assert!(errors.largest() < 1e-12);
}
