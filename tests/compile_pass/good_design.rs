//! Valid design, in parts that the failing cases change. It is the library of their package, so it must compile.

pub use controller_core::*;

/// Flexible joint with observers of order up to R in channels 2 and 4.
pub type Joint<const R: usize> = Controller<f32, FlexibleJoint<f32>, 4, R, { channels(4, 2, [2, 4]) }, 2>;

const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Reconstructed).nominal();
/// Model of the joint.
pub const MODEL: FlexibleJoint<f32> = FlexibleJoint::<f32>::new(&NOMINAL);
/// Gains of order 2 as printed.
pub const GAINS: ObserverGains<2> = ObserverGains::as_printed([100.0, 20.0]);

/// Returns a valid configuration.
pub const fn good<const R: usize>(gains: ObserverGains<R>) -> Config<4, R> {
    Config {
        period_s: 1e-3,
        surface: Surface::from_bandwidth(5.0, 1.0),
        observers: [None, Some(gains), None, Some(gains)],
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.0, epsilon: 0.01 },
        nominal: NOMINAL,
        options: Options::NEUTRAL
            .with_limits(Limits::symmetric(300.0))
            .with_fallback(Fallback::Safe(0.0))
            .with_sigma_star_bound(1.0),
    }
}
