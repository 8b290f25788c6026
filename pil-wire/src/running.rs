//! Every tick that the image carries: plant orders 2 to 4, observer orders 1 to 3, any set of channels, and the
//! nonlinear a(x) of Eq. (59) with either exponential.
//!
//! Orders and channels are types of the controller; a request names them at run time. So there is one enum with a
//! variant per type, and no allocation.

use controller_core::{
    Benchmark, Coefficients, Controller, Libm, Linear, MAX_R, Micromath, NominalModel, Output, State,
};

use crate::MAX_N;
use crate::frame::{Instance, Model, Reason, Refusal};

/// A controller with its state, and the estimates it starts from.
pub(crate) struct Run<M, const N: usize, const R: usize, const MASK: u8, const O: usize> {
    controller: Controller<f32, M, N, R, MASK, O>,
    d_hat: [f32; N],
    state: Option<State<f32, R, O>>,
}

/// What they have in common.
pub(crate) trait Tick {
    fn tick(&mut self, x: &[f32; MAX_N], applied: f32) -> (Output<f32>, [[f32; MAX_R]; MAX_N]);
}

impl<M: NominalModel<f32, N>, const N: usize, const R: usize, const MASK: u8, const O: usize> Tick
    for Run<M, N, R, MASK, O>
{
    fn tick(&mut self, x: &[f32; MAX_N], applied: f32) -> (Output<f32>, [[f32; MAX_R]; MAX_N]) {
        if let Some(state) = &mut self.state {
            // NaN means that it was not told, and is what the controller ignores.
            state.applied(applied);
        }
        let x = core::array::from_fn(|i| x[i]);
        let output = self.controller.tick_or_start(&mut self.state, &self.d_hat, &x);
        let mut estimates = [[0.0; MAX_R]; MAX_N];
        if let Some(state) = &self.state {
            for (to, from) in estimates.iter_mut().zip(self.controller.estimates(state)) {
                to[..R].copy_from_slice(&from);
            }
        }
        (output, estimates)
    }
}

/// Takes a design apart: estimates, row of a linear model, coefficients.
fn load<M, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    numbers: &[f32],
    model: impl FnOnce([f32; N]) -> M,
) -> Result<Run<M, N, R, MASK, O>, Refusal>
where
    M: NominalModel<f32, N>,
{
    let count = 2 * N + Coefficients::<f32, N, R, O>::NUMBERS;
    if numbers.len() != count {
        return Err(Refusal { reason: Reason::Count, target: count as u32, request: numbers.len() as u32 });
    }
    // As long as was just checked.
    let mut left = numbers.iter().copied();
    let mut next = || left.next().unwrap_or(f32::NAN);
    let d_hat = core::array::from_fn(|_| next());
    let row = core::array::from_fn(|_| next());
    let coefficients = Coefficients::from_numbers(next).ok_or(Refusal::of(Reason::Coefficients))?;
    Ok(Run { controller: Controller::from_parts(coefficients, model(row)), d_hat, state: None })
}

/// All sets of channels of a plant order.
macro_rules! channels {
    ($any:ident, $n:literal: $($name:ident $mask:literal $o:literal,)*) => {
        pub(crate) enum $any<M, const R: usize> {
            $($name(Run<M, $n, R, $mask, $o>),)*
        }

        impl<M: NominalModel<f32, $n>, const R: usize> $any<M, R> {
            fn load(mask: u8, numbers: &[f32], model: impl FnOnce([f32; $n]) -> M) -> Result<Self, Refusal> {
                match mask {
                    $($mask => load(numbers, model).map(Self::$name),)*
                    _ => Err(Refusal { reason: Reason::Instance, target: 0, request: u32::from(mask) }),
                }
            }

            fn get(&mut self) -> &mut dyn Tick {
                match self {
                    $(Self::$name(run) => run,)*
                }
            }
        }
    };
}
channels!(Order2, 2: None 0 0, C1 1 1, C2 2 1, C12 3 2,);
channels!(Order3, 3: None 0 0, C1 1 1, C2 2 1, C12 3 2, C3 4 1, C13 5 2, C23 6 2, C123 7 3,);
channels!(Order4, 4:
    None 0 0, C1 1 1, C2 2 1, C12 3 2, C3 4 1, C13 5 2, C23 6 2, C123 7 3,
    C4 8 1, C14 9 2, C24 10 2, C124 11 3, C34 12 2, C134 13 3, C234 14 3, C1234 15 4,
);

/// All plant orders, observer orders and models.
macro_rules! instances {
    ($($name:ident: $any:ident<$model:ty, $r:literal>, $n:literal $id:ident $make:expr;)*) => {
        /// The tick that a design asked for.
        pub(crate) enum Running {
            $($name($any<$model, $r>),)*
        }

        impl Running {
            /// The instance with a design of these numbers, ready for its first sample.
            pub(crate) fn load(instance: Instance, numbers: &[f32]) -> Result<Self, Refusal> {
                match (instance.n, instance.r, instance.model) {
                    $(($n, $r, Model::$id) => $any::load(instance.mask, numbers, $make).map(Self::$name),)*
                    _ => Err(Refusal { reason: Reason::Instance, target: 0, request: instance.word() }),
                }
            }

            pub(crate) fn get(&mut self) -> &mut dyn Tick {
                match self {
                    $(Self::$name(any) => any.get(),)*
                }
            }
        }
    };
}
instances! {
    N2R1: Order2<Linear<f32, 2>, 1>, 2 Linear Linear::from_row;
    N2R2: Order2<Linear<f32, 2>, 2>, 2 Linear Linear::from_row;
    N2R3: Order2<Linear<f32, 2>, 3>, 2 Linear Linear::from_row;
    N3R1: Order3<Linear<f32, 3>, 1>, 3 Linear Linear::from_row;
    N3R2: Order3<Linear<f32, 3>, 2>, 3 Linear Linear::from_row;
    N3R3: Order3<Linear<f32, 3>, 3>, 3 Linear Linear::from_row;
    N4R1: Order4<Linear<f32, 4>, 1>, 4 Linear Linear::from_row;
    N4R2: Order4<Linear<f32, 4>, 2>, 4 Linear Linear::from_row;
    N4R3: Order4<Linear<f32, 4>, 3>, 4 Linear Linear::from_row;
    LibmR1: Order2<Benchmark<Libm>, 1>, 2 BenchmarkLibm |_| Benchmark::new();
    LibmR2: Order2<Benchmark<Libm>, 2>, 2 BenchmarkLibm |_| Benchmark::new();
    LibmR3: Order2<Benchmark<Libm>, 3>, 2 BenchmarkLibm |_| Benchmark::new();
    MicromathR1: Order2<Benchmark<Micromath>, 1>, 2 BenchmarkMicromath |_| Benchmark::new();
    MicromathR2: Order2<Benchmark<Micromath>, 2>, 2 BenchmarkMicromath |_| Benchmark::new();
    MicromathR3: Order2<Benchmark<Micromath>, 3>, 2 BenchmarkMicromath |_| Benchmark::new();
}
