//! The state of the session, learnt from the payloads on the line alone: the session's number, which heartbeats were
//! answered, and which numbers of records stand for input records.

use super::model::News;
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_shared::link::message::Reply;
use blindgrasp_wire::{Packet, Request};
use std::collections::VecDeque;

/// Heartbeats whose answers may still come.
const UNANSWERED: usize = 64;
/// First byte of the replies that matter (`docs/protocol.md`): records, which come more often, are left alone.
const IDENTITY: u8 = 0;
const ANSWER: u8 = 1;
const INPUT: u8 = 6;

/// Payloads in both directions.
#[derive(Clone, Debug, Default)]
pub(super) struct Exchange {
    heartbeats: VecDeque<u16>,
    session: Option<u16>,
}

impl Exchange {
    /// Takes a payload of the host.
    pub(super) fn sent(&mut self, payload: &[u8]) {
        if let Ok(Packet { sequence, request: Request::Heartbeat, .. }) = Packet::decode(payload) {
            if self.heartbeats.len() == UNANSWERED {
                self.heartbeats.pop_front();
            }
            self.heartbeats.push_back(sequence);
        }
    }

    /// Takes what the device said; returns what follows from it.
    pub(super) fn received(&mut self, payload: &[u8]) -> Option<News> {
        if !matches!(payload.first(), Some(&(IDENTITY | ANSWER | INPUT))) {
            return None;
        }
        match Reply::<MAX_JOINTS>::decode(payload) {
            Ok(Reply::Identity { session, .. }) => {
                self.session = Some(session);
                self.heartbeats.clear();
                None
            }
            Ok(Reply::Answer { sequence, refused: None }) => {
                let at = self.heartbeats.iter().position(|&heartbeat| heartbeat == sequence)?;
                // Those before it will not be answered any more.
                self.heartbeats.drain(..=at);
                Some(News::Heartbeat)
            }
            Ok(Reply::Input(input)) => Some(News::Input { sequence: input.sequence }),
            _ => None,
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
        let mut counts = |payload: &[u8]| matches!(exchange.received(payload), Some(News::Heartbeat));
        assert!(counts(&answer(2, None)));
        assert!(!counts(&answer(1, None)), "overtaken");
        assert!(!counts(&answer(3, None)), "of something else");
        assert!(!counts(&answer(4, Some(Refusal::NoSession))));
        assert!(counts(&answer(4, None)));
        assert!(!counts(&answer(4, None)), "twice");
        assert!(!counts(&[]) && !counts(&[ANSWER]) && !counts(&[3, 3, 3]));
        for sequence in 0..1000 {
            exchange.sent(&packet(sequence, Request::Heartbeat));
        }
        assert_eq!(exchange.heartbeats.len(), UNANSWERED);
    }
}
