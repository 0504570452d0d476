//! Parts of a hand that are inside each other, the object or a table at the start, where nothing gets by itself.

use super::check::{Result, fail, item};
use super::file::TableFile;
use super::{HandFile, Start};
use blindgrasp_body::polyhedron::{Polyhedron, Touchable};
use blindgrasp_body::{Capsule, Hand, Part, Posture, overlap_m, pairs};
use nalgebra::Vector3;

/// The key by which links touch.
const KEY: &str = "plant.links";
/// The remedy for links that can't.
const REMEDY: &str = "move contacts or object, correct the hand's capsules, or set it to false";

impl HandFile {
    /// A part of the hand in words.
    pub fn part_in_words(&self, part: Part) -> String {
        match part {
            Part::Fingertip(number) => format!("fingertip `{}`", self.fingertips[number].name),
            Part::Capsule(number) => match &self.capsules[number].link {
                Some(link) => format!("link `{link}` (capsule {})", number + 1),
                None => format!("the palm (capsule {})", number + 1),
            },
        }
    }
}

/// A hand in a posture, with its capsules.
pub(super) struct Posed<'a> {
    pub(super) file: &'a HandFile,
    pub(super) hand: &'a Hand,
    pub(super) capsules: &'a [Capsule],
    pub(super) posture: &'a Posture,
    /// The hand touches the object where the scene's contacts are.
    pub(super) touches: bool,
}

impl Posed<'_> {
    /// Checks that no parts that may touch are inside each other.
    pub(super) fn are_apart(&self) -> Result<()> {
        let overlap_m = |parts: &[Part; 2]| overlap_m(*parts, self.hand, self.posture, self.capsules);
        let overlaps = pairs(self.hand, self.capsules).into_iter().map(|parts| (overlap_m(&parts), parts));
        let Some((overlap_m, parts)) = overlaps.max_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(()) };
        if overlap_m > 0.0 {
            let [a, b] = parts.map(|part| self.file.part_in_words(part));
            let problem = format!("{a} and {b} overlap by {:.3} mm at the start", overlap_m * 1e3);
            return match parts {
                [Part::Fingertip(_), Part::Fingertip(_)] if !self.touches => {
                    fail("start", problem, "open the hand wider")
                }
                [Part::Fingertip(_), Part::Fingertip(second)] => {
                    fail(item("contact", second, "point_m"), problem, "move the contacts apart")
                }
                _ => fail(KEY, problem, REMEDY),
            };
        }
        Ok(())
    }

    /// Checks that links and palm are outside the object.
    pub(super) fn are_outside(&self, shape: &Polyhedron, start: &Start) -> Result<()> {
        if self.capsules.is_empty() {
            return Ok(());
        }
        let (object, to_object) = (Touchable::of(shape), start.attitude.inverse());
        let depth_m = |number: usize| {
            let ends_m = Part::Capsule(number).ends_m(self.posture, self.capsules);
            let (_, nearest) =
                object.closest_to_line(&ends_m.map(|end_m| to_object * (end_m - start.position_m)));
            self.capsules[number].radius_m - nearest.distance_m
        };
        let depths = (0..self.capsules.len()).map(|number| (depth_m(number), number));
        match depths.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((depth_m, number)) if depth_m > 0.0 => {
                let name = self.file.part_in_words(Part::Capsule(number));
                fail(KEY, format!("{name} is {:.3} mm inside the object at the start", depth_m * 1e3), REMEDY)
            }
            _ => Ok(()),
        }
    }

    /// Checks that nothing is inside a table that could touch it: the base does not.
    pub(super) fn are_above(&self, tables: &[TableFile]) -> Result<()> {
        let fingertips = (0..self.hand.fingertip_count()).map(Part::Fingertip);
        let moving = (0..self.capsules.len()).filter(|&capsule| self.capsules[capsule].link.is_some());
        let parts: Vec<Part> = fingertips.chain(moving.map(Part::Capsule)).collect();
        for (t, table) in tables.iter().enumerate() {
            for part in &parts {
                let heights_m = part.ends_m(self.posture, self.capsules).map(|end_m| height_m(table, &end_m));
                let depth_m = part.radius_m(self.hand, self.capsules) - heights_m[0].min(heights_m[1]);
                if depth_m > 0.0 {
                    let name = self.file.part_in_words(*part);
                    let problem = format!("{name} is {:.3} mm inside the table", depth_m * 1e3);
                    let remedy = match part {
                        Part::Fingertip(_) => "move the table, or grasp the object farther from it",
                        Part::Capsule(_) => {
                            "move the table, grasp the object farther from it, or set plant.links to false"
                        }
                    };
                    return fail(item("plant.table", t, "point_m"), problem, remedy);
                }
            }
        }
        Ok(())
    }
}

/// Height of a point above a table at the start, m.
pub(super) fn height_m(table: &TableFile, point_m: &Vector3<f64>) -> f64 {
    Vector3::from(table.normal).dot(&(point_m - Vector3::from(table.point_m)))
}
