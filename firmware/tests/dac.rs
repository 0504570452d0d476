//! The DAC's driver, byte by byte.

use crate::model;

use blindgrasp_firmware::joints::dac::{Dac, DacError};
use embedded_hal::spi::ErrorKind;
use embedded_hal_mock::eh1::spi::{Mock, Transaction};
use model::{DacChip, Line, Select, Traffic, share};

type Frames = Vec<Transaction<u8>>;

fn write(address: u8, value: u16) -> Frames {
    let [high, low] = value.to_be_bytes();
    vec![
        Transaction::transaction_start(),
        Transaction::write_vec(vec![address, high, low]),
        Transaction::transaction_end(),
    ]
}

/// A frame that asks, and one that does nothing and brings the answer.
fn read(address: u8, answer: u16) -> Frames {
    let [high, low] = answer.to_be_bytes();
    let mut frames = write(0x80 | address, 0);
    frames.extend([
        Transaction::transaction_start(),
        Transaction::transfer_in_place(vec![0x18, 0, 0], vec![0, high, low]),
        Transaction::transaction_end(),
    ]);
    frames
}

/// Runs `test` on a DAC that expects these frames, and no others.
fn expect<T>(frames: &[Frames], test: impl FnOnce(&mut Dac<Mock<u8>>) -> T) -> T {
    let mut dac = Dac::new(Mock::new(&frames.concat()));
    let result = test(&mut dac);
    dac.release().done();
    result
}

/// The whole self-test; the undefined bits of registers read as ones.
fn prepare() -> Vec<Frames> {
    let mut frames = vec![
        write(0x10, 0x0000),
        read(0x10, 0xF800),
        write(0x19, 0x000C),
        read(0x19, 0xFFFC),
        write(0x0C, 0x0004),
        read(0x08, 0xFFFC),
        read(0x09, 0xFFFC),
        read(0x0A, 0xFFFC),
        read(0x0B, 0xFFFC),
    ];
    for codes in [[0x5A01, 0x2D02, 0x1604, 0x0B08], [0xA5FE, 0xD2FD, 0xE9FB, 0xF4F7]] {
        frames.extend((0..).zip(codes).map(|(channel, code)| write(channel, code)));
        frames.push(write(0x1D, 0));
        frames.extend((0..).zip(codes).map(|(channel, code)| read(channel, code)));
    }
    frames.extend([write(0x04, 0), write(0x1D, 0)]);
    frames
}

#[test]
fn off_is_the_power_control_register_cleared() {
    assert_eq!(expect(&[write(0x10, 0)], |dac| dac.silence()), Ok(()));
}

#[test]
fn the_self_test_writes_and_reads_every_register_with_the_outputs_off() {
    assert_eq!(expect(&prepare(), |dac| dac.prepare()), Ok(()));
}

/// Each answer of the self-test is needed: with any of them wrong in a bit that is defined, it ends there.
#[test]
fn each_answer_of_the_self_test_has_to_be_right() {
    let frames = prepare();
    let answers: Vec<usize> = (0..frames.len()).filter(|&k| frames[k].len() == 6).collect();
    assert_eq!(answers.len(), 1 + 1 + 4 + 2 * 4);
    for k in answers {
        let asked = frames[k][1].clone();
        let address =
            (0..=0x1F).find(|&a| asked == Transaction::write_vec(vec![0x80 | a, 0, 0])).expect("a read");
        let right = (0..=u16::MAX).find(|&v| read(address, v)[4] == frames[k][4]).expect("an answer");
        let mut frames = frames[..k].to_vec();
        frames.push(read(address, right ^ 0x0002));
        let error = expect(&frames, |dac| dac.prepare()).unwrap_err();
        let channel = if matches!(address, 0x10 | 0x19) { 0 } else { address & 0b11 };
        assert!(matches!(error, DacError::NotStored { read, .. } if read == right ^ 0x0002), "{error}");
        assert_eq!(error.channel(), channel);
    }
}

#[test]
fn a_line_that_is_stuck_is_found_by_the_self_test() {
    let frames = [write(0x10, 0), read(0x10, 0xFFFF)];
    let register = "power control";
    let error = DacError::NotStored { register, channel: 0, written: 0, read: 0xFFFF };
    assert_eq!(expect(&frames, |dac| dac.prepare()), Err(error));

    let frames = [write(0x10, 0), read(0x10, 0x0000), write(0x19, 0x000C), read(0x19, 0x0000)];
    let error = DacError::NotStored { register: "control", channel: 0, written: 0x000C, read: 0 };
    assert_eq!(expect(&frames, |dac| dac.prepare()), Err(error));
}

#[test]
fn starting_powers_outputs_and_reference() {
    let frames = [write(0x10, 0x001F), read(0x10, 0xF81F), read(0x00, 0x0000)];
    assert_eq!(expect(&frames, |dac| dac.start()), Ok(()));
    for read_back in [0x001E, 0x000F, 0x0000] {
        let frames = [write(0x10, 0x001F), read(0x10, read_back)];
        let error = expect(&frames, |dac| dac.start()).unwrap_err();
        assert!(matches!(error, DacError::NotStored { read, .. } if read == read_back), "{error}");
    }
    let frames = [write(0x10, 0x001F), read(0x10, 0xFFFF), read(0x00, 0xFFFF)];
    let error = DacError::NotStored { register: "code", channel: 0, written: 0, read: 0xFFFF };
    assert_eq!(expect(&frames, |dac| dac.start()), Err(error));
}

#[test]
fn codes_wait_until_they_are_loaded_together() {
    let frames =
        [write(0x00, 0x7FFF), write(0x01, 0x8000), write(0x02, 0xFFFF), write(0x03, 0), write(0x1D, 0)];
    let result = expect(&frames, |dac| {
        for (channel, code) in [(0, i16::MAX), (1, i16::MIN), (2, -1), (3, 0)] {
            dac.set_code(channel, code)?;
        }
        dac.load()
    });
    assert_eq!(result, Ok(()));
}

#[test]
fn in_operation_power_and_code_are_read_back() {
    assert_eq!(expect(&[read(0x10, 0xF81F), read(0x02, 0xFFFE)], |dac| dac.verify(2, -2)), Ok(()));

    let frames = [read(0x10, 0x001F), read(0x02, 0xFFFF)];
    let error = DacError::NotStored { register: "code", channel: 2, written: 0xFFFE, read: 0xFFFF };
    assert_eq!(expect(&frames, |dac| dac.verify(2, -2)), Err(error));

    for (power, error) in [
        (0x0080 | 0x001F, DacError::Overcurrent { channel: 0 }),
        (0x0400 | 0x001F, DacError::Overcurrent { channel: 3 }),
        (0x0020 | 0x001F, DacError::TooHot),
        (0x0020, DacError::TooHot),
        (
            0x0017,
            DacError::NotStored { register: "power control", channel: 0, written: 0x001F, read: 0x0017 },
        ),
        (
            0x0000,
            DacError::NotStored { register: "power control", channel: 0, written: 0x001F, read: 0x0000 },
        ),
        (
            0xFFFF,
            DacError::NotStored { register: "power control", channel: 0, written: 0x001F, read: 0xFFFF },
        ),
    ] {
        let result = expect(&[read(0x10, power)], |dac| dac.verify(1, 0));
        assert_eq!(result, Err(error), "{power:#06x}");
    }
}

#[test]
fn an_error_of_the_bus_is_told() {
    let chip = share(DacChip { line: Line::Error, ..DacChip::default() });
    let mut dac = Dac::new(Select::to(&chip, &share(Traffic::default())));
    let error = Err(DacError::Bus(ErrorKind::Overrun));
    assert_eq!(dac.silence(), error);
    assert_eq!(dac.prepare(), error);
    assert_eq!(dac.start(), error);
    assert_eq!(dac.set_code(0, 0), error);
    assert_eq!(dac.load(), error);
    assert_eq!(dac.verify(0, 0), error);
}
