//! An object: its faces by number, from two opposite sides.

use super::super::camera::{Camera, Extent, View};
use super::super::palette::{INK, Rgb};
use super::super::text::shortened;
use super::svg::{Anchor, Svg, hex, toward};
use super::{TOP, VIEW, WIDTH, flat, frame, frame_axes, scale_bar, title};
use blindgrasp_body::polyhedron::{Face, Polyhedron};
use nalgebra::Vector3;

const FACE: Rgb = [150, 186, 214];
const EDGE: Rgb = [44, 58, 76];
/// From where: about z from x, and above, degrees.
const VIEW_DEG: [f64; 2] = [38.0, 24.0];
/// Beyond so many faces, which one is in front of which is told by their middles alone.
const MOST_COMPARED: usize = 800;

/// An object from the front and from the back, in parallel projection, 800 pixels wide: the faces that show with their
/// numbers, the axes of the object frame from its centre of mass, a scale bar, and the extents along the axes.
pub fn object_svg(object: &Polyhedron, name: &str) -> String {
    let mut svg = Svg::default();
    let extents = extents_m(object);
    let [x, y, z] = extents.map(|v| v * 1e3);
    let about = format!(
        "{} faces; {x:.1} x {y:.1} x {z:.1} mm along x, y and z; axes from the centre of mass",
        object.faces.len()
    );
    title(&mut svg, &shortened(name, 70), &about);
    let [azimuth, elevation] = VIEW_DEG;
    let views = [View::towards(azimuth, elevation), View::towards(azimuth + 180.0, -elevation)];
    for (index, view) in views.into_iter().enumerate() {
        draw_view(&mut svg, index, view, object, extents);
    }
    svg.finish(WIDTH, TOP + VIEW + 12.0)
}

/// From corner to corner along the axes, m.
fn extents_m(object: &Polyhedron) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let along = object.vertices_m.iter().map(|vertex| vertex[k]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    })
}

fn draw_view(svg: &mut Svg, index: usize, view: View, object: &Polyhedron, extents: [f64; 3]) {
    // The axes stick out of the object.
    let reach = extents.map(|extent| 0.5 * extent).into_iter().fold(0.0, f64::max);
    let lengths = [0, 1, 2].map(|k| {
        let most = object.vertices_m.iter().map(|vertex| vertex[k]).fold(0.0, f64::max);
        most + 0.35 * reach
    });
    let ends = [Vector3::x() * lengths[0], Vector3::y() * lengths[1], Vector3::z() * lengths[2]];
    let (from, to) = frame(index);
    let points = object.vertices_m.iter().chain(&ends).map(|p| view.flat(p));
    let camera = Camera::fitted(view, &Extent::around(points), from, to);
    let order = far_to_near(object, &view);
    for &face in &order {
        let outlines = outlines(object, &object.faces[face], &camera);
        svg.shape(&outlines, &hex(lit(&object.faces[face].normal, &view)), EDGE, 1.1);
    }
    frame_axes(svg, &camera, &Vector3::zeros(), lengths);
    for (at, &face) in order.iter().enumerate() {
        let centre = object.face_centre_m(face);
        let place = flat(&camera, &centre);
        // Not where a nearer face covers it.
        let covers = |&other: &usize| {
            let nearer = object.faces[other].normal.dot(&centre) < object.faces[other].distance_m;
            nearer && contains(&outlines(object, &object.faces[other], &camera), place)
        };
        if order[at + 1..].iter().any(covers) {
            continue;
        }
        let size = room(&outlines(object, &object.faces[face], &camera)).clamp(7.0, 15.0);
        svg.text([place[0], place[1] + 0.36 * size], &face.to_string(), size, INK, Anchor::Middle);
    }
    scale_bar(svg, index, &camera);
    let words = if index == 0 { "front" } else { "back" };
    svg.text([from[0] - 30.0, TOP + 16.0], words, 12.0, super::FAINT_INK, Anchor::Start);
}

/// The outlines of a face in the picture.
fn outlines(object: &Polyhedron, face: &Face, camera: &Camera) -> Vec<Vec<[f64; 2]>> {
    face.outlines()
        .map(|corners| corners.iter().map(|&k| flat(camera, &object.vertices_m[k])).collect())
        .collect()
}

/// The faces that look at the viewer, so that none comes before one that it covers: one that lies behind another's plane is
/// drawn first. Faces that are neither before nor behind each other, as in a ring, are in the order of their middles.
fn far_to_near(object: &Polyhedron, view: &View) -> Vec<usize> {
    let depth = |face: usize| view.back.dot(&object.face_centre_m(face));
    let mut shown: Vec<usize> =
        (0..object.faces.len()).filter(|&face| object.faces[face].normal.dot(&view.back) > 1e-9).collect();
    shown.sort_by(|&a, &b| depth(a).total_cmp(&depth(b)));
    if shown.len() > MOST_COMPARED {
        return shown;
    }
    let slack = 1e-9 * object.radius_m();
    // Heights of a face's corners over another's plane, from the least to the most.
    let heights = |of: usize, over: usize| {
        let plane = &object.faces[over];
        let heights = object.faces[of]
            .corners
            .iter()
            .map(|&k| plane.normal.dot(&object.vertices_m[k]) - plane.distance_m);
        (heights.clone().fold(f64::INFINITY, f64::min), heights.fold(f64::NEG_INFINITY, f64::max))
    };
    // All of `a` behind the plane of `b`, or all of `b` in front of that of `a`: `a` can't cover `b`.
    let may_cover = |a: usize, b: usize| !(heights(a, b).1 <= slack || heights(b, a).0 >= -slack);
    let mut order = Vec::with_capacity(shown.len());
    while !shown.is_empty() {
        let covers_nothing = |&candidate: &usize| {
            shown.iter().all(|&other| other == candidate || !may_cover(candidate, other))
        };
        let next = shown.iter().position(covers_nothing).unwrap_or(0);
        order.push(shown.remove(next));
    }
    order
}

/// A face's colour under a light from the upper left of the viewer.
fn lit(normal: &Vector3<f64>, view: &View) -> Rgb {
    let light = -0.42 * view.right.dot(normal) + 0.62 * view.up.dot(normal) + 0.66 * view.back.dot(normal);
    toward(toward(FACE, 0.0, 0.3), 255.0, 0.75 * light.max(0.0))
}

/// Returns `true` if a point lies within outlines, holes left out: a ray from it crosses them an odd number of times.
fn contains(outlines: &[Vec<[f64; 2]>], [x, y]: [f64; 2]) -> bool {
    let crossings = outlines.iter().flat_map(|outline| {
        let next = outline.iter().cycle().skip(1);
        outline.iter().zip(next)
    });
    let crossed = crossings
        .filter(|(a, b)| (a[1] > y) != (b[1] > y) && x < a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]));
    crossed.count() % 2 == 1
}

/// Returns the largest size of a letter that fits into a face, pixels.
fn room(outlines: &[Vec<[f64; 2]>]) -> f64 {
    let span = |k: usize| {
        let along = outlines.iter().flatten().map(|point| point[k]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    0.4 * span(0).min(span(1))
}
