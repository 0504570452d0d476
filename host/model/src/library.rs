//! The origin of files: built into the program, or from the disk.

use super::{
    error::{Place, SceneError, suggestion},
    inspect::finding::Finding,
    mesh,
    tree::{Node, Setting, Value},
    urdf,
};
use blindgrasp_files as files;
use std::borrow::Cow;
use std::ffi::OsStr;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// No file of ours comes close; something else was named by mistake.
const LARGEST_FILE: u64 = 4 << 20;
/// No scene or object comes close, but for one with a mesh written into it.
const LARGEST_TOML: u64 = 32 << 20;
/// Values of a file, roughly: the largest mesh has 1.2 million. Each takes some hundred bytes while the file is read.
const MOST_VALUES: usize = 2_000_000;

/// The content of a file.
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

    /// Refuses a file of another kind, by what every file of a kind has: otherwise the first of its keys would be unknown.
    fn refuse_others(self, node: &Node) -> Result<(), SceneError> {
        let has = |kind| match kind {
            Self::Scene => node.get("pose").is_some(),
            Self::Hand => node.get("fingertip").is_some(),
            Self::Object => node.get("shape").is_some(),
        };
        let other = [Self::Scene, Self::Hand, Self::Object].into_iter().find(|&kind| has(kind));
        match other {
            Some(other) if !has(self) => {
                let article = |kind: Self| if kind == Self::Object { "an" } else { "a" };
                let other = format!("{} {}", article(other), other.word());
                let own = format!("{} {}", article(self), self.word());
                let problem = format!("describes {other}, not {own}");
                Err(SceneError::new("", problem, format!("name the file of {own}"))
                    .at(&Place::whole(&node.place.source)))
            }
            _ => Ok(()),
        }
    }

    /// Names and texts.
    pub(super) fn built_in(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Scene => {
                built_in!("scenes":
                    "prism" "cube" "prism-ideal" "cube-ideal" "prism-normal-only" "cube-normal-only"
                    "hand-arm" "hand-arm-consistent" "hand-arm-firm" "hand-arm-normal-only"
                    "l-bracket" "two-finger-prism" "four-finger-cube" "allegro-like-prism"
                    "cube-table" "prism-table" "four-finger-cube-table" "allegro-like-prism-table"
                    "brick-allegro" "over-an-edge" "too-weak" "pick-cube" "pick-prism" "pick-cube-four-finger"
                    "pick-prism-allegro"
                )
            }
            Self::Hand => {
                built_in!("hands": "three-finger" "hand-arm" "two-finger" "four-finger" "allegro-like")
            }
            Self::Object => {
                built_in!("objects":
                    "prism" "cube" "hexagonal-prism" "cuboid" "cuboid-printed" "l-bracket" "octahedron"
                    "brick" "heavy-cube" "cube-100g" "prism-100g" "hexagonal-prism-100g"
                )
            }
        }
    }
}

/// URDFs that hands built in name, by the names of their files.
const BUILT_IN_URDFS: &[(&str, &str)] = &[
    #[cfg(test)]
    ("gripper.urdf", include_str!("urdf/tests/gripper.urdf")),
];

/// Mesh files that objects built in name, by their names.
const BUILT_IN_MESHES: &[(&str, &[u8])] = &[
    ("l-bracket.stl", include_bytes!("../../../models/objects/l-bracket.stl")),
    ("octahedron.obj", include_bytes!("../../../models/objects/octahedron.obj")),
];

/// The place that the references of a file are relative to.
#[derive(Clone, Debug)]
pub(super) enum Home {
    /// The program itself.
    BuiltIn,
    /// A folder.
    Folder(PathBuf),
}

impl Home {
    fn folder(&self) -> &Path {
        match self {
            Self::BuiltIn => Path::new(""),
            Self::Folder(folder) => folder,
        }
    }

    /// The text of the URDF that a hand names, and its name in errors.
    pub(super) fn urdf(
        &self,
        file: &str,
        named_at: &Place,
    ) -> Result<(Cow<'static, str>, String), SceneError> {
        if let (Self::BuiltIn, true) = (self, named_at.is_in_a_file()) {
            return match BUILT_IN_URDFS.iter().find(|(name, _)| *name == file) {
                Some((name, text)) => Ok((Cow::Borrowed(text), format!("hands/{name}"))),
                None => Err(SceneError::new("", "is not built in", "name it by its path")),
            };
        }
        let path = self.resolve(file.as_ref(), named_at);
        Ok((read_text(&path, ".urdf")?.into(), path.to_string_lossy().into_owned()))
    }

    /// The bytes of the mesh file that an object names.
    pub(super) fn mesh(
        &self,
        file: &OsStr,
        named_at: &Place,
        largest: u64,
    ) -> Result<Cow<'static, [u8]>, SceneError> {
        if let (Self::BuiltIn, true) = (self, named_at.is_in_a_file()) {
            return match BUILT_IN_MESHES.iter().find(|(name, _)| *name == file) {
                Some((_, bytes)) => Ok(Cow::Borrowed(bytes)),
                None => Err(SceneError::new("", "is not built in", "name it by its path")),
            };
        }
        read_bytes(&self.resolve(file, named_at), ".stl or .obj", largest).map(Cow::Owned)
    }

    /// The path of a file that is named somewhere.
    fn resolve(&self, file: &OsStr, named_at: &Place) -> PathBuf {
        if named_at.is_in_a_file() { self.folder().join(file) } else { file.into() }
    }
}

/// A parsed file, and what its references are relative to.
pub(super) struct Document {
    pub(super) node: Node,
    pub(super) home: Home,
}

impl Document {
    /// Parses a text.
    pub(super) fn parse(text: &str, source: &str, folder: &Path) -> Result<Self, SceneError> {
        Ok(Self { node: Node::parse(text, source)?, home: Home::Folder(folder.into()) })
    }

    /// Finds and parses something by its built-in name, or by its path, which ends in `.toml` or contains a separator.
    pub(super) fn open(kind: Kind, path: &OsStr, folder: &Path) -> Result<Self, SceneError> {
        // For words, and for names of what is built in, which are UTF-8.
        let name = &*path.to_string_lossy();
        if kind == Kind::Hand && name.ends_with(".urdf") {
            let remedy = format!("`blindgrasp hand new {name}` writes a hand's file that names it");
            return Err(SceneError::new(
                "",
                "a URDF alone is not a hand: it has no fingertips and gains",
                remedy,
            ));
        }
        if kind == Kind::Object && mesh::is_mesh(name) {
            let remedy = format!("`blindgrasp object new {name}` writes an object's file that names it");
            return Err(SceneError::new(
                "",
                "a mesh alone is not an object: it has no unit and no mass",
                remedy,
            ));
        }
        if is_path(path) {
            let path = folder.join(path);
            let text = read_text(&path, ".toml")?;
            let document = Self::parse(&text, &path.to_string_lossy(), path.parent().unwrap_or(folder))?;
            kind.refuse_others(&document.node)?;
            return Ok(document);
        }
        match kind.built_in().iter().find(|(built_in, _)| *built_in == name) {
            Some((_, text)) => Ok(Self {
                node: Node::parse(text, &format!("{}s/{name}.toml", kind.word()))?,
                home: Home::BuiltIn,
            }),
            None => Err(SceneError::new(
                "",
                format!("no built-in {} is called `{name}`", kind.word()),
                suggestion(name, kind.built_in().iter().map(|(name, _)| *name))
                    + match kind {
                        Kind::Object => {
                            " (a path has to end in .toml or contain a /; of meshes, .stl and .obj are read)"
                        }
                        _ => " (a path has to end in .toml or contain a /)",
                    },
            )),
        }
    }

    /// Follows the references of a scene, and fills in the URDF and the defaults of its hand and the mesh of its object.
    /// Settings that have a say in this ([`Stage`]) are applied when their turn comes; all others are left for [`apply`].
    pub(super) fn follow(
        mut self,
        settings: &[Setting],
        notices: &mut Vec<Finding>,
    ) -> Result<Node, SceneError> {
        let of = |stage| settings.iter().filter(move |setting| Stage::of(&setting.key) == stage);
        for setting in of(Stage::Reference) {
            self.node.set(setting)?;
        }
        let mut object_home = self.home.clone();
        for (key, kind) in [("hand", Kind::Hand), ("object", Kind::Object)] {
            let Some(node) = self.node.get_mut(key) else { continue };
            let mut home = self.home.clone();
            if let Value::String(name) = &node.value {
                let folder = if node.place.is_in_a_file() { self.home.folder() } else { Path::new("") };
                let document = Self::open(kind, name.as_ref(), folder)
                    .map_err(|error| error.of_reference(key, &node.place))?;
                (*node, home) = (document.node, document.home);
            }
            if kind == Kind::Hand {
                for setting in of(Stage::Urdf) {
                    self.node.set(setting)?;
                }
                let Some(hand) = self.node.get_mut(key) else { continue };
                complete_hand(hand, &home, notices).map_err(|error| error.below(key))?;
            } else {
                object_home = home;
            }
        }
        for setting in of(Stage::Shape) {
            self.node.set(setting)?;
        }
        if let Some(object) = self.node.get_mut("object") {
            mesh::expand(object, &object_home, notices).map_err(|error| error.below("object"))?;
        }
        Ok(self.node)
    }

    /// An object's tree, with its mesh filled in.
    pub(super) fn complete_object(self, notices: &mut Vec<Finding>) -> Result<Node, SceneError> {
        let Self { mut node, home } = self;
        mesh::expand(&mut node, &home, notices)?;
        Ok(node)
    }

    /// A hand's tree, with its URDF and its defaults filled in.
    pub(super) fn complete_hand(self, notices: &mut Vec<Finding>) -> Result<Node, SceneError> {
        let Self { mut node, home } = self;
        complete_hand(&mut node, &home, notices)?;
        Ok(node)
    }

    /// The path of the URDF that a hand's file names, if it does and is not built in.
    pub(super) fn urdf_path(&self) -> Option<PathBuf> {
        match (&self.home, urdf::file_of(&self.node)) {
            (Home::Folder(_), Some(Node { value: Value::String(file), place })) => {
                Some(self.home.resolve(file.as_ref(), place))
            }
            _ => None,
        }
    }
}

/// Applies settings to a scene whose references were followed, but for those that were applied with that.
pub(super) fn apply(node: &mut Node, settings: &[Setting]) -> Result<(), SceneError> {
    settings.iter().filter(|setting| Stage::of(&setting.key) == Stage::Last).try_for_each(|setting| {
        if let Some(key) = setting.key.strip_prefix("hand.control") {
            let (problem, remedy) = ("acts in the firmware only", format!("set control{key}"));
            return Err(SceneError::new(&setting.key, problem, remedy).at(&setting.place));
        }
        node.set(setting)
    })
}

/// The stage at which a setting is applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// It names the hand or the object: before these are read.
    Reference,
    /// It is about the hand's URDF: before that is read.
    Urdf,
    /// It is about the object's shape: before a mesh is read.
    Shape,
    /// After everything is read.
    Last,
}

impl Stage {
    fn of(key: &str) -> Self {
        match key {
            "hand" | "object" => Self::Reference,
            key if key.starts_with("hand.urdf.") => Self::Urdf,
            key if key == "object.shape" || key.starts_with("object.shape.") => Self::Shape,
            _ => Self::Last,
        }
    }
}

/// Returns `true` if a key has a say in which files a scene is made from.
pub fn is_of_files(key: &str) -> bool {
    Stage::of(key) != Stage::Last
}

/// Returns `true` if a name is that of a file, and not of something built in.
pub(super) fn is_path(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    name.ends_with(".toml") || name.contains(['/', '\\'])
}

/// Fills in a hand's URDF, and spreads its defaults.
fn complete_hand(node: &mut Node, home: &Home, notices: &mut Vec<Finding>) -> Result<(), SceneError> {
    node.spread_defaults("fingertip");
    // Those of the URDF come later.
    if node.get("capsule").is_some() {
        node.spread_defaults("capsule");
    }
    urdf::expand(node, home, notices)?;
    node.spread_defaults("capsule");
    node.spread_defaults("joint");
    Ok(())
}

/// Reads a text file of a kind.
pub(super) fn read_text(path: &Path, ending: &str) -> Result<String, SceneError> {
    let place = Place::whole(&path.to_string_lossy());
    let bytes = read_bytes(path, ending, if ending == ".toml" { LARGEST_TOML } else { LARGEST_FILE })?;
    let values = bytes.iter().filter(|&&byte| byte == b',' || byte == b'\n').count();
    if values > MOST_VALUES {
        let problem = format!("{values} values are too many");
        return Err(SceneError::new("", problem, "check the path").at(&place));
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        SceneError::new("", "not UTF-8 text", "save it as UTF-8").at(&Place { line, ..place })
    })
}

/// Reads a file of a kind.
fn read_bytes(path: &Path, ending: &str, largest: u64) -> Result<Vec<u8>, SceneError> {
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
    let mut file = files::open(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::InvalidInput => fail(error.to_string(), &format!("name a {ending} file")),
        _ => unreadable(error),
    })?;
    let length = file.metadata().map_err(unreadable)?.len();
    if length > largest {
        return Err(fail(format!("{} MiB are too many", length >> 20), "check the path"));
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

impl SceneError {
    /// Turns an error that keeps a whole file from being read into one of what names it.
    pub(super) fn of_reference(self, key: &str, place: &Place) -> Self {
        let problem = match &self.place {
            None => self.problem,
            Some(file) if file.line == 0 => format!("`{file}`: {}", self.problem),
            Some(_) => return self,
        };
        Self::new(key, problem, self.remedy).at(place)
    }

    /// Of a part of something larger.
    pub(super) fn below(mut self, key: &str) -> Self {
        if !self.key.is_empty() {
            self.key = format!("{key}.{}", self.key);
        }
        self
    }
}
