//! The joints of the board, on models of the chips: 12 counters and 3 DACs, or 6 and 2.

use crate::model;

use blindgrasp_firmware::joints::ls7366r::{FilterClock, Zero};
use blindgrasp_firmware::joints::{BoardJoints, ConfigError, JointsConfig, OutputConfig};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::joints::{Joints, Reading};
use model::{CounterChip, DacChip, Line, Pin, PinEnd, Select, Traffic, share};
use std::array;
use std::cell::{RefCell, RefMut};
use std::rc::Rc;

/// 10 V is 12 A, 23.4 mN m/A, gear 5.4.
const NM_PER_VOLT: f32 = 1.2 * 0.0234 * 5.4;

type Hand<const J: usize, const D: usize> = BoardJoints<Select<CounterChip>, Select<DacChip>, PinEnd, J, D>;

struct Board<const J: usize, const D: usize> {
    counters: [Rc<RefCell<CounterChip>>; J],
    dacs: [Rc<RefCell<DacChip>>; D],
    enable: Rc<Pin>,
    counter_traffic: Rc<RefCell<Traffic>>,
    dac_traffic: Rc<RefCell<Traffic>>,
    config: JointsConfig<J>,
}

impl<const J: usize, const D: usize> Board<J, D> {
    fn powered_up() -> Self {
        let outputs = [OutputConfig { nm_per_volt: NM_PER_VOLT }; J];
        Self {
            counters: array::from_fn(|_| share(CounterChip::powered_up())),
            dacs: array::from_fn(|_| share(DacChip::default())),
            enable: Rc::default(),
            counter_traffic: share(Traffic::default()),
            dac_traffic: share(Traffic::default()),
            config: JointsConfig { filter_clock: FilterClock::Half, outputs },
        }
    }

    /// The microcontroller boots; the chips are as they are.
    fn try_boot(&self) -> Result<Hand<J, D>, ConfigError> {
        let counters = self.counters.each_ref().map(|chip| Select::to(chip, &self.counter_traffic));
        let dacs = self.dacs.each_ref().map(|chip| Select::to(chip, &self.dac_traffic));
        BoardJoints::new(counters, dacs, PinEnd(Rc::clone(&self.enable)), &self.config)
    }

    fn boot(&self) -> Hand<J, D> {
        self.try_boot().expect("the board's numbers are right")
    }

    fn counter(&self, joint: usize) -> RefMut<'_, CounterChip> {
        self.counters[joint].borrow_mut()
    }

    fn dac(&self, k: usize) -> RefMut<'_, DacChip> {
        self.dacs[k].borrow_mut()
    }

    fn volts(&self) -> [f32; J] {
        array::from_fn(|joint| self.dac(joint / 4).volts(joint % 4))
    }

    fn off(&self) -> bool {
        !self.enable.high.get() && self.dacs.iter().all(|dac| dac.borrow().power & 0b1111 == 0)
    }
}

fn failed<const J: usize>(joint: usize, fault: Fault) -> Reading<J> {
    Reading::Failed(Raised::at(joint, fault))
}

fn tested<const J: usize>(joint: usize, fault: Fault, counts: [i32; J]) -> Reading<J> {
    Reading::Tested { raised: Raised::at(joint, fault), counts }
}

/// Ticks until the reading is counts again, with the user's command in each.
fn recover<const J: usize, const D: usize>(joints: &mut Hand<J, D>) -> [i32; J] {
    for _ in 0..100 {
        joints.recover();
        if let Reading::Counts(counts) = joints.collect() {
            return counts;
        }
        assert_eq!(joints.write(&[1.0; J], true), None);
    }
    panic!("not recovered: {:?}", joints.failure());
}

#[test]
fn a_hand_boots_counts_and_gives_torque() {
    let board = Board::<12, 3>::powered_up();
    let mut joints = board.boot();
    assert_eq!(joints.failure(), None);
    assert_eq!(joints.zeros(), &[Zero::Lost; 12]);
    assert_eq!(board.volts(), [0.0; 12]);
    assert_eq!(joints.collect(), Reading::Counts([0; 12]));
    for joint in 0..12 {
        board.counter(joint).turn(100 * joint as i32 - 500);
    }
    assert_eq!(joints.collect(), Reading::Counts(array::from_fn(|joint| 100 * joint as i32 - 500)));

    let torques_nm = array::from_fn(|joint| 0.1 * joint as f32 - 0.5);
    assert_eq!(joints.write(&torques_nm, true), None);
    for (torque_nm, volts) in torques_nm.into_iter().zip(board.volts()) {
        // Half a code, and the rounding of the product.
        assert!((torque_nm - volts * NM_PER_VOLT).abs() < 2.4e-5, "{torque_nm} N m is {volts} V");
    }
}

#[test]
fn outputs_are_off_before_anything_else() {
    let board = Board::<4, 1>::powered_up();
    let mut joints = board.boot();
    assert_eq!(joints.write(&[1.0; 4], true), None);
    assert!(!board.off());
    // The microcontroller resets in the middle of a grasp, and then finds that a counter is gone.
    board.counter(0).line = Line::Cut(0xFF);
    let before = *board.counter_traffic.borrow();
    let mut joints = board.boot();
    assert!(board.off());
    assert!(board.counter_traffic.borrow().frames > before.frames);
    assert_eq!(joints.collect(), failed(0, Fault::SampleMissing));

    // Even with numbers that can't be.
    let mut board = Board::<4, 1>::powered_up();
    assert_eq!(board.boot().write(&[1.0; 4], true), None);
    board.config.outputs[2].nm_per_volt = 0.0;
    let error = board.try_boot().map(|_| ()).unwrap_err();
    assert_eq!(error, ConfigError::Scale { joint: 2 });
    assert!(board.off());
}

#[test]
fn the_self_test_moves_no_output() {
    let board = Board::<4, 1>::powered_up();
    board.boot();
    assert_eq!(board.dac(0).most_v, 0.0);
}

#[test]
fn a_reset_of_the_microcontroller_keeps_the_zeros_of_the_counters_that_counted_on() {
    let board = Board::<6, 2>::powered_up();
    let mut joints = board.boot();
    for joint in 0..6 {
        board.counter(joint).turn(1000 + joint as i32);
    }
    board.counter(4).lose_power();
    // It goes on turning while the microcontroller boots.
    board.counter(1).turn(-1);
    joints = {
        drop(joints);
        board.boot()
    };
    let mut zeros = [Zero::Kept; 6];
    zeros[4] = Zero::Lost;
    assert_eq!(joints.zeros(), &zeros);
    assert_eq!(joints.collect(), Reading::Counts([1000, 1000, 1002, 1003, 0, 1005]));
}

#[test]
fn a_reset_in_the_middle_of_the_self_test_leaves_no_counter_that_looks_healthy() {
    let board = Board::<4, 1>::powered_up();
    board.counter(3).line = Line::Stuck(0xFF);
    board.boot();
    board.counter(3).line = Line::Whole;
    assert_eq!(board.boot().zeros(), &[Zero::Lost; 4]);
}

#[test]
fn the_number_of_dacs_has_to_fit() {
    let text = |error: ConfigError| error.to_string();
    let error = Board::<12, 2>::powered_up().try_boot().map(|_| ()).unwrap_err();
    assert_eq!(error, ConfigError::Outputs { joints: 12, dacs: 2 });
    assert_eq!(text(error), "12 joints need 3 DACs of 4 outputs, there are 2");
    let error = Board::<4, 2>::powered_up().try_boot().map(|_| ()).unwrap_err();
    assert_eq!(error, ConfigError::Outputs { joints: 4, dacs: 2 });
    assert!(Board::<5, 2>::powered_up().try_boot().is_ok());
    assert!(Board::<0, 0>::powered_up().try_boot().is_err());
    for nm_per_volt in [0.0, f32::NAN, f32::INFINITY, 1e-40] {
        let mut board = Board::<4, 1>::powered_up();
        board.config.outputs[1].nm_per_volt = nm_per_volt;
        assert_eq!(board.try_boot().map(|_| ()).unwrap_err(), ConfigError::Scale { joint: 1 });
    }
}

/// Every way a counter can fail, on every joint, at boot and in operation.
#[test]
fn a_counter_that_does_not_answer_is_named() {
    for line in [Line::Cut(0x00), Line::Cut(0xFF), Line::Stuck(0x00), Line::Stuck(0xFF), Line::Error] {
        for joint in 0..6 {
            let board = Board::<6, 2>::powered_up();
            board.counter(joint).line = line;
            let mut joints = board.boot();
            for _ in 0..30 {
                assert_eq!(joints.collect(), failed(joint, Fault::SampleMissing), "{line:?}");
                assert_eq!(joints.write(&[1.0; 6], true), None);
                joints.recover();
                assert!(board.off());
            }

            let board = Board::<6, 2>::powered_up();
            let mut joints = board.boot();
            assert_eq!(joints.collect(), Reading::Counts([0; 6]));
            assert_eq!(joints.write(&[1.0; 6], true), None);
            board.counter(joint).line = line;
            assert_eq!(joints.collect(), failed(joint, Fault::SampleMissing), "{line:?}");
            // Already before the tick.
            assert!(board.off());
            assert_eq!(joints.write(&[1.0; 6], true), None);
            assert_eq!(board.volts(), [0.0; 6]);
        }
    }
}

#[test]
fn a_counter_that_lost_its_power_is_named_in_that_tick() {
    for joint in 0..6 {
        let board = Board::<6, 2>::powered_up();
        let mut joints = board.boot();
        board.counter(joint).lose_power();
        assert_eq!(joints.collect(), failed(joint, Fault::CounterReset));
    }
}

/// A setting that changes without loss of power is found when the counter's turn comes.
#[test]
fn a_setting_that_changed_is_named_within_a_tick_for_each_joint() {
    for joint in 0..6 {
        for spoil in [(|chip| chip.mdr0 = 0x81) as fn(&mut CounterChip), |chip| chip.mdr1 = 0x01] {
            let board = Board::<6, 2>::powered_up();
            let mut joints = board.boot();
            spoil(&mut board.counter(joint));
            let ticks = (1..=6).find(|_| joints.collect() == failed(joint, Fault::CounterReset));
            // The reading at boot was the first joint's turn.
            assert_eq!(ticks, Some((joint + 5) % 6 + 1));
        }
    }
}

#[test]
fn two_selects_that_lead_to_one_chip_are_found() {
    for (joint, other) in (0..6).flat_map(|other| (0..other).map(move |joint| (joint, other))) {
        let mut board = Board::<6, 2>::powered_up();
        board.counters[joint] = Rc::clone(&board.counters[other]);
        let failure = board.boot().failure().expect("a failure");
        assert_eq!(failure.raised(), Raised::at(joint, Fault::SampleMissing));
        assert!(failure.to_string().contains("another chip has the same select"), "{failure}");
    }
}

#[test]
fn a_dead_bit_of_a_counter_is_found() {
    for bit in 0..32 {
        let board = Board::<4, 1>::powered_up();
        board.counter(3).dead_bits = 1 << bit;
        assert_eq!(board.boot().failure().expect("a failure").raised(), Raised::at(3, Fault::SampleMissing));
    }
}

#[test]
fn a_dac_that_does_not_answer_is_named() {
    for line in [Line::Cut(0x00), Line::Cut(0xFF), Line::Stuck(0x00), Line::Stuck(0xFF), Line::Error] {
        for k in 0..3 {
            let board = Board::<12, 3>::powered_up();
            board.dac(k).line = line;
            let mut joints = board.boot();
            let raised = joints.failure().expect("a failure").raised();
            assert_eq!(raised.fault, Fault::OutputFailed, "{line:?}");
            assert_eq!(raised, Raised::at(4 * k, Fault::OutputFailed));
            assert_eq!(joints.collect(), failed(4 * k, Fault::OutputFailed));
            assert!(board.off());

            let board = Board::<12, 3>::powered_up();
            let mut joints = board.boot();
            board.dac(k).line = line;
            let found = (0..12).find_map(|_| joints.write(&[0.5; 12], true)).expect("found within a turn");
            assert_eq!(found, Raised::at(4 * k, Fault::OutputFailed), "{line:?}");
            // It may be that this DAC can't be told, but its amplifiers are.
            assert!(!board.enable.high.get());
            for other in (0..3).filter(|&other| other != k) {
                assert_eq!(board.dac(other).power & 0b1111, 0);
            }
            assert_eq!(joints.collect(), failed(4 * k, Fault::OutputFailed));
        }
    }
}

#[test]
fn an_output_that_is_shorted_hot_or_without_power_is_named() {
    for (spoil, joint) in [
        ((|chip| chip.alerts = 1 << 9) as fn(&mut DacChip), 6),
        (|chip| chip.alerts = 1 << 5, 4),
        (|chip| chip.power &= !0b0100, 4),
        (|chip| chip.lose_power(), 4),
    ] {
        let board = Board::<12, 3>::powered_up();
        let mut joints = board.boot();
        spoil(&mut board.dac(1));
        let found = (0..12).find_map(|_| joints.write(&[0.5; 12], true)).expect("found within a turn");
        assert_eq!(found, Raised::at(joint, Fault::OutputFailed));
        assert!(board.off());
    }
}

#[test]
fn switching_off_is_repeated() {
    let board = Board::<6, 2>::powered_up();
    let mut joints = board.boot();
    assert_eq!(joints.write(&[1.0; 6], true), None);
    board.counter(0).line = Line::Cut(0xFF);
    board.dac(1).line = Line::Error;
    assert_eq!(joints.collect(), failed(0, Fault::SampleMissing));
    assert!(board.dac(1).power & 0b1111 != 0 && !board.enable.high.get());
    board.dac(1).line = Line::Whole;
    assert_eq!(joints.write(&[1.0; 6], true), None);
    assert!(board.off());
}

#[test]
fn amplifiers_have_power_only_where_it_is_wanted_and_all_is_well() {
    let board = Board::<6, 2>::powered_up();
    let mut joints = board.boot();
    assert!(!board.enable.high.get());
    for powered in [false, true, false, true] {
        joints.collect();
        assert_eq!(joints.write(&[0.0; 6], powered), None);
        assert_eq!(board.enable.high.get(), powered);
    }
    board.counter(5).lose_power();
    joints.collect();
    assert!(!board.enable.high.get());
    for _ in 0..30 {
        joints.collect();
        joints.write(&[1.0; 6], true);
        assert!(!board.enable.high.get());
    }
    joints.recover();
    assert!(!board.enable.high.get());
    assert_eq!(joints.write(&[1.0; 6], true), None);
    assert!(board.enable.high.get());

    board.enable.broken.set(true);
    let mut joints = board.boot();
    assert_eq!(joints.write(&[0.0; 6], false), None);
    assert_eq!(joints.write(&[0.0; 6], true), Some(Raised::at(0, Fault::OutputFailed)));
    assert!(board.off());
}

#[test]
fn torque_that_is_no_number_is_none_and_a_fault() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let board = Board::<4, 1>::powered_up();
        let mut joints = board.boot();
        assert_eq!(joints.write(&[0.5; 4], true), None);
        assert_eq!(joints.write(&[0.5, 0.5, bad, bad], true), Some(Raised::at(2, Fault::NotFinite)));
        let volts = board.volts();
        assert_eq!((volts[2], volts[3]), (0.0, 0.0));
        assert!(volts[0] > 3.0 && volts[1] > 3.0);
        // Nothing is wrong with the chips.
        assert_eq!(joints.failure(), None);
    }
}

#[test]
fn torque_saturates_at_full_scale() {
    let mut board = Board::<4, 1>::powered_up();
    board.config.outputs[3].nm_per_volt = -NM_PER_VOLT;
    let mut joints = board.boot();
    let top_v = 10.0 * 32767.0 / 32768.0;
    for (torque_nm, [volts, reversed]) in [
        (10.0 * NM_PER_VOLT, [top_v, -10.0]),
        (-10.0 * NM_PER_VOLT, [-10.0, top_v]),
        (2.0, [top_v, -10.0]),
        (-2.0, [-10.0, top_v]),
        (f32::MAX, [top_v, -10.0]),
        (f32::MIN, [-10.0, top_v]),
    ] {
        assert_eq!(joints.write(&[torque_nm; 4], true), None);
        assert_eq!(board.volts(), [volts, volts, volts, reversed], "{torque_nm} N m");
    }
}

#[test]
fn the_nearest_code_is_taken() {
    let board = Board::<4, 1>::powered_up();
    let mut joints = board.boot();
    let code_nm = NM_PER_VOLT * 10.0 / 32768.0;
    for (codes, code) in [(0.49, 0), (0.51, 1), (-0.49, 0), (-0.51, -1), (1000.4, 1000), (-1000.6, -1001)] {
        assert_eq!(joints.write(&[codes * code_nm; 4], true), None);
        assert_eq!(board.dac(0).codes.map(u16::cast_signed), [code; 4]);
    }
}

/// A cable is pulled in a grasp and put back: the joints work again on command, not before, and the zeros are as they
/// were, because the counters kept their power.
#[test]
fn recovery_needs_the_cable_and_the_command() {
    let board = Board::<12, 3>::powered_up();
    let mut joints = board.boot();
    for joint in 0..12 {
        board.counter(joint).turn(7 + joint as i32);
    }
    board.counter(3).line = Line::Cut(0xFF);
    board.counter(8).line = Line::Cut(0xFF);
    assert_eq!(joints.collect(), failed(3, Fault::SampleMissing));
    // The first cable: after a turn of the self-test, the second one is named.
    board.counter(3).line = Line::Whole;
    for _ in 0..27 {
        joints.collect();
    }
    assert_eq!(joints.collect(), failed(8, Fault::SampleMissing));
    joints.recover();
    assert_eq!(joints.collect(), failed(8, Fault::SampleMissing));
    board.counter(8).line = Line::Whole;
    // The two readings above were steps of this turn.
    for _ in 2..27 {
        assert_eq!(joints.collect(), failed(8, Fault::SampleMissing));
    }
    // All is well, but nobody has said so.
    for _ in 0..100 {
        let counts = array::from_fn(|joint| 7 + joint as i32);
        assert_eq!(joints.collect(), tested(8, Fault::SampleMissing, counts));
        assert_eq!(joints.write(&[1.0; 12], true), None);
        assert!(board.off());
    }
    board.counter(0).turn(1000);
    joints.recover();
    let mut counts = array::from_fn(|joint| 7 + joint as i32);
    counts[0] += 1000;
    assert_eq!(joints.collect(), Reading::Counts(counts));
    assert_eq!(joints.zeros(), &[Zero::Kept; 12]);
    assert_eq!(board.volts(), [0.0; 12]);
    assert_eq!(joints.write(&[1.0; 12], true), None);
    assert!(board.volts().iter().all(|&volts| volts > 6.0));
}

/// A counter that lost its power counts from 0 from the command on; until then, 0 is what it would begin with.
#[test]
fn after_lost_power_the_command_sets_the_zero() {
    let board = Board::<6, 2>::powered_up();
    let mut joints = board.boot();
    for joint in 0..6 {
        board.counter(joint).turn(500);
    }
    board.counter(2).lose_power();
    assert_eq!(joints.collect(), failed(2, Fault::CounterReset));
    for _ in 0..14 {
        assert_eq!(joints.collect(), failed(2, Fault::CounterReset));
    }
    board.counter(2).turn(33);
    assert_eq!(joints.collect(), tested(2, Fault::CounterReset, [500, 500, 0, 500, 500, 500]));
    joints.recover();
    board.counter(2).turn(4);
    assert_eq!(joints.collect(), Reading::Counts([500, 500, 4, 500, 500, 500]));
    assert_eq!(joints.zeros()[2], Zero::Lost);
}

#[test]
fn what_breaks_between_test_and_command_is_found() {
    let board = Board::<6, 2>::powered_up();
    let mut joints = board.boot();
    board.counter(1).lose_power();
    for _ in 0..30 {
        joints.collect();
    }
    board.counter(1).line = Line::Cut(0x00);
    // It is found by the next reading, whether the command comes before or not.
    for commanded in [false, true] {
        if commanded {
            joints.recover();
        }
        assert_eq!(joints.collect(), failed(1, Fault::SampleMissing));
    }
    board.counter(1).line = Line::Whole;
    for _ in 0..30 {
        joints.collect();
    }
    board.dac(1).line = Line::Cut(0xFF);
    joints.recover();
    assert_eq!(joints.failure().expect("a failure").raised(), Raised::at(4, Fault::OutputFailed));
    board.dac(1).line = Line::Whole;
    recover(&mut joints);
}

#[test]
fn every_failure_can_be_recovered_from() {
    for line in [Line::Cut(0x00), Line::Cut(0xFF), Line::Stuck(0x00), Line::Stuck(0xFF), Line::Error] {
        let board = Board::<6, 2>::powered_up();
        let mut joints = board.boot();
        board.counter(5).line = line;
        board.dac(0).line = line;
        for _ in 0..10 {
            joints.collect();
            joints.write(&[1.0; 6], true);
            joints.recover();
        }
        assert!(joints.failure().is_some());
        board.counter(5).line = Line::Whole;
        board.dac(0).line = Line::Whole;
        assert_eq!(recover(&mut joints), [0; 6]);
        assert_eq!(joints.write(&[1.0; 6], true), None);
        assert!(board.volts().iter().all(|&volts| volts > 6.0));
    }
}

/// The time that a tick takes on the buses, at 2.625 MHz for the counters and 5.25 MHz for the DACs, of 1000 us.
#[test]
fn the_buses_are_busy_for_a_stated_time() {
    let board = Board::<12, 3>::powered_up();
    let measure = |act: &mut dyn FnMut()| {
        *board.counter_traffic.borrow_mut() = Traffic::default();
        *board.dac_traffic.borrow_mut() = Traffic::default();
        act();
        (*board.counter_traffic.borrow(), *board.dac_traffic.borrow())
    };
    let mut joints = None;
    let boot = measure(&mut || joints = Some(board.boot()));
    let mut joints = joints.expect("booted");
    let us =
        |(counters, dacs): (Traffic, Traffic)| f64::from(counters.bits) / 2.625 + f64::from(dacs.bits) / 5.25;
    println!("boot {boot:?}: {:.0} us", us(boot));
    assert!(us(boot) < 4000.0);

    let running = measure(&mut || {
        joints.collect();
        joints.write(&[1.0; 12], true);
    });
    println!("tick {running:?}: {:.0} us", us(running));
    assert_eq!(running.0, Traffic { frames: 26, bits: 704 });
    assert_eq!(running.1, Traffic { frames: 19, bits: 456 });

    // All counters lost their power: the longest tests, and the longest start.
    for joint in 0..12 {
        board.counter(joint).lose_power();
    }
    let mut longest = 0.0_f64;
    for _ in 0..60 {
        let tick = measure(&mut || {
            joints.collect();
            joints.write(&[1.0; 12], true);
        });
        longest = longest.max(us(tick));
    }
    println!("longest tick of a failure: {longest:.0} us");
    assert!(longest < us(running));
    let recovery = measure(&mut || joints.recover());
    println!("recover {recovery:?}: {:.0} us", us(recovery));
    assert_eq!(joints.failure(), None);
    assert!(us(recovery) < 200.0);
}
