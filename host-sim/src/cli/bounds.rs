//! `host-sim bounds`: guaranteed bounds on σ\*, the estimation errors, the output and u.
//!
//! For each bound it prints the cause, the ratio to a simulated run, and the gain that lowers the bound.

use std::path::PathBuf;

use clap::Args;
use loop_sim::trace::{Ending, Trace};
use scenario::Experiment;
use study::Watch;
use study::bounds::{Advice, Bounds, Knob, Quantity, loop_of};
use study::figures::{order_of_sigma, rad_per_s};
use study::map::Subject;
use study::number::{significant, typed};
use terminal::table::Table;

use super::design::noise_name;
use super::run::note_changes;
use super::{Console, DEFAULT, Failure, ScenarioText, claim_folder, failed, folder_of, status};
use crate::report::page::Section;
use crate::report::plot::{Figure, GREY, Panel, Series, Style};

#[derive(Args, Debug)]
pub(super) struct BoundsOptions {
    /// Scenario file [default: built-in joint of the paper].
    file: Option<PathBuf>,
    /// Override a key of the scenario; repeatable. Example: --set drive.period_s=5e-4 for a motor or joint, --set
    /// controller.k_l=20 for other plants.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Output folder of bounds.svg, with the feature png also bounds.png [default: out/SCENARIO-bounds].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON instead of the tables.
    #[arg(long)]
    json: bool,
}

/// Returns the unit in parentheses, as ` (rad/s^2)`; empty if it is unknown.
fn unit(experiment: &Experiment, quantity: Quantity) -> String {
    let Experiment { output_unit, control_unit, drive, .. } = experiment;
    let order = match (quantity, drive) {
        (Quantity::Output | Quantity::Control, _) => 0,
        (Quantity::SigmaStar, _) => order_of_sigma(experiment),
        (Quantity::EstimationError(_), Some(_)) => 2,
        (Quantity::EstimationError(i), None) => i + 1,
    };
    match (quantity, *output_unit, order) {
        (Quantity::Control, ..) if !control_unit.is_empty() => format!(" ({control_unit})"),
        (Quantity::Control, ..) | (_, "", _) => String::new(),
        (Quantity::Output, unit, _) => format!(" ({unit})"),
        (.., order) => format!(" ({})", rad_per_s(order)),
    }
}

fn table(found: &Bounds, experiment: &Experiment) -> Table {
    let [from, to] = found.window_s;
    let names = found.names.iter().zip(&found.quantities);
    let names = names.map(|(name, quantity)| format!("|{name}|{}", unit(experiment, *quantity)));
    let header = ["cause".to_owned()].into_iter().chain(names).chain(["basis".into()]);
    let mut table = Table::new(header);
    let number = |value: f64| if value.is_nan() { "-".into() } else { significant(value, 4) };
    let mut row = |name: &str, cells: Vec<String>, by: &str| {
        table.row([name.to_owned()].into_iter().chain(cells).chain([by.to_owned()]));
    };
    for part in &found.parts {
        row(&part.name, part.bounds.iter().map(|bound| number(*bound)).collect(), &part.known);
    }
    row("total", found.bounds.iter().map(|bound| number(*bound)).collect(), "sampled loop");
    let run = format!("largest over [{}, {}] s of the run", typed(from, 6), typed(to, 6));
    row("simulated", found.simulated.iter().map(|value| number(*value)).collect(), &run);
    let ratio = |(bound, value): (&f64, &f64)| if *value > 0.0 { significant(bound / value, 3) } else { "-".into() };
    row("bound / simulated", found.bounds.iter().zip(&found.simulated).map(ratio).collect(), "conservatism");
    if found.continuous.iter().any(Option::is_some) {
        let cells = found.continuous.iter().map(|value| value.map_or("-".into(), number)).collect();
        row("continuous", cells, "continuous loop of the paper, without sampling, quantisation and rounding");
    }
    table
}

fn gains(found: &Bounds, experiment: &Experiment) -> Table {
    let names = found.names.iter().map(|name| format!("|{name}|"));
    let header = ["gain".to_owned()].into_iter().chain(names).chain([noise_name(experiment.control_unit).into()]);
    let mut table = Table::new(header);
    let cell = |value: f64| if value.is_finite() { format!("{:+.2}", value + 0.0) } else { "-".into() };
    for Knob { name, elasticities, noise_of_u, .. } in &found.knobs {
        let cells = elasticities.iter().chain([noise_of_u]).map(|value| cell(*value));
        table.row([name.clone()].into_iter().chain(cells));
    }
    table
}

/// Returns a line for each bound: its largest cause, and the gain that lowers it.
///
/// `|sigma*|: 83 % of the bound comes from the magnitude of d_2. k_l +10 % lowers it by 9 %, with 4 % more noise of u:
/// --set controller.k_l=55`
fn sentences(found: &Bounds, experiment: &Experiment) -> Vec<String> {
    let noise = noise_name(experiment.control_unit);
    let percent = |share: f64| significant(100.0 * share, 2);
    let sentence = |i: usize| {
        let part = found.parts.iter().max_by(|a, b| a.bounds[i].total_cmp(&b.bounds[i]))?;
        let by = match part.derivatives.get(i) {
            Some(0) => "the magnitude of ".to_owned(),
            Some(m) => format!("derivative {m} of "),
            None => String::new(),
        };
        let share = percent(part.bounds[i] / found.bounds[i]);
        let words = format!("|{}|: {share} % of the bound comes from {by}{}. ", found.names[i], part.name);
        let advice = found.advice[i].as_ref().map_or_else(
            || "No 10 % gain change lowers it by 1 % or more.".to_owned(),
            |Advice { set, gain, change, bound, noise_of_u }| {
                format!(
                    "{gain} {:+.0} % lowers it by {} %, with {} % {} {noise}: --set {}",
                    100.0 * change,
                    percent(-bound),
                    percent(noise_of_u.abs()),
                    if *noise_of_u > 0.0 { "more" } else { "less" },
                    if set.contains(['[', '{']) { format!("'{set}'") } else { set.clone() },
                )
            },
        );
        Some(words + &advice)
    };
    (0..found.names.len()).filter_map(sentence).collect()
}

fn figure(found: &Bounds, experiment: &Experiment, trace: &Trace) -> Figure {
    let [from, to] = found.window_s;
    let panels = found.quantities.iter().enumerate().map(|(i, quantity)| {
        let name = &found.names[i];
        let rows = trace.rows.iter().filter(|row| row.t_s >= from && row.t_s <= to);
        let run = rows.map(|row| (row.t_s, found.value(*quantity, trace, row)));
        let line = |value: f64| [(from, value), (to, value)];
        let bound = found.bounds[i];
        Panel {
            title: format!(
                "{name}: bound {}, {} times the simulated maximum",
                significant(bound, 3),
                significant(bound / found.simulated[i], 3)
            ),
            x_label: "t (s)".into(),
            y_label: format!("{name}{}", unit(experiment, *quantity)),
            series: vec![
                Series::solid("bound", GREY, line(bound)).styled(Style::Dashed),
                Series::solid("", GREY, line(-bound)).styled(Style::Dashed),
                Series::solid("simulated", 0, run),
            ],
            ..Panel::default()
        }
    });
    Figure { title: experiment.title.clone(), panels: panels.collect(), columns: 2 }
}

/// Returns the section `Bounds` of a report. Without bounds it contains the reason.
pub(super) fn section(experiment: &Experiment, trace: &Trace, subject: &Subject<'_>) -> Section {
    let (says, tables, figures) = match study::bounds(experiment, trace, subject, Watch::none()) {
        Ok(found) => {
            let found = found.iter();
            (
                found
                    .clone()
                    .flat_map(|found| sentences(found, experiment).into_iter().chain(found.remarks.clone()))
                    .collect(),
                found.clone().flat_map(|found| [table(found, experiment), gains(found, experiment)]).collect(),
                found.map(|found| figure(found, experiment, trace)).collect(),
            )
        }
        Err(why) => (vec![why.to_string()], Vec::new(), Vec::new()),
    };
    Section { heading: "Bounds".into(), says, tables, figures, ..Section::default() }
}

impl Console<'_> {
    pub(super) fn bounds(&mut self, options: &BoundsOptions) -> Result<u8, Failure> {
        let text = ScenarioText::read(options.file.as_deref(), DEFAULT)?;
        let subject = text.subject(&options.sets);
        let mut experiment = subject.with(&[])?;
        note_changes(&mut experiment.title, &options.sets);
        // Checked before the run: an unstable loop and a loop without matrices have no bounds.
        loop_of(&experiment)?;
        let folder = folder_of(options.out.as_ref(), &experiment.name, "bounds");
        let claim = claim_folder(&folder)?;
        let (trace, error) = self.watched(&mut experiment, &mut None);
        match trace.ending {
            Ending::Interrupted { .. } => return Ok(status::INTERRUPTED),
            Ending::Finished => {}
            Ending::Diverged { t_s } | Ending::BrokenOff { t_s } => {
                let why = error.map_or("the state diverged".into(), |error| error.to_string());
                let message = format!("the run ended at t = {} s: {why}; no bound applies", significant(t_s, 4));
                return Err(failed(message));
            }
        }
        let watch = Watch::new(self.stop, &|| ());
        let Some(found) = study::bounds(&experiment, &trace, &subject, watch)? else { return Ok(status::INTERRUPTED) };
        let drawn = || {
            let told = |error| Failure::writing(folder.join("bounds").display(), &error);
            figure(&found, &experiment, &trace).write(&folder, "bounds").map_err(told)
        };
        if options.json {
            self.say_json(serde_json::to_string(&found))?;
            drawn()?;
            return Ok(status::DONE);
        }
        self.say(&experiment.headline())?;
        self.say(&table(&found, &experiment).to_string())?;
        self.say("relative sensitivity, d ln(bound)/d ln(gain), for unchanged disturbances:")?;
        self.say(&gains(&found, &experiment).to_string())?;
        for line in sentences(&found, &experiment).iter().chain(&found.remarks) {
            self.say(line)?;
        }
        drawn()?;
        self.say(&format!("files: {}", folder.display()))?;
        drop(claim);
        Ok(status::DONE)
    }
}
