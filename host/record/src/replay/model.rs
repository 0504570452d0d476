//! The controller of a recording: its hand, and the parameters in force.

use super::ReplayError;
use super::change::Change;
use crate::mcap::{About, Setting};
use blindgrasp_body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_model::HandModel;
use blindgrasp_shared::tick::{Config, Params};

/// The parameters of a controller of any hand.
pub(super) type AnyParams = Params<MAX_JOINTS, MAX_FINGERS>;

/// A hand, as its firmware has it.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub(super) name: String,
    pub(super) hash: u32,
    pub(super) joint_names: Vec<String>,
    hand: HandModel,
    /// The configuration that the firmware starts with.
    config: Config<MAX_JOINTS>,
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
                return Err(ReplayError::UnknownHand(about.hand.clone(), about.hand_hash));
            }
        };
        let hash = hand.hash();
        if hash != about.hand_hash {
            let recorded = format!("`{}` ({:08x})", about.hand, about.hand_hash);
            return Err(ReplayError::OtherHand(recorded, format!("`{}` ({hash:08x})", hand.name)));
        }
        let mut config = hand.config;
        config.period_us = about.period_us;
        let (name, joint_names) = (hand.name.clone(), hand.joint_names.clone());
        Ok(Self { name, hash, joint_names, hand, config })
    }

    /// A configuration, or the one that the firmware starts with, with recorded parameters.
    pub(super) fn config(
        &self,
        before: Option<&Config<MAX_JOINTS>>,
        settings: &[Setting],
    ) -> Result<Config<MAX_JOINTS>, ReplayError> {
        let mut config = *before.unwrap_or(&self.config);
        for &Setting { parameter, index, value } in settings {
            let put = config.put(self.joint_names.len(), parameter, index, value);
            put.map_err(|refusal| ReplayError::Setting(parameter, index, refusal.words()))?;
        }
        Ok(config)
    }

    /// A controller of this configuration.
    pub(super) fn params(&self, config: &Config<MAX_JOINTS>) -> Result<AnyParams, ReplayError> {
        self.hand.params(config).map_err(ReplayError::Parameters)
    }

    /// A controller of this configuration, changed.
    pub(super) fn changed(
        &self,
        config: &Config<MAX_JOINTS>,
        changes: &[Change],
    ) -> Result<AnyParams, ReplayError> {
        let mut config = *config;
        changes.iter().try_for_each(|change| change.apply(&mut config, &self.joint_names))?;
        self.hand.params(&config).map_err(ReplayError::Changed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_model::HandFile;
    use blindgrasp_shared::fault::FaultConfig;
    use blindgrasp_shared::identity::{Clock, Identity, Image};
    use blindgrasp_shared::limit::LimitConfig;
    use blindgrasp_shared::telemetry::INTERFACE_VERSION;

    #[test]
    fn any_configuration_comes_back_from_its_parameters() {
        let model = HandModel::load("three-finger").unwrap();
        let file = HandFile::load("three-finger").unwrap();
        let image = Image {
            interface_version: INTERFACE_VERSION,
            kind: "hand",
            hand: &model.name,
            hand_hash: model.hash(),
            firmware_version: "0.1.0",
            build_hash: 1,
            joint_count: 12,
            fingertip_count: 3,
            period_us: 1000,
        };
        let about = About::of(&Identity::of(image, Clock::External)).with_hand(&file);
        let recorded = Model::new(&about, None).unwrap();
        let mut configs = vec![model.config];
        // Everything that can be switched is on in the hand's file: off, in turns.
        let change = |change: fn(&mut Config<MAX_JOINTS>)| {
            let mut config = model.config;
            config.laws.gains.grasp[0] = 4.0;
            config.laws.hold.damping_nm_s[7] = 0.125;
            config.faults.heartbeat_ms = Some(77);
            change(&mut config);
            config
        };
        configs.push(change(|_| {}));
        configs.push(change(|config| config.limits = LimitConfig::NONE));
        configs.push(change(|config| config.faults = FaultConfig::LEAST));
        configs.push(change(|config| config.laws.hold.gravity_m_s2 = None));
        for config in &configs {
            let settings = Setting::all(&recorded.params(config).unwrap());
            for before in [None, Some(&configs[2]), Some(&configs[3])] {
                assert_eq!(recorded.config(before, &settings).unwrap(), *config);
            }
        }
        let other = About { hand_hash: 1, ..about.clone() };
        assert!(matches!(Model::new(&other, None), Err(ReplayError::OtherHand(..))));
        let unknown = About { hand_file: None, ..about };
        assert!(matches!(Model::new(&unknown, None), Err(ReplayError::UnknownHand(..))));
        assert!(Model::new(&unknown, Some(&model)).is_ok());
    }
}
