//! The boards: a folder each, with all that is true of that board alone. One line of the library's root chooses.
//!
//! What a board's folder has to offer, `docs/new-board.md` says, step by step.

pub mod stm32f405;
