//! Memory locations of the numbers of a value with a compiler-defined layout.

use std::mem::MaybeUninit;
use std::slice;

use controller_core::{ControlLaw, Words as _};
use tick_record::{Port, Record, Role, ValueKind};

/// Returns the words of a value in memory.
fn words<T: Clone>(value: &T) -> Vec<u32> {
    let mut place = Box::new(MaybeUninit::<T>::zeroed());
    place.write(value.clone());
    // SAFETY: the slice has the size of the type, which consists of numbers and flags. The padding between its fields
    // was zeroed, and only words with marked bits are used.
    unsafe { slice::from_raw_parts(place.as_ptr().cast::<u32>(), size_of::<T>() / 4).to_vec() }
}

/// Returns the k-th mark to find in memory: a float that no design contains.
fn mark(k: usize) -> f32 {
    f32::from_bits(0x4a5e_0000 + k as u32)
}

/// Names of the numbers that are replaced by marks.
#[derive(Default)]
pub(crate) struct Marked(Vec<String>);

impl Marked {
    /// Returns the mark of another number.
    pub(crate) fn number(&mut self, name: &str) -> f32 {
        self.0.push(name.to_owned());
        mark(self.0.len() - 1)
    }
}

/// Offsets of the words of a law and of its state from their addresses.
pub(crate) struct Places {
    /// Numbers of the law, by name.
    pub(crate) numbers: Vec<(String, usize)>,
    /// Other words of the law, with their values.
    pub(crate) known: Vec<(usize, u32)>,
    pub(crate) law_size: usize,
    /// Words of the state, by name, in the order of its words.
    pub(crate) state: Vec<(Port, usize)>,
    pub(crate) state_size: usize,
}

impl Places {
    /// Returns the offsets for a law with these marks. `parts` are words of the law of which only some bits are used;
    /// `state` describes the words of its state.
    pub(crate) fn of<L: ControlLaw + Clone>(
        law: &L,
        Marked(names): &Marked,
        parts: &[(usize, u32)],
        state: &[Port],
    ) -> Self
    where
        L::State: Clone,
    {
        let found = |words: &[u32], wanted: u32| {
            4 * words.iter().position(|word| *word == wanted).expect("a mark has its place")
        };
        let mut of_law = words(law);
        // The other bits are not part of the law.
        for (at, bits) in parts {
            of_law[at / 4] &= bits;
        }
        let is_mark = |word: u32| (0..names.len()).any(|k| mark(k).to_bits() == word);
        let known = of_law.iter().zip(0..).filter(|(word, _)| !is_mark(**word)).map(|(word, k)| (4 * k, *word));
        let is_flag = |k: usize| state[k].kind == ValueKind::Truth;
        let made = |word: &dyn Fn(usize) -> u32| {
            words(&L::State::from_words(&mut (0..state.len()).map(word)).expect("the words of a state"))
        };
        let of_state = made(&|k| if is_flag(k) { 0 } else { mark(k).to_bits() });
        let place = |k: usize| {
            if is_flag(k) {
                // The only word with a bit when this flag alone is set.
                let alone = made(&|other| u32::from(other == k));
                found(&alone.iter().map(|word| word & 0xff).collect::<Vec<_>>(), 1)
            } else {
                found(&of_state, mark(k).to_bits())
            }
        };
        Self {
            numbers: names.iter().zip(0..).map(|(name, k)| (name.clone(), found(&of_law, mark(k).to_bits()))).collect(),
            known: known.collect(),
            law_size: 4 * of_law.len(),
            state: (0..state.len()).map(|k| (state[k].clone(), place(k))).collect(),
            state_size: 4 * of_state.len(),
        }
    }

    /// Returns the offset of this number in the law.
    pub(crate) fn number(&self, name: &str) -> Option<usize> {
        self.numbers.iter().find(|(number, _)| number == name).map(|(_, at)| *at)
    }

    /// Returns the offset of this word in the state.
    pub(crate) fn word(&self, port: &Port) -> Option<usize> {
        self.state.iter().find(|(word, _)| word == port).map(|(_, at)| *at)
    }
}

/// Returns the state words among the inputs of a trace.
pub(crate) fn state_words(record: &Record) -> Vec<Port> {
    record.inputs.iter().filter(|port| port.role == Role::State).cloned().collect()
}
