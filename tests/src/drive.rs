//! Drive fixtures for the suite: replay of recorded counts and simulated motors and joints under a controller.

use std::collections::VecDeque;

use crate::oracle::factorial;
use controller_core::drive::{Aim, ChainModel, EncoderForm, Joint, JointDrive, MotorDrive, Position, Sample, Target};
use controller_core::{ControlLaw, Output, Real, Running, Sealed};

/// Scalar type whose counts are plain `i32`: `f32` and `f64`.
pub trait Plain: Real + Sealed<Count = i32> {}
impl<T: Real + Sealed<Count = i32>> Plain for T {}

/// Drive that starts without waiting for consistent counts.
pub trait AtOnce<C: ControlLaw> {
    /// Runs a tick; the first tick skips the wait for counts that agree.
    fn tick_at_once(&mut self, sample: &C::Sample) -> C::Output;
}

impl<C: ControlLaw> AtOnce<C> for Running<C> {
    fn tick_at_once(&mut self, sample: &C::Sample) -> C::Output {
        self.start_at_once(sample);
        self.tick(sample)
    }
}

/// Returns the target of a trajectory point (r, r', ..). The angle is reduced to one revolution around 0, as an f64
/// planner does.
fn target<T: Plain, A: Aim<T, N>, const N: usize>(mut jet: [f64; N]) -> A::Target {
    let turn = (jet[0] / std::f64::consts::TAU).round();
    jet[0] -= turn * std::f64::consts::TAU;
    A::told(&Target { turn: turn as i32, jet: jet.map(T::from_f64) })
}

/// One row of a recording.
#[derive(Clone, Copy, Debug)]
pub struct Row<const E: usize, const N: usize> {
    /// Counts per encoder; `None` where the count is missing.
    pub counts: [Option<i32>; E],
    /// Current command that the oracle demands, A.
    pub u_demand: f64,
    /// Current command that was applied, A.
    pub u_applied: f64,
    /// σ* of the oracle.
    pub sigma_star: f64,
    /// r, r', .. at the beginning of the tick in which u is applied.
    pub jet: [f64; N],
}

/// Replays a recording through a controller without limits. Returns the largest differences of u and σ* from the
/// recording.
pub fn replay<T, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>(
    law: &EncoderForm<T, M, A, E, N, S, FAST, LATE>,
    rows: &[Row<E, N>],
    mut before: impl FnMut(usize, &mut Running<EncoderForm<T, M, A, E, N, S, FAST, LATE>>, &Sample<i32, A::Target, E>),
) -> [f64; 2]
where
    T: Plain,
    M: ChainModel<T, E, N>,
    A: Aim<T, N>,
    EncoderForm<T, M, A, E, N, S, FAST, LATE>: Copy,
{
    let mut running = Running::new(*law);
    let mut worst = [0.0_f64; 2];
    for (k, pair) in rows.windows(2).enumerate() {
        let sample = Sample {
            counts: pair[0].counts,
            begin: target::<T, A, N>(pair[0].jet),
            end: target::<T, A, N>(pair[1].jet),
        };
        before(k, &mut running, &sample);
        let Output { u, sigma_star, .. } = running.tick_at_once(&sample);
        running.report_applied(T::from_f64(pair[0].u_applied));
        let off = [u.to_f64() - pair[0].u_demand, sigma_star.to_f64() - pair[0].sigma_star];
        for (worst, off) in worst.iter_mut().zip(off) {
            *worst = worst.max(off.abs());
        }
    }
    worst
}

/// Simulated motor with Coulomb and Stribeck friction, cogging, a current-loop lag and a load step. J w' = K_t i - B w
/// - friction + cogging - load, i' = (u - i)/lag; Runge-Kutta of fourth order.
#[derive(Clone, Copy, Debug)]
pub struct Shaft {
    /// Angle rad, speed rad/s, current A.
    pub x: [f64; 3],
    /// J, kg m².
    pub inertia: f64,
    /// K_t, N m/A.
    pub torque: f64,
    /// B, N m s/rad.
    pub damping: f64,
    /// Static and Coulomb friction, N m.
    pub friction: [f64; 2],
    /// Cogging: amplitude N m, periods per revolution.
    pub cogging: [f64; 2],
    /// Time constant of the current loop, s; 0 for none.
    pub lag_s: f64,
    /// Load step: start s, torque N m.
    pub load: [f64; 2],
    /// Current limit of the amplifier, A.
    pub largest_current: f64,
}

impl Shaft {
    /// Motor of the acceptance tests: 2e-4 kg m², 0.05 N m/A, all disturbances except the load.
    pub const ROUGH: Self = Self {
        x: [0.0; 3],
        inertia: 2e-4,
        torque: 0.05,
        damping: 1e-5,
        friction: [0.008, 0.005],
        cogging: [0.003, 7.0],
        lag_s: 2e-4,
        load: [f64::INFINITY, 0.0],
        largest_current: f64::INFINITY,
    };

    /// Motor of the acceptance tests without friction, cogging and lag.
    pub const CLEAN: Self = Self { friction: [0.0; 2], cogging: [0.0, 7.0], lag_s: 0.0, ..Self::ROUGH };

    fn rate(&self, t: f64, [q, w, i]: [f64; 3], u: f64) -> [f64; 3] {
        let [fs, fc] = self.friction;
        let friction = (fc + (fs - fc) * (-(w / 0.1) * (w / 0.1)).exp()) * (w / 0.005).tanh();
        let load = if t >= self.load[0] { self.load[1] } else { 0.0 };
        let driving = self.torque * if self.lag_s > 0.0 { i } else { u };
        let cogging = self.cogging[0] * (self.cogging[1] * q).sin();
        let torque = driving - self.damping * w - friction + cogging - load;
        [w, torque / self.inertia, if self.lag_s > 0.0 { (u - i) / self.lag_s } else { 0.0 }]
    }

    /// Integrates one period from time t with u held.
    pub fn advance(&mut self, t: f64, u: f64, period_s: f64) {
        let u = u.clamp(-self.largest_current, self.largest_current);
        let steps = (period_s / 5e-5 - 1e-9).ceil().max(1.0);
        let h = period_s / steps;
        for k in 0..steps as u32 {
            let s = t + f64::from(k) * h;
            let at = |x: [f64; 3], d: [f64; 3], h: f64| core::array::from_fn(|j| x[j] + h * d[j]);
            let a = self.rate(s, self.x, u);
            let b = self.rate(s + h / 2.0, at(self.x, a, h / 2.0), u);
            let c = self.rate(s + h / 2.0, at(self.x, b, h / 2.0), u);
            let d = self.rate(s + h - 1e-12, at(self.x, c, h), u);
            self.x = core::array::from_fn(|j| self.x[j] + h / 6.0 * (a[j] + 2.0 * b[j] + 2.0 * c[j] + d[j]));
        }
    }
}

/// Signals of one closed-loop run, tick by tick.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// True angle minus the reference, rad.
    pub error: Vec<f64>,
    /// True speed minus the reference, rad/s.
    pub speed_error: Vec<f64>,
    /// Current command within the limits, A.
    pub u: Vec<f64>,
    /// Load estimate, N m.
    pub load: Vec<f64>,
}

/// Returns the largest absolute value.
pub fn peak(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |peak, value| peak.max(value.abs()))
}

/// Returns the root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Evaluates an expression with the delay (0 to 3 ticks) as the constant `$late`.
#[macro_export]
macro_rules! with_delay {
    ($delay:expr, $late:ident => $made:expr) => {
        match $delay {
            0 => $crate::with_delay!(@ 0, $late => $made),
            1 => $crate::with_delay!(@ 1, $late => $made),
            2 => $crate::with_delay!(@ 2, $late => $made),
            _ => $crate::with_delay!(@ 3, $late => $made),
        }
    };
    (@ $number:literal, $late:ident => $made:expr) => {{
        const $late: usize = $number;
        $made
    }};
}

/// Settings of a closed-loop run.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Control period, s.
    pub period_s: f64,
    /// Encoder resolution, bits.
    pub bits: u32,
    /// Length of the run, ticks.
    pub ticks: u32,
    /// Delay of u to the actuator, ticks.
    pub delay: u32,
}

/// Runs a motor in closed loop on planned trajectory points. Only the controller computes in `T`; the rest is f64.
pub fn run_motor<T, A, const S: usize, const FAST: usize, const LATE: usize>(
    law: MotorDrive<T, A, FAST, LATE, S>,
    mut shaft: Shaft,
    run: Run,
    plan: &dyn Fn(f64) -> [f64; 2],
    mut each: impl FnMut(u32, &mut Sample<i32, A::Target, 1>, &mut Running<MotorDrive<T, A, FAST, LATE, S>>),
) -> Trace
where
    T: Plain,
    A: Aim<T, 2>,
{
    let (mut running, mut trace) = (Running::new(law), Trace::default());
    let mut queued = VecDeque::from(vec![0.0; run.delay as usize]);
    let unit = std::f64::consts::TAU / f64::from(1 << run.bits);
    let ahead = f64::from(run.delay);
    for k in 0..run.ticks {
        let t = f64::from(k) * run.period_s;
        let count = (shaft.x[0] / unit + 0.5).floor() as i64;
        let [begin, end] = [ahead, ahead + 1.0].map(|more| plan(t + more * run.period_s));
        // The counter wraps.
        let raw = count.rem_euclid(1 << run.bits) as i32;
        let mut sample = Sample { counts: [Some(raw)], begin: target::<T, A, 2>(begin), end: target::<T, A, 2>(end) };
        each(k, &mut sample, &mut running);
        let u = running.tick_at_once(&sample).u.to_f64();
        let [r, v] = plan(t);
        trace.error.push(shaft.x[0] - r);
        trace.speed_error.push(shaft.x[1] - v);
        trace.u.push(u);
        trace.load.push(running.estimates().map_or(0.0, |known| known.load[0].to_f64()));
        queued.push_back(u);
        let held = queued.pop_front().unwrap_or(u);
        shaft.advance(t, held, run.period_s);
    }
    trace
}

/// Returns a step from 0 to 1 over [0, 1], smooth to degree 9, with four derivatives by its argument.
pub fn smooth_step(s: f64, degree: usize) -> [f64; 5] {
    let powers: &[f64] = match degree {
        3 => &[0.0, 0.0, 3.0, -2.0],
        5 => &[0.0, 0.0, 0.0, 10.0, -15.0, 6.0],
        7 => &[0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0],
        _ => &[0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0],
    };
    if s >= 1.0 {
        return [1.0, 0.0, 0.0, 0.0, 0.0];
    }
    if s > 0.0 { polynomial(powers, s) } else { [0.0; 5] }
}

/// Returns a polynomial and four derivatives by its argument.
fn polynomial(powers: &[f64], s: f64) -> [f64; 5] {
    let mut jet = [0.0; 5];
    for (i, power) in powers.iter().enumerate() {
        let mut factor = *power;
        for (j, entry) in jet.iter_mut().enumerate().take(i + 1) {
            *entry += factor * s.powi((i - j) as i32);
            factor *= (i - j) as f64;
        }
    }
    jet
}

/// Returns the transition from a trajectory point at t = 0 to rest at 0 in `tau`. The first `m` derivatives are
/// continuous at t = 0. The transition is (1 - s)^m times a polynomial of degree m - 1, s = t/tau.
pub fn to_rest(present: [f64; 5], tau: f64, m: usize) -> impl Fn(f64) -> [f64; 5] {
    let times = |a: &[f64], b: &[f64]| {
        let mut product = vec![0.0; a.len() + b.len() - 1];
        for (i, a) in a.iter().enumerate() {
            b.iter().enumerate().for_each(|(j, b)| product[i + j] += a * b);
        }
        product
    };
    // Coefficients of the point's own polynomial divided by (1 - s)^m: 1/(1 - s) is 1 + s + s² + ...
    let mut powers: Vec<f64> = (0..m).map(|j| present[j] * tau.powi(j as i32) / factorial(j)).collect();
    for _ in 0..m {
        (1..m).for_each(|j| powers[j] += powers[j - 1]);
    }
    for _ in 0..m {
        powers = times(&powers, &[1.0, -1.0]);
    }
    move |t| {
        if t >= tau {
            return [0.0; 5];
        }
        let jet = polynomial(&powers, t / tau);
        core::array::from_fn(|j| jet[j] / tau.powi(j as i32))
    }
}

/// Returns the shortest transition time for which |u| stays within a limit at 64 instants. The search grows by
/// quarters, then refines.
pub fn shortest_to_rest(present: [f64; 5], m: usize, limit: f64, u: impl Fn(&[f64; 5]) -> f64) -> f64 {
    let fits = |tau: f64| {
        let plan = to_rest(present, tau, m);
        (0..64).all(|i| u(&plan(tau * (f64::from(i) + 1e-9) / 64.0)).abs() <= limit)
    };
    let (mut low, mut high) = (0.02, 0.02);
    while !fits(high) {
        (low, high) = (high, 1.25 * high);
    }
    for _ in 0..30 {
        let middle = (low * high).sqrt();
        if fits(middle) { high = middle } else { low = middle }
    }
    high
}

/// Returns a move of `distance` from rest to rest between `start` and `start + tau`.
pub fn point_to_point<const J: usize>(distance: f64, start: f64, tau: f64, degree: usize) -> impl Fn(f64) -> [f64; J] {
    move |t| {
        let jet = smooth_step((t - start) / tau, degree);
        core::array::from_fn(|j| distance * jet[j] / tau.powi(j as i32))
    }
}

const BINOMIAL: [[f64; 5]; 5] = [
    [1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0],
];

/// Returns A sin ωt multiplied by a step of degree 9 over the first `blend` seconds.
pub fn blended_sine<const J: usize>(amplitude: f64, omega: f64, blend: f64) -> impl Fn(f64) -> [f64; J] {
    move |t| {
        let (s, c) = (omega * t).sin_cos();
        let sine: [f64; 5] = core::array::from_fn(|j| amplitude * omega.powi(j as i32) * [s, c, -s, -c][j % 4]);
        let jet = smooth_step(t / blend, 9);
        let step: [f64; 5] = core::array::from_fn(|j| jet[j] / blend.powi(j as i32));
        core::array::from_fn(|n| (0..=n).map(|m| BINOMIAL[n][m] * sine[m] * step[n - m]).sum())
    }
}

/// True joint of the paper: link angle and speed, motor angle times the nominal k_1 and its speed. Parameter errors are
/// relative, for K_s/J_l, link damping, K_s/J_m, motor damping and K_t/J_m. An unknown input v = 1 + sin 2t A adds to
/// u.
#[derive(Clone, Copy, Debug)]
pub struct Flexible {
    /// x_1 .. x_4.
    pub x: [f64; 4],
    /// Relative errors of the five parameters.
    pub errors: [f64; 5],
    /// Load step: start s, acceleration of the link rad/s².
    pub load: [f64; 2],
    /// True for friction (1.5 A static, 1 A Coulomb), cogging 0.3 A and torque ripple 2 %.
    pub rough: bool,
    /// Current limit of the amplifier, A.
    pub largest_current: f64,
}

impl Flexible {
    /// Joint at rest at 0 that matches the controller's model.
    pub const NOMINAL: Self = Self {
        x: [0.0; 4],
        errors: [0.0; 5],
        load: [f64::INFINITY, 0.0],
        rough: false,
        largest_current: f64::INFINITY,
    };
    /// K_s/J_l of Table I.
    pub const K_1: f64 = 9.0 / 0.230;

    fn rate(&self, t: f64, x: [f64; 4], u: f64) -> [f64; 4] {
        let [e1, e2, e3, e4, e5] = self.errors.map(|error| 1.0 + error);
        let (b_1, k_2, b_2, b) = (0.07 / 0.230 * e2, 9.0 / 931e-6 * e3, 0.07 / 931e-6 * e4, 0.119 / 931e-6 * e5);
        let (angle, speed) = (x[2] / Self::K_1, x[3] / Self::K_1);
        let mut u = u;
        if self.rough {
            u *= 1.0 + 0.02 * (42.0 * angle).sin();
            u -= (1.0 + 0.5 * (-(speed / 0.05) * (speed / 0.05)).exp()) * (speed / 0.005).tanh();
            u += 0.3 * (24.0 * angle).sin();
        }
        let load = if t >= self.load[0] { self.load[1] } else { 0.0 };
        let twist = x[2] - Self::K_1 * x[0];
        let driven = b * (u + 1.0 + (2.0 * t).sin());
        [x[1], e1 * twist - b_1 * x[1] - x[0].sin() + load, x[3], Self::K_1 * driven - k_2 * twist - b_2 * x[3]]
    }

    /// Integrates one period from time t with u held.
    pub fn advance(&mut self, t: f64, u: f64, period_s: f64) {
        let u = u.clamp(-self.largest_current, self.largest_current);
        let steps = (period_s / if self.rough { 5e-5 } else { 5e-4 } - 1e-9).ceil().max(1.0);
        let h = period_s / steps;
        for k in 0..steps as u32 {
            let s = t + f64::from(k) * h;
            let at = |x: [f64; 4], d: [f64; 4], h: f64| core::array::from_fn(|j| x[j] + h * d[j]);
            let a = self.rate(s, self.x, u);
            let b = self.rate(s + h / 2.0, at(self.x, a, h / 2.0), u);
            let c = self.rate(s + h / 2.0, at(self.x, b, h / 2.0), u);
            let d = self.rate(s + h - 1e-12, at(self.x, c, h), u);
            self.x = core::array::from_fn(|j| self.x[j] + h / 6.0 * (a[j] + 2.0 * b[j] + 2.0 * c[j] + d[j]));
        }
    }
}

/// Returns the shortest transition to rest at 0 within 27 A. It starts at rest with the spring deflected by `angle`
/// rad.
pub fn recovered(angle: f64) -> impl Fn(f64) -> [f64; 4] {
    let pull = Flexible::K_1 * angle + angle.sin();
    let present = [angle, 0.0, -pull, 0.07 / 0.230 * pull, 0.0];
    let joint = Joint::TABLE_I;
    let plan = to_rest(present, shortest_to_rest(present, 4, 27.0, |jet| joint.feed_forward(jet)), 4);
    move |t| {
        let [jet @ .., _] = plan(t);
        jet
    }
}

/// Input of a joint's drive.
pub type JointSample<T> = Sample<i32, Target<T, i32, 4>, 2>;

/// Runs a joint in closed loop on planned trajectory points. Only the controller computes in `T`; the rest is f64.
pub fn run_joint<T: Plain, const FAST: usize, const LATE: usize>(
    law: JointDrive<T, Position, FAST, LATE>,
    mut plant: Flexible,
    run: Run,
    plan: &dyn Fn(f64) -> [f64; 4],
    mut each: impl FnMut(u32, &mut JointSample<T>, &mut Running<JointDrive<T, Position, FAST, LATE>>),
) -> Trace {
    let (mut running, mut trace) = (Running::new(law), Trace::default());
    let mut queued = VecDeque::from(vec![0.0; run.delay as usize]);
    let unit = std::f64::consts::TAU / f64::from(1 << run.bits);
    for k in 0..run.ticks {
        let t = f64::from(k) * run.period_s;
        let [begin, end] =
            [0.0, 1.0].map(|more| target::<_, Position, _>(plan(t + (f64::from(run.delay) + more) * run.period_s)));
        let count = |angle: f64| ((angle / unit + 0.5).floor() as i64).rem_euclid(1 << run.bits) as i32;
        let counts = [plant.x[0], plant.x[2] / Flexible::K_1].map(|angle| Some(count(angle)));
        let mut sample = Sample { counts, begin, end };
        each(k, &mut sample, &mut running);
        let u = running.tick_at_once(&sample).u.to_f64();
        let jet = plan(t);
        trace.error.push(plant.x[0] - jet[0]);
        trace.speed_error.push(plant.x[1] - jet[1]);
        trace.u.push(u);
        queued.push_back(u);
        let held = queued.pop_front().unwrap_or(u);
        plant.advance(t, held, run.period_s);
    }
    trace
}

/// Returns the FNV-1a checksum that ends a drive's state snapshot.
pub fn checksum(words: &[u32]) -> u32 {
    words.iter().fold(0x811c_9dc5, |hash, word| {
        word.to_le_bytes().into_iter().fold(hash, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
    })
}

/// Rows of a matrix.
type Matrix = Vec<Vec<f64>>;

/// Linear map of a controller with one gain set near rest at 0, without encoder quantisation. Its inputs are the
/// present angles, the angles of the previous tick and the controller's state; its outputs are the next state and u.
pub struct LinearLaw<const E: usize> {
    rows: Matrix,
}

impl<const E: usize> LinearLaw<E> {
    /// Linearises a controller by finite differences. `unit_rad` is the encoder resolution in rad per count; the
    /// innovation gates and limits must be out of reach.
    ///
    /// # Panics
    /// If the state snapshot of a drive has another layout.
    pub fn of<M: ChainModel<f64, E, N>, const N: usize, const S: usize, const LATE: usize>(
        law: &EncoderForm<f64, M, Position, E, N, S, 0, LATE>,
        unit_rad: f64,
    ) -> Self
    where
        EncoderForm<f64, M, Position, E, N, S, 0, LATE>: Copy,
    {
        let at = Target { turn: 0, jet: [0.0; N] };
        let sample = |counts: [i32; E]| Sample { counts: counts.map(Some), begin: at, end: at };
        let mut still = Running::new(*law);
        still.tick_at_once(&sample([0; E]));
        let words: Vec<u32> = still.words().collect();
        // Layout: fingerprint, started, fresh; counts, counts relative to the base, revolution; numbers of two words
        // each.
        let (counts_at, numbers_at, end) = (3, 4 + 2 * E, words.len() - 1);
        let tick = |before: [i32; E], number: Option<usize>, counts: [i32; E]| {
            let mut words = words.clone();
            for (i, count) in before.into_iter().enumerate() {
                (words[counts_at + i], words[counts_at + E + i]) = (count as u32, count as u32);
            }
            if let Some(number) = number {
                let place = numbers_at + 2 * number;
                let old = f64::from_bits(u64::from(words[place]) | u64::from(words[place + 1]) << 32);
                let bits = (old + Self::STEP).to_bits();
                (words[place], words[place + 1]) = (bits as u32, (bits >> 32) as u32);
            }
            words[end] = checksum(&words[..end]);
            let mut running = Running::from_words(*law, words).expect("words of this design");
            let output = running.tick_at_once(&sample(counts));
            assert!(output.health.is_ok(), "{output:?}");
            let words: Vec<u32> = running.words().collect();
            let numbers = words[numbers_at..end].chunks(2);
            let numbers = numbers.map(|word| f64::from_bits(u64::from(word[0]) | u64::from(word[1]) << 32));
            numbers.chain([output.u]).collect::<Vec<f64>>()
        };
        let rest = tick([0; E], None, [0; E]);
        let moved = |i: usize| core::array::from_fn(|j| if j == i { Self::COUNTS } else { 0 });
        let by_count = f64::from(Self::COUNTS) * unit_rad;
        let columns = (0..E).map(|i| (tick([0; E], None, moved(i)), by_count));
        let columns = columns.chain((0..E).map(|i| (tick(moved(i), None, [0; E]), by_count)));
        let columns = columns.chain((0..rest.len() - 1).map(|number| (tick([0; E], Some(number), [0; E]), Self::STEP)));
        let columns: Matrix = columns
            .map(|(column, step)| column.iter().zip(&rest).map(|(moved, rest)| (moved - rest) / step).collect())
            .collect();
        let mut rows: Matrix = (0..rest.len()).map(|row| columns.iter().map(|column| column[row]).collect()).collect();
        // States that a tick leaves unchanged and never reads are not part of the loop. The power stage's limit and its
        // last report are not part of it either; both are large numbers ahead of the queued ones.
        let numbers = rest.len() - 1;
        let of_the_stage = numbers - LATE - 2..numbers - LATE;
        for number in 0..numbers {
            let column = 2 * E + number;
            let is_read = (0..rest.len()).any(|row| row != number && rows[row][column] != 0.0);
            if !is_read && (of_the_stage.contains(&number) || (rows[number][column] - 1.0).abs() < 1e-9) {
                rows[number][column] = 0.0;
            }
        }
        Self { rows }
    }

    const STEP: f64 = 1e-4;
    const COUNTS: i32 = 1000;

    /// Returns the spectral radius of the loop with a plant near 0. `advance` returns the plant state after one tick
    /// with u held; `angles` returns the measured angles.
    pub fn spectral_radius<const P: usize>(
        &self,
        delay: usize,
        advance: impl Fn([f64; P], f64) -> [f64; P],
        angles: impl Fn([f64; P]) -> [f64; E],
    ) -> f64 {
        const H: f64 = 1e-5;
        let rest = advance([0.0; P], 0.0);
        let slope = |to: [f64; P]| -> [f64; P] { core::array::from_fn(|i| (to[i] - rest[i]) / H) };
        let unit = |j: usize, h: f64| -> [f64; P] { core::array::from_fn(|i| if i == j { h } else { 0.0 }) };
        let own: [[f64; P]; P] = core::array::from_fn(|j| slope(advance(unit(j, H), 0.0)));
        let driven = slope(advance([0.0; P], H));
        let seen: [[f64; E]; P] = core::array::from_fn(|j| angles(unit(j, 1.0)));
        // State order: plant, previous angles, controller state, queued u.
        let remembered = self.rows.len() - 1;
        let size = P + E + remembered + delay;
        let step = |from: &[f64]| -> Vec<f64> {
            let theta: [f64; E] = core::array::from_fn(|i| (0..P).map(|j| seen[j][i] * from[j]).sum());
            let known = || theta.iter().chain(&from[P..P + E + remembered]);
            let law: Vec<f64> = self.rows.iter().map(|row| row.iter().zip(known()).map(|(a, b)| a * b).sum()).collect();
            let u = law[remembered];
            // Queue order: the oldest u leaves at the front, the newest enters at the end.
            let queued: Vec<f64> = from[size - delay..].iter().copied().chain([u]).collect();
            let held = queued[0];
            let plant = (0..P).map(|i| (0..P).map(|j| own[j][i] * from[j]).sum::<f64>() + driven[i] * held);
            let after = plant.chain(theta).chain(law[..remembered].iter().copied());
            after.chain(queued[1..].iter().copied()).collect()
        };
        // The matrix is transposed; its spectral radius is unchanged.
        spectral_radius(
            (0..size).map(|j| step(&(0..size).map(|i| f64::from(u8::from(i == j))).collect::<Vec<_>>())).collect(),
        )
    }
}

/// Returns the spectral radius of a square matrix: the 2^k-th root of the norm of its 2^k-th power, by repeated
/// squaring.
pub fn spectral_radius(mut m: Matrix) -> f64 {
    let (n, mut log, mut share) = (m.len(), 0.0, 1.0);
    for _ in 0..26 {
        let size = m.iter().map(|row| row.iter().map(|entry| entry.abs()).sum()).fold(0.0, f64::max);
        if size == 0.0 {
            return 0.0;
        }
        log += share * f64::ln(size);
        share /= 2.0;
        m.iter_mut().flatten().for_each(|entry| *entry /= size);
        let square = |row: &Vec<f64>| {
            let mut sum = vec![0.0; n];
            for (a, other) in row.iter().zip(&m) {
                sum.iter_mut().zip(other).for_each(|(sum, b)| *sum += a * b);
            }
            sum
        };
        m = m.iter().map(square).collect();
    }
    log.exp()
}
