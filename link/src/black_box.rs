//! Trace buffer of a drive as a file, and its replay.
//!
//! The file consists of lines `key,value,..`. It begins with versions, design, the numbers of the design (names as in
//! [`controller_core::drive::LAYOUT`]), and the scenario in force, if there is one. One or two halves of consecutive
//! ticks follow: the state before the first tick, and a `frame` for each tick.
//!
//! A frame has the count of each encoder (empty if lost) and the reference at the end of the tick (turn, r .. r''').
//! The value held before (empty if not reported), u and health follow. Numbers are the shortest text that reads back as
//! the same bits. The last line is the CRC-32 of all lines before it.
//!
//! [`BlackBox::replay`] runs the same controller on the same counts from the same state. A difference in any bit
//! indicates a fault. [`BlackBox::replay_with`] switches to another design at the first tick and reports the recorded
//! held values to it. The result is the demand of that design in every tick, given the recorded history.

use std::fmt::Write as _;

use controller_core::drive::{
    CoupledDrive, DriveLaw as _, Frame, JointDrive, LAYOUT, Monitored, MotorDrive, Position, Target, replay,
};
use controller_core::{ControlLaw, Health, Output, Running, Words};
use pil_wire::{CORE_VERSION, Counts, Instance, LAYOUT_ID, MAX_E, Model, Tuned, checksum, halves};

use crate::remote::{Loadable, in_words};

const HEAD: &str = "trace buffer of a drive,1";
/// First line of files before the name of the buffer changed.
const OLD_HEAD: &str = "black box of a drive,1";

/// One recorded tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remembered {
    /// Inputs of the tick.
    pub counts: Counts,
    /// Output u of the tick.
    pub u: f32,
    /// Status flags of the tick.
    pub health: Health,
}

impl Remembered {
    /// Builds the tick from protocol words. `None` if the health is invalid.
    pub fn from_words(counts: [u32; 9], u: u32, health: u32) -> Option<Self> {
        let health = u16::try_from(health).ok().map(Health::from_bits)?;
        Some(Self { counts: Counts::from_words(counts), u: f32::from_bits(u), health })
    }
}

/// Consecutive ticks and the state before them.
#[derive(Clone, Debug, PartialEq)]
pub struct Half {
    /// Number of the first tick.
    pub first: u32,
    /// Reference at the beginning of the first tick.
    pub begin: Target<f32, i32, 4>,
    /// Words of the state before the first tick. Empty before the start.
    pub state: Vec<u32>,
    /// Recorded ticks.
    pub frames: Vec<Remembered>,
}

impl Half {
    /// Returns the ticks with their numbers, which may wrap.
    fn ticks(&self) -> impl Iterator<Item = (u32, &Remembered)> {
        self.frames.iter().enumerate().map(|(k, frame)| (self.first.wrapping_add(k as u32), frame))
    }
}

/// Content of a trace buffer.
#[derive(Clone, Debug, PartialEq)]
pub struct BlackBox {
    /// Design that ran.
    pub design: Loadable,
    /// Fingerprint of its controller.
    pub fingerprint: u32,
    /// Lines of the scenario of the design. Empty if the design is not from a file.
    pub scenario: Vec<String>,
    /// `--set` overrides of the scenario.
    pub sets: Vec<String>,
    /// Halves of the trace buffer, older ticks first.
    pub halves: Vec<Half>,
}

/// Tick after a replay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Again {
    /// Number of the tick.
    pub tick: u32,
    /// Recorded tick.
    pub then: Remembered,
    /// Output of the replay.
    pub now: Output<f32>,
}

impl Again {
    /// Returns true if u and health are bit-identical.
    pub fn is_same(&self) -> bool {
        self.then.u.to_bits() == self.now.u.to_bits() && self.then.health == self.now.health
    }
}

impl Loadable {
    /// Returns the 64-bit numbers of the design.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        self.words.chunks_exact(2).map(|pair| f64::from_bits(u64::from(pair[0]) | u64::from(pair[1]) << 32))
    }

    /// Returns the names of these numbers.
    pub fn names(&self) -> Vec<String> {
        let joint = self.instance.model == Model::Joint;
        let part = |at: usize| LAYOUT.split(';').nth(at).unwrap_or_default().split_whitespace();
        let design = part(usize::from(joint)).skip(1).map(|name| name.trim_start_matches("it."));
        let coupled = part(2).skip(1).filter(|_| self.instance.is_whole());
        // The numbers of the monitors begin with a disturbance for each shaft.
        let disturbances: &[&str] = if joint { &["d_link", "d_motor"] } else { &["d"] };
        let monitors = disturbances.iter().copied().chain(part(3).skip(1));
        design.chain(coupled).chain(monitors).map(String::from).collect()
    }
}

impl BlackBox {
    /// Returns the number of ticks.
    pub fn len(&self) -> usize {
        self.halves.iter().map(|half| half.frames.len()).sum()
    }

    /// Returns true if there are no ticks.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the text of the file.
    pub fn to_text(&self) -> String {
        let Self { design, fingerprint, scenario, sets, halves } = self;
        let Instance { n, r, mask, model } = design.instance;
        let mut text = format!(
            "{HEAD}\ncore,{CORE_VERSION:08x}\nlayout,{LAYOUT_ID:08x}\ninstance,{n},{r},{mask},{}\n\
             fingerprint,{fingerprint:08x}\n",
            model as u8
        );
        // Writing to a `String` cannot fail.
        for (name, number) in design.names().iter().zip(design.numbers()) {
            let _ = writeln!(text, "number,{name},{number:?}");
        }
        for line in scenario {
            let _ = writeln!(text, "scenario,{line}");
        }
        for set in sets {
            let _ = writeln!(text, "set,{set}");
        }
        let encoders = usize::from(n) / 2;
        for half in halves {
            let Target { turn, jet: [r, v, a, j] } = half.begin;
            let _ = writeln!(text, "ticks,{},{turn},{r:?},{v:?},{a:?},{j:?}", half.first);
            for word in &half.state {
                let _ = writeln!(text, "state,{word:08x}");
            }
            for (tick, frame) in half.ticks() {
                let Remembered { counts: Counts { counts, end, applied }, u, health } = frame;
                let _ = write!(text, "frame,{tick}");
                for count in &counts[..encoders] {
                    let _ = write!(text, ",{}", count.map_or_else(String::new, |count| count.to_string()));
                }
                let Target { turn, jet: [r, v, a, j] } = end;
                let applied = if applied.is_nan() { String::new() } else { format!("{applied:?}") };
                let _ = writeln!(text, ",{turn},{r:?},{v:?},{a:?},{j:?},{applied},{u:?},{}", health.bits());
            }
        }
        let _ = writeln!(text, "sum,{:08x}", checksum(text.as_bytes()));
        text
    }

    /// Parses the text of a file.
    ///
    /// # Errors
    /// Returns the line and the fault.
    pub fn from_text(text: &str) -> Result<Self, String> {
        if !text.lines().next().is_some_and(|head| [HEAD, OLD_HEAD].contains(&head)) {
            return Err(format!("line 1: not a trace buffer of a drive: expected {HEAD:?}"));
        }
        let body = text.trim_end_matches('\n').rfind('\n').map_or(0, |end| end + 1);
        let sum = text[body..].trim_end().strip_prefix("sum,").and_then(|sum| u32::from_str_radix(sum, 16).ok());
        let last = text.lines().count();
        let Some(sum) = sum else { return Err(format!("line {last}: incomplete: the last line is not `sum`")) };

        let mut read = Reading::default();
        for (k, line) in text[..body].lines().enumerate().skip(1) {
            let (key, rest) = line.split_once(',').unwrap_or((line, ""));
            read.line(key, rest).map_err(|why| format!("line {}: {why}", k + 1))?;
        }
        if checksum(&text.as_bytes()[..body]) != sum {
            return Err(format!(
                "line {last}: damaged: the checksum of the lines above is {:08x}",
                checksum(&text.as_bytes()[..body])
            ));
        }
        read.finished().map_err(|why| format!("line {last}: {why}"))
    }

    /// Replays the ticks with the controller that recorded them.
    ///
    /// # Errors
    /// Fails if the numbers or the state are invalid.
    pub fn replay(&self) -> Result<Vec<Again>, String> {
        self.run(None).map(|(done, _)| done)
    }

    /// Replays the ticks and returns the last one with the load estimate of each shaft, N m. `None` without a tick, or
    /// before the start.
    ///
    /// # Errors
    /// Fails like [`replay`](Self::replay).
    pub fn last(&self) -> Result<Option<(Again, [f32; MAX_E])>, String> {
        let (done, loads) = self.run(None)?;
        Ok(done.last().copied().zip(loads))
    }

    /// Replays the ticks with another design of the same form from the first tick on.
    ///
    /// # Errors
    /// Fails if the design has another form or period, or cannot take over.
    pub fn replay_with(&self, design: &Loadable) -> Result<Vec<Again>, String> {
        if design.instance != self.design.instance {
            return Err("the other design differs in form: drive, gain sets, delay and states must be equal".into());
        }
        let [period_s, other_s] = [&self.design, design].map(|it| it.numbers().next().unwrap_or(f64::NAN));
        if period_s.to_bits() != other_s.to_bits() {
            return Err(format!("the other design has a period of {other_s} s: must be {period_s} s, as recorded"));
        }
        self.run(Some(design)).map(|(done, _)| done)
    }

    fn run(&self, other: Option<&Loadable>) -> Result<Ran, String> {
        macro_rules! of {
            ($($model:ident $states:literal $form:literal: $law:ty, $e:literal, $n:literal;)*) => {
                match self.design.instance {
                    $(Instance { model: Model::$model, r: $states, mask: $form, .. } => {
                        self.run_law::<$law, $e, $n>(other)
                    })*
                    instance => Err(format!("no drive has the form {instance:?}")),
                }
            };
        }
        of! {
            Motor 3 0: MotorDrive<f32, Position, 0, 0, 3>, 1, 2;
            Motor 3 1: MotorDrive<f32, Position, 1, 0, 3>, 1, 2;
            Motor 3 2: MotorDrive<f32, Position, 0, 1, 3>, 1, 2;
            Motor 3 3: MotorDrive<f32, Position, 1, 1, 3>, 1, 2;
            Motor 4 0: MotorDrive<f32, Position, 0, 0, 4>, 1, 2;
            Motor 4 1: MotorDrive<f32, Position, 1, 0, 4>, 1, 2;
            Motor 4 2: MotorDrive<f32, Position, 0, 1, 4>, 1, 2;
            Motor 4 3: MotorDrive<f32, Position, 1, 1, 4>, 1, 2;
            Joint 4 0: JointDrive<f32, Position, 0, 0>, 2, 4;
            Joint 4 1: JointDrive<f32, Position, 1, 0>, 2, 4;
            Joint 4 2: JointDrive<f32, Position, 0, 1>, 2, 4;
            Joint 4 3: JointDrive<f32, Position, 1, 1>, 2, 4;
            Joint 3 0: CoupledDrive<f32, Position, 0, 0>, 2, 4;
            Joint 3 1: CoupledDrive<f32, Position, 1, 0>, 2, 4;
            Joint 3 2: CoupledDrive<f32, Position, 0, 1>, 2, 4;
            Joint 3 3: CoupledDrive<f32, Position, 1, 1>, 2, 4;
        }
    }

    fn run_law<L: Tuned<E, N>, const E: usize, const N: usize>(&self, other: Option<&Loadable>) -> Result<Ran, String> {
        let instance = self.design.instance;
        let read = |words: &[u32]| L::read(words).map_err(|refusal| in_words(&refusal, instance));
        let (_, law) = read(&self.design.words)?;
        if law.fingerprint() != self.fingerprint {
            let now = law.fingerprint();
            return Err(format!(
                "the fingerprint of the design is {:08x} on the drive and {now:08x} here: the versions differ",
                self.fingerprint
            ));
        }
        let narrow = |wide: &Target<f32, i32, 4>| Target { turn: wide.turn, jet: std::array::from_fn(|j| wide.jet[j]) };
        let Some(first) = self.halves.first() else { return Err("the file has no ticks".into()) };
        let mut words = first.state.iter().copied();
        let state = if first.state.is_empty() {
            None
        } else {
            let state = Words::from_words(&mut words).filter(|_| words.next().is_none());
            Some(state.ok_or("the state does not fit this controller")?)
        };
        let mut running = Running::from_state(law, state);
        // Value held before a tick: the u of the previous tick, or with a delay the u of the tick before that.
        let late = usize::from(instance.mask & Instance::LATE > 0);
        let all: Vec<Remembered> = self.halves.iter().flat_map(|half| half.frames.iter().copied()).collect();
        let held = |k: usize| k.checked_sub(1 + late).map_or(f32::NAN, |k| all[k].u);
        if let (Some(other), Some(frame)) = (other, all.first()) {
            let counts = std::array::from_fn(|i| frame.counts.counts[i]);
            running.report_applied(frame.counts.applied);
            let sample = Monitored::<L, E>::sample(counts, &narrow(&first.begin), &narrow(&frame.counts.end));
            running
                .retune(read(&other.words)?.1, &sample)
                .map_err(|error| format!("the other design cannot take over at the first tick: {error}"))?;
        }
        let mut done = Vec::new();
        for (k, half) in self.halves.iter().enumerate() {
            // The state of a half includes the value held before its first tick.
            if let Some(first) = half.frames.first().filter(|_| other.is_none()) {
                running.report_applied(first.counts.applied);
            }
            let words: Vec<u32> = running.words().collect();
            // The state is between the header and the checksum.
            let led_to = words.get(2..words.len() - 1);
            if k > 0 && other.is_none() && led_to != Some(&half.state) {
                return Err(format!("the state before tick {} is not the result of the ticks before it", half.first));
            }
            let frames: Vec<Frame<E, N>> = half
                .frames
                .iter()
                .enumerate()
                .map(|(k, frame)| {
                    let Remembered { counts: Counts { counts, end, applied }, u, health } = *frame;
                    let held = if other.is_some() && applied.is_nan() { held(done.len() + k) } else { applied };
                    let counts = std::array::from_fn(|i| counts[i]);
                    Frame { counts, end: narrow(&end), applied: held, u, health }
                })
                .collect();
            let again = replay(&mut running, narrow(&half.begin), &frames).zip(half.ticks());
            done.extend(again.map(|((now, _), (tick, then))| Again { tick, then: *then, now }));
        }
        let loads = running.estimates().map(|it| std::array::from_fn(|i| it.load.get(i).copied().unwrap_or(0.0)));
        Ok((done, loads))
    }
}

/// Ticks of a replay, and the load estimates after the last one, N m.
type Ran = (Vec<Again>, Option<[f32; MAX_E]>);

/// Parser state of a file.
#[derive(Default)]
struct Reading {
    /// Versions of controller and layout.
    versions: [Option<u32>; 2],
    instance: Option<Instance>,
    fingerprint: Option<u32>,
    words: Vec<u32>,
    scenario: Vec<String>,
    sets: Vec<String>,
    halves: Vec<Half>,
}

impl Reading {
    fn line(&mut self, key: &str, rest: &str) -> Result<(), String> {
        let mut fields = rest.split(',');
        match key {
            "core" => once(&mut self.versions[0], same("controller", hex(rest)?, CORE_VERSION)?),
            "layout" => once(&mut self.versions[1], same("layout", hex(rest)?, LAYOUT_ID)?),
            "instance" => {
                let mut byte = || number::<u8>("a byte", fields.next());
                let word = u32::from_le_bytes([byte()?, byte()?, byte()?, byte()?]);
                ended(fields)?;
                once(&mut self.instance, Instance::from_word(word).filter(|&it| is_drive(it)).ok_or("no drive")?)
            }
            "fingerprint" => once(&mut self.fingerprint, hex(rest)?),
            "number" => {
                let (name, value) = rest.split_once(',').ok_or("expected number,NAME,VALUE")?;
                let instance = self.instance.ok_or("a number before `instance`")?;
                let names = Loadable { instance, words: Vec::new() }.names();
                match names.get(self.words.len() / 2) {
                    Some(next) if next == name => self.words.extend(halves(number("a number", Some(value))?)),
                    Some(next) => return Err(format!("number {name:?} where {next:?} should be")),
                    None => return Err(format!("{name:?} is one number too many")),
                }
                Ok(())
            }
            "scenario" => {
                self.scenario.push(rest.to_owned());
                Ok(())
            }
            "set" => {
                self.sets.push(rest.to_owned());
                Ok(())
            }
            "ticks" => {
                let first: u32 = number("a tick", fields.next())?;
                let begin = target(&mut fields)?;
                ended(fields)?;
                if let Some(before) = self.halves.last() {
                    let next = before.first.wrapping_add(before.frames.len() as u32);
                    if before.frames.is_empty() || next != first {
                        return Err(format!("tick {first} where {next} should be"));
                    }
                }
                self.halves.push(Half { first, begin, state: Vec::new(), frames: Vec::new() });
                Ok(())
            }
            "state" => {
                self.halves.last_mut().ok_or("a state before `ticks`")?.state.push(hex(rest)?);
                Ok(())
            }
            "frame" => self.frame(&mut fields),
            _ => Err(format!("unknown key {key:?}")),
        }
    }

    fn frame<'a>(&mut self, fields: &mut impl Iterator<Item = &'a str>) -> Result<(), String> {
        let instance = self.instance.ok_or("a frame before `instance`")?;
        let half = self.halves.last_mut().ok_or("a frame before `ticks`")?;
        let expected = half.first.wrapping_add(half.frames.len() as u32);
        let tick: u32 = number("a tick", fields.next())?;
        if tick != expected {
            return Err(format!("tick {tick} where {expected} should be"));
        }
        let mut counts = [None; 2];
        for count in counts.iter_mut().take(usize::from(instance.n) / 2) {
            let text = fields.next().ok_or("too few fields")?;
            *count = if text.is_empty() { None } else { Some(number("a count", Some(text))?) };
        }
        let end = target(fields)?;
        let applied = match fields.next() {
            Some("") => f32::NAN,
            text => number("a current", text)?,
        };
        let u = number("a current", fields.next())?;
        let health = Health::from_bits(number("a health", fields.next())?);
        half.frames.push(Remembered { counts: Counts { counts, end, applied }, u, health });
        ended(fields)
    }

    fn finished(self) -> Result<BlackBox, String> {
        let Self { versions, instance, fingerprint, words, scenario, sets, halves } = self;
        if versions.contains(&None) {
            return Err("`core` or `layout` is missing".into());
        }
        if halves.last().is_none_or(|half| half.frames.is_empty()) {
            return Err("the file has no ticks".into());
        }
        let design = Loadable { instance: instance.ok_or("`instance` is missing")?, words };
        if design.names().len() * 2 != design.words.len() {
            return Err(format!("only {} of {} numbers", design.words.len() / 2, design.names().len()));
        }
        let fingerprint = fingerprint.ok_or("`fingerprint` is missing")?;
        Ok(BlackBox { design, fingerprint, scenario, sets, halves })
    }
}

fn target<'a>(fields: &mut impl Iterator<Item = &'a str>) -> Result<Target<f32, i32, 4>, String> {
    let turn = number("a turn", fields.next())?;
    let mut jet = [0.0; 4];
    for entry in &mut jet {
        *entry = number("a number", fields.next())?;
    }
    Ok(Target { turn, jet })
}

fn number<F: std::str::FromStr>(what: &str, text: Option<&str>) -> Result<F, String> {
    let text = text.ok_or("too few fields")?;
    text.parse().map_err(|_| format!("{text:?} is not {what}"))
}

fn hex(text: &str) -> Result<u32, String> {
    u32::from_str_radix(text, 16).map_err(|_| format!("{text:?} is not a number of eight hexadecimal digits"))
}

fn same(what: &str, found: u32, ours: u32) -> Result<u32, String> {
    if found == ours { Ok(found) } else { Err(format!("{what} {found:08x}: this program has {ours:08x}")) }
}

fn once<V>(place: &mut Option<V>, value: V) -> Result<(), String> {
    if place.replace(value).is_none() { Ok(()) } else { Err("duplicate line".into()) }
}

fn ended<'a>(mut fields: impl Iterator<Item = &'a str>) -> Result<(), String> {
    fields.next().map_or(Ok(()), |_| Err("too many fields".into()))
}

/// Returns true if the instance is a drive.
pub(crate) const fn is_drive(instance: Instance) -> bool {
    matches!((instance.model, instance.n), (Model::Motor, 2) | (Model::Joint, 4))
}
