//! Log: defmt messages over USART2; the host decodes them with the image.
//!
//! **A message masks no interrupt.** A message takes 2 ms on the line; a critical section of that length would cost a
//! drive twenty ticks. Instead, a frame belongs to the code that began it. A message from an interrupt in the middle of
//! another frame is dropped. Handlers nest like calls on one core, so a depth counter is sufficient.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};

use defmt::{Encoder, Logger, global_logger};
use stm32f4::stm32f405::{GPIOA, RCC, USART2};

use crate::uart::Uart;

struct Line {
    port: Option<Uart>,
    encoder: Encoder,
}

impl Line {
    /// Returns the encoder and the port as a byte sink.
    fn split(&mut self) -> (&mut Encoder, impl FnMut(&[u8])) {
        let Self { port, encoder } = self;
        (encoder, move |bytes: &[u8]| {
            if let Some(port) = port {
                port.write(bytes);
            }
        })
    }
}

struct Log {
    /// Number of open frames; only the outermost frame is sent.
    depth: AtomicU32,
    line: UnsafeCell<Line>,
}

// SAFETY: only the owner of the outermost frame uses `line`. Nested code leaves it alone, and on one core it ends
// before that owner continues.
unsafe impl Sync for Log {}

static LOG: Log = Log { depth: AtomicU32::new(0), line: UnsafeCell::new(Line { port: None, encoder: Encoder::new() }) };

impl Log {
    /// Begins a frame; returns whether it is the outermost.
    fn enter(&self) -> bool {
        self.depth.fetch_add(1, Ordering::Acquire) == 0
    }

    fn is_outermost(&self) -> bool {
        self.depth.load(Ordering::Relaxed) == 1
    }

    fn leave(&self) {
        self.depth.fetch_sub(1, Ordering::Release);
    }

    /// Returns the line.
    ///
    /// # Safety
    /// Only between `enter` and `leave`, for the owner of the outermost frame, one borrow at a time.
    #[allow(clippy::mut_from_ref)]
    unsafe fn line(&self) -> &mut Line {
        // SAFETY: guaranteed by the caller.
        unsafe { &mut *self.line.get() }
    }
}

/// Starts the log; earlier messages are lost.
pub fn start(usart2: USART2, rcc: &RCC, gpioa: &GPIOA) {
    let port = Uart::on_usart2(usart2, rcc, gpioa);
    if LOG.enter() {
        // SAFETY: outermost, and borrowed for this statement.
        unsafe { LOG.line() }.port = Some(port);
    }
    LOG.leave();
}

/// Discards an open frame, so that a fault handler can log.
///
/// # Safety
/// The interrupted code must never continue.
pub(crate) unsafe fn take_over() {
    if LOG.depth.swap(0, Ordering::Acquire) > 0 && LOG.enter() {
        // SAFETY: outermost, and the former owner never continues. A new encoder begins with an end of frame.
        unsafe { LOG.line() }.encoder = Encoder::new();
        LOG.leave();
    }
}

#[global_logger]
struct Global;

// SAFETY: frames are sent whole and in order, see `Log`; defmt calls acquire, write .. write, release.
unsafe impl Logger for Global {
    fn acquire() {
        if LOG.enter() {
            // SAFETY: outermost.
            let (encoder, send) = unsafe { LOG.line() }.split();
            encoder.start_frame(send);
        }
    }

    unsafe fn write(bytes: &[u8]) {
        if LOG.is_outermost() {
            // SAFETY: outermost.
            let (encoder, send) = unsafe { LOG.line() }.split();
            encoder.write(bytes, send);
        }
    }

    unsafe fn release() {
        if LOG.is_outermost() {
            // SAFETY: outermost.
            let (encoder, send) = unsafe { LOG.line() }.split();
            encoder.end_frame(send);
        }
        LOG.leave();
    }

    /// Does nothing: `Uart::write` returns when the last byte is in the shift register.
    unsafe fn flush() {}
}
