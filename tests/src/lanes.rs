//! Comparison of a vectorised batch of controllers with the single controller, for every configuration.
//!
//! The batches of all configurations in both precisions take a minute to compile. The suite covers the configurations
//! of the C library. The test program `every_lane` covers all of them; the part `shapes` of the deep tier builds it.

use crate::oracle::Model;
use crate::shape::UnitModel;
use crate::strategy::Rng;
use controller_core::{
    Config, ConfigError, ControlLaw, Controller, Fallback, Health, Lanes, Limits, Nominal, NominalModel, ObserverGains,
    Options, Output, ReachingLaw, Real, State, Surface, Words,
};

/// Batch size of the tests; not a power of two, so that a vector loop has a remainder.
const L: usize = 11;

/// Returns a configuration with all features: asymmetric limits, a switching term, a safe output for odd masks.
fn config<const N: usize, const R: usize>(mask: u8) -> Config<N, R> {
    let slow = ObserverGains::from_bandwidth::<R>(30.0 + f64::from(mask));
    Config {
        period_s: 1e-3,
        surface: Surface::from_bandwidth(4.0, 1.0),
        observers: std::array::from_fn(|i| (mask >> i & 1 == 1).then_some(slow)),
        reaching: ReachingLaw { k_l: 40.0, k_s: if mask.is_multiple_of(3) { 0.0 } else { 0.5 }, epsilon: 0.01 },
        nominal: Nominal {
            gradient: std::array::from_fn(|i| -0.5 * (i as f64 + 1.0)),
            input_gain: 3.5 - f64::from(mask),
        },
        options: Options::NEUTRAL
            .with_limits(Limits { min: -40.0, max: 30.0 })
            .with_fallback(if mask.is_multiple_of(2) { Fallback::HoldLast } else { Fallback::Safe(1.25) })
            .with_sigma_star_bound(20.0),
    }
}

/// Returns one entry of a sample: valid, saturating, missing, or an edge case.
fn number(rng: &mut Rng) -> f64 {
    let edges = [f64::NAN, f64::INFINITY, -1e13, 1e30, 1e35, -1e-40, -0.0, 1e6, -3e11, 1e300];
    match rng.integer(0, 59) {
        k @ 0..10 => edges[k],
        10..14 => rng.within(-100.0, 100.0),
        _ => rng.within(-0.2, 0.2),
    }
}

/// Samples of all lanes.
pub type Samples = [[f64; 6]; L];
/// Result of one lane: u, sigma, sigma* as words, and the status flags.
pub type Answer = ([[u32; 2]; 3], Health);

/// Batch of L controllers with L single controllers for comparison. The trait hides the configuration, so the checks
/// compile once.
pub trait Beside {
    /// Runs a tick of the batch.
    fn together(&mut self, x: &Samples) -> [Answer; L];
    /// Runs a tick of each single controller.
    fn alone(&mut self, x: &Samples) -> [Answer; L];
    /// Reports another applied u to lane `l`.
    fn report(&mut self, l: usize);
    /// Returns true if the states of lane `l` and its single controller agree word for word.
    fn same_state(&self, l: usize) -> bool;
}

/// Name and pair of each configuration and precision.
pub type Pairs = Vec<(&'static str, Box<dyn Beside>)>;

struct Both<T: Real, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize> {
    controller: Controller<T, M, N, R, MASK, O>,
    lanes: Lanes<T, M, N, R, MASK, O, L>,
    alone: Vec<State<T, M, N, R, MASK, O>>,
}

fn both<T: Real, M: NominalModel<T, N> + 'static, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    controller: Result<Controller<T, M, N, R, MASK, O>, ConfigError>,
) -> Box<dyn Beside> {
    let controller = controller.expect("a good design");
    let start = controller.start(&[T::from_f64(0.1); N]).expect("a good sample");
    Box::new(Both { controller, lanes: start.lanes::<L>(), alone: vec![start; L] })
}

fn answer<T: Real>(Output { u, sigma, sigma_star, health }: Output<T>) -> Answer {
    ([u, sigma, sigma_star].map(T::to_words), health)
}

impl<T: Real, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize> Beside
    for Both<T, M, N, R, MASK, O>
{
    fn together(&mut self, x: &Samples) -> [Answer; L] {
        let x = x.map(|x| std::array::from_fn(|i| T::from_f64(x[i])));
        let outputs: [Output<T>; L] = std::array::from_fn(|l| self.controller.tick_lane(&mut self.lanes, l, &x[l]));
        outputs.map(answer)
    }

    fn alone(&mut self, x: &Samples) -> [Answer; L] {
        let one = |l: usize| {
            let x = std::array::from_fn(|i| T::from_f64(x[l][i]));
            answer(self.controller.tick(&mut self.alone[l], &x))
        };
        std::array::from_fn(one)
    }

    fn report(&mut self, l: usize) {
        let held = T::from_f64(0.25 * (l as f64 - 5.0));
        Controller::<T, M, N, R, MASK, O>::report_applied(&mut self.alone[l], held);
        let mut state = self.lanes.lane(l);
        Controller::<T, M, N, R, MASK, O>::report_applied(&mut state, held);
        self.lanes.set(l, &state);
    }

    fn same_state(&self, l: usize) -> bool {
        self.lanes.lane(l).words().eq(self.alone[l].words())
    }
}

/// Adds a configuration in both precisions. a(x) is non-linear in all; b(x) varies in every third.
pub fn add<const N: usize, const R: usize, const MASK: u8, const O: usize>(pairs: &mut Pairs, name: &'static str) {
    let swing = if pairs.len().is_multiple_of(3) { 0.2 } else { 0.0 };
    let model = Model { bend: 0.3, swing, ..Model::linear(&[-0.5; N], 3.0) };
    let design = config::<N, R>(MASK);
    let single = Controller::<f32, _, N, R, MASK, O>::try_design(&design, UnitModel::new(&model));
    let double = Controller::<f64, _, N, R, MASK, O>::try_design(&design, UnitModel::new(&model));
    pairs.push((name, both(single)));
    pairs.push((name, both(double)));
}

/// The pairs of a set of configurations, as in `shapes!(archive => pairs)`.
#[macro_export]
macro_rules! pairs {
    ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {{
        let mut pairs = $crate::lanes::Pairs::new();
        $($crate::lanes::add::<$n, $r, $mask, $o>(&mut pairs, stringify!($name));)*
        pairs
    }};
}

/// Checks that each lane is bit-identical to the single controller, on random samples. Some samples are missing and
/// some saturate.
///
/// # Panics
/// On a bit that differs.
pub fn hold(mut pairs: Pairs) {
    const TICKS: usize = 150;
    let (mut rejected, mut saturated) = (0, 0);
    for (seed, (name, pair)) in pairs.iter_mut().enumerate() {
        let mut rng = Rng::new(seed as u64);
        for k in 0..TICKS {
            let x: Samples = std::array::from_fn(|_| std::array::from_fn(|_| number(&mut rng)));
            let (together, alone) = (pair.together(&x), pair.alone(&x));
            for l in 0..L {
                assert_eq!(together[l], alone[l], "{name}, tick {k}, lane {l}");
                rejected += usize::from(alone[l].1.contains(Health::INPUT_REJECTED));
                saturated += usize::from(alone[l].1.contains(Health::SATURATED));
                if rng.chance(0.2) {
                    pair.report(l);
                }
                assert!(pair.same_state(l), "{name}, tick {k}, lane {l}");
            }
        }
    }
    let lane_ticks = pairs.len() * TICKS * L;
    println!("{lane_ticks} lane-ticks, {rejected} rejected, {saturated} saturated");
    assert!(rejected > lane_ticks / 40 && saturated > lane_ticks / 40, "{rejected} {saturated} of {lane_ticks}");
}
