//! Commands and notices of a hand in words: the same in the script of a scene and on the console.

use super::error::suggestion;
use blindgrasp_shared::command::{Command, Grasp, Move};
use blindgrasp_shared::control::{GAIN_COUNT, GAINS};
use blindgrasp_shared::cycle::Noticed;

/// A command in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    /// Its first word.
    pub word: &'static str,
    /// The values behind it; those of `grasp` are the gains of the laws.
    pub values: &'static str,
    /// Its meaning.
    pub words: &'static str,
}

/// Every command in words, in the order in which a hand is used.
pub const WORDS: &[Word] = &[
    Word { word: "arm", values: "", words: "let the joints have torque: hold their weight and damp them" },
    Word { word: "disarm", values: "", words: "take the torque away" },
    Word {
        word: "posture",
        values: "NAME|NUMBER|aimed [TIME_S]",
        words: "move to a posture of the hand's file, or to the one that is aimed at, and hold it",
    },
    Word {
        word: "aim",
        values: "JOINT DEG",
        words: "say where a joint is to be in the posture that is aimed at; nothing moves",
    },
    Word {
        word: "grasp",
        values: "",
        words: "close the hand until all fingertips touch, and hold; without values, as configured",
    },
    Word {
        word: "move",
        values: "KEY=VALUE ...",
        words: "move what is held, from where it was when the grasp began: x_mm, y_mm, z_mm, turn_x_deg, turn_y_deg, turn_z_deg, about_x_mm, about_y_mm, about_z_mm, time_s",
    },
    Word { word: "weigh", values: "", words: "weigh what is held" },
    Word {
        word: "put-down",
        values: "",
        words: "put down what is held: it sinks until it stands on something",
    },
    Word { word: "release", values: "", words: "let go slowly, and open" },
    Word { word: "stop", values: "", words: "take the torque away at once: what is held falls" },
    Word { word: "clear", values: "", words: "leave a fault whose cause is gone" },
];

/// The names that commands in words may use.
#[derive(Clone, Copy, Debug, Default)]
pub struct Names<'a> {
    /// Of the joints, in the hand's order.
    pub joints: &'a [String],
    /// Of the postures, in the order of the hand's file.
    pub postures: &'a [String],
}

/// Returns what was noticed, with the fingertip's name if that is known.
pub fn notice(noticed: &Noticed, fingertips: &[String]) -> String {
    match noticed.fingertip.and_then(|fingertip| fingertips.get(usize::from(fingertip))) {
        Some(name) => format!("fingertip `{name}`: {}", noticed.notice.words()),
        None => noticed.to_string(),
    }
}

/// Returns a command with the values that it takes.
pub fn usage(word: &Word) -> String {
    let values = match word.word {
        "grasp" => GAINS.iter().rev().fold(String::new(), |inner, gain| {
            let separator = if inner.is_empty() { "" } else { " " };
            format!("[{}{separator}{inner}]", gain.key.to_uppercase())
        }),
        _ => word.values.to_owned(),
    };
    format!("{} {values}", word.word).trim_end().to_owned()
}

/// Reads a command in words; `None` if its first word is none of [`WORDS`].
///
/// # Errors
/// The error in the values, and what they are to be.
pub fn command(line: &str, names: &Names<'_>) -> Option<Result<Command, String>> {
    let mut words = line.split_whitespace();
    let word = words.next()?;
    let known = WORDS.iter().find(|known| known.word == word)?;
    let values: Vec<&str> = words.collect();
    let misused = || Err(format!("use: {}: {}", usage(known), known.words));
    Some(match (word, &*values) {
        ("arm", []) => Ok(Command::Arm),
        ("disarm", []) => Ok(Command::Disarm),
        ("release", []) => Ok(Command::Release),
        ("stop", []) => Ok(Command::Stop),
        ("clear", []) => Ok(Command::ClearFault),
        ("put-down", []) => Ok(Command::PutDown),
        ("weigh", []) => Ok(Command::Weigh),
        ("grasp", values) if values.len() <= GAIN_COUNT => grasp(values),
        ("posture", [name]) => posture(name, "0", names),
        ("posture", [name, time_s]) => posture(name, time_s, names),
        ("aim", [joint, degrees]) => aim(joint, degrees, names),
        ("move", values @ [_, ..]) => movement(values).map(Command::Move),
        _ => misused(),
    })
}

fn grasp(values: &[&str]) -> Result<Command, String> {
    let mut grasp = Grasp::CONFIGURED;
    for (gain, value) in grasp.gains.iter_mut().zip(values) {
        *gain = Some(number(value)? as f32);
    }
    Ok(Command::Grasp(grasp))
}

fn posture(name: &str, time_s: &str, names: &Names<'_>) -> Result<Command, String> {
    let number = (0..).zip(names.postures).find(|(_, known)| *known == name).map(|(number, _)| number);
    let posture = match (name, number.or_else(|| name.parse().ok())) {
        ("aimed", None) => None,
        (_, Some(number)) => Some(number),
        _ => {
            let known = names.postures.iter().map(String::as_str).chain(["aimed"]);
            return Err(format!("the hand has no posture `{name}`: {}", suggestion(name, known)));
        }
    };
    Ok(Command::Posture { posture, time_ms: milliseconds(time_s)? })
}

fn aim(joint: &str, degrees: &str, names: &Names<'_>) -> Result<Command, String> {
    let named = (0..).zip(names.joints).find(|(_, known)| *known == joint).map(|(number, _)| number);
    let Some(number) = named.or_else(|| joint.parse().ok()) else {
        let known = names.joints.iter().map(String::as_str);
        return Err(format!("the hand has no joint `{joint}`: {}", suggestion(joint, known)));
    };
    Ok(Command::Aim { joint: number, angle_rad: self::number(degrees)?.to_radians() as f32 })
}

/// The keys of a movement.
const KEYS: [&str; 10] = [
    "x_mm",
    "y_mm",
    "z_mm",
    "turn_x_deg",
    "turn_y_deg",
    "turn_z_deg",
    "about_x_mm",
    "about_y_mm",
    "about_z_mm",
    "time_s",
];

fn movement(values: &[&str]) -> Result<Move, String> {
    let mut movement = Move::default();
    let mut given = [false; KEYS.len()];
    for value in values {
        let Some((key, value)) = value.split_once('=') else {
            return Err(format!("`{value}` is not KEY=VALUE, such as z_mm=15"));
        };
        let Some(k) = KEYS.iter().position(|known| *known == key) else {
            return Err(format!("`move` has no key `{key}`: {}", suggestion(key, KEYS)));
        };
        if std::mem::replace(&mut given[k], true) {
            return Err(format!("`{key}` is given twice"));
        }
        let metres = || number(value).map(|mm| (mm * 1e-3) as f32);
        match k {
            0..3 => movement.position_m[k] = metres()?,
            3..6 => movement.turn_rad[k - 3] = number(value)?.to_radians() as f32,
            6..9 => movement.about_m[k - 6] = metres()?,
            _ => movement.time_ms = milliseconds(value)?,
        }
    }
    Ok(movement)
}

fn number(word: &str) -> Result<f64, String> {
    let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("`{word}` is not a number"))
}

fn milliseconds(word: &str) -> Result<u16, String> {
    let ms = (number(word)? * 1e3).round();
    if (0.0..=f64::from(u16::MAX)).contains(&ms) {
        Ok(ms as u16)
    } else {
        Err(format!("`{word}` s is out of range: 0 (the shortest that the limits allow) to 65 s"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::cycle::Notice;

    fn read(line: &str) -> Result<Command, String> {
        let joints: Vec<String> = ["thumb", "wrist"].map(String::from).into();
        let postures: Vec<String> = ["open", "preshape"].map(String::from).into();
        command(line, &Names { joints: &joints, postures: &postures }).expect("a known word")
    }

    #[test]
    fn commands_are_read() {
        assert_eq!(read("posture preshape"), Ok(Command::Posture { posture: Some(1), time_ms: 0 }));
        assert_eq!(read("posture aimed 1.5"), Ok(Command::Posture { posture: None, time_ms: 1500 }));
        assert_eq!(read("posture 7"), Ok(Command::Posture { posture: Some(7), time_ms: 0 }));
        assert_eq!(
            read("aim wrist 90"),
            Ok(Command::Aim { joint: 1, angle_rad: std::f32::consts::FRAC_PI_2 })
        );
        assert_eq!(read("put-down"), Ok(Command::PutDown));
        let movement = Move { position_m: [0.0, 0.0, -0.015], time_ms: 800, ..Move::default() };
        assert_eq!(read("move z_mm=-15 time_s=0.8"), Ok(Command::Move(movement)));
        assert_eq!(command("fly", &Names::default()), None);
    }

    #[test]
    fn a_fingertip_is_told_by_its_name_if_it_has_one() {
        let (names, noticed) = (["thumb".to_owned()], Noticed::at(0, Notice::NeverTouched));
        assert!(notice(&noticed, &names).starts_with("fingertip `thumb`: this fingertip touches nothing"));
        assert!(notice(&noticed, &[]).starts_with("fingertip 0: "));
        assert_eq!(notice(&Noticed::of_hand(Notice::Opened), &names), "the grasp is let go");
    }

    #[test]
    fn what_can_not_be_read_says_what_to_do() {
        for (line, told) in [
            ("posture opne", "the hand has no posture `opne`: did you mean `open`?"),
            ("move z=1", "`move` has no key `z`"),
            ("move z_mm=1 z_mm=2", "`z_mm` is given twice"),
            ("move up", "`up` is not KEY=VALUE"),
            ("move z_mm=inf", "`inf` is not a number"),
            ("posture open 100", "`100` s is out of range"),
            ("aim 0", "use: aim JOINT DEG"),
            ("arm now", "use: arm"),
        ] {
            let error = read(line).unwrap_err();
            assert!(error.starts_with(told), "{line}: {error}");
        }
    }
}
