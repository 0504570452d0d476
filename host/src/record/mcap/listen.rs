//! Payloads to replies.

use crate::MAX_JOINTS;
use blindgrasp_shared::link::message::Reply;

#[derive(Clone, Debug, Default)]
pub(super) struct Listener<const J: usize>;

pub(super) struct Heard<'p, const J: usize> {
    pub(super) reply: Reply<'p, J>,
    pub(super) digest: Option<u16>,
}

impl Listener<MAX_JOINTS> {
    pub(super) fn new() -> Self {
        Self
    }

    pub(super) fn hear<'p>(&mut self, payload: &'p [u8]) -> Result<Heard<'p, MAX_JOINTS>, ()> {
        Reply::decode(payload).map(|reply| Heard { reply, digest: None }).map_err(|_| ())
    }
}
