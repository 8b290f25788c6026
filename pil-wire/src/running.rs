//! All ticks of the firmware: every configuration of plant orders 2 to 4 that Eq. (44) allows, and the nonlinear a(x)
//! of Eq. (59) with either exponential.
//!
//! Orders and channels are types of the controller. A request selects them at run time. So there is an enum per model
//! with a variant per configuration, without allocation.

use controller_core::{
    Benchmark, Coefficients, Controller, Guessing, Libm, Linear, MAX_R, Micromath, NominalModel, Output, Running,
    shapes,
};

use crate::MAX_N;
use crate::drives::Drives;
use crate::frame::{Instance, Model, Reason, Refusal};

type Carried<M, const N: usize, const R: usize, const MASK: u8, const O: usize> =
    Running<Guessing<Controller<f32, M, N, R, MASK, O>>>;

/// Interface of all ticks.
pub(crate) trait Tick {
    fn tick(&mut self, x: &[f32; MAX_N], applied: f32) -> (Output<f32>, [[f32; MAX_R]; MAX_N]);
}

impl<M: NominalModel<f32, N>, const N: usize, const R: usize, const MASK: u8, const O: usize> Tick
    for Carried<M, N, R, MASK, O>
{
    fn tick(&mut self, x: &[f32; MAX_N], applied: f32) -> (Output<f32>, [[f32; MAX_R]; MAX_N]) {
        // NaN means that the held value was not reported. The controller ignores NaN.
        self.report_applied(applied);
        let output = Running::tick(self, &core::array::from_fn(|i| x[i]));
        let mut estimates = [[0.0; MAX_R]; MAX_N];
        for (to, from) in estimates.iter_mut().zip(self.estimates().iter().flatten()) {
            to[..R].copy_from_slice(from);
        }
        (output, estimates)
    }
}

/// Splits a design into estimates, row of a linear model and coefficients.
fn load<M, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    words: &[u32],
    model: fn([f32; N]) -> M,
) -> Result<Carried<M, N, R, MASK, O>, Refusal>
where
    M: NominalModel<f32, N>,
{
    let count = 2 * N + Coefficients::<f32, N, R, O>::NUMBERS;
    if words.len() != count {
        return Err(Refusal { reason: Reason::Count, target: count as u32, request: words.len() as u32 });
    }
    // The length was checked above.
    let mut left = words.iter().copied().map(f32::from_bits);
    let mut next = || left.next().unwrap_or(f32::NAN);
    let guess = core::array::from_fn(|_| next());
    let row = core::array::from_fn(|_| next());
    let coefficients = Coefficients::from_numbers(left).ok_or(Refusal::of(Reason::Coefficients))?;
    Ok(Running::guessing(Controller::from_parts(coefficients, model(row)), guess))
}

/// Defines an enum of all configurations of one model.
macro_rules! carried {
    ($any:ident: $model:ident, $make:expr; $($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
        #[allow(non_camel_case_types)]
        pub(crate) enum $any {
            $($name(Carried<$model<$n>, $n, $r, $mask, $o>),)*
        }

        impl $any {
            fn load(instance: Instance, words: &[u32]) -> Result<Self, Refusal> {
                match (instance.n, instance.r, instance.mask) {
                    $(($n, $r, $mask) => load(words, $make).map(Self::$name),)*
                    _ => Err(Refusal { reason: Reason::Instance, target: 0, request: instance.word() }),
                }
            }

            fn get(&mut self) -> &mut dyn Tick {
                match self {
                    $(Self::$name(running) => running,)*
                }
            }
        }
    };
}

type LinearModel<const N: usize> = Linear<f32, N>;
type LibmModel<const N: usize> = Benchmark<Libm>;
type MicromathModel<const N: usize> = Benchmark<Micromath>;

macro_rules! linears {
    ($($shape:tt)*) => { carried! { Linears: LinearModel, Linear::from_row; $($shape)* } };
}
macro_rules! libms {
    ($($shape:tt)*) => { carried! { Libms: LibmModel, |_| Benchmark::new(); $($shape)* } };
}
macro_rules! micromaths {
    ($($shape:tt)*) => { carried! { Micromaths: MicromathModel, |_| Benchmark::new(); $($shape)* } };
}
shapes!(wire => linears);
shapes!(planar => libms);
shapes!(planar => micromaths);

/// Tick of the loaded design.
#[allow(clippy::large_enum_variant, reason = "one of them lies in a static, and nothing is allocated")]
pub(crate) enum Loaded {
    Linear(Linears),
    BenchmarkLibm(Libms),
    BenchmarkMicromath(Micromaths),
    Drive(Drives),
}

impl Loaded {
    /// Returns the instance with the design of these words, ready for its first sample.
    pub(crate) fn load(instance: Instance, words: &[u32]) -> Result<Self, Refusal> {
        match instance.model {
            Model::Linear => Linears::load(instance, words).map(Self::Linear),
            Model::BenchmarkLibm => Libms::load(instance, words).map(Self::BenchmarkLibm),
            Model::BenchmarkMicromath => Micromaths::load(instance, words).map(Self::BenchmarkMicromath),
            Model::Motor | Model::Joint => Drives::load(instance, words).map(Self::Drive),
        }
    }

    /// Returns the tick on a state, or `None` for a drive.
    pub(crate) fn law(&mut self) -> Option<&mut dyn Tick> {
        match self {
            Self::Linear(any) => Some(any.get()),
            Self::BenchmarkLibm(any) => Some(any.get()),
            Self::BenchmarkMicromath(any) => Some(any.get()),
            Self::Drive(_) => None,
        }
    }

    /// Returns the drive, or `None` for a tick on a state.
    pub(crate) fn drive(&mut self) -> Option<&mut Drives> {
        if let Self::Drive(drive) = self { Some(drive) } else { None }
    }
}
