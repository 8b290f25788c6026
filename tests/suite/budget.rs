//! `host-sim budget` as a user runs it: an ELF file on disk, the output, the exit status.
//!
//! The test writes the file byte by byte. It thereby checks the ELF reader against the specification and not against a
//! writer of the same library.

use std::path::{Path, PathBuf};

use integration_tests::data::path;
use integration_tests::golden;
use integration_tests::program::{CommandResult, Folder, host_sim};
use serde_json::Value as Json;

const BASE: u32 = 0x0800_0000;

/// first: push {r4, lr}; bl second; pop {r4, pc}, followed by an unused literal second (mangled): vldr s0, [r0];
/// vadd.f32 s0, s0, s0; vstr s0, [r0]; bx lr spins: 1: subs r0, #1; bne 1b; bx lr
const CODE: [u16; 18] = [
    0xb510, 0xf000, 0xf803, 0xbd10, 0xffff, 0xffff, // first and its data
    0xed90, 0x0a00, 0xee30, 0x0a00, 0xed80, 0x0a00, 0x4770, // second
    0x3801, 0xd1fd, 0x4770, // spins
    0x4770, 0x4770, // one function, and one with two names
];
const SECOND: &str = "_RNvCs1234_7example6second";

/// Name, value, size, type. Thumb functions have an odd value; mapping symbols have no type.
const SYMBOLS: [(&str, u32, u32, u8); 10] = [
    ("$t", BASE, 0, 0),
    ("first", BASE + 1, 12, 2),
    ("$d", BASE + 8, 0, 0),
    ("$t.1", BASE + 12, 0, 0),
    (SECOND, BASE + 13, 14, 2),
    ("spins", BASE + 27, 6, 2),
    ("alone", BASE + 33, 2, 2),
    ("merged_a", BASE + 35, 2, 2),
    ("merged_b", BASE + 35, 2, 2),
    ("STATE", 0x2000_0000, 48, 1),
];
/// Versions of the linker and the compiler.
const COMMENT: &[u8] = b"Linker: LLD 22.1.2\0rustc version 1.96.0 (ac68faa20 2026-05-25)\0";

/// Returns a linked ELF file (`e_type` 2; 1 is not linked) of `CODE` for a machine (40 is ARM).
fn elf(e_type: u16, machine: u16) -> Vec<u8> {
    let code: Vec<u8> = CODE.iter().flat_map(|half| half.to_le_bytes()).collect();
    let mut strings = vec![0];
    let mut symbols = vec![0; 16];
    for (name, value, size, kind) in SYMBOLS {
        symbols.extend((strings.len() as u32).to_le_bytes());
        symbols.extend(value.to_le_bytes());
        symbols.extend(size.to_le_bytes());
        // Global symbol of this type, in section 1.
        symbols.extend([0x10 | kind, 0, 1, 0]);
        strings.extend(name.bytes().chain([0]));
    }
    let names = b"\0.text\0.symtab\0.strtab\0.shstrtab\0.comment\0";
    let contents: [&[u8]; 5] = [&code, &symbols, &strings, names, COMMENT];
    let mut offsets = Vec::new();
    let mut body = Vec::new();
    for content in contents {
        body.resize(body.len().next_multiple_of(4), 0);
        offsets.push(52 + body.len() as u32);
        body.extend(content);
    }
    body.resize(body.len().next_multiple_of(4), 0);
    let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
    let half = |file: &mut Vec<u8>, value: u16| file.extend(value.to_le_bytes());
    let word = |file: &mut Vec<u8>, value: u32| file.extend(value.to_le_bytes());
    half(&mut file, e_type);
    half(&mut file, machine);
    // Version, entry, program headers (none), section headers, flags.
    let version_to_flags = [1, BASE + 1, 0, 52 + body.len() as u32, 0x0500_0000];
    for value in version_to_flags {
        word(&mut file, value);
    }
    // Sizes of the headers and their numbers, index of the section names.
    for value in [52, 32, 0, 40, 6, 4] {
        half(&mut file, value);
    }
    file.extend(&body);
    file.extend([0; 40]);
    let sizes = contents.map(|content| content.len() as u32);
    // Name, type, flags, address, offset, size, link, info, alignment, entry size.
    let sections = [
        [1, 1, 6, BASE, offsets[0], sizes[0], 0, 0, 4, 0],
        [7, 2, 0, 0, offsets[1], sizes[1], 3, 1, 4, 16],
        [15, 3, 0, 0, offsets[2], sizes[2], 0, 0, 1, 0],
        [23, 3, 0, 0, offsets[3], sizes[3], 0, 0, 1, 0],
        [33, 1, 0, 0, offsets[4], sizes[4], 0, 0, 1, 0],
    ];
    for value in sections.into_iter().flatten() {
        word(&mut file, value);
    }
    file
}

/// Temporary file of one test, removed when the test ends.
struct File(PathBuf);

impl File {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let path = std::env::temp_dir().join(format!("budget-{name}-{}", std::process::id()));
        std::fs::write(&path, bytes).expect("temporary file");
        Self(path)
    }
}

impl Drop for File {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Runs `budget`; returns exit status, stdout, stderr.
fn spoken(elf: &Path, args: &[&str]) -> (u8, String, String) {
    let elf = elf.display().to_string();
    let CommandResult { status, out, err } = host_sim(&[&["budget", "--elf", &elf], args].concat());
    (status, out, err)
}

#[test]
fn the_table_names_the_bound_and_what_it_rests_on() {
    let file = File::new("table", &elf(2, 40));
    let (status, out, err) = spoken(&file.0, &["--symbol", "first"]);
    assert_eq!((status, err.as_str()), (0, ""), "{out}");
    // push 3, bl 4, vldr 2, vadd 1, a stall, vstr 2, bx 4, pop 4 + 3.
    let bound = out.lines().find(|line| line.starts_with("bound")).expect("a bound");
    assert_eq!(bound.split_whitespace().take(3).collect::<Vec<_>>(), ["bound", "24", "7"]);
    assert!(out.contains("flash 26 B in 2 function(s), stack 8 B"), "{out}");
    for assumption in ["DDI 0439D", "zero wait states", "P = 3", "no interrupt"] {
        assert!(out.contains(assumption), "{assumption}: {out}");
    }
}

#[test]
fn json_is_one_object_with_the_same_figures() {
    let file = File::new("json", &elf(2, 40));
    let (status, out, _) = spoken(&file.0, &["--symbol", "example::second", "--json", "--no-call", "--no-panic"]);
    assert_eq!((status, out.lines().count()), (0, 1), "{out}");
    let json: Json = serde_json::from_str(&out).expect("JSON");
    assert_eq!(json["symbol"], "example::second");
    assert_eq!((&json["longest"]["cycles"], &json["longest"]["instructions"]), (&10.into(), &4.into()));
    assert_eq!(
        (&json["most_instructions"], &json["flash_bytes"], &json["stack_bytes"]),
        (&4.into(), &14.into(), &0.into())
    );
    assert!(json["assumptions"].as_array().is_some_and(|lines| lines.len() == 8), "{json}");
}

#[test]
fn a_failed_check_is_status_1_and_what_is_declined_is_status_2() {
    let file = File::new("status", &elf(2, 40));
    let of = |args: &[&str]| {
        let (status, _, err) = spoken(&file.0, args);
        (status, err)
    };
    assert_eq!(of(&["--symbol", "first", "--max-cycles", "24"]).0, 0);
    let (status, err) = of(&["--symbol", "first", "--max-cycles", "23", "--no-call"]);
    assert_eq!((status, err.lines().count()), (1, 2), "{err}");
    assert!(err.contains("bound of 24 cycles, more than 23") && err.contains("a call"), "{err}");
    let (status, err) = of(&["--symbol", "spins"]);
    assert_eq!(status, 2);
    assert!(err.contains("declined: 0x0800001a (spins+0x0) `subs r0, #1`: a loop begins here"), "{err}");
    assert_eq!(of(&["--symbol", "spins", "--loop", "spins=100", "--max-cycles", "600"]).0, 0);
    let (status, err) = of(&["--symbol", "first", "--core", "cortex-m7", "--max-cycles", "100"]);
    assert!(status == 2 && err.contains("no cycle table"), "{err}");
}

#[test]
fn merged_functions_answer_to_each_of_their_names() {
    let file = File::new("merged", &elf(2, 40));
    for name in ["merged_a", "merged_b"] {
        assert_eq!(spoken(&file.0, &["--symbol", name]).0, 0, "{name}");
    }
}

#[test]
fn a_trace_adds_the_typical_figure() {
    let file = File::new("traced", &elf(2, 40));
    let line = |offset: u32| format!("Trace 0: 0x7f [00800400/{:08x}/00000110/ff020201] f\n", BASE + offset);
    let log = File::new("log", [12, 16, 20, 24].map(line).concat().as_bytes());
    let log = log.0.display().to_string();
    let (status, out, err) = spoken(&file.0, &["--symbol", "second", "--trace", &log, "--json"]);
    assert_eq!(status, 0, "{err}");
    let json: Json = serde_json::from_str(&out).expect("JSON");
    // vldr 2, vadd 1, a stall, vstr 2, bx 1 + 2.
    assert_eq!((&json["typical"]["cycles"]["max"], &json["typical"]["calls"]), (&9.into(), &1.into()));
    assert_eq!(spoken(&file.0, &["--symbol", "second", "--trace", "/no/such/file"]).0, 2);
}

/// Writes a budget file for an image.
fn ceilings(name: &str, compiler: &str, ceiling: &str) -> (Folder, String) {
    let folder = Folder::new(&format!("ceilings-{name}"));
    let text = format!(
        "compiler = \"{compiler}\"\n[[instance]]\nname = \"the second\"\nimage = \"fw.elf\"\n\
         symbol = \"example::second\"\nstate = \"STATE\"\nceiling = {{ {ceiling} }}\nwhy = \"measured\"\n"
    );
    std::fs::write(folder.path("fw.elf"), elf(2, 40)).expect("temporary file");
    std::fs::write(folder.path("budgets.toml"), text).expect("temporary file");
    let file = folder.path("budgets.toml");
    (folder, file)
}

#[test]
fn ceilings_are_held_from_above_and_from_below_and_the_place_in_the_file_is_told() {
    let of = |name: &str, compiler: &str, ceiling: &str| {
        let (_folder, file) = ceilings(name, compiler, ceiling);
        let CommandResult { status, out, err } = host_sim(&["budget", "--ceilings", &file]);
        (status, out, err.replace(&file, "FILE"))
    };
    let (status, out, err) = of("tight", "rustc 1.96.0", "bound = 10, flash = 14, stack = 0, state = 48");
    assert_eq!((status, err.as_str()), (0, ""), "{out}");
    let bound = out.lines().find(|line| line.starts_with("the second")).expect("a row");
    assert_eq!(bound.split_whitespace().collect::<Vec<_>>(), ["the", "second", "bound", "10", "cycles", "10", "1.00"]);
    let (status, out, err) = of("above", "rustc 1.96.0", "bound = 9, state = 40");
    assert_eq!(status, 1, "{out}");
    assert_eq!(
        err,
        "failed: FILE:7:21: `instance[1].ceiling.bound`: the second has 10 cycles, above the ceiling\n\
         failed: FILE:7:32: `instance[1].ceiling.state`: the second has 48 B, above the ceiling\n"
    );
    let (status, _, err) = of("below", "rustc 1.96.0", "bound = 11");
    assert!(status == 1 && err.ends_with("more than 5 % below the ceiling of 11; write bound = 10\n"), "{err}");
    let (status, out, err) = of("other", "rustc 1.95.0", "bound = 9");
    assert!(status == 1 && out.contains("above by 1"), "{out}");
    let told = "failed: fw.elf was built by rustc 1.96.0 (ac68faa20 2026-05-25); the ceilings hold for rustc 1.95.0";
    assert!(err.starts_with(told), "{err}");
    let (status, out, err) = of("slip", "rustc 1.96.0", "bund = 10");
    assert_eq!((status, out.as_str()), (2, ""));
    assert_eq!(err, "error: FILE:7:13: unknown key `instance[1].ceiling.bund`; did you mean `bound`?\n");
}

#[test]
fn another_compilers_figures_are_recorded_and_hold_from_then_on() {
    let (_folder, file) = ceilings("record", "rustc 1.95.0", "bound = 3, state = 4");
    assert_eq!(host_sim(&["budget", "--ceilings", &file]).status, 1);
    assert_eq!(host_sim(&["budget", "--ceilings", &file, "--record"]).status, 0);
    let text = std::fs::read_to_string(&file).expect("the file");
    assert!(text.starts_with("compiler = \"rustc 1.96.0\"\n") && text.contains("{ bound = 10, state = 48 }"), "{text}");
    assert_eq!(host_sim(&["budget", "--ceilings", &file]).status, 0);
    let again = host_sim(&["budget", "--ceilings", &file, "--record"]);
    assert!(again.status == 2 && again.err.contains("for rustc 1.96.0 already"), "{}", again.err);
}

#[test]
fn ceilings_as_json_are_one_object_and_take_no_other_question() {
    let (folder, file) = ceilings("json", "rustc 1.96.0", "bound = 10");
    let CommandResult { status, out, err } = host_sim(&["budget", "--ceilings", &file, "--json"]);
    assert_eq!((status, err.as_str(), out.lines().count()), (0, "", 1));
    let json: Json = serde_json::from_str(&out).expect("JSON");
    let row = &json["rows"][0];
    assert_eq!((&row["figure"], &row["value"], &row["ceiling"]), (&"bound".into(), &10.into(), &10.into()));
    assert_eq!((&json["images"][0]["is_judged"], &json["reasons"]["the second"]), (&true.into(), &"measured".into()));
    for other in [&["--no-call"][..], &["--max-cycles", "10"], &["--elf", &folder.path("fw.elf"), "--symbol", "first"]]
    {
        let CommandResult { status, err, .. } = host_sim(&[&["budget", "--ceilings", &file], other].concat());
        assert!(status == 2 && err.contains("cannot be used with"), "{err}");
    }
    assert_eq!(host_sim(&["budget", "--ceilings", &folder.path("none.toml")]).status, 2);
    assert_eq!(host_sim(&["budget", "--json"]).status, 2);
}

/// The clamp of the switching term and the limits of u use one helper; the calling line distinguishes the two. The sum
/// over all lines equals the whole call.
#[test]
fn every_executed_cycle_belongs_to_one_line_of_source() {
    let image = path("../firmware/target/thumbv7em-none-eabihf/release/budget");
    assert!(image.exists(), "{} is missing: `cargo xtask firmware` builds it", image.display());
    let asked = ["--symbol", "budget::joint_r2_unguarded::tick", "--emulate", "--lines", "--json"];
    let (status, out, err) = spoken(&image, &asked);
    assert_eq!(status, 0, "{err}");
    let json: Json = serde_json::from_str(&out).expect("JSON");
    let lines = json["lines"].as_array().expect("lines");
    let sum = |key: &str| -> f64 { lines.iter().filter_map(|line| line[key].as_f64()).sum() };
    for key in ["cycles", "pipelined", "instructions"] {
        assert!((sum(key) - json["typical"][key]["mean"].as_f64().expect("a number")).abs() < 1e-9, "{key}: {out}");
    }
    let source = std::fs::read_to_string(path("../controller-core/src/controller.rs")).expect("the source");
    let selects = |text: &str| -> f64 {
        let at = source.lines().position(|line| line.contains(text)).expect(text) + 1;
        let of = lines.iter().filter(|line| {
            line["file"].as_str().is_some_and(|file| file.ends_with("real.rs"))
                && line["within"][1].as_u64() == Some(at as u64)
        });
        of.filter_map(|line| line["instructions"].as_f64()).sum()
    };
    // Compare, fetch the flags and move, twice.
    assert!(selects("limited(-k.lim, k.lim)") >= 6.0, "{out}");
    assert!(selects("demand.limited(k.u_min, k.u_max)") >= 6.0, "{out}");
}

/// Two independent measurements agree: the emulator's log of the image, and the stopwatch in the image. The stopwatch
/// overhead is equal for two instances of one type, so it cancels.
#[test]
fn the_emulator_executes_what_the_stopwatch_in_the_image_counts() {
    let image = path("../firmware/target/thumbv7em-none-eabihf/release/budget");
    assert!(image.exists(), "{} is missing: `cargo xtask firmware` builds it", image.display());
    let log = host_sim(&["emulate", "--image", &image.display().to_string(), "--seconds", "60"]);
    let stopwatch = |name: &str| -> i64 {
        let line = log.out.lines().find_map(|line| line.strip_prefix(&format!("{name}: min ")));
        let count = line.and_then(|line| line.split(',').next()).and_then(|count| count.parse().ok());
        count.unwrap_or_else(|| panic!("{name}: {}", log.out))
    };
    let executed = |name: &str| -> i64 {
        let (status, out, err) = spoken(&image, &["--symbol", &format!("budget::{name}::tick"), "--emulate", "--json"]);
        assert_eq!(status, 0, "{err}");
        let json: Json = serde_json::from_str(&out).expect("JSON");
        let typical = &json["typical"];
        assert_eq!(typical["calls"], 200, "{typical}");
        assert_eq!(typical["instructions"]["min"], typical["instructions"]["max"], "a good tick takes one time");
        typical["instructions"]["max"].as_i64().expect("a number")
    };
    for (guarded, unguarded) in [("joint_r2", "joint_r2_unguarded"), ("joint_r3", "joint_r3_unguarded")] {
        assert_eq!(stopwatch(guarded) - stopwatch(unguarded), executed(guarded) - executed(unguarded), "{guarded}");
    }
}

#[test]
fn bad_input_is_one_line_and_status_2() {
    let linked = File::new("linked", &elf(2, 40));
    let (status, out, err) = spoken(&linked.0, &["--symbol", "frist"]);
    assert_eq!((status, out.as_str(), err.lines().count()), (2, "", 1), "{err}");
    assert!(err.contains("nearest: first"), "{err}");
    for (name, bytes, reason) in [
        ("object", elf(1, 40), "not linked"),
        ("machine", elf(2, 62), "not for ARM"),
        ("text", b"hello".to_vec(), "not an ELF file"),
        ("cut", elf(2, 40)[..60].to_vec(), "ELF"),
    ] {
        let file = File::new(name, &bytes);
        let (status, out, err) = spoken(&file.0, &["--symbol", "first"]);
        assert_eq!((status, out.as_str(), err.lines().count()), (2, "", 1), "{name}: {err}");
        assert!(err.contains(reason), "{name}: {err}");
    }
    assert_eq!(spoken(Path::new("/no/such/file"), &["--symbol", "first"]).0, 2);
}

#[test]
fn no_file_cut_or_spoiled_makes_it_panic() {
    let whole = elf(2, 40);
    for at in 0..whole.len() {
        for spoiled in [whole[..at].to_vec(), {
            let mut bytes = whole.clone();
            bytes[at] ^= 0xff;
            bytes
        }] {
            let file = File::new("spoiled", &spoiled);
            let (status, _, err) = spoken(&file.0, &["--symbol", "first", "--loop", "spins=3"]);
            assert!(status <= 2, "{err}");
        }
    }
}

/// An interrupt whose bound exceeds its period may delay the next one. The boards of the images run at 16 MHz.
#[test]
fn the_bound_of_every_control_interrupt_leaves_a_tenth_of_its_period() {
    let table = |file: &str| {
        let text = std::fs::read_to_string(path(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
        text.parse::<toml_edit::DocumentMut>().unwrap_or_else(|error| panic!("{file}: {error}"))
    };
    let budgets = table("../firmware/budgets.toml");
    let scenarios = [
        ("interrupt of drive", "../firmware/drive.toml", "../firmware/src/bin/drive.rs", "TICK_HZ: u32 = 3_200;"),
        ("interrupt of motor", "../firmware/motor.toml", "../firmware/src/bin/motor.rs", "TICK_HZ: u32 = 5_000;"),
        ("interrupt of drive.c", "../examples/c/drive.toml", "../examples/c/drive.c", "RATE_HZ 4000u"),
    ];
    let mut held = 0;
    for instance in budgets["instance"].as_array_of_tables().expect("instances") {
        let name = instance["name"].as_str().expect("a name");
        if !name.starts_with("interrupt of ") {
            continue;
        }
        let of = scenarios.iter().find(|(of, ..)| *of == name).unwrap_or_else(|| panic!("no scenario: {name}"));
        let (_, file, source, rate) = of;
        // The timer rate in the program equals the rate of the design.
        let text = std::fs::read_to_string(path(source)).expect("the program");
        let digits = rate.split(['=', ' ']).next_back().expect("a rate").replace(['_', ';', 'u'], "");
        let period_s = table(file)["drive"]["period_s"].as_float().expect("a period");
        assert!(text.contains(rate) && (period_s * digits.parse::<f64>().expect("Hz") - 1.0).abs() < 1e-12, "{name}");
        let cycles = 16e6 * period_s;
        let bound = instance["ceiling"]["bound"].as_integer().expect("a bound") as f64;
        assert!(bound < 0.9 * cycles, "{name}: {bound} of {cycles} cycles leave less than a tenth to the main loop");
        held += 1;
    }
    assert_eq!(held, scenarios.len());
}

/// Table row and the name of its budget in `firmware/budgets.toml`.
const DRIVES: [(&str, &str); 17] = [
    ("motor", "motor"),
    ("motor, two gain sets", "motor, two sets"),
    ("motor, one tick of delay", "motor, late"),
    ("motor, speed loop", "motor, speed"),
    ("motor, one gain set, monitors that brake and stop it", "motor, watched"),
    ("joint, one observer per encoder", "joint with two encoders"),
    ("the same, held at angle 0, no reference", "joint with two encoders, held"),
    ("the same, two gain sets", "joint with two encoders, two sets"),
    ("the same, one tick of delay", "joint with two encoders, late"),
    ("the same, one gain set, monitors that brake and stop it", "joint with two encoders, watched"),
    ("joint as a whole (`coupled`)", "joint as a whole"),
    ("the same, two gain sets", "joint as a whole, two sets"),
    ("the same, one tick of delay", "joint as a whole, late"),
    ("joint, all four states measured, three channels observed", "joint, measured"),
    ("the same, held at 0, no reference", "joint, measured, held"),
    (
        "joint as a whole, two gain sets: the interrupt of `drive`, with plan, monitors and trace buffer",
        "interrupt of drive",
    ),
    ("motor, two gain sets: the interrupt of `motor`, the same", "interrupt of motor"),
];

/// The page shows the budgets that the tests enforce.
#[test]
fn the_table_of_drives_is_that_of_the_ceilings() {
    let text = std::fs::read_to_string(path("../firmware/budgets.toml")).expect("the ceilings");
    let file: toml_edit::DocumentMut = text.parse().expect("a table");
    let instances = file["instance"].as_array_of_tables().expect("instances");
    let mut table = String::from(
        "| instance | typical | pipelined | bound | flash | state | coefficients |\n\
         |---|---:|---:|---:|---:|---:|---:|\n",
    );
    for (row, name) in DRIVES {
        let instance = instances.iter().find(|it| it["name"].as_str() == Some(name)).expect(name);
        let of = |figure: &str| match instance["ceiling"].get(figure).and_then(toml_edit::Item::as_integer) {
            Some(ceiling) => ceiling.to_string(),
            None => "in the state".into(),
        };
        let figures = ["typical", "pipelined", "bound", "flash", "state", "coefficients"].map(of).join(" | ");
        table.extend(["| ", row, " | ", &figures, " |\n"]);
    }
    golden::in_docs("reference/cycles.md", "drives", &table).unwrap_or_else(|error| panic!("{error}"));
}
