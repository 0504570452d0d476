//! Colours: the palette of Okabe and Ito, which people with any common colour blindness tell apart.

/// A colour: red, green, blue.
pub type Rgb = [u8; 3];

pub(super) const BLUE: Rgb = [0, 114, 178];
pub(super) const VERMILLION: Rgb = [213, 94, 0];
pub(super) const GREEN: Rgb = [0, 158, 115];
pub(super) const ORANGE: Rgb = [230, 159, 0];
pub(super) const SKY: Rgb = [86, 180, 233];
pub(super) const PURPLE: Rgb = [204, 121, 167];
pub(super) const BLACK: Rgb = [0, 0, 0];

/// Text and axes.
pub(super) const INK: Rgb = [38, 42, 48];
/// Text that may be overlooked.
pub(super) const FAINT_INK: Rgb = [104, 110, 120];
/// Grid lines.
pub(super) const GRID: Rgb = [226, 229, 233];
/// Paper.
pub(super) const WHITE: Rgb = [255, 255, 255];

const CYCLE: [Rgb; 7] = [BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, BLACK];

/// The colour of the `k`-th line, or of finger `k`: the same in the plots and in the pictures.
pub fn of(k: usize) -> Rgb {
    CYCLE[k % CYCLE.len()]
}

/// `share` of `a`, the rest of `b`.
pub(super) fn mix(a: Rgb, b: Rgb, share: f64) -> Rgb {
    let channel = |k: usize| (f64::from(a[k]) * share + f64::from(b[k]) * (1.0 - share)).round() as u8;
    [channel(0), channel(1), channel(2)]
}
