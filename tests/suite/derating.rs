//! Derated power stages: a stage that gives less current than the design assumes, because it is hot, on a low supply,
//! or has a full brake resistor. The stage reports its limit to the controller, or the controller finds it from
//! reports. The plants are the suite's own.

use controller_core::drive::{
    Encoder, Joint, JointDesign, JointDrive, Monitored, Motor, MotorDesign, MotorDrive, Position, Sample, Target,
};
use controller_core::{Health, Limits, Running};
use integration_tests::drive::{Flexible, Shaft};
use std::f64::consts::TAU;

const PERIOD_S: f64 = 1e-3;
const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
const DESIGN: MotorDesign = MotorDesign::by_rule(PERIOD_S, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
type Drive = MotorDrive<f32, Position, 1>;

/// Source of the limit in the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
enum LimitSource {
    Nothing,
    Limit,
    Reports,
}

/// Converts r and r' to a target.
fn target([r, v]: [f64; 2]) -> Target<f32, i32, 2> {
    let turn = (r / TAU).round();
    Target { turn: turn as i32, jet: [(r - turn * TAU) as f32, v as f32] }
}

/// Runs a motor on a stage that gives `most` A at a time. Returns the largest |y|, |u|, and |e| from 0.3 s before the
/// end.
fn run(told: LimitSource, seconds: f64, most: impl Fn(f64) -> f64, reference: impl Fn(f64) -> [f64; 2]) -> [f64; 3] {
    let law = Drive::design(&DESIGN);
    let mut running = Running::new(law);
    let mut shaft = Shaft { x: [reference(0.0)[0], 0.0, 0.0], ..Shaft::ROUGH };
    let (mut worst, ticks) = ([0.0_f64; 3], (seconds / PERIOD_S) as u32);
    for k in 0..ticks {
        let t = f64::from(k) * PERIOD_S;
        let count = (shaft.x[0] / DESIGN.encoder.unit_rad()).round() as i32;
        shaft.largest_current = most(t);
        if told == LimitSource::Limit {
            running.limit(most(t) as f32);
        }
        let [begin, end] = [t, t + PERIOD_S].map(|t| target(reference(t)));
        let output = running.tick(&Sample { counts: [Some(count)], begin, end });
        let u = f64::from(output.u);
        shaft.advance(t, u, PERIOD_S);
        if told == LimitSource::Reports {
            running.report_applied(u.clamp(-most(t), most(t)) as f32);
        }
        if t > 0.3 {
            worst[0] = worst[0].max(shaft.x[0].abs());
            worst[1] = worst[1].max(u.abs());
        }
        if t > seconds - 0.3 {
            worst[2] = worst[2].max((shaft.x[0] - reference(t + PERIOD_S)[0]).abs());
        }
    }
    worst
}

fn sine(t: f64) -> [f64; 2] {
    let omega = TAU * 4.0;
    [(omega * t).sin(), omega * (omega * t).cos()]
}

/// 1 rad at 4 Hz needs 2.5 A, and the stage gives 2 A. The shaft stays near the commanded range. It follows again when
/// the stage has cooled.
#[test]
fn a_shaft_on_a_derated_stage_stays_where_it_is_asked_to_be() {
    let [_, _, healthy] = run(LimitSource::Nothing, 3.0, |_| 10.0, sine);
    for told in [LimitSource::Limit, LimitSource::Reports] {
        let [y, u, _] = run(told, 3.0, |_| 2.0, sine);
        let [_, _, error] = run(told, 3.0, |t| if t < 1.5 { 2.0 } else { 10.0 }, sine);
        println!("{told:?}: |y| up to {y:.3} rad, |u| up to {u:.2} A; {error:.5} rad off after it has recovered");
        assert!(y < 1.2 && (told == LimitSource::Reports || u <= 2.0), "{told:?}: {y} {u}");
        assert!(error < 1.05 * healthy, "{told:?}: {error} for {healthy}");
    }
}

/// A stage that switches off for a while, and a stage whose limit fades.
#[test]
fn a_stage_that_fades_and_comes_back_leaves_no_trace() {
    let [_, _, healthy] = run(LimitSource::Nothing, 4.0, |_| 10.0, sine);
    for told in [LimitSource::Limit, LimitSource::Reports] {
        let off = |t: f64| if (1.0..1.2).contains(&t) { 0.0 } else { 10.0 };
        let fading = |t: f64| (10.0 - 5.0 * t).clamp(0.5, 10.0) + if t > 2.5 { 9.5 } else { 0.0 };
        for (most, name) in [(&off as &dyn Fn(f64) -> f64, "off for 0.2 s"), (&fading, "fading")] {
            let [y, _, error] = run(told, 4.0, most, sine);
            println!("{told:?}, {name}: |y| up to {y:.3} rad, {error:.5} rad off in the end");
            assert!(error < 1.05 * healthy, "{told:?}, {name}: {error} for {healthy}");
        }
    }
}

/// A limit not below the design's, and reports of the full output, change no bit.
#[test]
fn a_stage_that_gives_all_changes_nothing() {
    let plain = run(LimitSource::Nothing, 2.0, |_| 10.0, sine);
    for told in [LimitSource::Limit, LimitSource::Reports] {
        assert_eq!(run(told, 2.0, |_| 10.0, sine).map(f64::to_bits), plain.map(f64::to_bits), "{told:?}");
    }
    let mut running = Running::new(Drive::design(&DESIGN));
    assert!(!running.limit(1.0), "before the start");
    let rest = target([0.0; 2]);
    running.tick(&Sample { counts: [Some(0)], begin: rest, end: rest });
    assert!(running.limit(1.0) && running.limit(0.0) && running.limit(1e30));
    assert!(!running.limit(-1.0) && !running.limit(f32::NAN));
}

/// A saturated shaft reaches a target at rest without swings, from any distance and speed, with the full current and a
/// fifth of it. A shaft that is too fast to stop before the target may pass it once.
#[test]
fn a_saturated_shaft_comes_to_its_target_without_swings() {
    let mut seed = 7_u64;
    let mut random = |low: f64, high: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        low + (high - low) * ((seed >> 33) as f64 / f64::from(1_u32 << 31))
    };
    let (mut worst, mut twice) = (0.0_f64, 0);
    for k in 0..if integration_tests::deep() { 5000 } else { 150 } {
        let most = if k % 2 == 0 { 10.0 } else { 2.0 };
        let (distance, speed) = (random(-30.0, 30.0), random(-150.0, 150.0));
        let factor = random(0.8, 1.25);
        let law = Drive::design(&DESIGN);
        let mut running = Running::new(law);
        let mut shaft = Shaft { x: [0.0, speed, 0.0], inertia: 2e-4 * factor, ..Shaft::ROUGH };
        shaft.largest_current = most;
        // Stopping distance at the full current, from the start.
        let stop = speed * speed.abs() / (2.0 * most * 0.05 / shaft.inertia);
        let mut goal = None;
        let (mut side, mut passes, mut past) = (0.0, 0, 0.0_f64);
        for k in 0..6000_u32 {
            let t = f64::from(k) * PERIOD_S;
            let count = (shaft.x[0] / DESIGN.encoder.unit_rad()).round() as i32;
            let place = *goal.get_or_insert(shaft.x[0] + distance);
            let rest = target([place, 0.0]);
            running.limit(most as f32);
            let output = running.tick(&Sample { counts: [Some(count)], begin: rest, end: rest });
            shaft.advance(t, f64::from(output.u), PERIOD_S);
            let left = place - shaft.x[0];
            // Small swings within the linear band do not count.
            if left.abs() > 0.02 {
                if side * left < 0.0 {
                    passes += 1;
                    past = 0.0;
                }
                side = left;
                past = past.max(left.abs());
            }
        }
        // One pass is allowed if the shaft is too fast to stop before the target after 12 ms without current.
        let due = distance * stop > 0.0 && stop.abs() + 0.012 * speed.abs() > 0.9 * distance.abs();
        if passes > u32::from(due) {
            twice += 1;
            worst = worst.max(past);
            println!(
                "{most} A, {distance:.2} rad, {speed:.1} rad/s, J x {factor:.2}: {passes} passes, {past:.3} rad past"
            );
        }
    }
    assert!(twice == 0, "{twice} swing, by {worst} rad at most");
}

/// A brake also respects the present limit.
#[test]
fn a_brake_keeps_to_the_present_limit() {
    let law = Drive::design(&DESIGN);
    let mut running = Running::new(Monitored::new(law, &DESIGN.bounds(&law, 0.2)).braking());
    let mut shaft = Shaft::ROUGH;
    let reference = |t: f64| if t < 0.5 { [30.0 * t * t, 60.0 * t] } else { [7.5 + 30.0 * (t - 0.5), 30.0] };
    for k in 0..3000_u32 {
        let t = f64::from(k) * PERIOD_S;
        let count = (shaft.x[0] / DESIGN.encoder.unit_rad()).round() as i32;
        let [begin, end] = [t, t + PERIOD_S].map(|t| target(reference(t)));
        running.limit(if k < 1000 { 10.0 } else { 1.5 });
        if k == 1000 {
            running.trip();
        }
        let output = running.tick(&Sample { counts: [Some(count)], begin, end });
        assert!(k < 1000 || output.u.abs() <= 1.5, "tick {k}: {output:?}");
        shaft.advance(t, f64::from(output.u), PERIOD_S);
        if output.health.contains(Health::STOPPED) {
            println!("stopped {} ticks after the trip at {:.4} rad/s", k - 1000, shaft.x[1]);
            assert!(shaft.x[1].abs() < 0.1);
            return;
        }
    }
    panic!("it does not stop: {shaft:?}");
}

/// The link of Table I on a stage that gives a third of the current that its sine needs.
#[test]
fn a_joint_on_a_derated_stage_stays_bounded() {
    let design = JointDesign::new(PERIOD_S, Joint::TABLE_I, [Encoder::absolute(20); 2], Limits::symmetric(30.0), 1.3);
    let law = JointDrive::<f32, Position, 1>::design(&design);
    let unit = design.encoders[0].unit_rad();
    let omega = TAU * 0.8;
    let jet = |t: f64| {
        let (sin, cos) = (omega * t).sin_cos();
        [0.8 * sin, 0.8 * omega * cos, -0.8 * omega * omega * sin, -0.8 * omega * omega * omega * cos]
    };
    let run = |most: f64, told: bool| {
        let mut running = Running::new(law);
        let mut plant = Flexible::NOMINAL;
        let [mut far, mut largest] = [0.0_f64; 2];
        for k in 0..8000_u32 {
            let t = f64::from(k) * PERIOD_S;
            let counts = [plant.x[0], plant.x[2] / Flexible::K_1].map(|angle| Some((angle / unit).round() as i32));
            let [begin, end] = [t, t + PERIOD_S].map(|t| Target { turn: 0, jet: jet(t).map(|r| r as f32) });
            if told {
                running.limit(most as f32);
            }
            let u = f64::from(running.tick(&Sample { counts, begin, end }).u);
            plant.advance(t, u.clamp(-most, most), PERIOD_S);
            if !told {
                running.report_applied(u.clamp(-most, most) as f32);
            }
            largest = largest.max(u.abs());
            far = if k > 3000 { far.max(plant.x[0].abs()) } else { far };
        }
        [far, largest]
    };
    for most in [30.0, 20.0, 15.0, 10.0] {
        let [[y, u], [found, _]] = [run(most, true), run(most, false)];
        println!("{most} A: |y| up to {y:.3} rad told, {found:.3} rad found, |u| up to {u:.2} A");
        assert!(y < 1.1 * 0.8 && found < 1.1 * 0.8 && u <= most, "{most} A: {y} {found} {u}");
    }
}
