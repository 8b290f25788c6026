//! A Thumb instruction: its name, the registers that it reads, writes and uses as an address, and its control flow.
//!
//! The decoder prints an instruction as text, and this module derives everything from the text. A test can therefore
//! write an instruction as the manual does. The conditions behind an IT come from its bits, because the decoder omits
//! some of them.
//!
//! The table lists all instructions that may end or leave a path, with their control flow ([`Flow`]). Each row has a
//! test with machine code:
//! `tests::classes` for the bound, `meaning::tests` for `--means`.
//!
//! | instructions | flow | condition |
//! |---|---|---|
//! | B, CBZ, CBNZ | jump; into another function: a tail call | its own or that of an IT: also to the next |
//! | BL | call; returns if any path of the callee does | of an IT |
//! | BLX, BLXNS | call by a register: rejected, comes back to the next | of an IT |
//! | BX LR, BXNS LR, MOV PC, LR; POP, LDM, LDR of PC from the stack | return | of an IT: also to the next |
//! | BX, BXNS, MOV, ADD, LDR, LDM and all else that writes PC | rejected: may go anywhere, and return | of an IT |
//! | TBB, TBH | jump by a table behind its comparison, else rejected | of an IT: rejected |
//! | UDF, in any encoding | never returns; an exception that is not counted | of an IT: also to the next |
//! | SVC, BKPT, HVC, SMC, HLT, DCPS, ERET, RFE | rejected: the handler is unknown | of an IT |
//! | WFI, WFE | to the next; no documented maximum of cycles | of an IT |
//! | MSR of MSP, PSP, CONTROL | to the next; the stack has no bound | of an IT |
//! | CPS, MSR else, MRS, barriers, hints, loads, stores, divisions | to the next; no fault is assumed | of an IT |
//! | CBZ, IT, CPS, a branch with its own condition, not the last: behind an IT | rejected: unpredictable | - |
//! | an instruction behind an IT that is a jump target | rejected | - |
//!
//! Register sets are bits of a `u64`: r0 .. pc at 0 .. 15, s0 .. s31 at 16 .. 47 (d0 is s0 with s1), the flags of the
//! FPSCR at 48.

use capstone::arch::arm::{ArchExtraMode, ArchMode, ArmCC};
use capstone::prelude::*;

use crate::encoding;

/// The frame pointer of GCC and Clang in Thumb code (r7), as a set of registers.
const FRAME: u64 = 1 << 7;
/// The stack pointer, as a set of registers.
pub(crate) const SP: u64 = 1 << 13;
const LR: u64 = 1 << 14;
const PC: u64 = 1 << 15;
const FLOAT_FLAGS: u64 = 1 << 48;

/// Control flow after an executed instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Flow {
    /// Continues at the next instruction.
    Next,
    /// Jumps to a constant address.
    Jump(u32),
    /// Calls a function and continues at the next instruction.
    Call(u32),
    /// Returns to the caller.
    Return,
    /// Jumps through the table behind the instruction; width of an entry, bytes.
    Table(u32),
    /// Jumps to an address that only the running program determines; `true`: a call.
    Indirect(bool),
    /// Ends the path: UDF, the end of a panic.
    Trap,
    /// Enters an exception handler, which may continue at the next instruction.
    Exception,
}

/// A decoded instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Instruction {
    /// Address of the instruction.
    pub(crate) address: u32,
    /// Length, 2 or 4 bytes.
    pub(crate) size: u32,
    /// Mnemonic without condition and width, for example `vadd.f32`.
    pub(crate) name: String,
    /// Operands, in the notation of the manual.
    pub(crate) operands: Vec<String>,
    /// Set if the instruction executes only under a condition.
    pub(crate) conditional: bool,
    /// Condition, for example `eq`; empty without one, and for CBZ and CBNZ.
    pub(crate) condition: String,
    /// Reason, if the instruction is unpredictable.
    pub(crate) open: Option<&'static str>,
}

impl Instruction {
    /// Parses an instruction from its text. `condition` holds the condition letters at the end of the mnemonic.
    pub(crate) fn from_text(address: u32, size: u32, mnemonic: &str, operands: &str, condition: Option<&str>) -> Self {
        let mnemonic = mnemonic.trim_end_matches(".w").trim_end_matches(".n");
        let (stem, types) = mnemonic.split_at(mnemonic.find('.').unwrap_or(mnemonic.len()));
        let bare = condition.and_then(|letters| stem.strip_suffix(letters)).filter(|_| !stem.starts_with("it"));
        let name = format!("{}{types}", bare.unwrap_or(stem));
        let conditional = bare.is_some() || name == "cbz" || name == "cbnz";
        let condition = condition.filter(|_| bare.is_some()).unwrap_or("").to_owned();
        Self { address, size, name, operands: split(operands), conditional, condition, open: None }
    }

    /// Returns whether the instruction is an IT.
    pub(crate) fn is_it(&self) -> bool {
        let stem = self.stem();
        stem.starts_with("it") && stem.len() <= 5 && stem[2..].chars().all(|letter| "te".contains(letter))
    }

    /// Returns the mnemonic without data types: `vadd` of `vadd.f32`.
    pub(crate) fn stem(&self) -> &str {
        self.name.split('.').next().unwrap_or(&self.name)
    }

    /// Returns the text of the instruction, as in a listing.
    pub(crate) fn text(&self) -> String {
        let condition = if self.conditional && !self.name.starts_with("cb") { "<c>" } else { "" };
        format!("{}{condition} {}", self.name, self.operands.join(", ")).trim_end().to_owned()
    }

    /// Gives the instruction the condition of the IT before it.
    fn put_behind_it(&mut self, condition: Option<&'static str>, (first, second): (u16, Option<u16>), is_last: bool) {
        let goes_on = matches!(self.flow(), Flow::Next | Flow::Exception);
        self.open = self.open.or_else(|| encoding::open_in_it(first, second, goes_on, is_last));
        // BKPT ignores the condition.
        if let Some(condition) = condition.filter(|_| self.stem() != "bkpt") {
            if self.conditional && self.condition != condition {
                self.open = Some("unpredictable: its condition differs from the IT");
            }
            self.conditional = true;
            condition.clone_into(&mut self.condition);
        }
    }

    /// Returns the address of the following instruction.
    pub(crate) fn next(&self) -> u32 {
        self.address.wrapping_add(self.size)
    }

    fn operand(&self, index: usize) -> &str {
        self.operands.get(index).map_or("", String::as_str)
    }

    /// Returns the control flow of the executed instruction.
    pub(crate) fn flow(&self) -> Flow {
        let target = || immediate(self.operands.last().map_or("", String::as_str)).map(|target| target as u32);
        let writes_pc = self.writes() & PC != 0;
        match self.stem() {
            "b" | "cbz" | "cbnz" => target().map_or(Flow::Indirect(false), Flow::Jump),
            "bl" => target().map_or(Flow::Indirect(true), Flow::Call),
            "blx" | "blxns" => Flow::Indirect(true),
            "bx" | "bxns" if self.operand(0) == "lr" => Flow::Return,
            "bx" | "bxns" | "bxj" => Flow::Indirect(false),
            "tbb" => Flow::Table(1),
            "tbh" => Flow::Table(2),
            // UDF #0xfe has its own mnemonic.
            "udf" | "trap" => Flow::Trap,
            "svc" | "bkpt" | "hvc" | "smc" | "hlt" | "eret" => Flow::Exception,
            stem if ["dcps", "rfe", "srs"].iter().any(|name| stem.starts_with(name)) => Flow::Exception,
            // Loads the return address, which the entry of the function stored on the stack.
            "pop" if writes_pc => Flow::Return,
            "ldm" | "ldmia" | "ldmdb" | "ldr" if writes_pc && self.address_registers() == SP => Flow::Return,
            "mov" if writes_pc && self.operand(1) == "lr" => Flow::Return,
            _ if writes_pc => Flow::Indirect(false),
            _ => Flow::Next,
        }
    }

    /// Returns whether the instruction is a load or store of several registers.
    fn is_multiple(&self) -> bool {
        let multiple = ["ldm", "stm", "vldm", "vstm", "fldm", "fstm"];
        multiple.iter().any(|name| self.name.starts_with(name))
    }

    fn is_push_or_pop(&self) -> bool {
        matches!(self.stem(), "push" | "pop" | "vpush" | "vpop")
    }

    /// Returns the registers that form the memory address.
    pub(crate) fn address_registers(&self) -> u64 {
        if self.is_push_or_pop() {
            return SP;
        }
        if self.is_multiple() {
            return registers(self.operand(0));
        }
        self.operands.iter().filter(|operand| operand.starts_with('[')).map(|operand| registers(operand)).sum()
    }

    /// Returns whether the memory address is relative to the program counter.
    pub(crate) fn is_literal_load(&self) -> bool {
        self.operands.iter().any(|operand| operand.starts_with("[pc"))
    }

    /// Returns whether the memory address has a register offset.
    pub(crate) fn has_register_offset(&self) -> bool {
        self.address_registers().count_ones() > 1
    }

    /// Returns whether the instruction writes back its address register.
    fn writes_base(&self) -> bool {
        let after = self.operands.iter().position(|operand| operand.starts_with('[') && operand.ends_with(']'));
        self.is_push_or_pop()
            || self.operands.iter().any(|operand| operand.ends_with('!'))
            || after.is_some_and(|at| at + 1 < self.operands.len())
    }

    /// Returns the number of leading operands that are destinations.
    fn destinations(&self) -> usize {
        let stem = self.stem();
        let store = stem.starts_with("str") && !stem.starts_with("strex");
        let none =
            ["cmp", "cmn", "tst", "teq", "cbz", "cbnz", "tbb", "tbh", "vstr", "vcmp", "vcmpe", "msr", "vmsr", "b"];
        if store || none.contains(&stem) || self.is_multiple() || self.is_push_or_pop() {
            return 0;
        }
        let is_long = (stem.starts_with("umla") || stem.starts_with("umaa") || stem.starts_with("umul"))
            || (["smull", "smlal", "smlsl"].iter().any(|long| stem.starts_with(long)));
        let of_two = matches!(stem, "ldrd" | "ldrexd") || is_long;
        let two_floats = self.operands.len() == 4 && stem == "vmov";
        let two_cores = self.operands.len() == 3 && stem == "vmov" && registers(self.operand(0)) & 0xffff != 0;
        if of_two || two_floats || two_cores { 2 } else { 1 }
    }

    /// Returns the written registers without a written-back base.
    pub(crate) fn results(&self) -> u64 {
        let loads = ["ldm", "vldm", "fldm", "pop", "vpop"];
        if loads.iter().any(|name| self.name.starts_with(name)) {
            return self
                .operands
                .iter()
                .filter(|operand| !operand.ends_with('!'))
                .map(|o| listed(o))
                .fold(0, |a, b| a | b);
        }
        if matches!(self.stem(), "vcmp" | "vcmpe" | "vmsr") {
            return FLOAT_FLAGS;
        }
        let plain = |operand: &&String| !operand.starts_with('[');
        let written = self.operands.iter().take(self.destinations()).filter(plain);
        written.map(|operand| registers(operand)).fold(0, |a, b| a | b)
    }

    /// Returns all written registers.
    pub(crate) fn writes(&self) -> u64 {
        let base = if self.writes_base() { self.address_registers() } else { 0 };
        self.results() | base
    }

    /// Returns the read registers, without the addend of a multiply-accumulate.
    pub(crate) fn reads(&self) -> u64 {
        let flags = if matches!(self.stem(), "vmrs" | "fmstat") { FLOAT_FLAGS } else { 0 };
        let sources = self.operands.iter().skip(self.destinations());
        sources.map(|operand| registers(operand)).fold(flags, |a, b| a | b)
    }

    /// Returns the number of words moved between registers and memory.
    pub(crate) fn words(&self) -> u32 {
        match self.stem() {
            "ldrd" | "strd" => 2,
            "vldr" | "vstr" => registers(self.operand(0)).count_ones(),
            _ => self.operands.iter().map(|operand| listed(operand)).fold(0, |a, b| a | b).count_ones(),
        }
    }

    /// Returns the growth of the stack in bytes, or `None` if the instruction does not define it.
    pub(crate) fn stack_growth(&self) -> Option<i64> {
        if self.stem() == "msr" && ["msp", "psp", "control"].contains(&self.operand(0)) {
            return None;
        }
        if self.writes() & SP == 0 {
            return Some(0);
        }
        let bytes = 4 * i64::from(self.words());
        let last = immediate(self.operands.last().map_or("", String::as_str)).map(i64::from);
        let of_sp = self.operands.iter().rev().skip(1).all(|operand| operand == "sp");
        match self.stem() {
            _ if self.conditional && self.flow() != Flow::Return => None,
            "push" | "vpush" | "stmdb" | "vstmdb" => Some(bytes),
            "pop" | "vpop" | "ldm" | "ldmia" | "vldmia" => Some(-bytes),
            "sub" | "subw" if of_sp => last,
            "add" | "addw" if of_sp => last.map(|bytes| -bytes),
            _ if self.results() & SP == 0 => {
                // [sp, #-8]! before the access, [sp], #8 after it.
                let before = self.operands.iter().find_map(|o| o.strip_prefix("[sp, ")?.strip_suffix("]!"));
                before.and_then(immediate).map(i64::from).or(last).map(|moved| -moved)
            }
            _ => None,
        }
    }

    /// Returns the positions of the stack pointer and of the frame pointer after the instruction, from their positions
    /// before it. Both are in bytes below the stack pointer at the entry. The frame position is `None` if r7 holds
    /// another value. The result is `None` if the stack pointer becomes unknown. Callees preserve the frame pointer, as
    /// the procedure call standard requires.
    pub(crate) fn frame_after(&self, depth: i64, frame: Option<i64>) -> Option<(i64, Option<i64>)> {
        let frame_after = match self.displaced().filter(|_| !self.conditional) {
            _ if self.writes() & FRAME == 0 => frame,
            Some((SP, less)) => Some(depth + less),
            Some((FRAME, less)) => frame.map(|frame| frame + less),
            _ => None,
        };
        let depth_after = match (self.stack_growth(), self.displaced()) {
            (Some(growth), _) => depth + growth,
            (None, Some((FRAME, less))) if !self.conditional && self.results() & SP != 0 => frame? + less,
            _ => return None,
        };
        Some((depth_after, frame_after))
    }

    /// Returns the source register of a move, or of an addition or subtraction of a constant, and the decrease of its
    /// value.
    fn displaced(&self) -> Option<(u64, i64)> {
        let from = self.operands.get(1).filter(|operand| !operand.starts_with('#')).or(self.operands.first())?;
        let number = immediate(self.operands.last()?).map(i64::from);
        let less = match (self.stem(), number) {
            ("mov", None) if self.operands.len() == 2 => 0,
            ("add" | "adds" | "addw", Some(number)) => -number,
            ("sub" | "subs" | "subw", Some(number)) => number,
            _ => return None,
        };
        Some((registers(from), less))
    }
}

/// Splits operands at commas outside of brackets and braces.
fn split(operands: &str) -> Vec<String> {
    let mut parts = Vec::new();
    let (mut depth, mut from) = (0_i32, 0);
    for (at, letter) in operands.char_indices() {
        match letter {
            '[' | '{' => depth += 1,
            ']' | '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(operands[from..at].trim().to_owned());
                from = at + 1;
            }
            _ => {}
        }
    }
    let last = operands[from..].trim();
    if !last.is_empty() {
        parts.push(last.to_owned());
    }
    parts
}

/// Parses an immediate operand such as `#16` or `#-0x4`.
pub(crate) fn immediate(operand: &str) -> Option<i32> {
    let text = operand.strip_prefix('#')?;
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |digits| (-1, digits));
    let value = match digits.strip_prefix("0x") {
        Some(hex) => i64::from_str_radix(hex, 16),
        None => digits.parse(),
    };
    // An address above 2^31 keeps its bit pattern.
    value.ok().map(|value| (sign * value) as i32)
}

/// Returns all registers named in an operand.
fn registers(operand: &str) -> u64 {
    operand.split(|c: char| !c.is_ascii_alphanumeric()).map(register).fold(0, |a, b| a | b)
}

/// Returns the registers of a list in braces; empty for any other operand.
pub(crate) fn listed(operand: &str) -> u64 {
    if operand.starts_with('{') { registers(operand) } else { 0 }
}

pub(crate) fn register(name: &str) -> u64 {
    match name {
        "sb" => return 1 << 9,
        "sl" => return 1 << 10,
        "fp" => return 1 << 11,
        "ip" => return 1 << 12,
        "sp" => return SP,
        "lr" => return LR,
        "pc" => return PC,
        _ => {}
    }
    let numbered = |letter: char, below: u32| {
        let number: u32 = name.strip_prefix(letter)?.parse().ok()?;
        (number < below).then_some(number)
    };
    if let Some(number) = numbered('r', 16) {
        1 << number
    } else if let Some(number) = numbered('s', 32) {
        1 << (16 + number)
    } else if let Some(number) = numbered('d', 16) {
        0b11 << (16 + 2 * number)
    } else {
        0
    }
}

/// Disassembler from bytes to instructions.
pub(crate) struct Decoder {
    capstone: Capstone,
    v8: bool,
}

impl Decoder {
    /// Creates a decoder for Thumb of ARMv7-M, or of ARMv8-M with `v8`.
    ///
    /// # Errors
    /// The error message of the decoder library.
    pub(crate) fn new(v8: bool) -> Result<Self, String> {
        let modes = [ArchExtraMode::MClass, ArchExtraMode::V8];
        let count = if v8 { 2 } else { 1 };
        let builder =
            Capstone::new().arm().mode(ArchMode::Thumb).extra_mode(modes.into_iter().take(count)).detail(true);
        let capstone = builder.build().map_err(|error| format!("the decoder cannot be created: {error}"))?;
        Ok(Self { capstone, v8 })
    }

    /// Decodes the instruction at the start of `code`, with its dependent instructions if it is an IT; empty if it is
    /// invalid.
    pub(crate) fn decode(&self, code: &[u8], address: u32) -> Vec<Instruction> {
        let block = match *code {
            // IT: the lowest set bit of the mask ends the block.
            [low, 0xbf, ..] if low & 0xf != 0 => 5 - (low & 0xf).trailing_zeros() as usize,
            _ => 1,
        };
        let Ok(decoded) = self.capstone.disasm_count(code, u64::from(address), block) else { return Vec::new() };
        let mut list: Vec<Instruction> = decoded.iter().filter_map(|one| self.read(one)).collect();
        if list.len() != block {
            return Vec::new();
        }
        let half = |at: usize| Some(u16::from_le_bytes([*code.get(at)?, *code.get(at + 1)?]));
        let conditions = half(0).map_or_else(Vec::new, encoding::conditions);
        let mut at = 0;
        for (k, one) in list.iter_mut().enumerate() {
            let (Some(first), second) = (half(at), half(at + 2).filter(|_| one.size == 4)) else { return Vec::new() };
            at += one.size as usize;
            // BXNS and BLXNS are BX and BLX with a bit that is 0 before ARMv8-M.
            let is_secure = self.v8 && ["bxns", "blxns"].contains(&one.stem()) && first.is_multiple_of(4);
            one.open = encoding::open(first, second).filter(|_| !is_secure);
            match conditions.get(k.wrapping_sub(1)) {
                Some(condition) => one.put_behind_it(*condition, (first, second), k + 1 == block),
                None if k == 0 && block > 1 => one.open = encoding::open_it(first),
                None if one.conditional && !["b", "cbz", "cbnz"].contains(&one.stem()) => {
                    one.open = Some("unpredictable: a condition without an IT");
                }
                None => {}
            }
        }
        list
    }

    fn read(&self, one: &capstone::Insn<'_>) -> Option<Instruction> {
        let detail = self.capstone.insn_detail(one).ok()?;
        let condition = match detail.arch_detail().arm()?.cc() {
            ArmCC::ARM_CC_AL | ArmCC::ARM_CC_INVALID => None,
            other => Some(format!("{other:?}").trim_start_matches("ARM_CC_").to_lowercase()),
        };
        let (mnemonic, operands) = (one.mnemonic()?, one.op_str().unwrap_or(""));
        let address = one.address() as u32;
        Some(Instruction::from_text(address, one.len() as u32, mnemonic, operands, condition.as_deref()))
    }
}

#[cfg(test)]
pub(crate) fn parse(text: &str) -> Instruction {
    let (mnemonic, operands) = text.split_once(' ').unwrap_or((text, ""));
    Instruction::from_text(0x100, 4, mnemonic, operands, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> u64 {
        registers(text)
    }

    #[test]
    fn a_double_register_is_two_of_single_precision() {
        assert_eq!(registers("{d8, d9}"), registers("{s16, s17, s18, s19}"));
        assert_eq!(parse("vpush {d8, d9}").words(), 4);
        assert_eq!(parse("vldr d0, [r1]").words(), 2);
        assert_eq!(parse("pop {r4, pc}").words(), 2);
        assert_eq!(parse("ldm r0!, {r1, r2, r3}").words(), 3);
    }

    #[test]
    fn what_is_read_written_and_taken_for_an_address_is_told_apart() {
        for (text, reads, results, address) in [
            ("vadd.f32 s0, s1, s2", "s1 s2", "s0", ""),
            ("vmla.f32 s0, s1, s2", "s1 s2", "s0", ""),
            ("vmov s0, s1, r2, r3", "r2 r3", "s0 s1", ""),
            ("vmov r0, r1, d1", "s2 s3", "r0 r1", ""),
            ("vmov d1, r0, r1", "r0 r1", "s2 s3", ""),
            ("vstr s1, [sp, #8]", "s1 sp", "", "sp"),
            ("vldr s1, [r1, #-8]", "r1", "s1", "r1"),
            ("vldmia r0!, {s2, s3}", "r0 s2 s3", "s2 s3", "r0"),
            ("ldr r0, [r1, r2]", "r1 r2", "r0", "r1 r2"),
            ("str r0, [r1]", "r0 r1", "", "r1"),
            ("strex r0, r1, [r2]", "r1 r2", "r0", "r2"),
            ("umull r0, r1, r2, r3", "r2 r3", "r0 r1", ""),
            ("cmp r0, r1", "r0 r1", "", ""),
            ("push {r4, lr}", "r4 lr", "", "sp"),
        ] {
            let one = parse(text);
            assert_eq!(one.reads(), names(reads), "{text} reads");
            assert_eq!(one.results(), names(results), "{text} results");
            assert_eq!(one.address_registers(), names(address), "{text} address");
        }
        assert_eq!(parse("vcmp.f32 s0, s1").results() & parse("vmrs apsr_nzcv, fpscr").reads(), FLOAT_FLAGS);
        assert_eq!(parse("ldr r0, [r1], #4").writes(), names("r0 r1"));
        assert_eq!(parse("ldr r0, [r1, #4]!").writes(), names("r0 r1"));
    }

    #[test]
    fn a_return_is_told_from_a_jump_through_a_register() {
        for text in ["bx lr", "pop {r4, pc}", "ldr pc, [sp], #4", "ldm sp!, {r4, pc}", "mov pc, lr"] {
            assert_eq!(parse(text).flow(), Flow::Return, "{text}");
        }
        for text in ["bx r3", "mov pc, r1", "add pc, r1", "ldr pc, [r0, #4]", "ldm r0, {pc}"] {
            assert_eq!(parse(text).flow(), Flow::Indirect(false), "{text}");
        }
        assert_eq!(parse("blx r3").flow(), Flow::Indirect(true));
        assert_eq!(parse("bl #0x80001234").flow(), Flow::Call(0x8000_1234));
        assert_eq!(parse("cbz r0, #0x120").flow(), Flow::Jump(0x120));
    }

    #[test]
    fn growth_of_the_stack_is_in_the_instruction_or_unknown() {
        for (text, growth) in [
            ("push {r4, r5, lr}", Some(12)),
            ("vpush {d8, d9}", Some(16)),
            ("sub sp, #0x10", Some(16)),
            ("sub.w sp, sp, #1024", Some(1024)),
            ("add sp, #16", Some(-16)),
            ("str r4, [sp, #-0x4]!", Some(4)),
            ("strd r0, r1, [sp, #-0x8]!", Some(8)),
            ("ldr pc, [sp], #4", Some(-4)),
            ("pop {r4, pc}", Some(-8)),
            ("ldr r0, [sp, #4]", Some(0)),
            ("mov sp, r7", None),
            ("msr psp, r0", None),
            ("msr primask, r0", Some(0)),
            ("sub.w sp, r7, #8", None),
            ("sub.w sp, sp, r0", None),
        ] {
            assert_eq!(parse(text).stack_growth(), growth, "{text}");
        }
    }

    #[test]
    fn an_it_block_is_decoded_with_its_conditions() {
        let decoder = Decoder::new(false).expect("a decoder");
        // ite gt; vmovgt.f32 s0, s1; vmovle.f32 s0, s2; vadd.f32 s0, s0, s0
        let code = [0xcc, 0xbf, 0xb0, 0xee, 0x60, 0x0a, 0xb0, 0xee, 0x41, 0x0a, 0x30, 0xee, 0x00, 0x0a];
        let block = decoder.decode(&code, 0x100);
        let told: Vec<_> = block.iter().map(|one| (one.name.as_str(), one.conditional)).collect();
        assert_eq!(told, [("ite", false), ("vmov.f32", true), ("vmov.f32", true)]);
        // A conditional branch contains its condition.
        let branch = decoder.decode(&[0x01, 0xd0], 0x100);
        assert_eq!((branch[0].name.as_str(), branch[0].conditional), ("b", true));
        assert_eq!(branch[0].flow(), Flow::Jump(0x106));
    }

    #[test]
    fn bytes_that_are_no_instruction_decode_to_nothing() {
        let decoder = Decoder::new(false).expect("a decoder");
        assert_eq!(decoder.decode(&[0xff, 0xff, 0xff, 0xff], 0), []);
        assert_eq!(decoder.decode(&[0xb0], 0), []);
    }
}
