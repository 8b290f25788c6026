//! Compile errors for invalid designs in a `const`.
//!
//! Every file in `compile_pass/` must compile. Every file in `compile_fail/` must fail with each line of its `.stderr`
//! file. Only the project's own text is compared, not the compiler's framing, so a newer compiler does not break the
//! test. The files are examples of a small generated package; its library is the valid design that they change. The
//! package depends on the controller only.

use integration_tests::data::path;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

/// Library of the package, in `compile_pass/`.
const GOOD_DESIGN: &str = "good_design";

/// Returns the cases in a folder of this package, by name.
fn sources(folder: &str) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(path(folder))
        .expect("the folder of cases")
        .map(|entry| entry.expect("an entry").path())
        .filter(|file| file.extension().is_some_and(|extension| extension == "rs") && stem(file) != GOOD_DESIGN)
        .collect();
    files.sort();
    files
}

fn stem(file: &Path) -> &str {
    file.file_stem().and_then(|stem| stem.to_str()).expect("a plain name")
}

/// Creates a package with every case as an example; returns its folder.
fn package(files: &[PathBuf]) -> PathBuf {
    let root = path("..").canonicalize().expect("the workspace");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("compile-cases");
    fs::create_dir_all(&folder).expect("a folder for the package");
    let controller = root.join("controller-core");
    let controller = controller.to_str().expect("a plain path");
    let library = path("compile_pass").join(GOOD_DESIGN).with_extension("rs");
    let library = library.to_str().expect("a plain path");
    let mut manifest = format!(
        "[package]\nname = \"compile-cases\"\nedition = \"2024\"\nautoexamples = false\n[lib]\npath = {library:?}\n\
         [workspace]\n[dependencies]\ncontroller-core = {{ path = {controller:?} }}\n"
    );
    for file in files {
        let (name, path) = (stem(file), file.to_str().expect("a plain path"));
        write!(manifest, "[[example]]\nname = {name:?}\npath = {path:?}\n").expect("a string takes all");
    }
    fs::write(folder.join("Cargo.toml"), manifest).expect("the manifest");
    // The lock file of the workspace; cargo drops the unused entries.
    fs::copy(root.join("Cargo.lock"), folder.join("Cargo.lock")).expect("the lock file");
    folder
}

/// Compiles one case; returns success and the compiler output with uniform white space.
fn check(folder: &Path, name: &str) -> (bool, String) {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["check", "--quiet", "--offline", "--color=never", "--example", name])
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", folder.join("target"))
        .env_remove("RUSTFLAGS")
        .output()
        .expect("cargo runs");
    let said = String::from_utf8_lossy(&output.stderr);
    (output.status.success(), said.split_whitespace().collect::<Vec<_>>().join(" "))
}

#[test]
fn good_design_in_a_const_compiles_and_a_bad_one_says_why_it_does_not() {
    let (good, bad) = (sources("compile_pass"), sources("compile_fail"));
    assert!(!good.is_empty() && bad.len() >= 10, "cases are missing");
    let all: Vec<PathBuf> = good.iter().chain(&bad).cloned().collect();
    let folder = package(&all);
    for file in &good {
        let (compiles, said) = check(&folder, stem(file));
        assert!(compiles, "{} must compile: {said}", file.display());
    }
    for file in &bad {
        let (compiles, said) = check(&folder, stem(file));
        assert!(!compiles, "{} must not compile", file.display());
        let expected = fs::read_to_string(file.with_extension("stderr")).expect("the expected message");
        assert!(!expected.trim().is_empty(), "{}: an empty message", file.display());
        for line in expected.lines() {
            assert!(said.contains(line.trim()), "{}: expected\n{line}\nin\n{said}", file.display());
        }
    }
}
