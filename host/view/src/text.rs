//! Text in bitmaps: DejaVu Sans, set with its kerning at fractions of a pixel.

use super::canvas::Canvas;
use super::palette::Rgb;
use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};
use std::sync::OnceLock;

/// Plotters' text size in pixels per em, as in its SVG files.
pub const SIZE_PER_EM: f64 = 1.24;

/// The point of the text that sits at the given position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// Its left end.
    Left,
    /// Its middle.
    Centre,
    /// Its right end.
    Right,
}

/// The turn of the text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turn {
    /// Not at all.
    None,
    /// A quarter turn: reads from the bottom to the top.
    Up,
}

/// The font; `None` would mean that the font crate holds no font, which a test rules out.
fn font() -> Option<&'static FontRef<'static>> {
    static FONT: OnceLock<Option<FontRef<'static>>> = OnceLock::new();
    FONT.get_or_init(|| FontRef::try_from_slice(dejavu::sans::regular()).ok()).as_ref()
}

/// Glyphs of one line from (0, 0) on the baseline, and its width.
fn set(font: &FontRef<'static>, words: &str, em: f32) -> (Vec<Glyph>, f32) {
    // The font's own scale is its height from the deepest descender to the highest ascender.
    let scale = PxScale::from(em * font.height_unscaled() / font.units_per_em().unwrap_or(1.0));
    let scaled = font.as_scaled(scale);
    let (mut glyphs, mut x, mut previous) = (Vec::new(), 0.0, None);
    for letter in words.chars() {
        let id = font.glyph_id(letter);
        x += previous.map_or(0.0, |previous| scaled.kern(previous, id));
        glyphs.push(id.with_scale_and_position(scale, point(x, 0.0)));
        x += scaled.h_advance(id);
        previous = Some(id);
    }
    (glyphs, x)
}

/// Width of a line of text, pixels.
pub fn width(words: &str, em: f32) -> f32 {
    font().map_or(0.0, |font| set(font, words, em).1)
}

/// Draws a line of text whose baseline lies `below` pixels under `at`; `em` is the size in pixels.
#[expect(clippy::too_many_arguments, reason = "a text has this many properties, and each is used once")]
pub fn draw(
    canvas: &mut Canvas,
    words: &str,
    at: (i32, i32),
    below: f32,
    em: f32,
    anchor: Anchor,
    turn: Turn,
    colour: Rgb,
) {
    let Some(font) = font() else { return };
    let (glyphs, width) = set(font, words, em);
    let shift = match anchor {
        Anchor::Left => 0.0,
        Anchor::Centre => -width / 2.0,
        Anchor::Right => -width,
    };
    for mut glyph in glyphs {
        glyph.position += point(shift, below);
        let Some(outline) = font.outline_glyph(glyph) else { continue };
        let corner = outline.px_bounds().min;
        outline.draw(|x, y, cover| {
            let (x, y) = (corner.x as i32 + x as i32, corner.y as i32 + y as i32);
            let (x, y) = match turn {
                Turn::None => (x, y),
                Turn::Up => (y, -x),
            };
            canvas.blend(at.0 + x, at.1 + y, colour, cover.clamp(0.0, 1.0));
        });
    }
}

/// At most `length` letters, the last one an ellipsis where some are missing.
pub fn shortened(words: &str, length: usize) -> String {
    if words.chars().count() <= length {
        return words.to_owned();
    }
    words.chars().take(length.saturating_sub(1)).chain(['…']).collect()
}
