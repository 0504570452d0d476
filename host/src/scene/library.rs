//! Where files come from: built into the program, or from the disk.

use super::{
    error::{Place, SceneError, suggestion},
    tree::{Node, Setting, Value},
};
use std::path::{Path, PathBuf};

/// No file of ours comes close; something else was named by mistake.
const LARGEST_FILE: u64 = 4 << 20;

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
                built_in!("scenes":
                    "prism" "cube" "prism-ideal" "cube-ideal" "cube-normal-only"
                    "hand-arm" "hand-arm-consistent" "hand-arm-firm"
                    "two-finger-prism" "four-finger-cube" "allegro-like-prism"
                )
            }
            Self::Hand => {
                built_in!("hands": "three-finger" "hand-arm" "two-finger" "four-finger" "allegro-like")
            }
            Self::Object => built_in!("objects": "prism" "cube" "hexagonal-prism" "cuboid" "cuboid-printed"),
        }
    }
}

/// A parsed file and the folder that its references are relative to.
pub(super) struct Document {
    pub(super) node: Node,
    folder: PathBuf,
}

impl Document {
    /// Parses a text.
    pub(super) fn parse(text: &str, source: &str, folder: &Path) -> Result<Self, SceneError> {
        Ok(Self { node: Node::parse(text, source)?, folder: folder.into() })
    }

    /// Finds and parses something by its built-in name, or by its path, which ends in `.toml` or contains a separator.
    pub(super) fn open(kind: Kind, name: &str, folder: &Path) -> Result<Self, SceneError> {
        if name.ends_with(".toml") || name.contains(['/', '\\']) {
            let path = folder.join(name);
            let text = read_text(&path)?;
            return Self::parse(&text, &path.to_string_lossy(), path.parent().unwrap_or(folder));
        }
        match kind.built_in().iter().find(|(built_in, _)| *built_in == name) {
            Some((_, text)) => Self::parse(text, &format!("{}s/{name}.toml", kind.word()), Path::new("")),
            None => Err(SceneError::new(
                "",
                format!("no built-in {} is called `{name}`", kind.word()),
                suggestion(name, kind.built_in().iter().map(|(name, _)| *name))
                    + " (a path has to end in .toml or contain a /)",
            )),
        }
    }

    /// Applies settings, follows the references of a scene, and fills in the defaults of its hand. Settings of what a
    /// reference names come before it is followed, all others after.
    pub(super) fn complete_scene(mut self, settings: &[Setting]) -> Result<Node, SceneError> {
        let is_reference = |setting: &&Setting| setting.key == "hand" || setting.key == "object";
        for setting in settings.iter().filter(is_reference) {
            self.node.set(setting)?;
        }
        for (key, kind) in [("hand", Kind::Hand), ("object", Kind::Object)] {
            let Some(node) = self.node.get_mut(key) else { continue };
            if let Value::String(name) = &node.value {
                let from_command_line = *node.place.source == *"--set";
                let folder = if from_command_line { Path::new("") } else { self.folder.as_path() };
                *node = Self::open(kind, name, folder)
                    .map_err(|error| error.of_reference(key, &node.place))?
                    .node;
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
        Ok(self.node)
    }
}

/// Spreads the defaults of a hand.
pub(super) fn complete_hand(node: &mut Node) {
    node.spread_defaults("joint");
    node.spread_defaults("fingertip");
}

fn read_text(path: &Path) -> Result<String, SceneError> {
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
        return Err(fail("not a file".into(), "name a .toml file"));
    }
    if metadata.len() > LARGEST_FILE {
        return Err(fail(format!("{} MiB are too many", metadata.len() >> 20), "check the path"));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    String::from_utf8(bytes).map_err(|error| {
        let line = 1 + error.as_bytes()[..error.utf8_error().valid_up_to()]
            .iter()
            .filter(|&&byte| byte == b'\n')
            .count();
        fail("not UTF-8 text".into(), "save it as UTF-8").at_line(line)
    })
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

    fn at_line(mut self, line: usize) -> Self {
        if let Some(place) = &mut self.place {
            place.line = line;
        }
        self
    }
}
