//! Random campaigns against what takes input from outside, with a seed of their own each time.
//!
//! | campaign | counted | a trial | must |
//! |---|---|---|---|
//! | [`ticks`] | ticks | samples, damaged states, resets, retunes | u within its limits; two good samples lead into M |
//! | [`files`] | files | a scenario with mutations | refused in a line with its place, or it runs |
//! | [`bytes`] | bytes | garbage and frames, to the target or to the host | what is good afterwards is answered |
//! | [`images`] | files | an ELF file with mutations | an answer or a reason |
//! | [`boards`] | boards | one of 28 targets that behave badly | an error or the right run, in bounded time |
//!
//! None of them may panic or take longer than [`HANGS`]. Overflow of integers is a panic too: the profile is that of
//! the tests.
//!
//! ```text
//! attack [--seed N] [--seconds S] [--only CAMPAIGN] [--trial K] [--names]
//! ```
//!
//! Without `--seconds` each campaign runs to its amount; with it they share that time. A trial draws all that is random
//! in it from the seed, the campaign and its number K, so that one trial is repeated alone; it then tells what it did.
//! Counts are of what was done, by whichever thread. Exit status: 0 nothing broke, 1 something did, 2 bad arguments.
//! What ends the whole program (a stack that overflows) is found with `--names`: each trial is named before it begins.

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

/// A kind of attack.
struct Campaign {
    name: &'static str,
    unit: &'static str,
    /// How much of it without `--seconds`.
    amount: u64,
    /// Of the time with `--seconds`.
    share: f64,
    /// At once; those that mostly wait may be many.
    threads: usize,
    /// `Err` with what broke. The number says which of a few kinds it is, if there are such.
    run: fn(u64, &mut Trial) -> Result<(), String>,
}

const CAMPAIGNS: [Campaign; 5] = [
    Campaign { name: "ticks", unit: "ticks", amount: 1_000_000_000, share: 0.4, threads: 2, run: ticks::run },
    Campaign { name: "files", unit: "files", amount: 4000, share: 0.2, threads: 2, run: files::run },
    Campaign { name: "bytes", unit: "bytes", amount: 1_000_000_000, share: 0.15, threads: 2, run: bytes::run },
    Campaign { name: "images", unit: "files", amount: 1_000_000, share: 0.15, threads: 2, run: images::run },
    Campaign { name: "boards", unit: "boards", amount: 28, share: 0.1, threads: 28, run: boards::run },
];

/// A trial that takes longer hangs. The longest is a board that never stops talking, some 5 s on an idle machine.
const HANGS: Duration = Duration::from_mins(1);
/// Between two lines of progress.
const PROGRESS: Duration = Duration::from_secs(10);
/// Broken trials of a campaign that are told; all are counted.
const TOLD: u64 = 3;
/// Last lines of a broken trial that are shown.
const LINES: usize = 8;

fn main() -> ExitCode {
    let asked = match Asked::read(std::env::args().skip(1)) {
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

/// What the command line says.
struct Asked {
    seed: u64,
    time: Option<Duration>,
    only: Option<&'static str>,
    trial: Option<u64>,
    names: bool,
}

impl Asked {
    fn read(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as u64);
        // Short enough to be typed.
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

/// One trial; what broke, if anything did.
fn tried(campaign: &Campaign, seed: u64, number: u64, is_told: bool) -> (Trial, Result<(), String>) {
    let name = campaign.name.bytes().fold(0, |hash: u64, byte| hash << 8 | u64::from(byte));
    // Drawn twice: generators of neighbouring seeds would run into each other.
    let of_campaign = Rng::new(seed ^ name).bits();
    let mut trial = Trial::new(Rng::new(of_campaign.wrapping_add(number)).bits(), is_told);
    let outcome = catch_unwind(AssertUnwindSafe(|| (campaign.run)(number, &mut trial)));
    let outcome = outcome.unwrap_or_else(|_| Err(PANIC.with_borrow(Clone::clone)));
    (trial, outcome)
}

/// One trial alone, with all that it tells.
fn is_repeated_well(campaign: &Campaign, asked: &Asked, number: u64) -> bool {
    let (trial, outcome) = tried(campaign, asked.seed, number, true);
    trial.told().iter().for_each(|line| println!("{line}"));
    match &outcome {
        Ok(()) => println!("{} {number}: {} {}, nothing broke", campaign.name, trial.done, campaign.unit),
        Err(what) => println!("{} {number}: BROKEN: {what}", campaign.name),
    }
    outcome.is_ok()
}

/// A campaign to its end; how many of its trials broke.
fn run(campaign: &Campaign, asked: &Asked, shares: f64) -> u64 {
    let began = Instant::now();
    let time = asked.time.map(|time| time.mul_f64(campaign.share / shares));
    let [next, done, broken] = [const { AtomicU64::new(0) }; 3];
    // What each thread is at, and since when.
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
                    // No trial does less than one; and every thread has one, so that every kind of board is met.
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
                    // It cannot be ended but with the program.
                    println!("BROKEN: it takes longer than {HANGS:?}\n  {}", command(campaign, asked.seed, number));
                    std::process::exit(1);
                }
            }
        }
    });
    row();
    broken.load(Ordering::Relaxed)
}

/// A broken trial once more, so that it tells what it did.
fn tell(campaign: &Campaign, seed: u64, number: u64, what: &str) {
    let (trial, again) = tried(campaign, seed, number, true);
    let lines = trial.told();
    let mut text = lines[lines.len().saturating_sub(LINES)..].join("\n");
    if again.is_ok() {
        text += "\n(not when it was repeated at once: it depends on time)";
    }
    println!("BROKEN: {what}\n{text}\n  {}", command(campaign, seed, number));
}

/// What repeats one trial.
fn command(campaign: &Campaign, seed: u64, number: u64) -> String {
    format!("cargo xtask attack --seed {seed} --only {} --trial {number}", campaign.name)
}
