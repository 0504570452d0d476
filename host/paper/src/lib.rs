//! The whole paper, run and checked: its simulation (Sec. 5), its experiments (Sec. 6), the counterparts of its figures, and
//! each of its claims as a check with a verdict.
//!
//! - [`plan`] names the runs: a scene, settings, and what the run is for. [`evidence`] runs them on all cores and keeps them.
//! - [`laws`] are the three that are compared; [`earlier`] compares them on the way that a grasp took and over objects, and
//!   [`polyhedra`] on the random objects that stand for an arbitrary one.
//! - [`claims`] holds a file for each group of claims: what is measured, the criterion with the argument for its tolerance, and
//!   the verdict. A check looks at samples only, so that tests can show it made-up ones.
//! - [`expected`] is the one table of the verdicts that the documentation states. What comes out worse fails the command.
//! - [`choices`] says what was chosen where the paper is silent or contradicts itself, and measures what hangs on it.
//! - [`sensitivity`] varies what a real hand has and the theory does not, up to where the grasp fails.
//! - [`figures`] draws, [`report`] has all of it together, `page` puts it into one HTML file, [`files`] writes it.

pub mod choices;
pub mod claim;
pub mod claims;
pub mod earlier;
pub mod evidence;
pub mod expected;
pub mod figures;
pub mod files;
pub mod laws;
mod page;
pub mod plan;
pub mod polyhedra;
pub mod report;
pub mod sensitivity;
