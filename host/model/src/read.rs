//! From a [`Node`] to the structs of [`file`](super::file), through serde, with errors that know key and place.

use super::{
    error::{SceneError, suggestion},
    file::SCHEMA,
    tree::{Entry, Node, Value},
};
use serde::de::{self, Deserialize, Deserializer, IntoDeserializer, Unexpected, Visitor};
use std::fmt::Display;

/// Reads a tree whose root has the key `path` (empty for a whole file).
pub(super) fn read<'a, T: Deserialize<'a>>(node: &'a Node, path: &str) -> Result<T, SceneError> {
    T::deserialize(Reader { node, path: path.into() })
}

impl de::Error for SceneError {
    fn custom<T: Display>(problem: T) -> Self {
        Self::new("", problem.to_string(), "")
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        // Serde names Rust's types.
        let expected = match expected.to_string() {
            expected if expected == "f64" => "a number".into(),
            expected if expected == "u32" || expected == "usize" => "a whole number, not negative".into(),
            expected if expected == "i32" => "a whole number between -2147483648 and 2147483647".into(),
            expected if expected.starts_with("struct ") || expected == "a map" => "a table".into(),
            expected if expected == "a sequence" => "a list".into(),
            expected if expected == "a boolean" => "true or false".into(),
            expected => expected,
        };
        let found = match found {
            Unexpected::Map => "a table".into(),
            Unexpected::Seq => "a list".into(),
            other => other.to_string(),
        };
        Self::new("", format!("is {found}"), format!("has to be {expected}"))
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(count: usize, expected: &dyn de::Expected) -> Self {
        let expected = expected.to_string().replace("an array of length", "a list of");
        Self::new("", format!("has {count} items"), format!("has to be {expected}"))
    }

    fn unknown_field(field: &str, expected: &'static [&'static str]) -> Self {
        Self::new("", "unknown key", suggestion(field, expected.iter().copied()))
    }

    fn unknown_variant(variant: &str, expected: &'static [&'static str]) -> Self {
        Self::new("", format!("`{variant}` is unknown"), suggestion(variant, expected.iter().copied()))
    }

    fn missing_field(field: &'static str) -> Self {
        let remedy = match field {
            "contact" | "joint" | "fingertip" => format!("add a [[{field}]]"),
            "pose" | "control" | "shape" => format!("add a [{field}]"),
            "schema" => format!("add `schema = {SCHEMA}`"),
            _ => format!("add `{field} = ...`"),
        };
        Self::new(field, "is missing", remedy)
    }

    fn duplicate_field(field: &'static str) -> Self {
        Self::new(field, "is there twice", "leave one out")
    }
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.into() } else { format!("{path}.{name}") }
}

#[derive(Clone)]
struct Reader<'a> {
    node: &'a Node,
    path: String,
}

impl Reader<'_> {
    /// The innermost value that an error passes on its way out is the one that it is about.
    fn here(&self, error: SceneError) -> SceneError {
        match error.place {
            Some(_) => error,
            None => SceneError {
                key: if error.key.is_empty() { self.path.clone() } else { join(&self.path, &error.key) },
                ..error
            }
            .at(&self.node.place),
        }
    }
}

impl<'de> Deserializer<'de> for Reader<'de> {
    type Error = SceneError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, SceneError> {
        let result = match &self.node.value {
            Value::String(s) => visitor.visit_borrowed_str(s),
            Value::Integer(i) => visitor.visit_i64(*i),
            Value::Float(f) if !f.is_finite() => {
                Err(SceneError::new("", format!("is {f}"), "has to be a finite number"))
            }
            Value::Float(f) => visitor.visit_f64(*f),
            Value::Boolean(b) => visitor.visit_bool(*b),
            Value::Array(items) => {
                let mut access = Items { items, next: 0, path: &self.path };
                let value = visitor.visit_seq(&mut access);
                // A fixed-length list stops reading once it is full.
                if value.is_ok() && access.next < items.len() {
                    let remedy = format!("has to be a list of {}", access.next);
                    return Err(self.here(SceneError::new("", format!("has {} items", items.len()), remedy)));
                }
                value
            }
            Value::Table(entries) => visitor.visit_map(Entries { entries, current: None, path: &self.path }),
        };
        result.map_err(|error| self.here(error))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, SceneError> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, SceneError> {
        visitor.visit_newtype_struct(self)
    }

    /// A table with one key, which names the variant.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, SceneError> {
        let fail = |problem: String| {
            let remedy = format!("give one of {}", variants.join(", "));
            Err(self.here(SceneError::new("", problem, remedy)))
        };
        let Value::Table(entries) = &self.node.value else {
            return fail("has to be a table".into());
        };
        match entries.as_slice() {
            [entry] => visitor
                .visit_enum(Variant { entry, path: join(&self.path, &entry.key) })
                .map_err(|error| self.here(error)),
            entries => fail(format!("has {} keys", entries.len())),
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map struct identifier ignored_any
    }
}

struct Items<'a, 'p> {
    items: &'a [Node],
    next: usize,
    path: &'p str,
}

impl<'de> de::SeqAccess<'de> for &mut Items<'de, '_> {
    type Error = SceneError;

    fn next_element_seed<T: de::DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, SceneError> {
        let Some(node) = self.items.get(self.next) else { return Ok(None) };
        self.next += 1;
        seed.deserialize(Reader { node, path: join(self.path, &self.next.to_string()) }).map(Some)
    }
}

struct Entries<'a, 'p> {
    entries: &'a [Entry],
    current: Option<&'a Entry>,
    path: &'p str,
}

impl<'de> de::MapAccess<'de> for Entries<'de, '_> {
    type Error = SceneError;

    fn next_key_seed<K: de::DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, SceneError> {
        let Some((entry, rest)) = self.entries.split_first() else { return Ok(None) };
        (self.entries, self.current) = (rest, Some(entry));
        let name: de::value::StrDeserializer<'_, SceneError> = entry.key.as_str().into_deserializer();
        seed.deserialize(name).map(Some).map_err(|error| {
            let key = join(self.path, &entry.key);
            SceneError { key, ..error }.at(&entry.place)
        })
    }

    fn next_value_seed<V: de::DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, SceneError> {
        let entry = self.current.take().ok_or_else(|| SceneError::new("", "no value", ""))?;
        seed.deserialize(Reader { node: &entry.node, path: join(self.path, &entry.key) })
    }
}

struct Variant<'a> {
    entry: &'a Entry,
    path: String,
}

impl<'de> de::EnumAccess<'de> for Variant<'de> {
    type Error = SceneError;
    type Variant = Reader<'de>;

    fn variant_seed<V: de::DeserializeSeed<'de>>(
        self,
        seed: V,
    ) -> Result<(V::Value, Reader<'de>), SceneError> {
        let name: de::value::StrDeserializer<'_, SceneError> = self.entry.key.as_str().into_deserializer();
        let reader = Reader { node: &self.entry.node, path: self.path };
        match seed.deserialize(name) {
            Ok(variant) => Ok((variant, reader)),
            Err(error) => Err(SceneError { key: reader.path, ..error }.at(&self.entry.place)),
        }
    }
}

impl<'de> de::VariantAccess<'de> for Reader<'de> {
    type Error = SceneError;

    fn unit_variant(self) -> Result<(), SceneError> {
        Ok(())
    }

    fn newtype_variant_seed<T: de::DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, SceneError> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _len: usize, visitor: V) -> Result<V::Value, SceneError> {
        self.deserialize_any(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, SceneError> {
        self.deserialize_any(visitor)
    }
}
