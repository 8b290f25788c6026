//! Robustness of the method for reasonable designs and beyond.

use controller_core::{JointChain, JointParameters, Reading};
use integration_tests::close::{quantile, relative};
use integration_tests::data::scenario_file;
use integration_tests::deep;
use integration_tests::oracle::{Gains, Model, Spec, power};
use integration_tests::paper::{self, complex_disturbance, is_bounded, joint, joint_spec};
use integration_tests::printed::{Printed, nominal};
use integration_tests::shape::{Precision, controller};
use integration_tests::strategy::{Case, Rng, case};
use integration_tests::truth::{ExactStep, Term, rk4};
use loop_sim::actuator::{self, Limited};
use loop_sim::metrics::{measure, ultimate};
use loop_sim::plant::{Benchmark, FlexibleJoint};
use loop_sim::port::in_process::Precision as PortPrecision;
use loop_sim::sensor;
use loop_sim::solver::advance;
use std::ops::ControlFlow;

/// Returns ultimate |sigma*| and |y| of the sampled f32 loop and of the continuous one; `None` if the sampled loop
/// diverged. `model` is the plant's a(x) and b(x), as in the controller: the chain's own, or the non-linear one.
fn ultimates(case: &Case, model: &Model) -> Option<[(f64, f64); 2]> {
    let Case { spec, plant, x0, ticks } = case;
    let mut shipped = controller(spec, model, 3, Precision::Single).expect("a valid design");
    let linear = *model == Model::linear(&plant.a, plant.b);
    let step = ExactStep::new(plant, spec.period_s);
    let a_b = nominal(model);
    let rhs = |t: f64, x: &[f64], u: f64, dx: &mut [f64]| {
        plant.rhs(t, x, u, dx);
        if !linear {
            let last = x.len() - 1;
            let d: f64 = plant.d[last].iter().map(|term| term.at(t)).sum();
            dx[last] = model.a(x) + model.b(x) * u + d;
        }
    };
    let mut printed = Printed::start(spec, &a_b, x0);
    let mut x = x0.clone();
    assert!(shipped.start(&x));
    let mut maxima = [(0.0_f64, 0.0_f64); 2];
    // Runge-Kutta needs lambda h < 2.7 for stability; a tenth of that or less is accurate. omega is the surface's
    // bandwidth; x_j is of the size of x_1 omega^(j-1).
    let omega = 2.0 * spec.alpha;
    let layer = if spec.k_s > 0.0 { spec.k_s / spec.epsilon } else { 0.0 };
    let steps = 4 + (10.0 * spec.period_s * spec.gradient[spec.order() - 1].abs().max(layer)) as usize;
    for k in 0..=*ticks {
        let tick = shipped.tick(&x);
        let ran_away = |(j, value): (usize, &f64)| value.is_nan() || value.abs() > 1e6 * power(omega, j);
        if !tick.u.is_finite() || x.iter().enumerate().any(ran_away) {
            return None;
        }
        if 2 * k >= *ticks {
            let now = printed.now();
            maxima[0] = (maxima[0].0.max(tick.sigma_star.abs()), maxima[0].1.max(x[0].abs()));
            maxima[1] = (maxima[1].0.max(now.sigma_star.abs()), maxima[1].1.max(printed.x()[0].abs()));
        }
        let [from_s, to_s] = [k, k + 1].map(|k| k as f64 * spec.period_s);
        if linear {
            step.advance(k, tick.u, &mut x);
        } else {
            rk4(from_s, to_s, steps, &mut x, &mut |t, x, dx| rhs(t, x, tick.u, dx));
        }
        printed.advance(&rhs, to_s, steps);
    }
    Some(maxima)
}

fn is_mismatched(case: &Case) -> bool {
    case.spec.observed().any(|(i, _)| i + 1 < case.spec.order())
}

/// Prints and returns median, 95 % quantile and maximum of a list of ratios.
fn spread(what: &str, ratios: &[f64]) -> [f64; 3] {
    let found = [0.5, 0.95, 1.0].map(|share| quantile(ratios, share));
    println!("{what}: sampled over continuous, {} chains: median, 95 %, max {found:.3?}", ratios.len());
    found
}

/// The thresholds apply to disturbances in mismatched channels, the subject of the method. Where only the last channel
/// is disturbed, the continuous loop rejects the disturbance almost completely and the ratio compares two small
/// numbers. It is bounded by 2 there (measured 1.75).
#[test]
fn random_chains_stay_bounded_and_close_to_the_continuous_loop() {
    let (mut mismatched, mut matched) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    let chains = if deep() { 260 } else { 60 };
    for seed in 0..chains {
        let case = case(&mut Rng::new(seed));
        let found = ultimates(&case, &Model::linear(&case.plant.a, case.plant.b));
        let [sampled, continuous] = found.unwrap_or_else(|| panic!("seed {seed} ran away: {case:?}"));
        let ratios = if is_mismatched(&case) { &mut mismatched } else { &mut matched };
        ratios[0].push(sampled.0 / continuous.0);
        ratios[1].push(sampled.1 / continuous.1);
    }
    assert!(mismatched[0].len() >= chains as usize * 15 / 26, "{} chains", mismatched[0].len());
    let [_, sigma_star, _] = spread("sigma*, mismatched", &mismatched[0]);
    let [_, y, _] = spread("y, mismatched", &mismatched[1]);
    assert!(sigma_star <= 1.20, "sigma* 95 % {sigma_star}");
    assert!(y <= 1.06, "y 95 % {y}");
    for (what, ratios) in ["sigma*, matched only", "y, matched only"].into_iter().zip(&matched) {
        let [_, _, largest] = spread(what, ratios);
        assert!(largest <= 2.0, "{what}: {largest}");
    }
}

/// Returns `case` with switching in proportion: sigma* is of the size 0.02 omega^(n-1), omega the surface's bandwidth.
fn switching(mut case: Case, rng: &mut Rng) -> Case {
    let omega = 2.0 * case.spec.alpha;
    let size = 0.02 * power(omega, case.spec.order() - 1);
    case.spec.k_s = size * omega * rng.spread(0.1, 2.0);
    case.spec.epsilon = size * rng.spread(0.02, 0.3);
    case
}

/// Returns `case` fifty times larger, so that x_1 is of order 1, with a non-linear a(x) and a varying b(x). The tick
/// contains both; the design's gradient contains only the linear part.
fn nonlinear(mut case: Case, rng: &mut Rng) -> (Case, Model) {
    let scale = 50.0;
    case.x0.iter_mut().for_each(|x| *x *= scale);
    for term in case.plant.d.iter_mut().flatten() {
        match term {
            Term::Const(amplitude) | Term::Ramp(amplitude) | Term::Sin(amplitude, ..) | Term::Step(amplitude, _) => {
                *amplitude *= scale;
            }
        }
    }
    let bend = rng.sign() * rng.within(0.3, 1.0) * power(2.0 * case.spec.alpha, case.spec.order());
    let swing = rng.within(-0.5, 0.5);
    let linear = Model::linear(&case.plant.a, case.plant.b);
    (case, Model { bend, swing, ..linear })
}

/// Returns the softness of the implicit saturation within its layer relative to the printed one. It is the ratio of the
/// slopes that hold sigma*: k_l + k_s/eps over k_l + (1 - k_l T) k_s/(eps + k_s T). It avoids chatter and tends to 1 as
/// T -> 0.
fn softer_by(spec: &Spec) -> f64 {
    let Spec { period_s, k_l, k_s, epsilon, .. } = *spec;
    (k_l + k_s / epsilon) / (k_l + (1.0 - k_l * period_s) * k_s / (epsilon + k_s * period_s))
}

/// With a layer not much wider than k_s T, sigma* and y are by design larger than in the continuous loop: 95 % within
/// 1.54 here, above the thresholds of k_s = 0. In units of [`softer_by`] these thresholds hold.
#[test]
fn random_chains_with_switching_stay_bounded_and_as_close_as_the_implicit_saturation_allows() {
    let (mut plain, mut in_units) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    let mut matched = Vec::new();
    // Numbers of chains that stay within the layer at the end, and that leave it.
    let (mut within, mut beyond) = (0, 0);
    for seed in 40_000..40_060 {
        let mut rng = Rng::new(seed);
        let drawn = case(&mut rng);
        let case = switching(drawn, &mut rng);
        let found = ultimates(&case, &Model::linear(&case.plant.a, case.plant.b));
        let [sampled, continuous] = found.unwrap_or_else(|| panic!("seed {seed} ran away: {case:?}"));
        *(if continuous.0 < case.spec.epsilon { &mut within } else { &mut beyond }) += 1;
        let ratios = [sampled.0 / continuous.0, sampled.1 / continuous.1];
        let softer_by = softer_by(&case.spec);
        if is_mismatched(&case) {
            for (which, ratio) in ratios.into_iter().enumerate() {
                plain[which].push(ratio);
                in_units[which].push(ratio / softer_by);
            }
        } else {
            matched.extend(ratios.map(|ratio| ratio / softer_by));
        }
    }
    assert!(within >= 15 && beyond >= 15, "both sides of the layer: {within} and {beyond}");
    for (what, ratios) in ["sigma*, switching", "y, switching"].into_iter().zip(&plain) {
        spread(what, ratios);
    }
    assert!(in_units[0].len() >= 40, "{} chains", in_units[0].len());
    let [median, sigma_star, _] = spread("sigma*, switching, in units of the slopes' ratio", &in_units[0]);
    // With the printed saturation the median would be 0.88.
    assert!((median - 1.0).abs() <= 0.02, "sigma* median {median}");
    let [_, y, _] = spread("y, switching, in units of the slopes' ratio", &in_units[1]);
    assert!(sigma_star <= 1.20, "sigma* 95 % {sigma_star}");
    assert!(y <= 1.06, "y 95 % {y}");
    let [_, _, largest] = spread("both, switching, matched only, in units of the slopes' ratio", &matched);
    assert!(largest <= 2.0, "{largest}");
}

/// The thresholds of the linear chains also hold here.
#[test]
fn random_chains_with_a_nonlinear_model_stay_bounded_and_close_to_the_continuous_loop() {
    let (mut mismatched, mut matched) = ([Vec::new(), Vec::new()], Vec::new());
    for seed in 50_000..50_060 {
        let mut rng = Rng::new(seed);
        let drawn = case(&mut rng);
        let (case, model) = nonlinear(drawn, &mut rng);
        let found = ultimates(&case, &model);
        let [sampled, continuous] = found.unwrap_or_else(|| panic!("seed {seed} ran away: {case:?}, {model:?}"));
        let ratios = [sampled.0 / continuous.0, sampled.1 / continuous.1];
        if is_mismatched(&case) {
            (0..2).for_each(|k| mismatched[k].push(ratios[k]));
        } else {
            matched.extend(ratios);
        }
    }
    assert!(mismatched[0].len() >= 40, "{} chains", mismatched[0].len());
    let [_, sigma_star, _] = spread("sigma*, nonlinear", &mismatched[0]);
    let [_, y, _] = spread("y, nonlinear", &mismatched[1]);
    assert!(sigma_star <= 1.20, "sigma* 95 % {sigma_star}");
    assert!(y <= 1.06, "y 95 % {y}");
    let [_, _, largest] = spread("both, nonlinear, matched only", &matched);
    assert!(largest <= 2.0, "{largest}");
}

fn stiff() -> JointChain {
    JointParameters::TABLE_I.chain(Reading::Stiff)
}

/// With lambda T = 4.8 at 1 ms and 242 at 50 ms; forward Euler diverges from 0.7 ms on.
#[test]
fn stiff_joint_stays_bounded_up_to_50_milliseconds() {
    let plant = FlexibleJoint::of_the_paper(stiff());
    for period_s in [1e-3, 5e-3, 10e-3, 20e-3, 35e-3, 50e-3] {
        let spec = Spec { period_s, ..joint_spec(Reading::Stiff, 10.0) };
        let trace = joint(&plant, spec, PortPrecision::F32).trace();
        let [early, late] = [[5.0, 12.5], [12.5, 20.0]].map(|window_s| ultimate(&trace, window_s, |row| row.x[0]));
        println!("T = {period_s}: |y| {early:.3e} then {late:.3e}");
        assert!(is_bounded(&trace), "T = {period_s}");
        // Bounded, not only finite: the second half is no larger, and the joint is held near 0.
        assert!(late <= 1.05 * early && late < 0.1, "T = {period_s}: {early} then {late}");
    }
}

/// Returns the relative error of the sampled loop's ultimate sigma* against the continuous loop's, for `stiff` with
/// observers of order 3 and poles at -200.
fn stiff_with_fast_observers(k_l: f64, periods_s: &[f64]) -> Vec<f64> {
    let plant = FlexibleJoint::of_the_paper(stiff());
    let JointChain { k2, b2, b, a1, .. } = stiff();
    let a_b = move |x: &[f64]| (a1 * x[0] - k2 * x[2] - b2 * x[3], b);
    let gains = Gains::from_bandwidth(200.0, 3);
    let observers = vec![None, Some(gains.clone()), None, Some(gains)];
    let spec = Spec { observers, ..joint_spec(Reading::Stiff, k_l) };
    // b_2 = 4833 1/s: Runge-Kutta in steps of 50 us is stable, and 20 us change the tenth digit.
    let reference = joint(&plant, spec.clone(), PortPrecision::F64);
    let (continuous, _) = reference.continuous_ultimate(&a_b, 10.0, 5e-5);
    let gap = |&period_s: &f64| {
        let trace = joint(&plant, Spec { period_s, ..spec.clone() }, PortPrecision::F32).trace();
        let found = ultimate(&trace, [10.0, 20.0], |row| row.sigma_star);
        let gap = relative(found, continuous);
        println!("k_l = {k_l}, T = {period_s}: {found:.6e} for {continuous:.6e}, off by {gap:.3e}");
        gap
    };
    periods_s.iter().map(gap).collect()
}

#[test]
fn stiff_joint_with_fast_observers_shows_the_continuous_sigma_star() {
    for gap in stiff_with_fast_observers(10.0, &[1e-3, 5e-4, 2.5e-4]) {
        assert!(gap <= 0.005, "{gap:e}");
    }
}

/// The threshold of half a percent belongs to k_l = 10. At 50 and 100 sigma* is 20 and 50 times smaller. The held u
/// leaves 0.7 % and 0.6 % of it inside a tick at 1 ms, so the threshold is *not* met there. The gap closes only as T
/// b_2 falls below 1 (b_2 = 4833 1/s, so below 0.2 ms). 0.5 % is met at 0.25 ms; in f64 the error is 0.1 % at 50 us.
#[test]
fn stiff_joint_at_k_l_50_and_100_misses_half_a_percent_at_1_ms_and_meets_it_at_a_quarter() {
    for (k_l, bar) in [(50.0, 0.007), (100.0, 0.0065)] {
        let gaps = stiff_with_fast_observers(k_l, &[1e-3, 2.5e-4]);
        assert!(gaps[0] > 0.005, "k_l = {k_l}: {:e} keeps the bar now: join the test above", gaps[0]);
        assert!(gaps[0] <= bar, "k_l = {k_l}: {:e}", gaps[0]);
        assert!(gaps[1] <= 0.005, "k_l = {k_l}: {:e}", gaps[1]);
    }
}

/// The observers get u after the clamp, which is the complete anti-windup. `stiff`, k_l = 10.
#[test]
fn start_up_with_u_limited_to_100_settles_below_a_hundredth_of_a_radian_within_2_2_seconds() {
    let plant = FlexibleJoint::of_the_paper(stiff());
    let gains = Gains::from_bandwidth(50.0, 3);
    let observers = vec![None, Some(gains.clone()), None, Some(gains)];
    let free = Spec { observers, ..joint_spec(Reading::Stiff, 10.0) };
    let limited = Spec { limit: 100.0, ..free.clone() };
    let trace = joint(&plant, limited, PortPrecision::F32).trace();
    let metrics = measure(&trace, [10.0, 20.0], 0.01);
    println!("settled after {:?} s, |u| {}", metrics.settling_time_s, metrics.u_peak);
    assert_eq!(metrics.u_peak, 100.0, "the limit must bite");
    assert!(metrics.settling_time_s.is_some_and(|t_s| t_s <= 2.2), "{:?}", metrics.settling_time_s);

    // An actuator that clamps and reports it gives an equal result.
    let mut clamp = Limited::new(actuator::Ideal, -100.0, 100.0);
    let trace = joint(&plant, free.clone(), PortPrecision::F32).trace_through(&mut sensor::Ideal, &mut clamp);
    assert_eq!(measure(&trace, [10.0, 20.0], 0.01).settling_time_s, metrics.settling_time_s);

    // An actuator that clamps without a report never settles.
    let Spec { period_s, .. } = free;
    let model = Model::linear(&free.gradient, free.input_gain);
    let mut shipped = controller(&free, &model, 3, Precision::Single).expect("a valid design");
    let mut x = [0.1, 0.0, 0.0, 0.0];
    assert!(shipped.start(&x));
    let mut outside_s = 0.0;
    for k in 0..20_000 {
        let t = f64::from(k) * period_s;
        let u = shipped.tick(&x).u.clamp(-100.0, 100.0);
        if x[0].abs() > 0.01 {
            outside_s = t;
        }
        advance(&plant, t, t + period_s, u, &mut x).expect("a plant that can be integrated");
    }
    assert!(outside_s > 19.0, "fed the commanded u it settled after {outside_s} s");
}

/// A correct u that arrives late is an error in time, not in the observers' input. Joint, observers of order 2 with
/// poles at -50, k_l = 10. Unreported, sigma* is 1.00 times sigma* of the ideal actuator. Reported, it is 1.44 times
/// for a delay of one tick and 1.13 times for a hold of two.
#[test]
fn a_u_that_is_only_late_is_better_not_reported() {
    let observers = [2, 4].map(|channel| format!("{{channel={channel}, bandwidth_rad_s=50.0, order=2}}")).join(", ");
    let sigma_star = |actuator: &str, report: bool| {
        let sets = [
            format!("controller.observer=[{observers}]"),
            "controller.k_l=10.0".into(),
            actuator.into(),
            format!("actuator.report={report}"),
        ];
        let mut experiment = scenario::load(&scenario_file("default.toml"), &sets).expect("a right file");
        let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
        assert!(error.is_none(), "{error:?}");
        experiment.metrics(&trace).sigma_star_ultimate
    };
    let ideal = sigma_star("actuator.delay_ticks=0", true);
    for (actuator, worse) in [("actuator.delay_ticks=1", 1.4), ("actuator.hold_ticks=2", 1.1)] {
        let [reported, silent] = [true, false].map(|report| sigma_star(actuator, report) / ideal);
        assert!((silent - 1.0).abs() < 0.01 && reported > worse, "{actuator}: {reported} reported, {silent} not");
    }
}

#[test]
fn example_1_part_2_shows_the_continuous_sigma_star() {
    let plant = Benchmark::part_2();
    let a_b = |x: &[f64]| (-2.0 * x[0] - x[1] + x[0].exp(), 1.0);
    let run = complex_disturbance(&plant, 1e-3, PortPrecision::F32);
    let (continuous, _) = run.continuous_ultimate(&a_b, 4.0, 1e-4);
    let found = ultimate(&run.trace(), [4.0, 10.0], |row| row.sigma_star);
    println!("{found} for {continuous}");
    assert!(relative(found, continuous) <= 0.005, "{found} for {continuous}");
}

/// The design may assume half of the slope lambda without harm. A design without any slope on the stiff joint is not
/// required to work.
#[test]
fn half_the_slope_keeps_the_joint_bounded() {
    let plant = FlexibleJoint::of_the_paper(stiff());
    let mut spec = joint_spec(Reading::Stiff, 10.0);
    spec.gradient[3] /= 2.0;
    let mut run: paper::Run<'_> = joint(&plant, spec, PortPrecision::F32);
    // The tick uses the true a(x); only the design assumes half the slope.
    run.model = loop_sim::port::in_process::Model::Linear(joint_spec(Reading::Stiff, 10.0).gradient);
    let trace = run.trace();
    assert!(is_bounded(&trace) && ultimate(&trace, [10.0, 20.0], |row| row.x[0]) < 0.01);
}
