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
mod error;
mod fmu;
mod plan;
mod rust;
mod standalone;

pub use arm::Effort;
pub use assembly::Files;
pub use error::Error;
pub use fmu::{Fmu, fmu, plant_fmu};

/// Default prefix of the names in an exported C file.
pub const PREFIX: &str = "edo_smc";

/// Form of an exported controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form<'a> {
    /// Self-contained C99; every name begins with this prefix.
    Standalone(&'a str),
    /// Specification of a function of the self-contained file for `cycle-bound --means`: prefix and name.
    Means(&'a str, &'a str),
    /// Specification of an assembly function for `cycle-bound --means`: prefix and name.
    MeansOfAssembly(&'a str, &'a str),
    /// C for the static library of `controller-capi`: the design of a controller, or the configuration of a drive. Its
    /// name begins with this prefix.
    Archive(&'a str),
    /// Rust for `controller-core`.
    Rust,
}

/// Returns the warnings before a controller drives hardware: warnings of its design, an unstable loop, missing limits
/// of u.
pub fn warnings(experiment: &Experiment) -> Vec<String> {
    let mut warnings = experiment.warnings.clone();
    warnings.extend(margins::warnings(experiment));
    warnings.extend(without_limits(experiment));
    warnings
}

/// Returns the missing limits of u, and how to set them; `None` if both are set.
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

/// Returns the text of an exported file.
///
/// # Errors
/// The controller cannot be exported in this form; the message has the remedy.
pub fn export(experiment: &Experiment, source: &Source<'_>, form: Form<'_>) -> Result<String, Error> {
    if matches!(form, Form::MeansOfAssembly(..)) && !cfg!(feature = "asm") {
        return Err(Error::Feature("asm"));
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

/// Returns the functions of an exported controller as assembly for a Cortex-M4F, with their header. Every name begins
/// with `prefix`. The output is deterministic for one experiment and effort.
///
/// # Errors
/// The controller cannot be exported as assembly; the message has the remedy.
pub fn assembly(experiment: &Experiment, source: &Source<'_>, prefix: &str, effort: &Effort) -> Result<Files, Error> {
    if let Some(drive) = &experiment.drive {
        return drive::files(drive, &About::of(experiment, source), prefix, effort);
    }
    let of_formulas = |spec: &&ControllerSpec| matches!(spec.model, Model::Formulas { .. });
    let Some(spec) = experiment.spec.as_ref().filter(of_formulas) else {
        return assembly::files(&exported(experiment, source)?, prefix, effort);
    };
    // The caller evaluates the formula; no other number of the design depends on it.
    let linear = ControllerSpec { model: Model::Linear(vec![0.0; spec.config.n]), ..spec.clone() };
    let designed = in_process::build(&linear).map_err(Error::Controller)?;
    let download = designed.download.ok_or(Error::Precision)?;
    let exported = Exported { spec, download: &download, about: About::of(experiment, source) };
    assembly::files(&exported, prefix, effort)
}

/// Returns the operation traces of the self-contained C file of a scenario.
///
/// # Errors
/// The controller cannot be exported to C; the message has the remedy.
#[cfg(feature = "proof")]
pub fn functions(experiment: &Experiment) -> Result<tick_proof::Functions, Error> {
    use tick_proof::Functions;
    if let Some(drive) = &experiment.drive {
        return drive::functions(drive).map(Functions::Drive);
    }
    let (spec, download) = parts(experiment)?;
    standalone::functions(spec, download).map(Functions::Chain)
}

/// Returns the specification and the coefficients of an exportable controller.
fn parts(experiment: &Experiment) -> Result<(&ControllerSpec, &Download), Error> {
    match (&experiment.spec, &experiment.download) {
        (Some(spec), Some(download)) => Ok((spec, download)),
        (None, _) => Err(Error::Baseline),
        _ => Err(experiment.formulas_stay_here().map_or(Error::Precision, Error::Formula)),
    }
}

/// Returns the data of an export.
fn exported<'a>(experiment: &'a Experiment, source: &'a Source<'a>) -> Result<Exported<'a>, Error> {
    let (spec, download) = parts(experiment)?;
    Ok(Exported { spec, download, about: About::of(experiment, source) })
}

/// Origin of a file, and its design.
struct About<'a> {
    /// Fingerprint of all inputs of the exported functions: the fingerprint of the port that `run` uses.
    design: u32,
    warnings: Vec<String>,
    source: &'a Source<'a>,
}

impl<'a> About<'a> {
    fn of(experiment: &Experiment, source: &'a Source<'a>) -> Self {
        // Only the baseline has no fingerprint, and it is not exported.
        Self { design: experiment.port.fingerprint().unwrap_or(0), warnings: warnings(experiment), source }
    }

    /// Returns the origin as text; every line is valid in a comment of C and of Rust.
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

/// Common input of all forms.
struct Exported<'a> {
    spec: &'a ControllerSpec,
    download: &'a Download,
    about: About<'a>,
}

impl Exported<'_> {
    /// Returns the observed channels, from 1.
    fn channels(&self) -> Vec<usize> {
        channels(self.download.shape)
    }

    fn shape(&self) -> String {
        shape_text(self.download.shape)
    }
}

/// Returns the observed channels, from 1.
fn channels(shape: Shape) -> Vec<usize> {
    (1..=usize::from(shape.n)).filter(|i| shape.mask >> (i - 1) & 1 == 1).collect()
}

/// Returns the configuration as text, for example `n = 4, observers of order up to 2 in channels 2, 4`.
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

/// Returns a text that is safe in any comment: nothing in it ends the comment, opens another one or changes the writing
/// direction. Replaced characters are visible as `?`.
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

/// Returns the numbers of a download by their names in [`LAYOUT`], with the numbers before the coefficients.
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
