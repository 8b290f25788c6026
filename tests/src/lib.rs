//! What the suite measures with. Nothing here comes from the code under test: the tick is transcribed a second time
//! ([`oracle`]), the continuous law is taken from the print ([`printed`]), the plants are written a second time
//! ([`truth`]) and integrated by other means.
//!
//! | module | what |
//! |---|---|
//! | [`oracle`] | the discrete controller written for reading: unfolded, loops, f64 |
//! | [`printed`] | the continuous controller, Eq. (44)-(51), as printed |
//! | [`truth`] | true plants: exact between ticks where linear, Runge-Kutta where not |
//! | [`shape`] | the shipped controller behind one trait, whatever its order, channels and precision |
//! | [`strategy`] | random designs and chains from a printed seed |
//! | [`close`] | comparing two signals |
//! | [`data`] | reading `tests/data` |
//! | [`golden`] | small tables a person can judge |

pub mod close;
pub mod data;
pub mod golden;
pub mod oracle;
pub mod printed;
pub mod shape;
pub mod strategy;
pub mod truth;
