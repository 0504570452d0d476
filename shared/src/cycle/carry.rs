//! The object that is held: where it is, as the fingertips tell, and where it is to be.
//!
//! - **Fast**: the [virtual frame](crate::control::frame) of the fingertips' centres follows the target.
//! - **Slow**: fingertips roll, so that the object turns by more than the frame of centres. Points fixed in the fingertips where they
//!   touched (towards the centroid, at the latch) tell the object's pose, to a degree or so. They would make the fast loop unstable;
//!   a slow one turns the target until the *object* has turned by what was asked for.
//! - **Weight**: a bounded integral of the way that is left, of the object by the same points, shifts the target until it is where it
//!   is to be.
//! - **Weighing**: the target goes slowly up and down again. The work that the frame's pull does on the ways, over the height by which
//!   the *object* was lifted, is its weight: a fingertip that rolls lifts it by more than itself. What the joints' friction takes
//!   has the opposite sign on the other way, and the springs of the laws give back what they took.
//! - **Putting down**: the target sinks until the frame presses on something below, or to a stated depth below the latch's height.
//!   Then the target is where the frame is.

use super::path::{Path, largest};
use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::control::frame::{self, Frame};
use crate::control::{Held, Latch, Pose};
use crate::hand::frame::{dot, product_transposed, turn_vector};
use crate::hand::{Hand, Posture, Turn};
use crate::math::{Real, norm};
use crate::parameter::ParameterError;
use crate::period::Period;
use nalgebra::Vector3;

/// Numbers of carrying, as a user gives them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarryingConfig {
    /// Longest way from where the grasp began, m.
    pub reach_m: f32,
    /// Largest turn from the attitude in which it began, rad.
    pub reach_rad: f32,
    /// Largest speed of the target, m/s.
    pub speed_m_s: f32,
    /// Largest angular speed of the target, rad/s.
    pub speed_rad_s: f32,
    /// Most force that the integral may add, N.
    pub integral_n: f32,
    /// Rate at which the target follows what the fingertips tell of the object's turn, Hz; 0 leaves it alone.
    pub correction_hz: f32,
    /// Way that is left, along each axis, which both leave alone, m, and the turn that this is 40 mm away: where joints stick, they
    /// would wind up and let go again, for ever.
    pub still_m: f32,
    /// Speed at which an object is put down, m/s.
    pub put_down_m_s: f32,
    /// Depth below where the grasp began to which it is put down, m.
    pub put_down_m: f32,
    /// Force on what is below that is enough, N.
    pub put_down_n: f32,
}

impl CarryingConfig {
    /// Nothing is carried anywhere.
    pub const LEAST: Self = Self {
        reach_m: 0.0,
        reach_rad: 0.0,
        speed_m_s: 0.0,
        speed_rad_s: 0.0,
        integral_n: 0.0,
        correction_hz: 0.0,
        still_m: 0.0,
        put_down_m_s: 0.0,
        put_down_m: 0.0,
        put_down_n: 0.0,
    };

    pub(super) fn check(&self) -> Result<(), ParameterError> {
        let values = [
            ("carrying.reach_m", self.reach_m),
            ("carrying.reach_rad", self.reach_rad),
            ("carrying.speed_m_s", self.speed_m_s),
            ("carrying.speed_rad_s", self.speed_rad_s),
            ("carrying.integral_n", self.integral_n),
            ("carrying.correction_hz", self.correction_hz),
            ("carrying.still_m", self.still_m),
            ("carrying.put_down_m_s", self.put_down_m_s),
            ("carrying.put_down_m", self.put_down_m),
            ("carrying.put_down_n", self.put_down_n),
        ];
        match values.into_iter().find(|(_, value)| !(*value >= 0.0 && value.is_finite())) {
            Some((parameter, _)) => {
                let reason = "has to be zero or positive";
                Err(ParameterError { parameter: parameter.into(), joint: None, reason })
            }
            None => Ok(()),
        }
    }
}

/// Rate at which the integral takes away the way that is left, 1/s.
const INTEGRAL_1_S: f32 = 2.0;
/// Turn that counts as much as a way, rad/m: that of fingertips 40 mm from the middle.
const STILL_RAD_M: f32 = 25.0;
/// Most by which the target's attitude is corrected, rad.
const CORRECTION_MOST_RAD: f32 = 0.35;
/// Part of its radius by which a fingertip is pressed in, at most.
const PRESSED_MOST: f32 = 0.2;
/// Height of the stroke of weighing, m, and its time, ms: half of it up, half down.
const STROKE_M: f32 = 6e-3;
const STROKE_MS: u32 = 2000;
/// Least height on both ways together by which an object has to be lifted to be weighed, m.
const LEAST_LIFT_M: f32 = 1e-3;
/// Time before the stroke and after it in which the frame comes to rest, ms.
const SETTLE_MS: u32 = 300;
/// By how much the fingertips' mean distance from their centroid may shrink while they hold something, m.
const SHRINK_M: f32 = 8e-3;

/// The work that is under way.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Work {
    /// The target is followed.
    Follow,
    /// The object is weighed.
    Weigh,
    /// The object is put down.
    PutDown,
}

/// The result of a tick of carrying.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Carried {
    /// It goes on.
    On,
    /// The way to the target is over.
    Arrived,
    /// The object was weighed.
    Weighed,
    /// The object stands on something.
    OnGround,
    /// It was put down as far as is stated.
    Deep,
}

/// The memory of what is carried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Carry<const F: usize> {
    /// Rotations of the fingertips' frame and of the object, as they were seen last.
    turn: Turn<f32>,
    object_turn: Turn<f32>,
    /// From each fingertip's centre to where it touched, at the latch, m; and these points.
    touches_m: [Vector3<f32>; F],
    points: frame::Latch<f32, 0, F>,
    /// Sum of the squares of the fingertips' distances below which nothing is between them, m^2.
    least_m2: f32,
    /// Way, rotation vector, and the point that is turned about, from the latch's centroid.
    path: Path<9>,
    integral_m: Vector3<f32>,
    correction_rad: Vector3<f32>,
    target: Pose<f32>,
    work: Work,
    age: u32,
    /// Work that the frame's pull did on what was measured of the stroke, J, and the height by which it lifted the object, m: up
    /// and down counted alike.
    work_j: f32,
    lifted_m: f32,
    /// Heights of frame and object in the tick before, m.
    heights_m: [f32; 2],
    /// Energy in the other springs of the grip then, J: it is not the weight that takes their work.
    grip_j: f32,
    /// Depth to which the target has sunk, m.
    sunk_m: f32,
    /// The last weight, N.
    weight_n: f32,
}

/// Returns the sum of the squares of the fingertips' distances from their centroid, m^2.
#[inline(never)]
fn spread_m2<const J: usize, const F: usize>(hand: &Hand<f32, J, F>, posture: &Posture<f32, J, F>) -> f32 {
    let count = hand.fingertip_count();
    let (mut sum, mut squares) = (Vector3::zeros(), 0.0);
    for centre in posture.centres_m.iter().take(count) {
        sum += centre;
        squares += dot(centre, centre);
    }
    squares - dot(&sum, &sum) / (count as f32)
}

/// Returns where the object was touched, from a fingertip's centre, m: by where that is now if it turned with the object, and if it
/// turned with the fingertip. A fingertip that has rolled on a face by an angle has left the point of the face behind by the arc,
/// and touches the face no higher than before; where it touched first it has lifted from the face.
fn rolled(with_object_m: &Vector3<f32>, with_fingertip_m: &Vector3<f32>) -> Vector3<f32> {
    let square = dot(with_object_m, with_object_m);
    let cosine = if square > 0.0 { dot(with_object_m, with_fingertip_m) / square } else { 1.0 };
    // The angle over its sine.
    let arc = 1.0 + (1.0 - cosine) * (1.0 / 3.0);
    with_object_m + (with_fingertip_m - with_object_m * cosine) * arc
}

impl<const F: usize> Carry<F> {
    pub(crate) fn new() -> Self {
        let none = Turn::none();
        Self {
            turn: none,
            object_turn: none,
            touches_m: [Vector3::zeros(); F],
            points: frame::Latch::of_points(&[Vector3::zeros(); F], F),
            least_m2: 0.0,
            path: Path::resting([0.0; 9]),
            integral_m: Vector3::zeros(),
            correction_rad: Vector3::zeros(),
            target: Pose::latched(),
            work: Work::Follow,
            age: 0,
            work_j: 0.0,
            lifted_m: 0.0,
            heights_m: [0.0; 2],
            grip_j: 0.0,
            sunk_m: 0.0,
            weight_n: 0.0,
        }
    }

    /// Begins with a grasp.
    pub(crate) fn begin<const J: usize>(
        &mut self,
        hand: &Hand<f32, J, F>,
        posture: &Posture<f32, J, F>,
        latch: &Latch<f32, J, F>,
    ) {
        *self = Self { weight_n: self.weight_n, ..Self::new() };
        let mut points_m = posture.centres_m;
        let mut squares = 0.0;
        let fingertips = hand.prepared_fingertips().iter().zip(&latch.frame.arms_m);
        for ((fingertip, arm), (touch, point)) in fingertips.zip(self.touches_m.iter_mut().zip(&mut points_m))
        {
            let length = norm(arm);
            squares += length * length;
            if length > 0.0 {
                *touch = arm * (-fingertip.radius_m / length);
            }
            *point += *touch;
        }
        let count = hand.fingertip_count();
        self.points = frame::Latch::of_points(&points_m, count);
        let mean = (squares / count as f32).square_root() - SHRINK_M;
        self.least_m2 = if mean > 0.0 { mean * mean * count as f32 } else { 0.0 };
    }

    /// The grasp has its full force: by as much as the fingertips have come together since the latch, on a rigid object, they are
    /// pressed in, and roll on a radius that is shorter.
    pub(crate) fn press_in<const J: usize>(&mut self, hand: &Hand<f32, J, F>, posture: &Posture<f32, J, F>) {
        let count = hand.fingertip_count() as f32;
        if !(self.least_m2 > 0.0) {
            return;
        }
        let before_m = (self.least_m2 / count).square_root() + SHRINK_M;
        let closer_m = before_m - (spread_m2(hand, posture) / count).square_root();
        for (touch, fingertip) in self.touches_m.iter_mut().zip(hand.prepared_fingertips()) {
            *touch *= 1.0 - (closer_m / fingertip.radius_m).limited(0.0, PRESSED_MOST);
        }
    }

    /// The weight that was weighed last, N.
    pub(crate) fn weight_n(&self) -> f32 {
        self.weight_n
    }

    /// Returns `true` while the object is weighed.
    pub(crate) fn is_weighing(&self) -> bool {
        self.work == Work::Weigh
    }

    /// Returns `true` while the target is on its way.
    pub(crate) fn is_moving(&self) -> bool {
        !self.path.is_over() || self.work != Work::Follow
    }

    /// Returns the longest ways to a target, m and rad.
    pub(crate) fn ways(&self, to: &[f32; 9]) -> (f32, f32) {
        let [x, y, z, turn_x, turn_y, turn_z, ..] = self.path.ways(to);
        (largest(&[x, y, z]), largest(&[turn_x, turn_y, turn_z]))
    }

    /// Goes to a target from now on.
    pub(crate) fn turn_to(&mut self, to: &[f32; 9], ticks: u32) {
        self.path.turn_to(to, ticks);
    }

    /// Begins to weigh.
    pub(crate) fn weigh(&mut self) {
        (self.work, self.age, self.work_j, self.lifted_m) = (Work::Weigh, 0, 0.0, 0.0);
    }

    /// Begins to put down.
    pub(crate) fn put_down(&mut self) {
        self.path = Path::resting(self.path.place().value);
        (self.work, self.age, self.sunk_m) = (Work::PutDown, 0, 0.0);
    }

    /// Looks where the fingertips are, and says where they are to be.
    #[inline(never)]
    pub(crate) fn advance<const J: usize>(
        &mut self,
        config: &CarryingConfig,
        period: Period,
        stance: (&Hand<f32, J, F>, &Posture<f32, J, F>),
        latch: &Latch<f32, J, F>,
        (stiffness_n_m, up, grip_j): (f32, Option<Vector3<f32>>, f32),
        held: &mut Held<f32, F>,
    ) -> Carried {
        let (hand, posture) = stance;
        let frame = Frame::seen(hand, &posture.centres_m, &latch.frame, &self.turn);
        self.turn = frame.pose.turn;
        let mut points_m = posture.centres_m;
        let attitudes = posture.attitudes.iter().zip(&latch.grasp.attitudes);
        let touched = points_m.iter_mut().zip(attitudes).zip(&self.touches_m).take(hand.fingertip_count());
        for ((point, (attitude, latched)), touch) in touched {
            let turned = turn_vector(&product_transposed(attitude, latched), touch);
            *point += rolled(&self.object_turn.turn(touch), &turned);
        }
        let count = hand.fingertip_count();
        let (object, _) =
            frame::pose_of(&points_m, &self.points, &self.object_turn, count, 1.0 / count as f32);
        self.object_turn = object.turn;
        let [px, py, pz, rx, ry, rz, bx, by, bz] = self.path.value();
        let (way, about) = (Vector3::new(px, py, pz), Vector3::new(bx, by, bz));
        let goal = Turn::by(&Vector3::new(rx, ry, rz));
        let mut way_m = way + about - goal.turn(&about);
        let period_s = period.seconds();
        let was_over = self.path.is_over();
        self.path.advance();
        let mut carried = if !was_over && self.path.is_over() { Carried::Arrived } else { Carried::On };
        let upwards = up.unwrap_or(Vector3::zeros());
        way_m -= upwards * self.sunk_m;
        // At its full force only: while it is let go, nothing is to be made up for.
        if self.work == Work::Follow && stiffness_n_m > 0.0 {
            let most = config.integral_n / stiffness_n_m;
            // From the middle of the points of touch, not from that of the centres.
            let about = about + latch.frame.centroid_m - self.points.centroid_m;
            let left_m = way + about - goal.turn(&about) - upwards * self.sunk_m - object.way_m;
            let beyond = |left: f32, still: f32| left - left.limited(-still, still);
            self.integral_m += left_m.map(|left| beyond(left, config.still_m)) * (INTEGRAL_1_S * period_s);
            let square = dot(&self.integral_m, &self.integral_m);
            if square > most * most {
                self.integral_m *= most / square.square_root();
            }
            let left = object.turn.inverse().then(&goal).shorter().v * 2.0;
            let rate = config.correction_hz * (core::f32::consts::TAU * period_s);
            let most = CORRECTION_MOST_RAD;
            let still_rad = config.still_m * STILL_RAD_M;
            self.correction_rad = (self.correction_rad + left.map(|left| beyond(left, still_rad)) * rate)
                .map(|v| v.limited(-most, most));
        }
        way_m += self.integral_m;
        let ticks = |time_ms: u32| (time_ms * 1000 / period.microseconds()).max(1);
        let pull_n = |way_m: &Vector3<f32>| stiffness_n_m * dot(&(way_m - frame.pose.way_m), &upwards);
        self.age = self.age.saturating_add(1);
        match self.work {
            Work::Follow => {}
            Work::Weigh => {
                let (settle, stroke) = (ticks(SETTLE_MS), ticks(STROKE_MS));
                let at = self.age.saturating_sub(settle);
                let (_, cosine) =
                    (core::f32::consts::TAU * (at.min(stroke) as f32 / stroke as f32)).sine_cosine();
                way_m += upwards * (STROKE_M * 0.5 * (1.0 - cosine));
                // The middle half of the way up, and of that down.
                let eighth = at * 8 / stroke;
                let heights_m = [dot(&frame.pose.way_m, &upwards), dot(&object.way_m, &upwards)];
                if matches!(eighth, 1 | 2 | 5 | 6) {
                    let sign = if eighth < 4 { 1.0 } else { -1.0 };
                    let [frame_m, object_m] = self.heights_m;
                    self.work_j +=
                        sign * (pull_n(&way_m) * (heights_m[0] - frame_m) - (grip_j - self.grip_j));
                    self.lifted_m += sign * (heights_m[1] - object_m);
                }
                (self.heights_m, self.grip_j) = (heights_m, grip_j);
                if at >= stroke + settle {
                    // Without a way there is no weight.
                    let is_lifted = self.lifted_m > LEAST_LIFT_M;
                    self.weight_n = if is_lifted { self.work_j / self.lifted_m } else { 0.0 };
                    self.work = Work::Follow;
                    carried = Carried::Weighed;
                }
            }
            Work::PutDown => {
                if stiffness_n_m > 0.0 {
                    self.sunk_m += config.put_down_m_s * period_s;
                }
                let is_on_ground = pull_n(&way_m) < -config.put_down_n;
                let is_deep = dot(&way_m, &upwards) < -config.put_down_m;
                if is_on_ground || is_deep {
                    // From here on, the target is where the frame is.
                    let at = way + frame.pose.way_m - (way + about - goal.turn(&about));
                    self.path = Path::resting([at.x, at.y, at.z, rx, ry, rz, bx, by, bz]);
                    (self.integral_m, self.sunk_m) = (Vector3::zeros(), 0.0);
                    way_m = frame.pose.way_m;
                    self.work = Work::Follow;
                    carried = if is_on_ground { Carried::OnGround } else { Carried::Deep };
                }
            }
        }
        let target_before = self.target;
        self.target = Pose { way_m, turn: goal.nudged(&self.correction_rad) };
        *held = Held { frame, object, target: self.target, target_before };
        carried
    }

    /// Returns `true` if there is nothing between the fingertips any more.
    pub(crate) fn is_lost<const J: usize>(
        &self,
        hand: &Hand<f32, J, F>,
        posture: &Posture<f32, J, F>,
    ) -> bool {
        spread_m2(hand, posture) < self.least_m2 || super::closing::are_close(hand, posture)
    }

    pub(crate) fn save(&self, fingertips: usize, to: &mut Saver<'_>) -> Result<(), BufferTooSmall> {
        for turn in [&self.turn, &self.object_turn, &self.target.turn] {
            to.f32(turn.w)?;
            to.f32s(turn.v.as_slice(), 3)?;
        }
        for vectors in [&self.touches_m, &self.points.arms_m] {
            vectors.iter().take(fingertips).try_for_each(|vector| to.f32s(vector.as_slice(), 3))?;
        }
        for vector in [&self.points.centroid_m, &self.integral_m, &self.correction_rad, &self.target.way_m] {
            to.f32s(vector.as_slice(), 3)?;
        }
        self.path.save(9, to)?;
        to.u8(self.work as u8)?;
        to.u32(self.age)?;
        to.f32s(&self.heights_m, 2)?;
        let Self { least_m2, work_j, grip_j, lifted_m, sunk_m, weight_n, .. } = *self;
        to.f32s(&[least_m2, work_j, grip_j, lifted_m, sunk_m, weight_n], 6)
    }

    pub(crate) fn load(fingertips: usize, from: &mut Loader<'_>) -> Result<Self, SnapshotError> {
        let mut carry = Self::new();
        for turn in [&mut carry.turn, &mut carry.object_turn, &mut carry.target.turn] {
            turn.w = from.f32()?;
            from.f32s(turn.v.as_mut_slice(), 3)?;
        }
        for vectors in [&mut carry.touches_m, &mut carry.points.arms_m] {
            vectors.iter_mut().take(fingertips).try_for_each(|vector| from.f32s(vector.as_mut_slice(), 3))?;
        }
        let Self { points, integral_m, correction_rad, target, .. } = &mut carry;
        for vector in [&mut points.centroid_m, integral_m, correction_rad, &mut target.way_m] {
            from.f32s(vector.as_mut_slice(), 3)?;
        }
        carry.path = Path::load(9, from)?;
        carry.work = match from.u8()? {
            0 => Work::Follow,
            1 => Work::Weigh,
            2 => Work::PutDown,
            _ => return Err(SnapshotError::Malformed("no work has this number")),
        };
        carry.age = from.u32()?;
        from.f32s(&mut carry.heights_m, 2)?;
        let Self { least_m2, work_j, grip_j, lifted_m, sunk_m, weight_n, .. } = &mut carry;
        for number in [least_m2, work_j, grip_j, lifted_m, sunk_m, weight_n] {
            *number = from.f32()?;
        }
        Ok(carry)
    }
}
