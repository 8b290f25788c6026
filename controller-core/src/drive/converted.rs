//! A designed drive in another scalar, number by number and by name: so a recorder gets its constants.

use core::marker::PhantomData;

use super::law::EncoderForm;
use crate::real::Real;

/// The name of a number of a design: in the formulas, with its encoder and its place in a row from 1; 0 for none.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberName {
    /// In the formulas.
    pub name: &'static str,
    /// Encoder, or 0.
    pub encoder: usize,
    /// Place in a row, or 0.
    pub entry: usize,
}

impl<T: Real, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
    EncoderForm<T, M, A, E, N, S, FAST, LATE>
{
    /// The same drive in another scalar, with a model that is in it already.
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
