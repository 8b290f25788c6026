use std::ops::ControlFlow;

use loop_sim::closed_loop::LoopError;
use loop_sim::port::in_process::Model;
use loop_sim::solver::SolverError;
use loop_sim::trace::{Ending, Trace};

use crate::{Experiment, OWN, Source, parse};

fn built(text: &str, sets: &[&str]) -> Result<Experiment, String> {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    parse(&Source { file: "a.toml", text, sets: &sets }, "a").map_err(|error| error.to_string())
}

fn ran(text: &str, sets: &[&str]) -> (Trace, Option<LoopError>) {
    built(text, sets).unwrap_or_else(|error| panic!("{error}")).run(&mut |_| ControlFlow::Continue(()))
}

/// Largest |x1| from `from_s` on.
fn largest(trace: &Trace, from_s: f64) -> f64 {
    trace.rows.iter().filter(|row| row.t_s >= from_s).fold(0.0, |most, row| row.x[0].abs().max(most))
}

/// Joint of the paper as formulas, with the numbers of Table I.
const JOINT: &str = r#"
span_s = 5.0
[plant]
kind = "own"
x0 = [0.1, 0, 0, 0]
rates = ["x2", "x3 - k1*x1 - b1*x2 - sin(x1)", "x4", "k1*k2*x1 - k2*x3 - b2*x4 + b*(u + 1 + sin(2*t))"]
[plant.constants]
k1 = 39.130434782608695
b1 = 0.30434782608695654
k2 = 9667.02470461869
b2 = 75.18796992481204
b = 5001.6345210853215
[controller]
c = [125.0, 75.0, 15.0, 1.0]
nominal = { a = [378274.87974594877, 0, -9667.02470461869, -75.18796992481204], b = 5001.6345210853215 }
[[controller.observer]]
channel = 2
printed = [100.0, 20.0]
[[controller.observer]]
channel = 4
printed = [100.0, 20.0]
"#;

#[test]
fn the_joint_by_its_equations_runs_as_the_built_in_one() {
    let built_in = ["span_s=5", "window_s=[2.5, 5]", "plant.reading=physical"];
    for precision in ["f32", "f64"] {
        let set = format!("controller.precision={precision}");
        let (own, _) = ran(JOINT, &[&set]);
        let (given, _) = ran(crate::DEFAULT, &[&built_in[..], &[&set]].concat());
        assert_eq!((own.rows.len(), given.rows.len()), (5001, 5001));
        // In f64 the solver tolerance of 1e-9; in f32 the last digits of a sample change the rounding of u.
        let allowed = if precision == "f64" { 1e-8 } else { 1e-5 };
        let peak = largest(&given, 0.0);
        for (a, b) in own.rows.iter().zip(&given.rows) {
            assert!((a.x[0] - b.x[0]).abs() < allowed * peak, "{precision}, t = {}: {} {}", a.t_s, a.x[0], b.x[0]);
        }
        assert!(peak >= 0.1 && largest(&given, 4.0) < 0.05, "the run says something");
    }
}

#[test]
fn a_controller_that_knows_the_nonlinear_drift_leaves_less_to_its_observer() {
    // The drift is the only model term: no friction, no other mass, no disturbance.
    let clean = [
        "plant.constants.f=0",
        "plant.constants.c=0",
        "plant.disturbance=[]",
        "controller.nominal.constants={}",
        "plant.rates=[\"x2\", \"g/l*sin(x1) + u/(m*l^2)\"]",
    ];
    let peak_of_estimate = |a: &str| {
        let set = format!("controller.nominal.a={a}");
        let (trace, error) = ran(OWN, &[&clean[..], &[&set]].concat());
        assert_eq!((error, trace.ending), (None, Ending::Finished));
        assert!(largest(&trace, 4.0) < 1e-3, "{a}: upright");
        trace.rows.iter().fold(0.0_f64, |most, row| most.max(row.d_hat[1].abs()))
    };
    let (formula, linear) = (peak_of_estimate("\"g/l*sin(x1)\""), peak_of_estimate("[19.62, 0]"));
    // With a linear model x - sin x remains: 19.62 (0.5 - sin 0.5) = 0.40 rad/s^2 at the start.
    assert!((0.2..0.5).contains(&linear), "{linear}");
    // u is constant within a tick, in which the drift changes by about 1e-3.
    assert!(formula < 0.02 * linear, "{formula} {linear}");
}

#[test]
fn a_gain_that_varies_is_divided_by() {
    // b(x) = 2 + x1: with the exact model of b nothing is left to estimate.
    let text = |gain: &str| {
        format!(
            "span_s = 4\n[plant]\nkind = \"own\"\nx0 = [0.8, 0]\nrates = [\"x2\", \"-x1 + (2 + x1)*u\"]\n[controller]\n\
             precision = \"f64\"\nsurface_bandwidth_rad_s = 4\nk_l = 20\nnominal = {{ a = \"-x1\", b = {gain} }}\n\
             [[controller.observer]]\nchannel = 2\nbandwidth_rad_s = 50\norder = 1\n"
        )
    };
    let estimate =
        |gain: &str| ran(&text(gain), &[]).0.rows.iter().fold(0.0_f64, |most, row| most.max(row.d_hat[1].abs()));
    assert!(estimate("\"2 + x1\"") < 0.05 * estimate("2"), "{} {}", estimate("\"2 + x1\""), estimate("2"));
}

#[test]
fn a_row_of_a_is_the_linear_model_of_a_target_and_a_formula_stays_here() {
    let linear = built(OWN, &["controller.nominal.a=[19.62, 0]"]).expect("good");
    let spec = linear.spec.as_ref().expect("proposed");
    assert_eq!(spec.model, Model::Linear(vec![19.62, 0.0]));
    assert!(linear.download.is_some());
    // 1/(m l^2) of the nominal mass; the slope of g/l sin x1 at rest.
    let formula = built(OWN, &[]).expect("good");
    let nominal = formula.spec.as_ref().expect("proposed").config.padded.nominal;
    assert!((nominal.input_gain * 0.56 * 0.25 - 1.0).abs() < 1e-15);
    assert_eq!(nominal.gradient[..2], [9.81 / 0.5, 0.0]);
    assert!(formula.download.is_none());
}

#[test]
fn where_a_formula_has_no_value_the_run_says_which_and_when() {
    let (trace, error) = ran(OWN, &["plant.rates=[\"x2\", \"u + 1/x2\"]"]);
    assert_eq!(error, Some(LoopError::Solver(SolverError::NoRate { t_s: 0.0, channel: 2, rate: f64::INFINITY })));
    assert_eq!((trace.rows.len(), trace.ending), (1, Ending::BrokenOff { t_s: 0.0 }));
    // During the run, at a pole at x1 = 0.4.
    let (trace, error) = ran(OWN, &["plant.rates=[\"x2\", \"-1 + ln(x1 - 0.4)\"]"]);
    assert!(error.is_some() || matches!(trace.ending, Ending::Diverged { .. }), "{:?}", trace.ending);
    assert!(trace.rows.len() < 1000, "{}", trace.rows.len());
}

#[test]
fn every_mistake_in_a_formula_is_told_with_its_place_in_the_file_and_in_the_formula() {
    let text = r#"[plant]
kind = "own"
x0 = [1, 2, 3]
rates = ["x2 + y", "sine(x1) + gg*cos(x1, 2) - x3", "(u"]
[plant.constants]
g = 9.81
sin = 1
"a b" = 2
[controller]
surface_bandwidth_rad_s = 4
[controller.nominal]
a = "-g*sin(x1) + u"
b = "x1*2"
constants = { gr = 1 }
"#;
    assert_eq!(
        built(text, &[]).err().expect("refused"),
        "a.toml:4:10: `plant.rates[1]`: at character 6: `y` is unknown; did you mean `g`?\n\
         a.toml:4:20: `plant.rates[2]`: at character 12: `gg` is unknown; did you mean `g`?\n\
         a.toml:4:20: `plant.rates[2]`: at character 15: `cos` takes 1, not 2 values\n\
         a.toml:4:20: `plant.rates[2]`: at character 1: `sine` is not a function; did you mean `sin`?\n\
         a.toml:4:53: `plant.rates[3]`: at character 3: expected `)`, found the end\n\
         a.toml:5:1: `plant.constants`: `a b`: a name must consist of letters, digits and `_`, and not begin with a \
         digit\n\
         a.toml:5:1: `plant.constants`: `sin`: the name is reserved: rename the constant\n\
         a.toml:12:5: `controller.nominal.a`: at character 14: `u` is unknown; did you mean `g`?\n\
         a.toml:14:20: `controller.nominal.constants.gr`: there is no such constant in plant.constants; did you mean \
         `g`?"
    );
    let told = |sets: &[&str]| built(OWN, sets).err().expect("refused");
    assert_eq!(
        told(&["controller.nominal.b=\"x1*2\""]),
        "--set controller.nominal.b=\"x1*2\": `controller.nominal.b`: found 0 at rest, expected an input gain other \
         than 0: the law divides by it (Eq. (51))"
    );
    assert_eq!(
        told(&["controller.nominal.a=\"sqrt(x1)\""]),
        "--set controller.nominal.a=\"sqrt(x1)\": `controller.nominal.a`: the value at rest is 0 and its slopes are \
         [inf, 0]: the design needs finite numbers there"
    );
    assert_eq!(
        told(&["plant.rates=[\"x2\", \"u\", 3]"]),
        "--set plant.rates=[\"x2\", \"u\", 3]: `plant.rates[3]`: found 3, expected text"
    );
    let missing = built("[plant]\nkind = \"own\"\nrates = [\"x2\", \"u\"]\n[controller]\nc = [5, 1]\n", &[])
        .err()
        .expect("refused");
    assert!(
        missing.contains("`controller.nominal.a`: missing: ") && missing.contains("`controller.nominal.b`: missing: ")
    );
    // Keys of another kind are errors.
    let chain = "[plant]\nkind = \"chain\"\norder = 2\na = [1, 2]\nb = 1\nrates = []\n[controller]\nc = [5, 1]\n\
                 nominal.a = \"x1\"\n";
    let told = built(&chain.replace("rates = []", "rates = [\"x2\", \"u\"]"), &[]).err().expect("refused");
    assert_eq!(
        told,
        "a.toml:6:9: `plant.rates`: only for plant.kind = \"own\", but plant.kind is \"chain\"\n\
         a.toml:9:13: `controller.nominal.a`: found a formula: only for plant.kind = \"own\"; a chain is linear"
    );
}

#[test]
fn a_constant_of_a_formula_is_set_from_outside() {
    let fall = |sets: &[&str]| {
        let text = "span_s = 1\n[plant]\nkind = \"own\"\nrates = [\"x2\", \"-g + 0*u\"]\nconstants = { g = 1 }\n\
                    [controller]\nc = [5, 1]\nk_l = 0\nnominal = { a = [0, 0], b = 1 }\n";
        ran(text, sets).0.rows.last().expect("rows").x[0]
    };
    assert!((fall(&[]) + 0.5).abs() < 1e-9 && (fall(&["plant.constants.g=9.81"]) + 4.905).abs() < 1e-9);
}
