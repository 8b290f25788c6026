//! QEMU as the emulator of a firmware: its board `netduinoplus2` has an STM32F405.
//!
//! QEMU is a child process. USART1 and USART2 of the chip (the log) are TCP connections on the local machine. Both are
//! established before the first instruction runs, so no byte is lost. The child ends when its owner is dropped. An exit
//! without drops calls [`stop_all`] first. On Linux the child is killed when the thread that started it ends.

use std::io::{self, ErrorKind, Read};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::image_file;
use crate::log::{self, is_silence};

/// Name of the emulator.
const PROGRAM: &str = "qemu-system-arm";
/// Longest wait for the start of the emulator.
pub const START_WITHIN: Duration = Duration::from_secs(10);
/// Last words of a log that mark its end: for example `budget ends`, or `stopped` after a fault.
const LAST_WORDS: [&str; 3] = ["done", "ends", "stopped"];
/// Polling interval while the emulator starts.
const GLANCE: Duration = Duration::from_millis(2);

/// All running emulators of this process.
static RUNNING: Mutex<Vec<Arc<Mutex<Child>>>> = Mutex::new(Vec::new());

/// Ends every emulator of this process, for an exit without drops.
pub fn stop_all() {
    for child in RUNNING.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        stop(&child);
    }
}

fn stop(child: &Mutex<Child>) {
    let mut child = child.lock().unwrap_or_else(PoisonError::into_inner);
    // The child may have ended already; waiting for it leaves no zombie process.
    let _ = child.kill();
    let _ = child.wait();
}

/// Returns whether the line is the last one of a log.
pub fn is_last(line: &str) -> bool {
    line.split_whitespace().next_back().is_some_and(|word| LAST_WORDS.contains(&word))
}

/// Request for an execution trace: the addresses of all executed instructions within some ranges.
#[derive(Clone, Copy, Debug)]
pub struct Trace<'a> {
    /// First address and length in bytes of each range.
    pub ranges: &'a [(u32, u32)],
    /// File for the trace.
    pub file: &'a Path,
}

/// Time base of the emulated chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// Real time of the host, as fast as the emulation runs.
    Host,
    /// Instruction count, identical in every run; waiting takes no time.
    Instructions,
    /// Instruction count, but waiting takes real time: for a program that exchanges data with the chip.
    Paced,
}

/// A running emulator, which ends when dropped.
pub struct Process {
    child: Arc<Mutex<Child>>,
}

impl Process {
    /// Boots a firmware; `usarts` selects the connections to USART1 and USART2.
    ///
    /// # Errors
    /// The emulator or the firmware is missing or unusable; the message has the remedy.
    pub fn start(
        image: &Path,
        usarts: [bool; 2],
        clock: Clock,
        trace: Option<Trace<'_>>,
    ) -> Result<(Self, [Option<TcpStream>; 2]), String> {
        image_file::check(image)?;
        let told = |error: &io::Error| format!("no connection to the emulator: {error}");
        let mut command = Command::new(PROGRAM);
        command.args(["-M", "netduinoplus2", "-nographic", "-monitor", "none", "-kernel"]).arg(image);
        match clock {
            Clock::Host => {}
            Clock::Instructions => _ = command.args(["-icount", "shift=0,sleep=off"]),
            Clock::Paced => _ = command.args(["-icount", "shift=0,sleep=on"]),
        }
        if let Some(Trace { ranges, file }) = trace {
            let ranges: Vec<String> = ranges.iter().map(|(at, length)| format!("{at:#x}+{length:#x}")).collect();
            command.args(["-singlestep", "-d", "exec,nochain", "-dfilter", &ranges.join(","), "-D"]).arg(file);
        }
        let mut listeners = [None, None];
        for (listener, wanted) in listeners.iter_mut().zip(usarts) {
            let mut serial = String::from("null");
            if wanted {
                let socket = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(|error| told(&error))?;
                let address = socket.local_addr().map_err(|error| told(&error))?;
                serial = format!("tcp:{address},nodelay=on");
                *listener = Some(socket);
            }
            command.args(["-serial", &serial]);
        }
        terminal::stop::before_exit(stop_all);
        let process = Self::spawn(&mut command)?;
        let until = Instant::now() + START_WITHIN;
        let mut streams = [None, None];
        for (stream, listener) in streams.iter_mut().zip(&listeners) {
            if let Some(listener) = listener {
                *stream = Some(process.accept(listener, until)?);
            }
        }
        Ok((process, streams))
    }

    fn spawn(command: &mut Command) -> Result<Self, String> {
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        // Ctrl-C at the terminal must reach only this program, which then saves its data and ends the emulator.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(command, 0);
        #[cfg(target_os = "linux")]
        die_with_parent(command);
        let child = command.spawn().map_err(|error| {
            if error.kind() == ErrorKind::NotFound {
                format!(
                    "{PROGRAM} is not installed: apt-get install qemu-system-arm (or your system's package of QEMU)"
                )
            } else {
                format!("{PROGRAM} cannot be started: {error}")
            }
        })?;
        let child = Arc::new(Mutex::new(child));
        RUNNING.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::clone(&child));
        Ok(Self { child })
    }

    fn accept(&self, listener: &TcpListener, until: Instant) -> Result<TcpStream, String> {
        let connect = || -> io::Result<Option<TcpStream>> {
            listener.set_nonblocking(true)?;
            while Instant::now() < until && self.runs()? {
                match listener.accept() {
                    Ok((stream, _)) => {
                        stream.set_nonblocking(false)?;
                        stream.set_nodelay(true)?;
                        stream.set_read_timeout(Some(log::GLANCE))?;
                        stream.set_write_timeout(Some(Duration::from_secs(1)))?;
                        return Ok(Some(stream));
                    }
                    Err(error) if is_silence(error.kind()) => sleep(GLANCE),
                    Err(error) => return Err(error),
                }
            }
            Ok(None)
        };
        match connect() {
            Ok(Some(stream)) => Ok(stream),
            Ok(None) => Err(self.ended("the emulator did not start")),
            Err(error) => Err(self.ended(&format!("no connection to the emulator: {error}"))),
        }
    }

    fn runs(&self) -> io::Result<bool> {
        Ok(self.child.lock().unwrap_or_else(PoisonError::into_inner).try_wait()?.is_none())
    }

    /// Ends the emulator; returns the event `what` with the emulator's error output.
    pub fn ended(&self, what: &str) -> String {
        let already = self.child.lock().unwrap_or_else(PoisonError::into_inner).try_wait().ok().flatten();
        stop(&self.child);
        let mut said = String::new();
        let pipe = self.child.lock().unwrap_or_else(PoisonError::into_inner).stderr.take();
        if let Some(mut pipe) = pipe {
            // A partial error output is useful too.
            let _ = pipe.read_to_string(&mut said);
        }
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        let ended = already.map_or_else(String::new, |status| format!(" ({status})"));
        let said = if said.is_empty() { "no output" } else { &said };
        format!("{what}{ended}: {said}")
    }
}

/// Makes the system kill the child with its parent, because a killed parent cannot do it.
#[cfg(target_os = "linux")]
fn die_with_parent(command: &mut Command) {
    use rustix::process::{Signal, getpid, getppid, set_parent_process_death_signal};
    let parent = getpid();
    let wish = move || {
        set_parent_process_death_signal(Some(Signal::KILL))?;
        // The parent may have ended already.
        if getppid() == Some(parent) { Ok(()) } else { Err(ErrorKind::BrokenPipe.into()) }
    };
    // SAFETY: between fork and exec only async-signal-safe functions are allowed; these are two system calls.
    unsafe { std::os::unix::process::CommandExt::pre_exec(command, wish) };
}

impl Drop for Process {
    fn drop(&mut self) {
        stop(&self.child);
        RUNNING.lock().unwrap_or_else(PoisonError::into_inner).retain(|child| !Arc::ptr_eq(child, &self.child));
    }
}
