//! Scenes that are right: what is shipped, what is built in code, what settings and references do.

pub(crate) mod cases;
mod damage;
mod hand_models;
mod inverse_kinematics;
mod mesh;
mod refusals;

use super::*;
use crate::file::{ContactFile, Indentation, InertiaFile, PushFile, ShapeFile};
use blindgrasp_body::{Part, Posture, overlap_m, pairs};
use blindgrasp_meshes::Numbers;

fn text(name: &str) -> &'static str {
    Kind::Scene.built_in().iter().find(|(built_in, _)| *built_in == name).unwrap().1
}

fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse(text, "s.toml", Path::new(""), &[])
}

pub(crate) fn load(name: &str, settings: &[&str]) -> Result<Scene, SceneError> {
    let settings: Vec<String> = settings.iter().map(|s| s.to_string()).collect();
    Scene::load(name, &settings)
}

/// Places fingertips, in the object frame.
fn centres(scene: &Scene) -> Vec<Vector3<f64>> {
    let mut angles = [0.0; blindgrasp_body::MAX_JOINTS];
    angles[..scene.start.angles_rad.len()].copy_from_slice(&scene.start.angles_rad);
    let mut posture = Posture::at_base();
    scene.hand.forward_kinematics(&angles, &mut posture);
    let to_object = scene.start.attitude.inverse();
    (0..scene.contacts.len()).map(|i| to_object * (posture.centres_m[i] - scene.start.position_m)).collect()
}

/// Eq. 5 for every fingertip gives the indentation that the scene says, and the foot is the contact point.
fn assert_touches(scene: &Scene) {
    for (i, (contact, centre)) in scene.contacts.iter().zip(centres(scene)).enumerate() {
        let c_y = contact.frame.column(1);
        let indentation = scene.fingertips[i].radius_m + contact.distance_m + c_y.dot(&centre);
        assert!((indentation - scene.start.indentations_m[i]).abs() < 3e-12, "{indentation}");
        let point = centre + c_y * (scene.fingertips[i].radius_m - indentation);
        assert!((point - scene.start.points_m[i]).norm() < 3e-12);
        assert!(scene.object.margin_m(contact.face, &point) > 0.0);
        assert!((contact.frame.transpose() * contact.frame - Matrix3::identity()).amax() < 1e-14);
        let (c_x, c_z) = (contact.frame.column(0), contact.frame.column(2));
        assert!((c_x.cross(&c_y) - c_z).amax() < 1e-14, "C_X x C_Y = C_Z");
        assert!((c_y + scene.object.faces[contact.face].normal).amax() == 0.0, "C_Y points into the object");
    }
}

/// Returns the warnings on a shipped scene that are meant to be.
fn known_warnings(name: &str) -> &'static [&'static str] {
    match name {
        "hand-arm" | "hand-arm-normal-only" => &[
            "object `cuboid-printed`: its inertia needs mass outside of it: 1.354e-3 kg m^2, but 0.0018 kg within \
             0.364 m make 2.381e-4 kg m^2 at most",
        ],
        _ => &[],
    }
}

/// Either everything is that of the paper's model, or nothing is.
#[test]
fn shipped_scenes_touch_and_have_no_warnings_but_known_ones() {
    let mut models = [0, 0];
    for name in Scene::built_in() {
        let scene = load(name, &[]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scene.name, name);
        assert_eq!(scene.warnings, known_warnings(name), "{name}");
        assert!(HandFile::built_in().any(|hand| hand == scene.file.hand.name), "{name}");
        assert!(Kind::Object.built_in().iter().any(|(object, _)| *object == scene.object_name), "{name}");
        assert_touches(&scene);
        let ideal = scene.sensors.ideal;
        assert_eq!(scene.substeps, if ideal { 10 } else { 2 }, "{name}");
        assert_eq!(scene.joints.iter().all(|joint| joint.torque_limit_nm.is_infinite()), ideal, "{name}");
        assert_eq!(scene.joints.iter().all(|joint| joint.friction.coulomb_nm == 0.0), ideal, "{name}");
        assert_eq!(scene.actuators.output_delay_ticks, f64::from(u8::from(!ideal)), "{name}");
        assert_eq!(scene.control.end_stops, !ideal, "{name}");
        assert_eq!(
            (
                scene.control.soft_start_s == 0.0,
                scene.plant.object_has_weight() && !scene.plant.has_friction()
            ),
            (ideal, false),
            "{name}"
        );
        models[usize::from(ideal)] += 1;
    }
    assert!(models.iter().all(|&count| count >= 3), "{models:?}");
}

/// A table gives way; what is too heavy for it is told.
#[test]
fn an_object_that_sinks_into_the_table_is_told() {
    let warnings = |mass: &str| load("cube-table", &[mass]).unwrap().warnings;
    assert_eq!(warnings("object.mass_kg=20"), Vec::<String>::new());
    assert_eq!(
        warnings("object.mass_kg=100"),
        [
            "plant.table: the object of 100 kg sinks in by 4.1 mm or more: a table gives way under each corner by 1 mm for 60 N"
        ]
    );
}

#[test]
fn shipped_objects_are_those_of_table_vi() {
    let prism = load("prism", &[]).unwrap();
    assert_eq!(prism.mass_kg, 0.0015);
    // Uniform: m a^2 / 12 about the axis, m (a^2 / 24 + h^2 / 12) across.
    let expected = Vector3::new(4.15125e-7, 4.15125e-7, 4.5e-7);
    assert!((prism.inertia_kg_m2 - Matrix3::from_diagonal(&expected)).amax() < 1e-18);
    let cube = load("cube", &[]).unwrap();
    assert!((cube.inertia_kg_m2 - Matrix3::identity() * (0.0021 * 0.048 * 0.048 / 6.0)).amax() < 1e-18);
    // Finger 1 on the -y face, 2 and 3 on +x and -x.
    let inwards: Vec<_> = cube.contacts.iter().map(|contact| contact.frame.column(1).into_owned()).collect();
    assert_eq!(inwards, [Vector3::y(), -Vector3::x(), Vector3::x()]);
    assert!(cube.contacts.iter().all(|contact| (contact.distance_m - 0.024).abs() < 1e-17));
}

#[test]
fn equilibrium_indentation_is_that_of_eq_57() {
    for name in ["prism-ideal", "cube-ideal"] {
        let scene = load(name, &["start.indentation_m=equilibrium"]).unwrap();
        let centres = centres(&scene);
        let middle = centres.iter().sum::<Vector3<f64>>() / 3.0;
        for (i, contact) in scene.contacts.iter().enumerate() {
            let desired =
                scene.control.force_n() / 0.045 * contact.frame.column(1).dot(&(middle - centres[i]));
            let force = scene.fingertips[i].stiffness_n_m2 * scene.start.indentations_m[i].powi(2);
            assert!((force / desired - 1.0).abs() < 1e-9, "{force} {desired}");
        }
    }
}

#[test]
fn effective_configuration_gives_the_same_scene() {
    let settings =
        ["control.force_n=4.1", "hand.joint.*.coulomb_friction_nm=1.7e-3", "plant.gravity_on_object=true"];
    for name in Scene::built_in() {
        for settings in [&settings[..], &[]] {
            let scene = load(name, settings).unwrap();
            let text = scene.effective_toml();
            assert_eq!(parse(&text).unwrap_or_else(|error| panic!("{error}")), scene);
        }
    }
    // Every shape and every optional key.
    let mut file = load("cube", &[]).unwrap().file;
    file.object.inertia_kg_m2 = Some(InertiaFile(vec![1e-6, 1.1e-6, 1.2e-6, 1e-8, 0.0, 0.0]));
    file.object.shape = ShapeFile::PolygonPrism {
        corners_m: vec![[-0.024, -0.024], [0.024, -0.024], [0.024, 0.024], [-0.024, 0.024]],
        height_m: 0.1,
    };
    file.actuators.slew_limit_nm_s = Some(100.0);
    file.pose.rotation_rpy_rad = None;
    file.pose.quaternion_wxyz = Some([1.0, 0.0, 0.0, 1e-4]);
    file.start.indentation_m = Indentation::Equilibrium;
    let scene = Scene::build(file).unwrap();
    assert_eq!(parse(&scene.effective_toml()).unwrap(), scene);
    // The posture as it was found, given as angles: the same contacts.
    let mut file = scene.file.clone();
    file.start.angles_rad = Some(scene.start.angles_rad.clone());
    let again = Scene::build(file).unwrap();
    assert_touches(&again);
    for (a, b) in again.start.indentations_m.iter().zip(&scene.start.indentations_m) {
        assert!((a - b).abs() < 1e-11);
    }
    assert_eq!(parse(&again.effective_toml()).unwrap(), again);
}

#[test]
fn settings_reach_everything() {
    let scene = load(
        "cube",
        &[
            "control.force_n=4",
            "plant.substep_s=5e-5",
            "hand.joint.2.mass_kg=0.02",
            "hand.joint.finger-3-flex-3.limits_rad=[-0.1, 1.5]",
            "hand.fingertip.*.radius_m = 0.016",
            "object.mass_kg=0.5",
            "pose.position_m.3=0.12",
            "start.indentation_m=equilibrium",
            "seed=7",
            "description=two words",
        ],
    )
    .unwrap();
    assert_eq!(scene.control.force_n(), 4.0);
    assert_eq!(scene.substeps, 20);
    assert_eq!(scene.hand.link(1).mass_kg, 0.02);
    assert_eq!(scene.hand.range_rad(11), (-0.1, 1.5));
    assert!(scene.fingertips.iter().all(|fingertip| fingertip.radius_m == 0.016));
    assert_eq!(scene.mass_kg, 0.5);
    assert_eq!(scene.start.position_m.z, 0.12);
    assert_eq!(scene.file.start.indentation_m, Indentation::Equilibrium);
    assert_eq!(scene.description, "two words");
    // References come first, so that settings inside of them apply to what they name.
    let scene = load(
        "cube",
        &[
            "object.mass_kg=0.25",
            "object=prism",
            "contact.2.point_m=[0.015, 0.0086602540378443865, 0]",
            "contact.1.point_m=[0, -0.01732050807568877, 0]",
            "contact.3.point_m=[-0.015, 0.0086602540378443865, 0]",
        ],
    )
    .unwrap();
    assert_eq!((scene.object_name.as_str(), scene.mass_kg), ("prism", 0.25));
}

#[test]
fn what_is_odd_is_a_warning() {
    // The paper's printed object (Table I): 1.8 g, and an inertia that no 0.42 m body of that mass has.
    let scene =
        load("cube", &["object.mass_kg=1.8e-3", "object.inertia_kg_m2=[1.354e-3, 0.765e-3, 1.354e-3]"])
            .unwrap();
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].starts_with("object `cube`: its inertia needs mass outside of it"));
    assert_eq!(scene.inertia_kg_m2[(1, 1)], 0.765e-3);
    let scene = load("cube", &["object.inertia_kg_m2=[1e-7, 1e-7, 3e-7]"]).unwrap();
    assert!(scene.warnings[0].contains("larger than the sum of the two others"), "{:?}", scene.warnings);
    let scene = load("cube", &["hand.joint.2.inertia_kg_m2=[1e-5, 1e-5, 3e-5]"]).unwrap();
    assert!(scene.warnings[0].starts_with("link `finger-1-flex-1`"), "{:?}", scene.warnings);
}

/// A push that comes too late is said, and not refused: a run may be shortened for once.
#[test]
fn a_push_after_the_end_is_warned_of() {
    let mut file = load("cube", &["duration_s=1.5"]).unwrap().file;
    let push = PushFile { from_s: 1.0, for_s: 0.5, force_n: [0.1, 0.0, 0.0], ..PushFile::default() };
    file.plant.pushes = vec![push.clone(), PushFile { from_s: 1.5, ..push }];
    let scene = Scene::build(file).unwrap();
    assert_eq!(scene.warnings, ["plant.push.2.from_s: the run of 1.5 s is over before the push at 1.5 s"]);
}

#[test]
fn random_polyhedra_make_scenes_in_code() {
    let mut numbers = Numbers(11);
    let base = load("prism-ideal", &[]).unwrap().file;
    let mut made = 0;
    for _ in 0..60 {
        let points: Vec<[f64; 3]> = (0..8).map(|_| (numbers.vector().normalize() * 0.03).into()).collect();
        let shape = Polyhedron::hull(&points.iter().map(|&p| p.into()).collect::<Vec<_>>()).unwrap();
        let mut file = base.clone();
        file.object.shape = ShapeFile::Hull { points_m: points };
        // The face that looks most towards each finger.
        let towards = [[0.0, -1.0], [0.866, 0.5], [-0.866, 0.5]].map(|[x, y]| Vector3::new(x, y, 0.0));
        file.contacts = towards
            .iter()
            .map(|way| {
                let along = |k: &usize| shape.faces[*k].normal.dot(way);
                let face = (0..shape.faces.len()).max_by(|a, b| along(a).total_cmp(&along(b)));
                ContactFile { face, point_m: None }
            })
            .collect();
        match Scene::build(file) {
            Ok(scene) => {
                assert_touches(&scene);
                assert_eq!(parse(&scene.effective_toml()).unwrap(), scene);
                made += 1;
            }
            Err(error) => {
                assert!(error.key.starts_with("contact") || error.key.starts_with("start"), "{error}")
            }
        }
    }
    println!("{made} of 60 random polyhedra placed");
    assert!(made > 30, "{made}");
}

#[test]
fn references_are_relative_to_the_file() {
    let folder = std::env::temp_dir().join(format!("blindgrasp-scene-test-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("parts")).unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_string()
    };
    write(
        "parts/block.toml",
        b"schema = 1\nname = \"block\"\ndensity_kg_m3 = 20\n[shape.box]\nsize_m = [0.048, 0.048, 0.048]\n",
    );
    let path = write("scene.toml", text("cube").replace("\"cube\"", "\"parts/block.toml\"").as_bytes());
    let scene = load(&path, &[]);
    // The name of the scene went with it.
    assert_eq!(scene.as_ref().map(|scene| scene.object_name.as_str()), Ok("block"));
    assert!((scene.unwrap().mass_kg - 20.0 * 0.048f64.powi(3)).abs() < 1e-15);

    // An error in a part names the part.
    let part =
        write("parts/block.toml", b"schema = 1\nname = \"block\"\nmass_kg = 1\n[shape.box]\nsize = 3\n");
    let part = part.replace("/parts", "/./parts").replace("/./", "/");
    assert_eq!(
        load(&path, &[]).unwrap_err().to_string(),
        format!("{part}:5: object.shape.box.size: unknown key; did you mean `size_m`?")
    );
    let not_text = write("latin.toml", b"schema = 1\nname = \"caf\xe9\"\n");
    assert_eq!(
        load(&not_text, &[]).unwrap_err().to_string(),
        format!("{not_text}:2: not UTF-8 text; save it as UTF-8")
    );
    let missing = folder.join("missing.toml").to_str().unwrap().to_string();
    assert_eq!(
        load(&missing, &[]).unwrap_err().to_string(),
        format!("{missing}: no such file; check the path")
    );
    let a_folder = folder.join("parts").to_str().unwrap().to_string();
    assert_eq!(
        load(&a_folder, &[]).unwrap_err().to_string(),
        format!("{a_folder}: it is a folder, not a file; name a .toml file")
    );
    let large = write("large.toml", &vec![b'#'; 33 << 20]);
    assert_eq!(
        load(&large, &[]).unwrap_err().to_string(),
        format!("{large}: 33 MiB are too many; check the path")
    );
    let many = write("many.toml", &vec![b','; 2_000_001]);
    assert_eq!(
        load(&many, &[]).unwrap_err().to_string(),
        format!("{many}: 2000001 values are too many; check the path")
    );
    let windows = write("windows.toml", text("cube").replace('\n', "\r\n").as_bytes());
    assert_eq!(load(&windows, &[]).map(|scene| scene.name), Ok("cube".into()));
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Ends of capsules are where the joints' own numbers put them, one joint after the other; friction is the least that is given.
#[test]
fn capsules_lie_where_their_links_do() {
    let capsule = |link: Option<&str>, friction| crate::file::CapsuleFile {
        link: link.map(str::to_owned),
        from_m: [0.003, -0.002, 0.001],
        to_m: [0.002, 0.004, 0.02],
        radius_m: 0.001,
        friction,
    };
    let mut file = load("allegro-like-prism-table", &[]).unwrap().file;
    file.hand.capsules = vec![
        capsule(None, None),
        capsule(Some("thumb-flex-1"), Some(0.2)),
        capsule(Some("ring-flex-3"), Some(2.0)),
    ];
    file.object.friction = Some(0.5);
    let scene = Scene::build(file.clone()).unwrap();
    let posture = posture(&scene.hand, &scene.start.angles_rad);
    for (k, capsule) in file.hand.capsules.iter().enumerate() {
        let ends_m = Part::Capsule(k).ends_m(&posture, &scene.capsules);
        for (end_m, own_m) in ends_m.into_iter().zip([capsule.from_m, capsule.to_m]) {
            let mut expected_m = Vector3::from(own_m);
            let mut link = capsule.link.clone();
            while let Some(name) = link {
                let index = file.hand.joints.iter().position(|joint| joint.name == name).unwrap();
                let joint = &file.hand.joints[index];
                let axis = nalgebra::Unit::new_normalize(Vector3::from(joint.axis));
                let turn = UnitQuaternion::from_axis_angle(&axis, scene.start.angles_rad[index]);
                let [roll, pitch, yaw] = joint.rotation_rpy_rad;
                let frame = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
                expected_m = Vector3::from(joint.offset_m) + frame * (turn * expected_m);
                link = joint.parent.clone();
            }
            assert!((end_m - expected_m).norm() < 1e-15, "{k}: {end_m} {expected_m}");
        }
    }
    assert_eq!(scene.capsule_friction, [0.5, 0.2, 0.5]);
    file.plant.friction = Some(0.7);
    assert_eq!(Scene::build(file.clone()).unwrap().capsule_friction, [0.7; 3]);
    file.plant.links = Some(false);
    let without = Scene::build(file).unwrap();
    assert!(without.capsules.is_empty() && without.capsule_friction.is_empty());
}

/// Open, a fingertip is 25 mm or more from the face that it touches in the scene of its hand; shaped for a grasp 10 to 15 mm, with the
/// fingertips' middle in that of the object where the faces allow it. A scene keeps the postures, whatever it is read from.
#[test]
fn postures_of_built_in_hands_are_open_and_shaped_for_their_scenes() {
    for (name, is_even) in [
        ("cube", true),
        ("two-finger-prism", true),
        ("four-finger-cube", true),
        ("allegro-like-prism", false),
        ("hand-arm", false),
    ] {
        let scene = load(name, &[]).unwrap();
        let postures = &scene.file.hand.postures;
        assert_eq!(HandModel::load(&scene.file.hand.name).unwrap().postures, *postures);
        assert_eq!(parse(&scene.effective_toml()).unwrap(), scene);
        let [open, preshape] = &postures[..] else { panic!("{postures:?}") };
        for (named, word, room_m) in [(open, "open", 0.025..0.061), (preshape, "preshape", 0.0099..0.0151)] {
            assert_eq!(named.name, word);
            let centres_m = posture(&scene.hand, &named.angles_rad).centres_m;
            let centres_m = &centres_m[..scene.contacts.len()];
            for (i, (contact, centre_m)) in scene.contacts.iter().zip(centres_m).enumerate() {
                let centre_m = scene.start.attitude.inverse() * (centre_m - scene.start.position_m);
                let away_m = -contact.frame.column(1).dot(&centre_m) - contact.distance_m;
                assert!(room_m.contains(&(away_m - scene.hand.radius_m(i))), "{name}, {word}: {away_m}");
            }
            let middle_m = centres_m.iter().sum::<Vector3<f64>>() / centres_m.len() as f64;
            assert!(!is_even || (middle_m - scene.start.position_m).norm() < 1e-4, "{name}: {middle_m}");
        }
    }
}

/// No capsule of a hand that is built in is in the way of another part, neither at the start of a scene nor at the nominal
/// posture or a named one; and no pair of parts that may touch is so in most of a thousand random postures, as parts are that always overlap.
#[test]
fn capsules_of_built_in_hands_are_apart() {
    let deepest_m = |file: &HandFile, hand: &Hand, angles_rad: &[f64]| {
        let (capsules, posture) = (file.capsules(hand), posture(hand, angles_rad));
        let has_capsule = |parts: &[Part; 2]| parts.iter().any(|part| matches!(part, Part::Capsule(_)));
        let pairs = pairs(hand, &capsules).into_iter().filter(has_capsule);
        let depths_m = pairs.map(|parts| (overlap_m(parts, hand, &posture, &capsules), parts));
        let (depth_m, parts) = depths_m.max_by(|a, b| a.0.total_cmp(&b.0)).expect("the hand has capsules");
        let [a, b] = parts.map(|part| file.part_in_words(part));
        println!("{}: {a} and {b} are {:.1} mm apart", file.name, -depth_m * 1e3);
        depth_m
    };
    for name in Scene::built_in() {
        let scene = load(name, &[]).unwrap();
        assert!(deepest_m(&scene.file.hand, &scene.hand, &scene.start.angles_rad) < 0.0, "{name}");
    }
    for name in HandFile::built_in() {
        let (file, hand, _) = HandFile::load_checked(name).unwrap();
        let nominal_rad: Vec<f64> = file.joints.iter().map(|joint| joint.nominal_rad).collect();
        let named = file.postures.iter().map(|posture| &posture.angles_rad);
        for angles_rad in named.chain([&nominal_rad]) {
            assert!(deepest_m(&file, &hand, angles_rad) < 0.0, "{name}");
        }
        let (mut numbers, capsules) = (Numbers(1), file.capsules(&hand));
        let mut crossings: Vec<_> = pairs(&hand, &capsules).into_iter().map(|parts| (parts, 0)).collect();
        for _ in 0..1000 {
            let angle = |(lower, upper): (f64, f64)| lower + (upper - lower) * numbers.unit();
            let angles_rad: Vec<f64> =
                (0..hand.joint_count()).map(|k| hand.range_rad(k)).map(angle).collect();
            let posture = posture(&hand, &angles_rad);
            for (parts, count) in &mut crossings {
                *count += usize::from(overlap_m(*parts, &hand, &posture, &capsules) > 0.0);
            }
        }
        let (parts, count) = crossings.iter().max_by_key(|(_, count)| count).unwrap();
        let [a, b] = parts.map(|part| file.part_in_words(part));
        println!("{name}: {} pairs; {a} and {b} cross in {count} of 1000 postures", crossings.len());
        assert!(*count < 500, "{name}");
    }
}
