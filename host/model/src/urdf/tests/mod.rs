//! Hands from URDFs: what is read of them, and what is said of those that are wrong.

mod damage;
mod expansion;
mod hand_file;
mod refusals;
mod shapes;
mod starter;

use super::super::file::HandFile;
use super::super::hand_model::HandModel;
use crate::tests::cases::cases;
use blindgrasp_body::Hand;
use tempfile::TempDir;

/// A gripper of four joints.
const GRIPPER: &str = include_str!("gripper.urdf");

/// The gripper's hand.
const HAND: &str = "schema = 1
name = \"gripper\"
[urdf]
file = \"gripper.urdf\"
base = \"palm\"

[control]
force_n = 2.0
attitude_stiffness_nm = 1e-3

[joint_defaults]
damping_gain_nm_s_rad = 1e-3
encoder_counts_per_turn = 4096

[fingertip_defaults]
offset_m = [0.0, 0.0, 0.0]
radius_m = 0.01
stiffness_n_m2 = 1e6
damping_n_s_m_per_m2 = 1.0
torsional_damping_nm_s_rad_per_m2 = 1e4

[[fingertip]]
name = \"left\"
link = \"left-tip\"

[[fingertip]]
name = \"right\"
link = \"right-tip\"
";

type Loaded = (HandFile, Hand, Vec<String>);

/// A hand's file and its URDF on the disk, as long as this is there.
struct Folder(TempDir);

impl Folder {
    fn new(toml: &str, urdf: &[u8]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        std::fs::write(folder.path("hand.toml"), toml).unwrap();
        std::fs::write(folder.path("gripper.urdf"), urdf).unwrap();
        folder
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().into()
    }

    /// Without the folder in it.
    fn plain(&self, words: &str) -> String {
        words.replace(&format!("{}/", self.0.path().display()), "")
    }
}

/// Loads a hand; what is said is without the folder.
fn load(toml: &str, urdf: &str) -> Result<Loaded, String> {
    load_bytes(toml, urdf.as_bytes())
}

fn load_bytes(toml: &str, urdf: &[u8]) -> Result<Loaded, String> {
    let folder = Folder::new(toml, urdf);
    match HandFile::load_checked(folder.path("hand.toml")) {
        Ok((file, hand, warnings)) => {
            let warnings = warnings.iter().map(|words| folder.plain(words)).collect();
            Ok((file, hand, warnings))
        }
        Err(error) => Err(folder.plain(&error.to_string())),
    }
}

/// A text that is changed in one place, which has to be there.
fn changed(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

/// The whole message of a hand that has to be refused.
fn message(toml: &str, urdf: &str) -> String {
    let error = load(toml, urdf).map(|(file, _, _)| file.name).expect_err("has to be refused");
    assert!(!error.contains('\n'), "{error}");
    error
}
