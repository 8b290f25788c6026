//! Functions of a drive other than its ordinary tick: the parts of any tick, without optimisation, and the code that
//! calls them in sequence if a tick is not ordinary.

use std::collections::HashMap;
use std::fmt::Write as _;

use tick_record::drive::{DriveFunctions, TOLD};
use tick_record::{Port, Record, Role};

use crate::cold::{self, Places};
use crate::graph::{Graph, Node};
use crate::layout::{DriveLayout, Pointers};

/// Returns every part with its name.
pub(crate) fn all(functions: &DriveFunctions) -> [(&'static str, &Record); 13] {
    [
        ("begin", &functions.begin),
        ("observe", &functions.observe),
        ("law", &functions.law),
        ("give_up", &functions.give_up),
        ("refuse", &functions.refuse),
        ("pass", &functions.pass),
        ("follow", &functions.follow),
        ("carry", &functions.carry),
        ("start", &functions.start),
        ("not_started", &functions.not_started),
        ("report_applied", &functions.report_applied),
        ("estimates", &functions.estimates),
        ("reset", &functions.reset),
    ]
}

/// Writes one part.
pub(crate) fn part(what: &str, record: &Record, layout: &DriveLayout, name: &str) -> Result<String, String> {
    let pointers = Pointers::of(what).ok_or("a part")?;
    let mut graph = Graph::default();
    let values = graph.values(record, &HashMap::new());
    let place = |port: &Port| layout.place(port, &pointers, &record.results);
    let given = |(at, port): (usize, &Port)| {
        let node = graph.nodes.iter().position(|node| *node == Node::Input(at))?;
        (port.role == Role::Argument && pointers.sample.is_none()).then_some((node, 0_u8))
    };
    let places = Places {
        place: &place,
        u_alone: false,
        table: "ip",
        table_at: 0,
        arguments: record.inputs.iter().enumerate().filter_map(given).collect(),
        flag: None,
    };
    cold::function(record, &graph, &values, &places, name)
}

/// Writes the tick from the parts, with the arguments and the return value of `tick`.
pub(crate) fn rest(layout: &DriveLayout, prefix: &str) -> Result<String, String> {
    let fresh = Port { name: "fresh".into(), role: Role::State, kind: tick_record::ValueKind::Truth };
    let pointers = Pointers { state: Some("r0"), ..Pointers::default() };
    let (_, fresh) = layout.place(&fresh, &pointers, &[]).ok_or("a flag `fresh`")?;
    let bytes = layout.between_bytes();
    let told = TOLD.map(|(name, flag)| {
        let at = layout.handed().find(|(port, _)| port.name == name).map(|(_, at)| at);
        (at, flag.bits().trailing_zeros())
    });
    let [(Some(missing), missing_bit), (Some(stepped), stepped_bit)] = told else { return Err("what is told".into()) };
    let mut text = String::new();
    let _ = write!(
        text,
        "\tpush.w {{r4-r6, lr}}
\tsub.w sp, sp, #{bytes}
\tmov r4, r0
\tmov r5, r1
\tmov r6, r2
\tmov r2, sp
\tldrb.w ip, [r0, #{fresh}]
\tcmp.w ip, #0
\tbeq.w .L{prefix}_goes_on
\tbl {prefix}_begin
\tcmp.w r0, #0
\tbne.w .L{prefix}_known
\tmov r0, r6
\tbl {prefix}_not_started
\tb.w .L{prefix}_done
.L{prefix}_goes_on:
\tbl {prefix}_observe
\tcmp.w r0, #0
\tbeq.w .L{prefix}_unknown
.L{prefix}_known:
\tmov r0, r4
\tmov r1, r5
\tmov r2, sp
\tmov r3, r6
\tbl {prefix}_law
\tldrb.w ip, [sp, #{stepped}]
\torr.w r5, r0, ip, lsl #{stepped_bit}
\tldrb.w r6, [sp, #{missing}]
\torr.w r5, r5, r6, lsl #{missing_bit}
\tmov r0, r4
\tbl {prefix}_follow
\tcmp.w r6, #0
\tbeq.w .L{prefix}_told
\tb.w .L{prefix}_carry
.L{prefix}_unknown:
\tmov r0, r4
\tmov r1, r5
\tmov r2, r6
\tbl {prefix}_give_up
\tmov r5, r0
\tmov r0, r4
\tbl {prefix}_follow
.L{prefix}_carry:
\tmov r0, r4
\tbl {prefix}_carry
.L{prefix}_told:
\tmov r0, r5
.L{prefix}_done:
\tadd.w sp, sp, #{bytes}
\tpop.w {{r4-r6, pc}}
"
    );
    Ok(text)
}
