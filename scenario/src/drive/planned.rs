//! Duration of a motion within the limits of current and supply, and warnings for a reference beyond them.

use loop_sim::plant::Supply;
use loop_sim::port::drive::{Goal, Motion};

use super::build::{rounded, up};
use super::inertia::Inertia;
use crate::error::shown;

/// Longest transition onto a reference that is tried, s.
const LONGEST_S: f64 = 100.0;
/// Share of the current limit and of the supply that a plan may use.
const SHARE: f64 = 0.9;
/// Largest factor of a proposed current limit.
const MOST_TIMES: f64 = 1000.0;
/// Back-EMF up to which no supply is required, V. A lithium cell has more.
const ANY_SUPPLY_V: f64 = 3.0;

/// Motion with the allowed duration of its transition.
pub(super) struct PlanGoal {
    pub(super) motion: Motion,
    /// Smallest number of ticks, if the duration is computed. `None` if the file sets it.
    pub(super) fewest: Option<u32>,
}

/// Planned motion of a drive, and the largest speed of its reference, rad/s.
pub(super) struct Planned {
    pub(super) motion: Motion,
    pub(super) speed_rad_s: f64,
}

/// Largest values along a motion.
struct Peaks {
    current_a: f64,
    /// Share of the supply.
    share: f64,
    back_emf_v: f64,
    /// Speed of the motor, converted to the output side of the gear, rad/s.
    motor_rad_s: f64,
    reference_rad_s: f64,
}

/// Demand of a motion and limits of the drive.
#[derive(Clone, Copy)]
pub(super) struct PlanLimits<'a, const J: usize> {
    /// Name of the table of the data sheet.
    pub(super) plant: &'static str,
    pub(super) max_current_a: f64,
    /// Tolerance of K_t, percent.
    pub(super) uncertain_percent: f64,
    pub(super) inertia: Inertia,
    pub(super) supply: Option<Supply>,
    /// Returns the supply of the file for another `max_current_a`.
    pub(super) supply_of: &'a dyn Fn(f64) -> Option<Supply>,
    /// Torque constant K_t behind the gear, N m/A.
    pub(super) torque_n_m_per_a: f64,
    pub(super) gear: f64,
    /// Returns the current for a trajectory point by the data sheet, A.
    pub(super) feed_forward: &'a dyn Fn(&[f64; J]) -> f64,
    /// Returns the speed of the motor, converted to the output side of the gear, rad/s.
    pub(super) speed: &'a dyn Fn(&[f64; J]) -> f64,
    /// Speed limit `limits.max_speed_rad_s` of the reference, rad/s.
    pub(super) max_speed_rad_s: Option<f64>,
}

impl<const J: usize> PlanLimits<'_, J> {
    /// Returns 90 % of the current limit, derated for the weakest and heaviest motor within the tolerance. A plan that
    /// the true motor cannot follow ends with oscillations at the limits.
    fn within_a(&self) -> f64 {
        SHARE * self.max_current_a * (100.0 - self.uncertain_percent) / self.inertia.percent[1]
    }

    fn back_emf_v(&self, jet: &[f64; J]) -> f64 {
        self.torque_n_m_per_a * (self.speed)(jet)
    }

    /// Returns the share of the supply that a trajectory point needs by the data sheet; 0 without a supply.
    fn share(&self, jet: &[f64; J]) -> f64 {
        self.supply.map_or(0.0, |it| it.asked_v(self.back_emf_v(jet), (self.feed_forward)(jet)).abs() / it.volt)
    }

    /// Returns the share of the supply for the worst motor, with K_t and inertia at the ends of their tolerance.
    fn sure_share(&self, jet: &[f64; J]) -> f64 {
        let Some(supply) = self.supply else { return 0.0 };
        let (current, back_emf_v) = ((self.feed_forward)(jet), self.back_emf_v(jet));
        let off = self.uncertain_percent / 100.0;
        let of_inertia = self.inertia.percent.map(|percent| percent / 100.0);
        let shares = [1.0 - off, 1.0 + off].into_iter().flat_map(|torque| {
            of_inertia
                .map(|inertia| supply.asked_v(torque * back_emf_v, current * inertia / torque).abs() / supply.volt)
        });
        shares.fold(0.0, f64::max)
    }

    /// Returns the share of the speed limit; 0 without a limit.
    fn speed_share(&self, jet: &[f64; J]) -> f64 {
        self.max_speed_rad_s.map_or(0.0, |most| jet[1].abs() / most)
    }

    /// Returns the worst demand of a trajectory point as a current, to compare with [`within_a`](Self::within_a).
    fn surely_a(&self, jet: &[f64; J]) -> f64 {
        let share = self.sure_share(jet).max(self.speed_share(jet)) / SHARE;
        (self.feed_forward)(jet).abs().max(self.within_a() * share)
    }

    fn peaks<const P: usize>(&self, motion: &Motion, last: u32) -> Peaks {
        let of = |jet: &[f64; J]| {
            [(self.feed_forward)(jet), self.share(jet), self.back_emf_v(jet), (self.speed)(jet), jet[1]]
        };
        let [current_a, share, back_emf_v, motor_rad_s, reference_rad_s] = motion.peaks::<P, J, 5>(last, of);
        Peaks { current_a, share, back_emf_v, motor_rad_s, reference_rad_s }
    }

    /// Returns true if the nominal drive can follow the motion.
    fn suffices<const P: usize>(&self, motion: &Motion, last: u32) -> bool {
        over(&self.peaks::<P>(motion, last), self).is_empty()
    }
}

impl PlanGoal {
    /// Returns the motion with the shortest duration within current and supply. Otherwise a step, with a warning.
    pub(super) fn planned<const P: usize, const J: usize>(
        &self,
        asked: &PlanLimits<'_, J>,
        last: usize,
        warnings: &mut Vec<String>,
    ) -> Planned {
        let last = last as u32;
        let found = match self.fewest {
            Some(fewest) => self.shortest::<P, J>(fewest, asked),
            None => Some(self.motion.clone()),
        };
        let is_jump = found.is_none();
        let motion = found.unwrap_or_else(|| self.motion.clone());
        let peaks = asked.peaks::<P>(&motion, last);
        if is_jump {
            warnings.push(self.jump::<P, J>(asked, last));
        } else {
            warnings.extend(unjustified(&motion, &peaks, asked).filter(|_| self.fewest.is_some()));
            warnings.extend(self.beyond::<P, J>(&peaks, asked, last));
        }
        Planned { motion, speed_rad_s: peaks.reference_rad_s }
    }

    /// Returns the longest transition that is tried, in ticks.
    fn most(&self) -> u32 {
        (LONGEST_S / self.motion.period_s) as u32
    }

    fn shortest<const P: usize, const J: usize>(&self, fewest: u32, asked: &PlanLimits<'_, J>) -> Option<Motion> {
        self.motion.shortest::<P, J>([fewest, self.most().max(fewest)], asked.within_a(), |jet| asked.surely_a(jet))
    }

    /// Returns the smallest peak of a quantity over the transitions that [`shortest`](Self::shortest) tries. The
    /// slowest transition is not always the easiest.
    fn easiest<const P: usize, const J: usize>(&self, of: impl Fn(&[f64; J]) -> f64) -> f64 {
        const POINTS: u64 = 64;
        let start = self.motion.start;
        let peak = |ticks: u32| {
            let jets = Motion { ticks, ..self.motion.clone() }.jets::<P, J>();
            let at = |i: u64| start.saturating_add((u64::from(ticks) * i / POINTS) as u32);
            (0..POINTS).map(|i| of(&jets(at(i))).abs()).fold(0.0, f64::max)
        };
        let first = self.fewest.unwrap_or(1).max(20);
        let durations = std::iter::successors(Some(first), |ticks| ticks.checked_add(ticks / 4));
        durations.take_while(|ticks| *ticks <= self.most()).map(peak).fold(f64::INFINITY, f64::min)
    }

    /// Returns a larger current limit for the reference. `None` if the supply does not reach it.
    fn stronger<const P: usize, const J: usize>(
        &self,
        asked: &PlanLimits<'_, J>,
        least_a: f64,
        last: u32,
    ) -> Option<String> {
        let enough = up(1.01 * least_a * asked.max_current_a / asked.within_a());
        let stronger = PlanLimits { max_current_a: enough, supply: (asked.supply_of)(enough), ..*asked };
        let is_motor = enough <= MOST_TIMES * asked.max_current_a;
        let is_driven = stronger.supply.is_none_or(|Supply { volt, ohm }| volt / ohm >= 0.999 * enough);
        let motion = self.shortest::<P, J>(self.fewest.unwrap_or(1), &stronger).filter(|_| is_motor && is_driven)?;
        let is_enough = stronger.suffices::<P>(&motion, last);
        is_enough.then(|| format!("{}.max_current_a = {} is enough", asked.plant, shown(enough)))
    }

    /// Returns the warning for a reference without a valid transition.
    fn jump<const P: usize, const J: usize>(&self, asked: &PlanLimits<'_, J>, last: u32) -> String {
        let (within_a, max_current_a) = (asked.within_a(), asked.max_current_a);
        let least_a = self.easiest::<P, J>(asked.feed_forward);
        let share = self.easiest::<P, J>(|jet| asked.sure_share(jet));
        let mut takes = Vec::new();
        let mut stronger = None;
        if least_a > within_a {
            takes.push(format!("{} A", shown(rounded(least_a))));
            stronger = self.stronger::<P, J>(asked, least_a, last);
        }
        if let Some(supply) = asked.supply.filter(|_| share > SHARE) {
            takes.push(format!(
                "{} V of the {} V of the supply",
                shown(rounded(share * supply.volt)),
                shown(rounded(supply.volt))
            ));
        }
        let remedies: Vec<String> = stronger.into_iter().chain(self.slower::<P, J>(asked, last, &[])).collect();
        let takes = takes.join(" and ");
        let easiest = format!("the easiest transition of up to {LONGEST_S} s needs {takes}: ");
        let takes = if takes.is_empty() { takes } else { easiest };
        let remedy = match remedies.as_slice() {
            [] if takes.is_empty() => "give reference.duration_s".into(),
            [] => "take a nearer or slower goal".into(),
            remedies => remedies.join(", or "),
        };
        let of_supply = asked.supply.map_or_else(String::new, |it| format!(" and of {} V", shown(rounded(it.volt))));
        format!(
            "the reference starts with a step: no transition stays within {} A (90 % of {} A{of_supply}, derated for \
             uncertain_percent = {}); {takes}{remedy}",
            shown(rounded(within_a)),
            shown(max_current_a),
            shown(asked.uncertain_percent)
        )
    }

    /// Returns a warning for a motion beyond the limits, with a remedy.
    fn beyond<const P: usize, const J: usize>(
        &self,
        peaks: &Peaks,
        asked: &PlanLimits<'_, J>,
        last: u32,
    ) -> Option<String> {
        let over = over(peaks, asked);
        if over.is_empty() {
            return None;
        }
        // Set-points have no duration.
        let is_profile = matches!(self.motion.goal, Goal::SetPoints { .. });
        let longer = || {
            let motion = self.shortest::<P, J>(1, asked).filter(|it| asked.suffices::<P>(it, last))?;
            let duration_s = up(f64::from(motion.ticks) * motion.period_s);
            Some(format!("reference.duration_s = {} is long enough", shown(duration_s)))
        };
        let longer = if is_profile || self.fewest.is_some() { None } else { longer() };
        // The current limits the acceleration, the supply limits the speed.
        let is_fast = peaks.share > 1.0 || asked.max_speed_rad_s.is_some_and(|most| peaks.reference_rad_s > most);
        let alone: &[Slowed] = match (is_profile, peaks.current_a > asked.max_current_a, is_fast) {
            (true, true, false) => &[Slowed::Acceleration, Slowed::Speed],
            (true, false, true) => &[Slowed::Speed, Slowed::Acceleration],
            _ => &[],
        };
        let slows = is_profile || asked.supply.is_some() || asked.max_speed_rad_s.is_some();
        let remedy = longer.or_else(|| if slows { self.slower::<P, J>(asked, last, alone) } else { None });
        let remedy = remedy.map_or_else(String::new, |remedy| format!("; {remedy}"));
        Some(format!("the reference needs up to {}: the drive will not follow it{remedy}", over.join(", ")))
    }

    /// Returns the goal slowed to this share in these limits, with its keys.
    fn slowed(&self, share: f64, limits: Slowed) -> Option<(Self, String)> {
        let mut goal = self.motion.goal.clone();
        let key = slow(&mut goal, share, self.motion.period_s, limits)?;
        Some((Self { motion: Motion { goal, ..self.motion.clone() }, fewest: self.fewest }, key))
    }

    /// Returns the key for the largest share of the goal within the limits. `None` if a slower goal does not help. The
    /// limits in `alone` are tried first, each accepted from half of that share on.
    fn slower<const P: usize, const J: usize>(
        &self,
        asked: &PlanLimits<'_, J>,
        last: u32,
        alone: &[Slowed],
    ) -> Option<String> {
        let is_enough = |share: f64, limits: Slowed| {
            let Some((wanted, _)) = self.slowed(share, limits) else { return false };
            let motion =
                wanted.fewest.map_or_else(|| Some(wanted.motion.clone()), |it| wanted.shortest::<P, J>(it, asked));
            motion.is_some_and(|motion| asked.suffices::<P>(&motion, last))
        };
        let largest = |least: f64, limits: Slowed| {
            let (mut low, mut high) = (least, 1.0);
            if !is_enough(low, limits) {
                return None;
            }
            for _ in 0..10 {
                let middle = 0.5 * (low + high);
                if is_enough(middle, limits) { low = middle } else { high = middle }
            }
            Some((low, limits))
        };
        let all = largest(1e-3, Slowed::All)?;
        let alone = alone.iter().find_map(|limits| largest((0.5 * all.0).max(1e-3), *limits));
        let (share, limits) = alone.unwrap_or(all);
        self.slowed(share, limits).map(|(_, key)| format!("{key} is within the limits"))
    }
}

/// Limits of a goal that are lowered. Only set-points have more than one.
#[derive(Clone, Copy)]
enum Slowed {
    All,
    Acceleration,
    Speed,
}

/// Slows a goal down, in numbers of three digits rounded down. Returns the key with its value.
fn slow(goal: &mut Goal, share: f64, period_s: f64, slowed: Slowed) -> Option<String> {
    let down = |value: f64| format!("{:.2e}", 0.995 * value).parse::<f64>().ok();
    match goal {
        Goal::Rest { .. } => None,
        Goal::Sine { amplitude_rad, .. } => {
            *amplitude_rad = down(share * *amplitude_rad)?;
            Some(format!("reference.amplitude_rad = {}", shown(*amplitude_rad)))
        }
        Goal::Speed { speed_rad_s } => {
            *speed_rad_s = down(share * *speed_rad_s)?;
            Some(format!("reference.speed_rad_s = {}", shown(*speed_rad_s)))
        }
        Goal::Points { every, .. } => {
            *every = (f64::from(*every) / share).ceil() as u32;
            Some(format!("reference.every_s = {}", shown(ticks_s(*every, period_s))))
        }
        Goal::SetPoints { limits, .. } => {
            let mut lines = Vec::new();
            if !matches!(slowed, Slowed::Speed) {
                limits.acceleration_rad_s2 = down(share * limits.acceleration_rad_s2)?;
                lines.push(format!("reference.max_acceleration_rad_s2 = {}", shown(limits.acceleration_rad_s2)));
            }
            if !matches!(slowed, Slowed::Acceleration) {
                limits.speed_rad_s = down(share * limits.speed_rad_s)?;
                lines.push(format!("reference.max_speed_rad_s = {}", shown(limits.speed_rad_s)));
            }
            Some(lines.join(" with "))
        }
    }
}

/// Returns the time of a whole number of ticks, in as few digits as possible.
pub(super) fn ticks_s(ticks: u32, period_s: f64) -> f64 {
    let time_s = f64::from(ticks) * period_s;
    let short = (3..16).filter_map(|digits| format!("{time_s:.digits$e}").parse::<f64>().ok());
    short.into_iter().find(|it| (it / period_s - f64::from(ticks)).abs() < 1e-7).unwrap_or(time_s)
}

/// Returns the demands of a motion that exceed the nominal drive, in words.
fn over<const J: usize>(peaks: &Peaks, asked: &PlanLimits<'_, J>) -> Vec<String> {
    let mut words = Vec::new();
    if peaks.current_a > asked.max_current_a {
        let [current, limit] = [rounded(peaks.current_a), asked.max_current_a].map(shown);
        words.push(format!("{current} A, the limit is {limit} A"));
    }
    if let Some(supply) = asked.supply.filter(|_| peaks.share > 1.0) {
        words.push(format!(
            "{} V at speeds of up to {} rad/s of the motor, the supply has {} V (no-load speed {} rad/s)",
            shown(rounded(peaks.share * supply.volt)),
            shown(rounded(asked.gear * peaks.motor_rad_s)),
            shown(rounded(supply.volt)),
            shown(rounded(asked.gear * supply.volt / asked.torque_n_m_per_a))
        ));
    }
    let fastest = peaks.reference_rad_s;
    if let Some(most) = asked.max_speed_rad_s.filter(|most| fastest > *most) {
        words.push(format!("{} rad/s, limits.max_speed_rad_s is {}", shown(rounded(fastest)), shown(most)));
    }
    words
}

/// Returns a warning for a move whose duration follows from the current alone, so that its speed may exceed the supply.
/// All other goals, and moves with a duration, have a speed set by the file. Below a back-EMF of [`ANY_SUPPLY_V`] there
/// is no warning.
fn unjustified<const J: usize>(motion: &Motion, peaks: &Peaks, asked: &PlanLimits<'_, J>) -> Option<String> {
    let is_found = matches!(motion.goal, Goal::Rest { .. }) && asked.supply.is_none();
    (is_found && peaks.back_emf_v > ANY_SUPPLY_V).then(|| {
        let plant = asked.plant;
        format!(
            "{plant}.supply_v is not given: the duration follows from the current alone, and the move needs {} rad/s \
             of the motor, {} V of back-EMF; give {plant}.supply_v and {plant}.resistance_ohm, or \
             {plant}.no_load_rad_s, or reference.duration_s",
            shown(rounded(asked.gear * peaks.motor_rad_s)),
            shown(rounded(peaks.back_emf_v))
        )
    })
}
