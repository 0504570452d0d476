//! The shared crate from outside.

mod bits;
mod common;
mod device;
mod flash;
mod link;
mod model;
mod random;
mod safety;
mod saved;
mod settings;
mod snapshot;
mod store;
mod tick;
