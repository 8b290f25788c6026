//! Example of a motor's drive with one encoder at 5 kHz: [`drive`](../drive/index.html) with another data sheet.
#![no_std]
#![no_main]

use core::mem::MaybeUninit;

use controller_core::drive::{BRAKING, Encoder, Motor, MotorDesign, MotorDrive, Position};
use controller_core::{Fallback, Limits};
use cortex_m_rt::exception;
use firmware::line::{self, Line};
use firmware::live::{self, Clock, Drive};
use firmware::{clock, fault, log, stand_in, ticker};
use pil_wire::{Live, Seat, halves};
use stm32f4::stm32f405::{Peripherals, interrupt};

const TICK_HZ: u32 = 5_000;
const PERIOD_S: f64 = 1.0 / TICK_HZ as f64;

/// Data sheet of the motor with its load; further: encoder, power stage and parameter errors.
const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
const ENCODER: Encoder = Encoder::absolute(14);
const UNCERTAIN: f64 = 0.2;

const DESIGN: MotorDesign = MotorDesign {
    fallback: Fallback::Safe(0.0),
    ..MotorDesign::by_rule(PERIOD_S, MOTOR, ENCODER, Limits::symmetric(10.0))
};

/// Control law with two gain sets and no delay.
type Law = MotorDrive<f32, Position, 1>;
/// Coefficients, designed by the compiler: an invalid design is a compile error with the reason.
const LAW: Law = Law::design(&DESIGN);

static DRIVE: Drive<Law, 1, 2> = Drive::new();

#[interrupt]
fn TIM3() {
    DRIVE.tick(counts, actuate);
}

#[interrupt]
fn EXTI0() {
    DRIVE.change(counts, actuate);
}

/// BOARD: read the timer in encoder mode; `None` for a count with a wrong checksum.
#[inline(always)]
fn counts() -> [Option<i32>; 1] {
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

/// BOARD: remove; the real motor moves by itself.
#[exception]
fn PendSV() {
    static mut MOTOR_ITSELF: stand_in::Motor = stand_in::Motor::new(MOTOR, ENCODER.counts_per_turn);
    stand_in::advance(MOTOR_ITSELF, PERIOD_S as f32);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut SEAT: MaybeUninit<Seat<Law, 1, 2>> = MaybeUninit::uninit();

    let (Some(core), Some(chip)) = (cortex_m::Peripherals::take(), Peripherals::take()) else { unreachable!() };
    fault::respond_with(fault::Response { switch_off, last_words: || DRIVE.last_words() });
    log::start(chip.USART2, &chip.RCC, &chip.GPIOA);
    let unit = clock::start(core.DCB, core.DWT, chip.TIM2, &chip.RCC);
    let line = Line::start(chip.USART1, &chip.RCC, &chip.GPIOA);

    // At an alarm the drive brakes, then outputs the safe current until a reset.
    let bounds = DESIGN.bounds(&LAW, UNCERTAIN);
    let numbers = DESIGN.to_numbers().into_iter().chain(bounds.to_numbers()).chain([f64::from(BRAKING.bits())]);
    let Ok((live, law)) = Live::new(numbers.flat_map(halves)) else { unreachable!() };
    DRIVE.begin(live::seat(SEAT, law));

    live::assume_modes(&core.FPU);
    live::unmask(core.NVIC);
    let period = ticker::start(chip.TIM3, &chip.RCC, TICK_HZ);
    defmt::println!("motor: {=u32} Hz, time in {}", TICK_HZ, unit);
    live::serve(&DRIVE, live, line, Clock { unit, period, tick_hz: TICK_HZ })
}
