//! What crosses crates, and is fast: the science, the documents, the wire. What takes an emulator is beside it.

mod architecture;
mod constraints;
mod control;
mod coulomb;
mod documents;
mod dynamics;
mod earlier_law;
mod energy;
mod equations;
mod faults;
mod hand_arm;
mod hands;
mod integrator;
mod keys;
mod kinematics;
mod ledger;
mod pinocchio;
mod polyhedra;
mod protocol;
mod pushes;
mod python_client;
mod robustness;
mod science;
mod telemetry;
mod two_fingers;
mod urdf;
