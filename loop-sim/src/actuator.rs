//! From the controller's demand to the input that the plant feels.
//!
//! As with the sensors, every fault is a wrapper and the chain is built from the plant outwards: the innermost link
//! drives the plant, each wrapper sits one link nearer to the controller, alters the demand and hands it inwards.
//!
//! ```
//! use loop_sim::actuator::{Actuator, Delayed, Ideal, Limited};
//! // The demand is limited first, then takes one tick to arrive.
//! let mut actuator = Limited::new(Delayed::new(Ideal, 1), -10.0, 10.0);
//! assert_eq!([50.0, 3.0, 0.0].map(|demand| actuator.drive(demand)), [0.0, 10.0, 3.0]);
//! ```
//!
//! **A demand that is not finite never reaches the plant.** Every link, [`Ideal`] included, takes NaN and infinities
//! for 0: a drive that is told nonsense switches off. (Holding the last value would need memory in every link, and
//! hides the fault: here the trace shows it.)

use std::collections::VecDeque;
use std::ops::Range;

/// One link of the actuating chain.
pub trait Actuator: Send {
    /// Called once per tick with the demand; returns what is really held until the next tick.
    fn drive(&mut self, demand: f64) -> f64;
}

impl<T: Actuator + ?Sized> Actuator for Box<T> {
    fn drive(&mut self, demand: f64) -> f64 {
        (**self).drive(demand)
    }
}

/// 0 for a demand that is not finite.
fn finite_or_off(demand: f64) -> f64 {
    if demand.is_finite() { demand } else { 0.0 }
}

/// Does as it is told.
pub struct Ideal;

impl Actuator for Ideal {
    fn drive(&mut self, demand: f64) -> f64 {
        finite_or_off(demand)
    }
}

/// Limits the demand to [min, max].
pub struct Limited<A> {
    inner: A,
    min: f64,
    max: f64,
}

impl<A> Limited<A> {
    /// `min` and `max` in the unit of u; were they reversed, `max` would win.
    pub fn new(inner: A, min: f64, max: f64) -> Self {
        Self { inner, min, max }
    }
}

impl<A: Actuator> Actuator for Limited<A> {
    fn drive(&mut self, demand: f64) -> f64 {
        self.inner.drive(finite_or_off(demand).max(self.min).min(self.max))
    }
}

/// Limits the demand to ±most in some of its ticks: a power stage that is hot, or on a low supply.
pub struct Derated<A> {
    inner: A,
    most: f64,
    ticks: Range<usize>,
    passed: usize,
}

impl<A> Derated<A> {
    /// `most` in the unit of u; the first tick is 0.
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

/// Lets the demand change by at most a rate; starts from 0.
pub struct RateLimited<A> {
    inner: A,
    per_tick: f64,
    last: f64,
}

impl<A> RateLimited<A> {
    /// `per_second`: largest |du/dt|, unit of u per second; `period_s`: T.
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

/// Hands on the demand of some ticks ago; until there is one, 0.
pub struct Delayed<A> {
    inner: A,
    ticks: usize,
    under_way: VecDeque<f64>,
}

impl<A> Delayed<A> {
    /// A delay of whole ticks; room for all that is under way is made here, none in the run.
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

/// Takes a new demand in every m-th tick only (0, m, 2m, ..) and holds it in between: a slow bus.
pub struct Held<A> {
    inner: A,
    ticks: usize,
    age: usize,
    kept: f64,
}

impl<A> Held<A> {
    /// `ticks`: m; 0 is taken for 1, every tick.
    pub fn new(inner: A, ticks: usize) -> Self {
        Self { inner, ticks, age: 0, kept: 0.0 }
    }
}

impl<A: Actuator> Actuator for Held<A> {
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
            let mut actuator = Held::new(Ideal, ticks);
            assert_eq!(demands.map(|demand| actuator.drive(demand)), expected, "{ticks} ticks");
        }
    }

    #[test]
    fn the_outer_link_sees_the_demand_first() {
        // A rate limit on an already limited demand reaches 1 and leaves it at once; one that has to come back from
        // the full demand is late.
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
            Box::new(Held::new(Ideal, 1)),
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
