//! A pole of 2000 rad/s at T = 1 ms.

use controller_core::{
    Config, Controller, Fallback, FlexibleJoint, JointParameters, Limits, Nominal, ObserverGains, Reading, ReachingLaw,
    Surface, channels,
};

type Joint = Controller<f32, FlexibleJoint<f32>, 4, 2, { channels([2, 4]) }, 2>;
const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Reconstructed).nominal();
const GAINS: ObserverGains<2> = ObserverGains::from_bandwidth::<2>(2000.0);
static CONTROLLER: Joint = Joint::designed(
    &Config {
        period_s: 1e-3,
        surface: Surface::from_bandwidth(5.0, 1.0),
        observers: [None, Some(GAINS), None, Some(GAINS)],
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.0, epsilon: 0.01 },
        nominal: NOMINAL,
        limits: Limits::symmetric(300.0),
        fallback: Fallback::Safe(0.0),
        sigma_star_bound: 1.0,
        observer_pole_limit: 1.0,
    },
    FlexibleJoint::<f32>::new(&NOMINAL),
);

fn main() {
    let _ = CONTROLLER.start(&[0.1, 0.0, 0.0, 0.0]);
}
