//! Dynamics of the hand and of the free object: identities between algorithms, and motions that conserve something.

use blindgrasp::body::dynamics::{Body, JointMatrix, JointVector, bias_torques, mass_matrix, place_bodies};
use blindgrasp::body::polyhedron::Polyhedron;
use blindgrasp::body::{Hand, MAX_JOINTS, Posture};
use blindgrasp::plant::integrator::Plant;
use blindgrasp::plant::{Motion, ObjectModel, PlantModel};
use blindgrasp_shared::math::Real;
use blindgrasp_tests::description::{Description, axial};
use blindgrasp_tests::grasps::GRAVITY_M_S2;
use blindgrasp_tests::hands::three_finger;
use blindgrasp_tests::numeric::{Errors, derivative, order};
use blindgrasp_tests::random::Draw;
use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};
use std::f64::consts::PI;

/// Random hands that the host can load, with and without a trunk in turn.
fn random_hands(seed: u64, count: usize) -> impl Iterator<Item = (Draw, Description, Hand)> {
    let mut draw = Draw::new(seed);
    (0..count).map(move |k| {
        let description = draw.hand_up_to(MAX_JOINTS, k % 2 == 0);
        let hand = description.hand();
        (Draw::new(seed + 1 + k as u64), description, hand)
    })
}

/// The hand's posture and bodies for some joint angles.
fn placed(hand: &Hand, angles_rad: &JointVector) -> (Posture, [Body; MAX_JOINTS]) {
    let (mut posture, mut bodies) = (Posture::at_base(), [Body::NONE; MAX_JOINTS]);
    hand.forward_kinematics(angles_rad, &mut posture);
    place_bodies(hand, &posture, &mut bodies);
    (posture, bodies)
}

fn mass(hand: &Hand, angles_rad: &JointVector) -> DMatrix<f64> {
    let mut h: JointMatrix = [[0.0; MAX_JOINTS]; MAX_JOINTS];
    let bodies = placed(hand, angles_rad).1;
    mass_matrix(hand, &bodies, &mut h);
    DMatrix::from_fn(hand.joint_count(), hand.joint_count(), |j, k| h[j][k])
}

fn bias(
    hand: &Hand,
    angles_rad: &JointVector,
    speeds_rad_s: &JointVector,
    gravity_m_s2: &Vector3<f64>,
) -> DVector<f64> {
    let bodies = placed(hand, angles_rad).1;
    let torques = bias_torques(hand, &bodies, speeds_rad_s, gravity_m_s2);
    DVector::from_column_slice(&torques[..hand.joint_count()])
}

fn along(angles_rad: &JointVector, speeds_rad_s: &JointVector, time_s: f64) -> JointVector {
    std::array::from_fn(|k| angles_rad[k] + time_s * speeds_rad_s[k])
}

fn unit(k: usize) -> JointVector {
    std::array::from_fn(|j| if j == k { 1.0 } else { 0.0 })
}

/// Kinetic energy from how the description's mass centres and attitudes move: differences of forward kinematics only.
fn kinetic_energy(description: &Description, angles_rad: &JointVector, speeds_rad_s: &JointVector) -> f64 {
    const STEP_S: f64 = 1.0 / 1024.0;
    let at = |time: f64| description.placed(&along(angles_rad, speeds_rad_s, time));
    let here = at(0.0);
    let mut energy = 0.0;
    for (k, joint) in description.joints.iter().enumerate() {
        let velocity = derivative(STEP_S, |time| at(time).mass_centres_m[k]);
        let turning = derivative(STEP_S, |time| at(time).attitudes[k]) * here.attitudes[k].transpose();
        let spin = axial(&turning);
        energy += 0.5 * joint.link.mass_kg * velocity.norm_squared();
        energy += 0.5 * spin.dot(&(here.inertias_kg_m2[k] * spin));
    }
    energy
}

/// `H` is symmetric to the last bit (one entry is written to both places), positive definite, and the Hessian of the
/// kinetic energy, which is a quadratic form of the speeds: `H_jk = T(e_j + e_k) - T(e_j) - T(e_k)`.
///
/// Tolerance: 1e-10 of the largest entry of `H`. At two joints of unit speed the difference quotients of the positions
/// err by `2^5 step^4 / 480` = 6e-14 of the radius for truncation and about 1e-12 of the reach for rounding.
#[test]
fn mass_matrix_is_the_hessian_of_kinetic_energy() {
    let mut errors = Errors::new();
    let mut least: f64 = f64::INFINITY;
    for (mut draw, description, hand) in random_hands(100, 60) {
        let angles = draw.joints::<MAX_JOINTS>(PI);
        let h = mass(&hand, &angles);
        let n = hand.joint_count();
        let alone: Vec<f64> = (0..n).map(|k| kinetic_energy(&description, &angles, &unit(k))).collect();
        for j in 0..n {
            for k in 0..=j {
                assert_eq!(h[(j, k)], h[(k, j)], "symmetry");
                let both = std::array::from_fn(|l| unit(j)[l] + unit(k)[l]);
                let hessian = kinetic_energy(&description, &angles, &both) - alone[j] - alone[k];
                errors.add((h[(j, k)] - hessian) / h.amax());
            }
        }
        let eigenvalues = h.symmetric_eigenvalues();
        least = least.min(eigenvalues.min() / eigenvalues.max());
    }
    println!("H against the Hessian of K, relative: {errors}; least eigenvalue over largest {least:.1e}");
    assert!(errors.largest() < 1e-10);
    assert!(least > 0.0);
}

/// The velocity products of [`bias_torques`] are `C dq` with the `C` of Christoffel's symbols of `H`, for which
/// `dH/dt - 2 C` is skew; so their power is half of `dq^T dH/dt dq`, with `dH/dt` along the motion itself.
///
/// Tolerances, in units of `|H| s^2` with `s = sum|dq|`, the most that `C dq` can be: an entry of `H` is a polynomial
/// of second degree in the sine and cosine of each angle, so that its fifth derivative along one joint is at most
/// `2^5 |H|` and truncation `32 step^4 / 480` = 1e-12; rounding is 1e-12 too: 1e-11 for `C dq`. Along the motion all
/// joints move at once; with `step * s` = 0.01 truncation is at most `32 * 0.01^4 / 480` = 7e-10: 1e-9 for `dH/dt`.
#[test]
fn velocity_products_are_those_of_christoffel() {
    const STEP_RAD: f64 = 1.0 / 512.0;
    let (mut products, mut powers, mut skews) = (Errors::new(), Errors::new(), Errors::new());
    for (mut draw, _, hand) in random_hands(200, 60) {
        let n = hand.joint_count();
        let angles = draw.joints::<MAX_JOINTS>(PI);
        let mut speeds = draw.joints::<MAX_JOINTS>(3.0);
        speeds[n..].fill(0.0);
        let slopes: Vec<DMatrix<f64>> =
            (0..n).map(|k| derivative(STEP_RAD, |by| mass(&hand, &along(&angles, &unit(k), by)))).collect();
        let mut c = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..n {
                for k in 0..n {
                    let symbol = slopes[k][(i, j)] + slopes[j][(i, k)] - slopes[i][(j, k)];
                    c[(i, j)] += 0.5 * symbol * speeds[k];
                }
            }
        }
        let v = DVector::from_column_slice(&speeds[..n]);
        let torques = bias(&hand, &angles, &speeds, &Vector3::zeros());
        let sum: f64 = speeds.iter().map(|speed| speed.abs()).sum();
        let scale = mass(&hand, &angles).amax() * sum * sum;
        products.add((&c * &v - &torques).amax() / scale);
        let rate = derivative(0.01 / sum, |time| mass(&hand, &along(&angles, &speeds, time)));
        powers.add((v.dot(&(&rate * &v)) - 2.0 * v.dot(&torques)) / (scale * sum));
        let twist = rate - c * 2.0;
        skews.add((&twist + twist.transpose()).amax() / (scale / sum));
    }
    println!("C dq: {products}; power: {powers}; dH/dt - 2C plus its transpose: {skews}");
    assert!(products.largest() < 1e-11);
    assert!(powers.largest() < 1e-9);
    assert!(skews.largest() < 1e-9);
}

/// Gravity torques are the gradient of the potential energy, in both algorithms that compute them.
///
/// Tolerance: 1e-11 of the hand's weight times a metre: differences as above.
#[test]
fn gravity_torques_are_the_gradient_of_potential_energy() {
    let mut errors = Errors::new();
    for (mut draw, description, hand) in random_hands(300, 200) {
        let angles = draw.joints::<MAX_JOINTS>(PI);
        let gravity = draw.vector(9.81);
        let recursive = bias(&hand, &angles, &[0.0; MAX_JOINTS], &gravity);
        let direct = hand.gravity_torques(&placed(&hand, &angles).0, &gravity);
        let mass: f64 = description.joints.iter().map(|joint| joint.link.mass_kg).sum();
        for k in 0..hand.joint_count() {
            let gradient = derivative(1.0 / 512.0, |by| {
                let placed = description.placed(&along(&angles, &unit(k), by));
                description.weight_potential_j(&placed, &gravity)
            });
            errors.add((recursive[k] - gradient) / (mass * gravity.norm()));
            errors.add((direct[k] - gradient) / (mass * gravity.norm()));
        }
    }
    println!("gravity torques, relative: {errors}");
    assert!(errors.largest() < 1e-11);
}

/// A hand and an object that do not touch.
fn apart(description: &Description, object: ObjectModel, motion: Motion, substep_s: f64) -> Plant {
    let hand: Hand = description.hand();
    let model = PlantModel {
        fingertips: vec![],
        friction: vec![Default::default(); hand.joint_count()],
        rotor_inertia_kg_m2: Vec::new(),
        joint_limits: false,
        hand,
        object,
        faces: vec![],
        hand_gravity_m_s2: GRAVITY_M_S2,
        object_gravity_m_s2: GRAVITY_M_S2,
        pushes: Vec::new(),
    };
    Plant::new(model, motion, substep_s).expect("it has equations of motion")
}

/// An object whose three moments of inertia differ.
fn brick() -> ObjectModel {
    let shape = Polyhedron::cuboid([0.03, 0.05, 0.08]).expect("it is a cuboid");
    let inertia_kg_m2 = shape.mass_properties().inertia_per_kg_m2 * 0.1;
    ObjectModel { shape, mass_kg: 0.1, inertia_kg_m2 }
}

/// Advances a plant without torques and shows it solved at the beginning of each step but the first, where velocities
/// are still those given.
fn swing(plant: &mut Plant, steps: usize, mut each: impl FnMut(usize, &Plant)) {
    for step in 0..steps {
        plant.solve(&[0.0; MAX_JOINTS]).expect("nothing can be lost");
        if step > 0 {
            each(step, plant);
        }
        plant.advance();
    }
}

fn energy(description: &Description, plant: &Plant) -> f64 {
    let angles = &plant.motion().angles_rad[..description.joints.len()];
    plant.kinetic_energy_j() + description.weight_potential_j(&description.placed(angles), &GRAVITY_M_S2)
}

/// The hand of the paper swings from rest under its own weight, without damping: a chaotic motion of up to 40 rad/s,
/// whose energy is constant. The integrator is of second order, so that the energy's error falls by four when the
/// step is halved.
///
/// Tolerance: order at least 1.9 over a factor of four in the step.
#[test]
fn a_swinging_hand_keeps_its_energy_to_second_order() {
    let description = three_finger();
    let mut start = [0.0; MAX_JOINTS];
    for k in 0..description.joints.len() {
        start[k] = [0.3, 1.2, 0.4, 0.2][k % 4];
    }
    let motion = Motion::at_rest(start, Vector3::zeros(), UnitQuaternion::identity());
    let mut errors = vec![];
    for halvings in 0..4 {
        let h = 2e-4 / f64::from(1 << halvings);
        let mut plant = apart(&description, brick(), motion, h);
        // The object falls beside; its energy is not the hand's.
        let own = |plant: &Plant| {
            energy(&description, plant) - 0.5 * 0.1 * plant.motion().velocity_m_s.norm_squared()
        };
        let initial = own(&plant);
        let (mut worst, mut fastest, mut most): (f64, f64, f64) = (0.0, 0.0, 0.0);
        swing(&mut plant, 2500 << halvings, |_, plant| {
            worst = worst.max((own(plant) - initial).abs());
            most = most.max(plant.kinetic_energy_j());
            fastest = plant.motion().speeds_rad_s.iter().fold(fastest, |a, v| a.max(v.abs()));
        });
        println!("h {h:.2e} s: energy off by {worst:.2e} J at most; speeds up to {fastest:.0} rad/s");
        assert!(fastest > 10.0, "it should swing");
        errors.push(worst);
    }
    let order = order(errors[1], errors[3]) / 2.0;
    println!("order {order:.2}");
    assert!(order > 1.9);
}

/// A free object falls on a parabola, which the leapfrog follows exactly.
///
/// Tolerance: 3e-11 m/s and m over a second, 10,000 steps. Each adds the same number to velocities of up to 16 m/s,
/// so that rounding, half a last place of 1.8e-15 m/s in the solution and twice that in its reflection, may go in one
/// direction throughout: 10,000 * 1.5 * 1.8e-15 m/s = 2.7e-11 m/s, and half of that times a second.
#[test]
fn a_falling_object_matches_the_closed_form() {
    const STEP_S: f64 = 1e-4;
    let mut motion =
        Motion::at_rest([0.0; MAX_JOINTS], Vector3::new(0.1, -0.2, 0.3), UnitQuaternion::identity());
    motion.velocity_m_s = Vector3::new(1.0, -0.5, 2.0);
    let start = motion;
    let mut plant = apart(&three_finger(), brick(), motion, STEP_S);
    let (mut positions, mut velocities) = (Errors::new(), Errors::new());
    swing(&mut plant, 10_000, |step, plant| {
        let t = step as f64 * STEP_S;
        let position = start.position_m + start.velocity_m_s * t + GRAVITY_M_S2 * (0.5 * t * t);
        positions.add((plant.motion().position_m - position).norm());
        velocities.add((plant.motion().velocity_m_s - start.velocity_m_s - GRAVITY_M_S2 * t).norm());
    });
    println!("fall: position {positions} m; velocity {velocities} m/s");
    assert!(positions.largest() < 3e-11);
    assert!(velocities.largest() < 3e-11);
}

/// Angular momentum of a plant's object, and its kinetic energy of rotation.
fn rotation(plant: &Plant) -> (Vector3<f64>, f64) {
    let motion = plant.motion();
    let r: Matrix3<f64> = motion.attitude.to_rotation_matrix().into_inner();
    let momentum = r * plant.model().object.inertia_kg_m2 * r.transpose() * motion.spin_rad_s;
    (momentum, 0.5 * momentum.dot(&motion.spin_rad_s))
}

/// A free top that spins near its unstable axis tumbles, but keeps its angular momentum and its energy.
///
/// Tolerances: the momentum to 1e-11 of itself: 20,000 steps at least, each of which rounds a few times by 1.1e-16
/// (`I I^-1 L`), random in sign or, at worst, 1e-15 a step in one direction. The energy to second order, at least
/// 1.9.
#[test]
fn torque_free_rotation_keeps_momentum_and_energy() {
    let mut motion = Motion::at_rest(
        [0.0; MAX_JOINTS],
        Vector3::zeros(),
        UnitQuaternion::from_euler_angles(0.3, -0.7, 1.1),
    );
    motion.spin_rad_s = motion.attitude * Vector3::new(0.1, 20.0, 0.2);
    let mut errors = vec![];
    for halvings in 0..3 {
        let h = 4e-4 / f64::from(1 << halvings);
        let mut plant = apart(&three_finger(), brick(), motion, h);
        let (momentum, energy) = rotation(&plant);
        let (mut momenta, mut energies) = (Errors::new(), Errors::new());
        let mut least: f64 = 1.0;
        swing(&mut plant, 5000 << halvings, |_, plant| {
            let (now, energy_now) = rotation(plant);
            momenta.add((now - momentum).norm() / momentum.norm());
            energies.add(energy_now / energy - 1.0);
            let axis = plant.motion().attitude * Vector3::y();
            least = least.min(axis.dot(&momentum) / momentum.norm());
        });
        println!("h {h:.0e} s: momentum {momenta}; energy {energies}");
        assert!(least < -0.9, "it should tumble, {least}");
        assert!(momenta.largest() < 1e-11);
        errors.push(energies.largest());
    }
    let order = order(errors[0], errors[2]) / 2.0;
    println!("order of the energy {order:.2}");
    assert!(order > 1.9);
}

/// A pendulum of one joint has a period in closed form: `4 sqrt(I / m g l) K(sin(a / 2))`.
///
/// Tolerance: second order; at a step of 1e-4 s, one per million: `(omega h)^2 / 24` = 5e-8 for the small swing at
/// `omega` = 11 rad/s, ten times that for the large one.
#[test]
fn a_pendulum_has_its_period() {
    const STEP_S: f64 = 1e-4;
    const AMPLITUDE_RAD: f64 = 2.0;
    let mut description = three_finger();
    // Two pendulums, because a hand has at least two fingertips: rods of 0.1 m that swing about y, with zero downwards.
    description.joints.truncate(2);
    description.fingertips.truncate(2);
    for (k, joint) in description.joints.iter_mut().enumerate() {
        joint.parent = None;
        joint.offset_m = Vector3::y() * (0.3 * k as f64);
        joint.attitude = Matrix3::identity();
        joint.axis = Vector3::y();
        joint.link.mass_kg = 0.2;
        joint.link.mass_centre_m = Vector3::new(0.0, 0.0, -0.05);
        joint.link.inertia_kg_m2 = Matrix3::from_diagonal(&Vector3::new(2e-4, 1.5e-4, 1e-4));
        description.fingertips[k].link = k;
    }
    let mut angles = [0.0; MAX_JOINTS];
    angles[0] = AMPLITUDE_RAD;
    let motion = Motion::at_rest(angles, Vector3::zeros(), UnitQuaternion::identity());
    let mut plant = apart(&description, brick(), motion, STEP_S);
    let mut crossings = vec![];
    let mut before = AMPLITUDE_RAD;
    swing(&mut plant, 30_000, |step, plant| {
        let (angle, speed) = (plant.motion().angles_rad[0], plant.motion().speeds_rad_s[0]);
        if before > 0.0 && angle <= 0.0 {
            crossings.push(step as f64 * STEP_S - angle / speed);
        }
        before = angle;
    });
    let swings = (crossings.len() - 1) as f64;
    let period = (crossings[crossings.len() - 1] - crossings[0]) / swings;
    // K by the arithmetic-geometric mean.
    let (mut a, mut b) = (1.0, (AMPLITUDE_RAD / 2.0).sine_cosine().1);
    for _ in 0..10 {
        (a, b) = (0.5 * (a + b), (a * b).square_root());
    }
    let inertia: f64 = 1.5e-4 + 0.2 * 0.05 * 0.05;
    let expected = 2.0 * PI / a * (inertia / (0.2 * 9.81 * 0.05)).square_root();
    println!(
        "period {period:.9} s over {swings} swings, closed form {expected:.9} s: {:.1e}",
        period / expected - 1.0
    );
    assert!((period / expected - 1.0).abs() < 1e-6);
}
