//! The largest hand that the board can have. `build.rs` reads this too, and refuses a larger one.

/// Joints that the board has counters and outputs for.
pub(crate) const MOST_JOINTS: usize = 16;
