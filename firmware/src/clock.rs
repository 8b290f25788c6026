//! Stopwatch that reports its unit.
//!
//! On a chip, the cycle counter of the debug unit (DWT) counts core cycles. An emulator may have a register that never
//! changes, so the counter is used only after it has changed. Otherwise the 32-bit timer TIM2 is used. Under QEMU's
//! `-icount shift=0` it counts executed instructions, exactly and identically in every run. Without that option it
//! counts time of the host, which has no meaning here. A loop of known length distinguishes the two.

use core::sync::atomic::{AtomicBool, Ordering, compiler_fence};

use cortex_m::asm;
use cortex_m::peripheral::{DCB, DWT};
use stm32f4::stm32f405::{RCC, TIM2, tim2};

/// Unit of [`now`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub enum Unit {
    /// Core cycles of a chip.
    Cycles,
    /// Executed instructions of an emulator.
    Instructions,
    /// Host time of an emulator: the figures have no meaning.
    HostTime,
}

/// Iterations of the loop that distinguishes instructions from time; two instructions each.
const TURNS: u32 = 1000;

static DWT_COUNTS: AtomicBool = AtomicBool::new(false);

/// Starts the stopwatch, which owns its counters from then on.
pub fn start(mut dcb: DCB, mut dwt: DWT, _owned: TIM2, rcc: &RCC) -> Unit {
    rcc.apb1enr().modify(|_, w| w.tim2en().enabled());
    tim2().cr1().write(|w| w.cen().enabled());
    dcb.enable_trace();
    DWT::unlock();
    dwt.enable_cycle_counter();

    let before = DWT::cycle_count();
    asm::delay(TURNS);
    if DWT::cycle_count() != before {
        DWT_COUNTS.store(true, Ordering::Relaxed);
        return Unit::Cycles;
    }
    let looks_exact = |_| (2 * TURNS..2 * TURNS + 50).contains(&elapsed(|| asm::delay(TURNS)));
    if (0..3).all(looks_exact) { Unit::Instructions } else { Unit::HostTime }
}

/// Returns the count modulo 2^32; 0 before [`start`]. Preceding code completes before the reading.
#[inline]
pub fn now() -> u32 {
    compiler_fence(Ordering::SeqCst);
    let count = if DWT_COUNTS.load(Ordering::Relaxed) { DWT::cycle_count() } else { tim2().cnt().read().bits() };
    compiler_fence(Ordering::SeqCst);
    count
}

/// Returns the duration of `work` including one reading of the stopwatch; subtract `elapsed(|| ())`.
#[inline]
pub fn elapsed(work: impl FnOnce()) -> u32 {
    let before = now();
    work();
    now().wrapping_sub(before)
}

fn tim2() -> &'static tim2::RegisterBlock {
    // SAFETY: the registers exist as long as the chip; `start` owns them, all other code only reads the count.
    unsafe { &*TIM2::ptr() }
}
