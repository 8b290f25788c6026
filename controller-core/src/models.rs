//! Nominal models of the two example plants of the paper.

pub mod benchmark;
pub mod flexible_joint;

pub use benchmark::Benchmark;
pub use flexible_joint::{FlexibleJoint, JointChain, JointParameters, Reading};
