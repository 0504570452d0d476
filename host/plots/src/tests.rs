//! Every file: there, whole, the same twice, and an error where it can't be.

use super::drawing::Drawing as _;
use super::run::all;
use super::write;
use blindgrasp_sim::sample::Sample;
use blindgrasp_view::{Report, ReportError};
use std::path::Path;

#[path = "../../view/src/fixture.rs"]
mod fixture;

use fixture::{Scratch, decoded, files, spoilt};

fn report_of(samples: &[Sample], dir: &Path) -> Result<(), ReportError> {
    fixture::report_of(write, samples, dir)
}

const FILES: [&str; 8] = [
    "contact-forces.png",
    "contact-forces.svg",
    "joint-velocities.png",
    "joint-velocities.svg",
    "object-velocities.png",
    "object-velocities.svg",
    "residuals.png",
    "residuals.svg",
];

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
        if name.ends_with(".svg") {
            let text = std::str::from_utf8(file).unwrap();
            assert!(text.starts_with("<svg width=\"960\"") && text.trim_end().ends_with("</svg>"), "{name}");
            assert!(!text.contains("NaN"), "{name}");
        } else if name.ends_with(".png") {
            let ((width, height), pixels) = decoded(file);
            assert_eq!(width, 960, "{name}");
            assert!(height >= 500, "{name}");
            assert!(pixels.iter().any(|v| *v < 60), "{name} shows something");
        }
    }
    for legend in ["abduction 2", "joint velocity, rad/s", "time, s"] {
        assert!(String::from_utf8_lossy(&written["joint-velocities.svg"]).contains(legend), "{legend}");
    }
}

/// The plots as text: cheap to draw, and by the same code as the bitmaps.
fn plots_of(samples: &[Sample]) -> Vec<String> {
    let (hand, names) = (fixture::hand(), fixture::joint_names());
    let drawn = all("prism", &hand, &names, samples).map(|plot| plot.figure.svg().unwrap());
    drawn.into_iter().map(|file| String::from_utf8(file).unwrap()).collect()
}

#[test]
fn a_run_without_samples_is_drawn() {
    let scratch = Scratch::new("empty");
    report_of(&[], &scratch.0).unwrap();
    let written = files(&scratch.0);
    assert_eq!(written.len(), FILES.len());
}

#[test]
fn plots_show_single_samples_and_say_where_there_is_nothing() {
    for plot in plots_of(&fixture::samples(1)) {
        assert!(plot.contains("<circle"), "a single sample is a dot");
    }
    let mut samples = fixture::samples(40);
    for sample in &mut samples {
        sample.speeds_rad_s.fill(0.0);
        sample.velocity_m_s.fill(0.0);
        for contact in &mut sample.contacts {
            contact.force_residual_n.fill(0.0);
            contact.moment_residual_nm.fill(f64::NAN);
        }
    }
    let [_, _, _, residuals] = plots_of(&samples).try_into().unwrap();
    assert_eq!(residuals.matches("no values above zero").count(), 2);
}

#[test]
fn values_that_are_no_numbers_or_missing_do_no_harm() {
    let scratch = Scratch::new("nan");
    report_of(&spoilt(), &scratch.0).unwrap();
    assert_eq!(files(&scratch.0).len(), FILES.len());
}

#[test]
fn what_cannot_be_written_is_named() {
    fixture::check_failures(write, "joint-velocities.svg");
}
