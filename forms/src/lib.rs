#![doc = include_str!("../README.md")]

use std::collections::BTreeMap;
use std::fmt::Write as _;

use controller_core::{LAYOUT, Limits, Shape};
use loop_sim::port::in_process::{self, ControllerSpec, Download, Model};
use scenario::{Experiment, Source};
use study::margins;

mod archive;
#[cfg_attr(not(feature = "asm"), path = "no_arm.rs")]
mod arm;
mod assembly;
mod c99;
mod config;
mod drive;
mod plan;
mod rust;
mod standalone;

pub use arm::Effort;
pub use assembly::Files;

/// What the names of an exported C file begin with, if nothing else is asked for.
pub const PREFIX: &str = "edo_smc";

/// Which form an exported controller has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form<'a> {
    /// Self-contained C99; every name in it begins with this prefix.
    Standalone(&'a str),
    /// What a function of the self-contained file, of this prefix and name, is to compute: for `cycle-bound --means`.
    Means(&'a str, &'a str),
    /// The same of the assembly.
    MeansOfAssembly(&'a str, &'a str),
    /// C on the archive of `controller-capi`: the design of a controller, of a drive its configuration; the name of
    /// either begins with this prefix.
    Archive(&'a str),
    /// Rust on `controller-core`.
    Rust,
}

/// What to be warned of before this controller drives anything: the warnings of its design, a loop that is not stable,
/// and limits that it has not.
pub fn warnings(experiment: &Experiment) -> Vec<String> {
    let mut warnings = experiment.warnings.clone();
    warnings.extend(margins::warnings(experiment));
    warnings.extend(without_limits(experiment));
    warnings
}

/// Which limits of u the controller has not, and how to give them; `None` if it has both.
pub fn without_limits(experiment: &Experiment) -> Option<String> {
    let Limits { min, max } = experiment.spec.as_ref()?.config.padded.options.limits;
    let (what, size) = match (min <= Limits::NONE.min, max >= Limits::NONE.max) {
        (true, true) => ("limits", Limits::NONE.max),
        (true, false) => ("lower limit", Limits::NONE.min),
        (false, true) => ("upper limit", Limits::NONE.max),
        (false, false) => return None,
    };
    Some(format!("u has no {what}: up to {size:e} may go out; set controller.limits={{ min = .., max = .. }}"))
}

/// The text of an exported file.
///
/// # Errors
/// What cannot be exported, and what to change.
pub fn export(experiment: &Experiment, source: &Source<'_>, form: Form<'_>) -> Result<String, String> {
    if matches!(form, Form::MeansOfAssembly(..)) && !cfg!(feature = "asm") {
        return Err("assembly needs the feature asm".into());
    }
    if let Some(drive) = &experiment.drive {
        return drive::text(drive, &About::of(experiment, source), form);
    }
    let exported = exported(experiment, source)?;
    match form {
        Form::Standalone(prefix) => standalone::text(&exported, prefix),
        Form::Means(prefix, function) => standalone::means(&exported, prefix, function),
        Form::MeansOfAssembly(prefix, function) => assembly::means(&exported, prefix, function),
        Form::Archive(prefix) => archive::text(&exported, prefix),
        Form::Rust => rust::text(&exported),
    }
}

/// The functions of an exported controller as assembly for a Cortex-M4F, and their header; every name begins with
/// `prefix`. The same experiment and effort give the same files.
///
/// # Errors
/// What cannot be exported, and what to change.
pub fn assembly(experiment: &Experiment, source: &Source<'_>, prefix: &str, effort: &Effort) -> Result<Files, String> {
    if let Some(drive) = &experiment.drive {
        return drive::files(drive, &About::of(experiment, source), prefix, effort);
    }
    let of_formulas = |spec: &&ControllerSpec| matches!(spec.model, Model::Formulas { .. });
    let Some(spec) = experiment.spec.as_ref().filter(of_formulas) else {
        return assembly::files(&exported(experiment, source)?, prefix, effort);
    };
    // The caller computes what a formula says: no other number of the design depends on it.
    let linear = ControllerSpec { model: Model::Linear(vec![0.0; spec.config.n]), ..spec.clone() };
    let designed = in_process::build(&linear).map_err(|error| error.to_string())?;
    let download = designed.download.ok_or(F32_ONLY)?;
    let exported = Exported { spec, download: &download, about: About::of(experiment, source) };
    assembly::files(&exported, prefix, effort)
}

/// The records that the self-contained C file of a scenario is written from.
///
/// # Errors
/// What cannot be exported to C, and what to change.
#[cfg(feature = "proof")]
pub fn functions(experiment: &Experiment) -> Result<tick_proof::Functions, String> {
    use tick_proof::Functions;
    if let Some(drive) = &experiment.drive {
        return drive::functions(drive).map(Functions::Drive);
    }
    let (spec, download) = parts(experiment)?;
    standalone::functions(spec, download).map(Functions::Chain)
}

const F32_ONLY: &str = "an exported controller computes in f32; set controller.precision=f32";

/// What a controller that can be exported is made of.
fn parts(experiment: &Experiment) -> Result<(&ControllerSpec, &Download), String> {
    match (&experiment.spec, &experiment.download) {
        (Some(spec), Some(download)) => Ok((spec, download)),
        (None, _) => Err("the baseline is not exported; set controller.kind=proposed".into()),
        _ => Err(experiment.formulas_stay_here().unwrap_or_else(|| F32_ONLY.into())),
    }
}

/// What there is to export of a controller.
fn exported<'a>(experiment: &'a Experiment, source: &'a Source<'a>) -> Result<Exported<'a>, String> {
    let (spec, download) = parts(experiment)?;
    Ok(Exported { spec, download, about: About::of(experiment, source) })
}

/// Where a file comes from, and which design it is.
struct About<'a> {
    /// Fingerprint of everything that changes what the exported functions do: the one of the port that `run` runs.
    design: u32,
    warnings: Vec<String>,
    source: &'a Source<'a>,
}

impl<'a> About<'a> {
    fn of(experiment: &Experiment, source: &'a Source<'a>) -> Self {
        // Only a law without one has none, and that is not exported.
        Self { design: experiment.port.fingerprint().unwrap_or(0), warnings: warnings(experiment), source }
    }

    /// Line by line: every line may stand in a comment of C and of Rust.
    fn origin(&self) -> String {
        let Self { design, warnings, source: Source { file, text, sets } } = self;
        let mut origin = String::new();
        for warning in warnings {
            let _ = writeln!(origin, "Warning of the design: {warning}");
        }
        let _ = writeln!(origin, "Design {design:#010x} (FNV-1a; `design_hash` in the run.json of a run).");
        for set in *sets {
            let _ = writeln!(origin, "Changed by --set {set}");
        }
        let checksum = pil_wire::checksum(text.as_bytes());
        let _ = writeln!(origin, "Scenario {file} (CRC-32 {checksum:#010x}):\n");
        for line in text.lines() {
            let _ = writeln!(origin, "    {line}");
        }
        harmless(&origin)
    }
}

/// What all forms are made from.
struct Exported<'a> {
    spec: &'a ControllerSpec,
    download: &'a Download,
    about: About<'a>,
}

impl Exported<'_> {
    /// Observed channels, from 1.
    fn channels(&self) -> Vec<usize> {
        channels(self.download.shape)
    }

    fn shape(&self) -> String {
        shape_text(self.download.shape)
    }
}

/// Observed channels, from 1.
fn channels(shape: Shape) -> Vec<usize> {
    (1..=usize::from(shape.n)).filter(|i| shape.mask >> (i - 1) & 1 == 1).collect()
}

/// `n = 4, observers of order up to 2 in channels 2, 4`.
fn shape_text(shape: Shape) -> String {
    let channels: Vec<String> = channels(shape).iter().map(usize::to_string).collect();
    match channels.as_slice() {
        [] => format!("n = {}, no observer", shape.n),
        [one] => format!("n = {}, an observer of order {} in channel {one}", shape.n, shape.r),
        many => {
            format!("n = {}, observers of order up to {} in channels {}", shape.n, shape.r, many.join(", "))
        }
    }
}

/// A text as it may stand in any comment: nothing in it ends the comment, opens another or turns the direction of
/// reading. What is changed so is visible.
fn harmless(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if matches!((out.chars().next_back(), c), (Some('*'), '/') | (Some('/'), '*')) {
            out.push(' ');
        }
        let shown = c == '\n' || c == ' ' || c.is_ascii_graphic() || c.is_alphanumeric();
        out.push(match c {
            '\t' => ' ',
            _ if shown => c,
            _ => '?',
        });
    }
    out
}

/// The numbers of a download by the names of [`LAYOUT`], with what comes before the coefficients.
fn named(n: usize, r: usize, o: usize, numbers: &[f32]) -> BTreeMap<&'static str, Vec<f32>> {
    let mut given = numbers.iter().copied();
    let mut named = BTreeMap::new();
    for field in ["d_hat[N]", "drift[N]"].into_iter().chain(LAYOUT.split_whitespace()) {
        let (name, shape) = field.split_once('[').unwrap_or((field, ""));
        let count = match shape {
            "N]" => n,
            "O][R]" => o * r,
            _ => 1,
        };
        named.insert(name, given.by_ref().take(count).collect());
    }
    named
}
