//! Ranges of joints.

use super::super::found::Found;
use super::super::specimen::Specimen;
use crate::inspect::finding::Severity;

/// A joint that turns by less is a fixed one, or was written in turns, rad.
const LEAST_RANGE_RAD: f64 = 0.02;

/// The counters of a real hand start at zero where its joints are when the board is switched on, and its zero is where the
/// fingers are stretched (docs/bring-up.md): a joint that can't be at zero needs another way to find it.
pub(in super::super) fn zero(specimen: &Specimen, found: &mut Found) {
    for k in 0..specimen.joints() {
        let (lower, upper) = specimen.hand.range_rad(k);
        if found.trusts_joint(specimen, k, "limits_rad") && !(lower <= 0.0 && upper >= 0.0) {
            let what = format!("its limits [{lower}, {upper}] leave out zero, where its counter is set");
            let remedy = "if it was meant, set the counter at an angle of this joint that is known";
            found.push(specimen.on_joint(Severity::Notice, (k, "limits_rad"), what, remedy));
        }
    }
}

/// Hardly any range.
pub(in super::super) fn narrow(specimen: &Specimen, found: &mut Found) {
    for k in 0..specimen.joints() {
        let (lower, upper) = specimen.hand.range_rad(k);
        if found.trusts_joint(specimen, k, "limits_rad") && upper - lower < LEAST_RANGE_RAD {
            let what = format!("turns by {:.2e} rad only", upper - lower);
            let remedy =
                "write radians; leave out a joint that does not turn, and add its link to its parent's";
            found.push(specimen.on_joint(Severity::Warning, (k, "limits_rad"), what, remedy));
        }
    }
}
