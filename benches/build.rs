//! Compiles the C versions of the law: for the host with its C compiler, for the Cortex-M4F with arm-none-eabi-gcc; for
//! the host also closed loops. Passes the name of the Rust compiler to the program, because instruction counts depend
//! on it.

use std::env;
use std::process::Command;

/// C versions: function name without its order, source, and compiler options besides the processor.
const VERSIONS: [(&str, &str, &[&str]); 5] = [
    ("naive_tick_", "c/naive.c", &["-O2"]),
    ("naive_fast_tick_", "c/naive.c", &["-O3", "-ffast-math"]),
    ("tuned_tick_", "c/tuned.c", &["-O2", "-ffp-contract=off"]),
    ("tuned_guarded_tick_", "c/tuned.c", &["-O2", "-ffp-contract=off", "-DGUARD"]),
    ("tuned_renamed_tick_", "c/tuned.c", &["-O2", "-ffp-contract=off", "-DGUARD", RENAMED]),
];
/// Closed loops for the host: name, source, flags. GCC vectorises the code.
const LOOPS: [(&str, &str, &[&str]); 5] = [
    ("closed_loop_alone", "c/loop.c", &[]),
    ("closed_loops_sse2", "c/plants.c", &[]),
    ("closed_loops_avx2", "c/plants.c", &["-mavx2", "-mfma"]),
    ("closed_loops_avx512", "c/plants.c", &AVX512),
    ("closed_loops_fast", "c/plants.c", &["-ffast-math", AVX512[0], AVX512[1], AVX512[2], AVX512[3], AVX512[4]]),
];
const AVX512: [&str; 5] = ["-mavx512f", "-mavx512dq", "-mavx512vl", "-mfma", "-mprefer-vector-width=512"];
/// Option of GCC, for the chip only: another compiler of the host may lack it.
const RENAMED: &str = "-frename-registers";

fn main() {
    println!("cargo::rerun-if-changed=c");
    let target = env::var("TARGET").expect("cargo sets the target");
    let compiler = env::var("RUSTC").expect("cargo sets the compiler");
    let version = Command::new(compiler).arg("--version").output().expect("it has just compiled this program");
    println!("cargo::rustc-env=COMPILER={} for {target}", String::from_utf8_lossy(&version.stdout).trim());
    // Before the ticks: a linker resolves calls from the libraries that follow.
    if !target.starts_with("thumbv7em") {
        for (name, source, flags) in LOOPS {
            if target.starts_with("x86_64") || source == "c/loop.c" {
                let mut build = cc::Build::new();
                build.no_default_flags(true).warnings(true).extra_warnings(true).warnings_into_errors(true);
                build.flag("-std=gnu11").flag("-O3").flag("-fPIC").define("NAME", name).define("R", "2");
                for flag in flags {
                    build.flag(flag);
                }
                build.file(source).compile(name);
            }
        }
        println!("cargo::rustc-link-lib=m");
    }
    for (name, source, flags) in VERSIONS {
        for order in ["2", "3"] {
            let mut build = cc::Build::new();
            // The flags are part of the comparison, so cc adds none.
            build.no_default_flags(true).warnings(true).extra_warnings(true).warnings_into_errors(true);
            build.flag("-std=c99").flag("-ffunction-sections").file(source).define("NAME", name).define("R", order);
            let for_chip = target.starts_with("thumbv7em");
            for flag in flags.iter().filter(|flag| for_chip || **flag != RENAMED) {
                build.flag(flag);
            }
            if for_chip {
                for flag in ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"] {
                    build.flag(flag);
                }
            } else {
                build.flag("-fPIC");
            }
            build.compile(&format!("{name}{order}"));
        }
    }
}
