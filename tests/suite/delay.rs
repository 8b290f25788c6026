//! Two and three ticks of delay between computing a current and applying it. A drive that declares its delay holds its
//! reference; the tests also cover a drive that does not declare it.
//!
//! The plants are the suite's own; `integration_tests::drive` provides the queue between controller and plant.

use controller_core::drive::{
    Encoder, Joint, JointBandwidths, JointDesign, JointDrive, Monitored, Motor, MotorDesign, MotorDrive, Position,
    Sample, Speed, Target,
};
use controller_core::{ControlLaw, Health, Limits, Output, Running};
use integration_tests::drive::{
    Flexible, Run, Shaft, Trace, blended_sine, peak, point_to_point, rms, run_joint, run_motor,
};
use integration_tests::program::{Folder, host_sim};
use integration_tests::{sampled, with_delay};
use std::collections::VecDeque;
use std::f64::consts::TAU;

const PERIOD_S: f64 = 1e-3;
const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
const LARGEST_A: f64 = 10.0;

fn motor(delay_ticks: usize) -> MotorDesign {
    MotorDesign::by_rule(PERIOD_S, MOTOR, Encoder::absolute(14), Limits::symmetric(LARGEST_A))
        .with_lag(2e-4, delay_ticks as u32)
}

fn joint(delay_ticks: usize) -> JointDesign {
    JointDesign::new(PERIOD_S, Joint::TABLE_I, [Encoder::absolute(20); 2], Limits::symmetric(30.0), 1.3)
        .with_bandwidths(JointBandwidths::DEFAULT.slowed_for(PERIOD_S, delay_ticks).within(PERIOD_S, delay_ticks), 1.3)
}

/// Iterates over the nominal motor and motors with J, K_t and B off by 20 %.
fn shafts() -> impl Iterator<Item = Shaft> {
    let rough = Shaft { largest_current: LARGEST_A, ..Shaft::ROUGH };
    let corners = (0..8_u32).map(move |k| {
        let off = |bit: u32| if k >> bit & 1 == 0 { 1.2 } else { 0.8 };
        let [inertia, torque, damping] = [rough.inertia * off(0), rough.torque * off(1), rough.damping * off(2)];
        Shaft { inertia, torque, damping, ..rough }
    });
    [rough].into_iter().chain(corners)
}

/// Iterates over the nominal joint and joints with all parameters off by 20 %.
fn joints() -> impl Iterator<Item = Flexible> {
    let nominal = Flexible { largest_current: 30.0, ..Flexible::NOMINAL };
    let signs = |k: u32| core::array::from_fn(|j| if k >> j & 1 == 0 { 0.2 } else { -0.2 });
    [nominal].into_iter().chain((0..32).map(move |k| Flexible { errors: signs(k), ..nominal }))
}

/// Runs a motor whose drive declares this many ticks of delay, on a plant that has `real` ticks.
fn turned(declared: usize, real: u32, shaft: Shaft, span_s: f64, plan: &dyn Fn(f64) -> [f64; 2]) -> Trace {
    let run = Run { period_s: PERIOD_S, bits: 14, ticks: (span_s / PERIOD_S) as u32, delay: real };
    with_delay!(declared, LATE => {
        let law = MotorDrive::<f32, Position, 1, LATE>::try_design(&motor(declared)).expect("a good design");
        run_motor(law, shaft, run, plan, |_, _, _| ())
    })
}

fn swung(declared: usize, real: u32, plant: Flexible, span_s: f64, plan: &dyn Fn(f64) -> [f64; 4]) -> Trace {
    let run = Run { period_s: PERIOD_S, bits: 20, ticks: (span_s / PERIOD_S) as u32, delay: real };
    with_delay!(declared, LATE => {
        let law = JointDrive::<f32, Position, 1, LATE>::try_design(&joint(declared)).expect("a good design");
        run_joint(law, plant, run, plan, |_, _, _| ())
    })
}

/// Returns the peak-to-peak range of u in the last half second.
fn swing(trace: &Trace) -> f64 {
    let last = &trace.u[trace.u.len() - 500..];
    let [least, most] = last.iter().fold([f64::MAX, f64::MIN], |[least, most], &u| [least.min(u), most.max(u)]);
    most - least
}

/// Conditions: friction, cogging and a current loop of 0.2 ms, J, K_t and B off by ±20 %. A sine of 1 rad and 1 Hz, and
/// a fifth of the largest torque as a load step. u at rest stays within the range that friction leaves.
#[test]
fn a_motor_holds_a_sine_and_a_load_with_every_delay_that_it_declares() {
    let mut before = 0.0;
    for (late, bars) in [[1e-3, 2e-2], [6e-3, 1e-1], [1.4e-2, 2.7e-1], [2.7e-2, 5.2e-1]].into_iter().enumerate() {
        let mut worst = [0.0_f64; 4];
        for shaft in shafts() {
            let sine = turned(late, late as u32, shaft, 2.0, &blended_sine(1.0, TAU, 0.25));
            let load = turned(late, late as u32, Shaft { load: [0.1, 0.1], ..shaft }, 2.0, &|_| [0.0; 2]);
            let rest = peak(&load.error[1500..]);
            let found = [rms(&sine.error[1000..]), peak(&load.error), rest, swing(&load)];
            worst = core::array::from_fn(|k| worst[k].max(found[k]));
        }
        let [sine, load, rest, swing] = worst;
        println!("{late} late: sine {sine:.1e} rad rms, load {load:.1e} rad, {rest:.1e} rad and {swing:.2} A after it");
        assert!(sine <= bars[0] && load <= bars[1] && rest <= 0.02 && swing <= 1.0, "{late} late: {worst:?}");
        assert!(load > before, "a delay that costs nothing is none");
        before = load;
    }
}

/// With the delay undeclared, u of the same motor swings from limit to limit.
#[test]
fn a_motor_that_does_not_declare_its_delay_swings_from_limit_to_limit() {
    let loaded = Shaft { load: [0.1, 0.1], largest_current: LARGEST_A, ..Shaft::ROUGH };
    for real in [2, 3] {
        let [undeclared, declared] = [0, real].map(|late| turned(late as usize, real, loaded, 2.0, &|_| [0.0; 2]));
        println!("{real} late: u swings by {:.1} A undeclared, {:.2} A declared", swing(&undeclared), swing(&declared));
        assert!(swing(&undeclared) > 1.9 * LARGEST_A && swing(&declared) < 0.5);
    }
}

/// `design` evaluates the exact loop of the file: inertias, stiffness and torque constant off by 20 % each, in every
/// combination, with a current loop of 0.2 ms.
#[test]
fn all_corners_of_the_templates_are_stable_with_every_delay() {
    for (name, text, corners) in [("motor", scenario::MOTOR, 4), ("joint", scenario::JOINT, 16)] {
        let folder = Folder::new(&format!("delay-{name}"));
        let file = folder.path("it.toml");
        std::fs::write(&file, text).expect("the scenario");
        for period in ["1e-3", "5e-4"] {
            for late in 0..=3 {
                let sets = [format!("drive.period_s={period}"), format!("drive.delay_ticks={late}")];
                let told = host_sim(&["design", &file, "--set", &sets[0], "--set", &sets[1]]);
                let stable = format!("{corners} corners of drive.uncertain_percent: all stable");
                assert!(told.out.contains(&stable), "{name}, {sets:?}: {told:?}");
            }
        }
    }
}

/// Speed loops with three and four states, up to 20 rad/s with a load of a fifth of the largest torque.
#[test]
fn a_speed_loop_holds_a_speed_with_every_delay_that_it_declares() {
    let ramp = |t: f64| if t < 0.2 { [0.0, 100.0 * t] } else { [0.0, 20.0] };
    for shaft in sampled(shafts(), 3) {
        let shaft = Shaft { load: [0.6, 0.1], ..shaft };
        for late in 0..=3_usize {
            let run = Run { period_s: PERIOD_S, bits: 14, ticks: 2000, delay: late as u32 };
            let found = with_delay!(late, LATE => {
                let three = MotorDrive::<f32, Speed, 1, LATE>::try_design(&motor(late)).expect("a good design");
                let four = MotorDrive::<f32, Speed, 1, LATE, 4>::try_design(&motor(late)).expect("a good design");
                [run_motor(three, shaft, run, &ramp, |_, _, _| ()), run_motor(four, shaft, run, &ramp, |_, _, _| ())]
            });
            let [three, four] = found.map(|trace| (peak(&trace.speed_error[1600..]), swing(&trace)));
            println!("{late} late: {:.2}, {:.2} rad/s off, u by {:.2}, {:.2} A", three.0, four.0, three.1, four.1);
            for (off, swing) in [three, four] {
                assert!(off < 1.0 && swing < 2.5, "{late} late: {off} rad/s, {swing} A");
            }
        }
    }
}

/// All parameters off by ±20 %: a sine, a move of 1 rad in 1 s, and a load of 0.5 N m on the link.
#[test]
fn a_joint_holds_a_sine_a_move_and_a_load_with_every_delay_that_it_declares() {
    for late in 0..=3_usize {
        let mut worst = [0.0_f64; 4];
        for plant in sampled(joints(), 4) {
            let sine = swung(late, late as u32, plant, 6.0, &blended_sine(0.5, 1.0, 2.0));
            let moved = swung(late, late as u32, plant, 2.0, &point_to_point(1.0, 0.2, 1.0, 5));
            let loaded = Flexible { load: [1.0, 0.5 / 0.230], ..plant };
            let load = swung(late, late as u32, loaded, 3.0, &|_| [0.0; 4]);
            let found = [
                rms(&sine.error[3000..]),
                peak(&moved.error[200..]),
                peak(&load.error[990..]),
                peak(&load.error[2700..]),
            ];
            worst = core::array::from_fn(|k| worst[k].max(found[k]));
        }
        let [sine, moved, load, rest] = worst;
        println!("{late} late: sine {sine:.1e} rad rms, move {moved:.1e}, load {load:.1e}, {rest:.1e} rad after it");
        assert!(sine <= 1.6e-5 && moved <= 4.1e-3 && load <= 4.3e-3 && rest <= 5e-5, "{late} late: {worst:?}");
    }
}

/// A joint with one or two ticks more delay than declared swings to its limits.
#[test]
fn a_joint_that_does_not_declare_its_delay_swings_to_its_limits() {
    let loaded = Flexible { load: [1.0, 0.5 / 0.230], largest_current: 30.0, ..Flexible::NOMINAL };
    for (real, declared) in [(2, 0), (2, 1), (3, 0), (3, 1)] {
        let wrong = swung(declared, real, loaded, 3.0, &|_| [0.0; 4]);
        let right = swung(real as usize, real, loaded, 3.0, &|_| [0.0; 4]);
        let [wrong, right] = [&wrong, &right].map(|trace| peak(&trace.u[2700..]));
        println!("{real} late, {declared} declared: up to {wrong:.1} A, {right:.1} A declared");
        assert!(wrong > 29.9 && right < 6.0, "{real} late, {declared} declared: {wrong} A, {right} A");
    }
}

/// Queue between a controller and its plant; the newest u is at the end.
struct Queue(VecDeque<f64>);

impl Queue {
    fn of(delay: usize) -> Self {
        Self(VecDeque::from(vec![0.0; delay]))
    }

    fn held(&mut self, output: &Output<f32>) -> f64 {
        self.0.push_back(f64::from(output.u));
        self.0.pop_front().expect("one that was just queued")
    }
}

fn running<L: ControlLaw>(law: L) -> Running<L> {
    Running::new(law)
}

/// Braking from 60 rad/s without a limit cycle. The stopping distance stays within 1.5 times a bound: the distance that
/// the current allows, the delay, and the last part, where the brake fades. Then the drive switches off the current at
/// rest.
#[test]
fn a_motor_brakes_to_rest_with_every_delay() {
    for late in 0..=3_usize {
        let design = motor(late);
        let (period_s, unit) = (design.period_s, design.encoder.unit_rad());
        let mut shaft = Shaft { largest_current: LARGEST_A, ..Shaft::ROUGH };
        let (speed, most) = (60.0, LARGEST_A * MOTOR.input_gain());
        let jet = |t: f64| {
            let s = ((t - 0.1) / 0.5).max(0.0);
            if s > 1.0 { [speed * (t - 0.35), speed] } else { [speed * 0.25 * s * s, speed * s] }
        };
        let target = |t: f64| {
            let [r, v] = jet(t);
            let turn = (r / TAU).round();
            Target { turn: turn as i32, jet: [(r - turn * TAU) as f32, v as f32] }
        };
        let mut queue = Queue::of(late);
        let (mut from, mut changes, mut last_u, mut stopped) = (0.0, 0, 0.0_f32, None);
        with_delay!(late, LATE => {
            let law = MotorDrive::<f32, Position, 1, LATE>::try_design(&design).expect("a good design");
            let mut running = running(Monitored::new(law, &design.bounds(&law, 0.2)).braking());
            for k in 0..4000_u32 {
                let t = f64::from(k) * period_s;
                let counts = [Some((shaft.x[0] / unit).round() as i32)];
                let ahead = t + late as f64 * period_s;
                let output = running.tick(&Sample { counts, begin: target(ahead), end: target(ahead + period_s) });
                if k == 1000 {
                    assert!(!output.health.contains(Health::BRAKES), "{output:?}");
                    from = shaft.x[0];
                    running.trip();
                }
                if output.health.contains(Health::STOPPED) {
                    stopped = Some((k, shaft.x));
                    break;
                }
                assert!(!output.health.intersects(Health::OSCILLATES | Health::WRONG_WAY), "{output:?}");
                // The braking current opposes the speed and does not alternate.
                changes += u32::from(k > 1002 && output.u * last_u < -1.0);
                last_u = output.u;
                shaft.advance(t, queue.held(&output), period_s);
            }
        });
        let (tick, x) = stopped.expect("it stops");
        let gain = 0.5 * design.bandwidths.surface_rad_s;
        let allowed = speed * speed / (2.0 * most) + speed.min(most / gain) / gain + late as f64 * period_s * speed;
        let way = x[0] - from;
        println!("{late} late: {way:.2} rad of {allowed:.2} in {} ms, {:.3} rad/s at the end", tick - 1000, x[1]);
        assert!(way < 1.5 * allowed && x[1].abs() < 0.1 && changes == 0, "{late} late: {way} rad, {x:?}, {changes}");
    }
}

/// A joint's brake is softer for a longer delay.
#[test]
fn a_joint_brakes_to_rest_with_every_delay() {
    for late in 0..=3_usize {
        let design = joint(late);
        let unit = design.encoders[0].unit_rad();
        let mut plant = Flexible { largest_current: 30.0, ..Flexible::NOMINAL };
        let plan = point_to_point::<4>(1.5, 0.0, 1.0, 7);
        let target = |t: f64| Target { turn: 0, jet: plan(t).map(|r| r as f32) };
        let mut queue = Queue::of(late);
        let (mut from, mut speed, mut stopped) = (0.0, 0.0, None);
        with_delay!(late, LATE => {
            let law = JointDrive::<f32, Position, 1, LATE>::try_design(&design).expect("a good design");
            let mut running = running(Monitored::new(law, &design.bounds(&law, 1.3, 0.2)).braking());
            for k in 0..12_000_u32 {
                let t = f64::from(k) * PERIOD_S;
                let counts = [plant.x[0], plant.x[2] / Flexible::K_1].map(|angle| Some((angle / unit).round() as i32));
                let ahead = t + late as f64 * PERIOD_S;
                let output = running.tick(&Sample { counts, begin: target(ahead), end: target(ahead + PERIOD_S) });
                if k == 500 {
                    (from, speed) = (plant.x[0], plant.x[1]);
                    running.trip();
                }
                if output.health.contains(Health::STOPPED) {
                    stopped = Some((k, plant.x));
                    break;
                }
                assert!(!output.health.intersects(Health::OSCILLATES | Health::WRONG_WAY), "{output:?}");
                // Under the plant's disturbance and weight a brake never comes to rest, so both are removed.
                let load = 1.0 + (2.0 * t).sin() - 0.230 / 0.119 * plant.x[0].sin();
                plant.advance(t, queue.held(&output) - load, PERIOD_S);
            }
        });
        let (tick, x) = stopped.expect("it stops");
        println!("{late} late: link at {speed:.2} rad/s, {:.3} rad on, at rest after {} ms", x[0] - from, tick - 500);
        let allowed = speed * design.slowing(late).constant_s;
        assert!(speed > 2.0 && (x[0] - from).abs() < allowed && x[1].abs() < 0.01, "{late} late: {x:?}");
    }
}

/// Missing counts, missed interrupts and a retune in motion, with earlier commands still in the queue.
#[test]
fn lost_samples_missed_ticks_and_a_re_tune_leave_a_late_drive_on_its_reference() {
    let plan = blended_sine::<2>(1.0, TAU, 0.25);
    let target = |t: f64| Target { turn: 0, jet: plan(t).map(|r| r as f32) };
    for late in 0..=3_usize {
        let design = motor(late);
        let slower = design.with_surface(0.9 * design.bandwidths.surface_rad_s);
        let mut shaft = Shaft { largest_current: LARGEST_A, ..Shaft::CLEAN };
        let (mut queue, mut worst, mut jump, mut last_u) = (Queue::of(late), 0.0_f64, 0.0_f32, 0.0_f32);
        with_delay!(late, LATE => {
            let designed = |design| MotorDrive::<f32, Position, 1, LATE>::try_design(design).expect("a good design");
            let mut running = running(designed(&design));
            let mut k = 0_u32;
            while k < 3000 {
                let t = f64::from(k) * PERIOD_S;
                if k == 1500 {
                    // Two interrupts are missed; the last command stays applied.
                    for missed in 0..2 {
                        let held = queue.held(&Output { u: last_u, sigma: 0.0, sigma_star: 0.0, health: Health::OK });
                        shaft.advance(t + f64::from(missed) * PERIOD_S, held, PERIOD_S);
                    }
                    running.missed(2);
                    k += 2;
                    continue;
                }
                let ahead = t + late as f64 * PERIOD_S;
                let count = (shaft.x[0] / design.encoder.unit_rad()).round() as i32;
                let counts = [Some(count).filter(|_| !(1000..1020).contains(&k))];
                let sample = Sample { counts, begin: target(ahead), end: target(ahead + PERIOD_S) };
                if k == 2000 {
                    running.retune(designed(&slower), &sample).expect("designs that can take over");
                }
                let output = running.tick(&sample);
                if k > 600 {
                    worst = worst.max((shaft.x[0] - plan(t)[0]).abs());
                    jump = jump.max((output.u - last_u).abs());
                }
                last_u = output.u;
                shaft.advance(t, queue.held(&output), PERIOD_S);
                k += 1;
            }
        });
        println!("{late} late: at most {worst:.1e} rad off, u by {jump:.3} A in a tick");
        assert!(worst < 3e-3 && jump < 0.5, "{late} late: {worst} rad, {jump} A");
    }
}
