//! What one tick of the flexible joint costs, by order of the observers: fewest, most and mean over a fixed trajectory.
//!
//! The unit is in the message: cycles on a chip, instructions under `qemu-system-arm -icount shift=0,sleep=off`. The
//! tick is inlined as in an interrupt; loading the sample and storing the output are part of it, the call of an
//! interrupt and the reading of the stopwatch are not.
#![no_std]
#![no_main]

use core::hint::black_box;

use controller_core::{
    Config, Controller, Fallback, FlexibleJoint, Health, JointParameters, Limits, Nominal, ObserverGains, ReachingLaw,
    Reading, Surface, channels,
};
use cortex_m::asm;
use firmware::{clock, log};
use stm32f4::stm32f405::Peripherals;

type Joint<const R: usize, const MASK: u8, const O: usize> = Controller<f32, FlexibleJoint<f32>, 4, R, MASK, O>;

const TICKS: u32 = 1000;
const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Reconstructed).nominal();
const DRIVEN: u8 = channels([4]);
const BOTH: u8 = channels([2, 4]);

const fn designed<const R: usize, const MASK: u8, const O: usize>(observer: ObserverGains<R>) -> Joint<R, MASK, O> {
    let in_channel_2 = if MASK == BOTH { Some(observer) } else { None };
    let config = Config {
        period_s: 1e-4,
        surface: Surface::from_bandwidth(10.0, 10.0),
        observers: [None, in_channel_2, None, Some(observer)],
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 },
        nominal: NOMINAL,
        limits: Limits::symmetric(300.0),
        fallback: Fallback::HoldLast,
        sigma_star_bound: 10.0,
        observer_pole_limit: 1.0,
    };
    Joint::designed(&config, FlexibleJoint::<f32>::new(&NOMINAL))
}

// Eq. (44) asks for order 2 in channel 2: order 1 is for the driven channel alone.
static ORDER_1: Joint<1, DRIVEN, 1> = designed(ObserverGains::from_bandwidth::<1>(100.0));
static ORDER_2: Joint<2, BOTH, 2> = designed(ObserverGains::from_bandwidth::<2>(100.0));
static ORDER_3: Joint<3, BOTH, 2> = designed(ObserverGains::from_bandwidth::<3>(100.0));

/// A trajectory that needs no plant: noise of ±1/2 from a linear congruence, smaller than a spike, larger than rest.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 16_777_216.0 - 0.5
    }
}

#[inline(never)]
fn measure<const R: usize, const MASK: u8, const O: usize>(controller: &'static Joint<R, MASK, O>) {
    let overhead = clock::elapsed(|| {});
    let mut noise = Noise(1);
    let mut sample = || [0.01, 0.1, 1.0, 10.0].map(|size| size * noise.next());
    let Some(mut state) = controller.start(&sample()) else { unreachable!() };
    let mut cost = |x: [f32; 4]| {
        let x = black_box(x);
        let mut health = Health::OK;
        let took = clock::elapsed(|| health = black_box(controller.tick(&mut state, &x)).health);
        (took - overhead, health)
    };

    let (mut fewest, mut most, mut sum, mut saturated) = (u32::MAX, 0, 0, 0_u32);
    for _ in 0..TICKS {
        let (took, health) = cost(sample());
        (fewest, most, sum) = (fewest.min(took), most.max(took), sum + took);
        saturated += u32::from(health.contains(Health::SATURATED));
    }
    let (rejected, _) = cost([f32::NAN; 4]);
    defmt::println!(
        "order {=usize}, {=usize} observers: min {=u32}, max {=u32}, mean {=f32}; rejected sample {=u32} \
         ({=u32} ticks, {=u32} saturated)",
        R,
        O,
        fewest,
        most,
        sum as f32 / TICKS as f32,
        rejected,
        TICKS,
        saturated,
    );
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let (Some(core), Some(chip)) = (cortex_m::Peripherals::take(), Peripherals::take()) else { unreachable!() };
    log::start(chip.USART2, &chip.RCC, &chip.GPIOA);
    let unit = clock::start(core.DCB, core.DWT, chip.TIM2, &chip.RCC);
    defmt::println!("budget in {}", unit);
    measure(&ORDER_1);
    measure(&ORDER_2);
    measure(&ORDER_3);
    defmt::println!("budget ends");
    loop {
        asm::wfi();
    }
}
