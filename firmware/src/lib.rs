//! What the images share on an STM32F405: a serial port, a log that leaves through another one, a stopwatch, last words
//! after a fault, a drive that is tuned while it runs, and the tick as assembly.
//!
//! | image | what it does |
//! |---|---|
//! | `pil` | answers the host over USART1: the processor in the loop |
//! | `drive` | a joint with two encoders at 3.2 kHz; the example to copy |
//! | `motor` | the same of a motor with one encoder at 5 kHz |
//! | `budget` | what one tick costs |
//! | `assembly` | the tick as assembly beside the Rust tick, bit for bit |
//!
//! There is no hardware abstraction layer and no clock set-up: the core runs from its internal oscillator as after
//! reset, [`CORE_HZ`], on any board and in an emulator that does not model the clock tree. Everything but
//! [`uart::Uart`]'s pins would read the same on another Cortex-M4F.
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

/// Core, bus and timer clocks after reset, Hz: the internal oscillator, all prescalers 1.
pub const CORE_HZ: u32 = 16_000_000;
