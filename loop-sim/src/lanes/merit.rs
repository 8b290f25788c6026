//! Metrics computed during the run, equal to those that [`measure`](crate::metrics::measure) computes from a trace.

use super::wide::Wide;
use super::{FLAGS, Instructions, Judged, LANES, LaneOutputs};
use controller_core::Real;

use crate::MAX_ORDER;
use crate::metrics::{ChannelError, FAR, Metrics};

/// Metrics of all lanes.
pub(super) struct Merit {
    instructions: Instructions,
    window_s: [f64; 2],
    period_s: f64,
    band: f64,
    /// Number of ticks in the window so far.
    inside: usize,
    sigma_star: Wide,
    y: Wide,
    u_peak: Wide,
    u_last: Wide,
    variation: Wide,
    /// Maximum of |d - d_hat| for each observed channel.
    pub(super) estimation: [Wide; MAX_ORDER],
    began: Wide,
    farthest: Wide,
    /// Last tick outside the band, counted from 1. 0 for none.
    outside: Wide,
    ticks_with: [Wide<u32>; FLAGS],
    /// Counts of the latest ticks, in bytes, and `late_ticks`, the number of these ticks.
    lately: [Wide<u8>; FLAGS],
    late_ticks: u8,
}

impl Merit {
    pub(super) fn new(instructions: Instructions, window_s: [f64; 2], period_s: f64, band: f64) -> Self {
        let none = Wide::of_all(0.0);
        Self {
            instructions,
            window_s,
            period_s,
            band,
            inside: 0,
            sigma_star: none,
            y: none,
            u_peak: none,
            u_last: none,
            variation: none,
            estimation: [none; MAX_ORDER],
            began: none,
            farthest: none,
            outside: none,
            ticks_with: [Wide::of_all(0); FLAGS],
            lately: [Wide::of_all(0); FLAGS],
            late_ticks: 0,
        }
    }

    /// Returns true if the tick is inside the window. It has half a tick of slack, as in `measure`.
    pub(super) fn is_inside(&self, t_s: f64) -> bool {
        let slack = 0.5 * self.period_s;
        t_s >= self.window_s[0] - slack && t_s <= self.window_s[1] + slack
    }

    pub(super) fn note<T: Real>(&mut self, k: usize, t_s: f64, y: &Wide, told: &LaneOutputs<T>) {
        if k == 0 {
            self.began = Wide(y.0.map(f64::abs));
        }
        note_all(self.instructions, self, (k + 1) as f64, y, &told.u);
        if told.health.0.iter().fold(0, |all, health| all | health) != 0 {
            note_flags(self.instructions, &mut self.lately, &told.health);
            self.late_ticks += 1;
            if self.late_ticks == u8::MAX {
                self.sum_up();
            }
        }
        if self.is_inside(t_s) {
            let factor = if self.inside > 0 { 1.0 } else { 0.0 };
            self.inside += 1;
            note_inside(self.instructions, self, factor, y, &told.u, &told.sigma_star);
        }
    }

    /// Adds the latest counts to the totals. Call it before `judged`.
    pub(super) fn sum_up(&mut self) {
        for (counts, lately) in self.ticks_with.iter_mut().zip(&mut self.lately) {
            for l in 0..LANES {
                counts[l] += u32::from(lately[l]);
            }
            *lately = Wide::of_all(0);
        }
        self.late_ticks = 0;
    }

    pub(super) fn judged(&self, l: usize, periods: usize, channels: &[usize]) -> Judged {
        let spoken = self.inside > 0;
        let or_none = |value: f64| if spoken { value } else { f64::NAN };
        let duration = self.inside.saturating_sub(1) as f64 * self.period_s;
        let settled = self.outside[l] as usize;
        let errors = channels
            .iter()
            .enumerate()
            .map(|(s, channel)| ChannelError { channel: channel + 1, error: or_none(self.estimation[s][l]) });
        Judged {
            metrics: Metrics {
                sigma_star_ultimate: or_none(self.sigma_star[l]),
                y_ultimate: or_none(self.y[l]),
                u_peak: self.u_peak[l],
                u_total_variation_per_s: self.variation[l] / duration,
                estimation_error_ultimate: errors.collect(),
                settling_time_s: (settled <= periods).then_some(settled as f64 * self.period_s),
                bounded: self.farthest[l] <= FAR * self.began[l].max(self.band),
                window_s: self.window_s,
            },
            ticks_with: std::array::from_fn(|flag| self.ticks_with[flag][l]),
        }
    }
}

#[inline(always)]
fn larger(most: f64, value: f64) -> f64 {
    if value > most { value } else { most }
}

vectorised! {
    fn note_all[;](merit: &mut Merit, tick: f64, y: &Wide, u: &Wide,) {
        for l in 0..LANES {
            merit.farthest[l] = larger(merit.farthest[l], y[l].abs());
            merit.outside[l] = if y[l].abs() > merit.band { tick } else { merit.outside[l] };
            merit.u_peak[l] = larger(merit.u_peak[l], u[l].abs());
        }
    }
}

vectorised! {
    /// Updates the metrics of the window. `next` is 0 in the first tick of the window, which has no tick to compare
    /// with.
    fn note_inside[T; T: Real](merit: &mut Merit, next: f64, y: &Wide, u: &Wide, sigma_star: &Wide<T>,) {
        for l in 0..LANES {
            merit.y[l] = larger(merit.y[l], y[l].abs());
            merit.sigma_star[l] = larger(merit.sigma_star[l], sigma_star[l].to_f64().abs());
            merit.variation[l] += (u[l] - merit.u_last[l]).abs() * next;
            merit.u_last[l] = u[l];
        }
    }
}

vectorised! {
    fn note_flags[;](lately: &mut [Wide<u8>; FLAGS], health: &Wide<u8>,) {
        for (flag, counts) in lately.iter_mut().enumerate() {
            for l in 0..LANES {
                counts[l] = counts[l].wrapping_add(health[l] >> flag & 1);
            }
        }
    }
}
