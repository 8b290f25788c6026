//! `host-sim design`: its values against closed forms and simulated runs, and its output.
//!
//! The simulated runs do not use matrices. They use the loop of [`loop_sim::closed_loop`] with an impulse at the plant
//! input, with additional delay, and with coarse encoders.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

use host_sim::cli::{Console, status};
use loop_sim::closed_loop::{Loop as Setup, close_loop};
use loop_sim::linear::{LawAtRest, LinearPlant, LinearTick, Ticked};
use loop_sim::plant::{Chain, LastChannel, Plant};
use loop_sim::signal::Signal;
use loop_sim::trace::Row;
use nalgebra::{Complex, DMatrix, DVector, Normed};
use scenario::{AtRest, Experiment, Sensed, Source};
use study::margins::{Loop, Margins};

fn experiment(text: &str, sets: &[&str]) -> Experiment {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    scenario::parse(&Source { file: "test.toml", text, sets: &sets }, "test").unwrap_or_else(|error| panic!("{error}"))
}

fn at_rest(experiment: &Experiment) -> &AtRest {
    experiment.at_rest.as_ref().unwrap_or_else(|error| panic!("{error}"))
}

fn loop_of(experiment: &Experiment) -> Loop {
    let at_rest = at_rest(experiment);
    Loop::of(at_rest, at_rest.law.as_ref(), experiment.period_s).expect("a loop")
}

/// Control law u = -k . x.
struct Feedback<const N: usize>([f64; N]);

impl<const N: usize> LawAtRest for Feedback<N> {
    fn steps(&self) -> Vec<f64> {
        vec![0.0; N]
    }
    fn rest(&self) -> (Vec<f64>, f64) {
        (Vec::new(), 0.0)
    }
    fn tick(&self, _: &[f64], sample: &[f64], _: Option<f64>) -> Ticked {
        let u = -self.0.iter().zip(sample).map(|(k, x)| k * x).sum::<f64>();
        Ticked { u, ..Ticked::default() }
    }
}

fn by_hand<const N: usize>(a: [f64; N], k: [f64; N], delay_ticks: usize) -> AtRest {
    let channel = LastChannel { a: a.to_vec(), b: 1.0 };
    let plant = Chain::new(channel.clone(), channel, vec![Signal::default(); N]).expect("a chain");
    AtRest {
        loaded_inertia_kg_m2: None,
        corners: Vec::new(),
        inertia_range: None,
        plant: Box::new(plant),
        law: Box::new(Feedback(k)),
        sensed: (0..N)
            .map(|state| Sensed { state, name: String::new(), unit: "", rms: 0.0, noise: 0.0, quantum: 0.0 })
            .collect(),
        sensor_delay_ticks: 0,
        actuator_delay_ticks: delay_ticks,
        report: true,
        left_out: Vec::new(),
    }
}

/// Double integrator with a hold of T and u = -k_1 x_1 - k_2 x_2. The textbook gives
/// L = [(k_1 T/2 + k_2) z + k_1 T/2 - k_2] T/(z - 1)².
#[test]
fn margins_of_the_textbook_s_loop_are_those_of_its_transfer_function() {
    let (t, [k_1, k_2]) = (0.01, [400.0, 30.0]);
    let setup = by_hand([0.0, 0.0], [k_1, k_2], 0);
    let it = Loop::of(&setup, setup.law.as_ref(), t).expect("a loop");
    let l = |omega: f64| {
        let z = Complex::new((omega * t).cos(), (omega * t).sin());
        ((z * (k_1 * t / 2.0 + k_2)) + (k_1 * t / 2.0 - k_2)) * t / ((z - 1.0) * (z - 1.0))
    };
    for omega in [0.01, 1.0, 30.0, 100.0, 314.0] {
        assert!(((it.gain(omega) / l(omega)).re - 1.0).abs() < 1e-7, "{omega}: {} {}", it.gain(omega), l(omega));
    }
    let margins = it.margins().expect("margins");
    let crossover = margins.crossover_rad_s.expect("|L| is large at low frequencies");
    let at = l(crossover);
    assert!((at.re.hypot(at.im) - 1.0).abs() < 1e-7, "{margins:?}");
    let phase = (-at.im).atan2(-at.re);
    assert!((margins.phase_deg.expect("one") - phase.to_degrees()).abs() < 1e-5, "{margins:?}");
    assert!((margins.delay_s.expect("one") * crossover / phase - 1.0).abs() < 1e-7, "{margins:?}");
    // L is real and negative only at the Nyquist rate, where L = -k_2 T/2.
    assert!((margins.gain_up.expect("one") * k_2 * t / 2.0 - 1.0).abs() < 1e-9, "{margins:?}");
    assert!(margins.gain_down < 1e-6, "{margins:?}");
    let worst = (1..=20_000).map(|k| l(PI / t * f64::from(k) / 20_000.0) + 1.0).map(|d| 1.0 / d.re.hypot(d.im));
    assert!((margins.sensitivity_peak / worst.fold(0.0, f64::max) - 1.0).abs() < 1e-6, "{margins:?}");
}

/// Returns L without the matrix of the closed loop: plant and control law are solved separately at this frequency.
fn gain_by_parts(at_rest: &AtRest, period_s: f64, omega: f64) -> Complex<f64> {
    let law = LinearTick::of(at_rest.law.as_ref(), at_rest.report);
    let plant = LinearPlant::of(at_rest.plant.as_ref(), law.u, period_s).expect("a plant");
    let z = Complex::new((omega * period_s).cos(), (omega * period_s).sin());
    let later = |ticks: usize| z.powi(-(ticks as i32));
    let solved = |n: usize, entry: &dyn Fn(usize, usize) -> Complex<f64>, right: DVector<Complex<f64>>| {
        let matrix = DMatrix::from_fn(n, n, |i, j| if i == j { z - entry(i, j) } else { -entry(i, j) });
        matrix.lu().solve(&right).expect("no pole there")
    };
    let (n, order) = (plant.gamma.len(), law.c.len());
    let gamma = DVector::from_fn(n, |i, _| plant.gamma[i].into());
    let x = solved(n, &|i, j| plant.phi[i][j].into(), gamma);
    let y: Vec<_> = at_rest.sensed.iter().map(|sensed| x[sensed.state] * later(at_rest.sensor_delay_ticks)).collect();
    let of_sample = |row: &[f64]| row.iter().zip(&y).map(|(b, y)| y * *b).sum::<Complex<f64>>();
    // The law gets the held control: its own command, delayed.
    let held = later(at_rest.actuator_delay_ticks);
    let right = DVector::from_fn(order, |i, _| of_sample(&law.b[i]) + of_sample(&law.d) * held * law.e[i]);
    let s = solved(order, &|i, j| held * (law.e[i] * law.c[j]) + law.a[i][j], right);
    let asked = law.c.iter().zip(s.iter()).map(|(c, s)| s * *c).sum::<Complex<f64>>() + of_sample(&law.d);
    -asked * held
}

/// Random motors and joints, with current loops from ten times slower to ten thousand times faster than the tick. L
/// equals the L of the parts, the peak of S is a maximum, and at a gain margin a pole crosses the unit circle.
#[test]
fn margins_of_any_current_loop_are_those_of_its_parts() {
    let mut seed = 7_u64;
    let mut between = |low: f64, high: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    let (plants, mut judged, mut narrowest) = (if deep() { 1000 } else { 120 }, 0, f64::INFINITY);
    for k in 0..plants {
        let is_motor = k % 2 == 0;
        let period = 10_f64.powf(between(-4.0, -2.7));
        let lag = period / 10_f64.powf(between(-1.0, 4.0));
        let mut sets = vec![format!("drive.period_s={period:e}")];
        let scaled = |value: f64, by: f64| value * 10_f64.powf(by);
        if is_motor {
            sets.push(format!("motor.current_lag_s={lag:e}"));
            sets.push(format!("motor.inertia_kg_m2={:e}", scaled(2e-4, between(-1.0, 1.0))));
            sets.push(format!("encoder.bits={}", between(12.0, 21.0).floor()));
        } else {
            sets.push(format!("joint.current_lag_s={lag:e}"));
            sets.push(format!("joint.motor_inertia_kg_m2={:e}", scaled(9.31e-4, between(-0.5, 0.5))));
        }
        let text = if is_motor { scenario::MOTOR } else { scenario::JOINT };
        let Ok(it) = scenario::parse(&Source { file: "test.toml", text, sets: &sets }, "test") else { continue };
        let (at_rest, closed) = (at_rest(&it), loop_of(&it));
        if closed.spectral_radius(1.0).expect("poles") >= 1.0 {
            continue;
        }
        judged += 1;
        let what = format!("{} {sets:?}", if is_motor { "motor" } else { "joint" });
        let found = closed.margins().unwrap_or_else(|error| panic!("{what}: {error}"));
        let nyquist = PI / it.period_s;
        let sensitivity = |omega: f64| 1.0 / (gain_by_parts(at_rest, it.period_s, omega) + 1.0).norm();
        for share in [1e-4, 1e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.7, 0.95] {
            let omega = share * nyquist;
            let (l, parts) = (closed.gain(omega), gain_by_parts(at_rest, it.period_s, omega));
            // For large |L| both have few digits, and no margin depends on them.
            let apart = (l - parts) / ((l + 1.0) * (parts + 1.0));
            assert!(apart.norm() < 1e-6, "{what}: L at {omega} is {l}, of its parts {parts}");
            assert!(sensitivity(omega) < found.sensitivity_peak * (1.0 + 1e-6), "{what}: {found:?} at {omega}");
        }
        let peak = sensitivity(found.peak_rad_s);
        assert!((found.sensitivity_peak / peak - 1.0).abs() < 1e-5 && peak > 1.0, "{what}: {found:?} {peak}");
        let radius = |factor: f64| closed.spectral_radius(factor).expect("poles");
        let up = found.gain_up.unwrap_or_else(|| panic!("{what}: {found:?}"));
        assert!(radius(0.999 * up) < 1.0 && radius(1.001 * up) > 1.0, "{what}: {found:?}");
        if found.gain_down > 1e-3 {
            assert!(
                radius(1.001 * found.gain_down) < 1.0 && radius(0.999 * found.gain_down) > 1.0,
                "{what}: {found:?}"
            );
        }
        narrowest = narrowest.min(up);
    }
    assert!(judged * 4 > plants * 3, "{judged} of {plants} are stable");
    println!("{judged} of {plants}, least gain margin {narrowest:.3}");
}

fn deep() -> bool {
    std::env::var_os("DEEP").is_some_and(|value| value == "1")
}

/// x' = u held with u = -k x gives x⁺ = (1 - k T) x. White noise of rms 1 makes u an autoregression with variance
/// k² (1 + k T/(2 - k T)).
#[test]
fn noise_of_an_autoregression_is_its_closed_form() {
    let (t, k) = (1e-3, 700.0);
    // x_2' = u is the second channel; x_1 is not fed back and does not contribute to u.
    let setup = by_hand([0.0, 0.0], [0.0, k], 0);
    let it = Loop::of(&setup, setup.law.as_ref(), t).expect("a loop");
    let values = it.eigenvalues().expect("values");
    assert_eq!(values.len(), 1, "{values:?}");
    assert!((values[0].re - (1.0 - k * t)).abs() < 1e-10);
    let gains = it.noise_gains();
    let expected = k * (1.0 + k * t / (2.0 - k * t)).sqrt();
    assert!((gains[1] / expected - 1.0).abs() < 1e-9 && gains[0] == 0.0, "{gains:?} {expected}");
}

/// Checks that these are among the eigenvalues, with their multiplicity.
fn assert_has(it: &Loop, expected: &[(f64, f64)], within: f64) {
    let mut found = it.eigenvalues().expect("values");
    for &(re, im) in expected {
        let away = |z: &Complex<f64>| (z.re - re).hypot(z.im - im);
        let nearest = (0..found.len()).min_by(|&i, &j| away(&found[i]).total_cmp(&away(&found[j]))).expect("one");
        assert!(away(&found[nearest]) < within, "{re} + {im} i is not among {found:?}");
        found.remove(nearest);
    }
}

/// Returns e^(pole T).
fn discrete(re: f64, im: f64, t: f64) -> (f64, f64) {
    ((re * t).exp() * (im * t).cos(), (re * t).exp() * (im * t).sin())
}

const RIGID: &str = "[motor]\ninertia_kg_m2 = 2e-4\ntorque_n_m_per_a = 0.05\nmax_current_a = 10.0\n\
                     [encoder]\nbits = 14\n";

/// Without a lag and with true parameters, the loop of a motor has its observer poles where Ackermann's formula places
/// them. σ* decays by 1 - k_l T per tick and W by e^(-αT); the last pole is the sliding motion.
#[test]
fn the_loop_of_an_exact_motor_has_the_poles_that_were_asked_for() {
    for (bits, period_s, surface) in [(14, 1e-3, 60.0_f64), (16, 1e-4, 200.0), (12, 5e-4, 30.0)] {
        let sets = [
            "motor.current_lag_s=0".to_owned(),
            format!("encoder.bits={bits}"),
            format!("drive.period_s={period_s}"),
            format!("drive.surface_rad_s={surface}"),
        ];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let it = loop_of(&experiment(RIGID, &sets));
        let w_o = 1.5 * surface;
        let mut expected: Vec<(f64, f64)> = [(-0.7456, 0.7114), (-0.7456, -0.7114), (-0.9416, 0.0)]
            .map(|(re, im)| discrete(re * w_o, im * w_o, period_s))
            .into();
        expected.push((1.0 - 8.0 * surface * period_s, 0.0));
        expected.push(((-0.5 * surface * period_s).exp(), 0.0));
        assert_has(&it, &expected, 1e-9);
        let others = it.eigenvalues().expect("values").len() - expected.len();
        // Poles of stored values are 0; the sliding motion is e^(-w_c T) to first order.
        let sliding = it
            .eigenvalues()
            .expect("values")
            .iter()
            .any(|z| (z.re + surface * period_s - 1.0).abs() < 0.6 * (surface * period_s).powi(2));
        assert!(others >= 1 && sliding, "{:?}", it.eigenvalues());
    }
}

/// Chain in the form of the paper with an exact model: the observer poles lie at e^(pole T) for any n and r.
#[test]
fn the_loop_of_an_exact_chain_has_the_poles_that_were_asked_for() {
    for (n, r) in [(2, 1), (2, 3), (3, 2), (4, 2), (4, 3), (5, 3), (6, 2), (6, 3)] {
        let zeros = vec!["0.0"; n].join(", ");
        let text = format!(
            "[plant]\nkind = \"chain\"\norder = {n}\na = [{zeros}]\nb = 2.0\n[controller]\nalpha_per_s = 3.0\n\
             k_l = 30.0\nsurface_bandwidth_rad_s = 8.0\n\
             [[controller.observer]]\nchannel = {n}\nbandwidth_rad_s = 40.0\norder = {r}\n"
        );
        let it = loop_of(&experiment(&text, &[]));
        let mut expected = vec![discrete(-40.0, 0.0, 1e-3); r];
        expected.extend([(1.0 - 30.0 * 1e-3, 0.0), discrete(-3.0, 0.0, 1e-3)]);
        // Equal poles separate by the root of this order of the rounding error.
        assert_has(&it, &expected, if n <= 4 { 3e-4 } else { 3e-3 });
        let values = it.eigenvalues().expect("values");
        let product = |away: fn(f64) -> bool| values.iter().filter(|z| away(z.norm_sqr())).count();
        // n - 1 poles of the sliding motion; all others are 0.
        assert_eq!(product(|size| size > 1e-4), r + 2 + n - 1, "n = {n}, r = {r}: {values:?}");
    }
}

/// Plant with an additional input impulse in one tick.
struct Struck<'a> {
    plant: &'a dyn Plant,
    within_s: [f64; 2],
    size: f64,
}

impl Plant for Struck<'_> {
    fn order(&self) -> usize {
        self.plant.order()
    }
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        let strikes = (self.within_s[0]..self.within_s[1]).contains(&t_s);
        self.plant.rhs(t_s, x, if strikes { u + self.size } else { u }, dx);
    }
    fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
        self.plant.lumped(t_s, x, u, d);
    }
    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.plant.fastest_rad_s(t_s, x, u)
    }
    fn jumps_s(&self) -> &[f64] {
        &self.within_s
    }
}

/// Returns u held and y of every tick after an impulse at the plant input, as half the difference of two runs.
fn answer(text: &str, sets: &[&str], ticks: usize) -> Vec<[f64; 2]> {
    const BEFORE: usize = 60;
    const SIZE: f64 = 1e-3;
    let struck = |size: f64| {
        let mut it = experiment(text, sets);
        it.periods = BEFORE + ticks;
        let period_s = it.period_s;
        let Setup { plant, sensor, port, actuator, report, missed, x0, periods, .. } = it.setup();
        let within_s = [BEFORE, BEFORE + 1].map(|k| k as f64 * period_s);
        let plant = Struck { plant, within_s, size };
        let mut rows = Vec::new();
        let mut taken = |row: &Row| {
            rows.push([row.u_held, row.x[0]]);
            ControlFlow::Continue(())
        };
        let setup = Setup { plant: &plant, sensor, port, actuator, report, missed, x0, period_s, periods };
        close_loop(setup, &mut taken).expect("a run");
        rows.split_off(BEFORE)
    };
    let [up, down] = [struck(SIZE), struck(-SIZE)];
    up.iter().zip(&down).map(|(up, down)| [0, 1].map(|j| (up[j] - down[j]) / (2.0 * SIZE))).collect()
}

/// Settings of a scenario at rest, in f64, without rounding.
const STILL: [&str; 2] = ["plant.x0=[0, 0, 0, 0]", "controller.precision=f64"];
const STILL_3: [&str; 2] = ["plant.x0=[0, 0, 0]", "controller.precision=f64"];

/// The impulse response of the simulated loop gives S: the transform of v = u + w is 1/(1 + L). Sensor and actuator
/// have delays, reported or not.
#[test]
fn the_loop_gain_is_that_of_the_simulated_loop() {
    let delays = ["sensor.delay_ticks=2", "actuator.delay_ticks=3"];
    let untold = ["actuator.report=false", "actuator.delay_ticks=1"];
    let slow = ["controller.k_l=20"];
    for (text, still, sets) in [
        (scenario::DEFAULT, &STILL, &slow[..0]),
        (scenario::DEFAULT, &STILL, &untold[..]),
        (scenario::CHAIN, &STILL_3, &slow[..]),
        (scenario::CHAIN, &STILL_3, &delays[..]),
    ] {
        let sets = [&still[..], sets].concat();
        let it = experiment(text, &sets);
        let (matrices, period_s) = (loop_of(&it), it.period_s);
        let mut felt = answer(text, &sets, 60_000);
        felt[0][0] += 1.0;
        for omega in [3.0, 20.0, 60.0, 200.0, 1500.0, PI / period_s] {
            let (mut re, mut im) = (0.0, 0.0);
            for (k, [v, _]) in felt.iter().enumerate() {
                let phase = omega * period_s * k as f64;
                (re, im) = (re + v * phase.cos(), im - v * phase.sin());
            }
            let s = matrices.gain(omega) + 1.0;
            // S (1 + L) = 1 within 1e-6, the accuracy of the runs.
            let one = Complex::new(re, im) * s;
            assert!((one.re - 1.0).abs() < 2e-5 && one.im.abs() < 2e-5, "{sets:?}, {omega} rad/s: {one}");
        }
    }
}

/// After a long time y decays with the slowest pole. This pole is single: e^(-t) of a surface with another pole at -6.
#[test]
fn the_decay_is_that_of_the_simulated_loop() {
    let text = scenario::CHAIN.replace("surface_bandwidth_rad_s = 4.0", "c = [6.0, 7.0, 1.0]\nalpha_per_s = 20.0");
    let it = loop_of(&experiment(&text, &STILL_3));
    let slowest = it.eigenvalues().expect("values").into_iter().map(|z| -it.pole(z).re).fold(f64::INFINITY, f64::min);
    let span_s = 8.0 / slowest;
    let y = answer(&text, &STILL_3, (span_s / 1e-3) as usize);
    let size = |from: f64, to: f64| {
        let [from, to] = [from, to].map(|share| (share * y.len() as f64) as usize);
        y[from..to].iter().fold(0.0_f64, |peak, [_, y]| peak.max(y.abs()))
    };
    // From the peak of one window to the peak of the next one, 2/slowest later.
    let found = (size(0.5, 0.75) / size(0.75, 1.0)).ln() / (0.25 * span_s);
    assert!((found / slowest - 1.0).abs() < 0.02, "{found} in the run, {slowest} of the matrices");
}

/// A run with a delay of whole ticks below the margin settles, and diverges with a delay above it. The gain margins are
/// checked with b on both sides.
#[test]
fn the_margins_are_where_simulated_loops_become_unstable() {
    // The law does not get the delay: it uses its own u. Without limits of u an unstable loop diverges.
    const SETS: [&str; 2] = ["actuator.report=false", "controller.limits={min=-1e12, max=1e12}"];
    let of = |sets: &[&str]| loop_of(&experiment(scenario::CHAIN, &[&SETS[..], sets].concat()));
    let margins = of(&[]).margins().expect("a stable loop");
    let Margins { delay_s: Some(delay_s), gain_up: Some(gain_up), .. } = margins else { panic!("{margins:?}") };
    let ticks = (delay_s / 1e-3).floor();
    assert!((3.0..40.0).contains(&ticks), "{margins:?}");
    let ends_at = |sets: &[&str]| {
        let quiet = ["span_s=60", "plant.x0=[1e-3, 0, 0]", "plant.disturbance=[]", "controller.precision=f64"];
        let mut it = experiment(scenario::CHAIN, &[&SETS[..], sets, &quiet].concat());
        let (trace, error) = it.run(&mut |_| ControlFlow::Continue(()));
        assert_eq!(error, None);
        trace.rows.iter().rev().take(5000).map(|row| row.x[0].abs()).fold(0.0, f64::max)
    };
    for (delay, is_stable) in [(ticks, true), (ticks + 1.0, false)] {
        let delay = format!("actuator.delay_ticks={delay}");
        let radius = of(&[&delay]).spectral_radius(1.0).expect("a radius");
        assert_eq!(radius < 1.0, is_stable, "{delay}: {radius}, margin {delay_s} s");
        let end = ends_at(&[&delay]);
        assert_eq!(end < 1e-3, is_stable, "{delay}: {end}");
    }
    for (share, is_stable) in [(0.97, true), (1.03, false)] {
        // b of the plant is 2, the model of the controller has 1.5.
        let b = format!("plant.b={}", 2.0 * share * gain_up);
        let end = ends_at(&[&b]);
        assert_eq!(end < 1e-3, is_stable, "{b}: {end}, factor {gain_up}");
        assert_eq!(of(&[]).spectral_radius(share * gain_up).expect("a radius") < 1.0, is_stable);
    }
}

/// Returns u of every tick of a run without friction, with one gain set.
fn current(text: &str, sets: &[&str]) -> (Experiment, Vec<f64>) {
    let smooth = ["drive.uncertain_percent=50", "friction.coulomb_n_m=0", "friction.static_n_m=0"];
    let mut it = experiment(text, &[sets, &smooth].concat());
    let (trace, error) = it.run(&mut |_| ControlFlow::Continue(()));
    assert_eq!(error, None);
    (it, trace.rows.iter().map(|row| row.u).collect())
}

/// Compares the noise of u from quantisation with two runs that differ in the encoder bits only. Quantisation noise is
/// white as long as the shaft passes many counts per tick.
#[test]
fn noise_of_u_is_the_difference_of_runs_with_coarse_and_with_fine_encoders() {
    let joint = scenario::JOINT.replace("to_rad = 1.0 ", "# to_rad = 1.0 ");
    let sine = ["reference.amplitude_rad=2.0", "reference.frequency_hz=2.3", "drive.surface_rad_s=120"];
    let swing = ["reference.kind=\"sine\"", "reference.amplitude_rad=0.8", "reference.frequency_hz=0.3"];
    for (text, sets, coarse, fine) in [
        (scenario::MOTOR, [&sine[..], &[]].concat(), &["encoder.bits=14"][..], &["encoder.bits=24"][..]),
        (scenario::MOTOR, [&sine[..], &["drive.period_s=2e-4"]].concat(), &["encoder.bits=16"], &["encoder.bits=24"]),
        (scenario::MOTOR, [&sine[..], &["drive.delay_ticks=1"]].concat(), &["encoder.bits=14"], &["encoder.bits=24"]),
        (
            &joint,
            [&swing[..], &["drive.tuning=\"normal\""]].concat(),
            &["encoder.link.bits=17", "encoder.motor.bits=17"],
            &["encoder.link.bits=24", "encoder.motor.bits=24"],
        ),
    ] {
        let (it, noisy) = current(text, &[&sets[..], coarse].concat());
        let (_, exact) = current(text, &[&sets[..], fine].concat());
        let from = (it.window_s[0] / it.period_s) as usize + 200;
        let squares = noisy.iter().zip(&exact).skip(from).map(|(noisy, exact)| (noisy - exact).powi(2));
        let found = (squares.sum::<f64>() / (noisy.len() - from) as f64).sqrt();
        let parts = loop_of(&it).noise_gains().into_iter().zip(&at_rest(&it).sensed);
        let expected = parts.map(|(gain, sensed)| (gain * sensed.rms).powi(2)).sum::<f64>().sqrt();
        // Thousands of ticks of a noise with a memory of about ten ticks give its rms to a few percent.
        assert!((found / expected - 1.0).abs() < 0.15, "{sets:?}: {found} A in the runs, {expected} A of the matrices");
    }
}

/// `run` prints another noise: the noise of the law alone, for coarse and fine counts of one motion. Without the
/// feedback through the plant it follows from the matrices.
#[test]
fn noise_of_the_law_alone_is_that_of_a_recorded_run() {
    let sets = ["reference.amplitude_rad=2.0", "reference.frequency_hz=2.3", "encoder.bits=14"];
    let smooth = ["drive.uncertain_percent=50", "friction.coulomb_n_m=0", "friction.static_n_m=0"];
    let mut it = experiment(scenario::MOTOR, &[&sets[..], &smooth].concat());
    let law = LinearTick::of(at_rest(&it).law.as_ref(), true);
    let dot = |row: &[f64], x: &[f64]| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
    // u after one impulse on the count; the held control is equal for both.
    let (mut memory, mut power) = (law.b.iter().map(|row| row[0]).collect::<Vec<f64>>(), law.d[0] * law.d[0]);
    for _ in 0..2000 {
        power += dot(&law.c, &memory).powi(2);
        memory = law.a.iter().map(|row| dot(row, &memory)).collect();
    }
    let expected = power.sqrt() * at_rest(&it).sensed[0].rms;
    let (trace, error) = it.run(&mut |_| ControlFlow::Continue(()));
    assert_eq!(error, None);
    let found = it.noise(&trace).expect("there is room for finer encoders").moving;
    assert!((found / expected - 1.0).abs() < 0.15, "{found} A in the run, {expected} A of the matrices");
}

/// A valve that only opens rests at its limit; this limit is not part of the linearised loop.
#[test]
fn a_limit_at_rest_changes_no_margin() {
    let margins = |sets: &[&str]| loop_of(&experiment(scenario::CHAIN, sets)).margins().expect("a stable loop");
    assert_eq!(margins(&["controller.limits={min=0.0, max=50.0}"]), margins(&[]));
}

/// A speed loop does not control the angle, so the angle is not a pole.
#[test]
fn a_speed_loop_is_stable_without_its_angle() {
    let it =
        loop_of(&experiment(RIGID, &["drive.mode=\"speed\"", "reference.kind=\"speed\"", "reference.speed_rad_s=20"]));
    assert!(it.spectral_radius(1.0).expect("a radius") < 0.99);
    assert!(it.margins().expect("margins").phase_deg.is_some_and(|phase| phase > 30.0));
}

/// Returns exit status, stdout and stderr.
fn spoken(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let stop = AtomicBool::new(false);
    let console = Console { out: &mut out, err: &mut err, stop: &stop, terminal: false };
    let status = host_sim::cli::run(["host-sim"].iter().chain(args).map(std::ffi::OsString::from), console);
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (status, text(out), text(err))
}

/// Folder of one test, removed at its end.
struct Folder(std::path::PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("host-sim-design-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("temporary folder");
        Self(path)
    }

    fn file(&self, name: &str, text: &str) -> String {
        std::fs::write(self.0.join(name), text).expect("temporary file");
        self.0.join(name).display().to_string()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn every_kind_of_file_has_a_design() {
    let folder = Folder::new("kinds");
    let [paper, motor, joint, chain, own] =
        scenario::STARTS.map(|(plant, text)| folder.file(&format!("{plant}.toml"), text));
    let benchmark = folder.file("benchmark.toml", include_str!("../scenarios/fig01.toml"));
    let speed = ["drive.mode=\"speed\"", "reference.kind=\"speed\"", "reference.speed_rad_s=20"];
    let third =
        "controller.observer=[{channel=2, order=3, bandwidth_rad_s=20.0}, {channel=4, order=3, bandwidth_rad_s=20.0}]";
    let said = |file: &String| if [&paper, &benchmark].contains(&file) { &["--no-limits"][..] } else { &[] };
    for (file, sets) in [
        (&motor, &[][..]),
        (&motor, &["drive.uncertain_percent=50", "drive.delay_ticks=1", "motor.gear=[50, 1]"]),
        (&motor, &["drive.observer_states=4", "encoder.bits=20", "drive.period_s=1e-4"]),
        (&joint, &[]),
        (&joint, &["drive.delay_ticks=1", "encoder.link.bits=12", "encoder.motor.bits=12"]),
        (
            &joint,
            &[
                "drive.period_s=2e-3",
                "joint.gear=[50, 1]",
                "encoder.motor={bits=20, counts_per_turn=16384, states=1048576}",
            ],
        ),
        (&chain, &["controller.k_s=0.5", "controller.limits={min=-3, max=3}", "controller.samples={max=[1, 1, 1]}"]),
        (&chain, &["sensor.noise=[1e-4, 0, 0]", "sensor.delay_ticks=3", "sensor.jitter=0.5", "actuator.rate_per_s=10"]),
        (&own, &[]),
        (&paper, &["plant.reading=\"physical\""]),
        (&paper, &["plant.reading=\"stiff\"", third]),
        (&benchmark, &["controller.k_s=1"]),
    ] {
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let (code, out, err) = spoken(&[&["design", file], said(file), &sets[..]].concat());
        assert_eq!((code, err.as_str()), (status::DONE, ""), "{sets:?}: {out}");
        assert!(out.lines().count() <= 46, "{out}");
        for part in ["design: decay rate", "\ndecay rate", "phase margin", "sensitivity peak", "limiting factor: "] {
            assert!(out.contains(part), "{part} for {sets:?}: {out}");
        }
        assert!(out.contains("\nsuggested: ") || out.contains("\nno suggestion: "), "{sets:?}: {out}");
        assert!(!out.contains("NaN") && !out.contains("inf"), "{out}");
    }
    let sets: Vec<&str> = speed.iter().flat_map(|set| ["--set", set]).collect();
    let motor_text = scenario::MOTOR.replace("amplitude_rad = 1.0", "#").replace("frequency_hz = 1.0", "#");
    let motor = folder.file("speed.toml", &motor_text);
    let (code, out, err) = spoken(&[&["design", &motor], &sets[..]].concat());
    assert_eq!((code, err.as_str()), (status::DONE, ""), "{out}");
}

#[test]
fn what_has_no_poles_and_what_is_wrong_is_told_with_its_place() {
    let folder = Folder::new("refused");
    let chain = folder.file("mine.toml", scenario::CHAIN);
    for (set, expected) in [
        ("actuator.hold_ticks=4", "controller.period_s = 0.004"),
        ("sensor.delay_ticks=14", "a delay of up to 13 ticks"),
        ("actuator.delay_ticks=41", "a delay of up to 40 ticks"),
        ("controller.k_1=4", "did you mean `k_l`"),
    ] {
        let (code, out, err) = spoken(&["design", &chain, "--set", set]);
        assert_eq!((code, out.as_str()), (status::BAD_INPUT, ""), "{set}: {err}");
        assert!(err.contains(expected), "{set}: {err}");
    }
    let baseline = include_str!("../scenarios/fig01_baseline.toml");
    let (code, _, err) = spoken(&["design", &folder.file("baseline.toml", baseline)]);
    assert!(code == status::BAD_INPUT && err.contains("`controller.kind`: a switching law has no poles"), "{err}");
}

/// k_l = 10 with two weak springs and a strong motor is unstable.
#[test]
fn an_unstable_loop_is_a_result() {
    let sets = ["controller.k_l=10", "plant.error.k2_x1=-0.5", "plant.error.k2_x3=-0.5", "plant.error.b=0.5"];
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let (code, out, err) = spoken(&[&["design"], &sets[..]].concat());
    assert_eq!((code, err.as_str()), (status::DONE, ""));
    assert!(out.contains("an unstable loop has no margins") && !out.contains("phase margin  "), "{out}");
}

#[test]
fn json_has_the_figures_of_the_table() {
    let (code, out, _) = spoken(&["design", "--json"]);
    assert_eq!(code, status::DONE);
    let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    let phase = json["margins"]["phase_deg"].as_f64().expect("a phase");
    let (_, table, _) = spoken(&["design"]);
    let row = table.lines().find(|line| line.starts_with("phase margin")).expect("a row");
    assert!(row.contains(&study::number::significant(phase, 3)), "{row}: {phase}");
    assert_eq!(json["noise"].as_array().map(Vec::len), Some(4));
}

#[test]
fn a_run_ends_with_the_design_in_two_lines() {
    let folder = Folder::new("run");
    let (motor, to) = (folder.file("mine.toml", scenario::MOTOR), folder.0.join("o").display().to_string());
    let (code, out, _) = spoken(&["run", &motor, "--set", "span_s=0.5", "--out", &to]);
    assert_eq!(code, status::DONE);
    assert_eq!(out.lines().filter(|line| line.starts_with("stability (linearised at rest): ")).count(), 1, "{out}");
    assert_eq!(out.lines().filter(|line| line.starts_with("limiting factor: ")).count(), 1, "{out}");
    let baseline = folder.file("baseline.toml", include_str!("../scenarios/fig01_baseline.toml"));
    let (code, out, _) =
        spoken(&["run", &baseline, "--set", "span_s=0.5", "--set", "window_s=[0.1, 0.5]", "--no-files"]);
    assert!(code == status::DONE && !out.contains("stability (linearised"), "{out}");
}

/// The scenarios of two pages have the output of `design` below them; `GOLDEN=write` writes it again.
#[test]
fn the_pages_on_tuning_show_the_output_of_design() {
    let outputs = ["tuning.md", "evidence/tuning.md"].map(shown_on);
    // The first page explains every line of its table, by name.
    let page = std::fs::read_to_string(docs("tuning.md")).expect("the page").replace("\\|", "|");
    let lines = outputs[0].lines().skip(3).take_while(|line| !line.is_empty());
    for name in lines.filter_map(|line| line.split("  ").next()) {
        assert!(page.contains(&format!("`{name}`")), "docs/tuning.md does not explain {name:?}");
    }
}

fn docs(page: &str) -> String {
    format!("{}/../docs/{page}", env!("CARGO_MANIFEST_DIR"))
}

/// Checks the one output of `design` on a page and returns it.
fn shown_on(name: &str) -> String {
    let path = docs(name);
    let page = std::fs::read_to_string(&path).expect("the page");
    let folder = Folder::new("page");
    let (mut shown, mut rest, mut outputs) = (String::new(), page.as_str(), Vec::new());
    let mut scenario = None;
    while let Some((before, after)) = rest.split_once("```") {
        let (block, after) = after.split_once("\n```").expect("the end of a block");
        shown += before;
        if let Some(text) = block.strip_prefix("toml\n") {
            scenario = Some(text);
        }
        match block.strip_prefix("text\n$ host-sim design ").and_then(|block| block.split_once('\n')) {
            Some((name, _)) => {
                let file = folder.file(name, scenario.expect("a scenario above"));
                let (code, out, err) = spoken(&["design", &file]);
                assert_eq!((code, err.as_str()), (status::DONE, ""));
                shown.extend(["```text\n$ host-sim design ", name, "\n", out.trim_end(), "\n```"]);
                outputs.push(out);
            }
            None => shown.extend(["```", block, "\n```"]),
        }
        rest = after;
    }
    shown += rest;
    if std::env::var_os("GOLDEN").is_some() {
        std::fs::write(&path, &shown).expect("the page");
    } else if let Some((line, (found, now))) = page.lines().zip(shown.lines()).enumerate().find(|(_, (a, b))| a != b) {
        panic!("line {} of docs/{name} is {found:?}, now {now:?}: GOLDEN=write cargo test", line + 1);
    }
    assert_eq!(outputs.len(), 1, "docs/{name} has one output of design");
    outputs.remove(0)
}

/// Joint with a light motor, a large gear and a coarse encoder: at 1 kHz no set of bandwidths stabilises it.
const LIGHT: &str = "span_s = 0.5\n[joint]\nlink_inertia_kg_m2 = 0.0244\nmotor_inertia_kg_m2 = 1.27e-6\n\
    stiffness_n_m = 2854\ntorque_n_m_per_a = 0.0159\nmax_current_a = 2.111017\nweight_n_m = 0.0257\ngear = [100, 1]\n\
    [encoder.link]\nbits = 17\n[encoder.motor]\nbits = 12\n[drive]\nsudden_load_n_m = 0.336\ntuning = \"normal\"\n";

#[test]
fn a_loop_that_is_unstable_is_told_wherever_it_could_go_on() {
    let folder = Folder::new("unstable");
    let file = folder.file("light.toml", LIGHT);
    let (code, out, _) = spoken(&["run", "--no-files", &file]);
    assert!(code == status::DONE && out.contains("warning: UNSTABLE: the linearised loop has a spectral"), "{out}");
    assert!(out.contains("suggested: [drive] tuning = \"coupled\""), "{out}");
    let (_, out, _) = spoken(&["run", "--no-files", "--json", &file]);
    let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert!(json["warnings"].to_string().contains("UNSTABLE"), "{json}");
    let (code, _, err) = spoken(&["export", "--standalone", &file]);
    assert!(code == status::BAD_INPUT && err.contains("UNSTABLE"), "{err}");
    let (code, out, err) = spoken(&["export", "--standalone", &file, "--set", "drive.accept_unstable=true"]);
    assert!(code == status::DONE && err.contains("warning: UNSTABLE") && out.contains("UNSTABLE"), "{err}");
    let (_, out, _) = spoken(&["design", &file]);
    assert!(out.contains("\nUNSTABLE ") && !out.contains("noise, 0 % used"), "{out}");
    assert!(out.contains("[drive]\ntuning = \"coupled\""), "{out}");
    let (_, out, _) = spoken(&["design", "--json", &file]);
    assert!(!out.contains("-0.0"), "{out}");
    // The suggestion is stable.
    let (_, out, _) = spoken(&["run", "--no-files", &file, "--set", "drive.tuning=coupled"]);
    assert!(out.contains("stability (linearised at rest): phase") && !out.contains("warning: UNSTABLE"), "{out}");
}

/// Every corner of drive.uncertain_percent is the loop with another plant: with the plant of an unstable corner in the
/// file the loop is unstable, too.
#[test]
fn corners_are_loops_with_another_plant() {
    let folder = Folder::new("corners");
    let file = folder.file("light.toml", LIGHT);
    let sets = ["--set", "drive.period_s=5e-4", "--set", "drive.tuning=firm"];
    let (_, out, _) = spoken(&[&["design", "--json", &file][..], &sets].concat());
    let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    let unstable = json["unstable_corners"].as_array().expect("corners");
    assert!(json["corners"] == 16 && !unstable.is_empty() && json["margins"].is_object(), "{out}");
    let worst = &unstable[0];
    let keys = ["link_inertia_percent", "motor_inertia_percent", "stiffness_percent", "torque_percent"];
    let signs: Vec<&str> =
        worst["name"].as_str().expect("a name").split(", ").filter_map(|part| part.split(' ').nth(1)).collect();
    let error: Vec<String> = keys.iter().zip(signs).map(|(key, percent)| format!("{key} = {percent}")).collect();
    let error = format!("error={{{}}}", error.join(", "));
    let (_, out, _) = spoken(&[&["design", "--json", &file][..], &sets, &["--set", &error]].concat());
    let there: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(there["spectral_radius"], worst["spectral_radius"], "{error}");
    let (_, out, _) = spoken(&[&["run", "--no-files", &file][..], &sets].concat());
    assert!(out.contains("warning: unstable in ") && out.contains(worst["name"].as_str().expect("a name")), "{out}");
    // The corner with the least damping, in the file, has this pole; no other corner has less.
    let file = folder.file("soft.toml", scenario::JOINT);
    let pole = |error: &str| {
        let (_, out, _) = spoken(&["design", "--json", &file, "--set", error]);
        let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
        let poles = json["poles"].as_array().expect("poles").clone();
        let damping = |pole: &serde_json::Value| {
            let [re, im] = ["re", "im"].map(|part| pole[part].as_f64().expect("a number"));
            if im > 0.0 && re > -1000.0 { -re / re.hypot(im) } else { 1.0 }
        };
        (poles.iter().map(damping).fold(1.0, f64::min), json["least_damped"].clone())
    };
    let (_, least) = pole("error={}");
    let mut smallest = f64::INFINITY;
    for corner in 0..16 {
        let parts = (0..4).map(|k| format!("{} = {}", keys[k], if corner >> k & 1 == 0 { 20 } else { -20 }));
        smallest = smallest.min(pole(&format!("error={{{}}}", parts.collect::<Vec<_>>().join(", "))).0);
    }
    let said = least["damping_ratio"].as_f64().expect("a ratio");
    assert!((said / smallest - 1.0).abs() < 1e-6 && said < 0.05, "{said} {smallest}");
    // The templates are stable within their drive.uncertain_percent.
    for (name, text) in [("motor.toml", scenario::MOTOR), ("joint.toml", scenario::JOINT)] {
        let (_, out, _) = spoken(&["design", &folder.file(name, text)]);
        let sets = if name == "motor.toml" { " with the base gains" } else { "" };
        let expected = format!("corners of drive.uncertain_percent: all stable{sets}\nleast damping ratio 0.");
        assert!(out.contains(&expected), "{out}");
    }
}

/// The list of limits and the suggestion name one limiting factor, also for a speed loop.
#[test]
fn what_binds_stands_first_among_the_limits() {
    let folder = Folder::new("speed");
    let text = "[motor]\ninertia_kg_m2 = 3e-5\ntorque_n_m_per_a = 0.021\nmax_current_a = 60\n[encoder]\nbits = 12\n\
                [drive]\nperiod_s = 5e-5\nmode = \"speed\"\n[reference]\nkind = \"speed\"\nspeed_rad_s = 2500\n";
    let (_, out, _) = spoken(&["design", &folder.file("spindle.toml", text)]);
    let words = ["limiting factor: loop delay, 100 % used", "keep this design; loop delay ("];
    assert!(words.iter().all(|words| out.contains(words)), "{out}");
}

/// A tuning may be too fast for the loop; then `run` prints the suggestion of `design`.
#[test]
fn a_tuning_that_is_too_much_is_told_with_the_other() {
    let folder = Folder::new("tuning");
    let text = "[joint]\nlink_inertia_kg_m2 = 0.05\nmotor_inertia_kg_m2 = 4e-5\nstiffness_n_m = 120\n\
                torque_n_m_per_a = 0.04\nmax_current_a = 12\ngear = [50, 1]\nweight_n_m = 2\n[encoder.link]\n\
                bits = 17\n[encoder.motor]\nbits = 12\n[drive]\nsudden_load_n_m = 5\ntuning = \"normal\"\n";
    let file = folder.file("mine.toml", text);
    let (_, out, _) = spoken(&["run", "--no-files", &file]);
    assert!(out.contains("tuning \"normal\", set by the file"), "{out}");
    assert!(out.contains("suggested: [drive] tuning = \"quiet\": \"normal\" would cause 0.177 A of"), "{out}");
    let (_, out, _) = spoken(&["run", "--no-files", &file, "--set", "drive.tuning=quiet"]);
    assert!(!out.contains("suggested"), "{out}");
}

/// Without a finer encoder for comparison the noise is computed from the matrices.
#[test]
fn a_run_with_the_finest_encoder_tells_its_noise() {
    let folder = Folder::new("finest");
    let file = folder.file("motor.toml", scenario::MOTOR);
    let (_, out, _) = spoken(&["run", "--no-files", &file, "--set", "encoder.bits=24"]);
    assert!(out.contains("current noise (A rms) ") && out.contains("computed for the linearised loop"), "{out}");
}

/// The JSON contains the values of the table under descriptive names.
#[test]
fn the_json_of_a_drive_has_its_torques_and_units() {
    let folder = Folder::new("json");
    let file = folder.file("joint.toml", scenario::JOINT);
    let (_, out, _) = spoken(&["run", "--no-files", "--json", &file]);
    let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert!(json["metrics"]["error_ultimate"].is_f64() && json["metrics"]["y_ultimate"].is_null(), "{json}");
    let shafts: Vec<_> = json["torque_errors"].as_array().expect("torques").iter().map(|it| &it["shaft"]).collect();
    assert_eq!(shafts, ["link", "motor"]);
    let (_, table, _) = spoken(&["run", "--no-files", &file]);
    let told = study::number::significant(json["torque_errors"][0]["rms_n_m"].as_f64().expect("a number"), 3);
    assert!(
        table.lines().any(|line| line.starts_with("load estimate error, link") && line.contains(&told)),
        "{told}: {table}"
    );
    for error in json["metrics"]["estimation_error_ultimate"].as_array().expect("errors") {
        assert_eq!(error["unit"], "rad/s^2");
    }
}

/// A joint, found on a map of 2304 points, for whose matrix the eigenvalue iteration cycles. Its eigenvalues agree with
/// the eigenvalues of the neighbouring points.
#[test]
fn a_matrix_on_which_the_iteration_circles_has_its_eigenvalues_all_the_same() {
    let radius = |stiffness_percent: &str| {
        let sets = [format!("error.stiffness_percent={stiffness_percent}")];
        let source = Source { file: "arm.toml", text: ARM, sets: &sets };
        let experiment = scenario::parse(&source, "arm").expect("a joint");
        let at_rest = experiment.at_rest.as_ref().expect("at rest");
        let it = Loop::of(at_rest, at_rest.law.as_ref(), experiment.period_s).expect("a loop");
        it.eigenvalues().expect("eigenvalues").iter().map(|z| z.re.hypot(z.im)).fold(0.0, f64::max)
    };
    let [before, at, after] = ["8.9361", "8.9362", "8.93621"].map(radius);
    assert!((before - 0.996_703_14).abs() < 1e-7 && (at - before).abs() < 1e-6 && (after - at).abs() < 1e-6, "{at}");
}

const ARM: &str = r#"
span_s = 3.0
[joint]
link_inertia_kg_m2 = 0.5
motor_inertia_kg_m2 = 3e-05
stiffness_n_m = 400.0
torque_n_m_per_a = 0.05
max_current_a = 8.0
gear = [100, 1]
weight_n_m = 10.0
link_damping_n_m_s = 0.3
motor_damping_n_m_s = 1e-05
spring_damping_n_m_s = 0.4
[encoder.link]
bits = 18
[encoder.motor]
bits = 12
[drive]
period_s = 0.001
tuning = "quiet"
[reference]
kind = "move"
to_rad = 0.8
start_s = 0.1
[friction]
coulomb_n_m = 2.0
static_n_m = 3.0
cogging_n_m = 0.3
ripple_percent = 2.0
[error]
link_inertia_percent = -63.83
weight_percent = 10.0
torque_percent = 5.0
link_damping_percent = 50.0
motor_damping_percent = -50.0
motor_inertia_percent = -8.0
"#;
