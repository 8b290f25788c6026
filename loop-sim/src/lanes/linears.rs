//! Vectorised plants with a step of their own: the step of [`Exact`], lane by lane.

use super::signals::{Signals, weigh_all};
use super::wide::Wide;
use super::{Instructions, LANES, Plants, Trial};
use crate::exact::{Exact, Lumped, Moved, Row, Share, TERMS, Wave, is_within};
use crate::plant::Plant;
use crate::sine;

/// Plants as vectors of coefficients.
pub(super) struct Linears<'a, const N: usize> {
    instructions: Instructions,
    plants: Vec<&'a dyn Plant>,
    numbers: Numbers<N>,
    /// Sine and cosine of x_1, computed in a separate loop. In the step their long chain of dependent operations would
    /// set its duration, rather than their number.
    turned: [Wide; 2],
    constant: [Wide; N],
    /// Share of the signals with ramp and jumps. `fallen` is the number of jumps in it.
    forced: [Wide; N],
    fallen: Option<usize>,
    ramp: Option<Box<[Wide; N]>>,
    jumps: Vec<(f64, Box<[Wide; N]>)>,
    waves: Vec<(Wave, Box<[[Wide; N]; 2]>)>,
    /// Coefficients of x_j and of u in d_i.
    d: [[Wide; N]; N],
    d_u: [Wide; N],
    /// Channel, factor and signal of each disturbance.
    signals: Vec<(usize, Box<Wide>, Signals)>,
    /// First plant, which represents the kind of all plants.
    exact: Exact,
}

/// Coefficients of [`Share`], lane by lane.
struct Numbers<const N: usize> {
    phi: [[Wide; N]; N],
    gamma: [Wide; N],
    g: [[Wide; N]; TERMS],
    row: [Wide; 3],
    /// Coefficient of the sine, equal in all lanes.
    sine: f64,
}

impl<'a, const N: usize> Linears<'a, N> {
    /// Builds the batch. Returns `None` if a plant is of another kind or has another period.
    pub(super) fn beside(
        instructions: Instructions,
        trials: &[Trial<'a>],
        period_s: f64,
    ) -> Option<Box<dyn Plants<N> + 'a>> {
        let of = |trial: &Trial<'a>| Some((trial.plant.exact()?, trial.plant.lumped_part()?));
        let parts: Vec<(&Exact, &Lumped)> = trials.iter().map(of).collect::<Option<_>>()?;
        let (exact, lumped) = *parts.first()?;
        let is_alike =
            |(of, other): &(&Exact, &Lumped)| of.is_alike(exact) && other.signals.len() == lumped.signals.len();
        if !parts.iter().all(is_alike) || exact.order != N || exact.period_s.to_bits() != period_s.to_bits() {
            return None;
        }
        // Lanes beyond the last trial copy the first.
        let of = |number: &dyn Fn(&Exact, &Lumped) -> f64| {
            Wide(std::array::from_fn(|l| {
                let (exact, lumped) = parts.get(l).unwrap_or(&parts[0]);
                number(exact, lumped)
            }))
        };
        let row = |row: &dyn for<'e> Fn(&'e Exact) -> &'e Row| -> [Wide; N] {
            std::array::from_fn(|i| of(&|exact, _| row(exact)[i]))
        };
        // A signal without terms adds nothing.
        let told = lumped
            .signals
            .iter()
            .enumerate()
            .filter(|(p, _)| parts.iter().any(|(_, lumped)| !lumped.signals[*p].2.terms().is_empty()));
        let signals = told.map(|(p, (channel, ..))| {
            let each: Vec<_> = parts.iter().map(|(_, lumped)| &lumped.signals[p].2).collect();
            (*channel, Box::new(of(&|_, lumped| lumped.signals[p].1)), Signals::new(&each))
        });
        let jumps = exact.jumps.iter().enumerate();
        let waves = exact.waves.iter().enumerate();
        Some(Box::new(Self {
            instructions,
            plants: trials.iter().map(|trial| trial.plant).collect(),
            numbers: Numbers {
                phi: std::array::from_fn(|i| row(&|exact| &exact.phi[i])),
                gamma: row(&|exact| &exact.gamma),
                g: std::array::from_fn(|j| row(&|exact| &exact.g[j])),
                row: std::array::from_fn(|i| of(&|exact, _| exact.row[i])),
                sine: exact.sine,
            },
            turned: [Wide::of_all(0.0); 2],
            constant: row(&|exact| &exact.constant),
            forced: [Wide::of_all(0.0); N],
            fallen: None,
            ramp: exact.ramp.map(|_| Box::new(row(&|exact| exact.ramp.as_ref().unwrap_or(&exact.constant)))),
            jumps: jumps.map(|(k, jump)| (jump.at_s, Box::new(row(&|exact| &exact.jumps[k].share)))).collect(),
            waves: waves
                .map(|(k, wave)| {
                    (*wave, Box::new([row(&|exact| &exact.waves[k].sin), row(&|exact| &exact.waves[k].cos)]))
                })
                .collect(),
            d: std::array::from_fn(|i| std::array::from_fn(|j| of(&|_, lumped| lumped.rows[i][j]))),
            d_u: std::array::from_fn(|i| of(&|_, lumped| lumped.of_u[i])),
            signals: signals.collect(),
            exact: exact.clone(),
        }))
    }

    /// Updates the share of all signals except sinusoids, term by term as in [`Exact`]. Mostly it does not change.
    fn force(&mut self, t_s: f64) {
        let fallen = self.jumps.iter().filter(|(at_s, _)| t_s >= *at_s).count();
        if self.ramp.is_none() && self.fallen == Some(fallen) {
            return;
        }
        self.fallen = Some(fallen);
        self.forced = self.constant;
        if let Some(ramp) = &self.ramp {
            add_all(self.instructions, &mut self.forced, ramp, t_s);
        }
        for (_, share) in self.jumps.iter().filter(|(at_s, _)| t_s >= *at_s) {
            add_all(self.instructions, &mut self.forced, share, 1.0);
        }
    }
}

impl<const N: usize> Plants<N> for Linears<'_, N> {
    fn turn(&mut self, x: &[Wide; N]) {
        if self.exact.has_sine {
            turn_all(self.instructions, &x[0], &mut self.turned);
        }
    }

    /// A tick with a jump inside is left to the solver.
    fn advance(&mut self, from_s: f64, to_s: f64, x: &mut [Wide; N], u: &Wide, lost: &mut Wide<u64>) {
        if self.exact.jumps_between(from_s, to_s) {
            for (l, plant) in self.plants.iter().enumerate() {
                super::alone(*plant, [from_s, to_s], u[l], x, l, lost);
            }
            return;
        }
        for step in 0..self.exact.steps {
            let t_s = self.exact.at(from_s, step);
            if step > 0 {
                self.turn(x);
            }
            self.force(t_s);
            let moved = self.exact.moved(t_s);
            let Self { instructions, ref numbers, ref turned, ref forced, ref waves, ref exact, .. } = *self;
            let (h_s, last) = (exact.h_s, waves.split_last());
            match (last, exact.has_sine) {
                (None, true) => step_all::<N, true>(instructions, numbers, x, u, turned, forced, &moved, h_s, lost),
                (None, false) => step_all::<N, false>(instructions, numbers, x, u, turned, forced, &moved, h_s, lost),
                (Some(((wave, pair), before)), has_sine) => {
                    let mut with_waves;
                    let mut forced = forced;
                    if !before.is_empty() {
                        with_waves = *forced;
                        for (wave, [sin, cos]) in before.iter().map(|(wave, pair)| (wave, &**pair)) {
                            wave_all(instructions, &mut with_waves, sin, cos, wave.at(t_s));
                        }
                        forced = &with_waves;
                    }
                    let at = wave.at(t_s);
                    let step = if has_sine { step_on_wave::<N, true> } else { step_on_wave::<N, false> };
                    step(instructions, numbers, x, u, turned, forced, pair, at, &moved, h_s, lost);
                }
            }
        }
    }

    fn note_estimate(&self, channel: usize, t_s: f64, x: &[Wide; N], u: &Wide, d_hat: &Wide, most: &mut Wide) {
        let (mut d, mut value) = (Wide::of_all(0.0), Wide::of_all(0.0));
        for (_, factor, signals) in self.signals.iter().filter(|(of, ..)| *of == channel) {
            if let Some(value) = signals.of_all(t_s) {
                weigh_all(self.instructions, &mut d, factor, value);
            } else {
                signals.value(self.instructions, t_s, &mut value);
                add_product_all(self.instructions, &mut d, factor, &value);
            }
        }
        let has_sine = self.exact.has_sine && channel == 1;
        let note = if has_sine { note_all::<N, true> } else { note_all::<N, false> };
        note(self.instructions, &self.d[channel], &self.d_u[channel], &d, x, u, &self.turned[0], d_hat, most);
    }
}

impl<const N: usize> Numbers<N> {
    /// Computes the step of one lane and whether it is valid.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn step<const SINE: bool>(
        &self,
        l: usize,
        x: &[Wide; N],
        u: f64,
        turned: &[Wide; 2],
        forced: [f64; N],
        moved: &Moved,
        h_s: f64,
    ) -> ([f64; N], bool) {
        let now: [f64; N] = std::array::from_fn(|i| x[i][l]);
        let share = Share {
            phi: std::array::from_fn(|i| std::array::from_fn(|j| self.phi[i][j][l])),
            gamma: std::array::from_fn(|i| self.gamma[i][l]),
            g: std::array::from_fn(|j| std::array::from_fn(|i| self.g[j][i][l])),
            row: std::array::from_fn(|i| self.row[i][l]),
            sine: self.sine,
        };
        let turned = [turned[0][l], turned[1][l]];
        (share.step::<SINE>(&now, u, &forced, moved, turned), is_within::<N, SINE>(&now, moved, h_s))
    }
}

vectorised! {
    fn turn_all[;](x: &Wide, turned: &mut [Wide; 2],) {
        for l in 0..LANES {
            let (sin, cos) = sine::sin_cos(x[l]);
            turned[0][l] = sin;
            turned[1][l] = cos;
        }
    }
}

vectorised! {
    fn step_all[N, SINE; const N: usize, const SINE: bool](
        numbers: &Numbers<N>,
        x: &mut [Wide; N],
        u: &Wide,
        turned: &[Wide; 2],
        forced: &[Wide; N],
        moved: &Moved,
        h_s: f64,
        lost: &mut Wide<u64>,
    ) {
        for l in 0..LANES {
            let forced = std::array::from_fn(|i| forced[i][l]);
            let (next, is_crossed) = numbers.step::<SINE>(l, x, u[l], turned, forced, moved, h_s);
            lost[l] |= u64::from(!is_crossed);
            for i in 0..N {
                x[i][l] = next[i];
            }
        }
    }
}

vectorised! {
    /// Computes the step with one sinusoid, from its sine and cosine at the beginning of the step.
    fn step_on_wave[N, SINE; const N: usize, const SINE: bool](
        numbers: &Numbers<N>,
        x: &mut [Wide; N],
        u: &Wide,
        turned: &[Wide; 2],
        forced: &[Wide; N],
        wave: &[[Wide; N]; 2],
        at: [f64; 2],
        moved: &Moved,
        h_s: f64,
        lost: &mut Wide<u64>,
    ) {
        for l in 0..LANES {
            let forced = std::array::from_fn(|i| forced[i][l] + (wave[0][i][l] * at[0] + wave[1][i][l] * at[1]));
            let (next, is_crossed) = numbers.step::<SINE>(l, x, u[l], turned, forced, moved, h_s);
            lost[l] |= u64::from(!is_crossed);
            for i in 0..N {
                x[i][l] = next[i];
            }
        }
    }
}

vectorised! {
    fn add_all[N; const N: usize](forced: &mut [Wide; N], share: &[Wide; N], factor: f64,) {
        for i in 0..N {
            for l in 0..LANES {
                forced[i][l] += share[i][l] * factor;
            }
        }
    }
}

vectorised! {
    fn add_product_all[;](sum: &mut Wide, factor: &Wide, value: &Wide,) {
        for l in 0..LANES {
            sum[l] += factor[l] * value[l];
        }
    }
}

vectorised! {
    fn wave_all[N; const N: usize](forced: &mut [Wide; N], sin: &[Wide; N], cos: &[Wide; N], at: [f64; 2],) {
        for i in 0..N {
            for l in 0..LANES {
                forced[i][l] += sin[i][l] * at[0] + cos[i][l] * at[1];
            }
        }
    }
}

vectorised! {
    /// Sums the disturbances in the order of [`Lumped::value`].
    fn note_all[N, SINE; const N: usize, const SINE: bool](
        row: &[Wide; N],
        of_u: &Wide,
        signals: &Wide,
        x: &[Wide; N],
        u: &Wide,
        sin: &Wide,
        d_hat: &Wide,
        most: &mut Wide,
    ) {
        for l in 0..LANES {
            let mut d = signals[l];
            for j in 0..N {
                d += row[j][l] * x[j][l];
            }
            d += of_u[l] * u[l];
            if SINE {
                d -= sin[l];
            }
            let error = (d - d_hat[l]).abs();
            most[l] = if error > most[l] { error } else { most[l] };
        }
    }
}
