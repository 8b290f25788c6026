use std::ops::ControlFlow;

use super::*;
use crate::actuator::{self, Limited};
use crate::expression::Expression;
use crate::plant::{Friction, Imperfections, Joint, JointBody, Motor, Shaft, Supply};
use crate::port::{ControllerPort, PortError, Tick};
use crate::random::Random;
use crate::sensor;
use crate::signal::{Signal, Term};
use crate::sine;
use crate::trace::{Row, Trace};
use controller_core::Health;

const PERIOD_S: f64 = 1e-3;
const PERIODS: usize = 120;

/// Controller u = -k (x_1 - sin 20t), which fails at one tick.
struct Proportional {
    k: f64,
    tick: usize,
    breaks_at: usize,
}

impl ControllerPort for Proportional {
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        self.tick += 1;
        if self.tick == self.breaks_at {
            return Err(PortError::Broken("unplugged".into()));
        }
        let u = -self.k * (sample[0] - libm::sin(20.0 * PERIOD_S * self.tick as f64));
        Ok(Tick { u, sigma: 0.0, sigma_star: 0.0, estimates: Default::default(), health: Health::OK })
    }

    fn report_applied(&mut self, _: f64) {}

    fn reset(&mut self) -> Result<(), PortError> {
        Ok(())
    }

    fn observed(&self) -> &[usize] {
        &[]
    }
}

/// Plant and the drive of its loop.
struct Case {
    plant: Box<dyn Plant>,
    x0: Vec<f64>,
    k: f64,
    breaks_at: usize,
    stops_at: usize,
}

fn imperfections(off: &mut impl FnMut(f64) -> f64, kind: usize) -> Imperfections {
    let (has_lag, has_waves) = (kind % 2 == 1, kind / 2 % 2 == 1);
    let size = |size: f64| if has_waves { size } else { 0.0 };
    let friction = Friction {
        static_n_m: 0.008 * (1.0 + off(0.5)),
        coulomb_n_m: 0.005 * (1.0 + off(0.5)),
        stribeck_rad_s: 0.1 * (1.0 + off(0.5)),
        smooth_rad_s: 0.01 * (1.0 + off(0.5)),
    };
    Imperfections {
        friction,
        cogging_n_m: size(0.003 * (1.0 + off(0.5))),
        cogging_per_turn: 7.0,
        ripple: size(0.02),
        ripple_per_turn: 6.0,
        lag_s: if has_lag { 4e-4 * (1.0 + off(0.5)) } else { 0.0 },
        supply: None,
    }
}

/// Returns motors and joints of every kind, `of_each` of each, all different.
fn cases(of_each: usize) -> Vec<Case> {
    let mut random = Random::new(11, 0);
    let mut off = |size: f64| size * (2.0 * random.uniform() - 1.0);
    let mut cases = Vec::new();
    for k in 0..8 * of_each {
        let (is_joint, kind) = (k / 4 % 2 == 1, k % 4);
        let imperfections = imperfections(&mut off, kind);
        // A plant with a supply has no lane and runs alone, between the others.
        let supply = (k % 7 == 6).then_some(Supply { volt: 0.5, ohm: 0.3 });
        let mut imperfections = Imperfections { supply, ..imperfections };
        // Two in five have friction that holds.
        if k % 5 < 2 {
            imperfections.friction.smooth_rad_s = 0.0;
        }
        let mut terms = vec![
            Term::Const { amplitude: off(0.002) },
            Term::Step { amplitude: off(0.01), t0_s: 0.030_3 },
            Term::Step { amplitude: off(0.01), t0_s: 0.05 + off(0.01) },
        ];
        if k % 3 == 0 {
            terms.push(Term::Sin { amplitude: off(0.01), omega_rad_s: 90.0, phase_rad: off(1.0) });
        }
        let load = Signal::new(terms);
        let shaft = Shaft {
            inertia_kg_m2: 2e-4 * (1.0 + off(0.5)),
            torque_n_m_per_a: 0.05 * (1.0 + off(0.5)),
            damping_n_m_s: 1e-3 * (1.0 + off(0.5)),
        };
        // One in seventeen is so light that the solver refuses it.
        let shaft = if k % 17 == 16 { Shaft { inertia_kg_m2: 1e-12, ..shaft } } else { shaft };
        let (plant, order): (Box<dyn Plant>, _) = if is_joint {
            let body = JointBody {
                link_inertia_kg_m2: 1e-3 * (1.0 + off(0.5)),
                link_damping_n_m_s: 1e-3,
                weight_n_m: 0.05 * (1.0 + off(0.5)),
                stiffness_n_m: 5.0 * (1.0 + off(0.5)),
                spring_damping_n_m_s: 1e-3 * (1.0 + off(1.0)),
                motor: shaft,
            };
            (Box::new(Joint::new(body, body, imperfections, load)), 4 + kind % 2)
        } else {
            (Box::new(Motor::new(shaft, shaft, imperfections, load)), 2 + kind % 2)
        };
        let mut x0 = vec![0.0; order];
        (x0[0], x0[1]) = (off(0.3), off(2.0));
        // Angles at or near the range of the vectorised sine, and states that are NaN.
        match k % 13 {
            3 => x0[if is_joint { 2 } else { 0 }] = 2e4,
            5 => (x0[0], x0[1]) = (sine::LARGEST - 0.01, 30.0),
            7 if k % 2 == 1 => x0[1] = f64::NAN,
            _ => {}
        }
        // One in nine diverges. Some break off or are stopped.
        let k_p = if k % 9 == 8 { -3e4 } else { 3.0 * (1.0 + off(0.9)) };
        let [breaks_at, stops_at] =
            [(31, 30), (47, 46)].map(|(m, at)| if k % m == at { 40 + k % 60 } else { PERIODS * 2 });
        cases.push(Case { plant, x0, k: k_p, breaks_at, stops_at });
    }
    cases
}

type Ran = (Trace, Result<Ending, LoopError>);

/// Returns the results of `run` for all cases.
fn ran(cases: &[Case], run: impl FnOnce(Vec<Recorded<'_>>) -> Vec<Result<Ending, LoopError>>) -> Vec<Ran> {
    let mut stages: Vec<_> = cases
        .iter()
        .map(|case| {
            let port = Proportional { k: case.k, tick: 0, breaks_at: case.breaks_at };
            (port, sensor::Ideal, Limited::new(actuator::Ideal, -1e9, 2.0))
        })
        .collect();
    let setups = cases.iter().zip(&mut stages).map(|(case, (port, sensor, actuator))| Loop {
        plant: case.plant.as_ref(),
        sensor,
        port,
        actuator,
        report: true,
        missed: &[],
        x0: &case.x0,
        period_s: PERIOD_S,
        periods: PERIODS,
    });
    let setups: Vec<_> = setups.collect();
    let watched = cases.iter().zip(&setups);
    let mut watched: Vec<_> =
        watched.map(|(case, setup)| Watched { trace: setup.trace(), stops_at: case.stops_at }).collect();
    let recorders = watched.iter_mut().map(|recorder| recorder as &mut dyn Recorder);
    let endings = run(setups.into_iter().zip(recorders).collect());
    watched.into_iter().map(|watched| watched.trace).zip(endings).collect()
}

/// Trace that can stop the run.
struct Watched {
    trace: Trace,
    stops_at: usize,
}

impl Recorder for Watched {
    fn record(&mut self, row: &Row) -> ControlFlow<()> {
        _ = self.trace.record(row);
        if self.trace.rows.len() == self.stops_at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn end(&mut self, ending: Ending) {
        self.trace.end(ending);
    }
}

fn alone(runs: Vec<Recorded<'_>>) -> Vec<Result<Ending, LoopError>> {
    runs.into_iter().map(|(setup, recorder)| close_loop(setup, recorder)).collect()
}

/// Checks that both results have the same bits, including the sign of a zero.
fn same(side_by_side: &[Ran], alone: &[Ran]) {
    assert_eq!(side_by_side.len(), alone.len());
    for (k, ((found, how), (expected, why))) in side_by_side.iter().zip(alone).enumerate() {
        assert_eq!((how, found.ending), (why, expected.ending), "run {k}");
        assert_eq!(found.rows.len(), expected.rows.len(), "run {k}");
        for (i, (found, expected)) in found.rows.iter().zip(&expected.rows).enumerate() {
            assert_eq!(format!("{found:?}"), format!("{expected:?}"), "run {k}, tick {i}");
            assert_eq!(found.x.map(f64::to_bits), expected.x.map(f64::to_bits), "run {k}, tick {i}");
        }
    }
}

#[test]
fn every_run_has_its_bits_alone() {
    // The fast tier runs a third of the cases.
    let share = if std::env::var_os("DEEP").is_some_and(|value| value == "1") { 1 } else { 3 };
    let cases = cases(30 / share);
    let expected = ran(&cases, alone);
    let ended = |of: fn(&Result<Ending, LoopError>) -> bool| expected.iter().filter(|(_, how)| of(how)).count();
    let [finished, diverged, stopped, broken, refused] = [
        ended(|how| matches!(how, Ok(Ending::Finished))),
        ended(|how| matches!(how, Ok(Ending::Diverged { .. }))),
        ended(|how| matches!(how, Ok(Ending::Interrupted { .. }))),
        ended(|how| matches!(how, Err(LoopError::Port(_)))),
        ended(|how| matches!(how, Err(LoopError::Solver(_)))),
    ];
    let all = [(finished, 40), (diverged, 10), (stopped, 2), (broken, 2), (refused, 5)];
    assert!(
        all.iter().all(|(count, least)| share * count >= *least),
        "{finished} {diverged} {stopped} {broken} {refused}"
    );
    for instructions in [Instructions::Baseline, Instructions::Avx2, Instructions::Avx512] {
        same(&ran(&cases, |runs| close_each_with(instructions, runs)), &expected);
    }
}

/// Returns plants with formulas of three kinds, all different.
fn formulas(of_each: usize) -> Vec<Case> {
    let mut random = Random::new(5, 0);
    let mut off = |size: f64| size * (2.0 * random.uniform() - 1.0);
    let kinds: [&[&str]; 3] = [
        &["x2", "g/l*sin(x1) + (u - c*x2 - f*tanh(x2/0.01) + 0.2*cos(3*t))/(m*l^2)"],
        // A kink is halved again and again. Functions without vector code are called lane by lane.
        &["x2 - f*abs(x1)", "-x3", "min(u, 1) - max(c*x2, -x1) + atan2(x3, 2)^2 + exp(-x1^2) + sqrt(1 + x2^2)"],
        // A function so fast that the step is checked, and a pole that some plants hit.
        &["x2", "x3", "x4", "x5", "x6", "g*cos(900*t) - 1e3*x6 - m*x1 + u + c/(x1 - 0.2)"],
    ];
    let mut cases = Vec::new();
    for k in 0..3 * of_each {
        let rates = kinds[k % 3];
        let constants = [("g", 9.81), ("l", 0.5), ("c", 0.02), ("f", 0.05), ("m", 0.8)];
        let constants = constants.map(|(name, value)| (name.to_owned(), value * (1.0 + off(0.5)))).into();
        let names = ["x1", "x2", "x3", "x4", "x5", "x6"];
        let inputs: Vec<&str> = names[..rates.len()].iter().copied().chain(["u", "t"]).collect();
        let read = |text: &&str| Expression::parse(text, &inputs, &constants).expect(text);
        let mut disturbances = vec![Signal::default(); rates.len()];
        disturbances[1] = Signal::new(vec![
            Term::Step { amplitude: off(1.0), t0_s: 0.05 + off(0.01) },
            Term::Sin { amplitude: off(1.0), omega_rad_s: 40.0, phase_rad: 0.1 },
        ]);
        let nothing = Expression::linear(&[]);
        let rates: Vec<Expression> = rates.iter().map(read).collect();
        let mut x0 = vec![0.0; rates.len()];
        (x0[0], x0[1]) = (off(0.5), off(2.0));
        if k % 11 == 6 {
            x0[0] = if k % 3 == 2 { 0.2 } else { sine::LARGEST - 1e-3 };
        }
        let plant = Own::new(rates, nothing.clone(), nothing, disturbances).expect("a plant");
        let k_p = if k % 6 == 3 { -1e6 } else { 3.0 * (1.0 + off(0.9)) };
        cases.push(Case { plant: Box::new(plant), x0, k: k_p, breaks_at: PERIODS * 2, stops_at: PERIODS * 2 });
    }
    cases
}

#[test]
fn plants_by_formulas_too() {
    let cases = formulas(70);
    let expected = ran(&cases, alone);
    let ended = |of: fn(&Result<Ending, LoopError>) -> bool| expected.iter().filter(|(_, how)| of(how)).count();
    let finished = ended(|how| matches!(how, Ok(Ending::Finished)));
    let diverged = ended(|how| matches!(how, Ok(Ending::Diverged { .. })));
    let refused = ended(|how| matches!(how, Err(LoopError::Solver(_))));
    assert!(finished > 100 && diverged > 5 && refused > 2, "{finished} {diverged} {refused}");
    for instructions in [Instructions::Baseline, Instructions::Avx2, Instructions::Avx512] {
        same(&ran(&cases, |runs| close_each_with(instructions, runs)), &expected);
    }
}
