//! The counter's driver, byte by byte.

use crate::model;

use blindgrasp_firmware::joints::ls7366r::{Counter, CounterError, FilterClock, Zero};
use blindgrasp_shared::fault::Fault;
use embedded_hal::spi::ErrorKind;
use embedded_hal_mock::eh1::spi::{Mock, Transaction};
use model::{CounterChip, Line, Select, Traffic, share};

type Frames = Vec<Transaction<u8>>;

fn write(bytes: &[u8]) -> Frames {
    vec![
        Transaction::transaction_start(),
        Transaction::write_vec(bytes.to_vec()),
        Transaction::transaction_end(),
    ]
}

/// An instruction, and what comes while the rest is clocked.
fn read(instruction: u8, answer: &[u8]) -> Frames {
    let mut sent = vec![instruction];
    sent.resize(1 + answer.len(), 0);
    let received = [&[0xFF], answer].concat();
    vec![
        Transaction::transaction_start(),
        Transaction::transfer_in_place(sent, received),
        Transaction::transaction_end(),
    ]
}

/// Runs `test` on a counter that expects these frames, and no others.
fn expect<T>(frames: &[Frames], test: impl FnOnce(&mut Counter<Mock<u8>>) -> T) -> T {
    let mut counter = Counter::new(Mock::new(&frames.concat()), FilterClock::Half);
    let result = test(&mut counter);
    counter.release().done();
    result
}

const MDR0: u8 = 0x48;
const MDR1: u8 = 0x50;
const CNTR: u8 = 0x60;
const STR: u8 = 0x70;

/// Settings are written and read back, then a pattern is loaded through DTR and read as the count.
fn prepare_without_patterns() -> Vec<Frames> {
    vec![
        read(MDR0, &[0x00]),
        read(MDR1, &[0x00]),
        write(&[0x90, 0x04]),
        write(&[0x88, 0x83]),
        read(MDR1, &[0x04]),
        read(MDR0, &[0x83]),
    ]
}

fn pattern(bytes: [u8; 4], answer: [u8; 4]) -> Vec<Frames> {
    let [a, b, c, d] = bytes;
    vec![write(&[0x98, a, b, c, d]), write(&[0xE0]), read(CNTR, &answer)]
}

const PATTERNS: [[u8; 4]; 4] =
    [[0x01, 0x02, 0x04, 0x08], [0x10, 0x20, 0x40, 0x80], [0xFE, 0xFD, 0xFB, 0xF7], [0xEF, 0xDF, 0xBF, 0x7F]];

#[test]
fn a_counter_without_settings_is_set_tested_and_tagged() {
    let mut frames = prepare_without_patterns();
    frames.extend(PATTERNS.iter().flat_map(|&bytes| pattern(bytes, bytes)));
    frames.extend([write(&[0x98, 0x12, 0x34, 0x56, 0x78]), write(&[0xE0])]);
    assert_eq!(expect(&frames, |counter| counter.prepare(0x1234_5678)), Ok(Zero::Lost));
}

#[test]
fn a_counter_that_counted_on_is_only_read() {
    let frames = [read(MDR0, &[0x83]), read(MDR1, &[0x00]), read(STR, &[0x0A])];
    assert_eq!(expect(&frames, |counter| counter.prepare(1)), Ok(Zero::Kept));
}

#[test]
fn settings_do_not_vouch_for_a_counter_that_lost_its_power() {
    let mut frames = vec![read(MDR0, &[0x83]), read(MDR1, &[0x00]), read(STR, &[0x0E])];
    frames.extend(prepare_without_patterns().split_off(2));
    frames.extend(PATTERNS.iter().flat_map(|&bytes| pattern(bytes, bytes)));
    frames.extend([write(&[0x98, 0, 0, 0, 1]), write(&[0xE0])]);
    assert_eq!(expect(&frames, |counter| counter.prepare(1)), Ok(Zero::Lost));
}

#[test]
fn the_filter_clock_is_a_setting() {
    let frames = [read(MDR0, &[0x03]), read(MDR1, &[0x00]), read(STR, &[0x08])].concat();
    let mut counter = Counter::new(Mock::new(&frames), FilterClock::Whole);
    assert_eq!(counter.prepare(1), Ok(Zero::Kept));
    counter.release().done();
}

#[test]
fn a_line_that_is_stuck_is_a_counter_that_does_not_answer() {
    for level in [0x00, 0xFF] {
        let frames = [
            read(MDR0, &[level]),
            read(MDR1, &[level]),
            write(&[0x90, 0x04]),
            write(&[0x88, 0x83]),
            read(MDR1, &[level]),
        ];
        let error = expect(&frames, |counter| counter.prepare(1)).unwrap_err();
        assert_eq!(error, CounterError::Silent { level });
        assert_eq!(error.fault(), Fault::SampleMissing);

        // In operation the count of a stuck line is a possible one; the status is not.
        let frames = [read(CNTR, &[level; 4]), read(STR, &[level])];
        let error = expect(&frames, |counter| counter.read()).unwrap_err();
        assert_eq!(error, CounterError::Silent { level });
    }
}

#[test]
fn each_setting_and_each_pattern_has_to_come_back() {
    let mut mdr1 = prepare_without_patterns();
    mdr1.truncate(4);
    mdr1.push(read(MDR1, &[0x05]));
    let error = expect(&mdr1, |counter| counter.prepare(1)).unwrap_err();
    assert_eq!(error, CounterError::NotStored { register: "MDR1", written: 0x04, read: 0x05 });

    let mut mdr0 = prepare_without_patterns();
    mdr0.truncate(5);
    mdr0.push(read(MDR0, &[0x03]));
    let error = expect(&mdr0, |counter| counter.prepare(1)).unwrap_err();
    assert_eq!(error, CounterError::NotStored { register: "MDR0", written: 0x83, read: 0x03 });

    for (k, bytes) in PATTERNS.into_iter().enumerate() {
        for byte in 0..4 {
            let mut answer = bytes;
            answer[byte] ^= 0x10;
            let mut frames = prepare_without_patterns();
            frames.extend(PATTERNS[..k].iter().flat_map(|&bytes| pattern(bytes, bytes)));
            frames.extend(pattern(bytes, answer));
            let error = expect(&frames, |counter| counter.prepare(1)).unwrap_err();
            let (written, read) = (u32::from_be_bytes(bytes), u32::from_be_bytes(answer));
            assert_eq!(error, CounterError::NotStored { register: "CNTR", written, read });
            assert_eq!(error.fault(), Fault::SampleMissing);
        }
    }
}

#[test]
fn another_chip_behind_the_same_select_is_told_by_its_tag() {
    let frames = [read(CNTR, &[0, 0, 0, 7])];
    assert_eq!(expect(&frames, |counter| counter.identify(7)), Ok(()));
    let error = expect(&frames, |counter| counter.identify(6)).unwrap_err();
    assert!(matches!(error, CounterError::NotStored { written: 6, read: 7, .. }), "{error}");
}

#[test]
fn starting_clears_the_power_loss_last() {
    let frames = [write(&[0x20]), write(&[0x10]), write(&[0x30])];
    assert_eq!(expect(&frames, |counter| counter.start()), Ok(()));
}

#[test]
fn a_count_is_read_before_the_status_that_vouches_for_it() {
    for (bytes, count) in [
        ([0x00, 0x00, 0x54, 0x60], 21_600),
        ([0xFF, 0xFF, 0xFF, 0xFF], -1),
        ([0x00, 0x00, 0x00, 0x00], 0),
        ([0x7F, 0xFF, 0xFF, 0xFF], i32::MAX),
        ([0x80, 0x00, 0x00, 0x00], i32::MIN),
    ] {
        // Carry, borrow, compare, index, direction and sign are no matter.
        for status in [0x08, 0xFB] {
            let frames = [read(CNTR, &bytes), read(STR, &[status])];
            assert_eq!(expect(&frames, |counter| counter.read()), Ok(count));
        }
    }
}

#[test]
fn lost_power_is_seen_with_the_count_that_it_spoilt() {
    for status in [0x0C, 0x04, 0x02] {
        let frames = [read(CNTR, &[0, 0, 0, 3]), read(STR, &[status])];
        let error = expect(&frames, |counter| counter.read()).unwrap_err();
        assert_eq!(error, CounterError::Reset { status });
        assert_eq!(error.fault(), Fault::CounterReset);
    }
}

#[test]
fn settings_are_read_back() {
    let frames = [read(MDR0, &[0x83]), read(MDR1, &[0x00])];
    assert_eq!(expect(&frames, |counter| counter.verify()), Ok(()));

    let frames = [read(MDR0, &[0x81]), read(STR, &[0x08])];
    let error = expect(&frames, |counter| counter.verify()).unwrap_err();
    assert_eq!(error, CounterError::Changed { register: "MDR0", written: 0x83, read: 0x81 });
    assert_eq!(error.fault(), Fault::CounterReset);

    let frames = [read(MDR0, &[0x83]), read(MDR1, &[0x01]), read(STR, &[0x08])];
    let error = expect(&frames, |counter| counter.verify()).unwrap_err();
    assert_eq!(error, CounterError::Changed { register: "MDR1", written: 0x00, read: 0x01 });

    let frames = [read(MDR0, &[0xFF]), read(STR, &[0xFF])];
    let error = expect(&frames, |counter| counter.verify()).unwrap_err();
    assert_eq!(error, CounterError::Silent { level: 0xFF });
}

#[test]
fn an_error_of_the_bus_is_a_missing_sample() {
    let chip = CounterChip { line: Line::Error, ..CounterChip::default() };
    let mut counter = Counter::new(Select::to(&share(chip), &share(Traffic::default())), FilterClock::Half);
    let error = CounterError::Bus(ErrorKind::Overrun);
    assert_eq!(error.fault(), Fault::SampleMissing);
    assert_eq!(counter.prepare(1), Err(error));
    assert_eq!(counter.identify(1), Err(error));
    assert_eq!(counter.start(), Err(error));
    assert_eq!(counter.read(), Err(error));
    assert_eq!(counter.verify(), Err(error));
}
