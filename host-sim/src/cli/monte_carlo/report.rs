//! Result of a Monte Carlo run as text, JSON and figures: percentiles, failure rate with its bound, worst trials.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::Path;

use serde::Serialize;
use serde_json::Value as Json;
use study::monte_carlo::statistics::{self, NAMES, PER_MILLE};
use study::monte_carlo::{Outcome, vary};
use study::number::significant;
use terminal::table::Table;
use whole_file::FileKind;

use super::{ENDED, ReportOptions, quoted};
use crate::cli::map::number;
use crate::cli::{Console, Failure, bad, read_text};
use crate::report::page::Section;
use crate::report::plot::{Figure, GREY, Panel, Series};
use crate::report::{FIGURE, write_whole};
use crate::store::{Header, Trials};

/// Confidence of the upper bound of the failure rate.
const CONFIDENCE: f64 = 0.95;
/// Settling time; not a number for a run that never settled.
const SETTLING: &str = "metrics.settling_time_s";
/// Number of worst trials in the output.
const WORST: usize = 10;
/// Largest number of dots of a scatter plot: more would hide each other.
const DOTS: usize = 800;
const BINS: usize = 50;
/// Largest number of panels of a figure.
const PANELS: usize = 9;

/// Evaluation that the options request, as columns of the trials.
pub(super) struct Question {
    /// Column that ranks the worst trials.
    worst: usize,
    /// Columns with their upper limits.
    at_most: Vec<(usize, f64)>,
    /// Columns to plot: metrics as histograms, keys as x axes of scatter plots.
    draw: Vec<usize>,
}

impl Question {
    pub(super) fn new(header: &Header, options: &ReportOptions) -> Result<Self, String> {
        let column = |what: &str, name: &str| {
            header.columns.iter().position(|known| known == name).ok_or_else(|| {
                // A name that was cut short matches the column that begins with it.
                let distance = |known: &&String| (!known.starts_with(name), strsim::damerau_levenshtein(known, name));
                let nearest = header.columns.iter().min_by_key(distance);
                format!("{what} {name}: no such metric or key; nearest is {}", nearest.map_or("", String::as_str))
            })
        };
        let usual = ["metrics.error_ultimate", "metrics.y_ultimate"];
        let usual = usual.into_iter().find(|name| header.columns.iter().any(|known| known == name));
        let worst = column("--worst", options.worst.as_deref().or(usual).unwrap_or(ENDED))?;
        let at_most = options.at_most.iter().map(|text| {
            let pair = text.split_once('=').and_then(|(name, value)| Some((name.trim(), value.trim().parse().ok()?)));
            let pair = pair.filter(|(_, value): &(_, f64)| value.is_finite());
            let (name, value) =
                pair.ok_or_else(|| format!("--at-most {text}: expected METRIC=VALUE, a finite number"))?;
            Ok((column("--at-most", name)?, value))
        });
        let draw = options.draw.iter().map(|name| column("--draw", name)).collect::<Result<_, _>>()?;
        Ok(Self { worst, at_most: at_most.collect::<Result<_, String>>()?, draw })
    }

    /// Returns whether column `k` of `columns` is plotted. By default the first columns are.
    fn draws(&self, k: usize, mut columns: Range<usize>, drawn: &Drawn) -> bool {
        if columns.any(|column| self.draw.contains(&column)) {
            self.draw.contains(&k)
        } else {
            drawn.panels.len() < PANELS
        }
    }
}

/// Panels of a figure, and the columns without a panel.
#[derive(Default)]
struct Drawn {
    panels: Vec<Panel>,
    left_out: Vec<String>,
}

impl Drawn {
    fn remark(&self, picture: &str, what: &str) -> Option<String> {
        let Self { panels, left_out } = self;
        (!left_out.is_empty()).then(|| {
            let all = panels.len() + left_out.len();
            format!(
                "{picture}: {} of {all} {what}; --draw NAME with --resume plots the others: {}",
                panels.len(),
                left_out.join(", ")
            )
        })
    }
}

#[derive(Serialize)]
struct Failures {
    count: u64,
    rate: f64,
    /// Upper bound of the true rate with 95 % confidence; `None` for draws that are not random.
    #[serde(skip_serializing_if = "Option::is_none")]
    rate_below: Option<f64>,
    /// Number of finished trials that never settled: with a limit of u an unstable loop may oscillate forever.
    unsettled: usize,
}

/// Percentiles of a column; not a number in trials that ended earlier.
#[derive(Serialize)]
struct Percentiles {
    of_file: Option<f64>,
    #[serde(flatten)]
    ranks: BTreeMap<&'static str, f64>,
    least: f64,
    no_number: usize,
}

#[derive(Serialize)]
struct WorstTrial {
    trial: u64,
    outcome: &'static str,
    figure: f64,
    drawn: BTreeMap<String, Json>,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    header: &'a Header,
    outcomes: BTreeMap<&'static str, usize>,
    /// Upper limits of metrics.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    at_most: BTreeMap<&'a str, f64>,
    failures: Failures,
    percentiles: BTreeMap<&'a str, Percentiles>,
    worst_by: &'a str,
    worst: Vec<WorstTrial>,
}

fn count_unsettled(settling: &[f64], outcomes: &[Outcome]) -> usize {
    let never = |(settling, outcome): &(&f64, &Outcome)| **outcome == Outcome::Finished && settling.is_nan();
    settling.iter().zip(outcomes).filter(never).count()
}

/// Returns the label of a key with its words, as `drive.tuning (1 quiet, 2 normal)`.
fn with_words(name: &str, words: Option<&Vec<String>>) -> String {
    let Some(words) = words else { return name.into() };
    let each: Vec<String> = (1..).zip(words).map(|(k, word)| format!("{k} {word}")).collect();
    format!("{name} ({})", each.join(", "))
}

/// Returns the worst trials, worst first: failed trials, then by the ranking metric. A value that is not a number ranks
/// as the largest.
fn worst_of(figure: &[f64], outcomes: &[Outcome]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..figure.len()).collect();
    let badness =
        |k: usize| (outcomes[k] != Outcome::Finished, if figure[k].is_nan() { f64::INFINITY } else { figure[k] });
    let worse = |a: &usize, b: &usize| {
        let (a_failed, a_value) = badness(*a);
        let (b_failed, b_value) = badness(*b);
        b_failed.cmp(&a_failed).then(b_value.total_cmp(&a_value)).then(a.cmp(b))
    };
    let count = WORST.min(order.len());
    if count < order.len() {
        order.select_nth_unstable_by(count, worse);
    }
    order.truncate(count);
    order.sort_by(worse);
    order
}

/// Returns for each trial whether it did not finish or exceeds a limit.
fn failures(trials: &Trials, question: &Question, outcomes: &[Outcome]) -> Result<Vec<bool>, Failure> {
    let mut failed: Vec<bool> = outcomes.iter().map(|outcome| *outcome != Outcome::Finished).collect();
    for (k, limit) in &question.at_most {
        for (failed, value) in failed.iter_mut().zip(trials.column(*k).map_err(bad)?) {
            // A value that is not a number meets no limit.
            *failed |= value.is_nan() || value > *limit;
        }
    }
    Ok(failed)
}

fn unsettled(count: usize) -> String {
    format!(
        "{count} finished trials never settled within settling_band: --at-most {SETTLING}=SECONDS counts them as \
         failures"
    )
}

fn of(value: &Json) -> String {
    number(value.as_f64().unwrap_or(f64::NAN))
}

/// Result of one pass over the columns of the trials.
#[derive(Default)]
struct Columns<'a> {
    percentiles: BTreeMap<&'a str, Percentiles>,
    /// Drawn values of each of the worst trials.
    drawn: Vec<BTreeMap<String, Json>>,
    /// Histograms of metrics.
    bars: Drawn,
    /// Scatter plots of the ranking metric over the keys.
    dots: Drawn,
    unsettled: usize,
}

/// Ranking of the trials: the column of the ranking metric, and the worst trials, worst first.
struct Ranked {
    figure: Vec<f64>,
    worst: Vec<usize>,
}

impl<'a> Columns<'a> {
    /// Evaluates the columns one by one, so that one column is in memory at a time.
    fn of(trials: &'a Trials, question: &Question, outcomes: &[Outcome], ranked: &Ranked) -> Result<Self, String> {
        let header = &trials.header;
        let mut columns = Self { drawn: vec![BTreeMap::new(); ranked.worst.len()], ..Self::default() };
        let keys = keys_of(header);
        for (k, name) in header.columns.iter().enumerate() {
            let mut values = trials.column(k)?;
            if k < keys {
                columns.add_key(header, question, (k, &values), outcomes, ranked);
            }
            if name == SETTLING {
                columns.unsettled = count_unsettled(&values, outcomes);
            }
            statistics::sort(&mut values);
            // The end time of a trial is plotted only if --draw names it.
            if (k > keys || (k == keys && question.draw.contains(&k)))
                && let Some(panel) = histogram(name, header.units.get(name), &values)
            {
                if question.draws(k, keys..header.columns.len(), &columns.bars) {
                    columns.bars.panels.push(panel);
                } else {
                    columns.bars.left_out.push(name.clone());
                }
            }
            let no_number = values.iter().filter(|value| value.is_nan()).count();
            let ranks = NAMES.into_iter().zip(PER_MILLE.map(|p| statistics::percentile(&values, p))).collect();
            let least = values.first().copied().unwrap_or(f64::NAN);
            let of_file = header.of_file.get(name).and_then(|text| text.parse().ok());
            columns.percentiles.insert(name, Percentiles { of_file, ranks, least, no_number });
        }
        Ok(columns)
    }

    /// Adds a drawn key: its values in the worst trials, and its scatter plot.
    fn add_key(
        &mut self,
        header: &Header,
        question: &Question,
        (k, values): (usize, &[f64]),
        outcomes: &[Outcome],
        ranked: &Ranked,
    ) {
        let name = &header.columns[k];
        let words = header.vary.get(k).and_then(|text| vary::words(text));
        let told = |value: f64| match words.as_ref().and_then(|words| words.get((value as usize).checked_sub(1)?)) {
            Some(word) => Json::from(word.as_str()),
            None => Json::from(value),
        };
        for (drawn, row) in self.drawn.iter_mut().zip(&ranked.worst) {
            drawn.insert(name.clone(), told(values[*row]));
        }
        if question.draws(k, 0..keys_of(header), &self.dots) {
            let labels = [&with_words(name, words.as_ref()), &header.label(&header.columns[question.worst])];
            let dots = scatter(labels.map(String::as_str), values, &ranked.figure, outcomes, &ranked.worst);
            self.dots.panels.push(dots);
        } else {
            self.dots.left_out.push(name.clone());
        }
    }
}

/// Returns the number of drawn keys; their columns are the first.
fn keys_of(header: &Header) -> usize {
    header.columns.iter().position(|name| name == ENDED).unwrap_or(0)
}

impl<'a> Report<'a> {
    /// Builds the report; `count` is the number of failures.
    fn of(
        header: &'a Header,
        question: &Question,
        outcomes: &[Outcome],
        ranked: &Ranked,
        count: u64,
        columns: Columns<'a>,
    ) -> Self {
        let is_random = !header.vary.iter().any(|text| vary::is_sobol(text));
        let worst = ranked.worst.iter().zip(columns.drawn).map(|(&k, drawn)| WorstTrial {
            trial: k as u64,
            outcome: outcomes[k].word(),
            figure: ranked.figure[k],
            drawn,
        });
        Self {
            header,
            outcomes: Outcome::ALL
                .map(|outcome| (outcome.word(), outcomes.iter().filter(|of| **of == outcome).count()))
                .into_iter()
                .filter(|(_, count)| *count > 0)
                .collect(),
            at_most: question.at_most.iter().map(|(k, limit)| (header.columns[*k].as_str(), *limit)).collect(),
            failures: Failures {
                count,
                rate: count as f64 / header.trials as f64,
                rate_below: is_random.then(|| statistics::largest_rate(count, header.trials, CONFIDENCE)),
                unsettled: columns.unsettled,
            },
            percentiles: columns.percentiles,
            worst_by: &header.columns[question.worst],
            worst: worst.collect(),
        }
    }
}

impl Console<'_> {
    /// Writes and prints the report. Returns the first trial without a design, and whether a limit was exceeded.
    pub(super) fn tell_trials(
        &mut self,
        trials: &Trials,
        question: &Question,
        folder: &Path,
        file: &str,
        is_json: bool,
    ) -> Result<(Option<u64>, bool), Failure> {
        let header = &trials.header;
        let outcomes = trials.outcomes().map_err(bad)?;
        let failed = failures(trials, question, &outcomes)?;
        let figure = trials.column(question.worst).map_err(bad)?;
        let ranked = Ranked { worst: worst_of(&figure, &outcomes), figure };
        let mut columns = Columns::of(trials, question, &outcomes, &ranked).map_err(bad)?;
        let [bars, dots] = [&mut columns.bars, &mut columns.dots].map(std::mem::take);
        let count = failed.iter().filter(|failed| **failed).count() as u64;
        let report = Report::of(header, question, &outcomes, &ranked, count, columns);

        let json = serde_json::to_string(&report);
        let text = json.as_deref().unwrap_or_default();
        let kept = write_whole(&folder.join("monte-carlo.json"), |out| writeln!(out, "{text}"))
            .map_err(|error| Failure::writing(folder.join("monte-carlo.json").display(), &error));
        let left_out = [
            bars.remark(&format!("histograms.{FIGURE}"), "metrics that vary"),
            dots.remark(&format!("scatter.{FIGURE}"), "keys drawn"),
        ];
        // Printed before a failed write is reported: the trials took minutes.
        if is_json {
            self.say_json(json)?;
        } else {
            self.tell(&report, keys_of(header), file, !question.at_most.is_empty())?;
            for line in left_out.iter().flatten() {
                self.say(line)?;
            }
        }
        kept?;
        write_pictures(folder, header, report.worst_by, [bars.panels, dots.panels])?;
        if !is_json {
            self.say(&format!("files: {}", folder.display()))?;
            let limits = if question.at_most.is_empty() { "" } else { " or exceeded a limit" };
            self.say(&format!("result: {count} of {} trials failed{limits}", header.trials))?;
        }
        let refused = (0..).zip(outcomes).find_map(|(i, outcome)| (outcome == Outcome::Refused).then_some(i));
        Ok((refused, count > 0 && !question.at_most.is_empty()))
    }

    fn tell(&mut self, report: &Report<'_>, drawn: usize, file: &str, has_bar: bool) -> Result<(), Failure> {
        let Report { header, outcomes, failures, percentiles, worst_by, worst, .. } = report;
        let outcomes: Vec<String> = outcomes.iter().map(|(word, count)| format!("{count} {word}")).collect();
        self.say(&format!("{} trials, seed {}: {}", header.trials, header.seed, outcomes.join(", ")))?;
        let below = failures.rate_below.map_or_else(
            || "; no bound of the true rate: a Sobol sequence is not random".into(),
            |below| format!("; the true rate is below {} % with 95 % confidence", significant(100.0 * below, 3)),
        );
        let Failures { count, rate, .. } = failures;
        self.say(&format!("failures: {count}, {} %{below}", significant(100.0 * rate, 3)))?;
        if !has_bar {
            self.say(
                "a failure is a trial that did not end as `finished`; --at-most METRIC=VALUE also counts trials above \
                 VALUE",
            )?;
        }
        if failures.unsettled > 0 {
            self.say(&unsettled(failures.unsettled))?;
        }
        let mut table = Table::new(["metric", "file"].into_iter().chain(NAMES));
        for name in &header.columns[drawn + 1..] {
            let Some(of) = percentiles.get(name.as_str()) else { continue };
            let most = of.ranks["max"];
            // A metric that is constant or never available is left out.
            let is_told = of.no_number < header.trials as usize && of.least != most;
            if is_told || name == worst_by {
                let values = NAMES.iter().map(|name| number(of.ranks[name]));
                let of_file = number(of.of_file.unwrap_or(f64::NAN));
                table.row([header.label(name), of_file].into_iter().chain(values));
            }
        }
        self.say(&table.to_string())?;
        let names = &header.columns[..drawn];
        let by = header.label(worst_by);
        let mut table = Table::new(["trial", "outcome", &by].into_iter().chain(names.iter().map(String::as_str)));
        for trial in worst {
            let told = |value: &Json| value.as_str().map_or_else(|| of(value), ToOwned::to_owned);
            let values = names.iter().map(|name| told(trial.drawn.get(name).unwrap_or(&Json::Null)));
            let head = [trial.trial.to_string(), trial.outcome.to_owned(), number(trial.figure)];
            table.row(head.into_iter().chain(values));
        }
        self.say(&format!("worst trials:\n{table}"))?;
        let words = header.sets.iter().map(|set| ("--set", set)).chain(header.vary.iter().map(|vary| ("--vary", vary)));
        let words = words.map(|(option, word)| format!(" {option} {}", quoted(word))).collect::<Vec<_>>().concat();
        let trial = worst.first().map_or(0, |worst| worst.trial);
        self.say(&format!(
            "to rerun a trial with figures: host-sim monte-carlo{file} --trials {} --seed {}{words} --replay {trial}",
            header.trials, header.seed
        ))
    }
}

/// Result of a Monte Carlo run, read from its output folder for a report.
pub(in crate::cli) struct Written {
    pub(in crate::cli) scenario: String,
    /// SHA-256 of the text of the scenario file.
    pub(in crate::cli) sha256: String,
    /// `KEY=VALUE` settings of all trials.
    pub(in crate::cli) sets: Vec<String>,
    pub(in crate::cli) section: Section,
}

/// Reads the section of a report from an output folder.
pub(in crate::cli) fn section(folder: &Path) -> Result<Written, Failure> {
    let file = folder.join("monte-carlo.json");
    let read = |name: &str| read_text(&folder.join(name), FileKind::REPORT);
    let json: Json = serde_json::from_str(&read("monte-carlo.json")?)
        .map_err(|error| bad(format!("{}: {error}", file.display())))?;
    let none = || bad(format!("{}: not an output of host-sim monte-carlo", file.display()));
    let scenario = json["scenario"].as_str().ok_or_else(none)?.to_owned();
    let percentiles = json["percentiles"].as_object().ok_or_else(none)?;
    let mut table = Table::new(["metric", "file"].into_iter().chain(NAMES));
    for (name, of_figure) in percentiles.iter().filter(|(_, of_figure)| of_figure["least"] != of_figure["max"]) {
        let values = NAMES.iter().map(|rank| of(&of_figure[*rank]));
        let unit = json["units"][name].as_str().map_or_else(String::new, |unit| format!(" ({unit})"));
        table.row([format!("{name}{unit}"), of(&of_figure["of_file"])].into_iter().chain(values));
    }
    let outcomes = json["outcomes"].as_object().ok_or_else(none)?.iter().map(|(word, count)| format!("{count} {word}"));
    let mut says =
        vec![format!("{} trials, seed {}: {}", json["trials"], json["seed"], outcomes.collect::<Vec<_>>().join(", "))];
    let failures = &json["failures"];
    let below = failures["rate_below"].as_f64();
    let below = below.map_or_else(String::new, |rate| {
        format!("; the true rate is below {} % with 95 % confidence", significant(100.0 * rate, 3))
    });
    says.push(format!("failures: {}{below}", failures["count"]));
    let bars = json["at_most"].as_object().into_iter().flatten().map(|(name, limit)| format!("{name} above {limit}"));
    let bars = bars.collect::<Vec<_>>().join(", ");
    says.extend((!bars.is_empty()).then(|| format!("also a failure: {bars}")));
    says.extend(failures["unsettled"].as_u64().filter(|count| *count > 0).map(|count| unsettled(count as usize)));
    let words = |of: &str| json[of].as_array().into_iter().flatten().filter_map(Json::as_str).collect::<Vec<_>>();
    says.push(format!("drawn: {}", words("vary").join("; ")));
    let sets = words("sets");
    says.extend((!sets.is_empty()).then(|| format!("set for all: {}", sets.join(", "))));
    let drawings = ["histograms.svg", "scatter.svg"].into_iter().filter_map(|name| read(name).ok());
    let section = Section {
        heading: "Monte Carlo".into(),
        says,
        tables: vec![table],
        drawings: drawings.collect(),
        ..Section::default()
    };
    let sha256 = json["scenario_sha256"].as_str().ok_or_else(none)?.to_owned();
    Ok(Written { scenario, sha256, sets: sets.into_iter().map(ToOwned::to_owned).collect(), section })
}

/// Writes the histograms and scatter plots that have a panel.
fn write_pictures(folder: &Path, header: &Header, by: &str, [bars, dots]: [Vec<Panel>; 2]) -> Result<(), Failure> {
    let title = |what: &str| format!("{}: {what}, {} trials, seed {}", header.scenario, header.trials, header.seed);
    for (stem, title, panels) in
        [("histograms", title("metrics"), bars), ("scatter", title(&format!("{by} over the drawn keys")), dots)]
    {
        let columns = panels.len().min(3);
        if columns > 0 {
            let figure = Figure { title, panels, columns };
            let written = figure.write(folder, stem);
            written.map_err(|error| Failure::writing(folder.join(stem).display(), &error))?;
        } else {
            // A figure of an earlier plan does not belong to this one.
            for kind in ["png", "svg"] {
                let _ = fs::remove_file(folder.join(stem).with_extension(kind));
            }
        }
    }
    Ok(())
}

/// Returns the histogram of sorted values; over their logarithms if they span more than two decades.
fn histogram(name: &str, unit: Option<&String>, sorted: &[f64]) -> Option<Panel> {
    let finite: Vec<f64> = sorted.iter().copied().filter(|value| value.is_finite()).collect();
    let (least, most) = (*finite.first()?, *finite.last()?);
    let is_log = least > 0.0 && most > 100.0 * least;
    let values: Vec<f64> = finite.iter().map(|value| if is_log { libm::log10(*value) } else { *value }).collect();
    let (bins, width) = statistics::histogram(&values, BINS)?;
    let end = bins.last().map(|(left, _)| (left + width, 0.0));
    let begin = bins.first().map(|(left, _)| (*left, 0.0));
    let points = begin.into_iter().chain(bins.iter().map(|(left, count)| (*left, *count as f64))).chain(end);
    Some(Panel {
        x_label: match (is_log, unit) {
            (false, None) => name.into(),
            (false, Some(unit)) => format!("{name} ({unit})"),
            (true, None) => format!("log10 of {name}"),
            (true, Some(unit)) => format!("log10 of {name} in {unit}"),
        },
        y_label: "trials".into(),
        series: vec![Series { is_held: true, ..Series::solid("", 0, points) }],
        ..Panel::default()
    })
}

/// Returns a scatter plot: a sample of the finished trials, the failed trials at the top, and the worst trials.
fn scatter([name, by]: [&str; 2], x: &[f64], y: &[f64], outcomes: &[Outcome], worst: &[usize]) -> Panel {
    let stride = x.len().div_ceil(DOTS).max(1);
    let finite = || y.iter().copied().filter(|y| y.is_finite());
    let (least, top) = (finite().fold(f64::INFINITY, f64::min), finite().fold(0.0, f64::max));
    // On a linear axis of more than two decades the good trials would form one line.
    let is_log = least > 0.0 && top > 100.0 * least;
    let height = |y: f64| if is_log { libm::log10(y) } else { y };
    // A gap after each point keeps the dots unconnected.
    let dotted = |label: &str, color: usize, of: &mut dyn Iterator<Item = usize>| {
        let place = |k: usize| (x[k], height(if y[k].is_finite() { y[k] } else { top }));
        let points = of.flat_map(|k| [place(k), (f64::NAN, f64::NAN)]).collect();
        Series { label: label.into(), color, points, has_dots: true, ..Series::default() }
    };
    let failed = |k: &usize| outcomes[*k] != Outcome::Finished;
    let mut series = vec![dotted("finished", GREY, &mut (0..x.len()).step_by(stride).filter(|k| !failed(k)))];
    if outcomes.iter().any(|outcome| *outcome != Outcome::Finished) {
        series.push(dotted("failed", 1, &mut (0..x.len()).filter(failed).take(DOTS)));
    }
    series.push(dotted("worst", 0, &mut worst.iter().copied()));
    let y_label = if is_log { format!("log10 of {by}") } else { by.into() };
    Panel { x_label: name.into(), y_label, series, ..Panel::default() }
}
