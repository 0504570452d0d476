//! The queues between the control task and the link: bounded, without locks, and what does not fit is counted.
//!
//! The control task is an end of both. It never waits: an empty inbox is no packet in this tick, a full outbox is a
//! record lost, and the number of those is in the next record. An answer is never lost: without room for one, no packet is
//! taken.

use crate::model::JOINTS;
use blindgrasp_shared::bytes::BufferTooSmall;
use blindgrasp_shared::command::Command;
use blindgrasp_shared::device::WAITING_MOST;
use blindgrasp_shared::link::message::{Form, Packet, Reply, Request};
use blindgrasp_shared::link::{encode, may_take};
use blindgrasp_shared::saved::Order;
use blindgrasp_shared::store::{Store, StoreError};
use blindgrasp_shared::telemetry::Record;
use blindgrasp_shared::telemetry::snapshot::Part;
use embedded_storage::nor_flash::NorFlash;
use heapless::spsc::{Consumer, Producer, Queue};

/// A packet to this hand.
pub type HandPacket = Packet<JOINTS>;
/// A reply of this hand.
pub type HandReply = Reply<'static, JOINTS>;

/// An answer to a request.
pub struct Answer {
    /// Its content.
    pub reply: HandReply,
    /// The rate that the line is to have once it has left, baud.
    pub baud: Option<u32>,
}

impl From<HandReply> for Answer {
    fn from(reply: HandReply) -> Self {
        Self { reply, baud: None }
    }
}

/// A message that the hand sends unasked.
#[expect(clippy::large_enum_variant, reason = "most of them are records, and there is no heap")]
pub enum Telemetry {
    /// The record of a tick, and its form.
    Record(Record<JOINTS>, Form),
    /// A part of a snapshot.
    Part(Part),
}

impl Telemetry {
    /// Writes its frame. Only the link does: the digest of an input record takes time that the control task has not.
    ///
    /// # Errors
    /// The buffer is too small.
    pub fn frame(self, buffer: &mut [u8]) -> Result<&[u8], BufferTooSmall> {
        match self {
            Self::Record(mut record, form) => form.frame(&mut record, buffer),
            Self::Part(part) => encode(&HandReply::Snapshot(part), buffer),
        }
    }
}

/// Packets that wait for a tick; the control task takes one a millisecond. A queue holds one less than its size.
const PACKETS: usize = 8;
/// Answers that wait for the line. They go before telemetry.
const ANSWERS: usize = 8;
/// Records and parts of snapshots that wait for the line.
const RECORDS: usize = WAITING_MOST + 1;
/// A second stop before the first is acted on says nothing new.
const STOPS: usize = 2;

/// The store is told one thing at a time.
const ORDERS: usize = 2;

/// The result of an order.
pub type Stored = Result<(), StoreError>;

/// Memory of all queues.
pub struct Queues {
    stops: Queue<HandPacket, STOPS>,
    packets: Queue<HandPacket, PACKETS>,
    answers: Queue<Answer, ANSWERS>,
    records: Queue<Telemetry, RECORDS>,
    orders: Queue<Order, ORDERS>,
    stored: Queue<Stored, ORDERS>,
}

impl Queues {
    /// Empty queues.
    pub const fn new() -> Self {
        Self {
            stops: Queue::new(),
            packets: Queue::new(),
            answers: Queue::new(),
            records: Queue::new(),
            orders: Queue::new(),
            stored: Queue::new(),
        }
    }

    /// Their ends: the control task's, the link's, and the store's.
    pub fn split(&mut self) -> (ControlEnd<'_>, LinkEnd<'_>, StoreEnd<'_>) {
        let (stops_in, stops) = self.stops.split();
        let (packets_in, packets) = self.packets.split();
        let (answers_in, answers) = self.answers.split();
        let (records_in, records) = self.records.split();
        let (orders_in, orders) = self.orders.split();
        let (stored_in, stored) = self.stored.split();
        (
            ControlEnd {
                stops,
                packets,
                answers: answers_in,
                records: records_in,
                orders: orders_in,
                stored,
                dropped: 0,
            },
            LinkEnd { stops: stops_in, packets: packets_in, answers, records },
            StoreEnd { orders, stored: stored_in },
        )
    }
}

impl Default for Queues {
    fn default() -> Self {
        Self::new()
    }
}

/// The control task's end.
pub struct ControlEnd<'q> {
    stops: Consumer<'q, HandPacket>,
    packets: Consumer<'q, HandPacket>,
    answers: Producer<'q, Answer>,
    records: Producer<'q, Telemetry>,
    orders: Producer<'q, Order>,
    stored: Consumer<'q, Stored>,
    dropped: u32,
}

impl ControlEnd<'_> {
    /// The packet for this tick, for whose answer there is room. A stop overtakes whatever waits.
    pub fn take(&mut self) -> Option<HandPacket> {
        let room = self.room();
        let stop = may_take(true, room).then(|| dequeue(&mut self.stops)).flatten();
        stop.or_else(|| may_take(false, room).then(|| dequeue(&mut self.packets)).flatten())
    }

    /// Returns the number of answers that there is room for.
    pub fn room(&self) -> usize {
        let capacity = self.answers.capacity();
        if is_nothing(capacity) { 0 } else { capacity.saturating_sub(self.answers.len()) }
    }

    /// Gives the store something to do. It has done all that it was told before.
    pub fn order(&mut self, order: Order) {
        // There is room, so this can't fail.
        let _ = enqueue(&mut self.orders, order);
    }

    /// Returns the result of the order, once it is done.
    pub fn stored(&mut self) -> Option<Stored> {
        dequeue(&mut self.stored)
    }

    /// Leaves the answer to the packet that was taken for the line. There is room for it.
    pub fn answer(&mut self, answer: Answer) {
        let lost = enqueue(&mut self.answers, answer).is_err();
        self.dropped = self.dropped.saturating_add(u32::from(lost));
    }

    /// Leaves telemetry for the line, or drops and counts it. It never takes the room of answers.
    pub fn tell(&mut self, telemetry: Telemetry) {
        let lost = enqueue(&mut self.records, telemetry).is_err();
        self.dropped = self.dropped.saturating_add(u32::from(lost));
    }

    /// Returns the number of records and parts that wait for the line.
    pub fn waiting(&self) -> usize {
        if is_nothing(self.records.capacity()) { 0 } else { self.records.len() }
    }

    /// Returns the number of records and parts that were dropped so far.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}

/// The store's end.
pub struct StoreEnd<'q> {
    orders: Consumer<'q, Order>,
    stored: Producer<'q, Stored>,
}

impl StoreEnd<'_> {
    /// Does what the control task has told the store of a hand with this hash, if there is one.
    pub fn poll<S: NorFlash>(&mut self, store: &mut Option<(Store<S>, u32)>) {
        if let (Some((store, hand_hash)), Some(order)) = (store, dequeue(&mut self.orders)) {
            // There is room, so this can't fail.
            let _ = enqueue(&mut self.stored, store.obey(&order, *hand_hash));
        }
    }
}

/// The link's end.
pub struct LinkEnd<'q> {
    stops: Producer<'q, HandPacket>,
    packets: Producer<'q, HandPacket>,
    answers: Consumer<'q, Answer>,
    records: Consumer<'q, Telemetry>,
}

impl LinkEnd<'_> {
    /// Hands a packet to the control task.
    ///
    /// # Errors
    /// The packet, if its queue is full.
    pub fn put(&mut self, packet: HandPacket) -> Result<(), HandPacket> {
        if matches!(packet.request, Request::Command(Command::Stop)) {
            enqueue(&mut self.stops, packet)
        } else {
            enqueue(&mut self.packets, packet)
        }
    }

    /// The next answer to send. Answers go before all else.
    pub fn answer(&mut self) -> Option<Answer> {
        dequeue(&mut self.answers)
    }

    /// The next telemetry to send.
    pub fn telemetry(&mut self) -> Option<Telemetry> {
        dequeue(&mut self.records)
    }

    /// Returns `true` if nothing waits to be sent.
    pub fn is_empty(&self) -> bool {
        self.answers.len() == 0 && self.records.len() == 0
    }
}

/// Returns `true` if a queue has a size of zero, which none has. The library divides by the size; with this asked
/// first, the compiler sees that the division can't panic.
const fn is_nothing(capacity: usize) -> bool {
    capacity == usize::MAX
}

/// Adds an item at the end of a queue, without a panic.
///
/// # Errors
/// The item, if the queue is full.
pub fn enqueue<T>(queue: &mut Producer<'_, T>, item: T) -> Result<(), T> {
    if is_nothing(queue.capacity()) { Err(item) } else { queue.enqueue(item) }
}

/// Takes the item at the front of a queue, without a panic.
pub fn dequeue<T>(queue: &mut Consumer<'_, T>) -> Option<T> {
    if is_nothing(queue.capacity()) { None } else { queue.dequeue() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::device::{Device, Inputs};
    use blindgrasp_shared::identity::{Clock, Identity, Image};
    use blindgrasp_shared::joints::Reading;
    use blindgrasp_shared::telemetry::burst::Burst;
    use proptest::prelude::*;
    use std::boxed::Box;

    fn packet(sequence: u16, request: Request<JOINTS>) -> HandPacket {
        Packet { session: 1, sequence, request }
    }

    #[test]
    fn a_stop_overtakes_packets_and_gets_in_when_their_queue_is_full() {
        let mut queues = Queues::new();
        let (mut control, mut link, _) = queues.split();
        let most = (PACKETS - 1) as u16;
        for sequence in 0..most {
            assert!(link.put(packet(sequence, Request::Heartbeat)).is_ok());
        }
        let refused = link.put(packet(most, Request::Heartbeat)).map_err(|packet| packet.sequence);
        assert_eq!(refused, Err(most));
        assert!(link.put(packet(100, Request::Command(Command::Stop))).is_ok());
        let order: std::vec::Vec<u16> = core::iter::from_fn(|| control.take()).map(|p| p.sequence).collect();
        let expected: std::vec::Vec<u16> = core::iter::once(100).chain(0..most).collect();
        assert_eq!(order, expected);
    }

    fn record() -> Telemetry {
        let hand = crate::model::params();
        let image = Image::decode(&crate::model::IMAGE_HAND).unwrap();
        let identity = Identity::of(image, Clock::Emulated);
        let mut burst = Box::new(Burst::new());
        Telemetry::Record(
            Device::new(hand, identity)
                .tick(&Reading::Counts([0; JOINTS]), &Inputs::default(), &mut burst)
                .record,
            Form::Input,
        )
    }

    #[test]
    fn records_that_do_not_fit_are_counted_and_answers_have_room_and_go_first() {
        let mut queues = Queues::new();
        let (mut control, mut link, _) = queues.split();
        for _ in 0..RECORDS + 2 {
            control.tell(record());
        }
        assert_eq!((control.dropped(), control.waiting()), (3, RECORDS - 1));
        for sequence in 0..ANSWERS as u16 - 1 {
            control.answer(Reply::Answer { sequence, refused: None }.into());
        }
        assert_eq!(control.dropped(), 3);
        for expected in 0..ANSWERS as u16 - 1 {
            let reply = link.answer().map(|answer| answer.reply);
            assert!(matches!(reply, Some(Reply::Answer { sequence, .. }) if sequence == expected));
        }
        for _ in 0..RECORDS - 1 {
            assert!(!link.is_empty() && matches!(link.telemetry(), Some(Telemetry::Record(..))));
        }
        assert!(link.is_empty());
    }

    proptest! {
        /// Whatever comes, and however slowly answers leave: there is room for the answer to what is taken, and a stop waits
        /// only behind a stop, with nothing between them.
        #[test]
        fn what_is_taken_has_room_for_its_answer_and_a_stop_waits_behind_a_stop_alone(
            steps in proptest::collection::vec(0..4_u8, 1..300),
        ) {
            let mut queues = Queues::new();
            let (mut control, mut link, _) = queues.split();
            let (mut stops_wait, mut last_was_stop) = (0, false);
            for step in steps {
                match step {
                    0 => stops_wait += i32::from(link.put(packet(0, Request::Command(Command::Stop))).is_ok()),
                    1 => drop(link.put(packet(0, Request::Heartbeat))),
                    2 => drop(link.answer()),
                    _ => {
                        let taken = control.take();
                        let is_stop = taken.as_ref().is_some_and(|packet| packet.request != Request::Heartbeat);
                        prop_assert!(is_stop || stops_wait == 0 || (taken.is_none() && last_was_stop));
                        if taken.is_some() {
                            stops_wait -= i32::from(is_stop);
                            last_was_stop = is_stop;
                            control.answer(Reply::Answer { sequence: 0, refused: None }.into());
                        }
                        prop_assert_eq!(control.dropped(), 0);
                    }
                }
            }
        }
    }
}
