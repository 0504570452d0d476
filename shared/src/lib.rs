//! Everything that runs on both sides: on the microcontroller at 1 kHz, and on the host against the simulated plant.
//!
//! One function is the product: the tick, which takes the joint encoder counts of this millisecond to the joint
//! torques of the next. It is pure, has no heap, locks, logging, `f64` or `Result`, cannot panic, and gives the same
//! bits wherever it runs.
//!
//! Source: Kawamura, Tahara, Kurazume, Hasegawa, *Dynamic grasping of an arbitrary polyhedral object*. Equation
//! numbers in this crate are the paper's; where the code departs from the print, the item says so.
#![no_std]
#![deny(missing_docs)]

#[cfg(test)]
extern crate std;

mod array;
pub mod bytes;
pub mod command;
pub mod control;
pub mod cycle;
pub mod device;
pub mod estimate;
pub mod event;
pub mod fault;
pub mod hand;
pub mod identity;
pub mod joints;
pub mod ledger;
pub mod limit;
pub mod link;
pub mod list;
pub mod math;
pub mod model;
pub mod parameter;
pub mod parameters;
pub mod period;
pub mod saved;
pub mod signals;
pub mod store;
pub mod supervisor;
pub mod telemetry;
pub mod tick;
