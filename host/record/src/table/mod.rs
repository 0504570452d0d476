//! Tables in files, of whatever a [`Layout`] makes rows of: CSV, and Parquet with units and more in its metadata.

mod csv;
#[cfg(feature = "parquet")]
mod parquet;

use std::io::{self, Write};

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values.
    Csv,
    /// Parquet.
    Parquet,
}

impl Format {
    /// Refuses a format that is not built in, before a file is made for it.
    ///
    /// # Errors
    /// [`TableError::NotBuilt`], which says how to get it.
    pub fn check(self) -> Result<(), TableError> {
        if self == Self::Parquet && cfg!(not(feature = "parquet")) {
            Err(TableError::NotBuilt)
        } else {
            Ok(())
        }
    }
}

/// The kind of a column's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers.
    Whole,
    /// Numbers of single precision.
    Real,
    /// Numbers of double precision.
    Double,
    /// True or false.
    Truth,
    /// Words.
    Words,
}

/// A value in a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell<'a> {
    /// It was not sent, or is not known.
    Missing,
    /// A whole number.
    Whole(i64),
    /// A number of single precision.
    Real(f32),
    /// A number of double precision.
    Double(f64),
    /// True or false.
    Truth(bool),
    /// A word.
    Word(&'a str),
    /// Words made for it.
    Text(String),
}

/// The heading of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heading<'a> {
    /// Its name.
    pub name: &'a str,
    /// The kind of its values.
    pub kind: Kind,
    /// Its unit; empty for what has none.
    pub unit: &'a str,
    /// Its meaning.
    pub words: &'a str,
}

/// The layout of a table's rows.
pub trait Layout {
    /// The data of a row.
    type Row;

    /// Returns the name of a row, a word.
    fn row_name(&self) -> &str;

    /// The columns.
    fn headings(&self) -> impl Iterator<Item = Heading<'_>>;

    /// The value of a column, by its number, in a row.
    fn cell<'a>(&'a self, row: &'a Self::Row, column: usize) -> Cell<'a>;

    /// Keys and values for the metadata of a file that has them.
    fn about(&self) -> Vec<(String, String)>;
}

/// A table that is being written.
pub trait Table<R> {
    /// Writes rows.
    ///
    /// # Errors
    /// They can't be written.
    fn write(&mut self, rows: &[R]) -> Result<(), TableError>;

    /// Writes what is left.
    ///
    /// # Errors
    /// It can't be written.
    fn finish(self: Box<Self>) -> Result<(), TableError>;
}

/// The reason for which a table can't be written.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// Parquet is a feature, which is off.
    #[error(
        "this build has no Parquet; build it in: `cargo run --release --features parquet --` and the same arguments"
    )]
    NotBuilt,
    /// The file system said no.
    #[error("cannot write the table: {0}")]
    Write(#[from] io::Error),
    /// The file system said no, or Parquet can't express it.
    #[cfg(feature = "parquet")]
    #[error("cannot write the table: {0}")]
    Parquet(#[from] ::parquet::errors::ParquetError),
}

impl TableError {
    /// Returns `true` if the reader of a pipe has seen enough.
    pub fn is_broken_pipe(&self) -> bool {
        let is_it = |error: &io::Error| error.kind() == io::ErrorKind::BrokenPipe;
        match self {
            Self::Write(error) => is_it(error),
            Self::NotBuilt => false,
            #[cfg(feature = "parquet")]
            Self::Parquet(error) => {
                std::error::Error::source(error).and_then(|source| source.downcast_ref()).is_some_and(is_it)
            }
        }
    }
}

/// Begins a table.
///
/// # Errors
/// It can't be written.
pub fn create<'a, L: Layout + 'a>(
    format: Format,
    to: impl Write + Send + 'a,
    layout: L,
) -> Result<Box<dyn Table<L::Row> + 'a>, TableError> {
    Ok(match format {
        Format::Csv => Box::new(csv::CsvTable::new(to, layout)?),
        #[cfg(feature = "parquet")]
        Format::Parquet => Box::new(parquet::ParquetTable::new(to, layout)?),
        #[cfg(not(feature = "parquet"))]
        Format::Parquet => return Err(TableError::NotBuilt),
    })
}
