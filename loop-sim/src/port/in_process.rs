//! The controller in this process: the very tick that runs on the chip, behind a type chosen at run time.
//!
//! Orders, precision and the observed channels are types of `controller-core`. A scenario names them at run time, so
//! this module holds every instance a valid scenario can ask for and picks one; there is no second implementation.

use std::sync::{Mutex, PoisonError};

use controller_core::{
    AnyConfig, Benchmark, Config, ConfigError, ControlLaw as _, Controller, Gate, Gated, Guessing, Libm, Limits,
    Linear, MAX_R, Micromath, Nominal, NominalModel, Output, Real, Running, SampleLimits, Shape, Warnings,
    fingerprint_with, shapes,
};

use crate::MAX_ORDER;
use crate::expression::Expression;
use crate::linear::{LawAtRest, Still};
use crate::port::{ControllerPort, PortError, Tick};

/// Precision of the controller; the plant is always f64.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// As on the chip.
    F32,
    /// As in the oracles.
    F64,
}

/// The nominal a(x), b(x).
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// a(x) = row . x, one coefficient per state.
    Linear(Vec<f64>),
    /// Eq. (59), e^x by libm.
    BenchmarkLibm,
    /// Eq. (59), e^x by micromath (f32 only; f64 takes libm).
    BenchmarkMicromath,
    /// a(x) and b(x) by formulas of x_1..x_n. They are computed in f64 and rounded once: no target has them.
    Formulas {
        /// a(x).
        drift: Expression,
        /// b(x); a constant one costs nothing.
        gain: Expression,
    },
}

/// A controller as a scenario describes it: all that [`build`] needs, checked by the design itself.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerSpec {
    /// f32 or f64.
    pub precision: Precision,
    /// a(x) as the tick computes it.
    pub model: Model,
    /// The design to build a controller of.
    pub config: AnyConfig,
}

/// The first `L` entries, zeros where there are fewer.
pub fn padded<const L: usize>(row: &[f64]) -> [f64; L] {
    let mut entries = [0.0; L];
    let given = row.len().min(L);
    entries[..given].copy_from_slice(&row[..given]);
    entries
}

/// A designed controller.
pub struct Designed {
    /// Ready to tick, in this process.
    pub port: Box<dyn ControllerPort>,
    /// Remarks on the design.
    pub warnings: Warnings,
    /// The same design for a target, if it is in f32 and its model is no formula.
    pub download: Option<Download>,
    /// The same law in f64 without limits of u, at rest at x = 0 with nothing known of the disturbances.
    pub at_rest: Box<dyn LawAtRest>,
}

/// A design as plain numbers: what a target needs to run the very same controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Download {
    /// Orders and observed channels.
    pub shape: Shape,
    /// The nominal model.
    pub model: ModelKind,
    /// Estimates at the start, row of the linear model (zeros for another model), coefficients.
    pub numbers: Vec<f32>,
}

/// A [`Model`] without its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelKind {
    /// a(x) linear, its row among the numbers of the design.
    Linear,
    /// Eq. (59), e^x by libm.
    BenchmarkLibm,
    /// Eq. (59), e^x by micromath.
    BenchmarkMicromath,
}

/// Designs the controller of a scenario.
///
/// # Errors
/// Whatever the design refuses.
pub fn build(spec: &ControllerSpec) -> Result<Designed, ConfigError> {
    spec.config.validate()?;
    let Shape { n, r, mask } = spec.config.shape();
    macro_rules! instance {
        ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
            match (n, r, mask) {
                $(($n, $r, $mask) => instance::<$n, $r, $mask, $o>(spec),)*
                // A design that is valid has one of these shapes.
                _ => unreachable!("no instance for n = {n}, r = {r}, channels {mask:#b}"),
            }
        };
    }
    // The library's own tests are of these: every shape takes half of the time that they compile.
    #[cfg(test)]
    return if n == 2 { shapes!(planar => instance) } else { shapes!(archive => instance) };
    #[cfg(not(test))]
    shapes!(all => instance)
}

fn instance<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    spec: &ControllerSpec,
) -> Result<Designed, ConfigError> {
    let Some(mut config) = spec.config.fixed::<N, R>() else { unreachable!("the shape is that of the configuration") };
    // The gate stands before the port, `sensor::Gated`: only the fingerprint knows of it here.
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
    // At a limit that is 0 a small change would be cut on one side.
    let unlimited = Config { options: config.options.with_limits(Limits::NONE), ..config };
    let at_rest = Controller::<f64, _, N, R, MASK, O>::try_design(&unlimited, exact)?;
    let d_hat = |known: [[f64; R]; N]| first_of_each(known.as_flattened(), R);
    let Some(at_rest) = Still::new(at_rest, N, Vec::new(), padded::<N>, d_hat) else {
        unreachable!("a controller starts at x = 0")
    };
    let (port, download): (Box<dyn ControllerPort>, _) = match spec.precision {
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
            let controller = Controller::<f32, _, N, R, MASK, O>::try_design(&config, model)?;
            let guess = rounded::<f32, N>(&estimates);
            let mut numbers = guess.to_vec();
            numbers.extend_from_slice(&row);
            numbers.extend(controller.coefficients().numbers());
            let download = kind.map(|model| Download { shape: spec.config.shape(), model, numbers });
            let gate = (samples != SampleLimits::NONE).then(|| Gate::<f32, N>::new(&samples));
            (Box::new(InProcess::new(controller, guess, gate, &spec.model)), download)
        }
        Precision::F64 => {
            let controller = Controller::<f64, _, N, R, MASK, O>::try_design(&config, exact)?;
            let gate = (samples != SampleLimits::NONE).then(|| Gate::<f64, N>::new(&samples));
            (Box::new(InProcess::new(controller, estimates, gate, &spec.model)), None)
        }
    };
    Ok(Designed { port, warnings: config.warnings(), download, at_rest: Box::new(at_rest) })
}

/// The first of every `R` numbers.
fn first_of_each(numbers: &[f64], r: usize) -> Vec<f64> {
    numbers.iter().step_by(r).copied().collect()
}

/// The first `N` entries in another precision, zeros where there are fewer.
fn rounded<T: Real, const N: usize>(row: &[f64]) -> [T; N] {
    let mut entries = [T::ZERO; N];
    convert(row, &mut entries);
    entries
}

/// Rounds as many numbers as both have.
fn convert<T: Real>(from: &[f64], to: &mut [T]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = T::from_f64(*from);
    }
}

/// Rows of `r` estimates each, as wide as any law has them.
fn widened<T: Real>(rows: &[T], r: usize) -> [[f64; MAX_R]; MAX_ORDER] {
    let mut estimates = [[0.0; MAX_R]; MAX_ORDER];
    for (to, from) in estimates.iter_mut().zip(rows.chunks_exact(r)) {
        for (to, from) in to.iter_mut().zip(from) {
            *to = from.to_f64();
        }
    }
    estimates
}

/// Whichever model the scenario names; the arithmetic is the one of `controller-core`.
#[derive(Clone, Copy)]
enum AnyModel<T, const N: usize> {
    Linear(Linear<T, N>),
    Planar(fn(&[T; 2]) -> T),
    Formulas(Formulas),
}

/// a(x) and b(x) over b_0.
#[derive(Clone, Copy)]
struct Formulas {
    drift: &'static Expression,
    /// None of a constant b.
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

/// The formula for as long as the program runs, once: a model is `Copy`.
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

/// A running controller that takes and gives f64.
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
        // The law asks a model at some points only; two formulas may differ between them.
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

    fn reset(&mut self) -> Result<(), PortError> {
        self.running.reset();
        Ok(())
    }

    fn observed(&self) -> &[usize] {
        &Controller::<T, AnyModel<T, N>, N, R, MASK, O>::CHANNELS
    }
}
