//! Where in memory the numbers of a value lie whose fields the compiler has laid.

use std::mem::MaybeUninit;
use std::slice;

/// The words of a value in memory.
pub(crate) fn words<T: Clone>(value: &T) -> Vec<u32> {
    let mut place = Box::new(MaybeUninit::<T>::zeroed());
    place.write(value.clone());
    // SAFETY: as many words as the type has, of numbers and flags. What lies between its fields was made zero, and
    // nothing but what is looked for by its bits is taken from here.
    unsafe { slice::from_raw_parts(place.as_ptr().cast::<u32>(), size_of::<T>() / 4).to_vec() }
}

/// The k-th number of those that are looked for in memory: a float that no design holds.
pub(crate) fn mark(k: usize) -> f32 {
    f32::from_bits(0x4a5e_0000 + k as u32)
}
