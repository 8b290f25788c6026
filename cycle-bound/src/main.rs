//! Command `cycle-bound --elf FW.elf --symbol NAME`: the result goes to stdout, all messages to stderr.

use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use cycle_bound::{Options, Reply};
use terminal::stop;

/// Compute an upper bound on the cycles of a function from its machine code.
///
/// Prints instructions, flash and stack too. Exit status: 0 all figures valid, 1 a check failed, 2 invalid input or
/// rejected code (with address and reason).
#[derive(Parser)]
#[command(name = "cycle-bound", version)]
struct Cli {
    #[command(flatten)]
    options: Options,
}

/// Set by Ctrl-C; ends the run.
static STOP: AtomicBool = AtomicBool::new(false);

fn main() -> ExitCode {
    stop::on_request(&STOP);
    let Cli { options } = Cli::parse();
    match cycle_bound::run(&options, &STOP) {
        Ok(Reply { text, remarks, status }) => {
            let shown = writeln!(io::stdout(), "{text}");
            for line in &remarks {
                eprintln!("{line}");
            }
            match shown {
                // A closed reader (`| head`) is not an error.
                Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                    eprintln!("error: stdout cannot be written: {error}");
                    ExitCode::from(1)
                }
                _ => ExitCode::from(status),
            }
        }
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(2)
        }
    }
}
