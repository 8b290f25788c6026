//! The plants of the paper's two examples, as nominal models.

pub mod benchmark;
pub mod flexible_joint;

pub use benchmark::Benchmark;
pub use flexible_joint::{FlexibleJoint, JointChain, JointParameters, Reading};
