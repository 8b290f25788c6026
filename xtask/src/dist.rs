//! Files of a release in `target/dist`, with their checksums.
//!
//! The host program with its manual and completions, the C package, the live page, FMUs of the template motor, the
//! Python wheel, the crates, and the bills of materials. An archive depends on the bytes of its files only: it is
//! packed twice and compared. Then the release is used as a user would: unpacked, installed in an empty environment,
//! run.

use std::fs;
use std::path::{Path, PathBuf};

use crate::python::Environment;
use crate::step::{Failure, Gate, Invocation, Outcome};
use crate::{capi, firmware, sbom, web, wheel};

const FOLDER: &str = "target/dist";
/// Folders that become archives.
const STAGE: &str = "target/dist-stage";
const PROGRAM: &str = "target/release/host-sim";
const RERUN: &str = "cargo xtask dist";
/// Empty environment for the wheel; numpy is its only requirement.
const USER: Environment = Environment { folder: "target/dist-env", packages: &["numpy==2.4.6"], rerun: RERUN };
const SUMS: &str = "SHA256SUMS";
/// Files beside every program.
const PAGES: [&str; 4] = ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"];
/// Shells with their completion file.
const SHELLS: [(&str, &str); 3] = [("bash", "host-sim"), ("zsh", "_host-sim"), ("fish", "host-sim.fish")];

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let name = format!("edo-smc-{}", env!("CARGO_PKG_VERSION"));
    let [program, c, page, fmu] = ["x86_64-linux", "c", "page", "fmu"].map(|part| format!("{name}-{part}"));
    let parts = [&program, &c, &page, &fmu];
    for folder in [FOLDER, STAGE] {
        gate.empty_folder(folder, RERUN)?;
    }
    let build = ["build", "--release", "--locked", "-p", "host-sim", "--features", "full"];
    gate.commands("host program", &[Invocation::cargo(&build)])?;
    gate.step("manual and completions", |gate| stage_program(gate, &Path::new(STAGE).join(&program)))?;
    firmware::run(gate)?;
    capi::run(gate, capi::Cores::All)?;
    let (built, staged) = (format!("{STAGE}/c-build"), format!("{STAGE}/{c}"));
    let cmake = [
        Invocation::new("cmake", &["-S", "controller-capi", "-B", &built]),
        Invocation::new("cmake", &["--install", &built, "--prefix", &staged]),
        beside(&staged),
    ];
    gate.commands("C package", &cmake)?;
    web::run(gate)?;
    let staged = format!("{STAGE}/{page}");
    gate.commands("live page", &[Invocation::new("cp", &["-r", web::PAGE, &staged]), beside(&staged)])?;
    gate.step("FMUs of a motor", |gate| stage_fmus(gate, &format!("{STAGE}/{fmu}")))?;
    sbom::run(gate)?;
    wheel::build(gate)?;
    let crates = ["package", "--workspace", "--target-dir", "target/dist-crates"];
    gate.commands("crates, each built from its package", &[Invocation::cargo(&crates).without_own()])?;
    gate.step("archives", |gate| {
        for part in parts {
            pack(part, FOLDER).run(gate)?;
        }
        collect(gate, "target/python/wheels", "whl")?;
        collect(gate, "target/dist-crates/package", "crate")?;
        collect(gate, "target/sbom", "spdx.json")
    })?;
    gate.step("archives: equal bytes a second time", |gate| {
        let again = format!("{STAGE}/again");
        fs::create_dir_all(gate.root.join(&again)).map_err(|error| failed(format!("{again}: {error}")))?;
        for part in parts {
            pack(part, &again).run(gate)?;
            Invocation::new("cmp", &[&archive(part, FOLDER), &archive(part, &again)]).run(gate)?;
        }
        Ok(())
    })?;
    gate.step("checksums", |gate| {
        let sums = sums(gate).map_err(failed)?;
        let path = gate.root.join(FOLDER).join(SUMS);
        fs::write(&path, &sums).map_err(|error| failed(format!("{}: {error}", path.display())))?;
        print!("{sums}");
        Ok(())
    })?;
    try_out(gate, &program)
}

fn failed(reason: String) -> Failure {
    Failure { reason, rerun: RERUN.into() }
}

/// Copies readme, changelog and licences into a folder.
fn beside(folder: &str) -> Invocation {
    Invocation::new("cp", &["-t", folder]).with(&PAGES)
}

/// Exports controller and plant of the template motor as FMUs, with their scenario.
fn stage_fmus(gate: &Gate, folder: &str) -> Outcome {
    let program = gate.root.join(PROGRAM).display().to_string();
    let script = "mkdir -p \"$0\" && cd \"$0\" && \"$1\" new motor --plant motor && \"$1\" export motor.toml --fmu \
                  motor_controller.fmu && \"$1\" export motor.toml --fmu-plant motor_plant.fmu";
    Invocation::new("sh", &["-c", script, folder, &program]).run(gate)?;
    beside(folder).run(gate)
}

/// Lays out the archive of the host program.
fn stage_program(gate: &Gate, folder: &Path) -> Outcome {
    let at = |part: &str| folder.join(part).display().to_string();
    let [bin, man, completions] = ["bin", "share/man/man1", "share/completions"].map(at);
    Invocation::new("mkdir", &["-p", &bin, &man, &completions]).run(gate)?;
    Invocation::new("cp", &[PROGRAM, &bin]).run(gate)?;
    Invocation::new("strip", &[&format!("{bin}/host-sim")]).run(gate)?;
    beside(&at("")).run(gate)?;
    let program = format!("{bin}/host-sim");
    Invocation::new(&program, &["man", &man]).run(gate)?;
    for (shell, file) in SHELLS {
        let script = Invocation::new(&program, &["completions", shell]).answer_in(gate);
        let script = script.ok_or_else(|| failed(format!("{program} completions {shell} failed")))?;
        let path = gate.root.join(&completions).join(file);
        fs::write(&path, script + "\n").map_err(|error| failed(format!("{}: {error}", path.display())))?;
    }
    Ok(())
}

fn archive(part: &str, folder: &str) -> String {
    format!("{folder}/{part}.tar.gz")
}

/// Packs a folder of the stage. Names are sorted; times, owners and the name of the machine are left out.
fn pack(part: &str, folder: &str) -> Invocation {
    let fixed = ["--sort=name", "--mtime=@0", "--owner=0", "--group=0", "--numeric-owner", "--mode=u=rwX,go=rX"];
    Invocation::new("tar", &fixed).with(&["-I", "gzip -n -9", "-C", STAGE, "-cf", &archive(part, folder), part])
}

/// Copies the files with this ending into the release.
fn collect(gate: &Gate, folder: &str, ending: &str) -> Outcome {
    let mut found = files(&gate.root.join(folder)).map_err(failed)?;
    found.retain(|path| path.to_string_lossy().ends_with(&format!(".{ending}")));
    if found.is_empty() {
        return Err(failed(format!("{folder} has no file *.{ending}")));
    }
    for path in found {
        let to = gate.root.join(FOLDER).join(path.file_name().unwrap_or_default());
        fs::copy(&path, &to).map_err(|error| failed(format!("{}: {error}", to.display())))?;
    }
    Ok(())
}

/// Returns the files of a folder, sorted.
fn files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut found: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    found.retain(|path| path.is_file());
    found.sort();
    Ok(found)
}

/// Returns the checksums of the release, as `sha256sum` writes them.
fn sums(gate: &Gate) -> Result<String, String> {
    let names: Vec<String> = files(&gate.root.join(FOLDER))?
        .iter()
        .filter_map(|path| Some(path.file_name()?.to_str()?.to_owned()))
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let script = "cd \"$0\" && sha256sum \"$@\"";
    let said = Invocation::new("sh", &["-c", script, FOLDER]).with(&names).answer_in(gate);
    said.map(|said| said + "\n").ok_or_else(|| String::from("sha256sum failed"))
}

/// Uses the release: the program from its archive, and the wheel in an environment with numpy alone.
fn try_out(gate: &mut Gate, program: &str) -> Outcome {
    let user = format!("{STAGE}/user");
    let script = "cd \"$0\" && \"./$1/bin/host-sim\" new mine --plant motor && \"./$1/bin/host-sim\" run mine.toml";
    let commands = [
        Invocation::new("sh", &["-c", "cd \"$0\" && sha256sum -c --quiet \"$1\"", FOLDER, SUMS]),
        Invocation::new("mkdir", &["-p", &user]),
        Invocation::new("tar", &["-xzf", &archive(program, FOLDER), "-C", &user]),
        Invocation::new("sh", &["-c", script, &user, program]),
    ];
    gate.commands("a motor with the program of the archive", &commands)?;
    gate.step("the wheel in an empty environment", |gate| {
        USER.ready(gate)?;
        let python = USER.program("python");
        let install = ["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps", "--no-index"];
        Invocation::new(&python, &install).with(&["--find-links", FOLDER, "edo-smc"]).run(gate)?;
        let script = "import edo_smc; print(edo_smc.Motor(inertia_kg_m2=2e-4, torque_n_m_per_a=0.05, max_current_a=10, \
                      encoder={'bits': 14}).design())";
        Invocation::new(&python, &["-c", script]).run(gate)
    })
}
