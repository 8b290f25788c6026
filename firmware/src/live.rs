//! A drive whose control interrupt goes on whatever else happens, and that is observed, moved and tuned over USART1.
//!
//! | who | at | does |
//! |---|---|---|
//! | TIM3 | the tick, highest priority | [`Drive::tick`]: counts, plan, law, monitors, black box, current |
//! | EXTI0 | the same priority | [`Drive::change`]: a tick in which a law starts, another takes over, or is recorded |
//! | USART1 | below | keeps a byte ([`line`](crate::line)) |
//! | main loop | the rest | [`serve`]: requests, designs, plans ([`pil_wire::Live`]) |
//!
//! `host-sim live` speaks to it.

use core::cell::RefCell;
use core::mem::MaybeUninit;

use controller_core::drive::{Monitored, Stretch};
use controller_core::modes_ok;
use cortex_m::asm;
use cortex_m::peripheral::{FPU, NVIC};
use critical_section::Mutex;
use pil_wire::{Disturbance, Event, Live, Machine, Open, Plant, Refusal, Row, Seat, Tuned};
use stm32f4::stm32f405::Interrupt;

use crate::line::Line;
use crate::{clock, stand_in, ticker};

/// Memory of a record: 6.1 s in rows of 1.2 ms, 61 KB.
const ROWS: usize = 5120;

/// A seat in its place. A function of its own: of the stack it takes 76 KB for a moment, and gives them back.
#[inline(never)]
pub fn seat<L: Tuned<E, N>, const E: usize, const N: usize>(
    place: &'static mut MaybeUninit<Seat<L, E, N>>,
    law: Monitored<L, E>,
) -> &'static mut Seat<L, E, N> {
    place.write(Seat::new(law))
}

/// What interrupt and main loop share.
pub struct Drive<L: Tuned<E, N> + 'static, const E: usize, const N: usize>(Shared<L, E, N>);

type Shared<L, const E: usize, const N: usize> = Mutex<RefCell<Option<&'static mut Seat<L, E, N>>>>;

impl<L: Tuned<E, N>, const E: usize, const N: usize> Drive<L, E, N> {
    /// Nothing ticks before [`begin`](Self::begin).
    #[allow(clippy::new_without_default)]
    pub const fn new() -> Self {
        Self(Mutex::new(RefCell::new(None)))
    }

    /// From now on it ticks.
    pub fn begin(&self, seat: &'static mut Seat<L, E, N>) {
        critical_section::with(|cs| self.0.borrow(cs).replace(Some(seat)));
    }

    /// The control interrupt: counts, a tick, a current. A tick that takes longer is EXTI0's.
    #[inline(always)]
    pub fn tick(&self, counts: impl FnOnce() -> [Option<i32>; E], actuate: impl FnOnce(f32)) {
        ticker::acknowledge();
        let began = clock::now();
        critical_section::with(|cs| {
            let Ok(mut seat) = self.0.borrow(cs).try_borrow_mut() else { return };
            let Some(seat) = seat.as_mut() else { return };
            if seat.is_to_change() {
                NVIC::pend(Interrupt::EXTI0);
                return;
            }
            actuate(seat.tick(counts(), None).u);
            seat.worst = seat.worst.max(clock::now().wrapping_sub(began));
            seat.missed += u32::from(ticker::is_due());
        });
    }

    /// The first tick of a design.
    pub fn change(&self, counts: impl FnOnce() -> [Option<i32>; E], actuate: impl FnOnce(f32)) {
        critical_section::with(|cs| {
            if let Some(seat) = self.0.borrow_ref_mut(cs).as_mut() {
                actuate(seat.change(counts(), None).u);
                seat.missed += u32::from(ticker::is_due());
            }
        });
    }

    /// The last ticks, oldest first, through the log: after a fault.
    pub fn last_words(&self) {
        critical_section::with(|cs| {
            if let Ok(seat) = self.0.borrow(cs).try_borrow()
                && let Some(seat) = seat.as_ref()
            {
                let frames = seat.axis().black_box().map(Stretch::frames);
                let count = frames.iter().map(|frames| frames.len()).sum::<usize>();
                for frame in frames.into_iter().flatten().skip(count.saturating_sub(16)) {
                    defmt::error!("{}", frame);
                }
            }
        });
    }
}

impl<L: Tuned<E, N>, const E: usize, const N: usize> Machine<L, E, N> for &Drive<L, E, N> {
    fn between<T>(&mut self, work: impl FnOnce(&mut Seat<L, E, N>) -> T) -> T {
        critical_section::with(|cs| match self.0.borrow_ref_mut(cs).as_mut() {
            Some(seat) => work(seat),
            None => unreachable!("`serve` comes after `begin`"),
        })
    }

    fn wait(&mut self) {
        asm::wfi();
    }

    fn now(&self) -> u32 {
        clock::now()
    }

    /// BOARD: goes.
    fn disturb(&mut self, disturbance: &Disturbance) -> bool {
        stand_in::disturb(disturbance);
        true
    }

    /// BOARD: goes.
    fn replace(&mut self, plant: &Plant) -> bool {
        stand_in::replace(plant)
    }
}

/// Stops the start-up where a tick would compute in other floating-point modes than it assumes: in main, or in an
/// interrupt, which begins with FPDSCR.
///
/// # Panics
/// There.
pub fn assume_modes(fpu: &FPU) {
    const ROUNDING_AND_FLUSH: u32 = 0b111 << 22;
    const ASPEN: u32 = 1 << 31;
    assert!(modes_ok(), "FPSCR: rounding not to nearest, or subnormal numbers flushed");
    assert!(fpu.fpdscr.read() & ROUNDING_AND_FLUSH == 0, "FPDSCR: the same, of interrupts");
    assert!(fpu.fpccr.read() & ASPEN != 0, "FPCCR.ASPEN = 0: an interrupt would spoil the floats of main");
}

/// Lets the port and the changes through: the port below all else.
pub fn unmask(mut nvic: NVIC) {
    // SAFETY: no critical section is built on these masks and priorities.
    unsafe {
        nvic.set_priority(Interrupt::USART1, 0x10);
        NVIC::unmask(Interrupt::USART1);
        NVIC::unmask(Interrupt::EXTI0);
    }
}

/// The main loop, with a memory for records.
#[inline(never)]
#[expect(clippy::large_stack_arrays, reason = "the RAM has room for it there and nowhere else")]
pub fn serve<L: Tuned<E, N>, const E: usize, const N: usize>(
    mut drive: &Drive<L, E, N>,
    live: Live<L, E, N>,
    mut line: Line,
    clock: Clock,
) -> ! {
    // On the stack, where the seat was made before ([`seat`]): the RAM is not large enough for both at a time.
    let mut rows: [Row; ROWS] = [[0; _]; ROWS];
    // SAFETY: this never returns, so what lies here lives as long as the program, and nothing else refers to it.
    let rows: &'static mut [Row] = unsafe { &mut *core::ptr::addr_of_mut!(rows) };
    let mut live = live.recording_in(rows);
    line.write(&live.hello());
    let mut reported = 0;
    loop {
        while let Some(byte) = line.read() {
            let reply = live.receive(byte, &mut drive);
            match live.take_event() {
                Some(Event::Started(Open { design, .. })) => defmt::info!("design {=u32:#010x} runs", design),
                Some(Event::Refused(Refusal { reason, target, request })) => {
                    defmt::warn!("refused, {}: target {=u32:#010x}, request {=u32:#010x}", reason, target, request);
                }
                _ => {}
            }
            if let Some(reply) = reply {
                line.write(&reply);
            }
        }
        asm::wfi();
        let (tick, worst, missed, health) =
            drive.between(|seat| (seat.axis().tick_number(), seat.worst, seat.missed, seat.newest().health));
        if tick.wrapping_sub(reported) >= clock.tick_hz {
            reported = tick;
            let Clock { unit, period, tick_hz } = clock;
            let headroom = period.saturating_sub(worst) * 100 / period.max(1);
            defmt::println!(
                "t = {=f32} s, {}; interrupt: worst {=u32} of {=u32} {}, headroom {=u32} %, {=u32} ticks missed",
                tick as f32 / tick_hz as f32,
                health,
                worst,
                period,
                unit,
                headroom,
                missed,
            );
        }
    }
}

/// What the log says of time.
#[derive(Clone, Copy)]
pub struct Clock {
    /// What the stopwatch counts.
    pub unit: clock::Unit,
    /// Of these in a period.
    pub period: u32,
    /// Ticks in a second.
    pub tick_hz: u32,
}
