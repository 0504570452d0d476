//! Draws triangles: a depth buffer, light, dark outlines, and glass on top.

use super::camera::{Camera, View};
use super::canvas::Canvas;
use super::mesh::{Mesh, Triangle};
use super::palette::Rgb;
use nalgebra::Vector3;

/// The share of what is behind it that a pane of glass covers, from the side that faces the viewer and from the other.
const FRONT_COVER: f32 = 0.34;
const REAR_COVER: f32 = 0.22;

/// Draws `mesh` on a white canvas; every pixel is the mean of `samples * samples` finer ones.
///
/// `outline_m` is the step in depth from which on an edge is drawn dark.
pub(super) fn render(
    mesh: &Mesh,
    camera: &Camera,
    (width, height): (usize, usize),
    samples: usize,
    outline_m: f64,
) -> Canvas {
    let camera = camera.magnified(samples as f64);
    let mut raster = Raster {
        canvas: Canvas::new(width * samples, height * samples),
        depth: vec![f32::INFINITY; width * height * samples * samples],
    };
    raster.draw_solid(&mesh.solid, &camera);
    raster.outline(outline_m as f32, samples);
    // A convex body's rear faces don't hide one another, nor do its front faces: no sorting is needed. Where a body is not
    // convex, two front faces may mix their shades in the wrong order, which glass hardly shows.
    let (front, rear): (Vec<_>, Vec<_>) =
        mesh.glass.iter().partition(|pane| pane.normals[0].dot(&camera.view.back) > 0.0);
    for (panes, cover) in [(rear, REAR_COVER), (front, FRONT_COVER)] {
        for pane in panes {
            raster.draw(&Projected::new(pane, &camera), Some(cover));
        }
    }
    raster.depth.fill(f32::INFINITY);
    raster.draw_solid(&mesh.marks, &camera);
    raster.outline(outline_m as f32, samples);
    raster.canvas.reduced(samples)
}

/// A triangle in pixels, lit.
struct Projected {
    corners: [[f32; 3]; 3],
    colours: [[f32; 3]; 3],
}

impl Projected {
    fn new(triangle: &Triangle, camera: &Camera) -> Self {
        Self {
            corners: triangle.corners.map(|corner| camera.project(&corner)),
            colours: triangle.normals.map(|normal| lit(triangle.colour, &normal, &camera.view)),
        }
    }
}

/// A colour under two lights that move with the viewer: a bright one from the upper left, a weak one from the right.
fn lit(colour: Rgb, normal: &Vector3<f64>, view: &View) -> [f32; 3] {
    let n = Vector3::new(view.right.dot(normal), view.up.dot(normal), view.back.dot(normal));
    // Glass is seen from both sides.
    let n = if n.z < 0.0 { -n } else { n };
    let key = n.dot(&Vector3::new(-0.42, 0.66, 0.62)).max(0.0);
    let fill = n.dot(&Vector3::new(0.86, -0.10, 0.50)).max(0.0);
    let brightness = 0.52 + 0.50 * key + 0.13 * fill;
    let gloss = n.dot(&Vector3::new(-0.233, 0.367, 0.901)).max(0.0).powi(32) * 46.0;
    colour.map(|channel| (f64::from(channel) * brightness + gloss).min(255.0) as f32)
}

/// The columns of row `y` in which no weight is negative. Rounding may draw a shared edge twice, which only glass
/// would show, and there by a hair.
fn columns(edges: &[[f32; 3]; 3], y: f32, width: usize) -> std::ops::Range<usize> {
    let (mut from, mut to) = (0.0_f32, width as f32);
    for [start, slope, down] in edges {
        let value = start + down * y;
        if *slope > 0.0 {
            from = from.max((-value / slope).ceil());
        } else if *slope < 0.0 {
            to = to.min((-value / slope).floor() + 1.0);
        } else if value < 0.0 {
            return 0..0;
        }
    }
    from as usize..(to.max(0.0) as usize).min(width)
}

struct Raster {
    canvas: Canvas,
    depth: Vec<f32>,
}

impl Raster {
    /// Draws closed bodies: what faces away from the viewer is hidden by what does not.
    fn draw_solid(&mut self, triangles: &[Triangle], camera: &Camera) {
        let faces_away = |t: &&Triangle| t.normals.iter().all(|normal| normal.dot(&camera.view.back) < 0.0);
        for triangle in triangles.iter().filter(|t| !faces_away(t)) {
            self.draw(&Projected::new(triangle, camera), None);
        }
    }

    /// Draws one triangle where nothing is in front of it; solid, or a pane that covers a share of what is behind it.
    fn draw(&mut self, triangle: &Projected, glass: Option<f32>) {
        let [a, b, c] = triangle.corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        // Also true for a corner that is not a number.
        if !(area.abs() > 1e-6 && area.is_finite()) {
            return;
        }
        let [low, high] = [f32::min, f32::max].map(|of| of(of(a[1], b[1]), c[1]));
        let rows =
            low.ceil().max(0.0) as usize..((high.floor() + 1.0).max(0.0) as usize).min(self.canvas.height);
        // Weights of the corners are linear in the pixel: value at (0, 0) and slopes.
        let edge = |p: [f32; 3], q: [f32; 3]| {
            [(p[0] * q[1] - q[0] * p[1]) / area, (p[1] - q[1]) / area, (q[0] - p[0]) / area]
        };
        let edges = [edge(b, c), edge(c, a), edge(a, b)];
        for y in rows {
            let row = y * self.canvas.width;
            for x in columns(&edges, y as f32, self.canvas.width) {
                let weights = edges.map(|e| e[0] + e[1] * x as f32 + e[2] * y as f32);
                let mean = |values: [f32; 3]| {
                    weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2]
                };
                let depth = mean([a[2], b[2], c[2]]);
                let (Some(nearest), Some(pixel)) =
                    (self.depth.get_mut(row + x), self.canvas.pixels.get_mut(row + x))
                else {
                    continue;
                };
                if depth >= *nearest {
                    continue;
                }
                let [first, second, third] = triangle.colours;
                let colour: [f32; 3] = std::array::from_fn(|k| mean([first[k], second[k], third[k]]));
                let cover = glass.unwrap_or(1.0);
                for (old, new) in pixel.iter_mut().zip(colour) {
                    *old = (f32::from(*old) + (new - f32::from(*old)) * cover + 0.5) as u8;
                }
                if glass.is_none() {
                    *nearest = depth;
                }
            }
        }
    }

    /// Darkens the rim of whatever stands out by more than `step` in front of its neighbour, `pen` pixels wide.
    fn outline(&mut self, step: f32, pen: usize) {
        let (width, height) = (self.canvas.width, self.canvas.height);
        for y in pen..height.saturating_sub(pen) {
            for x in pen..width.saturating_sub(pen) {
                let here = y * width + x;
                let depth = self.depth[here];
                if depth == f32::INFINITY {
                    continue;
                }
                let neighbours = [here - pen, here + pen, here - pen * width, here + pen * width];
                if neighbours.iter().any(|&k| self.depth[k] > depth + step) {
                    for channel in &mut self.canvas.pixels[here] {
                        *channel = (f32::from(*channel) * 0.45) as u8;
                    }
                }
            }
        }
    }
}
