//! The values of a record without what need not be computed: constants folded, equal values one, and what an assumption
//! about the inputs decides decided.
//!
//! A simplification is one of numbers as the chip has them, single precision: every bit is that of the record, for
//! every input. Numbers are folded by the same operation in the same precision; beyond that only x + (-0) = x and
//! x - 0 = x are used, and x + 0 = x of a count times a positive number, which is never -0.

use std::collections::HashMap;

use tick_record::{Id, Op, Record, Test};

/// A value of a [`Graph`], by its place there.
pub(crate) type N = usize;

/// What makes a value; operands have lower places.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Node {
    /// One of the record's inputs, by its place.
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
    /// 32 bits that wrap.
    Count(u32),
    CountSince(N, N),
    CountPlus(N, N),
    /// Its low bits with their sign.
    CountSigned(N, u32),
    /// Whole ones of the first number in it, times the second.
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

/// Values that differ.
#[derive(Clone, Debug, Default)]
pub(crate) struct Graph {
    pub(crate) nodes: Vec<Node>,
    known: HashMap<Node, N>,
}

impl Graph {
    /// All values of a record, by their [`Id::index`]; `given` stands for the values that it names.
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

    /// Is this surely not -0? A count is no -0, and times at least the smallest normal number it is no smaller.
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

    /// The place of a value, which is simplified first.
    pub(crate) fn add(&mut self, node: Node) -> N {
        let number = |n: N| self.number(n);
        let truth = |n: N| if let Node::Truth(truth) = self.nodes[n] { Some(truth) } else { None };
        let is_zero =
            |n: N, sign: f32| number(n).is_some_and(|zero| zero == 0.0 && zero.is_sign_negative() == (sign < 0.0));
        // What is not a number may have any bits: it is left to the chip.
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
