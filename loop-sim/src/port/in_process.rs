//! Controller in this process: the tick of the chip, behind a type that is selected at run time.
//!
//! Orders, precision and observed channels are types of `controller-core`. A scenario selects them at run time. So this
//! module holds every instance that a valid scenario can request. There is no second implementation.

use std::sync::{Mutex, PoisonError};

use controller_core::{
    AnyConfig, Benchmark, Config, ConfigError, ControlLaw as _, Controller, Gate, Gated, Guessing, Libm, Limits,
    Linear, MAX_R, Micromath, Nominal, NominalModel, Output, Real, Running, SampleLimits, Shape, Warnings,
    fingerprint_with,
};

use crate::MAX_ORDER;
use crate::expression::Expression;
use crate::linear::{LawAtRest, Still};
use crate::port::numbers::{self, FLAG};
use crate::port::{ControllerPort, PortError, Tick};

/// Precision of the controller. The plant is always f64.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Single precision, as on the chip.
    F32,
    /// Double precision, as in the reference implementations.
    F64,
}

/// Nominal model a(x), b(x).
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// Linear a(x) = row . x, one coefficient per state.
    Linear(Vec<f64>),
    /// Model of Eq. (59), with e^x from libm.
    BenchmarkLibm,
    /// Model of Eq. (59), with e^x from micromath (f32 only; f64 uses libm).
    BenchmarkMicromath,
    /// Formulas a(x) and b(x) of x_1..x_n. They are computed in f64 and rounded once. Targets do not support them.
    Formulas {
        /// Formula of a(x).
        drift: Expression,
        /// Formula of b(x). A constant has no cost.
        gain: Expression,
    },
}

/// Controller of a scenario: everything that [`build`] needs. The design checks it.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerSpec {
    /// Precision f32 or f64.
    pub precision: Precision,
    /// Model a(x) as the tick computes it.
    pub model: Model,
    /// Design of the controller.
    pub config: AnyConfig,
}

/// Returns the first `L` entries, padded with zeros.
pub fn padded<const L: usize>(row: &[f64]) -> [f64; L] {
    let mut entries = [0.0; L];
    let given = row.len().min(L);
    entries[..given].copy_from_slice(&row[..given]);
    entries
}

/// Designed controller.
pub struct Designed {
    /// Port to the controller in this process.
    pub port: Box<dyn ControllerPort>,
    /// Warnings of the design.
    pub warnings: Warnings,
    /// Design for a target, if it is in f32 and its model is not a formula.
    pub download: Option<Download>,
    /// Controller in f64 without limits of u, at rest at x = 0 with all disturbance estimates 0.
    pub at_rest: Box<dyn LawAtRest>,
}

/// Design as plain numbers, with which a target runs the same controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Download {
    /// Orders and observed channels.
    pub shape: Shape,
    /// Nominal model.
    pub model: ModelKind,
    /// Initial estimates, row of the linear model (zeros for another model), and coefficients.
    pub numbers: Vec<f32>,
}

/// Kind of a [`Model`], without its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelKind {
    /// Linear a(x), with its row among the numbers of the design.
    Linear,
    /// Model of Eq. (59), with e^x from libm.
    BenchmarkLibm,
    /// Model of Eq. (59), with e^x from micromath.
    BenchmarkMicromath,
}

/// Designs the controller of a scenario.
///
/// # Errors
/// Fails with the error of the design.
pub fn build(spec: &ControllerSpec) -> Result<Designed, ConfigError> {
    spec.config.validate()?;
    let Shape { n, r, mask } = spec.config.shape();
    macro_rules! instance {
        ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
            match (n, r, mask) {
                $(($n, $r, $mask) => instance::<$n, $r, $mask, $o>(spec),)*
                // A valid design has one of these configurations.
                _ => unreachable!("no instance for n = {n}, r = {r}, channels {mask:#b}"),
            }
        };
    }
    // The tests of the library use these only: all configurations take half of their compile time.
    #[cfg(test)]
    return if n == 2 {
        controller_core::shapes!(planar => instance)
    } else {
        controller_core::shapes!(archive => instance)
    };
    // `scenario` refuses everything but a drive then; one instance stands for all.
    #[cfg(all(feature = "drives-only", not(test)))]
    return instance! { n2_r2_c2: 2 2 0b10 1, };
    #[cfg(not(any(feature = "drives-only", test)))]
    controller_core::shapes!(all => instance)
}

fn instance<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    spec: &ControllerSpec,
) -> Result<Designed, ConfigError> {
    let Some(mut config) = spec.config.fixed::<N, R>() else { unreachable!("the shape is that of the configuration") };
    // The gate is in front of the port (`sensor::Gated`). Here only the fingerprint includes it.
    let samples = config.options.samples;
    config.options = config.options.with_samples(SampleLimits::NONE);
    let estimates = config.options.initial_estimates;
    let input_gain = config.nominal.input_gain;
    let linear = |a: &[f64]| Nominal { gradient: padded(a), input_gain };
    let exact = match &spec.model {
        Model::Linear(a) => AnyModel::Linear(Linear::<f64, N>::new(&linear(a))),
        Model::BenchmarkLibm | Model::BenchmarkMicromath => AnyModel::Planar(|x| Benchmark::<Libm>::new().drift(x)),
        Model::Formulas { drift, gain } => AnyModel::Formulas(Formulas::kept(drift, gain, input_gain)),
    };
    // At a limit of 0 a small change would be cut on one side.
    let unlimited = Config { options: config.options.with_limits(Limits::NONE), ..config };
    let at_rest = Controller::<f64, _, N, R, MASK, O>::try_design(&unlimited, exact)?;
    let (at_rest, _) = ported(at_rest, [0.0; N], None, &spec.model);
    let Some(at_rest) = Still::of_port(at_rest, N) else { unreachable!("a controller starts at x = 0") };
    let (port, download) = match spec.precision {
        Precision::F32 => {
            let (model, row, kind) = match &spec.model {
                Model::Linear(a) => {
                    let linear = Linear::<f32, N>::new(&linear(a));
                    (AnyModel::Linear(linear), *linear.row(), Some(ModelKind::Linear))
                }
                Model::BenchmarkLibm => {
                    let drift: fn(&_) -> _ = |x| Benchmark::<Libm>::new().drift(x);
                    (AnyModel::Planar(drift), [0.0; N], Some(ModelKind::BenchmarkLibm))
                }
                Model::BenchmarkMicromath => {
                    let drift: fn(&_) -> _ = |x| Benchmark::<Micromath>::new().drift(x);
                    (AnyModel::Planar(drift), [0.0; N], Some(ModelKind::BenchmarkMicromath))
                }
                Model::Formulas { drift, gain } => {
                    (AnyModel::Formulas(Formulas::kept(drift, gain, input_gain)), [0.0; N], None)
                }
            };
            let guess = rounded::<f32, N>(&estimates);
            let controller = Controller::<f32, _, N, R, MASK, O>::try_design(&config, model)?;
            let gate = (samples != SampleLimits::NONE).then(|| Gate::<f32, N>::new(&samples));
            let (port, coefficients) = ported(controller, guess, gate, &spec.model);
            let numbers = [&guess[..], &row, &coefficients].concat();
            (port, kind.map(|model| Download { shape: spec.config.shape(), model, numbers }))
        }
        Precision::F64 => {
            let controller = Controller::<f64, _, N, R, MASK, O>::try_design(&config, exact)?;
            let gate = (samples != SampleLimits::NONE).then(|| Gate::<f64, N>::new(&samples));
            (ported(controller, estimates, gate, &spec.model).0, None)
        }
    };
    Ok(Designed { port, warnings: config.warnings(), download, at_rest: Box::new(at_rest) })
}

/// Returns the controller ready to run, and its coefficients. The program has it once per configuration and
/// precision.
#[inline(never)]
fn ported<T: Real, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    law: Controller<T, AnyModel<T, N>, N, R, MASK, O>,
    guess: [T; N],
    gate: Option<Gate<T, N>>,
    model: &Model,
) -> (Box<dyn ControllerPort>, Vec<T>) {
    let coefficients = law.coefficients().numbers().collect();
    (Box::new(InProcess::new(law, guess, gate, model)), coefficients)
}

/// Returns the first `N` entries in another precision, padded with zeros.
fn rounded<T: Real, const N: usize>(row: &[f64]) -> [T; N] {
    let mut entries = [T::ZERO; N];
    convert(row, &mut entries);
    entries
}

/// Rounds as many numbers as both slices have.
fn convert<T: Real>(from: &[f64], to: &mut [T]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = T::from_f64(*from);
    }
}

/// Widens rows of `r` estimates each to the largest order.
fn widened<T: Real>(rows: &[T], r: usize) -> [[f64; MAX_R]; MAX_ORDER] {
    let mut estimates = [[0.0; MAX_R]; MAX_ORDER];
    for (to, from) in estimates.iter_mut().zip(rows.chunks_exact(r)) {
        for (to, from) in to.iter_mut().zip(from) {
            *to = from.to_f64();
        }
    }
    estimates
}

/// Model of a scenario. The arithmetic is in `controller-core`.
#[derive(Clone, Copy)]
enum AnyModel<T, const N: usize> {
    Linear(Linear<T, N>),
    Planar(fn(&[T; 2]) -> T),
    Formulas(Formulas),
}

/// Formulas a(x) and b(x)/b_0.
#[derive(Clone, Copy)]
struct Formulas {
    drift: &'static Expression,
    /// Formula of b(x), or `None` for a constant b.
    gain: Option<&'static Expression>,
    input_gain: f64,
}

impl Formulas {
    fn kept(drift: &Expression, gain: &Expression, input_gain: f64) -> Self {
        Self { drift: kept(drift), gain: gain.varies().then(|| kept(gain)), input_gain }
    }

    fn ratio<T: Real, const N: usize>(&self, of: &Expression, x: &[T; N]) -> T {
        T::from_f64(of.value(&x.map(T::to_f64)) / self.input_gain)
    }
}

/// Returns a formula that lives as long as the program, stored once, because a model is `Copy`.
fn kept(formula: &Expression) -> &'static Expression {
    static KEPT: Mutex<Vec<&'static Expression>> = Mutex::new(Vec::new());
    let mut all = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let known = all.iter().copied().find(|known| *known == formula);
    known.unwrap_or_else(|| {
        let fresh: &'static Expression = Box::leak(Box::new(formula.clone()));
        all.push(fresh);
        fresh
    })
}

impl<T: Real, const N: usize> NominalModel<T, N> for AnyModel<T, N> {
    fn drift(&self, x: &[T; N]) -> T {
        match self {
            Self::Linear(linear) => linear.drift(x),
            Self::Planar(drift) => drift(&[x[0], x[1]]),
            Self::Formulas(formulas) => formulas.ratio(formulas.drift, x),
        }
    }

    fn gain_ratio(&self, x: &[T; N]) -> Option<T> {
        match self {
            Self::Formulas(formulas) => formulas.gain.map(|gain| formulas.ratio(gain, x)),
            Self::Linear(_) | Self::Planar(_) => None,
        }
    }
}

/// Running controller with an f64 interface.
struct InProcess<T: Real, const N: usize, const R: usize, const MASK: u8, const O: usize> {
    running: Running<Guessing<Controller<T, AnyModel<T, N>, N, R, MASK, O>>>,
    fingerprint: u32,
}

impl<T: Real, const N: usize, const R: usize, const MASK: u8, const O: usize> InProcess<T, N, R, MASK, O> {
    fn new(
        law: Controller<T, AnyModel<T, N>, N, R, MASK, O>,
        guess: [T; N],
        gate: Option<Gate<T, N>>,
        model: &Model,
    ) -> Self {
        let behind = gate.map(|gate| Guessing::new(Gated::new(law, gate), guess).fingerprint());
        let law = Guessing::new(law, guess);
        let fingerprint = behind.unwrap_or_else(|| law.fingerprint());
        // The fingerprint uses a model at a few points only. Two formulas may differ between them.
        let formulas = match model {
            Model::Formulas { drift, gain } => format!("{drift:?} {gain:?}"),
            Model::Linear(_) | Model::BenchmarkLibm | Model::BenchmarkMicromath => String::new(),
        };
        let fingerprint = fingerprint_with(fingerprint, formulas.bytes().map(u32::from));
        Self { running: Running::new(law), fingerprint }
    }
}

impl<T: Real, const N: usize, const R: usize, const MASK: u8, const O: usize> ControllerPort
    for InProcess<T, N, R, MASK, O>
{
    fn fingerprint(&self) -> Option<u32> {
        Some(self.fingerprint)
    }

    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let Output { u, sigma, sigma_star, health, .. } = self.running.tick(&rounded(sample));
        let estimates = self.running.estimates().map_or_else(Default::default, |all| widened(all.as_flattened(), R));
        Ok(Tick { u: u.to_f64(), sigma: sigma.to_f64(), sigma_star: sigma_star.to_f64(), estimates, health })
    }

    fn report_applied(&mut self, u: f64) {
        self.running.report_applied(T::from_f64(u));
    }

    fn missed(&mut self, periods: u32) {
        self.running.missed(periods);
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.running.reset();
        Ok(())
    }

    fn state(&self) -> Vec<f64> {
        numbers::of(&self.running, FLAG, &[T::ZERO; N])
    }

    fn set_state(&mut self, state: &[f64]) -> bool {
        numbers::restore(&mut self.running, FLAG, state)
    }

    fn observed(&self) -> &[usize] {
        &Controller::<T, AnyModel<T, N>, N, R, MASK, O>::CHANNELS
    }
}
