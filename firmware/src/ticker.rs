//! The control interrupt: TIM3 calls its handler every so many cycles of the core.

use cortex_m::peripheral::NVIC;
use stm32f4::stm32f405::{Interrupt, RCC, TIM3, tim3};

use crate::CORE_HZ;

/// Calls the handler `TIM3` at `rate_hz` from now on. Returns the cycles from one call to the next.
pub fn start(_owned: TIM3, rcc: &RCC, rate_hz: u32) -> u32 {
    let period = CORE_HZ / rate_hz;
    rcc.apb1enr().modify(|_, w| w.tim3en().enabled());
    // SAFETY: any 16 bits are a reload value; `period` is 1600 at 10 kHz.
    registers().arr().write(|w| unsafe { w.bits(period - 1) });
    registers().dier().write(|w| w.uie().enabled());
    registers().cr1().write(|w| w.cen().enabled());
    // SAFETY: no critical section is built on this mask.
    unsafe { NVIC::unmask(Interrupt::TIM3) };
    period
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
    // SAFETY: the registers live as long as the chip; `start` owns them and sets them up before the handler can run, and
    // the handler alone touches the status.
    unsafe { &*TIM3::ptr() }
}
