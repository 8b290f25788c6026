//! `host-sim bounds`: against closed forms, against disturbances that attain the bounds, and its output.
//!
//! The runs do not use matrices. They use the loop of [`loop_sim::closed_loop`] with the real tick and the solver, and
//! a plant whose disturbance the test builds piece by piece.

use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

use host_sim::cli::{Console, status};
use loop_sim::linear::{LawAtRest, Ticked};
use loop_sim::plant::{Chain, LastChannel, Plant};
use loop_sim::port::{ControllerPort, PortError, Tick};
use loop_sim::random::Random;
use loop_sim::signal::Signal;
use loop_sim::trace::{Row, Trace};
use scenario::{AtRest, Experiment, Sensed, Source};
use study::bounds::{NoBounds, Quantity, SampledLoop, SignalBounds, instants};

/// Chain of order 3 with observers of order 2 in the channels 2 and 3, a model error of 30 %, and no disturbance.
const CHAIN: &str = r#"
span_s = 3.0
[plant]
kind = "chain"
order = 3
a = [-6.0, -11.0, -6.0]
b = 2.0
[controller]
precision = "f64"
period_s = 5e-3
surface_bandwidth_rad_s = 8.0
alpha_per_s = 4.0
k_l = 20.0
nominal = { a = [-4.2, -7.7, -4.2], b = 1.7 }
observer = [{ channel = 2, bandwidth_rad_s = 30.0, order = 2 }, { channel = 3, bandwidth_rad_s = 30.0, order = 2 }]
"#;

fn experiment(text: &str, sets: &[&str]) -> Experiment {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    scenario::parse(&Source { file: "test.toml", text, sets: &sets }, "test").unwrap_or_else(|error| panic!("{error}"))
}

fn sampled(experiment: &Experiment) -> SampledLoop {
    let at_rest = experiment.at_rest.as_ref().unwrap_or_else(|error| panic!("{error}"));
    let observed = experiment.port.observed();
    SampledLoop::of(at_rest, at_rest.law.as_ref(), experiment.period_s, 0, observed).expect("a stable loop")
}

fn at(it: &SampledLoop, quantity: Quantity) -> usize {
    it.quantities().iter().position(|other| *other == quantity).expect("it is bounded")
}

/// Plant with an additional disturbance in one channel, whose m-th derivative is piecewise constant.
struct Disturbed {
    plant: Box<dyn Plant>,
    channel: usize,
    m: usize,
    /// Start of each piece, s, and w, w', .. there; the m-th derivative is the last.
    pieces: Vec<(f64, [f64; 4])>,
    jumps_s: Vec<f64>,
}

impl Disturbed {
    /// `levels` are start (s) and m-th derivative of each piece; w and its lower derivatives start at 0.
    fn new(plant: Box<dyn Plant>, channel: usize, m: usize, levels: &[(f64, f64)]) -> Self {
        let mut it = Self { plant, channel, m, pieces: Vec::new(), jumps_s: levels.iter().map(|(t, _)| *t).collect() };
        for &(from_s, level) in levels {
            let mut jet = [0; 4].map(f64::from);
            for (j, value) in jet.iter_mut().enumerate().take(m) {
                *value = it.derivative(from_s, j);
            }
            jet[m] = level;
            it.pieces.push((from_s, jet));
        }
        it
    }

    fn derivative(&self, t_s: f64, order: usize) -> f64 {
        let Some((from_s, jet)) = self.pieces.iter().rev().find(|(from_s, _)| *from_s <= t_s) else { return 0.0 };
        // Horner scheme from the m-th derivative down.
        (order..=self.m).rev().fold(0.0, |sum, j| jet[j] + sum * (t_s - from_s) / ((j - order + 1) as f64))
    }
}

impl Plant for Disturbed {
    fn order(&self) -> usize {
        self.plant.order()
    }
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        self.plant.rhs(t_s, x, u, dx);
        dx[self.channel] += self.derivative(t_s, 0);
    }
    fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
        self.plant.lumped(t_s, x, u, d);
        d[self.channel] += self.derivative(t_s, 0);
    }
    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.plant.fastest_rad_s(t_s, x, u)
    }
    fn jumps_s(&self) -> &[f64] {
        &self.jumps_s
    }
}

/// Runs a scenario with such a disturbance.
fn run(text: &str, sets: &[&str], channel: usize, m: usize, levels: &[(f64, f64)]) -> Trace {
    let mut it = experiment(text, sets);
    let plant = std::mem::replace(&mut it.plant, Box::new(bare(2)));
    it.plant = Box::new(Disturbed::new(plant, channel, m, levels));
    let (trace, error) = it.run(&mut |_| ControlFlow::Continue(()));
    assert_eq!(error, None);
    trace
}

fn bare(order: usize) -> Chain {
    let channel = LastChannel { a: vec![0.0; order], b: 1.0 };
    Chain::new(channel.clone(), channel, vec![Signal::default(); order]).expect("a chain")
}

fn value(trace: &Trace, tick: usize, quantity: Quantity) -> f64 {
    let row = &trace.rows[tick];
    match quantity {
        Quantity::SigmaStar => row.sigma_star,
        Quantity::Output => row.x[0],
        Quantity::Control => row.u,
        Quantity::EstimationError(i) => row.d[i] - row.d_hat[i],
    }
}

/// Independent oracle: $w^{(m)} = sign h_m$, backwards from the last tick, attains the bound in the real loop.
#[test]
fn a_disturbance_built_of_the_kernel_attains_the_bound() {
    let late = ["actuator.delay_ticks=1", "sensor.delay_ticks=1", "actuator.report=false", "controller.k_l=10"];
    // The observer of d_2 predicts the effect of the held u on x_3 within a tick as well as its model does.
    let exact = ["controller.nominal={a=[-6.0,-11.0,-6.0],b=2.0}"];
    let cases: [(Quantity, usize, usize, &[&str]); 7] = [
        (Quantity::Output, 1, 0, &[]),
        (Quantity::Output, 0, 0, &[]),
        (Quantity::SigmaStar, 1, 1, &[]),
        (Quantity::SigmaStar, 2, 1, &[]),
        (Quantity::EstimationError(1), 1, 2, &exact),
        (Quantity::Output, 2, 1, &late),
        (Quantity::EstimationError(2), 2, 1, &late),
    ];
    for (quantity, channel, m, sets) in cases {
        let it = experiment(CHAIN, sets);
        let (t, ticks, found) = (it.period_s, it.periods, sampled(&it));
        let i = at(&found, quantity);
        let kernel = found.kernel(channel, m, 0.0).expect("a kernel");
        // A polynomial of lower degree has no effect.
        let left = (0..m).map(|j| kernel.coefficients[(i, j)].abs()).fold(0.0, f64::max);
        assert!(left < 1e-7 * kernel.norms[i], "{quantity:?} {channel} {m}: {left}");
        // From the last tick backwards, at each sign change of the kernel.
        let end_s = ticks as f64 * t;
        let mut levels = Vec::new();
        let mut last = None;
        for (l, course) in found.course(&kernel, ticks).iter().enumerate() {
            for (j, (share, _)) in instants().iter().enumerate() {
                let (tau, h) = ((l as f64 + share) * t, course[(i, j)]);
                match last {
                    Some((before, of)) if h * of < 0.0 => {
                        let between: f64 = before + (tau - before) * of / (of - h);
                        levels.push((end_s - between, f64::signum(of)));
                        last = Some((tau, h));
                    }
                    _ if h == 0.0 => {}
                    _ => last = Some((tau, h)),
                }
            }
        }
        levels.push((0.0, last.map_or(0.0, |(_, h)| h.signum())));
        levels.reverse();
        let trace = run(CHAIN, sets, channel, m, &levels);
        let ratio = value(&trace, ticks, quantity).abs() / kernel.norms[i];
        assert!((0.99..1.0 + 1e-6).contains(&ratio), "{quantity:?} by w{channel}^({m}): {ratio}");
    }
}

/// Random switching of w^(m), slow and fast, stays below the bound, and exceeds 0.3 of it.
#[test]
fn no_random_disturbance_within_its_bounds_makes_more() {
    let found = sampled(&experiment(CHAIN, &[]));
    let mut most = 0.0_f64;
    for seed in 0..24 {
        let mut random = Random::new(seed, 9);
        let (channel, m) = (seed as usize % 3, seed as usize / 3 % 2);
        let mean_s = 0.02 * libm::exp(4.0 * random.uniform());
        let (mut t_s, mut sign, mut levels) = (0.0, 1.0, Vec::new());
        while t_s < 3.0 {
            levels.push((t_s, sign));
            t_s += mean_s * -libm::log(random.uniform());
            sign = -sign;
        }
        let trace = run(CHAIN, &[], channel, m, &levels);
        let kernel = found.kernel(channel, m, 0.0).expect("a kernel");
        for (i, quantity) in found.quantities().iter().enumerate() {
            let is_whole = (0..m).all(|j| kernel.coefficients[(i, j)].abs() < 1e-7 * kernel.norms[i]);
            // The error itself contains w directly.
            let direct = f64::from(u8::from(m == 0 && *quantity == Quantity::EstimationError(channel)));
            for tick in (0..trace.rows.len()).filter(|_| is_whole) {
                let share = value(&trace, tick, *quantity).abs() / (kernel.norms[i] + direct);
                assert!(share <= 1.0 + 1e-6, "seed {seed}: {quantity:?} by w{channel}^({m}), tick {tick}: {share}");
                most = most.max(share);
            }
        }
    }
    assert!(most > 0.3, "{most}");
}

/// If the law rejects only a constant, a slow disturbance is bounded by an error coefficient and a small rest. For
/// x_3' = .. + d_3 without observer, y tends to C_0 d, and the run shows C_0 w + C_1 w' + ...
#[test]
fn error_coefficients_are_what_a_slow_disturbance_makes() {
    let sets = ["controller.observer=[]", "span_s=12"];
    let found = sampled(&experiment(CHAIN, &sets));
    let i = at(&found, Quantity::Output);
    let kernel = found.kernel(2, 3, 0.0).expect("a kernel");
    // A ramp for 6 s, then a parabola.
    let levels = [(0.0, 0.0), (2.0, 0.3)];
    let trace = run(CHAIN, &sets, 2, 2, &levels);
    let tick = trace.rows.len() - 1;
    let dt = trace.rows[tick].t_s - 2.0;
    let jet = [0.15 * dt * dt, 0.3 * dt, 0.3];
    let told: f64 = (0..3).map(|j| kernel.coefficients[(i, j)] * jet[j]).sum();
    let y = value(&trace, tick, Quantity::Output);
    assert!((told - y).abs() < 1e-6 * y.abs(), "{told} {y}");
}

/// An observer of first order with the pole q = e^(-l T) has the error (T/2) coth(l T/2) per d', slightly more than 1/l
/// of the continuous observer.
#[test]
fn observer_of_first_order_has_the_bound_of_its_closed_form() {
    for (l, period_s) in [(20.0, 1e-3), (20.0, 2e-2), (3.0, 1e-2)] {
        let text = format!(
            "[plant]\nkind = \"chain\"\norder = 2\na = [0.0, 0.0]\nb = 1.0\n[controller]\nperiod_s = {period_s}\n\
             surface_bandwidth_rad_s = 5.0\nk_l = 10.0\n\
             observer = [{{ channel = 2, bandwidth_rad_s = {l}, order = 1 }}]\n"
        );
        let found = sampled(&experiment(&text, &[]));
        let i = at(&found, Quantity::EstimationError(1));
        let expected = 0.5 * period_s / f64::tanh(0.5 * l * period_s);
        let norm = found.kernel(1, 1, 0.0).expect("a kernel").norms[i];
        assert!((norm / expected - 1.0).abs() < 2e-5, "{l} {period_s}: {norm} {expected}");
        let known = SignalBounds { mu: vec![1e9, 2.0], jumps: 0.5 };
        let bound = found.of_disturbance(1, &known, 100.0).expect("a bound")[i];
        // A step of 1 gives an error of 1 at the next tick, and a smaller one afterwards.
        assert!((bound.value / (2.0 * expected + 0.5) - 1.0).abs() < 2e-3, "{bound:?} {expected}");
        assert_eq!(bound.derivative, 1);
    }
}

/// u = -k x_2 on x_2' = u: a sensor error enters u directly and through x_2, which moves by at most this error.
#[test]
fn steps_of_a_sensor_make_what_the_known_loop_says() {
    struct Proportional(f64);
    impl LawAtRest for Proportional {
        fn steps(&self) -> Vec<f64> {
            vec![0.0; 2]
        }
        fn rest(&self) -> (Vec<f64>, f64) {
            (Vec::new(), 0.0)
        }
        fn tick(&self, _: &[f64], sample: &[f64], _: Option<f64>) -> Ticked {
            Ticked { u: -self.0 * sample[1], ..Ticked::default() }
        }
    }
    let at_rest = |k: f64| AtRest {
        loaded_inertia_kg_m2: None,
        corners: Vec::new(),
        inertia_range: None,
        plant: Box::new(bare(2)),
        law: Box::new(Proportional(k)),
        sensed: (0..2)
            .map(|state| Sensed { state, name: String::new(), unit: "", rms: 0.0, noise: 0.0, quantum: 0.1 })
            .collect(),
        sensor_delay_ticks: 0,
        actuator_delay_ticks: 0,
        report: true,
        left_out: Vec::new(),
    };
    // From 1000 ticks per time constant to less than two.
    for (k, t) in [(10.0, 1e-4), (10.0, 0.06)] {
        let it = at_rest(k);
        let found = SampledLoop::of(&it, it.law.as_ref(), t, 1, &[]).expect("a loop");
        let bounds = found.of_sensor(1, 0.05);
        // The bound is rounded up by 1e-4.
        for (bound, expected) in bounds.iter().zip([0.05, 2.0 * k * 0.05]) {
            assert!((bound / expected - 1.0001).abs() < 3e-5, "{k} {t}: {bounds:?}");
        }
        assert_eq!(found.of_sensor(0, 0.05), [0.0, 0.0]);
    }
    let it = at_rest(-1.0);
    let refused = SampledLoop::of(&it, it.law.as_ref(), 0.01, 1, &[]);
    assert!(matches!(refused, Err(NoBounds::Unstable(radius)) if (radius - 1.01).abs() < 1e-9), "{refused:?}");
}

/// Comparison with the sum over every tick. Poles down to 0.5 1/s give strides of up to 64 ticks.
#[test]
fn strides_lose_less_than_the_bounds_are_rounded_up() {
    let sets = ["controller.observer=[{channel=2,poles=[[-0.5,0],[-60,0]]},{channel=3,poles=[[-2,9],[-2,-9]]}]"];
    let found = sampled(&experiment(CHAIN, &sets));
    for (channel, m) in [(1, 0), (1, 1), (2, 2), (0, 0)] {
        let kernel = found.kernel(channel, m, 0.0).expect("a kernel");
        let course = found.course(&kernel, 8000);
        for (i, quantity) in found.quantities().iter().enumerate() {
            let of_tick = |row: &nalgebra::DMatrix<f64>| -> f64 {
                instants().iter().enumerate().map(|(j, (_, weight))| weight * row[(i, j)].abs()).sum()
            };
            let sum: f64 = 5e-3 * course.iter().map(of_tick).sum::<f64>();
            let off = kernel.norms[i] / sum - 1.0;
            assert!(off.abs() < 2e-5, "{quantity:?} by w{channel}^({m}): {off:e}");
        }
    }
}

fn told(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let console = Console { out: &mut out, err: &mut err, stop: &AtomicBool::new(false), terminal: false };
    let args = ["host-sim", "bounds"].iter().chain(args).map(Into::into);
    let status = host_sim::cli::run(args, console);
    (status, String::from_utf8(out).expect("text"), String::from_utf8(err).expect("text"))
}

/// Creates a folder of this test with a scenario file.
fn with_file(name: &str, text: &str) -> (std::path::PathBuf, String) {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bounds-{name}"));
    whole_file::claim(&folder).expect("a folder");
    let file = folder.join("it.toml");
    whole_file::write(&file, whole_file::Existing::Replace, |out| out.write_all(text.as_bytes())).expect("a file");
    (folder, file.display().to_string())
}

#[test]
fn bounds_hold_for_every_file_to_start_from() {
    // The fast tier tests the first and the fourth.
    let deep = std::env::var_os("DEEP").is_some_and(|value| value == "1");
    for (plant, text) in scenario::STARTS.into_iter().step_by(if deep { 1 } else { 3 }) {
        let (folder, file) = with_file(plant, text);
        let (done, out, err) = told(&[&file, "--json", "--out", &folder.display().to_string()]);
        assert_eq!(done, status::DONE, "{plant}: {err}");
        let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
        let row = |key: &str| -> Vec<f64> {
            json[key].as_array().expect(key).iter().map(|it| it.as_f64().unwrap_or(f64::NAN)).collect()
        };
        let (bounds, simulated) = (row("bounds"), row("simulated"));
        assert!(bounds.len() >= 4 && bounds.len() == simulated.len(), "{plant}: {out}");
        for (i, (bound, value)) in bounds.iter().zip(&simulated).enumerate() {
            assert!(bound.is_finite() && value <= bound && *value > 0.0, "{plant} {i}: {value} {bound}\n{out}");
        }
        assert!(!json["gains"].as_array().expect("gains").is_empty(), "{plant}: {out}");
        assert!(folder.join("bounds.svg").is_file() && folder.join("bounds.png").is_file());
    }
}

/// The advised setting works as printed and has the predicted effect. For a joint no gain lowers the bound of σ\*.
#[test]
fn advice_is_what_the_file_takes_and_what_a_run_of_it_shows() {
    let bounds = |json: &serde_json::Value| -> Vec<f64> {
        json["bounds"].as_array().expect("bounds").iter().map(|it| it.as_f64().expect("a number")).collect()
    };
    // At 940 the reaching gain of the motor is within 10 % of its limit 1/T.
    let starts = scenario::STARTS.into_iter().map(|(plant, text)| (plant, text, None));
    let all = starts.chain([("motor", scenario::MOTOR, Some("drive.reaching_per_s=940"))]);
    // The fast tier tests this motor.
    let deep = std::env::var_os("DEEP").is_some_and(|value| value == "1");
    let mut advised = 0;
    for (plant, text, set) in all.filter(|(_, _, set)| deep || set.is_some()) {
        let (folder, file) = with_file(&format!("advice-{plant}"), text);
        let out = folder.display().to_string();
        let json = |sets: &[&str]| -> serde_json::Value {
            let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
            let (done, said, err) = told(&[&[&file[..], "--json", "--out", &out], &sets[..]].concat());
            assert_eq!(done, status::DONE, "{plant} {sets:?}: {err}");
            serde_json::from_str(&said).expect("JSON")
        };
        let own: Vec<&str> = set.into_iter().collect();
        let before = json(&own);
        assert!(plant != "joint" || before["advice"][0].is_null(), "{before}");
        for (i, advice) in
            before["advice"].as_array().expect("advice").iter().enumerate().filter(|(_, it)| !it.is_null())
        {
            let after = json(&[&own[..], &[advice["set"].as_str().expect("a setting")]].concat());
            let (change, said) =
                (bounds(&after)[i] / bounds(&before)[i] - 1.0, advice["bound"].as_f64().expect("bound"));
            assert!(change < -0.01 && (change - said).abs() < 1e-9, "{plant} {advice}: {change}");
            advised += 1;
        }
    }
    assert!(advised >= if deep { 15 } else { 1 }, "{advised}");
}

/// Drive in f64 with an additive deviation of u.
struct Beside<'a> {
    port: Box<dyn ControllerPort>,
    by: Box<dyn FnMut() -> f64 + Send + 'a>,
}

impl ControllerPort for Beside<'_> {
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let tick = self.port.tick(sample)?;
        Ok(Tick { u: tick.u + (self.by)(), ..tick })
    }
    fn report_applied(&mut self, u: f64) {
        self.port.report_applied(u);
    }
    fn reset(&mut self) -> Result<(), PortError> {
        self.port.reset()
    }
    fn observed(&self) -> &[usize] {
        self.port.observed()
    }
}

/// Runs a file with this law instead of its own.
fn with_law(text: &str, sets: &[&str], by: Option<Box<dyn FnMut() -> f64 + Send>>) -> Trace {
    let mut it = experiment(text, sets);
    if let Some(by) = by {
        let drive = it.drive.as_ref().expect("a drive");
        let port = drive.designed.in_f64(&drive.motion).expect("a design");
        it.port = Box::new(Beside { port, by });
    }
    let (trace, error) = it.run(&mut |_| ControlFlow::Continue(()));
    assert_eq!(error, None);
    trace
}

/// Drives without friction with fine encoders. A deviation of u of up to 1 % of the limit (joint: 3 %, more than the
/// quantisation), in square waves of all periods, changes sigma*, y and u by at most the bound, and by a large part of
/// it.
#[test]
fn a_u_that_is_asked_for_beside_the_law_makes_no_more_than_its_bound_and_most_of_it() {
    let fine = ["encoder.bits=24", "drive.gain_sets=1", "friction={}", "reference={kind=\"rest\"}", "span_s=0.6"];
    let of_joint = ["drive.gain_sets=1", "friction={}", "reference={kind=\"rest\"}", "load=[]", "span_s=3"];
    for (text, sets, error) in [
        (scenario::MOTOR, fine.to_vec(), 0.1),
        (scenario::MOTOR, [&fine[..], &["drive.delay_ticks=1"]].concat(), 0.1),
        (scenario::JOINT, [&of_joint[..], &["joint.weight_n_m=0"]].concat(), 1.0),
    ] {
        let it = experiment(text, &sets);
        let found = sampled(&it);
        let bounds = found.of_asked(error);
        // Two runs with separately rounded counts.
        let quanta = it.at_rest.as_ref().expect("a loop").sensed.iter().map(|sensed| sensed.quantum);
        let steps = quanta.enumerate().map(|(i, quantum)| found.of_sensor(i, quantum));
        let steps = steps.fold(vec![0.0; bounds.len()], |sums, row| sums.iter().zip(row).map(|(a, b)| a + b).collect());
        let rest = with_law(text, &sets, Some(Box::new(|| 0.0)));
        let mut most = vec![0.0_f64; bounds.len()];
        for half in [1, 2, 3, 5, 8, 12, 20, 30, 50, 80, 120, 200, 400] {
            let mut tick = 0;
            let square = move || {
                tick += 1;
                if (tick / half) % 2 == 0 { error } else { -error }
            };
            let trace = with_law(text, &sets, Some(Box::new(square)));
            for (k, (row, still)) in trace.rows.iter().zip(&rest.rows).enumerate() {
                assert!(row.health.is_ok(), "{half}, tick {k}: {:?}", row.health);
                for (most, quantity) in most.iter_mut().zip(found.quantities()) {
                    let value = |row: &Row| match quantity {
                        Quantity::SigmaStar => row.sigma_star,
                        Quantity::Output => row.x[0],
                        Quantity::Control => row.u,
                        Quantity::EstimationError(i) => row.d[*i] - row.d_hat[*i],
                    };
                    *most = most.max((value(row) - value(still)).abs());
                }
            }
        }
        for (i, quantity) in found.quantities().iter().enumerate() {
            let (most, bound) = (most[i], bounds[i]);
            println!("{quantity:?}: {most:e} of {bound:e}, steps {:e}", steps[i]);
            assert!(most <= bound + steps[i] && most >= 0.3 * bound, "{quantity:?}: {most} of {bound}, {sets:?}");
        }
    }
}

/// Compares a run in f32 with a run in f64, each with its own counts. They differ by at most the bounds of rounding and
/// quantisation, and the bound of rounding is present.
#[test]
fn f32_and_f64_differ_by_no_more_than_the_bound_of_rounding_and_of_the_steps() {
    for (plant, sets) in [("motor", &["encoder.bits=24"][..]), ("joint", &[])] {
        let sets = [sets, &["drive.gain_sets=1"]].concat();
        let text = scenario::STARTS.iter().find(|(name, _)| *name == plant).expect("a file").1;
        let (folder, file) = with_file(&format!("rounding-{plant}"), text);
        let words = sets.iter().flat_map(|set| ["--set", set]);
        let args: Vec<&str> =
            [file.as_str(), "--json", "--out", folder.to_str().expect("UTF-8")].into_iter().chain(words).collect();
        let (done, out, err) = told(&args);
        assert_eq!(done, status::DONE, "{err}");
        let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
        let parts = json["parts"].as_array().expect("parts");
        let of = |is: &dyn Fn(&str) -> bool| -> Vec<f64> {
            let of_them = parts.iter().filter(|part| is(part["name"].as_str().expect("a name")));
            let rows = of_them
                .map(|part| part["bounds"].as_array().expect("bounds").iter().filter_map(serde_json::Value::as_f64));
            rows.fold(vec![0.0; 16], |sums, row| sums.iter().zip(row).map(|(a, b)| a + b).collect())
        };
        let rounding = of(&|name| name == "rounding to f32");
        let steps = of(&|name| name.starts_with("steps of "));
        assert!(rounding.len() >= 4 && rounding.iter().all(|it| it.is_finite() && *it > 0.0), "{plant}: {out}");
        let [in_f32, in_f64] =
            [None, Some(Box::new(|| 0.0) as Box<dyn FnMut() -> f64 + Send>)].map(|by| with_law(text, &sets, by));
        let apart = |of: &dyn Fn(&Row) -> f64| {
            let rows = in_f32.rows.iter().zip(&in_f64.rows);
            rows.fold(0.0_f64, |most, (a, b)| most.max((of(a) - of(b)).abs()))
        };
        let apart = [apart(&|row| row.sigma_star), apart(&|row| row.x[0]), apart(&|row| row.u)];
        for (i, apart) in apart.iter().enumerate() {
            let bound = rounding[i] + 2.0 * steps[i];
            println!("{plant} {i}: {apart:e} rounding {:e} steps {:e}", rounding[i], steps[i]);
            assert!(*apart <= bound && *apart > 0.0, "{plant}, {i}: {apart} of {bound}");
        }
    }
}

#[test]
fn what_has_no_bounds_is_told_and_nothing_is_written() {
    let folder = with_file("none", CHAIN).0.join("out").display().to_string();
    let cases: [(&[&str], u8, &str); 4] = [
        (&["--set", "plant.error.b=3", "--set", "controller.k_l=500"], status::FAILED, "no bound: "),
        (&["--set", "controller.kay=3"], status::BAD_INPUT, "k_l"),
        (&["no-such-file.toml"], status::BAD_INPUT, "no-such-file.toml"),
        (&["--set", "actuator.hold_ticks=2"], status::BAD_INPUT, "hold_ticks"),
    ];
    for (args, expected, words) in cases {
        let args: Vec<&str> = args.iter().copied().chain(["--out", &folder]).collect();
        let (done, out, err) = told(&args);
        assert_eq!((done, out.as_str()), (expected, ""), "{args:?}: {err}");
        assert!(err.contains(words), "{args:?}: {err}");
    }
}
