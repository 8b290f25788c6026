//! Parser of the specification of a function, with its entry into the value graph. The page of [`meaning`](super)
//! defines the format.

use std::collections::HashMap;

use super::graph::{Graph, Node};
use super::term::{EQUAL, GREATER, LESS, UNORDERED};

/// Kind of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ValueKind {
    Number,
    Count,
    /// A byte in memory, 0 or 1; a bit of a halfword, if it shares its place.
    Truth,
    /// A word: the first number for true, the second for false.
    Either(u32, u32),
}

/// Known content of a memory word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WordContent {
    Bits(u32),
    /// Address that this register holds at the entry.
    Address(u32),
}

/// Place of an input or a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Place {
    /// Register: r0 .. pc are 0 .. 15, s0 .. s31 are 16 .. 47.
    Register(u32),
    /// Memory: base register at the entry, and offset in bytes.
    Memory(u32, i32),
}

#[derive(Clone, Debug)]
pub(super) struct Port {
    pub(super) name: String,
    pub(super) kind: ValueKind,
    pub(super) place: Place,
    /// Bit of a word that a truth occupies; `None`: the truth is a byte.
    pub(super) bit: Option<u32>,
}

/// Operation on values, by their indices.
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

/// Specification of a function.
#[derive(Clone, Debug)]
pub(super) struct Expected {
    pub(super) function: String,
    pub(super) inputs: Vec<Port>,
    pub(super) known: Vec<(Place, WordContent)>,
    /// Sizes of the memory behind registers: register and bytes.
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
    /// Returns the contribution of a truth to the word at its place.
    pub(super) fn word_of(&self, truth: bool) -> u32 {
        match self.kind {
            ValueKind::Either(yes, no) => {
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
    /// Parses a specification.
    ///
    /// # Errors
    /// The first invalid line, with its number.
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

    /// Returns the results in the order of `outs`, as their places hold them at the return.
    pub(super) fn results(&self, graph: &mut Graph) -> Vec<Node> {
        let nodes = self.nodes(graph);
        let values = results(&self.body, &nodes, graph);
        let mut words = Vec::new();
        for port in &self.outs {
            // All truths at one place form one number.
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

/// Returns the results of a block with its nested blocks.
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
            return Err("the first line must be `means 1`".into());
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
                    // The bits of a word must be consecutive, since the bits above are arbitrary.
                    let before = inputs.iter().filter(|one| one.place == port.place).count();
                    if port.bit.map_or(before > 0, |bit| bit as usize != before) {
                        return Err("an input needs its own place; bits of a word start at 0".into());
                    }
                    let op = match port.kind {
                        ValueKind::Number | ValueKind::Count => Op::Input(inputs.len()),
                        ValueKind::Truth | ValueKind::Either(..) => Op::One("input", inputs.len()),
                    };
                    self.define(name, op)?;
                    inputs.push(port);
                }
                ["known", at, value] => Vec::push(&mut known, (place(at)?, known_word(value)?)),
                ["size", base, length] => match (place(base)?, bits(length)?) {
                    (Place::Register(base @ 0..=13), length @ 1..=0xffff) => Vec::push(&mut sizes, (base, length)),
                    _ => return Err("a size needs a register and 1 to 65535 bytes".into()),
                },
                ["pad", at, length] => Vec::push(&mut pads, (place(at)?, bits(length)?)),
                ["out", name, kind, at, ref more @ ..] => Vec::push(&mut outs, port(name, kind, at, more)?),
                ["begin"] => break,
                _ => return Err("expected function, in, known, size, pad, out or begin".into()),
            }
        }
        let body = self.block(outs.len())?;
        if let Some((at, _)) = self.lines.next() {
            self.at = at;
            return Err("text after the end".into());
        }
        let ops = std::mem::take(&mut self.ops);
        Ok(Expected { function, inputs, known, sizes, pads, outs, ops, body })
    }

    fn define(&mut self, name: &str, op: Op) -> Result<(), String> {
        match self.names.get(name) {
            Some(&at) if self.ops[at] == op => Ok(()),
            Some(_) => Err(format!("`{name}` is defined twice")),
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

    /// Returns the index of a value that is a truth.
    fn truth(&self, name: &str) -> Result<usize, String> {
        let named = self.named(name)?;
        if self.is_truth(named) { Ok(named) } else { Err(format!("`{name}` is not a truth")) }
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
                ["return", ..] => return Err(format!("a return needs {outs} values, one for each result")),
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
                _ => return Err("expected a definition, if or return".into()),
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
                    (true, false) => Err(format!("`{other}` is not a truth")),
                    (false, true) => Err(format!("`{one}` is not a truth")),
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
            _ => Err("expected an operation".into()),
        }
    }
}

fn bits(text: &str) -> Result<u32, String> {
    let number = match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16),
        None => text.parse(),
    };
    number.map_err(|_| format!("`{text}` is not a 32-bit number"))
}

fn port(name: &str, kind: &str, at: &str, more: &[&str]) -> Result<Port, String> {
    let (kind, bit) = match (kind, more) {
        ("number", []) => (ValueKind::Number, None),
        ("count", []) => (ValueKind::Count, None),
        ("truth", []) => (ValueKind::Truth, None),
        ("truth", ["bit", bit]) => (ValueKind::Truth, Some(bits(bit)?)),
        ("either", [yes, no]) => (ValueKind::Either(bits(yes)?, bits(no)?), None),
        ("either", _) => return Err("`either` needs two numbers, for true and for false".into()),
        ("number" | "count" | "truth", _) => return Err("the bit of a truth is 0 to 31".into()),
        _ => return Err(format!("no kind `{kind}`")),
    };
    if bit.is_some_and(|bit| bit > 31) {
        return Err("the bit of a truth is 0 to 31".into());
    }
    Ok(Port { name: name.to_owned(), kind, place: place(at)?, bit })
}

/// Parses a number, or the register whose address is meant.
fn known_word(text: &str) -> Result<WordContent, String> {
    match place(text) {
        Ok(Place::Register(register @ 0..=13)) => Ok(WordContent::Address(register)),
        _ => bits(text).map(WordContent::Bits),
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
            _ => Err(format!("`{text}` has an offset that is too large")),
        },
        _ => Err(format!("`{text}` is not a place")),
    }
}
