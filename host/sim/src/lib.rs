//! The closed loop on the host: the tick that the microcontroller runs, in `f32`, against the plant, in `f64`.
//!
//! One control period has these stages, as on the hand:
//!
//! 1. **Sense**: the encoders count the joint angles of this instant (with noise, if asked for).
//! 2. **Control**: the tick takes the counts to torques.
//! 3. **Actuate**: the amplifiers hold, for one period, the torques of the tick before (the one-cycle output delay of a
//!    controller that reads first and writes last; or as many ticks before as the scene says), within what the motors can do.
//! 4. **Plant**: sub-steps up to the next period. Friction of the joints is the plant's.
//! 5. **Sample**: the state at the beginning of the period, for whoever listens to the stream of [`Step`]s.
//!
//! Time 0 is the tick that is told to grasp, or to do the first step of the scene's script. Before it the hand is armed while everything stands still, which starts the
//! estimator. Everything is deterministic: the same scene and seed give the same bytes.

pub mod controller;
pub mod csv;
pub mod delay;
pub mod encoders;
pub mod injection;
pub mod motors;
pub mod observe;
pub mod recorder;
pub mod sample;
mod script;
pub mod summary;
pub mod thinned;
pub mod tune;
pub mod verdict;
mod world;

pub use world::{model, plant, world};

use crate::sample::Sample;
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_model::{PlantSettings, Scene};
use blindgrasp_plant::coulomb::WorldError;
use blindgrasp_plant::{Lost, Plant};
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::control::Laws;
use blindgrasp_shared::cycle::Noticed;
use blindgrasp_shared::fault::Raised;
use blindgrasp_shared::parameter::ParameterError;
use blindgrasp_shared::tick::Sensed;
use controller::{Alone, Controller, Reach, Stepped, Turn};
use delay::Delay;
use encoders::Encoders;
use injection::{Injection, Injections, Sensing};
use motors::Motors;
use observe::{Observer, Seen};
use script::Script;
use std::num::NonZeroU64;
use std::time::{Duration, Instant};
use summary::{Ending, Summary, Tally};
use verdict::Judge;
use world::told_gravity_m_s2;

/// The reason for which a scene can't be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// The plant has no equations of motion.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The controller refuses its parameters.
    #[error("control: {0}")]
    Control(#[from] ParameterError),
}

/// One step of a run: a tick of the controller, and the world at that tick.
#[derive(Debug)]
pub struct Step<'a, C> {
    /// Time of the tick, s; 0 also of the first step, which arms the hand.
    pub t_s: f64,
    /// The controller after its tick.
    pub controller: &'a C,
    /// The world; `None` while the hand is armed, between two samples, and where the grasp is lost at this very instant.
    pub sample: Option<&'a Sample>,
}

/// A finished run.
#[derive(Clone, Debug)]
pub struct Run {
    /// One sample a control tick, unless [`Simulation::sample_every`] said otherwise.
    pub samples: Vec<Sample>,
    /// The first fault of the controller, and the number of the tick that found it.
    pub first_fault: Option<(u64, Raised)>,
    /// The verdict.
    pub summary: Summary,
}

/// A scene with a controller, as a stream of [`Step`]s. Nothing of a step is kept but what the verdict needs, so that an hour
/// takes no more memory than a second. A clone goes on from the same instant.
#[derive(Clone, Debug)]
pub struct Simulation<C = Alone> {
    name: String,
    joint_names: Vec<String>,
    ticks: u64,
    period_us: u64,
    /// Ticks from one sample to the next.
    sample_ticks: u64,
    motors: Motors,
    delay_ticks: f64,
    /// The force `f_d` when all of it acts, N.
    force_n: f32,
    ideal: bool,
    encoders: Encoders,
    injections: Injections,
    settings: PlantSettings,
    controller: C,
    plant: Plant,
    observer: Observer,
    judge: Judge,
    /// Torques on their way to the motors; `None` until the hand is armed.
    delay: Option<Delay>,
    /// The script, if the scene has one.
    script: Script,
    has_script: bool,
    /// Its notices, with their times, s.
    noticed: Vec<(f64, Noticed)>,
    /// The next tick.
    tick: u64,
    last: Option<Sample>,
    tally: Tally,
    first_fault: Option<(u64, Raised)>,
    fault: Option<Raised>,
    lost: Option<(f64, Lost)>,
    /// It goes on where an object with friction is lost.
    outlives: bool,
    computing: Duration,
}

impl Simulation {
    /// Prepares a scene, with the tick alone for its controller.
    ///
    /// # Errors
    /// What is wrong with its model or its gains.
    pub fn new(scene: &Scene) -> Result<Self, SimulationError> {
        Self::with_controller(scene, Alone::new(scene)?)
    }

    /// Runs to the end, or until the grasp is lost, and keeps all samples.
    pub fn run(mut self) -> Run {
        let Ok(run) = self.try_run();
        run
    }
}

impl<C: Controller> Simulation<C> {
    /// Prepares a scene. Its controller is disarmed.
    ///
    /// # Errors
    /// What is wrong with the scene's model or its gains.
    pub fn with_controller(scene: &Scene, controller: C) -> Result<Self, SimulationError> {
        let plant = plant(scene)?;
        Ok(Self {
            name: scene.name.clone(),
            joint_names: scene.joints.iter().map(|joint| joint.name.clone()).collect(),
            ticks: (scene.duration_s / scene.control.period_s).round() as u64,
            period_us: (scene.control.period_s * 1e6).round() as u64,
            sample_ticks: 1,
            motors: Motors::new(scene),
            delay_ticks: scene.actuators.output_delay_ticks,
            force_n: scene.control.force_n() as f32,
            ideal: scene.sensors.ideal,
            encoders: Encoders::new(scene),
            injections: Injections::default(),
            settings: scene.plant.clone(),
            observer: Observer::new(laws(scene)?, &plant),
            judge: Judge::new(scene.control.period_s),
            controller,
            plant,
            delay: None,
            script: Script::new(&scene.script),
            has_script: !scene.script.is_empty(),
            noticed: Vec::new(),
            tick: 0,
            last: None,
            tally: Tally::default(),
            first_fault: None,
            fault: None,
            lost: None,
            outlives: false,
            computing: Duration::ZERO,
        })
    }

    /// Makes one sample in so many ticks instead of one a tick, and that of the last.
    pub fn sample_every(&mut self, ticks: NonZeroU64) {
        self.sample_ticks = ticks.get();
    }

    /// Lets something go wrong.
    ///
    /// # Panics
    /// If the hand has no such joint.
    pub fn inject(&mut self, injection: Injection) {
        let joints = self.joint_names.len();
        assert!(injection.kind.joint().is_none_or(|joint| joint < joints), "the hand has {joints} joints");
        self.injections.push(injection);
    }

    /// Goes on after an object with friction is lost, to see what the hand then does.
    pub fn outlive_the_loss(&mut self) {
        self.outlives = matches!(self.plant, Plant::Coulomb(_));
    }

    /// The controller.
    pub fn controller(&self) -> &C {
        &self.controller
    }

    /// The controller, to be changed between two steps.
    pub fn controller_mut(&mut self) -> &mut C {
        &mut self.controller
    }

    /// The plant as it is.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The next tick; `None` when time is over, or the grasp is lost. The first arms the hand, while everything stands still.
    ///
    /// # Errors
    /// Why the controller can't go on.
    pub fn step(&mut self) -> Result<Option<Step<'_, C>>, C::Error> {
        if self.delay.is_none() {
            let armed = self.control(None, Some(Command::Arm))?;
            self.delay = Some(Delay::new(self.delay_ticks, armed.torques_nm));
            return Ok(Some(Step { t_s: 0.0, controller: &self.controller, sample: None }));
        }
        if (self.lost.is_some() && !self.outlives) || self.tick > self.ticks {
            return Ok(None);
        }
        let begun = Instant::now();
        let tick = self.tick;
        // 1, 2: sense and control. Without a script, the first tick is told to grasp.
        let t_s = self.time_s(tick);
        let grasp = tick == 0 && !self.has_script;
        let command = if grasp { Some(Command::Grasp(Grasp::CONFIGURED)) } else { self.script.due(t_s) };
        let stepped = self.control(Some(tick), command)?;
        self.script.see(t_s, stepped.noticed, stepped.refused);
        self.noticed.extend(stepped.noticed.map(|noticed| (t_s, noticed)));
        self.fault = stepped.fault;
        self.first_fault = self.first_fault.or(stepped.fault.map(|raised| (tick, raised)));
        let wanted_nm =
            self.delay.as_mut().map_or(stepped.torques_nm, |delay| delay.pass(stepped.torques_nm));
        let is_sampled = self.move_on(tick, &wanted_nm, &stepped);
        self.tick += 1;
        self.computing += begun.elapsed();
        let sample = self.last.as_ref().filter(|_| is_sampled);
        Ok(Some(Step { t_s: self.time_s(tick), controller: &self.controller, sample }))
    }

    /// The verdict on the run so far.
    pub fn summary(&self) -> Summary {
        let end_s = self.time_s(self.tick.min(self.ticks));
        let lost = self.lost.or_else(|| self.judge.at_end().map(|lost| (end_s, lost)));
        let ending = Ending {
            scene: self.name.clone(),
            duration_s: lost.map_or(end_s, |(t_s, _)| t_s),
            lost,
            is_put_down: self.judge.is_put_down(),
            fault: self.fault.map(|raised| self.in_words(raised)),
            noticed: self.noticed.clone(),
            shortfall: self.script.shortfall(),
            wall_s: self.computing.as_secs_f64(),
        };
        self.tally.summary(ending, self.last.as_ref())
    }

    /// Runs to the end, or until the grasp is lost, and keeps all samples.
    ///
    /// # Errors
    /// Why the controller can't go on.
    pub fn try_run(&mut self) -> Result<Run, C::Error> {
        let mut samples = Vec::with_capacity(self.ticks as usize + 1);
        while let Some(step) = self.step()? {
            samples.extend(step.sample.cloned());
        }
        Ok(Run { samples, first_fault: self.first_fault, summary: self.summary() })
    }

    /// Time of a tick, s. From whole microseconds, so that it prints as what it is.
    fn time_s(&self, tick: u64) -> f64 {
        (tick * self.period_us) as f64 / 1e6
    }

    /// A fault, with the joint's name.
    fn in_words(&self, raised: Raised) -> String {
        let joint = raised.joint.and_then(|joint| self.joint_names.get(usize::from(joint)));
        let joint = joint.map_or(String::new(), |name| format!("joint `{name}`: "));
        format!("fault {}: {joint}{}", raised.fault.number(), raised.fault.words())
    }

    /// One tick of the controller, with the joints as they are now. `tick` is none before the grasp.
    fn control(&mut self, tick: Option<u64>, command: Option<Command>) -> Result<Stepped, C::Error> {
        let motion = self.plant.motion();
        let (angles_rad, speeds_rad_s) =
            (motion.angles_rad.map(|v| v as f32), motion.speeds_rad_s.map(|v| v as f32));
        let counts = if self.ideal { [0; MAX_JOINTS] } else { self.encoders.read(&motion.angles_rad) };
        let mut sensing = Sensing { counts, failed: None, late: false, reach: Reach::Everything };
        if let Some(tick) = tick {
            self.injections.apply(tick, &mut sensing);
        }
        let sensed = match sensing.failed {
            Some(raised) => Sensed::Failed(raised),
            None if self.ideal => Sensed::Ideal { angles_rad: &angles_rad, speeds_rad_s: &speeds_rad_s },
            None => Sensed::Counts(&sensing.counts),
        };
        let t_s = tick.map_or(0.0, |tick| self.time_s(tick));
        let gravity_m_s2 = told_gravity_m_s2(&self.settings, t_s).map(|told| told.map(|v| v as f32).into());
        self.controller.step(&Turn {
            sensed,
            late: sensing.late,
            command,
            reach: sensing.reach,
            gravity_m_s2,
        })
    }

    /// Moves the plant on under the torques of one control period. Returns `true` if a sample was made.
    fn move_on(&mut self, tick: u64, wanted_nm: &[f32; MAX_JOINTS], stepped: &Stepped) -> bool {
        self.observer.follow(stepped.mode, &self.plant);
        let joints = self.joint_names.len();
        let (angles_rad, speeds_rad_s) =
            (stepped.angles_rad.map(f64::from), stepped.speeds_rad_s.map(f64::from));
        let force_share = if self.force_n > 0.0 { f64::from(stepped.force_n / self.force_n) } else { 0.0 };
        let observer = &self.observer;
        let t_s = self.time_s(tick);
        let is_due = tick.is_multiple_of(self.sample_ticks) || tick == self.ticks;
        let mut sample = None;
        let mut gone = None;
        let judge = &mut self.judge;
        // 3, 4: actuate, plant; 5: sample.
        let moved = self.motors.turn(&mut self.plant, wanted_nm, |plant, applied_nm| {
            let seen = Seen {
                angles_rad: &angles_rad[..joints],
                speeds_rad_s: &speeds_rad_s[..joints],
                torques_nm: &applied_nm[..joints],
                force_share,
                mode: stepped.mode.words(),
            };
            sample = is_due.then(|| observer.sample(t_s, plant, &seen));
            gone = judge.see(plant, stepped.mode);
        });
        let lost = moved.err().map_or(gone.map(|lost| (t_s, lost)), |(substep, lost)| {
            let at_s = (self.period_us * substep as u64) as f64 / (1e6 * self.motors.substeps as f64);
            Some((t_s + at_s, lost))
        });
        self.lost = self.lost.or(lost);
        let Some(sample) = sample else { return false };
        self.tally.see(&sample);
        self.last = Some(sample);
        true
    }
}

/// The control laws of a scene in the precision of the plant.
///
/// # Errors
/// A gain that is out of its range.
pub fn laws(scene: &Scene) -> Result<Laws<f64, MAX_JOINTS>, ParameterError> {
    scene.laws_config().prepare(&scene.hand)
}
