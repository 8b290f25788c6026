//! Case by case: what holds where a truth is so, and where it is not.
//!
//! A compiler that sees where a decision leads writes what follows once for each way (jump threading), and between
//! text and machine no value is left that is the same on all of them. In one case there is one way again. So what has
//! too many paths as a whole is parted by the truth that decides the most choices of text and machine, each part by
//! another, until few are left to be made; then values between are joined (`sweep.rs`). What is equal in both cases is
//! equal.
//!
//! A case is a graph of its own: everything is made anew of its parts with what is known there, so that choices that
//! are decided go, and all that only they needed. Of a comparison is known what it says of its two numbers, and of one
//! of them and other constants; of `p and q` that does not hold, that no path of the case has both.

use std::sync::atomic::AtomicBool;

use super::graph::{Graph, Node, Op};
use super::inputs::{self, Tried};
use super::sweep::Sweep;
use super::term::Mixing;
use super::text::Expected;

/// How much is done before something is declined.
#[derive(Clone, Copy)]
pub(super) struct Effort {
    /// Inputs that are tried.
    pub(super) tried: u32,
    /// Paths of all results together, up to which they are followed as they are.
    pub(super) whole: usize,
    /// The same of a case, which is tried often.
    pub(super) small: usize,
    /// Choices that a truth decides at least, of which there are cases before anything is joined.
    pub(super) many: usize,
    /// Cases in all.
    pub(super) cases: usize,
}

impl Effort {
    pub(super) const USUAL: Self = Self { tried: 60_000, whole: 1 << 16, small: 1 << 12, many: 16, cases: 1024 };
}

/// Inputs of a case, below which those of the case around it stand for them.
const FEW: usize = 1024;

/// Function against text.
pub(super) struct Cases<'a> {
    expected: &'a Expected,
    effort: Effort,
    stop: &'a AtomicBool,
    /// Paths followed.
    pub(super) paths: usize,
    /// Cases so far.
    begun: usize,
}

/// What is open of a case: the machine's values, those of the text, and their places in the whole.
type Open = Vec<(usize, (Node, Node))>;

impl<'a> Cases<'a> {
    pub(super) fn new(expected: &'a Expected, effort: Effort, stop: &'a AtomicBool) -> Self {
        Self { expected, effort, stop, paths: 0, begun: 0 }
    }

    /// Those of these pairs that are not shown to be equal.
    ///
    /// # Errors
    /// When it is to stop.
    pub(super) fn unequal(
        &mut self,
        graph: &mut Graph,
        pairs: &[(Node, Node)],
        tried: &[Tried],
    ) -> Result<Vec<usize>, String> {
        self.left(graph, pairs.iter().copied().enumerate().collect(), tried, self.effort.whole)
    }

    fn left(&mut self, graph: &mut Graph, mut open: Open, tried: &[Tried], whole: usize) -> Result<Vec<usize>, String> {
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
                // One side may decide by what the other has found to be the same on both ways.
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
            // What is not shown in one case need not be in the other.
            open.retain(|(at, _)| !left.contains(at));
            let roots: Vec<Node> = pairs_of(&open).into_iter().flat_map(|(a, b)| [a, b]).collect();
            let (mut case, roots) = graph.case(t, truth, &roots);
            let pairs = open.iter().zip(roots.chunks(2)).map(|(&(at, _), pair)| (at, (pair[0], pair[1]))).collect();
            let mut values = vec![0; t + 1];
            let so = |tried: &&Tried| {
                inputs::compute(graph, tried, &mut values);
                (values[t] != 0) == truth
            };
            let of_case: Vec<Tried> = tried.iter().filter(so).cloned().collect();
            // Few inputs tell too little apart, and what is equal in a case is mostly so without it.
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

/// The truth that decides the most choices, of both or of either, and how many.
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
    /// The case in which this truth is so, and what these values are in it.
    pub(super) fn case(&self, t: Node, truth: bool, roots: &[Node]) -> (Self, Vec<Node>) {
        let mut case = Case { all: self, graph: self.fresh(), made: Mixing::default() };
        // What is known last comes first: in what was known before it may stand, but not the other way round.
        case.suppose(t, truth);
        for &(t, truth) in &self.supposed {
            case.suppose(t, truth);
        }
        let roots = roots.iter().map(|root| case.made(*root)).collect();
        (case.graph, roots)
    }
}

/// A case that is being made.
struct Case<'a> {
    all: &'a Graph,
    graph: Graph,
    /// By what stands for it in the whole: what it is here.
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
                // Of `c and x` that holds, and of `not c or x` that does not, both are known.
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

    /// As a whole: whatever it is made of may still be so or not.
    fn note(&mut self, t: Node, truth: bool) {
        let here = self.made(t);
        if self.graph.decided(here).is_none() {
            self.graph.suppose(here, truth);
        }
    }

    /// What stands here for a value, if that has been made.
    fn ready(&mut self, node: Node) -> Option<Node> {
        let (node, turned) = self.all.found(node);
        let made = *self.made.get(&node)?;
        Some(if turned { self.graph.not(made) } else { made })
    }

    /// What a value of the whole is here.
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
