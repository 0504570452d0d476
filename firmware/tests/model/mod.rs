//! The chips as their data sheets describe them, register by register, each behind an SPI device that can be cut.
#![allow(dead_code, unreachable_pub, reason = "not every test uses all of it")]

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// Damage to the lines between the microcontroller and a chip.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Line {
    #[default]
    Whole,
    /// MISO stays at this byte; the chip hears all.
    Stuck(u8),
    /// Neither direction works, and MISO stays at this byte.
    Cut(u8),
    /// The microcontroller's SPI reports an error.
    Error,
}

/// A chip: what it answers to the bytes between two edges of its select.
pub trait Chip {
    fn line(&self) -> Line;
    fn frame(&mut self, bytes: &mut [u8]);
}

/// An SPI device that leads to a chip, and counts the bits that it moves and its frames.
pub struct Select<T> {
    pub chip: Rc<RefCell<T>>,
    pub traffic: Rc<RefCell<Traffic>>,
}

impl<T> Select<T> {
    pub fn to(chip: &Rc<RefCell<T>>, traffic: &Rc<RefCell<Traffic>>) -> Self {
        Self { chip: Rc::clone(chip), traffic: Rc::clone(traffic) }
    }
}

pub fn share<T>(value: T) -> Rc<RefCell<T>> {
    Rc::new(RefCell::new(value))
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traffic {
    pub frames: u32,
    pub bits: u32,
}

impl<T> ErrorType for Select<T> {
    type Error = ErrorKind;
}

impl<T: Chip> SpiDevice for Select<T> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let mut chip = self.chip.borrow_mut();
        let [operation] = operations else { panic!("one operation a frame is all that the drivers need") };
        let mut bytes = match operation {
            Operation::Write(bytes) => bytes.to_vec(),
            Operation::TransferInPlace(bytes) => bytes.to_vec(),
            _ => panic!("the drivers only write, or transfer in place"),
        };
        let mut traffic = self.traffic.borrow_mut();
        traffic.frames += 1;
        traffic.bits += 8 * bytes.len() as u32;
        match chip.line() {
            Line::Whole => chip.frame(&mut bytes),
            Line::Stuck(level) => {
                chip.frame(&mut bytes);
                bytes.fill(level);
            }
            Line::Cut(level) => bytes.fill(level),
            Line::Error => return Err(ErrorKind::Overrun),
        }
        if let Operation::TransferInPlace(answer) = operation {
            answer.copy_from_slice(&bytes);
        }
        Ok(())
    }
}

/// LS7366R.
#[derive(Debug, Default)]
pub struct CounterChip {
    pub line: Line,
    pub mdr0: u8,
    pub mdr1: u8,
    pub dtr: u32,
    pub cntr: u32,
    pub otr: u32,
    pub power_lost: bool,
    /// Bits of DTR that are stuck at zero.
    pub dead_bits: u32,
}

impl CounterChip {
    /// As it is after power-up.
    pub fn powered_up() -> Self {
        Self { power_lost: true, ..Self::default() }
    }

    pub fn lose_power(&mut self) {
        *self = Self { line: self.line, ..Self::powered_up() };
    }

    pub fn counting(&self) -> bool {
        self.mdr1 & 0b100 == 0
    }

    /// The encoder turns by this many edges.
    pub fn turn(&mut self, edges: i32) {
        if self.counting() && self.mdr0 & 0b11 == 0b11 {
            self.cntr = self.cntr.wrapping_add_signed(edges);
        }
    }

    fn status(&self) -> u8 {
        let sign = (self.cntr >> 31) as u8;
        u8::from(self.counting()) << 3 | u8::from(self.power_lost) << 2 | 1 << 1 | sign
    }
}

impl Chip for CounterChip {
    fn line(&self) -> Line {
        self.line
    }

    fn frame(&mut self, bytes: &mut [u8]) {
        let (instruction, data) = bytes.split_first_mut().expect("an instruction");
        let word = |data: &[u8]| u32::from_be_bytes(data.try_into().expect("four bytes"));
        match (*instruction >> 6, (*instruction >> 3) & 0b111) {
            // CLR
            (0, 1) => self.mdr0 = 0,
            (0, 2) => self.mdr1 = 0,
            (0, 4) => self.cntr = 0,
            (0, 6) => self.power_lost = false,
            // RD; DTR can't be read.
            (1, 1) => data.fill(self.mdr0),
            (1, 2) => data.fill(self.mdr1),
            (1, 4) => {
                self.otr = self.cntr;
                data.copy_from_slice(&self.otr.to_be_bytes());
            }
            (1, 5) => data.copy_from_slice(&self.otr.to_be_bytes()),
            (1, 6) => {
                let status = self.status();
                data.fill(status);
            }
            (1, _) => data.fill(0xFF),
            // WR
            (2, 1) => self.mdr0 = data[0],
            (2, 2) => self.mdr1 = data[0],
            (2, 3) => self.dtr = word(data) & !self.dead_bits,
            // LOAD
            (3, 4) => self.cntr = self.dtr,
            (3, 5) => self.otr = self.cntr,
            _ => {}
        }
        *instruction = 0xFF;
    }
}

/// AD5754R.
#[derive(Debug, Default)]
pub struct DacChip {
    pub line: Line,
    pub power: u16,
    pub options: u16,
    pub ranges: [u16; 4],
    pub inputs: [u16; 4],
    pub codes: [u16; 4],
    /// Bits of the power control register that report.
    pub alerts: u16,
    /// The highest voltage that an output ever had.
    pub most_v: f32,
    /// The word that the next frame brings.
    pub asked: u16,
}

impl DacChip {
    pub fn lose_power(&mut self) {
        *self = Self { line: self.line, ..Self::default() };
    }

    /// Voltage of an output, V.
    pub fn volts(&self, channel: usize) -> f32 {
        if self.power & 1 << channel == 0 {
            return 0.0;
        }
        let code = self.codes[channel];
        match self.ranges[channel] {
            0b100 => f32::from(code.cast_signed()) * 10.0 / 32768.0,
            _ => f32::from(code) * 5.0 / 65536.0,
        }
    }

    fn register(&mut self, address: u8) -> Option<&mut u16> {
        let channel = usize::from(address & 0b111);
        match address >> 3 & 0b111 {
            0 => self.inputs.get_mut(channel),
            1 => self.ranges.get_mut(channel),
            2 => Some(&mut self.power),
            3 if channel == 1 => Some(&mut self.options),
            _ => None,
        }
    }
}

impl Chip for DacChip {
    fn line(&self) -> Line {
        self.line
    }

    fn frame(&mut self, bytes: &mut [u8]) {
        let [address, high, low] = *bytes else { panic!("frames have 24 bits") };
        let value = u16::from_be_bytes([high, low]);
        let answer = std::mem::take(&mut self.asked).to_be_bytes();
        bytes.copy_from_slice(&[0, answer[0], answer[1]]);
        if address & 0x80 != 0 {
            self.asked = match address & 0x7F {
                // Bits that the data sheet does not define read as ones.
                channel @ 0x00..=0x03 => self.codes[usize::from(channel)],
                range @ 0x08..=0x0B => self.ranges[usize::from(range & 0b11)] | 0xFFF8,
                0x10 => self.power | self.alerts | 0xF800,
                0x19 => self.options | 0xFFF0,
                _ => 0,
            };
            return;
        }
        match address {
            0x04 => self.inputs = [value; 4],
            0x0C => self.ranges = [value; 4],
            0x1D => self.codes = self.inputs,
            _ => {
                if let Some(register) = self.register(address) {
                    *register = value;
                }
            }
        }
        for channel in 0..4 {
            self.most_v = self.most_v.max(self.volts(channel).abs());
        }
    }
}

/// A pin, and whether it can be set.
#[derive(Debug, Default)]
pub struct Pin {
    pub high: Cell<bool>,
    pub broken: Cell<bool>,
}

pub struct PinEnd(pub Rc<Pin>);

impl digital::ErrorType for PinEnd {
    type Error = digital::ErrorKind;
}

impl OutputPin for PinEnd {
    fn set_low(&mut self) -> Result<(), digital::ErrorKind> {
        self.0.high.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), digital::ErrorKind> {
        if self.0.broken.get() {
            return Err(digital::ErrorKind::Other);
        }
        self.0.high.set(true);
        Ok(())
    }
}
