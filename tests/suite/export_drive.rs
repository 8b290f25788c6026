//! Bit-identity of an exported drive with the drive that it was exported from.
//!
//! Every instance below is exported, compiled by the host's C compiler with all warnings as errors, and run next to the
//! Rust tick around a simple plant. Counts wrap and exceed whole revolutions; some are missing, outliers or frozen.
//! Targets jump or are not numbers, the actuator applies other currents, and the drive restarts or gets empty ticks.
//! After every tick the test compares every bit of u, sigma, sigma*, health, estimates and state.

use controller_core::drive::{
    Aim, Bounds, ChainModel, CoupledDrive, DriveError, DriveEstimates, DriveLaw, EncoderForm, Fence, JointDesign,
    JointDrive, Monitored, MotorDesign, MotorDrive, Mounting, Position, RestBand, Resting, Sample, Speed, Target,
    Watched,
};
use controller_core::{ControlLaw, Health, Output, Running};
use integration_tests::data::path;
use integration_tests::sampled;
use integration_tests::strategy::Rng;
use loop_sim::port::drive::{DriveDesign, DriveOf, Reaction};
use scenario::Source;
use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::process::Command;

use super::export::{
    CORTEX_M4F, EDGES, ON_THE_CHIP, ON_THE_HOST, Place, QUICK, STM32F405, STRICT, answers, compile, exported, folder,
    other_boards, plain, said_by_exported_rust,
};

/// Ticks per instance; all instances together run a million.
const TICKS: usize = 1_000_000_usize.div_ceil(INSTANCES.len());

const MOTOR: &str =
    "motor = { inertia_kg_m2 = 2e-4, torque_n_m_per_a = 0.05, max_current_a = 10, damping_n_m_s = 1e-5 }";
const GEARED: &str = "motor = { inertia_kg_m2 = 2e-5, torque_n_m_per_a = 0.05, max_current_a = 5, gear = [37, 10],
    load_inertia_kg_m2 = 1e-4 }";
const JOINT: &str = "joint = { link_inertia_kg_m2 = 0.23, link_damping_n_m_s = 0.07, weight_n_m = 0.23,
    stiffness_n_m = 9.0, motor_inertia_kg_m2 = 9.31e-4, motor_damping_n_m_s = 0.07, torque_n_m_per_a = 0.119,
    max_current_a = 30 }";

/// A harmonic drive.
pub(super) const STIFF: &str = "joint = { link_inertia_kg_m2 = 0.4, link_damping_n_m_s = 0.5, weight_n_m = 10,
    stiffness_n_m = 8000.0, motor_inertia_kg_m2 = 1.2e-4, motor_damping_n_m_s = 2e-4, torque_n_m_per_a = 0.08,
    max_current_a = 8, gear = [100, 1] }";

/// Scenario in two parts, and its Rust drive.
type Instance = (&'static str, &'static str, &'static str, fn(&str, &str) -> Run);

const INSTANCES: [Instance; 19] = [
    (
        "two_sets",
        MOTOR,
        "encoder = { bits = 14 }
         monitor = { reaction = 'brake' }
         limits = { low_rad = -30, high_rad = 40, max_speed_rad_s = 60, following_error_rad = 20 }",
        motor::<Position, 1, 0, 3>,
    ),
    (
        "one_set",
        MOTOR,
        "encoder = { bits = 12, reversed = true, offset_counts = 700 }
         drive = { uncertain_percent = 50, fallback = -0.25, lost_ticks = 3 }
         monitor = { reaction = 'fallback' }",
        motor::<Position, 0, 0, 3>,
    ),
    (
        "late",
        MOTOR,
        "encoder = { bits = 24 }\ndrive = { delay_ticks = 1 }\nmonitor = { reaction = 'brake' }",
        motor::<Position, 1, 1, 3>,
    ),
    (
        "one_set_late",
        MOTOR,
        "encoder = { bits = 16, states = 4000, counts_per_turn = 4000 }\n\
         drive = { delay_ticks = 1, uncertain_percent = 30 }",
        motor::<Position, 0, 1, 3>,
    ),
    ("four_states", MOTOR, "encoder = { bits = 20 }\ndrive = { observer_states = 4 }", motor::<Position, 1, 0, 4>),
    (
        "late3",
        MOTOR,
        "encoder = { bits = 14 }\ndrive = { delay_ticks = 3, uncertain_percent = 30, fallback = 0.5 }
         monitor = { reaction = 'brake' }",
        motor::<Position, 0, 3, 3>,
    ),
    (
        "late2",
        MOTOR,
        "encoder = { bits = 20 }\ndrive = { delay_ticks = 2 }\nmonitor = { reaction = 'brake' }
         limits = { low_rad = -30, high_rad = 40 }",
        motor::<Position, 1, 2, 3>,
    ),
    (
        "geared",
        GEARED,
        "encoder = { bits = 12, reversed = true }\ndrive = { lost_ticks = 5 }",
        motor::<Position, 1, 0, 3>,
    ),
    (
        "speed",
        MOTOR,
        "encoder = { bits = 14, offset_counts = -5 }\ndrive = { mode = 'speed' }
         reference = { kind = 'speed', speed_rad_s = 20 }
         monitor = { reaction = 'brake' }
         limits = { low_rad = -20, high_rad = 45, max_speed_rad_s = 50 }",
        motor::<Speed, 1, 0, 3>,
    ),
    (
        "speed_late",
        GEARED,
        "encoder = { bits = 32, states = 4294967296, counts_per_turn = 4096 }
         drive = { mode = 'speed', delay_ticks = 1, uncertain_percent = 30, observer_states = 4 }
         reference = { kind = 'speed', speed_rad_s = 20 }",
        motor::<Speed, 0, 1, 4>,
    ),
    (
        "speed_late3",
        MOTOR,
        "encoder = { bits = 14 }
         drive = { mode = 'speed', delay_ticks = 3, observer_states = 4 }
         reference = { kind = 'speed', speed_rad_s = 20 }",
        motor::<Speed, 1, 3, 4>,
    ),
    (
        "joint",
        JOINT,
        "encoder = { link = { bits = 20 }, motor = { bits = 20, reversed = true, offset_counts = 77 } }
         drive = { lost_ticks = 8 }
         monitor = { reaction = 'brake' }",
        joint::<1, 0>,
    ),
    (
        "joint_one_set",
        JOINT,
        "encoder = { link = { bits = 14, offset_counts = 16000 }, motor = { bits = 12 } }
         drive = { uncertain_percent = 30, accept_unstable = true, fallback = 1.5 }
         monitor = { reaction = 'joined_stop', stop_s = 0.05 }",
        joint::<0, 0>,
    ),
    (
        "joint_late",
        JOINT,
        "encoder = { link = { bits = 24 }, motor = { bits = 16, states = 65536, counts_per_turn = 4000 } }
         drive = { delay_ticks = 1 }
         monitor = { reaction = 'fallback' }
         limits = { low_rad = -3 }",
        joint::<1, 1>,
    ),
    (
        "joint_one_set_late",
        JOINT,
        "encoder = { link = { bits = 20 }, motor = { bits = 20 } }
         drive = { delay_ticks = 1, uncertain_percent = 30 }",
        joint::<0, 1>,
    ),
    (
        "joint_late3",
        JOINT,
        "encoder = { link = { bits = 20 }, motor = { bits = 20 } }
         drive = { delay_ticks = 3, gain_sets = 2 }
         monitor = { reaction = 'brake' }
         limits = { low_rad = -3 }",
        joint::<1, 3>,
    ),
    (
        "coupled",
        JOINT,
        "encoder = { link = { bits = 20 }, motor = { bits = 20, reversed = true, offset_counts = 77 } }
         drive = { tuning = 'coupled', surface_rad_s = 27, reaching_per_s = 390, link_rad_s = 58, motor_rad_s = 850, \
         gain_sets = 2, fast_ratios = [4, 3], lost_ticks = 8 }
         monitor = { reaction = 'brake' }",
        coupled::<1, 0>,
    ),
    (
        "coupled_stiff",
        STIFF,
        "encoder = { link = { bits = 19 }, motor = { bits = 32, states = 4294967296, counts_per_turn = 16384 } }
         drive = { tuning = 'coupled', surface_rad_s = 45, reaching_per_s = 80, link_rad_s = 170, motor_rad_s = 230, \
         gain_sets = 1, fallback = 0.5 }
         monitor = { reaction = 'fallback' }",
        coupled::<0, 0>,
    ),
    (
        "coupled_late2",
        JOINT,
        // These encoders have no common unit that fits into 32 bits.
        "encoder = { link = { bits = 24 }, motor = { bits = 16, states = 65536, counts_per_turn = 4001 } }
         drive = { tuning = 'coupled', surface_rad_s = 15, reaching_per_s = 60, link_rad_s = 40, motor_rad_s = 200, \
         gain_sets = 2, fast_ratios = [1.5, 1.5], delay_ticks = 2, accept_unstable = true }
         monitor = { reaction = 'brake' }
         limits = { low_rad = -3 }",
        coupled::<1, 2>,
    ),
];

/// Words of a request: kind, three flags and counts, turns, trajectory points, a current.
const ASK_WORDS: usize = 1 + 1 + 2 + 2 + 8 + 1;

/// Requests to the Rust tick and its answers.
struct Run {
    asked: Vec<u8>,
    words: usize,
    answers: Vec<u32>,
}

/// Request: `tick_or_start`.
const TICK: u32 = 0;
/// Request: `report_applied`.
const REPORT: u32 = 1;
/// Request: `start` of a drive that may already run, and its first tick.
const START: u32 = 2;
/// Request: `reset`, then `tick_or_start`.
const FORGET: u32 = 3;
/// Request: `lost`.
const LOST: u32 = 4;
/// Request: `limit`.
const LIMIT: u32 = 5;
/// Request: `missed`, up to 63 periods, more than the allowed number of missing samples.
const MISSED: u32 = 6;

fn design_of(text: &str) -> DriveDesign {
    let source = Source { file: "it", text, sets: &[] };
    let experiment = scenario::parse(&source, "it").unwrap_or_else(|error| panic!("{error}"));
    experiment.drive.expect("a drive").designed
}

fn motor<A, const FAST: usize, const LATE: usize, const S: usize>(name: &str, text: &str) -> Run
where
    A: Aim<f32, 2> + Aim<f64, 2>,
{
    let of = design_of(text);
    let DriveDesign::Motor(DriveOf { design, mounted, .. }) = of else { panic!("{name} is a motor") };
    let MotorDesign { motor, encoder, .. } = design;
    let law = MotorDrive::<f32, A, FAST, LATE, S>::try_design(&design).expect("a good design");
    let (gain, most) = (motor.input_gain(), design.limits.max);
    let plant = Plant { gain: [0.0, gain], friction: [0.06 * most * gain, 0.04 * most * gain], ..Plant::default() };
    run(name, (&watched(law, &of), &of), mounted.map(|mounted| mounted.mounting), [encoder.unit_rad()], plant)
}

fn joint<const FAST: usize, const LATE: usize>(name: &str, text: &str) -> Run {
    of_joint(name, text, JointDrive::<f32, Position, FAST, LATE>::try_design)
}

fn coupled<const FAST: usize, const LATE: usize>(name: &str, text: &str) -> Run {
    of_joint(name, text, CoupledDrive::<f32, Position, FAST, LATE>::try_design)
}

fn of_joint<M, const S: usize, const FAST: usize, const LATE: usize>(
    name: &str,
    text: &str,
    law: impl Fn(&JointDesign) -> Result<EncoderForm<f32, M, Position, 2, 4, S, FAST, LATE>, DriveError>,
) -> Run
where
    M: ChainModel<f32, 2, 4>,
{
    let of = design_of(text);
    let DriveDesign::Joint(DriveOf { design, mounted, .. }) = of else { panic!("{name} is a joint") };
    let JointDesign { joint, encoders, .. } = design;
    let law = law(&design).expect("a good design");
    let (link, rotor) = (joint.link_inertia_kg_m2, joint.motor_inertia_kg_m2);
    let plant = Plant {
        gain: [0.0, joint.torque_n_m_per_a / rotor],
        spring: [joint.stiffness_n_m / link, joint.stiffness_n_m / rotor],
        drag: [joint.link_damping_n_m_s / link, joint.motor_damping_n_m_s / rotor],
        weight: joint.weight_n_m / link,
        ..Plant::default()
    };
    let units = encoders.map(|it| it.unit_rad());
    run(name, (&watched(law, &of), &of), mounted.map(|mounted| mounted.mounting), units, plant)
}

/// Returns the controller with the monitors of its scenario.
fn watched<L: Watched<E>, const E: usize>(law: L, of: &DriveDesign) -> Monitored<L, E> {
    let (bounds, _) = of.thresholds().expect("a good design");
    Monitored::new(law, &Bounds::from_numbers(bounds)).stopping_at(of.reaction().stops_at())
}

/// Plant of two shafts with a spring between them; a motor is the second shaft alone.
#[derive(Clone, Copy, Default)]
pub(super) struct Plant {
    pub(super) gain: [f64; 2],
    pub(super) spring: [f64; 2],
    pub(super) drag: [f64; 2],
    pub(super) weight: f64,
    /// Friction of a motor with stiction, rad/s²: static, Coulomb.
    pub(super) friction: [f64; 2],
    pub(super) angle: [f64; 2],
    pub(super) speed: [f64; 2],
}

impl Plant {
    /// Integrates one millisecond.
    pub(super) fn advance(&mut self, u: f64) {
        for _ in 0..10 {
            let drawn = self.angle[1] - self.angle[0];
            let force =
                [self.spring[0] * drawn - self.weight * self.angle[0].sin(), self.gain[1] * u - self.spring[1] * drawn];
            for i in 0..2 {
                let before = self.speed[i];
                self.speed[i] += 1e-4 * (force[i] - self.drag[i] * before);
                if i == 1 && before == 0.0 && force[1].abs() <= self.friction[0] {
                    self.speed[1] = 0.0;
                } else if i == 1 {
                    let way = if before == 0.0 { force[1].signum() } else { before.signum() };
                    self.speed[1] -= 1e-4 * self.friction[1] * way;
                    self.speed[1] *= f64::from(u8::from(self.speed[1] * way > 0.0));
                }
                self.angle[i] += 1e-4 * self.speed[i];
            }
        }
        // A runaway plant restarts.
        if self.angle[1].abs() > 1e6 || self.speed[1].abs() > 3e3 {
            (self.angle, self.speed) = ([0.0; 2], [0.0; 2]);
        }
    }

    /// Returns the counts of the encoders; a motor's count is the first.
    pub(super) fn steps<const E: usize>(&self, unit_rad: [f64; E]) -> [i64; 2] {
        let of = |i: usize| (self.angle[2 - E + i] / unit_rad[i] + 0.5).floor() as i64;
        core::array::from_fn(|i| if i < E { of(i) } else { 0 })
    }

    /// Sets angle 0 again for a restart, because a joint with inconsistent encoders does not start.
    pub(super) fn find_zero(&mut self, counters: &mut Counters) {
        counters.slipped = [0; 2];
        let turns = (self.angle[0] / TAU).round();
        self.angle = self.angle.map(|angle| angle - TAU * turns);
    }
}

/// Returns a target from a revolution and the first derivatives of a trajectory point.
pub(super) fn target<const N: usize>(turn: i32, jet: [f32; 4]) -> Target<f32, i32, N> {
    Target { turn, jet: core::array::from_fn(|j| jet[j]) }
}

/// Goal that moves, jumps and fails.
pub(super) struct MovingGoal {
    /// Size of moves and jumps relative to a motor's goal; at full size a joint would saturate all the time.
    pub(super) part: f64,
    pub(super) angle: f64,
    pub(super) speed: f64,
    pub(super) bad_left: usize,
}

impl MovingGoal {
    /// Plans again from the estimated position, because a start may be several revolutions away.
    pub(super) fn begin_near<const E: usize>(&mut self, known: Option<&DriveEstimates<f32, i32, E>>) {
        let Some(known) = known else { return };
        let at = TAU * f64::from(known.turn) + f64::from(known.position[0]);
        if (self.angle - at).abs() > 3.0 && at.abs() < 1e6 {
            (self.angle, self.speed) = (at, f64::from(known.speed[0]).clamp(-100.0, 100.0) * self.part);
        }
    }

    pub(super) fn next(&mut self, rng: &mut Rng) -> ([i32; 2], [[f32; 4]; 2]) {
        if rng.chance(0.002) {
            self.speed = self.part * rng.within(-30.0, 30.0);
        }
        if rng.chance(0.002) {
            self.speed = 0.0;
        }
        if rng.chance(0.001) {
            self.angle += self.part * rng.within(-1.5, 1.5);
        }
        let before = self.angle;
        self.angle += 1e-3 * self.speed;
        let mut turns = [before, self.angle].map(|angle| (angle / TAU).round() as i32);
        let mut jets = [before, self.angle].map(|angle| {
            let rest = angle - TAU * (angle / TAU).round();
            [rest as f32, self.speed as f32, 0.0, 0.0]
        });
        if rng.chance(0.005) {
            self.bad_left = rng.integer(1, 4);
        }
        if self.bad_left > 0 {
            self.bad_left -= 1;
            let bad = match rng.integer(0, 2) {
                0 => f32::from_bits(rng.bits() as u32),
                1 => EDGES[rng.integer(0, EDGES.len() - 1)],
                _ => rng.spread(1.0, 1e25) as f32,
            };
            jets[rng.integer(0, 1)][rng.integer(0, 3)] = bad;
            if rng.chance(0.2) {
                turns[rng.integer(0, 1)] = rng.bits() as i32;
            }
        }
        (turns, jets)
    }
}

/// Counts as the registers hold them, with simulated faults.
#[derive(Default)]
pub(super) struct Counters {
    lost_left: [usize; 2],
    stuck_left: [usize; 2],
    wild_left: [usize; 2],
    held: [i32; 2],
    /// Counts by which an encoder slipped.
    slipped: [i32; 2],
    /// True if fast shaking occurs now and then; remaining ticks of the present shaking.
    is_shaken: bool,
    shaken_left: usize,
}

impl Counters {
    pub(super) fn next(&mut self, rng: &mut Rng, steps: [i64; 2], mounting: &[Mounting]) -> ([i32; 2], [bool; 2]) {
        let (mut counts, mut lost) = ([0; 2], [false; 2]);
        if self.is_shaken && rng.chance(0.0005) {
            self.shaken_left = 200;
        }
        self.shaken_left = self.shaken_left.saturating_sub(1);
        let shaken = [0, 5, 5, 0][self.shaken_left % 4];
        for (i, Mounting { is_reversed, offset_counts }) in mounting.iter().enumerate() {
            for (left, chance) in
                [(&mut self.lost_left, 0.004), (&mut self.stuck_left, 0.001), (&mut self.wild_left, 0.001)]
            {
                if rng.chance(chance) {
                    left[i] = if rng.chance(0.1) { rng.integer(1, 80) } else { rng.integer(1, 5) };
                }
            }
            if rng.chance(0.0005) {
                self.slipped[i] = self.slipped[i].wrapping_add(rng.integer(0, 4000) as i32 - 2000);
            }
            let upright = (steps[i] as i32).wrapping_add(self.slipped[i]).wrapping_add(shaken);
            let read = if *is_reversed { upright.wrapping_neg() } else { upright }.wrapping_add(*offset_counts);
            counts[i] = read;
            if self.wild_left[i] > 0 {
                self.wild_left[i] -= 1;
                counts[i] = rng.bits() as i32;
            } else if self.stuck_left[i] > 0 {
                self.stuck_left[i] -= 1;
                counts[i] = self.held[i];
            }
            self.held[i] = counts[i];
            lost[i] = self.lost_left[i] > 0;
            self.lost_left[i] = self.lost_left[i].saturating_sub(1);
        }
        (counts, lost)
    }
}

/// Draws the next function to call.
fn next_call(rng: &mut Rng, stopped: bool) -> u32 {
    match rng.integer(0, 999) {
        // The operator notices the stop and resets the drive.
        25..=44 if stopped => FORGET,
        0 if rng.chance(0.2) => FORGET,
        1 if rng.chance(0.2) => START,
        2..=4 => LOST,
        5..=24 => REPORT,
        45..=47 => LIMIT,
        48..=49 => MISSED,
        _ => TICK,
    }
}

/// Draws the current of a report or of a limit.
fn next_current(rng: &mut Rng, what: u32) -> f32 {
    match what {
        // Full current of the design.
        LIMIT if rng.chance(0.5) => 1e9,
        _ if rng.chance(0.03) => EDGES[rng.integer(0, EDGES.len() - 1)],
        _ => rng.within(-10.0, 10.0) as f32,
    }
}

/// Runs one tick with the complete environment of a controller.
fn whole_tick<L, const E: usize, const N: usize>(
    running: &mut Running<Monitored<L, E>>,
    (band, resting): (Option<&RestBand>, &mut Resting),
    fence: Option<&Fence>,
    counts: [Option<i32>; E],
    targets: [Target<f32, i32, N>; 2],
) -> Output<f32>
where
    L: Watched<E> + DriveLaw<E, N>,
{
    let ([mut begin, mut end], mut hunts) = (targets, Health::OK);
    if let Some(band) = band {
        hunts = band.place(resting, running.estimates().as_ref(), &mut begin, &mut end);
    }
    let mut output = running.tick(&L::sample(counts, &begin, &end));
    if !output.health.intersects(Health::STOPPED | Health::BRAKES) {
        output.health |= hunts;
    }
    if let Some(band) = band {
        band.calm(resting, running, &mut output);
    }
    if let Some(fence) = fence {
        fence.guard(running, &mut output, &targets[0]);
    }
    output
}

fn run<M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>(
    name: &str,
    (law, of): (&Monitored<EncoderForm<f32, M, A, E, N, S, FAST, LATE>, E>, &DriveDesign),
    mounting: [Mounting; E],
    unit_rad: [f64; E],
    mut plant: Plant,
) -> Run
where
    M: ChainModel<f32, E, N>,
    A: Aim<f32, N>,
    EncoderForm<f32, M, A, E, N, S, FAST, LATE>: ControlLaw<
            Scalar = f32,
            Sample = Sample<i32, A::Target, E>,
            Guess = [f32; E],
            Output = Output<f32>,
            Estimates = DriveEstimates<f32, i32, E>,
        >,
{
    let mut rng = Rng::new(0xD41E + name.bytes().map(u64::from).sum::<u64>());
    let mut running = Running::new(*law);
    let mut under_way = VecDeque::from(vec![0.0; LATE]);
    let (fence, band, does_brake) = (of.fence(), of.rest_band(), of.reaction() == Reaction::Brake);
    let (mut wanted, mut counters) = (
        MovingGoal { part: if E == 1 { 1.0 } else { 0.2 }, angle: 0.0, speed: 0.0, bad_left: 0 },
        Counters { is_shaken: of.rest_band().is_some(), ..Counters::default() },
    );
    let (mut asked, mut answers, mut seen, mut words) = (Vec::new(), Vec::new(), vec![0_usize; HEALTHS], 0);
    let (mut ticks, mut turns_gone, mut stopped, mut resting) = (0, 0, false, Resting::START);
    let mut lowered = 0;
    while ticks < TICKS {
        let what = next_call(&mut rng, stopped);
        if what == FORGET || what == START {
            plant.find_zero(&mut counters);
        }
        wanted.begin_near(running.estimates().as_ref());
        let (turns, jets) = wanted.next(&mut rng);
        let (counts, lost) = counters.next(&mut rng, plant.steps(unit_rad), &mounting);
        let current = next_current(&mut rng, what);
        let targets = [target::<N>(turns[0], jets[0]), target(turns[1], jets[1])];
        let read = core::array::from_fn(|i| (!lost[i]).then(|| mounting[i].upright(counts[i])));
        let sample = Sample { counts: read, begin: A::told(&targets[0]), end: A::told(&targets[1]) };
        let mut said = None;
        match what {
            REPORT => answers.extend([u32::from(running.report_applied(current)), 0, 0, 0]),
            LIMIT => answers.extend([u32::from(running.limit(current)), 0, 0, 0]),
            START if law.start(&sample).is_none() => answers.extend([0; 4]),
            MISSED => {
                running.missed(counts[0] as u32 % 64);
                answers.extend([0; 4]);
            }
            _ => {
                if what == FORGET || what == START {
                    running.reset();
                    resting = Resting::START;
                }
                if what == START {
                    running.start_at_once(&sample);
                }
                said = Some(if what == LOST {
                    running.lost()
                } else {
                    let output = whole_tick(&mut running, (band.as_ref(), &mut resting), fence.as_ref(), read, targets);
                    lowered += usize::from(resting.is_lowered());
                    output
                });
            }
        }
        if let Some(output) = said {
            let health = output.health;
            (ticks, stopped) = (ticks + 1, health.contains(Health::STOPPED));
            seen[usize::from(health.bits())] += 1;
            let numbers = [output.u, output.sigma, output.sigma_star].map(f32::to_bits);
            answers.extend([u32::from(health.bits())].into_iter().chain(numbers));
            under_way.push_back(f64::from(output.u).clamp(-30.0, 30.0));
            plant.advance(under_way.pop_front().expect("one that was just queued"));
        }
        asked.extend(
            [what, u32::from(lost[0]) | u32::from(lost[1]) << 1]
                .into_iter()
                .chain(counts.map(|count| count as u32))
                .chain(turns.map(|turn| turn as u32))
                .chain(jets.as_flattened().iter().map(|number| number.to_bits()))
                .chain([current.to_bits()])
                .flat_map(u32::to_le_bytes),
        );
        // State without hash and checksum, then the started flag.
        let all: Vec<u32> = running.words().collect();
        let [_, started, ref state @ .., _] = all[..] else { panic!("words of a running drive") };
        let of_the_band = band.filter(|_| started == 1 || words > 0).map(|band| {
            let members = if band.lower_gains().is_some() { 18 } else { 8 };
            resting.words().take(members).collect()
        });
        let state = members_in_c(state, (E, does_brake), of_the_band);
        let length = if started == 1 { state.len() } else { words };
        let known = running.estimates();
        words = words.max(state.len());
        answers.extend(state.iter().copied().chain(core::iter::repeat(0)).take(length));
        answers.extend([started, known.as_ref().map_or(0, |known| known.turn as u32)]);
        for i in 0..E {
            let of = known
                .as_ref()
                .map_or([0.0; 4], |known| [known.position[i], known.speed[i], known.disturbance[i], known.load[i]]);
            answers.extend(of.map(f32::to_bits));
        }
        turns_gone = turns_gone.max(known.map_or(0, |known| known.turn.unsigned_abs().min(1000)));
        if words == 0 {
            // The length of a state is not known yet.
            answers.clear();
            asked.clear();
            running.reset();
        }
    }
    assert_exercised(name, ticks, &seen, turns_gone);
    assert!(band.is_none() || hunted(&seen) > 0, "{name}: the band never widened");
    assert!(band.is_none() || lowered > 100, "{name}: {lowered} ticks under lower gains");
    Run { asked, words: 4 + words + 2 + 4 * E, answers }
}

/// Counts the ticks with a widened rest band.
fn hunted(seen: &[usize]) -> usize {
    let with = seen.iter().enumerate().filter(|(bits, _)| bits & usize::from(Health::HUNTS.bits()) != 0);
    with.map(|(_, ticks)| ticks).sum()
}

/// Returns the words of a state that exist in C, with the memory of the rest band.
fn members_in_c(state: &[u32], (shafts, does_brake): (usize, bool), band: Option<Vec<u32>>) -> Vec<u32> {
    // The common counters of the monitors are not members in C; nor is the brake flag without a brake.
    let is_member = |k: usize| k != 1 && (!(8..=9).contains(&k) || does_brake);
    let mut words: Vec<u32> = state.iter().enumerate().filter(|(k, _)| is_member(*k)).map(|(_, word)| *word).collect();
    // The rest band lies after the counters of the monitors and before the controller. The counters are zero before a
    // start.
    let behind = if does_brake { 9 } else { 7 } + shafts;
    if let Some(band) = band {
        words.resize(words.len().max(behind), 0);
        words.splice(behind..behind, band);
    }
    words
}

/// Number of values of the status flags.
pub(super) const HEALTHS: usize = Health::ALL as usize + 1;

/// Checks that a run contains enough working, saturated and failing ticks.
pub(super) fn assert_exercised(name: &str, ticks: usize, seen: &[usize], turns_gone: u32) {
    let with = |flag: Health| -> usize {
        let of = seen.iter().enumerate();
        of.filter(|(bits, _)| bits & usize::from(flag.bits()) != 0).map(|(_, ticks)| ticks).sum()
    };
    let [saturated, lost, rejected, alarms, stops] = [
        Health::SATURATED,
        Health::SAMPLE_LOST,
        Health::INPUT_REJECTED,
        Health::DISTURBANCE_OVER_BOUND,
        Health::STOPPED,
    ]
    .map(with);
    let working = seen[0] + seen[usize::from(Health::DISTURBANCE_OVER_BOUND.bits())];
    println!(
        "{name}: {ticks} ticks, {working} working, {saturated} saturated, {lost} lost, {rejected} rejected, {alarms} \
         with an alarm of the disturbance, {stops} stopped, {turns_gone} turns"
    );
    // A far target and a rejected count seldom end in an alarm.
    assert!(working > ticks / 10 && saturated > ticks / 1000 && alarms > ticks / 50_000, "{name}: {seen:?}");
    assert!(lost > ticks / 200 && rejected > ticks / 1000 && turns_gone > 0, "{name}: {seen:?}");
}

/// Returns the names and types of a struct's members in an exported file.
fn members<'a>(text: &'a str, name: &str) -> Vec<(&'a str, &'a str)> {
    let before = text.split_once(&format!("}} edo_smc_{name};")).expect("the struct").0;
    let (_, body) = before.rsplit_once("typedef struct {").expect("its beginning");
    let member = |line: &'a str| line.split_once(';').expect("a member").0.trim().split_once(' ');
    body.trim().lines().filter_map(member).collect()
}

/// Returns the C program around the exported file: requests in, answers out.
fn driver(exported: &str, text: &str, place: Place) -> String {
    let put = |from: &str, (t, name): (&str, &str)| match t {
        "float" => format!("            *word++ = bits({from}.{name});\n"),
        _ => format!("            *word++ = (uint32_t){from}.{name};\n"),
    };
    let state = members(text, "monitor").into_iter().map(|member| put("monitor", member));
    let state: String = state.chain(members(text, "state").into_iter().map(|member| put("state", member))).collect();
    let estimates: String = members(text, "estimates_of").into_iter().map(|member| put("known", member)).collect();
    let sample = members(text, "sample");
    let counts = sample.iter().filter(|(_, name)| name.starts_with("count"));
    let counts: Vec<String> =
        counts.enumerate().map(|(i, (_, name))| format!("            sample.{name} = ask->count[{i}];\n")).collect();
    let counts = counts.concat();
    let lost = sample.iter().filter(|(_, name)| name.starts_with("lost"));
    let lost: Vec<String> = lost
        .enumerate()
        .map(|(i, (_, name))| format!("            sample.{name} = (ask->lost >> {i} & 1u) != 0u;\n"))
        .collect();
    let lost = lost.concat();
    let mut targets = String::new();
    for (k, end) in ["begin", "end"].into_iter().enumerate() {
        if sample.contains(&("float", end)) {
            let _ = writeln!(targets, "            sample.{end} = ask->jet[{k}][1];");
            continue;
        }
        let _ = writeln!(targets, "            sample.{end}.turn = ask->turn[{k}];");
        for (j, (_, name)) in members(text, "target").into_iter().skip(1).enumerate() {
            let _ = writeln!(targets, "            sample.{end}.{name} = ask->jet[{k}][{j}];");
        }
    }
    let words = state.lines().count() + estimates.lines().count() + 4;
    let transfer = if place == Place::Here { ON_THE_HOST } else { ON_THE_CHIP };
    format!(
        "#include \"{exported}\"
{transfer}
typedef struct {{
    uint32_t what;
    uint32_t lost;
    uint32_t count[2];
    int32_t turn[2];
    float jet[2][4];
    float current;
}} ask_type;
static ask_type asks[32];
static uint32_t answers[32 * {words}];

static uint32_t bits(float number)
{{
    union {{ float number; uint32_t word; }} both;
    both.number = number;
    return both.word;
}}

int main(void)
{{
    static edo_smc_state state;
    static edo_smc_monitor monitor;
    size_t count;
    while ((count = receive(asks, sizeof asks) / sizeof asks[0]) > 0) {{
        uint32_t *word = answers;
        for (size_t k = 0; k < count; k++) {{
            const ask_type *const ask = &asks[k];
            edo_smc_sample sample;
            edo_smc_output output = {{0.0f, 0.0f, 0.0f}};
            edo_smc_estimates_of known;
            unsigned said;
{counts}{lost}{targets}
            switch (ask->what) {{
            case {REPORT}: said = edo_smc_report_applied(&state, ask->current); break;
            case {LIMIT}: said = edo_smc_limit(&state, ask->current); break;
            case {MISSED}:
                edo_smc_missed(&state, ask->count[0] % 64u);
                said = 0u;
                break;
            case {START}:
                said = 0u;
                if (edo_smc_start(&state, &sample)) {{
                    const edo_smc_state started = state;
                    edo_smc_watched_reset(&monitor, &state);
                    state = started;
                    said = edo_smc_watched_tick(&monitor, &state, &sample, &output);
                }}
                break;
            case {FORGET}:
                edo_smc_watched_reset(&monitor, &state);
                said = edo_smc_watched_tick(&monitor, &state, &sample, &output);
                break;
            case {LOST}: said = edo_smc_watched_lost(&monitor, &state, &output); break;
            default: said = edo_smc_watched_tick(&monitor, &state, &sample, &output); break;
            }}
            *word++ = said;
            *word++ = bits(output.u);
            *word++ = bits(output.sigma);
            *word++ = bits(output.sigma_star);
            (void)edo_smc_estimates(&state, &known);
{state}{estimates}        }}
        send(answers, count * {words} * sizeof answers[0]);
    }}
    return 0;
}}
"
    )
}

fn compare_all(place: Place, options: &[&str]) {
    let instances: Vec<Instance> = sampled(INSTANCES, 3).collect();
    compare(&instances, place, options);
}

fn compare(instances: &[Instance], place: Place, options: &[&str]) {
    for &(name, plant, rest, run) in instances {
        let scenario = format!("{plant}\n{rest}\n");
        let run = run(name, &scenario);
        assert_eq!(run.asked.len() % (4 * ASK_WORDS), 0);
        let kind = match place {
            Place::Here => "here",
            Place::On(board) => board.machine,
        };
        let folder = folder(&format!("drive-{kind}{}", options.concat())).join(name);
        fs::create_dir_all(&folder).expect("a folder");
        let exported = exported(&folder, &format!("{name}.h"), &scenario, &["--standalone"]);
        let text = fs::read_to_string(&exported).expect("the exported file");
        let program = driver(plain(&exported), &text, place);
        let answered = answers(&folder, &program, options, &run.asked, place);
        assert_eq!(answered.len(), run.answers.len(), "{name}: words of the answers");
        let both = answered.chunks(run.words).zip(run.answers.chunks(run.words));
        for (k, (c, rust)) in both.enumerate() {
            let shown = |words: &[u32]| format!("{words:08x?}");
            assert!(alike(c, rust), "{name}: answer {k}\nC:    {}\nRust: {}", shown(c), shown(rust));
        }
        fs::remove_dir_all(&folder).expect("the folder goes");
    }
}

/// Compares bits; every NaN equals every other NaN, because processors make different ones.
fn alike(c: &[u32], rust: &[u32]) -> bool {
    let is_nan = |word: u32| f32::from_bits(word).is_nan();
    c.len() == rust.len() && c.iter().zip(rust).all(|(&c, &rust)| c == rust || is_nan(c) && is_nan(rust))
}

#[test]
fn the_exported_c_of_a_drive_gives_the_bits_of_its_tick() {
    compare_all(Place::Here, &["-O2", "-Wconversion"]);
}

#[test]
fn the_exported_c_of_a_drive_has_no_undefined_behaviour() {
    compare_all(Place::Here, &["-O1", "-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all"]);
}

#[test]
fn the_exported_c_of_a_drive_gives_its_bits_on_the_emulated_chip() {
    compare_all(Place::On(&STM32F405), &["-O2", "-Wconversion"]);
}

/// Cortex-M0, M3 and M4 without an FPU, M7 and M33 with one.
#[test]
fn the_exported_c_of_a_drive_gives_its_bits_on_other_cores() {
    let some = INSTANCES.map(|instance| (["one_set_late", "joint"].contains(&instance.0)).then_some(instance));
    let some: Vec<Instance> = some.into_iter().flatten().collect();
    assert_eq!(some.len(), 2);
    for board in other_boards() {
        compare(&some, Place::On(board), &["-O2"]);
    }
}

/// Every core that the compiler names, with its kinds of float hardware.
#[test]
fn the_exported_c_of_a_drive_compiles_for_every_core_without_a_warning() {
    let asked = Command::new("arm-none-eabi-gcc").args(["-mcpu=?", "-E", "-x", "c", "/dev/null"]).output();
    let asked = String::from_utf8(asked.expect("a compiler").stderr).expect("its words");
    let cores = asked.split_once("valid arguments are: ").expect("the names of its cores").1;
    let cores = cores.lines().next().expect("a line").split(';').next().expect("names").split_whitespace();
    let mut all: Vec<Vec<String>> =
        cores.map(|core| vec![format!("-mcpu={core}"), "-mfloat-abi=soft".into()]).collect();
    assert!(all.len() > 60, "{asked}");
    for (core, fpu) in [
        ("m4", "fpv4-sp-d16"),
        ("m7", "fpv5-sp-d16"),
        ("m7", "fpv5-d16"),
        ("m33", "fpv5-sp-d16"),
        ("m35p", "fpv5-sp-d16"),
    ] {
        for abi in ["softfp", "hard"] {
            all.push([format!("-mcpu=cortex-{core}"), format!("-mfpu={fpu}"), format!("-mfloat-abi={abi}")].into());
        }
    }
    all.push(["-mcpu=cortex-m55".into(), "-mfloat-abi=hard".into()].into());
    let all: Vec<Vec<String>> = sampled(all, 40).collect();
    let folder = folder("drive-cores");
    for wanted in ["two_sets", "joint"] {
        let (_, plant, rest, _) = INSTANCES.into_iter().find(|(name, ..)| *name == wanted).expect("an instance");
        let exported = exported(&folder, "drive.h", &format!("{plant}\n{rest}\n"), &["--standalone"]);
        let user = folder.join("user.c");
        // Unused functions are compiled too: the program takes the address of every function.
        let text = fs::read_to_string(&exported).expect("the exported file");
        let functions: Vec<&str> = text
            .lines()
            .filter_map(|line| line.strip_prefix("static inline ")?.split_once('(')?.0.split([' ', '*']).next_back())
            .collect();
        assert!(functions.len() > 15, "{functions:?}");
        let program = format!(
            "#include \"drive.h\"\nvoid (*const all[])(void);\nvoid (*const all[])(void) = {{\n{}}};\n",
            functions.iter().map(|name| format!("    (void (*)(void)){name},\n")).collect::<Vec<_>>().concat()
        );
        fs::write(&user, program).expect("a program");
        for core in &all {
            let core: Vec<&str> = core.iter().map(String::as_str).collect();
            // Casts between function types are intended here.
            let warnings = &[&STRICT[..], &["-Wconversion", "-Wno-cast-function-type", "-O2", "-c"], &core].concat();
            compile("arm-none-eabi-gcc", warnings, &user, &folder.join("user.o"));
        }
    }
}

/// The steps of docs/c.md, "Exported C99 file", with the program of that section.
#[test]
fn the_program_of_the_docs_compiles_as_c_as_cpp_and_for_the_chip_without_a_warning() {
    let page = fs::read_to_string(path("../docs/c.md")).expect("the page");
    let section = page.split_once("## Exported C99 file").expect("the section").1;
    assert!(section.contains("new mine --plant motor"), "the first command");
    assert!(section.contains("export mine.toml --lang c --standalone -o examples/c/motor_drive.h"), "the export");
    let program = section.split_once("```c\n").expect("a program").1.split_once("```").expect("its end").0;
    let folder = folder("drive-docs");
    exported(&folder, "motor_drive.h", scenario::MOTOR, &["--lang", "c", "--standalone"]);
    for (compiler, file, options) in [
        ("cc", "user.c", &["-Wconversion", "-O2"][..]),
        ("arm-none-eabi-gcc", "user.c", &[&CORTEX_M4F[..], &["-Wconversion", "-O2"]].concat()),
        ("c++", "user.cpp", &["-std=c++17", "-Wconversion", "-O2"]),
    ] {
        let (source, object) = (folder.join(file), folder.join(file).with_extension(format!("{compiler}.o")));
        fs::write(&source, program).expect("the program");
        let warnings = if compiler == "c++" { &STRICT[1..] } else { &STRICT[..] };
        compile(compiler, &[warnings, options, &["-c"]].concat(), &source, &object);
    }
}

/// Assembly supports at most one tick of delay. The error message names the alternatives, and they work.
#[test]
fn a_drive_that_is_two_or_three_ticks_late_is_no_assembly_but_c_and_rust() {
    let folder = folder("drive-late");
    for (name, text) in [("motor", scenario::MOTOR), ("joint", scenario::JOINT)] {
        for late in [2, 3] {
            let file = folder.join(format!("{name}{late}.toml"));
            fs::write(&file, text).expect("the scenario");
            let (file, set) = (file.to_str().expect("a name"), format!("drive.delay_ticks={late}"));
            let export = |lang: &[&str], out: &str| {
                let out = folder.join(out).to_str().expect("a name").to_owned();
                let options = ["export", file, "--set", &set, "--force", "-o", &out];
                integration_tests::program::host_sim(&[&options[..], lang].concat())
            };
            let sets = [set.clone()];
            let source = Source { file: "it", text, sets: &sets };
            let experiment = scenario::parse(&source, "it").unwrap_or_else(|error| panic!("{error}"));
            let Err(refused) = forms::assembly(&experiment, &source, forms::PREFIX, &QUICK) else { panic!("too late") };
            assert_eq!(refused, forms::Error::AssemblyDelay(late));
            for (lang, out) in [(&["--lang", "c", "--standalone"][..], "it.h"), (&["--lang", "rust"], "it.rs")] {
                let told = export(lang, out);
                assert_eq!(told.status, 0, "{told:?}");
            }
            let c = fs::read_to_string(folder.join("it.h")).expect("the C file");
            assert!(c.contains(&format!("DELAY_TICKS {late} ")) && c.contains(&format!("float queued_{late};")), "{c}");
            let rust = fs::read_to_string(folder.join("it.rs")).expect("the Rust file");
            // The high gains of a joint are not stable at 20 % parameter error with such a delay.
            let fast = usize::from(text == scenario::MOTOR);
            assert!(rust.contains(&format!(", Position, {fast}, {late}")), "{rust}");
        }
    }
}

/// Program that prints the properties of the exported file.
const WHAT_IT_IS: &str = "use exported::*;
use controller_core::ControlLaw;
fn main() {
    assert_eq!(EXPORTED_FOR, controller_core::VERSION);
    let running = running();
    assert!(running.estimates().is_none());
    let law = running.design().fingerprint();
    let whole = controller_core::drive::fingerprint(law, &MOUNTING, STOP_TICKS, fence().as_ref(), rest_band().as_ref());
    println!(\"{:#010x} {whole:#010x} {:#010x}\", DRIVE.fingerprint(), DESIGN);
    MOUNTING.iter().for_each(|mounting| println!(\"{}\", mounting.upright(1000)));
}
";

/// The fingerprint covers every number of the design in f32; together with types, monitors and mounting it identifies
/// the whole drive.
#[test]
fn the_exported_rust_of_a_drive_is_the_design_that_the_host_made() {
    for (wanted, counts) in [("one_set", "-300\n"), ("speed_late", "1000\n"), ("joint", "1000\n-923\n")] {
        let (name, plant, rest, _) = INSTANCES.into_iter().find(|(name, ..)| *name == wanted).expect("an instance");
        let scenario = format!("{plant}\n{rest}\n");
        let hash = match (design_of(&scenario), name) {
            (DriveDesign::Motor(DriveOf { design, .. }), "one_set") => {
                MotorDrive::<f32, Position>::design(&design).fingerprint()
            }
            (DriveDesign::Motor(DriveOf { design, .. }), _) => {
                MotorDrive::<f32, Speed, 0, 1, 4>::design(&design).fingerprint()
            }
            (DriveDesign::Joint(DriveOf { design, .. }), _) => {
                JointDrive::<f32, Position, 1>::design(&design).fingerprint()
            }
        };
        // With its monitors and its encoder mounting, the exported drive equals the drive of `run`.
        let source = Source { file: "it", text: &scenario, sets: &[] };
        let ran = scenario::parse(&source, "it").unwrap_or_else(|error| panic!("{error}")).port.fingerprint();
        let whole = ran.expect("the fingerprint of a drive");
        let said = format!("{hash:#010x} {whole:#010x} {whole:#010x}\n{counts}");
        assert_eq!(said_by_exported_rust(&folder("drive-rust"), name, &scenario, WHAT_IT_IS), said, "{name}");
    }
}

/// Simulated motor of the template: 0.05 N m/A, 2e-4 kg m², 14 bits, 1 kHz, with friction. It stands at 0.5 rad when
/// the drive starts. In the move the drive misses two interrupts. Then a load raises an alarm, and the drive restarts.
const MOVED: &str = "
// Shared between tasks, as under RTIC.
const fn shared<T: Send>() {}
const _: () = shared::<Control>();

fn main() {
    let mut control = Control::new();
    let (mut angle, mut speed) = (0.5_f64, 0.0_f64);
    let (mut u, mut seen) = (0.0, Health::OK);
    for tick in 0..3000 {
        if tick == 100 {
            control.move_to(0, 1.5, 500);
        }
        if tick == 302 {
            control.missed(2);
        }
        if tick == 1900 {
            assert!(seen.contains(Health::STOPPED) && u == 0.0, \"{seen}, {u} A\");
            control.restart();
        }
        if tick == 2000 {
            control.move_to(0, angle as f32 + 0.5, 300);
        }
        if !(300..302).contains(&tick) {
            let count = (angle * 16384.0 / std::f64::consts::TAU).floor() as i32;
            let output = control.tick(Some(count), None);
            u = output.u;
            seen = if tick == 1500 || tick == 1900 { output.health } else { seen | output.health };
        }
        // A load above the bound of the monitor.
        let load = if (1500..1520).contains(&tick) { 0.45 } else { 0.0 };
        for _ in 0..20 {
            let torque = 0.05 * f64::from(u) - load - 0.005 * (100.0 * speed).clamp(-1.0, 1.0);
            speed += 5e-5 * torque / 2e-4;
            angle += 5e-5 * speed;
        }
        if [99, 303, 350, 1499, 1999, 2999].contains(&tick) {
            println!(\"{angle}\");
        }
    }
    assert!(!seen.contains(Health::STOPPED), \"{seen}\");
}
";

/// The code of docs/rust.md starts where the shaft is and moves it.
#[test]
fn the_drive_of_the_rust_page_compiles_and_moves_a_motor() {
    let page = fs::read_to_string(path("../docs/rust.md")).expect("the page");
    let section = page.split_once("## Your exported drive in your interrupt").expect("the section").1;
    let code = section.split_once("```rust\n").expect("the code").1.split_once("```").expect("its end").0;
    assert!(code.contains("\nmod motor_drive;\n"));
    let program = code.replace("\nmod motor_drive;\n", "\nuse exported as motor_drive;\n") + MOVED;
    let said = said_by_exported_rust(&folder("drive-page"), "page", scenario::MOTOR, &program);
    let angles: Vec<f64> = said.lines().map(|line| line.parse().expect("an angle")).collect();
    let [before, missed, halfway, after, stopped, moved] = angles[..] else { panic!("{said}") };
    println!("{said}");
    assert!((before - 0.5).abs() < 2e-3 && (halfway - 1.0).abs() < 2e-2 && (after - 1.5).abs() < 2e-3, "{said}");
    assert!(missed < halfway && (stopped - after).abs() > 2e-3 && (moved - stopped - 0.5).abs() < 3e-3, "{said}");
}
