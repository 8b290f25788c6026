//! Declared encoder noise: its effect on u equals the prediction of the studies, and the remedy fits its cause.

use std::ops::ControlFlow;

use controller_core::Health;
use scenario::{Experiment, JOINT, MOTOR, Source, parse};
use study::compare::{Bench, of_ours};
use study::design::Suggested;

/// Encoder with noise of a third of a degree; its quantisation step is 0.00044 rad rms.
const SHAKES: [&str; 5] = [
    "encoder.bits=12",
    "encoder.noise_rad=0.006",
    "friction={}",
    "reference={kind = \"rest\"}",
    "drive.rest_band=\"off\"",
];

fn with(text: &str, sets: &[&str]) -> Experiment {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    parse(&Source { file: "a.toml", text, sets: &sets }, "a").unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the rms of u over a run at rest that is long compared with the slowest loop here.
fn simulated_a(text: &str, sets: &[&str]) -> f64 {
    let mut experiment = with(text, &[sets, &["span_s=20"]].concat());
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    assert_eq!(error, None);
    let late = &trace.rows[trace.rows.len() / 10..];
    (late.iter().map(|row| row.u * row.u).sum::<f64>() / late.len() as f64).sqrt()
}

/// Returns the lines of a suggestion as `--set` arguments.
fn sets_of(suggested: &Suggested) -> Vec<String> {
    let of = |[table, line]: &[String; 2]| {
        let value = line.split("  #").next().unwrap_or(line).replacen(" = ", "=", 1);
        format!("{}.{value}", table.trim_matches(['[', ']']))
    };
    suggested.lines.iter().map(of).collect()
}

/// For one gain set the noise from the bench of `tune` is at least the noise from the matrices and from a long run. The
/// matrices are independent of any run. The bench uses the larger value of rest and motion, in which the loop is open.
#[test]
fn tune_counts_the_declared_noise() {
    let slow = [&SHAKES[..], &["drive.gain_sets=1", "drive.surface_rad_s=30"]].concat();
    let of_bench = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        let bench = Bench::new("a.toml", MOTOR, &sets).expect("a drive");
        bench.noise_a(&of_ours(&bench.designed).expect("a design"))
    };
    let told = of_bench(&slow);
    let [matrices, run] =
        [study::design(&with(MOTOR, &slow)).expect("a loop").noise().expect("stable"), simulated_a(MOTOR, &slow)];
    assert!((run / matrices - 1.0).abs() < 0.1, "{run} A in a run, {matrices} A by matrices");
    assert!(told > 0.9 * run && told < 2.5 * run, "{told} A by the bench, {run} A in a run");
    // Too fast for its noise.
    assert!(of_bench(&[&SHAKES[..], &["drive.surface_rad_s=120"]].concat()) > 0.5);
    // If declared noise dominates, twice the noise gives twice the effect.
    let louder = of_bench(&[&slow[..], &["encoder.noise_rad=0.012"]].concat());
    assert!((louder / told - 2.0).abs() < 0.2, "{told} A, {louder} A");
}

/// By rule a drive has the bandwidth that its noise allows. u stays within 1 % of its limit, in runs as well, with the
/// default high gains and rest band. A drive that is set faster gets a slower suggestion from `design`.
#[test]
fn the_rule_takes_what_the_declared_noise_allows() {
    let suggested =
        |text: &str, sets: &[&str]| study::design(&with(text, sets)).expect("a loop").suggested.expect("a better one");
    let found = suggested(MOTOR, &SHAKES);
    assert!(found.is_same && found.why.contains("no more bits help; half of this noise allows"), "{found:?}");
    for (bits, noise_rad, period_s, margin) in [
        (12, 6e-3, 1e-3, "fast"),
        (12, 6e-3, 1e-3, "standard"),
        (14, 1e-3, 1e-3, "fast"),
        (20, 1e-4, 1e-4, "fast"),
        (20, 1e-4, 1e-4, "standard"),
        (14, 1e-3, 1e-3, "1.6"),
    ] {
        let keys = [
            format!("encoder.bits={bits}"),
            format!("encoder.noise_rad={noise_rad}"),
            format!("drive.period_s={period_s}"),
            format!("drive.margin={margin}"),
        ];
        let keys: Vec<&str> = keys.iter().map(String::as_str).chain(SHAKES[2..4].iter().copied()).collect();
        let matrices = study::design(&with(MOTOR, &keys)).expect("a loop").noise().expect("stable");
        let run = simulated_a(MOTOR, &keys);
        assert!((0.05..=0.1).contains(&matrices), "{matrices} A by matrices, {keys:?}");
        // The rest band removes a part of it.
        assert!(run < 0.105 && (0.6..1.1).contains(&(run / matrices)), "{run} A in a run, {matrices}, {keys:?}");
    }

    let fast = [&SHAKES[..], &["drive.surface_rad_s=120"]].concat();
    let found = suggested(MOTOR, &fast);
    assert!(!found.is_same && found.why.contains("the declared noise binds"), "{}", found.why);
    let slower = sets_of(&found);
    let sets: Vec<&str> = SHAKES.into_iter().chain(slower.iter().map(String::as_str)).collect();
    assert!(simulated_a(MOTOR, &sets) < 0.105, "{sets:?}");

    let steps = suggested(MOTOR, &["encoder.bits=12", "encoder.noise_rad=1e-5"]);
    assert!(steps.why.contains("two more bits"), "{}", steps.why);
    let both = suggested(MOTOR, &["encoder.bits=12", "encoder.noise_rad=1e-4"]);
    assert!(both.why.contains("its steps make 0.000443); half of"), "{}", both.why);
    let fine = suggested(MOTOR, &["encoder.noise_rad=1e-5"]);
    assert!(!fine.why.contains("declared"), "{}", fine.why);
}

/// A noisy encoder causes neither hunting nor a wider rest band.
#[test]
fn a_noisy_encoder_rests_in_friction() {
    let move_to = "reference={kind = \"move\", to_rad = 1.0}";
    for (bits, noise_rad) in [(12, 1e-3), (14, 6e-3), (20, 1e-3), (20, 1e-4)] {
        let keys = [format!("encoder.bits={bits}"), format!("encoder.noise_rad={noise_rad}")];
        let keys: Vec<&str> = keys.iter().map(String::as_str).chain([move_to, "span_s=10"]).collect();
        let (trace, error) = with(MOTOR, &keys).run(&mut |_| ControlFlow::Continue(()));
        assert_eq!(error, None);
        assert!(trace.rows.iter().all(|row| !row.health.contains(Health::HUNTS)), "{keys:?}");
        let late = &trace.rows[trace.rows.len() / 2..];
        let rms = (late.iter().map(|row| (row.x[0] - 1.0).powi(2)).sum::<f64>() / late.len() as f64).sqrt();
        let largest = f64::max(noise_rad, std::f64::consts::TAU / f64::from(1 << bits));
        assert!(rms < 2.0 * largest, "{rms} rad off, {keys:?}");
    }
}

#[test]
fn a_joint_whose_encoder_shakes_is_slowed_too() {
    let shakes = ["encoder.motor.noise_rad=1e-3", "load=[]", "joint.max_current_a=10", "reference={kind = \"rest\"}"];
    let found = study::design(&with(JOINT, &shakes)).expect("a loop").suggested.expect("a better one");
    assert!(found.why.contains("declared noise") && found.why.contains("of the motor's encoder"), "{}", found.why);
    let sets = sets_of(&found);
    assert!(sets.iter().any(|set| set.starts_with("drive.surface_rad_s=")), "{sets:?}");
    assert!(sets.iter().any(|set| set == "drive.gain_sets=1"), "{sets:?}");
    let sets: Vec<&str> = shakes.into_iter().chain(sets.iter().map(String::as_str)).collect();
    let run = simulated_a(JOINT, &sets);
    assert!(run < 0.105 && run > 0.07, "{run} A with {sets:?}");
}
