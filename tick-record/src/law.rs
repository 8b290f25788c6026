//! Traces of the functions of a control law: the code of `controller-core`, run with a recording scalar.

use std::cell::{Cell, OnceCell, RefCell};
use std::rc::Rc;

use controller_core::{
    Coefficients, ControlLaw, Controller, Gate, Gated, LAYOUT, Linear, MAX_N, NominalModel, Output, Real, RetuneError,
    Running, SampleLimits, Shape, Words as _,
};

use crate::record::{Port, Record, Role, ValueKind};
use crate::recorder::{Recorder, StateWord, Symbol, every_way, port, record};

/// A control law over the recording scalar, with names for its inputs and outputs.
pub trait Recorded: ControlLaw<Scalar = Symbol> + 'static {
    /// Returns the names of the state words in order.
    fn state_names() -> Vec<String>;

    /// Returns the sample, taken from the inputs.
    fn sample(&self, recorder: &Recorder) -> Self::Sample;

    /// Adds an output to the results.
    fn put_output(recorder: &Recorder, output: &Self::Output);

    /// Adds estimates to the results; zeros if there are none.
    fn put_estimates(recorder: &Recorder, estimates: Option<&Self::Estimates>);
}

/// The functions of a control law, each as a trace. A state word has one name as input and as result; before the start
/// every word is 0. Unused words are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Functions {
    /// The state words; `started` is the last one.
    pub state: Vec<Port>,
    /// [`ControlLaw::start_from`]: sample -> state. The answer is true if it has started; otherwise the state is
    /// unchanged.
    pub start: Record,
    /// [`ControlLaw::tick`]: state, sample -> output, state.
    pub tick: Record,
    /// [`ControlLaw::not_started`]: the output before the first valid sample.
    pub not_started: Record,
    /// [`Running::tick`] as a whole: all three.
    pub running: Record,
    /// [`Running::report_applied`]: state, `u` -> state, answer.
    pub report_applied: Record,
    /// [`Running::estimates`]: state -> estimates; zeros and the answer false before the start.
    pub estimates: Record,
    /// [`Running::reset`]: the state before the start.
    pub reset: Record,
}

const STARTED: &str = "started";
const ANSWER: &str = "answer";

/// Records a control law. `design` creates the law and its guess of the disturbances from
/// [constants](Recorder::constant).
///
/// # Panics
/// If the law violates the rules of [`record`] for a function, or if its names do not fit its state.
pub fn functions<D: Recorded>(design: &dyn Fn(&Recorder) -> (D, D::Guess)) -> Functions {
    let law = |recorder: &Recorder| -> Rc<dyn Law> {
        let (law, guess) = recorder.silently(|| design(recorder));
        Rc::new(Designed { law, guess })
    };
    let mut words = Words::of(&D::state_names(), &law);
    let all = all(&law, &words);
    if words.0.iter().all(|word| all.read(word)) {
        return all;
    }
    words.1 = words.0.iter().map(|word| all.read(word)).collect();
    self::all(&law, &words)
}

fn all(design: &dyn Fn(&Recorder) -> Rc<dyn Law>, words: &Words) -> Functions {
    let Around { start, not_started, report_applied, estimates, reset } = Around::of(design, words);
    Functions {
        state: words.ports(),
        start,
        tick: recorded(design, &|recorder, law| {
            let mut state = words.take(recorder);
            law.tick(recorder, &mut state);
            words.put(recorder, &state);
        }),
        not_started,
        running: running(design, words, &|_, running| running.tick(&())),
        report_applied,
        estimates,
        reset,
    }
}

/// Records a function of a law. The law is created once, so its constants are shared by all paths.
pub(crate) fn recorded<L>(design: &dyn Fn(&Recorder) -> L, f: &dyn Fn(&Recorder, &L)) -> Record {
    let law = OnceCell::new();
    every_way(&mut |recorder| f(recorder, law.get_or_init(|| design(recorder))))
}

/// Records one tick of a law, with all state words among inputs and results. `design` creates the law from constants or
/// from [numbers](Recorder::number) that any design may hold. `tick` is [`ControlLaw::tick`] or a variant of it.
pub fn tick<D: Recorded>(
    design: &dyn Fn(&Recorder) -> D,
    tick: fn(&D, &mut D::State, &D::Sample) -> D::Output,
) -> Record {
    part(design, &|recorder, law, state| D::put_output(recorder, &tick(law, state, &law.sample(recorder))))
}

/// Records a part of a tick, with all state words among inputs and results.
pub(crate) fn part<D: Recorded>(
    design: &dyn Fn(&Recorder) -> D,
    part: &dyn Fn(&Recorder, &D, &mut D::State),
) -> Record {
    let law = |recorder: &Recorder| recorder.silently(|| design(recorder));
    let erased = |recorder: &Recorder| -> Rc<dyn Law> { Rc::new(Designed { law: law(recorder), guess: D::NO_GUESS }) };
    let words = Words::of(&D::state_names(), &erased);
    recorded(&law, &|recorder, law| {
        let mut state = words.state(recorder);
        part(recorder, law, &mut state);
        words.put(recorder, &Designed::<D>::words(&state));
    })
}

/// The functions of a running law, each as a trace, with all state words.
#[derive(Clone, Debug, PartialEq)]
pub struct Whole {
    /// The state words; `started` is the last one.
    pub state: Vec<Port>,
    /// [`Running::tick`]: state, sample -> output, state.
    pub tick: Record,
    /// [`Running::report_applied`]: state, `u` -> state, answer.
    pub report_applied: Record,
    /// [`ControlLaw::estimates`]: the state of a started law -> estimates. The answer is true if there are estimates.
    pub estimates: Record,
    /// [`Running::reset`].
    pub reset: Record,
}

/// Records a running law. `design` creates the law and its guess of the disturbances from constants or from
/// [numbers](Recorder::number) that any design may hold.
pub fn whole<D: Recorded>(design: &dyn Fn(&Recorder) -> (D, D::Guess)) -> Whole {
    let law = |recorder: &Recorder| -> Rc<dyn Law> {
        let (law, guess) = recorder.silently(|| design(recorder));
        Rc::new(Designed { law, guess })
    };
    let words = Words::of(&D::state_names(), &law);
    Whole {
        state: words.ports(),
        tick: running(&law, &words, &|_, running| running.tick(&())),
        report_applied: report_applied(&law, &words),
        estimates: recorded(&law, &|recorder, law| {
            law.estimates(recorder, &words.take(recorder));
            recorder.put_truth(ANSWER, Role::Answer, true);
        }),
        reset: running(&law, &words, &|_, running| running.reset()),
    }
}

fn report_applied(design: &dyn Fn(&Recorder) -> Rc<dyn Law>, words: &Words) -> Record {
    running(design, words, &|recorder, running| {
        let u = recorder.number("u", Role::Argument);
        let taken = running.report_applied(u);
        recorder.put_truth(ANSWER, Role::Answer, taken);
    })
}

/// Returns the coefficients of any design: named inputs, in the order of [`LAYOUT`].
///
/// # Panics
/// If the mask does not have O channels.
pub fn coefficients<const N: usize, const R: usize, const O: usize>(
    recorder: &Recorder,
    mask: u8,
) -> Coefficients<Symbol, N, R, O> {
    coefficients_of(mask, &mut |name| recorder.number(name, Role::Argument))
}

/// Returns the coefficients that `number` returns by name.
pub(crate) fn coefficients_of<U: Real, const N: usize, const R: usize, const O: usize>(
    mask: u8,
    number: &mut dyn FnMut(&str) -> U,
) -> Coefficients<U, N, R, O> {
    let names = coefficient_names(N, R, mask);
    let numbers = names.iter().map(|name| number(name));
    Coefficients::from_trusted_numbers(numbers).expect("a name for every coefficient")
}

/// Records a function of a running law.
fn running(
    design: &dyn Fn(&Recorder) -> Rc<dyn Law>,
    words: &Words,
    during: &dyn Fn(&Recorder, &mut Running<Erased>),
) -> Record {
    recorded(design, &|recorder, law| {
        let started = recorder.truth(STARTED, Role::State);
        let before = words.take(recorder);
        REPORT_APPLIED.set(Some(law.report_applied()));
        let mut running = Running::new(Erased { law: law.clone(), given: RefCell::new(None) });
        if started {
            running.design().given.replace(Some(before.clone()));
            running.tick(&());
            running.design().given.replace(None);
        }
        during(recorder, &mut running);
        running.design().given.replace(Some(Vec::new()));
        let after = running.estimates();
        match (started, &after) {
            (_, Some(after)) => words.put(recorder, after),
            (true, None) => words.put(recorder, &vec![0; before.len()]),
            (false, None) => words.put(recorder, &before),
        }
        recorder.put_truth(STARTED, Role::State, after.is_some());
    })
}

/// The functions of a law other than its ticks.
pub(crate) struct Around {
    pub(crate) start: Record,
    pub(crate) not_started: Record,
    pub(crate) report_applied: Record,
    pub(crate) estimates: Record,
    pub(crate) reset: Record,
}

/// Records the functions of a law other than its ticks, with all state words.
pub(crate) fn around<D: Recorded>(design: &dyn Fn(&Recorder) -> (D, D::Guess)) -> (Words, Around) {
    let law = |recorder: &Recorder| -> Rc<dyn Law> {
        let (law, guess) = design(recorder);
        Rc::new(Designed { law, guess })
    };
    let words = Words::of(&D::state_names(), &law);
    let around = Around::of(&law, &words);
    (words, around)
}

impl Around {
    fn of(design: &dyn Fn(&Recorder) -> Rc<dyn Law>, words: &Words) -> Self {
        let running = |during: &dyn Fn(&Recorder, &mut Running<Erased>)| running(design, words, during);
        Self {
            start: recorded(design, &|recorder, law| {
                let started = recorder.truth(STARTED, Role::State);
                let before = words.take(recorder);
                let state = law.start(recorder);
                words.put(recorder, state.as_ref().unwrap_or(&before));
                recorder.put_truth(STARTED, Role::State, started || state.is_some());
                recorder.put_truth(ANSWER, Role::Answer, state.is_some());
            }),
            not_started: recorded(design, &|recorder, law| law.not_started(recorder)),
            report_applied: report_applied(design, words),
            estimates: running(&|recorder, running| {
                let known = running.estimates().is_some();
                if !known {
                    running.design().law.no_estimates(recorder);
                }
                recorder.put_truth(ANSWER, Role::Answer, known);
            }),
            reset: running(&|_, running| running.reset()),
        }
    }
}

/// A control law without its type: its state is words, and it reads its inputs and writes its results itself. Many
/// configurations then share one instantiation.
trait Law {
    fn start(&self, recorder: &Recorder) -> Option<Vec<u32>>;
    fn not_started(&self, recorder: &Recorder);
    fn tick(&self, recorder: &Recorder, state: &mut Vec<u32>);
    fn lost(&self, recorder: &Recorder, state: &mut Vec<u32>);
    fn report_applied(&self) -> ReportApplied;
    fn estimates(&self, recorder: &Recorder, state: &[u32]);
    fn no_estimates(&self, recorder: &Recorder);
}

type ReportApplied = fn(&mut Vec<u32>, Symbol) -> bool;

// `report_applied` is the only function of a law that has no access to the law.
thread_local!(static REPORT_APPLIED: Cell<Option<ReportApplied>> = const { Cell::new(None) });

struct Designed<D: Recorded> {
    law: D,
    guess: D::Guess,
}

impl<D: Recorded> Designed<D> {
    #[inline(never)]
    fn state(recorder: &Recorder, words: &[u32]) -> D::State {
        recorder.silently(|| D::State::from_words(&mut words.iter().copied())).expect("the words of a state")
    }

    #[inline(never)]
    fn words(state: &D::State) -> Vec<u32> {
        state.words().collect()
    }
}

impl<D: Recorded> Law for Designed<D> {
    fn start(&self, recorder: &Recorder) -> Option<Vec<u32>> {
        self.law.start_from(&self.law.sample(recorder), &self.guess).map(|state| Self::words(&state))
    }
    fn not_started(&self, recorder: &Recorder) {
        D::put_output(recorder, &self.law.not_started());
    }
    fn tick(&self, recorder: &Recorder, words: &mut Vec<u32>) {
        let mut state = Self::state(recorder, words);
        D::put_output(recorder, &self.law.tick(&mut state, &self.law.sample(recorder)));
        *words = Self::words(&state);
    }
    fn lost(&self, recorder: &Recorder, words: &mut Vec<u32>) {
        let mut state = Self::state(recorder, words);
        D::put_output(recorder, &self.law.lost(&mut state));
        *words = Self::words(&state);
    }
    fn report_applied(&self) -> ReportApplied {
        |words, u| {
            let mut state = Self::state(&Recorder::of_this_thread(), words);
            let taken = D::report_applied(&mut state, u);
            *words = Self::words(&state);
            taken
        }
    }
    fn estimates(&self, recorder: &Recorder, words: &[u32]) {
        D::put_estimates(recorder, Some(&self.law.estimates(&Self::state(recorder, words))));
    }
    fn no_estimates(&self, recorder: &Recorder) {
        D::put_estimates(recorder, None);
    }
}

/// The law inside [`Running`], through which `Running` is recorded. While a state is `given` nothing is computed: a
/// start takes this state, and the estimates are the words of the running state.
struct Erased {
    law: Rc<dyn Law>,
    given: RefCell<Option<Vec<u32>>>,
}

#[derive(Clone)]
struct ErasedState(Vec<u32>);

impl controller_core::Words for ErasedState {
    fn words(&self) -> impl Iterator<Item = u32> {
        self.0.iter().copied()
    }
    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        Some(Self(words.collect()))
    }
}

impl ControlLaw for Erased {
    type Scalar = Symbol;
    type Sample = ();
    type Output = ();
    type State = ErasedState;
    type Guess = [Symbol; 0];
    type Estimates = Vec<u32>;
    const NO_GUESS: [Symbol; 0] = [];

    fn start_from(&self, (): &(), _: &[Symbol; 0]) -> Option<ErasedState> {
        let given = self.given.borrow().clone();
        given.or_else(|| self.law.start(&Recorder::of_this_thread())).map(ErasedState)
    }
    fn not_started(&self) {
        self.law.not_started(&Recorder::of_this_thread());
    }
    fn tick(&self, state: &mut ErasedState, (): &()) {
        if self.given.borrow().is_none() {
            self.law.tick(&Recorder::of_this_thread(), &mut state.0);
        }
    }
    fn lost(&self, state: &mut ErasedState) {
        self.law.lost(&Recorder::of_this_thread(), &mut state.0);
    }
    fn report_applied(state: &mut ErasedState, u: Symbol) -> bool {
        let report_applied = REPORT_APPLIED.get().expect("a running law");
        report_applied(&mut state.0, u)
    }
    fn estimates(&self, state: &ErasedState) -> Vec<u32> {
        if self.given.borrow().is_none() {
            self.law.estimates(&Recorder::of_this_thread(), &state.0);
        }
        state.0.clone()
    }
    fn take_over(&self, _: &Self, _: &ErasedState, (): &()) -> Result<ErasedState, RetuneError> {
        Err(RetuneError::Sample)
    }
    fn fingerprint(&self) -> u32 {
        0
    }
}

impl Functions {
    /// Returns whether another value depends on the word. The last b(x) is unused where b is constant.
    fn read(&self, word: &Port) -> bool {
        let Self { state: _, start, tick, not_started, running, report_applied, estimates, reset } = self;
        [start, tick, not_started, running, report_applied, estimates, reset].iter().any(|record| record.reads(word))
    }
}

/// The words of a state without `started`, and which of them are kept.
pub(crate) struct Words(Vec<Port>, Vec<bool>);

impl Words {
    /// Returns the kept words and `started`.
    pub(crate) fn ports(&self) -> Vec<Port> {
        self.kept().map(|(word, _)| word.clone()).chain([port(STARTED, Role::State, ValueKind::Truth)]).collect()
    }

    /// Returns the words without one that is always 0.
    pub(crate) fn without(&self, name: &str) -> Self {
        let kept = self.0.iter().zip(&self.1).map(|(word, kept)| *kept && word.name != name).collect();
        Self(self.0.clone(), kept)
    }

    /// Returns the state, taken from the inputs.
    pub(crate) fn state<S: controller_core::Words>(&self, recorder: &Recorder) -> S {
        let words = self.take(recorder);
        recorder.silently(|| S::from_words(&mut words.into_iter())).expect("the words of a state")
    }

    /// Takes the kinds of the words from the first state that starts.
    fn of(names: &[String], law: &dyn Fn(&Recorder) -> Rc<dyn Law>) -> Self {
        let mut words = Vec::new();
        record(|recorder| {
            let Some(state) = law(recorder).start(recorder).filter(|_| words.is_empty()) else { return };
            assert_eq!(names.len(), state.len(), "a name for every word of the state: {names:?}");
            let kinds = state.iter().map(|word| StateWord::of(*word).kind());
            words = names.iter().zip(kinds).map(|(name, kind)| port(name, Role::State, kind)).collect();
        });
        assert_eq!(names.len(), words.len(), "a law that can start");
        let kept = vec![true; words.len()];
        Self(words, kept)
    }

    /// Returns the kept words with their positions.
    fn kept(&self) -> impl Iterator<Item = (&Port, usize)> {
        self.0.iter().zip(0..).zip(&self.1).filter_map(|(word, kept)| kept.then_some(word))
    }

    fn take(&self, recorder: &Recorder) -> Vec<u32> {
        let take = |word: &Port| match word.kind {
            ValueKind::Number => StateWord::Number(recorder.number(&word.name, word.role)),
            ValueKind::Count => StateWord::Count(recorder.count(&word.name, word.role)),
            ValueKind::Truth => StateWord::Truth(recorder.truth(&word.name, word.role)),
        };
        let zero = |word: &Port| match word.kind {
            ValueKind::Number => StateWord::Number(Symbol::ZERO),
            ValueKind::Count => StateWord::Count(recorder.count_of(0)),
            ValueKind::Truth => StateWord::Truth(false),
        };
        let mut words: Vec<u32> = self.0.iter().map(|word| zero(word).to_word()).collect();
        self.kept().for_each(|(word, at)| words[at] = take(word).to_word());
        words
    }

    /// Writes the new values of the words; the word 0 is zero of every kind.
    pub(crate) fn put(&self, recorder: &Recorder, words: &[u32]) {
        for (port, at) in self.kept() {
            match (StateWord::of(words[at]), port.kind) {
                (StateWord::Number(number), ValueKind::Number) => recorder.put(&port.name, port.role, number),
                (StateWord::Count(count), ValueKind::Count) => recorder.put_count(&port.name, port.role, count),
                (StateWord::Truth(truth), ValueKind::Truth) => recorder.put_truth(&port.name, port.role, truth),
                (StateWord::Truth(false), ValueKind::Number) => recorder.put(&port.name, port.role, Symbol::ZERO),
                (StateWord::Truth(false), ValueKind::Count) => {
                    recorder.put_count(&port.name, port.role, recorder.count_of(0));
                }
                _ => panic!("`{}` changes its kind", port.name),
            }
        }
    }
}

/// A, B, C: the folded estimate of one channel.
const FOLDED: [char; 3] = ['a', 'b', 'c'];

impl<M, const N: usize, const R: usize, const MASK: u8, const O: usize> Recorded
    for Controller<Symbol, M, N, R, MASK, O>
where
    M: NominalModel<Symbol, N> + 'static,
{
    fn state_names() -> Vec<String> {
        let channels = || observed(N, MASK);
        let folded = channels().flat_map(|i| FOLDED[..R].iter().map(move |letter| format!("{letter}{i}")));
        let (past, x_prev) = (channels().map(|i| format!("p{i}")), channels().map(|i| format!("x{i}_prev")));
        let last = ["offset", "held", "gain_prev"].map(String::from);
        ["resuming".into()].into_iter().chain(folded).chain(past).chain(x_prev).chain(last).collect()
    }

    fn sample(&self, recorder: &Recorder) -> [Symbol; N] {
        core::array::from_fn(|j| recorder.number(&format!("x{}", j + 1), Role::Sample(j)))
    }

    fn put_output(recorder: &Recorder, output: &Output<Symbol>) {
        for (name, number) in [("u", output.u), ("sigma", output.sigma), ("sigma_star", output.sigma_star)] {
            recorder.put(name, Role::Output, number);
        }
        for (bit, name) in ["input_rejected", "saturated", "sigma_star_over_bound"].into_iter().enumerate() {
            let set = output.health.bits() >> bit & 1 == 1;
            recorder.put_truth(name, Role::Flag(bit as u8), set);
        }
    }

    fn put_estimates(recorder: &Recorder, estimates: Option<&[[Symbol; R]; N]>) {
        for i in 0..N {
            for m in 0..R {
                let name = format!("d{}_hat{}", i + 1, ["", "_dot", "_ddot"][m]);
                let number = estimates.map_or(Symbol::ZERO, |estimates| estimates[i][m]);
                recorder.put(&name, Role::Estimate(i, m), number);
            }
        }
    }
}

impl<D, const N: usize> Recorded for Gated<D, N>
where
    D: Recorded + ControlLaw<Sample = [Symbol; N]>,
{
    fn state_names() -> Vec<String> {
        D::state_names().into_iter().chain((1..=N).map(|j| format!("x{j}_seen"))).collect()
    }
    fn sample(&self, recorder: &Recorder) -> [Symbol; N] {
        self.law().sample(recorder)
    }
    fn put_output(recorder: &Recorder, output: &D::Output) {
        D::put_output(recorder, output);
    }
    fn put_estimates(recorder: &Recorder, estimates: Option<&D::Estimates>) {
        D::put_estimates(recorder, estimates);
    }
}

/// Returns the observed channels, from 1.
fn observed(n: usize, mask: u8) -> impl Iterator<Item = usize> {
    (1..=n).filter(move |i| mask >> (i - 1) & 1 == 1)
}

/// Returns the names of the coefficients in the order of [`LAYOUT`], with channel and order: `gamma2_1`, `k4_b`,
/// `kx_3`.
fn coefficient_names(n: usize, r: usize, mask: u8) -> Vec<String> {
    let mut names = Vec::new();
    for field in LAYOUT.split_whitespace() {
        match field.split_once('[') {
            None => names.push(field.into()),
            Some((name, "N]")) => names.extend((1..=n).map(|j| format!("{name}_{j}"))),
            // γ_1 .. γ_r; the rows of σ and of the law belong to A, B, C.
            Some(("gamma", _)) => {
                names.extend(observed(n, mask).flat_map(|i| (1..=r).map(move |m| format!("gamma{i}_{m}"))));
            }
            Some((name, _)) => {
                let of = |i| FOLDED[..r].iter().map(move |letter| format!("{name}{i}_{letter}"));
                names.extend(observed(n, mask).flat_map(of));
            }
        }
    }
    names
}

/// Returns coefficients from numbers, in the order of [`LAYOUT`].
pub(crate) fn of_numbers<const N: usize, const R: usize, const O: usize>(
    recorder: &Recorder,
    numbers: &[f64],
    mask: u8,
) -> Coefficients<Symbol, N, R, O> {
    let names = coefficient_names(N, R, mask);
    let numbers = names.iter().zip(numbers).map(|(name, number)| recorder.constant(name, *number));
    Coefficients::from_trusted_numbers(numbers).expect("the coefficients of a design")
}

/// Records a controller with these coefficients, in the order of [`LAYOUT`], and these initial estimates in physical
/// units. With sample limits it is behind a sample gate. `model` is its nominal model over the recording scalar,
/// created from [constants](Recorder::constant).
///
/// # Panics
/// If there are too few coefficients, or if the model uses more than `+ - * /`, comparisons and `abs`.
pub fn controller<M, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    coefficients: &[f64],
    model: &dyn Fn(&Recorder) -> M,
    guess: &[f64; N],
    samples: Option<&SampleLimits<N>>,
) -> Functions
where
    M: NominalModel<Symbol, N> + 'static,
{
    let law = |recorder: &Recorder| {
        let coefficients = of_numbers(recorder, coefficients, MASK);
        let law = Controller::<Symbol, M, N, R, MASK, O>::from_parts(coefficients, model(recorder));
        let guess = core::array::from_fn(|i| recorder.constant(&format!("d_hat_{}", i + 1), guess[i]));
        (law, guess)
    };
    let Some(SampleLimits { min, max, jump }) = samples else { return functions(&law) };
    functions(&|recorder| {
        let (law, guess) = law(recorder);
        let row =
            |name, row: &[f64; N]| core::array::from_fn(|j| recorder.constant(&format!("{name}_{}", j + 1), row[j]));
        (Gated::new(law, Gate::from_rows(row("x_min", min), row("x_max", max), row("x_jump", jump))), guess)
    })
}

/// Source of the nominal a(x)/b_0 and b(x)/b_0 of a recorded chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drift {
    /// [`controller_core::Linear`]: a product for every state.
    Linear,
    /// `Linear` without the products with 0, as in [`controller_core::FlexibleJoint`]; signs of zeros differ.
    Sparse,
    /// a(x)/b_0 is an argument, `drift`; b is constant.
    Argument,
    /// a(x)/b_0 and b(x)/b_0 are arguments, `drift` and `gain`.
    ArgumentWithGain,
}

/// The model of a [`Drift`].
#[derive(Clone, Copy)]
struct Chain<const N: usize> {
    drift: Drift,
    row: [Symbol; N],
    /// Entries of the row that are not 0.
    present: [bool; N],
}

impl<const N: usize> NominalModel<Symbol, N> for Chain<N> {
    fn drift(&self, x: &[Symbol; N]) -> Symbol {
        let products = || (0..N).map(|j| self.row[j] * x[j]);
        match self.drift {
            Drift::Linear => Linear::from_row(self.row).drift(x),
            Drift::Sparse => {
                let present = (0..N).filter(|j| self.present[*j]).map(|j| self.row[j] * x[j]);
                present.reduce(|sum, product| sum + product).or_else(|| products().next()).expect("N >= 2")
            }
            Drift::Argument | Drift::ArgumentWithGain => Recorder::of_this_thread().number("drift", Role::Argument),
        }
    }

    fn gain_ratio(&self, _: &[Symbol; N]) -> Option<Symbol> {
        let varies = self.drift == Drift::ArgumentWithGain;
        varies.then(|| Recorder::of_this_thread().number("gain", Role::Argument))
    }
}

macro_rules! linear_of_shape {
    ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
        /// Records a controller with a linear nominal model: [`chain`] with [`Drift::Linear`].
        pub fn linear(
            shape: Shape,
            coefficients: &[f64],
            row: &[f64],
            guess: &[f64],
            samples: Option<&SampleLimits<MAX_N>>,
        ) -> Option<Functions> {
            chain(shape, coefficients, Drift::Linear, row, guess, samples)
        }

        /// Records the controller of a chain. The coefficients are in the order of [`LAYOUT`]. `row` is a(x)/b_0, if it
        /// is linear, with the names `drift_1`, `drift_2`, ... `guess` are the initial estimates. `samples` are the
        /// sample limits, of which the first n entries are read. Returns `None` if there is no such configuration, or
        /// if a list is too short.
        pub fn chain(
            shape: Shape,
            coefficients: &[f64],
            drift: Drift,
            row: &[f64],
            guess: &[f64],
            samples: Option<&SampleLimits<MAX_N>>,
        ) -> Option<Functions> {
            match (shape.n, shape.r, shape.mask) {
                $(($n, $r, $mask) => {
                    let (row, guess) = (row.first_chunk::<$n>()?, guess.first_chunk::<$n>()?);
                    let model = |recorder: &Recorder| {
                        let entry = |j| recorder.constant(&format!("drift_{}", j + 1), row[j]);
                        Chain { drift, row: core::array::from_fn(entry), present: row.map(|entry| entry != 0.0) }
                    };
                    let wanted = Coefficients::<f64, $n, $r, $o>::NUMBERS - 1;
                    let samples = samples.map(|&SampleLimits { min, max, jump }| {
                        let [min, max, jump] = [min, max, jump].map(|row| core::array::from_fn(|j| row[j]));
                        SampleLimits::<$n> { min, max, jump }
                    });
                    (coefficients.len() >= wanted)
                        .then(|| controller::<_, $n, $r, $mask, $o>(coefficients, &model, guess, samples.as_ref()))
                })*
                _ => None,
            }
        }
    };
}
#[cfg(not(feature = "drives-only"))]
controller_core::shapes!(all => linear_of_shape);
#[cfg(feature = "drives-only")]
linear_of_shape! { n2_r2_c2: 2 2 0b10 1, }
