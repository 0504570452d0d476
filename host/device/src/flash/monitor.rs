//! Following the logs of a firmware over Real-Time Transfer: a ring buffer in its RAM that the probe empties while it
//! runs. The channel's mode is left as the firmware has it: one that waits for its reader would break its deadlines.

use super::logs::{Decoder, Line, Logs};
use anyhow::{Context, Result, anyhow};
use probe_rs::rtt::{self, Rtt, ScanRegion, UpChannel};
use probe_rs::{Core, CoreStatus, Session};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Longest time from the firmware's start to its first logs.
const START_TIMEOUT: Duration = Duration::from_secs(3);
/// Longest time that halting may take.
const HALT_TIMEOUT: Duration = Duration::from_millis(500);
/// Between two looks at an empty buffer.
const IDLE: Duration = Duration::from_millis(10);
/// Between two looks at whether the core still runs.
const STATUS_PERIOD: Duration = Duration::from_secs(1);
/// Between two tries to connect again.
const RECONNECT_PERIOD: Duration = Duration::from_secs(1);
/// Failed accesses in a row after which the connection counts as lost.
const MOST_FAILURES: u32 = 5;

/// Something to show.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The firmware logged a line.
    Line(Line),
    /// Something happened to the connection or the firmware.
    Note(String),
}

/// Starts the firmware from reset.
///
/// # Errors
/// If the chip does not do so.
pub fn start(session: &mut Session, control_block: Option<u64>) -> Result<()> {
    let mut start = || {
        let mut core = session.core(0)?;
        core.reset_and_halt(HALT_TIMEOUT)?;
        if let Some(address) = control_block {
            // One that an earlier firmware left in RAM would be taken for that of this one.
            Rtt::clear_control_block(&mut core, &ScanRegion::Exact(address))?;
        }
        anyhow::Ok(core.run()?)
    };
    start().context("the firmware cannot be started; check the wiring of the probe, reset above all")
}

/// Shows what a running firmware logs until `stop` is set or `show` says that nobody reads any more (a broken pipe).
/// When the probe or the chip goes away, waits for `connect` to bring it back.
///
/// # Errors
/// If no logs are found in the first place, or they cannot be shown.
pub fn follow(
    session: Session,
    mut connect: impl FnMut() -> Option<Session>,
    control_block: u64,
    logs: &Logs,
    stop: &AtomicBool,
    mut show: impl FnMut(Event) -> io::Result<()>,
) -> Result<()> {
    let mut session = Some(session);
    let mut seen = false;
    let mut reader = Reader { control_block, logs, stop, seen: &mut seen, show: &mut show };
    while !stop.load(Ordering::Relaxed) {
        let Some(connected) = &mut session else {
            thread::sleep(RECONNECT_PERIOD);
            session = connect();
            if session.is_some() {
                reader.note("connected again".to_owned())?;
            }
            continue;
        };
        let ended = match connected.core(0) {
            Ok(mut core) => reader.read(&mut core),
            Err(error) => Err(Break::Lost(error.into())),
        };
        match ended {
            Ok(()) => break,
            Err(Break::Lost(error)) if *reader.seen => {
                reader.note(format!("connection lost ({error}); waiting for it, Ctrl-C ends"))?;
                session = None;
            }
            Err(Break::Lost(error)) => {
                return Err(error).context(
                    "the connection to the chip broke off before its first log; check the wiring of the probe",
                );
            }
            Err(Break::End(error)) => {
                let printed = error.downcast_ref::<io::Error>();
                let is_closed = printed.is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe);
                return if is_closed { Ok(()) } else { Err(error) };
            }
        }
    }
    Ok(())
}

/// The reason for which reading stops.
enum Break {
    /// The probe or the chip is gone.
    Lost(rtt::Error),
    /// For good.
    End(anyhow::Error),
}

impl From<anyhow::Error> for Break {
    fn from(error: anyhow::Error) -> Self {
        Self::End(error)
    }
}

struct Reader<'a, S> {
    control_block: u64,
    logs: &'a Logs,
    stop: &'a AtomicBool,
    /// A control block has been found.
    seen: &'a mut bool,
    show: &'a mut S,
}

impl<S: FnMut(Event) -> io::Result<()>> Reader<'_, S> {
    fn note(&mut self, text: String) -> Result<()> {
        (self.show)(Event::Note(text)).context("the log cannot be printed")
    }

    /// Until stopped.
    fn read(&mut self, core: &mut Core<'_>) -> Result<(), Break> {
        while let Some(channel) = self.channel(core)? {
            *self.seen = true;
            if !self.drain(core, channel)? {
                return Ok(());
            }
            self.note("the firmware started again".to_owned())?;
        }
        Ok(())
    }

    /// The channel of the logs, once the firmware has made it; nothing if stopped.
    fn channel(&mut self, core: &mut Core<'_>) -> Result<Option<UpChannel>, Break> {
        let started = Instant::now();
        let mut failures = 0;
        let mut told = false;
        while !self.stop.load(Ordering::Relaxed) {
            match Rtt::attach_at(core, self.control_block) {
                Ok(rtt) => {
                    let mut channels = rtt.up_channels;
                    let named = channels.iter().position(|channel| channel.name() == Some("defmt"));
                    if !channels.is_empty() {
                        return Ok(Some(channels.swap_remove(named.unwrap_or(0))));
                    }
                }
                Err(error) if is_access(&error) => {
                    failures += 1;
                    if failures >= MOST_FAILURES {
                        return Err(Break::Lost(error));
                    }
                }
                // Not there yet, or half written.
                Err(_) => failures = 0,
            }
            if started.elapsed() > START_TIMEOUT && !told {
                told = true;
                let error = format!(
                    "no RTT control block at {:#010x} {} s after the start, the core is {}; did the firmware stop before its \
                     first log, or was it built with another memory.x?",
                    self.control_block,
                    START_TIMEOUT.as_secs(),
                    status(core)
                );
                if !*self.seen {
                    return Err(Break::End(anyhow!(error)));
                }
                self.note(format!("{error}; still looking"))?;
            }
            thread::sleep(IDLE);
        }
        Ok(None)
    }

    /// Shows what comes. True when the firmware has started again, false when stopped.
    fn drain(&mut self, core: &mut Core<'_>, mut channel: UpChannel) -> Result<bool, Break> {
        let mut decoder = self.logs.decoder();
        let mut buffer = vec![0; channel.buffer_size().max(1)];
        let mut damaged_frames = 0;
        let mut failures = 0;
        let mut halted = false;
        let mut looked = Instant::now();
        while !self.stop.load(Ordering::Relaxed) {
            match channel.read(core, &mut buffer) {
                Ok(0) => {
                    failures = 0;
                    thread::sleep(IDLE);
                }
                Ok(length) => {
                    failures = 0;
                    self.decode(&mut decoder, buffer.get(..length).unwrap_or(&buffer))?;
                }
                Err(error) if is_access(&error) => {
                    failures += 1;
                    if failures >= MOST_FAILURES {
                        return Err(Break::Lost(error));
                    }
                    thread::sleep(IDLE);
                }
                // Its start-up code has set the buffer's pointers back.
                Err(_) => return Ok(true),
            }
            if decoder.damaged_frames() > damaged_frames {
                let lost = decoder.damaged_frames() - damaged_frames;
                damaged_frames = decoder.damaged_frames();
                self.note(format!("{lost} log frames lost or damaged"))?;
            }
            if looked.elapsed() > STATUS_PERIOD {
                looked = Instant::now();
                let now = matches!(core.status(), Ok(CoreStatus::Halted(_) | CoreStatus::LockedUp));
                if now && !halted {
                    self.note(format!("the core is {}", status(core)))?;
                }
                halted = now;
            }
        }
        Ok(false)
    }

    fn decode(&mut self, decoder: &mut Decoder<'_>, bytes: &[u8]) -> Result<()> {
        let mut printed = Ok(());
        decoder.push(bytes, |line| {
            if printed.is_ok() {
                printed = (self.show)(Event::Line(line));
            }
        });
        printed.context("the log cannot be printed")
    }
}

/// Returns `true` if memory could not be read, in contrast to holding what it should not.
fn is_access(error: &rtt::Error) -> bool {
    matches!(error, rtt::Error::Probe(_) | rtt::Error::MemoryRead(_) | rtt::Error::Other(_))
}

fn status(core: &mut Core<'_>) -> String {
    match core.status() {
        Ok(CoreStatus::Running) => "running".to_owned(),
        Ok(CoreStatus::Halted(reason)) => format!("halted ({reason:?})"),
        Ok(CoreStatus::LockedUp) => "locked up".to_owned(),
        Ok(CoreStatus::Sleeping) => "asleep".to_owned(),
        Ok(CoreStatus::Unknown) => "in an unknown state".to_owned(),
        Err(error) => format!("not answering ({error})"),
    }
}
