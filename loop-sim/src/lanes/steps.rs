//! Vectorised step of the solver: the step of [`solver`](crate::solver), lane by lane.
//!
//! Each evaluation of the right-hand side and each midpoint is a separate loop over lanes, in the order of the plant
//! alone. Lanes have their own time and step length. With a common step length a lane would mostly wait, since friction
//! needs fine steps only near rest.

use super::wide::Wide;
use super::{Instructions, LANES};
use crate::plant::shafts::{self, Numbers};
use crate::plant::{Parts, Regime};
use crate::signal::Signal;
use crate::sine;
use crate::solver::{self, ROWS, Stride, WEIGHTS};

/// Right-hand sides of the plants of all lanes.
pub(super) trait Rates<const N: usize> {
    /// Begins a step in every lane, at its time.
    fn begin(&mut self, t_s: &Wide);

    /// Computes dx/dt of every lane. Sets `outside` for a lane whose value differs from the plant alone.
    fn rates(&mut self, instructions: Instructions, at: At<'_, N>, dx: &mut [Wide; N], outside: &mut Wide<u64>);
}

/// Right-hand sides whose plants are replaced during the batch.
pub(super) trait Bodies<'a, const N: usize>: Rates<N> {
    /// Replaces the plant of a lane.
    fn set(&mut self, l: usize, parts: Parts<'a>);

    /// Returns true if a plant of the batch has events.
    fn has_events(&self) -> bool {
        false
    }

    /// Sets the regime of a lane until its next event.
    fn set_regime(&mut self, _l: usize, _regime: Regime) {}
}

/// Point at which a right-hand side is evaluated.
#[derive(Clone, Copy)]
pub(super) struct At<'a, const N: usize> {
    pub(super) t_s: &'a Wide,
    pub(super) x: &'a [Wide; N],
    pub(super) u: &'a Wide,
}

/// States of the lanes during a step, with its buffers.
pub(super) struct Steps<const N: usize> {
    instructions: Instructions,
    pub(super) x: [Wide; N],
    pub(super) u: Wide,
    pub(super) t_s: Wide,
    h_s: Wide,
    rows: Wide<u64>,
    /// Slope at the beginning of a step.
    pub(super) first: [Wide; N],
    /// Increment of the step, and the difference between its last two rows. Undefined in a marked lane.
    pub(super) increment: [Wide; N],
    pub(super) difference: Wide,
    pub(super) outside: Wide<u64>,
    less: [Wide; N],
    midpoint: Midpoint<N>,
}

/// One row of the extrapolation in progress.
struct Midpoint<const N: usize> {
    s: Wide,
    t_s: Wide,
    at: [Wide; N],
    before: [Wide; N],
    now: [Wide; N],
    slope: [Wide; N],
}

impl<const N: usize> Steps<N> {
    pub(super) fn new(instructions: Instructions) -> Box<Self> {
        let none = Wide::of_all(0.0);
        let midpoint =
            Midpoint { s: none, t_s: none, at: [none; N], before: [none; N], now: [none; N], slope: [none; N] };
        Box::new(Self {
            instructions,
            x: [none; N],
            u: none,
            t_s: none,
            h_s: none,
            rows: Wide::of_all(1),
            first: [none; N],
            increment: [none; N],
            difference: none,
            outside: Wide::of_all(0),
            less: [none; N],
            midpoint,
        })
    }

    /// Computes the slopes at the beginning of a step.
    pub(super) fn begin(&mut self, bodies: &mut impl Rates<N>) {
        let Self { instructions, x, u, t_s, first, outside, .. } = self;
        *outside = Wide::of_all(0);
        bodies.begin(t_s);
        bodies.rates(*instructions, At { t_s, x, u }, first, outside);
    }

    /// Sets the next step of a lane.
    pub(super) fn set(&mut self, l: usize, stride: Stride) {
        self.h_s[l] = stride.h_s;
        self.rows[l] = stride.rows as u64;
    }

    /// Leaves a lane without a step.
    pub(super) fn rest(&mut self, l: usize) {
        self.rows[l] = 1;
    }

    pub(super) fn stride(&self, l: usize) -> Stride {
        Stride { h_s: self.h_s[l], rows: self.rows[l] as usize }
    }

    /// Computes the step from the current point.
    pub(super) fn step(&mut self, bodies: &mut impl Rates<N>) {
        let Self { instructions, x, u, t_s, h_s, rows, first, increment, difference, outside, less, midpoint } = self;
        let instructions = *instructions;
        let Midpoint { s, t_s: inside_s, at, before, now, slope } = midpoint;
        (*increment, *less) = ([Wide::of_all(0.0); N], [Wide::of_all(0.0); N]);
        let [least, most] = rows.0.iter().fold([ROWS as u64, 1], |[least, most], of| [least.min(*of), most.max(*of)]);
        for row in 0..most as usize {
            let substeps = 2 * (row + 1);
            start_all(instructions, substeps as f64, x, h_s, first, s, at, before, now);
            for k in 1..substeps {
                time_all(instructions, t_s, k as f64, s, inside_s);
                bodies.rates(instructions, At { t_s: inside_s, x: at, u }, slope, outside);
                midpoint_all(instructions, x, s, slope, at, before, now);
            }
            if least == most {
                let [weight, without] = [most, most - 1].map(|rows| WEIGHTS[rows as usize][row]);
                sum_all(instructions, weight, without, now, increment, less);
            } else {
                let weights = std::array::from_fn(|rows| WEIGHTS[rows][row]);
                sum_some(instructions, row as u64, &weights, rows, now, increment, less);
            }
        }
        differ_all(instructions, h_s, x, first, increment, less, difference);
    }
}

vectorised! {
    fn start_all[N; const N: usize](
        substeps: f64,
        x: &[Wide; N],
        h_s: &Wide,
        first: &[Wide; N],
        s: &mut Wide,
        at: &mut [Wide; N],
        before: &mut [Wide; N],
        now: &mut [Wide; N],
    ) {
        for l in 0..LANES {
            s[l] = h_s[l] / substeps;
        }
        for i in 0..N {
            for l in 0..LANES {
                before[i][l] = 0.0;
                now[i][l] = s[l] * first[i][l];
                at[i][l] = x[i][l] + now[i][l];
            }
        }
    }
}

vectorised! {
    fn time_all[;](t_s: &Wide, k: f64, s: &Wide, inside_s: &mut Wide,) {
        for l in 0..LANES {
            inside_s[l] = t_s[l] + k * s[l];
        }
    }
}

vectorised! {
    fn midpoint_all[N; const N: usize](
        x: &[Wide; N],
        s: &Wide,
        slope: &[Wide; N],
        at: &mut [Wide; N],
        before: &mut [Wide; N],
        now: &mut [Wide; N],
    ) {
        for i in 0..N {
            for l in 0..LANES {
                let next = before[i][l] + 2.0 * s[l] * slope[i][l];
                before[i][l] = now[i][l];
                now[i][l] = next;
                at[i][l] = x[i][l] + next;
            }
        }
    }
}

vectorised! {
    fn sum_all[N; const N: usize](
        weight: f64,
        without: f64,
        across: &[Wide; N],
        increment: &mut [Wide; N],
        less: &mut [Wide; N],
    ) {
        for i in 0..N {
            for l in 0..LANES {
                increment[i][l] += weight * across[i][l];
                less[i][l] += without * across[i][l];
            }
        }
    }
}

vectorised! {
    /// Sums a row where lanes use different numbers of rows. `weights` are the weights of this row for each number of
    /// rows.
    fn sum_some[N; const N: usize](
        row: u64,
        weights: &[f64; ROWS + 1],
        rows: &Wide<u64>,
        across: &[Wide; N],
        increment: &mut [Wide; N],
        less: &mut [Wide; N],
    ) {
        let (mut weight, mut without) = (Wide::of_all(0.0), Wide::of_all(0.0));
        for taken in 1..=ROWS {
            for l in 0..LANES {
                let is_it = rows[l] == taken as u64;
                weight[l] = if is_it { weights[taken] } else { weight[l] };
                without[l] = if is_it { weights[taken - 1] } else { without[l] };
            }
        }
        for i in 0..N {
            for l in 0..LANES {
                let sums = [increment[i][l] + weight[l] * across[i][l], less[i][l] + without[l] * across[i][l]];
                increment[i][l] = if row < rows[l] { sums[0] } else { increment[i][l] };
                less[i][l] = if row < rows[l] { sums[1] } else { less[i][l] };
            }
        }
    }
}

vectorised! {
    fn differ_all[N; const N: usize](
        h_s: &Wide,
        x: &[Wide; N],
        first: &[Wide; N],
        increment: &[Wide; N],
        less: &[Wide; N],
        difference: &mut Wide,
    ) {
        for l in 0..LANES {
            let of = |row: &[Wide; N]| -> [f64; N] { std::array::from_fn(|i| row[i][l]) };
            difference[l] = solver::difference(h_s[l], &of(x), &of(first), &of(increment), &of(less));
        }
    }
}

/// Motors or joints of all lanes.
pub(super) struct Shafts<'a, const G: usize> {
    /// Coefficients. With friction that holds, the direction of sliding replaces 1/ω_t, and 1/J is 0 while the shaft
    /// stands.
    numbers: Box<[[Wide; 4]; G]>,
    per_inertia: Wide,
    /// True if the torque of any plant varies with its angle. `holds` is true if the friction of any plant holds.
    has_waves: bool,
    holds: bool,
    loads: [Option<&'a Signal>; LANES],
    /// Loads that vary within a step.
    varying: Vec<(usize, &'a Signal)>,
    load: Wide,
}

impl<const G: usize> Shafts<'_, G> {
    pub(super) fn new(has_waves: bool, holds: bool) -> Self {
        let none = Wide::of_all(0.0);
        let numbers = Box::new([[none; 4]; G]);
        let (loads, varying) = ([None; LANES], Vec::new());
        Self { numbers, per_inertia: none, has_waves, holds, loads, varying, load: none }
    }
}

impl<'a, const N: usize, const G: usize> Bodies<'a, N> for Shafts<'a, G> {
    fn set(&mut self, l: usize, parts: Parts<'a>) {
        let Parts::Shafts { numbers, load } = parts else { return };
        for (wide, row) in self.numbers.iter_mut().zip(numbers) {
            for (wide, number) in wide.iter_mut().zip(row) {
                wide[l] = *number;
            }
        }
        self.per_inertia[l] = self.numbers[0][0][l];
        self.loads[l] = Some(load);
        self.varying.retain(|(of, _)| *of != l);
        if load.varies() {
            self.varying.push((l, load));
        }
    }

    fn has_events(&self) -> bool {
        self.holds
    }

    fn set_regime(&mut self, l: usize, regime: Regime) {
        self.numbers[0][0][l] = if regime == Regime::Held { 0.0 } else { self.per_inertia[l] };
        // A shaft that stands from the start has no direction yet. 0 times the infinite 1/ω_t would be NaN.
        self.numbers[2][3][l] = if let Regime::Sliding { sign, .. } = regime { sign.into() } else { 0.0 };
    }
}

impl<const N: usize, const G: usize> Rates<N> for Shafts<'_, G> {
    fn begin(&mut self, t_s: &Wide) {
        for (l, load) in self.loads.iter().enumerate() {
            self.load[l] = load.map_or(0.0, |load| load.value(t_s[l]));
        }
    }

    fn rates(&mut self, instructions: Instructions, at: At<'_, N>, dx: &mut [Wide; N], outside: &mut Wide<u64>) {
        let At { t_s, x, u } = at;
        for (l, load) in &self.varying {
            self.load[*l] = load.value(t_s[*l]);
        }
        let rates = match (self.has_waves, self.holds) {
            (false, false) => rates_all::<N, G, false, false>,
            (false, true) => rates_all::<N, G, false, true>,
            (true, false) => rates_all::<N, G, true, false>,
            (true, true) => rates_all::<N, G, true, true>,
        };
        rates(instructions, &self.numbers, x, u, &self.load, dx, outside);
    }
}

vectorised! {
    fn rates_all[N, G, WAVES, HOLDS; const N: usize, const G: usize, const WAVES: bool, const HOLDS: bool](
        numbers: &[[Wide; 4]; G],
        x: &[Wide; N],
        u: &Wide,
        load: &Wide,
        dx: &mut [Wide; N],
        outside: &mut Wide<u64>,
    ) {
        for l in 0..LANES {
            let now: [f64; N] = std::array::from_fn(|i| x[i][l]);
            let numbers: Numbers<G> = std::array::from_fn(|i| std::array::from_fn(|j| numbers[i][j][l]));
            let [angle, speed] = shafts::motor_at(N).map(|at| now[at]);
            let friction = if HOLDS {
                shafts::sliding(numbers[2], numbers[2][3], speed)
            } else {
                shafts::friction(numbers[2], speed)
            };
            let mut is_within = true;
            let waves = if WAVES {
                is_within &= sine::is_within(numbers[1][1] * angle);
                is_within &= sine::is_within(numbers[1][3] * angle);
                shafts::waves(numbers[1], angle, |x| sine::sin_cos(x).0)
            } else {
                [0.0; 2]
            };
            let sin_link = if N > 3 {
                is_within &= sine::is_within(now[0]);
                sine::sin_cos(now[0]).0
            } else {
                0.0
            };
            let rates = shafts::rates(&numbers, &now, u[l], load[l], friction, waves, sin_link);
            for i in 0..N {
                dx[i][l] = rates[i];
            }
            outside[l] |= u64::from(!is_within);
        }
    }
}
