//! The report of a replay, as JSON and in words.

use super::{Gap, Reason};
use crate::compare::Difference;
use serde::{Serialize, Serializer};
use std::fmt;

/// The report of a replay.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The device.
    pub device: String,
    /// Its hand.
    pub hand: String,
    /// Ticks that were computed again and compared.
    pub ticks: u64,
    /// Values in their records that differ.
    pub bits_differ: u64,
    /// The first of them; times are since the beginning of the recording.
    pub first_difference: Option<Difference>,
    /// Records that could not be compared, because the state before them is not known.
    pub not_replayed: u64,
    /// Ticks whose records are missing.
    pub missing: u64,
    /// Snapshots of the device's whole state that were compared, too; what differs in them is counted above.
    pub snapshots: u64,
    /// The places where something is missing, or was not replayed: the first of them.
    pub gaps: Vec<Gap>,
    /// All of them.
    pub gap_count: u64,
    /// The result of other parameters.
    pub open_loop: Option<OpenLoop>,
    /// The damage of the file; what could be read was replayed.
    pub damage: Option<String>,
}

/// The result of other parameters with the recorded counts.
#[derive(Clone, Debug, Serialize)]
pub struct OpenLoop {
    /// [`Self::NOTE`].
    pub note: &'static str,
    /// The changes.
    pub changes: Vec<String>,
    /// `true` if force or stiffness were changed and a part of the recording begins within a grasp, whose force and
    /// stiffness are those that it began with.
    pub began_in_a_grasp: bool,
    /// Ticks in which the recorded hand had torque: what the differences of torques are taken over.
    pub powered_ticks: u64,
    /// Differences of the torques.
    pub joints: Vec<JointChange>,
    /// Shares of all ticks in which each limit acted.
    pub limits: Vec<LimitShare>,
    /// Faults that were raised and would not have been.
    pub faults_only_recorded: u64,
    /// Faults that would have been raised and were not.
    pub faults_only_changed: u64,
    /// The first of those that would not have been raised.
    pub first_only_recorded: Vec<Raising>,
    /// The first of those that would have been raised.
    pub first_only_changed: Vec<Raising>,
    /// Ticks in which the hand would have been in another mode.
    pub ticks_of_another_mode: u64,
    /// Commands that would have been answered otherwise.
    pub other_answers: u64,
}

impl OpenLoop {
    /// The worth of the comparison.
    pub const NOTE: &'static str = "open loop: the counts are the recorded ones; with these parameters the hand would have moved otherwise";
}

/// The change of the torque of a joint.
#[derive(Clone, Debug, Default, Serialize)]
pub struct JointChange {
    /// Its name.
    pub joint: String,
    /// Root of the mean square of the difference, N m.
    pub rms_nm: f64,
    /// The largest difference, N m.
    pub largest_nm: f64,
    /// Its tick.
    pub tick: Option<u32>,
    /// Its time since the beginning of the recording, s.
    pub time_s: Option<f64>,
    /// The recorded torque there, N m.
    pub recorded_nm: f32,
    /// The other one, N m.
    pub changed_nm: f32,
}

/// The share of ticks in which a limit acted.
#[derive(Clone, Debug, Serialize)]
pub struct LimitShare {
    /// The limit.
    pub limit: &'static str,
    /// Share of the ticks in which it acted on any joint.
    pub recorded: f64,
    /// The same with the changed parameters.
    pub changed: f64,
    /// Share of each joint.
    pub joints_recorded: Vec<f64>,
    /// The same with the changed parameters.
    pub joints_changed: Vec<f64>,
}

/// A fault where it begins.
#[derive(Clone, Debug, Serialize)]
pub struct Raising {
    /// Number of the tick.
    pub tick: u32,
    /// Time since the beginning of the recording, s.
    pub time_s: f64,
    /// Number of the fault.
    pub fault: u8,
    /// Its joint.
    pub joint: Option<String>,
    /// In words.
    pub words: &'static str,
}

impl Serialize for Reason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut line = |name: &str, value: &dyn fmt::Display| writeln!(f, "{name:<22}{value}");
        line("device", &format_args!("{}, hand {}", self.device, self.hand))?;
        line("ticks", &self.ticks)?;
        match &self.first_difference {
            None => line("bits", &"none differs")?,
            Some(first) => {
                let Difference { tick, what, joint, device, host } = first;
                let joint = joint.as_ref().map_or(String::new(), |joint| format!(" of joint `{joint}`"));
                let first =
                    format!("first in tick {tick}: {what}{joint}: recorded {device}, replayed {host}");
                line("bits", &format_args!("{} values DIFFER; {first}", self.bits_differ))?;
            }
        }
        line("whole states", &format_args!("{} compared", self.snapshots))?;
        line("not replayed", &format_args!("{} records", self.not_replayed))?;
        line("missing", &format_args!("{} ticks", self.missing))?;
        for gap in &self.gaps {
            line("  gap", gap)?;
        }
        if self.gap_count > self.gaps.len() as u64 {
            line("  gaps", &format_args!("{} more", self.gap_count - self.gaps.len() as u64))?;
        }
        if let Some(damage) = &self.damage {
            line("file", damage)?;
        }
        match &self.open_loop {
            Some(open_loop) => write!(f, "\n{open_loop}"),
            None => Ok(()),
        }
    }
}

impl fmt::Display for Gap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "at {:.3} s, ticks {} to {}: {}",
            self.time_s, self.from_tick, self.until_tick, self.reason
        )?;
        write!(f, " ({} missing, {} not replayed)", self.missing, self.not_replayed)
    }
}

impl fmt::Display for OpenLoop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} ({})", self.changes.join(", "), Self::NOTE)?;
        if self.began_in_a_grasp {
            writeln!(
                f,
                "force and stiffness act from the next grasp on: the recording, or what follows a gap, begins within one"
            )?;
        }
        writeln!(f, "torque, N m, over {} ticks", self.powered_ticks)?;
        writeln!(
            f,
            "  {:<20}{:>11}{:>11}{:>12}{:>11}{:>11}",
            "joint", "rms", "largest", "at, s", "recorded", "changed"
        )?;
        for joint in &self.joints {
            let time = joint.time_s.map_or("-".to_owned(), |s| format!("{s:.3}"));
            let JointChange { joint, rms_nm, largest_nm, recorded_nm, changed_nm, .. } = joint;
            write!(f, "  {joint:<20}{rms_nm:>11.3e}{largest_nm:>11.3e}{time:>12}")?;
            writeln!(f, "{recorded_nm:>11.4}{changed_nm:>11.4}")?;
        }
        writeln!(
            f,
            "share of ticks in which a limit acted, %\n  {:<20}{:>11}{:>11}",
            "limit", "recorded", "changed"
        )?;
        for LimitShare { limit, recorded, changed, .. } in &self.limits {
            writeln!(f, "  {limit:<20}{:>11.3}{:>11.3}", 1e2 * recorded, 1e2 * changed)?;
        }
        let mut faults = |words: &str, count: u64, first: &[Raising]| {
            writeln!(f, "{count} {words}")?;
            first.iter().try_for_each(|raising| {
                let joint =
                    raising.joint.as_ref().map_or(String::new(), |joint| format!("joint `{joint}`: "));
                let Raising { time_s, tick, fault, words, .. } = raising;
                writeln!(f, "  at {time_s:.3} s, tick {tick}: fault {fault}: {joint}{words}")
            })
        };
        faults(
            "faults raised that would not have been",
            self.faults_only_recorded,
            &self.first_only_recorded,
        )?;
        faults("faults that would have been raised", self.faults_only_changed, &self.first_only_changed)?;
        writeln!(f, "{} ticks would have been in another mode", self.ticks_of_another_mode)?;
        writeln!(f, "{} commands would have been answered otherwise", self.other_answers)
    }
}
