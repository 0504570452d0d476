//! `blindgrasp monitor`: a hand, or a recording of one, in a terminal.

use super::Outcome;
use anyhow::{Context, bail};
use blindgrasp::device::transport::ports_in_words;
use blindgrasp::monitor::input::{Input, Intent, Situation};
use blindgrasp::monitor::live::{Live, Told};
use blindgrasp::monitor::model::{Link, Model, Plot};
use blindgrasp::monitor::view::{self, Palette, Screen, Source};
use blindgrasp_shared::command::Command;
use clap::Args;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyEvent, KeyEventKind};
use std::io::{self, IsTerminal as _};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// From one picture to the next.
const FRAME: Duration = Duration::from_millis(40);
/// How long a stop before the end may take: it is sent five times, 100 ms apart.
const STOPPING: Duration = Duration::from_secs(1);
/// Times of the plots, s.
const WINDOWS_S: [u64; 3] = [5, 20, 60];

/// Watch a hand in a terminal, and command it; or play a recording back
///
/// Shows mode, fault, what limits, refusals in words, the heartbeat that is left, the link's health, a bar for each joint and
/// plots. Keys arm, grasp, release, disarm and stop; `?` lists them. What can move or drop something is asked about first; a
/// stop (space) never is. Ctrl-C stops the hand, a second one ends the program.
///
/// Exit code 0: ended, and a stop that was wanted is confirmed; 2: bad usage, no such port, or the stop is not confirmed.
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
}

/// Signals to end that came.
static SIGNALS: AtomicU32 = AtomicU32::new(0);

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let Some(port) = &arguments.port else {
        bail!("nothing to watch: name a port with --port, or a recording; {}", ports_in_words());
    };
    if !(io::stdin().is_terminal() && io::stdout().is_terminal()) {
        bail!(
            "monitor needs a terminal for its input and its output: for scripts there is `blindgrasp console`, and `blindgrasp record` records"
        );
    }
    let live = Live::open(port, arguments.hand.as_deref())?;
    // Without the handler a signal ends the program; the hand then lets go for want of a heartbeat.
    let _ = ctrlc::set_handler(|| {
        SIGNALS.fetch_add(1, Ordering::Relaxed);
    });
    let mut terminal = Restored(ratatui::try_init().context("cannot use this terminal")?);
    let mut monitor = Monitor::new();
    let ended = monitor.watch(&mut terminal.0, &live, port);
    drop(terminal);
    let ended = match ended {
        Ok(ended) => ended,
        Err(error) => {
            // Whatever it was: nobody watches any more.
            live.ask(Command::Stop);
            wait_for_stop(&live);
            return Err(error);
        }
    };
    match ended {
        Ended::Stopped(true) => eprintln!("blindgrasp: stop: done"),
        Ended::Stopped(false) => bail!("stop: NO ANSWER: take the motors' power away"),
        Ended::LetGo if monitor.situation().may_have_torque() => {
            eprintln!("blindgrasp: the heartbeat has ended: the hand lets go, and is in fault 10 then");
        }
        Ended::LetGo => {}
    }
    Ok(Outcome::Shown)
}

/// A terminal that is given back as it was, whatever happens.
struct Restored(DefaultTerminal);

impl Drop for Restored {
    fn drop(&mut self) {
        let _ = self.0.show_cursor();
        ratatui::restore();
    }
}

/// How it ended.
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

/// What is shown, and how.
struct Monitor {
    model: Model,
    input: Input,
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
            model: Model::new(),
            input: Input::default(),
            plot: 0,
            window: 1,
            joint: None,
            help: false,
            palette: Palette { coloured },
        }
    }

    fn watch(&mut self, terminal: &mut DefaultTerminal, live: &Live, port: &str) -> anyhow::Result<Ended> {
        let source = Source::Port { port, saved: None };
        let mut signals = SIGNALS.load(Ordering::Relaxed);
        // When the end was wanted, after a stop.
        let mut stopping: Option<Instant> = None;
        loop {
            let told = live.fetch().context("the thread of the line has ended")?;
            for told in told {
                match told {
                    Told::News(at, news) => self.model.take(at, news),
                    Told::Stopped(is_confirmed) if stopping.is_some() => {
                        return Ok(Ended::Stopped(is_confirmed));
                    }
                    Told::Stopped(_) => {}
                }
            }
            if stopping.is_some_and(|since| since.elapsed() > STOPPING) {
                return Ok(Ended::Stopped(false));
            }
            self.draw(terminal, source, live.now())?;
            let mut intents = self.intents(FRAME, live.now())?;
            let signalled = SIGNALS.load(Ordering::Relaxed);
            if std::mem::replace(&mut signals, signalled) != signalled {
                intents.push(match self.situation().may_have_torque() {
                    true => Intent::StopAndQuit,
                    false => Intent::Quit,
                });
            }
            for intent in intents {
                match intent {
                    Intent::Ask(command) => live.ask(command),
                    Intent::Quit => return Ok(Ended::LetGo),
                    Intent::StopAndQuit => {
                        live.ask(Command::Stop);
                        stopping.get_or_insert_with(Instant::now);
                    }
                    intent => self.look(intent),
                }
            }
        }
    }

    fn draw(
        &mut self,
        terminal: &mut DefaultTerminal,
        source: Source<'_>,
        now: Duration,
    ) -> anyhow::Result<()> {
        self.input.turn(now);
        let screen = Screen {
            source,
            plot: Plot::ALL[self.plot],
            window_s: WINDOWS_S[self.window],
            joint: self.joint,
            help: self.help,
            question: self.input.question(now),
            palette: self.palette,
        };
        let drawn = terminal.draw(|frame| view::draw(frame, &self.model, &screen, now));
        drawn.context("cannot draw: the terminal is gone")?;
        Ok(())
    }

    /// What the keys of the next frame want; at once when there is one.
    fn intents(&mut self, frame: Duration, now: Duration) -> anyhow::Result<Vec<Intent>> {
        let mut intents = Vec::new();
        let until = Instant::now() + frame;
        while event::poll(until.saturating_duration_since(Instant::now())).context("cannot read the keys")? {
            let Event::Key(key) = event::read().context("cannot read the keys")? else {
                // Another size: it is drawn anew.
                break;
            };
            if let Some(intent) = self.press(key, now) {
                intents.push(intent);
                break;
            }
        }
        Ok(intents)
    }

    fn press(&mut self, key: KeyEvent, now: Duration) -> Option<Intent> {
        let situation = self.situation();
        // Terminals that tell of keys that are let go would do everything twice.
        if key.kind == KeyEventKind::Release {
            return None;
        }
        self.input.press(key, situation, now)
    }

    fn situation(&self) -> Situation {
        Situation { is_live: true, is_heard: *self.model.link() == Link::Open, mode: self.model.mode() }
    }

    /// What concerns the view alone.
    fn look(&mut self, intent: Intent) {
        let step =
            |at: usize, by: isize, count: usize| (at as isize + by).rem_euclid(count as isize) as usize;
        match intent {
            Intent::Plot(by) => self.plot = step(self.plot, by, Plot::ALL.len()),
            Intent::Window => self.window = step(self.window, 1, WINDOWS_S.len()),
            Intent::Joint(by) => {
                // The first place is that of all joints.
                let place = self.joint.map_or(0, |joint| joint + 1);
                self.joint = step(place, by, self.model.joint_count() + 1).checked_sub(1);
            }
            Intent::Help => self.help = !self.help,
            _ => {}
        }
    }
}
