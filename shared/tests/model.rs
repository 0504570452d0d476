//! A hand as bytes, there and back.

use crate::common;

use blindgrasp_shared::bytes::BufferTooSmall;
use blindgrasp_shared::cycle::{NamedPosture, POSTURES_MOST, Postures};
use blindgrasp_shared::estimate::Encoder;
use blindgrasp_shared::model::{ModelError, decode, encode, hash, torques_per_volt_nm_v};
use blindgrasp_shared::tick::Config;
use common::{JOINTS, config, facing_rad, hand};
use crc::{CRC_32_ISO_HDLC, Crc};
use proptest::prelude::*;

/// Of its outputs, N m/V.
const OUTPUTS: [f32; JOINTS] = [0.25, -0.25, 0.125, 1e-3, -0.1, 0.7, 3.0, -1e4, 1.5, 0.3, 0.2, 0.1];

fn bytes(config: &Config<JOINTS>) -> Vec<u8> {
    let mut buffer = [0; 4096];
    encode(&hand::<JOINTS, 3>(), &postures(), config, &OUTPUTS, &mut buffer).expect("it fits").to_vec()
}

/// Two postures, one of them at the hand's facing angles.
fn postures() -> Postures<JOINTS> {
    let facing = NamedPosture::new("open", &facing_rad::<f32, JOINTS>());
    let mut postures = [NamedPosture::default(); POSTURES_MOST];
    (postures[0], postures[1]) = (NamedPosture::new("a-name-of-15-ch", &[0.1; JOINTS]), facing);
    Postures::first_of(postures, 2)
}

fn checksum(bytes: &[u8]) -> u32 {
    Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&[b"blindgrasp", bytes].concat())
}

#[test]
fn every_bit_comes_back() {
    let mut config = config::<JOINTS>();
    config.laws.hold.damping_nm_s[11] = -0.0;
    config.laws.hold.gravity_m_s2 = None;
    config.estimator.encoders[11] =
        Encoder { zero_count: -(1 << 24), reversed: true, ..config.estimator.encoders[0] };
    let bytes = bytes(&config);
    println!("{} bytes", bytes.len());
    let params = decode::<JOINTS, 3>(&bytes).expect("it was just written");
    assert_eq!(format!("{:?}", params.config()), format!("{config:?}"));
    assert_eq!(format!("{:?}", params.hand()), format!("{:?}", hand::<JOINTS, 3>()));
    assert_eq!(torques_per_volt_nm_v(&bytes), Ok(OUTPUTS));
    assert_eq!(params.postures(), &postures());
    assert_eq!(params.postures().as_slice()[0].name(), "a-name-of-15-ch");
    assert_eq!(hash(&bytes), checksum(&bytes[..bytes.len() - 4]));
}

#[test]
fn the_capacity_it_is_held_in_is_none_of_its_bytes() {
    let bytes = bytes(&config());
    let large = decode::<24, 5>(&bytes).expect("there is room");
    let mut buffer = [0; 4096];
    assert_eq!(encode(large.hand(), large.postures(), large.config(), &OUTPUTS, &mut buffer), Ok(&bytes[..]));
    for short in 0..bytes.len() {
        assert_eq!(
            encode(large.hand(), large.postures(), large.config(), &OUTPUTS, &mut vec![0; short]),
            Err(BufferTooSmall),
            "{short}"
        );
    }
    assert_eq!(
        torques_per_volt_nm_v::<13>(&bytes),
        Err(ModelError::Malformed),
        "it has no thirteenth output"
    );
    assert_eq!(torques_per_volt_nm_v::<11>(&bytes), Err(ModelError::Malformed));
    assert_eq!(decode::<11, 3>(&bytes).unwrap_err(), ModelError::Malformed);
    assert_eq!(decode::<12, 2>(&bytes).unwrap_err(), ModelError::Malformed);
}

#[test]
fn damage_is_found() {
    let bytes = bytes(&config());
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(decode::<JOINTS, 3>(&damaged).unwrap_err(), ModelError::Damaged, "bit {bit}");
        assert_eq!(torques_per_volt_nm_v::<JOINTS>(&damaged), Err(ModelError::Damaged), "bit {bit}");
    }
    for short in 0..bytes.len() {
        assert_eq!(decode::<JOINTS, 3>(&bytes[..short]).unwrap_err(), ModelError::Damaged, "{short}");
    }
    let sealed = |bytes: &[u8]| [bytes, &checksum(bytes).to_le_bytes()].concat();
    let mut buffer = [0; 4096];
    let eleven =
        encode(&hand::<JOINTS, 3>(), &postures(), &config(), &OUTPUTS[1..], &mut buffer).expect("it fits");
    assert_eq!(decode::<JOINTS, 3>(eleven).unwrap_err(), ModelError::Malformed, "an output is missing");
    let longer = sealed(&[&bytes[..bytes.len() - 4], &[0]].concat());
    assert_eq!(decode::<JOINTS, 3>(&longer).unwrap_err(), ModelError::Malformed);
}

#[test]
fn a_parameter_that_cannot_be_used_is_named() {
    let mut config = config::<JOINTS>();
    config.laws.hold.damping_nm_s[3] = -1.0;
    let error = decode::<JOINTS, 3>(&bytes(&config)).unwrap_err();
    assert_eq!(error.to_string(), "damping_nm_s of joint 3 has to be zero or positive");
}

proptest! {
    /// Bytes that are something else, but have their CRC.
    #[test]
    fn whatever_is_sealed_is_decoded_or_refused(changes in prop::collection::vec((0_usize..3000, any::<u8>()), 1..9)) {
        let mut changed = bytes(&config());
        changed.truncate(changed.len() - 4);
        let length = changed.len();
        changes.iter().for_each(|&(at, byte)| changed[at % length] = byte);
        let sealed = [&changed[..], &checksum(&changed).to_le_bytes()].concat();
        if let Ok(params) = decode::<JOINTS, 3>(&sealed) {
            // A tree, so that this ends.
            for fingertip in 0..params.hand().fingertip_count() {
                prop_assert!(params.hand().joints_to(fingertip).count() <= JOINTS);
            }
        }
    }
}
