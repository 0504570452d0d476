//! Everything that is written comes back.

use super::hand::{Hand, about, is_derived, read, settings};
use blindgrasp::record::mcap::{Arrival, Decoder, Entry, Level, Stamp, What, Writer};

const MS: u64 = 1_000_000;

#[test]
fn everything_comes_back_as_it_was() {
    for seed in 0..8 {
        let mut random = fastrand::Rng::with_seed(seed);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("two.mcap");
        let mut writer = Writer::create(&path, false).unwrap();
        let names = ["three-finger", "two-finger"];
        let devices = ["hand1", "hand2"].map(|name| writer.add_device(name));
        let mut expected: Vec<Entry> = Vec::new();
        let mut records = [Vec::new(), Vec::new()];
        let mut lost = [0_u64; 2];
        let mut statuses = [(0_u64, 0_u64, 0_u64); 2];
        let mut hands = names.map(|name| Hand::new(about(name).joint_names.len()));
        for (k, name) in names.into_iter().enumerate() {
            let at = Stamp(10 + k as u64);
            let mut about = about(name);
            about.baud = Some(1_000_000);
            writer.about(devices[k], at, &about).unwrap();
            expected.push(Entry { device: k, at, what: What::About(Box::new(about)) });
            let settings = settings(name);
            writer.parameters(devices[k], at, &settings).unwrap();
            expected.push(Entry { device: k, at, what: What::Parameters(settings) });
        }
        for tick in 1..=2500_u64 {
            for k in 0..2 {
                let at = Stamp(tick * MS + random.u64(0..MS / 2));
                let (record, payload) = hands[k].tick(&mut random);
                // Losses, of one and of several.
                if random.u32(0..100) == 0 {
                    for _ in 0..random.usize(0..12) {
                        hands[k].tick(&mut random);
                    }
                    continue;
                }
                match writer.received(devices[k], at, &payload).unwrap() {
                    Arrival::Record(decoded) => {
                        assert_eq!(decoded.record, record);
                        assert!(decoded.at <= at);
                        lost[k] += decoded.lost_before;
                        records[k].push(*decoded);
                    }
                    other => panic!("{other:?}"),
                }
                expected.push(Entry { device: k, at, what: What::Received(payload) });
                if random.u32(0..50) == 0 {
                    let bytes: Vec<u8> = (0..random.usize(0..30)).map(|_| random.u8(..)).collect();
                    writer.sent(devices[k], at, &bytes).unwrap();
                    expected.push(Entry { device: k, at, what: What::Sent(bytes) });
                }
                if random.u32(0..300) == 0 {
                    writer.event(devices[k], at, Level::Warning, "something").unwrap();
                    let what = What::Event {
                        level: Level::Warning,
                        about: "event".into(),
                        words: "something".into(),
                    };
                    expected.push(Entry { device: k, at, what });
                }
                if random.u32(0..500) == 0 {
                    writer.gap(devices[k], at, "cut").unwrap();
                    expected.push(Entry { device: k, at, what: What::Gap { words: "cut".into() } });
                    writer.damaged(devices[k], 2);
                }
                if tick.is_multiple_of(1000) {
                    let status = writer.link(devices[k], at).unwrap();
                    statuses[k].0 += status.records;
                    statuses[k].1 += status.missing;
                    statuses[k].2 += status.unusable;
                    assert!(status.seconds_s == 0.0 || (status.seconds_s - 1.0).abs() < 1e-3);
                    if status.seconds_s > 0.0 {
                        expected.push(Entry { device: k, at, what: What::Link(status) });
                    } else {
                        // NaN is not itself.
                        assert!(status.share.is_nan());
                    }
                }
            }
        }
        for k in 0..2 {
            let status = writer.link(devices[k], Stamp(2501 * MS)).unwrap();
            statuses[k].0 += status.records;
            statuses[k].1 += status.missing;
            statuses[k].2 += status.unusable;
            expected.push(Entry { device: k, at: Stamp(2501 * MS), what: What::Link(status) });
            assert_eq!(statuses[k], (records[k].len() as u64, lost[k], 0));
        }
        let saved = writer.finish().unwrap();
        assert_eq!(saved.bytes, std::fs::metadata(&path).unwrap().len());
        assert_eq!(saved.records, (records[0].len() + records[1].len()) as u64);

        let (entries, damage, recording) = read(&path);
        assert!(damage.is_none() && !damage.unfinished, "{damage}");
        assert_eq!(recording.devices(), ["hand1", "hand2"]);
        assert_eq!(recording.received(), Some(saved.records));
        assert_eq!(recording.span().map(|(first, _)| first), Some(Stamp(10)));
        let is_first_link =
            |entry: &Entry| matches!(&entry.what, What::Link(status) if status.seconds_s == 0.0);
        let plain: Vec<&Entry> =
            entries.iter().filter(|entry| !is_derived(entry) && !is_first_link(entry)).collect();
        assert_eq!(plain.len(), expected.len());
        for (got, wanted) in plain.iter().zip(&expected) {
            assert_eq!(*got, wanted);
        }
        // The raw payloads decode to what was decoded while recording.
        let mut decoder = Decoder::new();
        let mut again = [Vec::new(), Vec::new()];
        for entry in &entries {
            if let Some(decoded) = decoder.take(entry) {
                again[decoded.device].push(decoded);
            }
        }
        assert_eq!(again, records);
        // Speeds are told once the estimator has settled, and angles are those of the counts, to half a count.
        let told = again[0].iter().filter(|decoded| !decoded.speeds_rad_s.is_empty()).count();
        assert!(told > 100, "{told}");
        for decoded in again.iter().flatten() {
            for (angle, count) in decoded.angles_rad.iter().zip(&decoded.record.counts) {
                let of_count = *count as f32 * std::f32::consts::TAU / 21_600.0;
                // The estimator lags behind counts that jump by up to 20.
                assert!((angle - of_count).abs() < 60.0 * std::f32::consts::TAU / 21_600.0);
            }
        }
    }
}

#[test]
fn loss_is_counted_exactly() {
    let mut random = fastrand::Rng::with_seed(5);
    let folder = tempfile::tempdir().unwrap();
    let mut writer = Writer::create(&folder.path().join("a.mcap"), false).unwrap();
    let device = writer.add_device("hand");
    writer.about(device, Stamp(0), &about("three-finger")).unwrap();
    let mut hand = Hand::new(12);
    let (mut not_given, mut missing, mut came) = (0, 0, 0);
    for tick in 0..20_000 {
        let (_, payload) = hand.tick(&mut random);
        // The first and the last are there, so that everything lost is between two that came.
        if random.u32(0..200) == 0 && tick > 0 && tick < 19_700 {
            not_given += 1;
            continue;
        }
        if let Arrival::Record(decoded) = writer.received(device, Stamp(tick * MS), &payload).unwrap() {
            missing += decoded.lost_before;
            came += 1;
        }
    }
    let status = writer.link(device, Stamp(20_000 * MS)).unwrap();
    assert_eq!(status.missing, missing);
    assert_eq!(missing, not_given + status.unusable);
    assert_eq!(came + missing, 20_000);
}
