//! Pushes at the object from outside: a force and a moment that rise, stay, and fall.

use blindgrasp_body::Push;

/// The mean share of a push that acts between two times, s. Exact: a push gives the same impulse with every step.
pub(super) fn share(push: &Push, from_s: f64, until_s: f64) -> f64 {
    (until(push, until_s) - until(push, from_s)) / (until_s - from_s)
}

/// Integral of the share up to a time, s.
fn until(push: &Push, t_s: f64) -> f64 {
    let since_s = t_s - push.from_s;
    risen(push, since_s) - risen(push, since_s - (push.for_s - push.rise_s))
}

/// Integral of what rises at 0 and stays, s.
fn risen(push: &Push, t_s: f64) -> f64 {
    if t_s <= 0.0 {
        0.0
    } else if t_s < push.rise_s {
        0.5 * t_s * t_s / push.rise_s
    } else {
        t_s - 0.5 * push.rise_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn push(rise_s: f64) -> Push {
        Push { from_s: 1.0, for_s: 0.5, rise_s, force_n: Vector3::x(), moment_nm: Vector3::zeros() }
    }

    #[test]
    fn it_rises_stays_and_falls() {
        let push = push(0.2);
        let at = |t_s: f64| share(&push, t_s - 1e-9, t_s + 1e-9);
        let corners = [(0.9, 0.0), (1.1, 0.5), (1.2, 1.0), (1.25, 1.0), (1.4, 0.5), (1.6, 0.0)];
        for (t_s, share) in corners {
            // A difference of times near one, over 2e-9 s.
            assert!((at(t_s) - share).abs() < 1e-6, "{t_s}: {}", at(t_s));
        }
    }

    /// Whatever the step, at whatever place the push begins in it.
    #[test]
    fn its_impulse_does_not_depend_on_the_step() {
        for rise_s in [0.0, 0.1, 0.25] {
            for step_s in [1e-3, 0.033, 0.7, 3.0] {
                let push = push(rise_s);
                let impulse: f64 = (0..(3.0_f64 / step_s).ceil() as usize)
                    .map(|k| step_s * share(&push, k as f64 * step_s, (k + 1) as f64 * step_s))
                    .sum();
                assert!((impulse - (0.5 - rise_s)).abs() < 1e-12, "{rise_s} {step_s}: {impulse}");
            }
        }
    }

    #[test]
    fn half_of_a_step_counts_half() {
        assert!((share(&push(0.0), 0.95, 1.05) - 0.5).abs() < 1e-12);
    }
}
