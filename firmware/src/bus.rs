//! Many devices on one SPI bus, for the control task: without a panic, and without switching interrupts off.
#![allow(unsafe_code)]

use core::cell::UnsafeCell;
use core::convert::Infallible;
use core::sync::atomic::{AtomicBool, Ordering};
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiBus, SpiDevice};

/// A bus that devices share. Only one uses it at a time: another that tries meanwhile gets an error.
pub struct SharedBus<B> {
    taken: AtomicBool,
    bus: UnsafeCell<B>,
}

// SAFETY: `bus` is only reached through `with`, by whoever changed `taken` from false to true.
unsafe impl<B: Send> Sync for SharedBus<B> {}

impl<B> SharedBus<B> {
    /// A bus that nobody uses.
    pub const fn new(bus: B) -> Self {
        Self { taken: AtomicBool::new(false), bus: UnsafeCell::new(bus) }
    }

    /// Runs something with the bus, if it is free.
    fn with<T>(&self, use_it: impl FnOnce(&mut B) -> T) -> Option<T> {
        if self.taken.swap(true, Ordering::Acquire) {
            return None;
        }
        // SAFETY: the swap makes this the only reference until `taken` is false again.
        let result = use_it(unsafe { &mut *self.bus.get() });
        self.taken.store(false, Ordering::Release);
        Some(result)
    }
}

/// A device on a shared bus, with its chip select, which is low while it is talked to.
pub struct Device<'b, B, S, D> {
    bus: &'b SharedBus<B>,
    select: S,
    delay: D,
}

impl<'b, B, S: OutputPin<Error = Infallible>, D> Device<'b, B, S, D> {
    /// A device that is not selected.
    pub fn new(bus: &'b SharedBus<B>, mut select: S, delay: D) -> Self {
        let Ok(()) = select.set_high();
        Self { bus, select, delay }
    }
}

/// Why a transaction failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceError<E> {
    /// The bus itself.
    Bus(E),
    /// Another device was using the bus.
    Taken,
}

impl<E: Error> Error for DeviceError<E> {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Bus(error) => error.kind(),
            Self::Taken => ErrorKind::Other,
        }
    }
}

impl<B: SpiBus, S, D> ErrorType for Device<'_, B, S, D> {
    type Error = DeviceError<B::Error>;
}

impl<B: SpiBus, S: OutputPin<Error = Infallible>, D: DelayNs> SpiDevice for Device<'_, B, S, D> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Self::Error> {
        let (select, delay) = (&mut self.select, &mut self.delay);
        let done = self.bus.with(|bus| {
            let Ok(()) = select.set_low();
            let result = operations.iter_mut().try_for_each(|operation| match operation {
                Operation::Read(words) => bus.read(words),
                Operation::Write(words) => bus.write(words),
                Operation::Transfer(read, write) => bus.transfer(read, write),
                Operation::TransferInPlace(words) => bus.transfer_in_place(words),
                Operation::DelayNs(ns) => {
                    bus.flush()?;
                    delay.delay_ns(*ns);
                    Ok(())
                }
            });
            // The chip is let go only when the last bit is out, also after an error.
            let flushed = bus.flush();
            let Ok(()) = select.set_high();
            result.and(flushed)
        });
        done.ok_or(DeviceError::Taken)?.map_err(DeviceError::Bus)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::delay::NoopDelay;
    use embedded_hal_mock::eh1::spi::{Mock as Spi, Transaction};
    use std::vec;

    /// A select that only remembers how often it was low.
    #[derive(Default)]
    struct Select {
        low: bool,
        selected: u32,
    }

    impl embedded_hal::digital::ErrorType for Select {
        type Error = Infallible;
    }

    impl OutputPin for Select {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.selected += u32::from(!self.low);
            self.low = true;
            Ok(())
        }

        fn set_high(&mut self) -> Result<(), Infallible> {
            self.low = false;
            Ok(())
        }
    }

    #[test]
    fn a_transaction_selects_once_and_clocks_every_word() {
        let mut spi = Spi::new(&[
            Transaction::write_vec(vec![1, 2]),
            Transaction::transfer(vec![3, 4], vec![13, 14]),
            Transaction::flush(),
        ]);
        let bus = SharedBus::new(spi.clone());
        let mut device = Device::new(&bus, Select::default(), NoopDelay::new());
        let mut read = [0; 2];
        device
            .transaction(&mut [Operation::Write(&[1, 2]), Operation::Transfer(&mut read, &[3, 4])])
            .unwrap();
        assert_eq!(read, [13, 14]);
        assert_eq!((device.select.selected, device.select.low), (1, false));
        spi.done();
    }

    #[test]
    fn a_bus_in_use_is_an_error_and_is_free_again_afterwards() {
        let mut spi = Spi::new(&[Transaction::write_vec(vec![7]), Transaction::flush()]);
        let bus = SharedBus::new(spi.clone());
        let mut device = Device::new(&bus, Select::default(), NoopDelay::new());
        let refused = bus.with(|_| device.write(&[7]));
        assert_eq!(refused, Some(Err(DeviceError::Taken)));
        assert_eq!(device.select.selected, 0);
        assert_eq!(device.write(&[7]), Ok(()));
        spi.done();
    }
}
