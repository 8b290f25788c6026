//! Tests of the program from the user's side: stdout, stderr and exit status.

use std::process::Command;

/// The linked form of `slew.c`.
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
    // The numbers next to the listing.
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
        (&["--elf", ELF, "--symbol", "slow"][..], "error: no function \"slow\"; nearest: slew\n"),
        (&["--elf", "/no/such/file", "--symbol", "f"], "error: image /no/such/file: there is no such file\n"),
        (&["--ceilings", "/no/such/file"], "error: /no/such/file: there is no such file\n"),
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
    let told = "slew.elf was built by an unnamed compiler; the ceilings hold for GCC 99 only. ";
    assert!(err.starts_with("failed: ") && err.contains(told) && err.lines().count() == 1, "{err}");
    let (status, out, err) = spoken(&["--ceilings", &file, "--record"]);
    assert_eq!((status, out.as_str()), (2, ""));
    assert!(err.contains("no compiler in common"), "{err}");
    assert_eq!(std::fs::read_to_string(&file).ok(), Some(text), "nothing is written");
    let _ = std::fs::remove_dir_all(&folder);
}

/// Returns the firmware with the compiler's name in its section `.comment`.
#[cfg(unix)]
fn signed(compiler: &str) -> Vec<u8> {
    let mut elf = std::fs::read(ELF).expect("the image");
    let find = |elf: &[u8], what: &[u8]| elf.windows(what.len()).position(|part| part == what).expect("a part");
    let name = find(&elf, b".persistent\0");
    elf[name..name + 11].copy_from_slice(b".comment\0\0\0");
    let word = |elf: &[u8], at: usize| u32::from_le_bytes(elf[at..at + 4].try_into().expect("4 bytes")) as usize;
    let names = find(&elf, b"\0.symtab\0");
    let headers = (word(&elf, 32)..elf.len()).step_by(40);
    // Section header: the index of its name, then offset and size.
    let mut ours = headers.filter(|&at| names + word(&elf, at) == name);
    let header = ours.next().expect("its header");
    let text = [elf.len() as u32, compiler.len() as u32].map(u32::to_le_bytes).concat();
    elf[header + 16..header + 24].copy_from_slice(&text);
    elf.extend(compiler.bytes());
    elf
}

#[test]
#[cfg(unix)]
fn ceilings_that_cannot_be_written_whole_stay_as_they_were() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("budgets.toml");
    std::fs::write(folder.path().join("slew.elf"), signed("clang 21.1.8")).expect("an image");
    let head = "compiler = \"clang 21.1.8\"\n\n[[instance]]\nname = \"slew\"\nsymbol = \"slew\"\n";
    let rest = "image = \"slew.elf\"\nceiling = { bound = 99 }\nwhy = \"a test\"\n";
    // Longer than the file-size limit of the shell below.
    let text = format!("{head}{rest}{}", format!("# {}\n", "-".repeat(70)).repeat(100));
    std::fs::write(&file, &text).expect("a file");
    let lowered = |limit: &str| {
        let limited = format!(r#"trap '' XFSZ; ulimit -f {limit}; exec "$0" --ceilings "$1" --lower"#);
        let program = env!("CARGO_BIN_EXE_cycle-bound");
        let output = Command::new("sh").args(["-c", &limited, program]).arg(&file).output().expect("sh");
        String::from_utf8(output.stderr).expect("UTF-8")
    };
    let err = lowered("1");
    assert!(err.contains("budgets.toml: cannot be written: File too large"), "{err}");
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), text);
    let err = lowered("unlimited");
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), text.replacen("99", "18", 1), "{err}");
}

/// An emulator stand-in that writes its process number and then only waits.
#[test]
#[cfg(target_os = "linux")]
fn an_emulator_dies_with_the_program_that_started_it_however_that_dies() {
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;
    use std::time::{Duration, Instant};

    for signal in ["KILL", "QUIT", "TERM"] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let emulator = folder.path().join("qemu-system-arm");
        let number = folder.path().join("number");
        let text = "#!/bin/sh\necho $$ > \"$NUMBER.new\" && mv \"$NUMBER.new\" \"$NUMBER\"\nexec sleep 600\n";
        std::fs::write(&emulator, text).expect("a program");
        std::fs::set_permissions(&emulator, std::fs::Permissions::from_mode(0o755)).expect("ours");
        let path = format!("{}:{}", folder.path().display(), std::env::var("PATH").unwrap_or_default());
        let mut command = Command::new(env!("CARGO_BIN_EXE_cycle-bound"));
        command.args(["--elf", ELF, "--symbol", "slew", "--emulate"]).env("PATH", path).env("NUMBER", &number);
        // Prevents a core dump of the killed program.
        let mut child = command.current_dir(folder.path()).spawn().expect("the program");
        let until = Instant::now() + Duration::from_secs(30);
        let wait_for = |done: &dyn Fn() -> bool| {
            while !done() && Instant::now() < until {
                std::thread::sleep(Duration::from_millis(5));
            }
            done()
        };
        assert!(wait_for(&|| number.exists()), "the emulator was not started");
        let number = std::fs::read_to_string(&number).expect("a number").trim().to_owned();
        let kill = |signal: &str, number: &str| Command::new("kill").args([signal, number]).status().expect("kill");
        assert!(kill(&format!("-{signal}"), &child.id().to_string()).success());
        child.wait().expect("a child of ours");
        // A dead process that is not yet waited for has an empty command line.
        let about = Path::new("/proc").join(&number).join("cmdline");
        let gone = wait_for(&|| std::fs::read(&about).map_or(true, |line| line.is_empty()));
        if !gone {
            kill("-KILL", &number);
        }
        assert!(gone, "{signal} left the emulator behind");
    }
}
