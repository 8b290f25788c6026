//! Reader of the files in `tests/data`.

use std::path::PathBuf;

/// Returns the path of a file below the package.
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// Folders of the shipped scenario files: the default and a chain; the files of the figures.
pub const SCENARIOS: [&str; 2] = ["../scenario/scenarios", "../host-sim/scenarios"];

/// Returns the path of a shipped scenario file.
///
/// # Panics
/// If no shipped file has this name.
pub fn scenario_file(name: &str) -> PathBuf {
    let files = SCENARIOS.map(|folder| path(folder).join(name));
    files.into_iter().find(|file| file.exists()).unwrap_or_else(|| panic!("no scenario file {name}"))
}

/// Returns a file of `tests/data` as text.
///
/// # Panics
/// If the file cannot be read: the suite is then incomplete.
pub fn text(name: &str) -> String {
    let path = path("data").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Returns the rows of a CSV file of numbers, in the order of the named columns.
///
/// # Panics
/// On a missing column or a cell that is not a number.
pub fn columns<const K: usize>(name: &str, wanted: [&str; K]) -> Vec<[f64; K]> {
    let text = text(name);
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let at = wanted.map(|column| header.iter().position(|name| *name == column).expect(column));
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            at.map(|k| cells[k].parse().expect("a number"))
        })
        .collect()
}
