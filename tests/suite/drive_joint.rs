//! Drive of a flexible joint on the paper's joint with its default bandwidths.
//!
//! The thresholds are some 1.5 times the results of another implementation of the controller and the plant. Where that
//! implementation recorded whole runs, the tests compare them.

use controller_core::drive::{
    Encoder, Joined, Joint, JointBandwidths, JointDesign, JointDrive, Position, Reference, Rest, Sample, Switching,
    Target, shortest,
};
use controller_core::{Limits, Running};
use integration_tests::data;
use integration_tests::drive::{
    AtOnce as _, Flexible, JointSample, LinearLaw, Run, Trace, blended_sine, peak, point_to_point, recovered, rms,
    run_joint, shortest_to_rest, to_rest,
};
use integration_tests::sampled;
use integration_tests::strategy::Rng;
use integration_tests::with_delay;

fn design(period_s: f64, bits: u32, bandwidths: JointBandwidths) -> JointDesign {
    JointDesign::new(period_s, Joint::TABLE_I, [Encoder::absolute(bits); 2], Limits::symmetric(30.0), 1.3)
        .with_bandwidths(bandwidths, 1.3)
}

const DEFAULT: JointBandwidths = JointBandwidths::DEFAULT;

fn run<const FAST: usize>(design: &JointDesign, plant: Flexible, span_s: f64, plan: &dyn Fn(f64) -> [f64; 4]) -> Trace {
    let law = JointDrive::<f32, Position, FAST>::try_design(design).expect("a good design");
    let (period_s, bits) = (design.period_s, design.encoders[0].bits);
    let run = Run { period_s, bits, ticks: (span_s / period_s).round() as u32, delay: 0 };
    run_joint(law, plant, run, plan, |_, _, _| ())
}

fn second_half(values: &[f64]) -> &[f64] {
    &values[values.len() / 2..]
}

/// Returns the rms error of the second half of 0.5 sin t over 6 s.
fn sine<const FAST: usize>(design: &JointDesign, plant: Flexible) -> f64 {
    rms(second_half(&run::<FAST>(design, plant, 6.0, &blended_sine(0.5, 1.0, 2.0)).error))
}

/// Returns the peak error on a move of 1 rad in 1 s, from the start of the move; at t = 0 v is not yet estimated.
fn moved<const FAST: usize>(design: &JointDesign, plant: Flexible, degree: usize) -> f64 {
    let trace = run::<FAST>(design, plant, 2.0, &point_to_point(1.0, 0.2, 1.0, degree));
    peak(&trace.error[trace.error.len() / 10..])
}

/// Returns the peak error after a load of 0.5 N m.
fn load<const FAST: usize>(design: &JointDesign, plant: Flexible) -> f64 {
    let loaded = Flexible { load: [1.0, 0.5 / 0.230], ..plant };
    peak(&run::<FAST>(design, loaded, 2.0, &|_| [0.0; 4]).error[990..])
}

/// Returns the difference sample by sample.
fn less(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn corners(size: f64) -> impl Iterator<Item = Flexible> {
    let signs = move |k: u32| core::array::from_fn(|j| if k >> j & 1 == 0 { size } else { -size });
    (0..32).map(move |k| Flexible { errors: signs(k), ..Flexible::NOMINAL })
}

#[test]
fn figures_with_bandwidths_as_they_come() {
    let (default, firm) = (design(1e-3, 20, DEFAULT), design(1e-3, 20, JointBandwidths::FIRM));
    let nominal = Flexible::NOMINAL;
    let firm = JointDesign { fast_ratios: [3.0, 1.2], ..firm };
    let found = [
        ("sine, rms", sine::<1>(&default, nominal), 6e-6),
        ("load", load::<1>(&default, nominal), 1.6e-3),
        ("load, one set", load::<0>(&default, nominal), 3.3e-3),
        ("load, firm", load::<1>(&firm, nominal), 1.0e-3),
        ("minimum jerk", moved::<1>(&default, nominal, 5), 6e-5),
        ("degree 7", moved::<1>(&default, nominal, 7), 2e-5),
        ("degree 9", moved::<1>(&default, nominal, 9), 2e-5),
        ("sine, 16 bits", sine::<1>(&design(1e-3, 16, DEFAULT), nominal), 3e-5),
        ("sine, 12 bits", sine::<1>(&design(1e-3, 12, JointBandwidths::QUIET), nominal), 1.5e-4),
        ("sine, 24 bits", sine::<1>(&design(1e-3, 24, DEFAULT), nominal), 4e-6),
        ("sine, friction", sine::<1>(&default, Flexible { rough: true, ..nominal }), 1.2e-5),
        ("minimum jerk, friction", moved::<1>(&default, Flexible { rough: true, ..nominal }, 5), 8e-5),
        ("load, friction", load::<1>(&default, Flexible { rough: true, ..nominal }), 1.7e-3),
        ("sine, 0.2 ms", sine::<1>(&design(2e-4, 20, DEFAULT), nominal), 3e-6),
        ("degree 7, 0.2 ms", moved::<1>(&design(2e-4, 20, DEFAULT), nominal, 7), 1e-5),
        ("load, 0.2 ms", load::<1>(&design(2e-4, 20, DEFAULT), nominal), 1.6e-3),
    ];
    for (name, found, bar) in found {
        println!("{name}: {found:.2e} (bar {bar:.1e})");
    }
    for (name, found, bar) in found {
        assert!(found <= bar, "{name}: {found:e}, bar {bar:e}");
    }
}

#[test]
fn figures_of_a_wrong_model() {
    let default = design(1e-3, 20, DEFAULT);
    let largest = |values: Vec<f64>| values.into_iter().fold(0.0, f64::max);
    let rough = corners(0.2).map(|plant| Flexible { rough: true, ..plant });
    let found = [
        ("sine, 50 %", largest(corners(0.5).map(|plant| sine::<1>(&default, plant)).collect()), 4e-5),
        ("load, 50 %", largest(corners(0.5).map(|plant| load::<1>(&default, plant)).collect()), 8e-3),
        ("minimum jerk, 20 %", largest(corners(0.2).map(|plant| moved::<1>(&default, plant, 5)).collect()), 2e-3),
        ("load, 20 %", largest(corners(0.2).map(|plant| load::<1>(&default, plant)).collect()), 2.5e-3),
        ("sine, friction, 20 %", largest(rough.map(|plant| sine::<1>(&default, plant)).collect()), 2e-5),
    ];
    println!("{found:?}");
    for (name, found, bar) in found {
        assert!(found <= bar, "{name}: {found:e}, bar {bar:e}");
    }
}

/// Unstable corners of ±50 %: spring over link inertia and damping of the motor +50 %, K_t/J_m -50 %. 1 kHz with a tick
/// of delay, and 500 Hz, are too slow for them. From the first encoder count on they oscillate, within a second or a
/// few, up to some 5e-3 rad. The other implementation also oscillates there; its text claims all 32 corners.
const LOST_CORNERS: [[f64; 5]; 4] = [
    [0.5, 0.5, 0.5, 0.5, -0.5],
    [0.5, -0.5, 0.5, 0.5, -0.5],
    [0.5, 0.5, -0.5, 0.5, -0.5],
    [0.5, -0.5, -0.5, 0.5, -0.5],
];

fn random(seed: u64, count: usize) -> Vec<Flexible> {
    let mut rng = Rng::new(seed);
    let mut errors = || core::array::from_fn(|_| rng.within(-0.5, 0.5));
    (0..count).map(|_| Flexible { errors: errors(), ..Flexible::NOMINAL }).collect()
}

/// Returns the plants whose sampled loop near rest, with one gain set, has a spectral radius of 1 or more, and the
/// largest radius.
fn unstable<const LATE: usize>(design: &JointDesign, plants: &[Flexible]) -> (Vec<[f64; 5]>, f64) {
    let limits = Limits::symmetric(1e9);
    let encoders = [Encoder::absolute(24); 2];
    let design = JointDesign { gate_steps: [f64::INFINITY; 2], limits, encoders, ..*design };
    let law = JointDrive::<f64, Position, 0, LATE>::try_design(&design).expect("a good design");
    let law = LinearLaw::of(&law, encoders[0].unit_rad());
    let (mut found, mut largest) = (Vec::new(), 0.0_f64);
    for plant in plants {
        let advance = |x, u| {
            let mut plant = Flexible { x, ..*plant };
            plant.advance(0.0, u, design.period_s);
            plant.x
        };
        let radius = law.spectral_radius(LATE, advance, |x| [x[0], x[2] / Flexible::K_1]);
        largest = largest.max(radius);
        if radius >= 1.0 {
            found.push(plant.errors);
        }
    }
    (found, largest)
}

/// 32 corners of ±20 %, 32 of ±50 %, 60 random errors within ±50 %, 200 more for the default bandwidths.
#[test]
fn near_rest_nothing_grows_but_four_corners_of_slow_loops() {
    let (known, held_out) = (random(0x9A11, 60), random(0x9A12, 200));
    let plants: Vec<Flexible> = corners(0.2).chain(corners(0.5)).chain(known).collect();
    let [default, firm] = [DEFAULT, JointBandwidths::FIRM].map(|bandwidths| design(1e-3, 20, bandwidths));
    let slower = design(2e-3, 20, JointBandwidths { motor_rad_s: 300.0, ..DEFAULT });
    let found = [
        ("default", unstable::<0>(&default, &plants), &[][..]),
        ("firm", unstable::<0>(&firm, &plants), &[]),
        ("default, held out", unstable::<0>(&default, &held_out), &[]),
        ("firm, held out", unstable::<0>(&firm, &held_out), &[]),
        ("0.2 ms", unstable::<0>(&design(2e-4, 20, DEFAULT), &plants), &[]),
        ("2 ms", unstable::<0>(&slower, &plants), &LOST_CORNERS),
        ("delay", unstable::<1>(&default, &plants), &LOST_CORNERS),
    ];
    for (name, (lost, largest), _) in &found {
        println!("{name}: {} unstable, spectral radius up to {largest:.5}", lost.len());
    }
    for (name, (lost, _), allowed) in found {
        assert!(lost.iter().all(|lost| allowed.contains(lost)), "{name}: {lost:?}");
    }
}

/// 32 corners of ±20 %: the measured sets at 1, 0.5 and 0.2 ms, slowed by the rule, and the fastest bandwidths that a
/// design accepts, whose k_l is 5 times w_c. At ±50 % some corners at 1 ms are unstable.
#[test]
fn with_two_and_three_ticks_of_delay_a_joint_is_stable_within_20_percent() {
    let [near, far] = [0.2, 0.5].map(|size| corners(size).collect::<Vec<_>>());
    for delay in [2, 3] {
        let radius = |period_s: f64, bandwidths: JointBandwidths, plants: &[Flexible]| {
            let design = design(period_s, 20, bandwidths);
            let (lost, largest) = with_delay!(delay, LATE => unstable::<LATE>(&design, plants));
            (lost.len(), largest)
        };
        for (name, set) in [("default", DEFAULT), ("firm", JointBandwidths::FIRM), ("quiet", JointBandwidths::QUIET)] {
            for period_s in [1e-3, 5e-4, 2e-4] {
                let bandwidths = set.slowed_for(period_s, delay).within(period_s, delay);
                let (lost, largest) = radius(period_s, bandwidths, &near);
                println!("{name}, {period_s} s, {delay} late: {:.0} rad/s, {largest:.5}", bandwidths.motor_rad_s);
                assert_eq!(lost, 0, "{name}, {period_s} s, {delay} late: {largest}");
            }
        }
        for period_s in [1e-3, 2e-4] {
            let motor_rad_s = JointDesign::motor_observer_limit(delay) / period_s;
            let surface_rad_s = motor_rad_s / 10.5;
            let fastest = JointBandwidths {
                surface_rad_s,
                link_rad_s: motor_rad_s / 3.5,
                motor_rad_s,
                reaching_per_s: 5.0 * surface_rad_s,
                offset_per_s: 0.5 * surface_rad_s,
            };
            let (lost, largest) = radius(period_s, fastest, &near);
            println!("fastest, {period_s} s, {delay} late: {largest:.5}");
            assert_eq!(lost, 0, "{fastest:?}, {delay} late: {largest}");
            let over = design(period_s, 20, JointBandwidths { motor_rad_s: 1.001 * motor_rad_s, ..fastest });
            let error = over.validate(delay).expect_err("too fast");
            assert_eq!((error.field, error.nearest()), ("bandwidths.motor_rad_s", error.high));
        }
        let (lost, largest) = radius(1e-3, DEFAULT.slowed_for(1e-3, delay).within(1e-3, delay), &far);
        println!("default, 50 %, {delay} late: {lost} of 32 lost, {largest:.5}");
        assert_eq!(lost, if delay == 2 { 8 } else { 9 });
    }
}

/// Corners in f32 with encoders: a start off the reference decays, and nothing grows in 8 s.
#[test]
fn corners_of_the_joint_are_stable() {
    let plants: Vec<Flexible> = corners(0.5).chain(corners(0.2)).chain(random(0x9A11, 60)).collect();
    let held_out = random(0x9A12, 200);
    let slower = JointBandwidths { motor_rad_s: 300.0, ..DEFAULT };
    for (period_s, bits, bandwidths, delay, plants) in [
        (1e-3, 24, DEFAULT, 0, &plants),
        (1e-3, 24, JointBandwidths::FIRM, 0, &plants),
        (1e-3, 24, DEFAULT, 1, &plants),
        (2e-4, 24, DEFAULT, 0, &plants),
        (2e-3, 24, slower, 0, &plants),
        (1e-3, 20, DEFAULT, 0, &held_out),
        (1e-3, 20, JointBandwidths::FIRM, 0, &held_out),
    ] {
        let design = JointDesign { gate_steps: [f64::INFINITY; 2], ..design(period_s, bits, bandwidths) };
        let run = Run { period_s, bits, ticks: (8.0 / period_s) as u32, delay };
        let is_slow = delay == 1 || period_s == 2e-3;
        let mut worst = 0.0_f64;
        for plant in sampled(plants, 4) {
            if is_slow && LOST_CORNERS.contains(&plant.errors) {
                continue;
            }
            let plant = Flexible { x: [1e-3, 0.0, 1e-3 * Flexible::K_1, 0.0], ..*plant };
            let still = |_: f64| [0.0; 4];
            let error = if delay == 0 {
                let law = JointDrive::<f32>::try_design(&design).expect("a good design");
                run_joint(law, plant, run, &still, |_, _, _| ()).error
            } else {
                let law = JointDrive::<f32, Position, 0, 1>::try_design(&design).expect("a good design");
                run_joint(law, plant, run, &still, |_, _, _| ()).error
            };
            let last = peak(&error[error.len() * 9 / 10..]);
            worst = worst.max(last);
            assert!(last <= 5e-5, "T {period_s}, {bits} bits, {delay} late, {:?}: {last:e}", plant.errors);
        }
        println!("T {period_s}, {bits} bits, {delay} late: at most {worst:.1e} rad are left of 1e-3");
    }
}

/// Returns the current noise from encoder quantisation, rms over the second half of a sine. A second controller sees
/// the same motion through encoders of 24 bits.
fn noise(period_s: f64, bits: u32, bandwidths: JointBandwidths) -> f64 {
    const FINE: u32 = 24;
    let open = |bits| JointDesign { gate_steps: [f64::INFINITY; 2], ..design(period_s, bits, bandwidths) };
    let (coarse, fine) = (open(bits), open(FINE));
    // The high gains are scheduled in at equal angles.
    let times = f64::from(1 << (FINE - bits));
    let Switching { calm_steps, alert_steps, .. } = coarse.switching;
    let switching = Switching { calm_steps: calm_steps * times, alert_steps: alert_steps * times, ..coarse.switching };
    let laws = [coarse, JointDesign { switching, ..fine }]
        .map(|design| JointDrive::<f64, Position, 1>::try_design(&design).expect("a good design"));
    let [mut shown, mut exact] = laws.map(Running::new);
    let plan = blended_sine::<4>(0.5, 1.0, 2.0);
    let ticks = (6.0 / period_s) as u32;
    let (mut plant, mut apart) = (Flexible::NOMINAL, Vec::new());
    for k in 0..ticks {
        let t = f64::from(k) * period_s;
        let [begin, end] = [t, t + period_s].map(|t| Target { turn: 0, jet: plan(t) });
        let counts = |bits: u32| {
            let unit = std::f64::consts::TAU / f64::from(1 << bits);
            [plant.x[0], plant.x[2] / Flexible::K_1].map(|angle| Some((angle / unit + 0.5).floor() as i32))
        };
        let u = shown.tick_at_once(&Sample { counts: counts(bits), begin, end }).u;
        let of_exact = exact.tick_at_once(&Sample { counts: counts(FINE), begin, end }).u;
        exact.report_applied(u);
        apart.push(u - of_exact);
        plant.advance(t, u, period_s);
    }
    rms(second_half(&apart))
}

#[test]
fn the_steps_of_the_encoders_make_no_more_noise_than_said() {
    let found = [
        ("default", noise(1e-3, 20, DEFAULT), 0.015),
        ("firm", noise(1e-3, 20, JointBandwidths::FIRM), 0.035),
        ("0.2 ms", noise(2e-4, 20, DEFAULT), 0.008),
        ("16 bits", noise(1e-3, 16, DEFAULT), 0.25),
        ("12 bits, quiet", noise(1e-3, 12, JointBandwidths::QUIET), 0.45),
        // Two encoders, one with half the count size, differ by √5 times the noise of the finer one.
        ("24 bits", noise(1e-3, 23, DEFAULT) / 5.0_f64.sqrt(), 2e-3),
    ];
    for (name, found, bar) in found {
        println!("{name}: {found:.2e} A (bar {bar})");
    }
    for (name, found, bar) in found {
        assert!(found <= bar && found > 0.01 * bar, "{name}: {found:e} A, bar {bar}");
    }
}

/// A hundred revolutions away every result equals the result at 0, at the same time under the same disturbance.
#[test]
fn a_hundred_turns_away_nothing_is_different() {
    let away = 100.0 * std::f64::consts::TAU;
    let there = |way: f64| {
        let (moved, sine) = (point_to_point::<4>(way, 0.0, 60.0, 9), blended_sine::<4>(0.5, 1.0, 2.0));
        move |t: f64| {
            let (mut jet, more) = (moved(t), if t > 60.0 { sine(t - 60.0) } else { [0.0; 4] });
            for (jet, more) in jet.iter_mut().zip(more) {
                *jet += more;
            }
            jet
        }
    };
    for (bits, period_s) in [(20, 1e-3), (24, 1e-3), (20, 2e-4)] {
        let found = [0.0, away].map(|way| {
            let trace = run::<1>(&design(period_s, bits, DEFAULT), Flexible::NOMINAL, 66.0, &there(way));
            rms(&trace.error[trace.error.len() * 63 / 66..])
        });
        println!("{bits} bits, {period_s} s: {:.2e} at home, {:.2e} away", found[0], found[1]);
        assert!(found[1] <= 1.1 * found[0] + 1e-9, "{found:?}");
    }
}

/// Returns a recovery by a polynomial transition from rest at 0.1 rad with the motor at 0, the shortest within 27 A.
fn recovery(angle: f64, motor: f64) -> impl Fn(f64) -> [f64; 4] {
    let (k_1, b_1) = (9.0 / 0.23, 0.07 / 0.23);
    let pull = k_1 * (angle - motor) + angle.sin();
    let gap = [angle, 0.0, -pull, b_1 * pull];
    let plan = move |ticks| Joined::<f64, _, 4>::new(Rest { turn: 0, angle: 0.0 }, gap, 0, ticks, 1e-3);
    let joint = Joint::TABLE_I;
    let ticks = shortest::<_, 5>(0, 20, 10_000, 27.0, |jet| joint.feed_forward(jet), plan).expect("a plan");
    let plan = plan(ticks);
    move |t| {
        let target: Target<f64, i32, 4> = plan.at((t / 1e-3).round() as u32);
        target.jet
    }
}

#[test]
fn a_planned_recovery_settles_as_planned() {
    let default = design(1e-3, 20, DEFAULT);
    let start = Flexible { x: [0.1, 0.0, 0.0, 0.0], ..Flexible::NOMINAL };
    let trace = run::<1>(&default, start, 1.0, &recovery(0.1, 0.0));
    let plan = recovery(0.1, 0.0);
    let angle = |k: usize| trace.error[k] + plan(1e-3 * k as f64)[0];
    let settled = (0..1000).rposition(|k| angle(k).abs() > 0.01).expect("it began outside") + 1;
    println!("inside 0.01 rad after {settled} ms, at most {:.1e} from the plan", peak(&trace.error));
    assert!(settled <= 170 && peak(&trace.error) <= 1e-4, "{settled} ms");
    // From rest with the spring relaxed against the weight alone.
    for angle in [0.3, 0.8, 1.5, 3.0_f64] {
        let motor = angle + angle.sin() / Flexible::K_1;
        let start = Flexible { x: [angle, 0.0, motor * Flexible::K_1, 0.0], ..Flexible::NOMINAL };
        let off = peak(&run::<1>(&default, start, 2.0, &recovery(angle, motor)).error);
        assert!(off <= 1e-4, "from {angle} rad: {off:e}");
    }
}

/// Returns a move of 1 rad of degree 9 from rest. After 0.7 s, in full motion, a polynomial transition of degree 9
/// leads to -0.3 rad, the shortest within 27 A.
fn retargeted() -> impl Fn(f64) -> [f64; 4] {
    const AT_S: f64 = 0.7;
    let first = point_to_point::<5>(1.0, 0.2, 1.0, 9);
    let there = |mut jet: [f64; 5], angle: f64| {
        jet[0] += angle;
        jet
    };
    let present = there(first(AT_S), 0.3);
    let joint = Joint::TABLE_I;
    let tau = shortest_to_rest(present, 5, 27.0, |jet| joint.feed_forward(&there(*jet, -0.3)));
    let second = to_rest(present, tau, 5);
    move |t| {
        let [jet @ .., _] = if t < AT_S { first(t) } else { there(second(t - AT_S), -0.3) };
        jet
    }
}

#[test]
fn a_target_that_changes_in_flight_is_followed() {
    let off = peak(&run::<1>(&design(1e-3, 20, DEFAULT), Flexible::NOMINAL, 3.0, &retargeted()).error);
    println!("at most {off:.1e} rad from the plan");
    assert!(off <= 2e-5, "{off:e}");
}

/// Released at rest at 0.8 rad, the drive saturates for a long time. It settles because the observers use the applied
/// current. With the demanded current in its place the loop never settles.
#[test]
fn an_unplanned_start_settles_because_the_applied_u_is_known() {
    let default = design(1e-3, 20, DEFAULT);
    let angle = |start: f64| {
        let motor = start + start.sin() / Flexible::K_1;
        Flexible { x: [start, 0.0, motor * Flexible::K_1, 0.0], largest_current: 30.0, ..Flexible::NOMINAL }
    };
    let settled = |design: &JointDesign, start: f64| {
        let trace = run::<1>(design, angle(start), 4.0, &|_| [0.0; 4]);
        trace.error.iter().rposition(|error| error.abs() > 0.01).expect("it began outside") + 1
    };
    for (start, bar) in [(0.5, 600), (0.8, 650), (1.5, 590)] {
        let found = settled(&default, start);
        println!("from {start} rad settled after {found} ms");
        assert!(2 * found <= 3 * bar, "{start}: {found} ms");
    }
    let boundless = JointDesign { limits: Limits::symmetric(1e9), gate_steps: [f64::INFINITY; 2], ..default };
    for start in [0.8, 1.5] {
        let found = settled(&boundless, start);
        assert_eq!(found, 4000, "told the u asked for, from {start} rad it settled");
    }
}

/// f32 and f64, each in its own loop, with the finest encoders. With 30 bits another implementation had differences of
/// 6e-5 and 2.3e-4 A; here encoders end at 24 bits. A rounding now and then changes a count, and u differs by the noise
/// of two encoders (8e-4 A each).
#[test]
fn a_law_in_f32_runs_as_in_f64() {
    for (period_s, bars) in [(1e-3, [3e-7, 2e-3]), (2e-4, [2e-6, 1e-3])] {
        let fine = design(period_s, 24, DEFAULT);
        let run = Run { period_s, bits: 24, ticks: (6.0 / period_s).round() as u32, delay: 0 };
        let plan = blended_sine(0.5, 1.0, 2.0);
        let single = JointDrive::<f32, Position, 1>::try_design(&fine).expect("a good design");
        let double = JointDrive::<f64, Position, 1>::try_design(&fine).expect("a good design");
        let single = run_joint(single, Flexible::NOMINAL, run, &plan, |_, _, _| ());
        let double = run_joint(double, Flexible::NOMINAL, run, &plan, |_, _, _| ());
        let found = [peak(&less(&single.error, &double.error)), rms(&less(&single.u, &double.u))];
        println!("T {period_s}: y {:.1e} rad, u {:.1e} A rms", found[0], found[1]);
        assert!(found[0] <= bars[0] && found[1] <= bars[1], "T {period_s}: {found:?}, bars {bars:?}");
    }
}

/// Effect of the feed-forward of differences, and of the prediction under a tick of delay.
#[test]
fn what_is_taken_away_is_missed() {
    let default = design(1e-3, 20, DEFAULT);
    let with = moved::<1>(&default, Flexible::NOMINAL, 9);
    let law = JointDrive::<f32, Position, 1>::try_design(&default).expect("a good design");
    let plan = point_to_point(1.0, 0.2, 1.0, 9);
    let once = Run { period_s: 1e-3, bits: 20, ticks: 2000, delay: 0 };
    // Δ = 0 at equal errors removes the feed-forward and nothing else.
    let without = run_joint(law, Flexible::NOMINAL, once, &plan, |_, sample, _| sample.end = sample.begin);
    let without = peak(&without.error);
    println!("degree 9: {with:.1e}, without feed-forward {without:.1e}");
    assert!(without >= 15.0 * with);

    let jerk = point_to_point(1.0, 0.2, 1.0, 5);
    let late = Run { delay: 1, ..once };
    let knows = JointDrive::<f32, Position, 1, 1>::try_design(&default).expect("a good design");
    let predicted = peak(&run_joint(knows, Flexible::NOMINAL, late, &jerk, |_, _, _| ()).error);
    // Controller without prediction on targets of its own tick; the observers use the applied current.
    let mut held = [0.0_f32; 2];
    let blind = run_joint(law, Flexible::NOMINAL, late, &jerk, |k, sample, running| {
        let at = |more: u32| {
            let jet = jerk(1e-3 * f64::from(k + more));
            Target { turn: 0, jet: jet.map(|r| r as f32) }
        };
        (sample.begin, sample.end) = (at(0), at(1));
        running.report_applied(held[0]);
        held[0] = held[1];
        held[1] = running.clone().tick(sample).u;
    });
    let blind = peak(&blind.error);
    println!("minimum jerk, one tick late: {predicted:.1e}, without prediction {blind:.1e}");
    assert!(blind >= 4.0 * predicted && predicted <= 6e-5, "{blind:e}, {predicted:e}");
}

/// Compares with a whole run of the other implementation: largest difference of the true angle and of the applied u.
fn beside<const LATE: usize>(
    name: &str,
    plant: Flexible,
    design: &JointDesign,
    plan: &dyn Fn(f64) -> [f64; 4],
    bars: [f64; 2],
    each: impl FnMut(u32, &mut JointSample<f64>, &mut Running<JointDrive<f64, Position, 1, LATE>>),
) {
    let rows = data::columns(&format!("joint_{name}_loop.csv"), ["t", "y", "u"]);
    let span_s = rows.last().expect("rows")[0] + design.period_s;
    let law = JointDrive::<f64, Position, 1, LATE>::try_design(design).expect("a good design");
    let ticks = (span_s / design.period_s).round() as u32;
    let run = Run { period_s: design.period_s, bits: design.encoders[0].bits, ticks, delay: LATE as u32 };
    let trace = run_joint(law, plant, run, plan, each);
    let mut worst = [0.0_f64; 2];
    for [t, y, u] in rows {
        let k = (t / design.period_s).round() as usize;
        worst[0] = worst[0].max((trace.error[k] + plan(t)[0] - y).abs());
        let held = k.checked_sub(LATE).map_or(0.0, |k| trace.u[k]);
        worst[1] = worst[1].max((held - u).abs());
    }
    println!("{name}: y {:.1e} rad, u {:.1e} A", worst[0], worst[1]);
    assert!(worst[0] <= bars[0] && worst[1] <= bars[1], "{name}: {worst:?}");
}

/// Whole runs of the other implementation: true angle and applied u, tick by tick.
#[test]
fn runs_are_those_of_the_other_implementation() {
    let open = |design: JointDesign| JointDesign { gate_steps: [f64::INFINITY; 2], ..design };
    let default = open(design(1e-3, 20, DEFAULT));
    let nominal = Flexible::NOMINAL;
    let wrong = Flexible { errors: [0.5; 5], ..nominal };
    // A rounding changes a count now and then: that is a count in y, two at a start in saturation, and the noise of u.
    let bars = [6e-6, 0.1];
    let (sine, early) = (blended_sine(0.5, 1.0, 2.0), blended_sine(0.5, 1.0, 0.5));
    beside::<0>("sine", nominal, &default, &sine, bars, |_, _, _| ());
    beside::<0>("sine_plus50", wrong, &default, &sine, bars, |_, _, _| ());
    let rough = Flexible { rough: true, ..nominal };
    beside::<0>("friction_cogging", rough, &default, &blended_sine(0.5, 1.0, 1.0), bars, |_, _, _| ());
    let fine = open(design(2e-4, 20, DEFAULT));
    beside::<0>("fine_period", nominal, &fine, &point_to_point(0.5, 0.1, 0.8, 7), bars, |_, _, _| ());
    let quiet = open(design(1e-3, 12, JointBandwidths::QUIET));
    let quiet = JointDesign { bandwidths: JointBandwidths { offset_per_s: 10.0, ..JointBandwidths::QUIET }, ..quiet };
    let moved = point_to_point(1.0, 0.5, 1.25, 7);
    beside::<0>("move7_12bit", nominal, &quiet, &moved, [1.5e-3, 3.0], |_, _, _| ());
    beside::<0>("retarget", nominal, &default, &retargeted(), bars, |_, _, _| ());
    beside::<1>("move9_delay", nominal, &default, &point_to_point(1.0, 0.5, 1.25, 9), bars, |_, _, _| ());

    let loaded = Flexible { x: [0.1, 0.0, 0.0, 0.0], load: [2.0, 0.5 / 0.230], ..nominal };
    beside::<0>("recovery_load", loaded, &default, &recovered(0.1), [1.2e-5, 0.1], |_, _, _| ());
    beside::<0>("lost_samples", nominal, &default, &early, bars, |k, sample, _| {
        let lost = [(300..320).contains(&k), (500..505).contains(&k)];
        sample.counts = core::array::from_fn(|i| sample.counts[i].filter(|_| !lost[i]));
    });
    let firmer = JointBandwidths {
        surface_rad_s: 25.0,
        link_rad_s: 100.0,
        motor_rad_s: 600.0,
        reaching_per_s: 150.0,
        ..default.bandwidths
    };
    let firmer = JointDesign { bandwidths: firmer, ..default };
    let firmer = JointDrive::<f64, Position, 1>::try_design(&firmer).expect("a good design");
    beside::<0>("retune", nominal, &default, &early, bars, |k, sample, running| {
        if k == 500 {
            running.retune(firmer, sample).expect("designs that can take over");
        }
    });
}

/// A change of bandwidths, model and period of a joint in motion. u continues, and the error stays small.
#[test]
fn a_re_tune_in_motion_does_not_move_u() {
    let mut rng = Rng::new(0x2E70);
    let (mut jump, mut error) = (0.0_f64, 0.0_f64);
    let plan = blended_sine(0.5, 1.0, 0.5);
    for case in 0..26 {
        // The last two cases change the period alone.
        let (old_s, new_s) = match case {
            25 => (5e-4, 1e-3),
            _ if case % 4 == 3 || case == 24 => (1e-3, 5e-4),
            _ => (1e-3, 1e-3),
        };
        let mut vary = |value: f64, low: f64, high: f64| value * rng.within(low, high);
        let w_c = vary(20.0, 0.7, 1.3);
        let bandwidths = JointBandwidths {
            surface_rad_s: w_c,
            link_rad_s: w_c * vary(4.0, 0.9, 1.3),
            motor_rad_s: vary(600.0, 0.9, 1.2),
            reaching_per_s: w_c * vary(5.0, 0.8, 1.2),
            offset_per_s: 0.5 * w_c,
        };
        let mut other = design(new_s, 20, if case < 24 { bandwidths } else { DEFAULT });
        if case % 2 == 0 && case < 24 {
            other.joint.link_inertia_kg_m2 *= vary(1.0, 0.9, 1.1);
            other.joint.stiffness_n_m *= vary(1.0, 0.9, 1.1);
            other.joint.motor_inertia_kg_m2 *= vary(1.0, 0.9, 1.1);
            other.joint.torque_n_m_per_a *= vary(1.0, 0.9, 1.1);
        }
        let laws = [design(old_s, 20, DEFAULT), other]
            .map(|design| JointDrive::<f32, Position, 1>::try_design(&design).expect("a good design"));
        let (mut running, mut plant, mut t, mut period_s) = (Running::new(laws[0]), Flexible::NOMINAL, 0.0, old_s);
        let (swap, mut last) = (700 + 13 * case, 0.0);
        for k in 0..2500 {
            let target = |t: f64| Target { turn: 0, jet: plan(t).map(|r| r as f32) };
            let unit = std::f64::consts::TAU / f64::from(1 << 20);
            let counts =
                [plant.x[0], plant.x[2] / Flexible::K_1].map(|angle| Some((angle / unit + 0.5).floor() as i32));
            let mut sample = Sample { counts, begin: target(t), end: target(t + period_s) };
            if k == swap {
                sample.end = target(t + new_s);
                running.retune(laws[1], &sample).expect("designs that can take over");
                period_s = new_s;
                jump = jump.max((f64::from(running.clone().tick_at_once(&sample).u) - last).abs());
            }
            last = f64::from(running.tick_at_once(&sample).u);
            if k > swap {
                error = error.max((plant.x[0] - plan(t)[0]).abs());
            }
            plant.advance(t, last, period_s);
            t += period_s;
        }
    }
    println!("u moves by {jump:.1e} A, y stays within {error:.1e} rad");
    // The noise of u at that moment goes into W: 0.01 A is 5e-5 rad at 14 rad/s.
    assert!(jump <= 0.05 && error <= 5e-5, "{jump} A, {error:e} rad");
}

/// The period is halved in the middle of a fast move. The old controller gets the reference at the new pace, so the
/// feed-forward of the longer tick is not mistaken for the shorter one.
#[test]
fn a_change_of_the_period_on_a_fast_move_does_not_move_u() {
    let plan = point_to_point::<4>(1.0, 0.1, 0.8, 9);
    let laws = [1e-3, 5e-4]
        .map(|period_s| JointDrive::<f32>::try_design(&design(period_s, 24, DEFAULT)).expect("a good design"));
    let unit = std::f64::consts::TAU / f64::from(1 << 24);
    let mut worst = 0.0_f64;
    for swap in [250, 300, 420, 700] {
        let (mut running, mut plant, mut t, mut period_s) = (Running::new(laws[0]), Flexible::NOMINAL, 0.0, 1e-3);
        let mut u = [0.0; 3];
        for k in 0..=swap {
            let counts =
                [plant.x[0], plant.x[2] / Flexible::K_1].map(|angle| Some((angle / unit + 0.5).floor() as i32));
            let target = |t: f64| Target { turn: 0, jet: plan(t).map(|r| r as f32) };
            if k == swap {
                period_s = 5e-4;
            }
            let sample = Sample { counts, begin: target(t), end: target(t + period_s) };
            if k == swap {
                running.retune(laws[1], &sample).expect("designs that can take over");
            }
            u = [u[1], u[2], f64::from(running.tick_at_once(&sample).u)];
            plant.advance(t, u[2], period_s);
            t += period_s;
        }
        // Distance of u from the line through the last two values.
        worst = worst.max((u[2] - 2.0 * u[1] + u[0]).abs());
    }
    println!("u bends by {worst:.1e} A at the swap");
    assert!(worst <= 0.02, "{worst} A");
}
