//! Text of instructions.

use std::fmt::{Display, Write as _};

use crate::schedule::{Event, Line, Operation};

/// Adds an instruction to a text.
macro_rules! put {
    ($text:expr, $($instruction:tt)*) => {{ let _ = writeln!($text, "\t{}", format_args!($($instruction)*)); }};
}
/// Adds a label to a text.
macro_rules! label {
    ($text:expr, $($name:tt)*) => {{ let _ = writeln!($text, "{}:", format_args!($($name)*)); }};
}
pub(crate) use {label, put};

/// Returns the registers `first`, ...
pub(crate) fn row(first: u8, count: usize) -> String {
    if count == 1 { format!("{{s{first}}}") } else { format!("{{s{first}-s{}}}", usize::from(first) + count - 1) }
}

/// Returns a table after the code.
pub(crate) fn words(name: &str, table: &[u32]) -> String {
    let mut text = format!("\t.balign 4\n.L{name}_table:\n");
    for bits in table {
        put!(text, ".word {bits:#010x} @ {:?}", f32::from_bits(*bits));
    }
    text
}

/// Compares two numbers in the flags.
pub(crate) fn compare(text: &mut String, a: impl Display, b: impl Display) {
    put!(text, "vcmp.f32 s{a}, s{b}\n\tvmrs APSR_nzcv, fpscr");
}

/// Returns the instructions that save and restore the caller's FPU registers from 16 up to here.
pub(crate) fn kept(above: usize) -> (String, String) {
    if above <= 16 {
        return (String::new(), String::new());
    }
    let row = row(16, above - 16);
    (format!("\tvpush {row}\n"), format!("\tvpop {row}\n"))
}

/// Returns the instructions that save the caller's registers and reserve stack, and the instructions that undo this.
pub(crate) fn saved(numbers: usize, cores: usize, slots: usize) -> (String, String) {
    let (mut push, mut pop) = (String::new(), String::new());
    if cores > 0 {
        // An even number keeps the stack aligned.
        let last = 3 + cores.next_multiple_of(2);
        put!(push, "push.w {{r4-r{last}}}");
        put!(pop, "pop.w {{r4-r{last}}}");
    }
    let (keep, restore) = kept(numbers.next_multiple_of(2));
    (push, pop) = (push + &keep, restore + &pop);
    if slots > 0 {
        let bytes = 4 * slots.next_multiple_of(2);
        put!(push, "sub.w sp, sp, #{bytes}");
        pop = format!("\tadd.w sp, sp, #{bytes}\n{pop}");
    }
    (push, pop)
}

/// The text of a straight line, and its read position.
pub(crate) struct Flow<'a> {
    pub(crate) text: String,
    line: &'a Line,
    /// The core register that points to the table.
    table: &'static str,
    pub(crate) at: Position,
}

/// Read position: bytes of the state and the sample, words of the table.
#[derive(Clone, Copy, Default)]
pub(crate) struct Position {
    pub(crate) state: i32,
    pub(crate) sample: i32,
    pub(crate) constants: usize,
}

impl Position {
    /// Returns the offset of a table word from the register of the table.
    pub(crate) fn to_word(self, word: usize) -> i32 {
        bytes(word) - bytes(self.constants)
    }
}

/// An exit of the line, and its registers.
#[derive(Clone, Copy)]
pub(crate) struct Exit<'a> {
    pub(crate) at: Position,
    pub(crate) registers: &'a [u8],
}

pub(crate) fn bytes(words: usize) -> i32 {
    4 * words as i32
}

impl<'a> Flow<'a> {
    pub(crate) fn new(line: &'a Line, table: &'static str) -> Self {
        Self { text: String::new(), line, table, at: Position::default() }
    }

    pub(crate) fn exit(&self, registers: &'a [u8]) -> Exit<'a> {
        Exit { at: self.at, registers }
    }

    /// Writes a load of constants or of the state. For any other item it returns kind, sources and results.
    pub(crate) fn load(&mut self, event: &'a Event) -> Option<(Operation, &'a [u8], &'a [u8])> {
        match event {
            Event::Immediate { value, register } => {
                let number = self.line.constants[*value].map(f32::from_bits).unwrap_or_default();
                put!(self.text, "vmov.f32 s{register}, #{number:?}");
            }
            Event::Constants { first, count } => {
                put!(self.text, "vldmia {}!, {}", self.table, row(*first, usize::from(*count)));
                self.at.constants += usize::from(*count);
            }
            Event::Words { first, count } => self.load_state(*first, usize::from(*count)),
            Event::Item { item, sources, results } => match self.line.items[*item].kind {
                Operation::LoadState => self.load_state(results[0], results.len()),
                kind => return Some((kind, sources, results)),
            },
        }
        None
    }

    fn load_state(&mut self, first: u8, count: usize) {
        put!(self.text, "vldmia r0!, {}", row(first, count));
        self.at.state += bytes(count);
    }

    /// Writes an operation on registers; status bits are accumulated in a core register.
    pub(crate) fn operation(&mut self, kind: Operation, sources: &[u8], results: &[u8], health: &str) {
        let text = &mut self.text;
        let s = |k: usize| sources[k];
        let d = results.first().copied().unwrap_or_default();
        match kind {
            Operation::Add => put!(text, "vadd.f32 s{d}, s{}, s{}", s(0), s(1)),
            Operation::Sub => put!(text, "vsub.f32 s{d}, s{}, s{}", s(0), s(1)),
            Operation::Mul => put!(text, "vmul.f32 s{d}, s{}, s{}", s(0), s(1)),
            Operation::Div => put!(text, "vdiv.f32 s{d}, s{}, s{}", s(0), s(1)),
            Operation::Abs => put!(text, "vabs.f32 s{d}, s{}", s(0)),
            Operation::Neg => put!(text, "vneg.f32 s{d}, s{}", s(0)),
            Operation::Copy => put!(text, "vmov.f32 s{d}, s{}", s(0)),
            Operation::Number => put!(text, "vcvt.f32.s32 s{d}, s{}", s(0)),
            Operation::Clamp | Operation::Max => {
                if s(0) != d {
                    put!(text, "vmov.f32 s{d}, s{}", s(0));
                }
                let conditions = if kind == Operation::Max { ["mi"; 2] } else { ["gt", "mi"] };
                for (limit, condition) in sources[1..].iter().zip(conditions) {
                    compare(text, d, limit);
                    put!(text, "it {condition}\n\tvmov{condition}.f32 s{d}, s{limit}");
                }
            }
            Operation::Store(at) => put!(text, "vstr s{}, [r2, #{}]", s(0), 4 * at),
            Operation::Flag(bit, greater) => {
                let condition = if greater { "gt" } else { "ne" };
                compare(text, s(0), s(1));
                put!(text, "it {condition}\n\tadd{condition} {health}, #{}", 1 << bit);
            }
            other => unreachable!("{other:?} is more than an operation"),
        }
    }
}
