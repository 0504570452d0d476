//! The energy of a simulated hand, sub-step by sub-step: what the motors do, what hand and object store, and what is
//! taken by contacts and joints.

use crate::supervised::{Outcome, Turned};
use blindgrasp::body::dynamics::JointVector;
use blindgrasp::body::{MAX_FINGERS, MAX_JOINTS, Posture};
use blindgrasp::model::Scene;
use blindgrasp::plant::contact::Rows;
use blindgrasp::plant::friction::{stretch, torque};
use blindgrasp::plant::integrator::Plant;
use blindgrasp::sim;
use blindgrasp::sim::sample::Sample;
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::control::{Grip, Held, Latch, Stance};
use blindgrasp_shared::telemetry::Record;
use blindgrasp_shared::tick::{Input, Params, State, tick};
use std::f64::consts::TAU;

/// Power that the contacts take at a solved instant, W: `sum(2 T_i + xi (d(dr)/dt)^2)`, Eq. 39 as corrected.
pub fn contact_power_w(plant: &Plant) -> f64 {
    let (motion, hand) = (plant.motion(), &plant.model().hand);
    let mut power_w = 0.0;
    for (i, (contact, force)) in plant.contacts().iter().zip(plant.forces()).enumerate() {
        power_w += force.torsion_nm * force.torsion_nm / contact.torsion_nm_s;
        let object = contact.object_rows()[Rows::INDENTATION];
        let velocities = motion.velocity_m_s.iter().chain(motion.spin_rad_s.iter());
        let mut rate: f64 = object.iter().zip(velocities).map(|(row, v)| row * v).sum();
        for k in hand.joints_to(i) {
            let row =
                contact.joint_rows(plant.posture(), &plant.posture().centres_m[i], k)[Rows::INDENTATION];
            rate += row * motion.speeds_rad_s[k];
        }
        power_w += contact.damping_n_s_m * rate * rate;
    }
    power_w
}

/// Energy that hand and object store, J: kinetic, of the squeezed fingertips, and of the links' weight.
pub fn stored_j(plant: &Plant) -> f64 {
    let model = plant.model();
    let mut weight_j = 0.0;
    for k in 0..model.hand.joint_count() {
        let link = model.hand.link(k);
        let centre_m = plant.posture().link(k).point(&link.mass_centre_m);
        weight_j -= link.mass_kg * model.hand_gravity_m_s2.dot(&centre_m);
    }
    plant.kinetic_energy_j() + plant.elastic_energy_j() + weight_j
}

/// Sums since the beginning of a grasp, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Books {
    /// Work of the motors, with the turns that the joints really made.
    pub work_j: f64,
    /// By how much what hand and object store has grown.
    pub stored_j: f64,
    /// Energy that the contacts took.
    pub contacts_j: f64,
    /// Energy that the friction of the joints took; it can give back the little that its springs store.
    pub friction_j: f64,
}

/// A tick of a grasp: what the plant's books say at its beginning, and what the controller says.
#[derive(Clone, Debug)]
pub struct Page {
    /// The plant's.
    pub books: Books,
    /// The controller's.
    pub record: Record<MAX_JOINTS>,
}

/// A scene's grasp with its encoders and its output delay, tick by tick, as [`sim`] runs it.
///
/// # Panics
/// If the scene can't be simulated, has no encoders or a delay other than a tick or none, or loses its grasp.
pub fn keep(scene: &Scene) -> Vec<Page> {
    let params: Params<MAX_JOINTS, MAX_FINGERS> =
        Params::new(scene.hand.cast(), &scene.controller_config()).unwrap_or_else(|error| panic!("{error}"));
    assert!([0.0, 1.0].contains(&scene.actuators.output_delay_ticks), "a tick of delay, or none");
    let mut state = State::new();
    let blindgrasp::plant::Plant::Rolling(mut plant) =
        sim::plant(scene).unwrap_or_else(|error| panic!("{error}"))
    else {
        panic!("{}: its contacts do not roll", scene.name)
    };
    let friction = plant.model().friction.clone();
    let joints = scene.joints.len();
    let substep_s = scene.substep_s;
    let mut control = |plant: &Plant, command: Option<Command>| {
        let mut counts = [0; MAX_JOINTS];
        for (k, count) in counts.iter_mut().enumerate().take(joints) {
            let per_rad = scene.joints[k].encoder_counts_per_turn / TAU;
            *count = (plant.motion().angles_rad[k] * per_rad).round() as i32;
        }
        tick(&params, &mut state, &Input::counts(&counts, command))
    };
    let mut output = control(&plant, Some(Command::Arm));
    let (mut books, mut pages) = (Books::default(), Vec::new());
    let mut stretch_rad = [0.0; MAX_JOINTS];
    let mut applied_nm: Option<JointVector> = None;
    // Powers at the instant before: of the contacts, and of the friction of each joint.
    let mut before: Option<(f64, JointVector)> = None;
    let mut first_j = None;
    for step in 0..=(scene.duration_s / scene.control.period_s).round() as usize {
        let last = output;
        output = control(&plant, (step == 0).then_some(Command::Grasp(Grasp::CONFIGURED)));
        let acting = if scene.actuators.output_delay_ticks > 0.0 { &last } else { &output };
        let now_nm = acting.torques_nm.map(f64::from);
        let before_nm = applied_nm.replace(now_nm).unwrap_or(now_nm);
        for substep in 0..scene.substeps {
            // The torques change at the instant of the first sub-step, half of whose kick is before it.
            let torques_nm = match substep {
                0 => std::array::from_fn(|k| 0.5 * (before_nm[k] + now_nm[k])),
                _ => now_nm,
            };
            let ahead = plant.motion().speeds_rad_s;
            plant.solve(&torques_nm).unwrap_or_else(|lost| panic!("tick {step}: {lost}"));
            let speeds = plant.motion().speeds_rad_s;
            let rubbing: JointVector = std::array::from_fn(|k| {
                friction.get(k).map_or(0.0, |friction| {
                    let friction = torque(friction, stretch_rad[k], ahead[k]);
                    (friction.torque_nm + friction.damping_nm_s * speeds[k]) * speeds[k]
                })
            });
            let contacts_w = contact_power_w(&plant);
            if let Some((contacts_before_w, rubbing_before)) = before.replace((contacts_w, rubbing)) {
                books.contacts_j += 0.5 * substep_s * (contacts_before_w + contacts_w);
                let pairs = rubbing_before.iter().zip(&rubbing);
                books.friction_j += pairs.map(|(a, b)| 0.5 * substep_s * (a + b)).sum::<f64>();
            }
            let stored_j = stored_j(&plant);
            books.stored_j = stored_j - *first_j.get_or_insert(stored_j);
            if substep == 0 {
                pages.push(Page { books, record: output.record.clone() });
            }
            let angles = plant.motion().angles_rad;
            plant.advance();
            for k in 0..joints {
                let turned_rad = plant.motion().angles_rad[k] - angles[k];
                books.work_j += now_nm[k] * turned_rad;
                stretch_rad[k] = stretch(&friction[k], stretch_rad[k], turned_rad);
            }
        }
    }
    pages
}

/// Returns the ledger's excess with perfect sensors, at each sample, J: from the torques that acted, the turns that the
/// joints really made, and the law's potentials where they really were.
pub fn true_excess_j(scene: &Scene, outcome: &Outcome) -> Vec<f64> {
    let laws = sim::laws(scene).unwrap_or_else(|error| panic!("{error}"));
    let place = |sample: &Sample| {
        let mut angles_rad = [0.0; MAX_JOINTS];
        angles_rad[..sample.angles_rad.len()].copy_from_slice(&sample.angles_rad);
        let mut posture = Posture::at_base();
        scene.hand.forward_kinematics(&angles_rad, &mut posture);
        (posture, angles_rad)
    };
    let samples = &outcome.run.samples;
    let Some(first) = samples.first() else { return Vec::new() };
    let (posture, angles_rad) = place(first);
    let latch = Latch::of(&scene.hand, &posture, &angles_rad);
    let potential_j = |sample: &Sample, turned: &Turned| {
        let (posture, angles_rad) = place(sample);
        let gains = turned.gains.map(|&gain| gain.into());
        let held = Held::nothing();
        let (hand, speeds_rad_s) = (&scene.hand, &[0.0; MAX_JOINTS]);
        let stance = Stance { hand, posture: &posture, angles_rad: &angles_rad, speeds_rad_s, held: &held };
        let account = laws.torques(&stance, Some(&Grip { latch: &latch, gains })).1;
        account.potentials_j.iter().sum::<f64>() - account.weight_potential_j
    };
    let mut excesses_j = vec![0.0];
    for (pair, turned) in samples.windows(2).zip(&outcome.turned) {
        let [before, now] = pair else { continue };
        let turns = now.angles_rad.iter().zip(&before.angles_rad).map(|(now, before)| now - before);
        let work_j: f64 = before.torques_nm.iter().zip(turns).map(|(torque, turn)| torque * turn).sum();
        // At the gains of the tick before, as the ledger has it.
        let drop_j = potential_j(before, turned) - potential_j(now, turned);
        let last_j = excesses_j[excesses_j.len() - 1];
        excesses_j.push(last_j + work_j - drop_j - last_j * scene.control.period_s);
    }
    excesses_j
}
