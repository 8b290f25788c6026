//! Reads the text of what a function is to compute, and enters it in a graph. The format stands at the head of
//! [`meaning`](super).

use std::collections::HashMap;

use super::graph::{Graph, Node};
use super::term::{EQUAL, GREATER, LESS, UNORDERED};

/// What a value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Number,
    Count,
    /// A byte in memory, 0 or 1; a bit of a half word, if it shares its place.
    Truth,
    /// A word: the first where it is true, else the second.
    Either(u32, u32),
}

/// What a word of memory is known to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    Bits(u32),
    /// The address that this register holds at the entry.
    Address(u32),
}

/// Where an input comes from, where a result goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Place {
    /// r0 .. pc are 0 .. 15, s0 .. s31 are 16 .. 47.
    Register(u32),
    /// Behind the address that a register holds at the entry.
    Memory(u32, i32),
}

#[derive(Clone, Debug)]
pub(super) struct Port {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) place: Place,
    /// Of a truth: which bit of a word it is; else it is a byte.
    pub(super) bit: Option<u32>,
}

/// An operation on values, by their places.
#[derive(Clone, Debug, PartialEq)]
enum Op {
    Input(usize),
    Bits(u32),
    Truth(bool),
    One(&'static str, usize),
    Two(&'static str, usize, usize),
    Compare(u8, usize, usize),
    Select(usize, usize, usize),
    Signed(usize, u32),
}

#[derive(Clone, Debug)]
enum Block {
    Return(Vec<usize>),
    If(usize, Box<Block>, Box<Block>),
}

/// What a function is to compute.
#[derive(Clone, Debug)]
pub(super) struct Expected {
    pub(super) function: String,
    pub(super) inputs: Vec<Port>,
    pub(super) known: Vec<(Place, Known)>,
    /// Bytes of the memory behind a register.
    pub(super) sizes: Vec<(u32, u32)>,
    pub(super) pads: Vec<(Place, u32)>,
    pub(super) outs: Vec<Port>,
    ops: Vec<Op>,
    body: Block,
}

const COMPARISONS: [(&str, u8); 6] = [
    ("less", LESS),
    ("less_equal", LESS | EQUAL),
    ("greater", GREATER),
    ("greater_equal", GREATER | EQUAL),
    ("equal", EQUAL),
    ("not_equal", LESS | GREATER | UNORDERED),
];
const OF_ONE: [&str; 4] = ["neg", "abs", "not", "number_of"];
const OF_TWO: [&str; 10] = ["add", "sub", "mul", "div", "and", "or", "plus", "since", "times", "quotient"];

impl Port {
    /// What a truth adds to the word in its place.
    pub(super) fn word_of(&self, truth: bool) -> u32 {
        match self.kind {
            Kind::Either(yes, no) => {
                if truth {
                    yes
                } else {
                    no
                }
            }
            _ => u32::from(truth) << self.bit.unwrap_or(0),
        }
    }
}

impl Expected {
    /// Reads a text.
    ///
    /// # Errors
    /// The first line that is wrong, by its number.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        let lines = text.lines().zip(1..).map(|(line, number)| (number, line.split('#').next().unwrap_or("").trim()));
        let mut reader = Reader {
            lines: lines.filter(|(_, line)| !line.is_empty()).collect::<Vec<_>>().into_iter(),
            at: 0,
            names: HashMap::new(),
            ops: Vec::new(),
        };
        reader.expected().map_err(|message| format!("line {}: {message}", reader.at))
    }

    /// The results, in the order of `outs`: what stands in their places at the return.
    pub(super) fn results(&self, graph: &mut Graph) -> Vec<Node> {
        let nodes = self.nodes(graph);
        let values = results(&self.body, &nodes, graph);
        let mut words = Vec::new();
        for port in &self.outs {
            // All truths in one place are one number.
            let mut word = graph.constant(0);
            for (one, &value) in self.outs.iter().zip(&values).filter(|(one, _)| one.place == port.place) {
                word = if graph.is_truth(value) {
                    let bits = graph.word_of(one, value);
                    graph.plus(bits, word, 1)
                } else {
                    value
                };
            }
            words.push(word);
        }
        words
    }

    fn nodes(&self, graph: &mut Graph) -> Vec<Node> {
        let mut nodes: Vec<Node> = Vec::new();
        for op in &self.ops {
            nodes.push(match *op {
                Op::Input(input) => graph.input(input),
                Op::Bits(bits) => graph.constant(bits),
                Op::Truth(truth) => graph.truth(truth),
                Op::One("input", input) => graph.given(input),
                Op::One("not", a) => graph.not(nodes[a]),
                Op::One(name, a) => graph.one(name, nodes[a]),
                Op::Two("and", a, b) => graph.and(nodes[a], nodes[b]),
                Op::Two("or", a, b) => {
                    let yes = graph.truth(true);
                    graph.select(nodes[a], yes, nodes[b])
                }
                Op::Two("sub", a, b) => graph.sub(nodes[a], nodes[b]),
                Op::Two("plus", a, b) => graph.plus(nodes[a], nodes[b], 1),
                Op::Two("since", a, b) => graph.plus(nodes[a], nodes[b], u32::MAX),
                Op::Two(name, a, b) => graph.two(name, nodes[a], nodes[b]),
                Op::Compare(set, a, b) => graph.stands(nodes[a], set, nodes[b]),
                Op::Select(condition, a, b) => graph.select(nodes[condition], nodes[a], nodes[b]),
                Op::Signed(a, bits) => graph.low_bits(nodes[a], bits),
            });
        }
        nodes
    }
}

/// The results of a block and of those within.
fn results(block: &Block, nodes: &[Node], graph: &mut Graph) -> Vec<Node> {
    match block {
        Block::Return(results) => results.iter().map(|at| nodes[*at]).collect(),
        Block::If(condition, yes, no) => {
            let (yes, no) = (results(yes, nodes, graph), results(no, nodes, graph));
            yes.into_iter().zip(no).map(|(yes, no)| graph.select(nodes[*condition], yes, no)).collect()
        }
    }
}

struct Reader<'a> {
    lines: std::vec::IntoIter<(usize, &'a str)>,
    at: usize,
    names: HashMap<String, usize>,
    ops: Vec<Op>,
}

impl<'a> Reader<'a> {
    fn line(&mut self) -> Result<Vec<&'a str>, String> {
        let (at, line) = self.lines.next().ok_or("the text ends too early")?;
        self.at = at;
        Ok(line.split_whitespace().collect())
    }

    fn expected(&mut self) -> Result<Expected, String> {
        if self.line()? != ["means", "1"] {
            return Err("a text of this format begins with `means 1`".into());
        }
        for truth in [true, false] {
            self.define(if truth { "true" } else { "false" }, Op::Truth(truth))?;
        }
        let mut inputs: Vec<Port> = Vec::new();
        let (mut function, mut known, mut sizes, mut pads, mut outs) = Default::default();
        loop {
            match self.line()?[..] {
                ["function", ref words @ ..] => function = words.join(" "),
                ["in", name, kind, at, ref more @ ..] => {
                    let port = port(name, kind, at, more)?;
                    // Those of one word stand one after the other, so that what is above them may be anything.
                    let before = inputs.iter().filter(|one| one.place == port.place).count();
                    if port.bit.map_or(before > 0, |bit| bit as usize != before) {
                        return Err("an input has a place of its own; bits of a word go from 0 on".into());
                    }
                    let op = match port.kind {
                        Kind::Number | Kind::Count => Op::Input(inputs.len()),
                        Kind::Truth | Kind::Either(..) => Op::One("input", inputs.len()),
                    };
                    self.define(name, op)?;
                    inputs.push(port);
                }
                ["known", at, value] => Vec::push(&mut known, (place(at)?, known_word(value)?)),
                ["size", base, length] => match (place(base)?, bits(length)?) {
                    (Place::Register(base @ 0..=13), length @ 1..=0xffff) => Vec::push(&mut sizes, (base, length)),
                    _ => return Err("a size is that of what a register points to, 1 to 65535 bytes".into()),
                },
                ["pad", at, length] => Vec::push(&mut pads, (place(at)?, bits(length)?)),
                ["out", name, kind, at, ref more @ ..] => Vec::push(&mut outs, port(name, kind, at, more)?),
                ["begin"] => break,
                _ => return Err("neither function, in, known, size, pad, out nor begin".into()),
            }
        }
        let body = self.block(outs.len())?;
        if let Some((at, _)) = self.lines.next() {
            self.at = at;
            return Err("more text behind the end".into());
        }
        let ops = std::mem::take(&mut self.ops);
        Ok(Expected { function, inputs, known, sizes, pads, outs, ops, body })
    }

    fn define(&mut self, name: &str, op: Op) -> Result<(), String> {
        match self.names.get(name) {
            Some(&at) if self.ops[at] == op => Ok(()),
            Some(_) => Err(format!("`{name}` is two things")),
            None => {
                self.names.insert(name.to_owned(), self.ops.len());
                self.ops.push(op);
                Ok(())
            }
        }
    }

    fn named(&self, name: &str) -> Result<usize, String> {
        self.names.get(name).copied().ok_or_else(|| format!("no value `{name}` before this line"))
    }

    /// A value that is true or false.
    fn truth(&self, name: &str) -> Result<usize, String> {
        let named = self.named(name)?;
        if self.is_truth(named) { Ok(named) } else { Err(format!("`{name}` is no truth")) }
    }

    fn is_truth(&self, mut at: usize) -> bool {
        while let Op::Select(_, a, _) = self.ops[at] {
            at = a;
        }
        matches!(self.ops[at], Op::Truth(_) | Op::Compare(..) | Op::One("input" | "not", _) | Op::Two("and" | "or", ..))
    }

    fn block(&mut self, outs: usize) -> Result<Block, String> {
        loop {
            match self.line()?[..] {
                ["return", ref results @ ..] if results.len() == outs => {
                    return Ok(Block::Return(results.iter().map(|one| self.named(one)).collect::<Result<_, _>>()?));
                }
                ["return", ..] => return Err(format!("a return has a value for each of {outs} results")),
                ["if", condition] => {
                    let condition = self.truth(condition)?;
                    let yes = self.block(outs)?;
                    if self.line()? != ["else"] {
                        return Err("`else` is missing".into());
                    }
                    let no = self.block(outs)?;
                    if self.line()? != ["end"] {
                        return Err("`end` is missing".into());
                    }
                    return Ok(Block::If(condition, Box::new(yes), Box::new(no)));
                }
                [name, "=", ref words @ ..] => {
                    let op = self.op(words)?;
                    self.define(name, op)?;
                }
                _ => return Err("neither a definition, if nor return".into()),
            }
        }
    }

    fn op(&self, words: &[&str]) -> Result<Op, String> {
        let of = |names: &[&'static str], name: &str| names.iter().find(|one| **one == name).copied();
        let comparison = |name: &str| COMPARISONS.iter().find(|(one, _)| *one == name).map(|(_, set)| *set);
        match *words {
            ["number" | "count", value] => Ok(Op::Bits(bits(value)?)),
            ["select", t, one, other] => {
                let (t, a, b) = (self.truth(t)?, self.named(one)?, self.named(other)?);
                match (self.is_truth(a), self.is_truth(b)) {
                    (true, false) => Err(format!("`{other}` is no truth")),
                    (false, true) => Err(format!("`{one}` is no truth")),
                    _ => Ok(Op::Select(t, a, b)),
                }
            }
            ["signed", a, width] => match bits(width)? {
                width @ 1..=32 => Ok(Op::Signed(self.named(a)?, width)),
                _ => Err("a count has 1 to 32 bits".into()),
            },
            [name, a] => {
                let name = of(&OF_ONE, name).ok_or_else(|| format!("no operation `{name}` of one value"))?;
                Ok(Op::One(name, if name == "not" { self.truth(a)? } else { self.named(a)? }))
            }
            [name, a, b] => {
                let (a, b) = match name {
                    "and" | "or" => (self.truth(a)?, self.truth(b)?),
                    _ => (self.named(a)?, self.named(b)?),
                };
                match (comparison(name), of(&OF_TWO, name)) {
                    (Some(set), _) => Ok(Op::Compare(set, a, b)),
                    (_, Some(name)) => Ok(Op::Two(name, a, b)),
                    _ => Err(format!("no operation `{name}` of two values")),
                }
            }
            _ => Err("no operation".into()),
        }
    }
}

fn bits(text: &str) -> Result<u32, String> {
    let number = match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16),
        None => text.parse(),
    };
    number.map_err(|_| format!("`{text}` is no number of 32 bits"))
}

fn port(name: &str, kind: &str, at: &str, more: &[&str]) -> Result<Port, String> {
    let (kind, bit) = match (kind, more) {
        ("number", []) => (Kind::Number, None),
        ("count", []) => (Kind::Count, None),
        ("truth", []) => (Kind::Truth, None),
        ("truth", ["bit", bit]) => (Kind::Truth, Some(bits(bit)?)),
        ("either", [yes, no]) => (Kind::Either(bits(yes)?, bits(no)?), None),
        ("either", _) => return Err("of `either` there are two: where it is true, where it is not".into()),
        ("number" | "count" | "truth", _) => return Err("a truth has one of the bits 0 to 31".into()),
        _ => return Err(format!("no kind `{kind}`")),
    };
    if bit.is_some_and(|bit| bit > 31) {
        return Err("a truth has one of the bits 0 to 31".into());
    }
    Ok(Port { name: name.to_owned(), kind, place: place(at)?, bit })
}

/// A number, or the register whose address it is.
fn known_word(text: &str) -> Result<Known, String> {
    match place(text) {
        Ok(Place::Register(register @ 0..=13)) => Ok(Known::Address(register)),
        _ => bits(text).map(Known::Bits),
    }
}

fn place(text: &str) -> Result<Place, String> {
    let (name, offset) = text.split_once('+').map_or((text, None), |(name, offset)| (name, Some(offset)));
    let number = |letter: char, below: u32| {
        let number: u32 = name.strip_prefix(letter)?.parse().ok()?;
        (number < below).then_some(number)
    };
    let register = match name {
        "sp" => Some(13),
        _ => number('r', 13).or(number('s', 32).map(|number| number + 16)),
    };
    match (register, offset) {
        (Some(register), None) => Ok(Place::Register(register)),
        (Some(register @ 0..=13), Some(offset)) => match bits(offset)? {
            offset @ 0..=0xffff => Ok(Place::Memory(register, offset as i32)),
            _ => Err(format!("`{text}` is too far behind")),
        },
        _ => Err(format!("`{text}` is no place")),
    }
}
