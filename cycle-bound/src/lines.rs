//! Cycles per source line, from the executed instructions of a trace.
//!
//! The compiler inlines and interleaves, so the instructions of a line are scattered. The debug information of the
//! firmware maps each instruction to its line. A stall counts for the waiting instruction. Code of the language's core
//! library (`a * b` is a function there) counts for the line that uses it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

use addr2line::gimli::{self, EndianSlice, LittleEndian};
use object::{Object, ObjectSection};
use serde::Serialize;

use crate::trace::Run;
use terminal::table::Table;

type Slice<'a> = EndianSlice<'a, LittleEndian>;

/// Average cost of a source line per call.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// File name in the debug information, shortened.
    pub file: String,
    /// Line number from 1; 0 if the debug information has none.
    pub line: u32,
    /// File and line that this line was inlined into, if the file differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<(String, u32)>,
    /// Executed instructions per call.
    pub instructions: f64,
    /// Typical cycles per call.
    pub cycles: f64,
    /// Typical cycles per call, if VLDR and VSTR pipeline as LDR and STR do.
    pub pipelined: f64,
}

/// Costs of all source lines of an executed function.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Lines(pub Vec<Line>);

/// Returns the cost of each source line over the traced calls; `elf` holds the bytes of the firmware.
///
/// # Errors
/// The firmware has no readable debug information.
pub(crate) fn of(elf: &[u8], runs: &[Run]) -> Result<Lines, String> {
    let told = |error: gimli::Error| format!("the debug information cannot be read: {error}");
    let file = object::File::parse(elf).map_err(|error| format!("not an ELF file: {error}"))?;
    let section = |id: gimli::SectionId| -> Result<Cow<'_, [u8]>, gimli::Error> {
        let data = file.section_by_name(id.name()).and_then(|section| section.uncompressed_data().ok());
        Ok(data.unwrap_or(Cow::Borrowed(&[])))
    };
    let sections = gimli::DwarfSections::load(section).map_err(told)?;
    let dwarf = sections.borrow(|data| Slice::new(data, LittleEndian));
    let context = addr2line::Context::from_dwarf(dwarf).map_err(told)?;
    let calls = runs.len().max(1) as f64;
    let mut lines: BTreeMap<(Place, Option<Place>), [u64; 3]> = BTreeMap::new();
    let mut known: BTreeMap<u32, (Place, Option<Place>)> = BTreeMap::new();
    for step in runs.iter().flat_map(|run| &run.steps) {
        let key = match known.get(&step.address) {
            Some(key) => key.clone(),
            None => known.entry(step.address).or_insert(places(&context, step.address).map_err(told)?).clone(),
        };
        let sums = lines.entry(key).or_default();
        for (sum, value) in sums.iter_mut().zip([1, step.cycles, step.pipelined]) {
            *sum += value;
        }
    }
    if known.values().all(|(place, _)| place.line == 0) {
        return Err("the image has no debug information for the function: set `debug` in its profile".to_owned());
    }
    let line = |((place, within), sums): ((Place, Option<Place>), [u64; 3])| Line {
        file: place.file,
        line: place.line,
        within: within.map(|place| (place.file, place.line)),
        instructions: sums[0] as f64 / calls,
        cycles: sums[1] as f64 / calls,
        pipelined: sums[2] as f64 / calls,
    };
    let mut all: Vec<Line> = lines.into_iter().map(line).collect();
    // Source order: a helper is listed at the line that uses it.
    let at = |line: &Line| line.within.clone().unwrap_or((line.file.clone(), line.line));
    all.sort_by_key(|line| (at(line), line.line));
    Ok(Lines(all))
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    file: String,
    line: u32,
}

/// Returns the source line of an address, and the line in another file that it was inlined into.
fn places(context: &addr2line::Context<Slice<'_>>, address: u32) -> Result<(Place, Option<Place>), gimli::Error> {
    let mut frames = context.find_frames(u64::from(address)).skip_all_loads()?;
    let mut found: Vec<Place> = Vec::new();
    while let Some(frame) = frames.next()? {
        let Some(location) = frame.location else { continue };
        let file = location.file.unwrap_or("?");
        // Operators of numbers are functions of Rust's core library.
        if !file.contains("library/core/src/") {
            found.push(Place { file: short(file), line: location.line.unwrap_or(0) });
        }
    }
    let mut found = found.into_iter();
    let inner = found.next().unwrap_or(Place { file: "?".to_owned(), line: 0 });
    let outer = found.next().filter(|place| place.file != inner.file);
    Ok((inner, outer))
}

/// Returns the last two folders and the file name, which are equal on every machine.
fn short(path: &str) -> String {
    let parts: Vec<&str> = path.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
    parts[parts.len().saturating_sub(3)..].join("/")
}

impl fmt::Display for Lines {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut table = Table::new(["cycles", "pipelined", "instructions", "line", "inlined code"]);
        let number = |value: f64| format!("{value:.1}");
        let mut total = [0.0; 3];
        for line in &self.0 {
            let place = format!("{}:{}", line.file, line.line);
            let (shown, inlined) = match &line.within {
                Some((file, at)) => (format!("{file}:{at}"), place),
                None => (place, String::new()),
            };
            let values = [line.cycles, line.pipelined, line.instructions];
            total.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            table.row([number(line.cycles), number(line.pipelined), number(line.instructions), shown, inlined]);
        }
        table.row([number(total[0]), number(total[1]), number(total[2]), "total".to_owned(), String::new()]);
        write!(f, "{table}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_told_by_its_last_parts_alone() {
        assert_eq!(short("/home/me/joint/./firmware/src/bin/drive.rs"), "src/bin/drive.rs");
        assert_eq!(short("./main.c"), "main.c");
    }
}
