//! The program as a process: special files, failed writes, signals. Unix only.
#![cfg(unix)]

use std::fs;
use std::io::{Read, Write};
use std::os::unix::fs::{FileTypeExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Timeout; nothing here takes a second.
const HANGS: Duration = Duration::from_secs(30);

const PROGRAM: &str = env!("CARGO_BIN_EXE_host-sim");

/// Folder of one test, removed at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("host-sim-program-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("temporary folder");
        Self(path)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }

    fn pipe(&self, name: &str) -> String {
        let path = self.path(name);
        assert!(Command::new("mkfifo").arg(&path).status().expect("mkfifo").success());
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Returns exit status, stdout and stderr of a child that must end by itself.
fn ended(mut child: Child) -> (i32, String, String) {
    let status = status_of(&mut child);
    let text = |from: Option<&mut dyn Read>| {
        let mut text = String::new();
        from.map(|from| from.read_to_string(&mut text).expect("UTF-8"));
        text
    };
    let out = text(child.stdout.as_mut().map(|pipe| pipe as &mut dyn Read));
    (status, out, text(child.stderr.as_mut().map(|pipe| pipe as &mut dyn Read)))
}

fn status_of(child: &mut Child) -> i32 {
    let until = Instant::now() + HANGS;
    while Instant::now() < until {
        if let Some(status) = child.try_wait().expect("a child of ours") {
            return status.code().unwrap_or(-1);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("a child of ours");
    child.wait().expect("a child of ours");
    panic!("it hangs");
}

fn started(args: &[&str]) -> Child {
    let mut command = Command::new(PROGRAM);
    command.args(args).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("the program")
}

fn spoken(args: &[&str]) -> (i32, String, String) {
    ended(started(args))
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
}

#[test]
fn an_export_that_fails_half_way_leaves_the_file_that_was_there() {
    let folder = Folder::new("half");
    let file = folder.path("controller.h");
    fs::write(&file, "my work").expect("a file");
    // Files are limited to one block; the write fails, and the process is not killed.
    let limited = r#"trap '' XFSZ; ulimit -f 1; exec "$0" "$@""#;
    let mut command = Command::new("sh");
    command.args(["-c", limited, PROGRAM, "export", "--paper", "--standalone", "--force", "-o", &file]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("sh");
    let (status, _, err) = ended(child);
    assert!(status == 1 && err.contains(&format!("error: {file} cannot be written: File too large")), "{err}");
    assert_eq!(fs::read_to_string(&file).expect("the file"), "my work");
    assert_eq!(fs::read_dir(&folder.0).expect("the folder").count(), 1);
}

#[test]
fn what_is_no_file_is_neither_replaced_nor_removed_by_an_export() {
    let folder = Folder::new("device");
    let device = folder.path("device");
    symlink("/dev/full", &device).expect("a link");
    let pipe = folder.pipe("pipe");
    for (target, name) in [(&device, "device"), (&pipe, "pipe")] {
        let (status, _, err) = spoken(&["export", "--paper", "--standalone", "--force", "-o", target]);
        let told = format!("error: {target} cannot be written: this is a {name}, expected a regular file\n");
        assert!(status == 2 && err.ends_with(&told), "{err}");
    }
    assert_eq!(fs::read_link(&device).expect("the link"), Path::new("/dev/full"));
    assert!(fs::metadata(&pipe).expect("the pipe").file_type().is_fifo());
}

#[test]
fn a_pipe_or_a_file_without_end_is_refused_and_never_waited_for() {
    let folder = Folder::new("pipe");
    let pipe = folder.pipe("pipe");
    let elf = concat!(env!("CARGO_MANIFEST_DIR"), "/../cycle-bound/tests/slew.elf");
    for (args, name) in [
        (&["run", &pipe][..], "pipe"),
        (&["export", "--standalone", &pipe], "pipe"),
        (&["budget", "--elf", elf, "--symbol", "slew", "--trace", &pipe], "pipe"),
        (&["budget", "--elf", elf, "--symbol", "slew", "--trace", "/dev/zero"], "device"),
        (&["budget", "--elf", &pipe, "--symbol", "slew"], "pipe"),
        (&["budget", "--ceilings", &pipe], "pipe"),
        (&["run", "/dev/zero"], "device"),
    ] {
        let (status, out, err) = spoken(args);
        assert_eq!((status, out.as_str()), (2, ""), "{args:?}");
        assert!(err.ends_with(&format!(": this is a {name}, expected a regular file\n")), "{args:?}: {err}");
    }
}

#[test]
fn a_trace_that_is_too_long_is_refused_by_its_length() {
    let folder = Folder::new("long");
    let elf = concat!(env!("CARGO_MANIFEST_DIR"), "/../cycle-bound/tests/slew.elf");
    let file = folder.path("trace");
    // A sparse file: long, without data on the disk.
    fs::File::create(&file).and_then(|file| file.set_len(1 << 40)).expect("a file");
    let (status, _, err) = spoken(&["budget", "--elf", elf, "--symbol", "slew", "--trace", &file]);
    assert_eq!((status, err), (2, format!("error: {file}: longer than 256 MiB: not a trace\n")));
}

#[test]
fn the_first_request_to_stop_ends_a_program_whose_reader_does_not_read() {
    let folder = Folder::new("blocked");
    let to = folder.path("o");
    let short = ["--set", "span_s=0.2", "--set", "window_s=[0.1, 0.2]", "--json", "--out", &to];
    for (args, is_out) in [(&["schema"][..], true), (&short, true), (&["figures", "--out", &to], false)] {
        let (_reader, mut writer) = std::io::pipe().expect("a pipe");
        // Fills the pipe.
        writer.write_all(&vec![0; 1 << 16]).expect("room");
        let mut command = Command::new(PROGRAM);
        command.args(args).stdout(Stdio::null()).stderr(Stdio::null());
        let blocked = if is_out { command.stdout(writer) } else { command.stderr(writer) };
        let mut child = blocked.spawn().expect("the program");
        std::thread::sleep(Duration::from_millis(500));
        assert!(child.try_wait().expect("a child of ours").is_none(), "it must still be writing");
        signal(&child, "TERM");
        assert_eq!(status_of(&mut child), 130, "{args:?}");
    }
}

#[test]
fn an_image_without_messages_runs_too_and_what_it_sends_is_shown_as_text() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new("text");
    // An emulator that prints two lines.
    let text = "#!/bin/bash\nall=\"$*\"\nport=${all##*tcp:127.0.0.1:}\nexec 3<>\"/dev/tcp/127.0.0.1/${port%%,*}\"\n\
                printf 'count \\e[1m1\\r\\nis done\\n' >&3\nexec sleep 600\n";
    let emulator = folder.0.join("qemu-system-arm");
    fs::write(&emulator, text).expect("a program");
    fs::set_permissions(&emulator, fs::Permissions::from_mode(0o755)).expect("ours");
    let elf = concat!(env!("CARGO_MANIFEST_DIR"), "/../cycle-bound/tests/slew.elf");
    let mut command = Command::new(PROGRAM);
    command.args(["emulate", "--image", elf, "--seconds", "20"]);
    let path = format!("{}:{}", folder.0.display(), std::env::var("PATH").unwrap_or_default());
    let child = command.env("PATH", path).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program");
    let note = "note: the firmware has no defmt messages; the output of USART2 is printed as text\n";
    assert_eq!(ended(child), (0, "count ?[1m1\nis done\n".into(), note.into()));
}

#[test]
fn who_has_no_image_is_told_the_option_that_names_one_and_how_one_is_built() {
    let folder = Folder::new("none");
    let mut command = Command::new(PROGRAM);
    command.arg("pil").current_dir(&folder.0).stdout(Stdio::piped()).stderr(Stdio::piped());
    let (status, _, err) = ended(command.spawn().expect("the program"));
    let told = "give --image FILE, or build the example firmware with `cargo xtask firmware` in the repository\n";
    assert!(status == 1 && err.ends_with(told), "{err}");
}

/// Returns the text between the first `from` and the next `to`, without both.
fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let (_, rest) = text.split_once(from).unwrap_or_else(|| panic!("no {from:?}"));
    rest.split_once(to).unwrap_or_else(|| panic!("no {to:?} behind {from:?}")).0
}

/// Runs the program in a folder.
fn ran_in(folder: &Folder, args: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(PROGRAM);
    command.args(args).current_dir(&folder.0).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    ended(command.spawn().expect("the program"))
}

/// A named file is kept without `--force`, and its folder must exist. The default file is replaced with a note, and
/// only if it is a report of the scenario.
#[test]
fn a_page_that_is_named_is_never_lost_and_the_program_s_own_is_made_anew_with_a_word() {
    let folder = Folder::new("report");
    let brief = ["report", "--map", "none", "--set", "span_s=0.2", "--set", "window_s=[0.1, 0.2]"];
    let with = |more: &[&str]| ran_in(&folder, &[&brief[..], more].concat());
    let page = folder.path("page.html");
    let told = with(&["-o", "none/page.html"]);
    assert_eq!(told, (2, String::new(), "error: none/page.html: the folder none does not exist\n".into()));
    assert_eq!(with(&["-o", "page.html"]), (0, "wrote page.html\n".into(), String::new()));
    let html = fs::read_to_string(&page).expect("a page");
    for words in ["host-sim 0.1.0", "commit", "rustc 1.", "one exact step per tick, within 1e-9"] {
        assert!(html.contains(words), "{words}");
    }
    let kept = "error: page.html already exists and was not changed; --force overwrites it\n";
    fs::write(&page, "mine").expect("a file");
    assert_eq!(with(&["-o", "page.html"]), (2, String::new(), kept.into()));
    assert_eq!(fs::read_to_string(&page).expect("a page"), "mine");
    assert_eq!(with(&["-o", "page.html", "--force"]).0, 0);
    assert_eq!(fs::read_to_string(&page).expect("a page"), html, "the same program, the same bytes");

    let own = "wrote out/default-report.html";
    let (status, out, err) = with(&[]);
    assert_eq!((status, out.trim_end()), (0, own), "{err}");
    assert_eq!(with(&[]).1.trim_end(), format!("{own} (replaced; give --output to keep several)"));
    fs::write(folder.path("out/default-report.html"), "mine").expect("a file");
    let (status, _, err) = with(&[]);
    assert!(status == 2 && err.contains("is not a report of default and was not changed"), "{err}");
    assert_eq!(with(&["--force"]).0, 0);
}

/// `map` and `tune` save nothing before their end.
#[test]
fn a_command_without_a_record_says_so_when_it_is_told_to_stop() {
    let folder = Folder::new("stopped");
    let (map, tune) = (folder.path("map"), folder.path("tune"));
    for args in [
        &["map", "--preset", "gain", "--simulate", "--out", &map][..],
        &["tune", "--evaluations", "100000", "--out", &tune, "--to", &folder.path("tuned.toml")],
    ] {
        let child = started(args);
        std::thread::sleep(Duration::from_millis(1500));
        signal(&child, "INT");
        let told = "stopped on request; unwritten results are lost\n";
        assert_eq!(ended(child), (130, String::new(), told.into()), "{args:?}");
    }
}

/// Runs the `host-sim` commands of a page in order, in a folder of their own. Returns the folder, and the arguments and
/// output of each command.
///
/// A `text` block directly behind a command is its output; `GOLDEN=write` writes it. A block with a line `..` is an
/// excerpt. Commands of other programs belong to `elsewhere`.
fn page_runs(page: &str, folder: &str, elsewhere: &[&str]) -> (Folder, Vec<[String; 2]>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(page);
    let text = fs::read_to_string(&path).expect("the page");
    let folder = Folder::new(folder);
    let (mut written, mut runs) = (String::new(), Vec::<[String; 2]>::new());
    for block in text.split_inclusive("```\n") {
        if let Some((before, commands)) = block.split_once("```sh\n") {
            for line in commands.trim_end_matches("```\n").lines() {
                let command = line.split(" # ").next().unwrap_or(line).trim_end();
                let Some(args) = command.strip_prefix("cargo run --release -- ") else {
                    assert!(elsewhere.contains(&command), "{page}: {command} is run nowhere");
                    continue;
                };
                // A shell would remove the quotes.
                let args = args.replace("examples/c/", "").replace('\'', "");
                let (status, printed, err) = ran_in(&folder, &args.split_whitespace().collect::<Vec<_>>());
                assert_eq!((status, err.as_str()), (0, ""), "{page}: {command}");
                runs.push([args, printed]);
            }
            written = written + before + "```sh\n" + commands;
        } else if let Some((before, printed)) = block.split_once("```text\n") {
            let printed = printed.trim_end_matches("```\n");
            let [_, out] = runs.last().expect("a command above its output");
            let is_excerpt = printed.lines().any(|line| line == "..");
            let mut lines = out.lines();
            for line in printed.lines().filter(|line| is_excerpt && *line != "..") {
                assert!(lines.any(|it| it == line), "{page}: the output has no line {line:?} there:\n{out}");
            }
            let printed = if is_excerpt { printed } else { out };
            written = written + before + "```text\n" + printed + "```\n";
        } else {
            written += block;
        }
    }
    if std::env::var_os("GOLDEN").is_some_and(|value| value == "write") {
        fs::write(&path, written).expect("the page is written");
    } else {
        let remedy = "GOLDEN=write cargo test -p host-sim --test program pages_commands";
        assert_eq!(text, written, "the outputs of {page}: {remedy}");
    }
    (folder, runs)
}

/// The firmware and the emulated targets have tests of their own: `export_motor`, `emulator`.
#[test]
fn readme_and_tutorial_have_the_output_of_the_pages_commands() {
    let firmware = ["$EDITOR mine.toml", "make -C examples/c run-motor", "cargo xtask firmware"];
    let chip = "cargo run --release --features chip -- pil mine.toml";
    page_runs("README.md", "readme", &[&firmware[..], &[chip]].concat());
    page_runs("docs/tutorial-motor.md", "tutorial", &firmware);
}

#[test]
fn the_equations_of_the_page_are_those_of_the_file_and_its_commands_work() {
    let (folder, runs) = page_runs("docs/own-plant.md", "equations", &[]);
    for [args, out] in runs {
        assert!(!args.starts_with("run") || out.contains("result: finished, state bounded"), "{out}");
    }
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/own-plant.md");
    let page = fs::read_to_string(page).expect("the page");
    let section = between(&page, "## Write down your equations\n", "\n## ");
    let file = fs::read_to_string(folder.0.join("pendulum.toml")).expect("the file");
    for part in between(section, "```toml\n", "```").split("\n\n") {
        assert!(file.contains(part.trim_end()), "{part}");
    }
    assert!(fs::read_to_string(folder.0.join("pendulum.h")).expect("the C file").contains("edo_smc_tick("));
}

/// Guides whose commands run in a test. The files that a page does not make itself are templates.
const GUIDES: [&str; 9] =
    ["c", "commissioning", "comparison", "joints", "own-plant", "paper", "robustness", "tuning", "verification"];
/// Parts of commands that need firmware, a board, a recording or a solver, and the test that runs such a command.
const ELSEWHERE: [(&str, &str); 6] = [
    ("--port", "a board"),
    ("--image", "suite, `commission`"),
    ("--elf", "suite, `export_motor`"),
    ("record.csv", "`commission` of this crate"),
    ("--certificate", "deep part `proofs`"),
    ("figures", "suite, `figures`"),
];
/// Commands that take minutes: only the deep tier runs them.
const LONG: [&str; 3] = ["compare", "commission", "monte-carlo"];

/// Every command of a guide succeeds on a template. README, tutorial and the page on own plants also show their output.
#[test]
fn the_commands_of_the_guides_run() {
    let deep = std::env::var_os("DEEP").is_some_and(|value| value == "1");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (mut count, mut wrong) = (0, Vec::new());
    for page in GUIDES {
        let folder = Folder::new(&format!("guide-{page}"));
        let templates = [("mine", "motor"), ("wrist", "motor"), ("elbow", "joint"), ("own", "own")];
        for (name, plant) in templates {
            assert_eq!(ran_in(&folder, &["new", name, "--plant", plant]).0, 0);
        }
        let text = fs::read_to_string(root.join(format!("docs/{page}.md"))).expect("the page");
        for line in text.replace("\\\n", " ").lines() {
            let line = line.trim().trim_start_matches("$ ");
            let begins = ["cargo run --release -- ", "cargo run --release --features chip -- ", "host-sim "];
            let Some(words) = begins.iter().find_map(|begin| line.strip_prefix(begin)) else { continue };
            let command = words.split(" #").next().unwrap_or(words).trim();
            let is_long = LONG.iter().any(|long| command.starts_with(long));
            let is_pattern = command.contains("[-") || command.contains(" ..") || command.contains(['`', '<', '|']);
            if is_pattern || ELSEWHERE.iter().any(|(part, _)| command.contains(part)) || is_long && !deep {
                continue;
            }
            // The quotes of a shell; no argument of a page has a blank in them.
            let plain = command.replace('\'', "").replace("examples/c/motor_drive.h", "motor_drive.h");
            let mut args: Vec<String> = plain.split_whitespace().map(str::to_owned).collect();
            if let Some(source) = args.iter_mut().find(|arg| arg.starts_with("examples/")) {
                *source = root.join(&source).display().to_string();
            }
            match &*args[0] {
                "new" => _ = fs::remove_file(folder.0.join(format!("{}.toml", args[1]))),
                // A smaller search than the default of the command, which takes half an hour.
                "compare" => args.extend(["--evaluations", "1"].map(String::from)),
                _ => {}
            }
            let (status, _, err) = ran_in(&folder, &args.iter().map(|arg| &**arg).collect::<Vec<_>>());
            count += 1;
            if status != 0 {
                wrong.push(format!("docs/{page}.md: {command}: {err}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    println!("{count} commands");
    assert!(count >= if deep { 22 } else { 17 }, "{count} commands");
}

/// Another motor than in the template: three times the inertia, twice the torque constant, 16 bits.
#[test]
fn three_commands_take_a_motor_of_one_s_own_along_a_sine() {
    let folder = Folder::new("three");
    let peak = |typed: &[(&str, &str)], friction: &str| {
        let _ = fs::remove_file(folder.0.join("mine.toml"));
        assert_eq!(ran_in(&folder, &["new", "mine", "--plant", "motor"]).0, 0);
        let mut text = fs::read_to_string(folder.0.join("mine.toml")).expect("the file");
        for (from, to) in typed {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        assert!(text.contains(friction));
        fs::write(folder.0.join("mine.toml"), text).expect("ours");
        let (status, out, err) = ran_in(&folder, &["run", "mine.toml", "--json"]);
        assert_eq!((status, err.lines().count()), (0, 1), "{err}");
        let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
        assert_eq!(json["metrics"]["window_s"], serde_json::json!([0.25, 2.0]));
        json["metrics"]["error_ultimate"].as_f64().expect("a number")
    };
    let friction = "coulomb_n_m = 0.005\nstatic_n_m = 0.008\n";
    // Values of the template: 2e-4 kg m², 0.05 N m/A, 10 A, 14 bits, 1 kHz.
    let found = peak(&[], friction);
    assert!(found < 3.2e-3, "{found:e} rad");
    let other = [
        ("inertia_kg_m2 = 2e-4", "inertia_kg_m2 = 6e-4"),
        ("torque_n_m_per_a = 0.05", "torque_n_m_per_a = 0.1"),
        ("bits = 14", "bits = 16"),
    ];
    let found = peak(&other, friction);
    assert!(found < 3.2e-3, "{found:e} rad");
}
