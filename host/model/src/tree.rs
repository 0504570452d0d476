//! A configuration as a tree that remembers where every value comes from: parsed, completed with defaults, changed by
//! `--set`, and only then read into the structs of [`file`](super::file).

use super::error::{Place, SceneError};
use toml::de::{DeTable, DeValue};

/// No key of ours comes close. Paths are followed recursively.
const DEEPEST: usize = 20;

/// A value and where it comes from.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) value: Value,
    pub(super) place: Place,
}

#[derive(Clone, Debug)]
pub(super) enum Value {
    String(String),
    Integer(i64),
    Float(f64),
    Boolean(bool),
    Array(Vec<Node>),
    Table(Vec<Entry>),
}

#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub(super) key: String,
    pub(super) place: Place,
    pub(super) node: Node,
}

impl Node {
    /// Parses a document.
    pub(super) fn parse(text: &str, source: &str) -> Result<Self, SceneError> {
        let lines = Lines::new(text, source);
        let document = DeTable::parse(text).map_err(|error| {
            SceneError::new("", format!("not TOML: {}", error.message()), "see https://toml.io")
                .at(&lines.place(error.span().map_or(0, |span| span.start)))
        })?;
        let place = lines.source.clone();
        Ok(Self { value: lines.table(document.get_ref())?, place })
    }

    /// Parses a value on a command line; what is not TOML is taken as a word.
    fn parse_value(text: &str, place: &Place) -> Result<Self, SceneError> {
        // Its lines mean nothing.
        let lines = Lines { source: place.clone(), breaks: Vec::new() };
        let mut node = match DeValue::parse(text) {
            Ok(value) => lines.node(value.get_ref(), 0)?,
            Err(_) => Self { value: Value::String(text.into()), place: place.clone() },
        };
        node.place_all(place);
        Ok(node)
    }

    fn place_all(&mut self, place: &Place) {
        self.place = place.clone();
        match &mut self.value {
            Value::Array(nodes) => nodes.iter_mut().for_each(|node| node.place_all(place)),
            Value::Table(entries) => entries.iter_mut().for_each(|entry| {
                entry.place = place.clone();
                entry.node.place_all(place);
            }),
            _ => {}
        }
    }

    /// The value of a key, if this is a table that has it.
    pub(super) fn get(&self, key: &str) -> Option<&Self> {
        match &self.value {
            Value::Table(entries) => entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node),
            _ => None,
        }
    }

    /// The value of a key, if this is a table that has it.
    pub(super) fn get_mut(&mut self, key: &str) -> Option<&mut Self> {
        match &mut self.value {
            Value::Table(entries) => {
                entries.iter_mut().find(|entry| entry.key == key).map(|entry| &mut entry.node)
            }
            _ => None,
        }
    }

    /// An item of a list, if this is one that has it.
    pub(super) fn item_mut(&mut self, index: usize) -> Option<&mut Self> {
        match &mut self.value {
            Value::Array(items) => items.get_mut(index),
            _ => None,
        }
    }

    /// Gives a table a key that it does not have, in the place of its value.
    pub(super) fn insert(&mut self, key: &str, node: Self) {
        if let Value::Table(entries) = &mut self.value {
            entries.push(Entry { key: key.into(), place: node.place.clone(), node });
        }
    }

    /// Takes a key out of a table.
    pub(super) fn take(&mut self, key: &str) -> Option<Entry> {
        let Value::Table(entries) = &mut self.value else { return None };
        let index = entries.iter().position(|entry| entry.key == key)?;
        Some(entries.remove(index))
    }

    /// Takes a table `<list>_defaults` out of this table and gives its entries to those tables of the array `<list>` that
    /// lack them.
    pub(super) fn spread_defaults(&mut self, list: &str) {
        let name = format!("{list}_defaults");
        if !matches!(self.get(&name), Some(Self { value: Value::Table(_), .. })) {
            return; // Not a table: stays, and is reported as an unknown key.
        }
        let Some(Entry { node: Self { value: Value::Table(defaults), .. }, .. }) = self.take(&name) else {
            return;
        };
        let Some(Value::Array(items)) = self.get_mut(list).map(|node| &mut node.value) else { return };
        for item in items {
            if let Value::Table(own) = &mut item.value {
                for default in &defaults {
                    if own.iter().all(|entry| entry.key != default.key) {
                        own.push(default.clone());
                    }
                }
            }
        }
    }

    /// Applies a setting. A key is a path of names separated by dots; items of a list go by their number from 1, by the
    /// `name` they have, or `*` for all.
    pub(super) fn set(&mut self, setting: &Setting) -> Result<(), SceneError> {
        let place = &setting.place;
        let value = Self::parse_value(&setting.value, place)?;
        let path: Vec<&str> = setting.key.split('.').collect();
        if path.len() > DEEPEST {
            return Err(SceneError::new(&setting.key, "unknown key", "no key is that deep").at(place));
        }
        self.set_path(&path, &value, place)
            .map_err(|(problem, remedy)| SceneError::new(&setting.key, problem, remedy).at(place))
    }

    fn set_path(&mut self, path: &[&str], value: &Self, place: &Place) -> Result<(), (String, String)> {
        let Some((&name, rest)) = path.split_first() else {
            *self = value.clone();
            return Ok(());
        };
        match &mut self.value {
            Value::Table(entries) => {
                let index = entries.iter().position(|entry| entry.key == name).unwrap_or_else(|| {
                    let node = Self { value: Value::Table(Vec::new()), place: place.clone() };
                    entries.push(Entry { key: name.into(), place: place.clone(), node });
                    entries.len() - 1
                });
                if rest.is_empty() {
                    entries[index].place = place.clone();
                }
                entries[index].node.set_path(rest, value, place)
            }
            Value::Array(items) if name == "*" => {
                items.iter_mut().try_for_each(|item| item.set_path(rest, value, place))
            }
            Value::Array(items) => {
                let count = items.len();
                let index = match name.parse::<usize>() {
                    Ok(number) => number.checked_sub(1),
                    Err(_) => items.iter_mut().position(|item| {
                        matches!(item.get_mut("name"), Some(Self { value: Value::String(own), .. }) if own == name)
                    }),
                };
                match index.and_then(|index| items.get_mut(index)) {
                    Some(item) => item.set_path(rest, value, place),
                    None => Err((
                        format!("the list has no `{name}`"),
                        format!("use a number from 1 to {count}, a name, or * for all"),
                    )),
                }
            }
            _ => Err((
                format!("`{name}` is below a value that is neither table nor list"),
                "leave it out".into(),
            )),
        }
    }

    /// Returns the place that the value of a path comes from: its own place, or that of the nearest thing around it.
    pub(super) fn place_of(&self, key: &str) -> &Place {
        let mut here = self;
        let mut place = &self.place;
        for name in key.split('.') {
            let next = match &here.value {
                Value::Table(entries) => {
                    entries.iter().find(|entry| entry.key == name).map(|entry| (&entry.place, &entry.node))
                }
                Value::Array(items) => name
                    .parse::<usize>()
                    .ok()
                    .and_then(|number| items.get(number.checked_sub(1)?))
                    .map(|node| (&node.place, node)),
                _ => None,
            };
            let Some((next_place, next)) = next else { break };
            (place, here) = (next_place, next);
        }
        place
    }
}

/// A value for a key of the configuration, from the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    pub(super) key: String,
    value: String,
    /// The option that it stands in.
    pub(super) place: Place,
}

impl Setting {
    /// `KEY=VALUE` of a `--set`.
    ///
    /// # Errors
    /// There is no key, or no value.
    pub fn parse(text: &str) -> Result<Self, SceneError> {
        let place = Place::whole("--set");
        match text.split_once('=') {
            Some((key, value)) if !key.trim().is_empty() => {
                Ok(Self { key: key.trim().into(), value: value.trim().into(), place })
            }
            _ => Err(SceneError::new(text, "is not a setting", "write KEY=VALUE, such as control.force_n=4")
                .at(&place)),
        }
    }

    /// One of the values of a `--vary`, as a `--set` would have it.
    pub fn varied(key: &str, value: &str) -> Self {
        Self { key: key.into(), value: value.into(), place: Place::whole("--vary") }
    }

    /// Its key.
    pub fn key(&self) -> &str {
        &self.key
    }
}

/// From byte positions to lines.
pub(super) struct Lines {
    source: Place,
    /// The ends of the lines, bytes.
    breaks: Vec<usize>,
}

impl Lines {
    /// Of a text; `source` is its name in errors.
    pub(super) fn new(text: &str, source: &str) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at).collect();
        Self { source: Place::whole(source), breaks }
    }

    /// The text as a whole.
    pub(super) fn whole(&self) -> &Place {
        &self.source
    }

    /// The place of a byte.
    pub(super) fn place(&self, position: usize) -> Place {
        self.line(1 + self.breaks.partition_point(|&end| end < position))
    }

    /// A line, from 1.
    pub(super) fn line(&self, line: usize) -> Place {
        Place { line, ..self.source.clone() }
    }

    fn table(&self, table: &DeTable<'_>) -> Result<Value, SceneError> {
        let mut entries = Vec::with_capacity(table.len());
        for (key, value) in table {
            entries.push(Entry {
                key: key.get_ref().to_string(),
                place: self.place(key.span().start),
                node: self.node(value.get_ref(), value.span().start)?,
            });
        }
        Ok(Value::Table(entries))
    }

    fn node(&self, value: &DeValue<'_>, position: usize) -> Result<Node, SceneError> {
        let fail = |what: &str| {
            Err(SceneError::new("", what, "use a number, a string, true or false").at(&self.place(position)))
        };
        let value = match value {
            DeValue::String(s) => Value::String(s.to_string()),
            DeValue::Integer(i) => match i64::from_str_radix(i.as_str(), i.radix()) {
                Ok(i) => Value::Integer(i),
                Err(_) => return fail("the whole number is too large"),
            },
            DeValue::Float(f) => match f.as_str().parse() {
                Ok(f) => Value::Float(f),
                Err(_) => return fail("the number can't be read"),
            },
            DeValue::Boolean(b) => Value::Boolean(*b),
            DeValue::Datetime(_) => return fail("a date means nothing here"),
            DeValue::Array(items) => Value::Array(
                items
                    .iter()
                    .map(|item| self.node(item.get_ref(), item.span().start))
                    .collect::<Result<_, _>>()?,
            ),
            DeValue::Table(table) => self.table(table)?,
        };
        Ok(Node { value, place: self.place(position) })
    }
}
