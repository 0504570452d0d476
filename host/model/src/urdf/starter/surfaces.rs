//! The surfaces of links and palm: what the URDF has of them, and what is guessed around meshes.

use super::super::super::file::HandFile;
use super::super::super::hand::{MAX_CAPSULES, is_capsule};
use super::super::super::one_line;
use super::super::assembly::{Assembly, MOST_NAMES};
use super::super::expand::{Surface, surfaces};
use super::super::robot::Robot;
use super::super::xml::quote;
use super::meshes::Boxes;
use super::text::Draft;
use std::fmt::Write as _;
use std::path::Path;

/// The surfaces of a hand's file.
#[derive(Default)]
pub(super) struct Surfaces {
    /// All capsules, if some of them are guessed; else they stay in the URDF.
    written: Vec<Surface>,
    /// The shapes that touch nothing, with their links, in words.
    left_out: Vec<String>,
    /// The text of the file on them.
    pub(super) comments: Vec<String>,
}

impl Surfaces {
    /// Of a URDF in a folder.
    pub(super) fn of(draft: &Draft<'_>, folder: &Path) -> Self {
        let (robot, assembly) = (draft.robot, &draft.assembly);
        let mut boxes = Boxes::around(robot, assembly, folder);
        let mut written = surfaces(robot, assembly, &draft.seated_tips(), &boxes.shapes);
        written.retain(|surface| is_capsule(&surface.round.ends_m, surface.round.radius_m));
        if written.len() > MAX_CAPSULES {
            let crowd = format!("a mesh: with it there were more than {MAX_CAPSULES} capsules");
            boxes.left_out.extend(boxes.shapes.iter().map(|(link, _)| (*link, crowd.clone())));
            written.clear();
        } else if written.iter().all(|surface| !surface.is_more) {
            written.clear();
        }
        let seated = robot.links.iter().enumerate().filter(|(k, _)| assembly.seats[*k].is_some());
        let unread = seated.flat_map(|(k, link)| link.left_out.iter().map(move |what| (k, what.clone())));
        let left_out = unread.chain(boxes.left_out);
        let left_out = left_out.map(|(link, what)| format!("`{}` ({what})", quote(&robot.links[link].name)));
        Self { left_out: left_out.collect(), written, comments: Vec::new() }
    }

    fn guessed(&self) -> usize {
        self.written.iter().filter(|surface| surface.is_more).count()
    }

    /// Tells the capsules of a file that are the URDF's.
    pub(super) fn of_the_urdf(&self, file: &HandFile) -> Option<String> {
        told(file.capsules.len() - self.guessed(), "in <collision> shapes")
    }

    /// Tells the capsules that are guessed.
    pub(super) fn guess(&self) -> Option<String> {
        told(self.guessed(), "in the smallest boxes around meshes")
    }

    /// Tells the shapes that touch nothing.
    pub(super) fn gap(&self) -> Option<String> {
        let named =
            self.left_out.get(..self.left_out.len().min(MOST_NAMES)).filter(|named| !named.is_empty())?;
        let more = match self.left_out.len() - named.len() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        Some(one_line(&format!("no surface, so that nothing touches it there: {}{more}", named.join(", "))))
    }

    /// Adds them to the file's text.
    pub(super) fn write(&self, robot: &Robot, assembly: &Assembly, text: &mut String) {
        if !self.comments.is_empty() {
            let rule = if self.written.is_empty() {
                "the URDF's; [[capsule]]s here replace them all"
            } else {
                "[[capsule]]s here replace all of the URDF's"
            };
            let _ = writeln!(text, "\n# Links and palm: {rule}.");
            self.comments.iter().for_each(|comment| {
                let _ = writeln!(text, "# - {comment}.");
            });
        }
        for Surface { joint, round, is_more, .. } in &self.written {
            let _ = writeln!(text, "\n[[capsule]]");
            if let Some(joint) = joint {
                let link = robot.joints[assembly.joints[*joint].joint].child;
                let _ = writeln!(text, "link = {}", toml::Value::String(robot.links[link].name.clone()));
            }
            let guess = if *is_more { "  # GUESS: in the smallest box around a mesh" } else { "" };
            let rounded = |value: f64| if *is_more { (value * 1e5).round() / 1e5 + 0.0 } else { value };
            for (key, end_m) in ["from_m", "to_m"].into_iter().zip(&round.ends_m) {
                let [x, y, z]: [f64; 3] = end_m.map(rounded).into();
                let _ = writeln!(text, "{key} = [{x:?}, {y:?}, {z:?}]{guess}");
            }
            let _ = writeln!(text, "radius_m = {:?}{guess}", rounded(round.radius_m).max(1e-4));
        }
    }
}

fn told(count: usize, place: &str) -> Option<String> {
    match count {
        0 => None,
        1 => Some(format!("surfaces of links: 1 capsule {place}")),
        _ => Some(format!("surfaces of links: {count} capsules {place}")),
    }
}
