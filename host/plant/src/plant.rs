//! The plant behind one face: contact that rolls (the paper's) or contact with friction.

use crate::coulomb::{self, Pair, World, WorldError};
use crate::integrator;
use crate::ledger::Flows;
use crate::model::{ContactForce, Lost, Motion, PlantModel};
use blindgrasp_body::Posture;
use blindgrasp_body::dynamics::JointVector;
use nalgebra::{Matrix3, Vector3};

/// A plant, stepped in time.
#[derive(Clone, Debug)]
pub enum Plant {
    /// Fingertips roll on their faces, never slip, and never let go: the paper's.
    Rolling(Box<integrator::Plant>),
    /// Contacts stick, slip, break and come back.
    Coulomb(Box<coulomb::Plant>),
}

/// A fingertip against the object at one instant.
#[derive(Clone, Copy, Debug)]
pub struct FingerContact {
    /// Contact frame `(C_X, C_Y, C_Z)` in the base frame; `C_Y` points into the object.
    pub frame: Matrix3<f64>,
    /// Contact point `x_Ci`, m; where there is a gap, the point of the object that is closest.
    pub point_m: Vector3<f64>,
    /// Its coordinates along `C_X` and `C_Z` from the foot of the centre of mass, m.
    pub foot_m: [f64; 2],
    /// Indentation `dr_i`, m; negative where there is a gap.
    pub indentation_m: f64,
    /// Rolling radius `r_i - dr_i`, m.
    pub rolling_radius_m: f64,
    /// Force.
    pub force: ContactForce,
    /// Friction, where there is some.
    pub friction: Option<FrictionState>,
}

/// The friction of a contact at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionState {
    /// Share of the limit of friction that is used: 1 where it slips, 0 where nothing touches.
    pub used: f64,
    /// The largest tangential force that there could be, N.
    pub limit_n: f64,
    /// Way that it has slipped since the start, m.
    pub slipped_m: f64,
}

/// A contact that is not between a fingertip and the object, at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherContact {
    /// The bodies.
    pub pair: Pair,
    /// Its place, m.
    pub point_m: Vector3<f64>,
    /// Force of the table on the object or the hand, of a link on the object, of one part of the hand on the other, N.
    pub force_n: Vector3<f64>,
    /// Share of the limit of friction that is used: 1 where it slips.
    pub used: f64,
}

impl From<integrator::Plant> for Plant {
    fn from(plant: integrator::Plant) -> Self {
        Self::Rolling(Box::new(plant))
    }
}

impl From<coulomb::Plant> for Plant {
    fn from(plant: coulomb::Plant) -> Self {
        Self::Coulomb(Box::new(plant))
    }
}

/// One and the same call of either plant.
macro_rules! either {
    ($self:ident, $plant:ident => $what:expr) => {
        match $self {
            Self::Rolling($plant) => $what,
            Self::Coulomb($plant) => $what,
        }
    };
}

impl Plant {
    /// Puts a plant at a motion, to be advanced by `substep_s` at a time; with friction if there is a world for it.
    ///
    /// # Errors
    /// A model or a world that can't be simulated.
    pub fn new(
        model: PlantModel,
        world: Option<World>,
        motion: Motion,
        substep_s: f64,
    ) -> Result<Self, WorldError> {
        Ok(match world {
            None => integrator::Plant::new(model, motion, substep_s)?.into(),
            Some(world) => coulomb::Plant::new(model, world, motion, substep_s)?.into(),
        })
    }

    /// The model.
    pub fn model(&self) -> &PlantModel {
        either!(self, plant => plant.model())
    }

    /// Positions of this instant; velocities extrapolated to it until [`Self::solve`] has been called, exact afterwards.
    pub fn motion(&self) -> &Motion {
        either!(self, plant => plant.motion())
    }

    /// Posture of the hand at this instant.
    pub fn posture(&self) -> &Posture {
        either!(self, plant => plant.posture())
    }

    /// Kinetic energy `K` (Eq. 16), J.
    pub fn kinetic_energy_j(&self) -> f64 {
        either!(self, plant => plant.kinetic_energy_j())
    }

    /// Elastic energy of what is soft (Eq. 18), J.
    pub fn elastic_energy_j(&self) -> f64 {
        either!(self, plant => plant.elastic_energy_j())
    }

    /// Potential energy of the weight of hand and object, J, above some level. Where gravity turns it is no potential any
    /// more: then it is what the weight has taken since the start.
    pub fn weight_energy_j(&self) -> f64 {
        match self {
            Self::Rolling(plant) => plant.weight_energy_j(),
            Self::Coulomb(plant) => -plant.flows().weight,
        }
    }

    /// Returns the flows in and out of the plant's energy from the start to this instant, after [`Self::solve`]: work, J.
    pub fn flows(&self) -> Flows {
        either!(self, plant => plant.flows())
    }

    /// Solves for velocities and forces at this instant under joint torques (N m).
    ///
    /// # Errors
    /// Why the grasp is lost, if it is.
    pub fn solve(&mut self, torques_nm: &JointVector) -> Result<(), Lost> {
        either!(self, plant => plant.solve(torques_nm))
    }

    /// Moves on by one sub-step; [`Self::solve`] has to have succeeded.
    pub fn advance(&mut self) {
        either!(self, plant => plant.advance());
    }

    /// Fingertips against the object at this instant, after [`Self::solve`], one each.
    pub fn fingers(&self) -> Vec<FingerContact> {
        match self {
            Self::Rolling(plant) => {
                let parts = plant.contacts().iter().zip(plant.forces()).zip(&plant.posture().centres_m);
                parts
                    .map(|((contact, force), centre_m)| FingerContact {
                        frame: contact.frame,
                        point_m: contact.point_m(centre_m),
                        foot_m: contact.foot_m(),
                        indentation_m: contact.indentation_m,
                        rolling_radius_m: contact.rolling_radius_m,
                        force: *force,
                        friction: None,
                    })
                    .collect()
            }
            Self::Coulomb(plant) => {
                (0..plant.model().hand.fingertip_count()).map(|finger| plant.finger(finger)).collect()
            }
        }
    }

    /// Tables at this instant: a point of each, m, and its normal.
    pub fn tables(&self) -> Vec<[Vector3<f64>; 2]> {
        match self {
            Self::Rolling(_) => Vec::new(),
            Self::Coulomb(plant) => plant.tables().collect(),
        }
    }

    /// Contacts at this instant, after [`Self::solve`], that are not between a fingertip and the object: with tables, of links, and of
    /// parts of the hand with each other; those that carry something.
    pub fn others(&self) -> Vec<OtherContact> {
        match self {
            Self::Rolling(_) => Vec::new(),
            Self::Coulomb(plant) => plant.contacts().iter().filter_map(coulomb::Contact::other).collect(),
        }
    }
}
