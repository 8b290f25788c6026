//! Processor in the loop: requests of the host arrive over USART1, and the replies are bit-identical to the controller
//! on the host. `pil-wire` implements the protocol; this file contains only the serial port.
//!
//! **Polling loses no byte.** The host sends only after a reply (lock step), so no byte arrives while this program
//! computes, replies or logs; and it logs before it replies. If a byte is lost all the same (the host timed out and
//! repeats), the checksum fails and the receiver finds the next frame. The program then answers the repeated request.
//!
//! **The core sleeps between bytes.** The emulator needs several system calls for each poll of a port, and shares two
//! threads between the chip and its ports. A core that polls continuously makes a round trip two to three times as
//! long.
#![no_std]
#![no_main]

use core::ptr;
use core::sync::atomic::{AtomicPtr, Ordering};

use cortex_m::peripheral::NVIC;
use cortex_m::{asm, interrupt};
use firmware::uart::Uart;
use firmware::{fault, log};
use pil_wire::{CORE_VERSION, Event, LAYOUT_ID, Open, Refusal, Target, VERSION};
use stm32f4::stm32f405::{Interrupt, Peripherals};

/// Storage for the output after a fault.
static TARGET: AtomicPtr<Target> = AtomicPtr::new(ptr::null_mut());

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut STORAGE: Target = Target::new();

    let Some(chip) = Peripherals::take() else { unreachable!() };
    log::start(chip.USART2, &chip.RCC, &chip.GPIOA);
    let host = Uart::on_usart1(chip.USART1, &chip.RCC, &chip.GPIOA);
    // The reference derives from the pointer, which therefore stays valid.
    let storage = ptr::from_mut(STORAGE);
    TARGET.store(storage, Ordering::Relaxed);
    // SAFETY: only `black_box` also uses the storage, and this program does not continue after it.
    let target = unsafe { &mut *storage };
    fault::respond_with(fault::Response { switch_off: || {}, last_words: black_box });

    host.write(&target.hello());
    defmt::info!("hello: wire {=u8}, layout {=u32:#010x}, core {=u32:#010x}", VERSION, LAYOUT_ID, CORE_VERSION);
    // A masked interrupt ends the sleep without a handler.
    interrupt::disable();
    host.interrupt_at_a_byte();
    // SAFETY: interrupts stay masked.
    unsafe { NVIC::unmask(Interrupt::USART1) };
    loop {
        let byte = next(&host);
        let reply = target.receive(byte);
        match target.take_event() {
            None => {}
            Some(Event::FaultAsked) => fault::provoke(),
            Some(Event::Started(Open { instance, design, .. })) => {
                defmt::info!("session opened: {}, design {=u32:#010x}", instance, design);
            }
            Some(Event::Refused(Refusal { reason, target, request })) => {
                defmt::warn!("refused, {}: target {=u32:#010x}, request {=u32:#010x}", reason, target, request);
            }
        }
        if let Some(reply) = reply {
            host.write(&reply);
        }
    }
}

/// Returns the next byte; sleeps until it arrives.
fn next(host: &Uart) -> u8 {
    loop {
        // In this order, a byte that arrives after the poll is pending and ends the sleep at once.
        NVIC::unpend(Interrupt::USART1);
        if let Some(byte) = host.read() {
            return byte;
        }
        asm::wfi();
    }
}

/// Logs the last ticks, oldest first.
fn black_box() {
    let target = TARGET.load(Ordering::Relaxed);
    // SAFETY: the pointer is null or refers to the storage of `main`. `main` may have been interrupted during a change,
    // but never continues; a half-written record still consists of numbers.
    if let Some(target) = unsafe { target.as_ref() } {
        for record in target.black_box().oldest_first() {
            defmt::error!("{}", record);
        }
    }
}
