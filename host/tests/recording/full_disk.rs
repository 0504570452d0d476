//! A disk without room.

use super::hand::{Written, read};
use super::{is_limited, run_limited};
use blindgrasp::record::mcap::{RecordingError, Stamp, What, Writer};
use std::path::Path;

#[test]
fn what_was_saved_is_told_and_can_be_read() {
    if !is_limited() {
        // The kernel refuses to let a file grow beyond this many blocks, and sends a signal that is ignored here.
        run_limited("trap '' XFSZ; ulimit -f 512", "full_disk::what_was_saved_is_told_and_can_be_read");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut written = Written::of("three-finger", Writer::create(&path, false).unwrap(), 3);
    let error = (1..100_000).find_map(|_| written.tick().err()).expect("the file may not grow for ever");
    let Written { mut writer, device, .. } = written;
    let RecordingError::Stopped { saved, .. } = &error else { panic!("{error}") };
    let saved = *saved;
    println!("{error}");
    assert!(error.to_string().contains(&format!("{} records", saved.records)), "{error}");
    assert!(saved.records >= 499 && saved.seconds > 0.4, "{saved}");
    // It stays stopped, and says so.
    assert!(matches!(writer.sent(device, Stamp(0), b""), Err(RecordingError::Stopped { .. })));
    assert!(matches!(writer.finish(), Err(RecordingError::Stopped { .. })));
    let (entries, damage, _) = read(&path);
    assert!(damage.is_none() && damage.unfinished, "{damage}");
    let received = entries.iter().filter(|entry| matches!(entry.what, What::Received(_))).count();
    assert_eq!(received as u64, saved.records);
    assert_eq!(std::fs::metadata(&path).unwrap().len(), saved.bytes + 50);
}

#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_is_full_from_the_beginning_says_so() {
    let error = Writer::create(Path::new("/dev/full"), true).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("No space left"), "{error}");
}
