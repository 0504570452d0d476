//! Sensitivity: one quantity at a time is varied, mostly on the cube of the experiments, up to where the grasp fails.

use super::evidence::{EvidenceError, scene, simulation};
use crate::sim::summary::Summary;
use rayon::prelude::*;
use serde::Serialize;

/// A sweep to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Varied {
    /// Its name.
    pub name: &'static str,
    /// What is varied, in words.
    pub what: &'static str,
    /// A built-in scene.
    pub scene: &'static str,
    /// Settings that hold for every run.
    pub settings: &'static [&'static str],
    /// The key and its values, from small to large: `KEY=A,B,C`.
    pub axis: &'static str,
    /// The unit of the values; empty where they have none.
    pub unit: &'static str,
    /// The value of the experiments; none where they have none.
    pub usual: &'static str,
}

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// The value, as it was set.
    pub value: String,
    /// The number that it is, if it is one.
    pub number: Option<f64>,
    /// Whether the grasp held to the end.
    pub held: bool,
    /// When it was lost, s.
    pub lost_at_s: Option<f64>,
    /// Why.
    pub lost_reason: Option<String>,
    /// From when on everything was at rest, s.
    pub settle_time_s: Option<f64>,
    /// Fastest joint at the end, rad/s.
    pub joint_speed_max_rad_s: f64,
    /// Largest difference of a normal force from Eq. 57 at the end, as a part of it.
    pub normal_error: f64,
}

/// A sweep that was done.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sweep {
    /// Its name.
    pub name: String,
    /// What is varied, in words.
    pub what: String,
    /// The key of the scene's configuration.
    pub key: String,
    /// Its unit; empty where it has none.
    pub unit: String,
    /// The scene.
    pub scene: String,
    /// Settings that held for every run.
    pub settings: Vec<String>,
    /// The value of the experiments.
    pub usual: String,
    /// Whether the joints had friction.
    pub has_friction: bool,
    /// The runs, in the order of the values.
    pub points: Vec<Point>,
}

/// The sweeps.
pub const SWEEPS: &[Varied] = &[
    Varied {
        name: "stiffness",
        what: "K_st in the paper's model, law at 1 kHz",
        scene: "cube-ideal",
        settings: &["duration_s=10"],
        axis: "control.attitude_stiffness_nm=0,5e-4,1e-3,1.5e-3,2e-3,3e-3,5e-3,1e-2,2e-2,3e-2,5e-2,0.1,0.2",
        unit: "N m",
        usual: "5e-3",
    },
    Varied {
        name: "stiffness-continuous",
        what: "K_st in the paper's model, law at 10 kHz",
        scene: "cube-ideal",
        settings: &["duration_s=10", "control.period_s=1e-4"],
        axis: "control.attitude_stiffness_nm=0,5e-4,1e-3,1.5e-3,2e-3,3e-3,5e-3,1e-2,2e-2,3e-2,5e-2,0.1,0.2",
        unit: "N m",
        usual: "5e-3",
    },
    Varied {
        name: "stiffness-experiment",
        what: "K_st with joint friction, encoders and delay",
        scene: "cube",
        settings: &["duration_s=4"],
        axis: "control.attitude_stiffness_nm=0,1e-3,5e-3,1e-2,2e-2,5e-2,0.1,0.2,0.5,1",
        unit: "N m",
        usual: "5e-3",
    },
    Varied {
        name: "integral",
        what: "K_I of the earlier law in the paper's model, law at 1 kHz",
        scene: "cube-ideal",
        settings: &["duration_s=10", "control.attitude_stiffness_nm=0"],
        axis: "control.integral_gain_nm_rad=0,1e-3,2e-3,3e-3,4e-3,5e-3,2e-2,0.1,0.2,0.5,2",
        unit: "N m/rad",
        usual: "2e-2",
    },
    Varied {
        name: "integral-continuous",
        what: "K_I of the earlier law in the paper's model, law at 10 kHz",
        scene: "cube-ideal",
        settings: &["duration_s=10", "control.attitude_stiffness_nm=0", "control.period_s=1e-4"],
        axis: "control.integral_gain_nm_rad=0,1e-3,2e-3,3e-3,4e-3,5e-3,2e-2,0.1,0.5,2",
        unit: "N m/rad",
        usual: "2e-2",
    },
    Varied {
        name: "force",
        what: "nominal force f_d",
        scene: "cube",
        settings: &["duration_s=4"],
        axis: "control.force_n=0.1,0.2,0.5,1,2,5,10,15,20,30,50",
        unit: "N",
        usual: "5",
    },
    Varied {
        name: "friction",
        what: "friction of the joints, as a factor on the assumed 4.7 mN m, with a tick of delay",
        scene: "cube",
        settings: &["duration_s=4"],
        axis: "friction.scale=0,0.05,0.1,0.2,0.3,0.5,0.7,1,2,5,10",
        unit: "",
        usual: "1",
    },
    Varied {
        name: "friction-without-delay",
        what: "the same without the tick of delay",
        scene: "cube",
        settings: &["duration_s=4", "actuators.output_delay_ticks=0"],
        axis: "friction.scale=0,0.05,0.1,0.2,0.3,0.5,0.7,1,2,5,10",
        unit: "",
        usual: "1",
    },
    Varied {
        name: "encoders",
        what: "encoder counts in a turn of a joint",
        scene: "cube",
        settings: &["duration_s=4"],
        axis: "hand.joint.*.encoder_counts_per_turn=20,50,100,200,500,1000,2000,5000,21600,100000",
        unit: "",
        usual: "21600",
    },
    Varied {
        name: "encoders-little-friction",
        what: "encoder counts in a turn of a joint, with a fifth of the friction",
        scene: "cube",
        settings: &["duration_s=4", "friction.scale=0.2"],
        axis: "hand.joint.*.encoder_counts_per_turn=200,500,1000,2000,5000,10000,21600,100000",
        unit: "",
        usual: "21600",
    },
    Varied {
        name: "period",
        what: "control period, from 10 kHz to 250 Hz",
        scene: "cube",
        settings: &["duration_s=4"],
        axis: "control.period_s=1e-4,2e-4,5e-4,1e-3,2e-3,3e-3,4e-3",
        unit: "s",
        usual: "1e-3",
    },
    Varied {
        name: "period-little-friction",
        what: "control period, with a fifth of the friction",
        scene: "cube",
        settings: &["duration_s=4", "friction.scale=0.2"],
        axis: "control.period_s=1e-4,2e-4,5e-4,1e-3,1.5e-3,2e-3,3e-3,4e-3",
        unit: "s",
        usual: "1e-3",
    },
    Varied {
        name: "delay",
        what: "delay between encoders and torques, in ticks",
        scene: "cube",
        settings: &["duration_s=4"],
        axis: "actuators.output_delay_ticks=0,1",
        unit: "",
        usual: "1",
    },
    Varied {
        name: "delay-little-friction",
        what: "delay in ticks, with a twentieth of the friction",
        scene: "cube",
        settings: &["duration_s=4", "friction.scale=0.05"],
        axis: "actuators.output_delay_ticks=0,1",
        unit: "",
        usual: "1",
    },
    Varied {
        name: "mass",
        what: "mass of the cube, weightless",
        scene: "cube",
        settings: &["duration_s=4"],
        axis: "object.mass_kg=2e-4,2.1e-3,2e-2,0.1,0.2,0.5,1,2,5",
        unit: "kg",
        usual: "2.1e-3",
    },
    Varied {
        name: "weight",
        what: "mass of the cube, with its weight",
        scene: "cube",
        settings: &["duration_s=4", "plant.gravity_on_object=true"],
        axis: "object.mass_kg=2e-4,2.1e-3,5e-3,1e-2,2e-2,5e-2,0.1,0.15,0.2,0.3,0.5,1",
        unit: "kg",
        usual: "2.1e-3",
    },
    Varied {
        name: "normal-viscosity",
        what: "xi of the fingertips for each square metre of contact, which Table IV leaves out",
        scene: "cube",
        settings: &["duration_s=4"],
        axis: "hand.fingertip.*.damping_n_s_m_per_m2=0,0.1,1,10,100,1e3,1e4",
        unit: "",
        usual: "1",
    },
    Varied {
        name: "torsional-viscosity",
        what: "b of the fingertips for each square metre of contact, which Table IV leaves out",
        scene: "cube",
        settings: &["duration_s=4"],
        axis: "hand.fingertip.*.torsional_damping_nm_s_rad_per_m2=0,10,100,1e3,1e4,1e5,1e6",
        unit: "",
        usual: "1e4",
    },
];

impl Varied {
    fn key(&self) -> &'static str {
        self.axis.split_once('=').map_or(self.axis, |(key, _)| key)
    }

    fn values(&self) -> impl Iterator<Item = &'static str> {
        self.axis.split_once('=').map_or("", |(_, values)| values).split(',')
    }

    /// The settings of the run with a value.
    fn settings(&self, value: &str) -> Vec<String> {
        let settings = self.settings.iter().map(|&setting| setting.to_owned());
        settings.chain([format!("{}={value}", self.key())]).collect()
    }
}

/// How many runs some sweeps have.
pub fn runs(sweeps: &[Varied]) -> usize {
    sweeps.iter().map(|varied| varied.values().count()).sum()
}

/// Does all runs of some sweeps; `told` is called with the name of the sweep after each run, from any thread.
///
/// # Errors
/// A sweep whose scene or values are bad.
pub fn sweep(sweeps: &[Varied], told: &(dyn Fn(&str) + Sync)) -> Result<Vec<Sweep>, EvidenceError> {
    sweeps.iter().map(|varied| one(varied, told)).collect()
}

fn one(varied: &Varied, told: &(dyn Fn(&str) + Sync)) -> Result<Sweep, EvidenceError> {
    let values: Vec<&str> = varied.values().collect();
    let run = |value: &&str| {
        let scene = scene(varied.name, varied.scene, &varied.settings(value))?;
        let summary = simulation(varied.name, &scene)?.run(|_| {}).summary;
        told(varied.name);
        Ok(point((*value).to_owned(), value.parse().ok(), &summary))
    };
    let points = values.par_iter().with_max_len(1).map(run).collect::<Result<Vec<_>, EvidenceError>>()?;
    let first = values.first().map_or(Vec::new(), |value| varied.settings(value));
    let friction = scene(varied.name, varied.scene, &first)?.friction.scale > 0.0;
    Ok(Sweep {
        name: varied.name.to_owned(),
        what: varied.what.to_owned(),
        key: varied.key().to_owned(),
        unit: varied.unit.to_owned(),
        scene: varied.scene.to_owned(),
        settings: varied.settings.iter().map(|&setting| setting.to_owned()).collect(),
        usual: varied.usual.to_owned(),
        has_friction: friction || varied.key() == "friction.scale",
        points,
    })
}

fn point(value: String, number: Option<f64>, summary: &Summary) -> Point {
    let forces = summary.last.normal_force_n.iter().zip(&summary.last.desired_normal_force_n);
    Point {
        value,
        number,
        held: summary.grasp_held,
        lost_at_s: summary.lost_at_s,
        lost_reason: summary.lost_reason.clone(),
        settle_time_s: summary.settle_time_s,
        joint_speed_max_rad_s: summary.last.joint_speed_max_rad_s,
        normal_error: forces.map(|(force, desired)| (force / desired - 1.0).abs()).fold(0.0, f64::max),
    }
}
