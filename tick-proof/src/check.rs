//! Is the translation right? The solver itself computes what the record computes, on random bits.
//!
//! Every record of an instance is run by `tick_record`'s interpreter on inputs of any bits, and the solver is asked
//! whether its formulas, with these inputs put in, have the same results: bit by bit, every NaN being one. That the
//! interpreter gives the bits of the compiled C, and both those of the tick, are the tests of `tick-record` (a million
//! ticks of every shape, and of the drives). So solver, interpreter, C and tick are held together, two and two.

use tick_record::{Kind, Record, Word};

use crate::Functions;
use crate::smt::{Script, word};
use crate::statement::{Question, Statement, all, same};

/// Inputs of each record.
pub const SAMPLES: usize = 16;

/// A linear congruence with a mixer (SplitMix64): the same inputs every time.
struct Noise(u64);

impl Noise {
    fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ z >> 31) as u32
    }

    /// Any bits, a number of a plant at work, or one that is none of them.
    fn number(&mut self) -> f32 {
        const SPECIAL: [f32; 8] = [0.0, -0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-45, f32::MAX, 1e12];
        match self.bits() % 8 {
            0 => f32::from_bits(self.bits()),
            1 => SPECIAL[self.bits() as usize % SPECIAL.len()],
            _ => (self.bits() as i32 as f32) * (2.0_f32).powi(-31 - (self.bits() % 16) as i32),
        }
    }

    fn word(&mut self, kind: Kind) -> Word<f32> {
        match kind {
            Kind::Number => Word::Number(self.number()),
            Kind::Truth => Word::Truth(!self.bits().is_multiple_of(3)),
            Kind::Count => {
                Word::Count(if self.bits().is_multiple_of(4) { self.bits() as i32 } else { self.bits() as i32 >> 20 })
            }
        }
    }
}

/// The questions of all records of an instance.
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
