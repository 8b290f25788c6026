//! Checks the map of equations in docs/paper.md against the sources: each numbered equation, each figure and Table I
//! has exactly one row, and the items and tests that the row names exist. Other tables of the page are not read.
//!
//! A row is `| label | what | symbols | tests |`. A label is `(44)`, a range `(3)-(6)`, `Fig. 4` or `Table I`. A symbol
//! is `` `path/to/file.rs::Item` `` or `` `path/to/file.rs::Type::item` ``, or a file alone; a test is
//! `` `path/to/file.rs::test_name` ``. A row without a name has `-` and the reason.
//!
//! A row of the table under it is `| label | proof | machine code |`: statements of docs/verification.md, and functions
//! of firmware/budgets.toml by the beginnings of their names. Every function that is judged there has a row, and a row
//! without a statement is an error as soon as there are proofs.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::scan::section;
use crate::step::{Gate, Outcome};
use crate::traceability;

pub(crate) const MAP: &str = "docs/paper.md";
/// Heading of the section of [`MAP`] that holds the map, the last one of the page.
const SECTION: &str = "## Map of equations";
const PROOFS: &str = "docs/verification.md";
const BUDGETS: &str = "firmware/budgets.toml";
const EQUATIONS: u32 = 64;
const FIGURES: u32 = 10;

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.check("paper map: every equation has code and a test", "cargo xtask paper-map", |gate| {
        let text = read(&gate.root)?;
        let mut faults = faults(&text, &gate.root);
        let budgets = fs::read_to_string(gate.root.join(BUDGETS)).map_err(|error| format!("{BUDGETS}: {error}"))?;
        let proofs = fs::read_to_string(gate.root.join(PROOFS)).ok();
        faults.extend(on_the_chip(&text, &budgets, proofs.as_deref()));
        if faults.is_empty() {
            let traced = traceability::text(&text, &budgets, &gate.root);
            let file = traceability::FILE;
            fs::write(gate.root.join(file), traced).map_err(|error| format!("{file}: {error}"))?;
            Ok(format!(
                "{EQUATIONS} equations, {FIGURES} figures, 1 table; each followed to the machine code in {file}"
            ))
        } else {
            Err(faults.join("\n"))
        }
    })
}

/// Reads the map, with the line numbers of its page.
pub(crate) fn read(root: &Path) -> Result<String, String> {
    let page = fs::read_to_string(root.join(MAP)).map_err(|error| format!("{MAP}: {error}"))?;
    section(&page, SECTION).ok_or_else(|| format!("{MAP} has no section `{SECTION}`"))
}

fn faults(text: &str, root: &Path) -> Vec<String> {
    let mut faults = Vec::new();
    let mut rows_of: BTreeMap<String, usize> = BTreeMap::new();
    for (number, line) in text.lines().enumerate() {
        let Some(cells) = cells(line) else { continue };
        let mut say = |fault: String| faults.push(format!("{MAP}:{}: {fault}", number + 1));
        let labels = match labels(cells[0]) {
            Ok(labels) => labels,
            Err(fault) => {
                say(fault);
                continue;
            }
        };
        for label in labels {
            *rows_of.entry(label).or_default() += 1;
        }
        for (cell, is_test) in [(cells[2], false), (cells[3], true)] {
            let references = references(cell);
            // A dash and a reason of at least one word.
            if references.is_empty() && cell.strip_prefix("- ").is_none_or(|reason| reason.len() <= 3) {
                say(format!("name at least one {}, or `- reason`", if is_test { "test" } else { "symbol" }));
            }
            for reference in references {
                if let Err(fault) = resolve(reference, is_test, root) {
                    say(fault);
                }
            }
        }
    }
    for label in required() {
        match rows_of.remove(&label) {
            Some(1) => {}
            Some(rows) => faults.push(format!("{MAP}: {label} has {rows} rows: one home per equation")),
            None => faults.push(format!("{MAP}: {label} has no row")),
        }
    }
    faults.extend(rows_of.into_keys().map(|label| format!("{MAP}: the paper has no {label}")));
    faults
}

/// Checks the table of proofs and machine code against the functions and statements that it names.
fn on_the_chip(text: &str, budgets: &str, proofs: Option<&str>) -> Vec<String> {
    let instances = budgets.split("[[instance]]").skip(1);
    let functions: Vec<&str> = instances.filter_map(|of| of.split_once("name = \"")?.1.split('"').next()).collect();
    let homes: Vec<&str> = text.lines().filter_map(|line| Some(cells(line)?[0])).collect();
    let (mut faults, mut named) = (Vec::new(), Vec::new());
    for [label, proof, code] in text.lines().filter_map(row::<3>) {
        let mut say = |fault: String| faults.push(format!("{MAP}: {label}: {fault}"));
        if !homes.contains(&label) {
            say("it has no row in the first table".into());
        }
        let statements = references(proof);
        if statements.is_empty() && proof.strip_prefix("- ").is_none() {
            say(format!("name a statement of {PROOFS}, or say why there is none: `- why`"));
        }
        for statement in statements {
            if !proofs.is_some_and(|proofs| proofs.contains(statement)) {
                say(format!("{PROOFS} has no `{statement}`"));
            }
        }
        for beginning in references(code) {
            if !functions.iter().any(|function| function.starts_with(beginning)) {
                say(format!("no name in {BUDGETS} begins with `{beginning}`"));
            }
            named.push(beginning);
        }
    }
    let unnamed = functions.iter().filter(|function| !named.iter().any(|beginning| function.starts_with(beginning)));
    faults.extend(unnamed.map(|function| format!("{MAP}: no row of an equation names `{function}` of {BUDGETS}")));
    faults
}

fn required() -> impl Iterator<Item = String> {
    let equations = (1..=EQUATIONS).map(|number| format!("({number})"));
    equations.chain((1..=FIGURES).map(|number| format!("Fig. {number}"))).chain([String::from("Table I")])
}

/// Returns the four cells of a row; `None` for prose, the heading and its rule.
pub(crate) fn cells(line: &str) -> Option<[&str; 4]> {
    row(line)
}

/// Returns the K cells of a row.
pub(crate) fn row<const K: usize>(line: &str) -> Option<[&str; K]> {
    let inner = line.trim().strip_prefix('|')?.strip_suffix('|')?;
    let cells: Vec<&str> = inner.split('|').map(str::trim).collect();
    let cells: [&str; K] = cells.try_into().ok()?;
    let is_heading = cells[0] == "paper" || cells[0].starts_with("---");
    (!is_heading).then_some(cells)
}

/// Returns the labels of a cell: `(3)-(6)` is four labels, any other text is one.
fn labels(cell: &str) -> Result<Vec<String>, String> {
    let Some((first, last)) = cell.split_once(")-(") else { return Ok(vec![cell.to_string()]) };
    let number = |text: &str| text.trim_matches(['(', ')']).parse::<u32>();
    match (number(first), number(last)) {
        (Ok(first), Ok(last)) if first < last => Ok((first..=last).map(|number| format!("({number})")).collect()),
        _ => Err(format!("`{cell}` is not a range of equations such as (3)-(6)")),
    }
}

/// Returns the texts between backticks.
pub(crate) fn references(cell: &str) -> Vec<&str> {
    cell.split('`').skip(1).step_by(2).collect()
}

/// Checks that the file exists and defines each part of the name.
fn resolve(reference: &str, is_test: bool, root: &Path) -> Result<(), String> {
    let (file, names) = match reference.split_once("::") {
        Some((file, names)) => (file, names.split("::").collect()),
        None => (reference, Vec::new()),
    };
    let text = fs::read_to_string(root.join(file)).map_err(|error| format!("`{reference}`: {file}: {error}"))?;
    if is_test && names.is_empty() {
        return Err(format!("`{reference}` names no test"));
    }
    for name in names {
        if !defines(&text, name) {
            return Err(format!("`{reference}`: {file} defines no `{name}`"));
        }
        if is_test && !is_tested(&text, name) {
            return Err(format!("`{reference}`: `{name}` is not a #[test]"));
        }
    }
    Ok(())
}

fn defines(text: &str, name: &str) -> bool {
    text.lines().any(|line| is_definition(line, name))
}

/// Returns whether a line defines the name, such as `pub const fn name(` or `Name {` of an enum; comments do not count.
pub(crate) fn is_definition(line: &str, name: &str) -> bool {
    let line = line.trim_start();
    if line.starts_with("//") {
        return false;
    }
    // Variants and constants of an impl stand alone or after their keyword.
    let variant = line.strip_prefix(name).is_some_and(|rest| rest.starts_with([',', ' ', '(', '{']));
    let keywords = ["fn", "struct", "enum", "trait", "type", "const", "static", "mod", "macro_rules!"];
    let words: Vec<&str> = line.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '!')).collect();
    variant || words.windows(2).any(|pair| keywords.contains(&pair[0]) && pair[1] == name)
}

/// Returns whether `#[test]` is among the attributes directly above the function.
fn is_tested(text: &str, name: &str) -> bool {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    lines.iter().enumerate().any(|(at, line)| {
        is_definition(line, name)
            && lines[..at]
                .iter()
                .rev()
                .take_while(|above| above.starts_with("#[") || above.starts_with("//"))
                .any(|above| *above == "#[test]")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full_map(row: &str) -> String {
        let rows: Vec<String> =
            required().map(|label| format!("| {label} | w | - stated only | - stated only |")).collect();
        let text = format!("| paper | what | symbol | test |\n|---|---|---|---|\n{}\n", rows.join("\n"));
        text.replace("| (44) | w | - stated only | - stated only |", row)
    }

    fn here() -> &'static Path {
        Path::new(env!("CARGO_MANIFEST_DIR"))
    }

    #[test]
    fn the_map_is_read_from_its_section_with_the_lines_of_the_page() {
        let page = "# Paper\n\n| claim | printed | here | |\n\n## Map of equations\n\n| (1) | w | s | t |\n";
        let map = section(page, SECTION).expect("a section");
        let rows: Vec<_> = map.lines().enumerate().filter_map(|(at, line)| Some((at + 1, cells(line)?))).collect();
        assert_eq!(rows, [(7, ["(1)", "w", "s", "t"])]);
        assert_eq!(section("# The paper\n", SECTION), None);
    }

    #[test]
    fn a_row_whose_symbol_and_test_exist_passes() {
        let row = "| (44) | w | `src/paper_map.rs::faults`, `src/step.rs::Gate::check` \
                   | `src/paper_map.rs::a_row_whose_symbol_and_test_exist_passes` |";
        assert_eq!(faults(&full_map(row), here()), Vec::<String>::new());
    }

    #[test]
    fn each_kind_of_wrong_row_is_named() {
        let cases = [
            ("| (44) | w | `src/paper_map.rs::no_such_item` | - none needed |", "defines no `no_such_item`"),
            ("| (44) | w | `src/no_such_file.rs::x` | - none needed |", "src/no_such_file.rs"),
            ("| (44) | w | `src/step.rs::Gate` | `src/paper_map.rs::faults` |", "is not a #[test]"),
            ("| (44) | w | `src/step.rs::Gate` | `src/paper_map.rs` |", "names no test"),
            ("| (44) | w | `src/step.rs::Gate` | |", "at least one test"),
            ("| (43)-(44) | w | - stated only | - stated only |", "(43) has 2 rows"),
            ("| (44)-(43) | w | - stated only | - stated only |", "not a range"),
            ("| (65) | w | - stated only | - stated only |", "the paper has no (65)"),
            ("no row at all", "(44) has no row"),
        ];
        for (row, expected) in cases {
            let faults = faults(&full_map(row), here()).join("\n");
            assert!(faults.contains(expected), "{row}: {faults}");
        }
    }

    #[test]
    fn proofs_and_functions_must_be_there_and_every_function_has_a_row() {
        let budgets = "[[instance]]\nname = \"joint, r = 1\"\n[[instance]]\nname = \"motor\"\n";
        let home = "| (51) | law | - stated only | - stated only |\n";
        let with = |row: &str, proofs| on_the_chip(&format!("{home}{row}\n"), budgets, proofs).join("\n");
        assert_eq!(with("| (51) | - none yet | `joint, r =`, `motor` |", None), "");
        assert_eq!(with("| (51) | `u_in_limits` | `joint`, `motor` |", Some("## u_in_limits")), "");
        for (row, proofs, told) in [
            ("| (51) | u | `joint`, `motor` |", Some("## u_in_limits"), "name a statement"),
            ("| (51) | `finite` | `joint`, `motor` |", Some("## u_in_limits"), "has no `finite`"),
            ("| (51) | `finite` | `joint`, `motor` |", None, "has no `finite`"),
            ("| (51) | - none yet | `joint`, `motors`, `motor` |", None, "begins with `motors`"),
            ("| (51) | - none yet | `joint` |", None, "names `motor`"),
            ("| (52) | - none yet | `joint`, `motor` |", None, "no row in the first table"),
        ] {
            assert!(with(row, proofs).contains(told), "{row}");
        }
    }

    #[test]
    fn ranges_are_all_their_numbers() {
        assert_eq!(labels("(3)-(6)"), Ok(["(3)", "(4)", "(5)", "(6)"].map(String::from).to_vec()));
        assert_eq!(labels("Fig. 4"), Ok(vec![String::from("Fig. 4")]));
    }

    #[test]
    fn a_name_in_a_comment_or_inside_a_longer_name_is_no_definition() {
        assert!(is_definition("    pub const fn tick(&self) {", "tick"));
        assert!(is_definition("    Reconstructed,", "Reconstructed"));
        assert!(!is_definition("// fn tick", "tick"));
        assert!(!is_definition("fn tick_twice()", "tick"));
        assert!(!is_definition("let x = tick(1);", "tick"));
    }
}
