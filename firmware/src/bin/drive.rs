//! What a motor drive looks like: a timer interrupt at 10 kHz samples, ticks and actuates; the main loop tells how it
//! goes.
//!
//! The joint is a stand-in on the chip, so that this runs on any board and in the emulator. What a board replaces
//! is marked `BOARD`. `docs/linking.md` goes through this file line by line.
#![no_std]
#![no_main]

use core::cell::RefCell;

use controller_core::{
    Config, Fallback, FlexibleJoint, History, JointParameters, Limits, Nominal, ObserverGains, Options, Output,
    ReachingLaw, Reading, Record, Running, Surface, controller, design,
};
use cortex_m::asm;
use critical_section::Mutex;
use firmware::{clock, fault, joint, log, ticker};
use stm32f4::stm32f405::{Peripherals, interrupt};

const TICK_HZ: u32 = 10_000;
const PERIOD_S: f64 = 1.0 / TICK_HZ as f64;
/// Ticks between two reports: 0.2 s.
const REPORT_EVERY: u32 = TICK_HZ / 5;

/// A chain of order 4, observers of order 2 in channels 2 and 4.
type Drive = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [2, 4]);
const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Physical).nominal();
const OBSERVER: ObserverGains<2> = ObserverGains::from_bandwidth::<2>(100.0);

design! {
/// Designed by the compiler, kept in flash. A bad design does not compile, and the error says why.
static CONTROLLER: Drive = Drive::design(
    &Config {
        period_s: PERIOD_S,
        surface: Surface::from_bandwidth(10.0, 10.0),
        observers: [None, Some(OBSERVER), None, Some(OBSERVER)],
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.0, epsilon: 0.01 },
        nominal: NOMINAL,
        options: Options::NEUTRAL
            .with_limits(Limits::symmetric(30.0))
            .with_fallback(Fallback::Safe(0.0))
            .with_sigma_star_bound(10.0),
    },
    FlexibleJoint::<f32>::new(&NOMINAL),
);
}

/// What the interrupt leaves for the main loop, and for the moment after a fault.
struct Seen {
    history: History<f32, 4, 16>,
    worst: u32,
    missed: u32,
}

static SEEN: Mutex<RefCell<Seen>> = Mutex::new(RefCell::new(Seen { history: History::new(), worst: 0, missed: 0 }));

#[interrupt]
fn TIM3() {
    static mut LOOP: Running<CONTROLLER> = Running::new(CONTROLLER);
    static mut JOINT: joint::Joint = joint::Joint::new();
    static mut TICK: u32 = 0;
    static mut WORST: u32 = 0;

    ticker::acknowledge();
    JOINT.advance(PERIOD_S as f32); // BOARD: goes; the motor has moved by itself
    let began = clock::now();
    let x = JOINT.sample(); // BOARD: read the encoders, convert to chain coordinates
    let output = LOOP.tick(&x);
    JOINT.drive(output.u); // BOARD: write the PWM; if it holds anything else, `LOOP.report_applied(held)`
    critical_section::with(|cs| {
        if let Ok(mut seen) = SEEN.borrow(cs).try_borrow_mut() {
            seen.history.push(Record { tick: *TICK, x, output });
            seen.worst = *WORST;
            seen.missed += u32::from(ticker::is_due());
        }
    });
    *TICK = TICK.wrapping_add(1);
    *WORST = (*WORST).max(clock::now().wrapping_sub(began));
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let (Some(core), Some(chip)) = (cortex_m::Peripherals::take(), Peripherals::take()) else { unreachable!() };
    fault::respond_with(fault::Response { switch_off, last_words: black_box });
    log::start(chip.USART2, &chip.RCC, &chip.GPIOA);
    let unit = clock::start(core.DCB, core.DWT, chip.TIM2, &chip.RCC);
    let period = ticker::start(chip.TIM3, &chip.RCC, TICK_HZ);
    defmt::println!("drive: {=u32} Hz, time in {}", TICK_HZ, unit);

    let mut reported = 0;
    loop {
        asm::wfi();
        let seen = critical_section::with(|cs| {
            let seen = SEEN.borrow_ref(cs);
            seen.history.oldest_first().next_back().map(|newest| (*newest, seen.worst, seen.missed))
        });
        if let Some((newest, worst, missed)) = seen
            && newest.tick.wrapping_sub(reported) >= REPORT_EVERY
        {
            reported = newest.tick;
            report(&newest, worst, missed, period, unit);
        }
    }
}

/// After a panic or a hard fault, at once.
fn switch_off() {} // BOARD: the power stage

/// And then: the last ticks, oldest first.
fn black_box() {
    critical_section::with(|cs| {
        if let Ok(seen) = SEEN.borrow(cs).try_borrow() {
            seen.history.oldest_first().for_each(|record| defmt::error!("{}", record));
        }
    });
}

fn report(newest: &Record<f32, 4>, worst: u32, missed: u32, period: u32, unit: clock::Unit) {
    let Record { tick, x: [y, ..], output: Output { u, sigma_star, health, .. } } = *newest;
    defmt::println!(
        "t = {=f32} s, y = {=f32} rad, sigma* = {=f32} rad/s^3, u = {=f32} A, {}; interrupt: worst {=u32} of {=u32} \
         {}, headroom {=u32} %, {=u32} ticks missed",
        tick as f32 / TICK_HZ as f32,
        y,
        sigma_star,
        u,
        health,
        worst,
        period,
        unit,
        period.saturating_sub(worst) * 100 / period,
        missed,
    );
}
