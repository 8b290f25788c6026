//! Matrix exponential of a step: the plant, augmented by its signals and the sine as further states.

use super::{LinearPart, MOST, Row, TERMS};
use crate::MAX_ORDER;
use crate::signal::Term;

/// Number of rows: the states, the polynomial of the sine, a constant and a ramp per channel, and a pair per frequency.
const SIZE: usize = MAX_ORDER + TERMS + 2 * MAX_ORDER + 2 * MOST;

/// exp(M h) - I of the augmented plant.
pub(super) struct Augmented {
    order: usize,
    e: Box<Square>,
    /// Frequency and channel of each pair of states at the end.
    pairs: [(f64, usize); MOST],
    count: usize,
}

impl Augmented {
    pub(super) fn new(plant: &LinearPart<'_>, h_s: f64) -> Option<Self> {
        let n = plant.order;
        let mut m = [[0.0; SIZE]; SIZE];
        for i in 0..n {
            m[i][..n].copy_from_slice(&plant.a[i][..n]);
        }
        // A chain of integrators ends in e_2. Its last state gives phi_1, the one before it phi_2, and so on.
        let sine = n;
        m[1][sine + TERMS - 1] = plant.sine;
        for j in 1..TERMS {
            m[sine + j][sine + j - 1] = 1.0;
        }
        let chains = sine + TERMS;
        for i in 0..n {
            m[i][chains + 2 * i] = 1.0;
            m[chains + 2 * i][chains + 2 * i + 1] = 1.0;
        }
        let (mut pairs, mut count) = ([(0.0, 0); MOST], 0);
        let at = chains + 2 * n;
        for (channel, _, signal) in plant.signals {
            for term in signal.terms() {
                let (Term::Sin { omega_rad_s, .. } | Term::Cos { omega_rad_s, .. }) = *term else { continue };
                if pairs[..count].contains(&(omega_rad_s, *channel)) {
                    continue;
                }
                *pairs.get_mut(count)? = (omega_rad_s, *channel);
                let pair = at + 2 * count;
                m[*channel][pair] = 1.0;
                m[pair][pair + 1] = omega_rad_s;
                m[pair + 1][pair] = -omega_rad_s;
                count += 1;
            }
        }
        let size = at + 2 * count;
        let e = exponential(&m, size, h_s)?;
        Some(Self { order: n, e, pairs, count })
    }

    pub(super) fn column(&self, at: usize) -> Row {
        std::array::from_fn(|i| if i < self.order { self.e[i][at] } else { 0.0 })
    }

    pub(super) fn phi(&self) -> [Row; MAX_ORDER] {
        let own = |i: usize, j: usize| if i == j { 1.0 + self.e[i][j] } else { self.e[i][j] };
        let n = self.order;
        std::array::from_fn(|i| std::array::from_fn(|j| if i < n && j < n { own(i, j) } else { 0.0 }))
    }

    /// Returns the share of a constant 1 in a channel.
    pub(super) fn constant(&self, channel: usize) -> Row {
        self.column(self.order + TERMS + 2 * channel)
    }

    /// Returns the share of a ramp in a channel: the time since the beginning of the step.
    pub(super) fn ramp(&self, channel: usize) -> Row {
        self.column(self.order + TERMS + 2 * channel + 1)
    }

    /// Returns the share of sin ω t in a channel: the factors of the sine and the cosine at the beginning of the step.
    pub(super) fn wave(&self, channel: usize, omega_rad_s: f64) -> Option<(Row, Row)> {
        let pair = self.pairs[..self.count].iter().position(|pair| *pair == (omega_rad_s, channel))?;
        let at = self.order + TERMS + 2 * self.order + 2 * pair;
        Some((self.column(at), self.column(at + 1)))
    }
}

type Square = [[f64; SIZE]; SIZE];

/// Returns exp(M h) - I of the first `size` rows by squaring, or `None` if it is not finite.
fn exponential(m: &Square, size: usize, h_s: f64) -> Option<Box<Square>> {
    let norm = m[..size].iter().map(|row| row[..size].iter().map(|entry| entry.abs()).sum::<f64>()).fold(0.0, f64::max);
    let mut scale = norm * h_s;
    if !scale.is_finite() || scale >= 1e12 {
        return None;
    }
    let mut halvings = 0;
    let mut h_s = h_s;
    while scale > 0.5 {
        scale *= 0.5;
        h_s *= 0.5;
        halvings += 1;
    }
    let none = || Box::new([[0.0; SIZE]; SIZE]);
    let (mut a, mut e, mut c) = (none(), none(), none());
    for (row, of_m) in a[..size].iter_mut().zip(m) {
        for (entry, of_m) in row[..size].iter_mut().zip(of_m) {
            *entry = of_m * h_s;
        }
    }
    // E <- A (I + E)/k: the terms from the last to the first, to 1e-17 at norm 1/2.
    for k in (1..=14).rev() {
        for (i, row) in e[..size].iter_mut().enumerate() {
            row[i] += 1.0;
        }
        product(&a, &e, size, &mut c);
        std::mem::swap(&mut e, &mut c);
        let k = f64::from(k);
        e[..size].iter_mut().flat_map(|row| &mut row[..size]).for_each(|entry| *entry /= k);
    }
    // I is kept apart, so that the doubling loses no digits.
    for _ in 0..halvings {
        product(&e, &e, size, &mut c);
        for (row, square) in e[..size].iter_mut().zip(c.iter()) {
            for (entry, square) in row[..size].iter_mut().zip(square) {
                *entry = 2.0 * *entry + square;
            }
        }
    }
    e[..size].iter().flatten().all(|entry| entry.is_finite()).then_some(e)
}

/// Computes C = A B of the first `size` rows and columns. Zero factors are skipped, as most of the entries are 0.
fn product(a: &Square, b: &Square, size: usize, c: &mut Square) {
    for (c, a) in c[..size].iter_mut().zip(a) {
        c[..size].fill(0.0);
        for (b, &factor) in b[..size].iter().zip(a) {
            if factor != 0.0 {
                for (c, b) in c[..size].iter_mut().zip(b) {
                    *c += factor * b;
                }
            }
        }
    }
}
