//! Small dense matrices in `const fn`: products, linear equations, and the Riccati equation of sampled systems.
//!
//! $$ P = Q + A^\top P \thinspace (I + G P)^{-1} A $$
//!
//! For $A = \Phi$, $G = \Gamma \Gamma^\top/\rho$ the solution is the cost of the linear quadratic regulator. For
//! $A = F^\top$, $G = C^\top R^{-1} C$ the solution is the predicted covariance of a Kalman filter. The equation is
//! solved by doubling. Each round equals as many steps of the recursion as all rounds before it (B. D. O. Anderson,
//! *Second-order convergent algorithms for the steady-state Riccati equation*, Int. J. Control 28, 1978):
//!
//! $$ W = (I + G P)^{-1}, \quad A \leftarrow A W A, \quad G \leftarrow G + A W G A^\top, \quad
//!    P \leftarrow P + A^\top P W A $$
//!
//! Ten to twenty rounds suffice for any time constants. No number of this module is used in a tick.

/// Maximum number of doubling rounds: 2^40 steps of the recursion exceed any time constant.
const ROUNDS: usize = 40;

pub(crate) type Matrix<const R: usize, const C: usize> = [[f64; C]; R];

/// Returns the product a b.
pub(crate) const fn times<const R: usize, const K: usize, const C: usize>(
    a: &Matrix<R, K>,
    b: &Matrix<K, C>,
) -> Matrix<R, C> {
    let mut out = [[0.0; C]; R];
    let mut i = 0;
    while i < R {
        let mut j = 0;
        while j < C {
            let mut k = 0;
            while k < K {
                out[i][j] += a[i][k] * b[k][j];
                k += 1;
            }
            j += 1;
        }
        i += 1;
    }
    out
}

/// Returns a transposed.
pub(crate) const fn transposed<const R: usize, const C: usize>(a: &Matrix<R, C>) -> Matrix<C, R> {
    let mut out = [[0.0; R]; C];
    let mut i = 0;
    while i < R {
        let mut j = 0;
        while j < C {
            out[j][i] = a[i][j];
            j += 1;
        }
        i += 1;
    }
    out
}

/// Returns a + factor b.
pub(crate) const fn plus<const R: usize, const C: usize>(
    a: &Matrix<R, C>,
    b: &Matrix<R, C>,
    factor: f64,
) -> Matrix<R, C> {
    let mut out = *a;
    let mut i = 0;
    while i < R {
        let mut j = 0;
        while j < C {
            out[i][j] += factor * b[i][j];
            j += 1;
        }
        i += 1;
    }
    out
}

pub(crate) const fn identity<const S: usize>() -> Matrix<S, S> {
    let mut out = [[0.0; S]; S];
    let mut i = 0;
    while i < S {
        out[i][i] = 1.0;
        i += 1;
    }
    out
}

/// Returns x of a x = y, column by column, by elimination with the largest pivot of each column.
pub(crate) const fn solved<const S: usize, const C: usize>(mut a: Matrix<S, S>, mut y: Matrix<S, C>) -> Matrix<S, C> {
    let mut k = 0;
    while k < S {
        let (mut best, mut i) = (k, k + 1);
        while i < S {
            if a[i][k].abs() > a[best][k].abs() {
                best = i;
            }
            i += 1;
        }
        (a[k], a[best], y[k], y[best]) = (a[best], a[k], y[best], y[k]);
        let mut i = k + 1;
        while i < S {
            let factor = a[i][k] / a[k][k];
            let mut j = 0;
            while j < S {
                a[i][j] += -factor * a[k][j];
                j += 1;
            }
            let mut j = 0;
            while j < C {
                y[i][j] -= factor * y[k][j];
                j += 1;
            }
            i += 1;
        }
        k += 1;
    }
    while k > 0 {
        k -= 1;
        let mut j = k + 1;
        while j < S {
            let mut c = 0;
            while c < C {
                y[k][c] -= a[k][j] * y[j][c];
                c += 1;
            }
            j += 1;
        }
        let mut c = 0;
        while c < C {
            y[k][c] /= a[k][k];
            c += 1;
        }
    }
    y
}

/// Returns P of the Riccati equation in the module documentation.
pub(crate) const fn riccati<const S: usize>(
    mut a: Matrix<S, S>,
    mut g: Matrix<S, S>,
    mut p: Matrix<S, S>,
) -> Matrix<S, S> {
    let mut round = 0;
    while round < ROUNDS {
        let w = solved(plus(&identity(), &times(&g, &p), 1.0), identity());
        let (wa, awg) = (times(&w, &a), times(&times(&a, &w), &g));
        let more = times(&times(&transposed(&a), &p), &wa);
        g = symmetric(&plus(&g, &times(&awg, &transposed(&a)), 1.0));
        a = times(&a, &wa);
        p = symmetric(&plus(&p, &more, 1.0));
        let (mut i, mut stands) = (0, true);
        while i < S {
            // The diagonal of the added matrix is never below 0.
            stands = stands && more[i][i] <= 1e-15 * p[i][i];
            i += 1;
        }
        if stands {
            return p;
        }
        round += 1;
    }
    p
}

/// Returns the symmetric part, so that rounding cannot grow into a skew part.
const fn symmetric<const S: usize>(a: &Matrix<S, S>) -> Matrix<S, S> {
    let mut out = *a;
    let mut i = 0;
    while i < S {
        let mut j = 0;
        while j < S {
            out[i][j] = 0.5 * (a[i][j] + a[j][i]);
            j += 1;
        }
        i += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    /// Compares a double integrator of period 1 with the recursion itself, step by step.
    #[test]
    fn doubling_ends_where_the_recursion_ends() {
        let (a, q) = ([[1.0, 1.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, 0.3]]);
        for rho in [1e-3, 1.0, 1e6] {
            let b = [[0.5], [1.0]];
            let g = times(&b, &transposed(&b)).map(|row| row.map(|entry| entry / rho));
            let p = riccati(a, g, q);
            let mut step = q;
            for _ in 0..4000 {
                let w = solved(plus(&identity(), &times(&g, &step), 1.0), identity());
                step = plus(&q, &times(&times(&transposed(&a), &step), &times(&w, &a)), 1.0);
            }
            for (found, expected) in p.as_flattened().iter().zip(step.as_flattened()) {
                assert!((found / expected - 1.0).abs() < 1e-9, "rho {rho}: {p:?} for {step:?}");
            }
        }
    }

    #[test]
    fn equations_are_solved() {
        let a = [[0.0, 2.0, 1.0], [1.0, -1.0, 3.0], [4.0, 0.5, 0.0]];
        let x = [[1.0, 2.0], [-3.0, 0.5], [0.25, 8.0]];
        let found = solved(a, times(&a, &x));
        for (found, expected) in found.as_flattened().iter().zip(x.as_flattened()) {
            assert!((found - expected).abs() < 1e-14, "{found} for {expected}");
        }
    }
}
