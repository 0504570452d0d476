//! The rooms of the host side under one roof: the simulated world, the closed loop around the same tick that the
//! microcontroller runs, and what the command `blindgrasp` is made of.

pub use blindgrasp_body as body;
pub use blindgrasp_device as device;
pub use blindgrasp_files as files;
pub use blindgrasp_model as model;
#[cfg(feature = "monitor")]
pub use blindgrasp_monitor as monitor;
#[cfg(feature = "paper")]
pub use blindgrasp_paper as paper;
pub use blindgrasp_place as place;
pub use blindgrasp_plant as plant;
#[cfg(feature = "plots")]
pub use blindgrasp_plots as plots;
pub use blindgrasp_record as record;
pub use blindgrasp_rig as rig;
pub use blindgrasp_sim as sim;
#[cfg(feature = "sweep")]
pub use blindgrasp_sweep as sweep;
pub use blindgrasp_view as view;
pub use blindgrasp_wire as wire;
