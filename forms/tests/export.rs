//! Tests of the content of exported files, and of the rejected exports.

use forms::{Effort, Error, Files, Form, PREFIX, assembly};
use scenario::{Source, parse};

fn exported(text: &str, sets: &[&str], form: Form<'_>) -> Result<String, Error> {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let source = Source { file: "it.toml", text, sets: &sets };
    forms::export(&parse(&source, "it").expect("a good scenario"), &source, form)
}

#[test]
fn the_head_says_scenario_settings_version_and_design() {
    for form in [Form::Standalone(PREFIX), Form::Rust] {
        let text = exported("# a line of mine\nspan_s = 3.0\n", &["controller.k_l=20"], form).expect("exported");
        let design = "0x";
        for part in
            ["Scenario it.toml (CRC-32 0x", "# a line of mine", "span_s = 3.0", "--set controller.k_l=20", design]
        {
            assert!(text.contains(part), "{part:?} in {form:?}:\n{text}");
        }
        assert!(text.contains(controller_core::VERSION));
    }
}

#[test]
fn a_design_that_does_not_limit_u_says_so_in_the_file_and_how_to_limit_it() {
    let limits = "controller.limits={ min = -300, max = 300 }";
    for form in [Form::Standalone(PREFIX), Form::Archive(PREFIX), Form::Rust] {
        let text = |sets: &[&str]| exported("", sets, form).expect("exported");
        let told = "u has no limits: up to 1e12 may go out; set controller.limits={ min = .., max = .. }";
        assert!(text(&[]).contains(&format!("Warning of the design: {told}\n")), "{form:?}");
        assert!(text(&["controller.limits.min=-300"]).contains("u has no upper limit: up to 1e12 may"), "{form:?}");
        assert!(text(&["controller.limits.max=300"]).contains("u has no lower limit: up to -1e12 may"), "{form:?}");
        assert!(!text(&[limits]).contains("Warning of the design"), "{form:?}");
    }
}

#[test]
fn a_comment_of_the_scenario_cannot_end_the_comment_of_c() {
    let comment = "# */ int stray; /* c /*/ d \u{2066} e\tf\n";
    let text = exported(comment, &[], Form::Standalone(PREFIX)).expect("exported");
    let head = text.split_once(" */\n").expect("the end of the first comment").0;
    assert!(head.contains("# * / int stray; / * c / * / d ? e f\n"), "{head}");
}

#[test]
fn what_cannot_be_exported_is_refused_with_the_way_out() {
    let refused = |text: &str, form| exported(text, &[], form).expect_err("a refusal");
    let benchmark = "[plant]\nkind = \"benchmark\"\n[controller]\nc = [5.0, 1.0]\n";
    assert!(refused(benchmark, Form::Standalone(PREFIX)).to_string().contains("take --lang rust"));
    assert!(exported(benchmark, &[], Form::Rust).expect("exported").contains("Benchmark<Libm>"));
    let double = "[controller]\nprecision = \"f64\"\n";
    assert_eq!(refused(double, Form::Standalone(PREFIX)), Error::Precision);
    assert_eq!(refused(double, Form::Rust), Error::Precision);
    assert!(Error::Precision.to_string().contains("set controller.precision=f32"));
    let told = refused(scenario::OWN, Form::Rust);
    assert!(told.to_string().contains("set controller.nominal.a=[19.62, 0.0], its slopes at rest"), "{told}");
    for form in [Form::Standalone(PREFIX), Form::Archive(PREFIX)] {
        assert_eq!(refused(scenario::OWN, form), told);
        // The suggested remedy works.
        assert!(exported(scenario::OWN, &["controller.nominal.a=[19.62, 0.0]"], form).is_ok());
    }
    let baseline = include_str!("../../host-sim/scenarios/fig01_baseline.toml");
    assert!(refused(baseline, Form::Rust).to_string().contains("set controller.kind=proposed"));
}

#[test]
fn assembly_has_the_names_of_the_c_file_and_refuses_what_it_does_not_carry() {
    let effort = Effort { rounds: 1, steps: 20_000, seed: 1 };
    let asm = |text: &str, effort: &Effort| {
        let source = Source { file: "it.toml", text, sets: &[] };
        assembly(&parse(&source, "it").expect("a good scenario"), &source, "left", effort)
    };
    let two = "plant = { kind = 'chain', order = 2, a = [-2, -1], b = 2 }\ncontroller = { c = [5, 1] }\n";
    let Files { assembly: text, header } = asm(two, &effort).expect("exported");
    for name in ["tick", "tick_u", "start", "not_started", "report_applied", "estimates", "reset"] {
        assert!(
            text.contains(&format!(".global left_{name}\n")) && header.contains(&format!(" left_{name}(")),
            "{name}"
        );
    }
    assert!(!header.contains('@') && header.contains("#define LEFT_N 2") && header.contains("left_tick_or_start("));
    let refused = |text: &str, effort: &Effort| asm(text, effort).expect_err("a refusal");
    let gated = two.replace("[5, 1] }", "[5, 1], samples = { min = [-1, -1], max = [1, 1] } }");
    assert_eq!(refused(&gated, &effort), Error::AssemblySamples, "{gated}");
    assert!(Error::AssemblySamples.to_string().contains("leave out controller.samples"));
    assert!(refused(two, &Effort { steps: 0, ..effort }).to_string().contains("no order was found"));
    // A formula is not part of the design: the caller evaluates it.
    let header = asm(scenario::OWN, &effort).expect("exported").header;
    assert!(header.contains("float left_tick_u(left_state *state, const float x[LEFT_N], float drift);"), "{header}");
    let double = two.replace("[5, 1] }", "[5, 1], precision = 'f64' }");
    assert_eq!(refused(&double, &effort), Error::Precision);
}

#[test]
fn assembly_of_a_drive_has_the_names_of_its_c_file() {
    let text = include_str!("../../firmware/motor.toml");
    let source = Source { file: "motor.toml", text, sets: &["drive.gain_sets=1".into()] };
    let experiment = parse(&source, "motor").expect("a good scenario");
    let effort = Effort { rounds: 1, steps: 20_000, seed: 1 };
    let Files { assembly: code, header } = assembly(&experiment, &source, "left", &effort).expect("exported");
    let c = forms::export(&experiment, &source, Form::Standalone("left")).expect("exported");
    let names = |text: &str| -> Vec<String> {
        let calls = text.split("left_").skip(1).filter_map(|rest| rest.split_once('('));
        let mut names: Vec<String> = calls.map(|(name, _)| name.to_owned()).collect();
        names.retain(|name| !name.is_empty() && name.chars().all(|c| c.is_ascii_lowercase() || c == '_'));
        names.sort();
        names.dedup();
        names
    };
    let missing: Vec<String> = names(&c).into_iter().filter(|name| !names(&header).contains(name)).collect();
    assert_eq!(missing, Vec::<String>::new());
    for name in ["tick", "tick_u", "observe", "law", "start", "report_applied", "estimates", "reset"] {
        assert!(code.contains(&format!(".global left_{name}\n")), "{name}");
        let means = forms::export(&experiment, &source, Form::MeansOfAssembly("left", name)).expect("recorded");
        assert!(means.starts_with(&format!("means 1\nfunction left_{name}\n")), "{means}");
    }
    // Types of the C file: flags of one byte before and behind the words, the turn before the angle.
    let means = forms::export(&experiment, &source, Form::Means("left", "tick")).expect("recorded");
    for line in [
        "function left_tick",
        "in fresh truth r0+0",
        "in last count r0+4",
        "in lost truth r1+4",
        "in begin_turn count r1+8",
        "in begin_r number r1+12",
        "in end_r_dot number r1+28",
        "out u number r2+0",
        "out sample_lost truth r0 bit 3",
    ] {
        assert!(means.contains(&format!("\n{line}\n")), "{line}: {means}");
    }
    for form in [Form::MeansOfAssembly("left", "fly"), Form::Means("left", "law")] {
        let unknown = forms::export(&experiment, &source, form);
        assert!(matches!(unknown, Err(Error::Function { .. })));
    }
}

#[test]
fn numbers_get_the_names_of_the_layout() {
    let source = Source { file: "it.toml", text: "", sets: &[] };
    let experiment = parse(&source, "it").expect("the default scenario");
    let numbers = &experiment.download.as_ref().expect("a design in f32").numbers;
    let text = forms::export(&experiment, &source, Form::Archive(PREFIX)).expect("exported");
    let row = |numbers: &[f32]| {
        let row: Vec<String> = numbers.iter().map(|number| format!("{number:?}f")).collect();
        format!("{{{}}}", row.join(", "))
    };
    // n = 4, r = 2 in two channels: d_hat, drift, rate, per_period, memory, gamma, c ..
    for (name, value) in [
        ("d_hat", row(&numbers[..4])),
        ("a_row", row(&numbers[4..8])),
        ("rate", format!("{:?}f", numbers[8])),
        ("gamma", format!("{{{}, {}}}", row(&numbers[11..13]), row(&numbers[13..15]))),
        ("c", row(&numbers[15..19])),
        ("input_gain", format!("{:?}f", numbers[45])),
        ("mu2_n", format!("{:?}f", numbers[46])),
    ] {
        assert!(text.contains(&format!("    {value}, /* {name} */\n")), "{name} {value}: {text}");
    }
}

#[test]
fn every_name_in_the_c_file_begins_with_the_prefix() {
    let text = exported("", &[], Form::Standalone("left")).expect("exported");
    assert!(text.contains("left_tick(") && text.contains("#define LEFT_N 4"));
    assert!(!text.contains("edo_smc") && !text.contains("EDO_SMC") && !text.contains('@'), "{text}");
}

/// Returns the names of the variables of a description whose elements are closed in order.
fn variables(description: &str) -> Vec<String> {
    let mut open = Vec::new();
    let mut names = Vec::new();
    for tag in description.split('<').skip(2) {
        let (tag, _) = tag.split_once('>').expect("an end of the element");
        let name = |tag: &str| tag.split([' ', '/']).next().unwrap_or_default().to_owned();
        match tag.strip_prefix('/') {
            Some(closed) => assert_eq!(open.pop().as_deref(), Some(closed), "{description}"),
            None if tag.ends_with('/') => {}
            None => open.push(name(tag)),
        }
        if let Some(variable) = tag.strip_prefix("ScalarVariable name=\"") {
            names.push(variable.split('"').next().unwrap_or_default().to_owned());
        }
    }
    assert!(open.is_empty(), "{open:?} stay open in {description}");
    names
}

#[test]
fn the_description_of_an_fmu_lists_each_variable_once_and_has_the_guid_of_its_source() {
    let motor = scenario::MOTOR.replace("\ntitle", "\n# title");
    let chain = "plant = { kind = 'chain', order = 2, a = [-2, -1], b = 2 }\ncontroller = { c = [5, 1] }\n";
    for (text, named) in [(motor.as_str(), "target_dot"), (chain, "x[2]")] {
        let text = format!("title = 'a & <b> \"c\" $guid$ @'\n{text}");
        let source = Source { file: "it.toml", text: &text, sets: &[] };
        let experiment = parse(&source, "it").expect("a good scenario");
        let fmu = forms::fmu(&experiment, &source, "left").expect("an FMU");
        let plant = forms::plant_fmu(&experiment, "left");
        let names = variables(fmu.description());
        let mut once = names.clone();
        once.sort();
        once.dedup();
        assert_eq!(once.len(), names.len(), "{names:?}");
        for name in ["u", "sigma_star", "health", "applied", "reset", named] {
            assert!(names.iter().any(|given| given == name), "no {name} in {names:?}");
        }
        let main = &fmu.sources()[0];
        let guid = fmu.description().split("guid=\"").nth(1).and_then(|rest| rest.split('"').next()).expect("a GUID");
        assert!(main.0 == "left.c" && main.1.contains(&format!("#define FMU_GUID \"{guid}\"")), "{}", main.1);
        assert!(main.1.contains("a & <b> \"c\" $guid$ @") && !main.1.replace("$guid$ @", "").contains(['$', '@']));
        assert!(fmu.bytes(None).starts_with(b"PK\x03\x04") && fmu.bytes(None).len() < 400_000);
        match plant {
            Ok(plant) => assert!(variables(plant.description()).iter().any(|name| name.starts_with("der("))),
            Err(why) => assert!(named == "x[2]" && why == Error::FmuPlant("another plant"), "{why}"),
        }
    }
}
