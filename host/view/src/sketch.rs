//! Line drawings as SVG: a hand at its nominal posture, an object from two sides.
//!
//! Everything is drawn from far to near (the painter's algorithm). A hand is made of balls and of rods that are cut into short
//! pieces, which are in order by their depth; the plate of a palm has the pieces behind its plane drawn before it, those in
//! front after it. Of an object, the faces that look at the viewer are ordered by which lies behind the plane of which.
//! Words, numbers and axes are on top. The same hand or object gives the same bytes.

mod hand;
mod object;
mod svg;
#[cfg(test)]
mod tests;

pub use hand::hand_svg;
pub use object::object_svg;

use super::camera::Camera;
use super::palette::{BLUE, FAINT_INK, GREEN, Rgb, VERMILLION};
use super::picture::round_below;
use super::units;
use nalgebra::Vector3;
use svg::{Anchor, Svg};

/// Width of a picture, pixels.
const WIDTH: f64 = 800.0;
/// Size of the square for a view.
const VIEW: f64 = 380.0;
/// Space at the edges.
const MARGIN: f64 = 16.0;
/// The top of the views, under the title.
const TOP: f64 = 62.0;

/// The square of a view: its upper left and lower right corner, with room for words around what is drawn.
fn frame(index: usize) -> ([f64; 2], [f64; 2]) {
    let left = MARGIN + index as f64 * (WIDTH - 2.0 * MARGIN - VIEW);
    ([left + 34.0, TOP + 26.0], [left + VIEW - 34.0, TOP + VIEW - 46.0])
}

/// Title, and a line under it.
fn title(svg: &mut Svg, name: &str, about: &str) {
    svg.text([MARGIN, 30.0], name, 18.0, super::palette::INK, Anchor::Start);
    svg.text([MARGIN, 50.0], about, 12.0, FAINT_INK, Anchor::Start);
}

/// A round length at the lower left of a view, drawn to scale.
fn scale_bar(svg: &mut Svg, index: usize, camera: &Camera) {
    let Some(value) = round_below(110.0 / camera.pixels_per_m) else { return };
    let (left, y) = (MARGIN + index as f64 * (WIDTH - 2.0 * MARGIN - VIEW) + 4.0, TOP + VIEW - 12.0);
    let right = left + value * camera.pixels_per_m;
    svg.line(&[[left, y - 4.0], [left, y], [right, y], [right, y - 4.0]], 1.5, FAINT_INK);
    let (prefix, factor) = units::prefix(value);
    // Multiples of 1, 2 and 5 print exactly once the prefix has brought them near one.
    let label = format!("{} {prefix}m", (value * factor * 1e6).round() / 1e6);
    svg.text([right + 8.0, y + 1.0], &label, 12.0, FAINT_INK, Anchor::Start);
}

/// The axes of a frame at a point, each as long as given, m.
fn frame_axes(svg: &mut Svg, camera: &Camera, origin: &Vector3<f64>, lengths_m: [f64; 3]) {
    let axes: [(&str, Rgb, Vector3<f64>); 3] = [
        ("x", VERMILLION, Vector3::x() * lengths_m[0]),
        ("y", GREEN, Vector3::y() * lengths_m[1]),
        ("z", BLUE, Vector3::z() * lengths_m[2]),
    ];
    for (name, colour, axis) in axes {
        let (from, to) = (flat(camera, origin), flat(camera, &(origin + axis)));
        let end = svg.arrow(from, to, 1.6, colour);
        svg.text([end[0], end[1] + 4.0], name, 13.0, colour, Anchor::Middle);
    }
}

/// Returns the place of a point in the picture, pixels.
fn flat(camera: &Camera, point: &Vector3<f64>) -> [f64; 2] {
    let [x, y, _] = camera.project(point);
    [f64::from(x), f64::from(y)]
}
