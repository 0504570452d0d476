//! A made-up run: three fingers of four joints close on a prism, swing, and settle.

use super::{Report, ReportError};
use blindgrasp_body::Hand;
use blindgrasp_body::polyhedron::{Face, Polyhedron};
use blindgrasp_shared::hand::{Fingertip, Joint, Link};
use blindgrasp_shared::math::Real;
use blindgrasp_sim::sample::{ContactSample, EnergySample, Sample};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};

const FINGERS: usize = 3;
const TIP_RADIUS_M: f64 = 0.010;
const LINKS_M: [f64; 3] = [0.045, 0.035, 0.025];
/// Joint angles of a finger about which it swings, rad.
const REST_RAD: [f64; 4] = [0.0, -0.45, 0.80, 0.65];

/// Directions away from the palm's axis and around it, of finger `i`.
fn around(finger: usize) -> (Vector3<f64>, Vector3<f64>) {
    let (sine, cosine) = (TAU * finger as f64 / FINGERS as f64).sine_cosine();
    (Vector3::new(cosine, sine, 0.0), Vector3::new(-sine, cosine, 0.0))
}

fn rest(finger: usize) -> (Vector3<f64>, f64) {
    let mut angle = 0.0;
    let (mut out, mut up) = (0.035, 0.0);
    for (k, length) in LINKS_M.iter().enumerate() {
        angle += REST_RAD[k + 1];
        let (sine, cosine) = angle.sine_cosine();
        out -= length * sine;
        up += length * cosine;
    }
    (around(finger).0 * out + Vector3::z() * up, out)
}

pub(super) fn hand() -> Hand {
    let link =
        Link { mass_kg: 0.02, mass_centre_m: Vector3::zeros(), inertia_kg_m2: Matrix3::identity() * 1e-6 };
    let (mut joints, mut tips) = (Vec::new(), Vec::new());
    for finger in 0..FINGERS {
        let (out, along) = around(finger);
        let first = joints.len();
        let offsets = [out * 0.035, Vector3::zeros(), Vector3::z() * LINKS_M[0], Vector3::z() * LINKS_M[1]];
        for (k, offset_m) in offsets.into_iter().enumerate() {
            joints.push(Joint {
                parent: (k > 0).then(|| first + k - 1),
                offset_m,
                attitude: Matrix3::identity(),
                axis: if k == 0 { out } else { -along },
                lower_rad: -2.0,
                upper_rad: 2.0,
                link,
            });
        }
        tips.push(Fingertip { link: first + 3, offset_m: Vector3::z() * LINKS_M[2], radius_m: TIP_RADIUS_M });
    }
    Hand::new(&joints, &tips).expect("a hand")
}

pub(super) fn joint_names() -> Vec<String> {
    let joints = ["abduction", "proximal", "middle", "distal"];
    (1..=FINGERS).flat_map(|finger| joints.map(|joint| format!("{joint} {finger}"))).collect()
}

/// A prism with a face in front of each finger.
pub(super) fn prism() -> Polyhedron {
    let (_, out) = rest(0);
    let inner = out - TIP_RADIUS_M + 0.0012;
    // Corner k lies between the faces of fingers k and k + 1.
    let corner = |k: usize, z: f64| -around((k + 2) % FINGERS).0 * 2.0 * inner + Vector3::z() * z;
    let height = 0.022;
    let vertices_m: Vec<_> =
        (0..2 * FINGERS).map(|k| corner(k % FINGERS, if k < FINGERS { -height } else { height })).collect();
    let sides = (0..FINGERS).map(|k| {
        let before = (k + FINGERS - 1) % FINGERS;
        vec![before, k, k + FINGERS, before + FINGERS]
    });
    let faces = sides
        .chain([vec![2, 1, 0], vec![3, 4, 5]])
        .map(|corners| Face::convex(&vertices_m, corners))
        .collect();
    Polyhedron { vertices_m, faces }
}

/// `count` samples, a millisecond apart.
pub(super) fn samples(count: usize) -> Vec<Sample> {
    (0..count).map(|k| sample(k as f64 * 1e-3)).collect()
}

/// A swing that dies away, and the speed that goes with it.
fn swing(t: f64, rate: f64, phase: f64) -> (f64, f64) {
    let fade = (-1.4 * t).exp();
    let (sine, cosine) = (rate * t + phase).sine_cosine();
    (fade * sine, fade * (rate * cosine - 1.4 * sine))
}

fn sample(t_s: f64) -> Sample {
    let joints = 0..FINGERS * 4;
    let motion = |k: usize| {
        let (angle, speed) = swing(t_s, 6.0 + (k % 4) as f64 * 2.5, k as f64);
        (REST_RAD[k % 4] + 0.05 * angle, 0.05 * speed)
    };
    let (lift, lift_speed) = swing(t_s, 7.0, 0.4);
    let (turn, turn_speed) = swing(t_s, 5.0, 1.0);
    let attitude = UnitQuaternion::from_scaled_axis(Vector3::new(0.05, 0.03, 0.1) * turn);
    let position_m = Vector3::new(0.002 * lift, 0.001 * turn, rest(0).0.z + 0.003 * lift);
    let contacts = (0..FINGERS).map(|finger| {
        let (out, along) = around(finger);
        let (push, _) = swing(t_s, 9.0 + finger as f64, finger as f64);
        let (shear, _) = swing(t_s, 4.0, 2.0 * finger as f64);
        let desired = 1.0 + 0.1 * push * (1.0 - finger as f64 * 0.2);
        let impact = if (0.012..0.016).contains(&t_s) { 0.8 } else { 0.0 };
        let (tip, _) = rest(finger);
        let into = attitude * -out;
        let turned = attitude * along;
        ContactSample {
            normal_force_n: desired * (1.0 - (-12.0 * t_s).exp()) + 0.15 * push + impact,
            desired_normal_force_n: desired,
            full_force_n: desired,
            lambda_n: [0.3 * shear, 0.1 * push + 0.05],
            torsion_nm: 0.0,
            indentation_m: 0.0012,
            point_m: tip - out * (TIP_RADIUS_M - 0.0012),
            frame: Matrix3::from_columns(&[turned, into, turned.cross(&into)]),
            foot_m: [0.0, 0.0],
            friction: None,
            force_residual_n: Vector3::new(0.3 * shear, 0.2 * push, 1e-6),
            moment_residual_nm: Vector3::new(1e-3 * push, 1e-7, 2e-3 * shear),
        }
    });
    Sample {
        t_s,
        angles_rad: joints.clone().map(|k| motion(k).0).collect(),
        speeds_rad_s: joints.clone().map(|k| motion(k).1).collect(),
        estimated_angles_rad: joints.clone().map(|k| motion(k).0).collect(),
        estimated_speeds_rad_s: joints.clone().map(|k| motion(k).1).collect(),
        torques_nm: joints.map(|_| 0.0).collect(),
        position_m,
        attitude,
        velocity_m_s: Vector3::new(0.002 * lift_speed, 0.001 * turn_speed, 0.003 * lift_speed),
        spin_rad_s: Vector3::new(0.05, 0.03, 0.1) * turn_speed,
        contacts: contacts.collect(),
        others: Vec::new(),
        tables: Vec::new(),
        energy_j: 0.1,
        energies: EnergySample::default(),
        mode: "grasping",
    }
}

/// A directory of a test's own, removed in the end.
pub(super) struct Scratch(pub(super) PathBuf);

impl Scratch {
    pub(super) fn new(name: &str) -> Self {
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

/// The files of a folder.
pub(super) fn files(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap());
    entries.map(|e| (e.file_name().into_string().unwrap(), fs::read(e.path()).unwrap())).collect()
}

/// Size and pixels of a PNG file.
pub(super) fn decoded(file: &[u8]) -> ((u32, u32), Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
    ((info.width, info.height), pixels)
}

/// Samples with values that are no numbers, or missing.
pub(super) fn spoilt() -> Vec<Sample> {
    let mut samples = samples(40);
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
    samples
}

/// A function that writes a report.
pub(super) type Write = fn(&Path, &Report<'_>) -> Result<(), ReportError>;

/// Writes a report of samples.
pub(super) fn report_of(write: Write, samples: &[Sample], dir: &Path) -> Result<(), ReportError> {
    let (hand, names, object) = (hand(), joint_names(), prism());
    write(
        dir,
        &Report { title: "prism", hand: &hand, capsules: &[], joint_names: &names, object: &object, samples },
    )
}

/// Checks that what can't be written is named, for one file of a report.
pub(super) fn check_failures(write: Write, name: &str) {
    let scratch = Scratch::new("failures");
    fs::create_dir_all(&scratch.0).unwrap();
    let file = scratch.0.join("file");
    fs::write(&file, "in the way").unwrap();
    let error = report_of(write, &[], &file.join("below")).unwrap_err();
    assert!(matches!(error, ReportError::Directory { .. }));
    assert!(error.to_string().starts_with("cannot create the directory "), "{error}");
    assert!(error.to_string().contains("below: "), "{error}");

    // A directory where a file should go.
    let blocked = scratch.0.join(name);
    fs::create_dir_all(&blocked).unwrap();
    let error = report_of(write, &[], &scratch.0).unwrap_err();
    assert!(matches!(&error, ReportError::Write { path, .. } if *path == blocked), "{error}");
    // And a full disk.
    #[cfg(target_os = "linux")]
    {
        fs::remove_dir(&blocked).unwrap();
        std::os::unix::fs::symlink("/dev/full", &blocked).unwrap();
        let error = report_of(write, &[], &scratch.0).unwrap_err();
        let ReportError::Write { path, cause } = &error else { panic!("{error}") };
        assert!(*path == blocked && cause.kind() == std::io::ErrorKind::StorageFull, "{error}");
    }
}
