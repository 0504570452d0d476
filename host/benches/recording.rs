//! The cost of recording and reading: a record of twelve joints.

#![allow(clippy::unwrap_used)]

use blindgrasp::body::MAX_JOINTS;
use blindgrasp::model::Scene;
use blindgrasp::record::mcap::{Decoder, Entry, Recording, What, Writer};
use blindgrasp::sim::Simulation;
use blindgrasp::sim::recorder::Recorder;
use blindgrasp_shared::link::message::{Form, Reply};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use std::path::Path;

/// Returns the payloads of a hand that grasps a cube for so long, as full records or input records; what comes before
/// them comes too.
fn said(folder: &Path, duration_s: f64, inputs: bool) -> Vec<Entry> {
    let scene = Scene::load("cube", &[format!("duration_s={duration_s:?}")]).unwrap();
    let path = folder.join("source.mcap");
    let mut simulation = Simulation::new(&scene).unwrap();
    let mut recorder = Recorder::create(&path, true, &scene, simulation.controller()).unwrap();
    while let Ok(Some(step)) = simulation.step() {
        recorder.see(&step);
    }
    recorder.finish().unwrap();
    let mut entries: Vec<Entry> =
        Recording::open(&path).unwrap().entries().unwrap().map(Result::unwrap).collect();
    entries.retain(|entry| !matches!(entry.what, What::Event { .. }));
    for entry in &mut entries {
        let What::Received(payload) = &mut entry.what else { continue };
        if let (true, Ok(Reply::Record(record))) = (inputs, Reply::<MAX_JOINTS>::decode(payload)) {
            *payload = postcard::to_allocvec(&Form::Input.of(&record)).unwrap();
        }
    }
    entries
}

fn write(path: &Path, entries: &[Entry]) -> u64 {
    let mut writer = Writer::create(path, true).unwrap();
    let device = writer.add_device("hand");
    for Entry { at, what, .. } in entries {
        match what {
            What::About(about) => writer.about(device, *at, about).unwrap(),
            What::Parameters(settings) => writer.parameters(device, *at, settings).unwrap(),
            What::Received(payload) => {
                writer.received(device, *at, payload).unwrap();
            }
            _ => {}
        }
    }
    writer.finish().unwrap().bytes
}

fn recording(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    for (name, inputs) in [("full", false), ("input", true)] {
        let entries = said(folder.path(), 5.0, inputs);
        let records = entries.iter().filter(|entry| matches!(entry.what, What::Received(_))).count() as u64;
        let path = folder.path().join("a.mcap");
        let bytes = write(&path, &entries);
        println!(
            "{name}: {records} payloads, {:.1} bytes in the file for each",
            bytes as f64 / records as f64
        );
        let mut group = criterion.benchmark_group(format!("recording/{name}"));
        group.throughput(Throughput::Elements(records)).sample_size(20);
        group.bench_function("write, per record", |b| b.iter(|| write(&path, &entries)));
        let open = || (Recording::open(&path).unwrap().entries().unwrap(), Decoder::new());
        group.bench_function("read, per record", |b| {
            b.iter_batched(open, |(entries, _)| entries.map(Result::unwrap).count(), BatchSize::PerIteration);
        });
        group.bench_function("read and decode, per record", |b| {
            b.iter_batched(
                open,
                |(entries, mut decoder)| entries.filter_map(|entry| decoder.take(&entry.unwrap())).count(),
                BatchSize::PerIteration,
            );
        });
        group.throughput(Throughput::Bytes(bytes));
        group.bench_function("read, bytes of the file", |b| {
            b.iter_batched(open, |(entries, _)| entries.map(Result::unwrap).count(), BatchSize::PerIteration);
        });
        group.finish();
    }
}

criterion_group!(benches, recording);
criterion_main!(benches);
