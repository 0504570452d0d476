//! Energy (Eqs. 39, 40, 50): what is stored, what flows, and what is left of the balance.

use super::{largest, row, runs};
use crate::claim::{Claim, Figure, Row, Verdict, number, percent};
use crate::evidence::{Done, Evidence, EvidenceError};
use blindgrasp_sim::sample::{EnergySample, Sample};
use blindgrasp_sim::summary::{REST_JOINT_SPEED_RAD_S, REST_OBJECT_SPEED_M_S, REST_OBJECT_SPIN_RAD_S};

/// Part of the exchanged energy that the balance may miss at any tick.
const MISSED: f64 = 1e-3;
/// Time in which hardly anything is exchanged, s.
const BEGINNING_S: f64 = 0.01;
/// Order with which what is missed has to shrink with the integrator's step.
const LEAST_ORDER: f64 = 1.8;
/// Part of the dissipated energy by which the energy may rise on the way.
const RISE: f64 = 1e-3;
/// Part of the integrals of squared speeds that the last tenth of a run may add.
const LATE: f64 = 0.01;

pub(super) fn balance(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    Ok(Claim {
        key: "energy-balance",
        words: "dE/dt is minus what dampers take (as corrected: dq^T C dq + sum of 2 T_i + xi (d(dr)/dt)^2)",
        place: "Eq. 39",
        criterion: "at every tick: stored + dissipated - work of the motors misses at most 1e-3 of the energy exchanged so far in \
                    the run",
        tolerance: "The integrator's own error, of second order. Exchanged is the largest of what was stored, dissipated and done \
                    by the motors besides holding weight; the first 10 ms, in which hardly anything is exchanged, are measured \
                    by the whole run.",
        rows: evidence.runs.iter().map(balance_row).collect(),
    })
}

/// The error of the balance.
#[derive(Default)]
struct Missed {
    /// The most at a tick, J.
    most_j: f64,
    /// The energy that was exchanged in the whole run, J.
    exchanged_j: f64,
    /// The most at a tick as a part of what was exchanged up to it.
    share: f64,
}

fn missed(samples: &[Sample]) -> Missed {
    let Some(first) = samples.first() else { return Missed::default() };
    let (start_s, first) = (first.t_s, first.energies);
    let missed = |now: &EnergySample| {
        now.stored_j() - first.stored_j() + now.dissipated_j() - now.motors_j - now.pushes_j
    };
    let exchanged = |now: &EnergySample| {
        let weight = now.weight_j - first.weight_j;
        let inside = now.stored_j() - first.stored_j() - weight;
        largest([inside.abs(), now.dissipated_j(), (now.motors_j - weight).abs()].into_iter())
    };
    let exchanged_j = largest(samples.iter().map(|sample| exchanged(&sample.energies)));
    let mut of = Missed { exchanged_j, ..Missed::default() };
    let mut so_far_j: f64 = 0.0;
    for sample in samples {
        let missed_j = missed(&sample.energies).abs();
        so_far_j = so_far_j.max(exchanged(&sample.energies));
        let scale_j = if sample.t_s - start_s < BEGINNING_S { exchanged_j } else { so_far_j };
        of.most_j = of.most_j.max(missed_j);
        // A miss of what is not a number counts.
        of.share = largest([of.share, missed_j / scale_j].into_iter());
    }
    of
}

pub(super) fn balance_row(done: &Done) -> Row {
    let samples = &done.run.samples;
    let Missed { most_j: missed_j, exchanged_j, share } = missed(samples);
    let last = samples.last().map(|sample| sample.energies).unwrap_or_default();
    let fed_j = fed(samples);
    let mut row = row(
        done,
        format!(
            "misses {} J of {} J exchanged, at most {} of what was so far; sampling and soft start feed in {} J",
            number(missed_j),
            number(exchanged_j),
            percent(share),
            number(fed_j)
        ),
        Verdict::holds(share <= MISSED),
    );
    row.figures = vec![
        Figure::new("missed", missed_j, "J"),
        Figure::new("exchanged", exchanged_j, "J"),
        Figure::new("dissipated", last.dissipated_j(), "J"),
        Figure::new("damped_by_law", last.damping_j, "J"),
        Figure::new("fed_in", fed_j, "J"),
    ];
    row
}

/// Returns the work of the motors beyond the law in continuous time and at full force, J: what Eq. 39 misses at the
/// end.
fn fed(samples: &[Sample]) -> f64 {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return 0.0 };
    let (first, last) = (&first.energies, &last.energies);
    last.of_equation_40_j() - first.of_equation_40_j() + last.dissipated_j() + last.damping_j
}

pub(super) fn order(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let pairs = [
        ("prism-whole-step", "prism-half-step"),
        ("cube-whole-step", "cube-half-step"),
        ("hand-arm-whole-step", "hand-arm-half-step"),
    ];
    let rows = pairs
        .into_iter()
        .map(|(whole, half)| Ok(order_row(evidence.run(whole)?, evidence.run(half)?)))
        .collect::<Result<_, EvidenceError>>()?;
    Ok(Claim {
        key: "energy-order",
        words: "What the energy balance misses is the integrator's, and shrinks with its order",
        place: "Eq. 39",
        criterion: "with half the step it is less by a factor of 2^1.8 at least (an order of 1.8; the integrator has two)",
        tolerance: "The largest miss of a run need not fall into the same tick with both steps, which blurs its order a little.",
        rows,
    })
}

pub(super) fn order_row(whole: &Done, half: &Done) -> Row {
    let [coarse, fine] = [whole, half].map(|done| missed(&done.run.samples).most_j);
    let order = (coarse / fine).log2();
    let measured = format!("{} J, with half the step {} J: order {order:.2}", number(coarse), number(fine));
    let mut row = row(whole, measured, Verdict::holds(order >= LEAST_ORDER));
    row.figures = vec![
        Figure::new("missed", coarse, "J"),
        Figure::new("missed_with_half_the_step", fine, "J"),
        Figure::new("order", order, ""),
    ];
    row
}

pub(super) fn falls(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let names = [
        "prism-continuous",
        "cube-continuous",
        "hand-arm-continuous",
        "prism-ideal-minute",
        "cube-ideal",
        "hand-arm",
    ];
    Ok(Claim {
        key: "energy-falls",
        words: "E of Eq. 40 never rises",
        place: "Eqs. 39 and 40",
        criterion: "no sample, a millisecond apart, is above an earlier one by more than 1e-3 of what was dissipated in all",
        tolerance: "The law acts at 10 kHz at the most, not in continuous time; what its hold feeds in is a hundredth of that.",
        rows: runs(evidence, &names)?.into_iter().map(falls_row).collect(),
    })
}

pub(super) fn falls_row(done: &Done) -> Row {
    let samples = &done.run.samples;
    let energy = done.summary().energy;
    let taken =
        samples.last().map_or(0.0, |sample| sample.energies.dissipated_j() + sample.energies.damping_j);
    let share = energy.increase_max_j / taken;
    let sampled = done.scene.control.period_s > done.scene.substep_s;
    let holds = share <= RISE;
    let measured = format!(
        "{} J to {} J; largest rise {} J, {} of what was dissipated",
        number(energy.initial_j),
        number(energy.final_j),
        number(energy.increase_max_j),
        percent(share)
    );
    let mut row = row(done, measured, Verdict::of(holds, sampled));
    if !holds && sampled {
        row.remark = format!(
            "torques that are held for {} ms feed energy into the stiffest swings; with the law at 10 kHz this is not so",
            number(1e3 * done.scene.control.period_s)
        );
    }
    row.figures = vec![
        Figure::new("initial", energy.initial_j, "J"),
        Figure::new("final", energy.final_j, "J"),
        Figure::new("largest_rise", energy.increase_max_j, "J"),
    ];
    row
}

pub(super) fn square_integrable(evidence: &Evidence) -> Result<Claim, EvidenceError> {
    let names = ["prism-continuous", "cube-continuous", "hand-arm-stiff", "hand-arm"];
    Ok(Claim {
        key: "square-integrable",
        words: "The dissipated energy stays below E(0), so that all velocities are square integrable",
        place: "Eq. 50",
        criterion: "what dampers and the law's damping took by the end is below E(0), and the last tenth of the run adds less than \
                    1 % to the integrals of |dq|^2, |dx/dt|^2 and |w|^2 (those of a speed that never leaves the limits of rest left \
                    out)",
        tolerance: "An integral that converges gains less and less; 1 % in a tenth of the run is a tenth of what a steady motion \
                    would add.",
        rows: runs(evidence, &names)?.into_iter().map(square_integrable_row).collect(),
    })
}

pub(super) fn square_integrable_row(done: &Done) -> Row {
    let samples = &done.run.samples;
    let ninth = samples.get(samples.len() * 9 / 10).map(|sample| sample.energies).unwrap_or_default();
    let (first, last) = match (samples.first(), samples.last()) {
        (Some(first), Some(last)) => (first.energies, last.energies),
        _ => Default::default(),
    };
    let taken_j = last.dissipated_j() + last.damping_j;
    let initial_j = first.of_equation_40_j();
    let length_s = samples.last().map_or(0.0, |sample| sample.t_s);
    // A speed that stays within the limits of rest, as a rotation does that symmetry forbids, has nothing but noise to sum up.
    let late = |ninth: f64, last: f64, rest: f64| {
        if last < rest * rest * length_s { 0.0 } else { 1.0 - ninth / last }
    };
    let late = largest(
        [
            late(ninth.joint_speeds_squared, last.joint_speeds_squared, REST_JOINT_SPEED_RAD_S),
            late(ninth.velocity_squared, last.velocity_squared, REST_OBJECT_SPEED_M_S),
            late(ninth.spin_squared, last.spin_squared, REST_OBJECT_SPIN_RAD_S),
        ]
        .into_iter(),
    );
    let bounded = taken_j <= initial_j;
    let mut row = row(
        done,
        format!(
            "dissipated {} J of E(0) = {} J; integral of |dq|^2 {} rad^2/s, of which the last tenth adds {}",
            number(taken_j),
            number(initial_j),
            number(last.joint_speeds_squared),
            percent(late)
        ),
        Verdict::holds(bounded && late < LATE),
    );
    if !(late < LATE) {
        row.remark = "bounded by E(0) as the equation says, but not converging within the run: it snaps through at its end".to_owned();
    }
    row.figures = vec![
        Figure::new("dissipated", taken_j, "J"),
        Figure::new("initial", initial_j, "J"),
        Figure::new("joint_speeds_squared", last.joint_speeds_squared, "rad^2/s"),
        Figure::new("velocity_squared", last.velocity_squared, "m^2/s"),
        Figure::new("spin_squared", last.spin_squared, "rad^2/s"),
        Figure::new("last_tenth", late, ""),
    ];
    row
}
