//! `host-sim design`: prints the closed loop of a scenario, the limits that bind, and a better design.

use std::path::PathBuf;

use clap::Args;
use scenario::Experiment;
use study::design::{AskedPoles, Bound, ClosedLoop, Design, LEAST_PHASE_DEG, Limit, Noise, Suggested};
use study::gain_sets::{GainSet, MarginPrice, WorstCorner};
use study::margins::{LeastDamped, Margins, Root, UnstableCorner};
use study::number::significant;
use study::range::{Covered, End};
use terminal::table::Table;

use super::export::refuse_without_limits;
use super::run::note_changes;
use super::{Console, Failure, RunOptions, scenario_of, status};

#[derive(Args, Debug)]
pub(super) struct DesignOptions {
    /// Scenario file [default: built-in joint of the paper].
    file: Option<PathBuf>,
    /// Override a key of the scenario; repeatable. Example: --set drive.surface_rad_s=100.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Print JSON instead of the table.
    #[arg(long)]
    json: bool,
    /// Accept a controller without limits of u.
    #[arg(long)]
    no_limits: bool,
}

/// Share of a limit above which `run` prints the suggested design. A rule uses 100 % within rounding.
const MUCH: f64 = 1.02;

impl Console<'_> {
    pub(super) fn design(&mut self, options: &DesignOptions) -> Result<u8, Failure> {
        let DesignOptions { file, sets, json, no_limits } = options;
        let of_run = RunOptions { sets: sets.clone(), ..RunOptions::default() };
        let mut experiment = scenario_of(file.as_deref(), &of_run)?;
        // The readings for the figures have no limits, as in the paper.
        if !no_limits && experiment.figures_only.is_none() {
            let name =
                file.as_deref().map_or_else(|| "built-in default.toml".into(), |file| file.display().to_string());
            refuse_without_limits(&experiment, &name)?;
        }
        note_changes(&mut experiment.title, sets);
        let design = study::design(&experiment)?;
        if *json {
            self.say_json(serde_json::to_string(&design))?;
        } else {
            self.say(text(&design, &experiment).trim_end())?;
        }
        Ok(status::DONE)
    }
}

fn number(value: f64) -> String {
    significant(value, 3)
}

fn percent(share: f64) -> String {
    significant(100.0 * share, 2)
}

/// Returns the name of the noise in u of this unit: an u in ampere is a current.
pub(super) fn noise_name(control_unit: &str) -> &'static str {
    if control_unit == "A" { "current noise" } else { "noise of u" }
}

/// Formats a spectral radius: six decimals near 1, where stability is decided.
fn radius(value: f64) -> String {
    if (value - 1.0).abs() < 0.01 { format!("{value:.6}") } else { significant(value, 4) }
}

fn factor_down(factor: f64) -> String {
    if factor < 1e-6 { "0".into() } else { number(factor) }
}

/// Formats the closed loop as one line.
fn line(got: &ClosedLoop) -> String {
    let Some(margins) = &got.margins else {
        return format!("UNSTABLE, spectral radius {} per tick", radius(got.spectral_radius));
    };
    format!("{}, slowest pole {} 1/s", margins_in_words(margins), number(got.decay_per_s))
}

fn margins_in_words(margins: &Margins) -> String {
    let Margins { phase_deg, delay_s, gain_up, gain_down, sensitivity_peak, .. } = *margins;
    let phase = phase_deg.map_or_else(|| "unlimited".into(), |phase| format!("{} deg", number(phase)));
    let delay = delay_s.map_or_else(|| "unlimited".into(), |delay| format!("{} ms", number(1e3 * delay)));
    let up = gain_up.map_or_else(|| "unlimited".into(), number);
    format!(
        "phase margin {phase}, delay margin {delay}, gain margin {} to {up}, peak sensitivity {}",
        factor_down(gain_down),
        number(sensitivity_peak)
    )
}

/// Returns the lines that `run` prints of the design.
pub(super) fn short(design: &Design) -> Vec<String> {
    let mut lines = vec![format!("stability (linearised at rest): {}", line(&design.got))];
    if let (Some(_), Some(limit)) = (&design.got.margins, design.limits.first()) {
        let used = percent(limit.used);
        lines.push(format!("limiting factor: {}, {used} % used; details: host-sim design", limit.what));
    }
    // The rule may exceed the margins of the loop that results.
    let is_too_much = !design.got.is_stable() || design.limits.first().is_some_and(|limit| limit.used > MUCH);
    if let Some(Suggested { lines: other, why, .. }) = design.suggested.as_ref().filter(|it| is_too_much && !it.is_same)
    {
        let keys: Vec<&str> = other.iter().map(|[_, line]| line.split("  #").next().unwrap_or(line)).collect();
        let table = other.first().map_or("", |[table, _]| table);
        lines.push(format!("suggested: {table} {}: {why}", keys.join(", ")));
    }
    lines
}

/// Formats the slowest poles: `-5.00 (3 times), -0.200 +- 3.10 i`. In f64 equal poles form a small ring.
fn listed(poles: &[Root], most: usize) -> String {
    let mut groups: Vec<(Root, usize)> = Vec::new();
    for pole in poles.iter().filter(|pole| pole.im >= 0.0) {
        let size = libm::hypot(pole.re, pole.im);
        let is_near = |known: &Root| libm::hypot(known.re - pole.re, known.im - pole.im) < 0.02 * size;
        let flat = Root { im: if pole.im < 0.02 * size { 0.0 } else { pole.im }, ..*pole };
        let weight = if flat.im == 0.0 && pole.im > 0.0 { 2 } else { 1 };
        match groups.iter_mut().find(|(known, _)| is_near(known)) {
            Some((_, times)) => *times += weight,
            None => groups.push((flat, weight)),
        }
    }
    let shown = groups.iter().take(most).map(|(Root { re, im }, times)| {
        let pole = if *im > 0.0 { format!("{} +- {} i", number(*re), number(*im)) } else { number(*re) };
        if *times > 1 { format!("{pole} ({times} times)") } else { pole }
    });
    shown.collect::<Vec<_>>().join(", ")
}

/// Formats the slowest three poles that last longer than a tick.
fn slow(poles: &[Root], period_s: f64) -> String {
    let slow: Vec<Root> = poles.iter().copied().filter(|pole| pole.re * period_s > -3.0).collect();
    listed(&slow, 3)
}

fn text(design: &Design, experiment: &Experiment) -> String {
    let mut head = format!("{}: {}\n{}", experiment.name, experiment.title, table(design, experiment));
    for table in [gain_sets(design), prices(design)].into_iter().flatten() {
        head = format!("{head}\n{table}");
    }
    if !design.gain_sets.is_empty() {
        head += "\n";
    }
    remarks(design, experiment).into_iter().fold(head, |text, line| text + &line + "\n")
}

/// Returns the lines below the table.
pub(super) fn remarks(design: &Design, experiment: &Experiment) -> Vec<String> {
    let mut lines = Vec::new();
    let mut add = |line: String| lines.push(line);
    if !design.left_out.is_empty() {
        add(format!("not in this analysis: {}", design.left_out.join(", ")));
    }
    for (k, Limit { what, used, meaning }) in design.limits.iter().enumerate() {
        let head = if k == 0 { "limiting factor: " } else { "           then: " };
        add(format!("{head}{what}, {} % used: {meaning}", percent(*used)));
    }
    corners(design, &mut add);
    let is_joint = experiment.drive.as_ref().is_some_and(|drive| drive.designed.is_whole());
    let is_weak = |set: &GainSet| set.worst.as_ref().is_some_and(|worst| worst.sensitivity_peak.is_none());
    if is_joint && design.gain_sets.get(1).is_some_and(is_weak) {
        add("the high gains are unstable in a corner if they stay on; the drive limits their time (docs/joints.md)"
            .into());
    }
    guarantee(design).into_iter().for_each(&mut add);
    for warning in &experiment.warnings {
        add(format!("warning: {warning}"));
    }
    match &design.suggested {
        None if experiment.drive.is_none() => {
            add(format!(
                "no suggestion: no rule reaches {LEAST_PHASE_DEG} deg of phase margin with this plant and period"
            ));
        }
        None if experiment.drive.as_ref().is_some_and(|drive| drive.is_slowed_by_play) => {
            add("no suggestion: the play behind the gear limits the bandwidth".into());
        }
        None => add(String::from(
            "no suggestion: no rule is better, down to an eighth of this period. `host-sim tune` searches further; a \
             drive that is unstable in a corner needs a smaller drive.uncertain_percent",
        )),
        Some(Suggested { lines, why, got, is_same }) => {
            add(format!("suggested: {why}"));
            let mut last = "";
            for [table, entry] in lines {
                if last != table {
                    add(table.clone());
                }
                last = table;
                add(entry.clone());
            }
            add(format!("# result: {}", line(got)));
            // A sound design may be faster than the suggested one.
            if !is_same && design.got.is_stable() && design.limits.first().is_some_and(|limit| limit.used <= MUCH) {
                add(format!("# this file: {}", line(&design.got)));
            }
        }
    }
    lines
}

/// Largest number of unstable corners that are listed.
const MOST_NAMED: usize = 4;

fn corners(design: &Design, line: &mut impl FnMut(String)) {
    let ClosedLoop { corners, unstable_corners: unstable, .. } = &design.got;
    if *corners > 0 {
        let words = match unstable.len() {
            0 if design.gain_sets.len() > 1 => "all stable with the base gains".into(),
            0 => "all stable".into(),
            count => format!("{count} UNSTABLE, worst first:"),
        };
        let of = if design.inertia_range.is_some() { "the ends of the inertia and drive" } else { "drive" };
        line(format!("{corners} corners of {of}.uncertain_percent: {words}"));
    }
    if let (Some(LeastDamped { corner, damping_ratio, frequency_rad_s }), [], true) =
        (&design.got.least_damped, &unstable[..], *corners > 0)
    {
        let place = if corner.is_empty() { "the plant of this file" } else { corner };
        let (ratio, at) = (number(*damping_ratio), number(*frequency_rad_s));
        line(format!("least damping ratio {ratio}, of a pole at {at} rad/s, with {place}"));
    }
    for UnstableCorner { name, spectral_radius } in unstable.iter().take(MOST_NAMED) {
        line(format!("    {name}: spectral radius {}", radius(*spectral_radius)));
    }
    for words in design.inertia_range.iter().flat_map(inertia_in_words) {
        line(words);
    }
}

/// Returns the table of gain sets, each one frozen, nominal and in its worst corner. `None` without gain sets.
fn gain_sets(design: &Design) -> Option<Table> {
    let mut table = Table::new([
        "gain set",
        "peak |S|",
        "phase margin, deg",
        "delay margin, ms",
        "gain margin",
        "10 % load moves, mrad",
        "peak |S|, worst corner",
        "worst corner",
    ]);
    for GainSet { name, margins, deflection_rad, worst } in &design.gain_sets {
        let [corner, which] = match worst {
            Some(WorstCorner { name, sensitivity_peak }) => {
                [sensitivity_peak.map_or_else(|| "UNSTABLE".into(), number), name.clone()]
            }
            None => [String::new(), String::new()],
        };
        let figures = margins.as_ref().map_or_else(
            || ["UNSTABLE".to_owned(), String::new(), String::new(), String::new()],
            |it| {
                let or_any = |value: Option<f64>| value.map_or_else(|| "any".to_owned(), number);
                [
                    number(it.sensitivity_peak),
                    or_any(it.phase_deg),
                    or_any(it.delay_s.map(|delay_s| 1e3 * delay_s)),
                    format!("{} to {}", factor_down(it.gain_down), or_any(it.gain_up)),
                ]
            },
        );
        let [peak, phase, delay, gain] = &figures;
        let way = deflection_rad.map(|rad| number(1e3 * rad)).unwrap_or_default();
        table.row([*name, peak, phase, delay, gain, &way, &corner, &which]);
    }
    (!design.gain_sets.is_empty()).then_some(table)
}

/// Returns the table of other margins and their cost. `None` for other plants than a motor.
fn prices(design: &Design) -> Option<Table> {
    let mut table = Table::new([
        "margin",
        "peak |S|: base",
        "high",
        "worst corner: base",
        "high",
        "current noise, A",
        "10 % load moves, mrad",
    ]);
    for MarginPrice { margin, sets, noise_a } in &design.prices {
        let name = margin.map_or_else(|| "this file".into(), |margin| format!("{margin:?}"));
        let peaks = [0, 1].map(|k| {
            let or_unstable = |peak: Option<f64>| peak.map_or_else(|| "unstable".into(), number);
            sets.get(k).map_or_else(Default::default, |set| {
                let corner = set.worst.as_ref().map(|worst| or_unstable(worst.sensitivity_peak)).unwrap_or_default();
                [or_unstable(set.margins.map(|margins| margins.sensitivity_peak)), corner]
            })
        });
        let [[base, base_corner], [high, high_corner]] = &peaks;
        let noise = noise_a.map(number).unwrap_or_default();
        let way = sets.last().and_then(|set| set.deflection_rad).map(|rad| number(1e3 * rad)).unwrap_or_default();
        table.row([name.as_str(), base, high, base_corner, high_corner, &noise, &way]);
    }
    (!design.prices.is_empty()).then_some(table)
}

/// Returns the margins that the peak of |S| guarantees.
fn guarantee(design: &Design) -> Option<String> {
    let peaks = design.gain_sets.iter().map(|set| Some(set.margins?.sensitivity_peak));
    let peak = peaks.collect::<Option<Vec<f64>>>()?.into_iter().reduce(f64::max)?;
    Some(format!(
        "the largest peak |S| with this plant, {}, guarantees {} deg of phase margin and an upper gain margin of {}",
        number(peak),
        number(2.0 * libm::asin(0.5 / peak).to_degrees()),
        number(peak / (peak - 1.0))
    ))
}

/// Returns the lines on a range of inertia: covered part and margins at its ends.
fn inertia_in_words(covered: &Covered) -> Vec<String> {
    let Covered { designed_for_kg_m2, ends } = covered;
    let [low, high] = ends;
    let [from, to] = [low.inertia_kg_m2, high.inertia_kg_m2].map(number);
    let head =
        format!("inertia {from} to {to} kg m^2, designed for the geometric mean {}", number(*designed_for_kg_m2));
    let left: Vec<String> = [low, high]
        .into_iter()
        .filter(|end| !end.is_covered())
        .map(|end| {
            let side = if end.inertia_kg_m2 > *designed_for_kg_m2 { "above" } else { "below" };
            let times = (end.stable_to_kg_m2 / designed_for_kg_m2).ln().abs().exp();
            format!("{side} {} (a factor of {} is stable)", number(end.stable_to_kg_m2), number(times))
        })
        .collect();
    let verdict =
        if left.is_empty() { "stable over all of it".into() } else { format!("NOT COVERED {}", left.join(", ")) };
    let of_end = |end: &End| {
        let words = end.margins.as_ref().map_or_else(|| "unstable".into(), margins_in_words);
        format!("    at {} kg m^2: {words}", number(end.inertia_kg_m2))
    };
    let is_small = |end: &&&End| end.margins.is_some_and(|margins| margins.sensitivity_peak > scenario::CORNER_PEAK);
    let small = [low, high].iter().filter(is_small).map(|end| number(end.inertia_kg_m2)).collect::<Vec<_>>();
    let warning = (!small.is_empty()).then(|| {
        format!(
            "    warning: small margins at {} kg m^2, peak |S| above {}: narrow the range, or set drive.margin = \
             \"standard\"",
            small.join(" and "),
            scenario::CORNER_PEAK
        )
    });
    [format!("{head}: {verdict}"), of_end(low), of_end(high)].into_iter().chain(warning).collect()
}

pub(super) fn table(design: &Design, experiment: &Experiment) -> Table {
    let mut table = Table::new(["quantity", "value", "unit", "meaning"]);
    let mut row = |name: &str, value: String, unit: &str, meaning: &str| table.row([name, &value, unit, meaning]);
    for AskedPoles { name, poles, meaning } in &design.asked {
        row(&format!("design: {name}"), listed(poles, 4), "rad/s", meaning);
    }
    let ClosedLoop { spectral_radius, decay_per_s, poles, margins, .. } = &design.got;
    row("design: decay rate", number(design.decay_asked_per_s), "1/s", "slowest design pole without alpha");
    row("decay rate", number(*decay_per_s), "1/s", "slowest pole of the closed loop");
    row("poles", slow(poles, design.period_s), "rad/s", "slowest three of the closed loop, ln(z)/T");
    let Some(margins) = margins else {
        row("UNSTABLE", radius(*spectral_radius), "", "spectral radius per tick; an unstable loop has no margins");
        return table;
    };
    let or = |value: Option<f64>, none: &str| value.map_or_else(|| none.to_owned(), number);
    let Margins { crossover_rad_s, phase_deg, phase_rad_s, delay_s, gain_up, gain_down, sensitivity_peak, peak_rad_s } =
        *margins;
    row(
        "crossover",
        or(crossover_rad_s, "none"),
        "rad/s",
        "highest frequency of loop gain 1, opened at the plant input",
    );
    let at = phase_rad_s.map_or_else(String::new, |omega| format!(", at {} rad/s", number(omega)));
    row(
        "phase margin",
        or(phase_deg, "unlimited"),
        "deg",
        &format!("smallest phase above -180 deg at loop gain 1{at}"),
    );
    let ticks = delay_s.map_or_else(String::new, |delay| format!(", {} ticks", number(delay / design.period_s)));
    row(
        "delay margin",
        or(delay_s.map(|delay| 1e3 * delay), "unlimited"),
        "ms",
        &format!("additional delay until instability{ticks}"),
    );
    row("gain margin up", or(gain_up, "unlimited"), "", "largest stable factor of the plant input gain");
    row("gain margin down", factor_down(gain_down), "", "smallest stable factor");
    let at = format!("maximum of |S|, at {} rad/s", number(peak_rad_s));
    row("sensitivity peak", number(sensitivity_peak), "", &at);
    for Noise { sensor, gain, unit, sensor_rms, u_rms } in &design.noise {
        row(&format!("noise gain, {sensor}"), number(*gain), unit, "rms of u per rms of white noise on this encoder");
        if *sensor_rms > 0.0 {
            let u = if experiment.control_unit.is_empty() { "u" } else { experiment.control_unit };
            row(
                &format!("{}, {sensor}", noise_name(u)),
                number(*u_rms),
                u,
                "rms, linearised loop; counts and declared noise",
            );
        }
    }
    if let (Some(total), true) = (design.noise(), design.noise.iter().filter(|it| it.sensor_rms > 0.0).count() > 1) {
        let u = experiment.control_unit;
        row(&format!("{}, all encoders", noise_name(u)), number(total), u, "root of the sum of squares");
    }
    for Bound { name, value, unit, meaning } in &design.bounds {
        row(name, number(*value), unit, meaning);
    }
    table
}
