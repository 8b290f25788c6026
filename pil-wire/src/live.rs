//! A drive that runs by itself, at the end of the wire: observed, moved, given another design while it goes on.
//!
//! ```text
//! interrupt:   Seat::tick; Seat::change where a law starts or waits    never waits for anyone
//! background:  Live::receive: a byte in, a reply out                   designs and plans, in 64 bits
//! ```
//!
//! The two meet in a [`Seat`], which the interrupt has whenever it comes: the background reaches it through
//! [`Machine::between`], for some hundred cycles at a time. What takes long is done outside: a design is made and a
//! plan is tried while the interrupt goes on, and then handed over whole. What is refused has changed nothing.
//!
//! * **Move**: the join begins at a tick that is still to come, where the present plan is then, whatever the shaft
//!   does. Its feed-forward must stay within 0.9 of the limits, its speed within 0.8 of what an encoder can follow.
//! * **Swap**: the new law takes over with the counts of the very tick, so that u does not jump. That tick takes some
//!   three times as long as others; it has a function of its own ([`Seat::change`]), so that another interrupt can do
//!   it.
//! * **Reset**: after an alarm has stopped the drive; the plan is then to rest where the counts are.
//! * **Record**: counts and current of some seconds in a memory that the main program gives, and what shakes the drive
//!   meanwhile ([`Tracked`]). It has its ticks in [`Seat::change`] too.
//! * **Recall**: the black box, as soon as it stands still; the record, as soon as it has ended.
//!
//! All of it runs in the tests without a chip.

use controller_core::drive::{Axis, DriveEstimates, DriveLaw, Frame, Monitored, Reference, Rest, Stretch, Target};
use controller_core::{ControlLaw, Health, Output, RetuneError, Words};

use crate::drives::{MOST_DRIVE_WORDS, Tuned};
use crate::frame::{
    Counts, Disturbance, Observed, Open, Order, Part, Plant, RETUNE_ERRORS, Reason, Refusal, Reply, Request, Swapped,
};
use crate::session::{Heard, Loading, Session, agree};
use crate::target::Event;
use crate::track::{Row, Shelf, Track};
use crate::{MAX_E, MAX_N, REPLY_LEN, REPLY_WORDS};

/// Ticks of one half of the black box: at least so many stand before an alarm.
pub const REMEMBERED: usize = 256;
/// A plan begins so long after the request, s; if it is not ready then, twice as late or more, so often.
const AHEAD_S: f64 = 0.01;
const ATTEMPTS: u32 = 8;
/// No goal is further from angle 0, turns: a join in 32 bits is exact to 4e-7 of its way.
const FURTHEST_TURNS: u32 = 10_000;

type Black<L, const E: usize, const N: usize> = Stretch<<Monitored<L, E> as ControlLaw>::State, E, N, REMEMBERED>;

/// What interrupt and background share.
pub struct Seat<L: Tuned<E, N>, const E: usize, const N: usize> {
    axis: Axis<Monitored<L, E>, L::Plan, E, N, REMEMBERED>,
    counts: [Option<i32>; E],
    newest: Output<f32>,
    /// A law that waits for its first tick, and what came of it: u before, u after.
    next: Option<Monitored<L, E>>,
    changed: Option<Result<[f32; 2], RetuneError>>,
    /// A record that is being made, or has ended.
    track: Option<Track>,
    /// Is there a law that waits, or a record that goes on?
    waits: bool,
    /// Nobody wants what the black box has, though an alarm that lasts may have stopped it again.
    let_go: bool,
    /// The longest that the interrupt took, and ticks that came late: the interrupt's to tell.
    pub worst: u32,
    /// See [`worst`](Self::worst).
    pub missed: u32,
}

impl<L: Tuned<E, N>, const E: usize, const N: usize> Seat<L, E, N> {
    /// Waits for its first counts, at rest at angle 0.
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

    /// One tick of a law that has started, as [`Axis::go_on`].
    #[inline(always)]
    pub fn tick(&mut self, counts: [Option<i32>; E], applied: Option<f32>) -> Output<f32> {
        self.counts = counts;
        self.newest = self.axis.go_on(counts, applied);
        self.newest
    }

    /// Is the coming tick the first of a law, or one that is recorded? Then it is [`change`](Self::change).
    #[inline(always)]
    pub const fn is_to_change(&self) -> bool {
        self.waits || !self.axis.running().is_started()
    }

    /// A tick in which a law starts, or the one that waits takes over, if it can (else it is one of the old law), or
    /// that is recorded: then u is what is to be held, with what shakes.
    #[inline(never)]
    pub fn change(&mut self, counts: [Option<i32>; E], applied: Option<f32>) -> Output<f32> {
        let before = self.newest.u;
        // Whoever knows better what was held says so.
        let held = self.track.as_ref().filter(|track| track.is.goes_on).map(|track| track.held(L::LATE));
        let applied = applied.or(held);
        // An alarm may have come up since the request was looked at.
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

    /// Is a record being made?
    fn is_recording(&self) -> bool {
        self.track.as_ref().is_some_and(|track| track.is.goes_on)
    }

    /// Is there a black box that stands still, and that a change of the design would begin anew?
    const fn keeps(&self) -> bool {
        self.axis.is_frozen() && !self.let_go
    }

    /// The black box stands still, and somebody wants what it has.
    fn freeze(&mut self) {
        self.axis.freeze();
        self.let_go = false;
    }

    /// It goes on; nobody wants what it has, nor what stops it next while the alarm lasts.
    fn release(&mut self) {
        self.axis.release();
        self.let_go = true;
    }

    /// All but law and plan begins anew.
    fn reset(&mut self) {
        if let Some(track) = &mut self.track {
            track.end();
        }
        self.axis.reset();
        self.let_go = false;
    }

    /// What the last tick gave.
    pub const fn newest(&self) -> &Output<f32> {
        &self.newest
    }

    /// Law, plan and black box.
    pub const fn axis(&self) -> &Axis<Monitored<L, E>, L::Plan, E, N, REMEMBERED> {
        &self.axis
    }
}

/// Where the axis is, seen from the background.
pub trait Machine<L: Tuned<E, N>, const E: usize, const N: usize> {
    /// Between two ticks, as short as `work` is.
    fn between<T>(&mut self, work: impl FnOnce(&mut Seat<L, E, N>) -> T) -> T;

    /// Until the next tick has been, or longer.
    fn wait(&mut self);

    /// A stopwatch.
    fn now(&self) -> u32 {
        0
    }

    /// Does it to the stand-in of a plant; `false` where there is none, as on a board.
    fn disturb(&mut self, _: &Disturbance) -> bool {
        false
    }

    /// Puts another plant in its place; `false` where there is none, as on a board.
    fn replace(&mut self, _: &Plant) -> bool {
        false
    }
}

/// The background's side of a drive that runs by itself.
pub struct Live<L: Tuned<E, N>, const E: usize, const N: usize> {
    session: Session,
    loading: Loading<MOST_DRIVE_WORDS>,
    /// What runs: design, its words, their hash, and fingerprint of its law.
    design: L::Design,
    period_s: f64,
    words: [u32; MOST_DRIVE_WORDS],
    count: usize,
    fingerprint: u32,
    shelf: Shelf,
    event: Option<Event>,
}

impl<L: Tuned<E, N>, const E: usize, const N: usize> Live<L, E, N> {
    /// Of what a drive is designed from, as words ([`controller_core::drive::LAYOUT`]); and the law to begin with.
    ///
    /// # Errors
    /// Those of [`Tuned::read`].
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

    /// The same, with a memory for records: as many rows as it has.
    #[must_use]
    pub fn recording_in(mut self, rows: &'static mut [Row]) -> Self {
        self.shelf = Shelf::of(rows);
        self
    }

    /// That memory again, when no record is being made in it.
    pub fn into_rows(self) -> Option<&'static mut [Row]> {
        self.shelf.into_rows()
    }

    /// What to send before the first request.
    pub fn hello(&self) -> [u8; REPLY_LEN] {
        Reply::Identity(self.session.identity()).to_frame(0)
    }

    /// What happened since the last call that is worth a line in a log.
    pub const fn take_event(&mut self) -> Option<Event> {
        self.event.take()
    }

    /// One byte from the host; what to send back, if it completes a request that is answered. Returns when it has been
    /// carried out, which may take seconds: bytes that come meanwhile are kept by the caller, or lost and repeated.
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
            Request::Order(Order::Reset) => reset(machine)?,
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
        // A NaN is within no bound.
        let is_near = |goal: Rest<f32>| goal.turn.unsigned_abs() <= FURTHEST_TURNS && goal.angle.abs() <= 10.0;
        if !goal.is_none_or(is_near) {
            return Err(Refusal::of(Reason::Goal));
        }
        let mut ahead = (AHEAD_S / self.period_s) as u32 + 2;
        // What was found is where the next search begins: it is over at once.
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
        // Nothing but the timer of the chip knows how often it ticks.
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

/// The first number of a design: its period, s.
fn number(words: &[u32]) -> f64 {
    let [low, high] = [0, 1].map(|i| words.get(i).copied().map_or(0, u64::from));
    f64::from_bits(low | high << 32)
}

fn nanoseconds(period_s: f64) -> u32 {
    (period_s * 1e9 + 0.5) as u32
}

/// Waits for something that the interrupt does.
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

/// A drive that has stopped starts again, at rest where its counts are.
fn reset<L: Tuned<E, N>, const E: usize, const N: usize>(machine: &mut impl Machine<L, E, N>) -> Result<(), Refusal> {
    let (law, counts, health, tick) = machine
        .between(|seat| (*seat.axis.running().design(), seat.counts, seat.newest.health, seat.axis.tick_number()));
    // One that rejects everything and stops at nothing has no other way back.
    if !health.intersects(Health::STOPPED | Health::INPUT_REJECTED) {
        return Err(Refusal::of(Reason::NotStopped));
    }
    let still = L::rest(Rest { turn: 0, angle: 0.0 }).at(tick);
    let state = law.start(&<Monitored<L, E> as DriveLaw<E, N>>::sample(counts, &still, &still));
    let state = state.ok_or(Refusal::of(Reason::Absent))?;
    let DriveEstimates { turn, position, .. } = law.estimates(&state);
    // The plan is there before the law is: its first tick sees no jump from the old one.
    let start = machine.between(|seat| {
        let start = seat.axis.tick_number().wrapping_add(2);
        seat.axis.play_at(start, L::rest(Rest { turn, angle: position[0] }));
        start
    });
    until(machine, |seat| seat.axis.tick_number().wrapping_sub(start) as i32 > 0);
    machine.between(Seat::reset);
    Ok(())
}

/// As the wire has it.
fn framed<const E: usize, const N: usize>(frame: &Frame<E, N>) -> impl Iterator<Item = u32> {
    let Frame { counts, end, applied, u, health } = *frame;
    let end = Target { turn: end.turn, jet: core::array::from_fn(|j| end.jet.get(j).copied().unwrap_or(0.0)) };
    let counts = Counts { counts: core::array::from_fn(|i| counts.get(i).copied().flatten()), end, applied };
    counts.words().into_iter().chain([u.to_bits(), u32::from(health.bits())])
}

/// The first sixteen.
fn filled(from: impl IntoIterator<Item = u32>) -> [u32; REPLY_WORDS] {
    let mut words = [0; REPLY_WORDS];
    for (to, word) in words.iter_mut().zip(from) {
        *to = word;
    }
    words
}

const _: () = assert!(MAX_N <= 4, "a frame of the black box is eleven words");
