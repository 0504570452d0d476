//! Samples for pictures of a run, which need a few thousand of them, however long it was.

use crate::sample::Sample;

/// Most samples that are kept: a run of a minute, whole.
const MOST: usize = 1 << 16;

/// Every sample of a run, or one in two, four, ... of a long one; and its last.
#[derive(Clone, Debug)]
pub struct Thinned {
    samples: Vec<Sample>,
    /// Samples from one that is kept to the next.
    stride: u64,
    seen: u64,
    /// The newest, unless it is kept.
    last: Option<Sample>,
}

impl Default for Thinned {
    fn default() -> Self {
        Self { samples: Vec::new(), stride: 1, seen: 0, last: None }
    }
}

impl Thinned {
    /// Takes the next sample.
    pub fn see(&mut self, sample: &Sample) {
        if self.seen.is_multiple_of(self.stride) {
            if self.samples.len() == MOST {
                self.stride *= 2;
                let mut is_kept = false;
                self.samples.retain(|_| {
                    is_kept = !is_kept;
                    is_kept
                });
            }
            self.samples.push(sample.clone());
            self.last = None;
        } else {
            self.last = Some(sample.clone());
        }
        self.seen += 1;
    }

    /// Returns the samples that are kept, in the order of time.
    pub fn finish(mut self) -> Vec<Sample> {
        self.samples.extend(self.last);
        self.samples
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Simulation;
    use blindgrasp_model::Scene;

    #[test]
    fn a_long_run_keeps_one_in_so_many_and_its_ends() {
        let scene = Scene::load("prism", &["duration_s=0.001".to_owned()]).unwrap();
        let first = Simulation::new(&scene).unwrap().run().samples.remove(0);
        for (count, stride) in [(1, 1), (MOST, 1), (MOST + 1, 2), (2 * MOST, 2), (5 * MOST + 7, 8)] {
            let mut thinned = Thinned::default();
            for tick in 0..count {
                thinned.see(&Sample { t_s: tick as f64, ..first.clone() });
            }
            let times: Vec<f64> = thinned.finish().iter().map(|sample| sample.t_s).collect();
            let mut expected: Vec<f64> = (0..count).step_by(stride).map(|tick| tick as f64).collect();
            if !(count - 1).is_multiple_of(stride) {
                expected.push((count - 1) as f64);
            }
            assert!(times == expected, "{count}");
        }
    }
}
