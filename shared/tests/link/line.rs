//! Damage to frames on their way. Tests of the firmware in QEMU include this file, too.

use super::random::Random;

/// A kind of damage to frames. Each makes a stretch of bytes of one or two frames.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Damage {
    Noise,
    Truncated,
    Beheaded,
    FlippedBits,
    Burst,
    Spliced,
    RepeatedBytes,
    LostBytes,
    AddedByte,
    SwappedBytes,
    LostEnd,
    AddedZero,
}

impl Damage {
    pub(crate) const ALL: [Self; 12] = [
        Self::Noise,
        Self::Truncated,
        Self::Beheaded,
        Self::FlippedBits,
        Self::Burst,
        Self::Spliced,
        Self::RepeatedBytes,
        Self::LostBytes,
        Self::AddedByte,
        Self::SwappedBytes,
        Self::LostEnd,
        Self::AddedZero,
    ];

    /// Returns the bytes that a frame becomes; `other` is a second one. It may happen that nothing does.
    pub(crate) fn of(self, random: &mut Random, intact: &[u8], other: &[u8]) -> Vec<u8> {
        let mut bytes = intact.to_vec();
        let at = random.below(bytes.len());
        match self {
            Self::Noise => {
                let length = random.between(1, 2 * intact.len());
                bytes = random.bytes(length);
            }
            Self::Truncated => bytes.truncate(at),
            Self::Beheaded => drop(bytes.drain(..at)),
            Self::FlippedBits => {
                for _ in 0..random.between(1, 8) {
                    let bit = random.below(8 * bytes.len());
                    bytes[bit / 8] ^= 1 << (bit % 8);
                }
            }
            Self::Burst => {
                let start = random.below(8 * bytes.len());
                let pattern = random.next() as u32 | 1;
                for bit in (0..32).filter(|bit| pattern >> bit & 1 == 1) {
                    if let Some(byte) = bytes.get_mut((start + bit) / 8) {
                        *byte ^= 1 << ((start + bit) % 8);
                    }
                }
            }
            Self::Spliced => {
                bytes.truncate(at);
                bytes.extend(&other[random.below(other.len())..]);
            }
            Self::RepeatedBytes => {
                let end = random.between(at + 1, bytes.len().min(at + 8));
                let repeated = bytes[at..end].to_vec();
                bytes.splice(at..at, repeated);
            }
            Self::LostBytes => drop(bytes.drain(at..random.between(at + 1, bytes.len().min(at + 8)))),
            Self::AddedByte => bytes.insert(at, random.byte()),
            Self::SwappedBytes => {
                let with = random.below(bytes.len());
                bytes.swap(at, with);
            }
            Self::LostEnd => {
                bytes.pop();
                bytes.extend(other);
            }
            Self::AddedZero => bytes.insert(at, 0),
        }
        bytes
    }
}
