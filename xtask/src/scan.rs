//! No source may hold a test that is switched off or a place that is not written yet.

use std::fs;
use std::path::{Path, PathBuf};

/// Split so that this file does not find itself.
const FORBIDDEN: [&str; 4] =
    [concat!("#[ign", "ore"), concat!("to", "do!("), concat!("unimple", "mented!("), concat!("```ign", "ore")];

/// What no build reads and no one writes by hand.
const SKIPPED: [&str; 4] = ["target", "out", ".git", "node_modules"];

/// Number of Rust files read, or the first finding.
pub(crate) fn check(root: &Path) -> Result<String, String> {
    let files = files_with(root, "rs").map_err(|error| format!("the sources cannot be read: {error}"))?;
    for file in &files {
        let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
        if let Some((line, needle)) = find(&text) {
            return Err(format!("{}:{line}: `{needle}` is not allowed", file.display()));
        }
    }
    Ok(format!("{} files", files.len()))
}

fn find(text: &str) -> Option<(usize, &'static str)> {
    let at = |line: &str| FORBIDDEN.into_iter().find(|needle| line.contains(needle));
    text.lines().enumerate().find_map(|(number, line)| Some((number + 1, at(line)?)))
}

/// All files below `directory` of this extension.
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
}
