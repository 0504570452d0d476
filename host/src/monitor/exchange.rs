//! What can be learnt from the payloads on the line alone: the session's number, and which heartbeats were answered.

use crate::MAX_JOINTS;
use crate::wire::{Packet, Request};
use blindgrasp_shared::link::message::Reply;
use std::collections::VecDeque;

/// Heartbeats whose answers may still come.
const UNANSWERED: usize = 64;
/// First byte of the replies that matter (`docs/protocol.md`): records, which come much more often, are left alone.
const IDENTITY: u8 = 0;
const ANSWER: u8 = 1;

/// Payloads in both directions.
#[derive(Clone, Debug, Default)]
pub(super) struct Exchange {
    heartbeats: VecDeque<u16>,
    session: Option<u16>,
}

impl Exchange {
    /// What the host said.
    pub(super) fn sent(&mut self, payload: &[u8]) {
        if let Ok(Packet { sequence, request: Request::Heartbeat, .. }) = Packet::decode(payload) {
            if self.heartbeats.len() == UNANSWERED {
                self.heartbeats.pop_front();
            }
            self.heartbeats.push_back(sequence);
        }
    }

    /// What the device said; returns whether that is that a heartbeat has come.
    pub(super) fn received(&mut self, payload: &[u8]) -> bool {
        if !matches!(payload.first(), Some(&(IDENTITY | ANSWER))) {
            return false;
        }
        match Reply::<MAX_JOINTS>::decode(payload) {
            Ok(Reply::Identity { session, .. }) => {
                self.session = Some(session);
                self.heartbeats.clear();
                false
            }
            Ok(Reply::Answer { sequence, refused: None }) => {
                let at = self.heartbeats.iter().position(|&heartbeat| heartbeat == sequence);
                // Those before it will not be answered any more.
                at.inspect(|&at| drop(self.heartbeats.drain(..=at))).is_some()
            }
            _ => false,
        }
    }

    /// Number of the session that began last.
    pub(super) fn session(&self) -> Option<u16> {
        self.session
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::command::{Command, Refusal};

    fn packet(sequence: u16, request: Request) -> Vec<u8> {
        let mut buffer = [0; Packet::MOST_BYTES];
        postcard::to_slice(&Packet { session: 1, sequence, request }, &mut buffer).expect("room").to_vec()
    }

    fn answer(sequence: u16, refused: Option<Refusal>) -> Vec<u8> {
        let mut buffer = [0; 64];
        let reply: Reply<'_, MAX_JOINTS> = Reply::Answer { sequence, refused };
        postcard::to_slice(&reply, &mut buffer).expect("room").to_vec()
    }

    #[test]
    fn only_heartbeats_that_are_answered_count() {
        let mut exchange = Exchange::default();
        for sequence in [1, 2, 4] {
            exchange.sent(&packet(sequence, Request::Heartbeat));
        }
        exchange.sent(&packet(3, Request::Command(Command::Arm)));
        assert!(exchange.received(&answer(2, None)));
        assert!(!exchange.received(&answer(1, None)), "overtaken");
        assert!(!exchange.received(&answer(3, None)), "of something else");
        assert!(!exchange.received(&answer(4, Some(Refusal::NoSession))));
        assert!(exchange.received(&answer(4, None)));
        assert!(!exchange.received(&answer(4, None)), "twice");
        assert!(!exchange.received(&[]) && !exchange.received(&[ANSWER]) && !exchange.received(&[3, 3, 3]));
        for sequence in 0..1000 {
            exchange.sent(&packet(sequence, Request::Heartbeat));
        }
        assert_eq!(exchange.heartbeats.len(), UNANSWERED);
    }
}
