//! `host-sim pil`, `hil` and `emulate`: the controller on a target, emulated or a board.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use clap::Args;
use loop_sim::port::PortError;
use pil_wire::{REPLY_LEN, REQUEST_LEN};
use scenario::Experiment;

use super::{Console, Failure, bad, failed, status};
use link::remote::{self, Loadable, Remote};
use link::transport::board::{Log, Messages, is_last, logged};
use link::transport::faulty::Rates;
use link::transport::{BAUD, Emulator, Faulty, Serial, Stoppable, Transport};

/// Firmware `pil` as built by `cargo xtask firmware`, relative to the root of the repository.
const IMAGE: &str = "firmware/target/thumbv7em-none-eabihf/release/pil";
/// Longest wait for a line of the log, and so the delay of Ctrl-C.
const LISTEN: Duration = Duration::from_millis(50);
/// Longest time for which the log is printed after the end of a run.
const LOG_TAIL: Duration = Duration::from_secs(2);

#[derive(Args, Debug)]
pub(super) struct PilOptions {
    /// Firmware `pil`; cargo xtask firmware builds it.
    #[arg(long, value_name = "FILE", default_value = IMAGE)]
    image: PathBuf,
    /// Print the log of the target on stderr.
    #[arg(long)]
    log: bool,
    /// Probability of a dropped, corrupted, truncated, duplicated and delayed frame, each, per direction (0 to 0.1). At
    /// 0.05 a run takes ten times as long.
    #[arg(long, value_name = "RATE", value_parser = rate, help_heading = "Experiments")]
    faults: Option<f64>,
    /// Seed of the faults.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "faults", help_heading = "Experiments")]
    seed: u64,
}

#[derive(Args, Debug)]
pub(super) struct HilOptions {
    /// Serial port of the board, as /dev/ttyUSB0.
    #[arg(long, value_name = "DEV")]
    port: PathBuf,
    /// Baud rate of the port, bit/s.
    #[arg(long, value_name = "N", default_value_t = BAUD)]
    #[arg(value_parser = clap::value_parser!(u32).range(9600..=12_000_000))]
    baud: u32,
    /// Serial port of the board's log at the same baud rate; the log is printed on stderr.
    #[arg(long, value_name = "DEV", requires = "elf")]
    log_port: Option<PathBuf>,
    /// ELF file of the firmware on the board. It must be the flashed build, otherwise the log decodes to wrong text.
    #[arg(long, value_name = "FILE", requires = "log_port")]
    elf: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(super) struct EmulateOptions {
    /// ELF file of the firmware, as firmware/target/thumbv7em-none-eabihf/release/drive.
    #[arg(long, value_name = "FILE")]
    image: PathBuf,
    /// Duration, s of host time. A log line that ends in `ends`, `done` or `stopped` ends the emulation earlier.
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = seconds)]
    seconds: f64,
}

pub(super) fn rate(text: &str) -> Result<f64, String> {
    let rate: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    // Five faults in two directions: at 0.1 more than every second round trip fails.
    if (0.0..=0.1).contains(&rate) { Ok(rate) } else { Err("expected 0 to 0.1".into()) }
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if seconds > 0.0 && seconds <= 86_400.0 { Ok(seconds) } else { Err("expected above 0, up to 86400 (a day)".into()) }
}

/// Connection to a target, and its log.
pub(super) struct Link<'a> {
    pub(super) remote: Remote<Stoppable<'a, Box<dyn Transport>>>,
    pub(super) log: Option<Log>,
}

/// Checks that a firmware file exists.
///
/// # Errors
/// If there is no such file. The message contains the option that names it and the command that builds the example
/// firmware.
pub(super) fn present(image: &Path, option: &str) -> Result<(), String> {
    match std::fs::metadata(image) {
        Err(error) if error.kind() == ErrorKind::NotFound => Err(format!(
            "firmware {}: there is no such file; give {option} FILE, or build the example firmware with `cargo xtask \
             firmware` in the repository",
            image.display()
        )),
        _ => Ok(()),
    }
}

fn design(experiment: &Experiment) -> Result<Loadable, Failure> {
    remote::for_target(experiment).map_err(bad)
}

impl<'a> Console<'a> {
    /// Switches off `drive.rest_band`, which the firmware does not have, and prints a note.
    pub(super) fn as_on_the_chip(&mut self, experiment: &mut Experiment) {
        if experiment.leave_rest_band() {
            self.note("note: drive.rest_band = \"off\" on host and target: the firmware has no rest band");
        }
    }

    /// Boots the firmware in the emulator and loads the design.
    pub(super) fn emulated(&mut self, experiment: &Experiment, options: &PilOptions) -> Result<Link<'a>, Failure> {
        let design = design(experiment)?;
        let PilOptions { image, log, faults, seed } = options;
        present(image, "--image").map_err(failed)?;
        let messages = if *log { Some(Messages::of(image).map_err(failed)?) } else { None };
        self.wait_for(&format!("the emulator to boot {}", image.display()));
        let (emulator, log) = Emulator::start(image, messages.is_some()).map_err(|error| failed(error.0))?;
        let log = log.zip(messages).map(|(stream, messages)| Log::follow(stream, messages));
        let transport: Box<dyn Transport> = match faults {
            Some(rate) => Box::new(Faulty::new(emulator, Rates::all(*rate), *seed)),
            None => Box::new(emulator),
        };
        // A round trip takes 1 to 3 ms. With injected faults a short timeout saves time.
        let reply_within = Duration::from_millis(if faults.is_some() { 10 } else { 100 });
        self.linked(transport, reply_within, design, log, |_| {
            format!("check that {} is the firmware `pil` of this version", image.display())
        })
    }

    /// Opens the port and loads the design.
    pub(super) fn wired(&mut self, experiment: &Experiment, options: &HilOptions) -> Result<Link<'a>, Failure> {
        let design = design(experiment)?;
        let HilOptions { port, baud, log_port, elf } = options;
        let log = match (log_port, elf) {
            (Some(log_port), Some(elf)) => {
                present(elf, "--elf").map_err(failed)?;
                let messages = Messages::of(elf).map_err(failed)?;
                let source = Serial::open(log_port, *baud).map_err(|error| failed(error.0))?;
                Some(Log::follow(source, messages))
            }
            _ => None,
        };
        self.wait_for(&format!("the target at {}", port.display()));
        let transport = Serial::open(port, *baud).map_err(|error| failed(error.0))?;
        // 10 bits per byte in both directions. Doubled: a USB adapter collects bytes for 16 ms.
        let line = Duration::from_secs_f64(10.0 * (REQUEST_LEN + REPLY_LEN) as f64 / f64::from(*baud));
        let reply_within = Duration::from_millis(50) + 2 * line;
        self.linked(Box::new(transport), reply_within, design, log, |heard| {
            if heard == 0 {
                format!("check the port {}, the power of the board, and its firmware (`pil`)", port.display())
            } else {
                format!("check --baud {baud}, and that the board runs the firmware `pil`")
            }
        })
    }

    pub(super) fn linked(
        &self,
        transport: Box<dyn Transport>,
        reply_within: Duration,
        design: Loadable,
        log: Option<Log>,
        question: impl Fn(u64) -> String,
    ) -> Result<Link<'a>, Failure> {
        let wire = Stoppable::new(transport, self.stop);
        let remote = Remote::connect(wire, reply_within, design).map_err(|error| match &error {
            _ if self.stop.load(Ordering::Relaxed) => {
                Failure { status: status::INTERRUPTED, message: "stopped on request, before the first tick".into() }
            }
            PortError::Silent { heard, .. } => failed(format!("{error}; {}", question(*heard))),
            // Something answered.
            PortError::Refused(why) if why.contains(remote::OTHER_FIRMWARE) => {
                failed(format!("{error}; {}", question(1)))
            }
            _ => failed(error.to_string()),
        })?;
        Ok(Link { remote, log })
    }

    /// Prints a note on a terminal before a wait of some seconds.
    fn wait_for(&mut self, what: &str) {
        if self.terminal {
            self.note(&format!("waiting for {what}"));
        }
    }

    /// Prints the rest of the log at the end of a run, for at most [`LOG_TAIL`].
    pub(super) fn rest_of(&mut self, log: &Log) {
        let until = Instant::now() + LOG_TAIL;
        while Instant::now() < until
            && let Ok(line) = log.wait(LISTEN)
        {
            self.note(&format!("log: {line}"));
        }
    }

    pub(super) fn emulate(&mut self, options: &EmulateOptions) -> Result<u8, Failure> {
        let EmulateOptions { image, seconds } = options;
        present(image, "--image").map_err(failed)?;
        let messages = Messages::or_text(image).map_err(failed)?;
        if messages.is_text() {
            self.note("note: the firmware has no defmt messages; the output of USART2 is printed as text");
        }
        let (process, stream) = logged(image).map_err(failed)?;
        let log = Log::follow(stream, messages);
        let until = Instant::now() + Duration::from_secs_f64(*seconds);
        while Instant::now() < until {
            if self.stop.load(Ordering::Relaxed) {
                return Ok(status::INTERRUPTED);
            }
            match log.wait(LISTEN) {
                Ok(line) => {
                    self.say(&line)?;
                    if is_last(&line) {
                        break;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err(failed(process.ended("the emulator ended"))),
            }
        }
        Ok(status::DONE)
    }
}

/// Returns the output folder of a run on a target: the scenario name with `-pil` or `-hil`.
pub(super) fn folder(experiment: &Experiment, place: &str) -> PathBuf {
    Path::new("out").join(format!("{}{place}", experiment.name))
}
