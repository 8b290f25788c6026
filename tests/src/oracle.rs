//! Second transcription of the discrete controller, written for reading. The observer's Taylor state S is not folded,
//! sums are loops over channel numbers, every quantity is f64 and has its own name. It is slow on purpose.
//!
//! Symbols (i, j, q count from 1 in these formulas, from 0 in the arrays):
//!
//! * S_m = T^(m+1) d_hat^(m) / m! of each observed channel, m = 0..r-1
//! * t_j = T^j phi_j(-lambda T), phi_j(z) = sum_m z^m/(m+j)!
//! * w_i: weight of the present x_{i+1} in its mean over the past tick; theta_n for i = n-1, else 1/2
//!
//! The oracle uses other methods than the shipped design wherever one exists: discrete observer gains from the poles by
//! `exp_m1`, phi_j by sums of positive terms, the offset's decay by `exp_m1`.

/// Complex number, (re, im).
pub type Complex = (f64, f64);

/// Gains of one channel's observer.
#[derive(Clone, Debug, PartialEq)]
pub struct Gains {
    /// l_1 .. l_r.
    pub l: Vec<f64>,
    /// Roots of s^r + l_1 s^(r-1) + .. + l_r, rad/s.
    pub poles: Vec<Complex>,
}

impl Gains {
    /// Returns the gains that have these poles.
    pub fn from_poles(poles: &[Complex]) -> Self {
        Self { l: monic(poles), poles: poles.to_vec() }
    }

    /// Returns the gains with all poles at -omega.
    pub fn from_bandwidth(omega_rad_s: f64, order: usize) -> Self {
        Self::from_poles(&vec![(-omega_rad_s, 0.0); order])
    }

    /// Takes printed gains. The oracle itself needs poles, so it uses printed gains up to order 2 only.
    pub fn printed(l: &[f64]) -> Self {
        let poles = match *l {
            [l1] => vec![(-l1, 0.0)],
            [l1, l2] => {
                let discriminant = l1 * l1 - 4.0 * l2;
                let root = discriminant.abs().sqrt();
                if discriminant < 0.0 {
                    vec![(-l1 / 2.0, root / 2.0), (-l1 / 2.0, -root / 2.0)]
                } else {
                    // The slow pole comes from the product, which avoids cancellation.
                    let fast = -f64::midpoint(l1, root);
                    vec![(fast, 0.0), (l2 / fast, 0.0)]
                }
            }
            _ => Vec::new(),
        };
        Self { l: l.to_vec(), poles }
    }
}

/// Complete design: the numbers of `controller_core::Config` with lengths known only at run time.
#[derive(Clone, Debug, PartialEq)]
pub struct Spec {
    /// Control period T, s.
    pub period_s: f64,
    /// Surface coefficients c_1 .. c_n.
    pub c: Vec<f64>,
    /// Decay rate alpha of the offset W, 1/s.
    pub alpha: f64,
    /// Reaching gain k_l, 1/s.
    pub k_l: f64,
    /// Switching gain k_s.
    pub k_s: f64,
    /// Boundary layer eps.
    pub epsilon: f64,
    /// da/dx_1 .. da/dx_n in the design.
    pub gradient: Vec<f64>,
    /// Input gain b_0.
    pub input_gain: f64,
    /// Observer gains; one entry per channel.
    pub observers: Vec<Option<Gains>>,
    /// Limit of |u|.
    pub limit: f64,
}

impl Spec {
    /// Returns a chain of order 2 with an observer in the given channel (from 1) only, for tests of the observer. The
    /// control law is irrelevant there.
    pub fn observing(channel: usize, gains: Gains, period_s: f64) -> Self {
        let mut observers = vec![None, None];
        observers[channel - 1] = Some(gains);
        Self {
            period_s,
            c: vec![5.0, 1.0],
            alpha: 1.0,
            k_l: 10.0,
            k_s: 0.0,
            epsilon: 0.01,
            gradient: vec![0.0, 0.0],
            input_gain: 1.0,
            observers,
            limit: 1e12,
        }
    }

    /// Returns the order n.
    pub fn order(&self) -> usize {
        self.c.len()
    }

    /// Iterates over the observed channels, from 0, with their gains.
    pub fn observed(&self) -> impl Iterator<Item = (usize, &Gains)> {
        self.observers.iter().enumerate().filter_map(|(i, gains)| gains.as_ref().map(|gains| (i, gains)))
    }
}

/// Nominal a(x) and b(x) of the test plants: a linear row, a bend that the design's gradient omits, and a b(x) that
/// varies around b_0.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// da/dx of the linear part.
    pub row: Vec<f64>,
    /// Amplitude of the bend x_1/(1 + |x_1|) in a.
    pub bend: f64,
    /// b_0.
    pub input_gain: f64,
    /// b(x) = b_0 (1 + swing x_1/(1 + |x_1|)); 0: constant.
    pub swing: f64,
}

impl Model {
    /// Returns a linear a(x) with constant b.
    pub fn linear(row: &[f64], input_gain: f64) -> Self {
        Self { row: row.to_vec(), bend: 0.0, input_gain, swing: 0.0 }
    }

    /// Returns a(x).
    pub fn a(&self, x: &[f64]) -> f64 {
        self.row.iter().zip(x).map(|(k, x)| k * x).sum::<f64>() + self.bend * x[0] / (1.0 + x[0].abs())
    }

    /// Returns b(x).
    pub fn b(&self, x: &[f64]) -> f64 {
        self.input_gain * (1.0 + self.swing * x[0] / (1.0 + x[0].abs()))
    }
}

/// Output of one tick of the oracle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleTick {
    /// Control u.
    pub u: f64,
    /// sigma, Eq. (44).
    pub sigma: f64,
    /// sigma*, Eq. (17).
    pub sigma_star: f64,
}

/// One observed channel.
struct Channel {
    i: usize,
    /// L_1 .. L_3, zero beyond the order.
    gain: [f64; 3],
    theta: f64,
    mu2: f64,
    /// Rows of the control law and of sigma on S.
    k_z: [f64; 3],
    g: [f64; 3],
    s: [f64; 3],
}

/// Design and state of the plain transcription.
pub struct Oracle {
    spec: Spec,
    model: Model,
    theta_n: f64,
    /// w_i, i < n.
    w: Vec<f64>,
    channels: Vec<Channel>,
    k_v: f64,
    k_x: Vec<f64>,
    // State variables.
    offset: f64,
    x_prev: Vec<f64>,
    a_prev: f64,
    b_prev: f64,
    /// Control u that was applied since the last tick.
    pub applied: f64,
    first: bool,
    /// True if there is no previous sample to compare with; the estimates then stay unchanged.
    resuming: bool,
}

impl Oracle {
    /// Designs the controller.
    pub fn new(spec: &Spec, model: &Model) -> Self {
        let (n, period) = (spec.order(), spec.period_s);
        let last = n - 1;
        let lambda = -spec.gradient[last];
        let t = |j: usize| power(period, j) * phi(j, -lambda * period);
        let taylor = |j: usize| power(period, j) / factorial(j);

        let theta_n = t(2) / (period * t(1));
        let mu2_n = 2.0 * t(3) / (period * period * t(1));
        let mut w = vec![0.5; last];
        w[last - 1] = theta_n;

        let k_v: f64 = (0..n).map(|i| spec.c[i] * t(n - i)).sum();
        let mut k_x = vec![0.0; n];
        for j in 1..n {
            k_x[j] = (0..j).map(|i| spec.c[i] * taylor(j - i)).sum::<f64>() / k_v;
            k_x[j] += theta_n * period * spec.gradient[j - 1];
        }

        let mut channels = Vec::new();
        for (q, gains) in spec.observed() {
            let (theta, mu2) = if q == last { (theta_n, mu2_n) } else { (0.5, 1.0 / 3.0) };
            let mut k_z = [0.0; 3];
            let mut g = [0.0; 3];
            for m in 0..gains.l.len() {
                let unit = factorial(m) / power(period, m + 1);
                let moved: f64 = if q == last {
                    (0..n).map(|i| spec.c[i] * t(n - i + m)).sum()
                } else {
                    (0..=q).map(|i| spec.c[i] * taylor(q - i + 1 + m)).sum()
                };
                k_z[m] = moved / k_v * unit;
                if q < last && q + m + 1 < n {
                    g[m] = spec.c[q + m + 1] * unit;
                }
            }
            if q < last {
                k_z[0] += theta_n * spec.gradient[q];
            }
            let gain = taylor_gains(&gammas(&gains.poles, period), theta, mu2);
            channels.push(Channel { i: q, gain, theta, mu2, k_z, g, s: [0.0; 3] });
        }
        Self {
            spec: spec.clone(),
            model: model.clone(),
            theta_n,
            w,
            channels,
            k_v,
            k_x,
            offset: 0.0,
            x_prev: vec![0.0; n],
            a_prev: 0.0,
            b_prev: 0.0,
            applied: 0.0,
            first: true,
            resuming: true,
        }
    }

    /// Sets a guess of the disturbances before the first tick.
    pub fn guess(&mut self, d_hat: &[f64]) {
        for channel in &mut self.channels {
            channel.s[0] = self.spec.period_s * d_hat[channel.i];
        }
    }

    /// Runs a tick without a sample. The offset advances and the estimates wait. The next sample has no predecessor, so
    /// the estimates advance without a correction.
    pub fn lost(&mut self) {
        self.offset += (-self.spec.alpha * self.spec.period_s).exp_m1() * self.offset;
        self.resuming = true;
    }

    /// Runs one tick.
    pub fn tick(&mut self, x: &[f64]) -> OracleTick {
        let (n, period) = (self.spec.order(), self.spec.period_s);
        let (a, b) = (self.model.a(x), self.model.b(x));
        let decay = -(-self.spec.alpha * period).exp_m1();

        if !self.resuming {
            for channel in &mut self.channels {
                let i = channel.i;
                let moved = x[i] - self.x_prev[i];
                let by_model = if i < n - 1 {
                    period * ((1.0 - self.w[i]) * self.x_prev[i + 1] + self.w[i] * x[i + 1])
                } else {
                    period * self.theta_n * (a + b * self.applied)
                        + period * (1.0 - self.theta_n) * (self.a_prev + self.b_prev * self.applied)
                };
                let [s0, s1, s2] = channel.s;
                let foretold = s0 + channel.theta * s1 + channel.mu2 * s2;
                let e = moved - by_model - foretold;
                channel.s[0] = s0 + s1 + s2 + channel.gain[0] * e;
                channel.s[1] = s1 + 2.0 * s2 + channel.gain[1] * e;
                channel.s[2] = s2 + channel.gain[2] * e;
            }
        }
        if self.resuming && !self.first {
            for channel in &mut self.channels {
                let [s0, s1, s2] = channel.s;
                channel.s = [s0 + s1 + s2, s1 + 2.0 * s2, s2];
            }
        }
        if !self.first {
            self.offset -= decay * self.offset;
        }

        let on_s = |row: fn(&Channel) -> &[f64; 3]| -> f64 {
            self.channels.iter().map(|channel| (0..3).map(|m| row(channel)[m] * channel.s[m]).sum::<f64>()).sum()
        };
        let sigma = (0..n).map(|i| self.spec.c[i] * x[i]).sum::<f64>() + on_s(|channel| &channel.g);
        if self.first {
            self.offset = sigma;
        }
        let sigma_star = sigma - self.offset;

        let reach = (self.spec.k_l * period).min(1.0);
        let switching = if self.spec.k_s > 0.0 {
            let slope = (1.0 - reach) / (self.spec.epsilon + self.spec.k_s * period);
            self.spec.k_s * period / self.k_v * (slope * sigma_star).clamp(-1.0, 1.0)
        } else {
            0.0
        };
        let on_x: f64 = (0..n).map(|j| self.k_x[j] * x[j]).sum();
        let f = on_x
            + on_s(|channel| &channel.k_z)
            + reach / self.k_v * sigma_star
            + decay / self.k_v * self.offset
            + switching;
        let u = (-(a + f) / b).clamp(-self.spec.limit, self.spec.limit);

        self.x_prev.copy_from_slice(x);
        (self.a_prev, self.b_prev) = (a, b);
        self.applied = u;
        self.first = false;
        self.resuming = false;
        OracleTick { u, sigma, sigma_star }
    }

    /// Returns d_hat^(m) = m! S_m / T^(m+1) of channel i (from 0); zeros without an observer.
    pub fn estimate(&self, i: usize) -> [f64; 3] {
        let unit = |m: usize| factorial(m) / power(self.spec.period_s, m + 1);
        let channel = self.channels.iter().find(|channel| channel.i == i);
        channel.map_or([0.0; 3], |channel| std::array::from_fn(|m| channel.s[m] * unit(m)))
    }
}

/// Returns gamma_1..gamma_r, the coefficients of the monic polynomial with roots e^(pole T) - 1, accurate to the last
/// digits.
pub fn gammas(poles: &[Complex], period_s: f64) -> Vec<f64> {
    let roots: Vec<Complex> = poles
        .iter()
        .map(|&(re, im)| {
            let (a, b) = (re * period_s, im * period_s);
            // e^(a + ib) - 1 without cancellation for small a, b.
            (a.exp_m1() * b.cos() - 2.0 * (b / 2.0).sin().powi(2), a.exp() * b.sin())
        })
        .collect();
    monic(&roots)
}

/// Returns the coefficients a_1.. of the monic polynomial with these roots.
pub fn monic(roots: &[Complex]) -> Vec<f64> {
    let mut a: Vec<Complex> = vec![(1.0, 0.0)];
    for &(re, im) in roots {
        a.push((0.0, 0.0));
        for k in (1..a.len()).rev() {
            let (r, i) = a[k - 1];
            a[k].0 -= re * r - im * i;
            a[k].1 -= re * i + im * r;
        }
    }
    a[1..].iter().map(|coefficient| coefficient.0).collect()
}

/// Returns L_1..L_3 on the Taylor state from gamma.
fn taylor_gains(gamma: &[f64], theta: f64, mu2: f64) -> [f64; 3] {
    match *gamma {
        [g1] => [g1, 0.0, 0.0],
        [g1, g2] => [g1 - theta * g2, g2, 0.0],
        [g1, g2, g3] => {
            let l3 = g3 / 2.0;
            let l2 = g2 - (1.0 + 2.0 * theta) * l3;
            [g1 - theta * l2 - mu2 * l3, l2, l3]
        }
        _ => panic!("the oracle's observers have order 1, 2 or 3 and known poles"),
    }
}

/// Returns phi_j(z) = sum_m z^m/(m+j)!. For z < 0 it uses Kummer's transformation e^z/(j-1)! sum_m (-z)^m/(m! (j+m)).
/// All terms of both sums are positive, so there is no cancellation.
pub fn phi(j: usize, z: f64) -> f64 {
    if j == 0 {
        return z.exp();
    }
    let (y, mut power, mut sum) = (z.abs(), 1.0, 0.0);
    for m in 0..(60 + 4 * y as usize) {
        if z >= 0.0 {
            // power = z^m j!/(m+j)!
            sum += power;
            power *= y / (m + j + 1) as f64;
        } else {
            // power = y^m/m!
            sum += power / (j + m) as f64;
            power *= y / (m + 1) as f64;
        }
    }
    if z >= 0.0 { sum / factorial(j) } else { z.exp() * sum / factorial(j - 1) }
}

/// Returns base^exponent.
pub fn power(base: f64, exponent: usize) -> f64 {
    (0..exponent).map(|_| base).product()
}

/// Returns k!.
pub fn factorial(k: usize) -> f64 {
    (1..=k).map(|factor| factor as f64).product()
}
