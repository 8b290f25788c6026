//! The assembly of a tick, as [`tick_assembly`] makes it.

pub use tick_assembly::Effort;
pub(crate) use tick_assembly::{Assembly, DriveAssembly, DriveLayout, Layout, assembly, drive_assembly};
