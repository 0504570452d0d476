//! A recording, told again as it was, in its own time or faster.
//!
//! It can only be read forwards. To go back it is read again from its beginning, a part of it with each turn, so that keys
//! are still heard meanwhile.

use super::exchange::Exchange;
use super::model::{Level, Model, News, Session};
use blindgrasp_model::HandModel;
use blindgrasp_record::mcap::{self, About, Decoder, Entries, Entry, Recording, RecordingError, Stamp, What};
use blindgrasp_shared::link::rate::FIRST_BAUD;
use blindgrasp_wire::printable;
use std::path::Path;
use std::time::{Duration, Instant};

/// Bytes of a frame besides its payload: CRC-32, COBS and the end of the frame.
const FRAME_BYTES: u64 = 4 + 1 + 1;
/// Greatest speed of playing, and least: so many times twice.
const MOST_DOUBLINGS: i32 = 6;
/// Longest time that a turn may take to catch up.
const TURN: Duration = Duration::from_millis(30);
/// Entries from one look at the clock to the next.
const BATCH: usize = 256;

/// The reason for which a recording can't be played.
#[derive(Debug, thiserror::Error)]
pub enum PlaybackError {
    /// It can't be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// It has no such device.
    #[error("there is no device `{name}` in this recording: it has {}", .known.join(", "))]
    NoSuchDevice {
        /// The name that was wanted.
        name: String,
        /// The names that there are.
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
    /// The position that it should reach.
    wanted: Duration,
    /// The position that it has.
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

    /// Returns the state of the hand at the position.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Returns the position: time since the beginning of the recording.
    pub fn position(&self) -> Duration {
        if self.is_seeking() { self.told } else { self.wanted }
    }

    /// Returns the length of the recording.
    pub fn length(&self) -> Duration {
        Duration::from_nanos(self.end.0.saturating_sub(self.begin.0))
    }

    /// Name of the device, and of how many.
    pub fn device(&self) -> (&str, usize) {
        let known = self.recording.devices();
        (known.get(self.device).map_or("", String::as_str), known.len())
    }

    /// Returns the speed of playing, as a multiple of the recording's.
    pub fn speed(&self) -> f64 {
        2.0_f64.powi(self.doublings)
    }

    /// Returns `true` if it waits.
    pub fn is_paused(&self) -> bool {
        self.is_paused
    }

    /// Returns `true` if it is still on its way.
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
                if let Some(news) = self.exchange.received(payload) {
                    tell(news);
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
        firmware: printable(&format!("blindgrasp {} ({:08x})", about.firmware_version, about.build_hash)),
        hand_name: printable(&about.hand),
        hand_hash: about.hand_hash,
        joint_count: about.joint_count.into(),
        period_us: about.period_us,
        clock_hz: about.clock_hz,
        baud: about.baud.unwrap_or(FIRST_BAUD),
        hand: match recorded {
            Some(hand) => Ok(Box::new(hand)),
            None => HandModel::of_device(hand, &about.hand, about.hand_hash).map(|(hand, _)| Box::new(hand)),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::Link;
    use super::super::model::tests::{ms, record};
    use super::*;
    use blindgrasp_body::MAX_JOINTS;
    use blindgrasp_record::mcap::Writer;
    use blindgrasp_shared::identity::{Clock, Identity, Image};
    use blindgrasp_shared::link::message::Reply;
    use blindgrasp_shared::telemetry::INTERFACE_VERSION;
    use std::path::PathBuf;
    use tempfile::TempDir;

    const BEGUN: u64 = 1_000_000_000_000;

    /// 30 s of a hand at 100 records a second, and another hand; with a gap from 10 to 12 s.
    fn recording(folder: &TempDir) -> PathBuf {
        let path = folder.path().join("run.mcap");
        let hand = HandModel::load("three-finger").expect("the hand");
        let image = Image {
            interface_version: INTERFACE_VERSION,
            kind: "hand",
            hand: "three-finger",
            hand_hash: hand.hash(),
            firmware_version: "0.1.0",
            build_hash: 1,
            joint_count: 12,
            fingertip_count: 3,
            period_us: 1000,
        };
        let about = About::of(&Identity::of(image, Clock::External));
        let mut writer = Writer::create(&path, false).expect("a file");
        let devices = [writer.add_device("hand1"), writer.add_device("hand2")];
        let at = |ms: u32| Stamp(BEGUN + u64::from(ms) * 1_000_000);
        for device in devices {
            writer.about(device, at(0), &about).expect("room");
        }
        let mut buffer = [0; Reply::<MAX_JOINTS>::MOST_BYTES];
        for tick in (0..=30_000).step_by(10).filter(|tick| !(10_000..12_000).contains(tick)) {
            if tick == 12_000 {
                writer.gap(devices[0], at(10_000), "the port is gone").expect("room");
                writer.event(devices[0], at(12_000), mcap::Level::Info, "the port is back").expect("room");
            }
            for (k, device) in devices.into_iter().enumerate() {
                let number = tick / 10 * (k as u32 + 1);
                let record = blindgrasp_wire::Record { sequence: number, ..record(tick) };
                let payload = postcard::to_slice(&Reply::Record(record), &mut buffer).expect("room");
                writer.received(device, at(tick), payload).expect("room");
            }
        }
        writer.finish().expect("an end");
        path
    }

    /// Goes on until it is where it should be.
    fn settle(playback: &mut Playback) {
        playback.turn(Duration::ZERO).expect("it can be read");
        for _ in 0..1000 {
            if !playback.is_seeking() {
                return;
            }
            playback.turn(Duration::ZERO).expect("it can be read");
        }
        panic!("it never gets there");
    }

    fn tick(playback: &Playback) -> u32 {
        playback.model().record().expect("a record").tick
    }

    #[test]
    fn it_is_played_in_its_own_time_forwards_and_back() {
        let folder = TempDir::new().expect("a folder");
        let mut playback = Playback::open(&recording(&folder), None, None).expect("a recording");
        assert_eq!((playback.length(), playback.device()), (ms(30_000), ("hand1", 2)));
        playback.turn(ms(500)).expect("it can be read");
        settle(&mut playback);
        assert_eq!((tick(&playback), playback.position()), (500, ms(500)));
        playback.hurry(true);
        playback.turn(ms(500)).expect("it can be read");
        settle(&mut playback);
        assert_eq!(tick(&playback), 1500);
        playback.forward(ms(3000));
        settle(&mut playback);
        assert_eq!(tick(&playback), 4500);
        let speed = playback.model().joints().nth(1).and_then(|joint| joint.speed).expect("a speed");
        assert!((speed - 10.0 * 1000.0 * std::f32::consts::TAU / 21_600.0).abs() < 1e-3, "{speed}");
        playback.back(ms(4000)).expect("it can be read");
        settle(&mut playback);
        assert_eq!(tick(&playback), 500);
        playback.pause().expect("it can be read");
        playback.turn(ms(500)).expect("it can be read");
        assert_eq!(tick(&playback), 500);
        playback.pause().expect("it can be read");
        playback.forward(ms(3_600_000));
        settle(&mut playback);
        playback.turn(ms(1)).expect("it can be read");
        assert!(playback.is_paused() && playback.position() == playback.length());
        assert_eq!((tick(&playback), playback.model().lost()), (30_000, 0));
        // From the beginning again.
        playback.pause().expect("it can be read");
        playback.turn(ms(10)).expect("it can be read");
        assert_eq!(tick(&playback), 20);
    }

    #[test]
    fn a_gap_is_shown_where_it_was() {
        let folder = TempDir::new().expect("a folder");
        let mut playback = Playback::open(&recording(&folder), Some("hand1"), None).expect("a recording");
        playback.forward(ms(11_000));
        settle(&mut playback);
        let cut = Link::Cut { since: ms(10_000), words: "the port is gone".into() };
        assert_eq!((playback.model().link(), tick(&playback)), (&cut, 9990));
        playback.forward(ms(1500));
        settle(&mut playback);
        assert_eq!((playback.model().link(), tick(&playback)), (&Link::Open, 12_500));
        assert!(playback.model().notices().any(|notice| notice.words == "the port is back"));
    }

    #[test]
    fn another_device_has_its_own_records_and_losses() {
        let folder = TempDir::new().expect("a folder");
        let path = recording(&folder);
        let mut playback = Playback::open(&path, Some("hand2"), None).expect("a recording");
        playback.forward(ms(1000));
        settle(&mut playback);
        assert_eq!((playback.device().0, playback.model().lost()), ("hand2", 100));
        let unknown = Playback::open(&path, Some("hand3"), None).err().expect("an error").to_string();
        assert_eq!(unknown, "there is no device `hand3` in this recording: it has hand1, hand2");
    }
}
