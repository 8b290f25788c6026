//! Reduces a curve of twenty thousand samples to a few hundred points without a visible change.
//!
//! Consecutive points in one pixel column are replaced by the first, the last and the outermost points, in their order.
//! So no peak is lost, and a loop of a phase plane keeps its turning points. Then points are removed that lie nearly on
//! the line between their neighbours.

use std::fmt::Write;

/// Point, px.
pub(super) type Pixel = (f64, f64);

/// Largest distance of a removed point from the line, px. It is invisible, and five times the resolution of the file.
const STRAIGHT_PX: f64 = 0.025;

/// Splits the points at each `None`, thins every piece, and returns the pieces.
pub(super) fn pieces(points: impl IntoIterator<Item = Option<Pixel>>) -> Vec<Vec<Pixel>> {
    let mut pieces = vec![Vec::new()];
    for point in points {
        match (point, pieces.last_mut()) {
            (Some(point), Some(piece)) => piece.push(point),
            _ => pieces.push(Vec::new()),
        }
    }
    pieces.iter().filter(|piece| !piece.is_empty()).map(|piece| straighten(&decimate(piece))).collect()
}

/// Keeps at most six points of each run of consecutive points in one pixel column.
fn decimate(points: &[Pixel]) -> Vec<Pixel> {
    let mut kept = Vec::new();
    for column in points.chunk_by(|a, b| a.0.floor() == b.0.floor()) {
        let least = |key: fn(Pixel) -> f64| {
            (0..column.len()).min_by(|&a, &b| key(column[a]).total_cmp(&key(column[b]))).unwrap_or(0)
        };
        let last = column.len() - 1;
        let mut chosen = vec![0, least(|p| p.0), least(|p| -p.0), least(|p| p.1), least(|p| -p.1), last];
        chosen.sort_unstable();
        chosen.dedup();
        kept.extend(chosen.into_iter().map(|k| column[k]));
    }
    kept
}

/// Removes every point within [`STRAIGHT_PX`] of the line from the last kept point to its successor.
fn straighten(points: &[Pixel]) -> Vec<Pixel> {
    let mut kept: Vec<Pixel> = Vec::with_capacity(points.len());
    // All points skipped since the last kept one must stay near the line, otherwise errors add up.
    let mut skipped: Vec<Pixel> = Vec::new();
    for (k, &point) in points.iter().enumerate() {
        let (Some(&from), Some(&next)) = (kept.last(), points.get(k + 1)) else {
            kept.push(point);
            continue;
        };
        skipped.push(point);
        if skipped.len() > 50 || skipped.iter().any(|&middle| distance(middle, from, next) > STRAIGHT_PX) {
            kept.push(point);
            skipped.clear();
        }
    }
    kept
}

/// Returns the distance of `p` from the segment `a`-`b`.
fn distance(p: Pixel, a: Pixel, b: Pixel) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length_squared = dx * dx + dy * dy;
    let along = if length_squared > 0.0 {
        (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let (ex, ey) = (a.0 + along * dx - p.0, a.1 + along * dy - p.1);
    (ex * ex + ey * ey).sqrt()
}

/// Returns the pieces as SVG path data. A single point becomes a small cross, so that it is visible.
pub(super) fn path_data(pieces: &[Vec<Pixel>]) -> String {
    let mut data = String::new();
    for piece in pieces {
        if let [(x, y)] = piece[..] {
            // Writing to a String cannot fail.
            let _ = write!(data, "M{:.2} {y:.2}h6M{x:.2} {:.2}v6", x - 3.0, y - 3.0);
            continue;
        }
        for (k, (x, y)) in piece.iter().enumerate() {
            let _ = write!(data, "{}{x:.2} {y:.2}", if k == 0 { 'M' } else { 'L' });
        }
    }
    data
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_survive_thinning() {
        let mut points: Vec<Pixel> = (0..20_000).map(|k| (f64::from(k) * 0.04, 100.0)).collect();
        points[7_003].1 = -55.0;
        points[7_004].1 = 260.0;
        points[19_999].1 = 3.0;
        let pieces = pieces(points.iter().copied().map(Some));
        assert_eq!(pieces.len(), 1);
        for k in [0, 7_003, 7_004, 19_999] {
            assert!(pieces[0].contains(&points[k]), "lost point {k}");
        }
        // A flat line with three spikes needs its corners and one point per 51 skipped points.
        assert!(pieces[0].len() < 60, "{} points", pieces[0].len());
    }

    #[test]
    fn a_loop_keeps_its_turning_points() {
        let angles = (0..20_000).map(|k| f64::from(k) * 1e-3);
        let circle: Vec<Pixel> = angles.map(|a| (9.7 * libm::cos(a), 9.7 * libm::sin(a))).collect();
        let thin = pieces(circle.iter().copied().map(Some)).concat();
        let reach = |key: fn(&Pixel) -> f64| thin.iter().map(key).fold(0.0, f64::max);
        for reach in [reach(|p| p.0), reach(|p| -p.0), reach(|p| p.1), reach(|p| -p.1)] {
            assert!((reach - 9.7).abs() < STRAIGHT_PX, "{reach}");
        }
    }

    #[test]
    fn thinning_moves_a_smooth_line_by_less_than_it_promises() {
        let wave = |x: f64| 100.0 + 80.0 * libm::sin(x / 40.0);
        let points: Vec<Pixel> = (0..800).map(|k| (f64::from(k), wave(f64::from(k)))).collect();
        let thin = straighten(&points);
        assert!(thin.len() < 400, "{} points", thin.len());
        for &p in &points {
            let nearest = thin.windows(2).map(|pair| distance(p, pair[0], pair[1])).fold(f64::INFINITY, f64::min);
            assert!(nearest <= STRAIGHT_PX, "{nearest} px at {}", p.0);
        }
    }

    #[test]
    fn a_missing_point_is_a_gap_and_a_lone_point_a_cross() {
        let points = [Some((0.0, 0.0)), Some((1.0, 1.0)), None, None, Some((3.0, 3.0)), None];
        assert_eq!(path_data(&pieces(points)), "M0.00 0.00L1.00 1.00M0.00 3.00h6M3.00 0.00v6");
        assert_eq!(path_data(&pieces([])), "");
    }
}
