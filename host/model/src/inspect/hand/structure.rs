//! The tree of a hand: everything that the loader refuses of the tree, and the hand where the tree is known.

use crate::{HandFile, SceneError};
use blindgrasp_body::Hand;

/// The tree of a file.
pub(super) struct Structure {
    /// The refusals; keys are those of the user's file.
    pub(super) refused: Vec<SceneError>,
    /// The number of each joint in the user's file, from 1: joints that move no fingertip are taken out of the file.
    pub(super) numbers: Vec<usize>,
    /// The hand; `None` where it is not known what sits on what.
    pub(super) hand: Option<Hand>,
}

/// Puts the tree before the loader, mends what it refuses, and goes on until it is accepted or can't be mended.
pub(super) fn settle(file: &mut HandFile) -> Structure {
    let mut numbers: Vec<usize> = (1..=file.joints.len()).collect();
    let (mut refused, mut is_known) = (Vec::new(), true);
    // Each turn takes away or renames one thing, so that this comes to an end; a turn that doesn't is the last.
    for _ in 0..2 * (file.joints.len() + file.fingertips.len()) {
        let error = match file.kinematics() {
            Ok(hand) => return Structure { refused, numbers, hand: is_known.then_some(hand) },
            Err(error) => error,
        };
        let path: Vec<String> = error.key.split('.').map(str::to_owned).collect();
        let [list, number, key] = path.as_slice() else {
            refused.push(error);
            break;
        };
        let Some(index) = number.parse::<usize>().ok().and_then(|number| number.checked_sub(1)) else {
            break;
        };
        let told = match list.as_str() {
            "joint" => numbers.get(index).map(|number| format!("joint.{number}.{key}")),
            _ => Some(error.key.clone()),
        };
        let mended = mend(file, &mut numbers, list, index, key);
        match mended {
            Mended::Known => {}
            Mended::Guessed => is_known = false,
            // A stray joint may be one only because of what was guessed.
            Mended::Stray if !is_known => break,
            Mended::Stray => {}
            Mended::Not => {
                refused.push(error);
                break;
            }
        }
        refused.push(SceneError { key: told.unwrap_or_else(|| error.key.clone()), ..error });
    }
    Structure { refused, numbers, hand: None }
}

enum Mended {
    /// The tree is what the user meant.
    Known,
    /// It may be another.
    Guessed,
    /// A joint that moves no fingertip is gone, with all that it carries.
    Stray,
    Not,
}

fn mend(file: &mut HandFile, numbers: &mut Vec<usize>, list: &str, index: usize, key: &str) -> Mended {
    match (list, key) {
        ("joint", "name") if index < file.joints.len() => {
            let name = &file.joints[index].name;
            if file.joints[..index].iter().any(|joint| joint.name == *name) {
                // Who names it as parent means either.
                file.joints[index].name =
                    (1..).map(|k| format!("#{k}")).find(|new| is_free(file, new)).unwrap_or_default();
                return Mended::Guessed;
            }
            let mut gone = vec![index];
            for k in index + 1..file.joints.len() {
                let parent = file.joints[k].parent.as_deref();
                if gone.iter().any(|&g| parent == Some(file.joints[g].name.as_str())) {
                    gone.push(k);
                }
            }
            for k in gone.into_iter().rev() {
                file.joints.remove(k);
                numbers.remove(k);
            }
            Mended::Stray
        }
        ("joint", "parent") if index < file.joints.len() => {
            file.joints[index].parent = None;
            Mended::Guessed
        }
        ("fingertip", "name") if index < file.fingertips.len() => {
            file.fingertips[index].name =
                (1..).map(|k| format!("#{k}")).find(|new| is_free(file, new)).unwrap_or_default();
            Mended::Known
        }
        ("fingertip", "link") if index < file.fingertips.len() && !file.joints.is_empty() => {
            file.fingertips[index].link = file.joints[file.joints.len() - 1].name.clone();
            Mended::Guessed
        }
        _ => Mended::Not,
    }
}

fn is_free(file: &HandFile, name: &str) -> bool {
    file.joints.iter().all(|joint| joint.name != name) && file.fingertips.iter().all(|tip| tip.name != name)
}
