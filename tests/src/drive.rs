//! Drives for the suite: recorded counts fed to a law, tick by tick.

use controller_core::drive::{Aim, ChainModel, EncoderForm, JointDrive, MotorDrive, Position, Sample, Speed, Target};
use controller_core::{Output, Real, Running, Sealed};

/// A scalar whose counts are plain numbers: `f32` and `f64`.
pub trait Plain: Real + Sealed<Count = i32> {}
impl<T: Real + Sealed<Count = i32>> Plain for T {}

/// What is told of a jet (r, r', ..) for an instant.
pub trait Told<T: Plain, const N: usize>: Aim<T, N> {
    /// The target at this jet.
    fn target(jet: [f64; N]) -> Self::Target;
}

impl<T: Plain, const N: usize> Told<T, N> for Position {
    /// The angle within a turn of 0, as whoever plans in f64 splits it.
    fn target(jet: [f64; N]) -> Target<T, i32, N> {
        let turn = (jet[0] / std::f64::consts::TAU).round();
        let mut jet = jet;
        jet[0] -= turn * std::f64::consts::TAU;
        Target { turn: turn as i32, jet: jet.map(T::from_f64) }
    }
}

impl<T: Plain> Told<T, 2> for Speed {
    fn target(jet: [f64; 2]) -> T {
        T::from_f64(jet[1])
    }
}

/// One row of a record.
#[derive(Clone, Copy, Debug)]
pub struct Row<const E: usize, const N: usize> {
    /// Counts, where they were there.
    pub counts: [Option<i32>; E],
    /// What the oracle asked for.
    pub u_demand: f64,
    /// What was held.
    pub u_applied: f64,
    /// The oracle's σ*.
    pub sigma_star: f64,
    /// r, r', .. at the beginning of the tick in which u is held.
    pub jet: [f64; N],
}

/// Feeds a record to a law without limits; the largest differences of u and σ* from it.
pub fn replay<T, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>(
    law: &EncoderForm<T, M, A, E, N, S, FAST, LATE>,
    rows: &[Row<E, N>],
    mut before: impl FnMut(usize, &mut Running<EncoderForm<T, M, A, E, N, S, FAST, LATE>>, &Sample<i32, A::Target, E>),
) -> [f64; 2]
where
    T: Plain,
    M: ChainModel<T, E, N>,
    A: Told<T, N>,
    EncoderForm<T, M, A, E, N, S, FAST, LATE>: Copy,
{
    let mut running = Running::new(*law);
    let mut worst = [0.0_f64; 2];
    for (k, pair) in rows.windows(2).enumerate() {
        let sample = Sample { counts: pair[0].counts, begin: A::target(pair[0].jet), end: A::target(pair[1].jet) };
        before(k, &mut running, &sample);
        let Output { u, sigma_star, .. } = running.tick(&sample);
        running.report_applied(T::from_f64(pair[0].u_applied));
        let off = [u.to_f64() - pair[0].u_demand, sigma_star.to_f64() - pair[0].sigma_star];
        for (worst, off) in worst.iter_mut().zip(off) {
            *worst = worst.max(off.abs());
        }
    }
    worst
}

/// A motor that is not the nominal one: friction after Coulomb and Stribeck, cogging, a current loop with lag, load.
/// J w' = K_t i - B w - friction + cogging - load, i' = (u - i)/lag; Runge-Kutta of fourth order.
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
    /// Amplitude N m, periods per turn.
    pub cogging: [f64; 2],
    /// Lag of the current loop, s; 0 for none.
    pub lag_s: f64,
    /// From this time on this torque, s and N m.
    pub load: [f64; 2],
}

impl Shaft {
    /// The one of the acceptance figures: 2e-4 kg m², 0.05 N m/A, all disturbances but the load.
    pub const ROUGH: Self = Self {
        x: [0.0; 3],
        inertia: 2e-4,
        torque: 0.05,
        damping: 1e-5,
        friction: [0.008, 0.005],
        cogging: [0.003, 7.0],
        lag_s: 2e-4,
        load: [f64::INFINITY, 0.0],
    };

    /// The same without friction, cogging and lag.
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

    /// Holds u from t on for one period.
    pub fn advance(&mut self, t: f64, u: f64, period_s: f64) {
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

/// What one run of a loop shows, tick by tick.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// True angle less the reference, rad.
    pub error: Vec<f64>,
    /// True speed less the reference, rad/s.
    pub speed_error: Vec<f64>,
    /// u that was asked for within the limits, A.
    pub u: Vec<f64>,
    /// Estimate of the load, N m.
    pub load: Vec<f64>,
}

/// Largest of the absolute values.
pub fn peak(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |peak, value| peak.max(value.abs()))
}

/// Root of the mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// How the loop is run.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Period, s.
    pub period_s: f64,
    /// Bits of the encoder.
    pub bits: u32,
    /// Ticks.
    pub ticks: u32,
    /// Ticks that u takes to the actuator.
    pub delay: u32,
}

/// A motor under its law, on jets of a plan, in f64 apart from the law.
pub fn run_motor<T, A, const S: usize, const FAST: usize, const LATE: usize>(
    law: MotorDrive<T, A, FAST, LATE, S>,
    mut shaft: Shaft,
    run: Run,
    plan: &dyn Fn(f64) -> [f64; 2],
    mut each: impl FnMut(u32, &mut Sample<i32, A::Target, 1>, &mut Running<MotorDrive<T, A, FAST, LATE, S>>),
) -> Trace
where
    T: Plain,
    A: Told<T, 2>,
{
    let (mut running, mut trace, mut queued) = (Running::new(law), Trace::default(), 0.0);
    let unit = std::f64::consts::TAU / f64::from(1 << run.bits);
    let ahead = f64::from(run.delay);
    for k in 0..run.ticks {
        let t = f64::from(k) * run.period_s;
        let count = (shaft.x[0] / unit + 0.5).floor() as i64;
        let [begin, end] = [ahead, ahead + 1.0].map(|more| plan(t + more * run.period_s));
        // The counter wraps.
        let raw = count.rem_euclid(1 << run.bits) as i32;
        let mut sample = Sample { counts: [Some(raw)], begin: A::target(begin), end: A::target(end) };
        each(k, &mut sample, &mut running);
        let u = running.tick(&sample).u.to_f64();
        let [r, v] = plan(t);
        trace.error.push(shaft.x[0] - r);
        trace.speed_error.push(shaft.x[1] - v);
        trace.u.push(u);
        trace.load.push(running.estimates().map_or(0.0, |known| known.load[0].to_f64()));
        let held = if run.delay == 1 { std::mem::replace(&mut queued, u) } else { u };
        shaft.advance(t, held, run.period_s);
    }
    trace
}

/// r, r', r'', .. of a step from 0 to 1 over [0, 1] that is smooth to degree 9, as derivatives by its argument.
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
    let mut jet = [0.0; 5];
    if s > 0.0 {
        for (i, power) in powers.iter().enumerate() {
            let mut factor = *power;
            for (j, entry) in jet.iter_mut().enumerate().take(i + 1) {
                *entry += factor * s.powi((i - j) as i32);
                factor *= (i - j) as f64;
            }
        }
    }
    jet
}

/// A move of `distance` from rest to rest between `start` and `start + tau`.
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

/// A sin ωt, times a step of degree 9 over the first `blend` seconds.
pub fn blended_sine<const J: usize>(amplitude: f64, omega: f64, blend: f64) -> impl Fn(f64) -> [f64; J] {
    move |t| {
        let (s, c) = (omega * t).sin_cos();
        let sine: [f64; 5] = core::array::from_fn(|j| amplitude * omega.powi(j as i32) * [s, c, -s, -c][j % 4]);
        let jet = smooth_step(t / blend, 9);
        let step: [f64; 5] = core::array::from_fn(|j| jet[j] / blend.powi(j as i32));
        core::array::from_fn(|n| (0..=n).map(|m| BINOMIAL[n][m] * sine[m] * step[n - m]).sum())
    }
}

/// The paper's joint as it truly is: link angle and speed, motor angle times the nominal k_1 and its speed. Errors are
/// relative, of K_s/J_l, link damping, K_s/J_m, motor damping, K_t/J_m; an unknown v = 1 + sin 2t A works beside u.
#[derive(Clone, Copy, Debug)]
pub struct Flexible {
    /// x_1 .. x_4.
    pub x: [f64; 4],
    /// Errors of the parameters.
    pub errors: [f64; 5],
    /// From this time on this acceleration of the link, s and rad/s².
    pub load: [f64; 2],
    /// Friction 1.5 A static, 1 A Coulomb, cogging 0.3 A, ripple 2 %?
    pub rough: bool,
}

impl Flexible {
    /// At rest at 0, as the model has it.
    pub const NOMINAL: Self = Self { x: [0.0; 4], errors: [0.0; 5], load: [f64::INFINITY, 0.0], rough: false };
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

    /// Holds u from t on for one period.
    pub fn advance(&mut self, t: f64, u: f64, period_s: f64) {
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

/// What the drive of a joint is given.
pub type JointSample<T> = Sample<i32, Target<T, i32, 4>, 2>;

/// A joint under its law, on jets of a plan, in f64 apart from the law.
pub fn run_joint<T: Plain, const FAST: usize, const LATE: usize>(
    law: JointDrive<T, Position, FAST, LATE>,
    mut plant: Flexible,
    run: Run,
    plan: &dyn Fn(f64) -> [f64; 4],
    mut each: impl FnMut(u32, &mut JointSample<T>, &mut Running<JointDrive<T, Position, FAST, LATE>>),
) -> Trace {
    let (mut running, mut trace, mut queued) = (Running::new(law), Trace::default(), 0.0);
    let unit = std::f64::consts::TAU / f64::from(1 << run.bits);
    for k in 0..run.ticks {
        let t = f64::from(k) * run.period_s;
        let [begin, end] =
            [0.0, 1.0].map(|more| Position::target(plan(t + (f64::from(run.delay) + more) * run.period_s)));
        let count = |angle: f64| ((angle / unit + 0.5).floor() as i64).rem_euclid(1 << run.bits) as i32;
        let counts = [plant.x[0], plant.x[2] / Flexible::K_1].map(|angle| Some(count(angle)));
        let mut sample = Sample { counts, begin, end };
        each(k, &mut sample, &mut running);
        let u = running.tick(&sample).u.to_f64();
        let jet = plan(t);
        trace.error.push(plant.x[0] - jet[0]);
        trace.speed_error.push(plant.x[1] - jet[1]);
        trace.u.push(u);
        let held = if run.delay == 1 { std::mem::replace(&mut queued, u) } else { u };
        plant.advance(t, held, run.period_s);
    }
    trace
}
