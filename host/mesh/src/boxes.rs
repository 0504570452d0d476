//! A tree of boxes around triangles: which triangles are near one another, and what a ray meets first.

use blindgrasp_shared::math::norm;
use nalgebra::Vector3;

/// Triangles in a leaf.
const LEAF: usize = 4;

/// The triangles of a surface, in a binary tree of boxes along the axes.
pub struct Boxes {
    /// The triangles' corners, m.
    pub triangles: Vec<[Vector3<f64>; 3]>,
    /// Indices of the triangles, those of a node side by side.
    order: Vec<u32>,
    nodes: Vec<Node>,
}

struct Node {
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// Of `order`.
    from: usize,
    to: usize,
    /// The first half; the second follows it. `None` in a leaf.
    halves: Option<[usize; 2]>,
}

impl Node {
    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }
}

impl Boxes {
    /// Puts triangles into boxes.
    pub fn around(triangles: Vec<[Vector3<f64>; 3]>) -> Self {
        let mut boxes = Self { order: (0..triangles.len() as u32).collect(), triangles, nodes: Vec::new() };
        if !boxes.triangles.is_empty() {
            boxes.split(0, boxes.triangles.len());
        }
        boxes
    }

    /// Makes the node of a range, and those below it: halves along the longest side, at the median.
    fn split(&mut self, from: usize, to: usize) -> usize {
        let corners = |k: &u32| self.triangles[*k as usize].iter();
        let first = self.triangles[self.order[from] as usize][0];
        let all = self.order[from..to].iter().flat_map(corners);
        let (low, high) = all.fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, from, to, halves: None });
        if to - from > LEAF {
            let axis = (high - low).imax();
            let triangles = &self.triangles;
            let place = |k: &u32| triangles[*k as usize].iter().map(|corner| corner[axis]).sum::<f64>();
            let half = (to - from) / 2;
            self.order[from..to]
                .select_nth_unstable_by(half, |a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
            let halves = [self.split(from, from + half), self.split(from + half, to)];
            self.nodes[node].halves = Some(halves);
        }
        node
    }

    /// Calls back with pairs of triangles whose boxes meet, until told to stop or so many pairs have been looked at.
    /// Whether all were.
    pub(super) fn pairs(&self, most: usize, mut visit: impl FnMut(usize, usize)) -> bool {
        let mut waiting = vec![(0, 0)];
        let mut seen = 0;
        while let Some((a, b)) = waiting.pop() {
            let (one, other) = (&self.nodes[a], &self.nodes[b]);
            if !one.meets(other) {
                continue;
            }
            match (one.halves, other.halves) {
                (Some([c, d]), _) if a == b => waiting.extend([(c, c), (d, d), (c, d)]),
                (Some([c, d]), None) => waiting.extend([(c, b), (d, b)]),
                (None, Some([c, d])) => waiting.extend([(a, c), (a, d)]),
                (Some([c, d]), Some([e, f])) => waiting.extend([(c, e), (c, f), (d, e), (d, f)]),
                (None, None) => {
                    for i in one.from..one.to {
                        for j in if a == b { i + 1 } else { other.from }..other.to {
                            visit(self.order[i] as usize, self.order[j] as usize);
                            seen += 1;
                        }
                    }
                }
            }
            if seen > most {
                return false;
            }
        }
        true
    }

    /// Returns the thickness of the thinnest wall, from the middle of each triangle straight inwards to the surface opposite, and
    /// that middle. Infinite where there are no triangles.
    pub fn thinnest_wall_m(&self) -> (f64, Vector3<f64>) {
        let mut thinnest = (f64::INFINITY, Vector3::zeros());
        for (k, [a, b, c]) in self.triangles.iter().enumerate() {
            let area = (b - a).cross(&(c - a));
            let middle = (a + b + c) / 3.0;
            if norm(&area) > 0.0 {
                let wall = self.first(&middle, &(-area / norm(&area)), k);
                if wall < thinnest.0 {
                    thinnest = (wall, middle);
                }
            }
        }
        thinnest
    }

    /// Distance along a ray to the first triangle that it meets, but for the one that it starts on.
    pub(super) fn first(&self, start: &Vector3<f64>, along: &Vector3<f64>, own: usize) -> f64 {
        let mut nearest = f64::INFINITY;
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop() {
            let node = &self.nodes[node];
            if !enters(node, start, along, nearest) {
                continue;
            }
            match node.halves {
                Some(halves) => waiting.extend(halves),
                None => {
                    for &k in self.order[node.from..node.to].iter().filter(|k| **k as usize != own) {
                        nearest = nearest.min(distance(&self.triangles[k as usize], start, along));
                    }
                }
            }
        }
        nearest
    }
}

/// Returns `true` if a ray meets a box before a distance.
fn enters(node: &Node, start: &Vector3<f64>, along: &Vector3<f64>, before: f64) -> bool {
    let (mut from, mut to) = (0.0_f64, before);
    for k in 0..3 {
        let [a, b] = [node.low[k], node.high[k]].map(|side| (side - start[k]) / along[k]);
        // Along the box's side: NaN, which `min` and `max` ignore.
        (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
    }
    from <= to
}

/// Returns the distance at which a ray meets a triangle (Moeller and Trumbore).
fn distance([a, b, c]: &[Vector3<f64>; 3], start: &Vector3<f64>, along: &Vector3<f64>) -> f64 {
    let (ab, ac) = (b - a, c - a);
    let across = along.cross(&ac);
    let volume = ab.dot(&across);
    let from_a = start - a;
    let u = from_a.dot(&across) / volume;
    let turned = from_a.cross(&ab);
    let v = along.dot(&turned) / volume;
    let distance = ac.dot(&turned) / volume;
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 { distance } else { f64::INFINITY }
}
