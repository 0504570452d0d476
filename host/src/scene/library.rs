//! Where files come from: built into the program, or from the disk.

use super::{
    error::{Place, SceneError, suggestion},
    mesh,
    tree::{Node, Setting, Value},
};
use std::path::{Path, PathBuf};

/// No file of ours comes close, but for a mesh that was written into a scene; something else was named by mistake.
const LARGEST_FILE: u64 = 32 << 20;
/// Values of a file, roughly: the largest mesh has 1.2 million. Each takes some hundred bytes while the file is read.
const MOST_VALUES: usize = 2_000_000;

/// What a file describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scene,
    Hand,
    Object,
}

macro_rules! built_in {
    ($folder:literal: $($name:literal)*) => {
        &[$(($name, include_str!(concat!("../../../models/", $folder, "/", $name, ".toml")))),*]
    };
}

impl Kind {
    fn word(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Hand => "hand",
            Self::Object => "object",
        }
    }

    /// Names and texts.
    pub(super) fn built_in(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Scene => {
                built_in!("scenes": "prism" "cube" "prism-ideal" "cube-ideal" "cube-normal-only" "two-finger-prism")
            }
            Self::Hand => built_in!("hands": "three-finger" "two-finger"),
            Self::Object => {
                built_in!("objects": "prism" "cube" "hexagonal-prism" "l-bracket" "octahedron")
            }
        }
    }
}

/// Mesh files that built-in objects name.
const MESHES: [(&str, &[u8]); 2] = [
    ("l-bracket.stl", include_bytes!("../../../models/objects/l-bracket.stl")),
    ("octahedron.obj", include_bytes!("../../../models/objects/octahedron.obj")),
];

/// What the references of a file are relative to.
#[derive(Clone, Debug)]
pub(super) enum Folder {
    /// Of what is built in: its files are too.
    BuiltIn,
    /// A directory.
    Disk(PathBuf),
}

impl Folder {
    /// The bytes of a file.
    pub(super) fn bytes(&self, name: &str, largest: u64) -> Result<Vec<u8>, SceneError> {
        match self {
            Self::Disk(folder) => read_bytes(&folder.join(name), largest),
            Self::BuiltIn => match MESHES.iter().find(|(built_in, _)| *built_in == name) {
                Some((_, bytes)) => Ok(bytes.to_vec()),
                None => Err(SceneError::new("", "no such file is built in", "give the path of a file")),
            },
        }
    }

    /// The directory; for what is built in, the current one.
    fn path(&self) -> &Path {
        match self {
            Self::Disk(folder) => folder,
            Self::BuiltIn => Path::new(""),
        }
    }
}

/// A parsed file and the folder that its references are relative to.
pub(super) struct Document {
    pub(super) node: Node,
    folder: Folder,
}

/// A tree in which nothing refers to anything any more, and what is to be said about how it became so.
pub(super) struct Complete {
    pub(super) node: Node,
    pub(super) notices: Vec<String>,
}

impl Document {
    /// Parses a text.
    pub(super) fn parse(text: &str, source: &str, folder: &Path) -> Result<Self, SceneError> {
        Ok(Self { node: Node::parse(text, source)?, folder: Folder::Disk(folder.into()) })
    }

    /// Finds and parses something by its built-in name, or by its path, which ends in `.toml` or contains a separator.
    pub(super) fn open(kind: Kind, name: &str, folder: &Path) -> Result<Self, SceneError> {
        if name.ends_with(".toml") || name.contains(['/', '\\']) {
            let path = folder.join(name);
            let text = read_text(&path)?;
            return Self::parse(&text, &path.to_string_lossy(), path.parent().unwrap_or(folder));
        }
        match kind.built_in().iter().find(|(built_in, _)| *built_in == name) {
            Some((_, text)) => {
                let node = Node::parse(text, &format!("{}s/{name}.toml", kind.word()))?;
                Ok(Self { node, folder: Folder::BuiltIn })
            }
            None => Err(SceneError::new(
                "",
                format!("no built-in {} is called `{name}`", kind.word()),
                suggestion(name, kind.built_in().iter().map(|(name, _)| *name))
                    + " (a path has to end in .toml or contain a /)",
            )),
        }
    }

    /// Applies settings, follows the references of a scene, fills in the defaults of its hand and the mesh of its object. Settings of what a
    /// reference names come before it is followed, all others after.
    pub(super) fn complete_scene(mut self, settings: &[Setting]) -> Result<Complete, SceneError> {
        let is_reference = |setting: &&Setting| setting.key == "hand" || setting.key == "object";
        for setting in settings.iter().filter(is_reference) {
            self.node.set(setting)?;
        }
        let mut object_folder = self.folder.clone();
        for (key, kind) in [("hand", Kind::Hand), ("object", Kind::Object)] {
            let Some(node) = self.node.get_mut(key) else { continue };
            if let Value::String(name) = &node.value {
                let from_command_line = *node.place.source == *"--set";
                let folder = if from_command_line { Path::new("") } else { self.folder.path() };
                let document =
                    Self::open(kind, name, folder).map_err(|error| error.of_reference(key, &node.place))?;
                *node = document.node;
                if kind == Kind::Object {
                    object_folder = document.folder;
                }
            }
            if kind == Kind::Hand {
                complete_hand(node);
            }
        }
        for setting in settings.iter().filter(|setting| !is_reference(setting)) {
            if let Some(key) = setting.key.strip_prefix("hand.control") {
                let (problem, remedy) = ("acts in the firmware only", format!("set control{key}"));
                return Err(SceneError::new(&setting.key, problem, remedy).at(&Place::whole("--set")));
            }
            self.node.set(setting)?;
        }
        let notices = match self.node.get_mut("object") {
            Some(object) => mesh::expand(object, "object", &object_folder)?,
            None => Vec::new(),
        };
        Ok(Complete { node: self.node, notices })
    }

    /// Fills in the mesh of an object.
    pub(super) fn complete_object(mut self) -> Result<Complete, SceneError> {
        let notices = mesh::expand(&mut self.node, "", &self.folder)?;
        Ok(Complete { node: self.node, notices })
    }
}

/// Spreads the defaults of a hand.
pub(super) fn complete_hand(node: &mut Node) {
    node.spread_defaults("joint");
    node.spread_defaults("fingertip");
}

fn read_text(path: &Path) -> Result<String, SceneError> {
    let bytes = read_bytes(path, LARGEST_FILE)?;
    let values = bytes.iter().filter(|&&byte| byte == b',' || byte == b'\n').count();
    if values > MOST_VALUES {
        let place = Place::whole(&path.to_string_lossy());
        let problem = format!("{values} values are too many");
        return Err(SceneError::new("", problem, "check the path").at(&place));
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        let place = Place { line, ..Place::whole(&path.to_string_lossy()) };
        SceneError::new("", "not UTF-8 text", "save it as UTF-8").at(&place)
    })
}

fn read_bytes(path: &Path, largest: u64) -> Result<Vec<u8>, SceneError> {
    let place = Place::whole(&path.to_string_lossy());
    let fail = |problem: String, remedy: &str| SceneError::new("", problem, remedy).at(&place);
    let unreadable = |error: std::io::Error| {
        let word = match error.kind() {
            std::io::ErrorKind::NotFound => "no such file".into(),
            std::io::ErrorKind::PermissionDenied => "may not be read".into(),
            _ => error.to_string(),
        };
        fail(word, "check the path")
    };
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(fail("not a file".into(), "name a file"));
    }
    if metadata.len() > largest {
        return Err(fail(format!("{} MiB are too many", metadata.len() >> 20), "check the path"));
    }
    std::fs::read(path).map_err(unreadable)
}

impl SceneError {
    /// What keeps a whole file from being read is an error of what names it.
    fn of_reference(self, key: &str, place: &Place) -> Self {
        let problem = match &self.place {
            None => self.problem,
            Some(file) if file.line == 0 => format!("`{file}`: {}", self.problem),
            Some(_) => return self,
        };
        Self::new(key, problem, self.remedy).at(place)
    }
}
