//! The view of `blindgrasp monitor`, without a terminal: so that tests can look at it.
//!
//! Arrows go one way. [`live`] (a line with a hand behind it, in a thread of its own) and [`playback`] (a recording) tell
//! [`News`](model::News), each with its time; the [`Model`](model::Model) keeps what is known from them;
//! [`view`] draws the model into a buffer of characters. [`input`] makes intents of keys and asks before what can move or
//! drop something. What takes time from a terminal or the clock is in the command alone.

mod exchange;
pub mod history;
pub mod input;
pub mod jog;
pub mod live;
pub mod model;
pub mod playback;
pub mod rate;
pub mod view;
