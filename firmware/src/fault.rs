//! Reaction to a panic or a hard fault: switch off, log the place, log the trace buffer, stop.
//!
//! The log takes milliseconds, which is too long for a power stage. The switch-off therefore precedes the log.

use core::cell::Cell;
use core::panic::PanicInfo;

use cortex_m::{asm, interrupt};
use cortex_m_rt::{ExceptionFrame, exception};
use critical_section::Mutex;

use crate::log;

/// Reaction of an image to a fault. Both functions run with interrupts masked and must not block.
#[derive(Clone, Copy)]
pub struct Response {
    /// First step: switches off everything that can cause harm.
    pub switch_off: fn(),
    /// Second step: logs data that may explain the fault.
    pub last_words: fn(),
}

static RESPONSE: Mutex<Cell<Response>> = Mutex::new(Cell::new(Response { switch_off: || {}, last_words: || {} }));

/// Sets the reaction of this image.
pub fn respond_with(response: Response) {
    critical_section::with(|cs| RESPONSE.borrow(cs).set(response));
}

/// Triggers a fault for tests: a debugger would stop here; the emulator shows the reaction of the chip.
pub fn provoke() -> ! {
    asm::udf()
}

#[panic_handler]
fn panicked(info: &PanicInfo<'_>) -> ! {
    let response = switched_off();
    let (file, line) = info.location().map_or(("an unknown place", 0), |at| (at.file(), at.line()));
    defmt::error!("panic at {=str}:{=u32}", file, line);
    stop(response)
}

// SAFETY: the handler never returns and uses no data of the interrupted code, except the log line, which it takes over.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    let response = switched_off();
    defmt::error!("hard fault at {=u32:#010x}, called from {=u32:#010x}", frame.pc(), frame.lr());
    stop(response)
}

/// Masks interrupts, switches off and takes over the log.
fn switched_off() -> Response {
    interrupt::disable();
    let response = critical_section::with(|cs| RESPONSE.borrow(cs).get());
    (response.switch_off)();
    // SAFETY: no other code runs after this point.
    unsafe { log::take_over() };
    response
}

fn stop(response: Response) -> ! {
    (response.last_words)();
    defmt::error!("stopped");
    loop {
        asm::wfi();
    }
}
