//! Links between pages: the file of every relative link exists, and so does the heading of its anchor.

use std::collections::HashMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::scan::files_with;

/// Returns the number of relative links in all pages.
///
/// # Errors
/// Every link without a file or a heading, one line each.
pub(crate) fn check(root: &Path) -> Result<String, String> {
    let files = files_with(root, "md").map_err(|error| format!("the pages cannot be read: {error}"))?;
    let mut pages = HashMap::new();
    for file in &files {
        let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
        pages.insert(file.clone(), text);
    }
    let (mut count, mut broken) = (0, Vec::new());
    for file in &files {
        for (line, target) in links(&pages[file]) {
            let (path, anchor) = target.split_once('#').map_or((target, None), |(path, it)| (path, Some(it)));
            let to = if path.is_empty() { file.clone() } else { joined(file, path) };
            let has_anchor = |anchor| pages.get(&to).is_none_or(|text| anchors(text).iter().any(|it| it == anchor));
            if !to.exists() || !anchor.is_none_or(has_anchor) {
                broken.push(format!("{}:{line}: {target} leads nowhere", file.display()));
            }
            count += 1;
        }
    }
    if broken.is_empty() { Ok(format!("{count} links")) } else { Err(broken.join("\n")) }
}

/// Returns the path of a link, without `..`.
fn joined(page: &Path, path: &str) -> PathBuf {
    let mut to = page.parent().unwrap_or(page).to_path_buf();
    for part in Path::new(path).components() {
        match part {
            Component::ParentDir => _ = to.pop(),
            Component::CurDir => {}
            part => to.push(part),
        }
    }
    to
}

/// Returns the lines outside code blocks with their numbers.
fn prose(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut fenced = false;
    (1..).zip(text.lines()).filter(move |(_, line)| {
        let is_fence = line.trim_start().starts_with("```");
        fenced ^= is_fence;
        !fenced && !is_fence
    })
}

/// Returns the relative targets of all links with their line numbers.
fn links(text: &str) -> Vec<(usize, &str)> {
    let all = prose(text).flat_map(|(number, line)| {
        line.split("](").skip(1).filter_map(move |rest| Some((number, rest.split_once(')')?.0)))
    });
    // An intra-doc link of rustdoc has no suffix and no slash; rustdoc checks it.
    let is_page = |target: &str| target.starts_with('#') || target.contains('/') || target.contains('.');
    all.filter(|(_, target)| !target.contains("://") && !target.contains("::") && is_page(target)).collect()
}

/// Returns the anchors of all headings, as GitHub and mdBook name them.
fn anchors(text: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for (_, line) in prose(text).filter(|(_, line)| line.starts_with('#')) {
        let kept = |c: char| if c == ' ' { Some('-') } else { (c.is_alphanumeric() || "-_".contains(c)).then_some(c) };
        let anchor: String = line.trim_start_matches('#').trim().to_lowercase().chars().filter_map(kept).collect();
        let times = found.iter().filter(|it| **it == anchor).count();
        found.push(if times > 0 { format!("{anchor}-{times}") } else { anchor });
    }
    found
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{anchors, joined, links};

    #[test]
    fn links_and_anchors_are_found() {
        let text = "# A page, of σ*\n[a](b.md#c) and [d](#e), [x](https://y.z)\n```\n[no](no.md)\n# no\n```\n\
                    ## Twice\n## Twice\n";
        assert_eq!(links(text), [(2, "b.md#c"), (2, "#e")]);
        assert_eq!(anchors(text), ["a-page-of-σ", "twice", "twice-1"]);
        assert_eq!(joined(Path::new("/r/docs/a.md"), "../b/c.md"), Path::new("/r/b/c.md"));
    }
}
