//! All drives of the firmware: motor and joint in all forms, with their monitors. A joint that is designed as a whole
//! has three states per observer. A joint with an observer per encoder has four.
//!
//! Control mode, gain sets, delay and states are types. A request selects them at run time, like the configurations of
//! the other ticks.

use controller_core::drive::{
    Bounds, CoupledDrive, DriveError, DriveLaw, Encoder, EncoderForm, Joined, JointDesign, JointDrive, Monitored,
    MotorDesign, MotorDrive, MotorModel, Position, Reference, Rest, Speed, Target, Watched, gap, shortest, stop,
};
use controller_core::{Health, Limits, Output, Running};

use crate::frame::{Counts, Driven, Instance, Model, RETUNE_ERRORS, Reason, Refusal};
use crate::{MAX_E, MAX_N};

/// Largest number of words of a drive design.
pub(crate) const MOST_DRIVE_WORDS: usize = 2 * (JointDesign::COUPLED_NUMBERS + Bounds::<2>::NUMBERS + 1);
/// Largest feed-forward of a plan, as a share of the limits.
const SHARE: f64 = 0.9;
/// Largest speed of a plan, as a share of the largest speed that an encoder can follow.
const COUNTED: f64 = 0.8;
/// Longest move, s.
const LONGEST_S: f64 = 100.0;

/// Narrows a target of the protocol to the order of a drive.
fn narrowed<const N: usize>(target: &Target<f32, i32, MAX_N>) -> Target<f32, i32, N> {
    Target { turn: target.turn, jet: core::array::from_fn(|j| target.jet[j]) }
}

/// Running drive with its monitors, and the reference at the beginning of its next tick.
pub(crate) struct Driving<L: Watched<E>, const E: usize, const N: usize> {
    running: Running<Monitored<L, E>>,
    begin: Target<f32, i32, N>,
}

/// Interface of all drives.
pub(crate) trait Drive {
    fn begin(&mut self, target: Target<f32, i32, MAX_N>);
    fn tick(&mut self, counts: &Counts) -> Driven;
}

impl<L: Watched<E> + DriveLaw<E, N> + Clone, const E: usize, const N: usize> Driving<L, E, N> {
    fn new(law: Monitored<L, E>) -> Self {
        Self { running: Running::new(law), begin: Target { turn: 0, jet: [0.0; N] } }
    }

    /// NaN means that the held value was not reported. The controller ignores NaN.
    fn told(&mut self, counts: &Counts) -> L::Sample {
        self.running.report_applied(counts.applied);
        let end = narrowed(&counts.end);
        let begin = core::mem::replace(&mut self.begin, end);
        L::sample(core::array::from_fn(|i| counts.counts[i]), &begin, &end)
    }

    fn ticked(&mut self, sample: &L::Sample) -> Driven {
        self.running.start_at_once(sample);
        let Output { u, sigma, sigma_star, health } = self.running.tick(sample);
        let (mut turn, mut estimates) = (0, [[0.0; 4]; MAX_E]);
        if let Some(known) = self.running.estimates() {
            turn = known.turn;
            for i in 0..E {
                estimates[i] = [known.position[i], known.speed[i], known.disturbance[i], known.load[i]];
            }
        }
        Driven { u, sigma, sigma_star, health, turn, estimates }
    }

    /// If the design cannot take over, nothing changes and no tick runs.
    fn retune(&mut self, law: Monitored<L, E>, counts: &Counts) -> Result<Driven, Refusal> {
        let before = (self.running.clone(), self.begin);
        let sample = self.told(counts);
        match self.running.retune(law, &sample) {
            Ok(()) => Ok(self.ticked(&sample)),
            Err(error) => {
                (self.running, self.begin) = before;
                let why = RETUNE_ERRORS.iter().position(|&known| known == error).unwrap_or(RETUNE_ERRORS.len());
                Err(Refusal { reason: Reason::Retune, target: why as u32, request: 0 })
            }
        }
    }
}

impl<L: Watched<E> + DriveLaw<E, N> + Clone, const E: usize, const N: usize> Drive for Driving<L, E, N> {
    fn begin(&mut self, target: Target<f32, i32, MAX_N>) {
        self.begin = narrowed(&target);
    }

    fn tick(&mut self, counts: &Counts) -> Driven {
        let sample = self.told(counts);
        self.ticked(&sample)
    }
}

/// Reads the numbers of a design, its bounds, and the alarms that stop it. The number of words must match.
fn read<const L: usize, const E: usize>(words: &[u32]) -> Result<([f64; L], Bounds<E>, f64), Refusal> {
    let count = 2 * (L + Bounds::<E>::NUMBERS + 1);
    if words.len() != count {
        return Err(Refusal { reason: Reason::Count, target: count as u32, request: words.len() as u32 });
    }
    let mut numbers = words.chunks_exact(2).map(|pair| f64::from_bits(u64::from(pair[0]) | u64::from(pair[1]) << 32));
    // The length was checked above.
    let mut next = || numbers.next().unwrap_or(f64::NAN);
    let design = core::array::from_fn(|_| next());
    let bounds = Bounds::from_numbers(core::iter::from_fn(|| Some(next())));
    // A bound of 0 or NaN rejects every value, so nothing would run.
    if !bounds.to_numbers().into_iter().all(|bound| bound > 0.0) {
        return Err(Refusal::of(Reason::Coefficients));
    }
    Ok((design, bounds, next()))
}

/// Builds design and controller from words, with the layout and design function of this drive.
fn made<D, L: Watched<E>, const NUMBERS: usize, const E: usize>(
    words: &[u32],
    described: impl Fn(&[f64; NUMBERS]) -> D,
    designed: impl Fn(&D) -> Result<L, DriveError>,
) -> Result<(D, Monitored<L, E>), Refusal> {
    let (numbers, bounds, stops_at) = read(words)?;
    let design = described(&numbers);
    let law = designed(&design).map_err(|_| Refusal::of(Reason::Coefficients))?;
    let alarms = Health::from_bits(stops_at as u16);
    if f64::from(alarms.bits()) != stops_at || alarms.contains(Health::HUNTS) {
        return Err(Refusal::of(Reason::Coefficients));
    }
    Ok((design, Monitored::new(law, &bounds).stopping_at(alarms)))
}

/// Drive whose design and plans can change while it runs: a motor or a joint in position control.
pub trait Tuned<const E: usize, const N: usize>: DriveLaw<E, N> + Watched<E> + Copy {
    /// Instance in the protocol.
    const INSTANCE: Instance;
    /// Design parameters.
    type Design: Copy;
    /// Plan from any trajectory point to rest.
    type Plan: Reference<f32, N> + Clone;

    /// Builds design and controller from the words of a loaded design. This takes some ten thousand 64-bit operations.
    ///
    /// # Errors
    /// Fails if the number of words is wrong or they are not a valid design.
    fn read(words: &[u32]) -> Result<(Self::Design, Monitored<Self, E>), Refusal> {
        Self::read_as(words, false)
    }

    /// Builds design and controller from words. With `at_rest` the controller leaves no offset W when it takes over.
    ///
    /// # Errors
    /// Fails like [`read`](Self::read).
    fn read_as(words: &[u32], at_rest: bool) -> Result<(Self::Design, Monitored<Self, E>), Refusal>;

    /// Returns the limits of the current, A.
    fn limits(design: &Self::Design) -> Limits;

    /// Returns the encoder of each shaft.
    fn encoders(design: &Self::Design) -> [Encoder; E];

    /// Returns a plan at rest.
    fn rest(goal: Rest<f32>) -> Self::Plan;

    /// Plans from `present` at this tick to rest at a goal, or at the nearest reachable position. It takes the fewest
    /// ticks of this range within the limits, and returns the plan with its number of ticks. Each candidate duration is
    /// checked at 64 ticks, so this is background work.
    ///
    /// # Errors
    /// Fails if the goal is invalid or the move is too fast.
    fn plan(
        design: &Self::Design,
        present: &Self::Plan,
        goal: Option<Rest<f32>>,
        start: u32,
        range: [u32; 2],
    ) -> Result<(Self::Plan, u32), Refusal>;

    /// Returns the number of ticks until a plan rests.
    fn left(plan: &Self::Plan, tick: u32) -> u32;
}

impl<const S: usize, const FAST: usize, const LATE: usize> Tuned<1, 2>
    for EncoderForm<f32, MotorModel<f32>, Position, 1, 2, S, FAST, LATE>
{
    const INSTANCE: Instance = Instance { n: 2, r: S as u8, mask: form(FAST, LATE), model: Model::Motor };
    type Design = MotorDesign;
    type Plan = Joined<f32, Rest<f32>, 3>;

    fn read_as(words: &[u32], at_rest: bool) -> Result<(MotorDesign, Monitored<Self, 1>), Refusal> {
        made(words, MotorDesign::from_numbers, |design| {
            Self::try_design(design).map(|law| if at_rest { law.at_rest() } else { law })
        })
    }

    fn limits(design: &MotorDesign) -> Limits {
        design.limits
    }

    fn encoders(design: &MotorDesign) -> [Encoder; 1] {
        [design.encoder]
    }

    fn rest(goal: Rest<f32>) -> Self::Plan {
        Joined::met(goal)
    }

    fn plan(
        design: &MotorDesign,
        present: &Self::Plan,
        goal: Option<Rest<f32>>,
        start: u32,
        range: [u32; 2],
    ) -> Result<(Self::Plan, u32), Refusal> {
        let asked = |jet: &[f64; 3]| design.motor.feed_forward(jet);
        let reach = Reach::of(design.period_s, design.limits, &[design.encoder]);
        reach.plan(&present.at(start), goal, start, range, asked)
    }

    fn left(plan: &Self::Plan, tick: u32) -> u32 {
        plan.left(tick)
    }
}

/// Implements a drive of a joint, by the states of its observers and the parser of its design.
macro_rules! tuned_joint {
    ($drive:ident, $states:literal, $described:ident) => {
        impl<const FAST: usize, const LATE: usize> Tuned<2, 4> for $drive<f32, Position, FAST, LATE> {
            const INSTANCE: Instance = Instance { n: 4, r: $states, mask: form(FAST, LATE), model: Model::Joint };
            type Design = JointDesign;
            type Plan = Joined<f32, Rest<f32>, 4>;

            fn read_as(words: &[u32], at_rest: bool) -> Result<(JointDesign, Monitored<Self, 2>), Refusal> {
                made(words, JointDesign::$described, |design| {
                    Self::try_design(design).map(|law| if at_rest { law.at_rest() } else { law })
                })
            }

            fn limits(design: &JointDesign) -> Limits {
                design.limits
            }

            fn encoders(design: &JointDesign) -> [Encoder; 2] {
                design.encoders
            }

            fn rest(goal: Rest<f32>) -> Self::Plan {
                Joined::met(goal)
            }

            fn plan(
                design: &JointDesign,
                present: &Self::Plan,
                goal: Option<Rest<f32>>,
                start: u32,
                range: [u32; 2],
            ) -> Result<(Self::Plan, u32), Refusal> {
                let asked = |jet: &[f64; 5]| design.joint.feed_forward(jet);
                let reach = Reach::of(design.period_s, design.limits, &design.encoders);
                reach.plan(&present.at(start), goal, start, range, asked)
            }

            fn left(plan: &Self::Plan, tick: u32) -> u32 {
                plan.left(tick)
            }
        }
    };
}

tuned_joint!(JointDrive, 4, from_numbers);
tuned_joint!(CoupledDrive, 3, from_coupled_numbers);

/// A record in motion keeps two currents, and the form has one bit for the delay.
const fn form(fast: usize, late: usize) -> u8 {
    assert!(late <= 1, "a drive on the wire has a delay of 0 or 1 tick");
    Instance::TWO_SETS * fast as u8 + Instance::LATE * late as u8
}

/// Limits of a plan: the current, and the speed that a counter can resolve. The supply voltage is not in the words of a
/// design. So a plan may need more speed than the voltage allows.
struct Reach {
    period_s: f64,
    limits: Limits,
    fastest_rad_s: f64,
}

impl Reach {
    /// At the largest speed the counts change per tick by a share of half the counter. Beyond half of it the direction
    /// is ambiguous.
    fn of(period_s: f64, limits: Limits, encoders: &[Encoder]) -> Self {
        let half = |encoder: &Encoder| 0.5 * encoder.unit_rad() * encoder.counter() as f64;
        let fastest_rad_s = COUNTED * encoders.iter().map(half).fold(f64::INFINITY, f64::min) / period_s;
        Self { period_s, limits, fastest_rad_s }
    }

    /// Plans from a trajectory point to rest.
    fn plan<const M: usize, const J: usize>(
        &self,
        present: &Target<f32, i32, M>,
        goal: Option<Rest<f32>>,
        start: u32,
        [fewest, most]: [u32; 2],
        feed_forward: impl Fn(&[f64; J]) -> f64,
    ) -> Result<(Joined<f32, Rest<f32>, M>, u32), Refusal> {
        let Self { period_s, limits, fastest_rad_s } = *self;
        let wide = Target { turn: present.turn, jet: present.jet.map(f64::from) };
        let towards = |ticks: u32| {
            let (goal, ticks) = goal.map_or_else(|| stop(present, ticks, period_s), |goal| (goal, ticks));
            (goal, Rest { turn: goal.turn, angle: f64::from(goal.angle) }, ticks)
        };
        let to_go = |goal: &Rest<f64>| gap(&wide, &goal.at(start));
        let u_max = SHARE * if limits.max < -limits.min { limits.max } else { -limits.min };
        let longest = (LONGEST_S / period_s) as u32;
        // The speed is limited by the same measure.
        let asked = |jet: &[f64; J]| feed_forward(jet).abs().max(u_max * (jet[1] / fastest_rad_s).abs());
        let found = shortest(start, fewest.max(1), longest.max(1), u_max, asked, |ticks| {
            let (_, goal, ticks) = towards(ticks);
            Joined::<f64, _, M>::new(goal, to_go(&goal), start, ticks, period_s)
        });
        match found {
            Some(found) if found <= most => {
                let (goal, wide, taken) = towards(found);
                Ok((Joined::new(goal, to_go(&wide), start, taken, period_s), taken))
            }
            other => Err(Refusal { reason: Reason::TooFast, target: other.unwrap_or(0), request: most }),
        }
    }
}

/// Defines an enum of all drives.
macro_rules! drives {
    ($($name:ident:
        $model:ident $design:ident $described:ident
        $drive:ident<$aim:ty, $fast:literal, $late:literal $(, $states:literal)?>,
        $e:literal encoders, $r:literal states, form $form:literal;)*) => {
        pub(crate) enum Drives {
            $($name(Driving<$drive<f32, $aim, $fast, $late $(, $states)?>, $e, { 2 * $e }>),)*
        }

        impl Drives {
            /// Returns the drive that is designed from these words, ready for its first counts.
            pub(crate) fn load(instance: Instance, words: &[u32]) -> Result<Self, Refusal> {
                match (instance.model, instance.r, instance.mask) {
                    $((Model::$model, $r, $form) => {
                        let law = drives!(law $design $described $drive<$aim, $fast, $late $(, $states)?>; words);
                        Ok(Self::$name(Driving::new(law)))
                    })*
                    _ => Err(none(instance)),
                }
            }

            /// Switches to the drive that is designed from these words. It must have the same form.
            pub(crate) fn retune(
                &mut self,
                instance: Instance,
                words: &[u32],
                counts: &Counts,
            ) -> Result<Driven, Refusal> {
                match (self, instance.model, instance.r, instance.mask) {
                    $((Self::$name(driving), Model::$model, $r, $form) => {
                        let law = drives!(law $design $described $drive<$aim, $fast, $late $(, $states)?>; words);
                        driving.retune(law, counts)
                    })*
                    _ => Err(none(instance)),
                }
            }

            pub(crate) fn get(&mut self) -> &mut dyn Drive {
                match self {
                    $(Self::$name(driving) => driving,)*
                }
            }
        }
    };
    (law $design:ident $described:ident $drive:ident<$($of:tt),*>; $words:ident) => {
        made($words, $design::$described, $drive::<f32, $($of),*>::try_design)?.1
    };
}

const fn none(instance: Instance) -> Refusal {
    Refusal { reason: Reason::Instance, target: 0, request: instance.word() }
}

// The form has the bits 1 for two gain sets, 2 for a tick of delay, and 4 for speed control.
drives! {
    MotorOne: Motor MotorDesign from_numbers MotorDrive<Position, 0, 0, 3>, 1 encoders, 3 states, form 0;
    MotorTwo: Motor MotorDesign from_numbers MotorDrive<Position, 1, 0, 3>, 1 encoders, 3 states, form 1;
    MotorOneLate: Motor MotorDesign from_numbers MotorDrive<Position, 0, 1, 3>, 1 encoders, 3 states, form 2;
    MotorTwoLate: Motor MotorDesign from_numbers MotorDrive<Position, 1, 1, 3>, 1 encoders, 3 states, form 3;
    MotorOneFour: Motor MotorDesign from_numbers MotorDrive<Position, 0, 0, 4>, 1 encoders, 4 states, form 0;
    MotorTwoFour: Motor MotorDesign from_numbers MotorDrive<Position, 1, 0, 4>, 1 encoders, 4 states, form 1;
    MotorOneLateFour: Motor MotorDesign from_numbers MotorDrive<Position, 0, 1, 4>, 1 encoders, 4 states, form 2;
    MotorTwoLateFour: Motor MotorDesign from_numbers MotorDrive<Position, 1, 1, 4>, 1 encoders, 4 states, form 3;
    SpeedOne: Motor MotorDesign from_numbers MotorDrive<Speed, 0, 0, 3>, 1 encoders, 3 states, form 4;
    SpeedTwo: Motor MotorDesign from_numbers MotorDrive<Speed, 1, 0, 3>, 1 encoders, 3 states, form 5;
    SpeedOneLate: Motor MotorDesign from_numbers MotorDrive<Speed, 0, 1, 3>, 1 encoders, 3 states, form 6;
    SpeedTwoLate: Motor MotorDesign from_numbers MotorDrive<Speed, 1, 1, 3>, 1 encoders, 3 states, form 7;
    SpeedOneFour: Motor MotorDesign from_numbers MotorDrive<Speed, 0, 0, 4>, 1 encoders, 4 states, form 4;
    SpeedTwoFour: Motor MotorDesign from_numbers MotorDrive<Speed, 1, 0, 4>, 1 encoders, 4 states, form 5;
    SpeedOneLateFour: Motor MotorDesign from_numbers MotorDrive<Speed, 0, 1, 4>, 1 encoders, 4 states, form 6;
    SpeedTwoLateFour: Motor MotorDesign from_numbers MotorDrive<Speed, 1, 1, 4>, 1 encoders, 4 states, form 7;
    JointOne: Joint JointDesign from_numbers JointDrive<Position, 0, 0>, 2 encoders, 4 states, form 0;
    JointTwo: Joint JointDesign from_numbers JointDrive<Position, 1, 0>, 2 encoders, 4 states, form 1;
    JointOneLate: Joint JointDesign from_numbers JointDrive<Position, 0, 1>, 2 encoders, 4 states, form 2;
    JointTwoLate: Joint JointDesign from_numbers JointDrive<Position, 1, 1>, 2 encoders, 4 states, form 3;
    WholeOne: Joint JointDesign from_coupled_numbers CoupledDrive<Position, 0, 0>, 2 encoders, 3 states, form 0;
    WholeTwo: Joint JointDesign from_coupled_numbers CoupledDrive<Position, 1, 0>, 2 encoders, 3 states, form 1;
    WholeOneLate: Joint JointDesign from_coupled_numbers CoupledDrive<Position, 0, 1>, 2 encoders, 3 states, form 2;
    WholeTwoLate: Joint JointDesign from_coupled_numbers CoupledDrive<Position, 1, 1>, 2 encoders, 3 states, form 3;
}
