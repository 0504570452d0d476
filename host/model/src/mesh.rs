//! Bodies from mesh files: `[shape.mesh]` of an object with `file`, `unit` and `scale` becomes one with vertices and
//! triangles in metres, so that everything behind it, also a recording or a scene that was written, needs no file.

use super::check::{Result, within};
use super::error::{Place, SceneError, suggestion};
use super::file::{FileKey, ShapeFile};
use super::inspect::finding::Finding;
use super::library::Home;
use super::tree::{Node, Value};
use blindgrasp_mesh::{Format, Problem, Repaired, Soup, body, limits, parse};
use std::ffi::OsStr;
use std::path::PathBuf;

pub use blindgrasp_mesh::Unit;

/// The keys of `[shape.mesh]` that stand for vertices and triangles.
pub const FILE_KEYS: [FileKey; 3] = [
    FileKey { field: "file", value: "String", words: "STL or OBJ file, by its path relative to this file" },
    FileKey {
        field: "unit",
        value: "String",
        words: "Unit of the lengths in the file: `mm`, `cm`, `m` or `in`",
    },
    FileKey { field: "scale", value: "f64", words: "Factor on the lengths in the file" },
];

/// The least and the greatest factor on the lengths of a mesh file.
const SCALES: [f64; 2] = [1e-6, 1e6];

/// The remedy for what was repaired.
const REPAIRED: &str = "it is used as repaired";

/// Puts vertices and triangles in the place of the mesh file that an object names, if it does; notices say what was repaired.
pub(super) fn expand(object: &mut Node, home: &Home, notices: &mut Vec<Finding>) -> Result<()> {
    let Some(mesh) = object.get_mut("shape").and_then(|shape| shape.get_mut("mesh")) else {
        return Ok(());
    };
    let Some(entry) = mesh.take("file") else { return Ok(()) };
    let place = entry.place;
    let key = |name: &str| format!("shape.mesh.{name}");
    let fail = |name: &str, problem: String, remedy: String, place: &Place| {
        Err(SceneError::new(key(name), problem, remedy).at(place))
    };
    let Value::String(file) = &entry.node.value else {
        return fail("file", "is not a name".into(), "write file = \"part.stl\"".into(), &place);
    };
    for given in ["vertices_m", "triangles"] {
        if mesh.get_mut(given).is_some() {
            return fail(given, "is given beside a file".into(), "leave one out".into(), &place);
        }
    }
    let scale = match mesh.take("scale") {
        None => 1.0,
        Some(entry) => {
            let value = match entry.node.value {
                Value::Float(value) => value,
                Value::Integer(value) => value as f64,
                _ => {
                    return fail("scale", "is not a number".into(), "write scale = 1.0".into(), &entry.place);
                }
            };
            within(&key("scale"), value, SCALES[0], SCALES[1]).map_err(|error| error.at(&entry.place))?;
            value
        }
    };
    let unit = mesh.take("unit");
    let of_file = |problem: Problem| {
        SceneError::new(key("file"), format!("`{file}`: {}", problem.what), problem.remedy).at(&place)
    };
    let soup = read(file.as_ref(), home, &entry.node.place).map_err(of_file)?;
    let unit = match unit.as_ref().map(|entry| (&entry.node.value, &entry.place)) {
        Some((Value::String(word), place)) => match Unit::of(word) {
            Some(unit) => unit,
            None => {
                let remedy = suggestion(word, Unit::ALL.map(Unit::word));
                return fail("unit", format!("`{word}` is unknown"), remedy, place);
            }
        },
        Some((_, place)) => return fail("unit", "is not a name".into(), "write unit = \"mm\"".into(), place),
        None => {
            let remedy = Unit::choices(&soup.size(), |word| format!("unit = \"{word}\""));
            return fail("unit", "is missing".into(), remedy, &place);
        }
    };
    let mesh_of = body(soup, unit, scale).map_err(of_file)?;
    let node = |value| Node { value, place: place.clone() };
    let list = |items: Vec<Value>| node(Value::Array(items.into_iter().map(node).collect()));
    let vertices =
        mesh_of.vertices.iter().map(|p| list(p.iter().map(|v| Value::Float(*v)).collect())).collect();
    let triangles = mesh_of
        .triangles
        .iter()
        .map(|corners| list(corners.iter().map(|k| Value::Integer(*k as i64)).collect()))
        .collect();
    for (name, items) in [("vertices_m", vertices), ("triangles", triangles)] {
        mesh.insert(name, node(Value::Array(items)));
    }
    let notice = |what: String| Finding::notice(&place, format!("`{file}`: {what}"), REPAIRED);
    notices.extend(mesh_of.notices.into_iter().map(notice));
    Ok(())
}

/// Reads a mesh file alone, for an object whose file is still to be written; and says what had to be repaired.
///
/// # Errors
/// One line: which file, what is wrong, what to do.
pub fn load(path: &OsStr, unit: Option<Unit>) -> Result<(ShapeFile, Vec<Finding>)> {
    let place = Place::of_path(path);
    let of_file = |problem: Problem| SceneError::new("", problem.what, problem.remedy).at(&place);
    let soup = read(path, &Home::Folder(PathBuf::new()), &place).map_err(of_file)?;
    let Some(unit) = unit else {
        let remedy = Unit::choices(&soup.size(), |word| format!("--unit {word}"));
        return Err(of_file(Problem::new("a mesh file does not say its unit", remedy)));
    };
    let Repaired { vertices, triangles, notices } = body(soup, unit, 1.0).map_err(of_file)?;
    let notice = |what: String| Finding::notice(&place, what, REPAIRED);
    let shape = ShapeFile::mesh(vertices.into_iter().map(Into::into).collect(), triangles);
    Ok((shape, notices.into_iter().map(notice).collect()))
}

/// Returns `true` if a name is that of a mesh file.
pub fn is_mesh(name: impl AsRef<OsStr>) -> bool {
    Format::of(name.as_ref()).is_some()
}

/// Reads a file by its name's ending.
fn read(name: &OsStr, home: &Home, named_at: &Place) -> std::result::Result<Soup, Problem> {
    let Some(format) = Format::of(name) else {
        return Err(Problem::new("is neither .stl nor .obj", "export it as STL or OBJ"));
    };
    let bytes = home.mesh(name, named_at, limits::LARGEST_FILE);
    parse(format, bytes.map_err(|error| Problem::new(error.problem, error.remedy))?.into_owned())
}
