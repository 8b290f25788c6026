//! One suite, a module per question.

mod cases;
mod compile;
mod convergence;
mod formula;
mod paper;
mod precision;
mod properties;
mod robustness;
mod theory;
