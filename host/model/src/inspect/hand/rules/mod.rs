//! The rules. A rule a function, rules of a kind a file; each says in its comment why what it finds is a mistake, and
//! when it is none.

pub(super) mod axes;
pub(super) mod drive;
pub(super) mod gains;
pub(super) mod inertia;
pub(super) mod numbers;
pub(super) mod ranges;
pub(super) mod shape;

/// Longer lists are cut.
const MANY: usize = 3;

/// A length in words.
pub(super) fn length(m: f64) -> String {
    match m.abs() {
        0.0 => "0 mm".to_owned(),
        size if size < 1e-3 => format!("{:.3} mm", m * 1e3),
        size if size < 0.1 => format!("{:.1} mm", m * 1e3),
        size if size < 1.0 => format!("{:.0} mm", m * 1e3),
        size if size < 1e4 => format!("{m:.3} m"),
        _ => format!("{m:.3e} m"),
    }
}

/// `a`, `b` and 7 others.
fn names<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    let count = names.len();
    let shown = if count > MANY + 1 { MANY } else { count };
    let words: Vec<String> = names.take(shown).map(|name| format!("`{name}`")).collect();
    match (words.as_slice(), count - shown) {
        ([one], 0) => one.clone(),
        ([first @ .., last], 0) => format!("{} and {last}", first.join(", ")),
        (all, others) => format!("{} and {others} others", all.join(", ")),
    }
}
