//! The program that the part `proofs` of the deep tier runs. A build of the tests makes it because this test runs it.

use std::process::Command;

#[test]
fn a_python_that_is_not_there_is_an_error_with_status_2() {
    let program = env!("CARGO_BIN_EXE_tick-proof");
    let output = Command::new(program).args(["--python", "/nowhere/python"]).output().expect("the program starts");
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(told.starts_with("error: ") && told.contains("/nowhere/python") && output.stdout.is_empty(), "{told}");
}
