//! Numbers side by side, and functions over them for the instructions that a machine has.

use std::ops::{Index, IndexMut};

use super::LANES;

/// One number of each loop, at an address from which vectors of any width are loaded whole.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Wide<T = f64>(pub(super) [T; LANES]);

/// What is to lie at such an address.
#[repr(align(64))]
pub(super) struct Aligned<T>(pub(super) T);

impl<T: Copy> Wide<T> {
    /// The same of all.
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

/// Vector instructions, the fewest first; those that a machine lacks are not used whatever is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Instructions {
    /// What every machine has that the program was compiled for: SSE2 on x86-64.
    Baseline,
    /// AVX2.
    Avx2,
    /// AVX-512, where it does not slow the clock down (Ice Lake and Zen 4, and later).
    Avx512,
}

/// A function with a loop over lanes, compiled for what a machine may have and called with what may be used of it:
/// `fn name[NAMES; GENERICS](arguments)`, NAMES being those of GENERICS.
macro_rules! vectorised {
    ($(#[$about:meta])* $visible:vis fn $name:ident[$($generic:ident),*; $($generics:tt)*](
        $($argument:ident: $type:ty,)*
    ) $block:block) => {
        $(#[$about])*
        #[allow(clippy::too_many_arguments)]
        // Inside of a caller it would not be known any more that what its arguments point to is apart.
        #[inline(never)]
        $visible fn $name<$($generics)*>(instructions: $crate::lanes::Instructions, $($argument: $type),*) {
            use $crate::lanes::Instructions;

            #[inline(always)]
            fn body<$($generics)*>($($argument: $type),*) $block

            // Each says whether it has done it: on a machine without the instructions it is another one's.
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
