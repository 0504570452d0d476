//! The start of the runs (Table III, Eq. 59), and the weight that the paper neglects (assumption 5).

use super::{calm, largest, row, runs};
use crate::claim::{Claim, Figure, Row, Verdict, number, percent};
use crate::evidence::{Done, Evidence, EvidenceError};

/// Indentations that the reconstructed hand-arm has in Table III's posture, m.
const INDENTATIONS_M: [f64; 3] = [10.8e-3, 12.1e-3, 12.3e-3];
const INDENTATION_TOLERANCE_M: f64 = 0.2e-3;
/// Part of the forces by which the weight may change them.
const WEIGHT: f64 = 0.02;

pub(super) fn table_iii(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    Ok(Claim {
        key: "table-iii",
        words: "The initial condition of Table III is one of contact: hand, arm and object of Table I meet",
        place: "Tables I and III",
        criterion: "the fingertips are indented by 10.8, 12.1 and 12.3 mm, within 0.2 mm; the equilibrium of Eq. 57 asks for about \
                    11.5",
        tolerance: "Lengths of Table I are printed to a millimetre, angles of Table III to a thousandth of a radian, which is a \
                    millimetre at the end of a finger: the geometry that the text leaves out was chosen to fit them.",
        rows: vec![table_iii_row(evidence.run("hand-arm")?)],
    })
}

pub(super) fn table_iii_row(done: &Done) -> Row {
    let start = &done.scene.start.indentations_m;
    let off = largest(start.iter().zip(INDENTATIONS_M).map(|(m, expected)| (m - expected).abs()));
    let mm: Vec<String> = start.iter().map(|m| format!("{:.2}", 1e3 * m)).collect();
    let wanted = equilibrium_m(done);
    let wanted: Vec<String> = wanted.iter().map(|m| format!("{:.2}", 1e3 * m)).collect();
    let holds = start.len() == INDENTATIONS_M.len() && off <= INDENTATION_TOLERANCE_M;
    let measured = format!("{} mm; Eq. 57 asks for {} mm", mm.join(", "), wanted.join(", "));
    let mut row = row(done, measured, Verdict::holds(holds));
    let names = ["indentation_1", "indentation_2", "indentation_3"];
    row.figures = names.iter().zip(start).map(|(name, m)| Figure::new(name, *m, "m")).collect();
    row
}

/// Indentations whose elastic force is that of Eq. 57, in the posture of the start, m.
fn equilibrium_m(done: &Done) -> Vec<f64> {
    use blindgrasp_shared::math::Real;
    let first = done.run.samples.first().into_iter().flat_map(|sample| &sample.contacts);
    let stiffness = done.scene.fingertips.iter().map(|fingertip| fingertip.stiffness_n_m2);
    first.zip(stiffness).map(|(c, k)| (c.desired_normal_force_n / k).square_root()).collect()
}

pub(super) fn latch(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let names = ["hand-arm", "prism-continuous", "cube-continuous", "prism", "cube"];
    Ok(Claim {
        key: "latch",
        words: "The desired relative attitudes are those of the start: u_st begins from nothing",
        place: "Eqs. 34 and 59",
        criterion: "V_st, with the constant that makes its least value zero, is below 1e-12 of 3 N K_st at the first sample",
        tolerance: "Rounding: traces of products of rotation matrices.",
        rows: runs(evidence, &names)?.into_iter().map(latch_row).collect(),
    })
}

pub(super) fn latch_row(done: &Done) -> Row {
    let potential = done.run.samples.first().map_or(f64::NAN, |sample| sample.energies.potentials_j.grasp[1]);
    let most = 3.0 * done.scene.hand.fingertip_count() as f64 * done.scene.control.attitude_stiffness_nm();
    let mut row = row(
        done,
        format!("V_st(0) = {} J of at most {} J", number(potential), number(most)),
        Verdict::holds(potential.abs() <= 1e-12 * most),
    );
    row.figures = vec![Figure::new("potential_at_start", potential, "J")];
    row
}

pub(super) fn weight(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let (with, without) = (evidence.run("cube-weight")?, evidence.run("cube")?);
    Ok(Claim {
        key: "weight",
        words: "The object's weight is so small that it may be ignored",
        place: "Sec. 2, assumption 5; Sec. 6",
        criterion: "with it the cube is held and comes to rest, and no normal force changes by more than 2 %",
        tolerance: "2.1 g weigh 0.02 N, half a per cent of a normal force; it acts along the faces, and friction decides where a \
                    joint stops.",
        rows: vec![weight_row(with, without)],
    })
}

pub(super) fn weight_row(with: &Done, without: &Done) -> Row {
    let forces = [with, without].map(|done| calm(done).map(|sample| &sample.contacts));
    let [Some(with_n), Some(without_n)] = forces else {
        return row(with, "no sample".to_owned(), Verdict::NotReproduced);
    };
    let change =
        |(a, b): (&blindgrasp_sim::sample::ContactSample, &blindgrasp_sim::sample::ContactSample)| {
            (a.normal_force_n / b.normal_force_n - 1.0).abs()
        };
    let change = largest(with_n.iter().zip(without_n).map(change));
    let settled = with.summary().settle_time_s;
    let words = settled.map_or("not at rest".to_owned(), |t_s| format!("at rest from {t_s:.2} s on"));
    let mut row = row(
        with,
        format!("{words}; normal forces change by {}", percent(change)),
        Verdict::holds(settled.is_some() && change <= WEIGHT),
    );
    row.figures = vec![Figure::new("force_change", change, "")];
    row
}
