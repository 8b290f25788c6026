//! Bandwidths by rule have the margin of the rule, on motors for which it was not fitted individually.

use rayon::prelude::*;
use scenario::{Experiment, MOTOR, Source, parse};
use study::design::Design;
use study::gain_sets::GainSet;

fn deep() -> bool {
    std::env::var_os("DEEP").is_some()
}

fn with(sets: &[String]) -> Experiment {
    parse(&Source { file: "a.toml", text: MOTOR, sets }, "a").unwrap_or_else(|error| panic!("{error}: {sets:?}"))
}

fn designed(sets: &[String]) -> Design {
    study::design(&with(sets)).unwrap_or_else(|error| panic!("{error}: {sets:?}"))
}

const STANDARD: &str = "drive.margin=\"standard\"";

/// Returns data sheet number k. Each has another J, T, ratio of lag to T, resolution and acceleration at full current,
/// evenly distributed on a logarithmic scale.
fn sheet(k: usize) -> Vec<String> {
    let share = |step: f64| ((k + 1) as f64 * step).fract();
    let inertia = 1e-7 * 10_f64.powf(6.0 * share(0.819_172_513_4));
    let period_s = 50e-6 * 80_f64.powf(share(0.671_043_606_7));
    let lag_s = 2.0 * period_s * share(0.549_700_477_9);
    let bits = 10 + (15.0 * share(0.450_295_3)) as u32;
    let acceleration = 30.0 * 1e4_f64.powf(share(0.368_87));
    vec![
        format!(
            "motor={{inertia_kg_m2={inertia:e}, torque_n_m_per_a={:e}, max_current_a=10.0, current_lag_s={lag_s:e}}}",
            inertia * acceleration / 10.0
        ),
        format!("encoder.bits={bits}"),
        format!("drive.period_s={period_s:e}"),
        "friction={}".into(),
        "reference={kind=\"rest\"}".into(),
        "span_s=0.1".into(),
    ]
}

/// Returns the peaks of |S| of a gain set for the data sheet and in its worst corner; infinite if unstable.
fn peaks(set: &GainSet) -> [f64; 2] {
    let worst = set.worst.as_ref().and_then(|worst| worst.sensitivity_peak);
    [set.margins.map(|margins| margins.sensitivity_peak), worst].map(|peak| peak.unwrap_or(f64::INFINITY))
}

struct Found {
    quiet: [f64; 2],
    fast: [f64; 2],
    noise_share: f64,
}

fn found(sets: &[String]) -> Found {
    let design = designed(sets);
    let (quiet, fast) = (&design.gain_sets[0], design.gain_sets.get(1));
    Found {
        quiet: peaks(quiet),
        fast: fast.map_or([0.0; 2], peaks),
        noise_share: design.noise().unwrap_or(f64::INFINITY) / 10.0,
    }
}

/// Returns the largest values over these sheets: peaks for the data sheet and in corners, noise.
fn worst(count: usize, more: &[&str]) -> Found {
    worst_of(count, more, sheet)
}

fn worst_of(count: usize, more: &[&str], sheet: impl Fn(usize) -> Vec<String> + Sync) -> Found {
    let all: Vec<_> = (0..count)
        .into_par_iter()
        .map(|k| found(&sheet(k).into_iter().chain(more.iter().map(ToString::to_string)).collect::<Vec<_>>()))
        .collect();
    let most = |of: &dyn Fn(&Found) -> f64| all.iter().map(of).fold(0.0, f64::max);
    let both = |of: &dyn Fn(&Found) -> [f64; 2]| [0, 1].map(|i| most(&|found| of(found)[i]));
    let found =
        Found { quiet: both(&|it| it.quiet), fast: both(&|it| it.fast), noise_share: most(&|it| it.noise_share) };
    let Found { quiet, fast, noise_share } = &found;
    println!(
        "{count} sheets {more:?}: |S| up to {:.3} and {:.3}, in corners {:.3} and {:.3}; noise {:.2} %",
        quiet[0],
        fast[0],
        quiet[1],
        fast[1],
        100.0 * noise_share
    );
    found
}

#[test]
fn the_standard_rule_has_its_margin_on_every_data_sheet() {
    let count = if deep() { 2000 } else { 150 };
    let Found { quiet, fast, noise_share } = worst(count, &[STANDARD]);
    assert!(quiet[0] <= 1.55 && fast[0] <= 2.0, "{quiet:?} {fast:?}");
    assert!(quiet[1] <= 2.2 && fast[1] <= 2.2, "{quiet:?} {fast:?}");
    assert!(noise_share <= 0.014, "{noise_share}");
    // The rule is not slower than necessary: some sheet reaches the limit.
    assert!(fast[1] >= 2.1, "{fast:?}");
}

#[test]
fn delays_and_a_speed_loop_keep_it() {
    let count = if deep() { 400 } else { 40 };
    for ticks in [1, 2, 3] {
        let Found { quiet, fast, .. } = worst(count, &[STANDARD, &format!("drive.delay_ticks={ticks}")]);
        assert!(quiet[0] <= 1.55 && fast[0] <= 2.0 && fast[1] <= 2.2, "{ticks}: {quiet:?} {fast:?}");
    }
    let turning = "reference={kind=\"speed\", speed_rad_s=1}";
    let Found { quiet, fast, .. } = worst(count, &[STANDARD, "drive.mode=\"speed\"", turning]);
    assert!(quiet[0] <= 1.6 && fast[0] <= 2.0 && fast[1] <= 2.2, "{quiet:?} {fast:?}");
}

/// Declared noise of 1e-6 to 0.03 rad, coarser or finer than the quantisation: the current noise stays within its
/// share, and the margins are unchanged.
#[test]
fn declared_noise_keeps_both_rules_within_its_share() {
    let noisy = |k: usize| {
        let noise_rad = 1e-6 * 3e4_f64.powf(((k + 1) as f64 * 0.725_244_5).fract());
        sheet(k).into_iter().chain([format!("encoder.noise_rad={noise_rad:e}")]).collect()
    };
    let count = if deep() { 2000 } else { 80 };
    let Found { quiet, fast, noise_share } = worst_of(count, &[STANDARD], noisy);
    assert!(quiet[0] <= 1.55 && fast[0] <= 2.0 && fast[1] <= 2.2, "{quiet:?} {fast:?}");
    assert!((0.009..0.0105).contains(&noise_share), "{noise_share}");
    let Found { quiet, fast, noise_share } = worst_of(count, &["drive.margin=\"fast\""], noisy);
    assert!(quiet[0] <= 2.25 && fast[0] <= 2.7 && fast[1] <= 4.2, "{quiet:?} {fast:?}");
    assert!((0.009..0.0105).contains(&noise_share), "{noise_share}");
}

/// For every rule, period and encoder no gain set is unstable in a corner of the data sheet. The peaks are larger with
/// 50 % and with four observer states.
#[test]
fn no_design_by_rule_is_unstable_in_its_corners() {
    let count = if deep() { 2000 } else { 60 };
    for margin in ["drive.margin=\"fast\"", STANDARD] {
        for more in [&[][..], &["drive.uncertain_percent=50"], &["drive.observer_states=4"], &["drive.delay_ticks=3"]] {
            let Found { quiet, fast, .. } = worst(count, &[&[margin], more].concat());
            assert!(quiet[1].is_finite() && fast[1].is_finite(), "{margin} {more:?}: {quiet:?} {fast:?}");
        }
    }
}

/// A requested peak is found from the pulse response; this test checks it with the matrices of the loop.
#[test]
fn a_peak_that_is_asked_for_is_got() {
    for asked in [1.3, 1.5, 1.7] {
        for more in [&[][..], &["encoder.bits=11"], &["drive.delay_ticks=2"], &["motor.current_lag_s=1e-3"]] {
            let sets: Vec<String> = more.iter().map(ToString::to_string).collect();
            let got = designed(&[&sets[..], &[format!("drive.margin={asked}")]].concat());
            let peak = got.got.margins.map(|margins| margins.sensitivity_peak).expect("stable");
            assert!((peak - asked).abs() < 2e-3, "{asked} {more:?}: {peak}");
        }
    }
    // A peak above the largest one of any rule gives the fast rule.
    let [most, fast] = ["3.0", "\"fast\""].map(|margin| designed(&[format!("drive.margin={margin}")]));
    let [most, fast] = [most, fast].map(|design| design.got.margins.expect("stable").sensitivity_peak);
    assert!((most / fast - 1.0).abs() < 1e-3, "{most} {fast}");
}
