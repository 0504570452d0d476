//! The command as a user gives it, and a folder for its files.

use std::fs;
use std::process::{Command, Output};
use tempfile::TempDir;

/// A folder that goes with the test.
pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    pub(crate) fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().expect("UTF-8").to_owned()
    }

    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).expect("a file")
    }

    /// Writes a file, also below folders that are not there; returns its path.
    pub(crate) fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> String {
        let path = self.0.path().join(name);
        fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        fs::write(&path, contents).expect("a file");
        self.path(name)
    }

    /// Runs the command in the folder, which is where images are looked for too.
    pub(crate) fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_blindgrasp"));
        command.current_dir(&self.0).env("CARGO_TARGET_DIR", self.0.path());
        command.args(arguments).output().expect("the command starts")
    }

    /// Returns what a command prints that has to succeed, on stdout and stderr.
    pub(crate) fn done(&self, arguments: &[&str]) -> (String, String) {
        let output = self.run(arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {error}");
        (text(&output.stdout), error)
    }

    /// Checks that a command has exit code 2, prints nothing, and says all of these words in one line, which it returns; what
    /// the parser of the command line says has its usage behind it.
    pub(crate) fn refused(&self, arguments: &[&str], words: &[&str]) -> String {
        let output = self.run(arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        let lines = error.lines().filter(|line| !line.contains("warning")).count();
        assert!(lines == 1 || error.contains("--help"), "{arguments:?}: {error}");
        for word in words {
            assert!(error.contains(word), "{arguments:?}: no `{word}` in: {error}");
        }
        error.trim_end().to_owned()
    }
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}
