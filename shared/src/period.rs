//! The tick period. Time is counted in whole ticks: a float that counts seconds stops advancing after some hours.

use crate::parameter::ParameterError;
use core::num::NonZeroU32;

/// Longest time that a setting may name, ms: an hour.
const LONGEST_MS: u32 = 3_600_000;

/// Time from one tick to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Period {
    microseconds: NonZeroU32,
}

impl Period {
    /// Checks a period, us.
    ///
    /// # Errors
    /// A period below 100 us or above 100 ms.
    pub fn from_us(microseconds: u32) -> Result<Self, ParameterError> {
        match NonZeroU32::new(microseconds) {
            Some(microseconds) if (100..=100_000).contains(&microseconds.get()) => Ok(Self { microseconds }),
            _ => {
                let reason = "has to be from 100 to 100000";
                Err(ParameterError { parameter: "period_us".into(), joint: None, reason })
            }
        }
    }

    /// The period, us.
    pub fn microseconds(self) -> u32 {
        self.microseconds.get()
    }

    /// The period, s.
    pub fn seconds(self) -> f32 {
        self.microseconds() as f32 / 1_000_000.0
    }

    /// Ticks that a time in ms takes, rounded up.
    ///
    /// # Errors
    /// A time above an hour; `parameter` is what the error names.
    pub fn ticks(self, milliseconds: u32, parameter: &'static str) -> Result<u32, ParameterError> {
        if milliseconds > LONGEST_MS {
            return Err(ParameterError {
                parameter: parameter.into(),
                joint: None,
                reason: "has to be at most an hour (3600000)",
            });
        }
        // Not `div_ceil`, which asks a divisor that can't be zero whether it is.
        let whole = milliseconds * 1000 / self.microseconds;
        Ok(whole + u32::from(milliseconds * 1000 % self.microseconds != 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_whole_ticks_rounded_up() {
        let period = Period::from_us(1000).unwrap();
        assert_eq!(period.ticks(0, "t"), Ok(0));
        assert_eq!(period.ticks(250, "t"), Ok(250));
        assert_eq!(period.seconds(), 1e-3);
        let period = Period::from_us(300).unwrap();
        assert_eq!(period.ticks(1, "t"), Ok(4));
        assert_eq!(period.ticks(LONGEST_MS, "t"), Ok(12_000_000));
    }

    #[test]
    fn impossible_times_are_refused() {
        for period in [0, 99, 100_001, u32::MAX] {
            assert_eq!(Period::from_us(period).unwrap_err().parameter, "period_us");
        }
        let error = Period::from_us(1000).unwrap().ticks(LONGEST_MS + 1, "release_ms").unwrap_err();
        assert_eq!(error.parameter, "release_ms");
    }
}
