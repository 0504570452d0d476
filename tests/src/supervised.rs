//! A simulated hand whose controller is watched: the tick with everything that a real hand's supervisor has, a host that
//! commands it and gives signs of life, wrong wiring, and people who push.

use crate::books::stored_j;
use blindgrasp::body::{MAX_FINGERS, MAX_JOINTS, Posture};
use blindgrasp::model::{HandModel, Scene};
use blindgrasp::plant::Motion;
use blindgrasp::plant::integrator::Plant;
use blindgrasp::sim::controller::{Controller, Reach, Stepped, Turn};
use blindgrasp::sim::injection::{Injection, Kind};
use blindgrasp::sim::{Run, Simulation, model};
use blindgrasp_shared::command::Command;
use blindgrasp_shared::control::PerGain;
use blindgrasp_shared::event::{Event, Events};
use blindgrasp_shared::fault::Raised;
use blindgrasp_shared::limit::Limiting;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::tick::{Config, Input, Params, State, tick};
use nalgebra::Vector3;
use std::convert::Infallible;
use std::ops::Range;

/// Ticks from one heartbeat of the host to the next: a fifth of what is allowed.
pub const HEARTBEAT_TICKS: u64 = 50;

/// The course of a run.
#[derive(Clone, Debug, Default)]
pub struct Course {
    /// The faults that are injected, with their times.
    pub injections: Vec<Injection>,
    /// The commands of the user, with their ticks; the grasp of tick 0 needs no entry.
    pub commands: Vec<(u64, Command)>,
    /// Somebody leans on the fingers: torques on the joints besides those of the motors, N m, and during which ticks.
    pub pushes: Vec<(Range<u64>, [f32; MAX_JOINTS])>,
    /// Joints whose motor turns the wrong way, from a tick on.
    pub reversed_motors: Vec<(u64, usize)>,
}

impl Course {
    /// Nothing but one thing that goes wrong.
    pub fn fault(at_tick: u64, kind: Kind) -> Self {
        Self { injections: vec![Injection { at_tick, kind }], ..Self::default() }
    }
}

/// One tick of the controller.
#[derive(Clone, Copy, Debug)]
pub struct Turned {
    /// Torques that it asked for, N m.
    pub torques_nm: [f32; MAX_JOINTS],
    /// Joint speeds as it saw them, rad/s.
    pub speeds_rad_s: [f32; MAX_JOINTS],
    /// The limit that acted on each joint.
    pub limiting: [Limiting; MAX_JOINTS],
    /// The gains that act.
    pub gains: PerGain<f32>,
    /// The potential of each, J.
    pub potentials_j: PerGain<f32>,
    /// Work of the motors since the grasp began, J.
    pub work_j: f32,
    /// The part of it that the law's damping took, J.
    pub damped_j: f32,
    /// Work of the last second beyond the drop of the potentials, J.
    pub excess: f32,
    /// The mode.
    pub mode: Mode,
    /// The fault that the hand is in.
    pub fault: Option<Raised>,
}

/// The controller.
#[derive(Clone, Debug)]
struct Supervised {
    params: Params<MAX_JOINTS, MAX_FINGERS>,
    state: State<MAX_JOINTS, MAX_FINGERS>,
    course: Course,
    /// None before the grasp.
    tick: Option<u64>,
    turned: Vec<Turned>,
}

impl Controller for Supervised {
    type Error = Infallible;

    fn step(&mut self, turn: &Turn<'_>) -> Result<Stepped, Infallible> {
        let (now, course) = (self.tick, &self.course);
        let asked = course.commands.iter().find(|(at, _)| Some(*at) == now).map(|&(_, command)| command);
        let heartbeat =
            turn.reach == Reach::Everything && now.is_none_or(|tick| tick.is_multiple_of(HEARTBEAT_TICKS));
        let input = Input {
            sensed: turn.sensed,
            events: Events::NONE.with(Event::Late, turn.late).with(Event::Heartbeat, heartbeat),
            command: turn.command.or(asked).filter(|_| turn.reach != Reach::Nothing),
        };
        let output = tick(&self.params, &mut self.state, &input);
        let record = &output.record;
        let mut limiting = [Limiting::NONE; MAX_JOINTS];
        for (limiting, reason) in limiting.iter_mut().zip(record.limiting.as_slice()) {
            *limiting = *reason;
        }
        if now.is_some() {
            self.turned.push(Turned {
                torques_nm: output.torques_nm,
                speeds_rad_s: *self.state.speeds_rad_s(),
                limiting,
                gains: record.gains,
                potentials_j: record.potentials_j,
                work_j: record.work_j,
                damped_j: record.damped_j,
                excess: record.excess_j,
                mode: record.mode,
                fault: record.fault,
            });
        }
        let mut torques_nm = output.torques_nm;
        if let Some(now) = now {
            for &(_, joint) in course.reversed_motors.iter().filter(|(from, _)| *from <= now) {
                torques_nm[joint] = -torques_nm[joint];
            }
            for (_, push_nm) in course.pushes.iter().filter(|(ticks, _)| ticks.contains(&now)) {
                for (torque, push) in torques_nm.iter_mut().zip(push_nm) {
                    *torque += push;
                }
            }
        }
        self.tick = Some(now.map_or(0, |tick| tick + 1));
        Ok(Stepped {
            torques_nm,
            angles_rad: *self.state.angles_rad(),
            speeds_rad_s: *self.state.speeds_rad_s(),
            force_n: record.gains.grasp[0],
            mode: record.mode,
            fault: record.fault,
            noticed: record.notice,
            refused: record.answer.and_then(|answer| answer.refused),
        })
    }
}

/// The outcome of a course.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The run, as the plant had it.
    pub run: Run,
    /// The controller's ticks.
    pub turned: Vec<Turned>,
}

impl Outcome {
    /// The first fault and its tick.
    pub fn found(&self) -> Option<(u64, Raised)> {
        self.run.first_fault
    }
}

/// The configuration of a scene's controller with the two watches that only a hand with a host has: heartbeat and
/// deadline, as its firmware has them.
pub fn config(scene: &Scene) -> Config<MAX_JOINTS> {
    let firmware = HandModel::of(scene).unwrap_or_else(|error| panic!("{error}")).config;
    let mut config = scene.controller_config();
    config.faults.heartbeat_ms = firmware.faults.heartbeat_ms;
    config.faults.late_ticks = firmware.faults.late_ticks;
    config
}

/// A built-in scene with settings `KEY=VALUE`.
pub fn scene(name: &str, settings: &[&str]) -> Scene {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    Scene::load(name, &settings).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs a course.
pub fn run(scene: &Scene, course: &Course) -> Outcome {
    run_with(scene, &config(scene), course)
}

/// Runs a course with a configuration of one's own.
pub fn run_with(scene: &Scene, config: &Config<MAX_JOINTS>, course: &Course) -> Outcome {
    let params = Params::new(scene.hand.cast(), config).unwrap_or_else(|error| panic!("{error}"));
    let mut simulation = simulation(scene, params, course);
    let Ok(run) = simulation.try_run();
    Outcome { run, turned: simulation.controller().turned.clone() }
}

fn simulation(
    scene: &Scene,
    params: Params<MAX_JOINTS, MAX_FINGERS>,
    course: &Course,
) -> Simulation<Supervised> {
    let controller =
        Supervised { params, state: State::new(), course: course.clone(), tick: None, turned: Vec::new() };
    let mut simulation =
        Simulation::with_controller(scene, controller).unwrap_or_else(|error| panic!("{error}"));
    for injection in &course.injections {
        simulation.inject(*injection);
    }
    simulation
}

/// An instant of a run, from which several courses can be tried.
#[derive(Clone, Debug)]
pub struct Instant<'a> {
    scene: &'a Scene,
    simulation: Simulation<Supervised>,
}

impl<'a> Instant<'a> {
    /// The beginning of a scene with a script, whose hand knows its postures.
    pub fn beginning(scene: &'a Scene) -> Self {
        let mut simulation = simulation(scene, with_postures(scene, &config(scene)), &Course::default());
        simulation.outlive_the_loss();
        Self { scene, simulation }
    }

    /// Goes on by a tick. Returns its mode; `None` at the end.
    pub fn step(&mut self) -> Option<Mode> {
        let Ok(step) = self.simulation.step();
        step?;
        let turned = &mut self.simulation.controller_mut().turned;
        let mode = turned.last().map_or(Mode::Armed, |turned| turned.mode);
        turned.clear();
        Some(mode)
    }

    /// Tries a course from here on with a configuration, for so many ticks. Its ticks, and those of the outcome, count from here; the
    /// object may be lost meanwhile.
    pub fn then(&self, config: &Config<MAX_JOINTS>, course: &Course, ticks: usize) -> Outcome {
        let mut simulation = self.simulation.clone();
        let controller = simulation.controller_mut();
        let here = controller.tick.replace(0).unwrap_or(0);
        controller.course = course.clone();
        controller.params = with_postures(self.scene, config);
        for injection in &course.injections {
            simulation.inject(Injection { at_tick: here + injection.at_tick, ..*injection });
        }
        let mut samples = Vec::with_capacity(ticks);
        while samples.len() < ticks {
            let Ok(step) = simulation.step();
            let Some(step) = step else { break };
            samples.extend(step.sample.cloned());
        }
        let turned = simulation.controller().turned.clone();
        let first_fault = (0..).zip(&turned).find_map(|(tick, turned)| Some((tick, turned.fault?)));
        Outcome { run: Run { samples, first_fault, summary: simulation.summary() }, turned }
    }
}

fn with_postures(scene: &Scene, config: &Config<MAX_JOINTS>) -> Params<MAX_JOINTS, MAX_FINGERS> {
    Params::new(scene.hand.cast(), config)
        .and_then(|params| params.with_postures(scene.named_postures()))
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Joint torques, N m, of a force on the centre of a fingertip, N, in the base frame, with the hand as the scene starts it.
pub fn push_nm(scene: &Scene, fingertip: usize, force_n: Vector3<f64>) -> [f32; MAX_JOINTS] {
    let mut angles_rad = [0.0; MAX_JOINTS];
    angles_rad[..scene.start.angles_rad.len()].copy_from_slice(&scene.start.angles_rad);
    let mut posture = Posture::at_base();
    scene.hand.forward_kinematics(&angles_rad, &mut posture);
    let torques_nm = scene.hand.jacobians(&posture, fingertip).0.tr_mul(&force_n);
    std::array::from_fn(|k| torques_nm[k] as f32)
}

/// Mechanical energy of hand and object at each sample from one on, J: kinetic, of the squeezed fingertips, and of the
/// links' weight. Without torque it can only fall, but for what the friction of the joints has stored.
pub fn mechanical_energy_j(scene: &Scene, outcome: &Outcome, from: usize) -> Vec<f64> {
    let energy = |sample: &blindgrasp::sim::sample::Sample| {
        let padded = |values: &[f64]| std::array::from_fn(|k| values.get(k).copied().unwrap_or(0.0));
        let motion = Motion {
            angles_rad: padded(&sample.angles_rad),
            position_m: sample.position_m,
            attitude: sample.attitude,
            speeds_rad_s: padded(&sample.speeds_rad_s),
            velocity_m_s: sample.velocity_m_s,
            spin_rad_s: sample.spin_rad_s,
        };
        let plant = Plant::new(model(scene), motion, scene.substep_s).expect("it ran");
        stored_j(&plant)
    };
    outcome.run.samples[from.min(outcome.run.samples.len())..].iter().map(energy).collect()
}

/// Torque that the joints' friction can give back once, J: what its springs store.
pub fn friction_energy_j(scene: &Scene) -> f64 {
    scene.joints.iter().map(|joint| 0.5 * joint.friction.coulomb_nm * joint.friction.presliding_rad).sum()
}
