//! A function executed instruction by instruction on terms instead of numbers, along one path.
//!
//! Memory is bytes in regions: one for each address that the function is given, and the stack. A byte knows the word
//! that was stored and which byte of it it is, so what is loaded is what was stored, or numbers that are known.

use std::rc::Rc;

use super::term::{EQUAL, GREATER, LESS, Mixing, Order, Path, Term, Terms, UNORDERED};
use super::text::{Expected, Kind, Known, Place, Port};
use crate::image::Image;
use crate::instruction::{Decoder, Instruction, immediate, listed, register};

const SP: usize = 13;
const LR: usize = 14;
const PC: usize = 15;
const FLOATS: usize = 16;
/// Longer than any path of code without endless loops.
const STEPS: usize = 100_000;

/// What 32 bits of the machine are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Word {
    Term(Term),
    /// An address: behind what this register held at the entry.
    Address(u32, i32),
    /// An input that is true or false and is not read yet.
    Truth(usize),
    /// Bits of several addresses, of which the lowest two are 0.
    Aligned,
    /// Where the function is to return to.
    Return,
}

/// What the last comparison was, or what the flags were set by.
#[derive(Clone, Copy)]
enum Flags {
    Unknown,
    Floats(Term, Term),
    Counts(Term, Term),
    /// Known: equal, below in two's complement, below without signs.
    Known(bool, bool, bool),
    /// N and Z of this; C and V are not known.
    Result(Term),
}

#[derive(Clone, Debug)]
enum Operand {
    Register(usize),
    Number(u32),
    List(Vec<usize>),
    /// Base, index and its shift, offset.
    Memory {
        base: usize,
        index: Option<(usize, u32)>,
        offset: i32,
        writes: bool,
    },
    /// `lsl #2` behind a register.
    Shift(&'static str, u32),
    /// What is not followed.
    Other,
}

#[derive(Clone, Debug)]
struct Code {
    instruction: Instruction,
    stem: String,
    operands: Vec<Operand>,
    /// The base of LDM and STM is written.
    writes_base: bool,
}

/// The code of an image, decoded where it is executed.
pub(super) struct Program<'a> {
    image: &'a Image,
    decoder: Decoder,
    code: Mixing<u32, Rc<Code>>,
}

impl<'a> Program<'a> {
    pub(super) fn new(image: &'a Image, decoder: Decoder) -> Self {
        Self { image, decoder, code: Mixing::default() }
    }

    /// Instructions that some path has executed.
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
        self.code.extend(block.into_iter().map(|one| (one.address, Rc::new(Code::of(one)))));
        Ok(Rc::clone(&self.code[&address]))
    }
}

impl Code {
    fn of(instruction: Instruction) -> Self {
        let writes_base = instruction.operands.first().is_some_and(|one| one.ends_with('!'));
        let mut operands: Vec<Operand> = instruction.operands.iter().map(|text| operand(text)).collect();
        // [r0], #4: the offset is added behind the access.
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
        // As the manual writes it.
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

/// The machine on its way.
pub(super) struct Machine<'p, 'i, 'c, 'x> {
    program: &'p mut Program<'i>,
    pub(super) path: Path<'c>,
    expected: &'x Expected,
    registers: Vec<Word>,
    memory: Mixing<(u32, i32), (Word, u8)>,
    /// Of the floats, before VMRS; then of all.
    compared: Flags,
    flags: Flags,
    /// The stack pointer before the instruction: an interrupt may write below.
    stack: i32,
}

/// Registers that a function leaves as they were (AAPCS), without the stack pointer.
const KEPT: [std::ops::RangeInclusive<usize>; 2] = [4..=11, FLOATS + 16..=FLOATS + 31];

type Done<T> = Result<T, String>;

impl<'p, 'i, 'c, 'x> Machine<'p, 'i, 'c, 'x> {
    pub(super) fn new(program: &'p mut Program<'i>, path: Path<'c>, expected: &'x Expected) -> Self {
        let mut machine = Self {
            program,
            path,
            expected,
            registers: Vec::new(),
            memory: Mixing::default(),
            compared: Flags::Unknown,
            flags: Flags::Unknown,
            stack: 0,
        };
        for k in 0..48 {
            let entry = machine.path.terms.entry(k);
            machine.registers.push(Word::Term(entry));
        }
        machine.registers[SP] = Word::Address(SP as u32, 0);
        machine.registers[LR] = Word::Return;
        for (k, port) in expected.inputs.iter().enumerate() {
            let word = match port.kind {
                Kind::Number | Kind::Count => Word::Term(machine.path.terms.input(k)),
                Kind::Truth | Kind::Either(..) => Word::Truth(k),
            };
            machine.begin_with(port.place, word, width(port));
        }
        for (place, value) in &expected.known {
            let value = match *value {
                Known::Bits(bits) => Word::Term(machine.path.terms.constant(bits)),
                Known::Address(register) => {
                    machine.registers[register as usize] = Word::Address(register, 0);
                    Word::Address(register, 0)
                }
            };
            machine.begin_with(*place, value, 4);
        }
        for (k, &(base, size)) in expected.sizes.iter().enumerate() {
            machine.registers[base as usize] = Word::Address(base, 0);
            for &(other, of_other) in &expected.sizes[..k] {
                let (one, two) = (machine.path.terms.entry(base), machine.path.terms.entry(other));
                machine.path.are_apart(one, size, two, of_other);
            }
        }
        for port in &expected.outs {
            if let Place::Memory(base, _) = port.place {
                machine.registers[base as usize] = Word::Address(base, 0);
            }
        }
        machine
    }

    fn begin_with(&mut self, place: Place, word: Word, width: u8) {
        match place {
            Place::Register(register) => self.registers[register as usize] = word,
            Place::Memory(base, offset) => {
                self.registers[base as usize] = Word::Address(base, 0);
                for part in 0..width {
                    self.memory.insert((base, offset + i32::from(part)), (word, part));
                }
            }
        }
    }

    /// Executes from `start` to the return.
    pub(super) fn run(&mut self, start: u32) -> Done<()> {
        let mut at = start;
        for _ in 0..STEPS {
            let code = self.program.at(at)?;
            let place = |machine: &Self, reason: String| {
                let text = code.instruction.text();
                format!("`{text}` at {}: {reason}", machine.program.image.place(code.instruction.address))
            };
            let next = code.instruction.next();
            at = match self.step(&code).map_err(|reason| place(self, reason))? {
                None => next,
                Some(Word::Return) => return self.returned(),
                Some(Word::Term(to)) => match self.path.terms.bits(to) {
                    Some(to) => to & !1,
                    None => return Err(place(self, "jumps to where only the running program knows".into())),
                },
                Some(_) => return Err(place(self, "jumps into data".into())),
            };
        }
        Err(format!("a path has more than {STEPS} instructions"))
    }

    fn returned(&mut self) -> Done<()> {
        let kept = KEPT.into_iter().flatten().all(|k| {
            let entry = self.path.terms.entry(k as u32);
            self.registers[k] == Word::Term(entry)
        });
        match self.registers[SP] {
            Word::Address(13, 0) if kept => Ok(()),
            _ => Err("returns with a register changed that a function leaves as it was".into()),
        }
    }

    /// What stands in the place of a result.
    pub(super) fn result(&mut self, port: &Port) -> Done<Word> {
        match port.place {
            Place::Register(register) => Ok(self.registers[register as usize]),
            Place::Memory(base, offset) => self.load(Word::Address(base, offset), width(port)),
        }
    }

    fn get(&mut self, operand: &Operand) -> Done<Word> {
        match operand {
            Operand::Register(k) => Ok(self.registers[*k]),
            Operand::Number(value) => Ok(Word::Term(self.path.terms.constant(*value))),
            other => Err(format!("operand {other:?} is not followed")),
        }
    }

    fn term(&mut self, operand: &Operand) -> Done<Term> {
        match self.get(operand)? {
            Word::Term(term) => Ok(term),
            other => Err(format!("computes with {other:?}")),
        }
    }

    fn set(&mut self, operand: &Operand, word: Word) -> Done<()> {
        match operand {
            Operand::Register(k) => self.registers[*k] = word,
            other => return Err(format!("result {other:?} is not followed")),
        }
        Ok(())
    }

    /// An address in memory; the base is written if the instruction says so. `behind` is added after the access.
    fn address(&mut self, at: u32, operand: &Operand, behind: Option<&Operand>) -> Done<Word> {
        let Operand::Memory { base, index, offset, writes } = operand else {
            return Err(format!("address {operand:?} is not followed"));
        };
        let start =
            if *base == PC { Word::Term(self.path.terms.constant((at + 4) & !3)) } else { self.registers[*base] };
        let indexed = match index {
            None => self.path.terms.constant(*offset as u32),
            Some((index, by)) => {
                let Word::Term(index) = self.registers[*index] else { return Err("an index is an address".into()) };
                self.path.terms.shifted_left(index, *by)
            }
        };
        let moved = self.moved(start, indexed, 1)?;
        if let Some(behind) = behind {
            let behind = self.term(behind)?;
            self.registers[*base] = self.moved(start, behind, 1)?;
            return Ok(start);
        }
        if *writes {
            self.registers[*base] = moved;
        }
        Ok(moved)
    }

    /// `start + factor by`, of addresses too.
    fn moved(&mut self, start: Word, by: Term, factor: u32) -> Done<Word> {
        match (start, self.path.terms.bits(by)) {
            (Word::Term(start), _) => Ok(Word::Term(self.path.terms.plus(start, by, factor))),
            (Word::Address(base, offset), Some(by)) => {
                Ok(Word::Address(base, offset.wrapping_add(by.wrapping_mul(factor) as i32)))
            }
            _ => Err("an address that only the running program knows".into()),
        }
    }

    fn load(&mut self, address: Word, width: u8) -> Done<Word> {
        let at = |terms: &Terms| match address {
            Word::Term(term) => terms.bits(term),
            _ => None,
        };
        if let Some(at) = at(self.path.terms) {
            let bytes = self.program.image.constant_bytes(at, width.into());
            let bytes = bytes.ok_or_else(|| format!("reads {at:#010x}, where the file has no constant"))?;
            let value = bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte));
            return Ok(Word::Term(self.path.terms.constant(value)));
        }
        let Word::Address(base, offset) = address else {
            return Err("reads where only the running program knows".into());
        };
        if base == SP as u32 && offset < self.stack {
            return Err("reads below the stack pointer".into());
        }
        let mut bytes = [(address, 0); 4];
        let bytes = &mut bytes[..usize::from(width)];
        for (byte, part) in bytes.iter_mut().zip(0..) {
            let found = self.memory.get(&(base, offset + part)).copied();
            *byte = found.ok_or_else(|| format!("reads {}, which holds nothing known", shown(base, offset + part)))?;
        }
        let first = bytes[0].0;
        let is_whole = width == 4 && bytes.iter().zip(0..).all(|((word, part), k)| *word == first && *part == k);
        if is_whole && !matches!(first, Word::Truth(_)) {
            return Ok(first);
        }
        let mut value = 0;
        for &mut (word, part) in bytes.iter_mut().rev() {
            let word = match word {
                Word::Truth(input) => Some(self.expected.inputs[input].word_of(self.path.truth(input))),
                Word::Term(term) => self.path.terms.bits(term),
                _ => None,
            };
            let word = word.ok_or_else(|| format!("reads a part of a word at {}", shown(base, offset)))?;
            value = value << 8 | word >> (8 * part) & 0xff;
        }
        Ok(Word::Term(self.path.terms.constant(value)))
    }

    fn store(&mut self, address: Word, word: Word, width: u8) -> Done<()> {
        let Word::Address(base, offset) = address else { return Err("writes where it was given no address".into()) };
        for part in 0..width {
            let to = (base, offset + i32::from(part));
            if base != SP as u32 && !self.may_write(base, to.1) {
                return Err(format!("writes {}, which is no result", shown(base, to.1)));
            }
            self.memory.insert(to, (word, part));
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

    /// Does this condition hold?
    fn holds(&mut self, condition: &str) -> Done<bool> {
        match self.flags {
            Flags::Floats(a, b) => {
                let set = match condition {
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
                    _ => return Err(format!("condition {condition} is not followed")),
                };
                Ok(self.path.stands(a, set, b))
            }
            Flags::Result(a) => {
                let zero = self.path.terms.constant(0);
                match condition {
                    "eq" => Ok(self.path.ordered(Order::Equal, a, zero)),
                    "ne" => Ok(!self.path.ordered(Order::Equal, a, zero)),
                    "mi" => Ok(self.path.ordered(Order::Less, a, zero)),
                    "pl" => Ok(!self.path.ordered(Order::Less, a, zero)),
                    _ => Err(format!("condition {condition} of flags that are not known")),
                }
            }
            // The sign of the difference, which may have wrapped.
            Flags::Counts(a, b) if ["mi", "pl"].contains(&condition) => {
                let (difference, zero) = (self.path.terms.plus(a, b, u32::MAX), self.path.terms.constant(0));
                Ok(self.path.ordered(Order::Less, difference, zero) == (condition == "mi"))
            }
            Flags::Counts(..) | Flags::Known(..) => {
                let flags = self.flags;
                let mut is = |order: Order, turned: bool| match flags {
                    Flags::Counts(a, b) if turned => self.path.ordered(order, b, a),
                    Flags::Counts(a, b) => self.path.ordered(order, a, b),
                    Flags::Known(equal, less, below) => match order {
                        Order::Equal => equal,
                        Order::Less if turned => !less && !equal,
                        Order::Less => less,
                        Order::Below if turned => !below && !equal,
                        Order::Below => below,
                    },
                    _ => false,
                };
                Ok(match condition {
                    "eq" => is(Order::Equal, false),
                    "ne" => !is(Order::Equal, false),
                    "lt" => is(Order::Less, false),
                    "ge" => !is(Order::Less, false),
                    "gt" => is(Order::Less, true),
                    "le" => !is(Order::Less, true),
                    "lo" => is(Order::Below, false),
                    "hs" => !is(Order::Below, false),
                    "hi" => is(Order::Below, true),
                    "ls" => !is(Order::Below, true),
                    _ => return Err(format!("condition {condition} of a comparison of counts")),
                })
            }
            Flags::Unknown => Err("flags that nothing has set".into()),
        }
    }

    /// One instruction; where it goes, if not to the next.
    fn step(&mut self, code: &Code) -> Done<Option<Word>> {
        let Code { instruction, operands, .. } = code;
        let Word::Address(_, stack) = self.registers[SP] else { return Err("the stack is elsewhere".into()) };
        self.stack = stack;
        let stem = code.stem.as_str();
        if !instruction.condition.is_empty() && !self.holds(&instruction.condition)? {
            return Ok(None);
        }
        if instruction.name.contains(".f64") || instruction.name.contains(".f16") {
            return Err("floats of another size than 32 bits are not followed".into());
        }
        let constant = |machine: &mut Self, value: u32| Word::Term(machine.path.terms.constant(value));
        match (stem, &operands[..]) {
            ("nop" | "it" | "itt" | "ite" | "ittt" | "itte" | "itet" | "itee", _) => {}
            (it, _) if it.starts_with("it") && it.len() == 5 => {}
            ("dmb" | "dsb" | "isb", _) => {}
            ("b" | "bx", [target]) => return self.get(target).map(Some),
            ("bl", [target]) => {
                self.registers[LR] = constant(self, instruction.next() | 1);
                return self.get(target).map(Some);
            }
            ("cbz" | "cbnz", [value, target]) => {
                let is_zero = match self.get(value)? {
                    Word::Term(value) => {
                        let zero = self.path.terms.constant(0);
                        self.path.ordered(Order::Equal, value, zero)
                    }
                    // An address that the function is given is none of nothing.
                    _ => false,
                };
                if is_zero == (stem == "cbz") {
                    return self.get(target).map(Some);
                }
            }
            ("tbb" | "tbh", [Operand::Memory { base: PC, index: Some((index, _)), .. }]) => {
                let Word::Term(index) = self.registers[*index] else { return Err("a table of addresses".into()) };
                let index = self.path.terms.bits(index).ok_or("a table whose entry is not known")?;
                let (width, from) = (if stem == "tbb" { 1 } else { 2 }, instruction.address + 4);
                let entry = self.program.image.constant_bytes(from + index * width, width as usize);
                let entry = entry.ok_or("a table outside of the file")?;
                let halfwords = entry.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte));
                return Ok(Some(constant(self, from + 2 * halfwords)));
            }
            ("vcmp" | "vcmpe", [a, b]) => self.compared = Flags::Floats(self.term(a)?, self.term(b)?),
            // Into the flags, not into a register.
            ("vmrs", [Operand::Other, _]) => self.flags = self.compared,
            _ if self.float(instruction, stem, operands)? => {}
            _ if self.moves(instruction, stem, code)? => return Ok(self.jumped(instruction, code)),
            _ => return self.count(instruction, stem, operands),
        }
        Ok(None)
    }

    /// The register pc was loaded.
    fn jumped(&mut self, instruction: &Instruction, code: &Code) -> Option<Word> {
        let to_pc = |one: &Operand| match one {
            Operand::Register(k) => *k == PC,
            Operand::List(list) => list.contains(&PC),
            _ => false,
        };
        let loads = instruction.stem().starts_with("ldr") || instruction.stem().starts_with("ldm");
        let loads = loads || instruction.stem() == "pop";
        (loads && code.operands.iter().take(2).any(to_pc)).then(|| self.registers[PC])
    }

    /// Arithmetic of floats, and moves between their registers; false if it is none of these.
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
                self.path.terms.neg(a)
            }
            ("vabs", [_, a]) => {
                let a = self.term(a)?;
                self.path.abs(a)
            }
            ("vcvt", [_, a]) => {
                let a = self.term(a)?;
                match instruction.name.as_str() {
                    "vcvt.f32.s32" => self.path.terms.number_of(a),
                    "vcvt.f32.u32" => {
                        // -(float)(0 - a) of a negative a is the float of a.
                        let zero = self.path.terms.constant(0);
                        let turned = self.path.terms.plus(zero, a, u32::MAX);
                        if self.path.ordered(Order::Less, turned, zero) {
                            let number = self.path.terms.number_of(turned);
                            self.path.terms.neg(number)
                        } else if !self.path.ordered(Order::Less, a, zero) {
                            self.path.terms.number_of(a)
                        } else {
                            return Err("a count without a sign".into());
                        }
                    }
                    _ => return Err("is not followed".into()),
                }
            }
            ("vadd" | "vsub" | "vmul" | "vdiv" | "vnmul" | "vmla" | "vmls" | "vnmla" | "vnmls", [to, rest @ ..]) => {
                let (a, b) = match rest {
                    [b] => (self.term(to)?, self.term(b)?),
                    [a, b] => (self.term(a)?, self.term(b)?),
                    _ => return Err("is not followed".into()),
                };
                let terms = &mut *self.path.terms;
                match stem {
                    "vadd" => terms.add(a, b),
                    "vsub" => terms.sub(a, b),
                    "vdiv" => terms.div(a, b),
                    _ => {
                        let product = terms.mul(a, b);
                        let turned = matches!(stem, "vnmul" | "vmls" | "vnmla");
                        let product = if turned { terms.neg(product) } else { product };
                        if matches!(stem, "vmul" | "vnmul") {
                            product
                        } else {
                            // The product is rounded before it is added, unlike that of VFMA.
                            let sum = self.term(to)?;
                            let terms = &mut *self.path.terms;
                            let sum = if stem.starts_with("vn") { terms.neg(sum) } else { sum };
                            terms.add(sum, product)
                        }
                    }
                }
            }
            _ => return Ok(false),
        };
        self.set(&operands[0], Word::Term(result))?;
        Ok(true)
    }

    /// Loads and stores; false if it is none.
    fn moves(&mut self, instruction: &Instruction, stem: &str, code: &Code) -> Done<bool> {
        let operands = &code.operands[..];
        let at = instruction.address;
        let many = |list: &Operand| match list {
            Operand::List(list) => Ok(list.clone()),
            other => Err(format!("list {other:?} is not followed")),
        };
        let single = |stem: &str| match stem {
            "ldr" | "str" | "vldr" | "vstr" => Some(4),
            "ldrb" | "strb" => Some(1),
            "ldrh" | "strh" => Some(2),
            _ => None,
        };
        if let (Some(width), [value, memory, behind @ ..]) = (single(stem), operands) {
            let address = self.address(at, memory, behind.first())?;
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
                let four = self.path.terms.constant(4);
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

    /// Where a list begins in memory; the base is moved past it.
    fn list(&mut self, base: usize, list: &[usize], down: bool, writes: bool) -> Done<Word> {
        let (start, length) = (self.registers[base], self.path.terms.constant(4 * list.len() as u32));
        let end = self.moved(start, length, if down { u32::MAX } else { 1 })?;
        if writes {
            self.registers[base] = end;
        }
        Ok(if down { end } else { start })
    }

    fn store_many(&mut self, base: usize, list: &[usize], down: bool, writes: bool) -> Done<()> {
        if writes && list.contains(&base) {
            return Err("stores its own base".into());
        }
        let mut to = self.list(base, list, down, writes)?;
        for k in list {
            self.store(to, self.registers[*k], 4)?;
            let four = self.path.terms.constant(4);
            to = self.moved(to, four, 1)?;
        }
        Ok(())
    }

    fn load_many(&mut self, base: usize, list: &[usize], down: bool, writes: bool) -> Done<()> {
        let mut from = self.list(base, list, down, writes)?;
        for k in list {
            let word = self.load(from, 4)?;
            self.registers[*k] = word;
            let four = self.path.terms.constant(4);
            from = self.moved(from, four, 1)?;
        }
        Ok(())
    }

    /// Operations on counts and addresses.
    fn count(&mut self, instruction: &Instruction, stem: &str, operands: &[Operand]) -> Done<Option<Word>> {
        const SETTING: [&str; 13] =
            ["add", "sub", "rsb", "mov", "mvn", "and", "orr", "eor", "bic", "lsl", "lsr", "asr", "mul"];
        let (stem, sets) = match stem.strip_suffix('s').filter(|stem| SETTING.contains(stem)) {
            Some(stem) => (stem, true),
            None if stem == "negs" => ("neg", true),
            None => (stem.strip_suffix('w').filter(|stem| ["add", "sub", "mov"].contains(stem)).unwrap_or(stem), false),
        };
        // `add r0, r1` is `add r0, r0, r1`.
        let of_two = ["add", "sub", "rsb", "and", "orr", "eor", "bic", "lsl", "lsr", "asr", "mul"].contains(&stem);
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
        // What is compared is not written.
        let compares = ["cmp", "cmn", "tst"].contains(&stem);
        let mut values = Vec::new();
        for one in if compares { &operands[..] } else { from } {
            values.push(match one {
                Operand::Register(PC) => Word::Term(self.path.terms.constant((instruction.address + 4) & !3)),
                _ => self.get(one)?,
            });
        }
        if let Some((shift, by)) = shift {
            let Some(Word::Term(last)) = values.pop() else { return Err("shifts an address".into()) };
            let by = self.path.terms.constant(by);
            values.push(Word::Term(self.shifted(shift, last, by)?));
        }
        if stem == "movt" {
            values.insert(0, self.get(to)?);
        }
        let (result, flags) = self.counted(stem, &values)?;
        if compares || sets {
            self.flags = flags;
        }
        if compares {
            return Ok(None);
        }
        self.set(to, result)?;
        Ok((matches!(to, Operand::Register(PC))).then_some(result))
    }

    fn shifted(&mut self, shift: &str, a: Term, by: Term) -> Done<Term> {
        let terms = &mut *self.path.terms;
        match (shift, terms.bits(by).map(|by| by & 0xff)) {
            ("lsl", Some(by)) => Ok(terms.shifted_left(a, by)),
            ("asr", Some(by)) => Ok(terms.shifted_right(a, by)),
            ("lsr", Some(by)) => {
                let by = terms.constant(by);
                Ok(self.path.bitwise("lsr", a, by))
            }
            _ => Err("a shift that is not followed".into()),
        }
    }

    /// The result, and the flags if they are set.
    fn counted(&mut self, stem: &str, values: &[Word]) -> Done<(Word, Flags)> {
        let terms = &mut *self.path.terms;
        let known = |terms: &Terms, word: &Word| match word {
            Word::Term(term) => terms.bits(*term),
            _ => None,
        };
        let (result, flags) = match (stem, values) {
            ("mov", [from]) => match *from {
                Word::Term(term) => (*from, Flags::Result(term)),
                _ => (*from, Flags::Unknown),
            },
            // An address that the function is given is none of nothing.
            ("cmp", [Word::Address(..), zero]) if known(terms, zero) == Some(0) => {
                (*zero, Flags::Known(false, false, false))
            }
            // It is a multiple of 4.
            ("and" | "tst", [address, mask])
                if is_aligned(address) && known(terms, mask).is_some_and(|mask| mask <= 3) =>
            {
                let zero = terms.constant(0);
                (Word::Term(zero), Flags::Result(zero))
            }
            ("lsl", [address, by]) if is_aligned(address) && known(terms, by) == Some(30) => {
                let zero = terms.constant(0);
                (Word::Term(zero), Flags::Result(zero))
            }
            ("orr", [one, other]) if is_aligned(one) && is_aligned(other) => (Word::Aligned, Flags::Unknown),
            ("cmp" | "sub", [Word::Address(a, x), Word::Address(b, y)]) => {
                let (a, b) = (terms.address(*a, *x), terms.address(*b, *y));
                (Word::Term(terms.plus(a, b, u32::MAX)), Flags::Counts(a, b))
            }
            ("add" | "sub", [start @ Word::Address(..), Word::Term(by)]) => {
                (self.moved(*start, *by, if stem == "add" { 1 } else { u32::MAX })?, Flags::Unknown)
            }
            (_, [Word::Term(a)]) => {
                let (a, zero, all) = (*a, terms.constant(0), terms.constant(u32::MAX));
                let result = match stem {
                    "neg" => return Ok((Word::Term(terms.plus(zero, a, u32::MAX)), Flags::Counts(zero, a))),
                    // -1 - a.
                    "mvn" => terms.plus(all, a, u32::MAX),
                    "uxtb" | "uxth" => {
                        let mask = terms.constant(if stem == "uxtb" { 0xff } else { 0xffff });
                        terms.bitwise("and", a, mask)
                    }
                    "sxtb" => terms.low_bits(a, 8),
                    "sxth" => terms.low_bits(a, 16),
                    _ => return Err("is not followed".into()),
                };
                (Word::Term(result), Flags::Result(result))
            }
            (_, [Word::Term(a), Word::Term(b)]) => {
                let (a, b) = (*a, *b);
                let (result, flags) = match stem {
                    "cmp" | "sub" => (terms.plus(a, b, u32::MAX), Some(Flags::Counts(a, b))),
                    "rsb" => (terms.plus(b, a, u32::MAX), Some(Flags::Counts(b, a))),
                    "cmn" => {
                        let (zero, sum) = (terms.constant(0), terms.plus(a, b, 1));
                        let turned = terms.plus(zero, b, u32::MAX);
                        (sum, Some(Flags::Counts(a, turned)))
                    }
                    "add" => (terms.plus(a, b, 1), None),
                    "and" | "tst" => (self.path.bitwise("and", a, b), None),
                    "orr" => (self.path.bitwise("orr", a, b), None),
                    "eor" => (self.path.bitwise("eor", a, b), None),
                    "mul" => (terms.times(a, b), None),
                    "sdiv" => (self.path.quotient(a, b), None),
                    "bic" => {
                        let mask = !terms.bits(b).ok_or("bits that are not known")?;
                        let mask = terms.constant(mask);
                        (self.path.bitwise("and", a, mask), None)
                    }
                    "movt" => {
                        let (low, high) = (terms.bits(a), terms.bits(b).unwrap_or(0));
                        let low = low.ok_or("the upper half of what is not known")?;
                        (terms.constant(high << 16 | low & 0xffff), None)
                    }
                    "lsl" | "lsr" | "asr" => (self.shifted(stem, a, b)?, None),
                    _ => return Err("is not followed".into()),
                };
                (Word::Term(result), flags.unwrap_or(Flags::Result(result)))
            }
            ("mla" | "mls", [Word::Term(a), Word::Term(b), Word::Term(to)]) => {
                let product = terms.times(*a, *b);
                let result = terms.plus(*to, product, if stem == "mla" { 1 } else { u32::MAX });
                (Word::Term(result), Flags::Unknown)
            }
            ("ubfx", [Word::Term(a), Word::Term(from), width]) => {
                let mask = match known(terms, width) {
                    Some(width @ 1..=31) => terms.constant((1 << width) - 1),
                    _ => return Err("is not followed".into()),
                };
                let shifted = self.path.bitwise("lsr", *a, *from);
                let result = self.path.bitwise("and", shifted, mask);
                (Word::Term(result), Flags::Unknown)
            }
            ("sbfx", [Word::Term(a), from, width]) => match (known(terms, from), known(terms, width)) {
                (Some(0), Some(width @ 1..=32)) => (Word::Term(terms.low_bits(*a, width)), Flags::Unknown),
                _ => return Err("is not followed".into()),
            },
            _ => return Err("is not followed".into()),
        };
        Ok((result, flags))
    }
}

/// Are the lowest two bits of an address 0?
fn is_aligned(word: &Word) -> bool {
    matches!(word, Word::Aligned) || matches!(word, Word::Address(_, offset) if offset % 4 == 0)
}

/// Bytes of a place in memory.
fn width(port: &Port) -> u8 {
    if port.kind == Kind::Truth { 1 } else { 4 }
}

fn shown(base: u32, offset: i32) -> String {
    let name = if base == SP as u32 { "sp".into() } else { format!("r{base}") };
    format!("{name}{offset:+}")
}
