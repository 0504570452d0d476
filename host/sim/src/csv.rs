//! Samples as comma-separated values: one row a control tick.

use super::sample::{ContactSample, Sample};
use blindgrasp_shared::control::GAINS;
use std::io::Write;

/// Writes samples with a header. Numbers are in the shortest form that reads back as the same bits.
///
/// # Errors
/// What the writer says.
pub fn write(to: impl Write, samples: &[Sample]) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_writer(to);
    if let Some(first) = samples.first() {
        writer.write_record(header(first.angles_rad.len(), first.contacts.len()))?;
    }
    let mut row = Vec::new();
    for sample in samples {
        row.clear();
        fill(&mut row, sample);
        for value in &row {
            writer.write_field(value.to_string())?;
        }
        writer.write_field(sample.mode)?;
        writer.write_record(None::<&[u8]>)?;
    }
    writer.flush()?;
    Ok(())
}

/// Column names: joints and fingers count from 1. SI units throughout: rad, rad/s, N m, m, m/s, N, J.
fn header(joints: usize, fingers: usize) -> Vec<String> {
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
    names.push("mode".to_owned());
    names
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
}
