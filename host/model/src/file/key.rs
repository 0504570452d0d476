//! The words of the keys that may stand in a file: the documentation of the structs, from which the tables of
//! `docs/scenes.md` are made.

/// A key of a file, as a user is told of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileKey {
    /// The field that it is read into; serde may have another name for it.
    pub field: &'static str,
    /// The type of its value in Rust.
    pub value: &'static str,
    /// Its meaning, with its unit.
    pub words: &'static str,
}

/// A kind of shape, as a user is told of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShapeKind {
    /// Its meaning.
    pub words: &'static str,
    /// Its keys.
    pub keys: &'static [FileKey],
}

/// Declares a struct or an enum of a file as it stands there, and lists its keys with the words of their documentation.
macro_rules! keys {
    (
        $(#[$meta:meta])*
        pub struct $Name:ident {
            $($(#[doc = $doc:literal])* $(#[serde($($serde:tt)*)])* pub $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$meta])*
        pub struct $Name {
            $($(#[doc = $doc])* $(#[serde($($serde)*)])* pub $field: $type,)*
        }

        impl $Name {
            /// All keys, in the order in which they are written.
            pub const KEYS: &'static [FileKey] = &[$(FileKey {
                field: stringify!($field),
                value: stringify!($type),
                words: concat!($($doc),*),
            }),*];
        }
    };
    (
        $(#[$meta:meta])*
        pub enum $Name:ident {
            $($(#[doc = $words:literal])* $Kind:ident {
                $($(#[doc = $doc:literal])* $(#[serde($($serde:tt)*)])* $field:ident: $type:ty,)*
            },)*
        }
    ) => {
        $(#[$meta])*
        pub enum $Name {
            $($(#[doc = $words])* $Kind {
                $($(#[doc = $doc])* $(#[serde($($serde)*)])* $field: $type,)*
            },)*
        }

        impl $Name {
            /// All kinds.
            pub const KINDS: &'static [ShapeKind] = &[$(ShapeKind {
                words: concat!($($words),*),
                keys: &[$(FileKey {
                    field: stringify!($field),
                    value: stringify!($type),
                    words: concat!($($doc),*),
                }),*],
            }),*];
        }
    };
}

pub(super) use keys;
