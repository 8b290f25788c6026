//! `host-sim view`: serves the live page on this machine, opened on a scenario or on a recorded trace.
//!
//! The page is a folder of static files, and the file of the user is beside it as `view.json`. Only GET and only the
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
    /// Scenario file, or trace.csv of host-sim run.
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

/// File with its type.
type Served = (Vec<u8>, &'static str);

impl Console<'_> {
    pub(super) fn view(&mut self, options: &ViewOptions) -> Result<u8, Failure> {
        let ViewOptions { file, port, page } = options;
        let mut files = page_of(page.as_deref())?;
        files.insert(VIEW.into(), (shown(file)?.to_string().into_bytes(), "application/json"));
        let files = Arc::new(files);
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
                    let files = files.clone();
                    thread::spawn(move || {
                        // The other end may close the connection at any time.
                        _ = answer(stream, &files);
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
        let columns = columns(&text).map_err(|why| bad(format!("{}: {why}", file.display())))?;
        return Ok(json!({ "name": name, "columns": columns }));
    }
    let text = read_text(file, FileKind::SETTINGS)?;
    // An invalid scenario is reported here, with its places.
    scenario::load(file, &[])?;
    Ok(json!({ "name": name, "text": text }))
}

/// Returns the columns of a trace: of many rows every n-th, and the last.
fn columns(text: &str) -> Result<Vec<(&str, Vec<Value>)>, String> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').map(str::trim).collect();
    if names.first() != Some(&"t_s") || !names.contains(&"u") {
        return Err("1:1: expected a scenario, or trace.csv of host-sim run with the columns t_s and u".into());
    }
    let rows: Vec<&str> = lines.collect();
    let every = rows.len().div_ceil(ROWS).max(1);
    let mut columns: Vec<(&str, Vec<Value>)> = names.iter().map(|name| (*name, Vec::new())).collect();
    for (k, row) in rows.iter().enumerate().filter(|(k, _)| k % every == 0 || k + 1 == rows.len()) {
        let cells: Vec<&str> = row.split(',').collect();
        if cells.len() != names.len() {
            return Err(format!("{}:1: expected {} columns, found {}", k + 2, names.len(), cells.len()));
        }
        for ((_, column), cell) in columns.iter_mut().zip(cells) {
            // A number that is missing or not finite is a gap.
            column.push(cell.trim().parse::<f64>().map_or(Value::Null, |number| json!(number)));
        }
    }
    Ok(columns)
}

/// Answers one request.
fn answer(mut stream: TcpStream, files: &BTreeMap<String, Served>) -> io::Result<()> {
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
    let file = files.get(if path.is_empty() { FILES[0].0 } else { path });
    let (line, kind, content): (&str, &str, &[u8]) = match (method, file) {
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
        let server = thread::spawn(move || answer(stream, &files));
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
        for target in ["/other", "/../Cargo.toml", "//index.html/..", "/%2e%2e/x", "index.html", "*", ""] {
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
        let read = columns("t_s,r,u\n0,1,2\n0.001,nan,3\n").expect("a trace");
        assert_eq!(json!(read), json!([["t_s", [0.0, 0.001]], ["r", [1.0, null]], ["u", [2.0, 3.0]]]));
        let long: String = (0..10_000).flat_map(|k| [k.to_string(), ",1\n".into()]).collect();
        let read = columns(&format!("t_s,u\n{long}")).map(|columns| columns[0].1.len()).expect("a trace");
        assert!(read <= ROWS + 1 && read > ROWS / 2, "{read}");
        assert!(columns("a,b\n1,2\n").is_err());
        assert_eq!(columns("t_s,u\n1,2\n3\n"), Err("3:1: expected 2 columns, found 1".into()));
    }
}
