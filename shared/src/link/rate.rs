//! The rate of the line: agreed by both ends, never guessed.
//!
//! Every hand starts at [`FIRST_BAUD`], and so does whoever opens a line. The host may then ask for a faster rate
//! ([`Request::Rate`](super::message::Request::Rate)). The hand answers at the old rate, and changes once the answer has left;
//! the host changes when it has the answer. Neither trusts what it can't see:
//!
//! ```text
//! host                                   hand
//! Rate 3,000,000      -- 1 Mbaud -->
//!                     <-- 1 Mbaud --     done; changes                 on trial
//! changes
//! Rate 3,000,000      -- 3 Mbaud -->     heard                         on trial
//!                     <-- 3 Mbaud --     done
//! both ways are good
//! anything else       -- 3 Mbaud -->     heard: the host is sure       agreed
//! ```
//!
//! On trial the hand goes back when it hears nothing good for [`TRIAL_MS`]; once it is agreed, for [`SILENCE_MS`], which is how
//! long a line is silent that nobody uses any more. The host asks again and again while it tries the new rate, and nothing
//! else, so that the hand hears that it is not sure yet. If no answer comes, it goes back, and asks for the next slower rate. Whatever is lost, and in whatever direction: both are back at the first rate
//! within a second and a half.

/// Every hand starts at this rate, and every line is opened at it, baud.
pub const FIRST_BAUD: u32 = 1_000_000;
/// Faster rates that there are, the fastest first, baud: what a USART with a bus clock of 42 MHz divides exactly.
pub const FASTER_BAUDS: [u32; 3] = [3_000_000, 2_000_000, 1_500_000];
/// Time without a good frame after which a hand gives up a rate that is on trial, ms.
pub const TRIAL_MS: u32 = 200;
/// Time without a good frame after which a hand gives up a rate that was agreed, ms.
pub const SILENCE_MS: u32 = 1000;
/// Time in which a rate has to be answered before it is asked for again, ms: the hand has given up its trial by then.
const ASK_MS: u32 = TRIAL_MS + 100;
/// The number of times that it is asked for. Of the next rate the first question is lost, while the hand still tries
/// the one before.
const ASKS: u8 = 2;
/// Time from one question at the new rate to the next, ms.
const TRY_AGAIN_MS: u32 = 40;
/// Time without a good frame after which a host gives up a rate that was agreed, ms: a hand that was reset does not know it.
const LOST_MS: u32 = 400;
/// Time from one look to the next, ms, beyond which it was the host that stood still, and not the line that was silent.
const STOOD_STILL_MS: u32 = 100;

/// The hand's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HandRate {
    baud: u32,
    /// The host has not said yet that it is sure.
    is_on_trial: bool,
    /// The time of the last good frame.
    heard_ms: u32,
}

impl HandRate {
    /// At the first rate.
    pub const fn new() -> Self {
        Self { baud: FIRST_BAUD, is_on_trial: false, heard_ms: 0 }
    }

    /// The last byte of an answer has left, after which the line is to have this rate.
    pub fn answered(&mut self, baud: u32, now_ms: u32) {
        if baud != self.baud {
            *self = Self { baud, is_on_trial: true, heard_ms: now_ms };
        }
    }

    /// A good frame came; `asks_for_rate` if it is a host that is not sure yet.
    pub fn heard(&mut self, asks_for_rate: bool, now_ms: u32) {
        self.heard_ms = now_ms;
        self.is_on_trial &= asks_for_rate;
    }

    /// The rate that the line is to have from now on, baud.
    pub fn turn(&mut self, now_ms: u32) -> u32 {
        let most_ms = if self.is_on_trial { TRIAL_MS } else { SILENCE_MS };
        if self.baud != FIRST_BAUD && now_ms.wrapping_sub(self.heard_ms) >= most_ms {
            *self = Self::new();
        }
        self.baud
    }
}

impl Default for HandRate {
    fn default() -> Self {
        Self::new()
    }
}

/// The result of a question for a rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// The hand changes to it, or has it.
    Done,
    /// The hand does not have it.
    NoSuchRate,
    /// The hand does not do that now, or never.
    Refused,
}

/// Rates to ask for, in the order of [`FASTER_BAUDS`]; none where one is not wanted.
pub type Wanted = [Option<u32>; FASTER_BAUDS.len()];

/// The host's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HostRate {
    /// The rates that are still to be asked for.
    wanted: Wanted,
    baud: u32,
    state: State,
    /// The times of the last good frame and of the last turn.
    heard_ms: u32,
    turned_ms: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Nothing is to be agreed.
    Settled,
    /// The first of those wanted is asked for, at the old one: so often so far, the last time at this time.
    Asking { asks: u8, asked_ms: u32 },
    /// It is tried since one time, and asked for at another.
    Trying { since_ms: u32, asked_ms: u32 },
}

impl HostRate {
    /// At the first rate, and content with it.
    pub const fn new() -> Self {
        Self {
            wanted: [None; FASTER_BAUDS.len()],
            baud: FIRST_BAUD,
            state: State::Settled,
            heard_ms: 0,
            turned_ms: 0,
        }
    }

    /// A session has begun, in which the first of these rates is wanted that both ends can do.
    pub fn begin(&mut self, wanted: Wanted, now_ms: u32) {
        self.wanted = wanted;
        (self.heard_ms, self.turned_ms) = (now_ms, now_ms);
        self.ask(now_ms);
    }

    /// Returns `true` if nothing is to be agreed, so that other requests can be sent.
    pub fn is_settled(&self) -> bool {
        self.state == State::Settled
    }

    /// The rate that the line is to have, baud.
    pub fn baud(&self) -> u32 {
        self.baud
    }

    /// A good frame came.
    pub fn heard(&mut self, now_ms: u32) {
        self.heard_ms = now_ms;
    }

    /// A question was answered.
    pub fn answered(&mut self, asked: Asked, now_ms: u32) {
        match (self.state, asked) {
            (State::Asking { .. }, Asked::Done) => {
                let asked_ms = now_ms.wrapping_sub(TRY_AGAIN_MS);
                self.baud = self.wanted().unwrap_or(self.baud);
                self.state = State::Trying { since_ms: now_ms, asked_ms };
            }
            (State::Asking { .. }, Asked::NoSuchRate) => self.next(now_ms),
            (State::Asking { .. }, Asked::Refused) => self.state = State::Settled,
            // Whatever it says, it was heard, and is heard.
            (State::Trying { .. }, _) => self.state = State::Settled,
            (State::Settled, _) => {}
        }
    }

    /// Does what is due; returns a rate that is to be asked for now, if there is one.
    pub fn turn(&mut self, now_ms: u32) -> Option<u32> {
        let since = |then_ms: u32| now_ms.wrapping_sub(then_ms);
        if since(self.turned_ms) > STOOD_STILL_MS {
            self.heard_ms = now_ms;
        }
        self.turned_ms = now_ms;
        match self.state {
            State::Settled if self.baud != FIRST_BAUD && since(self.heard_ms) >= LOST_MS => {
                self.baud = FIRST_BAUD;
            }
            State::Settled => {}
            State::Asking { asks, asked_ms } if asks == 0 || since(asked_ms) >= ASK_MS => {
                if asks < ASKS {
                    self.state = State::Asking { asks: asks + 1, asked_ms: now_ms };
                    return self.wanted();
                }
                self.state = State::Settled;
            }
            State::Asking { .. } => {}
            State::Trying { since_ms, .. } if since(since_ms) >= TRIAL_MS => {
                self.baud = FIRST_BAUD;
                self.next(now_ms);
            }
            State::Trying { since_ms, asked_ms } if since(asked_ms) >= TRY_AGAIN_MS => {
                self.state = State::Trying { since_ms, asked_ms: now_ms };
                return Some(self.baud);
            }
            State::Trying { .. } => {}
        }
        None
    }

    /// The rate that is asked for.
    fn wanted(&self) -> Option<u32> {
        self.wanted.iter().copied().flatten().next()
    }

    /// The rate that is asked for does not do.
    fn next(&mut self, now_ms: u32) {
        if let Some(wanted) = self.wanted.iter_mut().find(|wanted| wanted.is_some()) {
            *wanted = None;
        }
        self.ask(now_ms);
    }

    fn ask(&mut self, now_ms: u32) {
        self.state = match self.wanted() {
            None => State::Settled,
            Some(_) => State::Asking { asks: 0, asked_ms: now_ms },
        };
    }
}

impl Default for HostRate {
    fn default() -> Self {
        Self::new()
    }
}
