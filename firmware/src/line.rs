//! USART1 with a memory: bytes that come while the main loop is at work are kept.
//!
//! The interrupt of the port takes them, below the control interrupt in priority, so that this never waits. A byte must
//! be taken within the 87 us of the next: where the control interrupt once takes longer, one is lost, the checksum of
//! its frame fails, and the host asks again.

use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};

use stm32f4::stm32f405::{GPIOA, RCC, USART1};

use crate::uart::Uart;

/// Five requests.
const KEPT: usize = 256;

static BYTES: [AtomicU8; KEPT] = [const { AtomicU8::new(0) }; KEPT];
/// Bytes that have come, and those that have been taken, modulo 2^32.
static COME: AtomicU32 = AtomicU32::new(0);
static TAKEN: AtomicU32 = AtomicU32::new(0);

/// The port; its interrupt must be let through, and its handler be [`received`].
pub struct Line(Uart);

impl Line {
    /// Transmits on PA9, receives on PA10.
    pub fn start(usart1: USART1, rcc: &RCC, gpioa: &GPIOA) -> Self {
        let port = Uart::on_usart1(usart1, rcc, gpioa);
        port.interrupt_at_a_byte();
        Self(port)
    }

    /// The oldest byte that nobody has taken.
    pub fn read(&mut self) -> Option<u8> {
        let taken = TAKEN.load(Ordering::Relaxed);
        (COME.load(Ordering::Acquire) != taken).then(|| {
            let byte = BYTES[taken as usize % KEPT].load(Ordering::Relaxed);
            TAKEN.store(taken.wrapping_add(1), Ordering::Release);
            byte
        })
    }

    /// Sends all bytes; returns when the last one is in the shift register.
    pub fn write(&mut self, bytes: &[u8]) {
        self.0.write(bytes);
    }
}

/// The handler of USART1. When the memory is full the byte is lost.
pub fn received() {
    if let Some(byte) = Uart::arrived_on_usart1() {
        let come = COME.load(Ordering::Relaxed);
        if come.wrapping_sub(TAKEN.load(Ordering::Acquire)) < KEPT as u32 {
            BYTES[come as usize % KEPT].store(byte, Ordering::Relaxed);
            COME.store(come.wrapping_add(1), Ordering::Release);
        }
    }
}
