//! One suite, a module per question.

mod budget;
mod capi;
mod cases;
mod compile;
mod convergence;
mod drive_host;
mod drive_replay;
mod emulator;
mod export;
mod figures;
mod formula;
mod frames;
mod gate;
mod golden;
mod paper;
mod precision;
mod properties;
mod recovery;
mod refusals;
mod robustness;
mod running;
mod theory;
mod wire;
mod yardsticks;
