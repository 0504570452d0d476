//! The product: one function that takes the joint counts of this millisecond to the torques of the next.
//!
//! ```text
//! counts --> estimate q, dq --> supervise --> grasp law --> limit --> torques
//!                                   |                                    |
//!                                command                              Record --> telemetry
//! ```
//!
//! It is pure: parameters, state, inputs, and nothing else. It cannot fail and does not panic; what goes wrong is a
//! numbered fault. There are three entries, which differ in what they know of the joints and share all the rest:
//! [`tick`] has encoder counts, [`tick_with`] has ideal angles and speeds (a simulation without encoders), and
//! [`tick_blind`] has nothing, because a joint could not be read.
//!
//! Torques are those of the tick's end: what is computed from the counts of this tick acts from the next.

use crate::command::Command;
use crate::control::{GraspConfig, GraspLaw, Grip, Latch, Monitor};
use crate::estimate::{Estimator, EstimatorConfig, Motion, Tracks};
use crate::fault::{Fault, FaultConfig, Raised, Watch};
use crate::hand::{Hand, Posture};
use crate::limit::{LimitConfig, Limiting, Limits};
use crate::math::Real;
use crate::parameter::ParameterError;
use crate::period::Period;
use crate::supervisor::{Drive, Mode, Ramps, Supervisor, SupervisorConfig};
use crate::telemetry::{List, Record};

/// Everything that can be set, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config<T, const J: usize> {
    /// Time from one tick to the next, us.
    pub period_us: u32,
    /// Encoders and filter.
    pub estimator: EstimatorConfig<T, J>,
    /// Gains of the grasp law.
    pub law: GraspConfig<T, J>,
    /// Limits.
    pub limits: LimitConfig<T, J>,
    /// Where faults begin.
    pub faults: FaultConfig<T, J>,
    /// Times of grasping and releasing.
    pub supervisor: SupervisorConfig,
}

/// Everything that the tick needs and never changes: checked, and prepared once.
#[derive(Clone, Debug, PartialEq)]
pub struct Params<T, const J: usize, const F: usize> {
    hand: Hand<T, J, F>,
    period: Period,
    estimator: Estimator<T, J>,
    law: GraspLaw<T, J>,
    /// `f_d` at full force, N.
    force_n: T,
    limits: Limits<T, J>,
    watch: Watch<T, J>,
    ramps: Ramps<T>,
}

impl<T: Real, const J: usize, const F: usize> Params<T, J, F> {
    /// Checks all parameters and prepares them.
    ///
    /// # Errors
    /// The first parameter that is wrong, with its joint and the reason.
    pub fn new(hand: Hand<T, J, F>, config: &Config<T, J>) -> Result<Self, ParameterError> {
        let period = Period::from_us(config.period_us)?;
        let estimator = config.estimator.prepare(hand.joint_count(), period)?;
        Ok(Self {
            law: config.law.prepare(&hand)?,
            force_n: config.law.force_n,
            limits: config.limits.prepare(&hand, period)?,
            watch: config.faults.prepare(&hand, &estimator, period)?,
            ramps: config.supervisor.prepare(period)?,
            hand,
            period,
            estimator,
        })
    }

    /// The hand.
    pub fn hand(&self) -> &Hand<T, J, F> {
        &self.hand
    }

    /// The tick period.
    pub fn period(&self) -> Period {
        self.period
    }

    /// The estimator: its delay and noise.
    pub fn estimator(&self) -> &Estimator<T, J> {
        &self.estimator
    }

    /// The grasp law.
    pub fn law(&self) -> &GraspLaw<T, J> {
        &self.law
    }
}

/// Everything that the tick remembers.
#[derive(Clone, Debug, PartialEq)]
pub struct State<T, const J: usize, const F: usize> {
    ticks: u32,
    tracks: Tracks<T, J>,
    motion: Motion<T, J>,
    supervisor: Supervisor,
    /// The fingertips' attitudes when the grasp began, while there is one.
    latch: Option<Latch<T, F>>,
    /// Where everything was in the last tick with torque.
    posture: Posture<T, J, F>,
    /// Torques of the last tick, N m.
    torques_nm: [T; J],
    /// For how many ticks each joint has been at its torque limit.
    saturated: [u32; J],
}

impl<T: Real, const J: usize, const F: usize> State<T, J, F> {
    /// Disarmed, before the first tick.
    pub fn new() -> Self {
        Self {
            ticks: 0,
            tracks: Tracks::new(),
            motion: Motion::still(),
            supervisor: Supervisor::new(),
            latch: None,
            posture: Posture::at_base(),
            torques_nm: [T::zero(); J],
            saturated: [0; J],
        }
    }

    /// Joint angles as the last tick saw them, rad.
    pub fn angles_rad(&self) -> &[T; J] {
        &self.motion.angles_rad
    }

    /// Joint speeds as the last tick saw them, rad/s.
    pub fn speeds_rad_s(&self) -> &[T; J] {
        &self.motion.speeds_rad_s
    }

    /// The mode.
    pub fn mode(&self) -> Mode {
        self.supervisor.mode()
    }

    /// The fault that the hand is in.
    pub fn fault(&self) -> Option<Raised> {
        self.supervisor.fault()
    }

    /// The fingertips' attitudes when the grasp began, while there is one.
    pub fn latch(&self) -> Option<&Latch<T, F>> {
        self.latch.as_ref()
    }
}

impl<T: Real, const J: usize, const F: usize> Default for State<T, J, F> {
    fn default() -> Self {
        Self::new()
    }
}

/// What a tick puts out.
#[derive(Clone, Debug, PartialEq)]
pub struct Output<T, const J: usize> {
    /// Torques of the next tick, N m; zero beyond the hand's joints.
    pub torques_nm: [T; J],
    /// What there is to tell.
    pub record: Record<T, J>,
}

/// One tick from encoder counts.
pub fn tick<T: Real, const J: usize, const F: usize>(
    params: &Params<T, J, F>,
    state: &mut State<T, J, F>,
    counts: &[i32; J],
    command: Option<Command>,
) -> Output<T, J> {
    state.motion = params.estimator.update(&mut state.tracks, counts);
    let fault = params.watch.motion(&state.motion);
    let counts = List::first_of(*counts, params.hand.joint_count());
    from_motion(params, state, counts, fault, command)
}

/// One tick from ideal angles (rad) and speeds (rad/s), without encoders.
pub fn tick_with<T: Real, const J: usize, const F: usize>(
    params: &Params<T, J, F>,
    state: &mut State<T, J, F>,
    angles_rad: &[T; J],
    speeds_rad_s: &[T; J],
    command: Option<Command>,
) -> Output<T, J> {
    state.motion = Motion { angles_rad: *angles_rad, speeds_rad_s: *speeds_rad_s, ..Motion::still() };
    state.tracks.restart();
    let fault = params.watch.motion(&state.motion);
    from_motion(params, state, List::first_of([0; J], 0), fault, command)
}

/// One tick in which a joint could not be read: a fault. The estimator starts anew with the next sample.
pub fn tick_blind<T: Real, const J: usize, const F: usize>(
    params: &Params<T, J, F>,
    state: &mut State<T, J, F>,
    joint: usize,
    command: Option<Command>,
) -> Output<T, J> {
    state.tracks.restart();
    let fault = Some(Raised::at(joint, Fault::SampleMissing));
    from_motion(params, state, List::first_of([0; J], 0), fault, command)
}

/// What the joints are to be given, and why.
struct Action<T, const J: usize> {
    torques_nm: [T; J],
    limiting: [Limiting; J],
    /// A torque that is not a finite number.
    not_finite: Option<Raised>,
    force_n: T,
    attitude_stiffness_nm: T,
    monitor: Monitor<T>,
}

impl<T: Real, const J: usize> Action<T, J> {
    /// No torque.
    fn none() -> Self {
        Self {
            torques_nm: [T::zero(); J],
            limiting: [Limiting::NONE; J],
            not_finite: None,
            force_n: T::zero(),
            attitude_stiffness_nm: T::zero(),
            monitor: Monitor { approach_potential_j: T::zero(), attitude_potential_j: T::zero() },
        }
    }
}

/// The tick after the estimator: supervise, law, limit, record.
fn from_motion<T: Real, const J: usize, const F: usize>(
    params: &Params<T, J, F>,
    state: &mut State<T, J, F>,
    counts: List<i32, J>,
    fault: Option<Raised>,
    command: Option<Command>,
) -> Output<T, J> {
    let answer = state.supervisor.begin(&params.ramps, fault, command);
    let mut action = act(params, state);

    // The last gate: what came out may itself be a fault, and takes the torque away in this very tick.
    let saturation = params.watch.saturation(&mut state.saturated, &action.limiting);
    if let Some(raised) = action.not_finite.or(saturation) {
        state.supervisor.raise(raised);
        state.latch = None;
        action = Action::none();
    }
    state.torques_nm = action.torques_nm;

    let joint_count = params.hand.joint_count();
    let record = Record {
        sequence: state.ticks,
        tick: state.ticks,
        mode: state.supervisor.mode(),
        fault: state.supervisor.fault(),
        answer,
        force_n: action.force_n,
        attitude_stiffness_nm: action.attitude_stiffness_nm,
        approach_potential_j: action.monitor.approach_potential_j,
        attitude_potential_j: action.monitor.attitude_potential_j,
        counts,
        torques_nm: List::first_of(action.torques_nm, joint_count),
        limiting: List::first_of(action.limiting, joint_count),
    };
    state.ticks = state.ticks.wrapping_add(1);
    Output { torques_nm: action.torques_nm, record }
}

/// The law and the limits, as the mode wants them.
fn act<T: Real, const J: usize, const F: usize>(
    params: &Params<T, J, F>,
    state: &mut State<T, J, F>,
) -> Action<T, J> {
    let drive = state.supervisor.drive(&params.ramps);
    if !matches!(drive, Drive::Grip { .. }) {
        state.latch = None;
    }
    if drive == Drive::Off {
        return Action::none();
    }
    let Motion { angles_rad, speeds_rad_s, .. } = &state.motion;
    params.hand.forward_kinematics(angles_rad, &mut state.posture);
    let posture = &state.posture;
    let grip = match drive {
        Drive::Off | Drive::Hold => None,
        Drive::Grip { force_share, attitude_share } => {
            let latch = &*state.latch.get_or_insert_with(|| Latch::of(posture));
            Some(Grip { latch, force_share, attitude_share })
        }
    };
    let (wanted_nm, monitor) = params.law.torques(&params.hand, posture, speeds_rad_s, grip);
    let (torques_nm, limiting) = params.limits.apply(angles_rad, speeds_rad_s, &state.torques_nm, &wanted_nm);
    // A limit makes an infinite torque finite: both sides of it are looked at.
    let not_finite = params.watch.torques(&wanted_nm).or(params.watch.torques(&torques_nm));
    Action {
        torques_nm,
        limiting,
        not_finite,
        force_n: grip.map_or(T::zero(), |grip| params.force_n * grip.force_share),
        attitude_stiffness_nm: grip
            .map_or(T::zero(), |grip| params.law.attitude_stiffness_nm() * grip.attitude_share),
        monitor,
    }
}
