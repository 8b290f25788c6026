//! The controller in this process: the very tick that runs on the chip, behind a type chosen at run time.
//!
//! Orders, precision and the observed channels are types of `controller-core`. A scenario names them at run time, so
//! this module holds every instance a valid scenario can ask for and picks one; there is no second implementation.

use controller_core::{
    Benchmark, Config, ConfigError, Controller, Fallback, Libm, Limits, Linear, MAX_R, Micromath, Nominal,
    NominalModel, ObserverGains, ReachingLaw, Real, State, Surface, Warnings,
};

use crate::MAX_ORDER;
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
}

/// A controller as a scenario describes it: all that [`build`] needs, checked by the design itself.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerSpec {
    /// f32 or f64.
    pub precision: Precision,
    /// Period T, s.
    pub period_s: f64,
    /// c_1..c_n; its length is the plant order n.
    pub surface_c: Vec<f64>,
    /// α, 1/s.
    pub alpha_per_s: f64,
    /// Gains l_1..l_r per channel (length n); `None` where there is no observer.
    pub observers: Vec<Option<Vec<f64>>>,
    /// k_l, k_s, ε.
    pub reaching: ReachingLaw,
    /// a(x) as the tick computes it.
    pub model: Model,
    /// Gradient of a that the design uses (length n); the last entry is -λ.
    pub gradient: Vec<f64>,
    /// b_0.
    pub input_gain: f64,
    /// Clamp of u.
    pub limits: Limits,
    /// What goes out when a sample is rejected.
    pub fallback: Fallback,
    /// Estimates at t = 0, physical units (length n).
    pub initial_estimates: Vec<f64>,
    /// |σ*| above this is told in the health.
    pub sigma_star_bound: f64,
    /// Fastest observer pole times T above which the design is refused.
    pub observer_pole_limit: f64,
}

impl ControllerSpec {
    /// Highest order among the observers (1 if there is none): the capacity R of the instance.
    fn capacity(&self) -> usize {
        self.observers.iter().flatten().map(Vec::len).max().unwrap_or(1).max(1)
    }

    fn config<const N: usize, const R: usize>(&self) -> Config<N, R> {
        Config {
            period_s: self.period_s,
            surface: Surface::from_coefficients(padded(&self.surface_c), self.alpha_per_s),
            observers: core::array::from_fn(|i| {
                let gains = self.observers.get(i)?.as_ref()?;
                Some(ObserverGains { order: gains.len(), l: padded(gains) })
            }),
            reaching: self.reaching,
            nominal: self.nominal(&self.gradient),
            limits: self.limits,
            fallback: self.fallback,
            sigma_star_bound: self.sigma_star_bound,
            observer_pole_limit: self.observer_pole_limit,
        }
    }

    fn nominal<const N: usize>(&self, gradient: &[f64]) -> Nominal<N> {
        Nominal { gradient: padded(gradient), input_gain: self.input_gain }
    }

    /// Bits of the observed channels.
    fn mask(&self) -> u8 {
        self.observers.iter().enumerate().fold(0, |mask, (i, gains)| mask | u8::from(gains.is_some()) << i)
    }
}

/// The first `L` entries, zeros where there are fewer.
fn padded<const L: usize>(row: &[f64]) -> [f64; L] {
    core::array::from_fn(|i| row.get(i).copied().unwrap_or(0.0))
}

/// A designed controller.
pub struct Designed {
    /// Ready to tick, in this process.
    pub port: Box<dyn ControllerPort>,
    /// Remarks on the design.
    pub warnings: Warnings,
    /// The same design for a target, if it is in f32.
    pub download: Option<Download>,
}

/// A design as plain numbers: what a target needs to run the very same controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Download {
    /// Which tick.
    pub shape: Shape,
    /// Estimates at the start, row of the linear model (zeros for another model), coefficients.
    pub numbers: Vec<f32>,
}

/// Which tick a design is for: a type of the controller, named at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Plant order N.
    pub n: u8,
    /// Capacity R for observer orders.
    pub r: u8,
    /// Observed channels, bit i - 1 for channel i.
    pub mask: u8,
    /// Nominal model.
    pub model: ModelKind,
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
    match spec.capacity() {
        1 => with_capacity::<1>(spec),
        2 => with_capacity::<2>(spec),
        // A longer list of gains is refused there as order above R = 3.
        _ => with_capacity::<3>(spec),
    }
}

/// Turns a run-time mask into a type, one bit after the other.
macro_rules! with_mask {
    ($spec:ident, $mask:ident, $n:literal, $r:ident, $bits:expr;) => {
        in_precision::<$n, $r, { $bits }, { ($bits as u8).count_ones() as usize }>($spec)
    };
    ($spec:ident, $mask:ident, $n:literal, $r:ident, $bits:expr; $bit:literal $($rest:literal)*) => {
        if $mask & $bit != 0 {
            with_mask!($spec, $mask, $n, $r, $bits | $bit; $($rest)*)
        } else {
            with_mask!($spec, $mask, $n, $r, $bits; $($rest)*)
        }
    };
}

fn with_capacity<const R: usize>(spec: &ControllerSpec) -> Result<Designed, ConfigError> {
    let mask = spec.mask();
    // Eq. (44) with r <= 3 allows observers in the last four channels only; `validate` refuses the others by name.
    match spec.surface_c.len() {
        2 => spec.config::<2, R>().validate().and_then(|()| with_mask!(spec, mask, 2, R, 0; 1 2)),
        3 => spec.config::<3, R>().validate().and_then(|()| with_mask!(spec, mask, 3, R, 0; 1 2 4)),
        4 => spec.config::<4, R>().validate().and_then(|()| with_mask!(spec, mask, 4, R, 0; 1 2 4 8)),
        5 => spec.config::<5, R>().validate().and_then(|()| with_mask!(spec, mask, 5, R, 0; 2 4 8 16)),
        _ => spec.config::<6, R>().validate().and_then(|()| with_mask!(spec, mask, 6, R, 0; 4 8 16 32)),
    }
}

fn in_precision<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    spec: &ControllerSpec,
) -> Result<Designed, ConfigError> {
    let config = spec.config::<N, R>();
    let (port, download): (Box<dyn ControllerPort>, _) = match spec.precision {
        Precision::F32 => {
            let linear = |a: &[f64]| Linear::<f32, N>::new(&spec.nominal(a));
            let (model, row, id) = match &spec.model {
                Model::Linear(a) => (AnyModel::Linear(linear(a)), *linear(a).row(), ModelKind::Linear),
                Model::BenchmarkLibm => {
                    let drift: fn(&_) -> _ = |x| Benchmark::<Libm>::new().drift(x);
                    (AnyModel::Planar(drift), [0.0; N], ModelKind::BenchmarkLibm)
                }
                Model::BenchmarkMicromath => {
                    let drift: fn(&_) -> _ = |x| Benchmark::<Micromath>::new().drift(x);
                    (AnyModel::Planar(drift), [0.0; N], ModelKind::BenchmarkMicromath)
                }
            };
            let controller = Controller::<f32, _, N, R, MASK, O>::design(&config, model)?;
            let port = InProcess::new(controller, spec);
            let mut numbers = [port.initial_estimates, row].concat();
            controller.coefficients().numbers(|number| numbers.push(number));
            let shape = Shape { n: N as u8, r: R as u8, mask: MASK, model: id };
            (Box::new(port), Some(Download { shape, numbers }))
        }
        Precision::F64 => {
            let model = match &spec.model {
                Model::Linear(a) => AnyModel::Linear(Linear::<f64, N>::new(&spec.nominal(a))),
                Model::BenchmarkLibm | Model::BenchmarkMicromath => {
                    AnyModel::Planar(|x| Benchmark::<Libm>::new().drift(x))
                }
            };
            let controller = Controller::<f64, _, N, R, MASK, O>::design(&config, model)?;
            (Box::new(InProcess::new(controller, spec)), None)
        }
    };
    Ok(Designed { port, warnings: config.warnings(), download })
}

/// Whichever model the scenario names; the arithmetic is the one of `controller-core`.
#[derive(Clone, Copy)]
enum AnyModel<T, const N: usize> {
    Linear(Linear<T, N>),
    Planar(fn(&[T; 2]) -> T),
}

impl<T: Real, const N: usize> NominalModel<T, N> for AnyModel<T, N> {
    fn drift(&self, x: &[T; N]) -> T {
        match self {
            Self::Linear(linear) => linear.drift(x),
            Self::Planar(drift) => drift(&[x[0], x[1]]),
        }
    }
}

/// A running controller.
struct InProcess<T, const N: usize, const R: usize, const MASK: u8, const O: usize> {
    controller: Controller<T, AnyModel<T, N>, N, R, MASK, O>,
    observed: Vec<usize>,
    initial_estimates: [T; N],
    state: Option<State<T, R, O>>,
}

impl<T: Real, const N: usize, const R: usize, const MASK: u8, const O: usize> InProcess<T, N, R, MASK, O> {
    fn new(controller: Controller<T, AnyModel<T, N>, N, R, MASK, O>, spec: &ControllerSpec) -> Self {
        Self {
            controller,
            observed: (0..N).filter(|i| MASK >> i & 1 == 1).collect(),
            initial_estimates: padded::<N>(&spec.initial_estimates).map(T::from_f64),
            state: None,
        }
    }
}

impl<T: Real, const N: usize, const R: usize, const MASK: u8, const O: usize> ControllerPort
    for InProcess<T, N, R, MASK, O>
{
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let x = padded::<N>(sample).map(T::from_f64);
        let output = self.controller.tick_or_start(&mut self.state, &self.initial_estimates, &x);
        let mut estimates = [[0.0; MAX_R]; MAX_ORDER];
        if let Some(state) = &self.state {
            for (to, from) in estimates.iter_mut().zip(self.controller.estimates(state)) {
                to[..R].copy_from_slice(&from.map(T::to_f64));
            }
        }
        Ok(Tick {
            u: output.u.to_f64(),
            sigma: output.sigma.to_f64(),
            sigma_star: output.sigma_star.to_f64(),
            estimates,
            health: output.health,
        })
    }

    fn applied(&mut self, u: f64) {
        if let Some(state) = &mut self.state {
            state.applied(T::from_f64(u));
        }
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.state = None;
        Ok(())
    }

    fn observed(&self) -> &[usize] {
        &self.observed
    }
}
