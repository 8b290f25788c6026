//! Linear model of a closed loop at rest, from which poles, margins and noise are computed.
//!
//! The controller has the memory s, the sample y and the output u, and it receives the held value h. The plant has the
//! state x, and its input is v over one period T. Small changes from rest obey
//!
//! $$ s^+ = A s + B y + E h, \qquad u = C s + D y, \qquad x^+ = \Phi x + \Gamma v $$
//!
//! The other outputs of a controller, σ\* and its estimates, are rows like the row of u. Within a tick a plant obeys
//! $\dot x = F x + G v$. [`slopes`] computes F and G from the right-hand side.
//!
//! No formula of a controller or plant is repeated here. [`LinearTick`] differentiates the tick itself in f64, by
//! central differences over every number. [`LinearPlant`] differentiates the plant under the solver of the runs. A
//! count changes only by integers, so the encoder is made so fine that one count is a small change.
//!
//! About a rest of zeros no change is lost by rounding, however small it is, and the entries are exact to the last
//! digits. About another rest (u = -1 in the benchmark) they are exact to 1e-10.

use std::iter;
use std::sync::{Mutex, PoisonError};

use controller_core::{ControlLaw, Output, Real, Words};

use crate::plant::Plant;
use crate::port::numbers::{self, FLAG};
use crate::port::{ControllerPort, Tick};
use crate::solver::{self, SolverError};

/// Difference step about a rest of zeros, where only products are rounded.
const TINY: f64 = 1.0 / (1_u64 << 36) as f64;
/// Difference step about any other rest: half of the digits for the change, half for its effect.
const SMALL: f64 = 1.0 / (1_u64 << 20) as f64;

/// Result of one tick of a controller at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ticked {
    /// Memory of the controller after the tick.
    pub memory: Vec<f64>,
    /// Output u.
    pub u: f64,
    /// σ\*, then the estimates of d_1, d_2, .., 0 where there is no observer. Empty for a controller without them.
    pub told: Vec<f64>,
}

/// Controller in f64 at rest, as a map of numbers. A sample has states, or angles in rad if there are encoders.
pub trait LawAtRest: Send + Sync {
    /// Returns the smallest change of each number of the memory, then of the sample. 0 means any change.
    fn steps(&self) -> Vec<f64>;

    /// Returns the memory and u at rest.
    fn rest(&self) -> (Vec<f64>, f64);

    /// Runs one tick from a memory. `held` is the actuator's held value, if the controller receives it.
    fn tick(&self, memory: &[f64], sample: &[f64], held: Option<f64>) -> Ticked;
}

/// Map of any [`ControlLaw`] in f64.
pub struct Still {
    law: Box<dyn WordByWord>,
    inputs: usize,
    /// Angle per count of each encoder, rad. Empty for a controller that reads states.
    units_rad: Vec<f64>,
    /// Integer words of the state. The numbers of the state follow in `numbers`.
    whole: Vec<u32>,
    numbers: Vec<f64>,
    u: f64,
}

/// Controller whose state is a list of words. Only this part is compiled per controller, and [`Still`] is compiled
/// once.
trait WordByWord: Send + Sync {
    /// Returns the state and u after three ticks with this sample, or `None` if the controller does not start there.
    fn settled(&self, sample: &[f64]) -> Option<(Vec<u32>, f64)>;

    /// Runs one tick and replaces the state. Returns u and the other outputs.
    fn tick(&self, state: &mut Vec<u32>, sample: &[f64], held: Option<f64>) -> (f64, Vec<f64>);
}

/// Controller with the conversions from numbers to its sample and from its estimates to numbers.
struct ConvertedLaw<L: ControlLaw, S> {
    law: L,
    sample: S,
    d_hat: fn(L::Estimates) -> Vec<f64>,
}

impl<L, S> WordByWord for ConvertedLaw<L, S>
where
    L: ControlLaw<Scalar = f64, Output = Output<f64>> + Send + Sync,
    S: Fn(&[f64]) -> L::Sample + Send + Sync,
{
    fn settled(&self, sample: &[f64]) -> Option<(Vec<u32>, f64)> {
        let sample = (self.sample)(sample);
        let mut state = self.law.start(&sample)?;
        let mut u = 0.0;
        // The first tick after a start has no tick before it.
        for _ in 0..3 {
            u = self.law.tick(&mut state, &sample).u;
            L::report_applied(&mut state, u);
        }
        Some((state.words().collect(), u))
    }

    fn tick(&self, words: &mut Vec<u32>, sample: &[f64], held: Option<f64>) -> (f64, Vec<f64>) {
        // The same type of iterator as in `port::numbers`, so that the function exists once.
        let Some(mut state) = L::State::from_words(&mut std::mem::take(words).into_iter()) else {
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

/// Controller behind a port, in f64. The state has one flag before its numbers.
struct OfPort(Mutex<Box<dyn ControllerPort>>, usize);

impl OfPort {
    fn tick(port: &mut dyn ControllerPort, sample: &[f64]) -> Tick {
        port.tick(sample).unwrap_or_else(|_| unreachable!("a controller in this process never fails"))
    }
}

impl WordByWord for OfPort {
    fn settled(&self, sample: &[f64]) -> Option<(Vec<u32>, f64)> {
        let mut port = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut u = 0.0;
        // The first tick after a start has no tick before it.
        for _ in 0..3 {
            u = Self::tick(port.as_mut(), sample).u;
            port.report_applied(u);
        }
        let state = port.state();
        let (started, numbers) = state.split_first()?;
        (*started == 1.0).then(|| (numbers::words::<f64>(numbers, FLAG), u))
    }

    fn tick(&self, state: &mut Vec<u32>, sample: &[f64], held: Option<f64>) -> (f64, Vec<f64>) {
        let mut port = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        port.set_state(&[vec![1.0], numbers::numbers::<f64>(state, FLAG)].concat());
        let tick = Self::tick(port.as_mut(), sample);
        if let Some(held) = held {
            port.report_applied(held);
        }
        *state = numbers::words::<f64>(&port.state()[1..], FLAG);
        (tick.u, [&[tick.sigma_star][..], &tick.d_hat()[..self.1]].concat())
    }
}

impl Still {
    /// Runs a controller of a chain with `order` states at rest with a sample of zeros and returns its map. Returns
    /// `None` if it does not start there. The controller is in f64 and has not started.
    pub(crate) fn of_port(port: Box<dyn ControllerPort>, order: usize) -> Option<Self> {
        Self::of(Box::new(OfPort(Mutex::new(port), order)), order, Vec::new())
    }

    /// Runs a controller at rest with a sample of zeros and returns its map. Returns `None` if it does not start there.
    ///
    /// `sample` converts numbers to a sample: `inputs` states, or the counts of encoders, one for each entry of
    /// `units_rad`. `d_hat` extracts the estimates of d_1, d_2, ..
    pub(crate) fn new<L, S>(
        law: L,
        inputs: usize,
        units_rad: Vec<f64>,
        sample: S,
        d_hat: fn(L::Estimates) -> Vec<f64>,
    ) -> Option<Self>
    where
        L: ControlLaw<Scalar = f64, Output = Output<f64>> + Send + Sync + 'static,
        S: Fn(&[f64]) -> L::Sample + Send + Sync + 'static,
    {
        Self::of(Box::new(ConvertedLaw { law, sample, d_hat }), inputs, units_rad)
    }

    fn of(law: Box<dyn WordByWord>, inputs: usize, units_rad: Vec<f64>) -> Option<Self> {
        let (words, u) = law.settled(&vec![0.0; inputs])?;
        // Without encoders: one flag. With encoders: per encoder the last count and the count since the base, and the
        // sign.
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

/// Matrix as rows of numbers.
pub type Matrix = Vec<Vec<f64>>;

/// Matrices A, B, C, D and E of the module documentation.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearTick {
    /// Matrix A, row by row: the effect of the memory on the next memory.
    pub a: Matrix,
    /// Matrix B: the effect of the sample on the next memory.
    pub b: Matrix,
    /// Row C: the effect of the memory on u.
    pub c: Vec<f64>,
    /// Row D: the effect of the sample on u.
    pub d: Vec<f64>,
    /// Column E: the effect of the held value on the next memory. Zeros for a controller that does not receive it.
    pub e: Vec<f64>,
    /// Rows like C and D for σ\* and each estimate.
    pub told: Vec<[Vec<f64>; 2]>,
    /// Output u at rest.
    pub u: f64,
}

impl LinearTick {
    /// Linearises a controller at rest. `is_told` is true if the controller receives the held value.
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

/// Returns true if a tick leaves number `i` of `order` unchanged and no other number depends on it. Such a number may
/// keep its value for ever and is not part of the loop. `entry` returns the matrix entry at a row and a column.
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

/// Matrices Φ and Γ of the module documentation.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearPlant {
    /// Matrix Φ, row by row: the effect of each state over one period.
    pub phi: Matrix,
    /// Column Γ: the effect of a unit of input that is held over the period.
    pub gamma: Vec<f64>,
}

impl LinearPlant {
    /// Linearises a plant at x = 0 over one period from t = 0, under the u that holds it there.
    ///
    /// # Errors
    /// Fails if the plant cannot be integrated.
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

/// Returns the slopes of a function of a plant at x = 0 under u, row by row: by each state, then by the input. The
/// slopes of the right-hand side are F and G of the module documentation. The slopes of the lumped disturbances are the
/// effect of a wrong model.
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
