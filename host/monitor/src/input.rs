//! Keys to intents. What can move or drop something is asked about first; a stop never is.

use super::jog::Step;
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::supervisor::Mode;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use std::borrow::Cow;
use std::time::Duration;

/// Time for which a question waits for its answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Of a recording: what an arrow and what a page key skips.
const SECOND: Duration = Duration::from_secs(1);
const PAGE: Duration = Duration::from_secs(10);

/// The situation, on which the meaning of keys depends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Situation {
    /// `true` if there is a hand, not a recording.
    pub is_live: bool,
    /// `true` if it answers.
    pub is_heard: bool,
    /// The last mode that is known.
    pub mode: Option<Mode>,
}

impl Situation {
    /// Returns `true` if the joints may have torque: for all that is known.
    pub fn may_have_torque(self) -> bool {
        self.is_live && self.mode.is_some_and(Mode::is_powered)
    }

    /// Returns `true` if something may be in the hand.
    fn may_hold(self) -> bool {
        self.mode.is_none_or(Mode::is_grasp)
    }
}

/// The intent of the user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Intent {
    /// Something of the hand.
    Ask(Command),
    /// To move what is held by a step.
    Jog(Step),
    /// To move what is held, where nothing is.
    NothingHeld,
    /// To stop the hand, and then to end.
    StopAndQuit,
    /// An end.
    Quit,
    /// Another plot: so many further.
    Plot(isize),
    /// Another time for the plots.
    Window,
    /// Another joint: so many further.
    Joint(isize),
    /// The list of the keys, or no longer.
    Help,
    /// Of a recording: a pause, or on.
    Pause,
    /// Of a recording: later.
    Forward(Duration),
    /// Of a recording: earlier.
    Back(Duration),
    /// Of a recording: twice as fast, or half.
    Faster,
    /// See [`Self::Faster`].
    Slower,
    /// A command in a recording, which takes none.
    OnlyRecorded,
}

/// The subject of a question.
#[derive(Clone, Copy, Debug, PartialEq)]
enum About {
    Command(Command),
    /// Which of the postures.
    Posture,
    Jog,
    Quit,
}

/// A question that waits for its answer.
#[derive(Clone, Copy, Debug)]
struct Question {
    about: About,
    until: Duration,
}

/// The state between two keys.
#[derive(Clone, Debug, Default)]
pub struct Input {
    question: Option<Question>,
    /// `true` while keys move what is held.
    is_jogging: bool,
    /// `true` if Ctrl-C came before.
    was_interrupted: bool,
}

impl Input {
    /// A key at a time.
    pub fn press(&mut self, key: KeyEvent, situation: Situation, now: Duration) -> Option<Intent> {
        self.turn(now);
        // What is held again is moved by keys when that is confirmed again.
        self.is_jogging = self.is_jogging(situation);
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return (key.code == KeyCode::Char('c')).then(|| self.interrupt(situation));
        }
        let question = self.question.map(|question| question.about);
        if situation.is_live {
            match (key.code, question) {
                (KeyCode::Char('s') | KeyCode::Enter, Some(About::Quit)) => {
                    self.question = None;
                    return Some(Intent::StopAndQuit);
                }
                (KeyCode::Char(' ' | 's'), _) => {
                    self.question = None;
                    return Some(Intent::Ask(Command::Stop));
                }
                (KeyCode::Char('y') | KeyCode::Enter, Some(About::Command(command))) => {
                    (self.question, self.is_jogging) = (None, false);
                    return Some(Intent::Ask(command));
                }
                (KeyCode::Char('y'), Some(About::Quit)) => return Some(Intent::Quit),
                (KeyCode::Char('y') | KeyCode::Enter, Some(About::Jog)) => {
                    self.question = None;
                    self.is_jogging = true;
                    return None;
                }
                (KeyCode::Char(number @ '1'..='9'), Some(About::Posture)) => {
                    self.question = None;
                    let posture = Some(number as u8 - b'1');
                    return Some(Intent::Ask(Command::Posture { posture, time_ms: 0 }));
                }
                (KeyCode::Esc | KeyCode::Char('n'), Some(_)) => {
                    self.question = None;
                    return None;
                }
                (KeyCode::Esc | KeyCode::Char('j'), None) if self.is_jogging(situation) => {
                    self.is_jogging = false;
                    return None;
                }
                (KeyCode::Char(key), None) if self.is_jogging(situation) => {
                    if let Some(step) = Step::of(key) {
                        return Some(Intent::Jog(step));
                    }
                }
                _ => {}
            }
        }
        let command = match key.code {
            KeyCode::Char('a') => Command::Arm,
            KeyCode::Char('d') => Command::Disarm,
            KeyCode::Char('g') => Command::Grasp(Grasp::CONFIGURED),
            KeyCode::Char('r') => Command::Release,
            KeyCode::Char('c') => Command::ClearFault,
            KeyCode::Char('l') => Command::PutDown,
            KeyCode::Char('k') => Command::Weigh,
            KeyCode::Char('p') if situation.is_live => {
                self.ask(About::Posture, now);
                return None;
            }
            KeyCode::Char('j') if situation.is_live => {
                if situation.mode != Some(Mode::Carrying) {
                    return Some(Intent::NothingHeld);
                }
                self.ask(About::Jog, now);
                return None;
            }
            KeyCode::Char('p' | 'j') => return Some(Intent::OnlyRecorded),
            code => return self.look(code, situation, now),
        };
        if !situation.is_live {
            return Some(Intent::OnlyRecorded);
        }
        let is_harmless = match command {
            Command::ClearFault => true,
            Command::Disarm => !situation.may_hold(),
            _ => false,
        };
        if is_harmless {
            self.question = None;
            return Some(Intent::Ask(command));
        }
        self.ask(About::Command(command), now);
        None
    }

    /// Keys that the hand does not notice.
    fn look(&mut self, code: KeyCode, situation: Situation, now: Duration) -> Option<Intent> {
        Some(match code {
            KeyCode::Char('q') => {
                // A hand that is not heard can't be stopped, and gets no heartbeat any more.
                if situation.may_have_torque() && situation.is_heard {
                    self.ask(About::Quit, now);
                    return None;
                }
                Intent::Quit
            }
            KeyCode::Char('?' | 'h') => Intent::Help,
            KeyCode::Tab => Intent::Plot(1),
            KeyCode::BackTab => Intent::Plot(-1),
            KeyCode::Char('w') => Intent::Window,
            KeyCode::Down => Intent::Joint(1),
            KeyCode::Up => Intent::Joint(-1),
            KeyCode::Right if situation.is_live => Intent::Plot(1),
            KeyCode::Left if situation.is_live => Intent::Plot(-1),
            KeyCode::Right => Intent::Forward(SECOND),
            KeyCode::Left => Intent::Back(SECOND),
            KeyCode::PageDown if !situation.is_live => Intent::Forward(PAGE),
            KeyCode::PageUp if !situation.is_live => Intent::Back(PAGE),
            KeyCode::Char(' ') => Intent::Pause,
            KeyCode::Char('+' | '=') if !situation.is_live => Intent::Faster,
            KeyCode::Char('-') if !situation.is_live => Intent::Slower,
            _ => return None,
        })
    }

    /// Ctrl-C: the first stops a hand that may have torque, the next one ends.
    fn interrupt(&mut self, situation: Situation) -> Intent {
        self.question = None;
        if situation.may_have_torque() && !std::mem::replace(&mut self.was_interrupted, true) {
            return Intent::Ask(Command::Stop);
        }
        Intent::Quit
    }

    fn ask(&mut self, about: About, now: Duration) {
        self.question = Some(Question { about, until: now + PATIENCE });
    }

    /// Forgets a question that was not answered in time.
    pub fn turn(&mut self, now: Duration) {
        self.question = self.question.filter(|question| now < question.until);
    }

    /// Returns `true` while keys move what is held.
    pub fn is_jogging(&self, situation: Situation) -> bool {
        self.is_jogging && situation.mode == Some(Mode::Carrying)
    }

    /// The question that waits, with its answers, and how long it still does, s. The postures are those of the hand.
    pub fn question(&self, now: Duration, postures: &[String]) -> Option<(Cow<'static, str>, u64)> {
        let Question { about, until } = self.question?;
        let words = match about {
            About::Command(Command::Arm) => {
                "ARM: the joints get torque and may move.  y or Enter: do it  Esc: don't"
            }
            About::Command(Command::Grasp(_)) => "GRASP: the fingers close.  y or Enter: do it  Esc: don't",
            About::Command(Command::Release) => {
                "RELEASE: what is held is let go.  y or Enter: do it  Esc: don't"
            }
            About::Command(Command::PutDown) => {
                "PUT DOWN: what is held sinks until it stands.  y or Enter: do it  Esc: don't"
            }
            About::Command(Command::Weigh) => {
                "WEIGH: what is held goes up and down a little.  y or Enter: do it  Esc: don't"
            }
            About::Command(_) => "DISARM: what is held may fall.  y or Enter: do it  Esc: don't",
            About::Jog => "JOG: keys move what is held.  y or Enter: do it  Esc: don't",
            About::Posture => {
                let known = (1..).zip(postures).map(|(number, name)| format!("{number} {name}"));
                let known = known.collect::<Vec<_>>().join("  ");
                let known = if known.is_empty() { "1 to 9".to_owned() } else { known };
                return Some((
                    format!("POSTURE: the fingers move.  {known}  Esc: don't").into(),
                    left(until, now),
                ));
            }
            About::Quit => {
                "QUIT: with this program its heartbeat ends, and the hand lets go (fault 10).  s or Enter: stop it first (what is held falls)  y: quit as it is  Esc: stay"
            }
        };
        Some((words.into(), left(until, now)))
    }
}

/// Returns the time until then, s, rounded up.
fn left(until: Duration, now: Duration) -> u64 {
    let left = until.saturating_sub(now);
    left.as_secs() + u64::from(left.subsec_nanos() > 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use Intent::{Ask, Quit, StopAndQuit};

    const GRASP: Command = Command::Grasp(Grasp::CONFIGURED);

    fn live(mode: Mode) -> Situation {
        Situation { is_live: true, is_heard: true, mode: Some(mode) }
    }

    /// Presses keys one after the other, 100 ms apart; returns what came of them.
    fn press(input: &mut Input, codes: &[KeyCode], situation: Situation) -> Vec<Intent> {
        let at = |k: usize| Duration::from_millis(100 * k as u64);
        let pressed = codes.iter().enumerate();
        pressed.filter_map(|(k, &code)| input.press(code.into(), situation, at(k))).collect()
    }

    fn after(codes: &[KeyCode], situation: Situation) -> Vec<Intent> {
        press(&mut Input::default(), codes, situation)
    }

    use KeyCode::{Char, Enter, Esc, Tab};

    #[test]
    fn what_moves_or_drops_waits_for_its_confirmation() {
        for (key, command) in [
            ('a', Command::Arm),
            ('g', GRASP),
            ('r', Command::Release),
            ('d', Command::Disarm),
            ('l', Command::PutDown),
            ('k', Command::Weigh),
        ] {
            for mode in [Mode::Grasping, Mode::Releasing] {
                let situation = live(mode);
                assert_eq!(after(&[Char(key)], situation), []);
                assert_eq!(after(&[Char(key), Char('y')], situation), [Ask(command)]);
                assert_eq!(after(&[Char(key), Enter, Enter, Char('y')], situation), [Ask(command)]);
                assert_eq!(after(&[Char(key), Esc, Char('y')], situation), []);
                assert_eq!(after(&[Char(key), Char('n'), Enter], situation), []);
            }
        }
        // Looking at something else meanwhile is no answer.
        assert_eq!(
            after(&[Char('a'), Tab, Enter], live(Mode::Disarmed)),
            [Intent::Plot(1), Ask(Command::Arm)]
        );
        // The last question is the one that is answered.
        assert_eq!(after(&[Char('a'), Char('g'), Enter], live(Mode::Armed)), [Ask(GRASP)]);
    }

    #[test]
    fn a_posture_is_chosen_from_a_list() {
        let (mut input, situation) = (Input::default(), live(Mode::Armed));
        assert_eq!(press(&mut input, &[Char('p'), Enter, Char('y')], situation), []);
        let postures = ["open", "preshape"].map(str::to_owned);
        let (words, _) = input.question(Duration::from_millis(300), &postures).expect("a question");
        assert_eq!(words, "POSTURE: the fingers move.  1 open  2 preshape  Esc: don't");
        let second = Command::Posture { posture: Some(1), time_ms: 0 };
        assert_eq!(press(&mut input, &[Char('2'), Char('1')], situation), [Ask(second)]);
        assert_eq!(after(&[Char('p'), Esc, Char('1')], situation), []);
    }

    #[test]
    fn keys_move_what_is_held_once_that_is_confirmed() {
        let (situation, step) = (live(Mode::Carrying), Intent::Jog(Step { axis: 2, is_back: true }));
        assert_eq!(after(&[Char('Z')], situation), []);
        assert_eq!(after(&[Char('j'), Char('Z')], situation), []);
        let mut input = Input::default();
        assert_eq!(press(&mut input, &[Char('j'), Enter, Char('Z'), Char('Z')], situation), [step, step]);
        // Keys are steps there and nothing else: no question is answered by them, and a stop is a stop.
        assert_eq!(press(&mut input, &[Char('l'), Char('Z'), Esc, Char('Z')], situation), [step]);
        assert_eq!(press(&mut input, &[Char(' ')], situation), [Ask(Command::Stop)]);
        assert_eq!(press(&mut input, &[Char('Z')], live(Mode::Disarmed)), []);
        assert_eq!(press(&mut input, &[Esc, Char('Z')], situation), []);
        assert_eq!(after(&[Char('j'), Enter], live(Mode::Armed)), [Intent::NothingHeld]);
    }

    #[test]
    fn what_does_neither_is_done_at_once() {
        assert_eq!(after(&[Char('d')], live(Mode::Armed)), [Ask(Command::Disarm)]);
        assert_eq!(after(&[Char('c')], live(Mode::Fault)), [Ask(Command::ClearFault)]);
    }

    #[test]
    fn a_question_is_over_after_a_while() {
        let mut input = Input::default();
        let situation = live(Mode::Disarmed);
        assert_eq!(input.press(Char('a').into(), situation, Duration::ZERO), None);
        let left = |input: &Input, ms| input.question(Duration::from_millis(ms), &[]).map(|(_, left)| left);
        assert_eq!((left(&input, 0), left(&input, 4900)), (Some(5), Some(1)));
        assert_eq!(input.press(Enter.into(), situation, Duration::from_millis(5000)), None);
        assert_eq!(left(&input, 5000), None);
    }

    #[test]
    fn a_stop_is_never_asked_about_and_ends_every_question() {
        for mode in Mode::ALL {
            for key in [' ', 's'] {
                assert_eq!(after(&[Char(key)], live(mode)), [Ask(Command::Stop)]);
                assert_eq!(after(&[Char('g'), Char(key), Char('y')], live(mode)), [Ask(Command::Stop)]);
            }
        }
        let unknown = Situation { is_live: true, is_heard: false, mode: None };
        assert_eq!(after(&[Char(' ')], unknown), [Ask(Command::Stop)]);
    }

    #[test]
    fn quitting_asks_while_there_is_torque() {
        for mode in [Mode::Armed, Mode::Grasping, Mode::Releasing] {
            assert_eq!(after(&[Char('q')], live(mode)), []);
            assert_eq!(after(&[Char('q'), Esc], live(mode)), []);
            assert_eq!(after(&[Char('q'), Char('y')], live(mode)), [Quit]);
            assert_eq!(after(&[Char('q'), Char('s')], live(mode)), [StopAndQuit]);
            assert_eq!(after(&[Char('q'), Enter], live(mode)), [StopAndQuit]);
            assert_eq!(after(&[Char('q'), Char(' ')], live(mode)), [Ask(Command::Stop)]);
            let dead = Situation { is_heard: false, ..live(mode) };
            assert_eq!(after(&[Char('q')], dead), [Quit]);
        }
        assert_eq!(after(&[Char('q')], live(Mode::Disarmed)), [Quit]);
        assert_eq!(after(&[Char('q')], live(Mode::Fault)), [Quit]);
    }

    #[test]
    fn one_interrupt_stops_and_the_second_ends() {
        let interrupt = KeyEvent::new(Char('c'), KeyModifiers::CONTROL);
        let mut input = Input::default();
        let situation = live(Mode::Grasping);
        assert_eq!(input.press(interrupt, situation, Duration::ZERO), Some(Ask(Command::Stop)));
        assert_eq!(input.press(interrupt, situation, Duration::ZERO), Some(Quit));
        let disarmed = live(Mode::Disarmed);
        assert_eq!(Input::default().press(interrupt, disarmed, Duration::ZERO), Some(Quit));
        let other = KeyEvent::new(Char('g'), KeyModifiers::CONTROL);
        assert_eq!(Input::default().press(other, situation, Duration::ZERO), None);
    }

    #[test]
    fn a_recording_takes_no_commands_and_is_sought_in() {
        let situation = Situation { is_live: false, is_heard: true, mode: Some(Mode::Grasping) };
        for key in ['a', 'd', 'g', 'r', 'c', 'l', 'k', 'p', 'j'] {
            assert_eq!(after(&[Char(key), Enter, Char('y')], situation), [Intent::OnlyRecorded]);
        }
        let keys = [KeyCode::Right, KeyCode::PageUp, Char(' '), Char('+'), Char('-'), Char('q')];
        assert_eq!(
            after(&keys, situation),
            [
                Intent::Forward(SECOND),
                Intent::Back(PAGE),
                Intent::Pause,
                Intent::Faster,
                Intent::Slower,
                Quit
            ]
        );
    }
}
