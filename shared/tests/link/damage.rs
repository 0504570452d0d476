//! A million damaged frames: none is accepted, and each costs no more than it must.

use super::line::Damage;
use super::property::{CAPACITY, frame, receive};
use super::random::Random;
use blindgrasp_shared::link::{Counters, FrameError, Receiver};

const FRAMES: usize = if cfg!(debug_assertions) { 20_000 } else { 1_000_000 };

/// Returns a payload: mostly what a hand and a host say to each other, at times more, at times more than is taken.
fn payload(random: &mut Random) -> Vec<u8> {
    let length = match random.below(20) {
        0 => random.between(245, 262),
        1 => random.between(1, CAPACITY - 4),
        _ => random.between(1, 80),
    };
    random.payload(length)
}

/// One receiver lives through all of it. The line brings, over and over: a damaged frame, a 0x00 if that ended without
/// one, and a good frame.
///
/// Accepted is the good frame, each time, and before it nothing but what was sent. How sure can that be? About 350,000
/// pieces come as far as the check of the CRC; were all of them random, one of them would pass it with a probability of 1
/// in 12,000. With the seed of this test none does, and never will.
#[test]
fn no_damaged_frame_is_accepted_and_the_next_one_arrives() {
    let mut random = Random::new(2010);
    let mut receiver = Receiver::<CAPACITY>::new();
    let mut before = Counters::ZERO;
    println!("damage           frames  too short  too long  bad code   bad CRC  arrived all the same");
    let kinds = Damage::ALL.len();
    for (number, kind) in Damage::ALL.into_iter().enumerate() {
        let frames = FRAMES / kinds + usize::from(number < FRAMES % kinds);
        let mut survivors = 0;
        for _ in 0..frames {
            let sent = [payload(&mut random), payload(&mut random)];
            let [intact, other] = sent.each_ref().map(|payload| frame(payload));
            let damaged = loop {
                let damaged = kind.of(&mut random, &intact, &other);
                if damaged != intact {
                    break damaged;
                }
            };
            let good = payload(&mut random);
            let separator = if damaged.last() == Some(&0) { &[][..] } else { &[0] };
            let line = [&damaged, separator, &frame(&good)].concat();

            let mut received = receive(&mut receiver, &line);
            assert_eq!(received.pop(), Some(Ok(good)), "{kind:?}: the next good frame did not arrive");
            // What is left of two frames can be one of them, unharmed: one frame that ends early, and another.
            for accepted in received.into_iter().filter_map(Result::ok) {
                assert!(sent.contains(&accepted), "{kind:?}: {accepted:02x?} was accepted and never sent");
                survivors += 1;
            }
        }
        let now = receiver.counters();
        let refused = |reason| now.refused_as(reason) - before.refused_as(reason);
        println!(
            "{:<14} {frames:>8} {:>10} {:>9} {:>9} {:>9} {survivors:>21}",
            format!("{kind:?}"),
            refused(FrameError::TooShort),
            refused(FrameError::TooLong),
            refused(FrameError::BadCode),
            refused(FrameError::BadCrc),
        );
        assert_eq!(now.good - before.good, frames as u32 + survivors);
        before = now;
    }
    println!("all            {FRAMES:>8} {before:?}");
    for reason in FrameError::ALL {
        assert!(before.refused_as(reason) > 0, "nothing was refused because {reason}");
    }
}

/// A damaged frame that ended without a 0x00 takes the next one with it, and only that one.
#[test]
fn a_lost_end_costs_the_frame_and_the_next() {
    let mut random = Random::new(1);
    for _ in 0..FRAMES / 100 {
        let sent = [payload(&mut random), payload(&mut random), payload(&mut random)];
        let [mut first, second, third] = sent.each_ref().map(|payload| frame(payload));
        first.pop();
        let received = receive(&mut Receiver::new(), &[first, second, third].concat());
        assert_eq!(received.len(), 2);
        assert!(received[0].is_err());
        assert_eq!(received[1].as_ref(), Ok(&sent[2]));
    }
}
