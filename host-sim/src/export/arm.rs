//! The assembly of a tick, as [`tick_assembly`] makes it.

pub use tick_assembly::{Assembly, DriveAssembly, DriveLayout, Effort, Layout, assembly, drive_assembly};
