//! The controller on its target: which compiler builds it, and what the machine code of the tick must not contain.
//!
//! Two worlds of machine. Where the toolchain carries the target's core library it builds normally. Elsewhere Debian's
//! second compiler comes with the library's sources and builds core itself; that needs `RUSTC_BOOTSTRAP`, which touches
//! only this one child process.

use std::fmt;
use std::path::Path;

use crate::step::{Gate, Invocation, Outcome};

/// Cortex-M4F with hardware floats of 32 bits.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";
/// The second compiler and its library sources.
pub(crate) const DEBIAN_PACKAGES: [&str; 2] = ["rustc-web", "rust-web-src"];
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
/// Its artifacts must not meet those of the first compiler.
const TARGET_DIR: &str = "target/thumb";

/// Most instructions of one tick of the joint, by observer order. Measured 161 and 181 with rustc 1.96, guard, switching
/// term, limits and fallback included; 8 % is room for another compiler. A tick that is no longer unrolled has some 40 %
/// more, and says so in no other way.
const MOST_INSTRUCTIONS: [(&str, usize); 2] = [("tick_of_order_2", 175), ("tick_of_order_3", 196)];

/// Who can build for the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Compiler {
    /// The toolchain in use has the target's core library.
    Toolchain,
    /// Debian's, which builds core from source.
    Debian,
}

impl Compiler {
    pub(crate) fn find() -> Option<Self> {
        let libraries = Invocation::new("rustc", &["--print", "target-libdir", "--target", TARGET]).answer();
        if libraries.is_some_and(|directory| holds_core(Path::new(&directory))) {
            return Some(Self::Toolchain);
        }
        let sysroot = Invocation::new(DEBIAN_RUSTC, &["--print", "sysroot"]).answer()?;
        let sources = Path::new(&sysroot).join("lib/rustlib/src/rust/library/core/Cargo.toml");
        sources.exists().then_some(Self::Debian)
    }

    /// `cargo VERB` for the target in release mode.
    fn cargo(self, verb: &str) -> Invocation {
        let common = Invocation::cargo(&[verb, "--release", "--target", TARGET, "--target-dir", TARGET_DIR]);
        match self {
            Self::Toolchain => common,
            Self::Debian => common.with(&["-Zbuild-std=core"]).env("RUSTC", DEBIAN_RUSTC).env("RUSTC_BOOTSTRAP", "1"),
        }
    }
}

impl fmt::Display for Compiler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Toolchain => write!(f, "the toolchain in use has {TARGET}"),
            Self::Debian => write!(f, "{DEBIAN_RUSTC} with its library sources"),
        }
    }
}

fn holds_core(directory: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(directory) else { return false };
    entries.flatten().any(|entry| entry.file_name().to_string_lossy().starts_with("libcore-"))
}

/// Builds the controller for the target with each feature set, then reads the machine code of the tick.
pub(crate) fn run(gate: &mut Gate, feature_sets: &[String]) -> Outcome {
    // `setup` ran before: there is one.
    let compiler = Compiler::find().unwrap_or(Compiler::Debian);
    let builds: Vec<Invocation> = feature_sets
        .iter()
        .map(|features| {
            compiler.cargo("build").with(&["-p", "controller-core", "--no-default-features", "--features", features])
        })
        .collect();
    gate.commands(&format!("controller-core for {TARGET}, {} feature sets", builds.len()), &builds)?;

    let assembly = gate.root.join(TARGET_DIR).join("tick.s");
    let emit = format!("--emit=asm={}", assembly.display());
    let compile =
        compiler.cargo("rustc").with(&["-p", "tick-fixture", "--lib", "--", "-C", "codegen-units=1", emit.as_str()]);
    gate.commands("machine code of the tick: compile", &[compile])?;
    gate.check("machine code of the tick: calls nothing, unrolled", "cargo xtask test", |_| {
        let text = std::fs::read_to_string(&assembly)
            .map_err(|error| format!("{}: {error}; remove {TARGET_DIR} and run again", assembly.display()))?;
        judge(&text)
    })
}

/// Counts of instructions as one line, or what the machine code has that it must not have.
fn judge(assembly: &str) -> Result<String, String> {
    let functions = functions(assembly);
    for (name, body) in &functions {
        let is_foreign = |callee: &&str| functions.iter().all(|(defined, _)| defined != callee);
        if let Some(foreign) = body.iter().copied().filter_map(callee).find(is_foreign) {
            return Err(format!(
                "{name} calls {foreign}, which is not part of the tick: a panic, a 64-bit float or a library function"
            ));
        }
    }
    let mut counts = Vec::new();
    for (wanted, most) in MOST_INSTRUCTIONS {
        let Some((_, body)) = functions.iter().find(|(name, _)| name.contains(wanted)) else {
            return Err(format!("{wanted} is not in the assembly: is it still public and inline(never)?"));
        };
        let count = body.len();
        if count > most {
            return Err(format!(
                "{wanted} has {count} instructions, more than {most}: is a loop of the tick no longer unrolled?"
            ));
        }
        counts.push(format!("{wanted}: {count} instructions (at most {most})"));
    }
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

/// Name and instructions of every function: in this syntax labels stand at the margin, directives begin with a dot.
fn functions(assembly: &str) -> Vec<(&str, Vec<&str>)> {
    let mut functions: Vec<(&str, Vec<&str>)> = Vec::new();
    for line in assembly.lines() {
        if let Some(label) = line.strip_suffix(':') {
            if !label.starts_with(['.', '\t', ' ']) {
                functions.push((label, Vec::new()));
            }
        } else if let (Some(instruction), Some((_, body))) = (line.strip_prefix('\t'), functions.last_mut())
            && instruction.starts_with(|c: char| c.is_ascii_alphabetic())
        {
            body.push(instruction);
        }
    }
    functions
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tick(extra: &str) -> String {
        let body = format!("\t.fnstart\n\tvldr\ts0, [r1]\n.LBB0_1:\n{extra}\tbx\tlr\n.LCPI0_0:\n\t.long\t0\n");
        format!("\t.globl\ttick_of_order_2\n_R1tick_of_order_2:\n{body}_R1tick_of_order_3:\n{body}")
    }

    #[test]
    fn only_instructions_are_counted() {
        let line = judge(&tick("")).expect("nothing foreign");
        assert!(line.starts_with("tick_of_order_2: 2 instructions"), "{line}");
    }

    #[test]
    fn a_call_of_the_panic_machinery_is_found() {
        let reason = judge(&tick("\tbl\t_RNvNt4core9panicking5panic\n")).expect_err("it panics");
        assert!(reason.contains("panicking"), "{reason}");
    }

    #[test]
    fn a_float_of_64_bits_a_jump_to_a_library_function_and_a_call_by_pointer_are_found() {
        for call in ["bl\t__aeabi_dmul", "b.w\tmemcpy", "beq.w\texpf", "blx\tr3"] {
            assert!(judge(&tick(&format!("\t{call}\n"))).is_err(), "{call}");
        }
    }

    #[test]
    fn jumps_inside_and_calls_of_each_other_are_no_fault() {
        for call in ["bhi.w\t.LBB0_3", "bl\t_R1tick_of_order_2", "bic\tr0, r1, r2", "bx\tlr", "bfi\tr0, r1, #0, #8"] {
            assert!(judge(&tick(&format!("\t{call}\n"))).is_ok(), "{call}");
        }
    }

    #[test]
    fn a_tick_grown_beyond_its_bound_is_found() {
        assert!(judge(&tick(&"\tnop\n".repeat(200))).is_err());
    }

    #[test]
    fn a_missing_tick_is_found() {
        assert!(judge("other:\n\tbx\tlr\n").is_err());
    }
}
