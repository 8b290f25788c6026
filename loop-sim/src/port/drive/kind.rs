//! Differences between the two kinds of drives, motor and joint.
//!
//! [`DriveDesign`] is a drive of either kind before it runs, so callers need no match. [`DriveKind`] has an
//! implementation per kind. It selects the types of the controller (control mode, gain sets, delay, states) from
//! a [`Form`].

use std::any::Any;
use std::f64::consts::TAU;

use controller_core::drive::{
    Aim, Bounds, ChainModel, CoupledDrive, DriveError, DriveLaw, Encoder, EncoderForm, Fence, JointBandwidths,
    JointDesign, JointDrive, Monitored, MotorBandwidths, MotorDesign, MotorDrive, RestBand, RestLearning, Resting,
    Sample, Slowing, Switching, Target, WatchTicks, Watched,
};
use controller_core::{Limits, Running, drives};

use super::in_f64::boxed;
use super::{Around, Drive, Follows, Form, Law, LivePort, Monitors, Motion, Reaction, Typed, Whole, typed};
use crate::linear::{LawAtRest, Still};
use crate::port::ControllerPort;
use crate::sensor::encoder::Mounted;

/// Thresholds of the monitors in every tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Thresholds {
    /// Threshold of |d| for each shaft, in the unit of its block.
    pub disturbance: Vec<f32>,
    /// Threshold of |σ*|.
    pub sigma_star: f32,
    /// Limits of the tick counters.
    pub ticks: WatchTicks<f32>,
    /// Braking gain: u per speed of the driven shaft, in the unit of its block.
    pub brake: f32,
    /// Limits of u, A.
    pub limits: [f32; 2],
    /// Acceleration of the driven shaft per unit of u, in the unit of its block.
    pub gain: f32,
    /// Inverse of `gain`, as stored in the controller.
    pub per_gain: f32,
}

/// Operation on a controller whose type is selected by a [`Form`].
trait Use<const E: usize, const N: usize> {
    type Out;
    /// True if the switch to the controller leaves no offset.
    const AT_REST: bool = false;

    fn of<L>(self, law: L, bounds: &Bounds<E>) -> Self::Out
    where
        L: Watched<E> + DriveLaw<E, N> + Send + 'static,
        L::State: Send;
}

/// Operation: run the controller in this process.
struct Run(Reaction, Around);

impl<const E: usize, const N: usize> Use<E, N> for Run {
    type Out = Box<dyn Law<E, N>>;

    fn of<L>(self, law: L, bounds: &Bounds<E>) -> Self::Out
    where
        L: Watched<E> + DriveLaw<E, N> + Send + 'static,
        L::State: Send,
    {
        let Self(reaction, around) = self;
        let running = Running::new(Monitored::new(law, bounds).stopping_at(reaction.stops_at()));
        Box::new(Whole { running, around, resting: Resting::START })
    }
}

/// Operation: take over from another controller.
struct Succeed<const AT_REST: bool>(Reaction, Around);

impl<const E: usize, const N: usize, const AT_REST: bool> Use<E, N> for Succeed<AT_REST> {
    type Out = Box<dyn Any + Send>;
    const AT_REST: bool = AT_REST;

    fn of<L>(self, law: L, bounds: &Bounds<E>) -> Self::Out
    where
        L: Watched<E> + DriveLaw<E, N> + Send + 'static,
        L::State: Send,
    {
        Box::new((Monitored::new(law, bounds).stopping_at(self.0.stops_at()), self.1))
    }
}

/// Operation: return the limits of the monitors, and the thresholds of a tick in f32.
struct Watch;

impl<const E: usize, const N: usize> Use<E, N> for Watch {
    type Out = (Bounds<E>, Thresholds);

    fn of<L: Watched<E> + DriveLaw<E, N>>(self, law: L, bounds: &Bounds<E>) -> Self::Out {
        let (gain, per_gain, limits) = (law.gain(), law.per_gain(), law.nominal_limits());
        let (disturbance, [sigma_star, brake], ticks) = Monitored::new(law, bounds).thresholds();
        (*bounds, Thresholds { disturbance: disturbance.into(), sigma_star, ticks, brake, limits, gain, per_gain })
    }
}

/// Bandwidths of a drive of either kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Bandwidths {
    /// Surface bandwidth w_c, rad/s.
    pub surface_rad_s: f64,
    /// Bandwidth of the observer on each encoder, rad/s.
    pub observers_rad_s: Vec<f64>,
    /// Reaching gain k_l, 1/s.
    pub reaching_per_s: f64,
    /// Rate α of the offset W, 1/s.
    pub offset_per_s: f64,
}

impl Bandwidths {
    /// Returns the bandwidths with α by rule: half of the slowest of surface and observers.
    #[must_use]
    pub fn with_offset(self) -> Self {
        let slowest = self.observers_rad_s.iter().copied().fold(self.surface_rad_s, f64::min);
        Self { offset_per_s: 0.5 * slowest, ..self }
    }
}

/// Names of a kind of drive, the state of each encoder, and the keys of [`DriveKind::KEYS`].
type KindNames = ([&'static str; 2], &'static [usize], (&'static [&'static str], &'static str));

/// Kind of drive with `E` encoders, `N` states and plans that are continuous in `P` derivatives, r included.
trait DriveKind<const E: usize, const N: usize, const P: usize>: Copy {
    /// Name of its table in a scenario, and its title.
    const NAMES: [&'static str; 2];
    /// Index of the state that each encoder measures, from 0.
    const SEEN: [usize; E];
    /// Keys of the observer bandwidths, and the key of the factor for the observers with high gains.
    const KEYS: (&'static [&'static str], &'static str);

    fn period_s(&mut self) -> &mut f64;
    fn limits(&self) -> Limits;
    /// Torque constant K_t, N m per A.
    fn torque_n_m_per_a(&self) -> f64;
    fn gate_steps(&self) -> [f64; E];
    fn bandwidths(&self) -> Bandwidths;
    fn set_bandwidths(&mut self, to: &Bandwidths);
    /// Returns the design with these bandwidths and everything that follows from them by rule.
    fn redesigned(self, to: &Bandwidths, load_n_m: f64) -> Self;
    fn fast_ratios(&mut self) -> &mut [f64];
    /// Returns the design with encoders of `times` as many counts. Its thresholds keep their angles.
    fn finer(self, encoders: [Encoder; E], times: f64) -> Self;
    fn numbers(&self) -> Vec<f64>;
    /// Returns the braking of the drive with this delay in ticks.
    fn slowing(&self, delay_ticks: usize) -> Slowing;
    /// Returns the rest band, if this kind of drive has one.
    fn rest_band(&self, learning: RestLearning) -> Option<RestBand>;

    /// Passes its controller with monitors to `user`. More than two gain sets count as two. More than three ticks of
    /// delay are refused.
    fn law<U: Use<E, N>>(&self, form: Form, monitors: &Monitors<E>, user: U) -> Result<U::Out, DriveError>;
    fn at_rest(&self, form: Form) -> Result<DriveAtRest, DriveError>;
    fn in_f64(&self, of: (Form, [Mounted; E]), motion: &Motion) -> Result<Box<dyn ControllerPort>, DriveError>;
}

/// Expands to the type of a drive.
macro_rules! form {
    ($drive:ident, $scalar:ty, $aim:ty, $fast:literal, $late:literal $(, $states:literal)?) => {
        $drive<$scalar, Typed<$aim>, $fast, { typed($late) } $(, $states)?>
    };
}

/// Passes a controller and the bounds of its monitors to `$user`.
macro_rules! used {
    ($drive:ident, $design:ident, $monitors:ident, $user:ident, [$($load:expr)?], $($of:tt)*) => {{
        let law = <form!($drive, f32, $($of)*)>::try_design($design)?;
        let law = if U::AT_REST { law.at_rest() } else { law };
        let bounds = $monitors.bounds(&$design.bounds(&law, $($load,)? $monitors.uncertain));
        Ok($user.of(law, &bounds))
    }};
}

impl DriveKind<1, 2, 3> for MotorDesign {
    const NAMES: [&'static str; 2] = ["motor", "a motor with one encoder"];
    const SEEN: [usize; 1] = [0];
    const KEYS: (&'static [&'static str], &'static str) = (&["observer_rad_s"], "fast_ratio");

    fn period_s(&mut self) -> &mut f64 {
        &mut self.period_s
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn torque_n_m_per_a(&self) -> f64 {
        self.motor.torque_n_m_per_a
    }

    fn gate_steps(&self) -> [f64; 1] {
        [self.gate_steps]
    }

    fn bandwidths(&self) -> Bandwidths {
        let MotorBandwidths { surface_rad_s, observer_rad_s, reaching_per_s, offset_per_s } = self.bandwidths;
        Bandwidths { surface_rad_s, observers_rad_s: vec![observer_rad_s], reaching_per_s, offset_per_s }
    }

    fn set_bandwidths(&mut self, to: &Bandwidths) {
        let Bandwidths { surface_rad_s, ref observers_rad_s, reaching_per_s, offset_per_s } = *to;
        let observer_rad_s = observers_rad_s[0];
        self.bandwidths = MotorBandwidths { surface_rad_s, observer_rad_s, reaching_per_s, offset_per_s };
    }

    fn redesigned(mut self, to: &Bandwidths, _: f64) -> Self {
        self.set_bandwidths(to);
        self.with_bandwidths(self.bandwidths)
    }

    fn fast_ratios(&mut self) -> &mut [f64] {
        std::slice::from_mut(&mut self.fast_ratio)
    }

    fn finer(self, [encoder]: [Encoder; 1], times: f64) -> Self {
        let (switching, gate_steps) = (finer_switching(self.switching, times), self.gate_steps * times);
        Self { encoder, switching, gate_steps, ..self }
    }

    fn numbers(&self) -> Vec<f64> {
        self.to_numbers().into()
    }

    fn slowing(&self, delay_ticks: usize) -> Slowing {
        Self::slowing(self, delay_ticks)
    }

    fn rest_band(&self, learning: RestLearning) -> Option<RestBand> {
        Some(Self::rest_band(self, learning))
    }

    fn law<U: Use<1, 2>>(&self, form: Form, monitors: &Monitors<1>, user: U) -> Result<U::Out, DriveError> {
        self.validate(form.delay_ticks, form.observer_states)?;
        drives!(motor form.types() => used!(MotorDrive, self, monitors, user, [],))
    }

    fn at_rest(&self, form: Form) -> Result<DriveAtRest, DriveError> {
        self.validate(form.delay_ticks, form.observer_states)?;
        let design = Self { encoder: finest(self.encoder), gate_steps: f64::INFINITY, ..*self };
        macro_rules! law {
            ($($of:tt)*) => { Ok(at_rest(<form!(MotorDrive, f64, $($of)*)>::try_design(&design)?, [self.encoder])) };
        }
        drives!(quiet motor form.types() => law!())
    }

    fn in_f64(&self, of: (Form, [Mounted; 1]), motion: &Motion) -> Result<Box<dyn ControllerPort>, DriveError> {
        let (form, mounted) = of;
        self.validate(form.delay_ticks, form.observer_states)?;
        macro_rules! law {
            ($($of:tt)*) => {
                Ok(boxed::<_, _, 1, 2, _, _, 3>(<form!(MotorDrive, f64, $($of)*)>::try_design(self)?, mounted, motion))
            };
        }
        drives!(quiet motor form.types() => law!())
    }
}

/// The drive controls the position of its link, with four states per encoder.
impl DriveKind<2, 4, 4> for JointDesign {
    const NAMES: [&'static str; 2] = ["joint", "a flexible joint with two encoders"];
    const SEEN: [usize; 2] = [0, 2];
    const KEYS: (&'static [&'static str], &'static str) = (&["link_rad_s", "motor_rad_s"], "fast_ratios");

    fn period_s(&mut self) -> &mut f64 {
        &mut self.period_s
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn torque_n_m_per_a(&self) -> f64 {
        self.joint.torque_n_m_per_a
    }

    fn gate_steps(&self) -> [f64; 2] {
        self.gate_steps
    }

    fn bandwidths(&self) -> Bandwidths {
        let JointBandwidths { surface_rad_s, link_rad_s, motor_rad_s, reaching_per_s, offset_per_s } = self.bandwidths;
        Bandwidths { surface_rad_s, observers_rad_s: vec![link_rad_s, motor_rad_s], reaching_per_s, offset_per_s }
    }

    fn set_bandwidths(&mut self, to: &Bandwidths) {
        let Bandwidths { surface_rad_s, ref observers_rad_s, reaching_per_s, offset_per_s } = *to;
        let (link_rad_s, motor_rad_s) = (observers_rad_s[0], observers_rad_s[1]);
        self.bandwidths = JointBandwidths { surface_rad_s, link_rad_s, motor_rad_s, reaching_per_s, offset_per_s };
    }

    fn redesigned(mut self, to: &Bandwidths, load_n_m: f64) -> Self {
        self.set_bandwidths(to);
        self.with_bandwidths(self.bandwidths, load_n_m)
    }

    fn fast_ratios(&mut self) -> &mut [f64] {
        &mut self.fast_ratios
    }

    fn finer(self, encoders: [Encoder; 2], times: f64) -> Self {
        let (switching, gates) = (finer_switching(self.switching, times), self.gate_steps.map(|steps| steps * times));
        Self { encoders, switching, gate_steps: gates, ..self }
    }

    fn numbers(&self) -> Vec<f64> {
        self.to_coupled_numbers().map_or_else(|| self.to_numbers().into(), Into::into)
    }

    fn slowing(&self, delay_ticks: usize) -> Slowing {
        Self::slowing(self, delay_ticks)
    }

    fn rest_band(&self, _: RestLearning) -> Option<RestBand> {
        None
    }

    fn law<U: Use<2, 4>>(&self, form: Form, monitors: &Monitors<2>, user: U) -> Result<U::Out, DriveError> {
        self.validate(form.delay_ticks)?;
        if self.coupled.is_some() {
            let load = monitors.sudden_load_n_m;
            return drives!(joint form.types() => used!(CoupledDrive, self, monitors, user, [load],));
        }
        drives!(joint form.types() => used!(JointDrive, self, monitors, user, [monitors.sudden_load_n_m],))
    }

    fn at_rest(&self, form: Form) -> Result<DriveAtRest, DriveError> {
        self.validate(form.delay_ticks)?;
        let encoders = self.encoders.map(finest);
        let design = Self { encoders, gate_steps: [f64::INFINITY; 2], ..*self };
        macro_rules! coupled {
            ($($of:tt)*) => { Ok(at_rest(<form!(CoupledDrive, f64, $($of)*)>::try_design(&design)?, self.encoders)) };
        }
        if self.coupled.is_some() {
            return drives!(quiet joint form.types() => coupled!());
        }
        macro_rules! law {
            ($($of:tt)*) => { Ok(at_rest(<form!(JointDrive, f64, $($of)*)>::try_design(&design)?, self.encoders)) };
        }
        drives!(quiet joint form.types() => law!())
    }

    fn in_f64(&self, of: (Form, [Mounted; 2]), motion: &Motion) -> Result<Box<dyn ControllerPort>, DriveError> {
        let (form, mounted) = of;
        self.validate(form.delay_ticks)?;
        macro_rules! coupled {
            ($($of:tt)*) => {{
                let law = <form!(CoupledDrive, f64, $($of)*)>::try_design(self)?;
                Ok(boxed::<_, _, 2, 4, _, _, 4>(law, mounted, motion))
            }};
        }
        if self.coupled.is_some() {
            return drives!(quiet joint form.types() => coupled!());
        }
        macro_rules! law {
            ($($of:tt)*) => {
                Ok(boxed::<_, _, 2, 4, _, _, 4>(<form!(JointDrive, f64, $($of)*)>::try_design(self)?, mounted, motion))
            };
        }
        drives!(quiet joint form.types() => law!())
    }
}

fn finer_switching(Switching { calm_steps, alert_steps, smoothing_s, keep_s }: Switching, times: f64) -> Switching {
    Switching { calm_steps: calm_steps * times, alert_steps: alert_steps * times, smoothing_s, keep_s }
}

/// Drive of one kind before it runs: parameters, types and encoders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveOf<D, const E: usize> {
    /// Design parameters.
    pub design: D,
    /// Type parameters.
    pub form: Form,
    /// Encoder of the motor, or the encoders of link and motor of a joint.
    pub mounted: [Mounted; E],
    /// Monitors.
    pub monitors: Monitors<E>,
}

impl<D, const E: usize> DriveOf<D, E> {
    fn live<const N: usize, const P: usize>(&self, motion: &Motion) -> Result<Box<dyn LivePort>, DriveError>
    where
        D: DriveKind<E, N, P>,
    {
        let reaction = self.monitors.reaction;
        let around = self.around();
        let law = self.own_law()?;
        Ok(Box::new(Drive::<E, N, P>::new(law, (self.mounted, around), self.form, reaction, motion)))
    }

    fn own_law<const N: usize, const P: usize>(&self) -> Result<Box<dyn Law<E, N>>, DriveError>
    where
        D: DriveKind<E, N, P>,
    {
        self.design.law(self.form, &self.monitors, Run(self.monitors.reaction, self.around()))
    }

    fn fence<const N: usize, const P: usize>(&self) -> Option<Fence>
    where
        D: DriveKind<E, N, P>,
    {
        self.monitors.fence.map(|limits| Fence::new(&limits, self.design.slowing(self.form.delay_ticks)))
    }

    fn around<const N: usize, const P: usize>(&self) -> Around
    where
        D: DriveKind<E, N, P>,
    {
        Around { fence: self.fence(), rest_band: self.rest_band() }
    }

    fn rest_band<const N: usize, const P: usize>(&self) -> Option<RestBand>
    where
        D: DriveKind<E, N, P>,
    {
        let learning = self.monitors.rest_band.filter(|_| self.form.follows == Follows::Position);
        learning.and_then(|learning| self.design.rest_band(learning))
    }

    fn successor<const N: usize, const P: usize>(&self, at_rest: bool) -> Result<Box<dyn Any + Send>, DriveError>
    where
        D: DriveKind<E, N, P>,
    {
        let Self { design, form, monitors, .. } = self;
        if at_rest {
            design.law(*form, monitors, Succeed::<true>(monitors.reaction, self.around()))
        } else {
            design.law(*form, monitors, Succeed::<false>(monitors.reaction, self.around()))
        }
    }

    fn port_to<'a, const N: usize, const P: usize>(
        &self,
        law: impl Law<E, N> + 'a,
        motion: &Motion,
    ) -> Box<dyn ControllerPort + 'a>
    where
        D: DriveKind<E, N, P>,
    {
        let of = (self.mounted, self.around());
        Box::new(Drive::<E, N, P>::new(Box::new(law), of, self.form, self.monitors.reaction, motion))
    }

    fn watched<const N: usize, const P: usize>(&self) -> Result<(Vec<f64>, Thresholds), DriveError>
    where
        D: DriveKind<E, N, P>,
    {
        let (bounds, thresholds) = self.design.law(self.form, &self.monitors, Watch)?;
        Ok((bounds.to_numbers().collect(), thresholds))
    }

    fn finer<const N: usize, const P: usize>(self, encoder: impl Fn(Encoder) -> Encoder, times: f64) -> Self
    where
        D: DriveKind<E, N, P>,
    {
        let mounted = self.mounted.map(|mounted| Mounted::new(encoder(mounted.encoder)));
        let design = self.design.finer(mounted.map(|mounted| mounted.encoder), times);
        Self { design, mounted, ..self }
    }
}

/// Returns the names and keys of this kind of drive.
const fn words<D, const E: usize, const N: usize, const P: usize>(_: &DriveOf<D, E>) -> KindNames
where
    D: DriveKind<E, N, P>,
{
    (D::NAMES, &D::SEEN, D::KEYS)
}

/// Returns the targets of a motion as this kind of drive plays them.
fn targets<D, const E: usize, const N: usize, const P: usize>(
    drive: &DriveOf<D, E>,
    motion: &Motion,
    ticks: usize,
) -> Vec<Vec<f64>>
where
    D: DriveKind<E, N, P>,
{
    let mut player = motion.played::<f32, P, N>(drive.form.delay_ticks as u32);
    let jet = |Target { turn, jet }: Target<f32, i32, N>| {
        let mut jet = jet.map(f64::from).to_vec();
        jet[0] += TAU * f64::from(turn);
        jet
    };
    let mut jets = Vec::with_capacity(ticks + 1);
    for _ in 0..ticks {
        let [begin, end] = player.next_tick();
        if jets.is_empty() {
            jets.push(jet(begin));
        }
        jets.push(jet(end));
    }
    jets
}

/// Returns the trajectory of a motion, with the continuity of this kind of drive.
fn jets<D, const E: usize, const N: usize, const P: usize>(
    _: &DriveOf<D, E>,
    motion: &Motion,
) -> Box<dyn Fn(u32) -> [f64; 4] + Send + Sync>
where
    D: DriveKind<E, N, P>,
{
    Box::new(motion.jets::<P, 4>())
}

/// Controller of a drive of either kind in this process, without a reference.
pub enum AnyLaw {
    /// Controller of a motor.
    Motor(Box<dyn Law<1, 2>>),
    /// Controller of a joint.
    Joint(Box<dyn Law<2, 4>>),
}

/// Drive of either kind before it runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveDesign {
    /// Drive of a motor.
    Motor(DriveOf<MotorDesign, 1>),
    /// Drive of a joint.
    Joint(DriveOf<JointDesign, 2>),
}

/// Evaluates an expression for a drive of either kind.
macro_rules! each {
    ($drive:expr, $of:ident => $answer:expr) => {
        match $drive {
            DriveDesign::Motor($of) => $answer,
            DriveDesign::Joint($of) => $answer,
        }
    };
}

impl DriveDesign {
    /// Returns `motor` or `joint`, the name of its table in a scenario.
    pub const fn name(&self) -> &'static str {
        each!(self, drive => words(drive).0[0])
    }

    /// Returns `a motor with one encoder` or `a flexible joint with two encoders`.
    pub const fn title(&self) -> &'static str {
        each!(self, drive => words(drive).0[1])
    }

    /// Returns true for a joint that is designed as a whole.
    pub const fn is_whole(&self) -> bool {
        matches!(self, Self::Joint(DriveOf { design: JointDesign { coupled: Some(_), .. }, .. }))
    }

    /// Returns the keys of the observer bandwidths in a scenario.
    pub const fn observer_keys(&self) -> &'static [&'static str] {
        each!(self, drive => words(drive).2.0)
    }

    /// Returns the key of the factor for the observers with high gains.
    pub const fn fast_key(&self) -> &'static str {
        each!(self, drive => words(drive).2.1)
    }

    /// Returns for each encoder the index of its state, from 0, and its mounting.
    pub fn encoders(&self) -> Vec<(usize, Mounted)> {
        each!(self, drive => words(drive).1.iter().copied().zip(drive.mounted).collect())
    }

    /// Returns the type parameters.
    pub const fn form(&self) -> Form {
        each!(self, drive => drive.form)
    }

    /// Returns a mutable reference to the type parameters.
    pub const fn form_mut(&mut self) -> &mut Form {
        each!(self, drive => &mut drive.form)
    }

    /// Returns the design with alarms that are reported only. Use it to analyse the controller under any load.
    #[must_use]
    pub const fn telling(mut self) -> Self {
        match &mut self {
            Self::Motor(drive) => drive.monitors.reaction = Reaction::GoOn,
            Self::Joint(drive) => drive.monitors.reaction = Reaction::GoOn,
        }
        self
    }

    /// Returns the design without a rest band.
    #[must_use]
    pub const fn without_rest_band(mut self) -> Self {
        if let Self::Motor(drive) = &mut self {
            drive.monitors.rest_band = None;
        }
        self
    }

    /// Returns the reaction to an alarm.
    pub const fn reaction(&self) -> Reaction {
        each!(self, drive => drive.monitors.reaction)
    }

    /// Returns the fence.
    pub fn fence(&self) -> Option<Fence> {
        each!(self, drive => drive.fence())
    }

    /// Returns the rest band, within which the motor is left at rest.
    pub fn rest_band(&self) -> Option<RestBand> {
        each!(self, drive => drive.rest_band())
    }

    /// Returns the largest sudden load, N m.
    pub const fn sudden_load_n_m(&self) -> f64 {
        each!(self, drive => drive.monitors.sudden_load_n_m)
    }

    /// Returns the period T, s.
    pub fn period_s(&self) -> f64 {
        let mut copy = *self;
        *copy.period_mut_s()
    }

    /// Returns a mutable reference to the period T, s.
    pub fn period_mut_s(&mut self) -> &mut f64 {
        each!(self, drive => drive.design.period_s())
    }

    /// Returns the largest current of both signs, A.
    pub fn max_current_a(&self) -> f64 {
        let limits = self.limits();
        limits.max.min(-limits.min)
    }

    /// Returns the limits of the current, A.
    pub fn limits(&self) -> Limits {
        each!(self, drive => drive.design.limits())
    }

    /// Returns the torque constant K_t, N m per A.
    pub fn torque_n_m_per_a(&self) -> f64 {
        each!(self, drive => drive.design.torque_n_m_per_a())
    }

    /// Returns the innovation gate of each encoder in counts.
    pub fn gate_steps(&self) -> Vec<f64> {
        each!(self, drive => drive.design.gate_steps().to_vec())
    }

    /// Returns the bandwidths.
    pub fn bandwidths(&self) -> Bandwidths {
        each!(self, drive => drive.design.bandwidths())
    }

    /// Sets the bandwidths only. Gates and gain scheduling stay.
    pub fn set_bandwidths(&mut self, to: &Bandwidths) {
        each!(self, drive => drive.design.set_bandwidths(to));
    }

    /// Returns the design with these bandwidths and everything that follows from them by rule. For a joint `load_n_m`
    /// is the sudden load.
    #[must_use]
    pub fn redesigned(mut self, to: &Bandwidths, load_n_m: f64) -> Self {
        each!(&mut self, drive => drive.design = drive.design.redesigned(to, load_n_m));
        self
    }

    /// Returns a mutable reference to the factors of the observer bandwidths with high gains.
    pub fn fast_ratios(&mut self) -> &mut [f64] {
        each!(self, drive => drive.design.fast_ratios())
    }

    /// Returns the drive with other encoders of `times` as many counts. Its thresholds keep their angles.
    #[must_use]
    pub(in crate::port) fn finer(self, encoder: impl Fn(Encoder) -> Encoder, times: f64) -> Self {
        match self {
            Self::Motor(drive) => Self::Motor(drive.finer(encoder, times)),
            Self::Joint(drive) => Self::Joint(drive.finer(encoder, times)),
        }
    }

    /// Returns a function of the tick that gives r, r', .. of a motion, with whole revolutions included, as the plan of
    /// this drive.
    pub fn jets(&self, motion: &Motion) -> Box<dyn Fn(u32) -> [f64; 4] + Send + Sync> {
        each!(self, drive => jets(drive, motion))
    }

    /// Returns the drive along a reference, in this process.
    ///
    /// # Errors
    /// Fails with the error of the design.
    pub fn port(&self, motion: &Motion) -> Result<Box<dyn ControllerPort>, DriveError> {
        Ok(self.live(motion)?)
    }

    /// Returns the drive along a reference, which accepts motions and designs while it runs.
    ///
    /// # Errors
    /// Fails with the error of the design.
    pub fn live(&self, motion: &Motion) -> Result<Box<dyn LivePort>, DriveError> {
        each!(self, drive => drive.live(motion))
    }

    /// Returns the controller with its monitors, in this process. The caller gives it the counts and the targets.
    ///
    /// # Errors
    /// Fails with the error of the design.
    pub fn law(&self) -> Result<AnyLaw, DriveError> {
        Ok(match self {
            Self::Motor(drive) => AnyLaw::Motor(drive.own_law()?),
            Self::Joint(drive) => AnyLaw::Joint(drive.own_law()?),
        })
    }

    /// Returns r, r', .. at the ends of the first `ticks` ticks of a motion, as the drive plays it in f32, with whole
    /// revolutions included. The first entry is the begin of the first tick.
    pub fn targets(&self, motion: &Motion, ticks: usize) -> Vec<Vec<f64>> {
        each!(self, drive => targets(drive, motion, ticks))
    }

    /// Returns the rest band and the fence around the controller.
    pub(super) fn around(&self) -> Around {
        each!(self, drive => drive.around())
    }

    /// Returns the controller with monitors, to take over from a controller of the same form.
    pub(super) fn successor(&self, at_rest: bool) -> Result<Box<dyn Any + Send>, DriveError> {
        each!(self, drive => drive.successor(at_rest))
    }

    /// Returns the drive along a reference with a controller on a target.
    pub fn port_to<'a, X>(&self, law: X, motion: &Motion) -> Box<dyn ControllerPort + 'a>
    where
        X: Law<1, 2> + Law<2, 4> + 'a,
    {
        each!(self, drive => drive.port_to(law, motion))
    }

    /// Returns the drive along a reference in f64, with the base gains only and without monitors.
    ///
    /// # Errors
    /// Fails with the error of the design.
    pub fn in_f64(&self, motion: &Motion) -> Result<Box<dyn ControllerPort>, DriveError> {
        each!(self, drive => drive.design.in_f64((drive.form, drive.mounted), motion))
    }

    /// Returns the controller in f64 at rest at angle 0 with its base gains. The link of a joint hangs down.
    ///
    /// # Errors
    /// Fails with the error of the design.
    pub fn at_rest(&self) -> Result<DriveAtRest, DriveError> {
        each!(self, drive => drive.design.at_rest(drive.form))
    }

    /// Returns the design parameters, the limits of the monitors, and the bits of the stopping alarms, in the order of
    /// [`drive::LAYOUT`](controller_core::drive::LAYOUT).
    ///
    /// # Errors
    /// Fails with the error of the design.
    pub fn numbers(&self) -> Result<Vec<f64>, DriveError> {
        let stops_at = f64::from(self.reaction().stops_at().bits());
        let (bounds, _) = self.thresholds()?;
        Ok(each!(self, drive => drive.design.numbers()).into_iter().chain(bounds).chain([stops_at]).collect())
    }

    /// Returns the limits of the monitors in physical units, and the thresholds of a tick. The limits are |d| of each
    /// shaft in rad/s², |σ*|, and ticks at a limit.
    ///
    /// # Errors
    /// Fails with the error of the design.
    pub fn thresholds(&self) -> Result<(Vec<f64>, Thresholds), DriveError> {
        each!(self, drive => drive.watched())
    }
}

/// Drive at rest at angle 0 with its base gains, in f64.
pub struct DriveAtRest {
    /// Controller of the drive. Its encoders are finer, so that a count is a small change.
    pub law: Box<dyn LawAtRest>,
    /// Bound λ_2 of |σ*| while every innovation is at most one count of its encoder, in the unit of x_n.
    pub sigma_star_bound: f64,
}

fn at_rest<M, A, const E: usize, const N: usize, const S: usize, const LATE: usize>(
    law: EncoderForm<f64, M, A, E, N, S, 0, LATE>,
    coarse: [Encoder; E],
) -> DriveAtRest
where
    M: ChainModel<f64, E, N> + Send + Sync + 'static,
    A: Aim<f64, N, Target: Send + Sync> + Send + Sync,
{
    let target = A::told(&Target { turn: 0, jet: [0.0; N] });
    let sample = move |counts: &[f64]| Sample {
        counts: std::array::from_fn(|i| Some(counts[i] as i32)),
        begin: target,
        end: target,
    };
    let units_rad = coarse.map(|encoder| finest(encoder).unit_rad());
    let steps = std::array::from_fn(|i| coarse[i].unit_rad() / units_rad[i]);
    let sigma_star_bound = law.sigma_star_bound(steps);
    // The channels of the angles have no disturbance.
    let still = Still::new(law, E, units_rad.into(), sample, |known| known.disturbance.map(|d| [0.0, d]).concat());
    let Some(still) = still else { unreachable!("a drive starts at angle 0") };
    DriveAtRest { law: Box::new(still), sigma_star_bound }
}

/// Returns the encoder with the largest number of counts that a drive accepts.
fn finest(encoder: Encoder) -> Encoder {
    let counts = u64::from(encoder.counts_per_turn) * u64::from(encoder.gear_num);
    let k = (0..24).rev().find(|&k| counts <= (1 << 24) >> k).unwrap_or(0);
    Encoder { bits: 32, states: 0, counts_per_turn: encoder.counts_per_turn << k, ..encoder }
}
