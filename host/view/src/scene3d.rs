//! One moment of a run as triangles: hand, object, contact forces; and the stage that all moments of a run share.

use super::camera::{Extent, View};
use super::input::Report;
use super::mesh::{Mesh, ROUND, THIN};
use super::palette::Rgb;
use super::palm::{self, Palm};
use super::skeleton::{self, Sizes};
use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_body::{Hand, MAX_JOINTS, Posture};
use blindgrasp_sim::sample::Sample;
use nalgebra::Vector3;
use std::collections::BTreeMap;

const GLASS: Rgb = [132, 178, 212];
/// Arrows.
pub(super) const FORCE: Rgb = [250, 226, 60];
/// Arrows of contacts that slip: their friction is at its limit.
const SLIPPING: Rgb = [236, 96, 40];
const EDGE: Rgb = [52, 66, 84];
const WOOD: Rgb = [196, 168, 132];
/// Half the side of the piece of a table that is shown, in radii of the object.
const TABLE: f64 = 2.0;

/// More edges than this are not drawn.
const MANY_EDGES: usize = 500;
/// The faces of a sharp edge have normals whose product is below this: 30 degrees.
const SHARP: f64 = 0.866;

/// The stage, which is the same for all moments of a run: sizes, the scale of the forces, and where to look from.
#[derive(Clone, Debug)]
pub(super) struct Stage {
    sizes: Sizes,
    palms: Vec<Palm>,
    /// Length of the arrow of 1 N, m.
    pub(super) m_per_n: f64,
    /// Mean distance of the object's corners from its centre of mass, m.
    object_radius_m: f64,
    pub(super) view: View,
    pub(super) extent: Extent,
    /// Step in depth that shows as an outline, m.
    pub(super) outline_m: f64,
}

/// The number of moments of a run that are looked at to find out how much room it takes.
const PROBES: usize = 16;

impl Stage {
    pub(super) fn new(report: &Report<'_>) -> Self {
        let corners = &report.object.vertices_m;
        let object_radius_m = match corners.iter().map(Vector3::norm).sum::<f64>() / corners.len() as f64 {
            radius if radius > 0.0 && radius.is_finite() => radius,
            _ => 0.05,
        };
        let probes: Vec<Option<&Sample>> = match report.samples.len() {
            0 => vec![None],
            count => (0..PROBES).map(|k| report.samples.get(k * (count - 1) / (PROBES - 1))).collect(),
        };
        let postures: Vec<Posture> = probes.iter().map(|sample| posture(report.hand, *sample)).collect();
        let sizes = Sizes::of(report.hand);
        let palms = Palm::all(report.hand, &postures[0]);
        let mut stage = Self {
            sizes,
            m_per_n: reach(report.samples).unwrap_or(0.6 * object_radius_m) / usual_force(report.samples),
            object_radius_m,
            view: view(report, &palms, &postures),
            palms,
            extent: Extent::around(std::iter::empty()),
            outline_m: 0.8 * sizes.link_radius_m,
        };
        let meshes: Vec<Mesh> = probes.into_iter().map(|sample| stage.mesh(report, sample)).collect();
        // An object that was lost flies away; the picture stays with the hand.
        let first = Cloud::around(&meshes[0]);
        stage.extent = Extent::around(
            meshes
                .iter()
                .flat_map(Mesh::points)
                .filter(|point| first.is_near(point))
                .map(|p| stage.view.flat(p)),
        );
        stage
    }

    /// Hand, object and forces at one sample; the hand alone, its joints at zero, without one.
    pub(super) fn mesh(&self, report: &Report<'_>, sample: Option<&Sample>) -> Mesh {
        let mut mesh = Mesh::default();
        let posture = posture(report.hand, sample);
        skeleton::add(&mut mesh, report.hand, report.capsules, &posture, &self.sizes, &self.palms);
        if let Some(sample) = sample {
            self.add_object(&mut mesh, report.object, sample);
            for table in &sample.tables {
                self.add_table(&mut mesh, table, report);
            }
            for contact in &sample.contacts {
                let slips = contact.friction.is_some_and(|friction| friction.used >= 1.0);
                let colour = if slips { SLIPPING } else { FORCE };
                self.add_force(&mut mesh, contact.point_m, contact.force_on_object_n(), colour);
            }
            for contact in &sample.others {
                let colour = if contact.used >= 1.0 { SLIPPING } else { FORCE };
                self.add_force(&mut mesh, contact.point_m, contact.force_n, colour);
            }
        }
        mesh
    }

    fn add_object(&self, mesh: &mut Mesh, object: &Polyhedron, sample: &Sample) {
        let place = |corner: &Vector3<f64>| sample.position_m + sample.attitude * corner;
        for face in &object.faces {
            let normal = sample.attitude * face.normal;
            for corners in &face.triangles {
                mesh.pane(corners.map(|k| place(&object.vertices_m[k])), normal, GLASS);
            }
        }
        for [a, b] in edges(object) {
            let radius = 0.011 * self.object_radius_m;
            mesh.cone([place(&a), place(&b)], [radius; 2], THIN, EDGE);
            mesh.sphere(place(&a), radius, THIN, EDGE);
            mesh.sphere(place(&b), radius, THIN, EDGE);
        }
    }

    /// A piece of a table under where the object was at the start.
    fn add_table(&self, mesh: &mut Mesh, [point_m, normal]: &[Vector3<f64>; 2], report: &Report<'_>) {
        let Some(first) = report.samples.first() else { return };
        let middle_m = first.position_m - normal * normal.dot(&(first.position_m - point_m));
        let helper = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let across = helper.cross(normal).normalize() * (TABLE * self.object_radius_m);
        let along = normal.cross(&across);
        let [a, b, c, d] =
            [across + along, along - across, -across - along, across - along].map(|corner| middle_m + corner);
        mesh.pane([a, b, c], *normal, WOOD);
        mesh.pane([a, c, d], *normal, WOOD);
    }

    /// A force on the object, an arrow that starts at the contact.
    fn add_force(&self, mesh: &mut Mesh, point_m: Vector3<f64>, force: Vector3<f64>, colour: Rgb) {
        let length = (force.norm() * self.m_per_n).min(1.3 * self.object_radius_m);
        if !(length > 0.02 * self.object_radius_m) {
            return;
        }
        let along = force.normalize();
        let radius = (0.045 * self.object_radius_m).min(0.12 * length);
        let head = (0.24 * self.object_radius_m).min(0.5 * length);
        let (tail, tip) = (point_m, point_m + along * length);
        let mut arrow = Mesh::default();
        arrow.cone([tail, tip - along * head], [radius; 2], ROUND, colour);
        arrow.cone([tip - along * head, tip], [2.4 * radius, 0.0], ROUND, colour);
        mesh.marks.append(&mut arrow.solid);
    }
}

/// The edges of a body that are drawn: all of them; where there are many, those that one would feel.
fn edges(object: &Polyhedron) -> Vec<[Vector3<f64>; 2]> {
    let mut sides: BTreeMap<(usize, usize), Vec<Vector3<f64>>> = BTreeMap::new();
    for face in &object.faces {
        for (a, b) in face.edges() {
            sides.entry((a.min(b), a.max(b))).or_default().push(face.normal);
        }
    }
    let many = sides.len() > MANY_EDGES;
    let is_sharp = |normals: &[Vector3<f64>]| match normals {
        [a, b] => a.dot(b) < SHARP,
        _ => true,
    };
    sides
        .into_iter()
        .filter(|(_, normals)| !many || is_sharp(normals))
        .take(MANY_EDGES)
        .map(|((a, b), _)| [a, b].map(|k| object.vertices_m[k]))
        .collect()
}

/// A force that most of the run stays below, so that one impact does not shrink all other arrows, N.
fn usual_force(samples: &[Sample]) -> f64 {
    let step = samples.len() / 2000 + 1;
    let mut forces: Vec<f64> = samples
        .iter()
        .step_by(step)
        .flat_map(|sample| &sample.contacts)
        .map(|contact| contact.force_on_object_n().norm())
        .filter(|force| *force > 0.0 && force.is_finite())
        .collect();
    forces.sort_by(f64::total_cmp);
    forces.get(forces.len() * 9 / 10).copied().unwrap_or(1.0)
}

/// Mean distance of the first contacts from the object's centre of mass, m: room for an arrow.
fn reach(samples: &[Sample]) -> Option<f64> {
    let sample = samples.first()?;
    let reach = sample.contacts.iter().map(|c| (c.point_m - sample.position_m).norm()).sum::<f64>();
    Some(reach / sample.contacts.len() as f64).filter(|reach| *reach > 0.0 && reach.is_finite())
}

/// The hand at one sample; with all joints at zero without one.
fn posture(hand: &Hand, sample: Option<&Sample>) -> Posture {
    sample.map_or_else(
        || {
            let mut posture = Posture::at_base();
            hand.forward_kinematics(&[0.0; MAX_JOINTS], &mut posture);
            posture
        },
        |sample| sample.posture(hand),
    )
}

/// Chooses the view for a run from its start, and from whether the fingers stay in front of the palm.
fn view(report: &Report<'_>, palms: &[Palm], postures: &[Posture]) -> View {
    let tips = |posture: &Posture| posture.centres_m[..report.hand.fingertip_count()].to_vec();
    let start = tips(&postures[0]);
    let object = report.samples.first().map_or_else(|| palm::middle(&start), |sample| sample.position_m);
    let fingers: Vec<Vector3<f64>> = start.iter().map(|tip| tip - object).collect();
    let centre = palms.first().map_or(Vector3::zeros(), |palm| palm.placed(&postures[0]).0);
    let passes_palm = postures.iter().any(|posture| {
        palms.iter().any(|palm| {
            let (centre, normal) = palm.placed(posture);
            tips(posture).iter().any(|tip| (tip - centre).dot(&normal) < 0.0)
        })
    });
    // Where a table is over the hand, the hand looks down: turned over about x, it is as usual.
    let tables = report.samples.first().map_or(&[][..], |sample| &sample.tables);
    if tables.first().is_some_and(|[_, normal]| normal.z < -0.5) {
        let over = |v: Vector3<f64>| Vector3::new(v.x, -v.y, -v.z);
        let fingers: Vec<_> = fingers.into_iter().map(over).collect();
        let View { right, up, back } = View::on_grasp(&fingers, &over(object - centre), passes_palm);
        return View { right: over(right), up: over(up), back: over(back) };
    }
    View::on_grasp(&fingers, &(object - centre), passes_palm)
}

/// The rough places of the points of a mesh.
struct Cloud {
    centre: Vector3<f64>,
    radius: f64,
}

impl Cloud {
    fn around(mesh: &Mesh) -> Self {
        let finite = |point: &&Vector3<f64>| point.iter().all(|v| v.is_finite());
        let points: Vec<Vector3<f64>> = mesh.points().filter(finite).copied().collect();
        let centre = palm::middle(&points);
        let radius = points.iter().map(|point| (point - centre).norm()).fold(0.0, f64::max);
        Self { centre, radius }
    }

    fn is_near(&self, point: &Vector3<f64>) -> bool {
        (point - self.centre).norm() <= 2.5 * self.radius
    }
}
