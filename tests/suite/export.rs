//! Bit-identity of an exported file with its controller.
//!
//! C: every instance below is exported, compiled by the host's C compiler with all warnings as errors, and run with
//! random ticks next to the Rust tick. Samples lie near rest and far from it; some are NaN, infinities, denormals, -0,
//! too large, or spikes. Samples are missing in a row, the actuator applies other controls, and the controller
//! restarts. After every tick the test compares every bit of u, sigma, sigma*, health, the estimates and the whole
//! state. Rust: the exported static has the coefficients of the host's design, bit by bit.

use controller_core::{
    Benchmark, Coefficients, ControlLaw, Controller, FlexibleJoint, Gate, Gated, Health, Libm, Linear, Micromath,
    NominalModel, Output, Running, SampleLimits, channels,
};
use integration_tests::data::path;
use integration_tests::program::host_sim;
use integration_tests::strategy::Rng;
use integration_tests::{deep, sampled, sized};
use loop_sim::expression::Expression;
use loop_sim::port::in_process::{ControllerSpec, Download, Model};
use scenario::Source;
use std::env;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;
use tick_assembly::Effort;

/// Ticks per instance; all instances together run a million.
const TICKS: usize = 1_000_000_usize.div_ceil(INSTANCES.len());

/// Controller configuration: its name, a scenario, and its Rust tick.
type Instance = (&'static str, &'static str, fn(&str, &str) -> Run);

/// Every instance of the C library, one without an observer, mixed orders, and the maximum.
const INSTANCES: [Instance; 12] = [
    (
        "n2r1_2",
        "plant = { kind = 'chain', order = 2, a = [-2, -1], b = 2 }
         controller = { c = [5, 1], limits = { min = -30, max = 30 }, sigma_star_bound = 2, observer = [
             { channel = 2, printed = [40] } ] }",
        run::<2, 1, { channels(2, 1, [2]) }, 1>,
    ),
    (
        "n2r2_12",
        "plant = { kind = 'chain', order = 2, a = [0, -1], b = 2 }
         controller = { c = [5, 1], limits = { min = -30, max = 30 }, fallback = -0.25, observer = [
             { channel = 1, printed = [40, 400] }, { channel = 2, printed = [30, 200] } ] }",
        run::<2, 2, { channels(2, 2, [1, 2]) }, 2>,
    ),
    (
        "n2r1_none",
        "plant = { kind = 'chain', order = 2, a = [-2, -1], b = -2 }
         controller = { c = [5, 1] }",
        run::<2, 1, 0, 0>,
    ),
    (
        "n3r2_23",
        "plant = { kind = 'chain', order = 3, a = [-6, -11, -6], b = -2 }
         controller = { surface_bandwidth_rad_s = 4, limits = { min = -90, max = 80 }, k_s = 2, observer = [
             { channel = 2, printed = [80, 1600] }, { channel = 3, printed = [80, 1600] } ] }",
        run::<3, 2, { channels(3, 2, [2, 3]) }, 2>,
    ),
    (
        "n3r2_123",
        "plant = { kind = 'chain', order = 3, a = [-6, -11, -6], b = 1.5 }
         controller = { surface_bandwidth_rad_s = 4, observer = [
             { channel = 1, printed = [80, 1600] }, { channel = 2, printed = [80] },
             { channel = 3, printed = [80, 1600] } ] }",
        run::<3, 2, { channels(3, 2, [1, 2, 3]) }, 3>,
    ),
    (
        "n4r2_24",
        "plant = {}
         controller = { limits = { min = -300, max = 200 }, sigma_star_bound = 5 }",
        run::<4, 2, { channels(4, 2, [2, 4]) }, 2>,
    ),
    (
        "n4r2_24_mixed",
        "plant = {}
         controller = { initial_estimates = [0, 0.5, 0, -3], fallback = 1.5, observer = [
             { channel = 2, printed = [100, 20] }, { channel = 4, printed = [50] } ] }",
        run::<4, 2, { channels(4, 2, [2, 4]) }, 2>,
    ),
    (
        "n4r2_24_gated",
        "plant = {}
         controller = { limits = { min = -300, max = 300 }, samples = { min = [-2, -3, -4, -5], max = [3, 3, 3, 9],
             jump = [1, 2, 3, 4] } }",
        run::<4, 2, { channels(4, 2, [2, 4]) }, 2>,
    ),
    (
        "n4r3_24",
        "plant = {}
         controller = { k_s = 0.5, limits = { min = -300, max = 300 }, observer = [
             { channel = 2, bandwidth_rad_s = 50, order = 3 }, { channel = 4, bandwidth_rad_s = 50, order = 3 } ] }",
        run::<4, 3, { channels(4, 3, [2, 4]) }, 2>,
    ),
    (
        "n4r2_4",
        "plant = {}
         controller = { observer = [{ channel = 4, printed = [100, 20] }] }",
        run::<4, 2, { channels(4, 2, [4]) }, 1>,
    ),
    (
        "n4r3_1234",
        "plant = {}
         controller = { observer = [
             { channel = 1, bandwidth_rad_s = 50, order = 3 }, { channel = 2, bandwidth_rad_s = 50, order = 3 },
             { channel = 3, bandwidth_rad_s = 50, order = 3 }, { channel = 4, bandwidth_rad_s = 50, order = 3 } ] }",
        run::<4, 3, { channels(4, 3, [1, 2, 3, 4]) }, 4>,
    ),
    (
        "n6r3_3456",
        "plant = { kind = 'chain', order = 6, a = [-1, -6, -15, -20, -15, -6], b = 3 }
         controller = { surface_bandwidth_rad_s = 3, observer = [
             { channel = 3, bandwidth_rad_s = 50, order = 3 }, { channel = 4, bandwidth_rad_s = 50, order = 2 },
             { channel = 5, bandwidth_rad_s = 50, order = 3 }, { channel = 6, bandwidth_rad_s = 50, order = 1 } ] }",
        run::<6, 3, { channels(6, 3, [3, 4, 5, 6]) }, 4>,
    ),
];

/// Warnings that a file must pass in present C compilers.
pub(super) const STRICT: [&str; 6] = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wshadow"];
/// Firmware options; only the two files are linked.
pub(super) const CORTEX_M4F: [&str; 7] = [
    "-mcpu=cortex-m4",
    "-mthumb",
    "-mfpu=fpv4-sp-d16",
    "-mfloat-abi=hard",
    "-ffp-contract=off",
    "-ffreestanding",
    "-nostdlib",
];

/// Emulated core: its machine, compiler options, and memory.
#[derive(Debug, PartialEq)]
pub(super) struct Board {
    pub(super) machine: &'static str,
    pub(super) options: &'static [&'static str],
    code: u32,
    data: u32,
    /// Size of the data memory, bytes.
    size: u32,
}

pub(super) const STM32F405: Board =
    Board { machine: "netduinoplus2", options: &CORTEX_M4F, code: 0x0800_0000, data: 0x2000_0000, size: 0x2_0000 };

/// Cores with other float instructions or none; the compiler's library computes there.
const OTHER_BOARDS: [Board; 5] = [
    Board { machine: "microbit", options: &SOFT_M0, code: 0, data: 0x2000_0000, size: 0x4000 },
    Board { machine: "mps2-an385", options: &SOFT_M3, code: 0, data: 0x2000_0000, size: 0x2_0000 },
    Board { machine: "mps2-an386", options: &SOFT_M4, code: 0, data: 0x2000_0000, size: 0x2_0000 },
    Board { machine: "mps2-an500", options: &HARD_M7, code: 0, data: 0x2000_0000, size: 0x2_0000 },
    Board { machine: "mps2-an505", options: &HARD_M33, code: 0x1000_0000, data: 0x3800_0000, size: 0x2_0000 },
];

/// Returns the other boards. The fast tier runs the board whose library it builds.
pub(super) fn other_boards() -> &'static [Board] {
    if deep() { &OTHER_BOARDS } else { &OTHER_BOARDS[3..4] }
}
const SOFT_M0: [&str; 5] = ["-mcpu=cortex-m0", "-mfloat-abi=soft", "-ffreestanding", "-nostdlib", "-lgcc"];
const SOFT_M3: [&str; 5] = ["-mcpu=cortex-m3", "-mfloat-abi=soft", "-ffreestanding", "-nostdlib", "-lgcc"];
const SOFT_M4: [&str; 5] = ["-mcpu=cortex-m4", "-mfloat-abi=soft", "-ffreestanding", "-nostdlib", "-lgcc"];
const HARD_M7: [&str; 7] = [
    "-mcpu=cortex-m7",
    "-mfpu=fpv5-d16",
    "-mfloat-abi=hard",
    "-ffp-contract=off",
    "-ffreestanding",
    "-nostdlib",
    "-lgcc",
];
const HARD_M33: [&str; 7] = [
    "-mcpu=cortex-m33",
    "-mfpu=fpv5-sp-d16",
    "-mfloat-abi=hard",
    "-ffp-contract=off",
    "-ffreestanding",
    "-nostdlib",
    "-lgcc",
];

/// Creates a folder; tests run in parallel, so each has its own.
pub(super) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("export").join(name);
    fs::create_dir_all(&folder).expect("a folder for exported files");
    folder
}

/// Exports a scenario; returns the path of the file.
pub(super) fn exported(folder: &Path, name: &str, scenario: &str, form: &[&str]) -> PathBuf {
    let file = folder.join(name);
    let from = folder.join(format!("{name}.toml"));
    fs::write(&from, scenario).expect("a scenario");
    let mut args = vec!["export", plain(&from), "-o", plain(&file), "--force", "--paper"];
    args.extend(form);
    let spoken = host_sim(&args);
    assert_eq!(spoken.status, 0, "{}", spoken.err);
    file
}

pub(super) fn plain(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// Returns the numbers of the design in the form for a target.
fn download(scenario: &str) -> Download {
    let source = Source { file: "it", text: scenario, sets: &[] };
    scenario::parse(&source, "it").expect("a good scenario").download.expect("an f32 design")
}

/// Compiles a file that must give no warning.
pub(super) fn compile(compiler: &str, options: &[&str], file: &Path, program: &Path) {
    // The file comes first: libraries among the options serve the files before them.
    let output = Command::new(compiler).arg(file).args(options).arg("-o").arg(program).output();
    let output = output.unwrap_or_else(|error| {
        panic!("no C compiler `{compiler}` ({error}); on Debian: apt-get install gcc g++ gcc-arm-none-eabi");
    });
    assert!(output.status.success(), "{compiler} {}: {}", file.display(), String::from_utf8_lossy(&output.stderr));
}

/// Request to the program.
#[derive(Clone, Copy, PartialEq)]
enum Ask {
    /// Calls `tick_or_start`.
    Tick,
    /// Calls `report_applied` with the first number.
    ReportApplied,
    /// Calls `start` on a running state, and its first tick; nothing if the sample is invalid.
    Start,
    /// Calls `reset`, then `tick_or_start`.
    Forget,
}

/// Requests to the Rust tick and its answers.
struct Run {
    n: usize,
    r: usize,
    /// Observed channels, from 1.
    observed: Vec<usize>,
    /// Numbers of an innovation gate in the state; 0 without a gate.
    gated: usize,
    /// Requests as bytes: kind, then n floats.
    asked: Vec<u8>,
    /// Words of an answer: status, then u, sigma, sigma*, the state and the estimates.
    words: usize,
    answers: Vec<u32>,
}

/// Where the driver runs.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Place {
    Here,
    /// On an emulated core: reset, FPU on, requests and answers through the emulator's semihosting.
    On(&'static Board),
}

/// Transfer functions of the host: `receive` reads, `send` answers; both return the number of bytes.
pub(super) const ON_THE_HOST: &str = "
#include <stdio.h>
static size_t receive(void *to, size_t bytes) { return fread(to, 1, bytes, stdin); }
static void send(const void *from, size_t bytes) { fwrite(from, 1, bytes, stdout); }
";
pub(super) const ON_THE_CHIP: &str = "
#include <stddef.h>
#include <stdint.h>
int main(void);
void reset(void);
extern uint32_t stack_top;
void *memcpy(void *to, const void *from, size_t bytes);
void *memset(void *to, int value, size_t bytes);
static uintptr_t ask_emulator(uintptr_t what, const void *with)
{
    register uintptr_t r0 __asm__(\"r0\") = what;
    register const void *r1 __asm__(\"r1\") = with;
    __asm__ volatile(\"bkpt 0xab\" : \"+r\"(r0) : \"r\"(r1) : \"memory\");
    return r0;
}
static uintptr_t requests, replies;
static uintptr_t open_file(const char *name, uintptr_t length, uintptr_t mode)
{
    const uintptr_t block[] = { (uintptr_t)name, mode, length };
    return ask_emulator(1, block);
}
static size_t receive(void *to, size_t bytes)
{
    const uintptr_t block[] = { requests, (uintptr_t)to, bytes };
    return bytes - ask_emulator(6, block);
}
static void send(const void *from, size_t bytes)
{
    const uintptr_t block[] = { replies, (uintptr_t)from, bytes };
    (void)ask_emulator(5, block);
}
/* The compiler may call these by itself. */
void *memcpy(void *to, const void *from, size_t bytes)
{
    for (size_t k = 0; k < bytes; k++) {
        ((volatile char *)to)[k] = ((const char *)from)[k];
    }
    return to;
}
void *memset(void *to, int value, size_t bytes)
{
    for (size_t k = 0; k < bytes; k++) {
        ((volatile char *)to)[k] = (char)value;
    }
    return to;
}
void reset(void)
{
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm__ volatile(\"dsb\\n isb\");
    requests = open_file(\"IN\", 2, 1);
    replies = open_file(\"OUT\", 3, 5);
    (void)main();
    (void)ask_emulator(2, &replies);
    (void)ask_emulator(0x18, (const void *)0x20026);
}
__attribute__((section(\".vectors\"), used)) static const struct {
    uint32_t *stack;
    void (*handler)(void);
} vectors = { &stack_top, reset };
";
/// Returns a linker script for code, constants and zeros.
fn layout(Board { code, data, size, .. }: &Board) -> String {
    format!(
        "ENTRY(reset)
SECTIONS {{
    .text {code:#x} : {{ KEEP(*(.vectors)) *(.text*) *(.rodata*) }}
    .bss {data:#x} (NOLOAD) : {{ *(.bss*) *(COMMON) }}
    .data : {{ *(.data*) }}
    /DISCARD/ : {{ *(.ARM.*) }}
}}
stack_top = {:#x};
ASSERT(SIZEOF(.data) == 0, \"there is nobody to fill .data\")
ASSERT(SIZEOF(.bss) + 2048 < {size}, \"the stack needs room\")
",
        data + size
    )
}

/// Returns the C program around the exported file: requests in, answers out.
fn driver(run: &Run, exported: &str, place: Place) -> String {
    let of = |stem: &str, end: &str| run.observed.iter().map(|i| format!("{stem}{i}{end}")).collect::<Vec<_>>();
    let folded = run.observed.iter().flat_map(|i| ["a", "b", "c"][..run.r].iter().map(move |m| format!("{m}{i}")));
    let mut state: Vec<String> = folded.chain(of("p", "")).chain(of("x", "_prev")).collect();
    state.extend(["offset", "held"].map(String::from));
    state.extend((1..=run.gated).map(|j| format!("x{j}_seen")));
    let state = format!("state.{}, ", state.join(", state."));
    let transfer = if place == Place::Here { ON_THE_HOST } else { ON_THE_CHIP };
    format!(
        "#include \"{exported}\"
{transfer}
static struct {{ unsigned what; float x[{n}]; }} asks[32];
static struct {{ unsigned said; float all[{floats}]; }} answers[32];

int main(void)
{{
    edo_smc_state state = {{0}};
    float d_hat[{n}][{r}];
    size_t count;
    while ((count = receive(asks, sizeof asks) / sizeof asks[0]) > 0) {{
        for (size_t k = 0; k < count; k++) {{
            const float *const x = asks[k].x;
            edo_smc_output output = {{0.0f, 0.0f, 0.0f}};
            unsigned said;
            switch (asks[k].what) {{
            case 1: said = edo_smc_report_applied(&state, x[0]); break;
            case 2: said = edo_smc_start(&state, x) ? edo_smc_tick(&state, x, &output) : 0u; break;
            case 3: edo_smc_reset(&state); said = edo_smc_tick_or_start(&state, x, &output); break;
            default: said = edo_smc_tick_or_start(&state, x, &output); break;
            }}
            const bool known = edo_smc_estimates(&state, d_hat);
            const float all[] = {{ output.u, output.sigma, output.sigma_star, {state}state.resuming ? 1.0f : 0.0f,
                state.started ? 1.0f : 0.0f, known ? 1.0f : 0.0f }};
            const size_t length = sizeof all / sizeof all[0];
            answers[k].said = said;
            for (size_t j = 0; j < length; j++) {{
                answers[k].all[j] = all[j];
            }}
            for (size_t j = 0; j < {n} * {r}; j++) {{
                answers[k].all[length + j] = d_hat[j / {r}][j % {r}];
            }}
        }}
        send(answers, count * sizeof answers[0]);
    }}
    return 0;
}}
",
        n = run.n,
        r = run.r,
        floats = run.words - 1,
    )
}

/// Converts the words of a running controller to `count` numbers of its state in field order, the last `gated` ones
/// from the gate. The flags for resuming and started follow. b(x)/b_0 of the last tick is skipped, because C omits it
/// where b is constant.
fn numbers(words: &[u32], count: usize, gated: usize) -> Vec<f32> {
    let [_, started, ref state @ .., _] = *words else { panic!("words of a running controller") };
    if started == 0 {
        return vec![0.0; count + gated + 2];
    }
    let [resuming, ref state @ ..] = *state else { panic!("flag and numbers, not {state:?}") };
    assert_eq!(state.len(), count + 1 + gated);
    let kept = state[..count].iter().chain(&state[count + 1..]);
    kept.copied().map(f32::from_bits).chain([resuming as f32, 1.0]).collect()
}

/// Numbers that are rare in samples.
pub(super) const EDGES: [f32; 20] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    0.0,
    -0.0,
    1e-45,
    -1e-45,
    f32::MIN_POSITIVE,
    -1.1e-38,
    f32::MAX,
    f32::MIN,
    1e12,
    -1.000_001e12,
    1e30,
    -3e29,
    1e20,
    1e9,
    -1e5,
    1.0,
    f32::EPSILON,
];

/// Random samples of a plant near rest, with all faults now and then.
struct Samples {
    rng: Rng,
    scale: f64,
    bad_left: usize,
}

impl Samples {
    fn next<const N: usize>(&mut self) -> [f32; N] {
        let rng = &mut self.rng;
        if rng.chance(0.01) {
            self.scale = rng.spread(1e-6, 10.0);
        }
        if rng.chance(0.01) {
            self.bad_left = rng.integer(1, 6);
        }
        let mut x = core::array::from_fn(|_| (self.scale * rng.within(-1.0, 1.0)) as f32);
        if self.bad_left > 0 {
            self.bad_left -= 1;
            let bad = match rng.integer(0, 2) {
                0 => f32::from_bits(rng.bits() as u32),
                1 => EDGES[rng.integer(0, EDGES.len() - 1)],
                _ => rng.spread(1.0, 1e25) as f32,
            };
            if rng.chance(0.2) { x = [bad; N] } else { x[rng.integer(0, N - 1)] = bad }
        }
        x
    }

    fn ask(&mut self, started: bool) -> Ask {
        match self.rng.integer(0, 999) {
            0 => Ask::Forget,
            1..=3 if started => Ask::Start,
            4..=103 => Ask::ReportApplied,
            _ => Ask::Tick,
        }
    }
}

type Law<const N: usize, const R: usize, const MASK: u8, const O: usize> =
    Controller<f32, Linear<f32, N>, N, R, MASK, O>;

/// Runs the Rust controller of a scenario.
fn run<const N: usize, const R: usize, const MASK: u8, const O: usize>(name: &str, scenario: &str) -> Run {
    let source = Source { file: "it", text: scenario, sets: &[] };
    let experiment = scenario::parse(&source, "it").expect("a good scenario");
    let (download, spec) = (experiment.download.expect("an f32 design"), experiment.spec.expect("a design"));
    let shape = download.shape;
    assert_eq!((usize::from(shape.n), usize::from(shape.r), shape.mask), (N, R, MASK), "{name}");
    let mut given = download.numbers.iter().copied();
    let mut next = || given.next().expect("as many as the layout says");
    let d_hat: [f32; N] = core::array::from_fn(|_| next());
    let row = core::array::from_fn(|_| next());
    let coefficients = Coefficients::<f32, N, R, O>::from_numbers(given).expect("a design");
    let controller = Law::<N, R, MASK, O>::from_parts(coefficients, Linear::from_row(row));
    let observed = (1..=N).filter(|i| MASK >> (i - 1) & 1 == 1).collect();
    let samples = spec.config.fixed::<N, R>().expect("the shape").options.samples;
    if samples == SampleLimits::NONE {
        run_of(name, &controller, d_hat, observed, 0)
    } else {
        run_of(name, &Gated::new(controller, Gate::<f32, N>::new(&samples)), d_hat, observed, N)
    }
}

/// Runs the joint of a scenario as firmware has it; its a(x) has no product with x_2.
fn run_joint<const R: usize, const MASK: u8, const O: usize>(name: &str, scenario: &str) -> Run {
    let source = Source { file: "it", text: scenario, sets: &[] };
    let spec = scenario::parse(&source, "it").expect("a good scenario").spec.expect("a design");
    let config = spec.config.fixed::<4, R>().expect("the shape");
    let joint = FlexibleJoint::<f32>::new(&config.nominal);
    let controller = Controller::<f32, FlexibleJoint<f32>, 4, R, MASK, O>::design(&config, joint);
    let observed = (1..=4).filter(|i| MASK >> (i - 1) & 1 == 1).collect();
    let d_hat = config.options.initial_estimates.map(|value| value as f32);
    run_of(name, &controller, d_hat, observed, 0)
}

/// Runs any controller; the last `gated` numbers of its state belong to a gate.
fn run_of<D, const N: usize, const R: usize>(
    name: &str,
    controller: &D,
    d_hat: [f32; N],
    observed: Vec<usize>,
    gated: usize,
) -> Run
where
    D: ControlLaw<Scalar = f32, Sample = [f32; N], Guess = [f32; N], Output = Output<f32>, Estimates = [[f32; R]; N]>,
{
    // Requests and the answers of the Rust tick.
    let mut samples =
        Samples { rng: Rng::new(0x5eed + 10 * observed.len() as u64 + 100 * N as u64), scale: 0.1, bad_left: 0 };
    let mut running = Running::guessing(controller, d_hat);
    let (mut asked, mut answers, mut seen, mut ticks) = (Vec::new(), Vec::new(), [0_usize; 8], 0);
    let mut words = 0;
    while ticks < sized(TICKS) {
        let (ask, mut x) = (samples.ask(running.estimates().is_some()), samples.next::<N>());
        let (said, outputs) = match ask {
            Ask::Tick | Ask::Forget => {
                if ask == Ask::Forget {
                    running.reset();
                }
                let output = running.tick(&x);
                ticks += 1;
                seen[usize::from(output.health.bits())] += 1;
                (u32::from(output.health.bits()), [output.u, output.sigma, output.sigma_star])
            }
            Ask::ReportApplied => {
                x[0] *= 100.0;
                (u32::from(running.report_applied(x[0])), [0.0; 3])
            }
            Ask::Start => {
                if controller.start_from(&x, &d_hat).is_some() {
                    running.reset();
                    let output = running.tick(&x);
                    (u32::from(output.health.bits()), [output.u, output.sigma, output.sigma_star])
                } else {
                    (0, [0.0; 3])
                }
            }
        };
        asked.extend((ask as u32).to_le_bytes());
        asked.extend(x.iter().flat_map(|value| value.to_le_bytes()));
        let state = numbers(&running.words().collect::<Vec<_>>(), observed.len() * (R + 2) + 2, gated);
        let known = if running.estimates().is_some() { 1.0 } else { 0.0 };
        let estimates = running.estimates().unwrap_or([[0.0; R]; N]);
        let all = outputs.iter().chain(&state).chain([&known]).chain(estimates.as_flattened());
        answers.push(said);
        answers.extend(all.map(|value| value.to_bits()));
        words = 4 + state.len() + 1 + N * R;
    }
    let healthy = seen[0];
    let saturated = seen[usize::from(Health::SATURATED.bits())];
    let rejected = seen[usize::from(Health::INPUT_REJECTED.bits())];
    println!("{name}: {ticks} ticks, {healthy} healthy, {saturated} saturated, {rejected} rejected");
    // A run must contain enough valid ticks to test its design.
    assert!(healthy > ticks / 20 && rejected > ticks / 200, "{name}: the run shows too little: {seen:?}");

    Run { n: N, r: R, observed, gated, asked, words, answers }
}

/// Compiles a program that includes exported files, runs it, and returns the words of its answers.
pub(super) fn answers(folder: &Path, program_text: &str, options: &[&str], asked: &[u8], place: Place) -> Vec<u32> {
    let source = folder.join("driver.c");
    fs::write(&source, program_text).expect("the driver");
    fs::write(folder.join("IN"), asked).expect("the requests");
    let program = folder.join("program");
    let answered = match place {
        Place::Here => {
            compile("cc", &[&STRICT[..], options].concat(), &source, &program);
            let requests = File::open(folder.join("IN")).expect("the requests");
            let ran = Command::new(&program).stdin(requests).output().expect("the program runs");
            assert!(ran.status.success(), "{}: {}", folder.display(), ran.status);
            ran.stdout
        }
        Place::On(board) => {
            let layout = folder.join("layout.ld");
            fs::write(&layout, self::layout(board)).expect("the layout");
            compile(
                "arm-none-eabi-gcc",
                &[&STRICT[..], options, board.options, &["-T", plain(&layout)]].concat(),
                &source,
                &program,
            );
            let ran = Command::new("qemu-system-arm")
                .args(["-M", board.machine, "-nographic", "-monitor", "none", "-serial", "null"])
                .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
                .arg(&program)
                .current_dir(folder)
                .output()
                .unwrap_or_else(|error| {
                    panic!("no qemu-system-arm ({error}); on Debian: apt-get install qemu-system-arm")
                });
            assert!(ran.status.success(), "{}: {ran:?}", folder.display());
            fs::read(folder.join("OUT")).expect("the answers")
        }
    };
    answered.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

/// Compares every word of every answer of an exported file with the Rust tick.
fn compare(name: &str, scenario: &str, run: &Run, place: Place) {
    let folder = folder(if place == Place::Here { "here" } else { "chip" }).join(name);
    fs::create_dir_all(&folder).expect("a folder");
    let exported = exported(&folder, &format!("{name}.h"), scenario, &["--standalone"]);
    let answered = answers(&folder, &driver(run, plain(&exported), place), &["-O2"], &run.asked, place);
    held_together(name, &answered, &run.answers, run.words);
    fs::remove_dir_all(&folder).expect("the folder goes");
}

fn held_together(name: &str, answered: &[u32], expected: &[u32], words: usize) {
    assert_eq!(answered.len(), expected.len(), "{name}: words of the answers");
    for (k, (c, rust)) in answered.chunks(words).zip(expected.chunks(words)).enumerate() {
        let shown = |words: &[u32]| {
            let floats: Vec<f32> = words[1..].iter().map(|&word| f32::from_bits(word)).collect();
            format!("said {}, u, sigma, sigma*, state and estimates {floats:?}", words[0])
        };
        assert!(c == rust, "{name}: answer {k}\nC:    {}\nRust: {}", shown(c), shown(rust));
    }
}

/// Exports a scenario as assembly and compares it with the Rust tick on the emulated target.
fn compare_assembly(name: &str, scenario: &str, run: &Run, effort: &Effort) {
    let folder = folder("assembly").join(name);
    fs::create_dir_all(&folder).expect("a folder");
    let source = Source { file: "it", text: scenario, sets: &[] };
    let experiment = scenario::parse(&source, "it").expect("a good scenario");
    let files = forms::assembly(&experiment, &source, forms::PREFIX, effort);
    let files = files.unwrap_or_else(|why| panic!("{name}: {why}"));
    let (assembly, header) = (folder.join("tick.S"), folder.join("tick.h"));
    fs::write(&assembly, files.assembly).expect("the assembly");
    fs::write(&header, files.header).expect("the header");
    let place = Place::On(&STM32F405);
    let answered = answers(&folder, &driver(run, "tick.h", place), &["-O2", plain(&assembly)], &run.asked, place);
    held_together(name, &answered, &run.answers, run.words);
    fs::remove_dir_all(&folder).expect("the folder goes");
}

/// Plant order, highest observer order, observed channels.
type Shape = (usize, usize, u8);

/// Every configuration that a scenario can have; without an observer the order has no meaning. The fast tier takes
/// every sixth.
fn shapes() -> impl Iterator<Item = Shape> {
    macro_rules! list {
        ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => { [$(($n, $r, $mask)),*] };
    }
    let all: [Shape; 116] = controller_core::shapes!(all => list);
    all.into_iter().filter(|&(_, r, mask)| mask != 0 || r == 1).step_by(if deep() { 1 } else { 6 })
}

fn scenario_of((n, r, mask): Shape) -> String {
    let observer = |i: usize| format!("{{ channel = {i}, bandwidth_rad_s = {}, order = {r} }}", 30 + 10 * i);
    let observers: Vec<String> = (1..=n).filter(|i| mask >> (i - 1) & 1 == 1).map(observer).collect();
    format!(
        "plant = {{ kind = 'chain', order = {n}, a = {:?}, b = {} }}
         controller = {{ surface_bandwidth_rad_s = 4, k_s = {}, fallback = {}, sigma_star_bound = 5, limits = {{
             min = -90, max = 80 }}, initial_estimates = {:?}, observer = [{}] }}",
        // No entry is 0: assembly omits such a product, which the sign of a zero can reveal.
        &[-3.0, -7.0, 2.0, -5.0, 4.0, -11.0][..n],
        if n % 2 == 0 { 1.5 } else { -2.0 },
        if r == 2 { 0.5 } else { 0.0 },
        if r == 3 { "-1.25" } else { "'hold'" },
        (1..=n).map(|i| if mask >> (i - 1) & 1 == 1 { 0.25 * i as f64 } else { 0.0 }).collect::<Vec<_>>(),
        observers.join(", "),
    )
}

/// Several scenarios in one program.
struct Many {
    /// Program without its transfer functions.
    program: String,
    /// Files for the assembler.
    linked: Vec<String>,
    asked: Vec<u8>,
    /// Expected answers, from the controller that `host-sim` runs.
    expected: Vec<u32>,
}

/// Exports these scenarios into one program, as C or as assembly with this effort.
fn of_many(scenarios: &[String], assembly: Option<&Effort>) -> Many {
    let (mut program, mut cases) = (String::new(), String::new());
    let mut many = Many { program: String::new(), linked: Vec::new(), asked: Vec::new(), expected: Vec::new() };
    let mut rejected = 0;
    for (k, text) in scenarios.iter().enumerate() {
        let source = Source { file: "it", text, sets: &[] };
        let mut experiment = scenario::parse(&source, "it").unwrap_or_else(|error| panic!("{error}\n{text}"));
        let spec = experiment.spec.clone().expect("a controller");
        let prefix = format!("s{k}");
        if let Some(effort) = assembly {
            let files = forms::assembly(&experiment, &source, &prefix, effort);
            let files = files.unwrap_or_else(|why| panic!("{why}\n{text}"));
            program += &files.header;
            many.linked.push(files.assembly);
        } else {
            program += &forms::export(&experiment, &source, forms::Form::Standalone(&prefix)).expect("exported");
        }
        cases += &CASE.replace('@', &k.to_string());
        let given = ["", ", ask->x[4]", ", ask->x[4], ask->x[5]"][given(&spec, &[0.0; 6]).len()];
        program += &SERVE.replace('@', &prefix).replace('#', &format!("S{k}")).replace("GIVEN", given);

        let mut samples = Samples { rng: Rng::new(0xace + k as u64), scale: 0.1, bad_left: 0 };
        for _ in 0..sized(TICKS_OF_MANY).div_ceil(scenarios.len()) {
            let (ask, mut x) = (samples.ask(false), samples.next::<6>());
            let mut answer = [0_u32; WORDS];
            if ask == Ask::ReportApplied {
                x[0] *= 100.0;
                experiment.port.report_applied(f64::from(x[0]));
            } else {
                if ask == Ask::Forget {
                    experiment.port.reset().expect("a controller in this process");
                }
                let tick = experiment.port.tick(&x.map(f64::from)[..spec.config.n]).expect("a tick in this process");
                rejected += usize::from(tick.health.contains(Health::INPUT_REJECTED));
                answer[0] = u32::from(tick.health.bits());
                let estimates = tick.estimates.as_flattened();
                let all = [tick.u, tick.sigma, tick.sigma_star].into_iter().chain(estimates.iter().copied());
                all.zip(&mut answer[1..]).for_each(|(number, word)| *word = (number as f32).to_bits());
                let given = self::given(&spec, &x);
                x[4..].iter_mut().zip(given).for_each(|(place, number)| *place = number);
            }
            let words = [k as u32, ask as u32].into_iter().chain(x.map(f32::to_bits));
            many.asked.extend(words.flat_map(u32::to_le_bytes));
            many.expected.extend(answer);
        }
    }
    // With a plant of order 2 only one in three invalid numbers has an effect.
    assert!(rejected > sized(TICKS_OF_MANY) / 200, "{rejected} bad samples show too little");
    many.program = [ASKS, &program, &MANY_MAIN.replace('@', &cases)].concat();
    many
}

/// Values that the caller of a tick computes at x, for a plant of order 2: a(x)/b_0, and b(x)/b_0 if it varies.
fn given(spec: &ControllerSpec, x: &[f32; 6]) -> Vec<f32> {
    let planar = [x[0], x[1]];
    match &spec.model {
        Model::Linear(_) => Vec::new(),
        Model::BenchmarkLibm => vec![Benchmark::<Libm>::new().drift(&planar)],
        Model::BenchmarkMicromath => vec![Benchmark::<Micromath>::new().drift(&planar)],
        Model::Formulas { drift, gain } => {
            let (at, b_0) = (planar.map(f64::from), spec.config.padded.nominal.input_gain);
            let over_b_0 = |of: &Expression| (of.value(&at) / b_0) as f32;
            [Some(over_b_0(drift)), gain.varies().then(|| over_b_0(gain))].into_iter().flatten().collect()
        }
    }
}

fn compare_many(name: &str, many: &Many, place: Place) {
    let folder = folder(name);
    let transfer = if place == Place::Here { ON_THE_HOST } else { ON_THE_CHIP };
    let linked: Vec<PathBuf> = (0..many.linked.len()).map(|k| folder.join(format!("tick{k}.S"))).collect();
    for (file, text) in linked.iter().zip(&many.linked) {
        fs::write(file, text).expect("the assembly");
    }
    // A hundred ticks in one program; -O1 keeps the compile time short.
    let options: Vec<&str> = std::iter::once("-O1").chain(linked.iter().map(|file| plain(file))).collect();
    let answered = answers(&folder, &[transfer, &many.program].concat(), &options, &many.asked, place);
    held_together(name, &answered, &many.expected, WORDS);
    fs::remove_dir_all(&folder).expect("the folder goes");
}

fn compare_shapes(place: Place) {
    static ALL: LazyLock<Many> = LazyLock::new(|| of_many(&shapes().map(scenario_of).collect::<Vec<_>>(), None));
    compare_many(if place == Place::Here { "shapes-here" } else { "shapes-chip" }, &ALL, place);
}

/// Words of an answer: status, three outputs, estimates.
const WORDS: usize = 4 + 18;
/// Ticks of all scenarios of a program together.
const TICKS_OF_MANY: usize = 200_000;
const ASKS: &str = "
typedef struct { unsigned shape; unsigned what; float x[6]; } ask_type;
typedef struct { unsigned said; float outputs[3]; float estimates[6][3]; } answer_type;
static ask_type asks[128];
static answer_type answers[128];
";
const SERVE: &str = "
static void serve_@(const ask_type *ask, answer_type *answer)
{
    static @_state state;
    @_output output = {0.0f, 0.0f, 0.0f};
    float d_hat[#_N][#_R];
    const answer_type nothing = {0};
    *answer = nothing;
    if (ask->what == 1u) {
        (void)@_report_applied(&state, ask->x[0]);
        return;
    }
    if (ask->what == 3u) {
        @_reset(&state);
    }
    answer->said = @_tick_or_start(&state, ask->x, &output GIVEN);
    answer->outputs[0] = output.u;
    answer->outputs[1] = output.sigma;
    answer->outputs[2] = output.sigma_star;
    (void)@_estimates(&state, d_hat);
    for (int i = 0; i < #_N; i++) {
        for (int m = 0; m < #_R; m++) {
            answer->estimates[i][m] = d_hat[i][m];
        }
    }
}
";
const CASE: &str = "            case @: serve_s@(&asks[k], &answers[k]); break;\n";
const MANY_MAIN: &str = "
int main(void)
{
    size_t count;
    while ((count = receive(asks, sizeof asks) / sizeof asks[0]) > 0) {
        for (size_t k = 0; k < count; k++) {
            switch (asks[k].shape) {
@            default: break;
            }
        }
        send(answers, count * sizeof answers[0]);
    }
    return 0;
}
";

fn compare_all(place: Place) {
    for (name, scenario, run) in sampled(INSTANCES, 3) {
        compare(name, scenario, &run(name, scenario), place);
    }
}

#[test]
fn the_exported_c_gives_the_bits_of_the_tick() {
    compare_all(Place::Here);
}

#[test]
fn the_exported_c_gives_the_bits_of_the_tick_on_the_emulated_chip() {
    compare_all(Place::On(&STM32F405));
}

#[test]
fn the_exported_c_of_every_shape_gives_the_bits_of_the_controller_that_the_host_runs() {
    compare_shapes(Place::Here);
}

#[test]
fn the_exported_c_of_every_shape_gives_them_on_the_emulated_chip() {
    compare_shapes(Place::On(&STM32F405));
}

/// Smallest search effort, for many files.
const LEAST: Effort = Effort { rounds: 1, steps: 20_000, seed: 1 };

#[test]
fn the_exported_assembly_of_every_shape_gives_the_bits_of_the_controller_that_the_host_runs() {
    let many = of_many(&sampled(shapes(), 4).map(scenario_of).collect::<Vec<_>>(), Some(&LEAST));
    compare_many("shapes-assembly", &many, Place::On(&STM32F405));
}

/// The caller of the tick computes the non-linear terms.
#[test]
fn the_exported_assembly_takes_a_and_b_of_x_from_its_caller() {
    let law = "surface_bandwidth_rad_s = 4, k_s = 0.5, sigma_star_bound = 5, limits = { min = -90, max = 80 },
        observer = [{ channel = 2, bandwidth_rad_s = 50, order = 2 }]";
    let own = |b: &str| {
        format!(
            "plant = {{ kind = 'own', x0 = [0, 0], rates = ['x2', '-sin(x1) + u'] }}
             controller = {{ {law}, nominal = {{ a = '-2*sin(x1) - x2', b = '{b}' }} }}"
        )
    };
    let benchmark = |exp: &str| format!("plant = {{ kind = 'benchmark' }}\ncontroller = {{ {law}, exp = '{exp}' }}");
    let scenarios = [own("2 + 0.5*cos(x1)"), own("-2"), benchmark("libm"), benchmark("micromath")];
    compare_many("given-assembly", &of_many(&scenarios, Some(&QUICK)), Place::On(&STM32F405));
}

#[test]
fn the_header_of_the_exported_assembly_is_one_of_cpp_too() {
    let folder = folder("assembly-cpp");
    let (name, scenario, _) = INSTANCES[0];
    let source = Source { file: "it", text: scenario, sets: &[] };
    let experiment = scenario::parse(&source, "it").expect("a good scenario");
    let files = forms::assembly(&experiment, &source, "left", &QUICK).unwrap_or_else(|why| panic!("{name}: {why}"));
    let user = "#include \"tick.h\"
#include \"tick.h\"
extern \"C\" void reset() {
    static left_state state;
    left_output output;
    float d_hat[LEFT_N][LEFT_R];
    const float x[LEFT_N] = {0.0F};
    left_reset(&state);
    const bool good = left_tick_or_start(&state, x, &output) == LEFT_OK && left_report_applied(&state, output.u)
        && left_estimates(&state, d_hat) && left_not_started(&output) == LEFT_INPUT_REJECTED;
    while (good && left_tick_u(&state, x) >= 0.0F) {
    }
}
";
    let (assembly, user_file, layout) = (folder.join("tick.S"), folder.join("user.cpp"), folder.join("layout.ld"));
    for (file, text) in [(&assembly, &*files.assembly), (&folder.join("tick.h"), &files.header), (&user_file, user)] {
        fs::write(file, text).expect("a file");
    }
    fs::write(&layout, self::layout(&STM32F405)).expect("the layout");
    let warnings = ["-Wall", "-Wextra", "-Werror", "-pedantic-errors", "-O2"];
    for standard in ["-std=c++11", "-std=c++17"] {
        // The assembly is linked, so every name is resolved.
        let options = [&[standard, plain(&assembly), "-T", plain(&layout)], &warnings[..], &CORTEX_M4F].concat();
        compile("arm-none-eabi-g++", &options, &user_file, &folder.join("program"));
        compile("c++", &[&[standard, "-c"], &warnings[..]].concat(), &user_file, &folder.join("here.o"));
    }
}

/// Search effort that suffices for a valid order.
pub(super) const QUICK: Effort = Effort { rounds: 1, steps: 120_000, seed: 1 };

#[test]
fn the_exported_assembly_gives_the_bits_of_the_tick_on_the_emulated_chip() {
    for (name, scenario, run) in sampled(INSTANCES, 3) {
        // A gate adds a code path to the tick, and the joint's a(x) has an entry that is 0.
        if !scenario.contains("samples") && !scenario.contains("plant = {}") && name != "n2r2_12" {
            compare_assembly(name, scenario, &run(name, scenario), &QUICK);
        }
    }
}

#[test]
fn the_exported_assembly_of_the_joint_gives_the_bits_of_its_tick_on_the_emulated_chip() {
    type Ticks = fn(&str, &str) -> Run;
    const BOTH: u8 = channels(4, 2, [2, 4]);
    let ticks: [(&str, Ticks); 5] = [
        ("n4r2_24", run_joint::<2, BOTH, 2>),
        ("n4r2_24_mixed", run_joint::<2, BOTH, 2>),
        ("n4r3_24", run_joint::<3, BOTH, 2>),
        ("n4r2_4", run_joint::<2, { channels(4, 2, [4]) }, 1>),
        ("n4r3_1234", run_joint::<3, { channels(4, 3, [1, 2, 3, 4]) }, 4>),
    ];
    for (name, run) in sampled(ticks, 3) {
        let (_, scenario, _) = INSTANCES.iter().find(|(wanted, ..)| *wanted == name).expect("an instance");
        compare_assembly(name, scenario, &run(name, scenario), &QUICK);
    }
}

#[test]
fn two_exported_controllers_live_in_one_program_of_c_and_of_cpp() {
    let folder = folder("two");
    let (_, left, _) = INSTANCES[0];
    let (_, right, _) = INSTANCES[7];
    exported(&folder, "left.h", left, &["--standalone", "--prefix", "left"]);
    exported(&folder, "right.h", right, &["--standalone", "--prefix", "right"]);
    let user = "#include \"left.h\"
#include \"right.h\"
#include \"left.h\"
int main(void)
{
    left_state of_left = {0};
    right_state of_right = {0};
    left_output left;
    right_output right;
    const float x[RIGHT_N] = {0.0f};
    return left_tick_or_start(&of_left, x, &left) == LEFT_OK && right_tick_or_start(&of_right, x, &right) == RIGHT_OK
        && left_report_applied(&of_left, 1.0f) && right_report_applied(&of_right, 1.0f) ? 0 : 1;
}
";
    for (compiler, file, options) in [
        ("cc", "user.c", &STRICT[..]),
        ("cc", "user.c", &["-std=c17", "-Wall", "-Wextra", "-Werror", "-pedantic-errors", "-O2"]),
        (
            "c++",
            "user.cpp",
            &[
                "-std=c++11",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-pedantic-errors",
                "-O2",
                "-Wno-missing-field-initializers",
            ],
        ),
    ] {
        let (source, program) = (folder.join(file), folder.join(file).with_extension(compiler));
        fs::write(&source, user).expect("the program");
        compile(compiler, options, &source, &program);
        let ran = Command::new(&program).status().expect("the program runs");
        assert!(ran.success(), "{compiler}: {ran}");
    }
}

/// Returns the error message of a compiler that must reject a file.
pub(super) fn refusal(compiler: &str, options: &[&str], file: &Path) -> String {
    let output = Command::new(compiler).args(options).args(["-fsyntax-only", plain(file)]).output();
    let output = output.unwrap_or_else(|error| panic!("no C compiler `{compiler}` ({error})"));
    assert!(!output.status.success(), "{compiler} {options:?} takes {}", file.display());
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn two_designs_of_one_prefix_in_one_program_are_refused_by_the_compiler() {
    let folder = folder("prefix");
    let include = format!("-I{}", plain(&path("../controller-capi/include").canonicalize().expect("a folder")));
    for (form, guard) in [("--standalone", "EDO_SMC_STANDALONE"), ("--lang=c", "EDO_SMC_DESIGN_H")] {
        let hash = |file: &Path| {
            let text = fs::read_to_string(file).expect("an exported file");
            text.split_once(&format!("#define {guard} 0x")).expect("its guard").1[..8].to_string()
        };
        let one = exported(&folder, "one.h", INSTANCES[5].1, &[form]);
        let other =
            exported(&folder, "other.h", "plant = {}\ncontroller = { limits = { min = -300, max = 201 } }", &[form]);
        let source = folder.join("user.c");
        fs::write(&source, "#include \"one.h\"\n#include \"other.h\"\n").expect("the program");
        for compiler in ["cc", "c++"] {
            let said = refusal(compiler, &[&include], &source);
            let told = format!("two designs with the prefix edo_smc, 0x{}u here and {guard} before", hash(&other));
            assert!(said.contains(&told), "{said}");
            assert!(said.contains(&format!("#define {guard} 0x{}u", hash(&one))), "the other by number: {said}");
        }
        fs::write(&source, "#include \"one.h\"\n#include \"one.h\"\nint main(void) { return 0; }\n").expect("it");
        compile("cc", &[&include], &source, &folder.join("program"));
    }
}

#[test]
fn the_exported_c_does_not_compile_with_options_that_change_its_numbers() {
    let folder = folder("options");
    let file = exported(&folder, "it.h", INSTANCES[5].1, &["--standalone"]);
    for options in [
        &["-ffast-math"][..],
        &["-funsafe-math-optimizations"],
        &["-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"],
        &["-freciprocal-math"],
        &["-fno-signed-zeros"],
        &["-ffinite-math-only"],
    ] {
        for compiler in ["cc", "arm-none-eabi-gcc"] {
            let said = refusal(compiler, &[options, &["-x", "c"]].concat(), &file);
            assert!(said.contains("compile without -ffast-math and its parts"), "{said}");
        }
    }
}

#[test]
fn the_exported_c_forbids_clang_to_reorder_which_defines_no_macro_when_it_may() {
    let folder = folder("clang");
    let file = exported(&folder, "it.h", INSTANCES[5].1, &["--standalone"]);
    let (off, old) = ("#pragma clang fp contract(off) reassociate(off)", "#pragma STDC FP_CONTRACT OFF");
    for (major, pragma) in [(18, format!("{off} reciprocal(off)")), (14, off.into()), (13, old.into())] {
        let version = format!("-D__clang_major__={major}");
        let output = Command::new("cc").args(["-E", "-D__clang__", &version, plain(&file)]).output().expect("cc");
        let text = String::from_utf8(output.stdout).expect("text");
        let functions: Vec<&str> = text.split("static inline ").skip(1).collect();
        assert!(functions.len() > 6, "{text}");
        for function in functions.iter().filter(|function| !function.contains("_tick_or_start(")) {
            assert!(function.lines().any(|line| line.trim() == pragma), "clang {major}: {function}");
        }
    }
}

#[test]
fn the_exported_c_switches_contraction_off_by_itself() {
    let (name, scenario, _) = INSTANCES[5];
    let folder = folder("contraction");
    let exported = exported(&folder, &format!("{name}.h"), scenario, &["--standalone"]);
    let (source, assembly) = (folder.join("user.c"), folder.join("user.s"));
    let user = "unsigned tick(edo_smc_state *state, const float *x, edo_smc_output *output);
unsigned tick(edo_smc_state *state, const float *x, edo_smc_output *output) { return edo_smc_tick(state, x, output); }
float elsewhere(float a, float b, float c);
float elsewhere(float a, float b, float c) { return a * b + c; }
";
    fs::write(&source, format!("#include \"{}\"\n{user}", plain(&exported))).expect("the program");
    let options = [&["-std=gnu99", "-O2", "-S"], &CORTEX_M4F[..4]].concat();
    compile("arm-none-eabi-gcc", &options, &source, &assembly);
    let text = fs::read_to_string(&assembly).expect("assembly");
    let (before, elsewhere) = text.split_once("\nelsewhere:").expect("the last function");
    assert!(elsewhere.contains("vfma"), "nothing would have been fused: {elsewhere}");
    assert!(before.contains("vmul.f32") && !before.contains("vfm") && !before.contains("vml"), "{before}");
}

/// Returns the output of a program whose package has the exported file as its library.
pub(super) fn said_by_exported_rust(package: &Path, name: &str, scenario: &str, program: &str) -> String {
    let library = exported(package, &format!("{name}.rs"), scenario, &["--lang", "rust"]);
    let root = path("..").canonicalize().expect("the workspace");
    let manifest = format!(
        "[package]\nname = \"exported\"\nedition = \"2024\"\n[lib]\npath = {:?}\n\
         [[bin]]\nname = \"said\"\npath = \"said.rs\"\n[workspace]\n[dependencies]\n\
         controller-core = {{ path = {:?} }}\n",
        plain(&library),
        plain(&root.join("controller-core")),
    );
    fs::write(package.join("Cargo.toml"), manifest).expect("the manifest");
    fs::copy(root.join("Cargo.lock"), package.join("Cargo.lock")).expect("the lock file");
    fs::write(package.join("said.rs"), program).expect("the program");
    let output = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["run", "--quiet", "--offline", "--color=never"])
        .current_dir(package)
        .env("CARGO_TARGET_DIR", package.join("target"))
        .env("RUSTFLAGS", "-D warnings")
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Returns the bits of the coefficients in an exported Rust file.
fn bits_of_exported_rust(name: &str, scenario: &str) -> Vec<u32> {
    let program = "use exported::*;
fn main() {
    assert_eq!(EXPORTED_FOR, controller_core::VERSION);
    let mut running = RUNNING;
    let output = running.tick(&[0.5; CONFIG.observers.len()]);
    CONFIG.options.initial_estimates.iter().for_each(|value| println!(\"{}\", (*value as f32).to_bits()));
    CONTROLLER@.coefficients().numbers().for_each(|value| println!(\"{}\", value.to_bits()));
    println!(\"{}\", output.u.to_bits());
}
";
    let program = program.replace('@', if scenario.contains("samples") { ".law()" } else { "" });
    let said = said_by_exported_rust(&folder("rust"), name, scenario, &program);
    said.lines().map(|line| line.parse().expect("bits")).collect()
}

#[test]
fn the_exported_rust_has_the_coefficients_that_the_host_designed() {
    let benchmark = "plant = { kind = 'benchmark' }
                     controller = { c = [5, 1], exp = 'micromath', observer = [{ channel = 1, printed = [20, 100] }] }";
    let of = |wanted| INSTANCES.iter().find(|(name, ..)| *name == wanted).map_or("", |(_, scenario, _)| scenario);
    for (name, scenario) in [
        ("joint", of("n4r2_24_mixed")),
        ("gated", of("n4r2_24_gated")),
        ("unobserved", of("n2r1_none")),
        ("benchmark", benchmark),
        ("six", of("n6r3_3456")),
    ] {
        let exported = bits_of_exported_rust(name, scenario);
        let download = download(scenario);
        let n = usize::from(download.shape.n);
        // The row of the linear model lies between the estimates and the coefficients.
        let designed: Vec<u32> =
            download.numbers[..n].iter().chain(&download.numbers[2 * n..]).map(|value| value.to_bits()).collect();
        assert_eq!(exported[..designed.len()], designed, "{name}");
        // The model is in units of u.
        let source = Source { file: "it", text: scenario, sets: &[] };
        let mut port = scenario::parse(&source, "it").expect("a good scenario").port;
        let u = port.tick(&vec![0.5; n]).expect("a tick in process").u as f32;
        assert_eq!(exported[designed.len()..], [u.to_bits()], "{name}");
    }
}
