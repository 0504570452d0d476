//! Frames that nothing happened to, and bytes that are hard for COBS.

use super::property::{self, CAPACITY, LONGEST, Raw, frame, receive, stuff, with_crc};
use blindgrasp_shared::bytes::BufferTooSmall;
use blindgrasp_shared::link::{self, Counters, FrameError, Receiver};
use proptest::prelude::*;
use serde::Serialize;

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Made with Python's `zlib.crc32(b"blindgrasp" + payload)`. If this fails, the interface has changed.
#[test]
fn golden_bytes() {
    assert_eq!(hex(&frame(b"123456789")), "0e313233343536373839243cebc100");
    assert_eq!(hex(&frame(&[])), "05bb36a1fc00");
    assert_eq!(hex(&frame(&[0])), "0105bf244d8e00");
    assert_eq!(hex(&frame(&[0x11, 0, 0, 0x22])), "021101062224cd03f500");

    #[derive(Serialize)]
    enum Message {
        #[allow(dead_code, reason = "takes the number 0")]
        Other,
        Set {
            index: u8,
            value: f32,
            name: Option<&'static str>,
        },
    }
    let message = Message::Set { index: 0, value: -1.5, name: Some("torque") };
    let mut buffer = [0; 32];
    let bytes = link::encode(&message, &mut buffer).unwrap();
    assert_eq!(hex(bytes), "020101010fc0bf0106746f7271756532de63dc00");
}

/// The tests compute CRCs by themselves; this is the check value of the catalogue (reveng.sourceforge.io/crc-catalogue).
#[test]
fn the_tests_own_crc_is_the_standard_one() {
    assert_eq!(property::crc32(b"123456789"), 0xcbf4_3926);
}

/// Around the lengths at which a block is full.
#[test]
fn golden_bytes_of_full_blocks() {
    let head_and_tail = |length: usize| {
        let bytes = stuff(&vec![7; length]);
        (hex(&bytes[..2]), bytes.len(), hex(&bytes[bytes.len() - 3..]))
    };
    // The independent encoder first, against the examples of COBS: 254 bytes make no second block, 255 do.
    assert_eq!(head_and_tail(253), ("fe07".into(), 255, "070700".into()));
    assert_eq!(head_and_tail(254), ("ff07".into(), 256, "070700".into()));
    assert_eq!(head_and_tail(255), ("ff07".into(), 258, "020700".into()));
    assert_eq!(stuff(&[&[7; 254][..], &[0]].concat())[255..], [1, 1, 0]);
    // Then the real one against it, wherever zeros stand.
    for length in (0..=LONGEST).filter(|length| (length + 4) % 254 < 9 || (length + 4) % 254 > 249) {
        for zero in [None, Some(0), Some(length / 2), length.checked_sub(1), length.checked_sub(3)] {
            let mut payload = vec![7; length];
            if let Some(byte) = zero.and_then(|at| payload.get_mut(at)) {
                *byte = 0;
            }
            property::check(&payload);
        }
    }
}

/// The property includes that no frame is longer: buffers of this size suffice for every payload.
#[test]
fn some_payload_of_every_length_makes_the_longest_frame() {
    for length in 1..=LONGEST {
        let mut payloads = (1..=255).map(|first| [&[first][..], &vec![7; length - 1]].concat());
        assert!(payloads.any(|payload| frame(&payload).len() == link::most_bytes(length)), "{length} bytes");
    }
    assert_eq!(link::most_bytes(250), 256);
    assert_eq!(link::most_bytes(251), 258);
}

#[test]
fn an_empty_last_block_after_a_full_one_is_taken() {
    let length = 250;
    let payload =
        (1..=255).map(|byte| vec![byte; length]).find(|payload| !with_crc(payload).contains(&0)).unwrap();
    let mut bytes = frame(&payload);
    assert_eq!((bytes.len(), bytes[0]), (256, 255));
    bytes.insert(255, 1);
    assert_eq!(receive(&mut Receiver::new(), &bytes), [Ok(payload)]);
}

#[test]
fn zeros_before_and_between_frames_are_nothing() {
    let mut receiver = Receiver::new();
    let line = [&[0, 0, 0][..], &frame(b"one"), &[0, 0], &frame(b"two"), &[0]].concat();
    assert_eq!(receive(&mut receiver, &line), [Ok(b"one".to_vec()), Ok(b"two".to_vec())]);
    assert_eq!(receiver.counters(), Counters { good: 2, ..Counters::ZERO });
}

#[test]
fn every_reason_is_given_and_counted() {
    let mut receiver = Receiver::new();
    let mut bad_crc = frame(b"message");
    bad_crc[3] ^= 0x10;
    let cases = [
        (FrameError::TooShort, vec![4, 1, 2, 3, 0]),
        (FrameError::TooShort, vec![1, 0]),
        (FrameError::TooLong, [vec![1; CAPACITY + 2], vec![0]].concat()),
        (FrameError::TooLong, [vec![255; 100_000], vec![0]].concat()),
        (FrameError::BadCode, vec![5, 1, 2, 3, 0]),
        (FrameError::BadCrc, bad_crc),
    ];
    for (reason, bytes) in &cases {
        let before = receiver.counters();
        assert_eq!(receive(&mut receiver, bytes), [Err(*reason)], "{bytes:?}");
        assert_eq!(receiver.counters().refused_as(*reason), before.refused_as(*reason) + 1);
        assert_eq!(receiver.counters().refused(), before.refused() + 1);
        assert_eq!(receive(&mut receiver, &frame(b"next")), [Ok(b"next".to_vec())], "after {reason}");
    }
    assert_eq!(receiver.counters().good, cases.len() as u32);
}

/// The longest payload that is taken, and one byte more.
#[test]
fn the_limit_is_exact() {
    for byte in [0, 7] {
        assert_eq!(receive(&mut Receiver::new(), &frame(&[byte; LONGEST])), [Ok(vec![byte; LONGEST])]);
        let longer = stuff(&with_crc(&[byte; LONGEST + 1]));
        assert_eq!(receive(&mut Receiver::new(), &longer), [Err(FrameError::TooLong)]);
    }
}

/// Switched on at any byte of a frame, the receiver loses that frame and no other.
#[test]
fn a_receiver_that_wakes_up_in_a_frame_loses_only_that_one() {
    let payloads: Vec<Vec<u8>> = [5_u8, 60, 249, 250, 251, 252, 253, 254]
        .iter()
        .flat_map(|length| [vec![0; usize::from(*length)], (1..=*length).collect()])
        .collect();
    for (first, next) in payloads.iter().zip(payloads.iter().cycle().skip(1)) {
        let first_frame = frame(first);
        for at in 0..=first_frame.len() {
            let line = [&first_frame[at..], &frame(next), &frame(first)].concat();
            let received = receive(&mut Receiver::new(), &line);
            let good: Vec<_> = received.into_iter().filter_map(Result::ok).collect();
            let all = [first.clone(), next.clone(), first.clone()];
            assert_eq!(good, all[usize::from(at > 0)..], "woke up at byte {at}");
        }
    }
}

#[test]
fn a_message_that_fits_nowhere_is_refused() {
    let buffer_too_small = Err(BufferTooSmall);
    assert_eq!(link::encode(&Raw(&[]), &mut []), buffer_too_small);
    assert_eq!(link::encode(&Raw(&[7; LONGEST + 1]), &mut [0; 100]), buffer_too_small);
}

/// Stretches as a line brings them: runs of one byte, blocks, whole frames, noise.
fn lines() -> impl Strategy<Value = Vec<u8>> {
    let runs = (prop_oneof![Just(0), Just(1), Just(255), any::<u8>()], 0..600_usize)
        .prop_map(|(byte, length)| vec![byte; length]);
    let noise = proptest::collection::vec(any::<u8>(), 0..40);
    let many_zeros = proptest::collection::vec(prop_oneof![3 => Just(0), 1 => any::<u8>()], 0..300);
    let no_zeros = proptest::collection::vec(1..=255_u8, 245..265);
    let frames = proptest::collection::vec(any::<u8>(), 0..60).prop_map(|payload| frame(&payload));
    proptest::collection::vec(prop_oneof![runs, noise, many_zeros, no_zeros, frames], 0..5)
        .prop_map(|stretches| stretches.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(debug_assertions) { 500 } else { 10_000 }))]

    /// The fuzzer's property, for a bounded number of inputs.
    #[test]
    fn what_the_fuzzer_checks_holds(bytes in lines()) {
        property::check(&bytes);
    }
}
