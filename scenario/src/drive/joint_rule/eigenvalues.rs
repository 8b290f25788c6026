//! Eigenvalues of small real matrices: balancing, Hessenberg form, and the QR iteration with double shifts.
//!
//! The method is algorithm 7.5.2 of G. H. Golub and C. F. Van Loan, *Matrix Computations*; only eigenvalues are
//! computed. The matrices have a fixed capacity, of which the first `order` rows and columns count.

/// Largest order: five states of the plant, seven of the controller, and three queued inputs.
pub(super) const MOST: usize = 5 + 7 + 3;

/// Matrix of at most [`MOST`] rows and columns.
pub(super) type Square = [[f64; MOST]; MOST];

/// Real and imaginary part.
pub(super) type Complex = [f64; 2];

/// Largest number of iterations for one eigenvalue; three are usual.
const ROUNDS: usize = 60;

/// Returns the eigenvalues of the first `order` rows and columns. `None` if an entry is not finite or the iteration
/// fails.
pub(super) fn eigenvalues(mut a: Square, order: usize) -> Option<Vec<Complex>> {
    if !a[..order].iter().all(|row| row[..order].iter().all(|entry| entry.is_finite())) {
        return None;
    }
    balance(&mut a, order);
    reduce(&mut a, order);
    let mut found = Vec::with_capacity(2 * order);
    let (mut size, mut rounds) = (order, 0);
    while size > 0 {
        let last = size - 1;
        let low = (1..=last).rev().find(|&i| negligible(&mut a, i)).unwrap_or(0);
        if low == last {
            found.push([a[last][last], 0.0]);
            (size, rounds) = (last, 0);
        } else if low + 1 == last {
            found.extend(pair(a[low][low], a[low][last], a[last][low], a[last][last]));
            (size, rounds) = (low, 0);
        } else {
            rounds += 1;
            if rounds > ROUNDS {
                return None;
            }
            sweep(&mut a, low, last, rounds % 10 == 0);
        }
    }
    Some(found)
}

/// Sets an entry below the diagonal to 0 if it is within rounding.
fn negligible(a: &mut Square, i: usize) -> bool {
    let small = a[i][i - 1].abs() <= f64::EPSILON * (a[i][i].abs() + a[i - 1][i - 1].abs());
    if small {
        a[i][i - 1] = 0.0;
    }
    small
}

/// Returns the eigenvalues of ((a, b), (c, d)).
fn pair(a: f64, b: f64, c: f64, d: f64) -> [Complex; 2] {
    let (half, middle) = (0.5 * (a - d), 0.5 * (a + d));
    let square = half * half + b * c;
    let root = square.abs().sqrt();
    if square < 0.0 {
        return [[middle, root], [middle, -root]];
    }
    // The eigenvalue without cancellation; the determinant gives the other.
    let far = half + root.copysign(half);
    let near = if far == 0.0 { 0.0 } else { -b * c / far };
    [[d + far, 0.0], [d + near, 0.0]]
}

/// Scales rows and columns by powers of two until their norms are similar.
fn balance(a: &mut Square, order: usize) {
    for _ in 0..4 {
        let mut done = true;
        for i in 0..order {
            let (mut row, mut column) = (-a[i][i].abs(), -a[i][i].abs());
            for j in 0..order {
                (row, column) = (row + a[i][j].abs(), column + a[j][i].abs());
            }
            if !(row > 0.0 && column > 0.0) {
                continue;
            }
            let (mut factor, mut rest) = (1.0, row / column);
            while rest > 4.0 {
                (factor, rest) = (2.0 * factor, 0.25 * rest);
            }
            while rest < 0.25 {
                (factor, rest) = (0.5 * factor, 4.0 * rest);
            }
            if factor == 1.0 {
                continue;
            }
            done = false;
            for j in 0..order {
                a[i][j] /= factor;
            }
            for row in &mut a[..order] {
                row[i] *= factor;
            }
        }
        if done {
            return;
        }
    }
}

/// Reduces to Hessenberg form by elimination with the largest pivot.
fn reduce(a: &mut Square, order: usize) {
    for m in 1..order.saturating_sub(1) {
        let best = (m..order).max_by(|&i, &j| a[i][m - 1].abs().total_cmp(&a[j][m - 1].abs())).unwrap_or(m);
        if a[best][m - 1] == 0.0 {
            continue;
        }
        a.swap(m, best);
        for row in &mut a[..order] {
            row.swap(m, best);
        }
        for i in m + 1..order {
            let factor = a[i][m - 1] / a[m][m - 1];
            if factor != 0.0 {
                a[i][m - 1] = 0.0;
                for j in m..order {
                    a[i][j] -= factor * a[m][j];
                }
                for row in &mut a[..order] {
                    row[m] += factor * row[i];
                }
            }
        }
    }
}

/// Performs one implicit double step on rows low to last, at least three rows.
fn sweep(a: &mut Square, low: usize, last: usize, exceptional: bool) {
    let before = last - 1;
    let (mut s, mut t) =
        (a[before][before] + a[last][last], a[before][before] * a[last][last] - a[before][last] * a[last][before]);
    if exceptional {
        let size = a[last][before].abs() + a[before][before - 1].abs();
        (s, t) = (1.5 * size, size * size);
    }
    let mut v = [
        a[low][low] * (a[low][low] - s) + a[low][low + 1] * a[low + 1][low] + t,
        a[low + 1][low] * (a[low][low] + a[low + 1][low + 1] - s),
        a[low + 1][low] * a[low + 2][low + 1],
    ];
    for k in low..last {
        // Two rows at the end: the third is the second again, by 0.
        let third = (k + 2).min(last);
        let norm = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        if norm != 0.0 {
            let alpha = norm.copysign(v[0]);
            v[0] += alpha;
            let beta = 1.0 / (alpha * v[0]);
            for j in k.saturating_sub(1).max(low)..=last {
                let dot = beta * (v[0] * a[k][j] + v[1] * a[k + 1][j] + v[2] * a[third][j]);
                a[k][j] -= dot * v[0];
                a[k + 1][j] -= dot * v[1];
                a[third][j] -= dot * v[2];
            }
            for row in &mut a[low..=last.min(k + 3)] {
                let dot = beta * (v[0] * row[k] + v[1] * row[k + 1] + v[2] * row[third]);
                row[k] -= dot * v[0];
                row[k + 1] -= dot * v[1];
                row[third] -= dot * v[2];
            }
        }
        v = [a[k + 1][k], if k + 2 <= last { a[k + 2][k] } else { 0.0 }, if k + 3 <= last { a[k + 3][k] } else { 0.0 }];
    }
}
