//! True motor whose load hangs on a gear with play.
//!
//! $$ J_l \ddot q = f - \text{load}(t), \qquad J_m \ddot q_m = K_t i - f - B \dot q_m - F(\dot q_m), \qquad
//!    \tau \thinspace \dot i = u - i $$
//!
//! The flanks push and never pull. With the twist $w = q_m - q$ and the play β
//!
//! $$ f = K \delta + D \dot w \quad \text{where that has the sign of } \delta =
//!    w - \mathrm{clamp}(w, \pm\tfrac{\beta}{2}), \text{ else } 0 $$
//!
//! The states are the angle and speed of the load, then of the motor, all behind the gear (rad, rad/s). With a lag the
//! current (A) follows. Friction, cogging and ripple of the motor are as in [`Motor`](super::Motor).
//!
//! The model of the controller is one inertia that moves with the load. The lumped disturbance d_2 (rad/s²) is the part
//! that this model lacks, taken with the flowing current.

use super::joint::{Joint, JointBody};
use super::motor::{Imperfections, Shaft};
use super::{Plant, Regime};
use crate::signal::Signal;

/// Motor with its gear and its load.
#[derive(Clone, Debug, PartialEq)]
pub struct Loose {
    joint: Joint,
    believed: Shaft,
}

impl Loose {
    /// Builds `truth` with this play, rad, and the model `believed` of the controller. `load` is in N m.
    pub fn new(truth: JointBody, play_rad: f64, believed: Shaft, imperfections: Imperfections, load: Signal) -> Self {
        Self { joint: Joint::new(truth, truth, imperfections, load).with_play(play_rad), believed }
    }
}

impl Plant for Loose {
    fn order(&self) -> usize {
        self.joint.order()
    }

    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        self.joint.rhs(t_s, x, u, dx);
    }

    fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
        let Shaft { inertia_kg_m2, torque_n_m_per_a, damping_n_m_s } = self.believed;
        let current = self.joint.current(x, u);
        self.rhs(t_s, x, u, d);
        let truth = d[1];
        d.fill(0.0);
        d[1] = truth - (torque_n_m_per_a * current - damping_n_m_s * x[1]) / inertia_kg_m2;
    }

    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.joint.fastest_rad_s(t_s, x, u)
    }

    fn regime(&self, t_s: f64, x: &[f64], u: f64) -> Regime {
        self.joint.regime(t_s, x, u)
    }

    fn rhs_in(&self, regime: Regime, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        self.joint.rhs_in(regime, t_s, x, u, dx);
    }

    fn margin(&self, regime: Regime, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.joint.margin(regime, t_s, x, u)
    }

    fn jumps_s(&self) -> &[f64] {
        self.joint.jumps_s()
    }

    fn driven(&self, x: &[f64], u: f64) -> f64 {
        self.joint.driven(x, u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::motor::Friction;
    use crate::solver;

    const BODY: JointBody = JointBody {
        link_inertia_kg_m2: 1e-4,
        link_damping_n_m_s: 0.0,
        weight_n_m: 0.0,
        stiffness_n_m: 20.0,
        spring_damping_n_m_s: 5e-3,
        motor: Shaft { inertia_kg_m2: 1.66e-3, torque_n_m_per_a: 1.3, damping_n_m_s: 0.0 },
    };

    fn loose(body: JointBody, play_rad: f64, imperfections: Imperfections) -> Loose {
        Loose::new(body, play_rad, body.motor, imperfections, Signal::default())
    }

    fn run(plant: &Loose, x: &mut [f64], span_s: f64, u: impl Fn(f64) -> f64) {
        let ticks = 1000;
        for k in 0..ticks {
            let [from, to] = [k, k + 1].map(|k| f64::from(k) * span_s / f64::from(ticks));
            solver::advance(plant, from, to, u(from), x).expect("a slow plant");
        }
    }

    /// In the gap the load moves freely, and the motor moves with its own inertia alone.
    #[test]
    fn in_the_gap_the_load_is_loose() {
        let plant = loose(BODY, 0.02, Imperfections::default());
        let mut x = [0.0, 0.1, 0.0, 0.1];
        run(&plant, &mut x, 0.01, |_| 0.05);
        let way = 0.5 * (1.3 * 0.05 / 1.66e-3) * 1e-4;
        assert!((x[0] - 1e-3).abs() < 1e-12 && (x[2] - 1e-3 - way).abs() < 1e-9 && way < 0.01, "{x:?}");
    }

    /// A shaft that hits a flank without damping rebounds with its full speed, like an elastic ball.
    #[test]
    fn a_flank_without_damping_gives_back_what_it_took() {
        let body = JointBody { spring_damping_n_m_s: 0.0, ..BODY };
        let plant = loose(body, 0.01, Imperfections::default());
        let mut x = [0.0, 0.5, 0.0, 0.0];
        // The shaft meets the flank after 10 ms and leaves it after half a period of 461 rad/s.
        run(&plant, &mut x, 0.022, |_| 0.0);
        let (light, heavy) = (1e-4, 1.66e-3);
        let expected = [0.5 * (light - heavy) / (light + heavy), 2.0 * light * 0.5 / (light + heavy)];
        assert!((x[1] - expected[0]).abs() < 1e-4 && (x[3] - expected[1]).abs() < 1e-4, "{x:?}, {expected:?}");
    }

    /// Compares with Heun's method in steps of half a microsecond, with friction that holds, a lag, and five hits on
    /// the flanks. After that both results depend on the instant of each hit.
    #[test]
    fn it_moves_as_small_steps_of_the_same_equations_do() {
        let friction = Friction { static_n_m: 0.03, coulomb_n_m: 0.03, stribeck_rad_s: 0.1, smooth_rad_s: 0.0 };
        let imperfections = Imperfections { friction, lag_s: 1e-3, ..Imperfections::default() };
        let (plant, play) = (loose(BODY, 0.01, imperfections), 0.01);
        let u = |t_s: f64| if ((20.0 * t_s) as u32).is_multiple_of(2) { 0.3 } else { -0.3 };
        let (mut x, mut own) = ([0.0; 5], [0.0_f64; 5]);
        run(&plant, &mut x, 0.1, u);
        let rates = |[q, v, qm, vm, i]: [f64; 5], u: f64, way: f64| {
            let twist = qm - q;
            let over = twist - twist.clamp(-play / 2.0, play / 2.0);
            let pushed = 20.0 * over + 5e-3 * (vm - v);
            let flank = if over * pushed > 0.0 { pushed } else { 0.0 };
            [v, flank / 1e-4, vm, (1.3 * i - flank - 0.03 * way) / 1.66e-3, (u - i) / 1e-3]
        };
        let (h, mut hits, mut was_free) = (5e-7, 0, true);
        for k in 0..200_000_u32 {
            let u = u(f64::from(k / 200) * 1e-4);
            let push = rates([own[0], own[1], own[2], own[3], own[4]], u, 0.0)[3] * 1.66e-3;
            let way = if own[3] == 0.0 { push.signum() } else { own[3].signum() };
            if own[3] == 0.0 && push.abs() <= 0.03 {
                let first = rates(own, u, 0.0);
                own = std::array::from_fn(|j| if j == 3 { 0.0 } else { own[j] + h * first[j] });
            } else {
                let first = rates(own, u, way);
                let then = rates(std::array::from_fn(|j| own[j] + h * first[j]), u, way);
                let next: [f64; 5] = std::array::from_fn(|j| own[j] + 0.5 * h * (first[j] + then[j]));
                let stops = own[3] != 0.0 && next[3] * own[3] < 0.0 && push.abs() <= 0.03;
                own = next;
                own[3] = if stops { 0.0 } else { own[3] };
            }
            let is_free = (own[2] - own[0]).abs() < play / 2.0;
            hits += u32::from(was_free && !is_free);
            was_free = is_free;
        }
        println!("{hits} hits: {x:?} {own:?}");
        assert!(hits > 3 && (x[2] - own[2]).abs() < 2e-5 && (x[0] - own[0]).abs() < 2e-4, "{x:?} {own:?}");
    }

    /// In the gap the load has no acceleration, whatever u is: the model of the controller does not explain this.
    #[test]
    fn the_lumped_disturbance_is_what_the_believed_motor_does_not_explain() {
        let plant = loose(BODY, 0.02, Imperfections { lag_s: 1e-3, ..Imperfections::default() });
        let mut d = [1.0; 5];
        plant.lumped(0.0, &[0.0, 0.3, 0.005, 0.1, 0.2], 0.4, &mut d);
        assert_eq!(d, [0.0, -1.3 * 0.2 / 1.66e-3, 0.0, 0.0, 0.0]);
    }
}
