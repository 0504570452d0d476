//! Everything that can go wrong in each mode of the cycle, in simulation: a cube of 100 g is picked up, held in the air and put
//! down. Tables of docs/safety.md are made here.
//!
//! **Nothing jumps** means, in each of these tries:
//! - no torque changes by more than its slew limit in a tick, but for the one in which all torque goes;
//! - where something is wrong with a reading, none changes by more than in the same cycle without it until that is found;
//! - where the torque is taken away, it is zero in that very tick and stays so; what hand and object then store (moving, squeezed, lifted)
//!   only falls, but for what somebody who pushes gives.

use super::faults::{NEVER, bent, fastest_rad_s, in_words, joint_step_nm, largest, off, pushed_off, widen};
use blindgrasp::body::MAX_JOINTS;
use blindgrasp::model::Scene;
use blindgrasp::sim::injection::Kind;
use blindgrasp::sim::sample::Sample;
use blindgrasp_shared::command::Command;
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::tick::Config;
use blindgrasp_tests::generated;
use blindgrasp_tests::supervised::{
    Course, HEARTBEAT_TICKS, Instant, Outcome, config, friction_energy_j, scene,
};
use std::ops::RangeInclusive;

const DOCUMENT: &str = "docs/safety.md";
/// Ticks of each try before something goes wrong; the heartbeat comes in its first and in its last.
const LEAD: u64 = HEARTBEAT_TICKS;
/// Ticks from then on: an object falls onto its table in 150, ...
const SHORT: usize = 500;
/// ... and the loss of the link takes up to 250, and letting go 600; ...
const LONG: usize = 1000;
/// ... fingers whose counter stands still slip off what they carry, slowly.
const LONGEST: usize = 3000;
/// Speed limit of a first start, rad/s.
const SLOW_RAD_S: f32 = 2.0;

/// An instant in which something goes wrong: the mode, the tick after its beginning, and how it is told.
const INSTANTS: [(Mode, u64, &str); 7] = [
    (Mode::Moving, 70, "moving"),
    (Mode::Closing, 250, "closing"),
    (Mode::Grasping, 250, "grasping"),
    (Mode::Carrying, 7000, "carrying"),
    (Mode::Carrying, 14_350, "carrying, above its table"),
    (Mode::PuttingDown, 250, "putting down"),
    (Mode::Releasing, 150, "releasing"),
];
/// The one in which the object is a little above its table.
const ABOVE: usize = 4;

/// Follows the script of a scene to the instants, each [`LEAD`] earlier.
fn instants(scene: &Scene) -> Vec<Instant<'_>> {
    let mut instant = Instant::beginning(scene);
    let (mut last, mut age) = (Mode::Armed, 0);
    let mut instants = Vec::new();
    while let Some(&(mode, after, _)) = INSTANTS.get(instants.len()) {
        let now = instant.step().expect("the script comes to all modes");
        age = if now == last { age + 1 } else { 0 };
        last = now;
        if now == mode && age + LEAD == after {
            instants.push(instant.clone());
        }
    }
    instants
}

/// The end of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    /// It is in the hand.
    Held,
    /// It stands within 3 mm of where it was when something went wrong.
    Stays,
    /// It stands farther from there.
    Pushed,
    /// It falls onto its table, from 100 mm above.
    Falls,
}

impl Fate {
    const ALL: [Self; 4] = [Self::Held, Self::Stays, Self::Pushed, Self::Falls];

    const fn words(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Stays => "stays",
            Self::Pushed => "pushed aside",
            Self::Falls => "falls",
        }
    }

    fn of(outcome: &Outcome) -> Self {
        let (first, last) = (&outcome.run.samples[LEAD as usize], last(outcome));
        let down_m = last.position_m.z - first.position_m.z;
        let pressing = last.contacts.iter().filter(|contact| contact.normal_force_n > 0.0).count();
        if down_m > 0.05 {
            return Self::Falls;
        }
        if pressing >= 2 {
            return Self::Held;
        }
        if (last.position_m - first.position_m).norm() < 3e-3 { Self::Stays } else { Self::Pushed }
    }
}

fn last(outcome: &Outcome) -> &Sample {
    outcome.run.samples.last().expect("it ran")
}

/// The results of some tries in one mode.
struct Cell {
    tries: usize,
    /// From the instant at which it is so, ticks.
    found: RangeInclusive<u64>,
    finds: usize,
    /// From the tick that found it until the joints have no torque, ticks.
    off: RangeInclusive<u64>,
    /// Largest change of a torque in a tick, before all torque goes, N m.
    step_nm: f64,
    /// Fastest joint from the fault on, rad/s.
    fastest_rad_s: f64,
    fates: Vec<Fate>,
    /// The numbers of other faults that were found instead.
    others: Vec<u8>,
}

impl Cell {
    fn new() -> Self {
        let (fates, others) = (Vec::new(), Vec::new());
        Self { tries: 0, found: NEVER, finds: 0, off: NEVER, step_nm: 0.0, fastest_rad_s: 0.0, fates, others }
    }

    fn add(&mut self, outcome: &Outcome, found: Option<(u64, u64)>, until: u64, fastest_rad_s: f64) {
        self.tries += 1;
        if let Some((after, off)) = found {
            self.finds += 1;
            widen(&mut self.found, after);
            widen(&mut self.off, off);
        }
        self.step_nm = self.step_nm.max(steps_nm(outcome, until).into_iter().fold(0.0, f64::max));
        self.fastest_rad_s = self.fastest_rad_s.max(fastest_rad_s);
        self.fates.push(Fate::of(outcome));
    }

    fn words(&self) -> String {
        let Self { tries, found, finds, off, step_nm, fastest_rad_s, fates, others } = self;
        let mut found = match finds {
            0 => "not found".to_owned(),
            finds if finds == tries => format!("{} + {}", in_words(found), in_words(off)),
            finds => format!("{finds} of {tries}: {} + {}", in_words(found), in_words(off)),
        };
        let mut numbers = others.clone();
        numbers.sort_unstable();
        numbers.dedup();
        for number in numbers {
            let count = others.iter().filter(|other| **other == number).count();
            found += &format!(", fault {number} instead in {count}");
        }
        let count = |fate: &Fate| fates.iter().filter(|is| *is == fate).count();
        let fates: Vec<String> = Fate::ALL
            .iter()
            .filter(|fate| count(fate) > 0)
            .map(|fate| match count(fate) {
                all if all == *tries => fate.words().to_owned(),
                some => format!("{} {some} of {tries}", fate.words()),
            })
            .collect();
        format!("{found}; {step_nm:.3}; {fastest_rad_s:.1}; {}", fates.join(", "))
    }
}

/// Largest change of each joint's torque in a tick, before one, N m.
fn steps_nm(outcome: &Outcome, until: u64) -> [f64; MAX_JOINTS] {
    std::array::from_fn(|joint| joint_step_nm(outcome, until as usize, joint))
}

/// No torque changes by more than its slew limit before the tick in which all torque goes.
fn slews(config: &Config<MAX_JOINTS>, outcome: &Outcome, until: u64) {
    let limits_nm_s = config.limits.slew_nm_s.expect("it is limited");
    let period_s = f64::from(config.period_us) * 1e-6;
    for (joint, (step_nm, limit_nm_s)) in steps_nm(outcome, until).into_iter().zip(limits_nm_s).enumerate() {
        let most_nm = f64::from(limit_nm_s) * period_s;
        assert!(step_nm <= 1.0001 * most_nm, "joint {joint} jumps by {step_nm} N m of {most_nm}");
    }
}

/// Stored energy only falls from a tick on, but for what the friction of the joints had stored, and what was given.
fn energy_falls(scene: &Scene, outcome: &Outcome, from: u64) {
    let mut least_j = f64::INFINITY;
    for sample in &outcome.run.samples[from as usize..] {
        let stored_j = sample.energies.stored_j() - sample.energies.given_j();
        least_j = least_j.min(stored_j);
        let gained_j = stored_j - least_j;
        assert!(gained_j <= friction_energy_j(scene) + 1e-9, "{gained_j} J more at {} s", sample.t_s);
    }
}

/// The means of a try.
struct Bench<'a> {
    scene: &'a Scene,
    config: Config<MAX_JOINTS>,
    instants: Vec<Instant<'a>>,
    /// The largest change of each torque in a tick where nothing is wrong, from each instant.
    healthy_nm: Vec<[f64; MAX_JOINTS]>,
}

impl<'a> Bench<'a> {
    fn new(scene: &'a Scene) -> Self {
        let (config, instants) = (config(scene), instants(scene));
        let healthy_nm = instants.iter().zip(INSTANTS).map(|(instant, (mode, _, words))| {
            let outcome = instant.then(&config, &Course::default(), LEAD as usize + SHORT);
            assert_eq!((outcome.turned[LEAD as usize].mode, outcome.found()), (mode, None), "{words}");
            steps_nm(&outcome, outcome.turned.len() as u64)
        });
        let healthy_nm = healthy_nm.collect();
        Self { scene, config, instants, healthy_nm }
    }

    /// Tries something that takes the torque away in the tick that finds it, for good.
    fn falls_off(&self, cell: &mut Cell, at: usize, (fault, since): (Fault, u64), course: &Course) {
        let outcome = self.instants[at].then(&self.config, course, LEAD as usize + SHORT);
        let (found, raised) = outcome.found().unwrap_or_else(|| panic!("{fault:?} is not found"));
        assert_eq!(raised.fault, fault);
        for (joint, step_nm) in steps_nm(&outcome, found).into_iter().enumerate() {
            assert!(step_nm <= 1.0001 * self.healthy_nm[at][joint], "joint {joint} jumps by {step_nm} N m");
        }
        let end = pushed_off(&outcome, course, found, Mode::Fault);
        energy_falls(self.scene, &outcome, found + end.off + 1);
        cell.add(&outcome, Some((found - since, end.off)), found, end.fastest_rad_s);
    }

    /// Lets something go wrong from an instant on that is found at once.
    fn injected(&self, at: usize, kinds: &[(Fault, Kind)]) -> Cell {
        let mut cell = Cell::new();
        for &(fault, kind) in kinds {
            self.falls_off(&mut cell, at, (fault, LEAD), &Course::fault(LEAD, kind));
        }
        cell
    }

    /// Somebody pushes each finger, whose joints may not turn faster than at a first start.
    fn pushed(&self, at: usize) -> Cell {
        let mut cell = Cell::new();
        let mut config = self.config;
        config.faults.speed_limit_rad_s = Some([SLOW_RAD_S; MAX_JOINTS]);
        config.faults.frozen_ms = None;
        for joint in [1, 5, 9] {
            let course = bent(LEAD, joint, -0.3);
            let outcome = self.instants[at].then(&config, &course, LEAD as usize + SHORT);
            let (found, raised) = outcome.found().expect("it is found");
            assert_eq!(raised.fault, Fault::Overspeed);
            let is_fast =
                |sample: &Sample| sample.speeds_rad_s.iter().any(|speed| speed.abs() > f64::from(SLOW_RAD_S));
            let since = outcome.run.samples.iter().position(is_fast).expect("it is fast") as u64;
            slews(&config, &outcome, found);
            let end = pushed_off(&outcome, &course, found, Mode::Fault);
            energy_falls(self.scene, &outcome, found + end.off + 1);
            cell.add(&outcome, Some((found - since, end.off)), found, end.fastest_rad_s);
        }
        cell
    }

    /// The link is lost: right after a heartbeat, and right before the next.
    fn link_lost(&self, at: usize, kind: Kind) -> Cell {
        let mut cell = Cell::new();
        for since in [LEAD + 1, LEAD + HEARTBEAT_TICKS] {
            let outcome =
                self.instants[at].then(&self.config, &Course::fault(since, kind), LEAD as usize + LONG);
            let (found, raised) = outcome.found().expect("it is found");
            assert_eq!(raised.fault, Fault::LinkLost);
            let gone = outcome.turned.iter().position(|turned| turned.mode == Mode::Fault);
            let gone = gone.expect("the torque goes") as u64;
            for turned in &outcome.turned[found as usize..gone as usize] {
                assert_eq!(turned.mode, Mode::Releasing);
            }
            slews(&self.config, &outcome, gone);
            let end = pushed_off(&outcome, &Course::default(), gone, Mode::Fault);
            assert_eq!(off(&outcome, found), gone - found + end.off);
            energy_falls(self.scene, &outcome, gone + end.off + 1);
            let fastest_rad_s = fastest_rad_s(&outcome, found);
            cell.add(&outcome, Some((found - since, gone - found + end.off)), gone, fastest_rad_s);
        }
        cell
    }

    /// A counter stands still, each in turn. It may never be found.
    fn frozen(&self, at: usize) -> Cell {
        let mut cell = Cell::new();
        let ticks = if INSTANTS[at].0 == Mode::Carrying { LONGEST } else { LONG };
        for joint in 0..self.scene.joints.len() {
            let course = Course::fault(LEAD, Kind::CounterFrozen { joint });
            let outcome = self.instants[at].then(&self.config, &course, LEAD as usize + ticks);
            // What it leads to may be found as something else.
            let until = outcome.found().map_or(outcome.turned.len() as u64, |(at, _)| at);
            let found = outcome.found().and_then(|(at, raised)| {
                let off = pushed_off(&outcome, &course, at, Mode::Fault).off;
                let is_it = raised == Raised::at(joint, Fault::CounterFrozen);
                cell.others.extend((!is_it).then_some(raised.fault.number()));
                is_it.then_some((at - LEAD, off))
            });
            slews(&self.config, &outcome, until);
            cell.add(&outcome, found, until, fastest_rad_s(&outcome, LEAD));
        }
        cell
    }

    /// `Stop`.
    fn stopped(&self, at: usize) -> Cell {
        let mut cell = Cell::new();
        let course = Course { commands: vec![(LEAD, Command::Stop)], ..Course::default() };
        let outcome = self.instants[at].then(&self.config, &course, LEAD as usize + SHORT);
        let end = pushed_off(&outcome, &course, LEAD, Mode::Disarmed);
        energy_falls(self.scene, &outcome, LEAD + end.off + 1);
        cell.add(&outcome, Some((0, end.off)), LEAD, end.fastest_rad_s);
        cell
    }
}

#[test]
fn faults_in_every_mode_of_the_cycle() {
    let scene = scene("pick-cube", &[]);
    let bench = Bench::new(&scene);
    let lost = |joint, fault| (fault, Kind::ReadingLost(Raised::at(joint, fault)));
    let readings =
        [lost(0, Fault::SampleMissing), lost(5, Fault::CounterReset), lost(10, Fault::OutputFailed)];
    let jumps = [1, 5, 10].map(|joint| (Fault::CountJump, Kind::CounterJump { joint, counts: 1000 }));
    let late = [(Fault::TickLate, Kind::LateTicks)];
    type Try<'a> = &'a dyn Fn(usize) -> Cell;
    let rows: [(&str, Try<'_>); 8] = [
        ("1, 8, 9: a counter does not answer, its settings or an output read back wrong", &|at| {
            bench.injected(at, &readings)
        }),
        ("3: a counter jumps by 1000 counts, one of each finger", &|at| bench.injected(at, &jumps)),
        (
            "5: somebody pushes a finger with 0.3 N m, each finger; limit 2 rad/s, as for a first start",
            &|at| bench.pushed(at),
        ),
        ("7: a counter stands still, each joint", &|at| bench.frozen(at)),
        ("10: the link is cut", &|at| bench.link_lost(at, Kind::LinkCut)),
        ("10: the heartbeat stops, commands still arrive", &|at| bench.link_lost(at, Kind::HeartbeatStops)),
        ("11: every tick is late", &|at| bench.injected(at, &late)),
        ("none: the command `stop`", &|at| bench.stopped(at)),
    ];
    let columns = [0, 1, 2, 3, 5, 6];
    let mut lines = Vec::new();
    for (what, attempt) in rows {
        let cells = columns.map(|at| {
            let cell = attempt(at);
            // What a tick's own reading shows is found in that tick, and only what is in the air can fall.
            if what.starts_with("1,") || what.starts_with("3:") {
                assert_eq!((cell.found.clone(), cell.off.clone()), (0..=0, 1..=1), "{what}");
            }
            assert!(!cell.fates.contains(&Fate::Falls) || INSTANTS[at].0 == Mode::Carrying, "{what}");
            cell.words()
        });
        println!("{what}: {cells:#?}");
        let [moving, closing, grasping, carrying, putting, releasing] = cells;
        lines.push([what.to_owned(), moving, closing, grasping, carrying, putting, releasing]);
    }
    let [moving, closing, grasping, carrying, putting, releasing] = columns.map(|at| INSTANTS[at].2);
    let head = ["fault", moving, closing, grasping, carrying, putting, releasing];
    generated::check(DOCUMENT, "modes", &generated::table(head, &lines));
}

/// The gentle ways and the quick one, of what is held in the air and a little above its table.
#[test]
fn ways_to_let_go_of_what_is_carried() {
    let scene = scene("pick-cube", &[]);
    let (config, instants) = (config(&scene), instants(&scene));
    let commands =
        [("`stop`", Command::Stop), ("`release`", Command::Release), ("`put-down`", Command::PutDown)];
    let mut lines = Vec::new();
    let mut fates = Vec::new();
    for (words, command) in commands {
        // Above the table, the script goes on after so many ticks.
        let cells = [(3, 2800), (ABOVE, 800)].map(|(at, ticks)| {
            let course = Course { commands: vec![(LEAD, command)], ..Course::default() };
            let outcome = instants[at].then(&config, &course, LEAD as usize + ticks);
            assert_eq!(outcome.found(), None);
            let gone = outcome.turned.iter().position(|turned| turned.mode == Mode::Disarmed);
            let until = gone.unwrap_or(outcome.turned.len()) as u64;
            slews(&config, &outcome, until);
            let since_s = outcome.run.samples[LEAD as usize].t_s;
            let noticed = outcome.run.summary.noticed.iter().filter(|(t_s, _)| *t_s >= since_s);
            let told: Vec<String> = noticed
                .map(|(t_s, words)| format!("after {:.0} ticks: {words}", (t_s - since_s) * 1e3))
                .collect();
            let (first, last) = (&outcome.run.samples[LEAD as usize], last(&outcome));
            let down_mm = 1e3 * (last.position_m.z - first.position_m.z);
            let fate = Fate::of(&outcome);
            fates.push(fate);
            let step_nm = largest(steps_nm(&outcome, until));
            let told = match gone {
                Some(at) => format!("no torque after {} tick", off(&outcome, at as u64)),
                None => told.join("; "),
            };
            format!("{told}; {}, {down_mm:.0} mm lower; {step_nm:.3}", fate.words())
        });
        println!("{words}: {cells:#?}");
        let [air, above] = cells;
        lines.push([words.to_owned(), air, above]);
    }
    let head = ["command", "in the air", "a little above its table"];
    generated::check(DOCUMENT, "let-go", &generated::table(head, &lines));
    use Fate::{Falls, Held, Stays};
    assert_eq!(fates, [Falls, Stays, Falls, Stays, Held, Held]);
}
