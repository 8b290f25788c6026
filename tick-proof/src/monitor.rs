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

/// What is said of a tick, what the law itself says last.
const ALARMS: [&str; 6] =
    ["disturbance_over_bound", "sigma_star_over_bound", "stuck_at_limit", "wrong_way", "oscillates", "input_rejected"];

/// What stops a drive whatever is chosen.
const RUNAWAY: [&str; 2] = ["wrong_way", "oscillates"];

/// What is counted from tick to tick; never below 0.
const COUNTS: [&str; 3] = ["stuck", "swings", "against"];

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
            vec![("u", format!("(ite {} {} {})", step.after("stopped_now"), of("fallback"), of("law_u")))]
        }),
        each("a drive that has stopped stays so and says so", &|_, step| {
            let stays = [step.after("stopped"), step.after("stopped_now")].map(String::from);
            vec![
                ("stopped", then("stopped", &all(stays))),
                ("said", {
                    let runaway = either(RUNAWAY.iter().map(|alarm| step.after(alarm).to_string()));
                    let stops = either([step.after("stopped_now").to_string(), runaway]);
                    format!("(= {} {stops})", step.after("stopped"))
                }),
            ]
        }),
        each("what is over its bound, or no number, is told; what is told is so", &|_, step| {
            let over = either(watched().map(|d| not(&format!("(fp.leq (fp.abs {d}) {d}_bound)"))));
            let star = not("(fp.leq (fp.abs law_sigma_star) sigma_star_bound)");
            let star = all([star, not("law_saturated")]);
            let silent = all(ALARMS[..5].iter().map(|alarm| not(step.after(alarm))));
            vec![
                ("waits", going(&then("law_waits", &silent))),
                ("disturbance", going(&watching(&format!("(= {} {over})", step.after("disturbance_over_bound"))))),
                ("sigma*", going(&watching(&format!("(= {} {star})", step.after("sigma_star_over_bound"))))),
            ]
        }),
        each("too long at a limit is told: every tick there without |sigma| falling counts", &|_, step| {
            let counts = ["law_saturated", "(fp.leq last_sigma (fp.abs law_sigma))", &positive("stuck")];
            let one_more = format!("(fp.add RNE stuck {})", number(1.0));
            let counted = then(&all(counts.map(String::from)), &same(step.after("stuck"), &one_more));
            let told = format!("(= {} (fp.gt {} stuck_ticks))", step.after("stuck_at_limit"), step.after("stuck"));
            let supposed = all([positive("stuck_ticks"), before()]);
            vec![("counted", going(&watching(&counted))), ("told", going(&watching(&then(&supposed, &told))))]
        }),
        each(
            "the wrong way is told after so many ticks in a row, and a tick of it needs |d| over its bound",
            &|_, step| {
                let driven = watched().last().unwrap_or_default();
                let over = not(&format!("(fp.leq (fp.abs {driven}) {driven}_bound)"));
                let one_more = same(step.after("against"), &format!("(fp.add RNE against {})", number(1.0)));
                let none = format!("(fp.isZero {})", step.after("against"));
                let counted = either([all([over, one_more]), none]);
                let told = format!("(= {} (fp.gt {} wrong_way_ticks))", step.after("wrong_way"), step.after("against"));
                let supposed = all([positive("wrong_way_ticks"), before()]);
                vec![
                    ("counted", going(&watching(&then(&before(), &counted)))),
                    ("told", going(&watching(&then(&supposed, &told)))),
                ]
            },
        ),
        each(
            "every change of side counts, more than two windows are told; without an alarm no more are left",
            &|_, step| sides(telling, step),
        ),
        each("what is counted is looked at again: no count goes on unseen, and none is below 0", &|_, step| {
            let after = |name: &str| step.after(name).to_string();
            vec![("kept", then(&before(), &consistent(&after)))]
        }),
        each(
            "an alarm stops the drive, if alarms are to, the wrong way and oscillation any; nothing else does",
            &|part, step| {
                let stopping: &[&str] = if part == "stopping" { &ALARMS } else { &RUNAWAY };
                let alarm = either(stopping.iter().map(|alarm| step.after(alarm).to_string()));
                // Before the counts have agreed nothing is an alarm.
                let stops = all([alarm, not("law_waits")]);
                vec![("stops", going(&format!("(= {} {stops})", step.after("stopped"))))]
            },
        ),
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

/// That a disturbance changes its side beyond its bound.
fn sides(telling: &Record, step: &Step) -> Claims {
    let twice = "(fp.add RNE stuck_ticks stuck_ticks)";
    let sound = all([positive("stuck_ticks"), before()]);
    let changes = either(disturbances(telling).map(|d| {
        let over = not(&format!("(fp.leq (fp.abs {d}) {d}_bound)"));
        all([over, format!("(fp.lt (fp.mul RNE {d} {}) (_ +zero 8 24))", d.replace('d', "side"))])
    }));
    let counted = format!("(ite {changes} (fp.add RNE swings stuck_ticks) swings)");
    let told = format!("(= {} (fp.gt {counted} {twice}))", step.after("oscillates"));
    let told = ("told", going(&watching(&then(&sound, &told))));
    let rest = format!("(fp.leq {} {twice})", step.after("swings"));
    let kept = either([step.after("oscillates").to_string(), rest]);
    let supposed = all([within("stuck_ticks", 1.0, COUNTED / 8.0), sound.clone(), format!("(fp.leq swings {twice})")]);
    vec![told, ("kept", going(&watching(&then(&supposed, &kept))))]
}

/// Not below 0, and a number.
fn positive(term: &str) -> String {
    format!("(fp.geq {term} (_ +zero 8 24))")
}

/// That of the words that a tick begins with.
fn before() -> String {
    consistent(&|name| name.into())
}

/// No count is below 0, and where all of them together are 0 each is.
fn consistent(word: &dyn Fn(&str) -> String) -> String {
    let counts = COUNTS.map(word);
    let none = all(counts.iter().map(|count| format!("(fp.isZero {count})")));
    let calm = then(&format!("(fp.isZero {})", word("counted")), &none);
    all(counts.iter().map(|count| positive(count)).chain([calm]))
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
