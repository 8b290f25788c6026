//! Does the tick as assembly give the bits of the Rust tick, side by side? A million ticks each of orders 2 and 3.
//!
//! Samples near rest and far from it, one in thirty of them bad, several in a row: NaN, infinities, numbers too large,
//! subnormal ones, any bits at all. Now and then the actuator held something else, and now and then it starts
//! again. Compared is every bit of u from `tick_u`, and of u, sigma, sigma* and health from `tick`.
#![no_std]
#![no_main]

use controller_core::{ControlLaw, Health};
use cortex_m::asm;
use firmware::assembly::{
    Joint, State, Told, joint, joint_r2_report_applied, joint_r2_start, joint_r2_tick, joint_r2_tick_u,
    joint_r3_report_applied, joint_r3_start, joint_r3_tick, joint_r3_tick_u,
};
use firmware::log;
use stm32f4::stm32f405::Peripherals;

const TICKS: u32 = 1_000_000;

static JOINT_2: Joint<2> = joint();
static JOINT_3: Joint<3> = joint();

/// The functions of one file.
struct Exported<const NUMBERS: usize> {
    start: extern "C" fn(&mut State<NUMBERS>, &[f32; 4]) -> bool,
    tick_u: extern "C" fn(&mut State<NUMBERS>, &[f32; 4]) -> f32,
    tick: extern "C" fn(&mut State<NUMBERS>, &[f32; 4], &mut Told) -> u32,
    report_applied: extern "C" fn(&mut State<NUMBERS>, f32) -> bool,
}

/// Xorshift.
struct Luck(u32);

impl Luck {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    fn one_in(&mut self, n: u32) -> bool {
        self.next().is_multiple_of(n)
    }

    fn within(&mut self, size: f32) -> f32 {
        size * ((self.next() >> 8) as f32 / 8_388_608.0 - 1.0)
    }

    fn bad(&mut self) -> f32 {
        const EDGES: [f32; 10] =
            [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 1e-45, f32::MAX, f32::MIN, 1e12, -1e20, 3e37];
        if self.one_in(2) { f32::from_bits(self.next()) } else { EDGES[(self.next() % 10) as usize] }
    }
}

fn compare<const R: usize, const NUMBERS: usize>(law: &Joint<R>, exported: &Exported<NUMBERS>) {
    let mut luck = Luck(2_463_534_242);
    let (mut of_u, mut of_all) = (State::ZEROS, State::ZEROS);
    let (mut state, mut bad, mut size) = (None, 0, 0.1);
    let (mut differ, mut rejected, mut saturated, mut starts) = (0_u32, 0_u32, 0_u32, 0_u32);
    let mut done = 0;
    while done < TICKS {
        if luck.one_in(100) {
            size = [1e-6, 1e-3, 0.1, 1.0, 10.0][(luck.next() % 5) as usize];
        }
        if luck.one_in(100) {
            bad = 1 + luck.next() % 5;
        }
        let mut x: [f32; 4] = core::array::from_fn(|_| luck.within(size));
        if bad > 0 {
            bad -= 1;
            x[(luck.next() % 4) as usize] = luck.bad();
        }
        if state.is_none() || luck.one_in(500) {
            let started = law.start(&x);
            differ += u32::from((exported.start)(&mut of_u, &x) != started.is_some());
            differ += u32::from((exported.start)(&mut of_all, &x) != started.is_some());
            starts += u32::from(started.is_some());
            state = started.or(state);
        }
        let Some(state) = &mut state else { continue };
        if luck.one_in(10) {
            let held = if luck.one_in(10) { luck.bad() } else { luck.within(300.0) };
            let taken = Joint::<R>::report_applied(state, held);
            differ += u32::from((exported.report_applied)(&mut of_u, held) != taken);
            differ += u32::from((exported.report_applied)(&mut of_all, held) != taken);
        }
        let output = law.tick(state, &x);
        let mut told = Told::default();
        let u = (exported.tick_u)(&mut of_u, &x);
        let health = (exported.tick)(&mut of_all, &x, &mut told);
        let alike = |one: f32, other: f32| one.to_bits() == other.to_bits();
        let same = alike(output.u, u)
            && alike(output.u, told.u)
            && alike(output.sigma, told.sigma)
            && alike(output.sigma_star, told.sigma_star)
            && u32::from(output.health.bits()) == health;
        differ += u32::from(!same);
        rejected += u32::from(output.health.contains(Health::INPUT_REJECTED));
        saturated += u32::from(output.health.contains(Health::SATURATED));
        done += 1;
    }
    defmt::println!(
        "order {=usize}: {=u32} ticks, {=u32} differ; {=u32} rejected, {=u32} saturated, {=u32} starts",
        R,
        TICKS,
        differ,
        rejected,
        saturated,
        starts,
    );
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(chip) = Peripherals::take() else { unreachable!() };
    log::start(chip.USART2, &chip.RCC, &chip.GPIOA);
    compare(
        &JOINT_2,
        &Exported {
            start: joint_r2_start,
            tick_u: joint_r2_tick_u,
            tick: joint_r2_tick,
            report_applied: joint_r2_report_applied,
        },
    );
    compare(
        &JOINT_3,
        &Exported {
            start: joint_r3_start,
            tick_u: joint_r3_tick_u,
            tick: joint_r3_tick,
            report_applied: joint_r3_report_applied,
        },
    );
    defmt::println!("assembly ends");
    loop {
        asm::wfi();
    }
}
