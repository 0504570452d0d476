//! The grasp law `u = u_s + u_st` (Eqs. 29-34, with the desired attitudes of Eq. 59), and `u_I` of the law before it.
//!
//! - `u_s` (Eq. 30) draws the fingertip centres together: each is pulled towards their **centroid** like by a spring,
//!   the joints are damped, and the weight of the links is held. It presses the fingertips against whatever is
//!   between them.
//! - `u_st` (Eq. 32) holds the fingertips' **relative attitudes** as they were when the grasp began (the **latch**).
//!   A fingertip can't roll on a face without turning against its neighbours, so this supplies the tangential forces
//!   that the normal forces of `u_s` lack.
//! - `u_I` ([`integral`](super::integral)) is what an earlier law had in place of `u_st`; its gain is zero unless the two
//!   are to be compared.
//!
//! None of them knows the object. Each is the negative gradient of a potential (Eqs. 43 and 44). The forces and moments
//! that `u_s` and `u_st` put on the fingertips sum to zero, so that a trunk feels neither.
//!
//! How it is computed, and where that departs from the print:
//! - With `D_i = R_fi R_fi,ini^T`, the turn of fingertip `i` since the latch, the sum of three cross products in Eq. 32
//!   is the axial vector of `D_i D_j^T`. The law needs no fingertip frame of its own, only how it turns.
//! - The fingertips are a ring: the neighbours `i - 1` and `i + 1` of the print are taken modulo `N`. Each pair of
//!   neighbours is computed once, since what it does to one fingertip it does to the other with the opposite sign.
//!   Two fingertips are neighbours twice, as the print's sum has it.
//! - `V_st` has the constant `3 N K_st` added, so that it is zero at the latch and never negative: the energy is then
//!   bounded for every `K_st`, and the condition of Eq. 49 is a sizing rule only.

use super::integral::pull_back;
use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::hand::frame::{dot, product_transposed};
use crate::hand::{Hand, Posture, Wrench};
use crate::math::Real;
use crate::parameter::ParameterError;
use nalgebra::{Matrix3, Vector3};

/// Gains of the grasp law, as a user gives them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspConfig<T, const J: usize> {
    /// Nominal grasping force `f_d`, N. The force of a fingertip is not this but Eq. 57, and grows with the object's
    /// size.
    pub force_n: T,
    /// Stiffness `K_st` of the relative attitudes, N m; zero grasps by normal forces alone.
    pub attitude_stiffness_nm: T,
    /// Gain `K_I` of the earlier law's integral of each joint's velocity, N m/rad; zero leaves it out.
    pub integral_gain_nm_rad: T,
    /// Damping `C` of each joint, N m s/rad.
    pub damping_nm_s: [T; J],
    /// Gravity in the base frame, m/s^2; `None` leaves the weight of the links uncompensated.
    pub gravity_m_s2: Option<Vector3<T>>,
}

impl<T: Real, const J: usize> GraspConfig<T, J> {
    /// Checks the gains and prepares the law for a hand.
    ///
    /// # Errors
    /// The first gain that is not finite or negative.
    pub fn prepare<const F: usize>(&self, hand: &Hand<T, J, F>) -> Result<GraspLaw<T, J>, ParameterError> {
        let fail = |parameter, joint, reason| Err(ParameterError { parameter, joint, reason });
        let positive_or_zero = |v: T| v >= T::zero() && v.is_finite();
        if !positive_or_zero(self.force_n) {
            return fail("force_n", None, "has to be zero or positive");
        }
        if !positive_or_zero(self.attitude_stiffness_nm) {
            return fail("attitude_stiffness_nm", None, "has to be zero or positive");
        }
        if !positive_or_zero(self.integral_gain_nm_rad) {
            return fail("integral_gain_nm_rad", None, "has to be zero or positive");
        }
        let mut damping = self.damping_nm_s.iter().take(hand.joint_count());
        if let Some(joint) = damping.position(|&c| !positive_or_zero(c)) {
            return fail("damping_nm_s", Some(joint), "has to be zero or positive");
        }
        if self.gravity_m_s2.is_some_and(|g| !g.iter().all(|v| v.is_finite())) {
            return fail("gravity_m_s2", None, "has to be finite");
        }
        let radii = (0..hand.fingertip_count()).fold(T::zero(), |sum, i| sum + hand.radius_m(i));
        Ok(GraspLaw {
            gains: Gains {
                force_n: self.force_n,
                attitude_stiffness_nm: self.attitude_stiffness_nm,
                integral_gain_nm_rad: self.integral_gain_nm_rad,
            },
            per_radii_1_m: T::one() / radii,
            damping_nm_s: self.damping_nm_s,
            gravity_m_s2: self.gravity_m_s2,
            share_of_one: T::one() / T::from_i32(hand.fingertip_count() as i32),
        })
    }
}

/// How the hand stood when the grasp began: the fingertips' attitudes `R_fi,ini` (Eq. 59), and the joint angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latch<T, const J: usize, const F: usize> {
    attitudes: [Matrix3<T>; F],
    angles_rad: [T; J],
}

impl<T: Real, const J: usize, const F: usize> Latch<T, J, F> {
    /// Keeps a posture and the joint angles, rad, that lead to it.
    pub fn of(posture: &Posture<T, J, F>, angles_rad: &[T; J]) -> Self {
        Self { attitudes: posture.attitudes, angles_rad: *angles_rad }
    }
}

impl<const J: usize, const F: usize> Latch<f32, J, F> {
    pub(crate) fn save(
        &self,
        joints: usize,
        fingertips: usize,
        to: &mut Saver<'_>,
    ) -> Result<(), BufferTooSmall> {
        self.attitudes.iter().take(fingertips).try_for_each(|attitude| to.f32s(attitude.as_slice(), 9))?;
        to.f32s(&self.angles_rad, joints)
    }

    pub(crate) fn load(
        joints: usize,
        fingertips: usize,
        from: &mut Loader<'_>,
    ) -> Result<Self, SnapshotError> {
        let mut attitudes = [Matrix3::identity(); F];
        attitudes
            .iter_mut()
            .take(fingertips)
            .try_for_each(|attitude| from.f32s(attitude.as_mut_slice(), 9))?;
        let mut angles_rad = [0.0; J];
        from.f32s(&mut angles_rad, joints)?;
        Ok(Self { attitudes, angles_rad })
    }
}

/// How firmly the law grasps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains<T> {
    /// The force `f_d`, N; it begins small, so that the fingers do not hammer the object.
    pub force_n: T,
    /// The stiffness `K_st`, N m.
    pub attitude_stiffness_nm: T,
    /// The gain `K_I`, N m/rad.
    pub integral_gain_nm_rad: T,
}

impl<T: Real> Gains<T> {
    /// No grasp.
    pub fn none() -> Self {
        let zero = T::zero();
        Self { force_n: zero, attitude_stiffness_nm: zero, integral_gain_nm_rad: zero }
    }
}

/// A grasp, as it is in this tick.
#[derive(Clone, Copy, Debug)]
pub struct Grip<'a, T, const J: usize, const F: usize> {
    /// How the hand stood when it began.
    pub latch: &'a Latch<T, J, F>,
    /// The gains that act.
    pub gains: Gains<T>,
}

/// What the law knows about itself without seeing the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitor<T> {
    /// Potential `V_s` of the approach (Eq. 43), J.
    pub approach_potential_j: T,
    /// Potential `V_st` of the relative attitudes (Eq. 44) above its least value, J.
    pub attitude_potential_j: T,
    /// Potential `V_I` of the joints' turns since the latch, J.
    pub integral_potential_j: T,
    /// Potential energy of the links' weight that the law holds, above some level, J; zero where it holds none.
    pub weight_potential_j: T,
}

impl<T: Real> Monitor<T> {
    /// Nothing acts.
    pub fn none() -> Self {
        let zero = T::zero();
        Self {
            approach_potential_j: zero,
            attitude_potential_j: zero,
            integral_potential_j: zero,
            weight_potential_j: zero,
        }
    }
}

/// The grasp law, prepared for one hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspLaw<T, const J: usize> {
    /// In full.
    gains: Gains<T>,
    /// `1 / sum(r_i)`, 1/m.
    per_radii_1_m: T,
    /// `C`, N m s/rad.
    damping_nm_s: [T; J],
    gravity_m_s2: Option<Vector3<T>>,
    /// `1 / N`.
    share_of_one: T,
}

impl<T: Real, const J: usize> GraspLaw<T, J> {
    /// `A = f_d / sum(r_i)` (Eq. 38), N/m.
    pub fn approach_stiffness_n_m(&self) -> T {
        self.gains.force_n * self.per_radii_1_m
    }

    /// The gains, in full.
    pub fn gains(&self) -> &Gains<T> {
        &self.gains
    }

    /// `C` of each joint, N m s/rad.
    pub fn damping_nm_s(&self) -> &[T; J] {
        &self.damping_nm_s
    }

    /// The whole grip, as configured.
    pub fn grip<'a, const F: usize>(&self, latch: &'a Latch<T, J, F>) -> Grip<'a, T, J, F> {
        Grip { latch, gains: self.gains }
    }

    /// Power that the damping takes, `dq^T C dq`, W.
    pub fn damping_power_w(&self, speeds_rad_s: &[T; J]) -> T {
        let joints = self.damping_nm_s.iter().zip(speeds_rad_s);
        joints.fold(T::zero(), |sum, (damping, speed)| sum + *damping * *speed * *speed)
    }

    /// Joint torques `u` (Eq. 29, and `u_I`), N m, and what the law knows of itself. The posture is that of the angles,
    /// rad. Without a grip the joints are only damped and their weight held.
    pub fn torques<const F: usize>(
        &self,
        hand: &Hand<T, J, F>,
        posture: &Posture<T, J, F>,
        angles_rad: &[T; J],
        speeds_rad_s: &[T; J],
        grip: Option<Grip<'_, T, J, F>>,
    ) -> ([T; J], Monitor<T>) {
        let mut torques = core::array::from_fn(|k| -(self.damping_nm_s[k] * speeds_rad_s[k]));
        let mut monitor = Monitor::none();
        if let Some(Grip { latch, gains }) = grip {
            let (moments_nm, potential_j) = if gains.attitude_stiffness_nm > T::zero() {
                hold_attitudes(hand, posture, latch, gains.attitude_stiffness_nm)
            } else {
                ([Vector3::zeros(); F], T::zero())
            };
            monitor.attitude_potential_j = potential_j;
            let stiffness = gains.force_n * self.per_radii_1_m;
            let mut squares = T::zero();
            for (i, (away, moment_nm)) in self.centroid_offsets(hand, posture).zip(moments_nm).enumerate() {
                squares += dot(&away, &away);
                let wrench = Wrench { force_n: away * stiffness, moment_nm };
                hand.push_fingertip(posture, i, &wrench, &mut torques);
            }
            monitor.approach_potential_j = squares * stiffness * T::from_f64(0.5);
            if gains.integral_gain_nm_rad > T::zero() {
                monitor.integral_potential_j =
                    pull_back(gains.integral_gain_nm_rad, &latch.angles_rad, angles_rad, &mut torques);
            }
        }
        if let Some(gravity) = &self.gravity_m_s2 {
            monitor.weight_potential_j = hand.hold_weight(posture, gravity, &mut torques);
        }
        (torques, monitor)
    }

    /// The wrenches of `u_s` at full force, as if the law knew the fingertips' centres only: `A (x_c - x_i)` (Eq. 30).
    pub fn approach_wrenches<const F: usize>(
        &self,
        hand: &Hand<T, J, F>,
        posture: &Posture<T, J, F>,
    ) -> [Wrench<T>; F] {
        let mut wrenches = [Wrench::zero(); F];
        for (wrench, away) in wrenches.iter_mut().zip(self.centroid_offsets(hand, posture)) {
            wrench.force_n = away * self.approach_stiffness_n_m();
        }
        wrenches
    }

    /// The wrenches of `u_st` at full stiffness: `K_st B_sti` (Eq. 38).
    pub fn attitude_wrenches<const F: usize>(
        &self,
        hand: &Hand<T, J, F>,
        posture: &Posture<T, J, F>,
        latch: &Latch<T, J, F>,
    ) -> [Wrench<T>; F] {
        let (moments_nm, _) = hold_attitudes(hand, posture, latch, self.gains.attitude_stiffness_nm);
        moments_nm.map(|moment_nm| Wrench { force_n: Vector3::zeros(), moment_nm })
    }

    /// From the centre of each fingertip to the centroid (Eq. 31), m. The potential of Eq. 43 is `A / 2` times the sum of
    /// their squares.
    fn centroid_offsets<'a, const F: usize>(
        &self,
        hand: &Hand<T, J, F>,
        posture: &'a Posture<T, J, F>,
    ) -> impl Iterator<Item = Vector3<T>> + use<'a, T, J, F> {
        let centres = posture.centres_m.iter().take(hand.fingertip_count());
        let centroid = centres.clone().fold(Vector3::zeros(), |sum, centre| sum + centre) * self.share_of_one;
        centres.map(move |centre| centroid - centre)
    }
}

/// The moments that hold the relative attitudes (Eq. 32), N m, and their potential (Eq. 44, above its least value), J.
fn hold_attitudes<T: Real, const J: usize, const F: usize>(
    hand: &Hand<T, J, F>,
    posture: &Posture<T, J, F>,
    latch: &Latch<T, J, F>,
    stiffness_nm: T,
) -> ([Vector3<T>; F], T) {
    // How far each fingertip turned since the latch, D_i.
    let turns: [Matrix3<T>; F] =
        core::array::from_fn(|i| product_transposed(&posture.attitudes[i], &latch.attitudes[i]));
    let mut missing_traces = T::zero();
    // What one fingertip feels from its neighbour; the neighbour feels the opposite.
    let mut pull = |from: &Matrix3<T>, towards: &Matrix3<T>| {
        let (axial, trace) = axial_and_trace(from, towards);
        missing_traces += T::from_i32(3) - trace;
        axial * stiffness_nm
    };
    let count = hand.fingertip_count();
    let around = match (turns.first(), turns.get(count.wrapping_sub(1))) {
        (Some(first), Some(last)) => pull(last, first),
        _ => Vector3::zeros(),
    };
    let mut behind = around;
    let moments_nm = core::array::from_fn(|i| {
        if i >= count {
            return Vector3::zeros();
        }
        let ahead = match turns.get(i + 1) {
            Some(next) if i + 1 < count => pull(&turns[i], next),
            _ => around,
        };
        let moment = ahead - behind;
        behind = ahead;
        moment
    });
    (moments_nm, missing_traces * stiffness_nm)
}

/// Axial vector and trace of `a b^T`: the sum of the cross products of the columns of `a` with those of `b`, and the
/// sum of their dot products. Only the entries that these need are formed.
fn axial_and_trace<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> (Vector3<T>, T) {
    let entry = |row: usize, column: usize| {
        a[(row, 0)] * b[(column, 0)] + a[(row, 1)] * b[(column, 1)] + a[(row, 2)] * b[(column, 2)]
    };
    let axial = Vector3::new(entry(1, 2) - entry(2, 1), entry(2, 0) - entry(0, 2), entry(0, 1) - entry(1, 0));
    (axial, entry(0, 0) + entry(1, 1) + entry(2, 2))
}
