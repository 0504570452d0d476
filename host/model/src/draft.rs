//! A scene whose files have been read, before its settings: so that it can be made with many settings, all from the same
//! files.

use super::error::SceneError;
use super::inspect::finding::Finding;
use super::library::{self, Document, Kind};
use super::tree::{Node, Setting};
use super::{Scene, SceneFile, build, open, read};
use std::ffi::OsStr;

/// A scene before its settings.
#[derive(Clone, Debug)]
pub struct Draft {
    tree: Node,
    /// The notices on its files.
    notices: Vec<Finding>,
}

impl Draft {
    /// Reads a scene by its built-in name or by its path, and all files that it refers to, or that settings have in their
    /// place: settings whose key [is of files](super::is_of_files) are applied here, all others not yet.
    ///
    /// # Errors
    /// One line: where, which key, what is wrong, what to do.
    pub fn open(name_or_path: impl AsRef<OsStr>, settings: &[Setting]) -> Result<Self, SceneError> {
        Self::of(open(Kind::Scene, name_or_path.as_ref())?, settings)
    }

    pub(super) fn of(document: Document, settings: &[Setting]) -> Result<Self, SceneError> {
        let mut notices = Vec::new();
        Ok(Self { tree: document.follow(settings, &mut notices)?, notices })
    }

    /// The effective configuration with settings; those that are of files do nothing any more. Whether it can be run is not
    /// known yet.
    ///
    /// # Errors
    /// One line: where, which key, what is wrong, what to do.
    pub fn file(&self, settings: &[Setting]) -> Result<SceneFile, SceneError> {
        read::read(&self.set(settings)?, "")
    }

    /// The scene with settings; those that are of files do nothing any more.
    ///
    /// # Errors
    /// One line: where, which key, what is wrong, what to do.
    pub fn scene(&self, settings: &[Setting]) -> Result<Scene, SceneError> {
        let tree = self.set(settings)?;
        let mut scene = build::scene(read::read(&tree, "")?).map_err(|error| {
            let place = tree.place_of(&error.key).clone();
            error.at(&place)
        })?;
        scene.warnings.splice(0..0, self.notices.iter().map(|notice| notice.words(0)));
        Ok(scene)
    }

    fn set(&self, settings: &[Setting]) -> Result<Node, SceneError> {
        let mut tree = self.tree.clone();
        library::apply(&mut tree, settings)?;
        Ok(tree)
    }
}
