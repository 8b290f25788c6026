//! Gear with an encoder before it: the ratios that a drive can count, and the nearest of them.
//!
//! An encoder of C counts per revolution before a gear of a : b gives C a/b counts per output revolution, in lowest
//! terms p/q. After q output revolutions gear and encoder meet again, p counts later. A drive supports p up to 2^24,
//! the limit of whole numbers in f32, and q up to 1000. The encoder on the motor of a joint needs q = 1, because the
//! law uses the sine of its angle. All a and b within these limits are valid. For other ratios the nearest p'/q' within
//! the limits is the gear p' : (q' C). A drive with that gear deviates by |C a/b - p'/q'| counts per output revolution.

use controller_core::drive::Encoder;

use super::EncoderTable;
use super::build::rounded;
use crate::check::lowest;
use crate::error::shown;
use crate::resolve::Problem;

/// Largest number of counts until gear and encoder meet again.
const MOST_COUNTS: u64 = 1 << 24;
/// Largest number of output revolutions until gear and encoder meet again.
const MOST_TURNS: u64 = 1000;

/// Gear ratio num : den of motor and output revolutions, in lowest terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Gear {
    num: u64,
    den: u64,
}

impl Gear {
    /// Ratio without a gear.
    pub(super) const NONE: Self = Self { num: 1, den: 1 };

    /// Returns the gear of a file, in lowest terms.
    pub(super) fn of([num, den]: [u64; 2]) -> Self {
        let [num, den] = lowest([num.max(1).into(), den.max(1).into()]);
        Self { num: num as u64, den: den as u64 }
    }

    /// Returns the motor revolutions per output revolution.
    pub(super) fn ratio(self) -> f64 {
        self.num as f64 / self.den as f64
    }

    /// Returns p and q for the counts per revolution of an encoder before the gear.
    fn base(self, counts: u64) -> [u128; 2] {
        lowest([u128::from(counts) * u128::from(self.num), self.den.into()])
    }

    /// Returns true if a drive can count the gear with at most `most_turns` output revolutions.
    fn fits(self, counts: u64, most_turns: u64) -> bool {
        let [p, q] = self.base(counts);
        p <= MOST_COUNTS.into() && q <= most_turns.into() && self.den <= u32::MAX.into()
    }

    /// Returns the nearest gear that a drive can count. Of equally near gears it is the one with the fewest
    /// revolutions. `None` if a revolution has more counts than a drive supports.
    fn nearest(self, counts: u64, most_turns: u64) -> Option<Self> {
        let [p, q] = self.base(counts);
        let candidates = (1..=u128::from(most_turns)).flat_map(|turns| {
            let whole = p.saturating_mul(turns) / q;
            [whole, whole + 1].map(|counts| [counts, turns])
        });
        let mut best: Option<([u128; 2], Self)> = None;
        for [near, turns] in candidates.filter(|[near, _]| (1..=MOST_COUNTS.into()).contains(near)) {
            let [num, den] = lowest([near, turns * u128::from(counts)]);
            let gear = Self { num: num as u64, den: u64::try_from(den).ok()? };
            // |p/q - near/turns| is off/turns in units of 1/q.
            let off = near.saturating_mul(q).abs_diff(p.saturating_mul(turns));
            let is_nearer = best.is_none_or(|([least, of], _)| off * of < least * turns);
            if is_nearer && gear.fits(counts, most_turns) {
                best = Some(([off, turns], gear));
            }
        }
        best.map(|(_, gear)| gear)
    }

    /// Returns the error of another gear used instead of this one: rad and counts per output revolution.
    fn cost(self, other: Self, counts: u64) -> [f64; 2] {
        let [[p, q], [near, turns]] = [self, other].map(|gear| gear.base(counts));
        let off = near.saturating_mul(q).abs_diff(p.saturating_mul(turns)) as f64;
        [std::f64::consts::TAU * off / (q as f64 * near as f64), off / (q as f64 * turns as f64)]
    }
}

/// Encoder before a gear, with the names of its keys.
pub(super) struct Geared<'a> {
    pub(super) table: &'a EncoderTable,
    /// Names of the tables of encoder and gear.
    pub(super) key: &'static str,
    pub(super) plant: &'static str,
    pub(super) gear: Gear,
    /// Encoder without the gear.
    pub(super) bare: Encoder,
}

impl Geared<'_> {
    /// Returns the encoder with its gear.
    ///
    /// # Errors
    /// Returns the reason if a drive cannot count the gear, with keys and values that it can count.
    pub(super) fn encoder(&self) -> Result<Encoder, Problem> {
        let Self { gear, bare, plant, .. } = *self;
        let counts = u64::from(bare.counts_per_turn);
        let is_of_joint = plant == "joint";
        let most_turns = if is_of_joint { 1 } else { MOST_TURNS };
        if gear.fits(counts, most_turns) {
            return Ok(bare.geared(gear.num as u32, gear.den as u32));
        }
        let [p, q] = gear.base(counts);
        let behind = format!("{counts} counts in a turn of the encoder behind a gear of [{}, {}]", gear.num, gear.den);
        let why = if is_of_joint && q > 1 {
            format!(
                "{behind} are {p}/{q} in a turn of the link, but a joint needs a whole number, because the law uses \
                 the sine of the angle"
            )
        } else if p > MOST_COUNTS.into() {
            format!("{behind} are {p} before they meet again, but a drive counts at most 2^24 = {MOST_COUNTS}")
        } else {
            format!("{behind} meet again after {q} turns of the output, but a drive counts at most {most_turns}")
        };
        let mut remedies = Vec::new();
        let nearest = gear.nearest(counts, most_turns);
        if let Some(nearest) = nearest {
            let [rad, steps] = gear.cost(nearest, counts).map(|cost| shown(digits(cost)));
            remedies.push(format!(
                "the nearest that fits is {plant}.gear = [{}, {}], off by {rad} rad in a turn of the output, {steps} \
                 counts of the encoder",
                nearest.num, nearest.den
            ));
        }
        remedies.extend(self.shifted(most_turns));
        if remedies.is_empty() {
            // With a multiple of b counts an output revolution has a whole number of counts.
            let most = u128::from(MOST_COUNTS / gear.num);
            let most = most * u128::from(gear.den);
            remedies.push(if (4..u128::from(counts)).contains(&most) {
                format!("take an encoder of {most} counts in a turn, or one behind the gear")
            } else {
                "take an encoder behind the gear".into()
            });
        }
        let message = format!("{why}: {}", remedies.join("; or "));
        let is_gear = nearest.is_some();
        let given = if self.table.counts_per_turn.is_some() { "counts_per_turn" } else { self.width() };
        let key = if is_gear { format!("{plant}.gear") } else { format!("{}.{given}", self.key) };
        Err(Problem { key, message })
    }

    /// Returns the key that gives the width of the counter.
    fn width(&self) -> &'static str {
        if self.table.bits.is_some() { "bits" } else { "states" }
    }

    /// Returns the keys of a counter without its lowest bits, as few as necessary. `None` if a number would not be
    /// whole.
    fn shifted(&self, most_turns: u64) -> Option<String> {
        let Self { table, key, gear, bare, .. } = self;
        let by = (1..24).find(|by| gear.fits(u64::from(bare.counts_per_turn) >> by, most_turns))?;
        let offset = u64::from(table.offset_counts.unsigned_abs());
        let numbers = [Some(bare.counts_per_turn.into()), table.states, Some(offset)];
        let is_whole = numbers.into_iter().flatten().all(|number: u64| number.is_multiple_of(1 << by));
        let bits = table.bits.map(|bits| bits.saturating_sub(by));
        let states = table.states.map(|states| states >> by);
        let counts = table.counts_per_turn.map(|counts| counts >> by);
        let is_taken = is_whole
            && bits.is_none_or(|bits| bits >= 2)
            && states.is_none_or(|states| states >= 2)
            && bare.counts_per_turn >> by >= 4;
        let offset = (offset > 0).then(|| i64::from(table.offset_counts) >> by);
        let lines = [
            bits.map(|it| format!("{key}.bits = {it}")),
            states.map(|it| format!("{key}.states = {it}")),
            counts.map(|it| format!("{key}.counts_per_turn = {it}")),
            offset.map(|it| format!("{key}.offset_counts = {it}")),
        ];
        let lines: Vec<String> = lines.into_iter().flatten().collect();
        is_taken.then(|| format!("shift the lowest {by} bits of its counts away and set {}", lines.join(" with ")))
    }
}

/// Rounds a small number to three digits.
fn digits(number: f64) -> f64 {
    rounded(format!("{number:.2e}").parse().unwrap_or(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Finds the nearest ratio by trying every p/q, independent of the code above.
    fn by_trial([a, b]: [u64; 2], counts: u64, most_turns: u64) -> Option<f64> {
        let x = counts as f64 * a as f64 / b as f64;
        let near = |q: u64| [(x * q as f64).floor(), (x * q as f64).ceil()].map(|p| (p, q));
        let all = (1..=most_turns).flat_map(near).filter(|(p, _)| (1.0..=16_777_216.0).contains(p));
        all.map(|(p, q)| (p / q as f64 - x).abs()).min_by(f64::total_cmp)
    }

    #[test]
    fn the_nearest_gear_is_the_nearest_of_all_that_fit() {
        let gears =
            [[10_301, 100], [4554, 325], [99_225, 1024], [3591, 187], [2401, 121], [1_002_001, 1003], [1, 999_983]];
        let mut refused = 0;
        for gear in gears {
            for counts in [1000, 1024, 4000, 4096, 10_000, 16_384, 1 << 17, 1 << 20] {
                for most_turns in [1, MOST_TURNS] {
                    let asked = Gear::of(gear);
                    let nearest = asked.nearest(counts, most_turns);
                    let Some(nearest) = nearest else {
                        assert!(asked.ratio() * counts as f64 > 16_777_216.0, "{gear:?} {counts}");
                        continue;
                    };
                    assert!(nearest.fits(counts, most_turns), "{gear:?} {counts}: {nearest:?}");
                    let [rad, steps] = asked.cost(nearest, counts);
                    let least = by_trial(gear, counts, most_turns).expect("one");
                    let scale = asked.ratio() * counts as f64;
                    assert!((steps - least).abs() < 1e-14 * scale, "{gear:?} {counts}: {steps} of {least}");
                    let turned = std::f64::consts::TAU * (asked.ratio() / nearest.ratio() - 1.0).abs();
                    assert!((rad - turned).abs() < 1e-14 * (1.0 + rad), "{gear:?} {counts}: {rad} of {turned}");
                    assert_eq!(asked.fits(counts, most_turns), nearest == asked, "{gear:?} {counts}");
                    refused += u32::from(nearest != asked);
                }
            }
        }
        assert!(refused > 40, "{refused}");
    }
}
