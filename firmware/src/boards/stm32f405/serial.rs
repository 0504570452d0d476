//! USART2: received bytes by interrupt, sent bytes by polling.
//!
//! The receiver has room for one byte, and at 1 Mbaud the next one comes 10 us later, while the control task runs for
//! hundreds of microseconds. So the interrupt of a received byte is the one thing that preempts the control task. It
//! does nothing but move the byte to a queue: some 50 cycles for each of at most 100 bytes in a millisecond, which is
//! 3 % of the processor at the very most, and known when the deadline is reckoned.
//!
//! Sending by polling costs nothing that matters: it is done when there is nothing else to do. (Besides, QEMU 7.2 never
//! raises the interrupt of an empty transmitter.)

use super::wiring;
use crate::divider::Divider;
use crate::link::Port;
use crate::queue::{dequeue, enqueue};
use core::sync::atomic::{AtomicU32, Ordering};
use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4xx_hal::gpio::{PA2, PA3};
use stm32f4xx_hal::nb;
use stm32f4xx_hal::pac::USART2;
use stm32f4xx_hal::pac::usart1::RegisterBlock;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::serial::config::{Config, InvalidConfig};
use stm32f4xx_hal::serial::{Rx, Serial, Tx};

/// Bytes between the interrupt and the decoder: 5 ms of a busy line.
pub type Bytes = Queue<u8, 512>;

/// Bytes that came with an overrun, noise, or without their stop bit. The byte is left out; the frame's CRC does the
/// rest.
static LINE_ERRORS: AtomicU32 = AtomicU32::new(0);
/// Bytes that the queue had no room for.
static LOST_BYTES: AtomicU32 = AtomicU32::new(0);

/// Bytes received with an error, and lost for want of room, since boot.
pub fn errors() -> (u32, u32) {
    (LINE_ERRORS.load(Ordering::Relaxed), LOST_BYTES.load(Ordering::Relaxed))
}

/// The line's pins.
pub struct LinePins {
    /// To the host.
    pub tx: PA2,
    /// From the host.
    pub rx: PA3,
}

/// Starts the line.
///
/// # Errors
/// The baud rate can't be had from the clock of the bus.
pub fn start(
    usart: USART2,
    pins: LinePins,
    bytes: &'static mut Bytes,
    rcc: &mut Rcc,
) -> Result<(Interrupt, Line), InvalidConfig> {
    let config = Config::default().baudrate(wiring::BAUD.bps());
    let (tx, mut rx) = Serial::new(usart, (pins.tx, pins.rx), config, rcc)?.split();
    let (producer, consumer) = bytes.split();
    rx.listen();
    let bus_hz = rcc.clocks.pclk1().raw();
    Ok((Interrupt { rx, bytes: producer }, Line { tx, bus_hz, bytes: consumer }))
}

/// The interrupt's end.
pub struct Interrupt {
    rx: Rx<USART2>,
    bytes: Producer<'static, u8>,
}

impl Interrupt {
    /// Moves a received byte to the queue. Reading it takes back the interrupt, and clears an overrun and every other
    /// error with it (RM0090 30.6.1), so that none can stop the receiver.
    pub fn serve(&mut self) {
        match self.rx.read() {
            Ok(byte) => {
                if enqueue(&mut self.bytes, byte).is_err() {
                    LOST_BYTES.fetch_add(1, Ordering::Relaxed);
                }
            }
            Err(nb::Error::Other(_)) => {
                LINE_ERRORS.fetch_add(1, Ordering::Relaxed);
            }
            Err(nb::Error::WouldBlock) => {}
        }
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
    bytes: Consumer<'static, u8>,
}

impl Port for Line {
    fn receive(&mut self) -> Option<u8> {
        dequeue(&mut self.bytes)
    }

    fn is_silent(&self) -> bool {
        self.bytes.len() == 0
    }

    fn try_send(&mut self, byte: u8) -> bool {
        self.tx.write(byte).is_ok()
    }

    fn is_sent(&self) -> bool {
        registers().sr().read().tc().bit_is_set()
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
