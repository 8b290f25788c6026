//! Record of a drive in the memory of the chip: inputs and outputs of some seconds, with an optional excitation.
//!
//! ```text
//! row k:   counts at its first tick; mean of the current held in its ticks                12 bytes
//! before:  in place of the mean, the excitation that is added to u in its ticks
//! ```
//!
//! A row has `every` ticks: a chip at 5 kHz keeps 4.6 s in 55 kB with 5 ticks per row. A serial link is too slow for
//! the live data (60 kB/s against 11.5 kB/s at 115200 bit/s). Frames that the link loses leave no gap in a memory that
//! is read row by row. The excitation is a table from the host. So the chip needs no sine, and host and chip have the
//! same bits.
//!
//! The held value is clamp(u + excitation). It is reported to the observers and not to the rest of the controller. The
//! record ends when it is full, at a lost count, and when the drive rejects its counts, raises an alarm or stops. The
//! excitation ends with it. Whole rows are kept. Its ticks run in [`Seat::change`](crate::Seat::change), so the WCET
//! bound of the interrupt does not include it.

use controller_core::drive::ALARMS;
use controller_core::{Health, Limits, Output};

use crate::frame::{Reason, Refusal};
use crate::session::agree;
use crate::{LOAD, MAX_E};

/// Largest number of ticks per row. The sum of their currents is exact to some 1e-5 of a current.
const MOST_EVERY: u32 = 1000;
/// Longest record, s. It limits a record whose host is gone.
const LONGEST_S: f64 = 60.0;

/// Row of a record: the counts, and the bits of a current.
pub type Row = [u32; MAX_E + 1];
/// Index of the current in a row.
pub(crate) const CURRENT: usize = MAX_E;

/// Status of a record, during it or at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tracked {
    /// True if the record is in progress.
    pub goes_on: bool,
    /// True if a count was lost. The record ends there.
    pub lost: bool,
    /// Number of its first tick.
    pub first: u32,
    /// Number of whole rows.
    pub rows: u32,
    /// Number of requested rows.
    pub of: u32,
    /// Number of ticks per row.
    pub every: u32,
    /// Status flags of all ticks together.
    pub health: Health,
    /// Number of late ticks.
    pub missed: u32,
    /// Number of rows of the memory.
    pub most: u32,
}

impl Tracked {
    pub(crate) fn words(&self) -> [u32; 8] {
        let Self { goes_on, lost, first, rows, of, every, health, missed, most } = *self;
        [u32::from(goes_on) | u32::from(lost) << 1, first, rows, of, every, u32::from(health.bits()), missed, most]
    }

    /// Reads the words of a reply to Recall. `None` if the health is invalid.
    pub fn from_words(words: &[u32]) -> Option<Self> {
        let &[flags, first, rows, of, every, health, missed, most, ..] = words else { return None };
        let health = u16::try_from(health).ok().map(Health::from_bits)?;
        Some(Self { goes_on: flags & 1 == 1, lost: flags & 2 == 2, first, rows, of, every, health, missed, most })
    }
}

/// Record in progress, owned by the interrupt until it ends.
pub(crate) struct Track {
    /// Memory of the record.
    pub(crate) rows: &'static mut [Row],
    /// Status of the record.
    pub(crate) is: Tracked,
    /// Number of late ticks before the record.
    pub(crate) missed_before: u32,
    limits: [f32; 2],
    /// Index of the next row, and of the tick in it.
    row: usize,
    tick: u32,
    sum: f32,
    /// Values sent out in the last two ticks.
    sent: [f32; 2],
    /// True if the record is to end, and the number of ticks since then.
    ending: bool,
    quiet: usize,
}

impl Track {
    /// Begins a record of `of` rows that hold the excitation. `u` is the value held before the first tick, whose number
    /// is given.
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

    /// Ends the record with the coming tick.
    pub(crate) const fn end(&mut self) {
        self.ending = true;
    }

    /// Returns the value held since the last tick, for a drive with this delay in ticks.
    pub(crate) const fn held(&self, late: usize) -> f32 {
        if late == 0 { self.sent[1] } else { self.sent[0] }
    }

    /// Records a tick after the controller has run. Returns the value to hold now.
    pub(crate) fn ticked<const E: usize>(
        &mut self,
        counts: &[Option<i32>; E],
        held: f32,
        output: &Output<f32>,
        late: usize,
    ) -> f32 {
        // These values belong to the previous tick.
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
            // The last sent value must still be reported.
            self.ending = true;
            self.quiet += 1;
            self.is.goes_on = self.quiet <= late;
        }
        self.sent = [self.sent[1], u];
        u
    }

    /// Returns the memory to the background.
    pub(crate) fn ended(self) -> Shelf {
        Shelf(On::Ended(self.rows, self.is))
    }
}

/// Memory of a record on the side of the background. The interrupt owns it while a record is in progress.
pub(crate) struct Shelf(On);

enum On {
    /// There is no memory.
    Nothing,
    /// No record was requested.
    Empty(&'static mut [Row]),
    /// A record is prepared, with its rows and the ticks per row.
    Prepared(&'static mut [Row], [u32; 2]),
    /// The interrupt owns the memory.
    Lent,
    /// The record has ended.
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

    /// Prepares a record with this number of rows and ticks per row, without excitation. A refusal keeps the present
    /// record.
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

    /// Sets the excitation of these rows.
    pub(crate) fn shake(&mut self, offset: u32, currents: [f32; LOAD], limits: Limits) -> Result<(), Refusal> {
        let On::Prepared(rows, [count, _]) = &mut self.0 else { return Err(Refusal::of(Reason::NotPrepared)) };
        agree(Reason::Rows, offset.min(*count - 1), offset)?;
        let rows = rows.iter_mut().take(*count as usize).skip(offset as usize);
        // Limit that the controller can compensate, so that the excitation never drives a shaft against it.
        let most = limits.max.min(-limits.min) as f32;
        // Comparisons with NaN are false.
        let is_good = |current: &f32| current.abs() <= most;
        if let Some(wild) = currents.iter().take(rows.len()).find(|current| !is_good(current)) {
            return Err(Refusal { reason: Reason::Current, target: most.to_bits(), request: wild.to_bits() });
        }
        for (row, current) in rows.zip(currents) {
            row[CURRENT] = current.to_bits();
        }
        Ok(())
    }

    /// Begins the record and lends the memory to the interrupt.
    pub(crate) fn lend(&mut self) -> Result<(&'static mut [Row], [u32; 2]), Refusal> {
        match core::mem::replace(&mut self.0, On::Lent) {
            On::Prepared(rows, wanted) => Ok((rows, wanted)),
            other => {
                self.0 = other;
                Err(Refusal::of(if self.is_lent() { Reason::Recording } else { Reason::NotPrepared }))
            }
        }
    }

    /// Returns the status of the record. `now` is the status from the interrupt.
    pub(crate) fn is(&self, now: Option<Tracked>) -> Tracked {
        match &self.0 {
            On::Nothing => Tracked::default(),
            On::Empty(rows) | On::Prepared(rows, _) => Tracked { most: rows.len() as u32, ..Tracked::default() },
            On::Lent => now.unwrap_or_default(),
            On::Ended(_, is) => *is,
        }
    }

    /// Returns the recorded rows, from this row on.
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
