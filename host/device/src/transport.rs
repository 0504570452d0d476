//! Bytes to a device and back.

use super::interrupt;
use blindgrasp_shared::link::rate::{FASTER_BAUDS, Wanted};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Longest time for which nothing is looked at but the line.
const SLICE: Duration = Duration::from_millis(100);

/// The reason for which bytes could not be sent or received.
#[derive(Debug, thiserror::Error)]
pub enum TransportError {
    /// Nothing came in time.
    #[error("nothing came in time")]
    TimedOut,
    /// The device hung up.
    #[error("the device hung up")]
    Closed,
    /// The user wanted an end.
    #[error("interrupted")]
    Interrupted,
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// A way to a device and back that keeps the order of the bytes.
pub trait Transport {
    /// Sends all the bytes.
    ///
    /// # Errors
    /// If they are not all taken by `deadline`.
    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), TransportError>;

    /// Waits for bytes; returns how many there are, at least one.
    ///
    /// # Errors
    /// If there are none by `deadline`.
    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> Result<usize, TransportError>;

    /// Rates that it can have besides the first.
    fn bauds(&mut self) -> Wanted {
        [None; FASTER_BAUDS.len()]
    }

    /// Changes the rate, once what was sent has left.
    ///
    /// # Errors
    /// If it can't have it.
    fn set_baud(&mut self, _baud: u32) -> Result<(), TransportError> {
        Ok(())
    }

    /// Returns the known trouble of the other end that may explain a failure: a sentence or more.
    fn trouble(&mut self) -> Option<String> {
        None
    }
}

impl<T: Transport + ?Sized> Transport for Box<T> {
    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), TransportError> {
        (**self).send(bytes, deadline)
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> Result<usize, TransportError> {
        (**self).receive(buffer, deadline)
    }

    fn bauds(&mut self) -> Wanted {
        (**self).bauds()
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), TransportError> {
        (**self).set_baud(baud)
    }

    fn trouble(&mut self) -> Option<String> {
        (**self).trouble()
    }
}

/// Returns the time that is left until the deadline, at most a slice of it.
fn slice(deadline: Instant) -> Result<Duration, TransportError> {
    if interrupt::wanted() {
        return Err(TransportError::Interrupted);
    }
    match deadline.saturating_duration_since(Instant::now()) {
        Duration::ZERO => Err(TransportError::TimedOut),
        left => Ok(left.min(SLICE)),
    }
}

/// Files that never block, one to read from and one to write to: pipes, or both ends of a socket.
#[cfg(unix)]
pub(super) struct Streams<R, W> {
    pub(super) from: R,
    pub(super) to: W,
}

#[cfg(unix)]
impl<R: io::Read + std::os::fd::AsFd, W: io::Write + std::os::fd::AsFd> Transport for Streams<R, W> {
    fn send(&mut self, mut bytes: &[u8], deadline: Instant) -> Result<(), TransportError> {
        use nix::poll::PollFlags;
        while !bytes.is_empty() {
            match self.to.write(bytes) {
                Ok(0) => return Err(TransportError::Closed),
                Ok(sent) => bytes = &bytes[sent..],
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    wait_for(&self.to, PollFlags::POLLOUT, deadline)?;
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if has_hung_up(&error) => return Err(TransportError::Closed),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> Result<usize, TransportError> {
        use nix::poll::PollFlags;
        loop {
            wait_for(&self.from, PollFlags::POLLIN, deadline)?;
            match self.from.read(buffer) {
                Ok(0) => return Err(TransportError::Closed),
                Ok(count) => return Ok(count),
                Err(error)
                    if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {}
                Err(error) if has_hung_up(&error) => return Err(TransportError::Closed),
                Err(error) => return Err(error.into()),
            }
        }
    }
}

/// Returns `true` if the other end is gone: a socket's, a pseudo-terminal's, or an adapter that was unplugged.
fn has_hung_up(error: &io::Error) -> bool {
    use io::ErrorKind::{BrokenPipe, ConnectionReset, UnexpectedEof};
    #[cfg(unix)]
    let is_unplugged = {
        use nix::errno::Errno::{EIO, ENODEV, ENXIO};
        error
            .raw_os_error()
            .is_some_and(|code| [EIO, ENODEV, ENXIO].map(|errno| errno as i32).contains(&code))
    };
    #[cfg(not(unix))]
    let is_unplugged = false;
    is_unplugged || matches!(error.kind(), BrokenPipe | ConnectionReset | UnexpectedEof)
}

/// Waits until a file can be read or written, or its other end is gone.
#[cfg(unix)]
fn wait_for(
    file: &impl std::os::fd::AsFd,
    flags: nix::poll::PollFlags,
    deadline: Instant,
) -> Result<(), TransportError> {
    use nix::errno::Errno;
    use nix::poll::{PollFd, PollTimeout, poll};
    loop {
        // Up to the next whole millisecond, so that the last wait is not cut into many of none.
        let left = slice(deadline)? + Duration::from_micros(999);
        let timeout = PollTimeout::try_from(left).unwrap_or(PollTimeout::MAX);
        match poll(&mut [PollFd::new(file.as_fd(), flags)], timeout) {
            Ok(0) | Err(Errno::EINTR) => {}
            Ok(_) => return Ok(()),
            Err(error) => return Err(TransportError::Io(error.into())),
        }
    }
}

/// A serial port, which no other program has as long as it lives.
pub struct SerialPort {
    port: serial2::SerialPort,
    baud: u32,
    _lock: Lock,
}

/// The exclusive lock on a port, under whatever name: it is on the device's node, to which links lead. An advisory one
/// (`flock`), which picocom, tio and pyserial respect, too: that of the terminal itself (`TIOCEXCL`) does not keep root out, and
/// stays on a pseudo-terminal when the program is killed; lock files (`/var/lock/LCK..*`) stay, too, and know one name only.
#[cfg(unix)]
struct Lock {
    _file: std::fs::File,
}

#[cfg(unix)]
impl Lock {
    /// Takes it.
    ///
    /// # Errors
    /// If there is no such port, or another program has it.
    fn take(path: &Path) -> Result<Self, OpenError> {
        use nix::fcntl::OFlag;
        use std::fs::{OpenOptions, TryLockError};
        use std::os::unix::fs::{FileTypeExt as _, OpenOptionsExt as _};
        let failed = |reason| OpenError::of(path, reason);
        let kind = std::fs::metadata(path).map_err(failed)?.file_type();
        if !kind.is_char_device() {
            return Err(OpenError::no_serial_port(path, kind.is_socket()));
        }
        // Neither waits for a carrier nor makes it this program's terminal.
        let flags = (OFlag::O_NONBLOCK | OFlag::O_NOCTTY).bits();
        let opened = OpenOptions::new().read(true).write(true).custom_flags(flags).open(path);
        let file = opened.map_err(failed)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => Err(OpenError::InUse {
                path: path.to_owned(),
                by: holder(&file).unwrap_or(ANOTHER.to_owned()),
            }),
            // Of a file system without locks nobody is kept out.
            Ok(()) | Err(TryLockError::Error(_)) => Ok(Self { _file: file }),
        }
    }
}

/// The program that has locked a file, as Linux tells it, and what to do.
#[cfg(unix)]
fn holder(file: &std::fs::File) -> Option<String> {
    use std::os::unix::fs::MetadataExt as _;
    let about = file.metadata().ok()?;
    // The kernel's 12 and 20 bits.
    let (device, inode) = (about.dev(), about.ino());
    let (major, minor) = ((device >> 8) & 0xfff, (device & 0xff) | ((device >> 12) & 0xf_ff00));
    let place = format!("{major:02x}:{minor:02x}:{inode}");
    let locks = std::fs::read_to_string("/proc/locks").ok()?;
    // 1: FLOCK ADVISORY WRITE 1234 00:1a:3 0 EOF
    let locks = locks.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    let process = locks
        .filter(|words| words.get(5) == Some(&place.as_str()))
        .find_map(|words| words.get(4)?.parse::<u32>().ok().filter(|&process| process > 0))?;
    if process == std::process::id() {
        return Some("this program, under another name; name it once".to_owned());
    }
    let name = std::fs::read_to_string(format!("/proc/{process}/comm")).ok()?;
    Some(format!("`{}`, process {process}; stop that first", name.trim_end().escape_debug()))
}

/// Elsewhere a port is exclusive by itself.
#[cfg(not(unix))]
struct Lock;

#[cfg(not(unix))]
impl Lock {
    fn take(_path: &Path) -> Result<Self, OpenError> {
        Ok(Self)
    }
}

/// A program of which nothing else is known, and what to do.
const ANOTHER: &str = "another program; stop that first";

/// The reason for which a serial port could not be opened, with the remedy.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// Another program has it.
    #[error("cannot open the serial port {}: it is in use by {by}", .path.display())]
    InUse {
        /// The port.
        path: PathBuf,
        /// The program, and the remedy.
        by: String,
    },
    /// There is none of that name, or not any more.
    #[error("cannot open the serial port {}: there is no such port; {}", .path.display(), ports(.known))]
    NoSuchPort {
        /// The port.
        path: PathBuf,
        /// The ports that there are.
        known: Vec<PathBuf>,
    },
    /// It is something else.
    #[error("cannot open the serial port {}: it is not a serial port; {remedy}", .path.display())]
    NoSerialPort {
        /// The path.
        path: PathBuf,
        /// The remedy.
        remedy: String,
    },
    /// The user has no right to it.
    #[error("cannot open the serial port {}: you have no right to; {remedy}", .path.display())]
    NotAllowed {
        /// The port.
        path: PathBuf,
        /// The remedy.
        remedy: String,
    },
    /// The adapter can't do the rate.
    #[error(
        "cannot open the serial port {}: it can't do {baud} baud, at which the hand begins; take an adapter that can", .path.display()
    )]
    NoSuchRate {
        /// The port.
        path: PathBuf,
        /// The rate.
        baud: u32,
    },
    /// Something else.
    #[error("cannot open the serial port {}: {reason}; {}", .path.display(), ports(.known))]
    Other {
        /// The port.
        path: PathBuf,
        /// The error of the operating system.
        reason: io::Error,
        /// The ports that there are.
        known: Vec<PathBuf>,
    },
}

impl OpenError {
    /// Returns the error of a port that tells what to do about the operating system's.
    fn of(path: &Path, reason: io::Error) -> Self {
        use io::ErrorKind::{NotFound, PermissionDenied, ResourceBusy};
        let path = path.to_owned();
        match reason.kind() {
            NotFound => Self::NoSuchPort { path, known: known_ports() },
            ResourceBusy => Self::InUse { path, by: ANOTHER.to_owned() },
            // Windows says so of a port in use.
            PermissionDenied if cfg!(windows) => Self::InUse { path, by: ANOTHER.to_owned() },
            PermissionDenied => Self::NotAllowed { remedy: right_to(&path), path },
            _ if is_no_terminal(&reason) => Self::no_serial_port(&path, false),
            _ => Self::Other { path, reason, known: known_ports() },
        }
    }

    fn no_serial_port(path: &Path, is_socket: bool) -> Self {
        let remedy = match is_socket {
            true => format!("it is a socket: name it as unix:{}", path.display()),
            false => ports_in_words(),
        };
        Self::NoSerialPort { path: path.to_owned(), remedy }
    }
}

/// Returns `true` if the operating system says that it is something else than a terminal.
#[cfg(unix)]
fn is_no_terminal(error: &io::Error) -> bool {
    error.raw_os_error() == Some(nix::errno::Errno::ENOTTY as i32)
}

#[cfg(not(unix))]
fn is_no_terminal(_error: &io::Error) -> bool {
    false
}

/// Returns the way to get the right to a port, in words.
#[cfg(unix)]
fn right_to(path: &Path) -> String {
    use std::os::unix::fs::MetadataExt as _;
    let about = std::fs::metadata(path).ok();
    let group = about
        .filter(|about| about.mode() & 0o060 == 0o060 && about.gid() != 0)
        .and_then(|about| nix::unistd::Group::from_gid(about.gid().into()).ok().flatten());
    match group {
        Some(nix::unistd::Group { name, .. }) => format!(
            "it is for the group `{name}`: `sudo usermod -aG {name} $USER`, then log out and in again"
        ),
        None => "its owner may open it: a udev rule can give it to a group, such as `dialout`".to_owned(),
    }
}

#[cfg(not(unix))]
fn right_to(_path: &Path) -> String {
    "ask whoever administers this machine".to_owned()
}

/// The serial ports of this machine, in order.
fn known_ports() -> Vec<PathBuf> {
    let mut known = serial2::SerialPort::available_ports().unwrap_or_default();
    known.sort();
    known
}

/// Returns the serial ports of this machine, in words: `this machine has ...`.
pub fn ports_in_words() -> String {
    ports(&known_ports())
}

fn ports(known: &[PathBuf]) -> String {
    if known.is_empty() {
        return "this machine has no serial ports".to_owned();
    }
    let names: Vec<String> = known.iter().map(|path| path.display().to_string()).collect();
    format!("this machine has the serial ports {}", names.join(", "))
}

impl SerialPort {
    /// Opens a port at a rate: 8 bits, no parity, one stop bit.
    ///
    /// # Errors
    /// Why not, and what to do.
    pub fn open(path: &Path, baud: u32) -> Result<Self, OpenError> {
        // Locked before its settings are touched, which are the other program's, too.
        let lock = Lock::take(path)?;
        let raw = |mut settings: serial2::Settings| {
            settings.set_raw();
            Ok(settings)
        };
        let port = serial2::SerialPort::open(path, raw).map_err(|reason| OpenError::of(path, reason))?;
        let mut port = Self { port, baud, _lock: lock };
        match port.apply(baud) {
            Ok(()) => Ok(port),
            Err(_) => Err(OpenError::NoSuchRate { path: path.to_owned(), baud }),
        }
    }

    /// Tells the driver, which answers with what the adapter really does.
    fn apply(&mut self, baud: u32) -> io::Result<()> {
        let mut settings = self.port.get_configuration()?;
        settings.set_baud_rate(baud)?;
        self.port.set_configuration(&settings)?;
        let real = self.port.get_configuration()?.get_baud_rate()?;
        if real.abs_diff(baud) > baud / 100 {
            let words = format!("the adapter has {real} baud where {baud} were wanted");
            return Err(io::Error::new(io::ErrorKind::Unsupported, words));
        }
        self.baud = baud;
        Ok(())
    }
}

impl Transport for SerialPort {
    fn bauds(&mut self) -> Wanted {
        let before = self.baud;
        let bauds = FASTER_BAUDS.map(|baud| self.apply(baud).is_ok().then_some(baud));
        // It was so a moment ago.
        let _ = self.apply(before);
        bauds
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), TransportError> {
        if baud != self.baud {
            self.apply(baud)?;
        }
        Ok(())
    }

    fn send(&mut self, mut bytes: &[u8], deadline: Instant) -> Result<(), TransportError> {
        while !bytes.is_empty() {
            self.port.set_write_timeout(slice(deadline)?)?;
            match self.port.write(bytes) {
                Ok(0) => return Err(TransportError::Closed),
                Ok(sent) => bytes = &bytes[sent..],
                Err(error) if is_timeout(&error) => {}
                Err(error) if has_hung_up(&error) => return Err(TransportError::Closed),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> Result<usize, TransportError> {
        loop {
            self.port.set_read_timeout(slice(deadline)?)?;
            match self.port.read(buffer) {
                Ok(0) => return Err(TransportError::Closed),
                Ok(count) => return Ok(count),
                Err(error) if is_timeout(&error) => {}
                Err(error) if has_hung_up(&error) => return Err(TransportError::Closed),
                Err(error) => return Err(error.into()),
            }
        }
    }
}

/// Returns `true` if the time was up, which is looked at elsewhere.
fn is_timeout(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), TimedOut | WouldBlock | Interrupted)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use blindgrasp_shared::link::rate::FIRST_BAUD;
    use std::os::unix::net::UnixStream;

    fn pair() -> (Streams<UnixStream, UnixStream>, UnixStream) {
        let (here, there) = UnixStream::pair().expect("a pair");
        here.set_nonblocking(true).expect("a socket");
        (Streams { from: here.try_clone().expect("a socket"), to: here }, there)
    }

    fn soon() -> Instant {
        Instant::now() + Duration::from_millis(50)
    }

    #[test]
    fn a_refusal_of_the_operating_system_is_told_with_what_to_do() {
        use nix::errno::Errno;
        use std::os::unix::fs::PermissionsExt as _;
        let told = |path: &Path, errno: Errno| OpenError::of(path, errno.into()).to_string();
        let folder = tempfile::TempDir::new().expect("a folder");
        let path = folder.path().join("port");
        std::fs::write(&path, "").expect("a file");
        let mode = |mode| {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).expect("a mode");
        };
        mode(0o600);
        let words = told(&path, Errno::EACCES);
        assert!(words.ends_with(": you have no right to; its owner may open it: a udev rule can give it to a group, such as `dialout`"), "{words}");
        // Of a group that everybody knows, on a file system that takes it.
        mode(0o660);
        if std::os::unix::fs::chown(&path, None, Some(1)).is_ok() {
            let name = nix::unistd::Group::from_gid(1.into())
                .expect("groups")
                .map_or(String::new(), |group| group.name);
            let words = told(&path, Errno::EACCES);
            assert!(
                words.ends_with(&format!("`sudo usermod -aG {name} $USER`, then log out and in again")),
                "{words}"
            );
        }
        let words = told(&path, Errno::EBUSY);
        assert!(words.ends_with(": it is in use by another program; stop that first"), "{words}");
        let words = told(&path, Errno::ENOENT);
        assert!(words.contains(": there is no such port; this machine has "), "{words}");
        let words = OpenError::NoSuchRate { path, baud: FIRST_BAUD }.to_string();
        assert!(words.contains(": it can't do 1000000 baud, at which the hand begins; take "), "{words}");
    }

    #[test]
    fn what_is_sent_arrives_in_both_directions() {
        use std::io::{Read, Write};
        let (mut here, mut there) = pair();
        here.send(b"ping", soon()).unwrap();
        let mut buffer = [0; 16];
        assert_eq!(there.read(&mut buffer).unwrap(), 4);
        there.write_all(b"pong!").unwrap();
        assert_eq!(here.receive(&mut buffer, soon()).unwrap(), 5);
        assert_eq!(&buffer[..5], b"pong!");
    }

    #[test]
    fn silence_and_a_full_line_end_at_the_deadline() {
        let (mut here, _there) = pair();
        let begun = Instant::now();
        assert!(matches!(here.receive(&mut [0; 4], soon()), Err(TransportError::TimedOut)));
        let lots = vec![0; 1 << 24];
        assert!(matches!(here.send(&lots, soon()), Err(TransportError::TimedOut)));
        assert!(begun.elapsed() >= Duration::from_millis(100) && begun.elapsed() < Duration::from_secs(5));
    }

    #[test]
    fn an_end_that_is_gone_is_noticed_at_once() {
        let (mut here, there) = pair();
        drop(there);
        let deadline = Instant::now() + Duration::from_secs(60);
        assert!(matches!(here.receive(&mut [0; 4], deadline), Err(TransportError::Closed)));
        assert!(matches!(here.send(b"hello", deadline), Err(TransportError::Closed)));
    }

    #[test]
    fn a_port_that_is_not_there_is_told_with_those_that_are() {
        let error = SerialPort::open(Path::new("/dev/no-such-port"), FIRST_BAUD).err().unwrap().to_string();
        assert!(error.starts_with("cannot open the serial port /dev/no-such-port: "), "{error}");
        assert!(error.contains("this machine has "), "{error}");
    }
}
