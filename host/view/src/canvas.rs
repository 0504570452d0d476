//! A bitmap to draw on: anti-aliased strokes, averaging down, PNG.

use super::palette::{Rgb, WHITE};

/// A bitmap, eight bits a channel, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Canvas {
    /// Pixels from left to right.
    pub width: usize,
    /// Pixels from top to bottom.
    pub height: usize,
    /// Rows from the top, each from the left.
    pub pixels: Vec<Rgb>,
}

impl Canvas {
    /// A white canvas.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![WHITE; width * height] }
    }

    /// Lays `colour` over one pixel; `alpha` from 0 to 1. Nothing happens outside.
    pub fn blend(&mut self, x: i32, y: i32, colour: Rgb, alpha: f32) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return };
        if x >= self.width || y >= self.height {
            return;
        }
        if let Some(pixel) = self.pixels.get_mut(y * self.width + x) {
            for (old, new) in pixel.iter_mut().zip(colour) {
                let value = f32::from(*old) + (f32::from(new) - f32::from(*old)) * alpha;
                *old = (value + 0.5) as u8;
            }
        }
    }

    /// A line through `points`, `width` pixels wide, with round joints and ends. Where it crosses itself it is no darker.
    pub fn stroke(&mut self, points: &[(f32, f32)], width: f32, colour: Rgb, alpha: f32) {
        let reach = width / 2.0 + 1.0;
        let bounds = |of: fn(&(f32, f32)) -> f32, size: usize| {
            let low = points.iter().map(of).fold(f32::INFINITY, f32::min) - reach;
            let high = points.iter().map(of).fold(f32::NEG_INFINITY, f32::max) + reach;
            (low.floor().max(0.0) as usize, (high.ceil().max(-1.0) + 1.0).min(size as f32) as usize)
        };
        let ((left, right), (top, bottom)) = (bounds(|p| p.0, self.width), bounds(|p| p.1, self.height));
        if left >= right || top >= bottom {
            return;
        }
        let columns = right - left;
        let mut coverage = vec![0.0_f32; columns * (bottom - top)];
        let single = [points[0], points[0]];
        let pairs = if points.len() == 1 { &single[..] } else { points };
        for pair in pairs.windows(2) {
            let segment = Segment::new(pair[0], pair[1], width / 2.0);
            let clamp = |v: f32, low: usize, high: usize| (v.max(low as f32) as usize).min(high);
            let x0 = clamp((pair[0].0.min(pair[1].0) - reach).floor(), left, right);
            let x1 = clamp((pair[0].0.max(pair[1].0) + reach).ceil() + 1.0, left, right);
            let y0 = clamp((pair[0].1.min(pair[1].1) - reach).floor(), top, bottom);
            let y1 = clamp((pair[0].1.max(pair[1].1) + reach).ceil() + 1.0, top, bottom);
            for y in y0..y1 {
                let row = (y - top) * columns;
                for x in x0..x1 {
                    let cover = segment.coverage(x as f32, y as f32);
                    if let Some(slot) = coverage.get_mut(row + x - left) {
                        *slot = slot.max(cover);
                    }
                }
            }
        }
        for (k, cover) in coverage.into_iter().enumerate().filter(|(_, cover)| *cover > 0.0) {
            self.blend((left + k % columns) as i32, (top + k / columns) as i32, colour, cover * alpha);
        }
    }

    /// A plain rectangle between two corners, the lower right one included, as far as it is on the canvas.
    pub fn fill(&mut self, from: (i32, i32), to: (i32, i32), colour: Rgb) {
        let clamp = |v: i32, size: usize| usize::try_from(v).unwrap_or(0).min(size);
        let (left, right) = (clamp(from.0, self.width), clamp(to.0.saturating_add(1), self.width));
        let (top, bottom) = (clamp(from.1, self.height), clamp(to.1.saturating_add(1), self.height));
        for row in self.pixels.chunks_exact_mut(self.width.max(1)).take(bottom).skip(top) {
            if let Some(part) = row.get_mut(left..right) {
                part.fill(colour);
            }
        }
    }

    /// Lays another canvas over this one, its upper left corner at `at` (column, row), as far as it fits.
    pub fn paste(&mut self, other: &Self, at: (usize, usize)) {
        let columns = other.width.min(self.width.saturating_sub(at.0));
        let rows = self.pixels.chunks_exact_mut(self.width.max(1)).skip(at.1);
        for (row, source) in rows.zip(other.pixels.chunks_exact(other.width.max(1))) {
            if let (Some(row), Some(source)) = (row.get_mut(at.0..at.0 + columns), source.get(..columns)) {
                row.copy_from_slice(source);
            }
        }
    }

    /// The canvas at `1 / factor` of its size, each pixel the mean of `factor * factor`.
    pub fn reduced(&self, factor: usize) -> Self {
        if factor <= 1 {
            return self.clone();
        }
        let (width, height) = (self.width / factor, self.height / factor);
        let mut pixels = Vec::with_capacity(width * height);
        let count = (factor * factor) as u32;
        let mut sums = vec![[0_u32; 3]; width];
        for y in 0..height {
            sums.fill([0; 3]);
            for row in self.pixels.chunks_exact(self.width).skip(y * factor).take(factor) {
                for (sum, block) in sums.iter_mut().zip(row.chunks_exact(factor)) {
                    for pixel in block {
                        for (total, value) in sum.iter_mut().zip(pixel) {
                            *total += u32::from(*value);
                        }
                    }
                }
            }
            pixels.extend(sums.iter().map(|sum| sum.map(|total| ((total + count / 2) / count) as u8)));
        }
        Self { width, height, pixels }
    }

    /// The canvas as a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// A straight stretch of a stroke.
struct Segment {
    from: (f32, f32),
    along: (f32, f32),
    length_squared: f32,
    /// Squares of the distances at which the pen covers a pixel fully, and not at all.
    full: f32,
    none: f32,
}

impl Segment {
    fn new(from: (f32, f32), to: (f32, f32), radius: f32) -> Self {
        let along = (to.0 - from.0, to.1 - from.1);
        let (inner, outer) = ((radius - 0.5).max(0.0), radius + 0.5);
        Self {
            from,
            along,
            length_squared: along.0 * along.0 + along.1 * along.1,
            full: inner * inner,
            none: outer * outer,
        }
    }

    /// Share of the pixel at `(x, y)` that is covered: one within the pen's radius less half a pixel, none beyond it
    /// plus half a pixel, and linear in the square of the distance between, which needs no root.
    fn coverage(&self, x: f32, y: f32) -> f32 {
        let (dx, dy) = (x - self.from.0, y - self.from.1);
        let along = if self.length_squared > 0.0 {
            ((dx * self.along.0 + dy * self.along.1) / self.length_squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let (ex, ey) = (dx - along * self.along.0, dy - along * self.along.1);
        ((self.none - (ex * ex + ey * ey)) / (self.none - self.full)).clamp(0.0, 1.0)
    }
}
