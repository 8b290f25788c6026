//! Case distinction: comparison of machine code and specification under assumed truths.
//!
//! A compiler that can predict a decision duplicates the following code for each outcome (jump threading). Then machine
//! code and specification share no intermediate value over all paths. Within one case they do again. A comparison with
//! too many paths is therefore split by the truth that decides the most selections. Each part is split again until few
//! selections remain. Then intermediate values are joined (`sweep.rs`). Values that are equal in both cases are equal.
//!
//! A case has its own graph, rebuilt from the original one with the assumed truths. Decided selections disappear, with
//! all values that only they used. An assumed comparison also restricts other comparisons of its two numbers with
//! constants. A false conjunction `p and q` decides neither operand, but no path of the case has both true.

use std::sync::atomic::AtomicBool;

use super::graph::{Graph, Node, Op};
use super::inputs::{self, Trial};
use super::sweep::Sweep;
use super::term::Mixing;
use super::text::Expected;

/// Limits of the effort before a result is rejected.
#[derive(Clone, Copy)]
pub(super) struct Effort {
    /// Number of numeric inputs.
    pub(super) tried: u32,
    /// Limit of the paths of all results together, for a direct comparison.
    pub(super) whole: usize,
    /// Limit of the paths in a case; lower, because cases are numerous.
    pub(super) small: usize,
    /// Number of selections decided by one truth above which a case split precedes joining.
    pub(super) many: usize,
    /// Limit of the number of cases.
    pub(super) cases: usize,
}

impl Effort {
    pub(super) const USUAL: Self = Self { tried: 60_000, whole: 1 << 16, small: 1 << 12, many: 16, cases: 1024 };
}

/// Smallest number of inputs of a case; below it, the inputs of the surrounding case are used.
const FEW: usize = 1024;

/// Comparison of a function with its specification, case by case.
pub(super) struct Cases<'a> {
    expected: &'a Expected,
    effort: Effort,
    stop: &'a AtomicBool,
    /// Number of compared paths.
    pub(super) paths: usize,
    /// Number of cases so far.
    begun: usize,
}

/// Unproved pairs of a case: index in the whole, value of the machine code, value of the specification.
type Open = Vec<(usize, (Node, Node))>;

impl<'a> Cases<'a> {
    pub(super) fn new(expected: &'a Expected, effort: Effort, stop: &'a AtomicBool) -> Self {
        Self { expected, effort, stop, paths: 0, begun: 0 }
    }

    /// Returns the indices of the pairs without a proof of equality.
    ///
    /// # Errors
    /// The `stop` flag was set.
    pub(super) fn unequal(
        &mut self,
        graph: &mut Graph,
        pairs: &[(Node, Node)],
        tried: &[Trial],
    ) -> Result<Vec<usize>, String> {
        self.left(graph, pairs.iter().copied().enumerate().collect(), tried, self.effort.whole)
    }

    fn left(&mut self, graph: &mut Graph, mut open: Open, tried: &[Trial], whole: usize) -> Result<Vec<usize>, String> {
        self.begun += 1;
        open.retain(|(_, (a, b))| a != b);
        let pairs = pairs_of(&open);
        let mut sweep = Sweep::new(graph, self.expected, &pairs);
        let mut part = None;
        if sweep.is_followed(&pairs, whole) {
            open.clear();
        } else {
            part = most_decisive(sweep.graph, &pairs, true).filter(|(_, choices)| *choices > self.effort.many);
            if part.is_none() {
                let left = sweep.unequal(&pairs, tried, self.stop)?;
                open = left.into_iter().map(|at| open[at]).collect();
                // One side may decide by a value that the other side has found equal on both paths.
                part =
                    [true, false].into_iter().find_map(|of_both| most_decisive(sweep.graph, &pairs_of(&open), of_both));
            }
        }
        self.paths += sweep.paths;
        let Some((t, _)) = part.filter(|_| self.begun < self.effort.cases) else {
            return Ok(open.into_iter().map(|(at, _)| at).collect());
        };
        let mut left = Vec::new();
        for truth in [true, false] {
            // A pair that failed in one case needs no proof in the other.
            open.retain(|(at, _)| !left.contains(at));
            let roots: Vec<Node> = pairs_of(&open).into_iter().flat_map(|(a, b)| [a, b]).collect();
            let (mut case, roots) = graph.case(t, truth, &roots);
            let pairs = open.iter().zip(roots.chunks(2)).map(|(&(at, _), pair)| (at, (pair[0], pair[1]))).collect();
            let mut values = vec![0; t + 1];
            let so = |tried: &&Trial| {
                inputs::compute(graph, tried, &mut values);
                (values[t] != 0) == truth
            };
            let of_case: Vec<Trial> = tried.iter().filter(so).cloned().collect();
            // Few inputs separate too few values, and values that are equal in a case are mostly equal without it.
            let tried = if of_case.len() < FEW { tried } else { &of_case };
            left.extend(self.left(&mut case, pairs, tried, self.effort.small)?);
        }
        left.sort_unstable();
        Ok(left)
    }
}

fn pairs_of(open: &Open) -> Vec<(Node, Node)> {
    open.iter().map(|(_, pair)| *pair).collect()
}

/// Returns the truth that decides the most selections, with their number. `of_both` requires selections on both sides.
fn most_decisive(graph: &Graph, pairs: &[(Node, Node)], of_both: bool) -> Option<(Node, usize)> {
    let (machine, text): (Vec<Node>, Vec<Node>) = pairs.iter().copied().unzip();
    let mut choices = vec![[0; 2]; graph.ops.len()];
    for (side, mut open) in [machine, text].into_iter().enumerate() {
        let mut needed = vec![false; graph.ops.len()];
        while let Some(node) = open.pop() {
            let (node, _) = graph.found(node);
            if !std::mem::replace(&mut needed[node], true) {
                open.extend(graph.ops[node].parts());
                if let Op::Select(t, ..) = graph.ops[node] {
                    choices[graph.found(t).0][side] += 1;
                }
            }
        }
    }
    let decides = |one: usize, other: usize| if of_both { one > 0 && other > 0 } else { one + other > 0 };
    let all = choices.iter().enumerate().filter(|(_, [one, other])| decides(*one, *other));
    all.map(|(t, [one, other])| (t, one + other)).rev().max_by_key(|(_, choices)| *choices)
}

impl Graph {
    /// Builds the case in which `t` has the value `truth`; returns its graph and the values of `roots` in it.
    pub(super) fn case(&self, t: Node, truth: bool, roots: &[Node]) -> (Self, Vec<Node>) {
        let mut case = Case { all: self, graph: self.fresh(), made: Mixing::default() };
        // The latest assumption comes first: earlier assumptions may contain it, but not the reverse.
        case.suppose(t, truth);
        for &(t, truth) in &self.supposed {
            case.suppose(t, truth);
        }
        let roots = roots.iter().map(|root| case.made(*root)).collect();
        (case.graph, roots)
    }
}

/// A case under construction.
struct Case<'a> {
    all: &'a Graph,
    graph: Graph,
    /// Values of the original graph, mapped to their values in the case.
    made: Mixing<Node, Node>,
}

impl Case<'_> {
    fn suppose(&mut self, t: Node, truth: bool) {
        let (t, turned) = self.all.found(t);
        let truth = truth != turned;
        match self.all.ops[t] {
            Op::One("not", a) => self.suppose(a, !truth),
            Op::Select(c, x, y) => {
                let decided = |node| {
                    let (node, turned) = self.all.found(node);
                    self.all.decided(node).map(|truth| truth != turned)
                };
                // If `c and x` holds, or `not c or x` does not hold, both operands are known.
                match (decided(x), decided(y)) {
                    (_, Some(no)) if no != truth => {
                        self.suppose(c, true);
                        self.suppose(x, truth);
                    }
                    (Some(no), _) if no != truth => {
                        self.suppose(c, false);
                        self.suppose(y, truth);
                    }
                    _ => self.note(t, truth),
                }
            }
            _ => self.note(t, truth),
        }
        let known = self.graph.truth(truth);
        self.made.insert(t, known);
    }

    /// Assumes a truth as a whole, without a conclusion on its operands.
    fn note(&mut self, t: Node, truth: bool) {
        let here = self.made(t);
        if self.graph.decided(here).is_none() {
            self.graph.suppose(here, truth);
        }
    }

    /// Returns the value of an original node in the case, if it is built already.
    fn ready(&mut self, node: Node) -> Option<Node> {
        let (node, turned) = self.all.found(node);
        let made = *self.made.get(&node)?;
        Some(if turned { self.graph.not(made) } else { made })
    }

    /// Builds the value of an original node in the case.
    fn made(&mut self, root: Node) -> Node {
        let mut open = vec![self.all.found(root).0];
        while let Some(&node) = open.last() {
            if self.made.contains_key(&node) {
                open.pop();
                continue;
            }
            let op = self.all.ops[node];
            let needed: Vec<Node> = match op {
                Op::Select(t, a, b) => match self.ready(t).map(|t| self.graph.decided(t)) {
                    None => vec![t],
                    Some(Some(true)) => vec![a],
                    Some(Some(false)) => vec![b],
                    Some(None) => vec![a, b],
                },
                op => op.parts().collect(),
            };
            let missing = needed.iter().find(|part| self.ready(**part).is_none());
            if let Some(part) = missing {
                open.push(self.all.found(*part).0);
                continue;
            }
            let parts: Vec<Node> = needed.iter().filter_map(|part| self.ready(*part)).collect();
            let made = match (op, &parts[..]) {
                (Op::Select(..), [taken]) => *taken,
                (Op::Select(t, ..), [a, b]) => match self.ready(t) {
                    Some(t) => self.graph.select(t, *a, *b),
                    None => unreachable!("the condition is made first"),
                },
                (Op::One("not", _), [a]) => self.graph.not(*a),
                (Op::One(name, _), [a]) => self.graph.one(name, *a),
                (Op::Two(name, ..), [a, b]) => self.graph.two(name, *a, *b),
                (Op::Plus(.., factor), [a, b]) => self.graph.plus(*a, *b, factor),
                (Op::ShiftedRight(_, by), [a]) => self.graph.shifted_right(*a, by),
                (Op::Signed(_, bits), [a]) => self.graph.low_bits(*a, bits),
                (Op::Compare(set, ..), [a, b]) => self.graph.stands(*a, set, *b),
                (Op::Ordered(order, ..), [a, b]) => self.graph.ordered(order, *a, *b),
                (leaf, _) => self.graph.node(leaf),
            };
            self.made.insert(node, made);
        }
        match self.ready(root) {
            Some(made) => made,
            None => unreachable!("it was made"),
        }
    }
}
