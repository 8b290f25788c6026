//! Random campaigns against all external inputs. Every run has a seed of its own.
//!
//! | campaign | counted | a trial | requirement |
//! |---|---|---|---|
//! | [`ticks`] | ticks | samples, damaged states, resets, retunes | u within limits; two valid samples lead into M |
//! | [`files`] | files | a scenario with mutations | rejected in a line with its place, or it runs |
//! | [`bytes`] | bytes | garbage and frames, to the target or to the host | later valid input is answered |
//! | [`images`] | files | an ELF file with mutations | a result or a reason |
//! | [`boards`] | boards | one of 28 faulty targets | an error or the right run, in bounded time |
//!
//! No campaign may panic or take longer than [`HANGS`]. Integer overflow also panics, because the profile is the test
//! profile.
//!
//! ```text
//! attack [--seed N] [--seconds S] [--only CAMPAIGN] [--trial K] [--names]
//! ```
//!
//! Without `--seconds` each campaign runs to its amount; with it the campaigns share that time. A trial draws all its
//! random numbers from the seed, the campaign and its number K, so a single trial can be repeated. A repeated trial
//! prints its steps. The counts cover all threads. Exit status: 0 nothing broke, 1 a trial broke, 2 bad arguments.
//! `--names` prints the name of each trial before it begins; use it to find a fault that ends the whole program, such
//! as a stack overflow.

mod boards;
mod bytes;
mod files;
mod images;
mod ticks;

use integration_tests::strategy::{Rng, Trial};
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Campaign against one kind of input.
struct Campaign {
    name: &'static str,
    unit: &'static str,
    /// Amount of work without `--seconds`, in `unit`.
    amount: u64,
    /// Share of the time with `--seconds`.
    share: f64,
    /// Parallel trials; campaigns that mostly wait may have many.
    threads: usize,
    /// Runs one trial; `Err` describes the failure. The number selects the kind of trial, if there are several.
    run: fn(u64, &mut Trial) -> Result<(), String>,
}

const CAMPAIGNS: [Campaign; 5] = [
    Campaign { name: "ticks", unit: "ticks", amount: 1_000_000_000, share: 0.4, threads: 2, run: ticks::run },
    Campaign { name: "files", unit: "files", amount: 4000, share: 0.2, threads: 2, run: files::run },
    Campaign { name: "bytes", unit: "bytes", amount: 1_000_000_000, share: 0.15, threads: 2, run: bytes::run },
    Campaign { name: "images", unit: "files", amount: 1_000_000, share: 0.15, threads: 2, run: images::run },
    Campaign { name: "boards", unit: "boards", amount: 28, share: 0.1, threads: 28, run: boards::run },
];

/// Time limit of a trial. The longest trial is a board that never stops sending, some 5 s on an idle machine.
const HANGS: Duration = Duration::from_mins(1);
/// Time between two progress lines.
const PROGRESS: Duration = Duration::from_secs(10);
/// Failed trials of a campaign that are printed; all are counted.
const TOLD: u64 = 3;
/// Last log lines of a failed trial that are printed.
const LINES: usize = 8;

fn main() -> ExitCode {
    let asked = match Options::read(std::env::args().skip(1)) {
        Ok(asked) => asked,
        Err(message) => {
            eprintln!("error: {message}\nattack [--seed N] [--seconds S] [--only CAMPAIGN] [--trial K] [--names]");
            return ExitCode::from(2);
        }
    };
    std::panic::set_hook(Box::new(|panic| PANIC.with_borrow_mut(|last| *last = panic.to_string())));
    println!("seed {}", asked.seed);
    let chosen = CAMPAIGNS.iter().filter(|campaign| asked.only.is_none_or(|only| only == campaign.name));
    let broken: u64 = if let Some(number) = asked.trial {
        chosen.map(|campaign| u64::from(!is_repeated_well(campaign, &asked, number))).sum()
    } else {
        println!("{:<9}{:>15} {:<7}{:>9}{:>15}{:>8}", "campaign", "done", "", "s", "per second", "broken");
        let shares: f64 = chosen.clone().map(|campaign| campaign.share).sum();
        chosen.map(|campaign| run(campaign, &asked, shares)).sum()
    };
    ExitCode::from(u8::from(broken > 0))
}

/// Options of the command line.
struct Options {
    seed: u64,
    time: Option<Duration>,
    only: Option<&'static str>,
    trial: Option<u64>,
    names: bool,
}

impl Options {
    fn read(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as u64);
        // Short enough to type.
        let seed = Rng::new(now).bits() % 1_000_000_000;
        let mut asked = Self { seed, time: None, only: None, trial: None, names: false };
        while let Some(argument) = arguments.next() {
            if argument == "--names" {
                asked.names = true;
                continue;
            }
            let value = arguments.next().ok_or_else(|| format!("{argument}: a value is missing or not known"))?;
            let number = || value.parse::<u64>().map_err(|_| format!("{argument} {value}: expected a whole number"));
            match argument.as_str() {
                "--seed" => asked.seed = number()?,
                "--seconds" => asked.time = Some(Duration::from_secs(number()?)),
                "--trial" => asked.trial = Some(number()?),
                "--only" => {
                    let known = CAMPAIGNS.iter().find(|campaign| campaign.name == value);
                    let names = || CAMPAIGNS.map(|campaign| campaign.name).join(", ");
                    asked.only =
                        Some(known.ok_or_else(|| format!("--only {value}: expected one of {}", names()))?.name);
                }
                _ => return Err(format!("{argument}: not known")),
            }
        }
        if asked.trial.is_some() && asked.only.is_none() {
            return Err("--trial is one of a campaign: give --only as well".into());
        }
        Ok(asked)
    }
}

thread_local! {
    /// Message and place of the last panic of this thread.
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Runs one trial and catches a panic.
fn tried(campaign: &Campaign, seed: u64, number: u64, is_told: bool) -> (Trial, Result<(), String>) {
    let name = campaign.name.bytes().fold(0, |hash: u64, byte| hash << 8 | u64::from(byte));
    // Drawn twice, because generators of neighbouring seeds would run into each other.
    let of_campaign = Rng::new(seed ^ name).bits();
    let mut trial = Trial::new(Rng::new(of_campaign.wrapping_add(number)).bits(), is_told);
    let outcome = catch_unwind(AssertUnwindSafe(|| (campaign.run)(number, &mut trial)));
    let outcome = outcome.unwrap_or_else(|_| Err(PANIC.with_borrow(Clone::clone)));
    (trial, outcome)
}

/// Runs one trial alone and prints its log; returns true if it passes.
fn is_repeated_well(campaign: &Campaign, asked: &Options, number: u64) -> bool {
    let (trial, outcome) = tried(campaign, asked.seed, number, true);
    trial.told().iter().for_each(|line| println!("{line}"));
    match &outcome {
        Ok(()) => println!("{} {number}: {} {}, nothing broke", campaign.name, trial.done, campaign.unit),
        Err(what) => println!("{} {number}: BROKEN: {what}", campaign.name),
    }
    outcome.is_ok()
}

/// Runs a campaign to its end; returns the number of failed trials.
fn run(campaign: &Campaign, asked: &Options, shares: f64) -> u64 {
    let began = Instant::now();
    let time = asked.time.map(|time| time.mul_f64(campaign.share / shares));
    let [next, done, broken] = [const { AtomicU64::new(0) }; 3];
    // Current trial of each thread and its start time.
    let at: Vec<Mutex<Option<(u64, Instant)>>> = (0..campaign.threads).map(|_| Mutex::new(None)).collect();
    let set = |slot: &Mutex<Option<(u64, Instant)>>, what| *slot.lock().expect("no holder panics") = what;
    let row = || {
        let (done, seconds) = (done.load(Ordering::Relaxed), began.elapsed().as_secs_f64());
        let (per_second, broken) = (done as f64 / seconds, broken.load(Ordering::Relaxed));
        println!("{:<9}{done:>15} {:<7}{seconds:>9.1}{per_second:>15.0}{broken:>8}", campaign.name, campaign.unit);
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = at
            .iter()
            .map(|slot| {
                scope.spawn(|| {
                    // A trial counts at least one unit, and every thread runs at least one trial, so every kind of
                    // board occurs.
                    let is_enough = |number: u64| match time {
                        Some(time) => number >= campaign.threads as u64 && began.elapsed() >= time,
                        None => number.max(done.load(Ordering::Relaxed)) >= campaign.amount,
                    };
                    loop {
                        let number = next.fetch_add(1, Ordering::Relaxed);
                        if is_enough(number) {
                            break;
                        }
                        if asked.names {
                            eprintln!("{}", command(campaign, asked.seed, number));
                        }
                        set(slot, Some((number, Instant::now())));
                        let (trial, outcome) = tried(campaign, asked.seed, number, false);
                        set(slot, None);
                        done.fetch_add(trial.done, Ordering::Relaxed);
                        if let Err(what) = outcome
                            && broken.fetch_add(1, Ordering::Relaxed) < TOLD
                        {
                            tell(campaign, asked.seed, number, &what);
                        }
                    }
                })
            })
            .collect();
        let mut last = Instant::now();
        while !workers.iter().all(std::thread::ScopedJoinHandle::is_finished) {
            std::thread::sleep(Duration::from_millis(20));
            if last.elapsed() >= PROGRESS {
                last = Instant::now();
                row();
            }
            for (number, since) in at.iter().filter_map(|slot| *slot.lock().expect("no holder panics")) {
                if since.elapsed() > HANGS {
                    // A hanging thread can only be ended together with the program.
                    println!("BROKEN: it takes longer than {HANGS:?}\n  {}", command(campaign, asked.seed, number));
                    std::process::exit(1);
                }
            }
        }
    });
    row();
    broken.load(Ordering::Relaxed)
}

/// Repeats a failed trial with its log and prints it.
fn tell(campaign: &Campaign, seed: u64, number: u64, what: &str) {
    let (trial, again) = tried(campaign, seed, number, true);
    let lines = trial.told();
    let mut text = lines[lines.len().saturating_sub(LINES)..].join("\n");
    if again.is_ok() {
        text += "\n(not when it was repeated at once: it depends on time)";
    }
    println!("BROKEN: {what}\n{text}\n  {}", command(campaign, seed, number));
}

/// Returns the command that repeats one trial.
fn command(campaign: &Campaign, seed: u64, number: u64) -> String {
    format!("cargo xtask attack --seed {seed} --only {} --trial {number}", campaign.name)
}
