//! A hand and its configuration as bytes: what a firmware is built with.
//!
//! ```text
//! postcard of (outputs, hand, named postures, angle of a count of each encoder, tick period, every parameter in the order of its number and its index) | CRC-32
//! ```
//!
//! A parameter that is switched off is not a number. The bytes do not depend on the capacity that the hand is held in, and
//! keep every bit of every number. Their CRC is the hand's hash: equal hands have equal firmware.

use crate::bytes::BufferTooSmall;
use crate::control::{AttitudeError, Chosen, FrameConfig, Hold, LawsConfig, PerGain};
use crate::cycle::{CycleConfig, Postures};
use crate::estimate::{Encoder, EstimatorConfig};
use crate::fault::FaultConfig;
use crate::hand::Hand;
use crate::joints::MotorConfig;
use crate::limit::LimitConfig;
use crate::link::checksum::Checksum;
use crate::list::List;
use crate::parameter::ParameterError;
use crate::parameters::Parameter;
use crate::supervisor::SupervisorConfig;
use crate::tick::{Config, Params};
use core::fmt;
use postcard::Deserializer;
use postcard::de_flavors::Flavor;
use serde::{Deserialize, Serialize};

/// An error in the bytes of a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelError {
    /// They do not have the CRC that they carry.
    Damaged,
    /// They are something else, of another version, or of a hand that is too large.
    Malformed,
    /// A parameter can't be used.
    Parameter(ParameterError),
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damaged => write!(f, "the bytes do not have the CRC that they carry"),
            Self::Malformed => write!(f, "the bytes are no hand of this version and size"),
            Self::Parameter(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for ModelError {}

/// The part between the hand and the parameters.
#[derive(Serialize, Deserialize)]
struct Head<const J: usize> {
    rad_per_count: List<f32, J>,
    period_us: u32,
}

/// Writes a hand, its postures, its configuration, and the torque at each joint for each volt at its amplifier, N m/V, into a buffer;
/// returns the bytes.
///
/// # Errors
/// The buffer is too small.
pub fn encode<'b, const J: usize, const F: usize>(
    hand: &Hand<f32, J, F>,
    postures: &Postures<J>,
    config: &Config<J>,
    torques_per_volt_nm_v: &[f32],
    buffer: &'b mut [u8],
) -> Result<&'b [u8], BufferTooSmall> {
    let joint_count = hand.joint_count();
    let rad_per_count = config.estimator.encoders.map(|encoder| encoder.rad_per_count);
    let head =
        Head { rad_per_count: List::first_of(rad_per_count, joint_count), period_us: config.period_us };
    let mut length = postcard::to_slice(&(torques_per_volt_nm_v, hand, postures, head), buffer)
        .map_err(|_| BufferTooSmall)?
        .len();
    for (parameter, index) in places(joint_count) {
        let value = config.value(joint_count, parameter, index).ok().flatten().unwrap_or(f32::NAN);
        let rest = buffer.get_mut(length..).ok_or(BufferTooSmall)?;
        length += postcard::to_slice(&value, rest).map_err(|_| BufferTooSmall)?.len();
    }
    let (bytes, rest) = buffer.split_at_mut_checked(length).ok_or(BufferTooSmall)?;
    let crc = rest.first_chunk_mut().ok_or(BufferTooSmall)?;
    *crc = Checksum::of(bytes);
    buffer.get(..length + Checksum::BYTES).ok_or(BufferTooSmall)
}

/// Reads what [`encode`] wrote, in whatever capacity, and prepares it.
///
/// # Errors
/// The bytes are something else or damaged, the hand is larger than the capacity, or a parameter can't be used.
#[inline(never)]
pub fn decode<const J: usize, const F: usize>(bytes: &[u8]) -> Result<Params<J, F>, ModelError> {
    let mut reader = reader(bytes)?;
    let output_count = read_outputs::<J>(&mut reader)?.len();
    let hand = read_hand(&mut reader)?;
    if output_count != hand.joint_count() {
        return Err(ModelError::Malformed);
    }
    let postures = read_postures(&mut reader)?;
    let config = read_config(&mut reader, hand.joint_count())?;
    match reader.finalize() {
        Ok([]) => Params::of(hand, postures, &config).map_err(ModelError::Parameter),
        _ => Err(ModelError::Malformed),
    }
}

/// Reads the torque at each joint for each volt at its amplifier, N m/V, of what [`encode`] wrote.
///
/// # Errors
/// The bytes are something else or damaged, or the hand has another number of joints.
pub fn torques_per_volt_nm_v<const J: usize>(bytes: &[u8]) -> Result<[f32; J], ModelError> {
    let outputs = read_outputs::<J>(&mut reader(bytes)?)?;
    outputs.as_slice().try_into().map_err(|_| ModelError::Malformed)
}

type Reader<'a> = Deserializer<'a, Unread<'a>>;

/// Returns what reads the bytes, if they have their CRC.
#[inline(never)]
fn reader(bytes: &[u8]) -> Result<Reader<'_>, ModelError> {
    let (bytes, crc) = bytes.split_last_chunk().ok_or(ModelError::Damaged)?;
    if *crc != Checksum::of(bytes) {
        return Err(ModelError::Damaged);
    }
    Ok(Deserializer::from_flavor(Unread(bytes)))
}

// These are not inlined so that what they have on the stack is gone when the parameters are prepared.
#[inline(never)]
fn read_outputs<const J: usize>(reader: &mut Reader<'_>) -> Result<List<f32, J>, ModelError> {
    List::deserialize(reader).map_err(|_| ModelError::Malformed)
}

#[inline(never)]
fn read_hand<const J: usize, const F: usize>(reader: &mut Reader<'_>) -> Result<Hand<f32, J, F>, ModelError> {
    Hand::deserialize(reader).map_err(|_| ModelError::Malformed)
}

#[inline(never)]
fn read_postures<const J: usize>(reader: &mut Reader<'_>) -> Result<Postures<J>, ModelError> {
    Postures::deserialize(reader).map_err(|_| ModelError::Malformed)
}

#[inline(never)]
fn read_config<const J: usize>(reader: &mut Reader<'_>, joint_count: usize) -> Result<Config<J>, ModelError> {
    let head = Head::deserialize(&mut *reader).map_err(|_| ModelError::Malformed)?;
    let mut config = least(&head);
    for (parameter, index) in places(joint_count) {
        let value = f32::deserialize(&mut *reader).map_err(|_| ModelError::Malformed)?;
        let value = (!value.is_nan()).then_some(value);
        config.put(joint_count, parameter, index, value).map_err(|_| ModelError::Malformed)?;
    }
    Ok(config)
}

/// Returns a configuration of nothing but zeros and what is switched off.
fn least<const J: usize>(head: &Head<J>) -> Config<J> {
    let mut encoders = [Encoder::default(); J];
    for (encoder, rad_per_count) in encoders.iter_mut().zip(head.rad_per_count.iter()) {
        encoder.rad_per_count = *rad_per_count;
    }
    Config {
        period_us: head.period_us,
        estimator: EstimatorConfig { bandwidth_hz: 0.0, encoders },
        motors: MotorConfig::FORWARD,
        laws: LawsConfig {
            gains: PerGain::all(0.0),
            chosen: Chosen::NONE,
            frame: FrameConfig::least(),
            attitude_error: AttitudeError::Sine,
            hold: Hold { damping_nm_s: [0.0; J], gravity_m_s2: None },
        },
        limits: LimitConfig::NONE,
        faults: FaultConfig::LEAST,
        supervisor: SupervisorConfig::LEAST,
        cycle: CycleConfig::LEAST,
    }
}

/// Returns every parameter with each of its indices, in a hand of so many joints.
fn places(joint_count: usize) -> impl Iterator<Item = (Parameter, u8)> {
    let all = Parameter::ALL.into_iter();
    all.flat_map(move |parameter| (0..parameter.count(joint_count)).map(move |index| (parameter, index)))
}

/// Bytes to be read. As postcard's own, but not inlined at each of the numbers of a hand, which are many.
struct Unread<'a>(&'a [u8]);

impl<'a> Flavor<'a> for Unread<'a> {
    type Remainder = &'a [u8];
    type Source = &'a [u8];

    #[inline(never)]
    fn pop(&mut self) -> postcard::Result<u8> {
        let (&first, rest) = self.0.split_first().ok_or(postcard::Error::DeserializeUnexpectedEnd)?;
        self.0 = rest;
        Ok(first)
    }

    #[inline(never)]
    fn try_take_n(&mut self, count: usize) -> postcard::Result<&'a [u8]> {
        let (first, rest) =
            self.0.split_at_checked(count).ok_or(postcard::Error::DeserializeUnexpectedEnd)?;
        self.0 = rest;
        Ok(first)
    }

    fn finalize(self) -> postcard::Result<&'a [u8]> {
        Ok(self.0)
    }
}

/// The hash of the hand in what [`encode`] wrote.
pub fn hash(bytes: &[u8]) -> u32 {
    bytes.last_chunk().map_or(0, |crc| u32::from_le_bytes(*crc))
}
