//! The reasons for which there is no placement: how many choices failed at which test, and how near the nearest came.

use super::stance::Miss;
use blindgrasp_model::HandFile;
use serde::Serialize;
use std::fmt;

/// The results of the choices of faces, test by test.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Refusal {
    /// The reason, in words.
    pub reason: String,
    /// The tests in their order: what they test, how many choices of faces failed, and the nearest miss.
    pub tests: Vec<Test>,
}

/// A test that choices of faces failed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Test {
    /// The failure, in words.
    pub what: String,
    /// The number of failures.
    pub failed: usize,
    /// The nearest miss, in words; empty where there is no measure.
    pub nearest: String,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.reason)?;
        for test in &self.tests {
            write!(f, "\n  {:>7} x  {}", test.failed, test.what)?;
            if !test.nearest.is_empty() {
                write!(f, "; {}", test.nearest)?;
            }
        }
        Ok(())
    }
}

/// A count with the nearest miss.
#[derive(Clone, Debug)]
pub(super) struct Tally<T> {
    failed: usize,
    nearest: Option<(f64, T)>,
}

impl<T> Default for Tally<T> {
    fn default() -> Self {
        Self { failed: 0, nearest: None }
    }
}

impl<T> Tally<T> {
    /// One more that failed, by so much.
    pub(super) fn add(&mut self, by: f64, what: T) {
        self.failed += 1;
        if self.nearest.as_ref().is_none_or(|(least, _)| by < *least) {
            self.nearest = Some((by, what));
        }
    }
}

/// All that is counted on the way.
#[derive(Clone, Debug, Default)]
pub(super) struct Count {
    /// Choices of faces.
    pub(super) choices: usize,
    /// On which the law would pull a fingertip off.
    pub(super) pulled_off: usize,
    /// Choices that ask for too much friction, and for how much.
    pub(super) slips: Tally<()>,
    /// Choices whose fingertips would overlap, m.
    pub(super) close: Tally<()>,
    /// Choices that lie farther apart than two fingertips get: by how much (m), the fingertips, and their distance (m).
    pub(super) wide: Tally<(usize, usize, f64)>,
    /// Without a position at which all fingertips get to their contacts.
    pub(super) apart: usize,
    /// Positions that were tried at which a fingertip does not get to its contact: by how much (m).
    pub(super) unreachable: Tally<Miss>,
    /// At which a joint would stand at its end stop.
    pub(super) at_stop: Tally<Miss>,
    /// At which fingertips overlap (m), or meet another part of the object (m).
    pub(super) overlap: Tally<Miss>,
    /// At which links would be inside each other, a fingertip, the palm or the object (m).
    pub(super) cross: Tally<Miss>,
    /// At which a fingertip would touch with its back.
    pub(super) back: Tally<Miss>,
    /// At which a bone passes through the object.
    pub(super) through: Tally<Miss>,
    /// Choices that the checks of a scene refuse, and why.
    pub(super) refused: Tally<String>,
}

impl Count {
    /// A position that was tried.
    pub(super) fn miss(&mut self, miss: Miss) {
        match miss {
            Miss::Unreachable(by) => self.unreachable.add(by.distance_m, miss),
            Miss::AtStop(_) => self.at_stop.add(0.0, miss),
            Miss::Overlap(_, _, by) | Miss::Beside(_, by) => self.overlap.add(by, miss),
            Miss::Cross(_, by) | Miss::Inside(_, by) => self.cross.add(by, miss),
            Miss::Back(_, cosine) => self.back.add(-cosine, miss),
            Miss::Through(_) | Miss::TipThrough(_) => self.through.add(0.0, miss),
        }
    }

    /// In words.
    pub(super) fn refusal(&self, words: &Words<'_>) -> Refusal {
        let mut tests = Vec::new();
        let mut test = |failed: usize, what: &str, nearest: String| {
            if failed > 0 {
                tests.push(Test { what: what.to_owned(), failed, nearest });
            }
        };
        test(self.pulled_off, "the law would pull a fingertip off its face", String::new());
        test(
            self.slips.failed,
            "asks for too much friction",
            nearest(&self.slips, |by, ()| format!("at least {by:.2}")),
        );
        test(
            self.close.failed,
            "fingertips would overlap",
            nearest(&self.close, |by, ()| format!("by {:.1} mm at least", by * 1e3)),
        );
        test(
            self.wide.failed,
            "farther apart than the fingertips get",
            nearest(&self.wide, |by, _| format!("by {:.1} mm at least", by * 1e3)),
        );
        test(self.apart, "no position at which every fingertip gets to its contact", String::new());
        let misses = [
            (&self.unreachable, "tried, but a fingertip does not quite get there"),
            (&self.at_stop, "tried, but a joint would stand at its end stop"),
            (&self.overlap, "tried, but a fingertip would be in the way"),
            (&self.cross, "tried, but links would be in each other's way, or the object's"),
            (&self.back, "tried, but a fingertip would touch with its back"),
            (&self.through, "tried, but a finger would pass through the object"),
        ];
        for (tally, what) in misses {
            test(tally.failed, what, nearest(tally, |_, miss| words.miss(miss)));
        }
        test(
            self.refused.failed,
            "taken, but the scene is refused",
            nearest(&self.refused, |_, why| why.clone()),
        );
        Refusal { reason: self.reason(words), tests }
    }

    /// Returns the reason: the last test that anything came to.
    fn reason(&self, words: &Words<'_>) -> String {
        let fingertips = words.hand.fingertips.len();
        if let Some((_, why)) = &self.refused.nearest {
            return format!("the fingers get there, but the scene is refused: {why}");
        }
        let tried = [&self.unreachable, &self.at_stop, &self.overlap, &self.cross, &self.back, &self.through];
        if tried.iter().any(|tally| tally.failed > 0) {
            let worst = tried.into_iter().max_by_key(|tally| tally.failed);
            let miss = worst.map_or(String::new(), |tally| nearest(tally, |_, miss| words.miss(miss)));
            return format!("the fingers come near, but {miss}");
        }
        if self.apart > 0 {
            let at = if words.any_position { "there is no position" } else { "the given position is none" };
            let attitude = if words.any_attitude { "any of the attitudes tried" } else { "this attitude" };
            return format!(
                "{at} at which, in {attitude}, all {fingertips} fingertips get to contacts of theirs at once"
            );
        }
        if let Some((_, (i, j, across))) = &self.wide.nearest {
            let [a, b] = [*i, *j].map(|k| &words.hand.fingertips[k]);
            let radii = a.radius_m + b.radius_m;
            return format!(
                "the largest opening between the fingertips `{}` and `{}` is {:.0} mm; the object is at least {:.0} mm across",
                a.name,
                b.name,
                (words.farthest_m(*i, *j) - radii) * 1e3,
                across * 1e3
            );
        }
        if let Some((by, ())) = &self.close.nearest {
            return format!(
                "the object is too small for {fingertips} fingertips: they would overlap by {:.1} mm",
                by * 1e3
            );
        }
        match &self.slips.nearest {
            Some((friction, ())) => format!(
                "no {fingertips} faces have normals that can balance: the best ask for a friction of {friction:.2}, and {:.2} \
                 is the limit",
                super::FRICTION_LIMIT
            ),
            None => format!(
                "no {fingertips} faces have normals that can balance: on all choices the law would pull a fingertip off"
            ),
        }
    }
}

fn nearest<T>(tally: &Tally<T>, words: impl Fn(f64, &T) -> String) -> String {
    tally.nearest.as_ref().map_or(String::new(), |(by, what)| words(*by, what))
}

/// The data of the words.
pub(super) struct Words<'a> {
    pub(super) hand: &'a HandFile,
    pub(super) reach: &'a super::reach::Reach,
    pub(super) any_attitude: bool,
    pub(super) any_position: bool,
}

impl Words<'_> {
    fn farthest_m(&self, i: usize, j: usize) -> f64 {
        self.reach.farthest_m[i][j]
    }

    fn miss(&self, miss: &Miss) -> String {
        let fingertip = |i: usize| &self.hand.fingertips[i].name;
        match *miss {
            Miss::Unreachable(by) => {
                let limit = by.limited_by.map_or(String::new(), |k| {
                    format!(", with joint `{}` at its limit", self.hand.joints[k].name)
                });
                format!(
                    "fingertip `{}` stays {:.1} mm away{limit}",
                    fingertip(by.fingertip),
                    by.distance_m * 1e3
                )
            }
            Miss::AtStop(k) => format!("joint `{}` would stand at its end stop", self.hand.joints[k].name),
            Miss::Overlap(i, j, by) => {
                format!(
                    "fingertips `{}` and `{}` would overlap by {:.1} mm",
                    fingertip(i),
                    fingertip(j),
                    by * 1e3
                )
            }
            Miss::Beside(i, by) => {
                format!(
                    "fingertip `{}` would be {:.1} mm inside another part of the object",
                    fingertip(i),
                    by * 1e3
                )
            }
            Miss::Cross(parts, by) => {
                let [a, b] = parts.map(|part| self.hand.part_in_words(part));
                format!("{a} and {b} would overlap by {:.1} mm", by * 1e3)
            }
            Miss::Inside(part, by) => {
                format!("{} would be {:.1} mm inside the object", self.hand.part_in_words(part), by * 1e3)
            }
            Miss::Back(i, _) => format!("fingertip `{}` would touch with its back", fingertip(i)),
            Miss::Through(k) => {
                format!("the bone to joint `{}` would pass through the object", self.hand.joints[k].name)
            }
            Miss::TipThrough(i) => {
                format!("the bone to fingertip `{}` would pass through the object", fingertip(i))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_body::Part;
    use blindgrasp_body::inverse_kinematics::Unreachable;
    use blindgrasp_model::{Parts, Scene};

    /// Every way in which a posture can't be taken has words.
    #[test]
    fn every_miss_has_words() {
        let scene = Scene::load("cube", &[]).unwrap();
        let parts = Parts::of(&scene.file).unwrap();
        let reach = super::super::Reach::of_scene(&scene.file, &parts).unwrap();
        let words = Words { hand: &scene.file.hand, reach: &reach, any_attitude: false, any_position: true };
        let unreachable = |limited_by| Unreachable { fingertip: 1, distance_m: 0.0123, limited_by };
        for (miss, text) in [
            (Miss::Unreachable(unreachable(None)), "fingertip `finger-2` stays 12.3 mm away"),
            (
                Miss::Unreachable(unreachable(Some(4))),
                "fingertip `finger-2` stays 12.3 mm away, with joint `finger-2-abduct` at its limit",
            ),
            (Miss::AtStop(0), "joint `finger-1-abduct` would stand at its end stop"),
            (Miss::Overlap(0, 2, 0.0014), "fingertips `finger-1` and `finger-3` would overlap by 1.4 mm"),
            (
                Miss::Beside(1, 0.002),
                "fingertip `finger-2` would be 2.0 mm inside another part of the object",
            ),
            (
                Miss::Cross([Part::Capsule(0), Part::Fingertip(1)], 0.0014),
                "the palm (capsule 1) and fingertip `finger-2` would overlap by 1.4 mm",
            ),
            (
                Miss::Cross([Part::Capsule(3), Part::Capsule(7)], 0.0021),
                "link `finger-1-flex-1` (capsule 4) and link `finger-2-flex-2` (capsule 8) would overlap by 2.1 mm",
            ),
            (
                Miss::Inside(Part::Capsule(5), 0.0301),
                "link `finger-1-flex-3` (capsule 6) would be 30.1 mm inside the object",
            ),
            (Miss::Back(2, -0.3), "fingertip `finger-3` would touch with its back"),
            (Miss::Through(3), "the bone to joint `finger-1-flex-3` would pass through the object"),
            (Miss::TipThrough(0), "the bone to fingertip `finger-1` would pass through the object"),
        ] {
            let mut count = Count::default();
            count.miss(miss);
            let refusal = count.refusal(&words);
            assert_eq!(refusal.reason, format!("the fingers come near, but {text}"));
            assert_eq!((refusal.tests.len(), refusal.tests[0].failed), (1, 1));
            assert_eq!(refusal.tests[0].nearest, text);
        }
        let count = Count { apart: 3, ..Count::default() };
        assert_eq!(
            count.refusal(&words).to_string(),
            "there is no position at which, in this attitude, all 3 fingertips get to contacts of theirs at once\n        3 x  no \
             position at which every fingertip gets to its contact"
        );
        let mut count = Count::default();
        count.refused.add(0.0, "contact.1: is odd".to_owned());
        assert_eq!(
            count.refusal(&words).reason,
            "the fingers get there, but the scene is refused: contact.1: is odd"
        );
    }
}
