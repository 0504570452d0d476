//! Files that are no recording, or none that this program knows.

use super::hand::{Hand, about};
use blindgrasp::files::OutputError;
use blindgrasp::record::mcap::{Decoder, Recording, RecordingError, Stamp, Writer};
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use mcap::records::{MessageHeader, Metadata};
use std::collections::BTreeMap;
use std::fs::{self, File};

#[test]
fn foreign_files_are_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    for bytes in [&b""[..], b"\x89MCAP", b"\x89PNG\r\n\x1a\nand so on", &[0; 5000]] {
        fs::write(&path, bytes).unwrap();
        let error = Recording::open(&path).unwrap_err();
        assert!(matches!(error, RecordingError::NotMcap { .. }), "{error}");
    }
    let mut writer = mcap::Writer::new(File::create(&path).unwrap()).unwrap();
    let channel = writer.add_channel(0, "/camera", "json", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, b"{}").unwrap();
    writer.finish().unwrap();
    let error = Recording::open(&path).unwrap_err();
    assert!(
        matches!(&error, RecordingError::NotARecording { library, .. } if library.contains("mcap")),
        "{error}"
    );
    assert!(matches!(Recording::open(&folder.path().join("none")).unwrap_err(), RecordingError::Io { .. }));
    assert!(matches!(Recording::open(folder.path()).unwrap_err(), RecordingError::Io { .. }));
}

#[test]
fn a_newer_format_is_refused_with_both_versions() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let options = mcap::WriteOptions::new().profile("blindgrasp").library("blindgrasp 9.0.0");
    let mut writer = options.create(File::create(&path).unwrap()).unwrap();
    let text = "format=2\nhost_version=9.0.0\n";
    let crc = format!("{:08x}", crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(text.as_bytes()));
    let metadata = [("format", "2"), ("host_version", "9.0.0"), ("crc", &crc)];
    let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
    writer.write_metadata(&Metadata { name: "blindgrasp".into(), metadata }).unwrap();
    writer.finish().unwrap();
    let error = Recording::open(&path).unwrap_err();
    assert!(matches!(error, RecordingError::Newer { theirs: 2, ours: 1, .. }), "{error}");
    assert!(error.to_string().contains("format 2, written by blindgrasp 9.0.0"), "{error}");
}

#[test]
fn records_of_another_interface_are_not_decoded() {
    let mut random = fastrand::Rng::with_seed(1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut writer = Writer::create(&path, false).unwrap();
    let device = writer.add_device("hand");
    let mut about = about("three-finger");
    about.interface_version = 3;
    writer.about(device, Stamp(0), &about).unwrap();
    let mut hand = Hand::new(12);
    let (_, payload) = hand.tick(&mut random);
    writer.received(device, Stamp(1), &payload).unwrap();
    writer.finish().unwrap();
    let recording = Recording::open(&path).unwrap();
    let mut decoder = Decoder::new();
    for entry in recording.entries().unwrap() {
        assert_eq!(decoder.take(&entry.unwrap()), None);
    }
    let words = decoder.obstacle(0).unwrap().to_string();
    let ours = format!("this program has {INTERFACE_VERSION}");
    assert!(words.contains("interface version 3") && words.contains(&ours), "{words}");
}

#[test]
fn a_file_that_is_there_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    fs::write(&path, "precious").unwrap();
    assert!(matches!(
        Writer::create(&path, false).map(|_| ()),
        Err(RecordingError::Output(OutputError::Exists(_)))
    ));
    assert_eq!(fs::read(&path).unwrap(), b"precious");
    Writer::create(&path, true).unwrap().finish().unwrap();
    // An empty recording is one.
    let recording = Recording::open(&path).unwrap();
    assert_eq!((recording.devices().len(), recording.span(), recording.is_finished()), (0, None, true));
}

/// A name more costs what a name costs, however many there are.
#[test]
fn as_many_devices_as_there_can_be_are_read_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let options = mcap::WriteOptions::new().profile("blindgrasp").library("blindgrasp 0.1.0");
    let mut writer = options.create(File::create(&path).unwrap()).unwrap();
    for k in 0..60_000 {
        let channel =
            writer.add_channel(0, &format!("/device{k}/sent"), "blindgrasp", &BTreeMap::new()).unwrap();
        let header = MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
        writer.write_to_known_channel(&header, b"").unwrap();
    }
    writer.finish().unwrap();
    let begun = std::time::Instant::now();
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.devices().len(), 60_000);
    assert_eq!(recording.entries().unwrap().map(Result::unwrap).count(), 60_000);
    println!("60,000 devices: {:?}", begun.elapsed());
    assert!(begun.elapsed().as_secs() < 5, "{:?}", begun.elapsed());
}
