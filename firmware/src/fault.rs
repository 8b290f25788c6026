//! After a panic or a hard fault: say where, say the image's last words (its black box), stop.
//!
//! On a drive the last words begin with switching the power stage off.

use core::cell::Cell;
use core::panic::PanicInfo;

use cortex_m::{asm, interrupt};
use cortex_m_rt::{ExceptionFrame, exception};
use critical_section::Mutex;

use crate::log;

static LAST_WORDS: Mutex<Cell<fn()>> = Mutex::new(Cell::new(|| {}));

/// What to do before the chip stops. It runs with interrupts masked, and must not wait for anyone.
pub fn last_words(say: fn()) {
    critical_section::with(|cs| LAST_WORDS.borrow(cs).set(say));
}

/// What a debugger would stop at; shows in the emulator what a fault on the chip leaves behind.
pub fn provoke() -> ! {
    asm::udf()
}

#[panic_handler]
fn panicked(info: &PanicInfo<'_>) -> ! {
    interrupt::disable();
    // SAFETY: nobody runs after this.
    unsafe { log::take_over() };
    let (file, line) = info.location().map_or(("an unknown place", 0), |at| (at.file(), at.line()));
    defmt::error!("panic at {=str}:{=u32}", file, line);
    stop()
}

// SAFETY: the handler neither returns nor touches what the faulting code may have left half done, but the line of the
// log, which it takes over.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    interrupt::disable();
    // SAFETY: nobody runs after this.
    unsafe { log::take_over() };
    defmt::error!("hard fault at {=u32:#010x}, called from {=u32:#010x}", frame.pc(), frame.lr());
    stop()
}

fn stop() -> ! {
    critical_section::with(|cs| LAST_WORDS.borrow(cs).get())();
    defmt::error!("stopped");
    loop {
        asm::wfi();
    }
}
