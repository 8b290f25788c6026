//! Golden tables: small text files of figures that a person can judge. They *indicate* a change; the bars that must
//! hold are asserted elsewhere.

use crate::data::path;

/// Set to write the tables anew instead of comparing.
pub const REGENERATE: &str = "GOLDEN";

/// Compares a table with the one of a page in docs that stands between `<!-- NAME -->` and `<!-- end -->`.
///
/// # Errors
/// The lines that differ and how to write them anew.
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

/// The lines that one text alone has.
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
/// The lines that differ and how to regenerate the file, where it is another table or there is none.
pub fn compare(name: &str, table: &str) -> Result<(), String> {
    let file = path("golden").join(name);
    if std::env::var_os(REGENERATE).is_some_and(|value| value == "write") {
        return std::fs::write(&file, table).map_err(|error| format!("{}: {error}", file.display()));
    }
    let golden = std::fs::read_to_string(&file).unwrap_or_else(|error| format!("(cannot be read: {error})\n"));
    if golden == table {
        return Ok(());
    }
    Err(format!(
        "tests/golden/{name} differs, - golden, + now:\n{}if the change is meant: {REGENERATE}=write cargo test -p \
         integration-tests golden, then read the diff",
        changed(&golden, table),
    ))
}
