//! `blindgrasp hand new`: a hand's file for a URDF.

use super::super::Outcome;
use anyhow::Context;
use blindgrasp::files;
use blindgrasp::model::{FingertipRequest, HandFile, HandModel, StarterRequest, TunedGains};
use blindgrasp::sim::tune::SampledLoop;
use clap::Args;
use std::path::{Component, Path, PathBuf};

/// Write a hand's file to start from, for a URDF
///
/// Kinematics, masses and limits stay in the URDF, which the file names. What URDF can't say is guessed from the hand itself:
/// fingertips from spheres and names of links, gains and friction from masses, levers and torque limits. Every guess is marked
/// in the file, and listed.
#[derive(Args)]
pub(crate) struct Arguments {
    /// The URDF (a xacro file has to be expanded first)
    urdf: PathBuf,
    /// The hand's file [default: beside the URDF, with the ending .toml]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Overwrite the hand's file
    #[arg(long)]
    force: bool,
    /// A link that is a fingertip, with the centre of its sphere in the link's frame, and its radius, m (once for each fingertip)
    #[arg(long = "fingertip", value_name = "LINK[:x,y,z[:radius_m]]", value_parser = fingertip)]
    fingertips: Vec<FingertipRequest>,
    /// The link that is the base frame [default: the URDF's root]
    #[arg(long, value_name = "LINK")]
    base: Option<String>,
    /// A joint that is held still, at an angle in rad (prismatic: a position in m); may be repeated
    #[arg(long = "lock", value_name = "JOINT=RAD", value_parser = lock, allow_hyphen_values = true)]
    locked: Vec<(String, f64)>,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let urdf = &arguments.urdf;
    let out = arguments.out.clone().unwrap_or_else(|| urdf.with_extension("toml"));
    files::check(&out, arguments.force)?;
    let folder = out.parent().map(Path::to_path_buf).unwrap_or_default();
    let file = relative(urdf, &folder)
        .to_str()
        .with_context(|| format!("{}: is no UTF-8 text; rename it", urdf.display()))?
        .to_owned();
    let request = StarterRequest {
        file,
        folder,
        base: arguments.base.clone(),
        locked: arguments.locked.clone(),
        fingertips: arguments.fingertips.clone(),
    };
    let starter = request.start(tuned)?;
    for warning in &starter.warnings {
        eprintln!("blindgrasp: warning: {warning}");
    }
    files::write(&out, &starter.text, arguments.force)?;
    for guess in &starter.guesses {
        eprintln!("blindgrasp: guessed: {guess}");
    }
    eprintln!("blindgrasp: wrote {}", out.display());
    Ok(Outcome::Shown)
}

/// Returns the gains that a hand's nominal grasp bears the most delay with.
fn tuned(model: &HandModel, file: &HandFile) -> Option<TunedGains> {
    let nominal = |firmness| SampledLoop::nominal(model, file, true, firmness).ok();
    let tuned = nominal(1.0)?.tuned(super::tune::MARGIN_TICKS, &nominal)?;
    Some(TunedGains { bandwidth_hz: tuned.bandwidth_hz?, damping_nm_s_rad: tuned.damping_nm_s_rad })
}

/// Returns the name of a file for another in a folder: relative, unless it was named by an absolute path and is further
/// up.
fn relative(file: &Path, folder: &Path) -> PathBuf {
    let whole = |folder: Option<&Path>| {
        folder.filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")).canonicalize()
    };
    let (Ok(from), Ok(to), Some(name)) = (whole(Some(folder)), whole(file.parent()), file.file_name()) else {
        return file.to_path_buf(); // It can't be read either, which is told there.
    };
    if let Ok(below) = to.strip_prefix(&from) {
        return below.join(name);
    }
    if file.is_absolute() {
        return file.to_path_buf();
    }
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    let down = to.components().skip(shared);
    up.chain(down).collect::<PathBuf>().join(name)
}

/// `LINK[:x,y,z[:radius_m]]`; the link's name may have colons itself.
fn fingertip(text: &str) -> Result<FingertipRequest, String> {
    let numbers = |text: &str| -> Option<Vec<f64>> {
        text.split(',')
            .map(|word| word.trim().parse().ok().filter(|number: &f64| number.is_finite()))
            .collect()
    };
    let vector = |text: &str| numbers(text).and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
    let mut request = FingertipRequest { link: text.into(), offset_m: None, radius_m: None };
    let Some((before, last)) = text.rsplit_once(':') else { return Ok(request) };
    if let Some(offset) = vector(last) {
        (request.link, request.offset_m) = (before.into(), Some(offset));
    } else if let (Some((link, middle)), Some([radius])) =
        (before.rsplit_once(':'), numbers(last).and_then(|numbers| <[f64; 1]>::try_from(numbers).ok()))
    {
        let offset = vector(middle).ok_or_else(|| format!("`{middle}` is not x,y,z: three numbers, m"))?;
        (request.link, request.offset_m, request.radius_m) = (link.into(), Some(offset), Some(radius));
    } else if last.contains(',') {
        return Err(format!("`{last}` is not x,y,z: three numbers, m"));
    }
    Ok(request)
}

/// `JOINT=RAD`.
fn lock(text: &str) -> Result<(String, f64), String> {
    let (name, position) = text.rsplit_once('=').ok_or("write JOINT=RAD, such as wrist=0.3")?;
    match position.trim().parse::<f64>() {
        Ok(number) if number.is_finite() && !name.is_empty() => Ok((name.into(), number)),
        _ => Err("write JOINT=RAD, such as wrist=0.3".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fingertips_are_told_in_three_forms() {
        let request =
            |link: &str, offset_m, radius_m| FingertipRequest { link: link.into(), offset_m, radius_m };
        assert_eq!(fingertip("tip"), Ok(request("tip", None, None)));
        assert_eq!(fingertip("tip:0,0.01,-2e-3"), Ok(request("tip", Some([0.0, 0.01, -2e-3]), None)));
        assert_eq!(fingertip("tip:0,0,1:0.01"), Ok(request("tip", Some([0.0, 0.0, 1.0]), Some(0.01))));
        assert_eq!(fingertip("hand:tip"), Ok(request("hand:tip", None, None)));
        assert_eq!(
            fingertip("hand:tip:0,0,1:0.01"),
            Ok(request("hand:tip", Some([0.0, 0.0, 1.0]), Some(0.01)))
        );
        for wrong in ["tip:0,0", "tip:0,0:0.01", "tip:0,a,0", "tip:0,nan,0"] {
            assert!(fingertip(wrong).unwrap_err().contains("three numbers"), "{wrong}");
        }
        assert_eq!(lock("a=b=-0.3"), Ok(("a=b".into(), -0.3)));
        for wrong in ["a", "a=", "=1", "a=inf", "a=b"] {
            assert!(lock(wrong).is_err(), "{wrong}");
        }
    }
}
