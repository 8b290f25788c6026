//! Documentation build: `cargo doc` without a warning, and formulas that browsers render, with and without a
//! connection.
//!
//! Formulas stand between `$` in doc comments. rustdoc adds KaTeX, which renders them, to the head of every page. Two
//! things corrupt formulas silently. Markdown removes a backslash before any character except a letter or a blank (`\,`
//! becomes `,`, so formulas use `\thinspace`). Markdown also may treat `]_` or `*` as emphasis.

use std::fs;
use std::path::{Path, PathBuf};

use crate::scan::files_with;
use crate::step::{Failure, Gate, Invocation, Outcome};

/// File that loads KaTeX; relative to the root, where cargo starts rustdoc for the workspace crates.
const HEADER: &str = "controller-core/katex.html";
/// Address of KaTeX in the header, up to its version.
const NETWORK: &str = "https://cdn.jsdelivr.net/npm/katex@";
const PAGES: &str = "target/doc";

/// Builds the pages and checks their formulas.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let flags = format!("-D warnings --html-in-header {HEADER}");
    let doc = Invocation::cargo(&["doc", "--workspace", "--no-deps"]).without_own().env("RUSTDOCFLAGS", &flags);
    gate.commands("documentation without warnings", &[doc])?;
    gate.check("formulas in the documentation", "cargo xtask docs", |gate| {
        let sources = each(&gate.root, "rs", spoiled)?;
        let mut pages = 0;
        for folder in pages_of_members(&gate.root)? {
            pages += each(&folder, "html", unrendered)?;
        }
        Ok(format!("{sources} sources, {pages} pages"))
    })
}

/// Computes the tables and figures of docs/tuning.md, docs/joints.md, docs/evidence/commissioning.md,
/// docs/evidence/tuning.md and docs/reference/cycles.md again.
pub(crate) fn tables(gate: &mut Gate) -> Outcome {
    let write = |invocation: Invocation| invocation.env("GOLDEN", "write").env("DEEP", "1");
    let figures = Invocation::cargo(&["test", "-p", "host-sim", "--test", "rest", "--test", "design", "--"]);
    let tables = Invocation::cargo(&["test", "-p", "integration-tests", "--test", "suite", "--"]);
    // Both commands write the same pages, so they run one after the other.
    let tables = tables.with(&[
        "--test-threads",
        "1",
        "margin::",
        "rest::motors",
        "play::a_shaft",
        "any_joint::",
        "budget::the_table",
    ]);
    let figures = figures.with(&["--test-threads", "1", "in_its_band", "in_play", "its_price", "the_page"]);
    gate.commands("tables and figures in docs", &[write(figures), write(tables)])
}

/// Builds the pages with a local copy of KaTeX, for reading without a connection.
pub(crate) fn offline(gate: &mut Gate) -> Outcome {
    const RERUN: &str = "cargo xtask docs --offline";
    run(gate)?;
    let katex = katex(gate, RERUN)?;
    gate.check("pages for reading offline", RERUN, |gate| {
        let pages = gate.root.join(PAGES);
        lay_beside(&katex.distribution, &pages.join("katex"))?;
        let mut local = 0;
        for file in files_with(&pages, "html").map_err(|error| format!("{}: {error}", pages.display()))? {
            let text = fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
            let depth = file.strip_prefix(&pages).map_or(0, |below| below.components().count() - 1);
            let text = katex.beside(&text, depth);
            if let Some(from) = loaded(&text) {
                return Err(format!("{} loads {from}: is it of an item that is gone? remove {PAGES}", file.display()));
            }
            fs::write(&file, text).map_err(|error| format!("{}: {error}", file.display()))?;
            local += 1;
        }
        Ok(format!("{local} pages; begin at {}", pages.join("controller_core/index.html").display()))
    })
}

/// KaTeX, which renders the formulas, on this machine.
pub(crate) struct Katex {
    version: String,
    /// Folder of the scripts, the style and the fonts.
    pub distribution: PathBuf,
}

impl Katex {
    /// Returns a page that loads KaTeX from `katex/`, `depth` folders above it.
    pub(crate) fn beside(&self, page: &str, depth: usize) -> String {
        beside(page, &self.version, depth)
    }
}

/// Fetches KaTeX from the registry of npm, once. `rerun` is the command for the message.
pub(crate) fn katex(gate: &mut Gate, rerun: &str) -> Result<Katex, Failure> {
    let failed = |reason: String| Failure { reason, rerun: rerun.into() };
    let header = fs::read_to_string(gate.root.join(HEADER)).map_err(|error| failed(format!("{HEADER}: {error}")))?;
    let version = version(&header).ok_or_else(|| failed(format!("{HEADER} does not take KaTeX from {NETWORK}")))?;
    let fetched = PathBuf::from("target/katex").join(version);
    let distribution = gate.root.join(&fetched).join("package/dist");
    if !distribution.join("katex.min.js").exists() {
        if Invocation::new("npm", &["--version"]).answer().is_none() {
            let remedy = "no npm, which fetches KaTeX: install Node.js (on Debian, as root: apt-get install npm)";
            return Err(failed(String::from(remedy)));
        }
        fs::create_dir_all(gate.root.join(&fetched))
            .map_err(|error| failed(format!("{}: {error}", fetched.display())))?;
        let (package, folder) = (format!("katex@{version}"), fetched.display().to_string());
        let pack = Invocation::new("npm", &["pack", "--silent", &package, "--pack-destination", &folder]);
        let archive = fetched.join(format!("katex-{version}.tgz")).display().to_string();
        let unpack = Invocation::new("tar", &["-xzf", &archive, "-C", &folder]);
        gate.commands(&format!("KaTeX {version}"), &[pack, unpack])?;
    }
    Ok(Katex { version: version.into(), distribution })
}

/// Returns the version of KaTeX in a header, for example `0.19.1`.
fn version(header: &str) -> Option<&str> {
    header.split_once(NETWORK)?.1.split('/').next()
}

/// Returns a page at a folder depth that loads KaTeX from local files, which need no checksum.
fn beside(page: &str, version: &str, depth: usize) -> String {
    let local = page.replace(&format!("{NETWORK}{version}/dist/"), &format!("{}katex/", "../".repeat(depth)));
    let mut text = String::new();
    let mut rest = local.trim();
    while let Some((before, after)) = rest.split_once("integrity=\"") {
        text += before.trim_end();
        rest = after.split_once("crossorigin=\"anonymous\"").map_or(after, |(_, after)| after);
    }
    text + rest
}

/// Returns an address from which a page loads a script or a style.
pub(crate) fn loaded(page: &str) -> Option<&str> {
    let tags = page.split('<').filter(|tag| tag.starts_with("script") || tag.starts_with("link"));
    let mut addresses = tags.flat_map(|tag| tag.split('"')).filter(|value| value.contains("://"));
    addresses.next()
}

/// Copies the parts of a distribution that a browser needs: scripts, style, fonts.
pub(crate) fn lay_beside(distribution: &Path, folder: &Path) -> Result<(), String> {
    let told = |path: &Path, error: &std::io::Error| format!("{}: {error}", path.display());
    fs::create_dir_all(folder.join("contrib")).map_err(|error| told(folder, &error))?;
    fs::create_dir_all(folder.join("fonts")).map_err(|error| told(folder, &error))?;
    let fonts = files_with(&distribution.join("fonts"), "woff2").map_err(|error| told(distribution, &error))?;
    let rest = ["katex.min.css", "katex.min.js", "contrib/auto-render.min.js"].map(|name| distribution.join(name));
    for file in fonts.iter().chain(&rest) {
        let to = folder.join(file.strip_prefix(distribution).unwrap_or(file));
        fs::copy(file, &to).map_err(|error| told(file, &error))?;
    }
    Ok(())
}

/// Returns the folders with the pages of the workspace crates.
fn pages_of_members(root: &Path) -> Result<Vec<PathBuf>, String> {
    let manifest = fs::read_to_string(root.join("Cargo.toml")).map_err(|error| format!("Cargo.toml: {error}"))?;
    let members = manifest.split_once("members = [").and_then(|(_, rest)| rest.split(']').next()).unwrap_or_default();
    let folders = members.split('"').skip(1).step_by(2).map(|name| root.join(PAGES).join(name.replace('-', "_")));
    let folders: Vec<PathBuf> = folders.filter(|folder| folder.is_dir()).collect();
    if folders.is_empty() { Err(format!("no pages in {PAGES}")) } else { Ok(folders) }
}

/// Applies `fault` to the text of every file with the extension; returns their number, or the first fault.
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

/// Returns a formula of a doc comment that Markdown would change.
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
    // A backslash survives before a letter or a blank. Outside of code spans, every second section between `$` is a
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

/// Returns a formula of a Markdown page whose stars Markdown takes for emphasis.
pub(crate) fn starred(page: &str) -> Option<&str> {
    // A code span may contain a `$`, so the formulas are sought between the spans.
    page.split('`').step_by(2).find_map(|text| formulas(text).find(|formula| formula.matches('*').count() > 1))
}

/// Returns the error of a page whose formulas are not rendered correctly.
pub(crate) fn unrendered(page: &str) -> Option<String> {
    let body = page.split_once("<body").map_or(page, |(_, body)| body);
    let text = without_code(body).replace("$$", "$");
    if text.contains('$') && !page.contains("renderMathInElement") {
        return Some(String::from("a formula, but no KaTeX: a page of an item that is gone? remove target/doc"));
    }
    let marked =
        |formula: &&str| ["<em>", "</em>", "<strong>", "</strong>", "<a "].iter().any(|tag| formula.contains(tag));
    formulas(&text).find(marked).map(|formula| {
        format!(
            "markdown reads `_` or `*` of `{}` as emphasis: put a blank before the `_`, write \\ast",
            formula.trim()
        )
    })
}

fn formulas(text: &str) -> impl Iterator<Item = &str> {
    text.split('$').skip(1).step_by(2)
}

/// Returns the page without the parts that KaTeX ignores.
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
    fn two_stars_in_a_formula_are_found() {
        assert_eq!(starred("a $x^* + y^*$ b"), Some("x^* + y^*"));
        assert_eq!(starred("*a* $x^*$ and `$ * *` *b*"), None);
    }

    #[test]
    fn beside_its_pages_katex_is_loaded_from_no_other_place() {
        let header = include_str!("../../controller-core/katex.html");
        let version = version(header).expect("a version");
        assert!(loaded(header).is_some_and(|address| address.starts_with(NETWORK)));
        let local = beside(header, version, 2);
        assert_eq!(loaded(&local), None, "{local}");
        assert!(local.contains("src=\"../../katex/contrib/auto-render.min.js\"\n  onload='renderMath"), "{local}");
        assert_eq!((local.matches("../../katex/").count(), local.matches("integrity").count()), (3, 0));
        assert_eq!(loaded("<a href=\"https://a.b\">"), None);
    }

    #[test]
    fn a_page_with_a_formula_must_load_katex() {
        assert!(unrendered("<p>$x$</p>").is_some());
        assert_eq!(unrendered("<p>$x$</p><script>renderMathInElement(document.body)</script>"), None);
        assert!(unrendered("<p>$a]<em>{k}$ and $b</em>{i}$</p>renderMathInElement").is_some());
        assert_eq!(unrendered("<pre class=\"x\">$t</pre><code>$t</code>"), None);
    }
}
