//! What is said of a parameter that can't be used. Every group of parameters is checked once, before the first tick.

use core::fmt;

/// A parameter that can't be used, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterError {
    /// The parameter.
    pub parameter: &'static str,
    /// The joint that it belongs to, if it belongs to one.
    pub joint: Option<usize>,
    /// What it has to be.
    pub reason: &'static str,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.joint {
            Some(joint) => write!(f, "{} of joint {joint} {}", self.parameter, self.reason),
            None => write!(f, "{} {}", self.parameter, self.reason),
        }
    }
}

impl core::error::Error for ParameterError {}
