//! defmt messages leave through USART2; the host decodes them with the image at hand.
//!
//! **No interrupt is masked while a message goes out.** It takes 2 ms on the line; a critical section of that length
//! would cost a drive twenty ticks. Instead a frame belongs to who began it: what an interrupt says in the middle of
//! somebody's frame is not heard. Handlers nest like calls on one core, so a depth is all there is to keep.

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
    /// The port, as the encoder wants it, next to the encoder itself.
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
    /// Frames begun and not ended. Only the outermost is sent.
    depth: AtomicU32,
    line: UnsafeCell<Line>,
}

// SAFETY: `line` is touched by the owner of the outermost frame alone; who finds a frame open leaves it alone, and on
// one core it ends its own before that owner goes on.
unsafe impl Sync for Log {}

static LOG: Log = Log { depth: AtomicU32::new(0), line: UnsafeCell::new(Line { port: None, encoder: Encoder::new() }) };

impl Log {
    /// Begins a frame, and says whether it is the outermost.
    fn enter(&self) -> bool {
        self.depth.fetch_add(1, Ordering::Acquire) == 0
    }

    fn is_outermost(&self) -> bool {
        self.depth.load(Ordering::Relaxed) == 1
    }

    fn leave(&self) {
        self.depth.fetch_sub(1, Ordering::Release);
    }

    /// # Safety
    /// Only between `enter` and `leave`, for the owner of the outermost frame, one borrow at a time.
    #[allow(clippy::mut_from_ref)]
    unsafe fn line(&self) -> &mut Line {
        // SAFETY: as the caller promises.
        unsafe { &mut *self.line.get() }
    }
}

/// Switches the log on; what was said before is lost.
pub fn start(usart2: USART2, rcc: &RCC, gpioa: &GPIOA) {
    let port = Uart::on_usart2(usart2, rcc, gpioa);
    if LOG.enter() {
        // SAFETY: outermost, and borrowed for this statement.
        unsafe { LOG.line() }.port = Some(port);
    }
    LOG.leave();
}

/// Gives up a frame that is still open, so that the handler of a fault is heard.
///
/// # Safety
/// Who was interrupted must never run again.
pub(crate) unsafe fn take_over() {
    if LOG.depth.swap(0, Ordering::Acquire) > 0 && LOG.enter() {
        // SAFETY: outermost, and the former owner is gone. A new encoder begins with an end of frame.
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

    /// Nothing is kept back: `Uart::write` returns when the last byte is on its way.
    unsafe fn flush() {}
}
