//! The identity of a firmware and of its start: told on `Hello`, and found in an image before it is flashed.

use crate::bytes::BufferTooSmall;
use core::fmt;
use serde::{Deserialize, Serialize};

/// Units of everything on the wire.
pub const UNITS: &str = "SI: m, rad, s, kg, N, N m; encoder counts";

/// The identity of a firmware image. It is embedded in the image behind [`Self::MAGIC`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Image<'a> {
    /// [`INTERFACE_VERSION`](crate::telemetry::INTERFACE_VERSION) that it speaks. Stays the first field for ever.
    pub interface_version: u16,
    /// `hand`, with real joints, or `pil`, with joints over the link.
    pub kind: &'a str,
    /// Name of the hand.
    pub hand: &'a str,
    /// CRC-32 of the hand's model and default configuration.
    pub hand_hash: u32,
    /// Release.
    pub firmware_version: &'a str,
    /// CRC-32 of the sources that it was built from.
    pub build_hash: u32,
    /// Joints of the hand.
    pub joint_count: u8,
    /// Fingertips of the hand.
    pub fingertip_count: u8,
    /// Time from one tick to the next, us.
    pub period_us: u32,
}

impl<'a> Image<'a> {
    /// The mark before it in the bytes of an image.
    pub const MAGIC: [u8; 16] = *b"BLINDGRASP-IMAGE";

    /// Writes magic and description into a buffer; returns how many bytes they take.
    ///
    /// # Errors
    /// If the buffer is too small.
    pub fn encode(&self, buffer: &mut [u8]) -> Result<usize, BufferTooSmall> {
        let (magic, rest) = buffer.split_at_mut_checked(Self::MAGIC.len()).ok_or(BufferTooSmall)?;
        magic.copy_from_slice(&Self::MAGIC);
        let description = postcard::to_slice(self, rest).map_err(|_| BufferTooSmall)?;
        Ok(Self::MAGIC.len() + description.len())
    }

    /// Reads what [`Self::encode`] wrote.
    pub fn decode(bytes: &'a [u8]) -> Option<Self> {
        let (image, _) = postcard::take_from_bytes(bytes.strip_prefix(&Self::MAGIC)?).ok()?;
        Some(image)
    }

    /// The first description in the bytes of an image.
    pub fn find(bytes: &'a [u8]) -> Option<Self> {
        (0..bytes.len()).find_map(|at| Self::decode(bytes.get(at..)?))
    }
}

impl fmt::Display for Image<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "blindgrasp {} ({:08x}), image `{}` for the hand `{}` ({:08x}): {} joints, {} fingertips, {} us, interface {}",
            self.firmware_version,
            self.build_hash,
            self.kind,
            self.hand,
            self.hand_hash,
            self.joint_count,
            self.fingertip_count,
            self.period_us,
            self.interface_version
        )
    }
}

/// A firmware that runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity<'a> {
    /// The image that was flashed.
    #[serde(borrow)]
    pub image: Image<'a>,
    /// [`UNITS`].
    pub units: &'a str,
    /// The source of its clock.
    pub clock: Clock,
    /// The cause of its start.
    pub reset: ResetCause,
    /// The crash in which it ended before, if it did.
    pub crash: Option<Crash>,
    /// The supply voltage below which the microcontroller is held in reset.
    pub brown_out: BrownOut,
    /// Frequency of the processor's clock, in which a record's cycles are counted, Hz; 0 where nothing counts them.
    pub clock_hz: u32,
    /// The fastest that its line can be, bits a second; 0 where it has none.
    pub most_baud: u32,
    /// The parameters that differ from the hand's file: a bit for each, by its
    /// [number](crate::parameters::Parameter::number).
    pub changed: u64,
    /// The result of restoring the saved parameters at the start; `None` where there is nothing to save to.
    pub restored: Option<Restored>,
}

impl<'a> Identity<'a> {
    /// An image that runs, of which nothing else is known.
    pub const fn of(image: Image<'a>, clock: Clock) -> Self {
        Self {
            image,
            units: UNITS,
            clock,
            reset: ResetCause::Unknown,
            crash: None,
            brown_out: BrownOut::Unknown,
            clock_hz: 0,
            most_baud: 0,
            changed: 0,
            restored: None,
        }
    }
}

/// The result of restoring the saved parameters at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restored {
    /// Parameters that were saved.
    pub saved: u16,
    /// Those of them that are not in effect: of another hand, unknown to this firmware, or beyond what its hand's file
    /// allows.
    pub ignored: u16,
}

/// The source of a microcontroller's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Clock {
    /// The crystal.
    External,
    /// The internal oscillator, because the crystal did not start: its time is wrong by a percent or more. The hand
    /// refuses to arm.
    Fallback,
    /// None: it is emulated.
    Emulated,
}

impl Clock {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::External => "crystal",
            Self::Fallback => "internal oscillator (the crystal did not start)",
            Self::Emulated => "emulated",
        }
    }
}

/// The cause of a microcontroller's start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ResetCause {
    /// Its supply came up.
    PowerOn,
    /// Its supply sagged.
    BrownOut,
    /// The reset pin, or a debugger.
    Pin,
    /// Its own firmware, after a crash.
    Software,
    /// The independent watchdog: the control task stood still.
    IndependentWatchdog,
    /// The window watchdog.
    WindowWatchdog,
    /// It woke from a low-power mode.
    LowPower,
    /// It does not say; an emulator does not.
    Unknown,
}

impl ResetCause {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::PowerOn => "power on",
            Self::BrownOut => "brown-out",
            Self::Pin => "reset pin or debugger",
            Self::Software => "software, after a crash",
            Self::IndependentWatchdog => "independent watchdog: the control task stood still",
            Self::WindowWatchdog => "window watchdog",
            Self::LowPower => "low-power wake-up",
            Self::Unknown => "unknown",
        }
    }
}

/// Level of a microcontroller's brown-out reset. It is kept beside the program: a firmware only tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum BrownOut {
    /// The highest.
    Level3,
    /// The middle one.
    Level2,
    /// The lowest.
    Level1,
    /// None: the supply may sag until nothing works.
    Off,
    /// It does not say; an emulator does not.
    Unknown,
}

impl BrownOut {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Level3 => "level 3",
            Self::Level2 => "level 2",
            Self::Level1 => "level 1",
            Self::Off => "off",
            Self::Unknown => "unknown",
        }
    }
}

/// The crash of a firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crash {
    /// Its kind.
    pub kind: CrashKind,
    /// Its place, as an address of the image; 0 if unknown.
    pub program_counter: u32,
    /// The address that called the place; 0 if unknown.
    pub link_register: u32,
    /// Line of the source; 0 if unknown.
    pub line: u32,
    /// CRC-32 of the source's file name; 0 if unknown.
    pub file_hash: u32,
}

/// A kind of crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CrashKind {
    /// A panic.
    Panic,
    /// A hard fault: a bad address, an undefined instruction, a stack that ran over.
    HardFault,
}

impl fmt::Display for Crash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            CrashKind::Panic => "panic",
            CrashKind::HardFault => "hard fault",
        };
        write!(f, "{kind} at {:#010x}, called from {:#010x}", self.program_counter, self.link_register)?;
        if self.line != 0 {
            write!(f, ", line {} of the file with the hash {:08x}", self.line, self.file_hash)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;
    use std::vec;

    const IMAGE: Image<'_> = Image {
        interface_version: 2,
        kind: "hand",
        hand: "three-finger",
        hand_hash: 0x0123_4567,
        firmware_version: "0.1.0",
        build_hash: 0x89ab_cdef,
        joint_count: 12,
        fingertip_count: 3,
        period_us: 1000,
    };

    #[test]
    fn an_image_is_found_among_other_bytes() {
        let mut bytes = vec![0xff; 300];
        assert_eq!(Image::find(&bytes), None);
        // What only begins like one, before it.
        bytes[17..33].copy_from_slice(&Image::MAGIC);
        let length = IMAGE.encode(&mut bytes[101..]).unwrap();
        assert_eq!(Image::find(&bytes), Some(IMAGE));
        assert_eq!(Image::find(&bytes[..101 + length]), Some(IMAGE));
        assert_eq!(Image::find(&bytes[..101 + length - 1]), None);
        assert_eq!(Image::find(&[]), None);
    }

    #[test]
    fn a_small_buffer_is_refused() {
        let length = IMAGE.encode(&mut [0; 200]).unwrap();
        for short in 0..length {
            assert_eq!(IMAGE.encode(&mut vec![0; short]), Err(BufferTooSmall));
        }
    }

    #[test]
    fn images_and_crashes_are_told_in_words() {
        let told = "blindgrasp 0.1.0 (89abcdef), image `hand` for the hand `three-finger` (01234567): \
            12 joints, 3 fingertips, 1000 us, interface 2";
        assert_eq!(IMAGE.to_string(), told);
        let crash = Crash {
            kind: CrashKind::HardFault,
            program_counter: 0x0800_1234,
            link_register: 0x0800_4321,
            line: 0,
            file_hash: 0,
        };
        assert_eq!(crash.to_string(), "hard fault at 0x08001234, called from 0x08004321");
        let panic = Crash { kind: CrashKind::Panic, line: 12, file_hash: 0xa, ..crash };
        assert!(panic.to_string().ends_with(", line 12 of the file with the hash 0000000a"));
    }
}
