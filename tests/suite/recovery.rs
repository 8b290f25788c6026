//! Does the tick come back, whatever its state was made of and whatever it was fed?
//!
//! After a good tick every word of the state lies in the set M of its design (module `design` of the core, "Range").
//! From any state two good samples lead there, and from there the loop converges within a stated time. Random samples
//! find nothing here: what did harm were samples of 1e27 whose terms cancel to the last bit, so they are searched for
//! along the directions in which the law asks for nothing.

use controller_core::{
    Config, ControlLaw, Controller, Fallback, FlexibleJoint, Health, LAYOUT, Limits, Linear, Nominal, NominalModel,
    ObserverGains, Options, Output, ReachingLaw, Real, Running, Surface, Words,
};
use integration_tests::paper::{NOMINAL, joint_config};
use integration_tests::strategy::Rng;
use integration_tests::truth::{ExactStep, LinearChain, Term};

/// Where the sums of the law overflow, as a power of two.
trait Precision: Real {
    const BITS: i32;
}
impl Precision for f32 {
    const BITS: i32 = 128;
}
impl Precision for f64 {
    const BITS: i32 = 1024;
}

/// What M is made of.
struct Set {
    lambda: f64,
    /// Per slot, per A, B, C: the gain of the law.
    k: Vec<Vec<f64>>,
    kx: Vec<f64>,
    kw: f64,
    u: [f64; 2],
    channels: Vec<usize>,
    r: usize,
}

type Law<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> = Controller<T, M, N, R, MASK, O>;

impl Set {
    fn of<T: Precision, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize>(
        law: &Law<T, M, N, R, MASK, O>,
    ) -> Self {
        let mut numbers = law.coefficients().numbers().map(Real::to_f64);
        let mut named = std::collections::HashMap::new();
        for field in LAYOUT.split_whitespace() {
            let (name, count) = match field.split_once('[') {
                None => (field, 1),
                Some((name, "N]")) => (name, N),
                Some((name, _)) => (name, O * R),
            };
            named.insert(name, numbers.by_ref().take(count).collect::<Vec<f64>>());
        }
        let unit = named["unit"][0];
        // 2^1024 is no f64.
        let lambda = 2.0 * (2f64.powi(T::BITS - 1) * unit);
        let scaled = |name: &str| named[name].iter().map(|entry| entry * unit).collect::<Vec<f64>>();
        Self {
            lambda,
            k: scaled("k").chunks(R).map(<[f64]>::to_vec).collect(),
            kx: scaled("kx"),
            kw: scaled("kw")[0],
            u: [named["u_min"][0], named["u_max"][0]],
            channels: Law::<T, M, N, R, MASK, O>::CHANNELS.to_vec(),
            r: R,
        }
    }

    /// What of the state lies outside, after a tick with a sample.
    fn outside<T: Real>(&self, x: &[T], words: &[f64]) -> Vec<String> {
        let mut found = Vec::new();
        let mut hold = |what: String, value: f64, most: f64| {
            // A term is rounded before it overflows.
            if value.is_nan() || value.abs() > most * (1.0 + 1e-6) {
                found.push(format!("{what}: {value:e} over {most:e}"));
            }
        };
        let x: Vec<f64> = x.iter().map(|x| x.to_f64()).collect();
        let size = x.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        let (z, rest) = words.split_at(self.channels.len() * self.r);
        let (past, rest) = rest.split_at(self.channels.len());
        let (x_prev, rest) = rest.split_at(self.channels.len());
        for (s, &i) in self.channels.iter().enumerate() {
            let of = |letter: char| format!("{letter}{}", i + 1);
            // A_n stands in the demand itself, which is what is left of the other terms.
            let a = if i + 1 == self.kx.len() { 20.0 * self.lambda } else { self.lambda / self.kx[i + 1].abs() + size };
            hold(of('A'), z[s * self.r], a);
            for m in 1..self.r {
                hold(of(['A', 'B', 'C'][m]), z[s * self.r + m], self.lambda / self.k[s][m].abs());
            }
            hold(of('P'), past[s], a + 1e6 * size);
            hold(format!("x{}_prev", i + 1), x_prev[s], size);
        }
        hold("W".into(), rest[0], self.lambda / self.kw.abs());
        if !(self.u[0] <= rest[1] && rest[1] <= self.u[1]) {
            found.push(format!("u: {:e}", rest[1]));
        }
        found
    }
}

/// The numbers of a state, without the flag that goes before them.
fn numbers<T: Real>(state: &impl Words) -> Vec<f64> {
    let words: Vec<u32> = state.words().skip(1).collect();
    words.chunks(T::WORDS).map(|word| T::from_words([word[0], *word.get(1).unwrap_or(&0)]).to_f64()).collect()
}

/// Good samples until the state is in M and one is taken; how many were not.
fn recovered<T: Precision, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    law: &Law<T, M, N, R, MASK, O>,
    state: &mut <Law<T, M, N, R, MASK, O> as ControlLaw>::State,
    good: &[T; N],
) -> Result<usize, String> {
    let set = Set::of(law);
    let tick = |state: &mut _| -> Output<T> { law.tick(state, good) };
    for lost in 0..3 {
        let output = tick(state);
        let u = output.u.to_f64();
        if u.is_nan() || u.abs() > set.u[1].abs().max(set.u[0].abs()) {
            return Err(format!("u = {} goes out", output.u));
        }
        let rejected = output.health.contains(Health::INPUT_REJECTED);
        let outside = set.outside(good, &numbers::<T>(state));
        if lost == 1 || !rejected {
            // A lost sample leaves x and P as they were; the next good one does not read them.
            let of_estimates = |what: &&String| !what.starts_with('P') && !what.contains("_prev");
            if let Some(what) = outside.iter().find(|what| !rejected || of_estimates(what)) {
                return Err(format!("sample {}: {what}", lost + 1));
            }
        }
        if !rejected {
            return Ok(lost);
        }
    }
    Err("three good samples refused".into())
}

/// A sample at this scale whose terms cancel: along the directions in which the law asks for nothing, then bit by bit.
fn cancelling<T: Precision, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    law: &Law<T, M, N, R, MASK, O>,
    state: &<Law<T, M, N, R, MASK, O> as ControlLaw>::State,
    row: &[f64; N],
    rng: &mut Rng,
) -> Option<[T; N]> {
    let digits = if T::WORDS == 1 { 37.0 } else { 300.0 };
    let scale = 10f64.powf(rng.within(2.0, digits));
    // Entries of like weight in the demand, the last one what the others leave.
    let shares: [f64; N] = std::array::from_fn(|_| rng.within(-1.0, 1.0));
    let last = rng.integer(0, N - 1);
    let rest: f64 = (0..N).filter(|&j| j != last).map(|j| shares[j]).sum();
    let mut x: [T; N] =
        std::array::from_fn(|j| T::from_f64(if j == last { -rest } else { shares[j] } / row[j] * scale));
    for _ in 0..300 {
        let rejected = law.tick(&mut state.clone(), &x).health.contains(Health::INPUT_REJECTED);
        if !rejected {
            return Some(x);
        }
        let j = rng.integer(0, N - 1);
        let [low, high] = x[j].to_words();
        let most = 1 << rng.integer(0, 8);
        let step = rng.integer(1, most) as u64;
        let bits = u64::from(high) << 32 | u64::from(low);
        let moved = if rng.chance(0.5) { bits.wrapping_add(step) } else { bits.wrapping_sub(step) };
        x[j] = T::from_words([moved as u32, (moved >> 32) as u32]);
    }
    None
}

/// Both searches for one design: cancelling samples, and states with anything in them. `good` are samples of a plant
/// at work.
fn attacked<T: Precision, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    law: &Law<T, M, N, R, MASK, O>,
    free: &Law<T, M, N, R, MASK, O>,
    good: &[T; N],
    tries: usize,
    rng: &mut Rng,
) -> usize {
    let mut healthy = law.start(good).expect("a good sample");
    for _ in 0..100 {
        law.tick(&mut healthy, good);
    }
    let mut unlimited = free.start(good).expect("a good sample");
    for _ in 0..100 {
        free.tick(&mut unlimited, good);
    }
    let demand = |x: &[T; N]| free.tick(&mut unlimited.clone(), x).u.to_f64();
    let row: [f64; N] = std::array::from_fn(|j| {
        let mut moved = *good;
        moved[j] += T::from_f64(1.0);
        demand(&moved) - demand(good)
    });
    let mut taken = 0;
    for attempt in 0..tries {
        let mut state = healthy.clone();
        if let Some(x) = cancelling(law, &healthy, &row, rng) {
            taken += 1;
            law.tick(&mut state, &x);
            if let Err(what) = recovered(law, &mut state, good) {
                panic!("attempt {attempt}, after {x:?}: {what}");
            }
        }
        // Bits flipped, words exchanged for any finite number.
        let mut words: Vec<u32> = healthy.words().collect();
        for _ in 0..rng.integer(1, 8) {
            let at = rng.integer(1, words.len() - 1);
            words[at] = if rng.chance(0.5) { words[at] ^ 1 << rng.integer(0, 31) } else { rng.bits() as u32 };
        }
        words[0] = u32::from(rng.chance(0.5));
        let Some(mut state) = <Law<T, M, N, R, MASK, O> as ControlLaw>::State::from_words(&mut words.into_iter())
        else {
            continue;
        };
        if let Err(what) = recovered(law, &mut state, good) {
            panic!("attempt {attempt}, from a damaged state: {what}");
        }
    }
    // Nothing but NaN in it: what the tick without its guard makes of one.
    let mut state = healthy.clone();
    law.tick_unguarded(&mut state, &[T::from_f64(f64::NAN); N]);
    recovered(law, &mut state, good).expect("a state of NaN");
    taken
}

/// An attack in one precision: a law and its twin without limits, good samples, tries.
macro_rules! attacks {
    ($($name:ident: $t:ty, $law:ty = $config:expr, $model:expr, good $good:expr;)*) => {
        /// All of them, each with its own stream of a seed; how many cancelling samples were taken.
        fn attack_all(seed: u64, tries: usize) -> usize {
            let mut taken = 0;
            $({
                let config = $config;
                let [law, free] = [config.options.limits, Limits::NONE].map(|limits| {
                    let options = config.options.with_limits(limits);
                    <$law>::try_design(&Config { options, ..config }, $model).expect("a valid design")
                });
                let good: [$t; _] = $good;
                let mut rng = Rng::new(seed ^ u64::from(law.fingerprint()));
                taken += attacked(&law, &free, &good, tries, &mut rng);
                taken += attacked(&free, &free, &good, tries, &mut rng);
            })*
            taken
        }
    };
}

type Joint<T> = controller_core::controller!(T, FlexibleJoint<T>, order 4, observers of order 2 in [2, 4]);
type JointOf3<T> = controller_core::controller!(T, FlexibleJoint<T>, order 4, observers of order 3 in [1, 2, 3, 4]);
type Motor<T> = controller_core::controller!(T, Linear<T, 2>, order 2, observers of order 1 in [2]);
type Bare<T> = controller_core::controller!(T, Linear<T, 3>, order 3, no observers);

const MOTOR: Nominal<2> = Nominal { gradient: [0.0, -0.5], input_gain: 250.0 };
const THREE: Nominal<3> = Nominal { gradient: [-3.0, 1.0, -2.0], input_gain: -7.0 };

fn motor() -> Config<2, 1> {
    Config {
        period_s: 1e-3,
        surface: Surface::from_bandwidth(20.0, 2.0),
        observers: [None, Some(ObserverGains::from_bandwidth::<1>(60.0))],
        reaching: ReachingLaw { k_l: 80.0, k_s: 2.0, epsilon: 0.1 },
        nominal: MOTOR,
        options: Options::NEUTRAL.with_limits(Limits::symmetric(10.0)),
    }
}

fn bare() -> Config<3, 1> {
    Config {
        period_s: 2e-3,
        surface: Surface::from_bandwidth(10.0, 1.0),
        observers: [None; 3],
        reaching: ReachingLaw { k_l: 30.0, k_s: 0.0, epsilon: 0.0 },
        nominal: THREE,
        options: Options::NEUTRAL.with_limits(Limits { min: -1.0, max: 20.0 }).with_fallback(Fallback::Safe(2.0)),
    }
}

fn joint_of_3() -> Config<4, 3> {
    let gains = Some(ObserverGains::from_bandwidth::<3>(60.0));
    Config { observers: [gains; 4], ..joint_config(ObserverGains::from_bandwidth::<3>(60.0)) }
}

attacks! {
    joint: f32, Joint<f32> = joint_config(ObserverGains::as_printed([100.0, 20.0])),
        FlexibleJoint::<f32>::new(&NOMINAL), good [0.1, 0.0, 0.0, 0.0];
    joint_f64: f64, Joint<f64> = joint_config(ObserverGains::as_printed([100.0, 20.0])),
        FlexibleJoint::<f64>::new(&NOMINAL), good [0.1, 0.0, 0.0, 0.0];
    joint_of_3: f32, JointOf3<f32> = joint_of_3(), FlexibleJoint::<f32>::new(&NOMINAL), good [0.1, -0.2, 0.3, 0.1];
    motor: f32, Motor<f32> = motor(), Linear::<f32, 2>::new(&MOTOR), good [0.3, 0.1];
    motor_f64: f64, Motor<f64> = motor(), Linear::<f64, 2>::new(&MOTOR), good [0.3, 0.1];
    bare: f32, Bare<f32> = bare(), Linear::<f32, 3>::new(&THREE), good [0.3, 0.1, 0.0];
}

#[test]
fn two_good_samples_lead_from_any_state_and_after_any_sample_into_the_set_of_the_design() {
    // Enough of the search must have been taken as good for the promise to be tried.
    let taken = attack_all(0x0ED0, 1500);
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
        let good = [0.1, 0.0, 0.0, 0.0];
        for x in [
            [5.990_637_7e27, 3.260_119e27, -9.875_697e27, -5.325_498e30],
            [7.646_730_3e27, -2.542_863_4e26, 1.539_743_4e27, -1.091_725e30],
        ] {
            let mut state = law.start(&good).expect("a good sample");
            for _ in 0..100 {
                law.tick(&mut state, &good);
            }
            law.tick(&mut state, &x);
            recovered(&law, &mut state, &good).expect("good samples are taken again");
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
