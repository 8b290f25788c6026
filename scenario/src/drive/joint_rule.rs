//! Gains by rule for any flexible joint from its data sheet, or a refusal with the changes that help.
//!
//! # What is searched
//! Two bandwidths of the observer and two poles of the regulator ([`JointTick::observer_gains`], [`Regulator::of`]).
//! They are told apart as a *shape* and one bandwidth W of the link's observer:
//!
//! $$ W_l = W, \quad W_m = W \sqrt[3]{\beta \frac{J_l s_l}{J_m s_m}}, \quad
//!    w_c = r W/\sqrt\kappa, \quad k_l = r W \sqrt\kappa $$
//!
//! with the encoders' counts $s_l, s_m$. β is how much the motor's torque wanders beside the link's, r how fast the
//! regulator is beside the observer, κ how far its two poles are apart.
//!
//! # What is demanded
//! * Current noise from the encoder counts, white with counts/√12, is within its share of the largest current.
//! * The peak of |S| at the plant's input is within the declared one, hanging and at 1 rad, and within
//!   [`CORNER_PEAK`] in all corners.
//! * The exact sampled loop is stable in all corners: 32 of the five ratios of the joint; 32 of its parameters (up to
//!   20 % of tolerance) hanging, at 1 rad and upside down; and 16 of the parameters each with a current loop of no lag
//!   and of twice the lag. Whatever swings there dies out within a hundred time constants of the slower of observer and
//!   regulator.
//! * The regulator is stable with any smaller gain of u too, so that it does not swing between the limits of u for
//!   ever after it was there once.
//! * The regulator has a real pole to reach with, and k_l T is at most [`FASTEST`].
//!
//! Corners of the parameters are the hard ones: ±20 % of K and J_l are -33 to +50 % of their ratio.
//!
//! # How it is searched
//! A shape is as good as its largest feasible W, found by steps down and bisection. Shapes are compared by what a load
//! does: the mean logarithm of the dip and of the area under it, nominal and in the worst of four corners [`BEYOND`]
//! the tolerance. The area is the error under a load that grows steadily, so it stands for moves with a wrong inertia.
//! A table of shapes comes first; the best ones descend along each number. Few corners decide most verdicts, so these
//! ("active") are asked first, and all of them before a design counts as the best.
//!
//! # Fast set
//! Gains of an observer with the bandwidths W_l f_l and W_m f_m, with the regulator as it is: the least dip among those
//! that are stable while they stay in, with |S| up to [`FAST_PEAK`]: by the data sheet at every angle and with either
//! lag, and in the corners of the ratios. Those of the parameters are wider, and a stay ends after 2.5/W_l whatever
//! happens. It may come in when the innovation exceeds three times the rms that it makes of its own counts, so it does
//! not keep itself in. Of two designs the one with the better pair wins: the dip of the fast set, the area of the quiet
//! one.
//!
//! # Refusal
//! If neither the table nor a denser one has a design, each kind of change is tried by itself: period, bits of either
//! encoder, tolerance, |S|. Those named do have a design.

use std::fmt;

use controller_core::drive::{Joint, JointRatios, JointTick, Regulator};

use closed_loop::{Controller, Loop, Model, Plant};

mod closed_loop;
mod eigenvalues;
#[cfg(test)]
mod tests;

/// Most |S| in a corner: the gain of the plant may still grow by 26 %.
const CORNER_PEAK: f64 = 4.8;

/// Designs are compared in corners of this many times the tolerance: those at the edge of what is demanded lose.
const BEYOND: f64 = 1.75;

/// Most |S| of a fast set that stays in.
const FAST_PEAK: f64 = 3.0;

/// The resonance times the period is below this, or no sample tells which way the spring swings.
const SEEN: f64 = 3.0;

/// A loop is stable if its spectral radius is below this.
const STABLE: f64 = 1.0 - 1e-6;

/// Most k_l T: a faster pole of a rigid shaft is over within a tick.
const FASTEST: f64 = 1.5;

/// Tolerances above this are demanded of the ratios only.
const OF_PARAMETERS: f64 = 0.2;

/// Angles from hanging that gravity is linearised at, rad.
const ANGLES: [f64; 3] = [0.0, 1.0, std::f64::consts::PI];

/// What the rule needs to know of a joint and its electronics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSheet {
    /// The data sheet, everything behind the gear.
    pub joint: Joint,
    /// One count of the encoders of link and motor behind the gear, rad; with electronic noise of σ rms
    /// √(count² + 18 σ²).
    pub steps_rad: [f64; 2],
    /// Time between two ticks, s.
    pub period_s: f64,
    /// Time constant of the current loop, s; 0 for none.
    pub lag_s: f64,
    /// Ticks from a count to the u that answers it, 0 to 3.
    pub delay_ticks: usize,
    /// Largest u of either sign, A.
    pub most_a: f64,
    /// Tolerance of the parameters: 0.2 for ±20 %.
    pub uncertain: f64,
    /// Largest peak of |S| at the plant's input by the data sheet.
    pub peak: f64,
    /// Largest current noise from encoder counts, rms, as a share of `most_a`.
    pub noise_share: f64,
}

/// The limit that kept the bandwidth from being larger, in the order in which limits are checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Binding {
    /// None: the observer is as fast as the ticks.
    Period,
    /// The regulator has no real pole left to reach with.
    NoRealPole,
    /// The regulator would be unstable with less gain, as at the limit of u.
    Saturation,
    /// The peak of |S| by the data sheet.
    Margin,
    /// Current noise from encoder counts.
    Noise,
    /// A corner of the tolerance that is unstable, or that has too large a |S|.
    Corner,
}

impl fmt::Display for Binding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Noise => "the current noise from the encoder counts",
            Self::Margin => "the peak of |S| by the data sheet",
            Self::Corner => "a corner of the tolerance",
            Self::Saturation => "the largest current, at which the loop would swing",
            Self::NoRealPole => "the spring, which leaves no real pole to reach with",
            Self::Period => "the period",
        })
    }
}

/// A second gain set of the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FastSet {
    /// Bandwidths of the observer, link and motor, over the quiet ones.
    pub ratios: [f64; 2],
    /// Innovation of both encoders, in `steps_rad`, below which the set stays out.
    pub calm_steps: [f64; 2],
    /// Peak of |S| by the data sheet while the set stays in.
    pub peak: f64,
    /// The same in the worst corner.
    pub corner_peak: f64,
    /// Dip under a load step over that of the quiet set.
    pub dip_ratio: f64,
    /// Largest spectral radius of all corners while the set stays in.
    pub radius: f64,
}

/// Gains by rule and the figures that they were accepted with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointRule {
    /// w_c, the slower pole of the same law on a rigid shaft, rad/s.
    pub surface_rad_s: f64,
    /// k_l, the faster pole, 1/s.
    pub reaching_per_s: f64,
    /// W_l, bandwidth of the observer of the link, rad/s.
    pub link_rad_s: f64,
    /// W_m, bandwidth of the observer of the motor, rad/s.
    pub motor_rad_s: f64,
    /// A faster observer for loads that come suddenly, if one helps.
    pub fast: Option<FastSet>,
    /// What stopped the bandwidth.
    pub binding: Binding,
    /// Peak of |S| by the data sheet, the larger of hanging and at 1 rad.
    pub peak: f64,
    /// Peak of |S| in the worst corner.
    pub corner_peak: f64,
    /// Current noise from encoder counts, rms, as a share of the largest current.
    pub noise_share: f64,
    /// Largest spectral radius of all corners.
    pub radius: f64,
    /// Dip of the link under a load step, rad per N m: by the data sheet, and in the worst of four corners of 1.75
    /// times the tolerance (ten times the first where that is unstable).
    pub dips_rad_per_n_m: [f64; 2],
}

/// A change of the data sheet after which the rule finds gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Remedy {
    /// A shorter period, s.
    Period(f64),
    /// Additional bits of the encoders of link and motor.
    Bits([u32; 2]),
    /// A smaller tolerance of the parameters.
    Tolerance(f64),
    /// A larger peak of |S|.
    Peak(f64),
    /// Driving the joint as a rigid motor, by the encoder of the motor.
    BehindGear,
}

impl Remedy {
    /// Does the rule find gains with this change?
    fn helps(&self, sheet: &JointSheet) -> bool {
        self.applied(sheet).is_some_and(|changed| Search::of(&changed).is_some_and(|mut search| search.exists()))
    }

    /// The data sheet with this change; `None` for a joint that is to be driven as a motor.
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
            Self::Bits([link, 0]) => write!(f, "{link} more bits of the encoder of the link"),
            Self::Bits([0, motor]) => write!(f, "{motor} more bits of the encoder of the motor"),
            Self::Bits([link, motor]) => write!(f, "{link} and {motor} more bits of the encoders of link and motor"),
            Self::Tolerance(p) => write!(f, "parameters known to +-{} %", (p * 1e3).round() / 10.0),
            Self::Peak(peak) => write!(f, "a peak of |S| of {peak}"),
            Self::BehindGear => {
                f.write_str("the joint driven as a rigid [motor] with its load, by the encoder of the motor")
            }
        }
    }
}

/// No gains meet all demands.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// The last limit that the designs failed at: all before it are met by some.
    pub binding: Binding,
    /// The resonance of both shafts on the spring, times the period.
    pub resonance_per_tick: f64,
    /// How far the spring twists under the weight of the level link, rad.
    pub sag_rad: f64,
    /// Changes after each of which the rule finds gains, the smallest of its kind.
    pub remedies: Vec<Remedy>,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no gains meet all limits, the last one being {}", self.binding)?;
        let mut before = "; what helps: ";
        for remedy in &self.remedies {
            write!(f, "{before}{remedy}")?;
            before = ", or ";
        }
        Ok(())
    }
}

/// What makes a design of one bandwidth, see the module's head.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shape {
    /// β.
    walk: f64,
    /// r.
    law: f64,
    /// κ.
    apart: f64,
}

/// The four numbers of a design, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bandwidths {
    poles: [f64; 2],
    observers: [f64; 2],
}

/// A plant that the loop must be stable with, and the angle that it hangs at.
struct Corner {
    plant: Plant,
    angle: usize,
    /// Must the fast set bear it too, as if it stayed in?
    of_fast: bool,
}

/// Gains and the loops by the data sheet.
struct Gains {
    controllers: Vec<Controller>,
    noise_share: f64,
    peak: f64,
}

/// How the largest W of a shape is looked for.
struct Way {
    /// Lowest and highest W, rad/s.
    span: [f64; 2],
    /// Step down.
    ratio: f64,
    /// Rounds of bisection after it.
    halvings: usize,
    /// A shape whose first feasible W costs more is given up.
    hopeless: f64,
    /// Whether all corners must bear the result, or the active ones.
    all: bool,
}

/// The design of a shape at its largest W.
struct Found {
    shape: Shape,
    w: f64,
    bandwidths: Bandwidths,
    gains: Gains,
    cost: f64,
    /// By the data sheet and in the worst corner, rad per N m.
    dips: [f64; 2],
}

/// A sheet with all that does not depend on the gains.
struct Search<'a> {
    sheet: &'a JointSheet,
    ratios: JointRatios,
    tick: JointTick,
    model: Model,
    /// By the data sheet: hanging and at 1 rad.
    nominal: Vec<Plant>,
    corners: Vec<Corner>,
    /// Corners for the dip.
    loaded: Vec<Corner>,
    /// Numbers of the corners that decided a verdict, the last one first.
    active: Vec<usize>,
    /// The last limit that any design failed at.
    furthest: Binding,
}

/// Gains for a joint, and what they were accepted with; or what must change.
///
/// # Errors
/// [`Refused`] if no bandwidth meets all limits.
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

/// The smallest change of each kind after which gains exist.
fn remedies(sheet: &JointSheet) -> Vec<Remedy> {
    // No encoder counts finer than 2^24 a turn of the link.
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
        // The most first, and two less, as more are not always better: mostly none helps, and then these show it.
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

/// The joint with J_l, J_m, K, K_t, weight each times 1 + `p` or 1 - `p`, by the bits of `corner`.
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

/// The five ratios each times 1 + `p` or 1 - `p`, by the bits of `corner`.
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
    /// `None` if a plant has no eigenvalues that can be found.
    fn of(sheet: &'a JointSheet) -> Option<Self> {
        let (joint, t, p) = (&sheet.joint, sheet.period_s, sheet.uncertain);
        let ratios = JointRatios::of(joint, sheet.lag_s);
        let tick = JointTick::of(&ratios, t);
        let model = Model::of(&ratios, &tick, t, sheet.delay_ticks);
        let unit = model.unit;
        let own = |joint: &Joint, lag_s: f64, angle: usize| {
            let spring = joint.weight_n_m / joint.link_inertia_kg_m2 * ANGLES[angle].cos();
            let plant = Plant::of(&JointRatios::of(joint, lag_s), [spring, 1.0 / joint.link_inertia_kg_m2], t, unit)?;
            Some(Corner { plant, angle, of_fast: false })
        };
        let angles = if joint.weight_n_m == 0.0 { 1 } else { ANGLES.len() };
        let nominal = (0..angles.min(2)).map(|k| Some(own(joint, sheet.lag_s, k)?.plant)).collect::<Option<_>>()?;
        // Corners of the weight only where there is one.
        let parameters = if joint.weight_n_m == 0.0 { 16 } else { 32 };
        let (mut corners, at) = (Vec::new(), angles.min(2) - 1);
        let spring = joint.weight_n_m / joint.link_inertia_kg_m2 * ANGLES[at].cos();
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
        // Of J_l, J_m, K, K_t: heavy and weak, light and strong, each with a soft and a stiff spring.
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
        Bandwidths { poles: [law / apart, law * apart], observers: [w, w * (shape.walk * link / motor).cbrt()] }
    }

    /// The lowest angle per tick at which |S| can have a peak.
    fn slow(&self, of: &Bandwidths) -> f64 {
        (0.1 * of.poles[0].min(of.observers[0]) * self.sheet.period_s).min(0.1)
    }

    /// Whether a design meets what is demanded by the data sheet: noise up to `noise`, |S| up to `peak`.
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
            .map(|k| Controller::of(&self.model, &gains, &law, gravity * ANGLES[k].cos()))
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

    /// Radius and peak of |S| in a corner.
    fn in_corner(&self, number: usize, gains: &Gains, slow: f64) -> [f64; 2] {
        let corner = &self.corners[number];
        let one = Loop::of(&corner.plant, &gains.controllers[corner.angle]);
        one.map_or([f64::INFINITY; 2], |one| {
            let radius = one.radius();
            [radius, if radius < STABLE { one.peak(slow) } else { f64::INFINITY }]
        })
    }

    /// Whether the active corners, or all, bear a design; the one that does not becomes active.
    fn borne(&mut self, gains: &Gains, slow: f64, peak: f64, (all, is_fast): (bool, bool)) -> Option<[f64; 2]> {
        let mut worst = [0.0_f64; 2];
        // What swings for longer than a hundred time constants of the loop is as good as unstable.
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

    /// The limit that a shape meets next above W.
    fn limit(&mut self, shape: &Shape, w: f64) -> Binding {
        let most = self.bounds()[1];
        let above = (1..).map(|k| w * 1.07_f64.powi(k)).take_while(|&w| w < most);
        above.into_iter().find_map(|w| self.feasible(shape, w, false).err()).unwrap_or(Binding::Period)
    }

    /// The largest feasible W of a shape, by steps down and then by bisection.
    fn largest(&mut self, shape: &Shape, way: &Way) -> Option<Found> {
        let (&Way { span: [low, high], halvings, hopeless, all, .. }, mut ratio) = (way, way.ratio);
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
            // The corner that was not active is now: a little lower it holds.
            ratio = ratio.min(1.15);
        }
    }

    /// Mean logarithm of dip and area, nominal and in corners; and both dips.
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
        // A corner beyond the tolerance may be unstable, but not for nothing.
        worst = [worst[0].min(10.0 * dip), worst[1].min(10.0 * area)];
        (0.25 * (dip * worst[0]).log10() + 0.25 * (area * t * worst[1] * t).log10(), [dip, worst[0]])
    }

    /// Whether there is a design in the table.
    fn exists(&mut self) -> bool {
        let way = Way { span: self.bounds(), ratio: COARSE, halvings: 0, hopeless: f64::INFINITY, all: true };
        table_of_shapes().any(|shape| self.largest(&shape, &way).is_some())
    }

    /// Bandwidths between which W is searched, rad/s.
    fn bounds(&self) -> [f64; 2] {
        [1e-4, 1.5].map(|of| of / self.sheet.period_s)
    }

    /// The best of the table, then down along each number of its shape; then with the fast set.
    fn best(&mut self) -> Option<JointRule> {
        let mut way = Way { span: self.bounds(), ratio: COARSE, halvings: 4, hopeless: f64::INFINITY, all: true };
        let mut table: Vec<Found> = Vec::new();
        for shape in table_of_shapes() {
            table.extend(self.largest(&shape, &way));
            way.hopeless = table.iter().map(|one| one.cost + HOPELESS).fold(f64::INFINITY, f64::min);
            // From then on the corners that matter are active.
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
            way = Way { ratio: FINE, hopeless: f64::INFINITY, all: true, ..way };
            let first = dense_table().find_map(|shape| self.largest(&shape, &way))?;
            found.extend(self.descended(&first.shape, first.w));
        }
        // A fast set needs room: the largest W need not be the best one.
        let mut best = None;
        for one in found {
            for by in [1.0, 0.8, 0.64, 0.5] {
                let span = [0.85 * by * one.w, by * one.w];
                let way = Way { span, ratio: 1.1, halvings: 0, hopeless: f64::INFINITY, all: true };
                let Some(slower) = self.largest(&one.shape, &way) else { continue };
                let (cost, fast) = self.fast(&slower);
                if best.as_ref().is_none_or(|(least, _, _)| cost < least - 1e-3) {
                    best = Some((cost, slower, fast));
                }
            }
        }
        best.map(|(_, one, fast)| self.rule(&one, fast))
    }

    /// The best shape in reach of steps along one number at a time, borne by all corners.
    fn descended(&mut self, shape: &Shape, w: f64) -> Option<Found> {
        let low = self.bounds()[0];
        let down = |w: f64| Way { span: [low, w], ratio: 1.1, halvings: 2, hopeless: f64::INFINITY, all: true };
        let mut best = self.largest(shape, &down(w))?;
        for _ in 0..2 {
            let ended = self.descent(best);
            let promised = ended.cost;
            let Some(borne) = self.largest(&ended.shape, &down(ended.w)) else {
                return self.largest(shape, &down(w));
            };
            best = borne;
            // A corner that was not active may have had more to say.
            if best.cost < promised + 0.01 {
                break;
            }
        }
        Some(best)
    }

    /// Steps along one number at a time, by the active corners.
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
                    let way = Way { span, ratio: 1.3, halvings: 3, hopeless: best.cost + 0.4, all: false };
                    match self.largest(&shape, &way) {
                        Some(found) if found.cost < best.cost - 3e-3 => best = found,
                        _ => break,
                    }
                }
            }
        }
        best
    }

    /// The design with its figures in all corners.
    fn rule(&mut self, best: &Found, mut fast: Option<FastSet>) -> JointRule {
        if let Some(set) = &mut fast {
            let [link, motor] = best.bandwidths.observers;
            let observers = [link * set.ratios[0], motor * set.ratios[1]];
            let of = Bandwidths { observers, ..best.bandwidths };
            set.calm_steps =
                self.nominally(&of, f64::INFINITY, FAST_PEAK).map_or([1.0; 2], |gains| self.calm_steps(&gains));
        }
        let slow = self.slow(&best.bandwidths);
        // Accepted in all corners before.
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

    /// The fast set with the least dips, if they are well below the quiet ones, still without its calm level; and the
    /// cost of both sets, in which the dips are the fast ones.
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
                return (quiet.cost + 0.25 * by.log10(), Some(set));
            }
        }
        (quiet.cost, None)
    }

    /// Three times the innovation that the loop makes of its own counts in any corner, at least one count.
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

/// Step of the first way down, and of a table that is dense.
const COARSE: f64 = 1.5;
const FINE: f64 = 1.25;

/// So many shapes of the table go on.
const DESCENTS: usize = 3;

/// A shape is given up if it is so much worse at the first W that is feasible.
const HOPELESS: f64 = 0.8;

/// The shapes to begin with; rigid shafts have two real poles from κ = 1 on.
fn table_of_shapes() -> impl Iterator<Item = Shape> {
    [0.1, 3.0, 0.5, 15.0, 0.02, 90.0].into_iter().flat_map(|walk| {
        [(0.7, 1.7), (2.0, 1.7), (0.35, 6.0), (0.7, 6.0), (2.0, 6.0), (0.35, 20.0), (2.0, 20.0)]
            .map(|(law, apart)| Shape { walk, law, apart })
    })
}

/// More of them, for joints that none of the table fits.
fn dense_table() -> impl Iterator<Item = Shape> {
    let walks = [0.2, 0.05, 1.0, 6.0, 0.01, 30.0, 250.0, 0.002, 1500.0];
    walks.into_iter().flat_map(|walk| {
        [0.2, 0.5, 1.0, 2.0, 5.0]
            .into_iter()
            .flat_map(move |law| [1.2, 3.0, 8.0, 25.0, 80.0].map(|apart| Shape { walk, law, apart }))
    })
}
