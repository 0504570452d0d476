//! The files of a sweep: the table, its pictures, and the journal while it is not done.

use super::picture;
use super::plan::Plan;
use super::run::Row;
use super::table::Columns;
use blindgrasp_files::{self as files, NewFile};
use blindgrasp_record::table::{self, Format, TableError};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The files that a sweep is written to.
#[derive(Clone, Debug)]
pub struct Output {
    path: PathBuf,
    format: Format,
}

/// The reason for which a sweep can't be written.
#[derive(Debug, Error)]
pub enum OutputError {
    /// Its ending says nothing.
    #[error("--out: {}: a sweep is written to a file that ends in .parquet or .csv", .0.display())]
    Ending(PathBuf),
    /// A file can't be written, or may not be.
    #[error(transparent)]
    File(#[from] files::OutputError),
    /// The folder can't be made.
    #[error("cannot write {}", .0.display())]
    Folder(PathBuf, #[source] io::Error),
    /// The table can't be written.
    #[error("{}", .0.display())]
    Table(PathBuf, #[source] TableError),
    /// A picture can't be drawn.
    #[error("cannot draw {}: {}", .0.display(), .1)]
    Draw(PathBuf, String),
}

impl Output {
    /// Chooses a file by its path, which says what it is.
    ///
    /// # Errors
    /// It ends neither in `.parquet` nor in `.csv`, or the format is not built in.
    pub fn choose(path: &Path) -> Result<Self, OutputError> {
        let format = match path.extension().and_then(|ending| ending.to_str()) {
            Some("parquet") => Format::Parquet,
            Some("csv") => Format::Csv,
            _ => return Err(OutputError::Ending(path.to_owned())),
        };
        format.check().map_err(|source| OutputError::Table(path.to_owned(), source))?;
        Ok(Self { path: path.to_owned(), format })
    }

    /// The table's file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The journal's: beside the table.
    pub fn journal(&self) -> PathBuf {
        let mut name = self.path.clone().into_os_string();
        name.push(".journal");
        name.into()
    }

    /// Makes the directory, and makes sure that nothing is overwritten: not without `force`, and not unless there is a journal,
    /// which says that what is there is this sweep's.
    ///
    /// # Errors
    /// A file is there, or a directory in its place; or what the file system says.
    pub fn prepare(&self, plan: &Plan, force: bool) -> Result<(), OutputError> {
        if let Some(folder) = self.path.parent() {
            fs::create_dir_all(folder).map_err(|source| OutputError::Folder(folder.to_owned(), source))?;
        }
        let may_overwrite = force || self.journal().exists();
        for path in [self.path.clone()].into_iter().chain(self.pictures(plan)) {
            files::check(&path, may_overwrite)?;
        }
        Ok(())
    }

    /// The files of the pictures that a sweep has.
    pub fn pictures(&self, plan: &Plan) -> Vec<PathBuf> {
        let endings = if picture::is_drawn(plan) { &["png", "svg"][..] } else { &[] };
        endings.iter().map(|ending| self.path.with_extension(ending)).collect()
    }

    /// Writes pictures and table, each in one piece: it is there as a whole or not at all. The table is written last.
    ///
    /// # Errors
    /// The first file that can't be written.
    pub fn write(&self, plan: &Plan, rows: &[Row]) -> Result<(), OutputError> {
        if let Some(drawn) = picture::draw(plan, rows) {
            for (path, bytes) in self.pictures(plan).into_iter().zip(drawn) {
                let bytes = bytes.map_err(|reason| OutputError::Draw(path.clone(), reason))?;
                files::write(&path, bytes, true)?;
            }
        }
        let mut file = NewFile::create(&self.path, true)?;
        let mut write = || {
            let mut table = table::create(self.format, &mut file, Columns::new(plan, rows))?;
            table.write(rows)?;
            table.finish()
        };
        write().map_err(|source| OutputError::Table(self.path.clone(), source))?;
        Ok(file.finish()?)
    }
}
