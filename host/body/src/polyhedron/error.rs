//! Errors in the description of a polyhedron.

use super::{MAX_POINTS, MAX_TRIANGLES};
use nalgebra::Vector3;

/// An error in the description of a polyhedron.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PolyhedronError {
    /// A length that is not positive and finite.
    #[error("{what} has to be positive and finite, not {value:?}")]
    Length {
        /// The length.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A coordinate that is NaN or infinite.
    #[error("point {point} is not finite")]
    NotFinite {
        /// Index of the point.
        point: usize,
    },
    /// Too few points.
    #[error("{count} points make no {shape}: at least {least} are needed")]
    TooFewPoints {
        /// Their number.
        count: usize,
        /// The number that it takes.
        least: usize,
        /// The shape that they should make.
        shape: &'static str,
    },
    /// Too many points.
    #[error("{count} points are too many: at most {MAX_POINTS}")]
    TooManyPoints {
        /// Their number.
        count: usize,
    },
    /// Two points in the same place.
    #[error("points {first} and {second} are the same")]
    Duplicate {
        /// Index of the one.
        first: usize,
        /// Index of the other.
        second: usize,
    },
    /// All points in one plane, or nearly so.
    #[error("all points lie in one plane: no volume")]
    NoVolume,
    /// The polygon turns inwards or clockwise somewhere, or has a straight corner.
    #[error("the polygon is not convex and counter-clockwise at corner {corner}")]
    NotConvex {
        /// Index of the corner.
        corner: usize,
    },
    /// Rounding decides which points are corners.
    #[error("some points lie so close to a plane or a line through others that the faces are not clear")]
    Unclear,
    /// A mesh that is not a body.
    #[error(transparent)]
    Mesh(#[from] MeshFault),
}

impl PolyhedronError {
    /// Returns the remedy.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Mesh(fault) => fault.remedy(),
            _ => "describe a convex body in metres",
        }
    }
}

/// A fault of a mesh. Triangles and vertices are counted from 0 here and from 1 in words.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshFault {
    /// No triangles.
    #[error("it has no triangles")]
    Empty,
    /// Too many triangles.
    #[error("{count} triangles are too many: at most {MAX_TRIANGLES}")]
    TooMany {
        /// Their number.
        count: usize,
    },
    /// A coordinate that is NaN, or larger than a thousand kilometres.
    #[error("vertex {} is out of range", .vertex + 1)]
    OutOfRange {
        /// The vertex.
        vertex: usize,
    },
    /// A triangle names a vertex that there is not, or one twice.
    #[error("triangle {} needs three different vertices of the {vertices} that there are", .triangle + 1)]
    Corners {
        /// The triangle.
        triangle: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// An edge of one triangle only.
    #[error(
        "it is not closed: {}, the first at triangle {} from {} to {} mm",
        counted(*.count, "open edge"), .triangle + 1, mm(&.ends_m[0]), mm(&.ends_m[1])
    )]
    Open {
        /// Their number.
        count: usize,
        /// The triangle of the first.
        triangle: usize,
        /// Its ends, m.
        ends_m: [Vector3<f64>; 2],
    },
    /// An edge of more than two triangles.
    #[error(
        "{} to more than two triangles, the first to triangles {}, {} and {}, from {} to {} mm",
        belong(*.count), .triangles[0] + 1, .triangles[1] + 1, .triangles[2] + 1, mm(&.ends_m[0]), mm(&.ends_m[1])
    )]
    Crowded {
        /// Their number.
        count: usize,
        /// Three triangles of the first.
        triangles: [usize; 3],
        /// Its ends, m.
        ends_m: [Vector3<f64>; 2],
    },
    /// More than one body.
    #[error("it is in {count} parts: triangle 1 belongs to one, triangle {} at {} mm to another", .triangle + 1, mm(.at_m))]
    Parts {
        /// Their number.
        count: usize,
        /// The first triangle of the second.
        triangle: usize,
        /// A corner of it, m.
        at_m: Vector3<f64>,
    },
    /// Two neighbours, one of which shows its inside where the other shows its outside.
    #[error("triangles {} and {} are turned against each other", .triangles[0] + 1, .triangles[1] + 1)]
    Turned {
        /// The two.
        triangles: [usize; 2],
    },
    /// A surface like that of a Klein bottle.
    #[error("its surface has only one side: going around it, triangle {} comes back turned over", .triangle + 1)]
    OneSided {
        /// A triangle that shows it.
        triangle: usize,
    },
    /// The inside is outside.
    #[error("it is inside out: its triangles are clockwise seen from outside")]
    InsideOut,
    /// No volume, or next to none.
    #[error("it encloses no volume")]
    NoVolume,
}

impl MeshFault {
    /// Returns the remedy.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Empty => "export the body as a mesh of triangles",
            Self::TooMany { .. } => {
                "export it with coarser tolerances: a grasp needs its faces, not its finish"
            }
            Self::OutOfRange { .. } | Self::Corners { .. } => "export it again",
            Self::Open { .. } => "close the surface in the program that it comes from, and export a solid",
            Self::Crowded { .. } => {
                "export one solid, without inner walls and without bodies that touch along an edge"
            }
            Self::Parts { .. } => "export one solid without hollows, or unite the parts",
            Self::Turned { .. } | Self::InsideOut => "give corners counter-clockwise seen from outside",
            Self::OneSided { .. } => "export a solid",
            Self::NoVolume => "give a body, not a sheet",
        }
    }

    /// The same, with triangles numbered as a list says: where they were before some were left out.
    #[must_use]
    pub fn renumbered(mut self, numbers: &[u32]) -> Self {
        let renumber = |triangle: &mut usize| {
            *triangle = numbers.get(*triangle).map_or(*triangle, |&number| number as usize);
        };
        match &mut self {
            Self::Corners { triangle, .. }
            | Self::Open { triangle, .. }
            | Self::Parts { triangle, .. }
            | Self::OneSided { triangle } => renumber(triangle),
            Self::Crowded { triangles, .. } => triangles.iter_mut().for_each(renumber),
            Self::Turned { triangles } => triangles.iter_mut().for_each(renumber),
            Self::Empty
            | Self::TooMany { .. }
            | Self::OutOfRange { .. }
            | Self::InsideOut
            | Self::NoVolume => {}
        }
        self
    }
}

/// A number of things: `1 open edge`, `2 open edges`.
pub fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn belong(count: usize) -> String {
    format!("{} belong{}", counted(count, "edge"), if count == 1 { "s" } else { "" })
}

/// A point in millimetres, to the micrometre: `(1, 2.5, -0.001)`.
pub(crate) fn mm(point_m: &Vector3<f64>) -> String {
    let number = |m: f64| {
        let text = format!("{:.3}", m * 1e3);
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text == "-0" { "0".to_owned() } else { text.to_owned() }
    };
    format!("({}, {}, {})", number(point_m.x), number(point_m.y), number(point_m.z))
}
