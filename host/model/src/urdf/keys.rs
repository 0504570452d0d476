//! The table `[urdf]` of a hand's file.

use super::super::check::{Result, fail};
use super::super::error::suggestion;
use serde::Deserialize;
use std::collections::BTreeMap;

/// The keys of a hand's file on its URDF.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Keys {
    /// The URDF, relative to the hand's file.
    pub(crate) file: String,
    /// The link that is the base frame; the root without it.
    #[serde(default)]
    pub(crate) base: Option<String>,
    /// Joints that are held still, and their angles, rad.
    #[serde(default)]
    pub(crate) locked_rad: BTreeMap<String, f64>,
    /// Prismatic joints that are held still, and where, m.
    #[serde(default)]
    pub(crate) locked_m: BTreeMap<String, f64>,
    /// Attributes of joints that are only placeholders in the URDF: [`IGNORABLE`].
    #[serde(default)]
    pub(crate) ignore: Vec<String>,
}

/// The values that can be ignored.
const IGNORABLE: [&str; 4] = ["effort", "velocity", "damping", "friction"];

impl Keys {
    /// The number of an attribute, unless it is to be ignored.
    pub(super) fn heeded(&self, attribute: &str, number: Option<f64>) -> Option<f64> {
        number.filter(|_| self.ignore.iter().all(|ignored| ignored != attribute))
    }

    /// Checks that everything that is to be ignored can be.
    pub(super) fn check(&self) -> Result<()> {
        match self.ignore.iter().position(|word| !IGNORABLE.contains(&word.as_str())) {
            None => Ok(()),
            Some(k) => fail(
                format!("urdf.ignore.{}", k + 1),
                format!("`{}` is unknown", self.ignore[k]),
                suggestion(&self.ignore[k], IGNORABLE),
            ),
        }
    }
}
