//! The link between a host and a device.

pub mod message;
