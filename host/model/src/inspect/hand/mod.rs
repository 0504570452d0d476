//! `hand check`: what a hand is, whether it can be used, and what is likely a mistake.
//!
//! What the loader refuses, it lists; a `specimen` is what can be computed with all the same. `rules` look at it: each kind of mistake is a rule. `reach`, `meeting` and `strength` compute what the
//! rules and the `facts` need: how far fingertips get, where they meet, what the motors can do. `text` shows it to people.

mod facts;
mod found;
mod meeting;
mod reach;
mod rules;
mod specimen;
mod strength;
#[cfg(test)]
mod tests;
mod text;

use super::finding::{Counts, Findings, Severity, Verdict};
use crate::{Examined, HandFile, HandModel, Places, SceneError, still_joints};
use blindgrasp_body::{Capsule, Hand, MAX_JOINTS};
use found::Found;
use serde::Serialize;
use specimen::Specimen;
use std::ffi::OsStr;

pub use facts::{
    CapsuleFacts, ClosingFacts, FingertipFacts, JointFacts, Masses, MeetingFacts, MeetingsFacts,
    PostureFacts, Reach,
};

/// The findings of a check of a hand. `--json` prints it.
#[derive(Clone, Debug, Serialize)]
pub struct HandCheck {
    /// Its name.
    pub name: String,
    /// A sentence or two.
    pub description: String,
    /// The verdict that follows from the findings.
    pub verdict: Verdict,
    /// The number of findings of each severity.
    pub counts: Counts,
    /// The joint map.
    pub joints: Vec<JointFacts>,
    /// The fingertips.
    pub fingertips: Vec<FingertipFacts>,
    /// The capsules.
    pub capsules: Vec<CapsuleFacts>,
    /// The named postures; empty where the tree is not known.
    pub postures: Vec<PostureFacts>,
    /// The reach of the fingertips; empty where the tree is not known.
    pub reach: Vec<Reach>,
    /// The masses of the links; `None` where the tree is not known.
    pub masses: Option<Masses>,
    /// The places where the fingertips meet; `None` where the tree is not known.
    pub meeting: Option<MeetingsFacts>,
    /// The forces of fingertips that close; `None` where they don't, or the tree is not known.
    pub closing: Option<ClosingFacts>,
    /// All that was found, the worst first.
    pub findings: Findings,
    /// For a picture.
    #[serde(skip)]
    pub nominal: Option<NominalHand>,
}

/// A hand and the posture to show it in.
#[derive(Clone, Debug, PartialEq)]
pub struct NominalHand {
    /// The hand.
    pub hand: Hand,
    /// Its surfaces, as far as their numbers can be used.
    pub capsules: Vec<Capsule>,
    /// Names of its joints, in its order.
    pub joint_names: Vec<String>,
    /// Nominal angles within the limits, rad; zero beyond the hand's joints.
    pub angles_rad: [f64; MAX_JOINTS],
}

impl HandCheck {
    /// Loads a hand by its built-in name or by its path, and looks at everything.
    ///
    /// # Errors
    /// What keeps the file from being read at all: it is not there, no TOML, or a key is unknown, missing or of another type.
    pub fn load(name_or_path: impl AsRef<OsStr>) -> Result<Self, SceneError> {
        let (file, places) = HandFile::load_with_places(name_or_path)?;
        Ok(Self::of(file, &places))
    }

    /// Looks at a hand that is in a text; `source` is its name in findings.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(text: &str, source: &str) -> Result<Self, SceneError> {
        let (file, places) = HandFile::parse_with_places(text, source)?;
        Ok(Self::of(file, &places))
    }

    fn of(file: HandFile, places: &Places) -> Self {
        let mut found = Found::default();
        let specimen = examine(&file, &mut found);
        let specimen = specimen.as_ref();
        let meetings = specimen.map(|specimen| {
            let meetings = meeting::meetings(specimen);
            look(specimen, &meetings, &mut found);
            confirm(specimen, &mut found);
            facts::meetings(specimen, &meetings)
        });
        let mut findings = Findings::default();
        findings.extend(found.findings.into_iter().map(|finding| {
            let place = places.of(&finding.key);
            finding.at(place)
        }));
        findings.extend(places.notices.iter().cloned());
        findings.sort();
        Self {
            joints: facts::joints(&file, specimen),
            fingertips: facts::fingertips(&file, specimen),
            capsules: facts::capsules(&file),
            postures: specimen.map_or(Vec::new(), facts::postures),
            reach: specimen.map_or(Vec::new(), facts::reaches),
            masses: specimen.map(facts::masses),
            meeting: meetings,
            closing: specimen.and_then(facts::closing),
            verdict: findings.verdict(),
            counts: findings.counts(),
            findings,
            nominal: specimen.map(|specimen| NominalHand {
                hand: specimen.hand.clone(),
                capsules: specimen.capsules(),
                joint_names: specimen.file.joints.iter().map(|joint| joint.name.clone()).collect(),
                angles_rad: specimen.nominal_rad,
            }),
            name: file.name,
            description: file.description,
        }
    }

    /// All of it for people to read.
    pub fn text(&self) -> String {
        text::describe(self)
    }
}

/// Finds the faults of single numbers, and all that the loader refuses. Gives the hand, if the tree is known.
fn examine(file: &HandFile, found: &mut Found) -> Option<Specimen> {
    use rules::numbers::{axes, degrees, lengths, radii, subject_of};
    for rule in [axes, degrees, lengths, radii] {
        rule(file, found);
    }
    let Examined { refused, file: mended, numbers, hand } = Examined::of(file);
    for error in refused {
        let subject = subject_of(file, &error.key);
        found.refuse(error, subject);
    }
    Some(Specimen::new(mended, numbers, hand?))
}

/// All that needs the tree.
fn look(specimen: &Specimen, meetings: &meeting::Meetings, found: &mut Found) {
    use rules::{axes, drive, gains, inertia, ranges, shape};
    inertia::links(specimen, found);
    still(specimen, found);
    for rule in [
        ranges::zero,
        ranges::narrow,
        axes::senses,
        shape::size,
        shape::freedom,
        shape::overlaps,
        shape::crossings,
        shape::postures,
        drive::torques,
        drive::speeds,
        drive::encoders,
        gains::damping,
        gains::control,
        gains::closing,
    ] {
        rule(specimen, found);
    }
    shape::meeting(specimen, meetings, found);
}

/// Joints that move no mass, which nothing can simulate.
fn still(specimen: &Specimen, found: &mut Found) {
    for joint in still_joints(&specimen.hand, &specimen.nominal_rad[..specimen.joints()]) {
        let remedy = "give its link, or one that it carries, a mass and an inertia";
        let what = "moves no mass: the hand can't be simulated";
        found.push(specimen.on_joint(Severity::Error, (joint, "mass_kg"), what, remedy));
    }
}

/// The last check, for faults that no rule knows of: a hand without errors is one that a firmware can be built with, gains or not.
fn confirm(specimen: &Specimen, found: &mut Found) {
    let is_broken = found.findings.iter().any(|finding| finding.severity == Severity::Error);
    if is_broken || specimen.file.control.is_none() {
        return;
    }
    if let Err(error) = HandModel::of_prepared(&specimen.file, specimen.hand.clone()) {
        let subject = rules::numbers::subject_of(&specimen.file, &error.key);
        found.refuse(error, subject);
    }
}
