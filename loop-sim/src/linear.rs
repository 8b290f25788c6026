//! A loop at rest as matrices: what poles, margins and noise are computed of.
//!
//! With s what the law remembers, y its sample, u what it asks for, h what it is told that the actuator holds, x the
//! state of the plant and v what the plant feels over one period T, small changes from rest obey
//!
//! $$ s^+ = A s + B y + E h, \qquad u = C s + D y, \qquad x^+ = \Phi x + \Gamma v $$
//!
//! What a law tells beside u, σ\* and its estimates, is a row like that of u. Within a tick a plant obeys
//! $\dot x = F x + G v$, which [`slopes`] has of its right-hand side.
//!
//! No formula of a law or of a plant is written here. [`LinearTick`] is the very tick, in f64, with every number a
//! little up and a little down, and half of the difference; [`LinearPlant`] likewise is the plant under the solver of
//! the runs. A count can only change by whole steps: the encoder is taken so fine that one step is small. At a rest of
//! zeros nothing is rounded away however small the change is, so the entries are exact to the last digits; at another
//! rest (the benchmark's u = -1) to 1e-10.

use std::iter;

use controller_core::{ControlLaw, Output, Real, Words};

use crate::plant::Plant;
use crate::solver::{self, SolverError};

/// A change about a rest of zeros, where only products are rounded.
const TINY: f64 = 1.0 / (1_u64 << 36) as f64;
/// About any other rest: half of the digits for the change, half for what it does.
const SMALL: f64 = 1.0 / (1_u64 << 20) as f64;

/// What a tick of a law at rest makes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ticked {
    /// What it remembers then.
    pub memory: Vec<f64>,
    /// What it asks for.
    pub u: f64,
    /// σ\*, then the estimates of d_1, d_2, .., 0 where there is no observer; nothing of a law without them.
    pub told: Vec<f64>,
}

/// A law in f64 that stands at rest, as a map of numbers. A sample is states, or angles in rad where there are
/// encoders.
pub trait LawAtRest: Send {
    /// How small a change of each number of the memory, and then of the sample, may be; 0 for any.
    fn steps(&self) -> Vec<f64>;

    /// What it remembers, and u.
    fn rest(&self) -> (Vec<f64>, f64);

    /// One tick from a memory. `held` is what it is told that the actuator holds, if it is told.
    fn tick(&self, memory: &[f64], sample: &[f64], held: Option<f64>) -> Ticked;
}

/// Any [`ControlLaw`] in f64 as such a map.
pub struct Still {
    law: Box<dyn WordByWord>,
    inputs: usize,
    /// Rad per count of each encoder; empty for a law that reads states.
    units_rad: Vec<f64>,
    /// Words of its state that are whole numbers, and then the others as numbers.
    whole: Vec<u32>,
    numbers: Vec<f64>,
    u: f64,
}

/// A law whose state is a list of words. [`Still`] is compiled once, and of each law only this.
trait WordByWord: Send {
    /// The state after three ticks with this sample, and u; `None` if it does not start there.
    fn settled(&self, sample: &[f64]) -> Option<(Vec<u32>, f64)>;

    /// One tick: the state becomes the next one. u, and what it tells beside it.
    fn tick(&self, state: &mut Vec<u32>, sample: &[f64], held: Option<f64>) -> (f64, Vec<f64>);
}

/// A law, and how numbers become its sample and its estimates become numbers.
struct Known<L: ControlLaw, S> {
    law: L,
    sample: S,
    d_hat: fn(L::Estimates) -> Vec<f64>,
}

impl<L, S> WordByWord for Known<L, S>
where
    L: ControlLaw<Scalar = f64, Output = Output<f64>> + Send,
    S: Fn(&[f64]) -> L::Sample + Send,
{
    fn settled(&self, sample: &[f64]) -> Option<(Vec<u32>, f64)> {
        let sample = (self.sample)(sample);
        let mut state = self.law.start(&sample)?;
        let mut u = 0.0;
        // The first tick after a start has none before it.
        for _ in 0..3 {
            u = self.law.tick(&mut state, &sample).u;
            L::report_applied(&mut state, u);
        }
        Some((state.words().collect(), u))
    }

    fn tick(&self, words: &mut Vec<u32>, sample: &[f64], held: Option<f64>) -> (f64, Vec<f64>) {
        let Some(mut state) = L::State::from_words(&mut words.drain(..)) else {
            unreachable!("finite numbers in the order of the words of a state are a state");
        };
        let Output { u, sigma_star, .. } = self.law.tick(&mut state, &(self.sample)(sample));
        let mut told = (self.d_hat)(self.law.estimates(&state));
        told.insert(0, sigma_star);
        if let Some(held) = held {
            L::report_applied(&mut state, held);
        }
        words.extend(state.words());
        (u, told)
    }
}

impl Still {
    /// A law that has ticked at rest with a sample of zeros. `sample` makes one of numbers: of `inputs` states, or of
    /// the counts of encoders, one for each entry of `units_rad`. `d_hat` has the estimates of d_1, d_2, .. . `None` if
    /// it does not start there.
    pub fn new<L, S>(
        law: L,
        inputs: usize,
        units_rad: Vec<f64>,
        sample: S,
        d_hat: fn(L::Estimates) -> Vec<f64>,
    ) -> Option<Self>
    where
        L: ControlLaw<Scalar = f64, Output = Output<f64>> + Send + 'static,
        S: Fn(&[f64]) -> L::Sample + Send + 'static,
    {
        Self::of(Box::new(Known { law, sample, d_hat }), inputs, units_rad)
    }

    fn of(law: Box<dyn WordByWord>, inputs: usize, units_rad: Vec<f64>) -> Option<Self> {
        let (words, u) = law.settled(&vec![0.0; inputs])?;
        // A flag; with encoders the count of the last sample and that since the base, of each, and the turn.
        let flags = if units_rad.is_empty() { 1 } else { 2 + 2 * units_rad.len() };
        let (whole, rest) = words.split_at(flags);
        let numbers = rest.chunks_exact(2).map(|pair| f64::from_words([pair[0], pair[1]])).collect();
        Some(Self { law, inputs, whole: whole.to_vec(), numbers, u, units_rad })
    }
}

impl LawAtRest for Still {
    fn steps(&self) -> Vec<f64> {
        let numbers = iter::repeat_n(0.0, self.numbers.len());
        let sample = if self.units_rad.is_empty() { vec![0.0; self.inputs] } else { self.units_rad.clone() };
        self.units_rad.iter().copied().chain(numbers).chain(sample).collect()
    }

    fn rest(&self) -> (Vec<f64>, f64) {
        (self.units_rad.iter().map(|_| 0.0).chain(self.numbers.iter().copied()).collect(), self.u)
    }

    fn tick(&self, memory: &[f64], sample: &[f64], held: Option<f64>) -> Ticked {
        let encoders = self.units_rad.len();
        let counts = |angles: &[f64]| -> Vec<f64> {
            angles.iter().zip(&self.units_rad).map(|(angle, unit)| libm::round(angle / unit)).collect()
        };
        let (last, numbers) = memory.split_at(encoders);
        let mut words = self.whole.clone();
        for (i, count) in counts(last).into_iter().enumerate() {
            let count = count as i32 as u32;
            (words[1 + i], words[1 + encoders + i]) = (count, count);
        }
        words.extend(numbers.iter().flat_map(|number| number.to_words()));
        let counted = counts(sample);
        let (u, told) = self.law.tick(&mut words, if encoders > 0 { &counted } else { sample }, held);
        let last = self.units_rad.iter().enumerate().map(|(i, unit)| f64::from(words[1 + i] as i32) * unit);
        let pairs = words[self.whole.len()..].chunks_exact(2);
        let memory = last.chain(pairs.map(|pair| f64::from_words([pair[0], pair[1]]))).collect();
        Ticked { memory, u, told }
    }
}

/// Rows of numbers.
pub type Matrix = Vec<Vec<f64>>;

/// A, B, C, D, E of the module's head.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearTick {
    /// A: what each number of the memory makes of each, row by row.
    pub a: Matrix,
    /// B: what the sample makes of them.
    pub b: Matrix,
    /// C.
    pub c: Vec<f64>,
    /// D.
    pub d: Vec<f64>,
    /// E; zeros for a law that is not told.
    pub e: Vec<f64>,
    /// Of each number that it tells, as C and D are of u.
    pub told: Vec<[Vec<f64>; 2]>,
    /// u at rest.
    pub u: f64,
}

impl LinearTick {
    /// Of a law at rest, which `is_told` what is held, or not.
    pub fn of(law: &dyn LawAtRest, is_told: bool) -> Self {
        let (rest, u) = law.rest();
        let (steps, order) = (law.steps(), rest.len());
        let inputs = steps.len() - order;
        let sample = vec![0.0; inputs];
        let free = if u == 0.0 && rest.iter().all(|number| *number == 0.0) { TINY } else { SMALL };
        let column = |j: usize| -> Ticked {
            let step = steps.get(j).copied().filter(|step| *step > 0.0).unwrap_or(free);
            let moved = |step: f64| {
                let (mut memory, mut sample, mut held) = (rest.clone(), sample.clone(), u);
                match j {
                    j if j < order => memory[j] += step,
                    j if j < order + inputs => sample[j - order] += step,
                    _ => held += step,
                }
                law.tick(&memory, &sample, is_told.then_some(held))
            };
            let (up, down) = (moved(step), moved(-step));
            let slope = |up: f64, down: f64| (up - down) / (2.0 * step);
            let slopes = |up: &[f64], down: &[f64]| up.iter().zip(down).map(|(up, down)| slope(*up, *down)).collect();
            Ticked {
                memory: slopes(&up.memory, &down.memory),
                u: slope(up.u, down.u),
                told: slopes(&up.told, &down.told),
            }
        };
        let columns: Vec<_> = (0..=order + inputs).map(column).collect();
        let rows = |range: std::ops::Range<usize>| {
            (0..order).map(|i| columns[range.clone()].iter().map(|column| column.memory[i]).collect()).collect()
        };
        let of_u = |range: std::ops::Range<usize>| columns[range].iter().map(|column| column.u).collect::<Vec<_>>();
        let e = if is_told { columns[order + inputs].memory.clone() } else { vec![0.0; order] };
        let a = without_idle(rows(0..order), &of_u(0..order));
        let of_told = |i: usize, range: std::ops::Range<usize>| columns[range].iter().map(|it| it.told[i]).collect();
        let told = 0..columns.first().map_or(0, |column| column.told.len());
        Self {
            told: told.map(|i| [of_told(i, 0..order), of_told(i, order..order + inputs)]).collect(),
            a,
            b: rows(order..order + inputs),
            c: of_u(0..order),
            d: of_u(order..order + inputs),
            e,
            u,
        }
    }
}

/// What a tick leaves as it is and nothing else reads, number `i` of `order`: it may stay so for ever, and is no part
/// of the loop. `entry` is of what each number is made, row and column.
pub fn is_idle(i: usize, order: usize, entry: impl Fn(usize, usize) -> f64) -> bool {
    entry(i, i) == 1.0 && (0..order).all(|j| j == i || entry(j, i) == 0.0)
}

fn without_idle(mut a: Matrix, c: &[f64]) -> Matrix {
    for i in (0..a.len()).filter(|&i| c[i] == 0.0) {
        if is_idle(i, a.len(), |row, column| a[row][column]) {
            a[i][i] = 0.0;
        }
    }
    a
}

/// Φ and Γ of the module's head.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearPlant {
    /// Φ: what each state makes of each in one period, row by row.
    pub phi: Matrix,
    /// Γ: what a unit of input, held over the period, makes of each.
    pub gamma: Vec<f64>,
}

impl LinearPlant {
    /// Of a plant at x = 0 under the u that holds it there, from t = 0 over one period.
    ///
    /// # Errors
    /// When it cannot be integrated.
    pub fn of(plant: &dyn Plant, u: f64, period_s: f64) -> Result<Self, SolverError> {
        let n = plant.order();
        let step = if u == 0.0 { TINY } else { SMALL };
        let column = |j: usize| -> Result<Vec<f64>, SolverError> {
            let moved = |step: f64| {
                let mut x = vec![0.0; n];
                let mut u = u;
                *x.get_mut(j).unwrap_or(&mut u) += step;
                solver::advance(plant, 0.0, period_s, u, &mut x).map(|()| x)
            };
            let (up, down) = (moved(step)?, moved(-step)?);
            Ok(up.iter().zip(down).map(|(up, down)| (up - down) / (2.0 * step)).collect())
        };
        let columns = (0..=n).map(column).collect::<Result<Vec<_>, _>>()?;
        let phi = (0..n).map(|i| columns[..n].iter().map(|column| column[i]).collect()).collect();
        Ok(Self { phi, gamma: columns[n].clone() })
    }
}

/// What a small change of each state, and then of the input, makes of each number of a plant at x = 0 under u, row by
/// row: of its right-hand side F and G of the module's head, of its lumped disturbances what a wrong model makes.
pub fn slopes(order: usize, u: f64, of: impl Fn(&[f64], f64, &mut [f64])) -> Matrix {
    let column = |j: usize| {
        let moved = |step: f64| {
            let (mut x, mut u, mut found) = (vec![0.0; order], u, vec![0.0; order]);
            *x.get_mut(j).unwrap_or(&mut u) += step;
            of(&x, u, &mut found);
            found
        };
        let (up, down) = (moved(SMALL), moved(-SMALL));
        up.iter().zip(down).map(|(up, down)| (up - down) / (2.0 * SMALL)).collect::<Vec<_>>()
    };
    let columns: Vec<_> = (0..=order).map(column).collect();
    (0..order).map(|i| columns.iter().map(|column| column[i]).collect()).collect()
}
