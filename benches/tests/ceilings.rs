//! Tests of the limits of the instruction counts, without counting.

#[path = "../benches/ceilings.rs"]
mod ceilings;

use ceilings::Ceilings;

const TEXT: &str = "# of the tick\ncompiler = \"rustc 1.95.0 for it\"\n[ceiling]\n\"a tick\" = 100\n";

fn read() -> Ceilings {
    Ceilings::read(TEXT).expect("good input")
}

#[test]
fn counts_of_another_compiler_are_refused_with_the_name_of_the_one_that_is_needed() {
    assert_eq!(read().refusal("rustc 1.95.0 for it"), None);
    let told = read().refusal("rustc 1.97.0 for it").expect("another compiler");
    assert!(
        told.starts_with("the ceilings hold for rustc 1.95.0 for it alone") && told.ends_with("--record"),
        "{told}"
    );
}

#[test]
fn a_count_fails_above_its_ceiling_far_below_it_and_without_one() {
    for (what, count, is_good) in
        [("a tick", 100, true), ("a tick", 95, true), ("a tick", 101, false), ("a tick", 94, false), ("b", 1, false)]
    {
        assert_eq!(read().verdict(what, count).is_empty(), is_good, "{what}: {count}");
    }
}

#[test]
fn recorded_counts_hold_for_the_compiler_that_they_are_of() {
    let text = read().recorded("rustc 1.97.0 for it", &[("a tick", 130)]).expect("another compiler");
    assert_eq!(text, TEXT.replace("1.95.0", "1.97.0").replace("100", "130"));
    assert!(read().recorded("rustc 1.95.0 for it", &[]).is_err_and(|told| told.contains("already")));
}
