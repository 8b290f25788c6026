//! Claims about the monitors around a drive, for any output of the control law and any thresholds.
//!
//! State, thresholds, u, σ, σ* and disturbances may have any bits. The properties of the law's u and σ are proved for
//! the law. The claims here show that the monitors preserve them: u is the u of the law, the fallback, or a brake
//! within the limits, and every cause of an alarm is reported.

use tick_record::{Record, ValueKind};

use crate::smt::number;
use crate::statement::{Question, Statement, Step, all, either, finite, not, same, then, within};

/// Counters up to 2^24 lose no tick to rounding.
const COUNTED: f32 = 16_777_216.0;

/// Flags of the law, and the names under which a monitored drive passes them on.
const SAID: [(&str, &str); 5] = [
    ("law_rejected", "input_rejected"),
    ("law_saturated", "saturated"),
    ("law_lost", "sample_lost"),
    ("law_stepped", "position_stepped"),
    ("law_waits", "waits"),
];

/// Alarms of the monitors themselves.
const ALARMS: [&str; 5] =
    ["disturbance_over_bound", "sigma_star_over_bound", "stuck_at_limit", "wrong_way", "oscillates"];

/// Alarms that stop a drive in every configuration.
const RUNAWAY: [&str; 2] = ["wrong_way", "oscillates"];

/// Counters from tick to tick; never below 0.
const COUNTS: [&str; 5] = ["stuck", "swings", "against", "over", "braking"];

/// Claims about a tick, each with its name.
type Claims = Vec<(&'static str, String)>;

/// Returns all claims about monitors that brake, monitors that stop, and monitors that only report.
pub fn statements(braking: &Record, stopping: &Record, telling: &Record) -> Vec<Statement> {
    let all_parts = [("braking", Step::of(braking)), ("stopping", Step::of(stopping)), ("telling", Step::of(telling))];
    let each = |name, of: &dyn Fn(&str, &Step) -> Claims| {
        let questions = all_parts.iter().flat_map(|(part, step)| {
            let ask = |(what, claim): (&str, String)| step.ask(&format!("{part}: {what}"), &claim);
            of(part, step).into_iter().map(ask).collect::<Vec<Question>>()
        });
        Statement::new(name, questions)
    };
    let watched = || disturbances(telling);
    vec![
        each(
            "u is the law's, a brake within the limits, or the fallback where the drive has stopped, any bits",
            &|part, step| outputs(telling, part, step),
        ),
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
        each("what is too long over its bound, or no number, is told; what is told is so", &|part, step| {
            over_bounds(telling, part, step)
        }),
        each("too long at a limit is told: every tick there without |sigma| falling counts", &|part, step| {
            let counts = ["law_saturated", "(fp.leq last_sigma (fp.abs law_sigma))", &positive("stuck")];
            let one_more = format!("(fp.add RNE stuck {})", number(1.0));
            let begins = all([not(&is_braking(part)), will_brake(part, step)]);
            let counted = either([begins.clone(), is_braking(part), same(step.after("stuck"), &one_more)]);
            let counted = then(&all(counts.map(String::from)), &counted);
            let told = format!("(= {} (fp.gt {} stuck_ticks))", step.after("stuck_at_limit"), step.after("stuck"));
            let told = either([begins, told]);
            let supposed = all([positive("stuck_ticks"), before()]);
            vec![("counted", going(&watching(&counted))), ("told", going(&watching(&then(&supposed, &told))))]
        }),
        each(
            "the wrong way is told after so many ticks in a row, and a tick of it needs |d| over its bound, or a lost \
             sample, which is half of one",
            &|part, step| {
                let driven = watched().last().unwrap_or_default();
                let over = not(&format!("(fp.leq (fp.abs {driven}) {driven}_bound)"));
                let more = |by: f32| same(step.after("against"), &format!("(fp.add RNE against {})", number(by)));
                let none = format!("(fp.isZero {})", step.after("against"));
                let counted = either([all([over, more(1.0)]), all(["law_lost".into(), more(0.5)]), none]);
                let told = format!("(= {} (fp.gt {} wrong_way_ticks))", step.after("wrong_way"), step.after("against"));
                let supposed = all([positive("wrong_way_ticks"), before()]);
                vec![
                    ("counted", going(&watching(&then(&all([before(), not(&begins(part))]), &counted)))),
                    ("told", going(&watching(&then(&supposed, &told)))),
                ]
            },
        ),
        each(
            "every change of side counts, more than two windows are told; without an alarm no more are left",
            &|part, step| sides(telling, part, step),
        ),
        each("what is counted is looked at again: no count goes on unseen, and none is below 0", &|_, step| {
            let after = |name: &str| step.after(name).to_string();
            vec![("kept", then(&all([before(), positive("stuck_ticks")]), &consistent(&after)))]
        }),
        each(
            "an alarm stops the drive, or makes it brake, if alarms are to; the wrong way, oscillation and counts that \
             are given up stop it; nothing else does",
            &follows,
        ),
        each(
            "a brake ends: each tick within the limits is slower than the one before or counts, and where the speed \
             does not fall at a limit",
            &ends,
        ),
        each("what the law says is handed on", &|_, step| {
            let claim = |(law, flag): (&str, &str)| {
                let same = format!("(= {} {law})", step.after(flag));
                if law == "law_saturated" { either([step.after("brakes").to_string(), same]) } else { same }
            };
            let numbers = ["sigma", "sigma_star"].map(|name| same(step.after(name), &format!("law_{name}")));
            vec![("flags", going(&all(SAID.map(claim)))), ("numbers", going(&all(numbers)))]
        }),
        each("its words stay finite: the counters within 2^24, |sigma| as the law's", &|part, step| {
            let [low, high] = [0.0, COUNTED];
            let counter = |name: &str| {
                let supposed = all([within(name, low, high), within("stuck_ticks", low, high / 2.0)]);
                then(&supposed, &within(step.after(name), low, high))
            };
            let sound = all(["last_sigma", "law_sigma", "v"].map(finite));
            let mut claims = vec![("stuck", counter("stuck")), ("over", counter("over"))];
            claims.push(("last", then(&sound, &finite(step.after("last_sigma")))));
            if part == "braking" {
                claims.push(("braking", counter("braking")));
            }
            claims
        }),
    ]
}

/// Claims when an exceeded bound is reported.
fn over_bounds(telling: &Record, part: &str, step: &Step) -> Claims {
    let over = either(disturbances(telling).map(|d| not(&format!("(fp.leq (fp.abs {d}) {d}_bound)"))));
    let star = all([not("(fp.leq (fp.abs law_sigma_star) sigma_star_bound)"), not("law_saturated")]);
    let silent = all(ALARMS.iter().map(|alarm| not(step.after(alarm))));
    let told = |alarm: &str, is_over: &str| {
        let late = all([is_over.to_string(), late(), not(&is_braking(part))]);
        going(&watching(&then(&before(), &format!("(= {} {late})", step.after(alarm)))))
    };
    vec![
        ("waits", going(&then("law_waits", &silent))),
        ("disturbance", told("disturbance_over_bound", &over)),
        ("sigma*", told("sigma_star_over_bound", &star)),
    ]
}

/// Claims that a brake comes to its end.
fn ends(part: &str, step: &Step) -> Claims {
    let one_more = same(step.after("braking"), &format!("(fp.add RNE braking {})", number(1.0)));
    let slower = all(["(fp.lt (fp.abs v) last_sigma)".into(), same(step.after("last_sigma"), "(fp.abs v)")]);
    let first = "(fp.isZero brake_most)".to_string();
    let counted = then(&not(step.after("saturated")), &either([first, one_more, slower]));
    let within = format!("(fp.leq {} brake_ticks)", step.after("braking"));
    let at_limit = format!("(fp.leq {} stuck_ticks)", step.after("stuck"));
    let supposed =
        all([is_braking(part), step.after("brakes").to_string(), positive("brake_ticks"), positive("stuck_ticks")]);
    let ends = all([counted, within, at_limit]);
    vec![("ends", going(&watching(&then(&all([supposed, before()]), &ends))))]
}

/// Claims the value of u: the u of the law, the fallback, or a brake that opposes the speed and a motor's load within
/// its bound.
fn outputs(telling: &Record, part: &str, step: &Step) -> Claims {
    let of = |source: &str| same(step.after("u"), source);
    let not_braking = then(&not(step.after("brakes")), &of("law_u"));
    let mut claims = vec![("u", format!("(ite {} {} {not_braking})", step.after("stopped_now"), of("fallback")))];
    if part == "braking" {
        let zero = "(_ +zero 8 24)";
        let limits = [format!("(fp.leq u_min {zero})"), format!("(fp.leq {zero} u_max)")];
        let u = step.after("u");
        let inside = [format!("(fp.leq u_min {u})"), format!("(fp.leq {u} u_max)")];
        let limited = |what: &str, [low, high]: [&str; 2]| {
            let below = format!("(ite (fp.gt {what} {high}) {high} {what})");
            format!("(ite (fp.lt {below} {low}) {low} {below})")
        };
        let slows = "(fp.neg (fp.mul RNE brake v))".to_string();
        // A joint's brake does not hold a load.
        let one_shaft = disturbances(telling).count() == 1;
        let load = format!("(ite (fp.gt brake_most {zero}) d1 {zero})");
        let load = format!("(fp.mul RNE per_gain {load})");
        let asked = if one_shaft { format!("(fp.sub RNE {slows} {load})") } else { slows };
        let asked = format!("(ite (fp.leq (fp.abs {asked}) {}) {asked} {zero})", number(1e30));
        let supposed = all(limits.into_iter().chain([step.after("brakes").to_string()]));
        claims.push(("brake", then(&supposed, &all(inside))));
        let opposes = same(u, &limited(&asked, ["u_min", "u_max"]));
        claims.push(("opposes", then(step.after("brakes"), &opposes)));
    } else {
        claims.push(("none", not(step.after("brakes"))));
    }
    claims
}

/// Claims the reaction to an alarm.
fn follows(part: &str, step: &Step) -> Claims {
    let after = |name: &str| step.after(name).to_string();
    let runaway = either(RUNAWAY.iter().map(|alarm| after(alarm)));
    let rejected = all(["law_rejected".into(), late()]);
    let answered = ["disturbance_over_bound", "sigma_star_over_bound", "stuck_at_limit"].map(after);
    let acts = either(answered.into_iter().chain([rejected]));
    let given_up = all(["law_waits", "law_lost"].map(String::from));
    let blind = all(["law_rejected", "law_lost"].map(String::from));
    let stops = |stops: String| {
        let stops = either([all([not("law_waits"), either([stops, runaway.clone()])]), given_up.clone()]);
        // A waiting law has rejected its sample.
        let supposed = all([before(), then("law_waits", "law_rejected")]);
        going(&then(&supposed, &format!("(= {} {stops})", after("stopped"))))
    };
    match part {
        "telling" => {
            let stops = all([not("law_waits"), runaway]);
            vec![("stops", going(&format!("(= {} {stops})", after("stopped"))))]
        }
        "stopping" => vec![("stops", stops(acts))],
        _ => {
            let in_doubt = format!("(fp.gt {} (_ +zero 8 24))", after("against"));
            let begins = all([not("law_waits"), acts.clone(), not(&in_doubt), not(&blind)]);
            let begins = all([format!("(= {} {begins})", will_brake(part, step)), not(step.after("brakes"))]);
            let from_the_law = then(&not(&is_braking(part)), &begins);
            let stops = then(&not(&is_braking(part)), &stops(all([acts, blind])));
            let ends = either([after("brakes"), after("stopped_now")]);
            let ends = then(&all([is_braking(part), before()]), &watching(&ends));
            let both = not(&all([after("brakes"), after("stopped_now")]));
            vec![
                ("begins", going(&then(&before(), &from_the_law))),
                ("stops", stops),
                ("goes on braking or stops", going(&ends)),
                ("not both", both),
            ]
        }
    }
}

/// Term: the drive was braking before this tick.
fn is_braking(part: &str) -> String {
    if part == "braking" { "(fp.gt braking (_ +zero 8 24))".into() } else { "false".into() }
}

/// Term: this is the first tick of a brake, which is not checked.
fn begins(part: &str) -> String {
    if part == "braking" { all([is_braking(part), "(fp.isZero brake_most)".into()]) } else { "false".into() }
}

/// Term: the drive brakes from the next tick on.
fn will_brake(part: &str, step: &Step) -> String {
    if part == "braking" { format!("(fp.gt {} (_ +zero 8 24))", step.after("braking")) } else { "false".into() }
}

/// Term: this tick over a bound, or without a sample, exceeds the patience.
fn late() -> String {
    format!("(fp.gt (fp.add RNE over {}) patience_ticks)", number(1.0))
}

/// Claims the count of sign changes of a disturbance beyond its bound.
fn sides(telling: &Record, part: &str, step: &Step) -> Claims {
    let twice = "(fp.add RNE stuck_ticks stuck_ticks)";
    let sound = all([positive("stuck_ticks"), before()]);
    let changes = either(disturbances(telling).map(|d| {
        let over = not(&format!("(fp.leq (fp.abs {d}) {d}_bound)"));
        all([over, format!("(fp.lt (fp.mul RNE {d} {}) (_ +zero 8 24))", d.replace('d', "side"))])
    }));
    let counted = format!("(ite {changes} (fp.add RNE swings stuck_ticks) swings)");
    let told = format!("(= {} (fp.gt {counted} {twice}))", step.after("oscillates"));
    let told = ("told", going(&watching(&then(&all([sound.clone(), not(&begins(part))]), &told))));
    let rest = format!("(fp.leq {} {twice})", step.after("swings"));
    let kept = either([step.after("oscillates").to_string(), rest]);
    let supposed = all([within("stuck_ticks", 1.0, COUNTED / 8.0), sound.clone(), format!("(fp.leq swings {twice})")]);
    vec![told, ("kept", going(&watching(&then(&supposed, &kept))))]
}

/// Term: a number that is not below 0.
fn positive(term: &str) -> String {
    format!("(fp.geq {term} (_ +zero 8 24))")
}

/// Term: the words before the tick are consistent.
fn before() -> String {
    consistent(&|name| name.into())
}

/// Term: no counter is below 0, and each is 0 if the sum of all is 0.
fn consistent(word: &dyn Fn(&str) -> String) -> String {
    let counts = COUNTS.map(word);
    let none = all(counts.iter().map(|count| format!("(fp.isZero {count})")));
    let calm = then(&format!("(fp.isZero {})", word("counted")), &none);
    all(counts.iter().map(|count| positive(count)).chain([calm]))
}

/// Restricts a claim to a drive that has not stopped.
fn going(claim: &str) -> String {
    then(&not("stopped"), claim)
}

/// Restricts a claim to a checked tick. Ticks before the counts have agreed are not checked.
fn watching(claim: &str) -> String {
    then(&not("law_waits"), claim)
}

/// Returns the monitored disturbances.
fn disturbances(record: &Record) -> impl Iterator<Item = &str> {
    let numbered = |name: &str| name.strip_prefix('d').is_some_and(|shaft| shaft.parse::<u8>().is_ok());
    let words = record.inputs.iter().filter(|port| port.kind == ValueKind::Number).map(|port| port.name.as_str());
    words.filter(move |name| numbered(name))
}
