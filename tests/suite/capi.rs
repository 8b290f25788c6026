//! The static library for C: bit-identity with the Rust library on this machine and on the target, the response to
//! every caller error, and linking with other libraries.
//!
//! These tests need the output of `cargo xtask capi`, C and C++ compilers for this machine and the target, CMake, and
//! `qemu-system-arm`. If one is missing, they fail and name it.

use controller_core::{
    Coefficients, Config, Controller, Fallback, Health, JointParameters, Limits, Linear, Nominal, ObserverGains,
    Options, ReachingLaw, Reading, Running, Surface,
};
use cycle_bound::qemu::{Clock, Process, is_last};
use integration_tests::data::path;
use integration_tests::deep;
use integration_tests::program::{Folder, host_sim};
use integration_tests::strategy::Rng;
use std::fmt::Write as _;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use super::export::{self, EDGES, ON_THE_CHIP, Place, answers, other_boards};

const STRICT: [&str; 4] = ["-Wall", "-Wextra", "-Werror", "-pedantic"];
const CORE: [&str; 4] = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"];
/// Words of the header: version, instance.
const HEAD: usize = 2;

fn root() -> PathBuf {
    path("..").canonicalize().expect("the workspace")
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

fn built(name: &str) -> String {
    let file = root().join(name);
    assert!(file.exists(), "{} is missing: `cargo xtask capi` builds it", file.display());
    text(&file)
}

pub(super) fn archive(of: &str) -> String {
    built(&format!("controller-capi/target/archive/{of}/libedo_smc.a"))
}

pub(super) fn include() -> String {
    format!("-I{}", text(&root().join("controller-capi/include")))
}

fn header() -> String {
    std::fs::read_to_string(root().join("controller-capi/include/edo_smc.h")).expect("the header")
}

pub(super) fn source(name: &str) -> String {
    text(&path("capi").join(name))
}

/// Runs a program to its end; returns its output if it succeeds.
fn run(program: &str, args: &[&str]) -> String {
    let output = Command::new(program)
        .args(args)
        .output()
        .unwrap_or_else(|error| panic!("{program} cannot be started ({error}): `cargo xtask setup` installs it"));
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{program} {args:?}: {}\n{out}\n{err}", output.status);
    out.into_owned()
}

/// Returns name, n, r, mask, o of every instance, as the header lists them.
fn instances() -> Vec<(String, [usize; 4])> {
    let number = |text: &str| match text.trim().strip_prefix("0x") {
        Some(hex) => usize::from_str_radix(hex, 16).expect("a mask"),
        None => text.trim().parse().expect("a number"),
    };
    let header = header();
    let lines = header.lines().filter_map(|line| line.strip_prefix("EDO_SMC_INSTANCE(")?.strip_suffix(')'));
    lines
        .map(|line| {
            let mut words = line.split(',');
            let name = words.next().expect("a name").to_string();
            let numbers: Vec<usize> = words.map(number).collect();
            (name, numbers.try_into().expect("n, r, mask, o"))
        })
        .collect()
}

/// Returns a design in the memory layout of C, as words.
fn words<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    controller: &Controller<f32, Linear<f32, N>, N, R, MASK, O>,
    d_hat: &[f32; N],
) -> Vec<u32> {
    let release = controller_core::VERSION.split(['-', '+']).next().expect("a version");
    let version = release.split('.').fold(0, |word, part| word << 8 | part.parse::<u32>().expect("three"));
    let mut words = vec![version, N as u32 | (R as u32) << 8 | u32::from(MASK) << 16];
    words.extend(d_hat.map(f32::to_bits));
    let mut numbers: Vec<u32> = controller.coefficients().numbers().map(f32::to_bits).collect();
    // The check number of C differs, because it also covers the header; the Rust check covers the coefficients alone.
    numbers.pop();
    words.extend(numbers);
    words.extend(controller.model().row().map(f32::to_bits));
    // FNV-1a over every number as two words.
    let bytes = words[2..].iter().flat_map(|&word| u64::from(word).to_le_bytes());
    let sum = bytes.fold(0x811c_9dc5_u32, |sum, byte| (sum ^ u32::from(byte)).wrapping_mul(0x0100_0193));
    words.push(((sum & 0x00ff_ffff) as f32).to_bits());
    words
}

/// Returns the design of every.c and two.cpp.
fn config<const N: usize, const R: usize>(mask: u8) -> Config<N, R> {
    let gains = [&[50.0][..], &[100.0, 2500.0], &[150.0, 7500.0, 125_000.0]][R - 1];
    let gains = ObserverGains::as_printed::<R>(std::array::from_fn(|m| gains[m]));
    Config {
        period_s: 1e-3,
        surface: Surface::from_bandwidth(5.0, 2.0),
        observers: std::array::from_fn(|i| (mask >> i & 1 == 1).then_some(gains)),
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 },
        nominal: Nominal { gradient: std::array::from_fn(|i| -(i as f64 + 1.0)), input_gain: 20.0 },
        options: Options::NEUTRAL.with_limits(Limits { min: -300.0, max: 250.0 }).with_sigma_star_bound(1.0),
    }
}

fn designed<const N: usize, const R: usize, const MASK: u8, const O: usize>()
-> (Controller<f32, Linear<f32, N>, N, R, MASK, O>, [f32; N]) {
    let config = config::<N, R>(MASK);
    let model = Linear::<f32, N>::new(&config.nominal);
    let controller = Controller::<f32, _, N, R, MASK, O>::try_design(&config, model);
    (controller.expect("a good design"), std::array::from_fn(|i| 0.25 * (i as f32 + 1.0)))
}

struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 16_777_216.0 - 0.5
    }
}

const SIZES: [f32; 4] = [0.01, 0.1, 1.0, 10.0];

/// Returns the expected output of every.c for one instance.
fn expected<const N: usize, const R: usize, const MASK: u8, const O: usize>(name: &str) -> String {
    let (controller, d_hat) = designed::<N, R, MASK, O>();
    let mut out = format!("{name}\n");
    for word in words(&controller, &d_hat) {
        writeln!(out, "{word:08x}").expect("a string takes all");
    }
    let mut noise = Noise(1);
    let mut running = Running::guessing(&controller, d_hat);
    for tick in 0..300 {
        let x = std::array::from_fn(|i| {
            let value = SIZES[i] * noise.next();
            match i {
                1 if tick % 17 == 0 => f32::NAN,
                0 if tick % 23 == 5 => f32::NEG_INFINITY,
                _ if tick % 29 == 7 => 1e30,
                _ => value,
            }
        });
        let output = running.tick(&x);
        let [u, sigma, sigma_star] = [output.u, output.sigma, output.sigma_star].map(f32::to_bits);
        let status = u8::from(output.health.contains(Health::INPUT_REJECTED));
        let health = output.health.bits();
        writeln!(out, "{status} {u:08x} {sigma:08x} {sigma_star:08x} {health}").expect("a string takes all");
        if tick % 5 == 4 {
            running.report_applied(0.5 * output.u);
        }
        if tick == 150 {
            running.reset();
        }
    }
    out
}

#[test]
fn every_instance_designs_and_ticks_in_c_to_the_bits_of_rust() {
    let folder = Folder::new("capi-every");
    let mut list = String::new();
    for (name, [n, r, _, o]) in instances() {
        writeln!(list, "RUN({name}, {n}, {r}, {o})").expect("a string takes all");
    }
    std::fs::write(folder.path("instances.inc"), list).expect("a temporary file");
    let (program, here) = (folder.path("every"), format!("-I{}", folder.path("")));
    let include = include();
    let args = [&STRICT[..], &["-std=c99", "-O1", "-ffp-contract=off", &include, &here, "-o", &program]].concat();
    run("cc", &[&args[..], &[&source("every.c"), &archive("host"), "-lm"]].concat());
    let said = run(&program, &[]);
    // Third list of the instances, independent of the lists in the library and in the header.
    let expected = [
        expected::<2, 1, 2, 1>("n2_r1_c2"),
        expected::<2, 1, 3, 2>("n2_r1_c12"),
        expected::<2, 2, 2, 1>("n2_r2_c2"),
        expected::<2, 2, 3, 2>("n2_r2_c12"),
        expected::<3, 2, 4, 1>("n3_r2_c3"),
        expected::<3, 2, 5, 2>("n3_r2_c13"),
        expected::<3, 2, 6, 2>("n3_r2_c23"),
        expected::<3, 2, 7, 3>("n3_r2_c123"),
        expected::<4, 2, 8, 1>("n4_r2_c4"),
        expected::<4, 2, 10, 2>("n4_r2_c24"),
        expected::<4, 2, 12, 2>("n4_r2_c34"),
        expected::<4, 2, 14, 3>("n4_r2_c234"),
        expected::<4, 3, 8, 1>("n4_r3_c4"),
        expected::<4, 3, 9, 2>("n4_r3_c14"),
        expected::<4, 3, 10, 2>("n4_r3_c24"),
        expected::<4, 3, 11, 3>("n4_r3_c124"),
        expected::<4, 3, 12, 2>("n4_r3_c34"),
        expected::<4, 3, 13, 3>("n4_r3_c134"),
        expected::<4, 3, 14, 3>("n4_r3_c234"),
        expected::<4, 3, 15, 4>("n4_r3_c1234"),
    ]
    .concat();
    assert_eq!(said.lines().count(), expected.lines().count());
    let mut instance = "";
    for (line, (said, expected)) in said.lines().zip(expected.lines()).enumerate() {
        instance = if expected.starts_with('n') { expected } else { instance };
        assert_eq!(said, expected, "line {}, {instance}", line + 1);
    }
}

#[test]
fn the_header_is_clean_c99_and_c_plus_plus_and_so_is_every_misuse_of_it_answered() {
    let folder = Folder::new("capi-misuse");
    let program = folder.path("misuse");
    for (compiler, options) in
        [("cc", &["-std=c99"][..]), ("c++", &["-x", "c++", "-std=c++11"]), ("c++", &["-x", "c++", "-std=c++20"])]
    {
        let args = [&STRICT[..], options, &["-O1", "-fsanitize=undefined", "-fno-sanitize-recover", "-c", &include()]];
        for (file, fewest) in [("misuse.c", 200), ("misuse_drive.c", 4000), ("misuse_coupled.c", 2000)] {
            let object = folder.path("misuse.o");
            run(compiler, &[&args.concat()[..], &[&source(file), "-o", &object]].concat());
            run("c++", &["-fsanitize=undefined", &object, &archive("host"), "-o", &program]);
            let said = run(&program, &[]);
            assert!(said.ends_with(" checks, 0 failed\n"), "{compiler} {file}: {said}");
            let checks = said.split_whitespace().next().and_then(|word| word.parse().ok());
            assert!(checks.is_some_and(|checks: usize| checks > fewest), "{said}");
        }
    }
}

#[test]
fn a_program_of_rust_and_c_plus_plus_runs_two_controllers_of_different_order_side_by_side() {
    let folder = Folder::new("capi-two");
    let (object, program) = (folder.path("two.o"), folder.path("two"));
    run("c++", &[&STRICT[..], &["-std=c++11", "-O1", &include(), "-c", &source("two.cpp"), "-o", &object]].concat());
    let (object, archive) = (format!("-Clink-arg={object}"), format!("-Clink-arg={}", archive("host")));
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
    run(&rustc, &["--edition=2024", &source("two.rs"), &object, &archive, "-Clink-arg=-lstdc++", "-o", &program]);
    let said = run(&program, &[]);

    let ((first, first_guess), (second, second_guess)) = (designed::<4, 2, 10, 2>(), designed::<2, 2, 3, 2>());
    let (mut first, mut second) = (Running::guessing(first, first_guess), Running::guessing(second, second_guess));
    let mut noise = Noise(1);
    let mut ticks = 0;
    for line in said.lines() {
        let x = SIZES.map(|size| size * noise.next());
        let one = first.tick(&x).u.to_bits();
        let other = second.tick(&[x[0], x[1]]).u.to_bits();
        assert_eq!(line, format!("{one:08x} {other:08x}"), "tick {ticks}");
        ticks += 1;
    }
    assert_eq!(ticks, 1000);
}

/// Returns type and name of every symbol of a library, by `nm`.
fn symbols(nm: &str, of: &str) -> Vec<(char, String)> {
    let listed = run(nm, &[&archive(of)]);
    let symbol = |line: &str| {
        let mut words = line.split_whitespace().rev();
        let (name, kind) = (words.next()?, words.next()?);
        Some((kind.chars().next()?, name.to_string()))
    };
    listed.lines().filter_map(symbol).collect()
}

#[test]
fn the_archives_show_only_their_own_names_need_no_others_and_cannot_panic() {
    // A hosted program has a C library; the library for a target needs no other library.
    let chips = ["thumbv7em", "thumbv8m", "thumbv7m", "thumbv6m"].map(|of| ("arm-none-eabi-nm", of, &[][..]));
    // The fast tier builds the library for the emulated target only.
    let chips = chips.into_iter().take(if deep() { 4 } else { 1 });
    for (nm, of, may_need) in chips.chain([("nm", "host", &["memcpy", "memset"][..])]) {
        let symbols = symbols(nm, of);
        let mut shown: Vec<&str> = Vec::new();
        for (kind, name) in &symbols {
            assert!(!name.contains("panic"), "{of}: {name}");
            match kind {
                'U' | 'w' => assert!(may_need.contains(&name.as_str()), "{of} needs {name}"),
                kind if kind.is_ascii_uppercase() => shown.push(name),
                _ => {}
            }
        }
        let functions =
            ["design_size", "state_size", "init", "tick", "report_applied", "estimates", "reset", "retune", "design"];
        let named = |of: &str, functions: &[&str]| -> Vec<String> {
            functions.iter().map(|function| format!("edo_smc_{function}_{of}")).collect()
        };
        let mut declared = vec!["edo_smc_version".to_string(), "edo_smc_modes_ok".to_string()];
        declared.extend(instances().iter().flat_map(|(name, _)| named(name, &functions)));
        for kind in ["motor", "joint", "coupled"] {
            let has_rule = kind != "coupled";
            if has_rule {
                declared
                    .extend(named(kind, &["plan_rest", "plan_move", "plan_stop", "plan_sine", "plan_play", "plan_at"]));
                let of_profiles = ["new", "limit", "keep_within", "go_to", "stop", "start", "has_arrived", "next"];
                declared.extend(of_profiles.map(|function| format!("edo_smc_profile_{function}_{kind}")));
            }
            for form in ["", "_fast", "_late", "_fast_late"] {
                let name = format!("{kind}{form}");
                declared.extend(named(&name, &functions));
                declared.extend(named(&name, &["tune", "go_on", "missed", "trip", "limit", "fence", "guard"]));
                // The gains of a joint as a whole come from the host.
                declared.extend(named(&name, if has_rule { &["by_rule"] } else { &[] }));
            }
        }
        declared.sort();
        shown.sort_unstable();
        assert_eq!(shown, declared, "{of}");
    }
}

/// The library detects floating-point modes other than the assumed ones, as far as a program on this machine can set
/// them.
#[test]
fn the_archive_sees_modes_that_are_not_the_assumed_ones() {
    let folder = Folder::new("capi-modes");
    let (file, program) = (folder.path("modes.c"), folder.path("modes"));
    let code = "#include <fenv.h>\n#include <stdio.h>\n#include \"edo_smc.h\"\n\
        #ifdef __SSE__\n#include <xmmintrin.h>\n#endif\nstatic void is(unsigned good, const char *mode) {\n\
        if (edo_smc_modes_ok() != good) { printf(\"%s\\n\", mode); }\n}\n\
        int main(void) {\n    is(1u, \"as it starts\");\n    fesetround(FE_UPWARD); is(0u, \"up\");\n    \
        fesetround(FE_DOWNWARD); is(0u, \"down\");\n    fesetround(FE_TOWARDZERO); is(0u, \"to zero\");\n    \
        fesetround(FE_TONEAREST); is(1u, \"to nearest\");\n\
        #ifdef __SSE__\n    _mm_setcsr(_mm_getcsr() | 0x8000u); is(0u, \"FTZ\");\n    \
        _mm_setcsr((_mm_getcsr() & ~0x8000u) | 0x40u); is(0u, \"DAZ\");\n    \
        _mm_setcsr(_mm_getcsr() & ~0x40u); is(1u, \"neither\");\n#endif\n    return 0;\n}\n";
    std::fs::write(&file, code).expect("a temporary file");
    run("cc", &["-std=c11", "-O2", "-frounding-math", &include(), &file, &archive("host"), "-lm", "-o", &program]);
    assert_eq!(run(&program, &[]), "");
    // Effect of linking with -ffast-math.
    if cfg!(target_arch = "x86_64") {
        run("cc", &["-O2", "-ffast-math", &include(), &file, &archive("host"), "-lm", "-o", &program]);
        assert!(run(&program, &[]).starts_with("as it starts\n"));
    }
}

#[test]
fn a_firmware_with_newlib_and_its_own_double_precision_links_without_a_clash() {
    let folder = Folder::new("capi-newlib");
    let (file, program) = (folder.path("newlib.c"), folder.path("newlib.elf"));
    // Functions that the library contains under the same names, and a whole libm, all of it used.
    let code = "#include <math.h>\n#include <stdio.h>\n#include <string.h>\n#include \"edo_smc.h\"\n\
        volatile double d = 2.0; volatile float f = 1.0f; char a[64], b[64];\n\
        void rust_begin_unwind(void) {} void __rust_alloc(void) {}\n\
        int main(void) {\n    memcpy(a, b, (size_t)f + 60u); memset(b, 1, (size_t)f + 60u);\n\
        d = exp(d) / sin(d) + (double)expf(f) * fma(d, d, d);\n    printf(\"%f %d\", d, memcmp(a, b, 64));\n\
        return (int)edo_smc_version() + edo_smc_reset_n4_r2_c24(0) + edo_smc_design_n4_r3_c1234(0, 0, 0, 0, 0);\n}\n";
    std::fs::write(&file, code).expect("a temporary file");
    for specs in [&["--specs=nano.specs", "--specs=nosys.specs"][..], &["--specs=nosys.specs"]] {
        let quiet = ["-Wl,--no-warn-rwx-segments", "-Wl,--no-gc-sections", "-Wl,--fatal-warnings"];
        // The nosys stubs warn that they are stubs; this test ignores these warnings.
        let args = [&CORE[..], specs, &quiet[..2], &[&include(), &file, &archive("thumbv7em"), "-lm", "-o", &program]];
        run("arm-none-eabi-gcc", &args.concat());
    }
}

/// Returns the design of the C examples.
fn joint() -> (Config<4, 2>, Controller<f32, Linear<f32, 4>, 4, 2, 10, 2>) {
    let observer = Some(ObserverGains::from_bandwidth::<2>(100.0));
    let config = Config {
        period_s: 1e-4,
        surface: Surface::from_bandwidth(10.0, 10.0),
        observers: [None, observer, None, observer],
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.0, epsilon: 0.01 },
        nominal: JointParameters::TABLE_I.chain(Reading::Physical).nominal(),
        options: Options::NEUTRAL
            .with_limits(Limits::symmetric(30.0))
            .with_fallback(Fallback::Safe(0.0))
            .with_sigma_star_bound(10.0),
    };
    let model = Linear::<f32, 4>::new(&config.nominal);
    (config, Controller::<f32, _, 4, 2, 10, 2>::try_design(&config, model).expect("a good design"))
}

/// The exported files of the examples are up to date. Their results are compared with the library's own design below,
/// on the target.
#[test]
fn the_files_exported_for_the_examples_are_those_of_this_version() {
    for (name, file, form) in [
        ("paper", "paper_design.h", &["--lang", "c"][..]),
        ("paper", "paper_standalone.h", &["--standalone"]),
        ("drive", "drive_standalone.h", &["--lang", "c", "--standalone"]),
    ] {
        let scenario = text(&root().join(format!("examples/c/{name}.toml")));
        let exported = host_sim(&[&["export", &scenario, "--prefix", name], form].concat());
        assert_eq!(exported.status, 0, "{}", exported.err);
        let found = std::fs::read_to_string(root().join("examples/c").join(file)).unwrap_or_default();
        let again = format!("host-sim export {name}.toml --prefix {name} {} -o {file} --force", form.join(" "));
        assert!(found.trim_end() == exported.out.trim_end(), "examples/c/{file} is stale: there, `{again}`");
    }
}

/// Settings that turn `joint.toml` into order 3, for C and for the Rust images.
const ORDER_3: &str =
    "controller.observer=[{channel=2,bandwidth_rad_s=100,order=3},{channel=4,bandwidth_rad_s=100,order=3}]";

/// Settings that turn `motor.toml` and `drive.toml` into the measured drives.
const MEASURED: [&str; 4] = ["--set", "drive.period_s=1e-3", "--set", "drive.gain_sets=1"];
const MEASURED_JOINT: [&str; 6] =
    [MEASURED[0], MEASURED[1], MEASURED[2], MEASURED[3], "--set", "drive.tuning=\"normal\""];

#[test]
fn the_assembly_exported_for_the_examples_is_that_of_this_version() {
    let folder = Folder::new("capi-assembly");
    let files = [
        ("examples/c/paper.toml", "paper", "examples/c/paper_assembly.S", true, &[][..]),
        ("firmware/joint.toml", "joint_r2", "firmware/src/assembly/joint_r2.S", false, &[]),
        ("firmware/joint.toml", "joint_r3", "firmware/src/assembly/joint_r3.S", false, &["--set", ORDER_3]),
        ("firmware/motor.toml", "motor", "firmware/src/assembly/motor.S", false, &MEASURED),
        ("firmware/drive.toml", "joint_drive", "firmware/src/assembly/joint_drive.S", false, &MEASURED_JOINT),
    ];
    // A search takes many seconds, so the fast tier covers the first file only.
    for (scenario, prefix, shipped, header, set) in files.into_iter().take(if deep() { 5 } else { 1 }) {
        let (scenario, made) = (text(&root().join(scenario)), folder.path("tick.S"));
        let export = ["export", &scenario, "--paper", "--asm", "--prefix", prefix, "-o", &made, "--force"];
        let exported = host_sim(&[&export, set].concat());
        assert_eq!(exported.status, 0, "{}", exported.err);
        let shipped = root().join(shipped);
        for end in ["S", "h"].into_iter().filter(|end| *end == "S" || header) {
            let read = |file: &Path| std::fs::read_to_string(file.with_extension(end)).unwrap_or_default();
            let same = read(&shipped) == read(Path::new(&made));
            assert!(same, "{} is stale: the head of {scenario} says how to export it", shipped.display());
        }
    }
}

#[test]
fn a_design_that_the_archive_does_not_carry_is_refused_with_what_carries_it() {
    for (set, told) in [
        (&["--set", "controller.precision=f64"][..], "set controller.precision=f32"),
        (
            &["--set", "controller.observer=[]"],
            "the static library for C has no n4_r1_c (n = 4, no observer); it has n2_r1_c2, ",
        ),
    ] {
        let said = host_sim(&[&["export", "--paper", "--lang", "c"], set].concat());
        assert!(said.status == 2 && said.err.contains(told), "{}", said.err);
    }
}

/// Scenario of the design of every.c: order 3 with observers in channels 2 and 3.
const CHAIN: &str = "
[plant]
kind = \"chain\"
order = 3
x0 = [0.0, 0.0, 0.0]
a = [-1.0, -2.0, -3.0]
b = 20.0
[controller]
period_s = 1e-3
surface_bandwidth_rad_s = 5.0
alpha_per_s = 2.0
k_l = 50.0
k_s = 0.5
epsilon = 0.01
limits = { min = -300.0, max = 250.0 }
initial_estimates = [0.25, 0.5, 0.75]
sigma_star_bound = 1.0
[[controller.observer]]
channel = 2
printed = [100.0, 2500.0]
[[controller.observer]]
channel = 3
printed = [100.0, 2500.0]
";

#[test]
fn an_exported_design_has_the_words_of_the_library_s_and_the_archive_takes_it() {
    let folder = Folder::new("capi-export");
    let (scenario, design) = (folder.path("chain.toml"), folder.path("design.h"));
    std::fs::write(&scenario, CHAIN).expect("a file");
    let exported = host_sim(&["export", &scenario, "--lang", "c", "-o", &design]);
    assert_eq!(exported.status, 0, "{}", exported.err);
    let program = "#include <stdio.h>\n#include <string.h>\n#include \"design.h\"\n\
        static edo_smc_state_n3_r2_c23_t state;\n\
        int main(void) {\n    uint32_t words[sizeof edo_smc_design / 4];\n    size_t i;\n    \
        memcpy(words, &edo_smc_design, sizeof words);\n    \
        for (i = 0; i < sizeof words / 4; i++) printf(\"%08lx\\n\", (unsigned long)words[i]);\n    \
        return edo_smc_init_n3_r2_c23(&edo_smc_design, sizeof edo_smc_design, &state, sizeof state) \
        != EDO_SMC_OK;\n}\n";
    let (main, made) = (folder.path("main.c"), folder.path("made"));
    std::fs::write(&main, program).expect("a file");
    let (controller, d_hat) = designed::<3, 2, 0b110, 2>();
    let expected: Vec<String> = words(&controller, &d_hat).iter().map(|word| format!("{word:08x}")).collect();
    let (include, archive) = (include(), archive("host"));
    for (compiler, language) in [("cc", &["-std=c99"][..]), ("c++", &["-x", "c++", "-std=c++11"])] {
        let flags = [language, &STRICT, &[&include, &main, "-x", "none", &archive, "-o", &made]].concat();
        run(compiler, &flags);
        assert_eq!(run(&made, &[]).lines().collect::<Vec<_>>(), expected, "{compiler}");
    }
}

/// Returns the output of an image on USART2 up to its last line.
pub(super) fn emulated(image: &str) -> Vec<String> {
    let (process, [_, stream]) = Process::start(Path::new(&built(image)), [false, true], Clock::Instructions, None)
        .unwrap_or_else(|error| panic!("{error}"));
    let mut reader = BufReader::new(stream.expect("its USART2"));
    let until = Instant::now() + Duration::from_mins(1);
    let (mut lines, mut line) = (Vec::new(), String::new());
    while Instant::now() < until {
        match reader.read_line(&mut line) {
            Ok(0) => panic!("{}", process.ended("the emulator is gone")),
            Ok(_) if line.ends_with('\n') => {
                let whole = std::mem::take(&mut line).trim().to_string();
                if is_last(&whole) {
                    return lines;
                }
                lines.push(whole);
            }
            // A blocking read has its own time limit.
            Ok(_) | Err(_) => {}
        }
    }
    panic!("{image} did not come to its end; it said {lines:?}");
}

#[test]
fn the_law_in_c_on_the_chip_gives_every_u_of_the_rust_tick() {
    let (config, controller) = joint();
    let (row, b, period) = (*controller.model().row(), config.nominal.input_gain as f32, config.period_s as f32);
    let (mut motor, mut held, mut running) = ([0.1_f32, 0.0, 0.0, 0.0], 0.0_f32, Running::new(&controller));
    let mut expected = Vec::new();
    for _ in 0..1000 {
        let push = row[0] * motor[0] + row[2] * motor[2] + held + 1.0;
        motor[3] += period * (b * push);
        motor[2] += period * motor[3];
        motor[1] += period * (motor[2] + 0.5);
        motor[0] += period * motor[1];
        held = running.tick(&motor).u;
        expected.push(format!("u {:08x}", held.to_bits()));
    }
    // The controller holds the joint; it does not end at a limit or at 0.
    assert!(motor[0].abs() < 0.1 && motor.iter().all(|x| x.abs() < 100.0), "{motor:?}");
    let distinct: std::collections::HashSet<&String> = expected.iter().collect();
    assert!(distinct.len() > 900, "{}", distinct.len());
    expected.push("status 00000000".into());
    for image in ["paper", "paper-nostdlib", "paper-standalone", "paper-assembly"] {
        let said = emulated(&format!("examples/c/build/{image}.elf"));
        assert_eq!(said.len(), expected.len(), "{image}");
        for (tick, (said, expected)) in said.iter().zip(&expected).enumerate() {
            assert_eq!(said, expected, "{image}, tick {tick}");
        }
    }
}

/// The library matches the tick on Cortex-M0, M3 and M4 without an FPU, and M7 and M33 with one. Samples lie near rest
/// and far from it, and some are not numbers.
#[test]
fn the_archives_give_the_bits_of_the_tick_on_other_cores() {
    const TICKS: usize = 20_000;
    let (_, controller) = joint();
    let mut running = Running::new(&controller);
    let mut rng = Rng::new(0xC04E);
    let (mut asked, mut expected) = (Vec::new(), Vec::new());
    for _ in 0..TICKS {
        let size = if rng.chance(0.02) { rng.spread(1e-6, 1e14) } else { 0.1 };
        let mut x: [f32; 4] = std::array::from_fn(|_| (size * rng.within(-1.0, 1.0)) as f32);
        if rng.chance(0.02) {
            x[rng.integer(0, 3)] = EDGES[rng.integer(0, EDGES.len() - 1)];
        }
        asked.extend(x.into_iter().flat_map(f32::to_le_bytes));
        let output = running.tick(&x);
        expected.push(u32::from(output.health.contains(Health::INPUT_REJECTED)));
        expected.extend([output.u, output.sigma, output.sigma_star].map(f32::to_bits));
        expected.push(u32::from(output.health.bits()));
    }
    let rejected = expected.chunks(5).filter(|answer| answer[0] == 1).count();
    assert!((TICKS / 500..TICKS / 10).contains(&rejected), "{rejected} rejected");
    let design = format!("{}/examples/c/paper_design.h", text(&root()));
    let program = format!(
        "#include \"{design}\"
{ON_THE_CHIP}
static struct {{ float x[4]; }} asks[64];
static uint32_t answers[64][5];
static edo_smc_state_n4_r2_c24_t state;

static uint32_t bits(float number)
{{
    union {{ float number; uint32_t word; }} both;
    both.number = number;
    return both.word;
}}

int main(void)
{{
    size_t count;
    if (edo_smc_init_n4_r2_c24(&paper_design, sizeof paper_design, &state, sizeof state) != EDO_SMC_OK) {{
        return 1;
    }}
    while ((count = receive(asks, sizeof asks) / sizeof asks[0]) > 0) {{
        for (size_t k = 0; k < count; k++) {{
            edo_smc_output_t output = {{0}};
            answers[k][0] = (uint32_t)edo_smc_tick_n4_r2_c24(&paper_design, &state, asks[k].x, &output);
            answers[k][1] = bits(output.u);
            answers[k][2] = bits(output.sigma);
            answers[k][3] = bits(output.sigma_star);
            answers[k][4] = output.health;
        }}
        send(answers, count * sizeof answers[0]);
    }}
    return 0;
}}
"
    );
    let archives = ["thumbv6m", "thumbv7m", "thumbv7m", "thumbv7em", "thumbv8m"];
    for (board, of) in other_boards().iter().zip(if deep() { &archives[..] } else { &archives[3..4] }) {
        let folder = export::folder(&format!("capi-{}", board.machine));
        let (include, archive) = (include(), archive(of));
        let options = ["-O2", "-Wl,--gc-sections", &include, &archive];
        let answered = answers(&folder, &program, &options, &asked, Place::On(board));
        assert_eq!(answered.len(), expected.len(), "{}", board.machine);
        let is_nan = |word: u32| f32::from_bits(word).is_nan();
        for (k, (c, rust)) in answered.chunks(5).zip(expected.chunks(5)).enumerate() {
            let alike = c.iter().zip(rust).all(|(&c, &rust)| c == rust || is_nan(c) && is_nan(rust));
            assert!(alike, "{}, tick {k}: {c:08x?} for {rust:08x?}", board.machine);
        }
    }
}

#[test]
fn a_design_made_on_the_chip_has_the_bits_of_the_one_made_here() {
    let (_, controller) = joint();
    let words = words(&controller, &[0.0; 4]);
    assert_eq!(words.len(), HEAD + 8 + Coefficients::<f32, 4, 2, 2>::NUMBERS);
    let mut expected = vec![String::from("status 00000000 channel 00000000")];
    expected.extend(words.iter().map(|word| format!("word {word:08x}")));
    expected.push("differ 00000000".into());
    for image in ["design", "design-nostdlib"] {
        assert_eq!(emulated(&format!("examples/c/build/{image}.elf")), expected, "{image}");
    }
}

#[test]
fn cmake_builds_the_image_that_make_builds() {
    let folder = Folder::new("capi-cmake");
    let (examples, build) = (root().join("examples/c"), folder.path("build"));
    let toolchain = text(&examples.join("arm-none-eabi.cmake"));
    run("cmake", &["-S", &text(&examples), "-B", &build, "--toolchain", &toolchain]);
    run("cmake", &["--build", &build]);
    for image in ["drive", "paper", "design"] {
        let code = |elf: &str, name: &str| {
            let raw = folder.path(name);
            run("arm-none-eabi-objcopy", &["-O", "binary", elf, &raw]);
            std::fs::read(raw).expect("what objcopy wrote")
        };
        let made = code(&built(&format!("examples/c/build/{image}.elf")), "made");
        let cmade = code(&format!("{build}/{image}.elf"), "cmade");
        assert!(!made.is_empty() && made == cmade, "{image}: {} and {} bytes", made.len(), cmade.len());
    }
}
