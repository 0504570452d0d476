//! The board: every pin and clock of it, with the arithmetic. The scales of the outputs are the hand's.
//!
//! STM32F405RG in LQFP64. Not to be used: PA13 and PA14 (debugger), PH0 and PH1 (crystal), PB2 (boot), PC14 and PC15
//! (weak pins of the slow crystal).
//!
//! | what | pins |
//! |---|---|
//! | line to the host, USART2 | PA2 out, PA3 in |
//! | counters, SPI1 | PA5 clock, PA6 from, PA7 to the counters |
//! | select counter 0 to 11 | PC0 to PC11 |
//! | select counter 12 to 15 | PC12, PA0, PA1, PA4 |
//! | DACs, SPI2 | PB13 clock, PB14 from, PB15 to the DACs |
//! | select DAC 0 to 3 | PB12, PB11, PB10, PB1 |
//! | enable all amplifiers | PB0, high; a resistor holds it low |
//!
//! Joint `i` of the hand has counter `i`, and output `i mod 4` of DAC `i / 4`. A hand with fewer joints leaves the
//! last selects unconnected. In every reset, also that of the watchdog or after a crash, all pins are inputs: the
//! amplifiers are then off.

#![allow(unsafe_code)]

use super::capacity::MOST_JOINTS;
use super::serial::LinePins;
use crate::joints::dac::{self, CHANNELS};
use crate::joints::ls7366r::{self, FilterClock};
use crate::joints::{BoardJoints, JointsConfig, OutputConfig};
use crate::model::{JOINTS, torques_per_volt_nm_v};
use blindgrasp_shared::link::rate::FIRST_BAUD;
use core::array;
use core::convert::Infallible;
use core::mem::MaybeUninit;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{ErrorType, OutputPin};
use embedded_hal_bus::spi::AtomicDevice;
use embedded_hal_bus::util::AtomicCell;
use stm32f4xx_hal::gpio::{self, Output, PB0, Pin, PinState, PushPull, Speed};
use stm32f4xx_hal::pac::{DBGMCU, GPIOA, GPIOB, GPIOC, IWDG, SPI1, SPI2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::spi::Spi;
use stm32f4xx_hal::time::Hertz;
use stm32f4xx_hal::watchdog::IndependentWatchdog;

/// The crystal.
pub const CRYSTAL: Hertz = Hertz::MHz(8);

/// The system clock: the most that the STM32F405 may have. APB1 gets a quarter of it (42 MHz), APB2 half (84 MHz).
pub const SYSTEM_CLOCK: Hertz = Hertz::MHz(168);

/// Frequency of the processor's timer in QEMU, whatever the clock tree says, Hz.
pub const EMULATED_HZ: u32 = 168_000_000;

/// The line, baud: 42 MHz / 1 Mbaud = 42 sixteenths of 16 samples, without error. A byte takes 10 us, so a millisecond
/// has room for 100 bytes each way.
pub const BAUD: u32 = FIRST_BAUD;

/// The independent watchdog. Its oscillator is between 17 and 47 kHz where 32 are meant (DS8626, LSI oscillator
/// characteristics), so that this is between 7 and 19 ms: some ticks may be late, but a control task that stands
/// still is reset soon.
const WATCHDOG_MS: u32 = 10;

/// The independent watchdog.
pub type Watchdog = IndependentWatchdog;

/// Starts the independent watchdog. It waits while a debugger halts the processor.
pub fn watchdog(watchdog: IWDG, debug: &DBGMCU) -> Watchdog {
    let mut watchdog = IndependentWatchdog::new(watchdog);
    watchdog.stop_on_debug(debug, true);
    watchdog.start(WATCHDOG_MS.millis());
    watchdog
}

/// The counters' clock. The LS7366R takes SCK times of 100 ns high and 100 ns low at 5 V, a little more at 3.3 V; SPI1
/// divides 84 MHz by a power of two: 84 / 32 = 2.625 MHz, 190 ns each. What a tick reads of 12 counters, 704 bits with their
/// status and one of their settings, takes 268 us.
const COUNTER_CLOCK: Hertz = Hertz::kHz(2_625);

/// The DACs' clock: 42 / 8 = 5.25 MHz, 95 ns high. The AD5754R shows a bit up to 40 ns after the rising edge, and it is
/// taken at the falling one: twice the clock would leave 8 ns to the wires. What a tick writes to 12 outputs and reads
/// back, 456 bits, takes 87 us.
const DAC_CLOCK: Hertz = Hertz::kHz(5_250);

/// The counters' oscillator is 20 MHz. Their input filter wants at least 4 times the frequency of an encoder's line. That
/// is 159 kHz at the 1,000 rad/s that the motors can do, with 1,000 lines a turn: half of the oscillator, 10 MHz, is
/// plenty.
const FILTER_CLOCK: FilterClock = FilterClock::Half;

const MOST_DACS: usize = MOST_JOINTS / CHANNELS;
/// DACs that this hand needs.
const DACS: usize = JOINTS.div_ceil(CHANNELS);
// build.rs has said so before, in words.
const _: () = assert!(JOINTS <= MOST_JOINTS, "the hand has more joints than the board has counters for");

type Counter = AtomicDevice<'static, Spi<SPI1>, Select, Wait>;
type Dac = AtomicDevice<'static, Spi<SPI2>, Select, Wait>;

/// The real joints of this hand.
pub type HandJoints = BoardJoints<Counter, Dac, PB0<Output<PushPull>>, JOINTS, DACS>;
/// The bus of the counters.
pub type CounterBus = AtomicCell<Spi<SPI1>>;
/// The bus of the DACs.
pub type DacBus = AtomicCell<Spi<SPI2>>;

/// A chip-select pin of any port. The HAL's pins of unknown number check the number at each use, and that is a panic
/// that the control task could reach.
pub struct Select {
    port: Port,
    pin: u32,
}

enum Port {
    A,
    B,
    C,
}

impl Select {
    /// Takes a pin over: high, with edges that suit a bus of 10 MHz.
    fn new<const P: char, const N: u8>(port: Port, pin: Pin<P, N>) -> Self {
        let mut pin = pin.into_push_pull_output_in_state(PinState::High);
        pin.set_speed(Speed::Medium);
        Self { port, pin: N.into() }
    }

    /// Writes the port's set-and-reset register: bits 0 to 15 set, 16 to 31 reset (RM0090 8.4.7).
    fn write(&mut self, bits: u32) {
        // SAFETY: the registers are always there, and writing this one changes only the pins whose bits are set: the
        // pin that this value took over.
        unsafe {
            match self.port {
                Port::A => (*GPIOA::ptr()).bsrr().write(|w| w.bits(bits)),
                Port::B => (*GPIOB::ptr()).bsrr().write(|w| w.bits(bits)),
                Port::C => (*GPIOC::ptr()).bsrr().write(|w| w.bits(bits)),
            }
        };
    }
}

impl ErrorType for Select {
    type Error = Infallible;
}

impl OutputPin for Select {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.write(1 << 16 << self.pin);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.write(1 << self.pin);
        Ok(())
    }
}

/// The pins of the joints, by what they are for.
pub struct JointPins {
    counter_bus: (gpio::PA5, gpio::PA6, gpio::PA7),
    counters: [Select; MOST_JOINTS],
    dac_bus: (gpio::PB13, gpio::PB14, gpio::PB15),
    dacs: [Select; MOST_DACS],
    enable: PB0<Output<PushPull>>,
}

/// Sorts the pins by what they are for. Selects are high from now on.
pub fn pins(a: GPIOA, b: GPIOB, c: GPIOC, rcc: &mut Rcc) -> (LinePins, JointPins) {
    let (a, b, c) = (a.split(rcc), b.split(rcc), c.split(rcc));
    let line = LinePins { tx: a.pa2, rx: a.pa3 };
    let joints = JointPins {
        counter_bus: (a.pa5, a.pa6, a.pa7),
        counters: [
            Select::new(Port::C, c.pc0),
            Select::new(Port::C, c.pc1),
            Select::new(Port::C, c.pc2),
            Select::new(Port::C, c.pc3),
            Select::new(Port::C, c.pc4),
            Select::new(Port::C, c.pc5),
            Select::new(Port::C, c.pc6),
            Select::new(Port::C, c.pc7),
            Select::new(Port::C, c.pc8),
            Select::new(Port::C, c.pc9),
            Select::new(Port::C, c.pc10),
            Select::new(Port::C, c.pc11),
            Select::new(Port::C, c.pc12),
            Select::new(Port::A, a.pa0),
            Select::new(Port::A, a.pa1),
            Select::new(Port::A, a.pa4),
        ],
        dac_bus: (b.pb13, b.pb14, b.pb15),
        dacs: [
            Select::new(Port::B, b.pb12),
            Select::new(Port::B, b.pb11),
            Select::new(Port::B, b.pb10),
            Select::new(Port::B, b.pb1),
        ],
        enable: b.pb0.into_push_pull_output_in_state(PinState::Low),
    };
    (line, joints)
}

/// Takes the amplifiers' power away, whoever has the pin.
pub fn amplifiers_off() {
    // SAFETY: the register is always there, and writing it changes only the pin whose bit is set: to its safe side.
    unsafe { (*GPIOB::ptr()).bsrr().write(|w| w.bits(1 << 16)) };
}

/// Memory of the two buses, for as long as the program runs.
pub struct Buses {
    counters: MaybeUninit<CounterBus>,
    dacs: MaybeUninit<DacBus>,
}

impl Buses {
    /// Not started.
    pub const fn new() -> Self {
        Self { counters: MaybeUninit::uninit(), dacs: MaybeUninit::uninit() }
    }
}

impl Default for Buses {
    fn default() -> Self {
        Self::new()
    }
}

/// Starts buses and joints. What is wrong with the joints, they tell.
pub fn joints(
    spi1: SPI1,
    spi2: SPI2,
    pins: JointPins,
    buses: &'static mut Buses,
    rcc: &mut Rcc,
) -> HandJoints {
    let (sck, miso, mosi) = pins.counter_bus;
    let wires = (Some(sck.into_alternate::<5>().speed(Speed::Medium)), Some(miso), Some(mosi));
    let counters = Spi::new(spi1, wires, ls7366r::SPI_MODE, COUNTER_CLOCK, rcc);
    let counters = &*buses.counters.write(AtomicCell::new(counters));
    let (sck, miso, mosi) = pins.dac_bus;
    let wires = (Some(sck.into_alternate::<5>().speed(Speed::Medium)), Some(miso), Some(mosi));
    let dacs = Spi::new(spi2, wires, dac::SPI_MODE, DAC_CLOCK, rcc);
    let dacs = &*buses.dacs.write(AtomicCell::new(dacs));

    let mut selects = pins.counters.into_iter();
    let counters = array::from_fn(|_| {
        let Ok(counter) = AtomicDevice::new(counters, selects.next().expect(ENOUGH), Wait);
        counter
    });
    let mut selects = pins.dacs.into_iter();
    let dacs = array::from_fn(|_| {
        let Ok(dac) = AtomicDevice::new(dacs, selects.next().expect(ENOUGH), Wait);
        dac
    });
    let outputs = torques_per_volt_nm_v().map(|nm_per_volt| OutputConfig { nm_per_volt });
    let config = JointsConfig { filter_clock: FILTER_CLOCK, outputs };
    HandJoints::new(counters, dacs, pins.enable, &config).expect("the build has checked the hand's scales")
}

const ENOUGH: &str = "checked when compiled: the board has enough selects";

/// Waits at least as long as it is asked to.
pub struct Wait;

impl DelayNs for Wait {
    fn delay_ns(&mut self, ns: u32) {
        // 168 cycles a microsecond, rounded up; the product has room for 25 ms.
        cortex_m::asm::delay(ns.saturating_mul(168) / 1000 + 1);
    }
}
