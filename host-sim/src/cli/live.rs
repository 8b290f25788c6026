//! `host-sim live` monitors, moves and tunes a running drive. `host-sim replay` reruns its trace buffer.
//!
//! The drive is the firmware `drive` or `motor`, in the emulator or on a board. Commands come from stdin or a script,
//! one per line. While no command is pending the drive is observed every 0.1 s.

mod alarm;
mod keys;
mod line;

use std::fmt::Write as _;
use std::fs;
use std::io::{self, BufRead, Read, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use clap::Args;
use controller_core::Health;
use controller_core::drive::ALARMS;
use loop_sim::port::PortError;
use pil_wire::{Disturbance, Model, Observed, Order, REPLY_LEN, REQUEST_LEN, Swapped};
use scenario::{Experiment, Source};
use study::design::refused_as_unstable;
use study::margins::margins_and_noise;
use study::number::significant;
use terminal::stop;
use terminal::table::Table;
use whole_file::FileKind;

use super::target::{present, rate};
use super::{Console, Failure, bad, failed, free, read_text, status, write_file};
use crate::report::plot::{BLACK, Figure, Panel, Series, Style};
use crate::report::{FIGURE, write_whole};
use alarm::{Values, alarms, causes, without};
use keys::{Side, number_of};
use link::black_box::{Again, BlackBox};
use link::live::LiveDrive;
use link::remote::{Loadable, for_interrupt, for_target, form_keys};
use link::transport::faulty::Rates;
use link::transport::{BAUD, Emulator, Faulty, Serial, Stoppable, Transport, TransportError};

/// Firmware `drive` as built by `cargo xtask firmware`, relative to the root of the repository.
const IMAGE: &str = "firmware/target/thumbv7em-none-eabihf/release/drive";
/// Period of the observations while no command is pending.
const GLANCE: Duration = Duration::from_millis(100);
/// Time without a new tick after which the drive counts as stopped.
const STANDS_STILL: Duration = Duration::from_secs(5);
/// Largest length of a command line, bytes.
const LONGEST_LINE: u64 = 1000;
/// Largest number of observations; the older half is dropped when it is reached.
const MOST_ROWS: usize = 1 << 20;
/// Shortest time between two writes of the page.
const REDRAWN: Duration = Duration::from_millis(500);
/// Word of a command that may overwrite a file.
const FORCE: &str = "--force";
/// Largest distance of a goal from angle 0 on the target, rad: 10000 revolutions.
const FURTHEST_RAD: f64 = 10_000.0 * std::f64::consts::TAU;
/// Largest load on the simulated plant, as a multiple of the torque at the current limit.
const LARGEST_LOAD: f64 = 100.0;
/// Time without its flags after which an alarm has ended, s.
const OVER_S: f64 = 1.0;
/// Time span of the drive that the page shows, s.
const SHOWN_S: f64 = 10.0;

/// Commands with their help.
const COMMANDS: [(&str, &str); 13] = [
    ("show", "print angles, speeds, loads, current command u, status flags and interrupt time"),
    ("move RAD [S]", "move to rest at an angle in S seconds; without S as fast as the limits allow"),
    ("stop [S]", "come to rest in S seconds [default: 0.2]; longer at the limits, shorter if already slowing down"),
    ("set KEY=VALUE ..", "change keys of the design on top of earlier changes, without a step in u"),
    ("wait S", "let S seconds of the drive pass"),
    ("trace FILE [--force]", "save the trace buffer for `host-sim replay`; --force overwrites the file"),
    ("reset", "restart after an alarm, at rest where the shaft is; rejected above 0.5 rad/s behind the gear"),
    ("release", "empty the trace buffer and let it run again; an alarm must be saved first"),
    ("plot FOLDER [--force]", "write a figure of the session into a folder; --force overwrites it"),
    ("stick [link] [motor]", "simulated plant only: freeze these encoders, release the others"),
    ("load N_M [S]", "simulated plant only: apply a load torque, N m; with S it ends on the target after S seconds"),
    ("help", "list the commands"),
    ("quit", "leave the drive as it is"),
];

#[derive(Args, Debug)]
pub(super) struct LiveOptions {
    /// Scenario that the drive was designed from, for the command `set`. The example firmware uses firmware/drive.toml
    /// and firmware/motor.toml.
    file: Option<PathBuf>,
    /// Firmware to emulate, `drive` or `motor`.
    #[arg(long, value_name = "FILE", default_value = IMAGE, conflicts_with = "port")]
    image: PathBuf,
    #[command(flatten)]
    reach: Reach,
    /// Read commands from this file instead of stdin; the first failure ends the session.
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// Output CSV file of all observations, written while the session runs: `host-sim view` follows it. A figure is
    /// written next to it at the end.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Output HTML file with a figure of the last 10 s; a browser reloads it by itself while the session runs.
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Overwrite the files of --record and --page.
    #[arg(long)]
    force: bool,
    /// Seed of the faults.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "faults", help_heading = "Experiments")]
    seed: u64,
}

/// Connection to a running drive.
#[derive(Args, Debug)]
pub(super) struct Reach {
    /// Serial port of a board, as /dev/ttyUSB0, instead of the emulator (feature chip).
    #[arg(long, value_name = "DEV")]
    port: Option<PathBuf>,
    /// Baud rate of the port, bit/s.
    #[arg(long, value_name = "N", default_value_t = BAUD, requires = "port")]
    #[arg(value_parser = clap::value_parser!(u32).range(9600..=12_000_000))]
    baud: u32,
    /// Probability of a dropped, corrupted, truncated, duplicated and delayed frame, each, per direction (0 to 0.1).
    #[arg(long, value_name = "RATE", value_parser = rate, help_heading = "Experiments")]
    faults: Option<f64>,
}

impl Reach {
    /// Returns whether faults are injected.
    pub(super) const fn has_faults(&self) -> bool {
        self.faults.is_some()
    }

    /// Returns whether the drive is a board on a serial port.
    pub(super) const fn is_port(&self) -> bool {
        self.port.is_some()
    }
}

#[derive(Args, Debug)]
pub(super) struct ReplayOptions {
    /// Trace buffer file written by the command trace of host-sim live.
    file: PathBuf,
    /// Override a key of the recorded scenario: replay with the other design; repeatable. Example: --set
    /// drive.margin=1.6.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Scenario file, if the trace buffer file contains none.
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Output folder of replay.csv and the figure [default: no files].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Function that boots a firmware in the emulator.
pub(super) type Boot = fn(&Path) -> Result<Emulator, TransportError>;
type Line<'a> = Stoppable<'a, Box<dyn Transport>>;

/// State of a session with a drive.
struct Session<'a> {
    drive: LiveDrive<Line<'a>>,
    /// Name, text and settings of the scenario.
    scenario: Option<(String, String, Vec<String>)>,
    seen: Vec<Observed>,
    disturbance: Disturbance,
    alarm: AlarmState,
    page: Option<Page>,
    record: Option<Recording>,
    /// Unit of the target's stopwatch.
    unit: &'static str,
}

/// Alarms of a session as far as they were reported.
#[derive(Default)]
struct AlarmState {
    /// Flags that were reported and have not ended, and the tick in which one of them was last seen.
    reported: Health,
    seen: u32,
    /// True if the drive was stopped, braked or had a frozen trace buffer in the last observation.
    stopped: bool,
    braked: bool,
    frozen: bool,
    /// Tick of the alarm in the trace buffer that no file has yet.
    unsaved: Option<u32>,
}

/// HTML page with a figure of the last observations, which a browser reloads every second.
struct Page {
    file: PathBuf,
    due: Instant,
}

/// CSV file of all observations. It grows while the session runs, so that another program can follow it.
struct Recording {
    path: PathBuf,
    file: fs::File,
    /// Rows that are not written yet.
    waiting: String,
    due: Instant,
}

impl Recording {
    /// Creates the file with its header.
    fn new(path: &Path, design: &Loadable) -> Result<Self, Failure> {
        let file = fs::File::create(path).map_err(|error| Failure::writing(path.display(), &error))?;
        let mut it = Self { path: path.to_path_buf(), file, waiting: header(design), due: Instant::now() };
        it.write()?;
        Ok(it)
    }

    fn write(&mut self) -> Result<(), Failure> {
        let written = self.file.write_all(self.waiting.as_bytes());
        self.waiting.clear();
        self.due = Instant::now() + REDRAWN;
        written.map_err(|error| Failure::writing(self.path.display(), &error))
    }
}

impl From<PortError> for Failure {
    fn from(error: PortError) -> Self {
        failed(error.to_string())
    }
}

/// Returns the design of a scenario with these settings, for a target.
fn designed(name: &str, text: &str, sets: &[String]) -> Result<Loadable, Failure> {
    checked(name, text, sets).map(|(_, design)| design)
}

/// Returns a scenario with these settings, and its design for a target.
fn checked(name: &str, text: &str, sets: &[String]) -> Result<(Experiment, Loadable), Failure> {
    let mut experiment = scenario::parse(&Source { file: name, text, sets }, "drive")?;
    experiment.leave_rest_band();
    let Some(drive) = &experiment.drive else {
        return Err(bad(format!("{name}: expected the scenario of a drive, with [motor] or [joint]")));
    };
    if let Some(why) = refused_as_unstable(&experiment) {
        return Err(bad(format!("{name}: {why}")));
    }
    let design = for_interrupt(&drive.designed).map_err(|why| bad(format!("{name}: {why}")))?;
    Ok((experiment, design))
}

impl<'a> Console<'a> {
    pub(super) fn live(&mut self, options: &LiveOptions) -> Result<u8, Failure> {
        let scenario = match &options.file {
            None => None,
            Some(file) => {
                let text = read_text(file, FileKind::SETTINGS)?;
                designed(&file.display().to_string(), &text, &[])?;
                Some((file.display().to_string(), text, Vec::new()))
            }
        };
        let script = match &options.script {
            None => None,
            Some(file) => Some(read_text(file, FileKind::SETTINGS)?),
        };
        let page = options.page.iter().cloned();
        let record = options.record.iter().flat_map(|file| [file.clone(), file.with_extension(FIGURE)]);
        page.chain(record).try_for_each(|file| free(&file, options.force))?;
        let drive = self.reached(options)?;
        let disturbance = Disturbance::default();
        let page = options.page.as_ref().map(|file| Page { file: file.clone(), due: Instant::now() });
        // The firmware counts core cycles on a chip, and in the emulator executed instructions.
        let unit = if options.reach.is_port() { "cycles" } else { "instructions" };
        let alarm = AlarmState::default();
        let record = options.record.as_ref().map(|file| Recording::new(file, drive.design())).transpose()?;
        let mut session = Session { drive, scenario, seen: Vec::new(), disturbance, alarm, page, record, unit };
        self.greet(&session)?;
        // A request to stop first saves the observations.
        let _kept = stop::keeping();
        let done = match script {
            Some(script) => self.obey_script(&mut session, &script, options),
            None => self.obey_typed(&mut session),
        };
        let done = if self.is_stopped() { Err(told_to_stop()) } else { done };
        if let Some(page) = &session.page {
            write_page(&page.file, &session, false)?;
        }
        if let Some(record) = &options.record {
            session.record.as_mut().map_or(Ok(()), Recording::write)?;
            let stem = record.file_stem().unwrap_or_default().to_string_lossy();
            let folder = record.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            figure(&session.seen, &session)
                .write(folder, &stem)
                .map_err(|error| Failure::writing(folder.display(), &error))?;
        }
        let traffic = session.drive.traffic();
        self.note(&format!("{} requests, {} sent again", traffic.answered, traffic.repeated));
        done.map(|()| status::DONE)
    }

    /// Connects to the drive: the firmware in the emulator, or a board.
    fn reached(&self, options: &LiveOptions) -> Result<LiveDrive<Line<'a>>, Failure> {
        let LiveOptions { image, reach, seed, .. } = options;
        let (transport, within, question) = way(image, reach, *seed, Emulator::counting)?;
        LiveDrive::connect(Stoppable::new(transport, self.stop), within)
            .map_err(|error| if self.is_stopped() { told_to_stop() } else { failed(format!("{error}; {question}")) })
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Prints the kind of drive, and checks its design against the scenario.
    fn greet(&mut self, session: &Session<'_>) -> Result<(), Failure> {
        let design = session.drive.design();
        let (what, hz) = (kind(design), 1.0 / session.drive.period_s());
        self.say(&format!("drive of a {what} at {} Hz; `help` lists the commands", significant(hz, 6)))?;
        let Some((name, text, _)) = &session.scenario else { return Ok(()) };
        let ours = designed(name, text, &[])?;
        of_one_form(name, &ours, design, &STARTED)?;
        let side = Side::of(&Source { file: name, text, sets: &[] }, design.instance.model)?;
        let (keyed, rest) = side.differences(design, &ours);
        for [there, here] in &keyed {
            self.note(&format!("note: {} = {there} on the drive, {here} in {name}", there.key));
        }
        if !rest.is_empty() {
            self.note(&format!("note: by rule {} differ too: {}", plural(rest.len(), "number"), rest.join(", ")));
        }
        Ok(())
    }

    fn obey_script(&mut self, session: &mut Session<'a>, script: &str, options: &LiveOptions) -> Result<(), Failure> {
        for (k, line) in script.lines().enumerate() {
            if !self.obey(session, line).map_err(|Failure { status, message }| {
                let file = options.script.as_ref().map_or_else(String::new, |file| file.display().to_string());
                Failure { status, message: format!("{file}:{}: {message}", k + 1) }
            })? {
                break;
            }
        }
        Ok(())
    }

    /// Executes commands from stdin. A rejected command is reported; a broken connection ends the session.
    fn obey_typed(&mut self, session: &mut Session<'a>) -> Result<(), Failure> {
        // A bounded queue: input that is faster than the drive waits.
        let (send, lines) = mpsc::sync_channel(64);
        std::thread::spawn(move || {
            let mut typed = io::stdin().lock();
            while let Some(line) = next_line(&mut typed) {
                if send.send(line).is_err() {
                    break;
                }
            }
        });
        loop {
            if self.is_stopped() {
                return Err(told_to_stop());
            }
            match lines.recv_timeout(GLANCE) {
                Ok(line) => match line.map_err(bad).and_then(|line| self.obey(session, &line)) {
                    Ok(true) => {}
                    Ok(false) => return Ok(()),
                    Err(failure) if failure.status == status::BAD_INPUT => {
                        self.note(&format!("error: {}", failure.message));
                    }
                    Err(failure) => return Err(failure),
                },
                Err(RecvTimeoutError::Timeout) => {
                    self.look(session)?;
                }
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
        }
    }

    /// Executes one command. Returns `false` for `quit`.
    fn obey(&mut self, session: &mut Session<'a>, line: &str) -> Result<bool, Failure> {
        let words = line::words(line);
        let Some((&command, words)) = words.split_first() else { return Ok(true) };
        let period_s = session.drive.period_s();
        let refused = |error| refused_at(command, error);
        let ticks = |text: &str| ticks(command, text, period_s);
        match (command, words) {
            ("help", []) => {
                for (command, what) in COMMANDS {
                    self.say(&format!("  {command:<24}{what}"))?;
                }
            }
            ("quit", []) => return Ok(false),
            ("show", []) => {
                let seen = self.look(session)?;
                self.say(&in_words(&seen, session.drive.design(), period_s, session.unit))?;
            }
            ("move", [angle, time @ ..]) if time.len() < 2 => {
                let angle_rad = finite(command, angle)?;
                if angle_rad.abs() > FURTHEST_RAD {
                    return Err(bad(format!(
                        "move: {angle} rad: expected -{0} to {0} rad (10000 revolutions). Give an angle in this range",
                        FURTHEST_RAD.floor()
                    )));
                }
                let ticks = time.first().map_or(Ok(0), |text| ticks(text))?;
                let planned = session.drive.move_to(angle_rad, ticks).map_err(refused)?;
                self.say(&moved(&format!("to {angle} rad"), planned, period_s))?;
            }
            ("stop", time) if time.len() < 2 => {
                let planned = session.drive.stop(ticks(time.first().unwrap_or(&"0.2"))?).map_err(refused)?;
                self.say(&moved("to rest", planned, period_s))?;
            }
            ("set", sets @ [_, ..]) => self.set(session, sets)?,
            ("wait", [time]) => self.wait(session, ticks(time)?)?,
            ("trace" | "blackbox", [file]) if *file != FORCE => self.keep(session, Path::new(file), false)?,
            ("trace" | "blackbox", [file, FORCE] | [FORCE, file]) => self.keep(session, Path::new(file), true)?,
            ("reset", []) => {
                let seen = self.look(session)?;
                if let Some(why) = still_brakes(&seen, session.drive.design()) {
                    return Err(bad(format!("reset: {why}")));
                }
                session.drive.order(Order::Reset).map_err(refused)?;
                let unsaved = std::mem::take(&mut session.alarm).unsaved;
                let lost = unsaved.map_or_else(String::new, |tick| {
                    format!("; discarded the unsaved trace buffer of the alarm at {}", at(tick, period_s))
                });
                self.say(&format!("reset: at rest at the present angle{lost}"))?;
            }
            ("release", []) => self.release(session)?,
            ("plot", [folder]) if *folder != FORCE => self.plot(session, Path::new(folder), false)?,
            ("plot", [folder, FORCE] | [FORCE, folder]) => self.plot(session, Path::new(folder), true)?,
            _ => {
                let done = disturb(session, command, words)?;
                self.say(&done)?;
            }
        }
        Ok(true)
    }

    /// Observes the drive for a number of its ticks.
    fn wait(&mut self, session: &mut Session<'a>, ticks: u32) -> Result<(), Failure> {
        let begin = self.look(session)?.tick;
        let (mut last, mut moved) = (begin, Instant::now());
        while last.wrapping_sub(begin) < ticks {
            let tick = self.look(session)?.tick;
            if tick != last {
                (last, moved) = (tick, Instant::now());
            } else if moved.elapsed() > STANDS_STILL {
                return Err(failed(format!("the drive replies, but its tick counter stays at {tick}")));
            }
        }
        Ok(())
    }

    /// Observes the drive once. An alarm is reported once.
    fn look(&mut self, session: &mut Session<'a>) -> Result<Observed, Failure> {
        let seen = session.drive.observe()?;
        if session.seen.len() == MOST_ROWS {
            session.seen.drain(..MOST_ROWS / 2);
        }
        session.seen.push(seen);
        if let Some(record) = &mut session.record {
            record.waiting += &row(&session.drive, &seen);
            if Instant::now() >= record.due {
                record.write()?;
            }
        }
        self.report_alarms(session, &seen)?;
        if let Some(page) = &mut session.page
            && Instant::now() >= page.due
        {
            page.due = Instant::now() + REDRAWN;
            let file = page.file.clone();
            write_page(&file, session, true)?;
        }
        Ok(seen)
    }

    /// Prints a line for each alarm that begins, with its cause, and for a stop after braking.
    fn report_alarms(&mut self, session: &mut Session<'a>, seen: &Observed) -> Result<(), Failure> {
        let Session { drive, alarm, .. } = session;
        let is_stopped = seen.health.contains(Health::STOPPED);
        let brakes = seen.health.contains(Health::BRAKES);
        let period_s = drive.period_s();
        // A drive that has stopped or brakes rejects its input. This is no other alarm.
        let is_known = alarm.stopped || alarm.braked;
        let is_new = seen.frozen && !alarm.frozen && !is_known;
        let begins = is_new.then(|| drive.newest_remembered()).transpose()?.flatten();
        let begins = begins.map(|(tick, of)| (tick, alarms(of.health), Some(of.u))).filter(|it| !it.1.is_ok());
        alarm.unsaved = begins.map(|it| it.0).or(alarm.unsaved);
        let goes_on = !is_stopped && !brakes && seen.started && !seen.health.contains(Health::WAITS);
        let present = if goes_on { alarms(seen.health) } else { Health::OK };
        let others = without(present, alarm.reported);
        let others = (begins.is_none() && !others.is_ok()).then_some((seen.tick, others, Some(seen.u)));
        if let Some((tick, flags, u)) = begins.or(others) {
            let loads_n_m = seen.started.then(|| seen.estimates.map(|it| it[3]));
            let values = Values { loads_n_m, sigma_star: Some(seen.sigma_star).filter(|_| !is_stopped), u };
            // One tick after an alarm no flag shows the reaction yet.
            let answered = Health::from_bits(stopping(drive.design()).bits() & flags.bits());
            let will_brake = !answered.is_ok() && stopping(drive.design()).contains(Health::BRAKES);
            let (what, then) = match (is_stopped, brakes || will_brake) {
                (true, _) => ("has stopped", "`reset` restarts it"),
                (_, true) => ("brakes", "`reset` restarts it after the stop"),
                _ if !answered.is_ok() => ("stops", "`reset` restarts it"),
                _ => ("goes on", "`release` lets the buffer run again"),
            };
            self.note(&format!(
                "alarm at {}: {} (estimates of t = {} s); the drive {what}. Save the trace buffer with `trace FILE`; \
                 {then}",
                at(tick, period_s),
                causes(flags, drive.design(), values),
                significant(f64::from(if is_stopped { tick } else { seen.tick }) * period_s, 6),
            ));
            alarm.reported = alarm.reported.union(flags);
        } else if is_stopped && !alarm.stopped {
            self.note(&format!(
                "stopped before {}: the current is off; `reset` restarts the drive",
                at(seen.tick, period_s)
            ));
        }
        if !present.is_ok() {
            alarm.seen = seen.tick;
        } else if f64::from(seen.tick.wrapping_sub(alarm.seen)) * period_s > OVER_S {
            alarm.reported = Health::OK;
        }
        (alarm.stopped, alarm.braked, alarm.frozen) = (is_stopped, brakes, seen.frozen);
        Ok(())
    }

    /// Empties the trace buffer, unless it holds an alarm that no file has.
    fn release(&mut self, session: &mut Session<'a>) -> Result<(), Failure> {
        let is_stopped = self.look(session)?.health.contains(Health::STOPPED);
        if let Some(tick) = session.alarm.unsaved {
            let then = if is_stopped { "`reset`" } else { "`release`" };
            return Err(bad(format!(
                "release: the trace buffer holds the alarm at {}, which no file has. Save it with `trace FILE`, then \
                 {then}",
                at(tick, session.drive.period_s())
            )));
        }
        if is_stopped {
            return Err(bad(
                "release: the drive is stopped, and its trace buffer would freeze at once. `reset` restarts \
                            the drive and empties the buffer",
            ));
        }
        session.drive.order(Order::Release).map_err(|error| refused_at("release", error))?;
        session.alarm.frozen = false;
        self.say("release: the trace buffer is empty and records")
    }

    /// Writes a figure of all observations into a folder.
    fn plot(&mut self, session: &Session<'a>, folder: &Path, force: bool) -> Result<(), Failure> {
        let path = folder.join("live").with_extension(FIGURE);
        free(&path, force)?;
        let failed = |error: io::Error| Failure::writing(folder.display(), &error);
        figure(&session.seen, session).write(folder, "live").map_err(failed)?;
        let time = |seen: Option<&Observed>| {
            seen.map_or_else(String::new, |seen| significant(f64::from(seen.tick) * session.drive.period_s(), 6))
        };
        let [from, to] = [session.seen.first(), session.seen.last()].map(time);
        let count = plural(session.seen.len(), "observation");
        self.say(&format!("wrote {}: {count}, t = {from} to {to} s", path.display()))
    }

    fn set(&mut self, session: &mut Session<'a>, sets: &[&str]) -> Result<(), Failure> {
        let Some((name, text, before)) = &session.scenario else {
            return Err(bad(format!(
                "set: {}: this session has no scenario. Start again with the scenario that the firmware was designed \
                 from, as in `host-sim live firmware/drive.toml`",
                sets.join(" ")
            )));
        };
        let mut all = before.clone();
        all.extend(sets.iter().map(ToString::to_string));
        let running = session.drive.design();
        let source = Source { file: name, text, sets: &all };
        let side = Side::of(&source, running.instance.model)?;
        let place = format!("set: {}", sets.join(" "));
        // A fault of the whole design has the file as its place, but the typed values are its cause.
        let of_typed = |Failure { status, message }| Failure {
            status,
            message: match message.strip_prefix("--set ") {
                Some(message) => format!("set: {message}"),
                None => format!("{place}: {}", message.strip_prefix(&format!("{name}: ")).unwrap_or(&message)),
            },
        };
        // Before the design: a rule that the new value breaks is not the reason.
        typed_as_fixed("set", &side, &source, before.len(), running, &FIRMWARE)?;
        let (experiment, design) = checked(name, text, &all).map_err(of_typed)?;
        of_one_form(&place, &design, running, &FIRMWARE)?;
        of_one_firmware(&place, &side, &design, running, &FIRMWARE)?;
        has_effect("set", &source, before.len())?;
        if design == *running {
            return Err(bad(format!("{place}: no change: the drive runs with this value. Give another value")));
        }
        // What the file says is sent as a whole, with the typed keys.
        let (keyed, _) = side.differences(running, &design);
        let typed = |key: &str| all.iter().any(|set| key.split('[').next() == Some(key_of(set)));
        let is_of_file = |key: &str| scenario::number_at(&source, key).is_ok_and(|number| number.is_some());
        let others = keyed.iter().filter(|[there, _]| !typed(there.key) && is_of_file(there.key));
        let others: Vec<String> =
            others.map(|[there, here]| format!("{} = {there} on the drive, {here} in {name}", there.key)).collect();
        if !others.is_empty() {
            return Err(bad(format!(
                "{place}: {name} is not the scenario of this drive, and `set` would change more than you typed: {}. \
                 Start again with the scenario of the drive, or type these keys too",
                others.join("; ")
            )));
        }
        let effect = margins_in_words(&experiment);
        let swapped = session.drive.swap(&design).map_err(|error| refused_at("set", error))?;
        let Swapped { tick, ticks, time, u: [before, after], .. } = swapped;
        if let Some((_, _, sets)) = &mut session.scenario {
            *sets = all;
        }
        self.say(&format!(
            "set {}: active from t = {} s (tick {tick}); design time {time} {} in {ticks} ticks, u {} A before, {} A \
             after; {effect}",
            sets.join(" "),
            significant(f64::from(tick) * session.drive.period_s(), 6),
            session.unit,
            significant(f64::from(before), 4),
            significant(f64::from(after), 4)
        ))
    }

    /// Saves the trace buffer as a file. A running buffer is frozen while it is read.
    fn keep(&mut self, session: &mut Session<'a>, file: &Path, force: bool) -> Result<(), Failure> {
        // Before seconds of reading.
        free(file, force)?;
        self.look(session)?;
        let was_frozen = session.drive.observe()?.frozen;
        let refused = |error| refused_at("trace", error);
        if !was_frozen {
            session.drive.order(Order::Freeze).map_err(refused)?;
        }
        let mut black_box = session.drive.black_box().map_err(refused)?;
        if !was_frozen {
            session.drive.order(Order::Release).map_err(refused)?;
        }
        if let Some((name, text, sets)) = &session.scenario
            && designed(name, text, sets)? == *session.drive.design()
        {
            black_box.scenario = text.lines().map(ToOwned::to_owned).collect();
            black_box.sets.clone_from(sets);
        }
        write_file(file, &black_box.to_text(), force)?;
        session.alarm.unsaved = None;
        let period_s = session.drive.period_s();
        let span = significant(black_box.len() as f64 * period_s, 4);
        self.say(&format!("wrote {}: the last {} ticks ({span} s)", file.display(), black_box.len()))?;
        let last = black_box.last().map_err(|why| failed(named(file, &why)))?;
        if let Some((Again { tick, then, now }, loads)) = last.filter(|(last, _)| !alarms(last.then.health).is_ok()) {
            let (flags, u) = (alarms(then.health), Some(then.u));
            let values = Values { loads_n_m: Some(loads), sigma_star: Some(now.sigma_star), u };
            let causes = causes(flags, session.drive.design(), values);
            self.say(&format!("alarm at {}: {causes}", at(tick, period_s)))?;
        }
        Ok(())
    }

    pub(super) fn replay(&mut self, options: &ReplayOptions) -> Result<u8, Failure> {
        let ReplayOptions { file, sets, scenario, out } = options;
        let text = read_text(file, FileKind::TRACE)?;
        let black_box = BlackBox::from_text(&text).map_err(|why| bad(named(file, &why)))?;
        let again = black_box.replay().map_err(|why| bad(named(file, &why)))?;
        let differ = again.iter().filter(|again| !again.is_same()).count();
        let other = if sets.is_empty() && scenario.is_none() {
            None
        } else {
            let (name, text) = match scenario {
                Some(path) => {
                    let text = read_text(path, FileKind::SETTINGS)?;
                    (path.display().to_string(), text)
                }
                None if black_box.scenario.is_empty() => {
                    let why = "the trace buffer file contains no scenario: give it with --scenario FILE";
                    return Err(bad(named(file, why)));
                }
                None => (format!("the scenario in {}", file.display()), black_box.scenario.join("\n")),
            };
            let mut all = if scenario.is_some() { Vec::new() } else { black_box.sets.clone() };
            all.extend(sets.iter().cloned());
            let source = Source { file: &name, text: &text, sets: &all };
            let side = Side::of(&source, black_box.design.instance.model)?;
            let from = all.len() - sets.len();
            typed_as_fixed("--set", &side, &source, from, &black_box.design, &RECORDED)?;
            let place = if sets.is_empty() { name.clone() } else { format!("--set {}", sets.join(" --set ")) };
            let design = designed(&name, &text, &all).map_err(|Failure { status, message }| Failure {
                status,
                message: if message.starts_with("--set ") || sets.is_empty() {
                    message
                } else {
                    format!("{place}: {message}")
                },
            })?;
            of_one_form(&place, &design, &black_box.design, &RECORDED)?;
            of_one_firmware(&place, &side, &design, &black_box.design, &RECORDED)?;
            has_effect("--set", &source, from)?;
            if design == black_box.design {
                return Err(bad(format!("{place}: no change: this is the recorded design. Give another value")));
            }
            Some(black_box.replay_with(&design).map_err(|why| bad(named(file, &why)))?)
        };
        let shown = other.as_ref().unwrap_or(&again);
        self.say(summary(&again, other.as_deref()).to_string().trim_end())?;
        if let Some(Again { tick, then, now }) = again.iter().find(|again| !again.is_same()) {
            self.say(&format!(
                "recorded design: first difference at tick {tick}: recorded u {:?} A, {}; replayed u {:?} A, {}",
                then.u, then.health, now.u, now.health
            ))?;
        }
        if let Some(folder) = out {
            let period_s = black_box.design.numbers().next().unwrap_or(1.0);
            fs::create_dir_all(folder).map_err(|error| Failure::writing(folder.display(), &error))?;
            let path = folder.join("replay.csv");
            write_whole(&path, |out| out.write_all(replayed_rows(shown).as_bytes()))
                .map_err(|error| Failure::writing(path.display(), &error))?;
            replayed_figure(shown, &file.display().to_string(), sets, period_s)
                .write(folder, "replay")
                .map_err(|error| Failure::writing(folder.display(), &error))?;
        }
        self.say(&verdict(again.len(), differ, other.as_deref()))?;
        Ok(if differ == 0 { status::DONE } else { status::FAILED })
    }
}

/// Returns the last line of a replay: of the recorded design, and of another one.
fn verdict(ticks: usize, differ: usize, other: Option<&[Again]>) -> String {
    let recorded = match (differ, other) {
        (0, None) => return format!("result: identical bits in {ticks} ticks"),
        (0, _) => format!("identical bits in {ticks} ticks"),
        _ => format!("{differ} of {ticks} ticks differ"),
    };
    let Some(other) = other else { return format!("result: {recorded}") };
    let off = other.iter().filter(|again| !again.is_same()).count();
    format!("result: {recorded} with the recorded design; {off} of {ticks} ticks differ with the other design")
}

/// Executes a command for the simulated plant on the target. Returns the new state of the plant.
fn disturb(session: &mut Session<'_>, command: &str, words: &[&str]) -> Result<String, Failure> {
    let mut disturbance = session.disturbance;
    let done = match (command, words) {
        ("stick", named) => {
            let shafts = shafts(session.drive.design());
            if let Some(other) = named.iter().find(|shaft| !shafts.contains(shaft)) {
                let (has, kind) = (shafts.join(" and "), kind(session.drive.design()));
                let plural = if shafts.len() > 1 { "encoders" } else { "one encoder" };
                return Err(bad(format!(
                    "stick: {other}: this {kind} has {plural}, {has}. Use `stick {}`, or `stick` for none",
                    shafts.join(" ")
                )));
            }
            for (i, shaft) in shafts.iter().enumerate() {
                disturbance.stuck[i] = named.contains(shaft);
            }
            format!("stick: frozen encoders: {}", if named.is_empty() { "none".into() } else { named.join(", ") })
        }
        ("load", [torque, time @ ..]) if time.len() < 2 => {
            let load_n_m = finite(command, torque)?;
            let most_n_m = LARGEST_LOAD * torque_at_limit_n_m(session.drive.design());
            if load_n_m.abs() > most_n_m {
                return Err(bad(format!(
                    "load: {torque} N m: expected -{0} to {0} N m ({LARGEST_LOAD} times the torque at the current \
                     limit)",
                    significant(most_n_m, 3)
                )));
            }
            disturbance.load_n_m = load_n_m as f32;
            disturbance.load_ticks =
                time.first().map_or(Ok(0), |time| ticks(command, time, session.drive.period_s()))?;
            format!("load: {torque} N m{}", time.first().map_or_else(String::new, |time| format!(" for {time} s")))
        }
        _ => return Err(bad(unknown(command))),
    };
    session.drive.disturb(disturbance).map_err(|error| refused_at(command, error))?;
    if disturbance.load_ticks > 0 {
        // It ends on the target; a later `stick` must not repeat it.
        (disturbance.load_n_m, disturbance.load_ticks) = (0.0, 0);
    }
    session.disturbance = disturbance;
    Ok(done)
}

/// Returns the flags at which a drive stops; with [`Health::BRAKES`] it brakes first.
fn stopping(design: &Loadable) -> Health {
    Health::from_bits(number_of(design, "stops_at").unwrap_or(0.0) as u16)
}

/// Returns the torque behind the gear at the current limit, N m.
fn torque_at_limit_n_m(design: &Loadable) -> f64 {
    let per_a = number_of(design, &format!("{}.torque_n_m_per_a", kind(design)));
    per_a.zip(number_of(design, "limits.max")).map_or(f64::INFINITY, |(per_a, most_a)| per_a * most_a)
}

/// Returns the next line without its end, or the reason why it is invalid. `None` at the end of the input.
fn next_line(typed: &mut impl BufRead) -> Option<Result<String, String>> {
    let mut line = Vec::new();
    let read = |typed: &mut dyn BufRead, line: &mut Vec<u8>| {
        line.clear();
        typed.take(LONGEST_LINE + 1).read_until(b'\n', line).unwrap_or(0)
    };
    if read(typed, &mut line) == 0 {
        return None;
    }
    let is_whole = |line: &[u8]| line.ends_with(b"\n") || line.len() as u64 <= LONGEST_LINE;
    if !is_whole(&line) {
        while !is_whole(&line) {
            read(typed, &mut line);
        }
        return Some(Err(format!("a line of more than {LONGEST_LINE} bytes: expected a command, `help` lists them")));
    }
    let text = String::from_utf8(line).map(|text| text.trim_end().to_owned());
    Some(text.map_err(|error| format!("{:?} is not UTF-8 text", String::from_utf8_lossy(error.as_bytes()))))
}

/// Opens the connection to a drive. Returns it with the timeout of a round trip and the hint for a missing reply.
pub(super) fn way(
    image: &Path,
    to: &Reach,
    seed: u64,
    boot: Boot,
) -> Result<(Box<dyn Transport>, Duration, String), Failure> {
    let Reach { port, baud, faults } = to;
    let (transport, within, question): (Box<dyn Transport>, _, _) = if let Some(port) = port {
        let transport = Serial::open(port, *baud).map_err(|error| failed(error.0))?;
        // 10 bits per byte in both directions. Doubled: a USB adapter collects bytes for 16 ms.
        let line = Duration::from_secs_f64(10.0 * (REQUEST_LEN + REPLY_LEN) as f64 / f64::from(*baud));
        let question = format!(
            "check the port {}, --baud {baud}, and that the board runs the firmware `drive` or `motor`",
            port.display()
        );
        (Box::new(transport), Duration::from_millis(50) + 2 * line, question)
    } else {
        present(image, "--image").map_err(failed)?;
        let transport = boot(image).map_err(|error| failed(error.0))?;
        let question = format!("check that {} is the firmware `drive` or `motor` of this version", image.display());
        (Box::new(transport), Duration::from_millis(100), question)
    };
    Ok(match faults {
        Some(rate) => (Box::new(Faulty::new(transport, Rates::all(*rate), seed)), Duration::from_millis(20), question),
        None => (transport, within, question),
    })
}

/// Key that chooses between a position and a speed.
const MODE: &str = "drive.mode";
/// Remedy for a drive that controls a speed.
const OF_SPEED: &str = "The firmware of `live` moves an angle. Simulate a speed drive with `host-sim run`, and add it \
                        to your own firmware with `host-sim export`";

/// Drive that another design must fit, in words.
struct Host {
    /// Subject of a sentence.
    name: &'static str,
    /// Remedy for a difference that no design can have.
    remedy: &'static str,
}

const FIRMWARE: Host =
    Host { name: "the firmware", remedy: "Build firmware from a scenario with this value (docs/live.md)" };
const STARTED: Host = Host {
    name: "the firmware",
    remedy: "Give the scenario of this firmware, or build firmware from this scenario (docs/live.md)",
};
const RECORDED: Host =
    Host { name: "the recorded drive", remedy: "Use `host-sim run` to simulate a drive with this value" };

/// Checks that two designs are of one form.
fn of_one_form(place: &str, design: &Loadable, running: &Loadable, host: &Host) -> Result<(), Failure> {
    if design.instance == running.instance {
        return Ok(());
    }
    let kinds = [design, running].map(kind);
    if kinds[0] != kinds[1] {
        return Err(bad(format!("{place}: [{}]: {} has a [{}]. {}", kinds[0], host.name, kinds[1], host.remedy)));
    }
    let forms = form_keys(design.instance).into_iter().zip(form_keys(running.instance));
    let differ: Vec<String> = forms
        .filter(|(ours, theirs)| ours != theirs)
        .map(|((key, value), (_, expected))| format!("{key} = {value}: {} has {key} = {expected}", host.name))
        .collect();
    Err(bad(format!("{place}: {}. {}", differ.join("; "), host.remedy)))
}

/// Returns true if no new design changes this number of a drive.
fn is_fixed(number: &str) -> bool {
    number == "period_s" || number.starts_with("encoder")
}

/// Checks that a scenario sets no other form, period, encoder or gear than the drive has.
///
/// The settings from this one on are typed at `place`; an earlier value comes from the file.
fn typed_as_fixed(
    place: &str,
    side: &Side,
    source: &Source<'_>,
    from: usize,
    running: &Loadable,
    host: &Host,
) -> Result<(), Failure> {
    let sets = |key: &str| {
        source.sets[from..].iter().any(|set| key.split('[').next().unwrap_or_default().ends_with(key_of(set)))
    };
    let place = |key: &str| if sets(key) { place } else { source.file };
    // A value outside its own range is no value of a drive.
    let is_valid = |key: &str| {
        let is_it = |part: scenario::ErrorParts<'_>| !part.key.is_empty() && key.starts_with(part.key);
        !scenario::parse(source, "drive").err().is_some_and(|error| error.parts().any(is_it))
    };
    for (key, has) in form_keys(running.instance) {
        let number = scenario::number_at(source, key)?.map(|typed| typed.to_string());
        let typed = number.or(scenario::text_at(source, key)?.filter(|_| key == MODE).map(|it| format!("{it:?}")));
        if let Some(typed) = typed.filter(|typed| typed != has && is_valid(key)) {
            let (place, remedy) = (place(key), if key == MODE { OF_SPEED } else { host.remedy });
            return Err(bad(format!("{place}: {key} = {typed}: {} has {key} = {has}. {remedy}", host.name)));
        }
    }
    for has in running.names().iter().filter(|name| is_fixed(name)).filter_map(|name| side.keyed(running, name)) {
        let typed = scenario::number_at(source, has.key)?.filter(|typed| (typed - has.value).abs() > 1e-9 * has.value);
        if let Some(typed) = typed.filter(|_| is_valid(has.key)) {
            return Err(bad(format!(
                "{}: {} = {typed}: {}",
                place(has.key),
                has.key,
                fixed(&format!(" ({} = {has})", has.key), host)
            )));
        }
    }
    Ok(())
}

/// Checks that a design has the period, the encoders and the gear of the drive.
fn of_one_firmware(
    place: &str,
    side: &Side,
    design: &Loadable,
    running: &Loadable,
    host: &Host,
) -> Result<(), Failure> {
    let mut differ = design.names().into_iter().zip(design.numbers().zip(running.numbers()));
    let Some((name, _)) = differ.find(|(name, (one, other))| is_fixed(name) && one.to_bits() != other.to_bits()) else {
        return Ok(());
    };
    let has = side.keyed(running, &name).map_or_else(String::new, |it| format!(" ({} = {it})", it.key));
    Err(bad(format!("{place}: {}", fixed(&has, host))))
}

fn fixed(has: &str, host: &Host) -> String {
    format!("period, encoder and gear are fixed in {}{has}. {}", host.name, host.remedy)
}

/// Returns the margins and the current noise of a scenario's base gains.
fn margins_in_words(experiment: &Experiment) -> String {
    // A drive that `drive.accept_unstable` lets pass has none.
    let (margins, noise_a) = match margins_and_noise(experiment) {
        Ok(found) => found,
        Err(error) => return error.to_string(),
    };
    let phase = margins.phase_deg.map_or_else(|| "unlimited".into(), |deg| format!("{} deg", significant(deg, 3)));
    format!(
        "phase margin {phase}, peak sensitivity {}, current noise {} A rms (linearised loop)",
        significant(margins.sensitivity_peak, 3),
        significant(noise_a, 3)
    )
}

/// Returns the key of a setting `KEY=VALUE`.
fn key_of(set: &str) -> &str {
    set.split('=').next().unwrap_or_default().trim()
}

/// Returns true if a setting gives its key the value that the scenario has, as text or number.
fn is_in_force(name: &str, text: &str, before: &[String], set: &str) -> bool {
    let key = key_of(set);
    let with = [before, &[set.to_owned()]].concat();
    let [then, now] = [before, &with].map(|sets| {
        let source = Source { file: name, text, sets };
        (scenario::number_at(&source, key).ok().flatten(), scenario::text_at(&source, key).ok().flatten())
    });
    now == then && now != (None, None)
}

/// Checks that each setting from this one on changes the design.
fn has_effect(place: &str, source: &Source<'_>, from: usize) -> Result<(), Failure> {
    let Source { file, text, sets } = *source;
    let of = |sets: &[String]| {
        let mut experiment = scenario::parse(&Source { file, text, sets }, "drive").ok()?;
        experiment.leave_rest_band();
        for_target(&experiment).ok()
    };
    let whole = of(sets);
    for k in from..sets.len() {
        let others = [&sets[..k], &sets[k + 1..]].concat();
        if of(&others) == whole && !is_in_force(file, text, &others, &sets[k]) {
            return Err(bad(format!(
                "{place}: {}: no effect, the design of the drive stays the same. The value is in force, or the key \
                 belongs to the simulation, the mounting of the encoder or the rest band. Give another value, or a \
                 key that the design depends on",
                sets[k]
            )));
        }
    }
    Ok(())
}

/// Returns the reason why a drive that brakes cannot be reset yet.
fn still_brakes(seen: &Observed, design: &Loadable) -> Option<String> {
    if !seen.health.contains(Health::BRAKES) || seen.health.contains(Health::STOPPED) {
        return None;
    }
    let speeds = seen.estimates.iter().zip(shafts(design)).map(|(estimates, _)| f64::from(estimates[1].abs()));
    let speed_rad_s = speeds.fold(0.0, f64::max);
    Some(format!(
        "the drive brakes, a shaft turns at {} rad/s ({} r/min). Wait until the drive has stopped, then `reset`",
        significant(speed_rad_s, 3),
        significant(speed_rad_s * 30.0 / std::f64::consts::PI, 3)
    ))
}

/// Returns the time and number of a tick.
fn at(tick: u32, period_s: f64) -> String {
    format!("t = {} s (tick {tick})", significant(f64::from(tick) * period_s, 6))
}

/// Returns a count with its noun.
fn plural(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

fn told_to_stop() -> Failure {
    Failure { status: status::INTERRUPTED, message: "stopped on request; the drive keeps running".into() }
}

fn named(file: &Path, why: &str) -> String {
    format!("{}: {why}", file.display())
}

/// Converts an error of a command: a refusal is invalid input, any other error a failure of the connection.
fn refused_at(command: &str, error: PortError) -> Failure {
    match error {
        PortError::Refused(why) => bad(format!("{command}: {why}")),
        other => failed(other.to_string()),
    }
}

fn finite(command: &str, text: &str) -> Result<f64, Failure> {
    let number: Option<f64> = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| bad(format!("{command}: {text:?} is not a number")))
}

fn positive(command: &str, text: &str) -> Result<f64, Failure> {
    let time_s = finite(command, text)?;
    let is_good = time_s > 0.0 && time_s <= 3600.0;
    if is_good { Ok(time_s) } else { Err(bad(format!("{command}: {text} s: expected more than 0, up to 3600"))) }
}

/// Returns a time as a number of ticks.
fn ticks(command: &str, text: &str, period_s: f64) -> Result<u32, Failure> {
    Ok(((positive(command, text)? / period_s).round() as u32).max(1))
}

/// Returns the message for an unknown or incomplete command, with the nearest one.
fn unknown(command: &str) -> String {
    let command = if command == "blackbox" { "trace" } else { command };
    let word = |form: &&(&'static str, &str)| form.0.split(' ').next().unwrap_or_default();
    let distance = |form: &&(&'static str, &str)| strsim::damerau_levenshtein(word(form), command);
    let nearest = COMMANDS.iter().min_by_key(distance).map_or("", |form| form.0);
    if nearest.split(' ').next() == Some(command) {
        format!("{command}: expected `{nearest}`")
    } else {
        format!("{command}: unknown command; nearest is `{nearest}`, `help` lists all")
    }
}

fn kind(design: &Loadable) -> &'static str {
    if design.instance.model == Model::Joint { "joint" } else { "motor" }
}

fn shafts(design: &Loadable) -> &'static [&'static str] {
    if design.instance.model == Model::Joint { &["link", "motor"] } else { &["motor"] }
}

fn moved(what: &str, [start, ticks]: [u32; 2], period_s: f64) -> String {
    let [begin, time] = [start, ticks].map(|it| f64::from(it) * period_s);
    let (begin, time) = (significant(begin, 6), significant(time, 4));
    format!("{what} in {time} s ({ticks} ticks), from t = {begin} s (tick {start})")
}

/// Returns the estimates of each shaft.
fn estimated(seen: &Observed, design: &Loadable) -> String {
    let number = |value: f32| significant(f64::from(value), 5);
    let mut text = String::new();
    for (shaft, [position, speed, _, load]) in shafts(design).iter().zip(seen.estimates) {
        let position = significant(turns_rad(seen) + f64::from(position), 6);
        // Writing to a String cannot fail.
        let begin = if text.is_empty() { "" } else { "; " };
        let _ = write!(text, "{begin}{shaft} {position} rad, {} rad/s, load {} N m", number(speed), number(load));
    }
    text
}

/// Returns the angle of the whole revolutions, rad.
fn turns_rad(seen: &Observed) -> f64 {
    f64::from(seen.turn) * std::f64::consts::TAU
}

fn in_words(seen: &Observed, design: &Loadable, period_s: f64, unit: &str) -> String {
    let number = |value: f32| significant(f64::from(value), 5);
    let mut text = format!("t = {} s (tick {})", significant(f64::from(seen.tick) * period_s, 6), seen.tick);
    let is_stopped = seen.health.contains(Health::STOPPED);
    // Writing to a String cannot fail.
    let _ = write!(text, ", r = {} rad", significant(turns_rad(seen) + f64::from(seen.reference), 6));
    if !is_stopped {
        let _ = write!(text, "; {}", estimated(seen, design));
    }
    let _ = write!(text, "; u = {} A", number(seen.u));
    if !is_stopped {
        let per = if design.instance.model == Model::Joint { "rad/s^3" } else { "rad/s" };
        let _ = write!(text, ", sigma* = {} {per}", number(seen.sigma_star));
    }
    let _ = write!(text, ", {}", seen.health);
    for (is, what) in [(seen.moving, "moving"), (seen.frozen, "trace buffer frozen"), (!seen.started, "not started")] {
        if is {
            let _ = write!(text, ", {what}");
        }
    }
    let _ =
        write!(text, "; interrupt: longest run {} {unit}, {} late", seen.worst, plural(seen.missed as usize, "tick"));
    if is_stopped {
        let _ = write!(text, "\nestimates of the tick of the stop: {}", estimated(seen, design));
    }
    text
}

/// Returns the first line of a record.
fn header(design: &Loadable) -> String {
    let mut text = String::from("tick,t_s,r_rad");
    for shaft in shafts(design) {
        let _ = write!(text, ",{shaft}_rad,{shaft}_rad_s,{shaft}_load_n_m");
    }
    text + ",u_a,sigma_star,health\n"
}

/// Returns an observation as a line of a record.
fn row(drive: &LiveDrive<Line<'_>>, seen: &Observed) -> String {
    let turns = turns_rad(seen);
    let is_stopped = seen.health.contains(Health::STOPPED);
    let t_s = f64::from(seen.tick) * drive.period_s();
    let mut text = format!("{},{t_s:?},{:?}", seen.tick, turns + f64::from(seen.reference));
    for ([position, speed, _, load], _) in seen.estimates.iter().zip(shafts(drive.design())) {
        // A stopped drive computes no estimates.
        let _ = if is_stopped {
            write!(text, ",,,")
        } else {
            write!(text, ",{:?},{speed:?},{load:?}", turns + f64::from(*position))
        };
    }
    let _ = writeln!(text, ",{:?},{:?},{}", seen.u, seen.sigma_star, seen.health.bits());
    text
}

/// Writes the page. With `moves` a browser reloads it every second.
fn write_page(file: &Path, session: &Session<'_>, moves: bool) -> Result<(), Failure> {
    let last = session.seen.last().map_or(0, |seen| seen.tick);
    let shown = (SHOWN_S / session.drive.period_s()) as u32;
    let from = session.seen.partition_point(|seen| last.wrapping_sub(seen.tick) > shown);
    let drawn = figure(&session.seen[from..], session).svg();
    let again = if moves { "<meta http-equiv=\"refresh\" content=\"1\">" } else { "" };
    let page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">{again}<title>drive</title></head>\n\
         <body>{drawn}</body></html>\n"
    );
    write_whole(file, |out| out.write_all(page.as_bytes())).map_err(|error| Failure::writing(file.display(), &error))
}

fn figure(seen: &[Observed], session: &Session<'_>) -> Figure {
    let period_s = session.drive.period_s();
    let line = |label: &str, color: usize, value: &dyn Fn(&Observed) -> f64| {
        let points = seen.iter().map(|seen| (f64::from(seen.tick) * period_s, value(seen)));
        Series::solid(label, color, points)
    };
    // A stopped drive computes no estimates: a gap.
    let of = |seen: &Observed, estimate: f32| {
        if seen.health.contains(Health::STOPPED) { f64::NAN } else { f64::from(estimate) }
    };
    let panel = |title: &str, y_label: &str, series: Vec<Series>| Panel {
        title: title.into(),
        x_label: "t (s)".into(),
        y_label: y_label.into(),
        series,
        ..Panel::default()
    };
    let y = line("y", 0, &|seen| turns_rad(seen) + of(seen, seen.estimates[0][0]));
    let r = line("r", BLACK, &|seen| turns_rad(seen) + f64::from(seen.reference)).styled(Style::Dashed);
    let loads = shafts(session.drive.design()).iter().enumerate();
    let loads = loads.map(|(i, shaft)| line(shaft, i, &|seen| of(seen, seen.estimates[i][3])));
    Figure {
        title: format!("Drive of a {}, observed over its serial port", kind(session.drive.design())),
        panels: vec![
            panel("Output and reference", "y (rad)", vec![y, r]),
            panel("Current", "u (A)", vec![line("", 0, &|seen| f64::from(seen.u))]),
            panel("Load estimate", "torque (N m)", loads.collect()),
        ],
        columns: 1,
    }
}

/// Returns the table of the recorded and the replayed run.
fn summary(then: &[Again], other: Option<&[Again]>) -> Table {
    let replayed = if other.is_some() { "other design" } else { "replayed" };
    let mut table = Table::new(["metric", "recorded", replayed]);
    let alarm = |of: &dyn Fn(&Again) -> Health, all: &[Again]| {
        let first = all.iter().find(|again| of(again).intersects(ALARMS));
        first.map_or_else(|| "none".into(), |again| format!("tick {}: {}", again.tick, of(again)))
    };
    let peak = |of: &dyn Fn(&Again) -> f32, all: &[Again]| {
        significant(f64::from(all.iter().map(|again| of(again).abs()).fold(0.0, f32::max)), 4)
    };
    let now = other.unwrap_or(then);
    table.row(["first alarm", &alarm(&|it| it.then.health, then), &alarm(&|it| it.now.health, now)]);
    table.row(["|u| peak (A)", &peak(&|it| it.then.u, then), &peak(&|it| it.now.u, now)]);
    if let Some(other) = other {
        let off = other.iter().map(|it| (it.now.u - it.then.u).abs()).fold(0.0, f32::max);
        table.row(["largest difference of u (A)", "-", &significant(f64::from(off), 4)]);
        let first = other.iter().find(|it| (it.now.u - it.then.u).abs() > 1e-3);
        let first = first.map_or_else(|| "none".into(), |it| format!("tick {}", it.tick));
        table.row(["first difference of u above 1 mA", "-", &first]);
    }
    table
}

fn replayed_rows(all: &[Again]) -> String {
    let mut text = String::from("tick,u_then_a,u_now_a,health_then,health_now\n");
    for Again { tick, then, now } in all {
        let _ = writeln!(text, "{tick},{:?},{:?},{},{}", then.u, now.u, then.health.bits(), now.health.bits());
    }
    text
}

fn replayed_figure(all: &[Again], file: &str, sets: &[String], period_s: f64) -> Figure {
    let line = |label: &str, color: usize, value: &dyn Fn(&Again) -> f32| {
        let points = all.iter().map(|again| (f64::from(again.tick) * period_s, f64::from(value(again))));
        Series { is_held: true, ..Series::solid(label, color, points) }
    };
    let now = if sets.is_empty() { "replayed".into() } else { format!("with {}", sets.join(" ")) };
    Figure {
        title: format!("{file}, replayed"),
        panels: vec![Panel {
            title: "Current".into(),
            x_label: "t (s)".into(),
            y_label: "u (A)".into(),
            series: vec![line("recorded", BLACK, &|it| it.then.u), line(&now, 0, &|it| it.now.u).styled(Style::Dashed)],
            ..Panel::default()
        }],
        columns: 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_of_a_session_has_the_words_of_its_page() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/live.md");
        let page = fs::read_to_string(page).expect("the page");
        let rows = page.lines().skip_while(|line| !line.starts_with("| command |")).skip(2);
        let rows: Vec<&str> = rows.take_while(|line| line.starts_with('|')).collect();
        let expected = COMMANDS.map(|(command, what)| format!("| `{command}` | {what} |"));
        assert_eq!(rows, expected);
    }
}
