//! Result of an analysis: an aligned table with its assumptions for people, one JSON object for programs.

use std::fmt;

use serde::Serialize;

pub use crate::lines::{Line, Lines};

use crate::analysis::Summary;
use crate::cycles::{ASSUMPTIONS, RETURNS, TABLE};
use crate::graph::Path;
use crate::image::Function;
use crate::trace::Run;
use crate::{Core, Options};
use terminal::table::Table;

/// Cycles and instructions of one path.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PathJson {
    /// Cycles; `None` on a core without a cycle table.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycles: Option<u64>,
    /// Number of instructions on the path.
    pub instructions: u64,
}

/// Least, most and mean over the calls of a trace.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Least over all calls.
    pub min: u64,
    /// Most over all calls.
    pub max: u64,
    /// Mean over all calls.
    pub mean: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = u64> + Clone) -> Self {
        let count = values.clone().count().max(1);
        let mean = values.clone().sum::<u64>() as f64 / count as f64;
        Self { min: values.clone().min().unwrap_or(0), max: values.max().unwrap_or(0), mean }
    }
}

/// Executed figures of the calls in a trace.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Typical {
    /// Calls in the trace.
    pub calls: usize,
    /// Executed instructions per call, exact.
    pub instructions: Spread,
    /// Cycles per call, by the typical column of the cycle table.
    pub cycles: Spread,
    /// Cycles per call, if VLDR and VSTR pipeline as LDR and STR do.
    pub pipelined: Spread,
    /// Float additions, subtractions, multiplications and conversions per call.
    pub arithmetic: Spread,
}

impl Typical {
    /// Summarises all calls of a trace.
    pub(crate) fn of(runs: &[Run]) -> Self {
        let instructions = Spread::of(runs.iter().map(|run| run.instructions));
        let cycles = Spread::of(runs.iter().map(|run| run.cycles));
        let pipelined = Spread::of(runs.iter().map(|run| run.pipelined));
        let arithmetic = Spread::of(runs.iter().map(|run| run.arithmetic));
        Self { calls: runs.len(), instructions, cycles, pipelined, arithmetic }
    }
}

/// Result of the analysis that [`Options`] request.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Source (demangled) name of the function.
    pub symbol: String,
    /// First address of the function.
    pub address: u32,
    /// Name of the core, as on the command line.
    pub core: &'static str,
    /// Longest path, an upper bound; `None` if the code was rejected.
    pub longest: Option<PathJson>,
    /// Shortest path, a lower bound; `None` if the code was rejected.
    pub shortest: Option<PathJson>,
    /// Most instructions of any path; the longest path in cycles may have fewer.
    pub most_instructions: Option<u64>,
    /// Executed figures from a trace.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub typical: Option<Typical>,
    /// Cycles per source line, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lines: Option<Lines>,
    /// Instructions of the longest path, per row of the cycle table.
    pub histogram: Vec<(&'static str, u64)>,
    /// Size of the function and of all reached code, literal pools included, bytes.
    pub flash_bytes: u32,
    /// Largest stack use on a path that returns, without the interrupt frame, bytes; `None` if it was rejected.
    pub stack_bytes: Option<u32>,
    /// Names of all reached functions, the function itself included.
    pub functions: Vec<String>,
    /// Requested checks that failed.
    pub failures: Vec<String>,
    /// Rejected code, with address and reason.
    pub declined: Vec<String>,
    /// Assumptions of the figures.
    pub assumptions: Vec<String>,
}

impl Report {
    pub(crate) fn new(options: &Options, function: &Function, summary: &Summary) -> Self {
        let timed = options.core == Core::CortexM4;
        let (mut longest, mut shortest, mut histogram) = (None, None, Vec::new());
        if let Some(paths) = &summary.paths {
            let path = |path: &Path| PathJson { cycles: timed.then_some(path.cycles), instructions: path.instructions };
            let most = paths.bound.as_ref().unwrap_or(&paths.most);
            longest = Some(path(most));
            shortest = Some(path(paths.least.as_ref().unwrap_or(&paths.fewest)));
            let labels = TABLE.iter().map(|row| row.label).chain(["not in the table"]);
            histogram = labels.zip(most.classes.iter().copied()).filter(|(_, count)| *count > 0).collect();
        }
        Self {
            symbol: function.name().to_owned(),
            address: function.start,
            core: options.core.name(),
            longest,
            shortest,
            most_instructions: summary.paths.as_ref().map(|paths| paths.most.instructions),
            typical: None,
            lines: None,
            histogram,
            flash_bytes: 0,
            stack_bytes: summary.stack.as_ref().and_then(|stack| stack.as_ref().ok().copied()),
            functions: Vec::new(),
            failures: Vec::new(),
            declined: Vec::new(),
            assumptions: ASSUMPTIONS
                .iter()
                .filter(|_| timed)
                .chain([&RETURNS])
                .map(|line| (*line).to_owned())
                .collect(),
        }
    }

    /// Returns the upper bound in cycles.
    pub fn bound(&self) -> Option<u64> {
        self.longest.as_ref()?.cycles
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} at {:#010x}, {}", self.symbol, self.address, self.core)?;
        let mut table = Table::new(["figure", "cycles", "instructions", "meaning"]);
        let mut row = |name: &str, cycles: String, instructions: String, meaning: &str| {
            table.row([name, &cycles, &instructions, meaning]);
        };
        for (name, path, meaning) in [
            ("bound", &self.longest, "no call takes more: the longest path, each instruction at its documented worst"),
            (
                "least",
                &self.shortest,
                "no call takes fewer: the shortest path, each instruction at its documented least",
            ),
        ] {
            let Some(path) = path else { continue };
            let cycles = path.cycles.map_or_else(|| "-".to_owned(), |cycles| cycles.to_string());
            row(name, cycles, path.instructions.to_string(), meaning);
        }
        if let Some(most) = self.most_instructions {
            row("instructions", "-".to_owned(), most.to_string(), "no call executes more");
        }
        if let Some(Typical { calls, instructions, cycles, pipelined, .. }) = &self.typical {
            let over = format!("executed, {calls} calls");
            row("typical, least", cycles.min.to_string(), instructions.min.to_string(), &over);
            row("typical, mean", format!("{:.1}", cycles.mean), format!("{:.1}", instructions.mean), &over);
            row("typical, most", cycles.max.to_string(), instructions.max.to_string(), &over);
            let supposed = "typical, if VLDR and VSTR pipeline as LDR and STR do";
            row("pipelined, most", pipelined.max.to_string(), instructions.max.to_string(), supposed);
        }
        if self.longest.is_some() || self.typical.is_some() {
            write!(f, "\n{table}")?;
        }
        let stack = self.stack_bytes.map_or_else(|| "declined".to_owned(), |bytes| format!("{bytes} B"));
        writeln!(f, "\nflash {} B in {} function(s), stack {stack}", self.flash_bytes, self.functions.len())?;
        if let Some(lines) = &self.lines {
            write!(f, "\nper source line, mean per call\n{lines}")?;
        }
        if !self.histogram.is_empty() {
            let mut table = Table::new(["instructions of the longest path", "number"]);
            for (label, count) in &self.histogram {
                table.row([(*label).to_owned(), count.to_string()]);
            }
            write!(f, "\n{table}")?;
        }
        if !self.assumptions.is_empty() {
            writeln!(f, "\nassumed:")?;
        }
        self.assumptions.iter().try_for_each(|line| writeln!(f, "  {line}"))
    }
}
