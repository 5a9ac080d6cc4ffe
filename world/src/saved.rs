//! Values as bytes and back: what checkpoints are made of.
//!
//! Responsible for: one form for each type, little endian, floats bit by bit; reading bytes of
//! unknown origin without panic. Not responsible for: what is saved (`checkpoint.rs`), or whether
//! the values make sense together.
//!
//! [`saved!`] names every field of a struct in a pattern, so that a field that is added and not
//! saved does not compile.

use scene::Vec2;
use shm_types::Invalid;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// Bytes that are no value of the type that was expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Unreadable {
    /// They end too early.
    #[error("it ends too early")]
    Short,
    /// A number that stands for nothing.
    #[error("{0} stands for nothing")]
    Tag(u64),
    /// More than there is room for.
    #[error("{0} are more than there is room for")]
    Many(u64),
}

impl From<Invalid> for Unreadable {
    fn from(invalid: Invalid) -> Self {
        match invalid {
            Invalid::Tag { code, .. } => Self::Tag(code.into()),
            _ => Self::Short,
        }
    }
}

/// What is left to read.
pub(crate) struct Reader<'a>(pub(crate) &'a [u8]);

impl<'a> Reader<'a> {
    /// The next `count` bytes.
    pub(crate) fn take(&mut self, count: usize) -> Result<&'a [u8], Unreadable> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(Unreadable::Short)?;
        self.0 = rest;
        Ok(taken)
    }

    /// A count of things that take a byte each at least, so that no bytes make anybody reserve
    /// more than they are long.
    pub(crate) fn count(&mut self) -> Result<usize, Unreadable> {
        let count = u64::restore(self)?;
        let fits = usize::try_from(count).ok();
        fits.filter(|count| *count <= self.0.len())
            .ok_or(Unreadable::Many(count))
    }
}

/// A value that can be saved.
pub(crate) trait Saved: Sized {
    /// Appends it.
    fn save(&self, out: &mut Vec<u8>);

    /// Reads one.
    ///
    /// # Errors
    /// The bytes are none.
    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable>;
}

/// A message, as its bytes.
pub(crate) fn save_bytes<T: IntoBytes + Immutable>(value: &T, out: &mut Vec<u8>) {
    out.extend_from_slice(value.as_bytes());
}

/// The message behind so many bytes.
pub(crate) fn restore_bytes<T: FromBytes>(from: &mut Reader<'_>) -> Result<T, Unreadable> {
    let bytes = from.take(size_of::<T>())?;
    T::read_from_bytes(bytes).map_err(|_| Unreadable::Short)
}

/// Types that travel as their bytes.
macro_rules! saved_as_bytes {
    ($($type:ty),+ $(,)?) => { $(
        impl $crate::saved::Saved for $type {
            fn save(&self, out: &mut Vec<u8>) {
                $crate::saved::save_bytes(self, out);
            }

            fn restore(
                from: &mut $crate::saved::Reader<'_>,
            ) -> Result<Self, $crate::saved::Unreadable> {
                $crate::saved::restore_bytes(from)
            }
        }
    )+ };
}
pub(crate) use saved_as_bytes;

/// Tags of `shm-types`.
macro_rules! saved_as_code {
    ($($type:ty),+ $(,)?) => { $(
        impl $crate::saved::Saved for $type {
            fn save(&self, out: &mut Vec<u8>) {
                self.code().save(out);
            }

            fn restore(
                from: &mut $crate::saved::Reader<'_>,
            ) -> Result<Self, $crate::saved::Unreadable> {
                Ok(Self::decode(u32::restore(from)?)?)
            }
        }
    )+ };
}
pub(crate) use saved_as_code;

/// Structs, field by field. After `but`, fields that are no state: what a step leaves of itself,
/// with what they are afterwards.
macro_rules! saved {
    ($type:ty { $($field:ident),+ $(,)? } $(but { $($other:ident: $value:expr),+ $(,)? })?) => {
        impl $crate::saved::Saved for $type {
            fn save(&self, out: &mut Vec<u8>) {
                let Self { $($field,)+ $($($other: _,)+)? } = self;
                $($crate::saved::Saved::save($field, out);)+
            }

            fn restore(
                from: &mut $crate::saved::Reader<'_>,
            ) -> Result<Self, $crate::saved::Unreadable> {
                $(let $field = $crate::saved::Saved::restore(from)?;)+
                Ok(Self { $($($other: $value,)+)? $($field,)+ })
            }
        }
    };
}
pub(crate) use saved;

saved_as_bytes!(u32, u64, i64);

impl Saved for usize {
    fn save(&self, out: &mut Vec<u8>) {
        (*self as u64).save(out);
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        let value = u64::restore(from)?;
        Self::try_from(value).map_err(|_| Unreadable::Many(value))
    }
}

impl Saved for bool {
    fn save(&self, out: &mut Vec<u8>) {
        out.push(u8::from(*self));
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        match from.take(1)? {
            [0] => Ok(false),
            [1] => Ok(true),
            other => Err(Unreadable::Tag(other[0].into())),
        }
    }
}

impl Saved for f64 {
    fn save(&self, out: &mut Vec<u8>) {
        self.to_bits().save(out);
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        let value = Self::from_bits(u64::restore(from)?);
        if value.is_finite() {
            Ok(value)
        } else {
            Err(Unreadable::Tag(value.to_bits()))
        }
    }
}

impl Saved for Vec2 {
    fn save(&self, out: &mut Vec<u8>) {
        self.x.save(out);
        self.y.save(out);
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        Ok(Self::new(f64::restore(from)?, f64::restore(from)?))
    }
}

impl<T: Saved> Saved for Option<T> {
    fn save(&self, out: &mut Vec<u8>) {
        self.is_some().save(out);
        if let Some(value) = self {
            value.save(out);
        }
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        bool::restore(from)?.then(|| T::restore(from)).transpose()
    }
}

impl<T: Saved, U: Saved> Saved for (T, U) {
    fn save(&self, out: &mut Vec<u8>) {
        self.0.save(out);
        self.1.save(out);
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        Ok((T::restore(from)?, U::restore(from)?))
    }
}

impl<T: Saved + Copy + Default, const N: usize> Saved for [T; N] {
    fn save(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|value| value.save(out));
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = T::restore(from)?;
        }
        Ok(values)
    }
}

impl<T: Saved> Saved for Vec<T> {
    fn save(&self, out: &mut Vec<u8>) {
        self.len().save(out);
        self.iter().for_each(|value| value.save(out));
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        let count = from.count()?;
        (0..count).map(|_| T::restore(from)).collect()
    }
}
