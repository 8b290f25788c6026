//! Example of a joint's drive. A timer interrupt at 3.2 kHz reads two encoders, runs the tick and writes the current.
//! The main loop answers `host-sim live` over USART1, which observes, moves and tunes the drive during operation.
//!
//! The joint is simulated on the chip, so the example runs on any board and in the emulator. Parts to replace on a
//! board are marked `BOARD`. `docs/rust.md` explains the parts of this file.
#![no_std]
#![no_main]

use core::mem::MaybeUninit;

use controller_core::drive::{BRAKING, Coupled, CoupledDrive, Encoder, Joint, JointBandwidths, JointDesign, Position};
use controller_core::{Fallback, Limits};
use cortex_m_rt::exception;
use firmware::line::{self, Line};
use firmware::live::{self, Clock, Drive};
use firmware::{clock, fault, log, stand_in, ticker};
use pil_wire::{Live, Seat, halves};
use stm32f4::stm32f405::{Peripherals, interrupt};

const TICK_HZ: u32 = 3_200;
const PERIOD_S: f64 = 1.0 / TICK_HZ as f64;

/// Data sheet of the joint; further: encoders (one revolution of the link on each, 20 bits) and power stage.
const JOINT: Joint = Joint::TABLE_I;
const ENCODER: Encoder = Encoder::absolute(20);
/// Largest load step, N m, and the parameter errors of the data sheets.
const SUDDEN_LOAD_N_M: f64 = 1.3;
const UNCERTAIN: f64 = 0.2;

/// Gains by rule for this data sheet, as `host-sim export firmware/drive.toml --lang rust` writes them: the poles of a
/// rigid shaft and of the observers of both encoders; the lag of the current loop, and the high gain set.
const BANDWIDTHS: JointBandwidths = JointBandwidths {
    surface_rad_s: 64.390_839_063_667_1,
    reaching_per_s: 484.464_408_193_304_96,
    link_rad_s: 55.892_804_026_864_155,
    motor_rad_s: 799.950_924_290_278_3,
    offset_per_s: 32.195_419_531_833_55,
};
const COUPLED: Coupled = Coupled { calm_steps: [1.0, 9.787_052_753_304_266], ..Coupled::behind(&[ENCODER; 2], 2e-4) };
const FAST_RATIOS: [f64; 2] = [4.0, 0.7];

const DESIGN: JointDesign = JointDesign {
    fallback: Fallback::Safe(0.0),
    fast_ratios: FAST_RATIOS,
    ..JointDesign::new(PERIOD_S, JOINT, [ENCODER; 2], Limits::symmetric(30.0), SUDDEN_LOAD_N_M).coupled_by(
        COUPLED,
        BANDWIDTHS,
        SUDDEN_LOAD_N_M,
    )
};

/// Control law of the joint as a whole, with two gain sets and no delay.
type Law = CoupledDrive<f32, Position, 1>;
/// Coefficients, designed by the compiler: an invalid design is a compile error with the reason.
const LAW: Law = Law::design(&DESIGN);

static DRIVE: Drive<Law, 2, 4> = Drive::new();

#[interrupt]
fn TIM3() {
    DRIVE.tick(counts, actuate);
}

#[interrupt]
fn EXTI0() {
    DRIVE.change(counts, actuate);
}

/// BOARD: read both timers in encoder mode; `None` for a count with a wrong checksum.
#[inline(always)]
fn counts() -> [Option<i32>; 2] {
    stand_in::counts()
}

/// BOARD: write the PWM.
#[inline(always)]
fn actuate(u: f32) {
    stand_in::hold(u);
}

/// Switches off at once after a panic or a hard fault.
fn switch_off() {} // BOARD: the power stage

#[interrupt]
fn USART1() {
    line::received();
}

/// BOARD: remove; the real joint moves by itself.
#[exception]
fn PendSV() {
    static mut JOINT_ITSELF: stand_in::Joint = stand_in::Joint::new(JOINT, ENCODER.counts_per_turn);
    stand_in::advance(JOINT_ITSELF, PERIOD_S as f32);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut SEAT: MaybeUninit<Seat<Law, 2, 4>> = MaybeUninit::uninit();

    let (Some(core), Some(chip)) = (cortex_m::Peripherals::take(), Peripherals::take()) else { unreachable!() };
    fault::respond_with(fault::Response { switch_off, last_words: || DRIVE.last_words() });
    log::start(chip.USART2, &chip.RCC, &chip.GPIOA);
    let unit = clock::start(core.DCB, core.DWT, chip.TIM2, &chip.RCC);
    let line = Line::start(chip.USART1, &chip.RCC, &chip.GPIOA);

    // At an alarm the drive brakes, then outputs the safe current until a reset.
    let bounds = DESIGN.bounds(&LAW, SUDDEN_LOAD_N_M, UNCERTAIN);
    let Some(design) = DESIGN.to_coupled_numbers() else { unreachable!() };
    let numbers = design.into_iter().chain(bounds.to_numbers()).chain([f64::from(BRAKING.bits())]);
    let Ok((live, law)) = Live::new(numbers.flat_map(halves)) else { unreachable!() };
    DRIVE.begin(live::seat(SEAT, law));

    live::assume_modes(&core.FPU);
    live::unmask(core.NVIC);
    let period = ticker::start(chip.TIM3, &chip.RCC, TICK_HZ);
    defmt::println!("drive: {=u32} Hz, time in {}", TICK_HZ, unit);
    live::serve(&DRIVE, live, line, Clock { unit, period, tick_hz: TICK_HZ })
}
