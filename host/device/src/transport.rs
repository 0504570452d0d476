//! Bytes to a device and back.

use super::interrupt;
use blindgrasp_shared::link::rate::{FASTER_BAUDS, FIRST_BAUD, Wanted};
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

/// Returns `true` if the other end is gone.
fn has_hung_up(error: &io::Error) -> bool {
    use io::ErrorKind::{BrokenPipe, ConnectionReset, UnexpectedEof};
    matches!(error.kind(), BrokenPipe | ConnectionReset | UnexpectedEof)
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

/// The exclusive lock on a port. An advisory one (`flock`), which picocom and pyserial respect, too: that of the terminal
/// itself (`TIOCEXCL`) does not keep root out, and stays on a pseudo-terminal when the program is killed.
#[cfg(unix)]
struct Lock {
    _file: std::fs::File,
}

#[cfg(unix)]
impl Lock {
    /// Takes it.
    ///
    /// # Errors
    /// If there is no such port, or another program has it: in words, and which one, if that is known.
    fn take(path: &Path) -> io::Result<Self> {
        use nix::fcntl::OFlag;
        use std::fs::{OpenOptions, TryLockError};
        use std::os::unix::fs::OpenOptionsExt as _;
        // Neither waits for a carrier nor makes it this program's terminal.
        let flags = (OFlag::O_NONBLOCK | OFlag::O_NOCTTY).bits();
        let file = OpenOptions::new().read(true).write(true).custom_flags(flags).open(path)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let who = holder(&file).unwrap_or_else(|| "another program".to_owned());
                let words = format!("it is in use by {who}: end that first");
                Err(io::Error::new(io::ErrorKind::ResourceBusy, words))
            }
            // Of a file system without locks nobody is kept out.
            Ok(()) | Err(TryLockError::Error(_)) => Ok(Self { _file: file }),
        }
    }
}

/// The program that has locked a file, as Linux tells it.
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
        return Some("this program itself".to_owned());
    }
    let name = std::fs::read_to_string(format!("/proc/{process}/comm")).ok()?;
    Some(format!("`{}`, process {process}", name.trim_end()))
}

/// Elsewhere a port is exclusive by itself.
#[cfg(not(unix))]
struct Lock;

#[cfg(not(unix))]
impl Lock {
    fn take(_path: &Path) -> io::Result<Self> {
        Ok(Self)
    }
}

/// The reason for which a serial port could not be opened.
#[derive(Debug, thiserror::Error)]
#[error("cannot open the serial port {}: {reason}; {}", .path.display(), ports(.known))]
pub struct OpenError {
    path: PathBuf,
    reason: io::Error,
    known: Vec<PathBuf>,
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
    /// Opens a port at the first rate: 8 bits, no parity, one stop bit.
    ///
    /// # Errors
    /// Why not, and which ports there are.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        // Locked before its settings are touched, which are the other program's, too.
        let opened = Lock::take(path).and_then(|_lock| {
            let port = serial2::SerialPort::open(path, FIRST_BAUD)?;
            Ok(Self { port, baud: FIRST_BAUD, _lock })
        });
        match opened {
            Ok(port) => Ok(port),
            Err(reason) => Err(OpenError { path: path.to_owned(), reason, known: known_ports() }),
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
        let error = SerialPort::open(Path::new("/dev/no-such-port")).err().unwrap().to_string();
        assert!(error.starts_with("cannot open the serial port /dev/no-such-port: "), "{error}");
        assert!(error.contains("this machine has "), "{error}");
    }
}
