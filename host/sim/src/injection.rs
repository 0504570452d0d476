//! Faults that can be injected into a run, between the plant and the controller.

use super::controller::Reach;
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_shared::fault::Raised;

/// Something that goes wrong, from a tick on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Injection {
    /// Number of the tick; the grasp begins at 0.
    pub at_tick: u64,
    /// The fault.
    pub kind: Kind,
}

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A counter keeps its count from then on.
    CounterFrozen {
        /// The joint.
        joint: usize,
    },
    /// A counter is off from then on.
    CounterJump {
        /// The joint.
        joint: usize,
        /// By so much.
        counts: i32,
    },
    /// The joints can't be read or driven from then on, for this reason.
    ReadingLost(Raised),
    /// Every tick misses its deadline from then on.
    LateTicks,
    /// The host gives no sign of life from then on; its commands still arrive.
    HeartbeatStops,
    /// Nothing that the host says arrives from then on.
    LinkCut,
}

impl Kind {
    /// The joint that it happens to.
    pub(super) fn joint(self) -> Option<usize> {
        match self {
            Self::CounterFrozen { joint } | Self::CounterJump { joint, .. } => Some(joint),
            Self::ReadingLost(raised) => raised.joint.map(usize::from),
            Self::LateTicks | Self::HeartbeatStops | Self::LinkCut => None,
        }
    }
}

/// The sensing of the hand in a tick, as the controller gets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sensing {
    pub(super) counts: [i32; MAX_JOINTS],
    pub(super) failed: Option<Raised>,
    pub(super) late: bool,
    pub(super) reach: Reach,
}

/// The injections of a run, and what they have to remember.
#[derive(Clone, Debug, Default)]
pub(super) struct Injections {
    list: Vec<Injection>,
    /// The count of each frozen counter.
    frozen: [Option<i32>; MAX_JOINTS],
}

impl Injections {
    pub(super) fn push(&mut self, injection: Injection) {
        self.list.push(injection);
    }

    /// Does to a tick what is due.
    pub(super) fn apply(&mut self, tick: u64, sensing: &mut Sensing) {
        for injection in self.list.iter().filter(|injection| injection.at_tick <= tick) {
            match injection.kind {
                Kind::CounterFrozen { joint } => {
                    let count = &mut sensing.counts[joint];
                    *count = *self.frozen[joint].get_or_insert(*count);
                }
                Kind::CounterJump { joint, counts } => {
                    sensing.counts[joint] = sensing.counts[joint].wrapping_add(counts);
                }
                Kind::ReadingLost(raised) => sensing.failed = Some(raised),
                Kind::LateTicks => sensing.late = true,
                Kind::HeartbeatStops => sensing.reach = sensing.reach.max(Reach::Commands),
                Kind::LinkCut => sensing.reach = Reach::Nothing,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::fault::Fault;

    fn sensing(count: i32) -> Sensing {
        Sensing { counts: [count; MAX_JOINTS], failed: None, late: false, reach: Reach::Everything }
    }

    fn injections(kinds: &[(u64, Kind)]) -> Injections {
        let mut injections = Injections::default();
        for &(at_tick, kind) in kinds {
            injections.push(Injection { at_tick, kind });
        }
        injections
    }

    #[test]
    fn nothing_happens_before_its_time() {
        let lost = Raised::at(2, Fault::SampleMissing);
        let mut injections = injections(&[
            (10, Kind::CounterFrozen { joint: 1 }),
            (10, Kind::CounterJump { joint: 2, counts: -7 }),
            (11, Kind::ReadingLost(lost)),
            (11, Kind::LateTicks),
        ]);
        for (tick, expected) in [(9, [9, 9]), (10, [10, 3]), (11, [10, 4]), (12, [10, 5])] {
            let mut sensed = sensing(tick as i32);
            injections.apply(tick, &mut sensed);
            assert_eq!(sensed.counts[1..3], expected, "tick {tick}");
            assert_eq!(sensed.counts[0], tick as i32);
            assert_eq!((sensed.failed, sensed.late), ((tick > 10).then_some(lost), tick > 10));
            assert_eq!(sensed.reach, Reach::Everything);
        }
    }

    #[test]
    fn a_cut_link_carries_less_than_one_without_heartbeat() {
        let mut injections = injections(&[(2, Kind::LinkCut), (1, Kind::HeartbeatStops)]);
        let reached = [0, 1, 2, 3].map(|tick| {
            let mut sensed = sensing(0);
            injections.apply(tick, &mut sensed);
            sensed.reach
        });
        assert_eq!(reached, [Reach::Everything, Reach::Commands, Reach::Nothing, Reach::Nothing]);
    }
}
