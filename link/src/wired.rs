//! Commissioning of a drive on a target: the firmware `drive` or `motor`, emulated or on a board.
//!
//! ```text
//! excitation  ->  memory of the chip  -> counts and mean current, a row per ms        (pil_wire: Prepare .. Recall)
//! goal        ->  plan of the chip    -> its first tick: the same plan is played here for y - r
//! design      ->  design of the chip  -> at rest, W = 0
//! ```
//!
//! Time is the time of the drive's ticks. A slow request only extends the rest of the drive. A row of a fast drive has
//! several ticks: the excitation is held for a row, and the current of a row is the mean over its ticks. Only a
//! simulated plant can be disturbed from here.

use std::f64::consts::TAU;
use std::thread::sleep;
use std::time::{Duration, Instant};

use controller_core::Health;
use loop_sim::port::drive::{DriveDesign, Goal, Motion};
use loop_sim::sensor::encoder::Mounted;
use pil_wire::{Order, Tracked};
use study::commission::{Leg, OnTicks, Shake, Stand, Stopped, turned};
use study::identify::Record;
use study::identify::record::unwrapped;

use crate::live::LiveDrive;
use crate::remote::{Loadable, for_interrupt};
use crate::transport::Transport;

/// Length of a row of a record, s. A slower drive takes one tick per row, and a short memory needs longer rows.
const ROW_S: f64 = 1e-3;
/// Extra length of a record beyond its moves, s. It covers the planning on the chip and the requests.
const SPARE_S: f64 = 1.5;
/// Time without a new tick after which the drive counts as halted.
const STANDS_STILL: Duration = Duration::from_secs(5);
/// Longest time for a stop.
const COMES_TO_REST: Duration = Duration::from_secs(20);
/// Interval between two status requests to a drive at rest.
const GLANCE: Duration = Duration::from_millis(1);

/// Connection to a drive for commissioning.
pub struct Wired<'a, T> {
    drive: LiveDrive<T>,
    designed: DriveDesign,
    /// Encoders as the chip counts them, after sign and offset are removed there.
    encoders: Vec<Mounted>,
    period_s: f64,
    at_rad: f64,
    /// Tick of the drive at the connection.
    origin: u32,
    motions: Vec<Motion>,
    /// Design that ran before.
    before: Loadable,
    /// True if another design was sent. After a lost reply the result is unknown, so it counts as sent.
    is_touched: bool,
    watch: &'a mut OnTicks<'a>,
}

impl<'a, T: Transport> Wired<'a, T> {
    /// Takes over a drive at rest with this design. It replaces the running design where the two differ.
    ///
    /// # Errors
    /// Fails if the drive has another form, moves, has stopped, or cannot be reached.
    pub fn new(mut drive: LiveDrive<T>, designed: DriveDesign, watch: &'a mut OnTicks<'a>) -> Result<Self, Stopped> {
        let seen = drive.observe()?;
        let why = [
            (!seen.started, "the drive has not started: its encoders give no counts"),
            (seen.moving, "the drive moves: it must be at rest"),
            (seen.health.contains(Health::STOPPED), "an alarm has stopped the drive: reset it first (host-sim live)"),
        ];
        if let Some((_, why)) = why.into_iter().find(|(is, _)| *is) {
            return Err(Stopped::Broken(why.into()));
        }
        let at_rad = f64::from(seen.turn) * TAU + f64::from(seen.reference);
        // The firmware has no rest band.
        let designed = designed.without_rest_band();
        let design = loadable(&designed)?;
        let before = drive.design().clone();
        let is_touched = before != design;
        if is_touched {
            drive.swap(&design)?;
        }
        let encoders = designed.encoders().into_iter().map(|(_, mounted)| Mounted::new(mounted.encoder)).collect();
        let period_s = drive.period_s();
        Ok(Self {
            drive,
            designed,
            encoders,
            period_s,
            at_rad,
            origin: seen.tick,
            motions: vec![Motion::rest(at_rad, period_s)],
            before,
            is_touched,
            watch,
        })
    }

    /// Returns the connection to the drive in its present state.
    pub fn into_drive(self) -> LiveDrive<T> {
        self.drive
    }

    /// Returns a mutable reference to the connection during commissioning.
    pub const fn drive_mut(&mut self) -> &mut LiveDrive<T> {
        &mut self.drive
    }

    fn ticks(&self, seconds: f64) -> u32 {
        (seconds / self.period_s).round() as u32
    }

    /// Waits until this tick has passed.
    fn until(&mut self, tick: u32) -> Result<(), Stopped> {
        let mut last: Option<(u32, Instant)> = None;
        loop {
            let seen = self.drive.observe()?;
            if seen.health.contains(Health::STOPPED) {
                return Err(Stopped::Alarm(seen.health));
            }
            let since = last.filter(|(last, _)| *last == seen.tick);
            if since.is_some_and(|(_, since)| since.elapsed() > STANDS_STILL) {
                return Err(Stopped::Broken(format!("the drive answers, but its tick {} does not advance", seen.tick)));
            }
            let passed = last.map_or(0, |(last, _)| seen.tick.wrapping_sub(last));
            if (self.watch)(u64::from(passed)).is_break() {
                return Err(Stopped::Interrupted);
            }
            last = Some(since.unwrap_or((seen.tick, Instant::now())));
            if seen.tick.wrapping_sub(tick) as i32 >= 0 {
                return Ok(());
            }
            sleep(GLANCE);
        }
    }

    /// Returns the reference at a tick, rad.
    fn r(&self, tick: u32) -> f64 {
        let begun = |motion: &&Motion| tick.wrapping_sub(motion.start) as i32 >= 0;
        let motion = self.motions.iter().rev().find(begun).unwrap_or(&self.motions[0]);
        // The continuity matches the plan of the chip.
        let [r, _] = if self.encoders.len() > 1 { motion.jets::<4, 2>()(tick) } else { motion.jets::<3, 2>()(tick) };
        r
    }
}

fn loadable(designed: &DriveDesign) -> Result<Loadable, Stopped> {
    for_interrupt(designed).map_err(Stopped::Design)
}

impl<T: Transport> Stand for Wired<'_, T> {
    fn designed(&self) -> DriveDesign {
        self.designed
    }

    fn period_s(&self) -> f64 {
        self.period_s
    }

    fn at_rad(&self) -> f64 {
        self.at_rad
    }

    fn begin(&mut self, shake: Option<&Shake>, most_s: f64) -> Result<(), Stopped> {
        let memory = self.drive.tracked()?.most;
        if memory == 0 {
            return Err(Stopped::Broken(
                "the drive has no memory for a record: give it one with `Live::recording_in`".into(),
            ));
        }
        let ticks = self.ticks(most_s + SPARE_S);
        let every = self.ticks(ROW_S).max(ticks.div_ceil(memory)).max(1);
        // The record takes all of the memory. Rows that are not recorded are not read.
        let (rows, row_s) = (memory as usize, f64::from(every) * self.period_s);
        let wave = shake.map_or_else(|| vec![0.0; rows], |shake| shake.wave(rows, row_s));
        let wave: Vec<f32> = wave.into_iter().map(|current| current as f32).collect();
        let watch = &mut *self.watch;
        let has_begun = self.drive.record_while(every, &wave, || watch(0).is_continue())?;
        if has_begun { Ok(()) } else { Err(Stopped::Interrupted) }
    }

    fn end(&mut self) -> Result<Leg, Stopped> {
        let was = self.drive.tracked()?;
        if !was.goes_on && was.rows == was.of {
            return Err(Stopped::Broken(
                "the record was full before its move had ended: the drive answers late, or has too little memory"
                    .into(),
            ));
        }
        self.drive.order(Order::EndRecord)?;
        let is = self.drive.tracked()?;
        let (drive, watch) = (&mut self.drive, &mut *self.watch);
        let mut stop = false;
        let rows = drive.rows(|rows| stop |= watch(rows * u64::from(is.every)).is_break())?;
        if stop {
            return Err(Stopped::Interrupted);
        }
        let Tracked { first, every, .. } = is;
        let row_s = f64::from(every) * self.period_s;
        let from_s = f64::from(first.wrapping_sub(self.origin)) * self.period_s;
        let r: Vec<f64> = (0..rows.len() as u32).map(|k| self.r(first.wrapping_add(k * every))).collect();
        let held_a: Vec<f64> = rows.iter().map(|(_, held)| f64::from(*held)).collect();
        let angle = |i: usize| unwrapped(rows.iter().map(|(counts, _)| f64::from(counts[i])), &self.encoders[i]);
        let (link, motor) = if self.encoders.len() > 1 { (Some(angle(0)), angle(1)) } else { (None, angle(0)) };
        let record = if is.lost {
            Err(Stopped::Lost { at_s: from_s + rows.len() as f64 * row_s })
        } else if is.missed > 0 {
            Err(Stopped::Late { ticks: is.missed })
        } else {
            Ok(Record { period_s: row_s, link, motor, held_a: held_a.clone() })
        };
        let y = rows.iter().zip(&r).map(|((counts, _), r)| turned(Some(counts[0]), *r, &self.encoders[0])).collect();
        Ok(Leg { from_s, period_s: row_s, y, r, held_a, record, true_error: None, health: is.health })
    }

    fn rest(&mut self, seconds: f64) -> Result<(), Stopped> {
        let now = self.drive.observe()?.tick;
        self.until(now.wrapping_add(self.ticks(seconds)))
    }

    fn go(&mut self, to_rad: f64, ticks: u32) -> Result<(), Stopped> {
        let [start, ticks] = self.drive.move_to(to_rad, ticks)?;
        let goal = Goal::Rest { angle_rad: to_rad };
        self.motions.push(Motion { goal, start, ticks, ..Motion::rest(self.at_rad, self.period_s) });
        self.at_rad = to_rad;
        self.until(start.wrapping_add(ticks))
    }

    fn swap(&mut self, to: &DriveDesign, at_rest: bool) -> Result<f64, Stopped> {
        let design = loadable(to)?;
        self.is_touched = true;
        let swapped = if at_rest { self.drive.swap_at_rest(&design)? } else { self.drive.swap(&design)? };
        let [before, after] = swapped.u.map(f64::from);
        Ok((after - before).abs())
    }

    /// A drive that was stopped by an alarm also gets the old design, for its next reset. This clears its trace buffer.
    fn give_up(&mut self) -> Result<(), Stopped> {
        self.drive.order(Order::EndRecord)?;
        let mut seen = self.drive.observe()?;
        let is_stopped = seen.health.contains(Health::STOPPED);
        if !is_stopped {
            self.drive.stop(self.ticks(0.2))?;
            seen = self.drive.observe()?;
            let began = Instant::now();
            while seen.moving {
                if began.elapsed() > COMES_TO_REST {
                    return Err(Stopped::Broken("the drive does not come to rest".into()));
                }
                sleep(GLANCE);
                seen = self.drive.observe()?;
            }
        }
        if !self.is_touched {
            return Ok(());
        }
        if seen.frozen {
            self.drive.order(Order::Release)?;
        }
        let before = self.before.clone();
        let swapped = if is_stopped { self.drive.swap(&before) } else { self.drive.swap_at_rest(&before) };
        self.is_touched = swapped.is_err();
        swapped.map(|_| ()).map_err(Into::into)
    }
}
