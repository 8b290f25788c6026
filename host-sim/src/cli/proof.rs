//! `host-sim export --certificate` with the feature `proof`: proves statements about an exported file.

use std::path::Path;
use std::time::Duration;

use scenario::Experiment;
use tick_proof::certificate;
use tick_proof::run;
use tick_proof::solver::{Solver, Which};

use super::{Console, Failure, bad, failed};

/// Time limit of the solver for one statement.
const PATIENCE: Duration = Duration::from_mins(2);

impl Console<'_> {
    /// Proves all statements about a file under a progress bar. Returns the certificate and the statements that are not
    /// proved.
    ///
    /// A part of a certificate has no use, so a request to stop ends the program at once.
    pub(super) fn proved(
        &self,
        experiment: &Experiment,
        [name, text]: [&str; 2],
        python: Option<&Path>,
        refused: impl Fn(String) -> Failure,
    ) -> Result<(String, Vec<String>), Failure> {
        let functions = forms::functions(experiment).map_err(|why| refused(why.to_string()))?;
        let solver = Solver::find(Which::Bitwuzla, python).map_err(bad)?;
        let jobs = run::jobs("", &functions);
        let bar = self.bar(jobs.len() as u64, "{bar:40} {pos} of {len} statements  {elapsed}  {msg}");
        let rows = run::all(&jobs, &solver, PATIENCE, &|row| {
            bar.set_message(row.statement);
            bar.inc(1);
        });
        bar.finish_and_clear();
        let rows = rows.map_err(failed)?;
        let open = rows.iter().filter(|row| !row.is_proved());
        let open = open.map(|row| format!("{}: {}", row.verdict, row.statement)).collect();
        let of = (experiment.title.as_str(), experiment.port.fingerprint().unwrap_or(0));
        Ok((certificate::text([name, text], of, &rows, solver.name()), open))
    }
}
