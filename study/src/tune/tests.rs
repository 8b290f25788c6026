//! A search is reproducible from its seed, improves on the rule, and reports the metrics of its result.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::ThreadPoolBuilder;

use super::*;
use crate::compare::of_ours;
use crate::map::Subject;
use crate::sized;

fn motor() -> Bench {
    Bench::new("motor.toml", scenario::MOTOR, &[]).expect("a file")
}

fn specification(noise_a: f64) -> Specification {
    Specification {
        noise_a,
        settle_s: None,
        move_rad: None,
        load_rad: None,
        phase_deg: None,
        sensitivity_peak: None,
        is_wide: false,
    }
}

fn found(bench: &Bench, job: Job, evaluations: usize, seed: u64, threads: usize) -> Entry {
    let steps = AtomicUsize::new(0);
    let step = || {
        steps.fetch_add(1, Ordering::Relaxed);
    };
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let (stop, effort) = (AtomicBool::new(false), Effort { evaluations, seed, most_cycles: None });
    let entries = pool.install(|| searches(bench, &[job], effort, Watch::new(&stop, &step))).expect("not stopped");
    assert!((1..=evaluations).contains(&steps.into_inner()));
    entries.into_iter().next().expect("a drive")
}

#[test]
fn any_number_of_threads_gives_the_same_and_another_seed_another() {
    let bench = motor();
    let job = Job { gain_sets: 1, specification: specification(0.1) };
    let evaluations = sized(24, 9);
    assert_eq!(found(&bench, job, evaluations, 7, 1), found(&bench, job, evaluations, 7, 3));
    // The first start is the guess, for any seed.
    let start = |start: usize, seed: u64| {
        searched(&bench, job, start, Effort { evaluations, seed, most_cycles: None }, Watch::none())
    };
    assert_eq!(start(0, 7), start(0, 8));
    assert_ne!(start(1, 7), start(1, 8));
    assert_ne!(start(1, 7), start(2, 7));
}

#[test]
fn a_search_is_within_what_is_asked_and_better_than_the_rule() {
    let bench = motor();
    let by_rule = Found::of(&bench, &bench.designed, &specification(1.0), true).expect("a drive");
    let job = Job { gain_sets: 2, specification: specification(by_rule.noise_a) };
    let Entry { found: best, designed, .. } = found(&bench, job, sized(90, 30), 1, 2);
    assert_eq!(job.specification.missed(&best), [""; 0]);
    assert!(best.cost() < by_rule.cost() - 0.03, "{} of {}", best.cost(), by_rule.cost());
    // The reported metrics are the metrics of this drive.
    assert_eq!(Found::of(&bench, &designed, &job.specification, true), Some(best));
    let design = of_ours(&designed).expect("a drive");
    assert!(best.noise_a >= bench.noise_a(&design) && best.worst.corners == 8);
}

#[test]
fn what_is_asked_is_met() {
    let bench = motor();
    let free = found(&bench, Job { gain_sets: 1, specification: specification(0.1) }, sized(60, 20), 1, 2).found;
    let less = Specification { load_rad: Some(0.8 * free.worst.load_rad), ..specification(0.2) };
    let pushed = found(&bench, Job { gain_sets: 1, specification: less }, sized(60, 20), 1, 2).found;
    assert_eq!(less.missed(&pushed), [""; 0]);
    assert!(free.noise_a <= 0.1 && pushed.worst.load_rad < 0.8 * free.worst.load_rad);
}

/// Without these limits the search of this load ends with a small phase margin.
#[test]
fn margins_are_limits_like_errors() {
    let bench = motor();
    let by_rule = Found::of(&bench, &bench.designed, &specification(1.0), true).expect("a drive");
    let free = specification(by_rule.noise_a);
    let at_rest = bench.at_rest.as_ref().expect("a loop");
    let margins = |specification: Specification| {
        let entry = found(&bench, Job { gain_sets: 1, specification }, sized(90, 45), 1, 2);
        assert_eq!(specification.missed(&entry.found), [""; 0]);
        let set = gain_sets(&entry.designed, at_rest).expect("margins").remove(0);
        let worst = set.worst.and_then(|worst| worst.sensitivity_peak).expect("a stable corner");
        (set.margins.and_then(|margins| margins.phase_deg).expect("a phase margin"), worst)
    };
    let (phase_deg, peak) = margins(free);
    let limited = Specification { phase_deg: Some(phase_deg + 2.0), ..free };
    assert!(margins(limited).0 >= phase_deg + 2.0, "{phase_deg}");
    let limited = Specification { sensitivity_peak: Some(0.8 * peak), ..free };
    assert!(margins(limited).1 <= 0.8 * peak, "{peak}");
}

/// Joint with five parameters off by up to half.
#[test]
fn a_joint_known_to_half_has_no_unstable_corner_and_a_small_error_under_load() {
    let bench = Bench::new("joint.toml", scenario::JOINT, &[]).expect("a file");
    let specification = Specification { load_rad: Some(4.8e-3), is_wide: true, ..specification(0.015) };
    let best = found(&bench, Job { gain_sets: 2, specification }, sized(30, 15), 1, 2).found;
    assert_eq!(specification.missed(&best), [""; 0], "{best:?}");
    assert!(best.worst.corners == 32 && best.worst.unstable == 0, "{best:?}");
    assert!(best.worst.load_rad < 4.8e-3 && best.noise_a <= 0.015, "{best:?}");
    // With the nominal plant the error is far smaller: its corners differ.
    let known =
        Found::of(&bench, &bench.designed, &Specification { is_wide: false, ..specification }, true).expect("a drive");
    assert!(known.worst.load_rad < 0.8 * best.worst.load_rad, "{known:?}");

    // The result has the metrics of its search. The monitors of the file, set for ±20 %, would stop it in some corners.
    for (sets, is_stopped) in [(&[][..], true), (&["drive.uncertain_percent=50", "drive.gain_sets=2"], false)] {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        let subject = Subject { file: "joint.toml", text: scenario::JOINT, sets: &sets, name: "joint" };
        let bench = Bench::new("joint.toml", scenario::JOINT, &sets).expect("a file");
        let stop = AtomicBool::new(false);
        let effort = Effort { evaluations: 1, seed: 1, most_cycles: None };
        let answer = tune(&bench, &subject, &specification, effort, Watch::new(&stop, &|| {})).expect("a drive");
        let answer = answer.expect("not stopped");
        assert_eq!((answer.missed.len(), answer.lost.len()), (0, 0), "{answer:?}");
        assert_eq!(!answer.stopped.is_empty(), is_stopped, "{answer:?}");
        assert!(answer.pareto.iter().any(|it| it.found == answer.found), "{answer:?}");
    }
}

#[test]
fn what_is_not_met_is_named() {
    let worst = Worst {
        sine_rad: 1e-3,
        move_rad: 1e-2,
        load_rad: 1e-2,
        settle_s: 0.2,
        corners: 8,
        unstable: 0,
        spectral_radius: 0.9,
    };
    let found = Found { noise_a: 0.1, worst, at_rest: AtRestMargins { phase_deg: 30.0, sensitivity_peak: 2.5 } };
    assert_eq!(specification(0.1).missed(&found), [""; 0]);
    assert_eq!(specification(0.09).missed(&found), ["noise"]);
    let all = Specification { settle_s: Some(0.1), move_rad: Some(9e-3), load_rad: Some(9e-3), ..specification(0.09) };
    assert_eq!(all.missed(&found), ["noise", "settling", "move", "load"]);
    let in_linear = Specification { phase_deg: Some(30.1), sensitivity_peak: Some(2.4), ..specification(0.1) };
    assert_eq!(in_linear.missed(&found), ["phase margin", "peak |S|"]);
    let no_margins = Found { at_rest: AtRestMargins::NONE, ..found };
    assert_eq!(in_linear.missed(&no_margins), ["phase margin", "peak |S|"]);
    let unstable = Found { worst: Worst { spectral_radius: 1.0, ..worst }, ..found };
    assert_eq!(specification(0.1).missed(&unstable), ["stability"]);
    let lost = Found { noise_a: f64::NAN, worst: Worst { load_rad: f64::NAN, ..worst }, ..found };
    assert_eq!(Specification { load_rad: Some(1.0), ..specification(0.1) }.missed(&lost), ["noise", "load"]);
    // A corner with a failed run violates the specification, even without a limit.
    let lost = Found { worst: Worst { settle_s: LOST, sine_rad: LOST, ..worst }, ..found };
    assert_eq!(specification(0.1).missed(&lost), ["settling", "sine"]);
}

/// A file with the settings reproduces the drive from which they were taken.
#[test]
fn a_file_with_the_settings_is_that_drive() {
    for (text, sets) in [(scenario::MOTOR, 1), (scenario::MOTOR, 2), (scenario::JOINT, 1), (scenario::JOINT, 2)] {
        let bench = Bench::new("test.toml", text, &[]).expect("a file");
        let knobs: Vec<f64> = Tuned::new(&bench, sets).knobs().iter().map(|knob| 1.0831 * knob.guess).collect();
        let designed = rounded(&Tuned::new(&bench, sets).designed(&knobs).expect("a drive"));
        let settings = settings(&designed);
        let sets: Vec<String> = settings
            .iter()
            .map(|(key, values)| match &values[..] {
                [value] => format!("drive.{key}={value}"),
                values => format!("drive.{key}={values:?}"),
            })
            .collect();
        let of_file = Bench::new("test.toml", text, &sets).expect("the file").designed;
        assert_eq!(of_file.name(), designed.name());
        assert_eq!(of_file.bandwidths(), designed.bandwidths());
        assert_eq!(of_file.gate_steps(), designed.gate_steps());
        assert_eq!(super::settings(&of_file), settings);
    }
}
