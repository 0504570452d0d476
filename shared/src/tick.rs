//! The product: one function that takes the joint counts of this millisecond to the torques of the next.
//!
//! ```text
//! counts --> estimate q, dq --> watch, supervise --> cycle, laws --> limit --> torques
//!                                       |                           |         |
//!                                command, events                 ledger    Record --> telemetry
//! ```
//!
//! It is pure: parameters, state, input, and nothing else. It cannot fail and does not panic; what goes wrong is a
//! numbered fault.
//!
//! Torques are those of the tick's end: what is computed from the counts of this tick acts from the next.

mod stages;
mod state;

pub use state::State;

use crate::command::{Answer, Command, Grasp, Refusal};
use crate::control::{Account, Grip, Latch, Laws, LawsConfig, PerGain, Ramp, Stance};
use crate::cycle::{CycleConfig, Noticed, OPEN, Postures, RETREAT_MS};
use crate::estimate::{Estimator, EstimatorConfig, Motion};
use crate::event::{Event, Events};
use crate::fault::{Driven, Fault, FaultConfig, Raised, Watch};
use crate::hand::Hand;
use crate::joints::MotorConfig;
use crate::ledger::Entry;
use crate::limit::{LimitConfig, Limiting, Limits};
use crate::math::norm;
use crate::parameter::ParameterError;
use crate::period::Period;
use crate::supervisor::{Drive, Mode, Ramps, Stages, SupervisorConfig};
use crate::telemetry::{List, Record};
use nalgebra::Vector3;

/// Everything that can be set, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config<const J: usize> {
    /// Time from one tick to the next, us.
    pub period_us: u32,
    /// Encoders and filter.
    pub estimator: EstimatorConfig<J>,
    /// Motors.
    pub motors: MotorConfig<J>,
    /// Laws and their gains.
    pub laws: LawsConfig<f32, J>,
    /// Limits.
    pub limits: LimitConfig<J>,
    /// Thresholds of the faults.
    pub faults: FaultConfig<J>,
    /// Times of grasping and releasing.
    pub supervisor: SupervisorConfig,
    /// Of the stages before a grasp and after it.
    pub cycle: CycleConfig<J>,
}

/// Everything that the tick needs and never changes: checked, and prepared once.
#[derive(Clone, Debug, PartialEq)]
pub struct Params<const J: usize, const F: usize> {
    hand: Hand<f32, J, F>,
    postures: Postures<J>,
    /// The configuration in the hand's file: how far the line may go.
    file: Config<J>,
    /// The parameters that differ from it, a bit for each.
    pub(crate) changed: u64,
    prepared: Prepared<J>,
}

/// A configuration, checked and prepared.
#[derive(Clone, Debug, PartialEq)]
struct Prepared<const J: usize> {
    config: Config<J>,
    period: Period,
    period_s: f32,
    estimator: Estimator<J>,
    laws: Laws<f32, J>,
    limits: Limits<J>,
    watch: Watch<J>,
    ramps: Ramps,
    /// Joints that move several fingertips.
    trunk: [bool; J],
    /// The direction against gravity; `None` where it is not told.
    up: Option<Vector3<f32>>,
}

impl<const J: usize> Prepared<J> {
    /// Not inlined: the firmware would have it twice, at the start and where parameters are set.
    #[inline(never)]
    fn new<const F: usize>(
        hand: &Hand<f32, J, F>,
        has_open: bool,
        config: &Config<J>,
    ) -> Result<Self, ParameterError> {
        let period = Period::from_us(config.period_us)?;
        let estimator = config.estimator.prepare(hand.joint_count(), period)?;
        let limits = config.limits.prepare(hand, period)?;
        let laws = config.laws.prepare(hand)?;
        if let Some(gain) = limits.forbidden(&config.laws.gains) {
            let reason = "has to be at most its limit, the parameter `limits.` and this name";
            return Err(ParameterError { parameter: gain.key.into(), joint: None, reason });
        }
        config.cycle.check(hand.joint_count())?;
        let has = Stages { closing: config.cycle.closes(), opening: has_open && config.cycle.moves() };
        let retreat_ticks = period.ticks(RETREAT_MS, "period_us")?;
        let mut trunk = [false; J];
        for (k, is_trunk) in trunk.iter_mut().enumerate().take(hand.joint_count()) {
            *is_trunk = (0..hand.fingertip_count()).filter(|&i| hand.moves(k, i)).nth(1).is_some();
        }
        Ok(Self {
            laws,
            limits,
            watch: config.faults.prepare(hand, &estimator, period)?,
            ramps: config.supervisor.prepare(period)?.with(has, retreat_ticks),
            trunk,
            up: config.laws.hold.gravity_m_s2.and_then(|gravity| {
                let length = norm(&gravity);
                (length > 0.0).then(|| gravity * (-1.0 / length))
            }),
            period,
            period_s: period.seconds(),
            estimator,
            config: *config,
        })
    }
}

impl<const J: usize, const F: usize> Params<J, F> {
    /// Checks all parameters and prepares them.
    ///
    /// # Errors
    /// The first parameter that is wrong, with its joint and the reason.
    pub fn new(hand: Hand<f32, J, F>, config: &Config<J>) -> Result<Self, ParameterError> {
        Self::of(hand, Postures::default(), config)
    }

    /// The same with named postures.
    ///
    /// # Errors
    /// As [`Self::new`], or a posture has not an angle for each joint, or one that is beyond its range.
    #[inline(never)]
    pub fn of(
        hand: Hand<f32, J, F>,
        postures: Postures<J>,
        config: &Config<J>,
    ) -> Result<Self, ParameterError> {
        let fails = |reason| Err(ParameterError { parameter: "posture".into(), joint: None, reason });
        for posture in &postures {
            if posture.angles_rad.len() != hand.joint_count() {
                return fails("has to have an angle for each joint");
            }
            let mut angles = posture.angles_rad.iter().enumerate();
            if !angles.all(|(k, &angle_rad)| is_within(&hand, config, k, angle_rad)) {
                return fails("has to be within the joints' ranges, and off their end stops");
            }
        }
        let prepared = Prepared::new(&hand, has_open(&postures), config)?;
        Ok(Self { prepared, file: *config, changed: 0, postures, hand })
    }

    /// The same with named postures.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn with_postures(self, postures: Postures<J>) -> Result<Self, ParameterError> {
        Self::of(self.hand, postures, &self.file)
    }

    /// The named postures.
    pub fn postures(&self) -> &Postures<J> {
        &self.postures
    }

    /// Returns `true` if a joint may be moved to an angle, rad: within its range, and off its end stops.
    fn is_within(&self, joint: usize, angle_rad: f32) -> bool {
        is_within(&self.hand, self.config(), joint, angle_rad)
    }

    /// Exchanges the configuration; a hand in motion would jump.
    ///
    /// # Errors
    /// As [`Self::new`]; nothing changes then.
    pub fn configure(&mut self, config: &Config<J>) -> Result<(), ParameterError> {
        self.prepared = Prepared::new(&self.hand, has_open(&self.postures), config)?;
        Ok(())
    }

    /// The hand.
    pub fn hand(&self) -> &Hand<f32, J, F> {
        &self.hand
    }

    /// The configuration.
    pub fn config(&self) -> &Config<J> {
        &self.prepared.config
    }

    /// The configuration of the hand's file, with which it started.
    pub fn file(&self) -> &Config<J> {
        &self.file
    }

    /// The tick period.
    pub fn period(&self) -> Period {
        self.prepared.period
    }

    /// The estimator: its delay and noise.
    pub fn estimator(&self) -> &Estimator<J> {
        &self.prepared.estimator
    }

    /// The control laws.
    pub fn laws(&self) -> &Laws<f32, J> {
        &self.prepared.laws
    }
}

/// Returns `true` if there is a posture to open to.
fn has_open<const J: usize>(postures: &Postures<J>) -> bool {
    postures.iter().any(|posture| posture.name.as_slice() == OPEN)
}

/// Returns `true` if a joint of a hand may be moved to an angle, rad: within its range, and off its end stops.
fn is_within<const J: usize, const F: usize>(
    hand: &Hand<f32, J, F>,
    config: &Config<J>,
    joint: usize,
    angle_rad: f32,
) -> bool {
    let (lower, upper) = hand.range_rad(joint);
    let margins = config.limits.stop_margin_rad.as_ref();
    let margin = margins.and_then(|margins| margins.get(joint)).copied().unwrap_or(0.0);
    angle_rad >= lower + margin && angle_rad <= upper - margin
}

/// The inputs of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input<'a, const J: usize> {
    /// The state of the joints.
    pub sensed: Sensed<'a, J>,
    /// The other events.
    pub events: Events,
    /// The command of the user.
    pub command: Option<Command>,
}

/// The state of the joints as a tick gets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sensed<'a, const J: usize> {
    /// Encoder counts.
    Counts(&'a [i32; J]),
    /// Angles, rad, and speeds, rad/s, of a simulation without encoders.
    Ideal {
        /// Joint angles, rad.
        angles_rad: &'a [f32; J],
        /// Joint speeds, rad/s.
        speeds_rad_s: &'a [f32; J],
    },
    /// Nothing, because the joints could not be read or driven. The estimator starts anew with the next counts.
    Failed(Raised),
    /// The reading that joints which failed would begin with now: they have passed their self-test since, and wait for
    /// the fault to be cleared.
    Tested {
        /// The failure.
        raised: Raised,
        /// Encoder counts.
        counts: &'a [i32; J],
    },
}

impl<'a, const J: usize> Input<'a, J> {
    /// Counts, and perhaps a command.
    pub fn counts(counts: &'a [i32; J], command: Option<Command>) -> Self {
        Self { sensed: Sensed::Counts(counts), events: Events::NONE, command }
    }

    /// Ideal angles, rad, and speeds, rad/s, and perhaps a command.
    pub fn ideal(angles_rad: &'a [f32; J], speeds_rad_s: &'a [f32; J], command: Option<Command>) -> Self {
        Self { sensed: Sensed::Ideal { angles_rad, speeds_rad_s }, events: Events::NONE, command }
    }

    /// A failed reading, and perhaps a command.
    pub fn failed(raised: Raised, command: Option<Command>) -> Self {
        Self { sensed: Sensed::Failed(raised), events: Events::NONE, command }
    }

    /// The same with events.
    #[must_use]
    pub fn with(self, events: Events) -> Self {
        Self { events, ..self }
    }
}

/// The outputs of a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Output<const J: usize> {
    /// Torques of the next tick, N m; zero beyond the hand's joints.
    pub torques_nm: [f32; J],
    /// `true` if the amplifiers have power in it.
    pub powered: bool,
    /// The record of the tick.
    pub record: Record<J>,
}

/// One tick.
pub fn tick<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &mut State<J, F>,
    input: &Input<'_, J>,
) -> Output<J> {
    let mut record = Record::BLANK;
    tick_into(params, state, input, &mut record);
    Output { torques_nm: state.torques_nm, powered: record.mode.is_powered(), record }
}

/// One tick, whose record is written where it stays. Its torques are in the state.
pub(crate) fn tick_into<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &mut State<J, F>,
    input: &Input<'_, J>,
    record: &mut Record<J>,
) {
    let sensed = sense(params, state, &input.sensed);
    let fault = watch(params, state, input, sensed);
    let objection = input.command.and_then(|command| object(params, state, input.events, command));
    let before = state.supervisor.mode();
    let answer = state.supervisor.begin(&params.prepared.ramps, fault, input.command, objection);
    if let Some(Answer { command, refused: None }) = answer {
        stages::obey(params, state, before, command);
    }
    let grasped = state.latch.is_some();
    let mut action = Action::none();
    act(params, state, &mut action);
    state.ledger.enter(&Entry {
        motion: &state.motion,
        last_nm: &state.torques_nm,
        law: action.account.as_ref(),
        period_s: params.prepared.period_s,
    });
    if !grasped && state.latch.is_some() {
        state.ledger.open();
    }

    // The last gate: what came out may itself be a fault, and takes the torque away in this very tick.
    let saturation = params.prepared.watch.saturation(&mut state.watched, &action.limiting);
    let energy = params.prepared.watch.energy(state.ledger.excess_j());
    if let Some(raised) = action.not_finite.or(saturation).or(energy) {
        state.supervisor.raise(raised);
        state.latch = None;
        action = Action::none();
    }
    state.torques_nm = action.torques_nm;

    let joint_count = params.hand.joint_count();
    let (counts, reading_failed) = match input.sensed {
        Sensed::Counts(counts) => (List::first_of(*counts, joint_count), None),
        Sensed::Ideal { .. } => (List::first_of([0; J], 0), None),
        Sensed::Failed(raised) => (List::first_of([0; J], 0), Some(raised)),
        Sensed::Tested { raised, counts } => (List::first_of(*counts, joint_count), Some(raised)),
    };
    let account = action.account.unwrap_or(Account::none());
    *record = Record {
        sequence: state.ticks,
        tick: state.ticks,
        mode: state.supervisor.mode(),
        fault: state.supervisor.fault(),
        answer,
        notice: action.noticed,
        events: input.events,
        reading_failed,
        gains: account.gains,
        potentials_j: account.potentials_j,
        law_signals: account.signals,
        work_j: state.ledger.work_j(),
        damped_j: state.ledger.damped_j(),
        excess_j: state.ledger.excess_j(),
        weight_n: state.cycle.carry.weight_n(),
        cycles: 0,
        late_ticks: state.watched.late_ticks(),
        dropped: 0,
        decimation: 1,
        counts,
        torques_nm: List::first_of(action.torques_nm, joint_count),
        limiting: List::first_of(action.limiting, joint_count),
    };
    state.ticks = state.ticks.wrapping_add(1);
}

/// Updates the motion; the fault of the reading or of what it shows.
fn sense<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &mut State<J, F>,
    sensed: &Sensed<'_, J>,
) -> Option<Raised> {
    match *sensed {
        Sensed::Counts(counts) => {
            params.prepared.estimator.update(&mut state.tracks, counts, &mut state.motion);
        }
        Sensed::Ideal { angles_rad, speeds_rad_s } => {
            let last_rad = &state.motion.angles_rad;
            let moved_rad = core::array::from_fn(|k| {
                let moved = angles_rad[k] - last_rad[k];
                if moved.is_finite() { moved } else { 0.0 }
            });
            state.motion =
                Motion { angles_rad: *angles_rad, speeds_rad_s: *speeds_rad_s, moved_rad, ..Motion::still() };
            state.tracks.restart();
        }
        Sensed::Failed(raised) => {
            state.motion.moved_rad = [0.0; J];
            state.tracks.restart();
            return Some(raised);
        }
        Sensed::Tested { raised, counts } => {
            params.prepared.estimator.update(&mut state.tracks, counts, &mut state.motion);
            // Once the hand is in its fault, that they failed is no cause to stay there; what they would begin with may be.
            if state.mode() != Mode::Fault {
                return Some(raised);
            }
        }
    }
    params.prepared.watch.motion(&state.motion)
}

/// The first fault that is there at the beginning of the tick.
fn watch<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &mut State<J, F>,
    input: &Input<'_, J>,
    sensed: Option<Raised>,
) -> Option<Raised> {
    let State { watched, motion, torques_nm, supervisor, cycle, .. } = state;
    // Each of them counts something, and is asked in every tick.
    let late = params.prepared.watch.lateness(watched, input.events.contains(Event::Late));
    let silent = params.prepared.watch.heartbeat(watched, input.events.contains(Event::Heartbeat));
    let frozen = match input.sensed {
        Sensed::Counts(_) => {
            let driven = match supervisor.mode() {
                mode if !mode.is_grasp() => Driven::Otherwise,
                _ if supervisor.ramps(&params.prepared.ramps) || cycle.carry.is_moving() => Driven::Ramp,
                _ => Driven::Steadily,
            };
            params.prepared.watch.standstill(watched, motion, torques_nm, driven)
        }
        Sensed::Ideal { .. } | Sensed::Failed(_) | Sensed::Tested { .. } => None,
    };
    let lost = (silent && supervisor.mode().is_powered()).then_some(Raised::of_hand(Fault::LinkLost));
    // A supply that sags may be why nothing else works.
    let low = input.events.contains(Event::SupplyLow).then_some(Raised::of_hand(Fault::SupplyLow));
    low.or(sensed).or(late).or(frozen).or(lost)
}

/// Returns the reason for which a command can't be done even in a mode that takes it.
fn object<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &State<J, F>,
    events: Events,
    command: Command,
) -> Option<Refusal> {
    match command {
        Command::Arm if events.contains(Event::FallbackClock) => Some(Refusal::FallbackClock),
        Command::Arm if events.contains(Event::Unconfirmed) => Some(Refusal::Unconfirmed),
        Command::Arm if params.prepared.watch.silent(&state.watched) => Some(Refusal::NoHeartbeat),
        Command::Grasp(grasp) => {
            let asked = &grasp.gains;
            let chosen = params.config().laws.chosen;
            let mut of_other_laws =
                asked.iter().zip(PerGain::LAW.iter()).filter(|(_, law)| !chosen.has(**law));
            let gains = gains(params, grasp);
            if !gains.iter().all(|gain| gain.is_finite()) {
                Some(Refusal::NotFinite)
            } else if of_other_laws.any(|(gain, _)| gain.is_some_and(|gain| gain != 0.0)) {
                Some(Refusal::LawNotChosen)
            } else if params.prepared.limits.forbidden(&gains).is_some()
                || (params.prepared.ramps.has().closing && !(gains.grasp[0] > 0.0))
            {
                // Fingertips that close on something and then press with nothing hold nothing.
                Some(Refusal::OutOfRange)
            } else {
                // To be told that it is done would be wrong for a grasp of other gains.
                let other = gains != state.grasp;
                let mode = state.supervisor.mode();
                ((mode.is_grasp() || mode == Mode::Closing) && other).then_some(Refusal::Grasping)
            }
        }
        _ => stages::object(params, state, command),
    }
}

/// Returns the gains that a command asks for.
fn gains<const J: usize, const F: usize>(params: &Params<J, F>, grasp: Grasp) -> PerGain<f32> {
    params.prepared.laws.gains().zip_with(&grasp.gains, |&configured, asked| asked.unwrap_or(configured))
}

/// The torques of the joints, and their reasons.
struct Action<const J: usize> {
    torques_nm: [f32; J],
    limiting: [Limiting; J],
    /// A torque that is not a finite number.
    not_finite: Option<Raised>,
    /// The laws' account; `None` without torque.
    account: Option<Account<f32>>,
    /// The notice.
    noticed: Option<Noticed>,
}

impl<const J: usize> Action<J> {
    /// No torque.
    fn none() -> Self {
        let limiting = [Limiting::NONE; J];
        Self { torques_nm: [0.0; J], limiting, not_finite: None, account: None, noticed: None }
    }
}

/// The law and the limits, as the mode wants them; written where it stays.
fn act<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &mut State<J, F>,
    action: &mut Action<J>,
) {
    let ramps = &params.prepared.ramps;
    if state.supervisor.drive(ramps) == Drive::Off {
        (state.latch, state.cycle.begun) = (None, state.supervisor.mode());
        return;
    }
    params.hand.forward_kinematics(&state.motion.angles_rad, &mut state.posture);
    action.noticed = stages::notice(params, state);
    let drive = state.supervisor.drive(ramps);
    let State { motion, posture, latch, cycle, grasp, .. } = state;
    let Motion { angles_rad, speeds_rad_s, .. } = &*motion;
    let grip = match drive {
        Drive::Grip { force_share, stiffness_share } => Some(Grip {
            latch: &*latch.get_or_insert_with(|| Latch::of(&params.hand, posture, angles_rad)),
            gains: grasp.zip_with(&PerGain::RAMP, |gain, ramp| match ramp {
                Ramp::Force => gain * force_share,
                Ramp::Stiffness => gain * stiffness_share,
            }),
        }),
        _ => {
            *latch = None;
            None
        }
    };
    let Prepared { laws, limits, watch, .. } = &params.prepared;
    let stance = Stance { hand: &params.hand, posture, angles_rad, speeds_rad_s, held: &cycle.held };
    let account = action.account.insert(Account::none());
    let torques_nm = &mut action.torques_nm;
    laws.add_torques(&stance, grip.as_ref(), torques_nm, account);
    stages::torques(params, drive, motion, posture, cycle, account, torques_nm);
    // A limit makes an infinite torque finite: both sides of it are looked at.
    let wanted = watch.torques(torques_nm);
    action.limiting = limits.apply(angles_rad, speeds_rad_s, &state.torques_nm, torques_nm);
    action.not_finite = wanted.or(watch.torques(torques_nm));
}
