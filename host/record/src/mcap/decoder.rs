//! Received payloads, decoded: records with their time on the host's clock, angles, speeds, and what is missing before
//! them. The writer decodes with this as it records, and readers get the same values from the raw payloads.

use super::about::{About, Setting};
use super::clock::Clock;
use super::reader::{Entry, What};
use super::{RecordingError, Stamp};
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_shared::command::Answer;
use blindgrasp_shared::estimate::{Estimator, Motion, Tracks};
use blindgrasp_shared::link::InputRecord;
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::period::Period;
use blindgrasp_shared::telemetry::{self, INTERFACE_VERSION, List};
use blindgrasp_shared::tick::Config;
use std::f32::consts::PI;

/// A record of a hand of any size.
pub type Record = telemetry::Record<MAX_JOINTS>;

/// After how many time constants of its filter a speed is told: an error of the start has faded to 1e-7 then.
const SETTLED: f32 = 8.0;

/// A record may come so much later than another in comparison with its tick, s, and a device's clock be so slow in
/// comparison with the host's: a simulated one that has not enough of a processor.
const LATE_S: f64 = 0.5;
const SLOWEST: f64 = 0.8;

/// A record, and what follows from those before it.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// The device of the recording.
    pub device: usize,
    /// Number of its session, from 1 on.
    pub session: u32,
    /// The time of the tick, on the host's clock; never before that of the record before.
    pub at: Stamp,
    /// The arrival of the record.
    pub arrived: Stamp,
    /// The time of the tick, on the device's clock, s since its start; 0 where its period is not known.
    pub time_s: f64,
    /// The record.
    pub record: Record,
    /// Records that are missing between the one before, which may have been an input record, and this one: also where the link
    /// was cut between them. Of a device that has started anew, those since its start; how many it had still sent before
    /// nobody can know.
    pub lost_before: u64,
    /// Joint angles, rad; empty where the hand or the counts are not known.
    pub angles_rad: List<f32, MAX_JOINTS>,
    /// Joint speeds, rad/s; empty where they are not known, and while the estimator starts again after a gap.
    pub speeds_rad_s: List<f32, MAX_JOINTS>,
}

impl Decoded {
    /// Ticks from one sent record to the next.
    pub fn decimation(&self) -> u16 {
        self.record.decimation
    }
}

/// A payload, decoded.
#[derive(Clone, Debug, PartialEq)]
pub enum Arrival {
    /// A record.
    Record(Box<Decoded>),
    /// An input record, and how many records are missing before it. A replay makes of it what the tick computed.
    Input {
        /// Records that are missing between the one before and this one.
        lost_before: u64,
        /// The time of its tick.
        at: Stamp,
        /// The command of its tick, and what became of it.
        answer: Option<Answer>,
    },
    /// Something else that the device says.
    Reply,
    /// Nothing that can be decoded: of another interface version, or no reply at all.
    Unusable,
}

/// Decodes the entries of a recording, in their order.
#[derive(Default)]
pub struct Decoder {
    tracks: Vec<Track>,
}

impl Decoder {
    /// Knows nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes an entry; all of them have to come, in order. A record comes out decoded.
    pub fn take(&mut self, entry: &Entry) -> Option<Decoded> {
        while self.tracks.len() <= entry.device {
            self.tracks.push(Track::new(self.tracks.len()));
        }
        let track = &mut self.tracks[entry.device];
        match &entry.what {
            What::About(about) => track.about(about),
            What::Parameters(settings) => track.parameters(settings),
            What::Gap { .. } => track.restart(),
            What::Hole { .. } => track.hole(),
            What::Received(payload) => {
                if let Arrival::Record(decoded) = track.hear(payload, entry.at) {
                    return Some(*decoded);
                }
            }
            What::Sent(_) | What::Event { .. } | What::Link(_) | What::Tick(_) => {}
        }
        None
    }

    /// Returns the last description that the device gave of itself.
    pub fn about(&self, device: usize) -> Option<&About> {
        self.tracks.get(device)?.about.as_ref()
    }

    /// Returns the reason for which a device's records can't be decoded, if they can't.
    pub fn obstacle(&self, device: usize) -> Option<RecordingError> {
        let about = self.about(device).filter(|about| about.interface_version != INTERFACE_VERSION)?;
        Some(RecordingError::OtherInterface {
            device: about.hand.clone(),
            theirs: about.interface_version,
            program: format!("blindgrasp {}", about.host_version),
        })
    }
}

/// The records of one device.
pub(super) struct Track {
    device: usize,
    about: Option<About>,
    /// Of the hand, where its file is known.
    config: Option<Config<MAX_JOINTS>>,
    estimator: Option<Prepared>,
    tracks: Tracks<MAX_JOINTS>,
    /// Records until the speed is told.
    unsettled: u32,
    clock: Option<Clock>,
    session: u32,
    last: Option<Last>,
    /// The link was cut since.
    is_cut: bool,
}

/// The last record.
#[derive(Clone, Copy, Debug)]
struct Last {
    sequence: u32,
    tick: u32,
    arrived: Stamp,
    at: Stamp,
}

impl Track {
    pub(super) fn new(device: usize) -> Self {
        Self {
            device,
            about: None,
            config: None,
            estimator: None,
            tracks: Tracks::new(),
            unsettled: 0,
            clock: None,
            session: 0,
            last: None,
            is_cut: false,
        }
    }

    /// A session begins.
    pub(super) fn about(&mut self, about: &About) {
        self.session += 1;
        if self.about.as_ref().is_some_and(|before| !before.is_same_firmware(about)) {
            // Nothing goes on that began there.
            (self.clock, self.last) = (None, None);
        }
        self.config = about.hand_model().map(|model| Config { period_us: about.period_us, ..model.config });
        self.estimator = None;
        self.about = Some(about.clone());
        self.restart();
    }

    /// The parameters in force, or some of them.
    pub(super) fn parameters(&mut self, settings: &[Setting]) {
        if let Some(config) = &mut self.config {
            settings.iter().for_each(|setting| setting.configure(config));
            self.estimator = None;
        }
    }

    /// The link was cut. What comes next may go on from before, or begin anew.
    pub(super) fn restart(&mut self) {
        self.hole();
        self.is_cut = true;
    }

    /// Something of the recording is lost; sequence numbers tell how many records.
    pub(super) fn hole(&mut self) {
        self.tracks.restart();
    }

    pub(super) fn hear(&mut self, payload: &[u8], arrived: Stamp) -> Arrival {
        if self.about.as_ref().is_some_and(|about| about.interface_version != INTERFACE_VERSION) {
            return Arrival::Unusable;
        }
        match Reply::decode(payload) {
            Ok(Reply::Record(record)) => Arrival::Record(Box::new(self.record(record, arrived))),
            Ok(Reply::Input(InputRecord { sequence, tick, counts, answer, .. })) => {
                let record = Record { sequence, tick, counts, decimation: 1, ..Record::BLANK };
                // Clock and estimator go on with it.
                let Decoded { lost_before, at, .. } = self.record(record, arrived);
                Arrival::Input { lost_before, at, answer }
            }
            Ok(_) => Arrival::Reply,
            Err(_) => Arrival::Unusable,
        }
    }

    fn record(&mut self, record: Record, arrived: Stamp) -> Decoded {
        let (sequence, tick) = (record.sequence, record.tick);
        let mut lost_before = 0;
        let mut ticks = None;
        if let Some(last) = self.last {
            if self.goes_on(&last, sequence, tick, arrived) {
                lost_before = u64::from(sequence.wrapping_sub(last.sequence) - 1);
                ticks = Some(tick.wrapping_sub(last.tick));
            } else {
                // It has sent as many since its start.
                lost_before = sequence.into();
                self.clock = None;
            }
        }
        self.is_cut = false;
        let period_us = self.about.as_ref().map(|about| about.period_us);
        let clock = period_us.map(|us| self.clock.get_or_insert_with(|| Clock::new(us, tick, arrived)));
        let at = clock.map_or(arrived, |clock| clock.map(tick, arrived));
        let at = self.last.map_or(at, |last| at.max(last.at));
        self.last = Some(Last { sequence, tick, arrived, at });
        let time_s = match (&self.clock, period_us) {
            (Some(clock), Some(us)) => (u128::from(clock.tick()) * u128::from(us)) as f64 / 1e6,
            _ => 0.0,
        };
        let none = List::default;
        let mut decoded = Decoded {
            device: self.device,
            session: self.session,
            at,
            arrived,
            time_s,
            record,
            lost_before,
            angles_rad: none(),
            speeds_rad_s: none(),
        };
        self.estimate(&mut decoded, ticks);
        decoded
    }

    /// Returns `true` if a record comes from the same life of the device as the last one: its numbers go on, and where the link was cut,
    /// so does its time.
    fn goes_on(&self, last: &Last, sequence: u32, tick: u32, arrived: Stamp) -> bool {
        let ahead = |now: u32, before: u32| (1..1 << 31).contains(&now.wrapping_sub(before));
        if !ahead(sequence, last.sequence) || !ahead(tick, last.tick) {
            return false;
        }
        let Some(period_us) = self.about.as_ref().map(|about| about.period_us).filter(|_| self.is_cut) else {
            return true;
        };
        let passed_s = arrived.0.saturating_sub(last.arrived.0) as f64 * 1e-9;
        let device_s = |ticks: u32| f64::from(ticks) * f64::from(period_us) * 1e-6;
        // One that started since has counted less than has passed, both since its start and since the last record.
        let is_younger = device_s(tick) < passed_s + LATE_S;
        !is_younger || device_s(tick.wrapping_sub(last.tick)) > SLOWEST * passed_s - LATE_S
    }

    /// Angles and speeds. `ticks` is how many have passed since the record before, if that is known.
    fn estimate(&mut self, decoded: &mut Decoded, ticks: Option<u32>) {
        self.prepare(decoded.decimation());
        let Some(Prepared { every, settling, estimator }) = &self.estimator else { return };
        let joints = self.about.as_ref().map_or(0, About::joints);
        let counts = decoded.record.counts.as_slice();
        if counts.len() != joints || counts.is_empty() {
            self.tracks.restart();
            self.unsettled = *settling;
            return;
        }
        if ticks != Some(u32::from(*every)) {
            self.tracks.restart();
            // The controller's own estimator starts with the first tick.
            self.unsettled = if decoded.record.tick == 0 { 0 } else { *settling };
        }
        let mut all = [0; MAX_JOINTS];
        all[..joints].copy_from_slice(counts);
        let mut motion = Motion::still();
        estimator.update(&mut self.tracks, &all, &mut motion);
        decoded.angles_rad = List::first_of(motion.angles_rad, joints);
        if self.unsettled == 0 {
            decoded.speeds_rad_s = List::first_of(motion.speeds_rad_s, joints);
        } else {
            self.unsettled -= 1;
        }
    }

    /// Prepares the estimator for records that come every so many ticks, where it is not yet. What is too slow for its
    /// bandwidth gets the plain difference of two counts; what is slower still, no speeds.
    fn prepare(&mut self, every: u16) {
        if self.estimator.as_ref().is_some_and(|prepared| prepared.every == every) {
            return;
        }
        let (Some(config), Some(about)) = (&self.config, &self.about) else { return };
        let Ok(period) = Period::from_us(config.period_us.saturating_mul(every.max(1).into())) else {
            return;
        };
        let mut estimator = config.estimator;
        let highest_hz = 1.0 / (PI * period.seconds());
        // Just below, so that rounding does not put it above.
        estimator.bandwidth_hz = estimator.bandwidth_hz.min(0.999 * highest_hz);
        let settling = (SETTLED * highest_hz / estimator.bandwidth_hz).ceil() as u32;
        let prepared = estimator.prepare(about.joints(), period).ok();
        self.estimator = prepared.map(|estimator| Prepared { every: every.max(1), settling, estimator });
        self.tracks.restart();
        self.unsettled = settling;
    }
}

/// The estimator, for records that come every so many ticks.
struct Prepared {
    every: u16,
    /// Records until its speed is told.
    settling: u32,
    estimator: Estimator<MAX_JOINTS>,
}
