//! A function as a list of operations on numbers of one precision, and its semantics.
//!
//! # Semantics
//! * A [number](ValueKind::Number) is an IEEE 754 value, f32 or f64. The precision is chosen when the trace is run or
//!   written, and is equal for all numbers. Every arithmetic operation is *one* rounding to nearest, ties to even, with
//!   subnormal numbers, on any bit pattern. Nothing is fused, reassociated or simplified.
//! * A value that is not a number is *a* NaN; its sign and payload have no meaning. Every comparison with a NaN is
//!   false except [`Test::NotEqual`]. So `!(a <= b)` differs from `a > b`, and a trace keeps the form of the source.
//! * A constant is its f64 rounded to the precision.
//! * Operations have no other effect. They may be computed where their value is not used: [`Op::Select`] evaluates all
//!   of its operands and returns one of two.
//!
//! # Invariants
//! * An operand has a lower [`Id`] than the operation. It is an input, a constant, or is in an earlier [`Step`] of the
//!   same block or of a block that leads to it.
//! * No value occurs twice on a path from the first step to a [`Return`](End::Return). Two blocks of which only one is
//!   executed may both contain it.
//! * Every step is used by a later step, by a [`Branch`](End::Branch) or by a return.
//! * Every return has one value for each of the [`results`](Record::results), in that order.

use controller_core::{Count, Real};

/// Kind of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ValueKind {
    /// f32 or f64.
    Number,
    /// True or false.
    Truth,
    /// 32 bits of a wrapping counter.
    Count,
}

/// Source of an input, or destination of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// An entry of the sample, counted from 0.
    Sample(usize),
    /// A state word. As a result it is the new value of the word.
    State,
    /// An argument that is not part of the sample.
    Argument,
    /// A value between two parts of a tick: a result of one, an input of the other.
    Between,
    /// Part of the output.
    Output,
    /// An estimate in this row and column, both from 0.
    Estimate(usize, usize),
    /// A status flag, by its bit.
    Flag(u8),
    /// The return value of the function.
    Answer,
}

/// An input or a result.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Port {
    /// Name, without the name of the function.
    pub name: String,
    /// Source or destination.
    pub role: Role,
    /// Kind of the value.
    pub kind: ValueKind,
}

/// Identifier of a value of a [`Record`]: its index in [`Record::values`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Id(pub(crate) u32);

impl Id {
    /// Returns the index in [`Record::values`].
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A table with an entry for each of many values.
pub(crate) struct Table<T>(Vec<Option<T>>);

impl<T: Copy> Table<T> {
    pub(crate) const fn new() -> Self {
        Self(Vec::new())
    }

    pub(crate) fn get(&self, id: Id) -> Option<T> {
        self.0.get(id.index()).copied().flatten()
    }

    pub(crate) fn set(&mut self, id: Id, to: T) {
        if self.0.len() <= id.index() {
            self.0.resize(id.index() + 1, None);
        }
        self.0[id.index()] = Some(to);
    }
}

/// A comparison as in the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Test {
    /// `<`
    Less,
    /// `<=`
    LessOrEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterOrEqual,
    /// `==`
    Equal,
    /// `!=`: true for a NaN.
    NotEqual,
}

impl Test {
    /// Returns the result of the comparison for numbers of any precision.
    pub fn of<T: PartialOrd>(self, a: &T, b: &T) -> bool {
        match self {
            Self::Less => a < b,
            Self::LessOrEqual => a <= b,
            Self::Greater => a > b,
            Self::GreaterOrEqual => a >= b,
            Self::Equal => a == b,
            Self::NotEqual => a != b,
        }
    }
}

/// One operation of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Op {
    /// One of [`Record::inputs`], by its index.
    Input(usize),
    /// A number, rounded to the precision.
    Constant(f64),
    /// A constant truth value.
    Truth(bool),
    /// A constant count.
    CountOf(u32),
    /// Negation, including the sign of zero.
    Neg(Id),
    /// Absolute value.
    Abs(Id),
    /// Sum, rounded once.
    Add(Id, Id),
    /// Difference, first minus second, rounded once.
    Sub(Id, Id),
    /// Product, rounded once.
    Mul(Id, Id),
    /// Quotient, first by second, rounded once.
    Div(Id, Id),
    /// Comparison of two numbers.
    Compare(Test, Id, Id),
    /// Logical and.
    And(Id, Id),
    /// Logical or.
    Or(Id, Id),
    /// Logical not.
    Not(Id),
    /// The bits of the second value if the first holds, otherwise of the third; nothing is computed.
    Select(Id, Id, Id),
    /// Difference of two counts, first minus second, modulo 2^32.
    CountSince(Id, Id),
    /// Sum of two counts, modulo 2^32.
    CountPlus(Id, Id),
    /// The low bits of a count, 1..=32 of them, sign-extended (two's complement).
    CountSigned(Id, u32),
    /// Number of whole units (second, more than 0) in a signed count, times the third, modulo 2^32.
    CountWhole(Id, u32, u32),
    /// A signed count (two's complement) as a number, rounded once.
    NumberOf(Id),
}

impl Op {
    /// Returns the operands in order.
    pub fn operands(&self) -> impl Iterator<Item = Id> + use<> {
        let all = match *self {
            Self::Input(_) | Self::Constant(_) | Self::Truth(_) | Self::CountOf(_) => [None; 3],
            Self::Neg(a)
            | Self::Abs(a)
            | Self::Not(a)
            | Self::NumberOf(a)
            | Self::CountSigned(a, _)
            | Self::CountWhole(a, ..) => [Some(a), None, None],
            Self::Add(a, b)
            | Self::Sub(a, b)
            | Self::Mul(a, b)
            | Self::Div(a, b)
            | Self::Compare(_, a, b)
            | Self::And(a, b)
            | Self::Or(a, b)
            | Self::CountPlus(a, b)
            | Self::CountSince(a, b) => [Some(a), Some(b), None],
            Self::Select(a, b, c) => [Some(a), Some(b), Some(c)],
        };
        all.into_iter().flatten()
    }

    /// Returns the operation with other operands.
    #[must_use]
    pub fn map(&self, mut to: impl FnMut(Id) -> Id) -> Self {
        match *self {
            Self::Input(_) | Self::Constant(_) | Self::Truth(_) | Self::CountOf(_) => *self,
            Self::Neg(a) => Self::Neg(to(a)),
            Self::Abs(a) => Self::Abs(to(a)),
            Self::Not(a) => Self::Not(to(a)),
            Self::NumberOf(a) => Self::NumberOf(to(a)),
            Self::CountSigned(a, bits) => Self::CountSigned(to(a), bits),
            Self::CountWhole(a, of, each) => Self::CountWhole(to(a), of, each),
            Self::Add(a, b) => Self::Add(to(a), to(b)),
            Self::Sub(a, b) => Self::Sub(to(a), to(b)),
            Self::Mul(a, b) => Self::Mul(to(a), to(b)),
            Self::Div(a, b) => Self::Div(to(a), to(b)),
            Self::Compare(test, a, b) => Self::Compare(test, to(a), to(b)),
            Self::And(a, b) => Self::And(to(a), to(b)),
            Self::Or(a, b) => Self::Or(to(a), to(b)),
            Self::CountSince(a, b) => Self::CountSince(to(a), to(b)),
            Self::CountPlus(a, b) => Self::CountPlus(to(a), to(b)),
            Self::Select(a, b, c) => Self::Select(to(a), to(b), to(c)),
        }
    }
}

/// A value: its operation, and its name if it has one. Constants are identified by their names: two constants of one
/// number stay two. Names of steps may repeat, where a sum grows under one name.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// Operation that computes the value.
    pub op: Op,
    /// Name in the formulas: `e4`, `sigma_star`, `gamma2_1`.
    pub name: Option<String>,
}

/// One operation in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The computed value.
    pub value: Id,
    /// The group of equations; empty before the first.
    pub section: &'static str,
}

/// A sequence of steps and its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// The steps in an executable order, as in the source.
    pub steps: Vec<Step>,
    /// The end of the block.
    pub end: End,
}

/// The end of a block.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// The end of the function: a value for every result.
    Return(Vec<Id>),
    /// A choice of two blocks.
    Branch {
        /// The condition.
        condition: Id,
        /// The block if the condition holds.
        yes: Box<Block>,
        /// The block if it does not hold.
        no: Box<Block>,
    },
}

/// A function: inputs, operations, results. The module page defines its semantics.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Inputs, including the ones that no operation reads.
    pub inputs: Vec<Port>,
    /// Results.
    pub results: Vec<Port>,
    /// Every value, operands first.
    pub values: Vec<Value>,
    /// The operations in order, and the decisions.
    pub body: Block,
}

impl Block {
    fn each_end<'a>(&'a self, visit: &mut dyn FnMut(&'a End)) {
        visit(&self.end);
        if let End::Branch { yes, no, .. } = &self.end {
            yes.each_end(visit);
            no.each_end(visit);
        }
    }
}

/// A value during a run of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Word<T> {
    /// A number of the precision.
    Number(T),
    /// True or false.
    Truth(bool),
    /// A wrapping count.
    Count(i32),
}

impl<T: Real> Word<T> {
    /// Returns the number; NaN for another kind.
    pub fn number(self) -> T {
        match self {
            Self::Number(number) => number,
            _ => T::from_f64(f64::NAN),
        }
    }

    /// Returns the truth value; false for another kind.
    pub fn truth(self) -> bool {
        matches!(self, Self::Truth(true))
    }

    /// Returns the count; 0 for another kind.
    pub fn count(self) -> i32 {
        match self {
            Self::Count(count) => count,
            _ => 0,
        }
    }
}

impl Record {
    /// Returns the value of an id.
    pub fn value(&self, id: Id) -> &Value {
        &self.values[id.index()]
    }

    /// Returns the kind of a value.
    pub fn kind(&self, id: Id) -> ValueKind {
        match self.value(id).op {
            Op::Input(at) => self.inputs[at].kind,
            Op::Truth(_) | Op::Compare(..) | Op::And(..) | Op::Or(..) | Op::Not(_) => ValueKind::Truth,
            Op::CountOf(_) | Op::CountSince(..) | Op::CountPlus(..) | Op::CountSigned(..) | Op::CountWhole(..) => {
                ValueKind::Count
            }
            Op::Select(_, a, _) => self.kind(a),
            _ => ValueKind::Number,
        }
    }

    /// Returns a constant of the design by its name.
    pub fn constant(&self, name: &str) -> Option<f32> {
        self.values.iter().find_map(|value| match value.op {
            Op::Constant(number) if value.name.as_deref() == Some(name) => Some(number as f32),
            _ => None,
        })
    }

    /// Returns the index of this name in [`inputs`](Self::inputs).
    pub fn input(&self, name: &str) -> Option<usize> {
        self.inputs.iter().position(|port| port.name == name)
    }

    /// Returns whether another result depends on this state word.
    pub(crate) fn reads(&self, word: &Port) -> bool {
        let Some(at) = self.inputs.iter().position(|port| port == word) else { return false };
        let mut open = Vec::new();
        self.body.each_end(&mut |end| match end {
            End::Branch { condition, .. } => open.push(*condition),
            End::Return(results) => {
                let others = results.iter().zip(&self.results).filter(|(_, port)| *port != word);
                open.extend(others.map(|(id, _)| *id));
            }
        });
        let mut seen = vec![false; self.values.len()];
        while let Some(id) = open.pop() {
            if !std::mem::replace(&mut seen[id.index()], true) {
                open.extend(self.value(id).op.operands());
            }
        }
        self.values.iter().zip(seen).any(|(value, seen)| seen && value.op == Op::Input(at))
    }

    /// Runs the trace and returns the results for these inputs.
    ///
    /// # Panics
    /// If an input lacks a word of the right kind.
    pub fn run<T: Real<Count = i32>>(&self, inputs: &[Word<T>]) -> Vec<Word<T>> {
        assert_eq!(inputs.len(), self.inputs.len(), "a word for every input");
        let mut words: Vec<Option<Word<T>>> = vec![None; self.values.len()];
        for (k, value) in self.values.iter().enumerate() {
            words[k] = match value.op {
                Op::Input(at) => Some(inputs[at]),
                Op::Constant(number) => Some(Word::Number(T::from_f64(number))),
                Op::Truth(truth) => Some(Word::Truth(truth)),
                Op::CountOf(count) => Some(Word::Count(count as i32)),
                _ => None,
            };
        }
        let mut block = &self.body;
        loop {
            for step in &block.steps {
                words[step.value.index()] = Some(execute(self.value(step.value).op, &words));
            }
            let ready = |id: &Id| words[id.index()].expect("operands come first");
            match &block.end {
                End::Return(results) => return results.iter().map(ready).collect(),
                End::Branch { condition, yes, no } => block = if ready(condition).truth() { yes } else { no },
            }
        }
    }
}

fn execute<T: Real<Count = i32>>(op: Op, words: &[Option<Word<T>>]) -> Word<T> {
    let word = |id: Id| words[id.index()].expect("operands come first");
    let number = |id| match word(id) {
        Word::Number(number) => number,
        other => panic!("a number, not {other:?}"),
    };
    match op {
        Op::Input(_) | Op::Constant(_) | Op::Truth(_) | Op::CountOf(_) => panic!("{op:?} is no step"),
        Op::Neg(a) => Word::Number(-number(a)),
        Op::Abs(a) => Word::Number(number(a).abs()),
        Op::Add(a, b) => Word::Number(number(a) + number(b)),
        Op::Sub(a, b) => Word::Number(number(a) - number(b)),
        Op::Mul(a, b) => Word::Number(number(a) * number(b)),
        Op::Div(a, b) => Word::Number(number(a) / number(b)),
        Op::Compare(test, a, b) => Word::Truth(test.of(&number(a), &number(b))),
        Op::And(a, b) => Word::Truth(word(a).truth() && word(b).truth()),
        Op::Or(a, b) => Word::Truth(word(a).truth() || word(b).truth()),
        Op::Not(a) => Word::Truth(!word(a).truth()),
        Op::Select(condition, a, b) => word(if word(condition).truth() { a } else { b }),
        Op::CountSince(a, b) => Word::Count(word(a).count().since(word(b).count())),
        Op::CountPlus(a, b) => Word::Count(word(a).count().plus(word(b).count())),
        Op::CountSigned(a, bits) => Word::Count(word(a).count().signed(32 - bits)),
        Op::CountWhole(a, of, each) => Word::Count(word(a).count().whole(of as i32, each as i32)),
        Op::NumberOf(a) => Word::Number(T::from_count(word(a).count())),
    }
}
