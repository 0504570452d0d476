//! The data of a report.

use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_body::{Capsule, Hand};
use blindgrasp_sim::sample::Sample;

/// A run and what it was about.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// Over every figure: the scene's name.
    pub title: &'a str,
    /// The hand.
    pub hand: &'a Hand,
    /// Surfaces of its links and palm; where there are none, links are rods and palms plates.
    pub capsules: &'a [Capsule],
    /// Names of its joints, in their order.
    pub joint_names: &'a [String],
    /// The object.
    pub object: &'a Polyhedron,
    /// The run, in the order of time.
    pub samples: &'a [Sample],
}
