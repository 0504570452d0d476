//! The surroundings of the shared [`Device`](blindgrasp_shared::device::Device) on the microcontroller: wiring, and
//! drivers. What the hand does is decided there; here are pins, clocks, queues and interrupts. What is true of one
//! board alone is in that board's folder ([`boards`]).
//!
//! ```text
//!  priority 3   USART2 --bytes (DMA1)--+                                   bytes (DMA1) --> USART2
//!  priority 2   SysTick, 1 kHz         |   control task: joints -> tick -> joints    ^
//!                                      |        ^ packets         | records, replies |
//!  idle                                +--> link: frames to packets, replies to frames
//! ```
//!
//! Everything between two priorities is a bounded queue without locks ([`queue`]). Two images come of it: `hand`, with
//! the joints of the board, and `pil` (processor in the loop), whose joints are at the other end of the link ([`pil`]).
//!
//! On the host only the parts without hardware are there, for their tests.
#![no_std]
#![warn(missing_docs)]

#[cfg(test)]
extern crate std;

pub mod boards;
pub mod control;
pub mod divider;
pub mod joints;
pub mod link;
pub mod model;
pub mod pil;
pub mod queue;
pub mod schedule;
pub mod tasks;

#[cfg(target_os = "none")]
pub mod bench;
#[cfg(target_os = "none")]
pub mod crash;
#[cfg(all(target_os = "none", not(feature = "no-panic")))]
pub mod report;
#[cfg(all(target_os = "none", not(feature = "no-panic")))]
pub mod saved;
#[cfg(target_os = "none")]
pub mod semihosting;
#[cfg(all(target_os = "none", not(feature = "no-panic")))]
pub mod start;

/// The board that the images are for.
pub use boards::stm32f405 as board;
/// Its type.
#[cfg(target_os = "none")]
pub type Chosen = board::Stm32f405;

#[cfg(all(target_os = "none", not(feature = "no-panic")))]
use defmt_rtt as _;
