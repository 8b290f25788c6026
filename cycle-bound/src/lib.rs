#![doc = include_str!("../README.md")]
//!
//! ## Modules
//!
//! ```text
//! image (ELF) -> instruction (decoder) -> analysis (paths, calls, stack) -> graph (longest path) -> report `- cycles
//! (the table) -- trace (executed code) -- emulated (QEMU, log) specification of a function -> meaning (symbolic
//! execution of every path, comparison for all inputs) file of limits -> ceilings (all functions of the file, each
//! figure against its limit)
//! ```

mod analysis;
pub mod ceilings;
pub mod cycles;
pub mod emulated;
mod encoding;
mod graph;
pub mod image;
mod image_file;
mod instruction;
mod lines;
pub mod log;
pub mod meaning;
pub mod qemu;
pub mod report;
pub mod trace;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use analysis::{Analyst, Node, Refusal, Summary};
use cycles::Class;
use image::{Function, Image};
use instruction::Decoder;
use report::{Report, Typical};
use whole_file::FileKind;

/// Processor core of the firmware.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Core {
    /// Cortex-M4: in-order, three stages; the manual has a cycle table.
    #[default]
    CortexM4,
    /// Cortex-M7: dual issue, caches, branch prediction; ARM publishes no cycle table.
    CortexM7,
    /// Cortex-M33: ARM publishes no cycle table.
    CortexM33,
}

impl Core {
    /// Returns the name of the core on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::CortexM4 => "cortex-m4",
            Self::CortexM7 => "cortex-m7",
            Self::CortexM33 => "cortex-m33",
        }
    }

    fn is_timed(self) -> bool {
        self == Self::CortexM4
    }
}

/// Options of the command line.
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
#[derive(Args, Clone, Debug, Default)]
pub struct Options {
    /// Linked firmware (ELF).
    #[arg(long, value_name = "FILE", required_unless_present = "ceilings")]
    pub elf: Option<PathBuf>,
    /// Function: its name (mangled or not), a unique part of its name, or its first address.
    #[arg(long, value_name = "NAME", required_unless_present_any = ["ceilings", "means"])]
    pub symbol: Option<String>,
    /// Specifications to compare the machine code with, each for the function that it names.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["ceilings", "trace", "emulate"])]
    pub means: Vec<PathBuf>,
    /// File of limits: check all functions of FILE instead of one function.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["elf", "symbol", "core", "max_cycles", "no_panic",
        "no_double", "no_division", "no_call", "no_backward_branch", "no_fused", "loops", "barrier",
        "trace", "emulate", "lines"])]
    pub ceilings: Option<PathBuf>,
    /// Lower every limit of the file to its figure; exceeded limits stay for manual review.
    #[arg(long, requires = "ceilings")]
    pub lower: bool,
    /// Write the firmware's compiler and figures into the file, if its limits belong to another compiler.
    #[arg(long, requires = "ceilings", conflicts_with = "lower")]
    pub record: bool,
    /// Processor core; only the Cortex-M4 has a published cycle table, other cores count instructions only.
    #[arg(long, value_enum, default_value_t)]
    pub core: Core,
    /// Maximum bound in cycles; a larger bound fails.
    #[arg(long, value_name = "N")]
    pub max_cycles: Option<u64>,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    pub json: bool,
    /// Fail if a panic, a trap or a path that never returns is reached.
    #[arg(long)]
    pub no_panic: bool,
    /// Fail if 64-bit floating point is reached.
    #[arg(long)]
    pub no_double: bool,
    /// Fail if a division or a square root is reached.
    #[arg(long)]
    pub no_division: bool,
    /// Fail if the function calls another function or jumps to it.
    #[arg(long)]
    pub no_call: bool,
    /// Fail if the function has a backward jump (a loop).
    #[arg(long)]
    pub no_backward_branch: bool,
    /// Fail if a multiply-accumulate is reached: VFMA rounds once, and VFMA and VMLA take 3 cycles instead of 1 + 1.
    #[arg(long)]
    pub no_fused: bool,
    /// Loop limit: the first instruction of the loop, at PLACE (0x.., SYMBOL+0x..), executes at most N times per entry.
    #[arg(long = "loop", value_name = "PLACE=N")]
    pub loops: Vec<String>,
    /// Maximum wait of a barrier (DSB, DMB, ISB) in cycles; without it a function with a barrier has no bound.
    #[arg(long, value_name = "N")]
    pub barrier: Option<u64>,
    /// Trace of executed addresses in QEMU's format (256 MiB at most), for typical cycles.
    #[arg(long, value_name = "FILE", group = "executed")]
    pub trace: Option<PathBuf>,
    /// Run the firmware in the emulator (an STM32F405), for typical cycles.
    #[arg(long, group = "executed")]
    pub emulate: bool,
    /// Print the executed cycles per source line; needs debug information in the ELF file.
    #[arg(long, requires = "executed")]
    pub lines: bool,
}

/// Property that the reached code must not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Check {
    /// A panic, a trap or a path that never returns.
    Panic,
    /// 64-bit floating point.
    Double,
    /// A division or a square root.
    Division,
    /// A call or a jump to another function.
    Call,
    /// A backward jump: a loop.
    BackwardBranch,
    /// A multiply-accumulate, VMLA or VFMA.
    Fused,
}

impl Check {
    /// All checks, in the order of their output.
    pub const ALL: [Self; 6] =
        [Self::Panic, Self::Double, Self::Division, Self::Call, Self::BackwardBranch, Self::Fused];

    /// Returns the key of the check in a file of limits.
    pub fn name(self) -> &'static str {
        match self {
            Self::Panic => "panic",
            Self::Double => "double",
            Self::Division => "division",
            Self::Call => "call",
            Self::BackwardBranch => "backward_branch",
            Self::Fused => "fused",
        }
    }
}

impl Options {
    fn asks(&self, check: Check) -> bool {
        match check {
            Check::Panic => self.no_panic,
            Check::Double => self.no_double,
            Check::Division => self.no_division,
            Check::Call => self.no_call,
            Check::BackwardBranch => self.no_backward_branch,
            Check::Fused => self.no_fused,
        }
    }
}

/// Output of the program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    /// Output for stdout: an aligned table, or one JSON object.
    pub text: String,
    /// Lines for stderr: notes, rejected code and failed checks.
    pub remarks: Vec<String>,
    /// Exit status: 0 all figures valid, 1 a check failed, 2 code rejected (with address and reason).
    pub status: u8,
}

impl Reply {
    fn of(
        answer: &(impl Serialize + std::fmt::Display),
        is_json: bool,
        [notes, declined, failures]: [&[String]; 3],
    ) -> Result<Self, String> {
        let text = if is_json {
            serde_json::to_string(answer).map_err(|error| format!("the answer cannot be written as JSON: {error}"))?
        } else {
            answer.to_string()
        };
        let kinds = [("note", notes), ("declined", declined), ("failed", failures)];
        let of_kind = |(kind, lines): (&str, &[String])| -> Vec<String> {
            lines.iter().map(|line| format!("{kind}: {line}")).collect()
        };
        let status = match (declined, failures) {
            ([], []) => 0,
            ([], _) => 1,
            _ => 2,
        };
        Ok(Self { text: text.trim_end().to_owned(), remarks: kinds.into_iter().flat_map(of_kind).collect(), status })
    }
}

/// Runs the whole program except its console output: one function, or with `--ceilings` all functions of a file.
///
/// # Errors
/// Invalid input, in one line; the exit status is 2.
pub fn run(options: &Options, stop: &AtomicBool) -> Result<Reply, String> {
    if let Some(file) = &options.ceilings {
        let write = match (options.lower, options.record) {
            (true, _) => Some(ceilings::Write::Lowered),
            (_, true) => Some(ceilings::Write::Recorded),
            _ => None,
        };
        let verdict = ceilings::run(file, write, stop)?;
        Reply::of(&verdict, options.json, [&verdict.notes, &verdict.declined, &verdict.failures])
    } else if let (Some(elf), [_, ..]) = (&options.elf, &options.means[..]) {
        let answer = meaning::run(elf, options, stop)?;
        Reply::of(&answer, options.json, [&[], &answer.declined, &answer.failures])
    } else {
        let report = report_of(options, stop)?;
        Reply::of(&report, options.json, [&[], &report.declined, &report.failures])
    }
}

/// Analyses a function of a firmware file, with its trace if the options request one.
///
/// # Errors
/// Invalid input, in one line.
pub fn report_of(options: &Options, stop: &AtomicBool) -> Result<Report, String> {
    let Some(elf) = &options.elf else { return Err("--elf FILE is missing".into()) };
    let image = Image::read(&image_file::read(elf)?).map_err(|reason| of_file(elf, &reason))?;
    let mut answer = Answer::of(&image, options)?;
    if let Some(path) = &options.trace {
        // Names in a log may have any encoding; addresses are ASCII.
        let log = whole_file::read(path, FileKind::TRACE).map_err(|reason| of_file(path, &reason))?;
        answer.price(&trace::addresses(&String::from_utf8_lossy(&log)), options.lines.then_some(&image));
    } else if options.emulate {
        answer.price(&emulated::executed(elf, &answer.ranges(), stop)?, options.lines.then_some(&image));
    }
    Ok(answer.report)
}

/// Returns the error message of a file.
fn of_file(path: &Path, reason: &dyn std::fmt::Display) -> String {
    format!("{}: {reason}", path.display())
}

/// An analysed function: its report, and the code that a trace is compared with.
pub struct Answer {
    /// Report of the function.
    pub report: Report,
    /// Findings of all checks, requested or not.
    pub found: Vec<(Check, String)>,
    reached: Vec<Rc<Summary>>,
    /// First address and length of every reached function.
    ranges: Vec<(u32, u32)>,
    /// Address of a reached function in an overlay: a trace does not show which section was loaded.
    overlaid: Option<u32>,
}

impl Answer {
    /// Analyses the function that the options name.
    ///
    /// # Errors
    /// Invalid input, in one line.
    pub fn of(image: &Image, options: &Options) -> Result<Self, String> {
        let function = image.find(options.symbol.as_deref().unwrap_or_default())?;
        let image = &*image.while_runs(function);
        let loops = parse_loops(image, &options.loops)?;
        let decoder = Decoder::new(!options.core.is_timed())?;
        let timed = options.core.is_timed();
        let mut analyst = Analyst::new(image, decoder, loops.clone(), timed).with_barrier(options.barrier);
        let summary = analyst.read(function);
        let reached = analyst.reached(&summary);
        for header in loops.keys() {
            if !reached.iter().any(|one| one.nodes.contains_key(header)) {
                return Err(format!("--loop {}: the function does not reach this place", image.place(*header)));
            }
        }
        let functions: Vec<&Function> = reached.iter().filter_map(|one| image.function_at(one.start)).collect();
        let mut report = Report::new(options, function, &summary);
        if let Some(cycles) = options.barrier.filter(|_| timed) {
            report.assumptions.push(format!("declared: a barrier waits {cycles} cycles at most"));
        }
        for (header, count) in loops.iter().filter(|_| timed) {
            let place = image.place(*header);
            let rounds = format!("declared: {place} is executed {count} times at most per entry of its loop");
            report.assumptions.push(rounds);
        }
        report.functions = functions.iter().map(|one| one.name().to_owned()).collect();
        let ranges: Vec<(u32, u32)> = functions.iter().map(|one| (one.start, one.end - one.start)).collect();
        report.flash_bytes = covered(&ranges);
        if !summary.returns {
            report.declined.push(format!("{}: no path returns", image.place(function.start)));
        }
        report.declined.extend(analyst.refusals(&summary).iter().map(|refusal| told(image, refusal)));
        if let Some(Err(refusal)) = &summary.stack {
            report.declined.push(format!("stack: {}", told(image, refusal)));
        }
        let found = found(image, &reached, &functions);
        let asked = found.iter().filter(|(check, _)| options.asks(*check));
        report.failures = asked.map(|(_, line)| line.clone()).collect();
        if let Some(most) = options.max_cycles {
            if let Some(bound) = report.bound().filter(|bound| *bound > most) {
                report.failures.push(format!("bound of {bound} cycles, more than {most}"));
            }
            if !timed {
                report.declined.push(format!(
                    "--max-cycles: ARM publishes no cycle table for the {}, so only counts are available",
                    options.core.name()
                ));
            }
        }
        let overlaid = reached.iter().map(|one| one.start).find(|&start| image.is_overlaid(start));
        Ok(Self { report, found, reached, ranges, overlaid })
    }

    /// Returns the first address and the length of every reached function: the ranges that a trace must contain.
    pub fn ranges(&self) -> Vec<(u32, u32)> {
        self.ranges.clone()
    }

    /// Returns whether every instruction was followed, so that the checks cover all code. A loop without a limit is
    /// allowed.
    pub fn is_read(&self) -> bool {
        self.reached.iter().flat_map(|one| one.nodes.values()).all(|node| node.refusal().is_none())
    }

    /// Adds the cycles of the calls in a trace; per source line if a firmware is given.
    pub fn price(&mut self, executed: &[u32], lines_of: Option<&Image>) {
        let report = &mut self.report;
        if report.core != Core::CortexM4.name() {
            report.declined.push(format!("trace: no cycle table for the {}", report.core));
            return;
        }
        if let Some(address) = self.overlaid {
            report.declined.push(format!("trace: more than one section lies at {address:#010x}"));
            return;
        }
        let nodes: BTreeMap<u32, &Node> =
            self.reached.iter().flat_map(|one| &one.nodes).map(|(&at, node)| (at, node)).collect();
        match trace::runs(executed, report.address, &nodes) {
            Ok(runs) if runs.is_empty() => {
                report.declined.push("trace: the function was not executed to its end".into());
            }
            Ok(runs) => {
                report.typical = Some(Typical::of(&runs));
                match lines_of.map(|image| lines::of(image.elf(), &runs)) {
                    Some(Ok(lines)) => report.lines = Some(lines),
                    Some(Err(reason)) => report.declined.push(format!("--lines: {reason}")),
                    None => {}
                }
            }
            Err(reason) => report.declined.push(format!("trace: {reason}")),
        }
        if let (Some(typical), Some(bound)) = (&report.typical, report.bound())
            && typical.cycles.max > bound
        {
            // The trace executes a loop more often than its --loop allows.
            report.declined.push(format!(
                "the trace takes {} cycles, more than the bound: is a --loop too small?",
                typical.cycles.max
            ));
        }
    }
}

/// Returns the number of bytes in the union of these ranges, which are in address order.
fn covered(ranges: &[(u32, u32)]) -> u32 {
    let (mut bytes, mut behind) = (0, 0);
    for (start, length) in ranges {
        let end = start + length;
        bytes += end.saturating_sub((*start).max(behind));
        behind = behind.max(end);
    }
    bytes
}

fn told(image: &Image, refusal: &Refusal) -> String {
    format!("{} `{}`: {}", image.place(refusal.address), refusal.text, refusal.reason)
}

fn parse_loops(image: &Image, loops: &[String]) -> Result<BTreeMap<u32, u64>, String> {
    let parse = |text: &String| {
        let (place, count) = text.rsplit_once('=').ok_or_else(|| format!("--loop {text}: expected PLACE=N"))?;
        let count: u64 =
            count.parse().map_err(|_| format!("--loop {text}: {count:?} is not a number of executions"))?;
        if count == 0 {
            return Err(format!("--loop {text}: must be >= 1: an entered loop executes at least once"));
        }
        Ok((image.parse_place(place).map_err(|reason| format!("--loop {text}: {reason}"))?, count))
    };
    loops.iter().map(parse).collect()
}

/// Returns the findings of all checks, one line per check.
fn found(image: &Image, reached: &[Rc<Summary>], functions: &[&Function]) -> Vec<(Check, String)> {
    let named = |is: fn(&str) -> bool| -> Vec<String> {
        let any = |one: &&&Function| one.symbols.iter().chain(&one.names).any(|name| is(last_part(name)) || is(name));
        functions.iter().filter(any).map(|one| one.name().to_owned()).collect()
    };
    let instructions = |is: fn(&str) -> bool| -> Vec<String> {
        let all = reached.iter().flat_map(|one| one.nodes.values());
        let found = all.filter(|node| is(&node.instruction.name));
        found
            .map(|node| format!("`{}` at {}", node.instruction.text(), image.place(node.instruction.address)))
            .collect()
    };
    let places = |of: fn(&Summary) -> &[Refusal]| -> Vec<String> {
        reached.iter().flat_map(|one| of(one)).map(|refusal| told(image, refusal)).collect()
    };
    let mut panics = named(is_panic);
    panics.extend(instructions(|name| name == "udf" || name == "trap"));
    panics.extend(places(|one| &one.never_return));
    let mut doubles = named(is_double);
    doubles.extend(instructions(|name| name.contains(".f64")));
    let mut divisions = named(is_division);
    divisions.extend(instructions(|name| ["vdiv", "vsqrt", "sdiv", "udiv"].iter().any(|one| name.starts_with(one))));
    let is_fused = |name: &str| Class::FloatMultiplyAccumulate.row().mnemonics.iter().any(|one| name.starts_with(one));
    let all = [
        (Check::Panic, "a panic is reached", panics),
        (Check::Double, "64-bit floating point is reached", doubles),
        (Check::Division, "a division is reached", divisions),
        (Check::Call, "a call", places(|one| &one.calls)),
        (Check::BackwardBranch, "a backward jump", places(|one| &one.backward)),
        (Check::Fused, "a multiply-accumulate is reached", instructions(is_fused)),
    ];
    let line = |(check, what, mut places): (Check, &str, Vec<String>)| {
        let more = if places.len() > 1 { format!(" and {} more", places.len() - 1) } else { String::new() };
        (!places.is_empty()).then(|| (check, format!("{what}: {}{more}", places.swap_remove(0))))
    };
    all.into_iter().filter_map(line).collect()
}

/// Returns the last part of a path: `g` of `a::b::g`.
fn last_part(name: &str) -> &str {
    name.rsplit("::").next().unwrap_or(name)
}

fn is_panic(name: &str) -> bool {
    ["core::panicking", "rust_begin_unwind", "rust_panic", "panic_fmt", "unwrap_failed", "expect_failed"]
        .iter()
        .any(|part| name.contains(part))
}

/// Returns whether a name is a 64-bit float helper of the run-time library: `__aeabi_dadd`, `__aeabi_f2d`, `__adddf3`,
/// `__floatsidf`.
fn is_double(name: &str) -> bool {
    let to_double = ["__aeabi_f2d", "__aeabi_i2d", "__aeabi_ui2d", "__aeabi_l2d", "__aeabi_ul2d", "__aeabi_h2d"];
    let arm = name.starts_with("__aeabi_d") && !name.starts_with("__aeabi_div");
    let generic = name.starts_with("__") && !name.contains("aeabi") && name.contains("df");
    to_double.contains(&name) || name.starts_with("__aeabi_cd") || arm || generic
}

/// Returns whether a name is a division or root helper of the run-time library: `__aeabi_uidivmod`, `__divsf3`,
/// `sqrtf`.
fn is_division(name: &str) -> bool {
    (name.starts_with("__") && (name.contains("div") || name.contains("mod"))) || name == "sqrtf" || name == "sqrt"
}

#[cfg(test)]
mod tests;
