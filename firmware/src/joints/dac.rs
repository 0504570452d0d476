//! The DAC AD5754R (Analog Devices): four 16-bit outputs of -10 V to 10 V, for the torque inputs of four amplifiers.
//!
//! Registers and bits are those of the data sheet "AD5724R/AD5734R/AD5754R, complete, quad, 12-/14-/16-bit, serial
//! input, unipolar/bipolar voltage output DACs", chapter "Registers". Why this chip:
//! - **off is 0 V**: until it is powered up by a register, each output is clamped to ground; it is so after power-up
//!   and after a brown-out, and [`Dac::silence`] brings it back to that;
//! - **every register can be read back**, and one of them says which outputs are on, which carry too much current, and
//!   whether the chip is too hot;
//! - **simultaneous update**: codes wait in input registers until one instruction loads all four.
//!
//! Wiring that the driver relies on: pin BIN/2sCOMP to ground (codes are two's complement, so a register of zeros is
//! 0 V), pins LDAC and CLR high (loading is by instruction), the internal reference on REFIN/REFOUT. SYNC is the chip
//! select. Where several chips share MISO, each SDO has to be released while its SYNC is high.
//!
//! Register numbers, bits and the way of reading were compared with Analog Devices' own driver (no-OS, `ad5754r`).
//! **To be confirmed on the first board**, because no chip has run this code yet: the clock's edges and SDO's delay,
//! that SDO is released, that an output that is off is held at 0 V, and that alerts stay clear while outputs start.
//!
//! The crate `ad57xx` 0.3.0 was not taken: its author could not test reading back, and it assembles the value read from
//! the wrong byte.

use core::fmt;
use embedded_hal::spi::{ErrorKind, MODE_1, Mode, SpiDevice};

/// Clock idles low; the chip takes bits at its falling edge and changes SDO at its rising edge.
pub const SPI_MODE: Mode = MODE_1;

/// The fastest SPI clock, Hz, for writing. Reading back is slower: SDO is valid 40 ns after the rising edge.
pub const MOST_SCK_HZ: u32 = 30_000_000;

/// Outputs of a chip.
pub const CHANNELS: usize = 4;

/// The first byte of a frame: read in bit 7, register in bits 5 to 3, channel or function in bits 2 to 0.
mod address {
    const DAC: u8 = 0b000 << 3;
    const RANGE: u8 = 0b001 << 3;
    const POWER: u8 = 0b010 << 3;
    const CONTROL: u8 = 0b011 << 3;
    const ALL_CHANNELS: u8 = 4;

    pub(super) const READ: u8 = 1 << 7;
    pub(super) const ALL_CODES: u8 = DAC | ALL_CHANNELS;
    pub(super) const ALL_RANGES: u8 = RANGE | ALL_CHANNELS;
    pub(super) const POWER_CONTROL: u8 = POWER;
    pub(super) const NOTHING: u8 = CONTROL;
    pub(super) const OPTIONS: u8 = CONTROL | 1;
    pub(super) const LOAD: u8 = CONTROL | 5;

    pub(super) const fn code(channel: u8) -> u8 {
        DAC | channel
    }

    pub(super) const fn range(channel: u8) -> u8 {
        RANGE | channel
    }
}

/// Output range select register: bits 2 to 0.
const RANGE_BITS: u16 = 0b111;
/// -10 V to 10 V.
const RANGE_BIPOLAR_10_V: u16 = 0b100;

/// Control register: thermal shutdown (3), current clamp (2), clear to 0 V (1 clear), SDO in use (0 clear).
const OPTION_BITS: u16 = 0b1111;
const OPTIONS: u16 = 0b1100;

/// Power control register: outputs A to D in bits 0 to 3, internal reference in bit 4.
const POWER_BITS: u16 = 0b1_1111;
/// Power control register, read only: too hot.
const POWER_TOO_HOT: u16 = 1 << 5;
/// Power control register, read only: too much current at output A; B to D follow.
const POWER_OVERCURRENT_A: u16 = 1 << 7;

/// Codes that are written, loaded and read back while the outputs are off. No output has the code of another.
const PATTERNS: [[i16; CHANNELS]; 2] =
    [[0x5A01, 0x2D02, 0x1604, 0x0B08], [-0x5A02, -0x2D03, -0x1605, -0x0B09]];

/// Codes a volt: 32768 for 10 V.
pub const CODES_PER_VOLT: f32 = 3276.8;

/// A fault of a DAC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DacError {
    /// The microcontroller's SPI failed.
    Bus(ErrorKind),
    /// A register does not keep what was written: no chip, no power, another chip, or noise on the bus.
    NotStored {
        /// The register.
        register: &'static str,
        /// The output, 0 to 3; 0 for a register of the whole chip.
        channel: u8,
        /// The word that was written.
        written: u16,
        /// The word that was read.
        read: u16,
    },
    /// An output carries more than about 20 mA.
    Overcurrent {
        /// The output, 0 to 3.
        channel: u8,
    },
    /// Above 150 degrees Celsius: it switched its outputs off.
    TooHot,
}

impl DacError {
    /// The output that is concerned, 0 to 3; 0 if the whole chip is.
    pub const fn channel(self) -> u8 {
        match self {
            Self::NotStored { channel, .. } | Self::Overcurrent { channel } => channel,
            Self::Bus(_) | Self::TooHot => 0,
        }
    }
}

impl fmt::Display for DacError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(kind) => write!(f, "DAC: SPI failed: {kind}"),
            Self::NotStored { register, channel, written, read } => {
                write!(
                    f,
                    "DAC: {register} of output {channel} was written as {written:#06x} and reads {read:#06x}"
                )
            }
            Self::Overcurrent { channel } => {
                write!(
                    f,
                    "DAC: too much current at output {channel}; check for a short at the amplifier's input"
                )
            }
            Self::TooHot => write!(f, "DAC: too hot; check its supply and what its outputs drive"),
        }
    }
}

impl core::error::Error for DacError {}

/// One AD5754R. `SPI` is the bus with this chip's SYNC as select.
#[derive(Debug)]
pub struct Dac<SPI> {
    spi: SPI,
}

impl<SPI: SpiDevice> Dac<SPI> {
    /// A DAC behind `spi`; nothing is sent yet.
    pub const fn new(spi: SPI) -> Self {
        Self { spi }
    }

    /// Gives the bus back.
    pub fn release(self) -> SPI {
        self.spi
    }

    /// Switches all outputs off: each is clamped to ground.
    ///
    /// # Errors
    /// SPI failed. That the chip has understood is seen only by [`prepare`](Self::prepare).
    pub fn silence(&mut self) -> Result<(), DacError> {
        self.write(address::POWER_CONTROL, 0)
    }

    /// Tests all registers with the outputs off, and leaves them off, with the code of 0 V.
    ///
    /// # Errors
    /// SPI failed, or a register does not keep what is written.
    pub fn prepare(&mut self) -> Result<(), DacError> {
        self.silence()?;
        self.expect("power control", 0, address::POWER_CONTROL, POWER_BITS, 0)?;
        self.write(address::OPTIONS, OPTIONS)?;
        self.expect("control", 0, address::OPTIONS, OPTION_BITS, OPTIONS)?;
        self.write(address::ALL_RANGES, RANGE_BIPOLAR_10_V)?;
        for channel in 0..CHANNELS as u8 {
            self.expect("range", channel, address::range(channel), RANGE_BITS, RANGE_BIPOLAR_10_V)?;
        }
        for codes in PATTERNS {
            for (channel, code) in (0..).zip(codes) {
                self.set_code(channel, code)?;
            }
            self.load()?;
            for (channel, code) in (0..).zip(codes) {
                self.expect_code(channel, code)?;
            }
        }
        self.write(address::ALL_CODES, 0)?;
        self.load()
    }

    /// Switches all outputs on, at 0 V, as [`prepare`](Self::prepare) left them. The first code may be loaded 10 us
    /// later.
    ///
    /// # Errors
    /// SPI failed, or not all outputs are on.
    pub fn start(&mut self) -> Result<(), DacError> {
        self.write(address::POWER_CONTROL, POWER_BITS)?;
        // No more than the bits that were written: alerts may come and go while the outputs start.
        self.expect("power control", 0, address::POWER_CONTROL, POWER_BITS, POWER_BITS)?;
        // All ones could be a line that is stuck; this is all zeros.
        self.expect_code(0, 0)
    }

    /// Writes the code of an output (0 to 3): it waits for [`load`](Self::load).
    ///
    /// # Errors
    /// SPI failed.
    pub fn set_code(&mut self, channel: u8, code: i16) -> Result<(), DacError> {
        self.write(address::code(channel), code.cast_unsigned())
    }

    /// Loads the codes of all outputs at once.
    ///
    /// # Errors
    /// SPI failed.
    pub fn load(&mut self) -> Result<(), DacError> {
        self.write(address::LOAD, 0)
    }

    /// Reads back that all outputs are on, and the code that was last loaded to one of them.
    ///
    /// # Errors
    /// SPI failed, an output is off or carries too much current, the chip is too hot, or the code is another.
    pub fn verify(&mut self, channel: u8, code: i16) -> Result<(), DacError> {
        self.verify_power()?;
        self.expect_code(channel, code)
    }

    fn verify_power(&mut self) -> Result<(), DacError> {
        let power = self.read(address::POWER_CONTROL)?;
        // A line that is stuck at one is no alert.
        if power != u16::MAX && power & POWER_TOO_HOT != 0 {
            return Err(DacError::TooHot);
        }
        if power == u16::MAX || power & POWER_BITS != POWER_BITS {
            let register = "power control";
            return Err(DacError::NotStored { register, channel: 0, written: POWER_BITS, read: power });
        }
        match (0..CHANNELS as u8).find(|channel| power & (POWER_OVERCURRENT_A << channel) != 0) {
            Some(channel) => Err(DacError::Overcurrent { channel }),
            None => Ok(()),
        }
    }

    fn expect_code(&mut self, channel: u8, code: i16) -> Result<(), DacError> {
        self.expect("code", channel, address::code(channel), u16::MAX, code.cast_unsigned())
    }

    /// Reads a register and compares the bits that are defined.
    fn expect(
        &mut self,
        register: &'static str,
        channel: u8,
        from: u8,
        bits: u16,
        written: u16,
    ) -> Result<(), DacError> {
        let read = self.read(from)?;
        if read & bits == written {
            Ok(())
        } else {
            Err(DacError::NotStored { register, channel, written, read })
        }
    }

    fn write(&mut self, to: u8, value: u16) -> Result<(), DacError> {
        let [high, low] = value.to_be_bytes();
        self.spi.write(&[to, high, low]).map_err(bus)
    }

    /// One frame asks, the next one brings the answer.
    fn read(&mut self, from: u8) -> Result<u16, DacError> {
        self.spi.write(&[address::READ | from, 0, 0]).map_err(bus)?;
        let mut bytes = [address::NOTHING, 0, 0];
        self.spi.transfer_in_place(&mut bytes).map_err(bus)?;
        let [_, value @ ..] = bytes;
        Ok(u16::from_be_bytes(value))
    }
}

fn bus<E: embedded_hal::spi::Error>(error: E) -> DacError {
    DacError::Bus(error.kind())
}
