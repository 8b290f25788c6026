//! `host-sim bounds`: against closed forms, against disturbances built to attain them, and as a user meets them.
//!
//! The runs know nothing of matrices: they are the loop of [`loop_sim::closed_loop`], with the very tick and the
//! solver, under a plant whose disturbance the test makes piece by piece.

use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

use host_sim::bounds::{Known, NoBounds, Quantity, SampledLoop, instants};
use host_sim::cli::{Console, status};
use loop_sim::linear::{LawAtRest, Ticked};
use loop_sim::plant::{Chain, LastChannel, Plant};
use loop_sim::random::Random;
use loop_sim::signal::Signal;
use loop_sim::trace::Trace;
use scenario::{AtRest, Experiment, Sensed, Source};

/// A chain of three with observers of order 2 in the channels 2 and 3, its model 30 % wrong, no disturbance.
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

/// A plant with a further disturbance in one channel, whose m-th derivative is constant from instant to instant.
struct Disturbed {
    plant: Box<dyn Plant>,
    channel: usize,
    m: usize,
    /// From when on, and w, w', .. there, the m-th derivative last.
    pieces: Vec<(f64, [f64; 4])>,
    jumps_s: Vec<f64>,
}

impl Disturbed {
    /// `levels`: from when on, and the m-th derivative; w and its lower derivatives begin with 0.
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
        // Horner, from the m-th derivative down.
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

/// The run of a scenario under such a disturbance.
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

/// The independent oracle: $w^{(m)} = sign h_m$ run backwards from the last tick makes the bound, in the very loop.
#[test]
fn a_disturbance_built_of_the_kernel_attains_the_bound() {
    let late = ["actuator.delay_ticks=1", "sensor.delay_ticks=1", "actuator.report=false", "controller.k_l=10"];
    // What held u makes of x_3 inside a tick the observer of d_2 knows as well as the model is.
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
        // Nothing is left of a polynomial of lower degree.
        let left = (0..m).map(|j| kernel.coefficients[(i, j)].abs()).fold(0.0, f64::max);
        assert!(left < 1e-7 * kernel.norms[i], "{quantity:?} {channel} {m}: {left}");
        // From the last tick backwards, where the kernel has another sign than before.
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

/// Random switching of w^(m) at random instants, slow and fast, stays below; it would not below 0.3 of the bound.
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
            // Of the error itself w is a part at once.
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

/// Where the law takes away a constant only, a slow disturbance is bounded by an error coefficient and a small rest:
/// of x_3' = .. + d_3 without observer y goes to C_0 d, and C_0 w + C_1 w' + .. is what the run shows.
#[test]
fn error_coefficients_are_what_a_slow_disturbance_makes() {
    let sets = ["controller.observer=[]", "span_s=12"];
    let found = sampled(&experiment(CHAIN, &sets));
    let i = at(&found, Quantity::Output);
    let kernel = found.kernel(2, 3, 0.0).expect("a kernel");
    // A ramp, and after 6 s of it a parabola.
    let levels = [(0.0, 0.0), (2.0, 0.3)];
    let trace = run(CHAIN, &sets, 2, 2, &levels);
    let tick = trace.rows.len() - 1;
    let dt = trace.rows[tick].t_s - 2.0;
    let jet = [0.15 * dt * dt, 0.3 * dt, 0.3];
    let told: f64 = (0..3).map(|j| kernel.coefficients[(i, j)] * jet[j]).sum();
    let y = value(&trace, tick, Quantity::Output);
    assert!((told - y).abs() < 1e-6 * y.abs(), "{told} {y}");
}

/// An observer of first order with the pole q = e^(-l T) makes of d' the error (T/2) coth(l T/2), which is 1/l of the
/// continuous one and a little more.
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
        let known = Known { mu: vec![1e9, 2.0], jumps: 0.5 };
        let bound = found.of_disturbance(1, &known, 100.0).expect("a bound")[i];
        // What jumps by 1 is in error by 1 at the next tick, and by less then.
        assert!((bound.value / (2.0 * expected + 0.5) - 1.0).abs() < 2e-3, "{bound:?} {expected}");
        assert_eq!(bound.derivative, 1);
    }
}

/// u = -k x_2 on x_2' = u: an error of the sensor makes u at once and by all of x_2, which it moves by itself at most.
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
        corners: Vec::new(),
        plant: Box::new(bare(2)),
        law: Box::new(Proportional(k)),
        sensed: (0..2).map(|state| Sensed { state, name: String::new(), unit: "", rms: 0.0, quantum: 0.1 }).collect(),
        sensor_delay_ticks: 0,
        actuator_delay_ticks: 0,
        report: true,
        left_out: Vec::new(),
    };
    // A thousand ticks per time constant, and less than two.
    for (k, t) in [(10.0, 1e-4), (10.0, 0.06)] {
        let it = at_rest(k);
        let found = SampledLoop::of(&it, it.law.as_ref(), t, 1, &[]).expect("a loop");
        let bounds = found.of_sensor(1, 0.05);
        // Rounded up by 1e-4.
        for (bound, expected) in bounds.iter().zip([0.05, 2.0 * k * 0.05]) {
            assert!((bound / expected - 1.0001).abs() < 3e-5, "{k} {t}: {bounds:?}");
        }
        assert_eq!(found.of_sensor(0, 0.05), [0.0, 0.0]);
    }
    let it = at_rest(-1.0);
    let refused = SampledLoop::of(&it, it.law.as_ref(), 0.01, 1, &[]);
    assert!(matches!(refused, Err(NoBounds::Unstable(radius)) if (radius - 1.01).abs() < 1e-9), "{refused:?}");
}

/// Against the sum over every tick, with poles down to 0.5 /s, so that strides are up to 64 ticks.
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

/// A folder of this test, with a file in it.
fn with_file(name: &str, text: &str) -> (std::path::PathBuf, String) {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bounds-{name}"));
    whole_file::claim(&folder).expect("a folder");
    let file = folder.join("it.toml");
    whole_file::write(&file, whole_file::Existing::Replace, |out| out.write_all(text.as_bytes())).expect("a file");
    (folder, file.display().to_string())
}

#[test]
fn bounds_hold_for_every_file_to_start_from() {
    for (plant, text) in scenario::STARTS {
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

#[test]
fn what_has_no_bounds_is_told_and_nothing_is_written() {
    let folder = with_file("none", CHAIN).0.join("out").display().to_string();
    let cases: [(&[&str], u8, &str); 4] = [
        (&["--set", "plant.error.b=3", "--set", "controller.k_l=500"], status::FAILED, "there is no bound"),
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
