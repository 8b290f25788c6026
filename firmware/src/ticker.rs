//! The control interrupt: TIM3 calls its handler every so many cycles of the core.
//!
//! The timer counts 16 bits: of longer periods a prescaler counts several cycles at once.

use cortex_m::peripheral::NVIC;
use stm32f4::stm32f405::{Interrupt, RCC, TIM3, tim3};

use crate::CORE_HZ;

/// What the timer counts, each as its register takes it: less one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Division {
    /// Cycles of the core for one count, less one.
    pub prescaler: u16,
    /// Counts from one call to the next, less one.
    pub reload: u16,
}

impl Division {
    /// The longest period that is not above that of `rate_hz`, by the finest count that 16 bits hold it in; a rate of 0
    /// is taken as 1 Hz, one above `core_hz` as `core_hz`.
    pub const fn new(core_hz: u32, rate_hz: u32) -> Self {
        let wanted = match core_hz.checked_div(rate_hz) {
            Some(ticks) => ticks,
            None => core_hz,
        };
        let cycles = if wanted == 0 { 1 } else { wanted };
        // Both have 16 bits, for any 32 bits of cycles.
        let prescaler = (cycles - 1) / 0x1_0000;
        Self { prescaler: prescaler as u16, reload: (cycles / (prescaler + 1) - 1) as u16 }
    }

    /// Cycles of the core from one call to the next.
    pub const fn period(self) -> u32 {
        (self.prescaler as u32 + 1) * (self.reload as u32 + 1)
    }

    /// For the proof below.
    const fn is(self, prescaler: u16, reload: u16, period: u32) -> bool {
        self.prescaler == prescaler && self.reload == reload && self.period() == period
    }
}

const _: () = {
    assert!(Division::new(16_000_000, 10_000).is(0, 1599, 1600));
    // The last rate that needs no prescaler, the first that does, the slowest.
    assert!(Division::new(16_000_000, 245).is(0, 65_305, 65_306));
    assert!(Division::new(16_000_000, 244).is(1, 32_785, 65_572));
    assert!(Division::new(16_000_000, 1).is(244, 65_305, 15_999_970));
    assert!(Division::new(65_536, 1).is(0, 0xffff, 65_536));
    assert!(Division::new(u32::MAX, 0).is(0xffff, 65_534, 0xffff_0000));
    assert!(Division::new(1, u32::MAX).is(0, 0, 1));
};

/// Calls the handler `TIM3` at `rate_hz` from now on. Returns the cycles from one call to the next.
pub fn start(_owned: TIM3, rcc: &RCC, rate_hz: u32) -> u32 {
    let division = Division::new(CORE_HZ, rate_hz);
    rcc.apb1enr().modify(|_, w| w.tim3en().enabled());
    registers().arr().write(|w| w.arr().set(division.reload));
    if division.prescaler > 0 {
        registers().psc().write(|w| w.psc().set(division.prescaler));
        // It is taken over where the timer wraps, so it wraps now, before the interrupt is let through.
        registers().egr().write(|w| w.ug().set_bit());
        acknowledge();
    }
    registers().dier().write(|w| w.uie().enabled());
    registers().cr1().write(|w| w.cen().enabled());
    // SAFETY: no critical section is built on this mask.
    unsafe { NVIC::unmask(Interrupt::TIM3) };
    division.period()
}

/// The handler has seen this call.
#[inline]
pub fn acknowledge() {
    registers().sr().write(|w| w.uif().clear_bit());
}

/// Has the next call come due already?
#[inline]
pub fn is_due() -> bool {
    registers().sr().read().uif().bit_is_set()
}

fn registers() -> &'static tim3::RegisterBlock {
    // SAFETY: the registers live as long as the chip; `start` owns them and sets them up before the handler can run,
    // and the handler alone touches the status.
    unsafe { &*TIM3::ptr() }
}
