//! Random ticks on three machines: the Rust tick, the trace, its C.

use controller_core::{ControlLaw, Guessing, Output, Real, Running};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use tick_record::{Functions, Port, Record, Role, ValueKind, Word, c};

/// Test plan of a configuration.
pub(crate) struct Plan<'a> {
    pub(crate) name: &'a str,
    pub(crate) ticks: usize,
    /// Number of ticks that also run through the trace itself, which is slow.
    pub(crate) executed: usize,
    pub(crate) seed: u64,
    pub(crate) double: bool,
}

/// xorshift64*.
pub(crate) struct Rng(u64);

impl Rng {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.bits() >> 33) as usize % n
    }
    /// Returns a number in [-1, 1).
    pub(crate) fn number(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Numbers that are rare in samples.
const EDGES: [f64; 18] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    1e-45,
    -1e-45,
    1.2e-38,
    5e-324,
    3.4e38,
    -3.4e38,
    1.7e308,
    1e12,
    -1.000_001e12,
    1e30,
    -3e29,
    1e9,
    1.0,
];

/// Samples of a plant near rest, with occasional faults of every kind.
pub(crate) struct Samples {
    pub(crate) rng: Rng,
    scale: f64,
    bad_left: usize,
}

impl Samples {
    pub(crate) fn new(seed: u64) -> Self {
        Self { rng: Rng::new(seed), scale: 0.1, bad_left: 0 }
    }

    /// Returns n numbers as bits; an f32 has 32.
    pub(crate) fn next(&mut self, n: usize, double: bool) -> Vec<u64> {
        let rng = &mut self.rng;
        let of = |number: f64| if double { number.to_bits() } else { u64::from((number as f32).to_bits()) };
        if rng.below(100) == 0 {
            self.scale = 10_f64.powf(3.5 * rng.number() - 2.5);
        }
        if rng.below(40) == 0 {
            self.bad_left = 1 + rng.below(6);
        }
        let mut x: Vec<u64> = (0..n).map(|_| of(self.scale * rng.number())).collect();
        if self.bad_left > 0 {
            self.bad_left -= 1;
            let bad = match rng.below(3) {
                0 => rng.bits() & if double { u64::MAX } else { 0xffff_ffff },
                1 => of(EDGES[rng.below(EDGES.len())]),
                _ => of(10_f64.powf(12.5 + 12.5 * rng.number())),
            };
            if rng.below(5) == 0 { x.fill(bad) } else { x[rng.below(n)] = bad }
        }
        x
    }
}

/// Requests to a controller.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Ask {
    Tick,
    ReportApplied,
    Start,
    Reset,
}

impl Ask {
    fn any(rng: &mut Rng) -> Self {
        match rng.below(1000) {
            0 => Self::Reset,
            1..=3 => Self::Start,
            4..=103 => Self::ReportApplied,
            _ => Self::Tick,
        }
    }
}

/// All bits of an answer: outputs, flags or answer, estimates, state; 0 for values that were not requested. Every NaN
/// is one NaN.
pub(crate) type Bits = Vec<u64>;

pub(crate) fn bits<T: Real>(number: T) -> u64 {
    if number.to_f64().is_nan() { u64::MAX } else { plain(number) }
}

/// Returns the bits unchanged, including the bits of a NaN.
fn plain<T: Real>(number: T) -> u64 {
    let [low, high] = number.to_words();
    u64::from(low) | u64::from(high) << 32
}

pub(crate) fn number<T: Real>(bits: u64) -> T {
    T::from_words([bits as u32, (bits >> 32) as u32])
}

/// The trace as a machine with a state.
struct Machine<'a, T> {
    functions: &'a Functions,
    applied: usize,
    state: Vec<Word<T>>,
}

/// The Rust tick under test: a law that takes rows of N numbers.
pub(crate) struct Rust<'a, D: ControlLaw> {
    pub(crate) designed: &'a D,
    pub(crate) guess: D::Guess,
    /// Names of the state words.
    pub(crate) names: Vec<String>,
    pub(crate) running: Option<Running<Guessing<&'a D>>>,
}

/// Returns the names of the state words of a controller.
pub(crate) fn names(n: usize, r: usize, mask: u8) -> Vec<String> {
    let channels: Vec<usize> = (1..=n).filter(|i| mask >> (i - 1) & 1 == 1).collect();
    let of = |stem: &str, end: &str| channels.iter().map(|i| format!("{stem}{i}{end}")).collect::<Vec<_>>();
    let folded = |i| ["a", "b", "c"][..r].iter().map(move |letter| format!("{letter}{i}"));
    let mut names: Vec<String> = ["resuming".to_owned()].into_iter().chain(channels.iter().flat_map(folded)).collect();
    names.extend([of("p", ""), of("x", "_prev"), ["offset", "held", "gain_prev"].map(String::from).to_vec()].concat());
    names
}

/// A law that is compared with a trace.
pub(crate) trait Driven {
    /// Returns the length of a sample, and the rows and columns of the estimates.
    fn lengths(&self) -> [usize; 3];
    /// Returns the entry of a sample that `report_applied` gets.
    fn applied(&self) -> usize {
        0
    }
    /// Returns the names of the state words.
    fn names(&self) -> Vec<String>;
    /// Returns the next sample as bits, with occasional faults of every kind.
    fn next(&mut self, samples: &mut Samples, double: bool) -> Vec<u64> {
        samples.next(self.lengths()[0], double)
    }
    /// Returns outputs and flags, or the answer.
    fn ask(&mut self, ask: Ask, x: &[u64]) -> Bits;
    fn estimates(&self) -> Option<Bits>;
    /// Returns the words as in [`Running::words`].
    fn words(&self) -> Vec<u32>;
}

impl<T, D, const N: usize, const R: usize> Driven for Rust<'_, D>
where
    T: Real,
    D: ControlLaw<Scalar = T, Sample = [T; N], Output = Output<T>, Estimates = [[T; R]; N]>,
{
    fn lengths(&self) -> [usize; 3] {
        [N, N, R]
    }

    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    fn ask(&mut self, ask: Ask, words: &[u64]) -> Bits {
        let x: [T; N] = std::array::from_fn(|j| number(words[j]));
        let new = || Running::guessing(self.designed, self.guess.clone());
        let running = self.running.get_or_insert_with(new);
        match ask {
            Ask::Tick => {
                let output = running.tick(&x);
                let said = [output.u, output.sigma, output.sigma_star].map(bits).into_iter();
                said.chain([u64::from(output.health.bits())]).collect()
            }
            Ask::ReportApplied => vec![u64::from(running.report_applied(x[0]))],
            Ask::Start => {
                // A start in the middle, and the first tick, if the sample is valid.
                if self.designed.start_from(&x, &self.guess).is_none() {
                    return vec![0];
                }
                running.reset();
                self.ask(Ask::Tick, words)
            }
            Ask::Reset => {
                running.reset();
                vec![0]
            }
        }
    }

    fn estimates(&self) -> Option<Bits> {
        let estimates = self.running.as_ref()?.estimates()?;
        Some(estimates.as_flattened().iter().map(|number| bits(*number)).collect())
    }

    fn words(&self) -> Vec<u32> {
        self.running.as_ref().map_or_else(Vec::new, |running| running.words().collect())
    }
}

impl<'a, T: Real<Count = i32>> Machine<'a, T> {
    fn new(functions: &'a Functions, applied: usize) -> Self {
        let zero = |word: &Port| match word.kind {
            ValueKind::Number => Word::Number(T::ZERO),
            ValueKind::Truth => Word::Truth(false),
            ValueKind::Count => Word::Count(0),
        };
        Self { functions, applied, state: functions.state.iter().map(zero).collect() }
    }

    /// Runs a function and returns its results other than the state.
    fn run(&mut self, record: &Record, sample: &[Word<T>]) -> Bits {
        // State words have one order everywhere, but some traces lack some words.
        let state = |port: &Port, from: &mut usize| {
            while self.functions.state[*from].name != port.name {
                *from += 1;
            }
            *from
        };
        let mut inputs = Vec::with_capacity(record.inputs.len());
        let mut at = 0;
        for port in &record.inputs {
            inputs.push(match port.role {
                Role::Sample(j) => sample[j],
                Role::State if port.name == "started" => self.state[self.state.len() - 1],
                Role::State => self.state[state(port, &mut at)],
                _ => sample[self.applied],
            });
        }
        let (mut said, mut flags, mut at) = (Bits::new(), 0, 0);
        let results = record.run(&inputs);
        for (port, word) in record.results.iter().zip(results) {
            match port.role {
                Role::State => {
                    let at = state(port, &mut at);
                    self.state[at] = word;
                }
                Role::Flag(bit) => flags |= u64::from(word.truth()) << bit,
                Role::Answer => flags = u64::from(word.truth()),
                _ => said.push(bits(word.number())),
            }
        }
        said.push(flags);
        said
    }

    fn ask(&mut self, ask: Ask, sample: &[Word<T>]) -> Bits {
        let functions = self.functions;
        match ask {
            Ask::Tick => self.run(&functions.running, sample),
            Ask::ReportApplied => self.run(&functions.report_applied, sample),
            Ask::Start if self.run(&functions.start, sample) == [1] => self.run(&functions.tick, sample),
            Ask::Start => vec![0],
            Ask::Reset => self.run(&functions.reset, sample),
        }
    }

    fn state(&self) -> impl Iterator<Item = u64> {
        self.state.iter().map(|word| match *word {
            Word::Number(number) => bits(number),
            Word::Truth(truth) => u64::from(truth),
            Word::Count(count) => u64::from(count as u32),
        })
    }
}

/// Returns the state as in the trace: named words, zeros before the start.
fn state_of(driven: &dyn Driven, functions: &Functions, double: bool) -> Bits {
    let words = driven.words();
    let started = words[1] == 1;
    // The last word is a checksum.
    let mut words = words[2..words.len() - 1].iter().copied();
    let mut all = Bits::new();
    for name in driven.names() {
        let kept = functions.state.iter().find(|word| word.name == name);
        // Numbers are left out, and the flag of a controller without estimates.
        let left_out = if name == "resuming" { ValueKind::Truth } else { ValueKind::Number };
        let mut next = || words.next().map_or(0, u64::from);
        let word = match kept.map_or(left_out, |word| word.kind) {
            ValueKind::Number => next() | if double { next() << 32 } else { 0 },
            ValueKind::Truth | ValueKind::Count => next(),
        };
        if kept.is_some() {
            all.push(word);
        }
    }
    assert!(words.next().is_none());
    all.push(u64::from(started));
    all
}

/// Drives a controller, its trace and its C, and compares all bits.
pub(crate) fn compare(driven: &mut dyn Driven, functions: &Functions, plan: &Plan<'_>) {
    if plan.double { beside::<f64>(driven, functions, plan) } else { beside::<f32>(driven, functions, plan) }
}

fn beside<T: Real<Count = i32>>(driven: &mut dyn Driven, functions: &Functions, plan: &Plan<'_>) {
    let [n, rows, columns] = driven.lengths();
    let outputs = functions.tick.results.iter().filter(|port| port.role == Role::Output).count();
    let of_sample = |j| functions.running.inputs.iter().find(|port| port.role == Role::Sample(j));
    let kinds: Vec<ValueKind> = (0..n).map(|j| of_sample(j).map_or(ValueKind::Number, |port| port.kind)).collect();
    let mut samples = Samples::new(plan.seed);
    let mut machine = Machine::<T>::new(functions, driven.applied());
    let (mut asked, mut answers, mut ticks, mut seen) = (Vec::new(), Vec::new(), 0, [0_usize; 8]);
    while ticks < plan.ticks {
        let (ask, x) = (Ask::any(&mut samples.rng), driven.next(&mut samples, plan.double));
        let mut said = driven.ask(ask, &x);
        let word = |(j, bits): (usize, &u64)| match kinds[j] {
            ValueKind::Number => Word::Number(number(*bits)),
            ValueKind::Truth => Word::Truth(*bits == 1),
            ValueKind::Count => Word::Count(*bits as u32 as i32),
        };
        let sample: Vec<Word<T>> = x.iter().enumerate().map(word).collect();
        if ask == Ask::Tick {
            ticks += 1;
            seen[said[outputs] as usize] += 1;
        }
        let state = state_of(driven, functions, plan.double);
        let estimates: Bits = match driven.estimates() {
            Some(estimates) => estimates.into_iter().chain([1]).collect(),
            None => vec![0; rows * columns + 1],
        };
        if ticks <= plan.executed {
            assert_eq!(machine.ask(ask, &sample), said, "{}: the answer to tick {ticks}", plan.name);
            assert_eq!(machine.state().collect::<Bits>(), state, "{}: the state after tick {ticks}", plan.name);
            let recorded = machine.run(&functions.estimates, &[]);
            assert_eq!(recorded, estimates, "{}: the estimates after tick {ticks}", plan.name);
        }
        if said.len() == 1 {
            said.splice(0..0, vec![0; outputs]);
        }
        asked.push((ask, x));
        answers.push([said, state, estimates].concat());
    }
    let healthy: usize = seen.iter().step_by(2).sum();
    assert!(healthy > ticks / 20 && seen[1] > 0, "{}: the run shows too little: {seen:?}", plan.name);
    let estimates = (rows, columns);
    let applied = driven.applied();
    CProgram { name: plan.name, functions, samples: n, applied, estimates, double: plan.double }
        .compare(&asked, &answers);
}

/// Main program: requests in, answers out.
const MAIN: &str = "
static uint64_t number(@t@ value)
{
    union { @t@ number; uint@bits@_t bits; } both;
    both.number = value;
    return value == value ? (uint64_t)both.bits : ~(uint64_t)0;
}

int main(void)
{
    static memory state;
    static struct { uint64_t what; uint64_t x[@samples@]; } ask;
    while (fread(&ask, sizeof ask, 1, stdin) == 1) {
        @t@ x[@samples@];
        @t@ estimates[@rows@][@columns@];
        result output = { 0 };
        uint64_t said;
        for (size_t j = 0; j < @samples@; j++) {
            union { @t@ number; uint@bits@_t bits; } both;
            both.bits = (uint@bits@_t)ask.x[j];
            x[j] = both.number;
        }
        switch (ask.what) {
        /* The whole at once, and in its parts: both must be the same. */
        case 0: said = running(&state, x, ask.x, &output); break;
        case 4:
            said = state.started || start(&state, x, ask.x) ? tick(&state, x, ask.x, &output) : not_started(&output);
            break;
        case 1: said = report_applied(&state, x[@applied@]); break;
        case 2: said = start(&state, x, ask.x) ? tick(&state, x, ask.x, &output) : 0; break;
        default: reset(&state); said = 0; break;
        }
        const uint64_t known = estimate(&state, estimates);
        const uint64_t all[] = {
            @outputs@said,
            @state@
        };
        fwrite(all, sizeof all, 1, stdout);
        for (size_t i = 0; i < @rows@; i++) {
            for (size_t m = 0; m < @columns@; m++) {
                const uint64_t one = number(estimates[i][m]);
                fwrite(&one, sizeof one, 1, stdout);
            }
        }
        fwrite(&known, sizeof known, 1, stdout);
    }
    return 0;
}
";

/// The C of a trace as a program with requests in and answers out.
pub(crate) struct CProgram<'a> {
    pub(crate) name: &'a str,
    pub(crate) functions: &'a Functions,
    pub(crate) samples: usize,
    pub(crate) applied: usize,
    pub(crate) estimates: (usize, usize),
    pub(crate) double: bool,
}

impl CProgram<'_> {
    pub(crate) fn text(&self) -> String {
        let Self { functions, estimates: (rows, columns), double, .. } = self;
        let t = if *double { "double" } else { "float" };
        let place = |port: &Port| match port.role {
            Role::Sample(j) => match port.kind {
                ValueKind::Number => format!("x[{j}]"),
                ValueKind::Truth => format!("raw[{j}] == 1u"),
                ValueKind::Count => format!("(uint32_t)raw[{j}]"),
            },
            Role::State => format!("state->{}", port.name),
            Role::Output => format!("output->{}", port.name),
            Role::Estimate(i, m) => format!("estimates[{i}][{m}]"),
            Role::Flag(bit) => format!("{}u", 1 << bit),
            Role::Argument | Role::Between | Role::Answer => port.name.clone(),
        };
        let (meaning, double, signed) = (&|_: &str| String::new(), *double, "signed_count");
        let body = |record| c::Function { record, place: &place, meaning, double, signed }.body();
        let mut out =
            String::from("#include <stdbool.h>\n#include <stddef.h>\n#include <stdint.h>\n#include <stdio.h>\n");
        let fields = |words: &[Port]| -> String {
            let field = |port: &Port| {
                let t = match port.kind {
                    ValueKind::Number => t,
                    ValueKind::Truth => "bool",
                    ValueKind::Count => "uint32_t",
                };
                format!("    {t} {};\n", port.name)
            };
            words.iter().map(field).collect()
        };
        let outputs: Vec<Port> =
            functions.tick.results.iter().filter(|port| port.role == Role::Output).cloned().collect();
        let _ = write!(
            out,
            "typedef struct {{\n{}}} memory;\ntypedef struct {{\n{}}} result;\n",
            fields(&functions.state),
            fields(&outputs),
        );
        out += &c::signed(signed);
        let sample = format!("const {t} *x, const uint64_t *raw");
        for (head, record) in [
            (format!("bool start(memory *state, {sample})"), &functions.start),
            (format!("unsigned tick(memory *state, {sample}, result *output)"), &functions.tick),
            ("unsigned not_started(result *output)".into(), &functions.not_started),
            (format!("unsigned running(memory *state, {sample}, result *output)"), &functions.running),
            (format!("bool report_applied(memory *state, {t} u)"), &functions.report_applied),
            (format!("bool estimate(const memory *state, {t} estimates[{rows}][{columns}])"), &functions.estimates),
            ("void reset(memory *state)".into(), &functions.reset),
        ] {
            let _ = write!(out, "\nstatic {head}\n{{\n{}}}\n", body(record));
        }
        out.push_str(&self.main(&outputs));
        out
    }

    fn main(&self, outputs: &[Port]) -> String {
        let Self { functions, samples, applied, estimates: (rows, columns), double, .. } = self;
        let shown = |port: &Port, of: &str| match port.kind {
            ValueKind::Number => format!("number({of}.{}), ", port.name),
            _ => format!("{of}.{}, ", port.name),
        };
        let (t, bits) = if *double { ("double", "64") } else { ("float", "32") };
        let all = |ports: &[Port], of| ports.iter().map(|port| shown(port, of)).collect::<String>();
        MAIN.replace("@t@", t)
            .replace("@bits@", bits)
            .replace("@samples@", &samples.to_string())
            .replace("@applied@", &applied.to_string())
            .replace("@rows@", &rows.to_string())
            .replace("@columns@", &columns.to_string())
            .replace("@outputs@", &all(outputs, "output"))
            .replace("@state@", all(&functions.state, "state").trim_end_matches(", "))
    }

    /// Compiles the program, sends the requests, and compares the answers.
    pub(crate) fn compare(&self, asked: &[(Ask, Vec<u64>)], answers: &[Bits]) {
        let t = if self.double { "f64" } else { "f32" };
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{t}", self.name));
        std::fs::create_dir_all(&folder).expect("a folder");
        let (source, program) = (folder.join("program.c"), folder.join("program"));
        std::fs::write(&source, self.text()).expect("the source");
        let options = [
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-pedantic",
            "-Wshadow",
            "-Wno-unused-parameter",
            "-O1",
            "-ffp-contract=off",
        ];
        let compiled = Command::new("cc").args(options).arg(&source).arg("-o").arg(&program).output().expect("cc runs");
        assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
        let mut requests = Vec::new();
        for (k, (ask, x)) in asked.iter().enumerate() {
            // Every other tick in its parts.
            let what = if *ask == Ask::Tick && k % 2 == 1 { 4 } else { *ask as u64 };
            requests.extend([what].iter().chain(x).flat_map(|word| word.to_le_bytes()));
        }
        let mut child =
            Command::new(&program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the program starts");
        let mut to = child.stdin.take().expect("its input");
        let writer = std::thread::spawn(move || to.write_all(&requests).expect("it reads"));
        let output = child.wait_with_output().expect("it ends");
        writer.join().expect("all was written");
        let words: Vec<u64> = output.stdout.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes)).collect();
        assert_eq!(words.len(), answers.iter().map(Vec::len).sum::<usize>(), "{}: words of the answers", self.name);
        for (k, (answered, expected)) in words.chunks(answers[0].len()).zip(answers).enumerate() {
            assert_eq!(answered, expected, "{}: answer {k} of the C program", self.name);
        }
        std::fs::remove_dir_all(&folder).expect("the folder goes");
    }
}
