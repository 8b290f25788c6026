//! Program of this machine, with which the part `wasm` of the deep tier compares WebAssembly. A build of the tests
//! compiles the program because this test runs it.

use std::collections::BTreeSet;
use std::process::Command;

use loop_sim_wasm::CASES;

#[test]
fn each_run_has_a_number_of_its_own() {
    let output = Command::new(env!("CARGO_BIN_EXE_loop-sim-wasm")).output().expect("the program starts");
    let text = String::from_utf8(output.stdout).expect("text");
    let numbers: BTreeSet<&str> = text.lines().collect();
    assert_eq!(numbers.len() as u64, u64::from(CASES), "{text}");
    assert!(numbers.iter().all(|number| number.len() == 16 && number.chars().any(|digit| digit != '0')), "{text}");
}
