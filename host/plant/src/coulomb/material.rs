//! Normal forces of soft contacts, as averages along the path of a step: a discrete gradient.
//!
//! With the elastic energy `P` and the integral `X` of the damping coefficient over depth, a contact whose depth goes from
//! `a` to `b` in a time `T` presses with
//!
//! ```text
//! f = (P(b) - P(a)) / (b - a) + (X(b) - X(a)) / T,
//! ```
//!
//! which takes from the bodies exactly what it stores and dampens, also in a step in which it touches or lets go. Nothing is
//! subtracted that is nearly equal: at rest both quotients are 0/0, and rounding alone would make micronewtons of them.

use std::f64::consts::PI;

use blindgrasp_body::FingertipModel;

/// A soft one-sided contact: polynomials of its depth, which are nothing where it is negative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Material {
    /// Part of the force that is proportional to the depth, N/m.
    pub(crate) linear_n_m: f64,
    /// Part that is proportional to its square, N/m^2.
    pub(super) quadratic_n_m2: f64,
    /// Damping coefficient, by powers of the depth, N s/m^(1 + power).
    pub(crate) damping: [f64; 3],
    /// Depth from which on there is no damping, m.
    pub(super) damped_until_m: f64,
}

/// A force before it is cut at zero, since a contact does not pull.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Response {
    /// N.
    pub(super) force_n: f64,
    /// Its slope over the rate of the depth, N s/m.
    pub(super) slope_n_s_m: f64,
    /// The elastic part of the force, N.
    pub(super) elastic_n: f64,
}

impl Material {
    /// The material of a fingertip: Eq. 14, whose damping is proportional to the area of contact.
    pub(super) fn of_fingertip(fingertip: &FingertipModel) -> Self {
        let FingertipModel { radius_m, stiffness_n_m2, damping_n_s_m3, .. } = *fingertip;
        let damping = [0.0, 2.0 * PI * damping_n_s_m3 * radius_m, -PI * damping_n_s_m3];
        Self { quadratic_n_m2: stiffness_n_m2, damping, damped_until_m: 2.0 * radius_m, ..Self::default() }
    }

    /// A spring and a damper.
    pub(super) fn spring(stiffness_n_m: f64, damping_n_s_m: f64) -> Self {
        Self {
            linear_n_m: stiffness_n_m,
            damping: [damping_n_s_m, 0.0, 0.0],
            damped_until_m: f64::INFINITY,
            ..Self::default()
        }
    }

    /// The same for so many contacts at once.
    pub(super) fn times(&self, count: f64) -> Self {
        Self {
            linear_n_m: self.linear_n_m * count,
            quadratic_n_m2: self.quadratic_n_m2 * count,
            damping: self.damping.map(|damping| damping * count),
            damped_until_m: self.damped_until_m,
        }
    }

    /// Elastic force at a depth, N.
    pub(super) fn elastic_force_n(&self, depth_m: f64) -> f64 {
        let d = depth_m.max(0.0);
        (self.linear_n_m + self.quadratic_n_m2 * d) * d
    }

    /// Elastic energy at a depth, J.
    pub(super) fn energy_j(&self, depth_m: f64) -> f64 {
        let d = depth_m.max(0.0);
        (self.linear_n_m / 2.0 + self.quadratic_n_m2 * d / 3.0) * d * d
    }

    /// Damping coefficient at a depth, N s/m.
    fn damping_n_s_m(&self, depth_m: f64) -> f64 {
        if !(depth_m > 0.0 && depth_m < self.damped_until_m) {
            return 0.0;
        }
        let [c0, c1, c2] = self.damping;
        c0 + (c1 + c2 * depth_m) * depth_m
    }

    /// The average along the path of a step, from a depth on, in which the depth changes at a rate.
    pub(super) fn average(&self, from_m: f64, rate_m_s: f64, time_s: f64) -> Response {
        let (k1, k2) = (self.linear_n_m, self.quadratic_n_m2);
        let (a, b) = (from_m, from_m + time_s * rate_m_s);
        // (P(b) - P(a)) / (b - a), and its slope over b.
        let (elastic_n, slope_n_m) = if a >= 0.0 && b >= 0.0 {
            (k1 * (a + b) / 2.0 + k2 * (a * a + a * b + b * b) / 3.0, k1 / 2.0 + k2 * (a + 2.0 * b) / 3.0)
        } else if b > 0.0 {
            let mean = self.energy_j(b) / (b - a);
            (mean, (self.elastic_force_n(b) - mean) / (b - a))
        } else if a > 0.0 {
            let mean = self.energy_j(a) / (a - b);
            (mean, mean / (a - b))
        } else {
            return Response::default();
        };
        // (X(b) - X(a)) / T.
        let inside = |d: f64| d.clamp(0.0, self.damped_until_m);
        let (p, q) = (inside(a), inside(b));
        let share = if p == a && q == b { rate_m_s } else { (q - p) / time_s };
        let [c0, c1, c2] = self.damping;
        let damped_n = share * (c0 + c1 * (p + q) / 2.0 + c2 * (p * p + p * q + q * q) / 3.0);
        Response {
            force_n: elastic_n + damped_n,
            slope_n_s_m: time_s * slope_n_m + self.damping_n_s_m(b),
            elastic_n,
        }
    }

    /// The response of the rolling contact: stiffness and damping frozen at a depth, for a comparison with it.
    pub(super) fn frozen(&self, depth_m: f64, before_m_s: f64, rate_m_s: f64, tau_s: f64) -> Response {
        let d = depth_m.max(0.0);
        let (damping, stiffness) = (self.damping_n_s_m(d), self.linear_n_m + 2.0 * self.quadratic_n_m2 * d);
        let elastic_n = self.elastic_force_n(d) + tau_s * stiffness * (rate_m_s - before_m_s);
        Response {
            force_n: elastic_n + damping * rate_m_s,
            slope_n_s_m: damping + tau_s * stiffness,
            elastic_n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIP: FingertipModel =
        FingertipModel { radius_m: 0.015, stiffness_n_m2: 2.39e6, damping_n_s_m3: 5e4, torsion_n_s_m: 0.0 };
    const TIME_S: f64 = 1e-3;

    /// `X` by its definition, with the trapezoidal rule in very short steps.
    fn damped(material: &Material, to_m: f64) -> f64 {
        const PARTS: usize = 20_000;
        let part = to_m / PARTS as f64;
        (0..PARTS).map(|k| part * material.damping_n_s_m((k as f64 + 0.5) * part)).sum()
    }

    /// Tolerances: quotients of differences lose six digits where the depth changes by a millionth; the slope is compared
    /// with a difference over 1e-6 of the rate.
    #[test]
    fn it_is_the_quotient_where_that_is_defined() {
        let spring = Material { damped_until_m: f64::INFINITY, ..Material::spring(6e4, 20.0) };
        for material in [Material::of_fingertip(&TIP), spring] {
            for (from_m, to_m) in
                [(1e-3, 2e-3), (2e-3, 1e-3), (-1e-3, 2e-3), (2e-3, -1e-3), (0.0, 1e-3), (0.029, 0.031)]
            {
                let rate = (to_m - from_m) / TIME_S;
                let got = material.average(from_m, rate, TIME_S);
                let elastic = (material.energy_j(to_m) - material.energy_j(from_m)) / (to_m - from_m);
                let damping = (damped(&material, to_m) - damped(&material, from_m)) / TIME_S;
                let expected = elastic + damping;
                assert!(
                    (got.force_n - expected).abs() < 1e-6 * expected.abs().max(1.0),
                    "{got:?} {expected}"
                );
                let off = 1e-6 * rate;
                let force = |rate: f64| material.average(from_m, rate, TIME_S).force_n;
                let slope = (force(rate + off) - force(rate - off)) / (2.0 * off);
                assert!((got.slope_n_s_m - slope).abs() < 1e-5 * slope.abs().max(1e-3), "{got:?} {slope}");
            }
            assert_eq!(material.average(-2e-3, 1.0, TIME_S), Response::default());
        }
    }

    /// A depth that does not change: the force itself, to rounding.
    #[test]
    fn at_rest_it_is_the_elastic_force() {
        let material = Material::of_fingertip(&TIP);
        for depth_m in [1e-9, 1e-6, 1.44e-3] {
            let force = material.average(depth_m, 0.0, TIME_S).force_n;
            assert!((force / material.elastic_force_n(depth_m) - 1.0).abs() < 1e-15);
        }
    }
}
