//! A recording, told again as it was, in its own time or faster.
//!
//! It can only be read forwards. To go back it is read again from its beginning, a part of it with each turn, so that keys
//! are still heard meanwhile.

use super::exchange::Exchange;
use super::live::known_hand;
use super::model::{Level, Model, News, Session};
use crate::record::mcap::{self, About, Decoder, Entries, Entry, Recording, RecordingError, Stamp, What};
use crate::scene::HandModel;
use std::path::Path;
use std::time::{Duration, Instant};

/// Bytes of a frame besides its payload: CRC-32, COBS and the end of the frame.
const FRAME_BYTES: u64 = 4 + 1 + 1;
/// How much faster it can be played, and slower: so many times twice.
const MOST_DOUBLINGS: i32 = 6;
/// How long a turn may take to catch up.
const TURN: Duration = Duration::from_millis(30);
/// Entries from one look at the clock to the next.
const BATCH: usize = 256;

/// Why a recording can't be played.
#[derive(Debug, thiserror::Error)]
pub enum PlaybackError {
    /// It can't be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// It has no such device.
    #[error("there is no device `{name}` in this recording: it has {}", .known.join(", "))]
    NoSuchDevice {
        /// What was wanted.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// There is nothing in it.
    #[error("the recording is empty")]
    Empty,
}

/// A recording that is being played.
pub struct Playback {
    recording: Recording,
    device: usize,
    hand: Option<String>,
    begin: Stamp,
    end: Stamp,
    entries: Entries,
    /// Read, but its time has not come.
    next: Option<Entry>,
    has_ended: bool,
    decoder: Decoder,
    exchange: Exchange,
    model: Model,
    /// How far it should be told.
    wanted: Duration,
    /// How far it is.
    told: Duration,
    doublings: i32,
    is_paused: bool,
}

impl Playback {
    /// Opens a recording. `device` is the name of one of its devices, the first if there is none; `hand` the file of its hand,
    /// if the recording does not have it.
    ///
    /// # Errors
    /// If it can't be played.
    pub fn open(path: &Path, device: Option<&str>, hand: Option<&str>) -> Result<Self, PlaybackError> {
        let recording = Recording::open(path)?;
        let known = recording.devices();
        let device = match device {
            Some(name) => known
                .iter()
                .position(|known| known == name)
                .ok_or_else(|| PlaybackError::NoSuchDevice { name: name.into(), known: known.to_vec() })?,
            None => 0,
        };
        let (begin, end) = recording.span().filter(|_| !known.is_empty()).ok_or(PlaybackError::Empty)?;
        Ok(Self {
            entries: recording.entries()?,
            recording,
            device,
            hand: hand.map(str::to_owned),
            begin,
            end,
            next: None,
            has_ended: false,
            decoder: Decoder::new(),
            exchange: Exchange::default(),
            model: Model::new(),
            wanted: Duration::ZERO,
            told: Duration::ZERO,
            doublings: 0,
            is_paused: false,
        })
    }

    /// What is known where it is.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Where it is: time since the beginning of the recording.
    pub fn position(&self) -> Duration {
        if self.is_seeking() { self.told } else { self.wanted }
    }

    /// How long it is.
    pub fn length(&self) -> Duration {
        Duration::from_nanos(self.end.0.saturating_sub(self.begin.0))
    }

    /// Name of the device, and of how many.
    pub fn device(&self) -> (&str, usize) {
        let known = self.recording.devices();
        (known.get(self.device).map_or("", String::as_str), known.len())
    }

    /// How much faster than it was it is played.
    pub fn speed(&self) -> f64 {
        2.0_f64.powi(self.doublings)
    }

    /// Whether it waits.
    pub fn is_paused(&self) -> bool {
        self.is_paused
    }

    /// Whether it is still on its way.
    pub fn is_seeking(&self) -> bool {
        !self.has_ended && self.told < self.wanted
    }

    /// Waits, or goes on; at its end, from the beginning.
    pub fn pause(&mut self) -> Result<(), PlaybackError> {
        self.is_paused = !self.is_paused;
        if !self.is_paused && self.wanted >= self.length() {
            self.restart()?;
            self.wanted = Duration::ZERO;
        }
        Ok(())
    }

    /// Says something to the user, among what happened.
    pub fn say(&mut self, words: &str) {
        self.model.take(self.told, News::Notice(Level::Warning, words.to_owned()));
    }

    /// Twice as fast, or half.
    pub fn hurry(&mut self, faster: bool) {
        let step = if faster { 1 } else { -1 };
        self.doublings = (self.doublings + step).clamp(-MOST_DOUBLINGS, MOST_DOUBLINGS);
    }

    /// Goes on from a later time.
    pub fn forward(&mut self, by: Duration) {
        self.wanted = (self.wanted + by).min(self.length());
    }

    /// Goes on from an earlier time.
    ///
    /// # Errors
    /// If the recording can't be read any more.
    pub fn back(&mut self, by: Duration) -> Result<(), PlaybackError> {
        self.wanted = self.wanted.saturating_sub(by);
        self.restart()
    }

    fn restart(&mut self) -> Result<(), PlaybackError> {
        self.entries = self.recording.entries()?;
        (self.next, self.has_ended, self.told) = (None, false, Duration::ZERO);
        (self.decoder, self.exchange, self.model) = (Decoder::new(), Exchange::default(), Model::new());
        Ok(())
    }

    /// Time passes; tells what happened in it. What takes too long goes on with the next turn.
    ///
    /// # Errors
    /// If the recording can't be read any more.
    pub fn turn(&mut self, passed: Duration) -> Result<(), PlaybackError> {
        if !self.is_paused && !self.is_seeking() {
            self.forward(passed.mul_f64(self.speed()));
        }
        let until = Instant::now() + TURN;
        while !self.tell(BATCH)? && Instant::now() < until {}
        if self.has_ended && self.wanted >= self.length() {
            self.is_paused = true;
        }
        Ok(())
    }

    /// Tells so many entries at most; returns whether there is nothing more to be told now.
    fn tell(&mut self, most: usize) -> Result<bool, PlaybackError> {
        for _ in 0..most {
            if self.next.is_none() {
                self.next = self.entries.next().transpose()?;
            }
            let Some(entry) = &self.next else {
                if !std::mem::replace(&mut self.has_ended, true) {
                    self.tell_damage();
                }
                self.told = self.wanted;
                return Ok(true);
            };
            let at = Duration::from_nanos(entry.at.0.saturating_sub(self.begin.0));
            if at > self.wanted {
                self.told = self.wanted;
                return Ok(true);
            }
            self.told = self.told.max(at);
            if let Some(entry) = self.next.take() {
                self.take(&entry);
            }
        }
        Ok(false)
    }

    fn tell_damage(&mut self) {
        let damage = self.entries.damage();
        if !damage.is_none() {
            let words = format!("the file is damaged: {damage}");
            self.model.take(self.wanted, News::Notice(Level::Error, words));
        }
    }

    fn take(&mut self, entry: &Entry) {
        let at = self.told;
        let decoded = self.decoder.take(entry);
        if entry.device != self.device {
            return;
        }
        let mut tell = |news| self.model.take(at, news);
        match &entry.what {
            What::About(about) => {
                let session = session(about, self.hand.as_deref(), self.exchange.session());
                tell(News::Open(Box::new(session)));
                if let Some(obstacle) = self.decoder.obstacle(self.device) {
                    tell(News::Notice(Level::Error, obstacle.to_string()));
                }
            }
            What::Parameters(settings) => {
                for &mcap::Setting { parameter, index, value } in settings {
                    tell(News::Setting { parameter, index, value });
                }
            }
            What::Received(payload) => {
                // COBS adds a byte to each 254.
                let bytes = payload.len() as u64 + FRAME_BYTES + payload.len() as u64 / 254;
                tell(News::Traffic { bytes, damaged: 0 });
                if self.exchange.received(payload) {
                    tell(News::Heartbeat);
                }
            }
            What::Sent(payload) => self.exchange.sent(payload),
            What::Event { level, words, .. } => {
                let level = match level {
                    mcap::Level::Unknown | mcap::Level::Debug | mcap::Level::Info => Level::Info,
                    mcap::Level::Warning => Level::Warning,
                    mcap::Level::Error | mcap::Level::Fatal => Level::Error,
                };
                tell(News::Notice(level, words.clone()));
            }
            What::Gap { words } => tell(News::Cut(words.clone())),
            What::Link(status) => tell(News::Traffic { bytes: 0, damaged: status.damaged }),
            What::Hole { lost } => {
                tell(News::Notice(
                    Level::Error,
                    format!("the file is damaged: {lost} entries are missing here"),
                ));
            }
            What::Tick(_) => {}
        }
        if let Some(decoded) = decoded {
            tell(News::Record(Box::new(decoded.record)));
        }
    }
}

/// A session, as the recording tells of it.
fn session(about: &About, hand: Option<&str>, number: Option<u16>) -> Session {
    let is_right = |hand: &HandModel| hand.hash() == about.hand_hash;
    let recorded = about.hand_model().filter(|recorded| hand.is_none() && is_right(recorded));
    Session {
        number,
        firmware: format!("blindgrasp {} ({:08x})", about.firmware_version, about.build_hash),
        hand_name: about.hand.clone(),
        hand_hash: about.hand_hash,
        joint_count: about.joint_count.into(),
        period_us: about.period_us,
        hand: match recorded {
            Some(hand) => Ok(Box::new(hand)),
            None => known_hand(hand, &about.hand, about.hand_hash),
        },
    }
}
