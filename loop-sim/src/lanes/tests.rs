use super::*;
use crate::actuator;
use crate::closed_loop::{Loop, close_loop};
use crate::metrics::measure;
use crate::plant::{Benchmark as Example1, Chain, FlexibleJoint, JointErrors, LastChannel};
use crate::port::in_process;
use crate::random::Random;
use crate::signal::{Signal, Term};
use controller_core::{
    AnyConfig, Config, JointParameters, Limits, ObserverGains, Options, ReachingLaw, Reading, Surface,
};

const PERIOD_S: f64 = 1e-3;
static IDEAL: Sensing = Sensing::IDEAL;

fn joint_law<const R: usize>(reading: Reading, k_l: f64) -> ControllerSpec {
    let nominal = JointParameters::TABLE_I.chain(reading).nominal();
    let gains = Some(ObserverGains::from_bandwidth::<R>(40.0));
    let config = Config::<4, R> {
        period_s: PERIOD_S,
        surface: Surface::from_bandwidth(5.0, 1.0),
        observers: [None, gains, None, gains],
        reaching: ReachingLaw { k_l, k_s: 0.5, epsilon: 0.01 },
        nominal,
        options: Options::NEUTRAL.with_limits(Limits::symmetric(100.0)).with_sigma_star_bound(1.0),
    };
    ControllerSpec {
        precision: Precision::F32,
        model: Model::Linear(nominal.gradient.to_vec()),
        config: AnyConfig::from(config),
    }
}

fn joints(reading: Reading, spread: f64, has_own_signals: bool) -> Vec<(Box<dyn Plant>, Vec<f64>)> {
    let mut random = Random::new(7, 0);
    let mut off = |size: f64| size * (2.0 * random.uniform() - 1.0);
    (0..LANES)
        .map(|_| {
            let [k1, k1_x3, b1, k2_x1, k2_x3, b2, b] = [(); 7].map(|()| off(spread));
            let errors = JointErrors { k1, k1_x3, b1, k2_x1, k2_x3, b2, b };
            let amplitude = if has_own_signals { 1.0 + off(0.5) } else { 1.0 };
            let input = Signal::new(vec![
                Term::Const { amplitude },
                Term::Sin { amplitude, omega_rad_s: 2.0, phase_rad: 0.3 },
                Term::Step { amplitude: 0.5, t0_s: 0.300_2 },
                Term::Step { amplitude: 0.5, t0_s: 0.4 },
            ]);
            let mismatched = Signal::new(vec![Term::Cos { amplitude: 0.2, omega_rad_s: 5.0, phase_rad: 0.0 }]);
            let extra = [Signal::default(), mismatched, Signal::default(), Signal::default()];
            let plant =
                FlexibleJoint::new(JointParameters::TABLE_I.chain(reading), errors, input, extra).sampled(PERIOD_S);
            (Box::new(plant) as Box<dyn Plant>, vec![off(1.0), off(0.2), 0.0, 0.0])
        })
        .collect()
}

/// Runs a trial alone. Returns its metrics, the number of ticks with each flag, and whether it finished. `None` if the
/// plant failed.
fn alone(campaign: &Campaign<'_>, Trial { plant, x0, seed }: Trial<'_>) -> Option<(Metrics, Vec<usize>, bool)> {
    let mut port = in_process::build(campaign.spec).expect("a design").port;
    let (mut sensor, mut actuator) = (campaign.sensing.sensor(seed), actuator::Ideal);
    let Campaign { period_s, periods, window_s, settling_band, .. } = *campaign;
    let setup = Loop {
        plant,
        sensor: sensor.as_mut(),
        port: port.as_mut(),
        actuator: &mut actuator,
        report: true,
        missed: &[],
        x0,
        period_s,
        periods,
    };
    let mut trace = setup.trace();
    let ending = close_loop(setup, &mut trace).ok()?;
    let with = |flag: usize| trace.rows.iter().filter(|row| row.health.bits() >> flag & 1 == 1).count();
    let is_whole = ending == crate::trace::Ending::Finished;
    Some((measure(&trace, window_s, settling_band), (0..FLAGS).map(with).collect(), is_whole))
}

/// Returns the bits of the metrics, including NaN.
fn bits(metrics: &Metrics) -> Vec<u64> {
    let Metrics { sigma_star_ultimate, y_ultimate, u_peak, u_total_variation_per_s, .. } = *metrics;
    let numbers = [sigma_star_ultimate, y_ultimate, u_peak, u_total_variation_per_s];
    let errors = metrics.estimation_error_ultimate.iter().map(|error| error.error);
    let settled = metrics.settling_time_s.map_or(u64::MAX, f64::to_bits);
    numbers.into_iter().chain(errors).map(f64::to_bits).chain([settled, u64::from(metrics.bounded)]).collect()
}

fn all(trials: &[(Box<dyn Plant>, Vec<f64>)]) -> Vec<Trial<'_>> {
    (1..).zip(trials).map(|(seed, (plant, x0))| Trial { plant: plant.as_ref(), x0, seed }).collect()
}

/// Checks that each lane is bit-identical to the run alone. Returns the number of lanes that ran.
fn held(campaign: &Campaign<'_>, trials: &[(Box<dyn Plant>, Vec<f64>)]) -> usize {
    let trials = all(trials);
    let found = close_loops(campaign, &trials);
    for instructions in [Instructions::Baseline, Instructions::Avx2] {
        assert!(close_loops_with(instructions, campaign, &trials) == found, "{instructions:?}");
    }
    let mut ran = 0;
    for (l, (trial, found)) in trials.iter().zip(&found).enumerate() {
        let Some(found) = found else { continue };
        let (metrics, ticks_with, is_whole) = alone(campaign, *trial).expect("a run");
        ran += 1;
        assert!(is_whole, "lane {l} did not go to its end alone");
        assert_eq!(bits(&found.metrics), bits(&metrics), "lane {l}: {found:?}, alone {metrics:?}");
        let counted: Vec<usize> = found.ticks_with.iter().map(|count| *count as usize).collect();
        assert_eq!(counted, ticks_with, "lane {l}");
        // A flag of a drive is not mistaken for one of the counted flags.
        for bit in FLAGS..16 {
            assert_eq!(found.ticks_with(Health::from_bits(1 << bit)), 0, "lane {l}");
        }
    }
    ran
}

#[test]
fn every_lane_has_the_bits_of_its_run_alone() {
    for reading in [Reading::Reconstructed, Reading::Physical] {
        for spread in [0.1, 0.6] {
            for has_own_signals in [false, true] {
                let trials = joints(reading, spread, has_own_signals);
                let in_f64 = ControllerSpec { precision: Precision::F64, ..joint_law::<2>(reading, 10.0) };
                for spec in [joint_law::<2>(reading, 10.0), joint_law::<3>(reading, 50.0), in_f64] {
                    let campaign = Campaign {
                        spec: &spec,
                        sensing: &IDEAL,
                        period_s: PERIOD_S,
                        periods: 800,
                        window_s: [0.35, 0.75],
                        settling_band: 0.01,
                    };
                    let ran = held(&campaign, &trials);
                    assert!(ran >= LANES - 24, "{reading:?}, {spread}: {ran} lanes");
                    assert_eq!(held(&campaign, &trials[..5]).min(5), held(&campaign, &trials[..5]));
                }
            }
        }
    }
}

#[test]
fn chains_side_by_side_too() {
    let config = Config::<3, 2> {
        period_s: PERIOD_S,
        surface: Surface::from_bandwidth(8.0, 4.0),
        observers: [
            None,
            Some(ObserverGains::from_bandwidth::<2>(60.0)),
            Some(ObserverGains::from_bandwidth::<2>(90.0)),
        ],
        reaching: ReachingLaw { k_l: 30.0, k_s: 0.0, epsilon: 0.01 },
        nominal: Nominal { gradient: [-10.0, -20.0, -5.0], input_gain: 3.0 },
        options: Options::NEUTRAL.with_limits(Limits::symmetric(50.0)),
    };
    let spec = ControllerSpec {
        precision: Precision::F32,
        model: Model::Linear(vec![-10.0, -20.0, -5.0]),
        config: AnyConfig::from(config),
    };
    let nominal = LastChannel { a: vec![-10.0, -20.0, -5.0], b: 3.0 };
    let mut random = Random::new(3, 0);
    let mut off = |size: f64| size * (2.0 * random.uniform() - 1.0);
    let trials: Vec<(Box<dyn Plant>, Vec<f64>)> = (0..LANES)
        .map(|_| {
            let truth = LastChannel {
                a: nominal.a.iter().map(|a| a * (1.0 + off(0.4))).collect(),
                b: nominal.b * (1.0 + off(0.4)),
            };
            let ramp = Signal::new(vec![
                Term::Ramp { slope: 0.4 },
                Term::Sin { amplitude: 1.0, omega_rad_s: 9.0, phase_rad: 0.0 },
            ]);
            let plant =
                Chain::new(truth, nominal.clone(), vec![Signal::default(), ramp.clone(), ramp]).expect("a chain");
            (Box::new(plant.sampled(PERIOD_S)) as Box<dyn Plant>, vec![off(1.0), 0.0, 0.0])
        })
        .collect();
    let campaign = Campaign {
        spec: &spec,
        sensing: &IDEAL,
        period_s: PERIOD_S,
        periods: 1000,
        window_s: [0.5, 1.0],
        settling_band: 0.01,
    };
    assert_eq!(held(&campaign, &trials), LANES);
}

fn example_1_law<const R: usize>(model: Model, period_s: f64, has_second: bool) -> ControllerSpec {
    let gains = Some(ObserverGains::from_bandwidth::<R>(20.0));
    let config = Config::<2, R> {
        period_s,
        surface: Surface::from_bandwidth(5.0, 1.0),
        observers: [gains, gains.filter(|_| has_second)],
        reaching: ReachingLaw { k_l: 20.0, k_s: 0.5, epsilon: 0.01 },
        nominal: Benchmark::<Micromath>::nominal(),
        options: Options::NEUTRAL.with_limits(Limits::symmetric(60.0)).with_sigma_star_bound(2.0),
    };
    ControllerSpec { precision: Precision::F32, model, config: AnyConfig::from(config) }
}

/// `differs` selects the differences besides amplitudes: 0 nothing, 1 instants of steps, 2 frequencies.
fn example_1(state_dependent: bool, differs: usize) -> Vec<(Box<dyn Plant>, Vec<f64>)> {
    let mut random = Random::new(11, 0);
    let mut off = |size: f64| size * (2.0 * random.uniform() - 1.0);
    (0..LANES)
        .map(|_| {
            let t0_s = if differs == 1 { 0.2 + off(0.1) } else { 0.300_04 };
            let omega_rad_s = if differs == 2 { 4.0 + off(1.0) } else { 4.0 };
            let mismatched = Signal::new(vec![
                Term::Ramp { slope: 0.2 + off(0.1) },
                Term::Const { amplitude: 0.5 },
                Term::Cos { amplitude: -0.5 + off(0.3), omega_rad_s, phase_rad: 0.1 },
                Term::Step { amplitude: off(1.0), t0_s },
                Term::Step { amplitude: 0.5, t0_s: 0.25 },
            ]);
            let matched = Signal::new(vec![Term::Sin { amplitude: off(1.0), omega_rad_s: 7.0, phase_rad: 0.0 }]);
            let plant = Example1::new([mismatched, matched], state_dependent);
            (Box::new(plant) as Box<dyn Plant>, vec![off(2.0), off(3.0)])
        })
        .collect()
}

#[test]
fn example_1_side_by_side_too() {
    // The fast tier runs every second case.
    let step = if std::env::var_os("DEEP").is_some_and(|value| value == "1") { 1 } else { 2 };
    for (state_dependent, differs) in
        [(false, 0), (true, 0), (true, 1), (false, 1), (true, 2)].into_iter().step_by(step)
    {
        let trials = example_1(state_dependent, differs);
        // A tick of 40 ms takes several steps of the solver.
        for (period_s, model) in
            [(1e-4, Model::BenchmarkLibm), (5e-3, Model::BenchmarkMicromath), (4e-2, Model::BenchmarkLibm)]
        {
            for spec in [
                example_1_law::<1>(model.clone(), period_s, false),
                example_1_law::<2>(model.clone(), period_s, true),
                example_1_law::<3>(model.clone(), period_s, true),
            ] {
                let periods = (0.5 / period_s) as usize;
                let campaign = Campaign {
                    spec: &spec,
                    sensing: &IDEAL,
                    period_s,
                    periods,
                    window_s: [0.1, 0.5],
                    settling_band: 0.01,
                };
                let ran = held(&campaign, &trials);
                assert!(ran >= LANES - 8, "{state_dependent} {differs} {spec:?}: {ran} lanes");
            }
        }
    }
}

/// States too far for one step of the solver, diverging states and NaN. Each result equals the run alone.
#[test]
fn example_1_from_afar() {
    let mut trials = example_1(true, 0);
    for (l, x1) in
        [1.0, 4.0, 6.0, 9.0, 20.0, 30.0, 600.0, 800.0, 2e9, f64::NAN, -700.0, -5000.0].into_iter().enumerate()
    {
        trials[l].1 = vec![x1, if l % 2 == 0 { 0.0 } else { 1e4 }];
    }
    let sensing = Sensing { noise: vec![1e-3, 1e-2], dropout: 0.02, ..Sensing::IDEAL };
    for period_s in [1e-4, 5e-3] {
        let spec = example_1_law::<2>(Model::BenchmarkLibm, period_s, true);
        let campaign = Campaign {
            spec: &spec,
            sensing: &sensing,
            period_s,
            periods: 200,
            window_s: [100.0 * period_s, 200.0 * period_s],
            settling_band: 0.01,
        };
        assert!(held(&campaign, &trials) > LANES / 2);
    }
}

#[test]
fn every_link_of_a_measuring_chain_too() {
    let spec = joint_law::<2>(Reading::Reconstructed, 10.0);
    let trials = joints(Reading::Reconstructed, 0.1, false);
    let noise = vec![1e-4, 1e-3, 0.0, 1e-2];
    let quantum = vec![1e-3, 0.0, 1e-2];
    let mut seen = Vec::new();
    for (sensing, late) in [
        (Sensing { noise: noise.clone(), ..Sensing::IDEAL }, 0),
        (Sensing { jitter: 0.5, ..Sensing::IDEAL }, 0),
        (Sensing { quantum: quantum.clone(), ..Sensing::IDEAL }, 0),
        (Sensing { delay_ticks: 2, ..Sensing::IDEAL }, 0),
        // Number of the seeds 1 to 64 that lose the first sample, from an independent computation.
        (Sensing { dropout: 0.1, ..Sensing::IDEAL }, 8),
        (Sensing { jitter: 0.2, noise, quantum, delay_ticks: 1, dropout: 0.05, ..Sensing::IDEAL }, 4),
    ] {
        let campaign = Campaign {
            spec: &spec,
            sensing: &sensing,
            period_s: PERIOD_S,
            periods: 400,
            window_s: [0.1, 0.4],
            settling_band: 0.01,
        };
        let ran = held(&campaign, &trials);
        assert_eq!(ran, LANES - late, "{sensing:?}");
        seen.push(format!("{:?}", close_loops(&campaign, &all(&trials))[5]));
    }
    seen.sort();
    seen.dedup();
    assert_eq!(seen.len(), 6, "every link does something");
}

#[test]
fn what_does_not_fit_is_left_to_the_run_alone() {
    let spec = joint_law::<2>(Reading::Reconstructed, 10.0);
    let campaign = Campaign {
        spec: &spec,
        sensing: &IDEAL,
        period_s: PERIOD_S,
        periods: 100,
        window_s: [0.05, 0.1],
        settling_band: 0.01,
    };
    let mut trials = joints(Reading::Reconstructed, 0.1, false);
    // A spinning link and a diverged state: only these two lanes are lost.
    trials[3].1 = vec![0.1, 200.0, 0.0, 0.0];
    trials[9].1 = vec![0.1, 0.0, 3e9, 0.0];
    let all = all(&trials);
    let found = close_loops(&campaign, &all);
    let left: Vec<usize> = (0..LANES).filter(|l| found[*l].is_none()).collect();
    assert_eq!(left, [3, 9]);
    // Another controller, another period, or a plant without a step: all lanes are lost.
    let other = ControllerSpec { model: Model::BenchmarkLibm, ..spec.clone() };
    let slower = Campaign { period_s: 2.0 * PERIOD_S, ..campaign };
    assert!(close_loops(&Campaign { spec: &other, ..campaign }, &all).iter().all(Option::is_none));
    assert!(close_loops(&slower, &all).iter().all(Option::is_none));
    let plain = FlexibleJoint::of_the_paper(JointParameters::TABLE_I.chain(Reading::Reconstructed));
    let one = [Trial { plant: &plain, x0: &[0.1, 0.0, 0.0, 0.0], seed: 0 }];
    assert_eq!(close_loops(&campaign, &one), [None]);
    assert_eq!(close_loops(&campaign, &[]), []);
}
