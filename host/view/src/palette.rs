//! Colours: the palette of Okabe and Ito, which people with any common colour blindness tell apart.

/// A colour: red, green, blue.
pub type Rgb = [u8; 3];

/// Blue.
pub const BLUE: Rgb = [0, 114, 178];
/// Vermillion.
pub const VERMILLION: Rgb = [213, 94, 0];
/// Green.
pub const GREEN: Rgb = [0, 158, 115];
/// Orange.
pub const ORANGE: Rgb = [230, 159, 0];
/// Sky.
pub const SKY: Rgb = [86, 180, 233];
/// Purple.
pub const PURPLE: Rgb = [204, 121, 167];
/// Black.
pub const BLACK: Rgb = [0, 0, 0];

/// Text and axes.
pub const INK: Rgb = [38, 42, 48];
/// Text that may be overlooked.
pub const FAINT_INK: Rgb = [104, 110, 120];
/// Grid lines.
pub const GRID: Rgb = [226, 229, 233];
/// Paper.
pub const WHITE: Rgb = [255, 255, 255];

const CYCLE: [Rgb; 7] = [BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, BLACK];

/// The colour of the `k`-th line, or of finger `k`: the same in the plots and in the pictures.
pub fn of(k: usize) -> Rgb {
    CYCLE[k % CYCLE.len()]
}

/// `share` of `a`, the rest of `b`.
pub fn mix(a: Rgb, b: Rgb, share: f64) -> Rgb {
    let channel = |k: usize| (f64::from(a[k]) * share + f64::from(b[k]) * (1.0 - share)).round() as u8;
    [channel(0), channel(1), channel(2)]
}
