//! Profile generator: turns set-points that come at any time into a reference with limited speed, acceleration and
//! jerk.
//!
//! A command from a user or a bus is a position, not a path. A [`Profile`] generates the path, tick by tick, in the
//! interrupt. Give it a goal at any time, and every tick returns a [`Target`].
//!
//! ```text
//! goal --> base: fastest way within speed and acceleration --> M moving averages of W ticks --> r, r', .. r^(M)
//! ```
//!
//! * **Base.** Each tick the base moves by a whole number of 2^-32 revolutions. From the moves c + A, c, c - A it takes
//!   the largest after which it can still stop at the goal. With n = ⌊v/A⌋ that is
//!   $$ v + (v - A) + \dots + (v - nA) = (n + 1)(2v - nA)/2 \le \text{goal} - \text{base}. $$
//!   If the condition holds once, it always holds (the next tick may brake). So the base never passes a goal that stays
//!   in place, and stops there exactly.
//! * **Averages.** Each average covers W ticks, in whole numbers, as a comb and integrators (Hogenauer, "An economical
//!   class of digital filters for decimation and interpolation", IEEE Trans. ASSP 29, 1981). The average of a signal
//!   within limits stays within the limits. So speed and acceleration keep their limits, the jerk is at most 2 a/(W T),
//!   and there is no overshoot. The derivatives belong to the averaged path and are exact at the ends of ticks.
//!
//! A motor uses M = 2 (r'' is continuous), a joint M = 3.
//!
//! **Time.** If full speed is reached, the base takes at most 3 ticks more than the fastest path within speed and
//! acceleration. Each average adds W ticks. The fastest path within a jerk j = a/(W T) takes as long as a path with one
//! average.
//!
//! **Streams.** Points that come every W ticks result in a spline of degree M. Its delay is M W/2 ticks plus the time
//! of the base. A point that is late, or comes twice, or with the next one, changes only the path between points. If no
//! point comes, the path ends at rest at the last one.
//!
//! **Stop, and start in motion.** [`Profile::stop`] sets the goal to the end of the braking path. [`Profile::start`]
//! starts with a position and a speed, for example of a shaft that already turns. Change a goal between two ticks, not
//! while the interrupt computes one: a goal is two words.
//!
//! ```
//! use controller_core::drive::{Profile, ProfileLimits};
//!
//! // 100 rad/s, 2000 rad/s² and averages over 10 ms, of a motor at 1 kHz.
//! let limits = ProfileLimits { speed_rad_s: 100.0, acceleration_rad_s2: 2000.0, window: 10 };
//! let mut profile = Profile::<f32, 2, 20>::new(&limits, 1e-3).unwrap();
//! profile.go_to(0, 1.0);
//! let path: Vec<f32> = (0..100).map(|_| profile.next_tick::<2>().jet[0]).collect();
//! assert!(path.iter().all(|r| (0.0..=1.0).contains(r)) && profile.has_arrived());
//! ```

use core::f64::consts::TAU;

use super::error::DriveError;
use super::reference::{FARTHEST_RAD, TWO_32, Turns, nearest_unit};
use super::target::Target;
use crate::real::Real;

/// Speed and acceleration limits of a [`Profile`], and the ticks of each of its averages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileLimits {
    /// Largest |r'|, rad/s.
    pub speed_rad_s: f64,
    /// Largest |r''|, rad/s².
    pub acceleration_rad_s2: f64,
    /// Ticks of an average, 1 or more. |r'''| is at most 2 `acceleration_rad_s2`/(window · period).
    pub window: u32,
}

/// Largest move per tick, 2^-32 revolutions: a quarter of a revolution. A counter is unwrapped within half a
/// revolution.
const MOST: f64 = 1_073_741_823.0;

/// Largest move per tick, and rad per unit, for a profile in C.
#[doc(hidden)]
pub const PROFILE_UNITS: [f64; 2] = [MOST, TAU / TWO_32];

impl ProfileLimits {
    /// Returns speed and acceleration in 2^-32 revolutions per tick and per tick².
    fn units(&self, period_s: f64) -> Result<[i32; 2], DriveError> {
        let unit_rad = TAU / TWO_32;
        // With a period of 1e-300 s the units below are not numbers.
        DriveError::within("period_s", period_s, 1e-6, 1.0, "the period of a profile is 1 us to 1 s")?;
        let [speed_unit, acceleration_unit] = [unit_rad / period_s, unit_rad / (period_s * period_s)];
        let Self { speed_rad_s: speed, acceleration_rad_s2: acceleration, .. } = *self;
        let why = "a profile moves on by 2^-32 turns to a quarter of a turn per tick";
        DriveError::within("speed_rad_s", speed, speed_unit, MOST * speed_unit, why)?;
        let why = "a profile speeds up by 2^-32 turns to a quarter of a turn per tick²";
        DriveError::within("acceleration_rad_s2", acceleration, acceleration_unit, MOST * acceleration_unit, why)?;
        Ok([(speed / speed_unit) as i32, (acceleration / acceleration_unit) as i32])
    }
}

/// Profile generator: goal, base and averages. It needs `M` averages, and memory for `LEN` ticks: M times the longest
/// window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile<T, const M: usize, const LEN: usize> {
    goal: Turns,
    /// Range of accepted goals.
    range: [Turns; 2],
    base: Turns,
    /// Move of the base in the last tick, and its number of whole accelerations.
    step: i32,
    whole: i32,
    fastest: i32,
    fastest_whole: i32,
    acceleration: i32,
    /// Moves of the last M windows. The oldest is at `oldest`.
    steps: [i32; LEN],
    oldest: u32,
    window: u32,
    /// Integrators. The last one is the move of the path, times window^M.
    sums: [Turns; M],
    /// Moves of the path in the two ticks before, the latest first.
    earlier: [Turns; 2],
    /// Distance of the path behind the base, times window^M.
    behind: Turns,
    /// Factors: rad per unit/window^M, and 1/T.
    part_rad: T,
    per_s: T,
}

/// Returns true if a stop within `distance` is possible after a tick with move `step`, of `whole` whole accelerations.
fn stops_within(distance: i64, step: i32, whole: i32, acceleration: i32) -> bool {
    // Twice the remaining distance.
    i64::from(whole + 1) * i64::from(2 * step - acceleration * whole) <= 2 * distance
}

/// Returns the number of whole accelerations in a move. An acceleration is at least 1. The explicit `max` avoids a
/// panic.
fn whole_of(step: i32, acceleration: i32) -> i32 {
    step / acceleration.max(1)
}

fn is_near(number: f64) -> bool {
    number.abs() <= FARTHEST_RAD
}

impl<T: Real<Count = i32>, const M: usize, const LEN: usize> Profile<T, M, LEN> {
    /// Returns a profile at rest at angle 0.
    ///
    /// # Errors
    /// * The period is outside of 1 us to 1 s.
    /// * A limit is not a number, or exceeds the counting range.
    /// * The window does not fit into the memory.
    pub fn new(limits: &ProfileLimits, period_s: f64) -> Result<Self, DriveError> {
        const { assert!(M == 2 || M == 3, "a profile of a motor has 2 averages, that of a joint 3") };
        let [fastest, acceleration] = limits.units(period_s)?;
        // window^(M + 1) M/2 quarters of a revolution still fit into 64 bits.
        let most = if M == 2 { 512 } else { 128 };
        let most = if LEN / M < most { LEN / M } else { most };
        let why = "each average of a profile has memory for so many ticks";
        DriveError::within("window", f64::from(limits.window), 1.0, most as f64, why)?;
        let (window, part) = (limits.window, f64::from(limits.window.pow(M as u32)));
        let zero = Turns::new(0);
        Ok(Self {
            goal: zero,
            range: [Turns::new(i64::MIN / 2), Turns::new(i64::MAX / 2)],
            base: zero,
            step: 0,
            whole: 0,
            fastest,
            fastest_whole: whole_of(fastest, acceleration),
            acceleration,
            steps: [0; LEN],
            oldest: 0,
            window,
            sums: [zero; M],
            earlier: [zero; 2],
            behind: zero,
            part_rad: T::from_f64(TAU / TWO_32 / part),
            per_s: T::from_f64(1.0 / period_s),
        })
    }

    /// Returns true if acceleration, window and the index of the oldest move lie within their ranges, as in any valid
    /// profile. Use it for memory that other code may have overwritten.
    #[doc(hidden)]
    pub const fn is_sound(&self) -> bool {
        let window = self.window as usize;
        self.acceleration >= 1 && window >= 1 && window <= LEN / M && (self.oldest as usize) < M * window
    }

    /// Sets other limits, also in motion. The window stays. Above a lower speed limit the profile brakes with its
    /// acceleration.
    ///
    /// # Errors
    /// As [`Profile::new`]. The old limits stay in this case.
    pub fn limit(&mut self, limits: &ProfileLimits, period_s: f64) -> Result<(), DriveError> {
        let [fastest, acceleration] = limits.units(period_s)?;
        (self.fastest, self.acceleration) = (fastest, acceleration);
        (self.fastest_whole, self.whole) = (whole_of(fastest, acceleration), whole_of(self.step.abs(), acceleration));
        Ok(())
    }

    /// Limits later goals, and the present goal, to a range. Each end is 2π turn + rad.
    ///
    /// Returns `false`, and changes nothing, if an angle is not a number or the first end is above the second.
    pub fn keep_within(&mut self, low: (i32, f64), high: (i32, f64)) -> bool {
        let good = is_near(low.1) && is_near(high.1);
        let [low, high] = [low, high].map(|(turn, rad)| Turns::at(turn, rad));
        if good && low.units() <= high.units() {
            self.range = [low, high];
            self.set_goal(self.goal.units());
            return true;
        }
        false
    }

    /// Sets the goal to 2π `turn` + `rad`, from the present state.
    ///
    /// Returns `false` if the goal is out of range: the profile then goes to the end of the range. Also returns `false`
    /// if the goal is not a number: the old goal then stays.
    pub fn go_to(&mut self, turn: i32, rad: f64) -> bool {
        if !is_near(rad) {
            return false;
        }
        let goal = Turns::at(turn, rad);
        self.set_goal(goal.units());
        self.goal == goal
    }

    fn set_goal(&mut self, goal: i64) {
        let [low, high] = self.range.map(Turns::units);
        self.goal = Turns::new(goal.min(high).max(low));
    }

    /// Comes to rest as soon as possible. A stop that ends beyond the range returns to its end.
    ///
    /// The base never reverses. The path never reverses if the base has not reversed in the last M windows.
    pub fn stop(&mut self) {
        let (step, whole) = (i64::from(self.step.abs()), i64::from(self.whole));
        let way = whole * (2 * step - i64::from(self.acceleration) * (whole + 1)) / 2;
        let (base, [low, high]) = (self.base.units(), self.range.map(Turns::units));
        self.goal = Turns::new(base.wrapping_add(if self.step < 0 { -way } else { way }));
        // A stop that starts beyond the range ends at rest there.
        if (low..=high).contains(&base) {
            self.set_goal(self.goal.units());
        }
    }

    /// Restarts at 2π `turn` + `rad` with a speed and stops from there, for a shaft that already turns.
    ///
    /// Returns `false`, and changes nothing, if an argument is not a number or the speed exceeds a quarter of a
    /// revolution per tick.
    pub fn start(&mut self, turn: i32, rad: f64, speed_rad_s: f64) -> bool {
        if !is_near(rad) || !is_near(speed_rad_s) {
            return false;
        }
        let units = speed_rad_s / (self.per_s.to_f64() * (TAU / TWO_32));
        if units.abs() > MOST {
            return false;
        }
        let step = nearest_unit(units);
        let windows = i64::from(self.window);
        let moved = step * windows.pow(M as u32);
        self.step = step as i32;
        self.whole = whole_of(self.step.abs(), self.acceleration);
        self.steps = [self.step; LEN];
        (self.sums, self.earlier) = ([Turns::new(0); M], [Turns::new(moved); 2]);
        self.sums[M - 1] = Turns::new(moved);
        // Each average is (W - 1)/2 ticks behind, and the ends of ticks M/2 more.
        self.behind = Turns::new(moved * (M as i64 * (windows - 1)) / 2);
        self.base = Turns::new(Turns::at(turn, rad).units().wrapping_add(step * M as i64 * windows / 2));
        self.stop();
        true
    }

    /// Returns true if the path is at rest at its goal.
    pub fn has_arrived(&self) -> bool {
        let still = |sum: &Turns| sum.units() == 0;
        self.goal == self.base
            && self.step == 0
            && still(&self.behind)
            && self.sums.iter().chain(&self.earlier).all(still)
    }

    /// Computes the next move of the base.
    fn advance(&mut self) {
        let left = self.goal.units().wrapping_sub(self.base.units());
        let (sign, distance) = if left < 0 { (-1, left.wrapping_neg()) } else { (1, left) };
        let Self { whole, fastest, fastest_whole, acceleration, .. } = *self;
        // Forward is towards the goal. Larger distances are clamped.
        let (step, distance) = (sign * self.step, distance.clamp(0, 1 << 61));
        let (next, next_whole) = if step < 0 {
            // Moves away from the goal.
            let next = step + acceleration;
            if next <= 0 { (next, whole - 1) } else { ((i64::from(next.min(fastest))).min(distance) as i32, 0) }
        } else {
            let (up, up_whole) =
                if step <= fastest { (step + acceleration, whole + 1) } else { (step - acceleration, whole - 1) };
            let is_over = (up >= fastest) == (step <= fastest);
            let (up, up_whole) = if is_over { (fastest, fastest_whole) } else { (up, up_whole) };
            if stops_within(distance, up, up_whole, acceleration) {
                (up, up_whole)
            } else if whole == 0 {
                let next = i64::from(acceleration.min(fastest)).min(distance) as i32;
                (next, i32::from(next == acceleration))
            } else if step <= fastest && stops_within(distance, step, whole, acceleration) {
                (step, whole)
            } else {
                (step - acceleration, whole - 1)
            }
        };
        (self.step, self.whole) = (sign * next, next_whole);
        self.base = Turns::new(self.base.units().wrapping_add(i64::from(self.step)));
    }

    /// Returns the average of the moves: the move of the path in this tick, times window^M.
    fn average(&mut self) -> Turns {
        let (window, oldest) = (self.window as usize, self.oldest as usize);
        let length = M * window;
        let before = |windows: usize| {
            let at = oldest + (M - windows) * window;
            // The index is within its bounds. A checked index would still leave a panic in a static library.
            i64::from(self.steps.get(if at < length { at } else { at - length }).copied().unwrap_or(0))
        };
        let step = i64::from(self.step);
        let mut sum = match M {
            2 => step - 2 * before(1) + before(2),
            _ => step - 3 * before(1) + 3 * before(2) - before(3),
        };
        if let Some(entry) = self.steps.get_mut(oldest) {
            *entry = self.step;
        }
        self.oldest = if oldest + 1 < length { self.oldest + 1 } else { 0 };
        for entry in &mut self.sums {
            sum = sum.wrapping_add(entry.units());
            *entry = Turns::new(sum);
        }
        let all = i64::from(self.window.pow(M as u32));
        self.behind = Turns::new(self.behind.units().wrapping_add(step * all).wrapping_sub(sum));
        Turns::new(sum)
    }

    /// Returns the target at the end of the next tick, with up to M derivatives (J of 2 to M + 1).
    #[must_use]
    pub fn next_tick<const J: usize>(&mut self) -> Target<T, i32, J> {
        const { assert!(J >= 2 && J <= M + 1, "a profile with M averages has M derivatives") };
        self.advance();
        let moved = self.average();
        let [turn, rest] = self.base.nearest_whole();
        let numbers = [moved, self.earlier[0], self.earlier[1]].map(Turns::nearest_whole);
        let jet = jet_of_profile(M, numbers, self.behind.nearest_whole(), rest, self.part_rad, self.per_s);
        self.earlier = [moved, self.earlier[0]];
        Target { turn, jet: core::array::from_fn(|j| jet[j]) }
    }
}

/// Returns r and its derivatives from the moves of the averages in the last three ticks, the latest first.
///
/// The other arguments are the distance behind the base (whole numbers and remainders in 2^-32), the remainder of the
/// base in 2^-32 revolutions, the rad of a part, and 1/T. Splines give the moves at the ends of ticks, because the base
/// moves evenly within a tick. It is public only for the recorder of C.
#[doc(hidden)]
pub fn jet_of_profile<T: Real>(
    averages: usize,
    moved: [[T::Count; 2]; 3],
    behind: [T::Count; 2],
    rest: T::Count,
    part_rad: T,
    per_s: T,
) -> [T; 4] {
    let of = T::from_f64;
    let real = |[whole, part]: [T::Count; 2]| T::from_count(whole) * of(TWO_32) + T::from_count(part);
    let ([now, before, earlier], behind) = (moved.map(real), real(behind));
    let [behind, speed, acceleration, jerk] = if averages == 2 {
        let behind = behind + (of(5.0 / 6.0) * now + of(1.0 / 6.0) * before);
        [behind, of(0.5) * (now + before), now - before, T::ZERO]
    } else {
        let behind = behind + (of(23.0 / 24.0) * now + (of(0.5) * before + of(1.0 / 24.0) * earlier));
        let speed = of(1.0 / 6.0) * (now + earlier) + of(2.0 / 3.0) * before;
        [behind, speed, of(0.5) * (now - earlier), (now - before) - (before - earlier)]
    };
    let per_s2 = per_s * per_s;
    [
        T::from_count(rest) * of(TAU / TWO_32) - behind * part_rad,
        speed * part_rad * per_s,
        acceleration * part_rad * per_s2,
        jerk * part_rad * (per_s2 * per_s),
    ]
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    const PERIOD_S: f64 = 1e-3;
    const LIMITS: ProfileLimits = ProfileLimits { speed_rad_s: 60.0, acceleration_rad_s2: 2000.0, window: 8 };

    fn new<const M: usize>(limits: &ProfileLimits) -> Profile<f64, M, 96> {
        Profile::new(limits, PERIOD_S).expect("limits")
    }

    fn angle<const J: usize>(target: &Target<f64, i32, J>) -> f64 {
        TAU * f64::from(target.turn) + target.jet[0]
    }

    /// Returns pseudo-random numbers, 0 to 1.
    fn any(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 33) as f64 / 2_f64.powi(31)
    }

    /// Returns the fewest ticks from a move to rest at a distance, by a breadth-first search over all possible ticks.
    fn fewest(distance: i64, step: i32, limits: [i32; 2]) -> usize {
        let [fastest, acceleration] = limits;
        let mut reached = std::collections::HashSet::from([(distance, step)]);
        for ticks in 0.. {
            if reached.contains(&(0, 0)) {
                return ticks;
            }
            let next = |&(left, step): &(i64, i32)| {
                let steps = (step - acceleration).max(-fastest)..=(step + acceleration).min(fastest);
                steps.map(move |step| (left - i64::from(step), step))
            };
            reached = reached.iter().flat_map(next).filter(|(left, _)| left.abs() < 200).collect();
        }
        unreachable!()
    }

    /// Checks the base from any distance and any speed: the fewest ticks and at most 3 more. It passes the goal only if
    /// braking cannot stop before it.
    #[test]
    fn the_base_is_the_fastest_way_but_for_three_ticks_and_never_passes_its_goal() {
        let mut most = 0;
        for (fastest, acceleration) in [(7, 2), (9, 3), (5, 1), (6, 6), (4, 9)] {
            for distance in [0, 1, 2, 3, 5, 8, 13, 21, 40, 61] {
                for step in -fastest..=fastest {
                    let mut base = new::<2>(&LIMITS);
                    (base.fastest, base.acceleration, base.fastest_whole) =
                        (fastest, acceleration, fastest / acceleration);
                    (base.step, base.whole) = (step, step.abs() / acceleration);
                    base.stop();
                    let stops_at = base.goal.units();
                    base.goal = Turns::new(distance);
                    let (mut ticks, mut last, mut furthest) = (0, step, 0);
                    while (base.base.units(), base.step) != (distance, 0) {
                        base.advance();
                        ticks += 1;
                        furthest = base.base.units().max(furthest);
                        assert!((base.step - last).abs() <= acceleration && base.step.abs() <= fastest);
                        assert_eq!(base.whole, base.step.abs() / acceleration, "{base:?}");
                        assert!(ticks < 400, "{distance} from {step}: {base:?}");
                        last = base.step;
                    }
                    assert!(furthest <= distance.max(stops_at), "{distance} from {step}: {furthest}");
                    let fewest = fewest(distance, step, [fastest, acceleration]);
                    assert!(ticks <= fewest + 3, "{distance} from {step}: {ticks} ticks, {fewest} would do");
                    most = most.max(ticks - fewest);
                }
            }
        }
        assert!(most > 0, "the search is not a copy");
    }

    /// Checks the limits and the derivatives for goals at any time, in motion, beyond the range, from anywhere.
    ///
    /// Within a tick the path is a polynomial of degree M + 1, so its integral by the rule of both ends is exact.
    fn keeps_its_limits<const M: usize, const J: usize>() {
        let (mut seed, [speed, acceleration]) = (M as u64, [60.0, 2000.0]);
        let mut profile = new::<M>(&LIMITS);
        assert!(profile.keep_within((-3, 0.0), (5, 1.0)));
        let mut last: Target<f64, i32, J> = profile.next_tick();
        for tick in 0..200_000 {
            if any(&mut seed) < 0.005 {
                profile.go_to((20.0 * any(&mut seed) - 8.0) as i32, 7.0 * any(&mut seed) - 3.5);
            } else if any(&mut seed) < 0.001 {
                profile.stop();
            }
            let now: Target<f64, i32, J> = profile.next_tick();
            assert!(now.jet[1].abs() <= speed * (1.0 + 1e-9) && now.jet[2].abs() <= acceleration * (1.0 + 1e-9));
            assert!((-3.0 * TAU..=5.0 * TAU + 1.0).contains(&(angle(&now) + 1e-8 * -angle(&now).signum())));
            let moved = angle(&now) - angle(&last);
            let bent = PERIOD_S * PERIOD_S / 12.0 * (now.jet[2] - last.jet[2]);
            let expected = 0.5 * PERIOD_S * (now.jet[1] + last.jet[1]) - bent;
            assert!((moved - expected).abs() < 1e-12 * (1.0 + angle(&now).abs()), "tick {tick}: {moved} {expected}");
            if M == 3 {
                let [jerk, before] = [now.jet[J - 1], last.jet[J - 1]];
                assert!(jerk.abs() <= 2.0 * acceleration / (8.0 * PERIOD_S) * (1.0 + 1e-9), "{jerk}");
                let moved = now.jet[1] - last.jet[1];
                let bent = PERIOD_S * PERIOD_S / 12.0 * (jerk - before);
                let expected = 0.5 * PERIOD_S * (now.jet[2] + last.jet[2]) - bent;
                assert!((moved - expected).abs() < 1e-9, "tick {tick}: {moved} {expected}");
            }
            last = now;
        }
    }

    #[test]
    fn a_profile_keeps_its_limits_and_its_derivatives_fit() {
        keeps_its_limits::<2, 3>();
        keeps_its_limits::<3, 4>();
    }

    /// Checks a move from rest to rest: no overshoot, an exact end, and the time of the closed form.
    #[test]
    fn a_move_ends_at_its_goal_in_the_time_of_the_closed_form() {
        for distance in [1e-6, 1e-3, 0.1, 1.0, 3.1, 20.0, 1e3] {
            let mut profile = new::<3>(&LIMITS);
            profile.go_to(0, distance);
            let (mut ticks, mut last) = (0, 0.0);
            while !profile.has_arrived() {
                let r = angle(&profile.next_tick::<4>());
                assert!(r >= last - 1e-9 && r <= distance + 2e-9, "{distance}: {r} after {last}");
                (ticks, last) = (ticks + 1, r);
            }
            assert!((last - distance).abs() < 2e-9, "{last} of {distance}");
            // Without the averages: up and down, with a section at full speed if it is reached.
            let fastest_s = if distance > 60.0 * 60.0 / 2000.0 {
                distance / 60.0 + 60.0 / 2000.0
            } else {
                2.0 * (distance / 2000.0_f64).sqrt()
            };
            let least = fastest_s / PERIOD_S;
            // The averages and their memory: 3 windows of 8.
            let taken = f64::from(ticks) - 3.0 * 8.0;
            assert!(
                taken >= least - 1.0 && taken <= least + 7.0,
                "{distance}: {ticks} ticks, {least} without averages"
            );
        }
    }

    /// Checks a start with any speed: it begins at this position and speed, and ends ahead of it without a reversal.
    #[test]
    fn a_start_in_motion_goes_on_from_there_and_a_stop_never_goes_back() {
        let mut seed = 3;
        for _ in 0..300 {
            let (rad, speed) = (6.0 * any(&mut seed) - 3.0, 400.0 * any(&mut seed) - 200.0);
            let mut profile = new::<3>(&LIMITS);
            assert!(profile.start(2, rad, speed));
            let mut last = Target { turn: 2, jet: [rad, speed, 0.0, 0.0] };
            let first: Target<f64, i32, 4> = profile.next_tick();
            assert!(
                (first.jet[1] - speed).abs() < 2.1 && (angle(&first) - angle(&last) - speed * PERIOD_S).abs() < 3e-3
            );
            last = first;
            while !profile.has_arrived() {
                let now: Target<f64, i32, 4> = profile.next_tick();
                assert!(speed.signum() * (angle(&now) - angle(&last)) >= -3e-9 && speed.signum() * now.jet[1] >= -1e-6);
                last = now;
            }
            let way = (angle(&last) - TAU * 2.0 - rad).abs();
            // Braking at 2000 rad/s², and half of 3 windows at full speed.
            let expected = speed * speed / 4000.0 + speed.abs() * 12.0 * PERIOD_S;
            assert!((way - expected).abs() < 1e-3 + 1.5 * PERIOD_S * speed.abs(), "{speed}: {way} for {expected}");
        }
    }

    /// Returns the largest error and the largest step of r' for 2 s of a sine of 0.5 rad and 1 Hz, with points every 8
    /// ticks.
    ///
    /// The profile is in f32 as on a target. The error refers to the sine with the delay of the averages. If
    /// `disturbed`, points come late, twice, or together with the next one.
    fn streamed(disturbed: bool) -> [f64; 2] {
        let mut profile = Profile::<f32, 2, 96>::new(&LIMITS, PERIOD_S).expect("limits");
        let point = |k: u32| 0.5 * (TAU * 8.0 * PERIOD_S * f64::from(k)).sin();
        let (mut worst, mut step, mut last) = (0.0_f64, 0.0_f64, 0.0);
        for tick in 0..2000_u32 {
            let k = tick / 8;
            let every = |n| disturbed && k.is_multiple_of(n);
            let comes = tick % 8 == if every(10) { 3 } else { 0 } || (every(7) && tick % 8 == 5);
            if comes && !every(13) {
                assert!(profile.go_to(0, point(k)));
            }
            let Target { jet: [r, v], .. } = profile.next_tick::<2>();
            if tick > 50 {
                // Delay of the averages, and of the base for a point.
                let at = TAU * PERIOD_S * (f64::from(tick) - 8.0 - 5.0);
                worst = worst.max((f64::from(r) - 0.5 * at.sin()).abs());
                step = step.max((f64::from(v) - last).abs());
            }
            last = f64::from(v);
        }
        for _ in 0..60 {
            last = f64::from(profile.next_tick::<2>().jet[1]);
        }
        assert!(profile.has_arrived() && last == 0.0, "starved it rests at the last point");
        [worst, step]
    }

    #[test]
    fn points_that_come_late_twice_or_bunched_change_the_path_between_them_alone() {
        let (even, disturbed) = (streamed(false), streamed(true));
        std::println!(
            "evenly off by {:.1e} rad, r' steps by {:.1e} rad/s; disturbed {:.1e} and {:.1e}",
            even[0],
            even[1],
            disturbed[0],
            disturbed[1]
        );
        // One point is 0.025 rad, so a late point causes an error of this size. A motor with 250 rad/s² per A steps by
        // at most 0.5 A.
        assert!(even[0] < 6e-3 && even[1] < 0.125, "{even:?}");
        assert!(disturbed[0] < 0.03 && disturbed[1] < 1.0, "{disturbed:?}");
    }

    #[test]
    fn what_is_no_limit_and_no_angle_is_refused_and_changes_nothing() {
        for (speed_rad_s, acceleration_rad_s2, window) in [
            (0.0, 1.0, 1),
            (f64::NAN, 1.0, 1),
            (1.0, -1.0, 1),
            (1.0, 1e9, 1),
            (1e5, 1.0, 1),
            (1.0, 1.0, 0),
            (1.0, 1.0, 49),
        ] {
            let limits = ProfileLimits { speed_rad_s, acceleration_rad_s2, window };
            assert!(Profile::<f32, 2, 96>::new(&limits, PERIOD_S).is_err(), "{limits:?}");
        }
        for period_s in [0.0, -1e-3, f64::NAN, 1e-300, 2.0] {
            let refused = Profile::<f32, 2, 96>::new(&LIMITS, period_s).expect_err("no period");
            assert_eq!(refused.field, "period_s");
        }
        let mut profile = new::<2>(&LIMITS);
        profile.go_to(0, 1.0);
        let before = profile;
        assert!(profile.is_sound());
        let over = [Profile { window: 49, ..profile }, Profile { window: 0, ..profile }];
        let over = [over, [Profile { oldest: 16, ..profile }, Profile { acceleration: 0, ..profile }]].concat();
        assert!(over.iter().all(|profile| !profile.is_sound()));
        assert!(!profile.go_to(0, f64::NAN) && !profile.start(0, 0.0, f64::INFINITY));
        assert!(!profile.keep_within((1, 0.0), (0, 0.0)) && !profile.keep_within((0, f64::NAN), (0, 0.0)));
        assert_eq!(profile, before);
    }
}
