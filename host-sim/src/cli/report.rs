//! `host-sim report`: all that there is to say of a scenario, as one page for a browser, a printer and the next reader.

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
use whole_file::Kind;

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
    /// Scenarios, or reports made before, to lay side by side; without any the default.
    files: Vec<PathBuf>,
    /// Override a key of every scenario, as in --set drive.surface_rad_s=100.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// The page to write; an existing one is left as it is [default: out/SCENARIO-report.html, which is made anew].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite the file.
    #[arg(long)]
    force: bool,
    /// The preset of `map` that is drawn; `none` leaves the map out.
    #[arg(long, value_name = "PRESET", default_value = "gain", value_parser = map::presets_or(NO_MAP))]
    map: String,
    /// The folder that `monte-carlo` of one of the scenarios wrote.
    #[arg(long, value_name = "DIR")]
    trials: Option<PathBuf>,
    /// The certificate of `export --certificate`, to be attached.
    #[arg(long, value_name = "FILE")]
    certificate: Option<PathBuf>,
}

/// Names the fingerprint of a design.
const HASH: &str = "hash of the design";
/// Instead of a preset.
const NO_MAP: &str = "none";
/// What ends the name of a report.
const PAGE: &str = "html";
/// Names of several scenarios make so many characters of the name of a page at most: file systems take 255 bytes.
const STEM: usize = 60;
/// Clock of the chip that times are told for, Hz.
const CLOCK_HZ: f64 = 168e6;

/// What a page has been given so far.
#[derive(Default)]
struct Gathered {
    accounts: Vec<Account>,
    /// Of each scenario file: the place of its account, and what stands in it.
    files: Vec<(usize, ScenarioText)>,
}

impl Gathered {
    /// Puts the trials beside the scenario that they are of.
    fn add_trials(&mut self, trials: Written, asked: &[String]) -> Result<(), Failure> {
        let Written { scenario, sha256, sets, section } = trials;
        let is_named = |account: &Account| account.name == scenario;
        if !self.accounts.iter().any(is_named) {
            return Err(bad(format!("--trials: its scenario is {scenario:?}, and that is not here")));
        }
        let mut of_name = self.files.iter().filter(|(of, _)| is_named(&self.accounts[*of])).peekable();
        if of_name.peek().is_none() {
            return Err(bad(format!("--trials: {scenario} is of a page: give its scenario file")));
        }
        let Some((of, text)) = of_name.find(|(_, file)| hex_sha256(file.subject(&[]).text) == sha256) else {
            return Err(bad(format!(
                "--trials: the file of {scenario} was another when its trials ran (scenario_sha256): run \
                 `host-sim monte-carlo` again"
            )));
        };
        // What `--uncertain` sets beside what it draws is what the controller believes, as the file has it.
        let mut of_trials = sets.iter().filter(|set| !set.starts_with("controller.nominal"));
        let without = asked.iter().find(|set| !sets.contains(set)).map(|set| ("without", set));
        let differs = without.or_else(|| Some(("with", of_trials.find(|set| !asked.contains(set))?)));
        if let Some((how, set)) = differs {
            return Err(bad(format!("--trials: its trials ran {how} --set {set}: the page would be of two plants")));
        }
        let design = |sets: &[String]| -> Result<_, Failure> { Ok(text.subject(sets).with(&[])?.port.fingerprint()) };
        if design(&sets)? != design(asked)? {
            let set = sets.iter().find(|set| set.starts_with("controller.nominal")).map_or("", String::as_str);
            return Err(bad(format!(
                "--trials: its trials ran with --set {set}: the page would be of two designs. Give this --set here too"
            )));
        }
        self.accounts[*of].sections.push(section);
        Ok(())
    }
}

/// The account of the design that a certificate is of.
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

/// The certificate of an export, attached.
fn proofs(name: String, text: String) -> Section {
    Section {
        heading: "Proofs".into(),
        says: vec!["What holds for every input, state and order of lost samples, and who showed it.".into()],
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
            Some(file) => Some((file.display().to_string(), read_text(file, Kind::SETTINGS)?)),
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
        let title = names.join(" beside ");
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
        let instead = if is_anew { ", instead of the one there was; --output keeps it" } else { "" };
        self.say(&format!("written to {}{instead}", output.display()))?;
        Ok(status::DONE)
    }

    /// The account of each file, in their order; none if told to stop.
    fn gather(&mut self, options: &ReportOptions) -> Result<Option<Gathered>, Failure> {
        let files: Vec<Option<&Path>> = if options.files.is_empty() {
            vec![None]
        } else {
            options.files.iter().map(|file| Some(&**file)).collect()
        };
        if !options.sets.is_empty() && files.iter().all(|file| file.is_some_and(is_page)) {
            return Err(bad("--set is for scenarios: a report that was made says what it says"));
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

    /// All that is told of one scenario; none if it was told to stop.
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
            says: vec![ending(&trace, &metrics).1],
            tables: vec![table],
            figures: figures_of(experiment, &trace).into_iter().map(|(_, figure)| figure).collect(),
            ..Section::default()
        };
        Ok(Some((section, trace)))
    }

    /// Where it is stable, and in which corners.
    fn of_map(&mut self, file: Option<&Path>, options: &ReportOptions) -> Option<Section> {
        let asked = |preset: &str| MapOptions::of_preset(file, preset, &options.sets);
        let corners = self.with_view(&asked(CORNERS), |console, view| {
            let found = console.judged_corners(view)?;
            Ok(found.map(|found| {
                let worst = found.points.iter().flatten().next().map_or_else(String::new, |point| {
                    let name = point.worst.as_deref().unwrap_or_default();
                    format!("; the worst, {name}, has spectral radius {:.5}", point.spectral_radius)
                });
                view.count(&found) + &worst
            }))
        });
        let mut says = match corners {
            Ok(Some(line)) => vec![line],
            Ok(None) => return None,
            // A law that switches has no matrices: that is told, and no reason for no report.
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
        Some(Section { heading: "Where it is stable".into(), says, drawings, ..Section::default() })
    }
}

/// Is it a report, by its name?
fn is_page(file: &Path) -> bool {
    file.extension().is_some_and(|end| [PAGE, "htm"].iter().any(|page| end.eq_ignore_ascii_case(page)))
}

/// Told before minutes of work: not over what is read, nor without being told over what is there.
fn may_be_named(output: &Path, options: &ReportOptions) -> Result<(), Failure> {
    not_read(output, options)?;
    free(output, options.force)
}

/// Where the program keeps the page of these scenarios: not over what is read, nor over anything but an earlier page of
/// the same. Is there one?
fn may_be_made_anew(output: &Path, names: &[&str], options: &ReportOptions) -> Result<bool, Failure> {
    not_read(output, options)?;
    if !output.is_file() {
        return Ok(false);
    }
    let before = whole_file::read_text(output, Kind::REPORT).ok().and_then(|text| page::accounts(&text));
    let is_of_them = before.is_some_and(|before| before.iter().map(|account| &*account.name).eq(names.iter().copied()));
    if is_of_them || options.force {
        return Ok(true);
    }
    Err(bad(format!(
        "{} is no report of {} and is left as it is: give another --output, or --force to overwrite it",
        output.display(),
        names.join(" beside ")
    )))
}

fn not_read(output: &Path, options: &ReportOptions) -> Result<(), Failure> {
    let Ok(place) = output.canonicalize() else { return Ok(()) };
    let read = options.files.iter().chain(&options.certificate);
    match read.into_iter().find(|file| file.canonicalize().is_ok_and(|file| file == place)) {
        Some(file) => Err(bad(format!("{} is read: give the page another place with --output", file.display()))),
        None => Ok(()),
    }
}

/// With the file that it is about, if it does not begin with that.
fn of_file(file: &str, message: String) -> String {
    if message.starts_with(file) { message } else { format!("{file}: {message}") }
}

/// The accounts of a report that was made before.
fn read_back(file: &Path) -> Result<Vec<Account>, Failure> {
    let text = read_text(file, Kind::REPORT)?;
    page::accounts(&text).filter(|accounts| !accounts.is_empty()).ok_or_else(|| {
        bad(format!("{}: no report that this program made: it has no accounts to read back", file.display()))
    })
}

/// No two accounts have one name.
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

/// What it is, and by which numbers it is known again.
fn about(experiment: &Experiment, subject: &Subject<'_>) -> Section {
    let Subject { file, text, sets, .. } = *subject;
    let mut table = Table::new(["of the scenario", "value"]);
    table.row(["file", file]);
    table.row(["sha256 of the file, its first half", &hex_sha256(text)[..32]]);
    if !sets.is_empty() {
        table.row(["set besides", &sets.join(", ")]);
    }
    if let Some(hash) = experiment.port.fingerprint() {
        table.row([HASH, &format!("{hash:08x}")]);
    }
    table.row(["period (s)", &significant(experiment.period_s, 6)]);
    table.row(["span (s)", &significant(experiment.span_s, 6)]);
    table.row(["made by", concat!("host-sim ", env!("CARGO_PKG_VERSION"))]);
    table.row(["its commit", env!("HOST_SIM_COMMIT")]);
    table.row(["its compiler", env!("HOST_SIM_COMPILER")]);
    table.row(["the plant is moved", &moved(experiment)]);
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

/// By what the plant goes from tick to tick, and how exactly: what the tests of `loop_sim::exact` and `solver` show.
fn moved(experiment: &Experiment) -> String {
    let plant = &experiment.plant;
    if plant.exact().is_some() {
        "in one exact step a tick, within 1e-9 of the solver of order 10 (of the largest of each state); by that \
         solver where a disturbance jumps or a link turns fast"
            .into()
    } else if plant.is_checked() {
        "by the solver, of order 6 to 10, each step as short as an order less by 2 agrees with it within 1e-9 of how \
         far a state is from 0 or moves, or 1/1024 of what was tried"
            .into()
    } else {
        "by the solver, of order 4 to 10 as the step asks for, whose error is 4e-11 of a state at most in the time \
         that its fastest mode takes for 1 rad"
            .into()
    }
}

/// Its loop at rest.
fn of_design(design: &Design, experiment: &Experiment) -> Section {
    Section {
        heading: "Design".into(),
        says: design::remarks(design, experiment),
        tables: vec![design::table(design, experiment)],
        figures: vec![poles(design)],
        ..Section::default()
    }
}

/// Poles asked for and got, as far as they are slow enough to be seen.
fn poles(design: &Design) -> Figure {
    let asked: Vec<_> = design.asked_poles().collect();
    let fastest = asked.iter().map(|pole| pole.re.abs()).fold(0.0, f64::max);
    let dots = |label: &str, color: usize, poles: &mut dyn Iterator<Item = margins::Root>| {
        // A gap behind each: they are no curve.
        let points = poles.filter(|pole| pole.re.abs() <= 3.0 * fastest && pole.im.abs() <= 3.0 * fastest);
        let points = points.flat_map(|pole| [(pole.re, pole.im), (f64::NAN, f64::NAN)]);
        Series { has_dots: true, ..Series::solid(label, color, points) }
    };
    Figure {
        title: "Poles".into(),
        panels: vec![Panel {
            x_label: "real part (rad/s)".into(),
            y_label: "imaginary part (rad/s)".into(),
            series: vec![
                dots("of the closed loop", 0, &mut design.poles()),
                dots("asked for", 1, &mut asked.iter().copied()),
            ],
            ..Panel::default()
        }],
        columns: 1,
    }
}

/// What the tick costs.
fn on_chip(experiment: &Experiment) -> Section {
    let mut says = Vec::new();
    let mut tables = Vec::new();
    if let Some(&Cost { ref instance, typical, bound, flash, state, coefficients }) = chip::cost_of(experiment) {
        says.push(format!("the tick that is shipped as {instance:?} in firmware/budgets.toml, on a Cortex-M4F"));
        let mut table = Table::new(["of the tick", "value", "unit", "meaning"]);
        let microseconds =
            |cycles: u32| format!("{} us at 168 MHz", significant(1e6 * f64::from(cycles) / CLOCK_HZ, 3));
        let mut row = |name: &str, value: u32, unit: &str, meaning: &str| {
            table.row([name, &value.to_string(), unit, meaning]);
        };
        row("an ordinary tick", typical, "cycles", &microseconds(typical));
        row("any tick, bound", bound, "cycles", &microseconds(bound));
        let share = 1e2 * f64::from(bound) / (CLOCK_HZ * experiment.period_s);
        row("code", flash, "bytes", "flash");
        row("state", state, "bytes", "memory that changes");
        row("design", coefficients, "bytes", "flash or memory");
        says.push(format!("the bound is {} % of the period", significant(share, 2)));
        tables.push(table);
    } else if let Some(drive) = &experiment.drive {
        says.push(format!(
            "this form of a drive is not measured; its parts add up to a bound of {} cycles a tick on a Cortex-M4F",
            chip::cycles(&drive.designed)
        ));
    } else {
        says.push(
            "no tick of this shape is measured; `host-sim budget --elf YOURS --symbol TICK` bounds your own".into(),
        );
    }
    Section { heading: "On the chip".into(), says, tables, ..Section::default() }
}
