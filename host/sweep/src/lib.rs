//! Sweeps: a scene run over a grid of values, on all cores.
//!
//! ```text
//! axes ("control.force_n=1..10:10") --> Plan --> runs, on all cores --> Rows --> journal --> table, picture, verdict
//! ```
//!
//! A [`Plan`] reads the scene's files once and knows the settings of every run; [`run()`] gives a [`Row`] for each. A row
//! depends on its run alone: not on the order, on the number of cores, or on what was run before. [`run_refined`] bisects to
//! where the grasp begins to fail ([`edges`]); [`draw`] makes a picture. Files are [`Output`]'s and the [`Journal`]'s.
//!
//! ```no_run
//! use blindgrasp_sweep::{Axis, Plan, run};
//!
//! let axis = Axis::parse("control.attitude_stiffness_nm=1e-4..1e-1:31:log")?;
//! let plan = Plan::new("cube-ideal", Vec::new(), vec![axis], 1)?;
//! for row in run(&plan) {
//!     let held = row.summary().map(|summary| summary.grasp_held);
//!     println!("{:?}: {held:?}", plan.values(row.run).next());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axis;
mod edge;
mod identity;
mod journal;
mod output;
mod overview;
mod picture;
mod plan;
mod run;
mod table;
#[cfg(test)]
mod tests;
mod unit;

pub use axis::{Axis, AxisError, Scale, Value};
pub use edge::{Edge, Stretch, Swept, edges, run_refined, stretches};
pub use identity::Identity;
pub use journal::{Found, Journal, JournalError};
pub use output::{Output, OutputError};
pub use overview::{Overview, Varied};
pub use picture::{Picture, draw, picture};
pub use plan::{Plan, PlanError};
pub use run::{Outcome, Row, run, run_some};
