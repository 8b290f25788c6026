//! Linear chains that are exact between ticks (matrix exponential), and a plain Runge-Kutta for other plants. Both are
//! independent of `loop-sim`.

/// dx/dt of a closed system: (t, x, dx).
pub type Rate<'a> = dyn FnMut(f64, &[f64], &mut [f64]) + 'a;

/// Integrates with classic Runge-Kutta from `from_s` to `to_s` in `steps` steps.
pub fn rk4(from_s: f64, to_s: f64, steps: usize, x: &mut [f64], rhs: &mut Rate<'_>) {
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
        // The end of a step belongs to the step: a disturbance that jumps there still has its old value.
        rhs((t + h).next_down(), &middle[..len], &mut k4[..len]);
        (0..len).for_each(|i| x[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
}

/// One term of a disturbance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Term {
    /// Constant value.
    Const(f64),
    /// Ramp: slope times t.
    Ramp(f64),
    /// Sinusoid: amplitude sin(omega t + phase).
    Sin(f64, f64, f64),
    /// Step: amplitude from t0 on.
    Step(f64, f64),
}

impl Term {
    /// Returns the value at time t.
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

/// Linear chain x_i' = x_{i+1} + d_i(t), x_n' = a.x + b u + d_n(t).
#[derive(Clone, Debug, PartialEq)]
pub struct LinearChain {
    /// Row a.
    pub a: Vec<f64>,
    /// Input gain b.
    pub b: f64,
    /// Disturbance terms d_i of each channel.
    pub d: Vec<Vec<Term>>,
}

impl LinearChain {
    /// Computes dx/dt.
    pub fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
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
    /// Computes the step of a chain over one period.
    pub fn new(chain: &LinearChain, period_s: f64) -> Self {
        let n = chain.a.len();
        let (u, one, ramp) = (n, n + 1, n + 2);
        // Each step disturbance is a constant in its own column; the caller's clock switches it on.
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
            // t0 is a tick instant, which k T only approximates.
            w[column] = if t > t0 - 0.5 * self.period_s { 1.0 } else { 0.0 };
        }
        for i in 0..self.n {
            x[i] = self.transition[i].iter().zip(&w).map(|(f, w)| f * w).sum();
        }
    }
}

/// Returns e^M by scaling, a Taylor sum of 24 terms, and squaring.
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
