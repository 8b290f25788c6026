//! What goes in and out of a drive for some seconds, in the chip's own memory; and what shakes it meanwhile.
//!
//! ```text
//! row k:   counts at its first tick; mean of the current that was held in its ticks       12 bytes
//! before:  in place of that mean, the current that is on top of u in its ticks
//! ```
//!
//! A row is `every` ticks long: a chip of 5 kHz keeps 4.6 s in 55 kB with 5 of them. No serial line would carry it as
//! it comes (60 kB/s; 115200 bit/s are 11.5), and one that loses frames leaves no gap in a memory that is read row by
//! row. What shakes is a table, sent by the host: it needs no sine here, and both have the same bits.
//!
//! What is held is clamp(u + shake): the observers are told of it, the law is not. The record ends by itself: when it
//! is full, and before that at a count that is lost, and when the drive refuses its counts, alarms or stops; the shake
//! ends with it. Rows that are whole stay. Its ticks are those of [`Seat::change`](crate::Seat::change), so that the
//! bound of the interrupt has nothing of it.

use controller_core::drive::ALARMS;
use controller_core::{Health, Limits, Output};

use crate::frame::{Reason, Refusal};
use crate::session::agree;
use crate::{LOAD, MAX_E};

/// No row has more ticks: their sum is exact to some 1e-5 of a current.
const MOST_EVERY: u32 = 1000;
/// No record is longer, s: it goes on when whoever wanted it is gone.
const LONGEST_S: f64 = 60.0;

/// Counts, and a current by its bits.
pub type Row = [u32; MAX_E + 1];
/// The place of the current in a row.
pub(crate) const CURRENT: usize = MAX_E;

/// Of a record: how it is, or was at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tracked {
    /// Is it still being made?
    pub goes_on: bool,
    /// Was a count lost? Behind its rows there is nothing then.
    pub lost: bool,
    /// Number of its first tick.
    pub first: u32,
    /// Rows that are whole.
    pub rows: u32,
    /// Rows that were asked for.
    pub of: u32,
    /// Ticks of a row.
    pub every: u32,
    /// What the ticks said.
    pub health: Health,
    /// Ticks that came late.
    pub missed: u32,
    /// Rows that the memory has.
    pub most: u32,
}

impl Tracked {
    pub(crate) fn words(&self) -> [u32; 8] {
        let Self { goes_on, lost, first, rows, of, every, health, missed, most } = *self;
        [u32::from(goes_on) | u32::from(lost) << 1, first, rows, of, every, u32::from(health.bits()), missed, most]
    }

    /// Of the words of a reply to Recall; `None` if there is no such health.
    pub fn from_words(words: &[u32]) -> Option<Self> {
        let &[flags, first, rows, of, every, health, missed, most, ..] = words else { return None };
        let health = u16::try_from(health).ok().map(Health::from_bits)?;
        Some(Self { goes_on: flags & 1 == 1, lost: flags & 2 == 2, first, rows, of, every, health, missed, most })
    }
}

/// A record that is being made: the interrupt's, until it has ended.
pub(crate) struct Track {
    /// The memory.
    pub(crate) rows: &'static mut [Row],
    /// What has come of it.
    pub(crate) is: Tracked,
    /// Ticks that had come late before it.
    pub(crate) missed_before: u32,
    limits: [f32; 2],
    /// The next row, and its tick.
    row: usize,
    tick: u32,
    sum: f32,
    /// What was sent out in the last two ticks.
    sent: [f32; 2],
    /// It is to end; ticks since then.
    ending: bool,
    quiet: usize,
}

impl Track {
    /// Of `of` rows that hold what shakes; `u` is what is held before the first tick, which has this number.
    pub(crate) fn new(
        rows: &'static mut [Row],
        [of, every]: [u32; 2],
        limits: Limits,
        [first, missed_before]: [u32; 2],
        u: f32,
    ) -> Self {
        let is = Tracked { goes_on: true, first, of, every, most: rows.len() as u32, ..Tracked::default() };
        let limits = [limits.min as f32, limits.max as f32];
        Self { rows, is, missed_before, limits, row: 0, tick: 0, sum: 0.0, sent: [u; 2], ending: false, quiet: 0 }
    }

    /// It ends with the coming tick.
    pub(crate) const fn end(&mut self) {
        self.ending = true;
    }

    /// What was held since the last tick, by a drive whose u is held so many ticks late.
    pub(crate) const fn held(&self, late: usize) -> f32 {
        if late == 0 { self.sent[1] } else { self.sent[0] }
    }

    /// After a tick with these counts that was told what had been held before it: what is to be held now.
    pub(crate) fn ticked<const E: usize>(
        &mut self,
        counts: &[Option<i32>; E],
        held: f32,
        output: &Output<f32>,
        late: usize,
    ) -> f32 {
        // Of the tick before.
        if self.tick > 0 && !self.ending {
            self.sum += held;
            if self.tick == self.is.every {
                if let Some(row) = self.rows.get_mut(self.row) {
                    row[CURRENT] = (self.sum / self.is.every as f32).to_bits();
                }
                (self.row, self.tick, self.sum) = (self.row + 1, 0, 0.0);
                self.is.rows = self.row as u32;
            }
        }
        if !self.ending {
            self.is.health |= output.health;
            self.is.lost = counts.contains(&None);
            let is_full = self.is.rows == self.is.of;
            self.ending =
                is_full || self.is.lost || output.health.intersects(ALARMS | Health::STOPPED | Health::INPUT_REJECTED);
        }
        let mut u = output.u;
        if let Some(row) = self.rows.get_mut(self.row).filter(|_| !self.ending) {
            if self.tick == 0 {
                for (word, count) in row.iter_mut().zip(counts) {
                    *word = count.unwrap_or(0) as u32;
                }
            }
            self.tick += 1;
            let [min, max] = self.limits;
            u = (u + f32::from_bits(row[CURRENT])).max(min).min(max);
        } else {
            // What was sent last is still to be told.
            self.ending = true;
            self.quiet += 1;
            self.is.goes_on = self.quiet <= late;
        }
        self.sent = [self.sent[1], u];
        u
    }

    /// Its memory is the background's again.
    pub(crate) fn ended(self) -> Shelf {
        Shelf(On::Ended(self.rows, self.is))
    }
}

/// The memory of a record, seen from the background: the interrupt has it while the record is being made.
pub(crate) struct Shelf(On);

enum On {
    /// There is no memory for one.
    Nothing,
    /// None was asked for.
    Empty(&'static mut [Row]),
    /// It is prepared: so many rows of so many ticks.
    Prepared(&'static mut [Row], [u32; 2]),
    /// The interrupt has it.
    Lent,
    /// It has ended.
    Ended(&'static mut [Row], Tracked),
}

impl Shelf {
    pub(crate) const NONE: Self = Self(On::Nothing);

    pub(crate) fn of(rows: &'static mut [Row]) -> Self {
        Self(On::Empty(rows))
    }

    pub(crate) fn into_rows(self) -> Option<&'static mut [Row]> {
        match self.0 {
            On::Empty(rows) | On::Prepared(rows, _) | On::Ended(rows, _) => Some(rows),
            On::Nothing | On::Lent => None,
        }
    }

    pub(crate) const fn is_lent(&self) -> bool {
        matches!(self.0, On::Lent)
    }

    /// So many rows of so many ticks, and nothing that shakes. What is refused leaves the record that there is.
    pub(crate) fn prepare(&mut self, wanted: [u32; 2], period_s: f64) -> Result<(), Refusal> {
        let rows = match &mut self.0 {
            On::Nothing => return Err(Refusal::of(Reason::Absent)),
            On::Lent => return Err(Refusal::of(Reason::Recording)),
            On::Empty(rows) | On::Prepared(rows, _) | On::Ended(rows, _) => rows,
        };
        let [count, every] = wanted;
        let most = (rows.len() as u32).min((LONGEST_S / (period_s * f64::from(every.max(1)))) as u32);
        if !(1..=most).contains(&count) || !(1..=MOST_EVERY).contains(&every) {
            return Err(Refusal { reason: Reason::Rows, target: most, request: count });
        }
        let rows = core::mem::take(rows);
        for row in rows.iter_mut() {
            row[CURRENT] = 0;
        }
        self.0 = On::Prepared(rows, wanted);
        Ok(())
    }

    /// What shakes in these rows.
    pub(crate) fn shake(&mut self, offset: u32, currents: [f32; LOAD], limits: Limits) -> Result<(), Refusal> {
        let On::Prepared(rows, [count, _]) = &mut self.0 else { return Err(Refusal::of(Reason::NotPrepared)) };
        agree(Reason::Rows, offset.min(*count - 1), offset)?;
        let rows = rows.iter_mut().take(*count as usize).skip(offset as usize);
        // What the law itself can take back: what shakes never drives a shaft against it.
        let most = limits.max.min(-limits.min) as f32;
        // A NaN is within no bound.
        let is_good = |current: &f32| current.abs() <= most;
        if let Some(wild) = currents.iter().take(rows.len()).find(|current| !is_good(current)) {
            return Err(Refusal { reason: Reason::Current, target: most.to_bits(), request: wild.to_bits() });
        }
        for (row, current) in rows.zip(currents) {
            row[CURRENT] = current.to_bits();
        }
        Ok(())
    }

    /// It begins: the memory is the interrupt's.
    pub(crate) fn lend(&mut self) -> Result<(&'static mut [Row], [u32; 2]), Refusal> {
        match core::mem::replace(&mut self.0, On::Lent) {
            On::Prepared(rows, wanted) => Ok((rows, wanted)),
            other => {
                self.0 = other;
                Err(Refusal::of(if self.is_lent() { Reason::Recording } else { Reason::NotPrepared }))
            }
        }
    }

    /// How the record is; `now` is what the interrupt says of it.
    pub(crate) fn is(&self, now: Option<Tracked>) -> Tracked {
        match &self.0 {
            On::Nothing => Tracked::default(),
            On::Empty(rows) | On::Prepared(rows, _) => Tracked { most: rows.len() as u32, ..Tracked::default() },
            On::Lent => now.unwrap_or_default(),
            On::Ended(_, is) => *is,
        }
    }

    /// What was recorded, from this row on.
    pub(crate) fn rows(&self, from: u32) -> Result<&[Row], Refusal> {
        match &self.0 {
            On::Ended(rows, is) => {
                let rows = &rows[..rows.len().min(is.rows as usize)];
                rows.get(from as usize..).ok_or(Refusal { reason: Reason::Rows, target: is.rows, request: from })
            }
            On::Lent => Err(Refusal::of(Reason::Recording)),
            _ => Err(Refusal::of(Reason::NotPrepared)),
        }
    }
}
