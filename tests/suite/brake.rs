//! Braking drives: triggers of the brake, stopping distance and time, range limits, and the end of the current. The
//! plants are the suite's own, with friction, cogging and a current loop.

use controller_core::drive::{
    Encoder, Fence, FenceLimits, Joint, JointDesign, JointDrive, Monitored, Motor, MotorDesign, MotorDrive, Position,
    Sample, Target,
};
use controller_core::{Health, Limits, Output, Running};
use integration_tests::drive::{Flexible, Shaft};
use std::cell::Cell;
use std::f64::consts::TAU;

const PERIOD_S: f64 = 1e-3;
const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
const DESIGN: MotorDesign = MotorDesign::by_rule(PERIOD_S, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
type Drive = MotorDrive<f32, Position, 1>;

/// Reference r and r' at a time, s.
type Jets<'a> = &'a dyn Fn(f64) -> [f64; 2];

/// Motor under its drive, which follows a reference.
struct Rig<'a> {
    running: Running<Monitored<Drive, 1>>,
    fence: Option<Fence>,
    shaft: Shaft,
    tick: u32,
    seen: Health,
    reference: Jets<'a>,
}

impl<'a> Rig<'a> {
    fn new(shaft: Shaft, reference: Jets<'a>) -> Self {
        let law = Drive::design(&DESIGN);
        let running = Running::new(Monitored::new(law, &DESIGN.bounds(&law, 0.2)).braking());
        Self { running, fence: None, shaft, tick: 0, seen: Health::OK, reference }
    }

    /// Runs one period; `seen` maps the true count to the measured count.
    fn period(&mut self, seen: impl FnOnce(i32) -> Option<i32>) -> Output<f32> {
        let t = f64::from(self.tick) * PERIOD_S;
        let target = |[r, v]: [f64; 2]| {
            let turn = (r / TAU).round();
            Target { turn: turn as i32, jet: [(r - turn * TAU) as f32, v as f32] }
        };
        let [begin, end] = [t, t + PERIOD_S].map(|t| target((self.reference)(t)));
        let count = seen((self.shaft.x[0] / DESIGN.encoder.unit_rad()).round() as i32);
        let mut output = self.running.tick(&Sample { counts: [count], begin, end });
        if let Some(fence) = &self.fence {
            fence.guard(&mut self.running, &mut output, &begin);
        }
        self.pass(t, &output);
        output
    }

    fn pass(&mut self, t: f64, output: &Output<f32>) {
        self.seen |= output.health;
        self.shaft.advance(t, f64::from(output.u), PERIOD_S);
        self.tick += 1;
    }

    fn healthy(&mut self, periods: u32) {
        for _ in 0..periods {
            self.period(Some);
        }
    }
}

/// Returns a ramp from rest to a speed within half a second.
fn ramp(speed: f64) -> impl Fn(f64) -> [f64; 2] {
    move |t| {
        let s = ((t - 0.1) / 0.5).max(0.0);
        if s > 1.0 { [speed * (t - 0.1 - 0.25), speed] } else { [speed * 0.25 * s * s, speed * s] }
    }
}

/// Stopping distance and time near the physical limits v²/(2 b u) and v/(b u), plus the last part, in which u is below
/// its limit. The drive then switches off the current at rest.
#[test]
fn a_motor_brakes_within_the_way_that_its_current_allows_and_lets_go_at_rest() {
    let (most, gain) = (10.0 * MOTOR.input_gain(), 0.5 * DESIGN.bandwidths.surface_rad_s);
    for speed in [3.0, 60.0, -200.0_f64] {
        let reference = ramp(speed);
        let mut rig = Rig::new(Shaft::ROUGH, &reference);
        rig.healthy(1000);
        assert!((rig.seen | Health::WAITS | Health::INPUT_REJECTED) == Health::WAITS | Health::INPUT_REJECTED);
        rig.running.trip();
        let (from, mut ticks, mut worst_u) = (rig.shaft.x[0], 0, 0.0_f32);
        let v = speed.abs();
        loop {
            let output = rig.period(Some);
            if output.health.contains(Health::STOPPED) {
                break;
            }
            assert!(output.health.contains(Health::BRAKES) && output.u.abs() <= 10.0, "{output:?}");
            worst_u = worst_u.max(output.u.abs());
            ticks += 1;
            assert!(ticks < 1000, "it does not come to rest");
        }
        let way = (rig.shaft.x[0] - from).abs();
        // Below v = b u/k_v the brake demands less than the current limit.
        let slow = v.min(most / gain);
        let [least, allowed] = [v * v / (2.0 * most), (v * v - slow * slow) / (2.0 * most) + slow / gain];
        let time_s = (v - slow) / most + 8.0 / gain;
        println!(
            "{speed} rad/s: {way:.3} rad in {ticks} ticks at up to {worst_u} A, {least:.3} at least; left {:.4} rad/s",
            rig.shaft.x[1]
        );
        assert!(way < 1.05 * allowed + 2e-3 * v && f64::from(ticks) * PERIOD_S < time_s + 0.01, "{way} {allowed}");
        assert!(rig.shaft.x[1].abs() < 0.05, "{} rad/s at the end", rig.shaft.x[1]);
        // The drive stays stopped, whatever the target does.
        assert_eq!(rig.period(Some).u, 0.0);
    }
}

/// A joint's spring carries the link on after the brake. After 0.8 s a fifth of the link speed is left; after that only
/// weight and load move the link.
#[test]
fn a_joint_brakes_and_its_link_comes_to_rest() {
    let design = JointDesign::new(PERIOD_S, Joint::TABLE_I, [Encoder::absolute(20); 2], Limits::symmetric(30.0), 1.3);
    let law = JointDrive::<f32, Position, 1>::design(&design);
    let mut running = Running::new(Monitored::new(law, &design.bounds(&law, 1.3, 0.2)).braking());
    let mut plant = Flexible::NOMINAL;
    let unit = design.encoders[0].unit_rad();
    let reference = |t: f64| {
        let s = (t / 1.0).min(1.0);
        [1.5 * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s), 1.5 * 30.0 * s * s * (1.0 - s) * (1.0 - s)]
    };
    let (mut from, mut speed, mut slow, mut stopped) = (0.0, 0.0, 0.0, None);
    for k in 0..8000_u32 {
        let t = f64::from(k) * PERIOD_S;
        let target = |t: f64| {
            let [r, v] = reference(t);
            let a = (reference(t + 1e-4)[1] - reference(t - 1e-4)[1]) / 2e-4;
            let j = (reference(t + 1e-4)[1] - 2.0 * v + reference(t - 1e-4)[1]) / 1e-8;
            Target { turn: 0, jet: [r as f32, v as f32, a as f32, j as f32] }
        };
        let counts = [plant.x[0], plant.x[2] / Flexible::K_1].map(|angle| Some((angle / unit).round() as i32));
        let output = running.tick(&Sample { counts, begin: target(t), end: target(t + PERIOD_S) });
        if k == 500 {
            (from, speed) = (plant.x[0], plant.x[1]);
            running.trip();
        }
        assert!(output.u.abs() <= 30.0 && !output.health.intersects(Health::OSCILLATES | Health::WRONG_WAY));
        if output.health.contains(Health::STOPPED) {
            stopped = stopped.or(Some((k, plant.x)));
            break;
        }
        plant.advance(t, f64::from(output.u), PERIOD_S);
        slow = if k == 1300 { plant.x[1] } else { slow };
    }
    let (tick, x) = stopped.expect("it stops");
    println!(
        "link at {speed:.2} rad/s: {:.3} rad on, let go after {} ms at {:.4} rad/s",
        x[0] - from,
        tick - 500,
        x[1]
    );
    assert!(speed > 2.0 && (x[0] - from).abs() < 1.0 && x[1].abs() < 0.1, "{x:?}");
}

/// A target that runs past the end of the range stops the shaft near the end; the allowed overrun is stated below.
#[test]
fn a_shaft_brakes_ahead_of_the_ends_of_its_range() {
    for speed in [2.0, 30.0, -120.0_f64] {
        let reference = ramp(speed);
        let side = speed.signum();
        let end = reference(0.8)[0];
        let limits = FenceLimits {
            low_rad: if side < 0.0 { end } else { -1.0 },
            high_rad: if side > 0.0 { end } else { 1.0 },
            ..FenceLimits::NONE
        };
        let mut rig = Rig::new(Shaft::ROUGH, &reference);
        rig.fence = Some(Fence::new(&limits, DESIGN.slowing(0)));
        let mut past = f64::NEG_INFINITY;
        for _ in 0..2000 {
            rig.period(Some);
            past = past.max(side * (rig.shaft.x[0] - end));
        }
        println!("{speed} rad/s to the end: at most {past:.4} rad past it, {:?}", rig.seen);
        assert!(rig.seen.contains(Health::END_OF_RANGE | Health::BRAKES | Health::STOPPED));
        // A target that runs through the end at full speed takes the shaft past it. The overrun is the brake's delay
        // distance: 1/k_v of the speed and the ticks until the brake acts. Friction is part of d and does not shorten
        // it.
        let constant_s = 2.0 / DESIGN.bandwidths.surface_rad_s + 2.0 * PERIOD_S;
        assert!(past < constant_s * speed.abs() && past > -0.02 * speed * speed / 30.0 - 0.5, "{past}");
    }
}

/// A target within the range may rest at its ends, return from outside, or be typed as a step, without an alarm.
#[test]
fn a_shaft_that_follows_its_target_goes_up_to_the_end_and_rests_there() {
    const END: f64 = 1.2;
    let limits = FenceLimits { low_rad: -END, high_rad: END, ..FenceLimits::NONE };
    let quintic = |t: f64, tau: f64, way: f64| {
        let s = ((t - 0.1) / tau).clamp(0.0, 1.0);
        [way * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s), way / tau * 30.0 * s * s * (1.0 - s) * (1.0 - s)]
    };
    let fast = move |t: f64| quintic(t, 0.06, END);
    let slow = move |t: f64| quintic(t, 1.0, -END);
    let sine = |t: f64| {
        let part = (t / 0.25).min(1.0);
        let omega = TAU * 2.0;
        [END * part * (omega * t).sin(), END * part * omega * (omega * t).cos()]
    };
    let typed = |t: f64| [if t < 0.1 { 0.0 } else { END }, 0.0];
    let resting = |_: f64| [END, 0.0];
    let back = |_: f64| [1.0, 0.0];
    let references: [(Jets<'_>, f64); 6] =
        [(&fast, 0.0), (&slow, 0.0), (&sine, 0.0), (&typed, 0.0), (&resting, END), (&back, 1.3)];
    for (k, (reference, start)) in references.into_iter().enumerate() {
        for side in [1.0, -1.0] {
            let mirrored = |t: f64| reference(t).map(|r| side * r);
            let mut rig = Rig::new(Shaft { x: [side * start, 0.0, 0.0], ..Shaft::ROUGH }, &mirrored);
            rig.fence = Some(Fence::new(&limits, DESIGN.slowing(0)));
            rig.healthy(5000);
            assert!(!rig.seen.intersects(Health::END_OF_RANGE | Health::BRAKES), "{k}, {side}: {:?}", rig.seen);
        }
    }
}

/// Overspeed and following error, each by itself, are reported and brake the drive.
#[test]
fn too_fast_and_too_far_from_the_target_are_told_and_braked() {
    let fast = FenceLimits { max_speed_rad_s: 40.0, ..FenceLimits::NONE };
    let far = FenceLimits { following_rad: 0.003, ..FenceLimits::NONE };
    let reference = ramp(60.0);
    // The motor overcomes a load of a quarter of its largest torque after a dip.
    let hit = Shaft { load: [0.8, 0.12], ..Shaft::ROUGH };
    for (limits, shaft, told) in [(fast, Shaft::ROUGH, Health::OVERSPEED), (far, hit, Health::FOLLOWING_ERROR)] {
        let mut rig = Rig::new(shaft, &reference);
        rig.fence = Some(Fence::new(&limits, DESIGN.slowing(0)));
        rig.healthy(2500);
        println!("{:?}, at {:.3} rad/s in the end", rig.seen, rig.shaft.x[1]);
        assert!(rig.seen.contains(told | Health::BRAKES | Health::STOPPED), "{:?}", rig.seen);
        // Without the limits the drive does not stop.
        let mut free = Rig::new(shaft, &reference);
        free.healthy(2500);
        assert!(!free.seen.contains(Health::STOPPED), "{:?}", free.seen);
    }
}

/// One missed interrupt, a tick without input, false counts and steps of the target do not stop the drive.
#[test]
fn what_passes_stops_no_drive_that_brakes() {
    for speed in [10.0, 20.0, 30.0, 35.0, 60.0, 100.0, 200.0] {
        let reference = ramp(speed);
        let mut rig = Rig::new(Shaft::ROUGH, &reference);
        rig.healthy(1000);
        // A missed interrupt.
        let t = f64::from(rig.tick) * PERIOD_S;
        rig.shaft.advance(t, 0.0, PERIOD_S);
        rig.tick += 1;
        rig.healthy(500);
        // An interrupt with neither count nor target.
        for _ in 0..20 {
            let t = f64::from(rig.tick) * PERIOD_S;
            let output = rig.running.lost();
            rig.pass(t, &output);
            rig.healthy(9);
        }
        let mut seed = 1_u32;
        for _ in 0..2000 {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            rig.period(|count| Some(if seed >> 8 < (1 << 24) / 10 { -1 } else { count }));
        }
        let error = rig.shaft.x[0] - reference(f64::from(rig.tick) * PERIOD_S)[0];
        println!("{speed} rad/s: {error:.4} rad, {:?}", rig.seen);
        assert!(
            !rig.seen.intersects(Health::BRAKES | Health::STOPPED) && error.abs() < 0.01,
            "{speed}: {:?}",
            rig.seen
        );
    }
    for step in [0.03, 1.0, std::f64::consts::PI, 20.0, 500.0] {
        let reference = move |t: f64| if t < 0.1 { [0.0; 2] } else { [step, 0.0] };
        let mut rig = Rig::new(Shaft::ROUGH, &reference);
        rig.healthy(6000);
        assert!(!rig.seen.intersects(Health::BRAKES | Health::STOPPED), "{step} rad: {:?}", rig.seen);
        assert!((rig.shaft.x[0] - step).abs() < 1e-3, "{step} rad: {}", rig.shaft.x[0]);
    }
}

/// Sequence: enable, move, stop, enable again. At a start the drive takes its count within half a counter of 0. Its
/// target is therefore its estimate after the reset, while it still waits, and nothing jumps. The estimates from before
/// the reset are several revolutions away.
#[test]
fn a_drive_that_stopped_is_enabled_again_where_it_is() {
    let reference = ramp(40.0);
    let mut rig = Rig::new(Shaft::ROUGH, &reference);
    // The drive is enabled; a mechanical brake may open when the drive no longer waits.
    let waits = (0..100).take_while(|_| rig.period(Some).health.contains(Health::WAITS)).count();
    assert!(waits <= 12, "{waits} ticks");
    rig.healthy(900);
    rig.running.trip();
    while !rig.period(Some).health.contains(Health::STOPPED) {}
    let before = rig.running.estimates().expect("a drive that has started");
    // A person turns the shaft by hand.
    rig.shaft.x[0] += 1.0;
    rig.running.reset();
    let (place, turn) = (Cell::new(0.0), Cell::new(0));
    let hold = |_: f64| [place.get(), 0.0];
    rig.reference = &hold;
    rig.seen = Health::OK;
    let (stood, mut most) = (rig.shaft.x[0], 0.0_f64);
    for _ in 0..500 {
        if rig.period(Some).health.contains(Health::WAITS) {
            let known = rig.running.estimates().expect("a count");
            place.set(TAU * f64::from(known.turn) + f64::from(known.position[0]));
            turn.set(known.turn);
        }
        most = most.max((rig.shaft.x[0] - stood).abs());
    }
    println!("{waits} ticks to the first enable; held again within {most:.5} rad, {:?}", rig.seen);
    assert!(before.turn != turn.get(), "turns were made");
    assert!(most < 5e-3 && !rig.seen.intersects(Health::STOPPED | Health::BRAKES), "{most}");
}

/// Homing against a stop: creep until the load estimate shows that something holds the shaft, and set the origin there.
/// Homing with a switch: trip, and take the position at which the switch closed.
#[test]
fn a_shaft_is_homed_against_a_stop_and_by_a_switch() {
    const STOP_RAD: f64 = 1.7;
    let creep = |t: f64| if t < 0.1 { [0.0; 2] } else { [2.0 * (t - 0.1), 2.0] };
    let mut rig = Rig::new(Shaft::ROUGH, &creep);
    let (mut held, mut found) = (0, None);
    for _ in 0..3000 {
        rig.period(Some);
        if rig.shaft.x[0] > STOP_RAD {
            (rig.shaft.x[0], rig.shaft.x[1]) = (STOP_RAD, rig.shaft.x[1].min(0.0));
        }
        let Some(known) = rig.running.estimates() else { continue };
        // The load must exceed friction for 10 ms; it stays below the monitors' bound of 0.2 N m.
        held = if known.load[0].abs() > 0.08 { held + 1 } else { 0 };
        if held >= 10 {
            found = Some(TAU * f64::from(known.turn) + f64::from(known.position[0]));
            break;
        }
    }
    let found = found.expect("the stop");
    println!("the stop at {STOP_RAD} is found at {found:.5} rad, {:?}", rig.seen);
    // The estimate leads the count while the load grows.
    assert!((found - STOP_RAD).abs() < 3e-3);
    assert!(!rig.seen.intersects(Health::BRAKES | Health::STOPPED));
    // The switch closes at 1 rad.
    let mut rig = Rig::new(Shaft::ROUGH, &creep);
    let mut closed = None;
    for _ in 0..2000 {
        rig.period(Some);
        if closed.is_none() && rig.shaft.x[0] > 1.0 {
            closed = rig.running.estimates().map(|known| known.position[0]);
            rig.running.trip();
        }
    }
    let closed = closed.expect("the switch");
    println!("the switch at 1 rad closes at {closed:.4}, the shaft stops at {:.4}", rig.shaft.x[0]);
    // Allowance: one tick at 2 rad/s, and the stopping distance.
    assert!((closed - 1.0).abs() < 3e-3 && rig.seen.contains(Health::STOPPED) && rig.shaft.x[0] < 1.04);
}

/// Braking on plants other than the design's: the brake ends at rest, or it gives up.
#[test]
fn a_brake_ends_at_rest_with_another_inertia_and_under_load() {
    const LOAD: f64 = 0.15;
    for (factor, load, most) in
        [(1.0, 0.0, 0.05), (2.0, 0.0, 0.05), (5.0, 0.0, 0.6), (0.5, 0.0, 0.05), (1.0, LOAD, 0.8)]
    {
        let reference = ramp(60.0);
        let mut rig = Rig::new(Shaft { load: [1.2, load], ..Shaft::ROUGH }, &reference);
        rig.healthy(1500);
        rig.shaft.inertia *= factor;
        rig.running.trip();
        let mut ticks = 0;
        while !rig.period(Some).health.contains(Health::STOPPED) {
            ticks += 1;
            assert!(ticks < 3000, "the brake does not end");
        }
        println!("J x {factor}, load {load} N m: {ticks} ticks, left {:.3} rad/s", rig.shaft.x[1]);
        assert!(rig.shaft.x[1].abs() < most, "J x {factor}, load {load}: {} rad/s", rig.shaft.x[1]);
    }
    // The shaft is up to ten times lighter than in the design. The brake accelerates it and then gives up.
    for factor in [0.3, 0.15, 0.1] {
        let reference = ramp(60.0);
        let mut rig = Rig::new(Shaft::ROUGH, &reference);
        rig.healthy(1000);
        rig.shaft.inertia *= factor;
        rig.running.trip();
        let (mut ticks, mut fastest) = (0, 0.0_f64);
        while !rig.period(Some).health.contains(Health::STOPPED) {
            fastest = fastest.max(rig.shaft.x[1].abs());
            ticks += 1;
            assert!(ticks < 3000, "the brake does not end");
        }
        println!("J x {factor}: {ticks} ticks, at most {fastest:.1} rad/s, {:?}", rig.seen);
        assert!(fastest < if factor < 0.12 { 1000.0 } else { 300.0 }, "J x {factor}: {fastest} rad/s");
    }
}

/// Interrupts missed while the drive brakes do not switch off the current.
#[test]
fn a_brake_goes_on_after_missed_interrupts() {
    for speed in [60.0, 100.0, -200.0_f64] {
        for missed in [1, 2] {
            // At 200 rad/s two missed interrupts exceed the innovation gate; the drive then switches off the current
            // later.
            if missed == 2 && speed < 0.0 {
                continue;
            }
            let reference = ramp(speed);
            let mut rig = Rig::new(Shaft::ROUGH, &reference);
            rig.healthy(1000);
            rig.running.trip();
            rig.healthy(5);
            let u = -10.0 * speed.signum();
            for _ in 0..missed {
                let t = f64::from(rig.tick) * PERIOD_S;
                rig.shaft.advance(t, u, PERIOD_S);
                rig.tick += 1;
            }
            while !rig.period(Some).health.contains(Health::STOPPED) {}
            println!("{speed} rad/s, {missed} missed: left {:.3} rad/s, {:?}", rig.shaft.x[1], rig.seen);
            assert!(rig.shaft.x[1].abs() < 0.1 && !rig.seen.contains(Health::WRONG_WAY), "{:?}", rig.seen);
        }
    }
}
