//! C packages: CMake, pkg-config, Conan and Arduino, the exported file in strict C++, and the RTOS example.
//!
//! Each package is built and run in a folder of [`FOLDER`]. Errors for users are provoked, too: each must contain its
//! remedy.

use std::fs;
use std::path::{Path, PathBuf};

use crate::python::Environment;
use crate::setup::CROSS_C;
use crate::step::{Failure, Gate, Invocation, Outcome};

/// Folder of all builds; it is emptied first.
const FOLDER: &str = "target/packages";
const RERUN: &str = "cargo xtask test --deep packages";
/// Conan, MIT. It brings PyYAML, which reads the manifests in [`PAGE`].
const ENVIRONMENT: Environment =
    Environment { folder: "target/packages-env", packages: &["conan==2.34.0"], rerun: RERUN };
/// Programs, and the Debian packages that install them.
const PROGRAMS: [(&str, &str); 6] = [
    ("cmake", "cmake"),
    ("pkg-config", "pkg-config"),
    ("gcc", "gcc"),
    ("g++", "g++"),
    (CROSS_C, "gcc-arm-none-eabi libnewlib-arm-none-eabi"),
    (CROSS_CXX, "gcc-arm-none-eabi libnewlib-arm-none-eabi"),
];
const CROSS_CXX: &str = "arm-none-eabi-g++";
/// Variable with a `host-sim` to use in place of the built one.
const HOST_SIM: &str = "EDO_SMC_HOST_SIM";
const CAPI: &str = "controller-capi";
const TEST_PACKAGE: &str = "controller-capi/test_package";
const ARDUINO: &str = "packages/arduino";
/// Stand-in for the Arduino core, and test of the class.
const STANDS_IN: &str = "xtask/src/packages";
const EXAMPLE: &str = "packages/arduino/examples/MoveAndHold/MoveAndHold.ino";
const MOTOR: &str = "scenario/scenarios/motor.toml";
const JOINT: &str = "scenario/scenarios/joint.toml";
const RTOS: &str = "examples/rtos_task/rtos_task.c";
const PAGE: &str = "docs/c-packages.md";

/// Compiler flags of cores, and the archive that follows from them.
const CORES: [(&str, &str); 6] = [
    ("-mcpu=cortex-m0", "thumbv6m"),
    ("-mcpu=cortex-m3", "thumbv7m"),
    ("-mcpu=cortex-m4 -mfloat-abi=soft", "thumbv7m"),
    ("-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard", "thumbv7em"),
    ("-mcpu=cortex-m7 -mfpu=fpv5-sp-d16 -mfloat-abi=hard", "thumbv7em"),
    ("-mcpu=cortex-m33 -mfpu=fpv5-sp-d16 -mfloat-abi=hard", "thumbv8m"),
];

/// Warnings of the strict builds.
const WARNINGS: [&str; 5] = ["-Wall", "-Wextra", "-Werror", "-Wconversion", "-ffp-contract=off"];

/// Stand-in for the headers of FreeRTOS: the declarations that the example uses.
const FREERTOS: &str = "#include <stddef.h>
#include <stdint.h>
#define configTICK_RATE_HZ ((TickType_t)1000)
typedef uint32_t TickType_t;
TickType_t xTaskGetTickCount(void);
void vTaskDelay(const TickType_t ticks);
void vTaskDelayUntil(TickType_t *const last, const TickType_t period);
long xTaskCreate(void (*run)(void *), const char *name, uint16_t words, void *with, unsigned long level, void *handle);
void vTaskStartScheduler(void);
";

/// Script that parses the YAML and XML blocks of a page.
const BLOCKS: &str = "import re, sys, yaml, xml.etree.ElementTree as xml
page = open(sys.argv[1]).read()
blocks = re.findall(r'^```(yaml|xml)\\n(.*?)^```$', page, re.M | re.S)
for kind, text in blocks:
    yaml.safe_load(text) if kind == 'yaml' else xml.fromstring(text.encode())
assert {kind for kind, _ in blocks} == {'yaml', 'xml'}, blocks
print(len(blocks), 'manifests of the page parse')";

/// Script that compares the versions in the Arduino manifests with the workspace's.
const MANIFESTS: &str = "import json, sys
folder, version = sys.argv[1:]
keys = dict(line.split('=', 1) for line in open(folder + '/library.properties').read().splitlines())
library = json.load(open(folder + '/library.json'))
assert keys['version'] == library['version'] == version, (keys, library, version)
assert keys['name'] == library['name']
print('manifests of', keys['name'], version)";

/// Builds and runs all packages.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.check("programs for the C packages", RERUN, |_| programs())?;
    let host_sim = match std::env::var(HOST_SIM) {
        Ok(path) => path,
        Err(_) => gate.built()?.path("host-sim")?.display().to_string(),
    };
    let work = Work { folder: gate.root.join(FOLDER), root: gate.root.clone(), host_sim };
    gate.step("drives, exported for the packages", |gate| work.export(gate))?;
    gate.step("CMake package, for this machine", |gate| work.cmake(gate))?;
    gate.step("CMake package, cores by their flags", |gate| work.cores(gate))?;
    gate.step("errors of the CMake package contain their remedy", |gate| work.errors(gate))?;
    gate.step("pkg-config", |gate| work.pkg_config(gate))?;
    gate.step("Conan, installed", |gate| ENVIRONMENT.ready(gate))?;
    gate.step("Conan package", |gate| work.conan(gate))?;
    gate.step("Arduino library", |gate| work.arduino(gate))?;
    gate.step("exported files in strict C++11 and C++14", |gate| work.strict(gate))?;
    gate.step("RTOS example: a missed tick", |gate| work.rtos(gate))?;
    gate.step("commands of the pages", |gate| work.commands(gate))?;
    let page = Invocation::new(&ENVIRONMENT.program("python"), &["-c", BLOCKS, PAGE]);
    gate.commands("manifests of the page", &[page])
}

/// Returns the programs, or the packages of the missing ones.
fn programs() -> Result<String, String> {
    let missing: Vec<String> = PROGRAMS
        .iter()
        .filter(|(program, _)| Invocation::new(program, &["--version"]).answer().is_none())
        .map(|(program, package)| format!("no `{program}`: on Debian, apt-get install {package}"))
        .collect();
    if missing.is_empty() { Ok(PROGRAMS.map(|(program, _)| program).join(", ")) } else { Err(missing.join("\n")) }
}

fn failed(reason: impl std::fmt::Display) -> Failure {
    Failure { reason: reason.to_string(), rerun: RERUN.into() }
}

/// Fails unless a command ends with an error that contains a text.
fn rejects(gate: &Gate, command: &Invocation, text: &str) -> Outcome {
    println!("$ {command}");
    let output = command.command().current_dir(&gate.root).output().map_err(failed)?;
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    // CMake wraps its messages.
    let flat = said.split_whitespace().collect::<Vec<_>>().join(" ");
    if output.status.success() {
        return Err(failed(format!("{command}\nended without an error; expected: {text}\n{said}")));
    }
    if !flat.contains(text) {
        return Err(failed(format!("{command}\nfailed without the text: {text}\n{said}")));
    }
    println!("rejected, as expected: {text}");
    Ok(())
}

/// Folders and programs of a run.
struct Work {
    folder: PathBuf,
    root: PathBuf,
    host_sim: String,
}

impl Work {
    /// Returns a path in the folder of this run.
    fn at(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    /// Returns the absolute path of a file in the repository.
    fn of(&self, name: &str) -> String {
        self.root.join(name).display().to_string()
    }

    fn export(&self, gate: &Gate) -> Outcome {
        if self.folder.exists() {
            fs::remove_dir_all(&self.folder).map_err(failed)?;
        }
        fs::create_dir_all(&self.folder).map_err(failed)?;
        for (scenario, name) in [(MOTOR, "motor_drive.h"), (JOINT, "joint_drive.h")] {
            let export = Invocation::new(&self.host_sim, &["export", scenario, "--lang", "c", "--standalone"]);
            export.with(&["-o", &self.at(name)]).run(gate)?;
        }
        Ok(())
    }

    /// Installs the package, moves it, and builds programs with `find_package` and `FetchContent`.
    fn cmake(&self, gate: &Gate) -> Outcome {
        let (build, installed, moved) = (self.at("package"), self.at("installed"), self.at("moved"));
        Invocation::new("cmake", &["-S", CAPI, "-B", &build]).run(gate)?;
        Invocation::new("cmake", &["--install", &build, "--prefix", &installed]).run(gate)?;
        fs::rename(&installed, &moved).map_err(failed)?;
        self.host(gate, "found", &[&format!("-DCMAKE_PREFIX_PATH={moved}")])?;
        self.host(gate, "fetched", &[&format!("-DEDO_SMC_SOURCE={}", self.root.display())])?;
        self.export_alone(gate)
    }

    /// Exports a scenario in a build without the package and its archives: the drive, and a configuration.
    fn export_alone(&self, gate: &Gate) -> Outcome {
        let (sources, build) = (self.at("alone"), self.at("alone/build"));
        let (functions, scenario) = (self.of("controller-capi/cmake/edo_smc.cmake"), self.of(MOTOR));
        let list = format!(
            "cmake_minimum_required(VERSION 3.21)\nproject(alone C)\ninclude({functions})\n\
             add_library(alone OBJECT alone.c)\nedo_smc_export(TARGET alone SCENARIO {scenario})\n\
             add_library(config OBJECT config.c)\ntarget_include_directories(config PRIVATE {})\n\
             edo_smc_export(TARGET config SCENARIO {scenario} CONFIG)\n",
            self.of("controller-capi/include")
        );
        fs::create_dir_all(&sources).map_err(failed)?;
        fs::write(Path::new(&sources).join("CMakeLists.txt"), list).map_err(failed)?;
        let source = "#include \"motor_drive.h\"\nbool alone(void) { return edo_smc_modes_ok(); }\n";
        fs::write(Path::new(&sources).join("alone.c"), source).map_err(failed)?;
        let source = "#include \"motor_config.h\"\nconst edo_smc_config_motor_t *config(void) { return &my_config; }\n";
        fs::write(Path::new(&sources).join("config.c"), source).map_err(failed)?;
        let host_sim = format!("-DEDO_SMC_HOST_SIM={}", self.host_sim);
        Invocation::new("cmake", &["-S", &sources, "-B", &build, "--log-level=WARNING", &host_sim]).run(gate)?;
        Invocation::new("cmake", &["--build", &build]).run(gate)
    }

    /// Builds the program for this machine and runs it.
    fn host(&self, gate: &Gate, name: &str, with: &[&str]) -> Outcome {
        let build = self.at(name);
        Self::configure(&build, with)
            .with(&[&format!("-DSCENARIO={}", self.of(MOTOR)), &format!("-DEDO_SMC_HOST_SIM={}", self.host_sim)])
            .run(gate)?;
        Invocation::new("cmake", &["--build", &build]).run(gate)?;
        Invocation::new(&format!("{build}/check"), &[]).run(gate)
    }

    fn configure(build: &str, with: &[&str]) -> Invocation {
        Invocation::new("cmake", &["-S", TEST_PACKAGE, "-B", build, "-G", "Unix Makefiles", "--log-level=WARNING"])
            .with(with)
    }

    /// Returns the options of a build for a core.
    fn cross(&self, flags: &str) -> Vec<String> {
        vec![
            "-DCMAKE_SYSTEM_NAME=Generic".into(),
            "-DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY".into(),
            format!("-DCMAKE_C_COMPILER={CROSS_C}"),
            format!("-DCMAKE_C_FLAGS={flags}"),
            "-DCMAKE_EXE_LINKER_FLAGS=--specs=nosys.specs -Wl,--gc-sections -Wl,--no-warnings".into(),
            format!("-DCMAKE_PREFIX_PATH={}", self.at("moved")),
        ]
    }

    /// Links a program for each core; its archive must follow from the flags.
    fn cores(&self, gate: &Gate) -> Outcome {
        for (index, (flags, core)) in CORES.iter().enumerate() {
            let build = self.at(&format!("core-{index}"));
            let options = self.cross(&format!("{flags} -mthumb"));
            let options: Vec<&str> = options.iter().map(String::as_str).collect();
            Self::configure(&build, &options).run(gate)?;
            Invocation::new("cmake", &["--build", &build]).run(gate)?;
            let line = fs::read_to_string(Path::new(&build).join("CMakeFiles/check.dir/link.txt")).map_err(failed)?;
            if !line.contains(&format!("/{core}/libedo_smc.a")) {
                return Err(failed(format!("{flags}: expected the archive of {core}, linked by\n{line}")));
            }
            println!("{flags}: {core}");
        }
        Ok(())
    }

    fn errors(&self, gate: &Gate) -> Outcome {
        let rejected = |name: &str, with: &[&str], text: &str| {
            rejects(gate, &Self::configure(&self.at(&format!("error-{name}")), with), text)
        };
        let found = format!("-DCMAKE_PREFIX_PATH={}", self.at("moved"));
        let choices = "thumbv6m, thumbv7m, thumbv7em, thumbv8m, host";
        rejected(
            "core",
            &[&found, "-DEDO_SMC_CORE=thumbv9"],
            &format!("EDO_SMC_CORE = thumbv9: must be one of {choices}"),
        )?;
        // A Cortex-M4 without an -mfloat-abi, and a core without an archive.
        for (name, flags) in [("abi", "-mcpu=cortex-m4"), ("cpu", "-mcpu=cortex-a9")] {
            let options = self.cross(flags);
            let options: Vec<&str> = options.iter().map(String::as_str).collect();
            rejected(name, &options, &format!("Set -DEDO_SMC_CORE=CORE with one of {choices}"))?;
        }
        // An installation for another core only.
        let (build, one) = (self.at("one-core"), self.at("one"));
        Invocation::new("cmake", &["-S", CAPI, "-B", &build, "-DEDO_SMC_CORE=thumbv7em"]).run(gate)?;
        Invocation::new("cmake", &["--install", &build, "--prefix", &one]).run(gate)?;
        rejected(
            "archive",
            &[&format!("-DCMAKE_PREFIX_PATH={one}")],
            "host/libedo_smc.a: missing. Build it in the folder of edo-smc: cargo xtask capi",
        )?;
        // A fresh clone, whose archives are not built.
        let clone = self.folder.join("clone").join(CAPI);
        fs::create_dir_all(clone.join("cmake")).map_err(failed)?;
        for file in ["CMakeLists.txt", "Cargo.toml", "cmake/edo_smc.cmake"] {
            fs::copy(self.root.join(CAPI).join(file), clone.join(file)).map_err(failed)?;
        }
        let source = format!("-DEDO_SMC_SOURCE={}", self.at("clone"));
        rejected("clone", &[&source], "missing. Build it in the folder of edo-smc: cargo xtask capi")?;
        let package = Invocation::new("cmake", &["-S", &clone.display().to_string(), "-B", &self.at("error-package")]);
        rejects(gate, &package, "Build it: cargo xtask capi")?;
        // A folder of programs without host-sim.
        let scenario = format!("-DSCENARIO={}", self.of(MOTOR));
        let export = Self::configure(&self.at("error-export"), &[&found, &scenario]).env("PATH", "/usr/bin:/bin");
        rejects(gate, &export, "`cargo install --path host-sim`, or set -DEDO_SMC_HOST_SIM=PATH")
    }

    fn pkg_config(&self, gate: &Gate) -> Outcome {
        let asked = |what: &[&str]| {
            let path = format!("{}/lib/pkgconfig", self.at("moved"));
            let command = Invocation::new("pkg-config", what).with(&["edo_smc"]).env("PKG_CONFIG_PATH", &path);
            command.answer_in(gate).ok_or_else(|| failed(format!("{command} failed")))
        };
        let (version, workspace) = (asked(&["--modversion"])?, self.version()?);
        if version != workspace {
            return Err(failed(format!("edo_smc.pc has version {version}, the workspace {workspace}")));
        }
        let (flags, program) = (asked(&["--cflags", "--libs"])?, self.at("by-pkg-config"));
        let flags: Vec<&str> = flags.split_whitespace().collect();
        let build = Invocation::new("gcc", &["-std=c99", "controller-capi/test_package/check.c", "-o", &program]);
        build.with(&flags).run(gate)?;
        Invocation::new(&program, &[]).run(gate)
    }

    /// Returns the version of the workspace.
    fn version(&self) -> Result<String, Failure> {
        let manifest = fs::read_to_string(self.root.join("Cargo.toml")).map_err(failed)?;
        let line = manifest.lines().find_map(|line| line.strip_prefix("version = "));
        Ok(line.ok_or_else(|| failed("Cargo.toml: no version"))?.trim_matches('"').to_string())
    }

    fn conan(&self, gate: &Gate) -> Outcome {
        let conan = |arguments: &[&str]| {
            Invocation::new(&ENVIRONMENT.program("conan"), arguments).env("CONAN_HOME", &self.at("conan"))
        };
        conan(&["profile", "detect"]).run(gate)?;
        // Creates the package and runs the test package; then one for a chip, which this machine cannot run.
        conan(&["create", CAPI, "--no-remote"]).run(gate)?;
        conan(&["create", CAPI, "--no-remote", "-o", "edo_smc/*:core=thumbv7em", "-tf="]).run(gate)?;
        conan(&["list", "edo_smc/*:*"]).run(gate)
    }

    /// Compares the drive of the library with its scenario, runs the class, and compiles the example.
    fn arduino(&self, gate: &Gate) -> Outcome {
        let drive = format!("{ARDUINO}/src/edo_smc_drive.h");
        let read = |path: &Path| fs::read(path).map_err(|error| failed(format!("{}: {error}", path.display())));
        if read(&self.root.join(&drive))? != read(&self.folder.join("motor_drive.h"))? {
            let export = format!("host-sim export {MOTOR} --lang c --standalone -o {drive} --force");
            return Err(failed(format!("{drive}: is not the export of {MOTOR}. Write it again: {export}")));
        }
        Invocation::new("python3", &["-c", MANIFESTS, ARDUINO, &self.version()?]).run(gate)?;
        let sources = format!("-I{ARDUINO}/src");
        let (core, program) = (format!("-I{STANDS_IN}"), self.at("arduino"));
        let with =
            |compiler: &str| Invocation::new(compiler, &["-std=gnu++11", "-O2", &sources, &core]).with(&WARNINGS);
        with("g++").with(&[&format!("{STANDS_IN}/arduino.cpp"), "-o", &program]).run(gate)?;
        Invocation::new(&program, &[]).run(gate)?;
        let object = self.at("example.o");
        let compiled = ["-x", "c++", "-c", EXAMPLE, "-o", &object];
        with("g++").with(&compiled).run(gate)?;
        for cpu in ["-mcpu=cortex-m0", "-mcpu=cortex-m4"] {
            with(CROSS_CXX).with(&[cpu, "-mthumb"]).with(&compiled).run(gate)?;
        }
        Ok(())
    }

    fn strict(&self, gate: &Gate) -> Outcome {
        let mut compilers = vec!["g++", CROSS_CXX];
        if Invocation::new("clang++", &["--version"]).answer().is_some() {
            compilers.push("clang++");
        } else {
            println!("clang++ is not installed (on Debian: apt-get install clang): only GCC");
        }
        for drive in ["motor", "joint"] {
            let (source, object) = (self.at(&format!("{drive}.cpp")), self.at(&format!("{drive}.o")));
            let includes = format!("#include \"{drive}_drive.h\"\nbool good() {{ return edo_smc_modes_ok(); }}\n");
            fs::write(&source, includes).map_err(failed)?;
            for compiler in &compilers {
                for standard in ["-std=c++11", "-std=c++14"] {
                    let strict = Invocation::new(compiler, &[standard, "-pedantic-errors"]).with(&WARNINGS);
                    strict.with(&["-O2", "-c", &source, "-o", &object]).run(gate)?;
                }
            }
        }
        Ok(())
    }

    /// Runs the commands of the pages that call `host-sim`, in a folder.
    fn commands(&self, gate: &Gate) -> Outcome {
        let folder = self.folder.join("page");
        for place in ["examples/rtos_task", "packages/arduino/src"] {
            fs::create_dir_all(folder.join(place)).map_err(failed)?;
        }
        let mut count = 0;
        for page in [PAGE, &format!("{ARDUINO}/README.md")] {
            let text = fs::read_to_string(self.root.join(page)).map_err(failed)?;
            for line in text.lines() {
                let Some(words) = line.trim().strip_prefix("cargo run --release -- ") else { continue };
                let words: Vec<&str> = words.split(" #").next().unwrap_or(words).split_whitespace().collect();
                if words[0] == "new" {
                    // Both pages make this file.
                    _ = fs::remove_file(folder.join("mine.toml"));
                }
                let command = Invocation::new("env", &["-C", &folder.display().to_string(), &self.host_sim]);
                command.with(&words).run(gate)?;
                count += 1;
            }
        }
        if count < 5 {
            return Err(failed(format!("{count} commands of the pages found; expected 5 or more")));
        }
        Ok(())
    }

    /// Runs the example with and without the call of `missed`; without it the error must be ten times larger.
    fn rtos(&self, gate: &Gate) -> Outcome {
        let peak = |name: &str, option: &str| {
            let (program, folder) = (self.at(name), format!("-I{}", self.folder.display()));
            Invocation::new("gcc", &["-std=c99", "-pedantic", "-O2", &folder, option])
                .with(&WARNINGS)
                .with(&[RTOS, "-o", &program, "-lm"])
                .run(gate)?;
            let output = Invocation::new(&program, &[]).output(gate).map_err(failed)?;
            print!("{name}: {output}");
            let number = output.split("largest error ").nth(1).and_then(|rest| rest.split(' ').next()?.parse().ok());
            number.ok_or_else(|| failed(format!("{name}: no largest error in\n{output}")))
        };
        let with: f64 = peak("rtos", "-UWITHOUT_MISSED")?;
        let without: f64 = peak("rtos-without-missed", "-DWITHOUT_MISSED")?;
        // The largest error without a missed tick is 2e-4 rad, half a count.
        if !(with < 1e-3 && without > 10.0 * with) {
            let reason = format!("largest error {with} rad with edo_smc_missed, {without} rad without it");
            return Err(failed(format!("{reason}; expected below 1e-3, and ten times more without it")));
        }
        // The branch for FreeRTOS, for a chip, with stand-ins for its headers.
        let (stands_in, object) = (self.at("freertos"), self.at("rtos.o"));
        fs::create_dir_all(&stands_in).map_err(failed)?;
        for (name, text) in [("FreeRTOS.h", FREERTOS), ("task.h", "")] {
            fs::write(Path::new(&stands_in).join(name), text).map_err(failed)?;
        }
        Invocation::new(CROSS_C, &["-std=c99", "-pedantic", "-O2", "-mcpu=cortex-m4", "-mthumb", "-DFREERTOS"])
            .with(&WARNINGS)
            .with(&[&format!("-I{stands_in}"), &format!("-I{}", self.folder.display()), "-c", RTOS, "-o", &object])
            .run(gate)
    }
}
