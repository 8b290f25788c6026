//! Is a running controller one value: can it be stored and brought back to the bit, changed for another in motion, and
//! ticked beside others in lanes?

use controller_core::{
    Config, ControlLaw, Controller, Fallback, Guessing, Health, Limits, Linear, Nominal, ObserverGains, Options,
    Output, ReachingLaw, Real, RetuneError, Running, Surface, Words, WordsError, shapes,
};
use integration_tests::oracle::Model;
use integration_tests::shape::UnitModel;
use integration_tests::strategy::Rng;

type Motor = controller_core::controller!(f32, Linear<f32, 2>, order 2, observers of order 2 in [1, 2]);

type Double = controller_core::controller!(f64, Linear<f64, 2>, order 2, observers of order 2 in [1, 2]);

const NOMINAL: Nominal<2> = Nominal { gradient: [0.0, -0.5], input_gain: 250.0 };
const GOOD: Config<2, 2> = Config {
    period_s: 1e-3,
    surface: Surface::from_bandwidth(20.0, 10.0),
    observers: [Some(ObserverGains::from_bandwidth::<2>(80.0)), Some(ObserverGains::from_bandwidth::<2>(60.0))],
    reaching: ReachingLaw { k_l: 80.0, k_s: 0.0, epsilon: 0.01 },
    nominal: NOMINAL,
    options: Options::NEUTRAL.with_limits(Limits::symmetric(10.0)),
};

fn motor(config: &Config<2, 2>) -> Motor {
    Motor::design(config, Linear::<f32, 2>::new(&config.nominal)).expect("a good design")
}

/// A motor that is not the nominal one, under a load: J w' = K_t u - friction - load, stepped by the exact u.
struct Shaft {
    x: [f64; 2],
    t_s: f64,
}

impl Shaft {
    fn advance(&mut self, u: f64, period_s: f64) {
        let steps = 20;
        for _ in 0..steps {
            let h = period_s / f64::from(steps);
            let load = 40.0 * (7.0 * self.t_s).sin() + 15.0;
            self.x[0] += h * self.x[1];
            self.x[1] += h * (300.0 * u - 0.8 * self.x[1] + load);
            self.t_s += h;
        }
    }

    fn sample(&self) -> [f32; 2] {
        self.x.map(|value| value as f32)
    }
}

#[test]
fn words_bring_a_controller_back_to_the_bit_wherever_it_stands() {
    let design = motor(&GOOD);
    let mut rng = Rng::new(0x0A11);
    for ticks in [0, 1, 2, 3, 50] {
        let mut running = Running::guessing(&design, [0.5, -20.0]);
        let mut sample = || [rng.within(-0.1, 0.1) as f32, rng.within(-1.0, 1.0) as f32];
        for k in 0..ticks {
            // The last one is lost: the flag that says so is stored too.
            let x = if k == 3 || k == 49 { [f32::NAN; 2] } else { sample() };
            running.tick(&x);
            running.report_applied(0.75);
        }
        let words: Vec<u32> = running.words().collect();
        let mut again = Running::from_words(*running.design(), words.iter().copied()).expect("words of this design");
        assert!(again.words().eq(words));
        for _ in 0..20 {
            let x = sample();
            let (one, other): (Output<f32>, Output<f32>) = (running.tick(&x), again.tick(&x));
            assert_eq!(
                [one.u, one.sigma, one.sigma_star].map(f32::to_bits),
                [other.u, other.sigma, other.sigma_star].map(f32::to_bits)
            );
            assert_eq!((one.health, running.estimates()), (other.health, again.estimates()));
        }
        // A reset one starts as a new one does, guess and all.
        again.reset();
        let x = sample();
        assert_eq!(again.tick(&x), Running::guessing(&design, [0.5, -20.0]).tick(&x));
    }
}

#[test]
fn words_of_another_design_and_damaged_words_are_refused() {
    let design = motor(&GOOD);
    let mut running = Running::new(&design);
    running.tick(&[0.1, 0.0]);
    let words: Vec<u32> = running.words().collect();
    let other = motor(&Config { reaching: ReachingLaw { k_l: 80.001, ..GOOD.reaching }, ..GOOD });
    let refused = Running::from_words(&other, words.iter().copied()).expect_err("another design");
    let expected = other.fingerprint();
    assert_eq!(refused, WordsError::OtherDesign { expected, found: words[0] });
    let told = refused.to_string();
    assert!(told.contains(&format!("{expected:#010x}")) && told.contains(&format!("{:#010x}", words[0])), "{told}");

    let damaged = |words: &[u32]| Running::from_words(&design, words.iter().copied()).expect_err("damaged");
    for length in 0..words.len() {
        assert_eq!(damaged(&words[..length]), WordsError::Damaged, "{length} words");
    }
    assert_eq!(damaged(&[&words[..], &[0]].concat()), WordsError::Damaged);
    for (at, bad) in [(1, 2), (1, u32::MAX), (2, 2), (2, 256)].into_iter().chain(
        (3..words.len()).flat_map(|at| [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(|bad| (at, bad.to_bits()))),
    ) {
        let mut spoilt = words.clone();
        spoilt[at] = bad;
        assert_eq!(damaged(&spoilt), WordsError::Damaged, "word {at}: {bad:#x}");
    }
}

#[test]
fn whatever_makes_a_design_another_one_makes_its_fingerprint_another_one() {
    let changes: [fn(&mut Config<2, 2>); 13] = [
        |_| (),
        |config| config.period_s = 1.001e-3,
        |config| config.surface.c[0] = 20.001,
        |config| config.surface.alpha_per_s = 10.01,
        |config| config.observers[0] = Some(ObserverGains::from_bandwidth::<2>(80.01)),
        |config| config.observers[1] = Some(ObserverGains::from_bandwidth::<1>(60.0)),
        |config| config.reaching.k_l = 80.01,
        |config| config.reaching.k_s = 1e-3,
        |config| config.nominal.gradient[0] = 1e-3,
        |config| config.nominal.input_gain = 250.01,
        |config| config.options.limits = Limits { min: -10.0, max: 9.999 },
        |config| config.options.fallback = Fallback::Safe(0.0),
        |config| config.options.sigma_star_bound = 1.0,
    ];
    let mut seen = std::collections::BTreeSet::new();
    for change in changes {
        let mut config = GOOD;
        change(&mut config);
        seen.insert(motor(&config).fingerprint());
    }
    // Another model under the same coefficients, another precision, a guess.
    let design = motor(&GOOD);
    let row = Linear::from_row([1e-6, design.model().row()[1]]);
    seen.insert(Motor::from_parts(*design.coefficients(), row).fingerprint());
    seen.insert(Double::designed(&GOOD, Linear::<f64, 2>::new(&NOMINAL)).fingerprint());
    let guessing = |guess| Running::guessing(design, guess).design().fingerprint();
    seen.extend([guessing([0.0; 2]), guessing([0.0, 1e-6])]);
    assert_eq!(seen.len(), 17);
    assert_eq!(design.fingerprint(), motor(&GOOD).fingerprint());
}

/// 24 changes of every gain at once, on a shaft in motion under a load: u goes on where it was. A tick by itself moves u
/// by some 0.01 A here. Set up anew instead, with the estimates at 0 and the offset at sigma, u jumps by 0.13 A.
#[test]
fn retune_in_motion_does_not_move_u() {
    let mut rng = Rng::new(0x2E7);
    let (mut worst, mut naive, mut estimates_moved) = (0.0_f32, 0.0_f32, 0.0_f32);
    for _ in 0..24 {
        let mut vary = |value: f64| value * rng.within(0.6, 2.0);
        let mut config = GOOD;
        config.surface = Surface::from_bandwidth(vary(20.0), vary(5.0));
        config.observers = [vary(80.0), vary(60.0)].map(|omega| Some(ObserverGains::from_bandwidth::<2>(omega)));
        config.reaching.k_l = vary(80.0);
        config.period_s = [1e-3, 5e-4, 2e-3][rng.integer(0, 2)];
        config.nominal.input_gain = rng.within(200.0, 330.0);
        let (before, after) = (motor(&GOOD), motor(&config));
        let mut running = Running::new(&before);
        let mut shaft = Shaft { x: [0.3, 0.0], t_s: 0.0 };
        for _ in 0..rng.integer(300, 900) {
            let u = running.tick(&shaft.sample()).u;
            shaft.advance(f64::from(u), GOOD.period_s);
        }
        let x = shaft.sample();
        let mut unchanged = running.clone();
        let u = unchanged.tick(&x).u;
        running.retune(&after, &x).expect("designs that can take over");
        let jump = (running.tick(&x).u - u).abs();
        let mut anew = Running::new(&after);
        anew.tick(&x);
        naive = naive.max((anew.tick(&x).u - u).abs());
        worst = worst.max(jump);
        let (was, is) = (unchanged.estimates().expect("running"), running.estimates().expect("running"));
        for (was, is) in was.as_flattened().iter().zip(is.as_flattened()) {
            estimates_moved = estimates_moved.max((was - is).abs() / (1.0 + was.abs()));
        }
        // And it goes on to hold the shaft.
        for _ in 0..3000 {
            let u = running.tick(&shaft.sample()).u;
            shaft.advance(f64::from(u), config.period_s);
        }
        assert!(shaft.x[0].abs() < 0.05, "{:?} under {config:?}", shaft.x);
    }
    println!("u moves by {worst:.1e} A at most (set up anew: {naive:.1} A), estimates by {estimates_moved:.1e}");
    assert!(worst <= 1e-4, "{worst} A");
    // The test could fail: without the care that is taken u does jump.
    assert!(naive > 0.1, "{naive} A");
    assert!(estimates_moved <= 1e-5, "{estimates_moved:e}");
}

#[test]
fn retune_that_cannot_be_made_changes_nothing() {
    let (before, after) = (motor(&GOOD), motor(&Config { surface: Surface::from_bandwidth(30.0, 15.0), ..GOOD }));
    // The decay of the offset is that of the sliding variable: W has no say in u.
    let near = Config { reaching: ReachingLaw { k_l: 10.3, ..GOOD.reaching }, ..GOOD };
    let near = motor(&near);
    let mut running = Running::new(&before);
    // Before the start there is nothing to take over.
    assert_eq!(running.retune(&after, &[f32::NAN; 2]), Ok(()));
    assert_eq!(running.design().fingerprint(), after.fingerprint());
    running.tick(&[0.1, 0.0]);
    let words: Vec<u32> = running.words().collect();
    assert_eq!(running.retune(&before, &[f32::NAN, 0.0]), Err(RetuneError::Sample));
    assert_eq!(running.retune(&before, &[1e30, 0.0]), Err(RetuneError::Sample));
    assert_eq!(running.retune(&near, &[0.1, 0.0]), Err(RetuneError::GainNearDecay));
    assert!(running.words().eq(words));
    assert_eq!(running.design().fingerprint(), after.fingerprint());
}

#[test]
fn before_the_start_nothing_is_reported_and_nothing_is_known() {
    let design = motor(&GOOD);
    let mut running = Running::new(&design);
    assert!(!running.report_applied(1.0) && running.estimates().is_none());
    let output = running.tick(&[f32::NAN; 2]);
    assert_eq!((output.u, output.health), (0.0, Health::INPUT_REJECTED));
    assert!(!running.report_applied(1.0) && running.estimates().is_none());
    running.tick(&[0.0; 2]);
    assert!(running.report_applied(1.0) && !running.report_applied(f32::NAN) && !running.report_applied(2e12));
    assert!(running.estimates().is_some());
}

/// Lanes of one test: no power of two, so that a vector loop has a rest.
const L: usize = 11;

/// A design of a shape with all there is: mixed limits, a switching term, a safe u on some.
fn config<const N: usize, const R: usize>(mask: u8) -> Config<N, R> {
    let slow = ObserverGains::from_bandwidth::<R>(30.0 + f64::from(mask));
    Config {
        period_s: 1e-3,
        surface: Surface::from_bandwidth(4.0, 1.0),
        observers: std::array::from_fn(|i| (mask >> i & 1 == 1).then_some(slow)),
        reaching: ReachingLaw { k_l: 40.0, k_s: if mask.is_multiple_of(3) { 0.0 } else { 0.5 }, epsilon: 0.01 },
        nominal: Nominal {
            gradient: std::array::from_fn(|i| -0.5 * (i as f64 + 1.0)),
            input_gain: 3.5 - f64::from(mask),
        },
        options: Options::NEUTRAL
            .with_limits(Limits { min: -40.0, max: 30.0 })
            .with_fallback(if mask.is_multiple_of(2) { Fallback::HoldLast } else { Fallback::Safe(1.25) })
            .with_sigma_star_bound(20.0),
    }
}

/// A number of a sample: good ones, ones that saturate, lost ones, edges.
fn number<T: Real>(rng: &mut Rng) -> T {
    let edges = [f64::NAN, f64::INFINITY, -1e13, 1e30, 1e35, -1e-40, -0.0, 1e6, -3e11, 1e300];
    match rng.integer(0, 59) {
        k @ 0..10 => T::from_f64(edges[k]),
        10..14 => T::from_f64(rng.within(-100.0, 100.0)),
        _ => T::from_f64(rng.within(-0.2, 0.2)),
    }
}

/// Lanes against L controllers alone: outputs, states, reports of what was held. Returns lane-ticks that were rejected
/// and that saturated.
fn lanes_are_the_tick<T: Real, M, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    controller: &Controller<T, M, N, R, MASK, O>,
) -> [usize; 2]
where
    M: controller_core::NominalModel<T, N>,
{
    let mut rng = Rng::new(u64::from(MASK) << 16 | (N * 8 + R) as u64);
    let start = controller.start(&[T::from_f64(0.1); N]).expect("a good sample");
    let mut lanes = start.lanes::<L>();
    let mut alone = vec![start; L];
    let mut seen = [0; 2];
    for k in 0..150 {
        let x: [[T; N]; L] = std::array::from_fn(|_| std::array::from_fn(|_| number(&mut rng)));
        let together: [Output<T>; L] = std::array::from_fn(|l| controller.tick_lane(&mut lanes, l, &x[l]));
        for l in 0..L {
            let one = controller.tick(&mut alone[l], &x[l]);
            let other = together[l];
            for (one, other) in [(one.u, other.u), (one.sigma, other.sigma), (one.sigma_star, other.sigma_star)] {
                assert_eq!(one.to_words(), other.to_words(), "n = {N}, r = {R}, {MASK:#b}, tick {k}, lane {l}");
            }
            assert_eq!(one.health, other.health, "n = {N}, r = {R}, {MASK:#b}, tick {k}, lane {l}");
            seen[0] += usize::from(one.health.contains(Health::INPUT_REJECTED));
            seen[1] += usize::from(one.health.contains(Health::SATURATED));
            if rng.chance(0.2) {
                let held = T::from_f64(0.5) * one.u;
                Controller::<T, M, N, R, MASK, O>::report_applied(&mut alone[l], held);
                let mut state = lanes.lane(l);
                Controller::<T, M, N, R, MASK, O>::report_applied(&mut state, held);
                lanes.set(l, &state);
            }
            assert!(lanes.lane(l).words().eq(alone[l].words()), "n = {N}, r = {R}, {MASK:#b}, tick {k}, lane {l}");
        }
    }
    seen
}

#[test]
fn every_lane_of_every_shape_has_the_bits_of_the_tick_in_both_precisions() {
    let mut seen = [0; 2];
    let mut shapes = 0;
    macro_rules! compare {
        ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {$(
            // b(x) varies in every third shape, a(x) bends in all.
            let model = Model { bend: 0.3, swing: if shapes % 3 == 0 { 0.2 } else { 0.0 }, ..Model::linear(&[-0.5; $n], 3.0) };
            let design = config::<$n, $r>($mask);
            let single = Controller::<f32, _, $n, $r, $mask, $o>::design(&design, UnitModel::new(&model));
            let double = Controller::<f64, _, $n, $r, $mask, $o>::design(&design, UnitModel::new(&model));
            for found in [
                lanes_are_the_tick(&single.expect("a good design")),
                lanes_are_the_tick(&double.expect("a good design")),
            ] {
                seen = [seen[0] + found[0], seen[1] + found[1]];
            }
            shapes += 1;
        )*};
    }
    shapes!(all => compare);
    println!("{shapes} shapes, {} lane-ticks, {} rejected, {} saturated", shapes * 2 * 150 * L, seen[0], seen[1]);
    assert_eq!(shapes, 116);
    assert!(seen[0] > 10_000 && seen[1] > 10_000, "{seen:?}");
}

#[test]
fn a_guess_is_part_of_the_design_it_starts() {
    let running: Running<Guessing<Motor>> = Running::guessing(motor(&GOOD), [0.5, -20.0]);
    let mut started = running.clone();
    started.tick(&[0.0, 0.0]);
    let d_hat = started.estimates().expect("started");
    assert!((d_hat[0][0] - 0.5).abs() < 1e-6 && (d_hat[1][0] + 20.0).abs() < 1e-4, "{d_hat:?}");
}
