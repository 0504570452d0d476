//! Frames that a line has damaged, the same in every run.
//!
//! What they carried is of two kinds: requests of a session that never was, of every kind but the two that are taken from
//! anybody, and bytes that are no request. So, should one of them come through, it is known how it is answered.

#[path = "../../shared/tests/link/line.rs"]
mod line;
#[path = "../../shared/tests/random.rs"]
mod random;

use crate::conversation::frame;
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::control::PerGain;
use blindgrasp_shared::link::Receiver;
use blindgrasp_shared::link::message::{Packet, Request, Sample, Signals};
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::telemetry::List;
use line::Damage;
use random::Random;
use serde::Serialize;
use serde::ser::{SerializeTuple, Serializer};

/// Joints of the hand that they are sent to.
pub const JOINTS: usize = 12;
/// A session that never was.
pub const NO_SESSION: u16 = 0xdead;
/// Most payload that the hand takes, with its CRC.
const CAPACITY: usize = Packet::<JOINTS>::MOST_BYTES + 4;

/// A stretch of bytes on the line, after which another frame can begin.
#[derive(Clone, Debug)]
pub struct Stretch {
    /// The bytes; they end with 0x00.
    pub bytes: Vec<u8>,
    /// Payloads that come through all the same, each one that was sent, unharmed. The receiver on the host says so.
    pub survivors: Vec<Vec<u8>>,
}

/// Makes stretches.
pub struct Stretches {
    random: Random,
    /// The firmware's receiver, on the host.
    receiver: Receiver<CAPACITY>,
    made: usize,
}

/// A payload that is just bytes.
struct Raw<'a>(&'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

impl Stretches {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self { random: Random::new(seed), receiver: Receiver::new(), made: 0 }
    }

    /// Frames that the receiver has refused so far.
    pub fn refused(&self) -> u32 {
        self.receiver.counters().refused()
    }

    /// The next one.
    pub fn next_stretch(&mut self) -> Stretch {
        let kind = Damage::ALL[self.made % Damage::ALL.len()];
        self.made += 1;
        let sent = [self.payload(), self.payload()];
        let [intact, other] = sent.each_ref().map(|payload| frame(&Raw(payload)));
        let mut bytes = loop {
            let bytes = kind.of(&mut self.random, &intact, &other);
            if bytes != intact {
                break bytes;
            }
        };
        if bytes.last() != Some(&0) {
            bytes.push(0);
        }
        let mut survivors = Vec::new();
        for &byte in &bytes {
            if let Some(Ok(payload)) = self.receiver.push(byte) {
                assert!(sent.iter().any(|sent| sent == payload), "{kind:?}: {payload:02x?} was never sent");
                survivors.push(payload.to_vec());
            }
        }
        Stretch { bytes, survivors }
    }

    fn payload(&mut self) -> Vec<u8> {
        if self.random.below(2) == 0 {
            let packet =
                Packet { session: NO_SESSION, sequence: self.random.next() as u16, request: self.request() };
            let mut buffer = [0; CAPACITY];
            return postcard::to_slice(&packet, &mut buffer).expect("a request fits").to_vec();
        }
        loop {
            let length = match self.random.below(20) {
                // Longer than anything that is taken.
                0 => self.random.between(CAPACITY, 2 * CAPACITY),
                _ => self.random.between(1, 80),
            };
            let payload = self.random.payload(length);
            if Packet::<JOINTS>::decode(&payload).is_err() {
                return payload;
            }
        }
    }

    fn request(&mut self) -> Request<JOINTS> {
        let random = &mut self.random;
        let parameter = Parameter::ALL[random.below(Parameter::ALL.len())];
        let index = random.below(JOINTS) as u8;
        match random.below(9) {
            0 => Request::Command(Command::Arm),
            1 => Request::Command(Command::Grasp(Grasp {
                gains: PerGain { grasp: [Some(5.0), None], ..PerGain::all(None) },
            })),
            2 => Request::Command(Command::Release),
            3 => Request::Command(Command::ClearFault),
            4 => Request::Heartbeat,
            5 => Request::SetParameter { parameter, index, value: random.next() as f32 },
            6 => Request::GetParameter { parameter, index },
            7 => Request::Telemetry { decimation: random.next() as u16, signals: Signals::ALL },
            _ => {
                let counts = std::array::from_fn(|_| random.next() as i32 >> random.below(31));
                Request::Joints(Sample { counts: List::first_of(counts, JOINTS), failed: None, late: false })
            }
        }
    }
}
