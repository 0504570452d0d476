//! The script of a scene: what the hand is told, and when.

use super::check::{Result, fail, item, within};
use super::error::suggestion;
use super::file::SceneFile;
use super::order::{self, Names};
use blindgrasp_shared::command::Command;
use blindgrasp_shared::cycle::Notice;

/// The most steps that a script may have.
const MOST_STEPS: usize = 1000;

/// A step of a script.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The command, and as it is written.
    pub command: Command,
    /// The command in words.
    pub order: String,
    /// The notice that has to come first, since the step before.
    pub when: Option<Notice>,
    /// Time that is to pass then, s.
    pub after_s: f64,
    /// Time from the beginning of the run before which it is not done, s.
    pub at_s: f64,
    /// Longest time to wait for what is to be noticed, s.
    pub within_s: f64,
}

impl SceneFile {
    /// Returns the steps of its script, checked.
    ///
    /// # Errors
    /// The first step that can't be done, and why.
    pub(super) fn steps(&self, longest_s: f64) -> Result<Vec<Step>> {
        if self.script.len() > MOST_STEPS {
            let problem =
                format!("the script has {} steps: at most {MOST_STEPS} are supported", self.script.len());
            return fail("script", problem, "leave some out");
        }
        let joints: Vec<String> = self.hand.joints.iter().map(|joint| joint.name.clone()).collect();
        let postures: Vec<String> = self.hand.postures.iter().map(|posture| posture.name.clone()).collect();
        let names = Names { joints: &joints, postures: &postures };
        let step = |(index, step): (usize, &super::file::StepFile)| {
            let key = |of: &str| item("script", index, of);
            let command = match order::command(&step.order, &names) {
                Some(Ok(command)) => command,
                Some(Err(error)) => return fail(key("do"), error, ""),
                None => {
                    let word = step.order.split_whitespace().next().unwrap_or("");
                    let known = order::WORDS.iter().map(|known| known.word);
                    return fail(key("do"), format!("`{word}` is not a command"), suggestion(word, known));
                }
            };
            let when = step.when.as_deref().map(|when| {
                let known = Notice::ALL.iter().find(|notice| notice.key() == when);
                known.copied().map_or_else(
                    || {
                        let all = Notice::ALL.iter().map(|notice| notice.key());
                        fail(
                            key("when"),
                            format!("`{when}` is nothing that a hand notices"),
                            suggestion(when, all),
                        )
                    },
                    Ok,
                )
            });
            within(&key("after_s"), step.after_s, 0.0, longest_s)?;
            within(&key("at_s"), step.at_s, 0.0, longest_s)?;
            within(&key("within_s"), step.within_s, 0.0, longest_s)?;
            Ok(Step {
                command,
                order: step.order.clone(),
                when: when.transpose()?,
                after_s: step.after_s,
                at_s: step.at_s,
                within_s: step.within_s,
            })
        };
        self.script.iter().enumerate().map(step).collect()
    }
}
