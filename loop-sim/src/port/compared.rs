//! Bit-by-bit comparison of two controllers, tick by tick.
//!
//! Both controllers get every sample. The loop uses the output of the controller on the target. The first differing bit
//! in any output ends the run. There is no tolerance, because both controllers do the same f32 arithmetic.

use crate::port::{ControllerPort, Difference, Field, PortError, Tick};

/// Pair of controllers that are compared.
pub struct Compared<'a> {
    there: &'a mut dyn ControllerPort,
    here: &'a mut dyn ControllerPort,
    ticks: u64,
}

impl<'a> Compared<'a> {
    /// Compares two controllers that have just started.
    pub fn new(there: &'a mut dyn ControllerPort, here: &'a mut dyn ControllerPort) -> Self {
        Self { there, here, ticks: 0 }
    }
}

impl ControllerPort for Compared<'_> {
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let there = self.there.tick(sample)?;
        let here = self.here.tick(sample)?;
        if let Some((field, there, here)) = difference(&there, &here) {
            return Err(PortError::Differs(Difference { tick: self.ticks, field, there, here }));
        }
        self.ticks += 1;
        Ok(there)
    }

    fn report_applied(&mut self, u: f64) {
        self.there.report_applied(u);
        self.here.report_applied(u);
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.there.reset()?;
        self.here.reset()?;
        self.ticks = 0;
        Ok(())
    }

    fn observed(&self) -> &[usize] {
        self.here.observed()
    }

    fn follows(&self) -> Option<usize> {
        self.here.follows()
    }

    fn reference(&self) -> f64 {
        self.here.reference()
    }

    fn fingerprint(&self) -> Option<u32> {
        self.here.fingerprint()
    }
}

fn difference(there: &Tick, here: &Tick) -> Option<(Field, u32, u32)> {
    let numbers = |tick: &Tick| [(Field::U, tick.u), (Field::Sigma, tick.sigma), (Field::SigmaStar, tick.sigma_star)];
    let estimates = |tick: &Tick| {
        let channels = tick.estimates.into_iter().enumerate();
        channels.flat_map(|(i, derivatives)| {
            let of = move |j| Field::Estimate { channel: i + 1, derivative: j };
            derivatives.into_iter().enumerate().map(move |(j, number)| (of(j), number))
        })
    };
    let all = |tick: &Tick| numbers(tick).into_iter().chain(estimates(tick));
    let flags = |tick: &Tick| u32::from(tick.health.bits());
    let health = (Field::Health, flags(there), flags(here));
    // Every f32 is exact in an f64, so these bits are the bits of the target.
    let bits =
        all(there).zip(all(here)).map(|((field, a), (_, b))| (field, (a as f32).to_bits(), (b as f32).to_bits()));
    bits.chain([health]).find(|(_, a, b)| a != b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MAX_ORDER;
    use controller_core::{Health, MAX_R};

    /// Controller with a constant output, except at one tick.
    struct Saying {
        tick: Tick,
        at: u64,
        other: Tick,
        ticks: u64,
    }

    impl ControllerPort for Saying {
        fn tick(&mut self, _sample: &[f64]) -> Result<Tick, PortError> {
            self.ticks += 1;
            Ok(if self.ticks == self.at + 1 { self.other } else { self.tick })
        }

        fn report_applied(&mut self, _u: f64) {}

        fn reset(&mut self) -> Result<(), PortError> {
            self.ticks = 0;
            Ok(())
        }

        fn observed(&self) -> &[usize] {
            &[]
        }
    }

    /// Flips the last bit, also of a NaN, whose last bits an arithmetic operation may change.
    fn flipped(value: f64) -> f64 {
        f64::from(std::hint::black_box(f32::from_bits((value as f32).to_bits() ^ 1)))
    }

    #[test]
    fn one_bit_of_any_output_is_found_and_named() {
        let estimates = std::array::from_fn(|i| std::array::from_fn(|j| f64::from((i * MAX_R + j) as f32 + 0.5)));
        let good = Tick { u: -7.5, sigma: f64::NAN, sigma_star: -0.0, estimates, health: Health::OK };
        let mut cases = vec![
            (Field::U, Tick { u: flipped(good.u), ..good }),
            (Field::Sigma, Tick { sigma: flipped(good.sigma), ..good }),
            (Field::SigmaStar, Tick { sigma_star: 0.0, ..good }),
            (Field::Health, Tick { health: Health::SATURATED, ..good }),
        ];
        for i in 0..MAX_ORDER {
            for j in 0..MAX_R {
                let mut other = good;
                other.estimates[i][j] = flipped(other.estimates[i][j]);
                cases.push((Field::Estimate { channel: i + 1, derivative: j }, other));
            }
        }
        for (field, other) in cases {
            let saying = |at| Saying { tick: good, at, other, ticks: 0 };
            let (mut there, mut here) = (saying(3), saying(u64::MAX - 1));
            let mut compared = Compared::new(&mut there, &mut here);
            for _ in 0..3 {
                assert!(compared.tick(&[]).is_ok(), "{field}");
            }
            match compared.tick(&[]) {
                Err(PortError::Differs(found)) => {
                    assert_eq!((found.tick, found.field, found.bits() > 0), (3, field, true));
                }
                other => panic!("{field}: {other:?}"),
            }
        }
    }

    #[test]
    fn a_difference_reads_as_tick_field_and_both_bit_patterns() {
        let field = Field::Estimate { channel: 2, derivative: 1 };
        let difference = Difference { tick: 17, field, there: 0x3f80_0001, here: 0x3f80_0000 };
        assert_eq!(
            difference.to_string(),
            "tick 17: d_hat_2' differs: 0x3f800001 (1.0000001e0) on the target, 0x3f800000 (1e0) here"
        );
        assert_eq!(difference.bits(), 1);
        let difference = Difference { tick: 0, field: Field::Health, there: 2, here: 0 };
        assert_eq!(difference.to_string(), "tick 0: health differs: 0x00000002 on the target, 0x00000000 here");
    }
}
