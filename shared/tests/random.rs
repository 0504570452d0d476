//! Numbers from a seed, the same on every machine and in every run.

/// SplitMix64 (Steele, Lea, Flood, *Fast splittable pseudorandom number generators*, OOPSLA 2014).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below another.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        ((u128::from(self.next()) * end as u128) >> 64) as usize
    }

    /// A number from one to another, both included.
    pub(crate) fn between(&mut self, least: usize, most: usize) -> usize {
        least + self.below(most - least + 1)
    }

    pub(crate) fn byte(&mut self) -> u8 {
        self.next() as u8
    }

    pub(crate) fn bytes(&mut self, length: usize) -> Vec<u8> {
        (0..length).map(|_| self.byte()).collect()
    }

    /// Bytes of the kinds that are hard for COBS: with many zeros, with none, with long runs of the same.
    pub(crate) fn payload(&mut self, length: usize) -> Vec<u8> {
        match self.below(4) {
            0 => self.bytes(length),
            1 => (0..length).map(|_| if self.below(2) == 0 { 0 } else { self.byte() }).collect(),
            2 => (0..length).map(|_| self.byte().max(1)).collect(),
            _ => {
                let mut payload = Vec::new();
                while payload.len() < length {
                    let byte = if self.below(3) == 0 { 0 } else { self.byte() };
                    payload.resize(payload.len() + self.between(1, 40), byte);
                }
                payload.truncate(length);
                payload
            }
        }
    }
}
