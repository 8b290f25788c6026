//! Lower gains at rest, for a shaft that swings around its target.
//!
//! Within the backlash of a gear the load is loose. The loop then drives another plant than the plant of its design,
//! and the shaft bounces from one flank to the other. It never stands, so neither friction nor a wider
//! [`RestBand`](super::RestBand) stops it. A lower bandwidth stops it. A delayed current, or a very wrong inertia,
//! causes such swings too.
//!
//! Around its mean u swings through ±5 % of its limit, repeatedly. Each such reversal counts, and each tick erases
//! $0.4 w_o T$ of them. More than five reversals mean a swinging loop. The first of two lower gain sets then replaces
//! the law while the target rests. If u swings under the first set too, at a quarter of the rate, the second set
//! follows.
//!
//! A set has its own observer and law, for w = $w_o/4$ and $w_o/8$. The observer has three equal poles $z = e^{-w T}$.
//! Its input is $y = p - r$, the error that the drive estimates:
//!
//! $$ q^- = q + T v + \tfrac{T^2}{2} (b u + d), \quad v^- = v + T (b u + d), \quad e = y - q^- $$
//! $$ q = q^- + (1 - z^3) e, \quad v = v^- + \tfrac{3}{2T} (1 - z)^2 (1 + z) e, \quad
//!    d \leftarrow d + \tfrac{1}{T^2} (1 - z)^3 e $$
//! $$ u = -(w_c k_l \thinspace \mathrm{beyond}(q) + (w_c + k_l) v + d) / b, \quad
//!    w_c = \min(\tfrac{16}{3} w, \tfrac{1}{2T}), \quad k_l = \min(\tfrac{40}{3} w, \tfrac1T) $$
//!
//! $\mathrm{beyond}(q)$ is the part of q beyond β, four widths of the widest rest band. With the loop delay of
//! `by_rule`, |S| stays below 1.55, and below 1.8 if b is off by a half. The loop is stable from a third to three times
//! b.
//!
//! The price appears at a load step: it moves the shaft ten times as far, or fifty times under the second set. So the
//! drive returns to its own gains at an error of more than 5 β, once $96/w_o$ have passed. A load may press the gear to
//! one flank, and then there is no backlash. If the shaft continues to swing, it is detected again. The drive returns
//! at most four times while the target rests.
//!
//! Meanwhile the drive's own law receives the position of the shaft as its target, and its monitors continue. As soon
//! as the target moves, the drive follows with its own gains, and u may step by the effect of the error.

use super::monitor::{LARGEST, lessened};
use super::motor::{decay, lesser};
use crate::real::Real as _;
use crate::running::{Words, next};

/// Two lower gain sets, and the conditions of their use. Part of a [`RestBand`](super::RestBand).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LowerGains {
    period: f32,
    /// Input gain b, and 1/b.
    gain: f32,
    per_gain: f32,
    /// Free play β of q, rad, and the error that counts as a load, rad.
    band: f32,
    load: f32,
    /// Ticks until a lower set has settled.
    settled: f32,
    /// Distance of u from its mean that counts as a swing, A.
    loud: f32,
    averaging: f32,
    forgetting: f32,
    sets: [LowerSet; 2],
}

/// Gains of an observer, and of a law in units of acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct LowerSet {
    observer: [f32; 3],
    law: [f32; 2],
}

/// Ratios of the set bandwidths to the bandwidth of the drive's observer.
const SHARES: [f64; 2] = [0.25, 0.125];
/// Ratios of $w_c$ and $k_l$ to the bandwidth of a set.
const SURFACE: f64 = 16.0 / 3.0;
const REACHING: f64 = 40.0 / 3.0;
/// Swing of u around its mean, as a share of the limit.
const LOUD: f64 = 0.05;
/// Averaging time of u, in time constants of the observer.
const MEAN: f64 = 12.0;
/// Reversals erased per time constant of the observer, and the largest number without a swing.
const FORGOTTEN: f64 = 0.4;
const REVERSALS: f32 = 5.0;
/// Ratio of β to the widest band, and of a load error to β.
const BAND: f32 = 4.0;
const LOAD: f32 = 5.0;
/// Time until a lower set has settled, in time constants of the drive's observer.
const SETTLED: f64 = 96.0;
/// Number of loads that return the drive to its own gains while its target rests.
const RETURNS: u32 = 4;

/// State of the swing detection and of a lower set.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Swing {
    /// Mean of u, A; last side of u relative to it (-1, 1, or 0 for neither); reversals that are not erased.
    mean: f32,
    side: f32,
    reversals: f32,
    /// Lower set in use (0 for none), its ticks, and the number of loads that have ended such a use.
    set: u32,
    ticks: f32,
    returns: u32,
    q: f32,
    v: f32,
    d: f32,
    u: f32,
}

impl Swing {
    pub(super) const NONE: Self =
        Self { mean: 0.0, side: 0.0, reversals: 0.0, set: 0, ticks: 0.0, returns: 0, q: 0.0, v: 0.0, d: 0.0, u: 0.0 };

    pub(super) const fn is_lowered(&self) -> bool {
        self.set > 0
    }

    /// Stores the u that the drive has output in place of the demand.
    pub(super) const fn went_out(&mut self, u: f32) {
        self.u = u;
    }

    pub(super) fn words(&self) -> impl Iterator<Item = u32> + use<> {
        let Self { mean, side, reversals, set, ticks, returns, q, v, d, u } = *self;
        let heard = [mean, side, reversals].map(f32::to_bits).into_iter();
        heard.chain([set, ticks.to_bits(), returns]).chain([q, v, d, u].map(f32::to_bits))
    }

    pub(super) fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let [mean, side, reversals] = Words::from_words(words)?;
        let set = words.next().filter(|set| *set as usize <= SHARES.len())?;
        let (ticks, returns) = (next(words)?, words.next()?);
        let [q, v, d, u] = Words::from_words(words)?;
        Some(Self { mean, side, reversals, set, ticks, returns, q, v, d, u })
    }
}

impl LowerSet {
    const fn numbers(&self) -> [f32; 5] {
        let Self { observer: [l1, l2, l3], law: [k1, k2] } = *self;
        [l1, l2, l3, k1, k2]
    }

    /// Computes the gains for this bandwidth, rad/s.
    const fn of(omega: f64, t: f64) -> Self {
        let (surface, reaching) = (lesser(SURFACE * omega, 0.5 / t), lesser(REACHING * omega, 1.0 / t));
        let away = decay(omega * t);
        let z = 1.0 - away;
        let observer = [1.0 - z * z * z, 1.5 * away * away * (1.0 + z) / t, away * away * away / (t * t)];
        Self {
            observer: [observer[0] as f32, observer[1] as f32, observer[2] as f32],
            law: [(surface * reaching) as f32, (surface + reaching) as f32],
        }
    }
}

impl LowerGains {
    /// Computes the sets for b, the limit of u, the bandwidth of the drive's observer and the widest band.
    pub(super) const fn of(gain: f64, most: f64, omega: f64, period_s: f64, band: f32) -> Self {
        Self {
            period: period_s as f32,
            gain: gain as f32,
            per_gain: (1.0 / gain) as f32,
            band: BAND * band,
            load: LOAD * BAND * band,
            settled: (SETTLED / (omega * period_s)) as f32,
            loud: (LOUD * most) as f32,
            averaging: decay(omega * period_s / MEAN) as f32,
            forgetting: (FORGOTTEN * omega * period_s) as f32,
            sets: [LowerSet::of(SHARES[0] * omega, period_s), LowerSet::of(SHARES[1] * omega, period_s)],
        }
    }

    /// Returns the numbers of a tick, and of each set the gains of the observer and of the law.
    ///
    /// The numbers are T, b, 1/b, β, the error of a load, settling ticks, the swing threshold of u, averaging,
    /// forgetting.
    pub const fn numbers(&self) -> ([f32; 9], [[f32; 5]; 2]) {
        let Self { period, gain, per_gain, band, load, settled, loud, averaging, forgetting, sets: [first, second] } =
            *self;
        let numbers = [period, gain, per_gain, band, load, settled, loud, averaging, forgetting];
        (numbers, [first.numbers(), second.numbers()])
    }

    /// Returns the u that replaces the output after a tick with this error, rad, speed and u. `None` without a lower
    /// set in use.
    #[inline]
    pub(super) fn answer(&self, swing: &mut Swing, [error, speed]: [f32; 2], u: f32) -> Option<f32> {
        let u = if swing.is_lowered() { swing.u } else { u };
        self.listen(swing, [error, speed], u);
        if self.is_load(swing, error) {
            *swing = Swing { mean: swing.u, returns: swing.returns + 1, ..Swing::NONE };
        }
        let set = match swing.set {
            0 => return None,
            1 => &self.sets[0],
            _ => &self.sets[1],
        };
        let asked = self.asked(set, swing, error);
        if asked.abs() <= LARGEST as f32 {
            return Some(asked);
        }
        // An invalid number resets the swing state.
        *swing = Swing::NONE;
        None
    }

    /// Returns true if the error shows a load on a lower set that has settled.
    #[inline]
    fn is_load(&self, swing: &mut Swing, error: f32) -> bool {
        if swing.is_lowered() && swing.ticks < self.settled {
            swing.ticks += 1.0;
            return false;
        }
        swing.is_lowered() && error.abs() > self.load && swing.returns < RETURNS
    }

    /// Counts the reversals of u, and selects the next set if u swings.
    #[inline]
    fn listen(&self, swing: &mut Swing, [error, speed]: [f32; 2], u: f32) {
        let away = u - swing.mean;
        swing.mean += self.averaging * away;
        if away.abs() > self.loud {
            let side = if away > 0.0 { 1.0 } else { -1.0 };
            if side * swing.side < 0.0 {
                swing.reversals += 1.0;
            }
            swing.side = side;
        }
        let forgotten = if swing.is_lowered() { 0.25 * self.forgetting } else { self.forgetting };
        swing.reversals = lessened(swing.reversals, forgotten);
        if swing.reversals > REVERSALS && swing.set < 2 {
            if swing.set == 0 {
                (swing.q, swing.v, swing.u) = (error, speed, swing.mean);
                swing.d = -(self.gain * swing.mean);
            }
            (swing.set, swing.reversals, swing.ticks) = (swing.set + 1, 0.0, 0.0);
        }
    }

    /// Computes a tick of the observer and law of a set.
    #[inline]
    fn asked(&self, set: &LowerSet, swing: &mut Swing, error: f32) -> f32 {
        let ([l1, l2, l3], [k1, k2], t) = (set.observer, set.law, self.period);
        let acceleration = self.gain * swing.u + swing.d;
        let foreseen = swing.q + t * (swing.v + 0.5 * t * acceleration);
        let innovation = error - foreseen;
        swing.q = foreseen + l1 * innovation;
        swing.v = swing.v + t * acceleration + l2 * innovation;
        swing.d += l3 * innovation;
        let beyond = swing.q - swing.q.limited(-self.band, self.band);
        -(self.per_gain * (k1 * beyond + k2 * swing.v + swing.d))
    }
}
