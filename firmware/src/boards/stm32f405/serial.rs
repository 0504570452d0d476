//! USART2: on hardware by DMA in both directions, in the emulator, which has no DMA, by interrupt and polling.
//!
//! The receiver has room for one byte, and at 3 Mbaud the next one comes 3.3 us later, while the control task runs for
//! hundreds of microseconds. So a circular transfer takes each byte to a ring, and costs the processor an interrupt a lap,
//! and one when the line falls silent, so that the processor wakes. What is sent goes through a ring, too: the end of a
//! transfer begins the next, also in the middle of the control task, and the line never waits while there are bytes.
//!
//! Emulated, the interrupt of a received byte moves it to the same ring, and what is sent is polled: QEMU 7.2 never raises
//! the interrupt of an empty transmitter. The image `pil` does so on hardware, too: its idle task waits for every byte.

use super::{dma, wiring};
use crate::divider::Divider;
use crate::link::{Port, ReceivedBytes, SentBytes};
use blindgrasp_shared::link::ring::{Position, Reader};
use core::sync::atomic::{AtomicU32, Ordering};
use stm32f4xx_hal::gpio::{PA2, PA3};
use stm32f4xx_hal::nb;
use stm32f4xx_hal::pac::usart1::RegisterBlock;
use stm32f4xx_hal::pac::{DMA1, USART2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::serial::config::{Config, DmaConfig, InvalidConfig};
use stm32f4xx_hal::serial::{Rx, Serial, Tx};

pub(crate) static RECEIVED: ReceivedBytes = ReceivedBytes::new();
pub(crate) static SENT: SentBytes = SentBytes::new();

/// Bytes that came with an overrun, noise, or without their stop bit. The frame's CRC does the rest.
static LINE_ERRORS: AtomicU32 = AtomicU32::new(0);

/// Bytes received with an error, and lost because they were not read in time, since boot.
pub fn errors() -> (u32, u32) {
    (LINE_ERRORS.load(Ordering::Relaxed), RECEIVED.lost())
}

/// The line's pins.
pub struct LinePins {
    /// To the host.
    pub tx: PA2,
    /// From the host.
    pub rx: PA3,
}

/// Starts the line: by DMA if there is one.
///
/// # Errors
/// The baud rate can't be had from the clock of the bus.
pub fn start(
    usart: USART2,
    dma: Option<DMA1>,
    pins: LinePins,
    rcc: &mut Rcc,
) -> Result<(Interrupt, Line, Option<(dma::Receiving, dma::Sending)>), InvalidConfig> {
    let by_dma = dma.is_some();
    let asks = if by_dma { DmaConfig::TxRx } else { DmaConfig::None };
    let config = Config::default().baudrate(wiring::BAUD.bps()).dma(asks);
    // Before the first byte comes.
    let streams = dma.map(|dma| dma::start(dma, rcc));
    let (tx, mut rx) = Serial::new(usart, (pins.tx, pins.rx), config, rcc)?.split();
    if by_dma {
        rx.listen_idle();
        dma::listen_errors();
    } else {
        rx.listen();
    }
    let bus_hz = rcc.clocks.pclk1().raw();
    Ok((Interrupt { rx, by_dma }, Line { tx, bus_hz, by_dma, reader: Reader::new() }, streams))
}

/// The interrupt's end.
pub struct Interrupt {
    rx: Rx<USART2>,
    by_dma: bool,
}

impl Interrupt {
    /// By DMA, counts an error, or wakes the processor because the line has fallen silent. Otherwise, moves a received byte
    /// to the ring. Reading it takes back the interrupt, and clears an overrun and every other error with it (RM0090
    /// 30.6.1), so that none can stop the receiver.
    pub fn serve(&mut self) {
        let error = if self.by_dma {
            dma::served_error()
        } else {
            match self.rx.read() {
                Ok(byte) => {
                    RECEIVED.put(byte);
                    false
                }
                Err(nb::Error::Other(_)) => true,
                Err(nb::Error::WouldBlock) => false,
            }
        };
        LINE_ERRORS.fetch_add(error.into(), Ordering::Relaxed);
    }
}

/// The registers of the USART, for what the HAL can't do once it has started.
fn registers() -> &'static RegisterBlock {
    // SAFETY: the line's end alone writes those that it uses, from the idle task. The interrupt reads the status and the data.
    #[allow(unsafe_code)]
    unsafe {
        &*USART2::ptr()
    }
}

/// The other end.
pub struct Line {
    tx: Tx<USART2>,
    /// Clock of the USART's bus, Hz.
    bus_hz: u32,
    by_dma: bool,
    reader: Reader,
}

impl Line {
    /// The position of what writes the ring.
    fn position(by_dma: bool) -> Position {
        if by_dma { dma::position() } else { RECEIVED.position() }
    }
}

impl Port for Line {
    fn receive(&mut self) -> Option<u8> {
        self.reader.next(&RECEIVED, || Self::position(self.by_dma))
    }

    fn is_silent(&self) -> bool {
        self.reader.is_idle(&RECEIVED, || Self::position(self.by_dma))
    }

    fn send(&mut self, bytes: &[u8]) -> usize {
        if !self.by_dma {
            return bytes.first().is_some_and(|&byte| self.tx.write(byte).is_ok()).into();
        }
        let count = SENT.write(bytes);
        if count > 0 {
            dma::send();
        }
        count
    }

    fn is_sent(&self) -> bool {
        // A transfer counts as sent once its end was taken note of; its last byte may still be on its way out.
        (!self.by_dma || SENT.is_empty()) && registers().sr().read().tc().bit_is_set()
    }

    fn set_baud(&mut self, baud: u32) {
        // The line has no rate that the generator does not have: the tests look at each.
        let Some(Divider { register, by_eight }) = Divider::new(self.bus_hz, baud) else { return };
        let usart = registers();
        usart.cr1().modify(|_, w| w.ue().disabled());
        // SAFETY: every value of the register is a divider.
        #[allow(unsafe_code)]
        usart.brr().write(|w| unsafe { w.bits(register) });
        usart.cr1().modify(|_, w| w.over8().bit(by_eight).ue().enabled());
    }
}
