//! What is claimed of the monitors around a drive, whatever the law puts out and whatever their thresholds are.
//!
//! Any bits in state, thresholds, u, σ, σ* and disturbances. What a law promises of u and σ is proved of the law; here
//! it is shown that nothing is lost on the way: u is the law's or the fallback, and no cause of an alarm goes untold.

use tick_record::{Kind, Record};

use crate::smt::number;
use crate::statement::{Question, Statement, Step, all, either, finite, not, same, then, within};

/// Counters up to here lose no tick to rounding: 2^24.
const COUNTED: f32 = 16_777_216.0;

/// What the law says, and how a drive with monitors hands it on.
const SAID: [(&str, &str); 5] = [
    ("law_rejected", "input_rejected"),
    ("law_saturated", "saturated"),
    ("law_lost", "sample_lost"),
    ("law_stepped", "position_stepped"),
    ("law_waits", "waits"),
];

const ALARMS: [&str; 4] = ["disturbance_over_bound", "sigma_star_over_bound", "stuck_at_limit", "input_rejected"];

/// What is claimed of a tick, each with its name.
type Claims = Vec<(&'static str, String)>;

/// Everything that is claimed of monitors that stop, and of those that tell.
pub fn statements(stopping: &Record, telling: &Record) -> Vec<Statement> {
    let both = [("stopping", Step::of(stopping)), ("telling", Step::of(telling))];
    let each = |name, of: &dyn Fn(&str, &Step) -> Claims| {
        let questions = both.iter().flat_map(|(part, step)| {
            let ask = |(what, claim): (&str, String)| step.ask(&format!("{part}: {what}"), &claim);
            of(part, step).into_iter().map(ask).collect::<Vec<Question>>()
        });
        Statement::new(name, questions)
    };
    let watched = || disturbances(telling);
    vec![
        each("u is the law's, or the fallback where the drive has stopped, any bits", &|_, step| {
            let of = |source: &str| same(step.after("u"), source);
            vec![("u", format!("(ite {} {} {})", step.after("stopped"), of("fallback"), of("law_u")))]
        }),
        each("a drive that has stopped stays so and says so", &|_, step| {
            let stays = [step.after("stopped"), step.after("stopped_now")].map(String::from);
            vec![
                ("stopped", then("stopped", &all(stays))),
                ("said", format!("(= {} {})", step.after("stopped"), step.after("stopped_now"))),
            ]
        }),
        each("what is over its bound, or no number, is told; what is told is so", &|_, step| {
            let over = either(watched().map(|d| not(&format!("(fp.leq (fp.abs {d}) {d}_bound)"))));
            let star = not("(fp.leq (fp.abs law_sigma_star) sigma_star_bound)");
            let star = all([star, not("law_saturated")]);
            let silent = all(ALARMS[..3].iter().map(|alarm| not(step.after(alarm))));
            vec![
                ("waits", going(&then("law_waits", &silent))),
                ("disturbance", going(&watching(&format!("(= {} {over})", step.after("disturbance_over_bound"))))),
                ("sigma*", going(&watching(&format!("(= {} {star})", step.after("sigma_star_over_bound"))))),
            ]
        }),
        each("too long at a limit is told: every tick there without |sigma| falling counts", &|_, step| {
            let counts = ["law_saturated", "(fp.leq last_sigma (fp.abs law_sigma))", "(fp.geq stuck (_ +zero 8 24))"];
            let one_more = format!("(fp.add RNE stuck {})", number(1.0));
            let counted = then(&all(counts.map(String::from)), &same(step.after("stuck"), &one_more));
            let told = format!("(= {} (fp.gt {} stuck_ticks))", step.after("stuck_at_limit"), step.after("stuck"));
            let beyond = "(fp.geq stuck_ticks (_ +zero 8 24))";
            vec![("counted", going(&watching(&counted))), ("told", going(&watching(&then(beyond, &told))))]
        }),
        each("an alarm stops the drive, if alarms are to; nothing else does", &|part, step| {
            let alarm = either(ALARMS.map(|alarm| step.after(alarm).to_string()));
            // Before the counts have agreed nothing is an alarm.
            let stops = if part == "stopping" { all([alarm, not("law_waits")]) } else { "false".into() };
            vec![("stops", going(&format!("(= {} {stops})", step.after("stopped"))))]
        }),
        each("what the law says is handed on", &|_, step| {
            let claim = |(law, flag): (&str, &str)| format!("(= {} {law})", step.after(flag));
            let numbers = ["sigma", "sigma_star"].map(|name| same(step.after(name), &format!("law_{name}")));
            vec![("flags", going(&all(SAID.map(claim)))), ("numbers", going(&all(numbers)))]
        }),
        each("its words stay finite: the counter within 2^24, |sigma| as the law's", &|_, step| {
            let [low, high] = [0.0, COUNTED];
            let counter = then(&within("stuck", low, high), &within(step.after("stuck"), low, high));
            let sound = all(["last_sigma", "law_sigma"].map(finite));
            vec![("stuck", counter), ("last", then(&sound, &finite(step.after("last_sigma"))))]
        }),
    ]
}

/// Of a drive that goes on.
fn going(claim: &str) -> String {
    then(&not("stopped"), claim)
}

/// Of a tick that is looked at: before the counts have agreed none is.
fn watching(claim: &str) -> String {
    then(&not("law_waits"), claim)
}

/// The disturbances that are watched.
fn disturbances(record: &Record) -> impl Iterator<Item = &str> {
    let numbered = |name: &str| name.strip_prefix('d').is_some_and(|shaft| shaft.parse::<u8>().is_ok());
    let words = record.inputs.iter().filter(|port| port.kind == Kind::Number).map(|port| port.name.as_str());
    words.filter(move |name| numbered(name))
}
