//! What the three images share on an STM32F405: a serial port, a log that leaves through another one, a stopwatch, and
//! last words after a fault.
//!
//! | image | what it does |
//! |---|---|
//! | `pil` | answers the host over USART1: the processor in the loop |
//! | `drive` | what a motor drive looks like; the example to copy |
//! | `budget` | what one tick costs |
//!
//! There is no hardware abstraction layer and no clock set-up: the core runs from its internal oscillator as after
//! reset, [`CORE_HZ`], on any board and in an emulator that does not model the clock tree. Everything but
//! [`uart::Uart`]'s pins would read the same on another Cortex-M4F.
#![no_std]

pub mod clock;
pub mod fault;
pub mod joint;
pub mod log;
pub mod ticker;
pub mod uart;

/// Core, bus and timer clocks after reset, Hz: the internal oscillator, all prescalers 1.
pub const CORE_HZ: u32 = 16_000_000;
