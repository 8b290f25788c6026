//! Numeric inputs that find differing results and candidates for equal values.
//!
//! An input is a small change of an earlier input, a constant of the graph, another input, or a result that one call
//! leaves for the next. Inputs that take a decision in a rare direction are kept. Numbers prove nothing: a pair is
//! never accepted as equal because no input separates it.

use super::graph::{Graph, Node, Op};
use super::text::{Expected, Place, ValueKind};

/// Number of inputs kept per direction of a decision.
const SELDOM: u32 = 4;

/// Number of the trial and its inputs.
pub(super) type Trial = (u32, Vec<u32>);

/// Returns the first pair that differs for an input, with the input, or all inputs if no pair differs.
pub(super) fn difference(
    graph: &Graph,
    expected: &Expected,
    results: &[Node],
    pairs: &[(Node, Node)],
    turns: u32,
) -> Result<Vec<Trial>, (usize, Vec<u32>)> {
    let mut inputs = Inputs::new(graph, expected);
    let mut values = vec![0; graph.ops.len()];
    let mut seen = vec![[0_u32; 2]; graph.ops.len()];
    let mut all = Vec::new();
    for turn in 0..turns {
        let tried = (turn, inputs.next(expected));
        compute(graph, &tried, &mut values);
        let mut is_rare = false;
        for (node, value) in values.iter().enumerate().filter(|(node, _)| graph.is_truth(*node)) {
            let times = &mut seen[node][*value as usize & 1];
            is_rare |= *times < SELDOM;
            *times += 1;
        }
        if let Some(at) = pairs.iter().position(|(a, b)| values[*a] != values[*b]) {
            return Err((at, tried.1));
        }
        all.push(tried.clone());
        let results: Vec<u32> = results.iter().map(|result| values[*result]).collect();
        inputs.learn(expected, tried.1, &results, is_rare);
    }
    Ok(all)
}

/// Computes the values of the first `values.len()` nodes for these inputs.
pub(super) fn compute(graph: &Graph, (turn, inputs): &Trial, values: &mut [u32]) {
    for node in 0..values.len() {
        values[node] = match graph.ops[node] {
            Op::Input(at) | Op::Given(at) => inputs[at],
            // Each region at another address, in a different order in every trial.
            Op::Entry(register) => 0x2000_0000 + ((register ^ turn & 63) << 16),
            op => Graph::computed(op, &|part| values[part]),
        };
    }
}

/// Generator of inputs.
struct Inputs {
    random: u64,
    /// Constants of the graph.
    constants: Vec<u32>,
    kept: Vec<Vec<u32>>,
    /// Per input, the index of the result in the same place.
    again: Vec<Option<usize>>,
    last: Option<Vec<u32>>,
}

/// Largest number of kept inputs.
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
            // Prefers samples to inputs that stay constant.
            let mut at = self.below(inputs.len());
            if self.again[at].is_some() && self.below(2) == 0 {
                at = self.below(inputs.len());
            }
            inputs[at] = self.word(expected.inputs[at].kind, inputs[at], &inputs.clone(), expected);
        }
        inputs
    }

    fn word(&mut self, kind: ValueKind, before: u32, inputs: &[u32], expected: &Expected) -> u32 {
        let other = self.below(inputs.len());
        let like = if expected.inputs[other].kind == kind { inputs[other] } else { before };
        let constant = self.below(self.constants.len());
        let constant = self.constants[constant];
        let bits = self.random as u32 ^ (self.random >> 32) as u32;
        let number = |value: f32| if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() };
        match kind {
            ValueKind::Truth | ValueKind::Either(..) => bits >> 7 & 1,
            ValueKind::Count => match self.below(8) {
                0 => bits,
                1 => constant,
                2 => like.wrapping_add(constant),
                3 => like.wrapping_add(bits >> 31).wrapping_sub(bits >> 30 & 1),
                4 => like.wrapping_add(bits >> 26).wrapping_sub(32),
                5 => like.wrapping_add(bits >> 20).wrapping_sub(2048),
                6 => before.wrapping_add(1 << (bits >> 27)),
                _ => like,
            },
            ValueKind::Number => {
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

    /// Feeds the results of a call back as inputs.
    fn learn(&mut self, expected: &Expected, inputs: Vec<u32>, results: &[u32], is_rare: bool) {
        if self.below(4) > 0 {
            let of = |(at, before): (usize, &u32)| match (
                self.again[at].map(|out| results[out]),
                expected.inputs[at].kind,
            ) {
                (Some(word), ValueKind::Truth) => word & 1,
                (Some(word), ValueKind::Either(yes, _)) => (word == yes).into(),
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
