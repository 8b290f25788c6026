//! Functions for bindings: their results agree, they stop on request, and their errors state cause and remedy.

use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

use study::compare::Bench;
use study::map::{Axis, MapRequest, Question, Subject};
use study::monte_carlo::{Columns, Plan, trial};
use study::tune::{self, Effort, Limits};
use study::{Error, Watch};

const MOTOR: Subject<'static> = Subject { file: "motor.toml", text: scenario::MOTOR, name: "motor", sets: &[] };

#[test]
fn margins_are_those_of_the_design() {
    let experiment = MOTOR.with(&[]).expect("a scenario");
    let design = study::design(&experiment).expect("a design");
    assert_eq!(study::margins(&experiment).ok(), design.got.margins);
    let unstable = MOTOR.with(&["error.torque_percent=-90".into()]).expect("a scenario");
    let error = study::margins(&unstable).expect_err("no margins");
    assert!(!error.is_input && error.what.contains("unstable"), "{error}");
}

#[test]
fn each_computation_ends_without_an_answer_when_it_is_stopped() {
    let stop = AtomicBool::new(true);
    let watch = Watch::new(&stop, &|| ());
    let mut experiment = MOTOR.with(&[]).expect("a scenario");

    let request = MapRequest { preset: Some("gain"), ..MapRequest::default() };
    let question = Question::new(MOTOR, &request).expect("a question");
    assert_eq!(study::map(&question, watch), Ok(None));

    let bench = Bench::new("motor.toml", scenario::MOTOR, &[]).expect("a drive");
    let specification = tune::Specification::new(&bench, &Limits::default()).expect("a specification");
    let effort = Effort { evaluations: 9, seed: 1, most_cycles: None };
    assert_eq!(study::tune(&bench, &MOTOR, &specification, effort, watch), Ok(None));

    let (trace, _) = experiment.run(&mut |_| ControlFlow::Continue(()));
    assert_eq!(study::bounds(&experiment, &trace, &MOTOR, watch), Ok(None));

    let plan = Plan::new(MOTOR, &["error.torque_percent=uniform(-50,50)".into()], 1).expect("a plan");
    let of_file = trial(&mut experiment, Watch::none()).expect("not stopped");
    let columns = Columns::new(&plan, &experiment, &of_file);
    assert_eq!(study::trials(&plan, &columns, 0..3, watch), None);
    let rows = study::trials(&plan, &columns, 0..3, Watch::none()).expect("not stopped");
    assert!(rows.len() == 3 && rows.iter().all(|(_, row)| row.len() == columns.names.len()));
}

#[test]
fn an_error_has_key_cause_and_remedy() {
    let Error { key, what, remedy, is_input } = Axis::parse("k=1,,2").expect_err("an empty value");
    assert_eq!((key.as_str(), what.as_str(), is_input), ("\"k=1,,2\"", "a value is empty", true));
    assert!(remedy.starts_with("expected KEY="), "{remedy}");
    let request = MapRequest { corners: Some(150.0), ..MapRequest::default() };
    let error = Question::new(MOTOR, &request).map(|_| ()).expect_err("too much");
    assert_eq!(error.to_string(), "--corners 150: expected a number above 0 and below 100");
}
