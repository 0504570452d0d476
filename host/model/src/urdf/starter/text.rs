//! The hand's file as a text, with the reason behind every guess.

use super::super::super::check::{LONGEST_NAME, Result};
use super::super::super::error::SceneError;
use super::super::super::file::{SCHEMA, Safety};
use super::super::assembly::{Assembly, MOST_NAMES, resting, toml_key};
use super::super::complete::PLACEHOLDER;
use super::super::keys::Keys;
use super::super::robot::{Joint, Kind, Robot};
use super::super::topology::Tree;
use super::super::xml::quote;
use super::fingertips::{ASKED, Tip, radius_of};
use super::gains::{self, Gains};
use super::surfaces::Surfaces;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write as _;

/// The contents of a hand's file apart from numbers that hang on the whole hand.
pub(super) struct Draft<'a> {
    pub(super) robot: &'a Robot,
    keys: Keys,
    pub(super) assembly: Assembly,
    pub(super) tips: Vec<Tip>,
    /// Radius of each fingertip, m.
    pub(super) radii_m: Vec<f64>,
    /// One a joint.
    pub(super) needs: Vec<Needs>,
    /// Names of joints that move no fingertip.
    idle: Vec<String>,
}

/// The values of a joint that the URDF does not have, or has placeholders of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Needs {
    pub(super) torque: bool,
    pub(super) speed: bool,
    pub(super) friction: bool,
    /// Limits, rad.
    limits_rad: Option<[f64; 2]>,
    /// Angle that inverse kinematics starts from, rad.
    pub(super) nominal_rad: f64,
}

impl Needs {
    fn of(joint: &Joint) -> Self {
        let limit = &joint.limit;
        let is_known = |value: Option<f64>| value.is_some_and(|value| value > 0.0 && value < PLACEHOLDER);
        let (torque, speed) = (!is_known(limit.effort), !is_known(limit.velocity));
        let limits_rad = match (joint.kind, limit.lower, limit.upper) {
            (Kind::Continuous, ..) => Some([-PI, PI]),
            (_, None, None) => Some([-FRAC_PI_2, FRAC_PI_2]),
            _ => None,
        };
        let [lower, upper] = limits_rad.unwrap_or([limit.lower.unwrap_or(0.0), limit.upper.unwrap_or(0.0)]);
        let middle = 0.5 * (lower + upper);
        // A small range far from zero may lie between two round numbers.
        let nominal_rad =
            Some(gains::rounded(middle)).filter(|angle| (lower..=upper).contains(angle)).unwrap_or(middle);
        Self { torque, speed, friction: !has_friction(joint), limits_rad, nominal_rad }
    }
}

/// Returns `true` if the URDF knows a joint's friction: it is not zero, and the motor can turn against it.
fn has_friction(joint: &Joint) -> bool {
    let torque = joint.limit.effort.filter(|effort| *effort > 0.0).unwrap_or(f64::INFINITY);
    let friction = joint.dynamics.friction.unwrap_or(0.0);
    let drag = joint.dynamics.damping.unwrap_or(0.0) * joint.limit.velocity.unwrap_or(0.0);
    friction > 0.0 && friction < torque && drag < torque
}

impl<'a> Draft<'a> {
    pub(super) fn new(robot: &'a Robot, tree: &Tree, mut keys: Keys, mut tips: Vec<Tip>) -> Result<Self> {
        let links: Vec<usize> = tips.iter().map(|tip| tip.link).collect();
        let assembly = Assembly::new(robot, tree, &keys, &links, &mut Vec::new())?;
        let mut idle = Vec::new();
        for k in assembly.idle(robot, &keys) {
            let joint = &robot.joints[k];
            idle.push(format!("`{}`", quote(&joint.name)));
            let list = match joint.kind {
                Kind::Revolute | Kind::Continuous => &mut keys.locked_rad,
                Kind::Prismatic => &mut keys.locked_m,
                _ => continue,
            };
            list.insert(joint.name.clone(), resting(joint));
        }
        let mut radii_m = Vec::with_capacity(tips.len());
        for tip in &mut tips {
            let Some(carrier) = assembly.seats[tip.link].and_then(|seat| seat.joint) else {
                let link = &robot.links[tip.link];
                let problem =
                    format!("no joint moves link `{}`, which is to be a fingertip", quote(&link.name));
                let remedy = "name another link, or hold less still";
                return Err(SceneError::new("", problem, remedy).at(&link.place));
            };
            let radius_m = tip.radius_m.unwrap_or_else(|| {
                let length = gains::finger_length_m(&assembly, &links, carrier, tip);
                gains::rounded(radius_of(length))
            });
            if tip.is_end && tip.offset_m.norm() > radius_m {
                tip.offset_m -= tip.offset_m.normalize() * radius_m;
                tip.offset_m = tip.offset_m.map(|value| (value * 1e5).round() / 1e5);
            }
            radii_m.push(radius_m);
        }
        let needs = assembly.joints.iter().map(|moving| Needs::of(&robot.joints[moving.joint])).collect();
        Ok(Self { robot, keys, assembly, tips, radii_m, needs, idle })
    }

    /// A joint of the hand as the URDF has it.
    pub(super) fn joint(&self, index: usize) -> &Joint {
        &self.robot.joints[self.assembly.joints[index].joint]
    }

    /// The joint that carries each fingertip, its centre in the frame of the joint's link (m), and its radius (m).
    pub(super) fn seated_tips(&self) -> Vec<(usize, Vector3<f64>, f64)> {
        let seated = |(i, tip): (usize, &Tip)| {
            let frame = self.assembly.seats[tip.link].and_then(|seat| seat.frame);
            let centre_m = frame.map_or(tip.offset_m, |frame| frame.point(&tip.offset_m));
            (self.carrier(i), centre_m, self.radii_m[i])
        };
        self.tips.iter().enumerate().map(seated).collect()
    }

    /// Index of the joint that carries a fingertip.
    pub(super) fn carrier(&self, tip: usize) -> usize {
        self.assembly.seats[self.tips[tip].link].and_then(|seat| seat.joint).unwrap_or(0)
    }

    /// A word for the hand.
    fn name(&self) -> String {
        let mut name = String::new();
        for c in self.robot.name.chars().filter(|c| !c.is_control()) {
            if name.len() + c.len_utf8() > LONGEST_NAME {
                break;
            }
            name.push(c);
        }
        if name.trim().is_empty() { "hand".into() } else { name }
    }

    /// Returns the guesses, a line a kind.
    pub(super) fn guesses(&self, gains: &Gains) -> Vec<String> {
        let mut guesses = Vec::new();
        match &self.idle[..] {
            [] => {}
            names if names.len() <= MOST_NAMES => {
                guesses.push(format!("held still, as they move no fingertip: {}", names.join(", ")));
            }
            names => guesses.push(format!("{} joints, which move no fingertip, are held still", names.len())),
        }
        for (tip, radius_m) in self.tips.iter().zip(&self.radii_m) {
            let mut parts = vec![format!("fingertip on link `{}`", quote(&self.robot.links[tip.link].name))];
            if tip.offset_from != ASKED {
                parts.push(format!("its centre: {}", tip.offset_from));
            }
            if tip.radius_from != ASKED {
                parts.push(format!("its radius of {radius_m:?} m: {}", tip.radius_from));
            }
            if parts.len() > 1 {
                guesses.push(parts.join("; "));
            }
        }
        let joints = |what: &str, is_guessed: &dyn Fn(&Needs) -> bool| {
            let names: Vec<String> = (0..self.needs.len())
                .filter(|&k| is_guessed(&self.needs[k]))
                .map(|k| format!("`{}`", quote(&self.joint(k).name)))
                .collect();
            match names.len() {
                0 => None,
                count if count == self.needs.len() => Some(format!("{what} of all joints")),
                _ => Some(format!("{what} of {}", names.join(", "))),
            }
        };
        guesses.extend(joints("torque limits", &|needs| needs.torque));
        guesses.extend(joints("speed limits", &|needs| needs.speed));
        guesses.extend(joints("joint limits", &|needs| needs.limits_rad.is_some()));
        guesses.extend(joints("friction", &|needs| needs.friction));
        if gains.allowed_n.is_some() {
            guesses.push(format!("force: {}", self.force_rule(gains)));
        }
        guesses.push(format!(
            "gains: force {:?} N, attitude stiffness {:?} N m, {}{}damping; encoders; torques per volt; stiffness of the fingertips",
            gains.force_n,
            gains.attitude_stiffness_nm,
            if gains.closing_n.is_some() { "closing, " } else { "" },
            if gains.frame.is_some() { "virtual frame, " } else { "" },
        ));
        guesses
    }

    /// The file.
    pub(super) fn write(&self, gains: &Gains, surfaces: &Surfaces) -> String {
        let mut text = String::new();
        self.write_head(&mut text, gains);
        for k in 0..self.needs.len() {
            self.write_joint(&mut text, gains, k);
        }
        for i in 0..self.tips.len() {
            self.write_fingertip(&mut text, gains, i);
        }
        surfaces.write(self.robot, &self.assembly, &mut text);
        write_safety(&mut text);
        text
    }

    fn write_head(&self, text: &mut String, gains: &Gains) {
        let name = self.name();
        let string = |word: &str| toml::Value::String(word.into()).to_string();
        let _ = write!(
            text,
            "# A hand's file to start from, by `blindgrasp hand new`. Kinematics, masses and limits come from the URDF; a key\n\
             # that is given here wins over the URDF. GUESS marks what was guessed: put in what you know.\n\
             # docs/hands.md explains every key.\n\
             schema = {SCHEMA}\n\
             name = {}\n\n\
             [urdf]\n\
             file = {}\n",
            string(&name),
            string(&self.keys.file)
        );
        if let Some(base) = &self.keys.base {
            let _ = writeln!(text, "base = {}", string(base));
        }
        for (list, held) in [("locked_rad", &self.keys.locked_rad), ("locked_m", &self.keys.locked_m)] {
            let entries: Vec<String> =
                held.iter().map(|(name, position)| format!("{} = {position:?}", toml_key(name))).collect();
            if !entries.is_empty() {
                let _ = write!(text, "\n[urdf.{list}]\n{}\n", entries.join("\n"));
            }
        }
        let mut cycle = String::new();
        if let Some(closing_n) = gains.closing_n {
            let _ = write!(
                cycle,
                "# GUESS: a fingertip closes with {} times what overcomes the dry friction of its finger, {:?} m behind where it is to be.\n\
                 closing_speed_m_s = 0.05\n\
                 closing_force_n = {closing_n:?}\n\
                 closing_stiffness_n_m = {:?}\n",
                gains::CLOSING_FRICTIONS,
                gains::CLOSING_LAG_M,
                gains::rounded(closing_n / gains::CLOSING_LAG_M),
            );
        }
        if let Some([way_n_m, turn_nm]) = gains.frame {
            let _ = write!(
                cycle,
                "# GUESS: what is held is pulled to its place with force_n where it is {:?} m off; turned, as far as that is {} fingertips' radii\n\
                 # from its middle.\n\
                 frame_stiffness_n_m = {way_n_m:?}\n\
                 frame_turn_stiffness_nm = {turn_nm:?}\n",
                gains::FRAME_WAY_M,
                gains::FRAME_RADII,
            );
        }
        let _ = write!(
            text,
            "\n# Of the firmware; a start for the [control] of a scene too.\n\
             [control]\n\
             # GUESS: {}.\n\
             force_n = {:?}\n\
             # GUESS: force_n * radius / {}, as in the paper's experiments (Tables IV and VII).\n\
             attitude_stiffness_nm = {:?}\n\
             gravity_compensation = true           # gravity along -z of the base frame: the palm looks up\n\
             period_s = 1e-3\n\
             soft_start_s = 0.3\n\
             amplifier_start_ms = 0                # whole ms from power to torque, by the amplifiers' data sheet; over the line it can only be made longer\n\
             {}estimator_bandwidth_hz = {:?}\n\
             end_stops = true\n\
             {}\n\
             [joint_defaults]\n\
             encoder_counts_per_turn = 16384       # GUESS: 14 bits a turn of the joint; with a gear, motor counts times its ratio\n\
             encoder_reversed = false              # true for a joint whose count falls while it turns in its positive direction\n\
             encoder_zero_count = 0                # the count at joint angle zero\n\
             motor_reversed = false                # true for a joint that a positive voltage pushes in its negative direction\n\
             presliding_rad = 2e-4                 # GUESS: how far a joint gives before it slides\n\n\
             [fingertip_defaults]\n\
             # Of the paper's fingertips (Table I).\n\
             damping_n_s_m_per_m2 = 1.0\n\
             torsional_damping_nm_s_rad_per_m2 = 1e4\n\n\
             # Joints, in the hand's order: parents first. Rules of the guesses:\n\
             # - nominal_rad, where inverse kinematics starts: the middle of the range.\n\
             # - damping_gain_nm_s_rad: {}\n\
             # - friction, where the URDF has none that the motor could turn against: dry friction of {:?} of the torque limit (0.0034\n\
             #   in the paper's hand), as much again at full speed; a joint that sticks is damped by a fifth of critical.\n",
            self.force_rule(gains),
            gains.force_n,
            gains::RADII,
            gains.attitude_stiffness_nm,
            if gains.is_tuned { "# GUESS: tuned, see damping_gain_nm_s_rad.\n" } else { "" },
            gains.bandwidth_hz,
            cycle,
            if gains.is_tuned { gains::TUNED_RULE } else { gains::DAMPING_RULE },
            gains::FRICTION_SHARE,
        );
        if self.needs.iter().any(|needs| needs.torque) {
            let _ = writeln!(
                text,
                "# - torque_limit_nm, where the URDF has none: {} times a finger's weight at the stretched finger's end, and twice the weight of the links.",
                gains::WEIGHTS
            );
        }
        if self.needs.iter().any(|needs| needs.speed) {
            let _ = writeln!(text, "# - speed_limit_rad_s, where the URDF has none: 1.6 turns a second.");
        }
    }

    /// Returns the rule that the force follows from.
    fn force_rule(&self, gains: &Gains) -> String {
        match gains.allowed_n {
            Some(allowed) => {
                let weights = gains::WEIGHTS;
                format!(
                    "{weights} times the weight of a finger; the torque limits would allow {allowed} N: are they true?"
                )
            }
            None => format!(
                "half of what the motor of `{}` can press with in the nominal posture, the weight of its links taken off",
                quote(&self.joint(gains.weakest).name)
            ),
        }
    }

    fn write_joint(&self, text: &mut String, gains: &Gains, k: usize) {
        let (needs, joint) = (&self.needs[k], &gains.joints[k]);
        let mut line = |key: &str, value: String| {
            let _ = writeln!(text, "{key} = {value}");
        };
        line("\n[[joint]]\nname", toml::Value::String(self.joint(k).name.clone()).to_string());
        if let Some([lower, upper]) = needs.limits_rad {
            line("limits_rad", format!("[{lower:?}, {upper:?}]  # GUESS"));
        }
        if needs.nominal_rad != 0.0 {
            line("nominal_rad", format!("{:?}  # GUESS", needs.nominal_rad));
        }
        line("damping_gain_nm_s_rad", format!("{:?}  # GUESS", joint.damping_nm_s));
        let limit_nm = self.joint(k).limit.effort.filter(|_| !needs.torque).unwrap_or(joint.torque_nm);
        line("torque_per_volt_nm_v", format!("{:?}  # GUESS: its torque limit at 10 V", limit_nm / 10.0));
        if needs.torque {
            line("torque_limit_nm", format!("{:?}  # GUESS", joint.torque_nm));
        }
        if needs.speed {
            line("speed_limit_rad_s", format!("{:?}  # GUESS", joint.speed_rad_s));
        }
        if needs.friction {
            line("coulomb_friction_nm", format!("{:?}  # GUESS", joint.coulomb_nm));
            line("viscous_friction_nm_s_rad", format!("{:?}  # GUESS", joint.viscous_nm_s));
        }
        line("presliding_damping_nm_s_rad", format!("{:?}  # GUESS", joint.presliding_nm_s));
    }

    fn write_fingertip(&self, text: &mut String, gains: &Gains, i: usize) {
        let tip = &self.tips[i];
        let link = toml::Value::String(self.robot.links[tip.link].name.clone());
        let [x, y, z]: [f64; 3] = tip.offset_m.into();
        let guess = |from: &str| if from == ASKED { String::new() } else { format!("  # GUESS: {from}") };
        let _ = write!(
            text,
            "\n[[fingertip]]\n\
             name = \"finger-{}\"\n\
             link = {link}\n\
             offset_m = [{x:?}, {y:?}, {z:?}]{}\n\
             radius_m = {:?}{}\n\
             stiffness_n_m2 = {}  # GUESS: force_n indents it by {:?} of its radius\n",
            i + 1,
            guess(tip.offset_from),
            self.radii_m[i],
            guess(tip.radius_from),
            format_args!("{:e}", gains.stiffnesses_n_m2[i]),
            gains::INDENTATION,
        );
    }
}

/// All keys of `[safety]` with their defaults.
fn write_safety(text: &mut String) {
    let _ = write!(
        text,
        "\n# Of firmware and scenes; these are the defaults. docs/hands.md says how each is chosen.\n[safety]\n"
    );
    for key in Safety::KEYS {
        let value = format!("{} = {}", key.name, key.default);
        let _ = writeln!(text, "{value:<31} # {}", key.what);
    }
}
