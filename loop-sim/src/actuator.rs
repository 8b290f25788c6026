//! Chain from the controller's demand to the input that acts on the plant.
//!
//! Every fault is a wrapper, as in [`sensor`](crate::sensor). The chain is built from the plant outwards: the innermost
//! link drives the plant. Each wrapper is one link nearer to the controller, changes the demand and passes it inwards.
//!
//! ```
//! use loop_sim::actuator::{Actuator, Delayed, Ideal, Limited};
//! // The demand is limited first, then takes one tick to arrive.
//! let mut actuator = Limited::new(Delayed::new(Ideal, 1), -10.0, 10.0);
//! assert_eq!([50.0, 3.0, 0.0].map(|demand| actuator.drive(demand)), [0.0, 10.0, 3.0]);
//! ```
//!
//! **A demand that is not finite never reaches the plant.** Every link, [`Ideal`] included, replaces NaN and infinities
//! by 0, so a drive with an invalid demand switches off. Holding the last value needs memory in every link and hides
//! the fault. With 0 the trace shows it.

use std::collections::VecDeque;
use std::ops::Range;

/// One link of the actuating chain.
pub trait Actuator: Send {
    /// Accepts the demand once per tick. Returns the value that is held until the next tick.
    fn drive(&mut self, demand: f64) -> f64;
}

impl<T: Actuator + ?Sized> Actuator for Box<T> {
    fn drive(&mut self, demand: f64) -> f64 {
        (**self).drive(demand)
    }
}

/// Returns the demand, or 0 if the demand is not finite.
fn finite_or_off(demand: f64) -> f64 {
    if demand.is_finite() { demand } else { 0.0 }
}

/// Actuator that holds the demand unchanged.
pub struct Ideal;

impl Actuator for Ideal {
    fn drive(&mut self, demand: f64) -> f64 {
        finite_or_off(demand)
    }
}

/// Actuator that limits the demand to [min, max].
pub struct Limited<A> {
    inner: A,
    min: f64,
    max: f64,
}

impl<A> Limited<A> {
    /// Wraps `inner` with limits in the unit of u. If they are reversed, `max` wins.
    pub fn new(inner: A, min: f64, max: f64) -> Self {
        Self { inner, min, max }
    }
}

impl<A: Actuator> Actuator for Limited<A> {
    fn drive(&mut self, demand: f64) -> f64 {
        self.inner.drive(finite_or_off(demand).max(self.min).min(self.max))
    }
}

/// Actuator that limits the demand to ±most in a range of ticks, like a power stage that is hot or on a low supply.
pub struct Derated<A> {
    inner: A,
    most: f64,
    ticks: Range<usize>,
    passed: usize,
}

impl<A> Derated<A> {
    /// Wraps `inner` with the limit `most` in the unit of u. The first tick is 0.
    pub fn new(inner: A, most: f64, ticks: Range<usize>) -> Self {
        Self { inner, most, ticks, passed: 0 }
    }
}

impl<A: Actuator> Actuator for Derated<A> {
    fn drive(&mut self, demand: f64) -> f64 {
        let demand = finite_or_off(demand);
        let is_derated = self.ticks.contains(&self.passed);
        self.passed += 1;
        self.inner.drive(if is_derated { demand.max(-self.most).min(self.most) } else { demand })
    }
}

/// Actuator that limits the rate of change of the demand, starting from 0.
pub struct RateLimited<A> {
    inner: A,
    per_tick: f64,
    last: f64,
}

impl<A> RateLimited<A> {
    /// Wraps `inner` with the largest |du/dt| `per_second`, in the unit of u per second, at the period T `period_s`.
    pub fn new(inner: A, per_second: f64, period_s: f64) -> Self {
        Self { inner, per_tick: (per_second * period_s).abs(), last: 0.0 }
    }
}

impl<A: Actuator> Actuator for RateLimited<A> {
    fn drive(&mut self, demand: f64) -> f64 {
        let (low, high) = (self.last - self.per_tick, self.last + self.per_tick);
        self.last = finite_or_off(demand).max(low).min(high);
        self.inner.drive(self.last)
    }
}

/// Actuator that delays the demand by whole ticks. The output is 0 until the first demand arrives.
pub struct Delayed<A> {
    inner: A,
    ticks: usize,
    under_way: VecDeque<f64>,
}

impl<A> Delayed<A> {
    /// Wraps `inner` with a delay of whole ticks. The buffer is allocated here and not during a run.
    pub fn new(inner: A, ticks: usize) -> Self {
        Self { inner, ticks, under_way: VecDeque::with_capacity(ticks + 1) }
    }
}

impl<A: Actuator> Actuator for Delayed<A> {
    fn drive(&mut self, demand: f64) -> f64 {
        self.under_way.push_back(finite_or_off(demand));
        let arrived = if self.under_way.len() > self.ticks { self.under_way.pop_front() } else { None };
        self.inner.drive(arrived.unwrap_or(0.0))
    }
}

/// Actuator on a slow bus: it accepts every m-th demand (ticks 0, m, 2m, ..) and holds it in between.
pub struct SlowBus<A> {
    inner: A,
    ticks: usize,
    age: usize,
    kept: f64,
}

impl<A> SlowBus<A> {
    /// Wraps `inner` with m = `ticks`. 0 counts as 1, which is every tick.
    pub fn new(inner: A, ticks: usize) -> Self {
        Self { inner, ticks, age: 0, kept: 0.0 }
    }
}

impl<A: Actuator> Actuator for SlowBus<A> {
    fn drive(&mut self, demand: f64) -> f64 {
        if self.age == 0 {
            self.kept = finite_or_off(demand);
        }
        self.age += 1;
        if self.age >= self.ticks {
            self.age = 0;
        }
        self.inner.drive(self.kept)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limited_clamps_at_both_ends() {
        let mut actuator = Limited::new(Ideal, -1.0, 2.0);
        assert_eq!([-5.0, -1.0, 0.3, 2.0, 7.0].map(|demand| actuator.drive(demand)), [-1.0, -1.0, 0.3, 2.0, 2.0]);
    }

    #[test]
    fn reversed_limits_do_not_panic() {
        assert_eq!(Limited::new(Ideal, 1.0, -1.0).drive(0.0), -1.0);
    }

    #[test]
    fn rate_limited_ramps_from_zero_to_the_demand_and_back() {
        let mut actuator = RateLimited::new(Ideal, 250.0, 2e-3);
        assert_eq!([1.2, 1.2, 1.2, 0.9, -9.0].map(|demand| actuator.drive(demand)), [0.5, 1.0, 1.2, 0.9, 0.4]);
    }

    #[test]
    fn delayed_starts_with_zero_and_then_lags_by_whole_ticks() {
        for (ticks, expected) in [(0, [1.0, 2.0, 3.0]), (1, [0.0, 1.0, 2.0]), (2, [0.0, 0.0, 1.0])] {
            let mut actuator = Delayed::new(Ideal, ticks);
            assert_eq!([1.0, 2.0, 3.0].map(|demand| actuator.drive(demand)), expected, "{ticks} ticks");
        }
    }

    #[test]
    fn held_takes_every_mth_demand() {
        let demands = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        for (ticks, expected) in [(0, demands), (1, demands), (3, [1.0, 1.0, 1.0, 4.0, 4.0, 4.0, 7.0])] {
            let mut actuator = SlowBus::new(Ideal, ticks);
            assert_eq!(demands.map(|demand| actuator.drive(demand)), expected, "{ticks} ticks");
        }
    }

    #[test]
    fn the_outer_link_sees_the_demand_first() {
        // Limiting before the rate limit makes the output return at once. Limiting after it delays the return.
        let demands = [10.0, 10.0, 10.0, 0.0];
        let mut limited_first = Limited::new(RateLimited::new(Ideal, 1.0, 1.0), -1.0, 1.0);
        let mut ramped_first = RateLimited::new(Limited::new(Ideal, -1.0, 1.0), 1.0, 1.0);
        assert_eq!(demands.map(|demand| limited_first.drive(demand)), [1.0, 1.0, 1.0, 0.0]);
        assert_eq!(demands.map(|demand| ramped_first.drive(demand)), [1.0, 1.0, 1.0, 1.0]);
    }

    #[test]
    fn a_demand_that_is_not_finite_switches_off_and_poisons_no_link() {
        let links: [Box<dyn Actuator>; 5] = [
            Box::new(Ideal),
            Box::new(Limited::new(Ideal, -9.0, 9.0)),
            Box::new(RateLimited::new(Ideal, 100.0, 1.0)),
            Box::new(Delayed::new(Ideal, 0)),
            Box::new(SlowBus::new(Ideal, 1)),
        ];
        for (link, mut actuator) in links.into_iter().enumerate() {
            for nonsense in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert_eq!([4.0, nonsense, 3.0].map(|demand| actuator.drive(demand)), [4.0, 0.0, 3.0], "link {link}");
            }
        }
    }

    #[test]
    fn links_stack_at_run_time() {
        let mut actuator: Box<dyn Actuator> = Box::new(Ideal);
        actuator = Box::new(Delayed::new(actuator, 1));
        actuator = Box::new(Limited::new(actuator, -1.0, 1.0));
        assert_eq!([5.0, 0.5].map(|demand| actuator.drive(demand)), [0.0, 1.0]);
    }
}
