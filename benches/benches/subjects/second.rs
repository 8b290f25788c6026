//! One second of the default scenario, counted and timed.

use std::ops::ControlFlow;

use scenario::{Experiment, Source};

/// Returns the default scenario; one second is 1000 periods: 1001 ticks, and the plant between them.
///
/// # Panics
/// The default scenario is invalid.
pub(crate) fn second() -> Experiment {
    let text = scenario::template("default", "paper").expect("a name");
    let sets = ["span_s=1.0", "window_s=[0.5, 1.0]"].map(str::to_owned);
    scenario::parse(&Source { file: "default.toml", text: &text, sets: &sets }, "default").expect("a good scenario")
}

/// Runs the scenario; returns the number of ticks.
#[inline(never)]
pub(crate) fn closed_loop_second(experiment: &mut Experiment) -> usize {
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    assert!(error.is_none() && trace.rows.len() == 1001, "the loop ran to its end");
    trace.rows.len()
}
