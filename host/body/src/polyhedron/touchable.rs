//! A polyhedron, prepared to be asked often where spheres and lines touch it.

use super::Polyhedron;
use super::convex::{Closest, Convex};
use super::critical::{Critical, Features};
use nalgebra::Vector3;

/// A polyhedron's surface. A convex body has a quicker way.
#[derive(Clone, Debug)]
pub struct Touchable {
    features: Features,
    convex: Option<Convex>,
}

/// A place of a line that lies on a body, or would if it came nearer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Support {
    /// Its share of the line, from 0 to 1.
    pub share: f64,
    /// The point of the surface that is closest to it.
    pub closest: Closest,
}

impl Touchable {
    /// Of a polyhedron.
    pub fn of(shape: &Polyhedron) -> Self {
        Self { features: Features::of(shape), convex: Convex::of(shape) }
    }

    /// Returns `true` if the body is convex.
    pub fn is_convex(&self) -> bool {
        self.convex.is_some()
    }

    /// Returns the point of the surface that is closest to a point.
    pub fn closest(&self, point_m: &Vector3<f64>) -> Closest {
        match &self.convex {
            Some(convex) => convex.closest(point_m),
            None => self.features.see(point_m, 0.0, |_| ()).place,
        }
    }

    /// Sets the places where a sphere around a point may touch, which are closer than a distance. From inside there is one.
    pub fn touches(&self, point_m: &Vector3<f64>, within_m: f64, places: &mut Vec<Critical>) {
        places.clear();
        if let Some(convex) = &self.convex {
            let place = convex.closest(point_m);
            if place.distance_m < within_m {
                places.push(Critical { feature: 0, place, index: 1 });
            }
            return;
        }
        let closest = self.features.see(point_m, within_m, |critical| places.push(critical));
        if closest.place.distance_m <= 0.0 {
            places.clear();
            places.push(closest);
        }
    }

    /// The two places at which a line would lie on the body: the closest of all, then the next of those that may be: its own ends, and
    /// where it passes the body's edges and vertices. Where it pierces the surface, the middle of what is inside is the first.
    pub fn supports(&self, ends_m: &[Vector3<f64>; 2]) -> [Support; 2] {
        let along_m = ends_m[1] - ends_m[0];
        let at = |share: f64| Support { share, closest: self.closest(&(ends_m[0] + along_m * share)) };
        let [mut first, mut second] = [at(0.0), at(1.0)];
        if second.closest.distance_m < first.closest.distance_m {
            (first, second) = (second, first);
        }
        let mut consider = |support: Support| {
            if support.closest.distance_m < first.closest.distance_m {
                (second, first) = (first, support);
            } else if support.closest.distance_m < second.closest.distance_m {
                second = support;
            }
        };
        self.features.in_front_of(ends_m, |share| consider(at(share)));
        let inside = self.convex.as_ref().map_or_else(|| self.features.inside(ends_m), |c| c.inside(ends_m));
        if let Some([from, to]) = inside {
            consider(at(0.5 * (from + to)));
        }
        [first, second]
    }
}

#[cfg(test)]
mod tests;
