//! The same hand, object and goal, and several ways there.

use crate::evidence::{EvidenceError, scene, simulation};
use crate::laws::{Law, Lost, built};
use blindgrasp_model::Scene;
use blindgrasp_model::file::PushFile;
use blindgrasp_shared::math::Real;
use blindgrasp_sim::Run;
use blindgrasp_sim::sample::Sample;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use serde::Serialize;
use std::num::NonZeroU64;

/// A way: what the object is pushed with for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path {
    /// Its name.
    pub name: &'static str,
    /// The push in the base frame of the hand, N.
    pub force_n: [f64; 3],
}

/// The ways. A half newton is a tenth of `f_d`, and moves the cube by centimetres.
pub const PATHS: [Path; 5] = [
    Path { name: "not pushed", force_n: [0.0; 3] },
    Path { name: "pushed to +x", force_n: [0.5, 0.0, 0.0] },
    Path { name: "pushed to +y", force_n: [0.0, 0.5, 0.0] },
    Path { name: "pushed to -y", force_n: [0.0, -0.5, 0.0] },
    Path { name: "pushed to +z", force_n: [0.0, 0.0, 0.5] },
];
/// `K_st`, N m, or `K_I`, N m/rad; without a gain there is the law `u_s` alone.
pub const GAINS: [f64; 6] = [5e-4, 2e-3, 5e-3, 2e-2, 0.1, 0.5];

const RUN: &str = "paths";
/// The paper's model, with ten times the damping gain of Table VII: with the printed one the grasp swings for longer than a
/// minute before it shows where it comes to rest. Damping does nothing at rest.
const SETTINGS: [&str; 2] = ["duration_s=14", "control.damping_scale=10"];
const PUSHED_FROM_S: f64 = 2.0;
const PUSHED_FOR_S: f64 = 1.0;
const RISE_S: f64 = 0.2;
/// A fastest joint below this counts as near enough to rest, rad/s: it would need minutes to move the object as far as the laws
/// differ.
const SLOW_RAD_S: f64 = 1e-2;
/// Ticks from one sample to the next.
const SAMPLE_TICKS: u64 = 20;

/// The end of a way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Final {
    /// The law.
    pub law: Law,
    /// Its gain.
    pub gain: f64,
    /// The way.
    pub path: &'static str,
    /// The loss of the grasp, if there was one.
    pub lost: Option<Lost>,
    /// Distance by which the object moved while the push rose and lasted, m.
    pub pushed_m: f64,
    /// Position of the object at the end, from that at the start, m.
    pub moved_m: [f64; 3],
    /// Its turn since, a rotation vector in base axes, rad.
    pub turned_rad: [f64; 3],
    /// By how much each fingertip has turned against the next, rad.
    pub relative_turns_rad: Vec<f64>,
    /// Normal forces in the end, N.
    pub normal_force_n: Vec<f64>,
    /// Those that Eq. 57 foretells there, N.
    pub equation_57_n: Vec<f64>,
    /// Tangential forces in the end, N.
    pub tangential_force_n: Vec<f64>,
    /// The fastest joint in the end, rad/s.
    pub joint_speed_max_rad_s: f64,
}

impl Final {
    /// Returns `true` if the grasp held.
    pub fn held(&self) -> bool {
        self.lost.is_none()
    }

    /// Returns `true` if it held, and came near enough to rest to show where and with which forces.
    pub fn rests(&self) -> bool {
        self.held() && self.joint_speed_max_rad_s < SLOW_RAD_S
    }

    /// Returns the distance of the object from where it was at the start, m.
    pub fn distance_m(&self) -> f64 {
        Vector3::from(self.moved_m).norm()
    }

    /// By how much it has turned, rad.
    pub fn turn_rad(&self) -> f64 {
        Vector3::from(self.turned_rad).norm()
    }

    /// The largest difference of a normal force from Eq. 57, as a part of it.
    pub fn off_equation_57(&self) -> f64 {
        let forces = self.normal_force_n.iter().zip(&self.equation_57_n);
        let off = forces.map(|(force, foretold)| (force / foretold - 1.0).abs());
        off.fold(0.0, |most, off| if off > most || off.is_nan() { off } else { most })
    }

    fn of(law: Law, gain: f64, path: &Path, scene: &Scene, run: &Run) -> Self {
        let samples = &run.samples;
        let ends = samples.first().zip(samples.last());
        let at = |t_s: f64| samples.iter().find(|sample| sample.t_s >= t_s);
        let pushed = at(PUSHED_FROM_S).zip(at(PUSHED_FROM_S + PUSHED_FOR_S - RISE_S));
        let last = &run.summary.last;
        Self {
            law,
            gain,
            path: path.name,
            lost: Lost::of(&run.summary),
            pushed_m: pushed.map_or(0.0, |(a, b)| (b.position_m - a.position_m).norm()),
            moved_m: ends.map_or([f64::NAN; 3], |(a, b)| (b.position_m - a.position_m).into()),
            turned_rad: ends.map_or([f64::NAN; 3], |(a, b)| turn(a, b).into()),
            relative_turns_rad: ends.map_or(Vec::new(), |(a, b)| relative_turns(scene, a, b)),
            normal_force_n: last.normal_force_n.clone(),
            equation_57_n: last.desired_normal_force_n.clone(),
            tangential_force_n: last.tangential_force_n.clone(),
            joint_speed_max_rad_s: last.joint_speed_max_rad_s,
        }
    }
}

/// Returns the turn of the object, a rotation vector in base axes, rad.
fn turn(from: &Sample, to: &Sample) -> Vector3<f64> {
    let q: UnitQuaternion<f64> = to.attitude * from.attitude.inverse();
    let (cosine, axis) = (q.w.abs(), q.imag() * q.w.signum());
    let sine = axis.norm();
    if sine > 1e-12 { axis * (2.0 * libm::atan2(sine, cosine) / sine) } else { 2.0 * axis }
}

/// The angles `alpha_i` of Eq. 45, rad.
fn relative_turns(scene: &Scene, from: &Sample, to: &Sample) -> Vec<f64> {
    let count = scene.hand.fingertip_count();
    let attitudes = |sample: &Sample| {
        let posture = sample.posture(&scene.hand);
        posture.attitudes[..count].iter().map(|r| Rotation3::from_matrix_unchecked(*r)).collect::<Vec<_>>()
    };
    let (before, after) = (attitudes(from), attitudes(to));
    (0..count)
        .map(|i| {
            let next = (i + 1) % count;
            let turned = (after[i].inverse() * after[next]) * (before[i].inverse() * before[next]).inverse();
            let m = turned.matrix();
            let axis = Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]);
            libm::atan2(axis.norm_squared().square_root(), m.trace() - 1.0)
        })
        .collect()
}

/// Every law, gain and way.
pub(super) fn plan() -> Vec<(Law, f64, Path)> {
    let gains = |law: Law| if law == Law::NormalOnly { vec![0.0] } else { GAINS.to_vec() };
    let laws = Law::ALL.into_iter().flat_map(|law| gains(law).into_iter().map(move |gain| (law, gain)));
    laws.flat_map(|(law, gain)| PATHS.into_iter().map(move |path| (law, gain, path))).collect()
}

/// Follows every way.
pub(super) fn follow(told: &(dyn Fn(&str) + Sync)) -> Result<Vec<Final>, EvidenceError> {
    let file = scene(RUN, "cube-ideal", &SETTINGS.map(str::to_owned))?.file;
    let one = |(law, gain, path): &(Law, f64, Path)| {
        let mut file = file.clone();
        law.set(&mut file.control, *gain);
        if path.force_n != [0.0; 3] {
            file.plant.pushes.push(PushFile {
                from_s: PUSHED_FROM_S,
                for_s: PUSHED_FOR_S,
                rise_s: RISE_S,
                force_n: path.force_n,
                moment_nm: [0.0; 3],
            });
        }
        let scene = built(RUN, file)?;
        let mut simulation = simulation(RUN, &scene)?;
        simulation.sample_every(NonZeroU64::new(SAMPLE_TICKS).unwrap_or(NonZeroU64::MIN));
        let run = simulation.run();
        told(RUN);
        Ok(Final::of(*law, *gain, path, &scene, &run))
    };
    plan().par_iter().with_max_len(1).map(one).collect()
}
