//! The board from its start on: clock, cause of the reset and brown-out level, then what its parts need.

use super::dma::{Receiving, Sending};
use super::flash::{Flash, Mapped};
use super::serial::{self, Interrupt, Line, LinePins};
use super::wiring::{self, Buses, HandJoints, JointPins};
use super::{clock, reset, supply};
use crate::boards::{Board, Found, Parts};
use crate::{crash, schedule};
use blindgrasp_shared::identity::{BrownOut, Clock};
use stm32f4xx_hal::pac::{DBGMCU, DMA1, EXTI, IWDG, PWR, Peripherals, SPI1, SPI2, USART2};
use stm32f4xx_hal::rcc::Rcc;

/// The board with an STM32F405RG.
pub struct Stm32f405 {
    found: Found,
    rcc: Rcc,
    debug: DBGMCU,
    /// Not in QEMU, which has no controller for it.
    flash: Option<Flash<Mapped>>,
    line_pins: LinePins,
    usart: USART2,
    dma: DMA1,
    joint_pins: JointPins,
    spi1: SPI1,
    spi2: SPI2,
    power: PWR,
    lines: EXTI,
    watchdog: IWDG,
}

/// The parts that serve the interrupts of the line.
pub struct Interrupts {
    /// `USART2`.
    pub line: Interrupt,
    /// `DMA1_STREAM5`, on hardware.
    pub receiving: Option<Receiving>,
    /// `DMA1_STREAM6`, on hardware.
    pub sending: Option<Sending>,
}

impl Stm32f405 {
    /// Finds out why there was a reset, starts the clock, and makes the pins outputs, with the amplifiers off.
    pub fn new(device: Peripherals) -> Self {
        let (rcc, debug, flash) = (device.RCC, device.DBGMCU, device.FLASH);
        let reset = reset::cause(rcc.csr().read().bits());
        // The flags add up over resets until they are cleared.
        rcc.csr().modify(|_, w| w.rmvf().clear());
        // Logs stay readable while the processor sleeps, and the watchdog waits while it is halted.
        debug.cr().modify(|_, w| w.dbg_sleep().set_bit());
        let (mut rcc, clock) = clock::start(rcc, clock::is_emulated(&debug));
        let brown_out = match clock {
            Clock::Emulated => BrownOut::Unknown,
            Clock::External | Clock::Fallback => reset::brown_out(flash.optcr().read().bits()),
        };
        let found = Found { clock, reset, crash: crash::take(), brown_out };
        let (line_pins, joint_pins) = wiring::pins(device.GPIOA, device.GPIOB, device.GPIOC, &mut rcc);
        Self {
            found,
            rcc,
            debug,
            flash: (!found.is_emulated()).then(|| Flash::new(Mapped(flash))),
            line_pins,
            usart: device.USART2,
            dma: device.DMA1,
            joint_pins,
            spi1: device.SPI1,
            spi2: device.SPI2,
            power: device.PWR,
            lines: device.EXTI,
            watchdog: device.IWDG,
        }
    }
}

const LINE: &str = "the board's baud rate can be had from its clock";

impl Board for Stm32f405 {
    type Joints = HandJoints;
    type Line = Line;
    type Interrupts = Interrupts;
    type Flash = Flash<Mapped>;
    type Watchdog = wiring::Watchdog;
    type Memory = Buses;

    const CLOCK_HZ: u32 = wiring::SYSTEM_CLOCK.raw();
    const EMULATED_HZ: u32 = wiring::EMULATED_HZ;

    fn found(&self) -> &Found {
        &self.found
    }

    fn take_flash(&mut self) -> Option<Flash<Mapped>> {
        self.flash.take()
    }

    fn start(mut self, buses: &'static mut Buses) -> Parts<Self> {
        supply::start(&self.power, &self.lines, &self.rcc);
        let is_real = !self.found.is_emulated();
        let joints = wiring::joints(self.spi1, self.spi2, self.joint_pins, buses, &mut self.rcc);
        let dma = is_real.then_some(self.dma);
        let (line_interrupt, line, streams) =
            serial::start(self.usart, dma, self.line_pins, &mut self.rcc).expect(LINE);
        let (receiving, sending) = streams.unzip();
        let interrupts = Interrupts { line: line_interrupt, receiving, sending };
        let watchdog = is_real.then(|| wiring::watchdog(self.watchdog, &self.debug));
        Parts { joints, line, interrupts, watchdog }
    }

    /// Nothing keeps a line waiting whose user waits for it, so it needs no DMA.
    fn start_line(mut self) -> (Interrupts, Line) {
        let (line_interrupt, line, _) =
            serial::start(self.usart, None, self.line_pins, &mut self.rcc).expect(LINE);
        (Interrupts { line: line_interrupt, receiving: None, sending: None }, line)
    }

    fn feed(watchdog: &mut Self::Watchdog) {
        watchdog.feed();
    }

    fn amplifiers_off() {
        wiring::amplifiers_off();
    }

    fn supply_is_low() -> bool {
        supply::is_low()
    }

    fn take_supply_low() -> bool {
        supply::take()
    }

    fn line_errors() -> (u32, u32) {
        serial::errors()
    }

    fn cycle_count() -> u32 {
        schedule::cycle_count()
    }

    fn is_late() -> bool {
        schedule::is_pending()
    }
}
