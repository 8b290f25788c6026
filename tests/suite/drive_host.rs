//! Motor and joint drives designed from data sheet numbers alone, run through `host-sim`.
//!
//! The thresholds are the results of an independent implementation, f64, on its own plant, times 1.5 (noise: 2). The
//! motor: 2e-4 kg m², 0.05 N m/A, 10 A, friction 0.005 and 0.008 N m, cogging 0.003 N m, lag 0.2 ms, two gain sets.

use std::ops::ControlFlow;

use controller_core::Limits;
use controller_core::drive::{Encoder, Motor, MotorDesign};
use integration_tests::data;
use loop_sim::metrics::{self, Metrics, Noise, Tracking};
use loop_sim::plant::{self, Friction, Imperfections, Shaft};
use loop_sim::sensor::encoder::Mounted;
use loop_sim::signal::{Signal, Term};
use loop_sim::solver;
use loop_sim::trace::Trace;
use scenario::{Experiment, JOINT, MOTOR, Source, parse};

struct Run {
    experiment: Experiment,
    trace: Trace,
    metrics: Metrics,
    tracking: Tracking,
    noise: Option<Noise>,
}

fn run(text: &str, sets: &[&str]) -> Run {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let mut experiment =
        parse(&Source { file: "file.toml", text, sets: &sets }, "file").unwrap_or_else(|error| panic!("{error}"));
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    assert_eq!(error, None, "{sets:?}");
    let metrics = experiment.metrics(&trace);
    let tracking = experiment.tracking(&trace).expect("a reference");
    let noise = experiment.noise(&trace);
    Run { experiment, trace, metrics, tracking, noise }
}

/// One table row: bits and period, then noise while moving, S rms and peak, M in 0.1 s and 0.3 s, L.
fn figures_of(bits: u32, period_s: f64, bars: [f64; 6], more: &[&str]) {
    let (bits, period) = (format!("encoder.bits={bits}"), format!("drive.period_s={period_s}"));
    let with = |sets: &[&str]| run(MOTOR, &[&[bits.as_str(), &period], more, sets].concat());
    let second_half = with(&["window_s=[1, 2]"]);
    let sine = with(&[]);
    let moved = |duration: &str| {
        let reference = format!("reference={{kind = \"move\", to_rad = 1, start_s = 0.05, duration_s = {duration}}}");
        with(&[&reference, "span_s=0.8"])
    };
    let moves = ["0.1", "0.3"].map(moved);
    let load = with(&["reference={}", "load=[{kind = \"step\", amplitude = 0.1, t0_s = 0.5}]", "span_s=1"]);
    let noise = second_half.noise.expect("a finer encoder").moving;
    let rms = second_half.tracking.error_rms;
    let [fast, slow] = moves.each_ref().map(|run| run.metrics.y_ultimate);
    let found = [noise, rms, sine.metrics.y_ultimate, fast, slow, load.metrics.y_ultimate];
    println!("{bits}, {period}: noise, S rms, peak, M .1, .3, L {found:.5?} of {bars:.5?}");
    for (k, (found, bar)) in found.into_iter().zip(bars).enumerate() {
        let times = if k == 0 { 2.0 } else { 1.5 };
        assert!(found <= times * bar, "figure {k} of {bits}, {period}: {found:.2e}, {times} times {bar:e} allowed");
    }
    let resting = with(&["reference={}", "motor.start_rad=0.3", "window_s=[1, 2]"]);
    let rest = resting.noise.expect("a finer encoder").at_rest;
    assert!(rest < 0.002, "noise at rest {rest:e} A");
    assert!(moves.iter().chain([&sine, &load]).all(|run| run.metrics.bounded && run.tracking.saturated_share == 0.0));
}

#[test]
fn a_motor_with_14_bits_at_1_khz_has_its_figures() {
    figures_of(14, 1e-3, [0.068, 3.7e-4, 2.1e-3, 1.2e-3, 1.1e-3, 7.7e-3], &[]);
}

#[test]
fn a_motor_with_16_bits_at_10_khz_has_its_figures() {
    figures_of(16, 1e-4, [0.032, 4.6e-5, 4.4e-4, 2.7e-4, 2.4e-4, 2.4e-3], &[]);
}

/// Worst of four corners with J and K_t off by 20 %: S rms, M, L.
#[test]
fn a_motor_that_is_20_percent_off_its_data_sheet_has_its_figures() {
    let mut worst = [0.0_f64; 3];
    for inertia in ["-20", "20"] {
        for torque in ["-20", "20"] {
            let errors = [format!("error.inertia_percent={inertia}"), format!("error.torque_percent={torque}")];
            let with = |sets: &[&str]| run(MOTOR, &[&[errors[0].as_str(), &errors[1]], sets].concat());
            let reference = "reference={kind = \"move\", to_rad = 1, start_s = 0.05, duration_s = 0.1}";
            let load = "load=[{kind = \"step\", amplitude = 0.1, t0_s = 0.5}]";
            let found = [
                with(&["window_s=[1, 2]"]).tracking.error_rms,
                with(&[reference, "span_s=0.8"]).metrics.y_ultimate,
                with(&["reference={}", load, "span_s=1"]).metrics.y_ultimate,
            ];
            for (worst, found) in worst.iter_mut().zip(found) {
                *worst = worst.max(found);
            }
        }
    }
    println!("S, M, L {worst:.5?}");
    let bars = [4.7e-4, 5.6e-3, 9.6e-3];
    assert!(worst.iter().zip(bars).all(|(worst, bar)| *worst <= 1.5 * bar), "{worst:?} of {bars:?}");
}

/// The joint of the paper without its disturbance, two encoders of 20 bits, 1 kHz.
#[test]
fn a_joint_has_its_figures() {
    let moved = run(JOINT, &["load=[]"]);
    let loaded = run(JOINT, &["window_s=[1.9, 3]"]);
    let noise = moved.noise.expect("finer encoders");
    println!("M {:.2e}, L {:.2e}, {noise:.5?}", moved.metrics.y_ultimate, loaded.metrics.y_ultimate);
    assert!(moved.metrics.y_ultimate <= 2e-5, "{:e}", moved.metrics.y_ultimate);
    assert!(loaded.metrics.y_ultimate <= 1.6e-3, "{:e}", loaded.metrics.y_ultimate);
    assert!(noise.moving <= 0.015 && noise.at_rest <= 0.015, "{noise:?}");
    // Friction of the motor, cogging and ripple: 1.5, 1.0 and 0.3 A of 0.119 N m/A; sine of 0.5 rad, 1 rad/s.
    let friction = "friction={static_n_m = 0.1785, coulomb_n_m = 0.119, stribeck_rad_s = 0.05, smooth_rad_s = 0.005, \
                    cogging_n_m = 0.0357, cogging_per_turn = 24, ripple_percent = 2, ripple_per_turn = 42}";
    let sine = "reference={kind = \"sine\", amplitude_rad = 0.5, frequency_hz = 0.15915494, duration_s = 1}";
    let found = run(JOINT, &["load=[]", friction, sine, "span_s=6", "window_s=[3, 6]"]);
    println!("S with friction {:.2e}", found.tracking.error_rms);
    assert!(found.tracking.error_rms <= 1.2e-5, "{:e}", found.tracking.error_rms);
}

/// A move under friction of 0.02 and 0.03 N m; evaluated from 3 s on. An independent rig at standstill had a permanent
/// error of 1.45 mrad with 14 bits and 0.8 urad with 20. With smoothed friction the shaft creeps about its target.
#[test]
fn with_friction_that_holds_14_bits_hunt_and_20_rest() {
    let friction = "friction={coulomb_n_m = 0.02, static_n_m = 0.03, model = \"holds\"}";
    let move_there = "reference={kind = \"move\", to_rad = 1, start_s = 0.1, duration_s = 0.5}";
    let peak = |more: &[&str]| {
        let sets = [friction, move_there, "span_s=6", "window_s=[3, 6]", "load=[]", "drive.rest_band='off'"];
        let sets = [&sets[..], more].concat();
        let error = run(MOTOR, &sets).metrics.y_ultimate;
        println!("{more:?}: {error:.2e} rad");
        error
    };
    let (coarse, fine) = (peak(&["encoder.bits=14"]), peak(&["encoder.bits=20"]));
    let faded = peak(&["encoder.bits=20", "friction.model='faded'"]);
    assert!((0.7e-3..2.9e-3).contains(&coarse) && fine < 4e-6, "{coarse:e} {fine:e}");
    assert!(faded > 10.0 * fine, "{faded:e}");
}

/// Returns a pseudo-random number in 0 to 1 that depends on the seed alone (Knuth's multiplier).
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1_u64 << 53) as f64
}

/// Motors over decades of size, J and K_t off by ±20 %, friction of some percent of their torque. With the gains by
/// rule and no tuning they settle on a move.
#[test]
fn motors_that_nobody_tuned_for_settle_on_a_move_with_the_gains_of_the_rule() {
    let mut state = 2024;
    for case in 0..20 {
        let mut decades = |low: f64, high: f64| low * (high / low).powf(uniform(&mut state));
        let inertia = decades(1e-7, 1.0);
        let limit = decades(0.5, 50.0);
        // Accelerations from 50 to 2e4 rad/s².
        let torque = decades(50.0, 2e4) * inertia / limit;
        let bits = decades(11.0, 20.99) as u32;
        let period_s = decades(5e-5, 2e-3);
        let friction = decades(1e-4, 2e-2) * torque * limit;
        let mut off = || if uniform(&mut state) < 0.5 { -20 } else { 20 };
        let errors = [off(), off()];

        let motor = Motor { inertia_kg_m2: inertia, torque_n_m_per_a: torque, damping_n_m_s: 0.0 };
        let encoder = Encoder::absolute(bits);
        let design = MotorDesign::by_rule(period_s, motor, encoder, Limits::symmetric(limit));
        // Shortest move that stays within 90 % of the limit for a motor whose J and K_t are both off by 20 %.
        let tau = (10.0 / 3.0_f64.sqrt() / (0.6 * motor.input_gain() * limit)).sqrt().max(20.0 * period_s);
        let settled = tau + 40.0 / design.bandwidths.surface_rad_s;
        let span = 0.02 + settled + 20.0 / design.bandwidths.surface_rad_s;
        let text = format!(
            "span_s = {span}\nwindow_s = [{from}, {span}]\n[motor]\ninertia_kg_m2 = {inertia}\n\
             torque_n_m_per_a = {torque}\nmax_current_a = {limit}\n[encoder]\nbits = {bits}\n[drive]\n\
             period_s = {period_s}\n[reference]\nkind = \"move\"\nto_rad = 1.0\nstart_s = 0.02\n\
             [friction]\ncoulomb_n_m = {friction}\n[error]\ninertia_percent = {}\ntorque_percent = {}\n",
            errors[0],
            errors[1],
            from = 0.02 + settled,
        );
        let found = run(&text, &[]);
        // Offset from friction, plus encoder counts.
        let w_c = design.bandwidths.surface_rad_s;
        let held = friction / inertia / (w_c * w_c);
        let allowed = 0.1 * held + 3.0 * encoder.unit_rad();
        let Metrics { y_ultimate, bounded, .. } = found.metrics;
        println!(
            "{case}: {inertia:.1e} kg m², {:.1e} rad/s², {bits} bits, {period_s:.1e} s, w_c {w_c:.0}: {y_ultimate:.1e} \
             of {allowed:.1e} rad",
            motor.input_gain() * limit
        );
        assert!(bounded && y_ultimate <= allowed, "case {case}: {y_ultimate:e} of {allowed:e}\n{text}");
        let last = found.trace.rows.last().expect("rows");
        assert!(last.u_held.abs() < 0.1 * limit, "case {case}: {last:?}");
    }
}

#[test]
fn faults_of_the_encoder_cost_what_they_must() {
    // The start position within one encoder count changes the peak by 7 % with friction, so the mean of four starts
    // counts.
    let peak = |set: &str| {
        let starts = ["0.0", "1e-4", "2e-4", "3e-4"].map(|start| format!("motor.start_rad={start}"));
        let all = starts.map(|start| run(MOTOR, &[set, &start]).metrics);
        let mean = |of: fn(&Metrics) -> f64| all.iter().map(of).sum::<f64>() / 4.0;
        (mean(|found| found.y_ultimate), mean(|found| found.u_peak))
    };
    let plain = peak("fault=[]");
    // 5 ms without a count are not visible next to the friction. In 20 ms at 1 revolution per s the unobserved cogging
    // moves the shaft by at most twice the effect of its amplitude.
    let moved = 0.003 / 2e-4 * 0.02_f64.powi(2);
    for (lost, allowed) in [("0.005", 1.04 * plain.0), ("0.02", plain.0 + moved)] {
        let found = peak(&format!("fault=[{{kind = \"lost\", at_s = 0.5, for_s = {lost}}}]"));
        println!("{lost} s lost: {found:.2?} of {plain:.2?}");
        assert!(found.0 <= allowed, "{lost} s lost: {found:?} of {plain:?}");
    }
    // The innovation gate rejects one outlier completely. Without it the current would reach its limit of 10 A. The
    // exact size where the shaft turns and friction breaks away depends on one encoder count more or less.
    let wild = peak("fault=[{kind = \"jump\", counts = 5000, at_s = 0.5, for_s = 0.001}]");
    assert!(wild.0 < 1.05 * plain.0 && wild.1 < 1.0 && plain.1 < 1.0, "{wild:?} of {plain:?}");
    // A frozen encoder runs away, because there is no monitor; the results show it.
    let stuck = run(MOTOR, &["fault=[{kind = \"stuck\", at_s = 0.5}]"]);
    assert!(stuck.metrics.y_ultimate > 1.0, "{:?}", stuck.metrics);
}

/// The recorded currents of another implementation move this motor as they moved its own motor. The counts agree,
/// except for those on the edge between two counts.
#[test]
fn the_true_motor_moves_as_that_of_the_records() {
    let friction = Friction { static_n_m: 0.008, coulomb_n_m: 0.005, ..Friction::default() };
    let imperfections =
        Imperfections { friction, cogging_n_m: 0.003, cogging_per_turn: 7.0, lag_s: 2e-4, ..Imperfections::default() };
    let step = |amplitude, t0_s| Signal::new(vec![Term::Step { amplitude, t0_s }]);
    let cases = [
        ("move_load_14bit", 1e-3, 14, 1e-5, step(0.1, 0.5)),
        ("sine_20bit_two_sets_lost", 1e-3, 20, 1e-5, Signal::default()),
        ("turns_wrap_delay_12bit", 1e-3, 12, 1e-5, Signal::default()),
        ("speed_loop_fine_16bit", 1e-4, 16, 2e-5, step(0.05, 0.05)),
    ];
    for (name, period_s, bits, damping_n_m_s, load) in cases {
        let shaft = Shaft { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s };
        let motor = plant::Motor::new(shaft, shaft, imperfections, load);
        let mounted = Mounted::new(Encoder::absolute(bits));
        let rows = data::columns(&format!("motor_{name}.csv"), ["count", "u_applied"]);
        let (mut x, mut worst, span) = ([0.0; 3], 0.0_f64, f64::from(1 << bits));
        for (k, [count, u]) in rows.iter().enumerate() {
            let off = mounted.count(x[0]) - count;
            worst = worst.max((off - span * (off / span).round()).abs() * mounted.encoder.unit_rad());
            let [from, to] = [k, k + 1].map(|k| k as f64 * period_s);
            solver::advance(&motor, from, to, *u, &mut x).expect("a plant that can be integrated");
        }
        println!("{name}: {:.1} steps, {worst:.1e} rad", worst / mounted.encoder.unit_rad());
        // One count, plus the difference between two solvers at the unresolved friction edge.
        assert!(worst <= 1.01 * mounted.encoder.unit_rad() + 2e-5, "{name}: {worst:e} rad");
    }
}

/// The load estimate is within 10 % after 22 ms (14 bits at 1 kHz) and 10 ms (16 bits at 10 kHz).
#[test]
fn a_load_is_known_soon() {
    for (bits, period_s, known_s) in [(14, 1e-3, 0.033), (16, 1e-4, 0.015)] {
        let (bits, period) = (format!("encoder.bits={bits}"), format!("drive.period_s={period_s}"));
        let load = "load=[{kind = \"step\", amplitude = 0.1, t0_s = 0.5}]";
        let found = run(MOTOR, &[&bits, &period, load, "reference={}", "friction={}", "span_s=1"]);
        let inertia = found.experiment.drive.as_ref().expect("a drive").shafts[0].inertia_kg_m2;
        let off = metrics::ultimate(&found.trace, [0.5 + known_s, 1.0], |row| inertia * row.d_hat[1] + 0.1);
        assert!(off <= 0.01, "{bits}: {off} N m");
    }
}
