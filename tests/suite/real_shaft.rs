//! Faults of a real shaft: missed interrupts, counts that are missing, slip or start wrong, counters that wrap
//! anywhere, typed targets, stops on the way. The thresholds are for a drive that stays in control, in rad of the
//! shaft. The plant is the suite's own, with friction, cogging and a current loop.

use std::f64::consts::TAU;

use controller_core::drive::{
    Encoder, FARTHEST_RAD, Joined, Joint, JointDesign, JointDrive, Motor, MotorDesign, MotorDrive, Position, Profile,
    ProfileLimits, Reference, Rest, Sample, Sine, Target, gap, powers_of_join, stop,
};
use controller_core::{Health, Limits, Output, Real, Running};
use integration_tests::drive::{Flexible, Shaft};
use integration_tests::strategy::Rng;

const PERIOD_S: f64 = 1e-3;
const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
const ENCODER: Encoder = Encoder::absolute(14);

type Drive = MotorDrive<f32, Position, 1>;

fn drive(encoder: Encoder) -> Drive {
    Drive::design(&MotorDesign::by_rule(PERIOD_S, MOTOR, encoder, Limits::symmetric(10.0)))
}

/// Returns the encoder reading at an angle, as its counter holds it.
fn count(encoder: Encoder, angle_rad: f64) -> i32 {
    ((angle_rad / encoder.unit_rad()).round() as i64).rem_euclid(encoder.counter() as i64) as i32
}

fn target(r: f64, v: f64) -> Target<f32, i32, 2> {
    let turn = (r / TAU).round();
    Target { turn: turn as i32, jet: [(r - turn * TAU) as f32, v as f32] }
}

/// Motor under its drive.
struct Rig {
    running: Running<Drive>,
    shaft: Shaft,
    encoder: Encoder,
    tick: u32,
    u: f64,
    seen: Health,
    /// Largest |y - r|, rad.
    worst: f64,
    ticks_lost: u32,
}

impl Rig {
    fn new(encoder: Encoder, shaft: Shaft) -> Self {
        let running = Running::new(drive(encoder));
        Self { running, shaft, encoder, tick: 0, u: 0.0, seen: Health::OK, worst: 0.0, ticks_lost: 0 }
    }

    /// Runs one period; `interrupt` is the count, or `None` for a missed interrupt.
    #[allow(clippy::option_option, reason = "no interrupt, no count, a count")]
    fn period(&mut self, interrupt: Option<Option<i32>>, reference: &dyn Fn(f64) -> [f64; 2]) -> Option<Output<f32>> {
        let t = f64::from(self.tick) * PERIOD_S;
        let [begin, end] = [t, t + PERIOD_S].map(reference).map(|[r, v]| target(r, v));
        let output = interrupt.map(|count| self.running.tick(&Sample { counts: [count], begin, end }));
        if let Some(Output { u, health, .. }) = output {
            self.u = f64::from(u);
            self.seen |= health;
            self.ticks_lost += u32::from(health.contains(Health::SAMPLE_LOST));
        }
        self.shaft.advance(t, self.u, PERIOD_S);
        self.tick += 1;
        self.worst = self.worst.max((self.shaft.x[0] - reference(t + PERIOD_S)[0]).abs());
        output
    }

    fn seen_count(&self) -> i32 {
        count(self.encoder, self.shaft.x[0])
    }

    /// Runs periods without a fault.
    fn healthy(&mut self, periods: u32, reference: &dyn Fn(f64) -> [f64; 2]) {
        for _ in 0..periods {
            self.period(Some(Some(self.seen_count())), reference);
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

/// Returns a rig at a speed, with its earlier statistics cleared.
fn at_speed(speed: f64) -> (Rig, impl Fn(f64) -> [f64; 2]) {
    let reference = ramp(speed);
    let mut rig = Rig::new(ENCODER, Shaft::ROUGH);
    rig.healthy(1000, &reference);
    assert!((rig.seen | Health::WAITS | Health::INPUT_REJECTED) == Health::WAITS | Health::INPUT_REJECTED);
    (rig.worst, rig.seen) = (0.0, Health::OK);
    (rig, reference)
}

/// Missed interrupts without a report: the drive detects them from the counts and never loses a revolution.
#[test]
fn missed_interrupts_cost_a_little_and_never_a_turn() {
    for (speed, missed, bar) in
        [(60.0, 1, 0.0025), (100.0, 1, 0.011), (200.0, 1, 0.07), (60.0, 4, 0.087), (-60.0, 1, 0.0025)]
    {
        let (mut rig, reference) = at_speed(speed);
        for _ in 0..missed {
            rig.period(None, &reference);
        }
        rig.healthy(800, &reference);
        println!("{missed} missed at {speed} rad/s: {:.4} rad, {} counts refused", rig.worst, rig.ticks_lost);
        assert!(rig.worst <= bar, "{missed} missed at {speed} rad/s: {}", rig.worst);
        assert!(rig.seen.contains(Health::POSITION_STEPPED) && !rig.seen.contains(Health::INPUT_REJECTED));
        let error = rig.shaft.x[0] - reference(f64::from(rig.tick) * PERIOD_S)[0];
        assert!(error.abs() < 1e-3, "{error} rad at the end");
    }
}

/// Reported missed interrupts cost only the periods without control.
#[test]
fn a_drive_that_is_told_of_missed_interrupts_steps_nowhere() {
    for (speed, missed, bar) in [(60.0, 1, 0.0015), (200.0, 1, 0.0015), (200.0, 5, 0.003), (100.0, 20, 0.005)] {
        let (mut rig, reference) = at_speed(speed);
        for _ in 0..missed {
            rig.period(None, &reference);
        }
        rig.running.missed(missed);
        rig.healthy(500, &reference);
        println!("{missed} missed and told at {speed} rad/s: {:.5} rad", rig.worst);
        assert!(rig.worst <= bar && rig.seen.is_ok(), "{missed} at {speed} rad/s: {}, {:?}", rig.worst, rig.seen);
    }
}

/// 60 ms exceed the 50 ms that the drive bridges with a current.
#[test]
fn a_gap_in_the_counts_is_crossed_by_the_model() {
    let (mut rig, reference) = at_speed(60.0);
    for _ in 0..60 {
        rig.period(Some(None), &reference);
    }
    rig.healthy(500, &reference);
    println!("60 ms without counts at 60 rad/s: {:.4} rad", rig.worst);
    assert!(rig.worst <= 0.003, "{}", rig.worst);
    assert!(rig.seen.contains(Health::INPUT_REJECTED) && !rig.seen.contains(Health::POSITION_STEPPED));
}

/// A magnet that slips moves the position by its slip and sets a flag, and nothing else. More than three slips in a row
/// are rejected.
#[test]
fn a_slip_costs_the_slip_and_a_flag() {
    for slip_rad in [0.1, -0.3, 1.0] {
        for speed in [0.0, 60.0] {
            let (mut rig, reference) = at_speed(speed);
            for _ in 0..600 {
                let count = count(ENCODER, rig.shaft.x[0] + slip_rad);
                rig.period(Some(Some(count)), &reference);
            }
            let error = rig.shaft.x[0] - reference(f64::from(rig.tick) * PERIOD_S)[0];
            println!("slip of {slip_rad} rad at {speed} rad/s: {error:.4} rad at the end, {:.4} at most", rig.worst);
            assert!((error + slip_rad).abs() < 2e-3, "slip of {slip_rad} at {speed}: {error}");
            assert!(rig.worst < slip_rad.abs() * 1.3, "{}", rig.worst);
            assert!(rig.seen.contains(Health::POSITION_STEPPED));
        }
    }
}

#[test]
fn slip_after_slip_is_rejected() {
    let (mut rig, reference) = at_speed(60.0);
    for k in 0..300 {
        let slip_rad = 0.2 * f64::from(k / 10);
        let count = count(ENCODER, rig.shaft.x[0] + slip_rad);
        rig.period(Some(Some(count)), &reference);
    }
    assert!(rig.seen.contains(Health::INPUT_REJECTED | Health::WAITS), "{:?}", rig.seen);
}

/// A bus that is not yet up returns 0; the shaft stands at 3.07 rad and must stay there.
#[test]
fn false_first_counts_move_nothing() {
    for zeros in [1, 5] {
        let mut rig = Rig::new(ENCODER, Shaft { x: [3.07, 0.0, 0.0], ..Shaft::ROUGH });
        let hold = |_| [3.07, 0.0];
        for _ in 0..zeros {
            rig.period(Some(Some(0)), &hold);
        }
        assert!(rig.u == 0.0);
        rig.healthy(1000, &hold);
        println!("{zeros} ms of zeros: {:.5} rad", rig.worst);
        assert!(rig.worst < TAU / 360.0, "{zeros} ms of zeros: {}", rig.worst);
    }
}

/// The drive is switched on while the shaft turns. It starts there, at the present speed, within some ticks.
#[test]
fn a_start_in_motion_knows_the_speed_at_once() {
    for speed in [60.0, -200.0] {
        let mut rig = Rig::new(ENCODER, Shaft { x: [1.0, speed, 0.0], ..Shaft::CLEAN });
        // Position of the shaft.
        let along = |t: f64| [1.0 + speed * t, speed];
        let mut first = None;
        for tick in 0..200 {
            let output = rig.period(Some(Some(rig.seen_count())), &along).expect("an interrupt");
            if first.is_none() && !output.health.contains(Health::WAITS) {
                let known = rig.running.estimates().expect("it has started");
                first = Some((tick, f64::from(known.speed[0])));
            }
        }
        let (tick, known) = first.expect("it starts");
        println!("{speed} rad/s: believed after {tick} ticks, speed {known:.2}; {:.4} rad at most", rig.worst);
        assert!(tick <= 5 && (known / speed - 1.0).abs() < 0.02 && rig.worst < 0.01);
        assert!(!rig.seen.intersects(Health::SAMPLE_LOST | Health::SATURATED), "{:?}", rig.seen);
    }
}

/// One word in ten is all ones, without an error report; the test includes rest, where such a word is constant.
#[test]
fn bad_frames_at_rest_are_no_step() {
    let mut rig = Rig::new(ENCODER, Shaft { x: [1.5, 0.0, 0.0], ..Shaft::ROUGH });
    let hold = |_| [1.5, 0.0];
    rig.healthy(20, &hold);
    let mut seed = 1_u32;
    for _ in 0..4000 {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let count = if seed >> 16 < 6554 { -1 } else { rig.seen_count() };
        rig.period(Some(Some(count)), &hold);
    }
    assert!(rig.ticks_lost > 300 && rig.worst < 0.01, "{} lost, {} rad", rig.ticks_lost, rig.worst);
    assert!(!rig.seen.contains(Health::POSITION_STEPPED), "{:?}", rig.seen);
}

/// A typed target without a plan, from rest and from a moving shaft: no overshoot, no oscillation, no alarm.
#[test]
fn a_target_typed_at_once_is_reached_without_overshoot() {
    for step in [0.03, 0.1, 1.0, -3.2, 20.0, 500.0] {
        let mut rig = Rig::new(ENCODER, Shaft::ROUGH);
        let reference = |t: f64| [if t >= 0.1 { step } else { 0.0 }, 0.0];
        let mut most = 0.0_f64;
        for _ in 0..6000 {
            rig.period(Some(Some(rig.seen_count())), &reference);
            most = most.max(rig.shaft.x[0] * step.signum());
        }
        let error = rig.shaft.x[0] - step;
        println!("{step} rad at once: {most:.4} rad at most, {error:.5} at the end");
        assert!(most <= 1.02 * step.abs() && error.abs() < 2e-3, "{step}: {most}, {error}");
        assert!(!rig.seen.intersects(Health::SIGMA_STAR_OVER_BOUND | Health::SAMPLE_LOST), "{:?}", rig.seen);
    }
}

#[test]
fn a_shaft_that_is_thrown_is_caught_without_a_swing_back() {
    for speed in [20.0, 60.0, 200.0, -500.0_f64] {
        let mut rig = Rig::new(ENCODER, Shaft { x: [0.0, speed, 0.0], ..Shaft::ROUGH });
        let hold = |_| [0.0, 0.0];
        let (mut furthest, mut back) = (0.0_f64, 0.0_f64);
        for _ in 0..4000 {
            rig.period(Some(Some(rig.seen_count())), &hold);
            let way = rig.shaft.x[0] * speed.signum();
            (furthest, back) = (furthest.max(way), back.min(way));
        }
        // Stopping distance at full current from the first tick on.
        let least = speed * speed / (2.0 * 0.05 * 10.0 / 2e-4);
        println!("thrown at {speed} rad/s: {furthest:.3} rad out (least {least:.3}), {:.4} back", -back);
        assert!(furthest < 1.05 * least + speed.abs() * 0.006 && back > -0.003, "{speed}: {furthest}, {back}");
    }
}

/// A timer that reloads at 9999, an absolute encoder of 4000 positions, and one of seven revolutions: u is
/// bit-identical to u with a 32-bit counter, over every wrap.
#[test]
fn a_counter_may_wrap_anywhere() {
    for (states, counts_per_turn) in
        [(10_000, 10_000), (4000, 4000), (7 * 4096, 4096), (65_535, 10_000), (3000, 10_000)]
    {
        let wide = Encoder::incremental(32, counts_per_turn);
        let narrow = Encoder::incremental(16, counts_per_turn).wrapping_at(states);
        let reference = |t: f64| [20.0 * (3.0 * t).sin(), 60.0 * (3.0 * t).cos()];
        let mut rigs = [wide, narrow].map(|encoder| Rig::new(encoder, Shaft::ROUGH));
        for tick in 0..4000 {
            // No gap where the counter covers less than a revolution: the shaft may turn on by whole counter ranges.
            let lost = states >= counts_per_turn && (300..310).contains(&(tick % 1000));
            let bits = rigs.each_mut().map(|rig| {
                let count = if lost { None } else { Some(rig.seen_count()) };
                // The unwrapped counter has a sign.
                let output = rig.period(Some(count), &reference).expect("an interrupt");
                (output.u.to_bits(), output.health)
            });
            assert_eq!(bits[0], bits[1], "{states} states, tick {tick}");
        }
        let error = rigs[1].shaft.x[0] - reference(4.0)[0];
        assert!(error.abs() < 0.01, "{states} states: {error} rad at the end");
    }
}

/// A counter that the index pulse of its encoder sets to 0 once per revolution. The counter begins anywhere, so the
/// drive creeps to the first pulse and is reset there. From then on each pulse recovers the counts lost to
/// interference.
#[test]
fn a_counter_that_its_index_sets_to_0_is_homed_once_and_loses_nothing() {
    const STATES: i64 = 10_000;
    let encoder = Encoder::incremental(16, 10_000).wrapping_at(10_000);
    let steps = |shaft: &Shaft| (shaft.x[0] / encoder.unit_rad()).floor() as i64;
    let mut rig = Rig::new(encoder, Shaft { x: [2.0, 0.0, 0.0], ..Shaft::ROUGH });
    let (mut counter, mut before) = (0, steps(&rig.shaft));
    let mut read = |rig: &Rig, lost: i64| {
        let now = steps(&rig.shaft);
        let is_index = now.div_euclid(STATES) != before.div_euclid(STATES);
        counter = if is_index { now } else { counter + now - before - lost }.rem_euclid(STATES);
        before = now;
        (counter as i32, is_index)
    };
    // The counter reads 0 at 2 rad.
    let creep = |t: f64| if t < 0.1 { [0.0; 2] } else { [2.0 * (t - 0.1), 2.0] };
    loop {
        let (count, is_index) = read(&rig, 0);
        if is_index {
            rig.running.reset();
            break;
        }
        rig.period(Some(Some(count)), &creep);
        assert!(rig.tick < 4000, "the index is not found");
    }
    println!("the index is found at {:.4} rad after {} ms, {:?}", rig.shaft.x[0], rig.tick, rig.seen);
    assert!((rig.shaft.x[0] - TAU).abs() < 3e-3);
    // The index position is the origin.
    rig.shaft.x[0] -= TAU;
    read(&rig, 0);
    (rig.tick, rig.worst, rig.seen) = (0, 0.0, Health::OK);
    let reference = ramp(60.0);
    for tick in 0..3000 {
        // Two counts are lost every 20 ms, ten per revolution: 6 mrad, and 0.17 rad in these 3 s without an index.
        let (count, _) = read(&rig, if tick > 600 && tick % 20 == 0 { 2 } else { 0 });
        rig.period(Some(Some(count)), &reference);
    }
    let error = rig.shaft.x[0] - reference(f64::from(rig.tick) * PERIOD_S)[0];
    println!("{error:.5} rad at the end, {:.5} at most, {:?}", rig.worst, rig.seen);
    // The shaft creeps on at 2 rad/s for the 10 ms in which the counts must agree.
    assert!(error.abs() < 8e-3 && rig.worst < 0.03, "{error} rad at the end, {} at most", rig.worst);
    assert!(!rig.seen.intersects(Health::POSITION_STEPPED | Health::SAMPLE_LOST), "{:?}", rig.seen);
}

/// Missed interrupts on a joint, whose two encoders are missed together.
#[test]
fn a_joint_survives_missed_interrupts() {
    let encoders = [Encoder::absolute(20); 2];
    let design = JointDesign::new(PERIOD_S, Joint::TABLE_I, encoders, Limits::symmetric(30.0), 1.3);
    let law = JointDrive::<f32, Position, 1>::design(&design);
    for (missed, told) in [(1, false), (4, false), (4, true)] {
        let (mut running, mut plant, mut worst, mut seen, mut u) =
            (Running::new(law), Flexible::NOMINAL, 0.0_f64, Health::OK, 0.0);
        // The joint speeds up to 3 rad/s and continues.
        let reference = |t: f64| {
            let s = (t / 1.0).min(1.0);
            let [s2, s3, s4] = [s * s, s * s * s, s * s * s * s];
            let past = (t - 1.0).max(0.0);
            [
                3.0 * (2.5 * s4 - 3.0 * s4 * s + s4 * s2 + past),
                3.0 * (10.0 * s3 - 15.0 * s4 + 6.0 * s4 * s),
                3.0 * (30.0 * s2 - 60.0 * s3 + 30.0 * s4),
                3.0 * (60.0 * s - 180.0 * s2 + 120.0 * s3),
            ]
        };
        let angles = |plant: &Flexible| [plant.x[0], plant.x[2] / Flexible::K_1];
        let target = |t: f64| {
            let [r, jet @ ..] = reference(t);
            let turn = (r / TAU).round();
            let [v, a, j] = jet.map(|number| number as f32);
            Target { turn: turn as i32, jet: [(r - turn * TAU) as f32, v, a, j] }
        };
        for tick in 0..3000_u32 {
            let t = f64::from(tick) * PERIOD_S;
            if tick < 2000 || tick >= 2000 + missed {
                if told && tick == 2000 + missed {
                    running.missed(missed);
                }
                let counts = angles(&plant).map(|angle| Some(count(encoders[0], angle)));
                let output = running.tick(&Sample { counts, begin: target(t), end: target(t + PERIOD_S) });
                seen |= output.health;
                u = f64::from(output.u);
            }
            plant.advance(t, u, PERIOD_S);
            if tick > 1500 {
                worst = worst.max((angles(&plant)[0] - reference(t + PERIOD_S)[0]).abs());
            }
        }
        println!("{missed} missed, told {told}: {worst:.5} rad, {seen}");
        assert!(worst < 0.005, "{missed} missed, told {told}: {worst}");
        assert!(seen.contains(Health::POSITION_STEPPED) != told, "{seen}");
    }
}

/// Missed interrupts during the acceleration of a joint leave a speed error, by which its counts drift. The counts
/// still agree within the explained drift, and the move continues.
#[test]
fn a_joint_that_misses_interrupts_in_its_move_goes_on() {
    let encoders = [Encoder::absolute(20); 2];
    let design = JointDesign::new(PERIOD_S, Joint::TABLE_I, encoders, Limits::symmetric(30.0), 1.3);
    let law = JointDrive::<f32, Position, 1>::design(&design);
    for missed in [1, 2, 4, 8, 12] {
        for place in 0..13 {
            let at = 150 + 60 * place;
            let (mut running, mut plant, mut seen, mut u) = (Running::new(law), Flexible::NOMINAL, Health::OK, 0.0);
            let plan =
                Joined::<f32, _, 5>::new(Rest { turn: 0, angle: 1.0 }, [-1.0, 0.0, 0.0, 0.0, 0.0], 100, 1000, PERIOD_S);
            for tick in 0..2000_u32 {
                let t = f64::from(tick) * PERIOD_S;
                if tick < at || tick >= at + missed {
                    let angles = [plant.x[0], plant.x[2] / Flexible::K_1];
                    let counts = angles.map(|angle| Some(count(encoders[0], angle)));
                    let (begin, end) = (plan.at(tick), plan.at(tick + 1));
                    let output = running.tick(&Sample { counts, begin, end });
                    if tick > 50 {
                        seen |= output.health;
                    }
                    u = f64::from(output.u);
                }
                plant.advance(t, u, PERIOD_S);
            }
            let error = plant.x[0] - 1.0;
            assert!(!seen.contains(Health::INPUT_REJECTED), "{missed} missed at tick {at}: {seen}");
            assert!(error.abs() < 2e-3, "{missed} missed at tick {at}: {error} rad, {seen}");
        }
    }
}

/// More reported missed interrupts than samples may be missing: the drive accepts the next counts.
#[test]
fn more_missed_interrupts_than_samples_may_be_missing_are_no_end_if_they_are_told() {
    for (speed, missed) in [(60.0, 55), (-100.0, 60), (20.0, 100)] {
        let (mut rig, reference) = at_speed(speed);
        for _ in 0..missed {
            rig.period(None, &reference);
        }
        rig.running.missed(missed);
        rig.healthy(1000, &reference);
        let error = rig.shaft.x[0] - reference(f64::from(rig.tick) * PERIOD_S)[0];
        println!("{missed} missed at {speed} rad/s: {:.4} rad, {:?}", rig.worst, rig.seen);
        assert!(error.abs() < 1e-3 && !rig.seen.contains(Health::INPUT_REJECTED), "{error}, {:?}", rig.seen);
    }
}

/// Two units of a position.
const UNITS_RAD: f64 = 2.0 * TAU / 4_294_967_296.0;

/// A profile that begins at the estimates brakes the shaft: no reversal, no limit reached, near the physical distance.
#[test]
fn a_profile_brakes_a_shaft_from_where_it_is() {
    const BRAKE: f64 = 1800.0;
    for speed in [200.0, 60.0, 5.0, -100.0] {
        let (mut rig, _) = at_speed(speed);
        let limits = ProfileLimits { speed_rad_s: 300.0, acceleration_rad_s2: BRAKE, window: 5 };
        let mut profile = Profile::<f32, 2, 10>::new(&limits, PERIOD_S).expect("limits");
        let known = rig.running.estimates().expect("it runs");
        // The estimates belong to the last tick; the coming tick begins a period later.
        let (v, begin) = (f64::from(known.speed[0]), rig.shaft.x[0]);
        let angle = f64::from(known.position[0]) + v * PERIOD_S;
        assert!(profile.start(known.turn, angle, v));
        let mut end = Target { turn: known.turn, jet: [angle as f32, known.speed[0]] };
        let (mut most_a, mut back) = (0.0_f64, 0.0_f64);
        for tick in 0..600 {
            let sample = Sample { counts: [Some(rig.seen_count())], begin: end, end: profile.next_tick() };
            let Output { u, health, .. } = rig.running.tick(&sample);
            assert!(!health.contains(Health::SATURATED), "tick {tick}: {health}");
            end = sample.end;
            most_a = most_a.max(f64::from(u.abs()));
            rig.shaft.advance(f64::from(rig.tick) * PERIOD_S, f64::from(u), PERIOD_S);
            rig.tick += 1;
            back = back.max(-speed.signum() * rig.shaft.x[1]);
        }
        let way = (rig.shaft.x[0] - begin).abs();
        let expected = speed * speed / (2.0 * BRAKE) + 5.0 * PERIOD_S * speed.abs();
        println!("{speed} rad/s: {way:.3} rad to rest ({expected:.3}), up to {most_a:.1} A, back at {back:.2} rad/s");
        assert!(profile.has_arrived() && rig.shaft.x[1].abs() < 0.1);
        assert!((way - expected).abs() < 0.02 * expected + 0.01, "{speed}: {way} of {expected}");
        assert!(back < 0.3, "{speed}: it swings back at {back} rad/s");
    }
}

/// Returns the reversal of a stop from this trajectory point, with its travel, and its number of ticks.
fn back_of_stop<T: Real<Count = i32>, const M: usize>(jet: [T; M], ticks: u32) -> ([f64; 2], u32) {
    let present = Target { turn: 3, jet };
    let (goal, taken) = stop(&present, ticks, PERIOD_S);
    let powers = powers_of_join(gap(&present, &goal.at(0)), f64::from(taken) * PERIOD_S);
    if powers.as_flattened().as_flattened().iter().any(|rad| rad.abs() > FARTHEST_RAD) {
        // No caller gets such a travel.
        return ([0.0; 2], taken);
    }
    let way = Joined::<T, _, M>::new(goal, gap(&present, &goal.at(0)), 100, taken, PERIOD_S);
    let angle = |tick: u32| -> f64 {
        let at: Target<T, i32, 2> = way.at(100 + tick);
        TAU * f64::from(at.turn) + at.jet[0].to_f64()
    };
    let (first, last) = (angle(0), angle(taken));
    let (mut furthest, mut back) = (first, 0.0_f64);
    let direction = (last - first).signum();
    for tick in (1..=400).map(|k| (u64::from(taken) * k / 400) as u32) {
        let at = angle(tick);
        back = back.max(direction * (furthest - at));
        furthest = if direction * (at - furthest) > 0.0 { at } else { furthest };
    }
    ([back, (last - first).abs()], taken)
}

/// Stops from any speed, acceleration and jerk, in any time, do not reverse, except for some units of the position,
/// 2^-32 revolutions.
#[test]
fn a_stop_never_goes_back() {
    let mut rng = Rng::new(5);
    for _ in 0..4000 {
        let speed = rng.spread(1e-3, 400.0);
        let ticks = rng.spread(1.0, 2e4) as u32;
        let acceleration = rng.spread(1e-2, 1e5) * f64::from(rng.integer(0, 2) as i32 - 1);
        let jerk = rng.spread(1.0, 1e7) * f64::from(rng.integer(0, 2) as i32 - 1);
        let tell = |told: ([f64; 2], u32), of: f64| {
            let ([back, way], taken) = told;
            assert!(back <= of * (way + 1.0) + UNITS_RAD, "{speed} {acceleration} {jerk} in {ticks}: {back} of {way}");
            assert!((1..=ticks.max(1)).contains(&taken), "{taken} of {ticks}");
        };
        tell(back_of_stop([0.5, speed], ticks), 1e-12);
        tell(back_of_stop([0.5, speed, acceleration], ticks), 1e-12);
        tell(back_of_stop([0.5, -speed, acceleration, jerk], ticks), 1e-12);
        let [v, a, j] = [speed, acceleration, jerk].map(|number| number as f32);
        tell(back_of_stop([0.5_f32, v, a, j], ticks), 1e-6);
    }
    // At constant speed the stop takes half of the distance in the requested time.
    let (goal, taken) = stop(&Target { turn: 0, jet: [1.0, 4.0, 0.0, 0.0] }, 500, PERIOD_S);
    assert!((goal.angle - 2.0_f64).abs() < 1e-12 && taken == 500, "{goal:?} {taken}");
    // A move of 1 rad in 1 s, stopped at any tick.
    let onto = Joined::<f64, _, 3>::new(Rest { turn: 0, angle: 1.0 }, [-1.0, 0.0, 0.0], 0, 1000, PERIOD_S);
    for at in 1..1000 {
        let present: Target<f64, i32, 3> = onto.at(at);
        for ticks in [50, 100, 200, 400, 800, 1600] {
            let ([back, _], taken) = back_of_stop(present.jet, ticks);
            assert!(back < 1e-12 + UNITS_RAD && taken <= ticks, "at {at} in {ticks}: {back}");
        }
    }
}

/// Before its start a plan is at its initial point, as a sine is; after its end it stays at the end.
#[test]
fn a_plan_that_has_not_begun_is_where_it_begins() {
    for start in [1000_u32, 0, u32::MAX - 20] {
        let sine = Sine::<f64>::new(0.5, 30.0, PERIOD_S);
        let mut plan = Joined::<f64, _, 3>::new(sine, [0.25, -1.0, 3.0], start, 100, PERIOD_S);
        let first: Target<f64, i32, 2> = plan.at(start);
        for before in [1, 2, 1000, 1 << 30] {
            assert_eq!(Reference::<f64, 2>::at(&plan, start.wrapping_sub(before)), first, "{before} before {start}");
        }
        Reference::<f64, 2>::settle(&mut plan, start.wrapping_sub(5));
        assert_eq!(plan.left(start), 100);
        for behind in [100, 101, 1 << 30] {
            let (tick, on) = (start.wrapping_add(behind), Reference::<f64, 2>::at(&sine, start.wrapping_add(behind)));
            assert_eq!(Reference::<f64, 2>::at(&plan, tick), on, "{behind} behind {start}");
        }
        Reference::<f64, 2>::settle(&mut plan, start.wrapping_add(100));
        assert_eq!(plan.left(start.wrapping_sub(7)), 0);
    }
}
