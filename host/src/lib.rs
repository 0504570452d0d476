//! The host side of blindgrasp: the simulated plant, the closed loop around the same tick that the microcontroller
//! runs, scenes, and reports.

/// The largest hand that the host loads: joints.
pub const MAX_JOINTS: usize = 24;
/// The largest hand that the host loads: fingertips.
pub const MAX_FINGERS: usize = 5;

/// A hand of any size, in the precision of the plant.
pub type Hand = blindgrasp_shared::hand::Hand<f64, MAX_JOINTS, MAX_FINGERS>;
/// A posture of a [`Hand`].
pub type Posture = blindgrasp_shared::hand::Posture<f64, MAX_JOINTS, MAX_FINGERS>;

#[cfg(feature = "command")]
pub mod device;
pub mod inspect;
#[cfg(feature = "command")]
pub mod monitor;
#[cfg(feature = "command")]
pub mod paper;
pub mod placement;
pub mod plant;
pub mod population;
pub mod record;
#[cfg(feature = "command")]
pub mod report;
pub mod scene;
pub mod sim;
#[cfg(feature = "command")]
pub mod sweep;
#[cfg(feature = "command")]
pub mod wire;
