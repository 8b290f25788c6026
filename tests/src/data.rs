//! Reading `tests/data`.

use std::path::PathBuf;

/// Path of a file below the package.
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The folders of the scenario files that the project ships: the default and a chain, and those of the figures.
pub const SCENARIOS: [&str; 2] = ["../scenario/scenarios", "../host-sim/scenarios"];

/// Path of a scenario file that the project ships.
///
/// # Panics
/// If there is none of this name.
pub fn scenario_file(name: &str) -> PathBuf {
    let files = SCENARIOS.map(|folder| path(folder).join(name));
    files.into_iter().find(|file| file.exists()).unwrap_or_else(|| panic!("no scenario file {name}"))
}

/// A file of `tests/data` as text.
///
/// # Panics
/// If it cannot be read: the suite is incomplete then.
pub fn text(name: &str) -> String {
    let path = path("data").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Rows of a CSV file of numbers, in the order of the named columns.
///
/// # Panics
/// On a missing column or a cell that is no number.
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
