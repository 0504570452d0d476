//! The image `hand`, running in QEMU, with its serial line and a look at its clock from outside.
//!
//! Time, where it matters: QEMU lets a fixed time pass for each instruction (`-icount`), and where the processor sleeps it
//! goes on to the next interrupt at once (`sleep=off`). So the firmware's time does not depend on how busy this machine is.

use blindgrasp::device::transport::{Transport, TransportError};
use object::{Object, ObjectSymbol};
use std::collections::VecDeque;
use std::fs;
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longest time that QEMU may take to start.
const START: Duration = Duration::from_secs(20);
/// Longest time that its monitor may take to answer.
const MONITOR: Duration = Duration::from_secs(20);
/// Counter of TIM2. QEMU's model counts nanoseconds of the firmware's time from the start, enabled or not, modulo 2^32.
const NANOSECONDS: u32 = 0x4000_0024;
/// Name of the variable that counts the turns of the control task, as it ends in the symbol.
const TICKS: &str = "schedule::TICKS";

/// A board in QEMU. It is gone when this is dropped, and also when this process is killed.
pub struct Board {
    qemu: Child,
    /// Ends QEMU when the end of its input says that this process is gone.
    guard: Child,
    line: UnixStream,
    /// The bytes that the line has brought: it is always read at once, because QEMU stands still, monitor and all, when
    /// a byte that its board sends finds no room.
    received: Receiver<Vec<u8>>,
    /// The bytes of it that were not yet asked for.
    rest: VecDeque<u8>,
    monitor: BufReader<UnixStream>,
    ticks_at: u32,
    _folder: TempDir,
}

/// The clock that a board's time follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// The time here.
    World,
    /// Its instructions: each takes so many ns, a power of two.
    Instructions {
        /// Nanoseconds.
        each_ns: u32,
    },
}

/// The board's time, as seen at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Instants {
    /// Its clock, ns, modulo 2^32.
    pub nanoseconds: u32,
    /// Turns of its control task.
    pub ticks: u32,
}

impl Board {
    /// Starts an image.
    pub fn start(image: &Path, pace: Pace) -> Self {
        let elf = fs::read(image).expect("the image can be read");
        let folder = TempDir::with_prefix("blindgrasp-").expect("a folder for sockets");
        let listen = |name| UnixListener::bind(folder.path().join(name)).expect("a socket");
        let (line, monitor) = (listen("line"), listen("monitor"));
        let icount = match pace {
            Pace::World => Vec::new(),
            Pace::Instructions { each_ns } => {
                vec!["-icount".to_owned(), format!("shift={},sleep=off", each_ns.ilog2())]
            }
        };
        // The second serial port is USART2.
        let mut qemu = Command::new("qemu-system-arm")
            .args(["-M", "netduinoplus2", "-nographic", "-monitor", "none", "-serial", "null"])
            .args(["-serial", "unix:line", "-qmp", "unix:monitor"])
            .args(icount)
            .arg("-kernel")
            .arg(image)
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .expect("qemu-system-arm starts");
        let guard = Command::new("sh")
            .args(["-c", "read -r line; kill -9 \"$0\" 2>/dev/null", &qemu.id().to_string()])
            .stdin(Stdio::piped())
            .spawn()
            .expect("sh starts");
        let [line, monitor] = [line, monitor].map(|listener| accept(&listener, &mut qemu));
        monitor.set_read_timeout(Some(MONITOR)).expect("a socket takes a timeout");
        let received = read_on(line.try_clone().expect("a socket"));
        let mut board = Self {
            qemu,
            guard,
            line,
            received,
            rest: VecDeque::new(),
            monitor: BufReader::new(monitor),
            ticks_at: address(&elf, TICKS),
            _folder: folder,
        };
        board.tell("qmp_capabilities", "");
        board
    }

    /// Clock and turns at one instant: the board stands still meanwhile.
    pub fn instants(&mut self) -> Instants {
        self.tell("stop", "");
        let instants = Instants { nanoseconds: self.word(NANOSECONDS), ticks: self.word(self.ticks_at) };
        self.tell("cont", "");
        instants
    }

    /// A word of the board's memory.
    fn word(&mut self, address: u32) -> u32 {
        let answer = self.tell(
            "human-monitor-command",
            &format!(r#", "arguments": {{"command-line": "xp /1wx {address:#x}"}}"#),
        );
        let digits = answer.split(": 0x").nth(1).and_then(|rest| rest.get(..8));
        let word = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
        word.unwrap_or_else(|| panic!("{answer}"))
    }

    /// Tells QEMU's monitor something and returns its answer.
    fn tell(&mut self, command: &str, arguments: &str) -> String {
        let text = format!("{{\"execute\": \"{command}\"{arguments}}}\n");
        self.monitor.get_mut().write_all(text.as_bytes()).expect("the monitor listens");
        loop {
            let mut answer = String::new();
            let length = self.monitor.read_line(&mut answer).expect("the monitor answers");
            assert!(length > 0, "QEMU has ended");
            assert!(!answer.starts_with("{\"error\""), "{command}: {answer}");
            // Events come in between.
            if answer.starts_with("{\"return\"") {
                return answer;
            }
        }
    }
}

impl Transport for Board {
    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), TransportError> {
        self.line.set_write_timeout(Some(left(deadline)?))?;
        self.line.write_all(bytes).map_err(timed_out)
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> Result<usize, TransportError> {
        if self.rest.is_empty() {
            let bytes = self.received.recv_timeout(deadline.saturating_duration_since(Instant::now()));
            self.rest.extend(bytes.map_err(|error| match error {
                RecvTimeoutError::Timeout => TransportError::TimedOut,
                RecvTimeoutError::Disconnected => TransportError::Closed,
            })?);
        }
        let count = self.rest.len().min(buffer.len());
        for (place, byte) in buffer.iter_mut().zip(self.rest.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // The guard first: it must not end a process that has got the same number later. That one of them is gone
        // already is no trouble.
        for process in [&mut self.guard, &mut self.qemu] {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

/// Reads in a thread of its own until the line is closed.
fn read_on(mut line: UnixStream) -> Receiver<Vec<u8>> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(count @ 1..) = line.read(&mut buffer)
            && sender.send(buffer[..count].to_vec()).is_ok()
        {}
    });
    receiver
}

/// QEMU's end of a socket.
fn accept(listener: &UnixListener, qemu: &mut Child) -> UnixStream {
    listener.set_nonblocking(true).expect("a socket that does not block");
    let deadline = Instant::now() + START;
    loop {
        match listener.accept() {
            Ok((socket, _)) => {
                socket.set_nonblocking(false).expect("a socket that blocks");
                return socket;
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Err(error) => panic!("{error}"),
        }
        let ended = qemu.try_wait().expect("QEMU can be waited for");
        assert!(ended.is_none() && Instant::now() < deadline, "QEMU does not start: {ended:?}");
        thread::sleep(Duration::from_millis(2));
    }
}

fn left(deadline: Instant) -> Result<Duration, TransportError> {
    match deadline.saturating_duration_since(Instant::now()) {
        Duration::ZERO => Err(TransportError::TimedOut),
        left => Ok(left),
    }
}

fn timed_out(error: io::Error) -> TransportError {
    match error.kind() {
        ErrorKind::WouldBlock | ErrorKind::TimedOut => TransportError::TimedOut,
        _ => error.into(),
    }
}

/// Address of the variable whose name ends so.
fn address(elf: &[u8], name: &str) -> u32 {
    let file = object::File::parse(elf).expect("an ELF");
    let found: Vec<u64> = (file.symbols())
        .filter(|symbol| {
            let mangled = symbol.name().unwrap_or("");
            format!("{:#}", rustc_demangle::demangle(mangled)).ends_with(name)
        })
        .map(|symbol| symbol.address())
        .collect();
    assert_eq!(found.len(), 1, "variables of the name {name}");
    found[0] as u32
}
