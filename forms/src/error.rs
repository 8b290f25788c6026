//! Reasons why a controller or drive has no export in a form.

use std::fmt;

use controller_core::drive::DriveError;
use controller_core::{ConfigError, Shape};

use super::shape_text;

/// Reason why an export is not possible. Its text has the remedy.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// This build lacks a feature of the crate.
    Feature(&'static str),
    /// The baseline has no export.
    Baseline,
    /// The controller does not compute in f32.
    Precision,
    /// A formula of the controller exists on the host only; the text has the constants that replace it.
    Formula(String),
    /// Self-contained C has a linear a(x) only.
    StandaloneModel,
    /// The static library has a linear a(x) only.
    ArchiveModel,
    /// The static library has no limits of samples.
    ArchiveSamples,
    /// The static library lacks a configuration.
    ArchiveShape {
        /// Name of the configuration.
        name: String,
        /// Order and observers.
        shape: Shape,
        /// Names of the configurations of the library.
        library: &'static [&'static str],
    },
    /// The static library lacks this kind of drive.
    ArchiveDrive(&'static str),
    /// The static library takes the thresholds of its monitors from its rule only.
    ArchiveMonitors,
    /// Assembly has no limits of samples.
    AssemblySamples,
    /// Assembly has at most one tick of delay.
    AssemblyDelay(usize),
    /// The scheduler of the assembly failed.
    Scheduler(String),
    /// The FMU of a plant is of a motor or joint without some parts; the text names what the scenario has.
    FmuPlant(&'static str),
    /// The crate has no tick of this configuration.
    Shape(Shape),
    /// The form has no function of this name.
    Function {
        /// Requested name.
        name: String,
        /// Names of the functions of the form.
        functions: Vec<&'static str>,
    },
    /// The controller has no design.
    Controller(ConfigError),
    /// The drive has no design.
    Drive(DriveError),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const OTHERS: &str = "take --lang c --standalone, the whole controller as one C99 file, or --lang rust";
        const MODEL: &str = "a(x) of the benchmark is not linear; take --lang rust, or set plant.kind";
        match self {
            Self::Feature(name) => write!(f, "this program was built without the feature {name}"),
            Self::Baseline => f.write_str("the baseline is not exported; set controller.kind=proposed"),
            Self::Precision => f.write_str("an exported controller computes in f32; set controller.precision=f32"),
            Self::StandaloneModel => write!(f, "C needs a linear a(x): {MODEL} to chain or flexible_joint"),
            Self::ArchiveModel => write!(f, "the static library for C needs a linear a(x): {MODEL}=chain"),
            Self::ArchiveSamples => f.write_str(
                "the static library for C has no limits of samples: take --lang c --standalone, the whole \
                 controller as one C99 file, or leave out controller.samples",
            ),
            Self::ArchiveShape { name, shape, library } => {
                let (shape, library) = (shape_text(*shape), library.join(", "));
                write!(
                    f,
                    "the static library for C has no {name} ({shape}); it has {library}. Take --lang c --standalone, \
                     the whole controller as one C99 file"
                )
            }
            Self::ArchiveDrive(missing) => write!(f, "the static library for C has no {missing}: {OTHERS}"),
            Self::ArchiveMonitors => write!(
                f,
                "the static library for C makes the thresholds of its monitors by rule: leave load_n_m, motor_n_m, \
                 sigma_star and saturated_s out of [monitor], or {OTHERS}"
            ),
            Self::AssemblySamples => f.write_str(
                "assembly has no limits of samples: leave out controller.samples, or take --lang c --standalone",
            ),
            Self::AssemblyDelay(ticks) => write!(
                f,
                "drive.delay_ticks = {ticks}: assembly supports 0 and 1; take --lang c --standalone, or --lang rust"
            ),
            Self::FmuPlant(has) => write!(
                f,
                "the FMU of a plant is of a motor or joint without play and supply, and the scenario has {has}: take \
                 --fmu, the controller, and another plant model"
            ),
            Self::Shape(shape) => write!(f, "no tick supports {}", shape_text(*shape)),
            Self::Function { name, functions } => {
                write!(f, "no function `{name}`; there are {}", functions.join(", "))
            }
            Self::Formula(message) | Self::Scheduler(message) => f.write_str(message),
            Self::Controller(error) => error.fmt(f),
            Self::Drive(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for Error {}
