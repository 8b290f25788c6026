//! Value graph of a specification and of machine code: operations on words and truths, each stored once.
//!
//! A path evaluates a value to a term of [`Terms`](super::term::Terms). It evaluates only the operations on the path: a
//! [`Op::Select`] uses one of its sides. All identities are therefore in `Terms`. The graph itself only folds constants
//! and selections between equal values.
//!
//! Values with a proof of equality are [`joined`](Graph::join): one of them represents all.

use super::term::{EQUAL, GREATER, LESS, MINUS_ZERO, Mixing, Order, Path, Term, UNORDERED, between, follows, turned};
use super::text::Port;

/// Index of a value in the graph.
pub(super) type Node = usize;

/// Operation on values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Op {
    Bits(u32),
    Truth(bool),
    /// Input that is a word.
    Input(usize),
    /// Input that is a truth.
    Given(usize),
    /// Unknown content of a register at the entry; from [`Graph::REGISTERS`] on, unknown content of memory.
    Entry(u32),
    One(&'static str, Node),
    Two(&'static str, Node, Node),
    /// `a + factor b` modulo 2^32.
    Plus(Node, Node, u32),
    ShiftedRight(Node, u32),
    Signed(Node, u32),
    Compare(u8, Node, Node),
    Ordered(Order, Node, Node),
    Select(Node, Node, Node),
}

impl Op {
    pub(super) fn parts(self) -> impl Iterator<Item = Node> {
        let parts = match self {
            Self::Bits(_) | Self::Truth(_) | Self::Input(_) | Self::Given(_) | Self::Entry(_) => [None; 3],
            Self::One(_, a) | Self::ShiftedRight(a, _) | Self::Signed(a, _) => [Some(a), None, None],
            Self::Two(_, a, b) | Self::Plus(a, b, _) | Self::Compare(_, a, b) | Self::Ordered(_, a, b) => {
                [Some(a), Some(b), None]
            }
            Self::Select(t, a, b) => [Some(t), Some(a), Some(b)],
        };
        parts.into_iter().flatten()
    }
}

/// Set of all possible relations of two numbers.
const ANY: u8 = LESS | EQUAL | GREATER | UNORDERED;
/// Depth of selections between constants into which an operation is propagated.
const CHOICES: usize = 6;

/// Graph of all values, each stored once.
#[derive(Default)]
pub(super) struct Graph {
    pub(super) ops: Vec<Op>,
    known: Mixing<Op, Node>,
    /// Representative of each value, and whether it is the opposite.
    joined: Vec<(Node, bool)>,
    /// Marks truths.
    truths: Vec<bool>,
    entries: u32,
    /// Assumptions of a case, and the known relations between numbers that follow from them.
    pub(super) supposed: Vec<(Node, bool)>,
    facts: Mixing<Node, Vec<(Node, u8)>>,
}

impl Graph {
    /// First index of entries that are not registers.
    const REGISTERS: u32 = 64;

    /// Returns an empty graph whose arbitrary values have names unused here.
    pub(super) fn fresh(&self) -> Self {
        Self { entries: self.entries, ..Self::default() }
    }

    pub(super) fn node(&mut self, op: Op) -> Node {
        if let Some(node) = self.known.get(&op) {
            return *node;
        }
        let constants = op.parts().all(|part| matches!(self.ops[part], Op::Bits(_) | Op::Truth(_)));
        if op.parts().next().is_some() && constants {
            let value = Self::computed(op, &|part| self.folded(part));
            let folded = if self.is_truth_op(op) { Op::Truth(value != 0) } else { Op::Bits(value) };
            return self.node(folded);
        }
        let node = self.ops.len();
        let truth = self.is_truth_op(op);
        self.ops.push(op);
        self.known.insert(op, node);
        self.joined.push((node, false));
        self.truths.push(truth);
        node
    }

    fn is_truth_op(&self, op: Op) -> bool {
        match op {
            Op::Truth(_) | Op::Given(_) | Op::Compare(..) | Op::Ordered(..) | Op::One("not", _) => true,
            Op::Select(_, a, _) => self.truths[a],
            _ => false,
        }
    }

    pub(super) fn is_truth(&self, node: Node) -> bool {
        self.truths[node]
    }

    fn folded(&self, node: Node) -> u32 {
        match self.ops[node] {
            Op::Bits(bits) => bits,
            Op::Truth(truth) => truth.into(),
            _ => 0,
        }
    }

    pub(super) fn constant(&mut self, bits: u32) -> Node {
        self.node(Op::Bits(bits))
    }

    pub(super) fn truth(&mut self, truth: bool) -> Node {
        self.node(Op::Truth(truth))
    }

    pub(super) fn bits(&self, node: Node) -> Option<u32> {
        match self.ops[node] {
            Op::Bits(bits) => Some(bits),
            _ => None,
        }
    }

    /// Returns the value of a constant truth.
    pub(super) fn decided(&self, node: Node) -> Option<bool> {
        match self.ops[node] {
            Op::Truth(truth) => Some(truth),
            _ => None,
        }
    }

    pub(super) fn input(&mut self, at: usize) -> Node {
        self.node(Op::Input(at))
    }

    pub(super) fn given(&mut self, at: usize) -> Node {
        self.node(Op::Given(at))
    }

    pub(super) fn entry(&mut self, register: u32) -> Node {
        self.node(Op::Entry(register))
    }

    /// Creates an arbitrary value.
    pub(super) fn anything(&mut self) -> Node {
        self.entries += 1;
        self.node(Op::Entry(Self::REGISTERS + self.entries))
    }

    /// Returns the address `offset` bytes behind the content of a register at the entry.
    pub(super) fn address(&mut self, register: u32, offset: i32) -> Node {
        let (base, offset) = (self.entry(register), self.constant(offset as u32));
        self.plus(base, offset, 1)
    }

    /// Returns the register and the offset of an address.
    pub(super) fn as_address(&self, node: Node) -> Option<(u32, i32)> {
        match self.ops[node] {
            Op::Entry(register) => Some((register, 0)),
            Op::Plus(base, offset, 1) => match self.ops[base] {
                Op::Entry(register) => Some((register, self.bits(offset)? as i32)),
                _ => None,
            },
            _ => None,
        }
    }

    pub(super) fn one(&mut self, name: &'static str, a: Node) -> Node {
        self.node(Op::One(name, a))
    }

    pub(super) fn two(&mut self, name: &'static str, a: Node, b: Node) -> Node {
        // Addition and multiplication commute, also in `Terms`, since all NaN are equal there.
        let (a, b) = match (name, self.bits(b)) {
            ("add" | "mul", _) => (a.min(b), a.max(b)),
            ("and", Some(mask)) => (self.below_mask(a, mask), b),
            _ => (a, b),
        };
        self.spread(a, b, CHOICES, &mut |graph, a, b| graph.node(Op::Two(name, a, b)))
    }

    /// Removes from a sum the multiples of a power of two above the mask; they do not change the masked bits.
    pub(super) fn below_mask(&self, a: Node, mask: u32) -> Node {
        let is_above = |part: Node| match self.ops[part] {
            Op::Plus(none, _, factor) => self.bits(none) == Some(0) && factor.is_power_of_two() && mask < factor,
            _ => false,
        };
        match self.ops[a] {
            Op::Plus(one, other, 1) if is_above(other) => self.below_mask(one, mask),
            Op::Plus(one, other, 1) if is_above(one) => self.below_mask(other, mask),
            _ => a,
        }
    }

    pub(super) fn neg(&mut self, a: Node) -> Node {
        self.one("neg", a)
    }

    pub(super) fn add(&mut self, a: Node, b: Node) -> Node {
        self.two("add", a, b)
    }

    pub(super) fn mul(&mut self, a: Node, b: Node) -> Node {
        self.two("mul", a, b)
    }

    pub(super) fn sub(&mut self, a: Node, b: Node) -> Node {
        let b = self.one("neg", b);
        self.two("add", a, b)
    }

    pub(super) fn plus(&mut self, a: Node, b: Node, factor: u32) -> Node {
        if factor == 0 || self.bits(b) == Some(0) {
            return a;
        }
        if self.bits(a) == Some(0) && factor == 1 {
            return b;
        }
        // Constants add up, so that equal addresses become equal nodes.
        if let (Some(more), Op::Plus(inner, before, 1)) = (self.bits(b), self.ops[a])
            && let Some(before) = self.bits(before)
        {
            let sum = self.constant(before.wrapping_add(more.wrapping_mul(factor)));
            return self.plus(inner, sum, 1);
        }
        self.spread(a, b, CHOICES, &mut |graph, a, b| graph.node(Op::Plus(a, b, factor)))
    }

    /// Propagates an operation with a constant into a selection between constants.
    fn spread(&mut self, a: Node, b: Node, deep: usize, of: &mut dyn FnMut(&mut Self, Node, Node) -> Node) -> Node {
        let chosen = |graph: &Self, node| match graph.ops[node] {
            Op::Select(t, x, y) if graph.is_choice_of_constants(node, deep) => Some((t, x, y)),
            _ => None,
        };
        match (chosen(self, a), self.bits(b), self.bits(a), chosen(self, b)) {
            (Some((t, x, y)), Some(_), ..) => {
                let (x, y) = (self.spread(x, b, deep - 1, of), self.spread(y, b, deep - 1, of));
                self.select(t, x, y)
            }
            (_, _, Some(_), Some((t, x, y))) => {
                let (x, y) = (self.spread(a, x, deep - 1, of), self.spread(a, y, deep - 1, of));
                self.select(t, x, y)
            }
            _ => of(self, a, b),
        }
    }

    /// Returns the bitwise complement, -1 - a.
    pub(super) fn others(&mut self, a: Node) -> Node {
        let all = self.constant(u32::MAX);
        self.plus(all, a, u32::MAX)
    }

    pub(super) fn low_half(&mut self, a: Node) -> Node {
        let mask = self.constant(0xffff);
        self.two("and", a, mask)
    }

    fn is_choice_of_constants(&self, node: Node, deep: usize) -> bool {
        match self.ops[node] {
            Op::Bits(_) => true,
            Op::Select(_, a, b) => {
                deep > 0 && self.is_choice_of_constants(a, deep - 1) && self.is_choice_of_constants(b, deep - 1)
            }
            _ => false,
        }
    }

    pub(super) fn shifted_left(&mut self, a: Node, by: u32) -> Node {
        let zero = self.constant(0);
        match 1_u32.checked_shl(by).unwrap_or(0) {
            0 => zero,
            1 => a,
            factor => self.plus(zero, a, factor),
        }
    }

    pub(super) fn shifted_right(&mut self, a: Node, by: u32) -> Node {
        if by == 0 { a } else { self.node(Op::ShiftedRight(a, by.min(31))) }
    }

    pub(super) fn low_bits(&mut self, a: Node, bits: u32) -> Node {
        self.node(Op::Signed(a, bits))
    }

    pub(super) fn not(&mut self, a: Node) -> Node {
        match self.ops[a] {
            Op::One("not", inner) => inner,
            Op::Compare(set, x, y) => self.node(Op::Compare(ANY & !set, x, y)),
            _ => self.node(Op::One("not", a)),
        }
    }

    pub(super) fn stands(&mut self, a: Node, set: u8, b: Node) -> Node {
        let may = self.may_stand(a, b);
        if may & set == 0 || may & !set == 0 {
            return self.truth(may & set != 0);
        }
        self.node(Op::Compare(set, a, b))
    }

    /// Returns the possible relations of two numbers in this case.
    fn may_stand(&self, a: Node, b: Node) -> u8 {
        let float = |node| self.bits(node).map(f32::from_bits).filter(|number| !number.is_nan());
        self.facts.get(&a).into_iter().flatten().fold(ANY, |may, &(other, set)| match (float(other), float(b)) {
            _ if other == b => may & set,
            (Some(known), Some(to)) => may & follows(set, known, to),
            _ => may,
        })
    }

    /// Assumes the value of a truth; nodes with the same operation become constants.
    pub(super) fn suppose(&mut self, t: Node, truth: bool) {
        if let Op::One("not", inner) = self.ops[t] {
            return self.suppose(inner, !truth);
        }
        self.supposed.push((t, truth));
        let known = self.truth(truth);
        self.known.insert(self.ops[t], known);
        if let Op::Compare(set, a, b) = self.ops[t] {
            let may = if truth { set } else { ANY & !set };
            for (a, b, may) in [(a, b, may), (b, a, turned(may))] {
                self.facts.entry(a).or_default().push((b, may));
            }
        }
    }

    pub(super) fn ordered(&mut self, order: Order, a: Node, b: Node) -> Node {
        if a == b {
            return self.truth(order == Order::Equal);
        }
        self.spread(a, b, CHOICES, &mut |graph, a, b| graph.node(Op::Ordered(order, a, b)))
    }

    pub(super) fn select(&mut self, t: Node, a: Node, b: Node) -> Node {
        if let Some(truth) = self.decided(t) {
            return if truth { a } else { b };
        }
        let (of, turned) = self.plain(t);
        let (t, a, b) = if turned { (of, b, a) } else { (t, a, b) };
        let (a, b) = (self.where_it_is(t, true, a), self.where_it_is(t, false, b));
        match (self.decided(a), self.decided(b)) {
            _ if a == b => a,
            (Some(true), Some(false)) => t,
            (Some(false), Some(true)) => self.not(t),
            _ => self.node(Op::Select(t, a, b)),
        }
    }

    /// Returns the normal form of a truth for selections, and whether it is the opposite.
    fn plain(&mut self, t: Node) -> (Node, bool) {
        match self.ops[t] {
            Op::One("not", inner) => (inner, true),
            Op::Compare(set, ..) if set & UNORDERED != 0 => (self.not(t), true),
            _ => (t, false),
        }
    }

    fn where_it_is(&self, t: Node, truth: bool, node: Node) -> Node {
        match self.ops[node] {
            Op::Select(of, a, b) if of == t => {
                if truth {
                    a
                } else {
                    b
                }
            }
            _ => node,
        }
    }

    /// Returns a value under the assumption that a truth holds.
    pub(super) fn where_it_holds(&mut self, t: Node, node: Node) -> Node {
        let (t, turned) = self.plain(t);
        self.where_it_is(t, !turned, node)
    }

    pub(super) fn and(&mut self, a: Node, b: Node) -> Node {
        let no = self.truth(false);
        self.select(a, b, no)
    }

    /// Returns the word that represents a truth at a place.
    pub(super) fn word_of(&mut self, port: &Port, truth: Node) -> Node {
        let [yes, no] = [true, false].map(|truth| self.constant(port.word_of(truth)));
        self.select(truth, yes, no)
    }

    /// Returns the representative of a value, and whether it is the opposite.
    pub(super) fn found(&self, mut node: Node) -> (Node, bool) {
        let mut turned = false;
        while self.joined[node].0 != node {
            turned ^= self.joined[node].1;
            node = self.joined[node].0;
        }
        (node, turned)
    }

    /// Joins two values that are equal, or opposite, for all inputs; `with` becomes the representative.
    pub(super) fn join(&mut self, node: Node, with: Node, opposite: bool) {
        let ((node, one), (with, other)) = (self.found(node), self.found(with));
        if node != with {
            self.joined[node] = (with, opposite ^ one ^ other);
        }
    }

    /// Computes the bits of an operation from the bits of its operands. All NaN are equal.
    pub(super) fn computed(op: Op, of: &dyn Fn(Node) -> u32) -> u32 {
        let float = |node| f32::from_bits(of(node));
        let number = |value: f32| if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() };
        match op {
            Op::Bits(bits) => bits,
            Op::Truth(truth) => truth.into(),
            // The caller provides the inputs.
            Op::Input(_) | Op::Given(_) | Op::Entry(_) => 0,
            Op::One("neg", a) => number(f32::from_bits(of(a) ^ MINUS_ZERO)),
            Op::One("abs", a) => number(float(a).abs()),
            Op::One("number_of", a) => (of(a) as i32 as f32).to_bits(),
            Op::One("number_without_sign_of", a) => (of(a) as f32).to_bits(),
            Op::One(_, a) => 1 - of(a),
            Op::Two("add", a, b) => number(float(a) + float(b)),
            Op::Two("mul", a, b) => number(float(a) * float(b)),
            Op::Two("div", a, b) => number(float(a) / float(b)),
            Op::Two("times", a, b) => of(a).wrapping_mul(of(b)),
            Op::Two("quotient", a, b) => (of(a) as i32)
                .checked_div(of(b) as i32)
                .map_or_else(|| if of(b) == 0 { 0 } else { of(a) }, |quotient| quotient as u32),
            Op::Two("and", a, b) => of(a) & of(b),
            Op::Two("orr", a, b) => of(a) | of(b),
            Op::Two("eor", a, b) => of(a) ^ of(b),
            Op::Two(_, a, b) => of(a).checked_shr(of(b)).unwrap_or(0),
            Op::Plus(a, b, factor) => of(a).wrapping_add(of(b).wrapping_mul(factor)),
            Op::ShiftedRight(a, by) => (of(a) as i32 >> by) as u32,
            Op::Signed(a, bits) => ((of(a) << (32 - bits)) as i32 >> (32 - bits)) as u32,
            Op::Compare(set, a, b) => (set & between(float(a), float(b)) != 0).into(),
            Op::Ordered(order, a, b) => match order {
                Order::Equal => of(a) == of(b),
                Order::Less => (of(a) as i32) < of(b) as i32,
                Order::Below => of(a) < of(b),
            }
            .into(),
            Op::Select(t, a, b) => {
                if of(t) != 0 {
                    of(a)
                } else {
                    of(b)
                }
            }
        }
    }
}

/// Value of an evaluated graph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value {
    Word(Term),
    Truth(bool),
}

/// Evaluation along one path. It evaluates only needed values: an unused comparison does not split the path.
pub(super) struct Run<'a> {
    pub(super) graph: &'a Graph,
    /// Cut values, which become arbitrary inputs.
    pub(super) cuts: &'a dyn Fn(Node) -> bool,
    pub(super) values: &'a mut Mixing<Node, Value>,
}

/// First input index of cut values, above the inputs of the graph.
const CUTS: usize = 1 << 20;

impl Run<'_> {
    pub(super) fn value(&mut self, node: Node, path: &mut Path<'_>) -> Option<Value> {
        let (node, turned) = self.graph.found(node);
        let value = if let Some(value) = self.values.get(&node) {
            *value
        } else {
            let value = self.computed(node, path)?;
            self.values.insert(node, value);
            value
        };
        Some(match value {
            Value::Truth(truth) => Value::Truth(truth != turned),
            word @ Value::Word(_) => word,
        })
    }

    fn word(&mut self, node: Node, path: &mut Path<'_>) -> Option<Term> {
        match self.value(node, path)? {
            Value::Word(term) => Some(term),
            Value::Truth(truth) => Some(path.terms.constant(truth.into())),
        }
    }

    fn truth(&mut self, node: Node, path: &mut Path<'_>) -> Option<bool> {
        match self.value(node, path)? {
            Value::Truth(truth) => Some(truth),
            Value::Word(_) => None,
        }
    }

    fn computed(&mut self, node: Node, path: &mut Path<'_>) -> Option<Value> {
        if (self.cuts)(node) {
            return Some(if self.graph.is_truth(node) {
                Value::Truth(path.truth(CUTS + node))
            } else {
                Value::Word(path.terms.input(CUTS + node))
            });
        }
        Some(Value::Word(match self.graph.ops[node] {
            Op::Bits(bits) => path.terms.constant(bits),
            Op::Truth(truth) => return Some(Value::Truth(truth)),
            Op::Input(input) => path.terms.input(input),
            Op::Given(input) => return Some(Value::Truth(path.truth(input))),
            Op::Entry(register) => path.terms.entry(register),
            Op::One("not", a) => return Some(Value::Truth(!self.truth(a, path)?)),
            Op::One(name, a) => {
                let a = self.word(a, path)?;
                match name {
                    "neg" => path.terms.neg(a),
                    "abs" => path.abs(a),
                    "number_of" => path.terms.number_of(a),
                    _ => path.number_without_sign_of(a)?,
                }
            }
            Op::Two(name, a, b) => {
                let (a, b) = (self.word(a, path)?, self.word(b, path)?);
                match name {
                    "add" => path.terms.add(a, b),
                    "mul" => path.terms.mul(a, b),
                    "div" => path.terms.div(a, b),
                    "times" => path.terms.times(a, b),
                    "quotient" => path.quotient(a, b),
                    name => path.bitwise(name, a, b),
                }
            }
            Op::Plus(a, b, factor) => {
                let (a, b) = (self.word(a, path)?, self.word(b, path)?);
                path.terms.plus(a, b, factor)
            }
            Op::ShiftedRight(a, by) => {
                let a = self.word(a, path)?;
                path.terms.shifted_right(a, by)
            }
            Op::Signed(a, bits) => {
                let a = self.word(a, path)?;
                path.terms.low_bits(a, bits)
            }
            Op::Compare(set, a, b) => {
                if let Op::One("abs", of) = self.graph.ops[self.graph.found(a).0]
                    && !(self.cuts)(self.graph.found(a).0)
                {
                    let (a, b) = (self.word(of, path)?, self.word(b, path)?);
                    if let Some(answer) = path.magnitude_stands(a, set, b) {
                        return Some(Value::Truth(answer));
                    }
                }
                let (a, b) = (self.word(a, path)?, self.word(b, path)?);
                return Some(Value::Truth(path.stands(a, set, b)));
            }
            Op::Ordered(order, a, b) => {
                let (a, b) = (self.word(a, path)?, self.word(b, path)?);
                return Some(Value::Truth(path.ordered(order, a, b)));
            }
            Op::Select(t, a, b) => {
                let taken = if self.truth(t, path)? { a } else { b };
                return self.value(taken, path);
            }
        }))
    }
}
