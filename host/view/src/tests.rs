//! Every file of a report: there, whole, the same twice, and an error where it can't be.

use super::{Report, ReportError, animation, fixture, picture, write};
use blindgrasp_sim::sample::Sample;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A directory of a test's own, removed in the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("blindgrasp-report-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        Self(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn report_of(samples: &[Sample], dir: &Path) -> Result<(), ReportError> {
    let (hand, names, object) = (fixture::hand(), fixture::joint_names(), fixture::prism());
    write(dir, &Report { title: "prism", hand: &hand, joint_names: &names, object: &object, samples })
}

fn files(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap());
    entries.map(|e| (e.file_name().into_string().unwrap(), fs::read(e.path()).unwrap())).collect()
}

const FILES: [&str; 3] = ["grasp-end.png", "grasp-start.png", "grasp.gif"];

/// Size and pixels of a PNG file.
fn decoded(file: &[u8]) -> ((u32, u32), Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
    ((info.width, info.height), pixels)
}

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
    let mut samples = fixture::samples(40);
    for (k, sample) in samples.iter_mut().enumerate().skip(10) {
        let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308][k % 4];
        sample.angles_rad.fill(bad);
        sample.speeds_rad_s.fill(bad);
        sample.position_m.fill(bad);
        sample.velocity_m_s.fill(bad);
        for contact in &mut sample.contacts {
            contact.normal_force_n = bad;
            contact.lambda_n = [bad; 2];
            contact.point_m = Vector3::repeat(bad);
            contact.frame = Matrix3::repeat(bad);
            contact.force_residual_n = Vector3::repeat(bad);
            contact.moment_residual_nm = Vector3::zeros();
        }
    }
    samples[5].t_s = f64::NAN;
    samples[6].contacts.clear();
    samples[7].speeds_rad_s.clear();
    samples[8].angles_rad.clear();
    report_of(&samples, &scratch.0).unwrap();
    assert_eq!(files(&scratch.0).len(), FILES.len());
}

#[test]
fn what_cannot_be_written_is_named() {
    let scratch = Scratch::new("blocked");
    fs::create_dir_all(&scratch.0).unwrap();
    let file = scratch.0.join("file");
    fs::write(&file, "in the way").unwrap();
    let error = report_of(&[], &file.join("below")).unwrap_err();
    assert!(matches!(error, ReportError::Directory { .. }));
    assert!(error.to_string().starts_with("cannot create the directory "), "{error}");
    assert!(error.to_string().contains("below: "), "{error}");

    // A directory where a file should go.
    let blocked = scratch.0.join("grasp-start.png");
    fs::create_dir_all(&blocked).unwrap();
    let error = report_of(&[], &scratch.0).unwrap_err();
    assert!(matches!(&error, ReportError::Write { path, .. } if *path == blocked), "{error}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let scratch = Scratch::new("full");
    fs::create_dir_all(&scratch.0).unwrap();
    std::os::unix::fs::symlink("/dev/full", scratch.0.join("grasp-end.png")).unwrap();
    let error = report_of(&[], &scratch.0).unwrap_err();
    let ReportError::Write { path, cause } = &error else { panic!("{error}") };
    assert!(path.ends_with("grasp-end.png") && cause.kind() == std::io::ErrorKind::StorageFull, "{error}");
}
