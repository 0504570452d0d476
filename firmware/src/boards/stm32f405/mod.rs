//! The board with an STM32F405RG: its pins, clocks and scales (`wiring.rs`), its start, its line, its supply.
//!
//! On the host only the parts without hardware are there, for their tests.

pub mod flash;
pub mod reset;

#[cfg(target_os = "none")]
pub mod boot;
#[cfg(target_os = "none")]
mod capacity;
#[cfg(target_os = "none")]
pub mod clock;
#[cfg(target_os = "none")]
pub mod dma;
#[cfg(target_os = "none")]
pub mod serial;
#[cfg(target_os = "none")]
pub mod supply;
#[cfg(target_os = "none")]
pub mod wiring;

#[cfg(target_os = "none")]
pub use boot::Stm32f405;
#[cfg(target_os = "none")]
pub use stm32f4xx_hal::pac;
#[cfg(target_os = "none")]
pub use wiring::Buses;
