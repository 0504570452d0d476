//! A pseudo-terminal: what a program opens like a serial port, with this process for its device.

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::pty::openpty;
use nix::sys::termios::{FlushArg, SetArg, cfmakeraw, tcflush, tcgetattr, tcsetattr};
use nix::unistd::ttyname;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::os::unix::fs::{OpenOptionsExt as _, symlink};
use std::path::{Path, PathBuf};

/// Most bytes that wait for a program that does not read for a while, besides the 12 KiB of a pseudo-terminal: what the kernel keeps of
/// a real port. At 3 Mbaud they are 0.2 s, for which a busy machine may well let a program wait.
const MOST_WAITING: usize = 1 << 16;

/// The device's end.
pub struct Pty {
    end: File,
    port: PathBuf,
    /// `true` if a program has opened the port, as far as is known.
    attended: bool,
    /// The bytes that the program has not taken yet.
    waiting: Vec<u8>,
    lost_bytes: u64,
}

impl Pty {
    /// Opens one that carries bytes as they are.
    ///
    /// # Errors
    /// If the operating system has none.
    pub fn open() -> io::Result<Self> {
        let pair = openpty(None, None)?;
        let mut settings = tcgetattr(&pair.slave)?;
        cfmakeraw(&mut settings);
        tcsetattr(&pair.slave, SetArg::TCSANOW, &settings)?;
        fcntl(&pair.master, FcntlArg::F_SETFL(OFlag::O_NONBLOCK))?;
        let port = ttyname(&pair.slave)?;
        // Only programs hold the other end, so that it is known whether one does.
        Ok(Self { end: File::from(pair.master), port, attended: false, waiting: Vec::new(), lost_bytes: 0 })
    }

    /// Returns the path that a program opens.
    pub fn port(&self) -> &Path {
        &self.port
    }

    /// Receives the bytes that came; nothing if nobody is there.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub fn receive(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let received = self.end.read(buffer);
        let is_attended = !received.as_ref().is_err_and(is_nobody);
        if std::mem::replace(&mut self.attended, is_attended) && !is_attended {
            self.forget()?;
        }
        match received {
            Err(error) if is_nobody(&error) || is_nothing(&error) => Ok(0),
            other => other,
        }
    }

    /// Throws away what the last program has not read: it must not wait for the next.
    fn forget(&mut self) -> io::Result<()> {
        self.waiting.clear();
        // From this end only a part can be reached.
        let flags = (OFlag::O_NOCTTY | OFlag::O_NONBLOCK).bits();
        let port = OpenOptions::new().read(true).custom_flags(flags).open(&self.port)?;
        tcflush(&port, FlushArg::TCIFLUSH)?;
        Ok(())
    }

    /// Sends bytes, and those that wait, if anybody was there when it was last looked whether something came. Nobody waits for a
    /// program that does not read: what there is no room for is lost, as on a wire.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        if !self.attended {
            return Ok(());
        }
        let taken = bytes.len().min(MOST_WAITING - self.waiting.len());
        self.waiting.extend_from_slice(&bytes[..taken]);
        self.lost_bytes += (bytes.len() - taken) as u64;
        if self.waiting.is_empty() {
            return Ok(());
        }
        match self.end.write(&self.waiting) {
            Ok(sent) => drop(self.waiting.drain(..sent)),
            Err(error) if is_nobody(&error) => self.waiting.clear(),
            Err(error) if is_nothing(&error) => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Returns the number of bytes that were lost because a program did not read.
    pub fn lost_bytes(&self) -> u64 {
        self.lost_bytes
    }
}

/// Returns `true` if no program has opened the port.
fn is_nobody(error: &io::Error) -> bool {
    error.raw_os_error() == Some(Errno::EIO as i32)
}

/// Returns `true` if there is nothing now.
fn is_nothing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// A symbolic link to a port, as long as it lives.
pub struct Link {
    path: PathBuf,
    port: PathBuf,
}

impl Link {
    /// Makes it, in place of another symbolic link.
    ///
    /// # Errors
    /// If something else is there, or it can't be made.
    pub fn new(path: &Path, port: &Path) -> io::Result<Self> {
        if fs::symlink_metadata(path).is_ok_and(|found| !found.is_symlink()) {
            return Err(io::Error::new(
                ErrorKind::AlreadyExists,
                "there is a file, which is not a symbolic link",
            ));
        }
        // Renamed, so that there is always one or the other.
        let mut aside = path.as_os_str().to_owned();
        aside.push(format!(".{}", std::process::id()));
        symlink(port, &aside)?;
        fs::rename(&aside, path).inspect_err(|_| {
            let _ = fs::remove_file(&aside);
        })?;
        Ok(Self { path: path.to_owned(), port: port.to_owned() })
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        // Somebody else may have put another in its place.
        if fs::read_link(&self.path).is_ok_and(|port| port == self.port) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_reads_late_gets_what_there_is_room_for_and_the_next_one_nothing() {
        let mut pty = Pty::open().expect("a pseudo-terminal");
        let open = |pty: &mut Pty| {
            let program = OpenOptions::new().read(true).write(true).open(pty.port()).expect("the port");
            pty.receive(&mut [0; 16]).expect("nothing is wrong");
            program
        };
        let mut program = open(&mut pty);
        let frame: Vec<u8> = (0..200).collect();
        for _ in 0..1000 {
            pty.send(&frame).expect("nothing is wrong");
        }
        let (mut read, mut buffer) = (Vec::new(), [0; 4096]);
        let lost = pty.lost_bytes() as usize;
        while read.len() < 200_000 - lost {
            let count = program.read(&mut buffer).expect("bytes");
            read.extend_from_slice(&buffer[..count]);
            pty.send(&[]).expect("nothing is wrong");
        }
        assert!((MOST_WAITING..MOST_WAITING + (1 << 15)).contains(&read.len()), "{} bytes", read.len());
        // In order up to the first that was lost; behind it the kernel may have made room in the middle of a frame.
        assert!(
            read.iter().zip(frame.iter().cycle()).take(MOST_WAITING).all(|(byte, expected)| byte == expected)
        );
        // What nobody has read is not for the next.
        for _ in 0..1000 {
            pty.send(&frame).expect("nothing is wrong");
        }
        drop(program);
        pty.receive(&mut buffer).expect("nothing is wrong");
        pty.send(&frame).expect("nothing is wrong");
        let mut program = open(&mut pty);
        pty.send(b"hello").expect("nothing is wrong");
        let count = program.read(&mut buffer).expect("bytes");
        assert_eq!(&buffer[..count], b"hello");
    }
}
