//! DMA1 between USART2 and the rings of its bytes: what touches the registers. All arithmetic is in
//! [`ring`](blindgrasp_shared::link::ring).
//!
//! Receiving is stream 5, sending stream 6, both of channel 4 (RM0090 10.3.3). What the SPI buses could want stays free:
//! streams 3 and 4 here, and DMA2.

#![allow(unsafe_code)]

use super::serial::{RECEIVED, SENT};
use blindgrasp_shared::link::ring::{Position, Transfers};
use core::sync::atomic::AtomicU8;
use cortex_m::asm::dmb;
use cortex_m::peripheral::NVIC;
use stm32f4xx_hal::ClearFlags;
use stm32f4xx_hal::dma::config::Priority;
use stm32f4xx_hal::dma::traits::{Direction, Stream, StreamISR};
use stm32f4xx_hal::dma::{
    DmaChannel, MemoryToPeripheral, PeripheralToMemory, Stream5, Stream6, StreamsTuple,
};
use stm32f4xx_hal::pac::{DMA1, Interrupt, USART2};
use stm32f4xx_hal::rcc::Rcc;

/// Starts both directions; USART2 asks for them.
pub fn start(dma: DMA1, rcc: &mut Rcc) -> (Receiving, Sending) {
    let StreamsTuple(_, _, _, _, _, receiving, sending, _) = StreamsTuple::new(dma, rcc);
    let (mut receiving, mut sending) = (Receiving(receiving), Sending(sending, Transfers::new()));
    prepare(&mut receiving.0, PeripheralToMemory::direction(), Priority::VeryHigh);
    receiving.0.set_circular_mode(true);
    receiving.begin();
    prepare(&mut sending.0, MemoryToPeripheral::direction(), Priority::High);
    (receiving, sending)
}

/// Bytes, without the FIFO, that go between USART2 and memory; its end is an interrupt.
fn prepare(stream: &mut impl Stream, direction: stm32f4xx_hal::dma::DmaDirection, priority: Priority) {
    stream.set_channel(DmaChannel::Channel4);
    stream.set_priority(priority);
    stream.set_memory_increment(true);
    stream.set_direction(direction);
    // SAFETY: the register is always there; its address alone is taken.
    stream.set_peripheral_address(unsafe { (*USART2::ptr()).dr().as_ptr() } as u32);
    stream.listen_transfer_complete();
}

/// Begins a transfer; the stream does nothing before.
fn begin(stream: &mut impl Stream, memory: &'static [AtomicU8]) {
    stream.clear_all_flags();
    stream.set_memory_address(memory.as_ptr() as u32);
    stream.set_number_of_transfers(memory.len() as u16);
    // What was written to the memory is there before the transfer looks.
    dmb();
    // SAFETY: the memory is atomic and static, so the transfer may write to it and read it at any time.
    unsafe { stream.enable() };
}

/// The circular transfer of what is received.
pub struct Receiving(Stream5<DMA1>);

impl Receiving {
    fn begin(&mut self) {
        begin(&mut self.0, RECEIVED.memory());
    }

    /// Counts a lap, or begins anew after an error of the bus.
    pub fn serve(&mut self) {
        if self.0.is_enabled() {
            if self.0.is_transfer_complete() {
                self.0.clear_transfer_complete();
                RECEIVED.lap();
            }
        } else {
            RECEIVED.restarted();
            self.begin();
        }
    }
}

/// Returns the position of the circular transfer.
pub fn position() -> Position {
    // SAFETY: reading these registers changes nothing.
    let dma = unsafe { &*DMA1::ptr() };
    // In this order: a lap that the number shows, the flag behind it shows, too, or it is already counted.
    let remaining = dma.st(5).ndtr().read().ndt().bits();
    Position { remaining, lap_pending: dma.hisr().read().tcif5().bit_is_set() }
}

/// The transfers of what is sent.
pub struct Sending(Stream6<DMA1>, Transfers);

impl Sending {
    /// Begins the next transfer when one has ended, or when there is something to send.
    pub fn serve(&mut self) {
        let Self(stream, transfers) = self;
        // One that still runs calls again when it ends.
        if !stream.is_enabled() {
            stream.clear_all_flags();
            if let Some(piece) = transfers.next(&SENT, stream.number_of_transfers()) {
                begin(stream, piece);
            }
        }
    }
}

/// Calls for [`Sending::serve`].
pub fn send() {
    NVIC::pend(Interrupt::DMA1_STREAM6);
}

/// Asks for the interrupt of a byte with an error.
pub fn listen_errors() {
    // SAFETY: called at the start, before there is anyone else.
    unsafe { (*USART2::ptr()).cr3().modify(|_, w| w.eie().set_bit()) };
}

/// Takes back USART2's interrupt: the line has fallen silent, or a byte had an error. Tells if it was an error.
///
/// The flags go when the status and then the data are read (RM0090 30.6.1). That takes no byte from the transfer, which
/// has had it before an interrupt can begin; the next one takes 3 us at the very least.
pub fn served_error() -> bool {
    // SAFETY: nobody else reads the status.
    let usart = unsafe { &*USART2::ptr() };
    let status = usart.sr().read();
    let overrun = status.ore().bit_is_set();
    let error = overrun || status.fe().bit_is_set() || status.nf().bit_is_set();
    if error || status.idle().bit_is_set() {
        usart.dr().read();
    }
    if overrun {
        // No transfer has taken the byte before: it may have stopped.
        NVIC::pend(Interrupt::DMA1_STREAM5);
    }
    error
}
