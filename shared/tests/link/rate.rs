//! Agreeing on a rate: a hand, a host, and a line in memory that loses what it likes.

use blindgrasp_shared::link::rate::{
    Asked, FASTER_BAUDS, FIRST_BAUD, HandRate, HostRate, SILENCE_MS, TRIAL_MS,
};
use proptest::prelude::*;
use std::collections::VecDeque;

/// From one heartbeat of the host to the next, ms.
const HEARTBEAT_MS: u32 = 50;

/// The firmware of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Firmware {
    /// It has some rates besides the first.
    Has(&'static [u32]),
    /// An old one, which does not understand.
    Refuses,
    /// One that says nothing to it.
    IsSilent,
}

/// A disturbance of the line from some time on, for some time.
#[derive(Clone, Copy, Debug)]
struct Disturbance {
    begin_ms: u32,
    length_ms: u32,
    loses_to_hand: bool,
    loses_to_host: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Frame {
    /// Of the host.
    Rate(u32),
    Heartbeat,
    /// Of the hand.
    Answer(Asked),
    Done,
}

/// A frame on its way, and the rate that it was sent at.
type Sent = (u32, Frame);

struct World {
    now_ms: u32,
    hand: HandRate,
    host: HostRate,
    firmware: Firmware,
    disturbances: Vec<Disturbance>,
    /// Rates at which nothing comes through, either way.
    dead_bauds: Vec<u32>,
    /// Another program has opened the host's port at the first rate.
    is_stolen: bool,
    to_hand: VecDeque<Sent>,
    to_host: VecDeque<Sent>,
    /// Rate that the hand changes to, once what it sends now has left.
    leaving: Option<u32>,
    beaten_ms: u32,
    /// The times of the last heartbeat and of its answer.
    hand_heard_ms: Option<u32>,
    host_heard_ms: Option<u32>,
    /// Every rate that the hand has had, in order.
    hand_bauds: Vec<u32>,
}

impl World {
    fn new(firmware: Firmware, start_ms: u32) -> Self {
        let mut host = HostRate::new();
        host.begin(FASTER_BAUDS.map(Some), start_ms);
        Self {
            now_ms: start_ms,
            hand: HandRate::new(),
            host,
            firmware,
            disturbances: Vec::new(),
            dead_bauds: Vec::new(),
            is_stolen: false,
            to_hand: VecDeque::new(),
            to_host: VecDeque::new(),
            leaving: None,
            beaten_ms: start_ms,
            hand_heard_ms: None,
            host_heard_ms: None,
            hand_bauds: vec![FIRST_BAUD],
        }
    }

    fn loses(&self, baud: u32, is_lost: impl Fn(&Disturbance) -> bool) -> bool {
        let now = |one: &Disturbance| self.now_ms.wrapping_sub(one.begin_ms) < one.length_ms;
        self.dead_bauds.contains(&baud) || self.disturbances.iter().any(|one| now(one) && is_lost(one))
    }

    /// A millisecond: what was sent in the last one arrives, if both ends have the rate that it was sent at.
    fn step(&mut self) {
        self.now_ms = self.now_ms.wrapping_add(1);
        let now_ms = self.now_ms;
        if let Some(baud) = self.leaving.take() {
            self.hand.answered(baud, now_ms);
        }
        let hand_baud = self.hand.turn(now_ms);
        if self.hand_bauds.last() != Some(&hand_baud) {
            self.hand_bauds.push(hand_baud);
        }
        let loses_to_hand = self.loses(hand_baud, |one| one.loses_to_hand);
        for (baud, frame) in std::mem::take(&mut self.to_hand) {
            if baud == hand_baud && !loses_to_hand {
                self.hand_hears(frame, hand_baud);
            }
        }
        let asked = self.host.turn(now_ms);
        let host_baud = if self.is_stolen { FIRST_BAUD } else { self.host.baud() };
        let loses_to_host = self.loses(host_baud, |one| one.loses_to_host);
        // What arrives now was sent a millisecond ago, and the answer that a change follows with it.
        for (baud, frame) in std::mem::take(&mut self.to_host) {
            if baud == host_baud && !loses_to_host {
                self.host.heard(now_ms);
                match frame {
                    Frame::Answer(asked) => self.host.answered(asked, now_ms),
                    _ => self.host_heard_ms = Some(now_ms),
                }
            }
        }
        if let Some(baud) = asked {
            self.to_hand.push_back((host_baud, Frame::Rate(baud)));
        }
        if self.host.is_settled() && now_ms.wrapping_sub(self.beaten_ms) >= HEARTBEAT_MS {
            self.beaten_ms = now_ms;
            self.to_hand.push_back((host_baud, Frame::Heartbeat));
        }
    }

    fn hand_hears(&mut self, frame: Frame, hand_baud: u32) {
        self.hand.heard(matches!(frame, Frame::Rate(_)) && self.firmware != Firmware::Refuses, self.now_ms);
        let answer = match (frame, self.firmware) {
            (Frame::Rate(_), Firmware::IsSilent) => return,
            (Frame::Rate(_), Firmware::Refuses) => Frame::Answer(Asked::Refused),
            (Frame::Rate(baud), Firmware::Has(bauds)) if bauds.contains(&baud) => {
                self.leaving = Some(baud);
                Frame::Answer(Asked::Done)
            }
            (Frame::Rate(_), Firmware::Has(_)) => Frame::Answer(Asked::NoSuchRate),
            _ => {
                self.hand_heard_ms = Some(self.now_ms);
                Frame::Done
            }
        };
        self.to_host.push_back((hand_baud, answer));
    }

    fn run(&mut self, milliseconds: u32) {
        (0..milliseconds).for_each(|_| self.step());
    }

    /// The rate that both ends have, at which heartbeats come and are answered.
    #[track_caller]
    fn agreed(&mut self) -> u32 {
        (self.hand_heard_ms, self.host_heard_ms) = (None, None);
        self.run(2 * HEARTBEAT_MS);
        assert!(self.hand_heard_ms.is_some() && self.host_heard_ms.is_some(), "nothing comes through");
        let host_baud = if self.is_stolen { FIRST_BAUD } else { self.host.baud() };
        assert_eq!(self.hand.turn(self.now_ms), host_baud);
        host_baud
    }
}

#[test]
fn the_fastest_rate_that_both_have_is_agreed_at_once() {
    let all: [&'static [u32]; 4] = [&FASTER_BAUDS, &[2_000_000, 1_500_000], &[1_500_000], &[]];
    for (bauds, start_ms) in all.into_iter().zip([0, 77, u32::MAX - 5, 1 << 31]) {
        let mut world = World::new(Firmware::Has(bauds), start_ms);
        world.run(20);
        assert_eq!(world.agreed(), bauds.first().copied().unwrap_or(FIRST_BAUD));
        // And kept, with no heartbeat lost.
        world.run(10_000);
        assert_eq!(world.agreed(), bauds.first().copied().unwrap_or(FIRST_BAUD));
        assert!(world.hand_bauds.len() <= 2, "{:?}", world.hand_bauds);
    }
}

#[test]
fn with_an_old_firmware_the_first_rate_stays() {
    for firmware in [Firmware::Refuses, Firmware::IsSilent] {
        let mut world = World::new(firmware, 0);
        world.run(1000);
        assert_eq!((world.agreed(), &world.hand_bauds[..]), (FIRST_BAUD, &[FIRST_BAUD][..]));
    }
}

#[test]
fn a_rate_at_which_nothing_comes_through_is_given_up_for_the_next() {
    let mut world = World::new(Firmware::Has(&FASTER_BAUDS), 0);
    world.dead_bauds = vec![3_000_000];
    world.run(1000);
    assert_eq!(world.agreed(), 2_000_000);
    let mut world = World::new(Firmware::Has(&FASTER_BAUDS), 0);
    world.dead_bauds = FASTER_BAUDS.to_vec();
    world.run(2500);
    assert_eq!(world.agreed(), FIRST_BAUD);
}

#[test]
fn a_hand_goes_back_when_it_hears_nothing_and_sooner_on_trial() {
    let mut hand = HandRate::new();
    hand.answered(3_000_000, 10);
    assert_eq!((hand.turn(10 + TRIAL_MS - 1), hand.turn(10 + TRIAL_MS)), (3_000_000, FIRST_BAUD));
    hand.answered(3_000_000, 1000);
    hand.heard(true, 1100);
    assert_eq!((hand.turn(1100 + TRIAL_MS - 1), hand.turn(1100 + TRIAL_MS)), (3_000_000, FIRST_BAUD));
    hand.answered(3_000_000, 2000);
    hand.heard(false, 2100);
    assert_eq!((hand.turn(2100 + SILENCE_MS - 1), hand.turn(2100 + SILENCE_MS)), (3_000_000, FIRST_BAUD));
    // At the end of a session, at once.
    hand.answered(3_000_000, 5000);
    hand.answered(FIRST_BAUD, 5010);
    assert_eq!(hand.turn(5010), FIRST_BAUD);
}

#[test]
fn a_hand_that_was_reset_is_found_again() {
    let mut world = World::new(Firmware::Has(&FASTER_BAUDS), 0);
    world.run(500);
    world.hand = HandRate::new();
    world.run(500);
    assert_eq!(world.agreed(), FIRST_BAUD);
}

#[test]
fn a_host_that_stood_still_does_not_take_it_for_silence() {
    let mut host = HostRate::new();
    host.begin(FASTER_BAUDS.map(Some), 0);
    assert_eq!(host.turn(0), Some(3_000_000));
    host.answered(Asked::Done, 2);
    assert_eq!(host.turn(2), Some(3_000_000));
    host.answered(Asked::Done, 4);
    assert!(host.is_settled());
    // What came meanwhile waits to be read.
    assert_eq!((host.turn(804), host.baud()), (None, 3_000_000));
    for now_ms in (810..1400).step_by(10) {
        host.turn(now_ms);
    }
    assert_eq!(host.baud(), FIRST_BAUD);
}

fn disturbances() -> impl Strategy<Value = Vec<Disturbance>> {
    let one = (0..600_u32, 1..1500_u32, any::<bool>(), any::<bool>()).prop_map(
        |(begin_ms, length_ms, loses_to_hand, loses_to_host)| Disturbance {
            begin_ms,
            length_ms,
            loses_to_hand,
            loses_to_host,
        },
    );
    // Single frames, too: the first ones are the change.
    let frame = (0..20_u32, 1..4_u32, any::<bool>()).prop_map(|(begin_ms, length_ms, to_hand)| Disturbance {
        begin_ms,
        length_ms,
        loses_to_hand: to_hand,
        loses_to_host: !to_hand,
    });
    proptest::collection::vec(prop_oneof![one, frame], 0..5)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Whatever is lost, cut, reset or taken, whenever: the ends find each other again, and nothing faster than a hand has is
    /// ever used.
    #[test]
    fn whatever_happens_the_ends_find_each_other(
        disturbances in disturbances(),
        reset_ms in proptest::option::of(0..700_u32),
        stolen_ms in proptest::option::of(0..700_u32),
        dead in 0..4_usize,
        has in 0..4_usize,
    ) {
        let bauds = &FASTER_BAUDS[has..];
        let mut world = World::new(Firmware::Has(bauds), 0);
        world.disturbances = disturbances;
        world.dead_bauds = FASTER_BAUDS[..dead].to_vec();
        for now_ms in 0..2200 {
            if reset_ms == Some(now_ms) {
                (world.hand, world.leaving) = (HandRate::new(), None);
            }
            world.is_stolen |= stolen_ms == Some(now_ms);
            world.step();
        }
        // The line is whole again: what may still be tried takes this long.
        world.run(4000);
        let baud = world.agreed();
        prop_assert!(baud == FIRST_BAUD || (bauds.contains(&baud) && !world.dead_bauds.contains(&baud)));
        for baud in &world.hand_bauds {
            prop_assert!(*baud == FIRST_BAUD || bauds.contains(baud));
        }
        // For good.
        world.run(2000);
        prop_assert_eq!(world.agreed(), baud);
    }
}
