//! The wire: what a host and a device say ([`message`]), how messages become frames on a serial line, and frames messages again.
//!
//! ```text
//! message --postcard--> payload --append--> payload ++ CRC-32 --COBS--> bytes without zero --append--> frame
//!                                (low byte first)                                            (0x00)
//! ```
//!
//! A serial line carries bytes, not messages, and now and then it loses, changes or invents some. Three things follow,
//! and each has one answer here:
//!
//! - **Where does a frame end?** At a 0x00, and nowhere else. *Consistent overhead byte stuffing* (Cheshire and Baker,
//!   IEEE/ACM Transactions on Networking 7(2), 1999) takes every zero out of a frame: bytes are cut into blocks, each led
//!   by a **code byte** that counts itself and the bytes up to the next zero, which it stands for. A block with code 255
//!   has 254 bytes and stands for no zero; neither does the last block. A lead byte and an escape byte would be
//!   simpler, but would double the length of the worst frame; this adds a byte for each 254, whatever the bytes are.
//! - **Is it what was sent?** A CRC-32 says so; below is how surely. It is that of Ethernet and zlib with another start of
//!   the register, for the reasons at the head of `checksum.rs`.
//! - **How does a receiver find its feet again?** By the next 0x00, with no timeout, no length field that could be wrong
//!   and no state that could be stuck. Damage costs the frame that it is in, and when it takes a 0x00 away, the frame that
//!   follows; a receiver that is switched on in the middle of a frame loses that one. A 0x00 with nothing before it is
//!   nothing, so that a sender that does not know what is on the line sends one ahead of its first frame.
//!
//! A frame of `n` bytes of payload has at most `n + 4 + ceil((n + 4) / 254) + 1` bytes ([`most_bytes`]): 6 bytes around
//! every payload of up to 250.
//!
//! What the frame does not do: count lost messages, answer, or send again. That is for the messages.
//!
//! # What the CRC promises
//!
//! In payload and CRC, before stuffing, it finds every change of up to 3 bits in 91,607 (of up to 4 in 2,974; Koopman,
//! *32-bit cyclic redundancy codes for Internet applications*, DSN 2002) and every burst of up to 32. A test shows the
//! former for payloads of up to 256 bytes, by exhaustion.
//!
//! On the wire that holds as long as neither a code byte nor a 0x00 is hit or made. One that is, moves the borders of
//! blocks: zeros become data and data zeros, up to the end of the frame. Mostly the last block then does not end where the
//! frame does ([`FrameError::BadCode`]). Otherwise the change is random to the CRC, as are lost and added bytes, frames
//! that have run together, and noise: of such frames one in 2^32 passes. On a line that damages one frame a second in such
//! a way, that is one in 136 years; so what is decoded is checked for its meaning, too.

pub(crate) mod checksum;
mod frame;
mod input;
pub mod message;
pub mod rate;
mod receiver;
pub mod ring;

pub use frame::{encode, most_bytes};
pub use input::InputRecord;
pub use receiver::{Counters, FrameError, Receiver};

/// Returns `true` if a tick may take a request while there is room for so many more answers: what is done is also
/// answered. The last place is a stop's, so that it waits for one at most behind another stop, which has done the same.
pub const fn may_take(is_stop: bool, room: usize) -> bool {
    room > !is_stop as usize
}

/// Ends a frame, and is nowhere inside it.
const END: u8 = 0;

/// Code of a block without a zero after its 254 bytes: the largest code.
const FULL: u8 = 0xff;
