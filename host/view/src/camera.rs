//! The place from which a picture is taken. The projection is parallel, so that lengths can be read off against a scale
//! bar.

use blindgrasp_shared::math::Real;
use nalgebra::Vector3;

/// The angle at which the camera looks down, degrees: usually, and where things happen on both sides of the palm.
const ELEVATION_DEG: f64 = 30.0;
const LOW_ELEVATION_DEG: f64 = 12.0;

/// A direction of view: unit vectors of the picture in the base frame of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    pub(super) right: Vector3<f64>,
    pub(super) up: Vector3<f64>,
    /// From the scene to the viewer.
    pub(super) back: Vector3<f64>,
}

impl View {
    /// Looks from `azimuth` (about z, from x) and from `elevation` above.
    pub(super) fn towards(azimuth_deg: f64, elevation_deg: f64) -> Self {
        let (sine, cosine) = azimuth_deg.to_radians().sine_cosine();
        let (rise, level) = elevation_deg.to_radians().sine_cosine();
        let back = Vector3::new(cosine * level, sine * level, rise);
        let right = Vector3::new(-sine, cosine, 0.0);
        Self { right, up: back.cross(&right), back }
    }

    /// The view in which the object hides the fingers least, and the fingers the object: no finger comes towards the
    /// viewer or goes straight away, and one looks at the palm's face rather than at its back.
    ///
    /// `fingers` lead from the object to the fingertips, `palm` from the palm to the object. Looks from lower down where
    /// the run `passes_palm`, which would hide it.
    pub(super) fn on_grasp(fingers: &[Vector3<f64>], palm: &Vector3<f64>, passes_palm: bool) -> Self {
        let elevation_deg = if passes_palm { LOW_ELEVATION_DEG } else { ELEVATION_DEG };
        let level = |v: &Vector3<f64>| {
            let flat = Vector3::new(v.x, v.y, 0.0);
            let length = v.norm();
            if length > 0.0 && length.is_finite() { flat / length } else { Vector3::zeros() }
        };
        let (fingers, palm): (Vec<_>, _) = (fingers.iter().map(level).collect(), level(palm));
        let cost = |view: &Self| {
            let towards = fingers.iter().map(|finger| finger.dot(&view.back));
            let in_front = towards.clone().fold(-1.0, f64::max);
            let in_line: f64 = towards.map(|t| t * t).sum();
            let facing = palm.dot(&view.back) - 0.4 * palm.norm();
            in_front + 0.3 * in_line + 1.5 * facing * facing
        };
        let best = (0..72)
            .map(|k| 5.0 * f64::from(k))
            .map(|azimuth| (azimuth, cost(&Self::towards(azimuth, elevation_deg))))
            .fold((0.0, f64::INFINITY), |best, candidate| {
                // Rounding must not choose between two views that are equally good.
                if candidate.1 < best.1 - 1e-6 { candidate } else { best }
            });
        // A little to the side, so that no face is seen square on.
        Self::towards(best.0 + 12.0, elevation_deg)
    }

    /// The same elevation from elsewhere: turned about z.
    pub(super) fn turned(&self, degrees: f64) -> Self {
        let (sine, cosine) = degrees.to_radians().sine_cosine();
        let turn = |v: Vector3<f64>| Vector3::new(v.x * cosine - v.y * sine, v.x * sine + v.y * cosine, v.z);
        Self { right: turn(self.right), up: turn(self.up), back: turn(self.back) }
    }

    /// Returns the place of a point in the picture plane, to the right and up, m.
    pub(super) fn flat(&self, point: &Vector3<f64>) -> [f64; 2] {
        [self.right.dot(point), self.up.dot(point)]
    }
}

/// A rectangle in the picture plane, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    low: [f64; 2],
    high: [f64; 2],
}

impl Extent {
    /// Around all finite points; a metre wide if there is none.
    pub(super) fn around(points: impl Iterator<Item = [f64; 2]>) -> Self {
        let mut extent = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };
        for point in points.filter(|point| point.iter().all(|v| v.is_finite())) {
            for k in 0..2 {
                extent.low[k] = extent.low[k].min(point[k]);
                extent.high[k] = extent.high[k].max(point[k]);
            }
        }
        if extent.low[0] < extent.high[0] && extent.low[1] < extent.high[1] {
            extent
        } else {
            Self { low: [-0.5; 2], high: [0.5; 2] }
        }
    }
}

/// A view and the part of it that the bitmap shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Camera {
    pub(super) view: View,
    pub(super) pixels_per_m: f64,
    /// Pixel in which the point sits that is at the origin of the picture plane.
    origin: [f64; 2],
}

impl Camera {
    /// Fits `extent` into the rectangle between two corners of the bitmap, in pixels.
    pub(super) fn fitted(view: View, extent: &Extent, from: [f64; 2], to: [f64; 2]) -> Self {
        let scale = |k: usize| (to[k] - from[k]) / (extent.high[k] - extent.low[k]);
        let pixels_per_m = scale(0).min(scale(1));
        let middle = |k: usize| 0.5 * (extent.low[k] + extent.high[k]) * pixels_per_m;
        let origin = [0.5 * (from[0] + to[0]) - middle(0), 0.5 * (from[1] + to[1]) + middle(1)];
        Self { view, pixels_per_m, origin }
    }

    /// The same camera for a bitmap with `factor` times the pixels.
    pub(super) fn magnified(&self, factor: f64) -> Self {
        Self {
            view: self.view,
            pixels_per_m: self.pixels_per_m * factor,
            origin: self.origin.map(|v| v * factor),
        }
    }

    /// Column, row (pixels, from the upper left corner) and distance from the viewer (m, up to a constant).
    pub(super) fn project(&self, point: &Vector3<f64>) -> [f32; 3] {
        let [right, up] = self.view.flat(point);
        [
            (self.origin[0] + right * self.pixels_per_m) as f32,
            (self.origin[1] - up * self.pixels_per_m) as f32,
            -self.view.back.dot(point) as f32,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_right_handed_and_prefer_an_open_side() {
        let fingers = [Vector3::x(), -Vector3::x(), Vector3::y()];
        let view = View::on_grasp(&fingers, &Vector3::z(), false);
        assert!((view.right.cross(&view.up) - view.back).norm() < 1e-12);
        assert!(view.back.y < -0.5, "from the side on which there is no finger: {view:?}");
        assert!(view.up.z > 0.5);
    }

    #[test]
    fn the_extent_fills_the_frame() {
        let view = View::towards(30.0, 30.0);
        let extent = Extent::around([[-0.1, -0.2], [0.3, 0.1], [f64::NAN, 9.0]].into_iter());
        let camera = Camera::fitted(view, &extent, [0.0, 10.0], [400.0, 310.0]);
        assert!((camera.pixels_per_m - 1000.0).abs() < 1e-9);
        let corner = view.right * 0.3 - view.up * 0.2;
        let [x, y, _] = camera.project(&corner);
        assert!((x - 400.0).abs() < 1e-3 && (y - 310.0).abs() < 1e-3, "{x} {y}");
        assert_eq!(Extent::around(std::iter::empty()), Extent { low: [-0.5; 2], high: [0.5; 2] });
    }
}
