//! Shipped hands and objects, what the user fixes, what rotations leave alone, and every reason why not.

use super::*;
use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_model::file::{CapsuleFile, ContactFile, Indentation, PoseFile, ShapeFile};
use blindgrasp_model::{HandFile, ObjectFile};
use nalgebra::Vector3;
use std::path::Path;

/// A scene to be placed, with all that belongs to it.
struct Case {
    like: SceneFile,
    parts: Parts,
    reach: Reach,
    any_position: bool,
    any_attitude: bool,
}

impl Case {
    fn of(like: SceneFile) -> Self {
        let parts = Parts::of(&like).unwrap();
        let reach = Reach::of_scene(&like, &parts).unwrap();
        Self { like, parts, reach, any_position: true, any_attitude: false }
    }

    fn new(hand: &str, object: &str) -> Self {
        Self::of(template(HandFile::load(hand).unwrap(), ObjectFile::load(object).unwrap(), true).unwrap())
    }

    fn with_shape(&self, shape: ShapeFile) -> Self {
        let mut like = self.like.clone();
        like.object = ObjectFile { mass_kg: None, density_kg_m3: Some(19.0), shape, ..like.object };
        let parts = Parts::of(&like).unwrap();
        Self { like, parts, reach: self.reach.clone(), ..*self }
    }

    fn place(&self, most: usize) -> Result<Vec<Placement>, NoPlacement> {
        let &Self { any_position, any_attitude, .. } = self;
        place(
            &Request { like: &self.like, parts: &self.parts, reach: &self.reach, any_position, any_attitude },
            most,
        )
    }

    fn refusal(&self) -> Refusal {
        match self.place(1) {
            Err(NoPlacement::None(refusal)) => refusal,
            other => panic!("{:?}", other.map(|placed| placed[0].quality.clone())),
        }
    }
}

fn cuboid(size_m: [f64; 3]) -> ShapeFile {
    ShapeFile::Box { size_m }
}

fn faces(placement: &Placement) -> Vec<usize> {
    placement.scene.contacts.iter().map(|contact| contact.face).collect()
}

/// Random points on an ellipsoid.
fn hull(random: &mut fastrand::Rng, size_m: f64) -> Vec<[f64; 3]> {
    let axes = Vector3::from_fn(|_, _| size_m * (0.5 + 0.5 * random.f64()));
    let mut direction = || loop {
        let v = Vector3::from_fn(|_, _| 2.0 * random.f64() - 1.0);
        if (0.1..1.0).contains(&v.norm()) {
            return v.normalize();
        }
    };
    (0..10).map(|_| direction().component_mul(&axes).into()).collect()
}

/// Asserts all that every placement has to be.
fn assert_sound(placement: &Placement) {
    let scene = &placement.scene;
    let posture = blindgrasp_model::posture(&scene.hand, &scene.start.angles_rad);
    for (k, angle) in scene.start.angles_rad.iter().enumerate() {
        let (lower, upper) = scene.hand.range_rad(k);
        assert!((lower..=upper).contains(angle));
    }
    for (i, contact) in scene.contacts.iter().enumerate() {
        // Eq. 5, from the posture.
        let lever = scene.start.position_m - posture.centres_m[i];
        let c_y = scene.start.attitude * contact.frame.column(1);
        let indentation = scene.hand.radius_m(i) + contact.distance_m - c_y.dot(&lever);
        assert!((indentation - scene.start.indentations_m[i]).abs() < 3e-12 && indentation > 0.0);
        let margin = scene.object.margin_m(contact.face, &scene.start.points_m[i]);
        assert!(margin > 0.0 && (margin - placement.quality.fingertips[i].margin_m).abs() < 1e-12);
        for j in 0..i {
            let apart = (posture.centres_m[i] - posture.centres_m[j]).norm();
            assert!(apart >= scene.hand.radius_m(i) + scene.hand.radius_m(j));
        }
    }
    let quality = &placement.quality;
    assert!(
        quality.room_rad > 0.0 && quality.score <= quality.chance && (0.0..=1.0).contains(&quality.chance)
    );
    assert!(
        quality
            .fingertips
            .iter()
            .all(|tip| tip.normal_force_n > 0.0 && tip.friction <= FRICTION_LIMIT + 1e-6)
    );
    assert!(scene.warnings.iter().all(|warning| !warning.contains("overlap")), "{:?}", scene.warnings);
}

#[test]
fn shipped_hands_hold_shipped_objects() {
    for (hand, object, expected) in [
        ("three-finger", "prism", vec![0, 1, 2]),
        ("three-finger", "cube", vec![2, 1, 0]),
        ("two-finger", "hexagonal-prism", vec![0, 3]),
        ("four-finger", "cube", vec![2, 1, 3, 0]),
    ] {
        let placed = Case::new(hand, object).place(3).unwrap();
        assert_eq!(faces(&placed[0]), expected, "{hand} {object}");
        placed.iter().for_each(assert_sound);
        assert!(placed.windows(2).all(|pair| pair[0].quality.score >= pair[1].quality.score));
        assert!(placed[0].quality.chance > 0.9, "{:?}", placed[0].quality);
    }
}

/// On the prism the normals meet in the middle: nothing rolls, and the forces are those of the closed form.
#[test]
fn the_prism_is_held_by_normal_forces() {
    let case = Case::new("three-finger", "prism");
    let placed = case.place(1).unwrap();
    for tip in &placed[0].quality.fingertips {
        assert!(tip.turn_rad < 1e-3 && tip.friction < 1e-3, "{tip:?}");
        // A (r - dr + height of a side over the axis): Eq. 57.
        let inradius = 0.06 / (2.0 * 3.0_f64.powf(0.5));
        let expected = 5.0 / 0.045 * (0.015 - tip.indentation_m + inradius);
        assert!((tip.normal_force_n - expected).abs() < 1e-5 * expected);
    }
    assert!(placed[0].quality.unbalanced_moment_nm < 1e-5);
}

#[test]
fn the_written_scene_is_the_placement() {
    for (hand, object, ideal) in [
        ("three-finger", "cube", false),
        ("three-finger", "cube", true),
        ("two-finger", "hexagonal-prism", false),
    ] {
        let like = template(HandFile::load(hand).unwrap(), ObjectFile::load(object).unwrap(), ideal).unwrap();
        for any_attitude in [false, true] {
            let case = Case { any_attitude, ..Case::of(like.clone()) };
            let placement = case.place(1).unwrap().remove(0);
            let text = scene_text(&placement, hand, object, "held");
            let read = Scene::parse(&text, "s.toml", Path::new(""), &[])
                .unwrap_or_else(|error| panic!("{error}\n{text}"));
            assert_eq!(read, placement.scene);
            assert_sound(&placement);
        }
    }
}

#[test]
fn the_same_request_gives_the_same_placement() {
    let case = Case { any_attitude: true, ..Case::new("three-finger", "cube") };
    assert_eq!(case.place(5).unwrap(), case.place(5).unwrap());
}

/// An object that is described in rotated axes, and rotated back by its attitude, is the same object.
#[test]
fn rotated_and_turned_back_is_the_same() {
    let mut random = fastrand::Rng::with_seed(9);
    let base = Case::new("three-finger", "cube");
    for _ in 0..5 {
        let points = hull(&mut random, 0.03);
        let angles = [random.f64(), random.f64(), random.f64()];
        let rotation = PoseFile { rotation_rpy_rad: Some(angles), ..PoseFile::default() }.attitude().unwrap();
        let turned = points.iter().map(|&p| (rotation.inverse() * Vector3::from(p)).into()).collect();
        let plain = base.with_shape(ShapeFile::Hull { points_m: points });
        let mut case = base.with_shape(ShapeFile::Hull { points_m: turned });
        case.like.pose.rotation_rpy_rad = Some(angles);
        let (a, b) = (plain.place(1).unwrap().remove(0), case.place(1).unwrap().remove(0));
        // The search ends at steps of 1e-4 rolling radii, and points are rounded to 0.1 um in other axes.
        assert!((a.quality.chance - b.quality.chance).abs() < 1e-3, "{:?} {:?}", a.quality, b.quality);
        assert!((a.quality.score - b.quality.score).abs() < 1e-3);
    }
}

#[test]
fn what_the_user_fixes_stays() {
    let mut case = Case::new("three-finger", "cube");
    case.like.contacts = vec![
        ContactFile { face: Some(2), point_m: None },
        ContactFile::default(),
        ContactFile { face: None, point_m: Some([-0.024, 0.002, -0.003]) },
    ];
    let placed = case.place(1).unwrap().remove(0);
    assert_eq!((faces(&placed)[0], faces(&placed)[2]), (2, 0));
    assert!((placed.scene.start.points_m[2] - Vector3::new(-0.024, 0.002, -0.003)).norm() < 1e-7);
    assert_sound(&placed);
    // A position.
    let mut case = Case::new("three-finger", "cube");
    case.like.pose.position_m = [0.003, -0.002, 0.121];
    case.any_position = false;
    let placed = case.place(1).unwrap().remove(0);
    assert_eq!(placed.scene.start.position_m, Vector3::new(0.003, -0.002, 0.121));
    // What can't be is an error of the input.
    for (contact, words) in [
        (
            ContactFile { face: Some(6), point_m: None },
            "contact.1.face: the object has no face 6; has to be between 0 and 5",
        ),
        (
            ContactFile { face: Some(0), point_m: Some([0.0; 3]) },
            "contact.1.point_m: is 24.000 mm off face 0; give a point of the face in the object frame, whose origin is the \
             centre of mass",
        ),
        (
            ContactFile { face: Some(0), point_m: Some([-0.024, 0.03, 0.0]) },
            "contact.1.point_m: is 6.000 mm beyond the edge of face 0; move it inside",
        ),
        (
            ContactFile { face: None, point_m: Some([0.0; 3]) },
            "contact.1.point_m: is not on the surface; give a point of a face in the object frame, whose origin is the centre \
             of mass",
        ),
    ] {
        let mut case = Case::new("three-finger", "cube");
        case.like.contacts = vec![contact];
        assert_eq!(case.place(1).unwrap_err().to_string(), words);
    }
}

/// Fingertips that share a face stand apart.
#[test]
fn fingertips_may_share_a_face() {
    let mut case = Case::new("four-finger", "cube").with_shape(cuboid([0.04, 0.12, 0.12]));
    let on = |face| ContactFile { face: Some(face), point_m: None };
    case.like.contacts = vec![on(0), on(1), on(0), on(0)];
    case.any_attitude = true;
    match case.place(1) {
        Ok(placed) => assert_sound(&placed[0]),
        Err(NoPlacement::None(refusal)) => assert!(!refusal.reason.contains("overlap"), "{refusal}"),
        Err(error) => panic!("{error}"),
    }
    // Two on one face, one opposite.
    let mut case = Case::new("three-finger", "cube").with_shape(cuboid([0.05, 0.12, 0.05]));
    case.like.contacts = vec![on(1), on(0), on(0)];
    case.any_attitude = true;
    let placed = case.place(1).unwrap().remove(0);
    assert_eq!(faces(&placed), [1, 0, 0]);
    let apart = (placed.scene.start.points_m[1] - placed.scene.start.points_m[2]).norm();
    assert!(apart > 0.030, "{apart}");
    assert_sound(&placed);
}

#[test]
fn placements_of_random_hulls_are_sound() {
    let mut random = fastrand::Rng::with_seed(31);
    let base = Case::new("three-finger", "cube");
    let mut placed = 0;
    for size in [0.012, 0.02, 0.03, 0.05, 0.08] {
        for _ in 0..6 {
            let points_m = hull(&mut random, size);
            if Polyhedron::hull(&points_m.iter().map(|&p| p.into()).collect::<Vec<_>>()).is_err() {
                continue;
            }
            match base.with_shape(ShapeFile::Hull { points_m }).place(4) {
                Ok(all) => {
                    all.iter().for_each(assert_sound);
                    placed += 1;
                }
                Err(NoPlacement::None(refusal)) => assert!(!refusal.reason.is_empty()),
                Err(error) => panic!("{error}"),
            }
        }
    }
    assert!(placed > 24, "{placed} of 30");
}

#[test]
fn every_reason_is_told() {
    let base = Case::new("three-finger", "cube");
    let on = |face| ContactFile { face: Some(face), point_m: None };
    let refusal = |shape: ShapeFile, contacts: Vec<ContactFile>| {
        let mut case = base.with_shape(shape);
        case.like.contacts = contacts;
        case.refusal()
    };
    let crumb = vec![[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 1e-3]];
    assert_eq!(
        refusal(ShapeFile::Hull { points_m: crumb }, Vec::new()).to_string(),
        "no face is wide enough: the middle of the widest is 0.41 mm from its edge, and a contact needs 0.75 mm"
    );
    assert_eq!(
        refusal(cuboid([0.02; 3]), vec![on(0), on(1), on(0)]).to_string(),
        "the object is too small for 3 fingertips: they would overlap by 10.1 mm\n        1 x  fingertips would overlap; by 10.1 \
         mm at least"
    );
    assert_eq!(
        refusal(cuboid([0.05; 3]), vec![on(0), on(0), on(0)]).to_string(),
        "no 3 faces have normals that can balance: on all choices the law would pull a fingertip off\n        1 x  the law would \
         pull a fingertip off its face"
    );
    let prism = ShapeFile::Prism { sides: 3, side_m: 0.06, height_m: 0.04 };
    assert_eq!(
        refusal(prism, vec![on(0), on(1), on(1)]).to_string(),
        "no 3 faces have normals that can balance: the best ask for a friction of 1.47, and 1.00 is the limit\n        1 x  asks \
         for too much friction; at least 1.47"
    );
    let wide = refusal(cuboid([0.6, 0.05, 0.05]), vec![on(0), on(1), on(1)]).reason;
    assert!(wide.starts_with("the largest opening between the fingertips `finger-1` and `finger-"), "{wide}");
    assert!(wide.contains(" mm; the object is at least ") && wide.ends_with(" mm across"), "{wide}");
    let mut here = base.with_shape(cuboid([0.05; 3]));
    (here.any_position, here.like.pose.position_m) = (false, [1.0, 0.0, 0.0]);
    assert_eq!(
        here.refusal().reason,
        "the given position is none at which, in this attitude, all 3 fingertips get to contacts of theirs at once"
    );
    here.like.pose.position_m = [0.0, 0.0, 0.03];
    let near = here.refusal();
    assert!(near.reason.starts_with("the fingers come near, but fingertip `finger-"), "{near}");
}

#[test]
fn a_template_without_gains_is_refused() {
    let hand = HandFile { control: None, ..HandFile::load("three-finger").unwrap() };
    let error = template(hand, ObjectFile::load("cube").unwrap(), true).unwrap_err();
    assert_eq!(
        error.to_string(),
        "hand.control: the hand `three-finger` says nothing of its gains; add a table [control] to its file, with the keys that \
         a scene's has: force_n, attitude_stiffness_nm, ..."
    );
    let real =
        template(HandFile::load("three-finger").unwrap(), ObjectFile::load("cube").unwrap(), false).unwrap();
    assert_eq!(real.start.indentation_m, Indentation::Metres(1e-4));
}

/// Links that can't be apart leave no placement; a scene in which links don't touch has the one of a hand that has none.
#[test]
fn links_may_not_be_inside_each_other() {
    let with = |radius_m: f64, links: Option<bool>| {
        let mut case = Case::new("three-finger", "cube").like;
        case.hand.capsules.iter_mut().for_each(|capsule| capsule.radius_m = radius_m);
        case.plant.links = links;
        Case::of(case)
    };
    let refusal = with(0.035, None).refusal();
    let links = |refusal: &Refusal| {
        refusal
            .tests
            .iter()
            .find(|test| test.what.contains("links would be"))
            .map(|test| test.nearest.clone())
    };
    assert!(links(&refusal).is_some_and(|nearest| nearest.contains("would overlap by")), "{refusal}");
    // Nor inside the object: around the fingertip, into the face that it touches.
    let mut into_object = Case::new("three-finger", "cube").like;
    let link = into_object.hand.capsules.swap_remove(5);
    into_object.hand.capsules = vec![CapsuleFile { radius_m: 0.016, ..link }];
    let refusal = Case::of(into_object).refusal();
    assert!(links(&refusal).is_some_and(|nearest| nearest.contains("inside the object")), "{refusal}");
    let mut none = Case::new("three-finger", "cube").like;
    none.hand.capsules.clear();
    let place = |case: Case| case.place(1).unwrap().remove(0).scene.file;
    let (free, none) = (place(with(0.035, Some(false))), place(Case::of(none)));
    let usual = place(Case::new("three-finger", "cube"));
    assert_eq!((&free.pose, &free.contacts), (&none.pose, &none.contacts));
    assert_eq!((&usual.pose, &usual.contacts), (&none.pose, &none.contacts));
}

/// A table leaves room under what of a finger hangs lowest, and under an arm that reaches below it links don't touch.
#[test]
fn a_table_leaves_room_under_links() {
    let on_a_table = |like: SceneFile| Case::of(like).place(1).unwrap()[0].on_a_table();
    let like = Case::new("three-finger", "cube").like;
    let usual = on_a_table(like.clone());
    let mut hanging = like;
    // Beyond the fingertip, away from the object: 40 mm along the link and 20 mm outwards.
    hanging.hand.capsules[5].to_m = [-0.02, 0.0, 0.04];
    let lower = on_a_table(hanging);
    let capsule = blindgrasp_body::Part::Capsule(5);
    let scene = Scene::build(lower.clone()).unwrap();
    let posture = blindgrasp_model::posture(&scene.hand, &scene.start.angles_rad);
    let end_m = capsule.ends_m(&posture, &scene.capsules)[1];
    let height_m = lower.plant.tables[0].point_m[2] - end_m.z - 0.010;
    assert!(lower.plant.tables[0].point_m[2] > usual.plant.tables[0].point_m[2] + 1e-3, "{lower:?}");
    assert!((height_m - 1e-3).abs() < 1e-12, "{height_m}");
    let arm = on_a_table(Case::new("hand-arm", "prism").like);
    assert_eq!((arm.plant.links, usual.plant.links), (Some(false), None));
    assert!(Scene::build(arm).is_ok_and(|scene| scene.capsules.is_empty()));
}
