//! Gains, limits and friction that scale with the hand.

use super::super::super::check::Result;
use super::super::super::error::SceneError;
use super::super::super::file::HandFile;
use super::super::super::hand::{posture, still_joints};
use super::super::assembly::Assembly;
use super::TunedGains;
use super::fingertips::Tip;
use super::text::Draft;
use blindgrasp_body::dynamics::{Body, JointMatrix, mass_matrix, place_bodies};
use blindgrasp_body::{Hand, MAX_JOINTS};
use blindgrasp_shared::math::Real;
use nalgebra::{DMatrix, Vector3};

/// Attitude stiffness: `force * radius` divided by this. The paper has 5 N * 0.015 m / 0.005 N m (Tables IV, VII).
pub(super) const RADII: f64 = 15.0;
/// Part of the fingertip's radius that the force indents it by; 0.08 to 0.1 in the paper's experiments.
pub(super) const INDENTATION: f64 = 0.08;
/// Dry friction, as a share of the torque limit.
pub(super) const FRICTION_SHARE: f64 = 0.004;
/// A fingertip is made to press with at most so many times its finger's weight (4.4 in the paper's experiments), whatever the
/// torque limits say: many URDFs say too much.
pub(super) const WEIGHTS: f64 = 10.0;
/// The words on damping gains that are tuned.
pub(super) const TUNED_RULE: &str = "\
as `blindgrasp hand tune` says: so many inertias of the joint alone a second that the sampled\n\
#   loop about a nominal grasp of 2 g, without joint friction, bears the most additional delay, with the estimator's bandwidth above.";
/// The words on damping gains that are guessed, where no tuned ones are stable.
pub(super) const DAMPING_RULE: &str = "\
0.02 of the critical damping 2 sqrt(K H) of each joint alone. H is its inertia,
#   K = force_n / sum(radius_m) * (1 - 1/fingertips) * lever^2 the stiffness that the law gives it. A joint that moves several
#   fingertips, which no force of the grasp holds: H * 2/s. Both in the nominal posture.";
/// Least force with which a fingertip closes, N; and how far its spring then lags behind, m: with less than what overcomes dry friction
/// five times a finger hardly moves.
const CLOSING_N: f64 = 0.2;
pub(super) const CLOSING_LAG_M: f64 = 3.3e-3;
pub(super) const CLOSING_FRICTIONS: f64 = 5.0;
/// Way by which an object is off where the virtual frame pulls it with the force of the grasp, m: 600 N/m in the three-finger hand.
pub(super) const FRAME_WAY_M: f64 = 8e-3;
/// Distance of the fingertips from their centroid that its stiffness against turning is for, in their radii.
pub(super) const FRAME_RADII: f64 = 2.5;
/// Share of the weakest joint's torque that the force takes.
const FORCE_SHARE: f64 = 0.5;
/// Part of critical damping.
const DAMPING_RATIO: f64 = 0.02;
/// Rates of damping beyond which the sampled loop with its estimator is no damper any more, 1/s.
const FASTEST_DAMPING_HZ: f64 = 30.0;
/// Damping of what no force of the grasp holds, an arm: its speed falls by e in half a second.
const TRUNK_DAMPING_HZ: f64 = 2.0;
/// A joint that sticks is damped by this part of critical.
const STICKING_RATIO: f64 = 0.2;
/// Of the file's [joint_defaults].
const PRESLIDING_RAD: f64 = 2e-4;
/// Bandwidth of the estimator that is not tuned, Hz.
const BANDWIDTH_HZ: f64 = 50.0;
/// Speed limits that nobody knows, rad/s.
const SPEED_RAD_S: f64 = 10.0;
/// A joint whose axis is closer to the fingertip's centre only turns it, m.
const SHORTEST_LEVER_M: f64 = 1e-3;
const GRAVITY_M_S2: f64 = 9.81;

/// Numbers that hang on the whole hand.
pub(super) struct Gains {
    pub(super) force_n: f64,
    /// Index of the joint that decides about it.
    pub(super) weakest: usize,
    /// The force that this joint would allow, if it is far more than the finger weighs.
    pub(super) allowed_n: Option<f64>,
    pub(super) attitude_stiffness_nm: f64,
    /// Force with which a fingertip closes, N; none with an arm, of whose closing nothing is known.
    pub(super) closing_n: Option<f64>,
    /// Stiffnesses of the virtual frame, N/m and N m; none with an arm, and where the loop has no margin with them.
    pub(super) frame: Option<[f64; 2]>,
    pub(super) joints: Vec<JointGains>,
    /// Bandwidth of the estimator, Hz.
    pub(super) bandwidth_hz: f64,
    /// `true` if damping and bandwidth are tuned.
    pub(super) is_tuned: bool,
    pub(super) stiffnesses_n_m2: Vec<f64>,
}

/// Of a joint; those that the URDF knows are not used.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointGains {
    pub(super) damping_nm_s: f64,
    pub(super) torque_nm: f64,
    pub(super) speed_rad_s: f64,
    pub(super) coulomb_nm: f64,
    pub(super) viscous_nm_s: f64,
    pub(super) presliding_nm_s: f64,
}

/// Two digits are all that a guess is worth.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// Length of the finger that ends with a fingertip: from the first joint that moves this one only, stretched, m.
pub(super) fn finger_length_m(assembly: &Assembly, links: &[usize], carrier: usize, tip: &Tip) -> f64 {
    let chain = |from: usize| std::iter::successors(Some(from), |&k| assembly.joints[k].parent);
    let moved_by = |k: usize| {
        let carriers = links.iter().filter_map(|&link| assembly.seats[link].and_then(|seat| seat.joint));
        carriers.filter(|&carrier| chain(carrier).any(|joint| joint == k)).count()
    };
    let own: Vec<usize> = chain(carrier).take_while(|&k| moved_by(k) == 1).collect();
    let bones: f64 =
        own.iter().rev().skip(1).map(|&k| Vector3::from(assembly.joints[k].offset_m).norm()).sum();
    let frame = assembly.seats[tip.link].and_then(|seat| seat.frame);
    bones + frame.map_or(tip.offset_m, |frame| frame.point(&tip.offset_m)).norm()
}

impl Gains {
    /// Gains of which none matters.
    pub(super) fn preliminary(draft: &Draft<'_>) -> Self {
        let joint = JointGains {
            damping_nm_s: 1.0,
            torque_nm: 1.0,
            speed_rad_s: 1.0,
            coulomb_nm: 0.0,
            viscous_nm_s: 0.0,
            presliding_nm_s: 0.0,
        };
        Self {
            force_n: 1.0,
            weakest: 0,
            allowed_n: None,
            attitude_stiffness_nm: 1.0,
            closing_n: None,
            frame: None,
            joints: vec![joint; draft.needs.len()],
            bandwidth_hz: BANDWIDTH_HZ,
            is_tuned: false,
            stiffnesses_n_m2: vec![1e6; draft.tips.len()],
        }
    }

    /// Gains of a hand.
    pub(super) fn new(draft: &Draft<'_>, file: &HandFile, hand: &Hand) -> Result<Self> {
        let angles: Vec<f64> = draft.needs.iter().map(|needs| needs.nominal_rad).collect();
        if let Some(&k) = still_joints(hand, &angles).first() {
            let problem = format!("joint `{}` moves no mass", file.joints[k].name);
            let remedy = "give the links that it moves an <inertial> in the URDF";
            return Err(SceneError::new("", problem, remedy).at(&draft.joint(k).place));
        }
        let measures = Measures::new(draft, file, hand, &angles);
        let count = file.joints.len();
        let limits: Vec<f64> = (0..count)
            .map(|k| match draft.needs[k].torque {
                true => rounded(
                    2.0 * measures.weights_nm[k] + WEIGHTS * measures.finger_n * measures.reaches_m[k],
                ),
                false => file.joints[k].torque_limit_nm,
            })
            .collect();
        // What is left of a finger's torque when it holds itself, at the fingertip; arms feel nothing of a grasp.
        let pressing = |k: &usize| {
            let left = (limits[*k] - measures.weights_nm[*k]).max(0.1 * limits[*k]);
            left / measures.levers_m[*k]
        };
        let own = |k: &usize| (0..draft.tips.len()).filter(|&i| hand.moves(*k, i)).count() == 1;
        let presses = |k: &usize| own(k) && measures.levers_m[*k] > SHORTEST_LEVER_M;
        let Some(weakest) = (0..count).filter(presses).min_by(|a, b| pressing(a).total_cmp(&pressing(b)))
        else {
            let problem = "no joint of a finger moves its fingertip's centre";
            let remedy = "name the fingertips and where they are: --fingertip LINK:x,y,z";
            return Err(SceneError::new("", problem, remedy).at(&draft.robot.place));
        };
        let (allowed, most) = (FORCE_SHARE * pressing(&weakest), WEIGHTS * measures.finger_n);
        let force_n = rounded(allowed.min(most));
        let radii: f64 = draft.radii_m.iter().sum();
        let tips = draft.tips.len() as f64;
        let joints: Vec<JointGains> = (0..count)
            .map(|k| {
                let inertia = measures.inertias_kg_m2[k];
                let most = FASTEST_DAMPING_HZ * measures.alone_kg_m2[k];
                let damping = if own(&k) {
                    // Eq. 57's spring between the fingertips, at the lever of this one.
                    let lever = measures.levers_m[k];
                    let stiffness = force_n / radii * (1.0 - 1.0 / tips) * lever * lever;
                    2.0 * DAMPING_RATIO * (stiffness * inertia).square_root()
                } else {
                    TRUNK_DAMPING_HZ * inertia
                };
                let speed = if draft.needs[k].speed { SPEED_RAD_S } else { file.joints[k].speed_limit_rad_s };
                let coulomb = match draft.needs[k].friction {
                    true => rounded(FRICTION_SHARE * limits[k]),
                    false => file.joints[k].coulomb_friction_nm,
                };
                let stiction = coulomb / PRESLIDING_RAD * measures.alone_kg_m2[k];
                JointGains {
                    damping_nm_s: rounded(damping.min(most)),
                    torque_nm: limits[k],
                    speed_rad_s: speed,
                    coulomb_nm: coulomb,
                    viscous_nm_s: rounded(coulomb / speed),
                    presliding_nm_s: rounded(2.0 * STICKING_RATIO * stiction.square_root()),
                }
            })
            .collect();
        let stiffness = |radius: &f64| {
            let indentation = INDENTATION * radius;
            rounded(force_n / (indentation * indentation))
        };
        // The force at a fingertip from which on one of its finger's joints slides.
        let slides_n = |tip: usize| {
            let of_its_finger = (0..count).filter(|k| presses(k) && hand.moves(*k, tip));
            of_its_finger.map(|k| joints[k].coulomb_nm / measures.levers_m[k]).fold(f64::INFINITY, f64::min)
        };
        let slide_n = (0..draft.tips.len()).map(slides_n).filter(|n| n.is_finite()).fold(0.0, f64::max);
        let frame_n_m = rounded(force_n / FRAME_WAY_M);
        let arm_m = FRAME_RADII * radii / tips;
        let is_alone = (0..count).all(|k| own(&k));
        Ok(Self {
            force_n,
            closing_n: is_alone
                .then(|| rounded(f64::max(CLOSING_N, CLOSING_FRICTIONS * slide_n).min(0.5 * force_n))),
            frame: is_alone.then(|| [frame_n_m, rounded(frame_n_m * arm_m * arm_m)]),
            weakest,
            allowed_n: (allowed > most).then(|| rounded(allowed)),
            attitude_stiffness_nm: rounded(force_n * radii / tips / RADII),
            joints,
            bandwidth_hz: BANDWIDTH_HZ,
            is_tuned: false,
            stiffnesses_n_m2: draft.radii_m.iter().map(stiffness).collect(),
        })
    }
}

impl Gains {
    /// Takes gains that are tuned.
    pub(super) fn tune(&mut self, tuned: &TunedGains) {
        for (joint, damping_nm_s) in self.joints.iter_mut().zip(&tuned.damping_nm_s_rad) {
            joint.damping_nm_s = rounded(*damping_nm_s);
        }
        (self.bandwidth_hz, self.is_tuned) = (tuned.bandwidth_hz, true);
    }
}

/// The measures of a hand that the gains follow from. One a joint, if not said otherwise.
struct Measures {
    /// From the joint to the fingertip that it moves furthest, stretched, m.
    reaches_m: Vec<f64>,
    /// From its axis to that fingertip, in the nominal posture, m.
    levers_m: Vec<f64>,
    /// Torque of the weight of all that it moves, if all pulled the same way across its axis, in the nominal posture, N m.
    weights_nm: Vec<f64>,
    /// Inertia of all that it moves, in the nominal posture.
    inertias_kg_m2: Vec<f64>,
    /// The same while all other joints are loose.
    alone_kg_m2: Vec<f64>,
    /// Mean weight of a finger, N.
    finger_n: f64,
}

impl Measures {
    fn new(draft: &Draft<'_>, file: &HandFile, hand: &Hand, angles_rad: &[f64]) -> Self {
        let count = hand.joint_count();
        let here = posture(hand, angles_rad);
        let (mut reaches_m, mut levers_m, mut weights_nm) =
            (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        let chain = |from: usize| std::iter::successors(Some(from), |&k| hand.parent(k));
        let bone = |k: usize| Vector3::from(file.joints[k].offset_m).norm();
        for (i, tip) in file.fingertips.iter().enumerate() {
            let mut reach = Vector3::from(tip.offset_m).norm();
            for k in chain(draft.carrier(i)) {
                let pose = here.link(k);
                let lever = pose.axis().cross(&(here.centres_m[i] - pose.origin_m)).norm();
                reaches_m[k] = f64::max(reaches_m[k], reach);
                levers_m[k] = f64::max(levers_m[k], lever);
                reach += bone(k);
            }
        }
        for body in 0..count {
            let link = hand.link(body);
            let centre = here.link(body).point(&link.mass_centre_m);
            for k in chain(body) {
                let pose = here.link(k);
                let lever = pose.axis().cross(&(centre - pose.origin_m)).norm();
                weights_nm[k] += GRAVITY_M_S2 * link.mass_kg * lever;
            }
        }
        let mut bodies = [Body::NONE; MAX_JOINTS];
        let mut mass: JointMatrix = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        place_bodies(hand, &here, &mut bodies);
        mass_matrix(hand, &bodies, &mut mass);
        let mass = DMatrix::from_fn(count, count, |a, b| mass[a][b]);
        let inertias_kg_m2: Vec<f64> = mass.diagonal().iter().copied().collect();
        // Positive definite, as was checked.
        let alone_kg_m2 = match mass.try_inverse() {
            Some(inverse) => inverse.diagonal().iter().map(|entry| 1.0 / entry).collect(),
            None => inertias_kg_m2.clone(),
        };
        let tips = draft.tips.len();
        let is_own = |k: &usize| (0..tips).filter(|&i| hand.moves(*k, i)).count() == 1;
        let own_kg: f64 = (0..count).filter(is_own).map(|k| file.joints[k].mass_kg).sum();
        Self {
            reaches_m,
            levers_m,
            weights_nm,
            inertias_kg_m2,
            alone_kg_m2,
            finger_n: GRAVITY_M_S2 * own_kg / tips as f64,
        }
    }
}
