//! What the drive of a joint looks like: a timer interrupt at 5 kHz reads two encoders, ticks and actuates; the main
//! loop plans the moves and tells how it goes.
//!
//! The joint is a stand-in on the chip, so that this runs on any board and in the emulator. What a board replaces
//! is marked `BOARD`. `docs/linking.md` goes through this file line by line.
#![no_std]
#![no_main]

use core::cell::RefCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicI32, AtomicU32, Ordering};

use controller_core::drive::{
    Axis, DriveEstimates, Encoder, Joined, Joint, JointBandwidths, JointDesign, JointDrive, Monitored, Position,
    Reference, Rest, Stretch, Target, gap,
};
use controller_core::{Fallback, Health, Limits, Output};
use cortex_m::asm;
use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use critical_section::Mutex;
use firmware::{clock, fault, joint, log, ticker};
use stm32f4::stm32f405::{Peripherals, interrupt};

const TICK_HZ: u32 = 5_000;
const PERIOD_S: f64 = 1.0 / TICK_HZ as f64;
/// Ticks between two reports: 0.2 s.
const REPORT_EVERY: u32 = TICK_HZ / 5;
/// Ticks of a move, and between two of them.
const MOVE_TICKS: u32 = TICK_HZ;
const MOVE_EVERY: u32 = 2 * TICK_HZ;
/// The main loop has so many ticks to plan a move.
const AHEAD: u32 = TICK_HZ / 50;

/// Data sheets: joint, encoders (one turn of the link on each, 20 bits), power stage.
const JOINT: Joint = Joint::TABLE_I;
const ENCODER: Encoder = Encoder::absolute(20);
/// The largest load that comes at once, N m, and how well the data sheets are known.
const SUDDEN_LOAD_N_M: f64 = 1.3;
const UNCERTAIN: f64 = 0.2;

const DESIGN: JointDesign = JointDesign {
    fallback: Fallback::Safe(0.0),
    ..JointDesign::new(PERIOD_S, JOINT, [ENCODER; 2], Limits::symmetric(30.0), SUDDEN_LOAD_N_M)
        .with_bandwidths(JointBandwidths::DEFAULT.within(PERIOD_S, 0), SUDDEN_LOAD_N_M)
};

/// Two gain sets, no delay.
type Drive = JointDrive<f32, Position, 1>;
/// Designed by the compiler, kept in flash. A bad design does not compile, and the error says why.
static DRIVE: Drive = Drive::design(&DESIGN);

type Law = Monitored<&'static Drive, 2>;
type Plan = Joined<f32, Rest<f32>, 4>;

/// What interrupt and main loop share.
struct Shared {
    /// Law, plan and the last 256 ticks.
    axis: &'static mut Axis<Law, Plan, 2, 4, 256>,
    newest: Output<f32>,
    worst: u32,
    missed: u32,
}

static SHARED: Mutex<RefCell<Option<Shared>>> = Mutex::new(RefCell::new(None));

/// Between the stand-in and the control interrupt: counts of link and motor, and the bits of the current.
static COUNTS: [AtomicI32; 2] = [AtomicI32::new(0), AtomicI32::new(0)];
static CURRENT: AtomicU32 = AtomicU32::new(0);

#[interrupt]
fn TIM3() {
    ticker::acknowledge();
    let began = clock::now();
    critical_section::with(|cs| {
        let Ok(mut shared) = SHARED.borrow(cs).try_borrow_mut() else { return };
        let Some(Shared { axis, newest, worst, missed }) = shared.as_mut() else { return };
        // BOARD: the counts of both timers in encoder mode; `None` for one whose checksum is wrong.
        let counts = [0, 1].map(|i| Some(COUNTS[i].load(Ordering::Relaxed)));
        // BOARD: where the power stage holds another current than it was told, `Some` of it instead of `None`.
        let output = axis.tick(counts, None);
        CURRENT.store(output.u.to_bits(), Ordering::Relaxed); // BOARD: write the PWM
        *newest = output;
        *worst = (*worst).max(clock::now().wrapping_sub(began));
        *missed += u32::from(ticker::is_due());
    });
    SCB::set_pendsv(); // BOARD: goes; the joint moves by itself
}

/// BOARD: goes. The stand-in, after the control interrupt has ended.
#[exception]
fn PendSV() {
    static mut STAND_IN: joint::Joint = joint::Joint::new(JOINT, ENCODER.counts_per_turn);
    STAND_IN.advance(f32::from_bits(CURRENT.load(Ordering::Relaxed)), PERIOD_S as f32);
    for (place, count) in COUNTS.iter().zip(STAND_IN.counts()) {
        place.store(count, Ordering::Relaxed);
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut AXIS: MaybeUninit<Axis<Law, Plan, 2, 4, 256>> = MaybeUninit::uninit();

    let (Some(core), Some(chip)) = (cortex_m::Peripherals::take(), Peripherals::take()) else { unreachable!() };
    fault::respond_with(fault::Response { switch_off, last_words: black_box });
    log::start(chip.USART2, &chip.RCC, &chip.GPIOA);
    let unit = clock::start(core.DCB, core.DWT, chip.TIM2, &chip.RCC);

    // An alarm stops the drive: the safe current goes out until it is reset.
    let bounds = DESIGN.bounds(&DRIVE, SUDDEN_LOAD_N_M, UNCERTAIN);
    let law = Monitored::new(&DRIVE, &bounds).stopping();
    let rest = Joined::new(Rest { turn: 0, angle: 0.0 }, [0.0; 4], 0, 1, PERIOD_S);
    let axis = AXIS.write(Axis::new(law, rest));
    let newest = Output { u: 0.0, sigma: 0.0, sigma_star: 0.0, health: Health::OK };
    critical_section::with(|cs| SHARED.borrow(cs).replace(Some(Shared { axis, newest, worst: 0, missed: 0 })));

    let period = ticker::start(chip.TIM3, &chip.RCC, TICK_HZ);
    defmt::println!("drive: {=u32} Hz, time in {}", TICK_HZ, unit);

    let (mut reported, mut next_move) = (0, TICK_HZ / 10);
    let mut goal = 0.0_f32;
    loop {
        asm::wfi();
        let Some(seen) = critical_section::with(|cs| SHARED.borrow_ref(cs).as_ref().map(Seen::of)) else { continue };
        if seen.tick.wrapping_sub(next_move) as i32 >= 0 {
            next_move = next_move.wrapping_add(MOVE_EVERY);
            goal = 1.0 - goal;
            // In 64 bits, in software: some ten thousand cycles, while the interrupt goes on.
            let start = seen.tick.wrapping_add(AHEAD);
            let plan = planned(&seen.plan, Rest { turn: 0, angle: goal }, start);
            critical_section::with(|cs| {
                if let Some(shared) = SHARED.borrow_ref_mut(cs).as_mut() {
                    shared.axis.play_at(start, plan);
                }
            });
        }
        if seen.tick.wrapping_sub(reported) >= REPORT_EVERY {
            reported = seen.tick;
            seen.report(period, unit);
        }
    }
}

/// From where the old plan will be at that tick, whatever the shaft does, to rest.
fn planned(present: &Plan, goal: Rest<f32>, start: u32) -> Plan {
    let (present, target): (Target<f32, i32, 4>, _) = (present.at(start), goal.at(start));
    Joined::new(goal, gap(&present, &target), start, MOVE_TICKS, PERIOD_S)
}

/// After a panic or a hard fault, at once.
fn switch_off() {} // BOARD: the power stage

/// And then: the last ticks, oldest first.
fn black_box() {
    critical_section::with(|cs| {
        if let Ok(shared) = SHARED.borrow(cs).try_borrow()
            && let Some(Shared { axis, .. }) = shared.as_ref()
        {
            let frames = axis.black_box().map(Stretch::frames);
            let count = frames.iter().map(|frames| frames.len()).sum::<usize>();
            for frame in frames.into_iter().flatten().skip(count.saturating_sub(16)) {
                defmt::error!("{}", frame);
            }
        }
    });
}

/// What the main loop sees of an axis.
struct Seen {
    tick: u32,
    plan: Plan,
    known: Option<DriveEstimates<f32, i32, 2>>,
    newest: Output<f32>,
    worst: u32,
    missed: u32,
}

impl Seen {
    fn of(shared: &Shared) -> Self {
        let Shared { axis, newest, worst, missed } = shared;
        let (tick, plan, known) = (axis.tick_number(), *axis.plan(), axis.running().estimates());
        Self { tick, plan, known, newest: *newest, worst: *worst, missed: *missed }
    }

    fn report(&self, period: u32, unit: clock::Unit) {
        let Self { tick, ref plan, ref known, newest: Output { u, sigma_star, health, .. }, worst, missed } = *self;
        let Target { jet: [r], .. } = plan.at(tick);
        let (link, load) = known.as_ref().map_or((0.0, 0.0), |known| (known.position[0], known.load[0]));
        defmt::println!(
            "t = {=f32} s, r = {=f32} rad, link {=f32} rad, load {=f32} N m, u = {=f32} A, \
             sigma* = {=f32} rad/s^3, {}; interrupt: worst {=u32} of {=u32} {}, headroom {=u32} %, {=u32} ticks missed",
            tick as f32 / TICK_HZ as f32,
            r,
            link,
            load,
            u,
            sigma_star,
            health,
            worst,
            period,
            unit,
            period.saturating_sub(worst) * 100 / period,
            missed,
        );
    }
}
