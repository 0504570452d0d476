//! The property of any bytes that are given to a reader: they are refused in one line, or what they describe can be
//! written and read again as the same. Shared with the fuzz targets (`fuzz/`).

use blindgrasp_model::file::{ObjectFile, SCHEMA};
use blindgrasp_model::inspect::hand::HandCheck;
use blindgrasp_model::inspect::object::{ObjectCheck, Wanted};
use blindgrasp_model::mesh::{self, Unit};
use blindgrasp_model::{HandFile, Scene, SceneError, StarterRequest};
use std::fs;
use std::path::Path;

/// A reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(dead_code)] // A fuzz target is about one of them.
pub(crate) enum Reader {
    /// A hand's URDF.
    Urdf,
    /// A mesh.
    Stl,
    /// A mesh.
    Obj,
    /// An object's file.
    Object,
    /// A hand's file.
    Hand,
    /// A scene's file.
    Scene,
}

impl Reader {
    /// The name of a file that it reads.
    fn file(self) -> &'static str {
        match self {
            Self::Urdf => "any.urdf",
            Self::Stl => "any.stl",
            Self::Obj => "any.obj",
            Self::Object => "any-object.toml",
            Self::Hand => "any-hand.toml",
            Self::Scene => "any-scene.toml",
        }
    }

    /// Gives it bytes, as a file in a folder, which is written to. Whether it took them.
    pub(crate) fn check(self, bytes: &[u8], folder: &Path) -> bool {
        let path = folder.join(self.file());
        fs::write(&path, bytes).unwrap();
        let name = path.to_str().unwrap();
        match self {
            Self::Urdf => urdf(self.file(), folder),
            Self::Stl | Self::Obj => mesh(name),
            Self::Object => object(name),
            Self::Hand => hand(name, folder),
            Self::Scene => scene(name),
        }
    }
}

/// Returns the value, unless it was refused as it should be.
fn accepted<T>(result: Result<T, SceneError>) -> Option<T> {
    let error = match result {
        Ok(accepted) => return Some(accepted),
        Err(error) => error,
    };
    let line = error.to_string();
    assert!(!line.chars().any(char::is_control) && line.len() < 900, "not one line: {line}");
    assert!(error.place.is_some() && !error.problem.is_empty(), "no place, or no problem: {line}");
    None
}

/// Nothing in it steers a terminal, whatever names there are in files.
fn assert_is_text(text: &str) {
    let is_odd = |c: char| c.is_control() && c != '\n';
    assert!(text.ends_with('\n') && !text.contains(is_odd), "{text:?}");
}

fn urdf(file: &str, folder: &Path) -> bool {
    let request = StarterRequest { file: file.into(), folder: folder.into(), ..Default::default() };
    let Some(starter) = accepted(request.start(|_, _| None)) else { return false };
    let path = folder.join("new.toml");
    fs::write(&path, &starter.text).unwrap();
    assert!(hand(path.to_str().unwrap(), folder), "a new hand can't be used:\n{}", starter.text);
    true
}

fn hand(name: &str, folder: &Path) -> bool {
    let check = accepted(HandCheck::load(name));
    check.iter().for_each(|check| assert_is_text(&check.text()));
    let Some((file, _, _)) = accepted(HandFile::load_checked(name)) else { return false };
    assert!(check.is_some(), "loaded, but can't be checked");
    let copy = folder.join("copy.toml");
    fs::write(&copy, toml::to_string(&file).unwrap()).unwrap();
    let again = HandFile::load(copy.to_str().unwrap());
    assert_eq!(again.unwrap(), file, "not the same, written and read again");
    fs::write(folder.join("copy.urdf"), file.to_urdf()).unwrap();
    true
}

fn mesh(name: &str) -> bool {
    let wanted = Wanted { unit: Some(Unit::Millimetre), fingertip_m: Some(0.01) };
    let check = ObjectCheck::load(name, &wanted).unwrap();
    assert_is_text(&check.text());
    let Some((shape, _)) = accepted(mesh::load(name.as_ref(), wanted.unit)) else { return false };
    round_trip(&ObjectFile {
        schema: SCHEMA,
        name: "part".into(),
        description: String::new(),
        mass_kg: Some(0.1),
        density_kg_m3: None,
        inertia_kg_m2: None,
        friction: None,
        shape,
    })
}

fn object(name: &str) -> bool {
    if let Some(check) = accepted(ObjectCheck::load(name, &Wanted::default())) {
        assert_is_text(&check.text());
    }
    accepted(ObjectFile::load(name)).is_some_and(|file| round_trip(&file))
}

/// Returns `true` if it is a body; if so, it is the same once written and read again.
fn round_trip(file: &ObjectFile) -> bool {
    let Ok(body) = file.body(&mut Vec::new()) else { return false };
    assert!(body.inertia_kg_m2.iter().all(|v| v.is_finite()) && body.mass_kg > 0.0);
    let again = ObjectFile::parse(&toml::to_string(file).unwrap(), "again", Path::new("")).unwrap();
    assert_eq!(&again, file, "not the same, written and read again");
    assert_eq!(again.body(&mut Vec::new()).unwrap(), body);
    true
}

fn scene(name: &str) -> bool {
    let Some(scene) = accepted(Scene::load(name, &[])) else { return false };
    let again = Scene::parse(&scene.effective_toml(), "again", Path::new(""), &[]).unwrap();
    assert_eq!(again.file, scene.file, "not the same, written and read again");
    true
}
