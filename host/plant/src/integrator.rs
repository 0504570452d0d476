//! The plant's advance in time.
//!
//! Positions live at whole steps, velocities at half steps between them (leapfrog). At each whole step the velocities
//! `v` of *that instant* are solved for together with the multipliers (`coupling.rs`), as half a step of the implicit
//! Euler rule from the half-step velocities before, with the rolling constraint `P v = 0` (Eq. 25) exact; reflecting
//! the old half-step velocities about `v` gives the new ones, which carry the positions to the next whole step. That is
//! the implicit midpoint rule for everything linear in the velocities and the nonholonomic leapfrog of McLachlan and
//! Perlmutter (2006) for the constraints: second order for one evaluation and one factorization a step, stable for any
//! damping, and without numerical damping: multipliers do no work, dampers only take energy.
//!
//! - Contact stiffness enters with Newmark's `beta = 1/4` (a stiffness frozen at the step, averaged over the positions
//!   around it): stable for any stiffness, still second order.
//! - Velocity products (Coriolis forces) use the velocities extrapolated from the two whole steps before.
//! - The object's rotation is carried by its angular momentum, so that no gyroscopic term is needed and a free object
//!   keeps its momentum to rounding.
//! - The first half step, from the velocities given, is a plain implicit Euler step.
//!
//! # Departures from the print
//! The multipliers are solved for at velocity level instead of Eq. 28, whose constraint drifts; Eq. 13 is not needed;
//! Eq. 21 is read as `I dw/dt + w x I w`.

use super::contact::{Contact, Rows};
use super::coulomb::material::Material;
use super::coulomb::stiffness::limits;
use super::coupling::Coupling;
use super::friction::{FrictionTorque, stretch, torque};
use super::ledger::Flows;
use super::mass::{Branches, ObjectMass};
use super::model::{ContactForce, Lost, ModelError, Motion, PlantModel};
use super::push::share;
use super::rotation::{solve_inertia, turn_freely, world_inertia};
use super::surroundings::Surroundings;
use super::vectors::{Everything, combine, dot6, set_tail, set_velocities, tail, velocities};
use blindgrasp_body::dynamics::{Body, JointMatrix, JointVector, bias_torques, place_bodies};
use blindgrasp_body::{MAX_CHAIN, MAX_FINGERS, MAX_JOINTS, Posture};
use blindgrasp_shared::math::Real;
use nalgebra::Vector3;

/// The least relative pivot at which constraints still count as independent.
const LEAST_PIVOT: f64 = 1e-12;

/// The plant, stepped in time.
#[derive(Clone, Debug)]
pub struct Plant {
    model: PlantModel,
    substep_s: f64,
    motion: Motion,
    /// Velocities at the half step before.
    before: Everything,
    /// Angular momentum of the object at the half step before, kg m^2/s.
    spin_momentum: Vector3<f64>,
    /// Velocities at the whole step before, for extrapolation.
    previous: Everything,
    /// Stretch of the joints' friction springs, rad.
    stretch_rad: JointVector,
    started: bool,
    /// Sub-steps since the start.
    steps: u64,
    /// The push at this instant: force, N, and moment, N m.
    pushed: [f64; 6],
    posture: Posture,
    bodies: [Body; MAX_JOINTS],
    mass: JointMatrix,
    contacts: Vec<Contact>,
    /// The surroundings of each fingertip, which it may run into.
    surroundings: Vec<Surroundings>,
    forces: Vec<ContactForce>,
    coupling: Coupling,
    solution: Everything,
    /// The ends of the joints' ranges, where they act.
    limits: Vec<Material>,
    /// Friction of the joints at this instant, at standstill, and what the ends of their ranges add.
    friction: [FrictionTorque; MAX_JOINTS],
    /// Powers at this instant, and work up to the half step before it.
    power: Flows,
    work: Flows,
}

impl Plant {
    /// Puts a plant at a motion, to be advanced by `substep_s` at a time. Velocities that break the rolling constraints
    /// are projected onto them in the first step.
    ///
    /// # Errors
    /// A model that has no equations of motion.
    pub fn new(model: PlantModel, motion: Motion, substep_s: f64) -> Result<Self, ModelError> {
        let longest = Branches::of(&model.hand).longest();
        if longest > MAX_CHAIN {
            return Err(ModelError::ChainTooLong { joints: longest });
        }
        let velocities = velocities(&motion);
        let inertia_kg_m2 = world_inertia(&model.object.inertia_kg_m2, &motion.attitude);
        let fingers = model.faces.len();
        let mut plant = Self {
            coupling: Coupling::new(&model.hand, fingers),
            posture: Posture::at_base(),
            bodies: [Body::NONE; MAX_JOINTS],
            mass: [[0.0; MAX_JOINTS]; MAX_JOINTS],
            contacts: Vec::with_capacity(fingers),
            surroundings: model
                .faces
                .iter()
                .map(|face| Surroundings::of(&model.object.shape, face))
                .collect(),
            forces: vec![ContactForce::default(); fingers],
            substep_s,
            motion,
            before: velocities,
            spin_momentum: inertia_kg_m2 * motion.spin_rad_s,
            previous: velocities,
            stretch_rad: [0.0; MAX_JOINTS],
            started: false,
            steps: 0,
            pushed: [0.0; 6],
            solution: velocities,
            limits: Vec::new(),
            friction: [FrictionTorque::NONE; MAX_JOINTS],
            power: Flows::NONE,
            work: Flows::NONE,
            model,
        };
        plant.place();
        let object = ObjectMass { mass_kg: plant.model.object.mass_kg, inertia_kg_m2 };
        if !(plant.coupling.mass.factorize(&plant.mass, &[0.0; MAX_JOINTS], &object) > LEAST_PIVOT) {
            return Err(ModelError::NoMass);
        }
        if plant.model.joint_limits {
            plant.limits = limits(&plant.coupling.mass, plant.model.hand.joint_count(), substep_s);
        }
        Ok(plant)
    }

    /// The model.
    pub fn model(&self) -> &PlantModel {
        &self.model
    }

    /// Positions of this instant; velocities extrapolated to it until [`Self::solve`] has been called, exact afterwards.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Posture of the hand at this instant.
    pub fn posture(&self) -> &Posture {
        &self.posture
    }

    /// Geometry of the contacts at this instant.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Contact forces at this instant, after [`Self::solve`].
    pub fn forces(&self) -> &[ContactForce] {
        &self.forces
    }

    /// Kinetic energy `K` (Eq. 16), J.
    pub fn kinetic_energy_j(&self) -> f64 {
        let n = self.model.hand.joint_count();
        let speeds = &self.motion.speeds_rad_s;
        let mut hand = 0.0;
        for (row, speed) in self.mass.iter().zip(speeds).take(n) {
            for (entry, other) in row.iter().zip(speeds).take(n) {
                hand += entry * speed * other;
            }
        }
        let (v, w) = (&self.motion.velocity_m_s, &self.motion.spin_rad_s);
        let inertia = world_inertia(&self.model.object.inertia_kg_m2, &self.motion.attitude);
        0.5 * (hand + self.model.object.mass_kg * v.norm_squared() + w.dot(&(inertia * w)))
    }

    /// Elastic energy of the fingertips (Eq. 18), J.
    pub fn elastic_energy_j(&self) -> f64 {
        self.contacts.iter().map(Contact::elastic_energy_j).sum()
    }

    /// Potential energy of the weight of hand and object, J; zero where all of it is in the base frame's origin.
    pub fn weight_energy_j(&self) -> f64 {
        let PlantModel { hand, object, hand_gravity_m_s2, object_gravity_m_s2, .. } = &self.model;
        let mut energy_j = -object.mass_kg * object_gravity_m_s2.dot(&self.motion.position_m);
        for k in 0..hand.joint_count() {
            let link = hand.link(k);
            let centre_m = self.posture.link(k).point(&link.mass_centre_m);
            energy_j -= link.mass_kg * hand_gravity_m_s2.dot(&centre_m);
        }
        energy_j
    }

    /// Returns the flows in and out of the plant's energy from the start to this instant, after [`Self::solve`]: work,
    /// J.
    pub fn flows(&self) -> Flows {
        if self.started { self.work.after(&self.power, 0.5 * self.substep_s) } else { Flows::NONE }
    }

    /// Largest violation of the rolling constraints at this instant, `|P v|`, m/s.
    pub fn slip_m_s(&self) -> f64 {
        let m = &self.motion;
        let mut largest: f64 = 0.0;
        for (i, contact) in self.contacts.iter().enumerate() {
            let object = contact.object_rows();
            for row in [Rows::SLIP_X, Rows::SLIP_Z] {
                let linear = Vector3::new(object[row][0], object[row][1], object[row][2]);
                let angular = Vector3::new(object[row][3], object[row][4], object[row][5]);
                let mut slip = linear.dot(&m.velocity_m_s) + angular.dot(&m.spin_rad_s);
                for k in self.model.hand.joints_to(i) {
                    slip += contact.joint_rows(&self.posture, &self.posture.centres_m[i], k)[row]
                        * m.speeds_rad_s[k];
                }
                largest = largest.max(slip.abs());
            }
        }
        largest
    }

    /// Solves for velocities and forces at this instant under joint torques (N m).
    ///
    /// # Errors
    /// Why the grasp is lost, if it is.
    pub fn solve(&mut self, torques_nm: &JointVector) -> Result<(), Lost> {
        self.watch()?;
        let tau = 0.5 * self.substep_s;
        let object = ObjectMass {
            mass_kg: self.model.object.mass_kg,
            inertia_kg_m2: world_inertia(&self.model.object.inertia_kg_m2, &self.motion.attitude),
        };
        set_tail(&mut self.before.object, &solve_inertia(&object.inertia_kg_m2, &self.spin_momentum));
        let mut push = Everything::ZERO;
        let mut softness = [0.0; MAX_JOINTS];
        self.joint_forces(torques_nm, tau, &mut push, &mut softness);
        if !(self.coupling.mass.factorize(&self.mass, &softness, &object) > LEAST_PIVOT) {
            return Err(Lost::Diverged);
        }
        let weight = self.model.object_gravity_m_s2 * object.mass_kg;
        self.pushed = self.pushes();
        push.object = self.pushed;
        for (force, weight) in push.object.iter_mut().zip(weight.iter()) {
            *force += weight;
        }
        let mut pressed = [Pressed { scale: 0.0, rate_m_s: 0.0 }; MAX_FINGERS];
        for i in 0..self.contacts.len() {
            pressed[i] = self.press(i, tau, &mut push);
        }
        let mut velocities = self.before;
        let pivot = self.coupling.solve(&mut velocities, &push, tau);
        if pivot.is_nan() {
            return Err(Lost::Diverged);
        }
        if pivot <= LEAST_PIVOT {
            return Err(Lost::Rank);
        }
        for (i, (force, contact)) in self.forces.iter_mut().zip(&self.contacts).enumerate() {
            let multiplier = |row| self.coupling.multiplier(i, row);
            force.normal_n -= pressed[i].scale * multiplier(Rows::INDENTATION);
            force.lambda_x_n = -multiplier(Rows::SLIP_X);
            force.lambda_z_n = -multiplier(Rows::SLIP_Z);
            force.torsion_nm = contact.torsion_nm_s.square_root() * multiplier(Rows::TORSION);
        }
        self.solution = velocities;
        if self.started {
            set_velocities(&mut self.motion, &velocities);
        }
        self.power = self.powers(torques_nm, tau, &pressed);
        Ok(())
    }

    /// Moves on by one sub-step; [`Self::solve`] has to have succeeded.
    pub fn advance(&mut self) {
        let (h, v) = (self.substep_s, self.solution);
        let inertia = &self.model.object.inertia_kg_m2;
        let momentum = world_inertia(inertia, &self.motion.attitude) * tail(&v.object);
        let after = if self.started {
            self.spin_momentum = 2.0 * momentum - self.spin_momentum;
            combine(2.0, &v, -1.0, &self.before)
        } else {
            self.spin_momentum = momentum;
            v
        };
        let now = velocities(&self.motion);
        let ahead = combine(2.0, &now, -1.0, &self.previous);
        (self.previous, self.before) = (now, after);

        let motion = &mut self.motion;
        for k in 0..self.model.hand.joint_count() {
            let step = h * after.joints[k];
            motion.angles_rad[k] += step;
            self.stretch_rad[k] = stretch(&self.model.friction[k], self.stretch_rad[k], step);
        }
        motion.position_m += h * Vector3::new(after.object[0], after.object[1], after.object[2]);
        motion.attitude = turn_freely(&motion.attitude, inertia, &self.spin_momentum, h);
        set_velocities(motion, &ahead);
        // Half a step on either side of the instant; the start has one side only.
        self.work = self.work.after(&self.power, if self.started { h } else { 0.5 * h });
        self.started = true;
        self.steps += 1;
        self.place();
    }

    /// Returns the pushes at the object, on average over the half steps around this instant: what the step's kick
    /// stands for.
    fn pushes(&self) -> [f64; 6] {
        let mut sum = [0.0; 6];
        let (t_s, half_s) = (self.steps as f64 * self.substep_s, 0.5 * self.substep_s);
        for push in &self.model.pushes {
            let share = share(push, t_s - half_s, t_s + half_s);
            for (sum, part) in sum.iter_mut().zip(push.force_n.iter().chain(push.moment_nm.iter())) {
                *sum += share * part;
            }
        }
        sum
    }

    /// Places hand and contacts at the positions of this instant.
    fn place(&mut self) {
        let model = &self.model;
        model.hand.forward_kinematics(&self.motion.angles_rad, &mut self.posture);
        place_bodies(&model.hand, &self.posture, &mut self.bodies);
        model.mass_matrix(&self.bodies, &mut self.mass);
        let attitude = self.motion.attitude.to_rotation_matrix().into_inner();
        self.contacts.clear();
        for ((fingertip, face), centre) in
            model.fingertips.iter().zip(&model.faces).zip(&self.posture.centres_m)
        {
            let contact = Contact::at(fingertip, face, centre, &self.motion.position_m, &attitude);
            self.contacts.push(contact);
        }
    }

    /// Checks that the assumptions which the model stands on still hold.
    fn watch(&mut self) -> Result<(), Lost> {
        let shape = &self.model.object.shape;
        for (finger, (contact, face)) in self.contacts.iter().zip(&self.model.faces).enumerate() {
            if !contact.indentation_m.is_finite() {
                return Err(Lost::Diverged);
            }
            if contact.indentation_m <= 0.0 {
                return Err(Lost::Contact { finger });
            }
            let [x, z] = contact.foot_m();
            let foot = face.frame * Vector3::new(x, -face.distance_m, z);
            if shape.margin_m(face.face, &foot) < 0.0 {
                return Err(Lost::OffFace { finger });
            }
            let centre = foot - face.frame.column(1) * contact.rolling_radius_m;
            if self.surroundings[finger].reach(&centre, self.model.fingertips[finger].radius_m) {
                return Err(Lost::Blocked { finger });
            }
        }
        Ok(())
    }

    /// Adds what acts on the joints, without contacts; `softness` is what friction adds to the diagonal of the mass
    /// matrix because it is solved for implicitly.
    fn joint_forces(
        &mut self,
        torques_nm: &JointVector,
        tau: f64,
        push: &mut Everything,
        softness: &mut JointVector,
    ) {
        let speeds = &self.motion.speeds_rad_s;
        let gravity = &self.model.hand_gravity_m_s2;
        let bias = bias_torques(&self.model.hand, &self.bodies, speeds, gravity);
        for (k, friction) in self.model.friction.iter().enumerate() {
            let mut friction = torque(friction, self.stretch_rad[k], speeds[k]);
            if let Some(end) = self.limits.get(k) {
                add_limit(
                    &mut friction,
                    end,
                    self.model.hand.range_rad(k),
                    self.motion.angles_rad[k],
                    speeds[k],
                );
            }
            self.friction[k] = friction;
            push.joints[k] =
                torques_nm[k] - bias[k] - friction.torque_nm - friction.damping_nm_s * self.before.joints[k];
            softness[k] = tau * (friction.damping_nm_s + tau * friction.stiffness_nm);
        }
    }

    /// Adds the normal force of contact `i` as the velocities before would have it, and sets the contact's rows, which
    /// correct it.
    fn press(&mut self, i: usize, tau: f64, push: &mut Everything) -> Pressed {
        let (contact, centre) = (&self.contacts[i], &self.posture.centres_m[i]);
        let object = contact.object_rows();
        let mut joints = [[0.0; Rows::COUNT]; MAX_JOINTS];
        let mut rate = dot6(&object[Rows::INDENTATION], &self.before.object);
        for k in self.model.hand.joints_to(i) {
            joints[k] = contact.joint_rows(&self.posture, centre, k);
            rate += joints[k][Rows::INDENTATION] * self.before.joints[k];
        }
        let normal = contact.elastic_force_n + contact.damping_n_s_m * rate;
        for k in self.model.hand.joints_to(i) {
            push.joints[k] -= joints[k][Rows::INDENTATION] * normal;
        }
        for (force, row) in push.object.iter_mut().zip(&object[Rows::INDENTATION]) {
            *force -= row * normal;
        }
        let scale = (contact.damping_n_s_m + tau * contact.stiffness_n_m).square_root();
        for row in 0..Rows::COUNT {
            let scale = match row {
                Rows::INDENTATION => scale,
                Rows::TORSION => contact.torsion_nm_s.square_root(),
                _ => 1.0,
            };
            self.coupling.set_row(i, row, scale, |k| joints[k][row], &object[row]);
        }
        self.forces[i].normal_n = normal;
        Pressed { scale, rate_m_s: rate }
    }

    /// Returns the powers at this instant, with the velocities that were solved for.
    fn powers(&self, torques_nm: &JointVector, tau: f64, pressed: &[Pressed; MAX_FINGERS]) -> Flows {
        let mut flows = Flows::NONE;
        let speeds = self.solution.joints.iter().zip(&self.before.joints);
        for (k, (speed, before)) in speeds.enumerate().take(self.model.hand.joint_count()) {
            // As in `joint_forces`, with the part that is implicit.
            let FrictionTorque { torque_nm, damping_nm_s, stiffness_nm } = self.friction[k];
            let friction_nm = torque_nm + damping_nm_s * speed + tau * stiffness_nm * (speed - before);
            flows.motors += torques_nm[k] * speed;
            flows.friction += friction_nm * speed;
            flows.joint_speeds_squared[k] = speed * speed;
        }
        for (i, contact) in self.contacts.iter().enumerate() {
            let Pressed { scale, rate_m_s } = pressed[i];
            let rate_m_s = rate_m_s - self.coupling.multiplier(i, Rows::INDENTATION) / scale;
            flows.indentation += contact.damping_n_s_m * rate_m_s * rate_m_s;
            let torsion = self.coupling.multiplier(i, Rows::TORSION);
            flows.torsion += torsion * torsion;
        }
        let object = &self.solution.object;
        flows.pushes = dot6(&self.pushed, object);
        flows.velocity_squared = object[..3].iter().map(|v| v * v).sum();
        flows.spin_squared = tail(object).norm_squared();
        flows
    }
}

/// Adds the end of a joint's range to its friction. It is damped on the way in, so that it does not hold a joint that leaves.
fn add_limit(
    friction: &mut FrictionTorque,
    end: &Material,
    (lower_rad, upper_rad): (f64, f64),
    angle_rad: f64,
    speed_rad_s: f64,
) {
    let beyond_rad = angle_rad - angle_rad.clamp(lower_rad, upper_rad);
    if beyond_rad != 0.0 {
        friction.torque_nm += end.linear_n_m * beyond_rad;
        friction.stiffness_nm += end.linear_n_m;
        friction.damping_nm_s += if speed_rad_s * beyond_rad > 0.0 { end.damping[0] } else { 0.0 };
    }
}

/// A contact's normal force before it is solved for.
#[derive(Clone, Copy, Debug)]
struct Pressed {
    /// Scale of the indentation row.
    scale: f64,
    /// Rate of indentation with the velocities before, m/s.
    rate_m_s: f64,
}
