//! What is done to a controller, and the way back from it.
//!
//! After a good tick every word of the state lies in the set M of its design (module `design` of the core, "Range"),
//! and from any state at most two good samples lead there. Random samples find nothing here: what did harm were samples
//! of 1e27 whose terms cancel to the last bit, so they are searched for along the directions in which the law asks for
//! nothing. A [`Victim`] is a design with its twin without limits, of six kinds in f32 and f64.

use crate::paper::{NOMINAL, joint_config};
use crate::strategy::{Rng, Trial};
use controller_core::{
    Config, ControlLaw, Controller, Fallback, FlexibleJoint, Health, LAYOUT, Limits, Linear, Nominal, NominalModel,
    ObserverGains, Options, Output, ReachingLaw, Real, Running, Surface, Words,
};
use std::collections::HashMap;

/// Where the sums of the law overflow, as a power of two.
pub trait Precision: Real + Send + Sync {
    /// Numbers end at 2 to this.
    const BITS: i32;
}
impl Precision for f32 {
    const BITS: i32 = 128;
}
impl Precision for f64 {
    const BITS: i32 = 1024;
}

/// What M is made of.
#[derive(Clone, Debug)]
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

/// A controller of any shape.
pub type Law<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> = Controller<T, M, N, R, MASK, O>;

impl Set {
    fn of<T: Precision, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize>(
        law: &Law<T, M, N, R, MASK, O>,
    ) -> Self {
        let mut numbers = law.coefficients().numbers().map(Real::to_f64);
        let mut named = HashMap::new();
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

    /// Does a u within the limits go out?
    fn holds_u<T: Real>(&self, u: T) -> Result<(), String> {
        let u = u.to_f64();
        if self.u[0] <= u && u <= self.u[1] { Ok(()) } else { Err(format!("u = {u} goes out")) }
    }
}

/// The numbers of a state, without the flag that goes before them.
fn numbers<T: Real>(state: &impl Words) -> Vec<f64> {
    let words: Vec<u32> = state.words().skip(1).collect();
    words.chunks(T::WORDS).map(|word| T::from_words([word[0], *word.get(1).unwrap_or(&0)]).to_f64()).collect()
}

/// A design to attack.
pub trait Victim: Send + Sync {
    /// A cancelling sample, a damaged state and one of nothing but NaN, each with the way back; was the sample found,
    /// and taken?
    ///
    /// # Errors
    /// What was found outside, and after what.
    fn struck(&self, trial: &mut Trial) -> Result<bool, String>;

    /// So many ticks of a running controller with good samples, any bits, reports, resets, words given out and taken
    /// in again, and changes to the other design and back; then the way back.
    ///
    /// # Errors
    /// What went out, or was found outside.
    fn driven(&self, ticks: usize, trial: &mut Trial) -> Result<(), String>;
}

/// A design and its twin without limits. `good` is a sample of a plant at work.
pub struct Twins<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize>
where
    T: Precision,
    M: NominalModel<T, N>,
{
    name: &'static str,
    laws: [Law<T, M, N, R, MASK, O>; 2],
    sets: [Set; 2],
    good: [T; N],
    /// After a hundred good samples.
    healthy: [State<T, M, N, R, MASK, O>; 2],
    /// What one more of each entry of the sample asks for.
    row: [f64; N],
}

type State<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> =
    <Law<T, M, N, R, MASK, O> as ControlLaw>::State;

impl<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> Twins<T, M, N, R, MASK, O>
where
    T: Precision,
    M: NominalModel<T, N>,
{
    /// Both at work.
    ///
    /// # Panics
    /// When the sample is none to start with.
    pub fn new(name: &'static str, laws: [Law<T, M, N, R, MASK, O>; 2], good: [T; N]) -> Self {
        let sets = [0, 1].map(|which: usize| Set::of(&laws[which]));
        let healthy = [0, 1].map(|which: usize| {
            let mut state = laws[which].start(&good).expect("a good sample");
            for _ in 0..100 {
                laws[which].tick(&mut state, &good);
            }
            state
        });
        let demand = |x: &[T; N]| laws[1].tick(&mut healthy[1].clone(), x).u.to_f64();
        let row = std::array::from_fn(|j| {
            let mut moved = good;
            moved[j] += T::from_f64(1.0);
            demand(&moved) - demand(&good)
        });
        Self { name, laws, sets, good, healthy, row }
    }

    /// The limited one after a hundred good samples.
    pub fn healthy(&self) -> State<T, M, N, R, MASK, O> {
        self.healthy[0].clone()
    }

    /// Good samples until the state is in M and one is taken; how many were not.
    ///
    /// # Errors
    /// What lies outside.
    pub fn recovered(
        &self,
        which: usize,
        state: &mut State<T, M, N, R, MASK, O>,
        done: &mut u64,
    ) -> Result<usize, String> {
        let (law, set, good) = (&self.laws[which], &self.sets[which], &self.good);
        for lost in 0..3 {
            let output: Output<T> = law.tick(state, good);
            *done += 1;
            set.holds_u(output.u)?;
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

    /// A sample at this scale whose terms cancel: along the directions in which the law asks for nothing, then bit by
    /// bit.
    fn cancelling(&self, which: usize, trial: &mut Trial) -> Option<[T; N]> {
        let rng = &mut trial.rng;
        let digits = if T::WORDS == 1 { 37.0 } else { 300.0 };
        let scale = 10f64.powf(rng.within(2.0, digits));
        // Entries of like weight in the demand, the last one what the others leave.
        let shares: [f64; N] = std::array::from_fn(|_| rng.within(-1.0, 1.0));
        let last = rng.integer(0, N - 1);
        let rest: f64 = (0..N).filter(|&j| j != last).map(|j| shares[j]).sum();
        let mut x: [T; N] =
            std::array::from_fn(|j| T::from_f64(if j == last { -rest } else { shares[j] } / self.row[j] * scale));
        for _ in 0..300 {
            trial.done += 1;
            let output = self.laws[which].tick(&mut self.healthy[which].clone(), &x);
            if !output.health.contains(Health::INPUT_REJECTED) {
                return Some(x);
            }
            let j = rng.integer(0, N - 1);
            let most = 1 << rng.integer(0, 8);
            let step = rng.integer(1, most) as u64;
            let bits = bits_of(x[j]);
            x[j] = of_bits(if rng.chance(0.5) { bits.wrapping_add(step) } else { bits.wrapping_sub(step) });
        }
        None
    }

    /// An entry of a sample: of a plant at work, or any bits at all.
    fn entry(rng: &mut Rng, good: T) -> T {
        match rng.integer(0, 7) {
            0 => of_bits(rng.bits()),
            1 => T::from_f64(*rng.one_of(&[f64::NAN, f64::INFINITY, -f64::INFINITY, -0.0, 1e12, -1e300, 5e-324])),
            2 => T::from_f64(rng.sign() * rng.spread(1e-30, 1e30)),
            _ => T::from_f64(good.to_f64() + rng.within(-0.1, 0.1)),
        }
    }
}

fn bits_of<T: Real>(value: T) -> u64 {
    let [low, high] = value.to_words();
    u64::from(high) << 32 | u64::from(low)
}

fn of_bits<T: Real>(bits: u64) -> T {
    T::from_words([bits as u32, (bits >> 32) as u32])
}

/// Bits flipped, words exchanged for any others; the flag before them is one.
pub fn damaged(words: &mut [u32], rng: &mut Rng) {
    for _ in 0..rng.integer(1, 8) {
        let at = rng.integer(1, words.len() - 1);
        words[at] = if rng.chance(0.5) { words[at] ^ 1 << rng.integer(0, 31) } else { rng.bits() as u32 };
    }
    words[0] = u32::from(rng.chance(0.5));
}

impl<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> Victim for Twins<T, M, N, R, MASK, O>
where
    T: Precision,
    M: NominalModel<T, N> + Send + Sync,
{
    fn struck(&self, trial: &mut Trial) -> Result<bool, String> {
        let which = trial.rng.integer(0, 1);
        let mut state = self.healthy[which].clone();
        let found = self.cancelling(which, trial);
        if let Some(x) = found {
            self.laws[which].tick(&mut state, &x);
            trial.done += 1;
            let back = self.recovered(which, &mut state, &mut trial.done);
            back.map_err(|what| format!("{}, design {which}, after {x:?}: {what}", self.name))?;
        }
        let mut words: Vec<u32> = self.healthy[which].words().collect();
        damaged(&mut words, &mut trial.rng);
        if let Some(mut state) = Words::from_words(&mut words.iter().copied()) {
            trial.tell(|| format!("{}, design {which}, a state of the words {words:x?}", self.name));
            let back = self.recovered(which, &mut state, &mut trial.done);
            back.map_err(|what| format!("{}, design {which}, from the words {words:x?}: {what}", self.name))?;
        }
        // What the tick without its guard makes of NaN.
        let mut state = self.healthy[which].clone();
        self.laws[which].tick_unguarded(&mut state, &[T::from_f64(f64::NAN); N]);
        trial.done += 1;
        let back = self.recovered(which, &mut state, &mut trial.done);
        back.map_err(|what| format!("{}, design {which}, a state of NaN: {what}", self.name))?;
        Ok(found.is_some())
    }

    fn driven(&self, ticks: usize, trial: &mut Trial) -> Result<(), String> {
        let mut which = trial.rng.integer(0, 1);
        let mut running = Running::new(&self.laws[which]);
        let told = |which, what: String| format!("{}, design {which}: {what}", self.name);
        for _ in 0..ticks {
            let x: [T; N] = if trial.rng.chance(0.5) {
                self.good
            } else {
                std::array::from_fn(|j| Self::entry(&mut trial.rng, self.good[j]))
            };
            match trial.rng.integer(0, 63) {
                0 => {
                    trial.tell(|| "reset".into());
                    running.reset();
                }
                1 | 2 => {
                    let other = 1 - which;
                    let taken = running.retune(&self.laws[other], &x);
                    trial.tell(|| format!("to design {other} at {x:?}: {taken:?}"));
                    which = if taken.is_ok() { other } else { which };
                }
                3 => {
                    let again = Running::from_words(&self.laws[which], running.words());
                    let mut again = again.map_err(|error| told(which, format!("its own words: {error}")))?;
                    let (here, there) = (running.clone().tick(&x), again.tick(&x));
                    if format!("{here:?}") != format!("{there:?}") {
                        return Err(told(which, format!("taken in again {there:?}, before {here:?} at {x:?}")));
                    }
                    trial.done += 2;
                }
                4..=19 => {
                    let u = Self::entry(&mut trial.rng, T::from_f64(1.0));
                    let taken = running.report_applied(u);
                    trial.tell(|| format!("{u:?} was held: {taken}"));
                }
                _ => {}
            }
            let output = running.tick(&x);
            trial.done += 1;
            trial.tell(|| format!("{x:?} -> {output:?}"));
            self.sets[which].holds_u(output.u).map_err(|what| told(which, what))?;
            if ![output.sigma, output.sigma_star].iter().all(|value| value.to_f64().is_finite()) {
                return Err(told(which, format!("{x:?} -> {output:?}")));
            }
        }
        // Its words are a hash, whether it has started, the state and a checksum.
        let words: Vec<u32> = running.words().collect();
        if words[1] == 1 {
            let state = Words::from_words(&mut words[2..].iter().copied());
            let mut state = state.ok_or_else(|| told(which, format!("no state: {words:x?}")))?;
            let back = self.recovered(which, &mut state, &mut trial.done);
            back.map_err(|what| told(which, format!("from the words {words:x?}: {what}")))?;
        }
        Ok(())
    }
}

/// Designs in one precision: a law, its model, a good sample.
macro_rules! victims {
    ($($name:ident: $law:ty = $config:expr, $model:expr, good $good:expr;)*) => {
        /// All of them.
        ///
        /// # Panics
        /// Never: they are valid designs.
        pub fn victims() -> Vec<Box<dyn Victim>> {
            vec![$({
                let config = $config;
                let laws = [config.options.limits, Limits::NONE].map(|limits| {
                    let options = config.options.with_limits(limits);
                    <$law>::try_design(&Config { options, ..config }, $model).expect("a valid design")
                });
                Box::new(Twins::new(stringify!($name), laws, $good))
            }),*]
        }
    };
}

/// The joint with observers of order 2 in channels 2 and 4.
pub type Joint<T> = controller_core::controller!(T, FlexibleJoint<T>, order 4, observers of order 2 in [2, 4]);
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

victims! {
    joint: Joint<f32> = joint_config(ObserverGains::as_printed([100.0, 20.0])),
        FlexibleJoint::<f32>::new(&NOMINAL), good [0.1, 0.0, 0.0, 0.0];
    joint_f64: Joint<f64> = joint_config(ObserverGains::as_printed([100.0, 20.0])),
        FlexibleJoint::<f64>::new(&NOMINAL), good [0.1, 0.0, 0.0, 0.0];
    joint_of_3: JointOf3<f32> = joint_of_3(), FlexibleJoint::<f32>::new(&NOMINAL), good [0.1, -0.2, 0.3, 0.1];
    motor: Motor<f32> = motor(), Linear::<f32, 2>::new(&MOTOR), good [0.3, 0.1];
    motor_f64: Motor<f64> = motor(), Linear::<f64, 2>::new(&MOTOR), good [0.3, 0.1];
    bare: Bare<f32> = bare(), Linear::<f32, 3>::new(&THREE), good [0.3, 0.1, 0.0];
}
