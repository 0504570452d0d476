//! The closed loop's theory at one instant: the residuals of Eq. 38, the desired normal force of Eq. 57, the energy of
//! Eq. 40.
//!
//! Departure from the print: the elastic part of the energy is `sum(P_i)` of Eq. 18, not the `dP` of Eq. 46. What Eq. 46
//! takes away, a constant force times the indentation, changes as the fingertips roll, so that with it Eq. 39 would not
//! hold; with Eq. 18 it does, as the inner product that the paper takes shows. The constant `3 N K_st` is added, so that
//! no term is negative. Where the earlier law's `u_I` acts, its potential belongs to the energy too.

use crate::sample::{ContactSample, EnergySample, Sample};
use blindgrasp_body::{Hand, MAX_FINGERS, MAX_JOINTS};
use blindgrasp_plant::{Motion, Plant};
use blindgrasp_shared::control::{Held, Latch, Laws, Stance};
use blindgrasp_shared::supervisor::Mode;
use nalgebra::Vector3;

/// The law as it would be with perfect sensors, in the precision of the plant: what the run is compared with.
#[derive(Clone, Debug)]
pub struct Observer {
    laws: Laws<f64, MAX_JOINTS>,
    latch: Latch<f64, MAX_JOINTS, MAX_FINGERS>,
    /// The hand grasped at the instant before.
    grasped: bool,
}

/// The controller's account of the tick that is observed.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// Estimated joint angles, rad.
    pub angles_rad: &'a [f64],
    /// Estimated joint speeds, rad/s.
    pub speeds_rad_s: &'a [f64],
    /// Torques applied, N m.
    pub torques_nm: &'a [f64],
    /// Share of `f_d` that acts.
    pub force_share: f64,
    /// Mode, as a word.
    pub mode: &'static str,
}

impl Observer {
    /// Observes laws whose latch closes where a plant is.
    pub fn new(laws: Laws<f64, MAX_JOINTS>, start: &Plant) -> Self {
        let latch = Latch::of(&start.model().hand, start.posture(), &start.motion().angles_rad);
        Self { laws, latch, grasped: false }
    }

    /// Takes the mode after a tick: where a grasp begins, the latch closes anew, as the controller's.
    pub fn follow(&mut self, mode: Mode, plant: &Plant) {
        let grasps = mode.is_grasp();
        if grasps && !self.grasped {
            self.latch = Latch::of(&plant.model().hand, plant.posture(), &plant.motion().angles_rad);
        }
        self.grasped = grasps;
    }

    /// Energy at this instant, after the velocities were solved for. The potentials are those of the whole law, also while
    /// its force is still growing; the virtual frame's, which has a target of its own, is left out.
    pub fn energies(&self, plant: &Plant) -> EnergySample {
        let grip = self.laws.grip(&self.latch);
        let Motion { angles_rad, speeds_rad_s, .. } = plant.motion();
        let (hand, posture, held) = (&plant.model().hand, plant.posture(), Held::nothing());
        let stance = Stance { hand, posture, angles_rad, speeds_rad_s, held: &held };
        let (_, account) = self.laws.torques(&stance, Some(&grip));
        let flows = plant.flows();
        let gains = self.laws.config().hold.damping_nm_s.iter();
        EnergySample {
            kinetic_j: plant.kinetic_energy_j(),
            elastic_j: plant.elastic_energy_j(),
            weight_j: plant.weight_energy_j(),
            potentials_j: account.potentials_j,
            motors_j: flows.motors,
            pushes_j: flows.pushes,
            damping_j: gains.zip(&flows.joint_speeds_squared).map(|(gain, squares)| gain * squares).sum(),
            indentation_j: flows.indentation,
            torsion_j: flows.torsion,
            friction_j: flows.friction,
            slip_j: flows.slip,
            tables_j: flows.tables,
            joint_speeds_squared: flows.joint_speeds_squared.iter().sum(),
            velocity_squared: flows.velocity_squared,
            spin_squared: flows.spin_squared,
        }
    }

    /// The plant at this instant, after its velocities were solved for.
    pub fn sample(&self, t_s: f64, plant: &Plant, seen: &Seen<'_>) -> Sample {
        let n = plant.model().hand.joint_count();
        let motion = plant.motion();
        let energies = self.energies(plant);
        Sample {
            t_s,
            angles_rad: motion.angles_rad[..n].to_vec(),
            speeds_rad_s: motion.speeds_rad_s[..n].to_vec(),
            estimated_angles_rad: seen.angles_rad[..n].to_vec(),
            estimated_speeds_rad_s: seen.speeds_rad_s[..n].to_vec(),
            torques_nm: seen.torques_nm[..n].to_vec(),
            position_m: motion.position_m,
            attitude: motion.attitude,
            velocity_m_s: motion.velocity_m_s,
            spin_rad_s: motion.spin_rad_s,
            contacts: self.contacts(plant, seen.force_share),
            others: plant.others(),
            tables: plant.tables(),
            energy_j: energies.of_equation_40_j(),
            energies,
            mode: seen.mode,
        }
    }

    fn contacts(&self, plant: &Plant, force_share: f64) -> Vec<ContactSample> {
        let hand: &Hand = &plant.model().hand;
        let posture = plant.posture();
        let law = &self.laws.grasp;
        let [force_n, stiffness_nm] = self.laws.gains().grasp;
        let pulls = law.approach_wrenches(hand, posture, force_n);
        let turns = law.attitude_wrenches(hand, posture, &self.latch.grasp, stiffness_nm);
        let fingers = plant.fingers();
        fingers
            .iter()
            .zip(pulls.iter().zip(&turns))
            .map(|(contact, (pull, turn))| {
                // A (x_c - x_i) and K_st B_sti in the contact frame.
                let full = contact.frame.tr_mul(&pull.force_n);
                let pull = full * force_share;
                let turn = contact.frame.tr_mul(&turn.moment_nm);
                let (force, rho) = (&contact.force, contact.rolling_radius_m);
                ContactSample {
                    normal_force_n: force.normal_n,
                    desired_normal_force_n: pull.y,
                    full_force_n: full.y,
                    lambda_n: [force.lambda_x_n, force.lambda_z_n],
                    torsion_nm: force.torsion_nm,
                    indentation_m: contact.indentation_m,
                    point_m: contact.point_m,
                    frame: contact.frame,
                    foot_m: contact.foot_m,
                    friction: contact.friction,
                    force_residual_n: Vector3::new(
                        -force.lambda_x_n - pull.x,
                        force.normal_n - pull.y,
                        -force.lambda_z_n - pull.z,
                    ),
                    moment_residual_nm: Vector3::new(
                        -rho * force.lambda_z_n - turn.x,
                        -turn.y,
                        rho * force.lambda_x_n - turn.z,
                    ),
                }
            })
            .collect()
    }
}
