//! `host-sim tune`: tunes the bandwidths of a drive to a specification and writes the tuned scenario.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::Args;
use serde::Serialize;
use study::Watch;
use study::compare::{Bench, LOST, Lost, Worst};
use study::design::LEAST_PHASE_DEG;
use study::gain_sets::{GainSet, WorstCorner};
use study::map::Subject;
use study::margins::LeastDamped;
use study::number::significant;
use study::tune::{Answer, Effort, Found, LARGEST_RADIUS, Limits, Specification, value_of, within_noise};
use terminal::table::Table;

use super::{Console, Failure, JOINT, LEFT, ScenarioText, claim_folder, failed, folder_of, free_to, status, write_new};
use crate::report::FIGURE;
use crate::report::plot::{Figure, GREY, Panel, Series, Style};

#[derive(Args, Debug)]
pub(super) struct TuneOptions {
    /// Scenario with [joint] or [motor] [default: template of new --plant joint].
    file: Option<PathBuf>,
    /// Maximum current noise from encoder quantisation, A rms [default: 1/1000 of max_current_a for
    /// a joint, 1/100 for a motor, as the design rules]. Above 1/100 host-sim design reports too much noise.
    #[arg(long, value_name = "A")]
    noise: Option<f64>,
    /// Maximum settling time of a planned recovery in the worst corner, s. It starts at 0.1 rad, with an encoder before
    /// a gear nearer.
    #[arg(long, value_name = "S")]
    settling: Option<f64>,
    /// Maximum error during a move of 1 rad in the worst corner, rad.
    #[arg(long = "move", value_name = "RAD")]
    moved: Option<f64>,
    /// Maximum error under a load step of 14 % of the largest torque in the worst corner, rad.
    #[arg(long, value_name = "RAD")]
    load: Option<f64>,
    /// Minimum phase margin of every gain set with the data sheet, degrees.
    #[arg(long, value_name = "DEG")]
    phase: Option<f64>,
    /// Maximum peak of |S| of every gain set in the worst corner of drive.uncertain_percent, as design prints it.
    #[arg(long, value_name = "PEAK")]
    sensitivity: Option<f64>,
    /// Maximum WCET bound of a tick on a Cortex-M4F, cycles.
    #[arg(long, value_name = "N")]
    cycles: Option<u32>,
    /// Tolerance of the plant parameters that defines the corners, percent [default: the value that covers
    /// drive.uncertain_percent of the file].
    #[arg(long, value_name = "PERCENT", value_parser = ["20", "50"])]
    uncertain: Option<String>,
    /// Evaluations of the cost for each number of gain sets and each noise limit.
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = clap::value_parser!(u32).range(3..=100_000))]
    evaluations: u32,
    /// Seed of the search.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Override a key of the scenario; repeatable. Example: --set drive.period_s=5e-4.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Output file of the tuned scenario; an existing file is never overwritten [default: NAME-tuned.toml, with the
    /// `name` of the scenario].
    #[arg(short = 'o', long, value_name = "FILE")]
    to: Option<PathBuf>,
    /// Output folder of pareto.svg, with the feature png also pareto.png [default: out/SCENARIO-tune].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON instead of the tables.
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    answer: &'a Answer,
    /// Path of the tuned scenario, if the specification is met.
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
            phase_deg: self.phase,
            sensitivity_peak: self.sensitivity,
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
        let specification = Specification::new(&bench, &options.limits())?;
        let to = options.to.clone().unwrap_or_else(|| PathBuf::from(format!("{}-tuned.toml", bench.name)));
        free_to(&to)?;
        let folder = folder_of(options.out.as_ref(), &bench.name, "tune");
        let claim = claim_folder(&folder)?;
        let file = to.display().to_string();
        let subject = Subject { file: &file, text: &scenario.text, name: &bench.name, sets: &options.sets };
        let evaluations = u64::from(options.evaluations);
        let bar =
            self.bar(study::tune::searches_of(&bench, &specification, options.effort())? as u64 * evaluations, LEFT);
        let found =
            study::tune(&bench, &subject, &specification, options.effort(), Watch::new(self.stop, &|| bar.inc(1)));
        bar.finish_and_clear();
        let Some(answer) = found? else { return Ok(status::INTERRUPTED) };
        let figure = pareto(&bench.title, &answer);
        let drawn = || {
            figure.write(&folder, "pareto").map_err(|error| Failure::writing(folder.join("pareto").display(), &error))
        };
        let is_met = answer.missed.is_empty();
        // The result is printed before a failed write is reported: the search took minutes.
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
        self.say(&format!("figure of all searches: {}", folder.join("pareto").with_extension(FIGURE).display()))?;
        drop(claim);
        if is_met {
            self.say("result: specification met")?;
            return Ok(status::DONE);
        }
        let failure = self.not_met(&bench, &answer, options)?;
        self.say(&format!("result: specification NOT MET: {}", answer.missed.join(", ")))?;
        Err(failure)
    }

    fn tell_tuned(&mut self, bench: &Bench, answer: &Answer, options: &TuneOptions) -> Result<(), Failure> {
        self.say(&format!(
            "{}: {}: {} searches of {} evaluations, seed {}; recovery from {} rad; worst of {} corners of ±{} % of {}",
            bench.name,
            bench.title,
            answer.searches,
            options.evaluations,
            options.seed,
            significant(bench.start_rad, 3),
            answer.found.worst.corners,
            answer.specification.percent(),
            bench.uncertain().join(", ")
        ))?;
        self.say(&table(answer, options.cycles).to_string())?;
        for Lost { run, corners, first } in &answer.stopped {
            self.say(&format!(
                "warning: {run}: the monitors stop the drive in {corners} of {} plants, first: {first}. The table is \
                 without monitors; drive.uncertain_percent = {} sets them for this tolerance",
                answer.found.worst.corners + 1,
                answer.specification.percent()
            ))?;
        }
        if let Some(small) = answer.gain_sets.first().and_then(small_margins) {
            self.say(&format!(
                "warning: small margins: {small}. Search with --phase {LEAST_PHASE_DEG} --sensitivity {}, or keep the \
                 gains by rule",
                scenario::CORNER_PEAK
            ))?;
        }
        if let Some(why) = answer.refused_by_export.as_ref() {
            self.say(&format!("warning: export rejects the tuned file: {why}"))?;
        }
        self.say("[drive]")?;
        for (key, values) in &answer.settings {
            self.say(&format!("{key} = {}", value_of(key, values)))?;
        }
        Ok(())
    }

    /// Returns the failure: the limits that are not met, and a specification that can be met.
    fn not_met(&mut self, bench: &Bench, answer: &Answer, options: &TuneOptions) -> Result<Failure, Failure> {
        let Answer { specification, lost, .. } = answer;
        let bar = self.bar(2 * u64::from(options.evaluations), LEFT);
        let within = within_noise(bench, specification, options.effort(), Watch::new(self.stop, &|| bar.inc(1)));
        bar.finish_and_clear();
        let has_errors =
            [specification.settle_s, specification.move_rad, specification.load_rad].iter().any(Option::is_some);
        // A search that was stopped has found nothing out.
        let none = if has_errors && !self.stop.load(Ordering::Relaxed) {
            "Even without limits of the errors the search finds no gains within noise and margins. "
        } else {
            ""
        };
        let within = within?.map_or_else(
            || none.into(),
            |Found { noise_a, worst, .. }| {
                let options = [("settling", worst.settle_s), ("move", worst.move_rad), ("load", worst.load_rad)];
                let had = options.iter().filter(|(_, value)| *value < LOST);
                let had: Vec<String> = had.map(|(name, value)| format!("--{name} {}", number(*value))).collect();
                format!(
                    "Without limits the search ends, at {} A of current noise, with {}. ",
                    number(noise_a),
                    had.join(" ")
                )
            },
        );
        let told = answer.missed.iter().map(|name| match lost.iter().find(|lost| lost.run == *name) {
            None => (*name).to_owned(),
            Some(Lost { corners, first, .. }) => {
                // The corners and the nominal plant.
                let of = answer.found.worst.corners + 1;
                format!("{name} (lost in {corners} of {of} plants, first: {first})")
            }
        });
        let more = answer
            .met_with_noise_a
            .map_or_else(String::new, |noise_a| format!("--noise {} meets it. ", significant(noise_a, 3)));
        let better = if lost.is_empty() { "" } else { "narrow the tolerance (--uncertain 20), " };
        Ok(failed(format!(
            "not met: {}; no file written. {more}{within}Relax the specification, {}allow more current noise, or raise \
             --evaluations",
            told.collect::<Vec<_>>().join(", "),
            if specification.is_wide { better } else { "" }
        )))
    }
}

/// Returns the margins of a gain set below those of the rules, in words. `None` if they are sufficient.
fn small_margins(set: &GainSet) -> Option<String> {
    let phase_deg = set.margins.and_then(|margins| margins.phase_deg).filter(|phase| *phase < LEAST_PHASE_DEG);
    let phase = phase_deg.map(|phase| format!("phase margin {} deg", significant(phase, 3)));
    let worst =
        set.worst.as_ref().filter(|worst| worst.sensitivity_peak.is_none_or(|peak| peak > scenario::CORNER_PEAK));
    let peak = worst.map(|WorstCorner { name, sensitivity_peak }| match sensitivity_peak {
        Some(peak) => format!("peak |S| {} with {name}", significant(*peak, 3)),
        None => format!("unstable with {name}"),
    });
    let told: Vec<String> = phase.into_iter().chain(peak).collect();
    (!told.is_empty()).then(|| told.join(", "))
}

/// Formats an error or a time; `lost` for a run that did not settle.
fn number(value: f64) -> String {
    if value < LOST { significant(value, 3) } else { "lost".into() }
}

fn table(answer: &Answer, most_cycles: Option<u32>) -> Table {
    let Answer { specification, found, nominal, cycles, .. } = answer;
    let mut table = Table::new(["metric", "limit", "nominal", "worst corner", ""]);
    let told = |value: Option<f64>| value.map_or_else(String::new, number);
    let asked_for = |value: Option<f64>| value.map_or_else(String::new, |value| significant(value, 3));
    let mut row = |name: &str, limit: Option<f64>, nominal: Option<f64>, worst: f64| {
        let verdict = match limit {
            _ if worst >= LOST => "NOT MET",
            Some(limit) if worst > limit => "NOT MET",
            Some(_) => "met",
            None => "",
        };
        table.row([name, &asked_for(limit), &told(nominal), &number(worst), verdict]);
    };
    let worst = &found.worst;
    row("current noise (A rms)", Some(specification.noise_a), None, found.noise_a);
    row("settling time of a recovery (s)", specification.settle_s, Some(nominal.settle_s), worst.settle_s);
    row("largest error during a move of 1 rad (rad)", specification.move_rad, Some(nominal.move_rad), worst.move_rad);
    row("largest error under a load step (rad)", specification.load_rad, Some(nominal.load_rad), worst.load_rad);
    row("rms error on a sine (rad)", None, Some(nominal.sine_rad), worst.sine_rad);
    let radius = |radius: f64| format!("{radius:.5}");
    let verdict = if worst.spectral_radius <= LARGEST_RADIUS { "met" } else { "NOT MET" };
    let [limit, nominal, worst] = [LARGEST_RADIUS, nominal.spectral_radius, worst.spectral_radius].map(radius);
    table.row(["spectral radius", &limit, &nominal, &worst, verdict]);
    if let Some(percent) = answer.data_sheet_percent {
        let at_least = if percent == answer.specification.percent() { ">= " } else { "" };
        let percent = format!("{at_least}{percent}");
        table.row(["tolerance of all data sheet values (%)", "", "", &percent, ""]);
    }
    for GainSet { name, margins, worst, .. } in &answer.gain_sets {
        let verdict = |limit: Option<f64>, is_met: bool| match limit {
            None => "",
            Some(_) if is_met => "met",
            Some(_) => "NOT MET",
        };
        let phase_deg = margins.map_or(Some(0.0), |margins| margins.phase_deg);
        let phase = phase_deg.map_or_else(|| "unlimited".into(), |phase| significant(phase, 3));
        let limit = specification.phase_deg;
        let is_met = verdict(limit, phase_deg.is_none_or(|phase| limit.is_none_or(|limit| phase >= limit)));
        table.row([&*format!("phase margin, {name} gains (deg)"), &asked_for(limit), &phase, "", is_met]);

        let peak = |peak: Option<f64>| peak.map_or_else(|| "UNSTABLE".into(), |peak| significant(peak, 3));
        let nominal = peak(margins.map(|margins| margins.sensitivity_peak));
        let largest = worst.as_ref().map_or_else(String::new, |worst| peak(worst.sensitivity_peak));
        let limit = specification.sensitivity_peak;
        let largest_peak = worst.as_ref().map_or(0.0, |worst| worst.sensitivity_peak.unwrap_or(f64::INFINITY));
        let is_met = verdict(limit, limit.is_none_or(|limit| largest_peak <= limit));
        table.row([&*format!("peak |S|, {name} gains"), &asked_for(limit), &nominal, &largest, is_met]);
    }
    if let Some(LeastDamped { damping_ratio, .. }) = &answer.least_damped {
        table.row(["least damping ratio", "", "", &significant(*damping_ratio, 3), ""]);
    }
    let most = most_cycles.map_or_else(String::new, |most| most.to_string());
    let verdict = if most.is_empty() { "" } else { "met" };
    table.row(["WCET bound of a tick (cycles)", &most, "", &cycles.to_string(), verdict]);
    table
}

/// Returns the figure of the worst errors over the current noise: a curve per number of gain sets, and the result.
fn pareto(title: &str, answer: &Answer) -> Figure {
    let Answer { specification, found: taken, pareto: tried, .. } = answer;
    let mut forms: Vec<usize> = tried.iter().map(|tried| tried.gain_sets).collect();
    forms.dedup();
    let panel = |title: &str, limit: Option<f64>, of: fn(&Worst) -> f64| {
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
        series.push(Series { has_dots: true, ..Series::solid("result", 2, [(taken.noise_a, of(&taken.worst))]) });
        if let Some(limit) = limit {
            let ends = tried.iter().map(|tried| tried.found.noise_a);
            let (low, high) =
                ends.fold((f64::INFINITY, 0.0_f64), |(low, high), noise| (low.min(noise), high.max(noise)));
            series.push(Series::solid("limit", GREY, [(low, limit), (high, limit)]).styled(Style::Dashed));
        }
        Panel {
            title: title.into(),
            x_label: "current noise (A rms)".into(),
            y_label: "largest error, worst corner (rad)".into(),
            series,
            is_log: true,
            ..Panel::default()
        }
    };
    Figure {
        title: format!("{title}: largest error over current noise"),
        panels: vec![
            panel("Load step", specification.load_rad, |worst| worst.load_rad),
            panel("Move of 1 rad", specification.move_rad, |worst| worst.move_rad),
        ],
        columns: 2,
    }
}
