//! The simulated plant: hand, free rigid object, and soft fingertips that roll on its faces (Eqs. 1-28), or that stick and slip on it.
//!
//! [`model`] says what is simulated, [`integrator`] advances it in time; [`coulomb`] does where contacts have friction, and
//! [`Plant`] is either. The parts: the hand's [`dynamics`](blindgrasp_body::dynamics), [`contact`] of a
//! fingertip with a face, joint [`friction`], `rotation` of the object, and `coupling`, the linear algebra that solves for all of
//! them together. A `push` comes from outside. A [`ledger`] is kept of the energy that flows in and out. [`small_motions`] linearises
//! a grasp at rest.

pub mod contact;
pub mod coulomb;
mod coupling;
pub mod friction;
pub mod integrator;
pub mod ledger;
mod linear;
mod mass;
pub mod model;
mod plant;
mod push;
mod rotation;
pub mod small_motions;
mod surroundings;
mod vectors;

pub use ledger::Flows;
pub use model::{ContactForce, Lost, ModelError, Motion, ObjectModel, PlantModel};
pub use plant::{FingerContact, FrictionState, OtherContact, Plant};
