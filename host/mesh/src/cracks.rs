//! Closes what should be closed: cracks between vertices that are nearly the same, and edges that end in the middle of another
//! (T-junctions). Holes stay: nobody knows what was there.

use crate::repair::{Mesh, length};
use crate::weld::weld;
use blindgrasp_body::polyhedron::counted;
use blindgrasp_body::polyhedron::surface::{Survey, end, origin, survey};
use blindgrasp_shared::math::norm;

/// Cracks up to this width are closed, in units of the body's diagonal.
const CRACK: f64 = 1e-4;
/// With more open edges than this, junctions are not looked for: every edge is compared with every vertex on an open one.
const MOST_OPEN: usize = 2000;
/// A triangle with junctions on all of its edges takes three rounds.
const ROUNDS: usize = 4;

/// Closes what it can. Where that leads to edges of more than two triangles, it was no crack, and the mesh stays as it was.
pub(super) fn close(mesh: &mut Mesh, edges: Survey, diagonal_m: f64, notices: &mut Vec<String>) -> Survey {
    let tolerance_m = CRACK * diagonal_m;
    let before = (mesh.triangles.clone(), mesh.numbers.clone());
    let open = edges.open.len();
    let mut now = narrow(mesh, &edges, tolerance_m);
    let mut split = 0;
    for _ in 0..ROUNDS {
        if now.open.is_empty() || now.open.len() > MOST_OPEN || mesh.triangles.len() > 2 * before.0.len() {
            break;
        }
        let more = junctions(mesh, &now, tolerance_m);
        if more == 0 {
            break;
        }
        split += more;
        now = survey(&mesh.triangles);
    }
    if !now.crowded.is_empty() && edges.crowded.is_empty() {
        (mesh.triangles, mesh.numbers) = before;
        return edges;
    }
    if now.open.len() < open {
        let closed = open - now.open.len().min(open);
        notices.push(format!(
            "{} closed: cracks of up to {} mm",
            counted(closed, "open edge"),
            length(tolerance_m)
        ));
    }
    if split > 0 {
        notices.push(format!(
            "{} cut at vertices of a neighbour in the middle of an edge",
            counted(split, "triangle")
        ));
    }
    now
}

/// Welds vertices of open edges that are near one another.
fn narrow(mesh: &mut Mesh, edges: &Survey, tolerance_m: f64) -> Survey {
    let rim = rim(mesh, edges);
    let points: Vec<_> = rim.iter().map(|&k| mesh.vertices[k]).collect();
    let mut firsts: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    for (place, first) in weld(&points, tolerance_m).into_iter().enumerate() {
        firsts[rim[place]] = rim[first as usize] as u32;
    }
    mesh.merge(&firsts);
    mesh.drop_degenerate();
    mesh.drop_duplicates();
    survey(&mesh.triangles)
}

/// Cuts triangles whose open edge has vertices of other open edges on it; how many.
fn junctions(mesh: &mut Mesh, edges: &Survey, tolerance_m: f64) -> usize {
    let rim = rim(mesh, edges);
    let mut cut = std::collections::BTreeSet::new();
    for &half in &edges.open {
        // One edge of a triangle at a time.
        let triangle = half as usize / 3;
        if cut.contains(&triangle) {
            continue;
        }
        let (from, to) = (origin(&mesh.triangles, half), end(&mesh.triangles, half));
        let (start, along) = (mesh.vertices[from], mesh.vertices[to] - mesh.vertices[from]);
        let length_m = norm(&along);
        let mut on_edge: Vec<(f64, usize)> = rim
            .iter()
            .filter(|&&k| k != from && k != to)
            .map(|&k| (along.dot(&(mesh.vertices[k] - start)) / length_m, k))
            .filter(|&(place_m, k)| {
                let off = mesh.vertices[k] - start - along * (place_m / length_m);
                place_m > tolerance_m && place_m < length_m - tolerance_m && norm(&off) <= tolerance_m
            })
            .collect();
        if on_edge.is_empty() {
            continue;
        }
        on_edge.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let apex = origin(
            &mesh.triangles,
            blindgrasp_body::polyhedron::surface::next(blindgrasp_body::polyhedron::surface::next(half)),
        );
        if on_edge.iter().any(|&(_, k)| k == apex) {
            continue;
        }
        cut.insert(triangle);
        let stops: Vec<usize> =
            std::iter::once(from).chain(on_edge.into_iter().map(|(_, k)| k)).chain([to]).collect();
        let mut parts = stops.windows(2).map(|pair| [pair[0], pair[1], apex]);
        if let Some(first) = parts.next() {
            mesh.triangles[triangle] = first;
        }
        for part in parts {
            mesh.triangles.push(part);
            mesh.numbers.push(mesh.numbers[triangle]);
        }
    }
    cut.len()
}

/// The vertices of open edges.
fn rim(mesh: &Mesh, edges: &Survey) -> Vec<usize> {
    let ends = |&half: &u32| [origin(&mesh.triangles, half), end(&mesh.triangles, half)];
    let mut rim: Vec<usize> = edges.open.iter().flat_map(ends).collect();
    rim.sort_unstable();
    rim.dedup();
    rim
}
