//! Links between pages: the file of every relative link exists, and so does the heading of its anchor.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// Returns the number of relative links in these pages.
///
/// # Errors
/// Every link without a file or a heading, one line each.
pub(crate) fn check(pages: &BTreeMap<PathBuf, String>) -> Result<String, String> {
    let (mut count, mut broken) = (0, Vec::new());
    for (file, text) in pages {
        for (line, target) in links(text) {
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
