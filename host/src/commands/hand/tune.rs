//! `blindgrasp hand tune`: how stable a hand's sampled loop is, and gains with which it is more so.

use super::super::Outcome;
use crate::terminal;
use anyhow::Context;
use blindgrasp::model::{HandFile, HandModel, Scene};
use blindgrasp::sim::tune::{Margins, Mode, SampledLoop, Tuned};
use clap::Args;
use serde::Serialize;
use std::ffi::OsString;
use std::fmt::Write as _;

/// Delay margin that is asked for unless the user says otherwise, ticks.
pub(super) const MARGIN_TICKS: f64 = 0.5;

/// Show the margins of a hand's gains, and gains with more
///
/// The sampled loop about a grasp is linearised: encoders, estimator, delay, motors that hold a torque for a tick, hand and object. The
/// grasp is the worst case, an object of 2 g between the fingertips in the nominal posture and no joint friction, or that of a scene.
/// Nothing is written: the keys to put into the hand's file are printed.
///
/// Exit code 0: shown; 1: no gains make the loop stable; 2: the file can't be read, or bad usage.
#[derive(Args)]
pub(crate) struct Arguments {
    /// A built-in hand or the path of a hand's file
    hand: OsString,
    /// The grasp of this scene, with its controller, in place of the nominal one: a built-in scene or the path of its file
    #[arg(long, value_name = "SCENE")]
    scene: Option<OsString>,
    /// Leave the rotors' inertia out
    #[arg(long, conflicts_with = "scene")]
    no_rotors: bool,
    /// Delay that the loop is to bear additionally, ticks; the lowest bandwidth of the estimator that gives it is taken
    #[arg(long, value_name = "TICKS", default_value_t = MARGIN_TICKS, value_parser = margin)]
    margin: f64,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
}

fn margin(text: &str) -> Result<f64, String> {
    let ticks = text.parse().ok().filter(|ticks| (0.0..=20.0).contains(ticks));
    ticks.ok_or_else(|| "has to be a number from 0 to 20".into())
}

/// All that is shown.
#[derive(Serialize)]
struct Report {
    hand: String,
    /// The scene whose grasp it is; none for the nominal one.
    scene: Option<String>,
    joints: Vec<String>,
    bandwidth_hz: Option<f64>,
    margins: Margins,
    wanted_ticks: f64,
    tuned: Option<Tuned>,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let wanted_ticks = arguments.margin;
    let report = match &arguments.scene {
        None => {
            let (model, file) = HandModel::load_with_file(&arguments.hand)?;
            let nominal = |firmness| SampledLoop::nominal(&model, &file, !arguments.no_rotors, firmness);
            report(model.name.clone(), None, model.joint_names.clone(), wanted_ticks, nominal)?
        }
        Some(scene) => {
            let (_, _, warnings) = HandFile::load_checked(&arguments.hand)?;
            for warning in warnings {
                eprintln!("blindgrasp: warning: {warning}");
            }
            let hand = arguments.hand.to_str().context("the name of the hand's file is no UTF-8 text")?;
            let scene = Scene::load(scene, &[format!("hand={}", toml::Value::String(hand.into()))])?;
            let names = scene.joints.iter().map(|joint| joint.name.clone()).collect();
            let about = |firmness| SampledLoop::of_scene(&scene, firmness);
            report(scene.file.hand.name.clone(), Some(scene.name.clone()), names, wanted_ticks, about)?
        }
    };
    let text = if arguments.json { serde_json::to_string(&report)? + "\n" } else { report.text() };
    terminal::print(&text).context("cannot print the margins")?;
    Ok(if report.tuned.is_some() { Outcome::Shown } else { Outcome::Failed })
}

fn report<E: std::error::Error + Send + Sync + 'static>(
    hand: String,
    scene: Option<String>,
    joints: Vec<String>,
    wanted_ticks: f64,
    about: impl Fn(f64) -> Result<SampledLoop, E>,
) -> anyhow::Result<Report> {
    let present = about(1.0)?;
    let firmer = |firmness| about(firmness).ok();
    Ok(Report {
        hand,
        scene,
        joints,
        bandwidth_hz: present.bandwidth_hz,
        margins: present.margins(&firmer),
        wanted_ticks,
        tuned: present.tuned(wanted_ticks, &firmer),
    })
}

impl Report {
    fn text(&self) -> String {
        let grasp = match &self.scene {
            None => "2 g between the fingertips, nominal posture".to_owned(),
            Some(scene) => format!("the grasp of scene {scene}"),
        };
        let mut text = format!("hand {}: {grasp}, no joint friction\n\n", self.hand);
        let tuned = self.tuned.as_ref();
        let mut line = |what: &str, words: &dyn Fn(&Margins) -> String| {
            let after = tuned.map_or("-".into(), |tuned| words(&tuned.margins));
            let _ = writeln!(text, "{what:<26}{:<20}{after}", words(&self.margins));
        };
        line("", &|margins| {
            if std::ptr::eq(margins, &self.margins) { "as it is".into() } else { "tuned".into() }
        });
        line("estimator bandwidth, Hz", &|margins| {
            let is_tuned = tuned.filter(|tuned| std::ptr::eq(margins, &tuned.margins));
            let bandwidth_hz = is_tuned.map_or(self.bandwidth_hz, |tuned| tuned.bandwidth_hz);
            bandwidth_hz.map_or("no estimator".into(), |hz| format!("{hz}"))
        });
        line("spectral radius", &|margins| format!("{:.5}", margins.spectral_radius));
        line("delay margin, ticks", &|margins| match margins.delay_margin_ticks {
            Some(ticks) if ticks < 0.0 => format!("{ticks:.2} (unstable)"),
            Some(ticks) => format!("{ticks:.2}"),
            None => "unstable at any".into(),
        });
        line("gain margin, damping", &|margins| {
            margins.damping_margin.map_or("-".into(), |[least, most]| format!("x {least:.2} to x {most:.2}"))
        });
        line("gain margin, force", &|margins| {
            margins.force_margin.map_or("-".into(), |most| format!("to x {most:.2}"))
        });
        line("least damped mode", &|margins| mode(margins.least_damped));
        line("slowest mode", &|margins| mode(margins.slowest));
        match tuned {
            Some(tuned) => self.write_keys(&mut text, tuned),
            None => {
                text += "\nNo damping makes it stable: less force, a shorter period, or less delay may.\n"
            }
        }
        text
    }

    /// The keys for the hand's file.
    fn write_keys(&self, text: &mut String, tuned: &Tuned) {
        let is_less = tuned.margins.delay_margin_ticks.is_none_or(|ticks| ticks < self.wanted_ticks);
        if is_less {
            let _ = write!(
                text,
                "\nNo gains have a delay margin of {} ticks; these have the largest.\n",
                self.wanted_ticks
            );
        }
        let _ = write!(
            text,
            "\nTuned: a joint alone would slow down at {:.0} 1/s. In the hand's file:\n\n",
            tuned.damping_rate_1_s
        );
        text.push_str("[control]\n");
        if let Some(bandwidth_hz) = tuned.bandwidth_hz {
            let _ = writeln!(text, "estimator_bandwidth_hz = {bandwidth_hz:?}");
        }
        text.push_str("damping_scale = 1.0\n\n");
        for (name, gain) in self.joints.iter().zip(&tuned.damping_nm_s_rad) {
            let _ = writeln!(text, "damping_gain_nm_s_rad = {gain:.2e}    # [[joint]] {name}");
        }
    }
}

fn mode(mode: Option<Mode>) -> String {
    mode.map_or("-".into(), |Mode { frequency_hz, damping_ratio, rate_1_s }| match frequency_hz {
        0.0 => format!("{rate_1_s:.2} 1/s"),
        _ => format!("{frequency_hz:.1} Hz, {damping_ratio:.3}"),
    })
}
