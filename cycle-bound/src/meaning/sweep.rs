//! Equivalence of two values of a graph for every input: candidates from numeric inputs, proofs by following terms.
//!
//! A tick of a drive with two encoders has tens of millions of paths, because the paths of both encoders and of the
//! control law multiply. Intermediate values reduce this number: an accepted angle is one value on every path. All
//! values of the specification and of the machine code are therefore computed for many inputs. Values that agree on all
//! inputs are candidates for equality. From the inputs on, each candidate pair is then proved equal on all paths of the
//! graph between the pair and earlier proved values, which count as arbitrary. Proved values are joined to one value,
//! so each part of the graph is followed once and stays small. This is SAT sweeping, a method of combinational
//! equivalence checking from the 1990s.
//!
//! Numbers only guide the search and find differing results: a pair is never accepted as equal because no input
//! separates it.

use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};

use super::graph::{Graph, Node, Op, Run, Value};
use super::inputs::{self, Trial};
use super::term::{Mixing, Path, Signs, Terms};
use super::text::Expected;

/// Number of inputs for the search of candidates.
const TRIED: usize = 4096;
/// Number of values of one signature that a value is compared with.
const CANDIDATES: usize = 3;
/// Rounds of the search. A depth is the number of known values between a pair and the cut, with the limit of paths; the
/// depths are tried in order. A pair without a proof is tried again in the next round, when more values are known.
const ROUNDS: [Round; 4] = [
    Round { of_both: true, depths: &[(0, 32), (1, 64), (2, 128)], last: &[(2, 256)] },
    Round { of_both: false, depths: &[(0, 32), (1, 64), (2, 128)], last: &[(2, 256)] },
    Round { of_both: true, depths: &[(1, 256), (3, 256), (5, 512)], last: &[(4, 1 << 11)] },
    Round { of_both: false, depths: &[(1, 256), (3, 256), (5, 512)], last: &[(4, 1 << 12), (8, 1 << 13)] },
];

struct Round {
    /// Restricts the pairs to values of the specification with values of the machine code.
    of_both: bool,
    depths: &'static [(usize, usize)],
    /// Depths for the final results.
    last: &'static [(usize, usize)],
}

/// Specification and machine code in one graph.
pub(super) struct Sweep<'a> {
    pub(super) graph: &'a mut Graph,
    expected: &'a Expected,
    /// Users of each value: 1 specification, 2 machine code, 3 both.
    sides: Vec<u8>,
    /// Signature of each value over all inputs, and of its opposite if it is a truth.
    signatures: Vec<[u64; 2]>,
    /// Number of followed paths.
    pub(super) paths: usize,
}

impl<'a> Sweep<'a> {
    /// Creates the sweep for pairs of a machine value and a specified value.
    pub(super) fn new(graph: &'a mut Graph, expected: &'a Expected, pairs: &[(Node, Node)]) -> Self {
        let mut sides = vec![0; graph.ops.len()];
        for &(machine, text) in pairs {
            sides[text] |= 1;
            sides[machine] |= 2;
        }
        // Operands precede the values that use them.
        for node in (0..graph.ops.len()).rev() {
            for part in graph.ops[node].parts() {
                sides[part] |= sides[node];
            }
        }
        let signatures = vec![[0; 2]; graph.ops.len()];
        Self { graph, expected, sides, signatures, paths: 0 }
    }

    /// Returns whether all pairs are equal, followed directly on at most `limit` paths.
    pub(super) fn is_followed(&mut self, pairs: &[(Node, Node)], limit: usize) -> bool {
        let all: Vec<(Node, Node, bool)> = pairs.iter().map(|&(a, b)| (a, b, false)).collect();
        let (supposed, none) = (self.supposed(&|_| true), HashSet::new());
        let all_signs = [Signs::Whole, Signs::Known, Signs::Asked];
        all_signs.into_iter().any(|signs| self.follow(&all, &supposed, &none, signs, limit) == Some(true))
    }

    /// Returns the assumptions of the case on values that are in view.
    fn supposed(&self, is_near: &dyn Fn(Node) -> bool) -> Vec<(Node, bool)> {
        let is_leaf = |node: Node| self.graph.ops[node].parts().next().is_none();
        let is_told = |part: Node| {
            let (part, _) = self.graph.found(part);
            is_leaf(part) || is_near(part)
        };
        let all = self.graph.supposed.iter().copied();
        all.filter(|(t, _)| self.graph.ops[*t].parts().all(is_told)).collect()
    }

    /// Joins equal values, from the inputs on, until all pairs are equal; returns the indices of the pairs without a
    /// proof.
    ///
    /// # Errors
    /// The `stop` flag was set.
    pub(super) fn unequal(
        &mut self,
        pairs: &[(Node, Node)],
        tried: &[Trial],
        stop: &AtomicBool,
    ) -> Result<Vec<usize>, String> {
        let mut values = vec![0; self.graph.ops.len()];
        for tried in tried.iter().take(TRIED) {
            inputs::compute(self.graph, tried, &mut values);
            for (value, [signature, opposite]) in values.iter().zip(&mut self.signatures) {
                *signature = mixed(*signature, *value);
                *opposite = mixed(*opposite, 1_u32.wrapping_sub(*value));
            }
        }
        let mut levels = vec![0; self.graph.ops.len()];
        for node in 0..levels.len() {
            levels[node] = self.graph.ops[node].parts().map(|part| levels[part] + 1).max().unwrap_or(0);
        }
        let mut order: Vec<Node> = (0..levels.len()).filter(|node| self.sides[*node] > 0).collect();
        order.sort_by_key(|node| (levels[*node], *node));
        let mut open: Vec<usize> = (0..pairs.len()).collect();
        for Round { of_both, depths, last } in &ROUNDS {
            self.sweep(&order, depths, *of_both, stop)?;
            open.retain(|at| {
                let (a, b) = pairs[*at];
                self.graph.found(a) != self.graph.found(b) && !self.is_shown(a, b, false, last)
            });
            if open.is_empty() {
                break;
            }
        }
        Ok(open)
    }

    fn sweep(
        &mut self,
        order: &[Node],
        depths: &[(usize, usize)],
        of_both: bool,
        stop: &AtomicBool,
    ) -> Result<(), String> {
        let mut classes: HashMap<(bool, u64), Vec<Node>> = HashMap::new();
        for &node in order {
            if stop.load(Ordering::Relaxed) {
                return Err("stopped".into());
            }
            if self.graph.found(node).0 != node {
                continue;
            }
            let [signature, opposite] = self.signatures[node];
            let is_truth = self.graph.is_truth(node);
            let key = if is_truth { signature.min(opposite) } else { signature };
            let class = classes.entry((is_truth, key)).or_default();
            let turned = |with: Node| is_truth && self.signatures[with][0] != signature;
            let candidates: Vec<(Node, bool)> = (class.iter())
                .filter(|with| !of_both || self.sides[**with] | self.sides[node] == 3)
                .take(CANDIDATES)
                .map(|&with| (with, turned(with)))
                .collect();
            match candidates.into_iter().find(|&(with, turned)| self.is_shown(node, with, turned, depths)) {
                Some((with, turned)) => self.join(node, with, turned),
                None => class.push(node),
            }
        }
        Ok(())
    }

    fn join(&mut self, node: Node, with: Node, turned: bool) {
        self.graph.join(node, with, turned);
        let (with, _) = self.graph.found(with);
        self.sides[with] |= self.sides[node];
    }

    fn is_shown(&mut self, a: Node, b: Node, turned: bool, depths: &[(usize, usize)]) -> bool {
        let ((a, of_a), (b, of_b)) = (self.graph.found(a), self.graph.found(b));
        let turned = turned ^ of_a ^ of_b;
        for &(depth, paths) in depths {
            let cone = self.cone(a, b, depth);
            let near = |node| cone.near.contains_key(&node) || cone.cuts.contains(&node);
            let supposed = self.supposed(&near);
            let signs: &[Signs] =
                if cone.has_signs { &[Signs::Asked, Signs::Whole, Signs::Known] } else { &[Signs::Whole] };
            let mut is_long = true;
            for signs in signs {
                match self.follow(&[(a, b, turned)], &supposed, &cone.cuts, *signs, paths) {
                    Some(true) => return true,
                    Some(false) => is_long = false,
                    None => {}
                }
            }
            if is_long {
                break;
            }
            if cone.cuts.is_empty() {
                break;
            }
        }
        false
    }

    /// Returns the operands of both values up to the cut.
    fn cone(&self, a: Node, b: Node, depth: usize) -> Cone {
        let mut cone = Cone { near: Mixing::default(), cuts: HashSet::new(), has_signs: false };
        let nearest = &mut cone.near;
        let mut open = VecDeque::from([(a, 0), (b, 0)]);
        while let Some((node, far)) = open.pop_front() {
            if nearest.get(&node).is_some_and(|nearest| *nearest <= far) {
                continue;
            }
            nearest.insert(node, far);
            cone.cuts.remove(&node);
            let op = self.graph.ops[node];
            cone.has_signs |= matches!(op, Op::One("abs", _) | Op::Two("quotient", ..));
            for part in op.parts() {
                let (part, _) = self.graph.found(part);
                let is_leaf = self.graph.ops[part].parts().next().is_none();
                let is_shared = self.sides[part] == 3 && !is_leaf;
                let far = far.saturating_add(usize::from(is_shared));
                if nearest.get(&part).is_some_and(|nearest| *nearest <= far) {
                    continue;
                }
                if far > depth {
                    cone.cuts.insert(part);
                } else if is_shared {
                    open.push_back((part, far));
                } else {
                    open.push_front((part, far));
                }
            }
        }
        let Cone { near, cuts, .. } = &mut cone;
        cuts.retain(|node| !near.contains_key(node));
        cone
    }

    /// Compares pairs on all paths. Returns `None` if the paths exceed the limit or cannot be followed.
    fn follow(
        &mut self,
        pairs: &[(Node, Node, bool)],
        supposed: &[(Node, bool)],
        cuts: &HashSet<Node>,
        signs: Signs,
        limit: usize,
    ) -> Option<bool> {
        let mut terms = Terms::default();
        let mut script = Some(Vec::new());
        let mut values = Mixing::default();
        for _ in 0..limit {
            let Some(answers) = script.take() else { return Some(true) };
            self.paths += 1;
            let mut path = Path::new(&mut terms, &answers, signs);
            apart(&mut path, self.expected);
            values.clear();
            let mut run = Run { graph: self.graph, cuts: &|node| cuts.contains(&node), values: &mut values };
            let mut is_of_case = true;
            for &(t, truth) in supposed {
                let Value::Truth(is) = run.value(t, &mut path)? else { return None };
                is_of_case &= is == truth;
            }
            for &(a, b, turned) in pairs.iter().filter(|_| is_of_case) {
                let one = run.value(a, &mut path)?;
                let other = match run.value(b, &mut path)? {
                    Value::Truth(truth) => Value::Truth(truth != turned),
                    word @ Value::Word(_) => word,
                };
                if one != other {
                    return Some(false);
                }
            }
            script = Path::next(path.answers());
        }
        script.is_none().then_some(true)
    }
}

struct Cone {
    /// Values of the cone and their distance.
    near: Mixing<Node, usize>,
    cuts: HashSet<Node>,
    /// Set if the cone has values whose sign may be decided.
    has_signs: bool,
}

/// Assumes that memory regions of these sizes do not overlap.
fn apart(path: &mut Path<'_>, expected: &Expected) {
    for (k, &(base, size)) in expected.sizes.iter().enumerate() {
        for &(other, of_other) in &expected.sizes[..k] {
            let (one, two) = (path.terms.entry(base), path.terms.entry(other));
            path.are_apart(one, size, two, of_other);
        }
    }
}

fn mixed(signature: u64, value: u32) -> u64 {
    ((signature ^ u64::from(value)).rotate_left(23) ^ signature >> 7).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}
