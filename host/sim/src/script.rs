//! The script of a scene while it runs: which step is next, and what it waits for.

use blindgrasp_model::Step;
use blindgrasp_shared::command::{Command, Refusal};
use blindgrasp_shared::cycle::Noticed;

/// A script under way.
#[derive(Clone, Debug)]
pub(crate) struct Script {
    steps: Vec<Step>,
    /// The step that is to be done next.
    next: usize,
    /// Time of the step before, s.
    since_s: f64,
    /// Time at which what it waits for was noticed, s.
    seen_s: Option<f64>,
    /// The reason for which it ended before its last step.
    ended: Option<String>,
}

impl Script {
    /// At its beginning.
    pub(crate) fn new(steps: &[Step]) -> Self {
        Self { steps: steps.to_vec(), next: 0, since_s: 0.0, seen_s: None, ended: None }
    }

    /// Returns the command that is due at a time, s.
    pub(crate) fn due(&mut self, t_s: f64) -> Option<Command> {
        if self.ended.is_some() {
            return None;
        }
        let step = self.steps.get(self.next)?;
        let from_s = match (step.when, self.seen_s) {
            (None, _) => self.since_s,
            (Some(_), Some(seen_s)) => seen_s,
            (Some(notice), None) => {
                if t_s > self.since_s + step.within_s {
                    let (number, order, within_s) = (self.next + 1, &step.order, step.within_s);
                    let key = notice.key();
                    self.ended = Some(format!(
                        "step {number} (`{order}`) has waited {within_s} s for `{key}` in vain"
                    ));
                }
                return None;
            }
        };
        // Half a microsecond: times are sums of ticks.
        if t_s + 5e-7 < (from_s + step.after_s).max(step.at_s) {
            return None;
        }
        let command = step.command;
        (self.next, self.since_s, self.seen_s) = (self.next + 1, t_s, None);
        Some(command)
    }

    /// Sees what a tick has told.
    pub(crate) fn see(&mut self, t_s: f64, noticed: Option<Noticed>, refused: Option<Refusal>) {
        if let (Some(refusal), Some(step)) =
            (refused, self.next.checked_sub(1).and_then(|k| self.steps.get(k)))
        {
            self.ended =
                Some(format!("step {} (`{}`) was refused: {}", self.next, step.order, refusal.words()));
        }
        if let (Some(noticed), Some(step)) = (noticed, self.steps.get(self.next))
            && step.when == Some(noticed.notice)
            && self.seen_s.is_none()
        {
            self.seen_s = Some(t_s);
        }
    }

    /// Returns the reason for which it ended before its last step, or what it still waited for at the end of the run.
    pub(crate) fn shortfall(&self) -> Option<String> {
        let left = || {
            let step = self.steps.get(self.next)?;
            Some(format!("the run was over before step {} (`{}`)", self.next + 1, step.order))
        };
        self.ended.clone().or_else(left)
    }
}
