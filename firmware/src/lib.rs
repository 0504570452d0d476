//! Probe of size: what it takes to have the parameters of a hand.
#![no_std]

include!(concat!(env!("OUT_DIR"), "/hand.rs"));

/// Whether the image's descriptions are there.
pub fn images() -> (&'static [u8], &'static [u8]) {
    (&IMAGE_HAND, &IMAGE_PIL)
}
