//! True plants, written apart from those of `host-sim`: a linear chain that is exact between ticks (matrix exponential),
//! the joint and the benchmark of the paper by Runge-Kutta.

use controller_core::{JointChain, JointParameters, Reading};

/// A true plant.
pub trait Plant {
    /// dx/dt.
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]);
}

impl<F: Fn(f64, &[f64], f64, &mut [f64])> Plant for F {
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        self(t_s, x, u, dx);
    }
}

/// Classic Runge-Kutta from `from_s` to `to_s` in `steps` steps.
pub fn rk4(from_s: f64, to_s: f64, steps: usize, x: &mut [f64], rhs: &mut dyn FnMut(f64, &[f64], &mut [f64])) {
    let len = x.len();
    let (mut k1, mut k2, mut k3, mut k4) = ([0.0; 32], [0.0; 32], [0.0; 32], [0.0; 32]);
    let mut middle = [0.0; 32];
    let h = (to_s - from_s) / steps as f64;
    for step in 0..steps {
        let t = from_s + step as f64 * h;
        rhs(t, x, &mut k1[..len]);
        (0..len).for_each(|i| middle[i] = x[i] + h / 2.0 * k1[i]);
        rhs(t + h / 2.0, &middle[..len], &mut k2[..len]);
        (0..len).for_each(|i| middle[i] = x[i] + h / 2.0 * k2[i]);
        rhs(t + h / 2.0, &middle[..len], &mut k3[..len]);
        (0..len).for_each(|i| middle[i] = x[i] + h * k3[i]);
        // The end of a step belongs to it: a disturbance that jumps there has not jumped yet.
        rhs((t + h).next_down(), &middle[..len], &mut k4[..len]);
        (0..len).for_each(|i| x[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
}

/// One term of a disturbance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Term {
    /// value
    Const(f64),
    /// slope t
    Ramp(f64),
    /// amplitude sin(omega t + phase)
    Sin(f64, f64, f64),
    /// amplitude from t0 on
    Step(f64, f64),
}

impl Term {
    /// The value at t.
    pub fn at(&self, t_s: f64) -> f64 {
        match *self {
            Self::Const(value) => value,
            Self::Ramp(slope) => slope * t_s,
            Self::Sin(amplitude, omega, phase) => amplitude * (omega * t_s + phase).sin(),
            Self::Step(amplitude, t0) => {
                if t_s >= t0 {
                    amplitude
                } else {
                    0.0
                }
            }
        }
    }
}

/// x_i' = x_{i+1} + d_i(t), x_n' = a.x + b u + d_n(t).
#[derive(Clone, Debug, PartialEq)]
pub struct LinearChain {
    /// a.
    pub a: Vec<f64>,
    /// b.
    pub b: f64,
    /// d_i.
    pub d: Vec<Vec<Term>>,
}

impl Plant for LinearChain {
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        let n = self.a.len();
        for i in 0..n {
            let driven =
                if i + 1 < n { x[i + 1] } else { self.a.iter().zip(x).map(|(a, x)| a * x).sum::<f64>() + self.b * u };
            dx[i] = driven + self.d[i].iter().map(|term| term.at(t_s)).sum::<f64>();
        }
    }
}

/// Exact step of a [`LinearChain`] over one period: x+ = F x + G w with w = [u, 1, t, sin_k, cos_k ..] at the period's
/// beginning. Steps must fall on ticks.
pub struct ExactStep {
    n: usize,
    /// Columns of x, then u, 1, t, then sin and cos of each sinusoid.
    transition: Vec<Vec<f64>>,
    sinusoids: Vec<(f64, f64)>,
    /// Column and instant of each step.
    steps: Vec<(usize, f64)>,
    period_s: f64,
}

impl ExactStep {
    /// Of this chain over this period.
    pub fn new(chain: &LinearChain, period_s: f64) -> Self {
        let n = chain.a.len();
        let (u, one, ramp) = (n, n + 1, n + 2);
        // Steps enter as `one`, switched on by the caller's clock: one more column per step.
        let mut sinusoids = Vec::new();
        let mut steps = Vec::new();
        let count = chain.d.iter().flatten().count();
        let size = n + 3 + 2 * count;
        let mut m = vec![vec![0.0; size]; size];
        for i in 0..n - 1 {
            m[i][i + 1] = 1.0;
        }
        m[n - 1][..n].copy_from_slice(&chain.a);
        m[n - 1][u] = chain.b;
        m[ramp][one] = 1.0;
        let mut at = n + 3;
        for (i, terms) in chain.d.iter().enumerate() {
            for term in terms {
                match *term {
                    Term::Const(value) => m[i][one] += value,
                    Term::Ramp(slope) => m[i][ramp] += slope,
                    Term::Sin(amplitude, omega, phase) => {
                        m[i][at] = amplitude;
                        m[at][at + 1] = omega;
                        m[at + 1][at] = -omega;
                        sinusoids.push((omega, phase));
                        at += 2;
                    }
                    Term::Step(..) => {}
                }
            }
        }
        for (i, terms) in chain.d.iter().enumerate() {
            for term in terms {
                if let Term::Step(amplitude, t0) = *term {
                    m[i][at] = amplitude;
                    steps.push((at, t0));
                    at += 1;
                }
            }
        }
        m.iter_mut().flatten().for_each(|entry| *entry *= period_s);
        Self { n, transition: exponential(&m), sinusoids, steps, period_s }
    }

    /// Moves x from tick k to tick k + 1 under u.
    pub fn advance(&self, k: usize, u: f64, x: &mut [f64]) {
        let t = k as f64 * self.period_s;
        let mut w = vec![0.0; self.transition.len()];
        w[..self.n].copy_from_slice(x);
        w[self.n] = u;
        w[self.n + 1] = 1.0;
        w[self.n + 2] = t;
        for (s, (omega, phase)) in self.sinusoids.iter().enumerate() {
            (w[self.n + 3 + 2 * s], w[self.n + 4 + 2 * s]) = (omega * t + phase).sin_cos();
        }
        for &(column, t0) in &self.steps {
            // t0 is a tick instant, k T only nearly so.
            w[column] = if t > t0 - 0.5 * self.period_s { 1.0 } else { 0.0 };
        }
        for i in 0..self.n {
            x[i] = self.transition[i].iter().zip(&w).map(|(f, w)| f * w).sum();
        }
    }
}

/// e^M by halving, a Taylor sum of 24 terms, and squaring.
pub fn exponential(m: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let size = m.len();
    let norm = m.iter().map(|row| row.iter().map(|entry| entry.abs()).sum::<f64>()).fold(0.0, f64::max);
    let halvings = if norm > 0.5 { (norm / 0.5).log2().ceil() as i32 } else { 0 };
    let scale = 0.5_f64.powi(halvings);
    let small: Vec<Vec<f64>> = m.iter().map(|row| row.iter().map(|entry| entry * scale).collect()).collect();
    let identity = |i: usize, j: usize| f64::from(u8::from(i == j));
    let mut e: Vec<Vec<f64>> = (0..size).map(|i| (0..size).map(|j| identity(i, j)).collect()).collect();
    for k in (1..=24).rev() {
        // Horner: e <- 1 + (small e)/k
        e = product(&small, &e);
        for (i, row) in e.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = *entry / f64::from(k) + identity(i, j);
            }
        }
    }
    for _ in 0..halvings {
        e = product(&e, &e);
    }
    e
}

fn product(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let size = a.len();
    let mut out = vec![vec![0.0; size]; size];
    for i in 0..size {
        for k in 0..size {
            if a[i][k] != 0.0 {
                for j in 0..size {
                    out[i][j] += a[i][k] * b[k][j];
                }
            }
        }
    }
    out
}

/// The joint of Example 2 with every parameter of the motor and the link off by the relative error `off`.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// Nominal coefficients.
    pub nominal: JointChain,
    /// Relative error of all parameters alike.
    pub off: f64,
}

impl Joint {
    /// Table I in this reading, no error.
    pub fn new(reading: Reading) -> Self {
        Self { nominal: JointParameters::TABLE_I.chain(reading), off: 0.0 }
    }

    /// Nominal a(x) and b.
    pub fn nominal(&self) -> impl Fn(&[f64]) -> (f64, f64) + use<> {
        let JointChain { k2, b2, b, a1, .. } = self.nominal;
        move |x| (a1 * x[0] - k2 * x[2] - b2 * x[3], b)
    }

    /// d_1..d_4 of Eq. (39): k_1 x_1 + b_1 x_2 + sin x_1 and the input's disturbance v = 1 + sin 2t count as disturbance.
    pub fn lumped(&self, t_s: f64, x: &[f64], u: f64) -> [f64; 4] {
        let JointChain { k1, b1, k2, b2, b, .. } = self.nominal;
        let off = self.off;
        let v = 1.0 + (2.0 * t_s).sin();
        let d2 = -k1 * x[0] - b1 * x[1] - x[0].sin() + off * (x[2] - k1 * x[0]) - off * b1 * x[1];
        let d4 = off * (k2 * x[0] - k2 * x[2]) - off * b2 * x[3] + off * b * u + (1.0 + off) * b * v;
        [0.0, d2, 0.0, d4]
    }
}

impl Plant for Joint {
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        let (a, b) = self.nominal()(x);
        let d = self.lumped(t_s, x, u);
        dx.copy_from_slice(&[x[1] + d[0], x[2] + d[1], x[3] + d[2], a + b * u + d[3]]);
    }
}

/// d_1 of Example 1 part 2, Eq. (60)-(61): a step of 1 at t = 2 s.
pub fn complex_disturbance(t_s: f64, x: &[f64]) -> f64 {
    let (s, c) = (2.0 * t_s).sin_cos();
    let step = if t_s >= 2.0 { 1.0 } else { 0.0 };
    0.5 * x[0] * x[0] + x[0] * s + 0.2 * x[1] + t_s / 6.0 + s * s - c + step
}

/// Example 1, Eq. (59), with this d_1.
pub fn benchmark(d1: fn(f64, &[f64]) -> f64) -> impl Plant {
    move |t_s: f64, x: &[f64], u: f64, dx: &mut [f64]| {
        dx[0] = x[1] + d1(t_s, x);
        dx[1] = -2.0 * x[0] - x[1] + x[0].exp() + u;
    }
}
