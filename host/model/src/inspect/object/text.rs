//! A check for people: numbers, a table of the faces, and the findings.

use super::ObjectCheck;
use crate::one_line;
use std::fmt::Write as _;

/// The faces that are shown: the widest, where there are many.
const SHOWN: usize = 40;

/// All of it.
pub(super) fn describe(check: &ObjectCheck) -> String {
    let mut text = format!("{}  {}\n", check.name, check.description).trim_end().to_owned() + "\n";
    body(check, &mut text);
    faces(check, &mut text);
    text += "\n";
    for line in check.findings.lines() {
        text = text + &line + "\n";
    }
    let _ = writeln!(text, "{}", check.findings.summary());
    // Names come from files, and may contain what would steer a terminal.
    text.lines().map(|line| one_line(line) + "\n").collect()
}

fn body(check: &ObjectCheck, text: &mut String) {
    let Some(body) = &check.body else { return };
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<22}{value}");
    };
    let row =
        |values: &[f64], scale: f64| values.iter().map(|v| figures(v * scale)).collect::<Vec<_>>().join("  ");
    line("surface", "closed, one part, outside is outside".into());
    line("convex", if body.convex { "yes" } else { "no" }.into());
    line(
        "faces",
        format!("{} of {} triangles, {} vertices", check.faces.len(), body.triangles, body.vertices),
    );
    line("extents", format!("{} mm", row(&body.extents_m, 1e3)));
    line("volume", format!("{} cm^3", figures(body.volume_m3 * 1e6)));
    line("surface area", format!("{} cm^2", figures(body.surface_m2 * 1e4)));
    match body.mass_kg {
        Some(mass) => {
            line("mass", format!("{} g ({} kg/m^3)", figures(mass * 1e3), figures(mass / body.volume_m3)));
            line("principal moments", format!("{} kg m^2", row(&body.principal_moments_per_kg_m2, mass)));
        }
        None => {
            line("mass", "not given".into());
            line(
                "principal moments",
                format!("{} m^2, for each kilogram", row(&body.principal_moments_per_kg_m2, 1.0)),
            );
        }
    }
    for (k, axis) in body.principal_axes.iter().enumerate() {
        line(if k == 0 { "  about the axes" } else { "" }, row(axis, 1.0));
    }
    if let Some(centre) = &body.centre_m {
        line("centre of mass", format!("{} mm, in the mesh's coordinates", row(centre, 1e3)));
    }
    line("shortest edge", format!("{} mm", figures(body.shortest_edge_m * 1e3)));
    line("thinnest wall", format!("{} mm", figures(body.thinnest_wall_m * 1e3)));
}

fn faces(check: &ObjectCheck, text: &mut String) {
    if check.faces.is_empty() {
        return;
    }
    let mut shown: Vec<&super::FaceFacts> = check.faces.iter().collect();
    if shown.len() > SHOWN {
        shown.sort_by(|a, b| b.widest_circle_m.total_cmp(&a.widest_circle_m));
        shown.truncate(SHOWN);
        let _ = writeln!(text, "\nthe {SHOWN} widest faces; --json has all");
    } else {
        text.push('\n');
    }
    let _ = writeln!(
        text,
        "{:>5}  {:^24}  {:>12}  {:>12}  {:>13}  {:>7}  {:>5}",
        "face", "outward normal", "distance, mm", "area, cm^2", "circle, mm", "corners", "holes"
    );
    for face in shown {
        let [x, y, z] = face.normal.map(|v| format!("{:.3}", v + 0.0).replace("-0.000", "0.000"));
        let _ = writeln!(
            text,
            "{:>5}  {x:>8}{y:>8}{z:>8}  {:>12}  {:>12}  {:>13}  {:>7}  {:>5}{}",
            face.number,
            figures(face.distance_m * 1e3),
            figures(face.area_m2 * 1e4),
            figures(face.widest_circle_m * 1e3),
            face.corners,
            face.holes,
            if face.convex { "" } else { "  notched" }
        );
    }
    text.push_str(
        "distance: of the face's plane from the centre of mass; circle: radius of the widest that fits\n",
    );
}

/// Four figures.
pub(super) fn figures(value: f64) -> String {
    let size = value.abs();
    if size < 5e-10 {
        return "0".to_owned();
    }
    if !(1e-3..1e6).contains(&size) {
        return format!("{value:.3e}");
    }
    let digits = (3 - size.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
