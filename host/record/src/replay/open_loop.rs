//! The result of other parameters with the same counts: torques, limits and faults beside each other.

use super::report::{JointChange, LimitShare, OpenLoop, Raising};
use blindgrasp_shared::fault::Raised;
use blindgrasp_shared::limit::Limit;
use blindgrasp_shared::math::Real;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_wire::Record;

/// Faults that are listed; all are counted.
const LISTED: usize = 20;

/// The comparison so far.
#[derive(Clone, Debug)]
pub(super) struct Beside {
    joint_names: Vec<String>,
    ticks: u64,
    powered: u64,
    /// Sums of squared differences of the torque, (N m)^2.
    squares: Vec<f64>,
    largest: Vec<JointChange>,
    /// Ticks in which each limit acted on each joint, and on any: with the recorded and with the changed parameters.
    limited: [Vec<[u64; 2]>; Limit::ALL.len()],
    limited_any: [[u64; 2]; Limit::ALL.len()],
    /// In the tick before.
    faults: [Option<Raised>; 2],
    only_recorded: Faults,
    only_changed: Faults,
    other_mode: u64,
    other_answers: u64,
}

#[derive(Clone, Debug, Default)]
struct Faults {
    count: u64,
    first: Vec<Raising>,
}

impl Beside {
    pub(super) fn new(joint_names: &[String]) -> Self {
        let none = |name: &String| JointChange { joint: name.clone(), ..JointChange::default() };
        Self {
            joint_names: joint_names.to_vec(),
            ticks: 0,
            powered: 0,
            squares: vec![0.0; joint_names.len()],
            largest: joint_names.iter().map(none).collect(),
            limited: std::array::from_fn(|_| vec![[0; 2]; joint_names.len()]),
            limited_any: [[0; 2]; Limit::ALL.len()],
            faults: [None; 2],
            only_recorded: Faults::default(),
            only_changed: Faults::default(),
            other_mode: 0,
            other_answers: 0,
        }
    }

    /// Takes what the same tick computed twice.
    pub(super) fn add(&mut self, time_s: f64, recorded: &Record, changed: &Record) {
        self.ticks += 1;
        self.other_mode += u64::from(recorded.mode != changed.mode);
        self.other_answers += u64::from(recorded.answer != changed.answer);
        if !matches!(recorded.mode, Mode::Disarmed | Mode::Fault) {
            self.powered += 1;
            self.torques(time_s, recorded, changed);
        }
        for (side, record) in [recorded, changed].into_iter().enumerate() {
            for (limit, (any, joints)) in
                Limit::ALL.into_iter().zip(self.limited_any.iter_mut().zip(&mut self.limited))
            {
                let mut acted = false;
                for (count, limiting) in joints.iter_mut().zip(&record.limiting) {
                    let acts = limiting.contains(limit);
                    count[side] += u64::from(acts);
                    acted |= acts;
                }
                any[side] += u64::from(acted);
            }
        }
        self.raised(time_s, recorded, changed);
    }

    fn torques(&mut self, time_s: f64, recorded: &Record, changed: &Record) {
        let torques = recorded.torques_nm.iter().zip(&changed.torques_nm);
        for ((&recorded_nm, &changed_nm), (square, largest)) in
            torques.zip(self.squares.iter_mut().zip(&mut self.largest))
        {
            let difference_nm = f64::from(changed_nm) - f64::from(recorded_nm);
            *square += difference_nm * difference_nm;
            if difference_nm.abs() > largest.largest_nm {
                largest.largest_nm = difference_nm.abs();
                (largest.tick, largest.time_s) = (Some(recorded.tick), Some(time_s));
                (largest.recorded_nm, largest.changed_nm) = (recorded_nm, changed_nm);
            }
        }
    }

    /// Faults that begin on one side only.
    fn raised(&mut self, time_s: f64, recorded: &Record, changed: &Record) {
        let now = [recorded.fault, changed.fault];
        let begins = |side: usize| now[side].filter(|_| now[side] != self.faults[side]);
        let raising = |raised: Raised| Raising {
            tick: recorded.tick,
            time_s,
            fault: raised.fault.number(),
            joint: raised.joint.and_then(|joint| self.joint_names.get(usize::from(joint))).cloned(),
            words: raised.fault.words(),
        };
        let only = |side: usize| begins(side).filter(|_| now[0] != now[1]).map(raising);
        let (recorded, changed) = (only(0), only(1));
        self.only_recorded.add(recorded);
        self.only_changed.add(changed);
        self.faults = now;
    }

    /// The result.
    pub(super) fn finish(self, changes: Vec<String>, began_in_a_grasp: bool) -> OpenLoop {
        let share = |ticks: u64| if self.ticks == 0 { 0.0 } else { ticks as f64 / self.ticks as f64 };
        let shares = Limit::ALL.into_iter().zip(self.limited_any).zip(&self.limited);
        let limits = shares.map(|((limit, any), joints)| LimitShare {
            limit: limit.words(),
            recorded: share(any[0]),
            changed: share(any[1]),
            joints_recorded: joints.iter().map(|ticks| share(ticks[0])).collect(),
            joints_changed: joints.iter().map(|ticks| share(ticks[1])).collect(),
        });
        let mut joints = self.largest;
        for (joint, square) in joints.iter_mut().zip(&self.squares) {
            joint.rms_nm = if self.powered == 0 { 0.0 } else { (square / self.powered as f64).square_root() };
        }
        OpenLoop {
            note: OpenLoop::NOTE,
            changes,
            began_in_a_grasp,
            powered_ticks: self.powered,
            joints,
            limits: limits.collect(),
            faults_only_recorded: self.only_recorded.count,
            faults_only_changed: self.only_changed.count,
            first_only_recorded: self.only_recorded.first,
            first_only_changed: self.only_changed.first,
            ticks_of_another_mode: self.other_mode,
            other_answers: self.other_answers,
        }
    }
}

impl Faults {
    fn add(&mut self, raising: Option<Raising>) {
        self.count += u64::from(raising.is_some());
        self.first.extend(raising.filter(|_| self.first.len() < LISTED));
    }
}
