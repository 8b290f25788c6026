//! Sobol sequence: points that fill a cube more evenly than random ones, each computed independently.
//!
//! Coordinate j of point i is, with g = i ^ (i >> 1) the Gray code of i and v_jk the direction numbers of dimension j,
//!
//! ```text
//! x_j = (xor over the bits k of g: v_jk) / 2^32      v_jk = m_jk 2^(32 - k)
//! m_k = 2 a_1 m_(k-1) ^ .. ^ 2^(s-1) a_(s-1) m_(k-s+1) ^ 2^s m_(k-s) ^ m_(k-s)
//! ```
//!
//! with the primitive polynomials a of degree s and the first m of Joe and Kuo, "Constructing Sobol sequences with
//! better two-dimensional projections", SIAM J. Sci. Comput. 30 (2008), file new-joe-kuo-6. The order is SciPy's,
//! `qmc.Sobol(d, scramble=False)`. Point 0 is the lower corner; every 2^k points from the first on are spread evenly.

/// Degree, polynomial and first m of the dimensions, starting with the second.
const JOE_KUO: [(u32, u32, &[u32]); 20] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
];
const BITS: usize = 32;

/// Number of supported dimensions.
pub const DIMENSIONS: usize = JOE_KUO.len() + 1;
/// Number of points of the sequence.
pub const POINTS: u64 = 1 << BITS;

/// Coordinate of the sequence.
#[derive(Clone, Debug, PartialEq)]
pub struct Sobol {
    directions: [u32; BITS],
}

impl Sobol {
    /// Returns the coordinate of a dimension, counted from 0; `None` from [`DIMENSIONS`] on.
    pub fn new(dimension: usize) -> Option<Self> {
        let mut directions = [0; BITS];
        let Some(before) = dimension.checked_sub(1) else {
            (0..BITS).for_each(|k| directions[k] = 1 << (BITS - 1 - k));
            return Some(Self { directions });
        };
        let (degree, polynomial, first) = JOE_KUO.get(before)?;
        let s = *degree as usize;
        for k in 0..BITS {
            directions[k] = if k < s {
                first[k] << (BITS - 1 - k)
            } else {
                let taps = (1..s).filter(|j| polynomial >> (s - 1 - j) & 1 == 1);
                taps.fold(directions[k - s] ^ directions[k - s] >> s, |sum, j| sum ^ directions[k - j])
            };
        }
        Some(Self { directions })
    }

    /// Returns the coordinate of point i, below [`POINTS`]: in [0, 1).
    pub fn at(&self, i: u64) -> f64 {
        let gray = i ^ i >> 1;
        let bits = (0..BITS).filter(|k| gray >> k & 1 == 1);
        f64::from(bits.fold(0, |sum, k| sum ^ self.directions[k])) / POINTS as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SciPy 1.17.1, `qmc.Sobol(21, scramble=False).random(2**14)[i]` times 2^14; these points need no more bits.
    const SCIPY: [(u64, [u32; DIMENSIONS]); 8] = [
        (0, [0; 21]),
        (1, [8192; 21]),
        (
            2,
            [
                12288, 4096, 4096, 4096, 12288, 12288, 4096, 12288, 12288, 12288, 12288, 12288, 4096, 4096, 12288,
                4096, 12288, 4096, 12288, 4096, 4096,
            ],
        ),
        (
            6,
            [
                10240, 2048, 14336, 10240, 10240, 14336, 2048, 2048, 2048, 6144, 2048, 10240, 2048, 14336, 10240,
                10240, 10240, 10240, 2048, 6144, 6144,
            ],
        ),
        (
            77,
            [
                13696, 13696, 128, 12672, 13696, 8320, 3712, 10624, 2944, 7040, 2176, 12928, 8064, 5504, 16256, 1152,
                13440, 14464, 12928, 128, 2432,
            ],
        ),
        (
            1000,
            [
                3600, 1584, 8496, 11088, 4592, 14864, 752, 14736, 8208, 1136, 1392, 4176, 2640, 6288, 2352, 6064,
                11792, 5648, 16240, 11888, 8560,
            ],
        ),
        (
            9999,
            [
                1099, 15097, 16101, 5561, 3659, 2211, 823, 11911, 5879, 16285, 13055, 7205, 3235, 8185, 4443, 8173,
                10559, 1149, 7775, 8481, 1635,
            ],
        ),
        (
            16383,
            [
                1, 13107, 12327, 11523, 7153, 14281, 6625, 8005, 533, 10683, 13237, 12743, 1801, 5123, 7281, 10927,
                11005, 5311, 5501, 9127, 5557,
            ],
        ),
    ];

    #[test]
    fn points_are_those_of_scipy() {
        for (i, row) in SCIPY {
            let ours: Vec<f64> = (0..DIMENSIONS).map(|d| Sobol::new(d).expect("a dimension").at(i) * 16384.0).collect();
            assert_eq!(ours, row.map(f64::from), "point {i}");
        }
        assert_eq!(Sobol::new(DIMENSIONS), None);
    }

    #[test]
    fn every_coordinate_of_the_first_points_meets_every_interval_once() {
        for dimension in 0..DIMENSIONS {
            let sobol = Sobol::new(dimension).expect("a dimension");
            let mut places: Vec<u32> = (0..4096).map(|i| (sobol.at(i) * 4096.0) as u32).collect();
            places.sort_unstable();
            assert!(places.into_iter().eq(0..4096), "dimension {dimension}");
        }
    }
}
