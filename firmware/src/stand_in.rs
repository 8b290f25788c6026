//! BOARD: remove. Simulated plant on the target, so that a drive runs on a bare board and in the emulator.
//!
//! The control interrupt passes its current to [`hold`]. After the interrupt, the exception PendSV simulates one period
//! ([`advance`]), and the next [`counts`] follow from it. The measured time therefore belongs to the drive alone.

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
/// Frozen encoders and missing counts, as [`Disturbance::bits`].
static STUCK: AtomicU32 = AtomicU32::new(0);
/// Plant parameters from the next period on.
static NEXT: Mutex<Cell<Option<pil_wire::Plant>>> = Mutex::new(Cell::new(None));
/// Current, A, and load, N m, as bits.
static CURRENT: AtomicU32 = AtomicU32::new(0);
static LOAD: AtomicU32 = AtomicU32::new(0);
/// Periods until the load ends. 0 for a load without an end.
static LOAD_LEFT: AtomicU32 = AtomicU32::new(0);

/// Simulated plant.
pub trait Plant<const E: usize> {
    /// Returns the encoder counts.
    fn counts(&self) -> [i32; E];

    /// Changes the parameters; the plant is then at rest at its present angle.
    fn become_as(&mut self, numbers: &pil_wire::Plant);

    /// Simulates one period under a current, A, and a load against positive motion, N m.
    fn advance(&mut self, u: f32, load_n_m: f32, period_s: f32);
}

/// Returns the encoder counts; `None` for a missing count.
#[inline(always)]
pub fn counts<const E: usize>() -> [Option<i32>; E] {
    let lost = STUCK.load(Relaxed) >> 2;
    core::array::from_fn(|i| COUNTS.get(i).filter(|_| lost >> i & 1 == 0).map(|count| count.load(Relaxed)))
}

/// Sets the current.
#[inline(always)]
pub fn hold(u: f32) {
    CURRENT.store(u.to_bits(), Relaxed);
    SCB::set_pendsv();
}

/// Simulates one period.
pub fn advance<const E: usize>(plant: &mut impl Plant<E>, period_s: f32) {
    if let Some(numbers) = critical_section::with(|cs| NEXT.borrow(cs).take()) {
        plant.become_as(&numbers);
    }
    let [u, load] = [&CURRENT, &LOAD].map(|bits| f32::from_bits(bits.load(Relaxed)));
    plant.advance(u, load, period_s);
    // Only main writes these two besides, without interrupts.
    if let Some(left) = LOAD_LEFT.load(Relaxed).checked_sub(1) {
        LOAD_LEFT.store(left, Relaxed);
        if left == 0 {
            LOAD.store(0, Relaxed);
        }
    }
    let stuck = STUCK.load(Relaxed);
    for (i, count) in plant.counts().into_iter().enumerate().filter(|(i, _)| stuck >> i & 1 == 0) {
        COUNTS[i].store(count, Relaxed);
    }
}

/// Sets a disturbance for a test.
pub fn disturb(disturbance: &Disturbance) {
    critical_section::with(|_| {
        STUCK.store(disturbance.bits(), Relaxed);
        LOAD.store(disturbance.load_n_m.to_bits(), Relaxed);
        LOAD_LEFT.store(disturbance.load_ticks, Relaxed);
    });
}

/// Changes the plant from the next period on; returns false, without a change, if the inertia is not positive.
pub fn replace(numbers: &pil_wire::Plant) -> bool {
    let is_good = numbers[4] > 0.0;
    if is_good {
        critical_section::with(|cs| NEXT.borrow(cs).set(Some(*numbers)));
    }
    is_good
}

/// An angle in counts: whole counts, and a remainder within half a count. The split avoids a rounding error in every
/// period, which would act like a disturbance.
#[derive(Clone, Copy)]
struct Angle {
    whole: i32,
    rest: f32,
}

impl Angle {
    const ZERO: Self = Self { whole: 0, rest: 0.0 };

    fn move_by(&mut self, counts: f32) {
        self.rest += counts;
        // Rounds to the nearest.
        let step = (self.rest + if self.rest < 0.0 { -0.5 } else { 0.5 }) as i32;
        self.whole = self.whole.wrapping_add(step);
        self.rest -= step as f32;
    }

    /// Returns the angle from another one to this one, counts.
    fn from(self, other: Self) -> f32 {
        self.whole.wrapping_sub(other.whole) as f32 + (self.rest - other.rest)
    }

    /// Returns the angle within half a revolution, rad.
    fn rad(self, counts_per_turn: i32) -> f32 {
        let half = counts_per_turn / 2;
        let within = (self.whole.wrapping_add(half)).rem_euclid(counts_per_turn) - half;
        (within as f32 + self.rest) * (core::f32::consts::TAU / counts_per_turn as f32)
    }

    /// Returns a sin of `times` times the angle.
    fn wave(self, times: i32, counts_per_turn: i32, a: f32) -> f32 {
        let often = Self { whole: self.whole.wrapping_mul(times), rest: self.rest * times as f32 };
        controller_core::drive::sin_cos(often.rad(counts_per_turn), a).0
    }
}

/// Cogging periods per revolution.
const COGGING_PER_TURN: i32 = 24;

/// Returns the speed after a period under an acceleration and a damping (trapezoidal rule), and the travelled distance.
fn moved(speed: f32, acceleration: f32, damping: f32, period_s: f32) -> (f32, f32) {
    let half = 0.5 * period_s;
    let next = (speed * (1.0 - half * damping) + period_s * acceleration) / (1.0 + half * damping);
    (next, half * (speed + next))
}
