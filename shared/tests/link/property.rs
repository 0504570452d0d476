//! Properties of the link that hold for any bytes: one function for the bounded tests here and for the fuzzer, which
//! includes this file.
//!
//! The receiver is compared with a second one that is as plain as possible: it has the whole frame, allocates, and
//! computes the CRC bit by bit.

use blindgrasp_shared::bytes::BufferTooSmall;
use blindgrasp_shared::link::{self, Counters, FrameError, Receiver};
use serde::ser::{Serialize, SerializeTuple, Serializer};

/// Bytes of payload and CRC that the receivers of these tests take: more than two full blocks.
pub(crate) const CAPACITY: usize = 600;

/// Bytes of the longest payload.
pub(crate) const LONGEST: usize = CAPACITY - 4;

/// Bytes of the longest frame.
pub(crate) const LONGEST_FRAME: usize = link::most_bytes(LONGEST);

/// A message whose payload is these very bytes.
pub(crate) struct Raw<'a>(pub(crate) &'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

/// The frame of a payload.
pub(crate) fn frame(payload: &[u8]) -> Vec<u8> {
    let mut buffer = [0x55; LONGEST_FRAME];
    link::encode(&Raw(payload), &mut buffer).expect("the payload is not too long").to_vec()
}

/// CRC-32/ISO-HDLC, bit by bit.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 })
    })
}

/// The CRC of a payload.
pub(crate) fn checksum(payload: &[u8]) -> u32 {
    crc32(&[b"blindgrasp", payload].concat())
}

/// Payload and CRC.
pub(crate) fn with_crc(payload: &[u8]) -> Vec<u8> {
    [payload, &checksum(payload).to_le_bytes()].concat()
}

/// COBS, with the 0x00 at the end.
pub(crate) fn stuff(bytes: &[u8]) -> Vec<u8> {
    let mut stuffed = Vec::new();
    let mut runs = bytes.split(|byte| *byte == 0).peekable();
    while let Some(mut run) = runs.next() {
        while run.len() >= 254 {
            stuffed.push(255);
            stuffed.extend(&run[..254]);
            run = &run[254..];
            // The last run may end with a full block; after any other, a block must stand for the zero.
            if run.is_empty() && runs.peek().is_none() {
                stuffed.push(0);
                return stuffed;
            }
        }
        stuffed.push(run.len() as u8 + 1);
        stuffed.extend(run);
    }
    stuffed.push(0);
    stuffed
}

/// Returns the bytes that COBS stands for, without the 0x00, and `true` if the last block is cut short.
pub(crate) fn unstuff(mut stuffed: &[u8]) -> (Vec<u8>, bool) {
    let (mut bytes, mut cut_short) = (Vec::new(), false);
    while let Some((code, rest)) = stuffed.split_first() {
        let most = usize::from(*code) - 1;
        let (block, rest) = rest.split_at(most.min(rest.len()));
        bytes.extend(block);
        cut_short = block.len() < most;
        if *code != 255 && !rest.is_empty() {
            bytes.push(0);
        }
        stuffed = rest;
    }
    (bytes, cut_short)
}

/// Returns the result that a receiver must have for the bytes between two 0x00.
fn judge(stuffed: &[u8]) -> Result<Vec<u8>, FrameError> {
    let (bytes, cut_short) = unstuff(stuffed);
    if bytes.len() > CAPACITY {
        return Err(FrameError::TooLong);
    }
    if cut_short {
        return Err(FrameError::BadCode);
    }
    let (payload, crc) = bytes.split_last_chunk().ok_or(FrameError::TooShort)?;
    if checksum(payload).to_le_bytes() == *crc { Ok(payload.to_vec()) } else { Err(FrameError::BadCrc) }
}

/// Gives bytes to a receiver, and returns what it returned.
pub(crate) fn receive(receiver: &mut Receiver<CAPACITY>, bytes: &[u8]) -> Vec<Result<Vec<u8>, FrameError>> {
    bytes.iter().filter_map(|byte| receiver.push(*byte).map(|frame| frame.map(<[u8]>::to_vec))).collect()
}

/// Checks everything that must hold for a stretch of bytes, as what comes over the line and as what is to be sent.
///
/// # Panics
/// If something does not.
pub(crate) fn check(bytes: &[u8]) {
    any_bytes_are_received_as_the_standard_says(bytes);
    any_payload_arrives(bytes);
}

fn any_bytes_are_received_as_the_standard_says(bytes: &[u8]) {
    // Zeros around them end whatever they leave unfinished.
    let line = [&[0], bytes, &[0, 0]].concat();
    let mut receiver = Receiver::new();
    let received = receive(&mut receiver, &line);
    let expected: Vec<_> =
        line.split(|byte| *byte == 0).filter(|stuffed| !stuffed.is_empty()).map(judge).collect();
    assert_eq!(received, expected);

    let count = |error| received.iter().filter(|frame| frame.as_ref().err() == error).count() as u32;
    let counters = Counters {
        good: count(None),
        too_short: count(Some(&FrameError::TooShort)),
        too_long: count(Some(&FrameError::TooLong)),
        bad_code: count(Some(&FrameError::BadCode)),
        bad_crc: count(Some(&FrameError::BadCrc)),
    };
    assert_eq!(receiver.counters(), counters);

    // Whatever came before, the next good frame arrives.
    let payload = b"next";
    assert_eq!(receive(&mut receiver, &frame(payload)), [Ok(payload.to_vec())]);
    assert_eq!(receiver.counters(), Counters { good: counters.good + 1, ..counters });
}

fn any_payload_arrives(payload: &[u8]) {
    let mut buffer = vec![0x55; link::most_bytes(payload.len())];
    let frame = link::encode(&Raw(payload), &mut buffer).expect("there is room for every frame").to_vec();
    assert_eq!(frame, stuff(&with_crc(payload)));

    let fits = payload.len() <= LONGEST;
    let expected = if fits { Ok(payload.to_vec()) } else { Err(FrameError::TooLong) };
    assert_eq!(receive(&mut Receiver::new(), &frame), [expected]);

    // Exactly as much room as the frame takes is enough, and a byte less is not.
    let mut exact = vec![0x55; frame.len()];
    assert_eq!(link::encode(&Raw(payload), &mut exact), Ok(&frame[..]));
    assert_eq!(link::encode(&Raw(payload), &mut exact[1..]), Err(BufferTooSmall));
}
