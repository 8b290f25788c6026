//! Error messages for every invalid design, and warnings for every design near an edge.
//!
//! One table each: a change to a valid design (the joint of Example 2, T = 1 ms, capacity R = 2) and the exact message.
//! The messages are part of the interface: they name channel, equation and remedy.

use controller_core::{
    AnyConfig, Benchmark, Cause, Coefficients, Config, ConfigError, Fallback, Field, FlexibleJoint, Health,
    JointParameters, Libm, Limits, Nominal, NominalModel, ObserverGains, Pole, ReachingLaw, Reading, Real, Remedy,
    Surface, Warning, controller,
};
use integration_tests::paper::{NOMINAL, joint_config};
use std::collections::BTreeSet;

type Joint32 = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [2, 4]);
type Joint64 = controller!(f64, FlexibleJoint<f64>, order 4, observers of order 2 in [2, 4]);

const PRINTED: ObserverGains<2> = ObserverGains::as_printed([100.0, 20.0]);
const GOOD: Config<4, 2> =
    Config { reaching: ReachingLaw { k_l: 50.0, k_s: 1.0, epsilon: 0.01 }, ..joint_config(PRINTED) };

type Change = fn(&mut Config<4, 2>);
type Set = fn(&mut Config<4, 2>, f64);

fn changed(change: Change) -> Config<4, 2> {
    let mut config = GOOD;
    change(&mut config);
    config
}

/// Returns the result of `try_design`, which is equal in both precisions. The model belongs to the valid design,
/// because no error concerns it.
fn designed(config: &Config<4, 2>) -> Result<(), ConfigError> {
    let single = Joint32::try_design(config, FlexibleJoint::<f32>::new(&NOMINAL)).map(|_| ());
    let double = Joint64::try_design(config, FlexibleJoint::<f64>::new(&NOMINAL)).map(|_| ());
    // Compared as text, because a NaN in an error does not equal itself.
    assert_eq!(format!("{single:?}"), format!("{double:?}"));
    single
}

/// Returns gains with poles at -`fast` and -10 rad/s: apart, so that the bisection finds them to 1e-11.
fn poles(fast: f64) -> ObserverGains<2> {
    ObserverGains::from_poles([Pole { re: -fast, im: 0.0 }, Pole { re: -10.0, im: 0.0 }])
}

/// Returns the surface with roots -`fast`, -10, -5 rad/s.
fn surface(fast: f64) -> Surface<4> {
    Surface { c: [50.0 * fast, 15.0 * fast + 50.0, fast + 15.0, 1.0], alpha_per_s: 1.0 }
}

const REFUSED: &[(Change, &str)] = &[
    (
        |config| config.surface.c[1] = f64::NAN,
        "surface.c: this number is NaN or infinite: give a finite one (for no limit of u: Limits::NONE)",
    ),
    (|config| config.period_s = 0.0, "the period must be above 0 s (given 0 s)"),
    (|config| config.period_s = -1e-3, "the period must be above 0 s (given -0.001 s)"),
    (
        |config| config.nominal.input_gain = 0.0,
        "the nominal input gain b is 0 (Eq. (39)): the law divides by it; give b(x)'s nominal value",
    ),
    (
        |config| config.surface.c[3] = 2.0,
        "the last surface coefficient must be c_n = 1 (Eq. (44)): divide all c by it (given 2)",
    ),
    (
        |config| config.surface.c[0] = 1126.0,
        "the surface polynomial p^(n-1) + c_{n-1} p^(n-2) + .. + c_1 is not Hurwitz (Eq. (44)): the sliding motion \
         would diverge; try Surface::from_bandwidth",
    ),
    (
        |config| config.surface.alpha_per_s = 0.0,
        "alpha must be above 0 1/s (Eq. (17)): the offset of sigma* would never decay (given 0 1/s)",
    ),
    (
        |config| config.surface.alpha_per_s = 2e-5,
        "alpha times period is below 1e-7 (Eq. (17)): the offset of sigma* would not decay in f32; raise alpha or \
         lengthen the period (given 2e-8)",
    ),
    (|config| config.reaching.k_l = -1.0, "reaching.k_l: this number must not be negative"),
    (|config| config.reaching.k_s = -1.0, "reaching.k_s: this number must not be negative"),
    (|config| config.options.sigma_star_bound = -1.0, "options.sigma_star_bound: this number must not be negative"),
    (
        |config| config.options.observer_pole_limit = -1.0,
        "options.observer_pole_limit: this number must not be negative",
    ),
    (
        |config| config.reaching.epsilon = -0.01,
        "with k_s > 0 the boundary layer epsilon must not be below 0, nor 0 where k_s times period is 0 (Eq. (51)) \
         (given -0.01)",
    ),
    (
        |config| config.options.limits.max = 2e12,
        "a limit of u is beyond 1e12: where the actuator has none give Limits::NONE (given 2e12)",
    ),
    (
        |config| config.options.limits.min = -2e12,
        "a limit of u is beyond 1e12: where the actuator has none give Limits::NONE (given -2e12)",
    ),
    (
        |config| config.options.limits = Limits { min: 1.0, max: -1.0 },
        "the limits are reversed: min must not be above max (given min 1, max -1)",
    ),
    (
        |config| config.options.fallback = Fallback::Safe(300.5),
        "the safe u lies outside the limits: give one that the actuator can hold (given 300.5)",
    ),
    (
        |config| config.options.samples.min[2] = 2e12,
        "x_3: no sample keeps these limits: min must not be above max, nor any beyond 1e12, and the jump must be \
         above 0 (given min 2e12, max 1e12, jump 2e12)",
    ),
    (
        |config| config.options.samples.jump[0] = 1e-60,
        "x_1: no sample keeps these limits: min must not be above max, nor any beyond 1e12, and the jump must be \
         above 0 (given min -1e12, max 1e12, jump 1e-60)",
    ),
    (
        |config| config.options.samples.max[3] = 1e39,
        "x_4: no sample keeps these limits: min must not be above max, nor any beyond 1e12, and the jump must be \
         above 0 (given min -1e12, max 1e39, jump 2e12)",
    ),
    (
        |config| config.options.initial_estimates[3] = 2e12 * config.nominal.input_gain,
        "a designed coefficient overflows or vanishes in this precision: check the units of the period, the gains \
         and b",
    ),
    (
        |config| config.options.samples.jump[1] = 0.0,
        "x_2: no sample keeps these limits: min must not be above max, nor any beyond 1e12, and the jump must be \
         above 0 (given min -1e12, max 1e12, jump 0)",
    ),
    (
        |config| config.options.samples.max[0] = 7.0,
        "limits of samples are kept by a gate, and this law has none: design a Gated<..> of it, or leave with_samples \
         out",
    ),
    (
        |config| config.observers[2] = Some(PRINTED),
        "channel 3: this channel has an observer in the configuration but not in the controller's type (Eq. (47)): \
         add it to the controller's type, or set it to None",
    ),
    (
        |config| config.observers[3] = None,
        "channel 4: this channel has an observer in the controller's type but none in the configuration (Eq. (47)): \
         give its gains, or take it out of the controller's type",
    ),
    (
        |config| config.observers[1] = Some(ObserverGains::as_printed([100.0])),
        "channel 2: needs observer order 2, has 1: the observer order is below n - i, so that sigma needs a derivative \
         it does not estimate (Eq. (44)): raise the order, or observe no disturbance there",
    ),
    (
        |config| config.observers[1] = Some(ObserverGains::as_printed([f64::INFINITY, 20.0])),
        "channel 2: an observer gain is NaN or infinite (Eq. (53)): give finite gains, or poles that are real or come \
         in conjugate pairs",
    ),
    (
        |config| config.observers[3] = Some(ObserverGains::as_printed([100.0, -20.0])),
        "channel 4: the observer gains are not Hurwitz (Eq. (53); order 3 needs l1 l2 > l3): take them from_bandwidth \
         or from_poles",
    ),
    (
        |config| config.observers[1] = Some(poles(1100.0)),
        "channel 2: the fastest observer pole is too fast for the period (Eq. (53)): slow the observer, shorten the \
         period, or raise observer_pole_limit (fastest pole 1100.0000 rad/s, allowed 1000.0000 rad/s)",
    ),
    (
        |config| config.nominal.input_gain = 1e-40,
        "a designed coefficient overflows or vanishes in this precision: check the units of the period, the gains \
         and b",
    ),
    (
        |config| config.nominal.input_gain = 1e40,
        "a designed coefficient overflows or vanishes in this precision: check the units of the period, the gains \
         and b",
    ),
];

#[test]
fn every_refusal_says_what_is_wrong_and_what_to_do() {
    assert_eq!(designed(&GOOD), Ok(()));
    let mut seen = BTreeSet::new();
    for (change, expected) in REFUSED {
        let error = designed(&changed(*change)).expect_err(expected);
        assert_eq!(error.to_string(), *expected);
        // Field and cause by name, without their numbers.
        let cause = format!("{:?}", error.cause);
        seen.insert(cause.split([' ', '{']).next().unwrap_or_default().to_owned());
    }
    // All causes except warnings and the observer order, which gains cannot have wrong.
    assert_eq!(seen.len(), 20, "a kind of refusal is not in the table: {seen:?}");
}

/// A run-time order may also be wrong, and the rules of the typed design also apply to the numbers of a file.
#[test]
fn a_configuration_of_any_order_is_refused_by_the_same_rules() {
    let any = AnyConfig::from(GOOD);
    assert_eq!((any.validate(), any.fixed::<4, 2>()), (Ok(()), Some(GOOD)));
    for (change, expected) in REFUSED {
        let config = changed(*change);
        let alone = config.validate();
        // The type defines the capacity, and therefore the error for an order above it.
        let capacity = matches!(alone, Err(ConfigError { cause: Cause::ObserverOrder { order: 3, .. }, .. }));
        if !capacity {
            assert_eq!(
                format!("{:?}", AnyConfig::from(config).validate()),
                format!("{alone:?}").replace("capacity: 2", "capacity: 3"),
                "{expected}"
            );
        }
    }
    for n in [0, 1, 7, usize::MAX] {
        let error = AnyConfig { n, ..any }.validate().expect_err("no such order");
        assert_eq!(error.to_string(), format!("the plant order must be 2..=6 (Eq. (39)) (given {n})"));
    }
    assert_eq!(any.warnings().iter().count(), GOOD.warnings().iter().count());
}

/// A translation has its own words for field and remedy, with an unchanged cause.
#[test]
fn a_refusal_can_be_told_in_the_words_of_another_language() {
    let error = designed(&changed(|config| config.options.limits.max = f64::NAN)).expect_err("a refusal");
    assert_eq!((error.field, error.cause.remedy()), (Field::Limits, Remedy::FiniteNumber));
    assert_eq!(
        error.told("controller.limits", ": write one").to_string(),
        "controller.limits: this number is NaN or infinite: write one"
    );
    let error = designed(&changed(|config| config.options.limits.max = 2e12)).expect_err("a refusal");
    assert_eq!(error.told("-", "; leave it out").to_string(), "a limit of u is beyond 1e12; leave it out (given 2e12)");
}

#[test]
fn number_that_is_not_finite_is_refused_by_the_name_of_its_field() {
    let fields: [(&str, Set); 17] = [
        ("surface.c", |config, bad| config.surface.c[3] = bad),
        ("nominal.gradient", |config, bad| config.nominal.gradient[3] = bad),
        ("period_s", |config, bad| config.period_s = bad),
        ("surface.alpha_per_s", |config, bad| config.surface.alpha_per_s = bad),
        ("reaching.k_l", |config, bad| config.reaching.k_l = bad),
        ("reaching.k_s", |config, bad| config.reaching.k_s = bad),
        ("reaching.epsilon", |config, bad| config.reaching.epsilon = bad),
        ("nominal.input_gain", |config, bad| config.nominal.input_gain = bad),
        ("options.initial_estimates", |config, bad| config.options.initial_estimates[0] = bad),
        ("options.limits", |config, bad| config.options.limits.min = bad),
        ("options.limits", |config, bad| config.options.limits.max = bad),
        ("options.fallback", |config, bad| config.options.fallback = Fallback::Safe(bad)),
        ("options.sigma_star_bound", |config, bad| config.options.sigma_star_bound = bad),
        ("options.observer_pole_limit", |config, bad| config.options.observer_pole_limit = bad),
        ("options.samples", |config, bad| config.options.samples.min[0] = bad),
        ("options.samples", |config, bad| config.options.samples.max[1] = bad),
        ("options.samples", |config, bad| config.options.samples.jump[3] = bad),
    ];
    for (field, set) in fields {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut config = GOOD;
            set(&mut config, bad);
            let error = designed(&config).expect_err(field);
            assert_eq!((error.field.name(), error.cause), (field, Cause::NotFinite), "{bad}");
        }
    }
}

/// The last valid value next to each rejected one.
#[test]
fn design_on_the_edge_of_a_rule_is_accepted() {
    let edges: [(&str, Change); 9] = [
        ("c_1 just below (c_2 c_3 = 1125)", |config| config.surface.c[0] = 1124.0),
        ("alpha T = 1.1e-7", |config| config.surface.alpha_per_s = 1.1e-4),
        ("no reaching gain", |config| (config.reaching.k_l, config.reaching.k_s) = (0.0, 0.0)),
        ("eps = 0 with k_s T > 0", |config| config.reaching.epsilon = 0.0),
        ("eps < 0 without k_s", |config| (config.reaching.k_s, config.reaching.epsilon) = (0.0, -1.0)),
        ("limits of 1e12", |config| config.options.limits = Limits::symmetric(1e12)),
        ("limits that meet", |config| config.options.limits = Limits { min: 7.0, max: 7.0 }),
        ("safe u on a limit", |config| config.options.fallback = Fallback::Safe(-300.0)),
        ("pole T = 1", |config| config.observers[1] = Some(poles(1000.0))),
    ];
    for (edge, change) in edges {
        assert_eq!(designed(&changed(change)), Ok(()), "{edge}");
    }
}

fn remarks(change: Change) -> Vec<String> {
    let config = changed(change);
    assert_eq!(designed(&config), Ok(()), "a warning is about a design that runs");
    let warnings = config.warnings();
    let told: Vec<String> = warnings.iter().map(Warning::to_string).collect();
    told
}

/// A warning begins just above 0.3, 0.5, 0.5; on the edge there is none. "Just above" is 0.4 %. Roots that coincide are
/// found up to 0.24 % too large, which must not cause a warning for a bandwidth exactly on the edge.
#[test]
fn each_warning_begins_above_its_edge_and_names_the_remedy() {
    let none: [Change; 7] = [
        |_| (),
        |config| config.observers[1] = Some(poles(300.0)),
        |config| config.observers[1] = Some(ObserverGains::from_bandwidth::<2>(300.0)),
        |config| config.reaching.k_l = 500.0,
        |config| config.surface = surface(500.0),
        |config| config.surface = Surface::from_bandwidth(500.0, 1.0),
        // No rule applies here: the implicit switching does not chatter with k_s T beyond the layer.
        |config| config.reaching.k_s = 1e6,
    ];
    for (k, change) in none.into_iter().enumerate() {
        assert_eq!(remarks(change), Vec::<String>::new(), "row {k}");
    }

    let observer = |channel: usize| {
        format!(
            "channel {channel}: fastest observer pole times period is 0.301 (above 0.3 the estimate loses accuracy): \
             slow the observer or shorten the period"
        )
    };
    let linear_gain = "k_l times period is 0.501 (above 0.5 there is little margin for a wrong b or a delay): lower \
                       k_l or shorten the period";
    let sliding = "surface bandwidth times period is 0.502 (above 0.5): slow the surface or shorten the period";
    assert_eq!(remarks(|config| config.observers[1] = Some(poles(301.0))), [observer(2)]);
    assert_eq!(remarks(|config| config.observers[3] = Some(poles(301.0))), [observer(4)]);
    assert_eq!(remarks(|config| config.reaching.k_l = 501.0), [linear_gain]);
    assert_eq!(remarks(|config| config.surface = surface(502.0)), [sliding]);
    let all = remarks(|config| {
        config.observers = [None, Some(poles(301.0)), None, Some(poles(301.0))];
        config.reaching.k_l = 501.0;
        config.surface = surface(502.0);
    });
    assert_eq!(all, [observer(2), observer(4), linear_gain.to_string(), sliding.to_string()]);
}

/// Numbers that were changed after the design are rejected; a decay of 3 once made sigma infinite after a few ticks.
#[test]
fn a_design_with_one_number_changed_is_none() {
    type Joint = controller_core::controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [2, 4]);

    let config = joint_config(ObserverGains::<2>::as_printed([100.0, 20.0]));
    let joint = Joint::try_design(&config, FlexibleJoint::<f32>::new(&NOMINAL)).expect("a valid design");
    let numbers: Vec<f32> = joint.coefficients().numbers().collect();
    let taken = |numbers: &[f32]| Coefficients::<f32, 4, 2, 2>::from_numbers(numbers.iter().copied());
    assert_eq!(taken(&numbers).as_ref(), Some(joint.coefficients()));
    assert_eq!(taken(&numbers[1..]), None);
    for at in 0..numbers.len() {
        let number = numbers[at];
        let bits = (0..32).map(|bit| f32::from_bits(number.to_bits() ^ 1 << bit));
        for other in [0.0, -1.0, 3.0, 1e6, -number, 2.0 * number].into_iter().chain(bits) {
            let mut changed = numbers.clone();
            changed[at] = other;
            assert!(
                other.to_bits() == number.to_bits() || taken(&changed).is_none(),
                "number {at}: {number} -> {other}"
            );
        }
    }
    for at in 1..numbers.len() {
        let mut swapped = numbers.clone();
        swapped.swap(at - 1, at);
        assert!(swapped == numbers || taken(&swapped).is_none(), "numbers {at} and the one before it");
    }
}

#[test]
fn gains_of_an_impossible_order_or_of_poles_without_partners_cannot_be_made() {
    for order in [0, 3, 9, usize::MAX] {
        let refused = ObserverGains::<2>::new(order, [50.0, 1.0]);
        assert_eq!(refused, Err(Cause::ObserverOrder { order, capacity: 2 }));
    }
    assert_eq!(ObserverGains::<2>::new(2, [20.0, 125.0]), Ok(ObserverGains::as_printed([20.0, 125.0])));
    let pole = |re: f64, im: f64| Pole { re, im };
    for poles in [
        [pole(-10.0, 5.0), pole(-10.0, 0.0)],
        [pole(-10.0, 5.0), pole(-10.0, 5.0)],
        [pole(f64::NAN, 0.0), pole(-1.0, 0.0)],
        [pole(f64::NEG_INFINITY, 0.0), pole(-1.0, 0.0)],
        [pole(-1e200, 0.0), pole(-1e200, 0.0)],
    ] {
        assert_eq!(ObserverGains::<2>::try_from_poles(poles), Err(Cause::ObserverNotFinite), "{poles:?}");
    }
    let pair = [pole(-10.0, 5.0), pole(-10.0, -5.0)];
    assert_eq!(ObserverGains::<2>::try_from_poles(pair), Ok(ObserverGains::as_printed([20.0, 125.0])));
}

#[test]
fn a_strict_design_refuses_what_it_would_be_warned_of_and_says_the_channel() {
    let fast = changed(|config| config.observers[3] = Some(poles(400.0)));
    assert_eq!(fast.validate(), Ok(()));
    let refused = fast.validate_strictly().expect_err("a warning").to_string();
    let told = "channel 4: the fastest observer pole times period is above 0.3, where the estimate loses accuracy: \
                slow the observer or shorten the period (0.400)";
    assert_eq!(refused, told);
    for (config, field) in [
        (changed(|config| config.reaching.k_l = 501.0), Field::LinearGain),
        (changed(|config| config.surface = surface(600.0)), Field::Surface),
    ] {
        assert_eq!(config.validate(), Ok(()));
        assert_eq!(config.validate_strictly().expect_err("a warning").field, field);
    }
    assert_eq!(changed(|_| {}).validate_strictly(), Ok(()));
    // Errors come before warnings.
    let wrong = changed(|config| (config.period_s, config.reaching.k_l) = (-1.0, 501.0));
    assert_eq!(wrong.validate_strictly(), wrong.validate());
}

#[test]
fn a_number_of_any_size_leaves_a_message_short() {
    let outside = |config: &mut Config<4, 2>, size| {
        (config.options.limits, config.options.fallback) = (Limits::symmetric(0.0), Fallback::Safe(size));
    };
    let sets: [Set; 8] = [
        outside,
        |config, size| config.options.limits = Limits { min: -1.0, max: size },
        |config, size| config.options.limits = Limits { min: size, max: 2.0 },
        |config, size| config.surface.c[3] = size,
        |config, size| config.surface.alpha_per_s = -size,
        |config, size| config.period_s = -size,
        |config, size| config.observers[3] = Some(ObserverGains::as_printed([size, size.sqrt()])),
        |config, size| config.reaching.k_l = size,
    ];
    let (mut refused, mut warned) = (0, 0);
    for size in [f64::MAX, 1e300, f64::MIN_POSITIVE, f64::from_bits(1)] {
        for set in sets {
            let mut config = GOOD;
            set(&mut config, size);
            let error = config.validate().err().map(|error| error.to_string());
            let remarks = config.warnings();
            refused += usize::from(error.is_some());
            warned += remarks.iter().count();
            for text in error.into_iter().chain(remarks.iter().map(ToString::to_string)) {
                assert!(text.len() < 260, "{text}");
            }
        }
    }
    assert!(refused > 20 && warned > 2, "{refused} {warned}");
}

#[test]
fn a_health_that_is_no_sum_of_flags_is_not_read() {
    let read = |text: &str| serde_json::from_str::<Health>(text);
    assert_eq!(read("3").expect("two flags"), Health::INPUT_REJECTED | Health::SATURATED);
    for text in ["65536", "-1", "0.5"] {
        assert!(read(text).is_err(), "{text}");
    }
    for bits in 0..=Health::ALL {
        let health = Health::from_bits(bits);
        assert_eq!(read(&serde_json::to_string(&health).expect("a number")).expect("its own"), health);
        assert_eq!(health.is_ok(), bits == 0);
    }
}

/// A model and its description in the design are written separately; the shipped ones agree, at rest and elsewhere.
#[test]
fn a_model_that_contradicts_what_the_design_is_told_of_it_is_found() {
    for reading in [Reading::Literal, Reading::Reconstructed, Reading::Stiff, Reading::Physical] {
        let nominal = JointParameters::TABLE_I.chain(reading).nominal();
        for at in [[0.0; 4], [0.3, -2.0, 5.0, 70.0]] {
            assert_eq!(nominal.check(&FlexibleJoint::<f64>::new(&nominal), &at), Ok(()), "{reading:?}");
            let single = FlexibleJoint::<f32>::new(&nominal);
            assert_eq!(nominal.check(&single, &at.map(|x| x as f32)), Ok(()), "{reading:?}");
        }
        let other = Nominal { input_gain: 1.05 * nominal.input_gain, ..nominal };
        let error = nominal.check(&FlexibleJoint::<f64>::new(&other), &[0.0; 4]).expect_err("another b");
        assert!(matches!(error.cause, Cause::GradientContradicts { state: 1, .. }), "{error}");
    }
    let benchmark = Benchmark::<Libm>::nominal();
    assert_eq!(benchmark.check(&Benchmark::<Libm>::new(), &[0.4_f64, -1.0]), Ok(()));
    let wrong = Nominal { gradient: [0.0, -2.0], ..benchmark };
    let error = wrong.check(&Benchmark::<Libm>::new(), &[0.0_f32, 0.0]).expect_err("twice the slope");
    assert_eq!(
        error.to_string(),
        "x_2: the model has another slope there than nominal.gradient says (Eq. (39)): it returns a(x)/b_0, the \
         gradient is that of a(x) (said -2.0000, found -1.0000)"
    );
    // A NaN, or a value without meaning in this precision, agrees with nothing.
    for (model, at) in [(Bent(f64::NAN, 0.0), 0.0), (Bent(f64::INFINITY, 0.0), 0.0), (Bent(0.0, 0.0), f64::NAN)] {
        for gradient in [[0.0, 0.0], [-4.0, -1.0]] {
            let nominal = Nominal { gradient, input_gain: 1.0 };
            assert!(nominal.check(&model, &[at, 0.0]).is_err(), "{gradient:?}");
        }
    }
    let nominal = Nominal { gradient: [-4.0, -1.0], input_gain: 1.0 };
    assert_eq!(nominal.check(&Bent(-4.0, 1e5), &[0.0_f64, 0.0]), Ok(()));
    assert!(nominal.check(&Bent(-4.0, 1e5), &[0.0_f32, 0.0]).is_err(), "1e5 in f32 hides a slope of 4");
    for (gap, found) in [(0.5_f64, "2.0000"), (-0.5, "-2.0000"), (0.0, "inf"), (f64::NAN, "NaN")] {
        let told = benchmark.check(&Bearing(gap), &[0.0_f64; 2]);
        let expected = "b(x) of the model is not of the sign of nominal.input_gain (Eq. (39)): it returns b(x)/b_0 \
                        (b(x)/b_0 = ";
        match told {
            Ok(()) => assert_eq!(found, "2.0000"),
            Err(error) => assert_eq!(error.to_string(), format!("{expected}{found})")),
        }
    }
}

/// b(x)/b_0 = 1/gap, with the slopes of the benchmark.
#[derive(Clone, Copy)]
struct Bearing(f64);

impl NominalModel<f64, 2> for Bearing {
    fn drift(&self, x: &[f64; 2]) -> f64 {
        -x[1]
    }
    fn gain_ratio(&self, _: &[f64; 2]) -> Option<f64> {
        Some(1.0 / self.0)
    }
}

/// Slope and constant part.
#[derive(Clone, Copy)]
struct Bent(f64, f64);

impl<T: Real> NominalModel<T, 2> for Bent {
    fn drift(&self, x: &[T; 2]) -> T {
        T::from_f64(self.0) * x[0] - x[1] + T::from_f64(self.1)
    }
}
