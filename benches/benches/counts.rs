//! Instruction counts of the host by callgrind. They are identical in every run, so a change can be judged.
//!
//! The command is `cargo bench --workspace --profile dev --bench counts`. The profile `dev` is used because CI has
//! built everything in it already (it optimises; another profile generates other code). The program runs itself under
//! `valgrind --tool=callgrind` once per subject and counts only inside of it. More instructions than the limit in
//! `counts.toml` fail. A count 5 % below fails too, since a loose limit detects nothing. A missing valgrind fails, and
//! so does a program of another compiler than the compiler of the limits. `--record` then writes its counts instead.

mod ceilings;
#[path = "subjects/lanes.rs"]
mod lanes;
#[path = "subjects/second.rs"]
mod second;

use std::fs;
use std::hint::black_box;
use std::process::{Command, ExitCode};

use benches::{Joint, Noise, joint};
use ceilings::Ceilings;
use controller_core::ControlLaw;
use lanes::L;
use loop_sim::lanes::{Campaign, Judged, LANES, Trial, close_each, close_loops};
use loop_sim::trace::{Ending, Recorder};
use scenario::{Experiment, Source};

/// File of limits, next to the sources.
const CEILINGS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/counts.toml");
/// Compiler of this program.
const THIS_COMPILER: &str =
    if cfg!(debug_assertions) { concat!(env!("COMPILER"), ", checks on") } else { env!("COMPILER") };

const TICKS: u64 = 1000;

struct Subject {
    what: &'static str,
    /// Counted function; its name is unique among all function names.
    function: &'static str,
    run: fn(),
    /// Calls per run; the count is per call.
    calls: u64,
    /// Margin of a recorded limit above the count, percent; 0 for the tick, whose count is constant.
    above_percent: u64,
}

const SUBJECTS: [Subject; 8] = [
    Subject { what: "one tick, r = 2", function: "counted_tick_2", run: ticks_2, calls: TICKS, above_percent: 0 },
    Subject { what: "one tick, r = 3", function: "counted_tick_3", run: ticks_3, calls: TICKS, above_percent: 0 },
    Subject {
        what: "64 lanes, r = 2, SSE2",
        function: "counted_sse2",
        run: || ticks_of_lanes(counted_sse2),
        calls: TICKS,
        above_percent: 2,
    },
    Subject {
        what: "64 lanes, r = 2, AVX2",
        function: "counted_avx2",
        run: || ticks_of_lanes(counted_avx2),
        calls: TICKS,
        above_percent: 2,
    },
    Subject {
        what: "64 closed loops, a tick, AVX2",
        function: "counted_loops",
        run: closed_loops,
        calls: LOOP_TICKS as u64,
        above_percent: 2,
    },
    Subject {
        what: "64 times Example 1, a tick, AVX2",
        function: "counted_example_1",
        run: example_1,
        calls: LOOP_TICKS as u64,
        above_percent: 2,
    },
    Subject {
        what: "64 motors with friction, a tick, AVX2",
        function: "counted_motors",
        run: motors,
        calls: MOTOR_TICKS,
        above_percent: 2,
    },
    Subject {
        what: "one closed-loop second",
        function: "closed_loop_second",
        run: || {
            black_box(second::closed_loop_second(&mut second::second()));
        },
        calls: 1,
        above_percent: 2,
    },
];

#[inline(never)]
fn counted_tick_2(joint: &Joint<f32, 2>, state: &mut <Joint<f32, 2> as ControlLaw>::State, x: &[f32; 4]) -> f32 {
    joint.tick(state, x).u
}

#[inline(never)]
fn counted_tick_3(joint: &Joint<f32, 3>, state: &mut <Joint<f32, 3> as ControlLaw>::State, x: &[f32; 4]) -> f32 {
    joint.tick(state, x).u
}

fn ticks_2() {
    let (joint, mut noise) = (black_box(joint::<2>()), Noise::new(1));
    let mut state = joint.start(&noise.sample()).expect("a finite sample");
    for _ in 0..TICKS {
        black_box(counted_tick_2(&joint, &mut state, &noise.sample()));
    }
}

fn ticks_3() {
    let (joint, mut noise) = (black_box(joint::<3>()), Noise::new(1));
    let mut state = joint.start(&noise.sample()).expect("a finite sample");
    for _ in 0..TICKS {
        black_box(counted_tick_3(&joint, &mut state, &noise.sample()));
    }
}

type TickAll = fn(&Joint<f32, 2>, &mut lanes::States, &[[f32; L]; 4], &mut [f32; L]);

fn ticks_of_lanes(tick: TickAll) {
    let (joint, mut noise) = (black_box(joint::<2>()), Noise::new(1));
    let state = joint.start(&noise.sample()).expect("a finite sample");
    let (mut states, mut u) = (state.lanes::<L>(), [0.0; L]);
    for _ in 0..TICKS {
        let all: [[f32; 4]; L] = std::array::from_fn(|_| noise.sample());
        let x = std::array::from_fn(|j| all.map(|x| x[j]));
        tick(&joint, &mut states, &x, &mut u);
        black_box(&u);
    }
}

/// Ticks of the vectorised loops, which share one start.
const LOOP_TICKS: usize = 2000;

fn closed_loops() {
    let experiment = second::second();
    let (campaign, trial) = experiment.beside().expect("a loop that fits");
    let campaign = Campaign { periods: LOOP_TICKS - 1, window_s: [1.0, 2.0], ..campaign };
    black_box(counted_loops(&campaign, &[trial; LANES]));
}

#[inline(never)]
fn counted_loops(campaign: &Campaign<'_>, trials: &[Trial<'_>]) -> Vec<Option<Judged>> {
    let judged = close_loops(campaign, trials);
    assert!(judged.iter().all(Option::is_some), "every loop fits");
    judged
}

/// Example 1 of part 2, whose plant takes solver steps.
fn example_1() {
    let text = include_str!("../../host-sim/scenarios/fig02.toml");
    let sets = ["span_s=0.2".into(), "window_s=[0.1, 0.2]".into()];
    let experiment =
        scenario::parse(&Source { file: "fig02.toml", text, sets: &sets }, "counted").expect("a good scenario");
    let (campaign, trial) = experiment.beside().expect("a loop that fits");
    let campaign = Campaign { periods: LOOP_TICKS - 1, ..campaign };
    black_box(counted_example_1(&campaign, &[trial; LANES]));
}

#[inline(never)]
fn counted_example_1(campaign: &Campaign<'_>, trials: &[Trial<'_>]) -> Vec<Option<Judged>> {
    let judged = close_loops(campaign, trials);
    assert!(judged.iter().all(Option::is_some), "every loop fits, of Example 1 too");
    judged
}

/// Ticks of drives with vectorised plants.
const MOTOR_TICKS: u64 = 201;

/// Motors with different parameter errors, so that every lane has its own times and steps.
fn motors() {
    let text = scenario::template("counted", "motor").expect("a name");
    let of = |l: usize| {
        let sets =
            ["span_s=0.2".into(), "window_s=[0.1, 0.2]".into(), format!("error.inertia_percent={}", l as f64 - 32.0)];
        scenario::parse(&Source { file: "motor.toml", text: &text, sets: &sets }, "counted").expect("a good scenario")
    };
    let mut experiments: Vec<Experiment> = (0..LANES).map(of).collect();
    counted_motors(&mut experiments);
}

#[inline(never)]
fn counted_motors(experiments: &mut [Experiment]) {
    let mut ignored = [(); LANES];
    let recorders = ignored.iter_mut().map(|recorder| recorder as &mut dyn Recorder);
    let endings = close_each(experiments.iter_mut().map(Experiment::setup).zip(recorders).collect());
    assert!(endings.iter().all(|ending| *ending == Ok(Ending::Finished)), "every loop goes to its end");
}

// Separate names: callgrind would stop at the next function with the counted name.
#[inline(never)]
fn counted_sse2(joint: &Joint<f32, 2>, states: &mut lanes::States, x: &[[f32; L]; 4], u: &mut [f32; L]) {
    lanes::lanes_baseline(joint, states, x, u);
}

#[inline(never)]
fn counted_avx2(joint: &Joint<f32, 2>, states: &mut lanes::States, x: &[[f32; L]; 4], u: &mut [f32; L]) {
    lanes::lanes_avx2(joint, states, x, u);
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let Some(name) = arguments.iter().find_map(|argument| argument.strip_prefix("--only=")) {
        SUBJECTS.iter().filter(|subject| subject.function == name).for_each(|subject| (subject.run)());
        return ExitCode::SUCCESS;
    }
    match run(arguments.iter().any(|argument| argument == "--record")) {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            println!("{reason}");
            ExitCode::FAILURE
        }
    }
}

/// Counts all subjects, and checks or records the counts.
fn run(is_record: bool) -> Result<(), String> {
    if Command::new("valgrind").arg("--version").output().is_err() {
        return Err(String::from("no valgrind here: the instructions of the host are NOT counted"));
    }
    let told = |error: &dyn std::fmt::Display| format!("{CEILINGS}: {error}");
    let ceilings = Ceilings::read(&fs::read_to_string(CEILINGS).map_err(|error| told(&error))?);
    let ceilings = ceilings.map_err(|error| told(&error))?;
    let mut counts = Vec::new();
    let mut good = true;
    println!("{:<26}{:>14}{:>14}", "instructions on the host", "counted", "ceiling");
    for subject in &SUBJECTS {
        let count = counted(subject).map_err(|reason| format!("{}: {reason}", subject.what))?;
        let ceiling = ceilings.of(subject.what).map_or_else(|| String::from("-"), |ceiling| ceiling.to_string());
        let verdict = ceilings.verdict(subject.what, count);
        println!("{:<26}{count:>14}{ceiling:>14}  {verdict}", subject.what);
        good &= verdict.is_empty();
        counts.push((subject.what, count + count * subject.above_percent / 100));
    }
    if is_record {
        let text = ceilings.recorded(THIS_COMPILER, &counts)?;
        return fs::write(CEILINGS, text).map_err(|error| told(&error));
    }
    if let Some(refusal) = ceilings.refusal(THIS_COMPILER) {
        return Err(refusal);
    }
    if good { Ok(()) } else { Err(String::from("a count is out of its ceiling")) }
}

/// Returns the instructions of one call.
fn counted(subject: &Subject) -> Result<u64, String> {
    let this = std::env::current_exe().map_err(|error| format!("this program has no path: {error}"))?;
    let out = std::env::temp_dir().join(format!("{}-{}.callgrind", subject.function, std::process::id()));
    let ran = Command::new("valgrind")
        .args(["--tool=callgrind", "--quiet", "--collect-atstart=no"])
        .arg(format!("--toggle-collect=*{}*", subject.function))
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(this)
        .arg(format!("--only={}", subject.function))
        .output();
    let ran = ran.map_err(|error| format!("valgrind could not be started: {error}"))?;
    if !ran.status.success() {
        return Err(format!("valgrind ended with {}: {}", ran.status, String::from_utf8_lossy(&ran.stderr).trim()));
    }
    let text = fs::read_to_string(&out).map_err(|error| format!("{}: {error}", out.display()))?;
    let _ = fs::remove_file(&out);
    let total: Option<u64> =
        text.lines().find_map(|line| line.strip_prefix("totals:")).and_then(|number| number.trim().parse().ok());
    match total {
        Some(total) if total > 0 => Ok(total / subject.calls),
        _ => Err(format!("callgrind counted nothing: is `{}` still a function of its own?", subject.function)),
    }
}
