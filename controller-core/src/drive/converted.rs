//! Conversion of a designed drive to another scalar, number by number and by name, for the constants of a recorder.

use core::marker::PhantomData;

use super::law::EncoderForm;
use crate::real::Real;

/// Name of a number of a design.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberName {
    /// Name in the formulas.
    pub name: &'static str,
    /// Encoder from 1, or 0 for none.
    pub encoder: usize,
    /// Index in a row from 1, or 0 for none.
    pub entry: usize,
}

impl<T: Real, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
    EncoderForm<T, M, A, E, N, S, FAST, LATE>
{
    /// Converts every number of the drive to another scalar. The model is already converted.
    #[doc(hidden)]
    pub fn converted<U: Real, V>(
        &self,
        model: V,
        to: &mut dyn FnMut(NumberName, T) -> U,
    ) -> EncoderForm<U, V, A, E, N, S, FAST, LATE> {
        let blocks = core::array::from_fn(|i| self.blocks[i].converted(i + 1, to));
        let sensors = core::array::from_fn(|i| self.sensors[i].converted(i + 1, to));
        let fast = core::array::from_fn(|f| core::array::from_fn(|i| self.fast[f][i].converted(i + 1, to)));
        let mut of = |name, encoder, number| to(NumberName { name, encoder, entry: 0 }, number);
        let inertia = core::array::from_fn(|i| of("inertia", i + 1, self.inertia[i]));
        let (row, belief, at_rest) = (self.row.converted(0, to), self.belief.converted(0, to), self.at_rest);
        EncoderForm { model, blocks, sensors, fast, row, belief, inertia, at_rest, of: PhantomData }
    }
}
