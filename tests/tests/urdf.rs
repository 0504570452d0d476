//! Hands that are read from URDFs: against the same URDFs, link by link; and what is written, read again.

use blindgrasp::body::dynamics::{Body, JointMatrix, bias_torques, mass_matrix, place_bodies};
use blindgrasp::body::{Hand, MAX_JOINTS, Posture};
use blindgrasp::model::HandFile;
use blindgrasp_tests::numeric::Errors;
use blindgrasp_tests::random::Draw;
use blindgrasp_tests::urdf::RawRobot;
use nalgebra::{DMatrix, Matrix3, Vector3};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const GRAVITY_M_S2: Vector3<f64> = Vector3::new(1.0, -2.0, -9.81);

/// A folder that goes with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("blindgrasp-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder");
        Self(path)
    }

    /// The hand of a URDF and a hand's file.
    fn hand(&self, urdf: &str, toml: &str) -> (HandFile, Hand) {
        std::fs::write(self.0.join("hand.urdf"), urdf).expect("a file");
        let path = self.0.join("hand.toml");
        std::fs::write(&path, toml).expect("a file");
        match HandFile::load_checked(&path) {
            Ok((file, hand, _)) => (file, hand),
            Err(error) => panic!("{error}\n{toml}\n{urdf}"),
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A hand at some joint angles.
struct Placed<'a> {
    hand: &'a Hand,
    posture: Posture,
    bodies: [Body; MAX_JOINTS],
}

impl<'a> Placed<'a> {
    fn new(hand: &'a Hand, angles_rad: &[f64; MAX_JOINTS]) -> Self {
        let (mut posture, mut bodies) = (Posture::at_base(), [Body::NONE; MAX_JOINTS]);
        hand.forward_kinematics(angles_rad, &mut posture);
        place_bodies(hand, &posture, &mut bodies);
        Self { hand, posture, bodies }
    }

    fn mass(&self) -> DMatrix<f64> {
        let mut h: JointMatrix = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        mass_matrix(self.hand, &self.bodies, &mut h);
        DMatrix::from_fn(self.hand.joint_count(), self.hand.joint_count(), |j, k| h[j][k])
    }

    fn weight(&self) -> DMatrix<f64> {
        let torques = bias_torques(self.hand, &self.bodies, &[0.0; MAX_JOINTS], &GRAVITY_M_S2);
        DMatrix::from_column_slice(self.hand.joint_count(), 1, &torques[..self.hand.joint_count()])
    }
}

/// A random robot, and what of it is to be a hand.
struct Case {
    robot: RawRobot,
    base: usize,
    held: BTreeMap<usize, f64>,
    /// Links and offsets.
    tips: Vec<(usize, Vector3<f64>)>,
    /// The robot's joints that the hand has, in the tree's order.
    joints: Vec<usize>,
}

impl Case {
    /// Draws until there is something of a hand in it.
    fn draw(draw: &mut Draw) -> Self {
        loop {
            let count = draw.count(4..=40);
            let robot = RawRobot::random(draw, count);
            let base = if draw.chance(0.3) { draw.count(0..=count / 3) } else { 0 };
            let held: BTreeMap<usize, f64> = (0..count)
                .filter(|&k| match robot.joints[k].kind {
                    "fixed" => false,
                    "prismatic" => true,
                    _ => draw.chance(0.15),
                })
                .collect::<Vec<_>>()
                .into_iter()
                .map(|k| (k, draw.within(-1.0, 1.0)))
                .collect();
            let is_free = |k: &usize| robot.joints[*k].kind != "fixed" && !held.contains_key(k);
            let movable: Vec<usize> = (0..robot.links.len())
                .filter(|&link| robot.chain(base, link).is_some_and(|chain| chain.iter().any(is_free)))
                .collect();
            if movable.is_empty() {
                continue;
            }
            let tips: Vec<(usize, Vector3<f64>)> = (0..draw.count(2..=5))
                .map(|_| (movable[draw.count(0..=movable.len() - 1)], draw.vector(0.05)))
                .collect();
            let is_moving = |k: &usize| {
                is_free(k)
                    && tips.iter().any(|(link, _)| robot.chain(base, *link).unwrap_or_default().contains(k))
            };
            // Branch after branch, in the file's order.
            let (mut joints, mut ahead) = (Vec::new(), vec![base]);
            while let Some(link) = ahead.pop() {
                joints.extend(link.checked_sub(1).filter(|k| link != base && is_moving(k)));
                ahead.extend((0..count).rev().filter(|&k| robot.joints[k].parent == link).map(|k| k + 1));
            }
            if joints.len() <= MAX_JOINTS {
                return Self { robot, base, held, tips, joints };
            }
        }
    }

    fn toml(&self) -> String {
        let name = |k: &usize| &self.robot.joints[*k].name;
        let list = |wanted: bool| {
            let held =
                self.held.iter().filter(|(k, _)| (self.robot.joints[**k].kind == "prismatic") == wanted);
            held.map(|(k, position)| format!("{} = {position:?}", name(k))).collect::<Vec<_>>().join(", ")
        };
        let mut toml = format!(
            "schema = 1\nname = \"random\"\n[urdf]\nfile = \"hand.urdf\"\nbase = \"{}\"\nlocked_rad = {{ {} }}\n\
             locked_m = {{ {} }}\n[joint_defaults]\ndamping_gain_nm_s_rad = 1e-3\nencoder_counts_per_turn = 4096\n\
             [fingertip_defaults]\nradius_m = 0.01\nstiffness_n_m2 = 1e6\ndamping_n_s_m_per_m2 = 1.0\n\
             torsional_damping_nm_s_rad_per_m2 = 1e4\n",
            self.robot.links[self.base].name,
            list(false),
            list(true)
        );
        for (i, (link, offset)) in self.tips.iter().enumerate() {
            let (link, [x, y, z]) = (&self.robot.links[*link].name, <[f64; 3]>::from(*offset));
            let _ = writeln!(
                toml,
                "[[fingertip]]\nname = \"tip-{i}\"\nlink = \"{link}\"\noffset_m = [{x:?}, {y:?}, {z:?}]"
            );
        }
        toml
    }
}

/// Forward kinematics, Jacobians, mass matrix and gravity torques of a hand whose fixed parts are merged, against the robot as
/// it is written, every link by itself.
///
/// Tolerance: 1e-12, for lengths in m, entries of Jacobians, and of the mass matrix and the torques relative to the largest:
/// chains of up to forty joints, each of some twenty roundings of 1.1e-16 in either computation, over 4 m at most.
#[test]
fn merged_hands_move_as_the_robots_they_were() {
    let folder = Folder::new("urdf-merged");
    let mut draw = Draw::new(31);
    let [mut place, mut turn, mut jacobian, mut inertia, mut weight] = [Errors::new(); 5];
    let (mut merged, mut kept) = (0, 0);
    for _ in 0..1000 {
        let case = Case::draw(&mut draw);
        let (robot, base) = (&case.robot, case.base);
        let (file, hand) = folder.hand(&robot.text(), &case.toml());
        let names: Vec<&str> = file.joints.iter().map(|joint| joint.name.as_str()).collect();
        let expected: Vec<&str> = case.joints.iter().map(|&k| robot.joints[k].name.as_str()).collect();
        assert_eq!(names, expected);
        kept += names.len();
        merged += robot.joints.len() - names.len();

        let zero = Placed::new(&hand, &[0.0; MAX_JOINTS]);
        let raw_zero = robot.poses(base, &case.held);
        let angles: [f64; MAX_JOINTS] = draw.joints(3.0);
        let mut positions = case.held.clone();
        positions.extend(case.joints.iter().copied().zip(angles));
        let here = Placed::new(&hand, &angles);
        let raw = robot.poses(base, &positions);
        for (i, (link, offset)) in case.tips.iter().enumerate() {
            let centre = raw.origins_m[*link] + raw.attitudes[*link] * offset;
            place.add((here.posture.centres_m[i] - centre).norm());
            // Frames may differ by a constant, turns may not.
            let ours = here.posture.attitudes[i] * zero.posture.attitudes[i].transpose();
            turn.add((ours - raw.attitudes[*link] * raw_zero.attitudes[*link].transpose()).norm());
            let (linear, angular) = hand.jacobians(&here.posture, i);
            let (raw_linear, raw_angular) = robot.jacobians(base, &raw, &case.joints, *link, &centre);
            jacobian.add((linear.columns(0, names.len()) - raw_linear).norm());
            jacobian.add((angular.columns(0, names.len()) - raw_angular).norm());
        }
        let (mass, torques) = robot.dynamics(base, &raw, &case.joints, &GRAVITY_M_S2);
        inertia.add((here.mass() - &mass).amax() / mass.amax().max(1e-6));
        weight.add((here.weight() - &torques).amax() / torques.amax().max(1e-6));
    }
    println!("{kept} joints kept, {merged} merged");
    println!(
        "fingertips: {place}; turns: {turn}; Jacobians: {jacobian}; mass matrix: {inertia}; weight: {weight}"
    );
    for errors in [place, turn, jacobian, inertia, weight] {
        assert!(errors.largest() < 1e-12);
    }
}

/// The hand's file of what was exported: what URDF can't say, from the hand itself.
fn reimport(file: &HandFile) -> String {
    let mut toml = String::from("schema = 1\nname = \"again\"\n[urdf]\nfile = \"hand.urdf\"\n");
    for joint in &file.joints {
        let _ = writeln!(
            toml,
            "[[joint]]\nname = {:?}\nnominal_rad = {:?}\ndamping_gain_nm_s_rad = {:?}\nencoder_counts_per_turn = {:?}\n\
             presliding_rad = {:?}\npresliding_damping_nm_s_rad = {:?}",
            joint.name,
            joint.nominal_rad,
            joint.damping_gain_nm_s_rad,
            joint.encoder_counts_per_turn,
            joint.presliding_rad,
            joint.presliding_damping_nm_s_rad
        );
    }
    for tip in &file.fingertips {
        let _ = writeln!(
            toml,
            "[[fingertip]]\nname = {:?}\nlink = \"{}-tip\"\noffset_m = [0.0, 0.0, 0.0]\nradius_m = {:?}\n\
             stiffness_n_m2 = {:?}\ndamping_n_s_m_per_m2 = {:?}\ntorsional_damping_nm_s_rad_per_m2 = {:?}",
            tip.name,
            tip.name,
            tip.radius_m,
            tip.stiffness_n_m2,
            tip.damping_n_s_m_per_m2,
            tip.torsional_damping_nm_s_rad_per_m2
        );
    }
    toml
}

/// Exports a hand, reads it again, and compares: everything that URDF can say is the same to the bit, and so is the posture;
/// the mass matrix differs by what stands for nothing, at most 1.1e-14 kg m^2 and 2e-15 kg a link.
fn round_trip(folder: &Folder, file: &HandFile, hand: &Hand, draw: &mut Draw) -> f64 {
    let (again_file, again) = folder.hand(&file.to_urdf(), &reimport(file));
    for (ours, theirs) in file.joints.iter().zip(&again_file.joints) {
        assert_eq!((&ours.name, &ours.parent), (&theirs.name, &theirs.parent));
        assert_eq!((ours.offset_m, ours.rotation_rpy_rad), (theirs.offset_m, theirs.rotation_rpy_rad));
        assert_eq!((ours.limits_rad, ours.nominal_rad), (theirs.limits_rad, theirs.nominal_rad));
        assert_eq!(ours.torque_limit_nm, theirs.torque_limit_nm);
        assert_eq!(ours.speed_limit_rad_s, theirs.speed_limit_rad_s);
        assert_eq!(ours.viscous_friction_nm_s_rad, theirs.viscous_friction_nm_s_rad);
        assert_eq!(ours.coulomb_friction_nm, theirs.coulomb_friction_nm);
    }
    assert_eq!(hand.joint_count(), again.joint_count());
    let mut worst: f64 = 0.0;
    for _ in 0..20 {
        let angles: [f64; MAX_JOINTS] = draw.joints(3.0);
        let (here, there) = (Placed::new(hand, &angles), Placed::new(&again, &angles));
        for i in 0..hand.fingertip_count() {
            worst = worst.max((here.posture.centres_m[i] - there.posture.centres_m[i]).amax());
            let turn: Matrix3<f64> = here.posture.attitudes[i] - there.posture.attitudes[i];
            worst = worst.max(turn.amax());
        }
        worst = worst.max((here.mass() - there.mass()).amax()).max((here.weight() - there.weight()).amax());
    }
    worst
}

/// Tolerance: 1e-12, see [`round_trip`]; axes that are no unit vectors to the bit are divided by their length once more.
#[test]
fn exported_hands_are_the_same_when_read_again() {
    let folder = Folder::new("urdf-round-trip");
    let mut draw = Draw::new(32);
    let mut worst: f64 = 0.0;
    for name in HandFile::built_in() {
        let (file, hand, _) = HandFile::load_checked(name).expect("a hand");
        worst = worst.max(round_trip(&folder, &file, &hand, &mut draw));
    }
    for _ in 0..200 {
        let case = Case::draw(&mut draw);
        let (file, hand) = folder.hand(&case.robot.text(), &case.toml());
        worst = worst.max(round_trip(&folder, &file, &hand, &mut draw));
    }
    println!("largest difference after a round trip: {worst:.2e}");
    assert!(worst < 1e-12);
}

/// A name that has no business in XML.
#[test]
fn names_survive_the_export() {
    let folder = Folder::new("urdf-names");
    let (mut file, _, _) = HandFile::load_checked("two-finger").expect("a hand");
    let name = "a<b>&\"c\" d'e";
    let old = std::mem::replace(&mut file.joints[0].name, name.into());
    file.joints.iter_mut().filter(|joint| joint.parent.as_ref() == Some(&old)).for_each(|joint| {
        joint.parent = Some(name.into());
    });
    // Names that the export would have used itself.
    file.joints[1].name = "base".into();
    file.joints[2].parent = Some("base".into());
    file.joints[2].name = format!("{name}-link");
    file.joints[3].parent = Some(format!("{name}-link"));
    let (again, _) = folder.hand(&file.to_urdf(), &reimport(&file));
    let names = |file: &HandFile| file.joints.iter().map(|joint| joint.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&file), names(&again));
    assert!(Path::new(&folder.0).exists());
}
