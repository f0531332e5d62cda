//! Primitives of the wire: one shortest CBOR encoding a value, nothing else read.
//!
//! The bytes themselves are written and read by `cbor4ii`; what is added here is
//! that only the shortest form is accepted, that every length is checked before
//! anything is reserved, and that nothing nests deeper than the types do.

use super::codec::WireError;
use cbor4ii::core::dec::{Decode, Read, Reference};
use cbor4ii::core::enc::{Encode, Write};
use cbor4ii::core::types::{Array, Bytes, Null};
use core::convert::Infallible;

/// The byte that stands for "none".
const NULL: u8 = 0xf6;

/// Bytes being written.
#[derive(Debug)]
pub struct Out(Vec<u8>);

impl Write for Out {
    type Error = Infallible;

    fn push(&mut self, input: &[u8]) -> Result<(), Infallible> {
        self.0.extend_from_slice(input);
        Ok(())
    }
}

impl Out {
    /// Nothing yet.
    pub fn new() -> Self {
        // A beacon with a few gossip entries fits without growing.
        Self(Vec::with_capacity(256))
    }

    /// What was written.
    pub fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    fn write(&mut self, value: impl Encode) {
        // Writing to memory cannot fail, and no value of ours is without encoding.
        let written = value.encode(self);
        debug_assert!(written.is_ok());
    }

    /// The head of an array.
    pub fn array(&mut self, len: usize) {
        let written = Array::bounded(len, self);
        debug_assert!(written.is_ok());
    }
}

/// Bytes being read.
#[derive(Debug)]
pub struct In<'a>(&'a [u8]);

impl<'a> Read<'a> for In<'a> {
    type Error = Infallible;

    fn fill<'short>(&'short mut self, want: usize) -> Result<Reference<'a, 'short>, Infallible> {
        Ok(Reference::Long(&self.0[..want.min(self.0.len())]))
    }

    fn advance(&mut self, n: usize) {
        self.0 = &self.0[n.min(self.0.len())..];
    }
}

/// Bytes of the shortest head that states `value`.
fn head_bytes(value: u64) -> usize {
    match value {
        0..=0x17 => 1,
        0x18..=0xff => 2,
        0x100..=0xffff => 3,
        0x1_0000..=0xffff_ffff => 5,
        _ => 9,
    }
}

impl<'a> In<'a> {
    /// All of these bytes.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// Nothing may be left.
    pub fn end(&self) -> Result<(), WireError> {
        match self.0.len() {
            0 => Ok(()),
            bytes => Err(WireError::Trailing { bytes }),
        }
    }

    /// Runs `read` and requires that it used the shortest form, whose length
    /// `shortest` tells from what was read.
    fn exact<T, E>(
        &mut self,
        read: impl FnOnce(&mut Self) -> Result<T, E>,
        shortest: impl FnOnce(&T) -> usize,
    ) -> Result<T, WireError> {
        let before = self.0.len();
        let malformed = WireError::Malformed { field: "value" };
        let value = read(self).map_err(|_| malformed)?;
        if before - self.0.len() == shortest(&value) {
            Ok(value)
        } else {
            Err(malformed)
        }
    }

    fn unsigned(&mut self) -> Result<u64, WireError> {
        self.exact(u64::decode, |v| head_bytes(*v))
    }

    fn signed(&mut self) -> Result<i64, WireError> {
        self.exact(i64::decode, |v| {
            head_bytes(if *v < 0 {
                (-1 - *v).unsigned_abs()
            } else {
                v.unsigned_abs()
            })
        })
    }

    fn length(&mut self) -> Result<usize, WireError> {
        let malformed = WireError::Malformed { field: "length" };
        let len = self.exact(
            |input| Array::len(input).map_err(|_| malformed)?.ok_or(malformed),
            |len| head_bytes(u64::try_from(*len).unwrap_or(u64::MAX)),
        )?;
        // Every element takes at least a byte.
        if len <= self.0.len() {
            Ok(len)
        } else {
            Err(malformed)
        }
    }

    /// The head of an array of exactly `len` elements.
    pub fn array(&mut self, field: &'static str, len: usize) -> Result<(), WireError> {
        match self.length() {
            Ok(found) if found == len => Ok(()),
            _ => Err(WireError::Malformed { field }),
        }
    }

    fn with_head<T: AsRef<[u8]> + ?Sized>(value: &T) -> usize {
        let len = value.as_ref().len();
        len + head_bytes(u64::try_from(len).unwrap_or(u64::MAX))
    }
}

/// A value with one encoding.
pub trait Wire: Sized {
    /// Writes it.
    fn put(&self, out: &mut Out);
    /// Reads it.
    fn get(input: &mut In<'_>) -> Result<Self, WireError>;
}

/// A value that comes in lists.
pub trait Listed: Wire {
    /// The longest list.
    const MAX: usize;
}

macro_rules! unsigned {
    ($($t:ty),*) => {$(
        impl Wire for $t {
            fn put(&self, out: &mut Out) {
                out.write(*self);
            }
            fn get(input: &mut In<'_>) -> Result<Self, WireError> {
                let value = input.unsigned()?;
                Self::try_from(value).map_err(|_| WireError::Range { field: "value" })
            }
        }
    )*};
}

unsigned!(u8, u16, u32, u64);

impl Wire for i32 {
    fn put(&self, out: &mut Out) {
        out.write(*self);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        let value = input.signed()?;
        Self::try_from(value).map_err(|_| WireError::Range { field: "value" })
    }
}

impl Wire for i16 {
    fn put(&self, out: &mut Out) {
        out.write(*self);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        let value = input.signed()?;
        Self::try_from(value).map_err(|_| WireError::Range { field: "value" })
    }
}

impl Wire for bool {
    fn put(&self, out: &mut Out) {
        out.write(*self);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        input.exact(Self::decode, |_| 1)
    }
}

impl Wire for Option<u16> {
    fn put(&self, out: &mut Out) {
        match self {
            Some(value) => value.put(out),
            None => out.write(Null),
        }
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        if input.0.first() == Some(&NULL) {
            input.advance(1);
            return Ok(None);
        }
        u16::get(input).map(Some)
    }
}

impl Wire for Vec<u8> {
    fn put(&self, out: &mut Out) {
        out.write(Bytes(self.as_slice()));
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        let Bytes(bytes) = input.exact(<Bytes<&[u8]>>::decode, |b| In::with_head(b.0))?;
        Ok(bytes.to_vec())
    }
}

impl<T: Listed> Wire for Vec<T> {
    fn put(&self, out: &mut Out) {
        out.array(self.len());
        for element in self {
            element.put(out);
        }
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        let len = input.length()?;
        if len > T::MAX {
            return Err(WireError::Range { field: "length" });
        }
        let mut list = Self::with_capacity(len);
        for _ in 0..len {
            list.push(T::get(input)?);
        }
        Ok(list)
    }
}

/// Names the innermost field in which reading failed.
pub fn in_field(error: WireError, field: &'static str) -> WireError {
    match error {
        WireError::Malformed {
            field: "value" | "length",
        } => WireError::Malformed { field },
        WireError::Range {
            field: "value" | "length",
        } => WireError::Range { field },
        named => named,
    }
}

/// A struct as an array of its fields in the given order.
macro_rules! array_of {
    ($t:ident { $($field:ident),+ $(,)? }) => {
        impl $crate::wire::cbor::Wire for $t {
            fn put(&self, out: &mut $crate::wire::cbor::Out) {
                out.array([$(stringify!($field)),+].len());
                $($crate::wire::cbor::Wire::put(&self.$field, out);)+
            }
            fn get(
                input: &mut $crate::wire::cbor::In<'_>,
            ) -> Result<Self, $crate::wire::codec::WireError> {
                input.array(stringify!($t), [$(stringify!($field)),+].len())?;
                Ok(Self {
                    $($field: $crate::wire::cbor::Wire::get(input)
                        .map_err(|e| $crate::wire::cbor::in_field(e, stringify!($field)))?,)+
                })
            }
        }
    };
}

/// An enum as the number of its variant in the given order.
macro_rules! number_of {
    ($t:ident { $($variant:ident),+ $(,)? }) => {
        impl $crate::wire::cbor::Wire for $t {
            fn put(&self, out: &mut $crate::wire::cbor::Out) {
                let place = [$(Self::$variant),+].iter().position(|v| v == self).unwrap_or(0);
                $crate::wire::cbor::Wire::put(&u8::try_from(place).unwrap_or(u8::MAX), out);
            }
            fn get(
                input: &mut $crate::wire::cbor::In<'_>,
            ) -> Result<Self, $crate::wire::codec::WireError> {
                let number: u8 = $crate::wire::cbor::Wire::get(input)?;
                [$(Self::$variant),+]
                    .get(usize::from(number))
                    .copied()
                    .ok_or($crate::wire::codec::WireError::Range { field: "value" })
            }
        }
    };
}

pub(crate) use {array_of, number_of};
