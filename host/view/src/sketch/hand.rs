//! A hand: its capsules, or rods and balls, the axes of its joints, and what is called what.

use super::super::camera::{Camera, Extent, View};
use super::super::palette::{self, FAINT_INK, INK, Rgb};
use super::super::palm::Palm;
use super::super::skeleton::{Covered, JOINT, LINK, PALM, Sizes, owner};
use super::super::text::shortened;
use super::svg::{Anchor, Svg, hex, toward};
use super::{MARGIN, TOP, VIEW, WIDTH, flat, frame, frame_axes, scale_bar, title};
use blindgrasp_body::{Capsule, Hand, MAX_JOINTS, Part as Surface, Posture};
use blindgrasp_shared::math::Real;
use nalgebra::Vector3;

const EDGE: Rgb = [70, 78, 90];
/// Arrows along the axes.
const AXIS: Rgb = [24, 28, 34];
/// Pieces of a rod, at most: as long as it is thick, or more.
const PIECES: f64 = 40.0;
/// Columns and height of a row of the list of joints.
const COLUMNS: usize = 3;
const ROW: f64 = 17.0;

/// A part of the hand that is drawn in one go.
enum Part {
    Ball {
        centre: Vector3<f64>,
        radius_m: f64,
        colour: Rgb,
    },
    /// A piece of a rod, or of a capsule, whose first and last ends are round.
    Rod {
        ends: [Vector3<f64>; 2],
        is_capsule: bool,
        round: [bool; 2],
        radius_m: f64,
        colour: Rgb,
        fill: String,
    },
}

impl Part {
    fn middle(&self) -> Vector3<f64> {
        match self {
            Self::Ball { centre, .. } => *centre,
            Self::Rod { ends, .. } => (ends[0] + ends[1]) / 2.0,
        }
    }

    /// Returns its place in the order from far to near, m: balls and capsules count from near their front, so that a ball covers
    /// the rods that end in it, and a thick capsule a thin one inside it.
    fn nearness(&self, camera: &Camera) -> f64 {
        let bulge = match self {
            Self::Ball { radius_m, .. } | Self::Rod { is_capsule: true, radius_m, .. } => 0.8 * radius_m,
            Self::Rod { .. } => 0.0,
        };
        camera.view.back.dot(&self.middle()) + bulge
    }
}

/// A flat disc: the plate of a palm, or the foot of an arm.
#[derive(Clone, Copy)]
struct Plate {
    /// Of the side that `normal` points out of.
    centre: Vector3<f64>,
    normal: Vector3<f64>,
    radius_m: f64,
    thickness_m: f64,
}

/// A hand from two directions a quarter turn apart, in parallel projection, 800 pixels wide: links and joints, fingertips,
/// the axis of each joint as an arrow (the joint turns about it by the right hand) with its number, the base frame, a scale
/// bar, and the names of the joints by number.
///
/// `capsules` are its surfaces; links without are rods. `names` are those of the joints in the hand's order, `angles_rad` the posture;
/// what lies beyond the hand's joints does not matter.
pub fn hand_svg(
    name: &str,
    hand: &Hand,
    capsules: &[Capsule],
    names: &[String],
    angles_rad: &[f64; MAX_JOINTS],
) -> String {
    let mut posture = Posture::at_base();
    hand.forward_kinematics(angles_rad, &mut posture);
    let mut svg = Svg::default();
    let about = format!(
        "{} joints, {} fingertips, at the nominal posture; an arrow is a joint's axis, about which it turns by the right hand",
        hand.joint_count(),
        hand.fingertip_count()
    );
    title(&mut svg, &shortened(name, 70), &about);
    for (index, view) in views(hand, &posture).into_iter().enumerate() {
        draw_view(&mut svg, index, view, hand, capsules, &posture);
    }
    let height = list(&mut svg, hand, names);
    svg.finish(WIDTH, height)
}

/// One from where fingers and palm show best, and one from a quarter turn on.
fn views(hand: &Hand, posture: &Posture) -> [View; 2] {
    let tips = &posture.centres_m[..hand.fingertip_count()];
    let middle = tips.iter().sum::<Vector3<f64>>() / tips.len().max(1) as f64;
    let fingers: Vec<Vector3<f64>> = tips.iter().map(|tip| tip - middle).collect();
    let palm = Palm::all(hand, posture).first().map_or(Vector3::zeros(), |palm| palm.placed(posture).0);
    let first = View::on_grasp(&fingers, &(middle - palm), false);
    [first, first.turned(90.0)]
}

fn draw_view(svg: &mut Svg, index: usize, view: View, hand: &Hand, capsules: &[Capsule], posture: &Posture) {
    let (sizes, covered) = (Sizes::of(hand), Covered(capsules));
    let plates = plates(hand, &covered, posture, &sizes);
    let points = points(hand, capsules, posture, &sizes, &plates);
    let (from, to) = frame(index);
    let camera = Camera::fitted(view, &Extent::around(points.iter().map(|p| view.flat(p))), from, to);
    let parts = parts(svg, &camera, hand, &covered, posture, &sizes);
    paint(svg, &camera, &plates, parts);
    let extent = points.iter().map(|p| (p - middle(&points)).norm()).fold(0.0, f64::max);
    frame_axes(svg, &camera, &Vector3::zeros(), [0.3 * extent; 3]);
    for finger in 0..hand.fingertip_count() {
        tip_label(svg, &camera, hand, posture, finger);
    }
    for joint in 0..hand.joint_count() {
        axis(svg, &camera, posture, joint, &sizes);
    }
    scale_bar(svg, index, &camera);
}

fn middle(points: &[Vector3<f64>]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64
}

/// Corners of all that is drawn, m.
fn points(
    hand: &Hand,
    capsules: &[Capsule],
    posture: &Posture,
    sizes: &Sizes,
    plates: &[Plate],
) -> Vec<Vector3<f64>> {
    let mut balls: Vec<(Vector3<f64>, f64)> =
        (0..hand.joint_count()).map(|k| (posture.link(k).origin_m, sizes.joint_radius_m)).collect();
    balls.extend((0..hand.fingertip_count()).map(|i| (posture.centres_m[i], hand.radius_m(i))));
    for (k, capsule) in capsules.iter().enumerate() {
        balls.extend(Surface::Capsule(k).ends_m(posture, capsules).map(|end| (end, capsule.radius_m)));
    }
    balls.push((Vector3::zeros(), 0.0));
    balls.extend(plates.iter().map(|plate| (plate.centre, plate.radius_m)));
    let sides = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()];
    balls.iter().flat_map(|(centre, radius)| sides.iter().map(move |side| centre + side * *radius)).collect()
}

fn plates(hand: &Hand, covered: &Covered<'_>, posture: &Posture, sizes: &Sizes) -> Vec<Plate> {
    let palms = Palm::all(hand, posture);
    let mut plates: Vec<Plate> = palms
        .iter()
        .filter(|palm| !covered.link(palm.link))
        .map(|palm| {
            let (centre, normal) = palm.placed(posture);
            let radius_m = palm.radius_m + 2.2 * sizes.link_radius_m;
            Plate { centre, normal, radius_m, thickness_m: 0.12 * radius_m + sizes.link_radius_m }
        })
        .collect();
    if palms.iter().all(|palm| palm.link.is_some()) && !covered.link(None) {
        let radius_m = 3.0 * sizes.trunk_radius_m;
        plates.push(Plate {
            centre: Vector3::zeros(),
            normal: Vector3::z(),
            radius_m,
            thickness_m: 0.4 * radius_m,
        });
    }
    plates
}

/// Capsules and rods in pieces, joints and fingertips.
fn parts(
    svg: &mut Svg,
    camera: &Camera,
    hand: &Hand,
    covered: &Covered<'_>,
    posture: &Posture,
    sizes: &Sizes,
) -> Vec<Part> {
    const SHARE: f64 = 0.4;
    let origin = |k: usize| posture.link(k).origin_m;
    let palms = Palm::all(hand, posture);
    let mut parts = Vec::new();
    for (k, capsule) in covered.0.iter().enumerate() {
        let ends = Surface::Capsule(k).ends_m(posture, covered.0);
        let colour = Covered::colour(hand, capsule.link, SHARE);
        rod(svg, camera, &mut parts, Shaft { ends, radius_m: capsule.radius_m, colour, is_round: true });
    }
    let mut flat = |parts: &mut Vec<Part>, ends, radius_m, colour| {
        rod(svg, camera, parts, Shaft { ends, radius_m, colour, is_round: false });
    };
    for k in 0..hand.joint_count() {
        let (parent, finger) = (hand.parent(k), owner(hand, k));
        let radius_m = if finger.is_some() { sizes.link_radius_m } else { sizes.trunk_radius_m };
        let joint_m = if finger.is_some() { sizes.joint_radius_m } else { 1.2 * sizes.trunk_radius_m };
        // Links that start from a plate lie in it.
        if palms.iter().all(|palm| palm.link != parent) && !covered.link(parent) {
            let from = parent.map_or(Vector3::zeros(), origin);
            flat(&mut parts, [from, origin(k)], radius_m, Covered::colour(hand, Some(k), SHARE));
        }
        if !covered.joint(hand, k) {
            parts.push(Part::Ball { centre: origin(k), radius_m: joint_m, colour: JOINT });
        }
    }
    for palm in palms.iter().filter(|palm| !covered.link(palm.link)) {
        if let Some(link) = palm.link {
            flat(&mut parts, [origin(link), palm.placed(posture).0], sizes.trunk_radius_m, LINK);
        }
    }
    for i in 0..hand.fingertip_count() {
        let (link, centre) = (hand.fingertip_link(i), posture.centres_m[i]);
        if !covered.link(Some(link)) {
            let colour = palette::mix(palette::of(i), LINK, SHARE);
            flat(&mut parts, [origin(link), centre], sizes.link_radius_m, colour);
        }
        let colour = palette::mix(palette::of(i), palette::WHITE, 0.8);
        parts.push(Part::Ball { centre, radius_m: hand.radius_m(i), colour });
    }
    parts
}

/// A rod, or a capsule.
struct Shaft {
    ends: [Vector3<f64>; 2],
    radius_m: f64,
    colour: Rgb,
    is_round: bool,
}

fn rod(svg: &mut Svg, camera: &Camera, parts: &mut Vec<Part>, shaft: Shaft) {
    let Shaft { ends, radius_m, colour, is_round } = shaft;
    let length = (ends[1] - ends[0]).norm();
    let (from, to) = (flat(camera, &ends[0]), flat(camera, &ends[1]));
    let Some(side) = across(from, to, radius_m * camera.pixels_per_m) else {
        if is_round {
            let nearer = usize::from(camera.view.back.dot(&(ends[1] - ends[0])) > 0.0);
            parts.push(Part::Ball { centre: ends[nearer], radius_m, colour });
        }
        return;
    };
    let fill = svg.rod_fill(from, side, colour);
    let pieces = (length / radius_m.max(1e-3 * length)).ceil().clamp(1.0, PIECES) as usize;
    let at = |k: usize| ends[0] + (ends[1] - ends[0]) * (k as f64 / pieces as f64);
    parts.extend((0..pieces).map(|k| Part::Rod {
        ends: [at(k), at(k + 1)],
        is_capsule: is_round,
        round: [is_round && k == 0, is_round && k + 1 == pieces],
        radius_m,
        colour,
        fill: fill.clone(),
    }));
}

/// From the middle of a line to its side, so many pixels; `None` for one that is seen end on.
fn across(from: [f64; 2], to: [f64; 2], width: f64) -> Option<[f64; 2]> {
    let way = [to[0] - from[0], to[1] - from[1]];
    let length = (way[0] * way[0] + way[1] * way[1]).square_root();
    (length > 0.05).then(|| [-way[1] / length * width, way[0] / length * width])
}

/// Draws parts from far to near; a plate before what is in front of its plane, after what is behind.
fn paint(svg: &mut Svg, camera: &Camera, plates: &[Plate], mut parts: Vec<Part>) {
    let Some((plate, others)) = plates.split_first() else {
        parts.sort_by(|a, b| a.nearness(camera).total_cmp(&b.nearness(camera)));
        parts.iter().for_each(|part| draw(svg, camera, part));
        return;
    };
    let facing = plate.normal.dot(&camera.view.back).signum();
    let in_front = |point: &Vector3<f64>| plate.normal.dot(&(point - plate.centre)) * facing > 0.0;
    // What sits in the plate stands out of its face.
    let level = |part: &Part| part.middle() + plate.normal * 1e-6 * plate.radius_m;
    let (front, rear): (Vec<Part>, Vec<Part>) = parts.into_iter().partition(|part| in_front(&level(part)));
    let (front_plates, rear_plates): (Vec<Plate>, Vec<Plate>) =
        others.iter().copied().partition(|other| in_front(&other.centre));
    paint(svg, camera, &rear_plates, rear);
    draw_plate(svg, camera, plate);
    paint(svg, camera, &front_plates, front);
}

fn draw(svg: &mut Svg, camera: &Camera, part: &Part) {
    match part {
        Part::Ball { centre, radius_m, colour } => {
            svg.ball(
                flat(camera, centre),
                radius_m * camera.pixels_per_m,
                *colour,
                toward(*colour, 0.0, 0.5),
            );
        }
        Part::Rod { ends, round, radius_m, colour, fill, .. } => {
            let (from, to) = (flat(camera, &ends[0]), flat(camera, &ends[1]));
            let Some([x, y]) = across(from, to, radius_m * camera.pixels_per_m) else { return };
            // A little over, so that no gap shows between two pieces.
            let over = |a: f64, b: f64| 0.04 * (b - a);
            let [dx, dy] = [over(from[0], to[0]), over(from[1], to[1])];
            let (a, b) = ([from[0] - dx, from[1] - dy], [to[0] + dx, to[1] + dy]);
            // Half a turn about an end, from its side (x, y) over what is beyond it.
            let half = |at: [f64; 2], [x, y]: [f64; 2]| {
                (0..=12).map(move |k| {
                    let (sine, cosine) = (f64::from(k) * std::f64::consts::PI / 12.0).sine_cosine();
                    [at[0] + x * cosine + y * sine, at[1] + y * cosine - x * sine]
                })
            };
            let end = |is_round: bool, round_at, flat_at: [f64; 2], [x, y]: [f64; 2]| -> Vec<[f64; 2]> {
                if is_round {
                    half(round_at, [x, y]).collect()
                } else {
                    vec![[flat_at[0] + x, flat_at[1] + y], [flat_at[0] - x, flat_at[1] - y]]
                }
            };
            let (last, first) = (end(round[1], to, b, [x, y]), end(round[0], from, a, [-x, -y]));
            svg.fill(&[last.as_slice(), first.as_slice()].concat(), fill);
            let edge = toward(*colour, 0.0, 0.5);
            for sign in [1.0, -1.0] {
                let side = |p: [f64; 2]| [p[0] + sign * x, p[1] + sign * y];
                svg.line(&[side(from), side(to)], 0.8, edge);
            }
            for (is_round, outline) in [(round[0], first), (round[1], last)] {
                if is_round {
                    svg.line(&outline, 0.8, edge);
                }
            }
        }
    }
}

/// The rim first, then the side that shows.
fn draw_plate(svg: &mut Svg, camera: &Camera, plate: &Plate) {
    let [u, v, normal] = super::super::mesh::basis(&plate.normal);
    let ring = |centre: Vector3<f64>| -> Vec<[f64; 2]> {
        (0..72)
            .map(|k| {
                let (sine, cosine) = (f64::from(k) * std::f64::consts::TAU / 72.0).sine_cosine();
                flat(camera, &(centre + (u * cosine + v * sine) * plate.radius_m))
            })
            .collect()
    };
    let (face, rear) = (ring(plate.centre), ring(plate.centre - normal * plate.thickness_m));
    let faces = normal.dot(&camera.view.back) > 0.0;
    let (near, far) = if faces { (face, rear) } else { (rear, face) };
    // The side between the rims: each strip that is not hidden by the disc.
    let side = hex(toward(PALM, 0.0, 0.22));
    svg.shape(std::slice::from_ref(&far), &side, EDGE, 0.9);
    for k in 0..near.len() {
        let next = (k + 1) % near.len();
        svg.fill(&[near[k], near[next], far[next], far[k]], &side);
    }
    let outer = |pair: [usize; 2]| pair.map(|k| [near[k], far[k]]);
    // The two lines between the rims at the sides of the picture.
    let extreme = |sign: f64| {
        let score = |k: &usize| {
            sign * (near[*k][0] * (far[0][1] - near[0][1]) - near[*k][1] * (far[0][0] - near[0][0]))
        };
        (0..near.len()).max_by(|a, b| score(a).total_cmp(&score(b))).unwrap_or(0)
    };
    for line in outer([extreme(1.0), extreme(-1.0)]) {
        svg.line(&line, 0.9, EDGE);
    }
    svg.shape(&[near], &hex(if faces { toward(PALM, 255.0, 0.35) } else { PALM }), EDGE, 0.9);
}

/// The axis of a joint with its number: an arrow, or a point or a cross where it comes towards the viewer or goes away.
fn axis(svg: &mut Svg, camera: &Camera, posture: &Posture, joint: usize, sizes: &Sizes) {
    let pose = posture.link(joint);
    let (from, axis) = (flat(camera, &pose.origin_m), pose.axis());
    // Long enough to stand out of the joint, and to be seen.
    let length = (1.9 * sizes.joint_radius_m * camera.pixels_per_m).max(20.0);
    let [x, y] = camera.view.flat(&axis);
    let label = format!("{}", joint + 1);
    let place = if x * x + y * y > 0.04 {
        svg.arrow(from, [from[0] + x * length, from[1] - y * length], 1.4, AXIS)
    } else {
        svg.dot(from, 4.5, palette::WHITE, AXIS);
        if camera.view.back.dot(&axis) > 0.0 {
            svg.dot(from, 1.2, AXIS, AXIS);
        } else {
            for sign in [1.0, -1.0] {
                svg.line(
                    &[[from[0] - 2.6, from[1] - 2.6 * sign], [from[0] + 2.6, from[1] + 2.6 * sign]],
                    1.2,
                    AXIS,
                );
            }
        }
        [from[0] + 9.0, from[1] - 9.0]
    };
    svg.text([place[0], place[1] + 4.0], &label, 11.0, INK, Anchor::Middle);
}

fn tip_label(svg: &mut Svg, camera: &Camera, hand: &Hand, posture: &Posture, finger: usize) {
    let at = flat(camera, &posture.centres_m[finger]);
    let radius = hand.radius_m(finger) * camera.pixels_per_m;
    let colour = toward(palette::of(finger), 0.0, 0.25);
    svg.text([at[0], at[1] - radius - 6.0], &format!("tip {}", finger + 1), 11.0, colour, Anchor::Middle);
}

/// The joints by number, in columns; returns where the picture ends.
fn list(svg: &mut Svg, hand: &Hand, names: &[String]) -> f64 {
    let rows = hand.joint_count().div_ceil(COLUMNS).max(1);
    let top = TOP + VIEW + 26.0;
    for k in 0..hand.joint_count() {
        let (column, row) = (k / rows, k % rows);
        let left = MARGIN + column as f64 * (WIDTH - 2.0 * MARGIN) / COLUMNS as f64;
        let y = top + row as f64 * ROW;
        let colour = owner(hand, k).map_or(FAINT_INK, palette::of);
        svg.dot([left + 5.0, y - 4.0], 4.0, colour, colour);
        let name = names.get(k).map_or("", String::as_str);
        svg.text([left + 32.0, y], &format!("{}", k + 1), 12.0, INK, Anchor::End);
        svg.text([left + 40.0, y], &shortened(name, 26), 12.0, INK, Anchor::Start);
    }
    top + rows as f64 * ROW + MARGIN - 8.0
}
