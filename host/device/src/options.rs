//! Option bytes of an STM32F4: the brown-out level, beside the read protection that must not be touched.
//!
//! A mistake here can lock a chip for good (read protection of level 2 can't be undone). So a new level changes two bits of
//! what was read and nothing else, is refused on a chip with any read protection, and is read back from the flash itself.

use std::error::Error;
use std::fmt;

/// Level of the brown-out reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Level {
    /// None: the supply may sag to 1.8 V
    Off,
    /// Reset below 2.13 to 2.24 V
    #[cfg_attr(feature = "clap", value(name = "1"))]
    One,
    /// Reset below 2.44 to 2.56 V
    #[cfg_attr(feature = "clap", value(name = "2"))]
    Two,
    /// Reset below 2.75 to 2.88 V
    #[cfg_attr(feature = "clap", value(name = "3"))]
    Three,
}

impl Level {
    /// `BOR_LEV`, two bits.
    const fn bits(self) -> u32 {
        match self {
            Self::Three => 0b00,
            Self::Two => 0b01,
            Self::One => 0b10,
            Self::Off => 0b11,
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Off => "off",
            Self::One => "level 1",
            Self::Two => "level 2",
            Self::Three => "level 3",
        })
    }
}

/// The register `FLASH_OPTCR` (RM0090, flash option control register): the options that act, and two bits that write them.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Options(u32);

/// `OPTLOCK`: the register can't be written.
const LOCK: u32 = 1;
/// `OPTSTRT`: what is in the register is written to the flash.
const START: u32 = 1 << 1;
const BROWN_OUT_AT: u32 = 2;
const PROTECTION_AT: u32 = 8;
const UNPROTECTED: u8 = 0xAA;

impl Options {
    /// Of what was read from the register.
    pub const fn of_register(word: u32) -> Self {
        Self(word & !(LOCK | START))
    }

    /// Level of the brown-out reset.
    pub fn brown_out(self) -> Level {
        match self.0 >> BROWN_OUT_AT & 0b11 {
            0b00 => Level::Three,
            0b01 => Level::Two,
            0b10 => Level::One,
            _ => Level::Off,
        }
    }

    /// The same with another level.
    #[must_use]
    pub const fn with_brown_out(self, level: Level) -> Self {
        Self(self.0 & !(0b11 << BROWN_OUT_AT) | level.bits() << BROWN_OUT_AT)
    }

    /// The byte `RDP`.
    pub const fn protection(self) -> u8 {
        (self.0 >> PROTECTION_AT) as u8
    }

    /// Returns `true` if two words of the flash hold these options: the one of `RDP` and the user's byte, whose bits 0,
    /// 1 and 4 mean nothing, and the one of the write protection of twelve sectors.
    fn are_in(self, user: u32, sectors: u32) -> bool {
        const USER: u32 = 0xFFEC;
        const SECTORS: u32 = 0x0FFF;
        user & USER == self.0 & USER && sectors & SECTORS == self.0 >> 16 & SECTORS
    }
}

impl fmt::Debug for Options {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#010x}", self.0)
    }
}

/// A halted chip, whose words can be read and written.
pub trait Words {
    /// The error of a failure.
    type Error: Error + 'static;

    /// Reads a word.
    ///
    /// # Errors
    /// The chip does not answer.
    fn read(&mut self, address: u64) -> Result<u32, Self::Error>;

    /// Writes a word.
    ///
    /// # Errors
    /// The chip does not answer.
    fn write(&mut self, address: u64, word: u32) -> Result<(), Self::Error>;
}

/// The reason for which the level was not set.
#[derive(Debug, thiserror::Error)]
pub enum OptionsError<E: Error + 'static> {
    /// The chip is protected.
    #[error(
        "the chip is read-protected (RDP is {0:#04x}, not 0xaa): its option bytes are left as they are, for a mistake there \
        can lock it for good; nothing was changed"
    )]
    Protected(u8),
    /// The flash does not let go.
    #[error("the chip's flash stays busy: switch the board off and on, and try again; nothing was changed")]
    Busy,
    /// The option register stays locked.
    #[error(
        "the chip's option bytes can't be unlocked: switch the board off and on, and try again; nothing was changed"
    )]
    Locked,
    /// The writing does not end.
    #[error(
        "writing the option bytes does not end: check the supply, switch the board off and on, and set the level again"
    )]
    NotDone,
    /// The flash holds something else.
    #[error(
        "the option bytes read {user:#06x} and {sectors:#06x} where {wanted:?} was written: check the supply, switch the board \
        off and on, and set the level again"
    )]
    Differs {
        /// The options that were written.
        wanted: Options,
        /// The option bytes of the flash: read protection and user's byte.
        user: u32,
        /// The option bytes of the flash: write protection.
        sectors: u32,
    },
    /// The connection broke.
    #[error("the chip stopped answering while its option bytes were read or written; check the wiring")]
    Lost(#[from] E),
}

// Registers of the flash interface, and where the flash has the option bytes (RM0090, memory map and option bytes).
const OPTION_KEY: u64 = 0x4002_3C08;
const STATUS: u64 = 0x4002_3C0C;
const CONTROL: u64 = 0x4002_3C14;
const USER_BYTES: u64 = 0x1FFF_C000;
const SECTOR_BYTES: u64 = 0x1FFF_C008;

const KEYS: [u32; 2] = [0x0819_2A3B, 0x4C5D_6E7F];
/// `BSY` of the status.
const BUSY: u32 = 1 << 16;
/// Looks at the status, each of which takes a probe 0.1 ms or more; writing takes less than 2 s.
const MOST_LOOKS: u32 = 50_000;

/// The options that act, if the chip is not read-protected.
///
/// # Errors
/// It is, or does not answer.
pub fn unprotected<W: Words>(chip: &mut W) -> Result<Options, OptionsError<W::Error>> {
    let options = Options::of_register(chip.read(CONTROL)?);
    match options.protection() {
        UNPROTECTED => Ok(options),
        protection => Err(OptionsError::Protected(protection)),
    }
}

/// Sets the level of the brown-out reset, and returns the one before. It acts from the next reset.
///
/// # Errors
/// The chip is read-protected, or its flash does not hold the new option bytes afterwards.
pub fn set_brown_out<W: Words>(chip: &mut W, level: Level) -> Result<Level, OptionsError<W::Error>> {
    let before = unprotected(chip)?;
    let wanted = before.with_brown_out(level);
    if wanted != before {
        if !is_idle(chip)? {
            return Err(OptionsError::Busy);
        }
        for key in KEYS {
            chip.write(OPTION_KEY, key)?;
        }
        if chip.read(CONTROL)? & LOCK != 0 {
            return Err(OptionsError::Locked);
        }
        chip.write(CONTROL, wanted.0)?;
        chip.write(CONTROL, wanted.0 | START)?;
        let done = is_idle(chip)?;
        chip.write(CONTROL, wanted.0 | LOCK)?;
        if !done {
            return Err(OptionsError::NotDone);
        }
    }
    let (user, sectors) = (chip.read(USER_BYTES)?, chip.read(SECTOR_BYTES)?);
    if wanted.are_in(user, sectors) {
        Ok(before.brown_out())
    } else {
        Err(OptionsError::Differs { wanted, user: user & 0xFFFF, sectors: sectors & 0xFFFF })
    }
}

fn is_idle<W: Words>(chip: &mut W) -> Result<bool, W::Error> {
    for _ in 0..MOST_LOOKS {
        if chip.read(STATUS)? & BUSY == 0 {
            return Ok(true);
        }
    }
    Ok(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// The flash interface of the reference manual, as far as option bytes go.
    #[derive(Clone, Debug, PartialEq)]
    struct Chip {
        register: u32,
        flash: u32,
        keys: usize,
        /// Looks until the flash is no longer busy.
        busy: u32,
        /// Bits of the flash that can't be written.
        stuck: u32,
        deaf: bool,
        writes: u32,
    }

    impl Chip {
        fn with(options: u32) -> Self {
            let flash = options & !(LOCK | START);
            Self { register: flash | LOCK, flash, keys: 0, busy: 0, stuck: 0, deaf: false, writes: 0 }
        }
    }

    impl Words for Chip {
        type Error = Infallible;

        fn read(&mut self, address: u64) -> Result<u32, Infallible> {
            Ok(match address {
                STATUS if self.busy > 0 => {
                    self.busy -= 1;
                    BUSY
                }
                STATUS => 0,
                CONTROL => self.register,
                // What means nothing reads as ones; above are the complements.
                USER_BYTES => self.flash & 0xFFEC | 0x0013 | !self.flash << 16,
                SECTOR_BYTES => self.flash >> 16 & 0xFFF | 0xF000,
                other => panic!("{other:#x} is read"),
            })
        }

        fn write(&mut self, address: u64, word: u32) -> Result<(), Infallible> {
            self.writes += 1;
            match address {
                OPTION_KEY => {
                    self.keys = if KEYS.get(self.keys) == Some(&word) { self.keys + 1 } else { 0 };
                    if self.keys == 2 && !self.deaf {
                        self.register &= !LOCK;
                    }
                }
                CONTROL => {
                    assert_eq!((self.register & LOCK, self.busy), (0, 0), "written while locked or busy");
                    self.register = word & !START;
                    if word & START != 0 {
                        self.flash = self.flash & self.stuck | self.register & !self.stuck & !LOCK;
                        self.busy = 1000;
                    }
                }
                other => panic!("{other:#x} is written"),
            }
            Ok(())
        }
    }

    /// As from the factory; all sectors but two write-protected; and with bits that no manual explains.
    const CHIPS: [u32; 3] = [0x0FFF_AAED, 0x0003_AAED, 0xFABC_AA1D];
    const LEVELS: [Level; 4] = [Level::Off, Level::One, Level::Two, Level::Three];

    #[test]
    fn a_level_changes_two_bits_and_no_other() {
        for word in CHIPS {
            let options = Options::of_register(word);
            for level in LEVELS {
                let other = options.with_brown_out(level);
                assert_eq!((other.0 ^ options.0) & !0b1100, 0);
                assert_eq!((other.brown_out(), other.protection()), (level, 0xAA));
                assert_eq!(other.with_brown_out(options.brown_out()), options);
            }
        }
    }

    #[test]
    fn every_level_is_set_and_read_back() {
        for word in CHIPS {
            for level in LEVELS {
                let mut chip = Chip::with(word);
                let before = Options::of_register(word);
                assert_eq!(set_brown_out(&mut chip, level).ok(), Some(before.brown_out()));
                assert_eq!(chip.flash, before.with_brown_out(level).0);
                assert_eq!(chip.register, chip.flash | LOCK, "left locked");
                // Once more: there is nothing to do.
                let writes = chip.writes;
                assert_eq!(set_brown_out(&mut chip, level).ok(), Some(level));
                assert_eq!(chip.writes, writes);
            }
        }
    }

    #[test]
    fn a_protected_chip_is_left_alone() {
        for protection in (0..=u8::MAX).filter(|&byte| byte != UNPROTECTED) {
            let mut chip = Chip::with(0x0FFF_00ED | u32::from(protection) << 8);
            let as_it_was = chip.clone();
            let error = set_brown_out(&mut chip, Level::Three).unwrap_err();
            assert!(matches!(error, OptionsError::Protected(found) if found == protection), "{error}");
            assert_eq!(chip, as_it_was);
        }
    }

    #[test]
    fn what_does_not_work_is_told() {
        let set = |mut chip: Chip| set_brown_out(&mut chip, Level::Three).unwrap_err();
        let chip = Chip::with(CHIPS[0]);
        assert!(matches!(set(Chip { deaf: true, ..chip.clone() }), OptionsError::Locked));
        assert!(matches!(set(Chip { busy: u32::MAX, ..chip.clone() }), OptionsError::Busy));
        for stuck in [1 << 2, 1 << 3] {
            let error = set(Chip { stuck, ..chip.clone() });
            assert!(matches!(error, OptionsError::Differs { .. }), "{error}");
        }
        // A bit that changes by itself is found too.
        let mut odd = Chip::with(CHIPS[0]);
        odd.flash ^= 1 << 20;
        odd.stuck = 1 << 20;
        assert!(matches!(set(odd), OptionsError::Differs { .. }));
    }
}
