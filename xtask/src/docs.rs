//! `cargo doc` without a warning, and formulas that a browser shows as formulas.
//!
//! Formulas stand between `$` in doc comments. Two things spoil them silently. A page shows them only if it loads
//! KaTeX, which a module asks for by including `controller-core/katex.html` in its docs (a header given by flags would
//! miss plain `cargo doc`: a relative path is wrong for the dependencies). And markdown eats a backslash before
//! anything but a letter or a blank (`\,` arrives as `,`, so formulas say `\thinspace`) and may take `]_` or `*` for
//! emphasis.

use std::fs;
use std::path::Path;

use crate::scan::files_with;
use crate::step::{Gate, Invocation, Outcome};

/// Crates whose pages are read.
const CRATES: [&str; 5] = ["controller_core", "host_sim", "loop_sim", "pil_wire", "scenario"];

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let doc = Invocation::cargo(&["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings");
    gate.commands("documentation without a warning", &[doc])?;
    gate.check("formulas in the documentation", "cargo xtask test", |gate| {
        let sources = each(&gate.root, "rs", spoiled)?;
        let mut pages = 0;
        for name in CRATES {
            pages += each(&gate.root.join("target/doc").join(name), "html", unrendered)?;
        }
        Ok(format!("{sources} sources, {pages} pages"))
    })
}

/// Applies `fault` to the text of every such file; their number, or the first fault.
fn each(directory: &Path, extension: &str, fault: fn(&str) -> Option<String>) -> Result<usize, String> {
    let files = files_with(directory, extension).map_err(|error| format!("{}: {error}", directory.display()))?;
    for file in &files {
        let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
        if let Some(fault) = fault(&text) {
            return Err(format!("{}: {fault}", file.display()));
        }
    }
    Ok(files.len())
}

/// A formula of a doc comment that markdown would change.
fn spoiled(source: &str) -> Option<String> {
    let mut fenced = false;
    let mut prose = String::new();
    for line in source.lines().map(str::trim_start) {
        let Some(doc) = line.strip_prefix("//!").or_else(|| line.strip_prefix("///")) else { continue };
        if doc.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if !fenced {
            prose += doc;
            prose.push('\n');
        }
    }
    // A backslash stays before a letter or a blank. Outside of code spans every second stretch between `$` is a
    // formula.
    let prose: String = prose.split('`').step_by(2).collect();
    let prose = prose.replace("$$", "$");
    if formulas(&prose).any(|formula| formula.contains("\\cr \\cr") || formula.contains("\\cr\\cr")) {
        return Some(String::from("`\\cr \\cr` is an empty row of the matrix: write \\cr once"));
    }
    let stays = |after: &str| after.starts_with(|c: char| c.is_ascii_alphabetic() || c == ' ');
    formulas(&prose).find(|formula| !formula.split('\\').skip(1).all(stays)).map(|formula| {
        format!("markdown eats a backslash of `{}`: write \\thinspace, \\lbrace, \\Vert, \\cr", formula.trim())
    })
}

/// A page that does not show its formulas as they were meant.
fn unrendered(page: &str) -> Option<String> {
    let body = page.split_once("<body").map_or(page, |(_, body)| body);
    let text = without_code(body).replace("$$", "$");
    if text.contains('$') && !page.contains("renderMathInElement") {
        return Some(String::from(
            "a formula, but no KaTeX: add #[doc = include_str!(\"../katex.html\")] to the item or write it in words \
             (a page of an item that is gone? remove target/doc)",
        ));
    }
    let marked =
        |formula: &&str| ["<em>", "</em>", "<strong>", "</strong>", "<a "].iter().any(|tag| formula.contains(tag));
    formulas(&text).find(marked).map(|formula| {
        format!("markdown reads `_` or `*` of `{}` as emphasis: put a blank before the `_`", formula.trim())
    })
}

fn formulas(text: &str) -> impl Iterator<Item = &str> {
    text.split('$').skip(1).step_by(2)
}

/// The page without what KaTeX leaves alone.
fn without_code(page: &str) -> String {
    let mut text = page.to_string();
    for tag in ["pre", "code", "script"] {
        let (open, close) = (format!("<{tag}"), format!("</{tag}>"));
        let mut rest = text.as_str();
        let mut kept = String::new();
        while let Some((before, after)) = rest.split_once(&open) {
            kept += before;
            rest = after.split_once(&close).map_or("", |(_, after)| after);
        }
        kept += rest;
        text = kept;
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_backslash_that_markdown_eats_is_found_in_formulas_only() {
        assert!(spoiled("//! $a\\,b$").is_some());
        assert!(spoiled("//! $$ a\n//! \\\\ b $$").is_some());
        assert!(spoiled("//! $a \\cr \\cr b$").is_some());
        assert_eq!(spoiled("//! $a\\ b \\cr c$"), None);
        assert_eq!(spoiled("//! $a \\thinspace b$, `\\,` and\n//! ```\n//! $\\,$\n//! ```\n"), None);
    }

    #[test]
    fn a_page_with_a_formula_must_load_katex() {
        assert!(unrendered("<p>$x$</p>").is_some());
        assert_eq!(unrendered("<p>$x$</p><script>renderMathInElement(document.body)</script>"), None);
        assert!(unrendered("<p>$a]<em>{k}$ and $b</em>{i}$</p>renderMathInElement").is_some());
        assert_eq!(unrendered("<pre class=\"x\">$t</pre><code>$t</code>"), None);
    }
}
