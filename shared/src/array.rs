//! Arrays with room for more than a hand has, as bytes that do not depend on the room: what only fills it up is left out.
//!
//! For `#[serde(with = "crate::array")]`.

use core::fmt;
use core::marker::PhantomData;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// An item of an array.
pub(crate) trait Item: Copy {
    /// Returns the item that fills an array behind the last one that counts.
    fn filler() -> Self;
    /// Returns `true` if it is one.
    fn is_filler(&self) -> bool;
}

/// Returns the number of items of an array that count. Not inlined, as the others: for each size the compiler would
/// unroll it.
#[inline(never)]
pub(crate) fn count<T: Item>(items: &[T]) -> usize {
    items.iter().rposition(|item| !item.is_filler()).map_or(0, |last| last + 1)
}

pub(crate) fn serialize<T: Item + Serialize, S: Serializer, const N: usize>(
    array: &[T; N],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(array.get(..count(array)).unwrap_or(&[]))
}

pub(crate) fn deserialize<'de, T: Item + Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[T; N], D::Error> {
    deserializer.deserialize_seq(Items(PhantomData))
}

struct Items<T, const N: usize>(PhantomData<T>);

impl<'de, T: Item + Deserialize<'de>, const N: usize> Visitor<'de> for Items<T, N> {
    type Value = [T; N];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at most {N} items")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<[T; N], A::Error> {
        let mut array = [filler(); N];
        read_into(&mut array, &mut sequence)?;
        Ok(array)
    }
}

#[inline(never)]
fn filler<T: Item>() -> T {
    T::filler()
}

#[inline(never)]
fn read_into<'de, T: Item + Deserialize<'de>, A: SeqAccess<'de>>(
    places: &mut [T],
    sequence: &mut A,
) -> Result<(), A::Error> {
    let mut places = places.iter_mut();
    while let Some(item) = sequence.next_element()? {
        *places.next().ok_or_else(|| A::Error::custom("more items than there is room for"))? = item;
    }
    Ok(())
}
