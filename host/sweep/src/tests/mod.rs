//! Plans, and the rows of their runs.

use super::*;
use blindgrasp_model::{Scene, Setting};

mod edges;
mod journal;
mod rows;
mod table;

fn plan(scene: &str, settings: &[&str], axes: &[&str], seeds: u32) -> Result<Plan, String> {
    let settings = settings.iter().map(|text| Setting::parse(text).unwrap()).collect();
    let axes = axes.iter().map(|text| Axis::parse(text).unwrap()).collect();
    Plan::new(scene, settings, axes, seeds).map_err(|error| error.to_string())
}

#[test]
fn runs_are_the_grid_with_the_last_axis_fastest() {
    let axes = ["control.force_n=4,5", "object=cube,prism", "friction.scale=0..1:3"];
    let plan = plan("cube", &["duration_s=0.1"], &axes, 2).unwrap();
    assert_eq!(plan.runs(), 24);
    let texts = |run| plan.values(run).map(|value| value.text.as_str()).collect::<Vec<_>>();
    assert_eq!(texts(0), ["4", "cube", "0"]);
    assert_eq!(texts(1), ["4", "cube", "0"]);
    assert_eq!(texts(2), ["4", "cube", "0.5"]);
    assert_eq!(texts(6), ["4", "prism", "0"]);
    assert_eq!(texts(12), ["5", "cube", "0"]);
    assert_eq!(texts(23), ["5", "prism", "1"]);
    for run in 0..24 {
        let Ok(file) = plan.file(run) else { continue };
        let place = plan.place(run);
        assert_eq!(file.control.force_n(), [4.0, 5.0][place[0]]);
        assert_eq!(file.object.name, ["cube", "prism"][place[1]]);
        assert_eq!(file.friction.scale, [0.0, 0.5, 1.0][place[2]]);
        assert_eq!(file.seed, 1 + run as u32 % 2);
    }
}

/// The run of a plan is that of `sim` with the same settings.
#[test]
fn a_run_is_the_scene_with_its_settings() {
    let plan = plan("cube", &["duration_s=0.1", "seed=7"], &["control.force_n=4,5", "object=cube,cube-2"], 1)
        .unwrap();
    let set = ["duration_s=0.1", "seed=7", "control.force_n=5", "object=cube"].map(str::to_owned);
    assert_eq!(plan.scene(2), Scene::load("cube", &set));
    let refused = plan.scene(3).unwrap_err().to_string();
    assert_eq!(
        refused,
        "--vary: object: no built-in object is called `cube-2`; did you mean `cube`? (a path has to end in .toml or contain a /; of meshes, .stl and .obj are read)"
    );
}

#[test]
fn what_no_scene_knows_is_no_sweep() {
    let error = |settings: &[&str], axes: &[&str], seeds| plan("cube", settings, axes, seeds).unwrap_err();
    for (key, message) in [
        ("control.forc_n=1..2:3", "--vary: control.forc_n: unknown key; did you mean `force_n`?"),
        (
            "hand.joint.thumb.mass_kg=1,2",
            "--vary: hand.joint.thumb.mass_kg: the list has no `thumb`; use a number from 1 to 12, a name, or * for all",
        ),
        ("control.force_n=much,more", "--vary: control.force_n: is string \"much\"; has to be a number"),
        (
            "control.amplifier_start_ms=0.5,1.5",
            "--vary: control.amplifier_start_ms: is floating point `0.5`; has to be a whole number, not negative",
        ),
        (
            "hand.control.force_n=1,2",
            "--vary: hand.control.force_n: acts in the firmware only; set control.force_n",
        ),
        (
            "object=ball,egg",
            "--vary: object: no built-in object is called `ball`; known: prism, cube, hexagonal-prism, cuboid, cuboid-printed, l-bracket, octahedron, brick, heavy-cube, cube-100g, prism-100g, hexagonal-prism-100g (a path has to end in .toml or contain a /; of meshes, .stl and .obj are read)",
        ),
    ] {
        assert_eq!(error(&[], &[key], 1), message);
    }
    assert_eq!(
        error(&["control.forc_n=1"], &["control.force_n=1,2"], 1),
        "--set: control.forc_n: unknown key; did you mean `force_n`?"
    );
    assert_eq!(
        error(&[], &["seed=1,2", "seed=3,4"], 1),
        "--vary: seed: is varied twice; leave one of them out"
    );
    assert_eq!(
        error(&["seed=1"], &["seed=1,2"], 1),
        "--vary: seed: is both set and varied; leave one of them out"
    );
    assert_eq!(
        error(&[], &["seed=1,2"], 2),
        "--vary: seed: is varied, and by --seeds as well; leave one of them out"
    );
    assert_eq!(
        error(&[], &["control.force_n=1..2:2000", "friction.scale=0..1:2000"], 1),
        "--vary: the values combine to more than 1000000 runs; give fewer"
    );
    assert!(
        plan("cub", &[], &["seed=1,2"], 1).unwrap_err().starts_with("cub: no built-in scene is called `cub`")
    );
}

/// One bad value among good ones, first or last, is an outcome.
#[test]
fn a_value_that_a_scene_refuses_is_no_error() {
    for axis in ["control.force_n=much,5", "control.force_n=5,-1", "object=ball,cube"] {
        assert!(plan("cube", &[], &[axis], 1).is_ok(), "{axis}");
    }
}

/// A sweep is of one scene: what happens to its files while it runs changes nothing.
#[test]
fn the_files_of_a_scene_are_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write(
        "scene.toml",
        &include_str!("../../../../models/scenes/cube.toml").replace("\"cube\"", "\"cube.toml\""),
    );
    write("cube.toml", include_str!("../../../../models/objects/cube.toml"));
    let scene = folder.path().join("scene.toml");
    let prism = folder.path().join("prism.toml");
    write("prism.toml", include_str!("../../../../models/objects/prism.toml"));
    let axis = format!("object=cube,{}", prism.display());
    let plan = plan(scene.to_str().unwrap(), &["name=s"], &["friction.scale=0,1", &axis], 1).unwrap();
    let all = || (0..4).map(|run| (plan.file(run), plan.scene(run))).collect::<Vec<_>>();
    let before = all();
    drop(folder);
    assert_eq!(all(), before);
    let names = before.iter().map(|(file, _)| file.as_ref().map_or("", |file| &file.object.name));
    assert_eq!(names.collect::<Vec<_>>(), ["cube", "prism", "cube", "prism"]);
}

/// A mesh is read when the plan is made, with the values that it is read by.
#[test]
fn a_mesh_is_varied_by_what_it_is_read_with() {
    let plan = plan("l-bracket", &[], &["object.shape.mesh.scale=1,1.1", "control.force_n=4,5"], 1).unwrap();
    let size = |run| {
        let toml = toml::Value::try_from(plan.file(run).unwrap()).unwrap();
        let vertices = toml["object"]["shape"]["mesh"]["vertices_m"].as_array().unwrap();
        let x = vertices.iter().map(|vertex| vertex[0].as_float().unwrap().abs());
        x.fold(0.0, f64::max)
    };
    assert_eq!(size(0), size(1));
    assert!((size(2) / size(0) - 1.1).abs() < 1e-6, "{} and {}", size(2), size(0));
    assert_eq!(plan.kind(0), blindgrasp_record::table::Kind::Double);
}
