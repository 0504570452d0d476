//! `[control]`: the gains of the laws, which the laws themselves declare, and what surrounds them.

use super::key::FileKey;
use blindgrasp_shared::control::{AttitudeError, Chosen, GAINS, LAWS, PerGain};
use serde::de::{self, Error as _, MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::sync::LazyLock;

/// Writes the struct, and how it is read and written, from one line a key.
macro_rules! control {
    ($($(#[doc = $doc:literal])* $field:ident: $type:ty = $default:expr;)*) => {
        /// The controller: laws, their gains, and what surrounds them. The damping gains are the hand's.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Control {
            /// Gains in full, by the keys that their laws declare. Those of the paper's law have to be given; others are zero
            /// if they are not.
            pub gains: PerGain<f64>,
            /// The laws that may act. A law whose gains are all zero does nothing anyway.
            pub laws: Chosen,
            $($(#[doc = $doc])* pub $field: $type,)*
        }

        impl Control {
            /// All keys other than gains and `laws`.
            pub const KEYS: &'static [FileKey] = &[$(FileKey {
                field: stringify!($field),
                value: stringify!($type),
                words: concat!($($doc),*),
            }),*];

            fn read_map<'de, A: MapAccess<'de>>(mut map: A) -> Result<Self, A::Error> {
                let mut gains = PerGain::all(None);
                let mut laws = None;
                $(let mut $field = None;)*
                while let Some(Key(key)) = map.next_key()? {
                    let known = GAINS.iter().zip(gains.iter_mut()).find(|(gain, _)| gain.key == key);
                    match (known, key.as_str()) {
                        (Some((_, place)), _) => *place = Some(map.next_value()?),
                        (None, "laws") => laws = Some(chosen(map.next_value()?)?),
                        $((None, stringify!($field)) => $field = Some(map.next_value()?),)*
                        (None, _) => return Err(A::Error::unknown_field(&key, ALL_KEYS.as_slice())),
                    }
                }
                for (gain, value) in GAINS.iter().zip(gains.grasp) {
                    value.ok_or_else(|| A::Error::missing_field(gain.key))?;
                }
                Ok(Self {
                    gains: gains.map(|value: &Option<f64>| value.unwrap_or(0.0)),
                    laws: laws.unwrap_or(Chosen::ALL),
                    $($field: $field.unwrap_or($default),)*
                })
            }
        }

        impl Serialize for Control {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut map = serializer.serialize_map(None)?;
                for (gain, value) in GAINS.iter().zip(self.gains.iter()) {
                    map.serialize_entry(gain.key, value)?;
                }
                if self.laws != Chosen::ALL {
                    let names = (0..).zip(LAWS).filter(|&(k, _)| self.laws.has(k)).map(|(_, (name, _))| name);
                    map.serialize_entry("laws", &names.collect::<Vec<_>>())?;
                }
                $(map.serialize_entry(stringify!($field), &self.$field)?;)*
                map.end()
            }
        }
    };
}

control! {
    /// Error of two fingertips' relative attitude, a turn by `a`, in `u_st`. `"sine"`: `2 sin a`, the paper's (Eq. 32).
    /// `"half-angle"`: `4 sin(a/2)`, which is the same at small turns, does not fall beyond 90 degrees, and holds twice as
    /// much there.
    attitude_error: AttitudeError = AttitudeError::Sine;
    /// Factor on the damping gains of the hand's joints.
    damping_scale: f64 = 1.0;
    /// `true`: the term `g` of Eq. 30 holds the weight of the links.
    gravity_compensation: bool = true;
    /// Sampling period, s.
    period_s: f64 = 1e-3;
    /// Time in which the force rises from zero, s.
    soft_start_s: f64 = 0.0;
    /// Time that the motors' amplifiers take to start after they got power, ms, by their data sheet: so long after `Arm` there
    /// is no torque.
    amplifier_start_ms: u32 = 0;
    /// Bandwidth of the estimate of joint angles and speeds from the encoder counts, Hz. Ideal sensors need no estimate.
    estimator_bandwidth_hz: f64 = 50.0;
    /// `true`: soft end stops keep the joints within their limits.
    end_stops: bool = true;
    /// Damping of the fingertips' common place over its stiffness `frame_stiffness_n_m`, s.
    frame_damping_s: f64 = 0.027;
    /// Damping of the fingertips' common attitude over its stiffness `frame_turn_stiffness_nm`, s.
    frame_turn_damping_s: f64 = 0.01;
    /// Distance of the fingertips' common place from its target beyond which the pull no longer grows, m.
    frame_reach_m: f64 = 0.015;
    /// Bandwidth of joints that follow a path to a posture, rad/s.
    moving_bandwidth_rad_s: f64 = 25.0;
    /// Largest speed of a joint on its path, rad/s; 0: the hand can't move to postures.
    moving_speed_rad_s: f64 = 1.5;
    /// Torque against friction that holds a joint in its posture, at most, as a factor on the largest Coulomb friction of a joint.
    moving_integral_factor: f64 = 2.0;
    /// Speed of fingertips that close, m/s; 0: a grasp begins at once, from touch.
    closing_speed_m_s: f64 = 0.0;
    /// Stiffness with which a fingertip that closes follows its way, N/m.
    closing_stiffness_n_m: f64 = 60.0;
    /// Force at which that is cut, N: that of a touch.
    closing_force_n: f64 = 0.2;
    /// Damping of a fingertip that closes, N s/m.
    closing_damping_n_s_m: f64 = 2.5;
    /// Longest way of what is held from where the grasp began, m.
    carrying_reach_m: f64 = 0.05;
    /// Largest turn of what is held since the grasp began, rad.
    carrying_reach_rad: f64 = 0.8;
    /// Largest speed of what is held, m/s.
    carrying_speed_m_s: f64 = 0.1;
    /// Largest angular speed of what is held, rad/s.
    carrying_speed_rad_s: f64 = 1.0;
    /// Most force of the integral that keeps what is held in its place, N.
    carrying_integral_n: f64 = 4.0;
    /// Rate at which the target follows what rolling fingertips tell of the object's turn, Hz; 0 leaves it alone.
    carrying_correction_hz: f64 = 1.0;
    /// Speed at which something is put down, m/s.
    carrying_put_down_m_s: f64 = 0.01;
    /// Way that is left, along each axis, which integral and correction leave alone, m, and the turn that this is 40 mm away.
    carrying_still_m: f64 = 3e-4;
    /// Depth below where the grasp began to which something is put down, m.
    carrying_put_down_m: f64 = 0.01;
    /// Force on what is below at which something is put down, N.
    carrying_put_down_n: f64 = 0.5;
}

/// Every key, for suggestions.
static ALL_KEYS: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
    let others = Control::KEYS.iter().map(|key| key.field);
    GAINS.iter().map(|gain| gain.key).chain(["laws"]).chain(others).collect()
});

/// A key that there is. What is refused while it is read is told with its place.
struct Key(String);

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let key = String::deserialize(deserializer)?;
        if ALL_KEYS.contains(&key.as_str()) {
            Ok(Self(key))
        } else {
            Err(D::Error::unknown_field(&key, ALL_KEYS.as_slice()))
        }
    }
}

/// The laws of these names.
fn chosen<E: de::Error>(names: Vec<String>) -> Result<Chosen, E> {
    names.iter().try_fold(Chosen::NONE, |chosen, name| {
        let number = (0..).zip(LAWS).find(|(_, (known, _))| known == name).map(|(number, _)| number);
        let known = || LAWS.iter().map(|(known, _)| format!("`{known}`")).collect::<Vec<_>>().join(", ");
        let number =
            number.ok_or_else(|| E::custom(format!("`laws` names `{name}`; there are {}", known())))?;
        Ok(chosen.with(number, true))
    })
}

impl Control {
    /// Returns the nominal grasping force `f_d` of Eq. 30, N. The fingertips' force follows from it by Eq. 57.
    pub fn force_n(&self) -> f64 {
        self.gains.grasp[0]
    }

    /// Returns the stiffness `K_st` of the relative attitude constraint of Eq. 32, N m; 0 for the normal forces alone.
    pub fn attitude_stiffness_nm(&self) -> f64 {
        self.gains.grasp[1]
    }
}

impl<'de> Deserialize<'de> for Control {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Keys;
        impl<'de> Visitor<'de> for Keys {
            type Value = Control;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Control, A::Error> {
                Control::read_map(map)
            }
        }
        deserializer.deserialize_map(Keys)
    }
}
