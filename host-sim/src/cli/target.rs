//! `pil`, `hil` and `emulate`: the controller on a chip, emulated or real.

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

/// Where `cargo xtask firmware` leaves the image, from the root of the repository.
const IMAGE: &str = "firmware/target/thumbv7em-none-eabihf/release/pil";
/// A line of the log is looked for this long; also how soon Ctrl-C is heard.
const LISTEN: Duration = Duration::from_millis(50);
/// A log that has more to say than this after the end of a run is cut short.
const LOG_TAIL: Duration = Duration::from_secs(2);

#[derive(Args, Debug)]
pub(super) struct PilOptions {
    /// The image with the target's side of the talk; cargo xtask firmware builds it.
    #[arg(long, value_name = "FILE", default_value = IMAGE)]
    image: PathBuf,
    /// Show what the target logs, on stderr.
    #[arg(long)]
    log: bool,
    /// Drop, corrupt, truncate, duplicate and delay frames, each with this probability in each direction (0 ..
    /// 0.1); 0.05 makes a run ten times as long.
    #[arg(long, value_name = "RATE", value_parser = rate)]
    faults: Option<f64>,
    /// Seed of the faults.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "faults")]
    seed: u64,
}

#[derive(Args, Debug)]
pub(super) struct HilOptions {
    /// Serial port of the board, such as /dev/ttyUSB0.
    #[arg(long, value_name = "DEV")]
    port: PathBuf,
    /// Speed of the port, bits per second.
    #[arg(long, value_name = "N", default_value_t = BAUD)]
    #[arg(value_parser = clap::value_parser!(u32).range(9600..=12_000_000))]
    baud: u32,
    /// Serial port of the board's log (same speed), shown on stderr.
    #[arg(long, value_name = "DEV", requires = "elf")]
    log_port: Option<PathBuf>,
    /// The image on the board, the very one: the log of another decodes to messages that nobody sent.
    #[arg(long, value_name = "FILE", requires = "log_port")]
    elf: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(super) struct EmulateOptions {
    /// The image, such as firmware/target/thumbv7em-none-eabihf/release/drive.
    #[arg(long, value_name = "FILE")]
    image: PathBuf,
    /// How long, s of this machine's time; an image whose line ends in `ends`, `done` or `stopped` ends earlier.
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = seconds)]
    seconds: f64,
}

pub(super) fn rate(text: &str) -> Result<f64, String> {
    let rate: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    // At 0.1 more than every second round trip fails already.
    if (0.0..=0.1).contains(&rate) { Ok(rate) } else { Err("from 0 to 0.1".into()) }
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if seconds > 0.0 && seconds <= 86_400.0 { Ok(seconds) } else { Err("more than 0, up to a day of 86400".into()) }
}

/// The way to a target.
pub(super) struct Link<'a> {
    pub(super) remote: Remote<Stoppable<'a, Box<dyn Transport>>>,
    pub(super) log: Option<Log>,
}

/// Is there such an image at all? Who asks for one of ours is told which option names it and how it comes to be.
pub(super) fn present(image: &Path, option: &str) -> Result<(), String> {
    match std::fs::metadata(image) {
        Err(error) if error.kind() == ErrorKind::NotFound => Err(format!(
            "image {}: there is no such file; {option} FILE names one, `cargo xtask firmware` in the repository \
                 builds it",
            image.display()
        )),
        _ => Ok(()),
    }
}

fn design(experiment: &Experiment) -> Result<Loadable, Failure> {
    remote::for_target(experiment).map_err(bad)
}

impl<'a> Console<'a> {
    /// Leaves out what the image does not have, and says so.
    pub(super) fn as_on_the_chip(&mut self, experiment: &mut Experiment) {
        if experiment.leave_rest_band() {
            self.note("drive.rest_band = \"off\" on both sides: the image on the chip has no band at rest");
        }
    }

    /// Boots the image and loads the design.
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
        // A round trip takes 1 to 3 ms. Where frames are known to be lost it pays to ask again soon.
        let reply_within = Duration::from_millis(if faults.is_some() { 10 } else { 100 });
        self.linked(transport, reply_within, design, log, |_| {
            format!("is {} the image `pil`, and of this version?", image.display())
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
        // 10 bits a byte there and back, twice for what stands in the way (a USB adapter gathers bytes for 16 ms).
        let line = Duration::from_secs_f64(10.0 * (REQUEST_LEN + REPLY_LEN) as f64 / f64::from(*baud));
        let reply_within = Duration::from_millis(50) + 2 * line;
        self.linked(Box::new(transport), reply_within, design, log, |heard| {
            if heard == 0 {
                format!(
                    "is {} the board's port, is the board powered, and does the image `pil` run on it?",
                    port.display()
                )
            } else {
                format!("is {baud} the speed of the port, and the image `pil` the one that runs on the board?")
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
            _ => failed(error.to_string()),
        })?;
        Ok(Link { remote, log })
    }

    /// Tells a person why nothing moves for a moment.
    fn wait_for(&mut self, what: &str) {
        if self.terminal {
            self.note(&format!("waiting for {what}"));
        }
    }

    /// What the log has to say at the end of a run.
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
            self.note("note: the image holds no defmt messages; what it sends over USART2 is shown as text");
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
                Err(RecvTimeoutError::Disconnected) => return Err(failed(process.ended("the emulator is gone"))),
            }
        }
        Ok(status::DONE)
    }
}

/// Folder of a run on a target: beside that of the run in this process.
pub(super) fn folder(experiment: &Experiment, place: &str) -> PathBuf {
    Path::new("out").join(format!("{}{place}", experiment.name))
}
