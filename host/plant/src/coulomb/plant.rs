//! The plant's advance in time: the leapfrog of [`crate::integrator`] with contacts that come and go, stick and slip.
//!
//! - The velocities of a whole step are solved for together with the contacts' forces (`solve.rs`); reflecting those of the
//!   half step before about them gives the next ones. Friction never adds energy that way.
//! - Normal forces are averages along the path of the two half steps around it (`material.rs`).
//! - Where a contact begins to stick, what is left of its slip would come back with alternating sign for ever. So the
//!   velocities after that step are projected, orthogonally in the metric of the kinetic energy, onto no slip of all
//!   sticking contacts where these are half a step later. That only takes energy; it is booked as friction.

use super::linear::{Four, add_scaled};
use super::links::Links;
use super::material::Response;
use super::placed::{Placed, Surfaces};
use super::rows::Rows;
use super::solve::{Counters, Problem};
use super::stiffness::{Materials, limits, object_yields_per_kg};
use super::touch::{Pair, Touch};
use super::world::{Table, World, WorldError};
use crate::friction::{FrictionTorque, stretch, torque};
use crate::ledger::Flows;
use crate::mass::{Branches, MassFactor, ObjectMass};
use crate::model::{Lost, ModelError, Motion, PlantModel};
use crate::push::share;
use crate::rotation::{solve_inertia, turn_freely};
use crate::vectors::{Everything, add, combine, head, set_tail, set_velocities, tail, velocities};
use blindgrasp_body::dynamics::{JointVector, bias_torques};
use blindgrasp_body::polyhedron::Touchable;
use blindgrasp_body::{MAX_CHAIN, MAX_FINGERS, MAX_JOINTS, Posture};
use nalgebra::Vector3;

mod account;
mod hold;
#[cfg(test)]
mod tests;

pub use account::Contact;

/// The least relative pivot of a mass matrix.
const LEAST_PIVOT: f64 = 1e-12;
/// Gap that a contact may have and still be solved for, beyond what velocities close in two steps, m (or rad).
const NEAR: f64 = 2e-4;
/// Gap beyond which it is not even looked at, m.
const FAR_M: f64 = 0.01;

/// The plant, stepped in time.
#[derive(Clone, Debug)]
pub struct Plant {
    model: PlantModel,
    world: World,
    surfaces: Surfaces,
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
    /// At this instant; and half a step after it, where a contact begins to stick.
    now: Placed,
    ahead: Placed,
    mass: MassFactor,
    /// Contacts at this instant; and in the same order, with room for more, their rows: once the problem is set, times the
    /// inverse factor of the mass matrix.
    touches: Vec<Touch>,
    rows: Vec<Rows>,
    /// Velocities of the bodies at the contacts half a step ago; the rates of their depths then; and about now, with
    /// velocities extrapolated.
    felt: Vec<Four>,
    rates_m_s: Vec<f64>,
    guesses_m_s: Vec<f64>,
    /// Mean velocities of the tables in the step before this instant, and around it, m/s.
    table_velocities_m_s: Vec<[Vector3<f64>; 2]>,
    /// Velocities of the contacts' tables about now, as their rows feel them.
    tables_m_s: Vec<Four>,
    /// Contacts that take away what others have too much.
    reliefs: Vec<Relief>,
    problem: Problem,
    projection: Problem,
    contacts: Vec<Contact>,
    /// Way that each fingertip has slipped on the object, m.
    slipped_m: [f64; MAX_FINGERS],
    /// Contacts that stuck at the instant before.
    stuck: Vec<Pair>,
    solution: Everything,
    /// External forces on the object at this instant: of pushes, and its weight.
    pushed: [f64; 6],
    gravity_m_s2: [Vector3<f64>; 2],
    friction: [FrictionTorque; MAX_JOINTS],
    power: Flows,
    work: Flows,
    /// The contact's law is that of the rolling contact: normal force frozen at the step, torsion viscous.
    as_rolling: bool,
}

/// A contact that takes away what others have too much, with velocities extrapolated: next to what it takes away.
#[derive(Clone, Debug)]
struct Relief {
    touch: Touch,
    rows: Rows,
    response: Response,
}

impl Plant {
    /// Puts a plant at a motion, to be advanced by `substep_s` at a time. Contacts of a plant at rest stick from the start.
    ///
    /// # Errors
    /// A model or a world that can't be simulated.
    pub fn new(model: PlantModel, world: World, motion: Motion, substep_s: f64) -> Result<Self, WorldError> {
        let longest = Branches::of(&model.hand).longest();
        if longest > MAX_CHAIN {
            return Err(ModelError::ChainTooLong { joints: longest }.into());
        }
        world.check(model.hand.fingertip_count())?;
        let mut mass = MassFactor::new(&model.hand);
        let mut now = Placed::new();
        now.place(&model, &motion.angles_rad, motion.position_m, motion.attitude);
        let inertia_kg_m2 = now.inertia_kg_m2(&model);
        let object = ObjectMass { mass_kg: model.object.mass_kg, inertia_kg_m2 };
        if !(mass.factorize(&now.mass, &[0.0; MAX_JOINTS], &object) > LEAST_PIVOT) {
            return Err(ModelError::NoMass.into());
        }
        let yields_per_kg = object_yields_per_kg(&model.object);
        let mut surfaces = Surfaces {
            object: Touchable::of(&model.object.shape),
            radius_m: model.object.shape.radius_m(),
            materials: Materials::new(&model, substep_s),
            links: Links::new((&model, &world), &now, &mass, yields_per_kg, substep_s),
            places: Vec::new(),
        };
        if model.joint_limits {
            surfaces.materials.limits = limits(&mass, model.hand.joint_count(), substep_s);
        }
        let mut plant = Self {
            surfaces,
            substep_s,
            motion,
            before: velocities(&motion),
            spin_momentum: inertia_kg_m2 * motion.spin_rad_s,
            previous: velocities(&motion),
            stretch_rad: [0.0; MAX_JOINTS],
            started: false,
            steps: 0,
            now,
            ahead: Placed::new(),
            mass,
            touches: Vec::new(),
            rows: Vec::new(),
            felt: Vec::new(),
            rates_m_s: Vec::new(),
            guesses_m_s: Vec::new(),
            table_velocities_m_s: Vec::new(),
            tables_m_s: Vec::new(),
            reliefs: Vec::new(),
            problem: Problem::default(),
            projection: Problem::default(),
            contacts: Vec::new(),
            slipped_m: [0.0; MAX_FINGERS],
            stuck: Vec::new(),
            solution: velocities(&motion),
            pushed: [0.0; 6],
            gravity_m_s2: [Vector3::zeros(); 2],
            friction: [FrictionTorque::NONE; MAX_JOINTS],
            power: Flows::NONE,
            work: Flows::NONE,
            as_rolling: false,
            model,
            world,
        };
        if motion == Motion::at_rest(motion.angles_rad, motion.position_m, motion.attitude) {
            let Self { now, model, world, surfaces, stuck, before, mass, .. } = &mut plant;
            let moving = (&mass.branches, &*before, 0.0);
            surfaces.links.update(
                now,
                (model, world),
                (&surfaces.object, surfaces.radius_m),
                moving,
                (0.0, substep_s),
            );
            now.touches((model, world), surfaces, 0.0, FAR_M, |touch| {
                if touch.depth_m > 0.0 {
                    stuck.push(touch.pair);
                }
            });
        }
        Ok(plant)
    }

    /// Lets the contacts of fingertips and object do as the rolling ones do, for a comparison with these: normal forces
    /// frozen at the step, torsion viscous, nothing projected.
    #[doc(hidden)]
    pub fn compare_with_rolling(mut self) -> Self {
        self.as_rolling = true;
        for friction in &mut self.world.fingertip_friction {
            friction.torsion_m = 0.0;
        }
        self
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
        &self.now.posture
    }

    /// Contacts at this instant with their forces, after [`Self::solve`]: those that touch, and some that nearly do.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Counters of what the solver did since the start.
    pub fn counters(&self) -> &Counters {
        &self.problem.counters
    }

    /// Tables at this instant: a point of each, m, and its normal.
    pub fn tables(&self) -> impl Iterator<Item = [Vector3<f64>; 2]> {
        let t_s = self.time_s();
        self.world.tables.iter().map(move |table| [table.point_m.at(t_s), table.normal])
    }

    /// Returns how far a table has gone back from where it was at the start, m.
    pub fn table_gone_m(&self, table: usize) -> f64 {
        let Table { point_m, normal, .. } = &self.world.tables[table];
        normal.dot(&(point_m.at(0.0) - point_m.at(self.time_s())))
    }

    /// Kinetic energy, J.
    pub fn kinetic_energy_j(&self) -> f64 {
        let n = self.model.hand.joint_count();
        let Motion { speeds_rad_s: speeds, velocity_m_s: v, spin_rad_s: w, .. } = &self.motion;
        let mut hand = 0.0;
        for (row, speed) in self.now.mass.iter().zip(speeds).take(n) {
            for (entry, other) in row.iter().zip(speeds).take(n) {
                hand += entry * speed * other;
            }
        }
        let inertia = self.now.inertia_kg_m2(&self.model);
        0.5 * (hand + self.model.object.mass_kg * v.norm_squared() + w.dot(&(inertia * w)))
    }

    /// Elastic energy of all contacts and joint limits, J.
    pub fn elastic_energy_j(&self) -> f64 {
        let energy_j = |touch: &Touch| touch.material.energy_j(touch.depth_m);
        let taken_away_j: f64 = self.reliefs.iter().map(|relief| energy_j(&relief.touch)).sum();
        self.touches.iter().map(energy_j).sum::<f64>() - taken_away_j
    }

    /// Returns the flows in and out of kinetic and elastic energy from the start to this instant, after [`Self::solve`]: work,
    /// J.
    pub fn flows(&self) -> Flows {
        if self.started { self.work.after(&self.power, 0.5 * self.substep_s) } else { Flows::NONE }
    }

    /// Solves for velocities and forces at this instant under joint torques (N m).
    ///
    /// # Errors
    /// The motion diverged.
    pub fn solve(&mut self, torques_nm: &JointVector) -> Result<(), Lost> {
        let tau = 0.5 * self.substep_s;
        let path_s = self.path_s();
        let object = self.object_mass();
        set_tail(&mut self.before.object, &solve_inertia(&object.inertia_kg_m2, &self.spin_momentum));
        let mut push = Everything::ZERO;
        let mut softness = [0.0; MAX_JOINTS];
        self.external_forces(torques_nm, tau, &mut push, &mut softness);
        if !(self.mass.factorize(&self.now.mass, &softness, &object) > LEAST_PIVOT) {
            return Err(Lost::Diverged);
        }
        self.collect(&mut push);
        self.mass.whiten(&mut push);
        self.set_problem(tau, &push);

        let Self { touches, rates_m_s, guesses_m_s, problem, as_rolling, started, .. } = self;
        let law = |k: usize, rate_m_s: f64| {
            respond(&touches[k], rates_m_s[k], rate_m_s, (path_s, tau), (*started, *as_rolling))
        };
        problem.solve(law, guesses_m_s);

        for (rows, forces) in self.rows.iter().zip(&self.problem.forces) {
            rows.push(&self.mass.branches, forces, &mut push);
        }
        self.mass.unwhiten(&mut push);
        self.solution = self.before;
        add(&mut self.solution, tau, &push);
        let all = self.solution.joints.iter().chain(&self.solution.object);
        if !all.fold(0.0, |sum, v| sum + v).is_finite() {
            return Err(Lost::Diverged);
        }
        if self.started {
            set_velocities(&mut self.motion, &self.solution);
        }
        self.power = self.powers(torques_nm, tau);
        self.report();
        Ok(())
    }

    /// Moves on by one sub-step; [`Self::solve`] has to have succeeded.
    pub fn advance(&mut self) {
        let (h, v) = (self.substep_s, self.solution);
        let momentum = self.now.inertia_kg_m2(&self.model) * tail(&v.object);
        let after = if self.started {
            self.spin_momentum = 2.0 * momentum - self.spin_momentum;
            combine(2.0, &v, -1.0, &self.before)
        } else {
            self.spin_momentum = momentum;
            v
        };
        let now = velocities(&self.motion);
        let extrapolated = combine(2.0, &now, -1.0, &self.previous);
        (self.previous, self.before) = (now, after);
        // Half a step on either side of the instant; the start has one side only.
        self.work = self.work.after(&self.power, self.path_s());
        self.count_slip(self.path_s());
        self.hold_what_sticks();

        let motion = &mut self.motion;
        for k in 0..self.model.hand.joint_count() {
            let step = h * self.before.joints[k];
            motion.angles_rad[k] += step;
            self.stretch_rad[k] = stretch(&self.model.friction[k], self.stretch_rad[k], step);
        }
        motion.position_m += h * head(&self.before.object);
        let inertia = &self.model.object.inertia_kg_m2;
        motion.attitude = turn_freely(&motion.attitude, inertia, &self.spin_momentum, h);
        set_velocities(motion, &extrapolated);
        self.started = true;
        self.steps += 1;
        self.place();
    }

    /// The time of the path that a step's forces stand for, s.
    fn path_s(&self) -> f64 {
        if self.started { self.substep_s } else { 0.5 * self.substep_s }
    }

    /// Time of this instant, s.
    fn time_s(&self) -> f64 {
        self.steps as f64 * self.substep_s
    }

    fn object_mass(&self) -> ObjectMass {
        ObjectMass { mass_kg: self.model.object.mass_kg, inertia_kg_m2: self.now.inertia_kg_m2(&self.model) }
    }

    fn place(&mut self) {
        let Self { now, model, motion, .. } = self;
        now.place(model, &motion.angles_rad, motion.position_m, motion.attitude);
    }

    /// Adds what acts on joints and object, without contacts; `softness` is what friction adds to the diagonal of the mass
    /// matrix because it is solved for implicitly.
    fn external_forces(
        &mut self,
        torques_nm: &JointVector,
        tau: f64,
        push: &mut Everything,
        softness: &mut JointVector,
    ) {
        let PlantModel { hand, object, hand_gravity_m_s2, object_gravity_m_s2, .. } = &self.model;
        let t_s = self.time_s();
        self.gravity_m_s2 = match &self.world.gravity_m_s2 {
            Some(path) => [path.at(t_s); 2],
            None => [*hand_gravity_m_s2, *object_gravity_m_s2],
        };
        let speeds = &self.motion.speeds_rad_s;
        let bias = bias_torques(hand, &self.now.bodies, speeds, &self.gravity_m_s2[0]);
        for (k, friction) in self.model.friction.iter().enumerate() {
            let friction = torque(friction, self.stretch_rad[k], speeds[k]);
            self.friction[k] = friction;
            push.joints[k] =
                torques_nm[k] - bias[k] - friction.torque_nm - friction.damping_nm_s * self.before.joints[k];
            softness[k] = tau * (friction.damping_nm_s + tau * friction.stiffness_nm);
        }
        self.pushed = [0.0; 6];
        for push in &self.model.pushes {
            let share = share(push, t_s - tau, t_s + tau);
            for (sum, part) in self.pushed.iter_mut().zip(push.force_n.iter().chain(push.moment_nm.iter())) {
                *sum += share * part;
            }
        }
        push.object = self.pushed;
        for (force, gravity) in push.object.iter_mut().zip(self.gravity_m_s2[1].iter()) {
            *force += object.mass_kg * gravity;
        }
    }

    /// Collects the contacts that touch or may touch within this step. Adds the forces of those that only take away.
    fn collect(&mut self, push: &mut Everything) {
        let (t_s, path_s) = (self.time_s(), self.path_s());
        let fastest =
            head(&self.before.object).norm() + tail(&self.before.object).norm() * self.surfaces.radius_m;
        let about_now = velocities(&self.motion);
        let Self {
            now,
            model,
            world,
            surfaces,
            mass,
            touches,
            rows,
            felt,
            rates_m_s,
            table_velocities_m_s,
            reliefs,
            before,
            substep_s,
            as_rolling,
            started,
            ..
        } = self;
        touches.clear();
        felt.clear();
        rates_m_s.clear();
        reliefs.clear();
        let far_m = FAR_M + 2.0 * *substep_s * fastest;
        let h = *substep_s;
        table_velocities_m_s.clear();
        let mut tables_m = 0.0;
        for Table { point_m, .. } in &world.tables {
            let [last_m, now_m, next_m] = [t_s - h, t_s, t_s + h].map(|t_s| point_m.at(t_s));
            tables_m = f64::max(tables_m, (now_m - last_m).norm());
            let around = if *started { (next_m - last_m) / (2.0 * h) } else { (next_m - now_m) / h };
            table_velocities_m_s.push([(now_m - last_m) / h, around]);
        }
        let moving = (&mass.branches, &*before, tables_m);
        surfaces.links.update(now, (model, world), (&surfaces.object, surfaces.radius_m), moving, (t_s, h));
        let tau = 0.5 * *substep_s;
        now.touches((model, world), surfaces, t_s, far_m, |touch| {
            let table_m_s = of_table(table_velocities_m_s, touch)[0];
            let own = room(rows, touches.len());
            now.set_rows((model, world), &mass.branches, touch, own);
            let feels = own.times(&mass.branches, before);
            let gap_m_s = feels[0] + touch.normal.dot(&table_m_s);
            if !(touch.depth_m + 2.0 * *substep_s * gap_m_s.abs() + NEAR > 0.0) {
                return;
            }
            if touch.is_negative {
                let rate_m_s = -own.times(&mass.branches, &about_now)[0];
                let response = respond(touch, -gap_m_s, rate_m_s, (path_s, tau), (*started, *as_rolling));
                own.push(&mass.branches, &[-response.force_n.max(0.0), 0.0, 0.0, 0.0], push);
                reliefs.push(Relief { touch: *touch, rows: *own, response });
                return;
            }
            touches.push(*touch);
            felt.push(feels);
            rates_m_s.push(-gap_m_s);
            for sign in [1.0, -1.0].into_iter().filter(|_| *as_rolling) {
                if let Some(touch) = touch.viscous_torsion(sign, &model.fingertips) {
                    let own = room(rows, touches.len());
                    now.set_rows((model, world), &mass.branches, &touch, own);
                    felt.push(own.times(&mass.branches, before));
                    rates_m_s.push(-felt[touches.len()][0]);
                    touches.push(touch);
                }
            }
        });
    }

    /// Sets rows, Delassus matrix and free velocities of the contacts, given whitened forces.
    fn set_problem(&mut self, tau: f64, push: &Everything) {
        let about_now = velocities(&self.motion);
        let Self { table_velocities_m_s, touches, rows, felt, contacts, mass, problem, .. } = self;
        let branches = &mass.branches;
        problem.clear();
        self.guesses_m_s.clear();
        self.tables_m_s.clear();
        for (k, (touch, rows)) in touches.iter().zip(rows.iter_mut()).enumerate() {
            let table_m_s = touch.feels(&of_table(table_velocities_m_s, touch)[1]);
            self.tables_m_s.push(table_m_s);
            self.guesses_m_s.push(-rows.times(branches, &about_now)[0] - table_m_s[0]);
            let mut free = felt[k];
            add_scaled(&mut free, 1.0, &table_m_s);
            rows.whiten(mass);
            add_scaled(&mut free, tau, &rows.times(branches, push));
            // Contacts seldom come and go: mostly, each has its place of the step before.
            let is_same = |contact: &&Contact| contact.touch.pair == touch.pair;
            let last = contacts.get(k).filter(is_same).or_else(|| contacts.iter().find(is_same));
            problem.add(
                touch.tangents(),
                touch.friction.sliding,
                free,
                last.map_or([0.0; 4], Contact::forces),
            );
        }
        couple(rows, tau, problem);
    }
}

/// The law of a contact's normal force.
fn respond(
    touch: &Touch,
    before_m_s: f64,
    rate_m_s: f64,
    (path_s, tau): (f64, f64),
    (started, as_rolling): (bool, bool),
) -> Response {
    let material = &touch.material;
    if let Pair::Torsion { .. } = touch.pair {
        let viscosity = material.damping[0];
        return Response { force_n: viscosity * rate_m_s, slope_n_s_m: viscosity, elastic_n: 0.0 };
    }
    if as_rolling {
        return material.frozen(touch.depth_m, before_m_s, rate_m_s, tau);
    }
    let from_m = if started { touch.depth_m - tau * before_m_s } else { touch.depth_m };
    material.average(from_m, rate_m_s, path_s)
}

/// The velocities of a contact's table; zero where there is none.
fn of_table(velocities_m_s: &[[Vector3<f64>; 2]], touch: &Touch) -> [Vector3<f64>; 2] {
    touch.pair.table().map_or([Vector3::zeros(); 2], |table| velocities_m_s[table])
}

/// The rows of a contact, kept from one step to the next.
fn room(rows: &mut Vec<Rows>, contact: usize) -> &mut Rows {
    if rows.len() <= contact {
        rows.push(Rows::NONE);
    }
    &mut rows[contact]
}

/// `tau J M^-1 J^T`.
fn couple(rows: &[Rows], tau: f64, problem: &mut Problem) {
    problem.couple(|i, j, block| rows[i].multiply(&rows[j], tau, block));
}
