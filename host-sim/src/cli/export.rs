//! `export`: the designed controller as a source file.

use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args, ValueEnum};
use scenario::{Experiment, Source};

use super::{Console, DEFAULT, Failure, ScenarioText, bad, failed, free, status, write_file};
use crate::feature::Feature;
use forms::{Effort, Form, PREFIX};

/// Languages that link a library of this project.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Language {
    /// A constant for a program that links the archive of controller-capi.
    C,
    /// A static for a program that links controller-core.
    Rust,
}

#[derive(Args, Debug)]
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
#[command(group = ArgGroup::new("form").required(true).multiple(true).args(["standalone", "lang", "asm"]))]
pub(super) struct ExportOptions {
    /// The scenario; without one the default.
    scenario: Option<PathBuf>,
    /// Override a key, as in --set controller.k_l=100.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// One self-contained C99 file: tick and coefficients, no library needed; --lang c may stand beside it.
    #[arg(long)]
    standalone: bool,
    /// Instead of that file, or of --asm, what this function of it is to compute (start, tick, not_started,
    /// report_applied, estimates, reset; of --asm tick_u too): for cycle-bound --means, which holds machine code to it.
    #[arg(long, value_name = "FUNCTION", conflicts_with = "lang")]
    means: Option<String>,
    /// What is proved of that file for every input, written beside it: statements, verdicts, solver, its SHA-256
    /// (docs/proofs.md). Takes a minute or so, and the solver Bitwuzla (pip install bitwuzla) (feature proof).
    #[arg(long, value_name = "FILE", requires_all = ["standalone", "output"], conflicts_with = "means")]
    certificate: Option<PathBuf>,
    /// The Python that has the solver.
    #[arg(long, value_name = "PATH", requires = "certificate")]
    python: Option<PathBuf>,
    /// Two files for a Cortex-M4F: the tick as scheduled assembly, -o FILE.S, and its header, FILE.h beside it
    /// (feature asm).
    #[arg(long, requires = "output", conflicts_with_all = ["standalone", "lang"])]
    asm: bool,
    /// The design for a program that links the library of this language.
    #[arg(long)]
    lang: Option<Language>,
    /// What the names in a C file begin with; two controllers in one program need two.
    #[arg(long, value_name = "NAME", default_value = PREFIX, value_parser = prefix)]
    prefix: String,
    /// Export a reading of the paper that is for its figures only: no joint has its input gain.
    #[arg(long)]
    paper: bool,
    /// Export a controller whose u has no limits; --paper says so too.
    #[arg(long)]
    no_limits: bool,
    /// The file to write; an existing one is left as it is [default: stdout].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite the file.
    #[arg(long, requires = "output")]
    force: bool,
}

/// What every name begins with must itself be a name, in C and in capitals.
fn prefix(text: &str) -> Result<String, String> {
    let starts = text.chars().next().is_some_and(|c| c.is_ascii_lowercase());
    let rest = text.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    if starts && rest && text.len() <= 32 {
        Ok(text.into())
    } else {
        Err("expected 1 to 32 of a-z, 0-9, `_`, a letter first".into())
    }
}

impl ExportOptions {
    /// The option that needs a feature.
    pub(super) const fn needs(&self) -> Option<(&'static str, Feature)> {
        match (self.asm, &self.certificate) {
            (true, _) => Some(("export --asm", Feature::Asm)),
            (_, Some(_)) => Some(("export --certificate", Feature::Proof)),
            _ => None,
        }
    }
}

impl Console<'_> {
    pub(super) fn export(&mut self, options: &ExportOptions) -> Result<u8, Failure> {
        let form = match options.lang {
            Some(Language::Rust) if options.prefix != PREFIX => {
                return Err(bad("--prefix is for C: in Rust the module is the prefix"));
            }
            Some(Language::Rust) if options.standalone => {
                return Err(bad("--standalone is a file of C and cannot be used with --lang rust"));
            }
            Some(Language::Rust) => Form::Rust,
            Some(Language::C) if !options.standalone => Form::Archive(&options.prefix),
            _ => match &options.means {
                Some(function) if options.asm => Form::MeansOfAssembly(&options.prefix, function),
                Some(function) => Form::Means(&options.prefix, function),
                None => Form::Standalone(&options.prefix),
            },
        };
        let text = ScenarioText::read(options.scenario.as_deref(), DEFAULT)?;
        let (file, source) = (&text.file, text.source(&options.sets));
        let experiment = match &options.scenario {
            Some(_) => scenario::parse_own(&source, &text.stem)?,
            None => scenario::parse(&source, &text.stem)?,
        };
        if let (Some(reading), false) = (experiment.figures_only, options.paper) {
            return Err(bad(format!(
                "{file}: the reading {reading:?} is for the paper's figures, and no joint has its input gain; set \
                 plant.reading=physical, begin with `host-sim new NAME --plant joint`, or say --paper"
            )));
        }
        if !(options.paper || options.no_limits) {
            refuse_without_limits(&experiment, file)?;
        }
        // The path of a file is of this machine only; what is exported is the same everywhere.
        let name = options.scenario.as_deref().and_then(Path::file_name).map(|name| name.to_string_lossy());
        let source = Source { file: name.as_deref().unwrap_or(file), ..source };
        let refused = |why: String| bad(format!("{file}: {why}"));
        let mut open = Vec::new();
        let files = match (&options.output, options.asm && options.means.is_none()) {
            (Some(path), true) => {
                let header = path.with_extension("h");
                if header == *path {
                    return Err(bad("--asm writes a header beside the file: name it .S, not .h"));
                }
                let files = forms::assembly(&experiment, &source, &options.prefix, &Effort::FULL).map_err(refused)?;
                vec![(path.clone(), files.assembly), (header, files.header)]
            }
            (path, _) => {
                let text = forms::export(&experiment, &source, form).map_err(refused)?;
                let Some(path) = path else {
                    self.warn_of_export(&experiment);
                    self.say(text.trim_end())?;
                    return Ok(status::DONE);
                };
                let mut files = vec![(path.clone(), text)];
                if let Some(certificate) = &options.certificate {
                    if certificate == path {
                        return Err(bad("--certificate is a file of its own, beside that of --output"));
                    }
                    for file in [path, certificate] {
                        free(file, options.force)?;
                    }
                    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
                    let proved = self.proved(&experiment, [&name, &files[0].1], options.python.as_deref(), refused)?;
                    let text;
                    (text, open) = proved;
                    files.push((certificate.clone(), text));
                }
                files
            }
        };
        self.warn_of_export(&experiment);
        for (path, text) in &files {
            write_file(path, text, options.force)?;
            self.say(&format!("wrote {}", path.display()))?;
        }
        if open.is_empty() {
            return Ok(status::DONE);
        }
        Err(failed(format!("not all is proved\n{}", open.join("\n"))))
    }

    fn warn_of_export(&mut self, experiment: &Experiment) {
        for warning in forms::warnings(experiment) {
            self.note(&format!("warning: {warning}"));
        }
    }
}

/// What drives a motor must know how far it may go.
pub(super) fn refuse_without_limits(experiment: &Experiment, file: &str) -> Result<(), Failure> {
    match forms::without_limits(experiment) {
        Some(why) => Err(bad(format!("{file}: {why}, or say --no-limits"))),
        None => Ok(()),
    }
}
