//! `host-sim identify` and `host-sim commission`: what a joint or motor really is, and the drive for it.

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
use study::commission::plants::{Plants, Tried, try_all};
use study::commission::{
    BAR_STEPS, LEAST_BAR_RAD, Outcome, Plan, Report, Retuned, Rig, Stopped, Swap, TIMES_EXPECTED, Verified, commission,
    is_of_drive, sheet_of,
};
use study::identify::{Identified, Known, Record, identify, record};
use study::number::significant;
use terminal::stop;
use terminal::table::Table;
use whole_file::Kind;

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

/// What both commands are told.
#[derive(Args, Debug)]
struct Common {
    /// Override a key of the scenario, as in --set joint.stiffness_n_m=12.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Periods of the motor's cogging in a turn of its shaft, if they are known: errors of k_2, b_2, B_0 halve.
    #[arg(long, value_name = "N")]
    cogging: Option<f64>,
    /// How far the data sheet may be off: a parameter farther off is refused.
    #[arg(long, value_name = "PERCENT", default_value_t = 60.0)]
    tolerance: f64,
    /// Noise of the encoders besides their rounding, steps rms.
    #[arg(long, value_name = "STEPS", default_value_t = 0.0)]
    noise_steps: f64,
    /// Without the link's count, from the motor alone: of a joint whose record shakes the link at its own frequency, as
    /// that of commission --motor-alone does.
    #[arg(long)]
    motor_alone: bool,
    /// The scenario with what was found; an existing file is never overwritten [default: SCENARIO-identified.toml].
    #[arg(long, short = 'o', value_name = "FILE")]
    to: Option<PathBuf>,
    /// Folder for the figure [default: out/SCENARIO-identify or -commission].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the tables.
    #[arg(long)]
    json: bool,
}

#[derive(Args, Debug)]
pub(super) struct IdentifyOptions {
    /// The record: tick or t_s, count_link (of a joint), count_motor, u_held_a, a row per period.
    data: PathBuf,
    /// The scenario with the data sheet, encoders and period; without one that of `new --plant joint`.
    file: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

#[derive(Args, Debug)]
pub(super) struct CommissionOptions {
    /// A scenario with [joint] or [motor]; without one that of `new --plant joint`.
    file: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Way of the recorded moves, rad [default: 0.6 of a joint, 3 of a motor].
    #[arg(long, value_name = "RAD")]
    way: Option<f64>,
    /// Peak of the multisine, A: at least five times the friction [default: 27 % of the limit; of a joint as a whole
    /// 50 %, and 80 % if that says too little; of a motor all of it].
    #[arg(long, value_name = "A")]
    peak: Option<f64>,
    /// Seed of its phases, and of random plants.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Way of the move that verifies, rad. Its |y - r| may be 1e-4 rad, or twice what the same move leaves in a
    /// simulation of the joint or motor as it was found, and 2.5 steps of its encoder (of a joint the link's); and no
    /// more than a step above what the recorded moves left.
    #[arg(long, value_name = "RAD", default_value_t = 1.0)]
    verify: f64,
    /// The drive itself instead of a simulation: the emulated chip with this image, `drive` or `motor`
    /// (feature chip).
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    image: Option<PathBuf>,
    #[command(flatten)]
    reach: Reach,
    /// How the new gains take over; the others show what `at-rest` is better than.
    #[arg(long, value_enum, value_name = "HOW", default_value = "at-rest")]
    swap: SwapWord,
    /// Instead of the plant of the file: all corners (32 of a joint, 8 of a motor) and random ones within so many
    /// percent of its data sheet, with friction, cogging, a load and a current that nobody knows of.
    #[arg(long, value_name = "PERCENT", conflicts_with_all = ["image", "port"])]
    within: Option<f64>,
    /// Random plants of --within.
    #[arg(long, value_name = "N", default_value_t = 30, requires = "within",
          value_parser = clap::value_parser!(u32).range(0..=100_000))]
    random: u32,
    /// Factors of k_1 and b_1 (of a motor: b and f_c) once they are found: shows with --within what the verification
    /// sees.
    #[arg(long, value_name = "F,F", value_parser = factors, requires = "within")]
    wrong: Option<[f64; 2]>,
}

/// [`Swap`] as a word.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum SwapWord {
    /// Without an offset W: u jumps a little.
    AtRest,
    /// Without a jump of u, as in motion.
    InMotion,
    /// Not at all: the move that verifies is that of the old gains.
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
    /// The option that needs a feature.
    pub(super) const fn needs(&self) -> Option<(&'static str, Feature)> {
        match (&self.image, self.reach.is_port()) {
            (_, true) => Some(("commission --port", Feature::Chip)),
            (Some(_), _) => Some(("commission --image", Feature::Chip)),
            _ => None,
        }
    }

    /// Numbers that are in no range of clap's, and options that need another.
    fn check(&self) -> Result<(), Failure> {
        for (option, value) in [("way", self.way), ("peak", self.peak), ("verify", Some(self.verify))] {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(bad(format!("--{option} {value}: expected a number above 0")));
            }
        }
        if self.reach.has_faults() && !self.is_wired() {
            return Err(bad("--faults is for a drive behind a wire: give --image or --port"));
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
            // A peak that is typed is not exceeded.
            most_peak_a: self.peak.unwrap_or(by_rule.most_peak_a),
            seed: self.seed,
            verify_rad: self.verify,
            swap: self.swap.into(),
            motor_alone: self.common.motor_alone,
            ..by_rule
        }
    }

    /// The drive behind a wire, if one is asked for.
    fn drive(&self) -> Result<Option<LiveDrive<Box<dyn Transport>>>, Failure> {
        if !self.is_wired() {
            return Ok(None);
        }
        // A port is asked first.
        let image = self.image.as_deref().unwrap_or(Path::new(""));
        let (transport, within, question) = way(image, &self.reach, self.seed, Emulator::paced)?;
        let connected = LiveDrive::connect(transport, within);
        connected.map(Some).map_err(|error| failed(format!("{error}; {question}")))
    }
}

/// A scenario of a drive that follows a position.
struct Subject {
    name: String,
    text: String,
    experiment: Experiment,
    designed: DriveDesign,
    known: Known,
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
                return Err(bad(format!("--{option} {value}: expected a number from {least} on")));
            }
        }
        if let Some(set) = common.sets.iter().find(|set| {
            let key = set.split('=').next().unwrap_or_default();
            is_of_drive(key) && key.contains('[')
        }) {
            return Err(bad(format!(
                "--set {set}: what is set of a drive goes into the file that is written, and an entry of a list \
                 cannot: set the whole list, or change it in the file"
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
            return Err(bad(format!("{name}: drive.mode is \"speed\": a drive is identified that follows a position")));
        }
        if common.motor_alone && designed.encoders().len() == 1 {
            return Err(bad(format!("{name}: --motor-alone is for a [joint]: a [motor] has no other count")));
        }
        let known = Known {
            cogging_per_turn: common.cogging.map(|per_turn| per_turn * gear(&designed)),
            tolerance: common.tolerance / 100.0,
            noise_steps: common.noise_steps,
            gear: turns_of_gear(&Source { file: &name, text: &text, sets: &common.sets }, &designed),
            ..Known::with_lag(drive.current_lag_s)
        };
        let to = common.to.clone().unwrap_or_else(|| PathBuf::from(format!("{}-identified.toml", experiment.name)));
        let folder = folder_of(common.out.as_ref(), &experiment.name, what);
        Ok(Self { name, text, experiment, designed, known, to, folder })
    }

    fn draw(&self, stem: &str, figure: &Figure) -> Result<(), Failure> {
        figure.write(&self.folder, stem).map_err(|error| Failure::writing(self.folder.join(stem).display(), &error))
    }

    /// Without the loads of its file: one that varies during the record is no parameter of the plant.
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

/// The gear of the file; 1 without one.
fn turns_of_gear(source: &Source<'_>, designed: &DriveDesign) -> f64 {
    let part = |k: u32| {
        let key = format!("{}.gear[{k}]", designed.name());
        scenario::number_at(source, &key).ok().flatten().filter(|it| *it > 0.0)
    };
    part(1).zip(part(2)).map_or(1.0, |(num, den)| num / den)
}

/// Turns of the motor in one behind its gear, as its encoder has it.
fn gear(designed: &DriveDesign) -> f64 {
    let of = |mounted: &Mounted| f64::from(mounted.encoder.gear_num) / f64::from(mounted.encoder.gear_den);
    designed.encoders().last().map_or(1.0, |(_, motor)| of(motor))
}

/// What `--json` prints of a record.
#[derive(Serialize)]
struct IdentifiedJson<'a> {
    scenario: &'a str,
    #[serde(flatten)]
    found: &'a Identified,
    /// Where the scenario is; nowhere if the old gains are back.
    #[serde(skip_serializing_if = "Option::is_none")]
    written: Option<String>,
}

/// What `--json` prints of a commissioning.
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

/// What `--json` prints of the plants of `--within`, the corners first.
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
        /// Of what was found, relative.
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
    fn of(tried: &'a Result<Tried, Stopped>) -> Self {
        match tried {
            Ok(Tried { off, over_interval, report }) => Self::Tried {
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

/// Figures of all plants of `--within`, the corners apart from those between.
fn within_table(tried: &[Result<Tried, Stopped>], corners: usize) -> Table {
    let (corners, between) = tried.split_at(corners);
    let mut table = Table::new(["figure", "corners: worst", "median", "random: worst", "median"]);
    let names = tried.iter().find_map(|it| it.as_ref().ok()).map_or(&[][..], |it| &it.off);
    let off = |i: usize| move |it: &Tried| it.off[i].1;
    let errors = names.iter().enumerate().map(|(i, (name, _))| {
        let name = format!("{name}{}", if i == 0 { ", relative error" } else { "" });
        (name, Box::new(off(i)) as Told)
    });
    let figures: [(&str, Figured); 6] = [
        ("largest error over stated interval", |it| it.over_interval),
        ("condition", |it| it.report.identified.motor.condition),
        ("jump of u at the swap (A)", |it| it.report.jump_a),
        ("moves of the record, |y - r| (rad)", |it| it.report.recorded_peak_rad),
        ("residual of the verification (steps rms)", |it| it.report.verified.residual_steps.unwrap_or(f64::NAN)),
        ("move after the swap, true |y - r| (rad)", |it| it.report.verified.true_peak_rad.unwrap_or(f64::NAN)),
    ];
    let figures = figures.into_iter().map(|(name, of)| (name.to_owned(), Box::new(of) as Told));
    for (name, of) in errors.chain(figures) {
        let cells = [corners, between].map(|some| {
            let mut values: Vec<f64> =
                some.iter().filter_map(|it| it.as_ref().ok()).map(&of).filter(|it| !it.is_nan()).collect();
            values.sort_by(f64::total_cmp);
            let at = |k: usize| values.get(k).map_or_else(|| "-".into(), |value| significant(*value, 2));
            [at(values.len().saturating_sub(1)), at(values.len() / 2)]
        });
        let [[a, b], [c, d]] = cells;
        // Of a motor no residual is taken.
        if [&a, &b, &c, &d].into_iter().any(|cell| cell != "-") {
            table.row([name, a, b, c, d]);
        }
    }
    table
}

/// Two factors of a command line.
fn factors(text: &str) -> Result<[f64; 2], String> {
    let factor = |text: &str| text.trim().parse::<f64>().ok().filter(|it| *it > 0.0 && it.is_finite());
    let factors: Option<Vec<f64>> = text.split(',').map(factor).collect();
    factors.and_then(|two| two.try_into().ok()).ok_or_else(|| "expected two factors above 0, as in 1.05,1".into())
}

/// What follows from the verification, in words.
const fn told(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Accepted => "accepted",
        Outcome::BackForTheMove => "SWAPPED BACK: the move is not good enough",
        Outcome::BackForTheLink => "SWAPPED BACK: the link is not as it was found",
    }
}

/// Why the move was not good enough, what its bar is made of, and what to type instead.
fn of_the_bar(plan: &Plan, report: &Report) -> String {
    let three = |value: f64| significant(value, 3);
    let Verified { peak_rad, bar_rad, expected_rad, .. } = report.verified;
    let (followed, whose, suspects) = match &report.record.link {
        Some(link) => {
            (link, "joint", "Something else than the link is not as it was found: a load, friction, play, cogging")
        }
        None => {
            (&report.record.motor, "motor", "b is not as it was found, or a load, friction or cogging is in the way")
        }
    };
    let bar = if bar_rad < report.recorded_peak_rad + followed.step_rad {
        let expected = expected_rad.map_or_else(
            || format!("the same move in a simulation of the {whose} as it was found came to no end"),
            |it| {
                format!(
                    "{TIMES_EXPECTED} times the {} that it leaves in a simulation of the {whose} as found",
                    three(it)
                )
            },
        );
        let steps = three(BAR_STEPS * followed.step_rad);
        format!("{LEAST_BAR_RAD:?} rad or, if more, {expected}; and {BAR_STEPS} steps of the encoder, {steps}")
    } else {
        format!("what the recorded moves left, {}, and a step of the encoder", three(report.recorded_peak_rad))
    };
    format!(
        "the move left {} rad, at most {} were allowed: {bar}. {suspects}. Look at commissioned.{FIGURE}, record \
         again, or verify by a shorter way (--verify {})",
        three(peak_rad),
        three(bar_rad),
        significant(0.5 * plan.verify_rad, 2)
    )
}

/// A figure of a plant that was tried; the same by a function that knows no more.
type Told = Box<dyn Fn(&Tried) -> f64>;
type Figured = fn(&Tried) -> f64;

impl Console<'_> {
    pub(super) fn identify(&mut self, options: &IdentifyOptions) -> Result<u8, Failure> {
        let common = &options.common;
        let subject = Subject::of(options.file.as_deref(), common, "identify")?;
        free_to(&subject.to)?;
        let data = options.data.display().to_string();
        let text = read_text(&options.data, Kind::TRACE)?;
        let mut mounted: Vec<Mounted> = subject.designed.encoders().into_iter().map(|(_, mounted)| mounted).collect();
        let kind = match mounted.len() {
            1 => record::Kind::Motor,
            _ if common.motor_alone => record::Kind::JointAlone,
            _ => record::Kind::Joint,
        };
        if kind == record::Kind::JointAlone {
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
        retuned.designed(&to).map_err(|why| failed(format!("no drive can be made of what was found: {why}")))?;
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
        // Whoever ends this early waits for the old gains: the wire itself does not end before they are back.
        let kept = drive.is_some().then(stop::keeping);
        if drive.is_none() && !subject.experiment.plant.jumps_s().is_empty() {
            subject.calm(common)?;
            self.note(
                "without the loads of the file: one of them steps, and a load must stay as it is while is recorded",
            );
        }
        let (report, retuned) = match self.commissioned(&mut subject, common, &plan, drive) {
            Ok(done) => done,
            Err(Stopped::Interrupted) => {
                if kept.is_some() {
                    self.note("stopped on request: the drive rests, with the gains of before; nothing is written");
                }
                return Ok(status::INTERRUPTED);
            }
            Err(stopped) => return Err(failed(format!("{stopped}; nothing is written"))),
        };
        let is_accepted = report.outcome == Outcome::Accepted;
        // What no move has verified is not kept.
        let is_kept = is_accepted && plan.swap != Swap::None;
        // Told before it fails: what was found took a while.
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
            self.say(&format!("figures: {}", subject.folder.display()))?;
        }
        drop(claim);
        Ok(if is_accepted { status::DONE } else { status::FAILED })
    }

    /// The sequence on a drive behind a wire, or in a simulation; the report, and the scenario with what was found.
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
        // Over a wire every row is made, and then read.
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

    /// What was found, as tables.
    fn found(&mut self, found: &Identified) -> Result<(), Failure> {
        let mut table = Table::new(["parameter", "", "unit", "found", "+-", "data sheet", "change %"]);
        for it in &found.parameters {
            let sheet = it.sheet.map_or_else(String::new, |sheet| significant(sheet, 5));
            let change = it.sheet.filter(|sheet| *sheet != 0.0).map(|sheet| 100.0 * (it.value / sheet - 1.0));
            let change = change.map_or_else(String::new, |change| format!("{change:+.1}"));
            // As many digits as the interval leaves, and one more.
            let digits = libm::log10((it.value / it.interval).abs().max(1.0)) as usize + 2;
            let [value, interval] =
                [(it.value, digits.min(8)), (it.interval, 2)].map(|(it, digits)| significant(it, digits));
            table.row([it.name, it.meaning, it.unit, &value, &interval, &sheet, &change]);
        }
        self.say(&table.to_string())?;
        let mut table = Table::new(["equation", "residual (steps rms)", "condition", "Gauss-Newton steps"]);
        for (name, quality) in found.link.iter().map(|link| ("link", link)).chain([("motor", &found.motor)]) {
            let [residual, condition] = [quality.residual_steps, quality.condition].map(|it| significant(it, 3));
            table.row([name, &residual, &condition, &quality.steps.to_string()]);
        }
        self.say(&table.to_string())
    }

    /// What happened, step by step.
    fn told(&mut self, subject: &Subject, plan: &Plan, report: &Report) -> Result<(), Failure> {
        let three = |value: f64| significant(value, 3);
        self.say(&format!("{}: {}", subject.experiment.name, subject.experiment.title))?;
        self.say(&format!(
            "record    {:.2} s, {} rad to and fro{}, shaken by up to {} A: |y - r| <= {} rad",
            report.record.held_a.len() as f64 * report.record.period_s,
            plan.way_rad,
            if plan.motor_alone { " and ever less, without the link's count" } else { "" },
            three(report.peak_a),
            three(report.recorded_peak_rad)
        ))?;
        self.say("identify")?;
        self.found(&report.identified)?;
        let how = match plan.swap {
            Swap::AtRest => "at rest, W = 0",
            Swap::InMotion => "as in motion, bumpless",
            Swap::None => "none, the gains of before go on",
        };
        self.say(&format!(
            "swap      {how}: u jumps by {} A, then |y - r| <= {} rad",
            three(report.jump_a),
            three(report.settling_rad)
        ))?;
        let Verified { move_s, peak_rad, bar_rad, expected_rad, residual_steps, most_residual_steps, .. } =
            report.verified;
        let expected = expected_rad.map_or_else(String::new, |it| format!(", expected {}", three(it)));
        let residual = residual_steps.map_or_else(String::new, |steps| match most_residual_steps {
            _ if steps.is_infinite() => "; a count was lost on the way".into(),
            Some(most) => format!("; {} steps rms of the link are left (at most {})", three(steps), three(most)),
            None => String::new(),
        });
        self.say(&format!(
            "verify    {} rad in {move_s:.3} s: |y - r| <= {} rad (at most {}{expected}){residual}",
            plan.verify_rad,
            three(peak_rad),
            three(bar_rad)
        ))?;
        self.say(told(report.outcome))?;
        if report.outcome == Outcome::BackForTheMove {
            self.say(&of_the_bar(plan, report))?;
        }
        self.say(&format!("home      |y - r| <= {} rad", three(report.home_rad)))?;
        if report.outcome == Outcome::Accepted && plan.swap == Swap::None {
            self.say("nothing is written: no move was made with the new gains")?;
        }
        Ok(())
    }

    /// All plants within what the data sheet may be off.
    fn commission_all(
        &mut self,
        options: &CommissionOptions,
        subject: &Subject,
        plan: &Plan,
        percent: f64,
    ) -> Result<u8, Failure> {
        if !(percent > 0.0 && percent <= 50.0) {
            return Err(bad(format!("--within {percent}: expected 0 to 50 percent, without 0")));
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
        let is_accepted = |it: &Tried| it.report.outcome == Outcome::Accepted;
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
                Ok(Tried { report: Report { outcome, verified, .. }, .. }) => {
                    let residual =
                        verified.residual_steps.map(|steps| format!(", residual {} steps", significant(steps, 3)));
                    self.say(&format!(
                        "plant {k}: {}: |y - r| <= {} rad (at most {}){}",
                        told(*outcome),
                        significant(verified.peak_rad, 3),
                        significant(verified.bar_rad, 3),
                        residual.unwrap_or_default()
                    ))?;
                }
                Err(why) => self.say(&format!("plant {k}: {why}"))?,
            }
        }
        self.say(&format!("accepted: {accepted} of {}", tried.len()))?;
        Ok(status)
    }
}

fn json<'a>(subject: &'a Subject, found: &'a Identified) -> IdentifiedJson<'a> {
    IdentifiedJson { scenario: &subject.experiment.name, found, written: Some(subject.to.display().to_string()) }
}

/// The record, and what the equations leave of it.
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
    let mut panels = vec![panel("Record", "angle (rad)", angles), panel("", "current (A)", vec![held])];
    let names: &[&str] = if found.link.is_some() { &["Link", "Motor"] } else { &["Motor"] };
    for (k, (name, residual)) in names.iter().zip(&found.residuals).enumerate() {
        let heading = format!("{name}: what its equation leaves");
        panels.push(panel(&heading, "residual (steps)", vec![Series::solid("", k, residual.iter().copied())]));
    }
    Figure { title: format!("{title}: identified"), panels, columns: 1 }
}

/// All of a commissioning: where the link was, how far off, the current.
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
                format!("Swap at {swapped:.2} s, verification from {verified:.2} s, home from {home:.2} s"),
                "angle (rad)",
                vec![
                    Series::solid("y", 0, at(&|tick| tick[0])),
                    Series::solid("r", 1, at(&|tick| tick[1])).styled(Style::Dashed),
                ],
                None,
            ),
            panel(String::new(), "y - r (rad)", vec![Series::solid("", 0, error)], None),
            panel(
                "From the verification on".into(),
                "y - r (rad)",
                vec![off, Series { label: "bar of the verification".into(), ..above }, below],
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
