//! Pictures of sweeps: what came of the runs over one variable ([`Curve`]) or over two ([`Map`]).

mod curve;
mod key;
mod map;
mod ramp;
#[cfg(test)]
mod tests;
mod variable;

pub use curve::{Curve, Dot};
pub use map::Map;
pub use variable::{Spread, Variable};

/// The outcome of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mark {
    /// The grasp held, and everything was at rest from this time on, s.
    Rested(f64),
    /// The grasp held, and something still moved at the end, s.
    Moving(f64),
    /// The grasp was lost at this time, s.
    Lost(f64),
    /// The scene refused the values.
    Refused,
}
