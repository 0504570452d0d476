//! A polyhedron, prepared to be asked often where spheres and lines touch it.

use super::Polyhedron;
use super::convex::{Closest, Convex};
use super::critical::{Critical, Features};
use blindgrasp_shared::math::norm;
use nalgebra::Vector3;

/// Places of a line that there is room for at once.
const MOST_PLACES: usize = 16;

/// A polyhedron's surface. A convex body has a quicker way.
#[derive(Clone, Debug)]
pub struct Touchable {
    features: Features,
    convex: Option<Convex>,
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

    /// Returns how far along a line (0 to 1) the point is that is closest to the surface, and the closest point of that. Where the
    /// line pierces the surface, it is the middle of a part that is inside.
    pub fn closest_to_line(&self, ends_m: &[Vector3<f64>; 2]) -> (f64, Closest) {
        let mut nearest = (0.0, self.closest(&ends_m[0]));
        self.places_of(ends_m, |share, closest| {
            if closest.distance_m < nearest.1.distance_m {
                nearest = (share, closest);
            }
        });
        nearest
    }

    /// The two places at which a rod lies on the body, or would if it came nearer, by shares of its line: of its own ends and of where
    /// it passes the body's edges and vertices, the closest one and the next. With each the distance, m, from which on it touches. As
    /// two of them become one, the second's shrinks until it does not touch any more.
    pub fn supports(&self, ends_m: &[Vector3<f64>; 2], radius_m: f64) -> [(f64, f64); 2] {
        let mut places = Vec::with_capacity(MOST_PLACES);
        self.places_of(ends_m, |share, closest| places.push((share, closest.distance_m)));
        let (first, _) = places.iter().fold((0.0, f64::INFINITY), |a, b| if b.1 < a.1 { *b } else { a });
        let length_m = norm(&(ends_m[1] - ends_m[0]));
        let (mut second, mut deepest_m) = ((first, f64::NEG_INFINITY), f64::NEG_INFINITY);
        for (share, distance_m) in places {
            let near = 1.0 - ((share - first).abs() * length_m / radius_m).min(1.0);
            let within_m = radius_m * (1.0 - near * near);
            if within_m - distance_m > deepest_m {
                deepest_m = within_m - distance_m;
                second = (share, within_m);
            }
        }
        [(first, radius_m), second]
    }

    /// Gives the places of a line that may be closest to the surface: both ends, those at which it passes edges or vertices, and the
    /// middle of what pierces the body.
    fn places_of(&self, ends_m: &[Vector3<f64>; 2], mut see: impl FnMut(f64, Closest)) {
        let mut see = |share: f64| see(share, self.closest(&(ends_m[0] + (ends_m[1] - ends_m[0]) * share)));
        see(0.0);
        see(1.0);
        self.features.passes(ends_m, &mut see);
        let inside = self.convex.as_ref().map_or_else(|| self.features.inside(ends_m), |c| c.inside(ends_m));
        if let Some([from, to]) = inside {
            see(0.5 * (from + to));
        }
    }
}

#[cfg(test)]
mod tests;
