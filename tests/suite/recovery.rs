//! Does the tick come back, whatever its state was made of and whatever it was fed?
//!
//! After a good tick every word of the state lies in the set M of its design (module `design` of the core, "Range").
//! From any state two good samples lead there, and from there the loop converges within a stated time. Random samples
//! find nothing here: what did harm were samples of 1e27 whose terms cancel to the last bit, so they are searched for
//! along the directions in which the law asks for nothing.

use controller_core::{Config, ControlLaw, FlexibleJoint, Limits, ObserverGains, Running};
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
    // Enough of the search must have been taken as good for the promise to be tried.
    assert!(taken >= 1000, "only {taken} cancelling samples were taken: the search finds none");
}

/// The one that was found first: it asks for nothing, was taken, and left estimates of 1e30 that refused every later
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

/// The loop on the limited joint, its state overwritten after 3 s, over and over. From the second sample on it is a
/// start from where the plant is then, with an offset that W left out asks for at most 256 times the span of the
/// limits: ln(512)/alpha = 6.2 s until u leaves its limit, then the surface, (125, 75, 15) with all roots at -5 /s.
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

/// Words with the checksum that belongs to them: FNV-1a of all before it.
fn sealed(words: &[u32]) -> Vec<u32> {
    let (_, words) = words.split_last().expect("words of a running controller");
    let bytes = words.iter().flat_map(|word| word.to_le_bytes());
    let sum = bytes.fold(0x811c_9dc5_u32, |sum, byte| (sum ^ u32::from(byte)).wrapping_mul(0x0100_0193));
    words.iter().copied().chain([sum]).collect()
}
