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
    let (mut rows, mut laws) = (Vec::<Vec<f64>>::new(), vec![]);
    for _ in 0..1 + numbers.below(12) {
        let tangents = [0, 2, 3][numbers.below(3)];
        let friction = if tangents == 0 { 0.0 } else { 0.05 + 1.5 * numbers.unit() };
        let row = problem.add(tangents, friction);
        let twin = row.checked_sub(1 + tangents).filter(|_| numbers.below(4) == 0);
        for k in 0..1 + tangents {
            rows.push(match twin {
                Some(twin) => rows[twin + k].clone(),
                None => (0..freedoms).map(|_| 2.0 * numbers.unit() - 1.0).collect(),
            });
        }
        // Pressed with up to 3 N, or apart.
        laws.push((4.0 * numbers.unit() - 1.0, 0.2 + 5.0 * numbers.unit()));
    }
    problem.make_room();
    let n = rows.len();
    let motion: Vec<f64> = (0..freedoms).map(|_| numbers.unit() - 0.5).collect();
    for r in 0..n {
        problem.free[r] = dot(&rows[r], &motion);
        for s in 0..n {
            problem.delassus[r * n + s] = 0.1 * dot(&rows[r], &rows[s]);
        }
    }
    (problem, laws)
}

impl Problem {
    /// Velocities by the plainest algorithm: a short step against the velocities, and back into the cone, again and again.
    fn by_projected_steps(&self, laws: &Laws) -> Option<Vec<f64>> {
        let n = self.count;
        let mut slow = self.clone();
        slow.forces.fill(0.0);
        let stiffest = laws.iter().map(|(_, slope)| 1.0 / slope).fold(0.0, f64::max);
        let step = 1.0 / ((0..n).map(|r| self.delassus[r * n + r]).sum::<f64>() + stiffest);
        for _ in 0..400_000 {
            slow.update_velocities();
            let mut change: f64 = 0.0;
            for (place, (a, s)) in self.places.iter().zip(laws) {
                let normal = place.normal;
                let force = slow.forces[normal];
                let next = (force - step * (slow.velocities[normal] + (force - a) / s)).max(0.0);
                change = change.max((next - force).abs());
                slow.forces[normal] = next;
                let mut target = [0.0; 3];
                for (target, r) in target.iter_mut().zip(place.tangential()) {
                    *target = slow.forces[r] - step * slow.velocities[r];
                }
                let target = &mut target[..place.tangents];
                into_ball(target, place.friction * next);
                for (target, r) in target.iter().zip(place.tangential()) {
                    change = change.max((target - slow.forces[r]).abs());
                    slow.forces[r] = *target;
                }
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
        for (place, (a, s)) in self.places.iter().zip(laws) {
            let (normal, rows) = (place.normal, place.tangential());
            let (force, slip) = (length(&self.forces[rows.clone()]), length(&self.velocities[rows.clone()]));
            let radius = place.friction * self.forces[normal];
            let power = dot(&self.forces[rows.clone()], &self.velocities[rows]);
            let lawful = (a - s * self.velocities[normal]).max(0.0);
            let here = [
                (force - radius).max(0.0).max(-self.forces[normal]),
                (self.forces[normal] - lawful).abs(),
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
        for (k, place) in problem.places.iter().enumerate() {
            let pressed = problem.forces[place.normal] > 0.0;
            states[if !pressed {
                0
            } else if problem.sticking(k).is_some() {
                1
            } else {
                2
            }] += 1;
        }
        if let Some(slow) = slow {
            compared += 1;
            off = slow.iter().zip(&problem.velocities).fold(off, |off, (a, b)| off.max((a - b).abs()));
        }
    }
    println!(
        "residuals {worst:?}; {compared} compared, velocities off by {off:.1e}; apart, stuck, slipping: {states:?}"
    );
    assert!(worst.iter().all(|residual| *residual < 1e-9) && off < 1e-8 && compared > 190);
    assert!(states.iter().all(|count| *count > 50));
}
