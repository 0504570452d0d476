//! A polyhedron, prepared to be asked often where spheres and lines touch it.

use super::Polyhedron;
use super::convex::{Closest, Convex};
use super::critical::{Critical, Features};
use blindgrasp_shared::math::norm;
use nalgebra::Vector3;

/// Steps of the search for the point of a line that is closest, at most.
const STEPS: u32 = 100;
/// Error of where that point is, in units of the line's length.
const TOLERANCE: f64 = 1e-12;
/// Points of a line that are looked at first where the body is not convex: halves, quarters, eighths, sixteenths.
const LOOKS: u32 = 16;

/// A polyhedron's surface. A convex body has a quicker way.
#[derive(Clone, Debug)]
pub struct Touchable(Form);

#[derive(Clone, Debug)]
enum Form {
    Convex(Convex),
    Any(Features),
}

impl Touchable {
    /// Of a polyhedron.
    pub fn of(shape: &Polyhedron) -> Self {
        Self(Convex::of(shape).map_or_else(|| Form::Any(Features::of(shape)), Form::Convex))
    }

    /// Returns `true` if the body is convex.
    pub fn is_convex(&self) -> bool {
        matches!(self.0, Form::Convex(_))
    }

    /// Returns the point of the surface that is closest to a point.
    pub fn closest(&self, point_m: &Vector3<f64>) -> Closest {
        match &self.0 {
            Form::Convex(convex) => convex.closest(point_m),
            Form::Any(features) => features.see(point_m, 0.0, |_| ()).place,
        }
    }

    /// Sets the places where a sphere around a point may touch, which are closer than a distance. From inside there is one.
    pub fn touches(&self, point_m: &Vector3<f64>, within_m: f64, places: &mut Vec<Critical>) {
        places.clear();
        match &self.0 {
            Form::Convex(convex) => {
                let place = convex.closest(point_m);
                if place.distance_m < within_m {
                    places.push(Critical { feature: 0, place, index: 1 });
                }
            }
            Form::Any(features) => {
                let closest = features.see(point_m, within_m, |critical| places.push(critical));
                if closest.place.distance_m <= 0.0 {
                    places.clear();
                    places.push(closest);
                }
            }
        }
    }

    /// Returns how far along a line (0 to 1) the point is that is closest to the surface, and the closest point of that. Of a body
    /// that is not convex it may miss a part that is narrower than an eighth of the line.
    pub fn closest_to_line(&self, ends_m: &[Vector3<f64>; 2]) -> (f64, Closest) {
        let line = Line { surface: self, from_m: ends_m[0], along_m: ends_m[1] - ends_m[0] };
        if !(norm(&line.along_m) > 0.0) {
            return (0.0, line.look(0.0));
        }
        if self.is_convex() {
            return line.closest(0.0, 1.0);
        }
        let part = 1.0 / f64::from(LOOKS);
        let looks = (0..=LOOKS).map(|k| (f64::from(k) * part, line.look(f64::from(k) * part)));
        let first = (0.0, line.look(0.0));
        let nearest = looks.fold(first, |a, b| if b.1.distance_m < a.1.distance_m { b } else { a });
        let share = nearest.0;
        let around = if line.slope(&nearest.1) > 0.0 { (share - part, share) } else { (share, share + part) };
        let found = line.closest(around.0.max(0.0), around.1.min(1.0));
        if found.1.distance_m < nearest.1.distance_m { found } else { nearest }
    }
}

struct Line<'a> {
    surface: &'a Touchable,
    from_m: Vector3<f64>,
    along_m: Vector3<f64>,
}

impl Line<'_> {
    fn look(&self, share: f64) -> Closest {
        self.surface.closest(&(self.from_m + self.along_m * share))
    }

    /// Slope of the distance there.
    fn slope(&self, closest: &Closest) -> f64 {
        closest.normal.dot(&self.along_m)
    }

    /// The point of a part of it that is closest, as long as the distance falls and then rises: regula falsi for its slope, in which
    /// each end that stays is halved (Illinois), and halves in between, since the slope may jump.
    fn closest(&self, mut low: f64, mut high: f64) -> (f64, Closest) {
        let (mut at_low, mut at_high) = (self.look(low), self.look(high));
        let (mut f_low, mut f_high, mut side) = (self.slope(&at_low), self.slope(&at_high), 0);
        if f_low >= 0.0 {
            return (low, at_low);
        }
        if f_high <= 0.0 {
            return (high, at_high);
        }
        for step in 0..STEPS {
            if high - low < TOLERANCE {
                break;
            }
            let secant = (low * f_high - high * f_low) / (f_high - f_low);
            let share = if step % 3 == 2 { 0.5 * (low + high) } else { secant };
            let closest = self.look(share);
            let f = self.slope(&closest);
            if f == 0.0 {
                return (share, closest);
            }
            if f < 0.0 {
                (low, f_low, at_low) = (share, f, closest);
                f_high *= if side < 0 { 0.5 } else { 1.0 };
                side = -1;
            } else {
                (high, f_high, at_high) = (share, f, closest);
                f_low *= if side > 0 { 0.5 } else { 1.0 };
                side = 1;
            }
        }
        if at_low.distance_m <= at_high.distance_m { (low, at_low) } else { (high, at_high) }
    }
}

#[cfg(test)]
mod tests;
