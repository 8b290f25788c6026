//! Claims about a controller on a measured state, for every sample and every state.
//!
//! # Invariant
//! Every number of the state is finite, and the held u lies within ±1e12 (the limit of `report_applied`). A start
//! establishes the invariant from any state. A sample that does not start the controller leaves the state unchanged.
//! Every tick and every report keep the invariant, so it holds for all time. Many claims do not need it and are made
//! for *any bits* in the state.
//!
//! # The set M of a design
//! M is a bound for each state word (module `design` of the core, "Range"): the largest B for which the product k B of
//! the law does not overflow. C, W and the sum x + A of each channel have such a bound as well. In the driven channel
//! a(x)/b + A is within Λ (1 + most). Here `most` is the larger of two numbers: the plausibility limit over Λ, and the
//! share of the offset.
//!
//! # One of three samples is accepted
//! A sample can be rejected for ever only if the estimates stay corrupted, and two rejected samples clear them. The
//! claim holds for samples in a box. In the box every term of the sample in the law is at most 1/32 of the plausibility
//! limit. The same bound applies to a(x)/b and to the term of σ; b(x) is within half and twice its nominal value. If
//! the first two samples are rejected, the estimates are zero, W is the σ of the second sample, and the demand of the
//! third is below the limit.

use controller_core::MAX_N;
use tick_record::{Functions, Role, ValueKind};

use crate::drive::applied;
use crate::smt::{Script, number};
use crate::statement::{
    Question, Statement, Step, all, bounded, called, either, finite, not, numbers, same, then, within,
};

/// Divisor of the plausibility limit: in the box each term of a sample is at most this share.
const SHARES: f32 = 32.0;

/// Constants of a design, read from its traces.
struct Design<'a> {
    functions: &'a Functions,
    limit: f32,
    u: [f32; 2],
}

/// Returns the largest number whose product with k is finite.
fn largest(k: f32) -> f32 {
    let (mut low, mut high) = (0_u32, f32::MAX.to_bits());
    if (k * f32::MAX).is_finite() {
        return f32::MAX;
    }
    while low + 1 < high {
        let middle = low.midpoint(high);
        if (k * f32::from_bits(middle)).is_finite() { low = middle } else { high = middle }
    }
    f32::from_bits(low)
}

/// Returns all claims about a controller.
pub fn statements(functions: &Functions) -> Vec<Statement> {
    let design = Design::of(functions);
    let [refused, kept] = [design.second_chance(), design.kept_in_m()];
    let one = design.one_of_three();
    design.all_but_m().into_iter().chain([design.led_into_m(), refused, kept]).chain(one).collect()
}

/// Returns the claims about a controller that maps its state. The claims on the sums x + A of M are left out, because
/// these sums are not sums of the sample.
pub fn of_a_map(functions: &Functions) -> Vec<Statement> {
    let design = Design::of(functions);
    let [refused, kept] = [design.second_chance(), design.kept_in_m()];
    design.all_but_m().into_iter().chain([refused, kept]).collect()
}

impl<'a> Design<'a> {
    fn of(functions: &'a Functions) -> Self {
        let of = |name: &str| functions.tick.constant(name).unwrap_or(0.0);
        let limit = functions.report_applied.constant("input_limit").unwrap_or(1e12);
        Self { functions, limit, u: [of("u_min"), of("u_max")] }
    }

    fn all_but_m(&self) -> [Statement; 7] {
        [
            self.limits(),
            self.rejected(),
            self.finite_again(),
            self.output(),
            self.health(),
            self.started(),
            self.applied(),
        ]
    }

    /// Term: every number of the state is finite, and the held u is within ±1e12.
    fn invariant(&self) -> String {
        let finite = numbers(&self.functions.state).filter(|name| *name != "held").map(finite);
        all(finite.chain([bounded("held", self.limit)]))
    }

    fn u_is_good(&self, u: &str) -> String {
        within(u, self.u[0], self.u[1])
    }

    fn limits(&self) -> Statement {
        let step = Step::of(&self.functions.running);
        let claim = self.u_is_good(step.after("u"));
        Statement::new("u within its limits, any bits in sample and state", [step.ask("u", &claim)])
    }

    fn rejected(&self) -> Statement {
        let step = Step::of(&self.functions.running);
        let samples = self.functions.running.inputs.iter().filter(|port| matches!(port.role, Role::Sample(_)));
        let questions = samples.map(|port| {
            let claim = then(&not(&finite(&port.name)), step.after("input_rejected"));
            step.ask(&port.name, &claim)
        });
        Statement::new("a sample that is not finite is rejected, any bits in the state", questions)
    }

    fn finite_again(&self) -> Statement {
        let mut step = Step::of(&self.functions.tick);
        step.script.suppose(&self.invariant());
        let mut names: Vec<&str> = numbers(&self.functions.state).collect();
        // The slowest query is last, so that a fault shows sooner.
        names.sort_by_key(|name| name.starts_with('p'));
        let questions = names.into_iter().map(|name| {
            let after = step.after(name);
            let claim = if name == "held" { bounded(after, self.limit) } else { finite(after) };
            step.ask(name, &claim)
        });
        Statement::new("every word of the state finite again, held within 1e12", questions)
    }

    fn output(&self) -> Statement {
        let mut step = Step::of(&self.functions.tick);
        step.script.suppose(&self.invariant());
        let questions = ["sigma", "sigma_star"].map(|name| step.ask(name, &finite(step.after(name))));
        let waiting = Step::of(&self.functions.not_started);
        let before =
            ["sigma", "sigma_star"].map(|name| waiting.ask(&format!("before: {name}"), &finite(waiting.after(name))));
        Statement::new("sigma and sigma* finite", questions.into_iter().chain(before))
    }

    fn health(&self) -> Statement {
        let step = Step::of(&self.functions.running);
        let [rejected, saturated, over] =
            ["input_rejected", "saturated", "sigma_star_over_bound"].map(|name| step.after(name));
        let u = step.after("u");
        let at_limit = either(self.u.map(|limit| format!("(fp.eq {u} {})", number(limit))));
        let alone = then(rejected, &not(&either([saturated.into(), over.into()])));
        let questions = [
            step.ask("rejected says nothing else", &alone),
            step.ask("saturated: u is at a limit", &then(saturated, &at_limit)),
        ];
        Statement::new("health is one of its values and true of u, any bits", questions)
    }

    fn started(&self) -> Statement {
        let mut questions = Vec::new();
        let step = Step::of(&self.functions.start);
        let answer = step.after("answer");
        for word in &self.functions.state {
            let after = step.after(&word.name);
            let claim = match word.kind {
                ValueKind::Number => {
                    let good = if word.name == "held" { bounded(after, self.limit) } else { finite(after) };
                    format!("(ite {answer} {good} (= {after} {}))", word.name)
                }
                _ => then(&not(answer), &format!("(= {after} {})", word.name)),
            };
            questions.push(step.ask(&word.name, &claim));
        }
        let forgotten = Step::of(&self.functions.reset);
        questions.push(forgotten.ask("a reset is no start", &not(forgotten.after("started"))));
        Statement::new("a start leaves finite words, or all as it was", questions)
    }

    fn applied(&self) -> Statement {
        applied(&self.functions.report_applied, &self.functions.state, self.limit)
    }

    /// Returns the conditions of M for each word after a tick that accepted its sample, as pairs of name and claim.
    fn m(&self, step: &Step) -> Vec<(String, String)> {
        let tick = &self.functions.tick;
        let of = |name: &str| tick.constant(name).unwrap_or(0.0);
        let product = |k: &str, word: &str| finite(&format!("(fp.mul RNE {} {word})", number(of(k))));
        let n = self.order();
        let mut words = Vec::new();
        for name in numbers(&self.functions.state) {
            let (letter, channel) = name.split_at(1);
            let Ok(channel) = channel.parse::<usize>() else { continue };
            let after = step.after(name);
            match letter {
                "b" | "c" => words.push((name.into(), product(&format!("k{channel}_{letter}"), after))),
                "a" if channel < n => {
                    let next = channel + 1;
                    let sum = format!("(fp.add RNE x{next} {after})");
                    words.push((format!("x{next} + {name}"), product(&format!("kx_{next}"), &sum)));
                }
                _ => {}
            }
        }
        words
    }

    fn led_into_m(&self) -> Statement {
        let mut step = Step::of(&self.functions.tick);
        let taken = not(step.after("input_rejected"));
        step.script.suppose(&taken);
        let mut questions: Vec<Question> = self.m(&step).iter().map(|(name, claim)| step.ask(name, claim)).collect();
        questions.extend(self.offset_in_m(&step));
        questions.extend(self.drift_in_m(&step));
        Statement::new("a sample that is taken leads into M, from any bits in the state", questions)
    }

    /// Splits the claim on W into four queries: each takes a second, all at once take a minute.
    fn offset_in_m(&self, step: &Step) -> [Question; 4] {
        let of = |name: &str| number(self.functions.tick.constant(name).unwrap_or(0.0));
        let bound = largest(self.functions.tick.constant("kw").unwrap_or(0.0));
        let faded = |w: &str| format!("(fp.sub RNE {w} (fp.mul RNE {} {w}))", of("decay"));
        let asked = |w: &str| finite(&format!("(fp.mul RNE {} {w})", of("kw")));
        let mut any = Script::default();
        let w = any.any("W", ValueKind::Number);
        [
            step.ask("W fades", &format!("(= {} {})", step.after("offset"), faded("offset"))),
            step.ask("kw W before", &asked("offset")),
            Question::new("kw W is one iff |W| <= B", &any, &format!("(= {} {})", asked(&w), bounded(&w, bound))),
            Question::new("fading stays below B", &any, &then(&bounded(&w, bound), &bounded(&faded(&w), bound))),
        ]
    }

    /// Bounds a(x)/b + A of the driven channel by the demand of the law: demanded u = v unit - (a/b + A).
    fn drift_in_m(&self, step: &Step) -> Vec<Question> {
        let tick = &self.functions.tick;
        let of = |name: &str| tick.constant(name).unwrap_or(0.0);
        let n = self.order();
        let driven = format!("a{n}");
        let driven = numbers(&self.functions.state).find(|name| *name == driven);
        let named = |name: &str| called(tick, name);
        let (Some(driven), Some(drift), Some(sum), Some(v), Some(asked)) =
            (driven, named("drift"), named("input_drift"), named("v"), named("asked"))
        else {
            return Vec::new();
        };
        let lambda = f32::MAX * of("unit");
        let offset = largest(of("kw"));
        let most = of("plausible").max((of("ko") * offset).abs());
        let product = |name: &str, word: &str| format!("(fp.mul RNE {} {word})", number(of(name)));
        let of_offset = format!("(fp.abs {})", product("ko", "offset"));
        let plausible = either([bounded(&asked, of("plausible")), format!("(fp.lt (fp.abs {asked}) {of_offset})")]);
        let mut any = Script::default();
        let [a, b, w] = ["a", "b", "W"].map(|name| any.any(name, ValueKind::Number));
        let difference = format!("(fp.sub RNE {a} {b})");
        let (far, total) = (all([bounded(&a, lambda), bounded(&difference, most)]), (lambda + most) * 1.001);
        vec![
            step.ask(
                "a(x)/b + A is in the demand",
                &same(&format!("(fp.add RNE {drift} {})", step.after(driven)), &sum),
            ),
            step.ask("v is a number", &finite(&v)),
            step.ask("the demand is plausible", &plausible),
            step.ask(
                "it is v unit less a(x)/b + A",
                &same(&asked, &format!("(fp.sub RNE {} {sum})", product("unit", &v))),
            ),
            Question::new("v unit within Lambda", &any, &then(&finite(&a), &bounded(&product("unit", &a), lambda))),
            Question::new(
                "ko W within its most",
                &any,
                &then(&bounded(&w, offset), &bounded(&product("ko", &w), most)),
            ),
            Question::new("so a(x)/b + A is bounded", &any, &then(&far, &bounded(&b, total))),
        ]
    }

    /// Returns the state word in which a rejected sample leaves its σ.
    fn aside(&self) -> Option<String> {
        numbers(&self.functions.state)
            .find(|name| name.strip_prefix('p').is_some_and(|channel| channel.parse::<u8>().is_ok()))
            .map(String::from)
    }

    fn second_chance(&self) -> Statement {
        let mut questions = Vec::new();
        if let Some(aside) = self.aside() {
            let mut step = Step::of(&self.functions.tick);
            let rejected = step.after("input_rejected").to_string();
            step.script.suppose(&rejected);
            let (sum, resuming) = (step.after(&aside).to_string(), step.after("resuming").to_string());
            let far = format!("(fp.eq {sum} {})", number(1e38));
            questions
                .push(step.ask("the first leaves its sum", &all([resuming, either([bounded(&sum, self.limit), far])])));
            // The second sample is of the same plant.
            let of = |name: &str| self.functions.tick.constant(name).unwrap_or(0.0);
            let bound = largest(of("kw")).min(self.limit);
            step.script.suppose(&all(["resuming".into(), bounded(&aside, bound), bounded(&sum, bound)]));
            let share = number((of("us") + of("kw")) * of("unit"));
            let apart = format!("(fp.mul RNE {share} (fp.sub RNE {sum} {aside}))");
            step.script.suppose(&bounded(&apart, of("plausible")));
            let zero = |name: &str| format!("(fp.isZero {})", step.after(name));
            let estimates = numbers(&self.functions.state).filter(|name| is_estimate(name)).map(zero);
            let offset = bounded(step.after("offset"), bound);
            questions.push(step.ask("after the second: zeros and its sum", &all(estimates.chain([offset]))));
        }
        Statement::new("of two good samples, both refused, the second starts anew: into M, from any bits", questions)
    }

    /// Returns the box of samples in which one of three is accepted: bounds of the entries, of a(x)/b and of σ.
    fn of_no_doubt(&self) -> ([f32; MAX_N], f32, f32) {
        let of = |name: &str| self.functions.tick.constant(name).unwrap_or(0.0).abs();
        let share = of("plausible") / SHARES;
        let sigma = [share / (of("kw") * of("unit")), share / (2.0 * of("us") * of("unit")), self.limit];
        let sigma = sigma.into_iter().fold(f32::MAX, f32::min);
        let entry = |j: usize| {
            let in_sigma = if j + 1 == self.order() { 1.0 } else { of(&format!("c_{}", j + 1)) };
            let in_law = share / (of(&format!("kx_{}", j + 1)) * of("unit"));
            in_law.min(sigma / (2.0 * MAX_N as f32 * in_sigma)).min(self.limit)
        };
        (core::array::from_fn(entry), share, sigma)
    }

    fn order(&self) -> usize {
        self.functions.tick.inputs.iter().filter(|port| matches!(port.role, Role::Sample(_))).count()
    }

    /// Returns `None` for a controller behind a sample gate, because the gate has its own check.
    fn one_of_three(&self) -> Option<Statement> {
        let tick = &self.functions.tick;
        let gated = self.functions.state.iter().any(|word| word.name.ends_with("_seen"));
        let aside = self.aside().filter(|_| !gated)?;
        let (x, drift, sigma) = self.of_no_doubt();
        let mut step = Step::of(tick);
        step.script.suppose(&all((0..self.order()).map(|j| bounded(&format!("x{}", j + 1), x[j]))));
        step.script.suppose(&bounded(&called(tick, "drift")?, drift));
        if let Some(gain) = called(tick, "gain") {
            step.script.suppose(&within(&gain, 0.5, 2.0));
        }
        let rejected = step.after("input_rejected").to_string();
        let [offset, sum, resuming] = ["offset", &aside, "resuming"].map(|name| step.after(name).to_string());
        let estimates = || numbers(&self.functions.state).filter(|name| is_estimate(name));
        let mut refused = step.clone();
        refused.script.suppose(&rejected);
        let first = refused.ask("the first: its sigma is kept", &all([resuming.clone(), bounded(&sum, sigma)]));
        refused.script.suppose(&all(["resuming".into(), bounded(&aside, sigma)]));
        let zero = estimates().map(|name| format!("(fp.isZero {})", step.after(name)));
        let anew = all(zero.chain([resuming, bounded(&offset, sigma)]));
        let second = refused.ask("the second: starts anew", &anew);
        step.script.suppose(&all(estimates().map(|name| format!("(fp.isZero {name})"))));
        step.script.suppose(&all(["resuming".into(), bounded("offset", sigma)]));
        let third = step.ask("the third is taken", &not(&rejected));
        Some(Statement::new("of three samples of the box in a row one is taken, from any bits", [first, second, third]))
    }

    fn kept_in_m(&self) -> Statement {
        let mut step = Step::of(&self.functions.tick);
        let rejected = step.after("input_rejected").to_string();
        step.script.suppose(&rejected);
        let bound = largest(self.functions.tick.constant("kw").unwrap_or(0.0)).min(self.limit);
        step.script.suppose(&bounded("offset", bound));
        let same = |name: &str| {
            let after = step.after(name);
            either([format!("(= {after} {name})"), format!("(fp.isZero {after})")])
        };
        let estimates = all(numbers(&self.functions.state).filter(|name| is_estimate(name)).map(same));
        let sound = bounded(step.after("offset"), bound);
        let questions = [
            step.ask("estimates stay, or are zero", &estimates),
            // A sample with an implausible sum does not restart the controller.
            step.ask(
                "W stays",
                &either([sound, not(&bounded(step.after(&self.aside().unwrap_or_else(|| "offset".into())), bound))]),
            ),
        ];
        Statement::new("in M, a sample that is refused keeps the estimates there", questions)
    }
}

/// Returns whether the word is A, B or C of a channel.
fn is_estimate(name: &str) -> bool {
    name.strip_prefix(['a', 'b', 'c']).is_some_and(|channel| channel.parse::<u8>().is_ok())
}

#[cfg(test)]
mod tests {
    use tick_record::{ValueKind, Word};

    use super::*;
    use crate::instances::{ALL, sampled};

    /// The box must contain normal operation of a plant.
    #[test]
    fn the_box_has_room() {
        let crate::Functions::Chain(functions) = (ALL[1].functions)() else { panic!("a chain") };
        let (x, drift, sigma) = Design::of(&functions).of_no_doubt();
        // rad, rad/s, and the motor's angle and speed in chain coordinates; 300 is the limit of u.
        for (bound, at_work) in x.into_iter().zip([0.5, 1.7, 17.0, 500.0]) {
            assert!(bound > at_work, "{x:?}");
        }
        assert!(drift > 15.0 * 300.0 && sigma > 6e3, "{drift} {sigma}");
    }

    /// A claim with a false assumption is always proved, so each assumption must have an example.
    #[test]
    fn what_is_supposed_can_be() {
        let chains = sampled(4).filter_map(|instance| match (instance.functions)() {
            crate::Functions::Chain(functions) => Some((instance.name, functions)),
            _ => None,
        });
        for (name, functions) in chains {
            let tick = functions.tick;
            let answer = |given: &dyn Fn(&str) -> f32, result: &str| {
                let inputs = tick.inputs.iter().map(|port| match port.kind {
                    ValueKind::Truth => Word::Truth(port.name == "resuming" && given("resuming") > 0.0),
                    // The nominal b(x).
                    _ if port.name == "gain" => Word::Number(1.0),
                    _ => Word::Number(given(&port.name)),
                });
                let at = tick.results.iter().position(|port| port.name == result).expect(result);
                tick.run(&inputs.collect::<Vec<_>>())[at]
            };
            assert!(!answer(&|_| 0.0, "input_rejected").truth(), "{name}: rest is taken");
            // Implausible estimates, and two samples with equal sums.
            let spoilt = |word: &str| match word {
                "resuming" => 1.0,
                _ if is_estimate(word) => 1e30,
                _ => 0.0,
            };
            assert!(answer(&spoilt, "input_rejected").truth(), "{name}: the second is refused");
            let estimate = tick.results.iter().find(|port| is_estimate(&port.name)).expect("an estimate");
            assert_eq!(answer(&spoilt, &estimate.name).number(), 0.0, "{name}: and starts anew");
        }
    }
}
