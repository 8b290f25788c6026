//! Target side of a drive that ticks by its own interrupt and is observed, moved and re-tuned while it runs.
//!
//! ```text
//! interrupt:   Seat::tick; Seat::change where a law starts or waits    never blocks
//! background:  Live::receive: a byte in, a reply out                   designs and plans, in 64 bits
//! ```
//!
//! Interrupt and background share a [`Seat`], which the interrupt can use at any time. The background accesses it
//! through [`Machine::between`], for some hundred cycles at a time. Long work is done outside: a design or a plan is
//! computed while the interrupt goes on, and is then handed over whole. A refused request changes nothing.
//!
//! * **Move**: the transition begins at a future tick, at the reference of the present plan at that tick, independent
//!   of the shaft. Its feed-forward must stay within 0.9 of the limits, and its speed within 0.8 of the speed that an
//!   encoder can follow.
//! * **Swap**: the new controller takes over with the counts of the same tick, so that u does not jump. That tick takes
//!   some three times as long as others. It has a separate function ([`Seat::change`]), so that another interrupt can
//!   run it.
//! * **Reset**: after an alarm has stopped the drive. The plan is then rest at the present counts. A reset is refused
//!   while a shaft turns: the drive would run all revolutions of its braking back.
//! * **Record**: counts and current of some seconds in a memory of the main program, with an optional excitation
//!   ([`Tracked`]). Its ticks also run in [`Seat::change`].
//! * **Recall**: reads the trace buffer once it is frozen, and the record once it has ended.
//!
//! The tests run all of this without a chip.

use controller_core::drive::{
    Axis, DriveEstimates, DriveLaw, Encoder, Frame, Monitored, Reference, Rest, Stretch, Target,
};
use controller_core::{ControlLaw, Health, Output, RetuneError, Words};

use crate::drives::{MOST_DRIVE_WORDS, Tuned};
use crate::frame::{
    Counts, Disturbance, Observed, Open, Order, Part, Plant, RETUNE_ERRORS, Reason, Refusal, Reply, Request, Swapped,
};
use crate::session::{Heard, Loading, Session, agree};
use crate::target::Event;
use crate::track::{Row, Shelf, Track};
use crate::{MAX_E, MAX_N, REPLY_LEN, REPLY_WORDS};

/// Ticks of one half of the trace buffer, and the smallest number of ticks kept before an alarm.
pub const REMEMBERED: usize = 256;
/// Time from a request to the beginning of its plan, s. A late plan is tried again with at least twice the time.
const AHEAD_S: f64 = 0.01;
const ATTEMPTS: u32 = 8;
/// Largest distance of a goal from angle 0, revolutions. A transition in 32 bits is exact to 4e-7 of its travel.
const FURTHEST_TURNS: u32 = 10_000;

/// Time over which a reset measures the speed from the counts, s: one count of 8 bits or more is below the limit.
const RESET_S: f64 = 0.05;
/// Largest speed at a reset, rad/s behind the gear. The drive returns to an angle about 4 ticks old: 2 mrad at 1 kHz.
/// A flickering count stays below this speed.
const RESET_RAD_S: f32 = 0.5;

type Black<L, const E: usize, const N: usize> = Stretch<<Monitored<L, E> as ControlLaw>::State, E, N, REMEMBERED>;

/// State that interrupt and background share.
pub struct Seat<L: Tuned<E, N>, const E: usize, const N: usize> {
    axis: Axis<Monitored<L, E>, L::Plan, E, N, REMEMBERED>,
    counts: [Option<i32>; E],
    newest: Output<f32>,
    /// Controller that waits for its first tick, and the result of the last switch: u before, u after.
    next: Option<Monitored<L, E>>,
    changed: Option<Result<[f32; 2], RetuneError>>,
    /// Record that is in progress or has ended.
    track: Option<Track>,
    /// True if a controller waits or a record is in progress.
    waits: bool,
    /// True if the trace buffer was released. A persisting alarm may have frozen it again.
    let_go: bool,
    /// Longest run of the interrupt and number of late ticks, written by the interrupt.
    pub worst: u32,
    /// Number of late ticks, see [`worst`](Self::worst).
    pub missed: u32,
}

impl<L: Tuned<E, N>, const E: usize, const N: usize> Seat<L, E, N> {
    /// Returns a seat that waits for its first counts, at rest at angle 0.
    pub fn new(law: Monitored<L, E>) -> Self {
        Self {
            axis: Axis::new(law, L::rest(Rest { turn: 0, angle: 0.0 })),
            counts: [None; E],
            newest: Output { u: 0.0, sigma: 0.0, sigma_star: 0.0, health: Health::OK },
            next: None,
            changed: None,
            track: None,
            waits: false,
            let_go: false,
            worst: 0,
            missed: 0,
        }
    }

    /// Runs one tick of a started controller, as [`Axis::go_on`].
    #[inline(always)]
    pub fn tick(&mut self, counts: [Option<i32>; E], applied: Option<f32>) -> Output<f32> {
        self.counts = counts;
        self.newest = self.axis.go_on(counts, applied);
        self.newest
    }

    /// Returns true if the coming tick starts a controller or is recorded. It then needs [`change`](Self::change).
    #[inline(always)]
    pub const fn is_to_change(&self) -> bool {
        self.waits || !self.axis.running().is_started()
    }

    /// Runs a tick that starts or switches the controller or is recorded. If the switch is impossible, the old
    /// controller ticks. In a recorded tick u includes the excitation and must be held.
    #[inline(never)]
    pub fn change(&mut self, counts: [Option<i32>; E], applied: Option<f32>) -> Output<f32> {
        let before = self.newest.u;
        // A value from the caller has priority over the value of the record.
        let held = self.track.as_ref().filter(|track| track.is.goes_on).map(|track| track.held(L::LATE));
        let applied = applied.or(held);
        // An alarm may have occurred since the request was checked.
        let next = self.next.take().filter(|_| !self.keeps());
        let retuned = next.map(|law| self.axis.retune(law, counts));
        self.counts = counts;
        self.newest = self.axis.tick(counts, applied);
        if let Some(retuned) = retuned {
            self.let_go &= retuned.is_err();
            self.changed = Some(retuned.map(|()| [before, self.newest.u]));
        }
        if let (Some(held), Some(track)) = (applied, self.track.as_mut().filter(|track| track.is.goes_on)) {
            self.newest.u = track.ticked(&counts, held, &self.newest, L::LATE);
            track.is.missed = self.missed.wrapping_sub(track.missed_before);
        }
        self.waits = self.next.is_some() || self.is_recording();
        self.newest
    }

    /// Returns true if a record is in progress.
    fn is_recording(&self) -> bool {
        self.track.as_ref().is_some_and(|track| track.is.goes_on)
    }

    /// Returns true if the trace buffer is frozen and a new design would clear it.
    const fn keeps(&self) -> bool {
        self.axis.is_frozen() && !self.let_go
    }

    /// Freezes the trace buffer for reading.
    fn freeze(&mut self) {
        self.axis.freeze();
        self.let_go = false;
    }

    /// Releases the trace buffer. It is then not kept if a persisting alarm freezes it again.
    fn release(&mut self) {
        self.axis.release();
        self.let_go = true;
    }

    /// Resets everything except controller and plan.
    fn reset(&mut self) {
        if let Some(track) = &mut self.track {
            track.end();
        }
        self.axis.reset();
        self.let_go = false;
    }

    /// Returns the output of the last tick.
    pub const fn newest(&self) -> &Output<f32> {
        &self.newest
    }

    /// Returns the axis: controller, plan and trace buffer.
    pub const fn axis(&self) -> &Axis<Monitored<L, E>, L::Plan, E, N, REMEMBERED> {
        &self.axis
    }
}

/// Access of the background to the axis.
pub trait Machine<L: Tuned<E, N>, const E: usize, const N: usize> {
    /// Runs `work` between two ticks. `work` must be short.
    fn between<T>(&mut self, work: impl FnOnce(&mut Seat<L, E, N>) -> T) -> T;

    /// Waits until the next tick has run, or longer.
    fn wait(&mut self);

    /// Returns the time of a stopwatch, in units of the target.
    fn now(&self) -> u32 {
        0
    }

    /// Disturbs the simulated plant. Returns `false` without one, as on a board.
    fn disturb(&mut self, _: &Disturbance) -> bool {
        false
    }

    /// Replaces the simulated plant. Returns `false` without one, as on a board.
    fn replace(&mut self, _: &Plant) -> bool {
        false
    }
}

/// Background side of a drive that ticks by its own interrupt.
pub struct Live<L: Tuned<E, N>, const E: usize, const N: usize> {
    session: Session,
    loading: Loading<MOST_DRIVE_WORDS>,
    /// Running design with its words, their hash, and the fingerprint of its controller.
    design: L::Design,
    period_s: f64,
    words: [u32; MOST_DRIVE_WORDS],
    count: usize,
    fingerprint: u32,
    shelf: Shelf,
    event: Option<Event>,
}

impl<L: Tuned<E, N>, const E: usize, const N: usize> Live<L, E, N> {
    /// Builds the drive from the words of its design ([`controller_core::drive::LAYOUT`]). Returns it with its first
    /// controller.
    ///
    /// # Errors
    /// Fails like [`Tuned::read`].
    pub fn new(design: impl IntoIterator<Item = u32>) -> Result<(Self, Monitored<L, E>), Refusal> {
        let (mut words, mut count) = ([0; MOST_DRIVE_WORDS], 0);
        for (slot, word) in words.iter_mut().zip(design) {
            *slot = word;
            count += 1;
        }
        let (design, law) = L::read(&words[..count])?;
        let live = Self {
            session: Session::new(),
            loading: Loading::new(),
            design,
            period_s: number(&words),
            words,
            count,
            fingerprint: law.fingerprint(),
            shelf: Shelf::NONE,
            event: None,
        };
        Ok((live, law))
    }

    /// Adds a memory for records. Its length is the largest number of rows.
    #[must_use]
    pub fn recording_in(mut self, rows: &'static mut [Row]) -> Self {
        self.shelf = Shelf::of(rows);
        self
    }

    /// Returns the memory, unless a record is in progress.
    pub fn into_rows(self) -> Option<&'static mut [Row]> {
        self.shelf.into_rows()
    }

    /// Returns the frame to send before the first request.
    pub fn hello(&self) -> [u8; REPLY_LEN] {
        Reply::Identity(self.session.identity()).to_frame(0)
    }

    /// Returns the event since the last call, for a log.
    pub const fn take_event(&mut self) -> Option<Event> {
        self.event.take()
    }

    /// Processes one byte from the host. Returns the reply if the byte completes a request. The call may take seconds,
    /// because the request is executed first. The caller must buffer the bytes that arrive meanwhile. A lost request is
    /// repeated by the host.
    pub fn receive(&mut self, byte: u8, machine: &mut impl Machine<L, E, N>) -> Option<[u8; REPLY_LEN]> {
        match self.session.hear(byte)? {
            Heard::Answer(frame) => Some(frame),
            Heard::Refused(refusal, frame) => {
                self.event = Some(Event::Refused(refusal));
                Some(frame)
            }
            Heard::New(request) => {
                let reply = request.and_then(|request| self.carry_out(&request, machine)).unwrap_or_else(|refusal| {
                    self.event = Some(Event::Refused(refusal));
                    Reply::Refused(refusal)
                });
                Some(self.session.answer(&reply))
            }
        }
    }

    fn carry_out(&mut self, request: &Request, machine: &mut impl Machine<L, E, N>) -> Result<Reply, Refusal> {
        match *request {
            Request::Open(open) => self.loading.open(open)?,
            Request::Load { offset, words } => self.loading.load(offset, words)?,
            Request::Observe => return Ok(observed(machine)),
            Request::Move { goal, ticks } => return self.plan(goal, ticks, machine),
            Request::Swap { at_rest } => return self.swap(at_rest, machine),
            Request::Order(Order::Freeze) => machine.between(Seat::freeze),
            Request::Order(Order::Release) => machine.between(Seat::release),
            Request::Order(Order::Reset) => reset(&self.design, self.period_s, machine)?,
            Request::Order(Order::Record) => self.record(machine)?,
            Request::Order(Order::EndRecord) => {
                machine.between(|seat| seat.track.iter_mut().for_each(Track::end));
                until(machine, |seat| !seat.is_recording());
            }
            Request::Prepare { rows, every } => {
                self.fetch(machine);
                self.shelf.prepare([rows, every], self.period_s)?;
            }
            Request::Shake { offset, currents } => self.shelf.shake(offset, currents, L::limits(&self.design))?,
            Request::Recall(part) => return self.recall(part, machine).map(Reply::Recalled),
            Request::Disturb(disturbance) if disturbance.load_n_m.is_finite() && machine.disturb(&disturbance) => {}
            Request::Plant(plant) if plant.iter().all(|it| *it >= 0.0 && it.is_finite()) && machine.replace(&plant) => {
            }
            _ => return Err(Refusal::of_kind(request)),
        }
        Ok(Reply::Done)
    }

    fn plan(
        &mut self,
        goal: Option<Rest<f32>>,
        ticks: u32,
        machine: &mut impl Machine<L, E, N>,
    ) -> Result<Reply, Refusal> {
        // Comparisons with NaN are false.
        let is_near = |goal: Rest<f32>| goal.turn.unsigned_abs() <= FURTHEST_TURNS && goal.angle.abs() <= 10.0;
        if !goal.is_none_or(is_near) {
            return Err(Refusal::of(Reason::Goal));
        }
        let mut ahead = (AHEAD_S / self.period_s) as u32 + 2;
        // The next search begins at this result and ends at once.
        let mut fewest = ticks;
        for _ in 0..ATTEMPTS {
            let (tick, present, health) =
                machine.between(|seat| (seat.axis.tick_number(), seat.axis.plan().clone(), seat.newest.health));
            if health.contains(Health::STOPPED) {
                return Err(Refusal::of(Reason::Stopped));
            }
            let start = tick.wrapping_add(ahead);
            let range = [fewest, if ticks == 0 || goal.is_none() { u32::MAX } else { ticks }];
            let (plan, found) = L::plan(&self.design, &present, goal, start, range)?;
            let (now, is_in_time) = machine.between(|seat| {
                let now = seat.axis.tick_number();
                let is_in_time = start.wrapping_sub(now) as i32 > 0;
                if is_in_time {
                    seat.axis.play_at(start, plan);
                }
                (now, is_in_time)
            });
            if is_in_time {
                until(machine, |seat| seat.axis.tick_number().wrapping_sub(start) as i32 > 0);
                return Ok(Reply::Planned { start, ticks: found });
            }
            fewest = found;
            ahead = (now.wrapping_sub(tick) / 8).max(2 * ahead);
        }
        Err(Refusal::of(Reason::Late))
    }

    /// Takes back a record that has ended by itself.
    fn fetch(&mut self, machine: &mut impl Machine<L, E, N>) {
        if self.shelf.is_lent()
            && let Some(track) = machine.between(|seat| if seat.is_recording() { None } else { seat.track.take() })
        {
            self.shelf = track.ended();
        }
    }

    fn record(&mut self, machine: &mut impl Machine<L, E, N>) -> Result<(), Refusal> {
        let (is_started, health) = machine.between(|seat| (seat.axis.running().is_started(), seat.newest.health));
        if health.contains(Health::STOPPED) || !is_started {
            return Err(Refusal::of(Reason::Stopped));
        }
        let (rows, wanted) = self.shelf.lend()?;
        let limits = L::limits(&self.design);
        machine.between(|seat| {
            let begin = [seat.axis.tick_number(), seat.missed];
            seat.track = Some(Track::new(rows, wanted, limits, begin, seat.newest.u));
            seat.waits = true;
        });
        Ok(())
    }

    fn swap(&mut self, at_rest: bool, machine: &mut impl Machine<L, E, N>) -> Result<Reply, Refusal> {
        let (open, words) = self.loading.loaded()?;
        if open.instance != L::INSTANCE {
            return Err(Refusal { reason: Reason::Instance, target: 0, request: open.instance.word() });
        }
        // Only the timer of the chip has the true period.
        agree(Reason::Period, nanoseconds(self.period_s), nanoseconds(number(words)))?;
        let (keeps, is_recording, is_moving) = machine.between(|seat| {
            (seat.keeps(), seat.is_recording(), L::left(seat.axis.plan(), seat.axis.tick_number()) > 0)
        });
        for (is, reason) in
            [(keeps, Reason::Frozen), (is_recording, Reason::Recording), (at_rest && is_moving, Reason::Moving)]
        {
            if is {
                return Err(Refusal::of(reason));
            }
        }
        let (began, first) = (machine.now(), machine.between(|seat| seat.axis.tick_number()));
        let (design, law) = L::read_as(words, at_rest)?;
        let (fingerprint, time) = (law.fingerprint(), machine.now().wrapping_sub(began));
        let last = machine.between(|seat| {
            (seat.next, seat.waits) = (Some(law), true);
            seat.axis.tick_number()
        });
        until(machine, |seat| seat.next.is_none());
        let (tick, changed) = machine.between(|seat| (seat.axis.black_box()[1].first, seat.changed.take()));
        let u = match changed {
            Some(Ok(u)) => u,
            Some(Err(error)) => {
                let why = RETUNE_ERRORS.iter().position(|&known| known == error).unwrap_or(RETUNE_ERRORS.len());
                return Err(Refusal { reason: Reason::Retune, target: why as u32, request: 0 });
            }
            None => return Err(Refusal::of(Reason::Frozen)),
        };
        (self.count, self.design, self.fingerprint) = (words.len(), design, fingerprint);
        self.words[..words.len()].copy_from_slice(words);
        self.loading.close();
        self.event = Some(Event::Started(open));
        Ok(Reply::Swapped(Swapped { tick, ticks: last.wrapping_sub(first), time, u, fingerprint }))
    }

    fn recall(&mut self, part: Part, machine: &mut impl Machine<L, E, N>) -> Result<[u32; REPLY_WORDS], Refusal> {
        self.fetch(machine);
        let words = &self.words[..self.count];
        let (half, part) = match part {
            Part::Design => {
                let open = Open::new(L::INSTANCE, words);
                return Ok(filled([open.instance.word(), open.count, open.design, self.fingerprint]));
            }
            Part::DesignWords(from) => return Ok(filled(words.iter().copied().skip(from as usize))),
            Part::Track => {
                let now = machine.between(|seat| seat.track.as_ref().map(|track| track.is));
                return Ok(filled(self.shelf.is(now).words()));
            }
            Part::Rows(from) => return Ok(filled(self.shelf.rows(from)?.iter().flatten().copied())),
            Part::Half(half) | Part::State(half, _) | Part::Frame(half, _) => (half, part),
        };
        machine.between(|seat| {
            if !seat.axis.is_frozen() {
                return Err(Refusal::of(Reason::NotFrozen));
            }
            let stretch: &Black<L, E, N> =
                seat.axis.black_box().into_iter().nth(half as usize).ok_or(Refusal::of(Reason::Absent))?;
            let state = stretch.state.iter().flat_map(Words::words);
            Ok(match part {
                Part::State(_, from) => filled(state.skip(from as usize)),
                Part::Frame(_, index) => {
                    let frame = stretch.frames().get(index as usize).ok_or(Refusal::of(Reason::Absent))?;
                    filled(framed(frame))
                }
                _ => {
                    let head = [stretch.first, stretch.frames().len() as u32, state.count() as u32];
                    let Target { turn, jet } = stretch.begin;
                    filled(head.into_iter().chain([turn as u32]).chain(jet.map(f32::to_bits)))
                }
            })
        })
    }
}

/// Returns the first number of a design: its period, s.
fn number(words: &[u32]) -> f64 {
    let [low, high] = [0, 1].map(|i| words.get(i).copied().map_or(0, u64::from));
    f64::from_bits(low | high << 32)
}

fn nanoseconds(period_s: f64) -> u32 {
    (period_s * 1e9 + 0.5) as u32
}

/// Waits for an action of the interrupt.
fn until<L: Tuned<E, N>, const E: usize, const N: usize>(
    machine: &mut impl Machine<L, E, N>,
    is_done: impl Fn(&Seat<L, E, N>) -> bool,
) {
    while !machine.between(|seat| is_done(seat)) {
        machine.wait();
    }
}

fn observed<L: Tuned<E, N>, const E: usize, const N: usize>(machine: &mut impl Machine<L, E, N>) -> Reply {
    let (plan, known, mut observed) = machine.between(|seat| {
        let Output { u, sigma_star, health, .. } = seat.newest;
        let observed = Observed {
            tick: seat.axis.tick_number(),
            u,
            sigma_star,
            health,
            frozen: seat.axis.is_frozen(),
            started: false,
            moving: false,
            turn: 0,
            estimates: [[0.0; 4]; MAX_E],
            reference: 0.0,
            worst: seat.worst,
            missed: seat.missed,
        };
        (seat.axis.plan().clone(), seat.axis.running().estimates(), observed)
    });
    observed.started = known.is_some();
    observed.moving = L::left(&plan, observed.tick) > 0;
    if let Some(DriveEstimates { turn, position, speed, disturbance, load }) = known {
        observed.turn = turn;
        for i in 0..E {
            observed.estimates[i] = [position[i], speed[i], disturbance[i], load[i]];
        }
    }
    let Target { turn, jet } = plan.at(observed.tick);
    observed.reference = jet[0] + turn.wrapping_sub(observed.turn) as f32 * core::f32::consts::TAU;
    Reply::Observed(observed)
}

/// Restarts a stopped drive at its present counts, if its shafts are at rest.
///
/// A stopped drive estimates no speed, so the speed is measured from the counts.
fn reset<L: Tuned<E, N>, const E: usize, const N: usize>(
    design: &L::Design,
    period_s: f64,
    machine: &mut impl Machine<L, E, N>,
) -> Result<(), Refusal> {
    let (law, health) = machine.between(|seat| (*seat.axis.running().design(), seat.newest.health));
    // A drive that rejects every sample and stops at no alarm has no other way back.
    if !health.intersects(Health::STOPPED | Health::INPUT_REJECTED) {
        return Err(Refusal::of(Reason::NotStopped));
    }
    let speed_rad_s = turning(L::encoders(design), period_s, machine)?;
    if speed_rad_s > RESET_RAD_S {
        let [target, request] = [speed_rad_s, RESET_RAD_S].map(f32::to_bits);
        return Err(Refusal { reason: Reason::Moving, target, request });
    }
    let (counts, tick) = machine.between(|seat| (seat.counts, seat.axis.tick_number()));
    let still = L::rest(Rest { turn: 0, angle: 0.0 }).at(tick);
    let state = law.start(&<Monitored<L, E> as DriveLaw<E, N>>::sample(counts, &still, &still));
    let state = state.ok_or(Refusal::of(Reason::Absent))?;
    let DriveEstimates { turn, position, .. } = law.estimates(&state);
    // The plan is set before the controller, so its first tick sees no jump from the old plan.
    let start = machine.between(|seat| {
        let start = seat.axis.tick_number().wrapping_add(2);
        seat.axis.play_at(start, L::rest(Rest { turn, angle: position[0] }));
        start
    });
    until(machine, |seat| seat.axis.tick_number().wrapping_sub(start) as i32 > 0);
    machine.between(Seat::reset);
    Ok(())
}

/// Measures the speed of the fastest shaft over [`RESET_S`], rad/s behind the gear.
fn turning<L: Tuned<E, N>, const E: usize, const N: usize>(
    encoders: [Encoder; E],
    period_s: f64,
    machine: &mut impl Machine<L, E, N>,
) -> Result<f32, Refusal> {
    let (begin, counts) = machine.between(|seat| (seat.axis.tick_number(), seat.counts));
    let mut last = [0; E];
    for (to, from) in last.iter_mut().zip(counts) {
        *to = from.ok_or(Refusal::of(Reason::Absent))?;
    }
    let ticks = (RESET_S / period_s) as u32 + 1;
    let (mut tick, mut moved, mut way_rad) = (begin, [0_i64; E], 0.0_f32);
    while tick.wrapping_sub(begin) < ticks {
        let before = tick;
        until(machine, |seat| seat.axis.tick_number() != before);
        let counts;
        (tick, counts) = machine.between(|seat| (seat.axis.tick_number(), seat.counts));
        for (i, encoder) in encoders.iter().enumerate() {
            // A lost count is no motion.
            let count = counts[i].unwrap_or(last[i]);
            moved[i] += i64::from(encoder.moved(last[i], count));
            last[i] = count;
            way_rad = way_rad.max((moved[i] as f32 * encoder.unit_rad() as f32).abs());
        }
    }
    Ok(way_rad / (tick.wrapping_sub(begin) as f32 * period_s as f32))
}

/// Returns a frame as protocol words.
fn framed<const E: usize, const N: usize>(frame: &Frame<E, N>) -> impl Iterator<Item = u32> {
    let Frame { counts, end, applied, u, health } = *frame;
    let end = Target { turn: end.turn, jet: core::array::from_fn(|j| end.jet.get(j).copied().unwrap_or(0.0)) };
    let counts = Counts { counts: core::array::from_fn(|i| counts.get(i).copied().flatten()), end, applied };
    counts.words().into_iter().chain([u.to_bits(), u32::from(health.bits())])
}

/// Returns the first sixteen words.
fn filled(from: impl IntoIterator<Item = u32>) -> [u32; REPLY_WORDS] {
    let mut words = [0; REPLY_WORDS];
    for (to, word) in words.iter_mut().zip(from) {
        *to = word;
    }
    words
}

const _: () = assert!(MAX_N <= 4, "a frame of the trace buffer is eleven words");
