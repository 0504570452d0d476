//! Elements of an SVG file. What is not a number is left out.

use super::super::palette::Rgb;
use blindgrasp_shared::math::Real;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Fonts that are about as wide as each other, one of which every system has.
const FONTS: &str = "DejaVu Sans, Verdana, Arial, Helvetica, sans-serif";

/// The point of a text that sits at its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A picture under way.
#[derive(Default)]
pub(super) struct Svg {
    definitions: String,
    defined: BTreeSet<String>,
    body: String,
    rods: usize,
}

impl Svg {
    /// The file.
    pub(super) fn finish(self, width: f64, height: f64) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
             height=\"{height:.0}\" font-family=\"{FONTS}\">\n<defs>\n{}</defs>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{}</svg>\n",
            self.definitions, self.body
        )
    }

    /// A closed shape, with its holes.
    pub(super) fn shape(&mut self, outlines: &[Vec<[f64; 2]>], fill: &str, edge: Rgb, width: f64) {
        let Some(path) = path(outlines.iter().map(Vec::as_slice), true) else { return };
        let edge = hex(edge);
        let _ = writeln!(
            self.body,
            "<path d=\"{path}\" fill=\"{fill}\" fill-rule=\"evenodd\" stroke=\"{edge}\" stroke-width=\"{width}\" \
             stroke-linejoin=\"round\"/>"
        );
    }

    /// A shape without an edge.
    pub(super) fn fill(&mut self, outline: &[[f64; 2]], fill: &str) {
        if let Some(path) = path(std::iter::once(outline), true) {
            let _ = writeln!(self.body, "<path d=\"{path}\" fill=\"{fill}\"/>");
        }
    }

    /// A line through points.
    pub(super) fn line(&mut self, points: &[[f64; 2]], width: f64, colour: Rgb) {
        let Some(path) = path(std::iter::once(points), false) else { return };
        let colour = hex(colour);
        let _ = writeln!(
            self.body,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\" \
             stroke-linejoin=\"round\"/>"
        );
    }

    /// An arrow; returns a place for its name, beyond its tip.
    pub(super) fn arrow(&mut self, from: [f64; 2], to: [f64; 2], width: f64, colour: Rgb) -> [f64; 2] {
        let way = [to[0] - from[0], to[1] - from[1]];
        let length = (way[0] * way[0] + way[1] * way[1]).square_root();
        if !(length > 0.5) {
            return [to[0] + 8.0, to[1] - 8.0];
        }
        let (u, v) = (way[0] / length, way[1] / length);
        let head = (4.0 * width).min(0.6 * length);
        let side = 0.45 * head;
        let neck = [to[0] - u * head, to[1] - v * head];
        self.line(&[from, neck], width, colour);
        let corners =
            vec![to, [neck[0] - v * side, neck[1] + u * side], [neck[0] + v * side, neck[1] - u * side]];
        self.shape(&[corners], &hex(colour), colour, 0.3);
        [to[0] + u * 9.0, to[1] + v * 9.0]
    }

    /// A ball, lit from the upper left.
    pub(super) fn ball(&mut self, centre: [f64; 2], radius: f64, colour: Rgb, edge: Rgb) {
        if !(centre.iter().all(|v| v.is_finite()) && radius.is_finite()) {
            return;
        }
        let name = format!("ball-{}", &hex(colour)[1..]);
        if self.defined.insert(name.clone()) {
            let (light, dark) = (hex(toward(colour, 255.0, 0.55)), hex(toward(colour, 0.0, 0.28)));
            let middle = hex(colour);
            let _ = writeln!(
                self.definitions,
                "<radialGradient id=\"{name}\" cx=\"0.36\" cy=\"0.32\" r=\"0.75\"><stop offset=\"0\" \
                 stop-color=\"{light}\"/><stop offset=\"0.45\" stop-color=\"{middle}\"/><stop offset=\"1\" \
                 stop-color=\"{dark}\"/></radialGradient>"
            );
        }
        let ([x, y], edge) = (centre, hex(edge));
        let _ = writeln!(
            self.body,
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"url(#{name})\" stroke=\"{edge}\" stroke-width=\"0.8\"/>",
            number(x),
            number(y),
            number(radius)
        );
    }

    /// A gradient across a rod, light on its upper left: a fill for [`shape`](Self::shape).
    pub(super) fn rod_fill(&mut self, at: [f64; 2], across: [f64; 2], colour: Rgb) -> String {
        if !at.iter().chain(&across).all(|v| v.is_finite()) {
            return hex(colour);
        }
        let turn = if across[0] + across[1] > 0.0 { -1.0 } else { 1.0 };
        let [dx, dy] = across.map(|v| v * turn);
        self.rods += 1;
        let name = format!("rod-{}", self.rods);
        let stops: String = [(0.0, 255.0, 0.1), (0.35, 255.0, 0.55), (1.0, 0.0, 0.35)]
            .iter()
            .map(|(offset, to, share)| {
                format!("<stop offset=\"{offset}\" stop-color=\"{}\"/>", hex(toward(colour, *to, *share)))
            })
            .collect();
        let _ = writeln!(
            self.definitions,
            "<linearGradient id=\"{name}\" gradientUnits=\"userSpaceOnUse\" x1=\"{}\" y1=\"{}\" x2=\"{}\" \
             y2=\"{}\">{stops}</linearGradient>",
            number(at[0] + dx),
            number(at[1] + dy),
            number(at[0] - dx),
            number(at[1] - dy)
        );
        format!("url(#{name})")
    }

    /// Words with a white rim, so that they read on anything.
    pub(super) fn text(&mut self, at: [f64; 2], words: &str, size: f64, colour: Rgb, anchor: Anchor) {
        if !at.iter().all(|v| v.is_finite()) {
            return;
        }
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{}\" y=\"{}\" font-size=\"{size}\" fill=\"{}\" text-anchor=\"{anchor}\" stroke=\"#ffffff\" \
             stroke-width=\"3\" stroke-linejoin=\"round\" paint-order=\"stroke\">{}</text>",
            number(at[0]),
            number(at[1]),
            hex(colour),
            escaped(words)
        );
    }

    /// A small filled disc.
    pub(super) fn dot(&mut self, [x, y]: [f64; 2], radius: f64, fill: Rgb, edge: Rgb) {
        if x.is_finite() && y.is_finite() {
            let _ = writeln!(
                self.body,
                "<circle cx=\"{}\" cy=\"{}\" r=\"{radius}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"1.2\"/>",
                number(x),
                number(y),
                hex(fill),
                hex(edge)
            );
        }
    }
}

/// A colour as SVG has it.
pub(super) fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A share of the way to black (0) or white (255).
pub(super) fn toward(colour: Rgb, to: f64, share: f64) -> Rgb {
    colour.map(|channel| (f64::from(channel) * (1.0 - share) + to * share).round() as u8)
}

fn path<'a>(outlines: impl Iterator<Item = &'a [[f64; 2]]>, closed: bool) -> Option<String> {
    let mut path = String::new();
    for outline in outlines {
        if outline.len() < 2 || !outline.iter().flatten().all(|v| v.is_finite()) {
            return None;
        }
        for (k, [x, y]) in outline.iter().enumerate() {
            let _ = write!(path, "{}{} {}", if k == 0 { "M" } else { "L" }, number(*x), number(*y));
        }
        path += if closed { "Z" } else { "" };
    }
    Some(path)
}

/// A tenth of a pixel is fine enough; no negative zero.
fn number(value: f64) -> f64 {
    (value * 10.0).round() / 10.0 + 0.0
}

/// Without what XML gives a meaning to, or does not allow.
fn escaped(words: &str) -> String {
    let mut clean = String::new();
    for c in words.chars() {
        match c {
            '&' => clean += "&amp;",
            '<' => clean += "&lt;",
            '>' => clean += "&gt;",
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => clean.push('\u{fffd}'),
            c => clean.push(c),
        }
    }
    clean
}
