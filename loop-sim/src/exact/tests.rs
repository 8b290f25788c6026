use super::*;
use crate::plant::{Chain, FlexibleJoint, Friction, Imperfections, Joint, JointBody, JointErrors};
use crate::plant::{LastChannel, Motor, Plant, Shaft};
use crate::solver;
use controller_core::{JointParameters, Reading};

/// Returns the largest difference from the solver of order 10 over a run, relative to the largest value of each state.
/// Also returns the numbers of ticks crossed by the step and of all ticks.
fn deviation(plant: &dyn Plant, x0: &[f64], period_s: f64, span_s: f64) -> (f64, usize, usize) {
    let exact = plant.exact().expect("a step");
    let (mut ours, mut oracle) = (x0.to_vec(), x0.to_vec());
    let (mut largest, mut worst) = (vec![0.0_f64; x0.len()], vec![0.0_f64; x0.len()]);
    let ticks = (span_s / period_s).round() as usize;
    let mut crossed = 0;
    for k in 0..ticks {
        let (from_s, to_s) = (k as f64 * period_s, (k + 1) as f64 * period_s);
        let u = 3.0 * (0.1 * k as f64).cos() - if k / 50 % 2 == 0 { 0.0 } else { 4.0 };
        // The reference uses a quarter of its own step length.
        for part in 0..4 {
            let at = |part: usize| from_s + 0.25 * part as f64 * (to_s - from_s);
            solver::advance(plant, at(part), if part == 3 { to_s } else { at(part + 1) }, u, &mut oracle).expect("x");
        }
        if exact.advance(from_s, to_s, u, &mut ours) {
            crossed += 1;
        } else {
            solver::advance(plant, from_s, to_s, u, &mut ours).expect("a state");
        }
        for i in 0..x0.len() {
            largest[i] = largest[i].max(oracle[i].abs());
            worst[i] = worst[i].max((ours[i] - oracle[i]).abs());
        }
    }
    let share = worst.iter().zip(&largest).map(|(worst, largest)| worst / largest).fold(0.0, f64::max);
    (share, crossed, ticks)
}

fn signals() -> [Signal; 4] {
    let sin = |amplitude, omega_rad_s, phase_rad| Term::Sin { amplitude, omega_rad_s, phase_rad };
    [
        Signal::new(vec![sin(0.01, 3.0, 0.4)]),
        Signal::new(vec![
            Term::Const { amplitude: 0.3 },
            Term::Cos { amplitude: 0.2, omega_rad_s: 3.0, phase_rad: -1.0 },
            Term::Step { amplitude: 0.4, t0_s: 0.503_7 },
        ]),
        Signal::new(vec![Term::Ramp { slope: 0.1 }, sin(0.05, 40.0, 2.0)]),
        Signal::new(vec![Term::Step { amplitude: 5.0, t0_s: 0.5 }, Term::Ramp { slope: -2.0 }, sin(4.0, 7.0, 0.0)]),
    ]
}

#[test]
fn joints_of_every_reading_follow_the_solver_of_order_ten() {
    for (reading, errors) in [
        (Reading::Reconstructed, JointErrors::default()),
        (Reading::Reconstructed, JointErrors::uniform(0.3)),
        (Reading::Physical, JointErrors::uniform(-0.5)),
        (Reading::Stiff, JointErrors::default()),
    ] {
        let chain = JointParameters::TABLE_I.chain(reading);
        let plain = FlexibleJoint::new(chain, errors, FlexibleJoint::input_of_the_paper(), <[Signal; 4]>::default());
        let moved = FlexibleJoint::new(chain, errors, FlexibleJoint::input_of_the_paper(), signals());
        for plant in [plain, moved] {
            for period_s in [2e-4, 1e-3, 2e-3, 5e-3, 1e-2] {
                if reading == Reading::Stiff && period_s > 2e-3 {
                    // The plant needs more steps than allowed, so the solver takes it.
                    continue;
                }
                for x1 in [0.1, 1.0, 3.0] {
                    let plant = plant.clone().sampled(period_s);
                    let (share, crossed, ticks) = deviation(&plant, &[x1, 0.0, 0.0, 0.0], period_s, 2.0);
                    assert!(share < 1e-9, "{reading:?}, {period_s} s, {x1} rad: {share:.1e}");
                    assert!(crossed + 2 >= ticks, "{reading:?}, {period_s} s: {crossed} of {ticks} ticks");
                }
            }
        }
    }
}

/// The current of these plants lags by far less than a tick: the solver needs dozens of steps where this step needs
/// one.
#[test]
fn joints_and_motors_of_drives_follow_it_with_and_without_a_lag() {
    let motor = Shaft { inertia_kg_m2: 9.31e-4, torque_n_m_per_a: 0.2, damping_n_m_s: 0.07 };
    let load = Signal::new(vec![
        Term::Step { amplitude: 0.5, t0_s: 0.503_7 },
        Term::Sin { amplitude: 0.1, omega_rad_s: 30.0, phase_rad: 0.2 },
    ]);
    for (stiffness_n_m, weight_n_m) in [(20.0, 1.5), (400.0, 0.0), (3000.0, 4.0)] {
        let body = JointBody {
            link_inertia_kg_m2: 0.23,
            link_damping_n_m_s: 0.01,
            weight_n_m,
            stiffness_n_m,
            spring_damping_n_m_s: 0.0,
            motor,
        };
        for (lag_s, period_s) in [(0.0, 1e-3), (8e-5, 1e-3), (8e-5, 2.5e-4), (2e-3, 1e-3)] {
            let lag = Imperfections { lag_s, ..Imperfections::default() };
            let joint = Joint::new(body, body, lag, load.clone()).sampled(period_s);
            let x0 = [0.4, 0.0, 0.4, 0.0, 0.0];
            let (share, crossed, ticks) = deviation(&joint, &x0[..joint.order()], period_s, 2.0);
            let told = format!("{stiffness_n_m} N m, {lag_s} s of {period_s} s: {share:.1e}, {crossed} of {ticks}");
            assert!(share < 1e-9 && crossed + 1 >= ticks, "{told}");
            let motor = Motor::new(motor, motor, lag, load.clone()).sampled(period_s);
            let (share, crossed, ticks) = deviation(&motor, &x0[2..2 + motor.order()], period_s, 2.0);
            assert!(share < 1e-9 && crossed + 1 >= ticks, "a motor, {lag_s} s of {period_s} s: {share:.1e}");
        }
        // Nonlinear friction is left to the solver.
        let rough = Friction { static_n_m: 0.01, coulomb_n_m: 0.01, ..Friction::default() };
        let rough = Imperfections { friction: rough, ..Imperfections::default() };
        let damped = JointBody { spring_damping_n_m_s: 0.01, weight_n_m: 1.0, ..body };
        assert!(Joint::new(body, body, rough, load.clone()).sampled(1e-3).exact().is_none());
        assert!(Joint::new(damped, body, Imperfections::default(), load.clone()).sampled(1e-3).exact().is_none());
        assert!(Motor::new(motor, motor, rough, load.clone()).sampled(1e-3).exact().is_none());
    }
}

#[test]
fn chains_of_every_order_follow_it_over_any_period() {
    for (a, periods) in [
        (vec![-55.08, -20.0], [1e-3, 2e-2]),
        (vec![0.0, 0.0], [1e-3, 2e-2]),
        (vec![-1000.0, -300.0, -30.0], [1e-3, 1e-2]),
        (vec![-1.0, -4.0, 6.0, -4.0], [1e-3, 1e-2]),
        (vec![-1.0, -5.0, -10.0, -10.0, -5.0], [1e-3, 1e-2]),
        (vec![-1.0, -6.0, -15.0, -20.0, -15.0, -6.0], [1e-3, 5e-2]),
    ] {
        let n = a.len();
        let all = signals();
        let disturbances: Vec<Signal> = (0..n).map(|i| all[i % 4].clone()).collect();
        let last = LastChannel { a, b: 2.5 };
        let plant = Chain::new(last.clone(), last, disturbances).expect("a chain");
        for period_s in periods {
            let plant = plant.clone().sampled(period_s);
            let (share, crossed, ticks) = deviation(&plant, &vec![0.5; n], period_s, 2.0);
            assert!(share < 1e-9, "n = {n}, {period_s} s: {share:.1e}");
            assert!(crossed + 2 >= ticks, "n = {n}: {crossed} of {ticks} ticks");
        }
    }
}

#[test]
fn a_spinning_link_a_lost_state_a_jump_and_another_tick_are_the_solvers() {
    let chain = JointParameters::TABLE_I.chain(Reading::Reconstructed);
    let plant = FlexibleJoint::new(chain, JointErrors::default(), Signal::default(), signals()).sampled(1e-3);
    let exact = plant.exact().expect("a step");
    let crossed = |from_s: f64, to_s: f64, x: [f64; 4]| {
        let mut after = x;
        let crossed = exact.advance(from_s, to_s, 0.0, &mut after);
        assert!(crossed || after.map(f64::to_bits) == x.map(f64::to_bits));
        crossed
    };
    assert!(crossed(0.1, 0.101, [0.1, 0.0, 0.0, 0.0]));
    // The jump at 0.5 s is at the beginning of a tick, the jump at 0.5037 s is inside one.
    assert!(crossed(0.5, 0.501, [0.1, 0.0, 0.0, 0.0]));
    assert!(!crossed(0.503, 0.504, [0.1, 0.0, 0.0, 0.0]));
    assert!(!crossed(0.1, 0.102, [0.1, 0.0, 0.0, 0.0]));
    for lost in [[0.1, 51.0, 0.0, 0.0], [1001.0, 0.0, 0.0, 0.0], [0.1, 0.0, f64::NAN, 0.0], [0.1, 0.0, 0.0, 2e9]] {
        assert!(!crossed(0.1, 0.101, lost), "{lost:?}");
    }
}

#[test]
fn more_frequencies_than_there_is_room_for_and_too_fast_a_plant_have_no_step() {
    let many = |count: usize| {
        let term = |k: usize| Term::Sin { amplitude: 1.0, omega_rad_s: 1.0 + k as f64, phase_rad: 0.0 };
        let last = LastChannel { a: vec![0.0, 0.0], b: 1.0 };
        let noisy = Signal::new((0..count).map(term).collect());
        Chain::new(last.clone(), last, vec![Signal::default(), noisy]).expect("a chain").sampled(1e-3)
    };
    assert!(many(MOST).exact().is_some() && many(MOST + 1).exact().is_none());
    let stiff = JointParameters::TABLE_I.chain(Reading::Stiff);
    let joint = FlexibleJoint::of_the_paper(stiff);
    assert!(joint.clone().sampled(2e-3).exact().is_some() && joint.sampled(1e-1).exact().is_none());
}
