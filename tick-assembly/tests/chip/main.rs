//! Compares the assembly with the trace, bit by bit, on an emulated STM32F405.
//!
//! The reference is the C of the trace, compiled by GCC without contraction. Both run in one program, which generates
//! its samples: near rest and far from it, NaN, infinities, denormals, -0, any bits, several in a row. It also
//! restarts, and reports controls that the actuator replaced. The test compares every bit of u, σ, σ*, status,
//! estimates and state after every tick, and of the tick that returns u.

mod drive;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use controller_core::{
    Config, Controller, Limits, Linear, Nominal, ObserverGains, Options, ReachingLaw, Shape, Surface, channels,
};
use tick_assembly::{Assembly, Effort, assembly};
use tick_record::{Drift, Functions, Port, Record, Role, ValueKind, c};

/// Returns true at full size (`DEEP=1`).
fn deep() -> bool {
    std::env::var_os("DEEP").is_some_and(|value| value == "1")
}

/// Returns the number of ticks at full size or in the fast tier.
fn sized(ticks: usize) -> usize {
    if deep() { ticks } else { ticks / 20 }
}

/// Returns all elements at full size, every `n`th in the fast tier.
fn sampled<T>(all: impl IntoIterator<Item = T>, n: usize) -> impl Iterator<Item = T> {
    all.into_iter().step_by(if deep() { 1 } else { n })
}

/// Returns the effort for firmware, to which the cycle numbers apply; in the fast tier a short one.
fn effort() -> Effort {
    if deep() { Effort::FULL } else { QUICK }
}

/// Effort that finds a feasible order; the cycle numbers need more.
const QUICK: Effort = Effort { rounds: 1, steps: 80_000, seed: 1 };

const REACHING: ReachingLaw = ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 };

fn options<const N: usize>() -> Options<N> {
    Options::NEUTRAL.with_limits(Limits { min: -300.0, max: 200.0 }).with_sigma_star_bound(5.0)
}

/// The functions of a chain of order N with observers of order R in these channels.
macro_rules! functions {
    ($n:literal, $r:literal, $channels:tt, $drift:expr) => {{
        const MASK: u8 = channels($n, $r, $channels);
        type Law = Controller<f32, Linear<f32, $n>, $n, $r, MASK, { MASK.count_ones() as usize }>;
        let mut observers = [None; $n];
        for i in (1..=$n).filter(|i| MASK >> (i - 1) & 1 == 1) {
            observers[i - 1] = Some(ObserverGains::from_bandwidth::<$r>(50.0 + 5.0 * i as f64));
        }
        let mut gradient = [0.0; $n];
        gradient[0] = 19.0;
        if let Some(entry) = gradient.get_mut(2) {
            *entry = -45.0;
        }
        gradient[$n - 1] = -1.5;
        let config = Config::<$n, $r> {
            period_s: 1e-3,
            surface: Surface::from_bandwidth(4.0, 1.0),
            observers,
            reaching: REACHING,
            nominal: Nominal { gradient, input_gain: 25.0 },
            options: options(),
        };
        let law = Law::try_linear(&config).expect("a good design");
        let numbers: Vec<f64> = law.coefficients().numbers().map(f64::from).collect();
        let row: Vec<f64> = law.model().row().iter().copied().map(f64::from).collect();
        let shape = Shape { n: $n, r: $r, mask: MASK };
        let guess = [0.0, 0.5, 0.0, -3.0, 0.0, 1.0];
        tick_record::chain(shape, &numbers, $drift, &row, &guess, None).expect("a shape that is recorded")
    }};
}

/// Returns the C of a trace: state, output and functions, with the prefix `c_`.
fn reference(functions: &Functions, n: usize, r: usize) -> String {
    let mut text = String::from("typedef struct {\n");
    for word in &functions.state {
        let _ = writeln!(text, "    {} {};", if word.kind == ValueKind::Number { "float" } else { "bool" }, word.name);
    }
    let arguments = arguments(functions);
    text += "} c_state;\n";
    let mut function = |head: &str, record: &Record| {
        let place = |port: &Port| match port.role {
            Role::Sample(j) => format!("x[{j}]"),
            Role::State => format!("state->{}", port.name),
            Role::Output => format!("output->{}", port.name),
            Role::Estimate(i, m) => format!("d_hat[{i}][{m}]"),
            Role::Flag(bit) => format!("{}u", 1 << bit),
            // The prefix keeps argument names apart from the names of constants.
            Role::Argument if port.name != "u" => format!("given_{}", port.name),
            _ => port.name.clone(),
        };
        let body = c::Function { record, place: &place, meaning: &|_| String::new(), double: false, signed: "" }.body();
        let _ = writeln!(text, "static {head}\n{{\n{body}}}");
    };
    function(&format!("unsigned c_tick(c_state *state, const float *x, output *output{arguments})"), &functions.tick);
    function("bool c_start(c_state *state, const float *x)", &functions.start);
    function("unsigned c_not_started(output *output)", &functions.not_started);
    function("bool c_report_applied(c_state *state, float u)", &functions.report_applied);
    function(&format!("bool c_estimates(const c_state *state, float d_hat[{n}][{r}])"), &functions.estimates);
    function("void c_reset(c_state *state)", &functions.reset);
    text
}

/// Returns the arguments of a tick besides a sample: `, float given_drift, ..`.
fn arguments(functions: &Functions) -> String {
    let given = functions.tick.inputs.iter().filter(|port| port.role == Role::Argument);
    given.fold(String::new(), |text, port| text + ", float given_" + &port.name)
}

/// Returns the program: reset, FPU on, ticks, and the results through the emulator.
fn program(functions: &Functions, assembly: &Assembly, n: usize, r: usize, ticks: usize) -> String {
    let (mut words, mut same) = (String::new(), String::new());
    for word in &assembly.layout.words {
        let _ = writeln!(words, "    float {word};");
        let _ = write!(same, " && same(s.{word}, c.{word}) && same(t.{word}, c.{word})");
    }
    let arguments = arguments(functions);
    let given = arguments.replace(" float", "");
    PROGRAM
        .replace("@help", HELP)
        .replace("@ending", ENDING)
        .replace("@reference", &reference(functions, n, r))
        .replace("@words", &words)
        .replace("@same", &same)
        .replace("@arguments", &arguments)
        .replace("@given", &given)
        .replace("@ticks", &ticks.to_string())
        .replace("@n", &n.to_string())
        .replace("@r", &r.to_string())
}

const PROGRAM: &str = r#"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
typedef struct { float u, sigma, sigma_star; } output;
@reference
typedef struct {
@words    bool resuming, started;
} s_state;
extern unsigned s_tick(s_state *state, const float *x, output *output@arguments);
extern float s_tick_u(s_state *state, const float *x@arguments);
extern bool s_start(s_state *state, const float *x);
extern unsigned s_not_started(output *output);
extern bool s_report_applied(s_state *state, float u);
extern bool s_estimates(const s_state *state, float d_hat[@n][@r]);
extern void s_reset(s_state *state);
@helpstatic c_state c;
static s_state s, t;
__attribute__((noinline)) static int run(void)
{
    uint32_t seen[8] = { 0 }, bad = 0, again = 0;
    float size = 0.1f;
    for (uint32_t k = 0; k < @ticks; k++) {
        float x[@n], d[2][@n][@r];
        output of[2] = { { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f } };
        unsigned health[2];
        float u = 0.0f;
        if (any() % 100u == 0u) {
            static const float sizes[] = { 1e-6f, 1e-4f, 1e-2f, 0.1f, 1.0f, 10.0f };
            size = sizes[any() % 6u];
        }
        if (any() % 100u == 0u) {
            bad = 1u + any() % 5u;
        }
        for (int j = 0; j < @n; j++) {
            x[j] = within(size);
        }
        if (bad > 0u) {
            bad--;
            if (any() % 5u == 0u) {
                const float all = odd();
                for (int j = 0; j < @n; j++) {
                    x[j] = all;
                }
            } else {
                x[any() % @nu] = odd();
            }
        }
        const float given_drift = any() % 200u == 0u ? odd() : within(3.0f);
        const float given_gain = any() % 200u == 0u ? odd() : 1.0f + within(0.5f);
        (void)given_drift;
        (void)given_gain;
        if (any() % 10u == 0u) {
            const float held = any() % 10u == 0u ? odd() : within(300.0f);
            const bool taken = c_report_applied(&c, held);
            if (s_report_applied(&s, held) != taken || s_report_applied(&t, held) != taken) {
                number("report_applied differs at", k);
                return 1;
            }
        }
        if (any() % 1000u == 0u) {
            c_reset(&c);
            s_reset(&s);
            s_reset(&t);
        }
        const bool starts = any() % 500u == 0u || !c.started;
        if (starts) {
            const bool started = c_start(&c, x);
            if (s_start(&s, x) != started || s_start(&t, x) != started) {
                number("start differs at", k);
                return 1;
            }
        }
        again += c.resuming && c.started ? 1u : 0u;
        if (c.started) {
            health[0] = c_tick(&c, x, &of[0]@given);
            health[1] = s_tick(&s, x, &of[1]@given);
            u = s_tick_u(&t, x@given);
        } else {
            health[0] = c_not_started(&of[0]);
            health[1] = s_not_started(&of[1]);
            u = of[1].u;
        }
        seen[health[0] & 7u]++;
        bool right = health[0] == health[1] && same(of[0].u, of[1].u) && same(of[0].u, u)
            && same(of[0].sigma, of[1].sigma) && same(of[0].sigma_star, of[1].sigma_star)@same
            && s.resuming == c.resuming && t.resuming == c.resuming && s.started == c.started && t.started == c.started;
        if (c_estimates(&c, d[0]) != s_estimates(&s, d[1])) {
            right = false;
        }
        for (int i = 0; i < @n; i++) {
            for (int m = 0; m < @r; m++) {
                right = right && same(d[0][i][m], d[1][i][m]);
            }
        }
        if (!right) {
            number("differs at", k);
            return 1;
        }
    }
    number("healthy", seen[0] + seen[4]);
    number("rejected", seen[1]);
    number("saturated", seen[2] + seen[6]);
    number("over_bound", seen[4] + seen[6]);
    number("resumed", again);
    return 0;
}
@ending"#;

/// Random numbers, and output through the emulator.
const HELP: &str = r#"void *memset(void *to, int value, size_t bytes);
void *memset(void *to, int value, size_t bytes)
{
    for (size_t k = 0; k < bytes; k++) {
        ((volatile char *)to)[k] = (char)value;
    }
    return to;
}
static bool same(float a, float b)
{
    union { float f; uint32_t u; } x, y;
    x.f = a;
    y.f = b;
    return x.u == y.u;
}
static uint32_t luck = 2463534242u;
static uint32_t any(void)
{
    luck ^= luck << 13;
    luck ^= luck >> 17;
    luck ^= luck << 5;
    return luck;
}
static float within(float size) { return size * ((float)(any() >> 8) * (1.0f / 8388608.0f) - 1.0f); }
static float odd(void)
{
    static const uint32_t edges[] = { 0x7fc00000, 0x7f800000, 0xff800000, 0, 0x80000000, 1, 0x80000001, 0x7f7fffff,
        0xff7fffff, 0x5368d4a5, 0xd368d4a6, 0x71c9f2ca, 0x60ad78ec, 0x4e6e6b28, 0xc7c35000, 0x3f800000 };
    union { uint32_t u; float f; } x;
    x.u = any() % 2u != 0u ? any() : edges[any() % 16u];
    return x.f;
}
static uintptr_t ask_emulator(uintptr_t what, const void *with)
{
    register uintptr_t r0 __asm__("r0") = what;
    register const void *r1 __asm__("r1") = with;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}
static void say(const char *text) { (void)ask_emulator(4, text); }
static void number(const char *what, uint32_t value)
{
    char text[12];
    int at = 11;
    text[at] = 0;
    do {
        text[--at] = (char)('0' + value % 10u);
        value /= 10u;
    } while (value != 0u);
    say(what);
    say(" ");
    say(text + at);
    say("\n");
}
"#;

/// Code from reset to the end of the run.
const ENDING: &str = r#"void reset(void);
void reset(void)
{
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm__ volatile("dsb\n isb");
    luck = 2463534242u;
    const uintptr_t end[] = { 0x20026u, (uintptr_t)run() };
    (void)ask_emulator(0x20, end);
}
extern uint32_t stack_top;
__attribute__((section(".vectors"), used)) static const struct { uint32_t *stack; void (*handler)(void); } vectors
    = { &stack_top, reset };
"#;

const LAYOUT: &str = "ENTRY(reset)
SECTIONS {
    .text 0x08000000 : { KEEP(*(.vectors)) *(.text*) *(.rodata*) }
    .bss 0x20000000 (NOLOAD) : { *(.bss*) *(COMMON) *(.data*) }
    /DISCARD/ : { *(.ARM.*) }
}
stack_top = 0x20020000;
";

/// Runs a program and returns its end and its lines.
fn said(name: &str, assembly: &str, program: &str) -> (bool, String) {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).expect("a folder");
    for (file, text) in [("tick.S", assembly), ("main.c", program), ("layout.ld", LAYOUT)] {
        fs::write(folder.join(file), text).expect("a file");
    }
    let options = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-ffp-contract=off"];
    let link = ["-std=c99", "-O1", "-ffreestanding", "-nostdlib", "-T", "layout.ld", "-o", "program"];
    run(&folder, "arm-none-eabi-gcc", &[&options[..], &link, &["main.c", "tick.S"]].concat());
    let emulator = ["-M", "netduinoplus2", "-display", "none", "-monitor", "none", "-serial", "null"];
    let rest = ["-semihosting-config", "enable=on,target=native,chardev=out", "-chardev", "stdio,id=out", "-kernel"];
    let output = Command::new("qemu-system-arm").args(emulator).args(rest).arg("program").current_dir(&folder).output();
    let output = output.unwrap_or_else(|error| panic!("no qemu-system-arm: {error}"));
    let told = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.success(), told)
}

fn run(folder: &Path, program: &str, options: &[&str]) {
    let output = Command::new(program).args(options).current_dir(folder).output();
    let output = output.unwrap_or_else(|error| panic!("no `{program}` ({error})"));
    assert!(output.status.success(), "{}: {}", folder.display(), String::from_utf8_lossy(&output.stderr));
}

/// Checks that no bit differs, and that the run contains every kind of tick.
fn holds(name: &str, functions: &Functions, (n, r): (usize, usize), effort: &Effort, ticks: usize) -> Assembly {
    let assembly = assembly(functions, n, r, "s", effort).unwrap_or_else(|error| panic!("{name}: {error}"));
    let ticks = sized(ticks);
    let (good, told) = said(name, &assembly.text, &program(functions, &assembly, n, r, ticks));
    println!("{name}: {} cycles, with the whole output {}; {told}", assembly.cycles, assembly.cycles_whole);
    assert!(good, "{name}: {told}");
    for what in ["healthy", "rejected", "saturated", "over_bound", "resumed"] {
        let count = told.lines().find_map(|line| line.strip_prefix(what)?.trim().parse::<usize>().ok());
        let observed = what != "resumed" || functions.state.len() > 5;
        assert!(count.is_some_and(|count| count > ticks / 500 || !observed), "{name} shows too little: {told}");
    }
    assembly
}

/// The effort for firmware within its cycle limits, with another gain in each channel, so that no coefficient is loaded
/// for two.
#[test]
fn the_joint_is_the_record_to_the_bit_within_its_cycles() {
    let [of_order_2, of_order_3] = if deep() { [152, 182] } else { [155, 187] };
    let joint = holds("joint_r2", &functions!(4, 2, [2, 4], Drift::Sparse), (4, 2), &effort(), 1_000_000);
    assert!((joint.floor..=of_order_2).contains(&joint.cycles), "{} of {}", joint.cycles, joint.floor);
    let joint = holds("joint_r3", &functions!(4, 3, [2, 4], Drift::Sparse), (4, 3), &effort(), 1_000_000);
    assert!((joint.floor..=of_order_3).contains(&joint.cycles), "{} of {}", joint.cycles, joint.floor);
    // By the table of docs/reference/cycles.md, written out by hand: 71 operations, clamps, sample, state, 33
    // coefficients in three groups and two in instructions, guard, return.
    assert_eq!(joint.floor, 71 + 16 + 5 + 13 + 13 + (33 + 3) + 2 + 6 + 3);
}

#[test]
fn chains_of_every_kind_are_the_record_to_the_bit() {
    let chains = [
        ("n2_r1_c2", functions!(2, 1, [2], Drift::Linear), 2, 1),
        ("n2_r2_c12", functions!(2, 2, [1, 2], Drift::Argument), 2, 2),
        ("n3_r2_c123", functions!(3, 2, [1, 2, 3], Drift::ArgumentWithGain), 3, 2),
        ("n3_r1_none", functions!(3, 1, [], Drift::Linear), 3, 1),
        // Without an observer in the last channel a word is in the location of its sample.
        ("n3_r1_c2", functions!(3, 1, [2], Drift::Linear), 3, 1),
        ("n4_r2_c4", functions!(4, 2, [4], Drift::Linear), 4, 2),
        ("n4_r2_c24_gain", functions!(4, 2, [2, 4], Drift::ArgumentWithGain), 4, 2),
        ("n6_r1_c6", functions!(6, 1, [6], Drift::Linear), 6, 1),
        ("n4_r3_c1234", functions!(4, 3, [1, 2, 3, 4], Drift::Linear), 4, 3),
    ];
    for (name, functions, n, r) in sampled(chains, 4) {
        holds(name, &functions, (n, r), &QUICK, 100_000);
    }
}

#[test]
fn an_order_that_was_tampered_with_is_noticed() {
    let functions = functions!(4, 2, [2, 4], Drift::Sparse);
    let assembly = assembly(&functions, 4, 2, "s", &QUICK).expect("scheduled");
    let program = program(&functions, &assembly, 4, 2, 10_000);
    let lines: Vec<&str> = assembly.text.lines().collect();
    let reads = |line: &str, register: &str| line.split([' ', ',']).skip(1).any(|word| word.trim() == register);
    // Exchanges two neighbours of which the second reads the result of the first.
    let written = |line: &str| line.trim().split([' ', ',']).nth(1).unwrap_or_default().to_owned();
    let arithmetic = |line: &str| ["vadd", "vsub", "vmul"].iter().any(|name| line.trim().starts_with(name));
    let at = (lines.iter().zip(&lines[1..]))
        .position(|(one, other)| arithmetic(one) && arithmetic(other) && reads(other.trim(), &written(one)))
        .or_else(|| lines.iter().position(|line| line.contains("vstmdb")).map(|at| at - 1))
        .expect("two to exchange");
    let mut tampered = lines.clone();
    tampered.swap(at, at + 1);
    let (good, told) = said("tampered", &(tampered.join("\n") + "\n"), &program);
    assert!(!good && told.contains("differs at"), "{}, {}: {told}", lines[at], lines[at + 1]);
}

#[test]
fn what_cannot_be_scheduled_is_refused_with_the_reason() {
    let functions = functions!(2, 1, [2], Drift::Linear);
    let refused =
        |functions: &Functions, effort: &Effort| assembly(functions, 2, 1, "s", effort).expect_err("a refusal");
    let told = refused(&functions, &Effort { steps: 0, ..QUICK });
    assert!(told.contains("s_tick_u: no order was found"), "{told}");
    // The tick of another function is rejected.
    let told = refused(&Functions { tick: functions.start.clone(), ..functions.clone() }, &QUICK);
    assert!(told.contains("a tick says whether it rejects"), "{told}");
}

#[test]
fn the_same_effort_gives_the_same_text() {
    let functions = functions!(4, 2, [2, 4], Drift::Sparse);
    let text = || assembly(&functions, 4, 2, "s", &QUICK).expect("scheduled");
    assert_eq!(text(), text());
    assert_ne!(text().text, assembly(&functions, 4, 2, "s", &Effort { seed: 2, ..QUICK }).expect("scheduled").text);
}
