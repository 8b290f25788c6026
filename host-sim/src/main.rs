//! `host-sim`: see [`host_sim::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(host_sim::cli::main())
}
