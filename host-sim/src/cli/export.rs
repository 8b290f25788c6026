//! `host-sim export`: writes the designed controller as a source file.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args, ValueEnum};
use scenario::{Experiment, Source};
use study::design::refused_as_unstable;

use super::{Console, DEFAULT, Failure, ScenarioText, bad, failed, free, status, write_bytes, write_file};
use crate::feature::Feature;
use forms::{Effort, Form, PREFIX};

/// Language of the exported file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Language {
    /// Alone: configuration for a C program that links the static library libedo_smc.a. With --standalone: the whole
    /// controller as one C99 file, which needs no library.
    C,
    /// `static` for a Rust program with the crate controller-core.
    Rust,
}

#[derive(Args, Debug)]
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
#[command(group = ArgGroup::new("form").required(true).multiple(true)
    .args(["standalone", "lang", "asm", "fmu", "fmu_plant"]))]
#[command(group = ArgGroup::new("file").multiple(true).args(["output", "fmu", "fmu_plant"]))]
pub(super) struct ExportOptions {
    /// Scenario file [default: built-in joint of the paper].
    scenario: Option<PathBuf>,
    /// Override a key of the scenario; repeatable. Example: --set drive.period_s=5e-4 for a motor or joint, --set
    /// controller.k_l=20 for other plants.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Whole controller as one C99 file, which needs no library; --lang c may be given too. Without --standalone,
    /// --lang c writes only a configuration for the static library.
    #[arg(long)]
    standalone: bool,
    /// Reference text of this function for translation validation (cycle-bound --means), in place of the C file or of
    /// --asm. Functions: start, tick, not_started, report_applied, estimates, reset; with --asm also tick_u.
    #[arg(long, value_name = "FUNCTION", conflicts_with = "lang", help_heading = "Experiments")]
    means: Option<String>,
    /// Output file of the proof certificate of the C file: statements for every input, verdicts, solver, SHA-256
    /// (docs/verification.md). Takes about a minute. Needs the solver Bitwuzla (pip install bitwuzla) (feature proof).
    #[arg(long, value_name = "FILE", requires_all = ["standalone", "output"], conflicts_with = "means")]
    certificate: Option<PathBuf>,
    /// Python interpreter that has the solver.
    #[arg(long, value_name = "PATH", requires = "certificate")]
    python: Option<PathBuf>,
    /// Scheduled Cortex-M4F assembly of the tick in -o FILE.S, and its header FILE.h (feature asm).
    #[arg(long, requires = "output", conflicts_with_all = ["standalone", "lang"])]
    asm: bool,
    /// FMU of the controller, FMI 2.0 for Model Exchange and Co-Simulation: C sources and, if the C compiler `cc` is
    /// found on Linux x86-64, a binary. The angles are inputs; the encoders of the scenario round them
    /// (docs/simulink.md).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["standalone", "lang", "asm", "means", "output"])]
    fmu: Option<PathBuf>,
    /// FMU of the simulated motor or joint, with current command and load as inputs. Friction that holds fades below
    /// 0.005 rad/s.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["standalone", "lang", "asm", "means", "output"])]
    fmu_plant: Option<PathBuf>,
    /// Language of the file. `c` alone writes a configuration for the static library, `c` with --standalone the whole
    /// controller as one C99 file.
    #[arg(long)]
    lang: Option<Language>,
    /// Prefix of all names in a C file, and identifier of the model in an FMU. Two controllers in one program need two
    /// prefixes.
    #[arg(long, value_name = "NAME", default_value = PREFIX, value_parser = prefix)]
    prefix: String,
    /// Allow export of the parameter readings that only reproduce the paper's figures (their input gain is not
    /// physical).
    #[arg(long)]
    paper: bool,
    /// Allow export of a controller without limits of u; implied by --paper.
    #[arg(long)]
    no_limits: bool,
    /// Output file; an existing file is kept unless --force is given [default: stdout].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite the output file.
    #[arg(long, requires = "file")]
    force: bool,
}

/// Checks a prefix: it must be a valid C name, also in capitals.
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
    /// Returns the option that needs a cargo feature, and the feature.
    pub(super) const fn needs(&self) -> Option<(&'static str, Feature)> {
        match (self.asm, &self.certificate) {
            (true, _) => Some(("export --asm", Feature::Asm)),
            (_, Some(_)) => Some(("export --certificate", Feature::Proof)),
            _ => None,
        }
    }

    /// Returns the form of the output file; `None` for assembly, which has two files.
    fn form(&self) -> Result<Option<Form<'_>>, Failure> {
        Ok(Some(match self.lang {
            Some(Language::Rust) if self.prefix != PREFIX => {
                return Err(bad("--prefix is for C: in Rust the module is the prefix"));
            }
            Some(Language::Rust) if self.standalone => {
                return Err(bad(
                    "--standalone writes the whole controller as one C99 file and cannot be used with --lang rust. \
                     Leave one of them out",
                ));
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

    /// Returns the content of each output file, and for C the other form.
    fn contents(&self, is_drive: bool) -> [String; 2] {
        let what = if is_drive { "drive" } else { "controller" };
        match (&self.means, self.lang) {
            (Some(function), _) => [format!("reference text of the function `{function}`"), String::new()],
            (_, Some(Language::Rust)) => {
                [format!("the {what} as a `static`; needs the crate controller-core"), String::new()]
            }
            (_, Some(Language::C)) if !self.standalone => [
                format!(
                    "configuration of the {what} for C; needs the static library libedo_smc.a (`--lang c --standalone` \
                     writes the whole {what} as one C99 file)"
                ),
                String::new(),
            ],
            _ if self.asm => [format!("tick of the {what} as Cortex-M4F assembly"), "its C header".into()],
            _ => [
                format!(
                    "the whole {what} as one C99 file, no library needed (`--lang c` without --standalone writes a \
                     configuration for the static library)"
                ),
                "proof certificate of the C file".into(),
            ],
        }
    }
}

/// Files to write, and the statements of the certificate that are not proved.
type Exported = (Vec<(PathBuf, String)>, Vec<String>);

/// Input of an export: the experiment, its source, and the file name for messages.
struct Exporting<'a> {
    experiment: Experiment,
    source: Source<'a>,
    file: &'a str,
}

impl Exporting<'_> {
    fn refused(&self, why: impl Display) -> Failure {
        bad(format!("{}: {why}", self.file))
    }

    /// Rejects a controller without limits, an unstable one, and the readings that only reproduce the paper's figures.
    fn may_be_exported(&self, options: &ExportOptions) -> Result<(), Failure> {
        let (file, experiment) = (self.file, &self.experiment);
        if let (Some(reading), false) = (experiment.figures_only, options.paper) {
            return Err(bad(format!(
                "{file}: plant.reading = {reading:?}: only reproduces the paper's figures, its input gain is not \
                 physical. Set plant.reading=physical, start with `host-sim new NAME --plant joint`, or give --paper"
            )));
        }
        if let Some(why) = refused_as_unstable(experiment) {
            return Err(self.refused(why));
        }
        if options.paper || options.no_limits { Ok(()) } else { refuse_without_limits(experiment, file) }
    }

    /// Returns the assembly file and its header.
    fn assembly(&self, path: &Path, prefix: &str) -> Result<Exported, Failure> {
        let header = path.with_extension("h");
        if header == *path {
            return Err(bad("--asm also writes a header: name it .S, not .h"));
        }
        let files = forms::assembly(&self.experiment, &self.source, prefix, &Effort::FULL);
        let files = files.map_err(|why| self.refused(why))?;
        Ok((vec![(path.to_path_buf(), files.assembly), (header, files.header)], Vec::new()))
    }
}

impl Console<'_> {
    pub(super) fn export(&mut self, options: &ExportOptions) -> Result<u8, Failure> {
        let form = options.form()?;
        let text = ScenarioText::read(options.scenario.as_deref(), DEFAULT)?;
        let (file, source) = (&text.file, text.source(&options.sets));
        let mut experiment = match &options.scenario {
            Some(_) => scenario::parse_own(&source, &text.stem)?,
            None => scenario::parse(&source, &text.stem)?,
        };
        // The number of the design in the head is that of what runs.
        if matches!(form, Some(Form::Archive(_))) && experiment.leave_rest_band() {
            self.note("note: drive.rest_band = \"off\" in this configuration: the static library has no rest band");
        }
        // Only the file name is exported: the same scenario gives the same bytes in every folder.
        let name = options.scenario.as_deref().and_then(Path::file_name).map(|name| name.to_string_lossy());
        let source = Source { file: name.as_deref().unwrap_or(file), ..source };
        let exporting = Exporting { experiment, source, file };
        exporting.may_be_exported(options)?;
        if options.fmu.is_some() || options.fmu_plant.is_some() {
            return self.export_fmu(&exporting, options);
        }
        let (files, open) = match (&options.output, form) {
            (Some(path), None) => exporting.assembly(path, &options.prefix)?,
            (path, form) => {
                let form = form.unwrap_or(Form::Standalone(&options.prefix));
                let text = forms::export(&exporting.experiment, &exporting.source, form);
                let text = text.map_err(|why| exporting.refused(why))?;
                let Some(path) = path else {
                    self.warn_of_export(&exporting.experiment);
                    self.say(text.trim_end())?;
                    return Ok(status::DONE);
                };
                self.with_certificate(&exporting, options, path, text)?
            }
        };
        self.warn_of_export(&exporting.experiment);
        let contents = options.contents(exporting.experiment.drive.is_some());
        for ((path, text), content) in files.iter().zip(contents) {
            write_file(path, text, options.force)?;
            self.say(&format!("wrote {}: {content}", path.display()))?;
        }
        if open.is_empty() {
            return Ok(status::DONE);
        }
        Err(failed(format!("not every statement is proved\n{}", open.join("\n"))))
    }

    /// Writes the FMU of the controller, of its plant, or both.
    fn export_fmu(&mut self, exporting: &Exporting<'_>, options: &ExportOptions) -> Result<u8, Failure> {
        let Exporting { experiment, source, .. } = exporting;
        if options.fmu.is_some() && options.fmu == options.fmu_plant {
            return Err(bad("--fmu-plant must name a file of its own, not the file of --fmu"));
        }
        let controller = options.fmu.as_ref().map(|path| (path, forms::fmu(experiment, source, &options.prefix)));
        let plant = options.fmu_plant.as_ref().map(|path| (path, forms::plant_fmu(experiment, &options.prefix)));
        let mut files = Vec::new();
        for (path, fmu) in controller.into_iter().chain(plant) {
            free(path, options.force)?;
            files.push((path, fmu.map_err(|why| exporting.refused(why))?));
        }
        self.warn_of_export(experiment);
        for (path, fmu) in files {
            let (binary, with) = match super::fmu::binary(&fmu) {
                Ok(binary) => {
                    let with = format!("C sources and {}", binary.0);
                    (Some(binary), with)
                }
                Err(why) => (None, format!("C sources only: {why}")),
            };
            let bytes = fmu.bytes(binary.as_ref().map(|(path, bytes)| (path.as_str(), bytes.as_slice())));
            write_bytes(path, &bytes, options.force)?;
            self.say(&format!("wrote {}: FMI 2.0, model {}, {with}", path.display(), fmu.identifier()))?;
        }
        Ok(status::DONE)
    }

    /// Returns the source file, and its certificate if `--certificate` is given.
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
            return Err(bad("--certificate must name a file of its own, not the file of --output"));
        }
        for file in [path, certificate] {
            free(file, options.force)?;
        }
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let refused = |why: String| exporting.refused(why);
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

/// Rejects a controller without limits of u: exported, it could drive a motor without limit.
pub(super) fn refuse_without_limits(experiment: &Experiment, file: &str) -> Result<(), Failure> {
    match forms::without_limits(experiment) {
        Some(why) => Err(bad(format!("{file}: {why}, or give --no-limits"))),
        None => Ok(()),
    }
}
