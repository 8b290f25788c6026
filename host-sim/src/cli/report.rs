//! `host-sim report`: writes an HTML report of one or more scenarios: design, run, bounds, map and cycle cost.
//!
//! The page needs no network. It contains its data, so that a later report can read it back for a comparison.

use std::path::{Path, PathBuf};

use clap::Args;
use loop_sim::trace::{Ending, Trace};
use scenario::Experiment;
use study::chip::{self, Cost};
use study::design::Design;
use study::figures::Figures;
use study::map::{CORNERS, Subject};
use study::margins;
use study::number::significant;
use terminal::table::Table;
use whole_file::FileKind;

use super::design;
use super::map::{self, MapOptions};
use super::monte_carlo::Written;
use super::run::{ending, figures_of, note_changes, table};
use super::{
    Console, DEFAULT, Failure, ScenarioText, bad, bounds, failed, free, hex_sha256, monte_carlo, read_text, status,
    write_file,
};
use crate::report::page::{self, Account, Page, Section};
use crate::report::plot::{Figure, Panel, Series};
use crate::report::write_whole;

#[derive(Args, Debug)]
pub(super) struct ReportOptions {
    /// Scenarios or earlier reports, shown side by side [default: built-in joint of the paper].
    files: Vec<PathBuf>,
    /// Override a key of every scenario; repeatable. Example: --set drive.period_s=5e-4 for a motor or joint, --set
    /// controller.k_l=20 for other plants.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Output file; an existing file is kept unless --force is given [default: out/SCENARIO-report.html, which is
    /// replaced].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite the output file.
    #[arg(long)]
    force: bool,
    /// Preset of the map; none leaves the map out.
    #[arg(long, value_name = "PRESET", default_value = "gain", value_parser = map::presets_or(NO_MAP))]
    map: String,
    /// Output folder of host-sim monte-carlo for one of the scenarios.
    #[arg(long, value_name = "DIR")]
    trials: Option<PathBuf>,
    /// Proof certificate of host-sim export --certificate to attach.
    #[arg(long, value_name = "FILE")]
    certificate: Option<PathBuf>,
}

/// Label of the fingerprint of a design.
const HASH: &str = "hash of the design";
/// Value of `--map` for a report without a map.
const NO_MAP: &str = "none";
/// File extension of a report.
const PAGE: &str = "html";
/// Largest length of a file stem made of several scenario names, characters: file systems allow 255 bytes.
const STEM: usize = 60;
/// Clock of the STM32F405, for times in the report, Hz.
const CLOCK_HZ: f64 = 168e6;

/// Input of a page.
#[derive(Default)]
struct Gathered {
    accounts: Vec<Account>,
    /// For each scenario file: the index of its account, and its text.
    files: Vec<(usize, ScenarioText)>,
}

impl Gathered {
    /// Adds a Monte Carlo section to the account of its scenario.
    ///
    /// # Errors
    /// If the scenario is not in the report, or if file, settings or design differ from the trials.
    fn add_trials(&mut self, trials: Written, asked: &[String]) -> Result<(), Failure> {
        let Written { scenario, sha256, sets, section } = trials;
        let is_named = |account: &Account| account.name == scenario;
        if !self.accounts.iter().any(is_named) {
            return Err(bad(format!("--trials: its scenario {scenario:?} is not in this report: add the file")));
        }
        let mut of_name = self.files.iter().filter(|(of, _)| is_named(&self.accounts[*of])).peekable();
        if of_name.peek().is_none() {
            return Err(bad(format!("--trials: {scenario} comes from an earlier report: give its scenario file")));
        }
        let Some((of, text)) = of_name.find(|(_, file)| hex_sha256(file.subject(&[]).text) == sha256) else {
            return Err(bad(format!(
                "--trials: the file of {scenario} changed after its trials (scenario_sha256): run `host-sim \
                 monte-carlo` again"
            )));
        };
        // `--uncertain` also sets controller.nominal to the nominal values of the file; this is not a difference.
        let mut of_trials = sets.iter().filter(|set| !set.starts_with("controller.nominal"));
        let without = asked.iter().find(|set| !sets.contains(set)).map(|set| ("without", set));
        let differs = without.or_else(|| Some(("with", of_trials.find(|set| !asked.contains(set))?)));
        if let Some((how, set)) = differs {
            return Err(bad(format!("--trials: the trials ran {how} --set {set}: give the report equal settings")));
        }
        let design = |sets: &[String]| -> Result<_, Failure> { Ok(text.subject(sets).with(&[])?.port.fingerprint()) };
        if design(&sets)? != design(asked)? {
            let set = sets.iter().find(|set| set.starts_with("controller.nominal")).map_or("", String::as_str);
            return Err(bad(format!(
                "--trials: the trials ran with --set {set}, another design than in this report: give this --set too"
            )));
        }
        self.accounts[*of].sections.push(section);
        Ok(())
    }
}

/// Returns the account whose design hash the certificate contains.
fn certified<'a>(accounts: &'a mut [Account], name: &str, text: &str) -> Result<&'a mut Account, Failure> {
    let Some(design) = text.lines().find_map(|line| line.strip_prefix("Design: ")) else {
        return Err(bad(format!(
            "--certificate: {name} has no line `Design: ..`: give the file that `host-sim export --certificate` wrote"
        )));
    };
    let mut found = Vec::new();
    let mut of = None;
    for account in accounts {
        let rows = account.sections.iter().flat_map(|section| &section.tables).flat_map(Table::rows);
        let mut hashes = rows.filter(|row| row[0] == HASH).map(|row| row[1].clone()).peekable();
        let is_of = hashes.peek().is_some_and(|hash| hash == design);
        found.extend(hashes.map(|hash| format!("{} of {}", hash, account.name)));
        if is_of && of.is_none() {
            of = Some(account);
        }
    }
    of.ok_or_else(|| {
        bad(format!(
            "--certificate: {name} is of design {design}, expected {}: run `host-sim export --standalone \
             --certificate` of this scenario, with the same --set",
            found.join(" or ")
        ))
    })
}

/// Returns the section with the attached certificate.
fn proofs(name: String, text: String) -> Section {
    Section {
        heading: "Proofs".into(),
        says: vec!["Statements for every input, state and order of lost samples, with verdict and solver.".into()],
        files: vec![(name, text)],
        ..Section::default()
    }
}

impl Console<'_> {
    pub(super) fn report(&mut self, options: &ReportOptions) -> Result<u8, Failure> {
        if let Some(output) = &options.output {
            may_be_named(output, options)?;
        }
        let certificate = match &options.certificate {
            Some(file) => Some((file.display().to_string(), read_text(file, FileKind::SETTINGS)?)),
            None => None,
        };
        let trials = options.trials.as_deref().map(monte_carlo::section).transpose()?;
        let Some(mut gathered) = self.gather(options)? else { return Ok(status::INTERRUPTED) };
        if let Some(trials) = trials {
            gathered.add_trials(trials, &options.sets)?;
        }
        let Gathered { mut accounts, .. } = gathered;
        if let Some((name, text)) = certificate {
            certified(&mut accounts, &name, &text)?.sections.push(proofs(name, text));
        }
        told_apart(&mut accounts);
        let names: Vec<&str> = accounts.iter().map(|account| account.name.as_str()).collect();
        let title = names.join(" and ");
        let page = Page { title: &title, accounts: &accounts };
        let html = page.html().map_err(|error| Failure::writing("the page", &error.into()))?;
        let (output, is_anew) = if let Some(output) = &options.output {
            write_file(output, &html, options.force)?;
            (output.clone(), false)
        } else {
            let stem = if names.len() > 1 { names.join("-").chars().take(STEM).collect() } else { names.concat() };
            let output = Path::new("out").join(format!("{stem}-report.{PAGE}"));
            let is_anew = may_be_made_anew(&output, &names, options)?;
            write_whole(&output, |out| out.write_all(html.as_bytes()))
                .map_err(|error| Failure::writing(output.display(), &error))?;
            (output, is_anew)
        };
        let instead = if is_anew { " (replaced; give --output to keep several)" } else { "" };
        self.say(&format!("wrote {}{instead}", output.display()))?;
        Ok(status::DONE)
    }

    /// Returns the account of each file in order; `None` if interrupted.
    fn gather(&mut self, options: &ReportOptions) -> Result<Option<Gathered>, Failure> {
        let files: Vec<Option<&Path>> = if options.files.is_empty() {
            vec![None]
        } else {
            options.files.iter().map(|file| Some(&**file)).collect()
        };
        if !options.sets.is_empty() && files.iter().all(|file| file.is_some_and(is_page)) {
            return Err(bad("--set applies to scenarios only: an earlier report cannot change"));
        }
        let mut gathered = Gathered::default();
        for file in files {
            if let Some(page) = file.filter(|file| is_page(file)) {
                gathered.accounts.extend(read_back(page)?);
                continue;
            }
            let text = ScenarioText::read(file, DEFAULT)?;
            let named = |Failure { status, message }| Failure { status, message: of_file(&text.file, message) };
            let Some(account) = self.account(file, &text, options).map_err(named)? else { return Ok(None) };
            gathered.files.push((gathered.accounts.len(), text));
            gathered.accounts.push(account);
        }
        Ok(Some(gathered))
    }

    /// Returns the account of one scenario; `None` if interrupted.
    fn account(
        &mut self,
        file: Option<&Path>,
        text: &ScenarioText,
        options: &ReportOptions,
    ) -> Result<Option<Account>, Failure> {
        let subject = text.subject(&options.sets);
        let mut experiment = subject.with(&[])?;
        note_changes(&mut experiment.title, &options.sets);
        experiment.warnings.extend(margins::warnings(&experiment));
        let mut sections = vec![about(&experiment, &subject)];
        let design = study::design(&experiment).ok();
        sections.extend(design.iter().map(|design| of_design(design, &experiment)));
        let Some((section, trace)) = self.of_run(&mut experiment, design.as_ref())? else { return Ok(None) };
        sections.push(section);
        sections.push(bounds::section(&experiment, &trace, &subject));
        if options.map != NO_MAP {
            match self.of_map(file, options) {
                Some(section) => sections.push(section),
                None => return Ok(None),
            }
        }
        sections.push(on_chip(&experiment));
        Ok(Some(Account { name: experiment.name, sections }))
    }

    fn of_run(
        &mut self,
        experiment: &mut Experiment,
        design: Option<&Design>,
    ) -> Result<Option<(Section, Trace)>, Failure> {
        let (trace, error) = self.watched(experiment, &mut None);
        if let Some(error) = error {
            return Err(failed(error.to_string()));
        }
        if let Ending::Interrupted { .. } = trace.ending {
            return Ok(None);
        }
        let metrics = experiment.metrics(&trace);
        let figures = Figures::of(experiment, &trace, &metrics);
        let table = table(experiment, &metrics, &figures, design, &trace);
        let section = Section {
            heading: "Run".into(),
            says: vec![ending(&trace, &metrics)],
            tables: vec![table],
            figures: figures_of(experiment, &trace).into_iter().map(|(_, figure)| figure).collect(),
            ..Section::default()
        };
        Ok(Some((section, trace)))
    }

    /// Returns the section on stability: corners and map; `None` if interrupted.
    fn of_map(&mut self, file: Option<&Path>, options: &ReportOptions) -> Option<Section> {
        let asked = |preset: &str| MapOptions::of_preset(file, preset, &options.sets);
        let corners = self.with_view(&asked(CORNERS), |console, view| {
            let found = console.judged_corners(view)?;
            Ok(found.map(|found| {
                let worst = found.points.iter().flatten().next().map_or_else(String::new, |point| {
                    let name = point.worst.as_deref().unwrap_or_default();
                    match point.sensitivity_peak {
                        Some(peak) => format!("; worst: {name}, peak |S| {}", significant(peak, 3)),
                        None => format!("; worst: {name}, spectral radius {:.5}", point.spectral_radius),
                    }
                });
                view.count(&found) + &worst
            }))
        });
        let mut says = match corners {
            Ok(Some(line)) => vec![line],
            Ok(None) => return None,
            // A law that switches has no matrices. The report is written anyway, with the reason.
            Err(Failure { message, .. }) => vec![format!("no corners: {message}")],
        };
        let mut drawings = Vec::new();
        let told = self.with_view(&asked(&options.map), |console, view| {
            Ok(console.answered(view)?.map(|map| (map::lines(&map), view.drawn(&map).svg())))
        });
        match told {
            Ok(Some((lines, drawing))) => {
                says.extend(lines);
                drawings.push(drawing);
            }
            Ok(None) => return None,
            Err(Failure { message, .. }) => says.push(format!("no map: {message}")),
        }
        Some(Section { heading: "Stability map".into(), says, drawings, ..Section::default() })
    }
}

/// Returns whether a file is a report, by its extension.
fn is_page(file: &Path) -> bool {
    file.extension().is_some_and(|end| [PAGE, "htm"].iter().any(|page| end.eq_ignore_ascii_case(page)))
}

/// Checks `--output` before minutes of work: it must not be an input, and must not exist without `--force`.
fn may_be_named(output: &Path, options: &ReportOptions) -> Result<(), Failure> {
    not_read(output, options)?;
    free(output, options.force)
}

/// Checks the default output path and returns whether an earlier report is replaced.
///
/// # Errors
/// If the path is an input, or contains anything but an earlier report of these scenarios (without `--force`).
fn may_be_made_anew(output: &Path, names: &[&str], options: &ReportOptions) -> Result<bool, Failure> {
    not_read(output, options)?;
    if !output.is_file() {
        return Ok(false);
    }
    let before = whole_file::read_text(output, FileKind::REPORT).ok().and_then(|text| page::accounts(&text));
    let is_of_them = before.is_some_and(|before| before.iter().map(|account| &*account.name).eq(names.iter().copied()));
    if is_of_them || options.force {
        return Ok(true);
    }
    Err(bad(format!(
        "{} is not a report of {} and was not changed: give another --output, or --force to overwrite it",
        output.display(),
        names.join(" and ")
    )))
}

fn not_read(output: &Path, options: &ReportOptions) -> Result<(), Failure> {
    let Ok(place) = output.canonicalize() else { return Ok(()) };
    let read = options.files.iter().chain(&options.certificate);
    match read.into_iter().find(|file| file.canonicalize().is_ok_and(|file| file == place)) {
        Some(file) => Err(bad(format!("{} is an input: give another file with --output", file.display()))),
        None => Ok(()),
    }
}

/// Prefixes a message with its file, unless it begins with the file.
fn of_file(file: &str, message: String) -> String {
    if message.starts_with(file) { message } else { format!("{file}: {message}") }
}

/// Reads the accounts of an earlier report.
fn read_back(file: &Path) -> Result<Vec<Account>, Failure> {
    let text = read_text(file, FileKind::REPORT)?;
    page::accounts(&text)
        .filter(|accounts| !accounts.is_empty())
        .ok_or_else(|| bad(format!("{}: not a report of host-sim: it contains no accounts", file.display())))
}

/// Makes the names of the accounts unique.
fn told_apart(accounts: &mut [Account]) {
    for k in 1..accounts.len() {
        let (before, rest) = accounts.split_at_mut(k);
        let name = &mut rest[0].name;
        let is_taken = |name: &str| before.iter().any(|account| account.name == name);
        if is_taken(name) {
            let others = (2..=k + 1).map(|n| format!("{name} ({n})"));
            *name = others.into_iter().find(|other| !is_taken(other)).unwrap_or_default();
        }
    }
}

/// Returns the section `Scenario`: file, hashes, versions, warnings.
fn about(experiment: &Experiment, subject: &Subject<'_>) -> Section {
    let Subject { file, text, sets, .. } = *subject;
    let mut table = Table::new(["property", "value"]);
    table.row(["file", file]);
    table.row(["SHA-256 of the file, first half", &hex_sha256(text)[..32]]);
    if !sets.is_empty() {
        table.row(["overrides (--set)", &sets.join(", ")]);
    }
    if let Some(hash) = experiment.port.fingerprint() {
        table.row([HASH, &format!("{hash:08x}")]);
    }
    table.row(["period (s)", &significant(experiment.period_s, 6)]);
    table.row(["span (s)", &significant(experiment.span_s, 6)]);
    table.row(["program", concat!("host-sim ", env!("CARGO_PKG_VERSION"))]);
    table.row(["commit", env!("HOST_SIM_COMMIT")]);
    table.row(["compiler", env!("HOST_SIM_COMPILER")]);
    table.row(["integration of the plant", &moved(experiment)]);
    let warnings = experiment.warnings.iter().map(|warning| format!("warning: {warning}"));
    let chosen = experiment.drive.iter().flat_map(|drive| drive.chosen.clone());
    Section {
        heading: "Scenario".into(),
        says: [experiment.headline()].into_iter().chain(chosen).chain(warnings).collect(),
        tables: vec![table],
        files: vec![(file.into(), text.into())],
        ..Section::default()
    }
}

/// Returns the integration method of the plant and its accuracy, as tested in `loop_sim::exact` and `solver`.
fn moved(experiment: &Experiment) -> String {
    let plant = &experiment.plant;
    if plant.exact().is_some() {
        "one exact step per tick, within 1e-9 of the solver of order 10 (relative to the largest value of each \
         state); that solver where a disturbance jumps or a link turns fast"
            .into()
    } else if plant.is_checked() {
        "solver of order 6 to 10; a step is shortened until a solution of order 2 less agrees within 1e-9 of the \
         distance of a state from 0 or of its change, at most to 1/1024"
            .into()
    } else {
        "solver of order 4 to 10, chosen by the step; error at most 4e-11 of a state per rad of its fastest mode".into()
    }
}

/// Returns the section `Design` on the linearised loop at rest.
fn of_design(design: &Design, experiment: &Experiment) -> Section {
    Section {
        heading: "Design".into(),
        says: design::remarks(design, experiment),
        tables: vec![design::table(design, experiment)],
        figures: vec![poles(design)],
        ..Section::default()
    }
}

/// Returns the figure of the design poles and the closed-loop poles; poles far beyond the design poles are left out.
fn poles(design: &Design) -> Figure {
    let asked: Vec<_> = design.asked_poles().collect();
    let fastest = asked.iter().map(|pole| pole.re.abs()).fold(0.0, f64::max);
    let dots = |label: &str, color: usize, poles: &mut dyn Iterator<Item = margins::Root>| {
        // A gap after each point keeps the dots unconnected.
        let points = poles.filter(|pole| pole.re.abs() <= 3.0 * fastest && pole.im.abs() <= 3.0 * fastest);
        let points = points.flat_map(|pole| [(pole.re, pole.im), (f64::NAN, f64::NAN)]);
        Series { has_dots: true, ..Series::solid(label, color, points) }
    };
    Figure {
        title: "Poles".into(),
        panels: vec![Panel {
            x_label: "real part (rad/s)".into(),
            y_label: "imaginary part (rad/s)".into(),
            series: vec![dots("closed loop", 0, &mut design.poles()), dots("design", 1, &mut asked.iter().copied())],
            ..Panel::default()
        }],
        columns: 1,
    }
}

/// Returns the section on cycles and memory of a tick on the target.
fn on_chip(experiment: &Experiment) -> Section {
    let mut says = Vec::new();
    let mut tables = Vec::new();
    if let Some(&Cost { ref instance, typical, bound, flash, state, coefficients }) = chip::cost_of(experiment) {
        says.push(format!("cost of a tick on a Cortex-M4F, measured for {instance:?} of firmware/budgets.toml"));
        let mut table = Table::new(["quantity", "value", "unit", "meaning"]);
        let microseconds =
            |cycles: u32| format!("{} us at 168 MHz", significant(1e6 * f64::from(cycles) / CLOCK_HZ, 3));
        let mut row = |name: &str, value: u32, unit: &str, meaning: &str| {
            table.row([name, &value.to_string(), unit, meaning]);
        };
        row("typical tick", typical, "cycles", &microseconds(typical));
        row("WCET bound", bound, "cycles", &microseconds(bound));
        let share = 1e2 * f64::from(bound) / (CLOCK_HZ * experiment.period_s);
        row("code", flash, "bytes", "flash");
        row("state", state, "bytes", "RAM");
        row("design", coefficients, "bytes", "flash or RAM");
        says.push(format!("the WCET bound is {} % of the period", significant(share, 2)));
        tables.push(table);
    } else if let Some(drive) = &experiment.drive {
        says.push(format!(
            "this drive configuration is not measured; the sum of its parts is a WCET bound of {} cycles (Cortex-M4F)",
            chip::cycles(&drive.designed)
        ));
    } else {
        says.push(
            "this controller configuration is not measured; host-sim budget --elf FILE --symbol TICK bounds your tick"
                .into(),
        );
    }
    Section { heading: "Cost on the target".into(), says, tables, ..Section::default() }
}
