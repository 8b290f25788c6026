//! Polled serial port: 8 data bits, no parity, 1 stop bit, [`BAUD`].
//!
//! The functions wait only for the own shift register, which empties by itself, and never for the other side. They
//! therefore cannot hang.

use stm32f4::stm32f405::{GPIOA, RCC, USART1, USART2, usart1};

use crate::CORE_HZ;

/// Bit rate, bit/s; 16 MHz / 139 deviates by 0.08 %.
pub const BAUD: u32 = 115_200;

/// An active port. USART1 and USART2 have identical registers.
pub struct Uart {
    registers: &'static usart1::RegisterBlock,
}

impl Uart {
    /// Starts USART1: transmits on PA9, receives on PA10.
    pub fn on_usart1(_owned: USART1, rcc: &RCC, gpioa: &GPIOA) -> Self {
        rcc.ahb1enr().modify(|_, w| w.gpioaen().enabled());
        rcc.apb2enr().modify(|_, w| w.usart1en().enabled());
        gpioa.afrh().modify(|_, w| w.afrh9().af7().afrh10().af7());
        gpioa.moder().modify(|_, w| w.moder9().alternate().moder10().alternate());
        // SAFETY: the registers exist as long as the chip, and their only owner was passed in.
        Self::switched_on(unsafe { &*USART1::ptr() })
    }

    /// Starts USART2: transmits on PA2, receives on PA3.
    pub fn on_usart2(_owned: USART2, rcc: &RCC, gpioa: &GPIOA) -> Self {
        rcc.ahb1enr().modify(|_, w| w.gpioaen().enabled());
        rcc.apb1enr().modify(|_, w| w.usart2en().enabled());
        gpioa.afrl().modify(|_, w| w.afrl2().af7().afrl3().af7());
        gpioa.moder().modify(|_, w| w.moder2().alternate().moder3().alternate());
        // SAFETY: as in `on_usart1`.
        Self::switched_on(unsafe { &*USART2::ptr() })
    }

    fn switched_on(registers: &'static usart1::RegisterBlock) -> Self {
        let divider = (CORE_HZ + BAUD / 2) / BAUD;
        // Baud rate divider in sixteenths; 139 here.
        let (mantissa, fraction) = ((divider / 16) as u16, (divider % 16) as u8);
        registers.brr().write(|w| w.div_mantissa().set(mantissa).div_fraction().set(fraction));
        registers.cr1().write(|w| w.ue().set_bit().te().set_bit().re().set_bit());
        Self { registers }
    }

    /// Enables the interrupt of the port for each received byte.
    pub fn interrupt_at_a_byte(&self) {
        self.registers.cr1().modify(|_, w| w.rxneie().set_bit());
    }

    /// Returns the received byte, if any, also with a noise or framing error: the frames on the line have a checksum.
    /// Reading status, then data, clears the error flags, overrun included.
    #[inline]
    pub fn read(&self) -> Option<u8> {
        let status = self.registers.sr().read();
        let arrived = status.rxne().bit_is_set() || status.ore().bit_is_set();
        arrived.then(|| self.registers.dr().read().bits() as u8)
    }

    /// Returns the received byte of USART1, within its interrupt handler, the only reader then.
    #[inline]
    pub fn arrived_on_usart1() -> Option<u8> {
        // SAFETY: the registers exist as long as the chip; this reads the byte that caused the interrupt.
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
