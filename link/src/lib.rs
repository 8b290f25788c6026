#![doc = include_str!("../README.md")]

pub mod black_box;
pub mod live;
pub mod remote;
pub mod transport;
pub mod wired;
