//! A hand that talks at random.

use blindgrasp::body::MAX_JOINTS;
use blindgrasp::model::{HandFile, HandModel};
use blindgrasp::record::mcap::{
    About, Arrival, Device, Entry, Record, Recording, RecordingError, Setting, Stamp, What, Writer,
};
use blindgrasp_shared::command::{Answer, Command, Refusal};
use blindgrasp_shared::control::PerGain;
use blindgrasp_shared::event::{Event, Events};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::{BrownOut, Clock, Identity, Image};
use blindgrasp_shared::limit::{Limit, Limiting};
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, List};
use blindgrasp_shared::tick::Params;
use std::path::Path;

/// Returns the description of a hand of `models/hands`.
pub(crate) fn about(hand: &str) -> About {
    let file = HandFile::load(hand).unwrap();
    let model = HandModel::load(hand).unwrap();
    About::of(&Identity {
        brown_out: BrownOut::Level3,
        clock_hz: 96_000_000,
        most_baud: 1_000_000,
        ..Identity::of(
            Image {
                interface_version: INTERFACE_VERSION,
                kind: "hand",
                hand,
                hand_hash: model.hash(),
                firmware_version: "0.1.0",
                build_hash: 0x0123_abcd,
                joint_count: file.joints.len() as u8,
                fingertip_count: file.fingertips.len() as u8,
                period_us: 1000,
            },
            Clock::External,
        )
    })
    .with_hand(&file)
}

/// All parameters of a hand.
pub(crate) fn settings(hand: &str) -> Vec<Setting> {
    let model = HandModel::load(hand).unwrap();
    let params =
        Params::<MAX_JOINTS, { blindgrasp::body::MAX_FINGERS }>::new(model.hand.cast(), &model.config);
    Setting::all(&params.unwrap())
}

/// A hand that does what chance wants.
pub(crate) struct Hand {
    pub(crate) record: Record,
    joints: usize,
}

impl Hand {
    pub(crate) fn new(joints: usize) -> Self {
        let record = Record { decimation: 1, ..Record::BLANK };
        Self { record, joints }
    }

    /// The next record, and the payload that it makes.
    pub(crate) fn tick(&mut self, random: &mut fastrand::Rng) -> (Record, Vec<u8>) {
        let record = &mut self.record;
        record.sequence = record.sequence.wrapping_add(1);
        record.tick = record.tick.wrapping_add(1);
        let mut rare = |one_in: u32| random.u32(0..one_in) == 0;
        if rare(50) {
            record.mode = Mode::ALL[random.usize(0..Mode::ALL.len())];
        }
        let mut rare = |one_in: u32| random.u32(0..one_in) == 0;
        let (failed, answers, faulty, limited) = (rare(40), rare(30), rare(60), rare(4));
        if faulty {
            let fault = Fault::ALL[random.usize(0..Fault::ALL.len())];
            record.fault = random.bool().then(|| Raised::at(random.usize(0..self.joints), fault));
        }
        record.answer = answers.then(|| Answer {
            command: Command::ALL[random.usize(0..6)],
            refused: random.bool().then_some(Refusal::NotArmed),
        });
        record.reading_failed = failed.then(|| Raised::at(0, Fault::SampleMissing));
        record.events = Events::NONE.with(Event::Heartbeat, random.bool()).with(Event::Late, limited);
        let mut float = |scale: f32| scale * (random.f32() - 0.5);
        record.gains = PerGain { grasp: [float(20.0), float(0.01)], ..PerGain::all(0.0) };
        record.potentials_j = PerGain { grasp: [float(1.0), float(1.0)], ..PerGain::all(0.0) };
        (record.work_j, record.damped_j) = (float(1.0), float(1.0));
        if limited {
            (record.gains.integral, record.potentials_j.integral) = ([float(0.1)], [float(1.0)]);
        }
        let mut torques = [0.0; MAX_JOINTS];
        torques[..self.joints].iter_mut().for_each(|torque| *torque = float(3.0));
        record.torques_nm = List::first_of(torques, self.joints);
        record.cycles = random.u32(0..100_000);
        record.late_ticks += u32::from(limited);
        let mut counts = [0; MAX_JOINTS];
        for (k, count) in counts[..self.joints].iter_mut().enumerate() {
            let before = record.counts.as_slice().get(k).copied().unwrap_or(1000 * k as i32 - 3000);
            *count = before + random.i32(-20..=20);
        }
        record.counts = List::first_of(counts, self.joints);
        let mut limiting = [Limiting::NONE; MAX_JOINTS];
        if limited {
            limiting[random.usize(0..self.joints)].insert(Limit::ALL[random.usize(0..4)]);
        }
        record.limiting = List::first_of(limiting, self.joints);
        let mut sent = record.clone();
        if failed {
            sent.counts = List::default();
        }
        let payload = postcard::to_allocvec(&Reply::Record(sent.clone())).unwrap();
        (sent, payload)
    }
}

/// A recording that is being written, of a hand that does what chance wants.
pub(crate) struct Written {
    pub(crate) writer: Writer,
    pub(crate) device: Device,
    pub(crate) ticks: u64,
    hand: Hand,
    random: fastrand::Rng,
}

impl Written {
    /// It says who it is.
    pub(crate) fn of(hand: &str, mut writer: Writer, seed: u64) -> Self {
        let (about, device) = (about(hand), writer.add_device("hand"));
        writer.about(device, Stamp(0), &about).unwrap();
        let (hand, random) = (Hand::new(about.joint_names.len()), fastrand::Rng::with_seed(seed));
        Self { writer, device, ticks: 0, hand, random }
    }

    /// The record of the next millisecond.
    pub(crate) fn tick(&mut self) -> Result<Arrival, RecordingError> {
        self.ticks += 1;
        let (_, payload) = self.hand.tick(&mut self.random);
        self.writer.received(self.device, Stamp(self.ticks * 1_000_000), &payload)
    }
}

/// All entries of a file, and what was wrong with it.
pub(crate) fn read(path: &Path) -> (Vec<Entry>, blindgrasp::record::mcap::Damage, Recording) {
    let recording = Recording::open(path).unwrap();
    let mut entries = recording.entries().unwrap();
    let all = entries.by_ref().map(Result::unwrap).collect();
    let damage = entries.damage().clone();
    (all, damage, recording)
}

/// Returns `true` if an entry is one that the writer made by itself.
pub(crate) fn is_derived(entry: &Entry) -> bool {
    matches!(&entry.what, What::Event { about, .. } if about != "event")
}
