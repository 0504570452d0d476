//! `blindgrasp console`: words for a hand, and what it answers.

use super::{Outcome, in_a_line, ports};
use crate::terminal;
use anyhow::{Context, anyhow, bail};
use blindgrasp::device::interrupt;
use blindgrasp::device::recorder::{ENDED_ANOTHER, Recorder, Recording};
use blindgrasp::device::talk::{self, Event, SELDOM, Talk, TalkError, telemetry};
use blindgrasp::device::transport::{Transport, TransportError};
use blindgrasp::model::order::{self, Names};
use blindgrasp::model::{HandModel, suggestion};
use blindgrasp::wire::{self, Answer, Firmware, Record, Request, label, potentials, scalars, take_encoder};
use blindgrasp_shared::command::{self, Command, Move, Refusal};
use blindgrasp_shared::control::GAINS;
use blindgrasp_shared::cycle::{Notice, Noticed};
use blindgrasp_shared::estimate::Encoder;
use blindgrasp_shared::identity::Restored;
use blindgrasp_shared::parameters::{Bound, Each, Parameter, Setting};
use clap::Args;
use std::collections::VecDeque;
use std::fmt::{Display, Write as _};
use std::io::{self, BufRead as _, IsTerminal as _};
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::thread;
use std::time::{Duration, Instant};

/// Longest time for which nothing is looked at but the line.
const SLICE: Duration = Duration::from_millis(10);
/// Longest time for which a line may take no bytes.
const SENDING: Duration = Duration::from_secs(1);
/// Ticks from one recorded record to the next.
const EVERY_TICK: u16 = 1;
/// Time for which something to be noticed is waited for, if nothing else is said, s: as in the script of a scene.
const PATIENCE_S: f32 = 10.0;
/// The words that can be typed besides the commands of the hand, with their meanings.
const WORDS: [(&str, &str, &str); 12] = [
    ("help", "", "show this"),
    ("status", "", "mode, fault, what is held, counts, torques, what limits, and what went over the line"),
    (
        "wait",
        "NOTICE [TIME_S]",
        "go on when the hand has noticed this since its last command; it fails after so long (10 s)",
    ),
    ("get", "[KEY [INDEX]]", "show parameters"),
    ("set", "KEY [INDEX] VALUE", "set a parameter, of all joints or axes without INDEX; disarmed only"),
    ("differs", "", "show the parameters that are other than in the hand's file"),
    ("zero", "[JOINT]", "the joints, or this one, stand at angle zero: set their zeros so; disarmed only"),
    (
        "confirm",
        "",
        "the angles that `status` shows are right: allow to arm with the signs and zeros that were set",
    ),
    ("save", "", "keep the parameters that were set over a reset; disarmed only"),
    ("defaults", "", "forget what was saved and set: the hand's file holds again; disarmed only"),
    ("watch", "MS|off", "show angles and torques all the time"),
    ("quit", "", "stop, and end"),
];

/// Talk to a board that runs the image `hand`, a line a command
///
/// Type `help` for the commands; they are taken one by one, from a terminal or a script. The heartbeat is kept all the
/// time. Ctrl-C stops the hand, a second one ends the program, as the end of the input does; the hand is stopped first.
/// A script ends, and the hand is stopped, at the first line that is refused, not answered, or not understood.
///
/// Exit code 0: ended, and the hand has confirmed the stop; 1: the same, but a line of a script was refused, or something
/// is missing in the recording; 2: bad usage, nobody answers, or the line was lost.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A serial port (/dev/ttyUSB0, COM3), or unix:PATH for a socket at which somebody listens
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// The hand's file, if it is not built in: for angles and the joints' names
    #[arg(long, value_name = "HAND")]
    hand: Option<String>,
    /// Rate of the line, baud [default: the fastest that hand and adapter can]
    #[arg(long, value_name = "BAUD")]
    baud: Option<u32>,
    /// Record everything that goes over the line, every tick included
    #[arg(long, value_name = "FILE.mcap")]
    out: Option<PathBuf>,
    /// Overwrite the recording
    #[arg(long, requires = "out")]
    force: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let port = ports::given(arguments.port.as_deref())?;
    let mut line = talk::open(port)?;
    let bauds = talk::wanted_bauds(&mut *line, port, arguments.baud)?;
    let recording =
        (arguments.out.as_ref()).map(|path| Recording::create(path, arguments.force)).transpose()?;
    let recorder = recording
        .as_ref()
        .map(|recording| recording.add("hand", port, arguments.hand.as_slice(), EVERY_TICK));
    interrupt::listen_by(|number| {
        if number > 2 {
            interrupt::end_now();
        }
    });
    let mut console = Console {
        talk: match recorder {
            Some(_) => Talk::new(talk::PATIENCE, Instant::now()).with_bauds(bauds).tapped(),
            None => Talk::new(talk::PATIENCE, Instant::now()).with_bauds(bauds),
        },
        recorder,
        wanted_hand: arguments.hand.clone(),
        typed: Typed::listen(),
        joint_count: 0,
        period_us: 1000,
        hand: None,
        encoders: Vec::new(),
        postures: Vec::new(),
        noticed: Vec::new(),
        awaited: None,
        unshown: 0,
        differing: None,
        status: Status::Shown,
        watch_ticks: None,
        watched: None,
        interrupts: 0,
        is_quitting: false,
        is_over: false,
        broken: None,
    };
    let ended = console.run(&mut *line).with_context(|| format!("port {port}"));
    let now = Instant::now();
    match &ended {
        Ok(()) => console.talk.say_goodbye(now),
        // What another program leads is not stopped under its hands.
        Err(error) if error.downcast_ref() == Some(&TalkError::SessionTaken) => {}
        // Whatever it was: nobody leads the hand any more. If the line is gone, so is the heartbeat.
        Err(_) => console.talk.ask(Request::Command(Command::Stop), now),
    }
    let _ = line.send(&console.talk.outgoing(), now + SENDING);
    let totals = console.recorder.as_mut().map(|recorder| recorder.finish(Instant::now()));
    if let (Some(recording), Some(path)) = (recording, &arguments.out) {
        let saved = recording.finish()?;
        match saved.bytes {
            0 => eprintln!("blindgrasp: {}: not written: nothing was recorded", path.display()),
            _ => eprintln!("blindgrasp: recorded {}: {saved}", path.display()),
        }
    }
    ended?;
    let whole = totals.transpose()?.is_none_or(|totals| totals.is_whole());
    if !whole {
        eprintln!("blindgrasp: something is missing in the recording, which says what");
    }
    match console.broken {
        Some(Broken::Misunderstood(error)) => Err(error),
        Some(Broken::Refused) => Ok(Outcome::Failed),
        None if !whole => Ok(Outcome::Failed),
        None => Ok(Outcome::Shown),
    }
}

/// The reason for which a script ended early.
enum Broken {
    /// A line was not done.
    Refused,
    /// A line has no meaning.
    Misunderstood(anyhow::Error),
}

/// Lines from stdin.
struct Typed {
    incoming: Receiver<String>,
    lines: VecDeque<String>,
    /// Number of the line that was taken last.
    number: usize,
    has_ended: bool,
    by_hand: bool,
}

impl Typed {
    /// Reads in a thread that nobody waits for.
    fn listen() -> Self {
        let (lines, incoming) = mpsc::channel();
        thread::spawn(move || {
            io::stdin().lock().lines().map_while(Result::ok).try_for_each(|line| lines.send(line))
        });
        let by_hand = io::stdin().is_terminal();
        Self { incoming, lines: VecDeque::new(), number: 0, has_ended: false, by_hand }
    }

    fn look(&mut self) {
        loop {
            match self.incoming.try_recv() {
                Ok(line) => self.lines.push_back(line),
                Err(TryRecvError::Empty) => return,
                Err(TryRecvError::Disconnected) => {
                    self.has_ended = true;
                    return;
                }
            }
        }
    }
}

/// The state of a question for the status.
#[derive(PartialEq)]
enum Status {
    Shown,
    /// A fresh record was asked for.
    Asked,
    /// It is the next that comes.
    Next,
}

/// The thing that a line waits for.
struct Awaited {
    notice: Notice,
    time_s: f32,
    deadline: Instant,
}

struct Console {
    talk: Talk,
    recorder: Option<Recorder>,
    wanted_hand: Option<String>,
    typed: Typed,
    joint_count: usize,
    period_us: u32,
    /// The hand that the firmware was built with, if it is known.
    hand: Option<HandModel>,
    /// The names of its postures.
    postures: Vec<String>,
    /// The notices of the hand since its last command.
    noticed: Vec<Notice>,
    /// The thing that is waited for before the next line.
    awaited: Option<Awaited>,
    /// Of a hand that is known, with the signs and zeros in force.
    encoders: Vec<Encoder>,
    /// Answers about them that are not shown.
    unshown: usize,
    /// While parameters are compared with the hand's file: how many differ so far.
    differing: Option<usize>,
    status: Status,
    /// From one line of `watch` to the next.
    watch_ticks: Option<u32>,
    /// Tick of the last one.
    watched: Option<u32>,
    /// Those that were seen.
    interrupts: u32,
    is_quitting: bool,
    is_over: bool,
    /// The reason for which the script ends early, if it does.
    broken: Option<Broken>,
}

impl Console {
    fn run(&mut self, line: &mut dyn Transport) -> anyhow::Result<()> {
        let mut buffer = [0; 4096];
        loop {
            let now = Instant::now();
            self.talk.turn(now).map_err(ports::explained)?;
            while let Some(event) = self.talk.event() {
                if let Some(recorder) = &mut self.recorder {
                    recorder.take(&event, &mut self.talk, now)?;
                }
                self.show(event, now)?;
            }
            if let Some(recorder) = &mut self.recorder {
                recorder.turn(&mut self.talk, now)?;
            }
            if self.is_over {
                return Ok(());
            }
            self.obey(now)?;
            line.set_baud(self.talk.baud()).map_err(lost)?;
            line.send(&self.talk.outgoing(), now + SENDING).map_err(lost)?;
            let deadline = self.talk.due().clamp(now + Duration::from_millis(1), now + SLICE);
            match line.receive(&mut buffer, deadline) {
                Ok(count) => self.talk.take(&buffer[..count], Instant::now())?,
                Err(TransportError::TimedOut) => {}
                Err(error) => return Err(lost(error)),
            }
        }
    }

    /// Does what the user wants: one thing at a time, but a stop at once.
    fn obey(&mut self, now: Instant) -> anyhow::Result<()> {
        let interrupts = interrupt::count();
        if interrupts > self.interrupts {
            self.interrupts = interrupts;
            self.typed.lines.clear();
            self.stop(interrupts > 1, now);
        }
        self.typed.look();
        if self.typed.by_hand && self.typed.lines.iter().any(|line| line.trim() == "stop") {
            self.typed.lines.clear();
            self.stop(false, now);
        }
        let is_ready = self.recorder.as_ref().is_none_or(Recorder::is_ready);
        if self.talk.is_idle()
            && let Some(count) = self.differing.take()
        {
            say(match count {
                0 => "every parameter is as in the hand's file".to_owned(),
                count => format!("{count} differ from the hand's file"),
            })?;
        }
        if let Some(Awaited { notice, time_s, .. }) = self.awaited.take_if(|awaited| now >= awaited.deadline)
        {
            eprintln!("blindgrasp: wait: `{}` did not come within {time_s} s", notice.key());
            self.waited_in_vain(now);
        }
        let may_go_on = self.talk.is_idle() && is_ready && self.awaited.is_none();
        if may_go_on && self.status == Status::Shown && !self.is_quitting {
            match self.typed.lines.pop_front() {
                Some(line) => {
                    self.typed.number += 1;
                    match self.execute(&line, now) {
                        Err(error) if self.typed.by_hand => eprintln!("blindgrasp: {}", in_a_line(&error)),
                        Err(error) => {
                            let number = self.typed.number;
                            let error = error.context(format!("line {number} of the script, which ends it"));
                            self.break_off(Broken::Misunderstood(error), now);
                        }
                        Ok(()) => {}
                    }
                }
                None if self.typed.has_ended => self.stop(true, now),
                None => {}
            }
        }
        Ok(())
    }

    fn stop(&mut self, quit: bool, now: Instant) {
        self.is_quitting |= quit;
        self.awaited = None;
        self.talk.ask(Request::Command(Command::Stop), now);
    }

    /// Ends a script whose next lines count on one that was not done.
    fn break_off(&mut self, broken: Broken, now: Instant) {
        if !self.is_quitting {
            self.broken = Some(broken);
            self.typed.lines.clear();
            self.stop(true, now);
        }
    }

    /// The same for a request that was not done; what is switched off has no value to show, which is no failure.
    fn not_done(&mut self, request: &Request, answer: Option<&Answer>, now: Instant) {
        let is_shown = matches!(request, Request::GetParameter { .. })
            && answer == Some(&Answer::Refused(Refusal::SwitchedOff));
        if !is_shown {
            self.waited_in_vain(now);
        }
    }

    /// The same for what the next lines count on.
    fn waited_in_vain(&mut self, now: Instant) {
        if !self.typed.by_hand && !self.is_quitting {
            eprintln!("blindgrasp: line {} of the script was not done, which ends it", self.typed.number);
            self.break_off(Broken::Refused, now);
        }
    }

    fn execute(&mut self, line: &str, now: Instant) -> anyhow::Result<()> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let Some((&word, rest)) = words.split_first() else { return Ok(()) };
        let joints = self.hand.as_ref().map_or(&[][..], |hand| &hand.joint_names);
        let names = Names { joints, postures: &self.postures };
        if let Some(command) = order::command(line, &names) {
            self.noticed.clear();
            return self.ask(Request::Command(command.map_err(|error| anyhow!(error))?), now);
        }
        match (word, rest) {
            ("help", []) => {
                let commands = order::WORDS.iter().map(|word| (order::usage(word), word.words));
                let others = WORDS.iter().map(|&(word, values, words)| (usage(word, values), words));
                for (usage, words) in commands.chain(others) {
                    say(format_args!("{usage:<34}  {words}"))?;
                }
                let notices: Vec<&str> = Notice::ALL.iter().map(|notice| notice.key()).collect();
                let lists = [
                    ("notices", notices.join(", ")),
                    ("postures", self.postures.join(", ")),
                    ("joints", joints.join(", ")),
                ];
                for (title, names) in lists.iter().filter(|(_, names)| !names.is_empty()) {
                    say(format_args!("{title}: {names}"))?;
                }
                Ok(())
            }
            ("wait", [notice]) => self.wait(notice, PATIENCE_S, now),
            ("wait", [notice, time_s]) => self.wait(notice, number(time_s)?, now),
            ("status", []) => {
                self.status = Status::Asked;
                self.talk.ask(self.telemetry(), now);
                Ok(())
            }
            ("quit", []) => {
                self.stop(true, now);
                Ok(())
            }
            ("watch", [interval]) => {
                self.watch(interval)?;
                self.talk.ask(self.telemetry(), now);
                Ok(())
            }
            ("get", []) => self.get(&Parameter::ALL, None, now),
            ("get", [key]) => self.get(&[parameter(key)?], None, now),
            ("get", [key, index]) => self.get(&[parameter(key)?], Some(integer(index)?), now),
            ("differs", []) => {
                self.differing = Some(0);
                self.get(&Parameter::ALL, None, now)
            }
            ("zero", []) => self.ask(Request::Zero { joint: None }, now),
            ("zero", [joint]) => self.ask(Request::Zero { joint: Some(integer(joint)?) }, now),
            ("confirm", []) => self.ask(Request::Confirm, now),
            ("save", []) => self.ask(Request::Save, now),
            ("defaults", []) => self.ask(Request::Defaults, now),
            ("set", [key, value]) => self.set(parameter(key)?, None, number(value)?, now),
            ("set", [key, index, value]) => {
                self.set(parameter(key)?, Some(integer(index)?), number(value)?, now)
            }
            _ => bail!(misuse(word)),
        }
    }

    /// Waits before the next line until the hand has noticed something, if it has not yet since its last command.
    fn wait(&mut self, notice: &str, time_s: f32, now: Instant) -> anyhow::Result<()> {
        let known = Notice::ALL.iter().find(|known| known.key() == notice);
        let Some(&notice) = known else {
            let all = Notice::ALL.iter().map(|notice| notice.key());
            bail!("`{notice}` is nothing that a hand notices: {}", suggestion(notice, all));
        };
        if !(0.0..=3600.0).contains(&time_s) {
            bail!("wait: {time_s} s: 0 to 3600 are wanted");
        }
        match self.noticed.iter().position(|&noticed| noticed == notice) {
            Some(at) => drop(self.noticed.remove(at)),
            None => {
                let deadline = now + Duration::from_secs_f32(time_s);
                self.awaited = Some(Awaited { notice, time_s, deadline });
            }
        }
        Ok(())
    }

    /// Tells what the hand has noticed.
    fn tell(&mut self, noticed: &Noticed, weight_n: f32) -> anyhow::Result<()> {
        let fingertips = self.hand.as_ref().map_or(&[][..], |hand| &hand.fingertip_names);
        let words = order::notice(noticed, fingertips);
        say(match noticed.notice {
            Notice::Weighed => format!("{words}: {}", weight(weight_n)),
            _ => words,
        })?;
        match self.awaited.take_if(|awaited| awaited.notice == noticed.notice) {
            Some(_) => {}
            None => self.noticed.push(noticed.notice),
        }
        Ok(())
    }

    fn ask(&mut self, request: Request, now: Instant) -> anyhow::Result<()> {
        self.talk.ask(request, now);
        Ok(())
    }

    fn get(&mut self, parameters: &[Parameter], index: Option<u8>, now: Instant) -> anyhow::Result<()> {
        for &parameter in parameters {
            for index in self.indices(parameter, index) {
                self.talk.ask(Request::GetParameter { parameter, index }, now);
            }
        }
        Ok(())
    }

    fn set(
        &mut self,
        parameter: Parameter,
        index: Option<u8>,
        value: f32,
        now: Instant,
    ) -> anyhow::Result<()> {
        for index in self.indices(parameter, index) {
            self.talk.ask(Request::SetParameter { parameter, index, value }, now);
        }
        Ok(())
    }

    /// The one index, or all that a parameter has.
    fn indices(&self, parameter: Parameter, index: Option<u8>) -> std::ops::Range<u8> {
        let count = parameter.count(self.joint_count);
        index.map_or(0..count, |index| index..index.saturating_add(1))
    }

    fn watch(&mut self, interval: &str) -> anyhow::Result<()> {
        self.watched = None;
        self.watch_ticks = match interval {
            "off" => None,
            ms => {
                let ms: u32 = ms.parse().ok().filter(|ms| (5..=60_000).contains(ms)).with_context(|| {
                    format!("watch: `{ms}` is neither `off` nor whole milliseconds from 5 to 60000")
                })?;
                Some((ms * 1000).div_ceil(self.period_us.max(1)))
            }
        };
        Ok(())
    }

    /// The request for as many records as are shown, or recorded.
    fn telemetry(&self) -> Request {
        let shown = self.watch_ticks.and_then(|ticks| u16::try_from(ticks).ok());
        match &self.recorder {
            Some(recorder) => recorder.telemetry(),
            None => telemetry(shown.map_or(SELDOM, |ticks| ticks.min(SELDOM))),
        }
    }

    fn show(&mut self, event: Event, now: Instant) -> anyhow::Result<()> {
        match event {
            Event::Open { firmware, period_us, ends_another } => {
                self.greet(&firmware, period_us)?;
                if firmware.changed.iter().any(|parameter| parameter.is_reading()) {
                    self.learn_reading(now);
                }
                if ends_another {
                    eprintln!("blindgrasp: warning: {ENDED_ANOTHER}");
                }
                Ok(())
            }
            Event::StartedAnew => {
                (self.status, self.watch_ticks) = (Status::Shown, None);
                self.typed.lines.clear();
                say(
                    "the device was reset: it has forgotten the session, and what was not saved; hello again",
                )?;
                if !self.typed.by_hand {
                    // It might arm with other limits than it has set.
                    bail!("the device was reset, which ends a script");
                }
                Ok(())
            }
            Event::Mode(mode) => say(format_args!("mode: {}", mode.words())),
            Event::Fault(None) => say("fault: none any more"),
            Event::Fault(Some(raised)) => {
                say(format_args!("{raised}; {}", raised.fault.remedy()))?;
                if self.awaited.take().is_some() {
                    self.waited_in_vain(now);
                }
                Ok(())
            }
            Event::Answer(Request::Telemetry { .. }, Answer::Done) => {
                if self.status == Status::Asked {
                    self.status = Status::Next;
                }
                Ok(())
            }
            Event::Answer(request, answer) => {
                match (&request, &answer) {
                    (Request::Telemetry { .. }, _) => self.status = Status::Shown,
                    (Request::Command(Command::Stop), Answer::Done) => self.is_over = self.is_quitting,
                    (Request::Command(Command::Stop), _) if self.is_quitting => {
                        bail!("{}: take the motors' power away", answered(&request, &answer))
                    }
                    (&Request::GetParameter { parameter, index }, answer)
                        if self.unshown > 0 && parameter.is_reading() =>
                    {
                        self.unshown -= 1;
                        if let Answer::Value(setting) = answer {
                            take_encoder(&mut self.encoders, parameter, index, setting.value);
                        }
                        return Ok(());
                    }
                    (&Request::GetParameter { parameter, index }, Answer::Value(Setting { value, file })) => {
                        take_encoder(&mut self.encoders, parameter, index, *value);
                        match &mut self.differing {
                            Some(_) if value == file => return Ok(()),
                            Some(count) => *count += 1,
                            None => {}
                        }
                    }
                    (Request::GetParameter { .. }, Answer::Refused(Refusal::SwitchedOff))
                        if self.differing.is_some() =>
                    {
                        return Ok(());
                    }
                    (&Request::SetParameter { parameter, index, value }, Answer::Done) => {
                        take_encoder(&mut self.encoders, parameter, index, value);
                    }
                    // What was set is shown.
                    (&Request::Zero { joint }, Answer::Done) => {
                        say(answered(&request, &answer))?;
                        return self.get(&[Parameter::ENCODER_ZERO], joint, now);
                    }
                    (Request::Defaults, Answer::Done) => self.learn_reading(now),
                    _ => {}
                }
                say(answered(&request, &answer))?;
                if let Answer::Refused(_) = answer {
                    self.not_done(&request, Some(&answer), now);
                }
                Ok(())
            }
            Event::Unsent(request) => say(format_args!("{}: not sent, because of stop", name(&request))),
            Event::Unanswered(Request::Command(Command::Stop)) => {
                let words = "stop: NO ANSWER: take the motors' power away";
                if self.is_quitting {
                    bail!(words);
                }
                eprintln!("blindgrasp: {words}");
                Ok(())
            }
            Event::Unanswered(request) => {
                (self.status, self.unshown, self.differing) = (Status::Shown, 0, None);
                eprintln!("blindgrasp: {}: no answer; whether it was done is not known", name(&request));
                self.not_done(&request, None, now);
                Ok(())
            }
            Event::Record(record) => self.look(&record),
            Event::Aside(..) | Event::Received(_) | Event::Sent(_) | Event::Damaged => Ok(()),
        }
    }

    fn greet(&mut self, firmware: &Firmware, period_us: u32) -> anyhow::Result<()> {
        (self.joint_count, self.period_us) = (firmware.joint_count, period_us);
        say(&firmware.words)?;
        let crash = firmware.crash.map_or("none".to_owned(), |crash| crash.to_string());
        let Firmware { clock, reset, brown_out, .. } = firmware;
        let (clock, reset, brown_out) = (clock.words(), reset.words(), brown_out.words());
        say(format_args!("clock: {clock}; started by: {reset}; brown-out reset: {brown_out}"))?;
        say(format_args!("last crash: {crash}"))?;
        self.tell_differences(firmware)?;
        let hand = HandModel::of_device(self.wanted_hand.as_deref(), &firmware.hand, firmware.hand_hash);
        self.hand = match hand {
            Ok((hand, _)) => Some(hand),
            Err(why) => {
                eprintln!("blindgrasp: warning: no angles: {why}");
                None
            }
        };
        self.postures = self.hand.as_ref().map_or(Vec::new(), HandModel::posture_names);
        let encoders = self.hand.as_ref().map_or(&[][..], |hand| &hand.config.estimator.encoders);
        self.encoders = encoders.to_vec();
        self.unshown = 0;
        Ok(())
    }

    /// Tells what is in force besides the hand's file.
    fn tell_differences(&self, firmware: &Firmware) -> anyhow::Result<()> {
        if !firmware.changed.is_empty() {
            let keys = firmware.changed.iter().map(ToString::to_string).collect::<Vec<_>>();
            say(format_args!("other than in the hand's file: {}; `differs` shows them", keys.join(", ")))?;
        }
        if let Some(Restored { saved, ignored: ignored @ 1.. }) = firmware.restored {
            eprintln!(
                "blindgrasp: warning: of {saved} parameters that were saved {ignored} are not in force: they were saved for another hand \
                 or by another firmware, or are looser than the hand's file; set what is missing and `save`, or `defaults`"
            );
        }
        Ok(())
    }

    /// Asks for the signs and zeros that angles are computed with; they are not shown.
    fn learn_reading(&mut self, now: Instant) {
        for parameter in Parameter::ALL.into_iter().filter(|parameter| parameter.is_reading()) {
            for index in self.indices(parameter, None) {
                self.talk.ask(Request::GetParameter { parameter, index }, now);
                self.unshown += 1;
            }
        }
    }

    fn look(&mut self, record: &Record) -> anyhow::Result<()> {
        if let Some(noticed) = &record.notice {
            self.tell(noticed, record.weight_n)?;
        }
        if self.status == Status::Next {
            self.status = Status::Shown;
            say(self.table(record).trim_end())?;
        }
        if let Some(ticks) = self.watch_ticks
            && self.watched.is_none_or(|watched| record.tick.wrapping_sub(watched) >= ticks)
        {
            self.watched = Some(record.tick);
            let time_s = f64::from(record.tick) * f64::from(self.period_us) * 1e-6;
            let mut line = format!("{time_s:.3} s {}", record.mode.words());
            let mut column = |title: &str, values: &mut dyn Iterator<Item = String>| {
                line = values.fold(format!("{line} {title}"), |line, value| line + " " + &value);
            };
            match (record.counts.as_slice(), &self.hand) {
                ([], _) => column("joints not read", &mut std::iter::empty()),
                (counts, None) => column("counts", &mut counts.iter().map(ToString::to_string)),
                (counts, Some(_)) => {
                    let angles = (0..counts.len()).filter_map(|k| self.angle_rad(record, k));
                    column("angles_rad", &mut angles.map(|rad| format!("{rad:.3}")));
                }
            }
            column("torques_nm", &mut record.torques_nm.iter().map(|nm| format!("{nm:.4}")));
            say(line)?;
        }
        Ok(())
    }

    /// Angle of a joint as its count tells it, if the hand is known and was read.
    fn angle_rad(&self, record: &Record, joint: usize) -> Option<f32> {
        Some(self.encoders.get(joint)?.angle_rad(*record.counts.as_slice().get(joint)?))
    }

    fn table(&self, record: &Record) -> String {
        let mut text = format!("mode       {}\n", record.mode.words());
        let mut row = |name: &str, value: String| text += &format!("{name:<11}{value}\n");
        row(
            "fault",
            record.fault.map_or("none".to_owned(), |raised| format!("{raised}; {}", raised.fault.remedy())),
        );
        if let Some(raised) = record.reading_failed {
            let state = match record.counts.as_slice() {
                [] => "not read",
                _ => "tested, `clear` brings them back",
            };
            row("joints", format!("{state}: {raised}"));
        }
        let gains = GAINS.iter().zip(record.gains.iter());
        let gains = gains.map(|(gain, value)| format!("{value} {}", gain.unit)).collect::<Vec<_>>();
        row("grasp", gains.join(", "));
        if record.mode.is_grasp() {
            row("held", held(record));
        }
        if record.weight_n != 0.0 {
            row("weighed", weight(record.weight_n));
        }
        let energies =
            scalars(record).into_iter().skip(potentials().end).filter(|(signal, _)| signal.unit == "J");
        let energies = energies.map(|(signal, value)| format!("{} {value:.6} J", label(&signal)));
        row("energy", energies.collect::<Vec<_>>().join(", "));
        row("cycles", record.cycles.to_string());
        row("lost", format!("{} records and answers", record.dropped));
        row("link", self.talk.traffic().to_string());
        let names = self.hand.as_ref().map_or(&[][..], |hand| &hand.joint_names);
        let cell = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
        text += &format!(
            "{:<5} {:<18} {:>10} {:>9} {:>9}  limited by\n",
            "joint", "name", "count", "angle_rad", "torque_nm"
        );
        for k in 0..self.joint_count {
            let _ = writeln!(
                text,
                "{k:<5} {:<18} {:>10} {:>9} {:>9}  {}",
                cell(names.get(k).cloned()),
                cell(record.counts.as_slice().get(k).map(ToString::to_string)),
                cell(self.angle_rad(record, k).map(|rad| format!("{rad:.3}"))),
                cell(record.torques_nm.as_slice().get(k).map(|nm| format!("{nm:.4}"))),
                cell(record.limiting.as_slice().get(k).map(ToString::to_string)),
            );
        }
        text
    }
}

/// Returns the way and the turn of what is held since the grasp began, in the words of `move`.
fn held(record: &Record) -> String {
    let Move { position_m, turn_rad, .. } = wire::held(record);
    // No -0.0 is shown.
    let tenths = |value: f32| (10.0 * value).round() / 10.0 + 0.0;
    let [x_mm, y_mm, z_mm] = position_m.map(|m| tenths(1e3 * m));
    let [turn_x, turn_y, turn_z] = turn_rad.map(|rad| tenths(rad.to_degrees()));
    format!("x_mm={x_mm} y_mm={y_mm} z_mm={z_mm} turn_x_deg={turn_x} turn_y_deg={turn_y} turn_z_deg={turn_z}")
}

/// Returns a weight in words, and the mass that has it.
fn weight(weight_n: f32) -> String {
    format!("{weight_n:.3} N ({:.0} g)", weight_n / 9.81 * 1e3)
}

/// Prints a line.
fn say(line: impl Display) -> anyhow::Result<()> {
    terminal::print(&format!("{line}\n")).context("cannot print")
}

/// Returns the error of a line that was lost.
fn lost(error: TransportError) -> anyhow::Error {
    anyhow!(error).context("the line is lost")
}

/// Returns the words of a request, as it was typed.
fn name(request: &Request) -> String {
    let indexed = |parameter: Parameter, index| match parameter.each() {
        Each::Hand if index == 0 => parameter.to_string(),
        _ => format!("{parameter}[{index}]"),
    };
    match *request {
        Request::Command(command) => command.words().to_owned(),
        Request::GetParameter { parameter, index } => indexed(parameter, index),
        Request::SetParameter { parameter, index, value } => {
            format!("{} = {value}", indexed(parameter, index))
        }
        Request::Zero { joint: None } => "zero".to_owned(),
        Request::Zero { joint: Some(joint) } => format!("zero of joint {joint}"),
        Request::Confirm => "confirm".to_owned(),
        Request::Save => "save".to_owned(),
        Request::Defaults => "defaults".to_owned(),
        _ => "records".to_owned(),
    }
}

/// An answer in words.
fn answered(request: &Request, answer: &Answer) -> String {
    match (request, answer) {
        (&Request::Command(command), Answer::Done) => command::Answer { command, refused: None }.to_string(),
        (Request::GetParameter { parameter, .. }, Answer::Value(Setting { value, file })) => {
            let file = match parameter.bound() {
                Bound::Free if value == file => String::new(),
                Bound::Free => format!("; {file} in the hand's file"),
                Bound::AtMost => format!("; at most {file}, as in the hand's file"),
                Bound::AtLeast => format!("; at least {file}, as in the hand's file"),
            };
            let unit = if parameter.unit().is_empty() { "" } else { ", " };
            let words = format!("{}{unit}{}", parameter.words(), parameter.unit());
            format!("{} = {value}  ({words}{file})", name(request))
        }
        (request, Answer::Refused(refusal)) => format!("{}: refused, {}", name(request), refusal.words()),
        (request, _) => format!("{}: done", name(request)),
    }
}

fn parameter(key: &str) -> anyhow::Result<Parameter> {
    Parameter::named(key).with_context(|| {
        let keys = Parameter::ALL.map(|parameter| parameter.to_string());
        let keys = keys.iter().map(String::as_str);
        format!(
            "`{key}` is not a parameter: {}",
            similar(key, keys).unwrap_or("type `get` for all".to_owned())
        )
    })
}

fn number(word: &str) -> anyhow::Result<f32> {
    word.parse().with_context(|| format!("`{word}` is not a number"))
}

fn integer(word: &str) -> anyhow::Result<u8> {
    word.parse().with_context(|| format!("`{word}` is not an index from 0 to 255"))
}

/// Returns a word with the values that it takes.
fn usage(word: &str, values: &str) -> String {
    format!("{word} {values}").trim_end().to_owned()
}

/// Returns the advice for a line that begins with this word and is not understood.
fn misuse(word: &str) -> String {
    if let Some((word, values, words)) = WORDS.iter().find(|(known, ..)| *known == word) {
        return format!("use: {}: {words}", usage(word, values));
    }
    let known = order::WORDS.iter().map(|known| known.word).chain(WORDS.iter().map(|&(known, ..)| known));
    format!("`{word}` is not a command: {}", similar(word, known).unwrap_or("type `help` for all".to_owned()))
}

fn similar<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let likeness = |candidate: &str| strsim::jaro_winkler(word, candidate);
    let best = known.max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    (likeness(best) > 0.8).then(|| format!("did you mean `{best}`?"))
}
