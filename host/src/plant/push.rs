//! What pushes the object from outside: a force and a moment that rise, stay, and fall.

use nalgebra::Vector3;

/// A force and a moment on the object, for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// When it begins, s from the plant's start.
    pub from_s: f64,
    /// How long it lasts, s.
    pub for_s: f64,
    /// Time in which it rises at its beginning, and falls at its end, s; at most half of its length.
    pub rise_s: f64,
    /// Force at the centre of mass, base axes, N.
    pub force_n: Vector3<f64>,
    /// Moment, base axes, N m.
    pub moment_nm: Vector3<f64>,
}

impl Push {
    /// The mean share of it that acts between two times, s. Exact: a push gives the same impulse with every step.
    pub(super) fn share(&self, from_s: f64, until_s: f64) -> f64 {
        (self.until(until_s) - self.until(from_s)) / (until_s - from_s)
    }

    /// Integral of the share up to a time, s.
    fn until(&self, t_s: f64) -> f64 {
        let since_s = t_s - self.from_s;
        self.risen(since_s) - self.risen(since_s - (self.for_s - self.rise_s))
    }

    /// Integral of what rises at 0 and stays, s.
    fn risen(&self, t_s: f64) -> f64 {
        if t_s <= 0.0 {
            0.0
        } else if t_s < self.rise_s {
            0.5 * t_s * t_s / self.rise_s
        } else {
            t_s - 0.5 * self.rise_s
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn push(rise_s: f64) -> Push {
        Push { from_s: 1.0, for_s: 0.5, rise_s, force_n: Vector3::x(), moment_nm: Vector3::zeros() }
    }

    #[test]
    fn it_rises_stays_and_falls() {
        let push = push(0.2);
        let at = |t_s: f64| push.share(t_s - 1e-9, t_s + 1e-9);
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
                    .map(|k| step_s * push.share(k as f64 * step_s, (k + 1) as f64 * step_s))
                    .sum();
                assert!((impulse - (0.5 - rise_s)).abs() < 1e-12, "{rise_s} {step_s}: {impulse}");
            }
        }
    }

    #[test]
    fn half_of_a_step_counts_half() {
        assert!((push(0.0).share(0.95, 1.05) - 0.5).abs() < 1e-12);
    }
}
