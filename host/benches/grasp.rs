//! `cargo bench`: the tick and the law on the host, one step of the plant, and a whole run.

use blindgrasp::body::dynamics::JointVector;
use blindgrasp::body::{MAX_JOINTS, Posture};
use blindgrasp::model::Scene;
use blindgrasp::plant::Motion;
use blindgrasp::plant::integrator::Plant;
use blindgrasp::sim::{self, Simulation};
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::control::{AttitudeError, Chosen, FrameConfig, Held, Hold, Latch, LawsConfig, Stance};
use blindgrasp_shared::cycle::CycleConfig;
use blindgrasp_shared::estimate::{Encoder, EstimatorConfig};
use blindgrasp_shared::fault::FaultConfig;
use blindgrasp_shared::hand::{Hand, Posture as PostureOf};
use blindgrasp_shared::joints::MotorConfig;
use blindgrasp_shared::limit::LimitConfig;
use blindgrasp_shared::link::encode;
use blindgrasp_shared::link::message::{Form, Reply, Signals};
use blindgrasp_shared::supervisor::SupervisorConfig;
use blindgrasp_shared::telemetry::Record;
use blindgrasp_shared::tick::{Config, Input, Params, State, tick};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Joints and fingers of the hand, exactly: what the firmware is built with.
const J: usize = 12;
const F: usize = 3;

fn cube() -> Scene {
    Scene::load("cube", &[]).expect("the scene is built in")
}

fn hand(scene: &Scene) -> Hand<f32, J, F> {
    scene.hand.fit().expect("twelve joints and three fingers").cast()
}

fn laws(scene: &Scene) -> LawsConfig<f32, J> {
    LawsConfig {
        gains: scene.control.gains.map(|&gain| gain as f32),
        chosen: Chosen::ALL,
        attitude_error: AttitudeError::Sine,
        frame: FrameConfig::least(),
        hold: Hold {
            damping_nm_s: std::array::from_fn(|k| scene.joints[k].damping_gain_nm_s_rad as f32),
            gravity_m_s2: Some(Vector3::new(0.0, 0.0, -9.81)),
        },
    }
}

fn angles(scene: &Scene) -> [f32; J] {
    std::array::from_fn(|k| scene.start.angles_rad[k] as f32)
}

fn controller(criterion: &mut Criterion) {
    let scene = cube();
    let (hand, config, angles) = (hand(&scene), laws(&scene), angles(&scene));
    let laws = config.prepare(&hand).expect("gains");
    let mut posture = PostureOf::at_base();
    hand.forward_kinematics(&angles, &mut posture);
    let (latch, held) = (Latch::of(&hand, &posture, &angles), Held::nothing());
    let speeds = [0.01; J];
    criterion.bench_function("forward kinematics (f32, 12 joints)", |bencher| {
        bencher.iter(|| hand.forward_kinematics(black_box(&angles), &mut posture));
    });
    criterion.bench_function("law with gravity (f32, 12 joints)", |bencher| {
        let grip = laws.grip(&latch);
        bencher.iter(|| {
            let stance = Stance {
                hand: &hand,
                posture: black_box(&posture),
                angles_rad: &angles,
                speeds_rad_s: black_box(&speeds),
                held: &held,
            };
            laws.torques(&stance, Some(&grip))
        });
    });

    let per_turn = scene.joints[0].encoder_counts_per_turn;
    let encoder = Encoder { zero_count: 0, rad_per_count: (TAU / per_turn) as f32, reversed: false };
    let config = Config {
        period_us: 1000,
        estimator: EstimatorConfig { bandwidth_hz: 50.0, encoders: [encoder; J] },
        motors: MotorConfig::FORWARD,
        laws: config,
        limits: LimitConfig {
            torque_nm: Some([1.3878; J]),
            slew_nm_s: Some([1000.0; J]),
            ..LimitConfig::NONE
        },
        faults: FaultConfig { possible_speed_rad_s: Some([200.0; J]), ..FaultConfig::LEAST },
        supervisor: SupervisorConfig { release_ms: 300, ..SupervisorConfig::LEAST },
        cycle: CycleConfig::LEAST,
    };
    let params = Params::new(hand, &config).expect("parameters");
    let mut state = State::new();
    let counts = angles.map(|angle| (f64::from(angle) * per_turn / TAU) as i32);
    for command in [Command::Arm, Command::Grasp(Grasp::CONFIGURED)] {
        tick(&params, &mut state, &Input::counts(&counts, Some(command)));
    }
    criterion.bench_function("tick (f32, 12 joints)", |bencher| {
        bencher.iter(|| tick(&params, &mut state, &Input::counts(black_box(&counts), None)));
    });
    let mut buffer = [0; 512];
    let record = tick(&params, &mut state, &Input::counts(&counts, None)).record;
    told(criterion, &record);
    criterion.bench_function("encode a record (12 joints)", |bencher| {
        bencher.iter(|| black_box(&record).encode(&mut buffer).map(|bytes| bytes.len()));
    });
}

/// A record as it goes out, in full and as the input record that stands in for it, and back.
fn told(criterion: &mut Criterion, record: &Record<J>) {
    let mut buffer = [0; 512];
    let mut group = criterion.benchmark_group("told");
    for (name, form) in [("full", Form::Full(Signals::ALL)), ("input", Form::Input)] {
        group.bench_function(format!("encode {name}"), |bencher| {
            bencher.iter(|| {
                let frame = encode(&form.of(black_box(record)), &mut buffer);
                frame.map_or(0, <[u8]>::len)
            });
        });
        let payload = postcard::to_allocvec(&form.of(record)).expect("a payload");
        group.bench_function(format!("decode {name}"), |bencher| {
            bencher.iter(|| black_box(Reply::<MAX_JOINTS>::decode(black_box(&payload)).expect("a reply")));
        });
    }
    group.finish();
}

/// The torques of a scene's law, which holds where the hand is at the start.
fn law(scene: &Scene) -> impl Fn(&Posture, &Motion) -> JointVector {
    let laws = sim::laws(scene).expect("gains");
    let angles = beginning(scene).angles_rad;
    let mut posture = Posture::at_base();
    scene.hand.forward_kinematics(&angles, &mut posture);
    let (latch, held) = (Latch::of(&scene.hand, &posture, &angles), Held::nothing());
    move |posture, motion| {
        let Motion { angles_rad, speeds_rad_s, .. } = motion;
        let stance = Stance { hand: &scene.hand, posture, angles_rad, speeds_rad_s, held: &held };
        laws.torques(&stance, Some(&laws.grip(&latch))).0
    }
}

/// The beginning of a scene that begins at rest.
fn beginning(scene: &Scene) -> Motion {
    let mut angles = [0.0; MAX_JOINTS];
    angles[..scene.start.angles_rad.len()].copy_from_slice(&scene.start.angles_rad);
    Motion::at_rest(angles, scene.start.position_m, scene.start.attitude)
}

/// A step of the plant, and with it the paper's two hands: solving and advancing, without the controller.
fn plant(criterion: &mut Criterion) {
    for (name, what) in
        [("cube-ideal", "12 joints, cube"), ("prism-ideal", "12 joints, prism"), ("hand-arm", "hand-arm")]
    {
        let scene = Scene::load(name, &[]).expect("the scene is built in");
        let start = beginning(&scene);
        let begin = || Plant::new(sim::model(&scene), start, scene.substep_s).expect("a plant");
        let mut plant = begin();
        let torques = law(&scene)(plant.posture(), &start);
        let mut steps = 0;
        criterion.bench_function(&format!("plant step ({what})"), |bencher| {
            bencher.iter(|| {
                // Constant torques lose the grasp in the end: begin anew well before that.
                steps += 1;
                if steps % 100 == 0 {
                    plant = begin();
                }
                plant.solve(black_box(&torques)).expect("the grasp holds");
                plant.advance();
            });
        });
    }
}

/// A step of the plant with Coulomb friction at 0.5 ms: of the cube held at rest; of the same with a table under it; of the first
/// moments of that, when contacts stick and slip in turn; and of fingers that slip. Only steps are timed: where it starts from
/// is made ready before.
/// With weight, links and palm: cube-table, at times at which the cube lies on the table, is taken, and is held; and slipping
/// through fingertips without a table.
fn plant_with_friction(criterion: &mut Criterion) {
    /// Steps from one start, during which constant torques change nothing of what is measured.
    const STEPS: u64 = 40;
    for (name, friction, has_table, at_s) in [
        ("held", None, true, 5.0),
        ("on a table", None, true, 0.9),
        ("settling on a table", None, true, 0.02),
        ("sliding", Some(0.02), false, 0.02),
    ] {
        let mut file = Scene::load("cube-table", &[]).expect("the built-in scene").file;
        file.plant.friction = friction;
        if !has_table {
            file.plant.tables.clear();
        }
        let mut simulation = Simulation::new(&Scene::build(file).expect("a scene")).expect("a plant");
        let mut torques = [0.0; MAX_JOINTS];
        while let Ok(Some(step)) = simulation.step()
            && step.t_s < at_s
        {
            for (torque, applied) in torques.iter_mut().zip(step.sample.iter().flat_map(|s| &s.torques_nm)) {
                *torque = *applied;
            }
        }
        let begun = simulation.plant();
        criterion.bench_function(&format!("plant step with friction ({name})"), |bencher| {
            bencher.iter_custom(|steps| {
                let mut time = Duration::ZERO;
                for done in (0..steps).step_by(STEPS as usize) {
                    let mut plant = begun.clone();
                    let begins = Instant::now();
                    for _ in done..steps.min(done + STEPS) {
                        plant.solve(black_box(&torques)).expect("it does not diverge");
                        plant.advance();
                    }
                    time += begins.elapsed();
                }
                time
            });
        });
    }
}

fn run(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sim");
    // Elements are simulated milliseconds.
    group.throughput(Throughput::Elements(1000)).sample_size(20);
    for name in ["cube", "prism", "hand-arm"] {
        let scene = Scene::load(name, &["duration_s=1.0".to_owned()]).expect("the scene is built in");
        group.bench_function(format!("{name}, 1 s simulated"), |bencher| {
            bencher.iter(|| Simulation::new(&scene).expect("a simulation").run());
        });
    }
    group.finish();
}

criterion_group!(benches, controller, plant, plant_with_friction, run);
criterion_main!(benches);
