//! `blindgrasp monitor`: a hand, or a recording of one, in a terminal.

use super::Outcome;
use anyhow::{Context, bail};
use blindgrasp::device::interrupt;
use blindgrasp::device::recorder::Recording;
use blindgrasp::device::transport::ports_in_words;
use blindgrasp::model::HandModel;
use blindgrasp::monitor::input::{Input, Intent, Situation};
use blindgrasp::monitor::jog::Jog;
use blindgrasp::monitor::live::{Live, Told};
use blindgrasp::monitor::model::{Level, Link, Model, News, Plot};
use blindgrasp::monitor::playback::Playback;
use blindgrasp::monitor::view::{self, Palette, Screen, Source};
use blindgrasp::record::mcap::RecordingError;
use blindgrasp_shared::command::{Command, Refusal};
use clap::Args;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyEventKind};
use std::io::{self, IsTerminal as _};
use std::mem::ManuallyDrop;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// From one picture to the next.
const FRAME: Duration = Duration::from_millis(40);
/// Longest time that a stop before the end may take: it is sent five times, 100 ms apart.
const STOPPING: Duration = Duration::from_secs(1);
/// Within this time a signal is seen, or the program ends without ceremony.
const NOTICING: Duration = Duration::from_secs(5);
/// Ticks from one recorded record to the next.
const EVERY_TICK: u16 = 1;
/// Times of the plots, s.
const WINDOWS_S: [u64; 3] = [5, 20, 60];

/// Watch a hand in a terminal, and command it; or play a recording back
///
/// Shows mode, fault, what limits, refusals in words, the heartbeat that is left, the link's health, a bar for each joint and
/// plots. Keys arm, grasp, move what is held, put it down, release, disarm and stop; `?` lists them. What can move or drop something is asked about first; a
/// stop (space) never is. Ctrl-C stops the hand, a second one ends the program.
///
/// Exit code 0: ended, and a stop that was wanted is confirmed; 2: bad usage, no such port or file, the stop is not confirmed,
/// or the recording ended too early.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A recording to play back
    #[arg(value_name = "FILE", conflicts_with_all = ["port", "out"])]
    file: Option<PathBuf>,
    /// A serial port (/dev/ttyUSB0, COM3), or unix:PATH for a socket at which somebody listens
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// The hand's file, if it is not built in: for angles and the joints' names
    #[arg(long, value_name = "HAND")]
    hand: Option<String>,
    /// Rate of the line, baud [default: the fastest that hand and adapter can]
    #[arg(long, value_name = "BAUD", conflicts_with = "file")]
    baud: Option<u32>,
    /// Device of the recording; the first, if nothing is said
    #[arg(long, value_name = "NAME", requires = "file")]
    device: Option<String>,
    /// Record everything that goes over the line, while it is watched
    #[arg(long, value_name = "FILE.mcap")]
    out: Option<PathBuf>,
    /// Overwrite the recording
    #[arg(long, requires = "out")]
    force: bool,
}

/// Signals to end that were seen.
static SEEN: AtomicU32 = AtomicU32::new(0);

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let hand = arguments.hand.as_deref();
    match (&arguments.file, &arguments.port) {
        (Some(file), _) => {
            let mut playback = Playback::open(file, arguments.device.as_deref(), hand)?;
            let mut terminal = Restored::new()?;
            let name = file.display().to_string();
            Monitor::new().play(&mut terminal.0, &mut playback, &name)?;
            Ok(Outcome::Shown)
        }
        (None, Some(port)) => watch(port, arguments),
        (None, None) => {
            bail!("nothing to watch: name a port with --port, or a recording; {}", ports_in_words())
        }
    }
}

/// Watches a hand until the user wants an end.
fn watch(port: &str, arguments: &Arguments) -> anyhow::Result<Outcome> {
    refuse_without_terminal()?;
    let recording =
        arguments.out.as_ref().map(|path| Recording::create(path, arguments.force)).transpose()?;
    let hands = arguments.hand.as_slice();
    let recorder = recording.as_ref().map(|recording| recording.add("hand", port, hands, EVERY_TICK));
    let live = Live::open(port, arguments.baud, arguments.hand.as_deref(), recorder)?;
    let mut terminal = Restored::new()?;
    let mut monitor = Monitor::new();
    let ended = monitor.watch(&mut terminal.0, &live, port, recording.as_ref());
    if ended.is_err() {
        // Whatever it was: nobody watches any more.
        live.ask(Command::Stop);
        wait_for_stop(&live);
    }
    drop(terminal);
    live.close();
    let saved = recording.map(|recording| recording.finish()).transpose();
    if let (Some(path), Ok(Some(saved))) = (&arguments.out, &saved) {
        match saved.bytes {
            0 => eprintln!("blindgrasp: {}: not written: nothing was recorded", path.display()),
            _ => eprintln!("blindgrasp: recorded {}: {saved}", path.display()),
        }
    }
    match ended? {
        Ended::Stopped(true) => eprintln!("blindgrasp: stop: done"),
        Ended::Stopped(false) => bail!("stop: NO ANSWER: take the motors' power away"),
        Ended::LetGo if monitor.may_have_torque() => {
            eprintln!("blindgrasp: the heartbeat has ended: the hand lets go, and is in fault 10 then");
        }
        Ended::LetGo => {}
    }
    saved?;
    match monitor.unrecorded {
        Some(error) => Err(error).context("the recording has ended too early"),
        None => Ok(Outcome::Shown),
    }
}

fn refuse_without_terminal() -> anyhow::Result<()> {
    if io::stdin().is_terminal() && io::stdout().is_terminal() {
        return Ok(());
    }
    bail!(
        "monitor needs a terminal for its input and its output: for scripts there is `blindgrasp console`, and `blindgrasp record` records"
    )
}

/// Waits until there may be keys. Here, because crossterm reads for ever from a terminal that is gone, while the heartbeat
/// would go on.
#[cfg(unix)]
fn wait_for_keys(time: Duration) -> anyhow::Result<()> {
    use nix::errno::Errno;
    use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
    use std::os::fd::AsFd as _;
    let input = io::stdin();
    let mut input = [PollFd::new(input.as_fd(), PollFlags::POLLIN)];
    match poll(&mut input, PollTimeout::try_from(time).unwrap_or(PollTimeout::ZERO)) {
        Ok(_) | Err(Errno::EINTR) => {}
        Err(error) => return Err(error).context("cannot wait for keys"),
    }
    let is_gone = PollFlags::POLLHUP | PollFlags::POLLERR | PollFlags::POLLNVAL;
    if input[0].revents().is_some_and(|flags| flags.intersects(is_gone)) {
        bail!("the terminal is gone");
    }
    Ok(())
}

/// Waits until there may be keys.
#[cfg(not(unix))]
fn wait_for_keys(time: Duration) -> anyhow::Result<()> {
    event::poll(time).context("cannot wait for keys")?;
    Ok(())
}

/// A terminal that is given back as it was, whatever happens. Its own drop panics where there is nothing left to print to.
struct Restored(ManuallyDrop<DefaultTerminal>);

impl Restored {
    fn new() -> anyhow::Result<Self> {
        refuse_without_terminal()?;
        interrupt::listen_by(|signals| {
            std::thread::spawn(move || {
                std::thread::sleep(NOTICING);
                // A heartbeat that nobody can end would hold the hand closed.
                if SEEN.load(Ordering::Relaxed) < signals {
                    std::process::exit(2);
                }
            });
        });
        Ok(Self(ManuallyDrop::new(ratatui::try_init().context("cannot use this terminal")?)))
    }
}

impl Drop for Restored {
    fn drop(&mut self) {
        // What can't be given back to a terminal that is gone is not worth a panic.
        let _ = self.0.show_cursor();
        let _ = ratatui::try_restore();
    }
}

/// The end of the view.
enum Ended {
    /// After a stop, and whether that is confirmed.
    Stopped(bool),
    /// Without.
    LetGo,
}

/// Waits a little for what becomes of a stop.
fn wait_for_stop(live: &Live) -> bool {
    let until = Instant::now() + STOPPING;
    while Instant::now() < until {
        let Some(told) = live.fetch() else { return false };
        for told in told {
            if let Told::Stopped(is_confirmed) = told {
                return is_confirmed;
            }
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    false
}

/// The view and its state.
struct Monitor {
    input: Input,
    situation: Situation,
    jog: Jog,
    /// Signals that were seen.
    signals: u32,
    /// The reason for which the recording has ended too early, if it has.
    unrecorded: Option<RecordingError>,
    plot: usize,
    window: usize,
    joint: Option<usize>,
    help: bool,
    palette: Palette,
}

impl Monitor {
    fn new() -> Self {
        // See no-color.org.
        let coloured = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
        Self {
            input: Input::default(),
            jog: Jog::default(),
            situation: Situation { is_live: true, is_heard: false, mode: None },
            signals: interrupt::count(),
            unrecorded: None,
            plot: 0,
            window: 1,
            joint: None,
            help: false,
            palette: Palette { coloured },
        }
    }

    fn watch(
        &mut self,
        terminal: &mut DefaultTerminal,
        live: &Live,
        port: &str,
        recording: Option<&Recording>,
    ) -> anyhow::Result<Ended> {
        let mut model = Model::new();
        // When the end was wanted, after a stop.
        let mut stopping: Option<Instant> = None;
        loop {
            let told = live.fetch().context("the thread of the line has ended")?;
            for told in told {
                match told {
                    Told::News(at, news) => {
                        if let News::Record(record) = &news {
                            self.jog.see(record);
                        }
                        model.take(at, news);
                    }
                    Told::Moved(to, is_taken) => self.jog.answered(to, is_taken),
                    Told::Stopped(is_confirmed) if stopping.is_some() => {
                        return Ok(Ended::Stopped(is_confirmed));
                    }
                    Told::Stopped(_) => {}
                    Told::Unrecorded(error) => self.unrecorded = Some(error),
                }
            }
            if stopping.is_some_and(|since| since.elapsed() > STOPPING) {
                return Ok(Ended::Stopped(false));
            }
            let is_heard = *model.link() == Link::Open;
            self.situation = Situation { is_live: true, is_heard, mode: model.mode() };
            let saved = recording.map(|recording| match &self.unrecorded {
                Some(_) => "ENDED".into(),
                None => recording.saved().to_string(),
            });
            self.draw(terminal, &model, Source::Port { port, saved: saved.as_deref() }, live.now())?;
            let intent = match self.signalled() {
                true if self.may_have_torque() => Some(Intent::StopAndQuit),
                true => Some(Intent::Quit),
                false => self.intent(FRAME, live.now())?,
            };
            match intent {
                Some(Intent::Ask(command)) => live.ask(command),
                Some(Intent::Jog(step)) => {
                    if let Some(record) = model.record() {
                        live.ask(Command::Move(self.jog.step(step, record)));
                    }
                }
                Some(Intent::NothingHeld) => {
                    let words = format!("move: {}", Refusal::NotCarrying.words());
                    model.take(live.now(), News::Notice(Level::Warning, words));
                }
                Some(Intent::Quit) => return Ok(Ended::LetGo),
                Some(Intent::StopAndQuit) => {
                    live.ask(Command::Stop);
                    stopping.get_or_insert_with(Instant::now);
                }
                Some(intent) => self.look(intent, &model),
                None => {}
            }
        }
    }

    fn play(
        &mut self,
        terminal: &mut DefaultTerminal,
        playback: &mut Playback,
        file: &str,
    ) -> anyhow::Result<()> {
        let mut last = Instant::now();
        loop {
            let now = Instant::now();
            playback.turn(now - last)?;
            last = now;
            let position = playback.position();
            let mode = playback.model().mode();
            self.situation = Situation { is_live: false, is_heard: true, mode };
            let (device, _) = playback.device();
            let source = Source::Recording {
                file,
                device,
                length: playback.length(),
                speed: playback.speed(),
                is_paused: playback.is_paused(),
                is_seeking: playback.is_seeking(),
            };
            self.draw(terminal, playback.model(), source, position)?;
            if self.signalled() {
                return Ok(());
            }
            match self.intent(FRAME, position)? {
                Some(Intent::Quit) => return Ok(()),
                Some(Intent::Pause) => playback.pause()?,
                Some(Intent::Forward(by)) => playback.forward(by),
                Some(Intent::Back(by)) => playback.back(by)?,
                Some(Intent::OnlyRecorded) => playback.say("this is a recording, which takes no commands"),
                Some(Intent::Faster) => playback.hurry(true),
                Some(Intent::Slower) => playback.hurry(false),
                Some(intent) => self.look(intent, playback.model()),
                None => {}
            }
        }
    }

    /// Returns `true` if another signal to end came.
    fn signalled(&mut self) -> bool {
        let signals = interrupt::count();
        SEEN.store(signals, Ordering::Relaxed);
        std::mem::replace(&mut self.signals, signals) != signals
    }

    fn draw(
        &mut self,
        terminal: &mut DefaultTerminal,
        model: &Model,
        source: Source<'_>,
        now: Duration,
    ) -> anyhow::Result<()> {
        self.input.turn(now);
        let postures = model.hand().map_or(Vec::new(), HandModel::posture_names);
        let question = self.input.question(now, &postures);
        let screen = Screen {
            source,
            plot: Plot::all()[self.plot],
            window_s: WINDOWS_S[self.window],
            joint: self.joint,
            help: self.help,
            question: question.as_ref().map(|(words, left_s)| (words.as_ref(), *left_s)),
            is_jogging: self.input.is_jogging(self.situation),
            palette: self.palette,
        };
        let drawn = terminal.draw(|frame| view::draw(frame, model, &screen, now));
        drawn.context("cannot draw: the terminal is gone")?;
        Ok(())
    }

    /// Returns the intent of the next key that is pressed within a frame.
    fn intent(&mut self, frame: Duration, now: Duration) -> anyhow::Result<Option<Intent>> {
        let until = Instant::now() + frame;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            wait_for_keys(left)?;
            while event::poll(Duration::ZERO).context("cannot read the keys")? {
                match event::read().context("cannot read the keys")? {
                    // Terminals that tell of keys that are let go would do everything twice.
                    Event::Key(key) if key.kind != KeyEventKind::Release => {
                        if let Some(intent) = self.input.press(key, self.situation, now) {
                            return Ok(Some(intent));
                        }
                    }
                    Event::Resize(..) => return Ok(None),
                    _ => {}
                }
            }
            if left.is_zero() {
                return Ok(None);
            }
        }
    }

    fn may_have_torque(&self) -> bool {
        self.situation.may_have_torque()
    }

    /// Does what concerns the view alone.
    fn look(&mut self, intent: Intent, model: &Model) {
        let step =
            |at: usize, by: isize, count: usize| (at as isize + by).rem_euclid(count as isize) as usize;
        match intent {
            Intent::Plot(by) => self.plot = step(self.plot, by, Plot::all().len()),
            Intent::Window => self.window = step(self.window, 1, WINDOWS_S.len()),
            Intent::Joint(by) => {
                // The first place is that of all joints.
                let place = self.joint.map_or(0, |joint| joint + 1);
                self.joint = step(place, by, model.joint_count() + 1).checked_sub(1);
            }
            Intent::Help => self.help = !self.help,
            _ => {}
        }
    }
}
