//! Claims about a drive on encoder counts, for every count, every order of lost samples and every target.
//!
//! The tick of a drive consists of parts (`tick_record::drive`). The claims about u and the output are made for each
//! part, with *any bits* in the state, in the sample and in the values from other parts. They hold for every order of
//! the parts and need no invariant.
//!
//! # The box of a motor
//! The claim that every word stays finite needs an invariant, a box that rounding closes. A number within ±2^k to which
//! at most 2^(k - 25) is added rounds to at most 2^k. Let G be the widest gate, L the gains, U the bound of the held u:
//!
//! ```text
//! D1 >= 2^25 L4 G      D >= 2^25 max(T D1, L3 G)      M = D + b U
//! V >= 2^25 max(g2 M, g1 D1, L2 G)                    P >= 2^25 (g2 V + g1 M + h1 D1)
//! ```
//!
//! As powers of two these numbers bound d', d, v and p. They are finite and far outside the range of any motor. Further
//! bounds: the smoothed innovation is within 2 G, the level within \[0, 1\], and the reach of the gate within two half
//! spans. Lost samples are within 2^24, and the doubt counter is within 4 or the ticks of a start. The held u is within
//! 1e12, the queued u is within the limits of u, and the offset is finite.
//!
//! A joint has no such box. Its couplings are polynomials of the link angle. If the link seems to jump by half a
//! revolution in its first ticks and fifty samples are then lost, the prediction overflows (test
//! `a_joint_may_lose_its_numbers_and_u_stays_good`). The claims for the joint are that no bits in the state cause harm,
//! and that these bits are gone after the permitted number of lost samples.

use tick_record::drive::DriveFunctions;
use tick_record::{Op, Record, Role, ValueKind};

use crate::smt::{Script, number};
use crate::statement::{Question, Statement, Step, all, bounded, either, finite, not, numbers, same, then, within};

/// Returns the parts that can end a tick, with their names.
fn ends(functions: &DriveFunctions) -> [(&'static str, &Record); 4] {
    let DriveFunctions { law, give_up, refuse, not_started, .. } = functions;
    [("law", law), ("give_up", give_up), ("refuse", refuse), ("not_started", not_started)]
}

struct Design<'a> {
    functions: &'a DriveFunctions,
    /// Suffixes of the names that belong to each encoder.
    shafts: Vec<&'a str>,
    u: [f32; 2],
    limit: f32,
}

/// Returns all claims about a drive.
pub fn statements(functions: &DriveFunctions) -> Vec<Statement> {
    let of = |name: &str| functions.law.constant(name).unwrap_or(0.0);
    let shafts = functions.state.iter().filter_map(|word| word.name.strip_prefix("missed")).collect();
    let limit = functions.report_applied.constant("input_limit").unwrap_or(1e12);
    let design = Design { functions, shafts, u: [of("u_min"), of("u_max")], limit };
    let mut statements = vec![
        design.limits(),
        design.output(),
        design.rejected(),
        design.health(),
        design.started(),
        design.applied(),
        design.lost(),
        design.counted(),
        design.given_up(),
    ];
    if functions.state.iter().all(|word| !word.name.starts_with("push")) {
        statements.push(design.finite_again());
    }
    statements
}

impl Design<'_> {
    fn limits(&self) -> Statement {
        let questions = ends(self.functions).map(|(part, record)| {
            let step = Step::of(record);
            let (u, of_design) = (step.after("u"), within(step.after("u"), self.u[0], self.u[1]));
            // The word does not exist before a start.
            let has_limit = record.inputs.iter().any(|port| port.name == "limit");
            let of_the_stage = either(["(fp.isNaN limit)".into(), format!("(fp.leq (fp.abs {u}) (fp.abs limit))")]);
            step.ask(part, &if has_limit { all([of_design, of_the_stage]) } else { of_design })
        });
        Statement::new("u within its limits and that of the stage, any bits in counts, targets and state", questions)
    }

    /// Claims that σ is finite and σ* is not NaN. For targets and offsets beyond 1e30 σ* may be infinite.
    fn output(&self) -> Statement {
        let questions = ends(self.functions).into_iter().flat_map(|(part, record)| {
            let step = Step::of(record);
            let star = step.after("sigma_star");
            let near = either([finite(star), not(&bounded("offset", 1e30))]);
            let mut questions = vec![
                step.ask(&format!("{part}: sigma"), &finite(step.after("sigma"))),
                step.ask(&format!("{part}: sigma* is no NaN"), &not(&format!("(fp.isNaN {star})"))),
            ];
            if part == "law" {
                questions.push(step.ask("law: sigma*, W within 1e30", &near));
            }
            questions
        });
        Statement::new("sigma finite; sigma* no NaN, and finite if W is within 1e30; any bits", questions)
    }

    /// Claims that a non-finite target is rejected, for the targets that the law reads.
    fn rejected(&self) -> Statement {
        let law = &self.functions.law;
        let step = Step::of(law);
        let read = |at: usize| law.values.iter().any(|value| value.op == Op::Input(at));
        let targets = law
            .inputs
            .iter()
            .enumerate()
            .filter(|(at, port)| port.role == Role::Argument && port.kind == ValueKind::Number && read(*at));
        let mut questions: Vec<Question> = targets
            .map(|(_, port)| step.ask(&port.name, &then(&not(&finite(&port.name)), step.after("input_rejected"))))
            .collect();
        let refused = then(step.after("input_rejected"), &same(step.after("offset"), "offset"));
        questions.push(step.ask("the offset stays", &refused));
        let kept = numbers(&self.functions.state).filter(|name| self.is_observer(name));
        questions.push(step.ask("the observers go on", &all(kept.map(|name| same(step.after(name), name)))));
        Statement::new("a target that is not finite is refused, and costs the observers nothing", questions)
    }

    /// Returns whether each count corrects both observers, as in a joint as a whole.
    fn is_whole(&self) -> bool {
        self.functions.state.iter().any(|word| word.name == "burst")
    }

    fn is_observer(&self, name: &str) -> bool {
        if self.is_whole() && ["level", "burst"].contains(&name) {
            return true;
        }
        let words = ["p", "v", "d", "d_dot", "smoothed", "level", "missed", "off"];
        self.shafts.iter().any(|shaft| name.strip_suffix(shaft).is_some_and(|word| words.contains(&word)))
    }

    fn health(&self) -> Statement {
        let questions = ends(self.functions).into_iter().flat_map(|(part, record)| {
            let step = Step::of(record);
            let [rejected, saturated] = ["input_rejected", "saturated"].map(|name| step.after(name));
            let u = step.after("u");
            let of_the_stage = format!("(fp.eq (fp.abs {u}) (fp.abs limit))");
            let has_limit = record.inputs.iter().any(|port| port.name == "limit");
            let at_limit = self.u.map(|limit| format!("(fp.eq {u} {})", number(limit)));
            let at_limit = either(at_limit.into_iter().chain(has_limit.then_some(of_the_stage)));
            let claim = format!("(and (not (and {rejected} {saturated})) {})", then(saturated, &at_limit));
            vec![step.ask(part, &claim)]
        });
        Statement::new("health is one of its values and true of u, any bits", questions)
    }

    fn started(&self) -> Statement {
        let step = Step::of(&self.functions.start);
        let answer = step.after("answer");
        let mut questions: Vec<Question> = numbers(&self.functions.state)
            .map(|name| {
                let after = step.after(name);
                let good = if name == "held" { bounded(after, self.limit) } else { finite(after) };
                step.ask(name, &format!("(ite {answer} {good} (= {after} {name}))"))
            })
            .collect();
        let lost = self.shafts.iter().map(|shaft| not(&format!("lost{shaft}")));
        questions.push(step.ask("all counts are there", &then(answer, &all(lost))));
        let forgotten = Step::of(&self.functions.reset);
        questions.push(forgotten.ask("a reset is no start", &not(forgotten.after("started"))));
        Statement::new("a start leaves finite words, or all as it was", questions)
    }

    fn applied(&self) -> Statement {
        applied(&self.functions.report_applied, &self.functions.state, self.limit)
    }

    /// Claims that two ticks that differ in a lost count only are equal, and that an unused count corrects neither d
    /// nor d'. In a joint as a whole each count corrects both shafts, so the claim covers ticks in which no count is
    /// used.
    fn lost(&self) -> Statement {
        let observe = &self.functions.observe;
        let mut questions = Vec::new();
        for shaft in &self.shafts {
            let count = format!("count{shaft}");
            questions.extend(self.is_not_read(shaft, &count));

            let step = Step::of(observe);
            let is_unused = |shaft: &&str| not(&format!("(fp.isZero {})", step.after(&format!("missed{shaft}"))));
            let of_all = self.is_whole();
            let unused = all(self.shafts.iter().filter(|other| of_all || *other == shaft).map(is_unused));
            let (d, d_dot) = (format!("d{shaft}"), format!("d_dot{shaft}"));
            let mut kept = vec![same(step.after(&format!("last{shaft}")), &format!("last{shaft}"))];
            if step.gives(&d_dot) {
                let period = number(observe.constant("period").unwrap_or(0.0));
                kept.push(same(step.after(&d), &format!("(fp.add RNE {d} (fp.mul RNE {period} {d_dot}))")));
                kept.push(same(step.after(&d_dot), &d_dot));
            } else {
                kept.push(same(step.after(&d), &d));
            }
            questions
                .push(step.ask(&format!("what is not used of {count} is not learned"), &then(&unused, &all(kept))));
        }
        Statement::new("nothing is learned from a lost sample, any bits", questions)
    }

    /// Compares two ticks for both cases of the other shaft, since one count decides the use of the other. The lost
    /// flag is a constant: the solver does not propagate an assumption into all dependent terms.
    fn is_not_read(&self, shaft: &str, count: &str) -> Vec<Question> {
        let observe = &self.functions.observe;
        let ask = |others: bool| {
            let is_lost = |port: &str| {
                port.strip_prefix("lost").map(|of| if of == shaft || others { "true" } else { "false" }.to_string())
            };
            let mut script = Script::default();
            let one = script.record("t_", observe, &mut |script, port| {
                is_lost(&port.name).unwrap_or_else(|| script.any(&port.name, port.kind))
            });
            let other = script.record("o_", observe, &mut |script, port| match is_lost(&port.name) {
                Some(lost) => lost,
                None if port.name == count => script.any("other_count", ValueKind::Count),
                None => port.name.clone(),
            });
            let alike = one.iter().zip(other.iter()).map(|((_, one), (_, other))| same(one, other));
            let case = if others { "" } else { ", the other is there" };
            Question::new(&format!("{count} is not read{case}"), &script, &all(alike))
        };
        let cases = if self.shafts.len() > 1 { &[true, false][..] } else { &[true] };
        cases.iter().copied().map(ask).collect()
    }

    /// Claims that, from any bits in the state, a count is used or the drive gives up before too many are lost.
    fn counted(&self) -> Statement {
        let step = Step::of(&self.functions.observe);
        let most = self.functions.observe.constant("lost_ticks").unwrap_or(0.0);
        let answer = step.after("answer");
        let questions = self.shafts.iter().flat_map(|shaft| {
            let name = format!("missed{shaft}");
            let after = step.after(&name);
            let used = format!("(fp.isZero {after})");
            let one_more = format!("(= {after} (fp.add RNE (fp.abs {name}) {}))", number(1.0));
            let counted = all([one_more, within(after, 1.0, most)]);
            [
                step.ask(
                    &format!("{name}: 0, or one more and not too many"),
                    &then(answer, &either([used.clone(), counted])),
                ),
                step.ask(
                    &format!("{name}: lost is not used"),
                    &then(&format!("lost{shaft}"), &either([not(&used), same(&name, &number(-1.0))])),
                ),
            ]
        });
        Statement::new("a count is used, or counted as missing up to its limit, from any bits", questions)
    }

    fn given_up(&self) -> Statement {
        let mut step = Step::of(&self.functions.give_up);
        for shaft in &self.shafts {
            step.script.suppose(&not(&format!("lost{shaft}")));
        }
        let ticks = self.functions.give_up.constant("start_ticks").unwrap_or(0.0);
        let mut questions =
            vec![step.ask("fresh", step.after("fresh")), step.ask("doubt", &same(step.after("doubt"), &number(ticks)))];
        questions.extend(self.shafts.iter().map(|shaft| {
            let d = format!("d{shaft}");
            step.ask(&d, &format!("(fp.isZero {})", step.after(&d)))
        }));
        // The next tick, and every waiting tick, rewrites all words.
        let mut step = Step::of(&self.functions.begin);
        step.script.suppose("(fp.gt doubt (_ +zero 8 24))");
        step.script.suppose("(fp.isZero reach)");
        for shaft in &self.shafts {
            step.script.suppose(&not(&format!("lost{shaft}")));
            step.script.suppose(&format!("(fp.isZero d{shaft})"));
        }
        questions.extend(numbers(&self.functions.state).map(|name| {
            let after = step.after(name);
            let claim = match name {
                "doubt" => within(after, 0.0, ticks),
                "held" | "queued" => within(after, self.u[0], self.u[1]),
                "limit" | "reported" => same(after, name),
                _ if name.starts_with('v') || name.starts_with("pu") => finite(after),
                _ => format!("(fp.isZero {after})"),
            };
            step.ask(&format!("waiting: {name}"), &claim)
        }));
        Statement::new("giving up, with all counts there, is a start that waits: from any bits", questions)
    }

    /// Returns the bounds of the box, word by word.
    fn motor_box(&self) -> Vec<(String, [f32; 2])> {
        let observe = &self.functions.observe;
        let of = |name: &str| f64::from(observe.constant(name).unwrap_or(0.0)).abs();
        let wide = |at_least: f64| (at_least * 1.01).log2().ceil().exp2();
        let absorbs = |added: f64| wide(added * 33_554_432.0);
        let span = f64::from(self.functions.start.constant("half_span").unwrap_or(0.0)).abs();
        let gate = of("gate") + 2.0 * span;
        let gain = |j: usize| (of(&format!("gain_{j}")) + of(&format!("more_{j}"))) * gate;
        let d_dot = if gain(4) > 0.0 { absorbs(gain(4)) } else { 0.0 };
        let d = absorbs((of("period") * d_dot).max(gain(3)));
        let m = 1.01 * (d + of("b") * f64::from(self.limit));
        let v = absorbs((of("g2") * m).max(of("g1") * d_dot).max(gain(2)));
        let p = absorbs(of("g2") * v + of("g1") * m + of("h1") * d_dot).max(gate);
        let within = |bound: f64| [-bound as f32, bound as f32];
        let start_ticks = self.functions.give_up.constant("start_ticks").unwrap_or(0.0);
        numbers(&self.functions.state)
            .map(|name| {
                let bounds = match name {
                    "p" => within(p),
                    "v" => within(v),
                    "d" => within(d),
                    "d_dot" => within(d_dot),
                    "smoothed" => within(2.0 * gate),
                    "level" => [0.0, 1.0],
                    "reach" => within(2.0 * span),
                    "missed" => [0.0, 16_777_216.0],
                    "off" => within(1.01 * (p + 8.0 * span)),
                    "doubt" => [0.0, start_ticks.max(4.0)],
                    "held" => [-self.limit, self.limit],
                    "queued" => self.u,
                    _ => [-f32::MAX, f32::MAX],
                };
                (name.to_string(), bounds)
            })
            .collect()
    }

    fn finite_again(&self) -> Statement {
        let bounds = self.motor_box();
        let inside = all(bounds.iter().map(|(name, [low, high])| within(name, *low, *high)));
        let DriveFunctions { start, begin, observe, law, give_up, refuse, pass, follow, carry, report_applied, .. } =
            self.functions;
        let parts = [
            ("start", start),
            ("begin", begin),
            ("observe", observe),
            ("law", law),
            ("give_up", give_up),
            ("refuse", refuse),
            ("pass", pass),
            ("follow", follow),
            ("carry", carry),
            ("report_applied", report_applied),
        ];
        let mut questions = Vec::new();
        for (part, record) in parts {
            let mut step = Step::of(record);
            step.script.suppose(&inside);
            let claims = bounds.iter().map(|(name, [low, high])| (name, within(step.after(name), *low, *high)));
            if ["observe", "pass"].contains(&part) {
                questions.extend(claims.map(|(name, claim)| step.ask(&format!("{part}: {name}"), &claim)));
            } else {
                questions.push(step.ask(part, &all(claims.map(|(_, claim)| claim))));
            }
        }
        Statement::new("every word of the state stays in the motor's box, all of it finite", questions)
    }
}

/// Returns the claims about a report, for chains and drives.
pub(crate) fn applied(report: &Record, state: &[tick_record::Port], limit: f32) -> Statement {
    let step = Step::of(report);
    let (answer, held) = (step.after("answer"), step.after("held"));
    let sound = bounded("u", limit);
    // A drive also has the limit of the power stage, as far as reports show it.
    let (of_the_stage, others): (Vec<_>, Vec<_>) =
        state.iter().filter(|word| word.name != "held").partition(|word| ["limit", "reported"].contains(&&*word.name));
    let untouched = others.iter().map(|word| same(step.after(&word.name), &word.name));
    let reported = of_the_stage.iter().map(|word| {
        let after = step.after(&word.name);
        let never = if word.name == "reported" { same(after, &number(1e30)) } else { "false".into() };
        either([same(after, &word.name), all([answer.to_string(), either([same(after, "(fp.abs u)"), never])])])
    });
    let questions = [
        step.ask("a limit stays, or becomes what was reported", &all(reported)),
        step.ask("held stays sound", &then(&bounded("held", limit), &bounded(held, limit))),
        step.ask("true exactly for what it took", &format!("(= {answer} (and started {sound}))")),
        step.ask("held becomes it, or stays", &format!("(= {held} (ite {answer} u held))")),
        step.ask("touches nothing else", &all(untouched)),
    ];
    Statement::new("report_applied is sound, any u and any bits in the state", questions)
}

#[cfg(test)]
mod tests {
    use controller_core::drive::{Encoder, Joint, JointDesign, JointDrive, Position, Sample, Target};
    use controller_core::{ControlLaw as _, Health, Limits, Words as _};

    /// Shows why no claim bounds the numbers of a joint for all time: the link seems to jump by half a revolution from
    /// tick to tick right after the start, and then 50 samples are lost.
    #[test]
    fn a_joint_may_lose_its_numbers_and_u_stays_good() {
        let encoders = [Encoder::absolute(20); 2];
        let design = JointDesign::new(1e-3, Joint::TABLE_I, encoders, Limits::symmetric(30.0), 1.3);
        let law = JointDrive::<f32, Position>::design(&design);
        let target = Target { turn: 0, jet: [0.0; 4] };
        let sample = |count: Option<i32>| Sample { counts: [count; 2], begin: target, end: target };
        let mut state = law.start(&sample(Some(0))).expect("a start");
        law.tick(&mut state, &sample(Some(0)));
        for k in 0..7 {
            law.tick(&mut state, &sample(Some(if k % 2 == 0 { 500_000 } else { 0 })));
        }
        let mut lost = false;
        for _ in 0..400 {
            let output = law.tick(&mut state, &sample(None));
            assert!(output.u.abs() <= 30.0 && output.sigma.is_finite(), "{output:?}");
            // The first six words are the flag and counts.
            lost |= state.words().skip(6).any(|word| !f32::from_bits(word).is_finite());
        }
        assert!(lost, "the state stayed finite: there may be a box after all");
        // The drive runs again with valid counts.
        for _ in 0..60 {
            law.tick(&mut state, &sample(Some(0)));
        }
        let output = law.tick(&mut state, &sample(Some(0)));
        assert!(!output.health.contains(Health::INPUT_REJECTED), "{output:?}");
        assert!(state.words().skip(6).all(|word| f32::from_bits(word).is_finite()));
    }
}
