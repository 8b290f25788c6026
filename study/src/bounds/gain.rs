//! Gains of a design, and the design with one gain changed.

use controller_core::ObserverGains;
use loop_sim::linear::LawAtRest;
use loop_sim::port::in_process;
use scenario::Experiment;

use crate::map::Subject;
use crate::number::typed;

/// Digits of a suggested value.
const DIGITS: usize = 4;

/// Gain that affects the bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gain {
    /// Reaching gain k_l.
    Reaching,
    /// Switching gain k_s.
    Switching,
    /// Bandwidth of the sliding motion: c_i goes with its (n - i)-th power.
    Surface,
    /// Bandwidth of the observer of a channel, or of a shaft of a drive, from 0: l_j goes with its j-th power.
    Observer(usize),
    /// Sampling period T.
    Period,
}

impl Gain {
    /// Returns the gains of a design.
    pub(super) fn all(experiment: &Experiment) -> Vec<Self> {
        let (observers, switches): (Vec<usize>, bool) = match (&experiment.drive, &experiment.spec) {
            (Some(drive), _) => ((0..drive.shafts.len()).collect(), false),
            (None, Some(spec)) => (experiment.port.observed().to_vec(), spec.config.padded.reaching.k_s > 0.0),
            (None, None) => return Vec::new(),
        };
        let observers = observers.into_iter().map(Self::Observer);
        let switching = switches.then_some(Self::Switching);
        [Self::Reaching]
            .into_iter()
            .chain(switching)
            .chain([Self::Surface])
            .chain(observers)
            .chain([Self::Period])
            .collect()
    }

    pub(super) fn name(self, experiment: &Experiment) -> String {
        match (self, &experiment.drive) {
            (Self::Reaching, _) => "k_l".into(),
            (Self::Switching, _) => "k_s".into(),
            (Self::Surface, _) => "surface".into(),
            (Self::Observer(i), Some(drive)) => format!("observer of the {}", drive.shafts[i].name),
            (Self::Observer(i), None) => format!("observer of d_{}", i + 1),
            (Self::Period, _) => "period".into(),
        }
    }

    /// Returns the controller with the gain multiplied by `by`, and its period; `None` if the design is invalid.
    pub(super) fn law(self, experiment: &Experiment, by: f64) -> Option<(Box<dyn LawAtRest>, f64)> {
        match (experiment.drive.as_ref().map(|drive| drive.designed), &experiment.spec) {
            (Some(mut designed), _) => {
                let mut bandwidths = designed.bandwidths();
                *match self {
                    Self::Reaching | Self::Switching => &mut bandwidths.reaching_per_s,
                    Self::Surface => &mut bandwidths.surface_rad_s,
                    Self::Observer(i) => bandwidths.observers_rad_s.get_mut(i)?,
                    Self::Period => designed.period_mut_s(),
                } *= by;
                designed.set_bandwidths(&bandwidths);
                Some((designed.at_rest().ok()?.law, designed.period_s()))
            }
            (None, Some(spec)) => {
                let mut spec = spec.clone();
                let (n, config) = (spec.config.n, &mut spec.config.padded);
                match self {
                    Self::Reaching => config.reaching.k_l *= by,
                    Self::Switching => config.reaching.k_s *= by,
                    Self::Surface => {
                        for (i, c) in config.surface.c.iter_mut().take(n).enumerate() {
                            *c *= libm::pow(by, (n - 1 - i) as f64);
                        }
                    }
                    Self::Observer(i) => {
                        let gains = config.observers[i].as_mut()?;
                        let mut l = [0.0; 3];
                        for (j, (to, from)) in (1..).zip(l.iter_mut().zip(gains.l())) {
                            *to = from * libm::pow(by, f64::from(j));
                        }
                        *gains = ObserverGains::new(gains.order(), l).ok()?;
                    }
                    Self::Period => config.period_s *= by,
                }
                let period_s = config.period_s;
                Some((in_process::build(&spec).ok()?.at_rest, period_s))
            }
            (None, None) => None,
        }
    }

    /// Returns the setting that multiplies the gain by `by`, as in `--set`. For a drive the setting is one key, so that
    /// the dependent gains follow by rule. Returns `None` if the design has no such gain.
    pub(super) fn set(self, experiment: &Experiment, subject: &Subject<'_>, by: f64) -> Option<String> {
        let list = |values: &[f64]| values.iter().map(|it| typed(*it, DIGITS)).collect::<Vec<_>>().join(",");
        let (key, value) = match (experiment.drive.as_ref().map(|drive| drive.designed), &experiment.spec) {
            (Some(designed), _) => {
                let w = designed.bandwidths();
                let (key, value) = match self {
                    Self::Reaching | Self::Switching => ("reaching_per_s", w.reaching_per_s),
                    Self::Surface => ("surface_rad_s", w.surface_rad_s),
                    Self::Observer(i) => (*designed.observer_keys().get(i)?, *w.observers_rad_s.get(i)?),
                    Self::Period => ("period_s", designed.period_s()),
                };
                return Some(format!("drive.{key}={}", list(&[value * by])));
            }
            (None, Some(spec)) => {
                let (n, config) = (spec.config.n, &spec.config.padded);
                match self {
                    Self::Reaching => ("controller.k_l", config.reaching.k_l),
                    Self::Switching => ("controller.k_s", config.reaching.k_s),
                    Self::Period => ("controller.period_s", config.period_s),
                    Self::Surface => {
                        let key = "controller.surface_bandwidth_rad_s";
                        let Some(own) = subject.number_at(key) else {
                            let c = (0..n).map(|i| config.surface.c[i] * libm::pow(by, (n - 1 - i) as f64));
                            return Some(format!("controller.c=[{}]", list(&c.collect::<Vec<_>>())));
                        };
                        (key, own)
                    }
                    // All observers are set: the file may list them in any order, give poles, or use the default.
                    Self::Observer(of) => {
                        let tables = config.observers.iter().take(n).enumerate().filter_map(|(i, gains)| {
                            let gains = gains.as_ref()?;
                            let by = if i == of { by } else { 1.0 };
                            let l = (1..).zip(gains.l()).map(|(j, l)| l * libm::pow(by, f64::from(j)));
                            let l: Vec<f64> = l.take(gains.order()).collect();
                            Some(format!("{{channel={},printed=[{}]}}", i + 1, list(&l)))
                        });
                        return Some(format!("controller.observer=[{}]", tables.collect::<Vec<_>>().join(",")));
                    }
                }
            }
            (None, None) => return None,
        };
        Some(format!("{key}={}", typed(value * by, DIGITS)))
    }
}
