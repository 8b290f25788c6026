//! Does the machine code compute what it is to compute? A function against a text that says what becomes of its inputs.
//!
//! The instructions are executed on values of a graph instead of numbers, each instruction once, those of a loop once
//! for each of its turns, up to 64; where ways meet, what differs is a choice by the branches between. The text becomes
//! values of the same graph. Then every result must be equal to that of the text, each register that a function leaves
//! as it was to its entry, and nothing else may be written; where an instruction cannot be followed, it is to be shown
//! that no input goes there. Equal is what gives the same term on every path: for each way that the comparisons can be
//! answered. Where that are too many, it is shown case by case, for a decision that goes one way and for one that goes
//! the other (`cases.rs`); and where a case has still too many, values between are shown to be equal first, and stand
//! for themselves from then on (`sweep.rs`). Then both give the same bits for all inputs: no number is chosen, none is
//! left out. Numbers are tried too, but only to find where two results differ, and what may be equal (`inputs.rs`).
//! What cannot be shown is declined, with its name.
//!
//! # What counts as the same
//! `+ * /` of floats stay as they are; only identities are used that hold for every bit pattern if one rounds to
//! nearest: `a - b = a + (-b)`, `a + b = b + a`, `a b = b a`, `a + (-0) = a`, `1 a = a`, `2 a = a + a`, `a / 1 = a`,
//! signs of products and quotients, `-(-a) = a`, `|-a| = |a|`, and that `|a|` is `-a` if `a < 0`, else `a + 0`. Of
//! comparisons, what follows from those before: through constants, and that a comparison which holds is not of NaN.
//! A count as a number, or so many times one above 0, is neither a NaN nor -0, so that `a + 0 = a`. Counts are sums
//! modulo 2^32 in a normal form, with their low bits and `2^k (a >> k)` as a less its low bits; a quotient by 2^k is
//! the bits above, by the sign. `VMLA` rounds its product and is followed, `VFMA` does not and is not.
//!
//! # What is assumed
//! Rounding to nearest with subnormal numbers (FPSCR as after reset). Memory behind different addresses does not
//! overlap, nobody else writes to it meanwhile, and such an address is a multiple of 4, not 0, and as a count with a
//! sign not below 0, up to the end of the memory behind it; the stack's too. What is given as a truth is 0 or 1. The
//! sign and the payload of a NaN mean nothing. The disassembler is right.
//!
//! # The text
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
//! A place is a register at the entry or the return (`r0`, `s0`), or memory: `r1+44` is 44 bytes behind the address
//! that `r1` holds at the entry. Kinds are `number` (a float), `count` (32 bits), `truth` (a byte in memory, 0 or 1),
//! `either` (a word, with what it is where it is true and where it is not behind the place: `r2+0 0 1`). Results of the
//! last two kinds that have one place add up: bits of a health (a half word in memory), a status that has two reasons.
//! Inputs that are bits of a word, `truth r2+4 bit 0`, go from 0 on; what is above them may be anything. `pad r1+45 3`
//! names bytes that may hold anything, `size r1 48` all bytes behind an address, for code that asks whether two places
//! overlap.
//!
//! | operation | of | gives |
//! |---|---|---|
//! | `number BITS`, `count BITS`, `true`, `false` | | a constant; `true` and `false` need no name |
//! | `neg a`, `abs a`, `add a b`, `sub a b`, `mul a b`, `div a b` | numbers | a number, rounded once to nearest |
//! | `less a b`, `less_equal`, `greater`, `greater_equal`, `equal`, `not_equal` | numbers | a truth, IEEE 754 |
//! | `and a b`, `or a b`, `not a` | truths | a truth |
//! | `select t a b` | a truth and two of one kind | the second if t holds, else the third |
//! | `plus a b`, `since a b`, `times a b` | counts | sum, difference, product modulo 2^32 |
//! | `quotient a b` | counts | in two's complement towards 0, as SDIV gives it |
//! | `signed a BITS` | count | its low bits, the highest of them in all bits above |
//! | `number_of a` | count | as a number with a sign, rounded once |
//!
//! A value has one name and stands before what needs it; the same definition may stand in two branches. `#` begins a
//! comment.

use std::fmt;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;
use whole_file::Kind;

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

/// What was found of one function.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The function, as the text names it.
    pub function: String,
    /// The text.
    pub text: String,
    /// Upper bound of a call in cycles, from the same disassembly; none if it was declined.
    pub bound: Option<u64>,
    /// Instructions of all ways.
    pub instructions: usize,
    /// Paths that were compared, of all results or of values between.
    pub paths: usize,
    /// Results of the text.
    pub results: usize,
    /// What came out.
    pub verdict: Verdict,
    /// How long it took, s.
    pub seconds: f64,
}

/// What came out of a comparison.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every result is equal for all inputs.
    Same,
    /// For these inputs this result is another.
    Differs(String),
    /// This cannot be followed, or not be shown.
    Declined(String),
}

/// The answer to a list of texts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Meanings {
    /// A row for each text.
    pub rows: Vec<Row>,
    /// Rows that differ.
    pub failures: Vec<String>,
    /// Rows that were declined.
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

/// Holds the functions of an image to these texts, and bounds them; as many at once as there are cores.
///
/// # Errors
/// Bad input, in one line.
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

/// Holds one of them to its text.
fn row(image: &Image, path: &Path, options: &Options, stop: &AtomicBool) -> Result<Row, String> {
    let text = whole_file::read_text(path, Kind::SETTINGS).map_err(|reason| of_file(path, &reason))?;
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

/// Function and text in one graph, held against each other.
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
                text::Kind::Number => format!("{} = {:?}", port.name, f32::from_bits(bits)),
                _ => format!("{} = {}", port.name, bits as i32),
            })
            .collect();
        let Some(at) = at.checked_sub(dead.len()) else {
            return declined(0, program.instructions(), format!("{}, where {}", dead[at].0, told.join(", ")));
        };
        let what = format!("{} is another where {}", found[at].0, told.join(", "));
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
            None => format!("{} is not shown to be the same", found[at - dead.len()].0),
        })
        .collect();
    let verdict = if open.is_empty() { Verdict::Same } else { Verdict::Declined(open.join("; ")) };
    Ok(Found { instructions: program.instructions(), paths: cases.paths, verdict })
}

#[cfg(test)]
mod tests;
