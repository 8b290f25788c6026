//! Bit-identity of the image on the emulated target with this process, and clear messages for every failure on the way.
//!
//! These tests need `qemu-system-arm` and the images. If one is missing, they fail and name the command to run.

use cycle_bound::log::{Log, Messages};
use cycle_bound::qemu::START_WITHIN;
use host_sim::cli::{self, Console};
use host_sim::figures::CATALOGUE;
use integration_tests::data::{path, scenario_file};
use integration_tests::program::{CommandResult, Folder, host_sim, host_sim_until};
use integration_tests::{deep, sampled};
use link::remote::{LONGEST_WAIT, Remote, for_target};
use link::transport::{BAUD, Emulator, Serial, Transport};
use loop_sim::port::ControllerPort;
use scenario::load;
use serde_json::Value as Json;
use std::io::{BufRead, BufReader, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

fn image(name: &str) -> PathBuf {
    let file = path("../firmware/target/thumbv7em-none-eabihf/release").join(name);
    assert!(file.exists(), "{} is missing: `cargo xtask firmware` builds it", file.display());
    file
}

fn image_text(name: &str) -> String {
    image(name).display().to_string()
}

fn scenario(file: &str) -> String {
    scenario_file(file).display().to_string()
}

fn json(spoken: &CommandResult) -> Json {
    serde_json::from_str(&spoken.out).unwrap_or_else(|error| panic!("{error}: {spoken:?}"))
}

/// Runs a scenario on the emulated target.
fn pil(folder: &Folder, args: &[&str]) -> CommandResult {
    let (image, out) = (image_text("pil"), folder.path("pil"));
    // Results of another scenario in this folder would be rejected.
    let _ = std::fs::remove_dir_all(&out);
    host_sim(&[&["pil", "--json", "--image", &image, "--out", &out], args].concat())
}

/// Checks that all ticks ran without a different bit; returns the run data.
fn assert_same(spoken: &CommandResult, ticks: u64, label: &str) -> Json {
    assert_eq!(spoken.status, 0, "{label}: {spoken:?}");
    let json = json(spoken);
    let target = &json["target"];
    assert_eq!((&target["ticks"], &target["bits_differ"]), (&ticks.into(), &0.into()), "{label}: {json}");
    json
}

#[test]
fn twenty_seconds_of_the_default_scenario_on_the_chip_are_those_of_this_process() {
    let folder = Folder::new("pil-default");
    // The fast tier runs one of the twenty seconds.
    let short = ["--set", "span_s=1", "--set", "window_s=[0.5, 1]"];
    let (sets, ticks) = if deep() { (&[][..], 20_001) } else { (&short[..], 1_001) };
    let on_the_chip = assert_same(&pil(&folder, sets), ticks, "default");
    let here = json(&host_sim(&[&["--json", "--out", &folder.path("here")], sets].concat()));
    // Exact equality: the same numbers, and the same bytes in every file.
    assert_eq!(on_the_chip["metrics"], here["metrics"]);
    for file in ["trace.csv", "response.svg", "estimates.svg"] {
        let bytes = |of: &str| std::fs::read(folder.path(of).clone() + "/" + file).expect("a file");
        assert!(bytes("pil") == bytes("here"), "{file}");
    }
}

/// The first 1001 ticks of each case; `wire` runs them to their end over a link without delay. The fast tier takes 301
/// ticks of every ninth case.
#[test]
fn every_case_of_every_figure_has_the_same_bits_on_the_chip() {
    let (mut compared, mut passed_over) = (0, 0);
    let periods = if deep() { 1000 } else { 300 };
    for figure in CATALOGUE {
        for (label, mut experiment) in figure.experiments().expect("right files") {
            // A target does not carry the baseline.
            let Some(download) = for_target(&experiment).ok() else { continue };
            if !deep() && (compared + passed_over) % 9 != 0 {
                passed_over += 1;
                continue;
            }
            experiment.periods = periods;
            let (emulator, _) = Emulator::start(&image("pil"), false).unwrap_or_else(|error| panic!("{error}"));
            let mut remote = Remote::connect(emulator, Duration::from_millis(100), download)
                .unwrap_or_else(|error| panic!("{error}"));
            let (trace, error) = experiment.run_beside(Some(&mut remote), &mut |_| ControlFlow::Continue(()));
            assert!(error.is_none(), "{} {label}: {error:?}", figure.id);
            assert_eq!(trace.rows.len(), periods + 1, "{} {label}", figure.id);
            compared += 1;
        }
    }
    assert_eq!(compared + passed_over, CATALOGUE.iter().map(|figure| figure.cases.len()).sum::<usize>());
    assert!(compared >= 2, "{compared}");
}

#[test]
fn every_kind_of_design_and_of_trouble_has_the_same_bits_on_the_chip() {
    let first = "controller.observer=[{channel=4, printed=[100.0]}]";
    let third = "controller.observer=[{channel=2, printed=[1000,300,30]}, {channel=4, printed=[1000,300,30]}]";
    let short = ["--set", "span_s=0.4", "--set", "window_s=[0.1, 0.4]"];
    // The fast tier takes the first, the fourth and a tenth of the first one's ticks.
    let brief = ["--set", "span_s=0.04", "--set", "window_s=[0.01, 0.04]"];
    let fig02 = if deep() { 4001 } else { 401 };
    let cases: [(&str, &[&str], u64); 6] = [
        ("fig02.toml", &["controller.exp=micromath"], fig02),
        ("default.toml", &[third], 401),
        ("default.toml", &[first, "plant.error.k1=0.1"], 401),
        ("default.toml", &["controller.limits={min=-20, max=20}", "controller.k_s=1"], 401),
        ("default.toml", &["sensor.dropout=0.2", "controller.fallback=0.5"], 401),
        ("chain.toml", &[], 401),
    ];
    let folder = Folder::new("pil-kinds");
    for (file, sets, ticks) in sampled(cases, 3) {
        let label = format!("{file} {sets:?}");
        let short = if file == "fig02.toml" && !deep() { brief } else { short };
        let file = scenario(file);
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let spoken = pil(&folder, &[&[file.as_str()], &short[..], &sets].concat());
        assert_same(&spoken, ticks, &label);
    }
}

/// The target designs the drives itself. `wire` has longer runs and more forms.
#[test]
fn drives_have_the_same_bits_on_the_chip_on_a_bad_wire_too() {
    let folder = Folder::new("pil-drives");
    let faults = "fault=[{kind='lost', at_s=0.3, for_s=0.02}, {kind='jump', at_s=0.35, counts=900, for_s=0.004}]";
    let cases: [(&str, &[&str], &[&str]); 7] = [
        ("motor", &["drive.delay_ticks=1"], &[]),
        ("motor", &["drive.mode='speed'", "reference={kind='speed', speed_rad_s=20}"], &[]),
        ("motor", &["drive.uncertain_percent=50", "drive.observer_states=4"], &["--faults", "0.05", "--seed", "5"]),
        ("joint", &["monitor.reaction='fallback'", faults], &[]),
        ("joint", &["drive.tuning='coupled'"], &[]),
        ("joint", &["drive.delay_ticks=1"], &[]),
        ("joint", &["drive.tuning='coupled'", "drive.delay_ticks=1", faults], &[]),
    ];
    for (plant, sets, wire) in sampled(cases, 4) {
        let label = format!("{plant} {sets:?}");
        let text = if plant == "motor" { scenario::MOTOR } else { scenario::JOINT };
        let file = folder.path(&format!("{plant}.toml"));
        std::fs::write(&file, text).expect("a file");
        let short = ["--set", "span_s=0.45", "--set", "window_s=[0.2, 0.45]", "--set", "load=[]"];
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        assert_same(&pil(&folder, &[&[file.as_str()], &short[..], &sets, wire].concat()), 451, &label);
    }
}

#[test]
fn a_bad_wire_to_the_chip_costs_no_tick_and_no_bit() {
    let folder = Folder::new("pil-faults");
    let (span, ticks, repeated) = if deep() { ("span_s=0.499", 500, 50) } else { ("span_s=0.149", 150, 15) };
    let args = ["--faults", "0.05", "--seed", "3", "--set", span, "--set", "window_s=[0.1, 0.149]"];
    let json = assert_same(&pil(&folder, &args), ticks, "faults");
    assert!(json["target"]["repeated"].as_u64() > Some(repeated), "{json}");
}

#[test]
fn a_run_on_the_chip_speaks_as_a_run_here_and_ends_with_the_comparison_and_shows_the_log() {
    let folder = Folder::new("pil-speaks");
    let (image, out) = (image_text("pil"), folder.path("o"));
    let short = ["--set", "span_s=0.2", "--set", "window_s=[0.1, 0.2]", "--out", &out];
    let there = host_sim(&[&["pil", "--image", &image, "--log"], &short[..]].concat());
    let here = host_sim(&short);
    assert_eq!((there.status, here.status), (0, 0), "{there:?}");
    let comparison = there.out.lines().find(|line| line.contains(" round trips/s")).expect("a line");
    let (verdict, bits) = comparison.split_once("; ").expect("a verdict and a comparison");
    assert!(verdict.starts_with("result: finished") && bits.starts_with("201 ticks, 0 bits differ ("), "{comparison}");
    assert_eq!(there.out.replace(comparison, verdict), here.out);
    assert!(there.err.lines().any(|line| line.starts_with("log: info  hello: wire 4, ")), "{}", there.err);
    assert!(there.err.contains("n: 4, r: 2, mask: 10"), "{}", there.err);
}

#[test]
fn ctrl_c_in_a_run_on_the_chip_keeps_what_was_recorded() {
    let folder = Folder::new("pil-interrupted");
    let (image, out) = (image_text("pil"), folder.path("o"));
    let stop = AtomicBool::new(false);
    let spoken = std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(Duration::from_millis(1500));
            stop.store(true, Ordering::Relaxed);
        });
        host_sim_until(&["pil", "--image", &image, "--out", &out, "--set", "span_s=2000"], &stop)
    });
    assert_eq!(spoken.status, 130, "{spoken:?}");
    let rows = std::fs::read_to_string(folder.path("o/trace.csv")).expect("a trace").lines().count() - 1;
    assert!(spoken.out.contains(&format!("; {rows} ticks, 0 bits differ (")), "{rows}: {spoken:?}");
}

#[test]
fn ctrl_c_is_heard_while_a_target_says_nothing() {
    let folder = Folder::new("pil-let-go");
    let (image, out) = (image_text("budget"), folder.path("o"));
    let stop = AtomicBool::new(true);
    let began = Instant::now();
    let spoken = host_sim_until(&["pil", "--image", &image, "--out", &out], &stop);
    assert_eq!((spoken.status, spoken.out.as_str()), (130, ""), "{spoken:?}");
    assert_eq!(spoken.err, "error: stopped on request, before the first tick\n");
    assert!(began.elapsed() < LONGEST_WAIT, "{:?}", began.elapsed());
}

#[test]
fn an_image_that_is_missing_or_none_or_the_wrong_one_is_told_with_the_remedy() {
    let folder = Folder::new("pil-images");
    let out = folder.path("o");
    let (absent, readme, silent) = (folder.path("pil"), path("../README.md"), image("budget"));
    let cases = [
        (
            PathBuf::from(&absent),
            format!(
                "{absent}: there is no such file; give --image FILE, or build the example firmware with `cargo xtask \
                 firmware` in the repository\n"
            ),
        ),
        (readme.clone(), format!("{}: not an ELF file\n", readme.display())),
        (silent.clone(), format!("; check that {} is the firmware `pil` of this version\n", silent.display())),
        (
            image("drive"),
            format!(
                "its firmware is another or older; check that {} is the firmware `pil` of this version\n",
                image("drive").display()
            ),
        ),
    ];
    // Each wait for an answer is 5 s of a busy emulator; the fast tier has another test of it.
    for (image, ending) in cases.into_iter().filter(|(image, _)| deep() || *image != silent) {
        let began = Instant::now();
        let CommandResult { status, out, err } =
            host_sim(&["pil", "--image", &image.display().to_string(), "--out", &out]);
        assert_eq!((status, out.as_str()), (1, ""), "{err}");
        assert!(err.starts_with("error: ") && err.ends_with(&ending) && err.lines().count() == 1, "{err}");
        assert!(began.elapsed() < LONGEST_WAIT + START_WITHIN, "{:?}", began.elapsed());
    }
    assert!(!PathBuf::from(out).exists(), "nothing is written");
}

#[test]
fn a_scenario_that_no_target_carries_ends_with_status_2_before_anything_is_booted() {
    let spoken = host_sim(&["pil", "--image", "nowhere", "--set", "controller.precision=f64"]);
    let told = "error: default: a target computes in f32; set controller.precision=f32\n";
    assert_eq!((spoken.status, spoken.out.as_str(), spoken.err.as_str()), (2, "", told));
}

#[test]
fn garbage_before_the_talk_is_skipped_and_a_fault_on_the_chip_brings_the_black_box_into_the_log() {
    let experiment = load(&scenario_file("default.toml"), &[]).unwrap_or_else(|error| panic!("{error}"));
    let download = for_target(&experiment).expect("one for a target");
    let (mut emulator, log) = Emulator::start(&image("pil"), true).unwrap_or_else(|error| panic!("{error}"));
    let messages = Messages::of(&image("pil")).unwrap_or_else(|error| panic!("{error}"));
    let log = Log::follow(log.expect("the log"), messages);
    // Frame marks, halves of marks, and a truncated frame.
    emulator
        .send(&[0x5A, 0x5A, 0xE5, 0xFF, 0x00, 0x5A, 0xE5, 0x01, 0x05, 0x5A])
        .unwrap_or_else(|error| panic!("{error}"));
    let mut remote =
        Remote::connect(emulator, Duration::from_millis(100), download).unwrap_or_else(|error| panic!("{error}"));
    for k in 0..20 {
        remote.tick(&[0.1 + f64::from(k), 0.0, 0.0, 0.0]).unwrap_or_else(|error| panic!("{error}"));
    }
    remote.provoke_fault().unwrap_or_else(|error| panic!("{error}"));

    let mut lines = Vec::new();
    while let Ok(line) = log.wait(Duration::from_secs(3)) {
        let last = line.ends_with("stopped");
        lines.push(line);
        if last {
            break;
        }
    }
    let fault = lines.iter().position(|line| line.starts_with("error hard fault at 0x08")).expect("where it was");
    // The last 16 of 20 ticks, oldest first, with their samples.
    let black_box: Vec<&String> = lines[fault + 1..].iter().filter(|line| line.contains("tick: ")).collect();
    assert_eq!(black_box.len(), 16, "{lines:#?}");
    for (k, line) in (4..20).zip(black_box) {
        assert!(line.contains(&format!("tick: {k}, x: [{k}.1")), "{line}");
    }
    assert_eq!(lines.last().map(String::as_str), Some("error stopped"));
    let told = remote.tick(&[0.1, 0.0, 0.0, 0.0]).expect_err("the chip has stopped");
    assert_eq!(told.to_string(), "no answer to tick 20 within 5 s");
}

#[test]
fn the_other_images_run_in_the_emulator_and_their_logs_are_printed() {
    let CommandResult { status, out, err } =
        host_sim(&["emulate", "--image", &image_text("budget"), "--seconds", "60"]);
    assert_eq!((status, err.as_str()), (0, ""));
    assert!(out.starts_with("budget in Instructions\n") && out.ends_with("\nbudget ends\n"), "{out}");
    let CommandResult { status, out, err } = host_sim(&["emulate", "--image", &image_text("drive"), "--seconds", "4"]);
    assert_eq!((status, err.as_str()), (0, ""));
    assert!(out.starts_with("drive: 3200 Hz, ") && out.contains(" Instructions, 0 ticks missed"), "{out}");
    assert!(out.lines().skip(1).all(|line| line.contains("Health(0)") && line.ends_with(", 0 ticks missed")), "{out}");
}

/// Assembly in a Rust program on the target; module `capi` covers it next to C. The fast tier has no such image: tests
/// of `tick-assembly` compare assembly of every kind with its operation trace, also on the target.
#[test]
fn the_tick_as_assembly_gives_every_bit_of_the_rust_tick_for_a_million_ticks() {
    if !deep() {
        return;
    }
    let CommandResult { status, out, err } =
        host_sim(&["emulate", "--image", &image_text("assembly"), "--seconds", "600"]);
    assert_eq!((status, err.as_str()), (0, ""), "{out}");
    let lines: Vec<&str> = out.lines().collect();
    assert!(lines.len() == 5 && lines[4] == "assembly ends", "{out}");
    // Every code path of a tick ran often.
    for (line, (law, least)) in lines.iter().zip([
        ("order 2", [10_000, 100_000, 100_000, 1000]),
        ("order 3", [10_000, 100_000, 100_000, 1000]),
        ("motor", [500, 10_000, 100_000, 50]),
        ("joint", [500, 10_000, 100_000, 50]),
    ]) {
        let counts = line.strip_prefix(&format!("{law}: 1000000 ticks, 0 differ; ")).expect(line);
        let counts: Vec<u32> = counts.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let [rejected, saturated, starts] = counts[..] else { panic!("{line}") };
        let seen = [rejected, saturated, 1_000_000 - rejected - saturated, starts];
        assert!(seen.iter().zip(least).all(|(seen, least)| *seen > least), "{line}");
    }
}

/// Image in an emulator that `host-sim` does not start, behind pseudo-terminals like a board behind its ports.
struct Board {
    child: Child,
    port: String,
    log_port: String,
}

impl Board {
    fn of(name: &str) -> Self {
        let line = "-M netduinoplus2 -nographic -monitor none -serial pty -serial pty";
        // On a busy machine the 3.2 kHz interrupt of `drive` would leave its main loop no time for the serial port.
        let clock = if name == "drive" { "-icount shift=0,sleep=off" } else { "" };
        let mut child = Command::new("qemu-system-arm")
            .args(line.split_whitespace().chain(clock.split_whitespace()))
            .arg("-kernel")
            .arg(image(name))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("qemu-system-arm: apt-get install qemu-system-arm");
        let mut lines = BufReader::new(child.stdout.take().expect("it was piped")).lines();
        let mut port = || {
            let line = lines.next().expect("a line per port").expect("text");
            line.split_whitespace().find(|word| word.starts_with("/dev/")).expect("a port").to_owned()
        };
        let (port, log_port) = (port(), port());
        Self { child, port, log_port }
    }

    fn unplug(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.unplug();
    }
}

#[test]
fn a_board_at_a_serial_port_has_the_same_bits_and_its_log_is_shown() {
    let folder = Folder::new("hil");
    let board = Board::of("pil");
    let (image, out) = (image_text("pil"), folder.path("o"));
    let target =
        ["hil", "--json", "--port", &board.port, "--log-port", &board.log_port, "--elf", &image, "--out", &out];
    let (span, ticks) = if deep() { ("span_s=0.5", 501) } else { ("span_s=0.2", 201) };
    let short = ["--set", span, "--set", "window_s=[0.1, 0.2]"];
    let spoken = host_sim(&[&target[..], &short].concat());
    assert_same(&spoken, ticks, "hil");
    assert!(spoken.err.contains("log: info  session opened: "), "{}", spoken.err);
    // The second run follows without a reset of the board.
    assert_same(&host_sim(&[&target[..], &short].concat()), ticks, "again");
}

/// Reader of stderr that interrupts the link as soon as the log reports the start of a run.
struct Unplugging {
    board: Board,
    said: String,
}

impl Write for Unplugging {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.said += &String::from_utf8_lossy(bytes);
        if self.said.contains("session opened") {
            self.board.unplug();
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_board_unplugged_in_mid_run_ends_it_and_what_was_recorded_is_kept() {
    let folder = Folder::new("hil-unplugged");
    let mut err = Unplugging { board: Board::of("pil"), said: String::new() };
    let (port, log_port, image) = (err.board.port.clone(), err.board.log_port.clone(), image_text("pil"));
    let args =
        ["host-sim", "hil", "--port", &port, "--log-port", &log_port, "--elf", &image, "--out", &folder.path("o")];
    let (mut out, stop) = (Vec::new(), AtomicBool::new(false));
    let console = Console { out: &mut out, err: &mut err, stop: &stop, terminal: false };
    let status = cli::run(args.iter().map(Into::into), console);
    let (out, err) = (String::from_utf8_lossy(&out), err.said);
    assert_eq!(status, 1, "{out}{err}");
    assert!(out.contains("\nresult: BROKEN OFF at t = "), "{out}");
    assert!(err.contains(&format!("\nerror: {port}: the line broke (")), "{err}");
    let rows = std::fs::read_to_string(folder.path("o/trace.csv")).expect("a trace").lines().count() - 1;
    assert!(out.contains(&format!("; {rows} ticks, 0 bits differ (")), "{rows}: {out}");
    assert!((1..20_001).contains(&rows), "{rows}");
}

#[test]
fn a_port_that_is_none_or_another_image_behind_it_is_told_in_words() {
    let folder = Folder::new("hil-ports");
    let told = |port: &str| {
        let CommandResult { status, out, err } = host_sim(&["hil", "--port", port, "--out", &folder.path("o")]);
        assert_eq!((status, out.as_str(), err.lines().count()), (1, "", 1), "{err}");
        err
    };
    let absent = told("/dev/ttyNONE7");
    assert!(
        absent.starts_with("error: /dev/ttyNONE7: no such file or directory; is the board plugged in? "),
        "{absent}"
    );
    let none = told("/dev/null");
    assert!(none.starts_with("error: /dev/null: cannot be opened as a serial port: "), "{none}");
    let board = Board::of("budget");
    let silent = told(&board.port);
    let question = format!("; check the port {}, the power of the board, and its firmware (`pil`)\n", board.port);
    assert!(
        silent.starts_with("error: no answer to the first request within 5 s") && silent.ends_with(&question),
        "{silent}"
    );
    let taken = Serial::open(Path::new(&board.port), BAUD).unwrap_or_else(|error| panic!("{error}"));
    let busy = told(&board.port);
    assert!(busy.ends_with("does another program have it open?\n"), "{busy}");
    drop(taken);
    // The log port of an image: bytes of another protocol. Another 5 s.
    if deep() {
        let board = Board::of("drive");
        let garbage = told(&board.log_port);
        assert!(garbage.contains(" other bytes; is 115200 the speed of the port, "), "{garbage}");
    }
}
