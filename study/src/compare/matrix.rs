//! Matrices of sampled control: the step of a tick, the gain of the regulator, pole placement.
//!
//! $$ \Phi = e^{A T}, \qquad \Gamma = \int_0^T e^{A s} B \thinspace ds $$
//!
//! and the stabilising solution of the discrete algebraic Riccati equation
//!
//! $$ X = A^T X (I + G X)^{-1} A + Q, \qquad G = B R^{-1} B^T $$
//!
//! by doubling (Anderson 1978): each iteration squares the closed loop, so twenty iterations cover a million ticks.

use nalgebra::DMatrix;

pub(crate) type Matrix = DMatrix<f64>;

/// Returns e^A from the series of A/2^k.
pub(crate) fn exp(a: &Matrix) -> Matrix {
    let norm = a.iter().fold(0.0_f64, |norm, entry| norm.max(entry.abs())) * a.nrows() as f64;
    let halvings = libm::ceil(libm::log2(4.0 * norm.max(0.25))) as u32;
    let a = a / libm::exp2(f64::from(halvings));
    let one = Matrix::identity(a.nrows(), a.nrows());
    let (mut sum, mut term) = (one.clone(), one);
    for k in 1..16 {
        term = &term * &a / f64::from(k);
        sum += &term;
    }
    (0..halvings).fold(sum, |e, _| &e * &e)
}

/// Returns Φ and Γ for held inputs.
pub(super) fn held(a: &Matrix, b: &Matrix, period_s: f64) -> (Matrix, Matrix) {
    let (n, m) = (a.nrows(), b.ncols());
    let mut whole = Matrix::zeros(n + m, n + m);
    whole.view_mut((0, 0), (n, n)).copy_from(a);
    whole.view_mut((0, n), (n, m)).copy_from(b);
    let e = exp(&(whole * period_s));
    (e.view((0, 0), (n, n)).into(), e.view((0, n), (n, m)).into())
}

/// Returns X of the Riccati equation; `None` if no solution is found.
pub(super) fn riccati(a: &Matrix, b: &Matrix, q: &Matrix, r: &Matrix) -> Option<Matrix> {
    let n = a.nrows();
    let (mut a, mut g, mut x) = (a.clone(), b * r.clone().try_inverse()? * b.transpose(), q.clone());
    for _ in 0..60 {
        let factors = (Matrix::identity(n, n) + &g * &x).lu();
        let (through, spread) = (factors.solve(&a)?, factors.solve(&g)?);
        let more = a.transpose() * &x * &through;
        g += &a * spread * a.transpose();
        x += &more;
        a = &a * through;
        if more.norm() <= 1e-14 * x.norm() {
            return x.iter().all(|entry| entry.is_finite()).then_some(x);
        }
    }
    None
}

/// Returns K = (R + BᵀXB)⁻¹ BᵀXA: u = -K x minimises the sum of xᵀQx + uᵀRu.
pub(super) fn regulator(a: &Matrix, b: &Matrix, q: &Matrix, r: &Matrix) -> Option<Matrix> {
    let x = riccati(a, b, q, r)?;
    (r + b.transpose() * &x * b).lu().solve(&(b.transpose() * x * a))
}

/// Returns L = P Cᵀ (C P Cᵀ + R)⁻¹, with which a sample corrects the prediction for its own instant.
pub(super) fn kalman(a: &Matrix, c: &Matrix, q: &Matrix, r: &Matrix) -> Option<Matrix> {
    let p = riccati(&a.transpose(), &c.transpose(), q, r)?;
    let seen = c * &p;
    Some((c * seen.transpose() + r).lu().solve(&seen)?.transpose())
}

/// Returns Ackermann's row e_nᵀ (b, Ab, ..)⁻¹ p(A) for p with these real roots. For n roots it is the gain K that gives
/// A - bK these poles. For n - 1 roots it is the surface S on which they remain, S b = 1.
pub(super) fn ackermann(a: &Matrix, b: &Matrix, roots: &[f64]) -> Option<Matrix> {
    let n = a.nrows();
    let mut reach = Matrix::zeros(n, n);
    let mut column = b.clone();
    for j in 0..n {
        reach.set_column(j, &column.column(0));
        column = a * column;
    }
    let mut last = Matrix::zeros(n, 1);
    last[n - 1] = 1.0;
    let mut row = reach.transpose().lu().solve(&last)?.transpose();
    for &root in roots {
        row = &row * a - &row * root;
    }
    row.iter().all(|entry| entry.is_finite()).then_some(row)
}

#[cfg(test)]
mod tests {
    use nalgebra::ComplexField;

    use super::*;
    use crate::margins::eigenvalues;

    fn spectral_radius(a: &Matrix) -> f64 {
        let poles = eigenvalues(a.clone()).expect("numbers");
        poles.first().map_or(0.0, |z| z.modulus())
    }

    fn matrix(rows: usize, entries: &[f64]) -> Matrix {
        Matrix::from_row_slice(rows, entries.len() / rows, entries)
    }

    #[test]
    fn a_held_input_moves_a_chain_as_its_closed_form_says() {
        let (phi, gamma) = held(&matrix(2, &[0.0, 1.0, 0.0, -3.0]), &matrix(2, &[0.0, 2.0]), 0.4);
        let left = (-1.2_f64).exp();
        let expected = [1.0, (1.0 - left) / 3.0, 0.0, left];
        assert!((phi - matrix(2, &expected)).norm() < 1e-14);
        let moved = [2.0 * (0.4 - (1.0 - left) / 3.0) / 3.0, 2.0 * (1.0 - left) / 3.0];
        assert!((gamma - matrix(2, &moved)).norm() < 1e-14);
        // A rotation by 90 rad needs many halvings.
        let turned = exp(&matrix(2, &[0.0, 90.0, -90.0, 0.0]));
        assert!((turned[0] - 90.0_f64.cos()).abs() < 1e-11 && (turned[1] + 90.0_f64.sin()).abs() < 1e-11);
    }

    /// Closed form x² - (a² - 1 + q b²/r) x r/b² - q r/b² = 0 for one state.
    #[test]
    fn the_riccati_equation_of_one_state_has_its_closed_form() {
        for (a, b, q, r) in [(1.0_f64, 1.0_f64, 1.0_f64, 1.0_f64), (1.3, 0.2, 0.01, 5.0), (0.5, 3.0, 2.0, 0.1)] {
            let one = |value: f64| matrix(1, &[value]);
            let found = riccati(&one(a), &one(b), &one(q), &one(r)).expect("a solution")[0];
            let half = 0.5 * ((a * a - 1.0) * r / (b * b) + q);
            let expected = half + (half * half + q * r / (b * b)).sqrt();
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} of {expected}");
        }
    }

    #[test]
    fn the_riccati_equation_is_solved_and_its_gain_is_the_best() {
        let (a, b) =
            held(&matrix(3, &[0.0, 1.0, 0.0, -4.0, 0.3, 1.0, 0.0, 0.0, 0.1]), &matrix(3, &[0.0, 0.0, 1.0]), 0.1);
        let (q, r) = (Matrix::from_diagonal(&nalgebra::dvector![1.0, 0.2, 0.0]), matrix(1, &[0.05]));
        let x = riccati(&a, &b, &q, &r).expect("a solution");
        let inner = (&r + b.transpose() * &x * &b).try_inverse().expect("positive");
        let residual = a.transpose() * &x * &a - &x + &q - a.transpose() * &x * &b * inner * b.transpose() * &x * &a;
        assert!(residual.norm() < 1e-12 * x.norm(), "{residual}");
        let k = regulator(&a, &b, &q, &r).expect("a gain");
        let closed = &a - &b * &k;
        assert!(spectral_radius(&closed) < 1.0 && spectral_radius(&a) > 1.0);
        // xᵀXx is the true sum, and any other gain costs more.
        let cost = |k: &Matrix| {
            let mut x = matrix(3, &[1.0, -2.0, 0.5]);
            (0..3000).fold(0.0, |sum, _| {
                let u = -(k * &x);
                let step = (x.transpose() * &q * &x)[0] + r[0] * u[0] * u[0];
                x = &a * &x + &b * u;
                sum + step
            })
        };
        let start = matrix(3, &[1.0, -2.0, 0.5]);
        let told = (start.transpose() * &x * &start)[0];
        assert!((cost(&k) / told - 1.0).abs() < 1e-10);
        assert!(cost(&(&k * 1.05)) > told && cost(&(&k * 0.95)) > told);
    }

    /// For one state P = AP(1 - L)A + Q, and L = P/(P + R).
    #[test]
    fn the_gain_of_a_kalman_filter_is_its_closed_form() {
        let one = |value: f64| matrix(1, &[value]);
        let (a, q, r) = (0.9, 0.3, 2.0);
        let l = kalman(&one(a), &one(1.0), &one(q), &one(r)).expect("a gain")[0];
        let p = l * r / (1.0 - l);
        assert!((a * a * p * (1.0 - l) + q - p).abs() < 1e-13 * p);
    }

    #[test]
    fn poles_lie_where_they_were_asked_for() {
        let (a, b) =
            held(&matrix(3, &[0.0, 1.0, 0.0, -40.0, -0.3, 40.0, 0.0, 0.0, -2.0]), &matrix(3, &[0.0, 0.0, 1.0]), 0.01);
        let roots = [0.9, 0.8, 0.7];
        let closed = &a - &b * ackermann(&a, &b, &roots).expect("a gain");
        for root in roots {
            assert!((closed.clone() - Matrix::identity(3, 3) * root).determinant().abs() < 1e-12);
        }
        assert!((spectral_radius(&closed) - 0.9).abs() < 1e-9);
        let surface = ackermann(&a, &b, &roots[..2]).expect("a surface");
        assert!(((&surface * &b)[0] - 1.0).abs() < 1e-10);
        // The u that keeps S x = 0 leaves the other two poles and a zero.
        let slid = &a - &b * (&surface * &a);
        for root in [0.9, 0.8, 0.0] {
            assert!((slid.clone() - Matrix::identity(3, 3) * root).determinant().abs() < 1e-12, "{root}");
        }
    }
}
