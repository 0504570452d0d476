//! Rolling constraints and contact forces: against material points followed from scratch, against the equations of
//! motion (Eqs. 19-21), against a dense system of them; and a held object that stays where it is.

use blindgrasp::body::JointFriction;
use blindgrasp::body::dynamics::{Body, JointVector, bias_torques, mass_matrix, place_bodies};
use blindgrasp::body::{MAX_JOINTS, Posture};
use blindgrasp::plant::contact::Contact;
use blindgrasp::plant::integrator::Plant;
use blindgrasp::plant::{ContactForce, Motion};
use blindgrasp_tests::grasps::{FRICTION, Grasp, cube, prism};
use blindgrasp_tests::hands::{on_arm, on_forked_arm, three_finger};
use blindgrasp_tests::numeric::{Errors, order};
use blindgrasp_tests::random::Draw;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Cube and prism, held by the hand and by the hand on arms.
fn grasps() -> Vec<(&'static str, Grasp)> {
    vec![
        ("cube", Grasp::new(three_finger(), &cube())),
        ("prism", Grasp::new(three_finger(), &prism())),
        ("cube on an arm", Grasp::new(on_arm(&three_finger()), &cube())),
        ("prism on an arm", Grasp::new(on_arm(&three_finger()), &prism())),
        ("prism on a forked arm", Grasp::new(on_forked_arm(&three_finger()), &prism())),
    ]
}

/// A motion near a grasp's start: joints and object moved a little, with any velocities.
fn disturbed(grasp: &Grasp, draw: &mut Draw, shift: f64, speed: f64) -> Motion {
    let mut motion = grasp.start;
    for k in 0..grasp.description.joints.len() {
        motion.angles_rad[k] += draw.within(-shift, shift);
        motion.speeds_rad_s[k] = draw.within(-speed, speed);
    }
    motion.position_m += draw.vector(0.1 * shift);
    motion.velocity_m_s = draw.vector(0.1 * speed);
    motion.spin_rad_s = draw.vector(speed);
    motion
}

/// Largest difference along the face between the velocities of the two material points at each point of contact, m/s:
/// the one of the fingertip's link and the one of the object.
fn slip_from_scratch(grasp: &Grasp, motion: &Motion) -> f64 {
    let hand = &grasp.description;
    let placed = hand.placed(&motion.angles_rad[..hand.joints.len()]);
    let mut largest: f64 = 0.0;
    for (i, face) in grasp.model.faces.iter().enumerate() {
        let face = &grasp.model.object.shape.faces[face.face];
        let outwards = motion.attitude * face.normal;
        // The point of contact is the foot of the fingertip's centre on the face.
        let height = outwards.dot(&(placed.centres_m[i] - motion.position_m)) - face.distance_m;
        let point = placed.centres_m[i] - outwards * height;
        let (tip, _) = hand.velocity(&placed, hand.fingertips[i].link, &point, &motion.speeds_rad_s);
        let object = motion.velocity_m_s + motion.spin_rad_s.cross(&(point - motion.position_m));
        let slip = object - tip;
        largest = largest.max((slip - outwards * outwards.dot(&slip)).norm());
    }
    largest
}

/// The rolling constraints hold at every step: `|P v|` of the plant, and the velocities of both material points,
/// computed from the description alone.
///
/// Tolerance: 1e-10 m/s, for speeds up to 0.1 m/s.
#[test]
fn fingertips_roll_without_slip() {
    for (name, grasp) in grasps() {
        let (mut pfaffian, mut points, mut fastest) = (Errors::new(), Errors::new(), 0.0_f64);
        let mut plant = grasp.plant(1e-4);
        grasp.run(&mut plant, 20_000, |plant| {
            pfaffian.add(plant.slip_m_s());
            points.add(slip_from_scratch(&grasp, plant.motion()));
            fastest = fastest.max(plant.motion().spin_rad_s.norm());
        });
        println!("{name}: |P v| {pfaffian}; material points {points} m/s; spin up to {fastest:.2} rad/s");
        assert!(fastest > 0.1, "it should roll");
        assert!(pfaffian.largest() <= 1e-10);
        assert!(points.largest() <= 1e-10);
    }
}

/// Velocities that break the constraints are projected in the first step.
#[test]
fn random_velocities_are_projected_onto_the_constraints() {
    let mut draw = Draw::new(10);
    for (name, grasp) in grasps() {
        let (mut pfaffian, mut points, mut given) = (Errors::new(), Errors::new(), Errors::new());
        for _ in 0..20 {
            let motion = disturbed(&grasp, &mut draw, 1e-3, 0.5);
            given.add(slip_from_scratch(&grasp, &motion));
            let mut plant =
                Plant::new(grasp.model.clone(), motion, 1e-4).expect("it has equations of motion");
            let mut step = 0;
            grasp.run(&mut plant, 100, |plant| {
                if step > 0 {
                    pfaffian.add(plant.slip_m_s());
                    points.add(slip_from_scratch(&grasp, plant.motion()));
                }
                step += 1;
            });
        }
        println!("{name}: slip given {given}; |P v| {pfaffian}; material points {points} m/s");
        assert!(pfaffian.largest() <= 1e-10);
        assert!(points.largest() <= 1e-10);
    }
}

/// The equations of motion of hand and object at one instant, dense, as Eqs. 19-23 have them. Velocities are `(dq,
/// dx, w)`.
struct Equations {
    /// `G = diag(H, M, I)`.
    mass: DMatrix<f64>,
    /// Coriolis, centrifugal and gravity torques of the hand; the object's `w x I w`.
    bias: DVector<f64>,
    /// `P`, Eq. 10: two rows a contact, X and Z.
    pfaffian: DMatrix<f64>,
    /// One row a contact: the rate of indentation, the time derivative of Eq. 5. `Q^T f` are the normal forces of
    /// Eqs. 19-21.
    indentation: DMatrix<f64>,
    /// One row a contact: `C_Y . (w - w_i)` of Eq. 15.
    torsion: DMatrix<f64>,
    contacts: Vec<Contact>,
}

/// Velocities of a motion as one vector.
fn velocities(motion: &Motion, joints: usize) -> DVector<f64> {
    let (x, w) = (&motion.velocity_m_s, &motion.spin_rad_s);
    DVector::from_iterator(
        joints + 6,
        motion.speeds_rad_s[..joints].iter().chain(x.iter()).chain(w.iter()).copied(),
    )
}

impl Equations {
    fn of(grasp: &Grasp, motion: &Motion) -> Self {
        let (model, n) = (&grasp.model, grasp.description.joints.len());
        let (mut posture, mut bodies) = (Posture::at_base(), [Body::NONE; MAX_JOINTS]);
        let mut h = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        model.hand.forward_kinematics(&motion.angles_rad, &mut posture);
        place_bodies(&model.hand, &posture, &mut bodies);
        mass_matrix(&model.hand, &bodies, &mut h);
        let hand_bias = bias_torques(&model.hand, &bodies, &motion.speeds_rad_s, &model.hand_gravity_m_s2);

        let r: Matrix3<f64> = motion.attitude.to_rotation_matrix().into_inner();
        let inertia = r * model.object.inertia_kg_m2 * r.transpose();
        let mut mass = DMatrix::zeros(n + 6, n + 6);
        mass.view_mut((0, 0), (n, n)).copy_from(&DMatrix::from_fn(n, n, |j, k| h[j][k]));
        mass.view_mut((n, n), (3, 3)).fill_diagonal(model.object.mass_kg);
        mass.view_mut((n + 3, n + 3), (3, 3)).copy_from(&inertia);
        let mut bias = DVector::zeros(n + 6);
        bias.rows_mut(0, n).copy_from_slice(&hand_bias[..n]);
        let w = motion.spin_rad_s;
        bias.rows_mut(n + 3, 3).copy_from(&w.cross(&(inertia * w)));

        let count = model.faces.len();
        let [mut pfaffian, mut indentation, mut torsion] =
            [2, 1, 1].map(|rows| DMatrix::zeros(rows * count, n + 6));
        let placed = grasp.description.placed(&motion.angles_rad[..n]);
        let mut contacts = vec![];
        for (i, (face, tip)) in model.faces.iter().zip(&model.fingertips).enumerate() {
            let centre = placed.centres_m[i];
            let contact = Contact::at(tip, face, &centre, &motion.position_m, &r);
            // Eq. 3, 5, 10 and 11, from the description.
            let frame = r * face.frame;
            let [cx, cy, cz] = [0, 1, 2].map(|k| frame.column(k).into_owned());
            let lever = motion.position_m - centre;
            let rho = tip.radius_m - (tip.radius_m + face.distance_m - cy.dot(&lever));
            for k in grasp.description.chain(grasp.description.fingertips[i].link) {
                let j_omega = placed.axes[k];
                let j = j_omega.cross(&(centre - placed.origins_m[k]));
                pfaffian[(2 * i, k)] = rho * cz.dot(&j_omega) - cx.dot(&j);
                pfaffian[(2 * i + 1, k)] = -rho * cx.dot(&j_omega) - cz.dot(&j);
                indentation[(i, k)] = cy.dot(&j);
                torsion[(i, k)] = -cy.dot(&j_omega);
            }
            let set = |m: &mut DMatrix<f64>, row: usize, x: Vector3<f64>, w: Vector3<f64>| {
                m.view_mut((row, n), (1, 3)).copy_from(&x.transpose());
                m.view_mut((row, n + 3), (1, 3)).copy_from(&w.transpose());
            };
            set(&mut pfaffian, 2 * i, cx, cx.cross(&lever) - cz * rho);
            set(&mut pfaffian, 2 * i + 1, cz, cz.cross(&lever) + cx * rho);
            set(&mut indentation, i, -cy, -cy.cross(&lever));
            set(&mut torsion, i, Vector3::zeros(), cy);
            contacts.push(contact);
        }
        Self { mass, bias, pfaffian, indentation, torsion, contacts }
    }

    /// A diagonal matrix with one number a contact.
    fn each(&self, value: impl Fn(&Contact) -> f64) -> DMatrix<f64> {
        DMatrix::from_diagonal(&DVector::from_iterator(self.contacts.len(), self.contacts.iter().map(value)))
    }

    /// Returns the remainders of Eqs. 19-21 at given accelerations, contact forces and torques.
    fn residual(
        &self,
        acceleration: &DVector<f64>,
        forces: &[ContactForce],
        torques: &JointVector,
    ) -> DVector<f64> {
        let normal = DVector::from_iterator(forces.len(), forces.iter().map(|force| force.normal_n));
        let rolling = DVector::from_iterator(
            2 * forces.len(),
            forces.iter().flat_map(|force| [force.lambda_x_n, force.lambda_z_n]),
        );
        // `dT_i/dv`; the reported torsion is what pushes the object along `C_Y`.
        let torsion = -DVector::from_iterator(forces.len(), forces.iter().map(|force| force.torsion_nm));
        let mut residual = &self.mass * acceleration
            + &self.bias
            + self.torsion.tr_mul(&torsion)
            + self.indentation.tr_mul(&normal)
            + self.pfaffian.tr_mul(&rolling);
        for k in 0..acceleration.len() - 6 {
            residual[k] -= torques[k];
        }
        residual
    }
}

/// The block-structured solver of the plant against one dense system of the same equations, assembled here.
///
/// The first step is half a step `tau` of the implicit Euler rule:
/// `G (v - v0) / tau + bias + D v + b S^T S v + Q^T f + P^T lambda = U`, `P v = 0`, with the normal force of the end,
/// `f = k dr^2 + xi Q v + tau 2 k dr Q (v - v0)` (stiffness averaged over the positions around it). Positions then move
/// with `v` for a whole step, which shows it.
///
/// Tolerance: forces 1e-10 of the largest, for rounding of 1e-16 and a dense system whose condition is about 1e6.
/// Velocities 1e-10 (rad/s, m/s), because positions of up to 2 rad are rounded to 2e-16 and divided by a step of at
/// least 5e-5 s.
#[test]
fn the_solver_agrees_with_a_dense_system() {
    let mut draw = Draw::new(20);
    for (name, mut grasp) in grasps() {
        let n = grasp.description.joints.len();
        let (mut speeds, mut forces) = (Errors::new(), Errors::new());
        for _ in 0..50 {
            let motion = disturbed(&grasp, &mut draw, 1e-3, 1.0);
            let h = draw.within(5e-5, 5e-4);
            let viscous: Vec<f64> = (0..n).map(|_| draw.within(0.0, 1e-2)).collect();
            for k in 0..n {
                grasp.model.friction[k] =
                    JointFriction { viscous_nm_s: viscous[k], ..JointFriction::default() };
            }
            let torques: JointVector = draw.joints(0.3);
            let mut plant = Plant::new(grasp.model.clone(), motion, h).expect("it has equations of motion");
            plant.solve(&torques).expect("the fingers touch");
            let found = plant.forces().to_vec();
            plant.advance();

            let mut equations = Equations::of(&grasp, &motion);
            // The object's rotation is carried by its momentum, free of `w x I w`.
            equations.bias.rows_mut(n, 6).fill(0.0);
            let (tau, v0) = (0.5 * h, velocities(&motion, n));
            let count = equations.contacts.len();
            let (q, s, p) = (&equations.indentation, &equations.torsion, &equations.pfaffian);
            let damping = equations.each(|contact| contact.damping_n_s_m);
            let spring = equations.each(|contact| tau * contact.stiffness_n_m);
            let viscosity = equations.each(|contact| contact.torsion_nm_s);
            let elastic = DVector::from_iterator(count, equations.contacts.iter().map(|c| c.elastic_force_n));
            let mut matrix = DMatrix::zeros(n + 6 + 2 * count, n + 6 + 2 * count);
            let mut upper =
                &equations.mass / tau + s.tr_mul(&(&viscosity * s)) + q.tr_mul(&((&damping + &spring) * q));
            let mut right = DVector::zeros(n + 6 + 2 * count);
            let mut force =
                &equations.mass * &v0 / tau - &equations.bias - q.tr_mul(&(&elastic - &spring * q * &v0));
            for k in 0..n {
                upper[(k, k)] += viscous[k];
                force[k] += torques[k];
            }
            matrix.view_mut((0, 0), (n + 6, n + 6)).copy_from(&upper);
            matrix.view_mut((n + 6, 0), (2 * count, n + 6)).copy_from(p);
            matrix.view_mut((0, n + 6), (n + 6, 2 * count)).copy_from(&p.transpose());
            right.rows_mut(0, n + 6).copy_from(&force);
            let solution = matrix.lu().solve(&right).expect("it is regular");
            let v = solution.rows(0, n + 6).into_owned();
            let normal = &elastic + &damping * q * &v + &spring * q * (&v - &v0);
            let twist = &viscosity * s * &v;

            let scale = normal.amax().max(solution.rows(n + 6, 2 * count).amax());
            for (i, found) in found.iter().enumerate() {
                forces.add((found.normal_n - normal[i]) / scale);
                forces.add((found.lambda_x_n - solution[n + 6 + 2 * i]) / scale);
                forces.add((found.lambda_z_n - solution[n + 6 + 2 * i + 1]) / scale);
                // Torsion resists `S v`, and pushes the object along `C_Y`.
                forces.add((found.torsion_nm + twist[i]) / twist.amax().max(0.01 * scale));
            }
            for k in 0..n {
                speeds.add((plant.motion().angles_rad[k] - motion.angles_rad[k]) / h - v[k]);
            }
            let moved = (plant.motion().position_m - motion.position_m) / h;
            speeds.add((moved - Vector3::new(v[n], v[n + 1], v[n + 2])).norm());
        }
        println!("{name}: forces, relative {forces}; velocities {speeds}");
        assert!(forces.largest() < 1e-10);
        assert!(speeds.largest() < 1e-10);
    }
}

/// Accelerations as differences of the velocities of neighbouring steps, `(v(t + h) - v(t - h)) / 2h`, satisfy Eqs.
/// 19-21 with the multipliers, normal forces and torsion that the plant reports for `t`.
///
/// Both the differences and the forces err by `h^2`, so that the residual falls by four when the step is halved.
///
/// Tolerance: order at least 1.9 of the largest residual over 50 ms of a moving grasp, over a factor of four in the
/// step.
#[test]
fn multipliers_satisfy_the_equations_of_motion() {
    for (name, grasp) in grasps() {
        let n = grasp.description.joints.len();
        let mut residuals = vec![];
        for halvings in 0..3 {
            let h = 1e-4 / f64::from(1 << halvings);
            let mut plant = grasp.plant(h);
            grasp.run(&mut plant, 500 << halvings, |_| {});
            let mut history: Vec<(Motion, Vec<ContactForce>, JointVector)> = vec![];
            grasp.run(&mut plant, 500 << halvings, |plant| {
                history.push((*plant.motion(), plant.forces().to_vec(), grasp.torques(plant)));
            });
            let mut errors = [Errors::new(); 4];
            for three in history.windows(3) {
                let [before, now, after] = three else { unreachable!() };
                let acceleration = (velocities(&after.0, n) - velocities(&before.0, n)) / (2.0 * h);
                let equations = Equations::of(&grasp, &now.0);
                let residual = equations.residual(&acceleration, &now.1, &now.2);
                errors[0].add(residual.rows(0, n).amax());
                errors[1].add(residual.rows(n, 3).amax());
                errors[2].add(residual.rows(n + 3, 3).amax());
                // Eq. 15: the reported torsion is `-b C_Y . (w - w_i)`.
                let twist = &equations.torsion * velocities(&now.0, n);
                for (i, force) in now.1.iter().enumerate() {
                    errors[3].add(force.torsion_nm + equations.contacts[i].torsion_nm_s * twist[i]);
                }
            }
            let [joints, force, moment, torsion] = errors;
            println!("{name}, h {h:.1e} s: Eq. 19 {joints} N m; Eq. 20 {force} N; Eq. 21 {moment} N m");
            // Multipliers and velocities come from one solution, which Eq. 15 is a row of.
            assert!(torsion.largest() < 1e-12, "{torsion}");
            residuals.push([joints, force, moment].map(|errors| errors.largest()));
        }
        let orders: Vec<f64> = (0..3).map(|k| order(residuals[0][k], residuals[2][k]) / 2.0).collect();
        println!("{name}: orders {orders:.2?}");
        assert!(orders.iter().all(|&order| order > 1.9));
    }
}

/// Returns the largest distance by which anything moved between two motions, m: the object's mass centre, its farthest
/// corner by its turn, and the fingertips' centres.
fn drift_m(grasp: &Grasp, before: &Motion, after: &Motion) -> f64 {
    let n = grasp.description.joints.len();
    let centres = |motion: &Motion| grasp.description.placed(&motion.angles_rad[..n]).centres_m;
    let turned = before.attitude.angle_to(&after.attitude) * grasp.model.object.shape.radius_m();
    let tips = centres(before).iter().zip(centres(after)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    (before.position_m - after.position_m).norm().max(turned).max(tips)
}

/// A held object does not creep: joints with friction, at rest, under torques that no longer change.
///
/// The cube's tangential forces are a third of the normal ones, and stay so. What is left after the grasp is the
/// torsion of the soft fingertips, which gives way slowly (Eq. 15) to the springs of the joints that stick: an
/// exponential with a time constant `b / K` of 1.4 s for the hand, 2.7 s for the hand on the arm. Creep would be a
/// drift that does not end.
///
/// Tolerances: 1 nm per second from the twelfth second on; after forty seconds 1e-14 m per second, the rounding of
/// positions of 0.1 m that the relaxation has come down to.
///
/// The same without friction is no rest: constant torques hold an object in an unstable balance.
#[test]
fn a_held_object_does_not_creep() {
    const STEP_S: f64 = 5e-4;
    const SECOND: usize = 2000;
    for (name, mut grasp) in [
        ("cube", Grasp::new(three_finger(), &cube())),
        ("cube on an arm", Grasp::new(on_arm(&three_finger()), &cube())),
    ] {
        grasp.model.friction.fill(FRICTION);
        let mut plant = grasp.plant(STEP_S);
        grasp.run(&mut plant, 4 * SECOND, |_| {});
        let frozen = grasp.torques(&plant);
        let mut drifts = vec![];
        for _ in 0..45 {
            let before = *plant.motion();
            grasp.drive(&mut plant, SECOND, |_| frozen, |_| {});
            drifts.push(drift_m(&grasp, &before, plant.motion()));
        }
        let force = plant.forces()[1];
        let tangential = force.lambda_x_n.hypot(force.lambda_z_n) / force.normal_n;
        let list: Vec<_> = drifts.iter().map(|drift| format!("{drift:.1e}")).collect();
        println!("{name}: tangential / normal {tangential:.2}; drift in each second {} m", list.join(" "));
        assert!(tangential > 0.1, "it should be held by friction");
        assert!(drifts[12..].iter().all(|&drift| drift < 1e-9));
        assert!(drifts[40..].iter().all(|&drift| drift < 1e-14));
    }

    let grasp = Grasp::new(three_finger(), &cube());
    let mut plant = grasp.plant(STEP_S);
    let frozen = grasp.torques(&plant);
    grasp.drive(&mut plant, 40, |_| frozen, |_| {});
    let drift = drift_m(&grasp, &grasp.start, plant.motion());
    println!("without friction: {drift:.1e} m in 20 ms");
    assert!(drift > 1e-6);
}
