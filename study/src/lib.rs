#![doc = include_str!("../README.md")]

pub mod bounds;
pub mod commission;
pub mod compare;
pub mod identify;
pub mod map;
pub mod margins;
pub mod monte_carlo;
pub mod number;
pub mod tune;
