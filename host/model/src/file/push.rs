//! A push at the object, in a file.

use super::key::{FileKey, keys};
use blindgrasp_body::Push;
use serde::{Deserialize, Serialize};

keys! {
    /// A force and a moment on the object, for a while.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct PushFile {
        /// Its beginning, s; the grasp begins at 0.
        pub from_s: f64,
        /// Its length, s.
        pub for_s: f64,
        /// Time in which it rises at its beginning, and falls at its end, s; 0 for at once.
        #[serde(default)]
        pub rise_s: f64,
        /// Force at the centre of mass in the base frame of the hand, N.
        #[serde(default)]
        pub force_n: [f64; 3],
        /// Moment in the base frame of the hand, N m.
        #[serde(default)]
        pub moment_nm: [f64; 3],
    }
}

impl PushFile {
    /// Returns it as the plant has it.
    pub fn push(&self) -> Push {
        Push {
            from_s: self.from_s,
            for_s: self.for_s,
            rise_s: self.rise_s,
            force_n: self.force_n.into(),
            moment_nm: self.moment_nm.into(),
        }
    }
}
