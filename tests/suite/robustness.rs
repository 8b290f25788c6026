//! Does the scheme hold where the designer's numbers are reasonable, and beyond?

use controller_core::{JointChain, JointParameters, Reading};
use host_sim::actuator::{self, Limited};
use host_sim::metrics::{measure, ultimate};
use host_sim::plant::{Benchmark, FlexibleJoint};
use host_sim::port::in_process::Precision as PortPrecision;
use host_sim::sensor;
use host_sim::solver::advance;
use integration_tests::close::{quantile, relative};
use integration_tests::oracle::{Gains, Model, Spec};
use integration_tests::paper::{self, complex_disturbance, is_bounded, joint, joint_spec};
use integration_tests::printed::{Printed, nominal};
use integration_tests::shape::{Precision, controller};
use integration_tests::strategy::{Case, Rng, case};
use integration_tests::truth::ExactStep;

/// Ultimate |sigma*| and |y| of the sampled f32 loop and of the continuous one; `None` if the sampled loop ran away.
fn ultimates(case: &Case) -> Option<[(f64, f64); 2]> {
    let Case { spec, plant, x0, ticks } = case;
    let model = Model::linear(&plant.a, plant.b);
    let mut shipped = controller(spec, &model, 3, Precision::Single).expect("a valid design");
    let step = ExactStep::new(plant, spec.period_s);
    let a_b = nominal(&model);
    let mut printed = Printed::start(spec, &a_b, x0);
    let mut x = x0.clone();
    assert!(shipped.start(&x));
    let mut maxima = [(0.0_f64, 0.0_f64); 2];
    // Runge-Kutta needs lambda h < 2.7 to be stable; a tenth of that and less is accurate.
    let steps = 4 + (10.0 * spec.gradient[spec.order() - 1].abs() * spec.period_s) as usize;
    for k in 0..=*ticks {
        let tick = shipped.tick(&x);
        if !tick.u.is_finite() || x.iter().any(|value| !value.is_finite() || value.abs() > 1e9) {
            return None;
        }
        if 2 * k >= *ticks {
            let now = printed.now();
            maxima[0] = (maxima[0].0.max(tick.sigma_star.abs()), maxima[0].1.max(x[0].abs()));
            maxima[1] = (maxima[1].0.max(now.sigma_star.abs()), maxima[1].1.max(printed.x()[0].abs()));
        }
        step.advance(k, tick.u, &mut x);
        let rhs = |t: f64, x: &[f64], u: f64, dx: &mut [f64]| plant.rhs(t, x, u, dx);
        printed.advance(&rhs, (k + 1) as f64 * spec.period_s, steps);
    }
    Some(maxima)
}

fn is_mismatched(case: &Case) -> bool {
    case.spec.observed().any(|(i, _)| i + 1 < case.spec.order())
}

/// Median, 95 % and maximum of a list of ratios, printed.
fn spread(what: &str, ratios: &[f64]) -> [f64; 3] {
    let found = [0.5, 0.95, 1.0].map(|share| quantile(ratios, share));
    println!("{what}: sampled over continuous, {} chains: median, 95 %, max {found:.3?}", ratios.len());
    found
}

/// The bars are for disturbances in mismatched channels, the subject of the scheme. Where only the last channel is
/// disturbed the continuous loop rejects them almost wholly, and the ratio compares two small numbers: there it is
/// bounded by 2 (measured 1.75).
#[test]
fn random_chains_stay_bounded_and_close_to_the_continuous_loop() {
    let (mut mismatched, mut matched) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    for seed in 0..260 {
        let case = case(&mut Rng::new(seed));
        let found = ultimates(&case);
        let [sampled, continuous] = found.unwrap_or_else(|| panic!("seed {seed} ran away: {case:?}"));
        let ratios = if is_mismatched(&case) { &mut mismatched } else { &mut matched };
        ratios[0].push(sampled.0 / continuous.0);
        ratios[1].push(sampled.1 / continuous.1);
    }
    assert!(mismatched[0].len() >= 150, "{} chains", mismatched[0].len());
    let [_, sigma_star, _] = spread("sigma*, mismatched", &mismatched[0]);
    let [_, y, _] = spread("y, mismatched", &mismatched[1]);
    assert!(sigma_star <= 1.20, "sigma* 95 % {sigma_star}");
    assert!(y <= 1.06, "y 95 % {y}");
    for (what, ratios) in ["sigma*, matched only", "y, matched only"].into_iter().zip(&matched) {
        let [_, _, largest] = spread(what, ratios);
        assert!(largest <= 2.0, "{what}: {largest}");
    }
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
        // Bounded, not only not yet infinite: the second half is no larger, and the joint is held near 0.
        assert!(late <= 1.05 * early && late < 0.1, "T = {period_s}: {early} then {late}");
    }
}

/// k_l = 10. (At k_l = 50 and 100 sigma* is 20 and 50 times smaller and 0.7 % and 0.6 % off at 1 ms.)
#[test]
fn stiff_joint_with_fast_observers_shows_the_continuous_sigma_star() {
    let plant = FlexibleJoint::of_the_paper(stiff());
    let JointChain { k2, b2, b, a1, .. } = stiff();
    let a_b = move |x: &[f64]| (a1 * x[0] - k2 * x[2] - b2 * x[3], b);
    let gains = Gains::from_bandwidth(200.0, 3);
    let spec =
        Spec { observers: vec![None, Some(gains.clone()), None, Some(gains)], ..joint_spec(Reading::Stiff, 10.0) };
    // b_2 = 4833 1/s: Runge-Kutta in steps of 50 us is stable, and 20 us change the tenth digit.
    let reference = joint(&plant, spec.clone(), PortPrecision::F64);
    let (continuous, _) = reference.continuous_ultimate(&a_b, 10.0, 5e-5);
    for period_s in [1e-3, 5e-4, 2.5e-4] {
        let trace = joint(&plant, Spec { period_s, ..spec.clone() }, PortPrecision::F32).trace();
        let found = ultimate(&trace, [10.0, 20.0], |row| row.sigma_star);
        let gap = relative(found, continuous);
        println!("T = {period_s}: {found:.6e} for {continuous:.6e}, off by {gap:.2e}");
        assert!(gap <= 0.005, "T = {period_s}: {found:e} for {continuous:e}");
    }
}

/// The observers are fed what the clamp lets through; that is the whole anti-windup. `stiff`, k_l = 10.
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

    // An actuator that clamps by itself and says so is the same.
    let mut clamp = Limited::new(actuator::Ideal, -100.0, 100.0);
    let trace = joint(&plant, free.clone(), PortPrecision::F32).trace_through(&mut sensor::Ideal, &mut clamp);
    assert_eq!(measure(&trace, [10.0, 20.0], 0.01).settling_time_s, metrics.settling_time_s);

    // One that clamps and does not say so never settles.
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

/// The slope lambda is nominal knowledge: half of it is harmless, none at all on the stiff joint is not asked for.
#[test]
fn half_the_slope_keeps_the_joint_bounded() {
    let plant = FlexibleJoint::of_the_paper(stiff());
    let mut spec = joint_spec(Reading::Stiff, 10.0);
    spec.gradient[3] /= 2.0;
    let mut run: paper::Run<'_> = joint(&plant, spec, PortPrecision::F32);
    // The tick's a(x) is the true one; only the design believes in half the slope.
    run.model = host_sim::port::in_process::Model::Linear(joint_spec(Reading::Stiff, 10.0).gradient);
    let trace = run.trace();
    assert!(is_bounded(&trace) && ultimate(&trace, [10.0, 20.0], |row| row.x[0]) < 0.01);
}
