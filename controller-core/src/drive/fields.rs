//! The numbers of a drive's law, each written once.
//!
//! [`fields!`] declares a struct of numbers in a scalar `T` and makes what is said of every number of it: the same in
//! f32, all of them one after the other, and each converted by name into another scalar. A field is
//!
//! * `T`, one number,
//! * `[T; E]`, one of each encoder,
//! * `[T; N]` or `[T; S]`, a row whose entries count from 1,
//! * any other type, which is no number of the design's arithmetic and is copied.
//!
//! `turn as "full_turn": T` has another name in the formulas than in the struct.

/// See the module.
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
            /// Every number rounded to the nearest f32.
            pub(crate) const fn in_f32(&self) -> $name<f32 $(, $dim)*> {
                $name { $($field: fields!(@f32 $kind, self.$field),)* }
            }
        }

        impl<T: Copy $(, const $dim: usize)*> $name<T $(, $dim)*> {
            /// Every number, in the order of the fields.
            pub(crate) fn numbers(&self) -> impl Iterator<Item = T> {
                core::iter::empty()$(.chain(fields!(@numbers $kind, self.$field)))*
            }

            /// Every number by name; those of one encoder, from 1, or of none, 0.
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
