//! The verdict on a run: did the grasp hold, did everything come to rest, with which forces.

use crate::sample::{ContactSample, Sample};
use crate::verdict::Outcome;
use blindgrasp_body::MAX_FINGERS;
use blindgrasp_plant::Lost;
use blindgrasp_shared::cycle::Noticed;
use serde::{Deserialize, Serialize};

/// Below this a joint counts as at rest, rad/s.
pub const REST_JOINT_SPEED_RAD_S: f64 = 1e-3;
/// Below this the object counts as at rest, m/s, ...
pub const REST_OBJECT_SPEED_M_S: f64 = 1e-4;
/// ... if it turns more slowly than this, rad/s.
pub const REST_OBJECT_SPIN_RAD_S: f64 = 1e-3;

/// Share of the whole desired normal force (Eq. 57) from which on a contact's demand of friction counts.
pub const FLOOR: f64 = 0.1;

/// Summary of a run, as `--json` prints it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the scene.
    pub scene: String,
    /// Simulated time, s.
    pub duration_s: f64,
    /// `true` if everything was at rest from some time on: all `|dq| < 1e-3 rad/s`, `|dx| < 1e-4 m/s`, `|w| < 1e-3
    /// rad/s`.
    pub settled: bool,
    /// The time from which on it was, s.
    pub settle_time_s: Option<f64>,
    /// The end of the run in a word.
    #[serde(default)]
    pub outcome: Outcome,
    /// `true` if the object was in the hand to the end, or was put down; where fingertips roll, if every one stayed on its face.
    pub grasp_held: bool,
    /// Time at which the grasp was lost, s.
    pub lost_at_s: Option<f64>,
    /// The reason, in words.
    pub lost_reason: Option<String>,
    /// The fault that the controller ended in, in words.
    pub fault: Option<String>,
    /// The hand's notices in words, with their times, s.
    #[serde(default)]
    pub noticed: Vec<(f64, String)>,
    /// The reason for which the scene's script was not done to the end.
    #[serde(default)]
    pub shortfall: Option<String>,
    /// The last instant.
    #[serde(rename = "final")]
    pub last: Last,
    /// Ratio of tangential to normal force, the friction coefficient that the grasp asks for: the largest during the run, of
    /// fingertips that press with more than a tenth of what Eq. 57 asks of them.
    pub friction_demand_max: f64,
    /// The same at the last instant.
    #[serde(default)]
    pub friction_demand_at_end: f64,
    /// The largest ratio before each fingertip pressed so much for the first time.
    #[serde(default)]
    pub friction_demand_in_first_touch: f64,
    /// Energy of Eq. 40.
    pub energy: Energy,
    /// Computing time, s.
    pub wall_s: f64,
    /// Simulated over computing time.
    pub real_time_factor: f64,
}

/// The last instant of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Indentation of each fingertip, m; negative where there is a gap.
    pub indentation_m: Vec<f64>,
    /// Way that each fingertip has slipped on the object since the start, m; none where it can't.
    #[serde(default)]
    pub slipped_m: Vec<f64>,
    /// Force of tables on the object, N.
    #[serde(default)]
    pub table_force_n: f64,
    /// Force of links and palm on the object, N.
    #[serde(default)]
    pub link_force_n: f64,
}

/// Energy of Eq. 40 (with Eq. 18 in place of Eq. 46, and the constant that makes every term positive) over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// At the start, J.
    pub initial_j: f64,
    /// At the end, J.
    pub final_j: f64,
    /// The most that it ever rose above an earlier value, J.
    pub increase_max_j: f64,
}

/// The end of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Ending {
    /// Name of the scene.
    pub scene: String,
    /// Simulated time, s.
    pub duration_s: f64,
    /// The time and the reason of the loss, if there was one.
    pub lost: Option<(f64, Lost)>,
    /// `true` if the object was in the hand, and was put down.
    pub is_put_down: bool,
    /// The fault that the controller ended in, in words.
    pub fault: Option<String>,
    /// The hand's notices, with their times, s.
    pub noticed: Vec<(f64, Noticed)>,
    /// The reason for which its script was not done to the end.
    pub shortfall: Option<String>,
    /// Computing time, s.
    pub wall_s: f64,
}

/// Sums up a run while it goes, so that no sample has to be kept for it.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Since when everything has been at rest, s.
    resting_since_s: Option<f64>,
    friction_demand_max: f64,
    friction_demand_in_first_touch: f64,
    friction_demand_at_end: f64,
    /// Fingers that have pressed enough for their demand to count.
    pressed: [bool; MAX_FINGERS],
    /// The energies of the run, and the least one, J.
    energy: Option<(Energy, f64)>,
}

impl Tally {
    /// Takes the next sample.
    pub fn see(&mut self, sample: &Sample) {
        self.resting_since_s = if at_rest(sample) { self.resting_since_s.or(Some(sample.t_s)) } else { None };
        self.friction_demand_at_end = 0.0;
        for (contact, pressed) in sample.contacts.iter().zip(&mut self.pressed) {
            let demand = friction_demand(contact);
            // Before touch, the law may pull a fingertip away from what is nearest to it.
            if contact.normal_force_n > (FLOOR * contact.full_force_n).max(0.0) {
                *pressed = true;
                self.friction_demand_at_end = self.friction_demand_at_end.max(demand);
                self.friction_demand_max = self.friction_demand_max.max(demand);
            } else if !*pressed {
                self.friction_demand_in_first_touch = self.friction_demand_in_first_touch.max(demand);
            }
        }
        let now_j = sample.energy_j;
        let first = (Energy { initial_j: now_j, ..Energy::default() }, f64::INFINITY);
        let (energy, least_j) = self.energy.get_or_insert(first);
        energy.final_j = now_j;
        *least_j = least_j.min(now_j);
        energy.increase_max_j = energy.increase_max_j.max(now_j - *least_j);
    }

    /// The verdict on a run whose last sample is `last`.
    pub fn summary(&self, ending: Ending, last: Option<&Sample>) -> Summary {
        let end = last.map(Last::of).unwrap_or_default();
        let settle_time_s = if ending.lost.is_none() { self.resting_since_s } else { None };
        Summary {
            scene: ending.scene,
            duration_s: ending.duration_s,
            settled: settle_time_s.is_some(),
            settle_time_s,
            outcome: Outcome::of(ending.lost.map(|(_, lost)| lost), ending.is_put_down, &end.slipped_m),
            grasp_held: ending.lost.is_none(),
            lost_at_s: ending.lost.map(|(t_s, _)| t_s),
            lost_reason: ending.lost.map(|(_, reason)| reason.to_string()),
            fault: ending.fault,
            noticed: ending.noticed.iter().map(|(t_s, noticed)| (*t_s, noticed.to_string())).collect(),
            shortfall: ending.shortfall,
            last: end,
            friction_demand_max: self.friction_demand_max,
            friction_demand_at_end: self.friction_demand_at_end,
            friction_demand_in_first_touch: self.friction_demand_in_first_touch,
            energy: self.energy.map(|(energy, _)| energy).unwrap_or_default(),
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
            slipped_m: sample.contacts.iter().filter_map(|c| c.friction.map(|of| of.slipped_m)).collect(),
            table_force_n: sample.table_force_n().norm(),
            link_force_n: sample.link_force_n().norm(),
        }
    }
}

/// Returns `true` if everything is at rest, within the limits that [`Summary::settled`] names.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Simulation;
    use blindgrasp_model::Scene;

    /// Samples of a run, changed so that they rest now and then, and their energy goes up and down.
    fn samples(count: usize, random: &mut fastrand::Rng) -> Vec<Sample> {
        let duration = format!("duration_s={:?}", (count - 1) as f64 / 1e3);
        let scene = Scene::load("prism", &[duration]).unwrap();
        let mut samples = Simulation::new(&scene).unwrap().run().samples;
        for sample in &mut samples {
            sample.speeds_rad_s.fill(0.0);
            sample.speeds_rad_s[1] = if random.u8(..4) == 0 { -2e-3 } else { -9e-4 };
            sample.velocity_m_s.fill(0.0);
            sample.spin_rad_s.fill(0.0);
            sample.spin_rad_s.y = if random.u8(..9) == 0 { 2e-3 } else { 0.0 };
            sample.energy_j = random.f64() - 0.5;
            for contact in &mut sample.contacts {
                contact.normal_force_n = random.f64();
                contact.full_force_n = 5.0;
                contact.lambda_n = [random.f64(), random.f64() - 0.5];
                contact.force_residual_n.fill(0.0);
                contact.force_residual_n.x = 0.1;
            }
        }
        samples
    }

    fn summary(samples: &[Sample], lost: Option<(f64, Lost)>) -> Summary {
        let mut tally = Tally::default();
        samples.iter().for_each(|sample| tally.see(sample));
        let ending = Ending {
            scene: "s".into(),
            duration_s: 1.0,
            lost,
            is_put_down: false,
            fault: None,
            noticed: Vec::new(),
            shortfall: None,
            wall_s: 0.5,
        };
        tally.summary(ending, samples.last())
    }

    /// Summed up one by one, and as the words of the fields have it.
    #[test]
    fn a_summary_is_what_all_samples_say() {
        let mut random = fastrand::Rng::with_seed(3);
        let mut settled = 0;
        for round in 0..300 {
            let samples = samples(2 + round % 40, &mut random);
            let summary = summary(&samples, None);
            let (first, last) = (&samples[0], &samples[samples.len() - 1]);
            let is_still = |sample: &Sample| sample.speeds_rad_s[1] > -1e-3 && sample.spin_rad_s.y < 1e-3;
            let from = (0..samples.len()).find(|&k| samples[k..].iter().all(is_still));
            assert_eq!(summary.settle_time_s, from.map(|k| samples[k].t_s));
            settled += usize::from(summary.settled);
            let ratio = |contact: &ContactSample| contact.tangential_force_n() / contact.normal_force_n;
            let most =
                |contacts: &mut dyn Iterator<Item = &ContactSample>| contacts.map(ratio).fold(0.0, f64::max);
            let presses = |contact: &ContactSample| contact.normal_force_n > 0.5;
            let pressed = &mut samples.iter().flat_map(|sample| &sample.contacts).filter(|c| presses(c));
            assert_eq!(summary.friction_demand_max, most(pressed));
            let at_end = &mut last.contacts.iter().filter(|contact| presses(contact));
            assert_eq!(summary.friction_demand_at_end, most(at_end));
            let first_touch = |finger: usize| {
                let contacts = samples.iter().map(move |sample| &sample.contacts[finger]);
                contacts.take_while(|contact| !presses(contact))
            };
            let first_touches = &mut (0..first.contacts.len()).flat_map(first_touch);
            assert_eq!(summary.friction_demand_in_first_touch, most(first_touches));
            assert_eq!((summary.energy.initial_j, summary.energy.final_j), (first.energy_j, last.energy_j));
            let rises = (0..samples.len()).flat_map(|late| (0..=late).map(move |early| (early, late)));
            let rises = rises.map(|(early, late)| samples[late].energy_j - samples[early].energy_j);
            assert_eq!(summary.energy.increase_max_j, rises.fold(0.0, f64::max));
            assert_eq!(summary.last.joint_speed_max_rad_s, -last.speeds_rad_s[1]);
            assert_eq!(summary.last.force_residual_n, 0.1);
        }
        assert!((50..250).contains(&settled), "{settled} of 300 settled: not much of a test");
    }

    #[test]
    fn what_is_lost_has_not_settled_and_what_never_began_has_no_figures() {
        let mut random = fastrand::Rng::with_seed(4);
        let mut still = samples(5, &mut random);
        for sample in &mut still {
            sample.speeds_rad_s.fill(0.0);
            sample.spin_rad_s.fill(0.0);
        }
        assert_eq!(summary(&still, None).settle_time_s, Some(0.0));
        let lost = summary(&still, Some((0.004, Lost::Diverged)));
        assert!(!lost.settled && !lost.grasp_held && lost.settle_time_s.is_none());
        assert_eq!(lost.lost_reason.as_deref(), Some("the motion diverged"));
        let nothing = summary(&[], Some((0.0, Lost::Rank)));
        assert_eq!((&nothing.last, nothing.energy), (&Last::default(), Energy::default()));
    }
}
