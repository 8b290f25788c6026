//! Translation validation: compares the machine code of a function with a specification of its results.
//!
//! Both sides become values of one graph. The machine code is executed symbolically, each instruction once, and the
//! instructions of a loop once per iteration, up to 64 iterations. Where paths join, differing values become a
//! selection by the branches in between. The specification is entered into the same graph.
//!
//! The function is correct if:
//!
//! * every result equals the specified result,
//! * every callee-saved register holds its value from the entry,
//! * the function writes nothing else,
//! * no input reaches an instruction that the execution cannot follow.
//!
//! Two values are equal if they give the same term on every path, that is, for each combination of comparison results.
//! With too many paths, the comparison proceeds case by case, for both outcomes of a decision (`cases.rs`). If a case
//! still has too many paths, intermediate values are proved equal first and are then treated as one value (`sweep.rs`).
//! The proof therefore covers all inputs bit for bit. Numeric inputs serve only to find differing results and
//! candidates for equality (`inputs.rs`). A result without a proof is rejected by name.
//!
//! # Equality
//! Float operations `+ * /` are uninterpreted. The comparison uses only identities that hold for every bit pattern
//! under rounding to nearest: `a - b = a + (-b)`, `a + b = b + a`, `a b = b a`, `a + (-0) = a`, `1 a = a`,
//! `2 a = a + a`, `a / 1 = a`, signs of products and quotients, `-(-a) = a`, `|-a| = |a|`, and `|a|` as `-a` if
//! `a < 0`, else `a + 0`. A comparison is decided by earlier comparisons, through constants, and because a comparison
//! that holds excludes NaN. An integer count converted to float is never NaN or -0, and so is its product with a
//! positive number, so `a + 0 = a` there. Counts are sums modulo 2^32 in a normal form, with their low bits, and with
//! `2^k (a >> k)` as a minus its low bits. A quotient by 2^k is the upper bits, depending on the sign. `VMLA` rounds
//! its product and is supported. `VFMA` does not round it and is rejected.
//!
//! # Assumptions
//! * The FPU rounds to nearest, with subnormal numbers (FPSCR as after reset).
//! * Memory regions behind different addresses do not overlap, and nothing else writes to them during the call.
//! * An address, including the stack pointer, is a multiple of 4 and not 0. As a signed number it is not negative up to
//!   the end of its memory.
//! * An input of kind `truth` is 0 or 1.
//! * The sign and the payload of a NaN are irrelevant.
//! * The disassembler is correct.
//!
//! # Specification format
//! ```text
//! means 1                          the format
//! function control::tick           its name in the image, as for --symbol
//! in x1 number r2+0                an input: name, kind, place
//! in resuming truth r1+44
//! known r0+52 18                   a word of memory that is this number, or the address that r2 holds: `known r1+0 r2`
//! out u number s0                  a result: name, kind, place when the function returns
//! out x1_prev number r1+24
//! out saturated truth r0 bit 1
//! begin
//! limit = number 0x41200000        a float by its bits
//! v1 = greater x1 limit
//! v2 = select v1 limit x1
//! if v1
//! return v2 x1 v1                  a value for each `out`, in their order
//! else
//! return v2 x1 false
//! end
//! ```
//!
//! A place is a register at the entry or at the return (`r0`, `s0`), or memory: `r1+44` is 44 bytes behind the address
//! in `r1` at the entry. The kinds are `number` (a float), `count` (32 bits), `truth` (a byte in memory, 0 or 1) and
//! `either` (a word, with its values for true and for false behind the place: `r2+0 0 1`). Results of kind `truth` or
//! `either` in one place add up. Examples are the bits of status flags (a halfword in memory), or a status with two
//! reasons. Inputs that are bits of a word, `truth r2+4 bit 0`, start at bit 0; the bits above them are arbitrary.
//! `pad r1+45 3` names bytes with arbitrary content. `size r1 48` gives the size of the memory behind an address, for
//! code that checks two places for overlap.
//!
//! | operation | operands | result |
//! |---|---|---|
//! | `number BITS`, `count BITS`, `true`, `false` | | a constant; `true` and `false` need no name |
//! | `neg a`, `abs a`, `add a b`, `sub a b`, `mul a b`, `div a b` | numbers | a number, rounded once to nearest |
//! | `less a b`, `less_equal`, `greater`, `greater_equal`, `equal`, `not_equal` | numbers | a truth, IEEE 754 |
//! | `and a b`, `or a b`, `not a` | truths | a truth |
//! | `select t a b` | a truth and two of one kind | `a` if `t` holds, else `b` |
//! | `plus a b`, `since a b`, `times a b` | counts | sum, difference, product modulo 2^32 |
//! | `quotient a b` | counts | two's complement, rounded towards 0, as SDIV |
//! | `signed a BITS` | count | its low bits, sign-extended |
//! | `number_of a` | count | the signed count as a number, rounded once |
//!
//! A value has one name and precedes its uses; one definition may appear in two branches. `#` begins a comment.

use std::fmt;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;
use whole_file::FileKind;

use crate::image::{Function, Image};
use crate::instruction::Decoder;
use crate::{Answer, Options, image_file, of_file};
use terminal::table::Table;

use cases::{Cases, Effort};
use graph::{Graph, Node};
use machine::{Machine, Program, Word};
use text::Expected;

mod cases;
mod graph;
mod inputs;
mod machine;
mod sweep;
mod term;
mod text;

/// Result of the validation of one function.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Name of the function in the specification.
    pub function: String,
    /// File name of the specification.
    pub text: String,
    /// Upper bound of a call in cycles, from the same disassembly; `None` if it was rejected.
    pub bound: Option<u64>,
    /// Instructions on all paths.
    pub instructions: usize,
    /// Compared paths, for all results or for intermediate values.
    pub paths: usize,
    /// Number of results in the specification.
    pub results: usize,
    /// Outcome of the comparison.
    pub verdict: Verdict,
    /// Computing time, s.
    pub seconds: f64,
}

/// Outcome of a comparison.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every result is equal for all inputs.
    Same,
    /// A result differs; the text has the result and the inputs.
    Differs(String),
    /// The code cannot be followed, or a result has no proof; the text has the reason.
    Declined(String),
}

/// Results of all specifications.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Meanings {
    /// One row per specification.
    pub rows: Vec<Row>,
    /// Messages of the rows that differ.
    pub failures: Vec<String>,
    /// Messages of the rejected rows.
    pub declined: Vec<String>,
}

impl fmt::Display for Meanings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut table = Table::new(["function", "bound", "instructions", "paths", "results", "meaning", "s"]);
        for row in &self.rows {
            let verdict = match row.verdict {
                Verdict::Same => "same",
                Verdict::Differs(_) => "DIFFERS",
                Verdict::Declined(_) => "DECLINED",
            };
            table.row([
                row.function.clone(),
                row.bound.map_or("-".into(), |bound| bound.to_string()),
                row.instructions.to_string(),
                row.paths.to_string(),
                row.results.to_string(),
                verdict.into(),
                format!("{:.2}", row.seconds),
            ]);
        }
        write!(f, "{table}")
    }
}

/// Validates the functions of a firmware against their specifications, and bounds them, on all cores in parallel.
///
/// # Errors
/// Invalid input, in one line.
pub(crate) fn run(elf: &Path, options: &Options, stop: &AtomicBool) -> Result<Meanings, String> {
    let image = Image::read(&image_file::read(elf)?).map_err(|reason| of_file(elf, &reason))?;
    let rows: Vec<_> = options.means.par_iter().map(|path| row(&image, path, options, stop)).collect();
    let mut answer = Meanings { rows: Vec::new(), failures: Vec::new(), declined: Vec::new() };
    for row in rows {
        let row = row?;
        match &row.verdict {
            Verdict::Same => {}
            Verdict::Differs(what) => answer.failures.push(format!("{}: {what}", row.function)),
            Verdict::Declined(what) => answer.declined.push(format!("{}: {what}", row.function)),
        }
        answer.rows.push(row);
    }
    Ok(answer)
}

/// Validates one function.
fn row(image: &Image, path: &Path, options: &Options, stop: &AtomicBool) -> Result<Row, String> {
    let text = whole_file::read_text(path, FileKind::SETTINGS).map_err(|reason| of_file(path, &reason))?;
    let expected = Expected::read(&text).map_err(|reason| of_file(path, &reason))?;
    let name = options.symbol.as_deref().unwrap_or(&expected.function);
    let function = image.find(name).map_err(|reason| of_file(path, &reason))?;
    let begin = Instant::now();
    let found = held(image, function, &expected, Effort::USUAL, stop)?;
    let asked = Options { symbol: Some(function.symbols[0].clone()), ..options.clone() };
    Ok(Row {
        function: name.to_owned(),
        text: path.display().to_string(),
        bound: Answer::of(image, &asked)?.report.bound(),
        instructions: found.instructions,
        paths: found.paths,
        results: expected.outs.len(),
        verdict: found.verdict,
        seconds: begin.elapsed().as_secs_f64(),
    })
}

struct Found {
    instructions: usize,
    paths: usize,
    verdict: Verdict,
}

/// Builds the graph of machine code and specification and compares them.
fn held(
    image: &Image,
    function: &Function,
    expected: &Expected,
    effort: Effort,
    stop: &AtomicBool,
) -> Result<Found, String> {
    let image = &*image.while_runs(function);
    let mut program = Program::new(image, Decoder::new(false)?);
    let mut graph = Graph::default();
    let wanted = expected.results(&mut graph);
    let mut machine = Machine::new(&mut program, &mut graph, expected);
    let mut found = Vec::new();
    let done = machine.run(function.start).and_then(|kept| {
        for (port, wanted) in expected.outs.iter().zip(&wanted) {
            match machine.result(port)? {
                Word::Term(result) => found.push((port.name.clone(), result, *wanted)),
                other => return Err(format!("{} is {other:?}", port.name)),
            }
        }
        found.extend(kept);
        Ok(())
    });
    let dead = std::mem::take(&mut machine.dead);
    let declined = |paths: usize, instructions: usize, reason: String| {
        Ok(Found { instructions, paths, verdict: Verdict::Declined(reason) })
    };
    if let Err(reason) = done {
        let reason = dead.into_iter().map(|(reason, _)| reason).next().unwrap_or(reason);
        return declined(0, program.instructions(), reason);
    }
    let no = graph.truth(false);
    let dead_ends = dead.iter().map(|(_, reached)| (*reached, no));
    let pairs: Vec<(Node, Node)> = dead_ends.chain(found.iter().map(|(_, found, wanted)| (*found, *wanted))).collect();
    let different = |(at, inputs): (usize, Vec<u32>)| {
        let told: Vec<String> = (expected.inputs.iter().zip(inputs))
            .map(|(port, bits)| match port.kind {
                text::ValueKind::Number => format!("{} = {:?}", port.name, f32::from_bits(bits)),
                _ => format!("{} = {}", port.name, bits as i32),
            })
            .collect();
        let Some(at) = at.checked_sub(dead.len()) else {
            return declined(0, program.instructions(), format!("{}, where {}", dead[at].0, told.join(", ")));
        };
        let what = format!("{} differs for {}", found[at].0, told.join(", "));
        Ok(Found { instructions: program.instructions(), paths: 0, verdict: Verdict::Differs(what) })
    };
    let tried = match inputs::difference(&graph, expected, &wanted, &pairs, effort.tried) {
        Ok(tried) => tried,
        Err(found) => return different(found),
    };
    let mut cases = Cases::new(expected, effort, stop);
    let open: Vec<String> = (cases.unequal(&mut graph, &pairs, &tried)?.into_iter())
        .map(|at| match dead.get(at) {
            Some((reason, _)) => reason.clone(),
            None => format!("{} has no proof of equality", found[at - dead.len()].0),
        })
        .collect();
    let verdict = if open.is_empty() { Verdict::Same } else { Verdict::Declined(open.join("; ")) };
    Ok(Found { instructions: program.instructions(), paths: cases.paths, verdict })
}

#[cfg(test)]
mod tests;
