//! Eight chains with known results (`tests/data/cases.json`) from an independent implementation: n = 2..5, slopes of
//! either sign up to lambda T = 2, observers on every kind of subset, switching, deadbeat, b of either sign.

use integration_tests::close::relative;
use integration_tests::data;
use integration_tests::oracle::{Gains, Model, Spec};
use integration_tests::printed::{Printed, nominal};
use integration_tests::shape::{Precision, controller};
use integration_tests::truth::{ExactStep, LinearChain, Term};
use serde_json::Value;
use std::f64::consts::FRAC_PI_2;

struct Case {
    name: String,
    spec: Spec,
    plant: LinearChain,
    x0: Vec<f64>,
    ticks: usize,
    tolerance: [f64; 3],
    discrete: [f64; 3],
    continuous: [f64; 2],
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"))
}

fn row(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(number).collect()
}

fn term(value: &Value) -> Term {
    let of = |key: &str| number(&value[key]);
    match value["kind"].as_str().expect("a kind") {
        "const" => Term::Const(of("amplitude")),
        "ramp" => Term::Ramp(of("slope")),
        "sin" => Term::Sin(of("amplitude"), of("omega"), of("phase")),
        "cos" => Term::Sin(of("amplitude"), of("omega"), of("phase") + FRAC_PI_2),
        "step" => Term::Step(of("amplitude"), of("t0")),
        kind => panic!("unknown kind {kind}"),
    }
}

fn cases() -> Vec<Case> {
    let parsed: Value = serde_json::from_str(&data::text("cases.json")).expect("valid JSON");
    let list = parsed.as_array().expect("a list");
    assert_eq!(list.len(), 8);
    list.iter().map(one_case).collect()
}

fn one_case(case: &Value) -> Case {
    let a = row(&case["nominal"]["a"]);
    let b = number(&case["nominal"]["b"]);
    let n = a.len();
    let mut observers = vec![None; n];
    for observer in case["observer"].as_array().expect("a list") {
        observers[number(&observer["channel"]) as usize - 1] = Some(Gains::printed(&row(&observer["l"])));
    }
    let mut d = vec![Vec::new(); n];
    for disturbance in case["disturbance"].as_array().expect("a list") {
        let terms = disturbance["terms"].as_array().expect("a list");
        d[number(&disturbance["channel"]) as usize - 1] = terms.iter().map(term).collect();
    }
    let period_s = number(&case["T"]);
    let expected = &case["expected"];
    let of = |group: &str, key: &str| number(&expected[group][key]);
    Case {
        name: case["name"].as_str().expect("a name").to_string(),
        spec: Spec {
            period_s,
            c: row(&case["surface_c"]),
            alpha: number(&case["alpha"]),
            k_l: number(&case["k_l"]),
            k_s: number(&case["k_s"]),
            epsilon: number(&case["eps"]),
            gradient: a.clone(),
            input_gain: b,
            observers,
            limit: 1e12,
        },
        plant: LinearChain { a, b, d },
        x0: row(&case["x0"]),
        ticks: (number(&case["T_end"]) / period_s).round() as usize,
        tolerance: ["f64_relative", "f32_relative", "continuous_relative"].map(|key| of("tolerance", key)),
        discrete: ["sigma", "y", "u"].map(|key| of("discrete", key)),
        continuous: ["sigma", "y"].map(|key| of("continuous", key)),
    }
}

/// Returns the maxima of |sigma*|, |y|, |u| over the ticks k with 2 k >= K, k <= K.
fn sampled(case: &Case, precision: Precision) -> [f64; 3] {
    let model = Model::linear(&case.plant.a, case.plant.b);
    let mut shipped = controller(&case.spec, &model, 3, precision).expect("a valid design");
    let step = ExactStep::new(&case.plant, case.spec.period_s);
    let mut x = case.x0.clone();
    assert!(shipped.start(&x));
    let mut maxima = [0.0_f64; 3];
    for k in 0..=case.ticks {
        let tick = shipped.tick(&x);
        if 2 * k >= case.ticks {
            let values = [tick.sigma_star, x[0], tick.u];
            for (maximum, value) in maxima.iter_mut().zip(values) {
                *maximum = maximum.max(value.abs());
            }
        }
        step.advance(k, tick.u, &mut x);
    }
    maxima
}

fn check(precision: Precision, which: usize) {
    let mut failures = Vec::new();
    for case in cases() {
        let found = sampled(&case, precision);
        let gaps: Vec<f64> =
            found.iter().zip(case.discrete).map(|(found, expected)| relative(*found, expected)).collect();
        println!("{:26} {gaps:?} (tolerance {:e})", case.name, case.tolerance[which]);
        if gaps.iter().any(|gap| gap.is_nan() || *gap > case.tolerance[which]) {
            failures.push(format!("{}: {found:?}, expected {:?}", case.name, case.discrete));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn f64_controller_shows_the_figures_of_the_independent_implementation() {
    check(Precision::Double, 0);
}

#[test]
fn f32_controller_shows_the_figures_of_the_independent_implementation() {
    check(Precision::Single, 1);
}

/// The plants under the printed continuous controller; the test also confirms the transcription of the print.
#[test]
fn printed_continuous_law_shows_the_continuous_figures() {
    for case in cases() {
        let model = Model::linear(&case.plant.a, case.plant.b);
        let model = nominal(&model);
        let mut printed = Printed::start(&case.spec, &model, &case.x0);
        let mut maxima = [0.0_f64; 2];
        for k in 0..=case.ticks {
            if 2 * k >= case.ticks {
                let values = [printed.now().sigma_star, printed.x()[0]];
                for (maximum, value) in maxima.iter_mut().zip(values) {
                    *maximum = maximum.max(value.abs());
                }
            }
            // The fastest case has lambda T = 2, k_l T = 2; the integration step is 1/20 of that.
            let plant = |t: f64, x: &[f64], u: f64, dx: &mut [f64]| case.plant.rhs(t, x, u, dx);
            printed.advance(&plant, (k + 1) as f64 * case.spec.period_s, 40);
        }
        for (found, expected) in maxima.into_iter().zip(case.continuous) {
            let gap = relative(found, expected);
            assert!(gap <= case.tolerance[2], "{}: {found} for {expected}", case.name);
        }
    }
}
