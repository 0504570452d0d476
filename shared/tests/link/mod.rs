//! The wire: what is sent arrives, what is damaged does not, and the receiver finds its feet again.

mod damage;
mod errors;
mod frames;
mod line;
mod property;
mod rate;

use crate::random;
