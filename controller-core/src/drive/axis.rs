//! Axis of a machine as its control interrupt uses it: law, reference, and the ticks before a trip.
//!
//! ```text
//! interrupt:   counts -> Axis::tick -> u            the plan moves on, the trace buffer remembers
//! background:  Axis::play_at, retune, release       between two ticks, in a short critical section
//! ```
//!
//! A plan is computed in the background, in 64 bits, for a future tick ([`Axis::tick_number`] plus a few). The
//! interrupt switches to it at that tick, from the point of the old plan, for any state of the shaft.
//!
//! # The trace buffer
//! The trace buffer holds the inputs of at least the last `LEN` ticks, and the state before the
//! first of them. With the design, the ticks can be run again bit for bit ([`replay`]), or with another design on the
//! recorded counts.
//!
//! After the first alarm ([`ALARMS`]) of a started law the buffer freezes until it is [released](Axis::release). It
//! consists of two halves of `LEN` that alternate, each with the state at its start. So the state is copied every `LEN`
//! ticks instead of in every tick.

use super::law::DriveLaw;
use super::monitor::ALARMS;
use super::reference::Reference;
use super::target::Target;
use crate::controller::Output;
use crate::health::Health;
use crate::running::{RetuneError, Running};

/// Inputs and outputs of one tick. `applied` is NaN if it was not reported.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame<const E: usize, const N: usize> {
    /// Counts. `None` for a lost count.
    pub counts: [Option<i32>; E],
    /// Target at the end of the tick.
    pub end: Target<f32, i32, N>,
    /// Current that the actuator held before, if it was reported.
    pub applied: f32,
    /// Current command u.
    pub u: f32,
    /// Status flags.
    pub health: Health,
}

/// Consecutive ticks, and the state before the first of them.
#[derive(Clone, Debug)]
// Fields before the frames are reachable by an address offset, without an addition.
#[repr(C)]
pub struct Stretch<S, const E: usize, const N: usize, const LEN: usize> {
    /// State of the law. `None` before its start.
    pub state: Option<S>,
    /// Number of the first tick.
    pub first: u32,
    /// Target at the start of the first tick.
    pub begin: Target<f32, i32, N>,
    length: usize,
    frames: [Frame<E, N>; LEN],
}

impl<S, const E: usize, const N: usize, const LEN: usize> Stretch<S, E, N, LEN> {
    const EMPTY: Self = {
        let rest = Target { turn: 0, jet: [0.0; N] };
        let frame = Frame { counts: [None; E], end: rest, applied: f32::NAN, u: 0.0, health: Health::OK };
        Self { state: None, first: 0, begin: rest, length: 0, frames: [frame; LEN] }
    };

    /// Returns the ticks, oldest first.
    pub fn frames(&self) -> &[Frame<E, N>] {
        &self.frames[..self.length.min(LEN)]
    }
}

/// Ticks between two checks for a finished plan, out of 2³² until the plan would run again.
const SETTLED: u32 = 1 << 16;

/// Law, plan and trace buffer of one axis.
// Layout as for a stretch.
#[repr(C)]
pub struct Axis<L: DriveLaw<E, N>, R, const E: usize, const N: usize, const LEN: usize> {
    running: Running<L>,
    /// Present plan and next plan. The next one is valid if `next` has its first tick. So no interrupt copies a plan.
    plans: [R; 2],
    played: usize,
    next: Option<u32>,
    /// Number of the coming tick, and the target at its start.
    tick: u32,
    begin: Target<f32, i32, N>,
    newer: usize,
    frozen: bool,
    halves: [Stretch<L::State, E, N, LEN>; 2],
}

impl<L, R, const E: usize, const N: usize, const LEN: usize> Axis<L, R, E, N, LEN>
where
    L: DriveLaw<E, N>,
    R: Reference<f32, N> + Clone,
{
    /// Returns an axis with this plan from tick 0 on. Its first valid counts start the law.
    pub fn new(law: L, plan: R) -> Self {
        let tick = L::LATE as u32;
        let begin = plan.at(tick);
        Self {
            running: Running::new(law),
            plans: [plan.clone(), plan],
            played: 0,
            next: None,
            tick,
            begin,
            halves: [Stretch::EMPTY; 2],
            newer: 0,
            frozen: false,
        }
    }

    /// Computes one tick. `applied` is the u that the actuator held since the last tick, if it differs from the output.
    #[inline(always)]
    pub fn tick(&mut self, counts: [Option<i32>; E], applied: Option<f32>) -> Output<f32> {
        self.ticked(counts, applied, Running::tick)
    }

    /// Computes one tick without a start ([`Running::go_on`]), to keep the start out of the WCET bound of a short
    /// interrupt.
    #[inline(always)]
    pub fn go_on(&mut self, counts: [Option<i32>; E], applied: Option<f32>) -> Output<f32> {
        self.ticked(counts, applied, Running::go_on)
    }

    // Always inlined: with a second caller, such as the tick in which a design changes, it would become a call.
    #[inline(always)]
    fn ticked(
        &mut self,
        counts: [Option<i32>; E],
        applied: Option<f32>,
        run: impl FnOnce(&mut Running<L>, &L::Sample) -> Output<f32>,
    ) -> Output<f32> {
        if let Some(u) = applied {
            self.running.report_applied(u);
        }
        self.go_along();
        if !self.frozen {
            self.make_room();
        }
        let end = self.plan().at(self.tick.wrapping_add(1));
        let sample = L::sample(counts, &self.begin, &end);
        (self.tick, self.begin) = (self.tick.wrapping_add(1), end);
        let output = run(&mut self.running, &sample);
        if !self.frozen {
            let Output { u, health, .. } = output;
            let half = &mut self.halves[self.newer & 1];
            if let Some(frame) = half.frames.get_mut(half.length) {
                *frame = Frame { counts, end, applied: applied.unwrap_or(f32::NAN), u, health };
                half.length += 1;
            }
            // Before it accepts its counts a law rejects everything, which is not a trip. Waiting is not a trip either,
            // except for the tick in which the law gives up its position.
            if health.intersects(ALARMS) && self.running.is_started() {
                self.frozen = !health.contains(Health::WAITS) || health.contains(Health::SAMPLE_LOST);
            }
        }
        output
    }

    /// Switches to a plan that begins with the coming tick, and now and then marks a finished plan as finished.
    #[inline(always)]
    fn go_along(&mut self) {
        if self.tick.is_multiple_of(SETTLED) {
            self.plans[self.played & 1].settle(self.tick);
        }
        if self.next == Some(self.tick) {
            (self.played, self.next) = (self.played ^ 1, None);
        }
    }

    /// Starts the other half with the coming tick, if this one is full.
    #[inline(always)]
    #[allow(clippy::assigning_clones, reason = "`clone_from` of an option is twice the code")]
    fn make_room(&mut self) {
        let length = self.halves[self.newer & 1].length;
        if length == 0 || length >= LEN {
            self.newer = (self.newer + usize::from(length > 0)) & 1;
            let half = &mut self.halves[self.newer & 1];
            (half.first, half.begin, half.length) = (self.tick, self.begin, 0);
            half.state = self.running.state.clone();
        }
    }

    /// Returns the number of the coming tick.
    pub const fn tick_number(&self) -> u32 {
        self.tick
    }

    /// Switches to another plan at the tick `start`. The plan must begin at the point of the present plan at that tick.
    ///
    /// A plan that was scheduled before and has not begun is discarded.
    pub fn play_at(&mut self, start: u32, plan: R) {
        self.plans[(self.played ^ 1) & 1] = plan;
        self.next = Some(start);
    }

    /// Returns the present plan.
    pub const fn plan(&self) -> &R {
        &self.plans[self.played & 1]
    }

    /// Returns the law with its state.
    pub const fn running(&self) -> &Running<L> {
        &self.running
    }

    /// Switches the law to another design before the coming tick without a jump of u (bumpless transfer).
    ///
    /// `counts` are the counts of the coming tick. The trace buffer restarts, because its ticks belong to one design.
    ///
    /// # Errors
    /// Returns the errors of [`Running::retune`]. Nothing is changed in this case.
    pub fn retune(&mut self, law: L, counts: [Option<i32>; E]) -> Result<(), RetuneError> {
        self.go_along();
        let end = self.plan().at(self.tick.wrapping_add(1));
        self.running.retune(law, &L::sample(counts, &self.begin, &end))?;
        self.release();
        Ok(())
    }

    /// Returns true if the trace buffer is frozen.
    pub const fn is_frozen(&self) -> bool {
        self.frozen
    }

    /// Returns the contents of the trace buffer, older half first. An empty half has no frames.
    pub fn black_box(&self) -> [&Stretch<L::State, E, N, LEN>; 2] {
        [&self.halves[(self.newer + 1) & 1], &self.halves[self.newer & 1]]
    }

    /// Freezes the trace buffer, as after an alarm. The law continues.
    pub const fn freeze(&mut self) {
        self.frozen = true;
    }

    /// Clears the trace buffer and restarts it. The law continues or stays stopped, as it was.
    pub fn release(&mut self) {
        for half in &mut self.halves {
            half.length = 0;
        }
        self.frozen = false;
    }

    /// Resets the law after a stop: all estimates are erased, and the next valid counts start it. Also clears the black
    /// box.
    pub fn reset(&mut self) {
        self.running.reset();
        self.release();
    }
}

/// Runs the ticks of a stretch again, with a law in its state at the start. Returns the new output and the recorded
/// frame of each tick.
pub fn replay<L: DriveLaw<E, N>, const E: usize, const N: usize>(
    running: &mut Running<L>,
    begin: Target<f32, i32, N>,
    frames: &[Frame<E, N>],
) -> impl Iterator<Item = (Output<f32>, Frame<E, N>)> {
    let mut begin = begin;
    frames.iter().map(move |frame| {
        running.report_applied(frame.applied);
        let output = running.tick(&L::sample(frame.counts, &begin, &frame.end));
        begin = frame.end;
        (output, *frame)
    })
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec::Vec;

    use super::*;
    use crate::Limits;
    use crate::drive::{Bounds, Encoder, Joined, Monitored, Motor, MotorDesign, MotorDrive, Position, Rest, gap};
    use crate::running::Words;

    type Law = Monitored<MotorDrive<f32, Position, 1>, 1>;
    type Plan = Joined<f32, Rest<f32>, 3>;

    const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 0.0 };
    const DESIGN: MotorDesign = MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));

    fn law(surface_rad_s: f64) -> Law {
        let design = DESIGN.with_surface(surface_rad_s);
        let law = MotorDrive::<f32, Position, 1>::try_design(&design).expect("a good design");
        let bounds: Bounds<1> = design.bounds(&law, 0.2);
        Monitored::new(law, &bounds).stopping()
    }

    fn to(angle: f32, from: &Plan, start: u32) -> Plan {
        let goal = Rest { turn: 0, angle };
        let (present, target): (Target<f32, i32, 3>, _) = (from.at(start), goal.at(start));
        Joined::new(goal, gap(&present, &target), start, 100, 1e-3)
    }

    /// Shaft without friction and with an encoder, which freezes from a tick on.
    struct Shaft {
        x: [f64; 2],
        stuck: bool,
        count: i32,
    }

    impl Shaft {
        fn count(&mut self) -> [Option<i32>; 1] {
            if !self.stuck {
                self.count = (self.x[0] * 16384.0 / core::f64::consts::TAU) as i32;
            }
            [Some(self.count)]
        }

        fn advance(&mut self, u: f32) {
            self.x[1] += 1e-3 * MOTOR.input_gain() * f64::from(u);
            self.x[0] += 1e-3 * self.x[1];
        }
    }

    fn axis<const LEN: usize>() -> Axis<Law, Plan, 1, 2, LEN> {
        Axis::new(law(60.0), Joined::new(Rest { turn: 0, angle: 0.0 }, [0.0; 3], 0, 1, 1e-3))
    }

    /// Checks the usual start of a board whose encoders answer late.
    #[test]
    fn counts_that_are_missing_before_the_start_are_no_trip() {
        let mut axis = axis::<16>();
        for _ in 0..5 {
            assert!(axis.tick([None], None).health.contains(Health::INPUT_REJECTED) && !axis.is_frozen());
        }
        // Ten counts must be consistent.
        for tick in 1..15 {
            let health = axis.tick([Some(0)], None).health;
            assert!(health.contains(Health::WAITS) == (tick < 10) && !axis.is_frozen(), "tick {tick}: {health}");
        }
        for _ in 0..100 {
            axis.tick([None], None);
        }
        assert!(axis.is_frozen());
    }

    /// Checks counts that are present but rejected for too long, for a drive that continues.
    #[test]
    fn counts_that_are_given_up_are_a_trip() {
        let law = MotorDrive::<f32, Position, 1>::try_design(&DESIGN).expect("a good design");
        let telling: Law = Monitored::new(law, &DESIGN.bounds(&law, 0.2));
        let plan: Plan = Joined::new(Rest { turn: 0, angle: 0.0 }, [0.0; 3], 0, 1, 1e-3);
        let mut axis = Axis::<Law, Plan, 1, 2, 16>::new(telling, plan);
        for _ in 0..20 {
            axis.tick([Some(0)], None);
        }
        let mut given_up = false;
        for tick in 0..60 {
            assert!(!axis.is_frozen(), "tick {tick}");
            // Half a revolution off, at alternating positions.
            let health = axis.tick([Some(if tick % 2 == 0 { 8000 } else { -3000 })], None).health;
            given_up = health.contains(Health::WAITS);
            if given_up {
                break;
            }
        }
        assert!(given_up && axis.is_frozen());
    }

    /// Checks ten days at 5 kHz, without waiting for them.
    #[test]
    fn a_plan_that_is_over_is_not_gone_along_again_when_ticks_have_wrapped() {
        let mut axis = axis::<16>();
        axis.play_at(30, to(1.0, axis.plan(), 30));
        for _ in 0..200 {
            axis.tick([Some(0)], None);
        }
        axis.tick = SETTLED;
        axis.tick([Some(0)], None);
        axis.tick = 30;
        for _ in 0..200 {
            axis.tick([Some(0)], None);
            assert!(axis.begin.jet == [1.0, 0.0], "{:?}", axis.begin);
        }
    }

    #[test]
    fn a_plan_takes_over_at_its_tick_and_not_before() {
        let mut axis = axis::<16>();
        let mut shaft = Shaft { x: [0.0; 2], stuck: false, count: 0 };
        let mut peak = 0.0_f64;
        for tick in 0..600_u32 {
            match tick {
                100 => axis.play_at(130, to(1.0, axis.plan(), 130)),
                // In motion: from the point of the plan at that tick.
                170 => axis.play_at(180, to(-0.5, axis.plan(), 180)),
                _ => {}
            }
            let counts = shaft.count();
            let output = axis.tick(counts, None);
            assert!((output.health.is_ok() || tick < 9) && (tick >= 130 || output.u == 0.0), "tick {tick}: {output:?}");
            shaft.advance(output.u);
            peak = peak.max(shaft.x[0]);
        }
        assert!(peak > 0.2 && peak < 0.99 && (shaft.x[0] + 0.5).abs() < 1e-3, "{peak}, {:?}", shaft.x);
    }

    /// Checks that the trace buffer reproduces a trip: every tick and the final state agree bit for bit. Another design
    /// on these counts gives another output.
    #[test]
    fn a_trip_is_replayed_to_the_bit() {
        for stuck in [300, 511, 512, 513, 700] {
            let mut axis = axis::<256>();
            let mut shaft = Shaft { x: [0.0; 2], stuck: false, count: 0 };
            let (mut tripped, mut after, mut last) = (None, Vec::new(), 0.0);
            for tick in 0..1500_u32 {
                if tick % 150 == 20 {
                    axis.play_at(tick + 10, to(if tick % 300 == 20 { 1.0 } else { 0.0 }, axis.plan(), tick + 10));
                }
                shaft.stuck = tick >= stuck;
                let counts = shaft.count();
                let before: Vec<u32> = axis.running().words().collect();
                // Most of the output. Twice an equal value far below would count as the limit of the power stage.
                let output = axis.tick(counts, (tick % 7 == 0).then_some(0.97 * last));
                if axis.is_frozen() && tripped.is_none() {
                    tripped = Some(tick);
                    after = axis.running().words().collect();
                    assert_ne!(before, after);
                }
                last = output.u;
                shaft.advance(last);
            }
            let tripped = tripped.expect("an alarm");
            let [older, newer] = axis.black_box();
            assert_eq!(newer.first + newer.frames().len() as u32 - 1, tripped, "stuck at {stuck}");
            assert!(older.frames().len() + newer.frames().len() >= 256);

            let first = if older.frames().is_empty() { newer } else { older };
            let mut again = Running::from_state(law(60.0), first.state.clone());
            let (mut other, mut differs) = (Running::from_state(law(40.0), first.state.clone()), 0);
            for stretch in [older, newer] {
                for (output, frame) in replay(&mut again, stretch.begin, stretch.frames()) {
                    assert_eq!((output.u.to_bits(), output.health), (frame.u.to_bits(), frame.health));
                }
                let then = replay(&mut other, stretch.begin, stretch.frames());
                differs += then.filter(|(output, frame)| output.u.to_bits() != frame.u.to_bits()).count();
            }
            assert!(again.state.as_ref().expect("started").words().eq(after[2..after.len() - 1].iter().copied()));
            assert!(differs > 100, "{differs}");
        }
    }

    #[test]
    fn a_black_box_that_is_released_begins_anew_and_so_does_one_of_another_design() {
        let mut axis = axis::<8>();
        for _ in 0..20 {
            axis.tick([Some(0)], None);
        }
        assert_eq!(axis.black_box().map(|stretch| stretch.frames().len()), [8, 4]);
        axis.freeze();
        axis.tick([Some(0)], None);
        assert_eq!(axis.black_box().map(|stretch| stretch.frames().len()), [8, 4]);
        axis.release();
        axis.tick([Some(0)], None);
        assert_eq!(axis.black_box().map(|stretch| stretch.frames().len()), [0, 1]);
        axis.retune(law(50.0), [Some(0)]).expect("near enough");
        assert_eq!(axis.black_box().map(|stretch| stretch.frames().len()), [0, 0]);
        // Far outside the innovation gate for longer than samples may be missing.
        for tick in 0..60 {
            axis.tick([Some(4000 + 700 * (tick % 2))], None);
        }
        assert!(axis.is_frozen());
        let frozen = axis.black_box()[1].first;
        axis.tick([Some(0)], None);
        assert_eq!(axis.black_box()[1].first, frozen);
        axis.reset();
        let output = axis.tick([Some(0)], None);
        assert!(!axis.is_frozen() && !output.health.contains(Health::STOPPED), "{output:?}");
    }
}
