//! Comparison of the assembly ticks with the Rust tick, bit for bit: a million ticks each of a joint with order 2 and
//! 3, and of the drives of a motor and of a joint.
//!
//! Samples are near rest and far from it. One in thirty is invalid, several in a row: NaN, infinities, too large
//! numbers, subnormal numbers, random bits. A drive moves under u over whole revolutions; counts are missing or jump,
//! and targets are not numbers. Occasionally the actuator holds another value, and occasionally the tick starts again.
//! The comparison covers every bit of u from `tick_u`, and of u, sigma, sigma* and health from `tick`.
#![no_std]
#![no_main]

use controller_core::drive::{Joint as JointData, JointDrive, MotorDrive, Sample, Target};
use controller_core::{ControlLaw, Health, Output};
use cortex_m::asm;
use firmware::assembly::{
    DriveSample, DriveState, JOINT_DRIVE, Joint, MOTOR, State, TickOutput, joint, joint_drive_report_applied,
    joint_drive_start, joint_drive_tick, joint_drive_tick_u, joint_r2_report_applied, joint_r2_start, joint_r2_tick,
    joint_r2_tick_u, joint_r3_report_applied, joint_r3_start, joint_r3_tick, joint_r3_tick_u, motor_report_applied,
    motor_start, motor_tick, motor_tick_u,
};
use firmware::log;
use stm32f4::stm32f405::Peripherals;

const TICKS: u32 = 1_000_000;

static JOINT_2: Joint<2> = joint();
static JOINT_3: Joint<3> = joint();
static OF_MOTOR: MotorDrive = <MotorDrive>::design(&MOTOR);
static OF_JOINT: JointDrive = <JointDrive>::design(&JOINT_DRIVE);

/// Functions of one file.
struct Exported<S, X> {
    start: extern "C" fn(&mut S, &X) -> bool,
    tick_u: extern "C" fn(&mut S, &X) -> f32,
    tick: extern "C" fn(&mut S, &X, &mut TickOutput) -> u32,
    report_applied: extern "C" fn(&mut S, f32) -> bool,
}

/// Random number generator (xorshift).
struct Luck(u32);

impl Luck {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    fn one_in(&mut self, n: u32) -> bool {
        self.next().is_multiple_of(n)
    }

    fn within(&mut self, size: f32) -> f32 {
        size * ((self.next() >> 8) as f32 / 8_388_608.0 - 1.0)
    }

    fn bad(&mut self) -> f32 {
        const EDGES: [f32; 10] =
            [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 1e-45, f32::MAX, f32::MIN, 1e12, -1e20, 3e37];
        if self.one_in(2) { f32::from_bits(self.next()) } else { EDGES[(self.next() % 10) as usize] }
    }
}

/// Counters of one comparison.
#[derive(Default)]
struct Seen {
    differ: u32,
    rejected: u32,
    saturated: u32,
    starts: u32,
}

impl Seen {
    /// Compares both assembly ticks with the Rust tick.
    fn compare(&mut self, output: &Output<f32>, u: f32, told: TickOutput, health: u32) {
        let alike = |one: f32, other: f32| one.to_bits() == other.to_bits();
        let same = alike(output.u, u)
            && alike(output.u, told.u)
            && alike(output.sigma, told.sigma)
            && alike(output.sigma_star, told.sigma_star)
            && u32::from(output.health.bits()) == health;
        self.differ += u32::from(!same);
        self.rejected += u32::from(output.health.contains(Health::INPUT_REJECTED));
        self.saturated += u32::from(output.health.contains(Health::SATURATED));
    }

    /// Compares the boolean results of assembly and Rust.
    fn agree(&mut self, rust: bool, assembly: [bool; 2]) {
        self.differ += u32::from(assembly != [rust; 2]);
    }

    fn tell(&self, name: &str) {
        defmt::println!(
            "{=str}: {=u32} ticks, {=u32} differ; {=u32} rejected, {=u32} saturated, {=u32} starts",
            name,
            TICKS,
            self.differ,
            self.rejected,
            self.saturated,
            self.starts,
        );
    }
}

fn compare<const R: usize, const NUMBERS: usize>(
    name: &str,
    law: &Joint<R>,
    exported: &Exported<State<NUMBERS>, [f32; 4]>,
) {
    let mut luck = Luck(2_463_534_242);
    let (mut of_u, mut of_all) = (State::ZEROS, State::ZEROS);
    let (mut state, mut bad, mut size) = (None, 0, 0.1);
    let mut seen = Seen::default();
    let mut done = 0;
    while done < TICKS {
        if luck.one_in(100) {
            size = [1e-6, 1e-3, 0.1, 1.0, 10.0][(luck.next() % 5) as usize];
        }
        if luck.one_in(100) {
            bad = 1 + luck.next() % 5;
        }
        let mut x: [f32; 4] = core::array::from_fn(|_| luck.within(size));
        if bad > 0 {
            bad -= 1;
            x[(luck.next() % 4) as usize] = luck.bad();
        }
        if state.is_none() || luck.one_in(500) {
            let started = law.start(&x);
            seen.agree(started.is_some(), [&mut of_u, &mut of_all].map(|of| (exported.start)(of, &x)));
            seen.starts += u32::from(started.is_some());
            state = started.or(state);
        }
        let Some(state) = &mut state else { continue };
        if luck.one_in(10) {
            let held = if luck.one_in(10) { luck.bad() } else { luck.within(300.0) };
            let taken = Joint::<R>::report_applied(state, held);
            seen.agree(taken, [&mut of_u, &mut of_all].map(|of| (exported.report_applied)(of, held)));
        }
        let output = law.tick(state, &x);
        let mut told = TickOutput::default();
        let u = (exported.tick_u)(&mut of_u, &x);
        let health = (exported.tick)(&mut of_all, &x, &mut told);
        seen.compare(&output, u, told, health);
        done += 1;
    }
    seen.tell(name);
}

/// Simulated plant of a drive.
trait Plant<const ENCODERS: usize>: Default {
    /// Simulates one period of 1 ms.
    fn goes_on(&mut self, u: f32);
    fn counts(&self) -> [i32; ENCODERS];
    /// Moves back by the whole revolutions of the first shaft; returns that angle, rad.
    fn turned_back(&mut self) -> f32;
}

/// Motor without friction: J w' = K_t u - B w in steps of a tick, with an encoder of 14 bits.
#[derive(Default)]
struct Shaft {
    angle: f32,
    speed: f32,
}

impl Plant<1> for Shaft {
    fn goes_on(&mut self, u: f32) {
        self.speed += 1e-3 * (250.0 * u - 0.05 * self.speed);
        self.angle += 1e-3 * self.speed;
    }

    fn counts(&self) -> [i32; 1] {
        [(self.angle * (16384.0 / TURN)) as i32]
    }

    fn turned_back(&mut self) -> f32 {
        let back = whole_turns(self.angle);
        self.angle -= back;
        back
    }
}

/// Joint: J_l q'' = K (q_m - q) - B_l q', J_m q_m'' = K (q - q_m) - B_m q_m' + K_t u in four steps per tick, without
/// gravity; encoders of 20 bits.
#[derive(Default)]
struct TwoShafts {
    link: Shaft,
    motor: Shaft,
}

impl Plant<2> for TwoShafts {
    fn goes_on(&mut self, u: f32) {
        const OF: JointData = JointData::TABLE_I;
        let Self { link, motor } = self;
        for _ in 0..4 {
            let wound = OF.stiffness_n_m as f32 * (motor.angle - link.angle);
            let of_link = wound - OF.link_damping_n_m_s as f32 * link.speed;
            let of_motor = OF.torque_n_m_per_a as f32 * u - wound - OF.motor_damping_n_m_s as f32 * motor.speed;
            link.speed += 2.5e-4 * of_link / OF.link_inertia_kg_m2 as f32;
            motor.speed += 2.5e-4 * of_motor / OF.motor_inertia_kg_m2 as f32;
            link.angle += 2.5e-4 * link.speed;
            motor.angle += 2.5e-4 * motor.speed;
        }
    }

    fn counts(&self) -> [i32; 2] {
        [&self.link, &self.motor].map(|shaft| (shaft.angle * (1_048_576.0 / TURN)) as i32)
    }

    fn turned_back(&mut self) -> f32 {
        let back = whole_turns(self.link.angle);
        self.link.angle -= back;
        self.motor.angle -= back;
        back
    }
}

const TURN: f32 = core::f32::consts::TAU;

fn whole_turns(angle: f32) -> f32 {
    TURN * (angle / TURN) as i32 as f32
}

/// Returns the target at an angle and a speed, with further derivatives 0.
fn target<const N: usize>(angle: f32, speed: f32) -> Target<f32, i32, N> {
    let turn = (angle / TURN) as i32;
    let mut jet = [0.0; N];
    (jet[0], jet[1]) = (angle - TURN * turn as f32, speed);
    Target { turn, jet }
}

/// Compares the law of a drive with the functions of its file, on a plant with a limited speed.
fn compare_drive<L, P, const E: usize, const N: usize, const NUMBERS: usize, const COUNTS: usize>(
    name: &str,
    law: &L,
    mut plant: P,
    fastest: f32,
    exported: &Exported<DriveState<NUMBERS, COUNTS, E>, DriveSample<N, E>>,
) where
    L: ControlLaw<Scalar = f32, Sample = Sample<i32, Target<f32, i32, N>, E>, Output = Output<f32>>,
    P: Plant<E>,
{
    let mut luck = Luck(2_463_534_242);
    let (mut of_u, mut of_all) = (DriveState::ZEROS, DriveState::ZEROS);
    let (mut state, mut bad) = (None, 0);
    let (mut goal, mut speed, mut u) = (0.0, 0.0, 0.0);
    let mut seen = Seen::default();
    let mut end = target(goal, speed);
    let mut done = 0;
    while done < TICKS {
        if luck.one_in(2000) {
            speed = luck.within(fastest);
        }
        if luck.one_in(20_000) {
            goal += luck.within(9.0);
        }
        plant.goes_on(u);
        goal += 1e-3 * speed;
        let begin = core::mem::replace(&mut end, target(goal, speed));
        let mut sample = Sample { counts: plant.counts().map(Some), begin, end };
        if luck.one_in(300) {
            bad = 1 + luck.next() % if luck.one_in(20) { 80 } else { 5 };
        }
        if bad > 0 {
            bad -= 1;
            for count in &mut sample.counts {
                if luck.one_in(4) {
                    *count = Some(luck.next() as i32);
                }
                if luck.one_in(3) {
                    *count = None;
                }
            }
            if luck.one_in(20) {
                (sample.begin.jet[1], sample.end.jet[0]) = (luck.bad(), luck.bad());
            }
        }
        let given = DriveSample::from(&sample);
        if state.is_none() || luck.one_in(10_000) {
            let started = law.start(&sample);
            seen.agree(started.is_some(), [&mut of_u, &mut of_all].map(|of| (exported.start)(of, &given)));
            seen.starts += u32::from(started.is_some());
            if started.is_some() {
                // After a start the drive has no revolutions, so plant and target are moved back too.
                goal -= plant.turned_back();
            }
            state = started.or(state);
        }
        let Some(state) = &mut state else { continue };
        if luck.one_in(100) {
            let held = if luck.one_in(5) { luck.bad() } else { luck.within(10.0) };
            let taken = L::report_applied(state, held);
            seen.agree(taken, [&mut of_u, &mut of_all].map(|of| (exported.report_applied)(of, held)));
        }
        let output = law.tick(state, &sample);
        let mut told = TickOutput::default();
        u = (exported.tick_u)(&mut of_u, &given);
        let health = (exported.tick)(&mut of_all, &given, &mut told);
        seen.compare(&output, u, told, health);
        done += 1;
    }
    seen.tell(name);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(chip) = Peripherals::take() else { unreachable!() };
    log::start(chip.USART2, &chip.RCC, &chip.GPIOA);
    compare(
        "order 2",
        &JOINT_2,
        &Exported {
            start: joint_r2_start,
            tick_u: joint_r2_tick_u,
            tick: joint_r2_tick,
            report_applied: joint_r2_report_applied,
        },
    );
    compare(
        "order 3",
        &JOINT_3,
        &Exported {
            start: joint_r3_start,
            tick_u: joint_r3_tick_u,
            tick: joint_r3_tick,
            report_applied: joint_r3_report_applied,
        },
    );
    compare_drive(
        "motor",
        &OF_MOTOR,
        Shaft::default(),
        20.0,
        &Exported { start: motor_start, tick_u: motor_tick_u, tick: motor_tick, report_applied: motor_report_applied },
    );
    compare_drive(
        "joint",
        &OF_JOINT,
        TwoShafts::default(),
        2.0,
        &Exported {
            start: joint_drive_start,
            tick_u: joint_drive_tick_u,
            tick: joint_drive_tick,
            report_applied: joint_drive_report_applied,
        },
    );
    defmt::println!("assembly ends");
    loop {
        asm::wfi();
    }
}
