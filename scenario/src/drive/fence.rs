//! Table `[limits]`: limits of position, speed and following error.

use controller_core::drive::FenceLimits;
use loop_sim::port::drive::Motion;

use super::LimitsTable;
use super::build::rounded;
use crate::error::shown;
use crate::resolve::Problem;

impl LimitsTable {
    /// Returns the limits for the drive. `None` without limits.
    pub(super) fn fence(&self) -> Option<FenceLimits> {
        let Self { low_rad, high_rad, max_speed_rad_s, following_error_rad } = *self;
        let none = FenceLimits::NONE;
        (*self != Self::default()).then(|| FenceLimits {
            low_rad: low_rad.unwrap_or(none.low_rad),
            high_rad: high_rad.unwrap_or(none.high_rad),
            max_speed_rad_s: max_speed_rad_s.unwrap_or(none.max_speed_rad_s),
            following_rad: following_error_rad.unwrap_or(none.following_rad),
        })
    }

    /// Returns problems for an empty range, and for a start outside the range.
    pub(super) fn problems(&self, start_rad: f64, plant: &str) -> Vec<Problem> {
        let Self { low_rad, high_rad, .. } = *self;
        let problem = |key: &str, message: String| Problem { key: key.into(), message };
        if let (Some(low), Some(high)) = (low_rad, high_rad)
            && low >= high
        {
            let message = format!("found {}, expected more than limits.low_rad = {}", shown(high), shown(low));
            return vec![problem("limits.high_rad", message)];
        }
        let key = format!("{plant}.start_rad");
        let outside =
            [("low_rad", low_rad, 1.0), ("high_rad", high_rad, -1.0)].into_iter().filter_map(|(end, at, side)| {
                let at = at.filter(|at| side * (start_rad - at) < 0.0)?;
                let [found, at] = [start_rad, at].map(shown);
                let message = format!("found {found}, beyond limits.{end} = {at}: start within the limits");
                Some(problem(&key, message))
            });
        outside.collect()
    }

    /// Returns problems for a reference that leaves the range.
    pub(super) fn beyond<const P: usize>(&self, motion: &Motion, last: usize) -> Vec<Problem> {
        let ends = [("low_rad", self.low_rad, -1.0), ("high_rad", self.high_rad, 1.0)];
        let jets = motion.jets::<P, 2>();
        let beyond = ends.into_iter().filter_map(|(end, at, side)| {
            let at = at?;
            let over = (0..=last as u32).map(|tick| side * (jets(tick)[0] - at)).fold(0.0, f64::max);
            // Rounding of a plan is not travel.
            (over > 1e-9 * at.abs().max(1.0)).then(|| Problem {
                key: "reference".into(),
                message: format!(
                    "the reference goes to {} rad, beyond limits.{end} = {}",
                    shown(rounded(at + side * over)),
                    shown(at)
                ),
            })
        });
        beyond.collect()
    }
}
