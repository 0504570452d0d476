//! Boxes around the meshes of links, for capsules to fill. They are guesses: a mesh may be anything within its box.

use super::super::super::error::{Place, SceneError};
use super::super::super::library::Home;
use super::super::assembly::Assembly;
use super::super::robot::{Mesh, Robot};
use super::super::shape::{Shape, Solid};
use super::super::transform::Transform;
use blindgrasp_mesh::{Format, limits, parse};
use nalgebra::{Matrix3, Vector2, Vector3};
use std::path::{Path, PathBuf};

/// The most directions that a box may lie along, of the largest triangles.
const MOST_DIRECTIONS: usize = 64;
/// Directions whose product is above this are the same: a degree.
const SAME_DIRECTION: f64 = 0.99985;
/// The thinnest that a box may be, of its length: what is flatter is no body.
const FLATTEST: f64 = 1e-4;

/// Boxes around the meshes that links touch with, and why others have none.
#[derive(Clone, Debug, Default)]
pub(super) struct Boxes {
    /// Each with its link.
    pub(super) shapes: Vec<(usize, Shape)>,
    /// In words, each with its link.
    pub(super) left_out: Vec<(usize, String)>,
}

impl Boxes {
    /// Of all links below the base of a URDF in a folder.
    pub(super) fn around(robot: &Robot, assembly: &Assembly, folder: &Path) -> Self {
        let mut boxes = Self::default();
        for (k, link) in robot.links.iter().enumerate().filter(|(k, _)| assembly.seats[*k].is_some()) {
            for mesh in &link.meshes {
                match points_m(mesh, folder).and_then(|triangles_m| around(&triangles_m)) {
                    Ok((sides_m, frame)) => {
                        let (solid, pose) = (Solid::Box { sides_m }, mesh.pose.then(&frame));
                        boxes.shapes.push((k, Shape { solid, pose, is_collision: true }));
                    }
                    Err(why) => boxes.left_out.push((k, format!("a mesh: {why}"))),
                }
            }
        }
        boxes
    }
}

/// The triangles of a mesh file, m.
fn points_m(mesh: &Mesh, folder: &Path) -> Result<Vec<[Vector3<f64>; 3]>, String> {
    let path = path(&mesh.file, folder).ok_or("its file is not found")?;
    let format = Format::of(path.as_os_str()).ok_or("it is neither STL nor OBJ")?;
    let bytes = Home::Folder(PathBuf::new()).mesh(path.as_os_str(), &Place::whole(""), limits::LARGEST_FILE);
    let bytes = bytes.map_err(|SceneError { problem, .. }| problem)?.into_owned();
    let soup = parse(format, bytes).map_err(|problem| problem.what)?;
    let scale = Vector3::from(mesh.scale);
    Ok(soup.triangles().iter().map(|corners| corners.map(|corner| corner.component_mul(&scale))).collect())
}

/// The file that a URDF means: relative to its folder; `package://NAME/...` is looked for in the folders above.
fn path(file: &str, folder: &Path) -> Option<PathBuf> {
    if let Some(absolute) = file.strip_prefix("file://") {
        return Some(absolute.into());
    }
    let Some(inside) = file.strip_prefix("package://").or_else(|| file.strip_prefix("model://")) else {
        return Some(folder.join(file));
    };
    let (package, rest) = inside.split_once('/')?;
    let folder = folder.canonicalize().ok()?;
    let above = folder.ancestors().flat_map(|above| {
        let is_package = above.file_name().is_some_and(|name| name == package);
        [is_package.then(|| above.join(rest)), Some(above.join(package).join(rest))]
    });
    above.flatten().find(|path| path.is_file())
}

/// The smallest box around triangles that lies on one of them: its sides, and its frame.
///
/// It is thinnest across one of the largest triangles, and then across an edge of its outline from there: around a box it is that
/// box.
fn around(triangles_m: &[[Vector3<f64>; 3]]) -> Result<([f64; 3], Transform), String> {
    let points: Vec<Vector3<f64>> = triangles_m.iter().flatten().copied().collect();
    let nothing = || "it has no volume".to_owned();
    if !points.iter().flatten().all(|v| v.is_finite()) {
        return Err("its numbers are too large".into());
    }
    let thin = directions(triangles_m)
        .into_iter()
        .min_by(|a, b| extent(&points, a).1.total_cmp(&extent(&points, b).1))
        .ok_or_else(nothing)?;
    let u = thin.cross(&Vector3::ith(thin.iamin(), 1.0)).normalize();
    let v = thin.cross(&u);
    let flat: Vec<Vector2<f64>> = points.iter().map(|p| Vector2::new(u.dot(p), v.dot(p))).collect();
    let across = narrowest(&outline(flat)).ok_or_else(nothing)?;
    let across = u * across.x + v * across.y;
    let axes = [thin, across, thin.cross(&across)];
    let extents = axes.map(|axis| extent(&points, &axis));
    let sides_m = extents.map(|(_, side)| side);
    let longest = sides_m.into_iter().fold(0.0, f64::max);
    if !sides_m.iter().all(|side| *side > FLATTEST * longest) {
        return Err(nothing());
    }
    let offset_m = axes.iter().zip(extents).map(|(axis, (middle, _))| axis * middle).sum();
    Ok((sides_m, Transform { attitude: Matrix3::from_columns(&axes), offset_m }))
}

/// Middle and length of what points take along a direction.
fn extent(points: &[Vector3<f64>], along: &Vector3<f64>) -> (f64, f64) {
    let places = points.iter().map(|point| along.dot(point));
    let (low, high) =
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
    (0.5 * (low + high), high - low)
}

/// The directions across the largest triangles.
fn directions(triangles_m: &[[Vector3<f64>; 3]]) -> Vec<Vector3<f64>> {
    let areas = triangles_m.iter().map(|[a, b, c]| (b - a).cross(&(c - a)));
    let mut areas: Vec<Vector3<f64>> = areas.filter(|area| area.norm_squared() > 0.0).collect();
    areas.sort_by(|a, b| b.norm_squared().total_cmp(&a.norm_squared()));
    let mut directions: Vec<Vector3<f64>> = Vec::new();
    for area in areas {
        let direction = area.normalize();
        if directions.iter().all(|other| other.dot(&direction).abs() < SAME_DIRECTION) {
            directions.push(direction);
            if directions.len() == MOST_DIRECTIONS {
                break;
            }
        }
    }
    directions
}

/// The convex outline of points in a plane, one way round.
fn outline(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let half = |points: &mut dyn Iterator<Item = &Vector2<f64>>| {
        let mut side: Vec<Vector2<f64>> = Vec::new();
        for point in points {
            while let [.., a, b] = side[..]
                && (b - a).perp(&(point - b)) <= 0.0
            {
                side.pop();
            }
            side.push(*point);
        }
        side.pop();
        side
    };
    let mut outline = half(&mut points.iter());
    outline.append(&mut half(&mut points.iter().rev()));
    outline
}

/// The direction across the edge of an outline across which it is narrowest.
fn narrowest(outline: &[Vector2<f64>]) -> Option<Vector2<f64>> {
    let width = |across: &Vector2<f64>| {
        let places = outline.iter().map(|point| across.dot(point));
        let (low, high) =
            places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
        high - low
    };
    let edges = outline.iter().zip(outline.iter().cycle().skip(1)).map(|(a, b)| b - a);
    let across = edges.filter_map(|edge| Vector2::new(-edge.y, edge.x).try_normalize(0.0));
    across.min_by(|a, b| width(a).total_cmp(&width(b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_meshes::Numbers;
    use nalgebra::{Rotation3, UnitQuaternion};

    /// The triangles of a box.
    fn cuboid(sides: [f64; 3], place: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Vec<[Vector3<f64>; 3]> {
        let half = Vector3::from(sides) * 0.5;
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let corner = |b: f64, c: f64| {
                    let mut corner = Vector3::zeros();
                    (corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3]) = (sign, b, c);
                    place(corner.component_mul(&half))
                };
                let [a, b, c, d] =
                    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        triangles
    }

    /// Boxes of all proportions, cubes and plates among them, turned and moved anywhere.
    #[test]
    fn the_box_around_a_box_is_the_box() {
        let mut numbers = Numbers(5);
        for k in 0..200 {
            let mut sides: [f64; 3] = (numbers.vector() * 0.04).map(|v| v.abs() + 0.001).into();
            match k % 3 {
                1 => sides = [sides[0]; 3],
                2 => sides[1] = sides[2],
                _ => {}
            }
            let turn = UnitQuaternion::from_scaled_axis(numbers.vector() * 3.0);
            let offset = numbers.vector();
            let (found, frame) = around(&cuboid(sides, |corner| turn * corner + offset)).unwrap();
            let mut ordered = [sides, found];
            ordered.iter_mut().for_each(|sides| sides.sort_by(f64::total_cmp));
            let [expected, found_sides] = ordered;
            for (found, expected) in found_sides.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-14, "{k}: {found_sides:?} {expected:?}");
            }
            assert!((frame.offset_m - offset).norm() < 1e-14);
            assert!((frame.attitude.determinant() - 1.0).abs() < 1e-14);
            // Each axis of the box found is one of the box.
            let axes = Rotation3::from(turn).inverse() * frame.attitude;
            assert!(axes.column_iter().all(|axis| (axis.amax() - 1.0).abs() < 1e-12), "{k}: {axes}");
        }
    }

    #[test]
    fn what_is_no_body_has_no_box() {
        let flat = [[Vector3::zeros(), Vector3::x(), Vector3::y()]];
        assert_eq!(around(&flat).unwrap_err(), "it has no volume");
        assert_eq!(around(&[]).unwrap_err(), "it has no volume");
        assert_eq!(around(&[[Vector3::x(); 3]]).unwrap_err(), "it has no volume");
        assert_eq!(around(&[[Vector3::x() * f64::INFINITY; 3]]).unwrap_err(), "its numbers are too large");
    }
}
