//! Vectorised right-hand sides from formulas: the operations of [`Own`], lane by lane.
//!
//! Plants of one kind have the same operations and differ in numbers. So each operation is a loop over lanes. An
//! operation with its own branchless code becomes vector code. The other functions of `libm` are called lane by lane.

use super::steps::{At, Bodies, Rates};
use super::wide::Wide;
use super::{Instructions, LANES};
use crate::exponential;
use crate::expression::{Expression, MOST_PENDING, ONE, Operation, TWO};
use crate::plant::{Own, Parts, Plant};
use crate::signal::Signal;
use crate::sine;

/// Formulas of all lanes.
pub(super) struct Formulas<'a> {
    rates: Vec<Vec<Step>>,
    /// Per channel: the value that is added now, and the signals that vary within a step.
    added: Vec<Wide>,
    plants: [Option<&'a Own>; LANES],
    varying: Vec<(usize, usize, &'a Signal)>,
    stack: Box<[Wide; MOST_PENDING]>,
}

/// Operation over lanes.
enum Step {
    Number(Box<Wide>),
    Input(usize),
    Vector1(fn(Instructions, &mut Wide)),
    /// Function that marks the lanes in which its value differs from the function of the plant alone.
    Bounded1(fn(Instructions, &mut Wide, &mut Wide<u64>)),
    Vector2(fn(Instructions, &mut Wide, &Wide)),
    One(fn(f64) -> f64),
    Two(fn(f64, f64) -> f64),
}

impl Step {
    fn of(operation: Operation) -> Self {
        match operation {
            Operation::Number(number) => Self::Number(Box::new(Wide::of_all(number))),
            Operation::Input(which) => Self::Input(which),
            Operation::One(which) => match ONE[which].name {
                "-" => Self::Vector1(negate_all),
                "abs" => Self::Vector1(abs_all),
                "tanh" => Self::Vector1(tanh_all),
                "sin" => Self::Bounded1(turn_all::<false>),
                "cos" => Self::Bounded1(turn_all::<true>),
                _ => Self::One(ONE[which].of),
            },
            Operation::Two(which) => match TWO[which].name {
                "+" => Self::Vector2(add_all),
                "-" => Self::Vector2(subtract_all),
                "*" => Self::Vector2(multiply_all),
                "/" => Self::Vector2(divide_all),
                _ => Self::Two(TWO[which].of),
            },
        }
    }
}

/// Returns true if the two plants can share a batch.
pub(super) fn are_alike(one: &Own, other: &Own) -> bool {
    let alike = |one: &Expression, other: &Expression| {
        let pairs = one.operations().iter().zip(other.operations());
        let same = |(one, other): (&Operation, &Operation)| {
            one == other || matches!((one, other), (Operation::Number(_), Operation::Number(_)))
        };
        one.operations().len() == other.operations().len() && pairs.into_iter().all(same)
    };
    one.order() == other.order() && one.rates().iter().zip(other.rates()).all(|(one, other)| alike(one, other))
}

impl Formulas<'_> {
    /// Builds the batch for plants like this one.
    pub(super) fn new(first: &Own) -> Self {
        let steps = |rate: &Expression| rate.operations().iter().copied().map(Step::of).collect();
        Self {
            rates: first.rates().iter().map(steps).collect(),
            added: vec![Wide::of_all(0.0); first.order()],
            plants: [None; LANES],
            varying: Vec::new(),
            stack: Box::new([Wide::of_all(0.0); MOST_PENDING]),
        }
    }
}

impl<'a, const N: usize> Bodies<'a, N> for Formulas<'a> {
    fn set(&mut self, l: usize, parts: Parts<'a>) {
        let Parts::Own(own) = parts else { return };
        for (steps, rate) in self.rates.iter_mut().zip(own.rates()) {
            for (step, operation) in steps.iter_mut().zip(rate.operations()) {
                if let (Step::Number(wide), Operation::Number(number)) = (step, operation) {
                    wide[l] = *number;
                }
            }
        }
        self.plants[l] = Some(own);
        self.varying.retain(|(of, ..)| *of != l);
        let varying = own.disturbances().iter().enumerate().filter(|(_, signal)| signal.varies());
        self.varying.extend(varying.map(|(i, signal)| (l, i, signal)));
    }
}

impl<const N: usize> Rates<N> for Formulas<'_> {
    fn begin(&mut self, t_s: &Wide) {
        for (l, own) in self.plants.iter().enumerate() {
            for (added, signal) in self.added.iter_mut().zip(own.iter().flat_map(|own| own.disturbances())) {
                added[l] = signal.value(t_s[l]);
            }
        }
    }

    fn rates(&mut self, instructions: Instructions, at: At<'_, N>, dx: &mut [Wide; N], outside: &mut Wide<u64>) {
        let At { t_s, x, u } = at;
        for (l, i, signal) in &self.varying {
            self.added[*i][*l] = signal.value(t_s[*l]);
        }
        for ((dx, steps), added) in dx.iter_mut().zip(&self.rates).zip(&self.added) {
            let mut top = 0;
            for step in steps {
                // The parser has checked the stack, as for one plant.
                let (below, above) = self.stack.split_at_mut(top);
                match (step, below) {
                    (Step::Number(number), _) => above[0] = **number,
                    (Step::Input(which), _) => above[0] = *x.get(*which).unwrap_or(if *which == N { u } else { t_s }),
                    (Step::Vector1(of), [.., x]) => of(instructions, x),
                    (Step::Bounded1(of), [.., x]) => of(instructions, x, outside),
                    (Step::One(of), [.., x]) => x.0.iter_mut().for_each(|x| *x = of(*x)),
                    (Step::Vector2(of), [.., x, y]) => of(instructions, x, y),
                    (Step::Two(of), [.., x, y]) => x.0.iter_mut().zip(&y.0).for_each(|(x, y)| *x = of(*x, *y)),
                    _ => {}
                }
                match step {
                    Step::Number(_) | Step::Input(_) => top += 1,
                    Step::Vector2(_) | Step::Two(_) => top -= 1,
                    Step::Vector1(_) | Step::Bounded1(_) | Step::One(_) => {}
                }
            }
            *dx = self.stack[0];
            add_all(instructions, dx, added);
        }
    }
}

macro_rules! over_lanes {
    ($($name:ident: |$x:ident $(, $y:ident)?| $value:expr;)*) => {
        $(vectorised! {
            fn $name[;](row: &mut Wide, $($y: &Wide,)?) {
                for l in 0..LANES {
                    let $x = row[l];
                    $(let $y = $y[l];)?
                    row[l] = $value;
                }
            }
        })*
    };
}

over_lanes! {
    negate_all: |x| -x;
    abs_all: |x| x.abs();
    tanh_all: |x| exponential::tanh(x);
    add_all: |x, y| x + y;
    subtract_all: |x, y| x - y;
    multiply_all: |x, y| x * y;
    divide_all: |x, y| x / y;
}

vectorised! {
    /// Computes the sine or cosine of each lane.
    fn turn_all[COSINE; const COSINE: bool](row: &mut Wide, outside: &mut Wide<u64>,) {
        for l in 0..LANES {
            let x = row[l];
            outside[l] |= u64::from(!sine::is_within(x));
            let (sin, cos) = sine::sin_cos(x);
            row[l] = if COSINE { cos } else { sin };
        }
    }
}
