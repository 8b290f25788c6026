//! Attacks on a controller, and the check of its recovery.
//!
//! After a valid tick every word of the state lies in the set M of its design (module `design` of the core, "Range").
//! From any state at most two valid samples lead there. Random samples find no fault here. The harmful samples had
//! values around 1e27 whose terms cancel to the last bit. The search therefore follows the directions in which the
//! control law demands nothing. A [`Victim`] is a design with its twin without limits, of six kinds in f32 and f64.

use crate::paper::{NOMINAL, joint_config};
use crate::strategy::{Rng, Trial};
use controller_core::{
    Config, ControlLaw, Controller, Fallback, FlexibleJoint, Health, LAYOUT, Limits, Linear, Nominal, NominalModel,
    ObserverGains, Options, Output, ReachingLaw, Real, Running, Surface, Words,
};
use std::collections::HashMap;

/// Overflow threshold of the sums in the control law, as a power of two.
pub trait Precision: Real + Send + Sync {
    /// Exponent at which numbers overflow: 2^BITS.
    const BITS: i32;
}
impl Precision for f32 {
    const BITS: i32 = 128;
}
impl Precision for f64 {
    const BITS: i32 = 1024;
}

/// Parameters of the set M.
#[derive(Clone, Debug)]
struct Set {
    lambda: f64,
    /// Gains of the control law, per observed channel and per entry A, B, C.
    k: Vec<Vec<f64>>,
    kx: Vec<f64>,
    kw: f64,
    u: [f64; 2],
    channels: Vec<usize>,
    r: usize,
}

/// Controller of any configuration.
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
        // 2^1024 is not an f64.
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

    /// Lists the words of the state that lie outside M, after a tick with sample `x`.
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
            // A_n enters the demand directly; its size is limited by the remainder of the other terms.
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

    /// Checks that u lies within the limits.
    fn holds_u<T: Real>(&self, u: T) -> Result<(), String> {
        let u = u.to_f64();
        if self.u[0] <= u && u <= self.u[1] { Ok(()) } else { Err(format!("u = {u} goes out")) }
    }
}

/// Returns the numbers of a state, without the flag in front of them.
fn numbers<T: Real>(state: &impl Words) -> Vec<f64> {
    let words: Vec<u32> = state.words().skip(1).collect();
    words.chunks(T::WORDS).map(|word| T::from_words([word[0], *word.get(1).unwrap_or(&0)]).to_f64()).collect()
}

/// Design under attack.
pub trait Victim: Send + Sync {
    /// Applies a cancelling sample, a damaged state and a state of NaN, each followed by the recovery check. Returns
    /// true if a cancelling sample was found and accepted.
    ///
    /// # Errors
    /// Names the value outside M and the attack that caused it.
    fn struck(&self, trial: &mut Trial) -> Result<bool, String>;

    /// Runs this many ticks with valid samples, random bits, reports and resets. State snapshots are saved and
    /// restored, and the design changes to its twin and back. The recovery check follows.
    ///
    /// # Errors
    /// Names the invalid u or the value outside M.
    fn driven(&self, ticks: usize, trial: &mut Trial) -> Result<(), String>;
}

/// Design and its twin without limits. `good` is a sample of an operating plant.
pub struct Twins<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize>
where
    T: Precision,
    M: NominalModel<T, N>,
{
    name: &'static str,
    laws: [Law<T, M, N, R, MASK, O>; 2],
    sets: [Set; 2],
    good: [T; N],
    /// States after a hundred valid samples.
    healthy: [State<T, M, N, R, MASK, O>; 2],
    /// Change in the demand per unit change of each sample entry.
    row: [f64; N],
}

type State<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> =
    <Law<T, M, N, R, MASK, O> as ControlLaw>::State;

impl<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> Twins<T, M, N, R, MASK, O>
where
    T: Precision,
    M: NominalModel<T, N>,
{
    /// Creates the pair and runs both for a hundred valid samples.
    ///
    /// # Panics
    /// If the controllers reject the first sample.
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

    /// Returns the state of the limited design after a hundred valid samples.
    pub fn healthy(&self) -> State<T, M, N, R, MASK, O> {
        self.healthy[0].clone()
    }

    /// Feeds valid samples until the state is in M and a sample is accepted. Returns the number of rejected samples.
    ///
    /// # Errors
    /// Names the word that lies outside M.
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
                // A rejected sample leaves x and P unchanged; the next valid sample does not read them.
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

    /// Searches for a sample whose terms cancel: first along the directions in which the control law demands nothing,
    /// then bit by bit.
    fn cancelling(&self, which: usize, trial: &mut Trial) -> Option<[T; N]> {
        let rng = &mut trial.rng;
        let digits = if T::WORDS == 1 { 37.0 } else { 300.0 };
        let scale = 10f64.powf(rng.within(2.0, digits));
        // The entries have similar weight in the demand; the last one cancels the sum of the others.
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

    /// Returns an entry of a sample: from an operating plant, or random bits.
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

/// Flips bits and replaces words at random; the flag in front of them stays one.
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
        // State of the tick without its guard after a NaN sample.
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
        // Layout of the words: a hash, the started flag, the state, a checksum.
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

/// Designs in one precision: a control law, its model, a valid sample.
macro_rules! victims {
    ($($name:ident: $law:ty = $config:expr, $model:expr, good $good:expr;)*) => {
        /// Returns all designs under attack.
        ///
        /// # Panics
        /// Never: the designs are valid.
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
