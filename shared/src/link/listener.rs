//! Payloads to replies and records, on the host's side.

use super::message::Reply;
use crate::telemetry::dense::{self, Counts, Undecoded};
use crate::telemetry::{DecodeError, Record};
use core::fmt;

/// Hears what a device says, and remembers of its records what dense ones go on from.
#[derive(Clone, Debug)]
pub struct Listener<const J: usize> {
    /// The last record.
    last: Option<Record<J>>,
    /// The last counts, which it may not have.
    counts: Counts<J>,
    /// Something is missing since: only a full record helps.
    lost: bool,
}

/// What was heard.
#[derive(Clone, Debug, PartialEq)]
pub struct Heard<'p, const J: usize> {
    /// What the device said; a dense record is a [`Reply::Record`] too.
    pub reply: Reply<'p, J>,
    /// Of a dense record: its [`digest`](dense::digest).
    pub digest: Option<u16>,
}

/// Why a payload can't be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HearError {
    /// It is no reply.
    Decode(DecodeError),
    /// It is a dense record, and there was no full one before.
    NoFullRecord,
    /// It is a dense record, and so much was lost before it that only a full one helps.
    Lost,
}

impl fmt::Display for HearError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Decode(error) => error.fmt(f),
            Self::NoFullRecord => f.write_str("a dense record, and no full one before it"),
            Self::Lost => {
                f.write_str("a dense record, and too many were lost before it: wait for a full one")
            }
        }
    }
}

impl core::error::Error for HearError {}

impl<const J: usize> Listener<J> {
    /// Nothing was heard.
    pub const fn new() -> Self {
        Self { last: None, counts: Counts::new(), lost: false }
    }

    /// Takes the payload of a good frame.
    ///
    /// # Errors
    /// It is no reply, or a dense record that can't be read without what was lost.
    pub fn hear<'p>(&mut self, payload: &'p [u8]) -> Result<Heard<'p, J>, HearError> {
        if payload.first() == Some(&dense::TAG) {
            return self.dense(payload);
        }
        let reply = Reply::decode(payload).map_err(HearError::Decode)?;
        if let Reply::Record(record) = &reply {
            self.counts.take(record);
            self.last = Some(record.clone());
            self.lost = false;
        }
        Ok(Heard { reply, digest: None })
    }

    fn dense<'p>(&mut self, payload: &[u8]) -> Result<Heard<'p, J>, HearError> {
        let last = self.last.as_mut().ok_or(HearError::NoFullRecord)?;
        if self.lost {
            return Err(HearError::Lost);
        }
        match dense::read(payload, last, &self.counts) {
            Ok((record, digest)) => {
                self.counts.take(&record);
                *last = record.clone();
                Ok(Heard { reply: Reply::Record(record), digest: Some(digest) })
            }
            Err(Undecoded::Bytes(error)) => Err(HearError::Decode(error)),
            Err(Undecoded::Lost) => {
                self.lost = true;
                Err(HearError::Lost)
            }
        }
    }
}

impl<const J: usize> Default for Listener<J> {
    fn default() -> Self {
        Self::new()
    }
}
