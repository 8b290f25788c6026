//! A stopwatch that says what it counts.
//!
//! On a chip the cycle counter of the debug unit (DWT) counts cycles of the core. An emulator may have the register and
//! never move it, so it is believed only after it has moved. Else the 32-bit timer TIM2 is read: under QEMU's
//! `-icount shift=0` it counts executed instructions, exactly and the same in every run; without that option it counts
//! time of the host, which is worth nothing here. A loop of known length tells which.

use core::sync::atomic::{AtomicBool, Ordering, compiler_fence};

use cortex_m::asm;
use cortex_m::peripheral::{DCB, DWT};
use stm32f4::stm32f405::{RCC, TIM2, tim2};

/// What [`now`] counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub enum Unit {
    /// Cycles of the core, from a chip.
    Cycles,
    /// Executed instructions, from an emulator that counts them.
    Instructions,
    /// Time of an emulator's host: no figure means anything.
    HostTime,
}

/// Turns of the loop that tells instructions from time; two instructions each.
const TURNS: u32 = 1000;

static DWT_COUNTS: AtomicBool = AtomicBool::new(false);

/// Starts the stopwatch; it owns its counters from now on.
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

/// The count, modulo 2^32; 0 before [`start`]. What stands before it in the source is done before it is read.
#[inline]
pub fn now() -> u32 {
    compiler_fence(Ordering::SeqCst);
    let count = if DWT_COUNTS.load(Ordering::Relaxed) { DWT::cycle_count() } else { tim2().cnt().read().bits() };
    compiler_fence(Ordering::SeqCst);
    count
}

/// What `work` takes, one reading of the stopwatch included: subtract `elapsed(|| ())`.
#[inline]
pub fn elapsed(work: impl FnOnce()) -> u32 {
    let before = now();
    work();
    now().wrapping_sub(before)
}

fn tim2() -> &'static tim2::RegisterBlock {
    // SAFETY: the registers live as long as the chip; `start` owns them, everyone else only reads the count.
    unsafe { &*TIM2::ptr() }
}
