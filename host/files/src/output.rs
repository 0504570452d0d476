//! Files and folders that are written.

use super::{input, no_file};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;
use thiserror::Error;

/// Ending of the name of what is not whole yet.
const PARTIAL: &str = ".partial";
/// Name of the file in a folder that is not whole yet by which it is known, and which is locked; and of such a folder in one that
/// was there before.
const MARK: &str = ".partial";

/// The reason for which something can't be written.
#[derive(Debug, Error)]
pub enum OutputError {
    /// There is such a file.
    #[error("{}: is there already; choose another with --out, or overwrite it with --force", .0.display())]
    Exists(PathBuf),
    /// The folder has files in it.
    #[error("{}: not empty; choose another directory, or overwrite a run in it with --force", .0.display())]
    Occupied(PathBuf),
    /// It is what the command reads.
    #[error("{}: is what this command reads{}; choose another with --out", .path.display(), as_well(.path, .input))]
    IsInput {
        /// The file that was to be written.
        path: PathBuf,
        /// The name by which it was read.
        input: PathBuf,
    },
    /// Somebody writes it.
    #[error("{}: another program is writing it; wait for it, or choose another with --out", .0.display())]
    Busy(PathBuf),
    /// Something has the name that is needed until it is whole.
    #[error("{}: is in the way, and was not left by an interrupted command: move it away", .0.display())]
    InTheWay(PathBuf),
    /// The file system said no.
    #[error("cannot write {}", .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
}

fn as_well(path: &Path, input: &Path) -> String {
    if path == input { String::new() } else { format!(", as {}", input.display()) }
}

impl OutputError {
    fn of(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| {
            let has_no_folder = source.kind() == io::ErrorKind::NotFound
                && path.parent().is_some_and(|folder| folder != Path::new("") && !folder.exists());
            let source = if has_no_folder {
                io::Error::new(source.kind(), "there is no such folder; make it first")
            } else {
                source
            };
            Self::Io { path: path.to_owned(), source }
        }
    }
}

/// Files and folders of this process that are not whole yet. Whoever renames or removes one holds the lock.
static UNFINISHED: Mutex<Vec<Unfinished>> = Mutex::new(Vec::new());

struct Unfinished {
    partial: PathBuf,
    path: PathBuf,
}

fn unfinished() -> MutexGuard<'static, Vec<Unfinished>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is not whole yet, and ends the process by `end`, which is given the names that nothing has been written to.
/// For an interrupt: nothing is renamed any more.
pub fn abandon(end: impl FnOnce(&[PathBuf])) {
    let mut unfinished = unfinished();
    // Folders come before the files in them.
    for Unfinished { partial, .. } in unfinished.iter().rev() {
        remove(partial);
    }
    let paths: Vec<_> = unfinished.drain(..).map(|unfinished| unfinished.path).collect();
    end(&paths);
}

/// Removes a file or a folder, also one in which another thread still writes.
fn remove(partial: &Path) {
    for _ in 0..50 {
        let removed = if partial.is_dir() { fs::remove_dir_all(partial) } else { fs::remove_file(partial) };
        match removed {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                thread::sleep(Duration::from_millis(2));
            }
            _ => return,
        }
    }
}

/// Makes sure that a file may be written: before much time is spent on what is to be in it.
///
/// # Errors
/// It is there already, without `force`; it is what was read; somebody writes it; or it is a folder.
pub fn check(path: &Path, force: bool) -> Result<(), OutputError> {
    let metadata = match fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(OutputError::of(path)(error)),
    };
    if metadata.is_dir() {
        return Err(OutputError::of(path)(no_file(&metadata)));
    }
    if !metadata.is_file() {
        return Ok(());
    }
    if let Some(input) = input::that_is(path) {
        return Err(OutputError::IsInput { path: path.to_owned(), input });
    }
    if is_being_written(path) {
        return Err(OutputError::Busy(path.to_owned()));
    }
    if force && metadata.permissions().readonly() {
        return Err(OutputError::of(path)(io::Error::new(
            io::ErrorKind::PermissionDenied,
            "it is write-protected",
        )));
    }
    if force { Ok(()) } else { Err(OutputError::Exists(path.to_owned())) }
}

/// Returns `true` if a program of ours is writing a file at this moment.
pub fn is_being_written(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// Writes a file of these bytes.
///
/// # Errors
/// As [`NewFile::create`] and [`NewFile::finish`].
pub fn write(path: &Path, bytes: impl AsRef<[u8]>, force: bool) -> Result<(), OutputError> {
    let mut file = NewFile::create(path, force)?;
    file.write_all(bytes.as_ref()).map_err(OutputError::of(path))?;
    file.finish()
}

/// A file that gets its name when it is whole. One that is dropped before is removed.
#[derive(Debug)]
pub struct NewFile {
    file: File,
    path: PathBuf,
    force: bool,
    /// `true` if it is to take the place of a file that was read.
    replaces_input: bool,
    /// Its name until then; none of what has its own, as a device has from the beginning.
    partial: Option<PathBuf>,
}

impl NewFile {
    /// Begins a file. A name that is a symbolic link stays one; what it leads to is replaced.
    ///
    /// # Errors
    /// As [`check`]; or what the file system says.
    pub fn create(path: &Path, force: bool) -> Result<Self, OutputError> {
        let failed = OutputError::of(path);
        check(path, force)?;
        if fs::metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
            // A device or a pipe is nothing that could be replaced.
            let file = OpenOptions::new().write(true).open(path).map_err(failed)?;
            let path = path.to_owned();
            return Ok(Self { file, path, force, replaces_input: false, partial: None });
        }
        Self::begin(path, force, false)
    }

    /// Begins a file that takes the place of one that was read.
    ///
    /// # Errors
    /// What the file system says.
    pub fn in_place_of(path: &Path) -> Result<Self, OutputError> {
        Self::begin(path, true, true)
    }

    fn begin(path: &Path, force: bool, replaces_input: bool) -> Result<Self, OutputError> {
        let path = behind_links(path);
        let partial = beside(&path);
        // An interrupt comes before, and there is nothing, or after, and it is known.
        let mut unfinished = unfinished();
        let file = claim(&partial, &path)?;
        unfinished.push(Unfinished { partial: partial.clone(), path: path.clone() });
        drop(unfinished);
        Ok(Self { file, path, force, replaces_input, partial: Some(partial) })
    }

    /// The file itself.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Returns `true` if it has its own name.
    pub fn is_published(&self) -> bool {
        self.partial.is_none()
    }

    /// Gives the file its name: what is in it is whole.
    ///
    /// # Errors
    /// As [`Self::publish`].
    pub fn finish(mut self) -> Result<(), OutputError> {
        self.publish()
    }

    /// Gives the file its name, while more is to come, for a file that is whole at every moment. It stays locked.
    ///
    /// # Errors
    /// Something else is in its place meanwhile; or as the file system says.
    pub fn publish(&mut self) -> Result<(), OutputError> {
        let Some(partial) = &self.partial else { return Ok(()) };
        let failed = OutputError::of(&self.path);
        self.file.sync_all().map_err(&failed)?;
        if !self.replaces_input {
            check(&self.path, self.force)?;
        }
        let mut unfinished = unfinished();
        if self.force {
            fs::rename(partial, &self.path).map_err(&failed)?;
        } else {
            rename_to_new(partial, &self.path)?;
        }
        unfinished.retain(|other| other.partial != *partial);
        drop(unfinished);
        self.partial = None;
        // Elsewhere a lock keeps readers out, too.
        #[cfg(not(unix))]
        let _ = self.file.unlock();
        sync_folder(self.path.parent()).map_err(failed)
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for NewFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

impl Drop for NewFile {
    fn drop(&mut self) {
        if let Some(partial) = &self.partial {
            forget(partial);
        }
    }
}

/// A folder that gets its name when it is whole. One that is dropped before is removed.
#[derive(Debug)]
pub struct NewFolder {
    /// As it was given, for messages; and the whole path.
    given: PathBuf,
    path: PathBuf,
    partial: PathBuf,
    /// Keeps the mark locked.
    mark: File,
    force: bool,
    is_published: bool,
}

impl NewFolder {
    /// Begins a folder, and those above it. With `force`, files of the same names are replaced at the end, others left.
    ///
    /// # Errors
    /// The folder is not empty, without `force`; somebody writes it; or what the file system says.
    pub fn create(path: &Path, force: bool) -> Result<Self, OutputError> {
        let failed = OutputError::of(path);
        if !force && is_occupied(path) {
            return Err(OutputError::Occupied(path.to_owned()));
        }
        if fs::metadata(path).is_ok_and(|metadata| !metadata.is_dir()) {
            return Err(failed(io::ErrorKind::NotADirectory.into()));
        }
        let given = path.to_owned();
        // Of a folder that is there, its own is the only place that is surely on its disk: it may be a mount. Another has no full
        // stop or separator at its end, so that there is a name beside it.
        let (path, partial) = match fs::canonicalize(path) {
            Ok(whole) => (whole.clone(), whole.join(MARK)),
            Err(_) => {
                let path: PathBuf = path.components().collect();
                let partial = beside(&path);
                (path, partial)
            }
        };
        if let Some(above) = partial.parent() {
            fs::create_dir_all(above).map_err(&failed)?;
        }
        let mut unfinished = unfinished();
        let mark = claim_folder(&partial, &path)?;
        unfinished.push(Unfinished { partial: partial.clone(), path: path.clone() });
        drop(unfinished);
        Ok(Self { given, path, partial, mark, force, is_published: false })
    }

    /// Returns the folder that its files are written to.
    pub fn written_to(&self) -> &Path {
        &self.partial
    }

    /// Makes a folder in it, if it is not there.
    ///
    /// # Errors
    /// What the file system says.
    pub fn below(&self, name: &str) -> Result<PathBuf, OutputError> {
        let path = self.partial.join(name);
        fs::create_dir_all(&path).map_err(OutputError::of(&self.given.join(name)))?;
        Ok(path)
    }

    /// Writes one file of it.
    ///
    /// # Errors
    /// What the file system says; a full disk among others.
    pub fn write(
        &self,
        name: &str,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), OutputError> {
        let written = File::create(self.partial.join(name)).and_then(|file| {
            let mut file = io::BufWriter::new(file);
            fill(&mut file)?;
            file.flush()
        });
        written.map_err(OutputError::of(&self.given.join(name)))
    }

    /// Gives the folder its name; or, where there was one before, gives it the new files, each in one piece.
    ///
    /// # Errors
    /// What the file system says.
    pub fn finish(mut self) -> Result<(), OutputError> {
        let failed = OutputError::of(&self.given);
        sync_all_in(&self.partial).map_err(&failed)?;
        self.mark.sync_all().map_err(&failed)?;
        let mut unfinished = unfinished();
        #[cfg(not(unix))]
        let _ = fs::remove_file(self.partial.join(MARK));
        if self.partial.parent() == Some(&self.path) {
            if !self.force && is_occupied(&self.path) {
                return Err(OutputError::Occupied(self.given.clone()));
            }
            check_all(&self.partial, &self.path)?;
            move_into(&self.partial, &self.path).map_err(&failed)?;
        } else {
            fs::rename(&self.partial, &self.path).map_err(&failed)?;
            let _ = fs::remove_file(self.path.join(MARK));
        }
        unfinished.retain(|other| other.partial != self.partial);
        drop(unfinished);
        self.is_published = true;
        sync_folder(self.path.parent()).map_err(failed)
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        if !self.is_published {
            forget(&self.partial);
        }
    }
}

fn forget(partial: &Path) {
    let mut unfinished = unfinished();
    remove(partial);
    unfinished.retain(|other| other.partial != partial);
}

/// Returns the path that a symbolic link leads to, also to nothing yet; any other as it is.
fn behind_links(path: &Path) -> PathBuf {
    match (fs::canonicalize(path), fs::read_link(path)) {
        (Ok(whole), Ok(_)) => whole,
        (Err(_), Ok(target)) => path.parent().unwrap_or(Path::new("")).join(target),
        (_, Err(_)) => path.to_owned(),
    }
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.to_owned().into_os_string();
    name.push(PARTIAL);
    name.into()
}

/// Says what became of something that another program left. To the terminal, at once: whoever began the command sees it where
/// he wonders.
fn say_left_over(partial: &Path, path: &Path) {
    let (partial, path) = (partial.display(), path.display());
    eprintln!(
        "blindgrasp: {partial}: removed: a command that was killed while it wrote {path} had left it, incomplete"
    );
}

/// Makes a file that is this program's alone.
fn claim(partial: &Path, path: &Path) -> Result<File, OutputError> {
    let failed = OutputError::of(path);
    let busy = || OutputError::Busy(path.to_owned());
    for _ in 0..16 {
        match OpenOptions::new().read(true).write(true).create_new(true).open(partial) {
            Ok(file) => {
                // Another may have taken it for one that was left.
                if is_locked_by_others(&file) || !is_at(&file, partial) {
                    return Err(busy());
                }
                return Ok(file);
            }
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(failed(error)),
        }
        if fs::symlink_metadata(partial).is_ok_and(|metadata| !metadata.is_file()) {
            return Err(OutputError::InTheWay(partial.to_owned()));
        }
        let left_over = match File::open(partial) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(failed(error)),
        };
        if is_locked_by_others(&left_over) {
            return Err(busy());
        }
        if is_at(&left_over, partial) {
            // Removed, not emptied: the same file may have another name.
            fs::remove_file(partial).map_err(&failed)?;
            say_left_over(partial, path);
        }
    }
    Err(busy())
}

/// Makes a folder that is this program's alone; returns its mark.
fn claim_folder(partial: &Path, path: &Path) -> Result<File, OutputError> {
    let failed = OutputError::of(path);
    let mark = partial.join(MARK);
    match fs::create_dir(partial) {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            let is_empty = fs::read_dir(partial).is_ok_and(|mut entries| entries.next().is_none());
            if !is_empty {
                let Ok(left_over) = File::open(&mark) else {
                    return Err(OutputError::InTheWay(partial.to_owned()));
                };
                if is_locked_by_others(&left_over) {
                    return Err(OutputError::Busy(path.to_owned()));
                }
                fs::remove_dir_all(partial).map_err(&failed)?;
                say_left_over(partial, path);
                fs::create_dir(partial).map_err(&failed)?;
            }
        }
        Err(error) => return Err(failed(error)),
    }
    let file = OpenOptions::new().write(true).create_new(true).open(&mark).map_err(failed)?;
    if is_locked_by_others(&file) { Err(OutputError::Busy(path.to_owned())) } else { Ok(file) }
}

/// Takes the lock of a file; of a file system without locks nobody is kept out.
fn is_locked_by_others(file: &File) -> bool {
    matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}

/// Returns `true` if an open file still has this name.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let identity = |of: fs::Metadata| (of.dev(), of.ino());
    let there = fs::symlink_metadata(path).map(identity).ok();
    there.is_some() && there == file.metadata().map(identity).ok()
}

#[cfg(not(unix))]
fn is_at(_file: &File, path: &Path) -> bool {
    path.exists()
}

/// Renames a file, but not over another.
fn rename_to_new(from: &Path, to: &Path) -> Result<(), OutputError> {
    let failed = OutputError::of(to);
    match fs::hard_link(from, to) {
        Ok(()) => fs::remove_file(from).map_err(failed),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(OutputError::Exists(to.to_owned())),
        // A file system without hard links.
        Err(_) => fs::rename(from, to).map_err(failed),
    }
}

/// Makes sure that everything that is in one folder may be moved into another, before anything is.
fn check_all(from: &Path, to: &Path) -> Result<(), OutputError> {
    for entry in fs::read_dir(from).map_err(OutputError::of(from))?.flatten() {
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if entry.file_name() == MARK {
            continue;
        }
        if !from.is_dir() {
            check(&to, true)?;
            if let Some(other) = fs::metadata(&to).ok().filter(|there| !there.is_file()) {
                return Err(OutputError::of(&to)(no_file(&other)));
            }
        } else if to.is_dir() {
            check_all(&from, &to)?;
        }
    }
    Ok(())
}

/// Returns `true` if a folder has files in it, other than of a run that is not whole.
fn is_occupied(folder: &Path) -> bool {
    fs::read_dir(folder)
        .is_ok_and(|mut entries| entries.any(|entry| entry.is_ok_and(|entry| entry.file_name() != MARK)))
}

/// Moves everything that is in one folder into another, file by file, and removes it with its mark.
fn move_into(from: &Path, to: &Path) -> io::Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        if entry.file_name() == MARK {
            fs::remove_file(entry.path())?;
            continue;
        }
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if entry.file_type()?.is_dir() && to.is_dir() {
            move_into(&from, &to)?;
        } else {
            fs::rename(&from, &to)?;
        }
    }
    fs::remove_dir(from)
}

/// Hands all files of a folder to the disk.
fn sync_all_in(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_all_in(&entry.path())?;
        } else {
            File::open(entry.path())?.sync_all()?;
        }
    }
    sync_folder(Some(folder))
}

/// Hands the names in a folder to the disk.
fn sync_folder(folder: Option<&Path>) -> io::Result<()> {
    #[cfg(unix)]
    if let Some(folder) = folder {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        match File::open(folder).and_then(|folder| folder.sync_all()) {
            // Not every file system does that.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {}
            synced => synced?,
        }
    }
    #[cfg(not(unix))]
    let _ = folder;
    Ok(())
}
