//! The table of instances in `docs/verification.md`: a run of all instances writes it, and a test checks it.

use std::fmt::Write as _;

use crate::instances::{ALL, Instance};
use crate::run::Row;

/// The table is between these lines of the page.
const BEGIN: &str = "<!-- cargo xtask prove --all writes from here -->\n";
const END: &str = "<!-- to here -->\n";

/// Returns the page with the table of these rows. An instance without a row keeps its line of the page.
///
/// # Errors
/// If the page has no place for the table.
pub fn with_table(page: &str, rows: &[Row]) -> Result<String, String> {
    let place = page
        .split_once(BEGIN)
        .and_then(|(before, rest)| rest.split_once(END).map(|(table, after)| (before, table, after)));
    let (before, table, after) =
        place.ok_or_else(|| format!("no place for a table: it needs the lines\n{BEGIN}{END}"))?;
    Ok([before, BEGIN, &self::table(rows, table), END, after].concat())
}

fn table(rows: &[Row], before: &str) -> String {
    let mut out = String::from("| instance | what it is | proved | s | not proved |\n|---|---|---|---|---|\n");
    for Instance { name, what, .. } in ALL {
        let of: Vec<&Row> = rows.iter().filter(|row| row.instance == name).collect();
        if of.is_empty() {
            let start = format!("| `{name}` | {what} |");
            let untried = format!("{start} not tried | | |");
            out.push_str(before.lines().find(|line| line.starts_with(&start)).unwrap_or(&untried));
            out.push('\n');
            continue;
        }
        let proved = of.iter().filter(|row| row.is_proved()).count();
        let seconds: f64 = of.iter().map(|row| row.seconds).sum();
        let open: Vec<String> = of
            .iter()
            .filter(|row| !row.is_proved())
            .map(|row| format!("{}, {}: {}", row.verdict, row.statement, row.question.as_deref().unwrap_or("")))
            .collect();
        let _ = writeln!(out, "| `{name}` | {what} | {proved} of {} | {seconds:.0} | {} |", of.len(), open.join("; "));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instances::sampled;
    use crate::statements;

    /// Every instance is listed with the number of its statements, and the required ones are proved.
    #[test]
    fn the_page_lists_what_is_shipped() {
        let page = include_str!("../../docs/verification.md");
        let (_, rest) = page.split_once(BEGIN).expect("a table");
        let rows: Vec<Vec<&str>> = rest.split_once(END).expect("its end").0.lines().skip(2).map(cells).collect();
        assert_eq!(rows.len(), ALL.len(), "an instance without a row, or the other way round: cargo xtask prove --all");
        for Instance { name, what, functions, must } in sampled(4) {
            let row = rows.iter().find(|row| row[0] == format!("`{name}`")).expect("its row");
            let asked = statements(&functions()).len();
            assert_eq!(row[..2], [format!("`{name}`").as_str(), what], "cargo xtask prove --all");
            assert!(
                row[2].ends_with(&format!(" of {asked}")),
                "{name}: {asked} statements, and the page has {}",
                row[2]
            );
            assert!(!must || row[2] == format!("{asked} of {asked}"), "{name} must be proved");
            assert_eq!(
                row[2] == format!("{asked} of {asked}"),
                row[4].is_empty(),
                "{name}: what is not proved is said"
            );
        }
    }

    fn cells(line: &str) -> Vec<&str> {
        line.trim_matches('|').split(" |").map(str::trim).collect()
    }
}
