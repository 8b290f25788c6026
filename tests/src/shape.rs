//! The shipped controller behind one trait, for every order n, capacity R, set of observed channels and precision.
//!
//! All configurations that Eq. (44) allows are here. An observed channel i < n needs R >= n - i, so the observed
//! channels lie within the last R + 1 ones. There are 116 configurations, each in f32 and f64.

use crate::oracle::{Model, Spec};
use controller_core::{
    AnyConfig, Config, ConfigError, ControlLaw, Controller, Health, Limits, Nominal, NominalModel, ObserverGains,
    Options, ReachingLaw, Real, Surface, Words, shapes,
};

/// Output of a tick, in f64 (exact for f32).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Control u.
    pub u: f64,
    /// sigma, Eq. (44).
    pub sigma: f64,
    /// sigma*, Eq. (17).
    pub sigma_star: f64,
    /// Status flags.
    pub health: Health,
}

/// Controller that keeps its own state.
pub trait Shape {
    /// Starts at `x0` with a guess of the disturbances; returns false if rejected.
    fn start_from(&mut self, x0: &[f64], d_hat: &[f64]) -> bool;
    /// Runs one tick; the sample is rounded to the controller's precision.
    fn tick(&mut self, x: &[f64]) -> Tick;
    /// Reports the u that the actuator applied.
    fn report_applied(&mut self, u: f64);
    /// Returns d_hat^(m) of every channel.
    fn estimates(&self) -> Vec<[f64; 3]>;

    /// Changes the words of the state; returns false if the result is not a valid state.
    fn rewrite(&mut self, change: &mut dyn FnMut(&mut [u32])) -> bool;

    /// Starts at `x0`; returns false if rejected.
    fn start(&mut self, x0: &[f64]) -> bool {
        self.start_from(x0, &vec![0.0; x0.len()])
    }
}

/// Precision of the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// f32, as on the target.
    Single,
    /// f64.
    Double,
}

/// [`Model`] in units of b_0.
#[derive(Clone, Copy, Debug)]
pub struct UnitModel<T, const N: usize> {
    row: [T; N],
    bend: T,
    swing: T,
}

impl<T: Real, const N: usize> UnitModel<T, N> {
    /// Converts the test model.
    pub fn new(model: &Model) -> Self {
        Self {
            row: std::array::from_fn(|j| T::from_f64(model.row[j] / model.input_gain)),
            bend: T::from_f64(model.bend / model.input_gain),
            swing: T::from_f64(model.swing),
        }
    }

    fn bent(x1: T) -> T {
        x1 / (T::from_f64(1.0) + x1.abs())
    }
}

impl<T: Real, const N: usize> NominalModel<T, N> for UnitModel<T, N> {
    fn drift(&self, x: &[T; N]) -> T {
        let mut sum = self.bend * Self::bent(x[0]);
        for j in 0..N {
            sum += self.row[j] * x[j];
        }
        sum
    }

    fn gain_ratio(&self, x: &[T; N]) -> Option<T> {
        (self.swing != T::ZERO).then(|| T::from_f64(1.0) + self.swing * Self::bent(x[0]))
    }
}

/// Returns the configuration that a spec describes.
///
/// # Panics
/// If the spec has gains of an order that does not fit.
pub fn config<const N: usize, const R: usize>(spec: &Spec) -> Config<N, R> {
    fn padded<const L: usize>(row: &[f64]) -> [f64; L] {
        std::array::from_fn(|i| row.get(i).copied().unwrap_or(0.0))
    }
    let mut config = Config {
        period_s: spec.period_s,
        surface: Surface { c: padded(&spec.c), alpha_per_s: spec.alpha },
        observers: std::array::from_fn(|i| {
            let gains = spec.observers.get(i)?.as_ref()?;
            Some(ObserverGains::new(gains.l.len(), padded(&gains.l)).expect("an order of 1..=R"))
        }),
        reaching: ReachingLaw { k_l: spec.k_l, k_s: spec.k_s, epsilon: spec.epsilon },
        nominal: Nominal { gradient: padded(&spec.gradient), input_gain: spec.input_gain },
        options: Options::NEUTRAL
            .with_limits(Limits::symmetric(spec.limit))
            // The theory's table contains the printed poles of Example 2 with order 3 (-999.7) at coarse periods.
            .with_observer_pole_limit(100.0),
    };
    if let Ok(symbol) = std::env::var(MUTATION) {
        break_symbol(&mut config, &symbol);
    }
    config
}

/// Environment variable that names a symbol to break in every design of this crate, as a wrong equation would. `cargo
/// xtask mutate` sets it and requires the tests of the paper map to fail. An unknown name breaks nothing: the tests
/// pass, and `cargo xtask mutate` reports it.
pub const MUTATION: &str = "MUTATION";

fn break_symbol<const N: usize, const R: usize>(config: &mut Config<N, R>, symbol: &str) {
    match symbol {
        "c_1" => config.surface.c[0] *= 1.5,
        "alpha" => config.surface.alpha_per_s *= 1.5,
        "k_l" => config.reaching.k_l *= 2.0,
        "k_s" => config.reaching.k_s *= 2.0,
        "epsilon" => config.reaching.epsilon *= 1.5,
        "l" => config.observers.iter_mut().flatten().for_each(|gains| *gains = halved(gains)),
        "lambda" => config.nominal.gradient[N - 1] *= 1.5,
        _ => {}
    }
}

fn halved<const R: usize>(gains: &ObserverGains<R>) -> ObserverGains<R> {
    let mut l = [0.0; R];
    l.iter_mut().zip(gains.l()).for_each(|(half, l)| *half = 0.5 * l);
    ObserverGains::new(gains.order(), l).expect("the order that it had")
}

/// Returns the configuration of a spec with its order as a run-time number.
pub fn any_config(spec: &Spec) -> AnyConfig {
    AnyConfig { n: spec.order(), padded: config(spec) }
}

/// Design and its state kept apart, so that a test can start anywhere.
struct Apart<C: ControlLaw> {
    controller: C,
    state: Option<C::State>,
}

impl<T, C, const N: usize, const R: usize> Shape for Apart<C>
where
    T: Real,
    C: ControlLaw<
            Scalar = T,
            Sample = [T; N],
            Guess = [T; N],
            Output = controller_core::Output<T>,
            Estimates = [[T; R]; N],
        >,
{
    fn start_from(&mut self, x0: &[f64], d_hat: &[f64]) -> bool {
        self.state = self.controller.start_from(&rounded(x0), &rounded(d_hat));
        self.state.is_some()
    }

    fn tick(&mut self, x: &[f64]) -> Tick {
        let state = self.state.as_mut().expect("started");
        let output = self.controller.tick(state, &rounded(x));
        Tick {
            u: output.u.to_f64(),
            sigma: output.sigma.to_f64(),
            sigma_star: output.sigma_star.to_f64(),
            health: output.health,
        }
    }

    fn report_applied(&mut self, u: f64) {
        C::report_applied(self.state.as_mut().expect("started"), T::from_f64(u));
    }

    fn estimates(&self) -> Vec<[f64; 3]> {
        let estimates = self.controller.estimates(self.state.as_ref().expect("started"));
        estimates.iter().map(|of| std::array::from_fn(|m| of.get(m).map_or(0.0, |value| value.to_f64()))).collect()
    }

    fn rewrite(&mut self, change: &mut dyn FnMut(&mut [u32])) -> bool {
        let mut words: Vec<u32> = self.state.as_ref().expect("started").words().collect();
        change(&mut words);
        let changed = C::State::from_words(&mut words.into_iter());
        let is_one = changed.is_some();
        self.state = changed.or(self.state.take());
        is_one
    }
}

fn rounded<T: Real, const N: usize>(x: &[f64]) -> [T; N] {
    std::array::from_fn(|i| T::from_f64(x[i]))
}

/// Returns the channel mask: bit i - 1 for every observed channel i.
pub fn mask(spec: &Spec) -> u8 {
    spec.observed().map(|(i, _)| 1 << i).sum()
}

macro_rules! table {
    ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
        /// Every (n, R, mask) that Eq. (44) allows.
        pub const SHAPES: &[(usize, usize, u8)] = &[$(($n, $r, $mask)),*];
    };
}
shapes!(all => table);

/// Designs the shipped controller with capacity R = `capacity`.
///
/// # Errors
/// The error of the design.
///
/// # Panics
/// On a configuration that Eq. (44) does not allow.
pub fn controller(
    spec: &Spec,
    model: &Model,
    capacity: usize,
    precision: Precision,
) -> Result<Box<dyn Shape>, ConfigError> {
    macro_rules! build {
        ($t:ty, $n:literal, $r:literal, $mask:literal, $o:literal) => {{
            type Built = Controller<$t, UnitModel<$t, $n>, $n, $r, $mask, $o>;
            let controller = Built::try_design(&config(spec), UnitModel::new(model))?;
            Ok(Box::new(Apart { controller, state: None }))
        }};
    }
    macro_rules! dispatch {
        ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
            match (spec.order(), capacity, mask(spec), precision) {
                $(
                    ($n, $r, $mask, Precision::Single) => build!(f32, $n, $r, $mask, $o),
                    ($n, $r, $mask, Precision::Double) => build!(f64, $n, $r, $mask, $o),
                )*
                shape => panic!("no such shape: {shape:?}"),
            }
        };
    }
    shapes!(all => dispatch)
}
