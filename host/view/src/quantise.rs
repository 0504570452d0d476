//! At most 255 colours for all frames of an animation: median cut over a histogram.

use super::palette::Rgb;

/// Bits of each channel that tell colours apart.
const BITS: u32 = 6;
const BINS: usize = 1 << (3 * BITS);

/// The palette entry that stands for "as in the frame before".
pub(super) const UNCHANGED: u8 = 255;

/// A palette, and the entry that each colour goes to.
pub(super) struct Quantiser {
    palette: Vec<Rgb>,
    /// Entry of each bin, found when it is first asked for.
    nearest: Vec<Option<u8>>,
}

/// A histogram bin: mean colour and weight.
#[derive(Clone, Copy)]
struct Bin {
    colour: Rgb,
    weight: f64,
}

impl Quantiser {
    /// Chooses the colours that serve these pixels best.
    pub(super) fn new<'a>(pixels: impl Iterator<Item = &'a Rgb>) -> Self {
        let mut sums = vec![([0_u32; 3], 0_u32); BINS];
        for pixel in pixels {
            if let Some((sum, count)) = sums.get_mut(bin(pixel)) {
                *count += 1;
                for (total, value) in sum.iter_mut().zip(pixel) {
                    *total += u32::from(*value);
                }
            }
        }
        let bins: Vec<Bin> = sums
            .into_iter()
            .filter(|(_, count)| *count > 0)
            .map(|(sum, count)| Bin {
                colour: sum.map(|total| ((total + count / 2) / count) as u8),
                // Large plain areas need one entry however large they are.
                weight: f64::from(count.min(4000)),
            })
            .collect();
        Self { palette: median_cut(bins, usize::from(UNCHANGED)), nearest: vec![None; BINS] }
    }

    /// The palette as a GIF file holds it, 256 entries.
    pub(super) fn table(&self) -> Vec<u8> {
        let mut table = self.palette.as_flattened().to_vec();
        table.resize(256 * 3, 0);
        table
    }

    /// The entry for a colour.
    pub(super) fn entry(&mut self, colour: &Rgb) -> u8 {
        let palette = &self.palette;
        let Some(slot) = self.nearest.get_mut(bin(colour)) else { return 0 };
        *slot.get_or_insert_with(|| {
            let distance = |entry: &Rgb| -> i32 {
                entry.iter().zip(colour).map(|(a, b)| (i32::from(*a) - i32::from(*b)).pow(2)).sum()
            };
            palette.iter().enumerate().min_by_key(|(_, entry)| distance(entry)).map_or(0, |(k, _)| k as u8)
        })
    }
}

fn bin(colour: &Rgb) -> usize {
    colour.iter().fold(0, |bin, channel| (bin << BITS) | usize::from(channel >> (8 - BITS)))
}

/// Splits the box with the largest weighted spread at its mean, again and again.
fn median_cut(bins: Vec<Bin>, limit: usize) -> Vec<Rgb> {
    let mut boxes = vec![Spread::new(bins)];
    while boxes.len() < limit {
        let widest = boxes
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.variance.total_cmp(&b.1.variance).then(b.0.cmp(&a.0)))
            .map(|(k, _)| k);
        let Some(k) = widest.filter(|&k| boxes[k].variance > 0.0) else { break };
        let Spread { bins, channel, mean, .. } = boxes.swap_remove(k);
        let (low, high): (Vec<Bin>, Vec<Bin>) =
            bins.into_iter().partition(|bin| f64::from(bin.colour[channel]) <= mean[channel]);
        boxes.push(Spread::new(low));
        boxes.push(Spread::new(high));
    }
    boxes.iter().map(|spread| spread.mean.map(|v| v.round() as u8)).collect()
}

/// Some bins and how they scatter.
struct Spread {
    bins: Vec<Bin>,
    mean: [f64; 3],
    /// The channel in which they scatter most, and how much: the sum of squared distances from the mean; zero for a
    /// single colour.
    channel: usize,
    variance: f64,
}

impl Spread {
    fn new(bins: Vec<Bin>) -> Self {
        let weight: f64 = bins.iter().map(|bin| bin.weight).sum();
        let sum = |of: &dyn Fn(&Bin) -> f64| bins.iter().map(|bin| of(bin) * bin.weight).sum::<f64>();
        let mean = [0, 1, 2].map(|k| sum(&|bin| f64::from(bin.colour[k])) / weight.max(1.0));
        let variances = [0, 1, 2].map(|k| sum(&|bin| (f64::from(bin.colour[k]) - mean[k]).powi(2)));
        let channel = (0..3).max_by(|&a, &b| variances[a].total_cmp(&variances[b])).unwrap_or(0);
        let variance = if bins.len() > 1 { variances[channel] } else { 0.0 };
        Self { bins, mean, channel, variance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_kept_exactly_and_many_nearly() {
        let few = [[255, 255, 255], [0, 114, 178], [213, 94, 0]];
        let mut quantiser = Quantiser::new(few.iter());
        for colour in &few {
            let entry = quantiser.entry(colour);
            assert_eq!(&quantiser.palette[usize::from(entry)], colour);
        }
        let ramp: Vec<Rgb> = (0..=255).flat_map(|v| [[v, v, v], [v, 0, 0], [0, v / 2, v]]).collect();
        let mut quantiser = Quantiser::new(ramp.iter());
        assert!(quantiser.palette.len() <= 255);
        for colour in &ramp {
            let entry = usize::from(quantiser.entry(colour));
            let off = quantiser.palette[entry].iter().zip(colour).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(off <= Some(6), "{colour:?} became {:?}", quantiser.palette[entry]);
        }
        assert_eq!(Quantiser::new(std::iter::empty()).table().len(), 768);
    }
}
