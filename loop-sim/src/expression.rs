//! Formulas in text form: the right-hand side of a plant or the a(x) of a controller, without Rust.
//!
//! ```text
//! sum     = product { ("+" | "-") product }          left to right
//! product = sign { ("*" | "/") sign }                left to right
//! sign    = ("+" | "-") sign | power                 -x^2 is -(x^2)
//! power   = atom [ "^" sign ]                        x^2^3 is x^(2^3)
//! atom    = number | name | name "(" sum { "," sum } ")" | "(" sum ")"
//! ```
//!
//! A name is an input (x1, x2, .., u, t), a constant, `pi`, or a function. The functions of one value are sin cos tan
//! asin acos atan sinh cosh tanh exp ln sqrt abs. The functions of two values are atan2 min max. Angles are in rad. An
//! undefined value (1/0, ln(-1)) is infinite or NaN, and nothing panics.
//!
//! Arithmetic is f64. Functions are from `libm`, except sin, cos and tanh, which are from this crate ([`sine`],
//! [`exponential`]). So the result has the same bits on every machine, alone and in a batch. Jumps (`sign`, `step`) are
//! excluded, because the solver must have their times. A step is a term of a [`Signal`](crate::signal::Signal), and
//! friction is smooth, `tanh(x2/0.01)`.
//!
//! A formula becomes a list of operations on a stack, at most [`MOST_OPERATIONS`] of them with [`MOST_PENDING`] pending
//! values. So no text can exhaust memory or the machine's stack. Evaluation costs some nanoseconds per operation.
//!
//! ```
//! use loop_sim::expression::Expression;
//!
//! let constants = [("g".to_owned(), 9.81), ("l".to_owned(), 0.5)].into();
//! let gravity = Expression::parse("-g/l*sin(x1)", &["x1", "x2"], &constants)?;
//! assert_eq!(gravity.value(&[0.0, 3.0]), 0.0);
//! assert!((gravity.slope(&[0.0, 3.0], 0) + 9.81 / 0.5).abs() < 1e-12);
//!
//! let told = Expression::parse("-g/l*sine(x1)", &["x1", "x2"], &constants).unwrap_err();
//! assert_eq!(told[0].to_string(), "at character 6: `sine` is not a function");
//! # Ok::<(), Vec<loop_sim::expression::ExpressionError>>(())
//! ```

use crate::{exponential, sine};
use core::f64::consts::PI;
use core::fmt;
use std::collections::BTreeMap;

/// Largest number of operations in one formula.
pub const MOST_OPERATIONS: usize = 1000;
/// Largest number of pending values at once. It also limits the nesting of parentheses and signs.
pub const MOST_PENDING: usize = 32;

/// Function of one value.
pub(crate) struct One {
    pub(crate) name: &'static str,
    pub(crate) of: fn(f64) -> f64,
    /// Derivative at x, where the function value is y.
    slope: fn(f64, f64) -> f64,
}

/// Function of two values, or an operator between them.
pub(crate) struct Two {
    pub(crate) name: &'static str,
    pub(crate) of: fn(f64, f64) -> f64,
    /// Both partial derivatives at (x, y), where the function value is z.
    slopes: fn(f64, f64, f64) -> [f64; 2],
}

const fn one(name: &'static str, of: fn(f64) -> f64, slope: fn(f64, f64) -> f64) -> One {
    One { name, of, slope }
}

const NEGATE: usize = 0;
/// The sign comes first: its name cannot be called.
pub(crate) static ONE: [One; 14] = [
    one("-", |x| -x, |_, _| -1.0),
    one("sin", sine::sin, |x, _| sine::cos(x)),
    one("cos", sine::cos, |x, _| -sine::sin(x)),
    one("tan", libm::tan, |_, y| 1.0 + y * y),
    one("asin", libm::asin, |x, _| 1.0 / libm::sqrt(1.0 - x * x)),
    one("acos", libm::acos, |x, _| -1.0 / libm::sqrt(1.0 - x * x)),
    one("atan", libm::atan, |x, _| 1.0 / (1.0 + x * x)),
    one("sinh", libm::sinh, |x, _| libm::cosh(x)),
    one("cosh", libm::cosh, |x, _| libm::sinh(x)),
    one("tanh", exponential::tanh, |_, y| 1.0 - y * y),
    one("exp", libm::exp, |_, y| y),
    one("ln", libm::log, |x, _| 1.0 / x),
    one("sqrt", libm::sqrt, |_, y| 0.5 / y),
    one("abs", f64::abs, |x, _| f64::from(i8::from(x > 0.0) - i8::from(x < 0.0))),
];

const fn two(name: &'static str, of: fn(f64, f64) -> f64, slopes: fn(f64, f64, f64) -> [f64; 2]) -> Two {
    Two { name, of, slopes }
}

const ADD: usize = 0;
const SUBTRACT: usize = 1;
const MULTIPLY: usize = 2;
const DIVIDE: usize = 3;
const POWER: usize = 4;
/// The operators come first: their names cannot be called.
pub(crate) static TWO: [Two; 8] = [
    two("+", |x, y| x + y, |_, _, _| [1.0, 1.0]),
    two("-", |x, y| x - y, |_, _, _| [1.0, -1.0]),
    two("*", |x, y| x * y, |x, y, _| [y, x]),
    two("/", |x, y| x / y, |_, y, z| [1.0 / y, -z / y]),
    two("^", libm::pow, |x, y, z| [y * libm::pow(x, y - 1.0), z * libm::log(x)]),
    two("atan2", libm::atan2, |y, x, _| [x / (x * x + y * y), -y / (x * x + y * y)]),
    two("min", |x, y| if y < x { y } else { x }, |x, y, _| if y < x { [0.0, 1.0] } else { [1.0, 0.0] }),
    two("max", |x, y| if y > x { y } else { x }, |x, y, _| if y > x { [0.0, 1.0] } else { [1.0, 0.0] }),
];

/// Applies the chain rule. A value that does not depend on the input has slope 0, even for an infinite outer slope.
fn chained(slope: f64, inner: f64) -> f64 {
    if inner == 0.0 { 0.0 } else { slope * inner }
}

/// Returns the names of the functions.
pub fn functions() -> impl Iterator<Item = &'static str> + Clone {
    ONE[NEGATE + 1..].iter().map(|one| one.name).chain(TWO[POWER + 1..].iter().map(|two| two.name))
}

/// Error in a formula, with its position.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpressionError {
    /// Position of the character in the text, from 1.
    pub at: usize,
    /// Fault at this position.
    pub fault: Fault,
}

/// Kind of fault at one position of a formula.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// Name that is neither an input nor a constant.
    UnknownName(String),
    /// Parentheses after a name that is not a function.
    UnknownFunction(String),
    /// Function without parentheses.
    NoArguments(&'static str),
    /// Function with a wrong number of arguments.
    Arity {
        /// Name of the function.
        function: &'static str,
        /// Number of arguments that the function takes.
        takes: usize,
        /// Number of arguments in the text.
        given: usize,
    },
    /// Number that f64 cannot hold.
    Number(String),
    /// Unexpected character.
    Expected {
        /// Expected token.
        what: &'static str,
        /// Character found, or `None` at the end.
        found: Option<char>,
    },
    /// More operations than [`MOST_OPERATIONS`].
    TooLong,
    /// Nesting deeper than [`MOST_PENDING`].
    TooDeep,
}

impl fmt::Display for ExpressionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at character {}: ", self.at)?;
        match &self.fault {
            Fault::UnknownName(name) => write!(f, "`{name}` is unknown"),
            Fault::UnknownFunction(name) => write!(f, "`{name}` is not a function"),
            Fault::NoArguments(function) => write!(f, "`{function}` is a function: write {function}(..)"),
            Fault::Arity { function, takes, given } => write!(f, "`{function}` takes {takes}, not {given} values"),
            Fault::Number(text) => write!(f, "{text} is not a number"),
            Fault::Expected { what, found: Some(found) } => write!(f, "expected {what}, found `{found}`"),
            Fault::Expected { what, found: None } => write!(f, "expected {what}, found the end"),
            Fault::TooLong => write!(f, "more than {MOST_OPERATIONS} operations: move a part into a constant"),
            Fault::TooDeep => write!(f, "nested deeper than {MOST_PENDING} levels"),
        }
    }
}

impl std::error::Error for ExpressionError {}

/// Operation on the values of the stack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Operation {
    /// Pushes a constant.
    Number(f64),
    /// Pushes the input with this index.
    Input(usize),
    /// Applies a function of one value, by its index in [`ONE`].
    One(usize),
    /// Applies a function of two values, by its index in [`TWO`].
    Two(usize),
}

/// Parsed formula.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression(Vec<Operation>);

/// Value with its partial derivatives by N inputs.
#[derive(Clone, Copy)]
struct Dual<const N: usize>(f64, [f64; N]);

impl Expression {
    /// Parses a formula. `inputs` are the names of the arguments of [`value`](Self::value), in that order.
    ///
    /// # Errors
    /// Returns every name that is unknown or wrongly used, and the first place where the text breaks the grammar of the
    /// module.
    pub fn parse(text: &str, inputs: &[&str], constants: &BTreeMap<String, f64>) -> Result<Self, Vec<ExpressionError>> {
        let text: Vec<char> = text.chars().collect();
        let mut reader = Reader {
            text: &text,
            at: 0,
            inputs,
            constants,
            code: Vec::new(),
            pending: 0,
            depth: 0,
            errors: Vec::new(),
        };
        let outcome = reader.whole();
        let Reader { code, mut errors, .. } = reader;
        errors.extend(outcome.err());
        if errors.is_empty() { Ok(Self(folded(code))) } else { Err(errors) }
    }

    /// Returns the formula of the dot product row . x, as if it were written out.
    pub fn linear(row: &[f64]) -> Self {
        let terms = row.iter().enumerate().flat_map(|(j, &factor)| {
            let sum = (j > 0).then_some(Operation::Two(ADD));
            [Operation::Number(factor), Operation::Input(j), Operation::Two(MULTIPLY)].into_iter().chain(sum)
        });
        Self(terms.collect())
    }

    /// Returns the formula of a constant.
    pub fn number(number: f64) -> Self {
        Self(vec![Operation::Number(number)])
    }

    /// Returns true if the formula depends on an input.
    pub fn varies(&self) -> bool {
        self.0.iter().any(|operation| matches!(operation, Operation::Input(_)))
    }

    /// Returns the operations of the formula.
    #[cfg(feature = "lanes")]
    pub(crate) fn operations(&self) -> &[Operation] {
        &self.0
    }

    /// Returns the value of the formula. Missing inputs count as 0.
    pub fn value(&self, inputs: &[f64]) -> f64 {
        let input = |input: usize| inputs.get(input).copied().unwrap_or(0.0);
        self.run(|number| number, input, |one, x| (one.of)(x), |two, x, y| (two.of)(x, y))
    }

    /// Returns the exact partial derivative by one input.
    pub fn slope(&self, inputs: &[f64], by: usize) -> f64 {
        let [slope] = self.slopes(inputs, by);
        slope
    }

    /// Returns the exact partial derivatives by N inputs, beginning with the input `from`.
    pub fn slopes<const N: usize>(&self, inputs: &[f64], from: usize) -> [f64; N] {
        let of = |slope: &dyn Fn(usize) -> f64| std::array::from_fn(slope);
        let Dual(_, slopes) = self.run(
            |number| Dual(number, [0.0; N]),
            |input| {
                let value = inputs.get(input).copied().unwrap_or(0.0);
                Dual(value, of(&|j| f64::from(u8::from(input == from + j))))
            },
            |one, Dual(x, dx)| {
                let y = (one.of)(x);
                let slope = (one.slope)(x, y);
                Dual(y, dx.map(|dx| chained(slope, dx)))
            },
            |two, Dual(x, dx), Dual(y, dy)| {
                let z = (two.of)(x, y);
                let [by_x, by_y] = (two.slopes)(x, y, z);
                Dual(z, of(&|j| chained(by_x, dx[j]) + chained(by_y, dy[j])))
            },
        );
        slopes
    }

    /// Runs all operations with the given value arithmetic.
    fn run<V: Copy>(
        &self,
        number: impl Fn(f64) -> V,
        input: impl Fn(usize) -> V,
        one: impl Fn(&One, V) -> V,
        two: impl Fn(&Two, V, V) -> V,
    ) -> V {
        let mut stack = [number(0.0); MOST_PENDING];
        // The parser has checked the depth: every operation finds its arguments, and the stack never overflows.
        let mut top = 0;
        for operation in &self.0 {
            let value = match *operation {
                Operation::Number(value) => number(value),
                Operation::Input(which) => input(which),
                Operation::One(which) => {
                    top -= 1;
                    one(&ONE[which], stack[top])
                }
                Operation::Two(which) => {
                    top -= 2;
                    two(&TWO[which], stack[top], stack[top + 1])
                }
            };
            stack[top] = value;
            top += 1;
        }
        stack[0]
    }
}

/// Returns the operations with constant subexpressions folded.
fn folded(code: Vec<Operation>) -> Vec<Operation> {
    let mut folded: Vec<Operation> = Vec::with_capacity(code.len());
    for operation in code {
        let known = match (operation, &folded[..]) {
            (Operation::One(which), [.., Operation::Number(x)]) => Some((1, (ONE[which].of)(*x))),
            (Operation::Two(which), [.., Operation::Number(x), Operation::Number(y)]) => {
                Some((2, (TWO[which].of)(*x, *y)))
            }
            _ => None,
        };
        if let Some((taken, value)) = known {
            folded.truncate(folded.len() - taken);
            folded.push(Operation::Number(value));
        } else {
            folded.push(operation);
        }
    }
    folded
}

/// Returns a text as a message quotes it.
fn quoted(text: &str) -> String {
    const LONGEST: usize = 30;
    if text.len() <= LONGEST { text.into() } else { text.chars().take(LONGEST).chain("..".chars()).collect() }
}

/// Recursive-descent parser with one function for each line of the grammar.
struct Reader<'a> {
    text: &'a [char],
    /// Position of the next character.
    at: usize,
    inputs: &'a [&'a str],
    constants: &'a BTreeMap<String, f64>,
    code: Vec<Operation>,
    /// Number of values that are pending at this point.
    pending: usize,
    depth: usize,
    /// Errors of names. Parsing goes on after them.
    errors: Vec<ExpressionError>,
}

type Read = Result<(), ExpressionError>;

const fn is_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

impl Reader<'_> {
    fn whole(&mut self) -> Read {
        self.sum()?;
        match self.next() {
            None => Ok(()),
            Some(_) => self.expected("an operator or the end"),
        }
    }

    fn sum(&mut self) -> Read {
        self.product()?;
        while let Some(operator) = self.either(['+', '-'], [ADD, SUBTRACT]) {
            self.product()?;
            self.emit(Operation::Two(operator))?;
        }
        Ok(())
    }

    fn product(&mut self) -> Read {
        self.sign()?;
        while let Some(operator) = self.either(['*', '/'], [MULTIPLY, DIVIDE]) {
            self.sign()?;
            self.emit(Operation::Two(operator))?;
        }
        Ok(())
    }

    /// Every deeper nesting passes through here.
    fn sign(&mut self) -> Read {
        self.depth += 1;
        if self.depth > MOST_PENDING {
            return error(self.at, Fault::TooDeep);
        }
        if self.take('-') {
            self.sign()?;
            self.emit(Operation::One(NEGATE))?;
        } else if self.take('+') {
            self.sign()?;
        } else {
            self.power()?;
        }
        self.depth -= 1;
        Ok(())
    }

    fn power(&mut self) -> Read {
        self.atom()?;
        if self.take('^') {
            self.sign()?;
            self.emit(Operation::Two(POWER))?;
        }
        Ok(())
    }

    fn atom(&mut self) -> Read {
        match self.next() {
            Some('(') => {
                self.at += 1;
                self.sum()?;
                if self.take(')') { Ok(()) } else { self.expected("`)`") }
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if is_name(c) => self.name(),
            _ => self.expected("a value"),
        }
    }

    fn number(&mut self) -> Read {
        let from = self.at;
        let mut is_exponent = false;
        while let Some(&c) = self.text.get(self.at)
            && (is_name(c) || c == '.' || (is_exponent && matches!(c, '+' | '-')))
        {
            is_exponent = matches!(c, 'e' | 'E');
            self.at += 1;
        }
        let text: String = self.text[from..self.at].iter().collect();
        match text.parse() {
            Ok(number) if f64::is_finite(number) => self.emit(Operation::Number(number)),
            _ => error(from, Fault::Number(quoted(&text))),
        }
    }

    fn name(&mut self) -> Read {
        let from = self.at;
        while self.text.get(self.at).is_some_and(|&c| is_name(c)) {
            self.at += 1;
        }
        let name: String = self.text[from..self.at].iter().collect();
        let one = ONE[NEGATE + 1..].iter().position(|one| one.name == name).map(|k| k + NEGATE + 1);
        let two = TWO[POWER + 1..].iter().position(|two| two.name == name).map(|k| k + POWER + 1);
        let called = match (one, two) {
            (Some(one), _) => Some((ONE[one].name, 1, Operation::One(one))),
            (None, Some(two)) => Some((TWO[two].name, 2, Operation::Two(two))),
            (None, None) => None,
        };
        let before = self.pending;
        let given = if self.take('(') { Some(self.values()?) } else { None };
        let input = self.inputs.iter().position(|input| **input == name).map(Operation::Input);
        let constant = || if name == "pi" { Some(PI) } else { self.constants.get(&name).copied() };
        let fault = match (called, given) {
            (Some((_, takes, operation)), Some(given)) if takes == given => return self.emit(operation),
            (Some((function, takes, _)), Some(given)) => Fault::Arity { function, takes, given },
            (Some((function, ..)), None) => Fault::NoArguments(function),
            (None, Some(_)) => Fault::UnknownFunction(quoted(&name)),
            (None, None) => match input.or_else(|| constant().map(Operation::Number)) {
                Some(known) => return self.emit(known),
                None => Fault::UnknownName(quoted(&name)),
            },
        };
        // Parsing goes on as if a value stood here.
        self.pending = before;
        self.errors.push(ExpressionError { at: from + 1, fault });
        self.emit(Operation::Number(0.0))
    }

    /// Parses arguments up to the closing parenthesis and returns their number.
    fn values(&mut self) -> Result<usize, ExpressionError> {
        if self.take(')') {
            return Ok(0);
        }
        let mut given = 0;
        loop {
            self.sum()?;
            given += 1;
            if self.take(')') {
                return Ok(given);
            }
            if !self.take(',') {
                return self.expected("`,` or `)`");
            }
        }
    }

    /// Returns the next character that is not white space.
    fn next(&mut self) -> Option<char> {
        while self.text.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
        self.text.get(self.at).copied()
    }

    fn take(&mut self, wanted: char) -> bool {
        let is_there = self.next() == Some(wanted);
        self.at += usize::from(is_there);
        is_there
    }

    fn either(&mut self, signs: [char; 2], operators: [usize; 2]) -> Option<usize> {
        let which = signs.into_iter().position(|sign| self.take(sign))?;
        Some(operators[which])
    }

    fn emit(&mut self, operation: Operation) -> Read {
        if self.code.len() == MOST_OPERATIONS {
            return error(self.at, Fault::TooLong);
        }
        match operation {
            Operation::Number(_) | Operation::Input(_) => self.pending += 1,
            Operation::One(_) => {}
            Operation::Two(_) => self.pending -= 1,
        }
        if self.pending > MOST_PENDING {
            return error(self.at, Fault::TooDeep);
        }
        self.code.push(operation);
        Ok(())
    }

    fn expected<R>(&mut self, what: &'static str) -> Result<R, ExpressionError> {
        let found = self.next();
        error(self.at, Fault::Expected { what, found })
    }
}

fn error<R>(at: usize, fault: Fault) -> Result<R, ExpressionError> {
    Err(ExpressionError { at: at + 1, fault })
}

#[cfg(test)]
mod tests;
