//! Random designs from a seed. The generator is `SplitMix64`, with one word of state and identical results on every
//! platform. A failing test prints its seed.

use crate::oracle::{Complex, Gains, Model, Spec, monic, power};
use crate::truth::{LinearChain, Term};

/// `SplitMix64` random number generator.
#[derive(Clone, Debug)]
pub struct Rng(u64);

impl Rng {
    /// Creates a generator from a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number uniform in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a number log-uniform in [low, high); both limits above 0.
    pub fn spread(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }

    /// Returns true with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.within(0.0, 1.0) < probability
    }

    /// Returns an integer in low..=high.
    pub fn integer(&mut self, low: usize, high: usize) -> usize {
        low + (self.bits() % (high - low + 1) as u64) as usize
    }

    /// Returns a random element of the list.
    pub fn one_of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.integer(0, all.len() - 1)]
    }

    /// Returns -1 or 1.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { -1.0 } else { 1.0 }
    }

    /// Returns `count` stable poles: magnitude omega/3 to omega, damping at least 0.5.
    pub fn poles(&mut self, omega: f64, count: usize) -> Vec<Complex> {
        let mut poles = Vec::new();
        while poles.len() < count {
            let magnitude = omega * self.within(1.0 / 3.0, 1.0);
            if poles.len() + 2 <= count && self.chance(0.4) {
                let damping = self.within(0.5, 0.95);
                let (re, im) = (-magnitude * damping, magnitude * (1.0 - damping * damping).sqrt());
                poles.extend([(re, im), (re, -im)]);
            } else {
                poles.push((-magnitude, 0.0));
            }
        }
        poles
    }
}

/// One trial of a random campaign: its random numbers, its progress, and a log if requested.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Source of all randomness of the trial.
    pub rng: Rng,
    /// Progress so far, in the unit of the campaign.
    pub done: u64,
    told: Option<Vec<String>>,
}

impl Trial {
    /// Creates a trial from a seed; `is_told` keeps the lines of [`tell`](Self::tell).
    pub fn new(seed: u64, is_told: bool) -> Self {
        Self { rng: Rng::new(seed), done: 0, told: is_told.then(Vec::new) }
    }

    /// Adds a line to the log, if the log is kept.
    pub fn tell(&mut self, line: impl FnOnce() -> String) {
        if let Some(told) = &mut self.told {
            told.push(line());
        }
    }

    /// Returns the log lines.
    pub fn told(&self) -> &[String] {
        self.told.as_deref().unwrap_or_default()
    }
}

/// Returns c_1 .. c_n of the surface whose sliding motion has these poles.
pub fn surface(poles: &[Complex]) -> Vec<f64> {
    let mut c = monic(poles);
    c.reverse();
    c.push(1.0);
    c
}

/// Returns da/dx_1..da/dx_n of a chain that has these poles at u = 0.
pub fn drift_row(poles: &[Complex]) -> Vec<f64> {
    let mut row: Vec<f64> = monic(poles).iter().map(|coefficient| -coefficient).collect();
    row.reverse();
    row
}

/// Returns a design of the given configuration that the shipped `try_design` accepts; no other property is required.
/// Gains range up to deadbeat. Slopes have either sign, the gradient is arbitrary, and b(x) is constant or varies.
/// Switching and the limits are optional.
pub fn any_design(rng: &mut Rng, n: usize, capacity: usize, mask: u8) -> (Spec, Model) {
    let period_s = rng.spread(1e-4, 1e-2);
    let bandwidth = rng.spread(0.01, 0.2) / period_s;
    let surface_poles = rng.poles(bandwidth, n - 1);
    let observers = (0..n)
        .map(|i| {
            (mask >> i & 1 == 1).then(|| {
                let order = rng.integer((n - 1 - i).max(1), capacity);
                let omega = rng.spread(0.02, 0.6) / period_s;
                Gains::from_poles(&rng.poles(omega, order))
            })
        })
        .collect();
    let slope = rng.within(-0.5, 3.0) / period_s;
    let mut row: Vec<f64> = (0..n).map(|j| rng.within(-1.0, 1.0) * power(bandwidth, n - j)).collect();
    row[n - 1] = -slope;
    // In 30 % of the designs the gradient is zero except for half the slope.
    let mut gradient = row.clone();
    if rng.chance(0.3) {
        gradient.fill(0.0);
        gradient[n - 1] = -slope / 2.0;
    }
    let input_gain = rng.sign() * rng.spread(0.1, 100.0);
    let with_switching = rng.chance(0.6);
    let spec = Spec {
        period_s,
        c: surface(&surface_poles),
        alpha: rng.spread(0.001, 0.1) / period_s,
        k_l: rng.spread(0.01, 1.5) / period_s,
        k_s: if with_switching { rng.spread(0.1, 10.0) } else { 0.0 },
        epsilon: if rng.chance(0.2) { 0.0 } else { rng.spread(0.001, 1.0) },
        gradient,
        input_gain,
        observers,
        limit: 1e12,
    };
    let bend = rng.within(-1.0, 1.0) * power(bandwidth, n);
    let swing = if rng.chance(0.5) { rng.within(-0.8, 0.8) } else { 0.0 };
    (spec, Model { row, bend, input_gain, swing })
}

/// Chain with its controller, all in proportion to a surface bandwidth, within the range of a reasonable design.
/// Observer poles T <= 0.3, k_l T <= 0.5, nominal slope T from -0.3 (unstable) to 2 (stiff).
#[derive(Clone, Debug)]
pub struct Case {
    /// Controller.
    pub spec: Spec,
    /// Plant; its nominal part equals the design's model.
    pub plant: LinearChain,
    /// Initial state x(0).
    pub x0: Vec<f64>,
    /// Number of ticks; metrics use the second half.
    pub ticks: usize,
}

/// Draws a [`Case`]. The last channel always has an observer, each mismatched channel that Eq. (44) allows has one with
/// probability one half. Disturbances act in observed channels: sinusoids slower than the surface, a constant,
/// sometimes a step.
pub fn case(rng: &mut Rng) -> Case {
    let n = rng.integer(2, 6);
    let period_s = [1e-3, 2e-3, 5e-3][rng.integer(0, 2)];
    let bandwidth_t = rng.spread(0.01, 0.05);
    let bandwidth = bandwidth_t / period_s;
    let ticks = (60.0 / bandwidth_t).round() as usize;
    let observer_t = rng.spread((3.0 * bandwidth_t).max(0.05), 0.3);
    let observers: Vec<Option<Gains>> = (0..n)
        .map(|i| {
            let needed = (n - 1 - i).max(1);
            let observed = i == n - 1 || (needed <= 3 && rng.chance(0.5));
            observed.then(|| {
                let order = rng.integer(needed, 3);
                Gains::from_poles(&rng.poles(observer_t / period_s, order))
            })
        })
        .collect();

    let slope = if rng.chance(0.3) { rng.within(-0.3, 0.0) } else { rng.spread(0.01, 2.0) } / period_s;
    let mut poles = vec![(-slope, 0.0)];
    while poles.len() < n {
        let magnitude = bandwidth * rng.within(0.3, 1.0);
        let damping = rng.within(-0.3, 1.0);
        if poles.len() + 2 <= n {
            let im = magnitude * (1.0 - damping * damping).sqrt();
            poles.extend([(-damping * magnitude, im), (-damping * magnitude, -im)]);
        } else {
            poles.push((-damping * magnitude, 0.0));
        }
    }
    let row = drift_row(&poles);
    let input_gain = rng.sign() * rng.spread(1.0, 10.0);

    let jump_s = (ticks / 4) as f64 * period_s;
    let d = (0..n)
        .map(|i| {
            if observers[i].is_none() {
                return Vec::new();
            }
            let size = 0.02 * power(bandwidth, i + 1);
            let mut amplitude = || size * rng.within(0.3, 1.0) * if i % 2 == 0 { 1.0 } else { -1.0 };
            let amplitudes = [amplitude(), amplitude(), amplitude()];
            let sinusoid = |rng: &mut Rng, amplitude| {
                Term::Sin(amplitude, bandwidth * rng.within(0.2, 0.7), rng.within(0.0, std::f64::consts::PI))
            };
            let second = match rng.integer(0, 2) {
                0 => Term::Const(amplitudes[1]),
                1 => sinusoid(rng, amplitudes[1]),
                _ => Term::Ramp(amplitudes[1] / (ticks as f64 * period_s)),
            };
            let mut terms = vec![sinusoid(rng, amplitudes[0]), second];
            if rng.chance(0.4) {
                terms.push(Term::Step(amplitudes[2], jump_s));
            }
            terms
        })
        .collect();
    let x0 = (0..n).map(|j| 0.02 * power(bandwidth, j) * rng.within(-1.0, 1.0)).collect();
    let spec = Spec {
        period_s,
        c: surface(&rng.poles(bandwidth, n - 1)),
        alpha: bandwidth / 2.0,
        k_l: rng.spread(0.05, 0.5) / period_s,
        k_s: 0.0,
        epsilon: 0.01,
        gradient: row.clone(),
        input_gain,
        observers,
        limit: 1e12,
    };
    Case { spec, plant: LinearChain { a: row, b: input_gain, d }, x0, ticks }
}
