//! The pages in `docs` as a book for a browser, in `target/book`. It needs no connection: KaTeX is beside the pages,
//! and so is each file of the project that a page links to.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::docs::{Katex, katex, lay_beside, loaded, unrendered};
use crate::scan::files_with;
use crate::step::{Gate, Invocation, Outcome};

/// Program that makes a book of the pages, its version, and the folder of installed programs.
const MDBOOK: &str = "0.5.4";
const TOOLS: &str = "target/tools";
/// The book. Its pages have the place in it that their sources have in the project, so that links to sources hold.
const BOOK: &str = "target/book";
const SOURCES: &str = "docs";
const RERUN: &str = "cargo xtask book";

/// Builds the book.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let program = format!("{TOOLS}/bin/mdbook");
    if Invocation::new(&program, &["--version"]).answer_in(gate).is_none_or(|answer| !answer.contains(MDBOOK)) {
        let install = Invocation::cargo(&["install", "mdbook", "--locked", "--version", MDBOOK, "--root", TOOLS]);
        gate.commands(
            &format!("mdbook {MDBOOK}"),
            &[install.with(&["--no-default-features", "--features", "search"])],
        )?;
    }
    let katex = katex(gate, RERUN)?;
    gate.commands("pages of the book", &[Invocation::new(&program, &["build", SOURCES])])?;
    gate.check("links and formulas of the book", RERUN, |gate| complete(&gate.root, &katex))
}

/// Adds KaTeX and the linked files of the project to the book, and checks every link.
fn complete(root: &Path, katex: &Katex) -> Result<String, String> {
    let book = root.join(BOOK);
    let pages = book.join(SOURCES);
    lay_beside(&katex.distribution, &pages.join("katex"))?;
    let mut count = 0;
    for page in files_with(&pages, "html").map_err(|error| format!("{}: {error}", pages.display()))? {
        let told = |error: std::io::Error| format!("{}: {error}", page.display());
        let folder = page.parent().unwrap_or(&pages);
        let depth = folder.strip_prefix(&pages).map_or(0, |below| below.components().count());
        let text = fs::read_to_string(&page).map_err(told)?;
        let mut text = katex.beside(&text, depth);
        if let Some(fault) = loaded(&text).map(|from| format!("loads {from}")).or_else(|| unrendered(&text)) {
            return Err(format!("{}: {fault}", page.display()));
        }
        for link in local_links(&text) {
            let target = resolved(folder, &link);
            if target.exists() {
                continue;
            }
            let place = target.strip_prefix(&book).map_err(|_| format!("{}: link to {link}", page.display()))?;
            // mdbook takes each linked Markdown file for a page of the book.
            let source = if root.join(place).exists() { place.to_path_buf() } else { place.with_extension("md") };
            copy(&root.join(&source), &book.join(&source))
                .map_err(|error| format!("{}: link to {link}: {}: {error}", page.display(), source.display()))?;
            if source != place {
                let written = link.strip_suffix("html").map(|stem| format!("{stem}md")).unwrap_or_default();
                text = text.replace(&format!("href=\"{link}"), &format!("href=\"{written}"));
            }
        }
        fs::write(&page, text).map_err(told)?;
        count += 1;
    }
    Ok(format!("{count} pages; begin at {}", pages.join("index.html").display()))
}

/// Returns the targets of the links to other files, without their anchors.
fn local_links(page: &str) -> BTreeSet<String> {
    let values = page.split(" href=\"").skip(1).filter_map(|rest| rest.split('"').next());
    let files = values.map(|value| value.split('#').next().unwrap_or_default());
    files.filter(|file| !file.is_empty() && !file.contains(':')).map(str::to_owned).collect()
}

/// Returns the file that a link names, without `..`.
fn resolved(folder: &Path, link: &str) -> PathBuf {
    let mut path = folder.to_path_buf();
    for part in Path::new(link).components() {
        match part {
            Component::ParentDir => _ = path.pop(),
            Component::Normal(name) => path.push(name),
            _ => {}
        }
    }
    path
}

/// Copies a file, or the files of a folder without those of its folders.
fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    if from.is_dir() {
        fs::create_dir_all(to)?;
        for entry in fs::read_dir(from)? {
            let path = entry?.path();
            if path.is_file() {
                fs::copy(&path, to.join(path.file_name().unwrap_or_default()))?;
            }
        }
        return Ok(());
    }
    fs::create_dir_all(to.parent().unwrap_or(to))?;
    fs::copy(from, to).map(|_| ())
}
