//! Pictures of sweeps: every field and mark where it belongs, and nothing beyond the edge.

use super::super::pens::LABEL_SIZE;
use super::*;
use blindgrasp_view::Files;
use blindgrasp_view::text;
use std::collections::BTreeMap;

fn svg(files: Files) -> String {
    let [png, svg] = files;
    assert!(png.unwrap().len() > 5000);
    let svg = String::from_utf8(svg.unwrap()).unwrap();
    assert!(svg.starts_with("<svg width=\"960\"") && svg.trim_end().ends_with("</svg>"));
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    nothing_is_clipped(&svg);
    svg
}

/// An attribute of an element's text.
fn attribute<'a>(element: &'a str, name: &str) -> &'a str {
    let from =
        element.find(&format!(" {name}=\"")).unwrap_or_else(|| panic!("{name}: {element}")) + name.len() + 3;
    &element[from..from + element[from..].find('"').unwrap()]
}

fn number(element: &str, name: &str) -> f64 {
    attribute(element, name).parse().unwrap()
}

/// The words of the picture, with their elements.
fn words(svg: &str) -> Vec<(&str, &str)> {
    let texts = svg.split("<text").skip(1).map(|element| element.split_once('>').unwrap());
    texts.map(|(element, rest)| (element, rest.split_once("\n</text>").unwrap().0.trim())).collect()
}

fn says(svg: &str, wanted: &str) -> bool {
    words(svg).iter().any(|(_, words)| *words == wanted)
}

/// All words lie within the picture, and no two of those that lie flat over each other.
fn nothing_is_clipped(svg: &str) {
    let view: Vec<f64> = attribute(svg, "viewBox").split(' ').map(|v| v.parse().unwrap()).collect();
    let mut boxes: Vec<([f64; 4], &str)> = Vec::new();
    for (element, words) in words(svg) {
        let em = number(element, "font-size");
        let length = f64::from(text::width(words, em as f32));
        let (x, y) = (number(element, "x"), number(element, "y"));
        let start = match attribute(element, "text-anchor") {
            "start" => 0.0,
            "middle" => -0.5,
            _ => -1.0,
        } * length;
        if element.contains("rotate") {
            // Reads upwards.
            assert!(y - start - length >= 0.0 && y - start <= view[3], "{words}: from {y}");
            continue;
        }
        let drop = match attribute(element, "dy") {
            "0.76em" => 0.76,
            "0.5ex" => 0.27,
            _ => -0.27,
        } * em;
        let [left, right, top, bottom] =
            [x + start, x + start + length, y + drop - 0.76 * em, y + drop + 0.24 * em];
        assert!(left >= 0.0 && right <= view[2] && top >= 0.0 && bottom <= view[3], "{words}: {x}, {y}");
        for (other, others) in &boxes {
            let is_clear = right < other[0] || left > other[1] || bottom < other[2] || top > other[3];
            assert!(is_clear, "`{words}` lies over `{others}`");
        }
        boxes.push(([left, right, top, bottom], words));
    }
    assert!(boxes.len() > 5 && f64::from(LABEL_SIZE) > 0.0);
}

/// Returns `true` if a line goes neither along nor up.
fn is_slanted(line: &str) -> bool {
    let points: Vec<(&str, &str)> =
        attribute(line, "points").split_whitespace().map(|point| point.split_once(',').unwrap()).collect();
    points.len() == 2 && points[0].0 != points[1].0 && points[0].1 != points[1].1
}

/// Returns the number of rectangles of each colour.
fn colours(svg: &str) -> BTreeMap<&str, usize> {
    let mut colours = BTreeMap::new();
    for rectangle in svg.split("<rect").skip(2) {
        *colours.entry(attribute(rectangle, "fill")).or_default() += 1;
    }
    colours
}

fn variable(name: &str, unit: &str, spread: Spread, count: usize) -> Variable {
    let values = (0..count).map(|k| format!("value {k}")).collect();
    Variable { name: name.to_owned(), unit: unit.to_owned(), spread, values }
}

fn linear(count: usize) -> Variable {
    let numbers = (0..count).map(|k| k as f64 / (count - 1) as f64).collect();
    variable("friction.scale", "", Spread::Linear(numbers), count)
}

fn logarithmic(count: usize) -> Variable {
    let numbers = (0..count).map(|k| 10_f64.powf(-4.0 + 3.0 * k as f64 / (count - 1) as f64)).collect();
    variable("control.attitude_stiffness_nm", "N m", Spread::Logarithmic(numbers), count)
}

/// Rows from the bottom: `.` at rest, `o` moving, `x` lost, `/` refused, a space for what is not known.
fn map(x: Variable, y: Variable, rows: &[&str]) -> Map {
    let mark = |(k, c): (usize, char)| match c {
        '.' => Some(Mark::Rested(0.5 + 0.01 * k as f64)),
        'o' => Some(Mark::Moving(8.0)),
        'x' => Some(Mark::Lost(2.0 + k as f64)),
        '/' => Some(Mark::Refused),
        _ => None,
    };
    let marks = rows.iter().map(|row| row.chars().enumerate().map(mark).collect()).collect();
    Map { title: "cube over this and that".into(), x, y, marks }
}

#[test]
fn a_map_has_a_field_for_each_run_and_a_border_between_held_and_lost() {
    let map = map(linear(5), logarithmic(4), &["xx...", "xx..o", "x/ oo", "....."]);
    let svg = svg(map.files());
    let grey = colours(&svg)["#BABFC7"];
    assert_eq!(grey, 3 + 1, "three that moved, and one in the key");
    let width = |rectangle: &str| number(rectangle, "width");
    let fields = svg.split("<rect").skip(2).filter(|rectangle| width(rectangle) > 200.0).count();
    assert_eq!(fields, 18, "a field for each run that ran, and none where nothing is known");
    let slanted = svg.split("<polyline").skip(1).filter(|line| is_slanted(line)).count();
    assert_eq!(slanted, 2 + 2, "a cross for what was refused, and one in the key");
    // Between the columns twice beside `xx.`, once beside `x/` (nothing is known of `/`); between the rows `x` under `.`.
    let border = svg.split("<polyline").skip(1).filter(|line| attribute(line, "stroke") == "#262A30");
    let (mut upright, mut flat) = (0, 0);
    for line in border {
        let points: Vec<&str> = attribute(line, "points").split_whitespace().collect();
        let [(x, _), (to_x, _)] = [0, 1].map(|k| points[k].split_once(',').unwrap());
        *if x == to_x { &mut upright } else { &mut flat } += 1;
    }
    assert_eq!((upright, flat), (2, 1));
    for expected in [
        "cube over this and that",
        "friction.scale",
        "control.attitude_stiffness_nm, N m",
        "held, at rest from",
        "lost at",
        "held, still moving",
        "refused",
        "0.25",
        "0.0001",
        "0.1",
    ] {
        assert!(says(&svg, expected), "{expected}");
    }
}

#[test]
fn the_key_explains_what_there_is_and_nothing_else() {
    let held = svg(map(linear(3), linear(2), &["...", "..."]).files());
    assert!(says(&held, "held, at rest from") && !says(&held, "lost at") && !says(&held, "refused"));
    let refused = svg(map(linear(3), linear(2), &["///", "///"]).files());
    assert!(says(&refused, "refused") && !says(&refused, "held, at rest from"));
}

#[test]
fn maps_of_any_size_are_drawn_without_words_over_words() {
    for (across, up) in [(1, 1), (2, 1), (1, 3), (40, 30), (101, 2), (3, 70)] {
        let named = |count| variable("object", "", Spread::Listed, count);
        let row: String = (0..across).map(|k| if k % 3 == 0 { 'x' } else { '.' }).collect();
        let rows = vec![row.as_str(); up];
        svg(map(named(across), named(up), &rows).files());
        if across > 1 && up > 1 {
            svg(map(linear(across), logarithmic(up), &rows).files());
            svg(map(logarithmic(across), linear(up), &rows).files());
        }
    }
    // Long names of keys and values, large and small numbers.
    let mut long = variable(&"hand.joint.*.".repeat(9), "N m s/rad", Spread::Listed, 6);
    long.values = (0..6).map(|k| format!("models/objects/a-long-name-of-an-object-{k}.toml")).collect();
    let tiny = variable("a.b_kg_m2", "kg m^2", Spread::Linear(vec![1e-9, 2e-9, 3e-9, 4e-9, 5e-9, 6e-9]), 6);
    let huge = variable("k", "N/m^2", Spread::Linear(vec![-1e7, 1e7, 3e7, 5e7, 7e7, 9e7]), 6);
    for (x, y) in
        [(long.clone(), tiny.clone()), (tiny.clone(), long), (huge.clone(), tiny.clone()), (tiny, huge)]
    {
        svg(map(x, y, &["..x/o."; 6]).files());
    }
}

fn curve(x: Variable, marks: &str) -> Curve {
    let dot = |(value, c): (usize, char)| {
        let mark = match c {
            '.' => Mark::Rested(0.5 + 0.1 * value as f64),
            'o' => Mark::Moving(8.0),
            'x' => Mark::Lost(2.0),
            _ => Mark::Refused,
        };
        Dot { value, mark, friction: 0.3 + 0.1 * value as f64 }
    };
    Curve { title: "cube over this".into(), x, dots: marks.chars().enumerate().map(dot).collect() }
}

#[test]
fn a_curve_has_a_mark_for_each_run() {
    let svg = svg(curve(logarithmic(9), "xx..oo.x/").files());
    let circles = |colour: &str| {
        let circles = svg.split("<circle").skip(1);
        circles.filter(|circle| attribute(circle, "fill") == colour).count()
    };
    // In both panels; and one in the key.
    assert_eq!(circles("#0072B2"), 2 * 3 + 1, "at rest");
    assert_eq!(circles("#FFFFFF"), 2 * 2 + 1, "still moving");
    let crosses =
        svg.split("<polyline").skip(1).filter(|line| attribute(line, "stroke") == "#D55E00").count();
    assert_eq!(crosses, 2 * (3 + 1), "two strokes for each loss");
    // The bands in which it is lost: at three values in both panels, and in the key.
    assert_eq!(colours(&svg)["#FAEADE"], 2 * 3 + 1);
    for expected in [
        "cube over this",
        "held, at rest from",
        "held, still moving",
        "lost at",
        "grasp lost",
        "refused",
        "time, s",
        "friction needed, max",
    ] {
        assert!(says(&svg, expected), "{expected}");
    }
}

#[test]
fn curves_of_any_size_are_drawn_without_words_over_words() {
    for marks in [".", "x", "/", "..", "/x", &".ox/".repeat(20)] {
        let count = marks.chars().count();
        svg(curve(variable("object", "", Spread::Listed, count), marks).files());
        let bisected = (0..count).map(|k| 1.0 + 0.5_f64.powi(k as i32)).collect();
        svg(curve(variable("control.force_n", "N", Spread::Linear(bisected), count), marks).files());
    }
    // Zero beside decades: left of all others, with its own label.
    for count in [3, 40] {
        let mut numbers = vec![0.0];
        numbers.extend((0..count - 1).map(|k| 10_f64.powf(-3.0 + 6.0 * f64::from(k) / f64::from(count - 2))));
        let zero = variable("friction.scale", "", Spread::Logarithmic(numbers), count as usize);
        let places = zero.places();
        assert!(places[1..].windows(2).all(|pair| pair[0] < pair[1]) && places[0] < places[1]);
        let svg = svg(curve(zero, "x.o".repeat(count as usize).get(..count as usize).unwrap()).files());
        assert!(says(&svg, "0"), "{count}");
    }
    // Friction over decades.
    let mut wide = curve(linear(6), "......");
    for (k, dot) in wide.dots.iter_mut().enumerate() {
        dot.friction = 10_f64.powi(k as i32 * 2);
    }
    assert!(says(&svg(wide.files()), "10⁶"));
}
