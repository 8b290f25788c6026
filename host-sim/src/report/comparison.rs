//! Output of a comparison: the table, the worst error over the current noise, and one run of three controllers.

use study::compare::{Bench, Contender, Entry, Figures, LOST};
use study::number::significant;
use terminal::table::Table;

use super::plot::{Figure, Panel, Series, Style};

/// Ratio to the best value below which a result counts as equal: quantisation and a short search limit the accuracy.
const AS_GOOD: f64 = 1.02;

type Column = (&'static str, fn(&Figures) -> f64);

const COLUMNS: [Column; 8] = [
    ("S rad", |f| f.sine_rad),
    ("M rad", |f| f.move_rad),
    ("load rad", |f| f.load_rad),
    ("settle s", |f| f.settle_s),
    ("M20", |f| f.move_20_rad),
    ("L20", |f| f.load_20_rad),
    ("S50", |f| f.sine_50_rad),
    ("L50", |f| f.load_50_rad),
];

/// Returns the table with a row per control law and noise limit, and a row of the drive of the file, without a search.
/// `*` marks values within 2 % of the best at this limit. `!` marks a current noise above the limit; such a law is not
/// ranked.
#[must_use]
pub fn table(entries: &[Entry], of_file: Option<&Figures>) -> Table {
    let mut table = Table::new([
        "limit A", "law", "noise A", "S rad", "M rad", "load rad", "settle s", "M20", "L20", "S50", "L50", "unstable",
    ]);
    for entry in entries {
        let ranked = entries.iter().filter(|other| other.limit_a == entry.limit_a && !other.breaks_limit());
        let cell = |&(_, of): &Column| {
            let (own, best) =
                (of(&entry.figures), ranked.clone().map(|other| of(&other.figures)).fold(f64::MAX, f64::min));
            let number = number(own);
            let is_best = own <= AS_GOOD * best && own < LOST && !entry.breaks_limit();
            format!("{number}{}", if is_best { "*" } else { "" })
        };
        let noise = significant(entry.figures.noise_a, 2);
        let noise = if entry.breaks_limit() { format!("{noise}!") } else { noise };
        let mut cells = vec![significant(entry.limit_a, 2), entry.law.to_owned(), noise];
        cells.extend(COLUMNS.iter().map(cell));
        cells.push(entry.figures.unstable.to_string());
        add(&mut table, cells);
    }
    if let Some(figures) = of_file {
        let mut cells = vec![String::new(), "edo-smc, drive of the file".into(), significant(figures.noise_a, 2)];
        cells.extend(COLUMNS.iter().map(|&(_, of)| number(of(figures))));
        cells.push(figures.unstable.to_string());
        add(&mut table, cells);
    }
    table
}

/// Formats a metric; `lost` for a run that did not settle.
fn number(value: f64) -> String {
    if value < LOST { significant(value, 2) } else { "lost".into() }
}

fn add(table: &mut Table, mut cells: Vec<String>) {
    let cells: [String; 12] = std::array::from_fn(|i| std::mem::take(&mut cells[i]));
    table.row(cells.each_ref().map(String::as_str));
}

/// Returns the figure of the worst error of ±20 % over the current noise, a curve per control law. A run that did not
/// settle has no point.
#[must_use]
pub fn figure(bench: &Bench, entries: &[Entry]) -> Figure {
    let mut laws: Vec<&str> = Vec::new();
    for entry in entries {
        if !laws.contains(&entry.law) {
            laws.push(entry.law);
        }
    }
    let panel = |title: &str, of: fn(&Figures) -> f64| {
        let series = laws.iter().enumerate().map(|(color, law)| {
            let of_law = entries.iter().filter(|entry| entry.law == *law);
            let mut points: Vec<(f64, f64)> = of_law
                .map(|entry| (entry.figures.noise_a, of(&entry.figures)))
                .filter(|(_, error)| *error < LOST)
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let style = if law.starts_with("edo-smc") { Style::Solid } else { Style::Dashed };
            Series { has_dots: true, ..Series::solid(*law, color, points).styled(style) }
        });
        Panel {
            title: title.into(),
            x_label: "current noise (A rms)".into(),
            y_label: "largest error, worst of ±20 % (rad)".into(),
            series: series.collect(),
            is_log: true,
            ..Panel::default()
        }
    };
    Figure {
        title: format!("Worst error over current noise: {}", bench.title),
        panels: vec![panel("Load step", |f| f.load_20_rad), panel("Move of 1 rad", |f| f.move_20_rad)],
        columns: 2,
    }
}

/// Control laws in the figure of one run: edo-smc and two common baselines.
const SHOWN: [&str; 3] = ["edo-smc, two gain sets", "LQG, disturbance states", "P-PI"];

/// Returns the figure of error and current of three controllers in one run, each tuned at the middle noise limit.
///
/// The range of the error covers edo-smc and LQG. If P-PI exceeds it, the head of the panel shows its peak.
#[must_use]
pub fn moves(bench: &Bench, contenders: &[Box<dyn Contender>], entries: &[Entry]) -> Figure {
    let mut limits: Vec<f64> = entries.iter().map(|entry| entry.limit_a).collect();
    limits.dedup();
    let limit_a = limits.get(limits.len() / 2).copied().unwrap_or_default();
    let runs: Vec<(&str, Vec<[f64; 3]>)> = SHOWN
        .into_iter()
        .filter_map(|law| {
            let entry = entries.iter().find(|entry| entry.law == law && entry.limit_a == limit_a)?;
            let contender = contenders.iter().find(|contender| contender.name() == law)?;
            let knobs: Vec<f64> = entry.knobs.iter().map(|(_, value)| *value).collect();
            Some((law, bench.shown(contender.design(&knobs)?.as_ref())))
        })
        .collect();
    let panel = |title: String, y_label: &str, is_held: bool, of: fn(&[f64; 3]) -> f64| {
        let series = runs.iter().enumerate().map(|(color, (law, ticks))| {
            let points = ticks.iter().map(|tick| (tick[0], of(tick)));
            Series { is_held, ..Series::solid(*law, color, points) }
        });
        Panel { title, x_label: "t (s)".into(), y_label: y_label.into(), series: series.collect(), ..Panel::default() }
    };
    let errors = runs.iter().filter(|(law, _)| *law != "P-PI").flat_map(|(_, ticks)| ticks.iter().map(|tick| tick[1]));
    let (low, high) = errors.fold((0.0_f64, 0.0_f64), |(low, high), error| (low.min(error), high.max(error)));
    let margin = 0.15 * (high - low);
    let head = format!("Error, each controller tuned to {} A of current noise", significant(limit_a, 2));
    let error = Panel {
        y_range: (margin > 0.0).then_some((1e3 * (low - margin), 1e3 * (high + margin))),
        ..panel(head, "y - r (mrad)", false, |tick| 1e3 * tick[1])
    };
    Figure {
        title: format!("{}: 1 rad in {} s with friction, then a load step", bench.name, significant(bench.tau_s, 3)),
        panels: vec![error, panel("Current".into(), "u (A)", true, |tick| tick[2])],
        columns: 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(law: &'static str, noise_a: f64, error: f64) -> Entry {
        let figures = Figures {
            noise_a,
            sine_rad: error,
            move_rad: error,
            load_rad: error,
            ultimate_rad: error,
            settle_s: error,
            move_20_rad: error,
            load_20_rad: error,
            sine_50_rad: LOST,
            load_50_rad: error,
            unstable: 0,
        };
        Entry { law, limit_a: 0.05, cost: 0.0, knobs: Vec::new(), figures }
    }

    /// A law above the noise limit is not ranked, and a column that all laws lost has no star.
    #[test]
    fn a_law_over_the_limit_is_marked_and_not_ranked() {
        let entries = [entry("loud", 0.06, 1e-4), entry("quiet", 0.04, 2e-4), entry("slow", 0.01, 3e-4)];
        let text = table(&entries, Some(&entry("", 0.02, 1e-5).figures)).to_string();
        let row = |law: &str| text.lines().find(|line| line.contains(law)).expect("a row").to_owned();
        let [loud, quiet, slow] = ["loud", "quiet", "slow"].map(row);
        assert!(loud.contains("0.060!") && !loud.contains('*'), "{loud}");
        assert_eq!((quiet.matches('*').count(), slow.matches('*').count()), (7, 0), "{quiet}\n{slow}");
        assert!(quiet.contains("lost "), "{quiet}");
        // The drive of the file has no limit and no rank.
        let of_file = row("drive of the file");
        assert!(of_file.contains("1.0e-5") && !of_file.contains('*'), "{of_file}");
    }
}
