//! Backlash between a motor and its load: the simulated shaft, and the bandwidth without a limit cycle.
//!
//! With the encoder behind the gear the loop contains the backlash. Inside the gap the drive moves the motor alone and
//! measures a free load, so too much bandwidth causes a limit cycle from flank to flank. The limit has no formula here.
//! The drive is simulated on its data sheet without friction, starts with a speed, and is observed at rest.
//!
//! With the encoder on the motor, the motor turns without its load while the flanks are apart. The loop gain then grows
//! by the ratio of both inertias to the inertia of the motor. A loop that is unstable there swings from flank to flank
//! while it moves. The linear loop with the motor alone tells this beforehand.

use std::cell::RefCell;
use std::ops::ControlFlow;

use controller_core::Health;
use controller_core::drive::{MotorBandwidths, MotorDesign};
use loop_sim::actuator::{Delayed, Ideal};
use loop_sim::closed_loop::{Loop, close_loop};
use loop_sim::plant::{Imperfections, JointBody, Loose, Plant as _, Shaft};
use loop_sim::port::drive::{DriveDesign, Follows, Motion};
use loop_sim::sensor::encoder::Encoders;
use loop_sim::signal::Signal;
use loop_sim::trace::{Ending, Row};

use super::build::rounded;
use super::margin::motor_peak;
use super::{MotorTable, NumberOrRange};
use crate::error::shown;
use crate::resolve::{Problem, Problems};

/// Default resonance of load and motor on the flanks, rad/s, and their damping ratio.
const FLANKS_RAD_S: f64 = 471.0;
const FLANKS_DAMPING: f64 = 0.06;
/// Shares of the bandwidths by rule that are tried.
const SHARES: [f64; 10] = [1.0, 0.84, 0.7, 0.6, 0.5, 0.42, 0.35, 0.25, 0.17, 0.12];
const LEAST_SHARE: f64 = SHARES[SHARES.len() - 1];
/// Largest standard deviation of the current at rest, as a share of its limit, without a limit cycle.
const QUIET: f64 = 0.03;
/// Inertia of the motor alone, as a share of the data sheet, at which a loop must be stable.
const LIGHT: f64 = 0.9;
/// Simulated time in time constants of the observer, the first half to settle, and its limit in ticks.
const WATCHED: f64 = 240.0;
const MOST_TICKS: usize = 4000;
/// Lowest resonance of realistic flanks, rad/s, and the highest one in rad per tick. A faster one makes no difference
/// to the loop and costs many solver steps.
const SOFTEST_RAD_S: f64 = 10.0;
const HARDEST_RAD: f64 = 20.0;

/// Backlash of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Play {
    rad: f64,
    /// True if the encoder is behind the backlash.
    is_behind: bool,
    /// Share of the inertia behind the backlash.
    load_share: f64,
    stiffness_n_m: f64,
    /// Cached shares of the rule, by period.
    found: RefCell<Vec<(f64, Option<f64>)>>,
}

impl Play {
    /// Returns the backlash of a file. `None` without backlash.
    pub(super) fn of(
        sheet: &MotorTable,
        (gear, period_s): (f64, f64),
        is_behind: bool,
        problems: &mut Problems,
    ) -> Option<Self> {
        let mut wrong = |key: &str, message: &str| {
            problems.0.push(Problem { key: format!("motor.{key}"), message: message.into() });
        };
        if sheet.play_rad == 0.0 {
            if sheet.gear_stiffness_n_m.is_some() {
                wrong("gear_stiffness_n_m", "only with play_rad above 0: a gear without backlash is modelled as rigid");
            }
            return None;
        }
        let load = sheet.load_inertia_kg_m2.middle();
        let rotor = sheet.inertia_kg_m2.map_or(1.0, NumberOrRange::middle);
        if load.is_nan() || load <= 0.0 {
            wrong("play_rad", "needs motor.load_inertia_kg_m2, the inertia behind the backlash");
            return None;
        }
        let driving = gear * gear * rotor;
        let reduced = load * driving / (load + driving);
        let range = [SOFTEST_RAD_S, HARDEST_RAD / period_s].map(|swing| reduced * swing * swing);
        if let Some(given) = sheet.gear_stiffness_n_m.filter(|given| !(range[0]..=range[1]).contains(given)) {
            let [given, low, high] = [given, rounded(range[0]), rounded(range[1])].map(shown);
            wrong(
                "gear_stiffness_n_m",
                &format!(
                    "found {given}, expected {low} to {high}: a softer gear is unrealistic, and a stiffer one makes no \
                     difference at this period"
                ),
            );
        }
        let load_share = load / (load + driving);
        let stiffness_n_m = sheet.gear_stiffness_n_m.unwrap_or(range[1].min(reduced * FLANKS_RAD_S * FLANKS_RAD_S));
        Some(Self { rad: sheet.play_rad, is_behind, load_share, stiffness_n_m, found: RefCell::default() })
    }

    /// Returns the index of the state that the encoder measures.
    pub(super) const fn encoder_state(&self) -> usize {
        if self.is_behind { 0 } else { 2 }
    }

    /// Returns the simulated motor with the true shaft and the nominal shaft of the controller's model.
    pub(super) fn plant(&self, truth: Shaft, believed: Shaft, imperfections: Imperfections, load: Signal) -> Loose {
        let whole = truth.inertia_kg_m2;
        let [hanging, driving] = [self.load_share, 1.0 - self.load_share].map(|share| share * whole);
        let reduced = hanging * driving / whole;
        let stiffness_n_m = self.stiffness_n_m;
        let body = JointBody {
            link_inertia_kg_m2: hanging,
            link_damping_n_m_s: 0.0,
            weight_n_m: 0.0,
            stiffness_n_m,
            spring_damping_n_m_s: 2.0 * FLANKS_DAMPING * (stiffness_n_m * reduced).sqrt(),
            motor: Shaft { inertia_kg_m2: driving, ..truth },
        };
        Loose::new(body, self.rad, believed, imperfections, load)
    }

    /// Returns the number of gain sets by rule, 1 with the encoder behind backlash: high gains limit-cycle first.
    pub(super) fn gain_sets(play: Option<&Self>) -> Option<usize> {
        play.filter(|play| play.is_behind).map(|_| 1)
    }
}

/// Drive with its backlash, for the simulation.
pub(super) struct InPlay<'a> {
    pub(super) play: Option<&'a Play>,
    pub(super) follows: Follows,
    /// True if the file sets a bandwidth, which is then kept.
    pub(super) is_given: bool,
    pub(super) drive_of: &'a dyn Fn(&MotorDesign) -> DriveDesign,
    /// Shaft by the data sheet.
    pub(super) shaft: Shaft,
    pub(super) lag: Imperfections,
    /// Designs to try if the motor alone is unstable, each with the keys to set.
    pub(super) others: &'a [(&'static str, MotorDesign)],
}

impl InPlay<'_> {
    /// Returns the backlash, if it is inside a position loop.
    fn within(&self) -> Option<&Play> {
        self.play.filter(|play| play.is_behind && self.follows == Follows::Position)
    }

    /// Returns the largest share of the bandwidths by rule without a limit cycle. `None` if all shares have one.
    pub(super) fn allowed(&self, by_rule: &MotorDesign) -> Option<f64> {
        let Some(play) = self.within().filter(|_| !self.is_given) else { return Some(1.0) };
        let known = play.found.borrow().iter().find(|(period_s, _)| *period_s == by_rule.period_s).copied();
        if let Some((_, share)) = known {
            return share;
        }
        let rests = |share: &f64| self.swing(play, &by_rule.slowed(*share)).is_some_and(|swing| swing <= QUIET);
        let share = SHARES.into_iter().find(rests);
        play.found.borrow_mut().push((by_rule.period_s, share));
        share
    }

    /// Returns the design with the largest bandwidth without a limit cycle.
    pub(super) fn slowed(&self, by_rule: MotorDesign) -> MotorDesign {
        by_rule.slowed(self.allowed(&by_rule).unwrap_or(LEAST_SHARE))
    }

    /// Returns true if both gain sets are stable while the motor turns without its load.
    fn stands_alone(&self, play: &Play, design: &MotorDesign) -> bool {
        let inertia_kg_m2 = LIGHT * (1.0 - play.load_share) * self.shaft.inertia_kg_m2;
        let alone = Shaft { inertia_kg_m2, ..self.shaft };
        let MotorBandwidths { observer_rad_s, .. } = design.bandwidths;
        [1.0, design.fast_ratio].into_iter().all(|ratio| {
            let observer_rad_s = ratio * observer_rad_s;
            let set = design.with_bandwidths(MotorBandwidths { observer_rad_s, ..design.bandwidths });
            motor_peak(&(self.drive_of)(&set), alone, self.lag).is_some()
        })
    }

    /// Returns a warning if the drive is unstable while the motor turns without its load.
    fn too_light(&self, play: &Play, design: &MotorDesign) -> Option<String> {
        if self.stands_alone(play, design) {
            return None;
        }
        let ratio = shown(rounded(1.0 / (1.0 - play.load_share)));
        let stable = self.others.iter().find(|(_, other)| self.stands_alone(play, other));
        let remedy =
            stable.map_or("an encoder behind the gear (encoder.behind_gear = true) avoids this", |(keys, _)| keys);
        let verb = if stable.is_some() { ": it is stable with " } else { "; " };
        Some(format!(
            "between the flanks of the play the motor turns without its load, {ratio} times lighter. This drive is \
             unstable there and may swing from flank to flank while it moves{verb}{remedy}"
        ))
    }

    /// Returns a warning if backlash lowers the bandwidth by rule, or if a bandwidth of the file limit-cycles.
    pub(super) fn warning(&self, by_rule: &MotorDesign) -> Option<String> {
        if let Some(play) = self.play.filter(|play| !play.is_behind) {
            return self.too_light(play, by_rule);
        }
        let play = self.within()?;
        let on_motor = "an encoder on the motor (encoder.behind_gear = false) avoids this; the load position is then \
                        known to within the backlash";
        let stands =
            [by_rule].into_iter().chain(self.others.iter().map(|(_, it)| it)).any(|it| self.stands_alone(play, it));
        let remedy = if stands { on_motor } else { "a motor with more inertia, or less play, allows more" };
        let w_c = by_rule.bandwidths.surface_rad_s;
        let [rad, all, least] = [play.rad, rounded(w_c), rounded(LEAST_SHARE * w_c)].map(shown);
        if self.is_given {
            let swing = self.swing(play, by_rule).unwrap_or(1.0);
            return (swing > QUIET).then(|| {
                format!(
                    "with a backlash of {rad} rad this drive limit-cycles at rest, with {:.0} % of its current (rms): \
                     take drive.surface_rad_s below {all}; {remedy}",
                    100.0 * swing
                )
            });
        }
        match self.allowed(by_rule) {
            Some(share) if share < 1.0 => Some(format!(
                "the backlash of {rad} rad behind the gear limits the position bandwidth to {} rad/s ({all} by rule), \
                 above which the drive limit-cycles at rest; {remedy}",
                shown(rounded(share * w_c))
            )),
            Some(_) => None,
            None => Some(format!(
                "with a backlash of {rad} rad this drive limit-cycles even at a position bandwidth of {least} rad/s; \
                 {remedy}"
            )),
        }
    }

    /// Returns the standard deviation of the current at rest, as a share of its limit. It is the larger of this shaft
    /// and a shaft with 1.5 times the acceleration. `None` if the loop is invalid.
    fn swing(&self, play: &Play, design: &MotorDesign) -> Option<f64> {
        let Shaft { inertia_kg_m2, torque_n_m_per_a, .. } = self.shaft;
        let agile =
            Shaft { inertia_kg_m2: 0.8 * inertia_kg_m2, torque_n_m_per_a: 1.2 * torque_n_m_per_a, ..self.shaft };
        let designed = (self.drive_of)(design);
        let [nominal, agile] = [self.shaft, agile]
            .map(|truth| swing(&designed, &play.plant(truth, self.shaft, self.lag, Signal::default()), design));
        Some(nominal?.max(agile?))
    }
}

/// Returns the standard deviation of u at rest after an initial speed, as a share of its limit.
fn swing(designed: &DriveDesign, plant: &Loose, design: &MotorDesign) -> Option<f64> {
    let designed = designed.telling().without_rest_band();
    let (period_s, omega) = (design.period_s, design.bandwidths.observer_rad_s);
    let limit = designed.max_current_a();
    let mut port = designed.port(&Motion::rest(0.0, period_s)).ok()?;
    let periods = ((WATCHED / (omega * period_s)) as usize).clamp(200, MOST_TICKS);
    // Speed after a quarter of the torque for one time constant of the observer.
    let push = 0.25 * limit * design.motor.input_gain().abs() / omega;
    let mut x0 = vec![0.0; plant.order()];
    (x0[1], x0[3]) = (push, push);
    let mut sums = [0.0; 3];
    let mut recorder = |row: &Row| {
        if row.health.contains(Health::STOPPED) {
            return ControlFlow::Break(());
        }
        if 2.0 * row.t_s > periods as f64 * period_s {
            sums = [sums[0] + 1.0, sums[1] + row.u, sums[2] + row.u * row.u];
        }
        ControlFlow::Continue(())
    };
    let setup = Loop {
        plant,
        sensor: &mut Encoders::new(designed.encoders()),
        port: port.as_mut(),
        actuator: &mut Delayed::new(Box::new(Ideal), designed.form().delay_ticks),
        report: true,
        missed: &[],
        x0: &x0,
        period_s,
        periods,
    };
    let ending = close_loop(setup, &mut recorder).ok()?;
    if ending != Ending::Finished {
        return Some(1.0);
    }
    let [count, sum, square] = sums;
    let mean = sum / count;
    (count > 0.0).then(|| (square / count - mean * mean).max(0.0).sqrt() / limit)
}
