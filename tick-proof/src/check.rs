//! Check of the translation: the solver computes the results of a trace on random bits.
//!
//! The interpreter of `tick_record` runs every trace of an instance on random inputs. The solver then checks that its
//! formulas have equal results for these inputs, bit by bit; all NaN count as equal. The tests of `tick-record` compare
//! the interpreter with the compiled C and with the tick (a million ticks of every configuration, and of the drives).
//! Together the tests link solver, interpreter, C and tick.

use tick_record::{Record, ValueKind, Word};

use crate::Functions;
use crate::smt::{Script, word};
use crate::statement::{Question, Statement, all, same};

/// Number of inputs per trace.
pub const SAMPLES: usize = 16;

/// Random bits from a linear congruential generator with a mixer (SplitMix64); the inputs are reproducible.
struct Noise(u64);

impl Noise {
    fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ z >> 31) as u32
    }

    /// Returns any bits, a normal operating value, or a special value.
    fn number(&mut self) -> f32 {
        const SPECIAL: [f32; 8] = [0.0, -0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-45, f32::MAX, 1e12];
        match self.bits() % 8 {
            0 => f32::from_bits(self.bits()),
            1 => SPECIAL[self.bits() as usize % SPECIAL.len()],
            _ => (self.bits() as i32 as f32) * (2.0_f32).powi(-31 - (self.bits() % 16) as i32),
        }
    }

    fn word(&mut self, kind: ValueKind) -> Word<f32> {
        match kind {
            ValueKind::Number => Word::Number(self.number()),
            ValueKind::Truth => Word::Truth(!self.bits().is_multiple_of(3)),
            ValueKind::Count => {
                Word::Count(if self.bits().is_multiple_of(4) { self.bits() as i32 } else { self.bits() as i32 >> 20 })
            }
        }
    }
}

/// Returns the statement with one query per trace of an instance.
pub fn statement(functions: &Functions) -> Statement {
    let records: Vec<(&str, &Record)> = match functions {
        Functions::Chain(all) | Functions::Measured(all) => vec![
            ("start", &all.start),
            ("tick", &all.tick),
            ("running", &all.running),
            ("report_applied", &all.report_applied),
            ("reset", &all.reset),
        ],
        Functions::Drive(all) => vec![
            ("start", &all.start),
            ("begin", &all.begin),
            ("observe", &all.observe),
            ("law", &all.law),
            ("give_up", &all.give_up),
            ("refuse", &all.refuse),
            ("pass", &all.pass),
            ("follow", &all.follow),
            ("carry", &all.carry),
            ("report_applied", &all.report_applied),
            ("reset", &all.reset),
        ],
        Functions::Monitors { braking, stopping, telling } => {
            vec![("braking", braking), ("stopping", stopping), ("telling", telling)]
        }
    };
    let questions = records.into_iter().enumerate().map(|(seed, (name, record))| question(name, record, seed as u64));
    Statement::new("(check) the solver computes what the record does, random bits", questions)
}

fn question(name: &str, record: &Record, seed: u64) -> Question {
    let (mut script, mut noise, mut claims) = (Script::default(), Noise(seed), Vec::new());
    for sample in 0..SAMPLES {
        let inputs: Vec<Word<f32>> = record.inputs.iter().map(|port| noise.word(port.kind)).collect();
        let mut given = inputs.iter();
        let results = script.record(&format!("s{sample}_"), record, &mut |_, _| {
            given.next().map_or_else(String::new, |input| word(*input))
        });
        let expected = record.run(&inputs);
        claims.extend(results.iter().zip(expected).map(|((_, term), expected)| same(term, &word(expected))));
    }
    Question::new(name, &script, &all(claims))
}
