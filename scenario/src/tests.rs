//! Tests of the errors of invalid scenarios, and of the shipped files.

use std::collections::BTreeSet;
use std::ops::ControlFlow;

use loop_sim::trace::Trace;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use super::*;

/// Controller of reference [1] on Example 1.
const BASELINE: &str = r#"
title = "Fig. 1: linear and switching gains, first-order observer"
span_s = 10.0
window_s = [4.0, 10.0]

[plant]
kind = "benchmark"
x0 = [0.0, 0.0]

[[plant.disturbance]]
channel = 1
terms = [{ kind = "step", amplitude = 0.5, t0_s = 2.0 }]

[controller]
kind = "baseline"
period_s = 1e-4
c = [5.0, 1.0]
k = 3.0

[[controller.observer]]
channel = 1
printed = [10.0]
"#;

/// Valid chain of order 3, to which the tests add keys.
const SMALL_CHAIN: &str = "span_s = 0.1\n[plant]\nkind = \"chain\"\norder = 3\na = [-6.0, -11.0, -6.0]\nb = 2.0\n\
                           [controller]\nsurface_bandwidth_rad_s = 4.0\n";

/// Motor with the keys that its template does not use.
const SMALL_MOTOR: &str = "[motor]\ninertia_kg_m2 = 2e-4\ntorque_n_m_per_a = 0.05\nmax_current_a = 10\n\
                           [encoder]\nbits = 14\n[reference]\nkind = \"points\"\npoints_rad = [0, 0.1, 0.3]\n\
                           every_s = 0.01\nstart_s = 0.1\nduration_s = 0.1\n[[fault]]\nkind = \"jump\"\n\
                           counts = 3\nat_s = 0.1\nfor_s = 0.1\n[[load]]\nkind = \"ramp\"\nslope = 0.1\n";

/// Compiles only if an experiment can move to another thread.
const _: () = {
    const fn moves<T: Send>() {}
    moves::<Experiment>();
};

fn build(text: &str, sets: &[&str]) -> Result<Experiment, String> {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    parse(&Source { file: "a.toml", text, sets: &sets }, "a").map_err(|error| error.to_string())
}

fn error(text: &str, sets: &[&str]) -> String {
    build(text, sets).map_or_else(|error| error, |_| format!("no error: {text} {sets:?}"))
}

/// Asserts that each text is rejected with exactly this message.
fn assert_errors(cases: &[(&str, &str)]) {
    for (text, expected) in cases {
        assert_eq!(error(text, &[]), *expected, "{text}");
    }
}

fn ran(text: &str, sets: &[&str]) -> Trace {
    let mut experiment = build(text, sets).unwrap_or_else(|error| panic!("{error}"));
    experiment.run(&mut |_| ControlFlow::Continue(())).0
}

/// Returns a trace as text, in which NaN equals NaN and every bit is visible.
fn bits(trace: &Trace) -> String {
    format!("{trace:?}")
}

#[test]
fn an_unknown_key_is_told_with_its_place_and_the_nearest_name() {
    assert_errors(&[
        ("controler = 1", "a.toml:1:1: unknown key `controler`; did you mean `controller`?"),
        ("[controller]\nkl = 1", "a.toml:2:1: unknown key `controller.kl`; did you mean `k_l`?"),
        ("\n[controller]\nperiod = 1", "a.toml:3:1: unknown key `controller.period`; did you mean `period_s`?"),
        ("k_l = 1", "a.toml:1:1: unknown key `k_l`; it belongs to controller.k_l"),
        (
            "delay_ticks = 1",
            "a.toml:1:1: unknown key `delay_ticks`; it belongs to actuator.delay_ticks or sensor.delay_ticks",
        ),
        (
            "[[plant.disturbance]]\nchannel = 1\nterms = [{ kind = \"sin\", amplitude = 1, omega = 1 }]",
            "a.toml:3:41: unknown key `plant.disturbance[1].terms[1].omega`; did you mean `omega_rad_s`?",
        ),
        (
            "[plant]\nbanana = 1",
            "a.toml:2:1: unknown key `plant.banana`; expected one of a, b, constants, disturbance, error, \
             input_disturbance, kind, order, parameters, rates, reading, state_dependent, x0",
        ),
    ]);
}

/// Units of data sheets are converted, so that the value can be pasted.
#[test]
fn a_key_in_another_unit_is_told_with_its_value_in_si_units() {
    for (text, expected) in [
        ("[motor]\ninertia_kg_cm2 = 3", "did you mean `inertia_kg_m2`? In its unit: inertia_kg_m2 = 0.0003"),
        ("[motor]\ntorque_mNm_per_A = 38.5", "did you mean `torque_n_m_per_a`? In its unit: torque_n_m_per_a = 0.0385"),
        (
            "[limits]\nmax_speed_rpm = 1500.0\n[motor]",
            "did you mean `max_speed_rad_s`? In its unit: max_speed_rad_s = 157.0796327",
        ),
        ("[motor]\ninertia_kg_cm2 = \"3\"", "did you mean `inertia_kg_m2`?"),
    ] {
        let error = parse(&Source { file: "a.toml", text, sets: &[] }, "a").err().expect("an unknown key").to_string();
        assert!(error.lines().any(|line| line.ends_with(expected)), "{error}");
    }
}

#[test]
fn a_value_of_the_wrong_type_is_told_with_what_was_expected() {
    assert_errors(&[
        ("[controller]\nk_l = \"a\"", "a.toml:2:7: `controller.k_l`: found \"a\", expected a finite number at least 0"),
        (
            "[plant]\norder = 2.5",
            "a.toml:2:9: `plant.order`: found 2.5, expected a whole number at least 2 and at most 6",
        ),
        ("[plant]\nx0 = 1", "a.toml:2:6: `plant.x0`: found 1, expected a list of 2 to 6 numbers"),
        ("[plant]\nx0 = [0, 0, 0, true]", "a.toml:2:16: `plant.x0[4]`: found true, expected a finite number"),
        ("[controller]\nuse_slope = 1", "a.toml:2:13: `controller.use_slope`: found 1, expected true or false"),
        ("title = 3", "a.toml:1:9: `title`: found 3, expected text"),
        ("plant = 3", "a.toml:1:9: `plant`: found 3, expected a table"),
        ("span_s = 2024-01-01", "a.toml:1:10: `span_s`: found the date 2024-01-01, expected a finite number above 0"),
        (
            "[plant.disturbance]\nchannel = 1",
            "a.toml:1:1: `plant.disturbance`: found a table, expected a list of at most 6 tables",
        ),
        (
            "[plant]\nkind = \"chian\"",
            "a.toml:2:8: `plant.kind`: found \"chian\", expected \"flexible_joint\", \"benchmark\", \"chain\" or \
             \"own\"; did you mean `chain`?",
        ),
        (
            "[controller]\nfallback = \"hld\"",
            "a.toml:2:12: `controller.fallback`: found \"hld\", expected \"hold\" or a finite number; did you mean \
             `hold`?",
        ),
    ]);
}

#[test]
fn a_number_out_of_its_range_is_told_with_the_range() {
    assert_errors(&[
        ("[controller]\nperiod_s = 0", "a.toml:2:12: `controller.period_s`: found 0, expected a finite number above 0"),
        ("[controller]\nk_l = -1", "a.toml:2:7: `controller.k_l`: found -1, expected a finite number at least 0"),
        ("[controller]\nk_l = nan", "a.toml:2:7: `controller.k_l`: found nan, expected a finite number at least 0"),
        ("[plant.error]\nb = inf", "a.toml:2:5: `plant.error.b`: found inf, expected a finite number"),
        ("[plant.error]\nb = -inf", "a.toml:2:5: `plant.error.b`: found -inf, expected a finite number"),
        (
            "[sensor]\ndropout = 1.5",
            "a.toml:2:11: `sensor.dropout`: found 1.5, expected a finite number at least 0 and at most 1",
        ),
        (
            "[sensor]\nnoise = [0, 0, -3, 0]",
            "a.toml:2:16: `sensor.noise[3]`: found -3, expected a finite number at least 0 and at most 1e300",
        ),
        ("seed = -1", "a.toml:1:8: `seed`: found -1, expected a whole number at least 0"),
        ("seed = 9223372036854775808", "a.toml:1:8: not TOML: integer number overflowed"),
    ]);
}

#[test]
fn a_key_of_another_kind_is_refused_and_not_ignored() {
    assert_errors(&[
        (
            "[plant]\norder = 3",
            "a.toml:2:9: `plant.order`: only for plant.kind = \"chain\", but plant.kind is \"flexible_joint\"",
        ),
        (
            "[plant]\nkind = \"benchmark\"\n[plant.parameters]\nkt = 1\n[controller]\nc = [5, 1]",
            "a.toml:3:1: `plant.parameters`: only for plant.kind = \"flexible_joint\", but plant.kind is \"benchmark\"",
        ),
        (
            "[controller]\nexp = \"micromath\"",
            "a.toml:2:7: `controller.exp`: only for plant.kind = \"benchmark\", but plant.kind is \"flexible_joint\"",
        ),
        (
            "[controller]\nk = 1",
            "a.toml:2:5: `controller.k`: only for controller.kind = \"baseline\", but controller.kind is \"proposed\"",
        ),
        (
            "[plant]\nkind = \"benchmark\"\n[controller]\nkind = \"baseline\"\nk_l = 1\nc = [5, 1]\nk = 1\n\
             [[controller.observer]]\nchannel = 1\nprinted = [10]",
            "a.toml:5:7: `controller.k_l`: only for controller.kind = \"proposed\", but controller.kind is \
             \"baseline\"",
        ),
        (
            "[controller]\nkind = \"baseline\"\nk = 1",
            "a.toml:2:8: `controller.kind`: the baseline controls plant.kind = \"benchmark\" only, but it is \
             \"flexible_joint\"",
        ),
        (
            "[plant]\nkind = \"benchmark\"\n[controller]\nc = [5, 1]\nprecision = \"f64\"\nexp = \"micromath\"",
            "a.toml:6:7: `controller.exp`: micromath computes in f32 only: take libm, or precision = \"f32\"",
        ),
    ]);
}

#[test]
fn a_list_of_the_wrong_length_is_told_with_the_right_one() {
    assert_errors(&[
        (
            "[plant]\nx0 = [1, 2, 3]",
            "a.toml:2:6: `plant.x0`: found a list of 3, expected 4 numbers, one per state of this plant",
        ),
        (
            "[controller]\nc = [5, 1]",
            "a.toml:2:5: `controller.c`: found a list of 2, expected 4 numbers, one per state of this plant",
        ),
        (
            "[sensor]\nquantum = [0, 0]",
            "a.toml:2:11: `sensor.quantum`: found a list of 2, expected 4 numbers, one per state of this plant",
        ),
        (
            "[controller]\nsamples = { jump = [1, 1, 1] }",
            "a.toml:2:20: `controller.samples.jump`: found a list of 3, expected 4 numbers, one per state of this \
             plant",
        ),
        (
            "[controller.samples]\nmin = [0, 0, 8, 0]\nmax = [0, 0, 7, 0]",
            "a.toml:1:1: `controller.samples`: x_3: no sample keeps these limits: min must not be above max, nor any \
             beyond 1e12, and the jump must be above 0 (given min 8, max 7, jump 2e12)",
        ),
        (
            "[controller]\ninitial_estimates = [0, 0, 0, 0, 0]",
            "a.toml:2:21: `controller.initial_estimates`: found a list of 5, expected 4 numbers, one per state of this \
             plant",
        ),
        (
            "[plant]\nkind = \"chain\"\norder = 3\na = [1, 2]\nb = 1\n[controller]\nc = [25, 10, 1]",
            "a.toml:4:5: `plant.a`: found a list of 2, expected 3 numbers, one per state of this plant",
        ),
        ("[sensor]\nnoise = [1]", "a.toml:2:9: `sensor.noise`: found a list of 1, expected a list of 2 to 6 numbers"),
        ("window_s = [1, 2, 3]", "a.toml:1:12: `window_s`: found a list of 3, expected a list of 2 numbers"),
        (
            "[[controller.observer]]\nchannel = 4\nprinted = [1, 2, 3, 4]",
            "a.toml:3:11: `controller.observer[1].printed`: found a list of 4, expected a list of 1 to 3 numbers",
        ),
    ]);
}

#[test]
fn what_is_missing_is_told_with_what_it_would_be() {
    assert_errors(&[
        (
            "[plant]\nkind = \"chain\"",
            "a.toml:1:1: `controller.c`: missing: the surface, as c (Eq. (44)) or surface_bandwidth_rad_s\n\
             a.toml:1:1: `plant.a`: missing: the coefficients a_1 .. a_n of the true a(x)\n\
             a.toml:1:1: `plant.b`: missing: the true input gain\n\
             a.toml:1:1: `plant.order`: missing: the order n of the chain, 2 to 6",
        ),
        (
            "[plant]\nkind = \"chain\"\norder = 2\na = [0, 0]\nb = 1",
            "a.toml:1:1: `controller.c`: missing: the surface, as c (Eq. (44)) or surface_bandwidth_rad_s",
        ),
        (
            "[[controller.observer]]\nprinted = [1, 2]",
            "a.toml:1:1: `controller.observer[1].channel`: missing: the channel, 1 to 4",
        ),
        (
            "[[controller.observer]]\nchannel = 4",
            "a.toml:1:1: `controller.observer[1]`: missing: give one of printed, poles, bandwidth_rad_s",
        ),
        (
            "[[controller.observer]]\nchannel = 4\nbandwidth_rad_s = 9",
            "a.toml:1:1: `controller.observer[1].order`: missing: the order r, 1 to 3, that goes with bandwidth_rad_s",
        ),
        (
            "[[plant.disturbance]]\nterms = [{ kind = \"const\", amplitude = 1 }]",
            "a.toml:1:1: `plant.disturbance[1].channel`: missing: the channel, 1 to 4",
        ),
        (
            "[[plant.disturbance]]\nchannel = 1",
            "a.toml:1:1: `plant.disturbance[1].terms`: missing: the terms of the disturbance",
        ),
        (
            "[[plant.disturbance]]\nchannel = 1\nterms = [{ amplitude = 1 }]",
            "a.toml:3:10: `plant.disturbance[1].terms[1].kind`: missing: const, ramp, sin, cos or step",
        ),
        (
            "[[plant.disturbance]]\nchannel = 1\nterms = [{ kind = \"sin\", amplitude = 1 }]",
            "a.toml:3:10: `plant.disturbance[1].terms[1].omega_rad_s`: missing: a \"sin\" term needs it",
        ),
        (
            "[plant]\nkind = \"benchmark\"\n[controller]\nkind = \"baseline\"\nc = [5, 1]\n\
             [[controller.observer]]\nchannel = 1\nprinted = [10]",
            "a.toml:3:1: `controller.k`: missing: the switching gain of the baseline",
        ),
    ]);
}

#[test]
fn a_contradiction_is_told_at_the_key_that_makes_it() {
    assert_errors(&[
        (
            "[[controller.observer]]\nchannel = 5\nprinted = [1, 2]",
            "a.toml:2:11: `controller.observer[1].channel`: found 5, expected a channel of this plant, 1 to 4",
        ),
        (
            "[[controller.observer]]\nchannel = 4\nprinted = [1]\n[[controller.observer]]\nchannel = 4\nprinted = [1]",
            "a.toml:5:11: `controller.observer[2].channel`: channel 4 has an observer already",
        ),
        (
            "[[controller.observer]]\nchannel = 4\nprinted = [1]\npoles = [[-1, 0]]",
            "a.toml:1:1: `controller.observer[1]`: found several of printed, poles, bandwidth_rad_s: give exactly one",
        ),
        (
            "[[controller.observer]]\nchannel = 4\nprinted = [20, 100]\norder = 2",
            "a.toml:4:9: `controller.observer[1].order`: only with bandwidth_rad_s: the length of the list is the \
             order",
        ),
        (
            "[controller]\nc = [125, 75, 15, 1]\nsurface_bandwidth_rad_s = 5",
            "a.toml:2:5: `controller.c`: found together with surface_bandwidth_rad_s: give one of them",
        ),
        (
            "[[plant.disturbance]]\nchannel = 2\nterms = [{ kind = \"ramp\", amplitude = 1 }]",
            "a.toml:3:39: `plant.disturbance[1].terms[1].amplitude`: a \"ramp\" term has no such key; it has slope",
        ),
        (
            "[[plant.disturbance]]\nchannel = 2\nterms = [{ kind = \"const\", amplitude = 1 }]\n\
             [[plant.disturbance]]\nchannel = 2\nterms = [{ kind = \"const\", amplitude = 1 }]",
            "a.toml:5:11: `plant.disturbance[2].channel`: channel 2 has a disturbance already: put all its terms into \
             one table",
        ),
        (
            "[actuator]\nmin = 1\nmax = 0",
            "a.toml:2:7: `actuator.min`: found 1 above actuator.max = 0: the limits are reversed",
        ),
        (
            "[controller]\nfallback = 400.0\nlimits = { min = -300, max = 300 }",
            "a.toml:2:12: `controller.fallback`: found 400, expected a u within the limits [-300, 300]",
        ),
        (
            "plant.reading = \"physical\"\n[plant.parameters]\nj11 = 1e-320",
            "a.toml:2:1: `plant.parameters`: a coefficient of the joint overflows: check the units",
        ),
        (
            "name = \"../x\"",
            "a.toml:1:8: `name`: found \"../x\", expected 1 to 64 letters, digits, `_`, `-` or `.`, not beginning \
             with `.`",
        ),
    ]);
}

#[test]
fn poles_that_are_no_conjugate_pairs_are_refused() {
    let message = |poles: &str| error(&format!("[[controller.observer]]\nchannel = 4\npoles = {poles}"), &[]);
    let unpaired = "a.toml:3:9: `controller.observer[1].poles`: the gains are not finite: complex poles must come in \
                    conjugate pairs";
    for poles in ["[[-1, 2]]", "[[-1, 2], [-1, 2]]", "[[-1, 2], [-1, 0]]", "[[-1, 2], [-2, -2], [-3, 0]]"] {
        assert_eq!(message(poles), unpaired, "{poles}");
    }
    for poles in ["[[-1, 2], [-1, -2]]", "[[-1, 2], [-3, 0], [-1, -2]]", "[[-1, 0]]"] {
        assert!(message(poles).starts_with("no error"), "{poles}: {}", message(poles));
    }
    assert_eq!(
        message("[[-1, 2, 3], [-1, -2]]"),
        "a.toml:3:10: `controller.observer[1].poles[1]`: found a list of 3, expected a list of 2 numbers"
    );
    assert_eq!(
        error("[[controller.observer]]\nchannel = 4\nbandwidth_rad_s = 1e200\norder = 3", &[]),
        "a.toml:3:19: `controller.observer[1].bandwidth_rad_s`: the gains are not finite: too fast"
    );
}

#[test]
fn what_the_design_refuses_is_told_at_the_key_of_the_file() {
    assert_errors(&[
        (
            "[controller]\nc = [1, 2, 3, 2]",
            "a.toml:2:5: `controller.c`: the last surface coefficient must be c_n = 1 (Eq. (44)): divide all c by it \
             (given 2)",
        ),
        (
            "[controller]\nc = [1, -2, 3, 1]",
            "a.toml:2:5: `controller.c`: the surface polynomial p^(n-1) + c_{n-1} p^(n-2) + .. + c_1 is not Hurwitz \
             (Eq. (44)): the sliding motion would diverge; try surface_bandwidth_rad_s",
        ),
        (
            "[controller]\nalpha_per_s = 0",
            "a.toml:2:15: `controller.alpha_per_s`: alpha must be above 0 1/s (Eq. (17)): the offset of sigma* would \
             never decay (given 0 1/s)",
        ),
        (
            "[controller]\nk_s = 1e-322\nepsilon = 0",
            "a.toml:3:11: `controller.epsilon`: with k_s > 0 the boundary layer epsilon must not be below 0, nor 0 \
             where k_s times period is 0 (Eq. (51)) (given 0)",
        ),
        (
            "[controller]\nlimits = { min = 1, max = -1 }",
            "a.toml:2:10: `controller.limits`: the limits are reversed: min must not be above max (given min 1, max \
             -1)",
        ),
        (
            "[controller]\nlimits = { min = -2e12 }",
            "a.toml:2:10: `controller.limits`: a limit of u is beyond 1e12: where the actuator has none leave the \
             limit out (given -2e12)",
        ),
        (
            "plant.reading = \"physical\"\n[plant.parameters]\nkt = 1e-46",
            "a.toml:1:1: `controller`: a designed coefficient overflows or vanishes in this precision: check the units \
             of the period, the gains and b",
        ),
        (
            "plant.reading = \"physical\"\n[plant.parameters]\nkt = 1e-323\nj11 = 1e3",
            "a.toml:2:1: `plant.parameters`: the nominal input gain b is 0 (Eq. (39)): the law divides by it; give \
             b(x)'s nominal value",
        ),
    ]);
    assert_eq!(
        error(&SMALL_CHAIN.replace("b = 2.0", "b = 0"), &[]),
        "a.toml:6:5: `plant.b`: found 0, expected an input gain other than 0: the law divides by it (Eq. (51))"
    );
    assert_eq!(
        error(SMALL_CHAIN, &["controller.nominal.b=0"]),
        "--set controller.nominal.b=0: `controller.nominal.b`: found 0, expected an input gain other than 0: the law \
         divides by it (Eq. (51))"
    );
}

#[test]
fn what_the_design_refuses_of_an_observer_is_told_at_the_line_of_that_observer() {
    // A valid observer first, so that the line of the second is found.
    let second = |channel: u8, gains: &str| {
        let good = "[[controller.observer]]\nchannel = 3\nprinted = [20, 100]\n";
        error(&format!("{good}[[controller.observer]]\nchannel = {channel}\n{gains}"), &[])
    };
    assert_eq!(
        second(1, "printed = [20, 100]"),
        "a.toml:4:1: `controller.observer[2]`: channel 1: needs observer order 3, has 2: the observer order is below \
         n - i, so that sigma needs a derivative it does not estimate (Eq. (44)): raise the order, or observe no \
         disturbance there"
    );
    assert_eq!(
        second(4, "printed = [-1, 2]"),
        "a.toml:4:1: `controller.observer[2]`: channel 4: the observer gains are not Hurwitz (Eq. (53); order 3 needs \
         l1 l2 > l3): give bandwidth_rad_s or poles instead"
    );
    assert_eq!(
        second(4, "bandwidth_rad_s = 1e5\norder = 1"),
        "a.toml:4:1: `controller.observer[2]`: channel 4: the fastest observer pole is too fast for the period (Eq. \
         (53)): slow the observer, shorten the period, or raise observer_pole_limit (fastest pole 100000.0000 rad/s, \
         allowed 1000.0000 rad/s)"
    );
}

/// A file without a plant is an error: it would run the paper's joint with its disturbance.
#[test]
fn a_file_of_one_s_own_says_what_is_controlled() {
    let own = |text: &str| parse_own(&Source { file: "a.toml", text, sets: &[] }, "a").map(|it| it.name);
    for text in ["", "name = \"mine\"", "span_s = 3.0\n[controller]\nk_l = 20.0"] {
        let told = own(text).expect_err("no plant").to_string();
        assert!(told.starts_with("a.toml: no plant is given") && told.contains("host-sim new"), "{told}");
    }
    for text in ["[plant]", DEFAULT, MOTOR, JOINT, CHAIN] {
        assert!(own(text).is_ok(), "{text}");
    }
}

/// A step after the end of the run gives a warning.
#[test]
fn a_step_that_never_comes_is_warned_of() {
    let warnings = |t0_s: &str| {
        let sets = [format!("plant.input_disturbance=[{{kind = \"step\", amplitude = 1.0, t0_s = {t0_s}}}]")];
        let source = Source { file: "a.toml", text: "", sets: &sets };
        parse(&source, "a").unwrap_or_else(|error| panic!("{error}")).warnings
    };
    assert_eq!(warnings("19.9"), warnings("0.0"));
    let late = warnings("20.0");
    assert!(late.iter().any(|line| line.contains("input_disturbance[1].t0_s = 20 is not before the end")), "{late:?}");
}

#[test]
fn all_mistakes_of_a_file_are_told_at_once_each_at_its_place() {
    assert_errors(&[
        (
            "spam_s = 1\n[plant]\nkind = \"chian\"\nx0 = [1, true]\n[controller]\nk_l = -1\nperiod = 1",
            "a.toml:1:1: unknown key `spam_s`; did you mean `span_s`?\n\
             a.toml:3:8: `plant.kind`: found \"chian\", expected \"flexible_joint\", \"benchmark\", \"chain\" or \
             \"own\"; did you mean `chain`?\n\
             a.toml:4:10: `plant.x0[2]`: found true, expected a finite number\n\
             a.toml:6:7: `controller.k_l`: found -1, expected a finite number at least 0\n\
             a.toml:7:1: unknown key `controller.period`; did you mean `period_s`?",
        ),
        // A chain with typical first errors.
        (
            "window_s = [2, 1]\n[plant]\nkind = \"chain\"\nreading = \"stiff\"\norder = 3\na = [1, 2]\nx0 = [1, 2]\n\
             [[plant.disturbance]]\nterms = [{ kind = \"sin\" }, { kind = \"ramp\" }]\n\
             [[controller.observer]]\nchannel = 4\nprinted = [1]\n[[controller.observer]]\nchannel = 2\n\
             [actuator]\nmin = 1\nmax = 0",
            "a.toml:1:12: `window_s`: found [2, 1], expected [from, to] with from before to\n\
             a.toml:2:1: `plant.b`: missing: the true input gain\n\
             a.toml:4:11: `plant.reading`: only for plant.kind = \"flexible_joint\", but plant.kind is \"chain\"\n\
             a.toml:6:5: `plant.a`: found a list of 2, expected 3 numbers, one per state of this plant\n\
             a.toml:7:6: `plant.x0`: found a list of 2, expected 3 numbers, one per state of this plant\n\
             a.toml:8:1: `plant.disturbance[1].channel`: missing: the channel, 1 to 3\n\
             a.toml:9:10: `plant.disturbance[1].terms[1].amplitude`: missing: a \"sin\" term needs it\n\
             a.toml:9:28: `plant.disturbance[1].terms[2].slope`: missing: a \"ramp\" term needs it\n\
             a.toml:10:3: `controller.c`: missing: the surface, as c (Eq. (44)) or surface_bandwidth_rad_s\n\
             a.toml:11:11: `controller.observer[1].channel`: found 4, expected a channel of this plant, 1 to 3\n\
             a.toml:13:1: `controller.observer[2]`: missing: give one of printed, poles, bandwidth_rad_s\n\
             a.toml:16:7: `actuator.min`: found 1 above actuator.max = 0: the limits are reversed",
        ),
    ]);
    assert_eq!(error("", &["x", "seed=1", "y"]).lines().count(), 2);
    // The number of reported errors is limited.
    let many = (0..10_000).map(|k| format!("a{k} = 1")).collect::<Vec<_>>().join("\n");
    assert_eq!(error(&many, &[]).lines().count(), 20);
}

#[test]
fn who_sets_another_kind_is_told_of_the_argument_and_not_of_lines_of_the_file() {
    assert_eq!(
        error(DEFAULT, &["plant.kind=chain", "plant.order=4", "plant.b=1"]),
        "--set plant.kind=chain: `plant.a`: missing: the coefficients a_1 .. a_n of the true a(x)\n\
         --set plant.kind=chain: `plant.kind`: found \"chain\", but the file sets `plant.reading`, \
         `plant.parameters`, `plant.error`, `plant.input_disturbance`, only for \"flexible_joint\": start from a file \
         without these keys"
    );
    let told = error(DEFAULT, &["controller.kind=baseline"]);
    assert!(told.lines().all(|line| line.starts_with("--set controller.kind=baseline: `controller.k")), "{told}");
    assert!(told.contains("found \"baseline\", but the file sets `controller.precision`, `controller.alpha_per_s`"));
    assert!(told.contains("`controller.k`: missing: the switching gain of the baseline"), "{told}");
}

#[test]
fn a_parameter_that_the_reading_does_not_use_is_refused() {
    for reading in ["reconstructed", "physical"] {
        assert_eq!(
            error("", &["plant.parameters.b11=100", &format!("plant.reading={reading}")]),
            format!(
                "--set plant.parameters.b11=100: `plant.parameters.b11`: the reading {reading:?} does not use it: \
                 leave it out"
            )
        );
    }
    let all = ["kt=0.1", "j11=9e-4", "j12=0.2", "b12=0.1", "ks=8"].map(|set| format!("plant.parameters.{set}"));
    let all: Vec<&str> = all.iter().map(String::as_str).chain(["plant.reading=physical"]).collect();
    assert!(build("", &all).is_ok());
}

#[test]
fn a_reading_of_the_figures_goes_with_table_1_alone_and_names_what_any_joint_has() {
    for reading in ["reconstructed", "literal", "stiff"] {
        let set = format!("plant.reading={reading}");
        for (name, table) in [("kt", 0.119), ("j11", 931e-6), ("j12", 0.23), ("b12", 0.07), ("ks", 9.0)] {
            let with = |value: f64| format!("plant.parameters.{name}={value}");
            assert!(build("", &[&set, &with(table)]).is_ok(), "{name}");
            let told = error("", &[&set, &with(1.5 * table)]);
            for part in [
                &format!("`plant.parameters.{name}`: found "),
                "the paper's figures",
                "set plant.reading = \"physical\"",
                "`host-sim new NAME --plant joint`",
            ] {
                assert!(told.contains(part), "{told}");
            }
            assert!(build("", &["plant.reading=physical", &with(1.5 * table)]).is_ok(), "{name}");
        }
    }
    assert!(error("", &["plant.reading=stiff", "plant.parameters.b11=4"]).contains("with the 4.5 of Table I"));
}

#[test]
fn the_disturbance_of_the_paper_comes_with_the_paper_s_readings_alone() {
    let peak = |sets: &[&str]| {
        let still = ["span_s=1", "plant.x0=[0, 0, 0, 0]"];
        ran("", &[&still[..], sets].concat()).rows.iter().fold(0.0_f64, |most, row| most.max(row.d[3].abs()))
    };
    assert_eq!(peak(&["plant.reading=physical"]), 0.0);
    assert!(peak(&["plant.reading=stiff"]) > 100.0 && peak(&[]) > 100.0);
}

#[test]
fn a_wrong_set_is_told_with_the_argument() {
    let cases = [
        ("controller.kl=1", "unknown key `controller.kl`; did you mean `k_l`?"),
        ("controller.k_l", "expected KEY=VALUE without blanks, as in span_s=2"),
        ("controller.k_l=", "\"\" is not a TOML value (a number, true, \"text\", a [list] or a {table})"),
        ("controller.k_l=[1", "\"[1\" is not a TOML value (a number, true, \"text\", a [list] or a {table})"),
        ("=1", "`` is not a key path; expected one like controller.observer[1].printed"),
        ("controller.k_l=abc", "`controller.k_l`: found \"abc\", expected a finite number at least 0"),
        ("controller.limits={ min = -1, mox = 1 }", "unknown key `controller.limits.mox`; did you mean `max`?"),
        ("plant.x0=[0, 0, 0, true]", "`plant.x0[4]`: found true, expected a finite number"),
        ("controller=1", "`controller`: found 1, expected a table"),
        (
            "controller.observer[0].channel=1",
            "`controller.observer[0].channel` is not a key path; expected one like controller.observer[1].printed",
        ),
        ("controller.observer[4].channel=1", "there is no position 4 in a list of 2 (positions count from 1)"),
        ("controller.observer.channel=1", "`channel` cannot be set: a list of 2 is not a table"),
        (
            "sensor.noise[1]=1e-4",
            "`sensor.noise`: found a list of 1, expected a list of 2 to 6 numbers: set it with all its numbers first, \
             as in --set 'sensor.noise=[0, 0]'",
        ),
        ("sensor.nose[1]=1e-4", "unknown key `sensor.nose`; did you mean `noise`?"),
        (
            "sensor.noise[3]=1e-4",
            "there is no list `sensor.noise` with such a position: set it with all its numbers first, as in --set \
             'sensor.noise=[0, 0]'",
        ),
        ("window_s=[2, 1]", "`window_s`: found [2, 1], expected [from, to] with from before to"),
    ];
    for (argument, expected) in cases {
        assert_eq!(error(DEFAULT, &[argument]), format!("--set {argument}: {expected}"));
    }
    // The wrong argument of several is reported.
    assert_eq!(
        error(DEFAULT, &["seed=1", "seed=-1"]),
        "--set seed=-1: `seed`: found -1, expected a whole number at least 0"
    );
}

#[test]
fn set_overrides_the_file_and_the_last_one_wins() {
    let experiment = build(DEFAULT, &["span_s=3", "window_s=[1, 2]", "span_s=4"]).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((experiment.span_s, experiment.window_s), (4.0, [1.0, 2.0]));
}

#[test]
fn a_syntax_error_is_told_at_its_place() {
    assert_errors(&[
        ("a = = 1", "a.toml:1:5: not TOML: extra `=`, expected nothing"),
        (
            "a = 1,2e-5",
            "a.toml:1:6: not TOML: unexpected key or value, expected newline, `#`; a number has a decimal point, not a \
             comma",
        ),
        ("title = \"x\"\na = [1,\n2\n", "a.toml:3:2: not TOML: unclosed array, expected `]`"),
    ]);
}

#[test]
fn a_message_is_one_line_whatever_is_in_the_file() {
    assert_eq!(error("\"a\\nb\\u001b\" = 1", &[]).split(';').next(), Some("a.toml:1:1: unknown key `a\\nb\\u{1b}`"));
    assert_eq!(error("", &["x\n"]), "--set x\\n: expected KEY=VALUE without blanks, as in span_s=2");
}

#[test]
fn the_span_holds_at_least_one_tick_and_at_most_two_million() {
    assert_errors(&[
        ("span_s = 1e-9", "a.toml:1:10: `span_s`: found 1e-9 s, shorter than one period of 0.001 s"),
        (
            "span_s = 1e300",
            "a.toml:1:10: `span_s`: found 1e300 s, that is 1e303 ticks of 0.001 s; expected at most 2000000 ticks",
        ),
        (
            "[controller]\nperiod_s = 1e-9",
            "a.toml:1:1: `span_s`: found 20 s, that is 20000000000 ticks of 1e-9 s; expected at most 2000000 ticks",
        ),
    ]);
    assert!(build("span_s = 2000.0", &[]).is_ok());
    assert!(build("span_s = 0.001\nwindow_s = [0, 0.001]", &[]).is_ok());
}

#[test]
fn the_window_lies_in_the_span_and_runs_forward() {
    assert_errors(&[
        ("window_s = [3, 2]", "a.toml:1:12: `window_s`: found [3, 2], expected [from, to] with from before to"),
        ("window_s = [3, 3]", "a.toml:1:12: `window_s`: found [3, 3], expected [from, to] with from before to"),
        ("window_s = [3, 21]", "a.toml:1:12: `window_s`: found [3, 21], expected a part of the span [0, 20]"),
        ("window_s = [-1, 2]", "a.toml:1:12: `window_s`: found [-1, 2], expected a part of the span [0, 20]"),
        ("window_s = [3, 3.0001]", "a.toml:1:12: `window_s`: found [3, 3.0001], shorter than one period of 0.001 s"),
    ]);
}

#[test]
fn a_file_that_cannot_be_a_scenario_is_told_by_name() {
    let folder = std::env::temp_dir().join(format!("host-sim-scenario-files-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("temporary folder");
    let told = |path: &std::path::Path| match load(path, &[]) {
        Ok(_) => "no error".to_owned(),
        Err(error) => error.to_string().replace(&path.display().to_string(), "F"),
    };
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, bytes).expect("temporary file");
        path
    };
    assert_eq!(told(&folder.join("none.toml")), "F: there is no such file");
    assert_eq!(told(&folder), "F: this is a directory, expected a regular file");
    assert_eq!(told(&write("latin1.toml", b"title = \"\xe9\"")), "F: not UTF-8 text (byte 10)");
    assert_eq!(told(&write("huge.toml", &vec![b'#'; (1 << 20) + 1])), "F: longer than 1 MiB: not a settings file");
    let large = [b"[plant]\n", &vec![b'#'; (1 << 20) - 8][..]].concat();
    assert_eq!(told(&write("large.toml", &large)), "no error");
    // Without the key `name` the file name is used, with invalid characters replaced.
    let named = load(&write("k l=50.toml", b"[plant]"), &[]).map(|experiment| experiment.name);
    assert_eq!(named, Ok("k_l_50".into()));
    std::fs::remove_dir_all(folder).expect("temporary folder");
}

#[test]
fn an_empty_file_is_the_default_scenario() {
    let read = |text: &str| {
        let tree =
            document::read(&Source { file: "a.toml", text, sets: &[] }).unwrap_or_else(|error| panic!("{error}"));
        let scenario: Scenario = serde_json::from_value(tree.json()).expect("a scenario");
        resolve::resolve(scenario, "default", resolve::Problems::default())
            .unwrap_or_else(|problem| panic!("{problem:?}"))
    };
    let (live, empty) = (read(DEFAULT), read(""));
    // All resolved values except title and file.
    let meaning = |it: &resolve::Resolved| {
        let resolve::Resolved { name, span_s, periods, window_s, x0, plant, disturbance, controller, .. } = it;
        format!("{name} {span_s} {periods} {window_s:?} {x0:?} {plant:?} {disturbance:?} {controller:?}")
    };
    assert_eq!(meaning(&live), meaning(&empty));
    let rest = |file: &Scenario| (file.settling_band, file.seed, file.sensor.clone(), file.actuator.clone());
    assert_eq!(rest(&live.file), rest(&empty.file));
    assert_eq!(live.file.plant.error, empty.file.plant.error);
    // Both give the same run.
    assert_eq!(bits(&ran(DEFAULT, &["span_s=0.1", "window_s=[0, 0.1]"])), bits(&ran("span_s = 0.1", &[])));
}

#[test]
fn every_shipped_scenario_loads() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("the folder of scenarios") {
        let path = entry.expect("an entry").path();
        let experiment = load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
        assert!(experiment.warnings.is_empty(), "{}: {:?}", path.display(), experiment.warnings);
        count += 1;
    }
    assert!(count >= 2, "{count} scenarios");
}

/// Returns `text` with every commented key active.
fn uncommented(text: &str) -> String {
    let is_key = |line: &str| {
        let name = line.split(" = ").next().unwrap_or_default();
        name.len() < line.len() && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
    };
    let live = text.lines().map(|line| match line.strip_prefix("# ") {
        Some(code) if is_key(code) || code.starts_with('[') || code.starts_with("    {") || code == "]" => code,
        _ => line,
    });
    live.collect::<Vec<_>>().join("\n")
}

fn keys_of(node: &document::Node, prefix: &str, keys: &mut BTreeSet<String>) {
    match &node.value {
        document::NodeValue::Table(entries) => {
            for entry in entries {
                let key = if prefix.is_empty() { entry.key.clone() } else { format!("{prefix}.{}", entry.key) };
                keys_of(&entry.node, &key, keys);
                keys.insert(key);
            }
        }
        document::NodeValue::List(list) => list.iter().for_each(|child| keys_of(child, prefix, keys)),
        _ => {}
    }
}

#[test]
fn every_key_of_a_schema_stands_in_its_file_to_start_from_and_no_other() {
    // Terms of the input disturbance and keys of the second encoder are shown elsewhere in the file.
    let elsewhere: [(&str, &str, &[&str]); 3] = [
        // The user chooses the names of constants.
        ("paper", DEFAULT, &["plant.input_disturbance.", "plant.constants.", "controller.nominal.constants."]),
        ("motor", MOTOR, &["fault.encoder", "monitor.motor_n_m"]),
        (
            "joint",
            JOINT,
            &[
                "encoder.link.behind_gear",
                "encoder.motor.counts_per_turn",
                "encoder.motor.states",
                "encoder.motor.reversed",
                "encoder.motor.offset_counts",
                "encoder.motor.noise_rad",
                "encoder.motor.eccentricity_rad",
            ],
        ),
    ];
    for (plant, text, elsewhere) in elsewhere {
        let text = uncommented(text);
        let tree = document::read(&Source { file: "a.toml", text: &text, sets: &[] }).unwrap_or_else(|e| panic!("{e}"));
        let faults = check::check(schema(plant), &tree);
        assert!(faults.is_empty(), "{faults:?}");
        let mut shown = BTreeSet::new();
        keys_of(&tree, "", &mut shown);
        let known: BTreeSet<String> = check::all_keys(schema(plant)).into_iter().collect();
        let own = |keys: &BTreeSet<String>| -> Vec<String> {
            keys.iter().filter(|key| !elsewhere.iter().any(|other| key.starts_with(other))).cloned().collect()
        };
        assert_eq!(own(&shown), own(&known), "{plant}");
        assert!(known.len() > 60, "{plant}: {}", known.len());
    }
}

/// The check of arguments alone finds the faults of the full check, for every key set to many values.
#[test]
fn what_arguments_changed_is_checked_as_if_it_stood_there() {
    const VALUES: [&str; 12] =
        ["-1", "0", "7", "2.5", "1e200", "true", "word", "\"x\"", "[1, 2]", "[[0, 0]]", "{ a = 1 }", "[{ kind = 1 }]"];
    let (mut tried, mut faulty) = (0, 0);
    for (plant, text) in STARTS {
        let schema = schema(plant);
        for key in check::all_keys(schema) {
            for key in [key.clone(), format!("{key}[1]"), format!("{key}.more")] {
                for value in VALUES {
                    let sets = [String::from("name=\"a\""), format!("{key}={value}")];
                    let Ok(tree) = document::read(&Source { file: "a.toml", text, sets: &sets }) else { continue };
                    let [all, set] = [check::check, check::check_set].map(|check| {
                        let faults = check(schema, &tree).into_iter();
                        faults.map(|fault| (fault.path.to_string(), fault.message)).collect::<Vec<_>>()
                    });
                    assert_eq!(all, set, "{plant}: {key}={value}");
                    tried += 1;
                    faulty += usize::from(!all.is_empty());
                }
            }
        }
    }
    assert!(faulty > 5000 && tried - faulty > 500, "{faulty} of {tried}");
}

#[test]
fn the_schema_uses_only_the_words_that_the_check_understands() {
    // Supported by `check`, or without effect on validity.
    const WORDS: [&str; 20] = [
        "$defs",
        "$ref",
        "$schema",
        "additionalProperties",
        "anyOf",
        "const",
        "default",
        "description",
        "enum",
        "exclusiveMinimum",
        "format",
        "items",
        "maxItems",
        "maximum",
        "minItems",
        "minimum",
        "oneOf",
        "properties",
        "title",
        "type",
    ];
    fn walk(part: &serde_json::Value) {
        let Some(words) = part.as_object() else { return };
        for (word, inner) in words {
            assert!(WORDS.contains(&word.as_str()), "{word}: {inner}");
            match word.as_str() {
                "additionalProperties" => assert!(inner == false || inner["type"] == "number", "{inner}"),
                "$defs" | "properties" => inner.as_object().into_iter().flatten().for_each(|(_, part)| walk(part)),
                "anyOf" | "oneOf" => inner.as_array().into_iter().flatten().for_each(walk),
                "items" => walk(inner),
                _ => {}
            }
        }
    }
    for (plant, _) in STARTS {
        walk(schema(plant));
    }
}

#[test]
fn the_template_runs_under_its_own_name_and_odd_names_are_none() {
    for (plant, order) in [("paper", 4), ("chain", 3), ("own", 2), ("motor", 3), ("joint", 5)] {
        let text = template("my_plant-2.0", plant).expect("a name");
        let experiment = build(&text, &[]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((experiment.name.as_str(), experiment.plant.order()), ("my_plant-2.0", order));
    }
    assert_eq!(template("mine", "pendulum"), None);
    let long = "x".repeat(65);
    for odd in ["", ".", "..", ".hidden", "a/b", "a\\b", "../a", "a b", "a\"b", "ä", "a\n", long.as_str()] {
        assert_eq!(template(odd, "chain"), None, "{odd:?}");
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_seed_other_noise() {
    let sets = ["span_s=0.2", "window_s=[0, 0.2]", "sensor.noise=[1e-3, 0, 0, 0]", "sensor.dropout=0.1"];
    let with_seed = |seed: &'static str| bits(&ran(DEFAULT, &[&sets[..], &[seed]].concat()));
    assert_eq!(with_seed("seed=7"), with_seed("seed=7"));
    assert_ne!(with_seed("seed=7"), with_seed("seed=8"));
    // Without noise a seed has no effect.
    assert_eq!(bits(&ran(DEFAULT, &["span_s=0.2", "window_s=[0, 0.2]", "seed=8"])), bits(&ran("span_s = 0.2", &[])));
}

#[test]
fn the_bounds_of_a_chain_are_those_of_its_signals_up_to_the_order_of_the_observer() {
    // d = 0.05 t + 0.3 sin 2t over [0, 10] s, observer of order 2: |d| <= 0.5 + 0.3, |d'| <= 0.05 + 0.6, |d''| <= 1.2.
    let text = SMALL_CHAIN.replace("span_s = 0.1", "span_s = 10")
        + "[[controller.observer]]\nchannel = 2\nbandwidth_rad_s = 30\norder = 2\n\
           [[plant.disturbance]]\nchannel = 2\n\
           terms = [{ kind = \"ramp\", slope = 0.05 }, { kind = \"sin\", amplitude = 0.3, omega_rad_s = 2 }]\n";
    let experiment = build(&text, &[]).unwrap_or_else(|error| panic!("{error}"));
    let mu = &experiment.mu[1];
    assert_eq!((mu.channel, mu.mu), (2, 1.2));
    // Sums of three roundings of numbers about 1.
    for (bound, expected) in mu.by_order.iter().zip([0.8, 0.65, 1.2]) {
        assert!((bound - expected).abs() < 1e-15, "{:?}", mu.by_order);
    }
    assert_eq!(mu.by_order.len(), 3);
    assert_eq!(experiment.mu[0].mu, 0.0);
}

#[test]
fn links_of_the_chains_stand_in_the_loop_in_the_order_they_are_written_of() {
    let short = |sets: &[&str]| ran("span_s = 0.5", sets);
    let held = |trace: &Trace| -> Vec<f64> { trace.rows.iter().map(|row| row.u_held).collect() };

    let limited = held(&short(&["actuator.min=-50", "actuator.max=40"]));
    assert!(limited.contains(&-50.0) || limited.contains(&40.0), "never at a limit: {limited:?}");
    assert!(limited.iter().all(|u| (-50.0..=40.0).contains(u)));

    let rated = held(&short(&["actuator.rate_per_s=500"]));
    // 500 per s is 0.5 per tick of 1 ms; rounding of differences of numbers below 300.
    assert!(rated.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= 0.5 + 1e-12));

    let every_fifth = held(&short(&["actuator.hold_ticks=5"]));
    assert!(every_fifth.chunks(5).all(|chunk| chunk.iter().all(|u| *u == chunk[0])));
    assert_ne!(every_fifth[0], every_fifth[5]);

    let late = short(&["actuator.delay_ticks=3"]);
    assert!((3..late.rows.len()).all(|k| late.rows[k].u_held == late.rows[k - 3].u));

    // Without a report the controller uses its demand: other bits from the third tick on.
    let untold = short(&["actuator.delay_ticks=3", "actuator.report=false"]);
    assert_ne!(held(&untold), held(&late));

    let lost = short(&["sensor.dropout=0.5"]);
    let rejected = lost.rows.iter().filter(|row| row.health.contains(controller_core::Health::INPUT_REJECTED)).count();
    // 501 draws of probability a half: four standard deviations are 45.
    assert!((205..=295).contains(&rejected), "{rejected}");
    assert!(
        lost.rows.windows(2).all(|pair| {
            !pair[1].health.contains(controller_core::Health::INPUT_REJECTED) || pair[1].u == pair[0].u
        })
    );
}

/// Every sample with x_1 above 0.05 rad is rejected. So the start is rejected, and the joint stays there without a
/// drive.
#[test]
fn a_sample_beyond_the_limits_of_the_controller_is_lost() {
    for precision in ["f32", "f64"] {
        let precision = format!("controller.precision={precision}");
        let lost = |max: &str| {
            let sets = [
                "span_s=0.1",
                "window_s=[0, 0.1]",
                &precision,
                &format!("controller.samples.max=[{max}, 9, 9e3, 9e5]"),
            ];
            let run = ran("", &sets);
            run.rows.iter().filter(|row| row.health.contains(controller_core::Health::INPUT_REJECTED)).count()
        };
        assert_eq!((lost("0.05"), lost("0.2")), (101, 0), "{precision}");
    }
}

#[test]
fn initial_estimates_are_what_the_first_tick_lives_on() {
    let told = ran("span_s = 0.01", &["controller.initial_estimates=[0, -4, 0, 128]"]);
    assert_eq!(told.rows[0].d_hat, [0.0, -4.0, 0.0, 128.0, 0.0, 0.0]);
    assert_eq!(ran("span_s = 0.01", &[]).rows[0].d_hat, [0.0; loop_sim::MAX_ORDER]);
}

/// Values that are likely to cause errors.
const NASTY: [&str; 24] = [
    "nan",
    "inf",
    "-inf",
    "0",
    "-0.0",
    "-1",
    "1",
    "2",
    "7",
    "1e300",
    "-1e300",
    "1e-320",
    "9223372036854775807",
    "1e5",
    "\"\"",
    "\"chain\"",
    "\"benchmark\"",
    "true",
    "[]",
    "[[]]",
    "{}",
    "[1.0, 1.0]",
    "[-1.0, 2.0, 1e9, 0.5]",
    "1979-05-27",
];

/// Damage to a text: kind, place and content as numbers.
type Damage = (u8, usize, usize);

fn damaged(text: &str, damages: &[Damage]) -> String {
    let mut lines: Vec<String> =
        text.lines().filter(|line| !line.trim_start().starts_with('#')).map(Into::into).collect();
    for &(kind, at, with) in damages {
        let count = lines.len().max(1);
        let Some(line) = lines.get_mut(at % count) else { break };
        match kind % 6 {
            0 => {
                lines.remove(at % count);
            }
            1 => {
                let twice = line.clone();
                lines.insert(with % count, twice);
            }
            // Replaces the value and keeps the key.
            2 | 3 => {
                if let Some((key, _)) = line.split_once('=') {
                    *line = format!("{key}= {}", NASTY[with % NASTY.len()]);
                }
            }
            4 => {
                let mut letters: Vec<char> = line.chars().collect();
                let strange = ['\u{0}', '"', '[', '}', '=', 'σ', '9', '-', '.', '\''];
                letters.insert(with % (letters.len() + 1), strange[at % strange.len()]);
                *line = letters.into_iter().collect();
            }
            _ => lines.truncate(at % count + 1),
        }
    }
    lines.join("\n")
}

/// Reads a text and runs it if valid. Returns `Ok(true)` after a run, `Ok(false)` for an error with a place, and `Err`
/// for an error without a place.
fn survives(text: &str, sets: &[String]) -> Result<bool, String> {
    let mut experiment = match parse(&Source { file: "a.toml", text, sets }, "a") {
        Ok(experiment) => experiment,
        Err(error) => {
            let message = error.to_string();
            let has_place = |line: &str| {
                let number =
                    line.strip_prefix("a.toml:").and_then(|rest| rest.split(':').next()?.parse::<usize>().ok());
                number.is_some() || sets.iter().any(|set| line.starts_with(&format!("--set {set}: ")))
            };
            let is_good = |line: &str| has_place(line) && line.len() < 800;
            return if message.lines().all(is_good) { Ok(false) } else { Err(message) };
        }
    };
    // Ten ticks are enough and fast.
    let mut ticks = 0;
    let (trace, _) = experiment.run(&mut |_| {
        ticks += 1;
        if ticks < 10 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    experiment.metrics(&trace);
    bits(&trace);
    Ok(true)
}

/// Returns every key with a position in every list, as for `--set`.
fn settable_keys(plant: &str) -> Vec<String> {
    let positioned = |key: String| {
        ["observer.", "disturbance.", "terms.", "load.", "fault."].iter().fold(key, |key, list| {
            let one = format!("{}[1].", list.trim_end_matches('.'));
            key.replace(list, &one)
        })
    };
    check::all_keys(schema(plant)).into_iter().map(positioned).collect()
}

#[test]
fn no_value_of_any_key_brings_a_panic_a_hang_or_a_message_without_a_place() {
    let (mut ran, mut tried) = (0, 0);
    for (text, plant) in [
        (DEFAULT, "paper"),
        (CHAIN, "paper"),
        (BASELINE, "paper"),
        (MOTOR, "motor"),
        (SMALL_MOTOR, "motor"),
        (JOINT, "joint"),
    ] {
        for key in settable_keys(plant) {
            for value in NASTY {
                let set = [format!("{key}={value}")];
                ran += usize::from(survives(text, &set).unwrap_or_else(|message| panic!("{set:?}: {message}")));
                tried += 1;
            }
        }
    }
    // A few values are valid, most are not.
    assert!(ran > tried / 20 && ran < tried / 2, "{ran} of {tried}");
}

#[test]
fn no_damage_to_a_file_or_an_argument_brings_a_panic_a_hang_or_a_message_without_a_place() {
    let mut runner = TestRunner::new_with_rng(
        Config { cases: 4000, failure_persistence: None, ..Config::default() },
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    );
    let keys = ["paper", "motor", "joint"].map(settable_keys).concat();
    let texts = [DEFAULT, CHAIN, BASELINE, SMALL_CHAIN, MOTOR, SMALL_MOTOR, JOINT, ""];
    let damages = prop::collection::vec(any::<Damage>(), 0..4);
    let argument = (any::<prop::sample::Index>(), 0..NASTY.len())
        .prop_map(move |(key, value)| format!("{}={}", key.get(&keys), NASTY[value]));
    let arguments = prop::collection::vec(prop_oneof![9 => argument, 1 => "\\PC{0,20}"], 0..3);
    let ran = std::cell::Cell::new(0);
    let outcome = runner.run(&(0..texts.len(), damages, arguments), |(text, damages, sets)| {
        let text = damaged(texts[text], &damages);
        let survived = survives(&text, &sets).map_err(|message| TestCaseError::fail(format!("{text}\n{message}")))?;
        ran.set(ran.get() + usize::from(survived));
        Ok(())
    });
    if let Err(failure) = outcome {
        panic!("{failure}");
    }
    // Otherwise the damage is too severe or too mild for a test.
    assert!((400..2000).contains(&ran.get()), "{} of 4000 ran", ran.get());
}
