//! The simulated plant: hand, free rigid object, and soft fingertips that roll on its faces (Eqs. 1-28).
//!
//! [`model`] says what is simulated, [`integrator`] advances it in time. The parts: [`dynamics`] of the hand, [`contact`] of a
//! fingertip with a face, joint [`friction`], and `coupling`, the linear algebra that solves for all of them together.

pub mod contact;
mod coupling;
pub mod dynamics;
pub mod friction;
pub mod integrator;
mod linear;
pub mod model;
pub mod polyhedron;
mod surroundings;

pub use coupling::MAX_CHAIN;
pub use integrator::Plant;
pub use model::{ContactForce, Lost, ModelError, Motion, ObjectModel, PlantModel};
