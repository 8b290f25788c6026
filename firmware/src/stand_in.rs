//! BOARD: goes. Between the control interrupt and a stand-in of the plant on the chip, so that a drive runs on a bare
//! board and in an emulator.
//!
//! The interrupt leaves its current with [`hold`]; when it has ended, the exception PendSV lets a period pass
//! ([`advance`]), and the coming [`counts`] are of that. So what is measured is the drive.

use core::sync::atomic::{AtomicI32, AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::SCB;
use pil_wire::Disturbance;

mod joint;
mod motor;

pub use joint::Joint;
pub use motor::Motor;

static COUNTS: [AtomicI32; 2] = [AtomicI32::new(0), AtomicI32::new(0)];
/// Which encoders stick: bits 0, 1.
static STUCK: AtomicU32 = AtomicU32::new(0);
/// Bits of the current, A, and of the load, N m.
static CURRENT: AtomicU32 = AtomicU32::new(0);
static LOAD: AtomicU32 = AtomicU32::new(0);

/// A plant that stands in.
pub trait Plant<const E: usize> {
    /// What its counters say.
    fn counts(&self) -> [i32; E];

    /// One period passes under a current, A, and a load against positive motion, N m.
    fn advance(&mut self, u: f32, load_n_m: f32, period_s: f32);
}

/// What the counters say.
#[inline(always)]
pub fn counts<const E: usize>() -> [Option<i32>; E] {
    core::array::from_fn(|i| COUNTS.get(i).map(|count| count.load(Relaxed)))
}

/// The current from now on.
#[inline(always)]
pub fn hold(u: f32) {
    CURRENT.store(u.to_bits(), Relaxed);
    SCB::set_pendsv();
}

/// A period passes.
pub fn advance<const E: usize>(plant: &mut impl Plant<E>, period_s: f32) {
    let [u, load] = [&CURRENT, &LOAD].map(|bits| f32::from_bits(bits.load(Relaxed)));
    plant.advance(u, load, period_s);
    let stuck = STUCK.load(Relaxed);
    for (i, count) in plant.counts().into_iter().enumerate().filter(|(i, _)| stuck >> i & 1 == 0) {
        COUNTS[i].store(count, Relaxed);
    }
}

/// What a test does to it.
pub fn disturb(disturbance: &Disturbance) {
    let Disturbance { stuck: [a, b], load_n_m } = *disturbance;
    STUCK.store(u32::from(a) | u32::from(b) << 1, Relaxed);
    LOAD.store(load_n_m.to_bits(), Relaxed);
}
