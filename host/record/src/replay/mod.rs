//! A recording through the controller again.
//!
//! The hand is made anew from its recorded file, its parameters from those that were in force, and its state from the
//! snapshots that the device sent, or from nothing where the recording begins with the device's first tick. Every
//! recorded tick's counts, events and command then go through the same `tick`, and what comes out is compared with the
//! record: all bits of a full record, the digest of all bits of an input record.
//!
//! ```text
//! entries --> Hearing: payloads to items --> Follower: state, tick, compare --> Report
//! ```
//!
//! What can't be computed is no difference. Where ticks are missing, or parameters have changed, the state is unknown until
//! the device has told it again; records from the snapshot's tick on are kept until the snapshot is whole, so that no more
//! than has to be remains unreplayed. Each such [`Gap`] is reported with its reason.
//!
//! With [`Change`]s every tick is computed twice, once with other parameters, and the torques are compared: **open loop**,
//! since the counts are those that the recorded torques led to.

mod change;
mod follower;
mod hearing;
mod model;
mod open_loop;
mod report;

pub use change::{Change, ChangeError};
pub use follower::Follower;
pub use hearing::{Hearing, Item, Told};
pub use report::{JointChange, LimitShare, OpenLoop, Raising, Report};

use crate::mcap::{Entry, RecordingError};
use blindgrasp_model::{HandModel, SceneError};
use blindgrasp_shared::parameter::ParameterError;
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use serde::Serialize;
use std::fmt;
use std::sync::mpsc;
use std::thread;

/// Items that go from one thread to the other at once, and how many such batches may wait.
const BATCH: usize = 512;
const BATCHES: usize = 8;

/// The replay that is wanted.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// The hand, in place of the recorded one.
    pub hand: Option<HandModel>,
    /// Parameters that are to be otherwise.
    pub changes: Vec<Change>,
    /// The changes as they were typed.
    pub typed: Vec<String>,
    /// Compare from this time on, s since the beginning of the recording.
    pub from_s: Option<f64>,
    /// Compare up to this time, s.
    pub until_s: Option<f64>,
}

/// The reason for which something can't be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The recording can't be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The file of the hand, with this hash, is not in the recording.
    #[error("the recording does not hold the file of the hand `{}` ({:08x}): give it with --hand", .0, .1)]
    UnknownHand(String, u32),
    /// The firmware was built for one hand, and this is another.
    #[error("the firmware was built for the hand {}, and this one is {}: give the right one with --hand", .0, .1)]
    OtherHand(String, String),
    /// The hand's file in the recording is damaged.
    #[error("{0}; the right one can be given with --hand")]
    Hand(SceneError),
    /// The device speaks another interface version, that of a release.
    #[error("the device had interface version {}, and this program has {INTERFACE_VERSION}: replay with the release {}", .0, .1)]
    OtherInterface(u16, String),
    /// A recorded parameter, of this joint or axis, can't be.
    #[error("the recorded parameter `{}` [{}] does not fit the hand: {}", .0, .1, .2)]
    Setting(Parameter, u8, &'static str),
    /// The recorded parameters can't be used.
    #[error("the controller refuses the recorded parameters: {0}")]
    Parameters(ParameterError),
    /// A change can't be made.
    #[error("--set {0}")]
    Change(#[from] ChangeError),
    /// The changed parameters can't be used.
    #[error("the controller refuses the parameters of --set: {0}")]
    Changed(ParameterError),
    /// There is nothing to replay.
    #[error("no tick can be replayed: {0}")]
    Nothing(String),
}

/// Ticks that are missing or were not replayed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gap {
    /// Its beginning, since the beginning of the recording, s.
    pub time_s: f64,
    /// Its first tick.
    pub from_tick: u32,
    /// Its last tick.
    pub until_tick: u32,
    /// Ticks whose records are missing.
    pub missing: u64,
    /// Records that were not replayed.
    pub not_replayed: u64,
    /// The reason.
    pub reason: Reason,
}

/// The reason for which ticks could not be replayed.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// The state before the first snapshot is not known.
    Start,
    /// Records were lost on their way.
    Lost,
    /// The link was cut.
    Cut(String),
    /// The device started anew.
    Restarted,
    /// A parameter was changed, or may have been.
    ParametersChanged,
    /// The parameters of a session are not known.
    ParametersUnknown,
    /// Only some of the records were sent.
    Decimated(u16),
    /// Records without counts.
    NoCounts,
    /// A snapshot that can't be read.
    BadSnapshot(String),
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start => f.write_str("the state before the first snapshot is not known"),
            Self::Lost => f.write_str("records were lost"),
            Self::Cut(words) => write!(f, "the link was cut ({words})"),
            Self::Restarted => f.write_str("the device started anew"),
            Self::ParametersChanged => f.write_str("parameters were changed"),
            Self::ParametersUnknown => f.write_str("the parameters in force are not known"),
            Self::Decimated(ticks) => write!(f, "one record in {ticks} ticks was sent"),
            Self::NoCounts => f.write_str("the records have no counts (ideal sensors, or sent without them)"),
            Self::BadSnapshot(words) => write!(f, "a snapshot can't be read: {words}"),
        }
    }
}

impl Reason {
    /// Returns the remedy for the next time.
    fn remedy(&self) -> &'static str {
        match self {
            Self::Start | Self::BadSnapshot(_) => "record with snapshots, for at least two seconds",
            Self::NoCounts => "record a hand with encoders, with all signals",
            Self::Decimated(_) => "record at the full rate, over a line that is fast enough",
            Self::ParametersUnknown => "record with `blindgrasp record`, which asks for them",
            Self::Lost | Self::Cut(_) | Self::Restarted | Self::ParametersChanged => "record for longer",
        }
    }
}

/// Replays entries of a recording that begins at `start_ns`. Entries of other devices than the one of this number are
/// passed over; `name` is its name. `each` is called now and then with the entries.
///
/// # Errors
/// Why nothing can be replayed.
pub fn replay<E: Iterator<Item = Result<Entry, RecordingError>> + Send>(
    entries: &mut E,
    each: impl Fn(&E) + Send,
    device: usize,
    name: &str,
    start_ns: u64,
    wanted: Wanted,
) -> Result<Report, ReplayError> {
    let until_s = wanted.until_s.unwrap_or(f64::INFINITY);
    let mut follower = Follower::new(name, wanted);
    thread::scope(|scope| {
        let (sender, receiver) = mpsc::sync_channel::<Vec<Item>>(BATCHES);
        let heard = scope.spawn(move || -> Result<(), RecordingError> {
            let hearing = Hearing::new(start_ns);
            let mut batch = Vec::with_capacity(BATCH);
            while let Some(entry) = entries.next() {
                let entry = entry?;
                if entry.device != device {
                    continue;
                }
                if hearing.seconds(entry.at) > until_s {
                    break;
                }
                batch.extend(hearing.take(entry));
                if batch.len() >= BATCH {
                    each(entries);
                    let full = std::mem::replace(&mut batch, Vec::with_capacity(BATCH));
                    if sender.send(full).is_err() {
                        // The follower has found why it can't go on.
                        return Ok(());
                    }
                }
            }
            let _ = sender.send(batch);
            Ok(())
        });
        let followed = receiver.iter().flatten().try_for_each(|item| follower.take(item));
        drop(receiver);
        let heard = heard.join().unwrap_or(Ok(()));
        followed?;
        heard?;
        follower.finish()
    })
}
