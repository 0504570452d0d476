//! Contact that sticks exactly, slips when it must, breaks and comes back: soft fingertips, a free object, links, and tables,
//! with Coulomb friction.
//!
//! Fingertips and corners are soft along the normal, so touch, lift-off and impact are smooth; only friction is not. The
//! parts: `placed` finds contacts (`links` those of links), each a `touch`, `rows` is what they feel, `material` has normal forces (`stiffness` says which), `solve` finds
//! the forces of one step (`cone` those of one contact, with the matrices of `linear`), and [`Plant`] advances in time. [`World`]
//! says what there is besides hand and object.

mod cone;
mod linear;
mod links;
pub(crate) mod material;
mod placed;
mod plant;
mod rows;
mod solve;
pub(crate) mod stiffness;
mod touch;
mod world;

pub use plant::{Contact, Plant};
pub use solve::Counters;
pub use touch::{Pair, Touch};
pub use world::{Friction, Path, Table, World, WorldError};
