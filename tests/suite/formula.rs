//! Agreement of the shipped formula with the printed one.
//!
//! The shipped tick is folded for speed; the plain transcription (`oracle`) and the continuous controller (`printed`)
//! are not. All three must agree: the folded tick with the plain one to rounding, both with the print as T -> 0.

use controller_core::{
    Config, Fallback, FlexibleJoint, Health, JointParameters, Limits, Nominal, NominalModel, ObserverGains, Options,
    Pole, ReachingLaw, Reading, Surface,
};
use integration_tests::close::{Gap, order};
use integration_tests::oracle::{Gains, Model, Oracle, Spec, power};
use integration_tests::printed::{self, Printed};
use integration_tests::shape::{Precision, SHAPES, controller};
use integration_tests::strategy::{Case, Rng, any_design, case};
use integration_tests::truth::{ExactStep, rk4};
use loop_sim::plant::{Benchmark, Plant};

/// Threshold for rounding alone: some 50 operations per tick, sums of terms up to 1e4 times the result (differences
/// over T), over a few hundred ticks. Measured: 4e-12 on random samples, 5e-14 in closed loops.
const FOLDING_BAR: f64 = 1e-10;

struct Gaps {
    u: Gap,
    sigma: Gap,
    sigma_star: Gap,
    estimate: Gap,
}

impl Gaps {
    fn new() -> Self {
        Self { u: Gap::default(), sigma: Gap::default(), sigma_star: Gap::default(), estimate: Gap::default() }
    }

    fn worst(&self) -> f64 {
        // sigma* is a difference of sigma and its offset: its own scale may be tiny.
        let star = self.sigma_star.difference / self.sigma.scale;
        self.estimate.relative().max(self.u.relative()).max(self.sigma.relative()).max(if star.is_nan() {
            0.0
        } else {
            star
        })
    }
}

/// Runs both on a list of samples and returns the largest relative gap. A sample may carry the share of the last u that
/// the actuator applied.
fn compare(spec: &Spec, model: &Model, capacity: usize, guess: &[f64], samples: &[(Vec<f64>, Option<f64>)]) -> f64 {
    let mut shipped = controller(spec, model, capacity, Precision::Double).expect("a valid design");
    let mut oracle = Oracle::new(spec, model);
    oracle.guess(guess);
    let n = spec.order();
    let mut u = 0.0;
    let mut gaps = Gaps::new();
    assert!(shipped.start_from(&samples[0].0, guess));
    for (x, share) in samples {
        if let Some(share) = share {
            shipped.report_applied(share * u);
            oracle.applied = share * u;
        }
        let (one, other) = (shipped.tick(x), oracle.tick(x));
        u = other.u;
        assert!(!one.health.contains(Health::INPUT_REJECTED), "the samples of this test are plausible: {x:?}");
        gaps.u.add(one.u, other.u);
        gaps.sigma.add(one.sigma, other.sigma);
        gaps.sigma_star.add(one.sigma_star, other.sigma_star);
        let estimates = shipped.estimates();
        for i in 0..n {
            let expected = oracle.estimate(i);
            for m in 0..3 {
                // A derivative counts by its contribution to one tick, which is a difference of samples.
                let unit = power(spec.period_s, m);
                gaps.estimate.add(estimates[i][m] * unit, expected[m] * unit);
            }
        }
    }
    gaps.worst()
}

#[test]
fn folded_tick_equals_the_plain_transcription() {
    let mut worst: f64 = 0.0;
    for (shape, &(n, capacity, mask)) in SHAPES.iter().enumerate() {
        for case in 0..8 {
            let seed = (shape * 8 + case) as u64;
            let mut rng = Rng::new(seed);
            let (mut spec, model) = any_design(&mut rng, n, capacity, mask);
            let scale = rng.spread(0.01, 10.0);
            let rate = 0.1 / spec.period_s;
            let limited = rng.chance(0.3);
            let guess: Vec<f64> = (0..n).map(|_| rng.within(-1.0, 1.0)).collect();
            let reports = rng.chance(0.5);
            let samples: Vec<_> = (0..60)
                .map(|_| {
                    let unit = |j: usize| scale * power(1.0 / rate, n - 1 - j);
                    let x: Vec<f64> = (0..n).map(|j| unit(j) * rng.within(-1.0, 1.0)).collect();
                    (x, reports.then(|| rng.within(0.0, 1.0)))
                })
                .collect();
            if limited {
                // The limit is tight enough to act now and then.
                let mut free = Oracle::new(&spec, &model);
                free.guess(&guess);
                let largest = samples.iter().map(|(x, _)| free.tick(x).u.abs()).fold(0.0, f64::max);
                spec.limit = 0.1 * largest;
            }
            let gap = compare(&spec, &model, capacity, &guess, &samples);
            worst = worst.max(gap);
            assert!(gap <= FOLDING_BAR, "n = {n}, R = {capacity}, mask {mask:#b}, seed {seed}: {gap:e}\n{spec:?}");
        }
    }
    println!("largest relative gap {worst:e}");
}

/// Each controller closes its own loop. On a common plant each would see the other's rounding of u as a disturbance and
/// integrate it.
#[test]
fn folded_loop_equals_the_plain_loop() {
    let mut worst: f64 = 0.0;
    for seed in 0..60 {
        let Case { spec, plant, x0, ticks } = case(&mut Rng::new(seed));
        let model = Model::linear(&plant.a, plant.b);
        let step = ExactStep::new(&plant, spec.period_s);
        let mut shipped = controller(&spec, &model, 3, Precision::Double).expect("a valid design");
        let mut oracle = Oracle::new(&spec, &model);
        let (mut x, mut x_oracle) = (x0.clone(), x0);
        assert!(shipped.start(&x));
        let (mut gap_u, mut gap_y) = (Gap::default(), Gap::default());
        for k in 0..ticks {
            let (one, other) = (shipped.tick(&x), oracle.tick(&x_oracle));
            gap_u.add(one.u, other.u);
            gap_y.add(x[0], x_oracle[0]);
            step.advance(k, one.u, &mut x);
            step.advance(k, other.u, &mut x_oracle);
        }
        let gap = gap_u.relative().max(gap_y.relative());
        worst = worst.max(gap);
        assert!(gap <= FOLDING_BAR, "seed {seed}: {gap:e}\n{spec:?}");
    }
    println!("largest relative gap {worst:e}");
}

#[test]
fn lost_samples_are_bridged_as_in_the_plain_transcription() {
    for (shape, &(n, capacity, mask)) in SHAPES.iter().enumerate() {
        let seed = 30_000 + shape as u64;
        let mut rng = Rng::new(seed);
        let (spec, model) = any_design(&mut rng, n, capacity, mask);
        let mut shipped = controller(&spec, &model, capacity, Precision::Double).expect("a valid design");
        let mut oracle = Oracle::new(&spec, &model);
        let (mut gap, mut held) = (Gap::default(), 0.0);
        for k in 0..60 {
            let unit = |j: usize| power(10.0 * spec.period_s, n - 1 - j);
            let x: Vec<f64> = (0..n).map(|j| unit(j) * rng.within(-1.0, 1.0)).collect();
            if k == 0 {
                assert!(shipped.start(&x));
            } else if rng.chance(0.2) {
                let tick = shipped.tick(&vec![f64::NAN; n]);
                assert_eq!((tick.u, tick.health), (held, Health::INPUT_REJECTED));
                oracle.lost();
                continue;
            }
            let (one, other) = (shipped.tick(&x), oracle.tick(&x));
            gap.add(one.u, other.u);
            held = one.u;
        }
        assert!(gap.relative() <= FOLDING_BAR, "n = {n}, R = {capacity}, mask {mask:#b}, seed {seed}: {gap:?}");
    }
}

#[test]
fn capacity_above_the_order_changes_nothing_but_rounding() {
    for seed in 0..20 {
        let mut rng = Rng::new(seed);
        let (spec, model) = any_design(&mut rng, 2, 1, 0b11);
        let mut narrow = controller(&spec, &model, 1, Precision::Double).expect("a valid design");
        let mut wide = controller(&spec, &model, 3, Precision::Double).expect("a valid design");
        let mut gap = Gap::default();
        let mut x = [rng.within(-1.0, 1.0), rng.within(-10.0, 10.0)];
        assert!(narrow.start(&x) && wide.start(&x));
        for _ in 0..100 {
            gap.add(wide.tick(&x).u, narrow.tick(&x).u);
            x = [rng.within(-1.0, 1.0), rng.within(-10.0, 10.0)];
        }
        // The absent rows add exact zeros.
        assert!(gap.relative() <= 1e-15, "seed {seed}: {gap:?}");
    }
}

/// Smooth signals at shorter and shorter periods: the tick's u against Eq. (51) on the tick's own estimates.
#[test]
fn control_tends_to_the_printed_law_at_first_order_as_the_period_shrinks() {
    for (shape, &(n, capacity, mask)) in SHAPES.iter().enumerate() {
        let mut rng = Rng::new(20_000 + shape as u64);
        let gains = |rng: &mut Rng, i: usize| {
            (mask >> i & 1 == 1).then(|| {
                let order = rng.integer((n - 1 - i).max(1), capacity);
                Gains::from_poles(&rng.poles(20.0, order))
            })
        };
        let mut spec = Spec {
            period_s: 0.0,
            c: integration_tests::strategy::surface(&rng.poles(5.0, n - 1)),
            alpha: 2.0,
            k_l: 30.0,
            k_s: 3.0,
            epsilon: 0.5,
            gradient: (0..n).map(|_| rng.within(-20.0, 20.0)).collect(),
            input_gain: 2.5 * rng.sign(),
            observers: (0..n).map(|i| gains(&mut rng, i)).collect(),
            limit: 1e12,
        };
        let model = Model { row: spec.gradient.clone(), bend: 1.0, input_gain: spec.input_gain, swing: 0.3 };
        let omegas: Vec<f64> = (0..n).map(|_| rng.within(1.0, 4.0)).collect();
        let mut error_at = |period_s: f64| {
            spec.period_s = period_s;
            let mut shipped = controller(&spec, &model, capacity, Precision::Double).expect("a valid design");
            let mut gap = Gap::default();
            let mut offset = 0.0;
            let ticks = (0.5 / period_s).round() as usize;
            for k in 0..=ticks {
                let t = k as f64 * period_s;
                let x: Vec<f64> = omegas.iter().map(|omega| (omega * t + 0.3).sin()).collect();
                if k == 0 {
                    assert!(shipped.start(&x));
                }
                let tick = shipped.tick(&x);
                if k == 0 {
                    offset = tick.sigma;
                }
                let w = offset * (-spec.alpha * t).exp();
                let law = printed::law(&spec, (model.a(&x), model.b(&x)), &x, &shipped.estimates(), w);
                if k > ticks / 2 {
                    gap.add(tick.u, law.u);
                    assert!((tick.sigma - law.sigma).abs() <= 1e-9 * (1.0 + law.sigma.abs()), "Eq. (44)");
                }
            }
            gap.relative()
        };
        let (coarse, fine) = (error_at(4e-4), error_at(1e-4));
        let found = order(coarse, fine, 4.0);
        let shape = format!("n = {n}, R = {capacity}, mask {mask:#b}");
        assert!(fine < 0.02, "{shape}: {fine:e}");
        assert!((0.85..1.15).contains(&found), "{shape}: order {found} ({coarse:e}, {fine:e})");
    }
}

/// Example 1 with its own two-state formulas, written out one by one as in the paper's section III.
#[test]
fn for_n_2_the_general_law_is_the_special_one_of_section_3() {
    let (c1, alpha, k_l, k_s, epsilon, l11, l12) = (5.0, 1.0, 50.0, 0.4, 0.1, 100.0, 20.0);
    let spec = Spec {
        period_s: 1e-3,
        c: vec![c1, 1.0],
        alpha,
        k_l,
        k_s,
        epsilon,
        gradient: vec![0.0, -1.0],
        input_gain: 1.0,
        observers: vec![Some(Gains::printed(&[l11, l12])), None],
        limit: 1e12,
    };
    let model = |x: &[f64]| (-2.0 * x[0] - x[1] + x[0].exp(), 1.0);
    let plant = Benchmark::part_2();
    let mut general = Printed::start(&spec, &model, &[1.0, 0.0]);

    // [x1, x2, p11, p12]; sigma(0) = c1 since the estimates start at zero.
    let sigma_0 = c1;
    let special = |t_s: f64, state: &[f64]| {
        let [x1, x2, p11, p12] = *state else { panic!("four states") };
        let d_hat = p11 + l11 * x1; // Eq. (3)
        let d_hat_dot = p12 + l12 * x1; // Eq. (5)
        let sigma = x2 + c1 * x1 + d_hat; // Eq. (18)
        let offset = sigma_0 * (-alpha * t_s).exp();
        let sigma_star = sigma - offset; // Eq. (17)
        let (a, b) = model(&[x1, x2]);
        let sat = (sigma_star / epsilon).clamp(-1.0, 1.0);
        let u = -(a + c1 * x2 + c1 * d_hat + alpha * offset) / b - (k_l * sigma_star + k_s * sat) / b; // Eq. (20)
        let p11_dot = -l11 * (x2 + d_hat) + d_hat_dot; // Eq. (4)
        let p12_dot = -l12 * (x2 + d_hat); // Eq. (6)
        (u, sigma_star, [p11_dot, p12_dot], d_hat)
    };
    let mut state = [1.0, 0.0, -l11, -l12];
    let (mut gap_u, mut gap_star) = (Gap::default(), Gap::default());
    for k in 0..500_u32 {
        let (from, to) = (f64::from(k) * 1e-2, f64::from(k + 1) * 1e-2);
        let (u, sigma_star, ..) = special(from, &state);
        let now = general.now();
        gap_u.add(u, now.u);
        gap_star.add(sigma_star, now.sigma_star);

        // Eq. (21): sigma*' = -k_l sigma* - k_s sat + c1 d_tilde + d/dt d_hat, whatever the disturbance.
        let mut rate = |t_s: f64, state: &[f64], out: &mut [f64]| {
            let (u, _, p_dot, _) = special(t_s, state);
            plant.rhs(t_s, &state[..2], u, &mut out[..2]);
            out[2..].copy_from_slice(&p_dot);
        };
        let mut dot = [0.0; 4];
        rate(from, &state, &mut dot);
        let (_, _, _, d_hat) = special(from, &state);
        let d_hat_rate = dot[2] + l11 * dot[0];
        let measured = dot[1] + c1 * dot[0] + d_hat_rate + alpha * sigma_0 * (-alpha * from).exp();
        let mut d = [0.0; 2];
        plant.lumped(from, &state[..2], u, &mut d);
        let d_tilde = d[0] - d_hat;
        let sat = (sigma_star / epsilon).clamp(-1.0, 1.0);
        let claimed = -k_l * sigma_star - k_s * sat + c1 * d_tilde + d_hat_rate;
        assert!((measured - claimed).abs() <= 1e-10 * (1.0 + claimed.abs()), "Eq. (21) at {from} s");

        rk4(from, to, 20, &mut state, &mut rate);
        general.advance(&|t, x, u, dx| plant.rhs(t, x, u, dx), to, 20);
    }
    assert!(gap_u.relative() <= 1e-11 && gap_star.relative() <= 1e-11, "{gap_u:?} {gap_star:?}");
}

/// Compile-time and run-time floating point agree: a controller in flash equals the simulated one.
#[test]
fn design_in_const_equals_the_design_at_run_time_bit_for_bit() {
    type Joint<T> = controller_core::controller!(T, FlexibleJoint<T>, order 4, observers of order 3 in [2, 4]);
    const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Stiff).nominal();
    const CONFIG: Config<4, 3> = Config {
        period_s: 1e-3,
        surface: Surface::from_bandwidth(5.0, 1.0),
        observers: [
            None,
            Some(ObserverGains::from_poles([Pole { re: -40.0, im: 30.0 }, Pole { re: -40.0, im: -30.0 }])),
            None,
            Some(ObserverGains::from_bandwidth::<3>(200.0)),
        ],
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 },
        nominal: NOMINAL,
        options: Options::NEUTRAL
            .with_limits(Limits::symmetric(100.0))
            .with_fallback(Fallback::Safe(0.0))
            .with_sigma_star_bound(1.0),
    };
    const SINGLE: Joint<f32> = Joint::<f32>::design(&CONFIG, FlexibleJoint::<f32>::new(&NOMINAL));
    const DOUBLE: Joint<f64> = Joint::<f64>::design(&CONFIG, FlexibleJoint::<f64>::new(&NOMINAL));

    // `black_box` keeps the optimiser from designing at compile time again.
    let config = std::hint::black_box(CONFIG);
    let nominal = std::hint::black_box(NOMINAL);
    let single = Joint::<f32>::try_design(&config, FlexibleJoint::<f32>::new(&nominal)).expect("a valid design");
    let double = Joint::<f64>::try_design(&config, FlexibleJoint::<f64>::new(&nominal)).expect("a valid design");
    // Debug prints the shortest decimal that reads back to the same bits, of every coefficient.
    assert_eq!(format!("{SINGLE:?}"), format!("{single:?}"));
    assert_eq!(format!("{DOUBLE:?}"), format!("{double:?}"));
    assert_ne!(format!("{SINGLE:?}"), format!("{DOUBLE:?}"));
}

#[test]
fn nominal_benchmark_is_eq_59() {
    let model = controller_core::Benchmark::<controller_core::Libm>::new();
    for x in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-0.7, 2.5]] {
        let eq_59 = -2.0 * x[0] - x[1] + f64::exp(x[0]);
        let drift: f64 = model.drift(&x);
        assert!((drift - eq_59).abs() < 1e-14 && model.gain_ratio(&x).is_none(), "{x:?}: {drift}, not {eq_59}");
    }
}
