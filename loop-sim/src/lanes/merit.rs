//! Figures of merit on the way, as [`measure`](crate::metrics::measure) has them of a trace.

use super::{Judged, LANES, TROUBLES, Told, Wide};
use crate::MAX_ORDER;
use crate::metrics::{ChannelError, FAR, Metrics};

/// Of all lanes.
pub(super) struct Merit {
    window_s: [f64; 2],
    period_s: f64,
    band: f64,
    /// Ticks in the window so far.
    inside: usize,
    sigma_star: Wide,
    y: Wide,
    u_peak: Wide,
    u_last: Wide,
    variation: Wide,
    estimation: [Wide; MAX_ORDER],
    began: Wide,
    farthest: Wide,
    /// The last tick outside of the band, from 1; 0 for none.
    outside: Wide,
    ticks_with: [[u32; LANES]; TROUBLES],
}

impl Merit {
    pub(super) fn new(window_s: [f64; 2], period_s: f64, band: f64) -> Self {
        let none = [0.0; LANES];
        Self {
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
            ticks_with: [[0; LANES]; TROUBLES],
        }
    }

    /// Half a tick of slack, as there.
    pub(super) fn is_inside(&self, t_s: f64) -> bool {
        let slack = 0.5 * self.period_s;
        t_s >= self.window_s[0] - slack && t_s <= self.window_s[1] + slack
    }

    pub(super) fn note(&mut self, k: usize, t_s: f64, y: &Wide, told: &Told) {
        if k == 0 {
            self.began = y.map(f64::abs);
        }
        let is_inside = self.is_inside(t_s);
        let is_next = is_inside && self.inside > 0;
        self.inside += usize::from(is_inside);
        let factor = |is_so: bool| if is_so { 1.0 } else { 0.0 };
        note_all(self, (k + 1) as f64, [factor(is_inside), factor(is_next)], y, told);
    }

    pub(super) fn note_estimate(&mut self, s: usize, d: &Wide, d_hat: &Wide) {
        largest_all(&mut self.estimation[s], d, d_hat);
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

vectorised! {
    fn note_all(merit: &mut Merit, tick: f64, [inside, next]: [f64; 2], y: &Wide, told: &Told) {
        let larger = |most: f64, value: f64| if value > most { value } else { most };
        for l in 0..LANES {
            merit.farthest[l] = larger(merit.farthest[l], y[l].abs());
            merit.outside[l] = if y[l].abs() > merit.band { tick } else { merit.outside[l] };
            merit.u_peak[l] = larger(merit.u_peak[l], told.u[l].abs());
        }
        for l in 0..LANES {
            merit.y[l] = larger(merit.y[l], y[l].abs() * inside);
            merit.sigma_star[l] = larger(merit.sigma_star[l], f64::from(told.sigma_star[l]).abs() * inside);
            merit.variation[l] += (told.u[l] - merit.u_last[l]).abs() * next;
            merit.u_last[l] = told.u[l];
        }
        for (flag, counts) in merit.ticks_with.iter_mut().enumerate() {
            for l in 0..LANES {
                counts[l] += u32::from(told.health[l] >> flag & 1);
            }
        }
    }
}

vectorised! {
    fn largest_all(most: &mut Wide, d: &Wide, d_hat: &Wide) {
        for l in 0..LANES {
            let error = (d[l] - d_hat[l]).abs();
            most[l] = if error > most[l] { error } else { most[l] };
        }
    }
}
