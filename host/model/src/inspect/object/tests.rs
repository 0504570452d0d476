//! Checks of objects that are good, odd, and none.

use super::*;
use blindgrasp_meshes::{Mesh, bracket, grid_box, icosphere, plate};

fn file((vertices, triangles): &Mesh) -> ObjectFile {
    let shape = ShapeFile::mesh(vertices.iter().map(|&v| v.into()).collect(), triangles.clone());
    ObjectFile { density_kg_m3: Some(20.0), ..bare(shape) }
}

fn check(mesh: &Mesh) -> ObjectCheck {
    check_for(mesh, None)
}

fn check_for(mesh: &Mesh, fingertip_m: Option<f64>) -> ObjectCheck {
    ObjectCheck::of(&file(mesh), Vec::new(), &Place::whole("part.toml"), &Wanted { unit: None, fingertip_m })
}

fn findings(check: &ObjectCheck) -> Vec<String> {
    check.findings.iter().map(Finding::to_string).collect()
}

#[test]
fn every_built_in_object_is_good() {
    for name in ["prism", "cube", "hexagonal-prism", "l-bracket", "octahedron"] {
        let check = ObjectCheck::load(name, &Wanted::default()).unwrap();
        assert_eq!((check.verdict, findings(&check)), (Verdict::Good, Vec::new()), "{name}");
        assert!(check.body.is_some() && check.text().contains("good: nothing found"));
    }
}

#[test]
fn numbers_are_those_of_the_body() {
    let check = check(&bracket());
    let body = check.body.as_ref().unwrap();
    assert!(!body.convex);
    assert_eq!((body.vertices, body.triangles, check.faces.len()), (12, 20, 8));
    let near =
        |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    // 60 x 20 and 20 x 20 mm, 30 mm high.
    near(body.volume_m3, 1600.0 * 30.0 * 1e-9);
    near(body.surface_m2, (2.0 * 1600.0 + 200.0 * 30.0) * 1e-6);
    near(body.mass_kg.unwrap(), 20.0 * 48e-6);
    for (found, expected) in body.centre_m.unwrap().into_iter().zip([0.025, 0.015, 0.015]) {
        near(found, expected);
    }
    for (found, expected) in body.extents_m.into_iter().zip([0.06, 0.04, 0.03]) {
        near(found, expected);
    }
    near(body.shortest_edge_m, 0.02);
    near(body.thinnest_wall_m, 0.02);
    let [a, b, c] = body.principal_moments_per_kg_m2;
    assert!(a <= b && b <= c);
    // Widest circles: 15 mm on the sides 60 and 40 mm long, 10 mm on those of 20 mm.
    near(check.faces[2].widest_circle_m, 0.015);
    assert!((check.faces[3].widest_circle_m - 0.01).abs() < 1e-5);
    assert_eq!(
        check.faces.iter().map(|face| face.convex).collect::<Vec<_>>(),
        [false, false, true, true, true, true, true, true]
    );
    assert_eq!(check_for(&plate(), None).faces[0].holes, 1);
}

#[test]
fn what_is_odd_is_found() {
    let scaled =
        |(vertices, triangles): Mesh, by: f64| (vertices.iter().map(|v| v * by).collect(), triangles);
    assert_eq!(
        findings(&check(&scaled(bracket(), 100.0))),
        [
            "warning: part.toml: it measures 6000 x 4000 x 3000 mm; check the unit: a hand grasps things of some centimetres"
        ]
    );
    let mut thin = grid_box([0.06, 0.04, 0.03], 1);
    thin.0.iter_mut().for_each(|v| v.z *= 0.005);
    let said = findings(&check(&thin));
    assert_eq!(said.len(), 2, "{said:?}");
    assert!(said[0].starts_with("notice: part.toml: its shortest edge measures 0.15 mm; leave"), "{said:?}");
    assert!(said[1].starts_with("notice: part.toml: its thinnest wall measures 0.15 mm at ("), "{said:?}");
    let round = findings(&check(&icosphere(0.03, 2)));
    assert_eq!(round.len(), 1, "{round:?}");
    assert!(
        round[0]
            .starts_with("notice: part.toml: it has 320 faces: what is round is made of small flat ones;")
    );
    // A fingertip of 30 mm: its contact has a radius of 13 mm.
    let small = findings(&check_for(&bracket(), Some(0.03)));
    assert_eq!(
        small,
        [
            "notice: part.toml: faces 0, 1, 3, 5, 6: too small for a fingertip of radius 30 mm, whose contact has a radius of 13.08 mm; \
          choose other faces, or smaller fingertips"
        ]
    );
    assert_eq!(check_for(&bracket(), Some(0.1)).verdict, Verdict::Broken);
}

#[test]
fn a_surface_that_cuts_through_itself_is_found() {
    // One corner of a box pushed through the side opposite.
    let mut mesh = grid_box([0.05; 3], 4);
    assert_eq!(findings(&check(&mesh)), Vec::<String>::new());
    mesh.0[12].x += 0.08;
    let said = findings(&check(&mesh));
    assert!(
        said[0].contains("its surface cuts through itself in ") && said[0].starts_with("warning"),
        "{said:?}"
    );
}

#[test]
fn what_is_no_body_is_an_error() {
    let (vertices, mut triangles) = bracket();
    triangles.pop();
    let check = check(&(vertices, triangles));
    assert_eq!(check.verdict, Verdict::Broken);
    assert!(check.body.is_none() && check.faces.is_empty());
    assert!(
        findings(&check)[0]
            .starts_with("error: part.toml: it is not closed: 3 open edges, the first at triangle ")
    );
    assert!(check.text().contains("broken: 1 error"));
}

#[test]
fn all_that_is_wrong_is_told() {
    let mut object = ObjectFile { schema: 2, name: String::new(), ..file(&bracket()) };
    object.density_kg_m3 = Some(-1.0);
    object.inertia_kg_m2 = Some(crate::file::InertiaFile(vec![1.0; 4]));
    let check = ObjectCheck::of(&object, Vec::new(), &Place::whole("part.toml"), &Wanted::default());
    assert_eq!(
        findings(&check),
        [
            "error: part.toml: 2 is a format that this program does not know; write it as format 1",
            "error: part.toml: is not a name; has to be a word of at most 100 bytes, without control characters",
            "error: part.toml: -1.0 is out of range; has to be between 0.001 and 100000.0",
            "error: part.toml: has 4 items; has to be [xx, yy, zz] or [xx, yy, zz, xy, xz, yz]",
        ]
    );
    assert_eq!(
        check.findings.iter().map(|finding| finding.key.as_str()).collect::<Vec<_>>(),
        ["schema", "name", "density_kg_m3", "inertia_kg_m2"]
    );
}
