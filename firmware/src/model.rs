//! The hand that this firmware is for: chosen, checked and turned into constants by `build.rs`.

use blindgrasp_shared::tick::Params;

pub use constants::*;

/// As `build.rs` wrote them.
mod constants {
    // A hand without end stops has no use for their type.
    #![allow(unused_imports)]
    include!(concat!(env!("OUT_DIR"), "/hand.rs"));
}

/// The hand's parameters.
///
/// # Panics
/// Never: the build checked the same numbers.
pub fn params() -> Params<JOINTS, FINGERS> {
    match Params::new(HAND.clone(), &CONFIG) {
        Ok(params) => params,
        Err(_) => unreachable!("the build has checked them"),
    }
}
