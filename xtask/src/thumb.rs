//! The controller on its target: every feature set builds, and what the machine code of the tick must not contain.

use crate::compiler::{Compiler, TARGET};
use crate::step::{Gate, Outcome};

/// Its artifacts must not meet those of the first compiler.
const TARGET_DIR: &str = "target/thumb";

/// The instances of the tick and the most instructions that each may have, 3 % above what rustc 1.96 makes of them:
/// 186, 208 and 158, coefficients read by reference, guard, switching term, limits and fallback included. A tick that
/// is no longer unrolled has some 40 % more, and says so in no other way.
const TICKS: [(&str, usize); 3] = [("tick_of_order_2", 192), ("tick_of_order_3", 215), ("tick_without_channel_2", 163)];

/// Additions, subtractions and multiplications that a mismatched channel of order 2 costs: the innovation 5
/// (difference, its rate, h, less h, less P), the observer 5, y 1, B in σ 2, B in the law 2, P 1. Exactly these are
/// missing where the channel has no observer.
const ARITHMETIC_OF_CHANNEL_2: usize = 16;

/// What the tick does not contain, by the first letters of the instruction, and why.
const FORBIDDEN: [(&str, &str); 8] = [
    ("vdiv", "a division takes 14 cycles: a constant one belongs to the design"),
    ("vsqrt", "a root takes 14 cycles"),
    ("vfma", "a fused operation rounds once, a multiplication and an addition twice: other bits than on the host"),
    ("vfms", "a fused operation rounds once, a multiplication and a subtraction twice: other bits than on the host"),
    ("vfnm", "a fused operation rounds once, a multiplication and a subtraction twice: other bits than on the host"),
    ("vmla", "3 cycles instead of 1 + 1: is target-cpu=cortex-m4 still in .cargo/config.toml?"),
    ("vmls", "3 cycles instead of 1 + 1: is target-cpu=cortex-m4 still in .cargo/config.toml?"),
    ("vnml", "3 cycles instead of 1 + 1: is target-cpu=cortex-m4 still in .cargo/config.toml?"),
];

/// Builds the controller for the target with each feature set, then reads the machine code of the tick.
pub(crate) fn run(gate: &mut Gate, feature_sets: &[String]) -> Outcome {
    let compiler = Compiler::required()?;
    let cargo = |verb| compiler.cargo(verb).with(&["--target-dir", TARGET_DIR]);
    let builds: Vec<_> = feature_sets
        .iter()
        .map(|features| {
            cargo("build").with(&["-p", "controller-core", "--no-default-features", "--features", features])
        })
        .collect();
    gate.commands(&format!("controller-core for {TARGET}, {} feature sets", builds.len()), &builds)?;

    let assembly = gate.root.join(TARGET_DIR).join("tick.s");
    let emit = format!("--emit=asm={}", assembly.display());
    let compile = cargo("rustc").with(&["-p", "tick-fixture", "--lib", "--", "-C", "codegen-units=1", emit.as_str()]);
    gate.commands("machine code of the tick: compile", &[compile])?;
    gate.check("machine code of the tick: no call, division, fusion or loop", "cargo xtask test", |_| {
        let text = std::fs::read_to_string(&assembly)
            .map_err(|error| format!("{}: {error}; remove {TARGET_DIR} and run again", assembly.display()))?;
        judge(&text)
    })
}

/// Counts of instructions as one line, or what the machine code has that it must not have.
fn judge(assembly: &str) -> Result<String, String> {
    let functions = functions(assembly);
    for function in &functions {
        if let Some(callee) = function.instructions.iter().copied().find_map(callee) {
            return Err(format!(
                "{} calls {callee}, which is no part of it: a panic, a 64-bit float or a library function",
                function.name
            ));
        }
    }
    let mut counts = Vec::new();
    let mut arithmetic = Vec::new();
    for (name, most) in TICKS {
        let Some(tick) = functions.iter().find(|function| function.name.contains(name)) else {
            return Err(format!("{name} is not in the assembly: is it still public and inline(never)?"));
        };
        for instruction in &tick.instructions {
            if let Some((_, reason)) = FORBIDDEN.iter().find(|(letters, _)| instruction.starts_with(letters)) {
                return Err(format!("{name} contains `{}`: {reason}", instruction.replace('\t', " ")));
            }
        }
        if let Some(branch) = tick.backward_branch() {
            return Err(format!("{name} goes back at `{}`: it has a loop", branch.replace('\t', " ")));
        }
        let count = tick.instructions.len();
        if count > most {
            return Err(format!(
                "{name} has {count} instructions, more than {most}: is a loop of the tick no longer unrolled?"
            ));
        }
        counts.push(format!("{name}: {count} instructions (at most {most})"));
        arithmetic.push(tick.arithmetic());
    }
    if arithmetic[0] != arithmetic[2] + ARITHMETIC_OF_CHANNEL_2 {
        return Err(format!(
            "{} has {} additions and multiplications, {} has {}: an absent channel must save exactly its own {}",
            TICKS[0].0, arithmetic[0], TICKS[2].0, arithmetic[2], ARITHMETIC_OF_CHANNEL_2
        ));
    }
    counts.push(format!("an absent channel saves its {ARITHMETIC_OF_CHANNEL_2} additions and multiplications"));
    Ok(counts.join(", "))
}

/// Where a call or a jump out of the function goes; a register is named as it is.
fn callee(instruction: &str) -> Option<&str> {
    let (mnemonic, operand) = instruction.split_once('\t')?;
    let mnemonic = mnemonic.trim_end_matches(".w").trim_end_matches(".n");
    // b, bl, blx and the conditional ones such as bhi; not bic, bfi, bfc, bkpt, nor the return `bx lr`.
    let conditions =
        ["", "l", "lx", "eq", "ne", "hs", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le"];
    let leaves = mnemonic.strip_prefix('b').is_some_and(|rest| conditions.contains(&rest));
    (leaves && !operand.starts_with(".L")).then_some(operand)
}

struct Function<'a> {
    name: &'a str,
    instructions: Vec<&'a str>,
    /// Local labels, each with the number of instructions before it.
    labels: Vec<(&'a str, usize)>,
}

impl<'a> Function<'a> {
    /// A jump to where the function has been: the one form a loop takes.
    fn backward_branch(&self) -> Option<&'a str> {
        self.instructions.iter().enumerate().find_map(|(at, &instruction)| {
            let jumps = ["b", "cb"].iter().any(|letters| instruction.starts_with(letters));
            let (_, target) = instruction.rsplit_once(['\t', ' '])?;
            let goes_back = self.labels.iter().any(|&(label, position)| label == target && position <= at);
            (jumps && goes_back).then_some(instruction)
        })
    }

    /// Number of additions, subtractions and multiplications.
    fn arithmetic(&self) -> usize {
        let of = |instruction: &str| ["vadd", "vsub", "vmul", "vnmul"].iter().any(|m| instruction.starts_with(m));
        self.instructions.iter().filter(|instruction| of(instruction)).count()
    }
}

/// Every function of the text: labels stand at the margin, local ones begin with a dot, and so do directives after a
/// tab.
fn functions(assembly: &str) -> Vec<Function<'_>> {
    let mut functions: Vec<Function<'_>> = Vec::new();
    for line in assembly.lines() {
        if let Some(label) = line.strip_suffix(':') {
            if !label.starts_with(['.', '\t', ' ']) {
                functions.push(Function { name: label, instructions: Vec::new(), labels: Vec::new() });
            } else if let Some(function) = functions.last_mut() {
                function.labels.push((label, function.instructions.len()));
            }
        } else if let (Some(instruction), Some(function)) = (line.strip_prefix('\t'), functions.last_mut())
            && instruction.starts_with(|c: char| c.is_ascii_alphabetic())
        {
            function.instructions.push(instruction);
        }
    }
    functions
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The three ticks, `extra` in each, and in the first two the arithmetic of a channel.
    fn ticks(extra: &str) -> String {
        let channel = "\tvmul.f32\ts0, s1, s2\n".repeat(ARITHMETIC_OF_CHANNEL_2);
        let body = |k: usize, channel: &str| {
            let inside = extra.replace("LBB0", &format!("LBB{k}"));
            format!("\t.fnstart\n\tvldr\ts0, [r1]\n.LBB{k}_1:\n{channel}{inside}\tbx\tlr\n.LBB{k}_9:\n\t.long\t0\n")
        };
        let [two, three, without] = [body(0, &channel), body(1, &channel), body(2, "")];
        format!("_R1tick_of_order_2:\n{two}_R1tick_of_order_3:\n{three}_R1tick_without_channel_2:\n{without}")
    }

    #[test]
    fn only_instructions_are_counted() {
        let line = judge(&ticks("")).expect("nothing forbidden");
        assert!(line.starts_with("tick_of_order_2: 18 instructions"), "{line}");
    }

    #[test]
    fn a_call_of_the_panic_machinery_is_found() {
        let reason = judge(&ticks("\tbl\t_RNvNt4core9panicking5panic\n")).expect_err("it panics");
        assert!(reason.contains("panicking"), "{reason}");
    }

    #[test]
    fn a_float_of_64_bits_a_jump_to_a_library_function_and_a_call_by_pointer_are_found() {
        for call in ["bl\t__aeabi_dmul", "b.w\tmemcpy", "beq.w\texpf", "blx\tr3", "bl\t_R1tick_of_order_2"] {
            assert!(judge(&ticks(&format!("\t{call}\n"))).is_err(), "{call}");
        }
    }

    #[test]
    fn a_division_a_root_and_a_fused_or_slow_multiply_add_are_found() {
        for bad in ["vdiv", "vsqrt", "vfma", "vfms", "vfnma", "vfnms", "vmla", "vmls", "vnmla", "vnmls"] {
            let reason = judge(&ticks(&format!("\t{bad}.f32\ts0, s1, s2\n"))).expect_err(bad);
            assert!(reason.contains(bad), "{reason}");
        }
        judge(&ticks("\tvnmul.f32\ts0, s1, s2\n\tvneg.f32\ts0, s1\n")).expect("both are plain");
    }

    #[test]
    fn a_jump_back_is_a_loop_and_a_jump_forward_is_none() {
        for back in ["bhi.w\t.LBB0_1", "b\t.LBB0_1", "cbnz\tr3, .LBB0_1"] {
            let reason = judge(&ticks(&format!("\t{back}\n"))).expect_err(back);
            assert!(reason.contains("loop"), "{reason}");
        }
        for other in ["bhi.w\t.LBB0_9", "cbz\tr3, .LBB0_9", "bic\tr0, r1, r2", "bx\tlr", "bfi\tr0, r1, #0, #8"] {
            assert!(judge(&ticks(&format!("\t{other}\n"))).is_ok(), "{other}");
        }
    }

    #[test]
    fn a_tick_grown_beyond_its_bound_is_found() {
        assert!(judge(&ticks(&"\tnop\n".repeat(200))).is_err());
    }

    #[test]
    fn an_absent_channel_that_still_computes_is_found() {
        let computes =
            ticks("").replace("_R1tick_without_channel_2:\n", "_R1tick_without_channel_2:\n\tvadd.f32\ts0, s0, s0\n");
        let reason = judge(&computes).expect_err("one addition of the absent channel is left");
        assert!(reason.contains("absent channel"), "{reason}");
    }

    #[test]
    fn a_missing_tick_is_found() {
        assert!(judge("other:\n\tbx\tlr\n").is_err());
    }
}
