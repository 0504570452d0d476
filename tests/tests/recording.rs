//! The image `hand` in QEMU, recorded: what came is in the file, and what did not is counted.
//!
//!     cargo test --release -p blindgrasp-tests --features firmware --test recording -- --show-output
//!
//! That every tick of a hand in real time is recorded, `host/tests/record.rs` shows, with processes.
#![cfg(unix)]

use blindgrasp::body::MAX_JOINTS;
use blindgrasp::device::client::Patience;
use blindgrasp::device::recorder;
use blindgrasp::device::talk::Talk;
use blindgrasp::device::transport::{Transport, TransportError};
use blindgrasp::record::mcap::{Decoder, Recording, What};
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_tests::board::{Board, Pace};
use blindgrasp_tests::images::{DEFAULT_HAND, kept_image};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Time for which the firmware is recorded.
const TIME: Duration = Duration::from_secs(6);
/// Longest time until it begins.
const START: Duration = Duration::from_secs(30);

#[test]
fn the_firmware_is_recorded_and_what_is_lost_is_counted() {
    let mut board = Board::start(&kept_image("hand", DEFAULT_HAND), Pace::World);
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("qemu.mcap");
    let recording = recorder::Recording::create(&path, false).expect("a file");
    let mut recorder = recording.add("hand", "qemu", &[], 1);
    let begun = Instant::now();
    let mut talk = Talk::new(Patience { start: START, answer: START }, begun).tapped();
    let mut ready = None;
    let mut buffer = [0; 4096];
    loop {
        let now = Instant::now();
        talk.turn(now).expect("it is there");
        while let Some(event) = talk.event() {
            recorder.take(&event, &mut talk, now).expect("it is written");
        }
        recorder.turn(&mut talk, now).expect("it is written");
        if recorder.is_ready() && now - *ready.get_or_insert(now) >= TIME {
            break;
        }
        assert!(ready.is_some() || now - begun < START, "no session");
        board.send(&talk.outgoing(), now + START).expect("the board listens");
        match board.receive(&mut buffer, now + Duration::from_millis(5)) {
            Ok(count) => talk.take(&buffer[..count], Instant::now()).expect("its interface is known"),
            Err(TransportError::TimedOut) => {}
            Err(error) => panic!("{error}"),
        }
    }
    let totals = recorder.finish(Instant::now()).expect("it is written");
    recording.finish().expect("it is written");

    let recorded = Recording::open(&path).expect("a recording");
    assert!(recorded.is_finished());
    let mut decoder = Decoder::new();
    let (mut records, mut sessions) = (Vec::new(), 0);
    // Numbers of records and of input records, which are in one row.
    let (mut numbers, mut inputs) = (Vec::new(), 0);
    let mut entries = recorded.entries().expect("entries");
    for entry in &mut entries {
        let entry = entry.expect("an entry");
        sessions += usize::from(matches!(entry.what, What::About(_)));
        if let What::Received(payload) = &entry.what {
            match Reply::<MAX_JOINTS>::decode(payload) {
                Ok(Reply::Record(record)) => numbers.push(record.sequence),
                Ok(Reply::Input(input)) => {
                    inputs += 1;
                    numbers.push(input.sequence);
                }
                _ => {}
            }
        }
        records.extend(decoder.take(&entry));
    }
    assert!(entries.damage().is_none());
    assert_eq!((sessions, totals.gaps), (1, 0));
    println!("{} records, {inputs} input records; {totals:?}", records.len());
    // By the numbers, all are accounted for.
    let sent = u64::from(numbers[numbers.len() - 1] - numbers[0]) + 1;
    assert_eq!(sent, numbers.len() as u64 + totals.missing);
    assert_eq!((totals.records, totals.inputs), (numbers.len() as u64, inputs));
    assert_eq!(records.len() as u64 + inputs, totals.records);
    assert_eq!(totals.damaged, 0);
    // Where none is missing and every tick is sent, so is every tick.
    let neighbours = records.windows(2).filter(|pair| {
        pair[1].lost_before == 0 && pair[0].record.decimation == 1 && pair[1].record.decimation == 1
    });
    let mut pairs = 0;
    for pair in neighbours {
        // The first are from before every tick was asked for.
        if pair[1].record.tick.wrapping_sub(pair[0].record.tick) == 1 {
            pairs += 1;
        }
        assert_eq!(pair[1].record.mode, Mode::Fault, "no counter answers");
    }
    assert!(pairs > 2000, "{pairs} neighbours");
}
