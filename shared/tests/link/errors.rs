//! The promises of the CRC, by exhaustion: errors of few bits, and bursts.

use super::property::{CAPACITY, checksum, crc32, frame, receive, stuff, unstuff, with_crc};
use super::random::Random;
use blindgrasp_shared::link::{FrameError, Receiver};
use std::collections::HashSet;

/// Every error of up to 4 bits in payloads of up to 256 bytes and their CRC is found.
///
/// The CRC is linear: an error is found if its syndrome, the change of the CRC that it makes, is not 0, and the syndrome
/// of several bits is the exclusive or of theirs. If the syndromes of all errors of one and two bits differ from each
/// other and from 0, then no one to four bits have the syndrome 0. Shorter payloads have a part of these syndromes.
#[test]
fn errors_of_up_to_4_bits_are_found() {
    let payload_bytes = 256;
    let intact = checksum(&vec![0; payload_bytes]);
    let mut syndromes: Vec<u32> = (0..32).map(|bit| 1 << bit).collect();
    for bit in 0..8 * payload_bytes {
        let mut payload = vec![0; payload_bytes];
        payload[bit / 8] = 1 << (bit % 8);
        syndromes.push(checksum(&payload) ^ intact);
    }
    let bits = syndromes.len();
    for one in 0..bits {
        for other in 0..one {
            syndromes.push(syndromes[one] ^ syndromes[other]);
        }
    }
    let errors = syndromes.len();
    syndromes.push(0);
    syndromes.sort_unstable();
    syndromes.dedup();
    assert_eq!(syndromes.len(), errors + 1);
    println!("{bits} bits of payload and CRC: {errors} errors of 1 or 2 bits, all with their own syndrome");
}

/// The receiver has the CRC which the other tests reason about: short errors in payload and CRC, before stuffing.
#[test]
fn short_bursts_before_stuffing_are_found() {
    let mut random = Random::new(1);
    let cases = if cfg!(debug_assertions) { 10_000 } else { 300_000 };
    for _ in 0..cases {
        let length = random.between(0, 100);
        let mut bytes = with_crc(&random.payload(length));
        let start = random.below(8 * bytes.len());
        let pattern = random.next() as u32 | 1;
        for bit in (0..32).filter(|bit| pattern >> bit & 1 == 1) {
            if let Some(byte) = bytes.get_mut((start + bit) / 8) {
                *byte ^= 1 << ((start + bit) % 8);
            }
        }
        assert_eq!(receive(&mut Receiver::<CAPACITY>::new(), &stuff(&bytes)), [Err(FrameError::BadCrc)]);
    }
}

/// On the wire a flip can hit a code byte or the 0x00, about which the CRC promises nothing. So all flips of 1 and 2 bits
/// in a frame of each kind, all of 3 bits in a short one, and all bursts of up to 12 bits are tried.
#[test]
fn flips_on_the_wire_are_found() {
    let numbers: Vec<u8> = (1..=24).collect();
    let with_zeros: Vec<u8> = (0..24).map(|n| n % 3 * 5).collect();
    // Fewer where nothing is optimised.
    let (burst_bits, too_long_for_3) = if cfg!(debug_assertions) { (6, 0) } else { (12, 20) };
    let (mut tried, mut reasons) = (0, HashSet::new());
    for payload in [&numbers[..], &with_zeros, &[0; 24], &numbers[..7], &[0; 7]] {
        let intact = frame(payload);
        let flips_of_3 = intact.len() < too_long_for_3;
        let next = b"next";
        let mut try_flips = |flips: &[usize]| {
            let mut bytes = intact.clone();
            flips.iter().for_each(|bit| bytes[bit / 8] ^= 1 << (bit % 8));
            bytes.extend([&[0], &frame(next)[..]].concat());
            let mut received = receive(&mut Receiver::new(), &bytes);
            assert_eq!(received.pop(), Some(Ok(next.to_vec())));
            for frame in received {
                let reason = frame.expect_err("no damaged frame is accepted");
                reasons.insert(reason.to_string());
            }
            tried += 1;
        };
        let bits = 8 * intact.len();
        for first in 0..bits {
            try_flips(&[first]);
            for second in first + 1..bits {
                try_flips(&[first, second]);
                for third in (second + 1..bits).filter(|_| flips_of_3) {
                    try_flips(&[first, second, third]);
                }
            }
            for pattern in 0_usize..1 << (burst_bits - 1) {
                let others =
                    (0..burst_bits - 1).filter(|bit| pattern >> bit & 1 == 1).map(|bit| first + 1 + bit);
                let flips: Vec<usize> = [first].into_iter().chain(others).collect();
                if flips.len() > 2 && flips.iter().all(|bit| *bit < bits) {
                    try_flips(&flips);
                }
            }
        }
    }
    println!("{tried} errors of few bits on the wire, none accepted");
    assert_eq!(reasons.len(), 3, "too short, code and CRC");
}

/// Damage to payloads that begin with zeros which a plain CRC-32 cannot see, whatever the rest of them.
#[test]
fn damage_at_the_start_is_found_because_of_the_lead() {
    // COBS, with the plain CRC.
    let plain = |payload: &[u8]| stuff(&[payload, &crc32(payload).to_le_bytes()].concat());
    let plain_accepts = |stuffed: &[u8]| {
        let (bytes, cut_short) = unstuff(&stuffed[..stuffed.len() - 1]);
        let (payload, crc) = bytes.split_last_chunk().expect("it is longer than a CRC");
        !cut_short && crc32(payload).to_le_bytes() == *crc
    };
    let mut random = Random::new(2);
    for _ in 0..1_000 {
        let length = random.between(1, 60);
        let first = random.payload(length);
        let rest = random.payload(length);
        let zeros = [&[0; 5], &rest[..]].concat();
        let ones_and_zeros = [&[0xff; 4][..], &[0; 5], &rest].concat();
        let damaged = |encode: &dyn Fn(&[u8]) -> Vec<u8>| {
            let bytes = encode(&zeros);
            let cut = [&bytes[..5], &[0]].concat();
            let without_its_end =
                encode(&first).split_last().map(|(_, rest)| rest.to_vec()).unwrap_or_default();
            let run_together = [&without_its_end, &bytes[5..]].concat();
            let mut shorter = encode(&ones_and_zeros);
            shorter.remove(6);
            [
                ("a flipped bit cuts five zeros off", cut),
                ("the end of a frame and five bytes are lost", run_together),
                ("a zero after four times ff is lost", shorter),
            ]
        };
        for (damage, bytes) in damaged(&plain) {
            assert!(plain_accepts(&bytes), "{damage}");
        }
        for (damage, bytes) in damaged(&frame) {
            let received = receive(&mut Receiver::new(), &bytes);
            assert!(received.len() == 1 && received[0].is_err(), "{damage}: {received:02x?}");
        }
    }
}
