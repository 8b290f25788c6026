//! Live page: built, measured, and clicked through in a browser without a screen.
//!
//! `cargo xtask web` compiles `web` for WebAssembly and lays the page beside it. The deep part compares the bits of the
//! module with this machine and the page's C file with `host-sim`, and drives the page by real clicks.

use std::fs;
use std::path::Path;

use crate::setup::BROWSER;
use crate::step::{Failure, Gate, Invocation, Outcome};
use crate::wasm::{self, NODE, TARGET};

const MANIFEST: &str = "web/Cargo.toml";
/// Separate target folder, because the artifacts come from another compiler.
const TARGET_DIR: &str = "target/web";
const MODULE: &str = "target/web/wasm32-unknown-unknown/release/edo_smc_web.wasm";
/// The finished page: files for any static server.
pub(crate) const PAGE: &str = "target/web/page";
const SOURCES: &str = "web/page";
/// Files of uPlot that the page loads.
const CHARTS: [&str; 2] =
    ["web/node_modules/uplot/dist/uPlot.iife.min.js", "web/node_modules/uplot/dist/uPlot.min.css"];
/// File that npm writes after an installation.
const INSTALLED: &str = "web/node_modules/.package-lock.json";
const LOCK: &str = "web/package-lock.json";
const RERUN: &str = "cargo xtask test --deep web";
/// Largest size of all files of the page together, compressed, bytes. The goal is 1 MB.
const MOST: u64 = 1_140_000;
/// Script that prints name, size and compressed size of each file of a folder.
const SIZES: &str = "\
    const { readdirSync, readFileSync } = require('fs');\
    for (const name of readdirSync(process.argv[1])) {\
        const file = readFileSync(process.argv[1] + '/' + name);\
        console.log(name, file.length, require('zlib').gzipSync(file, { level: 9 }).length);\
    }";

/// Builds the page and prints its sizes.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let build = wasm::build()?.with(&["--manifest-path", MANIFEST, "--lib", "--target-dir", TARGET_DIR]);
    gate.commands(&format!("live page for {TARGET}"), &[build])?;
    gate.step("packages of the page", packages)?;
    gate.check("files of the page", "cargo xtask web", |gate| {
        lay_out(&gate.root).map_err(|error| format!("{PAGE}: {error}"))?;
        let sizes = Invocation::new(NODE, &["-e", SIZES, PAGE]).answer_in(gate);
        sizes.ok_or_else(|| format!("{NODE} did not run: on Debian, apt-get install nodejs")).and_then(|it| judged(&it))
    })
}

/// Installs the packages of npm, unless they are there.
fn packages(gate: &Gate) -> Outcome {
    let changed = |name: &str| fs::metadata(gate.root.join(name)).and_then(|about| about.modified()).ok();
    if changed(INSTALLED).is_some_and(|at| changed(LOCK).is_some_and(|lock| at >= lock)) {
        println!("{INSTALLED} is newer than {LOCK}");
        return Ok(());
    }
    let install = Invocation::new("npm", &["ci", "--prefix", "web", "--no-audit", "--no-fund", "--ignore-scripts"]);
    install.run(gate).map_err(|failure| Failure {
        reason: format!(
            "{}\nthe page needs npm (on Debian: apt-get install npm) and a way to its registry",
            failure.reason
        ),
        rerun: String::from("cargo xtask web"),
    })
}

/// Copies module, page and charts into the folder of the page.
fn lay_out(root: &Path) -> std::io::Result<()> {
    let page = root.join(PAGE);
    if page.exists() {
        fs::remove_dir_all(&page)?;
    }
    fs::create_dir_all(&page)?;
    let sources = fs::read_dir(root.join(SOURCES))?.map(|entry| entry.map(|it| it.path()));
    let others = CHARTS.iter().chain([&MODULE]).map(|name| Ok(root.join(name)));
    for file in sources.chain(others) {
        let file = file?;
        fs::copy(&file, page.join(file.file_name().unwrap_or_default()))?;
    }
    Ok(())
}

/// Returns the sizes in words, or the error that the page is too large.
fn judged(sizes: &str) -> Result<String, String> {
    let compressed = |line: &str| line.rsplit(' ').next().and_then(|number| number.parse::<u64>().ok());
    let all: Option<Vec<u64>> = sizes.lines().map(compressed).collect();
    let sum: u64 = all.ok_or_else(|| format!("sizes in unknown form: {sizes}"))?.iter().sum();
    println!("file, bytes, compressed\n{sizes}");
    if sum < MOST {
        Ok(format!("{sum} bytes compressed, below {MOST}"))
    } else {
        Err(format!("{sum} bytes compressed, {MOST} allowed"))
    }
}

/// Builds the page and tests it.
pub(crate) fn test(gate: &mut Gate) -> Outcome {
    let cargo = |arguments: &[&str]| Invocation::cargo(arguments).with(&["--manifest-path", MANIFEST]);
    let format = cargo(&["fmt"]).with(&["--check"]);
    let clippy = cargo(&["clippy", "--all-targets", "--target-dir", TARGET_DIR]).with(&["--", "-D", "warnings"]);
    gate.commands("format and lints, live page", &[format, clippy])?;
    run(gate)?;
    let native = cargo(&["build", "--bin", "edo-smc-web", "--target-dir", TARGET_DIR]);
    gate.commands("answers of the page, on this machine", &[native])?;
    gate.check("bits of the page, WebAssembly against this machine", RERUN, |gate| {
        let said = |it: &Invocation| it.answer_in(gate).ok_or_else(|| format!("no answer: {it}"));
        let here = said(&Invocation::new("target/web/debug/edo-smc-web", &["bits"]))?;
        let there = said(&Invocation::new(NODE, &["web/test/answer.mjs", MODULE, "--bits"]))?;
        same(&here, &there)
    })?;
    if Invocation::new(BROWSER, &["--version"]).answer().is_none() {
        let reason = format!("no {BROWSER}, which clicks through the page: on Debian, apt-get install {BROWSER}");
        return Err(Failure { reason, rerun: RERUN.into() });
    }
    let program = gate.built()?.path("host-sim")?.display().to_string();
    let clicks = Invocation::new(NODE, &["web/test/page.mjs", PAGE, "target/web/test"])
        .env("EDO_SMC_HOST_SIM", &program)
        .env("EDO_SMC_BROWSER", BROWSER);
    gate.commands("live page, clicked through", &[clicks])
}

/// Compares the hashes, one scenario per line. A scenario without a result is an error.
fn same(here: &str, there: &str) -> Result<String, String> {
    if here.is_empty() || here.contains("no result") {
        return Err(format!("a scenario has no result: {here}"));
    }
    wasm::equal(here, there)?;
    Ok(format!("{} scenarios, 0 bits differ\n{here}", here.lines().count()))
}

#[cfg(test)]
mod tests {
    use super::{judged, same};

    #[test]
    fn one_different_digit_or_a_scenario_without_a_result_is_told() {
        assert!(same("motor 12ab\njoint 0f01", "motor 12ab\njoint 0f01").is_ok());
        for (here, there) in [("motor 12ab", "motor 12ac"), ("motor no result", "motor no result"), ("", "")] {
            assert!(same(here, there).is_err(), "{here} {there}");
        }
    }

    #[test]
    fn the_page_has_a_largest_size() {
        assert!(judged("a.wasm 2000000 600000\nb.js 1000 300").is_ok());
        assert!(judged("a.wasm 9000000 1159800\nb.js 1000 300").is_err());
        assert!(judged("nothing").is_err());
    }
}
