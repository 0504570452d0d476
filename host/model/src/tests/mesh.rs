//! Objects whose shape is a mesh file: what is shipped, and what an object's file may say of its mesh.

use super::cases::cases;
use crate::file::ShapeFile;
use crate::mesh::{Unit, load};
use crate::{ObjectFile, Scene, object};
use blindgrasp_meshes::{Mesh, bracket};
use std::path::Path;

const OBJECT: &str = "schema = 1\nname = \"part\"\ndensity_kg_m3 = 20\n[shape.mesh]\n";

/// As an ASCII STL file, in millimetres.
fn stl((vertices, triangles): &Mesh) -> String {
    let mut text = "solid part\n".to_owned();
    for corners in triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for corner in corners.map(|k| vertices[k] * 1e3) {
            text += &format!("vertex {} {} {}\n", corner.x, corner.y, corner.z);
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid part\n"
}

#[test]
fn shipped_meshes_are_what_their_files_say() {
    let (file, places) = ObjectFile::load_with_places("octahedron").unwrap();
    assert_eq!(places.notices, []);
    let body = object::polyhedron(&file.shape).unwrap();
    assert_eq!((body.vertices_m.len(), body.faces.len()), (6, 8));
    // a^3 sqrt(2) / 3.
    let volume = 0.05f64.powi(3) * std::f64::consts::SQRT_2 / 3.0;
    assert!((body.mass_properties().volume_m3 / volume - 1.0).abs() < 1e-14);

    let (file, places) = ObjectFile::load_with_places("l-bracket").unwrap();
    assert_eq!(places.notices, []);
    let body = object::polyhedron(&file.shape).unwrap();
    assert_eq!((body.vertices_m.len(), body.faces.len()), (12, 8));
    let volume = (48.0 * 20.0 + 28.0 * 20.0) * 40.0 * 1e-9;
    assert!((body.mass_properties().volume_m3 / volume - 1.0).abs() < 1e-14);
}

/// A mesh in a scene: relative to the object's file, and nothing of it is needed once it is read.
#[test]
fn a_scene_with_a_mesh_needs_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::create_dir_all(folder.join("parts")).unwrap();
    let (vertices, triangles) = blindgrasp_meshes::grid_box([0.048; 3], 3);
    std::fs::write(folder.join("parts/Block.STL"), stl(&(vertices, triangles))).unwrap();
    std::fs::write(
        folder.join("parts/block.toml"),
        OBJECT.to_owned() + "file = \"Block.STL\"\nunit = \"mm\"\n",
    )
    .unwrap();
    let cube =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/scenes/cube.toml"))
            .unwrap();
    let by_reference = cube.replace("object = \"cube\"", "object = \"parts/block.toml\"");
    let path = folder.join("scene.toml");
    std::fs::write(&path, by_reference).unwrap();
    let scene = Scene::load(path.as_os_str(), &[]).unwrap();
    assert_eq!(scene.object.faces.len(), 6);
    assert!((scene.mass_kg / (20.0 * 0.048f64.powi(3)) - 1.0).abs() < 1e-6);
    let text = scene.effective_toml();
    assert!(!text.contains("Block") && text.contains("vertices_m"));
    let again = Scene::parse(&text, "effective.toml", Path::new("/nowhere"), &[]).unwrap();
    assert_eq!(again, scene, "bit for bit");
    // Settings reach the mesh before it is read, and what stays of it after.
    let set = |settings: &[&str]| {
        let settings: Vec<String> = settings.iter().map(|s| s.to_string()).collect();
        Scene::load(path.as_os_str(), &settings)
    };
    let half =
        ["object.shape.mesh.scale=0.5", "object.shape.mesh.flat_deg=1", "contact.*.point_m=[0, -0.012, 0]"];
    let smaller = set(&half).unwrap();
    assert!((smaller.mass_kg / scene.mass_kg - 0.125).abs() < 1e-6);
    assert!(smaller.effective_toml().contains("flat_deg = 1.0"));
    let stl = folder.join("parts/Block.STL");
    let inline = cube.replace("object = \"cube\"", "")
        + "[object]\nschema = 1\nname = \"b\"\nmass_kg = 0.002\n[object.shape.mesh]\nfile = \"parts/Block.STL\"\nunit = \"mm\"\n";
    let scene =
        Scene::parse(&inline, "s.toml", folder, &[format!("object.shape.mesh.file={}", stl.display())])
            .unwrap();
    assert_eq!(scene.object, again.object);
    assert_eq!(Scene::parse(&inline, "s.toml", folder, &[]).unwrap(), scene);
}

#[test]
fn what_an_object_says_of_its_mesh_is_checked() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("part.stl"), stl(&bracket())).unwrap();
    std::fs::write(folder.join("part.step"), b"ISO-10303-21;").unwrap();
    let path = folder.join("part.toml");
    let message = |lines: &str| {
        std::fs::write(&path, OBJECT.to_owned() + lines).unwrap();
        let error = ObjectFile::load(path.to_str().unwrap()).expect_err("has to be refused").to_string();
        error.strip_prefix(&format!("{}:", path.display())).expect("the place").to_owned()
    };
    for case in cases(include_str!("mesh.cases")) {
        assert_eq!(message(&case.edits[0].0), case.said[0].1);
    }
}

#[test]
fn numbers_of_a_mesh_are_checked() {
    let scene = |mesh: &str| {
        let cube = std::fs::read_to_string(
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/scenes/cube.toml"),
        )
        .unwrap();
        let object = "[object]\nschema = 1\nname = \"b\"\nmass_kg = 0.002\n[object.shape.mesh]\n";
        let text = cube.replace("object = \"cube\"", "") + object + mesh;
        Scene::parse(&text, "s.toml", Path::new(""), &[]).expect_err("has to be refused").to_string()
    };
    let tetrahedron = "vertices_m = [[0, 0, 0], [0.03, 0, 0], [0, 0.03, 0], [0, 0, 0.03]]\n";
    assert_eq!(
        scene(&format!("{tetrahedron}triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2]]\n")),
        "s.toml:54: object.shape.mesh: it is not closed: 3 open edges, the first at triangle 1 from (0, 30, 0) to (30, 0, 0) mm; \
         close the surface in the program that it comes from, and export a solid"
    );
    assert_eq!(
        scene(&format!(
            "{tetrahedron}triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]\nflat_deg = 50\n"
        )),
        "s.toml:57: object.shape.mesh.flat_deg: 50.0 is out of range; has to be between 0.0 and 45.0"
    );
}

#[test]
fn units_and_scales_give_metres() {
    for (unit, metres) in
        [(Unit::Metre, 57.0), (Unit::Centimetre, 0.57), (Unit::Millimetre, 0.057), (Unit::Inch, 1.4478)]
    {
        assert_eq!(unit.metres(57.0), metres);
        assert_eq!(Unit::of(unit.word()), Some(unit));
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let path = folder.join("part.stl");
    std::fs::write(&path, stl(&bracket())).unwrap();
    let size = |unit| match load(path.as_os_str(), Some(unit)).unwrap().0 {
        ShapeFile::Mesh { vertices_m, .. } => vertices_m.iter().map(|v| v[0]).fold(0.0, f64::max),
        _ => 0.0,
    };
    assert_eq!((size(Unit::Millimetre), size(Unit::Centimetre)), (0.06, 0.6));
    let error = load(path.as_os_str(), None).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "{}: a mesh file does not say its unit; add --unit mm if it measures 60 x 40 x 30 mm, --unit cm if it measures 600 x \
             400 x 300 mm, --unit m if it measures 60000 x 40000 x 30000 mm, --unit in if it measures 1524 x 1016 x 762 mm",
            path.display()
        )
    );
}

/// On an inner side of the L, the wall beside it is near.
#[test]
fn a_fingertip_that_would_cut_into_a_wall_is_refused() {
    let scene = |y_mm: f64| {
        let x_mm = 28640.0 / 1520.0;
        let point = format!("contact.2.point_m=[{}, {}, 0]", (20.0 - x_mm) / 1e3, (20.0 - x_mm + y_mm) / 1e3);
        Scene::load("l-bracket", &["contact.2.face=5".to_owned(), point])
    };
    let message = scene(5.0).unwrap_err().to_string();
    assert!(
        message.ends_with(
            "contact.2: fingertip `finger-2` would reach 10.000 mm into another part of the object than face 5; move the contact \
             point away from what rises beside the face, or choose another face"
        ),
        "{message}"
    );
    // Farther away there is room; that the finger does not get there is another matter.
    assert!(scene(16.0).is_ok_and(|_| true) || scene(16.0).unwrap_err().to_string().contains("stays"));
}
