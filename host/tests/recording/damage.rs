//! Files that were cut or changed: no panic, bounded memory, no entry that was not recorded, and every loss told.

use super::hand::{Hand, about, read, settings};
use super::{is_limited, run_limited};
use blindgrasp::record::mcap::{Entry, Recording, Stamp, What, Writer};
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

const MS: u64 = 1_000_000;
/// Copies that are changed.
const COPIES: u64 = 10_000;

/// A small recording with a checkpoint after each 40 ticks; returns how many bytes and entries each checkpoint saved.
fn record(path: &Path, ticks: u64, finish: bool) -> Vec<(u64, usize)> {
    let mut random = fastrand::Rng::with_seed(1);
    let mut writer = Writer::create(path, true).unwrap();
    let device = writer.add_device("hand");
    let mut saved = vec![(writer.saved().bytes, 0)];
    writer.about(device, Stamp(0), &about("two-finger")).unwrap();
    writer.parameters(device, Stamp(0), &settings("two-finger")).unwrap();
    let mut hand = Hand::new(about("two-finger").joint_names.len());
    for tick in 1..=ticks {
        let (_, payload) = hand.tick(&mut random);
        writer.received(device, Stamp(tick * MS), &payload).unwrap();
        if tick.is_multiple_of(40) {
            writer.checkpoint().unwrap();
            let (entries, damage, _) = read(path);
            assert!(damage.is_none() && damage.unfinished, "{damage}");
            assert_eq!(writer.saved().records, tick);
            saved.push((writer.saved().bytes, entries.len()));
        }
    }
    if finish {
        writer.finish().unwrap();
    } else {
        // As if it were killed: the file stays as the last checkpoint left it.
        std::mem::forget(writer);
    }
    saved
}

#[test]
fn a_file_cut_anywhere_gives_every_checkpoint_before() {
    let folder = tempfile::tempdir().unwrap();
    let (path, cut) = (folder.path().join("whole.mcap"), folder.path().join("cut.mcap"));
    for finish in [true, false] {
        let saved = record(&path, 160, finish);
        let bytes = fs::read(&path).unwrap();
        let (all, _, _) = read(&path);
        for length in 0..bytes.len() {
            // Every byte where something begins or ends, and every seventh of the rest.
            let near = saved.iter().any(|(bytes, _)| bytes.abs_diff(length as u64) < 60);
            if !near && length % 7 != 0 {
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
            // Whole checkpoints or nothing.
            assert!(saved.iter().any(|saved| saved.1 == given.len()) || given.len() == all.len());
            if given.len() < all.len() {
                assert!(entries.damage().unfinished);
            }
        }
    }
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
fn ten_thousand_damaged_copies_give_nothing_that_was_not_recorded() {
    if !is_limited() {
        // Address space, KiB: what a length claims is not taken.
        let told = run_limited(
            "ulimit -v 400000",
            "damage::ten_thousand_damaged_copies_give_nothing_that_was_not_recorded",
        );
        print!("{told}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (path, copy) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    record(&path, 240, true);
    let bytes = fs::read(&path).unwrap();
    let (all, _, _) = read(&path);
    let (mut refused, mut whole, mut exact, mut longest) = (0, 0, 0, Duration::ZERO);
    let mut saved_entries = 0;
    for seed in 0..COPIES {
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
    let share = saved_entries as f64 / (all.len() as u64 * COPIES) as f64;
    println!(
        "{COPIES} copies of {} bytes: {refused} refused, {whole} gave all, {exact} counted by the summary, \
        {:.0} % of all entries saved, longest {longest:?}",
        bytes.len(),
        100.0 * share,
    );
    assert!(refused < COPIES as usize / 10 && exact > COPIES as usize / 10 && share > 0.5);
    assert!(longest < Duration::from_secs(5), "{longest:?}");
}
