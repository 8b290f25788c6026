//! Result of a run as numpy arrays.

use loop_sim::trace::{Row, Trace};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use scenario::StateName;

use crate::array;

/// Rows of a run, and everything that describes them.
#[pyclass(frozen, module = "edo_smc._edo_smc")]
pub(crate) struct Run {
    pub(crate) trace: Trace,
    pub(crate) states: &'static [StateName],
    pub(crate) units: [&'static str; 2],
    /// Numbers of the run as JSON, as in `run.json`.
    pub(crate) figures: String,
    /// Reason why the run broke off.
    pub(crate) error: Option<String>,
    pub(crate) title: String,
    pub(crate) warnings: Vec<String>,
    pub(crate) window_s: [f64; 2],
}

impl Run {
    fn channels<'py>(&self, py: Python<'py>, of: impl Fn(&Row, usize) -> f64) -> PyResult<Bound<'py, PyAny>> {
        let Trace { order, rows, .. } = &self.trace;
        let of = &of;
        array::floats(py, (0..*order).flat_map(|i| rows.iter().map(move |row| of(row, i))), &[*order, rows.len()])
    }
}

#[pymethods]
impl Run {
    fn columns(&self) -> Vec<String> {
        self.trace.columns(self.states)
    }

    /// Returns a column, shape (K,). `health` has unsigned integers.
    fn column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let at = self.columns().iter().position(|column| column == name);
        let at = at.ok_or_else(|| PyKeyError::new_err(name.to_owned()))?;
        let Trace { rows, .. } = &self.trace;
        if name == "health" {
            return array::flags(py, rows.iter().map(|row| u32::from(row.health.bits())));
        }
        let values = rows.iter().map(|row| self.trace.values(row).nth(at).unwrap_or(f64::NAN));
        array::floats(py, values, &[rows.len()])
    }

    fn x<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.channels(py, |row, i| row.x[i])
    }

    fn d<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.channels(py, |row, i| row.d[i])
    }

    fn d_hat<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.channels(py, |row, i| row.d_hat[i])
    }

    /// Returns the ending as a word and its time, s.
    fn ending(&self) -> (&'static str, Option<f64>) {
        (self.trace.ending.word(), self.trace.ending.at_s())
    }

    /// Returns names and units of the states; empty without names.
    fn states(&self) -> Vec<StateName> {
        self.states.iter().take(self.trace.order).copied().collect()
    }

    /// Returns the unit of the output and the unit of the control; empty if unknown.
    fn units(&self) -> [&'static str; 2] {
        self.units
    }

    fn figures(&self) -> &str {
        &self.figures
    }

    fn error(&self) -> Option<&str> {
        self.error.as_deref()
    }

    fn title(&self) -> &str {
        &self.title
    }

    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    fn window_s(&self) -> [f64; 2] {
        self.window_s
    }

    fn period_s(&self) -> f64 {
        self.trace.period_s
    }

    fn follows(&self) -> Option<usize> {
        self.trace.follows
    }

    fn __len__(&self) -> usize {
        self.trace.rows.len()
    }
}
