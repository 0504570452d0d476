//! Two devices that were told the same, compared bit for bit.

use blindgrasp_shared::signals::Value as Told;
use blindgrasp_wire::{Answer, Record, Turned};
use serde::Serialize;
use std::fmt;

/// A value that differed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Number of the tick; the grasp began at 0.
    pub tick: i64,
    /// The signal that differed.
    pub what: &'static str,
    /// The joint that it is of.
    pub joint: Option<String>,
    /// The firmware's value.
    pub device: Value,
    /// The host's value.
    pub host: Value,
}

/// A number with its bits, or anything else in words.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A number.
    Number {
        /// In decimals; not a number is `null` in JSON.
        value: f32,
        /// In hexadecimal bits.
        bits: String,
    },
    /// Anything else.
    Words(String),
}

impl Value {
    fn of(value: f32) -> Self {
        Self::Number { value, bits: format!("{:#010x}", value.to_bits()) }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number { value, bits } => write!(f, "{value:e} ({bits})"),
            Self::Words(words) => f.write_str(words),
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tick {}: {}", self.tick, self.what)?;
        if let Some(joint) = &self.joint {
            write!(f, " of joint `{joint}`")?;
        }
        write!(f, ": firmware {}, host {}", self.device, self.host)
    }
}

/// The comparison of a run.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Values of records and answers that differed so far.
    pub bits_differ: u64,
    /// The first of them.
    pub first_difference: Option<Difference>,
    joint_names: Vec<String>,
}

impl Comparison {
    /// Of a hand with these joints.
    pub fn new(joint_names: Vec<String>) -> Self {
        Self { joint_names, ..Self::default() }
    }

    /// From now on it is about a hand with these joints.
    pub(crate) fn rename(&mut self, joint_names: Vec<String>) {
        self.joint_names = joint_names;
    }

    /// Compares a tick. What only one of the two can know is left out: how long the tick took.
    pub fn add(&mut self, tick: i64, device: &Turned, host: &Turned) {
        let host_record =
            Record { cycles: device.record.cycles, dropped: device.record.dropped, ..host.record.clone() };
        self.records(tick, &device.record, &host_record);
        if !same_answer(device.answer.as_ref(), host.answer.as_ref()) {
            let (device, host) = (format!("{:?}", device.answer), format!("{:?}", host.answer));
            self.differs(tick, "answer to the request", None, Value::Words(device), Value::Words(host));
        }
    }

    /// Compares two records, with all that is in them; says whether they are the same.
    pub(crate) fn records(&mut self, tick: i64, device: &Record, host: &Record) -> bool {
        if same_bits(device, host) {
            return true;
        }
        let before = self.bits_differ;
        let mut told = Vec::new();
        device.tell(|signal| told.push(signal));
        let mut told = told.into_iter();
        host.tell(|host| {
            let Some(device) = told.next() else { return };
            self.signal(tick, host.signal.key, &device.value, &host.value);
        });
        self.bits_differ == before
    }

    /// Compares two values; floats by their bits.
    fn signal(&mut self, tick: i64, what: &'static str, device: &Told<'_>, host: &Told<'_>) {
        match (device, host) {
            (Told::Real(device), Told::Real(host)) => self.reals(tick, what, None, *device, *host),
            (Told::Reals(device), Told::Reals(host)) if device.len() == host.len() => {
                for (k, (&device, &host)) in device.iter().zip(*host).enumerate() {
                    self.reals(tick, what, Some(k), device, host);
                }
            }
            _ if device == host => {}
            _ => {
                let [device, host] = [device, host].map(|value| Value::Words(value.to_string()));
                self.differs(tick, what, None, device, host);
            }
        }
    }

    fn reals(&mut self, tick: i64, what: &'static str, joint: Option<usize>, device: f32, host: f32) {
        if device.to_bits() != host.to_bits() {
            self.differs(tick, what, joint, Value::of(device), Value::of(host));
        }
    }

    /// Counts a value that differs.
    pub(crate) fn differs(
        &mut self,
        tick: i64,
        what: &'static str,
        joint: Option<usize>,
        device: Value,
        host: Value,
    ) {
        self.bits_differ += 1;
        if self.first_difference.is_none() {
            let joint = joint.and_then(|joint| self.joint_names.get(joint)).cloned();
            self.first_difference = Some(Difference { tick, what, joint, device, host });
        }
    }
}

/// Returns `true` if two records are the same, where a float is its bits: on the wire it is nothing else.
fn same_bits(a: &Record, b: &Record) -> bool {
    let [mut first, mut second] = [[0; Record::MOST_BYTES]; 2];
    a.encode(&mut first).ok().as_deref() == b.encode(&mut second).ok().as_deref()
}

/// The identities are not compared, only the sessions.
fn same_answer(a: Option<&Answer>, b: Option<&Answer>) -> bool {
    match (a, b) {
        (Some(Answer::Value(a)), Some(Answer::Value(b))) => a.value.to_bits() == b.value.to_bits(),
        (Some(Answer::Identity { session: a, .. }), Some(Answer::Identity { session: b, .. })) => a == b,
        (a, b) => a == b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::command::{Command, Refusal};
    use blindgrasp_shared::fault::{Fault, Raised};
    use blindgrasp_shared::supervisor::Mode;
    use blindgrasp_shared::telemetry::List;

    fn turned(torques: [f32; 3]) -> Turned {
        let mut torques_nm = [0.0; blindgrasp_body::MAX_JOINTS];
        torques_nm[..3].copy_from_slice(&torques);
        let record = Record {
            sequence: 3,
            tick: 3,
            mode: Mode::Armed,
            decimation: 1,
            counts: List::first_of([0; blindgrasp_body::MAX_JOINTS], 3),
            torques_nm: List::first_of(torques_nm, 3),
            ..Record::BLANK
        };
        Turned { answer: None, record }
    }

    fn compare(device: &Turned, host: &Turned) -> Comparison {
        let mut comparison = Comparison::new(["a", "b", "c"].map(str::to_owned).to_vec());
        comparison.add(7, device, host);
        comparison
    }

    #[test]
    fn the_first_torque_that_differs_is_told_with_its_bits() {
        let device = turned([0.5, 1.0, -2.0]);
        let host = turned([0.5, f32::from_bits(0x3f80_0001), 2.0]);
        let comparison = compare(&device, &host);
        assert_eq!(comparison.bits_differ, 2);
        let difference = comparison.first_difference.unwrap();
        assert_eq!(
            difference.to_string(),
            "tick 7: torque_nm of joint `b`: firmware 1e0 (0x3f800000), host 1.0000001e0 (0x3f800001)"
        );
        let json = serde_json::to_value(&difference).unwrap();
        assert_eq!(json["joint"], "b");
        assert_eq!(json["device"]["bits"], "0x3f800000");
    }

    #[test]
    fn zeros_of_both_signs_differ_and_equal_nans_do_not() {
        assert_eq!(compare(&turned([0.0, 0.0, 0.0]), &turned([0.0, -0.0, 0.0])).bits_differ, 1);
        let nan = turned([f32::NAN, 0.0, 0.0]);
        assert_eq!(compare(&nan, &nan.clone()).bits_differ, 0);
    }

    #[test]
    fn everything_but_the_time_that_a_tick_took_is_compared() {
        let host = turned([0.0; 3]);
        let mut device = host.clone();
        device.record.cycles = 12_000;
        device.record.dropped = 1;
        assert_eq!(compare(&device, &host).bits_differ, 0);
        type Change = fn(&mut Turned);
        let changes: [(&str, Change); 11] = [
            ("mode", |t| t.record.mode = Mode::Fault),
            ("fault", |t| t.record.fault = Some(Raised::of_hand(Fault::LinkLost))),
            ("answer", |t| {
                t.record.answer =
                    Some(blindgrasp_shared::command::Answer { command: Command::Arm, refused: None });
            }),
            ("reading_failed", |t| t.record.reading_failed = Some(Raised::of_hand(Fault::SampleMissing))),
            ("tick", |t| t.record.tick += 1),
            ("decimation", |t| t.record.decimation = 2),
            ("sequence", |t| t.record.sequence += 1),
            ("count", |t| t.record.counts = List::first_of([1; blindgrasp_body::MAX_JOINTS], 3)),
            ("torque_nm", |t| t.record.torques_nm = List::default()),
            ("damped_j", |t| t.record.damped_j = 1e-30),
            ("answer to the request", |t| t.answer = Some(Answer::Refused(Refusal::Busy))),
        ];
        for (what, change) in changes {
            let mut device = host.clone();
            change(&mut device);
            let comparison = compare(&device, &host);
            assert_eq!(comparison.bits_differ, 1, "{what}");
            assert_eq!(comparison.first_difference.unwrap().what, what);
        }
    }
}
