//! After a panic or a hard fault: switch off, say where, say the image's last words (its black box), stop.
//!
//! The log takes milliseconds; a power stage must not wait for it. So what switches it off comes before the first word.

use core::cell::Cell;
use core::panic::PanicInfo;

use cortex_m::{asm, interrupt};
use cortex_m_rt::{ExceptionFrame, exception};
use critical_section::Mutex;

use crate::log;

/// What an image does after a fault. Both run with interrupts masked, and must not wait for anyone.
#[derive(Clone, Copy)]
pub struct Response {
    /// At once: switch off whatever can do harm.
    pub switch_off: fn(),
    /// Then, through the log: what may explain it.
    pub last_words: fn(),
}

static RESPONSE: Mutex<Cell<Response>> = Mutex::new(Cell::new(Response { switch_off: || {}, last_words: || {} }));

/// Sets the response of this image.
pub fn respond_with(response: Response) {
    critical_section::with(|cs| RESPONSE.borrow(cs).set(response));
}

/// What a debugger would stop at; shows in the emulator what a fault on the chip leaves behind.
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

// SAFETY: the handler neither returns nor touches what the faulting code may have left half done, but the line of the
// log, which it takes over.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    let response = switched_off();
    defmt::error!("hard fault at {=u32:#010x}, called from {=u32:#010x}", frame.pc(), frame.lr());
    stop(response)
}

/// Interrupts masked, harm averted, and the log ours.
fn switched_off() -> Response {
    interrupt::disable();
    let response = critical_section::with(|cs| RESPONSE.borrow(cs).get());
    (response.switch_off)();
    // SAFETY: nobody runs after this.
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
