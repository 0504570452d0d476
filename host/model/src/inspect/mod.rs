//! Checks of a file, for `blindgrasp hand check` and `object check`.
//!
//! Loading stops at the first thing that keeps a file from being used. A check reads on, says everything that it finds, also
//! what can be used but is likely a mistake, and how sure that is:
//!
//! - an **error** can't be used, or is wrong whatever the file is for;
//! - a **warning** can be used, and is likely a mistake;
//! - a **notice** is worth knowing, and may be as it was meant.

pub mod finding;
pub mod hand;
pub mod object;
