//! XML with bounds, and its attributes with places.
//!
//! `roxmltree` reads without recursion, knows where everything is, and refuses DTDs, so that no entity can blow up. Two of
//! its steps take quadratic time: attributes of one tag are compared with each other, and every element that declares
//! namespaces copies those around it. Both are counted before it is called.

use super::super::error::{Place, SceneError};
use super::super::tree::Lines;
use roxmltree::{Document, Node, ParsingOptions};

/// Elements, texts and comments together. A humanoid's file has some thousands.
const MOST_NODES: u32 = 200_000;
/// Attributes of a tag; URDF's largest has six.
const MOST_ATTRIBUTES: usize = 100;
/// Declarations of namespaces in a file.
const MOST_NAMESPACES: usize = 200;
/// The most that is quoted of a value in an error, characters.
const LONGEST_QUOTE: usize = 60;

const IS_XACRO: &str = "is a xacro file, not a URDF";
/// The remedy for that.
const EXPAND: &str = "expand it first: `xacro in.xacro > out.urdf`";

/// A text with its lines.
pub(super) struct Text<'a> {
    text: &'a str,
    lines: Lines,
}

impl<'a> Text<'a> {
    /// A text; `source` is its name in errors.
    pub(super) fn new(text: &'a str, source: &str) -> Self {
        Self { text, lines: Lines::new(text, source) }
    }

    /// The place of the text as a whole.
    pub(super) fn whole(&self) -> &Place {
        self.lines.whole()
    }

    /// Parses it.
    ///
    /// # Errors
    /// Not XML, or beyond the bounds.
    pub(super) fn document(&self) -> Result<Document<'a>, SceneError> {
        let is_xacro = self.text.contains("<xacro:");
        let fail = |problem: String, remedy: &str, position: usize| {
            Err(SceneError::new("", problem, remedy).at(&self.lines.place(position)))
        };
        if let Some(at) = crowded_tag(self.text) {
            return fail(format!("a tag with more than {MOST_ATTRIBUTES} attributes"), "is this a URDF?", at);
        }
        if let Some((at, _)) = self.text.match_indices("xmlns").nth(MOST_NAMESPACES) {
            return fail(format!("more than {MOST_NAMESPACES} namespaces"), "is this a URDF?", at);
        }
        let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
        Document::parse_with_options(self.text, options).map_err(|error| {
            use roxmltree::Error;
            let position = error.pos();
            let end = || self.lines.place(self.text.trim_end().len());
            let (problem, remedy, place) = match error {
                _ if is_xacro => (IS_XACRO.into(), EXPAND, self.whole().clone()),
                Error::UnclosedRootNode | Error::UnexpectedEndOfStream => {
                    ("not XML: it ends in the middle".into(), "is the file complete?", end())
                }
                Error::NoRootNode => ("not XML: there is nothing in it".into(), "is this a URDF?", end()),
                Error::DtdDetected => {
                    let at = self.text.find("<!DOCTYPE").unwrap_or_default();
                    ("has a DTD".into(), "remove <!DOCTYPE ...>: a URDF needs none", self.lines.place(at))
                }
                Error::NodesLimitReached => {
                    let problem = format!("has more than {MOST_NODES} elements");
                    (problem, "is this a URDF?", self.whole().clone())
                }
                Error::UnknownNamespace(prefix, at) => (
                    format!("not XML: the prefix `{}:` is not declared", quote(&prefix)),
                    "declare it in <robot> (xmlns:...), or remove what has it",
                    self.lines.line(at.row as usize),
                ),
                error => {
                    // Its position is told as a line already.
                    let words = error.to_string().replacen(&format!(" at {position}"), "", 1);
                    let place = self.lines.line(position.row as usize);
                    let is_robot = self.text.contains("<robot") || self.text.contains("</robot");
                    let remedy = if is_robot { "correct it there or before" } else { "is this a URDF?" };
                    (format!("not XML: {}", quote(&words)), remedy, place)
                }
            };
            SceneError::new("", problem, remedy).at(&place)
        })
    }

    /// An element's place.
    pub(super) fn place(&self, element: Node<'_, '_>) -> Place {
        self.lines.place(element.range().start)
    }

    /// Refuses an element that belongs to xacro.
    pub(super) fn refuse_xacro(&self, element: Node<'_, '_>) -> Result<(), SceneError> {
        let in_xacro = |namespace: &str| namespace.contains("xacro");
        if element.tag_name().namespace().is_some_and(in_xacro) {
            return Err(SceneError::new("", IS_XACRO, EXPAND).at(&self.place(element)));
        }
        Ok(())
    }

    /// The numbers of an attribute, separated by blanks; nothing without the attribute. `of` is whose they are.
    ///
    /// # Errors
    /// Not so many finite numbers.
    pub(super) fn numbers<const N: usize>(
        &self,
        of: &str,
        element: Node<'_, '_>,
        name: &str,
    ) -> Result<Option<[f64; N]>, SceneError> {
        let Some(attribute) = element.attribute_node(name) else { return Ok(None) };
        let text = attribute.value();
        let fail = |problem: String, remedy: &str| {
            let problem = format!("{of}: {name} of <{}>: {problem}", quote(element.tag_name().name()));
            Err(SceneError::new("", problem, remedy).at(&self.lines.place(attribute.range().start)))
        };
        let mut numbers = [0.0; N];
        let mut count = 0;
        for word in text.split_ascii_whitespace() {
            match word.parse::<f64>() {
                Ok(number) if number.is_finite() => {
                    if let Some(place) = numbers.get_mut(count) {
                        *place = number;
                    }
                    count += 1;
                }
                Ok(_) => {
                    return fail(format!("`{}` is not finite", quote(word)), "has to be a finite number");
                }
                Err(_) if text.contains("${") => {
                    return fail(format!("`{}` is an expression of xacro", quote(text)), EXPAND);
                }
                Err(_) if word.contains(',') => {
                    return fail(
                        format!("`{}` is not a number", quote(word)),
                        "separate numbers by blanks, and write decimals with a point",
                    );
                }
                Err(_) => {
                    return fail(format!("`{}` is not a number", quote(word)), "write it as 0.1 or 1e-1");
                }
            }
        }
        if count == N {
            return Ok(Some(numbers));
        }
        let found = match count {
            0 => "is empty".into(),
            1 => format!("`{}` is one number", quote(text)),
            _ => format!("`{}` has {count} numbers", quote(text)),
        };
        let expected = if N == 1 { "has to be one number".into() } else { format!("has to be {N} numbers") };
        fail(found, &expected)
    }
}

/// The first child element of a name, in any namespace.
pub(super) fn child<'a, 'input>(parent: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    children(parent, name).next()
}

/// The child elements of a name, in any namespace.
pub(super) fn children<'a, 'input>(
    parent: Node<'a, 'input>,
    name: &str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    parent.children().filter(move |node| node.is_element() && node.tag_name().name() == name)
}

/// A value for an error: not longer than a line.
pub(super) fn quote(text: &str) -> String {
    match text.char_indices().nth(LONGEST_QUOTE) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.into(),
    }
}

/// Returns the place of a tag with too many attributes. Only what looks like a tag is looked at: quoted text and
/// comments are passed over.
fn crowded_tag(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut at = 0;
    while let Some(start) = text[at..].find('<').map(|offset| at + offset) {
        let skipped = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        if let Some((opening, closing)) =
            skipped.iter().find(|(opening, _)| text[start..].starts_with(opening))
        {
            let inside = start + opening.len();
            at = inside + text[inside..].find(closing)? + closing.len();
            continue;
        }
        let (mut quoted, mut attributes) = (None, 0);
        at = start + 1;
        for &byte in &bytes[at..] {
            match (quoted, byte) {
                (None, b'>') => break,
                (None, b'"' | b'\'') => quoted = Some(byte),
                (None, b'=') => attributes += 1,
                (Some(quote), byte) if byte == quote => quoted = None,
                _ => {}
            }
            at += 1;
        }
        if attributes > MOST_ATTRIBUTES {
            return Some(start);
        }
    }
    None
}
