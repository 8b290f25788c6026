//! Design of a chain of integrators with a linear a(x), in the memory layout of C.

use core::mem::offset_of;

use controller_core::{Coefficients, ControlLaw, Controller, Linear, State, design};

use crate::VERSION;
use crate::instance::{self, Instance};
use crate::status::Status;

/// Design of a chain, `edo_smc_design_*_t`. The order is: initial estimates, numbers in the order of
/// [`controller_core::LAYOUT`] without its check, the row of a(x)/b_0, and a check over all of these.
#[repr(C)]
pub struct Design<const N: usize, const R: usize, const MASK: u8, const O: usize> {
    pub(crate) version: u32,
    /// Plant order n, observer order r and mask of the observed channels, one byte each.
    pub(crate) instance: u32,
    /// Initial estimates of the disturbances, in their physical units.
    pub(crate) d_hat: [f32; N],
    pub(crate) controller: Law<N, R, MASK, O>,
    pub(crate) check: f32,
}

type Law<const N: usize, const R: usize, const MASK: u8, const O: usize> =
    Controller<f32, Linear<f32, N>, N, R, MASK, O>;
type StateOf<const N: usize, const R: usize, const MASK: u8, const O: usize> =
    State<f32, Linear<f32, N>, N, R, MASK, O>;

/// Asserts the layout that `edo_smc.h` also declares and asserts.
pub(crate) const fn assert_layout<const N: usize, const R: usize, const MASK: u8, const O: usize>() {
    let coefficients = size_of::<Coefficients<f32, N, R, O>>();
    assert!(coefficients == 4 * (19 + 2 * N + 3 * O * R));
    assert!(coefficients == 4 * (Coefficients::<f32, N, R, O>::NUMBERS - 1));
    assert!(offset_of!(Design<N, R, MASK, O>, d_hat) == 8);
    assert!(offset_of!(Design<N, R, MASK, O>, controller) == 8 + 4 * N);
    assert!(size_of::<Design<N, R, MASK, O>>() == 8 + 4 * N + coefficients + 4 * N + 4);
    assert!(align_of::<Design<N, R, MASK, O>>() == 4);
    assert!(instance::words_of_state::<Design<N, R, MASK, O>>() == O * R + 2 * O + 4);
}

impl<const N: usize, const R: usize, const MASK: u8, const O: usize> Design<N, R, MASK, O> {
    /// Returns the check over all numbers of the design.
    pub(crate) fn check_of_numbers(&self) -> f32 {
        let coefficients = self.controller.coefficients().unchecked();
        design::check(self.d_hat.into_iter().chain(coefficients).chain(*self.controller.model().row()))
    }
}

impl<const N: usize, const R: usize, const MASK: u8, const O: usize> Instance for Design<N, R, MASK, O> {
    type Law = Law<N, R, MASK, O>;
    type Sample = [f32; N];
    type Estimates = [[f32; R]; N];
    const WORD: u32 = u32::from_le_bytes([N as u8, R as u8, MASK, 0]);
    const FLAGS_AT: &'static [usize] = &[StateOf::<N, R, MASK, O>::FLAG_AT];

    fn check(&self) -> Result<(), Status> {
        if self.version != VERSION {
            return Err(Status::VERSION);
        }
        if self.instance != Self::WORD {
            return Err(Status::INSTANCE);
        }
        let coefficients = self.controller.coefficients();
        let row = self.controller.model().row();
        if !coefficients.unchecked().chain(self.d_hat).chain(*row).all(f32::is_finite) {
            return Err(Status::NOT_FINITE);
        }
        let is_design = self.check_of_numbers() == self.check && coefficients.can_be_designed();
        if is_design { Ok(()) } else { Err(Status::COEFFICIENTS) }
    }

    #[inline(always)]
    unsafe fn law(&self) -> &Self::Law {
        &self.controller
    }

    /// Reads the sample number by number: the compiler keeps the numbers in registers of the FPU.
    #[inline(always)]
    unsafe fn read(x: *const [f32; N]) -> [f32; N] {
        // SAFETY: guaranteed by the caller.
        core::array::from_fn(|i| unsafe { x.cast::<f32>().add(i).read() })
    }

    #[inline(always)]
    unsafe fn start(&self, x: &[f32; N]) -> Option<StateOf<N, R, MASK, O>> {
        self.controller.start_from(x, &self.d_hat)
    }

    fn c_estimates(known: [[f32; R]; N]) -> [[f32; R]; N] {
        known
    }
}
