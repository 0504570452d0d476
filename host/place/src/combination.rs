//! Combinations of faces that the fingertips touch: every choice of faces, fingertips left open, rated where it is
//! cheapest, in the middle of the faces.

use super::facet::Facet;
use super::quality::chance;
use super::rolling::{Gains, Middle};
use blindgrasp_body::MAX_FINGERS;

/// Faces that are looked at: so many that there are at most this many combinations.
const MOST_COMBINATIONS: usize = 300_000;
/// More faces than these are never looked at.
const MOST_FACES: usize = 60;

/// Faces for the fingertips that may choose, as indices into the facets, in rising order: fingertips may share a face.
pub(super) type Choice = [u8; MAX_FINGERS];

/// A choice and its chance to hold with contacts in the middle of the faces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Combination {
    pub(super) choice: Choice,
    pub(super) chance: f64,
}

/// Returns the most faces that are looked at for so many fingertips.
pub(super) fn most_faces(fingertips: usize) -> usize {
    let combinations = |faces: usize| (1..=fingertips).fold(1, |count, k| count * (faces + k - 1) / k);
    (1..=MOST_FACES).take_while(|&faces| combinations(faces) <= MOST_COMBINATIONS).last().unwrap_or(1)
}

/// The ratings of the combinations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rated {
    /// The number of all of them.
    pub(super) all: usize,
    /// The number of those that the law can't press on: it would pull a fingertip away from its face.
    pub(super) pulled_off: usize,
}

/// Rates all choices of `free` faces beside the fixed ones. The best `most`, the best first.
pub(super) fn rate(
    facets: &[Facet],
    fixed: &[&Facet],
    free: usize,
    rolling_radii_m: &[f64],
    gains: Gains,
    most: usize,
) -> (Vec<Combination>, Rated) {
    let mut rated = Rated::default();
    let mut found: Vec<Combination> = Vec::new();
    let unit_m = rolling_radii_m.iter().sum::<f64>() / rolling_radii_m.len() as f64;
    let mut choice: Choice = [0; MAX_FINGERS];
    let mut chosen: Vec<&Facet> = fixed.to_vec();
    loop {
        chosen.truncate(fixed.len());
        chosen.extend(choice[..free].iter().map(|&k| &facets[k as usize]));
        rated.all += 1;
        let middle = Middle::new(&chosen, rolling_radii_m, gains);
        if middle.least_depth_m() > 0.0 {
            let margin = chosen.iter().map(|facet| facet.margin_m).fold(f64::INFINITY, f64::min);
            let chance = chance(margin / unit_m, middle.mean_square_turn());
            found.push(Combination { choice, chance });
        } else {
            rated.pulled_off += 1;
        }
        if !advance(&mut choice[..free], facets.len()) {
            break;
        }
    }
    // Equal ones in the order of their faces.
    let better =
        |a: &Combination, b: &Combination| b.chance.total_cmp(&a.chance).then(a.choice.cmp(&b.choice));
    if found.len() > most {
        found.select_nth_unstable_by(most, better);
        found.truncate(most);
    }
    found.sort_by(better);
    (found, rated)
}

/// The next choice in rising order; false after the last.
fn advance(choice: &mut [u8], faces: usize) -> bool {
    let Some(at) = choice.iter().rposition(|&k| usize::from(k) + 1 < faces) else { return false };
    let next = choice[at] + 1;
    choice[at..].fill(next);
    true
}

/// Every order of some faces, each once, in rising order.
pub(super) fn orders(choice: &[u8]) -> Vec<Vec<u8>> {
    let mut order = choice.to_vec();
    order.sort_unstable();
    let mut all = vec![order.clone()];
    // The next permutation in lexicographic order.
    while let Some(at) = order.windows(2).rposition(|pair| pair[0] < pair[1]) {
        let swap = order.iter().rposition(|&k| k > order[at]).unwrap_or(at);
        order.swap(at, swap);
        order[at + 1..].reverse();
        all.push(order.clone());
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_choice_comes_once() {
        let mut choice = [0; 3];
        let mut all = vec![choice];
        while advance(&mut choice, 5) {
            all.push(choice);
        }
        // Multisets: C(5 + 3 - 1, 3).
        assert_eq!(all.len(), 35);
        assert!(all.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(all.iter().all(|choice| choice.is_sorted()));
        assert!(!advance(&mut [], 5), "nothing to choose");
    }

    #[test]
    fn orders_are_all_and_different() {
        assert_eq!(orders(&[3, 1, 2]).len(), 6);
        assert_eq!(orders(&[1, 1, 2, 2, 2]).len(), 10);
        assert_eq!(orders(&[7, 7]), [[7, 7]]);
        assert_eq!(orders(&[]), [Vec::<u8>::new()]);
        let all = orders(&[0, 1, 2, 3, 4]);
        assert!(all.len() == 120 && all.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn so_many_faces_that_it_stays_fast() {
        assert_eq!([2, 3, 4, 5].map(most_faces), [60, 60, 50, 30]);
    }
}
