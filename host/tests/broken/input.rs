//! The table of broken inputs.

use serde::Deserialize;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// `expected.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Table {
    #[serde(rename = "input")]
    pub(crate) inputs: Vec<Input>,
}

/// A broken input, and what is said of it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Input {
    /// Its name.
    pub(crate) file: String,
    /// The fault.
    #[serde(rename = "what")]
    _what: String,
    /// The way in which it is made, if it is not beside the table.
    made: Option<Made>,
    /// A command that has to succeed first.
    pub(crate) first: Option<String>,
    /// The command, without `blindgrasp`.
    pub(crate) run: String,
    /// Its exit code.
    pub(crate) exit: i32,
    /// All of stderr.
    #[serde(default)]
    pub(crate) stderr: String,
    /// The last paragraph of stdout; without it, stdout is empty.
    pub(crate) findings: Option<String>,
}

/// A file that would be too large for the repository.
#[derive(Deserialize)]
#[serde(untagged, deny_unknown_fields)]
enum Made {
    /// A folder.
    Folder { folder: bool },
    /// So many zero bytes.
    Zeros { zeros: u64 },
    /// Another file of the table, and what stands behind it.
    Like { like: String, tail: String },
    /// A text with a piece that is repeated; `{k}` in it counts from 1.
    Text { head: String, piece: String, times: usize, tail: String },
}

impl Table {
    pub(crate) fn read(path: &Path) -> Self {
        toml::from_str(&fs::read_to_string(path).unwrap()).unwrap()
    }
}

impl Input {
    pub(crate) fn is_made(&self) -> bool {
        self.made.is_some()
    }

    /// Makes it; where it is.
    pub(crate) fn make(&self, folder: &Path) -> Option<PathBuf> {
        let path = folder.join(&self.file);
        match self.made.as_ref()? {
            Made::Folder { folder } => {
                assert!(folder);
                fs::create_dir(&path).unwrap();
            }
            Made::Zeros { zeros } => File::create(&path).unwrap().set_len(*zeros).unwrap(),
            Made::Like { like, tail } => {
                let text = fs::read_to_string(folder.join(like)).unwrap();
                fs::write(&path, text + tail).unwrap();
            }
            Made::Text { head, piece, times, tail } => {
                let mut file = BufWriter::new(File::create(&path).unwrap());
                file.write_all(head.as_bytes()).unwrap();
                let counts = piece.contains("{k}");
                for k in 1..=*times {
                    if counts {
                        file.write_all(piece.replace("{k}", &k.to_string()).as_bytes()).unwrap();
                    } else {
                        file.write_all(piece.as_bytes()).unwrap();
                    }
                }
                file.write_all(tail.as_bytes()).unwrap();
                file.flush().unwrap();
            }
        }
        Some(path)
    }
}
