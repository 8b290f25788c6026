//! Buffered USART1: bytes that arrive while the main loop is busy are stored.
//!
//! The port's interrupt stores the bytes, with a priority below the control interrupt, so that the control interrupt
//! never waits. A byte must be read within 87 us, before the next one. If the control interrupt takes longer once, a
//! byte is lost, the checksum of its frame fails, and the host repeats the request.

use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};

use stm32f4::stm32f405::{GPIOA, RCC, USART1};

use crate::uart::Uart;

/// Size of the buffer, bytes: five requests.
const KEPT: usize = 256;

static BYTES: [AtomicU8; KEPT] = [const { AtomicU8::new(0) }; KEPT];
/// Numbers of received and of consumed bytes, modulo 2^32.
static COME: AtomicU32 = AtomicU32::new(0);
static TAKEN: AtomicU32 = AtomicU32::new(0);

/// Buffered port; its interrupt must be enabled and its handler must call [`received`].
pub struct Line(Uart);

impl Line {
    /// Starts the port: transmits on PA9, receives on PA10.
    pub fn start(usart1: USART1, rcc: &RCC, gpioa: &GPIOA) -> Self {
        let port = Uart::on_usart1(usart1, rcc, gpioa);
        port.interrupt_at_a_byte();
        Self(port)
    }

    /// Returns the oldest unread byte.
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

/// Handler of USART1; a byte is lost if the buffer is full.
pub fn received() {
    if let Some(byte) = Uart::arrived_on_usart1() {
        let come = COME.load(Ordering::Relaxed);
        if come.wrapping_sub(TAKEN.load(Ordering::Acquire)) < KEPT as u32 {
            BYTES[come as usize % KEPT].store(byte, Ordering::Relaxed);
            COME.store(come.wrapping_add(1), Ordering::Release);
        }
    }
}
