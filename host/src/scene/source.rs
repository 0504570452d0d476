//! A hand and its configuration as Rust source: the constants that a firmware is built with.
//!
//! Arrays of joints are written in the hand's exact size. Floats are written with the digits that give back every bit.

use blindgrasp_shared::control::{Chosen, Hold, LawsConfig, PerGain};
use blindgrasp_shared::estimate::{Encoder, EstimatorConfig};
use blindgrasp_shared::fault::FaultConfig;
use blindgrasp_shared::hand::{Bend, Fingertip, Link, PreparedJoint};
use blindgrasp_shared::limit::LimitConfig;
use blindgrasp_shared::supervisor::SupervisorConfig;
use blindgrasp_shared::tick::Config;
use nalgebra::{Matrix3, Vector3};

/// What every file of constants begins with.
pub(super) const IMPORTS: &str = "\
use blindgrasp_shared::control::{Chosen, Hold, LawsConfig, PerGain};
use blindgrasp_shared::estimate::{Encoder, EstimatorConfig};
use blindgrasp_shared::fault::FaultConfig;
use blindgrasp_shared::hand::{Bend, Fingertip, Hand, Link, PreparedJoint};
use blindgrasp_shared::limit::LimitConfig;
use blindgrasp_shared::supervisor::SupervisorConfig;
use blindgrasp_shared::tick::Config;
use nalgebra::{Matrix3, Vector3};
";

/// A configuration as a constant expression, for a hand of so many joints. What differs in a bit differs in a digit.
pub fn config_source<const J: usize>(config: &Config<J>, joints: usize) -> String {
    config.source(joints.min(J))
}

/// A value that can be written as a constant expression.
pub(super) trait Source {
    /// The expression, for a hand of so many joints.
    fn source(&self, joints: usize) -> String;
}

impl Source for f32 {
    fn source(&self, _: usize) -> String {
        if self.is_finite() {
            format!("{self:?}")
        } else {
            format!("f32::from_bits({:#010x})", self.to_bits())
        }
    }
}

macro_rules! as_printed {
    ($($name:ty)*) => {$(
        impl Source for $name {
            fn source(&self, _: usize) -> String {
                self.to_string()
            }
        }
    )*};
}

as_printed! { bool i32 u32 usize }

impl<V: Source> Source for Option<V> {
    fn source(&self, joints: usize) -> String {
        self.as_ref().map_or("None".into(), |value| format!("Some({})", value.source(joints)))
    }
}

impl<V: Source> Source for [V] {
    fn source(&self, joints: usize) -> String {
        format!("[{}]", list(self, joints))
    }
}

/// One a joint; what is beyond the hand's joints is left out.
impl<V: Source, const J: usize> Source for [V; J] {
    fn source(&self, joints: usize) -> String {
        self[..joints].source(joints)
    }
}

impl Source for Vector3<f32> {
    fn source(&self, joints: usize) -> String {
        format!("Vector3::new({})", list(self.as_slice(), joints))
    }
}

impl Source for Matrix3<f32> {
    fn source(&self, joints: usize) -> String {
        // Matrix3::new takes the rows, and a matrix is kept by columns.
        format!("Matrix3::new({})", list(self.transpose().as_slice(), joints))
    }
}

fn list<V: Source>(values: &[V], joints: usize) -> String {
    values.iter().map(|value| value.source(joints)).collect::<Vec<_>>().join(", ")
}

impl<V: Source> Source for PerGain<V> {
    fn source(&self, _: usize) -> String {
        let gains = self.iter().map(|gain| gain.source(0)).collect::<Vec<_>>().join(", ");
        format!("PerGain::of([{gains}])")
    }
}

impl Source for Chosen {
    fn source(&self, _: usize) -> String {
        (0..8)
            .filter(|&law| self.has(law))
            .fold("Chosen::NONE".into(), |text, law| format!("{text}.with({law}, true)"))
    }
}

/// Structs by their fields. A field that is missing here does not compile.
macro_rules! structs {
    ($(impl [$($size:tt)*] $type:ty as $name:ident { $($field:ident)* })*) => {$(
        impl<$($size)*> Source for $type {
            fn source(&self, joints: usize) -> String {
                let $name { $($field),* } = self;
                let fields = [$(format!("{}: {}", stringify!($field), $field.source(joints))),*];
                format!("{} {{ {} }}", stringify!($name), fields.join(", "))
            }
        }
    )*};
}

structs! {
    impl [] Link<f32> as Link { mass_kg mass_centre_m inertia_kg_m2 }
    impl [] Fingertip<f32> as Fingertip { link offset_m radius_m }
    impl [] Bend<f32> as Bend { turn_sine turn_cosine twist_sine twist_cosine }
    impl [] PreparedJoint<f32> as PreparedJoint {
        parent bend offset_m from_link lower_rad upper_rad link first_moment_kg_m
    }
    impl [] Encoder as Encoder { zero_count rad_per_count reversed }
    impl [const J: usize] EstimatorConfig<J> as EstimatorConfig { bandwidth_hz encoders }
    impl [const J: usize] Hold<f32, J> as Hold { damping_nm_s gravity_m_s2 }
    impl [const J: usize] LawsConfig<f32, J> as LawsConfig { gains chosen hold }
    impl [const J: usize] LimitConfig<J> as LimitConfig {
        gains torque_nm slew_nm_s stop_margin_rad stop_stiffness_nm_rad stop_damping_nm_s
    }
    impl [const J: usize] FaultConfig<J> as FaultConfig {
        possible_speed_rad_s speed_limit_rad_s range_slack_rad saturated_ms frozen_torque_nm frozen_neighbour_rad
        frozen_ms heartbeat_ms late_ticks energy_j
    }
    impl [] SupervisorConfig as SupervisorConfig { soft_start_ms release_ms amplifier_start_ms }
    impl [const J: usize] Config<J> as Config { period_us estimator laws limits faults supervisor }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the compiler reads is what the standard library reads.
    #[test]
    fn floats_keep_every_bit() {
        let mut bits = 1_u32;
        let odd = [0.0, -0.0, f32::MIN_POSITIVE, f32::MAX, f32::MIN, 1e-45, 0.1, 1e7, 16_777_217.0, 3e-5];
        let random = std::iter::from_fn(|| {
            bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            Some(f32::from_bits(bits))
        });
        for value in odd.into_iter().chain(random.take(100_000)).filter(|value| value.is_finite()) {
            let text = value.source(0);
            assert_eq!(text.parse::<f32>().map(f32::to_bits), Ok(value.to_bits()), "{text}");
            assert!(text.contains(['.', 'e']), "{text} would be a whole number");
        }
        assert_eq!(f32::NAN.source(0), "f32::from_bits(0x7fc00000)");
    }

    #[test]
    fn joints_beyond_the_hand_are_left_out() {
        let encoder = Encoder { zero_count: -3, rad_per_count: 2e-4, reversed: true };
        let config = EstimatorConfig { bandwidth_hz: 50.0, encoders: [encoder, encoder, Encoder::default()] };
        let one = "Encoder { zero_count: -3, rad_per_count: 0.0002, reversed: true }";
        assert_eq!(
            config.source(2),
            format!("EstimatorConfig {{ bandwidth_hz: 50.0, encoders: [{one}, {one}] }}")
        );
    }

    #[test]
    fn matrices_are_written_by_rows() {
        let matrix = Matrix3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0_f32);
        let text = "Some(Matrix3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0))";
        assert_eq!(Some(matrix).source(0), text);
        assert_eq!(None::<Vector3<f32>>.source(0), "None");
    }
}
