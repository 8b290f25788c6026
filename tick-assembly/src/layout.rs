//! Memory layout of the words of a drive, as in the C types of the exported header.

use tick_record::drive::{DriveFunctions, JET};
use tick_record::{Port, Role, ValueKind};

/// Memory layout of a drive's state, inputs and outputs: its C types, in this order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DriveLayout {
    /// Numbers of the state in order, by name; the output current is first.
    pub numbers: Vec<String>,
    /// Ends of the groups that are stored one by one, the last one first.
    pub(crate) groups: Vec<usize>,
    /// Counts of the state after the numbers, by name.
    pub counts: Vec<String>,
    /// Numbers that an ordinary tick sets to 0.
    pub cleared: Vec<String>,
    /// Numbers that an ordinary tick leaves unchanged; then the flags `fresh` and `started`, one byte each.
    pub rare: Vec<String>,
    shafts: Vec<String>,
    /// The numbers of both targets in memory order, with the words between them.
    pub(crate) targets: Vec<Option<String>>,
    /// Number of words of the first target.
    pub(crate) first_target: usize,
    between: Vec<Port>,
}

/// Core registers that point to the state, the sample, the values between parts, and the output.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pointers {
    pub(crate) state: Option<&'static str>,
    pub(crate) sample: Option<&'static str>,
    pub(crate) between: Option<&'static str>,
    pub(crate) output: Option<&'static str>,
}

impl Pointers {
    /// Returns the pointers of a drive function by its name.
    pub(crate) fn of(function: &str) -> Option<Self> {
        let [r0, r1, r2, r3] = ["r0", "r1", "r2", "r3"].map(Some);
        let (state, sample, between, output) = match function {
            "begin" | "observe" => (r0, r1, r2, None),
            "law" => (r0, r1, r2, r3),
            "tick" | "give_up" => (r0, r1, None, r2),
            "tick_u" | "start" => (r0, r1, None, None),
            "refuse" | "estimates" => (r0, None, None, r1),
            "not_started" => (None, None, None, r0),
            "report_applied" | "reset" | "pass" | "follow" | "carry" => (r0, None, None, None),
            _ => return None,
        };
        Some(Self { state, sample, between, output })
    }
}

impl DriveLayout {
    /// Returns the layout for the functions of a drive.
    pub fn of(functions: &DriveFunctions) -> Self {
        let names = |kind: ValueKind| {
            functions.state.iter().filter(move |word| word.kind == kind).map(|word| word.name.clone())
        };
        let out = if functions.state.iter().any(|word| word.name == "queued") { "queued" } else { "held" };
        let shafts: Vec<String> =
            functions.state.iter().filter_map(|word| word.name.strip_prefix("last")).map(String::from).collect();
        let is_rare = |name: &String| shafts.iter().any(|shaft| *name == format!("off{shaft}"));
        let (rare, numbers): (Vec<String>, Vec<String>) = names(ValueKind::Number).partition(is_rare);
        let (cleared, mut numbers): (Vec<String>, Vec<String>) =
            numbers.into_iter().partition(|name| name.starts_with("missed"));
        // With one encoder all words fit into registers until the end, and the word that is needed last is loaded last.
        // With two, the words of the law are first, and each encoder has its group; shared words are in the last group.
        let shaft = |name: &str| shafts.iter().position(|shaft| name.ends_with(shaft.as_str()));
        let kept = |name: &str| ["offset", "held", "queued"].contains(&name);
        let key = |name: &str| match (shafts.len(), name) {
            (_, name) if name == out => 0,
            (1, "offset") => 2,
            (1, _) => 1,
            (_, name) if kept(name) => 0,
            (_, name) => shaft(name).map_or(shafts.len(), |at| 1 + at),
        };
        numbers.sort_by_key(|name| (key(name), name != out));
        let mut groups: Vec<usize> =
            (1..numbers.len()).filter(|at| key(&numbers[*at]) != key(&numbers[at - 1])).collect();
        groups.push(numbers.len());
        if shafts.len() == 1 {
            groups = vec![numbers.len()];
        }
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
        Self {
            numbers,
            counts: names(ValueKind::Count).collect(),
            cleared,
            rare,
            groups,
            shafts,
            targets,
            first_target,
            between: functions.between.clone(),
        }
    }

    /// Returns the first number of the words that are stored last.
    pub(crate) fn stored_last(&self) -> usize {
        self.groups[0]
    }

    /// Returns the values between parts with their offsets.
    pub(crate) fn handed(&self) -> impl Iterator<Item = (&Port, usize)> {
        self.between.iter().enumerate().map(|(at, port)| (port, 4 * at))
    }

    /// Returns the register or memory location of a port for `cycle-bound --means`, such as `r0+8`. The function is a
    /// part, or `tick` or `tick_u`. `results` are the results of its trace.
    pub fn means(&self, function: &str, port: &Port, results: &[Port]) -> Option<String> {
        let pointers = Pointers::of(function)?;
        match port.role {
            Role::Output if function == "tick_u" => (port.name == "u").then(|| "s0".into()),
            Role::Flag(_) if function == "tick_u" => None,
            Role::Flag(bit) => Some(format!("r0 bit {bit}")),
            Role::Answer => Some("r0".into()),
            Role::Argument if pointers.sample.is_none() => Some("s0".into()),
            _ => self.place(port, &pointers, results).map(|(register, at)| format!("{register}+{at}")),
        }
    }

    fn has_turns(&self) -> bool {
        self.targets.contains(&None)
    }

    /// Returns the offset of the numbers of the first target.
    pub(crate) fn targets_at(&self) -> i32 {
        let counts = 4 * self.shafts.len() as i32;
        counts + 4 + if self.has_turns() { 4 } else { 0 }
    }

    /// Returns the size of the values between parts, with the stack aligned.
    pub(crate) fn between_bytes(&self) -> usize {
        (4 * self.between.len()).next_multiple_of(8).max(8)
    }

    /// Returns the state words before the flags.
    pub fn words(&self) -> impl Iterator<Item = &String> {
        self.numbers.iter().chain(&self.counts).chain(&self.cleared).chain(&self.rare)
    }

    fn words_bytes(&self) -> i32 {
        4 * self.words().count() as i32
    }

    /// Returns the register and offset of a word. Results of `estimates` have their own order.
    pub(crate) fn place(&self, port: &Port, pointers: &Pointers, results: &[Port]) -> Option<(&'static str, i32)> {
        let bytes = |at: usize| 4 * at as i32;
        let name = port.name.as_str();
        match port.role {
            Role::State => {
                let at = match name {
                    "fresh" => self.words_bytes(),
                    "started" => self.words_bytes() + 1,
                    _ => bytes(self.words().position(|word| word == name)?),
                };
                Some((pointers.state?, at))
            }
            Role::Between => {
                // Numbers come first, then the bytes.
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
                    None => {
                        self.targets_at() + bytes(self.targets.iter().position(|one| one.as_deref() == Some(name))?)
                    }
                };
                Some((sample, at))
            }
            _ => None,
        }
    }
}
