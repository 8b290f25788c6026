//! How long a motion takes: what current and supply surely allow, and what a file is told that asks for more.

use loop_sim::plant::Supply;
use loop_sim::port::drive::{Goal, Motion};

use super::build::rounded;
use super::inertia::Inertia;
use crate::error::shown;

/// The longest way onto a reference that is looked for, s.
const LONGEST_S: f64 = 100.0;
/// Share of the largest current, and of the supply, that a motion is planned with.
const SHARE: f64 = 0.9;
/// Back-EMF up to which no supply is asked for, V: a cell of lithium has more.
const ANY_SUPPLY_V: f64 = 3.0;

/// A motion, and how long the way onto the reference may be.
pub(super) struct Wanted {
    pub(super) motion: Motion,
    /// The least ticks, if the number is to be found.
    pub(super) fewest: Option<u32>,
}

/// What a motion asks of a drive, and how much there is.
pub(super) struct Asked<'a, const J: usize> {
    /// The table of its data sheet.
    pub(super) plant: &'static str,
    pub(super) max_current_a: f64,
    /// Of K_t, and of what the inertia may be.
    pub(super) uncertain_percent: f64,
    pub(super) inertia: Inertia,
    pub(super) supply: Option<Supply>,
    /// K_t behind the gear, and its ratio.
    pub(super) torque_n_m_per_a: f64,
    pub(super) gear: f64,
    /// Current of a jet by the data sheet, A.
    pub(super) feed_forward: &'a dyn Fn(&[f64; J]) -> f64,
    /// Speed of the motor behind the gear, rad/s.
    pub(super) speed: &'a dyn Fn(&[f64; J]) -> f64,
    /// `limits.max_speed_rad_s`, of what is told where to be.
    pub(super) max_speed_rad_s: Option<f64>,
}

impl<const J: usize> Asked<'_, J> {
    /// 90 % of the limit, for a motor as weak and heavy as it may be. A plan that the true motor cannot follow ends in
    /// ringing at the limits.
    fn within_a(&self) -> f64 {
        SHARE * self.max_current_a * (100.0 - self.uncertain_percent) / self.inertia.percent[1]
    }

    fn back_emf_v(&self, jet: &[f64; J]) -> f64 {
        self.torque_n_m_per_a * (self.speed)(jet)
    }

    /// Share of the supply that a jet takes of the motor of the data sheet; 0 without a supply.
    fn share(&self, jet: &[f64; J]) -> f64 {
        self.supply.map_or(0.0, |it| it.asked_v(self.back_emf_v(jet), (self.feed_forward)(jet)).abs() / it.volt)
    }

    /// The same of the worst motor that may be: K_t and inertia each as far off as they may be.
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

    /// Share of the top speed, of which all may be used but what the loop overshoots by.
    fn speed_share(&self, jet: &[f64; J]) -> f64 {
        self.max_speed_rad_s.map_or(0.0, |most| jet[1].abs() / most)
    }

    /// What a jet surely takes, as a current of which there are [`within_a`](Self::within_a).
    fn surely_a(&self, jet: &[f64; J]) -> f64 {
        let share = self.sure_share(jet).max(self.speed_share(jet)) / SHARE;
        (self.feed_forward)(jet).abs().max(self.within_a() * share)
    }
}

impl Wanted {
    /// The motion with the shortest duration that current and supply surely allow; else as a jump, with a warning.
    pub(super) fn planned<const P: usize, const J: usize>(
        &self,
        asked: &Asked<'_, J>,
        last: usize,
        warnings: &mut Vec<String>,
    ) -> Motion {
        let last = last as u32;
        let Some(fewest) = self.fewest else {
            let remedy = || {
                let motion = self.shortest::<P, J>(1, asked).filter(|it| over::<P, J>(it, asked, last).is_empty())?;
                let duration_s = f64::from(motion.ticks) * motion.period_s;
                Some(format!("reference.duration_s = {} is long enough", shown(rounded(duration_s))))
            };
            return self.warned_of::<P, J>(self.motion.clone(), asked, last, remedy, warnings);
        };
        let Some(motion) = self.shortest::<P, J>(fewest, asked) else {
            warnings.push(self.jump::<P, J>(asked, last));
            return self.motion.clone();
        };
        warnings.extend(unjustified::<P, J>(&motion, asked, last));
        self.warned_of::<P, J>(motion, asked, last, || None, warnings)
    }

    /// The longest way that is looked for, in ticks.
    fn most(&self) -> u32 {
        (LONGEST_S / self.motion.period_s) as u32
    }

    fn shortest<const P: usize, const J: usize>(&self, fewest: u32, asked: &Asked<'_, J>) -> Option<Motion> {
        self.motion.shortest::<P, J>([fewest, self.most().max(fewest)], asked.within_a(), |jet| asked.surely_a(jet))
    }

    /// The largest of something along the slowest way.
    fn slowest<const P: usize, const J: usize>(&self, of: impl Fn(&[f64; J]) -> f64) -> f64 {
        const POINTS: u64 = 64;
        let ticks = self.most();
        let jets = Motion { ticks, ..self.motion.clone() }.jets::<P, J>();
        let at = |i: u64| self.motion.start.saturating_add((u64::from(ticks) * i / POINTS) as u32);
        (0..=POINTS).map(|i| of(&jets(at(i))).abs()).fold(0.0, f64::max)
    }

    /// What is said of a reference that no way leads onto.
    fn jump<const P: usize, const J: usize>(&self, asked: &Asked<'_, J>, last: u32) -> String {
        let (within_a, max_current_a) = (asked.within_a(), asked.max_current_a);
        let least_a = self.slowest::<P, J>(asked.feed_forward);
        let share = self.slowest::<P, J>(|jet| asked.sure_share(jet));
        let slower = || self.slower::<P, J>(asked, last).unwrap_or_else(|| "a nearer or slower goal".into());
        let remedy = if least_a > within_a {
            let enough = shown(rounded(1.01 * least_a * max_current_a / within_a));
            format!(
                "even in {LONGEST_S} s it takes {} A; max_current_a = {enough} is enough, or a nearer or slower goal",
                shown(rounded(least_a))
            )
        } else if let Some(supply) = asked.supply.filter(|_| share > SHARE) {
            format!(
                "even in {LONGEST_S} s it takes up to {} V of the {} V of the supply: {}",
                shown(rounded(share * supply.volt)),
                shown(rounded(supply.volt)),
                slower()
            )
        } else {
            "give reference.duration_s".into()
        };
        let of_supply =
            asked.supply.map_or_else(String::new, |it| format!(" and 90 % of the {} V", shown(rounded(it.volt))));
        format!(
            "the reference begins with a jump: no way onto it stays within {} A, 90 % of the {} A{of_supply} for a \
             plant as weak and heavy as drive.uncertain_percent = {} allows; {remedy}",
            shown(rounded(within_a)),
            shown(max_current_a),
            shown(asked.uncertain_percent)
        )
    }

    /// The motion, if it needs more than there is with a warning.
    fn warned_of<const P: usize, const J: usize>(
        &self,
        motion: Motion,
        asked: &Asked<'_, J>,
        last: u32,
        longer: impl Fn() -> Option<String>,
        warnings: &mut Vec<String>,
    ) -> Motion {
        let over = over::<P, J>(&motion, asked, last);
        if !over.is_empty() {
            // Set-points take no duration.
            let is_profile = matches!(motion.goal, Goal::SetPoints { .. });
            let longer = if is_profile { None } else { longer() };
            let slows = is_profile || asked.supply.is_some() || asked.max_speed_rad_s.is_some();
            let remedy = longer.or_else(|| if slows { self.slower::<P, J>(asked, last) } else { None });
            let remedy = remedy.map_or_else(String::new, |remedy| format!("; {remedy}"));
            warnings.push(format!("the reference asks for up to {}: it will not be followed{remedy}", over.join(", ")));
        }
        motion
    }

    /// The largest share of the goal that there is enough for, as a key; none where the goal is not what is too much.
    fn slower<const P: usize, const J: usize>(&self, asked: &Asked<'_, J>, last: u32) -> Option<String> {
        let slowed = |share: f64| {
            let mut goal = self.motion.goal.clone();
            let key = slow(&mut goal, share, self.motion.period_s)?;
            Some((Self { motion: Motion { goal, ..self.motion.clone() }, fewest: self.fewest }, key))
        };
        let is_enough = |share: f64| {
            let Some((wanted, _)) = slowed(share) else { return false };
            let motion =
                wanted.fewest.map_or_else(|| Some(wanted.motion.clone()), |it| wanted.shortest::<P, J>(it, asked));
            motion.is_some_and(|motion| over::<P, J>(&motion, asked, last).is_empty())
        };
        let (mut low, mut high) = (1e-3, 1.0);
        if !is_enough(low) {
            return None;
        }
        for _ in 0..10 {
            let middle = 0.5 * (low + high);
            if is_enough(middle) { low = middle } else { high = middle }
        }
        slowed(low).map(|(_, key)| format!("{key} is within it"))
    }
}

/// Makes a goal slower, in numbers of three digits that are no larger than asked for; returns the line of the file.
fn slow(goal: &mut Goal, share: f64, period_s: f64) -> Option<String> {
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
            Some(format!("reference.every_s = {}", shown(rounded(f64::from(*every) * period_s))))
        }
        Goal::SetPoints { limits, .. } => {
            limits.speed_rad_s = down(share * limits.speed_rad_s)?;
            limits.acceleration_rad_s2 = down(share * limits.acceleration_rad_s2)?;
            let [speed, acceleration] = [limits.speed_rad_s, limits.acceleration_rad_s2].map(shown);
            Some(format!("reference.max_acceleration_rad_s2 = {acceleration} with reference.max_speed_rad_s = {speed}"))
        }
    }
}

/// Where a motion asks the motor of the data sheet for more than there is, in words.
fn over<const P: usize, const J: usize>(motion: &Motion, asked: &Asked<'_, J>, last: u32) -> Vec<String> {
    let peak = |of: &dyn Fn(&[f64; J]) -> f64| motion.peak::<P, J>(last, of);
    let mut words = Vec::new();
    let current = peak(asked.feed_forward);
    if current > asked.max_current_a {
        words.push(format!("{} A, the limit is {} A", shown(rounded(current)), shown(asked.max_current_a)));
    }
    let share = peak(&|jet| asked.share(jet));
    if let Some(supply) = asked.supply.filter(|_| share > 1.0) {
        words.push(format!(
            "{} V at speeds of up to {} rad/s of the motor, the supply has {} V (no-load speed {} rad/s)",
            shown(rounded(share * supply.volt)),
            shown(rounded(asked.gear * peak(asked.speed))),
            shown(rounded(supply.volt)),
            shown(rounded(asked.gear * supply.volt / asked.torque_n_m_per_a))
        ));
    }
    let fastest = peak(&|jet| jet[1]);
    if let Some(most) = asked.max_speed_rad_s.filter(|most| fastest > *most) {
        words.push(format!("{} rad/s, limits.max_speed_rad_s is {}", shown(rounded(fastest)), shown(most)));
    }
    words
}

/// A note on a move whose speed nobody has asked for, since its duration was found by the current alone. A move that is
/// given a duration, and all other goals, have the speed that was typed. The back-EMF is known without a supply: below
/// what any supply has nothing is said.
fn unjustified<const P: usize, const J: usize>(motion: &Motion, asked: &Asked<'_, J>, last: u32) -> Option<String> {
    let back_emf_v = motion.peak::<P, J>(last, |jet| asked.back_emf_v(jet));
    let is_found = matches!(motion.goal, Goal::Rest { .. }) && asked.supply.is_none();
    (is_found && back_emf_v > ANY_SUPPLY_V).then(|| {
        let plant = asked.plant;
        format!(
            "{plant}.supply_v is not given: the duration follows from the current alone, and the move takes {} rad/s \
             of the motor, {} V of back-EMF; give {plant}.supply_v and {plant}.resistance_ohm, or \
             {plant}.no_load_rad_s, or reference.duration_s",
            shown(rounded(asked.gear * motion.peak::<P, J>(last, asked.speed))),
            shown(rounded(back_emf_v))
        )
    })
}
