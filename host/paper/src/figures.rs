//! The counterparts of the paper's figures: the same quantities, units and grouping, with gains and times in the caption.

use super::earlier::Comparison;
use super::evidence::{Done, Evidence, EvidenceError};
use blindgrasp_model::Scene;
use blindgrasp_plots::run::{figure, force_panels, joint_panels, object_panels, residual_component_panels};
use blindgrasp_plots::{Along, Axis, Dash, Figure, Line, Panel};
use blindgrasp_sim::sample::Sample;
use blindgrasp_view::{Files, Report, Strip, colour};

/// Times at which the hand-arm is looked at, s.
const MOMENTS_S: [f64; 6] = [0.0, 0.5, 1.0, 2.0, 5.0, 20.0];
/// Times at which the experiments are looked at, s.
const EXPERIMENT_MOMENTS_S: [f64; 3] = [0.0, 0.2, 4.0];
/// Length of the simulation that Figs. 7 and 8 show, s.
const TRANSIENT_S: f64 = 20.0;
/// Length of the experiments that Figs. 12 and 13 show, s.
const EXPERIMENT_S: f64 = 2.0;
/// Speeds below are not told apart, rad/s.
const SLOWEST_RAD_S: f64 = 1e-5;

/// A figure.
pub struct Drawn {
    /// Its number in the paper, or `new` where the paper has none.
    pub number: &'static str,
    /// The name of its files, without the ending.
    pub file: &'static str,
    /// Its title.
    pub title: String,
    /// Gains, times, and what to see.
    pub caption: String,
    /// The drawing.
    pub drawing: Drawing,
}

/// A drawing.
pub enum Drawing {
    /// Lines over time.
    Chart(Figure),
    /// Pictures.
    Strip(Strip),
}

impl Drawn {
    /// The files of it.
    pub fn files(&self) -> Files {
        match &self.drawing {
            Drawing::Chart(figure) => figure.files(),
            Drawing::Strip(strip) => strip.files(),
        }
    }
}

/// Every figure, in the order of the paper.
///
/// # Errors
/// A run that a figure needs is not in the evidence.
pub fn all(evidence: &Evidence, comparison: &Comparison) -> Result<Vec<Drawn>, EvidenceError> {
    let arm = evidence.run("hand-arm")?;
    let (prism, cube) = (evidence.run("prism")?, evidence.run("cube")?);
    let mut drawn = vec![
        pictures("6", "fig-06", "The hand-arm and the object", arm, &MOMENTS_S),
        chart(
            "7",
            "fig-07",
            "Velocities of the hand-arm and the object",
            arm,
            TRANSIENT_S,
            |done, samples| {
                let mut panels = joint_panels(&done.scene.hand, &names(done), samples);
                panels.extend(object_panels(samples));
                panels
            },
        ),
        settling(evidence)?,
        chart("8", "fig-08", "Residuals of the closed loop (Eq. 38)", arm, TRANSIENT_S, |done, samples| {
            residual_component_panels(&done.scene.hand, samples)
        }),
    ];
    for (file, title, done) in [
        ("fig-12-prism", "Joint velocities, triangular prism", prism),
        ("fig-12-cube", "Joint velocities, cube", cube),
    ] {
        drawn.push(chart("12", file, title, done, EXPERIMENT_S, |done, samples| {
            joint_panels(&done.scene.hand, &names(done), samples)
        }));
    }
    for (file, pictured, title, done) in [
        ("fig-13-prism", "fig-11-prism", "triangular prism", prism),
        ("fig-13-cube", "fig-13-cube-pictures", "cube", cube),
    ] {
        let number = if pictured.starts_with("fig-11") { "11 and 13" } else { "13" };
        drawn.push(pictures(
            number,
            pictured,
            &format!("Contact forces, {title}"),
            done,
            &EXPERIMENT_MOMENTS_S,
        ));
        drawn.push(chart(
            "13",
            file,
            &format!("Normal and tangential forces, {title}"),
            done,
            EXPERIMENT_S,
            |done, samples| force_panels(&done.scene.hand, samples),
        ));
    }
    drawn.push(comparison.drawn());
    Ok(drawn)
}

fn names(done: &Done) -> Vec<String> {
    done.scene.joints.iter().map(|joint| joint.name.clone()).collect()
}

/// Lines over the first seconds of a run.
fn chart(
    number: &'static str,
    file: &'static str,
    title: &str,
    done: &Done,
    until_s: f64,
    panels: impl FnOnce(&Done, &[Sample]) -> Vec<Panel>,
) -> Drawn {
    let samples = until(&done.run.samples, until_s);
    Drawn {
        number,
        file,
        title: title.to_owned(),
        caption: format!("Run {}, {}. {}", done.name, span(done, samples), gains(&done.scene)),
        drawing: Drawing::Chart(figure(title.to_owned(), samples, panels(done, samples))),
    }
}

/// Pictures of a run.
fn pictures(number: &'static str, file: &'static str, title: &str, done: &Done, times_s: &[f64]) -> Drawn {
    let report = Report {
        title: &done.scene.name,
        hand: &done.scene.hand,
        capsules: &done.scene.file.hand.capsules(&done.scene.hand),
        joint_names: &names(done),
        object: &done.scene.object,
        samples: &done.run.samples,
    };
    let strip = Strip::new(&report, times_s);
    let times: Vec<String> = strip.times_s.iter().map(|t_s| format!("{t_s}")).collect();
    Drawn {
        number,
        file,
        title: title.to_owned(),
        caption: format!(
            "Run {}, at {} s. Arrows are the forces on the object. {}",
            done.name,
            times.join(", "),
            gains(&done.scene)
        ),
        drawing: Drawing::Strip(strip),
    }
}

/// The fastest joint over whole runs: what Fig. 7 does not show.
fn settling(evidence: &Evidence) -> Result<Drawn, EvidenceError> {
    let runs = ["hand-arm", "hand-arm-continuous", "hand-arm-consistent", "hand-arm-stiff"];
    let runs = runs.iter().map(|name| evidence.run(name)).collect::<Result<Vec<_>, _>>()?;
    let longest = runs.iter().map(|done| &done.run.samples).max_by_key(|samples| samples.len());
    let times: Vec<f64> = longest.into_iter().flatten().map(|sample| sample.t_s).collect();
    let fastest = |done: &Done| -> Vec<f64> {
        let speeds = done.run.samples.iter().map(|sample| {
            let fastest = sample.speeds_rad_s.iter().fold(0.0_f64, |most, speed| most.max(speed.abs()));
            fastest.max(SLOWEST_RAD_S)
        });
        speeds.chain(std::iter::repeat(f64::NAN)).take(times.len()).collect()
    };
    let lines: Vec<Line> = runs
        .iter()
        .enumerate()
        .map(|(k, done)| Line {
            name: done.name.clone(),
            colour: colour(k),
            dash: Dash::Solid,
            values: fastest(done),
        })
        .collect();
    let panel = Panel {
        heading: "whole runs".to_owned(),
        quantity: "fastest joint",
        unit: "rad/s",
        axis: Axis::Decades(Some(-3.0..2.0)),
        lines,
    };
    let ends: Vec<String> = runs
        .iter()
        .map(|done| match done.summary().lost_at_s {
            Some(t_s) => format!("{}: lost at {t_s:.1} s", done.name),
            None => format!("{}: held for {:.0} s", done.name, done.summary().duration_s),
        })
        .collect();
    Ok(Drawn {
        number: "7, continued",
        file: "fig-07-whole",
        title: "The fastest joint of the hand-arm, to the end".to_owned(),
        caption: format!(
            "The paper's Fig. 7 ends before this does. Speeds fall by three orders of magnitude; then the fingertips creep against \
             their torsional viscosity, until the grasp snaps through. {}. A line ends where its grasp does.",
            ends.join("; ")
        ),
        drawing: Drawing::Chart(Figure {
            title: "The fastest joint of the hand-arm, to the end".to_owned(),
            along: Along::Times(times),
            panels: vec![panel],
        }),
    })
}

fn until(samples: &[Sample], until_s: f64) -> &[Sample] {
    &samples[..samples.partition_point(|sample| sample.t_s <= until_s)]
}

/// Returns the part of a run that is shown, in words.
fn span(done: &Done, samples: &[Sample]) -> String {
    let end = samples.last().map_or(0.0, |sample| sample.t_s);
    let length = done.summary().duration_s;
    if end + 0.1 < length {
        format!("its first {end:.0} s of {length:.0}")
    } else {
        format!("all of its {end:.0} s")
    }
}

/// The gains of a scene, in words.
pub fn gains(scene: &Scene) -> String {
    let control = &scene.control;
    let damping = scene.joints.iter().map(|joint| joint.damping_gain_nm_s_rad);
    let (least, most) =
        damping.fold((f64::INFINITY, 0.0_f64), |(least, most), gain| (least.min(gain), most.max(gain)));
    let friction = scene.joints.iter().fold(0.0_f64, |most, joint| most.max(joint.friction.coulomb_nm));
    let mut words = format!(
        "f_d = {} N, K_st = {} N m, C from {least} to {most} N m s/rad; law every {} ms",
        control.force_n(),
        control.attitude_stiffness_nm(),
        1e3 * control.period_s
    );
    match scene.actuators.output_delay_ticks {
        0.0 => {}
        1.0 => words += ", a tick late",
        ticks => words += &format!(", {ticks} ticks late"),
    }
    if control.soft_start_s > 0.0 {
        words += &format!(", force rising over {} s", control.soft_start_s);
    }
    words += &if friction > 0.0 {
        format!("; joint friction {friction} N m.")
    } else {
        "; no joint friction.".to_owned()
    };
    words
}
