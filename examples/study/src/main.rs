//! From a data sheet to C: design, map, tune and export a drive.
//!
//! ```sh
//! cargo run --release -- ../../scenario/scenarios/motor.toml > drive.h
//! ```

use std::error::Error;
use std::fs;

use forms::{Form, PREFIX};
use scenario::Source;
use study::Watch;
use study::compare::Bench;
use study::map::{MapRequest, Question, Subject};
use study::tune::{self, Effort, Limits};

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("no scenario: give a file with [motor] or [joint]")?;
    let text = fs::read_to_string(&file)?;
    let subject = Subject { file: &file, text: &text, name: "drive", sets: &[] };

    let design = study::design(&subject.with(&[])?)?;
    let limit = design.limits.first().map(|limit| limit.what);
    eprintln!("decay rate {:.1} 1/s, limited by {limit:?}", design.got.decay_per_s);

    let request = MapRequest { preset: Some("gain"), ..MapRequest::default() };
    let map = study::map(&Question::new(subject, &request)?, Watch::none())?.ok_or("stopped")?;
    let good = map.good.iter().filter(|good| **good).count();
    eprintln!("{good} of {} points are good; guaranteed: {:?}", map.points.len(), map.promise);

    let bench = Bench::new(&file, &text, &[])?;
    let specification = tune::Specification::new(&bench, &Limits { load_rad: Some(0.02), ..Limits::default() })?;
    let effort = Effort { evaluations: 60, seed: 1, most_cycles: None };
    let tuned = study::tune(&bench, &subject, &specification, effort, Watch::none())?.ok_or("stopped")?;
    eprintln!("load error {:.4} rad, {} cycles, not met: {:?}", tuned.found.worst.load_rad, tuned.cycles, tuned.missed);

    let source = Source { file: &file, text: &tuned.text, sets: &[] };
    print!("{}", forms::export(&scenario::parse(&source, "drive")?, &source, Form::Standalone(PREFIX))?);
    Ok(())
}
