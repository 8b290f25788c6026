//! Vectors of numbers, one per lane, and functions over them for the instructions of the machine.

use std::ops::{Index, IndexMut};

use super::LANES;

/// One number per lane, aligned so that vectors of any width load whole.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Wide<T = f64>(pub(super) [T; LANES]);

/// Value with this alignment.
#[repr(align(64))]
pub(super) struct Aligned<T>(pub(super) T);

impl<T: Copy> Wide<T> {
    /// Returns the vector with this value in all lanes.
    pub(super) const fn of_all(value: T) -> Self {
        Self([value; LANES])
    }
}

impl<T> Index<usize> for Wide<T> {
    type Output = T;

    #[inline(always)]
    fn index(&self, l: usize) -> &T {
        &self.0[l]
    }
}

impl<T> IndexMut<usize> for Wide<T> {
    #[inline(always)]
    fn index_mut(&mut self, l: usize) -> &mut T {
        &mut self.0[l]
    }
}

/// Vector instruction set, in ascending order. Instructions that the machine lacks are never used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Instructions {
    /// Baseline of the compiled program: SSE2 on x86-64.
    Baseline,
    /// AVX2.
    Avx2,
    /// AVX-512, on machines where it does not lower the clock (Ice Lake, Zen 4 and later).
    Avx512,
}

/// Defines a function with a loop over lanes, compiled for several instruction sets. A call uses the best allowed set:
/// `fn name[NAMES; GENERICS](arguments)`, where NAMES are the names of GENERICS.
macro_rules! vectorised {
    ($(#[$about:meta])* $visible:vis fn $name:ident[$($generic:ident),*; $($generics:tt)*](
        $($argument:ident: $type:ty,)*
    ) $block:block) => {
        $(#[$about])*
        #[allow(clippy::too_many_arguments)]
        // Inlining into a caller would lose the fact that the arguments do not alias.
        #[inline(never)]
        $visible fn $name<$($generics)*>(instructions: $crate::lanes::Instructions, $($argument: $type),*) {
            use $crate::lanes::Instructions;

            #[inline(always)]
            fn body<$($generics)*>($($argument: $type),*) $block

            // Returns true if it ran. On a machine without the instructions another variant runs.
            #[multiversion::multiversion(
                targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw+avx2+fma+bmi1+bmi2"),
                dispatcher = "direct"
            )]
            fn avx512<$($generics)*>($($argument: $type),*) -> bool {
                if multiversion::target::target_cfg_f!(target_feature = "avx512f") {
                    body::<$($generic),*>($($argument),*);
                    return true;
                }
                false
            }

            #[multiversion::multiversion(targets("x86_64+avx2+fma+bmi1+bmi2"), dispatcher = "direct")]
            fn avx2<$($generics)*>($($argument: $type),*) -> bool {
                if multiversion::target::target_cfg_f!(target_feature = "avx2") {
                    body::<$($generic),*>($($argument),*);
                    return true;
                }
                false
            }

            if instructions >= Instructions::Avx512 && avx512::<$($generic),*>($($argument),*) {
                return;
            }
            if instructions >= Instructions::Avx2 && avx2::<$($generic),*>($($argument),*) {
                return;
            }
            body::<$($generic),*>($($argument),*);
        }
    };
}
