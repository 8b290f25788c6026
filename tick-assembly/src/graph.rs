//! The values of a trace after simplification: constants are folded, equal values are merged, and decisions that follow
//! from an assumption about the inputs are resolved.
//!
//! Simplification uses single precision, as on the target: every bit equals the trace, for every input. Numbers are
//! folded by the same operation in the same precision. The only other rules are x + (-0) = x and x - 0 = x, and x + 0 =
//! x for a count times a positive number, which is never -0.

use std::collections::HashMap;

use tick_record::{Id, Op, Record, Test};

/// Index of a value in a [`Graph`].
pub(crate) type N = usize;

/// Operation of a value; operands have lower indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Node {
    /// An input of the trace, by its index.
    Input(usize),
    /// A number, by its bits.
    Number(u32),
    Truth(bool),
    Neg(N),
    Abs(N),
    Add(N, N),
    Sub(N, N),
    Mul(N, N),
    Div(N, N),
    Compare(Test, N, N),
    And(N, N),
    Or(N, N),
    Not(N),
    Select(N, N, N),
    /// A wrapping 32-bit count.
    Count(u32),
    CountSince(N, N),
    CountPlus(N, N),
    /// Low bits of a count, sign-extended.
    CountSigned(N, u32),
    /// Number of whole units (first number) in a count, times the second number.
    CountWhole(N, u32, u32),
    NumberOf(N),
}

impl Node {
    pub(crate) fn operands(self) -> impl Iterator<Item = N> {
        let all = match self {
            Self::Input(_) | Self::Number(_) | Self::Truth(_) | Self::Count(_) => [None; 3],
            Self::Neg(a)
            | Self::Abs(a)
            | Self::Not(a)
            | Self::CountSigned(a, _)
            | Self::CountWhole(a, ..)
            | Self::NumberOf(a) => [Some(a), None, None],
            Self::Add(a, b)
            | Self::Sub(a, b)
            | Self::Mul(a, b)
            | Self::Div(a, b)
            | Self::Compare(_, a, b)
            | Self::And(a, b)
            | Self::Or(a, b)
            | Self::CountSince(a, b)
            | Self::CountPlus(a, b) => [Some(a), Some(b), None],
            Self::Select(a, b, c) => [Some(a), Some(b), Some(c)],
        };
        all.into_iter().flatten()
    }
}

/// A set of distinct values.
#[derive(Clone, Debug, Default)]
pub(crate) struct Graph {
    pub(crate) nodes: Vec<Node>,
    known: HashMap<Node, N>,
}

impl Graph {
    /// Adds all values of a trace, by their [`Id::index`]; `given` replaces the values that it contains.
    pub(crate) fn values(&mut self, record: &Record, given: &HashMap<usize, N>) -> Vec<N> {
        let mut values: Vec<N> = Vec::with_capacity(record.values.len());
        for (at, value) in record.values.iter().enumerate() {
            let of = |id: Id| values[id.index()];
            let node = match value.op {
                Op::Input(port) => Node::Input(port),
                Op::Constant(number) => Node::Number((number as f32).to_bits()),
                Op::Truth(truth) => Node::Truth(truth),
                Op::Neg(a) => Node::Neg(of(a)),
                Op::Abs(a) => Node::Abs(of(a)),
                Op::Add(a, b) => Node::Add(of(a), of(b)),
                Op::Sub(a, b) => Node::Sub(of(a), of(b)),
                Op::Mul(a, b) => Node::Mul(of(a), of(b)),
                Op::Div(a, b) => Node::Div(of(a), of(b)),
                Op::Compare(test, a, b) => Node::Compare(test, of(a), of(b)),
                Op::And(a, b) => Node::And(of(a), of(b)),
                Op::Or(a, b) => Node::Or(of(a), of(b)),
                Op::Not(a) => Node::Not(of(a)),
                Op::Select(c, a, b) => Node::Select(of(c), of(a), of(b)),
                Op::CountOf(count) => Node::Count(count),
                Op::CountSince(a, b) => Node::CountSince(of(a), of(b)),
                Op::CountPlus(a, b) => Node::CountPlus(of(a), of(b)),
                Op::CountSigned(a, bits) => Node::CountSigned(of(a), bits),
                Op::CountWhole(a, of_each, each) => Node::CountWhole(of(a), of_each, each),
                Op::NumberOf(a) => Node::NumberOf(of(a)),
            };
            let value = given.get(&at).copied().unwrap_or_else(|| self.add(node));
            values.push(value);
        }
        values
    }

    /// Returns whether the value is never -0. A count is never -0, and its product with at least the smallest normal
    /// number does not underflow.
    fn is_no_negative_zero(&self, n: N) -> bool {
        let is_count = |n: N| matches!(self.nodes[n], Node::NumberOf(_));
        let scales = |n: N| self.number(n).is_some_and(|number| number >= f32::MIN_POSITIVE);
        match self.nodes[n] {
            Node::NumberOf(_) => true,
            Node::Mul(a, b) => (scales(a) && is_count(b)) || (scales(b) && is_count(a)),
            _ => false,
        }
    }

    fn number(&self, n: N) -> Option<f32> {
        if let Node::Number(bits) = self.nodes[n] { Some(f32::from_bits(bits)) } else { None }
    }

    /// Returns the index of a value after simplification.
    pub(crate) fn add(&mut self, node: Node) -> N {
        let number = |n: N| self.number(n);
        let truth = |n: N| if let Node::Truth(truth) = self.nodes[n] { Some(truth) } else { None };
        let is_zero =
            |n: N, sign: f32| number(n).is_some_and(|zero| zero == 0.0 && zero.is_sign_negative() == (sign < 0.0));
        // A NaN may have any bits, so the processor computes it.
        let folded = |number: f32| (!number.is_nan()).then(|| Node::Number(number.to_bits()));
        let two = |a: N, b: N, f: fn(f32, f32) -> f32| number(a).zip(number(b)).and_then(|(a, b)| folded(f(a, b)));
        let simpler = match node {
            Node::Neg(a) => number(a).and_then(|a| folded(-a)),
            Node::Abs(a) => number(a).and_then(|a| folded(a.abs())),
            Node::Add(a, b) if is_zero(b, -1.0) => return a,
            Node::Add(a, b) if is_zero(a, -1.0) => return b,
            Node::Sub(a, b) if is_zero(b, 1.0) => return a,
            Node::Add(a, b) if is_zero(b, 1.0) && self.is_no_negative_zero(a) => return a,
            Node::CountSigned(a, 32) => return a,
            Node::Add(a, b) => two(a, b, |a, b| a + b),
            Node::Sub(a, b) => two(a, b, |a, b| a - b),
            Node::Mul(a, b) => two(a, b, |a, b| a * b),
            Node::Div(a, b) => two(a, b, |a, b| a / b),
            Node::Compare(test, a, b) => number(a).zip(number(b)).map(|(a, b)| Node::Truth(test.of(&a, &b))),
            Node::Not(a) => truth(a).map(|a| Node::Truth(!a)),
            Node::And(a, b) | Node::Or(a, b) => {
                let decides = matches!(node, Node::Or(..));
                match (truth(a), truth(b)) {
                    (Some(one), _) if one != decides => return b,
                    (_, Some(one)) if one != decides => return a,
                    (None, None) => None,
                    _ => Some(Node::Truth(decides)),
                }
            }
            Node::Select(_, a, b) if a == b => return a,
            Node::Select(c, a, b) => match truth(c) {
                Some(truth) => return if truth { a } else { b },
                None => None,
            },
            _ => None,
        };
        let node = simpler.unwrap_or(node);
        *self.known.entry(node).or_insert_with(|| {
            self.nodes.push(node);
            self.nodes.len() - 1
        })
    }
}
