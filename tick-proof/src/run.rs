//! Runs statements in parallel and returns the results as rows.

use std::sync::Mutex;
use std::thread;
use std::time::Duration;

use crate::solver::{Solver, Verdict};
use crate::statement::Statement;
use crate::{Functions, statements};

/// A statement about an instance.
pub struct Job {
    /// Name of the instance.
    pub instance: String,
    /// The statement.
    pub statement: Statement,
}

/// Returns all statements about an instance.
pub fn jobs(name: &str, functions: &Functions) -> Vec<Job> {
    let of = |statement| Job { instance: name.into(), statement };
    statements(functions).into_iter().map(of).collect()
}

/// Result of a job.
#[derive(Clone, Debug)]
pub struct Row {
    /// Name of the instance.
    pub instance: String,
    /// Text of the statement.
    pub statement: &'static str,
    /// Proved if every query was proved; otherwise the verdict of the first other query.
    pub verdict: Verdict,
    /// The query that was not proved.
    pub question: Option<String>,
    /// Number of queries.
    pub asked: usize,
    /// Computing time of the solver for all queries, s.
    pub seconds: f64,
}

/// Runs all jobs, one per processor at a time. Rows are shown as they arrive and returned in order.
///
/// # Errors
/// If the solver cannot be started.
pub fn all(jobs: &[Job], solver: &Solver, budget: Duration, show: &(dyn Fn(&Row) + Sync)) -> Result<Vec<Row>, String> {
    let next = Mutex::new(0..jobs.len());
    let rows: Mutex<Vec<(usize, Row)>> = Mutex::default();
    let work = || -> Result<(), String> {
        loop {
            let Some(at) = locked(&next).next() else { return Ok(()) };
            let row = one(&jobs[at], solver, budget)?;
            let mut rows = locked(&rows);
            show(&row);
            rows.push((at, row));
        }
    };
    let workers = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        let started: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        started.into_iter().try_for_each(|worker| worker.join().unwrap_or_else(|_| Err("a worker panicked".into())))
    })?;
    let mut rows = rows.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    rows.sort_by_key(|(at, _)| *at);
    Ok(rows.into_iter().map(|(_, row)| row).collect())
}

fn locked<T>(of: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    of.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn one(Job { instance, statement }: &Job, solver: &Solver, budget: Duration) -> Result<Row, String> {
    let (mut seconds, mut verdict, mut question, mut asked) = (0.0, Verdict::Proved, None, 0);
    for next in &statement.questions {
        asked += 1;
        let took;
        (verdict, took) = solver.ask(&next.text, budget)?;
        seconds += took;
        if verdict != Verdict::Proved {
            question = Some(next.what.clone());
            break;
        }
    }
    if asked == 0 {
        verdict = Verdict::Undecided("there is nothing to ask".into());
    }
    Ok(Row { instance: instance.clone(), statement: statement.name, verdict, question, asked, seconds })
}

impl Row {
    /// Returns whether every query was proved.
    pub fn is_proved(&self) -> bool {
        self.verdict == Verdict::Proved
    }

    /// Returns the details of a row that is not proved: the query and the counter-example in plain numbers.
    pub fn details(&self) -> Vec<String> {
        let Some(question) = &self.question else { return Vec::new() };
        match &self.verdict {
            Verdict::Proved => Vec::new(),
            Verdict::Undecided(why) => vec![format!("{question}: {why}")],
            Verdict::Refuted(values) => {
                let values: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
                vec![format!("{question}: not for {}", values.join(", "))]
            }
        }
    }
}
