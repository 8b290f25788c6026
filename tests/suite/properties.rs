//! Properties that hold for all inputs.
//!
//! Designs are drawn from a seed (`strategy::any_design`); a failure prints the seed with the inputs. The sequence of
//! cases is fixed, so a run in CI equals a run on a developer's machine.

use controller_core::{
    Cause, Config, ControlLaw, Fallback, FlexibleJoint, Health, INPUT_LIMIT, Limits, Linear, ObserverGains, Options,
    Words,
};
use integration_tests::close::Gap;
use integration_tests::deep;
use integration_tests::oracle::{Gains, Model, Spec, power};
use integration_tests::paper::{NOMINAL, joint_config};
use integration_tests::shape::{Precision, SHAPES, Shape, controller};
use integration_tests::strategy::{Rng, any_design};
use integration_tests::truth::{ExactStep, LinearChain, Term};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Returns the number of cases: all in the deep tier, a quarter in the fast one.
fn cases(cases: u32) -> ProptestConfig {
    let cases = if deep() { cases } else { cases / 4 };
    ProptestConfig { cases, failure_persistence: None, rng_seed: RngSeed::Fixed(0x0ED0), ..ProptestConfig::default() }
}

const MAX_N: usize = 6;

/// Random design with its configuration and precision.
fn any_shape() -> impl Strategy<Value = (usize, u64, bool)> {
    (0..SHAPES.len(), any::<u64>(), any::<bool>())
}

fn drawn((shape, seed, _): (usize, u64, bool)) -> (usize, usize, Spec, Model) {
    let (n, capacity, mask) = SHAPES[shape];
    let (spec, model) = any_design(&mut Rng::new(seed), n, capacity, mask);
    (n, capacity, spec, model)
}

fn precision(drawn: (usize, u64, bool)) -> Precision {
    if drawn.2 { Precision::Single } else { Precision::Double }
}

fn built(spec: &Spec, model: &Model, capacity: usize, precision: Precision) -> Box<dyn Shape> {
    controller(spec, model, capacity, precision).expect("a valid design")
}

/// Returns a sample in proportion to the design: x_j grows by a tenth of the tick's rate per channel, x_n is as drawn.
/// In units of seconds, a chain of order 6 with T = 0.1 ms would demand an a(x) beyond the input limit.
fn fitted(spec: &Spec, x: &[f64; MAX_N]) -> Vec<f64> {
    let n = spec.order();
    (0..n).map(|j| x[j] * power(10.0 * spec.period_s, n - 1 - j)).collect()
}

/// Sample of moderate size, for [`fitted`].
fn sample() -> impl Strategy<Value = [f64; MAX_N]> {
    prop::array::uniform6(-10.0..10.0)
}

/// Any f32 and any f64: NaN of every payload, infinities, subnormals, -0. Most f64 bit patterns become infinite or 0 in
/// f32, so both ranges are drawn.
fn any_bits() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<u32>().prop_map(|bits| f64::from(f32::from_bits(bits))),
        any::<u64>().prop_map(f64::from_bits),
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(INPUT_LIMIT),
        -10.0..10.0,
    ]
}

/// Values that the tick's guard must reject, for any other entries.
fn bad_value() -> impl Strategy<Value = f64> {
    prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY), Just(1e30), Just(-1e30)]
}

proptest! {
    #![proptest_config(cases(2000))]

    /// Eq. (17). The equality is exact: the first tick computes sigma by the operations of the start.
    #[test]
    fn offset_makes_sigma_star_zero_at_start(shape in any_shape(), x0 in sample(), guess in sample()) {
        let (n, capacity, spec, model) = drawn(shape);
        let mut shipped = built(&spec, &model, capacity, precision(shape));
        let x0 = fitted(&spec, &x0);
        prop_assert!(shipped.start_from(&x0, &guess[..n]));
        let tick = shipped.tick(&x0);
        prop_assert_eq!(tick.sigma_star, 0.0);
        prop_assert!(!tick.health.contains(Health::INPUT_REJECTED));
    }

    /// The test plants' a(x) is odd, so the whole tick is odd, sat included. The equality is bit for bit, because IEEE
    /// rounding is odd too.
    #[test]
    fn tick_is_odd(shape in any_shape(), samples in prop::collection::vec(sample(), 2..20)) {
        let (_, capacity, spec, model) = drawn(shape);
        let model = Model { swing: 0.0, ..model };
        let samples: Vec<_> = samples.iter().map(|x| fitted(&spec, x)).collect();
        let mut plus = built(&spec, &model, capacity, precision(shape));
        let mut minus = built(&spec, &model, capacity, precision(shape));
        let mirrored = |x: &[f64]| x.iter().map(|value| -value).collect::<Vec<f64>>();
        prop_assert!(plus.start(&samples[0]) && minus.start(&mirrored(&samples[0])));
        for x in &samples {
            let (one, other) = (plus.tick(x), minus.tick(&mirrored(x)));
            prop_assert_eq!(one.u, -other.u);
            prop_assert_eq!(one.sigma_star, -other.sigma_star);
        }
    }

    /// The switching term alone: the controller with k_s minus the controller without, at the second tick, where both
    /// have one history.
    #[test]
    fn switching_grows_with_sigma_star_up_to_its_limit(
        k_s in 0.1..20.0, epsilon in 0.0..1.0, direction in prop::array::uniform2(0.1..1.0), sign in prop::bool::ANY,
    ) {
        let input_gain = if sign { 2.0 } else { -2.0 };
        let spec = Spec {
            period_s: 1e-2,
            c: vec![3.0, 1.0],
            alpha: 1.0,
            k_l: 10.0,
            k_s,
            epsilon,
            gradient: vec![0.0, 0.0],
            input_gain,
            observers: vec![Some(Gains::from_bandwidth(10.0, 2)), None],
            limit: 1e12,
        };
        let model = Model::linear(&[0.0, 0.0], input_gain);
        let without = Spec { k_s: 0.0, ..spec.clone() };
        let response = |size: f64| {
            let x = direction.map(|part| part * size);
            let [with, without] = [&spec, &without].map(|spec| {
                let mut shipped = built(spec, &model, 2, Precision::Double);
                assert!(shipped.start(&[0.0, 0.0]));
                shipped.tick(&[0.0, 0.0]);
                shipped.tick(&x)
            });
            assert_eq!(with.sigma_star, without.sigma_star);
            (with.sigma_star, -input_gain * (with.u - without.u))
        };
        let largest = 3.0 * (epsilon + k_s * spec.period_s) / direction[1];
        let points: Vec<(f64, f64)> = (-20..=20).map(|k| response(f64::from(k) / 20.0 * largest)).collect();
        // Rounding of a difference of two u of this size.
        let rounding = 1e-12 * (1.0 + largest) / spec.period_s;
        for pair in points.windows(2) {
            prop_assert!(pair[1].0 > pair[0].0);
            prop_assert!(pair[1].1 >= pair[0].1 - rounding, "{:?}", pair);
        }
        // k_s T/K_v with K_v = c_1 T^2/2 + T: the limit is reached and kept on both sides.
        let limit = k_s / (1.0 + 3.0 * spec.period_s / 2.0);
        for (sigma_star, switching) in points {
            prop_assert!(switching.abs() <= limit + rounding, "{} at {}", switching, sigma_star);
            if sigma_star.abs() * 0.9 >= epsilon + k_s * spec.period_s {
                let expected = limit * sigma_star.signum();
                prop_assert!((switching - expected).abs() <= rounding, "{} for {}", switching, expected);
            }
        }
    }

    /// Superposition in samples and inputs, for a linear a(x) and a constant b.
    #[test]
    fn estimator_is_linear(
        shape in any_shape(),
        one in prop::collection::vec((sample(), -10.0..10.0), 30),
        other in prop::collection::vec((sample(), -10.0..10.0), 30),
    ) {
        let (n, capacity, spec, model) = drawn(shape);
        let model = Model { bend: 0.0, swing: 0.0, ..model };
        let estimates = |history: &[([f64; MAX_N], f64)]| {
            let mut shipped = built(&spec, &model, capacity, Precision::Double);
            assert!(shipped.start(&fitted(&spec, &history[0].0)));
            for (x, u) in history {
                let tick = shipped.tick(&fitted(&spec, x));
                assert!(!tick.health.contains(Health::INPUT_REJECTED));
                shipped.report_applied(*u);
            }
            shipped.estimates()
        };
        let sum: Vec<_> =
            one.iter().zip(&other).map(|((x, u), (y, v))| (std::array::from_fn(|i| x[i] + y[i]), u + v)).collect();
        let (one, other, sum) = (estimates(&one), estimates(&other), estimates(&sum));
        for i in 0..n {
            let mut gap = Gap::default();
            for m in 0..3 {
                let unit = power(spec.period_s, m);
                gap.add(unit * (one[i][m] + other[i][m]), unit * sum[i][m]);
                gap.scale = gap.scale.max(unit * one[i][m].abs()).max(unit * other[i][m].abs());
            }
            // Channel n subtracts a(x) and b u, which may be far larger than their difference.
            let terms = model.row.iter().map(|k| 20.0 * k.abs()).sum::<f64>() + 20.0 * spec.input_gain.abs();
            gap.scale = gap.scale.max(10.0 / spec.period_s).max(if i + 1 == n { terms } else { 0.0 });
            prop_assert!(gap.relative() <= 1e-11, "channel {}: {:?}", i + 1, gap);
        }
    }

    /// For any input bits, u is a number within the limits and the estimates stay numbers.
    #[test]
    fn no_bit_pattern_brings_a_nan_out_or_poisons_the_state(
        shape in any_shape(),
        limit in 1e-3..1e6,
        history in prop::collection::vec((prop::array::uniform6(any_bits()), any_bits()), 1..40),
    ) {
        let (n, capacity, spec, model) = drawn(shape);
        let spec = Spec { limit, ..spec };
        let mut shipped = built(&spec, &model, capacity, precision(shape));
        let refused = !shipped.start(&history[0].0[..n]);
        if refused {
            prop_assert!(shipped.start(&[0.0; MAX_N][..n]));
        }
        for (x, applied) in &history {
            let tick = shipped.tick(&x[..n]);
            prop_assert!(tick.u.is_finite() && tick.sigma.is_finite() && tick.sigma_star.is_finite(), "{:?}", tick);
            // The f32 controller uses the rounded limit.
            let rejected = tick.health.contains(Health::INPUT_REJECTED);
            prop_assert!(rejected || tick.u.abs() <= limit * (1.0 + 1e-7), "{:?}", tick);
            if x[..n].iter().any(|value| !value.is_finite()) {
                prop_assert!(rejected);
            }
            shipped.report_applied(*applied);
        }
        prop_assert!(shipped.estimates().iter().flatten().all(|value| value.is_finite()));
    }

    /// An invalid sample acts as a missing one, whatever its content. The test
    /// `formula::lost_samples_are_bridged_as_in_the_plain_transcription` covers the effect of a missing sample.
    #[test]
    fn bad_samples_are_all_alike(
        shape in any_shape(),
        history in prop::collection::vec((sample(), prop::option::of((0..MAX_N, bad_value()))), 2..30),
    ) {
        let (n, capacity, spec, model) = drawn(shape);
        let start = fitted(&spec, &history[0].0);
        let mut various = built(&spec, &model, capacity, precision(shape));
        let mut blank = built(&spec, &model, capacity, precision(shape));
        prop_assert!(various.start(&start) && blank.start(&start));
        let mut held = 0.0;
        for (x, bad) in &history {
            let x = fitted(&spec, x);
            if let Some((at, value)) = bad {
                let mut x = x.clone();
                x[at % n] = *value;
                let tick = various.tick(&x);
                prop_assert_eq!(tick, blank.tick(&vec![f64::NAN; n]));
                prop_assert_eq!((tick.u, tick.health), (held, Health::INPUT_REJECTED));
                // A report that is not a number is ignored.
                various.report_applied(f64::NAN);
            }
            let tick = various.tick(&x);
            prop_assert_eq!(tick, blank.tick(&x));
            prop_assert!(!tick.health.contains(Health::INPUT_REJECTED));
            held = tick.u;
        }
        prop_assert_eq!(various.estimates(), blank.estimates());
    }

    /// At the second tick a limited and a free controller still share their history.
    #[test]
    fn clamp_limits_u_and_says_so(shape in any_shape(), x in sample(), share in 0.1..2.0) {
        let (_, capacity, spec, model) = drawn(shape);
        let x = fitted(&spec, &x);
        let mut free = built(&spec, &model, capacity, Precision::Double);
        prop_assert!(free.start(&x));
        let demand = free.tick(&x).u;
        prop_assume!(demand != 0.0);
        let limit = demand.abs() * share;
        let mut limited = built(&Spec { limit, ..spec }, &model, capacity, Precision::Double);
        prop_assert!(limited.start(&x));
        let tick = limited.tick(&x);
        prop_assert_eq!(tick.u, demand.clamp(-limit, limit));
        prop_assert_eq!(tick.health.contains(Health::SATURATED), demand.abs() > limit);
    }

    /// A channel without an observer has no memory, and a guess for it is ignored.
    #[test]
    fn unobserved_channels_are_not_looked_at(shape in any_shape(), before in sample(), x in sample()) {
        let (n, capacity, spec, model) = drawn(shape);
        let unobserved: Vec<usize> = (0..n).filter(|&i| spec.observers[i].is_none()).collect();
        let observed_or_driving = |j: usize| spec.observers[j].is_some() || (j > 0 && spec.observers[j - 1].is_some());
        let mut shipped = built(&spec, &model, capacity, precision(shape));
        let mut other = built(&spec, &model, capacity, precision(shape));

        // A guess in that channel, even NaN, is not read.
        let mut guess = [0.25; MAX_N];
        for &i in &unobserved {
            guess[i] = f64::NAN;
        }
        prop_assert!(shipped.start_from(&[0.0; MAX_N][..n], &guess[..n]));
        for &i in &unobserved {
            guess[i] = 0.0;
        }
        prop_assert!(other.start_from(&[0.0; MAX_N][..n], &guess[..n]));

        // Past entries that no observer uses have no effect; channel n's observer uses all entries through a(x).
        let (before, x) = (fitted(&spec, &before), fitted(&spec, &x));
        let mut past = before.clone();
        if spec.observers[n - 1].is_none() {
            (0..n).filter(|&j| !observed_or_driving(j)).for_each(|j| past[j] = -before[j]);
        }
        shipped.tick(&before);
        other.tick(&past);
        prop_assert_eq!(shipped.tick(&x), other.tick(&x));
        for i in unobserved {
            prop_assert_eq!(shipped.estimates()[i], [0.0; 3]);
        }
    }
}

type Joint = controller_core::controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [2, 4]);

fn joint(change: impl Fn(&mut Config<4, 2>)) -> Joint {
    let mut config = joint_config(ObserverGains::<2>::as_printed([100.0, 20.0]));
    change(&mut config);
    Joint::try_design(&config, FlexibleJoint::<f32>::new(&NOMINAL)).expect("a valid design")
}

type JointOfOrder3 = controller_core::controller!(f32, FlexibleJoint<f32>, order 4, observers of order 3 in [2, 4]);

/// Returns a slow wave that the joint could perform, at tick k.
fn wave(k: u32) -> [f32; 4] {
    let t = k as f32 * 1e-3;
    [0.1 * (3.0 * t).cos(), -0.3 * (3.0 * t).sin(), 0.2 * (2.0 * t).sin(), 0.4 * (2.0 * t).cos()]
}

/// Returns the applied u in a state: its last word but one, before b(x)/b_0.
fn held_of(state: &<Joint as ControlLaw>::State) -> f32 {
    let words: Vec<u32> = state.words().collect();
    f32::from_bits(words[words.len() - 2])
}

#[test]
fn safe_fallback_goes_out_and_changes_nothing_else() {
    let safe = joint(|config| config.options.fallback = Fallback::Safe(-7.0));
    let hold = joint(|_| ());
    let mut at_safe = safe.start(&wave(0)).expect("a good sample");
    let mut at_hold = hold.start(&wave(0)).expect("a good sample");
    let mut held = 0.0;
    for k in 0..50 {
        if k % 7 == 3 {
            let mut bad = wave(k);
            bad[(k % 4) as usize] = f32::NAN;
            let (one, other) = (safe.tick(&mut at_safe, &bad), hold.tick(&mut at_hold, &bad));
            assert_eq!((one.u, one.health), (-7.0, Health::INPUT_REJECTED));
            assert_eq!((other.u, other.health), (held, Health::INPUT_REJECTED));
            assert_eq!((held_of(&at_safe), held_of(&at_hold)), (-7.0, held));
        } else {
            let output = safe.tick(&mut at_safe, &wave(k));
            assert_eq!(output, hold.tick(&mut at_hold, &wave(k)));
            held = output.u;
        }
    }
}

/// The joint on a steady course misses one sample, and d_hat continues smoothly. A comparison over two ticks of motion
/// with a one-tick prediction would change it by half of d.
#[test]
fn lost_sample_does_not_kick_the_estimates() {
    let controller = joint(|config| {
        let gains = Some(ObserverGains::from_bandwidth::<2>(50.0));
        config.observers = [None, gains, None, gains];
    });
    // x_2 grows at 5 rad/s² with x_3 = 2: d_2 = 3.
    let x = |k: u32| [0.0, 5e-3 * k as f32, 2.0, 0.0];
    let mut state = controller.start(&x(0)).expect("a good sample");
    for k in 0..2000 {
        let lost = k > 1500 && k % 100 < 3;
        controller.tick(&mut state, &if lost { [f32::NAN; 4] } else { x(k) });
        if k > 1000 {
            let d_hat = controller.estimates(&state)[1][0];
            assert!((d_hat - 3.0).abs() < 2e-3, "tick {k}: {d_hat}");
        }
    }
}

/// A spike just below the rejection limit spoils the estimates, then a sample is missing. Unless the estimates were
/// discarded, every later demand would be rejected because of them. Spikes range from 1 to 1e13 in every state, with
/// fast and slow observers.
#[test]
fn no_spike_locks_the_controller() {
    for omega in [50.0, 400.0] {
        let gains = ObserverGains::<3>::from_bandwidth::<3>(omega);
        let config = Config { options: Options::NEUTRAL, ..joint_config(gains) };
        let controller =
            JointOfOrder3::try_design(&config, FlexibleJoint::<f32>::new(&NOMINAL)).expect("a valid design");
        for step in 0..=260 {
            for i in 0..4 {
                let mut spike = [0.0; 4];
                spike[i] = 10f32.powf(0.05 * step as f32);
                let mut state = controller.start(&[0.0; 4]).expect("a good sample");
                controller.tick(&mut state, &spike);
                controller.tick(&mut state, &[f32::NAN; 4]);
                let accepted = (0..5).any(|_| {
                    let output = controller.tick(&mut state, &[0.0; 4]);
                    !output.health.contains(Health::INPUT_REJECTED)
                });
                assert!(accepted, "locked by x_{} = {:e}, poles -{omega}", i + 1, spike[i]);
            }
        }
    }
}

#[test]
fn fallback_stays_within_the_limits_whatever_was_held() {
    let controller = joint(|config| config.options.limits = Limits { min: 10.0, max: 20.0 });
    let mut state = controller.start(&wave(0)).expect("a good sample");
    assert_eq!(controller.tick(&mut state, &[f32::NAN; 4]).u, 10.0);
    assert!(Joint::report_applied(&mut state, 1e11));
    assert_eq!(controller.tick(&mut state, &[f32::NAN; 4]).u, 20.0);
    assert!(!Joint::report_applied(&mut state, f32::NAN) && !Joint::report_applied(&mut state, 1e13));
    assert_eq!(held_of(&state), 20.0);
}

#[test]
fn health_tells_sigma_star_over_its_bound_and_saturation_and_nothing_else() {
    let free = joint(|config| config.options.limits = Limits::NONE);
    let mut state = free.start(&wave(0)).expect("a good sample");
    let mut seen = [false; 2];
    let bounded = joint(|config| {
        config.options.limits = Limits::NONE;
        config.options.sigma_star_bound = 0.5;
    });
    let mut watched = bounded.start(&wave(0)).expect("a good sample");
    for k in 0..400 {
        let (plain, output) = (free.tick(&mut state, &wave(k)), bounded.tick(&mut watched, &wave(k)));
        assert_eq!(plain.health, Health::OK);
        let over = output.sigma_star.abs() > 0.5;
        assert_eq!(output.health, if over { Health::SIGMA_STAR_OVER_BOUND } else { Health::OK });
        assert_eq!(plain.u, output.u);
        seen[usize::from(over)] = true;
    }
    assert_eq!(seen, [true; 2], "the wave must show both");
}

/// n = 2 with a = -lambda x_2: the tick's model is exact for a constant d, so an exact guess leaves no transient. 1e-11
/// is rounding: differences of x over T, summed through poles T = 0.2.
#[test]
fn exact_guess_leaves_no_transient() {
    let (d, lambda, b, period_s) = ([0.4, -2.5], 30.0, 4.0, 1e-2);
    let row = [0.0, -lambda];
    let spec = Spec {
        period_s,
        c: vec![3.0, 1.0],
        alpha: 1.0,
        k_l: 10.0,
        k_s: 0.0,
        epsilon: 0.01,
        gradient: row.to_vec(),
        input_gain: b,
        observers: vec![Some(Gains::from_bandwidth(20.0, 2)), Some(Gains::from_bandwidth(20.0, 3))],
        limit: 1e12,
    };
    let plant = LinearChain { a: row.to_vec(), b, d: d.iter().map(|&d| vec![Term::Const(d)]).collect() };
    let worst_from = |guess: [f64; 2]| {
        let step = ExactStep::new(&plant, period_s);
        let mut shipped = built(&spec, &Model::linear(&row, b), 3, Precision::Double);
        let mut x = vec![0.2, -0.1];
        assert!(shipped.start_from(&x, &guess));
        let mut worst: f64 = 0.0;
        for k in 0..500 {
            let tick = shipped.tick(&x);
            let estimates = shipped.estimates();
            worst = worst.max((estimates[0][0] - d[0]).abs()).max((estimates[1][0] - d[1]).abs());
            step.advance(k, tick.u, &mut x);
        }
        worst
    };
    assert!(worst_from(d) <= 1e-11, "{:e}", worst_from(d));
    assert!(worst_from([0.0, 0.0]) >= 1.0, "without the guess there is a transient to see");
}

/// The whole memory of the joint's controller fits into a cache line of 64 bytes.
#[test]
fn state_of_the_joint_fits_64_bytes() {
    fn size<C: ControlLaw>() -> usize {
        size_of::<C::State>()
    }
    assert_eq!((size::<Joint>(), size::<JointOfOrder3>()), (48, 56));
    // 4 numbers per channel of order 2, and W, u, b/b_0, a flag; nothing for absent channels.
    assert_eq!(
        size::<controller_core::controller!(f32, Linear<f32, 4>, order 4, observers of order 2 in [4])>(),
        4 * (4 + 4)
    );
    assert_eq!(size::<controller_core::controller!(f32, Linear<f32, 4>, order 4, no observers)>(), 4 * 4);
    // An optional state and a loop whose design is a type need no more memory.
    assert_eq!(size_of::<Option<<Joint as ControlLaw>::State>>(), 48);
}

/// `Linear` and the joint's own model agree on one plant to the last bit. The linear row only adds 0 x_2, which is
/// exact.
#[test]
fn model_of_the_joint_is_the_linear_one() {
    macro_rules! same_bits {
        ($t:ty) => {{
    type General = controller_core::controller!($t, Linear<$t, 4>, order 4, observers of order 2 in [2, 4]);
    type Special = controller_core::controller!($t, FlexibleJoint<$t>, order 4, observers of order 2 in [2, 4]);
            let config = joint_config(ObserverGains::as_printed([100.0, 20.0]));
            let general = General::try_design(&config, Linear::<$t, 4>::new(&NOMINAL)).expect("a valid design");
            let special = Special::try_design(&config, FlexibleJoint::<$t>::new(&NOMINAL)).expect("a valid design");
            let x = |k: u32| wave(k).map(<$t>::from);
            let mut one = general.start(&x(0)).expect("a good sample");
            let mut other = special.start(&x(0)).expect("a good sample");
            for k in 0..200 {
                assert_eq!(general.tick(&mut one, &x(k)), special.tick(&mut other, &x(k)), "tick {k}");
            }
            assert!(one.words().eq(other.words()));
        }};
    }
    same_bits!(f32);
    same_bits!(f64);
}

#[test]
fn safe_u_outside_the_limits_is_refused() {
    let mut config = joint_config(ObserverGains::<2>::as_printed([100.0, 20.0]));
    for u in [300.5, -1e39] {
        config.options.fallback = Fallback::Safe(u);
        assert_eq!(config.validate().expect_err("outside").cause, Cause::FallbackOutsideLimits { u });
    }
    config.options.fallback = Fallback::Safe(-300.0);
    assert_eq!(config.validate(), Ok(()));
}
