//! Ceilings: what each shipped function may cost, in a file beside the firmware, so that nothing gets dearer unseen.
//!
//! ```toml
//! compiler = "rustc 1.96.0"            # the ceilings hold for its code; another compiler's is shown, and fails
//!
//! [[instance]]
//! name = "current loop"
//! image = "target/thumbv7em-none-eabihf/release/drive"        # relative to this file
//! symbol = "TIM3"
//! state = "drive::STATE"               # the static whose size is the figure `state`
//! coefficients = "drive::CONTROLLER"   # and `coefficients`
//! barrier = 3                          # as --barrier; loops = ["PLACE=N"] as --loop
//! ceiling = { bound = 577, typical = 454, instructions = 291, flash = 1420, stack = 72, state = 48 }   # or fewer
//! floor = { typical = 129 }            # what theory says is the least
//! allow = { division = "b(x) varies" } # all checks are asked for; an exception has its reason
//! why = "a third of the 1600 cycles between two interrupts"
//!
//! [[difference]]                       # one instance less another
//! name = "guard"
//! of = "current loop"
//! without = "current loop, no guard"
//! ceiling = { typical = 20 }           # or: exactly = { arithmetic = 16 }
//! why = ".."
//! ```
//!
//! | figure | unit | what it is |
//! |---|---|---|
//! | `bound` | cycles | the upper bound |
//! | `typical` | cycles | the dearest call in a run in the emulator, by the typical reading of the table |
//! | `pipelined` | cycles | the same if VLDR and VSTR pipeline as LDR and STR do |
//! | `instructions` | | the longest call in that run, exact |
//! | `arithmetic` | | most additions, subtractions, multiplications and conversions of floats in a call of that run |
//! | `flash`, `stack` | B | the function and all it reaches; below the stack pointer at the entry |
//! | `state`, `coefficients` | B | the statics that are named |
//!
//! A figure fails above its ceiling, and also more than [`SLACK_PERCENT`] below it: a ceiling that is not lowered after
//! a gain lets the gain be lost again. The dearest call counts, not the mean, since a budget is for every call. A
//! difference has no such lower edge: 5 % of each of two figures is more than a small difference between them.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};
use whole_file::{Existing, Kind};

use crate::image::Image;
use crate::report::Report;
use crate::{Answer, Check, Options, emulated, image_file};
use terminal::table::Table;

use file::{Difference, File, Instance, Located, nearest};

mod file;

/// A ceiling is tight if the figure is no more than this below it.
pub const SLACK_PERCENT: u64 = 5;

/// What is counted of a function and may have a ceiling.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Figure {
    /// Upper bound of a call, in cycles.
    Bound,
    /// The dearest executed call, in typical cycles.
    Typical,
    /// The same with pipelined float loads and stores.
    Pipelined,
    /// Instructions of the longest executed call.
    Instructions,
    /// Of floats, in an executed call.
    Arithmetic,
    /// Bytes of the function and all it reaches.
    Flash,
    /// Bytes below the stack pointer at the entry, callees included.
    Stack,
    /// Bytes of the static that the file names as state.
    State,
    /// Bytes of the static that the file names as coefficients.
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

    /// As in the file.
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

    /// Of one or many.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Bound | Self::Typical | Self::Pipelined => "cycles",
            Self::Instructions => "instructions",
            Self::Arithmetic => "operations",
            Self::Flash | Self::Stack | Self::State | Self::Coefficients => "B",
        }
    }

    /// Does it take a run in the emulator?
    fn is_executed(self) -> bool {
        matches!(self, Self::Typical | Self::Pipelined | Self::Instructions | Self::Arithmetic)
    }
}

/// A figure of an instance or a difference, beside what it is held to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Of which instance or difference.
    pub name: String,
    /// Which figure of it this row holds.
    pub figure: Figure,
    /// The value of the figure; none if it has no answer.
    pub value: Option<i64>,
    /// The most, or of a difference that is fixed the very value.
    pub ceiling: Option<u64>,
    /// The least that theory allows.
    pub floor: Option<u64>,
    /// What is wrong, in a few words; empty if nothing is.
    pub remark: String,
}

/// An image and who compiled it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Built {
    /// As in the file.
    pub image: String,
    /// What its compilers say of themselves.
    pub compilers: Vec<String>,
    /// Do the ceilings hold for it?
    pub is_judged: bool,
}

/// The answer to a file of ceilings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// The compiler that the ceilings were measured with.
    pub compiler: String,
    /// The images that the file names, and who compiled them.
    pub images: Vec<Built>,
    /// All figures, each beside its ceiling.
    pub rows: Vec<Row>,
    /// What is above its ceiling, far below it, or should not be there.
    pub failures: Vec<String>,
    /// What has no answer, and why.
    pub declined: Vec<String>,
    /// What is to be known and fails nothing.
    pub notes: Vec<String>,
    /// Each instance: why its ceilings are where they are.
    pub reasons: BTreeMap<String, String>,
}

/// What is to be written into the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Write {
    /// Every ceiling that is above its figure, lowered to it.
    Lowered,
    /// The compiler of the images and their figures, in place of those of another compiler.
    Recorded,
}

/// Reads the file and its images, runs them in the emulator, and holds every figure to its ceiling; what is asked is
/// written into the file first.
///
/// # Errors
/// Bad input, in one line.
pub fn run(path: &Path, write: Option<Write>, stop: &AtomicBool) -> Result<Verdict, String> {
    let file = path.display().to_string();
    let text = whole_file::read_text(path, Kind::SETTINGS).map_err(|message| format!("{file}: {message}"))?;
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

/// The text with the ceilings of what is judged lowered to their figures; none if all are there already.
fn lowered(text: &str, verdict: &Verdict) -> Option<String> {
    let mut document: toml_edit::DocumentMut = text.parse().ok()?;
    let is_above = |row: &Row| row.value < row.ceiling.map(|ceiling| ceiling as i64);
    with_ceilings(&mut document, "instance", verdict, is_above).then(|| document.to_string())
}

/// What comes of recording.
#[derive(Debug, PartialEq)]
enum Recorded {
    /// The text of the file with the new compiler and figures.
    Text(String),
    /// Something has no figure: nothing is recorded.
    Declined(Box<Verdict>),
}

/// The text with the compiler of the images and all their figures.
fn recorded(file: &str, text: &str, judged: impl Fn(&str) -> Result<Verdict, String>) -> Result<Recorded, String> {
    let verdict = judged(text)?;
    if verdict.images.iter().all(|built| built.is_judged) {
        return Err(format!(
            "{file}: its ceilings are of {} already; what was gained is written by --lower, a ceiling raised by hand",
            verdict.compiler
        ));
    }
    let mut document: toml_edit::DocumentMut =
        text.parse().map_err(|error: toml_edit::TomlError| format!("{file}: not TOML: {}", error.message()))?;
    document["compiler"] = toml_edit::value(common_compiler(&verdict).ok_or_else(|| {
        let of = |built: &Built| format!("{}: {}", built.image, built.compilers.join(", "));
        let all: Vec<String> = verdict.images.iter().map(of).collect();
        format!("{file}: there is no compiler that all images name ({})", all.join("; "))
    })?);
    let verdict = judged(&document.to_string())?;
    if !verdict.declined.is_empty() {
        return Ok(Recorded::Declined(Box::new(verdict)));
    }
    // A figure below its floor stays a failure: the floor is none then.
    let is_other = |row: &Row| row.value.is_some_and(|value| value >= row.floor.unwrap_or(0) as i64);
    with_ceilings(&mut document, "instance", &verdict, is_other);
    with_ceilings(&mut document, "difference", &verdict, |_| true);
    Ok(Recorded::Text(document.to_string()))
}

/// A compiler that every image names, up to its number; of the kind that the file had before any other.
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

/// Writes the figures of the rows that are `wanted` over their ceilings in this list of tables; was there any?
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
        // A difference has no image of its own.
        let image = verdict.images.iter().find(|built| built.image == text_of("image"));
        let is_judged = image.is_none_or(|built| built.is_judged);
        let rows: Vec<&Row> = verdict.rows.iter().filter(|row| is_judged && row.name == text_of("name")).collect();
        let Some(ceilings) = table.get_mut("ceiling").and_then(|item| item.as_table_like_mut()) else { continue };
        for row in rows.into_iter().filter(|row| wanted(row)) {
            let Some(ceiling) = ceilings.get_mut(row.figure.name()).and_then(|item| item.as_value_mut()) else {
                continue;
            };
            if let Some(value) = row.value {
                // The blanks and remarks around it stay.
                let around = ceiling.decor().clone();
                *ceiling = value.max(0).into();
                *ceiling.decor_mut() = around;
                any = true;
            }
        }
    }
    any
}

/// The same for images and traces from anywhere.
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
    // By instance.
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
            let by =
                if compilers.is_empty() { "a compiler that it does not name".into() } else { compilers.join(", ") };
            verdict.failures.push(format!(
                "{name} was built by {by}; the ceilings hold for {} alone: build it with that, or write down figures \
                 of your own: --record",
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

/// What was found of an instance.
struct Measured {
    answer: Answer,
    figures: BTreeMap<Figure, u64>,
    is_judged: bool,
}

/// What the layout cannot say.
fn check(file: &File, told: &impl Fn(&str, &str) -> String) -> Result<(), String> {
    let given = |key: &str, text: &str, what: &str| {
        if text.trim().is_empty() { Err(told(key, &format!("is missing: {what}"))) } else { Ok(()) }
    };
    given("compiler", &file.compiler, "the compiler that the ceilings were measured with, as \"rustc 1.96.0\"")?;
    if file.instance.is_empty() {
        return Err(told("instance", "is missing: a function and its ceilings, [[instance]]"));
    }
    let names = || file.instance.iter().map(|one| one.name.as_str());
    for (k, one) in file.instance.iter().enumerate() {
        let key = |name: &str| format!("instance[{}].{name}", k + 1);
        given(&key("name"), &one.name, "what the table calls it")?;
        given(&key("image"), &one.image, "the linked firmware, relative to this file")?;
        given(&key("symbol"), &one.symbol, "the function")?;
        given(&key("why"), &one.why, "the reason of its ceilings, in words")?;
        if names().position(|name| name == one.name) != Some(k) {
            return Err(told(&key("name"), &format!("{:?} is there already; each instance has its own", one.name)));
        }
        for (check, reason) in &one.allow {
            given(&key(&format!("allow.{}", check.name())), reason, "the reason of the exception, in words")?;
        }
        for (figure, name) in [(Figure::State, &one.state), (Figure::Coefficients, &one.coefficients)] {
            if one.ceiling.contains_key(&figure) && name.is_none() {
                let message = format!("needs the static that is measured: {} = \"NAME\"", figure.name());
                return Err(told(&key(&format!("ceiling.{}", figure.name())), &message));
            }
        }
        for (figure, floor) in &one.floor {
            if let Some(ceiling) = one.ceiling.get(figure).filter(|ceiling| floor > ceiling) {
                let message = format!("{floor} is above the ceiling of {ceiling}");
                return Err(told(&key(&format!("floor.{}", figure.name())), &message));
            }
        }
    }
    for (k, one) in file.difference.iter().enumerate() {
        let key = |name: &str| format!("difference[{}].{name}", k + 1);
        given(&key("name"), &one.name, "what the table calls it")?;
        if names().any(|name| name == one.name) {
            return Err(told(&key("name"), &format!("an instance is called {:?} already", one.name)));
        }
        given(&key("why"), &one.why, "the reason of its ceiling, in words")?;
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

/// Is `found`, as the image says it, the compiler that is `named`? Its number to the end: 1.9 is not 1.96.
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
    // Another compiler puts the loops elsewhere; the checks need no rounds.
    if is_judged {
        options.loops.clone_from(&instance.loops);
    }
    // The symbol is there: what is wrong now is a loop.
    Answer::of(image, &options).map_err(|why| told(&key("loops"), &why))
}

/// One run for all instances of an image, if any of them is held to what it executes.
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
        // Of another compiler's code only what hides something from the checks.
        let hides = measured.is_judged || !measured.answer.is_read();
        let told_in = if hides { &mut self.declined } else { &mut self.notes };
        told_in.extend(measured.answer.report.declined.iter().map(|reason| format!("{name}: {reason}")));
        for check in Check::ALL {
            let found = measured.answer.found.iter().find(|(found, _)| *found == check);
            match (found, instance.allow.get(&check)) {
                (Some((_, line)), None) => self.failures.push(format!("{name}: {line}")),
                (None, Some(_)) if measured.is_judged => {
                    let key = format!(".allow.{}", check.name());
                    self.failures.push(told(&key, "nothing needs this exception: take it out"));
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
                let message = format!("{name} has {value} {unit}, below the floor of {floor}, which is none then");
                self.fail(measured, || told(&format!(".floor.{}", figure.name()), &message));
            }
            // Why is told already, once for all figures; should it ever not be, nothing passes unseen.
            if value.is_none() && ceiling.is_some() && measured.is_judged && self.declined.is_empty() {
                self.declined.push(told(&key, &format!("{name} has no such figure")));
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
                self.declined.push(format!("{name}: no {} of both instances", figure.name()));
            }
            if ceiling.or(exactly).is_some() || (value.is_some_and(|value| value != 0)) {
                let ceiling = ceiling.or(exactly);
                self.rows.push(Row { name: name.clone(), figure, value, ceiling, floor: None, remark });
            }
        }
    }

    /// Of another compiler's code the table says enough.
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
        writeln!(f, "\nceilings of {}; cycles by ARM DDI 0439D, zero wait states; `typical` with P = 2", self.compiler)
    }
}

#[cfg(test)]
mod tests;
