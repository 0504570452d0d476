//! Helpers that several of the tests use. They panic where something is not as a test needs it.
//!
//! - `board` (feature `firmware`): the image `hand`, running in QEMU; `conversation`: the host's end of a link, frame by
//!   frame; `damage`: frames that a line has damaged.
//! - [`books`]: where the energy of a simulated hand goes, sub-step by sub-step.
//! - [`cases`]: random hands with the grasp law, and the paper's potentials as they are printed.
//! - [`description`]: a hand in the user's frames, with forward kinematics written a second time, straight from the
//!   description.
//! - [`random`]: seeded random inertias and hands.
//! - [`generated`]: parts of documents that tests make.
//! - [`hands`]: the paper's three-fingered hand, and the same hand on an arm.
//! - [`images`]: the images for the microcontroller, built.
//! - [`grasps`]: a hand, an object, a plant and the grasp law, ready to run.
//! - [`noise`]: meshes of polyhedra with noise.
//! - [`numeric`]: derivatives by differences, and the largest of many errors.
//! - [`rolling`]: random states of a hand with its fingertips on an object, and what the plant makes of them.
//! - [`shipped`]: the shipped scenes, loaded and run.
//! - [`study`]: many objects, placed in the hand and grasped.
//! - [`supervised`]: a simulated hand whose controller is watched, with things that go wrong.
//! - [`thumb`]: what the functions of an image for the microcontroller call, and how much stack they take.
//! - [`urdf`]: random URDFs, and their kinematics and dynamics link by link.

#[cfg(all(unix, feature = "firmware"))]
pub mod board;
pub mod books;
pub mod cases;
#[cfg(all(unix, feature = "firmware"))]
pub mod conversation;
#[cfg(all(unix, feature = "firmware"))]
pub mod damage;
pub mod description;
pub mod generated;
pub mod grasps;
pub mod hands;
pub mod images;
pub mod noise;
pub mod numeric;
pub mod random;
pub mod rolling;
pub mod shipped;
pub mod study;
pub mod supervised;
pub mod thumb;
pub mod urdf;
