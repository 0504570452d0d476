//! Recordings of hands: written, read, salvaged, replayed, compared, and exported as tables.

pub mod compare;
pub mod derived;
pub mod export;
pub mod mcap;
pub mod replay;
pub mod table;
