//! A request, prepared: everything that stays the same while faces, points and postures are searched.

use super::combination::most_faces;
use super::facet::Facet;
use super::points::Fingertips;
use super::rolling::{Gains, Rolling};
use super::{NARROWEST, Request, SPARE, attitude, stance};
use blindgrasp_body::polyhedron::Touchable;
use blindgrasp_body::{MAX_FINGERS, Part};
use blindgrasp_model::{SceneError, posture};
use blindgrasp_shared::math::Real;
use nalgebra::{UnitQuaternion, Vector2, Vector3};

/// A point of the user's may lie this far off its face, m: it is moved onto the face.
const OFF_FACE_M: f64 = 1e-6;

/// The user's choice for a fingertip.
pub(super) struct Fixed {
    pub(super) facet: Facet,
    /// The coordinates of the point, m.
    pub(super) point: Option<Vector2<f64>>,
}

/// A request, prepared.
pub(super) struct Task<'a> {
    pub(super) request: &'a Request<'a>,
    /// The number of fingertips.
    pub(super) count: usize,
    /// Faces that fingertips may choose, the widest first.
    pub(super) facets: Vec<Facet>,
    /// The number of faces that are too narrow to be chosen, and the half-width of the widest of all, m.
    pub(super) narrow: (usize, f64),
    /// The user's choices, by fingertip.
    pub(super) fixed: Vec<Option<Fixed>>,
    pub(super) gains: Gains,
    /// `rho_i` as it will be about, m.
    pub(super) rolling_radii_m: Vec<f64>,
    /// Distances that two centres have to keep, m.
    pub(super) apart_m: [[f64; MAX_FINGERS]; MAX_FINGERS],
    /// Mean of the fingertip centres of the nominal posture, m.
    pub(super) nominal_middle_m: Vector3<f64>,
    /// The same centres, from their mean, m.
    pub(super) nominal_m: Vec<Vector3<f64>>,
    /// Attitudes to choose from.
    pub(super) attitudes: Vec<UnitQuaternion<f64>>,
    /// The pairs of parts that may not be inside each other, besides two fingertips.
    pub(super) pairs: Vec<[Part; 2]>,
    /// The object's surface.
    pub(super) object: Touchable,
    /// Largest distance of a point of the object from its centre of mass, m.
    pub(super) object_radius_m: f64,
}

impl<'a> Task<'a> {
    /// Prepares a request.
    ///
    /// # Errors
    /// What the user has chosen that can't be.
    pub(super) fn new(request: &'a Request<'a>) -> Result<Self, SceneError> {
        let (hand, shape) = (&request.parts.hand, &request.parts.object.shape);
        let count = hand.fingertip_count();
        let fixed = (0..count).map(|i| fixed(request, i)).collect::<Result<Vec<_>, _>>()?;
        let free = fixed.iter().filter(|fixed| fixed.is_none()).count();
        let radii: Vec<f64> = (0..count).map(|i| hand.radius_m(i)).collect();
        let mean_radius = radii.iter().sum::<f64>() / count as f64;

        let mut facets: Vec<Facet> = (0..shape.faces.len()).map(|k| Facet::of(shape, k)).collect();
        let widest = facets.iter().map(|facet| facet.margin_m).fold(0.0, f64::max);
        facets.retain(|facet| facet.margin_m >= NARROWEST * mean_radius);
        let narrow = (shape.faces.len() - facets.len(), widest);
        facets.sort_by(|a, b| b.margin_m.total_cmp(&a.margin_m).then(a.face.cmp(&b.face)));
        facets.truncate(most_faces(free));
        // In the order of the faces, so that choices that are as good come in that order.
        facets.sort_by_key(|facet| facet.face);

        let control = &request.like.control;
        let gains = Gains {
            approach_n_m: control.force_n() / radii.iter().sum::<f64>(),
            attitude_nm: control.attitude_stiffness_nm(),
        };
        // Eq. 57 for a fingertip that stands as far from the centroid as the object's faces do from its centre of mass.
        let distance =
            shape.faces.iter().map(|face| face.distance_m.abs()).sum::<f64>() / shape.faces.len() as f64;
        let fingertips = &request.like.hand.fingertips;
        let rolling_radii_m = (0..count)
            .map(|i| {
                let force = gains.approach_n_m * (distance + radii[i]);
                radii[i] - (force / fingertips[i].stiffness_n_m2).square_root().min(0.5 * radii[i])
            })
            .collect();
        let mut apart_m = [[0.0; MAX_FINGERS]; MAX_FINGERS];
        for i in 0..count {
            for j in (0..count).filter(|&j| j != i) {
                apart_m[i][j] = (radii[i] + radii[j]) * (1.0 + SPARE);
            }
        }
        let nominal = posture(hand, &request.reach.nominal_rad);
        let centres = &nominal.centres_m[..count];
        let middle = centres.iter().sum::<Vector3<f64>>() / count as f64;
        let attitudes =
            if request.any_attitude { attitude::spread() } else { vec![request.like.pose.attitude()?] };
        Ok(Self {
            request,
            count,
            facets,
            narrow,
            fixed,
            gains,
            rolling_radii_m,
            apart_m,
            nominal_middle_m: middle,
            nominal_m: centres.iter().map(|centre| centre - middle).collect(),
            attitudes,
            pairs: stance::pairs(hand, &request.parts.capsules),
            object: Touchable::of(shape),
            object_radius_m: shape.radius_m(),
        })
    }

    /// Returns the number of fingertips that may choose.
    pub(super) fn free(&self) -> usize {
        self.fixed.iter().filter(|fixed| fixed.is_none()).count()
    }

    /// The face of each fingertip, where those that may choose take the faces of `choice` in this order.
    pub(super) fn assigned(&self, choice: &[u8]) -> Vec<&Facet> {
        let mut chosen = choice.iter();
        self.fixed
            .iter()
            .map(|fixed| match fixed {
                Some(fixed) => &fixed.facet,
                None => &self.facets[chosen.next().map_or(0, |&k| usize::from(k))],
            })
            .collect()
    }

    /// Returns the points that the user has chosen, by fingertip.
    pub(super) fn fixed_points(&self) -> Vec<Option<Vector2<f64>>> {
        self.fixed.iter().map(|fixed| fixed.as_ref().and_then(|fixed| fixed.point)).collect()
    }

    /// The law on these faces.
    pub(super) fn rolling(&self, facets: &[&Facet]) -> Rolling {
        Rolling::new(facets, &self.rolling_radii_m, self.gains)
    }

    /// Returns the fingertips' data for the choice of points.
    pub(super) fn fingertips<'b>(&'b self, fixed: &'b [Option<Vector2<f64>>]) -> Fingertips<'b> {
        Fingertips { rolling_radii_m: &self.rolling_radii_m, apart_m: &self.apart_m, fixed }
    }
}

/// Returns the user's choice for a fingertip, checked.
fn fixed(request: &Request<'_>, fingertip: usize) -> Result<Option<Fixed>, SceneError> {
    let shape = &request.parts.object.shape;
    let Some(wish) = request.like.contacts.get(fingertip) else { return Ok(None) };
    let key = |name: &str| format!("contact.{}.{name}", fingertip + 1);
    let point = wish.point_m.map(Vector3::from);
    let face = match (wish.face, &point) {
        (None, None) => return Ok(None),
        (Some(face), _) if face < shape.faces.len() => face,
        (Some(face), _) => {
            let problem = format!("the object has no face {face}");
            let remedy = format!("has to be between 0 and {}", shape.faces.len() - 1);
            return Err(SceneError::new(key("face"), problem, remedy));
        }
        (None, Some(point)) => match shape.nearest_face(point, OFF_FACE_M) {
            Some((face, distance)) if distance <= OFF_FACE_M => face,
            _ => {
                let remedy = "give a point of a face in the object frame, whose origin is the centre of mass";
                return Err(SceneError::new(key("point_m"), "is not on the surface", remedy));
            }
        },
    };
    let facet = Facet::of(shape, face);
    if let Some(point) = &point {
        let plane = &shape.faces[face];
        let height = plane.normal.dot(point) - plane.distance_m;
        if !(height.abs() <= OFF_FACE_M) {
            let problem = format!("is {:.3} mm off face {face}", height.abs() * 1e3);
            let remedy = "give a point of the face in the object frame, whose origin is the centre of mass";
            return Err(SceneError::new(key("point_m"), problem, remedy));
        }
        let margin = shape.margin_m(face, point);
        if !(margin > 0.0) {
            let problem = format!("is {:.3} mm beyond the edge of face {face}", -margin * 1e3);
            return Err(SceneError::new(key("point_m"), problem, "move it inside"));
        }
    }
    let point = point.map(|point| facet.coordinates(&point));
    Ok(Some(Fixed { facet, point }))
}
