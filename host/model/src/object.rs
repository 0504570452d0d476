//! The object of a scene: its shape, mass and inertia.

use super::{
    check::{Refused, Result, all_within, fail, name, schema, within},
    error::SceneError,
    file::{InertiaFile, ObjectFile, ShapeFile},
};
use blindgrasp_body::polyhedron::{Flatness, Polyhedron, PolyhedronError, diagonal_m};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// Largest distance of a face's parts from its plane on a mesh, in units of the body's diagonal, where the file does
/// not say.
const FLAT: f64 = 1e-3;

/// An object, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectBody {
    /// Its shape in its own frame.
    pub shape: Polyhedron,
    /// Its mass, kg.
    pub mass_kg: f64,
    /// Its inertia about its centre of mass in its own frame, kg m^2.
    pub inertia_kg_m2: Matrix3<f64>,
}

impl ObjectFile {
    /// Shape, mass and inertia, with what is odd about them. A shape alone, without mass and density, weighs what water does.
    ///
    /// # Errors
    /// What is wrong, with the key in the object's file.
    pub fn body(&self, warnings: &mut Vec<String>) -> Result<ObjectBody> {
        let (body, refused) = self.examine(warnings);
        refused.or(body)
    }

    /// The same, with all that is wrong.
    pub(crate) fn examine(&self, warnings: &mut Vec<String>) -> (Option<ObjectBody>, Refused) {
        let bare = self.mass_kg.is_none() && self.density_kg_m3.is_none();
        let density_kg_m3 = bare.then_some(1000.0).or(self.density_kg_m3);
        let mut refused = Refused::default();
        (examine(&Self { density_kg_m3, ..self.clone() }, warnings, &mut refused), refused)
    }
}

/// The polyhedron of a shape.
pub(super) fn polyhedron(shape: &ShapeFile) -> std::result::Result<Polyhedron, PolyhedronError> {
    match shape {
        ShapeFile::Box { size_m } => Polyhedron::cuboid(*size_m),
        ShapeFile::Prism { sides, side_m, height_m } => {
            Polyhedron::regular_prism(*sides as usize, *side_m, *height_m)
        }
        ShapeFile::PolygonPrism { corners_m, height_m } => Polyhedron::prism(corners_m, *height_m),
        ShapeFile::Hull { points_m } => {
            let points: Vec<Vector3<f64>> = points_m.iter().map(|&point| point.into()).collect();
            Polyhedron::hull(&points)
        }
        ShapeFile::Pyramid { sides, side_m, height_m } => {
            Polyhedron::regular_pyramid(*sides as usize, *side_m, *height_m)
        }
        ShapeFile::Mesh { vertices_m, triangles, flat_deg, flat_m } => {
            let vertices: Vec<Vector3<f64>> = vertices_m.iter().map(|&vertex| vertex.into()).collect();
            let distance_m = flat_m.unwrap_or_else(|| FLAT * diagonal_m(&vertices));
            let flatness = Flatness { angle_rad: flat_deg.to_radians(), distance_m };
            Polyhedron::mesh(&vertices, triangles, &flatness)
        }
    }
}

/// Checks an object and computes its mass and inertia.
pub(super) fn object(file: &ObjectFile, warnings: &mut Vec<String>) -> Result<ObjectBody> {
    let mut refused = Refused::default();
    let body = examine(file, warnings, &mut refused);
    refused.or(body)
}

fn examine(file: &ObjectFile, warnings: &mut Vec<String>, refused: &mut Refused) -> Option<ObjectBody> {
    refused.take_all([
        schema("schema", file.schema),
        name("name", &file.name),
        within("friction", file.friction.unwrap_or_default(), 0.0, 100.0),
    ]);
    if let ShapeFile::Mesh { flat_deg, flat_m, .. } = &file.shape {
        refused.take_all([
            within("shape.mesh.flat_deg", *flat_deg, 0.0, 45.0),
            within("shape.mesh.flat_m", flat_m.unwrap_or_default(), 0.0, 1.0),
        ]);
    }
    let shape = refused.take(shape(file));
    let uniform = shape.as_ref().map(Polyhedron::mass_properties);
    let mass_kg = refused.take(match (file.mass_kg, file.density_kg_m3) {
        (Some(_), Some(_)) => fail("density_kg_m3", "mass and density are both given", "leave one out"),
        (None, None) => fail("mass_kg", "neither mass nor density is given", "add `mass_kg = ...`"),
        (mass, density) => {
            density.map_or(Ok(()), |density| within("density_kg_m3", density, 1e-3, 1e5)).and_then(|()| {
                let mass_kg = mass.or_else(|| Some(density? * uniform.as_ref()?.volume_m3));
                mass_kg.map_or(Ok(None), |mass| within("mass_kg", mass, 1e-9, 1e4).map(|()| Some(mass)))
            })
        }
    });
    let inertia_kg_m2 = file.inertia_kg_m2.as_ref().map(|inertia| refused.take(inertia_of(inertia)));
    let (shape, uniform, mass_kg) = (shape?, uniform?, mass_kg??);
    let Some(inertia_kg_m2) = inertia_kg_m2 else {
        return Some(ObjectBody { shape, mass_kg, inertia_kg_m2: uniform.inertia_per_kg_m2 * mass_kg });
    };
    let inertia_kg_m2 = inertia_kg_m2?;
    let (radius, largest) = (shape.radius_m(), SymmetricEigen::new(inertia_kg_m2).eigenvalues.max());
    if breaks_triangle(&inertia_kg_m2) {
        warnings.push(format!(
            "object `{}`: its inertia is that of no body: one moment is larger than the sum of the two others",
            file.name
        ));
    }
    if largest > mass_kg * radius * radius {
        warnings.push(format!(
            "object `{}`: its inertia needs mass outside of it: {largest:.3e} kg m^2, but {mass_kg} kg within \
             {radius:.3} m make {:.3e} kg m^2 at most",
            file.name,
            mass_kg * radius * radius,
        ));
    }
    Some(ObjectBody { shape, mass_kg, inertia_kg_m2 })
}

/// The polyhedron, if it has the size of an object.
fn shape(file: &ObjectFile) -> Result<Polyhedron> {
    let shape = polyhedron(&file.shape).map_err(|error| {
        let key = match file.shape {
            ShapeFile::Box { .. } => "shape.box.size_m",
            ShapeFile::Prism { .. } => "shape.prism",
            ShapeFile::PolygonPrism { .. } => "shape.polygon_prism",
            ShapeFile::Hull { .. } => "shape.hull.points_m",
            ShapeFile::Pyramid { .. } => "shape.pyramid",
            ShapeFile::Mesh { .. } => "shape.mesh",
        };
        SceneError::new(key, error.to_string(), error.remedy())
    })?;
    let radius = shape.radius_m();
    if !(1e-4..=10.0).contains(&radius) {
        return fail(
            "shape",
            format!("reaches {radius:.3e} m from its centre of mass"),
            "has to be between 0.1 mm and 10 m: give lengths in metres, and a mesh its unit",
        );
    }
    Ok(shape)
}

/// An inertia that a body can have.
fn inertia_of(file: &InertiaFile) -> Result<Matrix3<f64>> {
    let inertia = tensor("inertia_kg_m2", file)?;
    let moments = SymmetricEigen::new(inertia).eigenvalues;
    if moments.min() > 1e-9 * moments.max() {
        return Ok(inertia);
    }
    let remedy = "give the inertia about the centre of mass as [xx, yy, zz, xy, xz, yz], or leave it out";
    fail("inertia_kg_m2", "is not positive definite", remedy)
}

/// A symmetric tensor from the three or six numbers of a file.
pub(super) fn tensor(key: &str, file: &InertiaFile) -> Result<Matrix3<f64>> {
    all_within(key, &file.0, 1e6)?;
    let (xx, yy, zz, xy, xz, yz) = match file.0[..] {
        [xx, yy, zz] => (xx, yy, zz, 0.0, 0.0, 0.0),
        [xx, yy, zz, xy, xz, yz] => (xx, yy, zz, xy, xz, yz),
        _ => {
            return fail(
                key,
                format!("has {} items", file.0.len()),
                "has to be [xx, yy, zz] or [xx, yy, zz, xy, xz, yz]",
            );
        }
    };
    Ok(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
}

/// Returns `true` if a principal moment is larger than the sum of the two others.
pub(crate) fn breaks_triangle(inertia: &Matrix3<f64>) -> bool {
    let moments = SymmetricEigen::new(*inertia).eigenvalues;
    2.0 * moments.max() > moments.sum() * (1.0 + 1e-6)
}
