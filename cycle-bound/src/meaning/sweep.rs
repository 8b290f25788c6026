//! Are two values of a graph equal for every input? Found by trying numbers, shown by following terms.
//!
//! A tick of a drive with two encoders has tens of millions of paths, because what one encoder may meet is multiplied
//! by what the other may, and that by what the law has. But there are values between: a believed angle is one value,
//! whatever way it came. So all values of text and machine are computed for many inputs, and those that have been the
//! same on all of them are supposed to be equal. From the inputs on, each such pair is then shown to be: on all paths
//! of that part of the graph that lies between it and values that have been shown before, which may be anything. What
//! has been shown is one value from then on, so each part of the graph is followed once, and small. (Circuits are
//! compared in this way since the nineties.)
//!
//! Numbers show nothing but where it is worth looking, and where two results differ: no pair is equal because no
//! number has told it apart.

use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};

use super::graph::{Graph, Node, Op, Run, Value};
use super::term::{Mixing, Path, Signs, Terms};
use super::text::{Expected, Kind, Place};

/// Inputs tried.
const TRIED: usize = 20_000;
/// Inputs that are kept because a decision has seldom gone that way.
const SELDOM: u32 = 4;
/// Values of one signature that a value is held against.
const CANDIDATES: usize = 3;
/// Paths of all results together, up to which nothing is cut off.
pub(super) const WHOLE: usize = 1 << 16;
/// How many values that are known may lie between a pair and where it is cut off, and the paths that may take: one
/// after the other, until it is shown. What is not shown in a round is tried again in the next one, when more is known.
const ROUNDS: [Round; 6] = [
    Round { of_both: true, depths: &[(0, 32), (1, 64), (2, 128)], last: &[(2, 256)] },
    Round { of_both: false, depths: &[(0, 32), (1, 64), (2, 128)], last: &[(2, 256)] },
    Round { of_both: true, depths: &[(1, 256), (3, 256), (5, 512)], last: &[(4, 1 << 11)] },
    Round { of_both: false, depths: &[(1, 256), (3, 256), (5, 512)], last: &[(4, 1 << 12), (8, 1 << 13)] },
    Round { of_both: false, depths: &[(2, 1024), (5, 2048), (8, 2048)], last: &[(4, 1 << 13), (8, 1 << 15)] },
    Round { of_both: false, depths: &[(3, 4096), (8, 8192)], last: &[(8, 1 << 16), (usize::MAX, 1 << 16)] },
];

struct Round {
    /// Only what text and machine have in common?
    of_both: bool,
    depths: &'static [(usize, usize)],
    /// The same for what is to be equal at the end.
    last: &'static [(usize, usize)],
}

/// Text and machine in one graph.
pub(super) struct Sweep<'a> {
    graph: &'a mut Graph,
    expected: &'a Expected,
    /// Which of them text and machine need: 1, 2, 3 is both.
    sides: Vec<u8>,
    /// Of each value what it was on all that was tried, and of a truth what its opposite was.
    signatures: Vec<[u64; 2]>,
    /// Paths followed in all.
    pub(super) paths: usize,
}

impl<'a> Sweep<'a> {
    pub(super) fn new(graph: &'a mut Graph, expected: &'a Expected, of_text: &[Node], of_machine: &[Node]) -> Self {
        let mut sides = vec![0; graph.ops.len()];
        for (roots, side) in [(of_text, 1), (of_machine, 2)] {
            for root in roots {
                sides[*root] |= side;
            }
            // Parts stand before what is made of them.
            for node in (0..graph.ops.len()).rev() {
                for part in graph.ops[node].parts() {
                    sides[part] |= sides[node] & side;
                }
            }
        }
        let signatures = vec![[0; 2]; graph.ops.len()];
        Self { graph, expected, sides, signatures, paths: 0 }
    }

    /// Computes everything for many inputs; the first of these pairs that is not the same, with those inputs.
    pub(super) fn try_numbers(&mut self, results: &[Node], pairs: &[(Node, Node)]) -> Option<(usize, Vec<u32>)> {
        let mut inputs = Inputs::new(self.graph, self.expected);
        let mut values = vec![0; self.graph.ops.len()];
        let mut seen = vec![[0_u32; 2]; self.graph.ops.len()];
        for round in 0..TRIED {
            let tried = inputs.next(self.expected);
            for node in 0..self.graph.ops.len() {
                values[node] = match self.graph.ops[node] {
                    Op::Input(at) | Op::Given(at) => tried[at],
                    // Each elsewhere, and in another order every time.
                    Op::Entry(register) => 0x2000_0000 + ((register ^ round as u32 & 63) << 16),
                    op => Graph::computed(op, &|part| values[part]),
                };
            }
            let mut is_rare = false;
            for node in 0..values.len() {
                let value = values[node];
                let [signature, opposite] = &mut self.signatures[node];
                *signature = mixed(*signature, value);
                *opposite = mixed(*opposite, 1_u32.wrapping_sub(value));
                if self.graph.is_truth(node) {
                    let times = &mut seen[node][value as usize & 1];
                    is_rare |= *times < SELDOM;
                    *times += 1;
                }
            }
            if let Some(at) = pairs.iter().position(|(a, b)| values[*a] != values[*b]) {
                return Some((at, tried));
            }
            let results: Vec<u32> = results.iter().map(|result| values[*result]).collect();
            inputs.learn(self.expected, tried, &results, is_rare);
        }
        None
    }

    /// Joins what is equal, from the inputs on, until all these pairs are; those that are not shown to be. What has so
    /// many paths as a whole is followed as it is.
    ///
    /// # Errors
    /// When it is to stop.
    pub(super) fn unequal(
        &mut self,
        pairs: &[(Node, Node)],
        whole: usize,
        stop: &AtomicBool,
    ) -> Result<Vec<usize>, String> {
        let all: Vec<(Node, Node, bool)> = pairs.iter().map(|&(a, b)| (a, b, false)).collect();
        let all_signs = [Signs::Whole, Signs::Known, Signs::Asked];
        if all_signs.into_iter().any(|signs| self.follow(&all, &HashSet::new(), signs, whole) == Some(true)) {
            return Ok(Vec::new());
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
            let signs: &[Signs] =
                if cone.has_signs { &[Signs::Asked, Signs::Whole, Signs::Known] } else { &[Signs::Whole] };
            let mut is_long = true;
            for signs in signs {
                match self.follow(&[(a, b, turned)], &cone.cuts, *signs, paths) {
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

    /// What lies before both, to where it is cut off.
    fn cone(&self, a: Node, b: Node, depth: usize) -> Cone {
        let mut cone = Cone { cuts: HashSet::new(), has_signs: false };
        let mut nearest: Mixing<Node, usize> = Mixing::default();
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
        cone.cuts.retain(|node| !nearest.contains_key(node));
        cone
    }

    /// On all paths: are they the same? Nothing if that takes more paths, or cannot be followed.
    fn follow(
        &mut self,
        pairs: &[(Node, Node, bool)],
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
            for &(a, b, turned) in pairs {
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
    cuts: HashSet<Node>,
    /// Has it values that may be asked for their signs?
    has_signs: bool,
}

/// Memory of these sizes has no byte in common.
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

/// Inputs to try: changed a little from those before, or what a call leaves for the next one.
struct Inputs {
    random: u64,
    /// Constants of the graph.
    constants: Vec<u32>,
    kept: Vec<Vec<u32>>,
    /// By the input, which result stands in its place.
    again: Vec<Option<usize>>,
    last: Option<Vec<u32>>,
}

/// How many are kept.
const KEPT: usize = 4096;

impl Inputs {
    fn new(graph: &Graph, expected: &Expected) -> Self {
        let constants = graph.ops.iter().filter_map(|op| if let Op::Bits(bits) = op { Some(*bits) } else { None });
        let again = |place: Place| expected.outs.iter().position(|out| out.place == place);
        Self {
            random: 1,
            constants: constants.chain([0, 1, 0x3f80_0000, 0x7fc0_0000, 0x7f80_0000, 0x7f7f_ffff, 1 << 31]).collect(),
            kept: vec![vec![0; expected.inputs.len()]],
            again: expected.inputs.iter().map(|port| again(port.place)).collect(),
            last: None,
        }
    }

    fn below(&mut self, end: usize) -> usize {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.random >> 33) as usize % end
    }

    fn next(&mut self, expected: &Expected) -> Vec<u32> {
        let at = self.below(self.kept.len());
        let mut inputs = self.last.take().unwrap_or_else(|| self.kept[at].clone());
        let most = if self.below(8) == 0 { inputs.len() } else { 4 };
        for _ in 0..=self.below(most.max(1)) {
            if inputs.is_empty() {
                break;
            }
            // Samples more often than what stays.
            let mut at = self.below(inputs.len());
            if self.again[at].is_some() && self.below(2) == 0 {
                at = self.below(inputs.len());
            }
            inputs[at] = self.word(expected.inputs[at].kind, inputs[at], &inputs.clone(), expected);
        }
        inputs
    }

    fn word(&mut self, kind: Kind, before: u32, inputs: &[u32], expected: &Expected) -> u32 {
        let other = self.below(inputs.len());
        let like = if expected.inputs[other].kind == kind { inputs[other] } else { before };
        let constant = self.below(self.constants.len());
        let constant = self.constants[constant];
        let bits = self.random as u32 ^ (self.random >> 32) as u32;
        let number = |value: f32| if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() };
        match kind {
            Kind::Truth | Kind::Either(..) => bits >> 7 & 1,
            Kind::Count => match self.below(8) {
                0 => bits,
                1 => constant,
                2 => like.wrapping_add(constant),
                3 => like.wrapping_add(bits >> 31).wrapping_sub(bits >> 30 & 1),
                4 => like.wrapping_add(bits >> 26).wrapping_sub(32),
                5 => like.wrapping_add(bits >> 20).wrapping_sub(2048),
                6 => before.wrapping_add(1 << (bits >> 27)),
                _ => like,
            },
            Kind::Number => {
                let (like, before, constant) = (f32::from_bits(like), f32::from_bits(before), f32::from_bits(constant));
                let random = (bits as f32 / 4e9 - 0.5) * 10_f32.powi(self.below(13) as i32 - 6);
                number(match self.below(12) {
                    0 => f32::from_bits(bits),
                    1 => constant,
                    2 => -constant,
                    3 => like,
                    4 => -like,
                    5 => f32::from_bits(constant.to_bits() ^ 1),
                    6 => before * (1.0 + random * 0.001),
                    7 => {
                        let at = self.below(6);
                        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, f32::MAX][at]
                    }
                    8 => like + random,
                    _ => random,
                })
            }
        }
    }

    /// A call's results come in again.
    fn learn(&mut self, expected: &Expected, inputs: Vec<u32>, results: &[u32], is_rare: bool) {
        if self.below(4) > 0 {
            let of = |(at, before): (usize, &u32)| match (
                self.again[at].map(|out| results[out]),
                expected.inputs[at].kind,
            ) {
                (Some(word), Kind::Truth) => word & 1,
                (Some(word), Kind::Either(yes, _)) => (word == yes).into(),
                (Some(word), _) => word,
                (None, _) => *before,
            };
            self.last = Some(inputs.iter().enumerate().map(of).collect());
        }
        if is_rare || self.kept.len() < 16 {
            if self.kept.len() < KEPT {
                self.kept.push(inputs);
            } else {
                let at = self.below(KEPT);
                self.kept[at] = inputs;
            }
        }
    }
}
