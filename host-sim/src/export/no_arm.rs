//! The module `arm` without the feature `asm`: functions that return the reason, and layouts that nothing is in.

use tick_record::drive::DriveFunctions;
use tick_record::{Functions, Port};

const LEFT_OUT: &str = "this program was built without the feature asm";

/// The effort of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort([u64; 2]);

impl Effort {
    /// The effort for a shipped file.
    pub const FULL: Self = Self([0; 2]);
}

/// The state of a controller in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// No words.
    pub words: Vec<String>,
}

impl Layout {
    /// Returns no words.
    pub fn of(_: &Functions, _: usize) -> Self {
        Self { words: Vec::new() }
    }
}

/// The state of a drive in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DriveLayout;

impl DriveLayout {
    /// Returns no words.
    pub fn of(_: &DriveFunctions) -> Self {
        Self
    }

    /// Returns no words.
    pub fn words(&self) -> impl Iterator<Item = &String> {
        std::iter::empty()
    }

    /// Returns no place.
    pub fn means(&self, _: &str, _: &Port, _: &[Port]) -> Option<String> {
        None
    }
}

/// The functions of a controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assembly {
    /// The functions.
    pub text: String,
    /// The state.
    pub layout: Layout,
    /// Cycles of `tick_u`.
    pub cycles: u32,
    /// Cycles of `tick`.
    pub cycles_whole: u32,
    /// Least cycles of `tick_u`.
    pub floor: u32,
    /// Least cycles of `tick`.
    pub floor_whole: u32,
}

/// The functions of a drive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DriveAssembly {
    /// The functions.
    pub text: String,
    /// The state.
    pub layout: DriveLayout,
    /// Cycles of `tick_u`.
    pub cycles: u32,
    /// Cycles of `tick`.
    pub cycles_whole: u32,
    /// Least cycles of `tick_u`.
    pub floor: u32,
    /// Least cycles of `tick`.
    pub floor_whole: u32,
}

/// # Errors
/// Always.
pub fn assembly(_: &Functions, _: usize, _: usize, _: &str, _: &Effort) -> Result<Assembly, String> {
    Err(LEFT_OUT.into())
}

/// # Errors
/// Always.
pub fn drive_assembly(_: &DriveFunctions, _: &str, _: &Effort) -> Result<DriveAssembly, String> {
    Err(LEFT_OUT.into())
}
