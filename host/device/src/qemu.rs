//! QEMU as a process that runs an image: started, spoken to, and gone at the end, whatever the end is.
//!
//! It gets a process group of its own, which is killed when the value is dropped, and a folder of its own for pipes and
//! sockets, which is removed as soon as both ends are open. So if this process is killed itself, there is nothing left on
//! the disk; and the firmware finds its pipe closed and ends QEMU.

use super::image::Firmware;
use super::interrupt;
use super::transport::{Streams, Transport, TransportError};
use blindgrasp_files as files;
use nix::fcntl::OFlag;
use nix::sys::signal::{Signal, killpg};
use nix::sys::stat::Mode;
use nix::unistd::{Pid, mkdtemp, mkfifo};
use std::collections::VecDeque;
use std::fs::{self, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::os::unix::net::UnixListener;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// The program.
const PROGRAM: &str = "qemu-system-arm";
/// A board with the microcontroller that images are built for.
const MACHINE: &str = "netduinoplus2";
/// The most that is kept of QEMU's output, bytes.
const KEPT: usize = 4096;
/// The most that an error tells of it, characters.
const TOLD: usize = 400;
/// Longest time that a process that ends may take to be gone.
const GONE: Duration = Duration::from_millis(500);
/// Time between two looks.
const LOOK: Duration = Duration::from_millis(2);
/// Longest time that counting instructions may take.
const BENCH: Duration = Duration::from_secs(120);

/// The reason for which there is no emulated firmware.
#[derive(Debug, thiserror::Error)]
pub enum QemuError {
    /// It could not be started.
    #[error("cannot start {}", .0.display())]
    Start(PathBuf, #[source] io::Error),
    /// Its folder, pipes or socket could not be made or opened.
    #[error("cannot make or open the pipes to QEMU in {}", std::env::temp_dir().display())]
    Pipes(#[from] io::Error),
    /// It is not installed, the image is none, or the firmware does not do what it should.
    #[error("{0}")]
    Failed(String),
}

/// The way to run an image.
#[derive(Clone, Debug)]
pub struct Qemu {
    /// The program: a name that is looked for in PATH, or a path.
    pub program: PathBuf,
    /// Longest time that the firmware may take to start.
    pub patience: Duration,
    image: PathBuf,
}

impl Qemu {
    /// Of an image for processor in the loop.
    ///
    /// # Errors
    /// If the file is no such image.
    pub fn new(image: &Path, patience: Duration) -> Result<Self, QemuError> {
        let fail = |reason: String| Err(QemuError::Failed(format!("{}: {reason}", image.display())));
        let bytes = match files::read(image) {
            Ok(bytes) => bytes,
            Err(error) => return fail(error.to_string()),
        };
        match Firmware::parse(&bytes) {
            Err(error) => return fail(error.to_string()),
            Ok(Firmware { image, .. }) if image.kind != "pil" => {
                return fail(format!("this is {image}: a simulation needs the image `pil`"));
            }
            Ok(_) => {}
        }
        let image = match fs::canonicalize(image) {
            Ok(image) => image,
            Err(error) => return fail(error.to_string()),
        };
        Ok(Self { program: PROGRAM.into(), patience, image })
    }

    /// Starts it with two pipes to the firmware.
    ///
    /// # Errors
    /// If it does not start.
    pub fn with_pipes(&self) -> Result<Emulated, QemuError> {
        let folder = Folder::new()?;
        let [to, from] = ["to", "from"].map(|name| folder.0.join(name));
        for path in [&to, &from] {
            mkfifo(path, Mode::S_IRUSR | Mode::S_IWUSR).map_err(io::Error::from)?;
        }
        // Reading needs no writer to be there; writing does, which is how the firmware's start is seen.
        let flags = OFlag::O_NONBLOCK.bits();
        let from = OpenOptions::new().read(true).custom_flags(flags).open(from)?;
        let mut process = self.start(folder, &["null", "null"], "fifo,arg=to,arg=from", &[])?;
        let to = process.wait_for(self.patience, || {
            match OpenOptions::new().write(true).custom_flags(flags).open(&to) {
                Ok(file) => Ok(Some(file)),
                Err(error) if error.raw_os_error() == Some(nix::errno::Errno::ENXIO as i32) => Ok(None),
                Err(error) => Err(error),
            }
        })?;
        Ok(Emulated { streams: Box::new(Streams { from, to }), process })
    }

    /// Starts it with a socket to the firmware's serial port.
    ///
    /// # Errors
    /// If it does not start.
    pub fn with_uart(&self) -> Result<Emulated, QemuError> {
        let folder = Folder::new()?;
        let listener = UnixListener::bind(folder.0.join("uart"))?;
        listener.set_nonblocking(true)?;
        // The second serial port is USART2.
        let mut process = self.start(folder, &["null", "unix:uart"], "uart", &[])?;
        let socket = process.wait_for(self.patience, || match listener.accept() {
            Ok((socket, _)) => Ok(Some(socket)),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(None),
            Err(error) => Err(error),
        })?;
        socket.set_nonblocking(true)?;
        Ok(Emulated { streams: Box::new(Streams { from: socket.try_clone()?, to: socket }), process })
    }

    /// Lets the firmware count its own instructions: a JSON object, whose values are numbers.
    ///
    /// # Errors
    /// If it does not, or lacks one of the keys.
    pub fn bench(&self, keys: &[&str]) -> Result<serde_json::Map<String, serde_json::Value>, QemuError> {
        let folder = Folder::new()?;
        // 16 ns of the firmware's time for each instruction, whatever the time is here.
        let clock = ["-icount", "shift=4,sleep=off"];
        let mut process = self.start(folder, &["null", "null"], "bench", &clock)?;
        let status = process.wait_for_end(BENCH)?;
        let printed = process.stdout.text();
        if !status.success() {
            return Err(QemuError::Failed(process.said_at_end(status)));
        }
        let fail = |reason: String| {
            let said = process.said();
            Err(QemuError::Failed(format!("the firmware's figures can't be read: {reason}; {said}")))
        };
        let figures: serde_json::Map<_, _> = match serde_json::from_str(printed.trim()) {
            Ok(figures) => figures,
            Err(error) => return fail(error.to_string()),
        };
        for &key in keys {
            if !figures.get(key).is_some_and(serde_json::Value::is_u64) {
                return fail(format!("`{key}` is not among them"));
            }
        }
        Ok(figures)
    }

    fn start(
        &self,
        folder: Folder,
        serial_ports: &[&str],
        arguments: &str,
        options: &[&str],
    ) -> Result<Process, QemuError> {
        let mut command = Command::new(&self.program);
        command.args(["-M", MACHINE, "-nographic", "-monitor", "none"]);
        for port in serial_ports {
            command.args(["-serial", port]);
        }
        command.arg("-semihosting-config").arg(format!("enable=on,target=native,arg={arguments}"));
        command.args(options).arg("-kernel").arg(&self.image);
        // Names relative to the folder need no escapes, whatever is in its path.
        command.current_dir(&folder.0).process_group(0);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|source| match source.kind() {
            io::ErrorKind::NotFound => QemuError::Failed(format!(
                "{} is not installed, or not in PATH: `apt-get install qemu-system-arm` on Debian, `brew install qemu` on macOS; \
                 or use a real board with --port",
                self.program.display()
            )),
            _ => QemuError::Start(self.program.clone(), source),
        })?;
        let stdout = Tail::of(child.stdout.take());
        let stderr = Tail::of(child.stderr.take());
        Ok(Process { child, stdout, stderr, folder: Some(folder) })
    }
}

/// A firmware that runs in QEMU.
pub struct Emulated {
    streams: Box<dyn Transport>,
    process: Process,
}

impl Emulated {
    /// Number of the process.
    pub fn id(&self) -> u32 {
        self.process.child.id()
    }
}

impl Transport for Emulated {
    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), TransportError> {
        self.streams.send(bytes, deadline)
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> Result<usize, TransportError> {
        let count = self.streams.receive(buffer, deadline)?;
        // Who answers has opened all that it was to open.
        self.process.folder = None;
        Ok(count)
    }

    fn trouble(&mut self) -> Option<String> {
        // A process that has closed its pipes may take a moment to be gone.
        let deadline = Instant::now() + GONE;
        loop {
            match self.process.child.try_wait() {
                Ok(Some(status)) => return Some(self.process.said_at_end(status)),
                _ if Instant::now() >= deadline => return Some(self.process.said()),
                _ => thread::sleep(LOOK),
            }
        }
    }
}

/// A folder of its own, removed when it is dropped.
struct Folder(PathBuf);

impl Folder {
    fn new() -> io::Result<Self> {
        Ok(Self(mkdtemp(&std::env::temp_dir().join("blindgrasp-XXXXXX"))?))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// QEMU.
struct Process {
    child: Child,
    stdout: Tail,
    stderr: Tail,
    /// The folder of its pipes or its socket, until their names are needed no more.
    folder: Option<Folder>,
}

impl Process {
    /// Waits until something is there that QEMU makes.
    fn wait_for<T>(
        &mut self,
        patience: Duration,
        mut look: impl FnMut() -> io::Result<Option<T>>,
    ) -> Result<T, QemuError> {
        let deadline = Instant::now() + patience;
        loop {
            if let Some(found) = look()? {
                return Ok(found);
            }
            if let Some(status) = self.child.try_wait()? {
                return Err(QemuError::Failed(self.said_at_end(status)));
            }
            if interrupt::wanted() {
                return Err(QemuError::Failed("interrupted".to_owned()));
            }
            if Instant::now() >= deadline {
                return Err(self.timed_out(patience));
            }
            thread::sleep(LOOK);
        }
    }

    fn wait_for_end(&mut self, patience: Duration) -> Result<ExitStatus, QemuError> {
        let deadline = Instant::now() + patience;
        loop {
            if let Some(status) = self.child.try_wait()? {
                self.let_output_end();
                return Ok(status);
            }
            if interrupt::wanted() {
                return Err(QemuError::Failed("interrupted".to_owned()));
            }
            if Instant::now() >= deadline {
                return Err(self.timed_out(patience));
            }
            thread::sleep(LOOK);
        }
    }

    /// Waits for the output that is still on its way from a process that is gone.
    fn let_output_end(&self) {
        let deadline = Instant::now() + GONE;
        while !(self.stdout.is_done() && self.stderr.is_done()) && Instant::now() < deadline {
            thread::sleep(LOOK);
        }
    }

    fn said_at_end(&self, status: ExitStatus) -> String {
        self.let_output_end();
        format!("QEMU ended ({status}){}", self.printed())
    }

    fn said(&self) -> String {
        format!("QEMU still runs{}", self.printed())
    }

    fn timed_out(&self, patience: Duration) -> QemuError {
        let waited_s = patience.as_secs_f64();
        QemuError::Failed(format!("the firmware did not start within {waited_s} s; {}", self.said()))
    }

    /// The end of what it printed.
    fn printed(&self) -> String {
        let text = [&self.stderr, &self.stdout].map(Tail::text).join(" ");
        let line: Vec<char> = text
            .split(|c: char| c.is_whitespace() || c.is_control())
            .filter(|word| !word.is_empty())
            .fold(Vec::new(), |mut line, word| {
                if !line.is_empty() {
                    line.push(' ');
                }
                line.extend(word.chars());
                line
            });
        if line.is_empty() {
            return " and has printed nothing".to_owned();
        }
        let cut = line.len().saturating_sub(TOLD);
        let dots = if cut > 0 { "... " } else { "" };
        format!(" and has printed: {dots}{}", line[cut..].iter().collect::<String>())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Killed, a process that was stopped goes too. That there is none left is what is wanted.
        if let Ok(id) = i32::try_from(self.child.id()) {
            let _ = killpg(Pid::from_raw(id), Signal::SIGKILL);
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The end of what a process prints, read in a thread of its own.
struct Tail {
    bytes: Arc<Mutex<VecDeque<u8>>>,
    thread: Option<JoinHandle<()>>,
}

impl Tail {
    fn of(output: Option<impl Read + Send + 'static>) -> Self {
        let bytes = Arc::new(Mutex::new(VecDeque::new()));
        let kept = Arc::clone(&bytes);
        let thread = output.map(|mut output| {
            thread::spawn(move || {
                let mut buffer = [0; 1024];
                while let Ok(count @ 1..) = output.read(&mut buffer) {
                    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
                    kept.extend(&buffer[..count]);
                    let excess = kept.len().saturating_sub(KEPT);
                    kept.drain(..excess);
                }
            })
        });
        Self { bytes, thread }
    }

    fn is_done(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    fn text(&self) -> String {
        let bytes = self.bytes.lock().unwrap_or_else(PoisonError::into_inner);
        String::from_utf8_lossy(&bytes.iter().copied().collect::<Vec<_>>()).into_owned()
    }
}
