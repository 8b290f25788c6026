//! Where the words of a drive are in memory, as the C types of the exported header have them.

use tick_record::drive::{DriveFunctions, JET};
use tick_record::{Kind, Port, Role};

/// Where the words of a drive's state are, and those of what goes in and out: its types in C, in this order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DriveLayout {
    /// Numbers of the state in order, by name: the current that goes out first, the offset last.
    pub numbers: Vec<String>,
    /// Behind them its counts, by name; then the flags `fresh` and `started`, a byte each.
    pub counts: Vec<String>,
    shafts: Vec<String>,
    /// The numbers of both targets as they lie behind one another, with what lies between them.
    pub(crate) targets: Vec<Option<String>>,
    /// How many of them are of the first.
    pub(crate) first_target: usize,
    between: Vec<Port>,
}

/// Core registers that point at the state, the sample, what is handed on, and the output.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pointers {
    pub(crate) state: Option<&'static str>,
    pub(crate) sample: Option<&'static str>,
    pub(crate) between: Option<&'static str>,
    pub(crate) output: Option<&'static str>,
}

impl DriveLayout {
    /// Of a drive's functions.
    pub fn of(functions: &DriveFunctions) -> Self {
        let names = |kind: Kind| functions.state.iter().filter(move |word| word.kind == kind).map(|word| word.name.clone());
        let out = if functions.state.iter().any(|word| word.name == "queued") { "queued" } else { "held" };
        let mut numbers: Vec<String> = names(Kind::Number).collect();
        numbers.sort_by_key(|name| match name.as_str() {
            name if name == out => 0,
            "offset" => 2,
            _ => 1,
        });
        let has = |name: &str| functions.law.inputs.iter().any(|port| port.name == name);
        let position = has("begin_turn");
        let order = functions.state.iter().filter(|word| word.name.starts_with("last")).count();
        let target = |when: &str| -> Vec<Option<String>> {
            let jet = JET.iter().take(2 * order).map(|name| Some(format!("{when}_{name}")));
            if position { jet.collect() } else { vec![Some(format!("{when}_speed"))] }
        };
        let begin = target("begin");
        let first_target = begin.len();
        let turn = position.then_some(None);
        let targets = begin.into_iter().chain(turn).chain(target("end")).collect();
        let shafts = functions.state.iter().filter_map(|word| word.name.strip_prefix("last")).map(String::from);
        Self {
            numbers,
            counts: names(Kind::Count).collect(),
            shafts: shafts.collect(),
            targets,
            first_target,
            between: functions.between.clone(),
        }
    }

    fn has_turns(&self) -> bool {
        self.targets.contains(&None)
    }

    /// Where the numbers of the first target begin.
    pub(crate) fn targets_at(&self) -> i32 {
        let counts = 4 * self.shafts.len() as i32;
        counts + 4 + if self.has_turns() { 4 } else { 0 }
    }

    /// Bytes of what is handed on, the stack kept aligned.
    pub(crate) fn between_bytes(&self) -> usize {
        (4 * self.between.len()).next_multiple_of(8).max(8)
    }

    /// Bytes of the words of the state in front of the flags.
    pub(crate) fn words_bytes(&self) -> i32 {
        4 * (self.numbers.len() + self.counts.len()) as i32
    }

    /// Where a word is behind what its register points at. Results of `estimates` lie in their own order.
    pub(crate) fn place(
        &self,
        port: &Port,
        pointers: &Pointers,
        results: &[Port],
    ) -> Option<(&'static str, i32)> {
        let bytes = |at: usize| 4 * at as i32;
        let name = port.name.as_str();
        match port.role {
            Role::State => {
                let words = self.numbers.iter().chain(&self.counts);
                let at = match name {
                    "fresh" => self.words_bytes(),
                    "started" => self.words_bytes() + 1,
                    _ => bytes(words.into_iter().position(|word| word == name)?),
                };
                Some((pointers.state?, at))
            }
            Role::Between => {
                // Numbers first, as they are: then the bytes.
                let at = self.between.iter().position(|word| word.name == name)?;
                Some((pointers.between?, bytes(at)))
            }
            Role::Output => {
                let told = ["u", "sigma", "sigma_star"].iter().position(|one| *one == name);
                let own = || results.iter().filter(|port| port.role == Role::Output).position(|one| one.name == name);
                Some((pointers.output?, bytes(told.or_else(own)?)))
            }
            Role::Sample(i) => Some((pointers.sample?, bytes(i))),
            Role::Argument => {
                let sample = pointers.sample?;
                let at = match name.strip_prefix("lost") {
                    Some(shaft) => bytes(self.shafts.len()) + self.shafts.iter().position(|one| one == shaft)? as i32,
                    None if name == "begin_turn" => self.targets_at() - 4,
                    None if name == "end_turn" => self.targets_at() + bytes(self.first_target),
                    None => self.targets_at() + bytes(self.targets.iter().position(|one| one.as_deref() == Some(name))?),
                };
                Some((sample, at))
            }
            _ => None,
        }
    }
}
