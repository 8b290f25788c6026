//! The comparison of controllers runs, is repeatable, and agrees with theory.

use integration_tests::program::{Folder, host_sim};
use serde_json::Value;
use study::Watch;
use study::compare::{Bench, Settings, compare, contenders};

fn quick(folder: &Folder, file: &str, seed: &str) -> Value {
    let out = folder.path(seed);
    let args = ["compare", file, "--evaluations", "3", "--noise", "0.1", "--seed", seed, "--out", &out, "--json"];
    let spoken = host_sim(&args);
    assert_eq!(spoken.status, 0, "{spoken:?}");
    for name in ["compare.png", "compare.svg", "move.png", "move.svg", "compare.json"] {
        assert!(std::fs::metadata(format!("{out}/{name}")).is_ok_and(|file| file.len() > 1000), "{name}");
    }
    serde_json::from_str(&spoken.out).expect("JSON")
}

#[test]
fn the_same_seed_gives_the_same_comparison() {
    let folder = Folder::new("compare");
    let file = folder.path("motor.toml");
    std::fs::write(&file, scenario::MOTOR).expect("a file");
    let one = quick(&folder, &file, "5");
    assert_eq!(one, quick(&folder, &file, "5"));
    assert_ne!(one["entries"], quick(&folder, &file, "6")["entries"]);
    let laws: Vec<&str> =
        one["entries"].as_array().expect("rows").iter().filter_map(|row| row["law"].as_str()).collect();
    assert_eq!(
        laws,
        [
            "edo-smc, two gain sets",
            "edo-smc, one gain set",
            "LQG, disturbance states",
            "LQI",
            "ADRC with model",
            "super-twisting",
            "P-PI"
        ]
    );
}

#[test]
fn what_cannot_be_compared_is_refused_with_its_reason() {
    let folder = Folder::new("compare-refused");
    let file = folder.path("file.toml");
    let refused = |text: &str, more: &[&str], why: &str| {
        std::fs::write(&file, text).expect("a file");
        let out = folder.path("out");
        let spoken = host_sim(&[&["compare", &file, "--out", &out], more].concat());
        assert!(spoken.status == 2 && spoken.err.contains(why), "{spoken:?}");
        assert!(std::fs::metadata(&out).is_err(), "something was written");
    };
    refused(scenario::DEFAULT, &[], "neither [joint] nor [motor]");
    refused(scenario::MOTOR, &["--noise=-1"], "--noise");
    refused(scenario::MOTOR, &["--set", "motor.inertia=1"], "inertia");
    let speed = ["--set", "drive.mode=\"speed\"", "--set", "reference={kind=\"speed\", speed_rad_s=2}"];
    refused(scenario::MOTOR, &speed, "position");
}

/// On a rigid shaft with one encoder, one gain set performs like the linear controllers (P-PI, LQG, ADRC). Two gain
/// sets reduce the load error by more than a quarter. The search is short, from the starting values of the rules.
#[test]
fn one_gain_set_is_a_linear_law_among_others_and_two_are_stiffer() {
    let bench = Bench::new("motor.toml", scenario::MOTOR, &[]).expect("a file");
    let settings = Settings { evaluations: 20, seed: 1, noise_a: vec![0.1] };
    let entries = compare(&bench, &contenders(&bench), &settings, Watch::none()).expect("not stopped").entries;
    let of = |law: &str| entries.iter().find(|entry| entry.law == law).expect("a row");
    let (two, one, cascade) = (of("edo-smc, two gain sets"), of("edo-smc, one gain set"), of("P-PI"));
    for entry in &entries {
        println!("{}: {:.2} {:?}", entry.law, entry.cost, entry.figures);
    }
    assert!(two.figures.load_rad < 0.75 * one.figures.load_rad);
    for linear in [one, cascade, of("LQG, disturbance states"), of("ADRC with model")] {
        let off = (linear.figures.load_rad / one.figures.load_rad).log2().abs();
        assert!(off < 1.0 && linear.figures.unstable == 0, "{}", linear.law);
    }
}

/// A load against positive motion pushes the shaft back, and the loop returns it. The error of the move before is
/// smaller.
#[test]
fn the_run_that_is_drawn_is_a_move_and_then_a_load_step() {
    let bench = Bench::new("motor.toml", scenario::MOTOR, &[]).expect("a motor");
    let contenders = contenders(&bench);
    for contender in &contenders[..3] {
        let guess: Vec<f64> = contender.knobs().iter().map(|knob| knob.guess).collect();
        let ticks = bench.shown(contender.design(&guess).expect("a law").as_ref());
        let step_s = 1.4 * bench.tau_s;
        let worst = |from_s: f64, to_s: f64| {
            let within = ticks.iter().filter(|tick| (from_s..to_s).contains(&tick[0]));
            within
                .map(|tick| tick[1])
                .fold(0.0_f64, |worst, error| if error.abs() > worst.abs() { error } else { worst })
        };
        let (moved, loaded, late) =
            (worst(0.0, step_s), worst(step_s, 1.7 * bench.tau_s), worst(1.95 * bench.tau_s, 9.0));
        assert!(loaded < -2e-3 && moved.abs() < 0.5 * loaded.abs(), "{}: {moved} {loaded}", contender.name());
        assert!(late.abs() < 0.5 * loaded.abs(), "{}: {loaded} {late}", contender.name());
        // 14 % of the largest torque, with or without friction on top.
        let held = ticks[ticks.len() - 10..].iter().map(|tick| tick[2]).sum::<f64>() / 10.0;
        assert!((held - 1.4).abs() < 0.4, "{}: {held} A", contender.name());
    }
}
