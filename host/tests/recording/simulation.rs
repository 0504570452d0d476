//! A simulation leaves the recording that its hand would, and in it the true state of its world.

use super::hand::read;
use blindgrasp::body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp::model::file::ShapeFile;
use blindgrasp::model::{HandFile, Scene, mesh};
use blindgrasp::record::mcap::{Decoded, Decoder, What};
use blindgrasp::sim::Simulation;
use blindgrasp::sim::recorder::Recorder;
use blindgrasp::sim::sample::Sample;
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::telemetry::snapshot::Collector;
use blindgrasp_shared::tick::{Params, State};
use prost::Message;
use std::path::Path;

/// Records a run, and returns its samples.
pub(crate) fn run(scene: &Scene, path: &Path) -> Vec<Sample> {
    let mut simulation = Simulation::new(scene).unwrap();
    let mut recorder = Recorder::create(path, true, scene, simulation.controller()).unwrap();
    let mut samples = Vec::new();
    while let Ok(Some(step)) = simulation.step() {
        recorder.see(&step);
        samples.extend(step.sample.cloned());
    }
    let saved = recorder.finish().unwrap();
    assert_eq!(saved.records as usize, samples.len() + 1);
    samples
}

fn decode(path: &Path) -> Vec<Decoded> {
    let (entries, damage, _) = read(path);
    assert!(damage.is_none() && !damage.unfinished);
    let mut decoder = Decoder::new();
    entries.iter().filter_map(|entry| decoder.take(entry)).collect()
}

#[test]
fn each_tick_is_recorded_to_the_bit_and_the_file_is_the_same_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    let noise = ["duration_s=1.2".to_owned(), "sensors.noise_counts=0.5".to_owned()];
    let scene = Scene::load("cube", &noise).unwrap();
    let sampled = run(&scene, &a);
    run(&scene, &b);
    assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
    let decoded = decode(&a);
    // Before the samples comes the tick that arms the hand.
    for (decoded, sample) in decoded[1..].iter().zip(&sampled) {
        assert_eq!(decoded.at.0, u64::from(decoded.record.tick) * 1_000_000);
        assert_eq!(decoded.lost_before, 0);
        let told = |values: &[f32]| -> Vec<f64> { values.iter().map(|&value| value.into()).collect() };
        // The estimator of the decoder is the controller's, from the first tick on.
        assert_eq!(told(decoded.angles_rad.as_slice()), sample.estimated_angles_rad);
        assert_eq!(told(decoded.speeds_rad_s.as_slice()), sample.estimated_speeds_rad_s);
    }
}

#[test]
fn the_state_can_be_had_from_the_snapshots() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let scene = Scene::load("cube", &["duration_s=1.1".to_owned()]).unwrap();
    let mut states = Vec::new();
    let mut simulation = Simulation::new(&scene).unwrap();
    let mut recorder = Recorder::create(&path, true, &scene, simulation.controller()).unwrap();
    while let Ok(Some(step)) = simulation.step() {
        recorder.see(&step);
        let mut bytes = [0; 8192];
        states.push(step.controller.state().save(step.controller.params(), &mut bytes).unwrap().to_vec());
    }
    recorder.finish().unwrap();
    let (entries, _, _) = read(&path);
    let params =
        Params::<MAX_JOINTS, MAX_FINGERS>::new(scene.hand.cast(), &scene.controller_config()).unwrap();
    let mut collector = Collector::new();
    let mut found = 0;
    for entry in &entries {
        let What::Received(payload) = &entry.what else { continue };
        let Ok(Reply::Snapshot(part)) = Reply::<MAX_JOINTS>::decode(payload) else { continue };
        if let Some((tick, bytes)) = collector.add(&part) {
            assert_eq!(bytes, states[tick as usize]);
            State::load(&params, bytes).unwrap();
            found += 1;
        }
    }
    assert_eq!(found, 2);
}

#[test]
fn ideal_sensors_have_no_counts_and_are_recorded_all_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    run(&Scene::load("cube-ideal", &["duration_s=0.05".to_owned()]).unwrap(), &path);
    let decoded = decode(&path);
    assert_eq!(decoded.len(), 52);
    assert!(decoded.iter().all(|decoded| decoded.record.counts.is_empty() && decoded.angles_rad.is_empty()));
    assert!(decoded.iter().any(|decoded| decoded.record.torques_nm.iter().any(|&torque| torque != 0.0)));
}

#[derive(Clone, PartialEq, Message)]
struct Vector {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
    #[prost(double, tag = "4")]
    w: f64,
}

impl Vector {
    fn bits(&self) -> [u64; 4] {
        [self.x, self.y, self.z, self.w].map(f64::to_bits)
    }
}

#[derive(Clone, PartialEq, Message)]
struct FrameTransform {
    #[prost(message, required, tag = "1")]
    timestamp: prost_types::Timestamp,
    #[prost(string, tag = "2")]
    parent_frame_id: String,
    #[prost(string, tag = "3")]
    child_frame_id: String,
    #[prost(message, required, tag = "4")]
    translation: Vector,
    #[prost(message, required, tag = "5")]
    rotation: Vector,
}

#[derive(Clone, PartialEq, Message)]
struct JointState {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(double, optional, tag = "2")]
    position: Option<f64>,
    #[prost(double, optional, tag = "3")]
    velocity: Option<f64>,
    #[prost(double, optional, tag = "4")]
    acceleration: Option<f64>,
    #[prost(double, optional, tag = "5")]
    effort: Option<f64>,
}

#[derive(Clone, PartialEq, Message)]
struct JointStates {
    #[prost(message, required, tag = "1")]
    timestamp: prost_types::Timestamp,
    #[prost(message, repeated, tag = "2")]
    joints: Vec<JointState>,
}

#[derive(Clone, PartialEq, Message)]
struct Contact {
    #[prost(message, required, tag = "1")]
    point_m: Vector,
    #[prost(message, required, tag = "2")]
    force_n: Vector,
    #[prost(double, optional, tag = "3")]
    friction_used: Option<f64>,
    #[prost(double, optional, tag = "4")]
    slipped_m: Option<f64>,
}

#[derive(Clone, PartialEq, Message)]
struct Contacts {
    #[prost(message, required, tag = "1")]
    timestamp: prost_types::Timestamp,
    #[prost(message, repeated, tag = "2")]
    contacts: Vec<Contact>,
    #[prost(message, repeated, tag = "3")]
    others: Vec<Contact>,
}

/// The messages of a topic, which all stand at the times of the ticks that were told to grasp.
fn truth<M: Message + Default>(file: &[u8], topic: &str, schema: &str) -> Vec<M> {
    let mut decoded = Vec::new();
    for message in mcap::MessageStream::new(file).unwrap().map(Result::unwrap) {
        if message.channel.topic == topic {
            assert_eq!(message.channel.schema.as_ref().unwrap().name, schema);
            assert_eq!(message.log_time, (decoded.len() as u64 + 1) * 1_000_000);
            decoded.push(M::decode(&*message.data).unwrap());
        }
    }
    decoded
}

#[test]
fn the_true_state_of_the_world_is_recorded_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let scene = Scene::load("cube", &["duration_s=1.2".to_owned()]).unwrap();
    let samples = run(&scene, &path);
    let file = std::fs::read(&path).unwrap();
    let objects: Vec<FrameTransform> = truth(&file, "/truth/object", "foxglove.FrameTransform");
    let joints: Vec<JointStates> = truth(&file, "/truth/joints", "foxglove.JointStates");
    let contacts: Vec<Contacts> = truth(&file, "/truth/contacts", "blindgrasp.Contacts");
    assert_eq!([objects.len(), joints.len(), contacts.len()], [samples.len(); 3]);
    for (k, sample) in samples.iter().enumerate() {
        let at = prost_types::Timestamp {
            seconds: (k as i64 + 1) / 1000,
            nanos: (k as i32 + 1) % 1000 * 1_000_000,
        };
        let bits = |v: [f64; 3]| [v[0], v[1], v[2], 0.0].map(f64::to_bits);
        let object = &objects[k];
        assert_eq!((&*object.parent_frame_id, &*object.child_frame_id), ("base", "object"));
        assert_eq!(object.translation.bits(), bits(sample.position_m.into()));
        let q = sample.attitude.quaternion();
        assert_eq!(object.rotation.bits(), [q.i, q.j, q.k, q.w].map(f64::to_bits));
        assert_eq!([&object.timestamp, &joints[k].timestamp, &contacts[k].timestamp], [&at; 3]);
        assert_eq!(joints[k].joints.len(), scene.joints.len());
        for (j, joint) in joints[k].joints.iter().enumerate() {
            let bits = |value: Option<f64>| value.map(f64::to_bits);
            assert_eq!(joint.name, scene.joints[j].name);
            assert_eq!(bits(joint.position), Some(sample.angles_rad[j].to_bits()));
            assert_eq!(bits(joint.velocity), Some(sample.speeds_rad_s[j].to_bits()));
            assert_eq!(bits(joint.effort), Some(sample.torques_nm[j].to_bits()));
            assert_eq!(joint.acceleration, None);
        }
        assert_eq!(contacts[k].contacts.len(), sample.contacts.len());
        assert!(contacts[k].others.is_empty());
        for (told, contact) in contacts[k].contacts.iter().zip(&sample.contacts) {
            assert_eq!(told.point_m.bits(), bits(contact.point_m.into()));
            assert_eq!(told.force_n.bits(), bits(contact.force_on_object_n().into()));
            let [x, z] = contact.lambda_n;
            let frame = &contact.frame;
            let by_hand =
                contact.normal_force_n * frame.column(1) - x * frame.column(0) - z * frame.column(2);
            assert!((contact.force_on_object_n() - by_hand).norm() < 1e-12);
        }
    }
}

/// Channels of contacts with friction alone: how much of it is used, the way slipped, and what tables carry.
#[test]
fn friction_and_tables_are_recorded_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let scene = Scene::load("cube-table", &["duration_s=0.05".to_owned()]).unwrap();
    let samples = run(&scene, &path);
    let contacts: Vec<Contacts> =
        truth(&std::fs::read(&path).unwrap(), "/truth/contacts", "blindgrasp.Contacts");
    assert_eq!(contacts.len(), samples.len());
    let bits = |v: [f64; 3]| [v[0], v[1], v[2], 0.0].map(f64::to_bits);
    let mut others = 0;
    for (told, sample) in contacts.iter().zip(&samples) {
        for (told, contact) in told.contacts.iter().zip(&sample.contacts) {
            let friction = contact.friction.unwrap();
            assert_eq!(told.friction_used.map(f64::to_bits), Some(friction.used.to_bits()));
            assert_eq!(told.slipped_m.map(f64::to_bits), Some(friction.slipped_m.to_bits()));
        }
        assert_eq!(told.others.len(), sample.others.len());
        for (told, on_table) in told.others.iter().zip(&sample.others) {
            assert_eq!(told.point_m.bits(), bits(on_table.point_m.into()));
            assert_eq!(told.force_n.bits(), bits(on_table.force_n.into()));
            assert_eq!((told.friction_used, told.slipped_m), (Some(on_table.used), None));
            others += 1;
        }
    }
    assert!(others > 20, "{others}: the cube lies on the table at first");
}

#[test]
fn a_recording_of_a_simulation_has_the_shapes_of_hand_and_object() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["cube", "l-bracket", "two-finger-prism"] {
        let path = folder.path().join("a.mcap");
        let scene = Scene::load(name, &["duration_s=0.01".to_owned()]).unwrap();
        run(&scene, &path);
        let file = std::fs::read(&path).unwrap();
        let attachments = mcap::Summary::read(&file).unwrap().unwrap().attachment_indexes;
        let attached = |name: &str| {
            let index = attachments.iter().find(|index| index.name == name).unwrap();
            String::from_utf8(mcap::read::attachment(&file, index).unwrap().data.to_vec()).unwrap()
        };
        let (entries, _, _) = read(&path);
        let What::About(about) = &entries[0].what else { panic!("{:?}", entries[0]) };
        let hand: HandFile = toml::from_str(about.hand_file.as_ref().unwrap()).unwrap();
        assert_eq!(attached("hand.urdf"), hand.to_urdf());
        for joint in &about.joint_names {
            assert!(attached("hand.urdf").contains(&format!("<joint name=\"{joint}\" type=\"revolute\">")));
        }
        let object = attached("object.obj");
        let vertices: Vec<Vec<f64>> = object
            .lines()
            .filter_map(|line| line.strip_prefix("v "))
            .map(|line| line.split(' ').map(|number| number.parse().unwrap()).collect())
            .collect();
        let expected: Vec<Vec<f64>> =
            scene.object.vertices_m.iter().map(|vertex| vertex.iter().copied().collect()).collect();
        assert_eq!(vertices, expected);
        // As the reader of meshes has it, it is a closed body again, with as many triangles.
        let obj = folder.path().join("object.obj");
        std::fs::write(&obj, &object).unwrap();
        let (shape, notices) = mesh::load(obj.as_os_str(), Some(mesh::Unit::Metre)).unwrap();
        assert!(notices.is_empty(), "{notices:?}");
        let ShapeFile::Mesh { vertices_m, triangles, .. } = shape else { panic!("{shape:?}") };
        assert_eq!(vertices_m.len(), expected.len());
        let of_faces = scene.object.faces.iter().map(|face| face.triangles.len());
        assert_eq!(triangles.len(), of_faces.sum::<usize>());
    }
}
