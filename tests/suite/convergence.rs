//! Order of convergence in the period T.
//!
//! The observer alone is of second order in T: its innovation integrates the chain by the trapezium rule. The closed
//! loop is of first order, since u is held.

use controller_core::{JointParameters, Reading};
use integration_tests::close::{Gap, order};
use integration_tests::data;
use integration_tests::oracle::{Gains, Model, Spec, power};
use integration_tests::paper::{complex_disturbance, joint, joint_spec};
use integration_tests::shape::{Precision, controller};
use integration_tests::truth::rk4;
use loop_sim::plant::{Benchmark, FlexibleJoint, JointErrors};
use loop_sim::port::in_process::Precision as PortPrecision;
use loop_sim::trace::Trace;

fn disturbance(t: f64) -> f64 {
    (2.0 * t).cos() + 0.3 * t
}

/// Returns x_1 of x_1' = x_2 + d with x_2 = 5 sin 3t, d = cos 2t + 0.3t.
fn measured(t: f64) -> [f64; 2] {
    let x1 = 5.0 / 3.0 * (1.0 - (3.0 * t).cos()) + (2.0 * t).sin() / 2.0 + 0.15 * t * t;
    [x1, 5.0 * (3.0 * t).sin()]
}

/// Returns the largest |d_hat - continuous d_hat| over 5..10 s; Runge-Kutta integrates the continuous observer z' = D z
/// + l d.
fn observer_error(gains: &Gains, period_s: f64) -> f64 {
    let (spec, model) = (Spec::observing(1, gains.clone(), period_s), Model::linear(&[0.0, 0.0], 1.0));
    let mut shipped = controller(&spec, &model, 3, Precision::Double).expect("a valid design");
    assert!(shipped.start(&measured(0.0)));
    let l = &gains.l;
    let mut z = vec![0.0; l.len()];
    let mut worst: f64 = 0.0;
    let ticks = (10.0 / period_s).round() as usize;
    for k in 0..=ticks {
        let t = k as f64 * period_s;
        shipped.tick(&measured(t));
        if 2 * k >= ticks {
            worst = worst.max((shipped.estimates()[0][0] - z[0]).abs());
        }
        // Pole times step is at most 0.01, so the integration error is below 1e-12.
        let steps = (period_s * 2e4).ceil() as usize;
        rk4(t, t + period_s, steps, &mut z, &mut |t, z, rate| {
            for m in 0..l.len() {
                rate[m] = l[m] * (disturbance(t) - z[0]) + if m + 1 < l.len() { z[m + 1] } else { 0.0 };
            }
        });
    }
    worst
}

#[test]
fn observer_alone_is_of_second_order_in_the_period() {
    // Well damped, because the printed gains of Example 2 have a pole at -0.2 that has not settled after 10 s.
    let well_damped = [
        Gains::from_bandwidth(50.0, 1),
        Gains::from_bandwidth(50.0, 2),
        Gains::from_bandwidth(50.0, 3),
        Gains::from_poles(&[(-30.0, 15.0), (-30.0, -15.0), (-50.0, 0.0)]),
    ];
    for gains in well_damped {
        let errors = [2e-3, 1e-3, 5e-4].map(|period_s| observer_error(&gains, period_s));
        for pair in errors.windows(2) {
            let found = order(pair[0], pair[1], 2.0);
            println!("{:?}: order {found:.4} {errors:?}", gains.poles);
            assert!((1.95..=2.05).contains(&found), "{:?}: order {found}, errors {errors:?}", gains.poles);
        }
    }
}

#[test]
fn observer_at_one_millisecond_is_within_5e_6_of_the_continuous_one() {
    for (omega, r) in [(50.0, 2), (50.0, 3), (200.0, 3)] {
        let error = observer_error(&Gains::from_bandwidth(omega, r), 1e-3);
        println!("poles at -{omega}, r = {r}: {error:e}");
        assert!(error <= 5e-6, "poles at -{omega}, r = {r}: {error:e}");
    }
}

/// d = 0.7 + .. of degree r - 1 in channel 1 and in channel 2, where u is held between the ticks.
#[test]
fn polynomial_disturbance_of_degree_below_the_order_leaves_no_steady_error() {
    let coefficients = [0.7, -0.4, 0.3];
    for r in 1..=3 {
        let d = |t: f64| (0..r).map(|m| coefficients[m] * power(t, m)).sum::<f64>();
        let integral = |t: f64| (0..r).map(|m| coefficients[m] * power(t, m + 1) / (m + 1) as f64).sum::<f64>();
        for channel in [1, 2] {
            let period_s = 1e-2;
            let spec = Spec::observing(channel, Gains::from_bandwidth(20.0, r), period_s);
            let model = Model::linear(&[0.0, 0.0], 1.0);
            let mut shipped = controller(&spec, &model, 3, Precision::Double).expect("a valid design");
            // x_2 = 1/2 + t/4 (channel 1) is integrated exactly by the trapezium rule; in channel 2 u alternates.
            let (mut driven, mut u, mut worst) = (0.0, 0.0, 0.0_f64);
            for k in 0..400_u32 {
                let t = f64::from(k) * period_s;
                let x = if channel == 1 {
                    [t / 2.0 + t * t / 8.0 + integral(t), 0.5 + t / 4.0]
                } else {
                    [0.0, driven + integral(t)]
                };
                if k == 0 {
                    assert!(shipped.start(&x));
                } else {
                    shipped.report_applied(u);
                }
                shipped.tick(&x);
                u = if k % 2 == 0 { 0.25 } else { -0.5 };
                driven += u * period_s;
                if t >= 3.0 {
                    let error = shipped.estimates()[channel - 1][0] - d(t);
                    worst = worst.max(error.abs());
                }
            }
            println!("r = {r}, channel {channel}: {worst:e}");
            assert!(worst <= 1e-12, "r = {r}, channel {channel}: {worst:e}");
        }
    }
}

/// Returns the largest |result - reference| at the rows of a reference trajectory, per column (y, sigma*, u), over t >=
/// `from_s`. The unit is the column's maximum.
fn distance(trace: &Trace, reference: &[[f64; 4]], from_s: f64) -> [f64; 3] {
    let mut gaps = [Gap::default(); 3];
    for [t, y, sigma_star, u] in reference {
        let k = (t / trace.period_s).round() as usize;
        let row = &trace.rows[k];
        assert!((row.t_s - t).abs() < 1e-9, "every row of the reference falls on a tick");
        if *t >= from_s {
            gaps[0].add(row.x[0], *y);
            gaps[1].add(row.sigma_star, *sigma_star);
            gaps[2].add(row.u, *u);
        }
    }
    gaps.map(|gap| gap.relative())
}

fn tends_to(name: &str, columns: [&str; 4], period_s: f64, trace_at: &dyn Fn(f64) -> Trace) {
    let reference = data::columns(name, columns);
    let [coarse, fine] = [period_s, period_s / 2.0].map(|period_s| distance(&trace_at(period_s), &reference, 1.0));
    println!("{name}: T = {period_s}: {coarse:?}; T/2: {fine:?}");
    for ((coarse, fine), what) in coarse.into_iter().zip(fine).zip(["y", "sigma*", "u"]) {
        let found = order(coarse, fine, 2.0);
        assert!((0.9..=1.1).contains(&found), "{name}, {what}: order {found} ({coarse:e}, {fine:e})");
        assert!(fine <= 0.02, "{name}, {what}: {fine:e}");
    }
}

#[test]
fn flexible_joint_tends_to_the_reference_trajectories_at_first_order() {
    const COLUMNS: [&str; 4] = ["t", "x1", "sigma_star", "u"];
    let nominal = JointParameters::TABLE_I.chain(Reading::Reconstructed);
    let trace = |off: f64, k_l: f64, k_s: f64, l: &[f64], period_s: f64| {
        let plant = FlexibleJoint::new(
            nominal,
            JointErrors::uniform(off),
            FlexibleJoint::input_of_the_paper(),
            Default::default(),
        );
        let gains = Some(Gains::printed(l));
        let observers = vec![None, gains.clone(), None, gains];
        let spec = Spec { period_s, k_s, observers, ..joint_spec(Reading::Reconstructed, k_l) };
        joint(&plant, spec, PortPrecision::F64).trace()
    };
    let r2 = [100.0, 20.0];
    let r3 = [1000.0, 300.0, 30.0];
    for (name, off, k_l, k_s, l) in [
        ("ex2_reconstructed_d0_r2_kl10_ks0.csv", 0.0, 10.0, 0.0, &r2[..]),
        ("ex2_reconstructed_d0_r2_kl50_ks0.csv", 0.0, 50.0, 0.0, &r2),
        ("ex2_reconstructed_d0_r2_kl100_ks0.csv", 0.0, 100.0, 0.0, &r2),
        ("ex2_reconstructed_d0_r2_kl10_ks0.5.csv", 0.0, 10.0, 0.5, &r2),
        ("ex2_reconstructed_d0_r2_kl10_ks1.csv", 0.0, 10.0, 1.0, &r2),
        ("ex2_reconstructed_d0_r3_kl10_ks0.csv", 0.0, 10.0, 0.0, &r3),
        ("ex2_reconstructed_dm50_r2_kl10_ks0.csv", -0.5, 10.0, 0.0, &r2),
    ] {
        // At k_l = 100 the first-order part nearly cancels in y; it dominates at shorter periods only.
        let period_s = if k_l == 100.0 { 1e-4 } else { 2e-4 };
        tends_to(name, COLUMNS, period_s, &|period_s| trace(off, k_l, k_s, l, period_s));
    }
}

#[test]
fn benchmark_tends_to_the_reference_trajectory_at_first_order() {
    let plant = Benchmark::part_2();
    let trace = |period_s: f64| complex_disturbance(&plant, period_s, PortPrecision::F64).trace();
    tends_to("ex1_p2_prop_r2_l100_20_kl50.csv", ["t", "x1", "sigma_star", "u"], 2e-4, &trace);
}
