//! How fast the host is: one tick by order and precision, and one closed-loop second of the default scenario.
//!
//! `cargo bench -p benches --bench speed`; `-- lanes` for many plants at once. Times are of this machine and of this
//! moment: no test looks at them.

mod subjects;

use std::hint::black_box;
use std::time::{Duration, Instant};

use controller_core::ControlLaw;
use loop_sim::lanes::{Campaign, Instructions, LANES, Trial, close_loops, close_loops_with};
use loop_sim::sensor::Sensing;
use subjects::lanes::{self, L};

use benches::{Joint, Noise, Tuned, joint, joint_f64};
use criterion::{BatchSize, Criterion};

fn ticks(criterion: &mut Criterion) {
    let mut noise = Noise::new(1);
    let samples: Vec<[f32; 4]> = (0..1024).map(|_| noise.sample()).collect();
    let doubles: Vec<[f64; 4]> = samples.iter().map(|x| x.map(f64::from)).collect();
    let mut group = criterion.benchmark_group("one tick");
    macro_rules! tick {
        ($name:literal, $controller:expr, $samples:ident) => {
            group.bench_function($name, |bencher| {
                let controller = black_box($controller);
                let mut state = controller.start(&$samples[0]).expect("a finite sample");
                let mut next = $samples.iter().cycle();
                bencher.iter(|| next.next().map(|x| controller.tick(&mut state, x)));
            });
        };
    }
    tick!("r = 2, f32", joint::<2>(), samples);
    tick!("r = 3, f32", joint::<3>(), samples);
    tick!("r = 2, f64", joint_f64::<2>(), doubles);
    tick!("r = 3, f64", joint_f64::<3>(), doubles);
    group.bench_function("r = 2, f32, C by hand", |bencher| {
        let mut tuned = black_box(Tuned::<2, true>::start(&samples[0]));
        let mut next = samples.iter().cycle();
        bencher.iter(|| next.next().map(|x| tuned.tick(x)));
    });
    group.finish();
}

fn seconds(criterion: &mut Criterion) {
    criterion.bench_function("one closed-loop second, 1001 ticks", |bencher| {
        bencher.iter_batched_ref(subjects::second, subjects::closed_loop_second, BatchSize::SmallInput);
    });
}

/// With AVX-512 where the machine has it.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512vl+avx512dq+avx512bw+avx2+fma+bmi1+bmi2",
    "x86_64+avx2+fma+bmi1+bmi2"
))]
fn lanes_avx512(joint: &Joint<f32, 2>, states: &mut lanes::States, x: &[[f32; L]; 4], u: &mut [f32; L]) {
    lanes::tick_all(joint, states, x, u);
}

/// A call for each plant, so that it stays one after the other.
#[inline(never)]
fn alone(joint: &Joint<f32, 2>, state: &mut <Joint<f32, 2> as ControlLaw>::State, x: &[f32; 4]) -> f32 {
    joint.tick(state, x).u
}

/// Ticks per second of 64 plants, each way in turn and the best of several: ratios within one run.
fn plants() {
    let (joint, mut noise) = (black_box(joint::<2>()), Noise::new(1));
    let samples: Vec<[[f32; L]; 4]> = (0..256)
        .map(|_| {
            let all: [[f32; 4]; L] = std::array::from_fn(|_| noise.sample());
            std::array::from_fn(|j| all.map(|x| x[j]))
        })
        .collect();
    let state = joint.start(&[0.0; 4]).expect("a finite sample");
    let mut states: [_; L] = std::array::from_fn(|_| state.clone());
    let (mut lanes, mut u) = (state.lanes::<L>(), [0.0; L]);
    let mut best = [f64::INFINITY; 4];
    for _ in 0..40 {
        let mut timed = |way: usize, tick: &mut dyn FnMut(&[[f32; L]; 4])| {
            let began = Instant::now();
            for x in samples.iter().cycle().take(20 * samples.len()) {
                tick(black_box(x));
            }
            best[way] = best[way].min(began.elapsed().as_secs_f64() / (20 * samples.len() * L) as f64);
        };
        timed(0, &mut |x| {
            for l in 0..L {
                u[l] = alone(&joint, &mut states[l], &[x[0][l], x[1][l], x[2][l], x[3][l]]);
            }
        });
        timed(1, &mut |x| lanes::lanes_baseline(&joint, &mut lanes, x, &mut u));
        timed(2, &mut |x| lanes::lanes_avx2(&joint, &mut lanes, x, &mut u));
        timed(3, &mut |x| lanes_avx512(&joint, &mut lanes, x, &mut u));
        black_box(&u);
    }
    println!("ticks of {L} plants, r = 2, f32      M ticks/s   over one by one");
    for (way, seconds) in ["one by one", "lanes, SSE2", "lanes, AVX2", "lanes, AVX-512"].iter().zip(best) {
        println!("  {way:<30} {:>10.1} {:>12.1}", 1e-6 / seconds, best[0] / seconds);
    }
}

/// Ticks per second of 64 closed loops, plant and figures of merit included (the last quarter in the window), with each
/// set of instructions in turn and with two threads, the best of several: ratios within one run.
fn loops() {
    const PERIODS: usize = 2000;
    let experiment = subjects::second();
    let (ideal, trial) = experiment.beside().expect("a loop that fits");
    let noise = Sensing { noise: vec![1e-5; 4], ..Sensing::IDEAL };
    let ideal = Campaign { periods: PERIODS, window_s: [1.5, 2.0], ..ideal };
    let noisy = Campaign { sensing: &noise, ..ideal };
    let trials: Vec<Trial<'_>> = (0..LANES as u64).map(|seed| Trial { seed, ..trial }).collect();
    let best = |run: &dyn Fn()| {
        let timed = |_| {
            let began = Instant::now();
            run();
            began.elapsed().as_secs_f64()
        };
        1e-6 * (PERIODS * LANES) as f64 / (0..100).map(timed).fold(f64::INFINITY, f64::min)
    };
    println!("{LANES} closed loops of the joint, r = 2, f32   M ticks/s   with four noises a tick");
    let sets = [Instructions::Baseline, Instructions::Avx2, Instructions::Avx512];
    for (set, name) in sets.into_iter().zip(["SSE2", "AVX2", "AVX-512"]) {
        let [ideal, noisy] =
            [&ideal, &noisy].map(|campaign| best(&|| _ = black_box(close_loops_with(set, campaign, &trials))));
        println!("  {name:<37} {ideal:>10.1} {noisy:>25.1}");
    }
    let one = || _ = black_box(close_loops(&ideal, &trials));
    let both = || {
        std::thread::scope(|scope| {
            scope.spawn(one);
            scope.spawn(one);
        });
    };
    let (alone, both) = (best(&one), 2.0 * best(&both));
    println!("  two threads over one {:>27.2}", both / alone);
}

fn main() {
    if std::env::args().any(|argument| argument == "lanes") {
        plants();
        return loops();
    }
    let length = Duration::from_secs(2);
    let mut criterion =
        Criterion::default().warm_up_time(length / 4).measurement_time(length).sample_size(50).configure_from_args();
    ticks(&mut criterion);
    seconds(&mut criterion);
    criterion.final_summary();
}
