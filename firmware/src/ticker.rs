//! Control interrupt: TIM3 calls its handler at a fixed number of core cycles.
//!
//! The timer has 16 bits; for longer periods a prescaler combines several cycles into one count.

use cortex_m::peripheral::NVIC;
use stm32f4::stm32f405::{Interrupt, RCC, TIM3, tim3};

use crate::CORE_HZ;

/// Register values of the timer, each minus one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Division {
    /// Core cycles per count, minus one.
    pub prescaler: u16,
    /// Counts per call, minus one.
    pub reload: u16,
}

impl Division {
    /// Returns the longest period not above the period of `rate_hz`, with the finest count that fits 16 bits. A rate of
    /// 0 is treated as 1 Hz, and a rate above `core_hz` as `core_hz`.
    pub const fn new(core_hz: u32, rate_hz: u32) -> Self {
        let wanted = match core_hz.checked_div(rate_hz) {
            Some(ticks) => ticks,
            None => core_hz,
        };
        let cycles = if wanted == 0 { 1 } else { wanted };
        // Both values fit 16 bits for any 32-bit number of cycles.
        let prescaler = (cycles - 1) / 0x1_0000;
        Self { prescaler: prescaler as u16, reload: (cycles / (prescaler + 1) - 1) as u16 }
    }

    /// Returns the core cycles per call.
    pub const fn period(self) -> u32 {
        (self.prescaler as u32 + 1) * (self.reload as u32 + 1)
    }

    /// Compares the values, for the compile-time tests below.
    const fn is(self, prescaler: u16, reload: u16, period: u32) -> bool {
        self.prescaler == prescaler && self.reload == reload && self.period() == period
    }
}

const _: () = {
    assert!(Division::new(16_000_000, 10_000).is(0, 1599, 1600));
    // The last rate without a prescaler, the first rate with one, and the slowest rate.
    assert!(Division::new(16_000_000, 245).is(0, 65_305, 65_306));
    assert!(Division::new(16_000_000, 244).is(1, 32_785, 65_572));
    assert!(Division::new(16_000_000, 1).is(244, 65_305, 15_999_970));
    assert!(Division::new(65_536, 1).is(0, 0xffff, 65_536));
    assert!(Division::new(u32::MAX, 0).is(0xffff, 65_534, 0xffff_0000));
    assert!(Division::new(1, u32::MAX).is(0, 0, 1));
};

/// Starts to call the handler `TIM3` at `rate_hz`. Returns the core cycles per call.
pub fn start(_owned: TIM3, rcc: &RCC, rate_hz: u32) -> u32 {
    let division = Division::new(CORE_HZ, rate_hz);
    rcc.apb1enr().modify(|_, w| w.tim3en().enabled());
    registers().arr().write(|w| w.arr().set(division.reload));
    if division.prescaler > 0 {
        registers().psc().write(|w| w.psc().set(division.prescaler));
        // The prescaler takes effect at a wrap of the timer; this forces a wrap before the interrupt is enabled.
        registers().egr().write(|w| w.ug().set_bit());
        acknowledge();
    }
    registers().dier().write(|w| w.uie().enabled());
    registers().cr1().write(|w| w.cen().enabled());
    // SAFETY: no critical section depends on this mask.
    unsafe { NVIC::unmask(Interrupt::TIM3) };
    division.period()
}

/// Clears the interrupt flag of this call.
#[inline]
pub fn acknowledge() {
    registers().sr().write(|w| w.uif().clear_bit());
}

/// Returns whether the next call is due already.
#[inline]
pub fn is_due() -> bool {
    registers().sr().read().uif().bit_is_set()
}

fn registers() -> &'static tim3::RegisterBlock {
    // SAFETY: the registers exist as long as the chip. `start` owns them and sets them up before the handler can run,
    // and only the handler accesses the status.
    unsafe { &*TIM3::ptr() }
}
