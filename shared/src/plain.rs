//! How parameters are written: what serde does not know, as something plain that it does.
//!
//! On a field, `#[serde(with = "crate::plain")]` writes
//! - values of joints as a [`List`] that ends with the last value that is not zero. Beyond the joints of a hand there
//!   are only zeros, so that the bytes do not depend on the capacity: the host writes from its large arrays what the
//!   firmware reads into arrays of exact size. More values than the capacity are refused;
//! - vectors and matrices as their entries, column by column;
//! - any of these that may be left out, as an option.

use crate::math::Real;
use crate::telemetry::List;
use nalgebra::{Matrix3, Vector3};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A value of a joint.
pub trait Value: Copy + Default + Serialize + DeserializeOwned {
    /// Whether it is the default to the bit: zero, and not minus zero.
    fn is_blank(&self) -> bool;
}

impl Value for f32 {
    fn is_blank(&self) -> bool {
        self.to_bits() == 0
    }
}

impl Value for f64 {
    fn is_blank(&self) -> bool {
        self.to_bits() == 0
    }
}

/// A scalar that can be written.
pub trait Number: Real + Value {}

impl<T: Real + Value> Number for T {}

/// What is written as something plain.
pub trait Plain: Sized {
    /// What it is written as.
    type Form: Serialize + DeserializeOwned;

    /// What is to be written.
    fn to_form(&self) -> Self::Form;

    /// What was written.
    fn from_form(form: Self::Form) -> Self;
}

impl<V: Value, const J: usize> Plain for [V; J] {
    type Form = List<V, J>;

    fn to_form(&self) -> List<V, J> {
        List::first_of(*self, self.iter().rposition(|value| !value.is_blank()).map_or(0, |last| last + 1))
    }

    fn from_form(form: List<V, J>) -> Self {
        form.filled()
    }
}

impl<T: Number> Plain for Vector3<T> {
    type Form = [T; 3];

    fn to_form(&self) -> [T; 3] {
        (*self).into()
    }

    fn from_form(form: [T; 3]) -> Self {
        form.into()
    }
}

impl<T: Number> Plain for Matrix3<T> {
    type Form = [[T; 3]; 3];

    fn to_form(&self) -> [[T; 3]; 3] {
        (*self).into()
    }

    fn from_form(form: [[T; 3]; 3]) -> Self {
        form.into()
    }
}

impl<P: Plain> Plain for Option<P> {
    type Form = Option<P::Form>;

    fn to_form(&self) -> Self::Form {
        self.as_ref().map(P::to_form)
    }

    fn from_form(form: Self::Form) -> Self {
        form.map(P::from_form)
    }
}

/// Writes the form of a value.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<P: Plain, S: Serializer>(value: &P, serializer: S) -> Result<S::Ok, S::Error> {
    value.to_form().serialize(serializer)
}

/// Reads the form of a value.
///
/// # Errors
/// Those of the deserializer, and a list that is longer than the capacity.
pub fn deserialize<'de, P: Plain, D: Deserializer<'de>>(deserializer: D) -> Result<P, D::Error> {
    P::Form::deserialize(deserializer).map(P::from_form)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written<P: Plain>(value: &P) -> std::vec::Vec<u8> {
        let mut buffer = [0; 200];
        postcard::to_slice(&value.to_form(), &mut buffer).unwrap().to_vec()
    }

    fn read<P: Plain>(bytes: &[u8]) -> Option<P> {
        match postcard::take_from_bytes::<P::Form>(bytes) {
            Ok((form, [])) => Some(P::from_form(form)),
            _ => None,
        }
    }

    #[test]
    fn lists_end_with_their_last_value_and_fit_any_capacity() {
        let bytes = written(&[1.0_f32, 0.0, -2.0, 0.0, 0.0]);
        assert_eq!(bytes.len(), 1 + 3 * 4);
        assert_eq!(read(&bytes), Some([1.0_f32, 0.0, -2.0]));
        assert_eq!(read(&bytes), Some([1.0_f32, 0.0, -2.0, 0.0, 0.0, 0.0]));
        assert_eq!(read::<[f32; 2]>(&bytes), None, "more values than capacity");
        assert_eq!(read::<[f32; 3]>(&bytes[..bytes.len() - 1]), None, "a byte is missing");
        assert_eq!(written(&[0.0_f64; 4]), [0]);
    }

    #[test]
    fn every_bit_is_kept() {
        for bits in [0x8000_0000, 0x7fc0_0001, 0xffff_ffff, 1, 0x7f80_0000] {
            let value = f32::from_bits(bits);
            let [_, again] = read::<[f32; 2]>(&written(&[1.0, value])).unwrap();
            assert_eq!(again.to_bits(), bits);
        }
    }

    #[test]
    fn vectors_and_matrices_are_their_entries() {
        let vector = Vector3::new(1.0_f32, 2.0, 3.0);
        let matrix = Matrix3::new(1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0);
        assert_eq!(written(&vector).len(), 12);
        assert_eq!(written(&matrix).len(), 36);
        assert_eq!(written(&matrix)[4..8], 4.0_f32.to_le_bytes(), "column by column");
        assert_eq!(read(&written(&vector)), Some(vector));
        assert_eq!(read(&written(&Some(matrix))), Some(Some(matrix)));
        assert_eq!(written(&None::<Vector3<f32>>), [0]);
    }
}
