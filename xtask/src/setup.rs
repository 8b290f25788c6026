//! Check of the tools. Missing tools are installed if this needs no decision of the user; otherwise the error names the
//! packages. The rustup toolchain is never changed.

use std::path::Path;

use crate::compiler::{Compiler, DEBIAN_PACKAGES, TARGET};
use crate::step::{Failure, Gate, Invocation, Outcome};
use crate::{capi, evidence, wasm};

/// Emulator of the chip and its board.
const EMULATOR: &str = "qemu-system-arm";
const BOARD: &str = "netduinoplus2";
/// C compiler for the chip.
pub(crate) const CROSS_C: &str = "arm-none-eabi-gcc";
/// Programs for firmware in C, and their packages.
const FOR_C: [(&str, &[&str]); 3] =
    [(CROSS_C, &["gcc-arm-none-eabi", "libnewlib-arm-none-eabi"]), ("make", &["make"]), ("cmake", &["cmake"])];
/// Browser that opens reports and the live page without a screen.
pub(crate) const BROWSER: &str = "chromium";
/// Instruction counter on the host.
const VALGRIND: &str = "valgrind";

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.check("tools: cargo fmt, cargo clippy", "cargo xtask setup", |_| {
        for tool in ["fmt", "clippy"] {
            if Invocation::cargo(&[tool, "--version"]).answer().is_none() {
                let component = if tool == "fmt" { "rustfmt" } else { tool };
                return Err(format!("`cargo {tool}` is missing: rustup component add {component}"));
            }
        }
        Ok(String::from("present"))
    })?;
    gate.step(
        &format!("compilers for {TARGET} and other cores, emulator of the chip, compilers for C and C++, Node"),
        |gate| {
            let missing = missing();
            if !missing.is_empty() {
                install(gate, &missing)?;
            }
            println!("{}\n{}", Compiler::required()?, emulator().unwrap_or_default());
            Ok(())
        },
    )
}

/// A missing tool.
struct Missing {
    what: String,
    packages: &'static [&'static str],
}

fn missing() -> Vec<Missing> {
    let mut missing = Vec::new();
    for target in capi::targets().filter(|target| Compiler::find_for(target, "core").is_none()) {
        let what = format!("no compiler here has the core library for {target} (or: rustup target add {target})");
        missing.push(Missing { what, packages: &DEBIAN_PACKAGES });
    }
    if emulator().is_none() {
        missing.push(Missing { what: format!("no {EMULATOR} with the board {BOARD}"), packages: &[EMULATOR] });
    }
    if Invocation::new("c++", &["--version"]).answer().is_none() {
        missing.push(Missing {
            what: String::from("no C++ compiler `c++`, for libFuzzer and the C interface"),
            packages: &["g++"],
        });
    }
    for (program, packages) in FOR_C {
        if Invocation::new(program, &["--version"]).answer().is_none() {
            missing.push(Missing { what: format!("no `{program}`, for firmware in C"), packages });
        }
    }
    for (program, packages) in evidence::PROGRAMS {
        if Invocation::new(program, &["--version"]).answer().is_none() {
            missing.push(Missing { what: format!("no `{program}`, which looks at exported C"), packages });
        }
    }
    if Invocation::new("python3", &["-m", "venv", "--help"]).answer().is_none() {
        let what = String::from("no `python3 -m venv`, for the solver and other programs of Python");
        missing.push(Missing { what, packages: &["python3-venv"] });
    }
    // gcc prints a missing file's name without a folder.
    if Invocation::new(CROSS_C, &["-print-file-name=nano.specs"]).answer().is_some_and(|path| !path.contains('/')) {
        let what = format!("no C library (newlib-nano) for {CROSS_C}");
        missing.push(Missing { what, packages: &["libnewlib-arm-none-eabi"] });
    }
    if wasm::compiler().is_none() {
        let target = wasm::TARGET;
        let what = format!("no compiler here has the standard library for {target} (or: rustup target add {target})");
        missing.push(Missing { what, packages: &DEBIAN_PACKAGES });
    }
    if Invocation::new(wasm::NODE, &["--version"]).answer().is_none() {
        missing.push(Missing { what: format!("no `{}`, which runs WebAssembly", wasm::NODE), packages: &["nodejs"] });
    }
    if Invocation::new(BROWSER, &["--version"]).answer().is_none() {
        let what = format!("no {BROWSER}, in which reports are opened");
        missing.push(Missing { what, packages: &[BROWSER] });
    }
    if Invocation::new(VALGRIND, &["--version"]).answer().is_none() {
        let what = format!("no {VALGRIND}, which counts instructions on the host");
        missing.push(Missing { what, packages: &[VALGRIND] });
    }
    missing
}

/// Returns the emulator's version, if it supports the board.
fn emulator() -> Option<String> {
    let boards = Invocation::new(EMULATOR, &["-machine", "help"]).answer()?;
    let version = Invocation::new(EMULATOR, &["--version"]).answer()?;
    boards.contains(BOARD).then(|| version.lines().next().unwrap_or_default().to_string())
}

/// Returns whether packages can be installed: root on Debian.
fn can_install() -> bool {
    let is_root = Invocation::new("id", &["-u"]).answer().as_deref() == Some("0");
    is_root && Path::new("/etc/debian_version").exists()
}

/// Installs everything that is missing, if possible.
fn install(gate: &Gate, missing: &[Missing]) -> Outcome {
    let packages: Vec<&str> = missing.iter().flat_map(|missing| missing.packages).copied().collect();
    let all = Invocation::new("apt-get", &["install", "-y", "--no-install-recommends"]).with(&packages);
    if !can_install() {
        return Err(by_hand(missing, &all));
    }
    Invocation::new("apt-get", &["update"]).run(gate)?;
    all.clone().env("DEBIAN_FRONTEND", "noninteractive").run(gate)?;
    let left = self::missing();
    if left.is_empty() { Ok(()) } else { Err(by_hand(&left, &all)) }
}

fn by_hand(missing: &[Missing], apt_get: &Invocation) -> Failure {
    let what: Vec<&str> = missing.iter().map(|missing| missing.what.as_str()).collect();
    Failure {
        reason: format!("{}\ninstall what is missing; on Debian, as root:\n  {apt_get}", what.join("\n")),
        rerun: String::from("cargo xtask setup"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named_with_one_line_that_installs_it() {
        let missing = [
            Missing { what: String::from("no compiler"), packages: &DEBIAN_PACKAGES },
            Missing { what: String::from("no emulator"), packages: &[EMULATOR] },
        ];
        let packages: Vec<&str> = missing.iter().flat_map(|missing| missing.packages).copied().collect();
        let apt_get = Invocation::new("apt-get", &["install"]).with(&packages);
        let reason = by_hand(&missing, &apt_get).reason;
        assert!(reason.starts_with("no compiler\nno emulator\n"), "{reason}");
        assert!(reason.ends_with("apt-get install rustc-web rust-web-src qemu-system-arm"), "{reason}");
    }
}
