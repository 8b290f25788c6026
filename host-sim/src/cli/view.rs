//! `host-sim view`: serves the live page on this machine, opened on a scenario, on a trace, or on the record of a
//! running drive.
//!
//! The page is a folder of static files, and the file of the user is beside it as `view.json`. It is read again for
//! every request, so that the page can follow a record that grows (`host-sim live --record`). Only GET and only the
//! files of the page are answered. A request has a limited length and time, so a broken one ends its own connection.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::{Value, json};
use terminal::stop;
use whole_file::FileKind;

use super::{Console, Failure, bad, failed, read_text, status};

#[derive(Args, Debug)]
pub(super) struct ViewOptions {
    /// Scenario file, trace.csv of host-sim run, or the record of host-sim live --record, which the page follows.
    file: PathBuf,
    /// Port on this machine; 0 takes a free one.
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
    /// Folder of the page [default: the folder `page` beside the program, else target/web/page].
    #[arg(long, value_name = "DIR")]
    page: Option<PathBuf>,
}

/// Files of the page with their types. Nothing else is served.
const FILES: [(&str, &str); 11] = [
    ("index.html", "text/html; charset=utf-8"),
    ("style.css", "text/css"),
    ("uPlot.min.css", "text/css"),
    ("uPlot.iife.min.js", "text/javascript"),
    ("page.js", "text/javascript"),
    ("charts.js", "text/javascript"),
    ("core.js", "text/javascript"),
    ("fields.js", "text/javascript"),
    ("link.js", "text/javascript"),
    ("scene.js", "text/javascript"),
    ("worker.js", "text/javascript"),
];
const MODULE: (&str, &str) = ("edo_smc_web.wasm", "application/wasm");
/// Name of the file of the user.
const VIEW: &str = "view.json";
/// Command that builds the page.
const BUILD: &str = "cargo xtask web";
/// Folder of the page after [`BUILD`].
const BUILT: &str = "target/web/page";

/// Longest head of a request, bytes, and longest time for it.
const LONGEST: usize = 16 << 10;
const TIME: Duration = Duration::from_secs(5);
/// Largest number of rows of a trace that the page gets: more than it has points.
const ROWS: usize = 4000;

/// Time span of a growing record that the page shows, s.
const SHOWN_S: f64 = 10.0;

/// File with its type.
type Served = (Vec<u8>, &'static str);

/// What is served: the files of the page, and the file of the user as [`VIEW`].
struct Page {
    files: BTreeMap<String, Served>,
    of_user: PathBuf,
}

impl Page {
    fn file(&self, path: &str) -> Option<Served> {
        if path != VIEW {
            return self.files.get(path).cloned();
        }
        // A file that is gone or broken meanwhile is not found; the page keeps what it has.
        let json = shown(&self.of_user).ok()?;
        Some((json.to_string().into_bytes(), "application/json"))
    }
}

impl Console<'_> {
    pub(super) fn view(&mut self, options: &ViewOptions) -> Result<u8, Failure> {
        let ViewOptions { file, port, page } = options;
        shown(file)?;
        let page = Arc::new(Page { files: page_of(page.as_deref())?, of_user: file.clone() });
        let taken = |error: io::Error| bad(format!("--port {port}: {error}; give another port, or 0 for a free one"));
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, *port)).map_err(taken)?;
        let address = listener.local_addr().map_err(|error| failed(error.to_string()))?;
        listener.set_nonblocking(true).map_err(|error| failed(error.to_string()))?;
        self.say(&format!("http://{address}/?view"))?;
        self.note(&format!("open this address in a browser; Ctrl-C ends the server of {}", file.display()));
        let _looking = stop::looking();
        while !self.stop.load(Ordering::Relaxed) {
            match listener.accept() {
                Ok((stream, _)) => {
                    let page = page.clone();
                    thread::spawn(move || {
                        // The other end may close the connection at any time.
                        _ = answer(stream, &page);
                    });
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => thread::sleep(Duration::from_millis(20)),
                // A connection that ended before it was accepted.
                Err(_) => {}
            }
        }
        Ok(status::INTERRUPTED)
    }
}

/// Reads the page.
fn page_of(given: Option<&Path>) -> Result<BTreeMap<String, Served>, Failure> {
    let beside = std::env::current_exe().ok().and_then(|program| Some(program.parent()?.join("page")));
    let folder = match given {
        Some(folder) => folder.to_path_buf(),
        None => beside.filter(|folder| folder.join(MODULE.0).is_file()).unwrap_or_else(|| BUILT.into()),
    };
    let mut files = BTreeMap::new();
    for (name, kind) in FILES.into_iter().chain([MODULE]) {
        let path = folder.join(name);
        let missing = |error: io::Error| {
            bad(format!("{}: {error}; `{BUILD}` builds the page, --page names its folder", path.display()))
        };
        files.insert(name.to_owned(), (fs::read(&path).map_err(missing)?, kind));
    }
    Ok(files)
}

/// Returns the file of the user as the page reads it.
fn shown(file: &Path) -> Result<Value, Failure> {
    let name = file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    if file.extension().is_some_and(|end| end == "csv") {
        let text = read_text(file, FileKind::TRACE)?;
        let is_live = text.starts_with(RECORD);
        let columns = columns(&text, is_live).map_err(|why| bad(format!("{}: {why}", file.display())))?;
        return Ok(json!({ "name": name, "columns": columns, "follow": is_live }));
    }
    let text = read_text(file, FileKind::SETTINGS)?;
    // An invalid scenario is reported here, with its places.
    scenario::load(file, &[])?;
    Ok(json!({ "name": name, "text": text }))
}

/// Begin of the record of a running drive.
const RECORD: &str = "tick,t_s,r_rad,";

/// Returns the name of a trace for a column of a record.
fn of_record(name: &str, has_link: bool) -> &str {
    let loaded = if has_link { ["link_rad", "link_load_n_m"] } else { ["motor_rad", "motor_load_n_m"] };
    match name {
        "r_rad" => "r",
        "u_a" => "u",
        _ if name == loaded[0] => "angle_rad",
        _ if name == loaded[1] => "load_n_m",
        "motor_rad" => "motor_angle_rad",
        other => other,
    }
}

/// Returns the columns of a trace, or of the last seconds of a record: of many rows every n-th, and the last.
fn columns(text: &str, is_live: bool) -> Result<Vec<(&str, Vec<Value>)>, String> {
    // The last line of a growing file may not be whole.
    let text = if is_live { &text[..=text.rfind('\n').unwrap_or(0)] } else { text };
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().map_or("", |(_, line)| line).split(',').map(str::trim).collect();
    let has_link = names.contains(&"link_rad");
    let names: Vec<&str> = if is_live { names.iter().map(|name| of_record(name, has_link)).collect() } else { names };
    if !is_live && (names.first() != Some(&"t_s") || !names.contains(&"u")) {
        return Err("1:1: expected a scenario, trace.csv of host-sim run with the columns t_s and u, or a record of \
                    host-sim live"
            .into());
    }
    let mut rows: Vec<(usize, Vec<&str>)> = lines.map(|(k, row)| (k + 1, row.split(',').collect())).collect();
    if let Some((line, cells)) = rows.iter().find(|(_, cells)| cells.len() != names.len()) {
        return Err(format!("{line}:1: expected {} columns, found {}", names.len(), cells.len()));
    }
    if is_live {
        let time_s = |cells: &[&str]| cells[1].parse::<f64>().unwrap_or(f64::NAN);
        let last_s = rows.last().map_or(0.0, |(_, cells)| time_s(cells));
        rows.retain(|(_, cells)| last_s - time_s(cells) <= SHOWN_S);
    }
    let every = rows.len().div_ceil(ROWS).max(1);
    let mut columns: Vec<(&str, Vec<Value>)> = names.iter().map(|name| (*name, Vec::new())).collect();
    let count = rows.len();
    for (_, cells) in rows.iter().enumerate().filter(|(k, _)| k % every == 0 || k + 1 == count).map(|(_, row)| row) {
        for ((_, column), cell) in columns.iter_mut().zip(cells) {
            // A number that is missing or not finite is a gap.
            column.push(cell.trim().parse::<f64>().map_or(Value::Null, |number| json!(number)));
        }
    }
    Ok(columns)
}

/// Answers one request.
fn answer(mut stream: TcpStream, page: &Page) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(TIME))?;
    stream.set_write_timeout(Some(TIME))?;
    let head = head_of(&mut stream)?;
    let mut words = head.lines().next().unwrap_or_default().split(' ');
    let (method, target) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    // A page of another site must not read the file by another name of this machine.
    let host = head.lines().find_map(|line| line.to_ascii_lowercase().strip_prefix("host:").map(str::to_owned));
    let is_here = host.as_deref().map(|host| host.trim().rsplit_once(':').map_or(host.trim(), |(name, _)| name));
    let is_here = is_here.is_some_and(|name| ["127.0.0.1", "localhost"].contains(&name));
    let path = target.split(['?', '#']).next().unwrap_or_default().trim_start_matches('/');
    let file = is_here.then(|| page.file(if path.is_empty() { FILES[0].0 } else { path })).flatten();
    let (line, kind, content): (&str, &str, &[u8]) = match (method, &file) {
        _ if !is_here => ("400 Bad Request", "text/plain", b"expected a request to localhost\n"),
        ("GET", Some((content, kind))) if target.starts_with('/') => ("200 OK", kind, content),
        ("GET", _) => ("404 Not Found", "text/plain", b"not a file of the page\n"),
        _ => ("405 Method Not Allowed", "text/plain", b"expected GET\n"),
    };
    let head = format!(
        "HTTP/1.1 {line}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
        content.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(content)
}

/// Reads the head of a request, which has a largest length and a longest time.
fn head_of(stream: &mut impl Read) -> io::Result<String> {
    let (begin, mut head, mut part) = (Instant::now(), Vec::new(), [0; 1024]);
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        let count = stream.read(&mut part)?;
        if count == 0 || head.len() + count > LONGEST || begin.elapsed() > TIME {
            return Err(io::ErrorKind::InvalidData.into());
        }
        head.extend_from_slice(&part[..count]);
    }
    Ok(String::from_utf8_lossy(&head).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the answer of a server of one file to these bytes.
    fn answered(request: &[u8]) -> String {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
        let mut client = TcpStream::connect(listener.local_addr().expect("an address")).expect("a connection");
        let (stream, _) = listener.accept().expect("a connection");
        let files = BTreeMap::from([(FILES[0].0.to_owned(), (b"the page".to_vec(), FILES[0].1))]);
        let page = Page { files, of_user: "nowhere.csv".into() };
        let server = thread::spawn(move || answer(stream, &page));
        // The server may answer before it has read everything.
        _ = client.write_all(request);
        _ = client.shutdown(std::net::Shutdown::Write);
        let mut text = Vec::new();
        _ = client.read_to_end(&mut text);
        _ = server.join().expect("no panic");
        String::from_utf8_lossy(&text).into_owned()
    }

    #[test]
    fn the_page_is_served_and_nothing_else() {
        let get = |target: &str| answered(format!("GET {target} HTTP/1.1\r\nHost: localhost:1\r\n\r\n").as_bytes());
        for target in ["/", "/index.html", "/?view"] {
            let text = get(target);
            assert!(text.starts_with("HTTP/1.1 200") && text.ends_with("the page"), "{target}: {text}");
        }
        for target in ["/other", "/view.json", "/../Cargo.toml", "//index.html/..", "/%2e%2e/x", "index.html", "*", ""]
        {
            assert!(get(target).starts_with("HTTP/1.1 404"), "{target}: {}", get(target));
        }
        let post = answered(b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
        assert!(post.starts_with("HTTP/1.1 405"), "{post}");
        for host in ["Host: example.org\r\n", "", "Host: localhost.example.org:80\r\n"] {
            let text = answered(format!("GET / HTTP/1.1\r\n{host}\r\n").as_bytes());
            assert!(text.starts_with("HTTP/1.1 400"), "{host}: {text}");
        }
    }

    #[test]
    fn a_broken_request_ends_its_connection_without_an_answer() {
        for request in [&b""[..], b"GET / HTTP/1.1\r\n", &[0xff; 100], &vec![b'a'; 2 * LONGEST]] {
            assert_eq!(answered(request), "", "{} bytes", request.len());
        }
        let binary = answered(b"\xff\xfe \x00\r\n\r\n");
        assert!(binary.starts_with("HTTP/1.1 400"), "{binary}");
    }

    #[test]
    fn a_trace_has_its_columns_and_another_table_its_place() {
        let read = columns("t_s,r,u\n0,1,2\n0.001,nan,3\n", false).expect("a trace");
        assert_eq!(json!(read), json!([["t_s", [0.0, 0.001]], ["r", [1.0, null]], ["u", [2.0, 3.0]]]));
        let long: String = (0..10_000).flat_map(|k| [k.to_string(), ",1\n".into()]).collect();
        let read = columns(&format!("t_s,u\n{long}"), false).map(|columns| columns[0].1.len()).expect("a trace");
        assert!(read <= ROWS + 1 && read > ROWS / 2, "{read}");
        assert!(columns("a,b\n1,2\n", false).is_err());
        assert_eq!(columns("t_s,u\n1,2\n3\n", false), Err("3:1: expected 2 columns, found 1".into()));
    }

    /// The last 10 s, under the names of a trace; a line that is being written does not count yet.
    #[test]
    fn a_growing_record_has_its_last_seconds() {
        let head = "tick,t_s,r_rad,motor_rad,motor_rad_s,motor_load_n_m,u_a,sigma_star,health\n";
        let rows = "1,0.5,0,0.1,0,0.2,1,0,0\n9,10.2,1,1.1,0,0.3,2,0,0\n10,10.6,1,,,,0,0,64\n11,10.7,1,1.";
        let record = format!("{head}{rows}");
        let read: BTreeMap<_, _> = columns(&record, true).expect("a record").into_iter().collect();
        assert_eq!(json!([read["t_s"], read["r"], read["u"]]), json!([[10.2, 10.6], [1.0, 1.0], [2.0, 0.0]]));
        assert_eq!(json!([read["angle_rad"], read["load_n_m"]]), json!([[1.1, null], [0.3, null]]));
        let joint = head.replace("motor_rad,motor_rad_s", "link_rad,link_rad_s,link_load_n_m,motor_rad,motor_rad_s");
        let read: BTreeMap<_, _> = columns(&joint, true).expect("a header").into_iter().collect();
        assert!(["angle_rad", "motor_angle_rad", "load_n_m"].iter().all(|name| read[name].is_empty()));
    }
}
