//! Saved parameters in a flash in memory, whose power is cut at any byte.

use crate::flash;

use crate::random::Random;
use blindgrasp_shared::parameter::Text;
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::store::{Entry, MOST_ENTRIES, MOST_WORDS, SLOT_BYTES, Store, StoreError};
use crc::{CRC_32_ISO_HDLC, Crc};
use flash::Memory;
use proptest::prelude::*;
use std::collections::HashSet;

const HAND: u32 = 0x1234_5678;

type HandStore = Store<Memory>;

/// Key, index and the value's bits of an entry.
type Bits = (u32, u8, u32);

fn open(memory: Memory) -> HandStore {
    Store::open(memory).expect("the geometry is right and reading needs no power")
}

/// A start with power, and the flash as it is then.
fn boot(store: HandStore) -> HandStore {
    let memory = store.into_flash();
    open(Memory { power: usize::MAX, ..memory })
}

fn save(store: &mut HandStore, hand_hash: u32, entries: &[Entry]) -> Result<(), StoreError> {
    store.begin(hand_hash, entries.len())?;
    entries.iter().try_for_each(|entry| store.put(entry))?;
    store.finish()
}

/// The newest set, with its bits.
fn found(store: &mut HandStore) -> Option<(u32, Vec<Bits>)> {
    let set = *store.newest()?;
    let entries =
        (0..set.entry_count).map(|index| store.entry(index).ok().flatten().expect("it has as many"));
    Some((set.hand_hash, bits(&entries.collect::<Vec<_>>())))
}

fn bits(entries: &[Entry]) -> Vec<Bits> {
    entries.iter().map(|entry| (entry.key, entry.index, entry.value.to_bits())).collect()
}

/// Entries of random bits: also those of NaN, and of blank flash.
fn entries(random: &mut Random, count: usize) -> Vec<Entry> {
    let mut word = || if random.below(8) == 0 { u32::MAX } else { random.next() as u32 };
    (0..count).map(|_| Entry { key: word(), index: word() as u8, value: f32::from_bits(word()) }).collect()
}

/// The promise for saved parameters.
#[test]
fn ten_thousand_saves_cut_at_a_random_byte_leave_the_old_or_the_new_set() {
    let mut random = Random::new(13);
    let mut store = open(Memory::blank(4));
    let (mut before, mut round, mut cut_saves, mut cut_starts, mut of_the_new) = (None, 0, 0, 0, 0);
    while cut_saves < 10_000 {
        round += 1;
        let count = random.below(16);
        let new = entries(&mut random, count);
        let (with_start, save_power) = (random.below(3) == 0, random.below(4 * (6 + 3 * count) + 8));
        let start_power = if with_start { random.below(store.flash().sector_bytes()) } else { usize::MAX };
        store = open(Memory { power: start_power, ..store.into_flash() });
        assert_eq!(found(&mut store), before, "round {round}");
        if store.prepare().is_err() {
            cut_starts += 1;
            store = boot(store);
            assert_eq!(found(&mut store), before, "round {round}");
            continue;
        }
        store = open(Memory { power: save_power, ..store.into_flash() });
        let saved = save(&mut store, HAND, &new);
        store = boot(store);
        let after = found(&mut store);
        let whole = Some((HAND, bits(&new)));
        match saved {
            Ok(()) => assert_eq!(after, whole, "round {round}"),
            Err(StoreError::Flash(_)) => {
                cut_saves += 1;
                of_the_new += usize::from(after == whole && after != before);
                assert!(after == before || after == whole, "round {round}: {after:?}");
            }
            Err(error) => panic!("round {round}: {error}"),
        }
        before = after;
    }
    println!("{round} starts, {cut_starts} cut while a sector was erased; {of_the_new} saves cut, but valid");
    assert!(cut_starts > 1000 && of_the_new > 0 && round - cut_starts > 10_100);
}

/// The remains of a cut do no harm later.
#[test]
fn after_every_byte_of_a_save_the_next_one_works() {
    let mut random = Random::new(2);
    let (old, new) = (entries(&mut random, 3), entries(&mut random, 4));
    for power in 0..=4 * (6 + 3 * new.len()) {
        let mut store = open(Memory::blank(4));
        assert_eq!(store.prepare(), Ok(true));
        save(&mut store, HAND, &old).unwrap();
        let mut memory = store.into_flash();
        memory.power = power;
        store = open(memory);
        let saved = save(&mut store, HAND, &new);
        store = boot(store);
        let expected = if saved.is_ok() { &new } else { &old };
        assert_eq!(found(&mut store), Some((HAND, bits(expected))), "{power}");
        store.prepare().unwrap();
        save(&mut store, HAND, &new).unwrap();
        assert_eq!(found(&mut boot(store)), Some((HAND, bits(&new))), "{power}");
    }
}

/// 128 KiB a sector.
#[test]
fn sectors_are_erased_only_at_the_start_and_only_when_room_is_short() {
    let mut random = Random::new(3);
    let mut store = open(Memory::blank(32));
    for start in 0..200 {
        // A blank chip has no mark: it is erased once, as nobody knows how well it was before.
        let erased = store.prepare().unwrap();
        assert_eq!(erased, [0, 24, 55, 86, 117, 148, 179].contains(&start), "start {start}");
        let free = store.free_slots();
        assert!(free >= 8, "start {start}: {free}");
        let new = entries(&mut random, 5);
        let erasures = store.flash().erasures;
        save(&mut store, HAND, &new).unwrap();
        assert_eq!((store.free_slots(), store.flash().erasures), (free - 1, erasures));
        store = boot(store);
        assert_eq!(found(&mut store), Some((HAND, bits(&new))));
    }
}

#[test]
fn without_a_spare_it_is_refused_and_the_old_set_stays() {
    let mut store = open(Memory::blank(4));
    assert_eq!(save(&mut store, HAND, &[]), Err(StoreError::NoSpare), "nothing was prepared");
    assert_eq!(store.newest(), None);
    assert_eq!(store.prepare(), Ok(true));
    let entry = |value| Entry { key: 7, index: 1, value };
    let room = store.free_slots();
    for save_number in 0..room {
        save(&mut store, HAND, &[entry(save_number as f32)]).unwrap();
    }
    assert_eq!(save(&mut store, HAND, &[entry(-1.0)]), Err(StoreError::NoSpare));
    let last = bits(&[entry((room - 1) as f32)]);
    assert_eq!(found(&mut store), Some((HAND, last.clone())));
    store = boot(store);
    assert_eq!(store.prepare(), Ok(true));
    assert_eq!(found(&mut store), Some((HAND, last)));
    save(&mut store, HAND, &[entry(-1.0)]).unwrap();
    assert_eq!(found(&mut boot(store)), Some((HAND, bits(&[entry(-1.0)]))));
}

#[test]
fn a_set_is_as_long_as_it_was_announced() {
    let mut store = open(Memory::blank(4));
    store.prepare().unwrap();
    let entry = Entry { key: 1, index: 2, value: 3.0 };
    assert_eq!(store.begin(HAND, MOST_ENTRIES + 1), Err(StoreError::TooManyEntries));
    assert_eq!(store.put(&entry), Err(StoreError::OutOfOrder));
    assert_eq!(store.finish(), Err(StoreError::OutOfOrder));
    store.begin(HAND, 2).unwrap();
    store.put(&entry).unwrap();
    assert_eq!(store.finish(), Err(StoreError::OutOfOrder), "one is missing");
    assert_eq!(store.put(&entry), Err(StoreError::OutOfOrder), "it was given up");
    store.begin(HAND, 1).unwrap();
    store.put(&entry).unwrap();
    assert_eq!(store.put(&entry), Err(StoreError::OutOfOrder), "one too many");
    assert_eq!(store.newest(), None);
    store = boot(store);
    store.prepare().unwrap();
    let most = vec![entry; MOST_ENTRIES];
    save(&mut store, HAND, &most).unwrap();
    assert_eq!(found(&mut boot(store)), Some((HAND, bits(&most))));
}

#[test]
fn a_call_programs_a_few_words() {
    let mut store = open(Memory::blank(4));
    store.prepare().unwrap();
    let entry = Entry { key: 1, index: 0, value: 2.0 };
    let mut total = 0;
    for call in 0..4 {
        let before = store.flash().words;
        match call {
            0 => store.begin(HAND, 2).unwrap(),
            1 | 2 => store.put(&entry).unwrap(),
            _ => store.finish().unwrap(),
        }
        let words = store.flash().words - before;
        assert!((1..=MOST_WORDS).contains(&words), "call {call}: {words}");
        total += words;
    }
    assert_eq!(total, 12);
}

/// `defaults` is a set without entries: older ones do not come back.
#[test]
fn an_empty_set_forgets() {
    let mut store = open(Memory::blank(4));
    store.prepare().unwrap();
    save(&mut store, HAND, &[Entry { key: 1, index: 0, value: 2.0 }]).unwrap();
    save(&mut store, HAND, &[]).unwrap();
    assert_eq!(found(&mut boot(store)), Some((HAND, Vec::new())));
}

#[test]
fn a_set_of_another_hand_is_found_as_such() {
    let mut store = open(Memory::blank(4));
    store.prepare().unwrap();
    let entry = Entry { key: 1, index: 0, value: 2.0 };
    save(&mut store, HAND, &[entry]).unwrap();
    save(&mut store, !HAND, &[entry, entry]).unwrap();
    let mut store = boot(store);
    assert_eq!(store.newest().map(|set| (set.hand_hash, set.entry_count)), Some((!HAND, 2)));
    save(&mut store, HAND, &[]).unwrap();
    assert_eq!(found(&mut boot(store)), Some((HAND, Vec::new())));
}

/// A set as it stands in flash, word by word, by another implementation.
fn set_words(sequence: u32, entry: Entry) -> Vec<u32> {
    let words = [0x4247_0001, sequence, HAND, 1, entry.key, entry.index.into(), entry.value.to_bits()];
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    digest.update(b"blindgrasp");
    words.iter().for_each(|word| digest.update(&word.to_le_bytes()));
    [&words[..], &[digest.finalize(), 0x600D_5E75]].concat()
}

fn put_words(memory: &mut Memory, slot: usize, words: &[u32]) {
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<_>>();
    memory.bytes[slot * SLOT_BYTES as usize..][..bytes.len()].copy_from_slice(&bytes);
}

#[test]
fn what_stands_in_flash_stays_readable_and_sequence_numbers_wrap() {
    let entry = |value| Entry { key: Parameter::gain(0).key_hash(), index: 0, value };
    let mut memory = Memory::blank(8);
    put_words(&mut memory, 0, &[0x5EAD_1E55]);
    put_words(&mut memory, 1, &set_words(u32::MAX - 1, entry(1.0)));
    put_words(&mut memory, 2, &set_words(u32::MAX, entry(2.0)));
    let mut store = open(memory);
    assert_eq!(found(&mut store), Some((HAND, bits(&[entry(2.0)]))));
    for value in 3..30 {
        store.prepare().unwrap();
        save(&mut store, HAND, &[entry(value as f32)]).unwrap();
        let sequence = store.newest().unwrap().sequence;
        assert_eq!(sequence, value - 3);
        store = boot(store);
        assert_eq!(found(&mut store), Some((HAND, bits(&[entry(value as f32)]))));
    }
    let mut memory = Memory::blank(8);
    put_words(&mut memory, 0, &[0x5EAD_1E55]);
    let mut store = open(memory);
    save(&mut store, HAND, &[entry(4.0)]).unwrap();
    let written = store.into_flash().bytes;
    let mut memory = Memory::blank(8);
    put_words(&mut memory, 0, &[0x5EAD_1E55]);
    put_words(&mut memory, 1, &set_words(0, entry(4.0)));
    assert_eq!(written, memory.bytes);
}

/// A bit that is lost later makes a set invalid, and the one before counts again.
#[test]
fn a_set_with_a_flipped_bit_does_not_count() {
    let entry = |value| Entry { key: 1, index: 0, value };
    let mut store = open(Memory::blank(4));
    store.prepare().unwrap();
    save(&mut store, HAND, &[entry(1.0)]).unwrap();
    save(&mut store, HAND, &[entry(2.0)]).unwrap();
    let bytes = store.into_flash().bytes;
    let second =
        bytes.iter().rposition(|&byte| byte != 0xff).unwrap() / SLOT_BYTES as usize * SLOT_BYTES as usize;
    for bit in 0..8 * 4 * 9 {
        let mut damaged = bytes.clone();
        damaged[second + bit / 8] ^= 1 << (bit % 8);
        assert_eq!(
            found(&mut open(Memory::holding(damaged))),
            Some((HAND, bits(&[entry(1.0)]))),
            "bit {bit}"
        );
    }
}

#[test]
fn other_sectors_are_refused() {
    let slot = SLOT_BYTES as usize;
    for bytes in [0, 2, slot, 2 * slot, 6 * slot, 8 * slot + 8] {
        let opened = Store::open(Memory::holding(vec![0xff; bytes]));
        assert_eq!(opened.err(), Some(StoreError::Geometry), "{bytes}");
    }
}

#[test]
fn every_parameter_has_a_name_of_its_own() {
    let hashes: HashSet<u32> = Parameter::ALL.iter().map(|parameter| parameter.key_hash()).collect();
    assert_eq!(hashes.len(), Parameter::ALL.len());
    // The reference values of FNV-1a, 32 bits, for "", "a" and "foobar".
    let known = [("", 0x811c_9dc5), ("a", 0xe40c_292c), ("foobar", 0xbf9c_f968)];
    for (text, hash) in known {
        assert_eq!(Text::plain(text).hash(), hash);
        assert_eq!(Text::new(text, "").hash(), hash);
    }
    assert_eq!(Text::new("foo", "bar").hash(), 0xbf9c_f968);
}

proptest! {
    /// Whatever the flash holds, a start ends, nothing is read that was not marked, and a save works after it.
    #[test]
    fn any_content_is_survived(seed: u64, blank_share in 0_usize..10) {
        let mut random = Random::new(seed);
        let mut memory = Memory::blank(4);
        for word in memory.bytes.chunks_exact_mut(4) {
            match random.below(10) {
                share if share < blank_share => {}
                9 => word.copy_from_slice(&0x4247_0001_u32.to_le_bytes()),
                8 => word.copy_from_slice(&0x5EAD_1E55_u32.to_le_bytes()),
                7 => word.copy_from_slice(&0x600D_5E75_u32.to_le_bytes()),
                _ => word.copy_from_slice(&(random.next() as u32).to_le_bytes()),
            }
        }
        let mut store = open(memory);
        prop_assert_eq!(store.newest(), None);
        store.prepare().unwrap();
        let new = entries(&mut random, 5);
        save(&mut store, HAND, &new).unwrap();
        prop_assert_eq!(found(&mut boot(store)), Some((HAND, bits(&new))));
    }

    /// Saves, of any length and for any hand, with or without a start in between, cut or not.
    #[test]
    fn what_is_found_is_what_was_saved_last(
        saves in prop::collection::vec((0..=MOST_ENTRIES, any::<u32>(), any::<bool>(), prop::option::of(0_usize..5000)), 1..20),
        seed: u64,
    ) {
        let mut random = Random::new(seed);
        let mut store = open(Memory::blank(4));
        let mut expected = None;
        for (count, hand_hash, starts, cut) in saves {
            let new = entries(&mut random, count);
            if starts {
                store = boot(store);
                store.prepare().unwrap();
            }
            if let Some(power) = cut {
                let memory = store.into_flash();
                store = open(Memory { power, ..memory });
            }
            let room = store.free_slots();
            match save(&mut store, hand_hash, &new) {
                Ok(()) => expected = Some((hand_hash, bits(&new))),
                Err(StoreError::NoSpare) => prop_assert_eq!(room, 0),
                Err(StoreError::Flash(_)) => prop_assert!(cut.is_some()),
                Err(error) => panic!("{error}"),
            }
            store = boot(store);
            prop_assert_eq!(&found(&mut store), &expected);
        }
    }
}
