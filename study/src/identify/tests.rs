//! Identification of a recording from an independent simulation in another language (tests/data/README.md), and of
//! links that are integrated here.

use controller_core::drive::Encoder;
use loop_sim::sensor::encoder::Mounted;

use super::*;

/// Joint of the paper with errors of -50, +40, +50, -30, +50 % in k_1, b_1, k_2, b_2, B_0; friction 1.5/1.0 A, cogging
/// 0.3 A (24 per turn), ripple 2 %, a load of 0.2 N m, v = 1 + sin 2t A.
const TRUTH: [(&str, f64, f64); 8] = [
    ("k_1", 9.0 / 0.23 * 0.5, 5e-5),
    ("b_1", 0.07 / 0.23 * 1.4, 1e-3),
    ("g", 1.0, 2e-4),
    ("c", 0.2 / 0.23, 2e-4),
    ("k_2", 9.0 / 931e-6 * 1.5, 0.08),
    ("b_2", 0.07 / 931e-6 * 0.7, 0.2),
    ("B_0", 0.119 / 931e-6 * 1.5, 0.08),
    ("f_c", 1.0, 0.15),
];
const KNOWN: PlantData = PlantData { cogging_per_turn: Some(24.0), ..PlantData::with_lag(0.0) };

fn recorded() -> Record {
    let text = include_str!("../../../tests/data/identify_joint_20bit.csv");
    record::read(text, 1e-3, record::RecordingKind::Joint, &[Mounted::new(Encoder::absolute(20)); 2]).expect("a record")
}

fn sheet() -> Sheet {
    Sheet::Joint(Joint::TABLE_I)
}

#[test]
fn the_record_of_an_independent_joint_gives_its_parameters() {
    let found = identify(&recorded(), &sheet(), &KNOWN).expect("a good record");
    println!("{:?} {:?}", found.link, found.motor);
    for (name, truth, bar) in TRUTH {
        let Parameter { value, interval, .. } = *found.parameter(name).expect("a parameter");
        println!("{name}: {value} +- {interval:.2e}, true {truth}, off by {:.1e}", value / truth - 1.0);
        // c and g are absolute.
        let scale = if matches!(name, "g" | "c") { 1.0 } else { truth };
        assert!((value - truth).abs() <= bar * scale, "{name}: {value} for {truth}");
        assert!((value - truth).abs() <= interval, "{name}: {value} +- {interval} for {truth}");
    }
    let (link, motor) = (found.link.expect("a link"), found.motor);
    assert!((0.28..0.4).contains(&link.residual_steps), "{link:?}");
    assert!(link.steps.max(motor.steps) <= 12 && link.condition.max(motor.condition) < MOST_CONDITION);
}

/// k_1 of this recording is 50 % off, as are k_2 and B_0; the declared tolerance applies to each of them.
#[test]
fn what_is_farther_off_than_declared_is_refused_by_name() {
    let strict = PlantData { tolerance: 0.4, ..KNOWN };
    let refused = identify(&recorded(), &sheet(), &strict).expect_err("a record out of tolerance");
    let Refusal::OutOfTolerance { name: "k_1", change, .. } = refused else { panic!("{refused}") };
    assert!((change + 0.5).abs() < 1e-3);
    let stiff = Joint { stiffness_n_m: 30.0, ..Joint::TABLE_I };
    let refused = identify(&recorded(), &Sheet::Joint(stiff), &KNOWN).expect_err("a wrong data sheet");
    assert!(matches!(refused, Refusal::OutOfTolerance { name: "k_1", .. }), "{refused}");
}

#[test]
fn swapped_and_reversed_signals_are_refused_and_named() {
    let good = recorded();
    let link = good.link.clone().expect("a link");
    let negated = |angle: &Angle| Angle { rad: angle.rad.iter().map(|rad| -rad).collect(), ..angle.clone() };
    let swapped = Record { link: Some(good.motor.clone()), motor: link.clone(), ..good.clone() };
    let one = Record { motor: negated(&good.motor), ..good.clone() };
    let other = Record { link: Some(negated(&link)), ..good.clone() };
    let both = Record { link: Some(negated(&link)), motor: negated(&good.motor), ..good.clone() };
    let current = Record { held_a: good.held_a.iter().map(|u| -u).collect(), ..good.clone() };
    for (record, told) in [
        (&swapped, "swapped"),
        (&one, "one of the two encoders is reversed"),
        (&other, "one of the two encoders is reversed"),
        (&both, "sign of the current"),
        (&current, "sign of the current"),
    ] {
        let refused = identify(record, &sheet(), &KNOWN).expect_err(told).to_string();
        println!("{refused}");
        assert!(refused.contains(told), "{refused}");
    }
}

#[test]
fn an_end_stop_and_a_shaft_that_stands_are_refused() {
    let good = recorded();
    let mut stopped = good.clone();
    for angle in stopped.link.iter_mut().flat_map(|link| &mut link.rad) {
        *angle = angle.min(0.5);
    }
    let refused = identify(&stopped, &sheet(), &KNOWN).expect_err("an end stop");
    assert!(matches!(refused, Refusal::NotTheJoint { cause: None, .. } | Refusal::Unsolved { .. }), "{refused}");
    println!("{refused}");
    let mut still = good;
    for angle in still.link.iter_mut().flat_map(|link| &mut link.rad) {
        *angle = 0.0;
    }
    let refused = identify(&still, &sheet(), &KNOWN).expect_err("a link that stands");
    assert!(matches!(refused, Refusal::Still { shaft: Equation::Link, .. }), "{refused}");
}

/// k_1, b_1, k_2, b_2, B_0, f_c of a joint with g = 1, off the data sheet by -30, +40, +30, -30, -30 %.
const SWUNG: [(&str, f64); 6] = [
    ("k_1", 0.7 * 9.0 / 0.23),
    ("b_1", 1.4 * 0.07 / 0.23),
    ("k_2", 1.3 * 9.0 / 931e-6),
    ("b_2", 0.7 * 0.07 / 931e-6),
    ("B_0", 0.7 * 0.119 / 931e-6),
    ("f_c", 1.0),
];

/// Joint whose link swings as a sum of sines. The link angle is a flat output, so motor angle and current follow in
/// closed form. Sines are amplitude (rad) and rad/s, of the link and in addition of the motor.
fn swung(link: &[(f64, f64)], motor: &[(f64, f64)], seconds: f64) -> Record {
    let [k1, b1, k2, b2, b0, f_c] = SWUNG.map(|(_, value)| value);
    let period_s = 1e-3;
    let sines: Vec<(f64, f64)> =
        link.iter().copied().chain(motor.iter().map(|&(a, w)| (a * k1 / (w * w), w))).collect();
    // q and its first four derivatives.
    let jet = |t_s: f64| -> [f64; 5] {
        let mut jet = [0.0; 5];
        for (i, &(amplitude, omega)) in sines.iter().enumerate() {
            let phase = omega * t_s + 1.7 * i as f64;
            for (n, q) in jet.iter_mut().enumerate() {
                *q += amplitude * omega.powi(n as i32) * (phase + n as f64 * FRAC_PI_2).sin();
            }
        }
        jet
    };
    let motor_at = |t_s: f64| -> [f64; 4] {
        let [q, v, a, j, s] = jet(t_s);
        let weight = [q.sin(), q.cos() * v, q.cos() * a - q.sin() * v * v];
        let angles =
            [q + (a + b1 * v + weight[0]) / k1, v + (j + b1 * a + weight[1]) / k1, a + (s + b1 * j + weight[2]) / k1];
        let current = (angles[2] + k2 * (angles[0] - q) + b2 * angles[1]) / b0 + f_c * (angles[1] / 0.02).tanh();
        [angles[0], angles[1], angles[2], current]
    };
    let step_rad = std::f64::consts::TAU / f64::from(1 << 20);
    let ticks = (seconds / period_s) as usize;
    let at = |k: usize, share: f64| motor_at((k as f64 + share) * period_s);
    let rad = (0..ticks).map(|k| (at(k, 0.0)[0] / step_rad).round() * step_rad).collect();
    // Mean over a tick, by Simpson's rule.
    let held = |k: usize| (at(k, 0.0)[3] + 4.0 * at(k, 0.5)[3] + at(k, 1.0)[3]) / 6.0;
    Record { period_s, link: None, motor: Angle { rad, step_rad }, held_a: (0..ticks).map(held).collect() }
}

/// Frequencies around the anti-resonance of this link, 5.3 rad/s, and around its resonance, 112 rad/s.
const SLOW: [(f64, f64); 5] = [(0.15, 2.3), (0.1, 4.1), (0.06, 5.7), (0.04, 7.9), (0.02, 11.3)];
const QUICK: [(f64, f64); 5] = [(0.01, 37.0), (0.01, 61.0), (0.008, 89.0), (0.008, 131.0), (0.006, 197.0)];

#[test]
fn a_link_that_swings_is_seen_from_the_motor_alone() {
    let found = identify(&swung(&SLOW, &QUICK, 8.0), &sheet(), &PlantData::with_lag(0.0)).expect("a rich record");
    for ((name, truth), bar) in SWUNG.into_iter().zip([2e-3, 2e-2, 0.03, 0.1, 0.03, 0.1]) {
        let Parameter { value, interval, .. } = *found.parameter(name).expect("a parameter");
        println!("{name}: {value} +- {interval:.2e}, true {truth}, off by {:.1e}", value / truth - 1.0);
        assert!((value / truth - 1.0).abs() <= bar, "{name}: {value} for {truth}");
        assert!((value - truth).abs() <= interval, "{name}: {value} +- {interval} for {truth}");
    }
    assert!(found.link.is_none() && found.parameter("g").is_none() && found.parameter("c").is_none());
    let Sheet::Joint(joint) = found.sheet else { panic!("a joint") };
    assert!((joint.weight_n_m - Joint::TABLE_I.weight_n_m).abs() < 1e-12, "{joint:?}");
}

/// A recording of another implementation with moves of 2 s, which are slower than the link and therefore less
/// informative. The second data sheet has a weight that is half as large again; the interval of k_1 covers the effect.
#[test]
fn what_the_motor_alone_says_is_as_true_as_it_is_stated() {
    let heavy = Sheet::Joint(Joint { weight_n_m: 1.5 * Joint::TABLE_I.weight_n_m, ..Joint::TABLE_I });
    let independent = Record { link: None, ..recorded() };
    let truths: [&[(&str, f64)]; 2] =
        [&[TRUTH[0], TRUTH[1], TRUTH[4], TRUTH[6]].map(|(name, truth, _)| (name, truth)), &SWUNG];
    for (record, sheet, truth, most) in
        [(independent, sheet(), truths[0], 1e-2), (swung(&SLOW, &QUICK, 8.0), heavy, truths[1], 3e-2)]
    {
        let found = identify(&record, &sheet, &KNOWN).expect("a rich record");
        for &(name, truth) in truth {
            let Parameter { value, interval, .. } = *found.parameter(name).expect("a parameter");
            println!("{name}: {value} +- {interval:.2e}, true {truth}, off by {:.1e}", value / truth - 1.0);
            assert!((value - truth).abs() <= interval, "{name}: {value} +- {interval} for {truth}");
        }
        let k_1 = found.parameter("k_1").expect("a parameter").value;
        assert!((k_1 / truth[0].1 - 1.0).abs() < most, "{k_1}");
    }
}

#[test]
fn without_moves_at_the_links_own_frequency_the_motor_alone_is_refused() {
    let refused = |record: &Record| identify(record, &sheet(), &KNOWN).expect_err("a poor record").to_string();
    // The multisine and slow motion: the link follows the motor.
    let told = refused(&swung(&[(0.15, 0.3)], &QUICK, 8.0));
    println!("{told}");
    assert!(told.contains("--motor-alone"), "{told}");
    // For half a second the recorded current differs from the held one.
    let mut other_current = swung(&SLOW, &QUICK, 8.0);
    let at = other_current.held_a.len() / 2;
    other_current.held_a[at..at + 500].fill(0.0);
    let told = refused(&other_current);
    println!("{told}");
    assert!(told.contains("does not fit"), "{told}");
    // Moves alone do not identify the motor.
    let told = refused(&swung(&SLOW, &[], 8.0));
    println!("{told}");
    assert!(told.contains("multisine"), "{told}");
    // Too short to subtract slow parts.
    let told = refused(&swung(&SLOW, &QUICK, 1.1));
    println!("{told}");
    assert!(told.contains("3 s"), "{told}");
    let mut other = swung(&SLOW, &QUICK, 8.0);
    other.held_a.iter_mut().for_each(|u| *u = -*u);
    assert!(refused(&other).contains("sign of the current"));
}

/// The zeros of two encoders are arbitrary: a constant twist changes c and leaves k_1 unchanged.
#[test]
fn an_offset_between_the_encoders_is_no_twist() {
    let record = recorded();
    let found =
        |record: &Record| identify(record, &sheet(), &PlantData::with_lag(0.0)).unwrap_or_else(|why| panic!("{why}"));
    let of_record = found(&record);
    let [k_1, load] = ["k_1", "c"].map(|name| of_record.parameter(name).expect("a link").value);
    for offset_rad in [0.6, -7.0] {
        let mut moved = record.clone();
        moved.motor.rad.iter_mut().for_each(|rad| *rad += offset_rad);
        let found = found(&moved);
        let [k, c] = ["k_1", "c"].map(|name| *found.parameter(name).expect("a link"));
        println!("{offset_rad} rad: {k:?} {c:?} {:?}", found.link);
        assert!((k.value / k_1 - 1.0).abs() < 1e-6, "{k:?}");
        assert!(
            (c.value - load + k_1 * offset_rad).abs() < 1e-3 && found.link.expect("a link").condition < 10.0,
            "{c:?}"
        );
    }
}

#[test]
fn the_linear_start_alone_is_near() {
    let record = recorded();
    let (q, motor) = (settled(&record, record.link.as_ref().expect("a link")), settled(&record, &record.motor));
    let start = link::start(&q, &motor, record.period_s, 100.0).expect("a start");
    let off = start[0] / (9.0 / 0.23 * 0.5) - 1.0;
    println!("start: k_1 off by {off:.1e}");
    assert!(off.abs() < 1e-3);
}

/// Ten deviations cover a synthetic link, two may not: rounding of counts is not white noise.
#[test]
fn a_synthetic_link_is_found_within_ten_deviations() {
    let (period_s, step) = (1e-3, std::f64::consts::TAU / f64::from(1 << 20));
    let rounded = |angles: Vec<f64>| angles.into_iter().map(|angle| (angle / step).round() * step).collect::<Vec<_>>();
    let at = |k: i32| 1e-3 * f64::from(k);
    let angle = |t_s: f64| 0.4 * (1.0 - (2.0 * t_s).cos()) + 0.05 * (40.0 * t_s).sin();
    // The reference uses steps of one period from samples at half of it, unlike the fit.
    let halves: Vec<f64> = (0..6000).map(|k| angle(0.5 * at(k))).collect();
    let truth = [30.0, 0.4, 1.2, 0.3, 0.01, 0.2, 0.0];
    let q = rounded(link::simulated(&truth, &halves, 0.5 * period_s));
    let motor = rounded((0..3000).map(|k| angle(at(k))).collect());
    let start = link::start(&q, &motor, period_s, 100.0).expect("a start");
    let fit = link::fit(&q, &motor, period_s, &start, Correction::NONE, false).expect("numbers");
    let deviations = fit.deviations(link::lags(period_s));
    for (j, bar) in [30e-5, 0.4 * 5e-4, 3e-4, 3e-4].into_iter().enumerate() {
        let off = (fit.values[j] - truth[j]).abs();
        println!("{}: off by {off:.1e}, deviation {:.1e}", ["k_1", "b_1", "g", "c"][j], deviations[j]);
        assert!(off < bar && off < 10.0 * deviations[j]);
    }
    assert!((fit.rms() / step - 0.289).abs() < 0.06, "{}", fit.rms() / step);
}

/// With the motor held at A sin ωt and g = 0 the link swings with (k_1 + i ω d_1) A/(k_1 - ω² + i ω (b_1 + d_1)), after
/// the initial transient.
#[test]
fn a_damped_spring_passes_on_what_its_closed_form_says() {
    let (k_1, b_1, d_1, omega, period_s) = (30.0, 1.5, 0.8, 9.0, 1e-3);
    let at = |k: i32| period_s * f64::from(k);
    let motor: Vec<f64> = (0..30_000).map(|k| (omega * at(k)).sin()).collect();
    let q = link::simulated(&[k_1, b_1, 0.0, 0.0, 0.0, 0.0, d_1], &motor, period_s);
    let (over, under) = ([k_1, omega * d_1], [k_1 - omega * omega, omega * (b_1 + d_1)]);
    let size = under[0] * under[0] + under[1] * under[1];
    let gain = [(over[0] * under[0] + over[1] * under[1]) / size, (over[1] * under[0] - over[0] * under[1]) / size];
    // The transient decays with 1.15 1/s for 25 s.
    for (k, found) in q.iter().enumerate().skip(12_500) {
        let t_s = 2.0 * period_s * k as f64;
        let expected = gain[0] * (omega * t_s).sin() + gain[1] * (omega * t_s).cos();
        assert!((found - expected).abs() < 1e-8, "{t_s}: {found} {expected}");
    }
}

#[test]
fn mistakes_in_a_file_are_told_with_their_place() {
    let head = "tick,count_link,count_motor,u_held_a\n";
    let rows = |count: u32| (0..count).map(|k| format!("{k},{k},{k},0.5\n")).collect::<Vec<_>>().concat();
    let told = |text: &str| {
        let found = record::read(text, 1e-3, record::RecordingKind::Joint, &[Mounted::new(Encoder::absolute(20)); 2]);
        found.map_err(|it| format!("{}:{}: {}", it.line, it.column, it.message))
    };
    assert!(told(&format!("{head}{}", rows(1200))).is_ok());
    assert!(told(&format!("\u{feff}{head}{}", rows(1200))).is_ok());
    // Time in seconds, another order of columns, an unused column and blanks.
    let other = (0..1200).map(|k| format!("0.5, {k}, x, {k}, {}\n", f64::from(k) * 1e-3)).collect::<Vec<_>>().concat();
    assert_eq!(
        told(&format!("u_held_a, count_motor, note, count_link, t_s\n{other}")),
        told(&format!("{head}{}", rows(1200)))
    );
    // Each step is within the jitter of a clock, but the mean is not: 1.09 periods would change b by a fifth.
    let drifting = |by: f64| {
        let row = |k: u32| format!("{},{k},{k},0.5\n", f64::from(k) * 1e-3 * by);
        format!("t_s,count_link,count_motor,u_held_a\n{}", (0..1200).map(row).collect::<Vec<_>>().concat())
    };
    assert!(told(&drifting(1.004)).is_ok());
    for by in [1.09, 0.99] {
        let error = told(&drifting(by)).expect_err("another clock");
        assert!(error.starts_with("1201:1: t_s advances") && error.contains("periods of 0.001 s per row"), "{error}");
    }
    for (text, place, what) in [
        (String::new(), "1:1", "empty"),
        ("tick,count_motor,u_held_a\n".into(), "1:1", "no column count_link"),
        ("tick,count_links,count_motor,u_held_a\n".into(), "1:1", "did you mean \"count_links\"?"),
        (format!("{head}{}", rows(10)), "11:1", "at least 1 s"),
        (format!("{head}0,1,2,3\n1,,2,3\n"), "3:3", "a sample was lost"),
        (format!("{head}0,1,2,3\n3,1,2,3\n"), "3:1", "2 ticks were lost"),
        (format!("{head}0,1,2,3\n0,1,2,3\n"), "3:1", "expected 1"),
        (format!("{head}0,1,2,x\n"), "2:7", "expected a number"),
        (format!("{head}0,1,2,nan\n"), "2:7", "expected a number"),
        (format!("{head}0,1.5,2,3\n"), "2:3", "whole count"),
        (format!("{head}0,1,2\n"), "2:6", "ends before u_held_a"),
        (format!("{head}0,1,2,3,4\n"), "2:9", "\"4\" has no column: the head has 4"),
        (head.replace(',', ";"), "1:5", "expected commas between columns, found semicolons"),
        (head.replace(',', "\t"), "1:5", "found tabs"),
        (head.replace("link", "motor"), "1:18", "duplicate column \"count_motor\""),
    ] {
        let refused = told(&text).expect_err(what);
        assert!(refused.starts_with(&format!("{place}: ")) && refused.contains(what), "{refused}");
    }
}

/// A counter that counts down passes its wrap and its offset.
#[test]
fn counts_wrap_and_angles_do_not() {
    // 10 000 states of a timer behind 2500 lines, and 100 revolutions of 4096 counts.
    let timers =
        [Encoder::incremental(14, 10_000).wrapping_at(10_000), Encoder::incremental(19, 4096).wrapping_at(409_600)];
    for encoder in [Encoder::absolute(14)].into_iter().chain(timers) {
        let mounting = controller_core::drive::Mounting { is_reversed: true, offset_counts: 100 };
        let mounted = Mounted { encoder, mounting };
        let angles: Vec<f64> = (0..40_000).map(|k| 900.0 * (2e-4 * f64::from(k)).sin()).collect();
        let found = record::unwrapped(angles.iter().map(|angle| mounted.count(*angle)), &mounted);
        for (found, angle) in found.rad.iter().zip(&angles) {
            assert!((found - angle).abs() <= 0.5001 * found_step(&mounted), "{encoder:?}: {found} {angle}");
        }
    }
}

fn found_step(mounted: &Mounted) -> f64 {
    mounted.encoder.unit_rad()
}

/// Motor behind a gear, integrated in steps of 10 us, along a sine under a simple loop: K_t, inertia of the rotor,
/// gear, Coulomb friction behind the gear. Ten sines excite the current.
struct Geared {
    torque: f64,
    inertia: f64,
    gear: f64,
    friction: f64,
    /// Travel of the sine, rad, and peak of the excitation, A.
    way_rad: f64,
    shaken_a: f64,
}

const GEARED: Geared = Geared { torque: 0.29, inertia: 1e-3, gear: 9.0, friction: 0.2, way_rad: 1.0, shaken_a: 4.0 };

impl Geared {
    fn recorded(&self) -> Record {
        let (period_s, inner, step_rad) = (1e-3, 100, std::f64::consts::TAU / 16384.0 / self.gear);
        let (inertia, torque) = (self.gear * self.gear * self.inertia, self.gear * self.torque);
        let (mut q, mut v, mut record) = (0.0_f64, 0.0_f64, Record { period_s, ..Record::default() });
        record.motor.step_rad = step_rad;
        for k in 0..6000 {
            let t_s = period_s * f64::from(k);
            let sines = (1..=10).map(|n| f64::from(n * 7)).map(|hz| (std::f64::consts::TAU * hz * t_s + hz * hz).sin());
            let wanted = self.way_rad * (1.0 - (2.0 * t_s).cos());
            let by_loop = inertia / torque * (900.0 * (wanted - q) - 45.0 * v);
            let u = (by_loop + self.shaken_a * 0.2 * sines.sum::<f64>()).clamp(-20.0, 20.0);
            record.motor.rad.push((q / step_rad).round() * step_rad);
            record.held_a.push(u);
            for _ in 0..inner {
                let step_s = period_s / f64::from(inner);
                v += step_s * (torque * u - self.friction * (v / 1e-3).tanh()) / inertia;
                q += step_s * v;
            }
        }
        record
    }

    /// Returns the data sheet behind the gear for numbers that were entered for the motor.
    fn sheet(&self, torque: f64, inertia: f64) -> Sheet {
        let squared = self.gear * self.gear;
        let [torque_n_m_per_a, inertia_kg_m2] = [self.gear * torque, squared * inertia];
        Sheet::Motor(Motor { inertia_kg_m2, torque_n_m_per_a, damping_n_m_s: 0.0 })
    }
}

#[test]
fn numbers_of_the_gears_output_are_named_with_what_to_type_instead() {
    let (record, known) = (GEARED.recorded(), PlantData { gear: GEARED.gear, ..PlantData::with_lag(0.0) });
    let Geared { torque, inertia, .. } = GEARED;
    let right = identify(&record, &GEARED.sheet(torque, inertia), &known).expect("a good record");
    let b = right.parameter("b").expect("b").value;
    assert!((b * 9.0 * inertia / torque - 1.0).abs() < 0.02, "{b}");
    let told = |torque: f64, inertia: f64| {
        let refused = identify(&record, &GEARED.sheet(torque, inertia), &known).expect_err("numbers of the output");
        println!("{refused}");
        refused.to_string()
    };
    let of_torque = told(2.6, inertia);
    assert!(of_torque.starts_with("b is 0.11") && of_torque.contains("a gear of 9 explains"), "{of_torque}");
    assert!(of_torque.contains(": set motor.torque_n_m_per_a = 0.2889"), "{of_torque}");
    let of_inertia = told(torque, 81.0 * inertia);
    assert!(of_inertia.starts_with("b is 80.") || of_inertia.starts_with("b is 81."), "{of_inertia}");
    assert!(of_inertia.contains("motor.inertia_kg_m2 refers to the output of the gear, 81 times"), "{of_inertia}");
    let of_both = told(2.6, 81.0 * inertia);
    assert!(of_both.contains("motor.torque_n_m_per_a") && of_both.contains("motor.inertia_kg_m2"), "{of_both}");
    // Cases that no gear explains are refused as before: three times the torque constant, or a gear that is not in the
    // file.
    let refused = identify(&record, &GEARED.sheet(3.0 * torque, inertia), &known).expect_err("three times");
    assert!(matches!(refused, Refusal::OutOfTolerance { name: "b", .. }), "{refused}");
    let none = PlantData { gear: 1.0, ..known };
    let refused = identify(&record, &GEARED.sheet(2.6, inertia), &none).expect_err("no gear");
    assert!(!matches!(refused, Refusal::Geared { .. }), "{refused}");
}

/// Joint of the independent recording, as a file with a gear would describe it.
#[test]
fn of_a_joint_torque_constant_and_inertia_of_the_gears_output_are_told_apart() {
    let gear = 5.0;
    let known = PlantData { gear, ..KNOWN };
    // Near the truth, because this recording is 50 % off the data sheet.
    let inertia = 4.5 / TRUTH[4].1;
    let right = Joint {
        stiffness_n_m: 4.5,
        motor_inertia_kg_m2: inertia,
        torque_n_m_per_a: TRUTH[6].1 * inertia,
        ..Joint::TABLE_I
    };
    let told = |torque: f64, inertia: f64| {
        let typed = Joint {
            torque_n_m_per_a: torque * right.torque_n_m_per_a,
            motor_inertia_kg_m2: inertia * right.motor_inertia_kg_m2,
            ..right
        };
        identify(&recorded(), &Sheet::Joint(typed), &known).expect_err("numbers of the output")
    };
    for (torque, inertia, keys) in [
        (gear, 1.0, &["joint.torque_n_m_per_a"][..]),
        (1.0, gear * gear, &["joint.motor_inertia_kg_m2"]),
        (gear, gear * gear, &["joint.torque_n_m_per_a", "joint.motor_inertia_kg_m2"]),
    ] {
        let refused = told(torque, inertia);
        println!("{refused}");
        let Refusal::Geared { numbers, .. } = &refused else { panic!("{torque} {inertia}: {refused}") };
        assert!(numbers.iter().map(|(key, ..)| *key).eq(keys.iter().copied()), "{torque} {inertia}: {refused}");
    }
}

#[test]
fn a_record_of_another_kind_of_plant_is_named() {
    let row = |k: u32| format!("{k},{k},{k},0.5\n");
    let of_joint = format!("tick,count_link,count_motor,u_held_a\n{}", (0..1200).map(row).collect::<String>());
    let encoder = Mounted::new(Encoder::absolute(14));
    let told = record::read(&of_joint, 1e-3, record::RecordingKind::Motor, &[encoder]).expect_err("a joint's");
    assert_eq!((told.line, told.column), (1, 6));
    assert!(told.message.contains("belongs to a joint, but the scenario has [motor]"), "{}", told.message);
    assert!(record::read(&of_joint, 1e-3, record::RecordingKind::JointAlone, &[encoder]).is_ok());
    let row = |k: u32| format!("{k},{k},0.5\n");
    let of_motor = format!("tick,count_motor,u_held_a\n{}", (0..1200).map(row).collect::<String>());
    let told = record::read(&of_motor, 1e-3, record::RecordingKind::Joint, &[encoder; 2]).expect_err("a motor's");
    assert!(told.message.contains("for a motor recording"), "{}", told.message);
    // Ticks have no time: another period changes only b, by its square, and the refusal names the period.
    let half = Record { period_s: 0.5e-3, ..GEARED.recorded() };
    let refused = identify(&half, &GEARED.sheet(GEARED.torque, GEARED.inertia), &PlantData::with_lag(0.0));
    let told = refused.expect_err("another period").to_string();
    println!("{told}");
    assert!(told.contains("drive.period_s"), "{told}");
}

#[test]
fn a_record_that_cannot_tell_says_which_parameters_and_what_to_record() {
    let sheet = GEARED.sheet(GEARED.torque, GEARED.inertia);
    let told = |record: &Record| {
        let refused = identify(record, &sheet, &PlantData::with_lag(0.0)).expect_err("a record that says nothing");
        println!("{refused}");
        refused.to_string()
    };
    let good = GEARED.recorded();
    // No excitation, and an excitation close to 0.
    for shaken_a in [0.0, 0.02] {
        let quiet = told(&Geared { shaken_a, ..GEARED }.recorded());
        assert!(quiet.contains('b') && quiet.contains("multisine"), "{quiet}");
    }
    // No acceleration: constant speed against friction.
    let even = Record {
        motor: Angle {
            rad: (0..6000).map(|k| (f64::from(k) * 1e-3 / 4.3e-5).round() * 4.3e-5).collect(),
            step_rad: 4.3e-5,
        },
        held_a: (0..6000).map(|k| 0.08 + 1e-3 * f64::from(k % 2)).collect(),
        ..good.clone()
    };
    let told_even = told(&even);
    assert!(told_even.contains("b and f_c not") || told_even.contains("b identified to"), "{told_even}");
    assert!(told_even.contains("multisine"), "{told_even}");
    // No excitation at all.
    let steady = told(&Record { held_a: vec![0.08; 6000], ..good.clone() });
    assert!(steady.starts_with("b and f_c not identifiable: u_held_a is 0.08 A"), "{steady}");
    // Too few counts: a move of 0.5 mrad, and an encoder of 6 bits.
    let short = told(&Geared { way_rad: 0.0, shaken_a: 0.05, ..GEARED }.recorded());
    assert!(
        short.starts_with("b and f_c not identifiable: the motor moves by") && short.contains("longer moves"),
        "{short}"
    );
    let step_rad = std::f64::consts::TAU / 64.0;
    let rad = good.motor.rad.iter().map(|rad| (rad / step_rad).round() * step_rad).collect();
    let coarse = told(&Record { motor: Angle { rad, step_rad }, ..good });
    assert!(coarse.contains("b and f_c not"), "{coarse}");
}
