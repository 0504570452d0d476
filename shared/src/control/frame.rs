//! The virtual frame `u_p + u_o` (the position and attitude controller of the paper's reference 17, after its reference 14):
//! what makes fingertips that grasp a hand that holds still, and moves what it holds.
//!
//! The fingertips' centres have a **frame**: its origin is their mean `x_v`; its attitude `R_v` is the rotation that best takes
//! their offsets from it at the latch, `d_i(0)`, to those now, `d_i`. That is the rotation for which `H = sum(d_i e_i^T)`,
//! `e_i = R_v d_i(0)`, is symmetric.
//!
//! - `u_p` pulls the frame's origin to a target: a force `K_p (x_d - x_v) - D_p dx_v`, a share `1/N` at each fingertip. Its
//!   potential is that of a spring whose pull stops to grow at a distance, the reach.
//! - `u_o` turns the frame to the target's attitude: a moment `m`, the negative gradient of `4 K_o (1 - cos(a/2))` of the angle
//!   `a` that is left, less `D_o w_v`. It is spread over the fingertips as forces `f_i = (A^-1 m) x e_i`, `A = tr H 1 - H`:
//!   their sum is zero, their moment exactly `m`, and they are the exact gradient also once fingertips have rolled.
//!   `w_v = A^-1 sum(e_i x dx_i)` is the transpose of that, so that the damping takes power, whatever the motion.
//!
//! Fingertips on one line (two of them always are) can't be seen to turn about it, and are left alone there.
//!
//! The sum of `u_p` acts on all joints, so that an arm moves with the hand. Both are added to `u_s + u_st`, whose wrenches sum
//! to zero: each leaves the other alone. Departing from the references, the error of the attitude is that of half the angle,
//! which grows up to half a turn, and the damping is a time, by which it follows its stiffness up and down.

use super::{Effect, Gain, Law, LawsConfig, Ramp, Signal, Stance};
use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::hand::frame::{cross, dot};
use crate::hand::{Hand, Posture, Turn, Wrench};
use crate::math::Real;
use crate::parameter::ParameterError;
use nalgebra::{Matrix3, Vector3};

/// `K_p` and `K_o`.
pub const GAINS: [Gain; 2] = [
    Gain {
        key: "frame_stiffness_n_m",
        unit: "N/m",
        words: "Stiffness K_p with which the fingertips' common place is held; zero lets it go",
        may_be_zero: true,
        ramp: Ramp::Force,
        potential: Signal {
            key: "frame_potential_j",
            unit: "J",
            words: "Potential of the common place's distance from its target",
        },
    },
    Gain {
        key: "frame_turn_stiffness_nm",
        unit: "N m",
        words: "Stiffness K_o with which the fingertips' common attitude is held; zero lets it go",
        may_be_zero: true,
        ramp: Ramp::Force,
        potential: Signal {
            key: "frame_turn_potential_j",
            unit: "J",
            words: "Potential of the common attitude's angle from its target",
        },
    },
];

/// The object's place and attitude since the latch, as the rolling fingertips tell them.
pub const SIGNALS: [Signal; 6] = {
    const fn place(key: &'static str, words: &'static str) -> Signal {
        Signal { key, unit: "m", words }
    }
    const fn turn(key: &'static str, words: &'static str) -> Signal {
        Signal { key, unit: "", words }
    }
    [
        place("object_x_m", "Way of what is held since the grasp began, as the fingertips tell it, along x"),
        place("object_y_m", "The same, along y"),
        place("object_z_m", "The same, along z"),
        turn("object_turn_x", "Turn of what is held since then: axis times sine of half the angle, x"),
        turn("object_turn_y", "The same, y"),
        turn("object_turn_z", "The same, z"),
    ]
};

/// Damping and reach, as a user gives them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameConfig<T> {
    /// Damping `D_p` over stiffness `K_p`, s.
    pub damping_s: T,
    /// Damping `D_o` over stiffness `K_o`, s.
    pub turn_damping_s: T,
    /// Distance from the target beyond which the pull no longer grows, m.
    pub reach_m: T,
}

impl<T: Real> FrameConfig<T> {
    /// No damping, and a pull that grows up to a metre.
    pub fn least() -> Self {
        Self { damping_s: T::zero(), turn_damping_s: T::zero(), reach_m: T::one() }
    }

    pub(super) fn check(&self) -> Result<(), ParameterError> {
        let fails = |parameter: &'static str, reason| {
            Err(ParameterError { parameter: parameter.into(), joint: None, reason })
        };
        let is_time = |time: T| time >= T::zero() && time.is_finite();
        if !is_time(self.damping_s) {
            return fails("frame_damping_s", "has to be zero or positive");
        }
        if !is_time(self.turn_damping_s) {
            return fails("frame_turn_damping_s", "has to be zero or positive");
        }
        if !(self.reach_m > T::zero() && self.reach_m.is_finite()) {
            return fails("frame_reach_m", "has to be positive");
        }
        Ok(())
    }
}

/// A pose of the frame, since the latch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<T> {
    /// Way of its origin, m.
    pub way_m: Vector3<T>,
    /// Its rotation.
    pub turn: Turn<T>,
}

impl<T: Real> Pose<T> {
    /// Returns the pose at the latch.
    pub fn latched() -> Self {
        Self { way_m: Vector3::zeros(), turn: Turn::none() }
    }
}

/// The frame of the fingertips, as it is seen in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<T, const F: usize> {
    /// Its pose since the latch.
    pub pose: Pose<T>,
    /// Offsets at the latch, turned with it: `e_i`, m.
    arms_m: [Vector3<T>; F],
    /// `A^-1`, 1/m^2.
    spread_1_m2: Matrix3<T>,
    share_of_one: T,
}

impl<T: Real, const F: usize> Frame<T, F> {
    /// Returns the frame of fingertips that stand like this, from a rotation that is nearly theirs: one step of Newton's
    /// method, which squares what is left of the error.
    pub fn seen<const J: usize, const K: usize>(
        hand: &Hand<T, J, F>,
        points_m: &[Vector3<T>; F],
        latch: &Latch<T, K, F>,
        nearly: &Turn<T>,
    ) -> Self {
        let count = hand.fingertip_count();
        let share_of_one = T::one() / T::from_i32(count as i32);
        let (pose, spread_1_m2) = pose_of(points_m, latch, nearly, count, share_of_one);
        let mut arms_m = latch.arms_m;
        for arm in arms_m.iter_mut().take(count) {
            *arm = pose.turn.turn(arm);
        }
        Self { pose, arms_m, spread_1_m2, share_of_one }
    }

    /// Returns the forces at the fingertips that make up a force and a moment about the frame's origin, N.
    fn spread_out(&self, force_n: &Vector3<T>, moment_nm: &Vector3<T>) -> [Vector3<T>; F] {
        let (share, turn) = (force_n * self.share_of_one, times(&self.spread_1_m2, moment_nm));
        self.arms_m.map(|arm| share + cross(&turn, &arm))
    }

    /// Returns velocity, m/s, and angular velocity, rad/s, of the frame, by those of the fingertips' centres.
    fn velocity(&self, velocities_m_s: &[Vector3<T>; F], count: usize) -> (Vector3<T>, Vector3<T>) {
        let (mut sum, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for (velocity, arm) in velocities_m_s.iter().zip(&self.arms_m).take(count) {
            sum += velocity;
            moment += cross(arm, velocity);
        }
        (sum * self.share_of_one, times(&self.spread_1_m2, &moment))
    }
}

/// Returns the pose of points since the latch, from a rotation that is nearly theirs, and `A^-1`, 1/m^2.
// Not inlined: it is called for the fingertips' centres, and for the points where they touched.
#[inline(never)]
pub(crate) fn pose_of<T: Real, const K: usize, const F: usize>(
    points_m: &[Vector3<T>; F],
    latch: &Latch<T, K, F>,
    nearly: &Turn<T>,
    count: usize,
    share_of_one: T,
) -> (Pose<T>, Matrix3<T>) {
    let centroid = centroid_m(points_m, count, share_of_one);
    let mut h = Matrix3::zeros();
    let mut off = Vector3::zeros();
    for (point, latched) in points_m.iter().zip(&latch.arms_m).take(count) {
        let (offset, arm) = (point - centroid, nearly.turn(latched));
        off += cross(&arm, &offset);
        h += Matrix3::new(
            offset.x * arm.x,
            offset.x * arm.y,
            offset.x * arm.z,
            offset.y * arm.x,
            offset.y * arm.y,
            offset.y * arm.z,
            offset.z * arm.x,
            offset.z * arm.y,
            offset.z * arm.z,
        );
    }
    let spread_1_m2 = spread(&h);
    // A rotation that is off by more is of fingertips that came together: no step from there is small.
    let most = T::from_f64(0.1);
    let step = times(&spread_1_m2, &off).map(|v| v.limited(-most, most));
    (Pose { way_m: centroid - latch.centroid_m, turn: nearly.nudged(&step) }, spread_1_m2)
}

/// Returns the mean of the first points, m.
fn centroid_m<T: Real, const F: usize>(
    points_m: &[Vector3<T>; F],
    count: usize,
    share_of_one: T,
) -> Vector3<T> {
    points_m.iter().take(count).fold(Vector3::zeros(), |sum, point| sum + point) * share_of_one
}

/// `m v`, by a symmetric matrix.
fn times<T: Real>(m: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    crate::hand::frame::turn_vector(m, v)
}

/// Returns `(tr H 1 - H)^-1` of the symmetric part of `H`, 1/m^2; zero for fingertips that are all in one place. For fingertips on
/// a line, about which nothing is spread, something is added to what can't be inverted.
fn spread<T: Real>(h: &Matrix3<T>) -> Matrix3<T> {
    let half = T::from_f64(0.5);
    let (xy, xz, yz) = ((h.m12 + h.m21) * half, (h.m13 + h.m31) * half, (h.m23 + h.m32) * half);
    let trace = h.m11 + h.m22 + h.m33;
    if !(trace > T::from_f64(1e-9)) {
        return Matrix3::zeros();
    }
    let (a, b, c) = (trace - h.m11, trace - h.m22, trace - h.m33);
    let determinant =
        |a: T, b: T, c: T| a * (b * c - yz * yz) - xy * (xy * c + yz * xz) - xz * (xy * yz + b * xz);
    let cube = trace * trace * trace;
    let short = T::from_f64(LINE) - determinant(a, b, c) / cube;
    let more = if short > T::zero() { short * trace } else { T::zero() };
    let (a, b, c) = (a + more, b + more, c + more);
    let per = T::one() / determinant(a, b, c);
    let (xx_, yy_, zz_) = (b * c - yz * yz, a * c - xz * xz, a * b - xy * xy);
    let (xy_, xz_, yz_) = (xy * c + xz * yz, xy * yz + b * xz, a * yz + xy * xz);
    Matrix3::new(xx_, xy_, xz_, xy_, yy_, yz_, xz_, yz_, zz_) * per
}

/// Determinant of `A` over the cube of its trace's half below which fingertips are on a line. Of an equilateral triangle it is
/// 0.25, of a line 0.
const LINE: f64 = 1e-3;

/// The fingertips when the grasp began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latch<T, const J: usize, const F: usize> {
    /// Their mean, m.
    pub(crate) centroid_m: Vector3<T>,
    /// From there to each, `d_i(0)`, m; zero beyond the hand's.
    pub(crate) arms_m: [Vector3<T>; F],
}

impl<T: Real, const J: usize, const F: usize> Latch<T, J, F> {
    /// Returns that of points that stand like this.
    pub(crate) fn of_points(points_m: &[Vector3<T>; F], count: usize) -> Self {
        let centroid_m = centroid_m(points_m, count, T::one() / T::from_i32(count.max(1) as i32));
        let mut arms_m = [Vector3::zeros(); F];
        for (arm, point) in arms_m.iter_mut().zip(points_m).take(count) {
            *arm = point - centroid_m;
        }
        Self { centroid_m, arms_m }
    }
}

impl<const J: usize, const F: usize> Latch<f32, J, F> {
    pub(super) fn save(
        &self,
        _joints: usize,
        fingertips: usize,
        to: &mut Saver<'_>,
    ) -> Result<(), BufferTooSmall> {
        to.f32s(self.centroid_m.as_slice(), 3)?;
        self.arms_m.iter().take(fingertips).try_for_each(|arm| to.f32s(arm.as_slice(), 3))
    }

    pub(super) fn load(
        _joints: usize,
        fingertips: usize,
        from: &mut Loader<'_>,
    ) -> Result<Self, SnapshotError> {
        let (mut centroid_m, mut arms_m) = (Vector3::zeros(), [Vector3::zeros(); F]);
        from.f32s(centroid_m.as_mut_slice(), 3)?;
        arms_m.iter_mut().take(fingertips).try_for_each(|arm| from.f32s(arm.as_mut_slice(), 3))?;
        Ok(Self { centroid_m, arms_m })
    }
}

/// The virtual frame's law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameLaw<T> {
    config: FrameConfig<T>,
    /// As many as the hand has.
    fingertip_count: usize,
}

impl<T: Real> FrameLaw<T> {
    /// Returns force, N, and moment, N m, that pull the frame to a target, and their potentials, J.
    fn pull(&self, error: &Pose<T>, gains: &[T; 2]) -> (Vector3<T>, Vector3<T>, [T; 2]) {
        let &[stiffness_n_m, turn_stiffness_nm] = gains;
        let half = T::from_f64(0.5);
        let square = dot(&error.way_m, &error.way_m);
        let reach = self.config.reach_m;
        let (per_way, potential_j) = if square <= reach * reach {
            (stiffness_n_m, square * stiffness_n_m * half)
        } else {
            let far = square.square_root();
            (stiffness_n_m * reach / far, stiffness_n_m * reach * (far - reach * half))
        };
        let two = T::from_i32(2);
        let turn = error.turn.shorter();
        // 1 - w, without the difference.
        let missing = dot(&turn.v, &turn.v) / (T::one() + turn.w);
        let turn_potential_j = turn_stiffness_nm * missing * T::from_i32(4);
        (error.way_m * per_way, turn.v * (turn_stiffness_nm * two), [potential_j, turn_potential_j])
    }
}

impl<T: Real, const J: usize, const F: usize> Law<T, J, F, 2, 6> for FrameLaw<T> {
    type Latch = Latch<T, J, F>;

    fn prepare(hand: &Hand<T, J, F>, config: &LawsConfig<T, J>) -> Self {
        Self { config: config.frame, fingertip_count: hand.fingertip_count() }
    }

    fn latch(hand: &Hand<T, J, F>, posture: &Posture<T, J, F>, _angles_rad: &[T; J]) -> Latch<T, J, F> {
        Latch::of_points(&posture.centres_m, hand.fingertip_count())
    }

    #[inline(never)]
    fn torques(
        &self,
        stance: &Stance<'_, T, J, F>,
        _latch: &Latch<T, J, F>,
        gains: &[T; 2],
        torques_nm: &mut [T; J],
    ) -> Effect<T, 2, 6> {
        let &Stance { hand, posture, .. } = stance;
        let (forces_n, effect) = self.forces_n(stance, gains);
        let fingertips = hand.prepared_fingertips().iter().zip(&posture.centres_m);
        for ((fingertip, centre), force_n) in fingertips.zip(forces_n) {
            let wrench = Wrench { force_n, moment_nm: Vector3::zeros() };
            hand.push(posture, fingertip.link, centre, &wrench, torques_nm);
        }
        effect
    }
}

impl<T: Real> FrameLaw<T> {
    /// Returns the forces at the fingertips' centres, N, and what the law knows of itself.
    pub fn forces_n<const J: usize, const F: usize>(
        &self,
        stance: &Stance<'_, T, J, F>,
        gains: &[T; 2],
    ) -> ([Vector3<T>; F], Effect<T, 2, 6>) {
        let &Stance { hand, posture, speeds_rad_s, held, .. } = stance;
        let frame = &held.frame;
        let count = self.fingertip_count;
        let off = |target: &Pose<T>| Pose {
            way_m: target.way_m - frame.pose.way_m,
            turn: frame.pose.turn.inverse().then(&target.turn),
        };
        let (pull_n, turn_nm, potentials_j) = self.pull(&off(&held.target), gains);
        let before_j = if held.target == held.target_before {
            potentials_j
        } else {
            self.pull(&off(&held.target_before), gains).2
        };
        let velocities_m_s = hand.fingertip_velocities(posture, speeds_rad_s);
        let (velocity, turning) = frame.velocity(&velocities_m_s, count);
        let damping = [gains[0] * self.config.damping_s, gains[1] * self.config.turn_damping_s];
        let damping_w = dot(&velocity, &velocity) * damping[0] + dot(&turning, &turning) * damping[1];
        let forces_n = frame.spread_out(&(pull_n - velocity * damping[0]), &(turn_nm - turning * damping[1]));
        let Pose { way_m, turn } = held.object;
        let effect = Effect {
            potentials_j,
            signals: [way_m.x, way_m.y, way_m.z, turn.v.x, turn.v.y, turn.v.z],
            damping_w,
            fed_j: potentials_j[0] - before_j[0] + potentials_j[1] - before_j[1],
        };
        (forces_n, effect)
    }
}

/// The frame of the fingertips and its target, as a law sees them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held<T, const F: usize> {
    /// The frame.
    pub frame: Frame<T, F>,
    /// The object's pose since the latch, as the rolling fingertips tell it.
    pub object: Pose<T>,
    /// Its target.
    pub target: Pose<T>,
    /// The target of the tick before: what changed since was not done by the joints.
    pub target_before: Pose<T>,
}

impl<T: Real, const F: usize> Held<T, F> {
    /// Returns that of a hand that holds nothing.
    pub fn nothing() -> Self {
        let latched = Pose::latched();
        let frame = Frame {
            pose: latched,
            arms_m: [Vector3::zeros(); F],
            spread_1_m2: Matrix3::zeros(),
            share_of_one: T::zero(),
        };
        Self { frame, object: latched, target: latched, target_before: latched }
    }

    /// Returns a frame that is to stay at the latch, seen in a posture: to convergence, from the latch's attitude. For
    /// those who look at a posture without the ticks before it.
    pub fn at_latch<const J: usize>(
        hand: &Hand<T, J, F>,
        posture: &Posture<T, J, F>,
        latch: &Latch<T, J, F>,
    ) -> Self {
        let mut turn = Turn::none();
        let mut frame = Frame::seen(hand, &posture.centres_m, latch, &turn);
        for _ in 0..50 {
            let change = frame.pose.turn.v - turn.v;
            if dot(&change, &change) < T::from_f64(1e-24) {
                break;
            }
            turn = frame.pose.turn;
            frame = Frame::seen(hand, &posture.centres_m, latch, &turn);
        }
        Self { frame, ..Self::nothing() }
    }
}
