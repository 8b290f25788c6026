//! `export`: the designed controller as a source file.

use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args, ValueEnum};
use scenario::{Experiment, Source};
use study::design::refused_as_unstable;

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

    /// The form of the file; none for assembly, which makes two.
    fn form(&self) -> Result<Option<Form<'_>>, Failure> {
        Ok(Some(match self.lang {
            Some(Language::Rust) if self.prefix != PREFIX => {
                return Err(bad("--prefix is for C: in Rust the module is the prefix"));
            }
            Some(Language::Rust) if self.standalone => {
                return Err(bad("--standalone is a file of C and cannot be used with --lang rust"));
            }
            Some(Language::Rust) => Form::Rust,
            Some(Language::C) if !self.standalone => Form::Archive(&self.prefix),
            _ => match &self.means {
                Some(function) if self.asm => Form::MeansOfAssembly(&self.prefix, function),
                Some(function) => Form::Means(&self.prefix, function),
                None if self.asm => return Ok(None),
                None => Form::Standalone(&self.prefix),
            },
        }))
    }
}

/// Files to write, and the statements of a certificate that stayed open.
type Exported = (Vec<(PathBuf, String)>, Vec<String>);

/// What is exported: the experiment, its source, and the file that messages name.
struct Exporting<'a> {
    experiment: Experiment,
    source: Source<'a>,
    file: &'a str,
}

impl Exporting<'_> {
    fn refused(&self, why: &str) -> Failure {
        bad(format!("{}: {why}", self.file))
    }

    /// A program for a motor must have limits and be stable, and a reading of the paper for its figures is no program.
    fn may_be_exported(&self, options: &ExportOptions) -> Result<(), Failure> {
        let (file, experiment) = (self.file, &self.experiment);
        if let (Some(reading), false) = (experiment.figures_only, options.paper) {
            return Err(bad(format!(
                "{file}: the reading {reading:?} is for the paper's figures, and no joint has its input gain; set \
                 plant.reading=physical, begin with `host-sim new NAME --plant joint`, or say --paper"
            )));
        }
        if let Some(why) = refused_as_unstable(experiment) {
            return Err(self.refused(&why));
        }
        if options.paper || options.no_limits { Ok(()) } else { refuse_without_limits(experiment, file) }
    }

    /// The assembly, and its header beside it.
    fn assembly(&self, path: &Path, prefix: &str) -> Result<Exported, Failure> {
        let header = path.with_extension("h");
        if header == *path {
            return Err(bad("--asm writes a header beside the file: name it .S, not .h"));
        }
        let files = forms::assembly(&self.experiment, &self.source, prefix, &Effort::FULL);
        let files = files.map_err(|why| self.refused(&why))?;
        Ok((vec![(path.to_path_buf(), files.assembly), (header, files.header)], Vec::new()))
    }
}

impl Console<'_> {
    pub(super) fn export(&mut self, options: &ExportOptions) -> Result<u8, Failure> {
        let form = options.form()?;
        let text = ScenarioText::read(options.scenario.as_deref(), DEFAULT)?;
        let (file, source) = (&text.file, text.source(&options.sets));
        let experiment = match &options.scenario {
            Some(_) => scenario::parse_own(&source, &text.stem)?,
            None => scenario::parse(&source, &text.stem)?,
        };
        // The path of a file is of this machine only; what is exported is the same everywhere.
        let name = options.scenario.as_deref().and_then(Path::file_name).map(|name| name.to_string_lossy());
        let source = Source { file: name.as_deref().unwrap_or(file), ..source };
        let exporting = Exporting { experiment, source, file };
        exporting.may_be_exported(options)?;
        let (files, open) = match (&options.output, form) {
            (Some(path), None) => exporting.assembly(path, &options.prefix)?,
            (path, form) => {
                let form = form.unwrap_or(Form::Standalone(&options.prefix));
                let text = forms::export(&exporting.experiment, &exporting.source, form);
                let text = text.map_err(|why| exporting.refused(&why))?;
                let Some(path) = path else {
                    self.warn_of_export(&exporting.experiment);
                    self.say(text.trim_end())?;
                    return Ok(status::DONE);
                };
                self.with_certificate(&exporting, options, path, text)?
            }
        };
        self.warn_of_export(&exporting.experiment);
        for (path, text) in &files {
            write_file(path, text, options.force)?;
            self.say(&format!("wrote {}", path.display()))?;
        }
        if open.is_empty() {
            return Ok(status::DONE);
        }
        Err(failed(format!("not all is proved\n{}", open.join("\n"))))
    }

    /// A file of source code, and its certificate beside it if one is asked for.
    fn with_certificate(
        &mut self,
        exporting: &Exporting<'_>,
        options: &ExportOptions,
        path: &Path,
        text: String,
    ) -> Result<Exported, Failure> {
        let Some(certificate) = &options.certificate else {
            return Ok((vec![(path.to_path_buf(), text)], Vec::new()));
        };
        if certificate == path {
            return Err(bad("--certificate is a file of its own, beside that of --output"));
        }
        for file in [path, certificate] {
            free(file, options.force)?;
        }
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let refused = |why: String| exporting.refused(&why);
        let python = options.python.as_deref();
        let (proofs, open) = self.proved(&exporting.experiment, [&name, &text], python, refused)?;
        Ok((vec![(path.to_path_buf(), text), (certificate.clone(), proofs)], open))
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
