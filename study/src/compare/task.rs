//! Inputs of every controller in a comparison: encoders, reference, nominal plant.
//!
//! The nominal plant is the data sheet plant, with $x = (q, \dot q, q_m, \dot q_m)$ for a joint and $(q, \dot q)$ for a
//! motor, linear except for gravity:
//!
//! $$ \dot x = A x + B u + e_2 \thinspace g (q - \sin q) $$
//!
//! Its output is flat: r and its derivatives up to r''' (motor: r') determine all states. Their differences over a tick
//! determine the u that leads from one to the next (see [`controller_core::drive`]):
//!
//! $$ u = \frac1b \Big( \frac{\Delta r^{(n-1)}}{t_1} - \theta \sum_{j<n} \frac{\partial a_z}{\partial z_j}
//!    \Delta r^{(j-1)} - a_z(r, r', ..) \Big), \qquad t_1 = T \varphi_1(-\lambda T), \quad
//!    \theta = \varphi_2/\varphi_1 $$
//!
//! Gravity is in $a_z$. This u plus feedback of the error follows any such reference on the nominal plant.

use std::sync::Arc;

use controller_core::drive::Joint;
use loop_sim::port::drive::{DriveDesign, Motion};
use loop_sim::port::finer::Finer;
use loop_sim::sensor::encoder::Mounted;

use super::matrix::Matrix;
use crate::commission::sheet_of;
use crate::identify::Sheet;

/// Nominal plant of the data sheet.
#[derive(Clone, Debug)]
pub struct Model {
    /// Matrices A and B, units rad and s.
    pub(super) a: Matrix,
    pub(super) b: Matrix,
    /// k_1 of the chain; 1 for a motor.
    spring: f64,
    /// b_1, g, k_2, b_2; for a motor the last one is λ.
    link_damping: f64,
    gravity: f64,
    motor_spring: f64,
    motor_damping: f64,
    /// b of the chain.
    pub(super) gain: f64,
    t_1: f64,
    theta: f64,
    /// Sampling period T, s.
    pub period_s: f64,
}

impl Model {
    fn new(designed: &DriveDesign) -> Self {
        // Σ (-x)^k/(k + j)!
        let phi = |x: f64, j: u32| {
            let first = (1..=j).fold(1.0, |product, k| product / f64::from(k));
            (1..25).fold((first, first), |(sum, term), k| {
                let term = -term * x / f64::from(k + j);
                (sum + term, term)
            })
        };
        let with = |a, b, [spring, link_damping, gravity, motor_spring, motor_damping]: [f64; 5], gain, period_s| {
            let [phi_1, phi_2] = [1, 2].map(|j| phi((link_damping + motor_damping) * period_s, j).0);
            let (t_1, theta) = (period_s * phi_1, phi_2 / phi_1);
            Self { a, b, spring, link_damping, gravity, motor_spring, motor_damping, gain, t_1, theta, period_s }
        };
        let period_s = designed.period_s();
        match sheet_of(designed) {
            Sheet::Motor(motor) => {
                let (lambda, gain) = (motor.slope_per_s(), motor.input_gain());
                let a = Matrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, -lambda]);
                let b = Matrix::from_row_slice(2, 1, &[0.0, gain]);
                with(a, b, [1.0, 0.0, 0.0, 0.0, lambda], gain, period_s)
            }
            Sheet::Joint(joint) => {
                let Joint { link_inertia_kg_m2: link, motor_inertia_kg_m2: motor, stiffness_n_m, .. } = joint;
                let (k1, k2) = (stiffness_n_m / link, stiffness_n_m / motor);
                let (b1, b2) = (joint.link_damping_n_m_s / link, joint.motor_damping_n_m_s / motor);
                let (g, per_a) = (joint.weight_n_m / link, joint.torque_n_m_per_a / motor);
                let rows = [0.0, 1.0, 0.0, 0.0, -k1 - g, -b1, k1, 0.0, 0.0, 0.0, 0.0, 1.0, k2, 0.0, -k2, -b2];
                let a = Matrix::from_row_slice(4, 4, &rows);
                let b = Matrix::from_row_slice(4, 1, &[0.0, 0.0, 0.0, per_a]);
                with(a, b, [k1, b1, g, k2, b2], k1 * per_a, period_s)
            }
        }
    }

    /// Returns the order n.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Returns the number of encoders.
    pub fn encoders(&self) -> usize {
        self.order() / 2
    }

    /// Returns the gain of both shafts together, rad/s² per A.
    pub(super) fn rigid_gain(&self) -> f64 {
        if self.order() == 2 { self.gain } else { self.gain / (self.spring + self.motor_spring) }
    }

    /// Returns the frequencies of a joint: the link with the motor held, and both against each other.
    pub(super) fn resonances_rad_s(&self) -> [f64; 2] {
        [self.spring, self.spring + self.motor_spring].map(libm::sqrt)
    }

    /// Returns the states of a trajectory point r, r', r'', r''', rad and s; a motor has two states.
    pub fn state(&self, &[r, r_1, r_2, r_3]: &[f64; 4]) -> [f64; 4] {
        if self.order() == 2 {
            return [r, r_1, 0.0, 0.0];
        }
        let (s, c) = (self.gravity * libm::sin(r), self.gravity * libm::cos(r));
        let x_3 = r_2 + self.spring * r + self.link_damping * r_1 + s;
        let x_4 = r_3 + (self.spring + c) * r_1 + self.link_damping * r_2;
        [r, r_1, x_3 / self.spring, x_4 / self.spring]
    }

    /// Returns the held u, A, that leads the nominal plant from one trajectory point to the next.
    pub fn feed_forward(&self, begin: &[f64; 4], end: &[f64; 4]) -> f64 {
        if self.order() == 2 {
            return ((end[1] - begin[1]) / self.t_1 + self.motor_damping * begin[1]) / self.gain;
        }
        let Self { spring: k1, link_damping: b1, motor_spring: k2, motor_damping: b2, gravity, .. } = *self;
        let k = k1 + gravity;
        let gradient = [k1 * k2 - k2 * k, -k2 * b1 - b2 * k, -k2 - b1 * b2 - k];
        let drift_change: f64 = (0..3).map(|j| gradient[j] * (end[j] - begin[j])).sum();
        let [_, _, motor, motor_speed] = self.state(begin);
        let [r, r_1, r_2, r_3] = *begin;
        let (s, c) = (gravity * libm::sin(r), gravity * libm::cos(r));
        let linear = k1 * k2 * (r - motor) - b2 * k1 * motor_speed;
        let drift = linear + s * r_1 * r_1 - (k1 + c) * r_2 - b1 * r_3;
        ((end[3] - begin[3]) / self.t_1 - self.theta * drift_change - drift) / self.gain
    }

    /// Returns the shaft accelerations outside of a linear observer at these angles: g (q - sin q) of gravity and, for
    /// decoupled blocks, the coupling between the shafts.
    pub(super) fn pushes(&self, y: &[f64; 2], is_cut: bool) -> [f64; 2] {
        if self.order() == 2 {
            return [0.0; 2];
        }
        let gravity = self.gravity * (y[0] - libm::sin(y[0]));
        if is_cut { [gravity + self.spring * y[1], self.motor_spring * y[0]] } else { [gravity, 0.0] }
    }

    /// Returns M of z = M x at angle 0.
    pub(super) fn chain(&self) -> Matrix {
        if self.order() == 2 {
            return Matrix::identity(2, 2);
        }
        let (k1, b1, k) = (self.spring, self.link_damping, self.spring + self.gravity);
        let third = [-k, -b1, k1, 0.0];
        let fourth = [b1 * k, b1 * b1 - k, -b1 * k1, k1];
        let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], third, fourth];
        Matrix::from_row_slice(4, 4, rows.as_flattened())
    }
}

/// Reference of a tick with its feed-forward.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aim {
    /// Trajectory point r, r', r'', r'''.
    pub jet: [f64; 4],
    /// States of the trajectory point.
    pub x: [f64; 4],
    /// Feed-forward u from this tick to the next, A.
    pub feed: f64,
}

/// Inputs from which a controller is built.
#[derive(Clone)]
pub struct Task {
    /// edo-smc drive of the task: data sheet, limits, period, encoders.
    pub designed: DriveDesign,
    /// Reference.
    pub motion: Motion,
    /// Nominal plant.
    pub model: Arc<Model>,
    /// Whether the encoders are finer than in the file; such a run serves to measure the current noise.
    pub is_fine: bool,
    aims: Arc<Vec<Aim>>,
}

impl Task {
    /// Builds the task of a run with this number of ticks; after them the reference stays constant.
    pub fn new(designed: DriveDesign, motion: Motion, ticks: usize) -> Self {
        let model = Model::new(&designed);
        let jets: Vec<[f64; 4]> = (0..=ticks as u32 + 2).map(designed.jets(&motion)).collect();
        let aim = |pair: &[[f64; 4]]| Aim {
            jet: pair[0],
            x: model.state(&pair[0]),
            feed: model.feed_forward(&pair[0], &pair[1]),
        };
        let aims = jets.windows(2).map(aim).collect();
        Self { designed, motion, model: Arc::new(model), is_fine: false, aims: Arc::new(aims) }
    }

    /// Returns the task with finer encoders.
    pub(super) fn behind(&self, finer: &Finer) -> Self {
        Self { designed: finer.designed, is_fine: true, ..self.clone() }
    }

    /// Returns the reference of a tick.
    pub fn aim(&self, tick: usize) -> Aim {
        self.aims.get(tick).or(self.aims.last()).copied().unwrap_or_default()
    }

    /// Returns the current limit, A.
    pub fn max_current_a(&self) -> f64 {
        self.designed.max_current_a()
    }

    /// Returns the ticks from the computation of a current until it is held, 0 to 3.
    pub fn delay_ticks(&self) -> usize {
        self.designed.form().delay_ticks
    }

    /// Returns the conversion from counts to angles.
    pub fn angles(&self) -> Angles {
        let mounted: Vec<Mounted> = self.designed.encoders().into_iter().map(|(_, mounted)| mounted).collect();
        Angles { known: vec![(0, 0); mounted.len()], mounted }
    }
}

/// Conversion of wrapping counts to continuous angles, in f64.
#[derive(Clone, Debug)]
pub struct Angles {
    mounted: Vec<Mounted>,
    /// Count of the last sample, and the counts since angle 0.
    known: Vec<(i32, i64)>,
}

impl Angles {
    /// Returns the angles of a sample, rad: of the shaft, or of link and motor; `None` if a count is missing.
    pub fn read(&mut self, sample: &[f64]) -> Option<[f64; 2]> {
        let mut angles = [0.0; 2];
        for (i, mounted) in self.mounted.iter().enumerate() {
            let count = mounted.upright(*sample.get(i)?)?;
            let (last, steps) = self.known[i];
            let steps = steps + mounted.counts_since(count, last);
            self.known[i] = (count, steps);
            angles[i] = steps as f64 * mounted.encoder.unit_rad();
        }
        Some(angles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller_core::drive::{Encoder, Mounting};

    #[test]
    fn angles_go_on_where_counters_wrap() {
        // Also a counter whose states are no power of two.
        for encoder in [Encoder::absolute(12), Encoder::incremental(14, 4096).wrapping_at(4096 * 3)] {
            let mounted = Mounted { encoder, mounting: Mounting { is_reversed: true, offset_counts: 77 } };
            let mut angles = Angles { mounted: vec![mounted], known: vec![(0, 0)] };
            let mut first = None;
            for k in -900..900 {
                let angle = 0.05 * f64::from(k) + 40.0;
                // The first count determines the angle within the counter, but not its revolutions.
                let [read, _] = angles.read(&[mounted.count(angle)]).expect("a count");
                let off = read - angle;
                let from = *first.get_or_insert(off);
                assert!((off - from).abs() <= 1.01 * mounted.encoder.unit_rad(), "{k}: {off} {from}");
            }
            assert_eq!(angles.read(&[f64::NAN]), None);
        }
    }
}
