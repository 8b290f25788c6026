//! Source scan: no disabled test, no unfinished code and no long line in any source, and one table of lints for all
//! workspaces.

use std::fs;
use std::path::{Path, PathBuf};

/// Forbidden texts, split so that this file does not match.
const FORBIDDEN: [&str; 4] =
    [concat!("#[ign", "ore"), concat!("to", "do!("), concat!("unimple", "mented!("), concat!("```ign", "ore")];

/// Folders outside of the sources.
const SKIPPED: [&str; 4] = ["target", "out", ".git", "node_modules"];

/// Longest line, characters.
const WIDTH: usize = 120;

/// Separate workspaces, each with its own lints.
const WORKSPACES: [&str; 6] = [
    "firmware/Cargo.toml",
    "controller-capi/Cargo.toml",
    "benches/chip/Cargo.toml",
    "benches/speed/Cargo.toml",
    "python/Cargo.toml",
    "web/Cargo.toml",
];

/// Returns the number of Rust files read, or the first finding.
pub(crate) fn check(root: &Path) -> Result<String, String> {
    let files = files_with(root, "rs").map_err(|error| format!("the sources cannot be read: {error}"))?;
    for file in &files {
        let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
        if let Some((line, needle)) = find(&text) {
            return Err(format!("{}:{line}: `{needle}` is not allowed", file.display()));
        }
        if let Some((line, width)) = too_long(&text) {
            return Err(format!("{}:{line}: {width} characters; break it at {WIDTH}", file.display()));
        }
    }
    let read = |path: &str| fs::read_to_string(root.join(path)).map_err(|error| format!("{path}: {error}"));
    let all = read("Cargo.toml")?;
    for path in WORKSPACES {
        if lints(&read(path)?) != lints(&all) {
            return Err(format!("{path}: its tables of lints are not those of Cargo.toml, which it cannot inherit"));
        }
    }
    Ok(format!("{} files", files.len()))
}

/// Returns the lints of a manifest, table by table, without comments.
fn lints(manifest: &str) -> Vec<String> {
    let mut inside = false;
    let lines = manifest.lines().map(|line| line.trim().replace("[workspace.lints", "[lints"));
    lines
        .filter(|line| {
            inside = if line.starts_with('[') { line.starts_with("[lints.") } else { inside };
            inside && !line.is_empty() && !line.starts_with('#')
        })
        .collect()
}

fn find(text: &str) -> Option<(usize, &'static str)> {
    let at = |line: &str| FORBIDDEN.into_iter().find(|needle| line.contains(needle));
    text.lines().enumerate().find_map(|(number, line)| Some((number + 1, at(line)?)))
}

fn too_long(text: &str) -> Option<(usize, usize)> {
    let widths = text.lines().map(|line| line.chars().count()).enumerate();
    widths.map(|(number, width)| (number + 1, width)).find(|(_, width)| *width > WIDTH)
}

/// Returns a page from below this heading on. Empty lines replace the rest, so that the line numbers match the page.
pub(crate) fn section(page: &str, heading: &str) -> Option<String> {
    let (before, rest) = page.split_once(heading)?;
    Some("\n".repeat(before.lines().count()) + rest)
}

/// Returns all files below `directory` with this extension.
pub(crate) fn files_with(directory: &Path, extension: &str) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(directory)? {
        let entry = entry?;
        let path = entry.path();
        if entry.file_type()?.is_dir() {
            if !SKIPPED.iter().any(|name| entry.file_name() == *name) {
                files.extend(files_with(&path, extension)?);
            }
        } else if path.extension().is_some_and(|found| found == extension) {
            files.push(path);
        }
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_forbidden_word_is_found_with_its_line() {
        for needle in FORBIDDEN {
            assert_eq!(find(&format!("fn f() {{}}\n    {needle}\n")), Some((2, needle)));
        }
        assert_eq!(find("fn ignore() { /* to do later */ }"), None);
    }

    #[test]
    fn lints_are_compared_without_comments_and_with_their_tables() {
        let root = "[workspace.lints.rust]\n# why\na = \"warn\"\n\n[profile.dev]\nb = 1\n";
        assert_eq!(lints(root), ["[lints.rust]", "a = \"warn\""]);
        assert_eq!(lints("[lints.rust]\na = \"warn\"\n"), lints(root));
        assert_ne!(lints("[lints.clippy]\na = \"warn\"\n"), lints(root));
    }

    #[test]
    fn a_line_is_measured_in_characters() {
        assert_eq!(too_long(&format!("{}\n{}", "σ".repeat(WIDTH), "x".repeat(WIDTH + 1))), Some((2, WIDTH + 1)));
        assert_eq!(too_long(&"σ".repeat(WIDTH)), None);
    }
}
