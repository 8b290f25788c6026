//! Many plants as numbers side by side, and their step: what [`Exact`] does, lane by lane.

use super::{LANES, Wide};
use crate::MAX_ORDER;
use crate::exact::{Exact, Lumped, Moved, Share, TERMS, Wave};
use crate::signal::Signal;

fn sine_and_cosine(angle: f64) -> [f64; 2] {
    [libm::sin(angle), libm::cos(angle)]
}

/// The plants, number by number.
pub(super) struct Plants<const N: usize> {
    steps: usize,
    has_sine: bool,
    h_s: f64,
    phi: [[Wide; N]; N],
    gamma: [Wide; N],
    g: [[Wide; N]; TERMS],
    row: [Wide; 3],
    constant: [Wide; N],
    /// With ramp and jumps; how many jumps are in it.
    forced: [Wide; N],
    fallen: Option<usize>,
    ramp: Option<Box<[Wide; N]>>,
    jumps: Vec<(f64, Box<[Wide; N]>)>,
    waves: Vec<(f64, Box<[[Wide; N]; 2]>)>,
    /// Of d_i: what x_j adds, what u adds.
    d: [[Wide; N]; N],
    d_u: [Wide; N],
    /// Channel of each signal, its factor, and the signal itself, one for all lanes or one of each.
    signals: Vec<(usize, Wide, Vec<Signal>)>,
    exact: Exact,
}

/// The same for lanes beyond the last.
fn of_lanes(parts: &[(&Exact, &Lumped)], of: impl Fn(&Exact, &Lumped) -> f64) -> Wide {
    std::array::from_fn(|l| {
        let (exact, lumped) = parts.get(l).unwrap_or(&parts[0]);
        of(exact, lumped)
    })
}

impl<const N: usize> Plants<N> {
    pub(super) fn new(parts: &[(&Exact, &Lumped)]) -> Box<Self> {
        let (exact, lumped) = parts[0];
        let of = |of: &dyn Fn(&Exact, &Lumped) -> f64| of_lanes(parts, of);
        let wave = |k: usize, which: fn(&Wave) -> &[f64; MAX_ORDER]| -> [Wide; N] {
            std::array::from_fn(|i| of(&|exact, _| which(&exact.waves()[k])[i]))
        };
        let signals = lumped.signals.iter().enumerate().map(|(p, (channel, ..))| {
            let each: Vec<Signal> = parts.iter().map(|(_, lumped)| lumped.signals[p].2.clone()).collect();
            let is_one = each.iter().all(|signal| *signal == each[0]);
            let each = if is_one { vec![each[0].clone()] } else { each };
            (*channel, of(&|_, lumped| lumped.signals[p].1), each)
        });
        Box::new(Self {
            steps: exact.steps,
            has_sine: exact.has_sine,
            h_s: exact.period_s / exact.steps as f64,
            phi: std::array::from_fn(|i| std::array::from_fn(|j| of(&|exact, _| exact.phi[i][j]))),
            gamma: std::array::from_fn(|i| of(&|exact, _| exact.gamma[i])),
            g: std::array::from_fn(|j| std::array::from_fn(|i| of(&|exact, _| exact.g[j][i]))),
            row: std::array::from_fn(|i| of(&|exact, _| exact.row[i])),
            constant: std::array::from_fn(|i| of(&|exact, _| exact.constant[i])),
            forced: [[0.0; LANES]; N],
            fallen: None,
            ramp: exact.has_ramp.then(|| Box::new(std::array::from_fn(|i| of(&|exact, _| exact.ramp[i])))),
            jumps: (0..exact.falls().len())
                .map(|k| {
                    let share = std::array::from_fn(|i| of(&|exact, _| exact.falls()[k].share[i]));
                    (exact.falls()[k].at_s, Box::new(share))
                })
                .collect(),
            waves: (0..exact.waves().len())
                .map(|k| {
                    let pair = [wave(k, |wave| &wave.sin), wave(k, |wave| &wave.cos)];
                    (exact.waves()[k].omega_rad_s, Box::new(pair))
                })
                .collect(),
            d: std::array::from_fn(|i| std::array::from_fn(|j| of(&|_, lumped| lumped.rows[i][j]))),
            d_u: std::array::from_fn(|i| of(&|_, lumped| lumped.of_u[i])),
            signals: signals.collect(),
            exact: exact.clone(),
        })
    }

    /// All over a tick; a lane that leaves the range of the step is marked.
    pub(super) fn advance(&mut self, from_s: f64, x: &mut [Wide; N], u: &Wide, lost: &mut [u64; LANES]) {
        for step in 0..self.steps {
            let t_s = self.exact.at(from_s, step);
            self.force(t_s);
            let moved = self.moved(t_s);
            match (&self.waves[..], self.has_sine) {
                ([], true) => step_all::<N, true>(self, x, u, &self.forced, &moved, lost),
                ([], false) => step_all::<N, false>(self, x, u, &self.forced, &moved, lost),
                ([(omega_rad_s, pair)], has_sine) => {
                    let at = sine_and_cosine(omega_rad_s * t_s);
                    if has_sine {
                        step_on_wave::<N, true>(self, x, u, pair, at, &moved, lost);
                    } else {
                        step_on_wave::<N, false>(self, x, u, pair, at, &moved, lost);
                    }
                }
                (waves, has_sine) => {
                    let mut forced = self.forced;
                    for (omega_rad_s, pair) in waves {
                        wave_all(&mut forced, pair, sine_and_cosine(omega_rad_s * t_s));
                    }
                    if has_sine {
                        step_all::<N, true>(self, x, u, &forced, &moved, lost);
                    } else {
                        step_all::<N, false>(self, x, u, &forced, &moved, lost);
                    }
                }
            }
        }
    }

    /// What all but the sinusoids add, term by term as [`Exact`] does: mostly what it was.
    fn force(&mut self, t_s: f64) {
        let fallen = self.jumps.iter().filter(|(at_s, _)| t_s >= *at_s).count();
        if self.ramp.is_none() && self.fallen == Some(fallen) {
            return;
        }
        self.fallen = Some(fallen);
        self.forced = self.constant;
        if let Some(ramp) = &self.ramp {
            add_all(&mut self.forced, ramp, t_s);
        }
        for (_, share) in self.jumps.iter().filter(|(at_s, _)| t_s >= *at_s) {
            add_all(&mut self.forced, share, 1.0);
        }
    }

    /// One lane's step, and whether it is one.
    #[inline(always)]
    fn step<const SINE: bool>(
        &self,
        l: usize,
        x: &[Wide; N],
        u: f64,
        forced: [f64; N],
        moved: &Moved,
    ) -> ([f64; N], bool) {
        let now: [f64; N] = std::array::from_fn(|i| x[i][l]);
        let share = Share {
            phi: std::array::from_fn(|i| std::array::from_fn(|j| self.phi[i][j][l])),
            gamma: std::array::from_fn(|i| self.gamma[i][l]),
            g: std::array::from_fn(|j| std::array::from_fn(|i| self.g[j][i][l])),
            row: std::array::from_fn(|i| self.row[i][l]),
        };
        (share.step::<SINE>(&now, u, &forced, moved), Exact::is_within::<N, SINE>(&now, moved, self.h_s))
    }

    /// The same in every lane, or none: signals of the first rows differ from lane to lane only in campaigns that are
    /// not run here.
    fn moved(&self, t_s: f64) -> Moved {
        self.exact.moved(t_s)
    }

    /// d of a channel.
    pub(super) fn lumped(&self, channel: usize, t_s: f64, x: &[Wide; N], u: &Wide, d: &mut Wide) {
        *d = [0.0; LANES];
        for (_, factor, each) in self.signals.iter().filter(|(of, ..)| *of == channel) {
            if let [signal] = &each[..] {
                let value = signal.value(t_s);
                for l in 0..LANES {
                    d[l] += factor[l] * value;
                }
            } else {
                for (l, signal) in each.iter().enumerate() {
                    d[l] += factor[l] * signal.value(t_s);
                }
            }
        }
        lumped_all(&self.d[channel], &self.d_u[channel], self.has_sine && channel == 1, x, u, d);
    }
}

vectorised! {
    fn step_all<const N: usize, const SINE: bool>(
        plants: &Plants<N>,
        x: &mut [Wide; N],
        u: &Wide,
        forced: &[Wide; N],
        moved: &Moved,
        lost: &mut [u64; LANES],
    ) {
        for l in 0..LANES {
            let (next, is_crossed) = plants.step::<SINE>(l, x, u[l], std::array::from_fn(|i| forced[i][l]), moved);
            lost[l] |= u64::from(!is_crossed);
            for i in 0..N {
                x[i][l] = next[i];
            }
        }
    }
}

vectorised! {
    /// The same under one sinusoid: its sine and cosine are those at the beginning of the step.
    fn step_on_wave<const N: usize, const SINE: bool>(
        plants: &Plants<N>,
        x: &mut [Wide; N],
        u: &Wide,
        wave: &[[Wide; N]; 2],
        [sin, cos]: [f64; 2],
        moved: &Moved,
        lost: &mut [u64; LANES],
    ) {
        for l in 0..LANES {
            let forced = std::array::from_fn(|i| plants.forced[i][l] + (wave[0][i][l] * sin + wave[1][i][l] * cos));
            let (next, is_crossed) = plants.step::<SINE>(l, x, u[l], forced, moved);
            lost[l] |= u64::from(!is_crossed);
            for i in 0..N {
                x[i][l] = next[i];
            }
        }
    }
}

vectorised! {
    fn add_all<const N: usize>(forced: &mut [Wide; N], share: &[Wide; N], factor: f64) {
        for i in 0..N {
            for l in 0..LANES {
                forced[i][l] += share[i][l] * factor;
            }
        }
    }
}

vectorised! {
    fn wave_all<const N: usize>(forced: &mut [Wide; N], pair: &[[Wide; N]; 2], [sin, cos]: [f64; 2]) {
        for i in 0..N {
            for l in 0..LANES {
                forced[i][l] += pair[0][i][l] * sin + pair[1][i][l] * cos;
            }
        }
    }
}

vectorised! {
    fn lumped_all<const N: usize>(row: &[Wide; N], of_u: &Wide, has_sine: bool, x: &[Wide; N], u: &Wide, d: &mut Wide) {
        for j in 0..N {
            for l in 0..LANES {
                d[l] += row[j][l] * x[j][l];
            }
        }
        for l in 0..LANES {
            d[l] += of_u[l] * u[l];
        }
        if has_sine {
            for l in 0..LANES {
                d[l] -= crate::sine::sin_cos(x[0][l]).0;
            }
        }
    }
}
