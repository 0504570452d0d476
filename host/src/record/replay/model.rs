//! The controller of a recording: its hand, and the parameters in force.

use super::ReplayError;
use super::change::Change;
use crate::record::mcap::{About, Setting};
use crate::scene::HandModel;
use crate::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_shared::hand::Hand;
use blindgrasp_shared::tick::{Config, Params};

/// The parameters of a controller of any hand.
pub(super) type AnyParams = Params<f32, MAX_JOINTS, MAX_FINGERS>;

/// A hand, as its firmware has it.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub(super) name: String,
    pub(super) hash: u32,
    pub(super) joint_names: Vec<String>,
    hand: Hand<f32, MAX_JOINTS, MAX_FINGERS>,
    /// The configuration that the firmware starts with.
    config: Config<f32, MAX_JOINTS>,
}

impl Model {
    /// The hand of a session: the recorded one, or another that the user has given.
    pub(super) fn new(about: &About, given: Option<&HandModel>) -> Result<Self, ReplayError> {
        let hand = match (given, &about.hand_file) {
            (Some(given), _) => given.clone(),
            (None, Some(text)) => {
                HandModel::parse(text, "hand of the recording").map_err(ReplayError::Hand)?
            }
            (None, None) => {
                return Err(ReplayError::UnknownHand { hand: about.hand.clone(), hash: about.hand_hash });
            }
        };
        let hash = hand.hash();
        if hash != about.hand_hash {
            let recorded = format!("`{}` ({:08x})", about.hand, about.hand_hash);
            return Err(ReplayError::OtherHand { recorded, found: format!("`{}` ({hash:08x})", hand.name) });
        }
        let mut config = hand.config;
        config.period_us = about.period_us;
        Ok(Self { name: hand.name, hash, joint_names: hand.joint_names, hand: hand.hand.cast(), config })
    }

    /// A configuration, or the one that the firmware starts with, with recorded parameters.
    pub(super) fn config(
        &self,
        before: Option<&Config<f32, MAX_JOINTS>>,
        settings: &[Setting],
    ) -> Result<Config<f32, MAX_JOINTS>, ReplayError> {
        let mut config = *before.unwrap_or(&self.config);
        for &Setting { parameter, index, value } in settings {
            let put = config.put(self.joint_names.len(), parameter, index, value);
            put.map_err(|refusal| ReplayError::Setting { parameter, index, reason: refusal.words() })?;
        }
        Ok(config)
    }

    /// A controller of this configuration.
    pub(super) fn params(&self, config: &Config<f32, MAX_JOINTS>) -> Result<AnyParams, ReplayError> {
        Params::new(self.hand.clone(), config).map_err(ReplayError::Parameters)
    }

    /// A controller of this configuration, changed.
    pub(super) fn changed(
        &self,
        config: &Config<f32, MAX_JOINTS>,
        changes: &[Change],
    ) -> Result<AnyParams, ReplayError> {
        let mut config = *config;
        changes.iter().try_for_each(|change| change.apply(&mut config, &self.joint_names))?;
        Params::new(self.hand.clone(), &config).map_err(ReplayError::Changed)
    }
}
