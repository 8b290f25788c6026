//! Closed loops of any kind, their plants side by side.
//!
//! The law of a drive, its encoders and references are a hundredth of what a plant with friction costs. So here each
//! run keeps its own sensor, port and actuator, and ticks alone, as in [`close_loop`]; what goes side by side is the
//! solver's step. A lane whose tick has been crossed goes on to its next tick at once, one whose run has ended takes
//! the next run. So lanes have each their own time, and are busy all of it.

use super::formulas::{self, Formulas};
use super::steps::{Bodies, Shafts, Steps};
use super::wide::Wide;
use super::{Instructions, LANES};
use crate::closed_loop::{Ended, Loop, LoopError, Running, close_loop};
use crate::plant::{Own, Parts, Plant, Regime};
use crate::solver::{self, Crossing, Within};
use crate::trace::{Ending, Recorder};

/// Steps of fewer lanes are faster one after the other.
const FEW: usize = 12;

/// Runs all of them, each as [`close_loop`] does, to the bit; what no others are like runs alone.
pub fn close_each(runs: Vec<Recorded<'_>>) -> Vec<Result<Ending, LoopError>> {
    close_each_with(Instructions::Avx512, runs)
}

/// A loop, and who takes its rows.
pub type Recorded<'a> = (Loop<'a>, &'a mut dyn Recorder);

/// The same with at most these instructions: the bits do not depend on them.
pub fn close_each_with(instructions: Instructions, runs: Vec<Recorded<'_>>) -> Vec<Result<Ending, LoopError>> {
    let mut endings: Vec<_> = runs.iter().map(|_| Ok(Ending::Finished)).collect();
    let mut kinds: Vec<(Kind<'_>, Vec<Run<'_>>)> = Vec::new();
    for (at, (setup, recorder)) in runs.into_iter().enumerate() {
        let Some(kind) = Kind::of(setup.plant) else {
            endings[at] = close_loop(setup, recorder);
            continue;
        };
        let run = Run { at, running: Running::new(setup), recorder };
        match kinds.iter_mut().find(|(of, _)| of.is_like(&kind)) {
            Some((_, runs)) => runs.push(run),
            None => kinds.push((kind, vec![run])),
        }
    }
    let mut keep = |run: Run<'_>, (ending, error): Ended| {
        run.recorder.end(ending);
        endings[run.at] = error.map_or(Ok(ending), Err);
    };
    for (kind, runs) in kinds {
        macro_rules! through {
            ($($order:literal: $rows:literal)*) => {
                match kind {
                    $(Kind::Shafts { order: $order, has_waves, holds } => {
                        through::<$order>(instructions, Shafts::<$rows>::new(has_waves, holds), runs, &mut keep);
                    })*
                    Kind::Shafts { order, .. } => unreachable!("a motor or joint of order {order}"),
                    Kind::Formulas(own) => {
                        let bodies = Formulas::new(own);
                        match own.order() {
                            2 => through::<2>(instructions, bodies, runs, &mut keep),
                            3 => through::<3>(instructions, bodies, runs, &mut keep),
                            4 => through::<4>(instructions, bodies, runs, &mut keep),
                            5 => through::<5>(instructions, bodies, runs, &mut keep),
                            _ => through::<6>(instructions, bodies, runs, &mut keep),
                        }
                    }
                }
            };
        }
        through!(2: 3 3: 3 4: 5 5: 5);
    }
    endings
}

/// What plants must have in common.
enum Kind<'a> {
    Shafts {
        order: usize,
        has_waves: bool,
        holds: bool,
    },
    /// With formulas like those of this one.
    Formulas(&'a Own),
}

impl<'a> Kind<'a> {
    /// None of a plant that has a step of its own, or a right-hand side that is not known here.
    fn of(plant: &'a dyn Plant) -> Option<Self> {
        match plant.parts().filter(|_| plant.exact().is_none())? {
            Parts::Shafts { numbers, .. } => {
                let ([cogging, _, ripple, _], [.., per_smooth]) = (*numbers.get(1)?, *numbers.get(2)?);
                let (has_waves, holds) = (cogging != 0.0 || ripple != 0.0, per_smooth == f64::INFINITY);
                Some(Self::Shafts { order: plant.order(), has_waves, holds })
            }
            Parts::Own(own) => Some(Self::Formulas(own)),
            Parts::Benchmark(_) => None,
        }
    }

    fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (
                Self::Shafts { order, has_waves, holds },
                Self::Shafts { order: others, has_waves: have, holds: others_hold },
            ) => (order, has_waves, holds) == (others, have, others_hold),
            (Self::Formulas(own), Self::Formulas(other)) => formulas::are_alike(own, other),
            _ => false,
        }
    }
}

/// A run, and which of all.
struct Run<'a> {
    at: usize,
    running: Running<'a>,
    recorder: &'a mut dyn Recorder,
}

/// A run in a lane.
struct Lane<'a> {
    run: Run<'a>,
    crossing: Crossing,
    regime: Regime,
    /// Its step was not agreed on: another one goes from the same place.
    is_tried: bool,
}

/// All runs of a kind, through the lanes.
fn through<'a, const N: usize>(
    instructions: Instructions,
    mut bodies: impl Bodies<'a, N>,
    runs: Vec<Run<'a>>,
    keep: &mut dyn FnMut(Run<'a>, Ended),
) {
    let mut steps = Steps::<N>::new(instructions);
    let has_events = bodies.has_events();
    let mut waiting = runs.into_iter();
    let mut lanes: Vec<Option<Lane<'a>>> = (0..LANES).map(|_| None).collect();
    loop {
        for (l, lane) in lanes.iter_mut().enumerate() {
            settle(l, lane, &mut waiting, &mut steps, &mut bodies, keep);
        }
        let busy = lanes.iter().flatten().count();
        if busy == 0 {
            return;
        }
        for (l, lane) in lanes.iter_mut().enumerate().filter(|_| has_events) {
            let Some(Lane { run, crossing, regime, is_tried: false }) = lane else { continue };
            *regime = run.running.setup.plant.regime(crossing.t_s, &of_lane(&steps.x, l), steps.u[l]);
            bodies.set_regime(l, *regime);
        }
        steps.begin(&mut bodies);
        for (l, lane) in lanes.iter_mut().enumerate() {
            let Some(Lane { run, crossing, regime, is_tried }) = lane else { continue };
            let (plant, x, mut first) = (run.running.setup.plant, of_lane(&steps.x, l), of_lane(&steps.first, l));
            if steps.outside[l] != 0 {
                Within { plant, regime: *regime }.rhs(crossing.t_s, &x, steps.u[l], &mut first);
                set_lane(&mut steps.first, l, &first);
            }
            if *is_tried {
                continue;
            }
            match crossing.plan(plant, steps.u[l], &x, &first) {
                Ok(Some(stride)) => steps.set(l, stride),
                Ok(None) => {
                    crossing.give_up();
                    steps.rest(l);
                }
                Err(error) => {
                    steps.rest(l);
                    let ended = run.running.broken_off(error);
                    if let Some(Lane { run, .. }) = lane.take() {
                        keep(run, ended);
                    }
                }
            }
        }
        if busy >= FEW {
            steps.step(&mut bodies);
        }
        for (l, lane) in lanes.iter_mut().enumerate() {
            let Some(Lane { run, crossing, regime, is_tried }) = lane else { continue };
            if crossing.is_done() {
                continue;
            }
            let within = Within { plant: run.running.setup.plant, regime: *regime };
            if busy < FEW || steps.outside[l] != 0 {
                let (x, first) = (of_lane(&steps.x, l), of_lane(&steps.first, l));
                let (increment, difference) =
                    solver::step(within, crossing.t_s, steps.stride(l), steps.u[l], &x, &first);
                set_lane(&mut steps.increment, l, &increment);
                steps.difference[l] = difference;
            }
            let begin_s = crossing.t_s;
            match crossing.checked(within.plant, steps.difference[l]) {
                None => {
                    let x = of_lane(&steps.x, l);
                    let mut end = std::array::from_fn(|i| x[i] + steps.increment[i][l]);
                    if has_events {
                        let step = (steps.stride(l).h_s, steps.u[l]);
                        end = within.ended(crossing, begin_s, step, [&x, &of_lane(&steps.first, l), &end]);
                    }
                    set_lane(&mut steps.x, l, &end);
                    steps.t_s[l] = crossing.t_s;
                    *is_tried = false;
                }
                Some(stride) => {
                    steps.set(l, stride);
                    *is_tried = true;
                }
            }
        }
    }
}

/// The lane goes on to where there is a step to take: over the tick at which it is, into the next run.
fn settle<'a, const N: usize>(
    l: usize,
    lane: &mut Option<Lane<'a>>,
    waiting: &mut impl Iterator<Item = Run<'a>>,
    steps: &mut Steps<N>,
    bodies: &mut impl Bodies<'a, N>,
    keep: &mut dyn FnMut(Run<'a>, Ended),
) {
    if lane.as_ref().is_some_and(|lane| !lane.crossing.is_done()) {
        return;
    }
    let mut next = lane.take().map(|Lane { mut run, .. }| {
        run.running.x[..N].copy_from_slice(&of_lane(&steps.x, l));
        run.running.k += 1;
        run
    });
    loop {
        let mut run = if let Some(run) = next.take() {
            run
        } else {
            let Some(run) = waiting.next() else {
                steps.rest(l);
                return;
            };
            if let Some(parts) = run.running.setup.plant.parts() {
                bodies.set(l, parts);
            }
            run
        };
        match run.running.tick(run.recorder) {
            Ok(u_held) => {
                let [from_s, to_s] = run.running.interval();
                for (x, of_run) in steps.x.iter_mut().zip(run.running.x) {
                    x[l] = of_run;
                }
                (steps.u[l], steps.t_s[l]) = (u_held, from_s);
                *lane =
                    Some(Lane { run, crossing: Crossing::new(from_s, to_s), regime: Regime::Smooth, is_tried: false });
                return;
            }
            Err(ended) => keep(run, ended),
        }
    }
}

fn of_lane<const N: usize>(rows: &[Wide; N], l: usize) -> [f64; N] {
    std::array::from_fn(|i| rows[i][l])
}

fn set_lane<const N: usize>(rows: &mut [Wide; N], l: usize, values: &[f64; N]) {
    for (row, value) in rows.iter_mut().zip(values) {
        row[l] = *value;
    }
}

#[cfg(test)]
mod tests;
