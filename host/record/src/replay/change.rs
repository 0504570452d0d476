//! Parameters that a replay is to have otherwise: `KEY=VALUE`, as the user types them.

use blindgrasp_body::MAX_JOINTS;
use blindgrasp_model::suggestion;
use blindgrasp_shared::command::Refusal;
use blindgrasp_shared::parameters::{Each, Parameter};
use blindgrasp_shared::tick::Config;
use std::str::FromStr;

/// Names of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// A parameter with the value that it is to have.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    parameter: Parameter,
    which: Which,
    /// `None`: what the parameter belongs to is switched off.
    value: Option<f32>,
    /// As it was typed.
    text: String,
}

/// Of which joint or axis.
#[derive(Clone, Debug, PartialEq)]
enum Which {
    All,
    Index(u8),
    Name(String),
}

/// An error in a change.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text}: {problem}; {remedy}")]
pub struct ChangeError {
    text: String,
    problem: String,
    remedy: String,
}

impl FromStr for Change {
    type Err = ChangeError;

    /// `KEY=VALUE` for all joints or axes, `KEY[INDEX]=VALUE` or `KEY.NAME=VALUE` for one, counted from 0; the value `off`
    /// switches a limit or a fault off.
    fn from_str(text: &str) -> Result<Self, ChangeError> {
        let fail = |problem: String, remedy: String| Err(ChangeError { text: text.into(), problem, remedy });
        let Some((key, value)) = text.split_once('=').map(|(key, value)| (key.trim(), value.trim())) else {
            return fail("no value".into(), "write KEY=VALUE".into());
        };
        let Some((parameter, rest)) = parameter(key) else {
            let keys = Parameter::ALL.map(|parameter| parameter.to_string());
            let bare = key.split('[').next().unwrap_or(key);
            let keys = keys.iter().map(String::as_str);
            return fail(format!("`{key}` is not a parameter"), suggestion(bare, keys));
        };
        let which = match rest.strip_prefix('.') {
            _ if rest.is_empty() => Which::All,
            Some(name) => Which::Name(name.to_owned()),
            None => match rest.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).map(str::parse) {
                Some(Ok(index)) => Which::Index(index),
                _ => return fail(format!("`{rest}` is not an index"), "write [0] for the first".into()),
            },
        };
        if which != Which::All && parameter.each() == Each::Hand {
            return fail(format!("there is one `{parameter}`"), format!("leave out `{rest}`"));
        }
        let value = match value {
            "off" => None,
            _ => match value.parse::<f32>() {
                Ok(value) if value.is_finite() => Some(value),
                _ => return fail(format!("`{value}` is not a finite number"), "give one, or off".into()),
            },
        };
        Ok(Self { parameter, which, value, text: text.to_owned() })
    }
}

/// The parameter that a key begins with, and the rest of the key.
fn parameter(key: &str) -> Option<(Parameter, &str)> {
    Parameter::ALL.into_iter().find_map(|parameter| {
        let rest = key.strip_prefix(&parameter.to_string())?;
        (rest.is_empty() || rest.starts_with(['.', '['])).then_some((parameter, rest))
    })
}

impl Change {
    /// Returns `true` if it acts only on grasps that begin after it.
    pub(super) fn is_of_the_grasp(&self) -> bool {
        self.parameter.is_gain()
    }

    /// Puts it into a configuration, without looking at the others.
    pub(super) fn apply(
        &self,
        config: &mut Config<MAX_JOINTS>,
        joint_names: &[String],
    ) -> Result<(), ChangeError> {
        let names: Vec<&str> = match self.parameter.each() {
            Each::Hand => vec![""],
            Each::Joint => joint_names.iter().map(String::as_str).collect(),
            Each::Axis => AXES.to_vec(),
        };
        let fail =
            |problem: String, remedy: String| Err(ChangeError { text: self.text.clone(), problem, remedy });
        let indices = match &self.which {
            Which::All => 0..names.len(),
            Which::Index(index) if usize::from(*index) < names.len() => {
                usize::from(*index)..usize::from(*index) + 1
            }
            Which::Index(index) => {
                return fail(
                    format!("there is no [{index}]"),
                    format!("it goes from 0 to {}", names.len() - 1),
                );
            }
            Which::Name(name) => match names.iter().position(|known| known == name) {
                Some(index) => index..index + 1,
                None => return fail(format!("there is no `{name}`"), suggestion(name, names)),
            },
        };
        for index in indices {
            match config.put(joint_names.len(), self.parameter, index as u8, self.value) {
                Ok(()) => {}
                Err(Refusal::OutOfRange) if self.value.is_none() => {
                    return fail("it can't be switched off".into(), "give it a value".into());
                }
                Err(refusal) => return fail(refusal.words().into(), self.parameter.words().to_string()),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_model::HandModel;

    fn changed(texts: &[&str]) -> Result<Config<MAX_JOINTS>, String> {
        let hand = HandModel::load("three-finger").unwrap();
        let mut config = hand.config;
        for text in texts {
            let change: Change = text.parse().map_err(|error: ChangeError| error.to_string())?;
            change.apply(&mut config, &hand.joint_names).map_err(|error| error.to_string())?;
        }
        Ok(config)
    }

    #[test]
    fn one_joint_by_number_or_name_or_all() {
        let before = changed(&[]).unwrap();
        let config = changed(&["damping_nm_s = 0.25"]).unwrap();
        assert_eq!(config.laws.hold.damping_nm_s[..12], [0.25; 12]);
        assert_eq!(config.laws.hold.damping_nm_s[12..], [0.0; 12]);
        let config = changed(&["limits.torque_nm[1]=0.5", "limits.torque_nm.finger-1-abduct=0.75"]).unwrap();
        let (limits, others) = (config.limits.torque_nm.unwrap(), before.limits.torque_nm.unwrap());
        assert_eq!(limits[..2], [0.75, 0.5]);
        assert_eq!(limits[2..], others[2..]);
        let config = changed(&["gravity_m_s2.x=1", "gravity_m_s2[1]=2"]).unwrap();
        assert_eq!(config.laws.hold.gravity_m_s2.unwrap().as_slice()[..2], [1.0, 2.0]);
        assert_eq!(changed(&["limits.slew_nm_s=off"]).unwrap().limits.slew_nm_s, None);
        assert_eq!(changed(&["faults.heartbeat_ms=100"]).unwrap().faults.heartbeat_ms, Some(100));
    }

    #[test]
    fn what_is_wrong_is_told_with_a_remedy() {
        for (text, told) in [
            ("damping_nm_s", "no value; write KEY=VALUE"),
            ("dampng_nm_s=1", "`dampng_nm_s` is not a parameter; did you mean `damping_nm_s`?"),
            ("dampng_nm_s[3]=1", "did you mean `damping_nm_s`?"),
            ("force_n[0]=1", "there is one `force_n`; leave out `[0]`"),
            ("force_n=off", "it can't be switched off"),
            ("force_n=much", "`much` is not a finite number"),
            ("force_n=NaN", "`NaN` is not a finite number"),
            ("damping_nm_s[12]=1", "there is no [12]; it goes from 0 to 11"),
            ("damping_nm_s[a]=1", "`[a]` is not an index"),
            ("damping_nm_s.finger-1-abdct=1", "did you mean `finger-1-abduct`?"),
            ("faults.heartbeat_ms=1.5", "out of its range"),
        ] {
            let error = changed(&[text]).unwrap_err();
            assert!(error.starts_with(text) && error.contains(told), "{error}");
        }
    }
}
