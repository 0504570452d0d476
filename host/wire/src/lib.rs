//! The wire, as the host has it: the messages of a hand of any size, and what they say.

use blindgrasp_body::MAX_JOINTS;
use blindgrasp_shared::command::{Move, Refusal};
use blindgrasp_shared::control::{GAIN_COUNT, Signal};
use blindgrasp_shared::estimate::Encoder;
use blindgrasp_shared::identity::{BrownOut, Clock, Crash, Identity, ResetCause, Restored};
use blindgrasp_shared::link::message;
use blindgrasp_shared::math::Real as _;
use blindgrasp_shared::parameters::{Parameter, Setting};
use blindgrasp_shared::signals::Value;
use blindgrasp_shared::telemetry::{self, INTERFACE_VERSION};

/// A request with its session and number.
pub type Packet = message::Packet<MAX_JOINTS>;
/// A request.
pub type Request = message::Request<MAX_JOINTS>;
/// The joints of a tick.
pub type Sample = message::Sample<MAX_JOINTS>;
/// The record of a tick.
pub type Record = telemetry::Record<MAX_JOINTS>;

/// The identity of a firmware. Its texts are [printable].
#[derive(Clone, Debug, PartialEq)]
pub struct Firmware {
    /// All of it in a line.
    pub words: String,
    /// `hand` or `pil`.
    pub kind: String,
    /// Name of its hand.
    pub hand: String,
    /// CRC-32 of its hand's model and configuration.
    pub hand_hash: u32,
    /// Joints of its hand.
    pub joint_count: usize,
    /// The source of its clock.
    pub clock: Clock,
    /// The cause of its start.
    pub reset: ResetCause,
    /// The crash in which it ended before, if it did.
    pub crash: Option<Crash>,
    /// Level of its brown-out reset.
    pub brown_out: BrownOut,
    /// Frequency of the clock that its cycles are counted in, Hz; 0 where nothing counts them.
    pub clock_hz: u32,
    /// The parameters that differ from the hand's file.
    pub changed: Vec<Parameter>,
    /// The result of restoring the saved parameters at its start; `None` where there is nothing to save to.
    pub restored: Option<Restored>,
}

impl From<&Identity<'_>> for Firmware {
    fn from(identity: &Identity<'_>) -> Self {
        let &Identity { image, clock, reset, crash, brown_out, clock_hz, changed, restored, .. } = identity;
        let is_changed = |parameter: &Parameter| changed & (1 << parameter.number()) != 0;
        Self {
            words: printable(&image.to_string()),
            kind: printable(image.kind),
            hand: printable(image.hand),
            hand_hash: image.hand_hash,
            joint_count: usize::from(image.joint_count),
            clock,
            reset,
            crash,
            brown_out,
            clock_hz,
            changed: Parameter::ALL.into_iter().filter(is_changed).collect(),
            restored,
        }
    }
}

/// The answer to a request.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// To `Hello`.
    Identity {
        /// Number of the session.
        session: u16,
        /// The identity.
        firmware: Firmware,
    },
    /// It is done.
    Done,
    /// It was refused.
    Refused(Refusal),
    /// To `GetParameter`.
    Value(Setting),
    /// To `Burst`.
    Burst {
        /// The number of records.
        count: u16,
        /// The one that was asked for.
        record: Box<Record>,
    },
}

/// The results of a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Turned {
    /// The answer to the request that it took.
    pub answer: Option<Answer>,
    /// The record.
    pub record: Record,
}

/// Takes the value of a parameter among the encoders of a hand, if it is a sign or a zero of theirs.
pub fn take_encoder(encoders: &mut [Encoder], parameter: Parameter, index: u8, value: f32) {
    if let Some(encoder) = encoders.get_mut(usize::from(index)) {
        match parameter {
            Parameter::ENCODER_REVERSED => encoder.reversed = value != 0.0,
            Parameter::ENCODER_ZERO => encoder.zero_count = value as i32,
            _ => {}
        }
    }
}

/// The interface version of a firmware whose introduction can't be read: that is what every version begins with.
pub fn other_interface(payload: &[u8]) -> Option<u16> {
    let (identity, _, _, theirs) = postcard::take_from_bytes::<(u8, u16, u16, u16)>(payload).ok()?.0;
    (identity == 0 && theirs != INTERFACE_VERSION).then_some(theirs)
}

/// A text of a device, or of a file, as a terminal may show it: what is no letter, sign or space that can be seen is escaped, and so is
/// what turns a line around.
pub fn printable(text: &str) -> String {
    let mut clean = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\'' | '"' | '\\' => clean.push(c),
            c => clean.extend(c.escape_debug()),
        }
    }
    clean
}

/// A request in words.
pub fn in_words(packet: Option<&Packet>) -> String {
    let Some(packet) = packet else { return "the joints of a tick".to_owned() };
    match packet.request {
        Request::Hello { .. } => "`hello`".to_owned(),
        Request::Command(command) => format!("`{}`", command.words()),
        Request::Heartbeat => "a heartbeat".to_owned(),
        Request::SetParameter { parameter, index, value } => format!("`{parameter}` [{index}] = {value}"),
        Request::GetParameter { parameter, index } => format!("what `{parameter}` [{index}] is"),
        Request::Telemetry { .. } => "`telemetry`".to_owned(),
        Request::Burst { index } => format!("record {index} of the burst"),
        Request::Joints(_) => "the joints of a tick".to_owned(),
        Request::Goodbye => "goodbye".to_owned(),
        Request::Rate { baud } => format!("a line of {baud} baud"),
        Request::Zero { .. } => "`zero`".to_owned(),
        Request::Confirm => "`confirm`".to_owned(),
        Request::Save => "`save`".to_owned(),
        Request::Defaults => "`defaults`".to_owned(),
    }
}

/// Returns the numbers of a record on the whole hand that are worth a plot, in the order of the table of signals: real
/// ones, and the time that the tick took.
pub fn scalars(record: &Record) -> Vec<(Signal, f32)> {
    let mut scalars = Vec::with_capacity(16);
    record.tell(|told| match told.value {
        Value::Real(value) => scalars.push((told.signal, value)),
        Value::Whole(cycles) if told.signal.unit == "cycles" => scalars.push((told.signal, cycles as f32)),
        _ => {}
    });
    scalars
}

/// Returns the way and the turn of what is held since the grasp began, as a command would ask for them.
pub fn held(record: &Record) -> Move {
    let [x_m, y_m, z_m, turn @ ..] = record.law_signals.frame;
    Move { position_m: [x_m, y_m, z_m], turn_rad: rotation_vector_rad(turn), ..Move::default() }
}

/// Returns the rotation vector, rad, of an axis times the sine of half the angle.
pub fn rotation_vector_rad(axis_sine: [f32; 3]) -> [f32; 3] {
    let sine = axis_sine.iter().map(|v| v * v).sum::<f32>().square_root();
    let per_sine = if sine > 0.0 { 2.0 * sine.min(1.0).asin() / sine } else { 2.0 };
    axis_sine.map(|v| v * per_sine)
}

/// The scalars that are potentials of the laws: behind their gains.
pub const fn potentials() -> std::ops::Range<usize> {
    GAIN_COUNT..2 * GAIN_COUNT
}

/// A signal's name for readers: without the unit at its end, and with spaces.
pub fn label(signal: &Signal) -> String {
    let unit: String = signal.unit.to_lowercase().replace(' ', "").replace('/', "_");
    let bare = signal.key.strip_suffix(&unit).and_then(|key| key.strip_suffix('_'));
    bare.filter(|_| !unit.is_empty()).unwrap_or(signal.key).replace('_', " ")
}
