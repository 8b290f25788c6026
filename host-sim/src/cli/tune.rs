//! `host-sim tune`: bandwidths from what a drive shall do, written as a scenario.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use study::Watch;
use study::compare::{Bench, LOST, Lost, Worst};
use study::map::Subject;
use study::number::significant;
use study::tune::{Answer, Asked, Effort, Found, LARGEST_RADIUS, Limits, value_of, within_noise};
use terminal::table::Table;

use super::{Console, Failure, JOINT, LEFT, ScenarioText, claim_folder, failed, folder_of, free_to, status, write_new};
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

/// What `--json` prints.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    answer: &'a Answer,
    /// Where the scenario is, if everything is met.
    #[serde(skip_serializing_if = "Option::is_none")]
    written: Option<String>,
}

impl TuneOptions {
    fn limits(&self) -> Limits {
        Limits {
            noise_a: self.noise,
            settle_s: self.settling,
            move_rad: self.moved,
            load_rad: self.load,
            is_wide: self.uncertain.as_deref().map(|percent| percent == "50"),
        }
    }

    const fn effort(&self) -> Effort {
        Effort { evaluations: self.evaluations as usize, seed: self.seed, most_cycles: self.cycles }
    }
}

impl Console<'_> {
    pub(super) fn tune(&mut self, options: &TuneOptions) -> Result<u8, Failure> {
        let scenario = ScenarioText::read(options.file.as_deref(), JOINT)?;
        let bench = Bench::new(&scenario.file, &scenario.text, &options.sets)?;
        let asked = Asked::new(&bench, &options.limits())?;
        let to = options.to.clone().unwrap_or_else(|| PathBuf::from(format!("{}-tuned.toml", bench.name)));
        free_to(&to)?;
        let folder = folder_of(options.out.as_ref(), &bench.name, "tune");
        let claim = claim_folder(&folder)?;
        let file = to.display().to_string();
        let subject = Subject { file: &file, text: &scenario.text, name: &bench.name, sets: &options.sets };
        let evaluations = u64::from(options.evaluations);
        let bar = self.bar(study::tune::searches_of(&bench, &asked, options.effort())? as u64 * evaluations, LEFT);
        let found = study::tune(&bench, &subject, &asked, options.effort(), Watch::new(self.stop, &|| bar.inc(1)));
        bar.finish_and_clear();
        let Some(answer) = found? else { return Ok(status::INTERRUPTED) };
        let figure = pareto(&bench.title, &answer);
        let drawn = || {
            figure.write(&folder, "pareto").map_err(|error| Failure::writing(folder.join("pareto").display(), &error))
        };
        let is_met = answer.missed.is_empty();
        // Told before it fails: what was found took a while.
        let kept = if is_met { write_new(&to, &answer.text) } else { Ok(()) };
        if options.json {
            let written = (is_met && kept.is_ok()).then_some(file);
            self.say_json(serde_json::to_string(&Written { answer: &answer, written }))?;
            kept?;
            drawn()?;
            return Ok(if is_met { status::DONE } else { status::FAILED });
        }
        self.tell_tuned(&bench, &answer, options)?;
        kept?;
        if is_met {
            self.say(&format!("wrote {file}"))?;
        }
        drawn()?;
        self.say(&format!("the other searches: {}", folder.join("pareto").with_extension(FIGURE).display()))?;
        drop(claim);
        if is_met { Ok(status::DONE) } else { Err(self.not_met(&bench, &answer, options)?) }
    }

    fn tell_tuned(&mut self, bench: &Bench, answer: &Answer, options: &TuneOptions) -> Result<(), Failure> {
        self.say(&format!(
            "{}: {}: {} searches of {} evaluations, seed {}; the worst of {} corners of ±{} % of {}",
            bench.name,
            bench.title,
            answer.searches,
            options.evaluations,
            options.seed,
            answer.found.worst.corners,
            answer.asked.percent(),
            bench.uncertain().join(", ")
        ))?;
        self.say(&table(answer, options.cycles).to_string())?;
        self.say("[drive]")?;
        for (key, values) in &answer.settings {
            self.say(&format!("{key} = {}", value_of(key, values)))?;
        }
        Ok(())
    }

    /// What is missed, and what to ask for instead.
    fn not_met(&mut self, bench: &Bench, answer: &Answer, options: &TuneOptions) -> Result<Failure, Failure> {
        let Answer { asked, lost, .. } = answer;
        let bar = self.bar(2 * u64::from(options.evaluations), LEFT);
        let within = within_noise(bench, asked, options.effort(), Watch::new(self.stop, &|| bar.inc(1)));
        bar.finish_and_clear();
        let within = within?.map_or_else(String::new, |Found { noise_a, worst }| {
            let options = [("settling", worst.settle_s), ("move", worst.move_rad), ("load", worst.load_rad)];
            let had = options.iter().filter(|(_, value)| *value < LOST);
            let had: Vec<String> = had.map(|(name, value)| format!("--{name} {}", number(*value))).collect();
            format!("With a noise of {} there is {}. ", number(noise_a), had.join(" "))
        });
        let told = answer.missed.iter().map(|name| match lost.iter().find(|lost| lost.run == *name) {
            None => (*name).to_owned(),
            Some(Lost { corners, first, .. }) => {
                // And the plant of the file.
                let of = answer.found.worst.corners + 1;
                format!("{name} (lost in {corners} of {of} plants, first {first})")
            }
        });
        let more = answer
            .met_with_noise_a
            .map_or_else(String::new, |noise_a| format!("With --noise {} it is met. ", significant(noise_a, 3)));
        let better = if lost.is_empty() { "" } else { "know the plant better (--uncertain 20), " };
        Ok(failed(format!(
            "not met: {}; nothing is written. {more}{within}Ask for less, {}let u be noisier, or look for longer \
             (--evaluations)",
            told.collect::<Vec<_>>().join(", "),
            if asked.is_wide { better } else { "" }
        )))
    }
}

/// An error or a time; a run that came to nothing has none.
fn number(value: f64) -> String {
    if value < LOST { significant(value, 3) } else { "lost".into() }
}

fn table(answer: &Answer, most_cycles: Option<u32>) -> Table {
    let Answer { asked, found, nominal, cycles, .. } = answer;
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
    if let Some(percent) = answer.data_sheet_percent {
        let at_least = if percent == answer.asked.percent() { ">= " } else { "" };
        let percent = format!("{at_least}{percent}");
        table.row(["stable if each number of the data sheet is off by (%)", "", "", &percent, ""]);
    }
    let most = most_cycles.map_or_else(String::new, |most| most.to_string());
    let verdict = if most.is_empty() { "" } else { "met" };
    table.row(["cycles of a tick, bound", &most, "", &cycles.to_string(), verdict]);
    table
}

/// Noise of u against the worst errors, a curve for each number of gain sets, and what was taken.
fn pareto(title: &str, answer: &Answer) -> Figure {
    let Answer { asked, found: taken, pareto: tried, .. } = answer;
    let mut forms: Vec<usize> = tried.iter().map(|tried| tried.gain_sets).collect();
    forms.dedup();
    let panel = |title: &str, asked: Option<f64>, of: fn(&Worst) -> f64| {
        let mut series: Vec<Series> = forms
            .iter()
            .enumerate()
            .map(|(color, form)| {
                let of_form = tried.iter().filter(|tried| tried.gain_sets == *form);
                let cycles = of_form.clone().next().map_or(0, |tried| tried.cycles);
                let label = format!("{form} gain set{}, {cycles} cycles", if *form > 1 { "s" } else { "" });
                let mut points: Vec<(f64, f64)> =
                    of_form.map(|tried| (tried.found.noise_a, of(&tried.found.worst))).collect();
                points.sort_by(|a, b| a.0.total_cmp(&b.0));
                Series { has_dots: true, ..Series::solid(label, color, points) }
            })
            .collect();
        series.push(Series { has_dots: true, ..Series::solid("taken", 2, [(taken.noise_a, of(&taken.worst))]) });
        if let Some(asked) = asked {
            let ends = tried.iter().map(|tried| tried.found.noise_a);
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
        title: format!("{title}: what noise of the current buys"),
        panels: vec![
            panel("Load step", asked.load_rad, |worst| worst.load_rad),
            panel("Move of 1 rad", asked.move_rad, |worst| worst.move_rad),
        ],
        columns: 2,
    }
}
