//! Drive with an uninterrupted control interrupt, observed, moved and tuned over USART1.
//!
//! | context | priority | function |
//! |---|---|---|
//! | TIM3 | highest | [`Drive::tick`]: counts, plan, control law, monitors, trace buffer, current |
//! | EXTI0 | highest | [`Drive::change`]: a tick that starts a law, switches the law or is recorded |
//! | USART1 | lower | stores a byte ([`line`](crate::line)) |
//! | main loop | lowest | [`serve`]: requests, designs, plans ([`pil_wire::Live`]) |
//!
//! The counterpart on the host is `host-sim live`.

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

/// Rows of a recording: 6.1 s in rows of 1.2 ms, 61 KB.
const ROWS: usize = 5120;

/// Creates the seat in its place. A separate function, since it needs 76 KB of stack temporarily.
#[inline(never)]
pub fn seat<L: Tuned<E, N>, const E: usize, const N: usize>(
    place: &'static mut MaybeUninit<Seat<L, E, N>>,
    law: Monitored<L, E>,
) -> &'static mut Seat<L, E, N> {
    place.write(Seat::new(law))
}

/// State shared by the interrupt and the main loop.
pub struct Drive<L: Tuned<E, N> + 'static, const E: usize, const N: usize>(Shared<L, E, N>);

type Shared<L, const E: usize, const N: usize> = Mutex<RefCell<Option<&'static mut Seat<L, E, N>>>>;

impl<L: Tuned<E, N>, const E: usize, const N: usize> Drive<L, E, N> {
    /// Creates an idle drive; it ticks after [`begin`](Self::begin).
    #[allow(clippy::new_without_default)]
    pub const fn new() -> Self {
        Self(Mutex::new(RefCell::new(None)))
    }

    /// Starts the ticks.
    pub fn begin(&self, seat: &'static mut Seat<L, E, N>) {
        critical_section::with(|cs| self.0.borrow(cs).replace(Some(seat)));
    }

    /// Control interrupt: reads counts, runs a tick, writes the current. Longer ticks are left to EXTI0.
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

    /// Runs the first tick of a design, in EXTI0.
    pub fn change(&self, counts: impl FnOnce() -> [Option<i32>; E], actuate: impl FnOnce(f32)) {
        critical_section::with(|cs| {
            if let Some(seat) = self.0.borrow_ref_mut(cs).as_mut() {
                actuate(seat.change(counts(), None).u);
                seat.missed += u32::from(ticker::is_due());
            }
        });
    }

    /// Logs the last ticks after a fault, oldest first.
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

    /// BOARD: remove.
    fn disturb(&mut self, disturbance: &Disturbance) -> bool {
        stand_in::disturb(disturbance);
        true
    }

    /// BOARD: remove.
    fn replace(&mut self, plant: &Plant) -> bool {
        stand_in::replace(plant)
    }
}

/// Checks the floating-point modes that a tick assumes, in main and in interrupts, which begin with FPDSCR.
///
/// # Panics
/// Another mode is active.
pub fn assume_modes(fpu: &FPU) {
    const ROUNDING_AND_FLUSH: u32 = 0b111 << 22;
    const ASPEN: u32 = 1 << 31;
    assert!(modes_ok(), "FPSCR: rounding not to nearest, or subnormal numbers flushed");
    assert!(fpu.fpdscr.read() & ROUNDING_AND_FLUSH == 0, "FPDSCR: the same, of interrupts");
    assert!(fpu.fpccr.read() & ASPEN != 0, "FPCCR.ASPEN = 0: an interrupt would spoil the floats of main");
}

/// Enables the interrupts of the port and of EXTI0, the port with the lower priority.
pub fn unmask(mut nvic: NVIC) {
    // SAFETY: no critical section depends on these masks and priorities.
    unsafe {
        nvic.set_priority(Interrupt::USART1, 0x10);
        NVIC::unmask(Interrupt::USART1);
        NVIC::unmask(Interrupt::EXTI0);
    }
}

/// Runs the main loop, with a buffer for recordings.
#[inline(never)]
#[expect(clippy::large_stack_arrays, reason = "the RAM has room for it there and nowhere else")]
pub fn serve<L: Tuned<E, N>, const E: usize, const N: usize>(
    mut drive: &Drive<L, E, N>,
    live: Live<L, E, N>,
    mut line: Line,
    clock: Clock,
) -> ! {
    // On the stack, which [`seat`] used earlier: the RAM is too small for both at once.
    let mut rows: [Row; ROWS] = [[0; _]; ROWS];
    // SAFETY: the function never returns, so the buffer lives as long as the program, without another reference.
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
            let t_s = tick as f32 / tick_hz as f32;
            let headroom = period.saturating_sub(worst) * 100 / period.max(1);
            // An instruction takes one or more cycles: only cycles are a share of the period.
            if unit == clock::Unit::Cycles {
                defmt::println!(
                    "t = {=f32} s, {}; interrupt: worst {=u32} of {=u32} cycles, {=u32} % free, {=u32} ticks missed",
                    t_s,
                    health,
                    worst,
                    period,
                    headroom,
                    missed,
                );
            } else {
                defmt::println!(
                    "t = {=f32} s, {}; interrupt: worst {=u32} {}, {=u32} ticks missed",
                    t_s,
                    health,
                    worst,
                    unit,
                    missed,
                );
            }
        }
    }
}

/// Time units of the log.
#[derive(Clone, Copy)]
pub struct Clock {
    /// Unit of the stopwatch.
    pub unit: clock::Unit,
    /// Length of a period in this unit.
    pub period: u32,
    /// Ticks per second.
    pub tick_hz: u32,
}
