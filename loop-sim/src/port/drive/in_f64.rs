//! Drive in f64, including its reference, as the standard for rounding errors of f32. It has the base gains only and no
//! monitors, and it is not meant for a chip.

use controller_core::drive::{Aim, ChainModel, DriveEstimates, EncoderForm, Sample, Target};
use controller_core::{ControlLaw, MAX_R, Output, Running};

use super::{Motion, Mounted, Played};
use crate::MAX_ORDER;
use crate::port::{ControllerPort, PortError, Tick};

/// Drive in f64: counts in, current out.
struct InF64<L: ControlLaw, const E: usize, const N: usize, const P: usize> {
    running: Running<L>,
    mounted: [Mounted; E],
    player: Played<f64, P, N>,
    motion: Motion,
    late: u32,
    sample: Sampled<L, E, N>,
}

/// Function that builds the sample from counts and the targets at both ends of a tick.
type Sampled<L, const E: usize, const N: usize> =
    fn([Option<i32>; E], &Target<f64, i32, N>, &Target<f64, i32, N>) -> <L as ControlLaw>::Sample;

impl<L, const E: usize, const N: usize, const P: usize> ControllerPort for InF64<L, E, N, P>
where
    L: ControlLaw<Scalar = f64, Output = Output<f64>, Estimates = DriveEstimates<f64, i32, E>> + Send,
    L::State: Send,
{
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let count = |i: usize| sample.get(i).and_then(|&count| self.mounted[i].upright(count));
        let [begin, end] = self.player.next_tick();
        let sample = (self.sample)(std::array::from_fn(count), &begin, &end);
        self.running.start_at_once(&sample);
        let Output { u, sigma, sigma_star, health } = self.running.tick(&sample);
        let mut estimates = [[0.0; MAX_R]; MAX_ORDER];
        let disturbance = self.running.estimates().map_or([0.0; E], |known| known.disturbance);
        for (i, d) in disturbance.into_iter().enumerate() {
            estimates[2 * i + 1][0] = d;
        }
        Ok(Tick { u, sigma, sigma_star, estimates, health })
    }

    fn report_applied(&mut self, u: f64) {
        self.running.report_applied(u);
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.player = self.motion.played(self.late);
        self.running.reset();
        Ok(())
    }

    fn observed(&self) -> &[usize] {
        &[1, 3][..E]
    }
}

/// Returns a controller along a motion.
pub(super) fn boxed<M, A, const E: usize, const N: usize, const S: usize, const LATE: usize, const P: usize>(
    law: EncoderForm<f64, M, A, E, N, S, 0, LATE>,
    mounted: [Mounted; E],
    motion: &Motion,
) -> Box<dyn ControllerPort>
where
    M: ChainModel<f64, E, N, Push: Send> + Send + 'static,
    A: Aim<f64, N, Target: Send> + Send + 'static,
{
    Box::new(InF64::<_, E, N, P> {
        running: Running::new(law),
        mounted,
        player: motion.played(LATE as u32),
        motion: motion.clone(),
        late: LATE as u32,
        sample: |counts, begin, end| Sample { counts, begin: A::told(begin), end: A::told(end) },
    })
}
