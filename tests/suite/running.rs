//! A running controller as one value: exact storage and restoration, a change of design in motion, and batches in
//! lanes.

use controller_core::{
    Config, ControlLaw, Fallback, Guessing, Health, Limits, Linear, Nominal, ObserverGains, Options, Output,
    ReachingLaw, RetuneError, Running, Surface, WordsError, shapes,
};
use integration_tests::strategy::Rng;
use integration_tests::{lanes, pairs};

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
    Motor::try_linear(config).expect("a good design")
}

/// Motor that differs from the nominal one, under a load: J w' = K_t u - friction - load, stepped by the exact u.
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
            // The last sample is missing, and the snapshot includes its flag.
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
        // After a reset the controller starts like a new one, guess included.
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
    // Any bit may flip, and any two words may change places.
    for at in 0..words.len() {
        for bit in 0..32 {
            let mut spoilt = words.clone();
            spoilt[at] ^= 1 << bit;
            assert_eq!(damaged(&spoilt) == WordsError::Damaged, at > 0, "word {at}, bit {bit}");
        }
        for other in (1..at).filter(|&other| words[other] != words[at]) {
            let mut spoilt = words.clone();
            spoilt.swap(at, other);
            assert_eq!(damaged(&spoilt), WordsError::Damaged, "words {other} and {at}");
        }
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
    // Another model with equal coefficients, another precision, a guess.
    let design = motor(&GOOD);
    let row = Linear::from_row([1e-6, design.model().row()[1]]);
    seen.insert(Motor::from_parts(*design.coefficients(), row).fingerprint());
    seen.insert(Double::linear(&GOOD).fingerprint());
    let guessing = |guess| Running::guessing(design, guess).design().fingerprint();
    seen.extend([guessing([0.0; 2]), guessing([0.0, 1e-6])]);
    assert_eq!(seen.len(), 17);
    assert_eq!(design.fingerprint(), motor(&GOOD).fingerprint());
}

/// Retunes of a running motor: every gain at once, other periods and orders, another inertia, a switching term. On a
/// moving shaft under a load u continues; a tick by itself changes u by some 0.01 A here. A new start, with the
/// estimates at 0 and the offset at sigma, changes u by 0.13 A.
#[test]
fn retune_in_motion_does_not_move_u() {
    let mut rng = Rng::new(0x2E7);
    let (mut worst, mut naive) = (0.0_f32, 0.0_f32);
    for case in 0..48 {
        let mut vary = |value: f64| value * rng.within(0.6, 2.0);
        let mut config = GOOD;
        config.surface = Surface::from_bandwidth(vary(20.0), vary(5.0));
        config.observers = [vary(80.0), vary(60.0)].map(|omega| Some(ObserverGains::from_bandwidth::<2>(omega)));
        config.reaching.k_l = vary(80.0);
        config.period_s = [1e-3, 5e-4, 2e-3][rng.integer(0, 2)];
        config.nominal.input_gain = rng.within(200.0, 330.0);
        if case % 3 == 1 {
            config.observers[1] = Some(ObserverGains::from_bandwidth::<1>(60.0));
        }
        if case % 4 == 2 {
            (config.reaching.k_s, config.reaching.epsilon) = (rng.within(0.1, 30.0), 0.05);
        }
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
        worst = worst.max((running.tick(&x).u - u).abs());
        let mut anew = Running::new(&after);
        anew.tick(&x);
        naive = naive.max((anew.tick(&x).u - u).abs());
        // The controller continues to hold the shaft.
        for _ in 0..3000 {
            let u = running.tick(&shaft.sample()).u;
            shaft.advance(f64::from(u), config.period_s);
        }
        assert!(shaft.x[0].abs() < 0.05, "{:?} under {config:?}", shaft.x);
    }
    println!("u moves by {worst:.1e} A at most (set up anew: {naive:.2} A)");
    assert!(worst <= 1e-4, "{worst} A");
    // Proof of sensitivity: without the bumpless transfer u jumps.
    assert!(naive > 0.1, "{naive} A");
}

/// The observers estimate the total acceleration a(x) + b u + d_n; another b_0 or a(x) divides it differently. At rest
/// under a load the shaft stays at rest when the inertia changes, also in the ticks after the first.
#[test]
fn retune_of_the_model_keeps_the_total_acceleration() {
    for (input_gain, slope) in [(200.0, -0.5), (125.0, -0.5), (400.0, -30.0), (-250.0, -0.5)] {
        let before = motor(&GOOD);
        let after = motor(&Config { nominal: Nominal { gradient: [0.0, slope], input_gain }, ..GOOD });
        let mut running = Running::new(&before);
        // 6 A hold a load of 1500 rad/s^2.
        let (mut angle, mut speed) = (0.0_f64, 0.0_f64);
        let mut tick = |running: &mut Running<&Motor>| {
            let u = running.tick(&[angle as f32, speed as f32]).u;
            let acceleration = 250.0 * f64::from(u) - 0.5 * speed + 1500.0;
            angle += 1e-3 * speed + 0.5e-6 * acceleration;
            speed += 1e-3 * acceleration;
            (u, [angle as f32, speed as f32])
        };
        let mut last = (0.0, [0.0; 2]);
        for _ in 0..4000 {
            last = tick(&mut running);
        }
        assert!((last.0 + 6.0).abs() < 1e-3, "{last:?}");
        running.retune(&after, &last.1).expect("designs that can take over");
        // With a wrong sign of b the loop is unstable, so only the first tick is checked for a jump.
        let ticks = if input_gain > 0.0 { 20 } else { 1 };
        for k in 0..ticks {
            let (u, _) = tick(&mut running);
            assert!((u + 6.0).abs() < 0.01, "tick {k} after b_0 = {input_gain}: {u} A");
        }
    }
}

/// A retune to the present design at every tick, with a switching term, changes nothing.
#[test]
fn retune_onto_itself_changes_nothing_however_often() {
    let design = motor(&Config { reaching: ReachingLaw { k_l: 80.0, k_s: 20.0, epsilon: 0.05 }, ..GOOD });
    let (mut retuned, mut plain) = (Running::new(&design), Running::new(&design));
    let mut shafts = [0, 1].map(|_| Shaft { x: [0.3, 0.0], t_s: 0.0 });
    let mut apart = 0.0_f64;
    for k in 0..4000 {
        let x = shafts[0].sample();
        if k > 0 {
            retuned.retune(&design, &x).expect("the same design");
        }
        let u = [retuned.tick(&x).u, plain.tick(&shafts[1].sample()).u];
        for (shaft, u) in shafts.iter_mut().zip(u) {
            shaft.advance(f64::from(u), GOOD.period_s);
        }
        apart = apart.max((shafts[0].x[0] - shafts[1].x[0]).abs());
    }
    println!("the two shafts are {apart:.1e} rad apart at most");
    assert!(apart < 1e-3, "{apart} rad");
}

/// A retune to a lower order discards the estimates that the new observer would never correct.
#[test]
fn retune_to_a_lower_order_forgets_what_it_does_not_estimate() {
    let lower = |r: usize| {
        let gains = |omega| {
            if r == 1 { ObserverGains::from_bandwidth::<1>(omega) } else { ObserverGains::from_bandwidth::<2>(omega) }
        };
        motor(&Config { observers: [Some(ObserverGains::from_bandwidth::<2>(80.0)), Some(gains(60.0))], ..GOOD })
    };
    let (second, first) = (lower(2), lower(1));
    let mut running = Running::new(&second);
    let mut shaft = Shaft { x: [0.3, 0.0], t_s: 0.0 };
    for _ in 0..700 {
        let u = running.tick(&shaft.sample()).u;
        shaft.advance(f64::from(u), 1e-3);
    }
    assert!(
        running.estimates().expect("running")[1][1].abs() > 1.0,
        "the load must move for the test to ask something"
    );
    running.retune(&first, &shaft.sample()).expect("designs that can take over");
    assert_eq!(running.estimates().expect("running")[1][1], 0.0);
}

#[test]
fn retune_that_cannot_be_made_changes_nothing() {
    let (before, after) = (motor(&GOOD), motor(&Config { surface: Surface::from_bandwidth(30.0, 15.0), ..GOOD }));
    // Decay of the offset equal to the reaching gain: W has no influence on u.
    let near = Config { reaching: ReachingLaw { k_l: 10.3, ..GOOD.reaching }, ..GOOD };
    let near = motor(&near);
    let mut running = Running::new(&before);
    // Before the start there is no state to keep.
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

#[test]
fn every_lane_has_the_bits_of_the_tick_in_both_precisions() {
    lanes::hold(shapes!(archive => pairs));
}

#[test]
fn a_guess_is_part_of_the_design_it_starts() {
    let running: Running<Guessing<Motor>> = Running::guessing(motor(&GOOD), [0.5, -20.0]);
    let mut started = running.clone();
    started.tick(&[0.0, 0.0]);
    let d_hat = started.estimates().expect("started");
    assert!((d_hat[0][0] - 0.5).abs() < 1e-6 && (d_hat[1][0] + 20.0).abs() < 1e-4, "{d_hat:?}");
}
