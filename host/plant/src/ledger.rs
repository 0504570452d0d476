//! The flows in and out of the plant's energy: the work of the motors and of pushes, and what dampers and friction
//! take.
//!
//! The flows of an instant are powers with the velocities and forces that the integrator solves for there; they are summed
//! by the trapezoidal rule over whole steps, which is the rule by which the integrator itself adds up forces: what a force
//! changes the kinetic energy by, in one step of the leapfrog, is exactly the step times its power at the whole step (the
//! velocity there is the mean of those at the half steps around it). What is left between stored energy and flows is
//! therefore the integrator's own error, of second order, and nothing of the bookkeeping.

use blindgrasp_body::MAX_JOINTS;
use blindgrasp_body::dynamics::JointVector;

/// Flows: powers of an instant (W), or work since the start (J).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flows {
    /// By the motors into the joints.
    pub motors: f64,
    /// By what pushes the object from outside.
    pub pushes: f64,
    /// Taken by the dampers of the fingertips' normal forces, `xi (d(dr)/dt)^2`.
    pub indentation: f64,
    /// Taken by the torsional viscosity of the fingertips, `2 T_i`.
    pub torsion: f64,
    /// Taken by the friction of the joints and the ends of their ranges; a little of it is lent to their springs.
    pub friction: f64,
    /// Taken by friction of contacts that slip.
    pub slip: f64,
    /// By tables that move.
    pub tables: f64,
    /// By the weight of links and object, where contacts slip; where they roll it is potential energy.
    pub weight: f64,
    /// Squares of the joint speeds, rad^2/s^2 (rad^2/s when summed): what a damping gain of one would take.
    pub joint_speeds_squared: JointVector,
    /// Square of the object's velocity, m^2/s^2 (m^2/s).
    pub velocity_squared: f64,
    /// Square of the object's angular velocity, rad^2/s^2 (rad^2/s).
    pub spin_squared: f64,
}

impl Flows {
    /// Nothing flows.
    pub const NONE: Self = Self {
        motors: 0.0,
        pushes: 0.0,
        indentation: 0.0,
        torsion: 0.0,
        friction: 0.0,
        slip: 0.0,
        tables: 0.0,
        weight: 0.0,
        joint_speeds_squared: [0.0; MAX_JOINTS],
        velocity_squared: 0.0,
        spin_squared: 0.0,
    };

    /// Returns the energy that all dampers and friction took.
    pub fn dissipated(&self) -> f64 {
        self.indentation + self.torsion + self.friction + self.slip
    }

    /// These flows and those of a power during `time_s`.
    pub(super) fn after(&self, power: &Self, time_s: f64) -> Self {
        let mut sum = *self;
        sum.motors += time_s * power.motors;
        sum.pushes += time_s * power.pushes;
        sum.indentation += time_s * power.indentation;
        sum.torsion += time_s * power.torsion;
        sum.friction += time_s * power.friction;
        sum.slip += time_s * power.slip;
        sum.tables += time_s * power.tables;
        sum.weight += time_s * power.weight;
        for (sum, power) in sum.joint_speeds_squared.iter_mut().zip(&power.joint_speeds_squared) {
            *sum += time_s * power;
        }
        sum.velocity_squared += time_s * power.velocity_squared;
        sum.spin_squared += time_s * power.spin_squared;
        sum
    }
}
