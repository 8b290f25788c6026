//! Speed of the host: one tick by order and precision, and one closed-loop second of the default scenario.
//!
//! The command is `cargo run --release --manifest-path benches/speed/Cargo.toml -- --bench`; the bench `lanes` measures
//! many plants at once. Times depend on the machine and the moment; no test checks them.

#[path = "../../benches/subjects/second.rs"]
mod second;

use std::hint::black_box;
use std::time::Duration;

use controller_core::ControlLaw;

use benches::{Noise, Tuned, joint, joint_f64};
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
        bencher.iter_batched_ref(second::second, second::closed_loop_second, BatchSize::SmallInput);
    });
}

fn main() {
    let length = Duration::from_secs(2);
    let mut criterion =
        Criterion::default().warm_up_time(length / 4).measurement_time(length).sample_size(50).configure_from_args();
    ticks(&mut criterion);
    seconds(&mut criterion);
    criterion.final_summary();
}
