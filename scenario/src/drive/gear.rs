//! The gear of a data sheet, and the encoder before it: which ratios a drive can count, and the nearest that it can.
//!
//! An encoder of C counts per turn before a gear of a : b makes C a/b counts in a turn of the output, in lowest terms
//! p/q: after q turns of the output gear and encoder meet again, p counts later. A drive takes p up to 2^24, since f32
//! holds no more, and q up to 1000; the encoder on the motor of a joint needs q = 1, because the sine of its angle is
//! taken. Any a and b will do otherwise. Of other ratios the nearest p'/q' within these limits is the gear
//! p' : (q' C). A drive with that gear is off by |C a/b - p'/q'| counts in a turn of the output.

use controller_core::drive::Encoder;

use super::EncoderTable;
use super::build::rounded;
use crate::check::lowest;
use crate::error::shown;
use crate::resolve::Problem;

/// Most counts until gear and encoder meet again.
const MOST_COUNTS: u64 = 1 << 24;
/// Most turns of the output until then.
const MOST_TURNS: u64 = 1000;

/// Turns of the motor, and of the output meanwhile, without a common divisor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Gear {
    num: u64,
    den: u64,
}

impl Gear {
    /// No gear.
    pub(super) const NONE: Self = Self { num: 1, den: 1 };

    /// Returns the gear of the two numbers of a file, reduced.
    pub(super) fn of([num, den]: [u64; 2]) -> Self {
        let [num, den] = lowest([num.max(1).into(), den.max(1).into()]);
        Self { num: num as u64, den: den as u64 }
    }

    /// Returns the turns of the motor in one of the output.
    pub(super) fn ratio(self) -> f64 {
        self.num as f64 / self.den as f64
    }

    /// Returns p and q of an encoder of so many counts per turn before the gear.
    fn base(self, counts: u64) -> [u128; 2] {
        lowest([u128::from(counts) * u128::from(self.num), self.den.into()])
    }

    /// Can a drive count it, with a base of at most so many turns?
    fn fits(self, counts: u64, most_turns: u64) -> bool {
        let [p, q] = self.base(counts);
        p <= MOST_COUNTS.into() && q <= most_turns.into() && self.den <= u32::MAX.into()
    }

    /// Returns the nearest gear that a drive can count, of equally near ones that with the fewest turns; `None` where
    /// a turn makes more counts than a drive reads.
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

    /// Returns what another gear costs that is taken instead of this one: rad and counts in a turn of the output.
    fn cost(self, other: Self, counts: u64) -> [f64; 2] {
        let [[p, q], [near, turns]] = [self, other].map(|gear| gear.base(counts));
        let off = near.saturating_mul(q).abs_diff(p.saturating_mul(turns)) as f64;
        [std::f64::consts::TAU * off / (q as f64 * near as f64), off / (q as f64 * turns as f64)]
    }
}

/// An encoder before a gear, as a file names them.
pub(super) struct Geared<'a> {
    pub(super) table: &'a EncoderTable,
    /// The table of the encoder and that of the gear.
    pub(super) key: &'static str,
    pub(super) plant: &'static str,
    pub(super) gear: Gear,
    /// The encoder without the gear.
    pub(super) bare: Encoder,
}

impl Geared<'_> {
    /// Returns the encoder with its gear.
    ///
    /// # Errors
    /// Why a drive cannot count it, with the lines to write instead.
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
                "{behind} are {p}/{q} in a turn of the link, and a joint needs a whole number of them, since it takes \
                 the sine of the angle"
            )
        } else if p > MOST_COUNTS.into() {
            format!("{behind} are {p} before they meet again, and a drive reads at most 2^24 = {MOST_COUNTS}")
        } else {
            format!("{behind} meet again after {q} turns of the output, and a drive takes at most {most_turns}")
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
            // Of a multiple of b counts a turn of the output makes a whole number.
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

    /// The key that says how wide the counter is.
    fn width(&self) -> &'static str {
        if self.table.bits.is_some() { "bits" } else { "states" }
    }

    /// A counter whose lowest bits are not read, as few as there must be, where that leaves whole numbers.
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
        is_taken.then(|| format!("shift the lowest {by} bits of its counts away and say {}", lines.join(" with ")))
    }
}

/// Three digits of a small number.
fn digits(number: f64) -> f64 {
    rounded(format!("{number:.2e}").parse().unwrap_or(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nearest by trying every p/q, without the code above.
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
