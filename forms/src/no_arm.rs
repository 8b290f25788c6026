//! Replacement of the module `arm` without the feature `asm`: its functions return the reason, and its layouts are
//! empty.
#![allow(clippy::unused_self, reason = "the signatures of the module `arm`")]

use tick_record::drive::DriveFunctions;
use tick_record::{Functions, Port};

use super::Error;

/// The effort of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort([u64; 2]);

impl Effort {
    /// The effort for a shipped file.
    pub const FULL: Self = Self([0; 2]);
}

/// The state of a controller in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    /// No words.
    pub(crate) words: Vec<String>,
}

impl Layout {
    /// Returns no words.
    pub(crate) fn of(_: &Functions, _: usize) -> Self {
        Self { words: Vec::new() }
    }
}

/// The state of a drive in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct DriveLayout;

impl DriveLayout {
    /// Returns no words.
    pub(crate) fn of(_: &DriveFunctions) -> Self {
        Self
    }

    /// Returns no words.
    pub(crate) fn words(&self) -> impl Iterator<Item = &String> {
        std::iter::empty()
    }

    /// Returns no place.
    pub(crate) fn means(&self, _: &str, _: &Port, _: &[Port]) -> Option<String> {
        None
    }
}

/// The functions of a controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Assembly {
    /// The functions.
    pub(crate) text: String,
    /// The state.
    pub(crate) layout: Layout,
    /// Cycles of `tick_u`.
    pub(crate) cycles: u32,
    /// Cycles of `tick`.
    pub(crate) cycles_whole: u32,
    /// Least cycles of `tick_u`.
    pub(crate) floor: u32,
    /// Least cycles of `tick`.
    pub(crate) floor_whole: u32,
}

/// The functions of a drive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct DriveAssembly {
    /// The functions.
    pub(crate) text: String,
    /// The state.
    pub(crate) layout: DriveLayout,
    /// Cycles of `tick_u`.
    pub(crate) cycles: u32,
    /// Cycles of `tick`.
    pub(crate) cycles_whole: u32,
    /// Least cycles of `tick_u`.
    pub(crate) floor: u32,
    /// Least cycles of `tick`.
    pub(crate) floor_whole: u32,
}

/// Rejects a controller.
///
/// # Errors
/// Always.
pub(crate) fn assembly(_: &Functions, _: usize, _: usize, _: &str, _: &Effort) -> Result<Assembly, Error> {
    Err(Error::Feature("asm"))
}

/// Rejects a drive.
///
/// # Errors
/// Always.
pub(crate) fn drive_assembly(_: &DriveFunctions, _: &str, _: &Effort) -> Result<DriveAssembly, Error> {
    Err(Error::Feature("asm"))
}
