//! Contacts of links and palm, which are capsules: with the object, with tables, and of the hand with itself.
//!
//! A capsule lies on the object at two places: of its own ends, and of where it passes the object's edges and vertices, the closest
//! two. So what lies on it does not rock. As they become one, only one is left, and forces don't jump.
//!
//! Most of the hand is far from everything most of the time. Nothing is measured that can't have come near since it last was.

use super::material::Material;
use super::placed::Placed;
use super::stiffness::{hard, yields_per_kg};
use super::touch::{Pair, Touch};
use super::world::{Friction, World};
use crate::mass::{Branches, MassFactor};
use crate::model::PlantModel;
use crate::vectors::Everything;
use blindgrasp_body::polyhedron::{Critical, Touchable};
use blindgrasp_body::{MAX_JOINTS, Part, closest_of_lines, pairs};
use blindgrasp_shared::math::{Real, norm};
use nalgebra::Vector3;

/// Gap beyond what velocities close in two steps that a contact may have and still be looked at, m.
const NEAR_M: f64 = 2e-4;
/// Gap up to which a pair is among those whose gap is followed in each step, m.
const STAYS_M: f64 = 1e-3;

/// A thing that a part of the hand may meet.
#[derive(Clone, Copy, Debug)]
enum Meeting {
    /// A capsule and the object.
    Object(usize),
    /// A capsule and a table.
    Table(usize, usize),
    /// Two parts.
    Parts([Part; 2]),
}

#[derive(Clone, Copy, Debug)]
struct Contact {
    meeting: Meeting,
    material: Material,
    friction: Friction,
    /// The gap as it was measured last, m, less the ways gone since.
    gap_m: f64,
}

/// All contacts that parts of a hand may have.
#[derive(Clone, Debug)]
pub(super) struct Links {
    contacts: Vec<Contact>,
    /// Those that are near; and of these, the ones that may touch.
    near: Vec<usize>,
    touching: Vec<usize>,
    /// The least gap of all others, m, less the ways gone since.
    gap_m: f64,
    /// Ways gone since gaps were looked at, m.
    gone_m: f64,
    /// Gap beyond which nothing of the hand can touch the object, a table or another part within two steps, m.
    pub(super) within_m: f64,
    /// The farthest that a joint moves a point of the hand when it turns, m/rad.
    reach_m: [f64; MAX_JOINTS],
}

impl Links {
    /// Of a hand at its place at the start, with its factored mass matrix.
    pub(super) fn new(
        (model, world): (&PlantModel, &World),
        placed: &Placed,
        mass: &MassFactor,
        object_yields_per_kg: f64,
        step_s: f64,
    ) -> Self {
        let (hand, capsules) = (&model.hand, &world.capsules);
        let yields = |part: Part| {
            part.link(hand, capsules).map_or(0.0, |link| {
                let ends_m = part.ends_m(&placed.posture, capsules);
                ends_m.iter().map(|end_m| yields_per_kg(mass, placed, hand, link, end_m)).fold(0.0, f64::max)
            })
        };
        let mut contacts = Vec::new();
        for (capsule, &sliding) in world.capsule_friction.iter().enumerate() {
            let own = yields(Part::Capsule(capsule));
            contacts.push(Contact {
                meeting: Meeting::Object(capsule),
                material: hard(own + object_yields_per_kg, step_s),
                friction: Friction { sliding, torsion_m: 0.0 },
                gap_m: 0.0,
            });
            // Where no joint moves a capsule, a table can't come to it with any force.
            if capsules[capsule].link.is_none() {
                continue;
            }
            for (t, table) in world.tables.iter().enumerate() {
                contacts.push(Contact {
                    meeting: Meeting::Table(capsule, t),
                    material: hard(own, step_s),
                    friction: Friction { sliding: table.object_friction, torsion_m: 0.0 },
                    gap_m: 0.0,
                });
            }
        }
        let pairs = if world.hand_touches_itself { pairs(hand, capsules) } else { Vec::new() };
        for parts in pairs {
            let sliding = parts.map(|part| match part {
                Part::Capsule(capsule) => world.capsule_friction[capsule],
                Part::Fingertip(finger) => world.fingertip_friction[finger].sliding,
            });
            let material = match parts {
                [Part::Fingertip(first), Part::Fingertip(second)] => {
                    Material::of_fingertip(&model.fingertips[first].onto(&model.fingertips[second]))
                }
                [Part::Fingertip(soft), Part::Capsule(_)] | [Part::Capsule(_), Part::Fingertip(soft)] => {
                    Material::of_fingertip(&model.fingertips[soft])
                }
                _ => hard(parts.into_iter().map(yields).sum(), step_s),
            };
            let friction = Friction { sliding: sliding[0].min(sliding[1]), torsion_m: 0.0 };
            contacts.push(Contact { meeting: Meeting::Parts(parts), material, friction, gap_m: 0.0 });
        }
        Self {
            contacts,
            near: Vec::new(),
            touching: Vec::new(),
            gap_m: 0.0,
            gone_m: 0.0,
            within_m: f64::INFINITY,
            reach_m: reach_m(model, world),
        }
    }

    /// Forgets what is far.
    #[cfg(test)]
    pub(super) fn forget(&mut self) {
        self.gap_m = 0.0;
        self.contacts.iter_mut().for_each(|contact| contact.gap_m = 0.0);
    }

    /// Looks again at what may be near after half-step velocities have moved everything for a step.
    pub(super) fn update(
        &mut self,
        placed: &Placed,
        (model, world): (&PlantModel, &World),
        object: (&Touchable, f64),
        (branches, before, table_m): (&Branches, &Everything, f64),
        (t_s, step_s): (f64, f64),
    ) {
        let rate = |joints: &[usize]| {
            let rates = joints.iter().map(|&k| before.joints[k].magnitude() * self.reach_m[k]);
            rates.sum::<f64>()
        };
        let fastest_m_s = branches.fingers.iter().map(|finger| rate(finger)).fold(0.0, f64::max);
        let [x, y, z, a, b, c] = before.object;
        let object_m_s = norm(&Vector3::new(x, y, z)) + norm(&Vector3::new(a, b, c)) * object.1;
        // Of two parts, or of one part and the object or a table.
        let hand_m_s = rate(&branches.trunk) + fastest_m_s;
        let moved_m = step_s * (hand_m_s + hand_m_s.max(object_m_s)) + table_m;
        let within_m = NEAR_M + 2.0 * moved_m;
        self.within_m = within_m;
        let measure = |meeting: Meeting| gap_m(meeting, placed, (model, world), object, t_s);
        self.gap_m -= moved_m;
        self.gone_m += moved_m;
        if self.gap_m <= within_m {
            self.near.clear();
            self.gap_m = f64::INFINITY;
            for (k, contact) in self.contacts.iter_mut().enumerate() {
                contact.gap_m -= self.gone_m;
                if contact.gap_m < within_m + STAYS_M {
                    contact.gap_m = measure(contact.meeting);
                }
                if contact.gap_m < within_m + STAYS_M {
                    self.near.push(k);
                } else {
                    self.gap_m = self.gap_m.min(contact.gap_m);
                }
            }
            self.gone_m = 0.0;
        }
        self.touching.clear();
        for &k in &self.near {
            let contact = &mut self.contacts[k];
            contact.gap_m -= moved_m;
            if contact.gap_m <= within_m {
                contact.gap_m = measure(contact.meeting);
            }
            if contact.gap_m <= within_m {
                self.touching.push(k);
            }
        }
    }

    /// Gives the contacts that may touch.
    pub(super) fn see(
        &self,
        placed: &Placed,
        (model, world): (&PlantModel, &World),
        (object, places): (&Touchable, &mut Vec<Critical>),
        (t_s, within_m): (f64, f64),
        see: &mut impl FnMut(&Touch),
    ) {
        let capsules = &world.capsules;
        for &k in &self.touching {
            let Contact { meeting, material, friction, .. } = self.contacts[k];
            let mut see_it = |touch: Touch| see(&Touch { material, friction, ..touch });
            match meeting {
                Meeting::Object(capsule) => {
                    let ends_m = Part::Capsule(capsule).ends_m(&placed.posture, capsules);
                    let ends_m = ends_m.map(|end_m| placed.to_object(&end_m));
                    let supports = object.supports(&ends_m, capsules[capsule].radius_m);
                    for ((share, touches_m), is_second) in supports.into_iter().zip([false, true]) {
                        let centre_m = ends_m[0] + (ends_m[1] - ends_m[0]) * share;
                        object.touches(&centre_m, touches_m + within_m.min(self.within_m), places);
                        let pair = |feature: usize| Pair::CapsuleObject { capsule, is_second, feature };
                        placed.ball_on_object(pair, touches_m, places, (&material, &friction), &mut *see);
                    }
                }
                Meeting::Table(capsule, table) => {
                    let (normal, origin_m) =
                        (world.tables[table].normal, world.tables[table].point_m.at(t_s));
                    let ends_m = Part::Capsule(capsule).ends_m(&placed.posture, capsules);
                    for (end, end_m) in ends_m.iter().enumerate() {
                        let height_m = normal.dot(&(end_m - origin_m));
                        let pair = Pair::CapsuleTable { capsule, table, end };
                        let depth_m = capsules[capsule].radius_m - height_m;
                        see_it(Touch::new(pair, depth_m, end_m - normal * height_m, -normal));
                    }
                }
                Meeting::Parts(parts) => {
                    let [first, second] = parts;
                    let lines = parts.map(|part| part.ends_m(&placed.posture, capsules));
                    let shares = closest_of_lines([&lines[0], &lines[1]]);
                    let at = |k: usize| lines[k][0] + (lines[k][1] - lines[k][0]) * shares[k];
                    let [near, far] = [at(0), at(1)];
                    let distance_m = norm(&(far - near));
                    let normal = if distance_m > 0.0 { (far - near) / distance_m } else { Vector3::z() };
                    let [a, b] = parts.map(|part| part.radius_m(&model.hand, capsules));
                    let depth_m = a + b - distance_m;
                    let point_m = near + normal * (a - 0.5 * depth_m);
                    see_it(Touch::new(Pair::Parts { first, second }, depth_m, point_m, normal));
                }
            }
        }
    }
}

/// The gap of a pair, m, or somewhat less.
fn gap_m(
    meeting: Meeting,
    placed: &Placed,
    (model, world): (&PlantModel, &World),
    (object, object_radius_m): (&Touchable, f64),
    t_s: f64,
) -> f64 {
    let capsules = &world.capsules;
    match meeting {
        Meeting::Object(capsule) => {
            let radius_m = capsules[capsule].radius_m;
            // From the ball around the object, where that is far enough.
            let ends_m = Part::Capsule(capsule).ends_m(&placed.posture, capsules);
            let centre = [placed.position_m; 2];
            let [share, _] = closest_of_lines([&ends_m, &centre]);
            let apart_m = norm(&(ends_m[0] + (ends_m[1] - ends_m[0]) * share - placed.position_m));
            let outside_m = apart_m - object_radius_m - radius_m;
            if outside_m > 10.0 * STAYS_M {
                outside_m
            } else {
                let ends_m = ends_m.map(|end_m| placed.to_object(&end_m));
                object.closest_to_line(&ends_m).1.distance_m - radius_m
            }
        }
        Meeting::Table(capsule, table) => {
            let table = &world.tables[table];
            let ends_m = Part::Capsule(capsule).ends_m(&placed.posture, capsules);
            let heights_m = ends_m.map(|end_m| table.normal.dot(&(end_m - table.point_m.at(t_s))));
            heights_m[0].min(heights_m[1]) - capsules[capsule].radius_m
        }
        Meeting::Parts(parts) => {
            let lines = parts.map(|part| part.ends_m(&placed.posture, capsules));
            let shares = closest_of_lines([&lines[0], &lines[1]]);
            let at = |k: usize| lines[k][0] + (lines[k][1] - lines[k][0]) * shares[k];
            let radii_m: f64 = parts.map(|part| part.radius_m(&model.hand, capsules)).iter().sum();
            norm(&(at(0) - at(1))) - radii_m
        }
    }
}

/// The farthest from each joint that a point of the hand can be that it moves, m.
fn reach_m(model: &PlantModel, world: &World) -> [f64; MAX_JOINTS] {
    let hand = &model.hand;
    let mut reach_m = [0.0; MAX_JOINTS];
    let tips = hand.prepared_fingertips().iter().map(|tip| (tip.link, norm(&tip.offset_m) + tip.radius_m));
    let capsules = world.capsules.iter().filter_map(|capsule| {
        let farthest_m = capsule.ends_m.iter().map(norm).fold(0.0, f64::max);
        Some((capsule.link?, farthest_m + capsule.radius_m))
    });
    for (link, mut far_m) in tips.chain(capsules) {
        let mut at = Some(link);
        while let Some(joint) = at {
            reach_m[joint] = f64::max(reach_m[joint], far_m);
            far_m += norm(&hand.offset_m(joint));
            at = hand.parent(joint);
        }
    }
    reach_m
}
