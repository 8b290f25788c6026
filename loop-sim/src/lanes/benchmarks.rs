//! Example 1 in a vectorised batch: the solver's step from tick to tick, all lanes at the same time.
//!
//! At the usual periods of a controller one step of the solver crosses a tick, and that step is a loop over lanes. A
//! lane that needs more steps, has a jump inside the tick or a state far away is advanced alone over that tick.

use super::signals::Signals;
use super::steps::{At, Rates, Steps};
use super::wide::Wide;
use super::{Instructions, LANES, Plants, Trial};
use crate::exponential;
use crate::plant::benchmark::{d1_of_state, fastest_rad_s, rates};
use crate::plant::{Benchmark, Parts, Plant};
use crate::solver::{self, RUNAWAY, STEP_ANGLE, Stride};

/// Plants of Example 1 and their step.
pub(super) struct Benchmarks<'a> {
    instructions: Instructions,
    plants: Vec<&'a Benchmark>,
    slopes: Slopes,
    steps: Box<Steps<2>>,
    fastest_signal_rad_s: Wide,
    /// Product h ω of the tick.
    angle: Wide,
    /// Times of the jumps, ascending, each with its lane.
    jumps_s: Vec<(f64, usize)>,
}

/// Right-hand sides of the plants.
struct Slopes {
    state_dependent: bool,
    signals: [Signals; 2],
    added: [Wide; 2],
}

impl<'a> Benchmarks<'a> {
    /// Builds the batch. Returns `None` if a trial has another plant.
    pub(super) fn beside(instructions: Instructions, trials: &[Trial<'a>]) -> Option<Box<dyn Plants<2> + 'a>> {
        let of = |trial: &Trial<'a>| match trial.plant.parts()? {
            Parts::Benchmark(plant) => Some(plant),
            _ => None,
        };
        let plants: Vec<&Benchmark> = trials.iter().map(of).collect::<Option<_>>()?;
        let state_dependent = plants.first()?.is_state_dependent();
        if !plants.iter().all(|plant| plant.is_state_dependent() == state_dependent) {
            return None;
        }
        let signals = |i: usize| {
            let each: Vec<_> = plants.iter().map(|plant| &plant.disturbances()[i]).collect();
            Signals::new(&each)
        };
        let of_lane = |(l, plant): (usize, &&Benchmark)| plant.jumps_s().iter().map(move |at_s| (*at_s, l)).collect();
        let mut jumps_s: Vec<(f64, usize)> = plants.iter().enumerate().flat_map::<Vec<_>, _>(of_lane).collect();
        jumps_s.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut fastest_signal_rad_s = Wide::of_all(0.0);
        for (l, plant) in plants.iter().enumerate() {
            fastest_signal_rad_s[l] = plant.fastest_signal_rad_s();
        }
        let slopes = Slopes { state_dependent, signals: [signals(0), signals(1)], added: [Wide::of_all(0.0); 2] };
        let steps = Steps::new(instructions);
        let angle = Wide::of_all(0.0);
        Some(Box::new(Self { instructions, plants, slopes, steps, fastest_signal_rad_s, angle, jumps_s }))
    }
}

impl Plants<2> for Benchmarks<'_> {
    fn turn(&mut self, _: &[Wide; 2]) {}

    fn advance(&mut self, from_s: f64, to_s: f64, x: &mut [Wide; 2], u: &Wide, lost: &mut Wide<u64>) {
        let Self { instructions, plants, slopes, steps, fastest_signal_rad_s, angle, jumps_s } = self;
        let h_s = to_s - from_s;
        (steps.x, steps.u, steps.t_s) = (*x, *u, Wide::of_all(from_s));
        steps.begin(slopes);
        let began = jumps_s.partition_point(|(at_s, _)| *at_s <= from_s);
        for (_, l) in jumps_s[began..].iter().take_while(|(at_s, _)| *at_s < to_s) {
            steps.outside[*l] = 1;
        }
        let angles = if slopes.state_dependent { angles_all::<true> } else { angles_all::<false> };
        angles(*instructions, h_s, fastest_signal_rad_s, x, &steps.first, angle, &mut steps.outside);
        for l in 0..LANES {
            // A lane that is advanced alone does not keep the others busy.
            let rows = if steps.outside[l] == 0 { solver::rows(angle[l], 2, false) } else { 1 };
            steps.set(l, Stride { h_s, rows });
        }
        steps.step(slopes);
        step_all(*instructions, &steps.outside, &steps.increment, x);
        for (l, plant) in plants.iter().enumerate().filter(|(l, _)| steps.outside[*l] != 0) {
            super::alone(*plant, [from_s, to_s], u[l], x, l, lost);
        }
    }

    fn note_estimate(&self, channel: usize, t_s: f64, x: &[Wide; 2], _: &Wide, d_hat: &Wide, most: &mut Wide) {
        let mut d = Wide::of_all(0.0);
        self.slopes.signals[channel].value(self.instructions, t_s, &mut d);
        let of_state = self.slopes.state_dependent && channel == 0;
        let note = if of_state { note_all::<true> } else { note_all::<false> };
        note(self.instructions, &d, if of_state { libm::sin(2.0 * t_s) } else { 0.0 }, x, d_hat, most);
    }
}

impl Rates<2> for Slopes {
    fn begin(&mut self, _: &Wide) {}

    fn rates(&mut self, instructions: Instructions, at: At<'_, 2>, dx: &mut [Wide; 2], outside: &mut Wide<u64>) {
        let t_s = at.t_s[0];
        for (signals, added) in self.signals.iter().zip(&mut self.added) {
            signals.value(instructions, t_s, added);
        }
        if self.state_dependent {
            rates_all::<true>(instructions, &self.added, libm::sin(2.0 * t_s), at.x, at.u, dx, outside);
        } else {
            rates_all::<false>(instructions, &self.added, 0.0, at.x, at.u, dx, outside);
        }
    }
}

vectorised! {
    fn rates_all[STATE; const STATE: bool](
        added: &[Wide; 2],
        sin_2t: f64,
        x: &[Wide; 2],
        u: &Wide,
        dx: &mut [Wide; 2],
        outside: &mut Wide<u64>,
    ) {
        for l in 0..LANES {
            let now = [x[0][l], x[1][l]];
            let d1 = if STATE { added[0][l] + d1_of_state(now, sin_2t) } else { added[0][l] };
            let [first, second] = rates([d1, added[1][l]], now, u[l], exponential::exp(now[0]));
            outside[l] |= u64::from(!exponential::is_within(now[0]));
            dx[0][l] = first;
            dx[1][l] = second;
        }
    }
}

vectorised! {
    /// Computes h ω and marks the lanes that need more than one step of the solver.
    fn angles_all[STATE; const STATE: bool](
        h_s: f64,
        of_signals_rad_s: &Wide,
        x: &[Wide; 2],
        first: &[Wide; 2],
        angle: &mut Wide,
        outside: &mut Wide<u64>,
    ) {
        for l in 0..LANES {
            let now = [x[0][l], x[1][l]];
            let fastest_rad_s = fastest_rad_s(STATE, now, exponential::exp(now[0]), of_signals_rad_s[l]);
            angle[l] = h_s * fastest_rad_s;
            let is_one = (h_s * fastest_rad_s / STEP_ANGLE <= 1.0)
                & (now[0].abs() <= RUNAWAY)
                & (now[1].abs() <= RUNAWAY)
                & (first[0][l].abs() < f64::INFINITY)
                & (first[1][l].abs() < f64::INFINITY);
            outside[l] |= u64::from(!is_one);
        }
    }
}

vectorised! {
    fn step_all[;](outside: &Wide<u64>, increment: &[Wide; 2], x: &mut [Wide; 2],) {
        for i in 0..2 {
            for l in 0..LANES {
                let next = x[i][l] + increment[i][l];
                x[i][l] = if outside[l] == 0 { next } else { x[i][l] };
            }
        }
    }
}

vectorised! {
    /// Updates the largest |d - d_hat| of a channel.
    fn note_all[STATE; const STATE: bool](added: &Wide, sin_2t: f64, x: &[Wide; 2], d_hat: &Wide, most: &mut Wide,) {
        for l in 0..LANES {
            let d = if STATE { added[l] + d1_of_state([x[0][l], x[1][l]], sin_2t) } else { added[l] };
            let error = (d - d_hat[l]).abs();
            most[l] = if error > most[l] { error } else { most[l] };
        }
    }
}
