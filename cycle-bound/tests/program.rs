//! The program as its user meets it: what stands on stdout and stderr, and the exit status.

use std::process::Command;

/// `slew.c`, linked.
const ELF: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/slew.elf");

/// Exit status, stdout, stderr.
fn spoken(args: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_cycle-bound")).args(args).output().expect("the program");
    let text = |bytes| String::from_utf8(bytes).expect("what it prints is UTF-8");
    (output.status.code().expect("it ends by itself"), text(output.stdout), text(output.stderr))
}

#[test]
fn the_program_prints_the_example_of_its_page() {
    let page = include_str!("../README.md");
    let (status, out, err) = spoken(&["--elf", ELF, "--symbol", "slew"]);
    assert_eq!((status, err.as_str()), (0, ""));
    assert!(page.contains(&out), "{out}");
    let (status, _, err) = spoken(&["--elf", ELF, "--symbol", "slew", "--max-cycles", "16"]);
    assert_eq!((status, err.as_str()), (1, "failed: bound of 18 cycles, more than 16\n"));
    assert!(page.contains(err.trim_end()));
    // The numbers beside the listing.
    let listing = page.split("```").find(|block| block.starts_with("text\nslew: ")).expect("the listing");
    let costs = listing.lines().filter_map(|line| line.get(33..41));
    let sum: u64 = costs.flat_map(str::split_whitespace).filter_map(|word| word.parse::<u64>().ok()).sum();
    assert_eq!(sum, 18);
    let (status, out, _) = spoken(&["--elf", ELF, "--symbol", "slew", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).expect("one JSON object");
    assert_eq!((status, &json["longest"]["cycles"]), (0, &18.into()));
}

#[test]
fn what_has_no_answer_is_status_2_and_bad_input_prints_nothing_on_stdout() {
    let (status, out, err) = spoken(&["--elf", ELF, "--symbol", "slew", "--core", "cortex-m7", "--max-cycles", "99"]);
    assert!(status == 2 && out.contains("cortex-m7") && err.starts_with("declined: --max-cycles: "), "{err}");
    for (args, told) in [
        (&["--elf", ELF, "--symbol", "slow"][..], "error: no function \"slow\" in it; nearest: slew\n"),
        (&["--elf", "/no/such/file", "--symbol", "f"], "error: image /no/such/file: there is no such file\n"),
        (&["--ceilings", "/no/such/file"], "error: /no/such/file: cannot be read: "),
        (&["--elf", ELF], "error: the following required arguments were not provided:\n  --symbol <NAME>\n"),
    ] {
        let (status, out, err) = spoken(args);
        assert_eq!((status, out.as_str()), (2, ""), "{args:?}");
        assert!(err.starts_with(told), "{err}");
    }
}

#[test]
fn a_gate_that_cannot_judge_does_not_pass() {
    let folder = std::env::temp_dir().join(format!("cycle-bound-elsewhere-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("temporary folder");
    let file = folder.join("ceilings.toml").display().to_string();
    let text = format!(
        "compiler = \"GCC 99\"\n[[instance]]\nname = \"slew\"\nimage = \"{ELF}\"\nsymbol = \"slew\"\n\
         ceiling = {{ bound = 8 }}\nwhy = \"measured\"\n"
    );
    std::fs::write(&file, &text).expect("temporary file");
    let (status, out, err) = spoken(&["--ceilings", &file]);
    assert!(status == 1 && out.contains("above by 10"), "{out}");
    let told = "slew.elf was built by a compiler that it does not name; the ceilings hold for GCC 99 alone: ";
    assert!(err.starts_with("failed: ") && err.contains(told) && err.lines().count() == 1, "{err}");
    let (status, out, err) = spoken(&["--ceilings", &file, "--record"]);
    assert_eq!((status, out.as_str()), (2, ""));
    assert!(err.contains("no compiler that all images name"), "{err}");
    assert_eq!(std::fs::read_to_string(&file).ok(), Some(text), "nothing is written");
    let _ = std::fs::remove_dir_all(&folder);
}
