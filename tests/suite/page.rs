//! Reports in a browser: no errors, every chart drawn, zoom by mouse, selectable text.
//!
//! The browser is real and runs without a screen. A script appended to the page inspects it and leaves its result in
//! the title.

use integration_tests::program::{Folder, host_sim};
use serde_json::Value;
use std::process::{Command, Output};

const BROWSER: &str = "chromium";

/// Script that collects the visible result: charts with ink, and their state after a drag over the first chart.
const ASKED: &str = r#"<script>
  window.addEventListener("load", () => setTimeout(() => {
    const canvases = [...document.querySelectorAll(".chart canvas")];
    // Read from a copy, so that the reading does not change the drawing.
    const pixels = canvas => {
      const { width, height } = canvas;
      const copy = Object.assign(document.createElement("canvas"), { width, height });
      const context = copy.getContext("2d", { willReadFrequently: true });
      context.drawImage(canvas, 0, 0);
      return context.getImageData(0, 0, width, height).data;
    };
    const colored = canvas => {
      const data = pixels(canvas);
      let count = 0;
      for (let k = 0; k < data.length; k += 4)
        count += data[k + 3] > 0 && Math.max(data[k], data[k + 1], data[k + 2]) -
          Math.min(data[k], data[k + 1], data[k + 2]) > 60;
      return count;
    };
    const hash = canvas => pixels(canvas).reduce((sum, value, k) => (sum + value * (k % 251 + 1)) % 1000000007, 0);
    const ink = canvases.map(colored), before = canvases.map(hash);
    const over = document.querySelector(".chart .u-over"), box = over.getBoundingClientRect();
    const mouse = (kind, share) => over.dispatchEvent(new MouseEvent(kind, { bubbles: true, buttons: 1, button: 0,
      clientX: box.left + share * box.width, clientY: box.top + 0.5 * box.height, movementX: 9, movementY: 0 }));
    mouse("mouseenter", 0.2); mouse("mousemove", 0.2); mouse("mousedown", 0.2); mouse("mousemove", 0.4);
    setTimeout(() => {
      mouse("mousemove", 0.6); mouse("mouseup", 0.6);
      setTimeout(() => {
        getSelection().selectAllChildren(document.body);
        const stills = [...document.querySelectorAll(".still")];
        document.title = JSON.stringify({ charts: document.querySelectorAll(".chart").length, ink,
          changed: canvases.map((canvas, k) => hash(canvas) !== before[k]),
          groups: canvases.map(canvas => [...document.querySelectorAll(".charts")].indexOf(canvas.closest(".charts"))),
          selected: getSelection().toString(), shown: stills.filter(it => it.offsetHeight > 0).length,
          asked: performance.getEntriesByType("resource").map(it => it.name) });
      }, 200);
    }, 100);
  }, 100));
</script>"#;

fn browser(folder: &Folder) -> Command {
    let mut browser = Command::new(BROWSER);
    browser
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .arg(format!("--user-data-dir={}", folder.path("profile")));
    browser
}

fn of_browser(command: &mut Command) -> Output {
    command
        .output()
        .unwrap_or_else(|error| panic!("{BROWSER} does not start ({error}): `cargo xtask setup` installs it"))
}

/// Opens a page; returns the browser's errors and the final page.
fn opened(folder: &Folder, html: &str) -> (Vec<String>, String) {
    let file = folder.path("asked.html");
    std::fs::write(&file, html).expect("room for a page");
    let output = of_browser(
        browser(folder)
            .args(["--window-size=1280,1000", "--virtual-time-budget=20000", "--enable-logging=stderr", "--dump-dom"])
            .arg(format!("file://{file}")),
    );
    let words = String::from_utf8_lossy(&output.stderr);
    let told = words.lines().filter(|line| line.contains(":CONSOLE")).map(Into::into).collect();
    (told, String::from_utf8_lossy(&output.stdout).into_owned())
}

fn answer(dom: &str) -> Value {
    let (_, rest) = dom.split_once("<title>").expect("a title");
    let title = rest.split_once("</title>").expect("its end").0;
    let title = title.replace("&lt;", "<").replace("&gt;", ">").replace("&nbsp;", " ").replace("&amp;", "&");
    serde_json::from_str(&title).unwrap_or_else(|error| panic!("no answer ({error}): {title}"))
}

#[test]
fn a_report_of_two_drives_is_drawn_zoomed_and_read() {
    let folder = Folder::new("page");
    let scenarios = ["motor", "joint"].map(|plant| {
        let file = folder.path(&format!("my-{plant}.toml"));
        let text = if plant == "motor" { scenario::MOTOR } else { scenario::JOINT };
        std::fs::write(&file, text).expect("room for a scenario");
        file
    });
    let page = folder.path("both.html");
    let [motor, joint] = &scenarios;
    let said = host_sim(&["report", motor, joint, "--map", "none", "-o", &page]);
    assert_eq!((said.status, said.err.as_str()), (0, ""), "{said:?}");
    let html = std::fs::read_to_string(&page).expect("the page");
    let (told, dom) = opened(&folder, &html.replace("</body>", &format!("{ASKED}</body>")));
    assert_eq!(told, Vec::<String>::new());
    let found = answer(&dom);
    let charts = found["charts"].as_u64().expect("a count") as usize;
    let ink: Vec<u64> = found["ink"].as_array().expect("inks").iter().filter_map(Value::as_u64).collect();
    assert!(charts > 8 && ink.len() == charts, "{charts} charts, ink {ink:?}");
    // A curve one pixel wide across 400 pixels.
    assert!(ink.iter().all(|ink| *ink > 300), "{ink:?}");
    // The charts of the first chart's group zoomed with it, and no other did.
    let list = |key: &str| found[key].as_array().expect(key).clone();
    for (k, (changed, group)) in list("changed").iter().zip(list("groups")).enumerate() {
        assert_eq!(changed.as_bool(), Some(group == 0), "chart {k}: {found}");
    }
    let selected = found["selected"].as_str().expect("a text");
    let of_joint = study::chip::cost("joint with two encoders, two sets");
    let bound = of_joint.expect("a joint").bound.to_string();
    for words in ["hash of the design", "phase margin", "my-motor", "WCET bound", &bound] {
        assert!(selected.contains(words), "{words}: {selected}");
    }
    assert_eq!((&found["shown"], list("asked").len()), (&Value::from(0), 0), "{found}");

    // Without scripts the static drawings remain, and a script error is reported.
    let (told, _) = opened(&folder, "<script>undefined_function()</script>");
    assert_eq!(told.len(), 1, "{told:?}");
}

/// A report with map, trials and certificate. On paper the static drawings replace the charts, and folded sections
/// open.
#[test]
fn a_report_with_all_its_parts_is_read_and_printed() {
    let folder = Folder::new("page-print");
    let [file, trials, certificate, page, paper] =
        ["my-motor.toml", "trials", "my-motor.txt", "page.html", "page.pdf"].map(|name| folder.path(name));
    std::fs::write(&file, scenario::MOTOR).expect("room for a scenario");
    let proved =
        "u within its limits and that of the stage, any bits in counts, targets and state               PROVED";
    let source = scenario::Source { file: "my-motor.toml", text: scenario::MOTOR, sets: &[] };
    let design = scenario::parse(&source, "my-motor").expect("a scenario").port.fingerprint().expect("a drive");
    let text = format!("Certificate\n\nDesign: {design:08x}\n{proved}\n");
    std::fs::write(&certificate, &text).expect("room for a certificate");
    let said = host_sim(&["monte-carlo", &file, "--uncertain", "20", "--trials", "20", "--out", &trials]);
    assert_eq!(said.status, 0, "{said:?}");
    let other = ["report", &file, "--map", "none", "--certificate", &certificate, "--set", "monitor.load_n_m=1"];
    let said = host_sim(&other);
    let told = format!("--certificate: {certificate} is of design {design:08x}, expected ");
    assert!(said.status == 2 && said.err.contains(&told), "a certificate of other monitors: {said:?}");
    let said = host_sim(&["report", &file, "--trials", &trials, "--certificate", &certificate, "-o", &page]);
    assert_eq!((said.status, said.err.as_str()), (0, ""), "{said:?}");
    // State of the page after the browser announces printing.
    let print = "<script>window.addEventListener('load', () => { dispatchEvent(new Event('beforeprint')); \
                 getSelection().selectAllChildren(document.body); \
                 document.title = JSON.stringify(getSelection().toString()); });</script>";
    let html = std::fs::read_to_string(&page).expect("the page");
    let (told, dom) = opened(&folder, &html.replace("</body>", &format!("{print}</body>")));
    assert_eq!(told, Vec::<String>::new());
    let text = answer(&dom);
    let text = text.as_str().expect("a text");
    let tolerance = "guaranteed tolerance";
    for words in ["Stability map", tolerance, "20 trials, seed 1", "p99.9", proved, "inertia_kg_m2 = 2e-4"] {
        assert!(text.contains(words), "{words}: {text}");
    }

    let print = format!("--print-to-pdf={paper}");
    let output = of_browser(browser(&folder).arg("--no-pdf-header-footer").arg(print).arg(format!("file://{page}")));
    assert!(output.status.success(), "{output:?}");
    let bytes = std::fs::read(&paper).expect("a printed page");
    let sheets = bytes.windows(11).filter(|window| window == b"/Type /Page").count()
        - bytes.windows(12).filter(|window| window == b"/Type /Pages").count();
    assert!(bytes.starts_with(b"%PDF") && (5..=15).contains(&sheets), "{sheets} sheets");
}

#[test]
fn a_report_stands_beside_a_new_run_and_what_is_none_is_refused() {
    let folder = Folder::new("page-again");
    let [first, both, none] = ["first.html", "both.html", "none.html"].map(|name| folder.path(name));
    let said = host_sim(&["report", "--map", "none", "-o", &first]);
    assert_eq!(said.status, 0, "{said:?}");
    let said = host_sim(&["report", &first, "--map", "none", "-o", &both]);
    assert_eq!(said.status, 0, "{said:?}");
    let html = std::fs::read_to_string(&both).expect("the page");
    let accounts = host_sim::report::page::accounts(&html).expect("accounts");
    let names: Vec<&str> = accounts.iter().map(|account| account.name.as_str()).collect();
    assert_eq!(names.len(), 1, "{names:?}");
    std::fs::write(&none, "<html></html>").expect("room");
    for (args, words) in [
        (vec!["report", &none], "not a report of host-sim"),
        (vec!["report", "absent.html"], "absent.html"),
        (vec!["report", "--map", "gian"], "invalid value 'gian'"),
        (vec!["report", "--certificate", "absent.txt"], "absent.txt"),
        (vec!["report", &first, "--set", "span_s=1"], "--set applies to scenarios only"),
    ] {
        let said = host_sim(&[&args[..], &["-o", &both, "--force"]].concat());
        assert_eq!(said.status, 2, "{said:?}");
        assert!(said.err.contains(words), "{said:?}");
    }
    assert_eq!(std::fs::read_to_string(&both).expect("the page"), html, "a refusal wrote");
}
