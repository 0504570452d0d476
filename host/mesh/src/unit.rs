//! Units of length. Mesh files don't say theirs.

use nalgebra::Vector3;

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Metres.
    Metre,
    /// Centimetres.
    Centimetre,
    /// Millimetres.
    Millimetre,
    /// Inches.
    Inch,
}

impl Unit {
    /// All of them, the most usual first.
    pub const ALL: [Self; 4] = [Self::Millimetre, Self::Centimetre, Self::Metre, Self::Inch];

    /// The word for it, in files and on the command line.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Inch => "in",
        }
    }

    /// The unit that a word stands for.
    pub fn of(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.word() == word)
    }

    /// A length in metres. Divided rather than multiplied, so that 57 mm are 0.057 m to the last bit.
    pub fn metres(self, length: f64) -> f64 {
        match self {
            Self::Metre => length,
            Self::Centimetre => length / 100.0,
            Self::Millimetre => length / 1000.0,
            Self::Inch => length * 0.0254,
        }
    }

    /// Returns the size of something in each unit, for whoever has to choose one.
    pub fn choices(size: &Vector3<f64>, how: impl Fn(&str) -> String) -> String {
        let choices = Self::ALL.map(|unit| {
            let [x, y, z] = [size.x, size.y, size.z].map(|length| short(unit.metres(length) * 1e3));
            format!("{} if it measures {x} x {y} x {z} mm", how(unit.word()))
        });
        format!("add {}", choices.join(", "))
    }
}

/// Four digits.
fn short(value: f64) -> String {
    if !(1e-3..1e7).contains(&value) {
        return format!("{value:.3e}");
    }
    let digits = (3 - value.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
