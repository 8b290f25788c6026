//! Cycle table of the Cortex-M4F: cycles per instruction, their source, and the interaction of neighbouring
//! instructions.
//!
//! Source: ARM DDI 0439D, *Cortex-M4 Technical Reference Manual* r0p1, Table 3-1 (integer), Table 3-2 (DSP), section
//! 3.3.2 (load/store timings), Table 7-1 and the notes of section 7.2.3 (FPU). The table has four readings:
//!
//! - **worst**, for the bound: uses no gain that the manual does not guarantee. Loads and stores never pipeline (note
//!   b: "they might not pipeline optimally"). A pipeline refill takes P = 3. An FPU result that the next instruction
//!   reads costs a cycle. An address costs a cycle if the previous instruction wrote one of its registers.
//! - **typical**, for an executed trace: P = 2. A load or store after a load is one cycle cheaper, unless the load
//!   wrote its address. A store to `[Rn, #imm]` takes one cycle. Operand stalls occur where the manual names them.
//! - **pipelined**: typical, with VLDR and VSTR treated as LDR and STR. They share the bus, and the manual neither
//!   guarantees nor excludes it. Published cycle counts based on this manual use this reading.
//! - **least**: P = 1, every possible folding and pipelining, conditional instructions not executed.
//!
//! Where the manual has two values, the worst reading uses the larger one. This concerns LDM and POP (3.3.2 "2+1+1 or
//! 5" for three registers, Table 3-1 gives 4), TBB and TBH (3.3.2 "at least six", Table 3-1 gives 2 + P), and a literal
//! load ("might add a cycle"). A transfer between a core register and the FPU takes 2 in Table 7-1 in every reading.

use crate::instruction::Instruction;

/// Assumption of every figure, in cycles or in instructions.
pub const RETURNS: &str = "`bx lr`, `pop {pc}`, `ldr pc, [sp]` and `mov pc, lr` are treated as returns";
/// Assumptions of every figure in cycles.
pub const ASSUMPTIONS: [&str; 7] = [
    "instruction timing of ARM DDI 0439D (Cortex-M4 r0p1): Tables 3-1, 3-2, 7-1, sections 3.3.2, 7.2.3",
    "zero wait states for code and data, code fetched over the ICode bus, no other bus master, accesses aligned",
    "bound: pipeline refill P = 3, no load or store pipelined, every operand and address stall taken",
    "typical: P = 2, loads and stores pipelined behind a load, named operand stalls",
    "least: P = 1, all pipelined, conditional instructions not executed",
    "no interrupt, no fault; entry and exit of an interrupt, and the call of the function itself, not counted",
    "in a handler, the 17 words that its first float instruction stores (lazy stacking of the FPU) not counted",
];

/// Reading of the cycle table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Upper bound: the maximum that the manual allows.
    Worst,
    /// Typical cycles of an executed trace.
    Typical,
    /// Typical cycles of an executed trace, if VLDR and VSTR pipeline as LDR and STR do.
    Pipelined,
    /// Lower bound: the minimum that the manual allows.
    Least,
    /// Instructions instead of cycles, for cores without a cycle table.
    Count,
}

impl Reading {
    /// Returns the cycles of a pipeline refill, P.
    pub(crate) fn refill(self) -> u64 {
        match self {
            Self::Worst => 3,
            Self::Typical | Self::Pipelined => 2,
            Self::Least => 1,
            Self::Count => 0,
        }
    }
}

/// Class of instructions with the same timing: one row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the rows of the table say what each is")]
pub enum Class {
    Integer,
    Multiply,
    Divide,
    Load,
    LoadDouble,
    LoadMultiple,
    Store,
    StoreMultiple,
    Exclusive,
    Branch,
    TableBranch,
    IfThen,
    Hint,
    System,
    Barrier,
    Wait,
    FloatArithmetic,
    FloatMultiplyAccumulate,
    FloatDivide,
    FloatCompare,
    FloatMove,
    FloatTransfer,
    FloatStatus,
    FloatLoad,
    FloatStore,
}

/// Cycles of an instruction class in one reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cycles {
    /// Constant number of cycles.
    Fixed(u64),
    /// Number of cycles plus one for each word moved.
    Words(u64),
    /// No documented maximum.
    Unbounded,
}

/// A row of the cycle table; a taken branch costs P more.
#[derive(Debug)]
pub struct Row {
    /// Instruction class of the row.
    pub class: Class,
    /// Name of the class in the histogram.
    pub label: &'static str,
    /// Mnemonics without condition, width, data type and the `s` of set flags.
    pub mnemonics: &'static [&'static str],
    /// Fewest cycles of an executed instruction.
    pub least: Cycles,
    /// Cycles in an executed trace.
    pub typical: Cycles,
    /// Most cycles, for the bound.
    pub worst: Cycles,
    /// Place in the manual, and its interpretation.
    pub source: &'static str,
}

use Cycles::{Fixed, Unbounded, Words};

const INTEGER: &[&str] = &[
    "mov", "movw", "movt", "mvn", "add", "addw", "adc", "adr", "sub", "subw", "sbc", "rsb", "and", "orr", "orn", "eor",
    "bic", "cmp", "cmn", "tst", "teq", "lsl", "lsr", "asr", "ror", "rrx", "clz", "sxtb", "sxth", "uxtb", "uxth",
    "sxtb16", "uxtb16", "sxtab", "sxtah", "sxtab16", "uxtab", "uxtah", "uxtab16", "ubfx", "sbfx", "bfc", "bfi", "rev",
    "rev16", "revsh", "rbit", "ssat", "usat", "ssat16", "usat16", "pkhbt", "pkhtb", "sel", "usad8", "usada8", "qadd",
    "qsub", "qdadd", "qdsub", "sadd8", "sadd16", "ssub8", "ssub16", "sasx", "ssax", "qadd8", "qadd16", "qsub8",
    "qsub16", "qasx", "qsax", "shadd8", "shadd16", "shsub8", "shsub16", "shasx", "shsax", "uadd8", "uadd16", "usub8",
    "usub16", "uasx", "usax", "uqadd8", "uqadd16", "uqsub8", "uqsub16", "uqasx", "uqsax", "uhadd8", "uhadd16",
    "uhsub8", "uhsub16", "uhasx", "uhsax",
];
const MULTIPLY: &[&str] = &[
    "mul", "mla", "mls", "smull", "umull", "smlal", "umlal", "umaal", "smmul", "smmulr", "smmla", "smmlar", "smmls",
    "smmlsr", "smlabb", "smlabt", "smlatb", "smlatt", "smulbb", "smulbt", "smultb", "smultt", "smulwb", "smulwt",
    "smlawb", "smlawt", "smuad", "smuadx", "smusd", "smusdx", "smlad", "smladx", "smlsd", "smlsdx", "smlald",
    "smlaldx", "smlsld", "smlsldx", "smlalbb", "smlalbt", "smlaltb", "smlaltt",
];

const fn row(
    class: Class,
    label: &'static str,
    mnemonics: &'static [&'static str],
    [least, typical, worst]: [Cycles; 3],
    source: &'static str,
) -> Row {
    Row { class, label, mnemonics, least, typical, worst, source }
}

/// The cycle table; each row has least, typical and worst cycles.
pub static TABLE: &[Row] = &[
    row(Class::Integer, "integer", INTEGER, [Fixed(1); 3], "Tables 3-1, 3-2"),
    row(Class::Multiply, "multiply", MULTIPLY, [Fixed(1); 3], "Tables 3-1, 3-2"),
    row(
        Class::Divide,
        "divide",
        &["sdiv", "udiv"],
        [Fixed(2), Fixed(12), Fixed(12)],
        "Table 3-1: 2 to 12 with the operands, which a trace does not show",
    ),
    row(
        Class::Load,
        "load",
        &["ldr", "ldrb", "ldrh", "ldrsb", "ldrsh", "ldrt", "ldrbt", "ldrht", "ldrsbt", "ldrsht"],
        [Fixed(1), Fixed(2), Fixed(2)],
        "Table 3-1 note b, 3.3.2; worst: a literal load 1 more; typical: behind a load 1 less",
    ),
    row(Class::LoadDouble, "load double", &["ldrd"], [Words(1); 3], "Table 3-1, 3.3.2: three, never pipelined"),
    row(
        Class::LoadMultiple,
        "load multiple, pop",
        &["ldm", "ldmia", "ldmdb", "pop"],
        [Words(1), Words(1), Words(2)],
        "Table 3-1: 1 + N; 3.3.2 prints \"2+1+1 or 5\" for N = 3, so worst: 2 + N",
    ),
    row(
        Class::Store,
        "store",
        &["str", "strb", "strh", "strt", "strbt", "strht"],
        [Fixed(1), Fixed(2), Fixed(2)],
        "Table 3-1; typical: [Rn, #imm] 1 (3.3.2: always one cycle), [Rn, Rm] 2, behind a load 1",
    ),
    row(
        Class::StoreMultiple,
        "store multiple, push",
        &["stm", "stmia", "stmdb", "strd", "push"],
        [Words(1); 3],
        "Table 3-1, 3.3.2: eight registers take nine",
    ),
    row(
        Class::Exclusive,
        "exclusive",
        &["ldrex", "ldrexb", "ldrexh", "strex", "strexb", "strexh", "clrex"],
        [Fixed(1), Fixed(2), Fixed(2)],
        "Table 3-1: 2, CLREX 1",
    ),
    row(Class::Branch, "branch", &["b", "bl", "bx", "blx", "cbz", "cbnz"], [Fixed(1); 3], "Table 3-1: 1, taken 1 + P"),
    row(
        Class::TableBranch,
        "table branch",
        &["tbb", "tbh"],
        [Fixed(2), Fixed(2), Fixed(3)],
        "Table 3-1: 2 + P; 3.3.2: at least 2 + 1 + 3, so worst: 3 + P",
    ),
    row(
        Class::IfThen,
        "if-then",
        &[
            "it", "itt", "ite", "ittt", "itte", "itet", "itee", "itttt", "ittte", "ittet", "ittee", "itett", "itete",
            "iteet", "iteee",
        ],
        [Fixed(0), Fixed(1), Fixed(1)],
        "Table 3-1 note d: 1, or folded into a preceding 16-bit instruction",
    ),
    row(Class::Hint, "hint", &["nop", "sev", "yield"], [Fixed(1); 3], "Table 3-1"),
    row(
        Class::System,
        "system register",
        &["cps", "cpsid", "cpsie", "mrs", "msr"],
        [Fixed(1), Fixed(2), Fixed(2)],
        "Table 3-1: 1 or 2",
    ),
    row(
        Class::Barrier,
        "barrier",
        &["dmb", "dsb", "isb"],
        [Fixed(1), Fixed(1), Unbounded],
        "Table 3-1: 1 + B, as long as the outstanding accesses take; B at least 0, of ISB at least P",
    ),
    row(Class::Wait, "wait", &["wfi", "wfe"], [Fixed(1), Unbounded, Unbounded], "Table 3-1: 1 + W, until an event"),
    row(
        Class::FloatArithmetic,
        "float add, multiply, convert",
        &["vadd", "vsub", "vmul", "vnmul", "vcvt", "vcvtr", "vcvtb", "vcvtt"],
        [Fixed(1); 3],
        "Table 7-1; 7.2.3: 1 more if the next instruction reads the result",
    ),
    row(
        Class::FloatMultiplyAccumulate,
        "float multiply-accumulate",
        &["vmla", "vmls", "vnmla", "vnmls", "vfma", "vfms", "vfnma", "vfnms"],
        [Fixed(3); 3],
        "Table 7-1; 7.2.3: takes its addend a cycle later, so typical: no stall on the addend",
    ),
    row(
        Class::FloatDivide,
        "float divide, root",
        &["vdiv", "vsqrt"],
        [Fixed(1), Fixed(14), Fixed(14)],
        "Table 7-1; 7.2.3: 1 if no more floating-point instruction is executed",
    ),
    row(Class::FloatCompare, "float compare", &["vcmp", "vcmpe"], [Fixed(1); 3], "Table 7-1"),
    row(
        Class::FloatMove,
        "float move, negate",
        &["vmov", "vabs", "vneg", "fconsts", "fcpys"],
        [Fixed(1); 3],
        "Table 7-1: immediate or float to float register; 7.2.2 calls none of them arithmetic",
    ),
    row(
        Class::FloatTransfer,
        "float from, to core register",
        &[],
        [Fixed(2); 3],
        "Table 7-1: one float or two to or from core registers 2; half of a double 1, taken as 2",
    ),
    row(Class::FloatStatus, "float status", &["vmrs", "vmsr", "fmstat"], [Fixed(1); 3], "Table 7-1"),
    row(
        Class::FloatLoad,
        "float load",
        &["vldr", "vldm", "vldmia", "vldmdb", "vpop"],
        [Words(0), Words(1), Words(1)],
        "Table 7-1: 1 + N single, 1 + 2N double; no pipelining documented, least: N; worst: a literal load 1 more",
    ),
    row(
        Class::FloatStore,
        "float store",
        &["vstr", "vstm", "vstmia", "vstmdb", "vpush"],
        [Words(0), Words(1), Words(1)],
        "Table 7-1: 1 + N single, 1 + 2N double; least: N",
    ),
];

impl Class {
    /// Returns the class of an instruction, or `None` if the table does not contain it.
    pub(crate) fn of(one: &Instruction) -> Option<Self> {
        let mut types = one.name.split('.');
        let stem = types.next()?;
        if !types.all(|kind| ["f32", "s32", "u32", "s16", "u16", "f16", "32"].contains(&kind)) {
            return None;
        }
        let find = |name: &str| TABLE.iter().find(|row| row.mnemonics.contains(&name)).map(|row| row.class);
        let class = find(stem).or_else(|| find(stem.strip_suffix('s')?))?;
        let named = |letters: &[char]| {
            let is = |word: &str| {
                word.starts_with(letters) && word[1..].chars().all(|c| c.is_ascii_digit()) && word.len() > 1
            };
            one.operands.iter().flat_map(|o| o.split(|c: char| !c.is_ascii_alphanumeric())).any(is)
        };
        let single_only = matches!(
            class,
            Self::FloatArithmetic | Self::FloatMultiplyAccumulate | Self::FloatDivide | Self::FloatCompare
        );
        match class {
            // 128-bit registers, and arithmetic on 64-bit registers, need another unit.
            _ if named(&['q']) || (single_only && named(&['d'])) => None,
            // The core has no ARM state.
            Self::Branch if stem == "blx" && one.operands.first().is_some_and(|operand| operand.starts_with('#')) => {
                None
            }
            Self::FloatMove if stem == "vmov" && (one.reads() | one.results()) & 0xffff != 0 => {
                Some(Self::FloatTransfer)
            }
            Self::FloatMove if named(&['d']) => None,
            class => Some(class),
        }
    }

    /// Returns the table row of the class.
    pub fn row(self) -> &'static Row {
        // The rows have the order of the classes; a test checks the order.
        &TABLE[self as usize]
    }
}

/// Returns the cycles of an executed instruction without the influence of its neighbours; `taken` adds the pipeline
/// refill.
///
/// # Errors
/// The reason, if the table has no number for the instruction.
pub(crate) fn own(one: &Instruction, taken: bool, reading: Reading) -> Result<u64, String> {
    if reading == Reading::Count {
        return Ok(1);
    }
    let class = Class::of(one).ok_or("the cycle table does not contain this instruction")?;
    let row = class.row();
    let mut cycles = match reading {
        Reading::Least => row.least,
        Reading::Typical | Reading::Pipelined => row.typical,
        _ => row.worst,
    };
    let soon = access(one, class, reading) == Some(Access::Store) && !one.has_register_offset();
    if soon && matches!(reading, Reading::Typical | Reading::Pipelined) {
        cycles = Fixed(1);
    }
    if one.stem() == "clrex" {
        cycles = Fixed(1);
    }
    let awaited = if one.stem() == "isb" { reading.refill() } else { 0 };
    let literal = reading == Reading::Worst && matches!(class, Class::Load | Class::FloatLoad) && one.is_literal_load();
    let refill = if taken { reading.refill() } else { 0 };
    match cycles {
        Fixed(cycles) => Ok(cycles + u64::from(literal) + refill + awaited),
        Words(first) => Ok(first + u64::from(one.words()) + u64::from(literal) + refill),
        Unbounded => Err(format!("no maximum number of cycles is documented ({})", row.source)),
    }
}

/// A load or store that may pipeline.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Access {
    Load,
    Store,
}

fn access(one: &Instruction, class: Class, reading: Reading) -> Option<Access> {
    let single = reading == Reading::Pipelined && one.words() == 1;
    match class {
        Class::Load => Some(Access::Load),
        Class::Store => Some(Access::Store),
        Class::FloatLoad if single && one.stem() == "vldr" => Some(Access::Load),
        Class::FloatStore if single && one.stem() == "vstr" => Some(Access::Store),
        _ => None,
    }
}

/// Returns the additional cycles of `one` (negative: saved) because `before` is executed directly before it.
pub(crate) fn after(before: &Instruction, one: &Instruction, reading: Reading) -> i64 {
    let (Some(first), Some(second)) = (Class::of(before), Class::of(one)) else { return 0 };
    // An instruction that is not executed neither stalls nor causes a stall.
    let may_fail = reading == Reading::Least && (before.conditional || one.conditional);
    if reading == Reading::Count || may_fail {
        return 0;
    }
    let worst = reading == Reading::Worst;
    let arithmetic = matches!(first, Class::FloatArithmetic | Class::FloatMultiplyAccumulate | Class::FloatDivide);
    // 7.2.3 gives examples only ("such as"), so the bound includes every FPU operation.
    let stalls =
        arithmetic || (worst && matches!(first, Class::FloatCompare | Class::FloatMove | Class::FloatTransfer));
    let addend = if second == Class::FloatMultiplyAccumulate && worst { one.results() } else { 0 };
    let operand = stalls && before.results() & (one.reads() | addend) != 0;
    // 3.3.2: no forwarding from data processing to an address.
    let of_data = matches!(first, Class::Integer | Class::Multiply | Class::Divide);
    let is_load = matches!(first, Class::Load | Class::LoadDouble | Class::LoadMultiple);
    let written = match (worst, of_data, is_load) {
        (_, true, _) | (true, _, false) => before.writes(),
        (true, _, true) => before.writes() & !before.results(),
        (false, ..) => 0,
    };
    // A transfer from the FPU to a core register may cause both stalls; the core waits once.
    let address = written & one.address_registers() != 0 && !operand;
    // 3.3.2: a load or store behind a load takes one cycle less, unless the load wrote its address.
    let pipelined = matches!(reading, Reading::Typical | Reading::Pipelined)
        && access(before, first, reading) == Some(Access::Load)
        && access(one, second, reading).is_some()
        && before.writes() & one.address_registers() == 0
        && own(one, false, reading) == Ok(2);
    i64::from(operand) + i64::from(address) - i64::from(pipelined)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instruction::parse;

    /// Returns the least, typical and worst cycles of an instruction without a taken branch.
    fn readings(text: &str) -> [Result<u64, String>; 3] {
        [Reading::Least, Reading::Typical, Reading::Worst].map(|reading| own(&parse(text), false, reading))
    }

    fn cycles(text: &str) -> [u64; 3] {
        readings(text).map(|one| one.unwrap_or_else(|reason| panic!("{text}: {reason}")))
    }

    #[test]
    fn every_class_has_its_row_at_its_place_and_every_mnemonic_one_row() {
        let mut seen = std::collections::BTreeSet::new();
        for (at, row) in TABLE.iter().enumerate() {
            assert_eq!(row.class as usize, at, "{}", row.label);
            assert!(row.source.contains("Table"), "{}", row.label);
            assert!(row.mnemonics.iter().all(|name| seen.insert(name)), "{}", row.label);
        }
    }

    /// At least one instruction of each class, against the numbers of the manual.
    #[test]
    fn cycles_are_those_of_the_manual() {
        for (text, expected) in [
            ("add r0, r1", [1, 1, 1]),
            ("movs r0, #1", [1, 1, 1]),
            ("muls r0, r1, r0", [1, 1, 1]),
            ("mla r0, r1, r2, r3", [1, 1, 1]),
            ("udiv r0, r1, r2", [2, 12, 12]),
            ("ldr r0, [r1, #4]", [1, 2, 2]),
            ("ldr r0, [pc, #4]", [1, 2, 3]),
            ("ldrd r0, r1, [r2]", [3, 3, 3]),
            ("ldm r0!, {r1, r2, r3}", [4, 4, 5]),
            ("str r0, [r1, #4]", [1, 1, 2]),
            ("str r0, [r1, r2]", [1, 2, 2]),
            ("stm r0!, {r1, r2, r3, r4, r5, r6, r7, r8}", [9, 9, 9]),
            ("push {r4, r5, lr}", [4, 4, 4]),
            ("strd r0, r1, [r2]", [3, 3, 3]),
            ("ldrex r0, [r1]", [1, 2, 2]),
            ("clrex", [1, 1, 1]),
            ("b #0x200", [1, 1, 1]),
            ("tbb [pc, r0]", [2, 2, 3]),
            ("ite eq", [0, 1, 1]),
            ("nop", [1, 1, 1]),
            ("mrs r0, primask", [1, 2, 2]),
            ("vadd.f32 s0, s1, s2", [1, 1, 1]),
            ("vcvt.f32.s32 s0, s0", [1, 1, 1]),
            ("vmla.f32 s0, s1, s2", [3, 3, 3]),
            ("vdiv.f32 s0, s1, s2", [1, 14, 14]),
            ("vcmp.f32 s0, #0", [1, 1, 1]),
            ("vmov.f32 s0, s1", [1, 1, 1]),
            ("vneg.f32 s0, s1", [1, 1, 1]),
            ("vmov s0, r1", [2, 2, 2]),
            ("vmov r0, r1, d1", [2, 2, 2]),
            ("vmrs apsr_nzcv, fpscr", [1, 1, 1]),
            ("vldr s0, [r1]", [1, 2, 2]),
            ("vldr d0, [r1]", [2, 3, 3]),
            ("vldr s0, [pc, #8]", [1, 2, 3]),
            ("vldmia r0, {s2, s3, s4, s5}", [4, 5, 5]),
            ("vpop {d8, d9}", [4, 5, 5]),
            ("vstr s0, [r1]", [1, 2, 2]),
            ("vpush {d8}", [2, 3, 3]),
        ] {
            assert_eq!(cycles(text), expected, "{text}");
        }
    }

    #[test]
    fn a_taken_branch_costs_the_refill_of_its_reading() {
        let taken = |text| [Reading::Least, Reading::Typical, Reading::Worst].map(|r| own(&parse(text), true, r));
        assert_eq!(taken("bx lr"), [Ok(2), Ok(3), Ok(4)]);
        assert_eq!(taken("pop {r4, pc}"), [Ok(4), Ok(5), Ok(7)]);
        // 3.3.2: "at least six".
        assert_eq!(taken("tbh [pc, r0, lsl #1]"), [Ok(3), Ok(4), Ok(6)]);
    }

    #[test]
    fn waiting_has_no_bound() {
        assert!(readings("dsb sy")[2].is_err());
        assert_eq!(readings("isb sy")[..2], [Ok(2), Ok(3)]);
        assert!(readings("wfi").iter().skip(1).all(Result::is_err));
    }

    #[test]
    fn what_the_core_does_not_have_is_not_in_the_table() {
        for text in [
            "vadd.f64 d0, d1, d2",
            "vadd.f32 d0, d1, d2",
            "vadd.i32 q0, q1, q2",
            "vmov.f64 d0, d1",
            "vcvt.f64.f32 d0, s0",
            "vselgt.f32 s0, s1, s2",
            "vmaxnm.f32 s0, s1, s2",
            "blx #0x200",
            "svc #1",
            "bkpt #1",
            "pld [r0]",
            "mcr p15, #0, r0, c7, c5, #4",
        ] {
            assert_eq!(Class::of(&parse(text)), None, "{text}");
        }
    }

    #[test]
    fn a_result_of_the_fpu_read_at_once_costs_a_cycle() {
        let pair = |before, one| {
            [Reading::Least, Reading::Typical, Reading::Worst]
                .map(|reading| after(&parse(before), &parse(one), reading))
        };
        let add = "vadd.f32 s0, s1, s2";
        assert_eq!(pair(add, "vmul.f32 s3, s0, s4"), [1, 1, 1]);
        assert_eq!(pair(add, "vstr s0, [r0]"), [1, 1, 1]);
        assert_eq!(pair(add, "vmul.f32 s0, s3, s4"), [0, 0, 0]);
        assert_eq!(pair(add, "vmov d4, r0, r1"), [0, 0, 0]);
        assert_eq!(pair("vldr s0, [r1]", "vmul.f32 s3, s0, s4"), [0, 0, 0]);
        // The manual does not name a comparison, and an addend is read a cycle later: only the bound counts these
        // stalls.
        assert_eq!(pair("vcmp.f32 s0, s1", "vmrs apsr_nzcv, fpscr"), [0, 0, 1]);
        assert_eq!(pair("vneg.f32 s0, s1", "vadd.f32 s2, s0, s0"), [0, 0, 1]);
        assert_eq!(pair(add, "vmla.f32 s0, s3, s4"), [0, 0, 1]);
        assert_eq!(pair(add, "vmla.f32 s3, s0, s4"), [1, 1, 1]);
    }

    #[test]
    fn an_address_from_the_instruction_before_costs_a_cycle() {
        let pair = |before, one| {
            [Reading::Least, Reading::Typical, Reading::Worst]
                .map(|reading| after(&parse(before), &parse(one), reading))
        };
        assert_eq!(pair("add r1, r2", "vldr s0, [r1]"), [1, 1, 1]);
        assert_eq!(pair("sub sp, #16", "push {r4, lr}"), [1, 1, 1]);
        assert_eq!(pair("add r3, r2", "vldr s0, [r1]"), [0, 0, 0]);
        // The manual does not name a register written back by a load: only the bound counts this stall.
        assert_eq!(pair("ldr r0, [r1], #4", "vldr s0, [r1]"), [0, 0, 1]);
        assert_eq!(pair("ldr r1, [r0]", "vldr s0, [r1]"), [0, 0, 0]);
    }

    /// The four examples of section 3.3.2 in order, and the exception.
    #[test]
    fn typical_loads_pipeline_as_the_manual_shows_and_the_bound_takes_none_of_it() {
        let total = |lines: &[&str], reading| {
            let all: Vec<Instruction> = lines.iter().map(|line| parse(line)).collect();
            let own: i64 = all.iter().map(|one| own(one, false, reading).expect("tabled") as i64).sum();
            own + all.windows(2).map(|pair| after(&pair[0], &pair[1], reading)).sum::<i64>()
        };
        for (lines, typical, worst) in [
            (&["ldr r0, [r1]", "ldr r1, [r2]"][..], 3, 4),
            (&["ldr r0, [r1, r2]", "str r0, [r3, #20]"], 3, 4),
            (&["ldr r0, [r1, r2]", "str r1, [r3, r2]"], 3, 4),
            (&["ldr r0, [r1, r5]", "ldr r1, [r2]", "ldr r2, [r3, #4]"], 4, 6),
            (&["ldr r1, [r0]", "ldr r2, [r1]"], 4, 4),
        ] {
            assert_eq!(total(lines, Reading::Typical), typical, "{lines:?}");
            assert_eq!(total(lines, Reading::Worst), worst, "{lines:?}");
        }
    }

    #[test]
    fn float_loads_and_stores_pipeline_only_where_that_is_supposed() {
        let lines = ["vldr s0, [r0]", "vldr s1, [r0, #4]", "vstr s0, [r1]", "vadd.f32 s2, s0, s1", "vstr s2, [r1, #4]"];
        let all: Vec<Instruction> = lines.iter().map(|line| parse(line)).collect();
        let total = |reading| {
            let own: i64 = all.iter().map(|one| own(one, false, reading).expect("tabled") as i64).sum();
            own + all.windows(2).map(|pair| after(&pair[0], &pair[1], reading)).sum::<i64>()
        };
        // The very next instruction stores the sum: 1 more in every reading.
        assert_eq!([Reading::Typical, Reading::Pipelined, Reading::Worst].map(total), [10, 7, 10]);
        let pair = |before, one| after(&parse(before), &parse(one), Reading::Pipelined);
        assert_eq!(pair("ldr r1, [r0]", "vldr s0, [r1]"), 0, "its address was just loaded");
        assert_eq!(pair("vldr s0, [r0]", "ldr r1, [r0]"), -1);
        assert_eq!(pair("vldr s0, [r0]", "vpop {d8}"), 0, "several words never");
        assert_eq!(pair("vldr d0, [r0]", "vldr s2, [r0]"), 0, "several words never");
    }

    #[test]
    fn least_is_at_most_typical_and_typical_at_most_worst() {
        let number = |cycles| match cycles {
            Fixed(n) | Words(n) => n,
            Unbounded => u64::MAX,
        };
        for row in TABLE {
            let [least, typical, worst] = [row.least, row.typical, row.worst].map(number);
            assert!(least <= typical && typical <= worst, "{}", row.label);
        }
    }
}
