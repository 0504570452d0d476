//! Random hands with the grasp law, and the paper's potentials as they are printed.

use crate::description::{Description, Placed};
use crate::numeric::derivative;
use crate::random::Draw;
use blindgrasp_shared::control::{
    Account, AttitudeError, Chosen, FrameConfig, Grip, Held, Hold, Latch, Laws, LawsConfig, PerGain, Stance,
};
use blindgrasp_shared::hand::{Hand, Posture, Wrench};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Capacity for joints.
pub const JOINTS: usize = 30;
/// Capacity for fingertips.
pub const FINGERS: usize = 5;
/// Nominal grasping force `f_d`, N.
pub const FORCE_N: f64 = 5.0;
/// Stiffness `K_st` of the attitudes, N m.
pub const K_ST_NM: f64 = 0.3;
/// Gain `K_I` of the earlier law, N m/rad, where it is asked for.
pub const K_I_NM_RAD: f64 = 0.2;

/// A random hand.
pub type RandomHand = Hand<f64, JOINTS, FINGERS>;
/// A value a joint: torques, N m, angles, rad, speeds, rad/s.
pub type Torques = [f64; JOINTS];

/// A random hand somewhere after its latch, with the law prepared for it.
pub struct Case {
    /// More random numbers.
    pub draw: Draw,
    /// The hand in the user's frames.
    pub description: Description,
    /// The hand.
    pub hand: RandomHand,
    /// The paper's law: without `u_I`.
    pub law: Laws<f64, JOINTS>,
    /// Damping of the joints, N m s/rad.
    pub damping: Torques,
    /// Gravity, m/s^2.
    pub gravity: Vector3<f64>,
    /// Joint angles, rad.
    pub angles: Torques,
    /// Joint speeds, rad/s.
    pub speeds: Torques,
    /// Joint angles when the grasp began, rad.
    pub latched: Torques,
}

/// So many cases, of which every other hand has a trunk.
pub fn cases(seed: u64, count: usize) -> impl Iterator<Item = Case> {
    let mut draw = Draw::new(seed);
    (0..count).map(move |k| Case::of(draw.hand(k % 2 == 0), Draw::new(seed + 1 + k as u64)))
}

impl Case {
    /// A hand with random angles, speeds, damping and gravity.
    pub fn of(description: Description, mut draw: Draw) -> Self {
        let hand: RandomHand = description.hand();
        let latched = draw.joints::<JOINTS>(2.0);
        let moved = draw.joints::<JOINTS>(0.7);
        let damping = draw.joints::<JOINTS>(0.1).map(f64::abs);
        let gravity = draw.vector(9.81);
        let law = law(&hand, K_ST_NM, &damping, &gravity);
        Self {
            angles: std::array::from_fn(|k| latched[k] + moved[k]),
            speeds: draw.joints(2.0),
            latched,
            damping,
            gravity,
            law,
            hand,
            description,
            draw,
        }
    }

    /// Returns the same with another form of the attitude error.
    #[must_use]
    pub fn with_attitude_error(self, attitude_error: AttitudeError) -> Self {
        let config = LawsConfig { attitude_error, ..*self.law.config() };
        Self { law: config.prepare(&self.hand).expect("the gains are good"), ..self }
    }

    /// Returns the posture for some angles, rad.
    pub fn posture(&self, angles: &Torques) -> Posture<f64, JOINTS, FINGERS> {
        let mut posture = Posture::at_base();
        self.hand.forward_kinematics(angles, &mut posture);
        posture
    }

    /// Returns the laws' memory of the beginning of the grasp.
    pub fn latch(&self) -> Latch<f64, JOINTS, FINGERS> {
        Latch::of(&self.hand, &self.posture(&self.latched), &self.latched)
    }

    /// Returns the result of the law at some speeds, rad/s, with some gains.
    pub fn with_gains(&self, speeds: &Torques, gains: PerGain<f64>) -> (Torques, Account<f64>) {
        self.with_grip(&self.angles, speeds, Some(&Grip { latch: &self.latch(), gains }))
    }

    /// Returns the result of the law at some angles, rad, and speeds, rad/s, in some grip.
    pub fn with_grip(
        &self,
        angles: &Torques,
        speeds: &Torques,
        grip: Option<&Grip<'_, f64, JOINTS, FINGERS>>,
    ) -> (Torques, Account<f64>) {
        let posture = self.posture(angles);
        let held = Held::nothing();
        let stance = Stance {
            hand: &self.hand,
            posture: &posture,
            angles_rad: angles,
            speeds_rad_s: speeds,
            held: &held,
        };
        self.law.torques(&stance, grip)
    }

    /// The wrenches of `u_s` at full force.
    pub fn approach_wrenches(&self, posture: &Posture<f64, JOINTS, FINGERS>) -> [Wrench<f64>; FINGERS] {
        self.law.grasp.approach_wrenches(&self.hand, posture, FORCE_N)
    }

    /// The wrenches of `u_st` at full stiffness.
    pub fn attitude_wrenches(
        &self,
        posture: &Posture<f64, JOINTS, FINGERS>,
        latch: &Latch<f64, JOINTS, FINGERS>,
    ) -> [Wrench<f64>; FINGERS] {
        self.law.grasp.attitude_wrenches(&self.hand, posture, &latch.grasp, K_ST_NM)
    }

    /// Returns the law's own account.
    pub fn monitor(&self) -> Account<f64> {
        self.with_gains(&self.speeds, self.law.gains()).1
    }

    /// Torques at some speeds, with shares of the force and of the attitudes' stiffness.
    pub fn torques(&self, speeds: &Torques, shares: (f64, f64)) -> Torques {
        let [force_n, attitude_stiffness_nm] = self.law.gains().grasp;
        let grasp = [force_n * shares.0, attitude_stiffness_nm * shares.1];
        let gains = PerGain { grasp, ..PerGain::all(0.0) };
        self.with_gains(speeds, gains).0
    }

    /// A potential's gradient along each joint, by differences.
    ///
    /// A fingertip's centre and attitude are first-degree in the sine and cosine of one joint, the potentials
    /// second-degree: truncation is at most `2^5 step^4 / 480` = 1e-12 of them, rounding 1e-16 / step = 5e-14.
    pub fn gradient(&self, potential: impl Fn(&Placed) -> f64) -> Vec<f64> {
        let at = |k: usize, by: f64| {
            let mut angles = self.angles;
            angles[k] += by;
            potential(&self.description.placed(&angles))
        };
        (0..self.hand.joint_count()).map(|k| derivative(1.0 / 512.0, |by| at(k, by))).collect()
    }

    /// Fingertip attitudes in frames of the test's own choice: the description's link frames, turned by constants.
    pub fn tip_frames(&self, offsets: &[Matrix3<f64>], angles: &Torques) -> Vec<Matrix3<f64>> {
        self.frames_of(offsets, &self.description.placed(angles))
    }

    /// The same of a hand that is placed.
    pub fn frames_of(&self, offsets: &[Matrix3<f64>], placed: &Placed) -> Vec<Matrix3<f64>> {
        let tips = self.description.fingertips.iter().zip(offsets);
        tips.map(|(tip, offset)| placed.attitudes[tip.link] * offset).collect()
    }

    /// Constants to turn each fingertip's frame by.
    pub fn offsets(&mut self) -> Vec<Matrix3<f64>> {
        self.description.fingertips.iter().map(|_| self.draw.rotation()).collect()
    }

    /// `V_s` as printed in Eq. 43.
    pub fn approach_potential(&self, placed: &Placed) -> f64 {
        let centres = &placed.centres_m;
        let mut sum = 0.0;
        for a in centres {
            for b in centres {
                sum += (a - b).norm_squared();
            }
        }
        self.stiffness() / (4.0 * centres.len() as f64) * sum
    }

    /// `V_st` as printed in Eq. 44, with the relative attitudes of Eq. 59.
    pub fn attitude_potential(&self, now: &[Matrix3<f64>], then: &[Matrix3<f64>]) -> f64 {
        let n = now.len();
        let mut sum = 0.0;
        for i in 0..n {
            let j = (i + 1) % n;
            let relative = then[j].transpose() * then[i];
            sum += (now[i].transpose() * now[j] * relative).trace();
        }
        -K_ST_NM * sum
    }

    /// `cos(a/2)` of the turns `a` of neighbouring fingertips against each other since the latch, by their unit quaternions.
    pub fn half_angle_cosines(now: &[Matrix3<f64>], then: &[Matrix3<f64>]) -> Vec<f64> {
        let turn = |i: usize| now[i] * then[i].transpose();
        let between = |i: usize| turn(i) * turn((i + 1) % now.len()).transpose();
        let quaternion =
            |matrix| UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
        (0..now.len()).map(|i| quaternion(between(i)).w.abs()).collect()
    }

    /// The potential of the attitude error's form that takes half of the angle, by unit quaternions.
    pub fn half_angle_potential(now: &[Matrix3<f64>], then: &[Matrix3<f64>]) -> f64 {
        Self::half_angle_cosines(now, then).iter().map(|cosine| 8.0 * K_ST_NM * (1.0 - cosine)).sum()
    }

    /// `A = f_d / sum(r)`.
    pub fn stiffness(&self) -> f64 {
        FORCE_N / self.description.fingertips.iter().map(|tip| tip.radius_m).sum::<f64>()
    }

    /// The most that the approach could put on a joint, N m: every fingertip's force at the end of the longest lever.
    pub fn approach_scale(&self) -> f64 {
        let reach = (0..self.hand.fingertip_count()).map(|i| self.description.reach_m(i)).fold(0.0, f64::max);
        let forces = self.approach_wrenches(&self.posture(&self.angles));
        reach * forces.iter().map(|wrench| wrench.force_n.norm()).sum::<f64>()
    }

    /// The most that the links could weigh on a joint, N m.
    pub fn weight_scale(&self) -> f64 {
        let reach = (0..self.hand.fingertip_count()).map(|i| self.description.reach_m(i)).fold(0.0, f64::max);
        self.description.joints.iter().map(|joint| joint.link.mass_kg).sum::<f64>()
            * self.gravity.norm()
            * reach
    }
}

/// The law with the gains above.
pub fn law(hand: &RandomHand, k_st: f64, damping: &Torques, gravity: &Vector3<f64>) -> Laws<f64, JOINTS> {
    let config = LawsConfig {
        frame: FrameConfig::least(),
        gains: PerGain { grasp: [FORCE_N, k_st], ..PerGain::all(0.0) },
        chosen: Chosen::ALL,
        attitude_error: AttitudeError::Sine,
        hold: Hold { damping_nm_s: *damping, gravity_m_s2: Some(*gravity) },
    };
    config.prepare(hand).expect("the gains are good")
}
