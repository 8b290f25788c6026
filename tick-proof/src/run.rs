//! Statements, asked in parallel, and what came out as rows.

use std::sync::Mutex;
use std::thread;
use std::time::Duration;

use crate::solver::{Solver, Verdict};
use crate::statement::Statement;
use crate::{Functions, statements};

/// A statement about an instance.
pub struct Job {
    /// Of which instance.
    pub instance: String,
    /// What is claimed.
    pub statement: Statement,
}

/// Everything that is asked of an instance.
pub fn jobs(name: &str, functions: &Functions) -> Vec<Job> {
    let of = |statement| Job { instance: name.into(), statement };
    statements(functions).into_iter().map(of).collect()
}

/// What became of a job.
#[derive(Clone, Debug)]
pub struct Row {
    /// Of which instance.
    pub instance: String,
    /// What was claimed.
    pub statement: &'static str,
    /// Proved if every question was; else that of the first that was not.
    pub verdict: Verdict,
    /// The question that was not proved.
    pub question: Option<String>,
    /// Questions asked.
    pub asked: usize,
    /// Computing time of the solver for all of them.
    pub seconds: f64,
}

/// Asks all of them, as many at a time as there are processors. Rows are shown as they come and returned in order.
///
/// # Errors
/// When the solver cannot be started.
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
    /// Every question?
    pub fn is_proved(&self) -> bool {
        self.verdict == Verdict::Proved
    }

    /// What is to be said of a row that is not proved: the question, and the counter-example in plain numbers.
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
