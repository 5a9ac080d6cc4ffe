//! Ids on the wire: 32-bit indices with one reserved value for "none".

/// "No robot", "no object", "no task".
pub const NONE: u32 = u32::MAX;

/// The index an id stands for, or `None` for [`NONE`].
#[must_use]
pub const fn index(id: u32) -> Option<usize> {
    if id == NONE { None } else { Some(id as usize) }
}

/// Defines an enum that travels as an integer: garbage on the wire decodes to an error instead
/// of being undefined behaviour.
macro_rules! tag {
    ($(#[$meta:meta])* $vis:vis enum $name:ident { $($(#[$vmeta:meta])* $variant:ident = $code:literal,)+ }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u32)]
        $vis enum $name { $($(#[$vmeta])* $variant = $code,)+ }

        impl $name {
            /// Every value, in the order of its code.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// The integer that travels.
            #[must_use]
            pub const fn code(self) -> u32 {
                self as u32
            }

            /// The value behind an integer from the wire.
            ///
            /// # Errors
            /// The integer stands for no value.
            pub const fn decode(code: u32) -> Result<Self, crate::Invalid> {
                match code {
                    $($code => Ok(Self::$variant),)+
                    _ => Err(crate::Invalid::Tag { what: stringify!($name), code }),
                }
            }
        }
    };
}
pub(crate) use tag;
