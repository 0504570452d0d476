//! The joints: encoder counts in, torques out, once a tick.
//!
//! [`BoardJoints`] are those of the real hand: a [counter](ls7366r) for each joint, and [DACs](dac) whose outputs are
//! the torque inputs of the amplifiers. Other [`Joints`] may be a simulation behind the link.
//!
//! ```text
//!            all tests passed               failure
//! Testing ----------------------> Tested    Running -----> Testing
//!    ^  | a test failed: again      |          ^
//!    +--+                           +----------+ recover: start
//! ```
//!
//! - **Running**: each tick reads every counter with its status, and reads back the settings of one counter and the
//!   power, and code of one output, in turn.
//! - **A failure** switches everything off at once, in two ways that do not need each other: the amplifiers by their
//!   enable pin, and the DACs over SPI. A DAC that can't be reached any more would keep its last voltage. The driver reports it in every tick from then on, and uses the time
//!   in which it need not read to repeat the self-test, one chip a tick; what is reported is what the last test
//!   found, so that after one cable is mended the next one is named.
//! - **Tested**, it reads the counts that the joints would begin with: those of the counters that kept their power, and
//!   0 of the others. So what else is wrong is known before the fault is cleared.
//! - **[`recover`](Joints::recover)** ends that, if the self-test has passed: it belongs to the user's command to clear
//!   the fault, once the tick has taken it. It takes little time, because all tests are done. Counters that kept their
//!   power go on with the count they have; those that lost it count from 0 from that moment, so the joint has to be put
//!   to its starting posture before.
//! - **The enable pin** is high only where the tick wants torque ([`write`](Joints::write)), after the first torque was
//!   written: no torque does not hang on the DACs' zero.
//!
//! Boot is the same, without waiting: [`BoardJoints::new`] switches the outputs off before anything else, tests
//! everything and starts, or comes back as failed.

pub mod dac;
pub mod ls7366r;

use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::joints::{Joints, Reading};
use core::fmt;
use dac::{CHANNELS, CODES_PER_VOLT, Dac, DacError};
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;
use ls7366r::{Counter, CounterError, FilterClock, Zero};

/// The way from a torque to a voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputConfig {
    /// Torque at the joint for each volt at the amplifier's input, N m/V.
    pub nm_per_volt: f32,
}

/// The board's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointsConfig<const J: usize> {
    /// Clock of the counters' filters.
    pub filter_clock: FilterClock,
    /// Each joint's output: joint `k` is output `k % 4` of DAC `k / 4`.
    pub outputs: [OutputConfig; J],
}

/// An error in the numbers of the joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConfigError {
    /// The DACs do not have an output for every joint, or one of them has none to drive.
    Outputs {
        /// Joints.
        joints: usize,
        /// DACs, of four outputs each.
        dacs: usize,
    },
    /// `nm_per_volt` is zero or no finite number, or so small that a volt is not a number of codes.
    Scale {
        /// The joint.
        joint: usize,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Outputs { joints, dacs } => {
                let needed = joints.div_ceil(CHANNELS);
                write!(f, "{joints} joints need {needed} DACs of {CHANNELS} outputs, there are {dacs}")
            }
            Self::Scale { joint } => write!(f, "joint {joint}: nm_per_volt has to be finite and not zero"),
        }
    }
}

impl core::error::Error for ConfigError {}

/// A fault of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The joint; for a DAC as a whole, the joint of its first output.
    pub joint: usize,
    /// The fault.
    pub cause: Cause,
}

/// The fault of one of a joint's two chips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The counter.
    Counter(CounterError),
    /// The DAC.
    Output(DacError),
    /// The pin that enables the amplifiers of all joints.
    Enable,
}

impl Failure {
    const fn of_counter(joint: usize, error: CounterError) -> Self {
        Self { joint, cause: Cause::Counter(error) }
    }

    const fn of_output(dac: usize, error: DacError) -> Self {
        Self { joint: dac * CHANNELS + error.channel() as usize, cause: Cause::Output(error) }
    }

    /// The numbered fault that the supervisor is told.
    pub fn raised(&self) -> Raised {
        let fault = match self.cause {
            Cause::Counter(error) => error.fault(),
            Cause::Output(_) | Cause::Enable => Fault::OutputFailed,
        };
        Raised::at(self.joint, fault)
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.cause {
            Cause::Counter(error) => write!(f, "joint {}: {error}", self.joint),
            Cause::Output(error) => write!(f, "joint {}: {error}", self.joint),
            Cause::Enable => write!(f, "the pin that enables the amplifiers can't be set"),
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// Counters count, and outputs are on.
    Running,
    /// Outputs are off; `step` is the next step of the self-test.
    Testing { failure: Failure, step: usize },
    /// Outputs are off; the self-test has passed since.
    Tested { failure: Failure },
}

/// The joints of the real hand: `J` counters, `D` DACs of four outputs each, and a pin that enables all amplifiers.
#[derive(Debug)]
pub struct BoardJoints<C, O, E, const J: usize, const D: usize> {
    counters: [Counter<C>; J],
    dacs: [Dac<O>; D],
    /// High enables the amplifiers.
    enable: E,
    codes_per_nm: [f32; J],
    /// The codes that were loaded last.
    codes: [i16; J],
    /// The result of the self-test: which counters begin at 0.
    zeros: [Zero; J],
    state: State,
    /// The joint whose counter's settings are read back next.
    next_counter: usize,
    /// The joint whose output is read back next.
    next_output: usize,
}

impl<C: SpiDevice, O: SpiDevice, E: OutputPin, const J: usize, const D: usize> BoardJoints<C, O, E, J, D> {
    /// Switches everything off, tests all chips, and starts them. Takes about 4 ms for 12 joints. That a test failed
    /// is no error here: [`failure`](Self::failure) and every [`collect`](Joints::collect) tell it.
    ///
    /// The pin `enable` enables the amplifiers of all joints while it is high; a resistor has to hold it low until then.
    ///
    /// # Errors
    /// The numbers can't be those of a board.
    pub fn new(
        counters: [C; J],
        dacs: [O; D],
        mut enable: E,
        config: &JointsConfig<J>,
    ) -> Result<Self, ConfigError> {
        // Before anything else: after a reset the outputs may still be on.
        let mut dacs = dacs.map(Dac::new);
        switch_off(&mut enable, &mut dacs);
        if J == 0 || J.div_ceil(CHANNELS) != D {
            return Err(ConfigError::Outputs { joints: J, dacs: D });
        }
        let mut codes_per_nm = [0.0; J];
        for (joint, (codes_per_nm, output)) in codes_per_nm.iter_mut().zip(&config.outputs).enumerate() {
            *codes_per_nm = CODES_PER_VOLT / output.nm_per_volt;
            if !(codes_per_nm.is_finite() && *codes_per_nm != 0.0) {
                return Err(ConfigError::Scale { joint });
            }
        }
        let untested = Failure::of_counter(0, CounterError::Silent { level: 0 });
        let mut joints = Self {
            counters: counters.map(|spi| Counter::new(spi, config.filter_clock)),
            dacs,
            enable,
            codes_per_nm,
            codes: [0; J],
            zeros: [Zero::Lost; J],
            state: State::Testing { failure: untested, step: 0 },
            next_counter: 0,
            next_output: 0,
        };
        while let State::Testing { failure, step } = joints.state {
            joints.test(failure, step);
            if matches!(joints.state, State::Testing { step: 0, .. }) {
                break;
            }
        }
        joints.recover();
        // Whether the counters count: a failure is told by the next reading.
        joints.collect();
        Ok(joints)
    }

    /// Returns the fault, in words; `None` while the joints work.
    pub const fn failure(&self) -> Option<Failure> {
        match self.state {
            State::Running => None,
            State::Testing { failure, .. } | State::Tested { failure } => Some(failure),
        }
    }

    /// Returns of each counter that it kept its count when it was last tested, or began at 0 when it was started.
    pub const fn zeros(&self) -> &[Zero; J] {
        &self.zeros
    }

    /// Switches everything off, and begins to test.
    fn fail(&mut self, failure: Failure) -> Raised {
        switch_off(&mut self.enable, &mut self.dacs);
        self.codes = [0; J];
        self.state = State::Testing { failure, step: 0 };
        failure.raised()
    }

    /// A step of the self-test, a chip each: all counters, all counters once more, all DACs.
    fn test(&mut self, failure: Failure, step: usize) {
        self.state = match self.step(step) {
            Err(failure) => State::Testing { failure, step: 0 },
            Ok(()) if step + 1 >= 2 * J + D => State::Tested { failure },
            Ok(()) => State::Testing { failure, step: step + 1 },
        };
    }

    fn step(&mut self, step: usize) -> Result<(), Failure> {
        if let Some(dac) = step.checked_sub(2 * J).and_then(|k| self.dacs.get_mut(k)) {
            return dac.prepare().map_err(|error| Failure::of_output(step - 2 * J, error));
        }
        let joint = step % J;
        let (Some(counter), Some(zero)) = (self.counters.get_mut(joint), self.zeros.get_mut(joint)) else {
            return Ok(());
        };
        let result = if step < J {
            counter.prepare(tag(joint)).map(|found| *zero = found)
        } else if *zero == Zero::Lost {
            counter.identify(tag(joint))
        } else {
            Ok(())
        };
        result.map_err(|error| Failure::of_counter(joint, error))
    }

    fn start(&mut self) -> Result<(), Failure> {
        for (joint, (counter, zero)) in self.counters.iter_mut().zip(&self.zeros).enumerate() {
            if *zero == Zero::Lost {
                counter.start().map_err(|error| Failure::of_counter(joint, error))?;
            }
        }
        for (k, dac) in self.dacs.iter_mut().enumerate() {
            dac.start().map_err(|error| Failure::of_output(k, error))?;
        }
        Ok(())
    }

    /// Gives the amplifiers power, or takes it.
    fn enable(&mut self, powered: bool) -> Result<(), Failure> {
        let set = if powered { self.enable.set_high() } else { self.enable.set_low() };
        set.map_err(|_| Failure { joint: 0, cause: Cause::Enable })
    }

    /// The counts that the joints would begin with, were the fault cleared now.
    fn first_counts(&mut self) -> Result<[i32; J], Failure> {
        let mut counts = [0; J];
        let counters = self.counters.iter_mut().zip(&self.zeros);
        for (joint, ((counter, zero), count)) in counters.zip(&mut counts).enumerate() {
            let found = match zero {
                Zero::Kept => counter.read(),
                Zero::Lost => counter.identify(tag(joint)).map(|()| 0),
            };
            *count = found.map_err(|error| Failure::of_counter(joint, error))?;
        }
        Ok(counts)
    }

    fn read_counts(&mut self) -> Result<[i32; J], Failure> {
        let mut counts = [0; J];
        for (joint, (counter, count)) in self.counters.iter_mut().zip(&mut counts).enumerate() {
            *count = counter.read().map_err(|error| Failure::of_counter(joint, error))?;
        }
        let joint = advance(&mut self.next_counter, J);
        if let Some(counter) = self.counters.get_mut(joint) {
            counter.verify().map_err(|error| Failure::of_counter(joint, error))?;
        }
        Ok(counts)
    }

    /// Writes all codes, lets them act together, and reads one of them back.
    fn write_codes(&mut self) -> Result<(), Failure> {
        for (k, (dac, codes)) in self.dacs.iter_mut().zip(self.codes.chunks(CHANNELS)).enumerate() {
            for (channel, &code) in (0..).zip(codes) {
                dac.set_code(channel, code).map_err(|error| Failure::of_output(k, error))?;
            }
        }
        for (k, dac) in self.dacs.iter_mut().enumerate() {
            dac.load().map_err(|error| Failure::of_output(k, error))?;
        }
        let joint = advance(&mut self.next_output, J);
        if let (Some(dac), Some(&code)) = (self.dacs.get_mut(joint / CHANNELS), self.codes.get(joint)) {
            let channel = (joint % CHANNELS) as u8;
            dac.verify(channel, code).map_err(|error| Failure::of_output(joint / CHANNELS, error))?;
        }
        Ok(())
    }
}

impl<C: SpiDevice, O: SpiDevice, E: OutputPin, const J: usize, const D: usize> Joints<J>
    for BoardJoints<C, O, E, J, D>
{
    fn collect(&mut self) -> Reading<J> {
        match self.state {
            State::Running => match self.read_counts() {
                Ok(counts) => Reading::Counts(counts),
                Err(failure) => Reading::Failed(self.fail(failure)),
            },
            State::Testing { failure, step } => {
                self.test(failure, step);
                Reading::Failed(self.failure().unwrap_or(failure).raised())
            }
            State::Tested { failure } => match self.first_counts() {
                Ok(counts) => Reading::Tested { raised: failure.raised(), counts },
                Err(failure) => Reading::Failed(self.fail(failure)),
            },
        }
    }

    fn write(&mut self, torques_nm: &[f32; J], powered: bool) -> Option<Raised> {
        if !matches!(self.state, State::Running) {
            // Once more: the first time may have been lost on the bus. What is wrong, `collect` has told.
            switch_off(&mut self.enable, &mut self.dacs);
            return None;
        }
        let mut raised = None;
        let scales = torques_nm.iter().zip(&self.codes_per_nm);
        for (joint, (code, (&torque_nm, &codes_per_nm))) in self.codes.iter_mut().zip(scales).enumerate() {
            *code = nearest_code(torque_nm, codes_per_nm);
            if !torque_nm.is_finite() && raised.is_none() {
                raised = Some(Raised::at(joint, Fault::NotFinite));
            }
        }
        // Power goes before the torques do, and comes after them.
        let off = if powered { Ok(()) } else { self.enable(false) };
        match off
            .and_then(|()| self.write_codes())
            .and_then(|()| if powered { self.enable(true) } else { Ok(()) })
        {
            Ok(()) => raised,
            Err(failure) => Some(self.fail(failure)),
        }
    }

    fn recover(&mut self) {
        if matches!(self.state, State::Tested { .. }) {
            match self.start() {
                Ok(()) => self.state = State::Running,
                Err(failure) => {
                    self.fail(failure);
                }
            }
        }
    }
}

/// Switches amplifiers and outputs off, as far as they can be reached.
fn switch_off<E: OutputPin, O: SpiDevice>(enable: &mut E, dacs: &mut [Dac<O>]) {
    let _ = enable.set_low();
    for dac in dacs {
        let _ = dac.silence();
    }
}

/// The code nearest to a torque, at most full scale; that of 0 N m if it is not a finite number.
fn nearest_code(torque_nm: f32, codes_per_nm: f32) -> i16 {
    if !torque_nm.is_finite() {
        return 0;
    }
    let code = torque_nm * codes_per_nm;
    // The conversion rounds towards zero and saturates.
    (if code < 0.0 { code - 0.5 } else { code + 0.5 }) as i16
}

/// A count that no other joint has, and that is not a pattern of a stuck line.
fn tag(joint: usize) -> u32 {
    0x5A00_00A5 | ((joint as u32 & 0xFFFF) << 8)
}

/// The index, and the next one round.
fn advance(next: &mut usize, count: usize) -> usize {
    let now = *next;
    *next = if now + 1 >= count { 0 } else { now + 1 };
    now
}
