//! The most that is read. Everything is counted before room is made for it.

pub use blindgrasp_body::polyhedron::MAX_TRIANGLES;

/// Bytes of a file: an ASCII STL file takes about 260 a triangle.
pub const LARGEST_FILE: u64 = 64 << 20;
/// Bytes of a line that holds a vertex.
pub(crate) const LONGEST_LINE: usize = 1000;
/// Corners of a polygon.
pub(crate) const MAX_CORNERS: usize = 1000;
/// Looks from a corner of a polygon at another while the polygons of a file are cut into triangles. A usual polygon takes the
/// square of its corners, one that winds up to the cube; this takes half a second.
pub(crate) const MOST_LOOKS: u64 = 100_000_000;
/// The remedy for a file with too much in it.
pub(crate) const COARSER: &str = "export it with coarser tolerances: a grasp needs its faces, not its finish";
