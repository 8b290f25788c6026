//! A drive at the end of a wire, commissioned: an image `drive` or `motor`, emulated or on a board.
//!
//! ```text
//! what shakes ->  memory of the chip  -> counts and mean current, a row per ms        (pil_wire: Prepare .. Recall)
//! goal        ->  plan of the chip    -> its first tick: the same plan is played here for y - r
//! design      ->  design of the chip  -> at rest, W = 0
//! ```
//!
//! Time is that of the drive's ticks: nothing here depends on how long a request takes, but that the drive rests
//! longer meanwhile. A row of a fast drive is several ticks: what shakes is held for a row, and the current of a row is
//! the mean of its ticks. Nothing but the stand-in's plant can be disturbed from here.

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
use crate::remote::Loadable;
use crate::transport::Transport;

/// A row of a record has so much time, or one tick of a drive that is slower, or more where the memory is short.
const ROW_S: f64 = 1e-3;
/// What a record lasts longer than its moves at least: a plan takes the chip some time, and so does who asks for it.
const SPARE_S: f64 = 1.5;
/// A tick that does not go on for so long does not go on at all.
const STANDS_STILL: Duration = Duration::from_secs(5);
/// A stop takes no longer.
const COMES_TO_REST: Duration = Duration::from_secs(20);
/// Between two looks at a drive that rests.
const GLANCE: Duration = Duration::from_millis(1);

/// The drive, with the way to it.
pub struct Wired<'a, T> {
    drive: LiveDrive<T>,
    designed: DriveDesign,
    /// As a chip counts them: sign and offset are taken off there.
    encoders: Vec<Mounted>,
    period_s: f64,
    at_rad: f64,
    /// Its tick when it was found.
    origin: u32,
    motions: Vec<Motion>,
    /// What ran there before.
    before: Loadable,
    /// Was another design sent? What came of a reply that was lost nobody knows.
    is_touched: bool,
    watch: &'a mut OnTicks<'a>,
}

impl<'a, T: Transport> Wired<'a, T> {
    /// A drive that rests, with this design: what runs there is given up for it where it differs.
    ///
    /// # Errors
    /// When it is of another form, moves, has stopped, or cannot be reached.
    pub fn new(mut drive: LiveDrive<T>, designed: DriveDesign, watch: &'a mut OnTicks<'a>) -> Result<Self, Stopped> {
        let seen = drive.observe()?;
        let why = [
            (!seen.started, "the drive has not started: its encoders give no counts"),
            (seen.moving, "the drive is on its way: it must rest"),
            (seen.health.contains(Health::STOPPED), "an alarm has stopped the drive: reset it first (host-sim live)"),
        ];
        if let Some((_, why)) = why.into_iter().find(|(is, _)| *is) {
            return Err(Stopped::Broken(why.into()));
        }
        let at_rad = f64::from(seen.turn) * TAU + f64::from(seen.reference);
        // The image has no band at rest.
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

    /// The drive, as it is now.
    pub fn into_drive(self) -> LiveDrive<T> {
        self.drive
    }

    /// The same on the way.
    pub const fn drive_mut(&mut self) -> &mut LiveDrive<T> {
        &mut self.drive
    }

    fn ticks(&self, seconds: f64) -> u32 {
        (seconds / self.period_s).round() as u32
    }

    /// Until this tick has been.
    fn until(&mut self, tick: u32) -> Result<(), Stopped> {
        let mut last: Option<(u32, Instant)> = None;
        loop {
            let seen = self.drive.observe()?;
            if seen.health.contains(Health::STOPPED) {
                return Err(Stopped::Alarm(seen.health));
            }
            let since = last.filter(|(last, _)| *last == seen.tick);
            if since.is_some_and(|(_, since)| since.elapsed() > STANDS_STILL) {
                return Err(Stopped::Broken(format!("the drive answers, but its tick {} does not go on", seen.tick)));
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

    /// Where it should have been at a tick, rad.
    fn r(&self, tick: u32) -> f64 {
        let begun = |motion: &&Motion| tick.wrapping_sub(motion.start) as i32 >= 0;
        let motion = self.motions.iter().rev().find(begun).unwrap_or(&self.motions[0]);
        // As many derivatives are continuous as the plan of the chip has.
        let [r, _] = if self.encoders.len() > 1 { motion.jets::<4, 2>()(tick) } else { motion.jets::<3, 2>()(tick) };
        r
    }
}

fn loadable(designed: &DriveDesign) -> Result<Loadable, Stopped> {
    Loadable::try_from(designed).map_err(Stopped::Design)
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
        // All of the memory: what is not made is not read.
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

    /// A drive that an alarm has stopped gets them too, for whoever resets it; its black box is emptied by that.
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
