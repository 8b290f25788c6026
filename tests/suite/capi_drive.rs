//! Bit-identity of the static library's drives, fences, plans and profiles with the Rust library, on this machine and
//! on the emulated cores.
//!
//! A drive runs next to the Rust tick around a simple plant, with the inputs of the exported drives (test module
//! `export_drive`). Counts wrap, exceed whole revolutions, are missing, outliers or frozen. Targets jump or are not
//! numbers. Currents saturate or differ from the command, and the drive restarts. In motion the drive switches to two
//! more designs and must reject a third. The tests need the output of `cargo xtask capi`.

use controller_core::drive::{
    BEYOND_CONTROL, BRAKING, Bounds, ChainModel, CoupledDrive, Encoder, EncoderForm, Fence, FenceLimits, Joint,
    JointBandwidths, JointDesign, JointDrive, Monitored, Motor, MotorDesign, MotorDrive, Position, Reference, Rest,
    Sample, Sine, Target, stop,
};
use controller_core::{ControlLaw as _, Fallback, Health, Limits, Output, RetuneError, Running};
use forms::Form;
use integration_tests::data::path;
use integration_tests::strategy::Rng;
use loop_sim::port::drive::{DriveDesign, DriveOf};
use scenario::{Experiment, Source};
use std::f64::consts::TAU;
use std::fs;
use std::process::Command;

use super::capi::{archive, emulated, include, source};
use super::export::{
    Board, CORTEX_M4F, EDGES, ON_THE_CHIP, ON_THE_HOST, Place, STM32F405, STRICT, answers, compile, folder,
    other_boards,
};
use super::export_drive::{Counters, HEALTHS, MovingGoal, Plant, STIFF, assert_exercised, target};
use super::export_plan::{Goal, Plan, any, is_number, onto};
use super::export_profile;

const TICK: u32 = 0;
const REPORT: u32 = 1;
const RESET: u32 = 2;
const RETUNE: u32 = 3;
const MISSED: u32 = 4;

const REJECTED: u32 = 1;
const NOT_FINITE: u32 = -6_i32 as u32;
const NOT_STARTED: u32 = -12_i32 as u32;

fn status_of(error: RetuneError) -> u32 {
    let status = match error {
        RetuneError::Sample => -13,
        RetuneError::GainNearDecay => -14,
        RetuneError::OffsetOutOfRange => -15,
        RetuneError::OtherEncoder => -16,
        _ => unreachable!("a reason that the header does not name"),
    };
    status as u32
}

/// Requests and expected answers.
struct Run {
    asked: Vec<u8>,
    expected: Vec<u32>,
    /// Words per answer; the words of the configurations precede the first answer.
    words: usize,
    configurations: usize,
}

/// Returns the numbers of a configuration in the layout of C.
fn configuration(numbers: &[f64], lag_or_load: f64, uncertain: f64, stops_at: Health) -> Vec<u32> {
    let all = numbers.iter().copied().chain([lag_or_load, uncertain, f64::from(stops_at.bits())]);
    all.flat_map(|number| [number.to_bits() as u32, (number.to_bits() >> 32) as u32]).collect()
}

const UNCERTAIN: [f64; 4] = [0.2, 0.2, 0.5, 0.2];
const STOPS_AT: [Health; 4] = [BRAKING, BRAKING, BEYOND_CONTROL, BRAKING];

/// Runs the designs of `drives.c`, which computes them from the data sheet.
fn motor<const FAST: usize, const LATE: usize>(ticks: usize, within: Option<FenceLimits>) -> Run {
    let motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
    let limits = Limits { min: -10.0, max: 8.0 };
    let lag_s = 3e-4;
    let by_rule = |period_s: f64, counts_per_turn: u32| {
        let encoder = Encoder { counts_per_turn, ..Encoder::absolute(14) };
        MotorDesign::by_rule(period_s, motor, encoder, limits).with_lag(lag_s, LATE as u32)
    };
    let first = by_rule(1e-3, 16384);
    let tuned =
        MotorDesign { fallback: Fallback::Safe(-0.25), ..first.with_surface(0.7 * first.bandwidths.surface_rad_s) };
    let designs = [first, tuned, by_rule(2e-3, 16384), by_rule(1e-3, 8192)];
    let laws = core::array::from_fn(|k| {
        let law = MotorDrive::<f32, Position, FAST, LATE>::try_design(&designs[k]).expect("a good design");
        let bounds: Bounds<1> = designs[k].bounds(&law, UNCERTAIN[k]);
        Monitored::new(law, &bounds).stopping_at(STOPS_AT[k])
    });
    let configurations = (0..4).flat_map(|k| configuration(&designs[k].to_numbers(), lag_s, UNCERTAIN[k], STOPS_AT[k]));
    let plant = Plant { gain: [0.0, motor.input_gain()], ..Plant::default() };
    let fence = within.map(|within| Fence::new(&within, first.slowing(LATE)));
    let design = (&laws, configurations.collect(), fence);
    run(&format!("motor {FAST} {LATE}"), design, [first.encoder.unit_rad()], plant, ticks)
}

fn joint<const FAST: usize, const LATE: usize>(ticks: usize, within: Option<FenceLimits>) -> Run {
    let joint = Joint {
        link_inertia_kg_m2: 0.23,
        link_damping_n_m_s: 0.07,
        weight_n_m: 0.23,
        stiffness_n_m: 9.0,
        motor_inertia_kg_m2: 9.31e-4,
        motor_damping_n_m_s: 0.07,
        torque_n_m_per_a: 0.119,
    };
    let (limits, load) = (Limits { min: -30.0, max: 25.0 }, 1.3);
    let by_rule = |period_s: f64, counts_per_turn: u32| {
        let encoders = [Encoder::absolute(20), Encoder { counts_per_turn, ..Encoder::absolute(18) }];
        let bandwidths = JointBandwidths::DEFAULT.within(period_s, LATE);
        JointDesign::new(period_s, joint, encoders, limits, load).with_bandwidths(bandwidths, load)
    };
    let first = by_rule(1e-3, 262_144);
    let slow = first.bandwidths.with_surface(0.7 * first.bandwidths.surface_rad_s);
    let tuned = JointDesign { fallback: Fallback::Safe(-0.25), ..first.with_bandwidths(slow.within(1e-3, LATE), load) };
    let designs = [first, tuned, by_rule(8e-4, 262_144), by_rule(1e-3, 131_072)];
    let laws = core::array::from_fn(|k| {
        let law = JointDrive::<f32, Position, FAST, LATE>::try_design(&designs[k]).expect("a good design");
        let bounds = designs[k].bounds(&law, load, UNCERTAIN[k]);
        Monitored::new(law, &bounds).stopping_at(STOPS_AT[k])
    });
    let configurations = (0..4).flat_map(|k| configuration(&designs[k].to_numbers(), load, UNCERTAIN[k], STOPS_AT[k]));
    let plant = joint_plant(&joint);
    let units = first.encoders.map(|encoder| encoder.unit_rad());
    let fence = within.map(|within| Fence::new(&within, first.slowing(LATE)));
    run(&format!("joint {FAST} {LATE}"), (&laws, configurations.collect(), fence), units, plant, ticks)
}

/// A harmonic drive designed as a whole, by the rule of the host; the second gain set as given.
fn stiff(fast: usize, late: usize) -> String {
    let fast_ratios = if fast > 0 { "fast_ratios = [1.6, 1.4]," } else { "" };
    format!(
        "{STIFF}
         encoder = {{ link = {{ bits = 19 }}, motor = {{ bits = 32, states = 4294967296, counts_per_turn = 16384 }} }}
         drive = {{ tuning = 'coupled', gain_sets = {}, {fast_ratios} delay_ticks = {late} }}
         monitor = {{ reaction = 'brake' }}",
        fast + 1
    )
}

const IT: &str = "it";

fn parsed(text: &str) -> (Experiment, Source<'_>) {
    let source = Source { file: IT, text, sets: &[] };
    (scenario::parse(&source, IT).unwrap_or_else(|error| panic!("{error}")), source)
}

/// The C file of a scenario for the archive: `exported_config`.
fn exported_config(text: &str) -> String {
    let (experiment, source) = parsed(text);
    forms::export(&experiment, &source, Form::Archive("exported")).unwrap_or_else(|error| panic!("{error}"))
}

fn coupled<const FAST: usize, const LATE: usize>(ticks: usize, within: Option<FenceLimits>) -> Run {
    let text = stiff(FAST, LATE);
    let (experiment, _) = parsed(&text);
    let designed = experiment.drive.as_ref().expect("a drive").designed;
    let DriveDesign::Joint(DriveOf { design: first, monitors, .. }) = designed else { panic!("a joint") };
    let load = monitors.sudden_load_n_m;
    let scaled = |design: JointDesign, by: f64| {
        let surface_rad_s = by * design.bandwidths.surface_rad_s;
        design.with_bandwidths(design.bandwidths.with_surface(surface_rad_s), load)
    };
    let mut coarse = first.encoders;
    coarse[1].counts_per_turn = 8192;
    let designs = [
        first,
        JointDesign { fallback: Fallback::Safe(-0.25), ..scaled(first, 0.7) },
        scaled(JointDesign { period_s: 8e-4, ..first }, 1.0),
        scaled(JointDesign { encoders: coarse, ..first }, 1.0),
    ];
    let laws: [_; 4] = core::array::from_fn(|k| {
        let law = CoupledDrive::<f32, Position, FAST, LATE>::try_design(&designs[k]).expect("a good design");
        let bounds = designs[k].bounds(&law, load, UNCERTAIN[k]);
        Monitored::new(law, &bounds).stopping_at(STOPS_AT[k])
    });
    // The first is the law that `host-sim run` ticks.
    assert_eq!(Some(laws[0].fingerprint()), experiment.port.fingerprint());
    let numbers = designs.map(|design| design.to_coupled_numbers().expect("a joint as a whole"));
    let configurations = (0..4).flat_map(|k| configuration(&numbers[k], load, UNCERTAIN[k], STOPS_AT[k]));
    let plant = joint_plant(&first.joint);
    let units = first.encoders.map(|encoder| encoder.unit_rad());
    let fence = within.map(|within| Fence::new(&within, first.slowing(LATE)));
    run(&format!("coupled {FAST} {LATE}"), (&laws, configurations.collect(), fence), units, plant, ticks)
}

fn joint_plant(joint: &Joint) -> Plant {
    let (link, rotor) = (joint.link_inertia_kg_m2, joint.motor_inertia_kg_m2);
    Plant {
        gain: [0.0, joint.torque_n_m_per_a / rotor],
        spring: [joint.stiffness_n_m / link, joint.stiffness_n_m / rotor],
        drag: [joint.link_damping_n_m_s / link, joint.motor_damping_n_m_s / rotor],
        weight: joint.weight_n_m / link,
        ..Plant::default()
    }
}

type Law<M, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize> =
    Monitored<EncoderForm<f32, M, Position, E, N, S, FAST, LATE>, E>;

fn run<M, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>(
    name: &str,
    (laws, configurations, fence): (&[Law<M, E, N, S, FAST, LATE>; 4], Vec<u32>, Option<Fence>),
    unit_rad: [f64; E],
    mut plant: Plant,
    ticks: usize,
) -> Run
where
    M: ChainModel<f32, E, N>,
{
    let mut rng = Rng::new(0xCA91 + name.bytes().map(u64::from).sum::<u64>());
    let mut running = Running::new(laws[0]);
    let mounting = [controller_core::drive::Mounting::UPRIGHT; E];
    let (mut wanted, mut counters) =
        (MovingGoal { part: if E == 1 { 1.0 } else { 0.2 }, angle: 0.0, speed: 0.0, bad_left: 0 }, Counters::default());
    let mut run =
        Run { asked: Vec::new(), words: 7 + 1 + 4 * E, configurations: configurations.len(), expected: configurations };
    let (mut seen, mut retuned, mut turns_gone, mut stopped, mut done) =
        (vec![0_usize; HEALTHS], [0_usize; 4], 0, false, 0);
    while done < ticks {
        let what = match rng.integer(0, 999) {
            // The operator notices the stop and resets the drive.
            50..=299 if stopped => RESET,
            0 if rng.chance(0.2) => RESET,
            5..=24 => REPORT,
            40..=49 => RETUNE,
            30..=31 => MISSED,
            _ => TICK,
        };
        if what == RESET {
            plant.find_zero(&mut counters);
        }
        wanted.begin_near(running.estimates().as_ref());
        let (turns, jets) = wanted.next(&mut rng);
        let (counts, lost) = counters.next(&mut rng, plant.steps(unit_rad), &mounting);
        let held =
            if rng.chance(0.03) { EDGES[rng.integer(0, EDGES.len() - 1)] } else { rng.within(-10.0, 10.0) as f32 };
        let which = if what == MISSED { rng.integer(0, 63) } else { *rng.one_of(&[0, 1, 1, 2, 3]) };
        let sample = Sample {
            counts: core::array::from_fn(|i| (!lost[i]).then_some(counts[i])),
            begin: target(turns[0], jets[0]),
            end: target(turns[1], jets[1]),
        };
        let said = match what {
            REPORT | MISSED if running.estimates().is_none() => NOT_STARTED,
            REPORT if running.report_applied(held) => 0,
            REPORT => NOT_FINITE,
            MISSED => {
                running.missed(which as u32);
                0
            }
            RESET => {
                running.reset();
                0
            }
            RETUNE => match running.retune(laws[which], &sample) {
                Ok(()) => {
                    retuned[which] += usize::from(running.estimates().is_some());
                    0
                }
                Err(error) => status_of(error),
            },
            _ => 0,
        };
        let (mut ticked, mut output) = (0, Output { u: 0.0, sigma: 0.0, sigma_star: 0.0, health: Health::OK });
        if what == TICK || what == RETUNE {
            output = running.tick(&sample);
            ticked = if output.health.contains(Health::INPUT_REJECTED) { REJECTED } else { 0 };
            if let Some(fence) = &fence {
                fence.guard(&mut running, &mut output, &sample.begin);
            }
            done += 1;
            seen[usize::from(output.health.bits())] += 1;
            stopped = output.health.contains(Health::STOPPED);
            plant.advance(f64::from(output.u));
        }
        let asked = [what, which as u32, u32::from(lost[0]) | u32::from(lost[1]) << 1].into_iter();
        let asked = asked.chain(counts.map(|count| count as u32)).chain(turns.map(|turn| turn as u32));
        let asked = asked.chain(jets.as_flattened().iter().map(|number| number.to_bits())).chain([held.to_bits()]);
        run.asked.extend(asked.flat_map(u32::to_le_bytes));
        run.expected.extend([said, ticked]);
        run.expected.extend([output.u, output.sigma, output.sigma_star].map(f32::to_bits));
        run.expected.push(u32::from(output.health.bits()));
        let known = running.estimates();
        run.expected.push(if known.is_some() { 0 } else { NOT_STARTED });
        run.expected.push(known.as_ref().map_or(0, |known| known.turn as u32));
        for i in 0..E {
            let of = known
                .as_ref()
                .map_or([0.0; 4], |known| [known.position[i], known.speed[i], known.disturbance[i], known.load[i]]);
            run.expected.extend(of.map(f32::to_bits));
        }
        turns_gone = turns_gone.max(known.map_or(0, |known| known.turn.unsigned_abs().min(1000)));
    }
    if fence.is_some() {
        assert_fenced(name, &seen);
        return run;
    }
    assert_exercised(name, done, &seen, turns_gone);
    println!("{name}: designs taken over in motion {retuned:?}");
    // The last design uses another encoder and must be rejected.
    assert!(retuned[..3].iter().all(|&times| times > ticks / 5000), "{name}: {retuned:?}");
    run
}

/// Checks that every limit is exceeded sometimes, and that the drive also works within them.
fn assert_fenced(name: &str, seen: &[usize]) {
    let with = |flag: Health| -> usize {
        let of = seen.iter().enumerate();
        of.filter(|(bits, _)| bits & usize::from(flag.bits()) != 0).map(|(_, ticks)| ticks).sum()
    };
    let broken = [Health::OVERSPEED, Health::FOLLOWING_ERROR, Health::END_OF_RANGE].map(with);
    println!("{name}: speed, error, range broken in {broken:?} ticks, {} without anything", seen[0]);
    assert!(broken.iter().all(|&ticks| ticks > 5) && seen[0] > 500, "{name}: {broken:?}, {}", seen[0]);
}

/// Drive of the library: its name, and a run of this many ticks with or without limits.
type Drive = (&'static str, fn(usize, Option<FenceLimits>) -> Run);

const DRIVES: [Drive; 12] = [
    ("motor", motor::<0, 0>),
    ("motor_fast", motor::<1, 0>),
    ("motor_late", motor::<0, 1>),
    ("motor_fast_late", motor::<1, 1>),
    ("joint", joint::<0, 0>),
    ("joint_fast", joint::<1, 0>),
    ("joint_late", joint::<0, 1>),
    ("joint_fast_late", joint::<1, 1>),
    ("coupled", coupled::<0, 0>),
    ("coupled_fast", coupled::<1, 0>),
    ("coupled_late", coupled::<0, 1>),
    ("coupled_fast_late", coupled::<1, 1>),
];

/// Returns the configuration file of a drive that is designed from an exported one.
fn config_of(name: &str) -> Option<String> {
    let form = name.strip_prefix("coupled")?;
    Some(exported_config(&stiff(usize::from(form.contains("_fast")), usize::from(form.contains("_late")))))
}

/// Runs a program of `tests/capi` with the library for a place; returns the words of its answers.
fn said(kind: &str, name: &str, program: &str, options: &[&str], asked: &[u8], place: Place) -> Vec<u32> {
    let (machine, of) = match place {
        Place::Here => ("host", "host"),
        Place::On(board) => (board.machine, archive_for(board)),
    };
    let transfer = if place == Place::Here { ON_THE_HOST } else { ON_THE_CHIP };
    let folder = folder(&format!("capi-{kind}-{machine}{}", options.concat())).join(name);
    fs::create_dir_all(&folder).expect("a folder");
    let program = format!("{transfer}\n{program}");
    let (include, archive) = (include(), archive(of));
    let here: &[&str] = if place == Place::Here { &["-lm"] } else { &["-Wl,--gc-sections"] };
    let options = [options, here, &[&*include, &*archive]].concat();
    let answered = answers(&folder, &program, &options, asked, place);
    fs::remove_dir_all(&folder).expect("the folder goes");
    answered
}

/// Returns the folder of the library for a core.
fn archive_for(board: &Board) -> &'static str {
    match board.machine {
        "microbit" => "thumbv6m",
        "mps2-an385" | "mps2-an386" => "thumbv7m",
        "mps2-an505" => "thumbv8m",
        _ => "thumbv7em",
    }
}

fn held_together(name: &str, answered: &[u32], expected: &[u32], words: usize) {
    assert_eq!(answered.len(), expected.len(), "{name}: words of the answers");
    let is_nan = |word: u32| f32::from_bits(word).is_nan();
    for (k, (c, rust)) in answered.chunks(words).zip(expected.chunks(words)).enumerate() {
        let alike = c.iter().zip(rust).all(|(&c, &rust)| c == rust || is_nan(c) && is_nan(rust));
        assert!(alike, "{name}, answer {k}\nC:    {c:08x?}\nRust: {rust:08x?}");
    }
}

fn compare(drives: &[Drive], ticks: usize, options: &[&str], place: Place) {
    for (name, run) in drives {
        compare_one(("drives", name), run(ticks, None), "", options, place);
    }
}

/// Compares drives under limits that are exceeded now and then.
fn compare_fenced(drives: &[Drive], ticks: usize, options: &[&str], place: Place) {
    let limits = FenceLimits { low_rad: f64::NEG_INFINITY, high_rad: 3.0, max_speed_rad_s: 40.0, following_rad: 0.5 };
    let FenceLimits { high_rad, max_speed_rad_s, following_rad, .. } = limits;
    let defines = format!(
        "#include <math.h>\n#define FENCED\n#define LOW_RAD -INFINITY\n#define HIGH_RAD {high_rad:?}\n\
         #define MAX_SPEED_RAD_S {max_speed_rad_s:?}\n#define FOLLOWING_RAD {following_rad:?}\n"
    );
    for (name, run) in drives {
        compare_one(("fenced", name), run(ticks, Some(limits)), &defines, options, place);
    }
}

fn compare_one((kind, name): (&str, &str), run: Run, defines: &str, options: &[&str], place: Place) {
    let Run { asked, expected, words, configurations } = run;
    let (config, plant) = match config_of(name) {
        Some(config) => (config, "COUPLED"),
        None => (String::new(), if name.starts_with("motor") { "MOTOR" } else { "JOINT" }),
    };
    let (drives, head) = (source("drives.c"), format!("{defines}{config}"));
    let program = format!("{head}#define NAME {name}\n#define {plant}\n#include \"{drives}\"\n");
    let answered = said(kind, name, &program, options, &asked, place);
    assert_eq!(answered.get(..configurations), expected.get(..configurations), "{name}: by rule");
    held_together(name, &answered[configurations..], &expected[configurations..], words);
}

#[test]
fn every_drive_of_the_archive_designs_ticks_and_is_retuned_to_the_bits_of_rust() {
    compare(&DRIVES, 100_000, &["-O1"], Place::Here);
}

#[test]
fn a_drive_of_the_archive_gives_its_bits_on_the_emulated_chip() {
    // Retuning requests need a multiplication from the compiler's library.
    compare(&DRIVES, 20_000, &["-O2", "-lgcc"], Place::On(&STM32F405));
}

#[test]
fn every_drive_of_the_archive_is_tripped_by_its_fence_as_in_rust() {
    compare_fenced(&DRIVES, 50_000, &["-O1"], Place::Here);
}

#[test]
fn a_fence_of_the_archive_gives_its_bits_on_the_emulated_chip() {
    compare_fenced(&DRIVES, 30_000, &["-O2", "-lgcc"], Place::On(&STM32F405));
}

#[test]
fn a_drive_of_the_archive_gives_its_bits_on_other_cores() {
    for board in other_boards() {
        compare(&[DRIVES[1], DRIVES[7], DRIVES[11]], 20_000, &["-O2"], Place::On(board));
    }
}

const REST: u32 = 0;
const MOVE: u32 = 1;
const STOP: u32 = 2;
const SINE: u32 = 3;
const PLANS: usize = 20_000;
/// Ticks at which each plan is evaluated.
const ASKED: usize = 5;

/// Runs plans, in flight, accepted and rejected.
fn plans<const M: usize, const N: usize>(period_s: f64) -> Run {
    let mut rng = Rng::new(0x91A5 + M as u64);
    let mut run = Run { asked: Vec::new(), expected: Vec::new(), words: 1 + ASKED * (1 + N), configurations: 0 };
    let mut plan: Plan<M> = Plan::At(Goal::Rest(Rest { turn: 0, angle: 0.0 }));
    let (mut now, mut taken) = (1_u32, [[0_usize; 2]; 4]);
    for _ in 0..PLANS {
        let what = *rng.one_of(&[REST, MOVE, MOVE, STOP, SINE, SINE]);
        now = if rng.chance(0.01) { rng.bits() as u32 } else { now.wrapping_add(rng.integer(0, 3000) as u32) };
        let ticks = match rng.integer(0, 19) {
            0 => *rng.one_of(&[0, 1, 2, (1 << 24) - 1, 1 << 24, (1 << 24) + 1, u32::MAX]),
            _ => rng.integer(2, 2000) as u32,
        };
        let turn = if rng.chance(0.05) { rng.bits() as i32 } else { rng.integer(0, 40) as i32 - 20 };
        let angle = any(&mut rng, 4.0);
        let [mut amplitude, mut omega] = [rng.within(-3.0, 3.0), rng.spread(1e-2, 200.0)];
        if rng.chance(0.1) {
            amplitude = f64::from(any(&mut rng, 5e3));
        }
        if rng.chance(0.1) {
            omega = rng.spread(1e-9, 1e14);
        }
        let present: Target<f32, i32, M> = plan.at(now);
        let onto = |goal, ticks| onto(goal, &present, now, ticks, period_s);
        let new = match what {
            REST => is_number(f64::from(angle)).then_some(Plan::At(Goal::Rest(Rest { turn, angle }))),
            MOVE if is_number(f64::from(angle)) => onto(Goal::Rest(Rest { turn, angle }), ticks),
            MOVE => None,
            STOP => {
                let (goal, taken) = stop(&present, ticks, period_s);
                let way = onto(Goal::Rest(goal), taken).filter(|_| is_number(f64::from(goal.angle)));
                way.filter(|_| (1..=1 << 24).contains(&ticks))
            }
            _ => {
                let phase = omega * period_s / TAU * 2_f64.powi(32) + 0.5;
                let good = (1.0..2_f64.powi(31)).contains(&phase) && is_number(amplitude);
                good.then(|| Goal::Sine(Sine::new(amplitude, omega, period_s))).and_then(|goal| onto(goal, ticks))
            }
        };
        taken[what as usize][usize::from(new.is_some())] += 1;
        run.expected.push(u32::from(new.is_some()));
        plan = new.unwrap_or(plan);
        let end = now.wrapping_add(ticks);
        let within = now.wrapping_add(rng.integer(0, ticks.min(1 << 20) as usize) as u32);
        let at = [now, within, end.wrapping_sub(1), end, end.wrapping_add(rng.bits() as u32 >> 16)];
        for tick in at {
            let Target { turn, jet } = plan.at(tick);
            run.expected.push(turn as u32);
            run.expected.extend(jet[..N].iter().map(|number| number.to_bits()));
        }
        run.asked.extend([amplitude, omega, period_s].into_iter().flat_map(f64::to_le_bytes));
        let words = [what, now, ticks, turn as u32, angle.to_bits()].into_iter().chain(at);
        run.asked.extend(words.flat_map(u32::to_le_bytes));
    }
    println!("rests, moves, stops, sines refused and taken: {taken:?}");
    for [refused, taken] in &taken {
        assert!(*refused > 20 && *taken > 1500, "every answer is asked for");
    }
    run
}

fn compare_plans(options: &[&str], place: Place) {
    let (motor, joint) = (plans::<3, 2>(1e-3), plans::<4, 4>(2e-4));
    for (name, define, Run { asked, expected, words, .. }) in [("motor", "MOTOR", motor), ("joint", "JOINT", joint)] {
        let program = format!("#define NAME {name}\n#define {define}\n#include \"{}\"\n", source("plans.c"));
        held_together(name, &said("plans", name, &program, options, &asked, place), &expected, words);
    }
}

#[test]
fn a_plan_of_the_archive_gives_the_bits_of_the_rust_one() {
    compare_plans(&["-O1"], Place::Here);
}

#[test]
fn a_plan_of_the_archive_gives_its_bits_on_the_emulated_chip() {
    compare_plans(&["-O2"], Place::On(&STM32F405));
}

/// Ticks of each average that a profile of the library has memory for, as in the header.
const WINDOW: usize = 128;

fn compare_profiles(options: &[&str], place: Place) {
    let motor = export_profile::run::<2, 2, { 2 * WINDOW }>(1e-3);
    let joint = export_profile::run::<3, 4, { 3 * WINDOW }>(2e-4);
    for (name, define, derivatives, mut run) in [("motor", "MOTOR", 2, motor), ("joint", "JOINT", 4, joint)] {
        let words = 4 + derivatives;
        for (answer, status) in run.answers.chunks_mut(words).zip(&run.statuses) {
            answer[0] = *status;
        }
        let program = format!("#define NAME {name}\n#define {define}\n#include \"{}\"\n", source("profiles.c"));
        held_together(name, &said("profiles", name, &program, options, &run.asked, place), &run.answers, words);
    }
}

#[test]
fn a_profile_of_the_archive_gives_the_bits_of_the_rust_one() {
    compare_profiles(&["-O1"], Place::Here);
}

#[test]
fn a_profile_of_the_archive_gives_its_bits_on_the_emulated_chip() {
    compare_profiles(&["-O2"], Place::On(&STM32F405));
}

#[test]
fn a_profile_of_the_archive_gives_its_bits_on_other_cores() {
    for board in other_boards() {
        compare_profiles(&["-O2"], Place::On(board));
    }
}

/// Simulated plant of `drive.c`, operation by operation.
#[derive(Default)]
struct StandIn {
    angle: [f32; 2],
    speed: [f32; 2],
    counts: [i32; 2],
    advanced: u32,
}

impl StandIn {
    fn advance(&mut self, current: f32) {
        let (t, x) = (2.5e-4_f32, self.angle[0]);
        let xx = x * x;
        let sine = x * (1.0 - xx * (1.0 / 6.0 - xx * (1.0 / 120.0 - xx * (1.0 / 5040.0))));
        let torsion = 9.0 * (self.angle[1] - x);
        let load = if self.advanced / 4000 % 2 == 1 { 0.3 } else { 0.0 };
        let friction = 0.05 * (100.0 * self.speed[1]).clamp(-1.0, 1.0);
        self.speed[0] += t * ((torsion - 0.07 * self.speed[0] - 0.23 * sine - load) / 0.23);
        self.speed[1] += t * ((0.119 * current - torsion - 0.07 * self.speed[1] - friction) / 931e-6);
        for i in 0..2 {
            self.angle[i] += t * self.speed[i];
            if i == 1 || self.advanced < BROKEN {
                self.counts[i] = (self.angle[i] * 166_886.05) as i32;
            }
        }
        self.advanced += 1;
    }
}

/// Ticks of `drive.c`: until the retune, until the link encoder fails, and in total.
const TUNED: u32 = 5800;
const BROKEN: u32 = 12_600;
const LAST: u32 = 13_600;

/// Returns the last lines of `drive.c`. With the library it retunes between its moves.
fn said_by_drive_c(tuned: bool) -> [String; 3] {
    let joint = Joint {
        link_inertia_kg_m2: 0.23,
        link_damping_n_m_s: 0.07,
        weight_n_m: 0.23,
        stiffness_n_m: 9.0,
        motor_inertia_kg_m2: 931e-6,
        motor_damping_n_m_s: 0.07,
        torque_n_m_per_a: 0.119,
    };
    let (period_s, load) = (2.5e-4, 1.3);
    let law = |surface_rad_s: f64| {
        // Bandwidths by rule from the data sheet, then scaled in proportion.
        let bandwidths = JointBandwidths::DEFAULT.within(period_s, 0).with_surface(surface_rad_s);
        let design = JointDesign {
            fallback: Fallback::Safe(0.0),
            ..JointDesign::new(period_s, joint, [Encoder::absolute(20); 2], Limits::symmetric(30.0), load)
                .with_bandwidths(bandwidths.within(period_s, 0), load)
        };
        let law = JointDrive::<f32, Position, 1>::try_design(&design).expect("a good design");
        let bounds = design.bounds(&law, load, 0.2);
        Monitored::new(law, &bounds).stopping()
    };
    let mut running = Running::new(law(20.0));
    let mut plan: Plan<4> = Plan::At(Goal::Rest(Rest { turn: 0, angle: 0.0 }));
    let moves = [(400, 1.0, 4000), (6400, -0.5, 5600), (9600, 0.5, 6400)];
    let (mut stand_in, mut end) = (StandIn::default(), Target { turn: 0, jet: [0.0; 4] });
    let (mut sum, mut stopped, mut health, mut worst) = (0x811c_9dc5_u32, 0, Health::OK, 0.0_f32);
    let (mut u, mut jump) = (0.0_f32, 0.0);
    for tick in 0..LAST {
        if let Some((start, angle, ticks)) = moves.into_iter().find(|(start, ..)| tick + 1 == *start) {
            let goal = Goal::Rest(Rest { turn: 0, angle });
            plan = onto(goal, &plan.at(start), start, ticks, period_s).expect("a good plan");
        }
        let begin = core::mem::replace(&mut end, plan.at(tick + 1));
        if tick < BROKEN {
            worst = worst.max((stand_in.angle[0] - begin.jet[0]).abs());
        }
        let sample = Sample { counts: stand_in.counts.map(Some), begin, end };
        if tuned && tick + 1 == TUNED {
            running.retune(law(16.0), &sample).expect("taken over");
        }
        let output = running.tick(&sample);
        if tick + 1 == TUNED {
            jump = (output.u - u).abs();
        }
        u = output.u;
        health |= output.health;
        if output.health.contains(Health::STOPPED) && stopped == 0 {
            stopped = tick;
        }
        sum = (sum ^ output.u.to_bits()).wrapping_mul(0x0100_0193);
        stand_in.advance(output.u);
    }
    // The drive follows under load and friction, retunes without a jump, and ends as reported.
    assert!(worst < 1.7e-3, "{worst} rad");
    assert!(jump < 0.05, "{jump} A");
    assert_eq!(health, Health::STOPPED | Health::SAMPLE_LOST | Health::INPUT_REJECTED | Health::WAITS);
    assert!((BROKEN..BROKEN + 60).contains(&stopped), "{stopped}");
    [format!("stopped at tick {stopped}"), format!("health {:08x}", health.bits()), format!("sum {sum:08x}")]
}

/// Every current of `drive.c`, as a sum over its bits, and the final position.
#[test]
fn the_drive_in_c_on_the_chip_has_the_currents_of_rust_and_stops_without_its_encoder() {
    for (image, tuned) in [("drive", true), ("drive-nostdlib", true), ("drive-standalone", false)] {
        let said = emulated(&format!("examples/c/build/{image}.elf"));
        assert_eq!(said.get(said.len() - 3..), Some(&said_by_drive_c(tuned)[..]), "{image}: {said:?}");
        let rows = said.iter().filter(|line| line.split_whitespace().all(|word| word.parse::<f32>().is_ok()));
        assert_eq!(rows.count(), 33, "{image}: {said:?}");
    }
}

/// A motor that stands at 0.7 rad, and no move: prints its angle and the largest current of a second.
const STANDS: &str = "
#include <math.h>
#include <stdio.h>
static double angle = 0.7, speed;
static float largest;
uint32_t encoder_register(void) { return (uint32_t)(int32_t)floor(angle * 16384 / 6.283185307179586); }
bool encoder_is_good(void) { return true; }
float set_current(float ampere)
{
    largest = fmaxf(largest, fabsf(ampere));
    speed += 1e-3 * 0.05 * ampere / 2e-4;
    angle += 1e-3 * speed;
    return ampere;
}
int main(void)
{
    if (!start_drive()) {
        return 1;
    }
    for (int k = 0; k < 1000; k++) {
        control_interrupt();
    }
    printf(\"%g %g\\n\", angle, (double)largest);
    return 0;
}
";

/// The program of docs/c.md, "Static library": it compiles, and at a start it holds the shaft where it is.
#[test]
fn the_drive_of_the_docs_compiles_here_and_for_the_chip_and_holds_its_place() {
    let page = fs::read_to_string(path("../docs/c.md")).expect("the page");
    let section = page.split_once("### A drive\n").expect("the section").1;
    let program = section.split_once("```c\n").expect("a program").1.split_once("```").expect("its end").0;
    let (folder, include) = (folder("capi-docs"), include());
    let source = folder.join("user.c");
    fs::write(&source, program).expect("the program");
    for (compiler, options) in [("cc", &[][..]), ("arm-none-eabi-gcc", &CORTEX_M4F)] {
        let object = folder.join(format!("{compiler}.o"));
        compile(compiler, &[&STRICT, options, &["-Wconversion", "-O2", "-c", &*include]].concat(), &source, &object);
    }
    let (stands, made) = (folder.join("stands.c"), folder.join("stands"));
    fs::write(&stands, [program, STANDS].concat()).expect("the program");
    let archive = archive("host");
    compile("cc", &["-std=c99", "-O2", &*include, &*archive, "-lm"], &stands, &made);
    let said = Command::new(&made).output().expect("it runs").stdout;
    let said = String::from_utf8_lossy(&said);
    let numbers: Vec<f64> = said.split_whitespace().map(|number| number.parse().expect("a number")).collect();
    assert!((numbers[0] - 0.7).abs() < 1e-3 && numbers[1] < 1.0, "{said}");
}

/// The words of an exported configuration are those of the scenario's design, and the archive takes it.
#[test]
fn an_exported_configuration_is_the_drive_of_its_scenario() {
    let motor = "motor = { inertia_kg_m2 = 2e-4, torque_n_m_per_a = 0.05, max_current_a = 10 }
        encoder = { bits = 12, reversed = true, offset_counts = -700 }
        drive = { fallback = -0.25, delay_ticks = 1 }
        limits = { low_rad = -3 }
        monitor = { reaction = 'joined_stop', stop_s = 0.05 }";
    let joint =
        "joint = { link_inertia_kg_m2 = 0.23, link_damping_n_m_s = 0.07, weight_n_m = 0.23, stiffness_n_m = 9.0,
        motor_inertia_kg_m2 = 9.31e-4, motor_damping_n_m_s = 0.07, torque_n_m_per_a = 0.119, max_current_a = 30 }
        encoder = { link = { bits = 20 }, motor = { bits = 20 } }";
    for (name, text) in [("motor_fast_late", motor.into()), ("joint_fast", joint.into()), ("coupled", stiff(0, 0))] {
        let (experiment, _) = parsed(&text);
        let drive = experiment.drive.as_ref().expect("a drive");
        let stops_at = drive.designed.reaction().stops_at();
        let expected = match drive.designed {
            DriveDesign::Motor(DriveOf { design, monitors, .. }) => {
                configuration(&design.to_numbers(), drive.current_lag_s, monitors.uncertain, stops_at)
            }
            DriveDesign::Joint(DriveOf { design, monitors, .. }) => {
                let numbers = design.to_coupled_numbers().map_or_else(|| design.to_numbers().to_vec(), Vec::from);
                configuration(&numbers, monitors.sudden_load_n_m, monitors.uncertain, stops_at)
            }
        };
        let header = exported_config(&text);
        assert!(header.lines().all(|line| line.len() <= 120 || line.starts_with("#error ")), "{header}");
        assert_eq!(name == "motor_fast_late", header.contains("pass (uint32_t)-700 - register"), "{header}");
        assert_eq!(name == "motor_fast_late", header.contains("exported_limits"), "{header}");
        let program = PRINTS.replace("NAME", name);
        let folder = folder("capi-config").join(name);
        fs::create_dir_all(&folder).expect("a folder");
        fs::write(folder.join("config.h"), header).expect("a header");
        let (include, archive) = (include(), archive("host"));
        for (compiler, language, file) in [("cc", "-std=c99", "main.c"), ("c++", "-std=c++20", "main.cpp")] {
            let (file, made) = (folder.join(file), folder.join("main"));
            fs::write(&file, &program).expect("a program");
            let options = [language, "-Wall", "-Wextra", "-Werror", "-pedantic", &*include, &*archive];
            compile(compiler, &options, &file, &made);
            let ran = Command::new(&made).output().expect("it runs");
            let said = String::from_utf8(ran.stdout).expect("a text");
            let words: Vec<u32> = said.lines().map(|line| line.parse().expect("a word")).collect();
            assert_eq!(words, expected, "{name} by {compiler}");
            assert!(ran.status.success(), "{name} by {compiler}: {}", ran.status);
        }
    }
}

/// Prints a configuration word by word, and designs the drive and a fence from it.
const PRINTS: &str = "#include <stdio.h>
#include <string.h>
#include \"config.h\"
static edo_smc_design_NAME_t design;
static edo_smc_fence_t fence;
int main(void) {
    static const edo_smc_fence_limits_t limits = {-1.0, 1.0, 10.0, 1.0};
    uint32_t words[sizeof exported_config / 4];
    size_t i;
    memcpy(words, &exported_config, sizeof words);
    for (i = 0; i < sizeof words / 4; i++) printf(\"%lu\\n\", (unsigned long)words[i]);
    return edo_smc_design_NAME(&exported_config, sizeof exported_config, &design, sizeof design, NULL) != EDO_SMC_OK ||
           edo_smc_fence_NAME(&exported_config, sizeof exported_config, &limits, &fence, sizeof fence, NULL) !=
               EDO_SMC_OK;
}
";
