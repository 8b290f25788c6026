//! The recording scalar, and the runs from which a trace is made.
//!
//! A [`Symbol`] is a number without a value: an operation on it is recorded. Only a comparison needs an answer at once.
//! The function is therefore run once for every possible sequence of answers; the first run answers "true" to all.
//! [`merge`](crate::merge) makes one trace of the recorded runs.
//!
//! Every event stores its source line. One line in two runs is one statement, even if its operands differ. The runs are
//! aligned by these lines.

use std::cell::RefCell;
use std::cmp::Ordering;
use std::collections::HashMap;
use std::fmt;
use std::hash::{BuildHasherDefault, Hasher};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use std::panic::Location;

use controller_core::{Count, Real, Sealed};

use crate::merge;
use crate::record::{Id, Op, Port, Record, Role, Table, Test, Value, ValueKind};

/// A number of a tick during recording. It is valid inside [`record`] only.
#[derive(Clone, Copy, Debug, Default)]
pub struct Symbol(pub(crate) Id);

/// A count of a tick during recording.
#[derive(Clone, Copy, Debug)]
pub struct CountSymbol(pub(crate) Id);

/// Two counts are equal if their difference is 0 as a number; no rounding makes another count 0.
impl PartialEq for CountSymbol {
    #[track_caller]
    fn eq(&self, other: &Self) -> bool {
        let at = Location::caller();
        let difference = compute(Op::CountSince(self.0, other.0), at);
        compare(Test::Equal, compute(Op::NumberOf(difference), at), ZERO, at)
    }
    #[track_caller]
    #[allow(clippy::partialeq_ne_impl)] // `a != b` is an operation of its own.
    fn ne(&self, other: &Self) -> bool {
        let at = Location::caller();
        let difference = compute(Op::CountSince(self.0, other.0), at);
        compare(Test::NotEqual, compute(Op::NumberOf(difference), at), ZERO, at)
    }
}

/// The constants that need no recorder.
pub(crate) const ZERO: Id = Id(0);
pub(crate) const HALF: Id = Id(1);

/// An event of one run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum What {
    /// A value is computed.
    Compute(Id),
    /// A value gets a name. A name from the source has priority over a name that a sum inherits from its first part.
    Name { value: Id, name: usize, given: bool },
    /// A comparison, or a truth input, is answered.
    Decide { condition: Id, answer: bool },
}

/// An event with its source location, its channel and its equation group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Event {
    pub(crate) what: What,
    pub(crate) at: &'static Location<'static>,
    pub(crate) channel: usize,
    pub(crate) section: &'static str,
}

/// Every value of every run, each once: one operation on the same operands is one value.
#[derive(Default)]
pub(crate) struct Graph {
    pub(crate) values: Vec<Value>,
    pub(crate) inputs: Vec<Port>,
    pub(crate) names: Vec<String>,
    known: HashMap<Key, Id, BuildHasherDefault<Mixed>>,
}

/// A multiply-and-rotate hash. The hash of the standard library resists attacks and takes a third of a recording.
#[derive(Default)]
struct Mixed(u64);

impl Hasher for Mixed {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }
    fn write_u32(&mut self, number: u32) {
        self.write_u64(u64::from(number));
    }
    fn write_u64(&mut self, number: u64) {
        self.0 = (self.0.rotate_left(5) ^ number).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    fn write_isize(&mut self, number: isize) {
        self.write_u64(number as u64);
    }
    fn write_usize(&mut self, number: usize) {
        self.write_u64(number as u64);
    }
}

/// Key of a value; for a constant its name and its bits.
#[derive(PartialEq, Eq, Hash)]
enum Key {
    Constant(Option<String>, u64),
    Other(std::mem::Discriminant<Op>, u64, [Option<Id>; 3]),
}

impl Graph {
    pub(crate) fn op(&self, id: Id) -> Op {
        self.values[id.index()].op
    }

    pub(crate) fn value(&mut self, op: Op) -> Id {
        self.named(op, None)
    }

    fn named(&mut self, op: Op, name: Option<String>) -> Id {
        let own = match op {
            Op::Constant(number) => number.to_bits(),
            Op::Input(at) => at as u64,
            Op::Truth(truth) => u64::from(truth),
            Op::CountOf(count) => u64::from(count),
            Op::CountSigned(_, bits) => u64::from(bits),
            Op::CountWhole(_, of, each) => u64::from(of) << 32 | u64::from(each),
            Op::Compare(test, ..) => test as u64,
            _ => 0,
        };
        let mut operands = op.operands();
        let key = if let Op::Constant(_) = op {
            Key::Constant(name.clone(), own)
        } else {
            Key::Other(std::mem::discriminant(&op), own, [operands.next(), operands.next(), operands.next()])
        };
        let next = Id(self.values.len() as u32);
        let values = &mut self.values;
        *self.known.entry(key).or_insert_with(|| {
            values.push(Value { op, name });
            next
        })
    }

    fn input(&mut self, port: Port) -> Id {
        let at = self.inputs.iter().position(|known| *known == port).unwrap_or_else(|| {
            assert!(self.inputs.iter().all(|known| known.name != port.name), "two inputs `{}`", port.name);
            self.inputs.push(port.clone());
            self.inputs.len() - 1
        });
        self.named(Op::Input(at), Some(port.name))
    }

    fn name(&mut self, name: String) -> usize {
        self.names.iter().position(|known| *known == name).unwrap_or_else(|| {
            self.names.push(name);
            self.names.len() - 1
        })
    }

    /// Returns the number, if it is equal in f32 and f64 except for its rounding.
    fn constant(&self, id: Id) -> Option<f64> {
        match self.op(id) {
            Op::Constant(number) => Some(number),
            Op::Neg(a) => self.constant(a).map(|number| -number),
            Op::Abs(a) => self.constant(a).map(f64::abs),
            _ => None,
        }
    }

    /// Returns the answer of a comparison of two constants, if it is equal in f32 and f64.
    fn certain(&self, test: Test, a: Id, b: Id) -> Option<bool> {
        let (a, b) = (self.constant(a)?, self.constant(b)?);
        let answer = test.of(&a, &b);
        (answer == test.of(&(a as f32), &(b as f32))).then_some(answer)
    }
}

/// A run in progress.
struct Run {
    graph: Graph,
    /// Answers to the first decisions; later answers are true.
    script: Vec<bool>,
    decisions: usize,
    answers: Table<bool>,
    events: Vec<Event>,
    /// Names given in this run.
    names: Table<usize>,
    /// Sums made by `+=` and `-=`, with their first part.
    grown: Table<Id>,
    section: &'static str,
    channel: usize,
    results: Vec<(Port, Id)>,
    /// Above zero nothing is recorded and every comparison is true.
    silent: usize,
}

impl Run {
    fn event(&mut self, what: What, at: &'static Location<'static>) {
        self.events.push(Event { what, at, channel: self.channel, section: self.section });
    }

    fn compute(&mut self, op: Op, at: &'static Location<'static>) -> Id {
        if self.silent > 0 {
            return ZERO;
        }
        let id = self.graph.value(op);
        self.event(What::Compute(id), at);
        id
    }

    fn decide(&mut self, condition: Id, at: &'static Location<'static>) -> bool {
        if self.silent > 0 {
            return true;
        }
        if let Some(answer) = self.answers.get(condition) {
            return answer;
        }
        let answer = self.script.get(self.decisions).copied().unwrap_or(true);
        self.decisions += 1;
        self.answers.set(condition, answer);
        self.event(What::Decide { condition, answer }, at);
        answer
    }

    fn compare(&mut self, test: Test, a: Id, b: Id, at: &'static Location<'static>) -> bool {
        if self.silent > 0 {
            return true;
        }
        if let Some(answer) = self.graph.certain(test, a, b) {
            return answer;
        }
        let condition = self.compute(Op::Compare(test, a, b), at);
        self.decide(condition, at)
    }

    /// Returns the name that an operation inherits: the name of a value in this run, or of a state word.
    fn name_of(&self, id: Id) -> Option<String> {
        match self.graph.op(id) {
            Op::Input(at) if self.graph.inputs[at].role == Role::State => Some(self.graph.inputs[at].name.clone()),
            _ => self.names.get(id).map(|name| self.graph.names[name].clone()),
        }
    }

    fn give(&mut self, value: Id, name: usize, given: bool, at: &'static Location<'static>) {
        self.names.set(value, name);
        self.event(What::Name { value, name, given }, at);
    }

    fn grow(&mut self, op: Op, from: Id, at: &'static Location<'static>) -> Id {
        let id = self.compute(op, at);
        if self.silent == 0 {
            self.grown.set(id, from);
            if let Some(name) = self.name_of(from) {
                let name = self.graph.name(name);
                self.give(id, name, false, at);
            }
        }
        id
    }

    /// Gives a value its name. An existing name is kept. The event is still recorded, since in another run the value
    /// may have no name.
    fn called(&mut self, id: Id, name: String, at: &'static Location<'static>) {
        if self.silent > 0 {
            return;
        }
        let name = self.graph.name(name);
        self.give(id, name, true, at);
        // The sums it has grown from, if they have no name of their own.
        let mut last = id;
        while let Some(before) = self.grown.get(last) {
            let given = matches!(self.graph.op(before), Op::Input(_) | Op::Constant(_));
            if given || self.names.get(before).is_some() {
                break;
            }
            self.give(before, name, false, at);
            last = before;
        }
    }
}

thread_local!(static RUN: RefCell<Option<Run>> = const { RefCell::new(None) });

fn with<R>(f: impl FnOnce(&mut Run) -> R) -> R {
    RUN.with_borrow_mut(|run| f(run.as_mut().expect("a Symbol lives inside tick_record::record only")))
}

// Not inlined: a law is instantiated for many configurations, and recording need not be fast.

#[inline(never)]
fn compute(op: Op, at: &'static Location<'static>) -> Id {
    with(|run| run.compute(op, at))
}

#[inline(never)]
fn grow(op: Op, from: Id, at: &'static Location<'static>) -> Id {
    with(|run| run.grow(op, from, at))
}

#[inline(never)]
fn compare(test: Test, a: Id, b: Id, at: &'static Location<'static>) -> bool {
    with(|run| run.compare(test, a, b, at))
}

#[inline(never)]
fn called(id: Id, name: &'static str, channel: usize, at: &'static Location<'static>) {
    let name = if channel == 0 { name.into() } else { format!("{name}{channel}") };
    with(|run| run.called(id, name, at));
}

#[inline(never)]
fn constant(number: f64) -> Id {
    with(|run| run.graph.value(Op::Constant(number)))
}

/// Ends the recording of this thread, also when the recorded function panics.
struct Ended;

impl Drop for Ended {
    fn drop(&mut self) {
        RUN.with_borrow_mut(|run| *run = None);
    }
}

/// Inputs and results of the function during recording.
pub struct Recorder(());

impl Recorder {
    /// Returns the recorder of the recording in this thread.
    pub(crate) fn of_this_thread() -> Self {
        Self(())
    }

    /// Returns a number as an input.
    pub fn number(&self, name: &str, role: Role) -> Symbol {
        Symbol(input(name, role, ValueKind::Number))
    }

    /// Returns a count as an input.
    pub fn count(&self, name: &str, role: Role) -> CountSymbol {
        CountSymbol(input(name, role, ValueKind::Count))
    }

    /// Returns a truth value as an input: a decision.
    #[track_caller]
    pub fn truth(&self, name: &str, role: Role) -> bool {
        let (id, at) = (input(name, role, ValueKind::Truth), Location::caller());
        with(|run| run.decide(id, at))
    }

    /// Returns a known number with its name.
    pub fn constant(&self, name: &str, number: f64) -> Symbol {
        Symbol(with(|run| run.graph.named(Op::Constant(number), Some(name.into()))))
    }

    /// Returns a known count.
    pub fn count_of(&self, count: u32) -> CountSymbol {
        CountSymbol(with(|run| run.graph.value(Op::CountOf(count))))
    }

    /// Runs code that is not part of the function: operations are not recorded and return 0, and every comparison is
    /// true.
    pub fn silently<R>(&self, f: impl FnOnce() -> R) -> R {
        with(|run| run.silent += 1);
        let result = f();
        with(|run| run.silent -= 1);
        result
    }

    /// Adds a number to the results.
    pub fn put(&self, name: &str, role: Role, number: Symbol) {
        with(|run| run.results.push((port(name, role, ValueKind::Number), number.0)));
    }

    /// Adds a count to the results.
    pub fn put_count(&self, name: &str, role: Role, count: CountSymbol) {
        with(|run| run.results.push((port(name, role, ValueKind::Count), count.0)));
    }

    /// Adds a truth value to the results.
    pub fn put_truth(&self, name: &str, role: Role, truth: bool) {
        with(|run| {
            let id = run.graph.value(Op::Truth(truth));
            run.results.push((port(name, role, ValueKind::Truth), id));
        });
    }
}

pub(crate) fn port(name: &str, role: Role, kind: ValueKind) -> Port {
    Port { name: name.into(), role, kind }
}

fn input(name: &str, role: Role, kind: ValueKind) -> Id {
    with(|run| run.graph.input(port(name, role, kind)))
}

/// Maximum number of paths through a function; no tick has more.
const WAYS: usize = 1 << 16;

/// Records a function: `f` takes its inputs from the recorder, computes with them, and writes its results there. It is
/// run once per path, and must be deterministic for equal answers.
///
/// # Panics
/// If `f` is not deterministic, if it has more than 65 536 paths, or if recordings are nested.
pub fn record(mut f: impl FnMut(&Recorder)) -> Record {
    every_way(&mut f)
}

pub(crate) fn every_way(f: &mut dyn FnMut(&Recorder)) -> Record {
    assert!(RUN.with_borrow(Option::is_none), "a recording is under way in this thread");
    let _ended = Ended;
    let mut graph = Graph::default();
    assert_eq!((graph.value(Op::Constant(0.0)), graph.value(Op::Constant(0.5))), (ZERO, HALF));
    let (mut ways, mut script) = (Vec::new(), Vec::new());
    loop {
        let run = Run {
            graph,
            script,
            decisions: 0,
            answers: Table::new(),
            events: Vec::new(),
            names: Table::new(),
            grown: Table::new(),
            section: "",
            channel: 0,
            results: Vec::new(),
            silent: 0,
        };
        RUN.with_borrow_mut(|slot| *slot = Some(run));
        f(&Recorder(()));
        let run = RUN.with_borrow_mut(Option::take).expect("the run that was put there");
        graph = run.graph;
        let answer = |event: &Event| match event.what {
            What::Decide { answer, .. } => Some(answer),
            _ => None,
        };
        script = run.events.iter().filter_map(answer).collect();
        ways.push((run.events, run.results));
        assert!(ways.len() <= WAYS, "more than {WAYS} ways through the function");
        // The next path: the last "true" becomes "false".
        while script.pop_if(|answer| !*answer).is_some() {}
        match script.last_mut() {
            Some(last) => *last = false,
            None => return merge::record(graph, &ways),
        }
    }
}

macro_rules! operator {
    ($($operator:ident $method:ident $assign:ident $assign_method:ident;)*) => {$(
        impl $assign for Symbol {
            #[track_caller]
            fn $assign_method(&mut self, other: Self) {
                let at = Location::caller();
                self.0 = grow(Op::$operator(self.0, other.0), self.0, at);
            }
        }
    )*};
    ($($operator:ident $method:ident;)*) => {$(
        impl $operator for Symbol {
            type Output = Self;
            #[track_caller]
            fn $method(self, other: Self) -> Self {
                let at = Location::caller();
                Self(compute(Op::$operator(self.0, other.0), at))
            }
        }
    )*};
}
operator! { Add add; Sub sub; Mul mul; Div div; }
operator! { Add add AddAssign add_assign; Sub sub SubAssign sub_assign; }

impl Neg for Symbol {
    type Output = Self;
    #[track_caller]
    fn neg(self) -> Self {
        let at = Location::caller();
        Self(compute(Op::Neg(self.0), at))
    }
}

impl PartialEq for Symbol {
    #[track_caller]
    fn eq(&self, other: &Self) -> bool {
        let at = Location::caller();
        compare(Test::Equal, self.0, other.0, at)
    }
    #[track_caller]
    #[allow(clippy::partialeq_ne_impl)] // `a != b` is an operation of its own.
    fn ne(&self, other: &Self) -> bool {
        let at = Location::caller();
        compare(Test::NotEqual, self.0, other.0, at)
    }
}

impl PartialOrd for Symbol {
    #[track_caller]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        if self < other {
            Some(Ordering::Less)
        } else if self == other {
            Some(Ordering::Equal)
        } else if self > other {
            Some(Ordering::Greater)
        } else {
            None
        }
    }
    #[track_caller]
    fn lt(&self, other: &Self) -> bool {
        let at = Location::caller();
        compare(Test::Less, self.0, other.0, at)
    }
    #[track_caller]
    fn le(&self, other: &Self) -> bool {
        let at = Location::caller();
        compare(Test::LessOrEqual, self.0, other.0, at)
    }
    #[track_caller]
    fn gt(&self, other: &Self) -> bool {
        let at = Location::caller();
        compare(Test::Greater, self.0, other.0, at)
    }
    #[track_caller]
    fn ge(&self, other: &Self) -> bool {
        let at = Location::caller();
        compare(Test::GreaterOrEqual, self.0, other.0, at)
    }
}

impl fmt::Display for Symbol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "v{}", self.0.index())
    }
}

/// Marks the words of a [`Symbol`] and of a [`CountSymbol`] in a state; all other words are 0 or 1.
const NUMBER: u32 = 0x8000_0000;
const COUNT: u32 = 0x4000_0000;

/// Kind of a word of a recorded state.
pub(crate) enum StateWord {
    Number(Symbol),
    Count(CountSymbol),
    Truth(bool),
}

impl StateWord {
    pub(crate) fn kind(&self) -> ValueKind {
        match self {
            Self::Number(_) => ValueKind::Number,
            Self::Count(_) => ValueKind::Count,
            Self::Truth(_) => ValueKind::Truth,
        }
    }

    pub(crate) fn of(word: u32) -> Self {
        match word {
            0 | 1 => Self::Truth(word == 1),
            _ if word & NUMBER != 0 => Self::Number(Symbol(Id(word & !NUMBER))),
            _ if word & COUNT != 0 => Self::Count(CountSymbol(Id(word & !COUNT))),
            _ => panic!("a word of a recorded state is a number, a count, 0 or 1, not {word}"),
        }
    }

    pub(crate) fn to_word(&self) -> u32 {
        match self {
            Self::Number(number) => number.0.0 | NUMBER,
            Self::Count(count) => count.0.0 | COUNT,
            Self::Truth(truth) => u32::from(*truth),
        }
    }
}

impl Count for CountSymbol {
    fn of(count: i32) -> Self {
        Self(with(|run| run.graph.value(Op::CountOf(count as u32))))
    }
    #[track_caller]
    fn since(self, earlier: Self) -> Self {
        let at = Location::caller();
        Self(compute(Op::CountSince(self.0, earlier.0), at))
    }
    #[track_caller]
    fn plus(self, moved: Self) -> Self {
        let at = Location::caller();
        Self(compute(Op::CountPlus(self.0, moved.0), at))
    }
    #[track_caller]
    fn signed(self, unread: u32) -> Self {
        let at = Location::caller();
        Self(compute(Op::CountSigned(self.0, 32 - unread), at))
    }
    #[track_caller]
    fn whole(self, of: i32, each: i32) -> Self {
        let at = Location::caller();
        Self(compute(Op::CountWhole(self.0, of as u32, each as u32), at))
    }
    fn to_word(self) -> u32 {
        StateWord::Count(self).to_word()
    }
    fn from_word(word: u32) -> Self {
        Self(Id(word & !COUNT))
    }
}

impl Sealed for Symbol {
    type Count = CountSymbol;

    #[track_caller]
    fn from_count(count: CountSymbol) -> Self {
        let at = Location::caller();
        Self(compute(Op::NumberOf(count.0), at))
    }

    #[track_caller]
    fn called(self, name: &'static str, channel: usize) -> Self {
        let at = Location::caller();
        called(self.0, name, channel, at);
        self
    }

    fn channel(channel: usize) {
        with(|run| run.channel = channel);
    }

    fn section(title: &'static str) {
        with(|run| (run.section, run.channel) = (title, 0));
    }
}

impl Real for Symbol {
    const ZERO: Self = Self(ZERO);
    const HALF: Self = Self(HALF);
    const WORDS: usize = 1;

    fn to_words(self) -> [u32; 2] {
        [StateWord::Number(self).to_word(), 0]
    }

    fn from_words(words: [u32; 2]) -> Self {
        Self(Id(words[0] & !NUMBER))
    }

    fn from_f64(value: f64) -> Self {
        Self(constant(value))
    }

    /// Returns NaN: a symbol has no value yet.
    fn to_f64(self) -> f64 {
        f64::NAN
    }

    #[track_caller]
    fn abs(self) -> Self {
        let at = Location::caller();
        Self(compute(Op::Abs(self.0), at))
    }

    #[track_caller]
    fn at_most(self, most: Self) -> Self {
        let at = Location::caller();
        let is_more = compute(Op::Compare(Test::Greater, self.0, most.0), at);
        Self(compute(Op::Select(is_more, most.0, self.0), at))
    }

    #[track_caller]
    fn if_below(self, bound: Self, yes: Self, no: Self) -> Self {
        let at = Location::caller();
        let is_below = compute(Op::Compare(Test::Less, self.0, bound.0), at);
        Self(compute(Op::Select(is_below, yes.0, no.0), at))
    }
}
