//! Symbolic execution of a function: each instruction once, on values of a graph instead of numbers.
//!
//! The instructions are executed in topological order. Where paths join, a register or a memory word with differing
//! values becomes a selection, by the branches since the last common instruction. A callee is executed once per call,
//! and a loop once per iteration, up to a limit. An instruction that cannot be followed ends its path, and a proof is
//! then needed that no input reaches it.
//!
//! Memory consists of bytes in regions: one region per address input, and the stack. Each byte refers to the stored
//! word and its position within the word. A load therefore returns a stored word, or known numbers.

use std::collections::{BTreeMap, HashSet};
use std::rc::Rc;

use super::graph::{Graph, Node, Op};
use super::term::{EQUAL, GREATER, LESS, Mixing, Order, UNORDERED};
use super::text::{Expected, Place, Port, ValueKind, WordContent};
use crate::graph::{Loops, loops};
use crate::image::Image;
use crate::instruction::{Decoder, Flow, Instruction, immediate, listed, register};

const SP: usize = 13;
const LR: usize = 14;
const PC: usize = 15;
const FLOATS: usize = 16;
/// Largest depth of nested calls.
const DEEP: usize = 8;
/// Largest number of loop iterations. That no input exceeds it needs a proof, as for any code that cannot be followed.
const TURNS: usize = 64;

/// Content of a 32-bit register or memory word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Word {
    Term(Node),
    /// An address: base register at the entry, and offset in bytes.
    Address(u32, i32),
    /// One of two addresses, the first if the truth holds: the compiler has merged two stores at the ends of two paths.
    OneOf(Node, u32, [i32; 2]),
    /// Combined bits of several addresses, with the lowest two bits 0.
    Aligned,
    /// Return address of the function.
    Return,
    /// Different kinds of content on different paths.
    Mixed,
}

/// Condition flags, as the operands that set them.
#[derive(Clone, Debug, PartialEq)]
enum Flags {
    Unknown,
    Floats(Node, Node),
    Counts(Node, Node),
    /// Known outcome: equal, less as signed, less as unsigned.
    Known(bool, bool, bool),
    /// N and Z of this result; C and V are unknown.
    Result(Node),
    /// The first flags if the truth holds, else the second.
    Choice(Node, Rc<Flags>, Rc<Flags>),
}

#[derive(Clone, Debug)]
enum Operand {
    Register(usize),
    Number(u32),
    List(Vec<usize>),
    /// Memory operand: base, index with its shift, offset.
    Memory {
        base: usize,
        index: Option<(usize, u32)>,
        offset: i32,
        writes: bool,
    },
    /// Shift behind a register, for example `lsl #2`.
    Shift(&'static str, u32),
    /// Unsupported operand.
    Other,
}

#[derive(Clone, Debug)]
struct Code {
    instruction: Instruction,
    stem: String,
    operands: Vec<Operand>,
    /// Set if LDM or STM writes back its base.
    writes_base: bool,
}

/// Code of a firmware, decoded on demand.
pub(super) struct Program<'a> {
    image: &'a Image,
    decoder: Decoder,
    code: Mixing<u32, Rc<Code>>,
    /// Addresses of instructions behind an IT.
    behind_it: HashSet<u32>,
}

impl<'a> Program<'a> {
    pub(super) fn new(image: &'a Image, decoder: Decoder) -> Self {
        Self { image, decoder, code: Mixing::default(), behind_it: HashSet::new() }
    }

    /// Returns the number of decoded instructions over all paths.
    pub(super) fn instructions(&self) -> usize {
        self.code.len()
    }

    fn at(&mut self, address: u32) -> Result<Rc<Code>, String> {
        if let Some(code) = self.code.get(&address) {
            return Ok(Rc::clone(code));
        }
        let bytes = self.image.bytes(address).filter(|_| !self.image.is_data(address));
        let block = bytes.map_or_else(Vec::new, |bytes| self.decoder.decode(bytes, address));
        if block.first().is_none_or(|one| one.address != address) {
            return Err(format!("no instruction known at {}", self.image.place(address)));
        }
        for one in &block {
            if let Some(why) = one.open {
                return Err(format!("`{}` at {}: {why}", one.text(), self.image.place(one.address)));
            }
        }
        self.behind_it.extend(block.iter().skip(1).map(|one| one.address));
        self.code.extend(block.into_iter().map(|one| (one.address, Rc::new(Code::of(one)))));
        Ok(Rc::clone(&self.code[&address]))
    }
}

impl Code {
    fn of(instruction: Instruction) -> Self {
        let writes_base = instruction.operands.first().is_some_and(|one| one.ends_with('!'));
        let mut operands: Vec<Operand> = instruction.operands.iter().map(|text| operand(text)).collect();
        // Form `[r0], #4`: the offset is added after the access.
        if let [.., Operand::Memory { writes, .. }, Operand::Number(_)] = &mut operands[..] {
            *writes = true;
        }
        Self { stem: instruction.stem().to_owned(), instruction, operands, writes_base }
    }
}

const SHIFTS: [&str; 4] = ["lsl", "lsr", "asr", "ror"];

fn operand(text: &str) -> Operand {
    let number = |set: u64| set.is_power_of_two().then(|| set.trailing_zeros() as usize);
    if let Some(value) = immediate(text) {
        return Operand::Number(value as u32);
    }
    if let Some(float) = text.strip_prefix('#') {
        // A float immediate, in the notation of the manual.
        return float.parse::<f32>().map_or(Operand::Other, |float| Operand::Number(float.to_bits()));
    }
    if text.starts_with('{') {
        let set = listed(text);
        return Operand::List((0..48).filter(|k| set >> k & 1 == 1).collect());
    }
    if let Some(inner) = text.strip_prefix('[') {
        let writes = inner.ends_with('!');
        let parts: Vec<&str> = inner.trim_end_matches('!').trim_end_matches(']').split(',').map(str::trim).collect();
        let base = number(register(parts[0]));
        return match (base, &parts[1..]) {
            (Some(base), []) => Operand::Memory { base, index: None, offset: 0, writes },
            (Some(base), [offset]) if offset.starts_with('#') => {
                Operand::Memory { base, index: None, offset: immediate(offset).unwrap_or(i32::MIN), writes }
            }
            (Some(base), [index, rest @ ..]) => {
                let by = rest.first().map_or(Some(0), |shift| immediate(shift.strip_prefix("lsl ")?));
                match (number(register(index)), by) {
                    (Some(index), Some(by)) => {
                        Operand::Memory { base, index: Some((index, by as u32)), offset: 0, writes }
                    }
                    _ => Operand::Other,
                }
            }
            _ => Operand::Other,
        };
    }
    for shift in SHIFTS {
        if let Some(by) = text.strip_prefix(shift).and_then(|rest| immediate(rest.trim())) {
            return Operand::Shift(shift, by as u32);
        }
    }
    number(register(text.trim_end_matches('!'))).map_or(Operand::Other, Operand::Register)
}

/// Registers, memory and flags between two instructions.
#[derive(Clone)]
struct State {
    registers: Vec<Word>,
    memory: BTreeMap<(u32, i32), (Word, u8)>,
    /// Float flags before VMRS; `flags` holds the flags of the core.
    compared: Rc<Flags>,
    flags: Rc<Flags>,
}

/// Symbolic machine state at one instruction.
pub(super) struct Machine<'p, 'i, 'x> {
    program: &'p mut Program<'i>,
    pub(super) graph: &'p mut Graph,
    expected: &'x Expected,
    state: State,
    /// Stack pointer before the instruction; an interrupt may write below it.
    stack: i32,
    /// Registers that hold an address at the entry.
    bases: Vec<u32>,
    /// Sums of the input bits of a word so far.
    bits_below: Mixing<Place, Node>,
    /// Conditions that must never hold, each with the instruction that cannot be followed under it.
    pub(super) dead: Vec<(String, Node)>,
}

/// Callee-saved registers (AAPCS), without the stack pointer.
const KEPT: [std::ops::RangeInclusive<usize>; 2] = [4..=11, FLOATS + 16..=FLOATS + 31];

type Done<T> = Result<T, String>;

/// Successors of an instruction, by position in the order.
#[derive(Clone, Copy)]
enum Next {
    Nowhere,
    One(usize),
    /// The first successor if the truth holds, else the second.
    Two(Node, usize, usize),
}

impl Next {
    fn leads_to(self, n: usize) -> bool {
        match self {
            Self::Nowhere => false,
            Self::One(to) => to == n,
            Self::Two(_, yes, no) => yes == n || no == n,
        }
    }
}

/// A node of the selection at a join of paths; it follows the nodes that it refers to.
#[derive(Clone, Copy)]
enum Gate {
    /// Value behind this instruction.
    Leaf(usize),
    /// No path.
    Never,
    Choice(Node, usize, usize),
}

/// Instructions in execution order: address, call and loop iteration; the successors without and with a jump; per call,
/// the calling call and the return address.
struct Ways {
    places: Vec<(u32, usize, usize)>,
    targets: Vec<[Option<usize>; 2]>,
    calls: Vec<(usize, Option<u32>)>,
}

/// An instruction within a call: address and call.
type Key = (u32, usize);

/// Returns the last instruction that all paths to both instructions have passed.
fn common(above: &[usize], mut one: usize, mut other: usize) -> usize {
    while one != other {
        if one > other {
            one = above[one];
        } else {
            other = above[other];
        }
    }
    one
}

/// Returns the selections on all paths from one instruction to another, and the index of the outermost one.
fn gates(next: &[Next], from: usize, to: usize) -> (Vec<Gate>, usize) {
    let mut gates = vec![Gate::Never];
    // Outermost selection of each instruction, built from the last instruction on.
    let mut of: Mixing<usize, usize> = Mixing::default();
    for n in (from..to).rev() {
        let mut side = |target: usize| match of.get(&target) {
            _ if target == to => {
                gates.push(Gate::Leaf(n));
                gates.len() - 1
            }
            Some(gate) => *gate,
            None => 0,
        };
        let gate = match next[n] {
            Next::Nowhere => 0,
            Next::One(target) => side(target),
            Next::Two(t, yes, no) => match (side(yes), side(no)) {
                (0, 0) => 0,
                (yes, no) => {
                    gates.push(Gate::Choice(t, yes, no));
                    gates.len() - 1
                }
            },
        };
        if gate > 0 {
            of.insert(n, gate);
        }
    }
    let last = of.get(&from).copied().unwrap_or(0);
    (gates, last)
}

/// Evaluates selections to one value, if any path reaches the join. Paths that do not reach the join are ignored.
fn folded<T: Clone>(
    gates: &[Gate],
    last: usize,
    leaf: &dyn Fn(usize) -> T,
    choice: &mut dyn FnMut(Node, T, T) -> T,
) -> Option<T> {
    let mut values: Vec<Option<T>> = Vec::new();
    for gate in &gates[..=last] {
        values.push(match *gate {
            Gate::Leaf(n) => Some(leaf(n)),
            Gate::Never => None,
            Gate::Choice(t, a, b) => match (values[a].clone(), values[b].clone()) {
                (Some(a), Some(b)) => Some(choice(t, a, b)),
                (a, b) => a.or(b),
            },
        });
    }
    values[last].clone()
}

impl<'p, 'i, 'x> Machine<'p, 'i, 'x> {
    pub(super) fn new(program: &'p mut Program<'i>, graph: &'p mut Graph, expected: &'x Expected) -> Self {
        let unknown = Rc::new(Flags::Unknown);
        let state = State {
            registers: (0..48).map(|k| Word::Term(graph.entry(k))).collect(),
            memory: BTreeMap::new(),
            compared: Rc::clone(&unknown),
            flags: unknown,
        };
        let (bases, bits_below, dead) = Default::default();
        let mut machine = Self { program, graph, expected, state, stack: 0, bases, bits_below, dead };
        machine.state.registers[SP] = Word::Address(SP as u32, 0);
        machine.state.registers[LR] = Word::Return;
        for (k, port) in expected.inputs.iter().enumerate() {
            let word = match port.kind {
                ValueKind::Number | ValueKind::Count => machine.graph.input(k),
                ValueKind::Truth | ValueKind::Either(..) => {
                    let given = machine.graph.given(k);
                    machine.graph.word_of(port, given)
                }
            };
            match port.bit {
                None => machine.begin_with(port.place, Word::Term(word), width(port)),
                Some(bit) => machine.begin_with_bit(port.place, word, bit),
            }
        }
        for (place, value) in &expected.known {
            let value = match *value {
                WordContent::Bits(bits) => Word::Term(machine.graph.constant(bits)),
                WordContent::Address(register) => {
                    machine.state.registers[register as usize] = Word::Address(register, 0);
                    Word::Address(register, 0)
                }
            };
            machine.begin_with(*place, value, 4);
        }
        for &(base, _) in &expected.sizes {
            machine.state.registers[base as usize] = Word::Address(base, 0);
        }
        for port in &expected.outs {
            if let Place::Memory(base, _) = port.place {
                machine.state.registers[base as usize] = Word::Address(base, 0);
            }
        }
        let is_base = |(k, word): (u32, &Word)| (*word == Word::Address(k, 0)).then_some(k);
        machine.bases = (0..).zip(&machine.state.registers).filter_map(is_base).collect();
        machine
    }

    fn begin_with(&mut self, place: Place, word: Word, width: u8) {
        match place {
            Place::Register(register) => self.state.registers[register as usize] = word,
            Place::Memory(base, offset) => {
                self.state.registers[base as usize] = Word::Address(base, 0);
                for part in 0..width {
                    self.state.memory.insert((base, offset + i32::from(part)), (word, part));
                }
            }
        }
    }

    /// Adds one bit to an input word whose lower bits exist already; the bits above are arbitrary.
    fn begin_with_bit(&mut self, place: Place, bit: Node, at: u32) {
        let before = if at == 0 { self.graph.constant(0) } else { self.bits_below[&place] };
        let below = self.graph.plus(before, bit, 1);
        self.bits_below.insert(place, below);
        let any = self.graph.anything();
        let above = self.graph.shifted_left(any, at + 1);
        let word = self.graph.plus(below, above, 1);
        self.begin_with(place, Word::Term(word), 4);
    }

    /// Executes from `start` to the return. Returns the values that must then be equal, each with its meaning.
    pub(super) fn run(&mut self, start: u32) -> Done<Vec<(String, Node, Node)>> {
        let ways = self.ways(start)?;
        let end = ways.places.len();
        let (mut behind, mut next, mut above) = (vec![None; end], vec![Next::Nowhere; end], vec![0; end + 1]);
        for n in 0..=end {
            if n > 0 {
                let before: Vec<usize> = (0..n).filter(|p| next[*p].leads_to(n)).collect();
                let Some(&first) = before.first() else { continue };
                above[n] = before.iter().fold(first, |one, other| common(&above, one, *other));
                let states = before.iter().filter_map(|p| {
                    let (taken, other) = behind[*p].as_ref()?;
                    Some(if matches!(next[*p], Next::Two(_, _, no) if no == n) { other } else { taken })
                });
                let states: Vec<&Rc<State>> = states.collect();
                self.state = if states.len() == 1 {
                    State::clone(states[0])
                } else {
                    let (gates, last) = gates(&next, above[n], n);
                    let leaf = |p: usize| before.iter().position(|one| *one == p).unwrap_or(0);
                    self.met(&gates, last, &states, &leaf)
                };
                match next[first] {
                    Next::Two(holds, yes, _) if before.len() == 1 => {
                        let holds = if yes == n { holds } else { self.graph.not(holds) };
                        self.suppose(holds);
                    }
                    _ => {}
                }
            }
            if n == end {
                return self.returned();
            }
            let (address, call, turn) = ways.places[n];
            if turn == TURNS {
                self.ends(
                    &next,
                    n,
                    format!("a loop with more than {TURNS} iterations at {}", self.program.image.place(address)),
                );
                continue;
            }
            let code = match self.program.at(address) {
                Ok(code) => code,
                Err(reason) => {
                    self.ends(&next, n, reason);
                    continue;
                }
            };
            match self.execute(&code, ways.targets[n], ways.calls[call].1) {
                Ok((to, other)) => {
                    let taken = Rc::new(self.state.clone());
                    let other = other.unwrap_or_else(|| Rc::clone(&taken));
                    (behind[n], next[n]) = (Some((taken, other)), to);
                }
                Err(reason) => {
                    let place = self.program.image.place(address);
                    self.ends(&next, n, format!("`{}` at {place}: {reason}", code.instruction.text()));
                }
            }
        }
        Err("does not return".into())
    }

    /// Ends the path at this instruction; a proof is needed that no input reaches it.
    fn ends(&mut self, next: &[Next], n: usize, reason: String) {
        let (gates, last) = gates(next, 0, n);
        let mut holds: Vec<Node> = Vec::new();
        for gate in &gates {
            holds.push(match *gate {
                Gate::Leaf(_) => self.graph.truth(true),
                Gate::Never => self.graph.truth(n == 0),
                Gate::Choice(t, a, b) => self.graph.select(t, holds[a], holds[b]),
            });
        }
        self.dead.push((reason, holds[last]));
    }

    /// Returns all instructions in topological order; a loop is unrolled iteration by iteration.
    fn ways(&mut self, start: u32) -> Done<Ways> {
        let (keys, to, calls) = self.instructions(start)?;
        let at: Mixing<Key, usize> = keys.iter().zip(0..).map(|(key, k)| (*key, k)).collect();
        let leads = |k: usize| to[k].into_iter().flatten().flatten().map(|key| at[&key]).collect();
        let edges: Vec<Vec<usize>> = (0..keys.len()).map(leads).collect();
        let Loops { order, bodies } =
            loops(&edges).map_err(|k| format!("a loop with two entries at {}", self.program.image.place(keys[k].0)))?;
        // Header of the loop around each instruction.
        let mut around = vec![None; keys.len()];
        for (head, body) in &bodies {
            for k in body {
                if around[*k].replace(*head).is_some() {
                    return Err(format!("a loop within a loop at {}", self.program.image.place(keys[*k].0)));
                }
            }
        }
        let mut places: Vec<(usize, usize)> = Vec::new();
        for k in order {
            match (around[k], bodies.get(&k)) {
                // The whole loop goes to the position of its header: the instructions in between in the order lie
                // behind the loop.
                (_, Some(body)) => {
                    places.extend((0..TURNS).flat_map(|turn| body.iter().map(move |k| (*k, turn))));
                    places.push((k, TURNS));
                }
                (Some(_), None) => {}
                (None, None) => places.push((k, 0)),
            }
        }
        let n_of: Mixing<(usize, usize), usize> = places.iter().zip(0..).map(|(place, n)| (*place, n)).collect();
        let target = |(k, turn): (usize, usize), key: Key| {
            let to = at[&key];
            let turn = match around[to] {
                Some(head) if around[k] == Some(head) => turn + usize::from(to == head),
                _ => 0,
            };
            n_of.get(&(to, turn)).copied()
        };
        let targets_of = |place: &(usize, usize)| {
            to[place.0].map(|side| side.and_then(|side| side.map_or(Some(places.len()), |key| target(*place, key))))
        };
        Ok(Ways {
            targets: places.iter().map(targets_of).collect(),
            places: places.iter().map(|&(k, turn)| (keys[k].0, keys[k].1, turn)).collect(),
            calls,
        })
    }

    /// Collects all instructions with the successors without and with a jump (`None` if unknown), and the calls as in
    /// [`Ways`].
    #[allow(clippy::type_complexity)]
    fn instructions(
        &mut self,
        start: u32,
    ) -> Done<(Vec<Key>, Vec<[Option<Option<Key>>; 2]>, Vec<(usize, Option<u32>)>)> {
        let mut calls: Vec<(usize, Option<u32>, usize)> = vec![(0, None, 0)];
        let mut of_call: Mixing<Key, usize> = Mixing::default();
        let mut found: HashSet<Key> = HashSet::from([(start, 0)]);
        let (mut keys, mut to) = (vec![(start, 0)], Vec::new());
        let mut jumps = vec![start];
        while let Some(&(at, call)) = keys.get(to.len()) {
            let targets = match self.program.at(at) {
                Err(_) => [None, None],
                Ok(code) => {
                    let on = Some(Some((code.instruction.next(), call)));
                    let on_if = on.filter(|_| code.instruction.conditional);
                    let flow = code.instruction.flow();
                    jumps.extend(match flow {
                        Flow::Jump(to) | Flow::Call(to) => Some(to),
                        _ => None,
                    });
                    match flow {
                        Flow::Next => [on, None],
                        Flow::Jump(to) => [on_if, Some(Some((to, call)))],
                        Flow::Call(to) => {
                            let back = code.instruction.next();
                            let deeper = *of_call.entry((back, call)).or_insert_with(|| {
                                calls.push((call, Some(back), calls[call].2 + 1));
                                calls.len() - 1
                            });
                            if calls[deeper].2 > DEEP {
                                return Err(format!("nests calls more than {DEEP} deep"));
                            }
                            [None, Some(Some((to, deeper)))]
                        }
                        Flow::Return => [on_if, Some(calls[call].1.map(|back| (back, calls[call].0)))],
                        _ => [None, None],
                    }
                }
            };
            for target in targets.into_iter().flatten().flatten() {
                if found.insert(target) {
                    keys.push(target);
                }
            }
            to.push(targets);
        }
        // The condition of the IT would not apply to such a jump target, but it was decoded with it.
        if let Some(to) = jumps.into_iter().find(|to| self.program.behind_it.contains(to)) {
            return Err(format!("a jump target behind an IT at {}", self.program.image.place(to)));
        }
        Ok((keys, to, calls.into_iter().map(|(from, back, _)| (from, back)).collect()))
    }

    /// Executes one instruction. Returns its successors, and the state without the jump if that state differs. `back`
    /// is the return address of the current call.
    fn execute(
        &mut self,
        code: &Code,
        [on, jump]: [Option<usize>; 2],
        back: Option<u32>,
    ) -> Done<(Next, Option<Rc<State>>)> {
        let instruction = &code.instruction;
        let Word::Address(_, stack) = self.state.registers[SP] else { return Err("unknown stack pointer".into()) };
        self.stack = stack;
        let holds = match (code.stem.as_str(), code.operands.first()) {
            ("cbz" | "cbnz", Some(value)) => {
                let is_zero = match self.get(value)? {
                    Word::Term(value) => {
                        let zero = self.graph.constant(0);
                        self.graph.ordered(Order::Equal, value, zero)
                    }
                    // An address input is never 0.
                    Word::Address(..) => self.graph.truth(false),
                    other => return Err(format!("compares {other:?}")),
                };
                if code.stem == "cbz" { is_zero } else { self.graph.not(is_zero) }
            }
            _ if instruction.condition.is_empty() => self.graph.truth(true),
            _ => self.holds(&Rc::clone(&self.state.flags), &instruction.condition)?,
        };
        let mut other = None;
        match instruction.flow() {
            Flow::Jump(_) => {}
            Flow::Call(_) if self.graph.decided(holds) == Some(true) => {
                let back = self.graph.constant(instruction.next() | 1);
                self.state.registers[LR] = Word::Term(back);
            }
            Flow::Next => self.step_if(holds, code)?,
            Flow::Return if self.graph.decided(holds) == Some(false) => {}
            Flow::Return => {
                other = Some(Rc::new(self.state.clone()));
                self.returns(code, back)?;
            }
            _ => return Err("its target is known only at run time".into()),
        }
        if let Word::Address(_, now) = self.state.registers[SP] {
            // Memory below the stack pointer is arbitrary, because an interrupt may overwrite it.
            let sp = SP as u32;
            let lost: Vec<(u32, i32)> = self.state.memory.range((sp, i32::MIN)..(sp, now)).map(|(at, _)| *at).collect();
            for at in lost {
                self.state.memory.remove(&at);
            }
        }
        let next = match (on, jump, self.graph.decided(holds)) {
            (Some(on), None, _) | (Some(on), _, Some(false)) => Next::One(on),
            (None, Some(to), _) | (_, Some(to), Some(true)) => Next::One(to),
            (Some(on), Some(to), None) if on == to => Next::One(on),
            (Some(on), Some(to), None) => Next::Two(holds, to, on),
            (None, None, _) => return Err("has no successor".into()),
        };
        Ok((next, other))
    }

    fn step_if(&mut self, holds: Node, code: &Code) -> Done<()> {
        let before = match self.graph.decided(holds) {
            Some(true) => None,
            Some(false) => return Ok(()),
            None => Some(Rc::new(self.state.clone())),
        };
        if before.is_some() {
            self.suppose(holds);
        }
        self.step(code)?;
        if let Some(before) = before {
            let after = Rc::new(self.state.clone());
            let gates = [Gate::Leaf(0), Gate::Leaf(1), Gate::Choice(holds, 0, 1)];
            self.state = self.met(&gates, 2, &[&after, &before], &|leaf| leaf);
        }
        Ok(())
    }

    fn returns(&mut self, code: &Code, back: Option<u32>) -> Done<()> {
        let to = if let [Operand::Register(LR)] = code.operands[..] {
            self.state.registers[LR]
        } else {
            self.step(code)?;
            self.state.registers[PC]
        };
        let is_back = match (to, back) {
            (Word::Return, None) => true,
            (Word::Term(to), Some(back)) => self.graph.bits(to).is_some_and(|to| to & !1 == back),
            _ => false,
        };
        if is_back { Ok(()) } else { Err("returns to another address than its caller".into()) }
    }

    /// Reduces selections by a truth that holds on this path.
    fn suppose(&mut self, holds: Node) {
        for k in 0..self.state.registers.len() {
            if let Word::Term(node) = self.state.registers[k] {
                let side = self.graph.where_it_holds(holds, node);
                if side != node {
                    self.state.registers[k] = match self.graph.as_address(side) {
                        Some((base, offset)) if self.bases.contains(&base) => Word::Address(base, offset),
                        _ => Word::Term(side),
                    };
                }
            }
        }
    }

    /// Returns the state at a join of paths.
    fn met(&mut self, gates: &[Gate], last: usize, states: &[&Rc<State>], leaf: &dyn Fn(usize) -> usize) -> State {
        let all_same = |of: &dyn Fn(&State) -> Word| {
            let first = of(states[0]);
            states.iter().all(|state| of(state) == first).then_some(first)
        };
        let mut registers = Vec::new();
        for k in 0..48 {
            registers.push(all_same(&|state| state.registers[k]).unwrap_or_else(|| {
                let of = |n: usize| states[leaf(n)].registers[k];
                folded(gates, last, &of, &mut |t, a, b| self.choice(t, a, b)).unwrap_or(Word::Mixed)
            }));
        }
        let flags = |of: &dyn Fn(&State) -> Rc<Flags>| {
            let first = of(states[0]);
            if states.iter().all(|state| of(state) == first) {
                return first;
            }
            let choice = &mut |t, a: Rc<Flags>, b: Rc<Flags>| if a == b { a } else { Rc::new(Flags::Choice(t, a, b)) };
            folded(gates, last, &|n| of(states[leaf(n)]), choice).unwrap_or(first)
        };
        let (compared, flags) = (flags(&|state| Rc::clone(&state.compared)), flags(&|state| Rc::clone(&state.flags)));
        let mut memory = states[0].memory.clone();
        for state in &states[1..] {
            for (at, byte) in &state.memory {
                memory.entry(*at).or_insert(*byte);
            }
        }
        let mut unwritten: Mixing<(u32, i32), Node> = Mixing::default();
        let mut of_byte = |at: &(u32, i32)| {
            let of = |state: &State| state.memory.get(at).copied();
            let first = of(states[0]);
            if let Some(byte) = first.filter(|_| states.iter().all(|state| of(state) == first)) {
                return byte;
            }
            // Memory without a store on a path holds an arbitrary word there.
            let part = states.iter().find_map(|state| of(state)).map_or(0, |(_, part)| part);
            let any = *unwritten.entry((at.0, at.1 - i32::from(part))).or_insert_with(|| self.graph.anything());
            let of = |n: usize| of(states[leaf(n)]).unwrap_or((Word::Term(any), part));
            let choice = &mut |t, a: (Word, u8), b: (Word, u8)| {
                let [a, b] = if a.1 == b.1 { [a, b] } else { [a, b].map(|byte| (self.byte(byte), 0)) };
                (self.choice(t, a.0, b.0), a.1)
            };
            folded(gates, last, &of, choice).unwrap_or((Word::Mixed, 0))
        };
        for (at, byte) in &mut memory {
            *byte = of_byte(at);
        }
        State { registers, memory, compared, flags }
    }

    fn choice(&mut self, t: Node, a: Word, b: Word) -> Word {
        match (a, b) {
            _ if a == b => a,
            _ => {
                let [a, b] = [a, b].map(|word| match word {
                    Word::Term(node) => node,
                    Word::Address(base, offset) => self.graph.address(base, offset),
                    // Unknown content is an arbitrary number.
                    _ => self.graph.anything(),
                });
                Word::Term(self.graph.select(t, a, b))
            }
        }
    }

    /// Returns a byte as a word.
    fn byte(&mut self, (word, part): (Word, u8)) -> Word {
        let Word::Term(word) = word else { return Word::Mixed };
        let (by, mask) = (self.graph.constant(8 * u32::from(part)), self.graph.constant(0xff));
        let shifted = if part == 0 { word } else { self.graph.two("lsr", word, by) };
        Word::Term(self.graph.two("and", shifted, mask))
    }

    fn returned(&mut self) -> Done<Vec<(String, Node, Node)>> {
        let changed = || "returns with a changed callee-saved register".to_owned();
        if self.state.registers[SP] != Word::Address(SP as u32, 0) {
            return Err(changed());
        }
        let mut equal = Vec::new();
        for k in KEPT.into_iter().flatten() {
            let Word::Term(found) = self.state.registers[k] else { return Err(changed()) };
            equal.push((format!("register {k}"), found, self.graph.entry(k as u32)));
        }
        Ok(equal)
    }

    /// Returns the content of the place of a result.
    pub(super) fn result(&mut self, port: &Port) -> Done<Word> {
        match port.place {
            Place::Register(register) => Ok(self.state.registers[register as usize]),
            Place::Memory(base, offset) => self.load(Word::Address(base, offset), width(port)),
        }
    }

    fn get(&mut self, operand: &Operand) -> Done<Word> {
        match operand {
            Operand::Register(k) => Ok(self.state.registers[*k]),
            Operand::Number(value) => Ok(Word::Term(self.graph.constant(*value))),
            other => Err(format!("operand {other:?} is not supported")),
        }
    }

    fn term(&mut self, operand: &Operand) -> Done<Node> {
        match self.get(operand)? {
            Word::Term(term) => Ok(term),
            other => Err(format!("computes with {other:?}")),
        }
    }

    fn set(&mut self, operand: &Operand, word: Word) -> Done<()> {
        match operand {
            Operand::Register(k) => self.state.registers[*k] = word,
            other => return Err(format!("result {other:?} is not supported")),
        }
        Ok(())
    }

    /// Returns the address of a memory operand and writes back its base if required. `behind` is added after the
    /// access.
    fn address(&mut self, at: u32, operand: &Operand, behind: Option<&Operand>) -> Done<Word> {
        let Operand::Memory { base, index, offset, writes } = operand else {
            return Err(format!("address {operand:?} is not supported"));
        };
        let start =
            if *base == PC { Word::Term(self.graph.constant((at + 4) & !3)) } else { self.state.registers[*base] };
        let indexed = match index {
            None => self.graph.constant(*offset as u32),
            Some((index, by)) => {
                let Word::Term(index) = self.state.registers[*index] else {
                    return Err("an index register holds an address".into());
                };
                self.graph.shifted_left(index, *by)
            }
        };
        let moved = self.moved(start, indexed, 1)?;
        if let Some(behind) = behind {
            let behind = self.term(behind)?;
            self.state.registers[*base] = self.moved(start, behind, 1)?;
            return Ok(start);
        }
        if *writes {
            self.state.registers[*base] = moved;
        }
        Ok(moved)
    }

    /// Returns `start + factor by`, also for addresses.
    fn moved(&mut self, start: Word, by: Node, factor: u32) -> Done<Word> {
        match (start, self.graph.bits(by)) {
            (Word::Term(start), _) => Ok(Word::Term(self.graph.plus(start, by, factor))),
            (Word::Address(base, offset), Some(by)) => {
                Ok(Word::Address(base, offset.wrapping_add(by.wrapping_mul(factor) as i32)))
            }
            (Word::OneOf(t, base, offsets), Some(by)) => {
                let by = by.wrapping_mul(factor) as i32;
                Ok(Word::OneOf(t, base, offsets.map(|offset| offset.wrapping_add(by))))
            }
            (Word::Address(base, offset), None) if let Op::Select(t, yes, no) = self.graph.ops[by] => {
                let [Some(yes), Some(no)] = [yes, no].map(|by| self.graph.bits(by)) else {
                    return Err("an address known only at run time".into());
                };
                let there = [yes, no].map(|by| offset.wrapping_add(by.wrapping_mul(factor) as i32));
                Ok(Word::OneOf(t, base, there))
            }
            _ => Err("an address known only at run time".into()),
        }
    }

    fn load(&mut self, address: Word, width: u8) -> Done<Word> {
        if let Word::OneOf(t, base, offsets) = address {
            let [yes, no] = offsets.map(|offset| self.load(Word::Address(base, offset), width));
            return Ok(self.choice(t, yes?, no?));
        }
        let at = |graph: &Graph| match address {
            Word::Term(term) => graph.bits(term),
            _ => None,
        };
        if let Some(at) = at(self.graph) {
            let bytes = self.program.image.constant_bytes(at, width.into());
            let bytes = bytes.ok_or_else(|| format!("reads {at:#010x}, where the file has no constant"))?;
            let value = bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte));
            return Ok(Word::Term(self.graph.constant(value)));
        }
        let Word::Address(base, offset) = address else {
            return Err("reads an address known only at run time".into());
        };
        if base == SP as u32 && offset < self.stack {
            return Err("reads below the stack pointer".into());
        }
        let mut bytes = [(address, 0); 4];
        let bytes = &mut bytes[..usize::from(width)];
        // The function's own stack is arbitrary before its first store.
        let is_own = base == SP as u32 && offset + i32::from(width) <= 0;
        if is_own && width == 4 && (0..4).all(|part| !self.state.memory.contains_key(&(base, offset + part))) {
            return Ok(Word::Term(self.graph.anything()));
        }
        for (byte, part) in bytes.iter_mut().zip(0..) {
            *byte = match self.state.memory.get(&(base, offset + part)) {
                Some(byte) => *byte,
                None if is_own => (Word::Term(self.graph.anything()), 0),
                None => return Err(format!("reads {}, whose content is unknown", shown(base, offset + part))),
            };
        }
        let first = bytes[0].0;
        if width == 4 && bytes.iter().zip(0..).all(|((word, part), k)| *word == first && *part == k) {
            return Ok(first);
        }
        let mut value = self.graph.constant(0);
        for (&mut byte, place) in bytes.iter_mut().zip(0..) {
            let Word::Term(part) = self.byte(byte) else {
                return Err(format!("reads a part of an address at {}", shown(base, offset)));
            };
            let part = self.graph.shifted_left(part, 8 * place);
            value = self.graph.plus(part, value, 1);
        }
        Ok(Word::Term(value))
    }

    fn store(&mut self, address: Word, word: Word, width: u8) -> Done<()> {
        if let Word::OneOf(t, base, [yes, no]) = address {
            if yes.abs_diff(no) < width.into() {
                return Err("writes one of two overlapping places".into());
            }
            let [at_yes, at_no] = [yes, no].map(|offset| Word::Address(base, offset));
            let [before, other] = [self.load(at_yes, width)?, self.load(at_no, width)?];
            let [here, there] = [self.choice(t, word, before), self.choice(t, other, word)];
            self.store(at_yes, here, width)?;
            return self.store(at_no, there, width);
        }
        let Word::Address(base, offset) = address else { return Err("writes to an unknown address".into()) };
        for part in 0..width {
            let to = (base, offset + i32::from(part));
            // Memory above the stack pointer at the entry belongs to the caller.
            if (base != SP as u32 || to.1 >= 0) && !self.may_write(base, to.1) {
                return Err(format!("writes {}, which is not a result", shown(base, to.1)));
            }
            self.state.memory.insert(to, (word, part));
        }
        Ok(())
    }

    fn may_write(&self, base: u32, offset: i32) -> bool {
        let holds = |place: &Place, length: i32| match *place {
            Place::Memory(of, from) => of == base && (from..from + length).contains(&offset),
            Place::Register(_) => false,
        };
        self.expected.outs.iter().any(|port| holds(&port.place, width(port).into()))
            || self.expected.pads.iter().any(|(place, length)| holds(place, *length as i32))
    }

    /// Returns the truth of a condition.
    fn holds(&mut self, flags: &Flags, condition: &str) -> Done<Node> {
        let zero = self.graph.constant(0);
        match *flags {
            Flags::Floats(a, b) => {
                let set = of_floats(condition).ok_or_else(|| format!("condition {condition} is not supported"))?;
                Ok(self.graph.stands(a, set, b))
            }
            Flags::Result(a) => {
                let order = match condition {
                    "eq" | "ne" => Order::Equal,
                    "mi" | "pl" => Order::Less,
                    _ => return Err(format!("condition {condition} of unknown flags")),
                };
                let holds = self.graph.ordered(order, a, zero);
                Ok(if ["eq", "mi"].contains(&condition) { holds } else { self.graph.not(holds) })
            }
            // Sign of the difference, which may have wrapped.
            Flags::Counts(a, b) if ["mi", "pl"].contains(&condition) => {
                let difference = self.graph.plus(a, b, u32::MAX);
                let holds = self.graph.ordered(Order::Less, difference, zero);
                Ok(if condition == "mi" { holds } else { self.graph.not(holds) })
            }
            Flags::Counts(..) | Flags::Known(..) => {
                let (order, turned, holds) =
                    of_counts(condition).ok_or_else(|| format!("condition {condition} of a comparison of counts"))?;
                let is = match *flags {
                    Flags::Counts(a, b) if turned => self.graph.ordered(order, b, a),
                    Flags::Counts(a, b) => self.graph.ordered(order, a, b),
                    Flags::Known(equal, less, below) => {
                        let below = if order == Order::Less { less } else { below };
                        self.graph.truth(match (order, turned) {
                            (Order::Equal, _) => equal,
                            (_, true) => !below && !equal,
                            (_, false) => below,
                        })
                    }
                    _ => return Err("flags that no instruction has set".into()),
                };
                Ok(if holds { is } else { self.graph.not(is) })
            }
            Flags::Choice(t, ref a, ref b) => {
                let (a, b) = (self.holds(a, condition)?, self.holds(b, condition)?);
                Ok(self.graph.select(t, a, b))
            }
            Flags::Unknown => Err("flags that no instruction has set".into()),
        }
    }

    /// Executes one instruction that continues at the next.
    fn step(&mut self, code: &Code) -> Done<()> {
        let Code { instruction, operands, .. } = code;
        let stem = code.stem.as_str();
        if instruction.name.contains(".f64") || instruction.name.contains(".f16") {
            return Err("only floats of 32 bits are supported".into());
        }
        match (stem, &operands[..]) {
            ("nop" | "it" | "itt" | "ite" | "ittt" | "itte" | "itet" | "itee", _) => {}
            (it, _) if it.starts_with("it") && it.len() == 5 => {}
            ("dmb" | "dsb" | "isb", _) => {}
            ("vcmp" | "vcmpe", [a, b]) => {
                self.state.compared = Rc::new(Flags::Floats(self.term(a)?, self.term(b)?));
            }
            // VMRS to the flags, not to a register.
            ("vmrs", [Operand::Other, _]) => self.state.flags = Rc::clone(&self.state.compared),
            _ if self.float(instruction, stem, operands)? || self.moves(instruction, stem, code)? => {}
            _ => self.count(instruction, stem, operands)?,
        }
        Ok(())
    }

    /// Executes float arithmetic and moves between float registers; returns false for another instruction.
    fn float(&mut self, instruction: &Instruction, stem: &str, operands: &[Operand]) -> Done<bool> {
        let result = match (stem, operands) {
            ("vmov", [to, from]) => {
                let word = self.get(from)?;
                self.set(to, word)?;
                return Ok(true);
            }
            ("vmov", [a, b, c, d]) => {
                let (c, d) = (self.get(c)?, self.get(d)?);
                self.set(a, c)?;
                self.set(b, d)?;
                return Ok(true);
            }
            ("vneg", [_, a]) => {
                let a = self.term(a)?;
                self.graph.neg(a)
            }
            ("vabs", [_, a]) => {
                let a = self.term(a)?;
                self.graph.one("abs", a)
            }
            ("vcvt", [_, a]) => {
                let a = self.term(a)?;
                match instruction.name.as_str() {
                    "vcvt.f32.s32" => self.graph.one("number_of", a),
                    "vcvt.f32.u32" => self.graph.one("number_without_sign_of", a),
                    _ => return Err("is not supported".into()),
                }
            }
            ("vadd" | "vsub" | "vmul" | "vdiv" | "vnmul" | "vmla" | "vmls" | "vnmla" | "vnmls", [to, rest @ ..]) => {
                let (a, b) = match rest {
                    [b] => (self.term(to)?, self.term(b)?),
                    [a, b] => (self.term(a)?, self.term(b)?),
                    _ => return Err("is not supported".into()),
                };
                let graph = &mut *self.graph;
                match stem {
                    "vadd" => graph.add(a, b),
                    "vsub" => graph.sub(a, b),
                    "vdiv" => graph.two("div", a, b),
                    _ => {
                        let product = graph.mul(a, b);
                        let turned = matches!(stem, "vnmul" | "vmls" | "vnmla");
                        let product = if turned { graph.neg(product) } else { product };
                        if matches!(stem, "vmul" | "vnmul") {
                            product
                        } else {
                            // VMLA rounds the product before the addition, unlike VFMA.
                            let sum = self.term(to)?;
                            let graph = &mut *self.graph;
                            let sum = if stem.starts_with("vn") { graph.neg(sum) } else { sum };
                            graph.add(sum, product)
                        }
                    }
                }
            }
            _ => return Ok(false),
        };
        self.set(&operands[0], Word::Term(result))?;
        Ok(true)
    }

    /// Executes loads and stores; returns false for another instruction.
    fn moves(&mut self, instruction: &Instruction, stem: &str, code: &Code) -> Done<bool> {
        let operands = &code.operands[..];
        let at = instruction.address;
        let many = |list: &Operand| match list {
            Operand::List(list) => Ok(list.clone()),
            other => Err(format!("list {other:?} is not supported")),
        };
        let single = |stem: &str| match stem {
            "ldr" | "str" | "vldr" | "vstr" => Some(4),
            "ldrb" | "strb" => Some(1),
            "ldrh" | "strh" => Some(2),
            _ => None,
        };
        if let (Some(width), [value, memory, behind @ ..]) = (single(stem), operands) {
            let address = self.address(at, memory, behind.first())?;
            if stem.starts_with('v') {
                self.of_words(address)?;
            }
            if stem.contains("ld") {
                let word = self.load(address, width)?;
                self.set(value, word)?;
            } else {
                let word = self.get(value)?;
                self.store(address, word, width)?;
            }
            return Ok(true);
        }
        match (stem, operands) {
            ("ldrd" | "strd", [a, b, memory, behind @ ..]) => {
                let low = self.address(at, memory, behind.first())?;
                self.of_words(low)?;
                let four = self.graph.constant(4);
                let high = self.moved(low, four, 1)?;
                if stem == "ldrd" {
                    let (one, other) = (self.load(low, 4)?, self.load(high, 4)?);
                    self.set(a, one)?;
                    self.set(b, other)?;
                } else {
                    let (one, other) = (self.get(a)?, self.get(b)?);
                    self.store(low, one, 4)?;
                    self.store(high, other, 4)?;
                }
            }
            ("push" | "vpush", [list]) => self.store_many(SP, &many(list)?, true, true)?,
            ("pop" | "vpop", [list]) => self.load_many(SP, &many(list)?, false, true)?,
            ("stmdb" | "vstmdb", [Operand::Register(base), list]) => {
                self.store_many(*base, &many(list)?, true, code.writes_base)?;
            }
            ("stm" | "stmia" | "vstmia", [Operand::Register(base), list]) => {
                self.store_many(*base, &many(list)?, false, code.writes_base)?;
            }
            ("ldm" | "ldmia" | "vldmia", [Operand::Register(base), list]) => {
                self.load_many(*base, &many(list)?, false, code.writes_base)?;
            }
            ("ldmdb" | "vldmdb", [Operand::Register(base), list]) => {
                self.load_many(*base, &many(list)?, true, code.writes_base)?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Rejects unaligned accesses of several words or of floats: they fault.
    fn of_words(&self, address: Word) -> Done<()> {
        let is_off = match address {
            Word::Address(_, offset) => offset % 4 != 0,
            Word::OneOf(.., offsets) => offsets.iter().any(|offset| offset % 4 != 0),
            Word::Term(term) => self.graph.bits(term).is_some_and(|at| at % 4 != 0),
            _ => false,
        };
        if is_off { Err("an address that is not a multiple of 4: a fault".into()) } else { Ok(()) }
    }

    /// Returns the first address of a register list, and moves the base past the list.
    fn list(&mut self, base: usize, list: &[usize], down: bool, writes: bool) -> Done<Word> {
        let (start, length) = (self.state.registers[base], self.graph.constant(4 * list.len() as u32));
        let end = self.moved(start, length, if down { u32::MAX } else { 1 })?;
        self.of_words(start)?;
        if writes {
            self.state.registers[base] = end;
        }
        Ok(if down { end } else { start })
    }

    fn store_many(&mut self, base: usize, list: &[usize], down: bool, writes: bool) -> Done<()> {
        if writes && list.contains(&base) {
            return Err("stores its own base".into());
        }
        let mut to = self.list(base, list, down, writes)?;
        for k in list {
            self.store(to, self.state.registers[*k], 4)?;
            let four = self.graph.constant(4);
            to = self.moved(to, four, 1)?;
        }
        Ok(())
    }

    fn load_many(&mut self, base: usize, list: &[usize], down: bool, writes: bool) -> Done<()> {
        let mut from = self.list(base, list, down, writes)?;
        for k in list {
            let word = self.load(from, 4)?;
            self.state.registers[*k] = word;
            let four = self.graph.constant(4);
            from = self.moved(from, four, 1)?;
        }
        Ok(())
    }

    /// Executes operations on counts and addresses.
    fn count(&mut self, instruction: &Instruction, stem: &str, operands: &[Operand]) -> Done<()> {
        const SETTING: [&str; 13] =
            ["add", "sub", "rsb", "mov", "mvn", "and", "orr", "eor", "bic", "lsl", "lsr", "asr", "mul"];
        let (stem, sets) = match stem.strip_suffix('s').filter(|stem| SETTING.contains(stem)) {
            Some(stem) => (stem, true),
            None if stem == "negs" => ("neg", true),
            None => (stem.strip_suffix('w').filter(|stem| ["add", "sub", "mov"].contains(stem)).unwrap_or(stem), false),
        };
        // `add r0, r1` is `add r0, r0, r1`.
        let of_two =
            ["add", "sub", "rsb", "and", "orr", "orn", "eor", "bic", "lsl", "lsr", "asr", "mul"].contains(&stem);
        let mut operands = operands.to_vec();
        if of_two && operands.get(2).is_none_or(|third| matches!(third, Operand::Shift(..))) {
            operands.insert(1, operands.first().cloned().ok_or("no operand")?);
        }
        let shift = match operands.last() {
            Some(Operand::Shift(shift, by)) => Some((*shift, *by)),
            _ => None,
        };
        operands.truncate(operands.len() - usize::from(shift.is_some()));
        let (to, from) = operands.split_first().ok_or("no operand")?;
        // A comparison has no destination.
        let compares = ["cmp", "cmn", "tst"].contains(&stem);
        let mut values = Vec::new();
        for one in if compares { &operands[..] } else { from } {
            values.push(match one {
                Operand::Register(PC) => Word::Term(self.graph.constant((instruction.address + 4) & !3)),
                _ => self.get(one)?,
            });
        }
        if let Some((shift, by)) = shift {
            let Some(Word::Term(last)) = values.pop() else { return Err("shifts an address".into()) };
            let by = self.graph.constant(by);
            values.push(Word::Term(self.shifted(shift, last, by)?));
        }
        // These instructions keep the rest of the register.
        if ["movt", "bfi"].contains(&stem) {
            values.insert(0, self.get(to)?);
        }
        let (result, flags) = self.counted(stem, &values)?;
        if compares || sets {
            self.state.flags = Rc::new(flags);
        }
        if compares { Ok(()) } else { self.set(to, result) }
    }

    fn shifted(&mut self, shift: &str, a: Node, by: Node) -> Done<Node> {
        let graph = &mut *self.graph;
        match (shift, graph.bits(by).map(|by| by & 0xff)) {
            ("lsl", Some(by)) => Ok(graph.shifted_left(a, by)),
            // A left shift followed by a right shift: the low bits, as in the specification.
            ("asr", Some(by @ 1..=31)) => Ok(match graph.ops[a] {
                Op::Plus(none, inner, factor) if graph.bits(none) == Some(0) && factor == 1 << by => {
                    graph.low_bits(inner, 32 - by)
                }
                _ => graph.shifted_right(a, by),
            }),
            ("asr", Some(by)) => Ok(graph.shifted_right(a, by)),
            ("lsr", Some(by)) => {
                let by = graph.constant(by);
                Ok(self.graph.two("lsr", a, by))
            }
            _ => Err("an unsupported shift".into()),
        }
    }

    /// Returns an address as a number.
    fn number(&mut self, word: Word) -> Done<Node> {
        match word {
            Word::Term(node) => Ok(node),
            Word::Address(base, offset) => Ok(self.graph.address(base, offset)),
            other => Err(format!("compares {other:?}")),
        }
    }

    /// Returns whether an address lies in the memory behind a register, or at its end. Addresses are ordered there,
    /// because no memory wraps around the highest address.
    fn is_within(&self, word: Word) -> bool {
        let Word::Address(base, offset) = word else { return false };
        if base == SP as u32 {
            return (self.stack..=0).contains(&offset);
        }
        self.expected.sizes.iter().any(|(of, size)| *of == base && (0..=*size as i32).contains(&offset))
    }

    /// Computes an operation on addresses: the result and its flags; `None` for an operation without addresses.
    fn addressed(&mut self, stem: &str, values: &[Word]) -> Done<Option<(Word, Flags)>> {
        let is_within = values.iter().all(|word| self.is_within(*word));
        let zero = Word::Term(self.graph.constant(0));
        let known = |word: &Word| match word {
            Word::Term(term) => self.graph.bits(*term),
            _ => None,
        };
        Ok(Some(match (stem, values) {
            // An address input is never 0.
            ("cmp", [Word::Address(..), none]) if known(none) == Some(0) => (zero, Flags::Known(false, false, false)),
            // The address is a multiple of 4.
            ("and" | "tst", [address, mask]) if is_aligned(address) && known(mask).is_some_and(|mask| mask <= 3) => {
                (zero, Flags::Result(self.graph.constant(0)))
            }
            ("lsl", [address, by]) if is_aligned(address) && known(by) == Some(30) => {
                (zero, Flags::Result(self.graph.constant(0)))
            }
            ("orr", [one, other]) if is_aligned(one) && is_aligned(other) => (Word::Aligned, Flags::Unknown),
            ("cmp" | "sub", &[Word::Address(base, one), Word::Address(of_other, other)])
                if base == of_other && is_within =>
            {
                let difference = self.graph.constant(one.wrapping_sub(other) as u32);
                (Word::Term(difference), Flags::Known(one == other, one < other, one < other))
            }
            ("cmp" | "sub", [one @ Word::Address(..), other @ Word::Address(..)]) => {
                let (a, b) = (self.number(*one)?, self.number(*other)?);
                (Word::Term(self.graph.plus(a, b, u32::MAX)), Flags::Counts(a, b))
            }
            ("cmp", [Word::Address(..), Word::Term(_)] | [Word::Term(_), Word::Address(..)]) => {
                let (a, b) = (self.number(values[0])?, self.number(values[1])?);
                (values[1], Flags::Counts(a, b))
            }
            ("add" | "sub", [start @ Word::Address(..), Word::Term(by)]) => {
                (self.moved(*start, *by, if stem == "add" { 1 } else { u32::MAX })?, Flags::Unknown)
            }
            // `movs r0, #44`, `add r0, ip`.
            ("add", [Word::Term(by), start @ Word::Address(..)]) => (self.moved(*start, *by, 1)?, Flags::Unknown),
            _ => return Ok(None),
        }))
    }

    /// Computes an operation on counts: the result and its flags.
    fn counted(&mut self, stem: &str, values: &[Word]) -> Done<(Word, Flags)> {
        if let Some(done) = self.addressed(stem, values)? {
            return Ok(done);
        }
        let graph = &mut *self.graph;
        let known = |graph: &Graph, word: &Word| match word {
            Word::Term(term) => graph.bits(*term),
            _ => None,
        };
        let (result, flags) = match (stem, values) {
            ("mov", [from]) => match *from {
                Word::Term(term) => (*from, Flags::Result(term)),
                _ => (*from, Flags::Unknown),
            },
            (_, [Word::Term(a)]) => {
                let (result, flags) = self.of_one(stem, *a)?;
                (Word::Term(result), flags)
            }
            (_, [Word::Term(a), Word::Term(b)]) => {
                let (result, flags) = self.of_two(stem, *a, *b)?;
                (Word::Term(result), flags)
            }
            ("mla" | "mls", [Word::Term(a), Word::Term(b), Word::Term(to)]) => {
                let product = graph.two("times", *a, *b);
                let result = graph.plus(*to, product, if stem == "mla" { 1 } else { u32::MAX });
                (Word::Term(result), Flags::Unknown)
            }
            ("ubfx", [Word::Term(a), Word::Term(from), width]) => {
                let mask = match known(graph, width) {
                    Some(width @ 1..=31) => graph.constant((1 << width) - 1),
                    _ => return Err("is not supported".into()),
                };
                let at = graph.bits(*from).filter(|from| *from < 32).ok_or("is not supported")?;
                let a = graph.below_mask(*a, graph.bits(mask).unwrap_or(0) << at);
                let shifted = graph.two("lsr", a, *from);
                let result = graph.two("and", shifted, mask);
                (Word::Term(result), Flags::Unknown)
            }
            ("bfi", [Word::Term(to), Word::Term(from), at, width]) => {
                let mask = match (known(graph, at), known(graph, width)) {
                    (Some(at @ 0..=31), Some(width @ 1..=31)) if at + width <= 32 => ((1 << width) - 1) << at,
                    _ => return Err("is not supported".into()),
                };
                let at = u32::trailing_zeros(mask);
                let (put, kept) = (graph.constant(mask >> at), graph.constant(!mask));
                let low = graph.two("and", *from, put);
                let (put, kept) = (graph.shifted_left(low, at), graph.two("and", *to, kept));
                (Word::Term(graph.plus(kept, put, 1)), Flags::Unknown)
            }
            ("sbfx", [Word::Term(a), from, width]) => match (known(graph, from), known(graph, width)) {
                (Some(0), Some(width @ 1..=32)) => (Word::Term(graph.low_bits(*a, width)), Flags::Unknown),
                _ => return Err("is not supported".into()),
            },
            _ => return Err("is not supported".into()),
        };
        Ok((result, flags))
    }

    fn of_one(&mut self, stem: &str, a: Node) -> Done<(Node, Flags)> {
        let graph = &mut *self.graph;
        let zero = graph.constant(0);
        let result = match stem {
            "neg" => return Ok((graph.plus(zero, a, u32::MAX), Flags::Counts(zero, a))),
            "mvn" => graph.others(a),
            "uxtb" | "uxth" => {
                let mask = graph.constant(if stem == "uxtb" { 0xff } else { 0xffff });
                graph.two("and", a, mask)
            }
            "sxtb" => graph.low_bits(a, 8),
            "sxth" => graph.low_bits(a, 16),
            _ => return Err("is not supported".into()),
        };
        Ok((result, Flags::Result(result)))
    }

    fn of_two(&mut self, stem: &str, a: Node, b: Node) -> Done<(Node, Flags)> {
        let graph = &mut *self.graph;
        let result = match stem {
            "cmp" | "sub" => return Ok((graph.plus(a, b, u32::MAX), Flags::Counts(a, b))),
            "rsb" => return Ok((graph.plus(b, a, u32::MAX), Flags::Counts(b, a))),
            "cmn" => {
                // For 0 and for the least number, carry and overflow of an addition differ from the flags of the
                // comparison.
                let of = graph.bits(b).filter(|b| *b != 0 && *b != 1 << 31);
                let result = graph.plus(a, b, 1);
                let flags = of.map(|b| Flags::Counts(a, graph.constant(b.wrapping_neg())));
                return Ok((result, flags.unwrap_or(Flags::Result(result))));
            }
            "add" => graph.plus(a, b, 1),
            "and" | "tst" => graph.two("and", a, b),
            "orr" => graph.two("orr", a, b),
            "orn" => {
                let others = graph.others(b);
                graph.two("orr", a, others)
            }
            "eor" => graph.two("eor", a, b),
            "mul" => graph.two("times", a, b),
            "sdiv" => graph.two("quotient", a, b),
            "bic" => {
                let mask = graph.others(b);
                graph.two("and", a, mask)
            }
            "movt" => {
                let (low, high) = (graph.low_half(a), graph.shifted_left(b, 16));
                graph.plus(high, low, 1)
            }
            "lsl" | "lsr" | "asr" => self.shifted(stem, a, b)?,
            _ => return Err("is not supported".into()),
        };
        Ok((result, Flags::Result(result)))
    }
}

/// Returns the relations for which a condition holds after a float comparison.
fn of_floats(condition: &str) -> Option<u8> {
    Some(match condition {
        "eq" => EQUAL,
        "ne" => LESS | GREATER | UNORDERED,
        "mi" | "lo" => LESS,
        "pl" | "hs" => EQUAL | GREATER | UNORDERED,
        "gt" => GREATER,
        "ge" => GREATER | EQUAL,
        "lt" => LESS | UNORDERED,
        "le" => LESS | EQUAL | UNORDERED,
        "hi" => GREATER | UNORDERED,
        "ls" => LESS | EQUAL,
        "vs" => UNORDERED,
        "vc" => LESS | EQUAL | GREATER,
        _ => return None,
    })
}

/// Returns the order that a condition tests, whether the operands are swapped, and whether the order must hold.
fn of_counts(condition: &str) -> Option<(Order, bool, bool)> {
    Some(match condition {
        "eq" => (Order::Equal, false, true),
        "ne" => (Order::Equal, false, false),
        "lt" => (Order::Less, false, true),
        "ge" => (Order::Less, false, false),
        "gt" => (Order::Less, true, true),
        "le" => (Order::Less, true, false),
        "lo" => (Order::Below, false, true),
        "hs" => (Order::Below, false, false),
        "hi" => (Order::Below, true, true),
        "ls" => (Order::Below, true, false),
        _ => return None,
    })
}

/// Returns whether the lowest two bits of an address are 0.
fn is_aligned(word: &Word) -> bool {
    matches!(word, Word::Aligned) || matches!(word, Word::Address(_, offset) if offset % 4 == 0)
}

/// Returns the size of a value in memory, bytes: a truth alone has one byte, bits share a halfword.
fn width(port: &Port) -> u8 {
    match (port.kind, port.bit) {
        (ValueKind::Truth, None) => 1,
        (ValueKind::Truth, Some(_)) => 2,
        _ => 4,
    }
}

fn shown(base: u32, offset: i32) -> String {
    let name = if base == SP as u32 { "sp".into() } else { format!("r{base}") };
    format!("{name}{offset:+}")
}
