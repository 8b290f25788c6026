//! `cycle-bound --elf FW.elf --symbol NAME`: the answer to stdout, everything else to stderr.

use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use cycle_bound::{Options, Reply};
use terminal::stop;

/// Compute an upper bound in cycles of a function from its machine code, and what else it costs.
///
/// Exit status: 0 the figures stand, 1 a check failed, 2 bad input, or something could not be followed (it is named).
#[derive(Parser)]
#[command(name = "cycle-bound", version)]
struct Cli {
    #[command(flatten)]
    options: Options,
}

/// Set by Ctrl-C: what runs is to end.
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
                // A reader that has gone away (`| head`) is no error.
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
