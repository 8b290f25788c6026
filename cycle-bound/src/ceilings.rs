//! Cycle budgets: a TOML file lists functions of a firmware and the limit (ceiling) of each figure. The check fails
//! when a function becomes more expensive, so a regression cannot pass CI.
//!
//! ```toml
//! compiler = "rustc 1.96.0" # the limits hold for its code; code of another compiler is printed, and fails
//!
//! [[instance]]
//! name = "current loop"
//! image = "target/thumbv7em-none-eabihf/release/drive"        # relative to this file
//! symbol = "TIM3"
//! state = "drive::STATE" # the static whose size is the figure `state` coefficients = "drive::CONTROLLER" # the static
//! whose size is the figure `coefficients`
//! barrier = 3                          # as --barrier; loops = ["PLACE=N"] as --loop
//! ceiling = { bound = 577, typical = 454, instructions = 291, flash = 1420, stack = 72, state = 48 }   # or fewer
//! floor = { typical = 129 } # theoretical minimum allow = { division = "b(x) varies" } # all checks are active; each
//! exception has a reason
//! why = "a third of the 1600 cycles between two interrupts"
//!
//! [[difference]] # one instance minus another
//! name = "guard"
//! of = "current loop"
//! without = "current loop, no guard"
//! ceiling = { typical = 20 }           # or: exactly = { arithmetic = 16 }
//! why = ".."
//! ```
//!
//! | figure | unit | meaning |
//! |---|---|---|
//! | `bound` | cycles | upper bound of a call |
//! | `typical` | cycles | most expensive call of an emulator run, by the typical column of the cycle table |
//! | `pipelined` | cycles | `typical`, if VLDR and VSTR pipeline as LDR and STR do |
//! | `instructions` | | longest call of that run, exact |
//! | `arithmetic` | | most float additions, subtractions, multiplications and conversions in a call of that run |
//! | `flash`, `stack` | B | the function and all reached code; bytes below the stack pointer at the entry |
//! | `state`, `coefficients` | B | sizes of the named statics |
//!
//! A figure fails above its limit. It also fails more than [`SLACK_PERCENT`] below its limit, because a limit that is
//! not lowered after an improvement would allow the improvement to be lost. The most expensive call counts, not the
//! mean, since the limit holds for every call. A difference has no lower limit, because 5 % of each of its two figures
//! can exceed a small difference.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};
use whole_file::{Existing, FileKind};

use crate::image::Image;
use crate::report::Report;
use crate::{Answer, Check, Options, emulated, image_file};
use terminal::table::Table;

use file::{Difference, File, Instance, Located, nearest};

mod file;

/// Largest distance of a figure below its limit, in percent of the limit.
pub const SLACK_PERCENT: u64 = 5;

/// Figure of a function that may have a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Figure {
    /// Upper bound of a call, cycles.
    Bound,
    /// Most expensive executed call, typical cycles.
    Typical,
    /// Most expensive executed call, typical cycles with pipelined float loads and stores.
    Pipelined,
    /// Instructions of the longest executed call.
    Instructions,
    /// Most float additions, subtractions, multiplications and conversions in an executed call.
    Arithmetic,
    /// Size of the function and of all code that it reaches, bytes.
    Flash,
    /// Stack use below the stack pointer at the entry, callees included, bytes.
    Stack,
    /// Size of the static that the file names as state, bytes.
    State,
    /// Size of the static that the file names as coefficients, bytes.
    Coefficients,
}

impl Figure {
    const ALL: [Self; 9] = [
        Self::Bound,
        Self::Typical,
        Self::Pipelined,
        Self::Instructions,
        Self::Arithmetic,
        Self::Flash,
        Self::Stack,
        Self::State,
        Self::Coefficients,
    ];

    /// Returns the key of the figure in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bound => "bound",
            Self::Typical => "typical",
            Self::Pipelined => "pipelined",
            Self::Instructions => "instructions",
            Self::Arithmetic => "arithmetic",
            Self::Flash => "flash",
            Self::Stack => "stack",
            Self::State => "state",
            Self::Coefficients => "coefficients",
        }
    }

    /// Returns the unit of the figure, in the plural.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Bound | Self::Typical | Self::Pipelined => "cycles",
            Self::Instructions => "instructions",
            Self::Arithmetic => "operations",
            Self::Flash | Self::Stack | Self::State | Self::Coefficients => "B",
        }
    }

    /// Returns whether the figure needs an emulator run.
    fn is_executed(self) -> bool {
        matches!(self, Self::Typical | Self::Pipelined | Self::Instructions | Self::Arithmetic)
    }
}

/// A figure of an instance or a difference, with its limits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Name of the instance or the difference.
    pub name: String,
    /// Figure in this row.
    pub figure: Figure,
    /// Value of the figure; `None` if it could not be computed.
    pub value: Option<i64>,
    /// Upper limit, or the exact value of a difference with `exactly`.
    pub ceiling: Option<u64>,
    /// Theoretical minimum.
    pub floor: Option<u64>,
    /// Short remark on a violation; empty without one.
    pub remark: String,
}

/// A firmware and its compilers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Built {
    /// Path of the firmware, as in the file.
    pub image: String,
    /// Compilers that the firmware names in its section `.comment`.
    pub compilers: Vec<String>,
    /// Set if one of the compilers is the compiler of the limits.
    pub is_judged: bool,
}

/// Result of checking a file of limits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Compiler that produced the limits.
    pub compiler: String,
    /// Firmware files named in the file, with their compilers.
    pub images: Vec<Built>,
    /// All figures with their limits.
    pub rows: Vec<Row>,
    /// Violated limits, limits that are too loose, and failed checks.
    pub failures: Vec<String>,
    /// Figures that could not be computed, with the reason.
    pub declined: Vec<String>,
    /// Remarks that do not fail the check.
    pub notes: Vec<String>,
    /// Reason of the limits, per instance.
    pub reasons: BTreeMap<String, String>,
}

/// Changes to write into the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Write {
    /// Lowers every limit to its figure, where the figure is below.
    Lowered,
    /// Replaces compiler and limits by the firmware's compiler and figures.
    Recorded,
}

/// Checks every figure of a file against its limit. Reads the firmware, runs it in the emulator if needed, and first
/// applies the requested changes to the file.
///
/// # Errors
/// Invalid input, in one line.
pub fn run(path: &Path, write: Option<Write>, stop: &AtomicBool) -> Result<Verdict, String> {
    let file = path.display().to_string();
    let text = whole_file::read_text(path, FileKind::SETTINGS).map_err(|message| format!("{file}: {message}"))?;
    let at = |image: &str| path.parent().unwrap_or_else(|| Path::new("")).join(image);
    let judged = |text: &str| {
        judge(
            (&file, text),
            |image| {
                Image::read(&image_file::read(&at(image))?).map_err(|why| format!("{}: {why}", at(image).display()))
            },
            |image, ranges| emulated::executed(&at(image), ranges, stop),
        )
    };
    let text = match write {
        None => return judged(&text),
        Some(Write::Lowered) => {
            let verdict = judged(&text)?;
            match lowered(&text, &verdict) {
                Some(text) => text,
                None => return Ok(verdict),
            }
        }
        Some(Write::Recorded) => match recorded(&file, &text, judged)? {
            Recorded::Text(text) => text,
            Recorded::Declined(verdict) => return Ok(*verdict),
        },
    };
    whole_file::write(path, Existing::Replace, |out| out.write_all(text.as_bytes()))
        .map_err(|error| format!("{file}: cannot be written: {error}"))?;
    run(path, None, stop)
}

/// Returns the text with the limits lowered to the figures, or `None` if no limit is above its figure.
fn lowered(text: &str, verdict: &Verdict) -> Option<String> {
    let mut document: toml_edit::DocumentMut = text.parse().ok()?;
    let is_above = |row: &Row| row.value < row.ceiling.map(|ceiling| ceiling as i64);
    with_ceilings(&mut document, "instance", verdict, is_above).then(|| document.to_string())
}

/// Outcome of recording new limits.
#[derive(Debug, PartialEq)]
enum Recorded {
    /// New text of the file, with the new compiler and figures.
    Text(String),
    /// A figure is missing; the file stays unchanged.
    Declined(Box<Verdict>),
}

/// Returns the text with the firmware's compiler and all its figures.
fn recorded(file: &str, text: &str, judged: impl Fn(&str) -> Result<Verdict, String>) -> Result<Recorded, String> {
    let verdict = judged(text)?;
    if verdict.images.iter().all(|built| built.is_judged) {
        return Err(format!(
            "{file}: its ceilings are for {} already. Record improvements with --lower; raise a ceiling by hand",
            verdict.compiler
        ));
    }
    let mut document: toml_edit::DocumentMut =
        text.parse().map_err(|error: toml_edit::TomlError| format!("{file}: not TOML: {}", error.message()))?;
    document["compiler"] = toml_edit::value(common_compiler(&verdict).ok_or_else(|| {
        let of = |built: &Built| format!("{}: {}", built.image, built.compilers.join(", "));
        let all: Vec<String> = verdict.images.iter().map(of).collect();
        format!("{file}: the images have no compiler in common ({})", all.join("; "))
    })?);
    let verdict = judged(&document.to_string())?;
    if !verdict.declined.is_empty() {
        return Ok(Recorded::Declined(Box::new(verdict)));
    }
    // A figure below its floor stays a failure, since it disproves the floor.
    let is_other = |row: &Row| row.value.is_some_and(|value| value >= row.floor.unwrap_or(0) as i64);
    with_ceilings(&mut document, "instance", &verdict, is_other);
    with_ceilings(&mut document, "difference", &verdict, |_| true);
    Ok(Recorded::Text(document.to_string()))
}

/// Returns the compiler and version that every firmware names. A compiler of the same kind as in the file has priority.
fn common_compiler(verdict: &Verdict) -> Option<String> {
    let first = verdict.images.first()?;
    let kind = |name: &str| name.split_whitespace().next().map(str::to_owned);
    let everywhere = |name: &&String| verdict.images.iter().all(|built| built.compilers.contains(name));
    let found: Vec<&String> = first.compilers.iter().filter(everywhere).collect();
    let found = found.iter().find(|name| kind(name) == kind(&verdict.compiler)).or(found.first())?;
    let words: Vec<&str> = found.split_whitespace().collect();
    let number = words.iter().position(|word| word.starts_with(|c: char| c.is_ascii_digit()))?;
    Some(words[..=number].join(" "))
}

/// Overwrites the limits of the `wanted` rows with their figures; returns whether it changed any.
fn with_ceilings(
    document: &mut toml_edit::DocumentMut,
    list: &str,
    verdict: &Verdict,
    wanted: impl Fn(&Row) -> bool,
) -> bool {
    let Some(tables) = document.get_mut(list).and_then(|item| item.as_array_of_tables_mut()) else { return false };
    let mut any = false;
    for table in tables.iter_mut() {
        let text_of = |key: &str| table.get(key).and_then(toml_edit::Item::as_str).unwrap_or_default();
        // A difference has no firmware of its own.
        let image = verdict.images.iter().find(|built| built.image == text_of("image"));
        let is_judged = image.is_none_or(|built| built.is_judged);
        let rows: Vec<&Row> = verdict.rows.iter().filter(|row| is_judged && row.name == text_of("name")).collect();
        let Some(ceilings) = table.get_mut("ceiling").and_then(|item| item.as_table_like_mut()) else { continue };
        for row in rows.into_iter().filter(|row| wanted(row)) {
            let Some(ceiling) = ceilings.get_mut(row.figure.name()).and_then(|item| item.as_value_mut()) else {
                continue;
            };
            if let Some(value) = row.value {
                // Keeps the white space and comments around the value.
                let around = ceiling.decor().clone();
                *ceiling = value.max(0).into();
                *ceiling.decor_mut() = around;
                any = true;
            }
        }
    }
    any
}

/// Checks the figures as [`run`] does, with injected firmware and traces.
fn judge(
    (name, text): (&str, &str),
    mut image_of: impl FnMut(&str) -> Result<Image, String>,
    mut trace_of: impl FnMut(&str, &[(u32, u32)]) -> Result<Vec<u32>, String>,
) -> Result<Verdict, String> {
    let (file, located) = Located::read(name, text)?;
    let told = |key: &str, message: &str| located.error(key, message);
    check(&file, &told)?;

    let mut verdict = Verdict {
        compiler: file.compiler.clone(),
        images: Vec::new(),
        rows: Vec::new(),
        failures: Vec::new(),
        declined: Vec::new(),
        notes: Vec::new(),
        reasons: file.instance.iter().map(|one| (one.name.clone(), one.why.trim().to_owned())).collect(),
    };
    // Results in the order of the instances.
    let mut measured: Vec<Option<Measured>> = file.instance.iter().map(|_| None).collect();
    let mut names: Vec<&str> = Vec::new();
    file.instance.iter().for_each(|one| names.extend((!names.contains(&one.image.as_str())).then_some(&*one.image)));
    for name in names {
        let of_image = || file.instance.iter().enumerate().filter(|(_, one)| one.image == name);
        let first = of_image().next().map_or(1, |(k, _)| k + 1);
        let image = image_of(name).map_err(|message| told(&format!("instance[{first}].image"), &message))?;
        let compilers = image.compilers();
        let is_judged = compilers.iter().any(|one| is_compiler(one, &file.compiler));
        if !is_judged {
            let by = if compilers.is_empty() { "an unnamed compiler".into() } else { compilers.join(", ") };
            verdict.failures.push(format!(
                "{name} was built by {by}; the ceilings hold for {} only. Build with it, or record your own figures: \
                 --record",
                file.compiler
            ));
        }
        let mut answers = Vec::new();
        for (k, instance) in of_image() {
            answers.push((k, read(&image, instance, k, is_judged, &told)?));
        }
        if let Err(why) = trace(name, &file, &mut answers, &mut trace_of) {
            let told = if is_judged { &mut verdict.declined } else { &mut verdict.notes };
            told.push(format!("{name} was not run: {why}"));
        }
        for (k, answer) in answers {
            let figures = figures(&image, &file.instance[k], &answer.report);
            measured[k] = Some(Measured { answer, figures, is_judged });
        }
        verdict.images.push(Built { image: name.to_owned(), compilers, is_judged });
    }
    let measured: Vec<Measured> = measured.into_iter().flatten().collect();
    for (k, (instance, measured)) in file.instance.iter().zip(&measured).enumerate() {
        verdict.instance(instance, measured, &|key, message| told(&format!("instance[{}]{key}", k + 1), message));
    }
    for (k, difference) in file.difference.iter().enumerate() {
        let find = |name: &str| file.instance.iter().position(|one| one.name == name).and_then(|at| measured.get(at));
        if let (Some(of), Some(without)) = (find(&difference.of), find(&difference.without)) {
            let told = |key: &str, message: &str| told(&format!("difference[{}]{key}", k + 1), message);
            verdict.difference(difference, of, without, &told);
        }
    }
    Ok(verdict)
}

/// Results of an instance.
struct Measured {
    answer: Answer,
    figures: BTreeMap<Figure, u64>,
    is_judged: bool,
}

/// Checks the rules that the layout does not cover.
fn check(file: &File, told: &impl Fn(&str, &str) -> String) -> Result<(), String> {
    let given = |key: &str, text: &str, what: &str| {
        if text.trim().is_empty() { Err(told(key, &format!("is missing: {what}"))) } else { Ok(()) }
    };
    given("compiler", &file.compiler, "the compiler of the ceilings, for example \"rustc 1.96.0\"")?;
    if file.instance.is_empty() {
        return Err(told("instance", "is missing: a function and its ceilings, [[instance]]"));
    }
    let names = || file.instance.iter().map(|one| one.name.as_str());
    for (k, one) in file.instance.iter().enumerate() {
        let key = |name: &str| format!("instance[{}].{name}", k + 1);
        given(&key("name"), &one.name, "the name in the table")?;
        given(&key("image"), &one.image, "the linked firmware, relative to this file")?;
        given(&key("symbol"), &one.symbol, "the function")?;
        given(&key("why"), &one.why, "the reason for its ceilings")?;
        if names().position(|name| name == one.name) != Some(k) {
            return Err(told(&key("name"), &format!("{:?} is used already; use another name", one.name)));
        }
        for (check, reason) in &one.allow {
            given(&key(&format!("allow.{}", check.name())), reason, "the reason for the exception")?;
        }
        for (figure, name) in [(Figure::State, &one.state), (Figure::Coefficients, &one.coefficients)] {
            if one.ceiling.contains_key(&figure) && name.is_none() {
                let message = format!("needs the measured static: {} = \"NAME\"", figure.name());
                return Err(told(&key(&format!("ceiling.{}", figure.name())), &message));
            }
        }
        for (figure, floor) in &one.floor {
            if let Some(ceiling) = one.ceiling.get(figure).filter(|ceiling| floor > ceiling) {
                let message = format!("{floor}: must be <= the ceiling of {ceiling}");
                return Err(told(&key(&format!("floor.{}", figure.name())), &message));
            }
        }
    }
    for (k, one) in file.difference.iter().enumerate() {
        let key = |name: &str| format!("difference[{}].{name}", k + 1);
        given(&key("name"), &one.name, "the name in the table")?;
        if names().any(|name| name == one.name) {
            return Err(told(&key("name"), &format!("{:?} is the name of an instance already", one.name)));
        }
        given(&key("why"), &one.why, "the reason for its ceiling")?;
        for (name, instance) in [("of", &one.of), ("without", &one.without)] {
            given(&key(name), instance, "the name of an instance")?;
            if !names().any(|name| name == instance) {
                let hint = nearest(instance, names());
                return Err(told(&key(name), &format!("no instance is called {instance:?}{hint}")));
            }
        }
    }
    Ok(())
}

/// Returns whether the firmware's compiler `found` is the compiler `named`. The version must match completely: 1.9 is
/// not 1.96.
fn is_compiler(found: &str, named: &str) -> bool {
    let named = named.trim().replacen(" version ", " ", 1);
    found.strip_prefix(&named).is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '.'))
}

fn read(
    image: &Image,
    instance: &Instance,
    k: usize,
    is_judged: bool,
    told: &impl Fn(&str, &str) -> String,
) -> Result<Answer, String> {
    let key = |name: &str| format!("instance[{}].{name}", k + 1);
    image.find(&instance.symbol).map_err(|why| told(&key("symbol"), &why))?;
    for (name, data) in [("state", &instance.state), ("coefficients", &instance.coefficients)] {
        if let Some(data) = data {
            image.find_data(data).map_err(|why| told(&key(name), &why))?;
        }
    }
    let symbol = Some(instance.symbol.clone());
    let mut options = Options { symbol, barrier: instance.barrier, ..Options::default() };
    // Another compiler places the loops elsewhere, and the checks need no loop counts.
    if is_judged {
        options.loops.clone_from(&instance.loops);
    }
    // The symbol exists, so a remaining error concerns the loops.
    Answer::of(image, &options).map_err(|why| told(&key("loops"), &why))
}

/// Runs a firmware once for all its instances, if one of them has a limit on an executed figure.
fn trace(
    image: &str,
    file: &File,
    answers: &mut [(usize, Answer)],
    trace_of: &mut impl FnMut(&str, &[(u32, u32)]) -> Result<Vec<u32>, String>,
) -> Result<(), String> {
    let is_executed = |figures: &BTreeMap<Figure, u64>| figures.keys().any(|figure| figure.is_executed());
    let is_wanted = |instance: &Instance| {
        let uses = |one: &&Difference| one.of == instance.name || one.without == instance.name;
        let mut differences = file.difference.iter().filter(uses);
        is_executed(&instance.ceiling) || differences.any(|one| is_executed(&one.ceiling) || is_executed(&one.exactly))
    };
    let wanted: Vec<&mut Answer> =
        answers.iter_mut().filter(|(k, _)| is_wanted(&file.instance[*k])).map(|(_, answer)| answer).collect();
    if wanted.is_empty() {
        return Ok(());
    }
    let mut ranges: Vec<(u32, u32)> = wanted.iter().flat_map(|answer| answer.ranges()).collect();
    ranges.sort_unstable();
    ranges.dedup();
    let executed = trace_of(image, &ranges)?;
    for answer in wanted {
        answer.price(&executed, None);
    }
    Ok(())
}

fn figures(image: &Image, instance: &Instance, report: &Report) -> BTreeMap<Figure, u64> {
    let size = |name: &Option<String>| Some(u64::from(image.find_data(name.as_deref()?).ok()?.size));
    let all = Figure::ALL.into_iter().filter_map(|figure| {
        let value = match figure {
            Figure::Bound => report.bound(),
            Figure::Typical => report.typical.map(|typical| typical.cycles.max),
            Figure::Pipelined => report.typical.map(|typical| typical.pipelined.max),
            Figure::Instructions => report.typical.map(|typical| typical.instructions.max),
            Figure::Arithmetic => report.typical.map(|typical| typical.arithmetic.max),
            Figure::Flash => Some(u64::from(report.flash_bytes)),
            Figure::Stack => report.stack_bytes.map(u64::from),
            Figure::State => size(&instance.state),
            Figure::Coefficients => size(&instance.coefficients),
        };
        Some((figure, value?))
    });
    all.collect()
}

impl Verdict {
    fn instance(&mut self, instance: &Instance, measured: &Measured, told: &impl Fn(&str, &str) -> String) {
        let name = &instance.name;
        // For another compiler, only unread code matters: it could hide something from the checks.
        let hides = measured.is_judged || !measured.answer.is_read();
        let told_in = if hides { &mut self.declined } else { &mut self.notes };
        told_in.extend(measured.answer.report.declined.iter().map(|reason| format!("{name}: {reason}")));
        for check in Check::ALL {
            let found = measured.answer.found.iter().find(|(found, _)| *found == check);
            match (found, instance.allow.get(&check)) {
                (Some((_, line)), None) => self.failures.push(format!("{name}: {line}")),
                (None, Some(_)) if measured.is_judged => {
                    let key = format!(".allow.{}", check.name());
                    self.failures.push(told(&key, "unused exception: remove it"));
                }
                _ => {}
            }
        }
        for figure in Figure::ALL {
            let value = measured.figures.get(&figure).copied();
            let (ceiling, floor) = (instance.ceiling.get(&figure).copied(), instance.floor.get(&figure).copied());
            let (mut remark, unit) = (String::new(), figure.unit());
            let key = format!(".ceiling.{}", figure.name());
            if let (Some(value), Some(ceiling)) = (value, ceiling) {
                if value > ceiling {
                    remark = format!("above by {}", value - ceiling);
                    self.fail(measured, || told(&key, &format!("{name} has {value} {unit}, above the ceiling")));
                } else if value.saturating_mul(100) < ceiling.saturating_mul(100 - SLACK_PERCENT) {
                    remark = format!("loose: write {value}");
                    let message = format!(
                        "{name} has {value} {unit}, more than {SLACK_PERCENT} % below the ceiling of {ceiling}; write \
                         {} = {value}",
                        figure.name()
                    );
                    self.fail(measured, || told(&key, &message));
                }
            }
            if let (Some(value), Some(floor)) = (value, floor)
                && value < floor
            {
                remark = "below the floor".into();
                let message = format!("{name} has {value} {unit}, below the floor of {floor}, a wrong floor");
                self.fail(measured, || told(&format!(".floor.{}", figure.name()), &message));
            }
            // A refusal explains the missing figure already; this covers any other case.
            if value.is_none() && ceiling.is_some() && measured.is_judged && self.declined.is_empty() {
                self.declined.push(told(&key, &format!("{name}: the figure is not available")));
            }
            if value.is_some() || ceiling.is_some() {
                let value = value.map(|value| value as i64);
                self.rows.push(Row { name: name.clone(), figure, value, ceiling, floor, remark });
            }
        }
    }

    fn difference(
        &mut self,
        difference: &Difference,
        of: &Measured,
        without: &Measured,
        told: &impl Fn(&str, &str) -> String,
    ) {
        let name = &difference.name;
        let judged = if of.is_judged { without } else { of };
        for figure in Figure::ALL {
            let value = |one: &Measured| one.figures.get(&figure).map(|value| *value as i64);
            let value = value(of).zip(value(without)).map(|(of, without)| of - without);
            let ceiling = difference.ceiling.get(&figure).copied();
            let exactly = difference.exactly.get(&figure).copied();
            let (mut remark, unit) = (String::new(), figure.unit());
            if let (Some(value), Some(ceiling)) = (value, ceiling)
                && value > ceiling as i64
            {
                remark = format!("above by {}", value - ceiling as i64);
                let key = format!(".ceiling.{}", figure.name());
                self.fail(judged, || told(&key, &format!("{name} has {value} {unit}, above the ceiling")));
            }
            if let (Some(value), Some(exactly)) = (value, exactly)
                && value != exactly as i64
            {
                remark = format!("not {exactly}");
                let key = format!(".exactly.{}", figure.name());
                self.fail(judged, || told(&key, &format!("{name} has {value} {unit}, not {exactly}")));
            }
            if value.is_none() && ceiling.or(exactly).is_some() && judged.is_judged && self.declined.is_empty() {
                self.declined.push(format!("{name}: `{}` is not available for both instances", figure.name()));
            }
            if ceiling.or(exactly).is_some() || (value.is_some_and(|value| value != 0)) {
                let ceiling = ceiling.or(exactly);
                self.rows.push(Row { name: name.clone(), figure, value, ceiling, floor: None, remark });
            }
        }
    }

    /// Records a failure. Code of another compiler fails once as a whole, so its figures are only in the table.
    fn fail(&mut self, measured: &Measured, message: impl Fn() -> String) {
        if measured.is_judged {
            self.failures.push(message());
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut table =
            Table::new(["instance", "figure", "value", "unit", "ceiling", "floor", "of ceiling", "of floor", ""]);
        let mut before = "";
        for Row { name, figure, value, ceiling, floor, remark } in &self.rows {
            let shown = |number: Option<String>| number.unwrap_or_default();
            let ratio = |to: Option<u64>| {
                let to = to.filter(|to| *to > 0)?;
                Some(format!("{:.2}", (*value)? as f64 / to as f64))
            };
            table.row([
                if before == name { String::new() } else { name.clone() },
                figure.name().to_owned(),
                value.map_or_else(|| "-".into(), |value| value.to_string()),
                if figure.unit() == figure.name() { String::new() } else { figure.unit().to_owned() },
                shown(ceiling.map(|ceiling| ceiling.to_string())),
                shown(floor.map(|floor| floor.to_string())),
                shown(ratio(*ceiling)),
                shown(ratio(*floor)),
                remark.clone(),
            ]);
            before = name;
        }
        write!(f, "{table}")?;
        writeln!(f, "\nceilings for {}; cycles by ARM DDI 0439D, zero wait states; `typical` with P = 2", self.compiler)
    }
}

#[cfg(test)]
mod tests;
