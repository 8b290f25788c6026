//! The processor in the loop: requests of the host come in over USART1, replies go out, bit for bit what the same
//! controller gives on the host. `pil-wire` is the talk; here is only the serial port.
//!
//! **Why polling loses nothing.** The host speaks only when it has been answered (lock step), so no byte comes while
//! this program computes, replies or logs; and it logs before it replies. Should a byte be lost all the same (a host
//! that gave up waiting and repeats itself), the checksum fails, the receiver finds the next frame, and the repeated
//! request is answered.
//!
//! **Why it sleeps between bytes.** The emulator pays several system calls for each look at a port, and shares two
//! threads between the chip and its ports: a core that looks all day makes a round trip two to three times as long.
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

/// For the last words.
static TARGET: AtomicPtr<Target> = AtomicPtr::new(ptr::null_mut());

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut STORAGE: Target = Target::new();

    let Some(chip) = Peripherals::take() else { unreachable!() };
    log::start(chip.USART2, &chip.RCC, &chip.GPIOA);
    let host = Uart::on_usart1(chip.USART1, &chip.RCC, &chip.GPIOA);
    // The reference is made of the pointer, which so stays good beside it.
    let storage = ptr::from_mut(STORAGE);
    TARGET.store(storage, Ordering::Relaxed);
    // SAFETY: nobody else has the storage but `black_box`, after which this program does not go on.
    let target = unsafe { &mut *storage };
    fault::respond_with(fault::Response { switch_off: || {}, last_words: black_box });

    host.write(&target.hello());
    defmt::info!("hello: wire {=u8}, layout {=u32:#010x}, core {=u32:#010x}", VERSION, LAYOUT_ID, CORE_VERSION);
    // Masked, an interrupt ends the sleep and goes no further: there is no handler.
    interrupt::disable();
    host.interrupt_at_a_byte();
    // SAFETY: interrupts are masked for good.
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

/// The next byte; sleeps until it comes.
fn next(host: &Uart) -> u8 {
    loop {
        // In this order a byte that comes after the look is pending, and ends the sleep at once.
        NVIC::unpend(Interrupt::USART1);
        if let Some(byte) = host.read() {
            return byte;
        }
        asm::wfi();
    }
}

/// The last ticks, oldest first.
fn black_box() {
    let target = TARGET.load(Ordering::Relaxed);
    // SAFETY: it points to the storage of `main`, or nowhere. `main` may have been in the middle of changing it, but
    // will never go on; a record that is half written is still numbers.
    if let Some(target) = unsafe { target.as_ref() } {
        for record in target.black_box().oldest_first() {
            defmt::error!("{}", record);
        }
    }
}
