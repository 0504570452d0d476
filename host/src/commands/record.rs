//! `blindgrasp record`: everything that one or more hands say, into one file.

use super::progress::Progress;
use super::{Outcome, in_a_line, ports};
use crate::terminal;
use anyhow::{Context, anyhow, bail};
use blindgrasp::device::interrupt;
use blindgrasp::device::recorder::{ENDED_ANOTHER, Recorder, Recording, Totals};
use blindgrasp::device::talk::{self, Event, Talk, TalkError};
use blindgrasp::device::transport::{Transport, TransportError};
use blindgrasp::record::mcap::{RecordingError, Saved};
use clap::Args;
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

/// Longest time for which nothing is looked at but the line.
const SLICE: Duration = Duration::from_millis(10);
/// Longest time for which a line may take no bytes.
const SENDING: Duration = Duration::from_secs(1);
/// From one look for a port that is lost to the next.
const LOOK_AGAIN: Duration = Duration::from_millis(500);

/// Record everything that hands say, every tick of it, into an MCAP file
///
/// One hand at each port, all on one clock, in one file, which Foxglove, PlotJuggler, Rerun and Python open, and `replay` and
/// `export` take. It is whole at every moment. A port that is unplugged is waited for, and the gap is in the file. Ctrl-C, or
/// --duration, ends the recording.
///
/// Where the line has no time for every record in full, an input record of each other tick stands in, of which `replay`
/// computes the rest; `export` has the full records.
///
/// It only listens: a hand is commanded by `console --out FILE` or `monitor --out FILE`, which record in the same way. The
/// heartbeat is kept while it records; a hand with torque lets go when it ends. A port that another program has open is refused.
///
/// Exit code 0: no record was lost; 1: some were, which the file tells, or the disk is full; the file is good all the same;
/// 2: bad usage, or nobody answers.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A serial port (/dev/ttyUSB0, COM3), or unix:PATH for a socket at which somebody listens; may be repeated
    #[arg(long = "port", value_name = "PORT")]
    ports: Vec<String>,
    /// The file to write
    #[arg(long, value_name = "FILE.mcap")]
    out: PathBuf,
    /// Length of the recording, s [default: until Ctrl-C]
    #[arg(long, value_name = "S", value_parser = seconds)]
    duration: Option<f64>,
    /// A hand's file, if it is not built in: for angles and the joints' names; may be repeated
    #[arg(long = "hand", value_name = "HAND")]
    hands: Vec<String>,
    /// Rate of the line, baud [default: the fastest that hand and adapter can]
    #[arg(long, value_name = "BAUD")]
    baud: Option<u32>,
    /// Record one in so many ticks
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    decimation: u16,
    /// Overwrite the file
    #[arg(long)]
    force: bool,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// A time that can be waited for.
fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.001..=1e7).contains(seconds));
    seconds.ok_or("seconds from 0.001 to 10000000 are wanted".to_owned())
}

/// The result as `--json` prints it.
#[derive(Serialize)]
struct Report {
    file: String,
    bytes: u64,
    seconds_s: f64,
    records: u64,
    /// `true` if every record that was asked for is there.
    whole: bool,
    devices: Vec<Device>,
    /// The error that ended the recording, if it was not the user.
    error: Option<String>,
}

#[derive(Serialize)]
struct Device {
    name: String,
    port: String,
    sessions: u64,
    records: u64,
    /// Those of them that tell only what the tick took in: the line had no time for all in full.
    input_records: u64,
    /// Records that are missing; of these, or of the answers, the device itself dropped some, ...
    missing: u64,
    dropped_by_device: u64,
    /// ... and the others were lost on the way.
    lost_on_the_way: u64,
    frames_unusable: u64,
    frames_damaged: u64,
    gaps: u64,
    gaps_s: f64,
    decimation: u32,
}

/// News of a thread.
enum News {
    /// A line for the user.
    Words(usize, String),
    /// The totals of the link in the last second.
    Status(usize, Totals),
    /// It has ended.
    End(usize, Ended),
}

/// The end of the recording of a port.
struct Ended {
    totals: Totals,
    error: Option<Trouble>,
}

/// The cause of an early end.
enum Trouble {
    /// Nobody is there, or nobody that can be talked to.
    Nobody(anyhow::Error),
    /// Another program leads the hand.
    Taken(TalkError),
    /// The file takes nothing any more.
    File(RecordingError),
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let Arguments { ports, out, .. } = arguments;
    if ports.is_empty() {
        ports::given(None)?;
    }
    if ports.iter().collect::<BTreeSet<_>>().len() < ports.len() {
        bail!("--port: one is named twice");
    }
    if let Some(unknown) =
        arguments.hands.iter().find_map(|hand| blindgrasp::model::HandModel::load(hand).err())
    {
        return Err(unknown.into());
    }
    interrupt::listen();
    let mut lines = ports.iter().map(|port| talk::open(port)).collect::<Result<Vec<_>, _>>()?;
    for (port, line) in ports.iter().zip(&mut lines) {
        // Told before there is a file.
        talk::wanted_bauds(&mut **line, port, arguments.baud)?;
    }
    let recording = Recording::create(out, arguments.force)?;
    let progress = Progress::new();

    let begun = Instant::now();
    let until = arguments.duration.map(|seconds| begun + Duration::from_secs_f64(seconds));
    let ending = AtomicBool::new(false);
    let (tell, news) = mpsc::channel();
    let ended = thread::scope(|scope| {
        for (k, (port, line)) in ports.iter().zip(lines).enumerate() {
            let recorder = recording.add(&name(k, ports.len()), port, &arguments.hands, arguments.decimation);
            let attendant = Attendant {
                k,
                port,
                baud: arguments.baud,
                recorder,
                tell: tell.clone(),
                ending: &ending,
                until,
            };
            scope.spawn(move || attendant.run(line));
        }
        drop(tell);
        follow(&news, &progress, &recording, ports, begun, &ending)
    });
    drop(progress);
    let finished = recording.finish();
    finish(arguments, ended, finished)
}

/// Name of a device in the recording.
fn name(k: usize, count: usize) -> String {
    if count == 1 { "hand".to_owned() } else { format!("hand{}", k + 1) }
}

/// Tells the user what the threads tell, until they have ended.
fn follow(
    news: &Receiver<News>,
    progress: &Progress,
    recording: &Recording,
    ports: &[String],
    begun: Instant,
    ending: &AtomicBool,
) -> Vec<Ended> {
    let mut totals = vec![Totals::default(); ports.len()];
    let mut ended: Vec<Option<Ended>> = ports.iter().map(|_| None).collect();
    loop {
        match news.recv_timeout(Duration::from_millis(250)) {
            Ok(News::Words(k, words)) => progress.above(|| eprintln!("blindgrasp: {}: {words}", ports[k])),
            Ok(News::Status(k, status)) => totals[k] = status,
            Ok(News::End(k, end)) => {
                // The other hands have not been taken.
                if !matches!(end.error, None | Some(Trouble::Taken(_))) {
                    ending.store(true, Ordering::Relaxed);
                }
                totals[k] = end.totals;
                ended[k] = Some(end);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return ended.into_iter().flatten().collect(),
        }
        let saved = recording.saved();
        let lost: u64 = totals.iter().map(|totals| totals.missing).sum();
        let elapsed_s = begun.elapsed().as_secs_f64();
        progress.say(|| {
            format!(
                "{elapsed_s:.0} s, {} records, {lost} lost, {:.0} a second, {:.1} MB",
                saved.records,
                saved.records as f64 / elapsed_s.max(1e-3),
                saved.bytes as f64 / 1e6
            )
        });
    }
}

/// Says what became of it all.
fn finish(
    arguments: &Arguments,
    ended: Vec<Ended>,
    finished: Result<Saved, RecordingError>,
) -> anyhow::Result<Outcome> {
    let Arguments { ports, out, json, .. } = arguments;
    let mut error = finished.as_ref().err().map(ToString::to_string);
    let saved = finished.unwrap_or_default();
    let mut devices = Vec::new();
    for (k, Ended { totals, error: trouble }) in ended.into_iter().enumerate() {
        match trouble {
            Some(Trouble::Nobody(error)) => {
                return Err(error.context(format!("port {}", ports[k])));
            }
            Some(Trouble::Taken(taken)) => error = Some(format!("port {}: {taken}", ports[k])),
            Some(Trouble::File(stopped)) => error = Some(stopped.to_string()),
            None => {}
        }
        devices.push(Device {
            name: name(k, ports.len()),
            port: ports[k].clone(),
            sessions: totals.sessions,
            records: totals.records,
            input_records: totals.inputs,
            missing: totals.missing,
            dropped_by_device: totals.dropped,
            lost_on_the_way: totals.missing.saturating_sub(totals.dropped),
            frames_unusable: totals.unusable,
            frames_damaged: totals.damaged,
            gaps: totals.gaps,
            gaps_s: totals.gaps_time.as_secs_f64(),
            decimation: totals.decimation,
        });
    }
    let whole = devices.iter().all(|device| {
        device.missing == 0 && device.dropped_by_device == 0 && device.gaps == 0 && device.sessions > 0
    });
    let report = Report {
        file: out.display().to_string(),
        bytes: saved.bytes,
        seconds_s: saved.seconds,
        records: saved.records,
        whole,
        devices,
        error,
    };
    let text = if *json { serde_json::to_string(&report)? + "\n" } else { describe(&report) };
    terminal::print(&text).context("cannot print the summary")?;
    if let Some(error) = &report.error {
        eprintln!("blindgrasp: {error}");
    }
    Ok(if whole && report.error.is_none() { Outcome::Shown } else { Outcome::Failed })
}

/// The summary as a table.
fn describe(report: &Report) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<22}{value}");
    };
    line("file", format!("{}, {} bytes", report.file, report.bytes));
    line("recorded", format!("{:.3} s, {} records", report.seconds_s, report.records));
    for device in &report.devices {
        let Device { name, records, missing, dropped_by_device, lost_on_the_way, .. } = device;
        let lost = match (missing, dropped_by_device) {
            (0, 0) => "none lost".to_owned(),
            _ => format!(
                "{missing} LOST: {lost_on_the_way} on the way; {dropped_by_device} records and answers dropped by the device"
            ),
        };
        line(name, format!("{records} records, {lost}"));
        if device.input_records > 0 {
            let inputs = device.input_records;
            line("", format!("{inputs} of them tell only what the tick took in: `replay` computes the rest"));
        }
        if device.decimation > 1 {
            line("", format!("one in up to {} ticks was sent", device.decimation));
        }
        if device.frames_damaged + device.frames_unusable > 0 {
            let (damaged, unusable) = (device.frames_damaged, device.frames_unusable);
            line("", format!("{damaged} frames damaged, {unusable} whole but not to be decoded"));
        }
        if device.gaps > 0 {
            line("", format!("{} gaps, {:.3} s", device.gaps, device.gaps_s));
        }
    }
    if !report.whole {
        line("", "the file is good; it tells what is missing, and where".to_owned());
    }
    text
}

/// Looks after one port.
struct Attendant<'a> {
    k: usize,
    port: &'a str,
    /// The rate that is asked for.
    baud: Option<u32>,
    recorder: Recorder,
    tell: Sender<News>,
    /// Somebody else has an error.
    ending: &'a AtomicBool,
    until: Option<Instant>,
}

/// The end of a talk.
enum Cut {
    /// The end of the recording.
    End,
    /// Nothing comes over the line.
    Line(anyhow::Error),
    /// Another program leads the hand.
    Taken(TalkError),
    File(RecordingError),
}

impl From<RecordingError> for Cut {
    fn from(error: RecordingError) -> Self {
        Self::File(error)
    }
}

impl From<TalkError> for Cut {
    fn from(error: TalkError) -> Self {
        match error {
            TalkError::SessionTaken => Self::Taken(error),
            error => Self::Line(ports::explained(error)),
        }
    }
}

impl From<TransportError> for Cut {
    fn from(error: TransportError) -> Self {
        match error {
            TransportError::Interrupted => Self::End,
            error => Self::Line(anyhow!(error)),
        }
    }
}

impl Attendant<'_> {
    fn run(mut self, line: Box<dyn Transport + Send>) {
        let error = self.attend(line).err();
        let error = error.or_else(|| self.recorder.finish(Instant::now()).err().map(Trouble::File));
        let end = Ended { totals: self.recorder.totals(), error };
        let _ = self.tell.send(News::End(self.k, end));
    }

    /// From one connexion to the next.
    fn attend(&mut self, line: Box<dyn Transport + Send>) -> Result<(), Trouble> {
        let mut line = Some(line);
        let mut cut_at = None;
        let mut told = String::new();
        while !self.is_over(Instant::now()) {
            let Some(open) = &mut line else {
                thread::sleep(LOOK_AGAIN);
                match talk::open(self.port) {
                    Ok(open) => line = Some(open),
                    Err(error) if error.is_absence() => {}
                    Err(error) => self.wait_because(&mut told, error.to_string()),
                }
                continue;
            };
            match self.listen(&mut **open, &mut cut_at) {
                Cut::End => break,
                Cut::File(error) => return Err(Trouble::File(error)),
                Cut::Taken(error) => {
                    let cut = self.recorder.cut("another program leads the hand", Instant::now());
                    return Err(cut.map_or_else(Trouble::File, |()| Trouble::Taken(error)));
                }
                Cut::Line(error) if self.recorder.totals().sessions == 0 => {
                    return Err(Trouble::Nobody(error));
                }
                Cut::Line(error) => {
                    line = None;
                    let now = Instant::now();
                    let since = *cut_at.get_or_insert(now);
                    let words = in_a_line(&error);
                    self.recorder.cut(&words, now).map_err(Trouble::File)?;
                    if since == now {
                        told.clear();
                    }
                    self.wait_because(&mut told, words);
                }
            }
        }
        Ok(())
    }

    /// Says why it waits: once, not twice a second.
    fn wait_because(&self, told: &mut String, words: String) {
        if *told != words {
            self.say(format!("{words}; waiting for it to come back"));
        }
        *told = words;
    }

    /// Until the line is cut.
    fn listen(&mut self, line: &mut dyn Transport, cut_at: &mut Option<Instant>) -> Cut {
        let begun = Instant::now();
        let bauds = match talk::wanted_bauds(line, self.port, self.baud) {
            Ok(bauds) => bauds,
            Err(error) => return Cut::Line(error.into()),
        };
        let mut talk = Talk::new(talk::PATIENCE, begun).with_bauds(bauds).tapped();
        let cut = loop {
            if let Err(cut) = self.turn(&mut talk, line, cut_at) {
                break cut;
            }
        };
        let now = Instant::now();
        if let Cut::End = cut {
            talk.say_goodbye(now);
            let _ = line.send(&talk.outgoing(), now + SENDING);
        }
        match cut {
            // The time was up before anybody answered. Where another port's trouble has ended it, nobody can know.
            Cut::End if self.recorder.totals().sessions == 0 && !self.ending.load(Ordering::Relaxed) => {
                let waited = Duration::from_millis((now - begun).as_millis() as u64);
                Cut::from(TalkError::NobodyThere(waited, *talk.traffic()))
            }
            cut => cut,
        }
    }

    /// Does what there is to do at one time, and waits.
    fn turn(
        &mut self,
        talk: &mut Talk,
        line: &mut dyn Transport,
        cut_at: &mut Option<Instant>,
    ) -> Result<(), Cut> {
        let now = Instant::now();
        if self.is_over(now) {
            return Err(Cut::End);
        }
        talk.turn(now)?;
        while let Some(event) = talk.event() {
            self.recorder.take(&event, talk, now)?;
            self.hear(&event, cut_at, now);
        }
        if self.recorder.turn(talk, now)? {
            let _ = self.tell.send(News::Status(self.k, self.recorder.totals()));
        }
        line.set_baud(talk.baud())?;
        line.send(&talk.outgoing(), now + SENDING)?;
        let deadline = talk.due().clamp(now + Duration::from_millis(1), now + SLICE);
        let mut buffer = [0; 4096];
        match line.receive(&mut buffer, deadline) {
            Ok(count) => Ok(talk.take(&buffer[..count], Instant::now())?),
            Err(TransportError::TimedOut) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Tells the user what matters to him.
    fn hear(&mut self, event: &Event, cut_at: &mut Option<Instant>, now: Instant) {
        match event {
            Event::Open { firmware, ends_another, .. } => {
                match cut_at.take().and_then(|_| self.recorder.silence(now)) {
                    Some(silence) => {
                        let since_s = silence.as_secs_f64();
                        self.say(format!("back after {since_s:.1} s: {}", firmware.words));
                    }
                    None => self.say(firmware.words.clone()),
                }
                if *ends_another {
                    self.say(ENDED_ANOTHER.to_owned());
                }
            }
            Event::StartedAnew => {
                *cut_at = Some(now);
                self.say("the device was reset".to_owned());
            }
            Event::Fault(Some(raised)) => self.say(raised.to_string()),
            _ => {}
        }
    }

    fn say(&self, words: String) {
        // Who does not listen has ended.
        let _ = self.tell.send(News::Words(self.k, words));
    }

    fn is_over(&self, now: Instant) -> bool {
        interrupt::wanted()
            || self.ending.load(Ordering::Relaxed)
            || self.until.is_some_and(|until| until <= now)
    }
}
