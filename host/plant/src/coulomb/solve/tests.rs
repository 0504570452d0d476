//! Random states with contacts that stick, slip and separate, against an algorithm of another kind and against the conditions
//! themselves.

use super::*;
use blindgrasp_meshes::Numbers;

/// A linear law of each contact: force at standstill and slope.
type Laws = Vec<(f64, f64)>;

/// One to twelve contacts of a body with six to eighteen degrees of freedom. Some have their rows twice, so that the forces are
/// not unique.
fn random(numbers: &mut Numbers) -> (Problem, Laws) {
    let freedoms = 6 + 4 * numbers.below(4);
    let mut problem = Problem::default();
    let (mut rows, mut laws) = (Vec::<[Vec<f64>; 4]>::new(), vec![]);
    let motion: Vec<f64> = (0..freedoms).map(|_| numbers.unit() - 0.5).collect();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut tangents = 0;
    for _ in 0..1 + numbers.below(12) {
        let last = tangents;
        tangents = [0, 2, 3][numbers.below(3)];
        let friction = if tangents == 0 { 0.0 } else { 0.05 + 1.5 * numbers.unit() };
        let twin = rows.last().filter(|_| last == tangents && numbers.below(2) == 0);
        let own = twin.cloned().unwrap_or_else(|| {
            std::array::from_fn(|part| {
                let size = if part <= tangents { 2.0 } else { 0.0 };
                (0..freedoms).map(|_| size * (numbers.unit() - 0.5)).collect()
            })
        });
        problem.add(tangents, friction, std::array::from_fn(|k| product(&own[k], &motion)), [0.0; 4]);
        rows.push(own);
        // Pressed with up to 3 N, or apart.
        laws.push((4.0 * numbers.unit() - 1.0, 0.2 + 5.0 * numbers.unit()));
    }
    problem.couple(|i, j, block| {
        for (a, b) in (0..16).map(|k| (k / 4, k % 4)) {
            block[a][b] = 0.1 * product(&rows[i][a], &rows[j][b]);
        }
    });
    (problem, laws)
}

impl Problem {
    /// Velocities by the plainest algorithm: a short step against the velocities, and back into the cone, again and again.
    fn by_projected_steps(&self, laws: &Laws) -> Option<Vec<Four>> {
        let n = self.places.len();
        let mut slow = self.clone();
        slow.forces.fill([0.0; 4]);
        let stiffest = laws.iter().map(|(_, slope)| 1.0 / slope).fold(0.0, f64::max);
        let trace = |k: usize| (0..4).map(|r| self.delassus[k * (n + 1)][r][r]).sum::<f64>();
        let step = 1.0 / ((0..n).map(trace).sum::<f64>() + stiffest);
        for _ in 0..400_000 {
            slow.update_velocities();
            let mut change: f64 = 0.0;
            for (k, (place, (a, s))) in self.places.iter().zip(laws).enumerate() {
                let (forces, velocities) = (slow.forces[k], slow.velocities[k]);
                let normal = (forces[0] - step * (velocities[0] + (forces[0] - a) / s)).max(0.0);
                let mut tangential: [f64; 3] =
                    std::array::from_fn(|i| forces[i + 1] - step * velocities[i + 1]);
                into_ball(&mut tangential, place.friction * normal);
                slow.forces[k] = [normal, tangential[0], tangential[1], tangential[2]];
                let changes = slow.forces[k].iter().zip(&forces).map(|(next, force)| (next - force).abs());
                change = changes.fold(change, f64::max);
            }
            if change < 1e-13 {
                slow.update_velocities();
                return Some(slow.velocities);
            }
        }
        None
    }

    /// The largest violation of each condition: cone, softened Signorini, maximum dissipation, complementarity of slip.
    fn residuals(&self, laws: &Laws) -> [f64; 4] {
        let mut worst = [0.0f64; 4];
        for (k, (place, (a, s))) in self.places.iter().zip(laws).enumerate() {
            let (forces, velocities) = (&self.forces[k], &self.velocities[k]);
            let (force, slip) = (length(&forces[1..]), length(&velocities[1..]));
            let radius = place.friction * forces[0];
            let power: f64 = forces[1..].iter().zip(&velocities[1..]).map(|(l, c)| l * c).sum();
            let lawful = (a - s * velocities[0]).max(0.0);
            let here = [
                (force - radius).max(0.0).max(-forces[0]),
                (forces[0] - lawful).abs(),
                (power + force * slip).abs(),
                (radius - force).max(0.0) * slip,
            ];
            worst = std::array::from_fn(|k| worst[k].max(here[k]));
        }
        worst
    }
}

/// Tolerances: 1e-9 for the conditions, forces being of the order of a newton and velocities of a metre a second; 1e-8 for
/// velocities against the other algorithm, which creeps towards its end.
#[test]
fn two_hundred_random_states() {
    let mut numbers = Numbers(11);
    let (mut worst, mut off, mut compared) = ([0.0f64; 4], 0.0f64, 0);
    let mut states = [0; 3];
    for case in 0..200 {
        let (mut problem, laws) = random(&mut numbers);
        let slow = problem.by_projected_steps(&laws);
        let law = |k: usize, rate: f64| {
            let (a, s) = laws[k];
            Response { force_n: a + s * rate, slope_n_s_m: s, elastic_n: 0.0 }
        };
        problem.solve(law, &vec![0.0; laws.len()]);
        assert_eq!(problem.counters.unconverged, 0, "case {case}");
        let residuals = problem.residuals(&laws);
        worst = std::array::from_fn(|k| worst[k].max(residuals[k]));
        for (k, forces) in problem.forces.iter().enumerate() {
            states[if !(forces[0] > 0.0) {
                0
            } else if problem.sticks(k) {
                1
            } else {
                2
            }] += 1;
        }
        if let Some(slow) = slow {
            compared += 1;
            let pairs = slow.iter().flatten().zip(problem.velocities.iter().flatten());
            off = pairs.fold(off, |off, (a, b)| off.max((a - b).abs()));
        }
    }
    println!(
        "residuals {worst:?}; {compared} compared, velocities off by {off:.1e}; apart, stuck, slipping: {states:?}"
    );
    assert!(worst.iter().all(|residual| *residual < 1e-9) && off < 1e-8 && compared > 190);
    assert!(states.iter().all(|count| *count > 50));
}
