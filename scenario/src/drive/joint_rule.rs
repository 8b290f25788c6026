//! Gains by rule for any flexible joint from its data sheet, or an error with changes that help.
//!
//! # Search space
//! The search varies two bandwidths of the observer and two poles of the regulator ([`JointTick::observer_gains`],
//! [`Regulator::of`]). They are parametrised by a *shape* and the bandwidth W of the link observer:
//!
//! $$ W_l = W, \quad W_m = W \sqrt[3]{\beta \frac{J_l s_l}{J_m s_m}}, \quad
//!    w_c = r W/\sqrt\kappa, \quad k_l = r W \sqrt\kappa $$
//!
//! with the encoder counts $s_l, s_m$. β is the random walk of the motor torque relative to the link torque, r the
//! speed of the regulator relative to the observer, and κ the ratio of its two poles.
//!
//! # Constraints
//! * The current noise from the encoder counts, white with counts/√12, is within its share of the current limit.
//! * The peak of |S| at the plant input is within the declared one, hanging and at 1 rad, and within [`CORNER_PEAK`]
//!   in all corners.
//! * The exact sampled loop is stable in all corners. These are 32 corners of the five ratios of the joint; 32 corners
//!   of its parameters (up to 20 % of tolerance) hanging, at 1 rad and upside down; and 16 corners of the parameters
//!   each with no lag and with twice the lag of the current loop. Oscillations decay within a hundred time constants of
//!   the slower of observer and regulator.
//! * The regulator is also stable with any smaller gain of u, so that saturation does not start a limit cycle between
//!   the limits of u.
//! * The regulator has a real pole for the reaching law, and k_l T is at most [`FASTEST`].
//!
//! The corners of the parameters are harder: ±20 % of K and J_l are -33 to +50 % of their ratio.
//!
//! # Search
//! A shape is evaluated at its largest feasible W, found by steps down and bisection. The cost of a shape is the mean
//! logarithm of the dip under a load and of the area under the dip. It is computed nominally and in the worst of four
//! corners at [`BEYOND`] times the tolerance. The area is the error under a steadily growing load, so it represents
//! moves with a wrong inertia. The search starts with a table of shapes and descends from the best ones along each
//! number. Few corners decide most cases. These ("active") corners are checked first, and all corners before a design
//! is accepted.
//!
//! # High gains
//! The high gains belong to an observer with the bandwidths W_l f_l and W_m f_m, and the same regulator. The
//! rule selects the set with the smallest dip that is stable when permanently active, with |S| up to [`FAST_PEAK`].
//! This is checked nominally at every angle and with either lag, and in the corners of the ratios. The corners of the
//! parameters are wider and are not checked, because the set is switched off after 2.5/W_l in any case. The set is
//! scheduled in when the innovation exceeds three times the rms from its own counts, so it does not keep itself active.
//! The cost of a design combines the dip of the high gains and the area of the base gains.
//!
//! # Errors
//! If neither the table nor a denser table has a design, the rule tries each kind of change alone: period, bits of
//! either encoder, tolerance, |S|. Every change in the error leads to a design.

use std::fmt;

use controller_core::drive::{Joint, JointRatios, JointTick, Regulator};

use closed_loop::{Controller, Loop, Model, Plant};

mod closed_loop;
mod eigenvalues;
#[cfg(test)]
mod tests;

/// Largest |S| in a corner: the gain of the plant may still grow by 26 %.
pub const CORNER_PEAK: f64 = 4.8;

/// Factor of the tolerance for the comparison of designs. It penalises designs at the edge of the constraints.
const BEYOND: f64 = 1.75;

/// Largest |S| of the high gains when permanently active.
const FAST_PEAK: f64 = 3.0;

/// Largest resonance times the period. Above it the samples do not determine the direction of the oscillation.
const SEEN: f64 = 3.0;

/// Largest spectral radius of a stable loop.
const STABLE: f64 = 1.0 - 1e-6;

/// Largest k_l T: a faster pole of a rigid shaft decays within a tick.
const FASTEST: f64 = 1.5;

/// Largest tolerance that is applied to the parameters. Above it only the ratios vary.
const OF_PARAMETERS: f64 = 0.2;

/// Angles from hanging at which gravity is linearised, rad.
const ANGLES: [f64; 3] = [0.0, 1.0, std::f64::consts::PI];

/// Data sheet of a joint and its electronics, the input of the rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSheet {
    /// Data sheet, everything behind the gear.
    pub joint: Joint,
    /// One count of the encoders of link and motor behind the gear, rad; with electronic noise of σ rms
    /// √(count² + 18 σ²).
    pub steps_rad: [f64; 2],
    /// Time between two ticks, s.
    pub period_s: f64,
    /// Time constant of the current loop, s; 0 for none.
    pub lag_s: f64,
    /// Ticks from the computation of u until it is applied, 0 to 3.
    pub delay_ticks: usize,
    /// Limit of u for both signs, A.
    pub most_a: f64,
    /// Tolerance of the parameters: 0.2 for ±20 %.
    pub uncertain: f64,
    /// Largest nominal peak of |S| at the plant input.
    pub peak: f64,
    /// Largest current noise from encoder counts, rms, as a share of `most_a`.
    pub noise_share: f64,
}

/// Limit of the bandwidth, in the order in which limits are checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Binding {
    /// Period: the observer is as fast as the ticks allow.
    Period,
    /// No real pole of the regulator is left for the reaching law.
    NoRealPole,
    /// Saturation: with a smaller gain, as at the limit of u, the regulator would be unstable.
    Saturation,
    /// Nominal peak of |S|.
    Margin,
    /// Current noise from encoder counts.
    Noise,
    /// Corner of the tolerance that is unstable or has too large a |S|.
    Corner,
}

impl Binding {
    const ALL: [Self; 6] = [Self::Period, Self::NoRealPole, Self::Saturation, Self::Margin, Self::Noise, Self::Corner];
}

impl fmt::Display for Binding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Noise => "the current noise from the encoder counts",
            Self::Margin => "the peak of |S| by the data sheet",
            Self::Corner => "a corner of the tolerance",
            Self::Saturation => "the current limit, at which the loop would oscillate",
            Self::NoRealPole => "the spring, which leaves no real pole for the reaching law",
            Self::Period => "the period",
        })
    }
}

/// High gains of the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FastSet {
    /// Ratios of the observer bandwidths of the high and the base gains, link and motor.
    pub ratios: [f64; 2],
    /// Innovation of both encoders, in `steps_rad`, below which the base gains stay active.
    pub calm_steps: [f64; 2],
    /// Nominal peak of |S| when permanently active.
    pub peak: f64,
    /// Peak of |S| in the worst corner when permanently active.
    pub corner_peak: f64,
    /// Ratio of the dips under a load step, high to base gains.
    pub dip_ratio: f64,
    /// Largest spectral radius of all corners when permanently active.
    pub radius: f64,
}

/// Gains by rule and their metrics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointRule {
    /// w_c, the slower pole of the law on a rigid shaft, rad/s.
    pub surface_rad_s: f64,
    /// k_l, the faster pole of the law on a rigid shaft, 1/s.
    pub reaching_per_s: f64,
    /// W_l, bandwidth of the observer of the link, rad/s.
    pub link_rad_s: f64,
    /// W_m, bandwidth of the observer of the motor, rad/s.
    pub motor_rad_s: f64,
    /// High gains for sudden loads, if they help.
    pub fast: Option<FastSet>,
    /// Limit of the bandwidth.
    pub binding: Binding,
    /// Nominal peak of |S|, the larger of hanging and at 1 rad.
    pub peak: f64,
    /// Peak of |S| in the worst corner.
    pub corner_peak: f64,
    /// Current noise from encoder counts, rms, as a share of the largest current.
    pub noise_share: f64,
    /// Largest spectral radius of all corners.
    pub radius: f64,
    /// Dip of the link under a load step, rad per N m: nominal, and in the worst of four corners of 1.75 times the
    /// tolerance. An unstable corner counts as ten times the nominal dip.
    pub dips_rad_per_n_m: [f64; 2],
}

impl JointRule {
    /// Returns every number as text that keeps its bits.
    pub(super) fn to_text(self) -> String {
        let Self { surface_rad_s, reaching_per_s, link_rad_s, motor_rad_s, fast, binding, .. } = self;
        let Self { peak, corner_peak, noise_share, radius, dips_rad_per_n_m: [dip, worst], .. } = self;
        let mut all = vec![surface_rad_s, reaching_per_s, link_rad_s, motor_rad_s, f64::from(binding as u8)];
        all.extend([peak, corner_peak, noise_share, radius, dip, worst]);
        if let Some(FastSet { ratios, calm_steps, peak, corner_peak, dip_ratio, radius }) = fast {
            all.extend(ratios.into_iter().chain(calm_steps).chain([peak, corner_peak, dip_ratio, radius]));
        }
        all.iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(" ")
    }

    /// Returns the gains from the text of [`JointRule::to_text`]. `None` for another text.
    pub(super) fn from_text(text: &str) -> Option<Self> {
        let all: Vec<f64> = text.split_whitespace().map(|number| number.parse().ok()).collect::<Option<_>>()?;
        let (&[surface_rad_s, reaching_per_s, link_rad_s, motor_rad_s, binding, ref rest @ ..], fast) =
            all.split_at_checked(11)?
        else {
            return None;
        };
        let &[peak, corner_peak, noise_share, radius, dip, worst] = rest else { return None };
        let fast = match *fast {
            [] => None,
            [link, motor, calm_link, calm_motor, peak, corner_peak, dip_ratio, radius] => Some(FastSet {
                ratios: [link, motor],
                calm_steps: [calm_link, calm_motor],
                peak,
                corner_peak,
                dip_ratio,
                radius,
            }),
            _ => return None,
        };
        Some(Self {
            surface_rad_s,
            reaching_per_s,
            link_rad_s,
            motor_rad_s,
            fast,
            binding: Binding::ALL.into_iter().find(|limit| f64::from(*limit as u8) == binding)?,
            peak,
            corner_peak,
            noise_share,
            radius,
            dips_rad_per_n_m: [dip, worst],
        })
    }
}

/// Change of the data sheet with which the rule finds gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Remedy {
    /// Shorter period, s.
    Period(f64),
    /// Additional bits of the encoders of link and motor.
    Bits([u32; 2]),
    /// Smaller tolerance of the parameters.
    Tolerance(f64),
    /// Larger peak of |S|.
    Peak(f64),
    /// Driving the joint as a rigid motor, with the motor encoder.
    BehindGear,
}

impl Remedy {
    /// Returns true if the rule finds gains with this change.
    fn helps(&self, sheet: &JointSheet) -> bool {
        self.applied(sheet).is_some_and(|changed| Search::of(&changed).is_some_and(|mut search| search.exists()))
    }

    /// Returns the data sheet with this change. `None` for a joint that is driven as a motor.
    pub fn applied(&self, sheet: &JointSheet) -> Option<JointSheet> {
        let mut out = *sheet;
        match *self {
            Self::Period(period_s) => out.period_s = period_s,
            Self::Bits(more) => {
                (0..2).for_each(|k| out.steps_rad[k] *= 0.5_f64.powi(more[k] as i32));
            }
            Self::Tolerance(uncertain) => out.uncertain = uncertain,
            Self::Peak(peak) => out.peak = peak,
            Self::BehindGear => return None,
        }
        Some(out)
    }
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Period(period_s) => {
                write!(f, "a period of {} us", (period_s * 1e7).round() / 10.0)
            }
            Self::Bits([link, 0]) => write!(f, "{link} more bits of the link encoder"),
            Self::Bits([0, motor]) => write!(f, "{motor} more bits of the motor encoder"),
            Self::Bits([link, motor]) => write!(f, "{link} and {motor} more bits of the encoders of link and motor"),
            Self::Tolerance(p) => write!(f, "parameters known to +-{} %", (p * 1e3).round() / 10.0),
            Self::Peak(peak) => write!(f, "a peak of |S| of {peak}"),
            Self::BehindGear => f.write_str("driving the joint as a rigid [motor] with its load, by the motor encoder"),
        }
    }
}

/// Error of the rule: no gains meet all constraints.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// Last limit that the designs failed. Some designs met all limits before it.
    pub binding: Binding,
    /// Resonance of both shafts on the spring, times the period.
    pub resonance_per_tick: f64,
    /// Twist of the spring under the gravity torque of the horizontal link, rad.
    pub sag_rad: f64,
    /// Changes that lead to gains, the smallest of each kind.
    pub remedies: Vec<Remedy>,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no gains meet all limits; the last limit is {}", self.binding)?;
        let mut before = "; changes that help: ";
        for remedy in &self.remedies {
            write!(f, "{before}{remedy}")?;
            before = ", or ";
        }
        Ok(())
    }
}

/// Shape of a design, which together with W gives all bandwidths. See the module documentation.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shape {
    /// Ratio β of the random walks of the torques, motor to link.
    walk: f64,
    /// Ratio r of the speeds of regulator and observer.
    law: f64,
    /// Ratio κ of the two poles of the regulator.
    apart: f64,
}

/// Poles of the regulator and bandwidths of the observer, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bandwidths {
    poles: [f64; 2],
    observers: [f64; 2],
}

/// Plant in a corner, and the index of its angle.
struct Corner {
    plant: Plant,
    angle: usize,
    /// True if the high gains must also be stable in this corner when permanently active.
    of_fast: bool,
}

/// Gains with their controllers and nominal metrics.
struct Gains {
    controllers: Vec<Controller>,
    noise_share: f64,
    peak: f64,
}

/// Parameters of the search for the largest W of a shape.
struct SearchSettings {
    /// Lowest and highest W, rad/s.
    span: [f64; 2],
    /// Ratio of a step down.
    ratio: f64,
    /// Rounds of bisection after the steps.
    halvings: usize,
    /// Cost of the first feasible W above which a shape is dropped.
    hopeless: f64,
    /// True if the result must be valid in all corners, not only in the active ones.
    all: bool,
}

/// Design of a shape at its largest W.
struct Found {
    shape: Shape,
    w: f64,
    bandwidths: Bandwidths,
    gains: Gains,
    cost: f64,
    /// Dips, nominal and in the worst corner, rad per N m.
    dips: [f64; 2],
}

/// Data sheet with all quantities that do not depend on the gains.
struct Search<'a> {
    sheet: &'a JointSheet,
    ratios: JointRatios,
    tick: JointTick,
    model: Model,
    /// Nominal plants: hanging and at 1 rad.
    nominal: Vec<Plant>,
    corners: Vec<Corner>,
    /// Corners for the dip.
    loaded: Vec<Corner>,
    /// Active corners: indices of the corners that rejected a design, the last one first.
    active: Vec<usize>,
    /// Last limit that any design failed.
    furthest: Binding,
}

/// Returns gains for a joint with their metrics.
///
/// # Errors
/// Returns [`Refused`] with remedies if no bandwidth meets all limits.
pub fn joint_rule(sheet: &JointSheet) -> Result<JointRule, Refused> {
    let resonance = {
        let r = JointRatios::of(&sheet.joint, sheet.lag_s);
        (r.k1 + r.k2).sqrt() * sheet.period_s
    };
    let sag_rad = sheet.joint.weight_n_m / sheet.joint.stiffness_n_m;
    let refused = |binding, remedies| Err(Refused { binding, resonance_per_tick: resonance, sag_rad, remedies });
    if resonance >= SEEN || resonance.is_nan() {
        let shorter = Remedy::Period(0.5 * sheet.period_s * SEEN / resonance);
        let remedies = [shorter].into_iter().filter(|remedy| sheet.period_s < 1.0 && remedy.helps(sheet));
        return refused(Binding::Period, remedies.chain([Remedy::BehindGear]).collect());
    }
    let mut binding = Binding::Period;
    if let Some(mut search) = Search::of(sheet) {
        if let Some(found) = search.best() {
            return Ok(found);
        }
        binding = search.furthest;
    }
    refused(binding, remedies(sheet))
}

/// Returns the smallest change of each kind that leads to gains.
fn remedies(sheet: &JointSheet) -> Vec<Remedy> {
    // No encoder has more than 2^24 counts per revolution of the link.
    let is_made = |remedy: &Remedy| match *remedy {
        Remedy::Bits(more) => (0..2).all(|k| {
            let finest = std::f64::consts::TAU / f64::from(1_u32 << 24);
            more[k] == 0 || sheet.steps_rad[k] * 0.5_f64.powi(more[k] as i32) > 0.99 * finest
        }),
        _ => true,
    };
    let helps = |remedy: &Remedy| is_made(remedy) && remedy.helps(sheet);
    let first = |mut from: &mut dyn Iterator<Item = Remedy>| Iterator::find(&mut from, helps);
    let bits = |of: fn(u32) -> [u32; 2]| {
        // Three samples first, because more bits are not always better and mostly none helps.
        let all = |more| Remedy::Bits(of(more));
        let most = (1..=8).rev().find(|&more| is_made(&all(more)))?;
        let some = [most, most.div_ceil(2), 1];
        if some.iter().any(|&more| helps(&all(more))) { first(&mut (1..=most).map(all)) } else { None }
    };
    let mut found = Vec::new();
    found.extend(first(&mut [0.5, 0.25, 0.125].iter().map(|by| Remedy::Period(sheet.period_s * by))));
    found.extend(bits(|more| [0, more]));
    found.extend(bits(|more| [more, 0]));
    if !found.iter().any(|remedy| matches!(remedy, Remedy::Bits(_))) {
        found.extend(bits(|more| [more, more]));
    }
    found.extend(first(&mut [0.75, 0.5, 0.25, 0.1].iter().map(|by| Remedy::Tolerance(sheet.uncertain * by))));
    found.extend(first(&mut [1.7, 2.0, 2.4, 3.0].iter().filter(|&&p| p > sheet.peak).map(|&p| Remedy::Peak(p))));
    found.push(Remedy::BehindGear);
    found
}

/// Returns the joint with J_l, J_m, K, K_t, weight each times 1 + `p` or 1 - `p`, by the bits of `corner`.
fn with_parameters(joint: &Joint, corner: usize, p: f64) -> Joint {
    let by = |bit: usize| {
        if corner >> bit & 1 == 1 { 1.0 + p } else { 1.0 - p }
    };
    Joint {
        link_inertia_kg_m2: joint.link_inertia_kg_m2 * by(0),
        motor_inertia_kg_m2: joint.motor_inertia_kg_m2 * by(1),
        stiffness_n_m: joint.stiffness_n_m * by(2),
        torque_n_m_per_a: joint.torque_n_m_per_a * by(3),
        weight_n_m: joint.weight_n_m * by(4),
        ..*joint
    }
}

/// Returns the five ratios each times 1 + `p` or 1 - `p`, by the bits of `corner`.
fn with_ratios(r: &JointRatios, corner: usize, p: f64) -> JointRatios {
    let by = |bit: usize| {
        if corner >> bit & 1 == 1 { 1.0 + p } else { 1.0 - p }
    };
    JointRatios {
        k1: r.k1 * by(0),
        b1: r.b1 * by(1),
        k2: r.k2 * by(2),
        b2: r.b2 * by(3),
        b: r.b * by(4),
        lag_s: r.lag_s,
    }
}

impl<'a> Search<'a> {
    /// Prepares the search. `None` if the eigenvalues of a plant are not found.
    fn of(sheet: &'a JointSheet) -> Option<Self> {
        let (joint, t, p) = (&sheet.joint, sheet.period_s, sheet.uncertain);
        let ratios = JointRatios::of(joint, sheet.lag_s);
        let tick = JointTick::of(&ratios, t);
        let model = Model::of(&ratios, &tick, t, sheet.delay_ticks);
        let unit = model.unit;
        let own = |joint: &Joint, lag_s: f64, angle: usize| {
            let spring = joint.weight_n_m / joint.link_inertia_kg_m2 * libm::cos(ANGLES[angle]);
            let plant = Plant::of(&JointRatios::of(joint, lag_s), [spring, 1.0 / joint.link_inertia_kg_m2], t, unit)?;
            Some(Corner { plant, angle, of_fast: false })
        };
        let angles = if joint.weight_n_m == 0.0 { 1 } else { ANGLES.len() };
        let nominal = (0..angles.min(2)).map(|k| Some(own(joint, sheet.lag_s, k)?.plant)).collect::<Option<_>>()?;
        // Corners of the weight only with a weight.
        let parameters = if joint.weight_n_m == 0.0 { 16 } else { 32 };
        let (mut corners, at) = (Vec::new(), angles.min(2) - 1);
        let spring = joint.weight_n_m / joint.link_inertia_kg_m2 * libm::cos(ANGLES[at]);
        for corner in 0..32 {
            let plant = Plant::of(&with_ratios(&ratios, corner, p), [spring, 0.0], t, unit)?;
            corners.push(Corner { plant, angle: at, of_fast: true });
        }
        for angle in 0..angles {
            corners.push(Corner { of_fast: true, ..own(joint, sheet.lag_s, angle)? });
            if p <= OF_PARAMETERS {
                for corner in 0..parameters {
                    corners.push(own(&with_parameters(joint, corner, p), sheet.lag_s, angle)?);
                }
            }
        }
        for lag_s in [0.0, 2.0 * sheet.lag_s] {
            corners.push(Corner { of_fast: true, ..own(joint, lag_s, at)? });
            for corner in 0..16 {
                corners.push(own(&with_parameters(joint, corner, p.min(OF_PARAMETERS)), lag_s, at)?);
            }
        }
        // J_l, J_m, K, K_t: heavy and weak, light and strong, each with a soft and a stiff spring.
        let loaded = [0b00011, 0b00111, 0b01000, 0b01100]
            .iter()
            .map(|&corner| own(&with_parameters(joint, corner, (BEYOND * p).min(0.8)), sheet.lag_s, at))
            .collect::<Option<_>>()?;
        Some(Self {
            sheet,
            ratios,
            tick,
            model,
            nominal,
            corners,
            loaded,
            active: Vec::new(),
            furthest: Binding::Period,
        })
    }

    fn bandwidths(&self, shape: &Shape, w: f64) -> Bandwidths {
        let (joint, [link, motor]) = (&self.sheet.joint, self.sheet.steps_rad);
        let (link, motor) = (joint.link_inertia_kg_m2 * link, joint.motor_inertia_kg_m2 * motor);
        let (law, apart) = (shape.law * w, shape.apart.sqrt());
        Bandwidths { poles: [law / apart, law * apart], observers: [w, w * libm::cbrt(shape.walk * link / motor)] }
    }

    /// Returns the lowest angle per tick at which |S| can have a peak.
    fn slow(&self, of: &Bandwidths) -> f64 {
        (0.1 * of.poles[0].min(of.observers[0]) * self.sheet.period_s).min(0.1)
    }

    /// Checks the nominal constraints: noise up to `noise`, |S| up to `peak`.
    fn nominally(&self, of: &Bandwidths, noise: f64, peak: f64) -> Result<Gains, Binding> {
        let sheet = self.sheet;
        if of.poles[1] * sheet.period_s > FASTEST {
            return Err(Binding::NoRealPole);
        }
        let law = Regulator::of(&self.ratios, &self.tick, sheet.period_s, of.poles).ok_or(Binding::NoRealPole)?;
        if !self.model.bears_limits(&law) {
            return Err(Binding::Saturation);
        }
        let gains = self.tick.observer_gains(&self.ratios, sheet.period_s, sheet.steps_rad, of.observers);
        let angles = if sheet.joint.weight_n_m == 0.0 { 1 } else { ANGLES.len() };
        let gravity = sheet.joint.weight_n_m / sheet.joint.link_inertia_kg_m2;
        let controllers = (0..angles)
            .map(|k| Controller::of(&self.model, &gains, &law, gravity * libm::cos(ANGLES[k])))
            .collect::<Option<Vec<_>>>()
            .ok_or(Binding::Margin)?;
        let mut out = Gains { controllers, noise_share: 0.0, peak: 0.0 };
        for (angle, plant) in self.nominal.iter().enumerate() {
            let one = Loop::of(plant, &out.controllers[angle]).filter(|one| one.radius() < STABLE);
            let one = one.ok_or(Binding::Margin)?;
            out.peak = out.peak.max(one.peak(self.slow(of)));
            if out.peak.is_nan() || out.peak > peak {
                return Err(Binding::Margin);
            }
            if angle == 0 {
                let (u, _) = one.noise(sheet.steps_rad.map(|step| step / 12_f64.sqrt()), self.model.unit);
                out.noise_share = u / sheet.most_a;
                if out.noise_share.is_nan() || out.noise_share > noise {
                    return Err(Binding::Noise);
                }
            }
        }
        Ok(out)
    }

    /// Returns spectral radius and peak of |S| in a corner.
    fn in_corner(&self, number: usize, gains: &Gains, slow: f64) -> [f64; 2] {
        let corner = &self.corners[number];
        let one = Loop::of(&corner.plant, &gains.controllers[corner.angle]);
        one.map_or([f64::INFINITY; 2], |one| {
            let radius = one.radius();
            [radius, if radius < STABLE { one.peak(slow) } else { f64::INFINITY }]
        })
    }

    /// Checks a design in the active or in all corners. A corner that rejects it becomes active.
    fn borne(&mut self, gains: &Gains, slow: f64, peak: f64, (all, is_fast): (bool, bool)) -> Option<[f64; 2]> {
        let mut worst = [0.0_f64; 2];
        // An oscillation longer than a hundred time constants of the loop counts as unstable.
        let stable = STABLE.min(1.0 - 0.1 * slow);
        let bad = |[radius, size]: [f64; 2]| !(radius < stable && size <= peak);
        for place in 0..self.active.len() {
            let number = self.active[place];
            if is_fast && !self.corners[number].of_fast {
                continue;
            }
            let found = self.in_corner(number, gains, slow);
            if bad(found) {
                self.active[..=place].rotate_right(1);
                return None;
            }
            worst = [worst[0].max(found[0]), worst[1].max(found[1])];
        }
        if all {
            for number in 0..self.corners.len() {
                if is_fast && !self.corners[number].of_fast {
                    continue;
                }
                let found = self.in_corner(number, gains, slow);
                if bad(found) {
                    self.active.insert(0, number);
                    return None;
                }
                worst = [worst[0].max(found[0]), worst[1].max(found[1])];
            }
        }
        Some(worst)
    }

    fn feasible(&mut self, shape: &Shape, w: f64, all: bool) -> Result<Gains, Binding> {
        let of = self.bandwidths(shape, w);
        let found = self.nominally(&of, self.sheet.noise_share, self.sheet.peak).and_then(|gains| {
            self.borne(&gains, self.slow(&of), CORNER_PEAK, (all, false)).map(|_| gains).ok_or(Binding::Corner)
        });
        if let Err(limit) = found {
            self.furthest = self.furthest.max(limit);
        }
        found
    }

    /// Returns the next limit of a shape above W.
    fn limit(&mut self, shape: &Shape, w: f64) -> Binding {
        let most = self.bounds()[1];
        let above = (1..).map(|k| w * 1.07_f64.powi(k)).take_while(|&w| w < most);
        above.into_iter().find_map(|w| self.feasible(shape, w, false).err()).unwrap_or(Binding::Period)
    }

    /// Finds the largest feasible W of a shape, by steps down and then by bisection.
    fn largest(&mut self, shape: &Shape, way: &SearchSettings) -> Option<Found> {
        let (&SearchSettings { span: [low, high], halvings, hopeless, all, .. }, mut ratio) = (way, way.ratio);
        let (mut w, mut above) = (high, high);
        loop {
            let gains = loop {
                if let Ok(gains) = self.feasible(shape, w, false) {
                    break gains;
                }
                above = w;
                w /= ratio;
                if w < low || w.is_nan() {
                    return None;
                }
            };
            if hopeless < f64::INFINITY && self.cost(&self.bandwidths(shape, w), &gains).0 > hopeless {
                return None;
            }
            for _ in 0..halvings {
                let middle = (w * above).sqrt();
                if self.feasible(shape, middle, false).is_ok() {
                    w = middle;
                } else {
                    above = middle;
                }
            }
            if let Ok(gains) = self.feasible(shape, w, all) {
                let bandwidths = self.bandwidths(shape, w);
                let (cost, dips) = self.cost(&bandwidths, &gains);
                return Some(Found { shape: *shape, w, bandwidths, gains, cost, dips });
            }
            // A corner has become active: continue with smaller steps.
            ratio = ratio.min(1.15);
        }
    }

    /// Returns the cost, the mean logarithm of dip and area, nominal and in corners; and both dips.
    fn cost(&self, of: &Bandwidths, gains: &Gains) -> (f64, [f64; 2]) {
        let t = self.sheet.period_s;
        let horizon = 12.0 / (of.poles[0].min(of.observers[0]) * t);
        let own = |plant: &Plant, angle: usize| {
            Loop::of(plant, &gains.controllers[angle]).map_or([f64::INFINITY; 2], |one| one.dip(horizon).into())
        };
        let at = self.nominal.len() - 1;
        let [dip, area] = own(&self.nominal[at], at);
        let mut worst = [0.0_f64; 2];
        for corner in &self.loaded {
            let found = own(&corner.plant, corner.angle);
            worst = [worst[0].max(found[0]), worst[1].max(found[1])];
        }
        // A corner beyond the tolerance may be unstable, at a cost.
        worst = [worst[0].min(10.0 * dip), worst[1].min(10.0 * area)];
        (0.25 * libm::log10(dip * worst[0]) + 0.25 * libm::log10(area * t * worst[1] * t), [dip, worst[0]])
    }

    /// Returns true if the table contains a design.
    fn exists(&mut self) -> bool {
        let way =
            SearchSettings { span: self.bounds(), ratio: COARSE, halvings: 0, hopeless: f64::INFINITY, all: true };
        table_of_shapes().any(|shape| self.largest(&shape, &way).is_some())
    }

    /// Returns the range of W, rad/s.
    fn bounds(&self) -> [f64; 2] {
        [1e-4, 1.5].map(|of| of / self.sheet.period_s)
    }

    /// Returns the best design: from the table, by descent along each number of the shape, then with high gains.
    fn best(&mut self) -> Option<JointRule> {
        let mut way =
            SearchSettings { span: self.bounds(), ratio: COARSE, halvings: 4, hopeless: f64::INFINITY, all: true };
        let mut table: Vec<Found> = Vec::new();
        for shape in table_of_shapes() {
            table.extend(self.largest(&shape, &way));
            way.hopeless = table.iter().map(|one| one.cost + HOPELESS).fold(f64::INFINITY, f64::min);
            // After three designs the decisive corners are active.
            way.all = table.len() < 3;
        }
        table.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let mut found = Vec::new();
        for one in table {
            if found.len() < DESCENTS {
                found.extend(self.descended(&one.shape, one.w));
            }
        }
        if found.is_empty() {
            way = SearchSettings { ratio: FINE, hopeless: f64::INFINITY, all: true, ..way };
            let first = dense_table().find_map(|shape| self.largest(&shape, &way))?;
            found.extend(self.descended(&first.shape, first.w));
        }
        // High gains need margin, so the largest W is not always the best.
        let mut best = None;
        for one in found {
            for by in [1.0, 0.8, 0.64, 0.5] {
                let span = [0.85 * by * one.w, by * one.w];
                let way = SearchSettings { span, ratio: 1.1, halvings: 0, hopeless: f64::INFINITY, all: true };
                let Some(slower) = self.largest(&one.shape, &way) else { continue };
                let (cost, fast) = self.fast(&slower);
                if best.as_ref().is_none_or(|(least, _, _)| cost < least - 1e-3) {
                    best = Some((cost, slower, fast));
                }
            }
        }
        best.map(|(_, one, fast)| self.rule(&one, fast))
    }

    /// Descends from a shape along one number at a time. The result is valid in all corners.
    fn descended(&mut self, shape: &Shape, w: f64) -> Option<Found> {
        let low = self.bounds()[0];
        let down =
            |w: f64| SearchSettings { span: [low, w], ratio: 1.1, halvings: 2, hopeless: f64::INFINITY, all: true };
        let mut best = self.largest(shape, &down(w))?;
        for _ in 0..2 {
            let ended = self.descent(best);
            let promised = ended.cost;
            let Some(borne) = self.largest(&ended.shape, &down(ended.w)) else {
                return self.largest(shape, &down(w));
            };
            best = borne;
            // A corner that was not active may have raised the cost.
            if best.cost < promised + 0.01 {
                break;
            }
        }
        Some(best)
    }

    /// Descends along one number at a time, in the active corners.
    fn descent(&mut self, mut best: Found) -> Found {
        let most = self.bounds()[1];
        for factor in [2.5, 1.58, 1.26] {
            for number in 0..6 {
                let by = if number % 2 == 0 { factor } else { 1.0 / factor };
                loop {
                    let mut shape = best.shape;
                    match number / 2 {
                        0 => shape.walk *= by,
                        1 => shape.law *= by,
                        _ => shape.apart = (shape.apart * by).max(1.0),
                    }
                    let span = [0.4 * best.w, (2.5 * best.w).min(most)];
                    let way = SearchSettings { span, ratio: 1.3, halvings: 3, hopeless: best.cost + 0.4, all: false };
                    match self.largest(&shape, &way) {
                        Some(found) if found.cost < best.cost - 3e-3 => best = found,
                        _ => break,
                    }
                }
            }
        }
        best
    }

    /// Returns the design with its metrics in all corners.
    fn rule(&mut self, best: &Found, mut fast: Option<FastSet>) -> JointRule {
        if let Some(set) = &mut fast {
            let [link, motor] = best.bandwidths.observers;
            let observers = [link * set.ratios[0], motor * set.ratios[1]];
            let of = Bandwidths { observers, ..best.bandwidths };
            set.calm_steps =
                self.nominally(&of, f64::INFINITY, FAST_PEAK).map_or([1.0; 2], |gains| self.calm_steps(&gains));
        }
        let slow = self.slow(&best.bandwidths);
        // The design is valid in all corners.
        let [radius, corner_peak] =
            self.borne(&best.gains, slow, f64::INFINITY, (true, false)).unwrap_or([f64::INFINITY; 2]);
        let Bandwidths { poles: [surface_rad_s, reaching_per_s], observers: [link_rad_s, motor_rad_s] } =
            best.bandwidths;
        JointRule {
            surface_rad_s,
            reaching_per_s,
            link_rad_s,
            motor_rad_s,
            fast,
            binding: self.limit(&best.shape, best.w),
            peak: best.gains.peak,
            corner_peak,
            noise_share: best.gains.noise_share,
            radius,
            dips_rad_per_n_m: best.dips,
        }
    }

    /// Returns the high gains with the smallest dips, if these are well below the dips of the base gains; `calm_steps`
    /// is set later. Also returns the cost of both sets, with the dips of the high gains.
    fn fast(&mut self, quiet: &Found) -> (f64, Option<FastSet>) {
        let slow = self.slow(&quiet.bandwidths);
        let most = self.bounds()[1];
        let mut all = Vec::new();
        for link in [1.4, 2.0, 2.8, 4.0] {
            for motor in [0.7, 1.4, 2.8] {
                let mut of = quiet.bandwidths;
                (of.observers[0], of.observers[1]) = (of.observers[0] * link, of.observers[1] * motor);
                if of.observers[0] > most {
                    continue;
                }
                let Ok(gains) = self.nominally(&of, f64::INFINITY, FAST_PEAK) else { continue };
                if self.borne(&gains, slow, f64::INFINITY, (false, true)).is_some() {
                    let (_, dips) = self.cost(&of, &gains);
                    let by = (dips[0] / quiet.dips[0]) * (dips[1] / quiet.dips[1]);
                    all.push((by, [link, motor], gains, dips[0] / quiet.dips[0]));
                }
            }
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (by, ratios, gains, dip_ratio) in all {
            if by > 0.8 || dip_ratio > 0.95 {
                continue;
            }
            if let Some([radius, corner_peak]) = self.borne(&gains, slow, f64::INFINITY, (true, true)) {
                let calm_steps = [1.0; 2];
                let set = FastSet { ratios, calm_steps, peak: gains.peak, corner_peak, dip_ratio, radius };
                return (quiet.cost + 0.25 * libm::log10(by), Some(set));
            }
        }
        (quiet.cost, None)
    }

    /// Returns three times the rms innovation from the counts in any corner, at least one count.
    fn calm_steps(&self, gains: &Gains) -> [f64; 2] {
        let noise = self.sheet.steps_rad.map(|step| step / 12_f64.sqrt());
        let mut calm = [1.0_f64; 2];
        for corner in self.corners.iter().filter(|corner| corner.of_fast) {
            let one = Loop::of(&corner.plant, &gains.controllers[corner.angle]);
            let innovation = one.map_or([0.0; 2], |one| one.noise(noise, self.model.unit).1);
            for k in 0..2 {
                calm[k] = calm[k].max(3.0 * innovation[k] / self.sheet.steps_rad[k]);
            }
        }
        calm
    }
}

/// Ratios of a step down for the first and for the dense table.
const COARSE: f64 = 1.5;
const FINE: f64 = 1.25;

/// Number of shapes of the table from which a descent starts.
const DESCENTS: usize = 3;

/// Excess cost at the first feasible W above which a shape is dropped.
const HOPELESS: f64 = 0.8;

/// Returns the first shapes. Rigid shafts have two real poles from κ = 1 on.
fn table_of_shapes() -> impl Iterator<Item = Shape> {
    [0.1, 3.0, 0.5, 15.0, 0.02, 90.0].into_iter().flat_map(|walk| {
        [(0.7, 1.7), (2.0, 1.7), (0.35, 6.0), (0.7, 6.0), (2.0, 6.0), (0.35, 20.0), (2.0, 20.0)]
            .map(|(law, apart)| Shape { walk, law, apart })
    })
}

/// Returns more shapes, for joints without a design in the first table.
fn dense_table() -> impl Iterator<Item = Shape> {
    let walks = [0.2, 0.05, 1.0, 6.0, 0.01, 30.0, 250.0, 0.002, 1500.0];
    walks.into_iter().flat_map(|walk| {
        [0.2, 0.5, 1.0, 2.0, 5.0]
            .into_iter()
            .flat_map(move |law| [1.2, 3.0, 8.0, 25.0, 80.0].map(|apart| Shape { walk, law, apart }))
    })
}
