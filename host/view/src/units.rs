//! Units that read well.

/// The prefix for a unit in which `largest` reads well, and the factor that goes with it.
pub fn prefix(largest: f64) -> (&'static str, f64) {
    match largest {
        v if v > 0.0 && v < 1e-7 => ("n", 1e9),
        v if v > 0.0 && v < 1e-4 => ("µ", 1e6),
        v if v > 0.0 && v < 0.1 => ("m", 1e3),
        _ => ("", 1.0),
    }
}
