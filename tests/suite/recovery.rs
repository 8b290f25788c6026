//! Recovery of the tick from any state and after any input.
//!
//! After a valid tick every word of the state lies in the set M of its design (module `design` of the core, "Range").
//! From any state two valid samples lead there, and from there the loop converges within a stated time. Random samples
//! find no fault here. The harmful samples had values around 1e27 whose terms cancel to the last bit. The search
//! therefore follows the directions in which the control law demands nothing.

use controller_core::{
    Config, ControlLaw, Controller, Fallback, FlexibleJoint, Health, Limits, Linear, Nominal, ObserverGains, Options,
    ReachingLaw, Running, Surface,
};
use integration_tests::deep;
use integration_tests::paper::{NOMINAL, joint_config};
use integration_tests::recovery::{Joint, Twins, victims};
use integration_tests::strategy::{Rng, Trial};
use integration_tests::truth::{ExactStep, LinearChain, Term};

#[test]
fn two_good_samples_lead_from_any_state_and_after_any_sample_into_the_set_of_the_design() {
    let mut taken = 0;
    for (k, victim) in (0..).zip(victims()) {
        let mut trial = Trial::new(0x0ED0 + k, false);
        for attempt in 0..3000 {
            let struck = victim.struck(&mut trial).unwrap_or_else(|what| panic!("attempt {attempt}, {what}"));
            taken += usize::from(struck);
        }
    }
    // The guarantee is tested only if enough cancelling samples were accepted.
    assert!(taken >= 1000, "only {taken} cancelling samples were taken: the search finds none");
}

/// The first sample found: it demands nothing, was accepted, and left estimates of 1e30 that rejected every later
/// sample.
#[test]
fn a_sample_of_1e27_whose_terms_cancel_does_not_lock_the_joint() {
    let config = joint_config(ObserverGains::as_printed([100.0, 20.0]));
    for limits in [Limits::NONE, Limits::symmetric(300.0)] {
        let options = config.options.with_limits(limits);
        let law = Joint::<f32>::try_design(&Config { options, ..config }, FlexibleJoint::<f32>::new(&NOMINAL));
        let law = law.expect("a valid design");
        let twins = Twins::new("joint", [law, law], [0.1, 0.0, 0.0, 0.0]);
        for x in [
            [5.990_637_7e27, 3.260_119e27, -9.875_697e27, -5.325_498e30],
            [7.646_730_3e27, -2.542_863_4e26, 1.539_743_4e27, -1.091_725e30],
        ] {
            let mut state = twins.healthy();
            law.tick(&mut state, &x);
            twins.recovered(0, &mut state, &mut 0).expect("good samples are taken again");
        }
    }
}

/// The loop on the limited joint; its state is overwritten after 3 s, many times. From the second sample on the loop is
/// at a start from the present plant state, with a bounded offset. An offset left out of W demands at most 256 times
/// the span of the limits. u leaves its limit after ln(512)/alpha = 6.2 s; the surface follows, (125, 75, 15) with all
/// roots at -5 /s.
#[test]
fn the_loop_converges_again_whatever_was_written_over_the_state() {
    let config = joint_config(ObserverGains::from_bandwidth::<2>(50.0));
    let law = Joint::<f32>::try_design(&config, FlexibleJoint::<f32>::new(&NOMINAL)).expect("a valid design");
    let plant = LinearChain {
        a: NOMINAL.gradient.to_vec(),
        b: NOMINAL.input_gain,
        d: vec![vec![], vec![Term::Const(0.2)], vec![], vec![Term::Sin(30.0, 2.0, 0.0)]],
    };
    let step = ExactStep::new(&plant, config.period_s);
    let mut rng = Rng::new(0x51A7E);
    let mut farthest: f64 = 0.0;
    for attempt in 0..60 {
        let mut x = vec![0.05, 0.0, 0.0, 0.0];
        let mut running = Running::new(&law);
        let mut settled: f64 = 0.0;
        for k in 0..15_000 {
            if k == 3000 {
                let mut words: Vec<u32> = running.words().collect();
                let (at, length) = (rng.integer(3, words.len() - 2), words.len());
                match attempt % 3 {
                    0 => words[at] = (1e11 * rng.sign() as f32).to_bits(),
                    1 => words[at] ^= 1 << rng.integer(23, 31),
                    _ => (3..length - 1).for_each(|at| words[at] = rng.bits() as u32),
                }
                let sealed = sealed(&words);
                if let Ok(damaged) = Running::from_words(&law, sealed) {
                    running = damaged;
                }
            }
            let sample: [f32; 4] = std::array::from_fn(|j| x[j] as f32);
            let u = f64::from(running.tick(&sample).u);
            step.advance(k, u, &mut x);
            if k >= 13_000 {
                settled = settled.max((x[0]).abs());
            }
        }
        farthest = farthest.max(settled);
        assert!(settled < 0.01, "attempt {attempt}: |y| = {settled} ten seconds later");
    }
    assert!(farthest > 0.0);
}

/// Returns words with their checksum: FNV-1a of all words before it.
fn sealed(words: &[u32]) -> Vec<u32> {
    let (_, words) = words.split_last().expect("words of a running controller");
    let bytes = words.iter().flat_map(|word| word.to_le_bytes());
    let sum = bytes.fold(0x811c_9dc5_u32, |sum, byte| (sum ^ u32::from(byte)).wrapping_mul(0x0100_0193));
    words.iter().copied().chain([sum]).collect()
}

type Motor<const R: usize, const MASK: u8, const O: usize> = Controller<f32, Linear<f32, 2>, 2, R, MASK, O>;

fn motor<const R: usize>(observers: [Option<ObserverGains<R>>; 2], limits: Limits) -> Config<2, R> {
    Config {
        period_s: 1e-3,
        surface: Surface::from_bandwidth(20.0, 10.0),
        observers,
        reaching: ReachingLaw { k_l: 100.0, k_s: 0.0, epsilon: 0.01 },
        nominal: Nominal { gradient: [0.0, -0.5], input_gain: 250.0 },
        options: Options::NEUTRAL.with_limits(limits),
    }
}

/// Runs a motor under a constant disturbance in a loop that has settled for 2 s; then `strike` changes samples and
/// words. Returns the number of rejected ticks after that, and the largest |x_1| of the last second of ten.
fn struck<const R: usize, const MASK: u8, const O: usize>(
    config: &Config<2, R>,
    push: f64,
    strike: impl Fn(usize, &mut [f32; 2], &mut Vec<u32>),
) -> (usize, f64) {
    let law = Motor::<R, MASK, O>::try_linear(config).expect("a good design");
    let Nominal { gradient, input_gain: b } = config.nominal;
    let plant = LinearChain { a: gradient.to_vec(), b, d: vec![vec![], vec![Term::Const(push)]] };
    let step = ExactStep::new(&plant, config.period_s);
    let mut running = Running::guessing(law, [0.0, push as f32]);
    let (mut x, mut rejected, mut left) = (vec![0.0; 2], 0, 0.0_f64);
    for k in 0..12_000 {
        let mut sample: [f32; 2] = std::array::from_fn(|j| x[j] as f32);
        if k >= 2000 {
            let mut words: Vec<u32> = running.words().collect();
            let before = words.clone();
            strike(k - 2000, &mut sample, &mut words);
            if words != before {
                let design = *running.design();
                running = Running::from_words(design, sealed(&words)).expect("words of finite numbers");
            }
        }
        let output = running.tick(&sample);
        rejected += usize::from(k >= 2010 && output.health.contains(Health::INPUT_REJECTED));
        step.advance(k, f64::from(output.u), &mut x);
        left = if k >= 11_000 { left.max(x[0].abs()) } else { 0.0 };
    }
    (rejected, left)
}

/// Two finite samples, found by an attack. Their effect on B appeared in the demand every other tick only, so every
/// other sample was rejected permanently.
#[test]
fn estimates_that_show_every_other_tick_only_do_not_lock_the_motor() {
    let gains = Some(ObserverGains::from_bandwidth::<2>(100.0));
    let config = motor([None, gains], Limits::symmetric(10.0));
    let (rejected, left) = struck::<2, 0b10, 1>(&config, -1000.0, |k, sample, _| match k {
        0 => *sample = [-2_845_502.0, 24_000_000.0],
        1 => *sample = [-124_545.9, 2_084_493.8],
        _ => {}
    });
    assert!(rejected <= 10 && left < 1e-3, "{rejected} samples rejected, |x_1| = {left}");
}

/// Every size of every word of the estimates; the rest of the state is unchanged.
#[test]
fn one_spoilt_estimate_of_any_size_is_gone_ten_seconds_later() {
    let of_2 = motor([None, Some(ObserverGains::from_bandwidth::<2>(100.0))], Limits::symmetric(10.0));
    let of_3 = motor([None, Some(ObserverGains::from_bandwidth::<3>(60.0))], Limits::symmetric(10.0));
    let safe = of_2.options.with_fallback(Fallback::Safe(0.0));
    let safe = Config { options: safe, reaching: ReachingLaw { k_s: 1.0, ..of_2.reaching }, ..of_2 };
    for tenth in (0..90).step_by(if deep() { 1 } else { 9 }) {
        let value = 10.0_f32.powf(tenth as f32 / 10.0).to_bits();
        // Layout: fingerprint, running flag, resuming flag; then A, B, C.
        let strike = |word: usize| {
            move |k: usize, _: &mut [f32; 2], words: &mut Vec<u32>| {
                if k == 0 {
                    words[3 + word] = value;
                }
            }
        };
        let told = |what: &str, word: usize, (rejected, left): (usize, f64)| {
            assert!(rejected <= 20 && left < 0.01, "{what}, word {word}, 10^{tenth}/10: {rejected} rejected, {left}");
        };
        for word in 0..2 {
            told("order 2", word, struck::<2, 0b10, 1>(&of_2, 0.0, strike(word)));
            told("safe u", word, struck::<2, 0b10, 1>(&safe, 0.0, strike(word)));
        }
        for word in 0..3 {
            told("order 3", word, struck::<3, 0b10, 1>(&of_3, 0.0, strike(word)));
        }
    }
}

/// An outlier next to a missing sample carries no information about the state: the next sample disagrees with it.
#[test]
fn a_wild_sample_after_a_lost_one_costs_no_estimate() {
    let config = motor([None, Some(ObserverGains::from_bandwidth::<2>(100.0))], Limits::symmetric(10.0));
    for lead in [[f32::NAN; 2], [1e9, 0.0]] {
        let (rejected, left) = struck::<2, 0b10, 1>(&config, -1000.0, |k, sample, _| match k {
            10 => *sample = lead,
            11 => *sample = [-1e9, 0.0],
            // From then on every other sample.
            k if k > 11 && k < 5000 && k % 2 == 1 => *sample = [1e9 * (k % 4) as f32 - 2e9, 0.0],
            _ => {}
        });
        assert!(rejected <= 2500 && left < 1e-3, "{rejected} of 2496 wild samples rejected, |x_1| = {left}");
    }
}

/// Limits that are narrow and far from 0, or leave no range.
#[test]
fn a_motor_holds_a_load_within_narrow_limits_far_from_zero() {
    let gains = Some(ObserverGains::from_bandwidth::<2>(100.0));
    for (min, max) in [(1000.0, 1003.0), (998.0, 1005.0), (700.0, 1003.0), (1001.0, 1001.0)] {
        let config = motor([None, gains], Limits { min, max });
        let (rejected, left) = struck::<2, 0b10, 1>(&config, -1001.0 * 250.0, |_, _, _| {});
        assert!(rejected == 0 && left < 0.1, "[{min}, {max}]: {rejected} rejected, |x_1| = {left}");
    }
}
