//! The description of a device in a recording: who it is, and its parameters.

use blindgrasp_body::MAX_JOINTS;
use blindgrasp_model::{HandFile, HandModel};
use blindgrasp_shared::identity::Identity;
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::tick::{Config, Params};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Value, json};

/// The identity of a device, told at the beginning of each session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// [`INTERFACE_VERSION`](blindgrasp_shared::telemetry::INTERFACE_VERSION) of the device.
    pub interface_version: u16,
    /// The image: `hand`, `pil`, or `sim` for a simulation without a link.
    pub image: String,
    /// Release of the firmware.
    pub firmware_version: String,
    /// CRC-32 of the sources of the firmware; eight hexadecimal digits in the file.
    #[serde(with = "hexadecimal")]
    pub build_hash: u32,
    /// Name of the hand.
    pub hand: String,
    /// CRC-32 of the hand's model and default configuration.
    #[serde(with = "hexadecimal")]
    pub hand_hash: u32,
    /// Joints of the hand.
    pub joint_count: u8,
    /// Fingertips of the hand.
    pub fingertip_count: u8,
    /// Time from one tick to the next, us.
    pub period_us: u32,
    /// The source of the device's clock, in words.
    pub clock: String,
    /// The cause of the device's start, in words.
    pub reset: String,
    /// The crash in which it ended before, in words, if it did.
    pub crash: Option<String>,
    /// Level of its brown-out reset, in words.
    #[serde(default)]
    pub brown_out: String,
    /// Frequency of the clock that its cycles are counted in, Hz; 0 where nothing counts them.
    #[serde(default)]
    pub clock_hz: u32,
    /// Units on the wire.
    pub units: String,
    /// Release of the program that recorded.
    pub host_version: String,
    /// The port.
    pub port: Option<String>,
    /// Its speed, bits a second.
    pub baud: Option<u32>,
    /// Names of the joints, in the hand's order.
    pub joint_names: Vec<String>,
    /// The hand's whole file (TOML), where it is known.
    pub hand_file: Option<String>,
    /// The effective scene (TOML) of a simulation.
    pub scene: Option<String>,
}

impl About {
    /// Returns the description that a device gives of itself; nothing else is known yet.
    pub fn of(identity: &Identity<'_>) -> Self {
        let image = &identity.image;
        Self {
            interface_version: image.interface_version,
            image: image.kind.into(),
            firmware_version: image.firmware_version.into(),
            build_hash: image.build_hash,
            hand: image.hand.into(),
            hand_hash: image.hand_hash,
            joint_count: image.joint_count,
            fingertip_count: image.fingertip_count,
            period_us: image.period_us,
            clock: identity.clock.words().into(),
            reset: identity.reset.words().into(),
            crash: identity.crash.map(|crash| crash.to_string()),
            brown_out: identity.brown_out.words().into(),
            clock_hz: identity.clock_hz,
            units: identity.units.into(),
            host_version: env!("CARGO_PKG_VERSION").into(),
            port: None,
            baud: None,
            joint_names: (1..=image.joint_count).map(|k| format!("joint{k}")).collect(),
            hand_file: None,
            scene: None,
        }
    }

    /// Returns `true` if another session, too, was with this firmware, as far as it says.
    pub(super) fn is_same_firmware(&self, other: &Self) -> bool {
        let of = |about: &Self| (about.image.clone(), about.build_hash, about.hand_hash, about.period_us);
        of(self) == of(other)
    }

    /// Adds the hand's file, if it is the hand that the device was built for: its joints have names then, and its counts
    /// become angles.
    #[must_use]
    pub fn with_hand(mut self, file: &HandFile) -> Self {
        self.hand_file = Some(file.to_toml());
        self.joint_names = file.joints.iter().map(|joint| joint.name.clone()).collect();
        self
    }

    /// The hand, where its file is known and right.
    pub fn hand_model(&self) -> Option<HandModel> {
        let model = HandModel::parse(self.hand_file.as_deref()?, "hand of the recording").ok()?;
        (model.hand.joint_count() == self.joint_names.len()).then_some(model)
    }

    /// Returns the number of its joints that can be read.
    pub(super) fn joints(&self) -> usize {
        usize::from(self.joint_count).min(MAX_JOINTS)
    }
}

/// Eight digits, as it is printed everywhere.
mod hexadecimal {
    use super::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(value: &u32, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&format!("{value:08x}"))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
        u32::from_str_radix(&String::deserialize(deserializer)?, 16).map_err(serde::de::Error::custom)
    }
}

/// A parameter and what it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The parameter.
    pub parameter: Parameter,
    /// Of which joint or axis.
    pub index: u8,
    /// `None`: what it belongs to is switched off.
    pub value: Option<f32>,
}

impl Setting {
    /// All parameters of a controller.
    pub fn all<const J: usize, const F: usize>(params: &Params<J, F>) -> Vec<Self> {
        let joints = params.hand().joint_count();
        let each = |parameter: Parameter| (0..parameter.count(joints)).map(move |index| (parameter, index));
        let value = |(parameter, index)| {
            let value = params.get(parameter, index).ok().map(|setting| setting.value);
            Self { parameter, index, value }
        };
        Parameter::ALL.into_iter().flat_map(each).map(value).collect()
    }

    /// Takes over the bandwidth of the estimator.
    pub(super) fn configure(&self, config: &mut Config<MAX_JOINTS>) {
        if let (Parameter::BANDWIDTH, Some(value)) = (self.parameter, self.value) {
            config.estimator.bandwidth_hz = value;
        }
    }

    /// Settings as JSON. A float is written as the `f64` that it is exactly.
    pub(super) fn to_json(settings: &[Self]) -> Value {
        let value = |value: f32| match value {
            finite if finite.is_finite() => json!(f64::from(finite)),
            other => json!(other.to_string()),
        };
        let settings = settings.iter().map(|setting| {
            json!({
                "key": setting.parameter.to_string(),
                "index": setting.index,
                "value": setting.value.map(value),
            })
        });
        json!({ "values": settings.collect::<Vec<_>>() })
    }

    /// Reads what [`Self::to_json`] wrote; `None` if it is something else. Parameters of other versions are left out.
    pub(super) fn from_json(bytes: &[u8]) -> Option<Vec<Self>> {
        let value: Value = serde_json::from_slice(bytes).ok()?;
        let mut settings = Vec::new();
        for item in value.get("values")?.as_array()? {
            let key = item.get("key")?.as_str()?;
            let index = u8::try_from(item.get("index")?.as_u64()?).ok()?;
            let value = match item.get("value")? {
                Value::Null => None,
                Value::Number(number) => Some(number.as_f64()? as f32),
                Value::String(word) => Some(word.parse().ok()?),
                _ => return None,
            };
            if let Some(parameter) = Parameter::named(key) {
                settings.push(Self { parameter, index, value });
            }
        }
        Some(settings)
    }
}
