//! Check of the floating-point modes that a tick assumes, and the guarantees under other modes.
//!
//! The tests compile the exported C with the compiler of this machine and set the modes of `fesetround` and MXCSR.
//! There are two separate guarantees. Bit-identity with the Rust tick holds under the assumed modes only. Three
//! properties hold under all modes: u within its limits, u a number, and the state after a reset.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::export::{compile, exported, folder, plain, refusal};

/// Settings of the exported drive: a limit that its ticks reach.
const SETS: [&str; 2] = ["--set", "motor.max_current_a=2"];

/// C program: sets a mode, runs the check, then ticks a drive through moves, missing counts, outliers, frozen counts
/// and invalid targets. It prints four results: the check result, the number of invalid u, whether the state after a
/// reset equals the initial one, and a hash of every u.
const PROGRAM: &str = r#"
#include <fenv.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "drive.h"
#ifdef __SSE__
#include <xmmintrin.h>
#endif

static uint32_t seed = 1u;
static uint32_t noise(void)
{
    seed = (seed * 1664525u) + 1013904223u;
    return seed >> 8;
}

int main(int count, char **words)
{
    const char *mode = (count > 1) ? words[1] : "";
    if (strcmp(mode, "up") == 0) { fesetround(FE_UPWARD); }
    if (strcmp(mode, "down") == 0) { fesetround(FE_DOWNWARD); }
    if (strcmp(mode, "zero") == 0) { fesetround(FE_TOWARDZERO); }
#ifdef __SSE__
    if (strcmp(mode, "ftz") == 0) { _mm_setcsr(_mm_getcsr() | 0x8000u); }
    if (strcmp(mode, "daz") == 0) { _mm_setcsr(_mm_getcsr() | 0x0040u); }
    if (strcmp(mode, "both") == 0) { _mm_setcsr(_mm_getcsr() | 0x8040u); }
#endif
    static edo_smc_state state, fresh;
    static edo_smc_monitor monitor;
    edo_smc_reset(&state);
    memcpy(&fresh, &state, sizeof state);
    uint32_t hash = 0x811c9dc5u, bad = 0u, ticks = 0u, saturated = 0u, resets = 0u;
    const float limit = (float)EDO_SMC_MAX_CURRENT_A;
    int32_t at = 0;
    for (ticks = 0u; ticks < 200000u; ticks++) {
        edo_smc_sample sample = {0};
        edo_smc_output output = {0};
        const uint32_t chance = noise() % 1000u;
        at += (int32_t)(noise() % 41u) - 20;
        sample.count = (uint32_t)at + ((chance == 0u) ? noise() : 0u);
        sample.lost = chance == 1u;
        sample.begin.r = ((float)(noise() % 2000u) * 1e-6f) - 1e-3f;
        sample.end = sample.begin;
        if (chance == 2u) { sample.end.r = 3e38f * 10.0f; }
        if (chance == 3u) { sample.end.r_dot = 1e-40f; }
        const unsigned health = edo_smc_watched_tick(&monitor, &state, &sample, &output);
        saturated += ((health & EDO_SMC_SATURATED) != 0u) ? 1u : 0u;
        bad += ((output.u >= -limit) && (output.u <= limit)) ? 0u : 1u;
        uint32_t bits;
        memcpy(&bits, &output.u, sizeof bits);
        hash = (hash ^ bits) * 0x01000193u;
        if ((chance == 4u) || monitor.stopped) {
            edo_smc_watched_reset(&monitor, &state);
            bad += (memcmp(&state, &fresh, sizeof state) != 0) ? 1u : 0u;
            resets++;
        }
    }
    if ((saturated < 1000u) || (resets < 100u)) {
        printf("saturated %u, resets %u: this asks little\n", saturated, resets);
    }
    printf("%d %u %08x\n", edo_smc_modes_ok() ? 1 : 0, bad, hash);
    return 0;
}
"#;

fn drive(folder: &Path) -> std::path::PathBuf {
    exported(folder, "drive.h", scenario::MOTOR, &[&["--standalone"][..], &SETS].concat());
    let source = folder.join("user.c");
    fs::write(&source, PROGRAM).expect("the program");
    source
}

/// Runs the program; returns the check result, the number of broken guarantees, and the hash of every u.
fn said(program: &Path, mode: &str) -> (bool, u32, String) {
    let output = Command::new(program).arg(mode).output().expect("the program runs");
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    let words: Vec<&str> = text.split_whitespace().collect();
    let [content, bad, hash] = words[..] else { panic!("{mode}: {text}") };
    (content == "1", bad.parse().expect("a count"), hash.to_owned())
}

/// Flush modes: FTZ alone, DAZ alone, both.
const FLUSHED: [&str; 3] = ["ftz", "daz", "both"];

#[test]
fn the_check_of_the_exported_c_sees_every_mode_under_which_bits_are_others_and_u_keeps_its_limits_under_all() {
    let folder = folder("modes");
    let source = drive(&folder);
    for level in ["-O0", "-O2", "-O3"] {
        let program = folder.join(format!("program{level}"));
        compile("cc", &[level, "-ffp-contract=off", "-frounding-math", "-lm"], &source, &program);
        let (is_content, bad, hash) = said(&program, "");
        assert_eq!((is_content, bad), (true, 0), "{level}");
        let rounded = ["up", "down", "zero"];
        let flushed = FLUSHED.iter().filter(|_| cfg!(target_arch = "x86_64"));
        for mode in rounded.iter().chain(flushed) {
            let (is_content, bad, other) = said(&program, mode);
            assert_eq!((is_content, bad), (false, 0), "{level} {mode}");
            if rounded.contains(mode) {
                assert_ne!(other, hash, "{level} {mode}: the bits are the same, and nothing needs to be assumed");
            }
        }
    }
}

/// Without the protection of the file, its check detects the compiler's changes; with the protection the compiler
/// cannot make them.
#[test]
fn the_check_sees_what_the_compiler_made_of_the_arithmetic() {
    let folder = folder("modes-compiler");
    let source = drive(&folder);
    let program = folder.join("program");
    // A link with -ffast-math flushes subnormal numbers from the first instruction on. GCC 13 and later with -shared no
    // longer does.
    if cfg!(target_arch = "x86_64") {
        let object = folder.join("user.o");
        compile("cc", &["-O2", "-ffp-contract=off", "-c"], &source, &object);
        compile("cc", &["-ffast-math", "-lm"], &object, &program);
        assert!(!said(&program, "").0, "linked with -ffast-math");
        compile("cc", &["-lm"], &object, &program);
        assert!(said(&program, "").0, "linked without");
    }
    // The file rejects these options by itself; a copy without the rejection and the pragmas detects them in its
    // arithmetic.
    let header = folder.join("drive.h");
    let text = fs::read_to_string(&header).expect("the file");
    assert!(refusal("cc", &["-ffast-math"], &source).contains("compile without -ffast-math"));
    let bare: Vec<&str> =
        text.lines().filter(|line| !line.starts_with("#error") && !line.starts_with("#pragma GCC")).collect();
    fs::write(&header, bare.join("\n")).expect("the copy");
    let options: &[&[&str]] = if cfg!(target_arch = "x86_64") {
        &[&["-ffast-math"], &["-funsafe-math-optimizations"], &["-ffinite-math-only"], &["-mfma", "-ffp-contract=fast"]]
    } else {
        &[&["-ffast-math"], &["-funsafe-math-optimizations"], &["-ffinite-math-only"]]
    };
    let has_fma = fs::read_to_string("/proc/cpuinfo").is_ok_and(|text| text.contains(" fma "));
    for options in options.iter().filter(|options| has_fma || !options.contains(&"-mfma")) {
        // The object file alone, without the additions of a link.
        let object = folder.join("user.o");
        compile("cc", &[&["-O2", "-c"], *options].concat(), &source, &object);
        compile("cc", &["-lm"], &object, &program);
        assert!(!said(&program, "").0, "{options:?}");
    }
    compile("cc", &["-O2", "-ffp-contract=off", "-lm"], &source, &program);
    assert!(said(&program, "").0, "{}", plain(&source));
}

/// The Rust library's own check in a program whose C code sets the modes.
#[test]
fn the_check_of_rust_is_content_here() {
    assert!(controller_core::modes_ok());
}
