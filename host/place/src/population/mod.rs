//! A population of objects for one hand: random polyhedra of styrene foam, placed by the search that `scene new` uses. The paper
//! says *arbitrary polyhedral object*; this is what that is taken to be, wherever many objects are grasped.

mod draw;
mod hand;
mod polyhedron;

pub use draw::Draw;
pub use hand::PlacingHand;
pub use polyhedron::{EXTENT_M, FACES, RandomPolyhedron, polyhedra, polyhedron};

/// Styrene foam, like the paper's objects (2.1 g in a cube of 48 mm), kg/m^3.
pub const DENSITY_KG_M3: f64 = 19.0;
/// The seed of the population, wherever figures are quoted.
pub const SEED: u64 = 17;
