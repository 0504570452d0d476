//! Many objects, placed in the paper's hand and grasped in the paper's own model, with `u_st` and without, and once more with
//! the encoders, the delay, the limits and the friction of the hand.

use blindgrasp::model::Scene;
use blindgrasp::model::file::{ObjectFile, SceneFile};
use blindgrasp::place::Placement;
use blindgrasp::place::population::PlacingHand;
use blindgrasp::sim::Simulation;
use blindgrasp::sim::summary::Summary;
use blindgrasp_shared::control::AttitudeError;
use std::sync::Mutex;
use std::thread;
use std::time::Instant;

/// Long enough for a grasp that is going to be lost to be lost, mostly: the cube without `u_st` takes 2.2 s.
const DURATION: &str = "duration_s=5.0";

/// An object of the study.
#[derive(Clone, Debug)]
pub struct Specimen {
    /// The object.
    pub object: ObjectFile,
    /// Number of its faces.
    pub faces: usize,
    /// Largest distance between two corners, m.
    pub extent_m: f64,
}

/// The outcome of an object.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The placement, or why there is none.
    pub placed: Result<Box<Placement>, String>,
    /// Time that the search took, s.
    pub search_s: f64,
    /// The runs of its grasp.
    pub runs: Option<Runs>,
}

/// The runs of a grasp.
#[derive(Clone, Debug)]
pub struct Runs {
    /// In the paper's model.
    pub with: Summary,
    /// In the paper's model, with the attitude error that takes half of the angle.
    pub half_angle: Summary,
    /// In the paper's model, without `u_st`.
    pub without: Summary,
    /// With encoders, delay, limits and friction; none if the posture for the first touch can't be taken.
    pub real: Option<Summary>,
}

/// The hand of the study, with all that does not depend on the object.
pub struct Study {
    /// The hand in the paper's own model, whose links are not looked at.
    pub hand: PlacingHand,
    /// The same hand with links that touch.
    with_links: PlacingHand,
    /// The same hand with encoders, delay, limits and friction.
    real: SceneFile,
}

impl Default for Study {
    /// The paper's hand.
    fn default() -> Self {
        let file = |name: &str| Scene::load(name, &[DURATION.to_owned()]).expect("built in").file;
        let [mut paper, with_links] = [file("cube-ideal"), file("cube-ideal")];
        paper.plant.links = Some(false);
        let [hand, with_links] =
            [paper, with_links].map(|like| PlacingHand::of(like).expect("a built-in scene"));
        Self { hand, with_links, real: file("cube") }
    }
}

impl Study {
    /// Places an object and runs its grasp.
    fn run(&self, specimen: &Specimen) -> Outcome {
        let begun = Instant::now();
        let placed = self.hand.place(specimen.object.clone(), 1);
        let search_s = begun.elapsed().as_secs_f64();
        let placed = placed.map(|mut all| Box::new(all.swap_remove(0))).map_err(|none| none.to_string());
        let runs = placed.as_ref().ok().map(|placement| {
            let file = &placement.scene.file;
            let mut without = file.clone();
            without.control.gains.grasp[1] = 0.0;
            let mut half_angle = file.clone();
            half_angle.control.attitude_error = AttitudeError::HalfAngle;
            let real = SceneFile {
                object: file.object.clone(),
                pose: file.pose.clone(),
                contacts: file.contacts.clone(),
                ..self.real.clone()
            };
            Runs {
                with: simulate(&placement.scene),
                half_angle: simulate(&Scene::build(half_angle).expect("the same scene")),
                without: simulate(&Scene::build(without).expect("the same scene")),
                real: Scene::build(real).ok().map(|scene| simulate(&scene)),
            }
        });
        Outcome { placed, search_s, runs }
    }

    /// Places an object and grasps it with its weight, on a table that goes away, with encoders, delay, limits, friction of the joints
    /// and of the contacts: with `u_st`, also by half angles, without, and with the earlier law in its place, whose integral has
    /// this gain, N m/rad.
    ///
    /// # Errors
    /// The reason for which it is not placed.
    pub fn on_a_table(&self, object: &ObjectFile, integral_nm_rad: f64) -> Result<[Summary; 4], String> {
        let mut all = self.with_links.place(object.clone(), 1).map_err(|none| none.to_string())?;
        let Placement { scene, quality } = all.swap_remove(0);
        let SceneFile { object, pose, contacts, .. } = scene.file;
        let real = SceneFile { object, pose, contacts, ..self.real.clone() };
        let scene = Scene::build(real).map_err(|error| error.to_string())?;
        let file = Placement { scene, quality }.on_a_table();
        // Fingers that just touch stand otherwise than those that were placed.
        Scene::build(file.clone()).map_err(|error| error.to_string())?;
        let [_, attitude_nm] = file.control.gains.grasp;
        let sine = AttitudeError::Sine;
        let laws = [
            (attitude_nm, sine, 0.0),
            (attitude_nm, AttitudeError::HalfAngle, 0.0),
            (0.0, sine, 0.0),
            (0.0, sine, integral_nm_rad),
        ];
        Ok(laws.map(|(attitude_nm, attitude_error, integral_nm_rad)| {
            let mut file = file.clone();
            file.control.attitude_error = attitude_error;
            file.control.gains.grasp[1] = attitude_nm;
            file.control.gains.integral[0] = integral_nm_rad;
            simulate(&Scene::build(file).expect("the same scene"))
        }))
    }

    /// All specimens, on all processors, in their order.
    pub fn run_all(&self, specimens: &[Specimen]) -> Vec<Outcome> {
        spread(specimens, |specimen| self.run(specimen))
    }
}

/// Does something with each of many things, on all processors; the results in their order.
pub fn spread<T: Sync, R: Send>(things: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let results = Mutex::new(Vec::new());
    let next = Mutex::new(things.iter().enumerate());
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let Some((k, thing)) = next.lock().unwrap_or_else(|p| p.into_inner()).next() else {
                        break;
                    };
                    let result = work(thing);
                    results.lock().unwrap_or_else(|p| p.into_inner()).push((k, result));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap_or_else(|p| p.into_inner());
    results.sort_by_key(|(k, _)| *k);
    results.into_iter().map(|(_, result)| result).collect()
}

/// Runs a scene.
pub fn simulate(scene: &Scene) -> Summary {
    let run = Simulation::new(scene).expect("a scene that was built can be simulated").run();
    for sample in &run.samples {
        let values = sample.speeds_rad_s.iter().chain(sample.position_m.iter()).chain([&sample.energy_j]);
        assert!(values.into_iter().all(|v| v.is_finite()), "not finite at {} s", sample.t_s);
        assert!(sample.contacts.iter().all(|contact| contact.normal_force_n.is_finite()));
    }
    run.summary
}
