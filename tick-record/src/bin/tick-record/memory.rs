//! Where in memory the numbers of a value lie whose fields the compiler has laid.

use std::mem::MaybeUninit;
use std::slice;

use controller_core::{ControlLaw, Words as _};
use tick_record::{Kind, Port, Record, Role};

/// The words of a value in memory.
fn words<T: Clone>(value: &T) -> Vec<u32> {
    let mut place = Box::new(MaybeUninit::<T>::zeroed());
    place.write(value.clone());
    // SAFETY: as many words as the type has, of numbers and flags. What lies between its fields was made zero, and
    // nothing but what is looked for by its bits is taken from here.
    unsafe { slice::from_raw_parts(place.as_ptr().cast::<u32>(), size_of::<T>() / 4).to_vec() }
}

/// The k-th number of those that are looked for in memory: a float that no design holds.
fn mark(k: usize) -> f32 {
    f32::from_bits(0x4a5e_0000 + k as u32)
}

/// The names of numbers that have marks in their place.
#[derive(Default)]
pub(crate) struct Marked(Vec<String>);

impl Marked {
    /// The mark of one more number.
    pub(crate) fn number(&mut self, name: &str) -> f32 {
        self.0.push(name.to_owned());
        mark(self.0.len() - 1)
    }
}

/// How far behind the address of a law and of its state their words lie.
pub(crate) struct Places {
    /// Numbers of the law, by name.
    pub(crate) numbers: Vec<(String, usize)>,
    /// What else the law has: these words.
    pub(crate) known: Vec<(usize, u32)>,
    pub(crate) law_size: usize,
    /// Words of the state, by name, in the order of its words.
    pub(crate) state: Vec<(Port, usize)>,
    pub(crate) state_size: usize,
}

impl Places {
    /// Those of a law with these marks; `parts` is where in it a word has only some bits, `state` what the words of its
    /// state are.
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
        // What lies behind them is not the law's.
        for (at, bits) in parts {
            of_law[at / 4] &= bits;
        }
        let is_mark = |word: u32| (0..names.len()).any(|k| mark(k).to_bits() == word);
        let known = of_law.iter().zip(0..).filter(|(word, _)| !is_mark(**word)).map(|(word, k)| (4 * k, *word));
        let is_flag = |k: usize| state[k].kind == Kind::Truth;
        let made = |word: &dyn Fn(usize) -> u32| {
            words(&L::State::from_words(&mut (0..state.len()).map(word)).expect("the words of a state"))
        };
        let of_state = made(&|k| if is_flag(k) { 0 } else { mark(k).to_bits() });
        let place = |k: usize| {
            if is_flag(k) {
                // The only word with a bit, when this flag alone is set.
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

    /// Where in the law this number lies.
    pub(crate) fn number(&self, name: &str) -> Option<usize> {
        self.numbers.iter().find(|(number, _)| number == name).map(|(_, at)| *at)
    }

    /// Where in the state this word lies.
    pub(crate) fn word(&self, port: &Port) -> Option<usize> {
        self.state.iter().find(|(word, _)| word == port).map(|(_, at)| *at)
    }
}

/// The words of the state that a record begins with.
pub(crate) fn state_words(record: &Record) -> Vec<Port> {
    record.inputs.iter().filter(|port| port.role == Role::State).cloned().collect()
}
