//! Batch of closed loops of any kind, with a vectorised step of their plants.
//!
//! The controller of a drive, its encoders and references cost a hundredth of a plant with friction. So each run keeps
//! its own sensor, port and actuator, and ticks alone as in [`close_loop`]. Only the step of the solver is vectorised.
//! A lane that has crossed a tick begins its next tick at once. A lane whose run has ended takes the next run. So each
//! lane has its own time, and all lanes stay busy.

use super::formulas::{self, Formulas};
use super::steps::{Bodies, Shafts, Steps};
use super::wide::Wide;
use super::{Instructions, LANES};
use crate::closed_loop::{Ended, Loop, LoopError, Running, close_loop};
use crate::plant::{Own, Parts, Plant, Regime};
use crate::solver::{self, Crossing, Within};
use crate::trace::{Ending, Recorder};

/// Largest number of lanes that are faster one after the other.
const FEW: usize = 12;

/// Runs all loops, each bit-identical to [`close_loop`]. A loop whose plant has no vector code runs alone.
pub fn close_each(runs: Vec<Recorded<'_>>) -> Vec<Result<Ending, LoopError>> {
    close_each_with(Instructions::Avx512, runs)
}

/// Loop with the recorder of its rows.
pub type Recorded<'a> = (Loop<'a>, &'a mut dyn Recorder);

/// Runs all loops with at most these instructions. The bits do not depend on the instructions.
pub fn close_each_with(instructions: Instructions, runs: Vec<Recorded<'_>>) -> Vec<Result<Ending, LoopError>> {
    let mut endings: Vec<_> = runs.iter().map(|_| Ok(Ending::Finished)).collect();
    let mut kinds: Vec<(PlantClass<'_>, Vec<Run<'_>>)> = Vec::new();
    for (at, (setup, recorder)) in runs.into_iter().enumerate() {
        let Some(kind) = PlantClass::of(setup.plant) else {
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
                    $(PlantClass::Shafts { order: $order, has_waves, holds } => {
                        through::<$order>(instructions, Shafts::<$rows>::new(has_waves, holds), runs, &mut keep);
                    })*
                    PlantClass::Shafts { order, .. } => unreachable!("a motor or joint of order {order}"),
                    PlantClass::Formulas(own) => {
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

/// Properties that the plants of a batch must share.
enum PlantClass<'a> {
    Shafts {
        order: usize,
        has_waves: bool,
        holds: bool,
    },
    /// Formulas with the operations of this plant.
    Formulas(&'a Own),
}

impl<'a> PlantClass<'a> {
    /// Returns the kind of a plant. `None` for a plant with a step of its own or with an unknown right-hand side.
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

/// Run with its index among all runs.
struct Run<'a> {
    at: usize,
    running: Running<'a>,
    recorder: &'a mut dyn Recorder,
}

/// Run in a lane.
struct Lane<'a> {
    run: Run<'a>,
    crossing: Crossing,
    regime: Regime,
    /// True if its last step was rejected and the lane repeats it from the same point.
    is_tried: bool,
}

/// Runs all runs of a kind through the lanes.
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

/// Moves a lane on to where a step is due: through its tick, and into the next run if the run has ended.
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
