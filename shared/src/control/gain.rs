//! Gains, as tables and files know them.

/// A gain of a law, and the potential that is proportional to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gain {
    /// Its name in files, on the line and in tables, with its unit.
    pub key: &'static str,
    /// Its unit in words.
    pub unit: &'static str,
    /// Its meaning.
    pub words: &'static str,
    /// A file may leave it out by 0.
    pub may_be_zero: bool,
    /// The ramp that it follows when a grasp begins and ends.
    pub ramp: Ramp,
    /// The potential of what it is the gain of, J.
    pub potential: Signal,
}

impl Gain {
    /// Returns the gain as what the law tells each tick: the gain that acts.
    pub const fn signal(&self) -> Signal {
        Signal { key: self.key, unit: self.unit, words: self.words }
    }
}

/// A value that is told each tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signal {
    /// Its name in recordings and tables, with its unit.
    pub key: &'static str,
    /// Its unit in words; empty for a pure number.
    pub unit: &'static str,
    /// Its meaning.
    pub words: &'static str,
}

/// The ramp of a gain at the beginning and the end of a grasp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ramp {
    /// It grows over the soft start, so that fingers do not hammer the object, and falls over the release.
    Force,
    /// It is there at once, so that fingers do not roll away meanwhile, and falls over the release.
    Stiffness,
}
