//! Drive of a motor with friction, cogging and a lagging current loop, with bandwidths by rule and without tuning.
//!
//! The thresholds are 1.5 times (noise: twice) the results of another implementation of the controller and the plant.

use controller_core::drive::{
    DriveEstimates, Encoder, Hold, Motor, MotorBandwidths, MotorDesign, MotorDrive, Position, Sample, Speed, Target,
};
use controller_core::{Health, Limits, Running};
use integration_tests::data;
use integration_tests::drive::{
    AtOnce as _, LinearLaw, Run, Shaft, Trace, blended_sine, peak, point_to_point, rms, run_motor,
};
use integration_tests::sampled;
use integration_tests::strategy::Rng;
use integration_tests::with_delay;
use std::f64::consts::TAU;

const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };

fn by_rule(period_s: f64, bits: u32) -> MotorDesign {
    MotorDesign::by_rule(period_s, MOTOR, Encoder::absolute(bits), Limits::symmetric(10.0))
}

/// Returns a plant with relative errors of J, K_t, B.
fn off(shaft: Shaft, [inertia, torque, damping]: [f64; 3]) -> Shaft {
    Shaft {
        inertia: shaft.inertia * (1.0 + inertia),
        torque: shaft.torque * (1.0 + torque),
        damping: shaft.damping * (1.0 + damping),
        ..shaft
    }
}

/// The counter may be anywhere at a start, and when counts return after a gap: many revolutions away, on both sides,
/// and up to its half range.
#[test]
fn a_drive_starts_where_its_counter_is() {
    let motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
    for encoder in [Encoder::incremental(32, 4000), Encoder::incremental(24, 4096), Encoder::incremental(20, 2500)] {
        let design = MotorDesign::by_rule(1e-3, motor, encoder, Limits::symmetric(10.0));
        let law = MotorDrive::<f32, Position, 1>::try_design(&design).expect("a good design");
        let half = ((1_i64 << (encoder.bits - 1)) - 1) as i32;
        for count in [0, 3000, -3000, 16_385, 20_000, -20_001, 400_123, -400_123, half, -half] {
            let angle = f64::from(count) * encoder.unit_rad();
            let turn = (angle / TAU).round();
            let rest = Target { turn: turn as i32, jet: [(angle - TAU * turn) as f32, 0.0] };
            let sample = |counts| Sample { counts, begin: rest, end: rest };
            let mut running = Running::new(&law);
            let reckoned = |running: &Running<_>| {
                let known: DriveEstimates<f32, i32, 1> = running.estimates().expect("it runs");
                TAU * f64::from(known.turn) + f64::from(known.position[0])
            };
            for tick in 0..20 {
                let output = running.tick_at_once(&sample([Some(count)]));
                let off = reckoned(&running) - angle;
                assert!(
                    off.abs() < 1e-5 && output.u.abs() < 1e-2,
                    "{encoder:?} at {count}, tick {tick}: {off}, {output:?}"
                );
            }
            // The gap is longer than the drive bridges, and the shaft is elsewhere afterwards.
            for _ in 0..200 {
                running.lost();
            }
            let gone = if count > 0 { -30_000 } else { 30_000 };
            let (away, there, mut counted) = (count + gone, angle + f64::from(gone) * encoder.unit_rad(), 0.0);
            for _ in 0..3 {
                running.tick_at_once(&sample([Some(away)]));
                counted = reckoned(&running) - there;
            }
            // Meanwhile the drive moves back; a base is 1.5 rad or more.
            assert!(counted.abs() < 1e-2, "{encoder:?} at {away} after a gap: {counted}");
        }
    }
}

/// Runs the drive on the counts of its encoder for `span_s` seconds.
fn run<const FAST: usize>(design: &MotorDesign, shaft: Shaft, span_s: f64, plan: &dyn Fn(f64) -> [f64; 2]) -> Trace {
    let law = MotorDrive::<f32, Position, FAST>::try_design(design).expect("a good design");
    let (period_s, bits) = (design.period_s, design.encoder.bits);
    let run = Run { period_s, bits, ticks: (span_s / period_s).round() as u32, delay: 0 };
    run_motor(law, shaft, run, plan, |_, _, _| ())
}

fn second_half(values: &[f64]) -> &[f64] {
    &values[values.len() / 2..]
}

/// Returns four errors. Sine of 1 rad and 1 Hz: rms of the second half, and peak. Move of 1 rad, degree 7, in 0.1 s:
/// peak. Load of 0.1 N m: peak.
fn figures<const FAST: usize>(design: &MotorDesign, shaft: Shaft) -> [f64; 4] {
    let sine = run::<FAST>(design, shaft, 2.0, &blended_sine(1.0, TAU, 0.25));
    let moved = run::<FAST>(design, shaft, 0.3, &point_to_point(1.0, 0.05, 0.1, 7));
    let load = run::<FAST>(design, Shaft { load: [0.1, 0.1], ..shaft }, 0.4, &|_| [0.0; 2]);
    [rms(second_half(&sine.error)), peak(&sine.error), peak(&moved.error), peak(&load.error)]
}

fn worst<const FAST: usize>(design: &MotorDesign, corners: &[[f64; 3]]) -> [f64; 4] {
    let all = corners.iter().map(|&corner| figures::<FAST>(design, off(Shaft::ROUGH, corner)));
    all.fold([0.0; 4], |worst, found| core::array::from_fn(|k| f64::max(worst[k], found[k])))
}

fn corners(size: f64) -> Vec<[f64; 3]> {
    let signs = |k: u32| core::array::from_fn(|j| if k >> j & 1 == 0 { size } else { -size });
    (0..8).map(signs).collect()
}

/// Bits, T, and results.
type Line = (u32, f64, [f64; 4], [f64; 3], [f64; 3]);

/// (bits, T): values of S rms, S peak, M, L with two sets; S rms, M, L at ±20 %; the same at ±50 % with one set.
const TABLE: [Line; 4] = [
    (12, 1e-3, [8.3e-4, 3.6e-3, 2.4e-3, 1.8e-2], [1.2e-3, 1.7e-2, 2.2e-2], [3.8e-3, 0.35, 7.1e-2]),
    (14, 1e-3, [3.7e-4, 2.1e-3, 1.2e-3, 7.7e-3], [4.7e-4, 5.6e-3, 9.6e-3], [1.4e-3, 0.22, 4.4e-2]),
    (16, 1e-4, [4.6e-5, 4.4e-4, 2.7e-4, 2.4e-3], [6.5e-5, 1.1e-3, 2.8e-3], [2.0e-4, 7.4e-3, 8.1e-3]),
    (20, 1e-4, [2.8e-5, 2.4e-4, 1.8e-4, 1.5e-3], [3.5e-5, 4.3e-4, 1.9e-3], [2.0e-4, 7.4e-3, 8.0e-3]),
];

#[test]
fn figures_on_a_rough_motor_are_those_of_the_table() {
    for (bits, period_s, nominal, _, _) in TABLE {
        let found = figures::<1>(&by_rule(period_s, bits), Shaft::ROUGH);
        println!(
            "{bits} bits, {period_s} s: {found:.2?} for {nominal:.2?}",
            found = found.map(Sci),
            nominal = nominal.map(Sci)
        );
        for (found, value) in found.into_iter().zip(nominal) {
            assert!(found <= 1.5 * value, "{bits} bits: {found:e} for {value:e}");
        }
    }
}

#[test]
fn figures_of_a_wrong_model_are_those_of_the_table() {
    for (bits, period_s, _, at_20, at_50) in TABLE {
        let design = by_rule(period_s, bits);
        let [s, _, m, l] = worst::<1>(&design, &corners(0.2));
        let [s_50, _, m_50, l_50] = worst::<0>(&design, &corners(0.5));
        println!("{bits} bits: {:?}, {:?}", [s, m, l].map(Sci), [s_50, m_50, l_50].map(Sci));
        for (found, value) in [s, m, l, s_50, m_50, l_50].into_iter().zip(at_20.into_iter().chain(at_50)) {
            assert!(found <= 1.5 * value, "{bits} bits: {found:e} for {value:e}");
        }
    }
}

/// A number in a table.
#[derive(Clone, Copy)]
struct Sci(f64);

impl std::fmt::Debug for Sci {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.1e}", self.0)
    }
}

/// Current noise: the difference between u from counts and u from positions of 24 bits, with equal thresholds in rad.
#[test]
fn noise_of_the_current_is_what_the_rule_allows() {
    for (bits, period_s, moving, rest) in
        [(12, 1e-3, 0.118, 0.04), (14, 1e-3, 0.068, 0.01), (16, 1e-4, 0.032, 2e-3), (20, 1e-4, 0.009, 1e-3)]
    {
        let coarse = by_rule(period_s, bits);
        let finer = f64::from(1_u32 << (24 - bits));
        let mut fine = MotorDesign { encoder: Encoder::absolute(24), ..coarse };
        fine.gate_steps *= finer;
        fine.switching.calm_steps *= finer;
        fine.switching.alert_steps *= finer;
        let sine = blended_sine(1.0, TAU, 0.25);
        let [a, b] = [coarse, fine].map(|design| run::<1>(&design, Shaft::ROUGH, 2.0, &sine).u);
        let noise = rms(&second_half(&a).iter().zip(second_half(&b)).map(|(a, b)| a - b).collect::<Vec<_>>());
        let mut hunting = 0.0_f64;
        for target in [0.1, 0.3, 0.5, 0.7, 1.0] {
            // Between two counts the shaft would oscillate: the loop integrates, and friction holds the shaft.
            let unit = coarse.encoder.unit_rad();
            let target = (target / unit).round() * unit;
            let still = run::<1>(&coarse, Shaft::ROUGH, 2.0, &point_to_point(target, 0.05, 0.1, 7));
            let late = second_half(&still.u);
            // The shaft creeps in the friction; noise is the change per tick.
            let one = rms(&late.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>()) / 2.0_f64.sqrt();
            hunting = hunting.max(one);
        }
        println!("{bits} bits: noise {noise:.3} A moving, {hunting:.1e} A at rest");
        assert!(noise <= 2.0 * moving && hunting <= rest, "{bits} bits: {noise} A, {hunting} A");
    }
}

/// J, K_t, B at ±50 % and between, with 0 to 3 ticks of delay and one gain set. An offset of 0.01 rad decays within 150
/// time constants of the surface (with a third of the gain the loop is slow).
#[test]
fn corners_of_the_motor_are_stable() {
    let mut rng = Rng::new(0x50C);
    let mut errors = corners(0.5);
    errors.extend((0..60).map(|_| core::array::from_fn(|_| rng.within(-0.5, 0.5))));
    let mut worst = 0.0_f64;
    for (bits, period_s) in [(12, 1e-3), (20, 1e-3), (14, 5e-4), (16, 1e-4)] {
        for lag_s in [0.0, 2e-4] {
            for &corner in sampled(&errors, 5) {
                let shaft = Shaft { x: [0.01, 0.0, 0.0], lag_s, ..off(Shaft::CLEAN, corner) };
                for delay in 0..=3 {
                    let mut design = by_rule(period_s, bits).with_lag(lag_s, delay);
                    design.encoder = Encoder::absolute(24);
                    design.gate_steps = f64::INFINITY;
                    let ticks = (150.0 / (design.bandwidths.surface_rad_s * period_s)) as u32;
                    let run = Run { period_s, bits: 24, ticks, delay };
                    let still = |_: f64| [0.0; 2];
                    let error = with_delay!(delay, LATE => {
                        let law = MotorDrive::<f32, Position, 0, LATE>::try_design(&design).expect("a good design");
                        run_motor(law, shaft, run, &still, |_, _, _| ()).error
                    });
                    let last = peak(&error[error.len() - error.len() / 20..]);
                    worst = worst.max(last);
                    assert!(last <= 5e-5, "{bits} bits, {period_s} s, {delay} late, {corner:?}: {last:e}");
                }
            }
        }
    }
    println!("at most {worst:.1e} rad are left of 0.01");
}

/// Counts the errors of J, K_t, B whose sampled loop with one gain set has a spectral radius of 1 or more. Also returns
/// the largest radius.
fn unstable<const LATE: usize, const S: usize>(design: &MotorDesign, lag_s: f64, errors: &[[f64; 3]]) -> (usize, f64) {
    let encoder = Encoder::absolute(24);
    let design = MotorDesign { gate_steps: f64::INFINITY, limits: Limits::symmetric(1e9), encoder, ..*design };
    let law = MotorDrive::<f64, Position, 0, LATE, S>::try_design(&design).expect("a good design");
    let law = LinearLaw::of(&law, encoder.unit_rad());
    let radii = errors.iter().map(|&errors| {
        let advance = |x, u| {
            let mut shaft = Shaft { x, lag_s, ..off(Shaft::CLEAN, errors) };
            shaft.advance(0.0, u, design.period_s);
            // Without a lag the current is not a state.
            if lag_s > 0.0 { shaft.x } else { [shaft.x[0], shaft.x[1], 0.0] }
        };
        law.spectral_radius(LATE, advance, |x| [x[0]])
    });
    radii.fold((0, 0.0), |(count, largest), radius| (count + usize::from(radius >= 1.0), f64::max(largest, radius)))
}

/// w_c of the rule: at 1 ms 94 rad/s with 12 bits and 125 rad/s with 14 bits and more; 182 at 0.5 ms; 286 at 0.1 ms.
#[test]
fn bandwidths_by_rule_are_the_known_ones() {
    for (bits, period_s, known) in [
        (12, 1e-3, 94.0),
        (14, 1e-3, 125.0),
        (20, 1e-3, 125.0),
        (14, 5e-4, 182.0),
        (16, 1e-4, 286.0),
        (20, 1e-4, 286.0),
    ] {
        let found = by_rule(period_s, bits).bandwidths.surface_rad_s;
        assert!((found - known).abs() <= 0.5, "{bits} bits, {period_s} s: {found}");
    }
}

/// 12 to 20 bits, 1, 0.5 and 0.1 ms, with no lag and 0.2 ms, with and without a tick of delay. With one gain set every
/// loop near rest is stable, at J and K_t off by ±50 % (nine points) and at random errors. The high gains alone are
/// stable at ±20 %. The test also confirms two limitations. The high gains are not stable at ±50 %, and a fourth
/// observer state is not stable at a third of the gain.
#[test]
fn the_rule_is_stable_in_all_48_combinations() {
    let mut rng = Rng::new(0x48);
    let [mut combinations, mut fast_at_50, mut less_fast_at_50, mut four_states] = [0; 4];
    let mut largest = [0.0_f64; 3];
    for (bits, period_s) in [12, 14, 16, 20].into_iter().flat_map(|bits| [1e-3, 5e-4, 1e-4].map(|t| (bits, t))) {
        for (lag_s, delay) in [(0.0, 0), (2e-4, 0), (0.0, 1), (2e-4, 1)] {
            let design = by_rule(period_s, bits).with_lag(lag_s, delay);
            let faster = |ratio: f64| {
                let mut fast = design;
                fast.bandwidths.observer_rad_s *= ratio;
                fast
            };
            let grows = |design: &MotorDesign, errors: &[[f64; 3]]| match delay {
                0 => unstable::<0, 3>(design, lag_s, errors),
                _ => unstable::<1, 3>(design, lag_s, errors),
            };
            let random: Vec<[f64; 3]> = (0..20).map(|_| core::array::from_fn(|_| rng.within(-0.5, 0.5))).collect();
            let found = [(&design, grid(0.5)), (&design, random), (&faster(2.0), grid(0.2))];
            for ((design, errors), largest) in found.into_iter().zip(&mut largest) {
                let (count, radius) = grows(design, &errors);
                assert_eq!(count, 0, "{bits} bits, {period_s} s, lag {lag_s} s, {delay} late: {radius}");
                *largest = largest.max(radius);
            }
            let third = [[0.5, -0.5, 0.0]];
            let (four, _) = match delay {
                0 => unstable::<0, 4>(&design, lag_s, &third),
                _ => unstable::<1, 4>(&design, lag_s, &third),
            };
            combinations += 1;
            fast_at_50 += usize::from(grows(&faster(2.0), &grid(0.5)).0 > 0);
            less_fast_at_50 += usize::from(grows(&faster(1.5), &grid(0.5)).0 > 0);
            four_states += four;
        }
    }
    println!("largest spectral radius at 50 %, at random, of the high gains at 20 %: {largest:.5?}");
    println!("unstable at 50 %: high gains {fast_at_50}, 1.5 times {less_fast_at_50}, four states {four_states}");
    assert_eq!((combinations, less_fast_at_50, four_states), (48, 22, 48));
    assert!(fast_at_50 > 22, "{fast_at_50}");
}

/// Two and three ticks of delay: every loop near rest is stable, at J and K_t off by ±50 % with one gain set. The high
/// gains alone and four states are stable at ±20 %.
#[test]
fn the_rule_is_stable_with_two_and_three_ticks_of_delay() {
    let mut largest = [[0.0_f64; 3]; 2];
    for (bits, period_s) in [12, 14, 16, 20].into_iter().flat_map(|bits| [1e-3, 5e-4, 1e-4].map(|t| (bits, t))) {
        for (lag_s, delay) in [(0.0, 2), (2e-4, 2), (0.0, 3), (2e-4, 3)] {
            let design = by_rule(period_s, bits).with_lag(lag_s, delay);
            let mut fast = design;
            fast.bandwidths.observer_rad_s *= 2.0;
            let found = with_delay!(delay, LATE => [
                unstable::<LATE, 3>(&design, lag_s, &grid(0.5)),
                unstable::<LATE, 3>(&fast, lag_s, &grid(0.2)),
                unstable::<LATE, 4>(&design, lag_s, &grid(0.2)),
            ]);
            for ((count, radius), largest) in found.into_iter().zip(&mut largest[delay as usize - 2]) {
                assert_eq!(count, 0, "{bits} bits, {period_s} s, lag {lag_s} s, {delay} late: {radius}");
                *largest = largest.max(radius);
            }
        }
    }
    println!("largest radius at 50 %, of the high gains and of four states at 20 %, with 2 and 3 ticks: {largest:.5?}");
}

/// Returns relative errors of J and K_t on a grid of nine points.
fn grid(size: f64) -> Vec<[f64; 3]> {
    let steps = [-size, 0.0, size];
    steps.into_iter().flat_map(|inertia| steps.map(|torque| [inertia, torque, 0.0])).collect()
}

/// Custom bandwidths, up to the limits of a design, are stable within ±20 % without a current-loop lag, for 0 to 3
/// ticks of delay. With four states and one tick of delay the limit of a design is higher than the stable range; the
/// test stops at 0.3 there.
#[test]
fn up_to_the_limits_the_motor_is_stable() {
    let errors = grid(0.2);
    for (delay, states) in [(0, 3), (1, 3), (2, 3), (3, 3), (0, 4), (1, 4), (2, 4), (3, 4)] {
        let limit = if (delay, states) == (1, 4) { 0.3 } else { MotorDesign::observer_limit(delay, states) };
        let mut largest = 0.0_f64;
        for (share, surface) in [1.0, 0.5, 0.1].into_iter().flat_map(|share| [0.5, 0.2, 0.05].map(|w| (share, w))) {
            for reaching in [1.0, 0.5, 0.3, 0.1] {
                let bandwidths = MotorBandwidths {
                    surface_rad_s: surface * 1e3,
                    observer_rad_s: share * limit * 1e3,
                    reaching_per_s: reaching * 1e3,
                    offset_per_s: 0.5 * surface * 1e3,
                };
                let design = by_rule(1e-3, 20).with_bandwidths(bandwidths);
                let (count, radius) = with_delay!(delay, LATE => if states == 3 {
                    unstable::<LATE, 3>(&design, 0.0, &errors)
                } else {
                    unstable::<LATE, 4>(&design, 0.0, &errors)
                });
                assert_eq!(count, 0, "{delay} late, {states} states, {bandwidths:?}: {radius}");
                largest = largest.max(radius);
            }
        }
        println!("{delay} late, {states} states, w_o T up to {limit}: radius up to {largest:.5}");
        let over = by_rule(1e-3, 20).with_bandwidths(MotorBandwidths {
            observer_rad_s: 1.001 * MotorDesign::observer_limit(delay, states) * 1e3,
            ..by_rule(1e-3, 20).bandwidths
        });
        let error = over.validate(delay, states).expect_err("too fast");
        assert_eq!((error.field, error.nearest()), ("bandwidths.observer_rad_s", error.high));
    }
    let error = by_rule(1e-3, 20).validate(4, 3).expect_err("too late");
    assert_eq!((error.field, error.nearest()), ("delay_ticks", 3.0));
}

/// From 3 rad without a plan, u saturates for many ticks. The loop settles because the observers use the applied
/// current. With the demanded current in its place the loop does not settle.
#[test]
fn an_unplanned_start_settles_because_the_applied_u_is_known() {
    let design = by_rule(1e-3, 14);
    let shaft = Shaft { x: [3.0, 0.0, 0.0], largest_current: 10.0, ..Shaft::ROUGH };
    let known = run::<0>(&design, shaft, 0.6, &|_| [0.0; 2]);
    let settled = known.error.iter().rposition(|error| error.abs() > 0.01).expect("it began at 3 rad") + 1;
    // Without limits of its own the controller assumes that its demand is applied.
    let boundless = MotorDesign { limits: Limits::symmetric(1e9), gate_steps: f64::INFINITY, ..design };
    let last = peak(&run::<0>(&boundless, shaft, 0.6, &|_| [0.0; 2]).error[400..]);
    println!("settled after {settled} ms; told the u asked for: {last:.2} rad after 0.4 s");
    assert!(settled <= 210 && last > 0.1, "{settled} ms, {last} rad");
}

/// 100 revolutions away every result equals the result at the start.
#[test]
fn a_hundred_turns_away_nothing_is_worse() {
    for (bits, period_s) in [(14, 1e-3), (20, 1e-3), (20, 1e-4)] {
        let far = 100.0 * TAU;
        let there = point_to_point::<2>(far, 0.0, 2.0, 7);
        let sine = blended_sine::<2>(1.0, TAU, 0.25);
        let plan = |away: f64| {
            let (there, sine) = (&there, &sine);
            move |t: f64| {
                let ([r, v], [s, w]) = (there(t), sine(t - 2.2));
                let (s, w) = if t > 2.2 { (s, w) } else { (0.0, 0.0) };
                if away > 0.0 { [r + s, v + w] } else { [s, w] }
            }
        };
        let design = by_rule(period_s, bits);
        let late = |trace: &Trace| {
            let from = trace.u.len() * 3 / 4;
            let steps: Vec<f64> = trace.u[from..].windows(2).map(|pair| pair[1] - pair[0]).collect();
            [rms(&trace.error[from..]), rms(&steps)]
        };
        let [near, far] = [0.0, far].map(|away| late(&run::<0>(&design, Shaft::ROUGH, 4.2, &plan(away))));
        println!("{bits} bits, {period_s} s: {:?} at 0, {:?} at 100 turns", near.map(Sci), far.map(Sci));
        assert!(far[0] <= 1.1 * near[0] && far[1] <= 1.1 * near[1], "{bits} bits: {near:?}, {far:?}");
    }
}

/// A load of 0.1 N m at 20 rad/s: dip of the speed, and accuracy of the load estimate.
#[test]
fn the_speed_loop_dips_and_recovers_as_said_and_knows_the_load() {
    for (bits, period_s, dip, back_ms) in [(14, 1e-3, 2.5, 28.0), (16, 1e-4, 1.2, 10.0)] {
        let design = by_rule(period_s, bits);
        let law = MotorDrive::<f32, Speed>::try_design(&design).expect("a good design");
        let ramp = |t: f64| [0.0, 20.0 * integral_free_step(t / 0.05)];
        let run = Run { period_s, bits, ticks: (0.6 / period_s).round() as u32, delay: 0 };
        let shaft = Shaft { load: [0.3, 0.1], ..Shaft::ROUGH };
        let trace = run_motor(law, shaft, run, &ramp, |_, _, _| ());
        let after = (0.3 / period_s).round() as usize;
        let found = peak(&trace.speed_error[after..]);
        let back = trace.speed_error[after..].iter().rposition(|error| error.abs() > 0.2).map_or(0, |k| k + 1);
        let back = back as f64 * period_s * 1e3;
        // At 20 rad/s the Coulomb friction is 0.005 N m and the viscous coefficient 2e-4 N m s/rad.
        let (quiet, loaded) = (trace.load[after - 1], trace.load.last().expect("ticks"));
        println!("{bits} bits: dip {found:.2} rad/s, back after {back:.0} ms, load {quiet:.4} then {loaded:.4} N m");
        assert!(found <= 1.5 * dip && back <= 1.5 * back_ms, "{bits} bits: {found} rad/s, {back} ms");
        assert!((loaded - quiet - 0.1).abs() <= 5e-3 && (quiet - 5e-3).abs() <= 4e-3, "{bits} bits: {quiet}, {loaded}");
    }
}

/// With one tick of delay at 1 ms the rule is slower; that is the price. Looking ahead costs no more than not looking
/// ahead.
#[test]
fn a_tick_of_delay_costs_what_is_said() {
    let design = by_rule(1e-3, 14).with_lag(2e-4, 1);
    let law = MotorDrive::<f32, Position, 0, 1>::try_design(&design).expect("a good design");
    let run = |shaft, ticks, plan: &dyn Fn(f64) -> [f64; 2]| {
        let run = Run { period_s: 1e-3, bits: 14, ticks, delay: 1 };
        peak(&run_motor(law, shaft, run, plan, |_, _, _| ()).error)
    };
    let moved = run(Shaft::ROUGH, 300, &point_to_point(1.0, 0.05, 0.1, 7));
    let load = run(Shaft { load: [0.1, 0.1], ..Shaft::ROUGH }, 500, &|_| [0.0; 2]);
    println!("w_c {:.0}: move {moved:.1e}, load {load:.1e} rad", design.bandwidths.surface_rad_s);
    assert!(moved <= 1.5 * 6.0e-3 && load <= 1.5 * 0.097, "{moved:e}, {load:e}");
}

/// Four cases. A move of 1 rad in 0.1 s by polynomials of degree 3 to 9. This move without the lag of the current loop
/// (M falls by 18 to 36 %, L by 2 to 11 %). A move of 0.5 rad in 0.06 s, with the time to settle within 5e-3 and 5e-4
/// rad. Creeping at 0.05 rad/s.
#[test]
fn moves_of_any_degree_short_moves_and_creeping() {
    for (bits, period_s, degrees, inside_ms, creeping) in [
        (14, 1e-3, [0.94e-3, 1.2e-3, 1.2e-3, 1.2e-3], [52.0, 72.0], [1.2e-4, 3.0e-4]),
        (16, 1e-4, [3.4e-4, 2.9e-4, 2.7e-4, 2.7e-4], [52.0, 56.0], [3.1e-6, 9.7e-6]),
    ] {
        let design = by_rule(period_s, bits);
        for (degree, value) in [3, 5, 7, 9].into_iter().zip(degrees) {
            let found = peak(&run::<1>(&design, Shaft::ROUGH, 0.3, &point_to_point(1.0, 0.05, 0.1, degree)).error);
            println!("{bits} bits, degree {degree}: {found:.1e} for {value:.1e}");
            assert!(found <= 1.5 * value, "{bits} bits, degree {degree}: {found:e}");
        }
        let [lagging, direct] = [2e-4, 0.0].map(|lag_s| figures::<1>(&design, Shaft { lag_s, ..Shaft::ROUGH }));
        let [moved, load] = [direct[2] / lagging[2], direct[3] / lagging[3]];
        println!("{bits} bits, no lag: move {moved:.2}, load {load:.2} times");
        assert!((0.64..=0.82).contains(&moved) && (0.89..=0.98).contains(&load), "{moved}, {load}");

        let plan = point_to_point(0.5, 0.0, 0.06, 7);
        let short = run::<1>(&design, Shaft::ROUGH, 0.3, &plan).error;
        let angle = |k: usize| short[k] + plan(k as f64 * period_s)[0] - 0.5;
        let last = |within: f64| (0..short.len()).rposition(|k| angle(k).abs() > within).expect("it began outside");
        let found = [5e-3, 5e-4].map(|within| (last(within) + 1) as f64 * period_s * 1e3);
        println!("{bits} bits, 0.5 rad: inside after {found:.1?} for {inside_ms:?} ms");
        assert!((0..2).all(|i| found[i] <= 1.5 * inside_ms[i]), "{bits} bits: {found:?} ms");

        let slow = run::<1>(&design, Shaft::ROUGH, 2.0, &|t| [0.05 * t, 0.05]);
        let found = [rms(second_half(&slow.error)), peak(second_half(&slow.error))];
        println!("{bits} bits, 0.05 rad/s: {:?} for {:?}", found.map(Sci), creeping.map(Sci));
        assert!((0..2).all(|i| found[i] <= 1.5 * creeping[i]), "{bits} bits: {found:?}");
    }
}

/// Gaps without samples on a sine, starting at every 20 ms of a period. Where friction does not reverse, the peak stays
/// within 4 % (the source claims this for the whole sine). An unobserved 0.016 N m is 80 rad/s² for the length of the
/// gap.
#[test]
fn lost_samples_are_bridged() {
    let design = by_rule(1e-3, 14);
    let law = MotorDrive::<f32, Position, 1>::try_design(&design).expect("a good design");
    let plan = Run { period_s: 1e-3, bits: 14, ticks: 1800, delay: 0 };
    let sine = blended_sine(1.0, TAU, 0.25);
    let peak_with = |lost: std::ops::Range<u32>| {
        let each = |k: u32, sample: &mut Sample<_, _, 1>, _: &mut Running<_>| {
            if lost.contains(&k) {
                sample.counts = [None];
            }
        };
        peak(&run_motor(law, Shaft::ROUGH, plan, &sine, each).error)
    };
    let whole = peak_with(0..0);
    for (ticks, least) in [(5, 48), (20, 32)] {
        let mut found: Vec<f64> = (30..80).map(|k| peak_with(20 * k..20 * k + ticks)).collect();
        found.sort_by(f64::total_cmp);
        let within = found.iter().filter(|&&found| found < 1.04 * whole).count();
        println!("{ticks} ms lost: peak {:.1e} at most, without {whole:.1e}; {within} of 50 within 4 %", found[49]);
        let unseen = 40.0 * (1e-3 * f64::from(ticks)).powi(2);
        assert!(within >= least && found[49] <= 1.5 * (whole + unseen), "{ticks} ms: {within}, {:e} rad", found[49]);
    }
}

/// Accuracy of the speed estimate on a sine, compared with the difference of two counts. For a load of 0.1 N m: time to
/// 90 % of the load estimate, and its noise without cogging, which also counts as a load.
#[test]
fn speed_and_load_are_known_as_well_as_said() {
    for (bits, period_s, speed, load_ms, noise) in [(14, 1e-3, 0.037, 22.0, 2.4e-4), (16, 1e-4, 0.011, 10.0, 3.1e-4)] {
        let design = by_rule(period_s, bits);
        let law = MotorDrive::<f32, Position, 1>::try_design(&design).expect("a good design");
        let run = Run { period_s, bits, ticks: (2.0 / period_s).round() as u32, delay: 0 };
        let (mut known, mut counts) = (Vec::new(), Vec::new());
        let sine = blended_sine(1.0, TAU, 0.25);
        let trace = run_motor(law, Shaft::ROUGH, run, &sine, |_, sample, running| {
            // Estimate of the previous tick.
            known.push(running.estimates().map_or(0.0, |known| f64::from(known.speed[0])));
            counts.push(sample.counts[0].expect("none is lost"));
        });
        let (unit, turn) = (design.encoder.unit_rad(), 1 << bits);
        let signed = |moved: i32| (moved + turn / 2).rem_euclid(turn) - turn / 2;
        let ticks = counts.len() / 2..counts.len() - 1;
        let truly = |k: usize| trace.speed_error[k] + sine(k as f64 * period_s)[1];
        let off: Vec<f64> = ticks.clone().map(|k| known[k + 1] - truly(k)).collect();
        let by_counts = |k: usize| f64::from(signed(counts[k] - counts[k - 1])) * unit / period_s - truly(k);
        let [off, by_counts] = [rms(&off), rms(&ticks.map(by_counts).collect::<Vec<_>>())];
        println!("{bits} bits: speed to {off:.3} rad/s for {speed}, by difference {by_counts:.2}");
        assert!(off <= 1.5 * speed && by_counts > 3.0 * off, "{bits} bits: {off}, {by_counts}");

        let law = MotorDrive::<f32, Speed>::try_design(&design).expect("a good design");
        let ramp = |t: f64| [0.0, 20.0 * integral_free_step(t / 0.05)];
        let run = Run { ticks: (0.6 / period_s).round() as u32, ..run };
        let smooth = Shaft { cogging: [0.0, 7.0], load: [0.3, 0.1], ..Shaft::ROUGH };
        let load = run_motor(law, smooth, run, &ramp, |_, _, _| ()).load;
        let (before, after) = load.split_at(load.len() / 2);
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let quiet = mean(second_half(before));
        let ticks = after.iter().position(|load| load - quiet > 0.09).expect("it is known in the end");
        let there_ms = ticks as f64 * period_s * 1e3;
        let late = second_half(after);
        let spread = rms(&late.iter().map(|load| load - mean(late)).collect::<Vec<_>>());
        println!("{bits} bits: 90 % after {there_ms:.1} ms for {load_ms}, noise {spread:.1e} N m for {noise:.1e}");
        assert!(there_ms <= 1.5 * load_ms && spread <= 1.5 * noise, "{bits} bits: {there_ms} ms, {spread:e} N m");
    }
}

/// The position loop on the integral of r': the lost angle comes back.
#[test]
fn a_shaft_that_keeps_step_gets_its_angle_back() {
    for (bits, period_s, dip, back_ms) in [(14, 1e-3, 2.0, 46.0), (16, 1e-4, 0.97, 15.0)] {
        let design = by_rule(period_s, bits);
        let ramp = |t: f64| {
            let s = (t / 0.05).clamp(0.0, 1.0);
            let before = 20.0 * 0.05 * (s * s * s - 0.5 * s * s * s * s);
            [before + 20.0 * (t - 0.05).max(0.0), 20.0 * integral_free_step(s)]
        };
        let shaft = Shaft { load: [0.3, 0.1], ..Shaft::ROUGH };
        let trace = run::<0>(&design, shaft, 0.6, &ramp);
        let after = (0.3 / period_s).round() as usize;
        let found = peak(&trace.speed_error[after..]);
        let back = trace.speed_error[after..].iter().rposition(|error| error.abs() > 0.2).map_or(0, |k| k + 1);
        let back = back as f64 * period_s * 1e3;
        let [most, left] = [peak(&trace.error[after..]), peak(&trace.error[trace.error.len() * 19 / 20..])];
        println!(
            "{bits} bits: dip {found:.2} rad/s, back after {back:.0} ms, {most:.3} rad lost, {left:.1e} at the end"
        );
        assert!(found <= 1.5 * dip && back <= 1.5 * back_ms, "{bits} bits: {found} rad/s, {back} ms");
        assert!(left < 0.1 * most, "{bits} bits: {left:e} of {most:e} rad");
    }
}

/// A base that does not follow costs accuracy. A gear of 1 : 181 with an encoder of 2^24 counts has a base of 181
/// revolutions, so the base does not follow. 90 revolutions away f32 has lost so many digits that u moves in steps.
#[test]
fn a_base_that_does_not_follow_is_missed() {
    let far = 90.0 * TAU;
    for (period_s, times) in [(1e-3, 1.5), (1e-4, 5.0)] {
        let encoder = Encoder::absolute(24).geared(1, 181);
        let design = MotorDesign::by_rule(period_s, MOTOR, encoder, Limits::symmetric(10.0));
        let law = MotorDrive::<f32, Position>::try_design(&design).expect("a good design");
        let noise = |away: f64| {
            let mut shaft = Shaft { x: [away, 0.0, 0.0], ..Shaft::ROUGH };
            let mut running = Running::new(law);
            let (mut u, sine) = (Vec::new(), blended_sine::<2>(1.0, TAU, 0.25));
            for k in 0..(1.0 / period_s).round() as u32 {
                let t = f64::from(k) * period_s;
                let count = (shaft.x[0] / encoder.unit_rad() + 0.5).floor() as i32;
                let [begin, end] = [t, t + period_s].map(|t| {
                    let [r, v] = sine(t);
                    Target { turn: (away / TAU) as i32, jet: [r as f32, v as f32] }
                });
                u.push(f64::from(running.tick_at_once(&Sample { counts: [Some(count)], begin, end }).u));
                shaft.advance(t, u[u.len() - 1], period_s);
            }
            rms(&second_half(&u).windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>())
        };
        let [near, far] = [noise(0.0), noise(far)];
        println!("T {period_s}: steps of u {near:.1e} A at 0, {far:.1e} A at 90 turns");
        assert!(far >= times * near, "T {period_s}: {near:e}, {far:e}");
    }
}

/// Whole runs of another implementation: counts and applied u, tick by tick.
#[test]
fn runs_are_those_of_the_other_implementation() {
    let open = |period_s, bits, w_c| {
        let design = MotorDesign { limits: Limits::symmetric(10.0), ..by_rule(period_s, bits) }.with_surface(w_c);
        MotorDesign { gate_steps: f64::INFINITY, ..design }
    };
    macro_rules! beside {
        ($name:literal, $design:expr, $shaft:expr, $plan:expr, $each:expr, $($types:tt)*) => {{
            let design: MotorDesign = $design;
            let rows = data::columns(concat!("motor_", $name, ".csv"), ["count", "u_demand"]);
            let law = MotorDrive::<f64, $($types)*>::try_design(&design).expect("a good design");
            let bits = design.encoder.bits;
            let delay = u32::from($name == "turns_wrap_delay_12bit");
            let run = Run { period_s: design.period_s, bits, ticks: rows.len() as u32, delay };
            let (mut counts, each) = (Vec::new(), $each);
            let trace = run_motor(law, $shaft, run, &$plan, |k, sample, _| {
                counts.push(f64::from(sample.counts[0].expect("a count")));
                if each(k) {
                    sample.counts = [None];
                }
            });
            for (k, [count, u]) in rows.into_iter().enumerate() {
                assert!(counts[k] == count, "{}, tick {k}: {} for {count}", $name, counts[k]);
                // The recordings have ten digits.
                let off = (trace.u[k] - u.clamp(-10.0, 10.0)).abs();
                assert!(off <= 1e-8, "{}, tick {k}: {off:e} A", $name);
            }
        }};
    }
    let none = |_| false;
    let rough = Shaft::ROUGH;
    let loaded = Shaft { load: [0.5, 0.1], ..rough };
    beside!("move_load_14bit", open(1e-3, 14, 125.0), loaded, point_to_point(1.0, 0.05, 0.1, 7), none, Position);
    let lost = |k| (300..303).contains(&k) || (500..510).contains(&k);
    beside!("sine_20bit_two_sets_lost", open(1e-3, 20, 125.0), rough, blended_sine(1.0, TAU, 0.25), lost, Position, 1);
    let bandwidths =
        MotorBandwidths { surface_rad_s: 50.0, observer_rad_s: 75.0, reaching_per_s: 400.0, offset_per_s: 25.0 };
    let late = MotorDesign { bandwidths, ..open(1e-3, 12, 50.0) };
    beside!("turns_wrap_delay_12bit", late, rough, point_to_point(40.0, 0.02, 0.7, 7), none, Position, 0, 1, 4);
    let ramp = |t: f64| {
        let (x, s) = (t - 5e-3, ((t - 5e-3) / 0.02).clamp(0.0, 1.0));
        [20.0 * 0.02 * (s * s * s - 0.5 * s * s * s * s) + 20.0 * (x - 0.02).max(0.0), 20.0 * integral_free_step(s)]
    };
    let heavy = Shaft { damping: 2e-5, load: [0.05, 0.05], ..rough };
    beside!("speed_loop_fine_16bit", open(1e-4, 16, 286.0), heavy, ramp, none, Speed);
}

/// f32 and f64, each in its own loop, with the finest encoders (24 bits; the thresholds are for 30).
#[test]
fn a_law_in_f32_runs_as_in_f64() {
    for period_s in [1e-3, 1e-4] {
        let design = by_rule(period_s, 24);
        let run = Run { period_s, bits: 24, ticks: (1.5 / period_s).round() as u32, delay: 0 };
        let plan = blended_sine(1.0, TAU, 0.25);
        let single = MotorDrive::<f32, Position, 1>::try_design(&design).expect("a good design");
        let double = MotorDrive::<f64, Position, 1>::try_design(&design).expect("a good design");
        let single = run_motor(single, Shaft::CLEAN, run, &plan, |_, _, _| ());
        let double = run_motor(double, Shaft::CLEAN, run, &plan, |_, _, _| ());
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let (y, u) = (apart(&single.error, &double.error), apart(&single.u, &double.u));
        println!("T {period_s}: y {y:.1e} rad, u {u:.1e} A");
        assert!(y <= 3e-7 && u <= 1.5e-3, "T {period_s}: {y:e} rad, {u:e} A");
    }
}

/// Returns 3 s² - 2 s³.
fn integral_free_step(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}

/// Without a reference the controller is bit-identical to the controller with targets of 0.
#[test]
fn holding_is_following_zero() {
    let design = by_rule(1e-3, 14);
    let (hold, follow) = (
        MotorDrive::<f32, Hold>::try_design(&design).expect("a good design"),
        MotorDrive::<f32, Position>::try_design(&design).expect("a good design"),
    );
    let (mut hold, mut follow) = (Running::new(hold), Running::new(follow));
    let mut rng = Rng::new(0x401D);
    let zero = Target { turn: 0, jet: [0.0; 2] };
    for _ in 0..2000 {
        let counts = [Some(rng.integer(0, 30) as i32 - 15)];
        let a = hold.tick_at_once(&Sample { counts, begin: (), end: () });
        let b = follow.tick_at_once(&Sample { counts, begin: zero, end: zero });
        assert_eq!(a.u.to_bits(), b.u.to_bits());
        assert!(!a.health.contains(Health::INPUT_REJECTED));
    }
}
