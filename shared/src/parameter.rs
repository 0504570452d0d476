//! Names of parameters, and what is said of one that can't be used. Every group of parameters is checked once, before
//! the first tick.

use core::fmt;

/// Two pieces of text, one behind the other: so a table derives a name from another's, without a heap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text {
    prefix: &'static str,
    rest: &'static str,
}

impl Text {
    /// Returns one piece behind another.
    pub const fn new(prefix: &'static str, rest: &'static str) -> Self {
        Self { prefix, rest }
    }

    /// Returns a text of one piece.
    pub const fn plain(text: &'static str) -> Self {
        Self::new("", text)
    }

    /// Returns its hash, FNV-1a of 32 bits.
    pub const fn hash(self) -> u32 {
        let mut hash = 0x811C_9DC5_u32;
        let (prefix, rest) = (self.prefix.as_bytes(), self.rest.as_bytes());
        let mut k = 0;
        while k < prefix.len() + rest.len() {
            let byte = if k < prefix.len() { prefix[k] } else { rest[k - prefix.len()] };
            hash = (hash ^ byte as u32).wrapping_mul(0x0100_0193);
            k += 1;
        }
        hash
    }
}

impl From<&'static str> for Text {
    fn from(text: &'static str) -> Self {
        Self::plain(text)
    }
}

impl PartialEq<str> for Text {
    fn eq(&self, other: &str) -> bool {
        other.strip_prefix(self.prefix) == Some(self.rest)
    }
}

impl PartialEq<&str> for Text {
    fn eq(&self, other: &&str) -> bool {
        *self == **other
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.prefix)?;
        f.write_str(self.rest)
    }
}

/// The thing that has a value of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Each {
    /// Nothing: there is one, with index 0.
    Hand,
    /// The joints.
    Joint,
    /// The axes x, y, z.
    Axis,
}

/// A parameter that can't be used, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterError {
    /// The parameter.
    pub parameter: Text,
    /// The joint that it belongs to, if it belongs to one.
    pub joint: Option<usize>,
    /// The requirement.
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
