//! Test that the C loops and the Rust loop agree: two implementations, another integration method, one metric.

use std::ops::ControlFlow;

use benches::loops::{Beside, ClosedLoop};
use benches::{Joint, NOMINAL};
use controller_core::{FlexibleJoint, JointParameters, Reading};
use scenario::Source;

#[test]
fn loops_in_c_come_to_the_figure_of_ours() {
    let text = scenario::template("default", "paper").expect("a name");
    let sets = ["span_s=2.0", "window_s=[1.5, 2.0]"].map(String::from);
    let source = Source { file: "default.toml", text: &text, sets: &sets };
    let mut experiment = scenario::parse(&source, "default").expect("a good scenario");
    let config = experiment.spec.as_ref().and_then(|spec| spec.config.fixed::<4, 2>()).expect("the joint's shape");
    let law = Joint::<f32, 2>::try_design(&config, FlexibleJoint::<f32>::new(&NOMINAL)).expect("a good design");
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    assert!(error.is_none());
    let ours = experiment.metrics(&trace).y_ultimate;

    let joint = JointParameters::TABLE_I.chain(Reading::Reconstructed);
    let asked = ClosedLoop::new(&joint, 1e-3, 0.1, [2000, 1500, 10]);
    let apart = |theirs: f64| (theirs - ours).abs() / ours;
    assert!(apart(asked.alone(&law)) < 1e-6, "{} in C, {ours}", asked.alone(&law));
    let ways = [Beside::Sse2, Beside::Avx2, Beside::Avx512, Beside::Fast];
    let beside: Vec<f64> = ways.into_iter().filter_map(|way| asked.beside(way, &law)).collect();
    assert!(!beside.is_empty() || !cfg!(target_arch = "x86_64"), "SSE2 is on every such machine");
    assert!(beside.iter().all(|&theirs| apart(theirs) < 1e-4), "{beside:?} in C, {ours}");
}
