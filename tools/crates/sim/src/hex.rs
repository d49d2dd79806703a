//! Memories in snapshots: bytes as one string of hex digits.
//!
//! For `#[serde(with = "sim::hex")]` on arrays of bytes, boxed or not.

use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::Serializer;
use std::borrow::Borrow;

/// Bytes of an array, boxed or not.
pub trait Bytes: Sized {
    /// The bytes.
    fn bytes(&self) -> &[u8];
    /// The array, if `bytes` has its length.
    fn from_bytes(bytes: Vec<u8>) -> Option<Self>;
}

impl<const N: usize> Bytes for [u8; N] {
    fn bytes(&self) -> &[u8] {
        self
    }

    fn from_bytes(bytes: Vec<u8>) -> Option<Self> {
        bytes.try_into().ok()
    }
}

impl<const N: usize> Bytes for Box<[u8; N]> {
    fn bytes(&self) -> &[u8] {
        let array: &[u8; N] = self.borrow();
        array
    }

    fn from_bytes(bytes: Vec<u8>) -> Option<Self> {
        bytes.try_into().ok()
    }
}

/// Writes the bytes.
///
/// # Errors
/// The serializer's.
pub fn serialize<T: Bytes, S: Serializer>(value: &T, serializer: S) -> Result<S::Ok, S::Error> {
    let digit = |nibble: u8| char::from_digit(u32::from(nibble), 16).unwrap_or('0');
    let text: String = value.bytes().iter().flat_map(|b| [digit(b >> 4), digit(b & 15)]).collect();
    serializer.serialize_str(&text)
}

/// Reads as many bytes as the array has.
///
/// # Errors
/// If there are more or fewer, or other characters than hex digits.
pub fn deserialize<'de, T: Bytes, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    let text = String::deserialize(deserializer)?;
    let digit = |c: &u8| char::from(*c).to_digit(16).map(|digit| digit as u8);
    let bytes: Option<Vec<u8>> = text
        .as_bytes()
        .chunks(2)
        .map(|pair| match pair {
            [high, low] => Some(digit(high)? << 4 | digit(low)?),
            _ => None,
        })
        .collect();
    bytes
        .and_then(T::from_bytes)
        .ok_or_else(|| D::Error::custom("a memory in the snapshot has the wrong length or no hex"))
}
