//! The hand that this firmware is for.
#![no_std]

pub mod model;
