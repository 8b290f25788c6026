//! Tests of the cycle budgets, with hand-written functions whose figures follow from their code.

use std::cell::Cell;

use super::*;

/// push {r4, lr}; vldr s0, [r0]; vldr s1, [r0, #4]; vadd.f32 s0, s0, s1; vstr s0, [r0]; pop {r4, pc}
const SUM: &[u16] = &[0xb510, 0xed90, 0x0a00, 0xedd0, 0x0a01, 0xee30, 0x0a20, 0xed80, 0x0a00, 0xbd10];
/// vdiv.f32 s0, s0, s1; bx lr
const RATIO: &[u16] = &[0xee80, 0x0a20, 0x4770];
/// vfma.f32 s0, s0, s1; bx lr
const FUSED: &[u16] = &[0xeea0, 0x0a20, 0x4770];
/// blx r3; bx lr
const UNKNOWN: &[u16] = &[0x4798, 0x4770];
/// 1: subs r0, #1; bne 1b; bx lr
const LOOP: &[u16] = &[0x3801, 0xd1fd, 0x4770];

/// Figures of `SUM`. Typical: push 3, vldr 2, vldr 2, vadd 1 and a stall, vstr 2, pop 3 + P. In the bound: pop 2 + N, P
/// = 3.
const FIGURES: &str =
    "bound = 18, typical = 16, pipelined = 14, instructions = 6, arithmetic = 1, flash = 20, stack = 8";

fn image(compiler: &str) -> Image {
    let functions =
        [("m::sum", SUM), ("m::ratio", RATIO), ("m::fused", FUSED), ("m::unknown", UNKNOWN), ("m::spin", LOOP)];
    Image::of(&functions).with_variable("m::STATE", 48).made_by("Linker: LLD 22").made_by(compiler)
}

/// A trace with one call of `SUM` and one of `RATIO`.
fn executed() -> Vec<u32> {
    [0, 2, 6, 10, 14, 18, 20, 24].map(|offset| 0x0800_0000 + offset).to_vec()
}

fn verdict_of(text: &str, compiler: &str) -> Result<Verdict, String> {
    judge(("b.toml", text), |_| Ok(image(compiler)), |_, _| Ok(executed()))
}

const RUSTC: &str = "rustc version 1.96.0 (ac68faa20 2026-05-25)";

/// A file with one instance of `symbol` that contains `lines`.
fn file(symbol: &str, lines: &str) -> String {
    format!(
        "compiler = \"rustc 1.96.0\"\n[[instance]]\nname = \"it\"\nimage = \"fw\"\nsymbol = \"{symbol}\"\n\
         why = \"measured\"\n{lines}\n"
    )
}

fn verdict(symbol: &str, lines: &str) -> Verdict {
    verdict_of(&file(symbol, lines), RUSTC).expect("good input")
}

fn refused(text: &str) -> String {
    verdict_of(text, RUSTC).expect_err(text)
}

fn one(lines: &[String]) -> &str {
    assert_eq!(lines.len(), 1, "{lines:?}");
    &lines[0]
}

#[test]
fn a_figure_at_its_ceiling_passes_and_one_above_it_fails() {
    let at = verdict("m::sum", &format!("state = \"STATE\"\nceiling = {{ {FIGURES}, state = 48 }}"));
    assert_eq!((at.failures.len(), at.declined.len(), at.notes.len()), (0, 0, 0), "{at:?}");
    assert_eq!(at.rows.len(), 8, "all but the coefficients");
    for (figure, value) in [("bound", 18), ("typical", 16), ("pipelined", 14), ("instructions", 6), ("arithmetic", 1)] {
        let found = verdict("m::sum", &format!("ceiling = {{ {figure} = {} }}", value - 1));
        let line = one(&found.failures);
        // The position in the message is the position of the number.
        let column = "ceiling = { ".len() + figure.len() + " = ".len() + 1;
        let place = format!("b.toml:7:{column}: `instance[1].ceiling.{figure}`: it has {value} ");
        assert!(line.starts_with(&place), "{line}");
        assert!(line.ends_with("above the ceiling") && found.declined.is_empty(), "{line}");
    }
    let state = verdict("m::sum", "state = \"m::STATE\"\nceiling = { state = 47 }");
    assert!(one(&state.failures).contains("it has 48 B"), "{state:?}");
}

#[test]
fn the_largest_number_that_can_be_written_is_a_ceiling_like_any_other() {
    let most = i64::MAX;
    let found = verdict("m::sum", &format!("barrier = {most}\nceiling = {{ flash = {most} }}"));
    assert!(one(&found.failures).ends_with("write flash = 20"), "{found:?}");
}

#[test]
fn a_figure_more_than_5_percent_below_its_ceiling_fails_and_the_new_ceiling_is_told() {
    // 20 of 21 is 4.8 % below, 20 of 22 is 9.1 %.
    assert_eq!(verdict("m::sum", "ceiling = { flash = 21 }").failures, Vec::<String>::new());
    let loose = verdict("m::sum", "ceiling = { flash = 22 }");
    let told = "b.toml:7:21: `instance[1].ceiling.flash`: it has 20 B, more than 5 % below the ceiling of 22; write \
                flash = 20";
    assert_eq!(one(&loose.failures), told);
    assert!(loose.to_string().contains("loose: write 20"), "{loose}");
    // At a distance of exactly 5 %: 19 of 20.
    assert_eq!(verdict("m::sum", "ceiling = { bound = 18 }").failures, Vec::<String>::new());
}

#[test]
fn ceilings_are_lowered_to_their_figures_and_never_raised() {
    let text = file("m::sum", "ceiling = { bound = 30, flash = 19, stack = 9, typical = 16 } # of the first board");
    let lower = text.replace("30", "18").replace("stack = 9", "stack = 8");
    let lowered_by = |text: &str, compiler: &str| lowered(text, &verdict_of(text, compiler).expect("good input"));
    assert_eq!(lowered_by(&text, RUSTC), Some(lower.clone()));
    assert_eq!(lowered_by(&lower, RUSTC), None);
    assert_eq!(lowered_by(&text, "rustc version 1.97.0"), None, "not its compiler");
}

#[test]
fn a_figure_below_its_floor_says_that_the_floor_is_none() {
    let found = verdict("m::sum", "ceiling = { typical = 16 }\nfloor = { typical = 16 }");
    assert_eq!(found.failures, Vec::<String>::new());
    assert!(found.to_string().contains("1.00      1.00"), "{found}");
    let found = verdict("m::sum", "floor = { bound = 19 }");
    assert!(one(&found.failures).contains("below the floor of 19"), "{found:?}");
}

#[test]
fn what_is_not_to_be_there_fails_and_an_exception_that_nothing_needs_fails_too() {
    for (symbol, what) in
        [("m::ratio", "a division"), ("m::fused", "a multiply-accumulate"), ("m::spin", "a backward jump")]
    {
        let found = verdict(symbol, "loops = []");
        assert!(one(&found.failures).starts_with(&format!("it: {what}")), "{found:?}");
    }
    assert_eq!(verdict("m::ratio", "allow = { division = \"b(x) varies\" }").failures, Vec::<String>::new());
    let found = verdict("m::sum", "allow = { division = \"b(x) varies\" }");
    assert_eq!(one(&found.failures), "b.toml:7:22: `instance[1].allow.division`: unused exception: remove it");
}

#[test]
fn of_another_compilers_code_no_figure_is_judged_and_that_fails() {
    for other in ["rustc version 1.97.0 (0 2026-07)", "rustc version 1.96.01", "GCC: (Debian) 12.2.1", ""] {
        for ceiling in ["bound = 10, flash = 1000", "bound = 18"] {
            let found = verdict_of(&file("m::sum", &format!("ceiling = {{ {ceiling} }}")), other).expect("good input");
            let line = one(&found.failures);
            assert!(line.starts_with("fw was built by ") && line.contains("hold for rustc 1.96.0 only"), "{line}");
            assert!(line.contains("Build with it, or record your own figures: --record"), "{line}");
            assert_eq!((found.declined.len(), found.notes.len()), (0, 0), "{found:?}");
            assert!(!ceiling.contains("10,") || found.to_string().contains("above by 8"), "{found}");
        }
        // The checks hold for code of every compiler.
        let found = verdict_of(&file("m::ratio", "ceiling = { bound = 1 }"), other).expect("good input");
        assert!(found.failures.len() == 2 && found.failures[1].starts_with("it: a division"), "{found:?}");
        // A loop at another place hides nothing from the checks. Unreadable code does.
        let text = file("m::spin", "loops = [\"sum+0x2=3\"]\nallow = { backward_branch = \"a pause\" }");
        let found = verdict_of(&text, other).expect("good input");
        assert_eq!((found.failures.len(), found.declined.len(), found.notes.len()), (1, 0, 1), "{found:?}");
        let text = file("m::unknown", "allow = { call = \"by a table\" }");
        assert_eq!(verdict_of(&text, other).expect("good input").declined.len(), 1);
    }
    assert_eq!(verdict_of(&file("m::sum", ""), "rustc version 1.96.0").map(|found| found.failures.len()), Ok(0));
}

#[test]
fn figures_of_another_compiler_are_recorded_with_its_name_and_judged_from_then_on() {
    const OTHER: &str = "rustc version 1.97.0 (0 2026-07)";
    let by = |compiler: &'static str| move |text: &str| verdict_of(text, compiler);
    let text = file("m::sum", "ceiling = { bound = 10, flash = 1000, stack = 8 } # of the first board")
        + "[[difference]]\nname = \"none\"\nof = \"it\"\nwithout = \"it\"\nwhy = \"so\"\nceiling = { bound = 3 }\n";
    let own = text.replace("1.96.0", "1.97.0").replace("10,", "18,").replace("1000", "20").replace("= 3 }", "= 0 }");
    assert_eq!(recorded("b.toml", &text, by(OTHER)), Ok(Recorded::Text(own.clone())));
    assert_eq!(verdict_of(&own, OTHER).map(|found| found.failures), Ok(Vec::new()));
    // `--record` does not raise limits of the same compiler.
    let refused = recorded("b.toml", &text, by(RUSTC)).expect_err("its own compiler");
    assert!(refused.contains("b.toml") && refused.contains("--lower") && refused.contains("by hand"), "{refused}");
    let nameless = recorded("b.toml", &text, by("")).expect_err("no compiler");
    assert!(nameless.contains("no compiler in common"), "{nameless}");
    // A missing figure prevents recording: nothing is written.
    let spins = file("m::spin", "ceiling = { bound = 9 }\nallow = { backward_branch = \"a pause\" }");
    let Ok(Recorded::Declined(found)) = recorded("b.toml", &spins, by(OTHER)) else { panic!("a loop without rounds") };
    assert!(one(&found.declined).contains("a loop begins here"), "{found:?}");
}

#[test]
fn what_has_no_bound_is_declined_once() {
    let found = verdict("m::spin", "ceiling = { bound = 9, stack = 0 }\nallow = { backward_branch = \"a pause\" }");
    assert!(one(&found.declined).starts_with("it: 0x08000024 (m::spin+0x0)"), "{found:?}");
    let vouched = "loops = [\"m::spin=2\"]\nceiling = { bound = 10 }\nallow = { backward_branch = \"a pause\" }";
    // subs 1, bne 4, subs 1, bne 1, bx 4: 11.
    assert!(one(&verdict("m::spin", vouched).failures).contains("it has 11 cycles"));
    // The trace does not contain the function.
    let found = verdict("m::fused", "ceiling = { typical = 9 }\nallow = { fused = \"a test\" }");
    assert_eq!(one(&found.declined), "it: trace: the function was not executed to its end");
}

#[test]
fn the_emulator_runs_once_for_an_image_and_only_for_figures_that_need_it() {
    let runs = |text: &str, answer: Result<Vec<u32>, String>| {
        let times = Cell::new(0);
        let found = judge(
            ("b.toml", text),
            |_| Ok(image(RUSTC)),
            |_, ranges| {
                times.set(times.get() + 1);
                assert_eq!(ranges[0], (0x0800_0000, 20));
                answer.clone()
            },
        );
        (times.get(), found.expect("good input"))
    };
    assert_eq!(runs(&file("m::sum", "ceiling = { bound = 18 }"), Ok(executed())).0, 0);
    let two = file("m::sum", "ceiling = { typical = 16 }")
        + &file("m::ratio", "ceiling = { typical = 17 }\nallow = { division = \"a test\" }")
            .replace("compiler = \"rustc 1.96.0\"", "")
            .replace("\"it\"", "\"other\"");
    let (times, found) = runs(&two, Ok(executed()));
    assert_eq!((times, found.failures.len(), found.declined.len()), (1, 0, 0), "{found:?}");
    let (_, found) = runs(&file("m::sum", "ceiling = { typical = 16 }"), Err("no emulator here".into()));
    assert_eq!(one(&found.declined), "fw was not run: no emulator here");
}

#[test]
fn a_difference_is_held_from_above_or_exactly() {
    let both = file("m::sum", "ceiling = { typical = 16 }")
        + &file("m::ratio", "allow = { division = \"a test\" }")
            .replace("compiler = \"rustc 1.96.0\"", "")
            .replace("\"it\"", "\"other\"");
    let with = |of: &str, without: &str, line: &str| {
        let text = format!(
            "{both}[[difference]]\nname = \"more\"\nof = \"{of}\"\nwithout = \"{without}\"\nwhy = \"so\"\n{line}\n"
        );
        verdict_of(&text, RUSTC)
    };
    let failures = |line: &str| with("it", "other", line).expect("good input").failures;
    // sum 18 minus ratio (14 + 4): 0; 20 B minus 6 B.
    for good in ["ceiling = { bound = 0 }", "ceiling = { flash = 100 }", "exactly = { flash = 14, arithmetic = 1 }"] {
        assert_eq!(failures(good), Vec::<String>::new(), "{good}");
    }
    assert!(one(&failures("ceiling = { flash = 13 }")).contains("`difference[1].ceiling.flash`: more has 14 B, above"));
    assert!(one(&failures("exactly = { flash = 15 }")).contains("more has 14 B, not 15"));
    // The opposite difference is negative.
    let reverse = with("other", "it", "ceiling = { flash = 0 }").expect("good input");
    assert_eq!(reverse.failures, Vec::<String>::new());
    assert!(reverse.rows.iter().any(|row| row.name == "more" && row.value == Some(-14)), "{reverse:?}");
    let twice = verdict_of(&format!("{both}[[difference]]\nname = \"it\"\nwhy = \"so\"\n"), RUSTC);
    assert!(twice.is_err_and(|told| told.ends_with("`difference[1].name`: \"it\" is the name of an instance already")));
    let slip = with("it", "othr", "ceiling = { flash = 0 }").expect_err("a slip");
    assert!(slip.contains("`difference[1].without`: no instance is called \"othr\"; did you mean `other`?"), "{slip}");
}

#[test]
fn tables_in_a_line_are_read_as_those_below_each_other() {
    let line = "compiler = \"rustc 1.96.0\"\ninstance = [{ name = \"it\", image = \"fw\", symbol = \"m::sum\", \
                why = \"measured\", ceiling = { bound = 17 } }]\n";
    let found = verdict_of(line, RUSTC).expect("good input");
    assert!(one(&found.failures).starts_with("b.toml:2:99: `instance[1].ceiling.bound`: it has 18"), "{found:?}");
}

#[test]
fn bad_input_is_told_with_its_place_and_what_would_be_right() {
    let good = file("m::sum", "ceiling = { bound = 18 }");
    assert!(verdict_of(&good, RUSTC).is_ok());
    let with = |from: &str, to: &str| good.replace(from, to);
    let and = |line: &str| format!("{good}{line}\n");
    for (text, what) in [
        (with("m::sum", "m::sun"), "b.toml:5:10: `instance[1].symbol`: no function \"m::sun\"; nearest: m::sum"),
        (with("why = \"measured\"\n", ""), "b.toml:2:1: `instance[1].why`: is missing: the reason"),
        (with("\"measured\"", "\" \""), "b.toml:6:7: `instance[1].why`: is missing"),
        (with("compiler = \"rustc 1.96.0\"", ""), "`compiler`: is missing"),
        (with("name = \"it\"\n", ""), "`instance[1].name`: is missing"),
        (with("bound", "bund"), "b.toml:7:13: unknown key `instance[1].ceiling.bund`; did you mean `bound`?"),
        (with("18", "-1"), "`instance[1].ceiling.bound`: found -1, expected a whole number >= 0"),
        (with("18", "\"many\""), "found \"many\", expected a whole number"),
        (with("[[instance]]", "[[instance"), "b.toml:2:11: not TOML"),
        (and("loops = 3"), "found 3, expected a list of strings"),
        (and("loops = [\"f=1\", 3]"), "b.toml:8:17: `instance[1].loops[2]`: found 3, expected text"),
        (and("flash = 3"), "unknown key `instance[1].flash`; it belongs to difference.ceiling.flash or difference."),
        (and("floor = { flash = 3 }"), "unknown key `instance[1].floor.flash`; it belongs to"),
        (
            and("banana = 3"),
            "; expected one of allow, barrier, ceiling, coefficients, floor, image, loops, name, state,",
        ),
        (and("\"fl\\noor\" = 3"), "unknown key `instance[1].fl\\noor`; did you mean `floor`?"),
        (format!("difference = {}\n{good}", "[".repeat(100_000)), "not TOML"),
        ("compiler = [1, 2]\n[[instance]]\n".into(), "`compiler`: found a list of 2, expected text"),
        (format!("compiler = \"{}\"x", "y".repeat(99)), "not TOML"),
        (with("18", &format!("\"{}\"", "y".repeat(99))), "found \"yyy"),
        ("instance = 3".into(), "b.toml:1:12: `instance`: found 3, expected a list of tables"),
        (and("loops = [\"m::sum+0x40=3\"]"), "`instance[1].loops`: --loop"),
        (and("state = \"m::STADE\""), "no variable or constant \"m::STADE\"; nearest: m::STATE"),
        (with("bound = 18", "state = 48"), "`instance[1].ceiling.state`: needs the measured static"),
        (and("floor = { bound = 19 }"), "`instance[1].floor.bound`: 19: must be <= the ceiling of 18"),
        (and("allow = { division = \"\" }"), "`instance[1].allow.division`: is missing: the reason"),
        ("compiler = \"rustc 1.96.0\"".into(), "`instance`: is missing"),
        (good.clone() + &good.replace("compiler = \"rustc 1.96.0\"", ""), "instance[2].name`: \"it\" is used already"),
    ] {
        let told = refused(&text);
        assert!(told.contains(what) && told.lines().count() == 1, "{told}\n{what}");
    }
    let told =
        judge(("b.toml", &good), |image| Err(format!("image {image}: there is no such file")), |_, _| Ok(executed()));
    assert_eq!(told, Err("b.toml:4:9: `instance[1].image`: image fw: there is no such file".into()));
}
