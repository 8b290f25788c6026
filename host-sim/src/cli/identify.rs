//! `host-sim identify` identifies a motor or joint from a recording. `host-sim commission` records, identifies,
//! switches the gains and verifies them.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::{Args, ValueEnum};
use loop_sim::port::drive::{DriveDesign, Follows};
use loop_sim::sensor::encoder::Mounted;
use loop_sim::signal::Signal;
use scenario::{Experiment, Source};
use serde::Serialize;
use study::Watch;
use study::commission::plants::{PlantResult, Plants, try_all};
use study::commission::{
    BAR_STEPS, LEAST_BAR_RAD, Outcome, Plan, Report, Retuned, Rig, Stopped, Swap, TIMES_EXPECTED, Verified, commission,
    is_of_drive, sheet_of,
};
use study::identify::{Identified, PlantData, Record, identify, record};
use study::number::significant;
use terminal::stop;
use terminal::table::Table;
use whole_file::FileKind;

use super::live::{Reach, way};
use super::{
    Console, Failure, JOINT, LEFT, ScenarioText, bad, claim_folder, failed, folder_of, free_to, read_text, status,
    write_new,
};
use crate::feature::Feature;
use crate::report::FIGURE;
use crate::report::plot::{Figure, GREY, Panel, Series, Style};
use link::live::LiveDrive;
use link::transport::{Emulator, Transport};
use link::wired::Wired;

/// Options of both commands.
#[derive(Args, Debug)]
struct Common {
    /// Override a key of the scenario; repeatable. Example: --set joint.stiffness_n_m=12 for a joint, --set
    /// motor.inertia_kg_m2=3e-4 for a motor.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Periods of the motor's cogging per revolution, if known: halves the errors of k_2, b_2 and B_0.
    #[arg(long, value_name = "N")]
    cogging: Option<f64>,
    /// Largest accepted change of a data sheet parameter, percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 60.0)]
    tolerance: f64,
    /// Encoder noise in addition to quantisation, counts rms.
    #[arg(long, value_name = "COUNTS", default_value_t = 0.0)]
    noise_steps: f64,
    /// Joint only: identify without the link encoder. The recording must excite the link at its own frequency, as
    /// commission --motor-alone does.
    #[arg(long)]
    motor_alone: bool,
    /// Output file of the identified scenario; an existing file is never overwritten [default:
    /// SCENARIO-identified.toml].
    #[arg(long, short = 'o', value_name = "FILE")]
    to: Option<PathBuf>,
    /// Output folder of the figures [default: out/SCENARIO-identify or -commission].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON instead of the tables.
    #[arg(long)]
    json: bool,
}

#[derive(Args, Debug)]
pub(super) struct IdentifyOptions {
    /// Recording as CSV, a row per period: tick or t_s, count_link (joint only), count_motor, u_held_a.
    data: PathBuf,
    /// Scenario with data sheet, encoders and period [default: template of new --plant joint].
    file: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

#[derive(Args, Debug)]
pub(super) struct CommissionOptions {
    /// Scenario with [joint] or [motor] [default: template of new --plant joint].
    file: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Travel of the recorded moves, rad [default: 0.6 for a joint, 3 for a motor].
    #[arg(long, value_name = "RAD")]
    way: Option<f64>,
    /// Peak of the multisine, A; at least five times the friction [default: 27 % of max_current_a for a joint, 100 %
    /// for a motor; 50 % for a joint with the coupled design, then 80 % if the excitation is too weak].
    #[arg(long, value_name = "A")]
    peak: Option<f64>,
    /// Seed of the phases of the multisine and of --random plants.
    #[arg(long, value_name = "S", default_value_t = 1, help_heading = "Experiments")]
    seed: u64,
    /// Travel of the test move, rad. The limit of |y - r| is the larger of 1e-4 rad and twice the simulated error, plus
    /// 2.5 counts of the encoder (link encoder for a joint). The simulation uses the identified parameters. The limit
    /// is at most one count above the largest error of the recorded moves.
    #[arg(long, value_name = "RAD", default_value_t = 1.0)]
    verify: f64,
    /// Firmware `drive` or `motor` to commission on the emulated target instead of a simulation (feature chip).
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    image: Option<PathBuf>,
    #[command(flatten)]
    reach: Reach,
    /// Gain switching method. in-motion and none are for comparison with at-rest.
    #[arg(long, value_enum, value_name = "METHOD", default_value = "at-rest", help_heading = "Experiments")]
    swap: SwapWord,
    /// Commission all corners (32 for a joint, 8 for a motor) and random plants within ±PERCENT of the data sheet. Each
    /// has friction, cogging, a load and a disturbance current that are not in the controller's model.
    #[arg(long, value_name = "PERCENT", conflicts_with_all = ["image", "port"], help_heading = "Experiments")]
    within: Option<f64>,
    /// Number of random plants of --within.
    #[arg(long, value_name = "N", default_value_t = 30, requires = "within", help_heading = "Experiments",
          value_parser = clap::value_parser!(u32).range(0..=100_000))]
    random: u32,
    /// Falsify the identified k_1 and b_1 (motor: b and f_c) by these factors, to test the verification of --within.
    #[arg(long, value_name = "F,F", value_parser = factors, requires = "within", help_heading = "Experiments")]
    wrong: Option<[f64; 2]>,
}

/// Word for a gain switching method, see [`Swap`].
#[derive(Clone, Copy, Debug, ValueEnum)]
enum SwapWord {
    /// At rest without an offset W; u has a small step.
    AtRest,
    /// Bumpless, as in motion: u has no step.
    InMotion,
    /// No switch: the test move runs with the old gains.
    None,
}

impl From<SwapWord> for Swap {
    fn from(word: SwapWord) -> Self {
        match word {
            SwapWord::AtRest => Self::AtRest,
            SwapWord::InMotion => Self::InMotion,
            SwapWord::None => Self::None,
        }
    }
}

impl CommissionOptions {
    /// Returns the option that needs a cargo feature, and the feature.
    pub(super) const fn needs(&self) -> Option<(&'static str, Feature)> {
        match (&self.image, self.reach.is_port()) {
            (_, true) => Some(("commission --port", Feature::Chip)),
            (Some(_), _) => Some(("commission --image", Feature::Chip)),
            _ => None,
        }
    }

    /// Checks options that clap cannot check: positive numbers, and `--faults` without a target.
    fn check(&self) -> Result<(), Failure> {
        for (option, value) in [("way", self.way), ("peak", self.peak), ("verify", Some(self.verify))] {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(bad(format!("--{option} {value}: expected a number above 0")));
            }
        }
        if self.reach.has_faults() && !self.is_wired() {
            return Err(bad("--faults needs a target: give --image or --port"));
        }
        Ok(())
    }

    const fn is_wired(&self) -> bool {
        self.image.is_some() || self.reach.is_port()
    }

    fn plan(&self, designed: &DriveDesign) -> Plan {
        let by_rule = Plan::of(designed);
        Plan {
            way_rad: self.way.unwrap_or(by_rule.way_rad),
            peak_a: self.peak.unwrap_or(by_rule.peak_a),
            // A given peak is also the largest one.
            most_peak_a: self.peak.unwrap_or(by_rule.most_peak_a),
            seed: self.seed,
            verify_rad: self.verify,
            swap: self.swap.into(),
            motor_alone: self.common.motor_alone,
            ..by_rule
        }
    }

    /// Connects to the drive of `--image` or `--port`; `None` for a simulation.
    fn drive(&self) -> Result<Option<LiveDrive<Box<dyn Transport>>>, Failure> {
        if !self.is_wired() {
            return Ok(None);
        }
        // `way` ignores the firmware if there is a port.
        let image = self.image.as_deref().unwrap_or(Path::new(""));
        let (transport, within, question) = way(image, &self.reach, self.seed, Emulator::paced)?;
        let connected = LiveDrive::connect(transport, within);
        connected.map(Some).map_err(|error| failed(format!("{error}; {question}")))
    }
}

/// Scenario of a drive in position mode, with the outputs of a command.
struct Subject {
    name: String,
    text: String,
    experiment: Experiment,
    designed: DriveDesign,
    known: PlantData,
    to: PathBuf,
    folder: PathBuf,
}

impl Subject {
    fn of(file: Option<&Path>, common: &Common, what: &str) -> Result<Self, Failure> {
        for (option, value, least) in [
            ("tolerance", Some(common.tolerance), 0.0),
            ("noise-steps", Some(common.noise_steps), 0.0),
            ("cogging", common.cogging, 1.0),
        ] {
            if let Some(value) = value.filter(|value| !(*value >= least && value.is_finite())) {
                return Err(bad(format!("--{option} {value}: expected a number >= {least}")));
            }
        }
        if let Some(set) = common.sets.iter().find(|set| {
            let key = set.split('=').next().unwrap_or_default();
            is_of_drive(key) && key.contains('[')
        }) {
            return Err(bad(format!(
                "--set {set}: a list entry cannot be written to the output file. Set the whole list, or change the \
                 scenario file"
            )));
        }
        let scenario = ScenarioText::read(file, JOINT)?;
        let experiment = scenario::parse_own(&scenario.source(&common.sets), &scenario.stem)?;
        let ScenarioText { file: name, text, .. } = scenario;
        let Some(drive) = &experiment.drive else {
            return Err(bad(format!("{name}: nothing to identify: the file has neither [joint] nor [motor]")));
        };
        let designed = drive.designed;
        if designed.form().follows == Follows::Speed {
            return Err(bad(format!("{name}: drive.mode = \"speed\": identification needs drive.mode = \"position\"")));
        }
        if common.motor_alone && designed.encoders().len() == 1 {
            return Err(bad(format!("{name}: --motor-alone is for a [joint]: a [motor] has one encoder")));
        }
        let source = Source { file: &name, text: &text, sets: &common.sets };
        let known = PlantData::of(&source, drive, common.cogging, [common.tolerance, common.noise_steps]);
        let to = common.to.clone().unwrap_or_else(|| PathBuf::from(format!("{}-identified.toml", experiment.name)));
        let folder = folder_of(common.out.as_ref(), &experiment.name, what);
        Ok(Self { name, text, experiment, designed, known, to, folder })
    }

    fn draw(&self, stem: &str, figure: &Figure) -> Result<(), Failure> {
        figure.write(&self.folder, stem).map_err(|error| Failure::writing(self.folder.join(stem).display(), &error))
    }

    /// Removes the loads of the scenario: a load that changes during the recording is not a parameter of the plant.
    fn calm(&mut self, common: &Common) -> Result<(), Failure> {
        let sets = [&common.sets[..], &["load=[]".into()]].concat();
        let calm = Source { file: &self.name, text: &self.text, sets: &sets };
        self.experiment = scenario::parse_own(&calm, &self.experiment.name)?;
        Ok(())
    }

    fn source<'a>(&'a self, common: &'a Common) -> Source<'a> {
        Source { file: &self.name, text: &self.text, sets: &common.sets }
    }
}

/// Output of `identify --json`.
#[derive(Serialize)]
struct IdentifiedJson<'a> {
    scenario: &'a str,
    #[serde(flatten)]
    found: &'a Identified,
    /// Path of the identified scenario; `None` if the old gains were restored.
    #[serde(skip_serializing_if = "Option::is_none")]
    written: Option<String>,
}

/// Output of `commission --json`.
#[derive(Serialize)]
struct CommissionedJson<'a> {
    #[serde(flatten)]
    identified: IdentifiedJson<'a>,
    #[serde(flatten)]
    report: &'a Report,
}

impl<'a> CommissionedJson<'a> {
    fn of(subject: &'a Subject, report: &'a Report, is_written: bool) -> Self {
        let identified = json(subject, &report.identified);
        Self { identified: IdentifiedJson { written: identified.written.filter(|_| is_written), ..identified }, report }
    }
}

/// Output of `commission --within --json`; the corners come first.
#[derive(Serialize)]
struct WithinJson<'a> {
    scenario: &'a str,
    within_percent: f64,
    corners: usize,
    accepted: usize,
    plants: Vec<PlantJson<'a>>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum PlantJson<'a> {
    Tried {
        outcome: Outcome,
        /// Relative errors of the identified parameters.
        errors: BTreeMap<&'a str, f64>,
        error_over_interval: f64,
        recorded_peak_rad: f64,
        jump_a: f64,
        verified: Verified,
    },
    Refused {
        refused: String,
    },
}

impl<'a> PlantJson<'a> {
    fn of(tried: &'a Result<PlantResult, Stopped>) -> Self {
        match tried {
            Ok(PlantResult { off, over_interval, report }) => Self::Tried {
                outcome: report.outcome,
                errors: off.iter().copied().collect(),
                error_over_interval: *over_interval,
                recorded_peak_rad: report.recorded_peak_rad,
                jump_a: report.jump_a,
                verified: report.verified,
            },
            Err(stopped) => Self::Refused { refused: stopped.to_string() },
        }
    }
}

/// Returns the table of all plants of `--within`, separately for corners and random plants.
fn within_table(tried: &[Result<PlantResult, Stopped>], corners: usize) -> Table {
    let (corners, between) = tried.split_at(corners);
    let mut table = Table::new(["metric", "corners: worst", "median", "random: worst", "median"]);
    let names = tried.iter().find_map(|it| it.as_ref().ok()).map_or(&[][..], |it| &it.off);
    let off = |i: usize| move |it: &PlantResult| it.off[i].1;
    let errors = names.iter().enumerate().map(|(i, (name, _))| {
        let name = format!("{name}{}", if i == 0 { ", relative error" } else { "" });
        (name, Box::new(off(i)) as PlantMetric)
    });
    let figures: [(&str, Figured); 6] = [
        ("largest error over stated interval", |it| it.over_interval),
        ("condition", |it| it.report.identified.motor.condition),
        ("step in u at the switch (A)", |it| it.report.jump_a),
        ("recorded moves, |y - r| (rad)", |it| it.report.recorded_peak_rad),
        ("residual of the test move (counts rms)", |it| it.report.verified.residual_steps.unwrap_or(f64::NAN)),
        ("test move, true |y - r| (rad)", |it| it.report.verified.true_peak_rad.unwrap_or(f64::NAN)),
    ];
    let figures = figures.into_iter().map(|(name, of)| (name.to_owned(), Box::new(of) as PlantMetric));
    for (name, of) in errors.chain(figures) {
        let cells = [corners, between].map(|some| {
            let mut values: Vec<f64> =
                some.iter().filter_map(|it| it.as_ref().ok()).map(&of).filter(|it| !it.is_nan()).collect();
            values.sort_by(f64::total_cmp);
            let at = |k: usize| values.get(k).map_or_else(|| "-".into(), |value| significant(*value, 2));
            [at(values.len().saturating_sub(1)), at(values.len() / 2)]
        });
        let [[a, b], [c, d]] = cells;
        // A motor has no residual.
        if [&a, &b, &c, &d].into_iter().any(|cell| cell != "-") {
            table.row([name, a, b, c, d]);
        }
    }
    table
}

/// Parses two factors.
fn factors(text: &str) -> Result<[f64; 2], String> {
    let factor = |text: &str| text.trim().parse::<f64>().ok().filter(|it| *it > 0.0 && it.is_finite());
    let factors: Option<Vec<f64>> = text.split(',').map(factor).collect();
    factors.and_then(|two| two.try_into().ok()).ok_or_else(|| "expected two factors above 0, as in 1.05,1".into())
}

/// Returns the verdict of a commissioning.
const fn told(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Accepted => "accepted",
        Outcome::BackForTheMove => "REJECTED, old gains restored: the test move exceeds the limit",
        Outcome::BackForTheLink => "REJECTED, old gains restored: the link differs from the identified one",
    }
}

/// Returns why the test move was rejected: its error, how the limit is made up, possible causes and a remedy.
fn of_the_bar(plan: &Plan, report: &Report) -> String {
    let three = |value: f64| significant(value, 3);
    let Verified { peak_rad, bar_rad, expected_rad, .. } = report.verified;
    let (followed, whose, suspects) = match &report.record.link {
        Some(link) => (link, "joint", "Possible causes outside of the link: a load, friction, play, cogging"),
        None => (&report.record.motor, "motor", "Possible causes: a wrong b, a load, friction, cogging"),
    };
    let bar = if bar_rad < report.recorded_peak_rad + followed.step_rad {
        let expected = expected_rad.map_or_else(
            || format!("a simulation of the identified {whose} did not finish"),
            |it| format!("{TIMES_EXPECTED} times the {} rad of a simulation of the identified {whose}", three(it)),
        );
        let steps = three(BAR_STEPS * followed.step_rad);
        format!("{LEAST_BAR_RAD:?} rad or, if more, {expected}; plus {BAR_STEPS} counts of the encoder, {steps} rad")
    } else {
        format!("the error of the recorded moves, {} rad, plus a count of the encoder", three(report.recorded_peak_rad))
    };
    format!(
        "test move: |y - r| = {} rad, limit {} rad ({bar}). {suspects}. See commissioned.{FIGURE}, record again, or \
         verify with a shorter move (--verify {})",
        three(peak_rad),
        three(bar_rad),
        significant(0.5 * plan.verify_rad, 2)
    )
}

/// Metric of a plant that was tried.
type PlantMetric = Box<dyn Fn(&PlantResult) -> f64>;
/// Metric without captured variables.
type Figured = fn(&PlantResult) -> f64;

impl Console<'_> {
    pub(super) fn identify(&mut self, options: &IdentifyOptions) -> Result<u8, Failure> {
        let common = &options.common;
        let subject = Subject::of(options.file.as_deref(), common, "identify")?;
        free_to(&subject.to)?;
        let data = options.data.display().to_string();
        let text = read_text(&options.data, FileKind::TRACE)?;
        let mut mounted: Vec<Mounted> = subject.designed.encoders().into_iter().map(|(_, mounted)| mounted).collect();
        let kind = match mounted.len() {
            1 => record::RecordingKind::Motor,
            _ if common.motor_alone => record::RecordingKind::JointAlone,
            _ => record::RecordingKind::Joint,
        };
        if kind == record::RecordingKind::JointAlone {
            mounted.remove(0);
        }
        let record = record::read(&text, subject.experiment.period_s, kind, &mounted)
            .map_err(|it| bad(format!("{data}:{}:{}: {}", it.line, it.column, it.message)))?;
        let old = sheet_of(&subject.designed);
        let found = identify(&record, &old, &subject.known).map_err(|refusal| bad(format!("{data}: {refusal}")))?;
        let retuned = Retuned::of(&subject.source(common), &old, &found)
            .and_then(|it| it.taken_over_by(&subject.designed, &subject.to.display().to_string()))
            .map_err(|error| failed(error.to_string()))?;
        let to = subject.to.display().to_string();
        retuned.designed(&to).map_err(|why| failed(format!("no design for the identified parameters: {why}")))?;
        let _claim = claim_folder(&subject.folder)?;
        let kept = write_new(&subject.to, &retuned.text);
        if common.json {
            let told = json(&subject, &found);
            let told = IdentifiedJson { written: told.written.filter(|_| kept.is_ok()), ..told };
            self.say_json(serde_json::to_string(&told))?;
        } else {
            let seconds = record.held_a.len() as f64 * record.period_s;
            self.say(&format!("{data}: {seconds:.2} s of {}", subject.experiment.title))?;
            self.found(&found)?;
            if kept.is_ok() {
                self.say(&format!("wrote {to}"))?;
            }
        }
        kept?;
        subject.draw("identified", &figure(&subject.experiment.title, &record, &found))?;
        if !common.json {
            self.say(&format!("figure: {}", subject.folder.join("identified").with_extension(FIGURE).display()))?;
            self.say(&format!("result: {} parameters identified", found.parameters.len()))?;
        }
        Ok(status::DONE)
    }

    pub(super) fn commission(&mut self, options: &CommissionOptions) -> Result<u8, Failure> {
        options.check()?;
        let common = &options.common;
        let mut subject = Subject::of(options.file.as_deref(), common, "commission")?;
        let plan = options.plan(&subject.designed);
        if let Some(percent) = options.within {
            return self.commission_all(options, &subject, &plan, percent);
        }
        let claim = free_to(&subject.to).and_then(|()| claim_folder(&subject.folder))?;
        let drive = options.drive()?;
        // After a request to stop the command ends only when the old gains are restored.
        let kept = drive.is_some().then(stop::keeping);
        if drive.is_none() && !subject.experiment.plant.jumps_s().is_empty() {
            subject.calm(common)?;
            self.note(
                "note: the loads of the file are left out: one steps, but a load must be constant while recording",
            );
        }
        let (report, retuned) = match self.commissioned(&mut subject, common, &plan, drive) {
            Ok(done) => done,
            Err(Stopped::Interrupted) => {
                if kept.is_some() {
                    self.note("stopped on request: the drive rests with the old gains; no file written");
                }
                return Ok(status::INTERRUPTED);
            }
            Err(stopped) => return Err(failed(format!("{stopped}; no file written"))),
        };
        let is_accepted = report.outcome == Outcome::Accepted;
        // Gains that no move has verified are not kept.
        let is_kept = is_accepted && plan.swap != Swap::None;
        // Printed before a failed write is reported: the identification took minutes.
        let kept = retuned.filter(|_| is_kept).map_or(Ok(()), |retuned| write_new(&subject.to, &retuned.text));
        if common.json {
            let json = CommissionedJson::of(&subject, &report, is_kept && kept.is_ok());
            self.say_json(serde_json::to_string(&json))?;
        } else {
            self.told(&subject, &plan, &report)?;
            if is_kept && kept.is_ok() {
                self.say(&format!("wrote {}", subject.to.display()))?;
            }
        }
        kept?;
        let title = &subject.experiment.title;
        subject.draw("identified", &figure(title, &report.record, &report.identified))?;
        subject.draw("commissioned", &sequence(title, &report))?;
        if !common.json {
            self.say(&format!("files: {}", subject.folder.display()))?;
            self.say(&format!("result: {}", told(report.outcome)))?;
        }
        drop(claim);
        Ok(if is_accepted { status::DONE } else { status::FAILED })
    }

    /// Commissions a drive on a target or in a simulation. Returns the report and the identified scenario.
    fn commissioned(
        &self,
        subject: &mut Subject,
        common: &Common,
        plan: &Plan,
        drive: Option<LiveDrive<Box<dyn Transport>>>,
    ) -> Result<(Report, Option<Retuned>), Stopped> {
        let Subject { name, text, experiment, designed, known, to, .. } = subject;
        let (old, to) = (sheet_of(designed), to.display().to_string());
        let source = Source { file: name, text, sets: &common.sets };
        let mut retuned = None;
        let design = |found: &mut Identified| {
            let of_form = Retuned::of(&source, &old, found)?.taken_over_by(designed, &to)?;
            retuned.insert(of_form).designed(&to)
        };
        // On a target every row is recorded and then read.
        let ticks = if drive.is_some() { 20.0 } else { 12.0 } / experiment.period_s;
        let (stop, bar) = (self.stop, self.bar(ticks as u64, LEFT));
        let mut watch = |ticks| {
            bar.inc(ticks);
            if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let done = match drive {
            Some(drive) => Wired::new(drive, *designed, &mut watch)
                .and_then(|mut wired| commission(&mut wired, plan, known, design)),
            None => Rig::new(experiment, Signal::default(), &mut watch)
                .and_then(|mut rig| commission(&mut rig, plan, known, design)),
        };
        bar.finish_and_clear();
        done.map(|report| (report, retuned))
    }

    /// Prints the identified parameters and the quality of the fit as tables.
    fn found(&mut self, found: &Identified) -> Result<(), Failure> {
        let mut table = Table::new(["parameter", "meaning", "unit", "identified", "+-", "data sheet", "change %"]);
        for it in &found.parameters {
            let sheet = it.sheet.map_or_else(String::new, |sheet| significant(sheet, 5));
            let change = it.sheet.filter(|sheet| *sheet != 0.0).map(|sheet| 100.0 * (it.value / sheet - 1.0));
            let change = change.map_or_else(String::new, |change| format!("{change:+.1}"));
            // The digits that the interval justifies, and one more.
            let digits = libm::log10((it.value / it.interval).abs().max(1.0)) as usize + 2;
            let [value, interval] =
                [(it.value, digits.min(8)), (it.interval, 2)].map(|(it, digits)| significant(it, digits));
            table.row([it.name, it.meaning, it.unit, &value, &interval, &sheet, &change]);
        }
        self.say(&table.to_string())?;
        let mut table = Table::new(["equation", "residual (counts rms)", "condition", "Gauss-Newton iterations"]);
        for (name, quality) in found.link.iter().map(|link| ("link", link)).chain([("motor", &found.motor)]) {
            let [residual, condition] = [quality.residual_steps, quality.condition].map(|it| significant(it, 3));
            table.row([name, &residual, &condition, &quality.steps.to_string()]);
        }
        self.say(&table.to_string())
    }

    /// Prints a commissioning step by step.
    fn told(&mut self, subject: &Subject, plan: &Plan, report: &Report) -> Result<(), Failure> {
        let three = |value: f64| significant(value, 3);
        self.say(&format!("{}: {}", subject.experiment.name, subject.experiment.title))?;
        self.say(&format!(
            "record    {:.2} s, {} rad back and forth{}, excitation up to {} A: |y - r| <= {} rad",
            report.record.held_a.len() as f64 * report.record.period_s,
            plan.way_rad,
            if plan.motor_alone { " with decreasing travel, without the link encoder" } else { "" },
            three(report.peak_a),
            three(report.recorded_peak_rad)
        ))?;
        self.say("identify")?;
        self.found(&report.identified)?;
        let how = match plan.swap {
            Swap::AtRest => "at rest, W = 0",
            Swap::InMotion => "bumpless, as in motion",
            Swap::None => "none, the old gains stay",
        };
        self.say(&format!(
            "switch    {how}: step in u {} A, then |y - r| <= {} rad",
            three(report.jump_a),
            three(report.settling_rad)
        ))?;
        let Verified { move_s, peak_rad, bar_rad, expected_rad, residual_steps, most_residual_steps, .. } =
            report.verified;
        let expected = expected_rad.map_or_else(String::new, |it| format!(", expected {}", three(it)));
        let residual = residual_steps.map_or_else(String::new, |steps| match most_residual_steps {
            _ if steps.is_infinite() => "; a count was missing during the move".into(),
            Some(most) => format!("; link residual {} counts rms (limit {})", three(steps), three(most)),
            None => String::new(),
        });
        self.say(&format!(
            "verify    {} rad in {move_s:.3} s: |y - r| <= {} rad (limit {}{expected}){residual}",
            plan.verify_rad,
            three(peak_rad),
            three(bar_rad)
        ))?;
        if report.outcome == Outcome::BackForTheMove {
            self.say(&of_the_bar(plan, report))?;
        }
        self.say(&format!("home      |y - r| <= {} rad", three(report.home_rad)))?;
        if report.outcome == Outcome::Accepted && plan.swap == Swap::None {
            self.say("no file written: no move was made with the new gains")?;
        }
        Ok(())
    }

    /// Commissions all plants of `--within`.
    fn commission_all(
        &mut self,
        options: &CommissionOptions,
        subject: &Subject,
        plan: &Plan,
        percent: f64,
    ) -> Result<u8, Failure> {
        if !(percent > 0.0 && percent <= 50.0) {
            return Err(bad(format!("--within {percent}: expected a percentage above 0, up to 50")));
        }
        let random = options.random as usize;
        let plants = Plants {
            file: &subject.name,
            text: &subject.text,
            sets: &options.common.sets,
            share: percent / 100.0,
            random,
            plan: *plan,
            known: subject.known,
            wrong: options.wrong.unwrap_or([1.0; 2]),
        };
        let corners = plants.variants()?.len() - random;
        let bar = self.bar((corners + random) as u64, LEFT);
        let tried = try_all(&plants, Watch::new(self.stop, &|| bar.inc(1)));
        bar.finish_and_clear();
        let Some(tried) = tried? else { return Ok(status::INTERRUPTED) };
        let is_accepted = |it: &PlantResult| it.report.outcome == Outcome::Accepted;
        let accepted = tried.iter().flatten().filter(|it| is_accepted(it)).count();
        let status = if accepted == tried.len() { status::DONE } else { status::FAILED };
        if options.common.json {
            let plants = tried.iter().map(PlantJson::of).collect();
            let scenario = &subject.experiment.name;
            let json = WithinJson { scenario, within_percent: percent, corners, accepted, plants };
            self.say_json(serde_json::to_string(&json))?;
            return Ok(status);
        }
        let title = &subject.experiment.title;
        self.say(&format!("{}: {title}: plants within {percent} % of the data sheet", subject.experiment.name))?;
        self.say(&within_table(&tried, corners).to_string())?;
        for (k, it) in tried.iter().enumerate() {
            match it {
                Ok(it) if is_accepted(it) => {}
                Ok(PlantResult { report: Report { outcome, verified, .. }, .. }) => {
                    let residual =
                        verified.residual_steps.map(|steps| format!(", residual {} counts", significant(steps, 3)));
                    self.say(&format!(
                        "plant {k}: {}: |y - r| <= {} rad (limit {}){}",
                        told(*outcome),
                        significant(verified.peak_rad, 3),
                        significant(verified.bar_rad, 3),
                        residual.unwrap_or_default()
                    ))?;
                }
                Err(why) => self.say(&format!("plant {k}: {why}"))?,
            }
        }
        self.say(&format!("result: {accepted} of {} plants accepted", tried.len()))?;
        Ok(status)
    }
}

fn json<'a>(subject: &'a Subject, found: &'a Identified) -> IdentifiedJson<'a> {
    IdentifiedJson { scenario: &subject.experiment.name, found, written: Some(subject.to.display().to_string()) }
}

/// Returns the figure of a recording and the residuals of its equations.
fn figure(title: &str, record: &Record, found: &Identified) -> Figure {
    let timed = |values: &[f64]| -> Vec<(f64, f64)> {
        values.iter().enumerate().map(|(k, value)| (k as f64 * record.period_s, *value)).collect()
    };
    let panel = |title: &str, y_label: &str, series: Vec<Series>| Panel {
        title: title.into(),
        x_label: "t (s)".into(),
        y_label: y_label.into(),
        series,
        ..Panel::default()
    };
    let mut angles = vec![Series::solid("motor", 1, timed(&record.motor.rad))];
    if let Some(link) = &record.link {
        angles.push(Series::solid("link", 0, timed(&link.rad)));
    }
    let held = Series { is_held: true, ..Series::solid("", 2, timed(&record.held_a)) };
    let mut panels = vec![panel("Recording", "angle (rad)", angles), panel("", "current (A)", vec![held])];
    let names: &[&str] = if found.link.is_some() { &["Link", "Motor"] } else { &["Motor"] };
    for (k, (name, residual)) in names.iter().zip(&found.residuals).enumerate() {
        let heading = format!("{name}: residual of its equation");
        panels.push(panel(&heading, "residual (counts)", vec![Series::solid("", k, residual.iter().copied())]));
    }
    Figure { title: format!("{title}: identified"), panels, columns: 1 }
}

/// Returns the figure of a commissioning: angle, error and current.
fn sequence(title: &str, report: &Report) -> Figure {
    let at = |f: &dyn Fn(&[f64; 3]) -> f64| -> Vec<(f64, f64)> {
        report.ticks.iter().map(|[t, rest @ ..]| (*t, f(rest))).collect()
    };
    let [swapped, verified, home] = report.marks;
    let end = report.ticks.last().map_or(home, |[t, ..]| *t);
    let bar = report.verified.bar_rad;
    let panel = |title: String, y_label: &str, series: Vec<Series>, x_range| Panel {
        title,
        x_label: "t (s)".into(),
        y_label: y_label.into(),
        series,
        x_range,
        ..Panel::default()
    };
    let error = at(&|tick| tick[0] - tick[1]);
    let bars = [bar, -bar].map(|bar| Series::solid("", GREY, [(verified, bar), (home, bar)]).styled(Style::Dashed));
    let off = Series::solid("y - r", 0, error.clone());
    let [above, below] = bars;
    Figure {
        title: format!("{title}: commissioned"),
        panels: vec![
            panel(
                format!("Gain switch at {swapped:.2} s, test move from {verified:.2} s, return from {home:.2} s"),
                "angle (rad)",
                vec![
                    Series::solid("y", 0, at(&|tick| tick[0])),
                    Series::solid("r", 1, at(&|tick| tick[1])).styled(Style::Dashed),
                ],
                None,
            ),
            panel(String::new(), "y - r (rad)", vec![Series::solid("", 0, error)], None),
            panel(
                "From the test move on".into(),
                "y - r (rad)",
                vec![off, Series { label: "limit of the test move".into(), ..above }, below],
                Some((verified, end)),
            ),
            panel(
                String::new(),
                "current (A)",
                vec![Series { is_held: true, ..Series::solid("", 2, at(&|tick| tick[2])) }],
                None,
            ),
        ],
        columns: 1,
    }
}
