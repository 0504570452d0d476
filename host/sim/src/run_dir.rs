//! The directory that a run is written to.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::{fs, fs::File};

/// The reason for which a run can't be written.
#[derive(Debug, thiserror::Error)]
pub enum RunDirError {
    /// The directory has files in it.
    #[error("{}: not empty; choose another directory, or overwrite a run in it with --force", path.display())]
    Occupied {
        /// The directory.
        path: PathBuf,
    },
    /// The file system said no.
    #[error("cannot write {}", path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
}

/// A directory for one run.
#[derive(Clone, Debug)]
pub struct RunDir {
    path: PathBuf,
}

impl RunDir {
    /// Chooses a directory. With `force`, files of an earlier run are overwritten, others left. Nothing is written yet: what
    /// can't be written is found out after the run, when its summary is safe.
    ///
    /// # Errors
    /// The directory is not empty, without `force`.
    pub fn choose(path: &Path, force: bool) -> Result<Self, RunDirError> {
        let path = path.to_owned();
        let occupied = fs::read_dir(&path).is_ok_and(|mut entries| entries.next().is_some());
        if occupied && !force { Err(RunDirError::Occupied { path }) } else { Ok(Self { path }) }
    }

    /// The directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A directory in it.
    pub fn below(&self, name: &str) -> Self {
        Self { path: self.path.join(name) }
    }

    /// Makes the directory if it is not there.
    ///
    /// # Errors
    /// What the file system says.
    pub fn create(&self) -> Result<(), RunDirError> {
        fs::create_dir_all(&self.path).map_err(|source| RunDirError::Io { path: self.path.clone(), source })
    }

    /// Writes one file.
    ///
    /// # Errors
    /// What the file system says; a full disk among others.
    pub fn write(
        &self,
        name: &str,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), RunDirError> {
        let path = self.path.join(name);
        let written = File::create(&path).and_then(|file| {
            let mut file = io::BufWriter::new(file);
            fill(&mut file)?;
            file.flush()
        });
        written.map_err(|source| RunDirError::Io { path, source })
    }
}
