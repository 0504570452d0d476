//! The constants that this firmware was built with, against the hand's file (`HAND`, as for the build).

use blindgrasp::scene::{HandModel, config_source};
use blindgrasp_firmware::model::{CONFIG, FINGERS, HAND, IMAGE_HAND, IMAGE_PIL, JOINTS};
use blindgrasp_shared::hand::Hand;
use blindgrasp_shared::identity::Image;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_shared::tick::Params;

fn hand_model() -> HandModel {
    std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .expect("the root of the repository");
    let name =
        option_env!("HAND").filter(|name| !name.is_empty()).unwrap_or("models/hands/three-finger.toml");
    HandModel::load(name).expect("the build has read it")
}

/// What the compiler made of the digits is what the simulation computes with. The texts tell minus zero from zero.
#[test]
fn the_constants_are_the_hand_to_the_bit() {
    let model = hand_model();
    let hand: Hand<f32, JOINTS, FINGERS> = model.hand.fit().expect("it has this size").cast();
    assert_eq!(format!("{HAND:?}"), format!("{hand:?}"));
    assert_eq!(config_source(&CONFIG, JOINTS), config_source(&model.config, JOINTS));
    Params::new(HAND.clone(), &CONFIG).expect("the build has checked it");
}

#[test]
fn the_images_say_what_they_are() {
    let model = hand_model();
    for (bytes, kind) in [(&IMAGE_HAND[..], "hand"), (&IMAGE_PIL[..], "pil")] {
        let image = Image::find(bytes).expect("a description");
        assert_eq!((image.kind, image.hand), (kind, model.name.as_str()));
        assert_eq!((usize::from(image.joint_count), usize::from(image.fingertip_count)), (JOINTS, FINGERS));
        assert_eq!(image.interface_version, INTERFACE_VERSION);
        assert_eq!(image.period_us, CONFIG.period_us);
        assert_eq!(image.firmware_version, env!("CARGO_PKG_VERSION"));
    }
}
