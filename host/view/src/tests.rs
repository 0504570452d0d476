//! Every file of a report: there, whole, the same twice, and an error where it can't be.

use super::fixture::{Scratch, decoded, files, spoilt};
use super::{ReportError, animation, fixture, picture, write};
use blindgrasp_sim::sample::Sample;
use std::path::Path;

fn report_of(samples: &[Sample], dir: &Path) -> Result<(), ReportError> {
    fixture::report_of(write, samples, dir)
}

const FILES: [&str; 3] = ["grasp-end.png", "grasp-start.png", "grasp.gif"];

/// Delays of the frames of a GIF file, hundredths of a second.
fn delays(file: &[u8]) -> Vec<u16> {
    let mut decoder = gif::DecodeOptions::new().read_info(file).unwrap();
    assert_eq!(
        (usize::from(decoder.width()), usize::from(decoder.height())),
        (animation::WIDTH, animation::HEIGHT)
    );
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        delays.push(frame.delay);
    }
    delays
}

#[test]
fn a_report_has_every_file_whole_and_the_same_bytes_twice() {
    let (first, second) = (Scratch::new("first"), Scratch::new("second"));
    let samples = fixture::samples(90);
    report_of(&samples, &first.0).unwrap();
    report_of(&samples, &second.0).unwrap();
    let written = files(&first.0);
    assert_eq!(written.keys().collect::<Vec<_>>(), FILES.iter().collect::<Vec<_>>());
    assert!(written == files(&second.0), "the same run gives the same bytes");

    for (name, file) in &written {
        if name.ends_with(".png") {
            let ((width, height), pixels) = decoded(file);
            assert_eq!(width, 960, "{name}");
            assert!(height >= 500, "{name}");
            assert!(pixels.iter().any(|v| *v < 60), "{name} shows something");
        }
    }
    let (size, _) = decoded(&written["grasp-end.png"]);
    assert_eq!(size, (picture::WIDTH as u32, picture::HEIGHT as u32));

    let delays = delays(&written["grasp.gif"]);
    assert_eq!(delays.len(), animation::Schedule::new(&samples).times.len());
    assert!(written["grasp.gif"].len() < 2_000_000);
}

#[test]
fn a_run_without_samples_is_drawn() {
    let scratch = Scratch::new("empty");
    report_of(&[], &scratch.0).unwrap();
    let written = files(&scratch.0);
    assert_eq!(written.len(), FILES.len());
    assert_eq!(delays(&written["grasp.gif"]).len(), 1);
}

#[test]
fn values_that_are_no_numbers_or_missing_do_no_harm() {
    let scratch = Scratch::new("nan");
    report_of(&spoilt(), &scratch.0).unwrap();
    assert_eq!(files(&scratch.0).len(), FILES.len());
}

#[test]
fn what_cannot_be_written_is_named() {
    fixture::check_failures(write, "grasp-start.png");
}
