//! The hand that this firmware was built with, against its file (`HAND`, as for the build).

use blindgrasp_firmware::model::{
    FINGERS, IMAGE_HAND, IMAGE_PIL, JOINTS, MODEL, params, torques_per_volt_nm_v,
};
use blindgrasp_model::HandModel;
use blindgrasp_shared::hand::Hand;
use blindgrasp_shared::identity::Image;
use blindgrasp_shared::model::encode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;

fn hand_model() -> HandModel {
    std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .expect("the root of the repository");
    let name =
        option_env!("HAND").filter(|name| !name.is_empty()).unwrap_or("models/hands/three-finger.toml");
    HandModel::load(name).expect("the build has read it")
}

/// The firmware decodes the hand that the simulation computes with, in whatever capacity. The bytes tell minus zero
/// from zero.
#[test]
fn the_model_is_the_hand_to_the_bit() {
    let model = hand_model();
    assert_eq!(MODEL, model.bytes());
    let params = params();
    let hand: Hand<f32, JOINTS, FINGERS> = model.hand.fit().expect("it has this size").cast();
    assert_eq!(*params.hand(), hand);
    let mut buffer = [0; 8192];
    assert_eq!(
        encode(params.hand(), params.postures(), params.config(), &torques_per_volt_nm_v(), &mut buffer),
        Ok(MODEL)
    );
}

#[test]
fn the_images_say_what_they_are() {
    let model = hand_model();
    for (bytes, kind) in [(&IMAGE_HAND[..], "hand"), (&IMAGE_PIL[..], "pil")] {
        let image = Image::find(bytes).expect("a description");
        assert_eq!((image.kind, image.hand), (kind, model.name.as_str()));
        assert_eq!((usize::from(image.joint_count), usize::from(image.fingertip_count)), (JOINTS, FINGERS));
        assert_eq!(image.interface_version, INTERFACE_VERSION);
        assert_eq!((image.period_us, image.hand_hash), (model.config.period_us, model.hash()));
        assert_eq!(image.firmware_version, env!("CARGO_PKG_VERSION"));
    }
}
