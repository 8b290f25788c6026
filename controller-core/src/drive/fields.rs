//! Numbers of a drive's law, each declared once.
//!
//! [`fields!`] declares a struct of numbers in a scalar `T`. It also generates three functions over all of its numbers:
//! rounding to f32, listing in order, and conversion by name to another scalar. A field is
//!
//! * `T`, one number,
//! * `[T; E]`, one number per encoder,
//! * `[T; N]` or `[T; S]`, a row whose entries count from 1,
//! * any other type, which the conversion copies because it is not a number of the design's arithmetic.
//!
//! `turn as "full_turn": T` gives a field another name in the formulas than in the struct.

/// Declares a struct of numbers and its conversions (see the module).
macro_rules! fields {
    (
        $(#[$meta:meta])*
        $vis:vis struct $name:ident<T $(, const $dim:ident)*> {
            $($(#[$doc:meta])* $field:ident $(as $label:literal)?: $kind:tt,)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        $vis struct $name<T $(, const $dim: usize)*> {
            $($(#[$doc])* pub(crate) $field: $kind,)*
        }

        impl<$(const $dim: usize),*> $name<f64 $(, $dim)*> {
            /// Rounds every number to the nearest f32.
            pub(crate) const fn in_f32(&self) -> $name<f32 $(, $dim)*> {
                $name { $($field: fields!(@f32 $kind, self.$field),)* }
            }
        }

        impl<T: Copy $(, const $dim: usize)*> $name<T $(, $dim)*> {
            /// Returns every number, in the order of the fields.
            pub(crate) fn numbers(&self) -> impl Iterator<Item = T> {
                core::iter::empty()$(.chain(fields!(@numbers $kind, self.$field)))*
            }

            /// Converts every number by name. `encoder` is the encoder of the struct, from 1, or 0 for none.
            pub(crate) fn converted<U>(
                &self,
                encoder: usize,
                to: &mut dyn FnMut($crate::drive::converted::NumberName, T) -> U,
            ) -> $name<U $(, $dim)*> {
                $name {
                    $($field: fields!(@converted $kind, self.$field, fields!(@name $field $($label)?), encoder, to),)*
                }
            }
        }
    };
    (@f32 T, $it:expr) => { $it as f32 };
    (@f32 [T; $dim:ident], $it:expr) => { $crate::real::row_f32(&$it) };
    (@f32 $other:tt, $it:expr) => { $it };
    (@numbers T, $it:expr) => { core::iter::once($it) };
    (@numbers [T; $dim:ident], $it:expr) => { $it };
    (@numbers $other:tt, $it:expr) => { core::iter::empty() };
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $label:literal) => { $label };
    (@converted T, $it:expr, $name:expr, $encoder:ident, $to:ident) => {
        $to($crate::drive::converted::NumberName { name: $name, encoder: $encoder, entry: 0 }, $it)
    };
    (@converted [T; E], $it:expr, $name:expr, $encoder:ident, $to:ident) => {
        core::array::from_fn(|i| {
            $to($crate::drive::converted::NumberName { name: $name, encoder: i + 1, entry: 0 }, $it[i])
        })
    };
    (@converted [T; $dim:ident], $it:expr, $name:expr, $encoder:ident, $to:ident) => {
        core::array::from_fn(|j| {
            $to($crate::drive::converted::NumberName { name: $name, encoder: $encoder, entry: j + 1 }, $it[j])
        })
    };
    (@converted $other:tt, $it:expr, $name:expr, $encoder:ident, $to:ident) => { $it };
}

pub(crate) use fields;
