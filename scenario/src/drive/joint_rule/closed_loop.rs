//! Exact closed loop of a true joint and a controller by the data sheet.
//!
//! The loop is linearised about rest at an angle θ and exact at the ticks. Units: radians behind the gear, ticks, and u
//! as the acceleration of both shafts together in a tick. Gravity is a spring -(weight/J_l) cos θ. The controller
//! models it as a torque at the counts, the mean of both ends of a tick. The current loop of the plant is a separate
//! state, apart from the controller's model of it.
//!
//! # Sensitivity
//! With the loop broken at the plant input, $S = 1/(1 + L)$ is a ratio of characteristic polynomials:
//!
//! $$ |S(z)| = \frac{\prod |z - p_{plant}| \prod |z - p_{controller}|}{\prod |z - p_{closed}|} $$
//!
//! So eigenvalues give stability and every |S|. A narrow peak lies at the angle of a closed-loop pole, and the tried
//! frequencies include these angles.

use std::f64::consts::PI;

use controller_core::drive::{JointRatios, JointTick, Regulator};

use super::eigenvalues::{Complex, MOST, Square, eigenvalues};

/// States of a plant: q_l, v_l, q_m, v_m, i.
const PLANT: usize = 5;

/// States of a controller without its queue: i, and (q, v, d) of link and motor.
const OWN: usize = 7;

/// Largest number of queued inputs.
const QUEUE: usize = 3;

/// One tick of a true joint, in the units of the module documentation.
pub(super) struct Plant {
    phi: [[f64; PLANT]; PLANT],
    gamma: [f64; PLANT],
    /// Effect of a torque of 1 N m on the link.
    load: [f64; PLANT],
    poles: Vec<Complex>,
}

impl Plant {
    /// Returns the plant. `unit`: radians per tick² per u; `spring`: (weight/J_l) cos θ, 1/s²; `per_torque`: 1/J_l.
    pub(super) fn of(r: &JointRatios, [spring, per_torque]: [f64; 2], period_s: f64, unit: f64) -> Option<Self> {
        const ALL: usize = PLANT + 2;
        let (t, t2) = (period_s, period_s * period_s);
        let mut a = [[0.0; ALL]; ALL];
        (a[0][1], a[2][3]) = (1.0, 1.0);
        a[1] = [-(r.k1 + spring) * t2, -r.b1 * t, r.k1 * t2, 0.0, 0.0, 0.0, per_torque * t2];
        a[3] = [r.k2 * t2, 0.0, -r.k2 * t2, -r.b2 * t, 0.0, 0.0, 0.0];
        if r.lag_s > 0.0 {
            a[3][4] = r.b * t2 / unit;
            (a[4][4], a[4][5]) = (-t / r.lag_s, t / r.lag_s);
        } else {
            a[3][5] = r.b * t2 / unit;
        }
        let e = exponential(a);
        let (mut phi, mut gamma, mut load) = ([[0.0; PLANT]; PLANT], [0.0; PLANT], [0.0; PLANT]);
        for i in 0..PLANT {
            phi[i].copy_from_slice(&e[i][..PLANT]);
            (gamma[i], load[i]) = (e[i][PLANT], e[i][PLANT + 1]);
        }
        if r.lag_s == 0.0 {
            (phi[4], gamma[4]) = ([0.0; PLANT], 1.0);
        }
        let mut square = [[0.0; MOST]; MOST];
        phi.iter().zip(&mut square).for_each(|(from, to)| to[..PLANT].copy_from_slice(from));
        Some(Self { phi, gamma, load, poles: eigenvalues(square, PLANT)? })
    }
}

/// Returns e^A, by scaling and squaring of its series.
fn exponential<const S: usize>(mut a: [[f64; S]; S]) -> [[f64; S]; S] {
    let product = |a: &[[f64; S]; S], b: &[[f64; S]; S]| {
        let mut out = [[0.0; S]; S];
        for (row, to) in a.iter().zip(&mut out) {
            for (factor, from) in row.iter().zip(b) {
                from.iter().zip(to.iter_mut()).for_each(|(from, to)| *to += factor * from);
            }
        }
        out
    };
    let norm = a.iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max);
    let halvings = if norm > 0.25 { libm::log2(4.0 * norm).ceil() } else { 0.0 };
    a.as_flattened_mut().iter_mut().for_each(|x| *x *= libm::exp2(-halvings));
    let mut e = [[0.0; S]; S];
    for k in (1..=12).rev() {
        (0..S).for_each(|i| e[i][i] += 1.0);
        e = product(&a, &e);
        e.as_flattened_mut().iter_mut().for_each(|x| *x /= f64::from(k));
    }
    (0..S).for_each(|i| e[i][i] += 1.0);
    for _ in 0..halvings as usize {
        e = product(&e, &e);
    }
    e
}

/// The controller's model of the joint, independent of its gains.
pub(super) struct Model {
    phi: [[f64; PLANT]; PLANT],
    gamma: [f64; PLANT],
    /// Effect of the accelerations of link and motor.
    push: [[f64; 2]; PLANT],
    keeps: f64,
    pub(super) period_s: f64,
    pub(super) unit: f64,
    pub(super) delay: usize,
}

impl Model {
    pub(super) fn of(ratios: &JointRatios, tick: &JointTick, period_s: f64, delay: usize) -> Self {
        let unit = ratios.rigid_gain() * period_s * period_s;
        let scale = [1.0, period_s, 1.0, period_s, unit];
        let (mut phi, mut gamma) = tick.matrices(ratios);
        let mut push = [[0.0; 2]; PLANT];
        for i in 0..PLANT {
            (0..PLANT).for_each(|j| phi[i][j] *= scale[i] / scale[j]);
            gamma[i] *= scale[i] / unit;
        }
        for shaft in 0..2 {
            let t = period_s;
            push[2 * shaft] = tick.g1[shaft].map(|g| g / (t * t));
            push[2 * shaft + 1] = tick.g2[shaft].map(|g| g / t);
        }
        Self { phi, gamma, push, keeps: tick.keeps, period_s, unit, delay }
    }

    /// Returns true if the regulator is stable with any smaller gain of u, as with u at its limit.
    ///
    /// The observer uses the applied u, so a limit scales the feedback alone. A loop that a smaller gain makes unstable
    /// can have a limit cycle between the limits.
    pub(super) fn bears_limits(&self, law: &Regulator) -> bool {
        let feedback = self.feedback(law);
        (1..=8).map(|k| 0.5_f64.powi(k)).all(|gain| {
            let mut a = [[0.0; MOST]; MOST];
            for i in 0..PLANT {
                (0..PLANT).for_each(|j| a[i][j] = self.phi[i][j] - gain * self.gamma[i] * feedback[j]);
            }
            eigenvalues(a, PLANT).is_some_and(|poles| poles.iter().all(|[re, im]| libm::hypot(*re, *im) < 1.0 + 1e-9))
        })
    }

    /// Returns K in the units of the module documentation.
    fn feedback(&self, law: &Regulator) -> [f64; PLANT] {
        let (k, t, unit) = (law.feedback, self.period_s, self.unit);
        [k[0] * unit, k[1] * unit / t, k[2] * unit, k[3] * unit / t, k[4]]
    }

    /// Returns the states after a tick from x, with u and the accelerations.
    fn moved(&self, x: [f64; PLANT], u: f64, push: [f64; 2]) -> [f64; PLANT] {
        std::array::from_fn(|i| {
            let by_state: f64 = self.phi[i].iter().zip(x).map(|(phi, x)| phi * x).sum();
            by_state + self.gamma[i] * u + self.push[i][0] * push[0] + self.push[i][1] * push[1]
        })
    }
}

/// Controller about rest at one angle: s⁺ = A s + B y, u = C s + D y, innovation y - E s - F y.
pub(super) struct Controller {
    order: usize,
    a: [[f64; OWN + QUEUE]; OWN + QUEUE],
    b: [[f64; 2]; OWN + QUEUE],
    c: [f64; OWN + QUEUE],
    d: [f64; 2],
    e: [[f64; OWN + QUEUE]; 2],
    f: [[f64; 2]; 2],
    poles: Vec<Complex>,
}

impl Controller {
    /// Returns the controller. `gains`: from [`JointTick::observer_gains`]; `gravity`: (weight/J_l) cos θ, 1/s².
    pub(super) fn of(model: &Model, gains: &[[[f64; 3]; 2]; 2], law: &Regulator, gravity: f64) -> Option<Self> {
        let order = OWN + model.delay;
        let mut out = Self {
            order,
            a: [[0.0; OWN + QUEUE]; OWN + QUEUE],
            b: [[0.0; 2]; OWN + QUEUE],
            c: [0.0; OWN + QUEUE],
            d: [0.0; 2],
            e: [[0.0; OWN + QUEUE]; 2],
            f: [[0.0; 2]; 2],
            poles: Vec::new(),
        };
        for j in 0..order + 2 {
            let (mut s, mut y) = ([0.0; OWN + QUEUE], [0.0; 2]);
            if j < order {
                s[j] = 1.0;
            } else {
                y[j - order] = 1.0;
            }
            let (next, u, innovation) = ticked(model, gains, law, gravity, &s, y);
            for i in 0..order {
                if j < order {
                    out.a[i][j] = next[i];
                } else {
                    out.b[i][j - order] = next[i];
                }
            }
            if j < order {
                out.c[j] = u;
                (0..2).for_each(|k| out.e[k][j] = innovation[k]);
            } else {
                out.d[j - order] = u;
                (0..2).for_each(|k| out.f[k][j - order] = innovation[k]);
            }
        }
        let mut square = [[0.0; MOST]; MOST];
        out.a.iter().zip(&mut square).for_each(|(from, to)| to[..OWN + QUEUE].copy_from_slice(from));
        out.poles = eigenvalues(square, order)?;
        Some(out)
    }
}

/// Computes the tick of the target about rest, without limits: next states, u, and the innovation of both encoders.
fn ticked(
    model: &Model,
    gains: &[[[f64; 3]; 2]; 2],
    law: &Regulator,
    gravity: f64,
    s: &[f64; OWN + QUEUE],
    y: [f64; 2],
) -> ([f64; OWN + QUEUE], f64, [f64; 2]) {
    let (t, unit) = (model.period_s, model.unit);
    let pull = -gravity * t * t * y[0];
    // Half of the gravity torque of the last tick is known from this count.
    let mut xi = [s[1], s[2], s[3], s[4], s[5], s[6]];
    for shaft in 0..2 {
        xi[3 * shaft] += 0.5 * model.push[2 * shaft][0] * pull;
        xi[3 * shaft + 1] += 0.5 * model.push[2 * shaft + 1][0] * pull;
    }
    let innovation = [y[0] - xi[0], y[1] - xi[3]];
    for shaft in 0..2 {
        for (encoder, e) in innovation.iter().enumerate() {
            let [q, v, d] = gains[shaft][encoder];
            xi[3 * shaft] += q * e;
            xi[3 * shaft + 1] += v * t * e;
            xi[3 * shaft + 2] += d * t * t * e;
        }
    }
    let now = [xi[0], xi[1], xi[3], xi[4], s[0]];
    let mut ahead = now;
    for k in 0..model.delay {
        ahead = model.moved(ahead, s[OWN + k], [xi[2] + pull, xi[5]]);
    }
    let by_state: f64 = model.feedback(law).iter().zip(ahead).map(|(k, x)| k * x).sum();
    let u = (law.disturbance[0] * xi[2] + law.disturbance[1] * xi[5]) * unit / (t * t) - by_state;
    let mut next = [0.0; OWN + QUEUE];
    let applied = if model.delay > 0 { s[OWN] } else { u };
    let x = model.moved(now, applied, [xi[2] + 0.5 * pull, xi[5]]);
    next[..OWN].copy_from_slice(&[applied + model.keeps * (s[0] - applied), x[0], x[1], xi[2], x[2], x[3], xi[5]]);
    if model.delay > 0 {
        next[OWN..OWN + model.delay - 1].copy_from_slice(&s[OWN + 1..OWN + model.delay]);
        next[OWN + model.delay - 1] = u;
    }
    (next, u, innovation)
}

/// Plant and controller as one matrix.
pub(super) struct Loop<'a> {
    plant: &'a Plant,
    controller: &'a Controller,
    order: usize,
    a: Square,
    poles: Vec<Complex>,
}

impl<'a> Loop<'a> {
    /// Returns the loop. `None` if its eigenvalues are not found.
    pub(super) fn of(plant: &'a Plant, controller: &'a Controller) -> Option<Self> {
        let (c, order) = (controller, PLANT + controller.order);
        let queue = (c.order > OWN).then_some(PLANT + OWN);
        let mut a = [[0.0; MOST]; MOST];
        for i in 0..PLANT {
            a[i][..PLANT].copy_from_slice(&plant.phi[i]);
            if let Some(oldest) = queue {
                a[i][oldest] = plant.gamma[i];
            } else {
                (0..c.order).for_each(|j| a[i][PLANT + j] = plant.gamma[i] * c.c[j]);
                (a[i][0], a[i][2]) = (a[i][0] + plant.gamma[i] * c.d[0], a[i][2] + plant.gamma[i] * c.d[1]);
            }
        }
        for i in 0..c.order {
            a[PLANT + i][PLANT..order].copy_from_slice(&c.a[i][..c.order]);
            (a[PLANT + i][0], a[PLANT + i][2]) = (c.b[i][0], c.b[i][1]);
        }
        let poles = eigenvalues(a, order)?;
        Some(Self { plant, controller, order, a, poles })
    }

    /// Returns the spectral radius.
    pub(super) fn radius(&self) -> f64 {
        self.poles.iter().map(|[re, im]| libm::hypot(*re, *im)).fold(0.0, f64::max)
    }

    /// Returns the largest |S| at the plant input of a stable loop. Below the angle per tick `slow` |S| has no peak.
    pub(super) fn peak(&self, slow: f64) -> f64 {
        const GRID: usize = 48;
        let ratio = libm::pow(PI / slow, 1.0 / GRID as f64);
        let mut angles: Vec<f64> = (0..=GRID).map(|k| PI / ratio.powi(k as i32)).collect();
        angles.extend(self.poles.iter().filter(|p| p[1] > 0.0).map(|[re, im]| libm::atan2(*im, *re)));
        angles.sort_by(f64::total_cmp);
        let sizes: Vec<f64> = angles.iter().map(|&angle| self.sensitivity(angle)).collect();
        let best = (0..sizes.len()).max_by(|&i, &j| sizes[i].total_cmp(&sizes[j])).unwrap_or(0);
        // Golden section search between the neighbours.
        let (mut low, mut high) = (angles[best.saturating_sub(1)], angles[(best + 1).min(angles.len() - 1)]);
        let mut most = sizes[best];
        for _ in 0..12 {
            let by = 0.618_034 * (high - low);
            let (left, right) = (self.sensitivity(high - by), self.sensitivity(low + by));
            most = most.max(left).max(right);
            (low, high) = if left > right { (low, low + by) } else { (high - by, high) };
        }
        most
    }

    /// Returns |S| at this angle per tick.
    pub(super) fn sensitivity(&self, angle: f64) -> f64 {
        let (s, c) = (libm::sin(angle), libm::cos(angle));
        let square = |poles: &[Complex]| poles.iter().map(|p| (c - p[0]).powi(2) + (s - p[1]).powi(2)).product::<f64>();
        (square(&self.plant.poles) * square(&self.controller.poles) / square(&self.poles)).sqrt()
    }

    /// Returns the rms of u, in its unit, and of both innovations, in radians, in the steady state under white encoder
    /// noise. `noise_rad`: rms of both encoders.
    pub(super) fn noise(&self, noise_rad: [f64; 2], unit: f64) -> (f64, [f64; 2]) {
        let (c, n) = (self.controller, self.order);
        let mut x = [[0.0; MOST]; MOST];
        for (encoder, rms) in noise_rad.iter().enumerate() {
            let mut column = [0.0; MOST];
            for i in 0..PLANT {
                column[i] = if c.order > OWN { 0.0 } else { self.plant.gamma[i] * c.d[encoder] * rms };
            }
            (0..c.order).for_each(|i| column[PLANT + i] = c.b[i][encoder] * rms);
            for i in 0..n {
                (0..n).for_each(|j| x[i][j] += column[i] * column[j]);
            }
        }
        // X = sum of A^k B B' A'^k, twice as many terms in each round.
        let mut a = self.a;
        for _ in 0..40 {
            let more = times_transposed(&times(&a, &x, n), &a, n);
            let mut stands = true;
            for i in 0..n {
                stands &= more[i][i] <= 1e-9 * x[i][i];
                (0..n).for_each(|j| x[i][j] += more[i][j]);
            }
            if stands {
                break;
            }
            a = times(&a, &a, n);
        }
        let rms = |own: &[f64; OWN + QUEUE], direct: [f64; 2]| {
            let mut row = [0.0; MOST];
            row[PLANT..n].copy_from_slice(&own[..c.order]);
            (row[0], row[2]) = (direct[0], direct[1]);
            let by_state: f64 = (0..n).map(|i| row[i] * (0..n).map(|j| x[i][j] * row[j]).sum::<f64>()).sum();
            let at_once: f64 = (0..2).map(|k| (direct[k] * noise_rad[k]).powi(2)).sum();
            (by_state + at_once).sqrt()
        };
        (rms(&c.c, c.d) / unit, [0, 1].map(|k| rms(&c.e[k], c.f[k])))
    }

    /// Returns the response of the link to a load step of 1 N m: the largest deflection, rad, and its area, rad ticks.
    /// `horizon`: simulated ticks.
    pub(super) fn dip(&self, horizon: f64) -> (f64, f64) {
        const SAMPLES: usize = 200;
        let stride = (horizon / SAMPLES as f64).max(1.0) as usize;
        // A^stride and the sum of the lower powers, by squaring.
        let (mut a, mut c) = ([[0.0; MOST]; MOST], [0.0; MOST]);
        (0..self.order).for_each(|i| a[i][i] = 1.0);
        for bit in (0..usize::BITS - stride.leading_zeros()).rev() {
            let moved = applied(&a, &c, self.order);
            (0..self.order).for_each(|i| c[i] += moved[i]);
            a = times(&a, &a, self.order);
            if stride >> bit & 1 == 1 {
                c = applied(&self.a, &c, self.order);
                (0..PLANT).for_each(|i| c[i] += self.plant.load[i]);
                a = times(&self.a, &a, self.order);
            }
        }
        let (mut x, mut most, mut area) = ([0.0; MOST], 0.0_f64, 0.0);
        for _ in 0..SAMPLES {
            x = applied(&a, &x, self.order);
            (0..self.order).for_each(|i| x[i] += c[i]);
            most = most.max(x[0].abs());
            area += x[0].abs() * stride as f64;
        }
        (most, area)
    }
}

fn times(a: &Square, b: &Square, order: usize) -> Square {
    let mut out = [[0.0; MOST]; MOST];
    for i in 0..order {
        for k in 0..order {
            let factor = a[i][k];
            (0..order).for_each(|j| out[i][j] += factor * b[k][j]);
        }
    }
    out
}

fn times_transposed(a: &Square, b: &Square, order: usize) -> Square {
    let mut turned = [[0.0; MOST]; MOST];
    for i in 0..order {
        (0..order).for_each(|j| turned[j][i] = b[i][j]);
    }
    times(a, &turned, order)
}

fn applied(a: &Square, x: &[f64; MOST], order: usize) -> [f64; MOST] {
    let mut out = [0.0; MOST];
    for i in 0..order {
        for j in 0..order {
            out[i] += a[i][j] * x[j];
        }
    }
    out
}
