//! A serial port by polling: 8 data bits, no parity, 1 stop bit, [`BAUD`].
//!
//! Nothing here waits for the other side, only for our own shift register, which empties by itself; so nothing hangs.

use stm32f4::stm32f405::{GPIOA, RCC, USART1, USART2, usart1};

use crate::CORE_HZ;

/// Bits per second; 16 MHz / 139 is 0.08 % off.
pub const BAUD: u32 = 115_200;

/// A port that is switched on. USART1 and USART2 have the same registers.
pub struct Uart {
    registers: &'static usart1::RegisterBlock,
}

impl Uart {
    /// USART1: transmits on PA9, receives on PA10.
    pub fn on_usart1(_owned: USART1, rcc: &RCC, gpioa: &GPIOA) -> Self {
        rcc.ahb1enr().modify(|_, w| w.gpioaen().enabled());
        rcc.apb2enr().modify(|_, w| w.usart1en().enabled());
        gpioa.afrh().modify(|_, w| w.afrh9().af7().afrh10().af7());
        gpioa.moder().modify(|_, w| w.moder9().alternate().moder10().alternate());
        // SAFETY: the registers of a peripheral live as long as the chip, and its only owner has just been given away.
        Self::switched_on(unsafe { &*USART1::ptr() })
    }

    /// USART2: transmits on PA2, receives on PA3.
    pub fn on_usart2(_owned: USART2, rcc: &RCC, gpioa: &GPIOA) -> Self {
        rcc.ahb1enr().modify(|_, w| w.gpioaen().enabled());
        rcc.apb1enr().modify(|_, w| w.usart2en().enabled());
        gpioa.afrl().modify(|_, w| w.afrl2().af7().afrl3().af7());
        gpioa.moder().modify(|_, w| w.moder2().alternate().moder3().alternate());
        // SAFETY: as above.
        Self::switched_on(unsafe { &*USART2::ptr() })
    }

    fn switched_on(registers: &'static usart1::RegisterBlock) -> Self {
        let divider = (CORE_HZ + BAUD / 2) / BAUD;
        // In sixteenths; 139 here.
        let (mantissa, fraction) = ((divider / 16) as u16, (divider % 16) as u8);
        registers.brr().write(|w| w.div_mantissa().set(mantissa).div_fraction().set(fraction));
        registers.cr1().write(|w| w.ue().set_bit().te().set_bit().re().set_bit());
        Self { registers }
    }

    /// From now on a byte that has arrived makes the interrupt of the port pending.
    pub fn interrupt_at_a_byte(&self) {
        self.registers.cr1().modify(|_, w| w.rxneie().set_bit());
    }

    /// The byte that has arrived, if any. A byte that came with an error (noise, framing) is handed out as well: the
    /// frames on the line carry a check sum. Reading status, then data, clears the error flags, overrun included.
    #[inline]
    pub fn read(&self) -> Option<u8> {
        let status = self.registers.sr().read();
        let arrived = status.rxne().bit_is_set() || status.ore().bit_is_set();
        arrived.then(|| self.registers.dr().read().bits() as u8)
    }

    /// The same for USART1, in the handler of its interrupt: nobody else reads then.
    #[inline]
    pub fn arrived_on_usart1() -> Option<u8> {
        // SAFETY: the registers live as long as the chip; what is read here is the byte that the interrupt is for.
        Self { registers: unsafe { &*USART1::ptr() } }.read()
    }

    /// Sends all bytes; returns when the last one is in the shift register.
    #[inline]
    pub fn write(&self, bytes: &[u8]) {
        for &byte in bytes {
            while self.registers.sr().read().txe().bit_is_clear() {}
            self.registers.dr().write(|w| w.dr().set(u16::from(byte)));
        }
    }
}
