//! The program from outside: stdout, stderr, files and exit status.

use std::collections::BTreeSet;
use std::sync::atomic::Ordering;
use std::time::Duration;

use serde_json::Value as Json;

use super::run::note_changes;
use super::*;
use link::remote::for_target;
use link::transport::{Loopback, Transport, TransportError};
use pil_wire::Reply;
use study::figures::FLAGS;

/// Settings of a run of 0.2 s.
const SHORT: [&str; 4] = ["--set", "span_s=0.2", "--set", "window_s=[0.1, 0.2]"];
/// Two weak springs and a strong motor: with the linear gain of 10 the joint diverges within a second.
const RUNAWAY: [&str; 8] = [
    "--set",
    "controller.k_l=10",
    "--set",
    "plant.error.k2_x1=-0.5",
    "--set",
    "plant.error.k2_x3=-0.5",
    "--set",
    "plant.error.b=0.5",
];

/// Folder of one test, removed at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("host-sim-cli-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("temporary folder");
        Self(path)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }

    fn file(&self, name: &str, text: &str) -> String {
        std::fs::write(self.0.join(name), text).expect("temporary file");
        self.path(name)
    }

    fn names(&self, below: &str) -> BTreeSet<String> {
        let entries = std::fs::read_dir(self.0.join(below)).expect("a folder");
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Exit status, stdout, stderr.
type CommandResult = (u8, String, String);

fn spoken_to(args: &[&str], stop: &AtomicBool) -> CommandResult {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let console = Console { out: &mut out, err: &mut err, stop, terminal: false };
    let status = run(["host-sim"].iter().chain(args).map(OsString::from), console);
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (status, text(out), text(err))
}

fn spoken(args: &[&str]) -> CommandResult {
    spoken_to(args, &AtomicBool::new(false))
}

fn keys(object: &Json) -> BTreeSet<&str> {
    object.as_object().expect("an object").keys().map(String::as_str).collect()
}

fn assert_is_run_json(text: &str) -> Json {
    assert_eq!(text.lines().count(), 1, "{text}");
    let json: Json = serde_json::from_str(text).expect("JSON");
    let metrics = [
        "sigma_star_ultimate",
        if json["tracking"].is_object() { "error_ultimate" } else { "y_ultimate" },
        "u_peak",
        "u_total_variation_per_s",
        "estimation_error_ultimate",
        "settling_time_s",
        "bounded",
        "window_s",
    ];
    assert_eq!(keys(&json["metrics"]), BTreeSet::from(metrics));
    let flags = FLAGS.map(|(_, name)| name);
    assert_eq!(keys(&json["ticks_with"]), BTreeSet::from(flags));
    for error in json["metrics"]["estimation_error_ultimate"].as_array().expect("a list") {
        let unit = error["unit"].as_str().map(|_| "unit");
        assert_eq!(keys(error), ["channel", "error"].into_iter().chain(unit).collect());
    }
    json
}

#[test]
fn json_of_the_bare_run_is_one_object_with_the_published_sigma_star() {
    let folder = Folder::new("bare");
    let (status, out, err) = spoken(&["--json", "--out", &folder.path("o")]);
    assert_eq!(status, status::DONE);
    let json = assert_is_run_json(&out);
    assert_eq!(json["scenario"], "default");
    assert_eq!(json["ending"], "finished");
    assert_eq!(json["metrics"]["bounded"], true);
    assert_eq!(json["metrics"]["window_s"], serde_json::json!([10.0, 20.0]));
    // The continuous controller has 0.0486; at 1 ms the value is within 3 %.
    let sigma_star = json["metrics"]["sigma_star_ultimate"].as_f64().expect("a number");
    assert!((sigma_star - 0.0486).abs() < 0.03 * 0.0486, "{sigma_star}");
    // The headline goes to stderr, so that a program can read stdout.
    assert_eq!(err.lines().count(), 1, "{err}");
    let expected = ["estimates.png", "estimates.svg", "response.png", "response.svg", "run.json", "trace.csv"];
    assert_eq!(folder.names("o"), expected.map(String::from).into());
}

#[test]
fn json_of_a_chain_gives_the_bounds_of_its_disturbances_too() {
    let folder = Folder::new("chain");
    let file = folder.file("mine.toml", scenario::CHAIN);
    let (status, out, _) = spoken(&["run", &file, "--json", "--out", &folder.path("o"), "--set", "span_s=6"]);
    assert_eq!(status, status::DONE);
    let json = assert_is_run_json(&out);
    // Bounds of 0.3 + 0.5 sin 2t and its derivatives: 0.8, 1, 2.
    assert_eq!(json["mu"][1]["by_order"], serde_json::json!([0.8, 1.0, 2.0]));
    assert_eq!(json["mu"][1]["mu"], 2.0);
}

#[test]
fn json_of_the_figures_is_an_array_of_claims() {
    let folder = Folder::new("figures");
    let (status, out, _) = spoken(&["figures", "--only", "fig09", "--json", "--out", &folder.path("o")]);
    assert_eq!(status, status::DONE);
    let json: Json = serde_json::from_str(&out).expect("JSON");
    let rows = json.as_array().expect("an array");
    assert!(!rows.is_empty());
    for row in rows {
        assert_eq!(row["figure"], "fig09");
        assert!(row["published"].is_string() && row["reproduced"].is_f64() && row["holds"].is_boolean(), "{row}");
        assert!(row["range"].is_null(), "{row}");
    }
    assert_eq!(folder.names("o"), ["fig09.png", "fig09.svg"].map(String::from).into());
}

#[test]
fn a_run_speaks_its_headline_a_table_and_where_it_wrote_and_nothing_on_stderr() {
    let folder = Folder::new("table");
    let to = folder.path("o");
    let (status, out, err) = spoken(&[&SHORT[..], &["--out", &to]].concat());
    assert_eq!((status, err.as_str()), (status::DONE, ""));
    let lines: Vec<&str> = out.lines().collect();
    assert!(lines[0].starts_with("default: Example 2, reconstructed: r = 2 as printed, k_l = 50; set span_s=0.2, "));
    assert!(lines[1].starts_with("metric "), "{out}");
    assert!(lines.iter().any(|line| line.starts_with("|u| peak (A) ")), "{out}");
    assert!(lines.iter().any(|line| line.starts_with("bounded ") && line.ends_with(" 201 of 201 ticks")), "{out}");
    assert_eq!(lines[lines.len() - 2], format!("files: {to}"));
    assert_eq!(lines[lines.len() - 1], "result: finished, state bounded");
}

#[test]
fn a_run_that_diverges_says_so_and_claims_no_figure_for_a_window_it_never_saw() {
    let folder = Folder::new("diverged");
    let to = folder.path("o");
    let (status, out, _) = spoken(&[&RUNAWAY[..], &["--out", &to]].concat());
    // Divergence is a result, not a failure.
    assert_eq!(status, status::DONE);
    assert!(out.contains("result: DIVERGED at t = 0.7"), "{out}");
    let sigma_star = out.lines().find(|line| line.starts_with("|sigma*| ultimate")).expect("a row");
    assert_eq!(sigma_star.split_whitespace().nth(3), Some("-"), "{sigma_star}");
    assert!(sigma_star.ends_with("the run ended before 20 s"), "{sigma_star}");

    let (status, out, _) = spoken(&[&RUNAWAY[..], &["--json", "--out", &to]].concat());
    assert_eq!(status, status::DONE);
    let json = assert_is_run_json(&out);
    assert_eq!((&json["ending"], &json["metrics"]["bounded"]), (&Json::from("diverged"), &Json::from(false)));
    for missing in ["sigma_star_ultimate", "y_ultimate", "u_total_variation_per_s", "settling_time_s"] {
        assert_eq!(json["metrics"][missing], Json::Null, "{missing}");
    }
}

#[test]
fn the_verdict_names_the_first_alarm_of_a_drive() {
    let folder = Folder::new("reversed");
    let file = folder.file("motor.toml", scenario::MOTOR);
    let verdict = |sets: &[&str]| {
        let (_, out, _) = spoken(&[&["run", "--no-files", &file][..], sets].concat());
        out.lines().last().expect("a verdict").to_owned()
    };
    assert_eq!(verdict(&[]), "result: finished, state bounded");
    let reversed = verdict(&["--set", "error.reversed=true"]);
    assert!(
        reversed.starts_with("result: finished, STOPPED after an alarm, |y| exceeded")
            && reversed.contains("; ALARM at t = 0.03 s: dist"),
        "{reversed}"
    );
}

#[test]
fn a_run_that_ends_far_out_is_not_called_bounded() {
    let folder = Folder::new("far");
    // An unstable plant with an actuator that is too weak: y grows as exp(1.6 t).
    let text = "span_s = 10\nplant = { kind = \"chain\", order = 2, a = [1, 1], b = 1, x0 = [1, 0] }\n\
                controller = { c = [5, 1], limits = { min = -0.1, max = 0.1 } }\n";
    let file = folder.file("weak.toml", text);
    let to = folder.path("o");
    let (status, out, _) = spoken(&["run", &file, "--out", &to]);
    assert_eq!(status, status::DONE);
    assert!(out.lines().any(|line| line.starts_with("bounded ") && line.contains(" NO ")), "{out}");
    let told = "result: NOT BOUNDED: |y| exceeded 1000 times its start and the settling band";
    assert!(out.contains(told), "{out}");
    let (_, out, _) = spoken(&["run", &file, "--json", "--out", &to]);
    let json = assert_is_run_json(&out);
    assert_eq!((&json["ending"], &json["metrics"]["bounded"]), (&Json::from("finished"), &Json::from(false)));
}

#[test]
fn trouble_that_the_controller_told_stands_in_the_table() {
    let folder = Folder::new("health");
    let sets = ["--set", "sensor.dropout=1", "--out", &folder.path("o")];
    let (_, out, _) = spoken(&[&SHORT[..], &sets[..]].concat());
    let row = out.lines().find(|line| line.starts_with("ticks with input rejected")).expect("a row");
    assert_eq!(row.split_whitespace().nth(4), Some("201"), "{row}");
    let (_, out, _) = spoken(&[&SHORT[..], &sets[..], &["--json"]].concat());
    let told = assert_is_run_json(&out);
    for (flag, count) in told["ticks_with"].as_object().expect("counts") {
        assert_eq!(*count, if flag == "input_rejected" { 201 } else { 0 }, "{flag}");
    }
}

#[test]
fn a_plant_too_fast_to_integrate_ends_with_status_1_and_keeps_its_record() {
    let folder = Folder::new("stiff");
    let term = |k: u32| format!("{{ kind = \"sin\", amplitude = 1, omega_rad_s = {} }}", f64::from(k) * 1e9);
    let fast: Vec<String> = (1..=9).map(term).collect();
    let file = folder.file(
        "fast.toml",
        // More frequencies than the exact step supports, so the solver integrates.
        &format!("[[plant.disturbance]]\nchannel = 1\nterms = [{}]", fast.join(", ")),
    );
    let (status, out, err) = spoken(&["run", &file, "--out", &folder.path("o")]);
    assert_eq!(status, status::FAILED);
    assert!(out.contains("result: BROKEN OFF at t = 0 s"), "{out}");
    assert!(err.starts_with("error: the plant is too fast for the period: 9.000e9 rad/s"), "{err}");
    assert_eq!(err.lines().count(), 1, "{err}");
    let csv = std::fs::read_to_string(folder.path("o/trace.csv")).expect("a trace");
    assert_eq!(csv.lines().count(), 2, "{csv}");
}

#[test]
fn bad_input_ends_with_status_2_one_line_on_stderr_and_nothing_written() {
    let folder = Folder::new("bad");
    let out_folder = folder.path("o");
    let file = folder.file("bad.toml", "[plant]\n[controller]\nkl = 3\n");
    let absent = folder.path("none.toml");
    let cases: [(&[&str], String); 4] = [
        (
            &["run", &file, "--out", &out_folder],
            format!("error: {file}:3:1: unknown key `controller.kl`; did you mean `k_l`?\n"),
        ),
        (&["run", &absent, "--out", &out_folder], format!("error: {absent}: there is no such file\n")),
        (
            &["--set", "plant.kind=chain", "--out", &out_folder],
            "error: --set plant.kind=chain: `plant.a`: missing: the coefficients a_1 .. a_n of the true a(x)\n\
             error: --set plant.kind=chain: `plant.b`: missing: the true input gain\n\
             error: --set plant.kind=chain: `plant.kind`: found \"chain\", but the file sets `plant.reading`, \
             `plant.parameters`, `plant.error`, `plant.input_disturbance`, only for \"flexible_joint\": start from a \
             file without these keys\n\
             error: --set plant.kind=chain: `plant.order`: missing: the order n of the chain, 2 to 6\n"
                .into(),
        ),
        (
            &["figures", "--only", "fig9", "--out", &out_folder],
            "error: --only fig9: there is no such figure; expected fig01 .. fig10, nearest is fig09\n".into(),
        ),
    ];
    for (args, message) in cases {
        assert_eq!(spoken(args), (status::BAD_INPUT, String::new(), message), "{args:?}");
    }
    assert!(!Path::new(&out_folder).exists());
}

/// A negative number is checked by its option, and is not parsed as an option.
#[test]
fn a_negative_value_is_told_what_its_option_takes() {
    for (args, expected) in [
        (&["map", "--corners", "-1"][..], "error: --corners -1: expected a number above 0 and below 100\n"),
        (&["commission", "--verify", "-1"], "error: --verify -1: expected a number above 0\n"),
        (&["tune", "--noise", "-0.1"], "error: --noise -0.1: expected a number above 0\n"),
    ] {
        assert_eq!(spoken(args), (status::BAD_INPUT, String::new(), expected.into()), "{args:?}");
    }
    assert!(spoken(&["monte-carlo", "--trials", "-5"]).2.starts_with("error: invalid value '-5' for '--trials <N>'"));
}

#[test]
fn wrong_usage_is_status_2_on_stderr_and_help_is_status_0_on_stdout() {
    for args in [&["bogus"][..], &["run"], &["--bogus"], &["new"], &["--json", "schema"]] {
        let (status, out, err) = spoken(args);
        assert_eq!((status, out.as_str()), (status::BAD_INPUT, ""), "{args:?}");
        assert!(err.starts_with("error: "), "{err}");
    }
    for args in [&["--help"][..], &["run", "--help"], &["--version"], &["schema"]] {
        let (status, out, err) = spoken(args);
        assert_eq!((status, err.as_str()), (status::DONE, ""), "{args:?}");
        assert!(!out.is_empty());
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_told_before_anything_is_computed() {
    let folder = Folder::new("unwritable");
    let below_a_file = format!("{}/o", folder.file("file", ""));
    for args in [&["--out", below_a_file.as_str()][..], &["figures", "--out", &below_a_file]] {
        let (status, out, err) = spoken(args);
        assert_eq!((status, out.as_str()), (status::BAD_INPUT, ""));
        assert_eq!(
            err,
            format!("error: output folder {below_a_file}: cannot be written: Not a directory (os error 20)\n")
        );
    }
}

#[test]
fn a_folder_that_another_run_writes_into_is_refused_by_name() {
    let folder = Folder::new("claimed");
    let to = folder.path("o");
    let claim = whole_file::claim(Path::new(&to)).expect("free");
    for args in [&["--out", to.as_str()][..], &["figures", "--only", "fig09", "--out", &to]] {
        let told = "another run is writing there; wait until it ends, or give another folder with --out";
        let message = format!("error: output folder {to}: {told}\n");
        assert_eq!(spoken(args), (status::BAD_INPUT, String::new(), message));
    }
    drop(claim);
    assert_eq!(spoken(&[&SHORT[..], &["--out", &to]].concat()).0, status::DONE);
}

#[test]
fn ctrl_c_keeps_what_was_recorded() {
    let folder = Folder::new("interrupted");
    let stop = AtomicBool::new(false);
    // The longest possible run: 2000 s at 1 ms take far more than 0.1 s.
    let args = ["--set", "span_s=2000", "--set", "window_s=[0, 2000]", "--out", &folder.path("o")];
    let (status, out, err) = std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(Duration::from_millis(100));
            stop.store(true, Ordering::Relaxed);
        });
        spoken_to(&args, &stop)
    });
    assert_eq!(status, status::INTERRUPTED);
    assert!(out.contains("\nresult: STOPPED at t = "), "{out}");
    assert_eq!(err, format!("stopped on request; the recorded data are in {}\n", folder.path("o")));
    let csv = std::fs::read_to_string(folder.path("o/trace.csv")).expect("a trace");
    let ticks = csv.lines().count() - 1;
    assert!((1..2_000_001).contains(&ticks), "{ticks}");
    let ended: f64 = csv.lines().last().and_then(|line| line.split(',').next()?.parse().ok()).expect("a time");
    // Ticks of 1 ms from 0, none missing; the product rounds.
    assert!((ended - 1e-3 * (ticks - 1) as f64).abs() < 1e-9, "{ended} {ticks}");
    assert_eq!(folder.names("o").len(), 6);
}

#[test]
fn ctrl_c_ends_the_figures_between_whole_files() {
    let folder = Folder::new("figures-interrupted");
    let args = ["figures", "--out", &folder.path("o")];
    let (status, out, err) = spoken_to(&args, &AtomicBool::new(true));
    assert_eq!((status, out.as_str()), (status::INTERRUPTED, ""));
    assert!(
        err.ends_with(&format!("stopped on request; the figures before fig01 are in {}\n", folder.path("o"))),
        "{err}"
    );
    assert_eq!(folder.names("o"), BTreeSet::new());
}

/// Stream that fails every write with this kind of error.
struct Broken(io::ErrorKind);

impl Write for Broken {
    fn write(&mut self, _bytes: &[u8]) -> io::Result<usize> {
        Err(self.0.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Err(self.0.into())
    }
}

#[test]
fn a_reader_that_went_away_is_no_error_and_the_files_are_written_all_the_same() {
    let folder = Folder::new("pipe");
    let status_of = |kind, to: &str, err: &mut dyn Write| {
        let console = Console { out: &mut Broken(kind), err, stop: &AtomicBool::new(false), terminal: false };
        run(["host-sim"].iter().chain(&SHORT).chain(&["--out", to]).map(OsString::from), console)
    };
    let mut err = Vec::new();
    assert_eq!(status_of(io::ErrorKind::BrokenPipe, &folder.path("o"), &mut err), status::DONE);
    assert_eq!((err.len(), folder.names("o").len()), (0, 6));
    // A full disk is an error.
    assert_eq!(status_of(io::ErrorKind::StorageFull, &folder.path("p"), &mut err), status::FAILED);
    assert_eq!(String::from_utf8_lossy(&err), "error: stdout cannot be written: no storage space\n");
    // A closed stderr is ignored.
    let quiet = status_of(io::ErrorKind::BrokenPipe, &folder.path("q"), &mut Broken(io::ErrorKind::BrokenPipe));
    assert_eq!(quiet, status::DONE);
}

#[test]
fn new_writes_a_scenario_that_runs_and_never_over_another() {
    let folder = Folder::new("new");
    let new_of = |name: &str, plant: &str| {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let stop = AtomicBool::new(false);
        let mut console = Console { out: &mut out, err: &mut err, stop: &stop, terminal: false };
        let answer =
            console.new_scenario(name, plant, &folder.0, "./it").map_err(|failure| (failure.status, failure.message));
        answer.map(|status| (status, String::from_utf8(out).expect("UTF-8")))
    };
    let new = |name: &str| new_of(name, "paper");
    let path = folder.path("mine.toml");
    assert_eq!(new("mine"), Ok((status::DONE, format!("wrote {path}; run it with: ./it run {path}\n"))));
    assert!(new_of("other", "chain").is_ok());
    let (_, out, _) = spoken(&["run", &folder.path("other.toml"), "--out", &folder.path("p"), "--set", "span_s=6"]);
    assert!(out.starts_with("other: Chain of order 3"), "{out}");
    let (status, out, err) = spoken(&[&["run", &path, "--out", &folder.path("o")], &SHORT[..]].concat());
    assert_eq!((status, err.as_str()), (status::DONE, ""));
    assert!(out.starts_with("mine: "), "{out}");

    std::fs::write(&path, "my work").expect("temporary file");
    for name in ["mine", "mine.toml"] {
        assert_eq!(new(name), Err((status::BAD_INPUT, format!("{path} already exists and was not changed"))));
    }
    assert_eq!(std::fs::read_to_string(&path).expect("a file"), "my work");
    for odd in ["", "..", "../mine", "a/b", ".hidden", ".toml", "a b"] {
        let refused = new(odd).expect_err(odd);
        assert_eq!(refused.0, status::BAD_INPUT);
        assert!(refused.1.contains("is not a valid name: use 1 to 64 letters"), "{}", refused.1);
    }
    assert_eq!(folder.names(""), ["mine.toml", "o", "other.toml", "p"].map(String::from).into());
}

#[test]
fn a_title_tells_what_set_changed_but_not_its_own_change() {
    let titled = |sets: &[&str]| {
        let mut title = "k_l = 50".to_owned();
        note_changes(&mut title, &sets.iter().map(ToString::to_string).collect::<Vec<_>>());
        title
    };
    assert_eq!(titled(&[]), "k_l = 50");
    assert_eq!(titled(&["name=x", "title = y"]), "k_l = 50");
    assert_eq!(titled(&["controller.k_l=9", "seed=1"]), "k_l = 50; set controller.k_l=9, seed=1");
    // The title stays one line for any input.
    assert_eq!(titled(&["window_s=[1,\n\t2] # \u{9b}x"]), "k_l = 50; set window_s=[1, 2] # x");
}

/// Target in this process that flips one bit of u in its 100th reply.
struct Flipping {
    inner: Loopback,
    receiver: pil_wire::Receiver<{ pil_wire::REPLY_LEN }>,
    ticks: u32,
}

impl Transport for Flipping {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.inner.send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> Result<usize, TransportError> {
        let count = self.inner.receive(into, within)?;
        for k in 0..count {
            let Some(frame) = self.receiver.push(into[k]) else { continue };
            if let (sequence, Some(Reply::Ticked(mut ticked))) = Reply::from_frame(&frame) {
                self.ticks += 1;
                if self.ticks == 100 {
                    ticked.u = f32::from_bits(ticked.u.to_bits() ^ 1);
                }
                into[k + 1 - frame.len()..=k].copy_from_slice(&Reply::Ticked(ticked).to_frame(sequence));
            }
        }
        Ok(count)
    }
}

#[test]
fn a_target_that_differs_in_one_bit_ends_the_run_with_status_1_and_names_it_and_the_record_is_kept() {
    let folder = Folder::new("differs");
    let sets = ["span_s=0.2", "window_s=[0.1, 0.2]"].map(String::from).to_vec();
    let run_with = |json| {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let stop = AtomicBool::new(false);
        let mut console = Console { out: &mut out, err: &mut err, stop: &stop, terminal: false };
        let options = RunOptions { sets: sets.clone(), out: Some(folder.0.join("o")), json, ..RunOptions::default() };
        let ended = default_scenario(&options.sets).and_then(|experiment| {
            let wire = Flipping { inner: Loopback::new(), receiver: pil_wire::Receiver::of_replies(), ticks: 0 };
            let download = for_target(&experiment).expect("one for a target");
            let link = console.linked(Box::new(wire), Duration::from_millis(50), download, None, |_| String::new())?;
            console.run(experiment, &options, "-pil", Some(link))
        });
        let Failure { status, message } = ended.expect_err("one bit differs");
        (status, message, String::from_utf8(out).expect("UTF-8"))
    };
    let (status, message, out) = run_with(false);
    assert_eq!(status, status::FAILED);
    let message = message.strip_prefix("tick 99: u differs: 0x").expect("tick and field");
    let patterns: Vec<&str> = message.split(", 0x").collect();
    let [there, here] = [0, 1].map(|k| u32::from_str_radix(&patterns[k][..8], 16).expect("8 digits"));
    assert_eq!(there ^ here, 1, "{message}");
    assert!(out.contains("\nresult: BROKEN OFF at t = 0.09900 s; 100 ticks, 1 bits differ ("), "{out}");
    let csv = std::fs::read_to_string(folder.path("o/trace.csv")).expect("a trace");
    assert_eq!(csv.lines().count(), 1 + 99, "the ticks before it");

    let (_, _, out) = run_with(true);
    let json = assert_is_run_json(&out);
    assert_eq!((&json["target"]["ticks"], &json["target"]["bits_differ"]), (&Json::from(100), &Json::from(1)));
    assert_eq!(json["ending"], "broken off");
}

#[test]
fn help_is_wrapped_and_a_shell_can_complete_it() {
    let (_, out, _) = spoken(&["budget", "--help"]);
    let longest = out.lines().map(|line| line.chars().count()).max();
    assert!(longest <= Some(100), "{longest:?}\n{out}");
    let (_, out, _) = spoken(&["pil", "--help"]);
    assert!(out.contains("--image <FILE>"), "{out}");
    for shell in ["bash", "zsh", "fish"] {
        let (status, out, err) = spoken(&["completions", shell]);
        assert_eq!((status, err.as_str()), (status::DONE, ""));
        assert!(out.contains("host-sim") && out.contains("ceilings") && out.contains("paper"), "{out}");
    }
}

#[test]
fn options_that_make_no_sense_are_wrong_usage() {
    let wrong: [&[&str]; 8] = [
        &["pil", "--faults", "0.5"],
        &["pil", "--faults", "NaN"],
        &["pil", "--seed", "3"],
        &["hil"],
        &["hil", "--port", "x", "--baud", "300"],
        &["hil", "--port", "x", "--log-port", "y"],
        &["emulate"],
        &["emulate", "--image", "x", "--seconds", "-1"],
    ];
    for args in wrong {
        let (status, out, err) = spoken(args);
        assert_eq!((status, out.as_str()), (status::BAD_INPUT, ""), "{args:?}");
        assert!(err.starts_with("error: "), "{err}");
    }
}

#[test]
fn the_longest_wait_stands_in_the_help() {
    let longest = format!("reply within {} s", link::remote::LONGEST_WAIT.as_secs());
    for command in ["pil", "hil"] {
        let (_, out, _) = spoken(&[command, "--help"]);
        assert!(out.contains(&longest), "{out}");
    }
    let (_, out, _) = spoken(&["pil", "--help"]);
    assert!(out.contains(&format!("start within {} s", cycle_bound::qemu::START_WITHIN.as_secs())), "{out}");
}

#[test]
fn export_goes_to_stdout_or_into_a_file_that_is_not_lost_by_a_slip() {
    let folder = Folder::new("export");
    let file = folder.path("controller.h");
    let (code, text, err) = spoken(&["export", "--paper", "--standalone"]);
    let unlimited = "warning: u has no limits: up to 1e12 may go out; set controller.limits={ min = .., max = .. }\n";
    assert_eq!((code, err.as_str()), (status::DONE, unlimited));
    // Reference text of the C file: u is the first word behind the address of the output.
    let (code, means, _) = spoken(&["export", "--paper", "--standalone", "--means", "tick", "--prefix", "left"]);
    assert!(code == 0 && means.starts_with("means 1\nfunction left_tick\n") && means.contains("\nout u number r2+0\n"));
    // Reference text of the assembly: u is the first word of the state.
    let scheduled = folder.path("tick_u.means");
    let asked = ["export", "--paper", "--asm", "--means", "tick_u", "--prefix", "left", "-o", &scheduled];
    assert_eq!(spoken(&asked).0, status::DONE);
    let means = std::fs::read_to_string(&scheduled).expect("the text");
    assert!(means.starts_with("means 1\nfunction left_tick_u\n") && means.contains("\nout held number r0+0\n"));
    let limited = ["export", "--paper", "--standalone", "--set", "controller.limits={ min = -300, max = 300 }"];
    assert_eq!(spoken(&limited).2, "");
    assert!(text.starts_with("/* ") && text.contains("edo_smc_tick(") && text.trim_end().ends_with("#endif"), "{text}");

    let (code, out, _) = spoken(&["export", "--paper", "--standalone", "-o", &file]);
    let whole = format!("wrote {file}: the whole controller as one C99 file, no library needed (`--lang c` without ");
    assert!(code == status::DONE && out.starts_with(&whole), "{out}");
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), text);
    let (code, out, err) = spoken(&["export", "--paper", "--lang", "rust", "-o", &file]);
    assert_eq!((code, out.as_str()), (status::BAD_INPUT, ""));
    assert!(err.contains("already exists and was not changed; --force overwrites it"), "{err}");
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), text);
    assert_eq!(spoken(&["export", "--paper", "--lang", "rust", "-o", &file, "--force"]).0, status::DONE);
    assert!(std::fs::read_to_string(&file).expect("the file").contains("pub static CONTROLLER"));
}

/// Creates a solver that gives one answer to every question; questions arrive on its input.
#[cfg(unix)]
fn solver_that_says(folder: &Folder, answer: &str) -> String {
    use std::os::unix::fs::PermissionsExt as _;
    let script = format!("#!/bin/sh\ncase \"$2\" in *Parser*) cat > /dev/null; echo {answer};; *) echo 1.2.3;; esac\n");
    let path = folder.file(answer, &script);
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("a program");
    path
}

/// `sha256sum` confirms the hash of the file. A statement that the solver does not prove is reported, and the command
/// fails.
#[cfg(unix)]
#[test]
fn a_certificate_is_about_the_file_beside_it() {
    let folder = Folder::new("certificate");
    let (c, certificate) = (folder.path("mine.h"), folder.path("mine.txt"));
    let export = ["export", "--paper", "--standalone", "-o", &c, "--certificate", &certificate, "--python"];
    let with = |python: &str, more: &[&str]| spoken(&[&export[..], &[python], more].concat());

    let (code, _, err) = with("no-python-here", &[]);
    assert!(code == status::BAD_INPUT && err.contains("pip install bitwuzla"), "{code} {err}");
    assert!(folder.names("").is_empty(), "nothing is written without a solver");

    let (code, out, err) = with(&solver_that_says(&folder, "unsat"), &[]);
    assert!(code == status::DONE && out.starts_with(&format!("wrote {c}: the whole controller as ")), "{out} {err}");
    assert!(out.ends_with(&format!("\nwrote {certificate}: proof certificate of the C file\n")), "{out}");
    let text = std::fs::read_to_string(&certificate).expect("a certificate");
    let check = std::process::Command::new("sha256sum").args(["--check", "mine.txt"]).current_dir(&folder.0).output();
    let check = check.expect("sha256sum");
    assert!(check.status.success() && check.stdout.starts_with(b"mine.h: OK"), "{check:?}");
    assert!(text.contains("Solver: Bitwuzla 1.2.3") && text.matches("  PROVED").count() >= 10, "{text}");

    let (code, _, err) = with(&solver_that_says(&folder, "sat"), &["--force"]);
    assert!(code == status::FAILED && err.contains("not every statement is proved"), "{code} {err}");
    let text = std::fs::read_to_string(&certificate).expect("a certificate");
    assert!(text.contains("refuted") && !text.contains("PROVED"), "{text}");
}

#[test]
fn a_reading_that_is_a_joint_is_exported_without_a_word_more() {
    let physical = ["--set", "plant.reading=physical", "--set", "controller.limits={ min = -30, max = 30 }"];
    for form in [&["--standalone"][..], &["--lang", "c"], &["--lang", "rust"]] {
        let (status, _, err) = spoken(&[&["export"], form, &physical].concat());
        assert_eq!((status, err.as_str()), (status::DONE, ""), "{form:?}");
    }
}

#[test]
fn nothing_without_limits_is_exported_or_designed_unless_that_is_said() {
    let told =
        "u has no limits: up to 1e12 may go out; set controller.limits={ min = .., max = .. }, or give --no-limits";
    let physical = ["--set", "plant.reading=physical"];
    for command in [&["export", "--standalone"][..], &["export", "--lang", "rust"], &["design"]] {
        let (code, out, err) = spoken(&[command, &physical].concat());
        assert_eq!((code, out.as_str()), (status::BAD_INPUT, ""), "{command:?}");
        assert!(err.contains(told), "{command:?}: {err}");
        assert_eq!(spoken(&[command, &physical, &["--no-limits"]].concat()).0, status::DONE, "{command:?}");
        let one = [&physical[..], &["--set", "controller.limits={ max = 30 }"]].concat();
        assert!(spoken(&[command, &one].concat()).2.contains("u has no lower limit"), "{command:?}");
    }
}

#[test]
fn export_says_what_is_wrong_with_its_arguments() {
    for (args, expected) in [
        (&["export"][..], "<--standalone|--lang <LANG>|--asm|--fmu <FILE>|--fmu-plant <FILE>>"),
        (&["export", "--asm"], "--output"),
        (&["export", "--asm", "--standalone", "-o", "it.S"], "cannot be used with"),
        (&["export", "--paper", "--asm", "-o", "it.h"], "name it .S, not .h"),
        (&["export", "--paper", "--standalone", "--means", "tock"], "no function `tock`; there are start, tick, "),
        (&["export", "--means", "tick", "--lang", "rust"], "cannot be used with"),
        (&["export", "--standalone", "--lang", "rust"], "cannot be used with"),
        (&["export", "--lang", "rusty"], "'rust'"),
        (&["export", "--standalone", "--prefix", "9"], "expected 1 to 32 of a-z, 0-9, `_`, a letter first"),
        (&["export", "--paper", "--lang", "rust", "--prefix", "mine"], "--prefix is for C"),
        (&["export", "--standalone", "--force"], "--output"),
        (&["export", "--standalone", "--certificate", "it.txt"], "--output"),
        (&["export", "--paper", "--standalone", "-o", "it.h", "--certificate", "it.h"], "a file of its own"),
        (&["export", "--fmu", "it.fmu", "--standalone"], "cannot be used with"),
        (&["export", "--paper", "--fmu", "it.fmu", "--fmu-plant", "it.fmu"], "a file of its own"),
        (&["export", "--paper", "--fmu", "nowhere/it.fmu"], "the folder nowhere does not exist"),
        (&["export", "--paper", "--fmu-plant", "it.fmu"], "motor or joint without play and supply"),
        (&["export", "--standalone", "nowhere.toml"], "nowhere.toml: there is no such file"),
        (&["export", "--standalone", "--set", "controller.epsilom=1"], "did you mean `epsilon`"),
        (&["export", "--paper", "--standalone", "--set", "controller.precision=f64"], "set controller.precision=f32"),
        (&["export", "--standalone"], "its input gain is not physical. Set plant.reading=physical, "),
        (
            &["export", "--lang", "c", "--set", "plant.reading=stiff"],
            "plant.reading = \"stiff\": only reproduces the paper's figures",
        ),
    ] {
        let (code, out, err) = spoken(args);
        assert_eq!((code, out.as_str()), (status::BAD_INPUT, ""), "{args:?}");
        assert!(err.contains(expected), "{args:?}: {err}");
    }
}

#[test]
fn a_motor_of_one_s_own_runs_from_its_file_and_says_how_the_reference_was_followed() {
    let folder = Folder::new("motor");
    let file = folder.file("mine.toml", scenario::MOTOR);
    let to = folder.path("o");
    let (status, out, err) = spoken(&["run", &file, "--out", &to]);
    assert_eq!((status, err.as_str()), (status::DONE, ""));
    let has = |start: &str| out.lines().any(|line| line.starts_with(start));
    assert!(has("position bandwidth 125 rad/s, limited by 0.80 ms of loop delay"), "{out}");
    for row in ["|y - r| peak (rad) ", "current noise, r moving (A rms) ", "|u| peak (A) ", "saturated ", "bounded "] {
        assert!(has(row), "{row}: {out}");
    }
    let expected = ["load.png", "load.svg", "response.png", "response.svg", "run.json", "trace.csv"];
    assert_eq!(folder.names("o"), expected.map(String::from).into());
    let csv = std::fs::read_to_string(folder.path("o/trace.csv")).expect("a trace");
    assert!(csv.starts_with("t_s,angle_rad,speed_rad_s,current_a,r,error,u,u_held,sigma,"), "{csv:.100}");

    let (_, out, _) = spoken(&["run", &file, "--json", "--out", &to]);
    let json = assert_is_run_json(&out);
    assert_eq!(keys(&json["tracking"]), BTreeSet::from(["error_rms", "arrival_s", "saturated_share"]));
    assert!(json["noise"]["moving"].as_f64().is_some_and(|noise| noise > 0.01) && json["noise"]["at_rest"].is_null());
}

/// What the archive designs a drive from is a constant with a name for each number, of a joint as a whole too, whose
/// gains no rule on the target finds.
#[test]
fn a_drive_is_exported_as_a_configuration_for_the_archive() {
    let folder = Folder::new("config");
    // A harmonic drive.
    let stiff: Vec<&str> = [
        "joint.stiffness_n_m=8000",
        "joint.gear=[100, 1]",
        "joint.motor_inertia_kg_m2=1.2e-4",
        "encoder.motor.bits=14",
    ]
    .iter()
    .flat_map(|set| ["--set", set])
    .collect();
    for (name, text, sets, kind, line) in [
        ("motor", scenario::MOTOR, &[][..], "motor", "        .inertia_kg_m2 = "),
        ("joint", scenario::JOINT, &[], "joint", "        .stiffness_n_m = 9.0,"),
        ("whole", scenario::JOINT, &stiff, "coupled", "        .resolution_rad = {"),
    ] {
        let file = folder.file(&format!("{name}.toml"), text);
        let export = [&["export", &file, "--lang", "c", "--prefix", "mine"][..], sets].concat();
        let (status, out, err) = spoken(&export);
        assert_eq!(status, status::DONE, "{err}");
        assert!(out.contains(&format!("static const edo_smc_config_{kind}_t mine_config = {{\n")), "{out}");
        assert!(out.lines().any(|of| of.starts_with(line)) && out.contains("    .stops_at = "), "{out}");
    }
}

/// What no configuration of the archive holds is refused, with what does hold it.
#[test]
fn a_drive_that_the_archive_does_not_carry_is_refused() {
    let folder = Folder::new("no-config");
    let file = folder.file("motor.toml", scenario::MOTOR);
    for (set, told) in [
        (&["drive.mode=speed", "reference={kind=\"speed\", speed_rad_s=20}"][..], "has no drive of a speed"),
        (&["drive.delay_ticks=2"], "has no drive of more than one tick of delay"),
        (&["drive.observer_states=4"], "has no motor with four states of its observer"),
        (&["monitor.load_n_m=0.1"], "makes the thresholds of its monitors by rule"),
    ] {
        let sets: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
        let (status, _, err) = spoken(&[&["export", &file, "--lang", "c"][..], &sets].concat());
        assert!(status == status::BAD_INPUT && err.contains(told) && err.contains("--standalone"), "{err}");
    }
}

#[test]
fn a_motor_and_a_joint_have_a_schema_of_their_own() {
    let schema = |plant: &str| spoken(&["schema", "--plant", plant]).1;
    assert_eq!(schema("paper"), spoken(&["schema"]).1);
    assert_eq!(schema("paper"), schema("chain"));
    assert_eq!(schema("paper"), schema("own"));
    assert!(schema("motor").contains("torque_n_m_per_a") && !schema("motor").contains("link_inertia_kg_m2"));
    assert!(schema("joint").contains("link_inertia_kg_m2") && !schema("joint").contains("k_s"));
    assert!(
        spoken(&["new", "x", "--plant", "pendulum"]).2.contains("[possible values: paper, motor, joint, chain, own]")
    );
}

#[test]
fn a_run_without_files_tells_all_the_same_and_leaves_nothing() {
    let folder = Folder::new("no-files");
    let (status, with, _) = spoken(&[&SHORT[..], &["--json", "--out", &folder.path("o")]].concat());
    assert_eq!(status, status::DONE);
    let kept = std::fs::read_to_string(folder.path("o/run.json")).expect("the answer");
    assert_eq!(with, kept);
    let before = std::fs::metadata("out").is_ok();
    let (status, without, _) = spoken(&[&SHORT[..], &["--json", "--no-files"]].concat());
    assert_eq!((status, without), (status::DONE, with));
    assert_eq!(std::fs::metadata("out").is_ok(), before);
    let (status, out, _) = spoken(&[&SHORT[..], &["--no-files"]].concat());
    assert!(status == status::DONE && !out.contains("files: "), "{out}");
    let (status, _, err) = spoken(&[&SHORT[..], &["--no-files", "--out", &folder.path("p")]].concat());
    assert!(status == status::BAD_INPUT && err.contains("--no-files"), "{err}");
}

#[test]
fn the_answer_has_what_was_set_and_which_design_ran() {
    let hash = |sets: &[&str]| {
        let given: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let (_, out, _) = spoken(&[&SHORT[..], &["--json", "--no-files"], &given].concat());
        let json = assert_is_run_json(&out);
        let told: Vec<&str> = json["sets"].as_array().expect("a list").iter().filter_map(Json::as_str).collect();
        assert!(told.ends_with(sets), "{told:?}");
        let hash = json["design_hash"].as_str().expect("a hash").to_owned();
        assert_eq!((hash.len(), u32::from_str_radix(&hash, 16).is_ok()), (8, true), "{hash}");
        hash
    };
    // The hash depends on the design only, not on the plant.
    assert_eq!(hash(&[]), hash(&["plant.x0=[0.05, 0, 0, 0]"]));
    assert_ne!(hash(&[]), hash(&["controller.k_l=90"]));
}

#[test]
fn fewer_ticks_and_every_state_on_request() {
    let folder = Folder::new("every");
    let (status, ..) = spoken(&[&SHORT[..], &["--every", "60", "--states", "--out", &folder.path("o")]].concat());
    assert_eq!(status, status::DONE);
    assert!(folder.names("o").contains("states.png") && folder.names("o").contains("states.svg"));
    let csv = std::fs::read_to_string(folder.path("o/trace.csv")).expect("a trace");
    let times: Vec<f64> =
        csv.lines().skip(1).map(|line| line.split(',').next().expect("t").parse().expect("t")).collect();
    // 0.2 s at 1 ms: ticks 0, 60, 120, 180 and the last one.
    assert_eq!(times.len(), 5, "{times:?}");
    assert!((times[1] - 0.06).abs() < 1e-12 && (times[4] - 0.2).abs() < 1e-12, "{times:?}");
    for bad in ["0", "-1", "x"] {
        let (status, _, err) = spoken(&[&SHORT[..], &["--no-files", &format!("--every={bad}")]].concat());
        assert!(status == status::BAD_INPUT && err.contains("--every"), "{err}");
    }
}

#[test]
fn the_results_of_another_scenario_are_left_alone() {
    let folder = Folder::new("another");
    let out = folder.path("o");
    let named = |name: &str| spoken(&[&SHORT[..], &["--set", &format!("name={name}"), "--out", &out]].concat());
    assert_eq!(named("first").0, status::DONE);
    let kept = std::fs::read(folder.path("o/trace.csv")).expect("a trace");
    let (status, said, err) = named("second");
    assert_eq!((status, said.as_str()), (status::BAD_INPUT, ""));
    assert!(err.contains("holds the results of scenario \"first\"") && err.contains("--out"), "{err}");
    assert_eq!(std::fs::read(folder.path("o/trace.csv")).expect("a trace"), kept);
    assert_eq!(named("first").0, status::DONE);
}

/// A controller that may be unstable is not exported. The message names the key that exports it anyway.
#[test]
fn a_drive_that_is_unstable_within_its_data_sheet_is_exported_with_consent_only() {
    let folder = Folder::new("unstable");
    // Stiffness of a harmonic drive.
    let stiff = folder.file("stiff.toml", &scenario::JOINT.replace("stiffness_n_m = 9.0", "stiffness_n_m = 8000.0"));
    let motor = folder.file("motor.toml", scenario::MOTOR);
    let joint: [&str; 6] =
        ["--set", "joint.gear=[100, 1]", "--set", "joint.motor_inertia_kg_m2=1.2e-4", "--set", "encoder.motor.bits=14"];
    // The coupled design, the default without drive.tuning, is stable.
    let output = folder.path("whole.h");
    let (status, _, err) = spoken(&[&["export", &stiff, "--standalone", "-o", &output][..], &joint].concat());
    assert_eq!(status, status::DONE, "{err}");
    let joint = [&joint[..], &["--set", "drive.tuning=normal"]].concat();
    let late = ["--set", "motor.current_lag_s=4e-3", "--set", "drive.surface_rad_s=80"];
    for (file, sets, words) in [
        (&stiff, joint, &["set drive.tuning = \"coupled\""][..]),
        (&motor, [&late[..], &["--set", "drive.gain_sets=1"]].concat(), &["1 of 4 corners", "set drive.surface_rad_s"]),
        (&motor, [&late[..3], &["drive.surface_rad_s=50"]].concat(), &["the high gains would be unstable"]),
    ] {
        let output = folder.path("a.h");
        let export = [&["export", file, "--standalone", "-o", &output][..], &sets].concat();
        let (status, out, err) = spoken(&export);
        assert_eq!((status, out.as_str()), (status::BAD_INPUT, ""), "{err}");
        assert!(words.iter().all(|words| err.contains(words)) && err.contains("drive.accept_unstable = true"), "{err}");
        assert!(!Path::new(&output).exists());
        let (status, _, err) = spoken(&[&export[..], &["--set", "drive.accept_unstable=true"]].concat());
        assert!(status == status::DONE && err.contains("warning: "), "{err}");
        std::fs::remove_file(&output).expect("a file");
    }
}

#[test]
fn a_map_is_a_table_of_points_two_pictures_and_what_may_be_promised() {
    let folder = Folder::new("map");
    let file = folder.file("m.toml", scenario::MOTOR);
    let axes = ["map", &file, "--x", "error.torque_percent=-90..500:12", "--y", "drive.surface_rad_s=20..500:log:3"];
    let (status, out, err) = spoken(&[&axes[..], &["--out", &folder.path("o")]].concat());
    assert_eq!((status, err.as_str()), (status::DONE, ""), "{out}");
    // The file sets no bandwidth: the bandwidth of the rule is its position on the axis.
    assert!(
        out.contains("36 points: ") && out.contains("guaranteed tolerance around the values of the file: error."),
        "{out}"
    );
    assert_eq!(folder.names("o"), ["map.csv", "map.png", "map.svg"].map(String::from).into());
    let csv = std::fs::read_to_string(folder.path("o/map.csv")).expect("the points");
    assert_eq!(csv.lines().count(), 37);
    assert!(csv.lines().all(|line| line.split(',').count() == 8), "{csv}");

    let figure = ["--figure", "design.margins.phase_deg", "--at-least", "30", "--json"];
    let (status, out, _) = spoken(&[&axes[..], &figure, &["--out", &folder.path("o")]].concat());
    assert_eq!(status, status::DONE);
    let json: Json = serde_json::from_str(&out).expect("JSON");
    let points = json["points"].as_array().expect("points");
    assert_eq!(points.len(), 36);
    // An unstable loop has no margins.
    assert!(points.iter().all(|point| point["figure"].is_f64() == (point["spectral_radius"].as_f64() < Some(1.0))));
    assert_eq!(json["axes"][1]["values"], serde_json::json!(["20", "100", "500"]));
}

#[test]
fn a_figure_of_a_run_is_that_of_the_run() {
    let folder = Folder::new("map-run");
    let file = folder.file("m.toml", scenario::MOTOR);
    let axes = ["--x", "error.torque_percent=0,20", "--y", "drive.period_s=1e-3", "--figure", "tracking.error_rms"];
    let (_, out, _) = spoken(&[&["map", &file, "--json", "--out", &folder.path("o")][..], &axes].concat());
    let map: Json = serde_json::from_str(&out).expect("JSON");
    for (k, percent) in ["0", "20"].iter().enumerate() {
        let set = format!("error.torque_percent={percent}");
        let (_, out, _) = spoken(&["run", &file, "--json", "--no-files", "--set", &set]);
        assert_eq!(map["points"][k]["figure"], assert_is_run_json(&out)["tracking"]["error_rms"]);
    }
}

/// The tolerance lies around the values of the file (also those by rule), not around them, or excludes them.
#[test]
fn what_is_promised_is_around_the_file_or_said_not_to_be() {
    let folder = Folder::new("promise");
    let (motor, joint) = (folder.file("m.toml", scenario::MOTOR), folder.file("j.toml", scenario::JOINT));
    let axes = ["--x", "drive.period_s=2e-4..2e-3:6", "--y", "drive.surface_rad_s=20..400:6"];
    let narrow = ["--x", "drive.period_s=2e-4..2e-3:6", "--y", "drive.surface_rad_s=20..60:3"];
    let words = ["--x", "drive.period_s=2e-4..2e-3:6", "--y", "drive.tuning=quiet,normal,firm"];
    let fast = ["--set", "drive.surface_rad_s=480", "--corners", "50"];
    for (file, args, expected) in [
        (&motor, [&axes[..], &[]].concat(), "guaranteed tolerance around the values of the file: drive.period_s from "),
        (&motor, [&narrow[..], &[]].concat(), "; the file has drive.surface_rad_s = 125.0, outside this range"),
        (&joint, [&words[..], &[]].concat(), "guaranteed tolerance around the values of the file: drive.period_s from"),
        (
            &motor,
            [&["--x", "drive.period_s=2e-4..2e-3:6", "--y", "drive.surface_rad_s=20..480:6"], &fast[..]].concat(),
            "no guaranteed tolerance around the values of the file: no point at drive.period_s = 0.00092, \
             drive.surface_rad_s = 480 is good",
        ),
    ] {
        let (status, out, err) = spoken(&[&["map", file, "--out", &folder.path("o")], &args[..]].concat());
        assert_eq!(status, status::DONE, "{err}");
        assert!(out.contains(expected), "{args:?}: {out}");
    }
}

#[test]
fn corners_are_told_one_by_one_the_worst_first() {
    let (status, out, _) = spoken(&["map", "--preset", "corners", "--set", "controller.k_l=10"]);
    assert_eq!(status, status::DONE);
    assert!(out.contains("8 of 32 corners at 50 % are unstable"), "{out}");
    // Both numbers of a row belong to one pole.
    let rows = out.lines().filter_map(|line| {
        let mut words = line.split_whitespace().rev().map(str::parse::<f64>);
        Some((words.next()?.ok()?, words.next()?.ok()?))
    });
    let rows: Vec<(f64, f64)> = rows.collect();
    assert_eq!(rows.len(), 32);
    assert!(rows.iter().all(|(decay, z)| (z - (-1e-3 * decay).exp()).abs() < 6e-6), "{out}");
    // First the unstable corners, the fastest growth first; then the stable ones by their peak of |S|.
    assert!(rows[..8].iter().all(|row| row.1 > 1.0) && rows[..8].is_sorted_by(|a, b| a.1 >= b.1), "{out}");
    let peaks = out.lines().filter_map(|line| line.split(" %  ").nth(1)?.split_whitespace().next());
    let peaks: Vec<f64> = peaks.map(|peak| peak.parse().unwrap_or(f64::INFINITY)).collect();
    assert!(peaks[..8].iter().all(|peak| peak.is_infinite()), "{peaks:?}");
    assert!(peaks.len() == 32 && peaks[8].is_finite() && peaks.is_sorted_by(|a, b| a >= b), "{peaks:?}");
}

/// An upright pendulum with a limit of u: every point is stable near rest, but from 0.5 rad the heavy pendulums fall.
#[test]
fn nothing_is_promised_where_the_run_did_not_come_to_its_end() {
    let folder = Folder::new("map-fallen");
    let own = scenario::STARTS.iter().find(|(name, _)| *name == "own").expect("a start").1;
    let file = folder.file("own.toml", own);
    let pendulum = ["--set", "plant.rates=[\"x2\",\"m*x1+u\"]", "--set", "controller.nominal={a=[0.0,0.0],b=1.0}"];
    let axes = ["--x", "plant.constants.m=0.5,1,60", "--y", "controller.k_l=20,50"];
    let map = |more: &[&str]| {
        let out = folder.path("o");
        spoken(&[&["map", &file, "--out", &out][..], &pendulum, &axes, more].concat())
    };
    let (status, told, err) = map(&["--figure", "metrics.y_ultimate"]);
    assert_eq!(status, status::DONE, "{err}");
    assert!(told.contains("6 points: 4 good, 0 unstable, 2 stable but outside the limit"), "{told}");
    assert!(told.contains("any of 0.5, 1 with"), "{told}");
    // The metric exists although the run of the file itself ends early.
    let (status, told, err) =
        map(&["--figure", "metrics.u_peak", "--set", "plant.x0=[30.0, 0.0]", "--set", "plant.constants.m=60"]);
    assert_eq!(status, status::DONE, "{told}{err}");
}

#[test]
fn what_cannot_be_mapped_is_told_before_anything_is_written() {
    let folder = Folder::new("map-bad");
    let motor = folder.file("m.toml", scenario::MOTOR);
    let chain = folder.file("c.toml", scenario::CHAIN);
    let example = folder.file("e.toml", "[plant]\nkind = \"benchmark\"\n[controller]\nc = [5, 1]\n");
    let out = folder.path("o");
    let axes = ["--x", "error.torque_percent=0..1:2", "--y", "drive.period_s=1e-3,2e-3"];
    for (args, told) in [
        (vec![&*motor], "nothing to sweep"),
        (vec![&motor, "--x", "a=0..1"], "--y"),
        (vec![&motor, "--x", "a=0..1", "--y", "a=1..2"], "both sweep a"),
        (vec![&motor, "--x", "a=0..1", "--y", "b=1..2"], "no point of the map has a valid design; first point: --set"),
        (vec![&motor, "--x", "a", "--y", "b=1..2"], "expected KEY=FROM..TO"),
        (vec![&motor, "--x", "a=1,2,1", "--y", "b=1..2"], "duplicate value 1"),
        (vec![&motor, "--preset", "plants"], "plant"),
        (vec![&motor, "--corners", "100"], "above 0 and below 100"),
        (vec![&motor, "--corners", "nan"], "above 0 and below 100"),
        (vec![&example, "--corners", "20"], "no uncertain parameters"),
        (vec![&example, "--preset", "gain"], "the preset sweeps plant.error.b, and"),
        (vec![&chain, "--preset", "plant"], "give two keys, as in --x plant.a[1]=-12..-3 --y plant.b=1..4"),
        (vec!["nowhere.toml", "--preset", "gain"], "nowhere.toml"),
        (vec![&motor, "--at-most", "1"], "--figure"),
        ([&[&*motor], &axes[..], &["--figure", "tracking.error"]].concat(), "did you mean tracking.error_rms?"),
    ] {
        let (status, _, err) = spoken(&[&["map", "--out", &out], &args[..]].concat());
        assert_eq!(status, status::BAD_INPUT, "{args:?}");
        assert!(err.contains(told), "{args:?}: {err}");
    }
    let (status, ..) = spoken_to(&[&["map", &motor, "--out", &out], &axes[..]].concat(), &AtomicBool::new(true));
    assert_eq!(status, status::INTERRUPTED);
    let left: Vec<String> = if folder.0.join("o").exists() { folder.names("o").into_iter().collect() } else { vec![] };
    assert_eq!(left, Vec::<String>::new());
}

#[test]
fn a_preset_sweeps_what_its_kind_of_plant_is_tuned_by() {
    let folder = Folder::new("map-kinds");
    // The fast tier tests every third case.
    let deep = std::env::var_os("DEEP").is_some_and(|value| value == "1");
    let sweeps = [
        (scenario::DEFAULT, "gain", ["plant.error.b", "controller.k_l"]),
        (scenario::MOTOR, "gain", ["error.torque_percent", "drive.reaching_per_s"]),
        (scenario::JOINT, "gain", ["error.torque_percent", "drive.reaching_per_s"]),
        (scenario::CHAIN, "gain", ["relative error of b", "controller.k_l"]),
        (scenario::OWN, "gain", ["relative error of b", "controller.k_l"]),
        (scenario::JOINT, "delay", ["joint.current_lag_s", "drive.reaching_per_s"]),
        (scenario::JOINT, "rate", ["drive.period_s", "drive.tuning"]),
        (scenario::JOINT, "plant", ["error.link_inertia_percent", "error.stiffness_percent"]),
    ];
    for (text, preset, keys) in sweeps.into_iter().step_by(if deep { 1 } else { 3 }) {
        let file = folder.file("it.toml", text);
        let (status, told, err) = spoken(&["map", &file, "--preset", preset, "--json", "--out", &folder.path("o")]);
        assert_eq!(status, status::DONE, "{err}");
        let json: Json = serde_json::from_str(&told).expect("JSON");
        assert_eq!([0, 1].map(|k| json["axes"][k]["key"].as_str()), keys.map(Some), "{preset}");
        // The map has stable and unstable points, and the values of the file are on the axes.
        let points = json["points"].as_array().expect("points");
        let stable = points.iter().filter(|point| point["spectral_radius"].as_f64().is_some_and(|it| it < 1.0)).count();
        assert!((points.len() / 20..points.len()).contains(&stable), "{preset}: {stable} of {}", points.len());
        assert!(json["promise"].is_array(), "{preset}: {}", json["promise"]);
    }
    let file = folder.file("it.toml", scenario::MOTOR);
    let brief = ["--set", "span_s=0.3", "--set", "friction={}", "--json", "--out", &folder.path("o")];
    let (status, told, err) = spoken(&[&["map", &file, "--preset", "jitter"], &brief[..]].concat());
    assert_eq!(status, status::DONE, "{err}");
    let json: Json = serde_json::from_str(&told).expect("JSON");
    assert_eq!(
        (json["axes"][0]["key"].as_str(), json["points"].as_array().map(Vec::len)),
        (Some("drive.jitter_s"), Some(289))
    );
    // Row by row: for each k_l, u varies more with more jitter.
    let moved = |k: usize| json["points"][k]["figure"].as_f64().expect("a number");
    assert!((0..17).all(|row| moved(17 * row + 16) > moved(17 * row)), "{told}");
}

#[test]
fn a_tuned_drive_is_a_file_that_runs_and_is_never_overwritten() {
    let folder = Folder::new("tune");
    let file = folder.file("m.toml", scenario::MOTOR);
    let (to, out) = (folder.path("t.toml"), folder.path("o"));
    let args = ["tune", &file, "--evaluations", "12", "--noise", "0.3", "--to", &to, "--out", &out];
    let (status, told, err) = spoken(&args);
    assert_eq!((status, err.as_str()), (status::DONE, ""), "{told}");
    assert!(told.contains("current noise (A rms)") && told.contains(&format!("wrote {to}\n")), "{told}");
    // For a motor, corners of ratios and of parameters agree, except for damping.
    assert!(told.contains("corners of ±20 % of J, K_t") && told.contains("tolerance of all data sheet"), "{told}");
    assert_eq!(folder.names("o"), ["pareto.png", "pareto.svg"].map(String::from).into());
    let written = std::fs::read_to_string(&to).expect("the file");
    assert!(["surface_rad_s = ", "\nobserver_rad_s = ", "\ngain_sets = "].iter().all(|key| written.contains(key)));
    // The rest of the file is unchanged, with its comments.
    assert!(scenario::MOTOR.lines().filter(|line| line.starts_with('[')).all(|line| written.contains(line)));
    assert_eq!(spoken(&["run", &to, "--no-files"]).0, status::DONE);

    let (status, _, err) = spoken(&args);
    assert_eq!(status, status::BAD_INPUT);
    assert!(err.contains("already exists and was not changed"), "{err}");
    assert_eq!(std::fs::read_to_string(&to).expect("the file"), written);
}

#[test]
fn what_cannot_be_reached_is_told_and_nothing_is_written() {
    let folder = Folder::new("tune-no");
    let file = folder.file("m.toml", scenario::MOTOR);
    let (to, out) = (folder.path("t.toml"), folder.path("o"));
    let args = ["tune", &file, "--evaluations", "6", "--load", "1e-9", "--to", &to, "--out", &out];
    let (status, told, err) = spoken(&args);
    assert_eq!(status, status::FAILED);
    assert!(told.contains("NOT MET") && err.contains("not met: load"), "{told}{err}");
    // The specification that the message offers can be met.
    let offered = err.split("--load ").nth(1).and_then(|it| it.split(". Relax").next()?.parse::<f64>().ok());
    let load = format!("{}", 1.05 * offered.expect("an offer"));
    let to_offered = folder.path("offered.toml");
    let again = ["tune", &file, "--evaluations", "6", "--load", &load, "--to", &to_offered, "--out", &out];
    assert_eq!(spoken(&again).0, status::DONE, "--load {load} of {err}");
    let (status, told, _) = spoken(&[&args[..], &["--json"]].concat());
    assert_eq!(status, status::FAILED);
    let json: Json = serde_json::from_str(&told).expect("JSON");
    assert_eq!((json["missed"][0].as_str(), json["written"].as_str()), (Some("load"), None));
    assert_eq!(json["pareto"].as_array().map(Vec::len), Some(6));
    assert!(!folder.0.join("t.toml").exists());
    // A recovery that never settles in a corner is a failure, also without a limit.
    let lost = ["--noise", "0.02", "--uncertain", "50", "--evaluations", "9", "--to", &to, "--out", &out];
    let (status, told, err) = spoken(&[&["tune", &file], &lost[..]].concat());
    assert_eq!(status, status::FAILED, "{told}{err}");
    assert!(err.contains("not met: settling (lost in 4 of 9 plants, first: J -50 %, K_t +50 %); no file"), "{err}");
    let settling = told.lines().find(|line| line.starts_with("settling")).expect("a row");
    assert!(settling.contains(" lost ") && settling.ends_with(" NOT MET"), "{told}");
    assert!(!folder.0.join("t.toml").exists());
    let of_motor = study::chip::cost("motor").expect("a motor");
    let dear = format!("a tick of this drive takes up to {} cycles with one gain set", of_motor.bound);
    for (more, told) in [
        (["--noise", "0"], "expected a number above 0"),
        (["--load", "nan"], "expected a number above 0"),
        (["--cycles", "400"], dear.as_str()),
        (["--uncertain", "30"], "30"),
        (["--evaluations", "1"], "1"),
    ] {
        let (status, _, err) = spoken(&[&["tune", &file, "--to", &to, "--out", &out], &more[..]].concat());
        assert_eq!(status, status::BAD_INPUT, "{more:?}");
        assert!(err.contains(told), "{more:?}: {err}");
    }
    let chain = folder.file("c.toml", scenario::CHAIN);
    let (status, _, err) = spoken(&["tune", &chain]);
    assert_eq!(status, status::BAD_INPUT);
    assert!(err.contains("neither [joint] nor [motor]"), "{err}");
}

#[test]
fn all_plants_of_a_data_sheet_commission_themselves_and_write_nothing() {
    let folder = Folder::new("within");
    let file = folder.file("m.toml", scenario::MOTOR);
    let to = folder.file("t.toml", "mine");
    let args = ["commission", &file, "--within", "50", "--random", "2", "-o", &to];
    let (status, told, err) = spoken(&args);
    assert_eq!((status, err.as_str()), (status::DONE, ""), "{told}");
    assert!(told.ends_with("result: 10 of 10 plants accepted\n") && told.contains("b, relative error"), "{told}");
    // Every row has a value.
    assert!(told.lines().filter(|line| !line.starts_with('-')).all(|line| !line.ends_with('-')), "{told}");
    let (status, told, _) = spoken(&[&args[..], &["--wrong", "1.2,1"]].concat());
    assert_eq!(status, status::FAILED);
    assert!(told.contains("plant 9: REJECTED") && told.ends_with("result: 0 of 10 plants accepted\n"), "{told}");
    assert_eq!(std::fs::read_to_string(&to).expect("the file"), "mine");
}

#[test]
fn a_record_becomes_a_scenario_that_runs() {
    let folder = Folder::new("identify");
    let file = folder.file("j.toml", scenario::JOINT);
    let text = include_str!("../../../tests/data/identify_joint_20bit.csv");
    let data = folder.file("r.csv", text);
    let (to, out) = (folder.path("t.toml"), folder.path("o"));
    let args =
        ["identify", &data, &file, "--set", "joint.current_lag_s=0", "--cogging", "24", "-o", &to, "--out", &out];
    let (status, told, err) = spoken(&args);
    assert_eq!((status, err.as_str()), (status::DONE, ""), "{told}");
    assert!(told.contains("stiffness / link inertia") && told.contains(&format!("wrote {to}\n")), "{told}");
    assert_eq!(folder.names("o"), ["identified.png", "identified.svg"].map(String::from).into());
    let written = std::fs::read_to_string(&to).expect("the file");
    // The stiffness is half of 9 N m/rad; the friction is 1 A.
    assert!(written.contains("\nstiffness_n_m = 4.5 ") && written.contains("coulomb_n_m = 0.0"), "{written}");
    assert_eq!(spoken(&["run", &to, "--no-files"]).0, status::DONE);
    let (status, _, err) = spoken(&args);
    assert_eq!(status, status::BAD_INPUT);
    assert!(err.contains("already exists and was not changed"), "{err}");

    // A figure that cannot be written does not lose the result.
    std::fs::create_dir_all(folder.0.join("p").join("identified.png")).expect("a folder in the way");
    let (late, in_the_way) = (folder.path("late.toml"), folder.path("p"));
    let (status, told, err) =
        spoken(&["identify", &data, &file, "--set", "joint.current_lag_s=0", "-o", &late, "--out", &in_the_way]);
    assert!(status != status::DONE && err.contains("identified cannot be written"), "{err}");
    assert!(told.contains(&format!("wrote {late}\n")) && folder.0.join("late.toml").is_file(), "{told}");

    let other = folder.path("u.toml");
    let spoilt = folder.file("s.csv", &text.replacen("\n200,", "\n", 1));
    let strict = ["--tolerance", "40"];
    // Without the column of the link, the recording is usable with --motor-alone.
    let cut = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        [&cells[..1], &cells[2..]].concat().join(",") + "\n"
    };
    let alone = folder.file("m.csv", &text.lines().map(cut).collect::<String>());
    let motor = folder.file("m.toml", scenario::MOTOR);
    let from_motor = |file: &str, more: &[&str]| {
        let to = folder.path("v.toml");
        let args = ["identify", &alone, file, "--cogging", "24", "--set", "joint.current_lag_s=0", "-o", &to];
        spoken(&[&args[..], &["--out", &out], more].concat())
    };
    let (status, told, err) = from_motor(&file, &["--motor-alone"]);
    assert_eq!((status, err.as_str()), (status::DONE, ""), "{told}");
    assert!(told.contains("stiffness / link inertia") && !told.contains("weight"), "{told}");
    let written = std::fs::read_to_string(folder.path("v.toml")).expect("the file");
    assert!(written.contains("\nweight_n_m = 0.23"), "{written}");
    let (status, _, err) = spoken(&["identify", &alone, &motor, "--motor-alone", "-o", &other, "--out", &out]);
    assert_eq!(status, status::BAD_INPUT);
    assert!(err.contains("--motor-alone is for a [joint]"), "{err}");
    for (data, more, told) in [
        (&data, &strict[..], "k_1 is -50 % from the data sheet (limit 40 %)"),
        (&data, &["--cogging", "0"], "--cogging 0"),
        (&spoilt, &[], ":202:"),
        (&alone, &[], ":1:1: no column count_link (for a joint without it use --motor-alone; for a motor recording"),
        (&file, &[], ":1:1: no column tick"),
    ] {
        let (status, told_too, err) = spoken(&[&["identify", data, &file, "-o", &other, "--out", &out], more].concat());
        assert_eq!(status, status::BAD_INPUT, "{more:?} {told_too}");
        assert!(err.contains(told), "{more:?}: {err}");
    }
    let (_, _, err) = spoken(&["identify", &file, &data, "-o", &other]);
    assert!(err.contains("expected a scenario, this is a recording, the first argument of `identify"), "{err}");
    let (_, _, err) = spoken(&["commission", &file, "--faults", "0.05", "-o", &other]);
    assert!(err.contains("--faults needs a target"), "{err}");
    assert!(!folder.0.join("u.toml").exists());
}

#[test]
fn plants_that_were_tried_are_json_too() {
    let folder = Folder::new("within");
    let file = folder.file("m.toml", scenario::MOTOR);
    let (status, told, err) =
        spoken(&["commission", &file, "--within", "20", "--random", "1", "--json", "--set", "encoder.bits=14"]);
    assert_eq!((status, err.as_str()), (status::DONE, ""), "{told}");
    let json: Json = serde_json::from_str(&told).expect("JSON");
    assert_eq!((&json["corners"], &json["accepted"]), (&8.into(), &9.into()), "{told}");
    let plants = json["plants"].as_array().expect("plants");
    assert!(plants.len() == 9 && plants.iter().all(|it| it["errors"]["b"].as_f64().is_some_and(|off| off.abs() < 0.1)));
}

#[test]
fn a_joint_commissions_itself_and_tells_each_step() {
    let folder = Folder::new("commission");
    let file = folder.file("j.toml", scenario::JOINT);
    let (to, out) = (folder.path("t.toml"), folder.path("o"));
    let error = "error={stiffness_percent = -40, torque_percent = 20}";
    // The file has a load that steps during the recording.
    let (status, told, err) = spoken(&["commission", &file, "--set", error, "-o", &to, "--out", &out]);
    assert_eq!(status, status::DONE, "{told}{err}");
    assert!(err.starts_with("note: the loads of the file are left out: one steps"), "{err}");
    for step in ["record ", "identify", "switch ", "verify ", "home ", "result: accepted"] {
        assert!(told.lines().any(|line| line.starts_with(step)), "{step}: {told}");
    }
    let written = std::fs::read_to_string(&to).expect("the file");
    let spring =
        written.lines().find_map(|line| line.strip_prefix("stiffness_n_m = ")?.split(' ').next()?.parse().ok());
    assert!((spring.unwrap_or(0.0) / 5.4 - 1.0_f64).abs() < 1e-4, "{written}");
    assert_eq!(folder.names("o").len(), 4);
    // Missing counts: the recording is rejected, and no file is written.
    let other = folder.path("u.toml");
    let lost = "fault=[{kind = \"lost\", at_s = 1.0, for_s = 0.003}]";
    let (status, _, err) = spoken(&["commission", &file, "--set", lost, "-o", &other, "--out", &out]);
    assert_eq!(status, status::FAILED);
    assert!(err.contains("a count was lost at 1.0") && !folder.0.join("u.toml").exists(), "{err}");
    let (status, _, err) = spoken(&["commission", &folder.file("c.toml", scenario::CHAIN)]);
    assert_eq!(status, status::BAD_INPUT);
    assert!(err.contains("neither [joint] nor [motor]"), "{err}");
    // 10 bits behind a gear of 100 give less information than the data sheet.
    let coarse = "[motor]\ninertia_kg_m2 = 2e-5\ntorque_n_m_per_a = 0.03\nmax_current_a = 5.0\ngear = [100, 1]\n\
                  load_inertia_kg_m2 = 0.3\n[encoder]\nbits = 10\nbehind_gear = true\n[drive]\nperiod_s = 5e-3\n";
    let (status, _, err) = spoken(&["commission", &folder.file("m.toml", coarse), "-o", &other, "--out", &out]);
    assert_eq!(status, status::FAILED);
    assert!(err.contains("b identified to +-") && !folder.0.join("u.toml").exists(), "{err}");
}

/// Names or texts in pairs: of a command or of an option.
type Pairs = Vec<(String, String)>;

/// Returns the long help of every command: the name, the text of the command, and the text of each option.
fn helps() -> Vec<(String, String, Pairs)> {
    let command = Cli::command();
    let of = |command: &clap::Command| {
        let said = |text: Option<&clap::builder::StyledStr>| text.map(ToString::to_string).unwrap_or_default();
        let options = command
            .get_arguments()
            .map(|option| (option.get_id().to_string(), said(option.get_long_help().or(option.get_help()))));
        (command.get_name().to_owned(), said(command.get_long_about()), options.collect())
    };
    command.get_subcommands().map(of).collect()
}

/// Returns the settings of the examples in the help of an option.
fn settings(help: &str) -> Vec<String> {
    let examples = help.split_once("Example: ").map_or("", |(_, examples)| examples);
    let after = examples.split("--set ").skip(1).filter_map(|rest| rest.split_whitespace().next());
    after.map(|set| set.trim_end_matches(['.', ',']).to_owned()).collect()
}

#[test]
fn an_example_of_a_setting_fits_a_template_and_a_command_for_every_plant_has_one_for_each() {
    let fits = |text: &str, set: &String| {
        scenario::parse(&Source { file: "it", text, sets: std::slice::from_ref(set) }, "it").is_ok()
    };
    let mut count = 0;
    for (command, _, options) in helps() {
        for (_, help) in options.iter().filter(|(id, _)| id == "sets") {
            let examples = settings(help);
            assert!(!examples.is_empty(), "{command}: {help}");
            count += examples.len();
            for set in &examples {
                let fitting = scenario::STARTS.iter().filter(|(_, text)| fits(text, set));
                assert!(fitting.count() > 0, "{command}: --set {set} fits no template");
            }
            let plants: &[&str] = match command.as_str() {
                // Its help has an example for drives alone.
                "design" | "replay" | "tune" => &[],
                "identify" | "commission" | "compare" => &["motor", "joint"],
                _ => &["paper", "motor", "joint", "chain", "own"],
            };
            for (plant, text) in scenario::STARTS.iter().filter(|(plant, _)| plants.contains(plant)) {
                assert!(examples.iter().any(|set| fits(text, set)), "{command}: no example for {plant}: {examples:?}");
            }
        }
    }
    assert!(count > 15, "{count} examples");
}

#[test]
fn the_example_of_every_command_parses_and_runs_on_a_template() {
    let folder = Folder::new("examples");
    folder.file("record.csv", include_str!("../../../tests/data/identify_joint_20bit.csv"));
    let mut ran = BTreeSet::new();
    for (command, help, _) in helps() {
        let examples = help.lines().filter(|line| line.starts_with("Example"));
        for example in examples.filter_map(|line| Some(line.split_once("host-sim ")?.1)) {
            let line = example.split(" > ").next().expect("a command");
            let words: Vec<&str> = line.split_whitespace().collect();
            let parsed = Cli::try_parse_from(["host-sim"].iter().chain(&words));
            assert!(parsed.is_ok(), "host-sim {line}: {}", parsed.expect_err("an error"));
            // They need a board, an emulator, a firmware or a browser; `new` has its own test.
            if ["pil", "hil", "budget", "new", "view"].contains(&command.as_str()) {
                continue;
            }
            let shorter: &[&str] = if command == "tune" { &["--evaluations", "6"] } else { &[] };
            let mut told = Vec::new();
            for (plant, text) in scenario::STARTS {
                let named = |name: &str| folder.path(&format!("{plant}-{name}"));
                folder.file(&format!("{plant}-mine.toml"), text);
                let placed = words.iter().map(|word| match *word {
                    "mine.toml" | "drive.h" => named(word),
                    "record.csv" => folder.path(word),
                    "~/.local/share/man/man1" => folder.path(""),
                    "10000" => "20".into(),
                    _ => (*word).to_owned(),
                });
                let mut placed: Vec<String> = placed.collect();
                if matches!(command.as_str(), "run" | "map" | "monte-carlo" | "tune" | "identify" | "commission") {
                    placed.extend(["--out".into(), named("out")]);
                }
                if matches!(command.as_str(), "tune" | "identify" | "commission") {
                    placed.extend(["--to".into(), named(&format!("{command}.toml"))]);
                }
                let args: Vec<&str> = placed.iter().map(String::as_str).chain(shorter.iter().copied()).collect();
                let (status, _, err) = spoken(&args);
                // With so few evaluations a limit may stay unmet.
                if status == status::DONE || (command == "tune" && status == status::FAILED) {
                    ran.insert(command.clone());
                    break;
                }
                told.push(format!("{plant}: {err}"));
            }
            assert!(ran.contains(&command), "host-sim {line}: {told:#?}");
        }
    }
    let expected =
        ["commission", "completions", "design", "export", "identify", "man", "map", "monte-carlo", "run", "tune"];
    assert!(expected.iter().all(|command| ran.contains(*command)), "{ran:?}");
}

#[test]
fn a_drive_with_one_gain_set_is_reported_without_high_gains() {
    let folder = Folder::new("one-set");
    let file = folder.file("j.toml", scenario::JOINT);
    let page = folder.path("page.html");
    let coupled = ["--set", "drive.tuning=coupled", "--set", "span_s=0.2"];
    for (set, says) in [("drive.gain_sets=2", true), ("drive.gain_sets=1", false)] {
        let sets = [&coupled[..], &["--set", set]].concat();
        let (status, out, err) = spoken(&[&["run", &file, "--no-files"], &sets[..]].concat());
        assert!(status == status::DONE && out.contains("in the worst corner"), "{out}{err}");
        assert_eq!(out.contains("high gains"), says, "{out}");
        let (status, _, err) =
            spoken(&[&["report", &file, "--map", "none", "-o", &page, "--force"], &sets[..]].concat());
        assert_eq!(status, status::DONE, "{err}");
        assert_eq!(std::fs::read_to_string(&page).expect("a page").contains("(high gains"), says);
    }
}
