//! Golden tables: small text files of results for review by a person. A golden table *indicates* a change; separate
//! assertions check the thresholds.

use std::path::Path;

use crate::data::path;

/// Environment variable that rewrites the tables instead of comparing them.
pub const REGENERATE: &str = "GOLDEN";

/// Compares a table with the table between `<!-- NAME -->` and `<!-- end -->` on a page in docs.
///
/// # Errors
/// Lists the lines that differ and the command that rewrites the table.
pub fn in_docs(page: &str, name: &str, table: &str) -> Result<(), String> {
    let file = path("../docs").join(page);
    let text = std::fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
    let (begin, end) = (format!("<!-- {name} -->\n"), "<!-- end -->");
    let parts = text.split_once(&begin).and_then(|(before, rest)| Some((before, rest.split_once(end)?)));
    let (before, (there, after)) = parts.ok_or_else(|| format!("docs/{page} has no table {begin}"))?;
    if std::env::var_os(REGENERATE).is_some_and(|value| value == "write") {
        return std::fs::write(&file, [before, &begin, table, end, after].concat()).map_err(|error| error.to_string());
    }
    if there == table {
        return Ok(());
    }
    Err(format!(
        "table {name} of docs/{page} differs, - page, + now:\n{}if the change is meant: cargo xtask tables",
        changed(there, table)
    ))
}

/// Compares a generated page with its file in docs.
///
/// # Errors
/// Lists the lines that differ and the command that writes the page.
pub fn whole(page: &str, text: &str) -> Result<(), String> {
    let differs = |lines| {
        format!(
            "docs/{page} differs, - page, + now:\n{lines}write it with: {REGENERATE}=write cargo test -p \
             integration-tests --test suite -- reference::"
        )
    };
    same_file(&path("../docs").join(page), text, differs)
}

/// Compares a text with a file, or writes it. `differs` forms the message from the lines that differ.
fn same_file(file: &Path, text: &str, differs: impl Fn(String) -> String) -> Result<(), String> {
    if std::env::var_os(REGENERATE).is_some_and(|value| value == "write") {
        return std::fs::write(file, text).map_err(|error| format!("{}: {error}", file.display()));
    }
    let there = std::fs::read_to_string(file).unwrap_or_else(|error| format!("(cannot be read: {error})\n"));
    if there == text { Ok(()) } else { Err(differs(changed(&there, text))) }
}

/// Returns the lines that only one of the two texts has.
fn changed(before: &str, now: &str) -> String {
    let only = |of: &str, other: &str, sign: char| -> String {
        let differ = of.lines().filter(|line| !other.lines().any(|kept| kept == *line));
        differ.map(|line| format!("{sign} {line}\n")).collect::<Vec<_>>().concat()
    };
    only(before, now, '-') + &only(now, before, '+')
}

/// Compares a table with `tests/golden/<name>`.
///
/// # Errors
/// If the tables differ or the file is missing: lists the lines that differ and the command that regenerates the file.
pub fn compare(name: &str, table: &str) -> Result<(), String> {
    let differs = |lines| {
        format!(
            "tests/golden/{name} differs, - golden, + now:\n{lines}if the change is meant: {REGENERATE}=write cargo \
             test -p integration-tests golden, then read the diff"
        )
    };
    same_file(&path("golden").join(name), table, differs)
}
