//! Rings of bytes between a line's direct memory access (DMA) and the program: the arithmetic, without a register.
//!
//! ```text
//!  line --transfer--> [ReceiveRing] --Reader--> frames          frames --> [SendRing] --transfer--> line
//!         circular: it never stops                                           a piece at a time, each begun anew
//! ```
//!
//! Nobody waits and nobody locks: each ring has one writer and one reader, which know each other by two counts of bytes,
//! modulo 2^32. A transfer tells where it is by the number of bytes that remain of it, as a DMA's register does.

use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};

/// The position of a circular transfer, as its registers tell it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    /// Bytes to the end of the ring: its length just behind a lap, or 0 just before.
    pub remaining: u16,
    /// The end was passed, and [`ReceiveRing::lap`] was not called for it yet.
    pub lap_pending: bool,
}

/// Bytes that a circular transfer receives. `N` is a power of two.
///
/// The transfer does not know the reader: if that one stays away for a whole lap, bytes are overwritten. The reader then
/// finds out, counts what it lost, and goes on with what comes; that a frame was spoilt, its CRC tells.
#[derive(Debug)]
pub struct ReceiveRing<const N: usize> {
    bytes: [AtomicU8; N],
    laps: AtomicU32,
    lost: AtomicU32,
    /// As [`Position::remaining`], where the program is the one that writes.
    remaining: AtomicU32,
}

impl<const N: usize> ReceiveRing<N> {
    /// Nothing was received.
    pub const fn new() -> Self {
        const { assert!(N.is_power_of_two() && N <= 1 << 15, "counts of bytes wrap; the transfer's has 16 bits") };
        Self {
            bytes: [const { AtomicU8::new(0) }; N],
            laps: AtomicU32::new(0),
            lost: AtomicU32::new(0),
            remaining: AtomicU32::new(N as u32),
        }
    }

    /// The memory that the transfer writes to, again and again from its beginning.
    pub const fn memory(&self) -> &[AtomicU8; N] {
        &self.bytes
    }

    /// Counts a lap: to be called each time that the transfer has come to the end of the memory.
    pub fn lap(&self) {
        self.laps.fetch_add(1, Ordering::Release);
    }

    /// Takes note that the transfer had stopped and begins at the beginning of the memory again. What was not read is lost.
    pub fn restarted(&self) {
        // Further than a reader can follow, wherever in the lap it is.
        self.laps.fetch_add(2, Ordering::Release);
    }

    /// Adds a byte, where there is no transfer.
    pub fn put(&self, byte: u8) {
        let remaining = self.remaining.load(Ordering::Relaxed);
        if let Some(place) = self.bytes.get(N.wrapping_sub(remaining as usize)) {
            place.store(byte, Ordering::Relaxed);
        }
        if remaining > 1 {
            self.remaining.store(remaining - 1, Ordering::Release);
        } else {
            self.remaining.store(N as u32, Ordering::Release);
            self.lap();
        }
    }

    /// The position of the program that [puts](Self::put).
    pub fn position(&self) -> Position {
        Position { remaining: self.remaining.load(Ordering::Acquire) as u16, lap_pending: false }
    }

    /// Bytes that were lost since the start because they were not read in time.
    pub fn lost(&self) -> u32 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Bytes received since the start; `None` in the instant in which a lap is being counted.
    fn received(&self, position: impl FnOnce() -> Position) -> Option<u32> {
        let laps = self.laps.load(Ordering::Acquire);
        let Position { remaining, lap_pending } = position();
        if lap_pending || self.laps.load(Ordering::Acquire) != laps {
            return None;
        }
        Some(laps.wrapping_mul(N as u32).wrapping_add(N as u32).wrapping_sub(remaining.into()))
    }
}

impl<const N: usize> Default for ReceiveRing<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// The reader of a [`ReceiveRing`]: there is one.
#[derive(Debug, Default)]
pub struct Reader {
    /// Bytes that were read or lost.
    read: u32,
    /// Bytes that are known to have come.
    known: u32,
    /// The number of bytes that had been read when that was found out: nothing behind it may be overwritten by the next
    /// look.
    read_then: u32,
}

impl Reader {
    /// Nothing was read.
    pub const fn new() -> Self {
        Self { read: 0, known: 0, read_then: 0 }
    }

    /// Returns the next byte, if one came. The transfer's position is looked at when all that is known was read.
    pub fn next<const N: usize>(
        &mut self,
        ring: &ReceiveRing<N>,
        position: impl FnOnce() -> Position,
    ) -> Option<u8> {
        if self.read == self.known {
            let received = ring.received(position)?;
            if received.wrapping_sub(self.known) > u32::MAX / 2 {
                // The transfer began a lap, and its flag is not up yet.
                return None;
            }
            if received.wrapping_sub(self.read_then) > N as u32 {
                // Those that were read meanwhile may have been others, too.
                ring.lost.fetch_add(received.wrapping_sub(self.read_then), Ordering::Relaxed);
                self.read = received;
            }
            self.known = received;
            self.read_then = self.read;
            if self.read == received {
                return None;
            }
        }
        let byte = ring.bytes.get(self.read as usize % N)?.load(Ordering::Relaxed);
        self.read = self.read.wrapping_add(1);
        Some(byte)
    }

    /// Returns true if no byte waits.
    pub fn is_idle<const N: usize>(
        &self,
        ring: &ReceiveRing<N>,
        position: impl FnOnce() -> Position,
    ) -> bool {
        self.read == self.known && ring.received(position) == Some(self.read)
    }
}

/// Bytes that wait to be sent, a piece at a time. `N` is a power of two.
#[derive(Debug)]
pub struct SendRing<const N: usize> {
    bytes: [AtomicU8; N],
    written: AtomicU32,
    sent: AtomicU32,
}

impl<const N: usize> SendRing<N> {
    /// Nothing waits.
    pub const fn new() -> Self {
        const { assert!(N.is_power_of_two() && N <= 1 << 15, "counts of bytes wrap; the transfer's has 16 bits") };
        Self { bytes: [const { AtomicU8::new(0) }; N], written: AtomicU32::new(0), sent: AtomicU32::new(0) }
    }

    /// Adds as many of the bytes as there is room for, from the first on, and returns how many. For the one writer.
    pub fn write(&self, bytes: &[u8]) -> usize {
        let written = self.written.load(Ordering::Relaxed);
        let waiting = written.wrapping_sub(self.sent.load(Ordering::Acquire)) as usize;
        let count = bytes.len().min(N.saturating_sub(waiting));
        let (begin, end) = self.bytes.split_at_checked(written as usize % N).unwrap_or_default();
        let places = end.iter().chain(begin);
        bytes.iter().take(count).zip(places).for_each(|(&byte, place)| place.store(byte, Ordering::Relaxed));
        self.written.store(written.wrapping_add(count as u32), Ordering::Release);
        count
    }

    /// Returns `true` if every byte was taken away.
    pub fn is_empty(&self) -> bool {
        self.written.load(Ordering::Relaxed) == self.sent.load(Ordering::Acquire)
    }

    /// The bytes that wait, as far as they lie in one piece.
    fn piece(&self) -> &[AtomicU8] {
        let sent = self.sent.load(Ordering::Relaxed);
        let waiting = self.written.load(Ordering::Acquire).wrapping_sub(sent) as usize;
        let rest = self.bytes.get(sent as usize % N..).unwrap_or_default();
        rest.get(..waiting).unwrap_or(rest)
    }
}

impl<const N: usize> Default for SendRing<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// The transfers that take a [`SendRing`]'s bytes away, one after the other: one has this.
#[derive(Debug, Default)]
pub struct Transfers {
    /// Bytes of the transfer that runs.
    length: u16,
}

impl Transfers {
    /// None has begun.
    pub const fn new() -> Self {
        Self { length: 0 }
    }

    /// Takes note of what the last transfer has sent, and returns the piece that the next one is to take, if one waits.
    ///
    /// To be called when a transfer has ended, and when bytes were added while none runs. One that stopped on an error has
    /// sent all but what remains of it, and the next one goes on from there.
    pub fn next<'r, const N: usize>(
        &mut self,
        ring: &'r SendRing<N>,
        remaining: u16,
    ) -> Option<&'r [AtomicU8]> {
        let sent = ring.sent.load(Ordering::Relaxed);
        let count = self.length.saturating_sub(remaining);
        ring.sent.store(sent.wrapping_add(count.into()), Ordering::Release);
        let piece = ring.piece();
        self.length = piece.len() as u16;
        (!piece.is_empty()).then_some(piece)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::VecDeque;
    use std::vec::Vec;

    const N: usize = 16;

    /// The byte at a place of an endless stream.
    fn byte(at: u64) -> u8 {
        (at.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 56) as u8
    }

    /// A circular transfer, whose interrupt may be late.
    struct Circular<'r> {
        ring: &'r ReceiveRing<N>,
        /// Bytes since the start, and those before the transfer last began.
        received: u64,
        began: u64,
        interrupt_pending: bool,
    }

    impl Circular<'_> {
        fn receive(&mut self, count: u64, interrupt_is_prompt: bool) {
            for _ in 0..count {
                let at = (self.received - self.began) as usize % N;
                self.ring.memory()[at].store(byte(self.received), Ordering::Relaxed);
                self.received += 1;
                if at == N - 1 {
                    // One interrupt for two laps would be one too few: it is never a lap late.
                    self.interrupt();
                    self.interrupt_pending = true;
                }
                if interrupt_is_prompt {
                    self.interrupt();
                }
            }
        }

        fn interrupt(&mut self) {
            if core::mem::take(&mut self.interrupt_pending) {
                self.ring.lap();
            }
        }

        /// Right behind a lap, its flag may be late, too.
        fn position(&self, flag_is_late: bool) -> Position {
            let done = (self.received - self.began) % N as u64;
            let lap_pending = self.interrupt_pending && !(flag_is_late && done == 0);
            Position { remaining: (N as u64 - done) as u16, lap_pending }
        }
    }

    impl Circular<'_> {
        /// Bytes that such a position tells of: a lap less while its flag is late, and nothing while it waits to be counted.
        fn seen(&self, flag_is_late: bool) -> Option<u64> {
            match self.position(flag_is_late).lap_pending {
                true => None,
                false if self.interrupt_pending => Some(self.received - N as u64),
                false => Some(self.received),
            }
        }
    }

    #[derive(Clone, Debug)]
    enum Step {
        Receive { count: u64, interrupt_is_prompt: bool },
        Interrupt,
        Read { most: usize, flag_is_late: bool },
        Restart,
    }

    fn steps() -> impl Strategy<Value = Vec<Step>> {
        let step = prop_oneof![
            4 => (0..40_u64, any::<bool>())
                .prop_map(|(count, interrupt_is_prompt)| Step::Receive { count, interrupt_is_prompt }),
            4 => (0..3_u64, any::<bool>())
                .prop_map(|(count, interrupt_is_prompt)| Step::Receive { count, interrupt_is_prompt }),
            2 => Just(Step::Interrupt),
            8 => (0..24_usize, any::<bool>()).prop_map(|(most, flag_is_late)| Step::Read { most, flag_is_late }),
            1 => Just(Step::Restart),
        ];
        proptest::collection::vec(step, 0..200)
    }

    proptest! {
        /// A reader that comes in time gets every byte once and in order. One that does not, knows it at its next look, and
        /// goes on with what comes.
        #[test]
        fn what_is_read_is_what_came_or_its_loss_is_known(steps in steps(), first_laps in any::<u32>()) {
            let ring = ReceiveRing::<N>::new();
            // The counts of bytes wrap, in some runs soon.
            ring.laps.store(first_laps, Ordering::Relaxed);
            let mut transfer = Circular { ring: &ring, received: 0, began: 0, interrupt_pending: false };
            let first = first_laps.wrapping_mul(N as u32);
            let mut reader = Reader { read: first, known: first, read_then: first };
            // Of the stream: where the reader is, where it was when it last looked, and how far it then could read.
            let (mut at, mut at_look, mut known) = (0, 0, 0);
            let mut was_restarted = false;
            for step in steps {
                match step {
                    Step::Receive { count, interrupt_is_prompt } => transfer.receive(count, interrupt_is_prompt),
                    Step::Interrupt => transfer.interrupt(),
                    Step::Restart => {
                        transfer.interrupt();
                        transfer.began = transfer.received;
                        ring.restarted();
                        was_restarted = true;
                    }
                    Step::Read { most, flag_is_late } => for _ in 0..most {
                        let lost_before = ring.lost();
                        let looks = at == known;
                        let read = reader.next(&ring, || transfer.position(flag_is_late));
                        let seen = transfer.seen(flag_is_late).filter(|&seen| seen >= known || was_restarted);
                        let mut overrun = false;
                        if looks {
                            let Some(seen) = seen else {
                                prop_assert_eq!((read, ring.lost()), (None, lost_before));
                                break;
                            };
                            overrun = seen - at_look > N as u64 || was_restarted;
                            if overrun {
                                at = seen;
                                was_restarted = false;
                            }
                            (at_look, known) = (at, seen);
                        }
                        prop_assert_eq!(ring.lost() != lost_before, overrun);
                        prop_assert_eq!(read.is_some(), at < known);
                        let Some(read) = read else { break };
                        // Before anything was overwritten, and it always knows of that afterwards.
                        if transfer.received - at_look <= N as u64 && !was_restarted {
                            prop_assert_eq!(read, byte(at));
                        }
                        at += 1;
                    }
                }
                let waits = at < known || transfer.received != at || transfer.interrupt_pending || was_restarted;
                prop_assert_eq!(reader.is_idle(&ring, || transfer.position(false)), !waits);
            }
        }

        /// The ring is the same when the program puts the bytes into it.
        #[test]
        fn bytes_that_are_put_are_read(pieces in proptest::collection::vec(0..=N, 0..50)) {
            let ring = ReceiveRing::<N>::new();
            let mut reader = Reader::new();
            let mut at = 0;
            for count in pieces {
                (at..at + count as u64).for_each(|at| ring.put(byte(at)));
                for _ in 0..count {
                    prop_assert_eq!(reader.next(&ring, || ring.position()), Some(byte(at)));
                    at += 1;
                }
                prop_assert_eq!(reader.next(&ring, || ring.position()), None);
            }
            prop_assert_eq!(ring.lost(), 0);
        }

        /// Everything that was taken is sent once and in order, in pieces of one stretch of memory, with errors on the way.
        #[test]
        fn what_is_written_is_sent_in_order(
            steps in proptest::collection::vec((0..3_u8, 0..40_usize), 0..300),
            first in any::<u32>(),
        ) {
            let ring = SendRing::<N>::new();
            ring.written.store(first, Ordering::Relaxed);
            ring.sent.store(first, Ordering::Relaxed);
            let mut transfers = Transfers::new();
            // What is not sent yet of the piece that is being sent.
            let mut running = VecDeque::new();
            let mut remaining = 0;
            let (mut written, mut sent) = (0, 0);
            for (step, count) in steps {
                match step {
                    0 => {
                        let bytes: Vec<u8> = (0..count as u64).map(|k| byte(written + k)).collect();
                        let taken = ring.write(&bytes);
                        prop_assert!(taken <= count);
                        // Of the piece that runs, the room comes free at its end.
                        let free = N - (written - sent) as usize - (transfers.length as usize - running.len());
                        prop_assert_eq!(taken, free.min(count), "it takes all that there is room for");
                        written += taken as u64;
                    }
                    1 => for _ in 0..count {
                        let Some(next) = running.pop_front() else { break };
                        prop_assert_eq!(next, byte(sent));
                        sent += 1;
                        remaining -= 1;
                    },
                    // An error.
                    _ if count == 0 => running.clear(),
                    _ => {}
                }
                let waits = written > sent;
                if running.is_empty() && let Some(piece) = transfers.next(&ring, remaining) {
                    remaining = piece.len() as u16;
                    running = piece.iter().map(|byte| byte.load(Ordering::Relaxed)).collect();
                }
                prop_assert!(!waits || !running.is_empty(), "it never stands still while something waits");
            }
        }
    }
}
