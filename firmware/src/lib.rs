//! Common code of the images on an STM32F405: a serial port, a log through a second port, a stopwatch, the reaction to
//! faults, a drive that is tuned during operation, and the assembly ticks.
//!
//! | image | function |
//! |---|---|
//! | `pil` | answers the host over USART1: processor in the loop |
//! | `drive` | a joint with two encoders at 3.2 kHz; the example to copy |
//! | `motor` | a motor with one encoder at 5 kHz |
//! | `budget` | cost of one tick |
//! | `assembly` | bit-for-bit comparison of the assembly ticks with the Rust tick |
//!
//! The images use no hardware abstraction layer and no clock set-up. The core runs from its internal oscillator as
//! after reset, [`CORE_HZ`], on any board, and in an emulator without a clock tree. [`clock`], [`ticker`], [`line`] and
//! [`uart`] use timers and ports of this chip; the rest suits any Cortex-M4F.
#![no_std]

pub mod assembly;
pub mod clock;
pub mod fault;
pub mod line;
pub mod live;
pub mod log;
pub mod stand_in;
pub mod ticker;
pub mod uart;

/// Core, bus and timer clocks after reset, Hz: internal oscillator, all prescalers 1.
pub const CORE_HZ: u32 = 16_000_000;
