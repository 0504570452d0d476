//! The figures of a run: joint velocities, object velocities, contact forces, residuals.

use super::figure::{Along, Axis, Figure, Line, Panel};
use super::pens::Dash;
use super::series;
use blindgrasp_body::Hand;
use blindgrasp_sim::sample::{ContactSample, Sample};
use blindgrasp_view::palette::{BLACK, BLUE, ORANGE, VERMILLION};
use nalgebra::Vector3;

/// One figure of a run and the name of its files, without the ending.
pub(super) struct Plot {
    pub(super) name: &'static str,
    pub(super) figure: Figure,
}

/// The four figures of a run.
pub(super) fn all(title: &str, hand: &Hand, joint_names: &[String], samples: &[Sample]) -> [Plot; 4] {
    let figure = |what: &str, panels| {
        let title = if title.is_empty() { what.to_owned() } else { format!("{title}: {what}") };
        figure(title, samples, panels)
    };
    [
        Plot {
            name: "joint-velocities",
            figure: figure("joint velocities", joint_panels(hand, joint_names, samples)),
        },
        Plot { name: "object-velocities", figure: figure("velocity of the object", object_panels(samples)) },
        Plot { name: "contact-forces", figure: figure("contact forces", force_panels(hand, samples)) },
        Plot { name: "residuals", figure: figure("residuals of Eq. 38", residual_panels(hand, samples)) },
    ]
}

/// A figure of some panels, over the times of the samples.
pub fn figure(title: String, samples: &[Sample], panels: Vec<Panel>) -> Figure {
    Figure { title, along: Along::Times(samples.iter().map(|sample| sample.t_s).collect()), panels }
}

/// A panel for the trunk, if there is one, and one for each finger. Fingers share their scale.
pub fn joint_panels(hand: &Hand, names: &[String], samples: &[Sample]) -> Vec<Panel> {
    let fingers_moved = |joint| (0..hand.fingertip_count()).filter(|&i| hand.moves(joint, i)).count();
    let own = |finger| {
        let joints = (0..hand.joint_count()).filter(move |&k| hand.moves(k, finger) && fingers_moved(k) == 1);
        (format!("finger {}", finger + 1), joints.collect::<Vec<_>>())
    };
    let shared: Vec<usize> = (0..hand.joint_count()).filter(|&k| fingers_moved(k) > 1).collect();
    let fingers: Vec<_> = (0..hand.fingertip_count()).map(own).collect();
    let range = |joints: &[usize]| {
        series::linear_range(
            samples.iter().flat_map(|s| joints.iter().filter_map(|&k| s.speeds_rad_s.get(k).copied())),
        )
    };
    let finger_range = range(&fingers.iter().flat_map(|(_, joints)| joints.clone()).collect::<Vec<_>>());
    let shared_range = range(&shared);
    let panel = |(heading, joints): (String, Vec<usize>), range| Panel {
        heading,
        quantity: "joint velocity",
        unit: "rad/s",
        axis: Axis::Linear(range),
        lines: joints
            .into_iter()
            .enumerate()
            .map(|(order, joint)| {
                let name = names.get(joint).cloned().unwrap_or_else(|| format!("joint {}", joint + 1));
                let speed = |s: &Sample| s.speeds_rad_s.get(joint).copied().unwrap_or(f64::NAN);
                Line::nth(order, name, samples.iter().map(speed).collect())
            })
            .collect(),
    };
    let trunk = (!shared.is_empty()).then(|| panel(("trunk".to_owned(), shared.clone()), shared_range));
    let fingers = fingers.into_iter().filter(|(_, joints)| !joints.is_empty());
    trunk.into_iter().chain(fingers.map(|finger| panel(finger, finger_range.clone()))).collect()
}

/// Velocity and angular velocity of the object.
pub fn object_panels(samples: &[Sample]) -> Vec<Panel> {
    let panel = |heading: &str, quantity, unit, of: fn(&Sample) -> &Vector3<f64>| Panel {
        heading: heading.to_owned(),
        quantity,
        unit,
        axis: Axis::Linear(series::linear_range(samples.iter().flat_map(|s| of(s).iter().copied()))),
        lines: ["x", "y", "z"]
            .into_iter()
            .enumerate()
            .map(|(k, name)| Line::nth(k, name, samples.iter().map(|s| of(s)[k]).collect()))
            .collect(),
    };
    vec![
        panel("centre of mass", "velocity", "m/s", |s| &s.velocity_m_s),
        panel("rotation", "angular velocity", "rad/s", |s| &s.spin_rad_s),
    ]
}

/// A signal of one finger's contact.
fn of_contact(samples: &[Sample], finger: usize, value: impl Fn(&ContactSample) -> f64) -> Vec<f64> {
    samples.iter().map(|s| s.contacts.get(finger).map_or(f64::NAN, &value)).collect()
}

/// One panel for each finger, because the fingers of a symmetrical grasp press equally.
pub fn force_panels(hand: &Hand, samples: &[Sample]) -> Vec<Panel> {
    let all = samples.iter().flat_map(|s| &s.contacts);
    let range = series::linear_range(
        all.flat_map(|c| [c.normal_force_n, c.desired_normal_force_n, c.tangential_force_n()]),
    );
    let has_friction = samples.iter().flat_map(|s| &s.contacts).any(|c| c.friction.is_some());
    let line = |name: &str, colour, dash, values| Line { name: name.to_owned(), colour, dash, values };
    (0..hand.fingertip_count())
        .map(|finger| Panel {
            heading: format!("finger {}", finger + 1),
            quantity: "force",
            unit: "N",
            axis: Axis::Linear(range.clone()),
            lines: [
                line("normal", BLUE, Dash::Solid, of_contact(samples, finger, |c| c.normal_force_n)),
                line(
                    "tangential",
                    VERMILLION,
                    Dash::Solid,
                    of_contact(samples, finger, ContactSample::tangential_force_n),
                ),
                line(
                    "desired (Eq. 57)",
                    BLACK,
                    Dash::Broken(7.0, 5.0),
                    of_contact(samples, finger, |c| c.desired_normal_force_n),
                ),
            ]
            .into_iter()
            .chain(has_friction.then(|| {
                let limit_n = |c: &ContactSample| c.friction.map_or(f64::NAN, |friction| friction.limit_n);
                line(
                    "limit of friction",
                    ORANGE,
                    Dash::Broken(2.0, 3.0),
                    of_contact(samples, finger, limit_n),
                )
            }))
            .collect(),
        })
        .collect()
}

/// Lengths of the residuals over a logarithmic axis: how fast they vanish is what they are looked at for.
fn residual_panels(hand: &Hand, samples: &[Sample]) -> Vec<Panel> {
    let panel = |heading: &str, quantity, unit, of: fn(&ContactSample) -> f64| Panel {
        heading: heading.to_owned(),
        quantity,
        unit,
        axis: Axis::Decades(series::decades(samples.iter().flat_map(|s| s.contacts.iter().map(of)))),
        lines: (0..hand.fingertip_count())
            .map(|finger| {
                Line::nth(finger, format!("finger {}", finger + 1), of_contact(samples, finger, of))
            })
            .collect(),
    };
    vec![
        panel("|Δλ₁|", "force residual", "N", |c| c.force_residual_n.norm()),
        panel("|Δλ₂|", "moment residual", "N m", |c| c.moment_residual_nm.norm()),
    ]
}

/// The components of the residuals in the contact frames, a panel for each finger: first those of the forces `Delta
/// lambda_i1`, then those of the moments `Delta lambda_i2`. Panels of a kind share their scale.
pub fn residual_component_panels(hand: &Hand, samples: &[Sample]) -> Vec<Panel> {
    let kind = |heading: &str, quantity, unit, of: fn(&ContactSample) -> &Vector3<f64>| {
        let all = samples.iter().flat_map(|s| s.contacts.iter().flat_map(|c| of(c).iter().copied()));
        let range = series::linear_range(all);
        let panels = (0..hand.fingertip_count()).map(|finger| Panel {
            heading: format!("{heading}, finger {}", finger + 1),
            quantity,
            unit,
            axis: Axis::Linear(range.clone()),
            lines: ["X, along the face", "Y, normal", "Z, along the face"]
                .into_iter()
                .enumerate()
                .map(|(k, name)| Line::nth(k, name, of_contact(samples, finger, |c| of(c)[k])))
                .collect(),
        });
        panels.collect::<Vec<_>>()
    };
    let mut panels = kind("Δλ₁", "force residual", "N", |c| &c.force_residual_n);
    panels.extend(kind("Δλ₂", "moment residual", "N m", |c| &c.moment_residual_nm));
    panels
}
