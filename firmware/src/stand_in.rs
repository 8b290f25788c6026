//! BOARD: goes. Between the control interrupt and a stand-in of the plant on the chip, so that a drive runs on a bare
//! board and in an emulator.
//!
//! The interrupt leaves its current with [`hold`]; when it has ended, the exception PendSV lets a period pass
//! ([`advance`]), and the coming [`counts`] are of that. So what is measured is the drive.

use core::cell::Cell;
use core::sync::atomic::{AtomicI32, AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::SCB;
use critical_section::Mutex;
use pil_wire::Disturbance;

mod joint;
mod motor;

pub use joint::Joint;
pub use motor::Motor;

static COUNTS: [AtomicI32; 2] = [AtomicI32::new(0), AtomicI32::new(0)];
/// Which encoders stick, and which give no count ([`Disturbance::bits`]).
static STUCK: AtomicU32 = AtomicU32::new(0);
/// What is to stand in from the next period on.
static NEXT: Mutex<Cell<Option<pil_wire::Plant>>> = Mutex::new(Cell::new(None));
/// Bits of the current, A, and of the load, N m.
static CURRENT: AtomicU32 = AtomicU32::new(0);
static LOAD: AtomicU32 = AtomicU32::new(0);

/// A plant that stands in.
pub trait Plant<const E: usize> {
    /// What its counters say.
    fn counts(&self) -> [i32; E];

    /// It becomes another, at rest where it is.
    fn become_as(&mut self, numbers: &pil_wire::Plant);

    /// One period passes under a current, A, and a load against positive motion, N m.
    fn advance(&mut self, u: f32, load_n_m: f32, period_s: f32);
}

/// What the counters say.
#[inline(always)]
pub fn counts<const E: usize>() -> [Option<i32>; E] {
    let lost = STUCK.load(Relaxed) >> 2;
    core::array::from_fn(|i| COUNTS.get(i).filter(|_| lost >> i & 1 == 0).map(|count| count.load(Relaxed)))
}

/// The current from now on.
#[inline(always)]
pub fn hold(u: f32) {
    CURRENT.store(u.to_bits(), Relaxed);
    SCB::set_pendsv();
}

/// A period passes.
pub fn advance<const E: usize>(plant: &mut impl Plant<E>, period_s: f32) {
    if let Some(numbers) = critical_section::with(|cs| NEXT.borrow(cs).take()) {
        plant.become_as(&numbers);
    }
    let [u, load] = [&CURRENT, &LOAD].map(|bits| f32::from_bits(bits.load(Relaxed)));
    plant.advance(u, load, period_s);
    let stuck = STUCK.load(Relaxed);
    for (i, count) in plant.counts().into_iter().enumerate().filter(|(i, _)| stuck >> i & 1 == 0) {
        COUNTS[i].store(count, Relaxed);
    }
}

/// What a test does to it.
pub fn disturb(disturbance: &Disturbance) {
    STUCK.store(disturbance.bits(), Relaxed);
    LOAD.store(disturbance.load_n_m.to_bits(), Relaxed);
}

/// Another plant stands in from the next period on. One without an inertia does not.
pub fn replace(numbers: &pil_wire::Plant) -> bool {
    let is_good = numbers[4] > 0.0;
    if is_good {
        critical_section::with(|cs| NEXT.borrow(cs).set(Some(*numbers)));
    }
    is_good
}

/// An angle in counts: whole ones, and what is left, within half of one. So that 32 bits do not round it in every
/// period, which would look like a push.
#[derive(Clone, Copy)]
struct Angle {
    whole: i32,
    rest: f32,
}

impl Angle {
    const ZERO: Self = Self { whole: 0, rest: 0.0 };

    fn move_by(&mut self, counts: f32) {
        self.rest += counts;
        // To the nearest.
        let step = (self.rest + if self.rest < 0.0 { -0.5 } else { 0.5 }) as i32;
        self.whole = self.whole.wrapping_add(step);
        self.rest -= step as f32;
    }

    /// From another angle to this one, counts.
    fn from(self, other: Self) -> f32 {
        self.whole.wrapping_sub(other.whole) as f32 + (self.rest - other.rest)
    }

    /// Within half a turn, rad.
    fn rad(self, counts_per_turn: i32) -> f32 {
        let half = counts_per_turn / 2;
        let within = (self.whole.wrapping_add(half)).rem_euclid(counts_per_turn) - half;
        (within as f32 + self.rest) * (core::f32::consts::TAU / counts_per_turn as f32)
    }

    /// a sin of so many times the angle.
    fn wave(self, times: i32, counts_per_turn: i32, a: f32) -> f32 {
        let often = Self { whole: self.whole.wrapping_mul(times), rest: self.rest * times as f32 };
        controller_core::drive::sin_cos(often.rad(counts_per_turn), a).0
    }
}

/// Periods of a cogging in a turn.
const COGGING_PER_TURN: i32 = 24;

/// A speed after a period under an acceleration and a damping, by the trapezoid; and how far that is.
fn moved(speed: f32, acceleration: f32, damping: f32, period_s: f32) -> (f32, f32) {
    let half = 0.5 * period_s;
    let next = (speed * (1.0 - half * damping) + period_s * acceleration) / (1.0 + half * damping);
    (next, half * (speed + next))
}
