//! The quadrature counter LS7366R (LSI/CSI): one for each joint, on a shared SPI bus.
//!
//! Register numbers and bits are those of the data sheet "LS7366R, 32-bit quadrature counter with serial interface".
//! Op-codes and STR: page 3 with Table 1 (7366R-122205-3). MDR0 and MDR1: the registers' bit lists, which follow it.
//!
//! **One read, one instruction.** `RD CNTR` itself copies the running counter to OTR in one step and then shifts OTR
//! out (Table 1), so a count is whole although the joint moves; a `LOAD OTR` before it would add a transaction
//! (a fifth more bus time) and nothing else. DTR has no read instruction (Table 1): what is written to it is seen by
//! `LOAD CNTR` and `RD CNTR`.
//!
//! **Does it answer?** SPI has no acknowledgement: a chip that is missing leaves MISO to its pull resistor, and every
//! bit of a count is possible. So each count is followed by STR, in which a healthy counter has both a one (CEN:
//! counting is enabled) and a zero (PLS: no power loss since PLS was cleared): a line stuck at either level is neither.
//! STR comes after the count, because PLS is a latch: power lost before or during the count is seen.
//!
//! **The zero.** The counter counts on while the microcontroller resets. [`Counter::prepare`] therefore first asks
//! whether this chip is as [`Counter::start`] left it: PLS clear, counting, settings as written. Then it is only read,
//! and count and zero are kept. Otherwise its count means nothing; it is tested, which overwrites the count, and begins
//! at 0 when it is started, wherever the joint is at that moment. PLS is cleared last of all, so that a reset
//! in the middle of the test leaves no chip that looks healthy.
//!
//! **To be confirmed on the first board**, because no chip has run this code yet: the shortest clock period (taken from
//! the sheet's table of transients by way of other drivers), and that CNT_EN left open counts.

use blindgrasp_shared::fault::Fault;
use core::fmt;
use embedded_hal::spi::{ErrorKind, MODE_0, Mode, SpiDevice};

/// Clock idles low; bits are taken at its rising edge (data sheet page 1).
pub const SPI_MODE: Mode = MODE_0;

/// The fastest SPI clock, Hz, at a supply of 3.3 V: 120 ns high and 120 ns low. (100 ns each at 5 V.)
pub const MOST_SCK_HZ: u32 = 4_166_666;

/// Instructions: function in bits 7 and 6, register in bits 5 to 3 (page 3).
mod instruction {
    const CLR: u8 = 0b00 << 6;
    const RD: u8 = 0b01 << 6;
    const WR: u8 = 0b10 << 6;
    const LOAD: u8 = 0b11 << 6;

    const MDR0: u8 = 0b001 << 3;
    const MDR1: u8 = 0b010 << 3;
    const DTR: u8 = 0b011 << 3;
    const CNTR: u8 = 0b100 << 3;
    const STR: u8 = 0b110 << 3;

    pub(super) const READ_MDR0: u8 = RD | MDR0;
    pub(super) const READ_MDR1: u8 = RD | MDR1;
    pub(super) const READ_CNTR: u8 = RD | CNTR;
    pub(super) const READ_STR: u8 = RD | STR;
    pub(super) const WRITE_MDR0: u8 = WR | MDR0;
    pub(super) const WRITE_MDR1: u8 = WR | MDR1;
    pub(super) const WRITE_DTR: u8 = WR | DTR;
    pub(super) const LOAD_CNTR: u8 = LOAD | CNTR;
    pub(super) const CLEAR_MDR1: u8 = CLR | MDR1;
    pub(super) const CLEAR_CNTR: u8 = CLR | CNTR;
    pub(super) const CLEAR_STR: u8 = CLR | STR;
}

/// MDR0 bits 1 and 0: four counts for each quadrature cycle. Bits 3 and 2 clear: free-running. Bits 5 and 4 clear: the
/// index input does nothing.
const MDR0_QUADRATURE_X4: u8 = 0b11;
/// MDR0 bit 7: the filter samples at half the clock of fCKi.
const MDR0_FILTER_HALF: u8 = 1 << 7;
/// MDR1 bits 1 and 0 clear: four bytes. Bit 2 clear: counting. No flags on LFLAG and DFLAG. It is what `CLR MDR1` sets.
const MDR1_COUNTING: u8 = 0;
/// MDR1 bit 2: four bytes, not counting.
const MDR1_STOPPED: u8 = 1 << 2;

/// STR bit 3: counting is enabled.
const STR_CEN: u8 = 1 << 3;
/// STR bit 2: power was lost; set at power-up, cleared by `CLR STR`.
const STR_PLS: u8 = 1 << 2;

/// The words that are written to the counter and read back: a one, then a zero, that walks through every bit, with no
/// two bytes alike, so that a bit that sticks, a byte that is lost and a shift by one clock are all seen.
const PATTERNS: [u32; 4] = [0x0102_0408, 0x1020_4080, 0xFEFD_FBF7, 0xEFDF_BF7F];

/// Clock of the quadrature filter, from the oscillator at fCKi. It has to be at least four times the frequency of
/// encoder channel A at the highest speed; the slower it is, the longer are the glitches that it removes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterClock {
    /// The oscillator's.
    Whole,
    /// Half of it.
    Half,
}

impl FilterClock {
    const fn mdr0(self) -> u8 {
        match self {
            Self::Whole => MDR0_QUADRATURE_X4,
            Self::Half => MDR0_QUADRATURE_X4 | MDR0_FILTER_HALF,
        }
    }
}

/// A counter's knowledge of where the joint is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Zero {
    /// It counted on since it was started: its zero is what it was.
    Kept,
    /// It was without power or settings: it counts from 0 where the joint is when it is started.
    Lost,
}

/// A fault of a counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CounterError {
    /// The microcontroller's SPI failed.
    Bus(ErrorKind),
    /// MISO stayed at one level: the chip is missing, without power or without clock, or the line is cut or shorted.
    Silent {
        /// The level, as a byte: 0x00 or 0xFF.
        level: u8,
    },
    /// A register did not keep what was written: another chip, or noise on the bus.
    NotStored {
        /// The register.
        register: &'static str,
        /// The count that was written.
        written: u32,
        /// The count that was read.
        read: u32,
    },
    /// It answers, but has lost its power since it was started, and the joint's zero with it; or it does not count.
    Reset {
        /// The status register, STR.
        status: u8,
    },
    /// It answers, but a setting is not what it was: what it counted since is wrong.
    Changed {
        /// The register.
        register: &'static str,
        /// The byte that was written.
        written: u8,
        /// The byte that was read.
        read: u8,
    },
}

impl CounterError {
    /// The fault that the supervisor is told.
    pub const fn fault(self) -> Fault {
        match self {
            Self::Bus(_) | Self::Silent { .. } | Self::NotStored { .. } => Fault::SampleMissing,
            Self::Reset { .. } | Self::Changed { .. } => Fault::CounterReset,
        }
    }
}

impl fmt::Display for CounterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(kind) => write!(f, "counter: SPI failed: {kind}"),
            Self::Silent { level } => {
                write!(
                    f,
                    "counter does not answer: MISO stays at {level:#04x}; check supply, select and wiring"
                )
            }
            Self::NotStored { register, written, read } => {
                write!(f, "counter: {register} was written as {written:#x} and reads {read:#x}")
            }
            Self::Reset { status } => {
                write!(f, "counter lost its power: STR reads {status:#04x}; check its supply")
            }
            Self::Changed { register, written, read } => {
                write!(f, "counter: {register} was {written:#04x} and reads {read:#04x}; check its supply")
            }
        }
    }
}

impl core::error::Error for CounterError {}

/// One LS7366R. `SPI` is the bus with this chip's select.
#[derive(Debug)]
pub struct Counter<SPI> {
    spi: SPI,
    mdr0: u8,
}

impl<SPI: SpiDevice> Counter<SPI> {
    /// A counter behind `spi`; nothing is sent yet.
    pub const fn new(spi: SPI, filter: FilterClock) -> Self {
        Self { spi, mdr0: filter.mdr0() }
    }

    /// Gives the bus back.
    pub fn release(self) -> SPI {
        self.spi
    }

    /// Keeps the counter if it is as [`start`](Self::start) left it; otherwise tests it, and leaves it stopped with
    /// `tag` as its count, for [`identify`](Self::identify).
    ///
    /// # Errors
    /// SPI failed, or a register does not keep what is written.
    pub fn prepare(&mut self, tag: u32) -> Result<Zero, CounterError> {
        let settings = [self.register(instruction::READ_MDR0)?, self.register(instruction::READ_MDR1)?];
        if settings == [self.mdr0, MDR1_COUNTING] && healthy(self.status()?).is_ok() {
            return Ok(Zero::Kept);
        }
        self.set_register(instruction::WRITE_MDR1, MDR1_STOPPED)?;
        self.set_register(instruction::WRITE_MDR0, self.mdr0)?;
        match self.register(instruction::READ_MDR1)? {
            level @ (0x00 | 0xFF) => return Err(CounterError::Silent { level }),
            read => stored("MDR1", MDR1_STOPPED.into(), read.into())?,
        }
        stored("MDR0", self.mdr0.into(), self.register(instruction::READ_MDR0)?.into())?;
        for pattern in PATTERNS {
            self.set_count(pattern)?;
            stored("CNTR", pattern, self.count()?)?;
        }
        self.set_count(tag)?;
        Ok(Zero::Lost)
    }

    /// Checks that this is the chip to which [`prepare`](Self::prepare) gave `tag`, and not another that answers to the
    /// same select: to be asked when every counter has got its own.
    ///
    /// # Errors
    /// SPI failed, or the count is another.
    pub fn identify(&mut self, tag: u32) -> Result<(), CounterError> {
        stored("CNTR (another chip has the same select)", tag, self.count()?)
    }

    /// Starts counting from 0, where the joint is now. That it counts, the next [`read`](Self::read) sees.
    ///
    /// # Errors
    /// SPI failed.
    pub fn start(&mut self) -> Result<(), CounterError> {
        self.command(instruction::CLEAR_CNTR)?;
        self.command(instruction::CLEAR_MDR1)?;
        // Last: from here on the chip says that it is healthy.
        self.command(instruction::CLEAR_STR)
    }

    /// The count, from a counter that is known to have answered.
    ///
    /// # Errors
    /// SPI failed, the counter does not answer, or it lost its power or its settings.
    pub fn read(&mut self) -> Result<i32, CounterError> {
        let count = self.count()?;
        healthy(self.status()?)?;
        Ok(count.cast_signed())
    }

    /// Reads the settings back: they can change without loss of power.
    ///
    /// # Errors
    /// SPI failed, or the settings are not those that were written.
    pub fn verify(&mut self) -> Result<(), CounterError> {
        let settings =
            [("MDR0", instruction::READ_MDR0, self.mdr0), ("MDR1", instruction::READ_MDR1, MDR1_COUNTING)];
        for (register, instruction, written) in settings {
            let read = self.register(instruction)?;
            if read != written {
                // A line that went silent since the count was read is no change.
                healthy(self.status()?)?;
                return Err(CounterError::Changed { register, written, read });
            }
        }
        Ok(())
    }

    fn status(&mut self) -> Result<u8, CounterError> {
        self.register(instruction::READ_STR)
    }

    fn count(&mut self) -> Result<u32, CounterError> {
        let mut bytes = [instruction::READ_CNTR, 0, 0, 0, 0];
        self.spi.transfer_in_place(&mut bytes).map_err(bus)?;
        let [_, count @ ..] = bytes;
        Ok(u32::from_be_bytes(count))
    }

    fn set_count(&mut self, count: u32) -> Result<(), CounterError> {
        let [a, b, c, d] = count.to_be_bytes();
        self.spi.write(&[instruction::WRITE_DTR, a, b, c, d]).map_err(bus)?;
        self.command(instruction::LOAD_CNTR)
    }

    fn register(&mut self, read: u8) -> Result<u8, CounterError> {
        let mut bytes = [read, 0];
        self.spi.transfer_in_place(&mut bytes).map_err(bus)?;
        let [_, value] = bytes;
        Ok(value)
    }

    fn set_register(&mut self, write: u8, value: u8) -> Result<(), CounterError> {
        self.spi.write(&[write, value]).map_err(bus)
    }

    fn command(&mut self, instruction: u8) -> Result<(), CounterError> {
        self.spi.write(&[instruction]).map_err(bus)
    }
}

fn bus<E: embedded_hal::spi::Error>(error: E) -> CounterError {
    CounterError::Bus(error.kind())
}

fn stored(register: &'static str, written: u32, read: u32) -> Result<(), CounterError> {
    if written == read { Ok(()) } else { Err(CounterError::NotStored { register, written, read }) }
}

/// Returns the fault that a counter's STR tells, if any.
const fn healthy(status: u8) -> Result<(), CounterError> {
    match status {
        level @ (0x00 | 0xFF) => Err(CounterError::Silent { level }),
        _ if status & (STR_CEN | STR_PLS) == STR_CEN => Ok(()),
        _ => Err(CounterError::Reset { status }),
    }
}
