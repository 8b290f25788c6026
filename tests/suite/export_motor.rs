//! Drive of a motor or joint in C by the commands of docs/c.md, "Exported C99 file". The motor has the numbers of the
//! template: a rotor of 2e-4 kg m², 0.05 N m/A, 10 A, 14 bits, 1 kHz. Thresholds apply to the true angle of the
//! simulated shaft, with friction and cogging.

use integration_tests::data::path;
use integration_tests::deep;
use integration_tests::program::{Folder, host_sim};
use std::f64::consts::TAU;
use std::fs;
use std::process::{Command, Output, Stdio};

/// Threshold: largest error of the sine from 0.5 s on, rad.
const BAR_RAD: f64 = 3.2e-3;

/// Runs a goal of the Makefile on an exported file, with more variables.
fn make(folder: &Folder, drive: &str, goal: &str, variables: &[&str]) -> Output {
    Command::new("make")
        .args(["--no-print-directory", "-s", "-B", "-C"])
        .arg(path("../examples/c"))
        .args([goal, &format!("DRIVE={drive}"), &format!("MOTOR={}", folder.path("motor.elf"))])
        .arg(format!("BOARD={}", folder.path("board.elf")))
        .args(variables)
        .stdin(Stdio::null())
        .output()
        .expect("make runs")
}

/// Runs `make run-motor` on an exported file; returns its output.
fn driven(folder: &Folder, drive: &str) -> Vec<String> {
    let made = make(folder, drive, "run-motor", &[]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let said: Vec<String> = String::from_utf8_lossy(&made.stdout).lines().map(str::to_string).collect();
    assert_eq!(said.last().map(String::as_str), Some("done"), "{said:?}");
    said
}

/// Returns the peak error that follows these words in the output.
fn peak(said: &[String], words: &str) -> f64 {
    let line = said.iter().find_map(|line| line.strip_prefix(words)).expect("its line");
    line.trim().strip_suffix(" rad").expect("its unit").trim().parse().expect("a number")
}

const OF_SINE: &str = "sine of 1 rad at 1.000 Hz, from 0.50 s on: peak error";
const NO_ALARM: &str = "status flags of all ticks: 00000000, no alarm";
const OF_RESTART: &str = "stopped and restarted, then to rest at 0.25 rad: peak error";
const OF_MOVE: &str = "from there to rest at 0.5 rad in 0.30 s: peak error";

#[test]
fn the_commands_of_the_docs_drive_a_motor_along_a_sine_within_the_bar() {
    let page = fs::read_to_string(path("../docs/c.md")).expect("the page");
    let section = page.split_once("## Exported C99 file").expect("the section").1;
    let commands = section.split_once("\n\n    ").expect("the commands").1.split_once("\n\n").expect("their end").0;
    let commands: Vec<&str> = commands.lines().map(|line| line.split('#').next().unwrap_or("").trim()).collect();
    let [new, run, export, make] = commands[..] else { panic!("four commands, not {commands:?}") };
    assert_eq!(run, "cargo run --release -- run mine.toml");
    let folder = Folder::new("export-motor");
    let (scenario, drive) = (folder.path("mine.toml"), folder.path("motor_drive.h"));
    // The command of the documentation, run in this process with another folder.
    assert_eq!(new, "cargo run --release -- new mine --plant motor");
    fs::write(&scenario, scenario::template("mine", "motor").expect("a motor")).expect("a file");
    let words = export.strip_prefix("cargo run --release -- ").expect("a command of ours").split_whitespace();
    let words: Vec<&str> = words
        .map(|word| match word {
            "mine.toml" => &*scenario,
            "examples/c/motor_drive.h" => &*drive,
            _ => word,
        })
        .collect();
    let spoken = host_sim(&words);
    assert!(spoken.status == 0 && words.contains(&&*drive), "{export}: {}", spoken.err);
    assert_eq!(make, "make -C examples/c run-motor");

    let said = driven(&folder, &drive);
    println!("{}", said.join("\n"));
    let (sine, to_rest) = (peak(&said, OF_SINE), peak(&said, OF_MOVE));
    // Friction is on, so the error is never zero.
    assert!((5e-4..BAR_RAD).contains(&sine), "{sine} rad");
    assert!((1e-4..BAR_RAD).contains(&to_rest), "{to_rest} rad");
    assert!(said.contains(&NO_ALARM.to_string()), "{said:?}");
    // The planned column of the table is the sine, and the true angle differs from it.
    let rows: Vec<Vec<f64>> =
        said.iter().filter_map(|line| line.split_whitespace().map(|word| word.parse().ok()).collect()).collect();
    let on_the_sine: Vec<&Vec<f64>> = rows.iter().filter(|row| (0.45..2.25).contains(&row[0])).collect();
    assert_eq!(on_the_sine.len(), 18, "{rows:?}");
    for row in on_the_sine {
        assert!((row[1] - (TAU * row[0]).sin()).abs() < 5e-6, "{row:?}");
        assert!((row[2] - row[1] - row[3]).abs() < 2.1e-6 && row[3].abs() <= sine + 1e-6, "{row:?}");
    }
    let held = rows.iter().rfind(|row| row[0] < 2.75).expect("a row at rest");
    assert!(held[1] == 0.5 && held[3].abs() < 2e-3, "{held:?}");
    // The drive stopped, started again where it was, and moved on.
    let restarted = peak(&said, OF_RESTART);
    assert!((1e-4..BAR_RAD).contains(&restarted), "{restarted} rad");
    assert!(rows.iter().any(|row| row[0] > 3.3 && row[4] == 0.0), "no current while stopped: {rows:?}");

    // As assembly, which the same command links, the output is identical to the last digit.
    if deep() {
        let assembly = folder.path("motor_assembly.S");
        let spoken = host_sim(&["export", &scenario, "--asm", "-o", &assembly]);
        assert_eq!(spoken.status, 0, "{}", spoken.err);
        assert_eq!(driven(&folder, &folder.path("motor_assembly.h")), said);
    }

    // The threshold is sensitive: a rotor of four times the inertia misses it, and so does a plan without its speed.
    // The feed-forward alone is worth a twentieth on so slow a sine, because the observer compensates.
    let text = fs::read_to_string(&drive).expect("the exported file");
    for (what, from, to) in [
        ("four times the inertia", "_INERTIA_KG_M2 0.0002", "_INERTIA_KG_M2 0.0008"),
        ("no speed in the target", "target->r_dot = jet.r_dot", "target->r_dot = 0.0f"),
    ] {
        assert!(text.contains(from), "{what}");
        let drive = folder.path("broken.h");
        fs::write(&drive, text.replace(from, to)).expect("a file");
        let sine = peak(&driven(&folder, &drive), OF_SINE);
        println!("{what}: {sine} rad");
        assert!(sine > BAR_RAD, "{what}: {sine} rad");
    }
}

/// Writes the exported file of the template motor with these keys.
fn exported(folder: &Folder, sets: &[&str]) -> String {
    exported_from(folder, "motor", sets)
}

fn exported_from(folder: &Folder, template: &str, sets: &[&str]) -> String {
    let (scenario, drive) = (folder.path("mine.toml"), folder.path("motor_drive.h"));
    fs::write(&scenario, scenario::template("mine", template).expect("a template")).expect("a file");
    let mut words = vec!["export", &scenario, "--lang", "c", "--standalone", "-o", &drive, "--force"];
    words.extend(sets.iter().flat_map(|set| ["--set", set]));
    let spoken = host_sim(&words);
    assert_eq!(spoken.status, 0, "{}", spoken.err);
    drive
}

/// A shorter period makes a stiffer drive. A small motor with little torque has proportionally small friction.
#[test]
fn the_example_runs_at_every_rate_and_delay_and_with_a_motor_of_a_hundredth_of_the_inertia() {
    let folder = Folder::new("export-motor-rates");
    let small = ["motor.inertia_kg_m2=2e-6", "motor.torque_n_m_per_a=0.005", "motor.max_current_a=2"];
    for (sets, bar) in [
        (&["drive.period_s=2.5e-4"][..], 1.5e-3),
        (&["drive.period_s=1e-4", "drive.delay_ticks=3"], 2.0e-3),
        (&small, BAR_RAD),
        (&["encoder.reversed=true", "encoder.offset_counts=1000"], BAR_RAD),
        (&["encoder.counts_per_turn=10000", "encoder.states=10000"], BAR_RAD),
    ] {
        let said = driven(&folder, &exported(&folder, sets));
        let (sine, to_rest) = (peak(&said, OF_SINE), peak(&said, OF_MOVE));
        println!("{sets:?}: {sine} rad, {to_rest} rad");
        assert!((1e-4..bar).contains(&sine) && (1e-4..bar).contains(&to_rest), "{sets:?}: {sine} {to_rest}");
        assert!(said.contains(&NO_ALARM.to_string()), "{said:?}");
    }
    // The delay may be longer than the lead of a plan.
    let said = driven(&folder, &exported(&folder, &["drive.period_s=5e-3", "drive.delay_ticks=2"]));
    assert!(peak(&said, OF_MOVE) < 0.3, "{said:?}");
}

/// The sine of a joint is slow enough for its torque. A harmonic drive has a gear, a weight and reversed counts.
#[test]
fn the_example_drives_a_soft_and_a_stiff_joint() {
    let folder = Folder::new("export-motor-joint");
    let harmonic = HARMONIC;
    for (sets, hz, begin, pause, bar) in [
        (&[][..], "0.332", "1.51", "0.90", 1e-4),
        (&["drive.period_s=2.5e-4", "drive.delay_ticks=1"], "0.332", "1.51", "0.90", 1e-4),
        (&harmonic, "0.506", "0.99", "0.59", 1.5e-4),
    ] {
        let drive = exported_from(&folder, "joint", sets);
        let said = driven(&folder, &drive);
        let sine = peak(&said, &format!("sine of 1 rad at {hz} Hz, from {begin} s on: peak error"));
        let to_rest = peak(&said, &format!("from there to rest at 0.5 rad in {pause} s: peak error"));
        let restarted = peak(&said, OF_RESTART);
        println!("{sets:?}: {sine} rad, {to_rest} rad, after a restart {restarted} rad");
        assert!(restarted < 5.0 * bar, "{sets:?}: {restarted} rad");
        // The encoder of the link has counts of 6e-6 or 1.2e-5 rad.
        assert!((3e-6..bar).contains(&sine) && (3e-6..bar).contains(&to_rest), "{sets:?}: {sine} {to_rest}");
        assert!(said.contains(&NO_ALARM.to_string()), "{said:?}");
    }
    // The threshold is sensitive: a spring of a third of the stiffness misses it, and an alarm ends the program.
    let drive = exported_from(&folder, "joint", &harmonic);
    let text = fs::read_to_string(&drive).expect("the exported file");
    assert!(text.contains("_STIFFNESS_N_M 8000.0"));
    fs::write(&drive, text.replace("_STIFFNESS_N_M 8000.0", "_STIFFNESS_N_M 2700.0")).expect("a file");
    let ran = make(&folder, &drive, "run-motor", &[]);
    let said: Vec<String> = String::from_utf8_lossy(&ran.stdout).lines().map(str::to_owned).collect();
    assert!(!ran.status.success() && said.iter().any(|line| line.starts_with("stopped: an alarm")), "{said:?}");
    let sine = peak(&said, "sine of 1 rad at 0.506 Hz, from 0.99 s on: peak error");
    println!("a third of the stiffness: {sine} rad");
    assert!(sine > 1.5e-4, "{sine} rad");
}

#[test]
fn an_interrupt_longer_than_its_period_and_a_missing_file_end_with_a_message() {
    let folder = Folder::new("export-motor-late");
    let drive = exported(&folder, &["drive.period_s=2.5e-4"]);
    let late = make(&folder, &drive, "run-motor", &["CORE_HZ=4000000u"]);
    let [out, err] = [&late.stdout, &late.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    assert!(!late.status.success() && out.contains("longer than the control period"), "{out}{err}");
    assert!(err.contains("run-motor: the program ended with status 1"), "{err}");

    let none = make(&folder, &folder.path("none.h"), "run-motor", &[]);
    let err = String::from_utf8_lossy(&none.stderr);
    assert!(!none.status.success() && err.contains("none.h: host-sim export YOUR_FILE.toml"), "{err}");
    // -B with an existing file does not claim that it is missing.
    let err = make(&folder, &drive, "board", &[]).stderr;
    assert!(err.is_empty(), "{}", String::from_utf8_lossy(&err));

    // At the 16 MHz after reset 10 kHz leave 1600 cycles: the compiler stops.
    let fast = make(&folder, &exported(&folder, &["drive.period_s=1e-4"]), "board", &[]);
    let err = String::from_utf8_lossy(&fast.stderr);
    assert!(!fast.status.success() && err.contains("too short for CORE_HZ"), "{err}");
    let drive = exported(&folder, &["drive.period_s=2.5e-4"]);
    assert!(make(&folder, &drive, "board", &[]).status.success());
}

/// Joint with a harmonic drive: stiff, with a gear and a weight.
const HARMONIC: [&str; 4] = [
    "joint={gear=[100, 1], motor_inertia_kg_m2=0.00012, torque_n_m_per_a=0.08, motor_damping_n_m_s=0.0002, \
     link_inertia_kg_m2=0.4, stiffness_n_m=8000.0, link_damping_n_m_s=0.5, weight_n_m=10.0, max_current_a=8.0}",
    "encoder.link={bits=19}",
    "encoder.motor={bits=14, reversed=true, offset_counts=77}",
    "drive.sudden_load_n_m=17.92",
];

/// Returns the bound of an interrupt in an image for a board, cycles.
fn bound(image: &str, symbol: &str) -> u32 {
    let spoken = host_sim(&["budget", "--elf", image, "--symbol", symbol, "--barrier", "3"]);
    assert_eq!(spoken.status, 0, "{}", spoken.err);
    let bound = spoken.out.lines().find_map(|line| line.strip_prefix("bound"));
    bound.and_then(|line| line.split_whitespace().next()?.parse().ok()).expect("a bound")
}

/// The image for a board has no simulated motor, so its interrupt has a bound. The page states it.
#[test]
fn the_interrupts_of_the_page_take_the_cycles_that_it_states() {
    let folder = Folder::new("export-motor-cycles");
    let page = fs::read_to_string(path("../docs/c.md")).expect("the page").replace("\n  ", " ");
    let motor = exported(&folder, &[]);
    let code = page
        .split_once("```c\n#include \"motor_drive.h\"")
        .expect("the interrupt")
        .1
        .split_once("```")
        .expect("its end")
        .0;
    let [source, functions] = ["interrupt.c", "functions.c"].map(|name| folder.path(name));
    fs::write(&source, format!("#include \"{motor}\"{code}")).expect("a file");
    let board = "#include <stdbool.h>\n#include <stdint.h>\nuint32_t encoder_register(void) { return 0u; }\n\
                 bool encoder_is_good(void) { return true; }\nfloat set_current(float ampere) { return ampere; }\n\
                 void control_interrupt(void);\nvoid _start(void) { control_interrupt(); }\n";
    fs::write(&functions, board).expect("a file");
    let image = folder.path("interrupt.elf");
    let core = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"];
    let options = ["-std=c99", "-O2", "-ffp-contract=off", "-ffunction-sections", "-Wl,--gc-sections", "-nostartfiles"];
    let built = Command::new("arm-none-eabi-gcc")
        .args(core)
        .args(options)
        .args(["--specs=nosys.specs", &source, &functions, "-o", &image, "-lm"])
        .output()
        .expect("the compiler runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let short = bound(&image, "control_interrupt");
    let board = |drive: &str| {
        let made = make(&folder, drive, "board", &["CORE_HZ=168000000u", "TIMER_HZ=84000000u"]);
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        bound(&folder.path("board.elf"), "TIM3_IRQHandler")
    };
    let [own, soft, stiff] = [
        board(&motor),
        board(&exported_from(&folder, "joint", &[])),
        board(&exported_from(&folder, "joint", &HARMONIC)),
    ];
    for words in [
        format!("The interrupt above takes at most {short} cycles"),
        format!(
            "The interrupt of `motor.c` takes {own} cycles, with the template joint {soft}, with a stiff joint \
             (`coupled`) {stiff}."
        ),
    ] {
        assert!(page.contains(&words), "{words}");
    }
}
