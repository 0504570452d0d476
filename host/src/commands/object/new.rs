//! `blindgrasp object new`: an object's file for a mesh.

use super::super::Outcome;
use anyhow::{Context, bail};
use blindgrasp::files;
use blindgrasp::model::ObjectFile;
use blindgrasp::model::inspect::finding::{Severity, Verdict};
use blindgrasp::model::inspect::object::{ObjectCheck, Wanted};
use blindgrasp::model::mesh::{Unit, is_mesh};
use clap::Args;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Make an object's file that refers to a mesh (.stl, .obj), after checking the mesh
///
/// Exit code 0: written; 1: the mesh has errors, and nothing was written; 2: bad input or usage.
#[derive(Args)]
pub(crate) struct Arguments {
    /// The mesh
    mesh: OsString,
    /// Its unit: mm, cm, m or in
    #[arg(long, value_parser = super::unit)]
    unit: Option<Unit>,
    /// Mass of the object, kg
    #[arg(
        long,
        value_name = "KG",
        conflicts_with = "density_kg_m3",
        required_unless_present = "density_kg_m3"
    )]
    mass_kg: Option<f64>,
    /// Instead of the mass: its density, kg/m^3
    #[arg(long, value_name = "KG/M3")]
    density_kg_m3: Option<f64>,
    /// Its name; without it, that of the mesh
    #[arg(long)]
    name: Option<String>,
    /// The file to write; without it, one beside the mesh, with its name
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
    /// Overwrite the file
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mesh = Path::new(&arguments.mesh);
    if !is_mesh(&arguments.mesh) {
        bail!("{}: is neither .stl nor .obj; export it as STL or OBJ", mesh.display());
    }
    let wanted = Wanted { unit: arguments.unit, fingertip_m: None };
    let check = ObjectCheck::load(&arguments.mesh, &wanted)?;
    for finding in check.findings.iter() {
        eprintln!("blindgrasp: {finding}");
    }
    if check.verdict == Verdict::Broken {
        return Ok(Outcome::Failed);
    }
    let out = arguments.out.clone().unwrap_or_else(|| mesh.with_extension("toml"));
    files::check(&out, arguments.force)?;
    let text = describe(arguments, &relative(mesh, &out)?, &check);
    // What can't be read back is not written.
    let folder = out.parent().unwrap_or(Path::new(""));
    let file = ObjectFile::parse(&text, &out.to_string_lossy(), folder)?;
    file.body(&mut Vec::new()).map_err(|error| anyhow::anyhow!("{error}"))?;
    files::write(&out, &text, arguments.force)?;
    let warnings = check.findings.iter().filter(|finding| finding.severity == Severity::Warning).count();
    eprintln!("blindgrasp: wrote {}{}", out.display(), if warnings > 0 { ", with warnings" } else { "" });
    Ok(Outcome::Shown)
}

/// The path of the mesh as seen from the file that refers to it.
fn relative(mesh: &Path, out: &Path) -> anyhow::Result<String> {
    let absolute = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        std::fs::canonicalize(folder).with_context(|| format!("folder {}", folder.display()))
    };
    let (from, to) = (absolute(out)?, absolute(mesh)?);
    let name = mesh.file_name().context("the mesh has no name")?;
    let path = match to.strip_prefix(&from) {
        Ok(below) => below.join(name),
        Err(_) => to.join(name),
    };
    path.into_os_string()
        .into_string()
        .map_err(|_| anyhow::anyhow!("the mesh's path is not UTF-8; rename it"))
}

fn describe(arguments: &Arguments, mesh: &str, check: &ObjectCheck) -> String {
    let name = arguments.name.as_ref().unwrap_or(&check.name);
    let quoted = |text: &str| toml::Value::from(text).to_string();
    let weight = match (arguments.mass_kg, arguments.density_kg_m3) {
        (Some(mass), _) => format!("mass_kg = {mass:?}"),
        (None, density) => format!("density_kg_m3 = {:?}", density.unwrap_or_default()),
    };
    let unit = arguments.unit.map_or("m", Unit::word);
    format!(
        "schema = 1\nname = {}\n{weight}\n\n# The inertia is that of a uniform body. `blindgrasp object check` shows faces and sizes.\n\
         [shape.mesh]\nfile = {}\nunit = {}\n",
        quoted(name),
        quoted(mesh),
        quoted(unit)
    )
}
