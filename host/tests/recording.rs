//! Recordings: what is written comes back, from whole files and from damaged ones.

use blindgrasp::record::mcap::{About, Arrival, Decoder, Level, Recording, Setting, Stamp, What, Writer};
use blindgrasp::scene::{HandFile, HandModel};
use blindgrasp_shared::identity::{Clock, Identity, Image, ResetCause, UNITS};
use blindgrasp_shared::link::Receiver;
use blindgrasp_shared::link::message::{Reply, Signals};
use blindgrasp_shared::link::Sender;
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, List, Record};

#[test]
fn smoke() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut writer = Writer::create(&path, false).unwrap();
    let hand = writer.add_device("hand");
    let _ = hand;
    assert!(Writer::create(&path, false).is_err());
    writer.sent(hand, Stamp(5), b"abc").unwrap();
    println!("{}", writer.finish().unwrap());
    let recording = Recording::open(&path).unwrap();
    println!("{:?}", recording);
    let mut entries = recording.entries().unwrap();
    for entry in &mut entries { println!("{entry:?}"); }
    println!("{}", entries.damage());
}
