//! STL and OBJ: the same body in each, and what each of them does to readers.

use super::*;

/// Bit for bit: the same triangles in the same order.
#[test]
fn the_same_body_in_each_format_is_the_same_polyhedron() {
    for mesh in [bracket(), plate(), octahedron(), icosphere(0.03, 2)] {
        let bodies = [("b.stl", binary(&mesh)), ("a.stl", ascii(&mesh)), ("o.obj", wavefront(&mesh))]
            .map(|(name, bytes)| read(name, &bytes).unwrap());
        for body in &bodies {
            assert_eq!(body.notices, Vec::<String>::new());
            assert_eq!((body.vertices.len(), body.triangles.len()), (mesh.0.len(), mesh.1.len()));
            assert_eq!(polyhedron(body), polyhedron(&bodies[0]));
        }
    }
}

/// A face with a notch, and one on whose straight edge a neighbour has a corner.
#[test]
fn polygons_of_an_obj_may_be_concave_and_touch_anywhere() {
    let mut text = String::new();
    for z in [0, 30] {
        for [x, y] in [[0, 0], [60, 0], [60, 20], [20, 20], [20, 40], [0, 40]] {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    // A corner in the middle of the first side's lower edge: the side has it, and so has the bottom.
    text += "v 30 0 0\n";
    text += "f 6 5 4 3 2 13 1\nf 7 8 9 10 11 12\nf 1 13 2 8 7\n";
    for k in 2..=6 {
        let next = k % 6 + 1;
        text += &format!("f {k} {next} {} {}\n", next + 6, k + 6);
    }
    let body = read("p.obj", text.as_bytes()).unwrap();
    assert_eq!(body.notices, Vec::<String>::new());
    let found = polyhedron(&body);
    let expected = polyhedron(&read("b.stl", &binary(&bracket())).unwrap());
    assert_eq!(found.faces.len(), 8);
    for (face, like) in found.faces.iter().zip(&expected.faces) {
        assert!(
            (face.normal - like.normal).norm() < 1e-14 && (face.distance_m - like.distance_m).abs() < 1e-16
        );
        assert_eq!(face.corners.len(), like.corners.len(), "the corner in the middle of an edge is none");
    }
    let volume = |body: &Polyhedron| body.mass_properties().volume_m3;
    assert!((volume(&found) / volume(&expected) - 1.0).abs() < 1e-14);
}

/// Random polygons around a point, with any notches: the triangles add up to the area, and none is turned over.
#[test]
fn polygons_are_cut_without_gaps_or_overlaps() {
    let mut numbers = blindgrasp_meshes::Numbers(40);
    for _ in 0..500 {
        let count = 3 + numbers.below(40);
        let mut angles: Vec<f64> = (0..count).map(|_| numbers.unit() * std::f64::consts::TAU).collect();
        angles.sort_by(f64::total_cmp);
        if angles.windows(2).any(|pair| pair[1] - pair[0] < 1e-3 || pair[1] - pair[0] > 3.0)
            || angles[0] + std::f64::consts::TAU - angles[count - 1] > 3.0
        {
            continue;
        }
        let turn = numbers.rotation();
        let flat: Vec<Vector3<f64>> = angles
            .iter()
            .map(|angle| {
                let (sine, cosine) = blindgrasp_shared::math::Real::sine_cosine(*angle);
                Vector3::new(cosine, sine, 0.0) * (0.2 + numbers.unit())
            })
            .collect();
        let corners: Vec<Vector3<f64>> = flat.iter().map(|p| turn * p).collect();
        let area = |[a, b, c]: [Vector3<f64>; 3]| (b - a).cross(&(c - a)).z / 2.0;
        let whole: f64 = (0..count).map(|k| area([Vector3::zeros(), flat[k], flat[(k + 1) % count]])).sum();
        let parts = polygon::triangles(&corners, &mut 1_000_000).unwrap();
        assert_eq!(parts.len(), count - 2);
        let parts: Vec<f64> = parts.iter().map(|part| area(part.map(|k| flat[k]))).collect();
        assert!(parts.iter().all(|area| *area > -1e-12), "turned over");
        assert!((parts.iter().sum::<f64>() - whole).abs() < 1e-12);
    }
}

#[test]
fn stl_files_are_told_apart_by_their_length() {
    let plain = binary(&bracket());
    let expected = polyhedron(&read("b.stl", &plain).unwrap());
    let same = |bytes: &[u8]| polyhedron(&read("x.stl", bytes).unwrap()) == expected;
    // A binary file that says `solid`, even as a line of its own.
    let mut named = plain.clone();
    named[..12].copy_from_slice(b"solid cube\r\n");
    assert!(same(&named));
    // Something behind the triangles.
    assert!(same(&[plain.clone(), vec![7; 1000]].concat()));

    let text = ascii(&bracket());
    let edited =
        |from: &str, to: &str| String::from_utf8(text.clone()).unwrap().replace(from, to).into_bytes();
    assert!(same(&text));
    assert!(same(&text.to_ascii_uppercase()));
    assert!(same(&edited("\n", "\r\n")));
    assert!(same(&edited("\n", "\r")));
    assert!(same(&edited(" part", "")), "no name");
    assert!(same(&[b"\xef\xbb\xbf\n  ", &text[..]].concat()), "a byte order mark and blanks");
    assert!(same(&[b"solid caf\xe9\n", &text[11..]].concat()), "a name in another encoding");
    assert!(
        same(&edited("    endloop\n  endfacet\n", "    endloop\n\n  endfacet\nendsolid part\nsolid more\n")),
        "many solids"
    );
    assert!(same(&edited("vertex 60 ", "vertex 6.0e+01 ")));
}

#[test]
fn stl_files_that_lie_are_refused() {
    let (plain, text) = (binary(&bracket()), ascii(&bracket()));
    let text = String::from_utf8(text).unwrap();
    let refusal = |bytes: &[u8]| refusal("x.stl", bytes);
    assert_eq!(refusal(b""), "is too short for an STL file; export it again");
    assert_eq!(refusal(&plain[..80]), "is too short for an STL file; export it again");
    let mut empty = plain[..84].to_vec();
    empty[80..].fill(0);
    assert_eq!(refusal(&empty), "it has no triangles; export the body as a mesh of triangles");
    assert_eq!(
        refusal(&plain[..1000]),
        "its header says 20 triangles, but there is room for 18; it was cut off, or is no STL file: export it again"
    );
    // A bomb: no room is made for what is not there.
    let mut bomb = plain.clone();
    bomb[80..84].fill(0xff);
    assert_eq!(
        refusal(&bomb),
        "its header says 4294967295 triangles, but there is room for 20; it was cut off, or is no STL file: export it again"
    );
    let mut solid = bomb;
    solid[..6].copy_from_slice(b"solid ");
    assert_eq!(
        refusal(&solid),
        refusal(&{
            let mut b = plain.clone();
            b[80..84].fill(0xff);
            b
        })
    );
    let many: Vec<u8> = [&[0; 80], &200_001_u32.to_le_bytes()[..], &vec![0; 50 * 200_001]].concat();
    assert_eq!(
        refusal(&many),
        "has 200001 triangles: at most 200000 are read; export it with coarser tolerances: a grasp needs its faces, not its finish"
    );
    for (value, at) in [(f32::NAN, 100), (f32::INFINITY, 196)] {
        let mut odd = plain.clone();
        odd[at..at + 4].copy_from_slice(&value.to_le_bytes());
        let triangle = (at - 84) / 50 + 1;
        assert_eq!(
            refusal(&odd),
            format!("triangle {triangle} has a corner that is not a number; export it again")
        );
    }
    assert_eq!(
        refusal(&text.as_bytes()[..text.len() / 2]),
        "ends without `endsolid`; it was cut off: export it again"
    );
    assert_eq!(
        refusal(text.replacen("vertex 60 0 0", "vertex 60 0 nan", 1).as_bytes()),
        "line 6: `nan` is not a finite number; export it again"
    );
    assert_eq!(
        refusal(text.replacen("vertex 0 0 30", "vertex 0 0", 1).as_bytes()),
        "triangle 5 (line 30): vertex f32 f32 f32, got [\"vertex\", \"0\", \"0\"]; export it again"
    );
    assert_eq!(
        refusal(text.replacen("outer loop", "outer", 1).as_bytes()),
        "triangle 1 (line 2): expected [\"outer\", \"loop\"], got [\"outer\"]; export it again"
    );
    assert_eq!(
        refusal(text.replacen("vertex 0 0 0", &"vertex 0 0 0".repeat(100), 1).as_bytes()),
        "line 4 has 1200 bytes; export it again: a line holds a vertex"
    );
    assert_eq!(refusal(b"solid\nendsolid\n"), "it has no triangles; export the body as a mesh of triangles");
    assert_eq!(
        refusal(&b"\x89PNG\r\n\x1a\n".repeat(20)),
        "its header says 1196314761 triangles, but there is room for 1; it was cut off, or is no STL file: export it again"
    );
}

#[test]
fn obj_files_in_all_their_forms() {
    let text = String::from_utf8(wavefront(&bracket())).unwrap();
    let expected = polyhedron(&read("o.obj", text.as_bytes()).unwrap());
    let same = |text: &str| polyhedron(&read("x.obj", text.as_bytes()).unwrap()) == expected;
    let faces = |form: &dyn Fn(&str) -> String| {
        let lines = text.lines().map(|line| match line.strip_prefix("f ") {
            Some(corners) => "f ".to_owned() + &corners.split(' ').map(form).collect::<Vec<_>>().join(" "),
            None => line.to_owned(),
        });
        lines.collect::<Vec<_>>().join("\n")
    };
    assert!(same(&text.replace('\n', "\r\n")));
    assert!(same(&text.replace('\n', "\r")));
    // Indices of texture coordinates and normals that there are not, some of them absurd.
    assert!(same(&faces(&|k| format!("{k}/1/1"))));
    assert!(same(&faces(&|k| format!("{k}//7"))));
    assert!(same(&faces(&|k| format!("{k}/-99999999999/0"))));
    assert!(same(&("vt 0 0\nvn nonsense\n".to_owned() + &faces(&|k| format!("{k}/9223372036854775807/1")))));
    assert!(same(&faces(&|k| format!("{}", k.parse::<i64>().unwrap() - 13))), "counted from the end");
    // Groups, colours, a weight, a line that goes on, points and lines and curves, another encoding.
    assert!(same(&text.replace("f 2 9 ", "g more\nusemtl red\nusemtl\ns off\nf 2 9 ")));
    assert!(same(&text.replace("v 60 0 0\n", "v 60 0 0 0.5 0.5 0.5\n")));
    assert!(same(&text.replace("v 60 0 0\n", "v 120 0 0 2\n")));
    assert!(same(&text.replace("v 60 0 0\n", "  v\t60 \\\n 0 0\np 1\nl 1 2\ncurv 0 1 1 2\n")));
    let latin = [b"# caf\xe9\no caf\xe9\n", text.as_bytes()].concat();
    assert!(polyhedron(&read("x.obj", &latin).unwrap()) == expected);
}

#[test]
fn obj_files_that_lie_are_refused() {
    let text = String::from_utf8(wavefront(&bracket())).unwrap();
    let refusal = |text: &str| refusal("x.obj", text.as_bytes());
    let changed = |from: &str, to: &str| refusal(&text.replacen(from, to, 1));
    assert_eq!(refusal(""), "has no face; export the surface of the body; is this an OBJ file?");
    assert_eq!(refusal("v 1 2 3\n"), "has no face; export the surface of the body; is this an OBJ file?");
    assert_eq!(
        changed("f 1 3 2", "f 1 3 13"),
        "line 15: vertex 13, but there are 12 vertices; export it again"
    );
    assert_eq!(
        changed("f 1 3 2", "f 1 3 0"),
        "line 15: vertex 0, but there are 12 vertices; export it again"
    );
    assert_eq!(
        changed("f 1 3 2", "f 1 3 -13"),
        "line 15: vertex -13, but there are 12 vertices; export it again"
    );
    assert_eq!(
        changed("f 1 3 2", "f 1 3 9223372036854775807"),
        "line 15: vertex 9223372036854775807, but there are 12 vertices; export it again"
    );
    assert_eq!(
        changed("f 1 3 2", "f 1 3 x"),
        "line 15: `f 1 3 x` is no face; has to be `f` and the numbers of its vertices"
    );
    assert_eq!(
        changed("f 1 3 2", "f 1 3"),
        "face 1 has 2 corners; export a surface: points and lines enclose no body"
    );
    assert_eq!(
        changed("f 1 3 2", "f "),
        "face 1 has 0 corners; export a surface: points and lines enclose no body"
    );
    assert_eq!(
        changed("v 60 0 0", "v 60 0"),
        "line 4: `v 60 0` is no vertex; has to be `v x y z`, in numbers"
    );
    assert_eq!(
        changed("v 60 0 0", "v 60 0 0 0"),
        "line 4: scaling (w) by zero; export it again as triangles or polygons"
    );
    assert_eq!(
        changed("v 60 0 0", "v 60 0 nan"),
        "face 1 has a corner that is not a number; export it again"
    );
    assert_eq!(
        changed("v 60 0 0", "v 60 0 1e999"),
        "face 1 has a corner that is not a number; export it again"
    );
    let coarser = "export it with coarser tolerances: a grasp needs its faces, not its finish";
    assert_eq!(
        refusal(&("f".to_owned() + &" 1".repeat(1001))),
        format!("line 1: a face with 1001 corners: at most 1000 are read; {coarser}")
    );
    assert_eq!(
        refusal(&"f 1 2 3\n".repeat(200_001)),
        format!("has 200001 triangles: at most 200000 are read; {coarser}")
    );
    assert_eq!(
        refusal(&"v 1 2 3\n".repeat(600_001)),
        format!("has 600001 vertices: at most 600000 are read; {coarser}")
    );
    assert_eq!(refusal(&("v ".to_owned() + &"1".repeat(1000))), format!("line 1 has 1002 bytes; {coarser}"));
}
