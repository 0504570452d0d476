//! Samples as comma-separated values: one row a control tick.

use super::sample::{ContactSample, Sample};
use blindgrasp_shared::control::GAINS;
use std::io::{self, BufWriter, Write};

/// Samples on their way to a file, with a header. Numbers are in the shortest form that reads back as the same bits.
pub struct Trace<W: Write> {
    to: BufWriter<W>,
    row: Vec<f64>,
    failure: Option<io::Error>,
}

impl<W: Write> Trace<W> {
    /// Begins a trace.
    pub fn new(to: W) -> Self {
        Self { to: BufWriter::new(to), row: Vec::new(), failure: None }
    }

    /// Takes the next sample. What can't be written ends the trace, and is told at its end.
    pub fn see(&mut self, sample: &Sample) {
        if self.failure.is_none() {
            self.failure = self.write(sample).err();
        }
    }

    fn write(&mut self, sample: &Sample) -> io::Result<()> {
        if self.row.is_empty() {
            writeln!(self.to, "{}", header(sample).join(","))?;
        }
        self.row.clear();
        fill(&mut self.row, sample);
        for value in &self.row {
            write!(self.to, "{value},")?;
        }
        writeln!(self.to, "{}", sample.mode)
    }

    /// Ends the trace.
    ///
    /// # Errors
    /// What went wrong since its beginning.
    pub fn finish(mut self) -> io::Result<()> {
        match self.failure {
            Some(failure) => Err(failure),
            None => self.to.flush(),
        }
    }
}

/// Writes all samples of a run.
///
/// # Errors
/// What the writer says.
pub fn write(to: impl Write, samples: &[Sample]) -> io::Result<()> {
    let mut trace = Trace::new(to);
    samples.iter().for_each(|sample| trace.see(sample));
    trace.finish()
}

/// Column names: joints and fingers count from 1. SI units throughout: rad, rad/s, N m, m, m/s, N, J.
fn header(sample: &Sample) -> Vec<String> {
    let (joints, fingers) = (sample.angles_rad.len(), sample.contacts.len());
    let mut names = vec!["t_s".to_owned()];
    for quantity in ["q", "dq", "q_est", "dq_est", "u"] {
        names.extend((1..=joints).map(|k| format!("{quantity}_{k}")));
    }
    let object = ["x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"];
    names.extend(object.map(str::to_owned));
    for finger in 1..=fingers {
        let contact = ["f_N", "lambda_x", "lambda_z", "dr", "foot_x", "foot_z"];
        names.extend(contact.map(|quantity| format!("{quantity}_{finger}")));
    }
    let energies = ["energy", "kinetic", "elastic", "weight"];
    let potentials = GAINS.map(|gain| gain.potential.key.trim_end_matches("_potential_j"));
    let flows = ["motors", "damping", "indentation", "torsion", "friction", "pushes"];
    names.extend(energies.iter().chain(&potentials).chain(&flows).map(|name| format!("{name}_j")));
    if has_friction(sample) {
        for finger in 1..=fingers {
            names.extend(["friction_used", "slipped_m"].map(|quantity| format!("{quantity}_{finger}")));
        }
        names.extend(["table_x_N", "table_y_N", "table_z_N", "slip_j", "tables_j"].map(str::to_owned));
    }
    names.push("mode".to_owned());
    names
}

fn has_friction(sample: &Sample) -> bool {
    sample.contacts.iter().any(|contact| contact.friction.is_some())
}

fn fill(row: &mut Vec<f64>, sample: &Sample) {
    row.push(sample.t_s);
    row.extend(&sample.angles_rad);
    row.extend(&sample.speeds_rad_s);
    row.extend(&sample.estimated_angles_rad);
    row.extend(&sample.estimated_speeds_rad_s);
    row.extend(&sample.torques_nm);
    row.extend(sample.position_m.iter());
    let q = sample.attitude.quaternion();
    row.extend([q.w, q.i, q.j, q.k]);
    row.extend(sample.velocity_m_s.iter().chain(sample.spin_rad_s.iter()));
    for ContactSample { normal_force_n, lambda_n: [x, z], indentation_m, foot_m, .. } in &sample.contacts {
        row.extend([*normal_force_n, *x, *z, *indentation_m, foot_m[0], foot_m[1]]);
    }
    let of = &sample.energies;
    row.extend([sample.energy_j, of.kinetic_j, of.elastic_j, of.weight_j]);
    row.extend(of.potentials_j.iter());
    row.extend([of.motors_j, of.damping_j, of.indentation_j, of.torsion_j, of.friction_j, of.pushes_j]);
    if has_friction(sample) {
        for friction in sample.contacts.iter().filter_map(|contact| contact.friction) {
            row.extend([friction.used, friction.slipped_m]);
        }
        row.extend(sample.table_force_n().iter());
        row.extend([of.slip_j, of.tables_j]);
    }
}
