//! The verdict on a run: did the grasp hold, did everything come to rest, with which forces.

use crate::plant::Lost;
use crate::record::sample::{ContactSample, Sample};
use serde::Serialize;

/// Below this a joint counts as at rest, rad/s.
pub const REST_JOINT_SPEED_RAD_S: f64 = 1e-3;
/// Below this the object counts as at rest, m/s, ...
pub const REST_OBJECT_SPEED_M_S: f64 = 1e-4;
/// ... if it turns more slowly than this, rad/s.
pub const REST_OBJECT_SPIN_RAD_S: f64 = 1e-3;

/// Summary of a run, as `--json` prints it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the scene.
    pub scene: String,
    /// Simulated time, s.
    pub duration_s: f64,
    /// Whether everything was at rest from some time on: all `|dq| < 1e-3 rad/s`, `|dx| < 1e-4 m/s`, `|w| < 1e-3 rad/s`.
    pub settled: bool,
    /// The time from which on it was, s.
    pub settle_time_s: Option<f64>,
    /// Whether every fingertip stayed on its face to the end.
    pub grasp_held: bool,
    /// When the grasp was lost, s.
    pub lost_at_s: Option<f64>,
    /// Why, in words.
    pub lost_reason: Option<String>,
    /// The fault that the controller ended in, in words.
    pub fault: Option<String>,
    /// The last instant.
    #[serde(rename = "final")]
    pub last: Last,
    /// Largest ratio of tangential to normal force during the run: the friction coefficient that the grasp asks for.
    pub friction_demand_max: f64,
    /// Energy of Eq. 40.
    pub energy: Energy,
    /// Computing time, s.
    pub wall_s: f64,
    /// Simulated over computing time.
    pub real_time_factor: f64,
}

/// The last instant of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Last {
    /// Fastest joint, rad/s.
    pub joint_speed_max_rad_s: f64,
    /// Speed of the object, m/s.
    pub object_speed_m_s: f64,
    /// Angular speed of the object, rad/s.
    pub object_spin_rad_s: f64,
    /// Largest residual force `Delta lambda_i1` of Eq. 38, N.
    pub force_residual_n: f64,
    /// Largest residual moment `Delta lambda_i2` of Eq. 38, N m.
    pub moment_residual_nm: f64,
    /// Normal force of each finger, N.
    pub normal_force_n: Vec<f64>,
    /// The one that Eq. 57 asks for, N.
    pub desired_normal_force_n: Vec<f64>,
    /// Tangential force of each finger, N.
    pub tangential_force_n: Vec<f64>,
    /// Indentation of each fingertip, m.
    pub indentation_m: Vec<f64>,
}

/// Energy of Eq. 40 (with Eq. 18 in place of Eq. 46, and the constant that makes every term positive) over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Energy {
    /// At the start, J.
    pub initial_j: f64,
    /// At the end, J.
    pub final_j: f64,
    /// The most that it ever rose above an earlier value, J.
    pub increase_max_j: f64,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Ending {
    /// Name of the scene.
    pub scene: String,
    /// Simulated time, s.
    pub duration_s: f64,
    /// When and why the grasp was lost, if it was.
    pub lost: Option<(f64, Lost)>,
    /// The fault that the controller ended in, in words.
    pub fault: Option<String>,
    /// Computing time, s.
    pub wall_s: f64,
}

impl Summary {
    /// Sums up a run.
    pub fn of(ending: Ending, samples: &[Sample]) -> Self {
        let settle_time_s = if ending.lost.is_none() { settle_time_s(samples) } else { None };
        Self {
            scene: ending.scene,
            duration_s: ending.duration_s,
            settled: settle_time_s.is_some(),
            settle_time_s,
            grasp_held: ending.lost.is_none(),
            lost_at_s: ending.lost.map(|(t_s, _)| t_s),
            lost_reason: ending.lost.map(|(_, reason)| reason.to_string()),
            fault: ending.fault,
            last: samples.last().map(Last::of).unwrap_or_default(),
            friction_demand_max: largest(
                samples.iter().flat_map(|sample| &sample.contacts).map(friction_demand),
            ),
            energy: Energy::of(samples),
            wall_s: ending.wall_s,
            real_time_factor: ending.duration_s / ending.wall_s,
        }
    }
}

impl Last {
    fn of(sample: &Sample) -> Self {
        let each = |value: fn(&ContactSample) -> f64| sample.contacts.iter().map(value).collect::<Vec<_>>();
        Self {
            joint_speed_max_rad_s: fastest_joint(sample),
            object_speed_m_s: sample.velocity_m_s.norm(),
            object_spin_rad_s: sample.spin_rad_s.norm(),
            force_residual_n: largest(sample.contacts.iter().map(|c| c.force_residual_n.norm())),
            moment_residual_nm: largest(sample.contacts.iter().map(|c| c.moment_residual_nm.norm())),
            normal_force_n: each(|c| c.normal_force_n),
            desired_normal_force_n: each(|c| c.desired_normal_force_n),
            tangential_force_n: each(ContactSample::tangential_force_n),
            indentation_m: each(|c| c.indentation_m),
        }
    }
}

impl Energy {
    fn of(samples: &[Sample]) -> Self {
        let mut least = f64::INFINITY;
        let mut increase_max_j: f64 = 0.0;
        for sample in samples {
            least = least.min(sample.energy_j);
            increase_max_j = increase_max_j.max(sample.energy_j - least);
        }
        let at = |sample: Option<&Sample>| sample.map_or(0.0, |sample| sample.energy_j);
        Self { initial_j: at(samples.first()), final_j: at(samples.last()), increase_max_j }
    }
}

/// The time from which on everything was at rest, if it is at the end.
fn settle_time_s(samples: &[Sample]) -> Option<f64> {
    let resting = samples.iter().rev().take_while(|sample| at_rest(sample));
    resting.last().map(|sample| sample.t_s)
}

/// Whether everything is at rest, within the limits that [`Summary::settled`] names.
pub fn at_rest(sample: &Sample) -> bool {
    fastest_joint(sample) < REST_JOINT_SPEED_RAD_S
        && sample.velocity_m_s.norm() < REST_OBJECT_SPEED_M_S
        && sample.spin_rad_s.norm() < REST_OBJECT_SPIN_RAD_S
}

fn fastest_joint(sample: &Sample) -> f64 {
    largest(sample.speeds_rad_s.iter().map(|speed| speed.abs()))
}

fn friction_demand(contact: &ContactSample) -> f64 {
    contact.tangential_force_n() / contact.normal_force_n.max(f64::MIN_POSITIVE)
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}
