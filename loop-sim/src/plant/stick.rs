//! Tests of friction that holds, against closed forms and an independent integrator.

use super::{Friction, Imperfections, Joint, JointBody, Motor, Plant, Shaft};
use crate::random::Random;
use crate::signal::{Signal, Term};
use crate::solver;

const SHAFT: Shaft = Shaft { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 0.0 };
/// Friction without a bell, for closed forms.
const PLAIN: Friction = Friction { static_n_m: 0.005, coulomb_n_m: 0.005, stribeck_rad_s: 0.1, smooth_rad_s: 0.0 };
const BELL: Friction = Friction { static_n_m: 0.008, ..PLAIN };

fn motor(friction: Friction, terms: Vec<Term>) -> Motor {
    Motor::new(SHAFT, SHAFT, Imperfections { friction, ..Imperfections::default() }, Signal::new(terms))
}

/// Advances the plant in ticks of 1 ms with u held.
fn advance(plant: &dyn Plant, x: &mut [f64], ticks: u32, u: impl Fn(u32) -> f64) {
    for k in 0..ticks {
        let [from, to] = [k, k + 1].map(|k| f64::from(k) * 1e-3);
        solver::advance(plant, from, to, u(k), x).expect("a slow plant");
    }
}

#[test]
fn a_shaft_that_is_pushed_by_less_than_static_friction_stands_to_the_bit() {
    let motor = motor(BELL, vec![Term::Sin { amplitude: 0.0029, omega_rad_s: 70.0, phase_rad: 0.3 }]);
    let mut x = [0.7, 0.0];
    advance(&motor, &mut x, 10_000, |k| if k % 7 < 3 { 0.1 } else { -0.1 });
    assert_eq!(x, [0.7, 0.0]);
}

/// Expected: t = J ω/F and a travel of J ω²/2F. Then the shaft stands.
#[test]
fn a_shaft_that_slides_out_stops_where_it_must() {
    for speed in [3.0, -0.2, 40.0_f64] {
        let motor = motor(PLAIN, Vec::new());
        let mut x = [0.0, speed];
        advance(&motor, &mut x, 3000, |_| 0.0);
        let way = 0.5 * 2e-4 * speed * speed.abs() / 0.005;
        assert!(x[1] == 0.0 && (x[0] - way).abs() < 1e-12 * way.abs(), "{speed} rad/s: {x:?}, {way}");
    }
}

/// A growing load releases the shaft at F/slope. From there on J ω' is the excess above F.
#[test]
fn a_shaft_lets_go_when_the_load_is_more_than_it_holds() {
    let motor = motor(PLAIN, vec![Term::Ramp { slope: -0.1 }]);
    let mut x = [0.0, 0.0];
    advance(&motor, &mut x, 87, |_| 0.0);
    let past = 0.087 - 0.05;
    let [way, speed] = [0.1 * past * past * past / 6.0 / 2e-4, 0.5 * 0.1 * past * past / 2e-4];
    assert!((x[1] - speed).abs() < 1e-11 * speed && (x[0] - way).abs() < 1e-11 * way, "{x:?} {way} {speed}");
}

/// A load that exceeds static friction only between two ticks releases the shaft.
#[test]
fn a_peak_between_two_ticks_lets_go() {
    // The peak of 0.00501 N m is at 0.5 ms.
    let omega_rad_s = 1500.0;
    let phase_rad = std::f64::consts::FRAC_PI_2 - 0.5e-3 * omega_rad_s;
    for amplitude in [0.00499, 0.00501] {
        let motor = motor(PLAIN, vec![Term::Sin { amplitude, omega_rad_s, phase_rad }]);
        let mut x = [0.0, 0.0];
        advance(&motor, &mut x, 1, |_| 0.0);
        assert_eq!(x[0] != 0.0, amplitude > 0.005, "{amplitude}: {x:?}");
    }
}

/// Motor that slides and sticks in Runge-Kutta steps of at most 0.2 us, with events by bisection. It shares no code
/// with the solver.
struct Own {
    shaft: Shaft,
    imperfections: Imperfections,
    load: f64,
    x: [f64; 3],
    sign: f64,
}

impl Own {
    fn push(&self, [angle, speed, current]: [f64; 3]) -> f64 {
        let Imperfections { cogging_n_m, cogging_per_turn, ripple, ripple_per_turn, .. } = self.imperfections;
        self.shaft.torque_n_m_per_a * current * (1.0 + ripple * (ripple_per_turn * angle).sin())
            + cogging_n_m * (cogging_per_turn * angle).sin()
            - self.shaft.damping_n_m_s * speed
            - self.load
    }

    fn rates(&self, x: [f64; 3], u: f64) -> [f64; 3] {
        let Friction { static_n_m, coulomb_n_m, stribeck_rad_s, .. } = self.imperfections.friction;
        let bell = (-(x[1] / stribeck_rad_s) * (x[1] / stribeck_rad_s)).exp();
        let friction = (coulomb_n_m + (static_n_m - coulomb_n_m) * bell) * self.sign;
        let acceleration = if self.sign == 0.0 { 0.0 } else { (self.push(x) - friction) / self.shaft.inertia_kg_m2 };
        [x[1], acceleration, (u - x[2]) / self.imperfections.lag_s]
    }

    fn after(&self, h: f64, u: f64) -> [f64; 3] {
        let x = self.x;
        let along = |slope: [f64; 3], h: f64| -> [f64; 3] { std::array::from_fn(|i| x[i] + h * slope[i]) };
        let a = self.rates(x, u);
        let b = self.rates(along(a, 0.5 * h), u);
        let c = self.rates(along(b, 0.5 * h), u);
        let d = self.rates(along(c, h), u);
        std::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
    }

    fn has_ended(&self, x: [f64; 3]) -> bool {
        if self.sign == 0.0 { self.push(x).abs() > self.most() } else { self.sign * x[1] < 0.0 }
    }

    fn most(&self) -> f64 {
        self.imperfections.friction.static_n_m
    }

    fn advance(&mut self, span_s: f64, u: f64) -> u32 {
        let (mut left, mut events) = (span_s, 0);
        while left > 1e-14 {
            if self.x[1] == 0.0 {
                let push = self.push(self.x);
                self.sign = if push.abs() > self.most() { push.signum() } else { 0.0 };
            }
            // The bell is crossed in many steps.
            let width = self.imperfections.friction.stribeck_rad_s;
            let beyond = (self.x[1].abs() - 6.0 * width).max(0.0);
            let swiftness = self.rates(self.x, u)[1].abs().max(1.0);
            let mut h = left.min(2e-7).min((0.005 * width + 0.05 * beyond) / swiftness);
            let mut next = self.after(h, u);
            if self.has_ended(next) {
                let [mut low, mut high] = [0.0, h];
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    if self.has_ended(self.after(middle, u)) { high = middle } else { low = middle }
                }
                h = high;
                next = self.after(h, u);
                next[1] = if self.sign == 0.0 { next[1] } else { 0.0 };
                events += 1;
            }
            self.x = next;
            left -= h;
        }
        events
    }
}

/// Random motors under random currents: each tick starts from the same state and must end in the same state.
#[test]
fn random_shafts_stick_and_slide_as_with_an_integrator_of_its_own() {
    let shafts = if std::env::var_os("DEEP").is_some() { 1000 } else { 60 };
    let mut random = Random::new(38, 1);
    let mut within = |low: f64, high: f64| low * (high / low).powf(random.uniform());
    let (mut events, mut worst, mut stood) = (0, 0.0_f64, 0);
    for _ in 0..shafts {
        let (inertia_kg_m2, torque) = (within(1e-6, 1e-2), within(0.1, 10.0));
        let most = torque * within(0.01, 0.2);
        let friction = Friction {
            static_n_m: most * within(1.0, 1.8),
            coulomb_n_m: most,
            stribeck_rad_s: within(0.02, 1.0),
            smooth_rad_s: 0.0,
        };
        let shaft = Shaft {
            inertia_kg_m2: inertia_kg_m2 * torque,
            torque_n_m_per_a: torque / 10.0,
            damping_n_m_s: 1e-3 * torque,
        };
        let imperfections = Imperfections {
            friction,
            cogging_n_m: most * within(0.01, 0.5),
            cogging_per_turn: 7.0,
            ripple: 0.02,
            ripple_per_turn: 6.0,
            lag_s: within(5e-5, 2e-3),
            supply: None,
        };
        let load = 0.2 * most * (within(1.0, 9.0) - 4.0);
        let motor = Motor::new(shaft, shaft, imperfections, Signal::new(vec![Term::Const { amplitude: load }]));
        let mut own = Own { shaft, imperfections, load, x: [0.3, 0.0, 0.0], sign: 0.0 };
        for tick in 0..20 {
            let u =
                10.0 * friction.static_n_m / torque * (within(0.1, 4.0) - 1.5) * if tick % 2 == 0 { 1.0 } else { -1.0 };
            let mut x = own.x;
            solver::advance(&motor, 0.0, 1e-3, u, &mut x).expect("a slow plant");
            let before = own.x;
            events += own.advance(1e-3, u);
            stood += u32::from(own.x[1] == 0.0);
            // Errors relative to the motion. An angle of 0.3 rad is rounded in each of many steps. A current with an
            // error of 4e-11 shifts the instant of release.
            let [speed, current] = [1, 2].map(|i| before[i].abs() + own.x[i].abs());
            let soon = 1e-8 * friction.static_n_m / shaft.inertia_kg_m2;
            for (i, size) in [1e-3 * speed + 1e-5, speed + soon, current + 1e-4].into_iter().enumerate() {
                worst = worst.max((x[i] - own.x[i]).abs() / size);
            }
            assert_eq!(x[1] == 0.0, own.x[1] == 0.0, "{x:?} {:?}", own.x);
        }
    }
    println!("{shafts} shafts, {events} events, stood {stood} times: {worst:.1e}");
    assert!(worst < 8e-9 && events > 2 * shafts && stood > shafts, "{worst:e}, {events}, {stood}");
}

/// A joint whose motor stands: the link swings on the spring alone at sqrt(K/J_l) rad/s. It releases the motor when the
/// spring is wound up enough.
#[test]
fn a_link_swings_on_the_spring_of_a_motor_that_stands() {
    let body = JointBody {
        link_inertia_kg_m2: 1e-2,
        link_damping_n_m_s: 0.0,
        weight_n_m: 0.0,
        stiffness_n_m: 4.0,
        spring_damping_n_m_s: 0.0,
        motor: SHAFT,
    };
    let friction = Friction { static_n_m: 0.2, coulomb_n_m: 0.1, ..BELL };
    let imperfections = Imperfections { friction, ..Imperfections::default() };
    let joint = Joint::new(body, body, imperfections, Signal::default());
    for (out, holds) in [(0.0499, true), (0.0501, false)] {
        let mut x = [0.0, out * 20.0, 0.0, 0.0];
        advance(&joint, &mut x, 1000, |_| 0.0);
        assert_eq!(x[2] == 0.0, holds, "{x:?}");
        if holds {
            let [angle, speed] = [out * 20.0_f64.sin(), out * 20.0 * 20.0_f64.cos()];
            assert!(x[3] == 0.0 && (x[0] - angle).abs() < 1e-9 && (x[1] - speed).abs() < 2e-8, "{x:?}");
        }
    }
}
