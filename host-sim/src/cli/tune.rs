//! `host-sim tune`: bandwidths from what a drive shall do, written as a scenario.

use std::path::PathBuf;
use std::sync::Mutex;
use std::thread;

use clap::Args;
use loop_sim::port::drive::DriveDesign;
use scenario::Source;
use serde::Serialize;
use study::compare::{Bench, LOST, Lost, Worst, of_ours};
use study::map::{Subject, tolerance_percent};
use study::number::significant;
use study::tune::{Asked, Entry, Found, Job, LARGEST_RADIUS, settings, tuned};
use terminal::table::Table;

use super::{
    Console, Failure, JOINT, LEFT, ScenarioText, bad, claim_folder, failed, folder_of, free_to, status, write_new,
};
use crate::chip::cycles;
use crate::report::FIGURE;
use crate::report::plot::{Figure, GREY, Panel, Series, Style};

#[derive(Args, Debug)]
pub(super) struct TuneOptions {
    /// A scenario with [joint] or [motor]; without one that of `new --plant joint`.
    file: Option<PathBuf>,
    /// Largest noise of u by the encoders' steps, A rms [default: what the rules make: for a joint 1/1000 of the
    /// largest current, for a motor 1/100, above which host-sim design calls it too much for either].
    #[arg(long, value_name = "A")]
    noise: Option<f64>,
    /// Longest settling of a planned recovery from 0.1 rad, s, in the worst corner.
    #[arg(long, value_name = "S")]
    settling: Option<f64>,
    /// Largest error on a move of 1 rad, rad, in the worst corner.
    #[arg(long = "move", value_name = "RAD")]
    moved: Option<f64>,
    /// Largest error under a load step of 14 % of the largest torque, rad, in the worst corner.
    #[arg(long, value_name = "RAD")]
    load: Option<f64>,
    /// Most cycles that a tick may take on a Cortex-M4F, as a bound.
    #[arg(long, value_name = "N")]
    cycles: Option<u32>,
    /// How well the plant is known: the corners are those of 20 or 50 percent [default: what covers
    /// drive.uncertain_percent of the file].
    #[arg(long, value_name = "PERCENT", value_parser = ["20", "50"])]
    uncertain: Option<String>,
    /// Evaluations for each number of gain sets and each noise.
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = clap::value_parser!(u32).range(3..=100_000))]
    evaluations: u32,
    /// Seed of the search.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Override a key of the file, as in --set drive.period_s=5e-4.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// The scenario with what was found; an existing file is never overwritten [default: SCENARIO-tuned.toml].
    #[arg(short = 'o', long, value_name = "FILE")]
    to: Option<PathBuf>,
    /// Folder for pareto.svg, with the feature png also pareto.png [default: out/SCENARIO-tune].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the tables.
    #[arg(long)]
    json: bool,
}

/// What came of it.
#[derive(Serialize)]
struct Answer<'a> {
    asked: &'a Asked,
    found: Found,
    nominal: Worst,
    cycles: u32,
    /// Every number of the data sheet may be so much off, and all its corners are stable: at most the uncertainty of
    /// the plant, beyond which nothing was asked. None where a corner has no poles.
    #[serde(skip_serializing_if = "Option::is_none")]
    data_sheet_percent: Option<u32>,
    settings: Vec<(&'static str, Vec<f64>)>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct TuneJson<'a> {
    scenario: &'a str,
    #[serde(flatten)]
    answer: &'a Answer<'a>,
    missed: &'a [&'static str],
    /// Runs that come to nothing in a corner.
    #[serde(skip_serializing_if = "<[Lost]>::is_empty")]
    lost: &'a [Lost],
    pareto: Vec<ParetoJson>,
    /// Where the scenario is, if everything is met.
    #[serde(skip_serializing_if = "Option::is_none")]
    written: Option<String>,
}

#[derive(Serialize)]
struct ParetoJson {
    gain_sets: usize,
    cycles: u32,
    #[serde(flatten)]
    found: Found,
}

/// Noise of the searches around the one that is asked for.
const AROUND: [f64; 3] = [1.0 / 3.0, 1.0, 3.0];

/// The same drive with so many gain sets.
const fn with_sets(designed: &DriveDesign, sets: usize) -> DriveDesign {
    let mut designed = *designed;
    match &mut designed {
        DriveDesign::Motor { form, .. } | DriveDesign::Joint { form, .. } => form.gain_sets = sets,
    }
    designed
}

/// What is asked, from options and file.
fn asked(options: &TuneOptions, bench: &Bench, source: &Source<'_>) -> Result<Asked, Failure> {
    let TuneOptions { noise, settling, moved, load, .. } = *options;
    for (option, value) in [("noise", noise), ("settling", settling), ("move", moved), ("load", load)] {
        if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
            return Err(bad(format!("--{option} {value}: expected a number above 0")));
        }
    }
    let percent = scenario::number_at(source, "drive.uncertain_percent")?;
    Ok(Asked {
        noise_a: noise.unwrap_or_else(|| bench.noise_limits_a()[1]),
        settle_s: settling,
        move_rad: moved,
        load_rad: load,
        is_wide: match options.uncertain.as_deref() {
            Some(percent) => percent == "50",
            None => percent.is_some_and(|percent| percent > 20.0),
        },
    })
}

/// Searches for each of these: with every number of gain sets that the cycles allow.
fn jobs(options: &TuneOptions, bench: &Bench, asked: &[Asked]) -> Result<Vec<Job>, Failure> {
    let of = |sets: usize| cycles(&with_sets(&bench.designed, sets));
    let forms = [2, 1].into_iter().filter(|sets| options.cycles.is_none_or(|most| of(*sets) <= most));
    let jobs: Vec<Job> = forms.flat_map(|gain_sets| asked.iter().map(move |&asked| Job { gain_sets, asked })).collect();
    if jobs.is_empty() {
        return Err(bad(format!("--cycles: a tick of this drive takes up to {} with one gain set", of(1))));
    }
    Ok(jobs)
}

/// Of these searches the best for what is asked: of its own, or of another that has all of it too.
fn best<'a>(entries: &'a [Entry], asked: &Asked) -> Option<&'a Entry> {
    let may = |entry: &&Entry| entry.job.asked == *asked || asked.missed(&entry.found).is_empty();
    entries.iter().filter(may).min_by(|a, b| worth(asked, &a.found).total_cmp(&worth(asked, &b.found)))
}

/// The least of the noises that were tried with which all else is met, if there is one.
fn with_more_noise(entries: &[Entry], asked: &Asked) -> String {
    let met = entries.iter().filter(|entry| {
        let Entry { job, found, .. } = entry;
        job.asked.noise_a > asked.noise_a && job.asked.missed(found).is_empty()
    });
    let least = met.map(|entry| entry.job.asked.noise_a).min_by(f64::total_cmp);
    least.map_or_else(String::new, |noise_a| format!("With --noise {} it is met. ", significant(noise_a, 3)))
}

impl Console<'_> {
    pub(super) fn tune(&mut self, options: &TuneOptions) -> Result<u8, Failure> {
        let scenario = ScenarioText::read(options.file.as_deref(), JOINT)?;
        let bench = Bench::new(&scenario.file, &scenario.text, &options.sets).map_err(bad)?;
        let asked = asked(options, &bench, &scenario.source(&options.sets))?;
        let around = AROUND.map(|factor| Asked { noise_a: factor * asked.noise_a, ..asked });
        let searches = jobs(options, &bench, &around)?;
        let to = options.to.clone().unwrap_or_else(|| PathBuf::from(format!("{}-tuned.toml", bench.name)));
        free_to(&to)?;
        let text = written_into(&scenario.text, &options.sets).map_err(bad)?;
        let folder = folder_of(options.out.as_ref(), &bench.name, "tune");
        let claim = claim_folder(&folder)?;
        let Some(entries) = self.searched(&bench, &searches, options) else { return Ok(status::INTERRUPTED) };
        let best = best(&entries, &asked).ok_or_else(|| failed("no drive was found that runs at all"))?;

        // What is told is of the file, with its rounded numbers.
        let settings = settings(&best.designed);
        let tuned_text = with_settings(&text, &settings).map_err(bad)?;
        let subject = Subject { file: &to.display().to_string(), text: &tuned_text, name: &bench.name, sets: &[] };
        let experiment = subject.with(&[])?;
        let designed = experiment.drive.as_ref().map_or(best.designed, |drive| drive.designed);
        let refused = || failed("the drive that was found is refused");
        let design = of_ours(&designed).ok_or_else(refused)?;
        // Of the data sheet, as all else here; not of the plant that the file makes of it.
        let no_error = ["error={}".to_owned()];
        let answer = Answer {
            asked: &asked,
            found: Found::of(&bench, &designed, asked.is_wide, true).ok_or_else(refused)?,
            nominal: bench.nominal(&design),
            cycles: cycles(&designed),
            data_sheet_percent: tolerance_percent(&Subject { sets: &no_error, ..subject }, asked.percent()).ok(),
            settings,
        };
        let figure = pareto(&bench, &entries, &asked, &answer.found);
        let drawn = || {
            figure.write(&folder, "pareto").map_err(|error| Failure::writing(folder.join("pareto").display(), &error))
        };
        let missed = asked.missed(&answer.found);
        // What is lost is missed.
        let lost = if missed.is_empty() { Vec::new() } else { bench.lost(&design, asked.is_wide) };
        // Told before it fails: what was found took a while.
        let kept = if missed.is_empty() { write_new(&to, &tuned_text) } else { Ok(()) };
        if options.json {
            let of_entry = |entry: &Entry| ParetoJson {
                gain_sets: entry.job.gain_sets,
                cycles: cycles(&entry.designed),
                found: entry.found,
            };
            let json = TuneJson {
                scenario: &bench.name,
                answer: &answer,
                missed: &missed,
                lost: &lost,
                pareto: entries.iter().map(of_entry).collect(),
                written: (missed.is_empty() && kept.is_ok()).then(|| to.display().to_string()),
            };
            self.say_json(serde_json::to_string(&json))?;
            kept?;
            drawn()?;
            return Ok(if missed.is_empty() { status::DONE } else { status::FAILED });
        }
        self.say(&format!(
            "{}: {}: {} searches of {} evaluations, seed {}; the worst of {} corners of ±{} % of {}",
            bench.name,
            bench.title,
            searches.len(),
            options.evaluations,
            options.seed,
            answer.found.worst.corners,
            asked.percent(),
            bench.uncertain().join(", ")
        ))?;
        self.say(&answer.table(options.cycles).to_string())?;
        self.say("[drive]")?;
        for (key, values) in &answer.settings {
            self.say(&format!("{key} = {}", value_of(key, values)))?;
        }
        kept?;
        if missed.is_empty() {
            self.say(&format!("wrote {}", to.display()))?;
        }
        drawn()?;
        self.say(&format!("the other searches: {}", folder.join("pareto").with_extension(FIGURE).display()))?;
        if !missed.is_empty() {
            let within = self.within_noise(&bench, &asked, options)?;
            let told = missed.iter().map(|name| match lost.iter().find(|lost| lost.run == *name) {
                None => (*name).to_owned(),
                Some(Lost { corners, first, .. }) => {
                    // And the plant of the file.
                    let of = answer.found.worst.corners + 1;
                    format!("{name} (lost in {corners} of {of} plants, first {first})")
                }
            });
            let better = if lost.is_empty() { "" } else { "know the plant better (--uncertain 20), " };
            return Err(failed(format!(
                "not met: {}; nothing is written. {}{within}Ask for less, {}let u be noisier, or look for longer \
                 (--evaluations)",
                told.collect::<Vec<_>>().join(", "),
                with_more_noise(&entries, &asked),
                if asked.is_wide { better } else { "" }
            )));
        }
        drop(claim);
        Ok(status::DONE)
    }

    /// What can be had within the noise that is asked for, where nothing else is: that is what to ask for instead.
    fn within_noise(&mut self, bench: &Bench, asked: &Asked, options: &TuneOptions) -> Result<String, Failure> {
        let alone = Asked { settle_s: None, move_rad: None, load_rad: None, ..*asked };
        if alone == *asked {
            return Ok(String::new());
        }
        let entries = self.searched(bench, &jobs(options, bench, &[alone])?, options).unwrap_or_default();
        Ok(best(&entries, &alone).filter(|entry| alone.missed(&entry.found).is_empty()).map_or_else(
            String::new,
            |Entry { found: Found { noise_a, worst }, .. }| {
                let options = [("settling", worst.settle_s), ("move", worst.move_rad), ("load", worst.load_rad)];
                let had = options.iter().filter(|(_, value)| *value < LOST);
                let had: Vec<String> = had.map(|(name, value)| format!("--{name} {}", number(*value))).collect();
                format!("With a noise of {} there is {}. ", number(*noise_a), had.join(" "))
            },
        ))
    }

    /// All searches under a progress bar.
    fn searched(&mut self, bench: &Bench, jobs: &[Job], options: &TuneOptions) -> Option<Vec<Entry>> {
        let evaluations = options.evaluations as usize;
        let bar = self.bar((jobs.len() * evaluations) as u64, LEFT);
        let bar = Mutex::new(bar);
        let threads = thread::available_parallelism().map_or(1, usize::from);
        let entries = tuned(bench, jobs, evaluations, options.seed, threads, self.stop, &|| {
            if let Ok(bar) = bar.lock() {
                bar.inc(1);
            }
        });
        if let Ok(bar) = bar.lock() {
            bar.finish_and_clear();
        }
        entries
    }
}

/// An error or a time; a run that came to nothing has none.
fn number(value: f64) -> String {
    if value < LOST { significant(value, 3) } else { "lost".into() }
}

/// The less, the better: what misses something is worse than all that does not.
fn worth(asked: &Asked, found: &Found) -> f64 {
    found.cost() + 100.0 * asked.missed(found).len() as f64
}

fn value_of(key: &str, values: &[f64]) -> String {
    match values {
        [value] if key == "gain_sets" => (*value as i64).to_string(),
        [value] => format!("{value:?}"),
        values => format!("{values:?}"),
    }
}

/// The file with what was set besides, so that what is written is the drive that was judged.
fn written_into(text: &str, sets: &[String]) -> Result<String, String> {
    let changes: Result<Vec<_>, String> = sets
        .iter()
        .map(|set| {
            let (key, value) = set.split_once('=').ok_or_else(|| format!("--set {set}: expected KEY=VALUE"))?;
            Ok((key, Some(value)))
        })
        .collect();
    scenario::rewritten(text, changes?)
}

/// The file with these in its table `drive`, and all else as it was.
fn with_settings(text: &str, settings: &[(&'static str, Vec<f64>)]) -> Result<String, String> {
    let settings: Vec<(String, String)> =
        settings.iter().map(|(key, values)| (format!("drive.{key}"), value_of(key, values))).collect();
    let settings = settings.iter().map(|(key, value)| (key.as_str(), Some(value.as_str())));
    scenario::rewritten(text, std::iter::once(("drive.tuning", None)).chain(settings))
}

impl Answer<'_> {
    fn table(&self, most_cycles: Option<u32>) -> Table {
        let Self { asked, found, nominal, cycles, .. } = self;
        let mut table = Table::new(["figure", "asked", "nominal", "worst", ""]);
        let told = |value: Option<f64>| value.map_or_else(String::new, number);
        let asked_for = |value: Option<f64>| value.map_or_else(String::new, |value| significant(value, 3));
        let mut row = |name: &str, asked: Option<f64>, nominal: Option<f64>, worst: f64| {
            let verdict = match asked {
                _ if worst >= LOST => "NOT MET",
                Some(asked) if worst > asked => "NOT MET",
                Some(_) => "met",
                None => "",
            };
            table.row([name, &asked_for(asked), &told(nominal), &number(worst), verdict]);
        };
        let worst = &found.worst;
        row("noise of u (A rms)", Some(asked.noise_a), None, found.noise_a);
        row("settling of a recovery (s)", asked.settle_s, Some(nominal.settle_s), worst.settle_s);
        row("error on a move of 1 rad (rad)", asked.move_rad, Some(nominal.move_rad), worst.move_rad);
        row("error under a load step (rad)", asked.load_rad, Some(nominal.load_rad), worst.load_rad);
        row("error on a sine (rad rms)", None, Some(nominal.sine_rad), worst.sine_rad);
        let radius = |radius: f64| format!("{radius:.5}");
        let verdict = if worst.spectral_radius <= LARGEST_RADIUS { "met" } else { "NOT MET" };
        let [asked, nominal, worst] = [LARGEST_RADIUS, nominal.spectral_radius, worst.spectral_radius].map(radius);
        table.row(["largest |z| of a pole", &asked, &nominal, &worst, verdict]);
        if let Some(percent) = self.data_sheet_percent {
            let at_least = if percent == self.asked.percent() { ">= " } else { "" };
            let percent = format!("{at_least}{percent}");
            table.row(["stable if each number of the data sheet is off by (%)", "", "", &percent, ""]);
        }
        let most = most_cycles.map_or_else(String::new, |most| most.to_string());
        let verdict = if most.is_empty() { "" } else { "met" };
        table.row(["cycles of a tick, bound", &most, "", &cycles.to_string(), verdict]);
        table
    }
}

/// Noise of u against the worst errors, a curve for each number of gain sets, and what was taken.
fn pareto(bench: &Bench, entries: &[Entry], asked: &Asked, taken: &Found) -> Figure {
    let mut forms: Vec<usize> = entries.iter().map(|entry| entry.job.gain_sets).collect();
    forms.dedup();
    let panel = |title: &str, asked: Option<f64>, of: fn(&Worst) -> f64| {
        let mut series: Vec<Series> = forms
            .iter()
            .enumerate()
            .map(|(color, form)| {
                let of_form = entries.iter().filter(|entry| entry.job.gain_sets == *form);
                let cycles = of_form.clone().next().map_or(0, |entry| cycles(&entry.designed));
                let label = format!("{form} gain set{}, {cycles} cycles", if *form > 1 { "s" } else { "" });
                let mut points: Vec<(f64, f64)> =
                    of_form.map(|entry| (entry.found.noise_a, of(&entry.found.worst))).collect();
                points.sort_by(|a, b| a.0.total_cmp(&b.0));
                Series { has_dots: true, ..Series::solid(label, color, points) }
            })
            .collect();
        series.push(Series { has_dots: true, ..Series::solid("taken", 2, [(taken.noise_a, of(&taken.worst))]) });
        if let Some(asked) = asked {
            let ends = entries.iter().map(|entry| entry.found.noise_a);
            let (low, high) =
                ends.fold((f64::INFINITY, 0.0_f64), |(low, high), noise| (low.min(noise), high.max(noise)));
            series.push(Series::solid("asked", GREY, [(low, asked), (high, asked)]).styled(Style::Dashed));
        }
        Panel {
            title: title.into(),
            x_label: "noise of u (A rms)".into(),
            y_label: "largest error, worst corner (rad)".into(),
            series,
            is_log: true,
            ..Panel::default()
        }
    };
    Figure {
        title: format!("{}: what noise of the current buys", bench.title),
        panels: vec![
            panel("Load step", asked.load_rad, |worst| worst.load_rad),
            panel("Move of 1 rad", asked.move_rad, |worst| worst.move_rad),
        ],
        columns: 2,
    }
}
