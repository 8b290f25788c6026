//! A function as a list of operations on numbers of one precision, and what it means.
//!
//! # Meaning
//! * A [number](Kind::Number) is an IEEE 754 value, f32 or f64; which of them is said when the record is run or written
//!   out, and is the same for all numbers. Every arithmetic operation is *one* rounding to nearest, ties to even, with
//!   subnormal numbers, on any bit pattern. Nothing is fused, reassociated or simplified.
//! * What is not a number is *a* NaN: its sign and payload mean nothing. Every comparison with a NaN is false but
//!   [`Test::NotEqual`]. So `!(a <= b)` is not `a > b`, and a record keeps the one that was written.
//! * A constant is its f64 rounded to the precision.
//! * Operations have no other effect. They may be computed where their value is not used: [`Op::Select`] looks at all
//!   of its operands and takes one of two.
//!
//! # Invariants
//! * An operand has a lower [`Id`] than the operation, and is an input, a constant, or stands in an earlier
//!   [`Step`] of the same block or of one that leads to it.
//! * No value stands twice on a way from the first step to a [`Return`](End::Return); two blocks of which one only is
//!   executed may both have it.
//! * Every step is used by a later one, by a [`Branch`](End::Branch) or by a return.
//! * Every return has one value for each of the [`results`](Record::results), in that order.

use controller_core::{Count, Real};

/// What a value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// f32 or f64.
    Number,
    /// True or false.
    Truth,
    /// 32 bits of a counter that wraps.
    Count,
}

/// Where an input comes from, where a result goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Part of the sample, counted from 0.
    Sample(usize),
    /// A word of the state. As a result it is what the word becomes.
    State,
    /// An argument that is no sample.
    Argument,
    /// Handed by one part of a tick to the next: a result of the one, an input of the other.
    Between,
    /// Part of the output.
    Output,
    /// An estimate of this row and column, both from 0.
    Estimate(usize, usize),
    /// A flag of the health, by its bit.
    Flag(u8),
    /// What the function answers.
    Answer,
}

/// An input or a result.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Port {
    /// Its name, without the function's.
    pub name: String,
    /// Where it comes from or goes.
    pub role: Role,
    /// What it is.
    pub kind: Kind,
}

/// Names a value of a [`Record`]: its place in [`Record::values`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Id(pub(crate) u32);

impl Id {
    /// The place in [`Record::values`].
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// Something for each of many values.
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

/// A comparison, as it is written.
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
    /// The answer, for numbers of any precision.
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

/// One operation of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Op {
    /// One of [`Record::inputs`], by its place.
    Input(usize),
    /// This number, rounded to the precision.
    Constant(f64),
    /// Always true, or always false.
    Truth(bool),
    /// Always this count.
    CountOf(u32),
    /// The other sign, of a zero too.
    Neg(Id),
    /// Without its sign.
    Abs(Id),
    /// Sum, rounded once.
    Add(Id, Id),
    /// The first less the second, rounded once.
    Sub(Id, Id),
    /// Product, rounded once.
    Mul(Id, Id),
    /// The first by the second, rounded once.
    Div(Id, Id),
    /// Comparison of two numbers.
    Compare(Test, Id, Id),
    /// Are both true?
    And(Id, Id),
    /// One of them, or both.
    Or(Id, Id),
    /// Is it false?
    Not(Id),
    /// If the first holds the second, else the third: the bits, nothing is computed.
    Select(Id, Id, Id),
    /// The first less the second, modulo 2^32.
    CountSince(Id, Id),
    /// Sum of two counts, modulo 2^32.
    CountPlus(Id, Id),
    /// The low bits of a count, 1..=32 of them, with the highest of them in all bits above (two's complement).
    CountSigned(Id, u32),
    /// So many of the last as there are whole ones of the other (more than 0) in a count, with its sign, modulo 2^32.
    CountWhole(Id, u32, u32),
    /// A count as a number with a sign (two's complement), rounded once.
    NumberOf(Id),
}

impl Op {
    /// What it needs, in order.
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

    /// The same operation on other operands.
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

/// A value: what it is made by, and what it is called, if it has a name. Names of constants are their identity: two of
/// one number stay two. Names of steps may repeat, where a sum grows under one name.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// What makes it.
    pub op: Op,
    /// Its name in the formulas: `e4`, `sigma_star`, `gamma2_1`.
    pub name: Option<String>,
}

/// One operation in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// What is computed.
    pub value: Id,
    /// The group of equations it belongs to; empty before the first.
    pub section: &'static str,
}

/// Steps in a row, and what comes after.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// In an order that may be executed as it stands, which is that of the source.
    pub steps: Vec<Step>,
    /// What comes after.
    pub end: End,
}

/// What comes after the steps of a block.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// The end: a value for every result.
    Return(Vec<Id>),
    /// One of two blocks.
    Branch {
        /// The value that decides.
        condition: Id,
        /// Where it holds.
        yes: Box<Block>,
        /// Where it does not.
        no: Box<Block>,
    },
}

/// A function: inputs, operations, results. The page of this module says what it means.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// What comes in; those that no operation reads are named too.
    pub inputs: Vec<Port>,
    /// What goes out.
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

/// A value of a running record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Word<T> {
    /// A number of the precision.
    Number(T),
    /// True or false.
    Truth(bool),
    /// A count that wraps.
    Count(i32),
}

impl<T: Real> Word<T> {
    /// The number; NaN for what is none.
    pub fn number(self) -> T {
        match self {
            Self::Number(number) => number,
            _ => T::from_f64(f64::NAN),
        }
    }

    /// The truth; false for what is none.
    pub fn truth(self) -> bool {
        matches!(self, Self::Truth(true))
    }

    /// The count; 0 for what is none.
    pub fn count(self) -> i32 {
        match self {
            Self::Count(count) => count,
            _ => 0,
        }
    }
}

impl Record {
    /// The value of an id.
    pub fn value(&self, id: Id) -> &Value {
        &self.values[id.index()]
    }

    /// What a value is.
    pub fn kind(&self, id: Id) -> Kind {
        match self.value(id).op {
            Op::Input(at) => self.inputs[at].kind,
            Op::Truth(_) | Op::Compare(..) | Op::And(..) | Op::Or(..) | Op::Not(_) => Kind::Truth,
            Op::CountOf(_) | Op::CountSince(..) | Op::CountPlus(..) | Op::CountSigned(..) | Op::CountWhole(..) => {
                Kind::Count
            }
            Op::Select(_, a, _) => self.kind(a),
            _ => Kind::Number,
        }
    }

    /// A constant of the design, by its name.
    pub fn constant(&self, name: &str) -> Option<f32> {
        self.values.iter().find_map(|value| match value.op {
            Op::Constant(number) if value.name.as_deref() == Some(name) => Some(number as f32),
            _ => None,
        })
    }

    /// Where in [`inputs`](Self::inputs) this name is.
    pub fn input(&self, name: &str) -> Option<usize> {
        self.inputs.iter().position(|port| port.name == name)
    }

    /// Does anything but this word of the state itself depend on it?
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

    /// Executes it: the results for these inputs.
    ///
    /// # Panics
    /// If there is not one word of the right kind for every input.
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
