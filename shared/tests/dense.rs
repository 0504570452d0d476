//! Dense records: what they carry, what a line that loses some of them does, and their bytes.

use blindgrasp_shared::command::{Answer, Command};
use blindgrasp_shared::control::{PerGain, PerSignal};
use blindgrasp_shared::event::{Event, Events};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::limit::{Limit, Limiting};
use blindgrasp_shared::link::message::{Reply, Signals};
use blindgrasp_shared::link::{HearError, Heard, Listener, Receiver, Sender, most_bytes};
use blindgrasp_shared::math::Real;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::dense::{FULL_EVERY_TICKS, TAG, WINDOW, digest, quantised};
use blindgrasp_shared::telemetry::{List, Record};
use proptest::prelude::*;

type Record12 = Record<12>;
const MOST: usize = most_bytes(Reply::<12>::MOST_BYTES);

fn record(tick: u32) -> Record12 {
    Record {
        sequence: tick,
        tick,
        mode: Mode::Grasping,
        decimation: 1,
        gains: PerGain { grasp: [5.0, 0.0], ..PerGain::all(0.0) },
        cycles: 12_345,
        counts: List::first_of([1000; 12], 12),
        torques_nm: List::first_of([0.1; 12], 12),
        limiting: List::first_of([Limiting::NONE; 12], 12),
        ..Record::BLANK
    }
}

/// The payload of a frame.
fn payload(frame: &[u8]) -> Vec<u8> {
    let mut receiver = Receiver::<{ Reply::<12>::MOST_BYTES + 4 }>::new();
    let mut payload = None;
    for &byte in frame {
        if let Some(received) = receiver.push(byte) {
            payload = Some(received.expect("a good frame").to_vec());
        }
    }
    payload.expect("a whole frame")
}

fn sent(sender: &mut Sender<12>, record: &Record12, signals: Signals) -> Vec<u8> {
    payload(sender.record(record, signals, &mut [0; MOST]).expect("room"))
}

/// A record to the bit.
fn bits<const J: usize>(record: &Record<J>) -> Vec<u8> {
    let mut buffer = [0; 1024];
    record.encode(&mut buffer).expect("room").to_vec()
}

/// What a record and its digest have to be when they are heard.
#[track_caller]
fn is<const J: usize>(heard: &Heard<'_, J>, sent: &Record12) {
    let Reply::Record(record) = &heard.reply else { panic!("{heard:?}") };
    match heard.digest {
        None => assert_eq!(bits(record), bits(sent)),
        Some(told) => {
            assert_eq!(bits(record), bits(&quantised(sent)));
            assert_eq!(told, digest(sent));
        }
    }
}

/// The bytes of interface version 5, as `docs/protocol.md` lays them down.
#[test]
fn golden_bytes() {
    let mut sender = Sender::new();
    let mut first = record(70_000);
    first.sequence = 300;
    first.potentials_j.grasp[0] = 0.25;
    assert_eq!(sent(&mut sender, &first, Signals::FULL)[0], 3, "the first is in full");
    let mut limiting = [Limiting::NONE; 12];
    limiting[1].insert(Limit::Torque);
    limiting[2].insert(Limit::UpperStop);
    let mut counts = [1000; 12];
    (counts[0], counts[11]) = (985, 1003);
    let next = Record {
        sequence: 301,
        tick: 70_001,
        mode: Mode::Fault,
        events: Events::NONE.with(Event::Heartbeat, true).with(Event::Late, true),
        fault: Some(Raised::at(2, Fault::CountJump)),
        reading_failed: Some(Raised::of_hand(Fault::OutputFailed)),
        late_ticks: 2,
        dropped: 1,
        work_j: -0.5,
        excess_j: 0.0625,
        counts: List::first_of(counts, 12),
        limiting: List::first_of(limiting, 12),
        ..first
    };
    let payload = sent(&mut sender, &next, Signals::FULL);
    let hex: String = payload.iter().map(|byte| format!("{byte:02x}")).collect();
    // Eight times 15 counts need seven bits and a sign: two nibbles.
    let golden = concat!(
        "06",   // tag
        "2d",   // sequence
        "7111", // tick
        "1c",   // mode, events
        "f2",   // nibbles; all parts
        "0e0c", // cycles / 4
        "12",   // late, dropped
        // What is new: work and excess.
        "a0", // which of law and ledger
        "00b8",
        "002c", // those
        "0302",
        "09ff",                                             // faults
        "d9e8e8e8e8e8e8e8e8e8e8eb",                         // counts
        "662e662e662e662e662e662e662e662e662e662e662e662e", // torques
        "100800000000",                                     // limiting
    );
    let (body, tail) = hex.split_at(golden.len());
    assert_eq!(body, golden);
    println!("check and digest {tail}");
    assert_eq!(tail, "a1c783");
    // The hash once more, as the document says it, in wider arithmetic.
    let hash = |words: &mut dyn Iterator<Item = u32>| {
        words.fold(0_u32, |h, word| {
            let turned = (u64::from(h) << 5 | u64::from(h) >> 27) as u32 ^ word;
            (u64::from(turned) * 0x9E37_79B9 % (1 << 32)) as u32
        })
    };
    let halves = [0x4500, 0, 0, 0x3400, 0, 0, 0xb800, 0, 0x2c00];
    let counted = counts.map(|count| count as u32);
    let numbers = [301, 70_001, 2, 1, 1].into_iter().chain(halves).chain(counted);
    assert_eq!(u32::from(payload[payload.len() - 3]), hash(&mut numbers.into_iter()) >> 24);
    let law = [5.0_f32, 0.0, 0.0, 0.25, 0.0, 0.0, -0.5, 0.0, 0.0625].into_iter().chain([0.1; 12]);
    let told = u16::from_le_bytes([payload[payload.len() - 2], payload[payload.len() - 1]]);
    assert_eq!(u32::from(told), hash(&mut law.map(f32::to_bits)) >> 16);
}

#[test]
fn full_records_come_where_they_must() {
    let mut sender = Sender::<12>::new();
    let mut full = Vec::new();
    for tick in 0..500 {
        let mut record = record(tick);
        record.answer = (tick == 30).then_some(Answer { command: Command::Arm, refused: None });
        record.decimation = if tick < 50 { 1 } else { 2 };
        if tick >= 60 {
            record.sequence += 8;
        }
        if sent(&mut sender, &record, Signals::FULL)[0] != TAG {
            full.push(tick);
        }
    }
    let every = FULL_EVERY_TICKS;
    assert_eq!(full, [0, 30, 50, 60, 60 + every, 60 + 2 * every, 60 + 3 * every, 60 + 4 * every]);
    // A device that was late and dropped much before anybody listened begins with one.
    let mut sender = Sender::<12>::new();
    let busy = |tick| Record { late_ticks: 40 + tick / 2, dropped: 99, ..record(tick) };
    let full = (0..50).filter(|&tick| sent(&mut sender, &busy(tick), Signals::FULL)[0] != TAG);
    assert_eq!(full.collect::<Vec<_>>(), [0]);
    // Nor is it another list whether snapshots are sent.
    let stateless = Signals::ALL.and(Signals::DENSE);
    assert_eq!(sent(&mut sender, &busy(50), stateless)[0], TAG);
    // Without DENSE all are; and with other signals the first is.
    let mut sender = Sender::<12>::new();
    (0..3).for_each(|tick| drop(sent(&mut sender, &record(500 + tick), Signals::FULL)));
    assert_eq!(sent(&mut sender, &record(503), Signals::ALL)[0], 3);
    // So many that who hears none of them knows that it has lost too many.
    let full = (504..520)
        .take_while(|&tick| sent(&mut sender, &record(tick), Signals::LIMITING.and(Signals::DENSE))[0] == 3);
    assert_eq!(full.count(), WINDOW);
}

#[test]
fn worst_records_are_within_the_budget() {
    // Twelve joints, each 4,000 counts a turn behind a gear of 5.4, at 20 rad/s: 69 counts a tick, and all limited.
    let mut sender = Sender::<12>::new();
    let mut worst = 0;
    for tick in 0..100 {
        let mut limiting = [Limiting::NONE; 12];
        limiting.iter_mut().for_each(|limiting| limiting.insert(Limit::Slew));
        let mut record = record(tick);
        // Too far for 24 bits, and no zeros that would be for free.
        record.counts = List::first_of([69 * (tick as i32) + 1; 12], 12);
        record.limiting = List::first_of(limiting, 12);
        let mut buffer = [0; MOST];
        let length = sender.record(&record, Signals::FULL, &mut buffer).unwrap().len();
        if tick > 0 {
            worst = worst.max(length);
        }
    }
    println!("{worst} bytes on the wire");
    assert!(worst <= 80 + 3, "{worst}");
}

#[test]
fn what_is_left_out_stays_out() {
    for signals in [Signals::NONE, Signals::COUNTS, Signals::TORQUES, Signals::LIMITING, Signals::ALL] {
        let signals = signals.and(Signals::DENSE);
        let (mut sender, mut listener) = (Sender::new(), Listener::<24>::new());
        for tick in 0..10 {
            let mut record = record(tick);
            let payload = sent(&mut sender, &record, signals);
            assert_eq!(payload[0] == TAG, tick > 0);
            record.keep(signals);
            is(&listener.hear(&payload).unwrap(), &record);
        }
    }
}

#[test]
fn what_has_no_base_is_told_and_heard_again_from_the_next_full_record_on() {
    let mut sender = Sender::new();
    let payloads: Vec<_> = (0..250).map(|tick| sent(&mut sender, &record(tick), Signals::FULL)).collect();
    let mut listener = Listener::<12>::new();
    assert_eq!(listener.hear(&payloads[1]), Err(HearError::NoFullRecord));
    assert!(listener.hear(&payloads[0]).is_ok());
    assert!(listener.hear(&payloads[WINDOW]).is_ok(), "seven records were lost");
    assert_eq!(listener.hear(&payloads[2 * WINDOW + 1]), Err(HearError::Lost), "eight were");
    assert_eq!(listener.hear(&payloads[2 * WINDOW + 2]), Err(HearError::Lost));
    assert!(listener.hear(&payloads[100]).is_ok());
    assert!(listener.hear(&payloads[101]).is_ok());
    assert_eq!(listener.hear(&payloads[101]), Err(HearError::Lost), "the same once more");
}

/// How a record differs from the one before.
#[derive(Clone, Debug)]
struct Step {
    record: Record12,
    signals: Signals,
    sent: bool,
    arrives: bool,
}

fn float() -> impl Strategy<Value = f32> {
    prop_oneof![3 => -2.0..2.0_f32, 1 => any::<u32>().prop_map(f32::from_bits)]
}

/// A number of law or ledger: often one that was there before, or rounds to it.
fn law() -> impl Strategy<Value = f32> {
    prop_oneof![8 => Just(0.5), 2 => Just(0.500_01), 2 => Just(0.0), 1 => float()]
}

fn limits(bits: [u8; 12]) -> [Limiting; 12] {
    bits.map(|bits| {
        let mut limiting = Limiting::NONE;
        let on = Limit::ALL.into_iter().filter(|&limit| bits & limit as u8 != 0);
        on.for_each(|limit| limiting.insert(limit));
        limiting
    })
}

prop_compose! {
    fn runs()(
        loss in prop_oneof![Just(0_u32), Just(10), Just(50), Just(90), Just(97)],
        start in any::<(u32, u32)>(),
        begin in any::<[i32; 12]>(),
        steps in proptest::collection::vec((
            proptest::sample::select(&Mode::ALL[..]),
            proptest::option::weighted(0.1, (proptest::sample::select(Fault::ALL), proptest::option::of(any::<u8>()))),
            proptest::array::uniform12(prop_oneof![-20..20_i32, -2000..2000_i32]),
            prop_oneof![20 => Just(1_i32), 1 => Just(100_000), 1 => Just(0)],
            (proptest::array::uniform9(law()), proptest::array::uniform12(float())),
            proptest::array::uniform12(prop_oneof![9 => Just(0_u8), 1 => 0..16_u8]),
            any::<u32>(),
            (0..100_u32, 0..100_u32, 0..1000_u32),
            (proptest::bool::weighted(0.03), proptest::bool::weighted(0.05), proptest::bool::weighted(0.02)),
        ), 1..260),
    ) -> Vec<Step> {
        let (mut sequence, mut tick) = start;
        let (mut counts, mut late_ticks, mut dropped, mut decimation) = (begin, 0_u32, 0_u32, 1_u16);
        let mut signals = Signals::FULL;
        steps.into_iter().map(|step| {
            let (mode, raised, changes, times, (law, torques), limited, cycles, (lost, queue, rare), flags) = step;
            let (answered, failed, other) = flags;
            sequence = sequence.wrapping_add(1);
            tick = tick.wrapping_add(u32::from(decimation));
            counts.iter_mut().zip(changes).for_each(|(count, change)| *count = count.wrapping_add(change.wrapping_mul(times)));
            late_ticks += u32::from(lost % 7 == 0);
            let sent = queue >= 3;
            dropped += u32::from(!sent);
            if rare == 0 { decimation = decimation.saturating_mul(2); }
            if other { signals = if signals == Signals::FULL { Signals::COUNTS.and(Signals::DENSE) } else { Signals::FULL }; }
            let raised = raised.map(|(fault, joint)| Raised { fault, joint });
            let record = Record {
                sequence, tick, mode, late_ticks, dropped, decimation, cycles,
                fault: raised,
                answer: answered.then_some(Answer { command: Command::Arm, refused: None }),
                events: Events::NONE.with(Event::Late, lost % 7 == 0),
                reading_failed: raised.filter(|_| failed),
                gains: PerGain::of([law[0], law[1], law[2]]), potentials_j: PerGain::of([law[3], law[4], law[5]]), law_signals: PerSignal::all(0.0),
                work_j: law[6], damped_j: law[7], excess_j: law[8],
                counts: List::first_of(counts, if failed { 0 } else { 12 }),
                torques_nm: List::first_of(torques, 12),
                limiting: List::first_of(limits(limited), 12),
            };
            Step { record, signals, sent, arrives: lost >= loss }
        }).collect()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    /// Whatever is lost, in the queue or on the line: what is heard is what was sent, or an error; never anything else.
    #[test]
    fn no_loss_makes_a_wrong_value(run in runs()) {
        let (mut sender, mut listener) = (Sender::new(), Listener::<24>::new());
        let mut base_known = false;
        for step in run.into_iter().filter(|step| step.sent) {
            let payload = sent(&mut sender, &step.record, step.signals);
            if !step.arrives {
                continue;
            }
            let mut kept = step.record.clone();
            kept.keep(step.signals);
            match listener.hear(&payload) {
                Ok(heard) => {
                    is(&heard, &kept);
                    base_known = true;
                }
                Err(HearError::NoFullRecord) => prop_assert!(!base_known && payload[0] == TAG),
                Err(HearError::Lost) => prop_assert!(payload[0] == TAG),
                Err(HearError::Decode(error)) => panic!("{error}"),
            }
        }
    }

    /// Any change of a dense record's bytes, with a CRC as it should be: no panic.
    #[test]
    fn any_dense_bytes_are_heard_or_refused(
        bytes in proptest::collection::vec(any::<u8>(), 0..120),
        at in any::<prop::sample::Index>(),
        with in any::<u8>(),
    ) {
        let mut sender = Sender::new();
        let mut listener = Listener::<24>::new();
        let full = sent(&mut sender, &record(7), Signals::FULL);
        listener.hear(&full).unwrap();
        let _ = listener.clone().hear(&[&[TAG], &bytes[..]].concat());
        let mut dense = sent(&mut sender, &record(8), Signals::FULL);
        let at = at.index(dense.len());
        dense[at] ^= with;
        let _ = listener.clone().hear(&dense);
        let _ = listener.hear(&dense[..at]);
    }
}

/// Without loss nothing is refused.
#[test]
fn a_line_that_loses_nothing_is_heard_whole() {
    let (mut sender, mut listener) = (Sender::new(), Listener::<24>::new());
    for tick in 0..5000_u32 {
        let mut record = record(tick);
        record.counts = List::first_of([(1000.0 * (f64::from(tick) / 200.0).sine_cosine().0) as i32; 12], 12);
        record.torques_nm = List::first_of(
            [f32::NAN, f32::INFINITY, -0.0, 1e30, 1e-30, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            12,
        );
        is(&listener.hear(&sent(&mut sender, &record, Signals::FULL)).unwrap(), &record);
    }
}

/// 10,000 times a stream of records with damage: bytes changed, lost, and added, one or many.
#[test]
fn damaged_streams_give_no_wrong_value_and_each_loss_is_known() {
    const RECORDS: u32 = 60;
    let mut state = 1_u64;
    let mut random = |below: usize| {
        // Knuth's MMIX generator; its high bits are random enough.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let mut sender = Sender::<12>::new();
    let mut records = Vec::new();
    let mut stream = Vec::new();
    for tick in 0..RECORDS {
        let counts = std::array::from_fn(|_| random(2000) as i32 - 1000);
        let torques_nm = std::array::from_fn(|_| random(1000) as f32 * 1e-3);
        let answer = (tick == 40).then_some(Answer { command: Command::Arm, refused: None });
        let (counts, torques_nm) = (List::first_of(counts, 12), List::first_of(torques_nm, 12));
        let record = Record { answer, counts, torques_nm, ..record(tick) };
        stream.extend_from_slice(sender.record(&record, Signals::FULL, &mut [0; MOST]).expect("room"));
        records.push(record);
    }
    let (mut heard_count, mut unusable_count, mut destroyed_count) = (0, 0, 0);
    for _ in 0..10_000 {
        let mut damaged = stream.clone();
        for _ in 0..=random(4) {
            let at = random(damaged.len());
            let many = (at + 1 + random(200)).min(damaged.len());
            match random(4) {
                0 => damaged[at] ^= 1 << random(8),
                1 => damaged.insert(at, random(256) as u8),
                2 => drop(damaged.drain(at..=at)),
                _ => drop(damaged.drain(at..many)),
            }
        }
        let mut receiver = Receiver::<{ Reply::<12>::MOST_BYTES + 4 }>::new();
        let mut listener = Listener::<12>::new();
        let (mut good, mut unusable, mut missing) = (0, 0, 0);
        let mut next = 0;
        for byte in damaged {
            let Some(Ok(payload)) = receiver.push(byte) else { continue };
            good += 1;
            match listener.hear(payload) {
                Ok(heard) => {
                    let Reply::Record(record) = &heard.reply else { panic!("{heard:?}") };
                    is(&heard, &records[record.sequence as usize]);
                    missing += record.sequence - next;
                    next = record.sequence + 1;
                    heard_count += 1;
                }
                Err(HearError::Lost | HearError::NoFullRecord) => unusable += 1,
                Err(error) => panic!("a frame of the sender's: {error}"),
            }
        }
        missing += RECORDS - next;
        let destroyed = RECORDS - good;
        assert_eq!(missing, destroyed + unusable, "by the records' numbers, and by what was received");
        unusable_count += unusable;
        destroyed_count += destroyed;
    }
    println!("{heard_count} records heard, {destroyed_count} destroyed, {unusable_count} of no use");
    assert!(heard_count > 0 && destroyed_count > 0 && unusable_count > 0);
}
