//! One suite, a module per question.

mod cases;
mod convergence;
mod formula;
mod properties;
