//! The hand that this firmware is for: chosen, checked and written down by `build.rs`.

use blindgrasp_shared::model;
use blindgrasp_shared::tick::Params;

include!(concat!(env!("OUT_DIR"), "/hand.rs"));

/// The hand and its configuration, as [`model`] reads them.
pub static MODEL: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/hand.bin"));

/// The hand's parameters.
///
/// # Panics
/// The flash is damaged: the build checked the same bytes.
pub fn params() -> Params<JOINTS, FINGERS> {
    model::decode(MODEL).expect(DAMAGED)
}

/// Torque at each joint for each volt at its amplifier, N m/V.
///
/// # Panics
/// As [`params`].
pub fn torques_per_volt_nm_v() -> [f32; JOINTS] {
    model::torques_per_volt_nm_v(MODEL).expect(DAMAGED)
}

const DAMAGED: &str = "the hand in this image is damaged: flash it again";
