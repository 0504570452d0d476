//! Recordings as tables: a row a record, streamed, so that an hour takes no more memory than a minute.
//!
//! ```text
//! entries --> Decoder --> batches of rows =thread=> columns --> CSV or Parquet
//! ```
//!
//! - The [`Column`]s are those of the recording's signal table: one for each signal of the hand, and of each joint by its
//!   name. What was not sent is missing: empty, or null.
//! - Numbers come out with all their bits. What is coarser in a recording is so because it was sent so.

mod column;

pub use crate::table::{Cell, Format, Kind};
pub use column::{Column, NoSuchColumn, Row};

use crate::mcap::{About, Decoder, Entry, RecordingError, What};
use crate::table::{self, Heading, TableError};
use std::io::Write;
use std::sync::mpsc::{self, Receiver, SendError, SyncSender};
use std::thread;

/// Rows that go from one thread to the other at once, and how many such batches may wait.
const BATCH: usize = 1024;
const BATCHES: usize = 4;
/// Longest time that a record may come after its tick, s.
const LATEST_S: f64 = 2.0;

/// The request for an export.
#[derive(Clone, Debug)]
pub struct Request {
    /// The number of the device.
    pub device: usize,
    /// Patterns of columns; none for all.
    pub signals: Vec<String>,
    /// From this time on, s since the beginning of the recording.
    pub from_s: Option<f64>,
    /// Up to this time, s.
    pub until_s: Option<f64>,
    /// The beginning of the recording, ns since 1970.
    pub start_ns: u64,
}

/// The result of an export.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Exported {
    /// Rows.
    pub rows: u64,
    /// Records that are missing between them.
    pub lost: u64,
    /// Places where some are.
    pub gaps: u64,
    /// The reason for which the table ends before the recording does.
    pub ended: Option<String>,
}

/// The reason for which there is no table.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The recording can't be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The columns can't be chosen.
    #[error(transparent)]
    Columns(#[from] NoSuchColumn),
    /// Nothing says who the device is.
    #[error("nothing in the recording says whose records these are: it has no session")]
    NoSession,
    /// It can't be written.
    #[error(transparent)]
    Table(#[from] TableError),
}

/// The columns of a table, and what their values are told by.
struct Layout {
    columns: Vec<Column>,
    joint_names: Vec<String>,
    /// For the metadata.
    about: Vec<(String, String)>,
}

impl table::Layout for Layout {
    type Row = Row;

    fn row_name(&self) -> &str {
        "tick"
    }

    fn headings(&self) -> impl Iterator<Item = Heading<'_>> {
        self.columns.iter().map(|column| Heading {
            name: &column.name,
            kind: column.kind,
            unit: column.unit,
            words: column.words,
        })
    }

    #[inline]
    fn cell<'a>(&'a self, row: &'a Row, column: usize) -> Cell<'a> {
        self.columns[column].cell(row, &self.joint_names)
    }

    fn about(&self) -> Vec<(String, String)> {
        self.about.clone()
    }
}

/// A batch from the reading thread to the writing one.
enum Batch {
    /// The device whose rows follow.
    About(Box<About>),
    Rows(Vec<Row>),
}

/// Exports entries of a recording. `each` is called now and then with the entries.
///
/// # Errors
/// Why there is no table, or only a part of it.
pub fn export<E: Iterator<Item = Result<Entry, RecordingError>> + Send>(
    entries: &mut E,
    each: impl Fn(&E) + Send,
    request: &Request,
    format: Format,
    to: impl Write + Send,
) -> Result<Exported, ExportError> {
    thread::scope(|scope| {
        let (sender, receiver) = mpsc::sync_channel(BATCHES);
        let reader = scope.spawn(move || read(entries, each, request, &sender));
        let written = write(receiver, request, format, to);
        let read = reader.join().unwrap_or_else(|_| Ok(Exported::default()));
        written?;
        read
    })
}

/// Reads entries, and sends rows.
fn read<E: Iterator<Item = Result<Entry, RecordingError>>>(
    entries: &mut E,
    each: impl Fn(&E),
    request: &Request,
    sender: &SyncSender<Batch>,
) -> Result<Exported, ExportError> {
    let (from_s, until_s) =
        (request.from_s.unwrap_or(f64::NEG_INFINITY), request.until_s.unwrap_or(f64::INFINITY));
    let mut decoder = Decoder::new();
    let mut exported = Exported::default();
    let mut is_cut = false;
    let mut about: Option<Box<About>> = None;
    let mut rows = Vec::with_capacity(BATCH);
    while let Some(entry) = entries.next() {
        let entry = entry?;
        if entry.device != request.device {
            continue;
        }
        let at_s = column::seconds(entry.at.0, request.start_ns);
        if at_s > until_s + LATEST_S {
            break;
        }
        if let What::About(new) = &entry.what {
            let is_other = |old: &About| old.hand != new.hand || old.joint_names != new.joint_names;
            if exported.rows > 0 && about.as_deref().is_some_and(is_other) {
                exported.ended = Some(format!(
                    "from {at_s:.3} s on the hand is another, `{}`: export the rest with --from {at_s:.3}",
                    new.hand
                ));
                break;
            }
            about = Some(new.clone());
        }
        is_cut |= matches!(entry.what, What::Gap { .. }) && exported.rows > 0;
        let Some(decoded) = decoder.take(&entry) else {
            if let (What::About(_), Some(obstacle)) = (&entry.what, decoder.obstacle(entry.device)) {
                return Err(obstacle.into());
            }
            continue;
        };
        let tick_s = column::seconds(decoded.at.0, request.start_ns);
        if tick_s < from_s || tick_s > until_s {
            continue;
        }
        if exported.rows == 0 && !introduce(about.as_deref(), sender)? {
            break;
        }
        exported.rows += 1;
        if exported.rows > 1 {
            exported.lost += decoded.lost_before;
            exported.gaps += u64::from(is_cut || decoded.lost_before > 0);
        }
        is_cut = false;
        let joint_count = about.as_ref().map_or(0, |about| about.joint_names.len());
        rows.push(Row::of(decoded, request.start_ns, joint_count));
        if rows.len() == BATCH {
            each(entries);
            let full = std::mem::replace(&mut rows, Vec::with_capacity(BATCH));
            if sender.send(Batch::Rows(full)).is_err() {
                // It can't be written, and why is told there.
                break;
            }
        }
    }
    if exported.rows == 0 {
        introduce(about.as_deref(), sender)?;
    }
    let _ = sender.send(Batch::Rows(rows));
    Ok(exported)
}

/// Tells whose rows follow; says whether somebody listens.
fn introduce(about: Option<&About>, sender: &SyncSender<Batch>) -> Result<bool, ExportError> {
    let about = about.ok_or(ExportError::NoSession)?;
    let sent: Result<(), SendError<Batch>> = sender.send(Batch::About(Box::new(about.clone())));
    Ok(sent.is_ok())
}

/// Writes the rows that come.
fn write(
    batches: Receiver<Batch>,
    request: &Request,
    format: Format,
    to: impl Write + Send,
) -> Result<(), ExportError> {
    // Without whose rows they are, there is no table; why, the reading thread tells.
    let Some(Batch::About(about)) = batches.iter().next() else { return Ok(()) };
    let columns = Column::chosen(&about.joint_names, &request.signals)?;
    let joint_names = about.joint_names.clone();
    let about = metadata(&about, request);
    let mut table = table::create(format, to, Layout { columns, joint_names, about })?;
    for batch in batches {
        if let Batch::Rows(rows) = batch {
            table.write(&rows)?;
        }
    }
    Ok(table.finish()?)
}

/// Returns the words on the device of a table that describes itself.
fn metadata(about: &About, request: &Request) -> Vec<(String, String)> {
    let mut metadata = vec![
        ("hand".to_owned(), about.hand.clone()),
        ("hand_hash".to_owned(), format!("{:08x}", about.hand_hash)),
        ("firmware_version".to_owned(), about.firmware_version.clone()),
        ("build_hash".to_owned(), format!("{:08x}", about.build_hash)),
        ("interface_version".to_owned(), about.interface_version.to_string()),
        ("host_version".to_owned(), about.host_version.clone()),
        ("exported_by".to_owned(), concat!("blindgrasp ", env!("CARGO_PKG_VERSION")).to_owned()),
        ("recording_start_ns".to_owned(), request.start_ns.to_string()),
        ("units".to_owned(), about.units.clone()),
    ];
    metadata.extend(about.hand_file.clone().map(|text| ("hand_file".to_owned(), text)));
    metadata
}
