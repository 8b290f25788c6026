//! Stability of the exact sampled loop: its matrix near rest, assembled from one tick of controller and plant.
//!
//! A controller is $m' = A m + B y$, where an entry of m' is the u that is held until the next tick. The matrices come
//! from differences of the controller code, not from a second derivation. Every entry of the memory and every angle is
//! changed slightly, and the controller ticks once. The module `linear` of `loop-sim` does this for edo-smc, and this
//! module for a baseline controller. The result is exact up to rounding.

use loop_sim::linear::{LinearPlant, LinearTick, is_idle};
use loop_sim::plant::Plant;
use loop_sim::port::drive::DriveDesign;
use loop_sim::solver::SolverError;

use super::matrix::Matrix;
use super::rival::{HELD, Law, TickInputs};
use super::task::Aim;
use crate::margins::{eigenvalues, heard, without_nearest};

/// Size of the change, rad and similar units; small enough that no controller reaches its limit.
const NUDGE: f64 = 1e-9;

/// Controller near rest.
#[derive(Clone, Debug)]
pub struct Linear {
    a: Matrix,
    b: Matrix,
    /// Index of the held u in the memory.
    held: usize,
    /// Pole of the start-up offset, which decays independently of the loop.
    offset: Option<f64>,
}

impl Linear {
    /// Builds the model from a tick function. `tick` gets a memory and angles in steps of `size` and updates the
    /// memory; all values are 0 at rest.
    fn probed(width: usize, encoders: usize, held: usize, size: [f64; 2], tick: impl Fn(&mut [f64], [i32; 2])) -> Self {
        let (mut a, mut b) = (Matrix::zeros(width, width), Matrix::zeros(width, encoders));
        for j in 0..width + encoders {
            let (mut memory, mut steps) = (vec![0.0; width + encoders], [0; 2]);
            memory[j] = NUDGE;
            if let Some(encoder) = j.checked_sub(width) {
                steps[encoder] = 1;
            }
            tick(&mut memory[..width], steps);
            for (i, value) in memory[..width].iter().enumerate() {
                match j.checked_sub(width) {
                    None => a[(i, j)] = value / NUDGE,
                    Some(encoder) => b[(i, encoder)] = value / size[encoder],
                }
            }
        }
        for i in (0..width).filter(|&i| i != held) {
            if is_idle(i, width, |row, column| a[(row, column)]) {
                a[(i, i)] = 0.0;
            }
        }
        Self { a, b, held, offset: None }
    }

    /// Builds the model of a baseline controller; `None` for a nonlinear one.
    pub(super) fn of_rival(law: &Law, encoders: usize, late: usize) -> Option<Self> {
        let rest = Aim::default();
        let width = law.started(&[0.0; 2], &rest, late).len();
        law.is_linear().then(|| {
            Self::probed(width, encoders, HELD, [NUDGE; 2], |memory, steps| {
                let y = steps.map(|steps| NUDGE * f64::from(steps));
                law.tick(memory, &TickInputs { y, now: &rest, then: &rest, late }, false);
            })
        })
    }

    /// Builds the model of edo-smc with its base gains; `None` for an invalid design.
    pub(super) fn of_ours(designed: &DriveDesign) -> Option<Self> {
        let at_rest = designed.at_rest().ok()?;
        let LinearTick { a: own, b: seen, c, d, .. } = LinearTick::of(at_rest.law.as_ref(), false);
        // The delayed u follow the controller memory.
        let (n, held) = (own.len(), own.len() + designed.form().delay_ticks);
        let (mut a, mut b) = (Matrix::zeros(held + 1, held + 1), Matrix::zeros(held + 1, d.len()));
        for (i, (own, seen)) in own.iter().chain([&c]).zip(seen.iter().chain([&d])).enumerate() {
            for (j, entry) in own.iter().enumerate() {
                a[(i, j)] = *entry;
            }
            for (j, entry) in seen.iter().enumerate() {
                b[(i, j)] = *entry;
            }
        }
        for late in n..held {
            a[(late + 1, late)] = 1.0;
        }
        let offset = libm::exp(-designed.bandwidths().offset_per_s * designed.period_s());
        Some(Self { a, b, held, offset: Some(offset) })
    }

    /// Returns the spectral radius of the loop with this plant, infinite if an entry is not finite. States that do not
    /// affect u, and the start-up offset, are not part of the loop.
    pub fn radius(&self, plant: &Sampled) -> f64 {
        let whole = self.closed(plant);
        let u = plant.phi.nrows() + self.held;
        let kept = heard(whole.nrows(), |j| j == u, |i, j| whole[(i, j)]);
        let of_loop = Matrix::from_fn(kept.len(), kept.len(), |i, j| whole[(kept[i], kept[j])]);
        let Ok(poles) = eigenvalues(of_loop) else { return f64::INFINITY };
        let poles = match self.offset {
            Some(offset) => without_nearest(poles, offset),
            None => poles,
        };
        poles.first().map_or(0.0, |z| libm::hypot(z.re, z.im))
    }

    /// Returns one tick of the loop: the states of the plant, then the memory.
    fn closed(&self, plant: &Sampled) -> Matrix {
        let (n, m) = (plant.phi.nrows(), self.a.nrows());
        let mut whole = Matrix::zeros(n + m, n + m);
        whole.view_mut((0, 0), (n, n)).copy_from(&plant.phi);
        whole.view_mut((n, n), (m, m)).copy_from(&self.a);
        for encoder in 0..self.b.ncols() {
            // Angles are every second state.
            whole.view_mut((n, 2 * encoder), (m, 1)).copy_from(&self.b.column(encoder));
        }
        let held = whole.rows(n + self.held, 1).into_owned();
        let mut moved = whole.rows_mut(0, n);
        moved += &plant.gamma * held;
        whole
    }
}

/// Sampled plant near rest.
#[derive(Clone, Debug)]
pub struct Sampled {
    pub(super) phi: Matrix,
    pub(super) gamma: Matrix,
}

impl Sampled {
    /// Linearises a plant without friction; friction has no useful slope at rest.
    ///
    /// # Errors
    /// The plant cannot be integrated.
    pub fn new(plant: &dyn Plant, period_s: f64) -> Result<Self, SolverError> {
        let LinearPlant { phi, gamma } = LinearPlant::of(plant, 0.0, period_s)?;
        let n = gamma.len();
        Ok(Self { phi: Matrix::from_fn(n, n, |i, j| phi[i][j]), gamma: Matrix::from_vec(n, 1, gamma) })
    }

    /// Returns x one tick later.
    pub(super) fn next(&self, x: &[f64], u: f64) -> Vec<f64> {
        let mut next: Vec<f64> = self.gamma.iter().map(|gain| gain * u).collect();
        for (column, x) in self.phi.column_iter().zip(x) {
            for (next, entry) in next.iter_mut().zip(column.iter()) {
                *next += entry * x;
            }
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use controller_core::drive::{Joint, JointRatios, JointTick, Regulator};
    use loop_sim::plant::Imperfections;
    use loop_sim::port::drive::{Bandwidths, DriveOf};

    use super::super::rival::BaselineKind;
    use super::super::task::Task;
    use crate::commission::sheet_of;

    use super::*;

    fn bench(text: &str) -> super::super::Bench {
        super::super::Bench::new("test.toml", text, &[]).expect("a file")
    }

    /// Returns the nominal plant without current lag.
    fn nominal(task: &Task) -> Sampled {
        let plant = sheet_of(&task.designed).plant(0.0, Imperfections::default());
        Sampled::new(plant.as_ref(), task.model.period_s).expect("a slow plant")
    }

    /// Returns det(z - M).
    fn characteristic(matrix: &Matrix, z: f64) -> f64 {
        (Matrix::identity(matrix.nrows(), matrix.nrows()) * z - matrix).determinant()
    }

    fn guesses(kind: BaselineKind, task: &Task) -> Law {
        let knobs: Vec<f64> = kind.knobs(task).iter().map(|knob| knob.guess).collect();
        kind.law(task, &knobs).expect("a law")
    }

    /// Poles of the controller code: e^(-αT) of the offset, 1 - k_l T of the reaching, and the Bessel poles of the
    /// observer at e^(pT). The Bessel poles are checked only where no coupling is linearised within a tick.
    #[test]
    fn the_matrix_of_ours_has_the_poles_that_it_was_designed_for() {
        for text in [scenario::JOINT, scenario::MOTOR] {
            let task = bench(text).task().clone();
            let t = task.model.period_s;
            let Bandwidths { observers_rad_s, reaching_per_s: reaching, offset_per_s: offset, .. } =
                task.designed.bandwidths();
            // The observer of the link is coupled to the observer of the motor.
            let observer = if observers_rad_s.len() == 1 { &observers_rad_s[..] } else { &[] };
            let linear = Linear::of_ours(&task.designed).expect("a design");
            let found = eigenvalues(linear.closed(&nominal(&task))).expect("numbers");
            let off = |[re, im]: [f64; 2]| {
                let distances = found.iter().map(|z| (z.re - re).hypot(z.im - im));
                distances.fold(f64::INFINITY, f64::min) / (re - 1.0).hypot(im)
            };
            for (re, im) in observer.iter().flat_map(|w| [(-0.7456 * w * t, 0.7114 * w * t), (-0.9416 * w * t, 0.0)]) {
                let off = off([re.exp() * im.cos(), re.exp() * im.sin()]);
                assert!(off < 1e-4, "observer: {off:e}");
            }
            let [by_offset, by_reaching] = [(-offset * t).exp(), 1.0 - reaching * t].map(|pole| off([pole, 0.0]));
            println!("offset {by_offset:.1e}, reaching {by_reaching:.1e}");
            assert!(by_offset < 1e-4 && by_reaching < 0.1, "{by_offset:e} {by_reaching:e}");
        }
    }

    /// For a coupled joint the poles that the observer does not provide are the eigenvalues of Φ - Γ K, computed
    /// independently with the current lag. For a spring that is 10 % softer they differ.
    #[test]
    fn the_matrix_of_a_joint_as_a_whole_has_the_poles_of_its_regulator() {
        let text = scenario::JOINT
            .replace("stiffness_n_m = 9.0", "stiffness_n_m = 300.0")
            .replace("weight_n_m = 0.23", "weight_n_m = 0.0");
        let designed = bench(&text).designed;
        let DriveDesign::Joint(DriveOf { design, .. }) = &designed else { panic!("a joint") };
        let (t, lag_s) = (design.period_s, design.coupled.expect("a joint as a whole").lag_s);
        let linear = Linear::of_ours(&designed).expect("a design");
        let off = |stiffness: f64| {
            let sheet = Joint { stiffness_n_m: stiffness * design.joint.stiffness_n_m, ..design.joint };
            let ratios = JointRatios::of(&sheet, lag_s);
            let tick = JointTick::of(&ratios, t);
            let (phi, gamma) = tick.matrices(&ratios);
            let w = design.bandwidths;
            let k = Regulator::of(&ratios, &tick, t, [w.surface_rad_s, w.reaching_per_s]).expect("a gain").feedback;
            let closed = Matrix::from_fn(5, 5, |i, j| phi[i][j] - gamma[i] * k[j]);
            let plant = sheet_of(&designed).plant(0.0, Imperfections { lag_s, ..Imperfections::default() });
            let plant = Sampled::new(plant.as_ref(), t).expect("a slow plant");
            let found = eigenvalues(linear.closed(&plant)).expect("numbers");
            let nearest = |pole: &nalgebra::Complex<f64>| {
                found.iter().map(|z| (z.re - pole.re).hypot(z.im - pole.im)).fold(f64::INFINITY, f64::min)
            };
            let poles = eigenvalues(closed).expect("numbers");
            poles.iter().map(nearest).fold(0.0, f64::max)
        };
        let (same, softer) = (off(1.0), off(0.9));
        println!("{same:.1e}, softer {softer:.1e}");
        assert!(same < 1e-7 && softer > 1e-3, "{same:e} {softer:e}");
    }

    /// Closed form 1 + G C z^-L of a rigid shaft without friction, G = b T²/2 (z + 1)/(z - 1)², L ticks late.
    #[test]
    fn the_cascade_on_a_rigid_shaft_is_its_closed_form() {
        let task = bench(&scenario::MOTOR.replace("damping_n_m_s = 1e-5", "damping_n_m_s = 0.0")).task().clone();
        let (t, knobs) = (task.model.period_s, [40.0, 150.0, 30.0, 900.0]);
        let law = BaselineKind::Cascade.law(&task, &knobs).expect("a law");
        let plant = nominal(&task);
        let late = [0, 1, 2, 3].map(|late| Linear::of_rival(&law, 1, late).expect("linear").closed(&plant));
        let [kp, kv, ki, filter] = knobs;
        let fresh = 1.0 - (-filter * t).exp();
        for (z, (late, closed)) in
            [2.0, -1.5, 0.5, 3.0].into_iter().flat_map(|z| late.iter().enumerate().map(move |it| (z, it)))
        {
            let plant = t * t / 2.0 * (z + 1.0) / ((z - 1.0) * (z - 1.0));
            let differenced = fresh * z / (z - 1.0 + fresh) * (z - 1.0) / (z * t);
            let law = kv * (differenced + kp) * (1.0 + ki * t * z / (z - 1.0));
            let states = (z - 1.0) * (z - 1.0) * (z - 1.0) * (z - 1.0 + fresh);
            let spare = f64::powi(z, i32::try_from(closed.nrows()).expect("few") - 4);
            let law = law / f64::powi(z, late as i32);
            let (found, expected) = (characteristic(closed, z), (1.0 + plant * law) * states * spare);
            assert!((found / expected - 1.0).abs() < 1e-6, "z = {z}, {late} late: {found:e} of {expected:e}");
        }
    }

    /// Closed form for a joint: det(z - Φ) and C of both encoders in 1 + G C, with all denominators removed.
    #[test]
    fn the_cascade_with_a_notch_on_a_joint_is_its_closed_form() {
        for text in
            [scenario::JOINT.to_owned(), scenario::JOINT.replace("stiffness_n_m = 9.0", "stiffness_n_m = 300.0")]
        {
            let task = bench(&text).task().clone();
            let (t, knobs) = (task.model.period_s, [7.0, 12.0, 35.0, 9.0, 800.0, 400.0, 0.6]);
            let [kp, crossing, kv, ki, filter, centre, damping] = knobs;
            let plant = nominal(&task);
            let law = BaselineKind::Notch.law(&task, &knobs).expect("a law");
            let closed = Linear::of_rival(&law, 2, 0).expect("linear").closed(&plant);
            let [fresh, crossing] = [filter, crossing].map(|w| 1.0 - (-w * t).exp());
            let kappa = (0.5 * centre * t).tan();
            let whole = 1.0 + 2.0 * damping * kappa + kappa * kappa;
            for z in [2.0, -1.5, 0.5, 3.0] {
                let one = Matrix::identity(4, 4) * z - plant.phi.view((0, 0), (4, 4));
                let g = one.clone().lu().solve(&plant.gamma.rows(0, 4).into_owned()).expect("no pole of the joint");
                let middle = 2.0 * (kappa * kappa - 1.0) * z;
                let below = z * z + (middle + 1.0 - 2.0 * damping * kappa + kappa * kappa) / whole;
                let notch = ((1.0 + kappa * kappa) * (z * z + 1.0) + middle) / whole / below;
                let differenced = fresh * (z - 1.0) / (t * (z - 1.0 + fresh));
                let slow = crossing * z / (z - 1.0 + crossing);
                let speed_loop = kv / task.model.rigid_gain() * notch * (1.0 + ki * t * z / (z - 1.0));
                let [link, motor] = [kp * slow, kp * (1.0 - slow) + differenced];
                let loop_gain = speed_loop * (link * g[0] + motor * g[2]);
                let states = one.determinant() * (z - 1.0) * (z - 1.0 + fresh) * (z - 1.0 + crossing) * below;
                let spare = f64::powi(z, i32::try_from(closed.nrows()).expect("few") - 9);
                let (found, expected) = (characteristic(&closed, z), (1.0 + loop_gain) * states * spare);
                assert!((found / expected - 1.0).abs() < 1e-6, "z = {z}: {found:e} of {expected:e}");
            }
        }
    }

    /// The spectral radius of the matrix equals the decay of the controller code on the plant, tick by tick.
    #[test]
    fn laws_decay_as_their_matrices_say() {
        for text in [scenario::JOINT, scenario::MOTOR] {
            let task = bench(text).task().clone();
            let plant = nominal(&task);
            for kind in [BaselineKind::Lqg, BaselineKind::Lqi, BaselineKind::Notch] {
                if kind == BaselineKind::Notch && task.model.encoders() < 2 {
                    continue;
                }
                let law = Arc::new(guesses(kind, &task));
                let encoders = task.model.encoders();
                let told = Linear::of_rival(&law, encoders, 0).expect("linear").radius(&plant);
                assert!(told < 1.0, "{kind:?}: {told}");
                let rest = Aim::default();
                let mut memory = law.started(&[0.0; 2], &rest, 0);
                let mut x = vec![0.0; plant.phi.nrows()];
                x[0] = 1e-6;
                let mut sizes = Vec::new();
                for k in 0..(40.0 / (1.0 - told)) as usize {
                    let y = [x[0], x.get(2).copied().unwrap_or(0.0)];
                    law.tick(&mut memory, &TickInputs { y, now: &rest, then: &rest, late: 0 }, k == 0);
                    x = plant.next(&x, memory[HELD]);
                    sizes.push(x.iter().fold(0.0_f64, |size, x| size.max(x.abs())));
                }
                // Decay between the largest values of two intervals, since the slowest pair oscillates.
                let (early, late) = (sizes.len() / 2, 3 * sizes.len() / 4);
                let stretch = |from: usize| sizes[from..from + sizes.len() / 5].iter().copied().fold(0.0, f64::max);
                let found = (stretch(late) / stretch(early)).powf(1.0 / (late - early) as f64);
                assert!(((1.0 - found) / (1.0 - told) - 1.0).abs() < 0.15, "{kind:?}: {found} of {told}");
            }
        }
    }
}
