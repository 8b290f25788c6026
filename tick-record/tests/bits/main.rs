//! Compares a trace, and the C written from it, with the recorded function bit by bit.
//!
//! Every controller configuration is recorded and driven with random ticks next to the Rust tick. The samples are near
//! rest and far from it, with NaN, infinities, denormals, -0 and spikes. There are lost samples in a row, restarts, and
//! controls that the actuator replaced. The tests compare every bit of outputs, status, estimates and state after each
//! tick. They run the trace here and its C, translated by the compiler of the machine, in f32 and in f64.

mod drive;
mod monitor;
mod motor;

use controller_core::{
    Config, Controller, Fallback, Gate, Gated, Limits, Linear, MAX_N, Nominal, NominalModel, ObserverGains, Options,
    ReachingLaw, Real, SampleLimits, Shape, Surface, shapes,
};
use drive::{Plan, Rust, compare, names};
use tick_record::{Functions, Port, Recorder, Role, Symbol, c};

/// Number of ticks over all configurations, in f64. For f32 the test suite has as many with the exported file; here a
/// tenth run.
const TICKS: usize = 1_000_000;
const SHAPES: usize = 116;

/// The fast tier takes every twenty-fourth configuration, with a gate and without one; `DEEP=1` takes all.
fn is_taken(seed: usize) -> bool {
    seed % 24 < 2 || deep()
}

fn deep() -> bool {
    std::env::var_os("DEEP").is_some_and(|value| value == "1")
}

fn ticks() -> usize {
    if deep() { TICKS } else { TICKS / 6 }
}

/// Returns a design of this configuration; `seed` selects its content.
fn config<const N: usize, const R: usize>(mask: u8, seed: usize) -> Config<N, R> {
    let gains = |i: usize| match (seed + i) % 3 {
        0 => ObserverGains::from_bandwidth::<R>(50.0),
        1 if i + 1 >= N => ObserverGains::from_bandwidth::<1>(80.0),
        _ => ObserverGains::from_bandwidth::<R>(30.0),
    };
    let limits = [Limits::NONE, Limits::symmetric(300.0), Limits { min: -20.0, max: 35.0 }][seed % 3];
    let options = Options::NEUTRAL.with_limits(limits).with_sigma_star_bound([1e12, 2.0][seed / 3 % 2]);
    Config {
        period_s: [1e-3, 1e-4][seed % 2],
        surface: Surface::from_bandwidth(5.0, 2.0),
        observers: std::array::from_fn(|i| (mask >> i & 1 == 1).then(|| gains(i))),
        reaching: ReachingLaw { k_l: 50.0, k_s: [0.0, 0.5][seed / 2 % 2], epsilon: 0.01 },
        nominal: nominal(),
        options: options.with_fallback([Fallback::HoldLast, Fallback::Safe(-1.5)][seed / 5 % 2]),
    }
}

/// Limits that accept most samples and reject some.
fn samples<const N: usize>() -> SampleLimits<N> {
    SampleLimits { min: [-3.0; N], max: [2.0; N], jump: [1.0; N] }
}

fn numbers<T: Real, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    designed: &Controller<T, M, N, R, MASK, O>,
) -> Vec<f64> {
    designed.coefficients().numbers().map(T::to_f64).collect()
}

fn nominal<const N: usize>() -> Nominal<N> {
    let gradient = std::array::from_fn(|i| [-7.0, 3.0, 0.0, -11.0, 5.0, -13.0][i % 6]);
    Nominal { gradient, input_gain: -2.5 }
}

macro_rules! every_shape {
    ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
        /// Tests each configuration in turn, in one precision.
        fn every_shape<T: Precision>() {
            let mut seed = 0;
            $(
                seed += 1;
                if is_taken(seed) {
                    T::shape::<$n, $r, $mask, $o>(stringify!($name), seed);
                }
            )*
            assert_eq!(seed, SHAPES);
        }
    };
}
shapes!(all => every_shape);

trait Precision: Real<Count = i32> {
    fn shape<const N: usize, const R: usize, const MASK: u8, const O: usize>(name: &str, seed: usize);
}

macro_rules! precision {
    ($t:ty) => {
        impl Precision for $t {
            fn shape<const N: usize, const R: usize, const MASK: u8, const O: usize>(name: &str, seed: usize) {
                let config = config::<N, R>(MASK, seed);
                let model = Linear::<$t, N>::new(&config.nominal);
                let designed = Controller::<$t, _, N, R, MASK, O>::try_design(&config, model).expect("a design");
                let guess: [$t; N] = std::array::from_fn(|i| [0.0, 0.25, -3.0][(seed + i) % 3]);
                let shape = Shape { n: N as u8, r: R as u8, mask: MASK };
                let [row, guess_f64] = [model.row(), &guess].map(|row| row.map(f64::from));
                let (double, executed) = (size_of::<$t>() == 8, ticks().div_ceil(10 * SHAPES));
                let ticks = if double { 10 * executed } else { executed };
                let plan = Plan { name, ticks, executed, seed: seed as u64, double };
                let recorded = |samples| tick_record::linear(shape, &numbers(&designed), &row, &guess_f64, samples);
                let names = names(N, R, MASK);
                // Every fourth is behind a gate.
                if seed % 4 == 0 {
                    let functions = recorded(Some(&samples::<MAX_N>())).expect("a shape");
                    let names = names.into_iter().chain((1..=N).map(|j| format!("x{j}_seen"))).collect();
                    let designed = Gated::new(designed, Gate::<$t, N>::new(&samples()));
                    compare(&mut Rust { designed: &designed, guess, names, running: None }, &functions, &plan);
                } else {
                    let functions = recorded(None).expect("a shape");
                    compare(&mut Rust { designed: &designed, guess, names, running: None }, &functions, &plan);
                }
            }
        }
    };
}
precision!(f32);
precision!(f64);

#[test]
fn record_and_c_give_the_bits_of_the_tick_in_f32() {
    every_shape::<f32>();
}

#[test]
fn record_and_c_give_the_bits_of_the_tick_in_f64() {
    every_shape::<f64>();
}

/// A magnetic bearing as far as the configuration allows: a(x) is a quotient. b(x) depends on the gap, and has another
/// form for a negative gap.
#[derive(Clone, Copy)]
struct Bearing<T> {
    stiffness: T,
    gap: T,
    floor: T,
}

impl<T: Real> NominalModel<T, 2> for Bearing<T> {
    fn drift(&self, x: &[T; 2]) -> T {
        let gap = self.gap - x[0];
        let pull = if gap > self.floor { self.stiffness / (gap * gap) } else { -self.stiffness * gap };
        pull - x[1].abs() * x[1]
    }

    fn gain_ratio(&self, x: &[T; 2]) -> Option<T> {
        Some(self.gap / (self.gap - x[0]))
    }
}

macro_rules! bearing {
    ($name:ident, $t:ty) => {
        #[test]
        fn $name() {
            let config = config::<2, 2>(0b11, 2);
            let (stiffness, gap, floor) = (0.7, 1.3, 1e-3);
            let model = Bearing::<$t> { stiffness, gap, floor };
            let designed = Controller::<$t, _, 2, 2, 0b11, 2>::try_design(&config, model).expect("a design");
            let recorded = move |recorder: &Recorder| Bearing::<Symbol> {
                stiffness: recorder.constant("stiffness", f64::from(stiffness)),
                gap: recorder.constant("gap", f64::from(gap)),
                floor: recorder.constant("floor", f64::from(floor)),
            };
            let functions: Functions =
                tick_record::controller::<_, 2, 2, 0b11, 2>(&numbers(&designed), &recorded, &[0.0, 0.0], None);
            assert!(functions.state.iter().any(|word| word.name == "gain_prev"));
            let plan = Plan { name: "bearing", ticks: 50_000, executed: 50_000, seed: 5, double: size_of::<$t>() == 8 };
            let names = names(2, 2, 0b11);
            compare(&mut Rust { designed: &designed, guess: [0.0, 0.0], names, running: None }, &functions, &plan);
        }
    };
}
bearing!(a_quotient_with_a_varying_b_records_too_in_f32, f32);
bearing!(a_quotient_with_a_varying_b_records_too_in_f64, f64);

/// Returns the C of a function of two state words, an argument and a flag, for both values of the flag.
fn of_two_words(f: impl Fn(Symbol, Symbol, Symbol, bool) -> (Symbol, Symbol)) -> String {
    let record = tick_record::record(|recorder| {
        let [a, b] = ["a", "b"].map(|name| recorder.number(name, Role::State));
        let (x, on) = (recorder.number("x1", Role::Argument), recorder.truth("on", Role::Argument));
        let (a, b) = f(a, b, x, on);
        recorder.put("a", Role::State, a);
        recorder.put("b", Role::State, b);
    });
    let place = |port: &Port| format!("{}{}", if port.role == Role::State { "s->" } else { "" }, port.name);
    c::Function { record: &record, place: &place, meaning: &|_| String::new(), double: false, signed: "" }.body()
}

#[test]
fn words_of_the_state_that_change_places_are_not_lost() {
    let swapped = of_two_words(|a, b, _, _| (b, a));
    assert_eq!(swapped, "    const float next_1 = s->a;\n    s->a = s->b;\n    s->b = next_1;\n");
    let under_conditions = of_two_words(|a, b, x, on| (if on { x } else { a }, if a > x { x } else { b }));
    assert_eq!(
        under_conditions,
        "    const bool next_1 = s->a > x1;\n    if (on) {\n        s->a = x1;\n    }\n    if (next_1) {\n        \
         s->b = x1;\n    }\n"
    );
}

#[test]
fn a_comparison_with_nan_keeps_its_side() {
    // The negation of "greater" differs from "less or equal" for NaN.
    #[allow(clippy::neg_cmp_op_on_partial_ord, clippy::if_not_else)]
    let text = of_two_words(|a, b, x, _| (if a <= x { a } else { x }, if !(b > x) { x } else { b }));
    assert!(
        text.contains("if (!(s->a <= x1)) {\n        s->a = x1;") && text.contains("if (!(s->b > x1)) {"),
        "{text}"
    );
}
