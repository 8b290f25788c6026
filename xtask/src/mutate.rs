//! Mutation test of the paper map: a test of an equation must fail if the equation is wrong.
//!
//! The last table of docs/paper.md has rows `| (20) | `k_l`, `alpha` |`: symbols that are broken deliberately, one
//! after the other, in the designs of the suite (`break_symbol` in tests/src/shape.rs). The shipped code stays
//! unchanged. At least one of the suite's tests for the equation must then fail; without a broken symbol all tests
//! pass. There is one build and one run per symbol.

use std::collections::{BTreeMap, BTreeSet};

use crate::paper_map::{self, MAP, references};
use crate::step::{Gate, Outcome};

/// Variable that `tests/src/shape.rs` reads.
const MUTATION: &str = "MUTATION";

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.check("paper map: its tests fail when a symbol is broken", "cargo xtask mutate", |gate| {
        let text = paper_map::read(&gate.root)?;
        let rows = rows(&text)?;
        let all: BTreeSet<&str> = rows.iter().flat_map(|row| row.tests.iter().map(String::as_str)).collect();
        let failed = failed(gate, None, &all)?;
        if !failed.is_empty() {
            return Err(format!("with nothing broken these fail: {failed:?}"));
        }
        let mut faults = Vec::new();
        let mut of_symbol: BTreeMap<&str, Vec<&Row>> = BTreeMap::new();
        for row in &rows {
            row.symbols.iter().for_each(|symbol| of_symbol.entry(symbol).or_default().push(row));
        }
        for (symbol, rows) in &of_symbol {
            let tests = rows.iter().flat_map(|row| row.tests.iter().map(String::as_str)).collect();
            let failed = self::failed(gate, Some(symbol), &tests)?;
            let survived = rows.iter().filter(|row| !row.tests.iter().any(|test| failed.contains(test)));
            faults.extend(survived.map(|row| {
                format!("{MAP}: {}: with `{symbol}` broken still pass {}", row.label, row.tests.join(", "))
            }));
        }
        if faults.is_empty() {
            Ok(format!("{} equations, {} symbols", rows.len(), of_symbol.len()))
        } else {
            Err(faults.join("\n"))
        }
    })
}

/// A row of the mutation table, with the suite's tests from the map.
#[derive(Debug, PartialEq)]
struct Row {
    label: String,
    symbols: Vec<String>,
    /// Tests as `module::test`.
    tests: Vec<String>,
}

fn rows(text: &str) -> Result<Vec<Row>, String> {
    let cells = |line: &str| -> Option<Vec<String>> {
        let inner = line.trim().strip_prefix('|')?.strip_suffix('|')?;
        Some(inner.split('|').map(|cell| cell.trim().to_string()).collect())
    };
    let table: Vec<Vec<String>> = text.lines().filter_map(cells).collect();
    let mut rows = Vec::new();
    for cells in table.iter().filter(|cells| cells.len() == 2 && cells[1].contains('`')) {
        let label = &cells[0];
        let of_map = table.iter().find(|row| row.len() == 4 && row[0] == *label);
        let named = of_map.map_or_else(Vec::new, |row| references(&row[3]));
        let tests: Vec<String> = named
            .into_iter()
            .filter_map(|test| Some(test.strip_prefix("tests/suite/")?.replace(".rs::", "::")))
            .collect();
        if tests.is_empty() {
            return Err(format!("{MAP}: {label} is to be broken, but the map names no test of tests/suite for it"));
        }
        let symbols = references(&cells[1]).into_iter().map(String::from).collect();
        rows.push(Row { label: label.clone(), symbols, tests });
    }
    if rows.is_empty() { Err(format!("{MAP}: no row `| (20) | symbols |`: nothing is broken")) } else { Ok(rows) }
}

/// Returns the tests that fail; an error if one of them did not run.
fn failed(gate: &Gate, symbol: Option<&str>, tests: &BTreeSet<&str>) -> Result<Vec<String>, String> {
    let suite = gate.built().and_then(|built| built.test("tests/suite")).map_err(|failure| failure.reason)?;
    let mut command = suite.command();
    command.arg("--exact").args(tests);
    if let Some(symbol) = symbol {
        command.env(MUTATION, symbol);
    }
    println!("{} tests with {} broken", tests.len(), symbol.unwrap_or("nothing"));
    let output = command.output().map_err(|error| format!("{}: {error}", suite.name))?;
    let output = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    let verdicts = verdicts(&output);
    if verdicts.len() != tests.len() {
        return Err(format!("{} ran {} of {} tests:\n{output}", suite.name, verdicts.len(), tests.len()));
    }
    Ok(verdicts.into_iter().filter(|(_, passed)| !passed).map(|(test, _)| test).collect())
}

/// Returns the name and the outcome of each test, from lines `test a::b ... ok`.
fn verdicts(output: &str) -> Vec<(String, bool)> {
    let verdict = |line: &str| {
        let (name, verdict) = line.strip_prefix("test ")?.split_once(" ... ")?;
        matches!(verdict, "ok" | "FAILED").then(|| (name.to_string(), verdict == "ok"))
    };
    output.lines().filter_map(verdict).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_to_be_broken_has_the_tests_that_the_map_names() {
        let map = "| (20) | law | `a.rs::b` | `tests/suite/formula.rs::one`, `controller-core/src/c.rs::two` |";
        let row = Row { label: "(20)".into(), symbols: vec!["k_l".into()], tests: vec!["formula::one".into()] };
        assert_eq!(rows(&format!("{map}\n| (20) | `k_l` |\n")), Ok(vec![row]));
        let nothing = rows(&format!("{map}\n")).expect_err("no second table");
        assert!(nothing.contains("nothing is broken"), "{nothing}");
        let unmapped = rows(&format!("{map}\n| (21) | `k_s` |\n")).expect_err("no such row");
        assert!(unmapped.contains("(21)"), "{unmapped}");
    }

    #[test]
    fn verdicts_are_read_from_the_lines_of_the_test_harness() {
        let output = "running 2 tests\ntest a::b ... ok\ntest a::c ... FAILED\n\ntest result: FAILED. 1 passed\n";
        assert_eq!(verdicts(output), [("a::b".to_string(), true), ("a::c".to_string(), false)]);
    }
}
