//! `object check`: what an object is, whether it can be used, and what is likely a mistake.

#[cfg(test)]
mod tests;
mod text;

use super::finding::{Counts, Finding, Findings, Severity, Verdict};
use crate::file::{SCHEMA, ShapeFile};
use crate::mesh::{self, Unit};
use crate::{ObjectBody, ObjectFile, Place, SceneError};
use blindgrasp_body::polyhedron::{Polyhedron, bounds_m, diagonal_m};
use blindgrasp_mesh::{Boxes, crossings};
use blindgrasp_shared::math::{Real, norm};
use nalgebra::{SymmetricEigen, Vector3};
use serde::Serialize;
use std::ffi::OsStr;

/// Larger and smaller bodies are likely given in another unit, m.
const USUAL_M: [f64; 2] = [2e-3, 2.0];
/// Edges and walls below this share of the diagonal are worth knowing.
const THIN: f64 = 5e-3;
/// A body with more faces than this is round, or a scan.
const MANY_FACES: usize = 200;
/// The share of its radius that a fingertip may be indented by, for the room that it needs on a face.
const INDENTED: f64 = 0.1;

/// The findings of a check of an object. `--json` prints it.
#[derive(Clone, Debug, Serialize)]
pub struct ObjectCheck {
    /// Its name.
    pub name: String,
    /// A sentence or two.
    pub description: String,
    /// The verdict that follows from the findings.
    pub verdict: Verdict,
    /// The number of findings of each severity.
    pub counts: Counts,
    /// The facts of the body; `None` where it is not a body.
    pub body: Option<BodyFacts>,
    /// Its faces, in their order.
    pub faces: Vec<FaceFacts>,
    /// All that was found, the worst first.
    pub findings: Findings,
    /// For a picture.
    #[serde(skip)]
    pub shape: Option<Polyhedron>,
}

/// Numbers about a body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BodyFacts {
    /// `true` if it has no dent.
    pub convex: bool,
    /// Vertices of its surface.
    pub vertices: usize,
    /// Triangles of its surface.
    pub triangles: usize,
    /// Volume, m^3.
    pub volume_m3: f64,
    /// Surface, m^2.
    pub surface_m2: f64,
    /// Mass, kg; `None` where the file does not say, as a mesh file does not.
    pub mass_kg: Option<f64>,
    /// Centre of mass in the coordinates of the mesh, m; `None` where the shape has no other origin.
    pub centre_m: Option<[f64; 3]>,
    /// Extents along x, y and z, m.
    pub extents_m: [f64; 3],
    /// Principal moments of inertia for each kilogram, smallest first, m^2.
    pub principal_moments_per_kg_m2: [f64; 3],
    /// Their axes in the object frame, one each.
    pub principal_axes: [[f64; 3]; 3],
    /// Length of the shortest edge of a face, m.
    pub shortest_edge_m: f64,
    /// Thickness of the thinnest wall, m: from the middle of each triangle straight inwards to the surface opposite.
    pub thinnest_wall_m: f64,
    /// The place of the thinnest wall, object frame, m.
    pub thinnest_wall_at_m: [f64; 3],
}

/// A face.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaceFacts {
    /// Its number, from 0: the `face` of a contact in a scene.
    pub number: usize,
    /// Outward unit normal in the object frame.
    pub normal: [f64; 3],
    /// Distance of its plane from the centre of mass, m (`Y_i`); negative where the outside is on the centre's side.
    pub distance_m: f64,
    /// Area, m^2.
    pub area_m2: f64,
    /// Radius of the widest circle on it, m.
    pub widest_circle_m: f64,
    /// Centre of that circle, object frame, m.
    pub circle_centre_m: [f64; 3],
    /// Corners of its outline.
    pub corners: usize,
    /// Holes.
    pub holes: usize,
    /// `true` if it has no hole and no notch.
    pub convex: bool,
}

/// The checks that are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wanted {
    /// The unit of a mesh file.
    pub unit: Option<Unit>,
    /// Radius of the fingertip that is to touch the object, m.
    pub fingertip_m: Option<f64>,
}

impl ObjectCheck {
    /// Loads an object by its built-in name or its path, or a mesh file, and looks at everything.
    ///
    /// # Errors
    /// What keeps the file from being read at all: it is not there, no TOML, a key is unknown, missing or of another type, or
    /// a mesh file's unit is not given. That its triangles enclose no body is a finding.
    pub fn load(name_or_path: impl AsRef<OsStr>, wanted: &Wanted) -> Result<Self, SceneError> {
        let name_or_path = name_or_path.as_ref();
        let is_mesh = mesh::is_mesh(name_or_path);
        let whole = Place::of_path(name_or_path);
        let loaded = if is_mesh {
            mesh::load(name_or_path, wanted.unit).map(|(shape, notices)| Self {
                name: stem(name_or_path),
                ..Self::of(&bare(shape), notices, &whole, wanted)
            })
        } else {
            ObjectFile::load_with_places(name_or_path).map(|(file, mut places)| {
                let mut check = Self::of(&file, std::mem::take(&mut places.notices), &whole, wanted);
                check.findings.locate(|key| places.of(key));
                check
            })
        };
        loaded.or_else(|error| {
            // The file is there and its unit is known: what is wrong is in its triangles.
            let is_there = is_mesh && wanted.unit.is_some() && std::path::Path::new(name_or_path).is_file();
            if is_there || error.key == "shape.mesh.file" {
                Ok(Self::without_body(stem(name_or_path), String::new(), vec![error.into()]))
            } else {
                Err(error)
            }
        })
    }

    fn without_body(name: String, description: String, findings: Vec<Finding>) -> Self {
        let mut all = Findings::default();
        all.extend(findings);
        all.sort();
        let (verdict, counts) = (all.verdict(), all.counts());
        Self { name, description, verdict, counts, body: None, faces: Vec::new(), findings: all, shape: None }
    }

    /// Looks at an object; its file is called `place` in findings, before which come those that are known.
    pub fn of(file: &ObjectFile, mut known: Vec<Finding>, place: &Place, wanted: &Wanted) -> Self {
        let mut warnings = Vec::new();
        let (body, refused) = file.examine(&mut warnings);
        known.extend(refused.into_iter().map(|error| error.at(place).into()));
        let Some(body) = body else {
            return Self::without_body(file.name.clone(), file.description.clone(), known);
        };
        let mut findings = Findings::default();
        findings.extend(known);
        let about =
            |severity, what: String, remedy: &str| Finding::new(severity, what, remedy).at(place.clone());
        findings.extend(
            warnings.into_iter().map(|warning| about(Severity::Warning, warning, "check mass and inertia")),
        );
        let corners: Vec<[usize; 3]> =
            body.shape.faces.iter().flat_map(|face| face.triangles.iter().copied()).collect();
        let boxes = Boxes::around(corners.iter().map(|t| t.map(|k| body.shape.vertices_m[k])).collect());
        let faces = face_facts(&body.shape);
        let facts = body_facts(file, &body, &corners, &boxes);
        size(&facts, &body.shape, &about, &mut findings);
        crossing(&boxes, &corners, &about, &mut findings);
        room(&faces, wanted, &about, &mut findings);
        findings.sort();
        Self {
            name: file.name.clone(),
            description: file.description.clone(),
            verdict: findings.verdict(),
            counts: findings.counts(),
            body: Some(facts),
            faces,
            findings,
            shape: Some(body.shape),
        }
    }

    /// All of it for people to read.
    pub fn text(&self) -> String {
        text::describe(self)
    }
}

/// A mesh file as an object. Its mass is not known: any will do.
fn bare(shape: ShapeFile) -> ObjectFile {
    ObjectFile {
        schema: SCHEMA,
        name: "mesh".to_owned(),
        description: String::new(),
        mass_kg: None,
        density_kg_m3: None,
        inertia_kg_m2: None,
        friction: None,
        shape,
    }
}

fn stem(path: &OsStr) -> String {
    std::path::Path::new(path).file_stem().unwrap_or(path).to_string_lossy().into_owned()
}

fn face_facts(shape: &Polyhedron) -> Vec<FaceFacts> {
    let facts = |(number, face): (usize, &blindgrasp_body::polyhedron::Face)| {
        let (centre, radius) = shape.widest_circle_m(number);
        FaceFacts {
            number,
            normal: face.normal.into(),
            distance_m: face.distance_m,
            area_m2: shape.face_area_m2(number),
            widest_circle_m: radius,
            circle_centre_m: centre.into(),
            corners: face.corners.len(),
            holes: face.holes.len(),
            convex: face.is_convex(),
        }
    };
    shape.faces.iter().enumerate().map(facts).collect()
}

fn body_facts(file: &ObjectFile, body: &ObjectBody, corners: &[[usize; 3]], boxes: &Boxes) -> BodyFacts {
    let shape = &body.shape;
    let uniform = shape.mass_properties();
    let eigen = SymmetricEigen::new(body.inertia_kg_m2 / body.mass_kg);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let (low, high) = bounds_m(&shape.vertices_m);
    let edges = shape.faces.iter().flat_map(|face| face.edges());
    let shortest =
        edges.map(|(a, b)| norm(&(shape.vertices_m[a] - shape.vertices_m[b]))).fold(f64::INFINITY, f64::min);
    let (thinnest_wall_m, thinnest_wall_at_m) = boxes.thinnest_wall_m();
    let above =
        |face: &blindgrasp_body::polyhedron::Face, k: &Vector3<f64>| face.normal.dot(k) - face.distance_m;
    let level = 1e-6 * diagonal_m(&shape.vertices_m);
    let convex = shape.faces.len() <= MANY_FACES
        && shape.faces.iter().all(|face| shape.vertices_m.iter().all(|k| above(face, k) <= level));
    let centre_m = match &file.shape {
        // Vertices keep their order.
        ShapeFile::Mesh { vertices_m, triangles, .. } => triangles.first().map(|corners| {
            let first = Vector3::from(vertices_m[corners[0]]);
            (first - shape.vertices_m[first_vertex(shape)]).into()
        }),
        _ => None,
    };
    BodyFacts {
        convex,
        vertices: shape.vertices_m.len(),
        triangles: corners.len(),
        volume_m3: uniform.volume_m3,
        surface_m2: (0..shape.faces.len()).map(|k| shape.face_area_m2(k)).sum(),
        mass_kg: (file.mass_kg.is_some() || file.density_kg_m3.is_some()).then_some(body.mass_kg),
        centre_m,
        extents_m: (high - low).into(),
        principal_moments_per_kg_m2: order.map(|k| eigen.eigenvalues[k]),
        principal_axes: order.map(|k| eigen.eigenvectors.column(k).into_owned().into()),
        shortest_edge_m: shortest,
        thinnest_wall_m,
        thinnest_wall_at_m: thinnest_wall_at_m.into(),
    }
}

/// The first corner of the first triangle: faces are in the order of their first triangles.
fn first_vertex(shape: &Polyhedron) -> usize {
    shape.faces.first().and_then(|face| face.triangles.first()).map_or(0, |corners| corners[0])
}

type About<'a> = dyn Fn(Severity, String, &str) -> Finding + 'a;

/// Finds sizes and details that are not those of a thing that a hand grasps.
fn size(facts: &BodyFacts, shape: &Polyhedron, about: &About<'_>, findings: &mut Findings) {
    let diagonal = diagonal_m(&shape.vertices_m);
    if !(USUAL_M[0]..=USUAL_M[1]).contains(&diagonal) {
        let [x, y, z] = facts.extents_m.map(|m| text::figures(m * 1e3));
        findings.push(about(
            Severity::Warning,
            format!("it measures {x} x {y} x {z} mm"),
            "check the unit: a hand grasps things of some centimetres",
        ));
    }
    for (length, what, place) in [
        (facts.shortest_edge_m, "its shortest edge measures", String::new()),
        (facts.thinnest_wall_m, "its thinnest wall measures", at(&facts.thinnest_wall_at_m)),
    ] {
        if length < THIN * diagonal {
            findings.push(about(
                Severity::Notice,
                format!("{what} {} mm{place}", text::figures(length * 1e3)),
                "leave such details out if they mean nothing to the grasp",
            ));
        }
    }
    if shape.faces.len() > MANY_FACES {
        findings.push(about(
            Severity::Notice,
            format!("it has {} faces: what is round is made of small flat ones", shape.faces.len()),
            "choose the wide ones for contacts; for a scan, raise shape.mesh.flat_deg and flat_m",
        ));
    }
}

fn at(place_m: &[f64; 3]) -> String {
    let [x, y, z] = place_m.map(|m| text::figures(m * 1e3));
    format!(" at ({x}, {y}, {z}) mm")
}

fn crossing(boxes: &Boxes, corners: &[[usize; 3]], about: &About<'_>, findings: &mut Findings) {
    let found = crossings(boxes, corners);
    if let Some([a, _]) = found.first {
        let place: [f64; 3] = boxes.triangles[a][0].into();
        findings.push(about(
            Severity::Warning,
            format!(
                "its surface cuts through itself in {} pairs of triangles, first{}",
                found.count,
                at(&place)
            ),
            "mend it where it is drawn: what is enclosed twice counts twice in mass and inertia",
        ));
    }
    if !found.is_complete {
        findings.push(about(
            Severity::Warning,
            "many triangles lie in one place: whether its surface cuts through itself was not looked at to the end".into(),
            "export it with coarser tolerances",
        ));
    }
}

/// Finds faces on which a fingertip has no room.
fn room(faces: &[FaceFacts], wanted: &Wanted, about: &About<'_>, findings: &mut Findings) {
    let Some(radius) = wanted.fingertip_m else { return };
    // The contact of a sphere that is indented by a share of its radius: r sqrt(2 s - s^2).
    let patch = radius * (2.0 * INDENTED - INDENTED * INDENTED).square_root();
    let narrow: Vec<String> = faces
        .iter()
        .filter(|face| !(face.widest_circle_m > patch))
        .map(|face| face.number.to_string())
        .collect();
    if narrow.is_empty() {
        return;
    }
    let severity = if narrow.len() == faces.len() { Severity::Error } else { Severity::Notice };
    let which = match narrow.len() {
        count if count > 20 => format!("{count} of {} faces", faces.len()),
        _ => format!("faces {}", narrow.join(", ")),
    };
    findings.push(about(
        severity,
        format!(
            "{which}: too small for a fingertip of radius {} mm, whose contact has a radius of {} mm",
            text::figures(radius * 1e3),
            text::figures(patch * 1e3)
        ),
        "choose other faces, or smaller fingertips",
    ));
}
