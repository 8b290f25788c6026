//! Robustness of drives: arbitrary input never leads to an invalid output, and a drive recovers from any state.

use controller_core::drive::{
    Encoder, EncoderForm, Joint, JointDesign, JointDrive, Motor, MotorDesign, MotorDrive, Position, Sample, Speed,
    Target,
};
use controller_core::{ControlLaw, Health, Limits, Running, WordsError};
use integration_tests::drive::{AtOnce as _, Shaft, blended_sine, checksum, point_to_point};
use integration_tests::strategy::Rng;
use std::f64::consts::TAU;

const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
const MOTOR_DESIGN: MotorDesign =
    MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits { min: -10.0, max: 8.0 });
const JOINT_DESIGN: JointDesign =
    JointDesign::new(1e-3, Joint::TABLE_I, [Encoder::absolute(20); 2], Limits { min: -30.0, max: 25.0 }, 1.3);

/// Returns an extreme number.
fn wild(rng: &mut Rng) -> f32 {
    match rng.integer(0, 7) {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => f32::NEG_INFINITY,
        3 => f32::MAX,
        4 => -f32::MAX,
        5 => f32::from_bits(rng.bits() as u32),
        _ => rng.within(-10.0, 10.0) as f32,
    }
}

fn wild_sample<const E: usize, const N: usize>(rng: &mut Rng) -> Sample<i32, Target<f32, i32, N>, E> {
    let mut target = || Target { turn: rng.bits() as i32, jet: core::array::from_fn(|_| wild(rng)) };
    let (begin, end) = (target(), target());
    let counts = core::array::from_fn(|_| rng.chance(0.7).then(|| rng.bits() as i32));
    Sample { counts, begin, end }
}

/// Runs a million ticks with arbitrary samples, after arbitrary reports and retunes, and checks the limits of u.
fn stays_within<M, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>(
    law: EncoderForm<f32, M, Position, E, N, S, FAST, LATE>,
    [min, max]: [f32; 2],
    seed: u64,
) where
    M: controller_core::drive::ChainModel<f32, E, N>,
    EncoderForm<f32, M, Position, E, N, S, FAST, LATE>: Copy,
{
    let mut rng = Rng::new(seed);
    let mut running = Running::new(law);
    for tick in 0..200_000 {
        let sample = wild_sample(&mut rng);
        if rng.chance(0.01) {
            let _ = running.retune(law, &sample);
        }
        let output = running.tick_at_once(&sample);
        assert!(output.u >= min && output.u <= max, "seed {seed:#x}, tick {tick}: {output:?}");
        assert!(output.sigma_star.is_finite(), "seed {seed:#x}, tick {tick}: {output:?}");
        running.report_applied(wild(&mut rng));
    }
}

#[test]
fn u_is_within_its_limits_whatever_comes_in() {
    stays_within(MotorDrive::<f32, Position>::design(&MOTOR_DESIGN), [-10.0, 8.0], 1);
    stays_within(MotorDrive::<f32, Position, 1>::design(&MOTOR_DESIGN), [-10.0, 8.0], 2);
    stays_within(MotorDrive::<f32, Position, 0, 1, 4>::design(&MOTOR_DESIGN), [-10.0, 8.0], 3);
    stays_within(JointDrive::<f32, Position, 1>::design(&JOINT_DESIGN), [-30.0, 25.0], 4);
    stays_within(JointDrive::<f32, Position, 1, 1>::design(&JOINT_DESIGN), [-30.0, 25.0], 5);
}

fn count(shaft: &Shaft) -> i32 {
    ((shaft.x[0] / TAU * 16384.0 + 0.5).floor() as i64).rem_euclid(16384) as i32
}

/// Half of the state's numbers, except the position words, get arbitrary values. Within the run the motor is back at
/// the reference, up to whole revolutions.
#[test]
fn from_any_numbers_in_its_state_the_loop_finds_back() {
    let law = MotorDrive::<f32, Position, 1>::design(&MOTOR_DESIGN);
    let mut rng = Rng::new(0x5147E);
    let (mut slowest, mut farthest) = (0, 0.0_f64);
    for case in 0..200 {
        let mut running = Running::new(law);
        let mut shaft = Shaft::ROUGH;
        let mut back = None;
        for k in 0..6000_u32 {
            if k == 100 {
                // Head: fingerprint, started, fresh, last, at, turn; then p v d, two for the gain switch, reach,
                // missed, off, doubt, offset, held. The checksum is recomputed.
                let mut words: Vec<u32> = running.words().collect();
                let last = words.len() - 1;
                assert_eq!(last, 19);
                // The last two are the limit of the stage, which no sensor measures.
                for word in &mut words[6..last - 2] {
                    if rng.chance(0.5) {
                        let number = if case % 2 == 0 { wild(&mut rng) } else { rng.spread(1e-3, 1e30) as f32 };
                        // `from_words` rejects values that are not finite.
                        *word = if number.is_finite() { number } else { f32::MAX }.to_bits();
                    }
                }
                words[last] = checksum(&words[..last]);
                running = Running::from_words(law, words).expect("finite words");
            }
            let at = Target { turn: 0, jet: [0.0; 2] };
            let output = running.tick_at_once(&Sample { counts: [Some(count(&shaft))], begin: at, end: at });
            assert!((-10.0..=8.0).contains(&output.u));
            shaft.advance(f64::from(k) * 1e-3, f64::from(output.u), 1e-3);
            if k > 100 {
                farthest = farthest.max(shaft.x[0].abs());
                // A wrong speed may add whole revolutions to the count, which no sensor measures.
                let off = shaft.x[0] - TAU * (shaft.x[0] / TAU).round();
                back = if off.abs() > 0.02 || shaft.x[1].abs() > 1.0 { None } else { back.or(Some(k)) };
            }
        }
        slowest = slowest.max(back.unwrap_or_else(|| panic!("case {case}: {shaft:?}")) - 100);
    }
    println!("at most {farthest:.2} rad away, back after {slowest} ms");
}

/// A damaged offset that demands more than 256 times the span of the limits is replaced: W becomes σ at once, as at the
/// start, instead of decaying.
#[test]
fn an_offset_that_asks_for_too_much_is_replaced() {
    let law = MotorDrive::<f32, Position>::design(&MOTOR_DESIGN);
    let mut running = Running::new(law);
    let at = Target { turn: 0, jet: [0.0; 2] };
    let sample = Sample { counts: [Some(5)], begin: at, end: at };
    for _ in 0..50 {
        running.tick_at_once(&sample);
    }
    let calm = running.clone().tick_at_once(&sample);
    let mut words: Vec<u32> = running.words().collect();
    let last = words.len() - 1;
    // Layout of the end: offset, held u, limit of the stage, last report, checksum.
    words[last - 4] = 1e9_f32.to_bits();
    words[last] = checksum(&words[..last]);
    let mut spoilt = Running::from_words(law, words).expect("finite words");
    let output = spoilt.tick_at_once(&sample);
    assert_eq!((output.sigma, output.sigma_star), (calm.sigma, 0.0));
    assert!(output.u.abs() < 1.0 && spoilt.tick_at_once(&sample).sigma_star.abs() < 1.0, "{output:?}");
}

/// Targets that are not numbers cost only their own ticks; the observers continue.
#[test]
fn targets_that_are_no_numbers_cost_their_ticks_and_nothing_else() {
    let law = MotorDrive::<f32, Position>::design(&MOTOR_DESIGN);
    let mut running = Running::new(law);
    let mut shaft = Shaft { load: [0.05, 0.02], ..Shaft::ROUGH };
    for k in 0..600_u32 {
        let spoilt = (200..205).contains(&k);
        let at = Target { turn: 0, jet: if spoilt { [f32::NAN, 0.0] } else { [0.0; 2] } };
        let output = running.tick_at_once(&Sample { counts: [Some(count(&shaft))], begin: at, end: at });
        assert_eq!(output.health.contains(Health::INPUT_REJECTED), spoilt, "tick {k}");
        shaft.advance(f64::from(k) * 1e-3, f64::from(output.u), 1e-3);
        if k > 190 {
            assert!(shaft.x[0].abs() < 2e-3, "tick {k}: {}", shaft.x[0]);
        }
    }
}

/// One outlier is one missing sample, which changes the peak by less than a tenth. Without the innovation gate it
/// disturbs the current strongly.
#[test]
fn a_gate_leaves_no_trace_of_a_wild_count() {
    let design = MotorDesign { limits: Limits::symmetric(10.0), ..MOTOR_DESIGN };
    let open = MotorDesign { gate_steps: f64::INFINITY, ..design };
    let sine = blended_sine::<2>(1.0, TAU, 0.25);
    let peak = |design: &MotorDesign, spike: i32| {
        let law = MotorDrive::<f32, Position>::try_design(design).expect("a good design");
        let (mut running, mut shaft) = (Running::new(law), Shaft::ROUGH);
        let (mut peak, mut lost) = (0.0_f64, 0);
        for k in 0..1000_u32 {
            let t = f64::from(k) * 1e-3;
            let spike = if k == 600 { spike } else { 0 };
            let [begin, end] = [sine(t), sine(t + 1e-3)].map(|jet| Target { turn: 0, jet: jet.map(|r| r as f32) });
            let output = running.tick_at_once(&Sample { counts: [Some(count(&shaft) + spike)], begin, end });
            lost += u32::from(output.health.contains(Health::SAMPLE_LOST));
            shaft.advance(t, f64::from(output.u), 1e-3);
            if k >= 500 {
                peak = peak.max((shaft.x[0] - sine(t + 1e-3)[0]).abs());
            }
        }
        (peak, lost)
    };
    let (without, none) = peak(&design, 0);
    assert_eq!(none, 0);
    for spike in [150, -1000, 5000] {
        let (with, lost) = peak(&design, spike);
        assert!(lost == 1 && with <= 1.1 * without, "{spike}: {with} after {without}, {lost} lost");
    }
    let (thrown, lost) = peak(&open, 5000);
    assert!(lost == 0 && thrown > 10.0 * without, "{thrown}, {lost}");
}

/// Bits above the counter's own are ignored, and the counter may begin anywhere. A counter of k bits that wraps in both
/// directions gives the same bits as a counter that does not wrap.
#[test]
fn a_wrap_of_the_counter_changes_no_bit() {
    for (bits, ticks) in [(12, 4000), (16, 4000), (24, 4000)] {
        let design = |bits| MotorDesign {
            encoder: Encoder { bits, states: 0, counts_per_turn: 1 << 12, gear_num: 1, gear_den: 1 },
            ..MOTOR_DESIGN
        };
        let [wrapping, wide] = [bits, 32].map(design).map(|design| {
            // The innovation gate must not depend on the counter width.
            MotorDrive::<f32, Speed>::try_design(&design).expect("a good design")
        });
        let (mut wrapping, mut wide) = (Running::new(wrapping), Running::new(wide));
        let mut rng = Rng::new(7);
        let mut position = 0_i32;
        for k in 0..ticks {
            // Five revolutions there and back, with a jerky motion.
            let speed = if k < ticks / 2 { 10 } else { -10 };
            position += speed + rng.integer(0, 4) as i32 - 2;
            let at = if k < ticks / 2 { 15.0 } else { -15.0 };
            let tick = |running: &mut Running<MotorDrive<f32, Speed>>, count: i32| {
                running.tick_at_once(&Sample { counts: [Some(count)], begin: at, end: at })
            };
            let (a, b) = (tick(&mut wrapping, position & ((1 << bits) - 1)), tick(&mut wide, position));
            assert_eq!([a.u, a.sigma, a.sigma_star].map(f32::to_bits), [b.u, b.sigma, b.sigma_star].map(f32::to_bits));
            let (a, b) = (wrapping.estimates().expect("started"), wide.estimates().expect("started"));
            assert_eq!((a.turn, a.position[0].to_bits()), (b.turn, b.position[0].to_bits()), "tick {k}");
        }
    }
}

/// If more samples are missing than allowed, the output is the fallback. The next valid sample restores the loop.
#[test]
fn a_sensor_that_is_gone_ends_in_the_fallback_and_a_new_start() {
    let law = JointDrive::<f32, Position, 1>::design(&JOINT_DESIGN);
    let mut running = Running::new(law);
    let at = Target { turn: 0, jet: [0.0; 4] };
    let mut healths = Vec::new();
    for k in 0..200 {
        let there = !(60..150).contains(&k);
        let sample = Sample { counts: [there.then_some(3), Some(3)], begin: at, end: at };
        healths.push(running.tick_at_once(&sample).health);
    }
    let rejected: Vec<usize> = (0..200).filter(|&k| healths[k].contains(Health::INPUT_REJECTED)).collect();
    // 50 missing samples are bridged; after that every tick without a sample is rejected. The next count lies where the
    // prediction puts it, and is accepted.
    assert_eq!(rejected, (110..150).collect::<Vec<_>>());
    assert!(healths[60..150].iter().all(|health| health.contains(Health::SAMPLE_LOST)));
    assert!(healths[152..].iter().all(|health| !health.contains(Health::SAMPLE_LOST)));
}

#[test]
fn words_bring_a_drive_back_to_the_bit_and_another_design_refuses_them() {
    let law = JointDrive::<f32, Position, 1, 1>::design(&JOINT_DESIGN);
    let other = JointDesign { lost_ticks: 51, ..JOINT_DESIGN };
    let other = JointDrive::<f32, Position, 1, 1>::design(&other);
    assert_ne!(law.fingerprint(), other.fingerprint());
    let mut rng = Rng::new(0x3D5);
    let mut running = Running::new(law);
    let at = Target { turn: 0, jet: [0.0; 4] };
    for k in 0..300 {
        let mut sample = || Sample {
            counts: [rng.chance(0.9).then(|| rng.integer(0, 9) as i32), Some(rng.integer(0, 9) as i32)],
            begin: at,
            end: at,
        };
        if k % 50 == 49 {
            let words: Vec<u32> = running.words().collect();
            assert!(matches!(Running::from_words(other, words.clone()), Err(WordsError::OtherDesign { .. })));
            let mut again = Running::from_words(law, words).expect("words of this design");
            let sample = sample();
            let (a, b) = (again.tick_at_once(&sample), running.tick_at_once(&sample));
            assert_eq!((a.u.to_bits(), a.health), (b.u.to_bits(), b.health));
            assert!(again.words().eq(running.words()));
        } else {
            running.tick_at_once(&sample());
        }
    }
}

/// A gear of 37 : 10 never aligns with its encoder within one revolution. The base moves on by five shaft revolutions,
/// a whole number of counts. The shaft follows sixty revolutions there and back as accurately as one, and ends where it
/// began.
#[test]
fn a_gear_that_never_meets_its_encoder_in_one_turn_is_followed() {
    let encoder = Encoder::absolute(12).geared(37, 10);
    let design = MotorDesign::by_rule(1e-3, MOTOR, encoder, Limits::symmetric(10.0));
    let law = MotorDrive::<f32, Position>::try_design(&design).expect("a good design");
    let (mut running, mut shaft) = (Running::new(law), Shaft::CLEAN);
    let far = 60.0 * TAU;
    let there = point_to_point::<2>(far, 0.0, 2.0, 7);
    let plan = |t: f64| if t < 2.5 { there(t) } else { there(5.0 - t).map(|r| r * 1.0) };
    let mut worst = 0.0_f64;
    let mut turns = 0;
    for k in 0..5500_u32 {
        let t = f64::from(k) * 1e-3;
        let count = (shaft.x[0] / encoder.unit_rad() + 0.5).floor() as i64;
        let jet = |t: f64| {
            let [r, v] = plan(t.min(5.0));
            let turn = (r / TAU).round();
            Target { turn: turn as i32, jet: [(r - turn * TAU) as f32, if t < 2.5 { v } else { -v } as f32] }
        };
        let sample = Sample { counts: [Some(count.rem_euclid(4096) as i32)], begin: jet(t), end: jet(t + 1e-3) };
        let output = running.tick_at_once(&sample);
        worst = worst.max((shaft.x[0] - plan(t.min(5.0))[0]).abs());
        shaft.advance(t, f64::from(output.u), 1e-3);
        let known = running.estimates().expect("started");
        turns = turns.max(known.turn);
        let angle = f64::from(known.turn) * TAU + f64::from(known.position[0]);
        assert!(known.position[0].abs() < 5.0 * 7.0, "tick {k}: {known:?}");
        // The estimate belongs to the beginning of the tick; one tick of travel later the shaft is elsewhere.
        assert!((angle - plan(t.min(5.0))[0]).abs() < 0.05, "tick {k}: {angle}");
    }
    println!("at most {worst:.1e} rad off");
    assert!(turns >= 55 && turns % 5 == 0 && worst < 5e-3, "{turns}, {worst}");
    assert!(shaft.x[0].abs() < 1e-3, "{}", shaft.x[0]);
}

/// A retune at rest leaves no offset; the bumpless retune freezes an offset into W.
#[test]
fn a_re_tune_at_rest_leaves_no_offset() {
    let law = MotorDrive::<f32, Position>::design(&MOTOR_DESIGN);
    let firmer = MotorDrive::<f32, Position>::design(&MOTOR_DESIGN.with_surface(150.0));
    let mut running = Running::new(law);
    let at = Target { turn: 0, jet: [0.0; 2] };
    let sample = |count| Sample { counts: [Some(count)], begin: at, end: at };
    for k in 0..40 {
        running.tick_at_once(&sample(k % 3));
    }
    let (mut bumpless, mut rest) = (running.clone(), running.clone());
    bumpless.retune(firmer, &sample(1)).expect("designs that can take over");
    rest.retune(firmer.at_rest(), &sample(1)).expect("designs that can take over");
    let offset = |output: controller_core::Output<f32>| output.sigma - output.sigma_star;
    assert_eq!(offset(rest.tick_at_once(&sample(1))), 0.0);
    let kept = offset(bumpless.tick_at_once(&sample(1)));
    assert!(kept.abs() > 1e-3, "{kept}");
    // Another encoder has another count.
    let other = MotorDesign { encoder: Encoder::absolute(16), ..MOTOR_DESIGN };
    let other = MotorDrive::<f32, Position>::design(&other);
    assert_eq!(running.retune(other, &sample(1)), Err(controller_core::RetuneError::OtherEncoder));
    // W has no influence on u where α is k_l.
    let mut flat = MOTOR_DESIGN;
    (flat.bandwidths.offset_per_s, flat.bandwidths.reaching_per_s) = (400.0, 350.0);
    let flat = MotorDrive::<f32, Position>::design(&flat);
    assert_eq!(running.retune(flat, &sample(1)), Err(controller_core::RetuneError::GainNearDecay));
}

/// A field and the function that sets it.
type Change = (&'static str, fn(&mut MotorDesign, f64));

/// Every number out of its range is rejected by name, with the nearest valid value; the nearest valid value is
/// accepted.
#[test]
fn a_design_out_of_range_is_refused_by_name_with_the_nearest_that_is_not() {
    let good = MOTOR_DESIGN;
    let changes: [Change; 9] = [
        ("period_s", |design, value| design.period_s = value),
        ("motor.inertia_kg_m2", |design, value| design.motor.inertia_kg_m2 = value),
        ("motor.torque_n_m_per_a", |design, value| design.motor.torque_n_m_per_a = value),
        ("limits.max", |design, value| design.limits.max = value),
        ("bandwidths.surface_rad_s", |design, value| design.bandwidths.surface_rad_s = value),
        ("bandwidths.observer_rad_s", |design, value| design.bandwidths.observer_rad_s = value),
        ("bandwidths.reaching_per_s", |design, value| design.bandwidths.reaching_per_s = value),
        ("fast_ratio", |design, value| design.fast_ratio = value),
        ("gate_steps", |design, value| design.gate_steps = value),
    ];
    for (field, change) in changes {
        for value in [f64::NAN, -1e3, 0.0, 1e15] {
            if field == "gate_steps" && value > 0.0 || field == "limits.max" && value == 0.0 {
                continue;
            }
            let mut design = good;
            change(&mut design, value);
            let error = MotorDrive::<f32>::try_design(&design).expect_err(field);
            let told = error.to_string();
            assert!(told.starts_with(error.field) && told.contains("take "), "{told}");
            let of_limits = field == "limits.max" && error.field == "limits.min";
            assert!(error.field == field || of_limits || error.field == "motor.damping_n_m_s", "{field}: {told}");
            assert!(error.low <= error.nearest() && error.nearest() <= error.high, "{told}");
        }
    }
    // A bandwidth that is allowed without delay is too fast with one tick of delay.
    let mut fast = good;
    fast.bandwidths.observer_rad_s = 700.0;
    assert!(MotorDrive::<f32>::try_design(&fast).is_ok());
    let late = MotorDrive::<f32, Position, 0, 1>::try_design(&fast).expect_err("too fast for a delay");
    assert_eq!((late.field, late.high), ("bandwidths.observer_rad_s", 0.5));
    // The joint: bandwidths keep their proportions, and its base is one revolution.
    let mut joint = JOINT_DESIGN;
    joint.bandwidths.link_rad_s = 50.0;
    assert_eq!(JointDrive::<f32>::try_design(&joint).expect_err("too near the surface").field, "bandwidths.link_rad_s");
    let mut joint = JOINT_DESIGN;
    joint.encoders[1] = Encoder::absolute(12).geared(37, 10);
    assert_eq!(JointDrive::<f32>::try_design(&joint).expect_err("no whole turn").field, "encoders[1]");
}

/// 3.2 rad of revolution 0 equals 3.2 - 2π of revolution 1, for the error and for the change of the reference.
#[test]
fn how_an_angle_is_split_into_turns_changes_nothing() {
    // The counts ignore u, so u grows; limits would hide a difference.
    let design = JointDesign { limits: Limits::symmetric(1e6), ..JOINT_DESIGN };
    let law = JointDrive::<f64, Position>::design(&design);
    let (mut one, mut other) = (Running::new(law), Running::new(law));
    for k in 0..200 {
        let angle = |k: i32| 3.0 + 2e-3 * f64::from(k);
        let count = (angle(k) / TAU * f64::from(1 << 20)).round() as i32;
        let plain = |k: i32| Target { turn: 0, jet: [angle(k), 2.0, 0.0, 0.0] };
        let split = |k: i32| {
            let turn = i32::from(angle(k) > std::f64::consts::PI);
            Target { turn, jet: [angle(k) - TAU * f64::from(turn), 2.0, 0.0, 0.0] }
        };
        let counts = [Some(count); 2];
        let a = one.tick_at_once(&Sample { counts, begin: plain(k), end: plain(k + 1) }).u;
        let b = other.tick_at_once(&Sample { counts, begin: split(k), end: split(k + 1) }).u;
        assert!((a - b).abs() <= 1e-7, "tick {k}: {a}, {b}");
    }
}
