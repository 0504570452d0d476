//! Files that were cut or changed: no panic, bounded memory, no entry that was not recorded, and every loss told.

use super::hand::{Written, about, read, settings};
use super::{is_limited, run_limited};
use blindgrasp::files::OutputError;
use blindgrasp::record::mcap::{
    Decoder, Entry, Finished, Recording, RecordingError, Stamp, What, Writer, finish,
};
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// A small recording with a checkpoint after each 40 ticks; returns how many bytes and entries each checkpoint saved.
fn record(path: &Path, ticks: u64, finish: bool) -> Vec<(u64, usize)> {
    let writer = Writer::create(path, true).unwrap();
    // Without the tail. It has its name when something is in it.
    let mut partial = path.to_owned().into_os_string();
    partial.push(".partial");
    let mut saved = vec![(fs::metadata(partial).unwrap().len() - 50, 0)];
    let mut written = Written::of("two-finger", writer, 1);
    written.writer.parameters(written.device, Stamp(0), &settings("two-finger")).unwrap();
    for tick in 1..=ticks {
        written.tick().unwrap();
        if tick.is_multiple_of(40) {
            let writer = &mut written.writer;
            writer.checkpoint().unwrap();
            let (entries, damage, _) = read(path);
            assert!(damage.is_none() && damage.unfinished, "{damage}");
            assert_eq!(writer.saved().records, tick);
            saved.push((writer.saved().bytes, entries.len()));
        }
    }
    if finish {
        written.writer.finish().unwrap();
    } else {
        // As if it were killed: the file stays as the last checkpoint left it.
        std::mem::forget(written.writer);
    }
    saved
}

/// At every byte where something begins or ends, and every `step` bytes between.
fn a_file_that_was_cut_gives_every_checkpoint_before(step: usize) {
    let folder = tempfile::tempdir().unwrap();
    let (path, cut) = (folder.path().join("whole.mcap"), folder.path().join("cut.mcap"));
    for finish in [true, false] {
        let saved = record(&path, 160, finish);
        let bytes = fs::read(&path).unwrap();
        let (all, _, _) = read(&path);
        for length in 0..bytes.len() {
            let near = saved.iter().any(|(bytes, _)| bytes.abs_diff(length as u64) < 60);
            if !near && length % step != 0 {
                continue;
            }
            fs::write(&cut, &bytes[..length]).unwrap();
            let recording = match Recording::open(&cut) {
                Ok(recording) => recording,
                Err(error) => {
                    // Nothing that says what it is.
                    assert!(length as u64 <= saved[0].0, "{length}: {error}");
                    continue;
                }
            };
            let mut entries = recording.entries().unwrap();
            let given: Vec<Entry> = entries.by_ref().map(Result::unwrap).collect();
            assert_eq!(given, all[..given.len()]);
            let least =
                saved.iter().rev().find(|(bytes, _)| *bytes <= length as u64).map_or(0, |saved| saved.1);
            assert!(given.len() >= least, "{length}: {} of {least}", given.len());
            // Whole checkpoints or nothing, but for what stands twice: who the hand is, and its parameters.
            let is_whole = |count: usize| saved.iter().any(|saved| saved.1 == count) || count == all.len();
            assert!(is_whole(given.len()) || given.len() <= 3, "{length}: {}", given.len());
            if given.len() < all.len() {
                assert!(entries.damage().unfinished);
            }
        }
    }
}

#[test]
fn a_file_cut_anywhere_gives_every_checkpoint_before() {
    a_file_that_was_cut_gives_every_checkpoint_before(41);
}

#[test]
#[ignore = "the large form, for tests/run all"]
fn at_large_a_file_cut_anywhere_gives_every_checkpoint_before() {
    a_file_that_was_cut_gives_every_checkpoint_before(7);
}

#[test]
fn killed_while_it_writes_the_file_is_what_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let saved = record(&path, 160, false);
    let bytes = fs::read(&path).unwrap();
    let [.., (before, entries), (_, _)] = saved[..] else { panic!() };
    let before = before as usize;
    let tail = &bytes[bytes.len() - 50..];
    let cut = folder.path().join("b.mcap");
    // The second write, over the tail, has not come.
    for written in (before + 50..bytes.len()).step_by(13) {
        let mut torn = bytes[..written].to_vec();
        torn[before..before + 50].copy_from_slice(tail);
        fs::write(&cut, torn).unwrap();
        let (given, damage, _) = read(&cut);
        assert_eq!(given.len(), entries);
        assert_eq!((damage.lost, damage.unfinished), (0, true));
    }
}

/// By the stamps, so that nothing depends on the machine: of a program that is killed at any tick, nothing older than half a second
/// is missing. What comes to a chunk and its write adds no record.
#[test]
fn at_any_tick_all_but_the_last_half_second_is_in_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut written = Written::of("three-finger", Writer::create(&path, false).unwrap(), 9);
    for tick in 1..=3000_u64 {
        written.tick().unwrap();
        // It has its name since the first write. Just before and after others, and anywhere between.
        if tick > 501 && (tick % 500 < 3 || tick % 83 == 0) {
            let (entries, damage, _) = read(&path);
            let received =
                entries.iter().filter(|entry| matches!(entry.what, What::Received(_))).count() as u64;
            assert!(received + 500 >= tick && damage.unfinished, "{received} of {tick}");
        }
    }
}

/// Changes a copy somehow.
fn corrupt(bytes: &mut Vec<u8>, random: &mut fastrand::Rng) {
    let length = bytes.len();
    match random.u32(0..7) {
        0 => {
            for _ in 0..random.usize(1..=4) {
                bytes[random.usize(0..length)] ^= 1 << random.u32(0..8);
            }
        }
        1 => bytes.truncate(random.usize(0..length)),
        2 => {
            // A block goes.
            let from = random.usize(0..length);
            bytes.drain(from..length.min(from + random.usize(1..2000)));
        }
        3 => {
            // Two blocks change places.
            let size = random.usize(1..1024.min(length / 2));
            let (a, b) = (random.usize(0..length - size), random.usize(0..length - size));
            for k in 0..size {
                bytes.swap(a + k, b + k);
            }
        }
        4 => {
            // Lengths become huge.
            for _ in 0..random.usize(1..6) {
                let at = random.usize(0..length - 8);
                let bits = random.u32(8..64);
                bytes[at..at + 8].copy_from_slice(&(random.u64(..) >> (64 - bits)).to_le_bytes());
            }
        }
        5 => {
            // A block is there twice.
            let from = random.usize(0..length);
            let block = bytes[from..length.min(from + random.usize(1..5000))].to_vec();
            let at = random.usize(0..length);
            bytes.splice(at..at, block);
        }
        _ => {
            // Noise, or zeros.
            let from = random.usize(0..length);
            let until = length.min(from + random.usize(1..600));
            let noise = random.bool();
            bytes[from..until].iter_mut().for_each(|byte| *byte = if noise { random.u8(..) } else { 0 });
        }
    }
}

#[test]
fn two_thousand_damaged_copies_give_nothing_that_was_not_recorded() {
    if is_limited() {
        damaged_copies_give_nothing_that_was_not_recorded(2000);
    } else {
        limited("damage::two_thousand_damaged_copies_give_nothing_that_was_not_recorded");
    }
}

#[test]
#[ignore = "the large form, for tests/run all"]
fn at_large_ten_thousand_damaged_copies_give_nothing_that_was_not_recorded() {
    if is_limited() {
        damaged_copies_give_nothing_that_was_not_recorded(10_000);
    } else {
        limited("damage::at_large_ten_thousand_damaged_copies_give_nothing_that_was_not_recorded");
    }
}

/// Runs a test where address space is short (KiB): what a length claims is not taken.
fn limited(test: &str) {
    print!("{}", run_limited("ulimit -v 400000", test));
}

fn damaged_copies_give_nothing_that_was_not_recorded(copies: u64) {
    let folder = tempfile::tempdir().unwrap();
    let (path, copy) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    record(&path, 240, true);
    let bytes = fs::read(&path).unwrap();
    let (all, _, _) = read(&path);
    let (mut refused, mut whole, mut exact, mut longest) = (0, 0, 0, Duration::ZERO);
    let mut saved_entries = 0;
    for seed in 0..copies {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut damaged = bytes.clone();
        for _ in 0..random.usize(1..=3) {
            if damaged.len() > 4096 {
                corrupt(&mut damaged, &mut random);
            }
        }
        fs::write(&copy, &damaged).unwrap();
        let begun = Instant::now();
        let Ok(recording) = Recording::open(&copy) else {
            refused += 1;
            continue;
        };
        let mut entries = recording.entries().unwrap();
        // Every entry is one of those that were recorded, in their order.
        let (mut next, mut given, mut holes) = (0, 0, 0);
        for entry in &mut entries {
            let entry = entry.unwrap();
            if let What::Hole { lost } = entry.what {
                holes += lost;
                continue;
            }
            let found = all[next..].iter().position(|original| *original == entry);
            next += 1 + found.unwrap_or_else(|| panic!("seed {seed}: not recorded: {entry:?}"));
            given += 1;
        }
        longest = longest.max(begun.elapsed());
        let damage = entries.damage();
        assert!(holes <= damage.lost);
        if recording.is_finished() {
            // The summary is right, and says how much there was.
            assert_eq!(given + damage.lost as usize, all.len(), "seed {seed}: {damage}");
            exact += 1;
        } else {
            assert!(given + damage.lost as usize <= all.len(), "seed {seed}: {damage}");
            assert!(damage.unfinished);
        }
        if given < all.len() {
            assert!(!damage.is_none() || damage.unfinished, "seed {seed}: a loss is not told");
        }
        whole += usize::from(given == all.len());
        saved_entries += given;
    }
    let share = saved_entries as f64 / (all.len() as u64 * copies) as f64;
    println!(
        "{copies} copies of {} bytes: {refused} refused, {whole} gave all, {exact} counted by the summary, \
        {:.0} % of all entries saved, longest {longest:?}",
        bytes.len(),
        100.0 * share,
    );
    assert!(refused < copies as usize / 10 && exact > copies as usize / 10 && share > 0.5);
    assert!(longest < Duration::from_secs(5), "{longest:?}");
}

/// Places and lengths of the chunks of a file, with their heads.
fn chunks(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let mut chunks = Vec::new();
    let mut at = 8;
    while at + 9 <= bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        if bytes[at] == 6 {
            chunks.push(at..at + 9 + length);
        }
        at += 9 + length;
    }
    chunks
}

/// Numbers of the records that a file still gives, and what the decoder counts as lost between them.
fn decoded(path: &Path) -> (Vec<u32>, u64) {
    let mut decoder = Decoder::new();
    let (mut numbers, mut lost) = (Vec::new(), 0);
    for entry in read(path).0 {
        if let Some(decoded) = decoder.take(&entry) {
            if !numbers.is_empty() {
                lost += decoded.lost_before;
            }
            numbers.push(decoded.record.sequence);
            assert_eq!(decoder.about(0).map(|about| about.hand.as_str()), Some("two-finger"));
        }
    }
    (numbers, lost)
}

#[test]
fn a_bad_chunk_costs_its_own_records_whichever_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let (path, copy) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    for finish in [true, false] {
        record(&path, 4000, finish);
        let bytes = fs::read(&path).unwrap();
        let chunks = chunks(&bytes);
        // One for who the hand is, with the metadata before it, and one for each 40 ticks.
        assert_eq!(chunks.len(), 101);
        let all: Vec<u32> = (1..=4000).collect();
        assert_eq!(decoded(&path), (all.clone(), 0));
        let mut random = fastrand::Rng::with_seed(7);
        let mut damage = |which: &[usize], in_the_head: bool| {
            let mut damaged = bytes.clone();
            for &k in which {
                // Content, or what a chunk begins with: kind, length, times, sizes, checksum.
                let from = chunks[k].start + if in_the_head { 0 } else { 60 };
                let until = if in_the_head { from + 45 } else { chunks[k].end };
                damaged[random.usize(from..until)] ^= 1 << random.u32(0..8);
            }
            fs::write(&copy, &damaged).unwrap();
        };
        // Each by itself, the first among them; then fifty, every other one, all but the last, and fifty with heads that
        // are damaged.
        let fifty: Vec<usize> = (0..50).collect();
        let others: Vec<usize> = (0..101).step_by(2).collect();
        let most: Vec<usize> = (0..100).collect();
        let singles: Vec<Vec<usize>> = (0..101).step_by(10).chain([1, 99]).map(|k| vec![k]).collect();
        for which in singles.iter().chain([&fifty, &others, &most]) {
            for in_the_head in [false, true] {
                damage(which, in_the_head);
                let bad = |tick: &u32| which.contains(&(1 + (*tick as usize - 1) / 40));
                let (numbers, lost) = decoded(&copy);
                // Of a head, times can be changed without harm.
                let kept = |tick: &&u32| bad(tick) || numbers.contains(tick);
                let gone = all.iter().find(|tick| !kept(tick));
                assert_eq!(gone, None, "{which:?}, heads: {in_the_head}: {}", read(&copy).1);
                // A flip within a run of zeros may come to the same bytes: a chunk is there as a whole, or not at all.
                let good = all.iter().filter(|tick| !bad(tick)).count();
                assert!(in_the_head || (numbers.len() - good).is_multiple_of(40));
                let between = numbers.windows(2).map(|pair| u64::from(pair[1] - pair[0] - 1)).sum::<u64>();
                assert_eq!(lost, between, "{which:?}");
            }
        }
    }
}

#[test]
fn a_recording_that_was_not_finished_is_finished_and_gives_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let (path, other) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    record(&path, 400, false);
    // A program that is killed while it writes leaves half a piece behind the end.
    let mut bytes = fs::read(&path).unwrap();
    let last = chunks(&bytes).last().unwrap().clone();
    let half = bytes[last.start..(last.start + last.end) / 2].to_vec();
    bytes.extend_from_slice(&half);
    // The writer of this process has the other locked.
    let path = folder.path().join("killed.mcap");
    fs::write(&path, &bytes).unwrap();
    let (before, damage, recording) = read(&path);
    assert!(damage.unfinished && damage.to_string().contains("`blindgrasp recording finish`"), "{damage}");
    assert!(matches!(finish(&recording, None, false), Ok(Finished::Whole { .. })));
    let (after, damage, recording) = read(&path);
    assert!(recording.is_finished() && damage.is_none() && !damage.unfinished, "{damage}");
    assert_eq!((before, recording.received()), (after, Some(400)));
    let summary = mcap::Summary::read(&fs::read(&path).unwrap()).unwrap().unwrap();
    let named = |name: &str| summary.channels.values().any(|channel| channel.topic == name);
    assert!(["/hand/received", "/hand/tick", "/hand/about"].into_iter().all(named));
    assert_eq!((summary.attachment_indexes.len(), summary.chunk_indexes.len()), (1, 11));

    // A damaged one is left as it is; what can be read of it goes to another file, with channels that are introduced anew.
    bytes.truncate(bytes.len() - half.len());
    for k in [0, 5] {
        let chunk = chunks(&bytes)[k].clone();
        bytes[chunk.start + 60] ^= 1;
    }
    fs::write(&path, &bytes).unwrap();
    let (before, _, recording) = read(&path);
    assert!(matches!(finish(&recording, None, false), Ok(Finished::Kept { .. })));
    assert_eq!(fs::read(&path).unwrap(), bytes);
    assert!(matches!(finish(&recording, Some(&other), false), Ok(Finished::Damaged { .. })));
    let (after, damage, recording) = read(&other);
    assert!(recording.is_finished() && damage.places.is_empty(), "{damage}");
    assert_eq!(before, after);
    let summary = mcap::Summary::read(&fs::read(&other).unwrap()).unwrap().unwrap();
    assert!(summary.channels.values().any(|channel| channel.topic == "/hand/tick"
        && channel.schema.as_ref().is_some_and(|schema| schema.name == "blindgrasp.two_finger.Tick")));
    // It is not written over what is there.
    assert!(finish(&recording, Some(&path), false).is_err());
}

#[test]
fn a_recording_that_is_being_written_is_nobody_elses() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    fs::write(&path, "an old one").unwrap();
    let begin = || Writer::create(&path, true);
    let mut writer = begin().unwrap();
    // Nothing is recorded yet: the old one is there, and a second program is refused.
    let busy = |error: RecordingError| matches!(error, RecordingError::Output(OutputError::Busy(_)));
    assert!(busy(begin().map(|_| ()).unwrap_err()));
    writer.checkpoint().unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"an old one");
    let device = writer.add_device("hand");
    writer.about(device, Stamp(0), &about("two-finger")).unwrap();
    writer.checkpoint().unwrap();
    let (entries, _, recording) = read(&path);
    assert!(!entries.is_empty());
    assert!(busy(begin().map(|_| ()).unwrap_err()));
    assert!(busy(finish(&recording, None, false).unwrap_err()));
    writer.finish().unwrap();
    let names: Vec<_> =
        fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["a.mcap"]);
    // Nobody had a session: the one that is there stays.
    drop(begin());
    assert!(fs::read_dir(folder.path()).unwrap().count() == 1 && read(&path).0 == entries);
}
