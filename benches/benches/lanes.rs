//! Simulation speed of many plants, compared with alternatives: SciPy, numba, C, and C over 32 plants.
//!
//! The command is `cargo bench -p benches --bench lanes`. With `-- --python PYTHON` it also uses a Python that has
//! SciPy and numba (`cargo xtask bench lanes` installs them). All programs run one loop: the joint of Example 2, r = 2,
//! T = 1 ms, and v = 1 + sin 2t. Each is timed in turn, the best of several. The largest |y| at the end, which all
//! report, shows that they compute the same problem. Times depend on the machine and the moment; no test checks them.

#[path = "subjects/lanes.rs"]
mod lanes;

use std::hint::black_box;
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Instant;

use benches::loops::{Beside, ClosedLoop};
use benches::{Joint, NOMINAL, Noise, joint};
use controller_core::{ControlLaw, FlexibleJoint, JointParameters, NominalModel, Reading};
use lanes::L;
use loop_sim::lanes::{Campaign, Instructions, LANES, Trial, close_loops, close_loops_with};
use loop_sim::sensor::Sensing;
use scenario::{Experiment, Source};
use serde_json::{Value, json};

/// Length of a loop, periods.
const PERIODS: usize = 2000;
/// First period of the last quarter.
const FROM: usize = 1500;
const PERIOD_S: f64 = 1e-3;
/// Runge-Kutta steps per tick.
const STEPS: [usize; 2] = [5, 10];
/// Tolerated relative difference of max |y| from the scalar loop: due to a sine of degree 7, Runge-Kutta, and a law in
/// f64.
const SAME: f64 = 1e-3;

/// AVX-512, if the machine has it.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512vl+avx512dq+avx512bw+avx2+fma+bmi1+bmi2",
    "x86_64+avx2+fma+bmi1+bmi2"
))]
fn lanes_avx512(joint: &Joint<f32, 2>, states: &mut lanes::States, x: &[[f32; L]; 4], u: &mut [f32; L]) {
    lanes::tick_all(joint, states, x, u);
}

/// A separate call per plant, which prevents vectorisation.
#[inline(never)]
fn alone(joint: &Joint<f32, 2>, state: &mut <Joint<f32, 2> as ControlLaw>::State, x: &[f32; 4]) -> f32 {
    joint.tick(state, x).u
}

/// Prints ticks per second of 64 plants, each method in turn and the best of several: ratios within one run.
fn ticks() {
    let (joint, mut noise) = (black_box(joint::<2>()), Noise::new(1));
    let samples: Vec<[[f32; L]; 4]> = (0..256)
        .map(|_| {
            let all: [[f32; 4]; L] = std::array::from_fn(|_| noise.sample());
            std::array::from_fn(|j| all.map(|x| x[j]))
        })
        .collect();
    let state = joint.start(&[0.0; 4]).expect("a finite sample");
    let mut states: [_; L] = std::array::from_fn(|_| state.clone());
    let (mut lanes, mut u) = (state.lanes::<L>(), [0.0; L]);
    let mut best = [f64::INFINITY; 4];
    for _ in 0..40 {
        let mut timed = |way: usize, tick: &mut dyn FnMut(&[[f32; L]; 4])| {
            let began = Instant::now();
            for x in samples.iter().cycle().take(20 * samples.len()) {
                tick(black_box(x));
            }
            best[way] = best[way].min(began.elapsed().as_secs_f64() / (20 * samples.len() * L) as f64);
        };
        timed(0, &mut |x| {
            for l in 0..L {
                u[l] = alone(&joint, &mut states[l], &[x[0][l], x[1][l], x[2][l], x[3][l]]);
            }
        });
        timed(1, &mut |x| lanes::lanes_baseline(&joint, &mut lanes, x, &mut u));
        timed(2, &mut |x| lanes::lanes_avx2(&joint, &mut lanes, x, &mut u));
        timed(3, &mut |x| lanes_avx512(&joint, &mut lanes, x, &mut u));
        black_box(&u);
    }
    println!("ticks of {L} plants, r = 2, f32      M ticks/s   over one by one");
    for (way, seconds) in ["one by one", "lanes, SSE2", "lanes, AVX2", "lanes, AVX-512"].iter().zip(best) {
        println!("  {way:<30} {:>10.1} {:>12.1}", 1e-6 / seconds, best[0] / seconds);
    }
}

/// A row of the table.
struct Row {
    program: String,
    method: String,
    ticks_per_s: f64,
    largest: f64,
}

/// Returns the ticks per second of a closed loop (all ticks of a run counted), the best of several runs, and max |y|.
fn timed(times: usize, loops: usize, run: &mut dyn FnMut() -> f64) -> (f64, f64) {
    let (mut best, mut largest) = (f64::INFINITY, f64::NAN);
    for _ in 0..times {
        let began = Instant::now();
        largest = black_box(run());
        best = best.min(began.elapsed().as_secs_f64());
    }
    (((PERIODS + 1) * loops) as f64 / best, largest)
}

/// Times edo-smc with the default scenario: alone as in `host-sim run`, and many loops at once.
fn ours(experiments: &mut Vec<Experiment>, table: &mut Vec<Row>) {
    let mut add = |program: String, method: &str, (ticks_per_s, largest): (f64, f64)| {
        table.push(Row { program, method: method.into(), ticks_per_s, largest });
    };
    let alone = timed(experiments.len() - 1, 1, &mut || {
        let mut experiment = experiments.pop().expect("one for each run");
        let (trace, error) = experiment.run(&mut |_| std::ops::ControlFlow::Continue(()));
        assert!(error.is_none(), "the loop ran to its end");
        experiment.metrics(&trace).y_ultimate
    });
    add("ours, one, every tick recorded".into(), "exact step", alone);
    let experiment = &experiments[0];
    let (ideal, trial) = experiment.beside().expect("a loop that fits");
    let noise = Sensing { noise: vec![1e-5; 4], ..Sensing::IDEAL };
    let noisy = Campaign { sensing: &noise, ..ideal };
    let trials: Vec<Trial<'_>> = (0..LANES as u64).map(|seed| Trial { seed, ..trial }).collect();
    let largest = |judged: Vec<Option<loop_sim::lanes::Judged>>| {
        judged.iter().map(|judged| judged.as_ref().expect("side by side").metrics.y_ultimate).fold(0.0, f64::max)
    };
    for (set, name) in
        [(Instructions::Baseline, "SSE2"), (Instructions::Avx2, "AVX2"), (Instructions::Avx512, "AVX-512")]
    {
        for (campaign, with) in [(&ideal, ""), (&noisy, ", four noises a tick")] {
            let told = timed(100, LANES, &mut || largest(close_loops_with(set, campaign, &trials)));
            add(format!("ours, {LANES} side by side, {name}"), &format!("exact step{with}"), told);
        }
    }
    let one = || _ = black_box(close_loops(&ideal, &trials));
    let two = || {
        std::thread::scope(|scope| {
            scope.spawn(one);
            scope.spawn(one);
            0.0
        })
    };
    let (two, _) = timed(100, 2 * LANES, &mut { two });
    add("ours, the same on two threads".into(), "exact step", (two, f64::NAN));
}

/// Times C, one plant and 32.
fn c(law: &Joint<f32, 2>, table: &mut Vec<Row>) {
    let joint = JointParameters::TABLE_I.chain(Reading::Reconstructed);
    for steps in STEPS {
        let asked = ClosedLoop::new(&joint, PERIOD_S, 0.1, [PERIODS, FROM, steps]);
        let (ticks_per_s, largest) = timed(20, 1, &mut || asked.alone(law));
        let method = format!("RK4, {steps} a tick, libm's sine");
        table.push(Row { program: "C, -O3".into(), method, ticks_per_s, largest });
    }
    let asked = ClosedLoop::new(&joint, PERIOD_S, 0.1, [PERIODS, FROM, STEPS[0]]);
    for (set, name) in [
        (Beside::Sse2, "SSE2"),
        (Beside::Avx2, "AVX2"),
        (Beside::Avx512, "AVX-512"),
        (Beside::Fast, "AVX-512, -ffast-math"),
    ] {
        if asked.beside(set, law).is_none() {
            println!("(no {name} on this machine)");
            continue;
        }
        let run = &mut || asked.beside(set, law).expect("it was there before");
        let (ticks_per_s, largest) = timed(50, ClosedLoop::BESIDE, run);
        let program = format!("C, -O3, {} side by side, {name}", ClosedLoop::BESIDE);
        table.push(Row {
            program,
            method: format!("RK4, {} a tick, sine of degree 7", STEPS[0]),
            ticks_per_s,
            largest,
        });
    }
}

/// Times the programs of `python/loops.py`.
fn python(program: &str, law: &Joint<f32, 2>, table: &mut Vec<Row>) {
    let joint = JointParameters::TABLE_I.chain(Reading::Reconstructed);
    let asked = ClosedLoop::new(&joint, PERIOD_S, 0.1, [PERIODS, FROM, 1]);
    let unit = |j: usize| f64::from(law.model().drift(&std::array::from_fn(|i| if i == j { 1.0 } else { 0.0 })));
    let design = law.coefficients().numbers().map(Into::into).chain([0, 2, 3].map(unit));
    let asked = json!({
        "design": design.collect::<Vec<f64>>(),
        "joint": asked.joint(),
        "period_s": PERIOD_S,
        "x1": 0.1,
        "periods": PERIODS,
        "from": FROM,
    });
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/python/loops.py");
    let mut child = Command::new(program)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{program}: {error}"));
    let mut stdin = child.stdin.take().expect("a pipe");
    stdin.write_all(asked.to_string().as_bytes()).expect("the script reads");
    drop(stdin);
    let output = child.wait_with_output().expect("the script ends");
    assert!(output.status.success(), "{script} ended with {}", output.status);
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let said: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{script}: {error}: {line}"));
        let number = |name: &str| said[name].as_f64().unwrap_or_else(|| panic!("{script}: no {name}: {line}"));
        let text = |name: &str| said[name].as_str().unwrap_or_default().to_owned();
        let (ticks_per_s, largest) = (number("ticks_per_s"), number("largest"));
        table.push(Row { program: text("program"), method: text("method"), ticks_per_s, largest });
    }
}

fn loops(interpreter: Option<&str>) {
    let text = scenario::template("default", "paper").expect("a name");
    let end_s = PERIODS as f64 * PERIOD_S;
    let sets = [
        format!("controller.period_s={PERIOD_S}"),
        format!("span_s={end_s}"),
        format!("window_s=[{}, {end_s}]", FROM as f64 * PERIOD_S),
    ];
    let source = Source { file: "default.toml", text: &text, sets: &sets };
    let mut experiments: Vec<Experiment> =
        (0..20).map(|_| scenario::parse(&source, "default").expect("a good scenario")).collect();
    let config = experiments[0].spec.as_ref().and_then(|spec| spec.config.fixed::<4, 2>()).expect("the joint's shape");
    let law = Joint::<f32, 2>::try_design(&config, FlexibleJoint::<f32>::new(&NOMINAL)).expect("a good design");
    let mut table = Vec::new();
    if let Some(interpreter) = interpreter {
        python(interpreter, &law, &mut table);
    }
    c(&law, &mut table);
    let others = table.len();
    ours(&mut experiments, &mut table);
    let reference = table[others].largest;
    println!("| one closed loop of the joint | plant | million ticks/s, one core | max \\|y\\| less ours, of it |");
    println!("|---|---|---|---|");
    for Row { program, method, ticks_per_s, largest } in &table {
        let apart = (largest - reference) / reference;
        let is_same = apart.is_nan() || method.contains("noise") || apart.abs() <= SAME;
        assert!(is_same, "{program}, {method}: max |y| is {largest}, ours {reference}");
        let apart = if apart.is_nan() { String::from("-") } else { format!("{apart:.1e}") };
        println!("| {program} | {method} | {:.3} | {apart} |", 1e-6 * ticks_per_s);
    }
}

/// Times Example 1, whose plant has no step function of its own: the solver of order 10, 26 evaluations per tick.
fn example_1() {
    println!("\n| Example 1, T = 0.1 ms, 26 evaluations a tick | million ticks/s, one core |");
    println!("|---|---|");
    for (name, text) in [
        ("part 1", include_str!("../../host-sim/scenarios/fig01.toml")),
        ("part 2", include_str!("../../host-sim/scenarios/fig02.toml")),
    ] {
        let end_s = PERIODS as f64 * 1e-4;
        let sets = [format!("span_s={end_s}"), format!("window_s=[{}, {end_s}]", FROM as f64 * 1e-4)];
        let source = Source { file: "example_1.toml", text, sets: &sets };
        let read = || scenario::parse(&source, "example_1").expect("a good scenario");
        let mut experiments: Vec<Experiment> = (0..21).map(|_| read()).collect();
        let kept = read();
        let (campaign, trial) = kept.beside().expect("a loop that fits");
        let trials: Vec<Trial<'_>> = (0..LANES as u64).map(|seed| Trial { seed, ..trial }).collect();
        let (alone, of_alone) = timed(20, 1, &mut || {
            let mut experiment = experiments.pop().expect("one for each run");
            let (trace, _) = experiment.run(&mut |_| std::ops::ControlFlow::Continue(()));
            experiment.metrics(&trace).y_ultimate
        });
        println!("| {name}, one, every tick recorded | {:.2} |", 1e-6 * alone);
        for set in [Instructions::Baseline, Instructions::Avx2, Instructions::Avx512] {
            let (ticks_per_s, largest) = timed(50, LANES, &mut || {
                let judged = close_loops_with(set, &campaign, &trials);
                judged
                    .iter()
                    .map(|judged| judged.as_ref().expect("side by side").metrics.y_ultimate)
                    .fold(0.0, f64::max)
            });
            assert_eq!(largest.to_bits(), of_alone.to_bits(), "{name}: the figures are those of one alone");
            println!("| {name}, {LANES} side by side, {set:?} | {:.1} |", 1e-6 * ticks_per_s);
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let after = arguments.iter().position(|argument| argument == "--python");
    example_1();
    ticks();
    loops(after.and_then(|at| arguments.get(at + 1)).map(String::as_str));
}
